//! What photons are guided by is learned before a run, from photons and importons that count nowhere else.

use std::sync::Arc;

use super::{Control, Keep, Run, lamps};
use crate::{
    error::Result,
    math::{
        machine,
        rng::{Purpose, Streams},
        spectrum::{Lanes, with_lanes},
    },
    scene::{light::Strata, world::Scene},
    transport::{
        guiding::{self, Cells, Guidance, Importance, Lamps, Sources, Targets, Windows},
        settings::{Estimator, Guiding, Settings},
        tally::Totals,
        trace::{Event, trace},
    },
};

/// Importons are sent so many times, each time by what photons guided by those before have found on the captors.
const ROUNDS: u64 = 3;
/// Photons of a round.
const PHOTONS: u64 = 1 << 13;
/// The most photons that find which light of the lamps matters, in a round and in the last one.
const FEW: u64 = 1 << 17;
const MANY: u64 = 1 << 21;
/// No captor counts as darker than this, relative to the brightest.
const DARKEST: f64 = 1e-6;
/// Photons that tell the importance where photons arrive, and the most arrivals of them.
const ARRIVING: u64 = 1 << 14;
const MOST_ARRIVALS: usize = 1 << 18;
/// There are windows where importance varies by this factor at least ...
const VARIES: f32 = 5.0;
/// ... among the places where photons arrive, but for so many of the most and of the least important.
const EXTREMES: f64 = 0.01;

impl<'a> Run<'a> {
    /// Flights aimed at the virtual captors of a scene, if there are any.
    pub(super) fn aim(scene: &'a Scene) -> Option<Guidance<'a>> {
        Targets::of(scene).map(|targets| Guidance { targets: Some(targets), ..Guidance::default() })
    }

    /// These, and weight windows where importance varies. Errors: those of a run.
    pub(super) fn learn(
        scene: &'a Scene,
        settings: &Settings,
        control: &Control,
    ) -> Result<Option<Guidance<'a>>> {
        if scene.captors.is_empty() || scene.lights.is_empty() {
            return Ok(None);
        }
        let pool = machine::pool(settings.threads)?;
        let cells = Arc::new(Cells::new(scene));
        let seed = settings.seed;
        let mut learned: Option<Vec<f32>> = None;
        let mut guidance = Guidance { targets: Targets::of(scene), ..Guidance::default() };
        let mut varies = false;
        for round in 0..ROUNDS {
            let totals = photons(scene, settings, guidance.clone(), round, control)?;
            let sources = Sources::new(scene, &expected(scene, &totals));
            let before = learned.as_deref();
            let arriving = pool.install(|| guiding::learn(&sources, &cells, seed, round, before));
            let importance = Arc::new(Importance::new(scene, cells.clone(), &arriving));
            learned = Some(arriving);
            let most = if round + 1 < ROUNDS { FEW } else { MANY };
            with_lanes!(scene.lanes(), L => {
                let lamps = pool.install(|| lamps::learn::<L>(scene, &importance, seed, most));
                guidance.starved = lamps.is_err();
                guidance.lamps = lamps.unwrap_or(None).map(Arc::new);
                let found = arrive::<L>(scene, &importance, guidance.lamps.as_deref(), seed);
                let mean = found.mean;
                guidance.windows = (mean > 0.0).then_some(Windows { importance, mean });
                varies = found.varies;
            });
        }
        guidance.windows = guidance.windows.filter(|_| varies);
        let Guidance { targets, windows, lamps, starved } = &guidance;
        let guides = targets.is_some() || windows.is_some() || lamps.is_some() || *starved;
        Ok(guides.then_some(guidance))
    }
}

/// What photons find that are guided so.
fn photons(
    scene: &Scene,
    settings: &Settings,
    guidance: Guidance,
    round: u64,
    control: &Control,
) -> Result<Totals> {
    let settings = Settings {
        estimator: Estimator::Photons,
        guiding: Guiding::Off,
        k: Some(0),
        seed: settings.seed,
        threads: settings.threads,
        ..Settings::default()
    };
    let control = Control { progress: &|_| {}, ..*control };
    let run = Run::new(scene, &settings, Vec::new(), Keep::OnCaptors, &control)?;
    let run = Run { purpose: Purpose::Pilot, guidance: Some(guidance), ..run };
    let mut totals = run.totals();
    let schedule = run.schedule(PHOTONS.max(scene.sources() as u64))?;
    run.rounds(&schedule, (round, 0, 0), round..round + 1, None, &mut totals, None)?;
    Ok(totals)
}

/// The light on each face of the captors, per band, W/m2. Of faces that none has reached it is that of the darkest other
/// one, so that they are looked for.
fn expected(scene: &Scene, totals: &Totals) -> Vec<Vec<f64>> {
    let mut light: Vec<Vec<f64>> = Vec::new();
    for captor in &scene.captors {
        for &face in captor.kind.faces() {
            let running = &totals.running(captor.first_channel + face as usize);
            let mean = |b: usize| running[b].estimate(totals.batches).mean / captor.area;
            light.push((0..scene.bands.len()).map(mean).collect());
        }
    }
    for b in 0..scene.bands.len() {
        let lit = || light.iter().map(|face| face[b]).filter(|light| *light > 0.0);
        let brightest = lit().fold(0.0, f64::max);
        let darkest = lit().fold(f64::INFINITY, f64::min).max(DARKEST * brightest);
        let least = if brightest > 0.0 { darkest } else { 1.0 };
        light.iter_mut().for_each(|face| face[b] = face[b].max(least));
    }
    light
}

/// Importance where photons arrive.
struct Arriving {
    /// Where they first come to a diffuse surface: the mean, times W or umol/s.
    mean: f32,
    /// Whether it varies enough for windows.
    varies: bool,
}

fn arrive<L: Lanes>(
    scene: &Scene,
    importance: &Importance,
    lamps: Option<&Lamps>,
    seed: u64,
) -> Arriving {
    let photons = ARRIVING.max(scene.sources() as u64);
    let strata = Strata::new(&scene.lights, photons, scene.lanes());
    let streams = Streams::new(seed, Purpose::Pilot, u64::MAX);
    let (mut sum, mut all, mut done) = (0.0, Vec::new(), 0);
    // neighbouring histories share the lights well, so it can end after any
    while done < photons && all.len() < MOST_ARRIVALS {
        let mut rng = streams.history(done);
        let (photon, density) = match lamps {
            Some(lamps) => lamps.emit::<L>(scene, &strata, done, &mut rng),
            None => (scene.emit(&strata, done, &mut rng), 1.0),
        };
        let largest = photon.weights.iter().copied().fold(0.0, f64::max);
        let weight = largest / f64::from(density);
        let mut first = true;
        trace(scene, photon.ray, photon.power, (), &mut rng, |event| {
            let Event::Arrival { hit, surface, interaction, power, .. } = event else { return };
            if !scene.material(surface).is_diffuse() {
                return;
            }
            let value = importance.at(hit, interaction.front);
            if first {
                sum += weight * f64::from(power.largest() * value);
            }
            first = false;
            all.push(value);
        });
        done += 1;
    }
    all.sort_unstable_by(f32::total_cmp);
    let at = |share: f64| all.get((share * all.len() as f64) as usize).copied().unwrap_or(0.0);
    let varies = at(1.0 - EXTREMES) > VARIES * at(EXTREMES);
    Arriving { mean: (sum / done as f64) as f32, varies }
}
