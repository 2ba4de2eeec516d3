//! Learns which light of the lamps matters, from photons that are followed to their first diffuse
//! surface and no further.

use std::sync::atomic::{AtomicBool, Ordering};

use rayon::prelude::*;

use crate::{
    math::{
        rng::{Purpose, Stream, Streams},
        spectrum::Lanes,
    },
    scene::{
        light::{Emission, Strata, sources},
        material::Scatterer,
        world::Scene,
    },
    transport::{
        guiding::{EmissionTree, Importance, Lamps, Sample, emit_at},
        trace::scatter,
    },
};

/// Number of photons that are first sent without a guide. It is multiplied by four as long as the
/// error is too large.
const FIRST_PHOTONS: u64 = 1 << 15;
/// Number of photons of a guided round, but at most one in [`GUIDED_SHARE`] of the most that are
/// tried.
const GUIDED: u64 = 1 << 16;
const GUIDED_SHARE: u64 = 4;
/// The most mirrors and panes that a photon may meet on its way.
const MOST_SMOOTH: u32 = 100;
/// The relative error of the unguided mean that is small enough for a comparison.
const SURE: f64 = 0.2;
/// The unguided and the guided mean agree if they differ by at most this many standard errors.
const AGREE: f64 = 3.0;
/// Guiding a lamp pays where it makes the variance at least this many times smaller.
const GAIN: f64 = 2.0;
/// Fraction of the photons that is shared among the lamps in proportion to their power.
const BY_POWER: f64 = 0.2;
/// The least number of photons that one thread sends at a time.
const BLOCK: usize = 4096;

/// Too few photons were found that matter to say how the lamps should emit.
pub(super) struct Starved;

/// One photon, and how much it matters where it first meets a diffuse surface.
#[derive(Clone, Copy)]
struct Weighed {
    source: usize,
    sample: Sample,
    /// Density with which it was emitted, over the density without a guide.
    density: f64,
}

impl Weighed {
    /// What the photon contributes to the mean.
    fn weighted(&self) -> f64 {
        self.sample.value / self.density
    }
}

/// Learns how the lamps should emit; `None` where it gains too little. At most `most` photons are
/// sent without a guide, and none once `stop` is set. Error: too few of these matter, or their mean
/// does not agree with that of guided photons.
pub(super) fn learn<L: Lanes>(
    scene: &Scene,
    importance: &Importance,
    seed: u64,
    most: u64,
    stop: &AtomicBool,
) -> Result<Option<Lamps>, Starved> {
    if importance.is_zero() {
        return Ok(None);
    }
    let none = Lamps { shares: None, trees: vec![None; sources(scene.lights())] };
    let streams = |round: u64| Streams::new(seed, Purpose::Lamps, round);
    let guided_photons = GUIDED.min(most / GUIDED_SHARE).max(2 * sources(scene.lights()) as u64);
    let mut photons = FIRST_PHOTONS.max(2 * sources(scene.lights()) as u64);
    let send = |lamps: &Lamps, round: u64, photons: u64| {
        send::<L>(scene, importance, lamps, streams(round), photons, stop)
    };
    let mut free = send(&none, photons, photons);
    loop {
        let (mean, error) = estimate(&free);
        if mean > 0.0 && error <= SURE * mean {
            let mut lamps = Lamps { shares: None, trees: trees(&none, &free) };
            let again = send(&lamps, 0, guided_photons);
            lamps.trees = trees(&lamps, &again);
            let guided = send(&lamps, 1, guided_photons);
            let (own, own_error) = estimate(&guided);
            if (own - mean).abs() <= AGREE * own_error.hypot(error) {
                return Ok(worth(&free, &guided, lamps));
            }
        }
        if photons >= most || stop.load(Ordering::Relaxed) {
            return Err(Starved);
        }
        photons = (4 * photons).min(most);
        free = send(&none, photons, photons);
    }
}

/// Sends photons to the first diffuse surface that each meets, and returns how much they matter
/// there.
fn send<L: Lanes>(
    scene: &Scene,
    importance: &Importance,
    lamps: &Lamps,
    streams: Streams,
    photons: u64,
    stop: &AtomicBool,
) -> Vec<Weighed> {
    let strata = Strata::new(scene.lights(), photons, scene.lanes());
    let one = |index: u64| {
        let mut rng = streams.history(index);
        let source = strata.source(index);
        let (numbers, density) = match &lamps.trees[source] {
            Some(tree) => tree.choose(&mut rng),
            None => (std::array::from_fn(|_| rng.uniform()), 1.0),
        };
        let value = match stop.load(Ordering::Relaxed) {
            true => 0.0,
            false => {
                let photon = emit_at::<L>(scene, &strata, index, numbers, &mut rng);
                matters(scene, importance, photon, &mut rng)
            }
        };
        Weighed { source, sample: Sample { numbers, value }, density: density.into() }
    };
    // in the order of the photons, whichever thread was first
    (0..photons as usize).into_par_iter().with_min_len(BLOCK).map(|i| one(i as u64)).collect()
}

/// Returns the importance where a photon first meets a diffuse surface, times the photon's power.
fn matters<L: Lanes>(
    scene: &Scene,
    importance: &Importance,
    photon: Emission<'_, L>,
    rng: &mut Stream,
) -> f64 {
    let largest = photon.weights.iter().copied().fold(0.0, f64::max);
    let (mut ray, mut power) = (photon.ray, photon.power);
    for _ in 0..MOST_SMOOTH {
        let Some(at) = scene.arrive(&ray) else { break };
        if at.material.is_diffuse() {
            let value = importance.at(&at.hit, at.interaction.front);
            return largest * f64::from(power.largest() * value);
        }
        let mut scattered = power.zero();
        let onward = scatter(at.material, &at.interaction, &power, &mut scattered, rng);
        let Some(onward) = onward else { break };
        power = scattered;
        ray = at.leave(onward.lobe, onward.direction);
    }
    0.0
}

/// Returns the mean and the standard error of how much photons matter.
fn estimate(found: &[Weighed]) -> (f64, f64) {
    let n = found.len() as f64;
    let mean = found.iter().map(Weighed::weighted).sum::<f64>() / n;
    (mean, (squares(found) / n - mean * mean).max(0.0).sqrt() / n.sqrt())
}

fn squares(found: &[Weighed]) -> f64 {
    found.iter().map(|one| one.weighted().powi(2)).sum()
}

/// Makes a tree for each stratum, from photons that were emitted by the trees of `lamps`.
fn trees(lamps: &Lamps, found: &[Weighed]) -> Vec<Option<EmissionTree>> {
    let mut of_source: Vec<Vec<Sample>> = vec![Vec::new(); lamps.trees.len()];
    for one in found {
        of_source[one.source].push(Sample { value: one.weighted(), ..one.sample });
    }
    of_source.into_iter().map(EmissionTree::new).collect()
}

/// Returns the parts of the guidance that pay: the trees, and shares of the photons if some lamps
/// matter more than their power says. `None` if neither pays.
fn worth(free: &[Weighed], guided: &[Weighed], lamps: Lamps) -> Option<Lamps> {
    let share = free.len() as f64 / guided.len() as f64;
    let gains = squares(free) > GAIN * share * squares(guided);
    let trees = if gains { lamps.trees } else { vec![None; lamps.trees.len()] };
    let found = if gains { guided } else { free };
    let (mut sums, mut counts) = (vec![0.0; trees.len()], vec![0.0; trees.len()]);
    for one in found {
        sums[one.source] += one.weighted();
        counts[one.source] += 1.0;
    }
    let (all, number): (f64, f64) = (sums.iter().sum(), found.len() as f64);
    let pairs = || sums.iter().zip(&counts).map(|(sum, count)| (sum / all, count / number));
    let differs = pairs().any(|(own, power)| own > GAIN * power);
    let mixed = |(own, power): (f64, f64)| (1.0 - BY_POWER) * own + BY_POWER * power;
    let shares = differs.then(|| pairs().map(mixed).collect());
    (gains || differs).then_some(Lamps { shares, trees })
}
