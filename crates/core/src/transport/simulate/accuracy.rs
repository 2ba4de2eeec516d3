//! Decides whether every captor is accurate enough: the rule by which a run with a tolerance ends.
//!
//! Every face of every captor, or what was named instead, must have a relative standard error of at
//! most the tolerance, in every band that carries power and in every sum of such bands. With few
//! arrivals a standard error cannot be trusted, and without arrivals there is none. A face on which
//! fewer than [`ENOUGH`] batches found light therefore keeps the run going, unless there is next to
//! no light on it: unless its value is, with 95 % confidence, below the tolerance times the value
//! of the median captor. Such a face is dark, and is listed with that bound. While no captor has
//! enough light to compare with, the run goes on, if there is any light.

use std::sync::atomic::Ordering;

use super::{Run, Work, schedule::Schedule, watched::Watched};
use crate::{
    math::stats::{Estimate, Running, rate_bound},
    scene::{
        captor::{CHANNELS, Channel},
        world::Scene,
    },
    transport::tally::Totals,
};

/// Number of batches that must have found light on a face, and so at least as many histories, for
/// its standard error to be trusted.
const ENOUGH: u64 = 30;

/// A face of a captor or group, in a band.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FaceBand {
    /// Index of the captor, or the number of captors plus the index of the group.
    pub captor: usize,
    /// The front, the back, or what is absorbed.
    pub face: Channel,
    /// Index of the band, or the number of bands plus the index of the sum over bands.
    pub band: usize,
}

/// The value that is farthest from the tolerance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Worst {
    /// The face and band.
    pub at: FaceBand,
    /// Its standard error divided by the value; `None` where nothing arrived.
    pub relative_error: Option<f64>,
    /// Number of batches that found light there; with fewer than 30 the standard error cannot be
    /// trusted.
    pub batches_with_light: u64,
}

/// A face that hardly any light reaches.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dark {
    /// The face and band.
    pub at: FaceBand,
    /// Upper bound of its irradiance, with 95 % confidence, W/m2 or umol/m2/s.
    pub below: f64,
}

/// How accurate a run is, compared with the tolerance that was asked for.
#[derive(Clone, Debug, PartialEq)]
pub struct Accuracy {
    /// The largest relative standard error that was asked for.
    pub tolerance: f64,
    /// Whether every value meets the tolerance.
    pub met: bool,
    /// The value that is farthest from the tolerance; `None` if there is no light at all.
    pub worst: Option<Worst>,
    /// The faces that were left out because hardly any light reaches them.
    pub dark: Vec<Dark>,
}

/// What a run has found on a face.
struct OfFace {
    /// Area, m2.
    area: f64,
    on_surface: bool,
    at: FaceBand,
    running: Running,
    /// Flux, W or umol/s.
    estimate: Estimate,
}

impl OfFace {
    fn is_enough(&self) -> bool {
        self.running.above_zero() >= ENOUGH
    }
}

impl Run<'_> {
    /// Compares all batches so far with the tolerance.
    pub(super) fn accuracy(
        &self,
        schedule: &Schedule,
        totals: &Totals,
        watched: &[Watched],
        tolerance: f64,
    ) -> Accuracy {
        let brightest = self.brightest(schedule);
        let rates: Vec<f64> = (0..ENOUGH).map(|hit| rate_bound(hit, totals.batches)).collect();
        // so many hits alone make an error as small as the tolerance
        let enough = tolerance.powi(-2).max(ENOUGH as f64);
        let (mut worst, mut farthest, mut dark) = (None, 0.0, Vec::new());
        for band in (0..brightest.powers.len()).filter(|&band| brightest.powers[band] > 0.0) {
            let found = found(watched, totals, band);
            let medians = Medians::of(&found);
            let any = found.iter().any(|face| face.running.above_zero() > 0);
            let evenly = (!any).then(|| brightest.evenly(self.scene, band));
            for face in &found {
                let OfFace { area, at, running, estimate, .. } = *face;
                let batches_with_light = running.above_zero();
                if !face.is_enough() {
                    let history = brightest.on(area, band).max(running.largest());
                    let below = rates[batches_with_light as usize] * history / area;
                    let usual = medians.beside(face).or(evenly);
                    if usual.is_some_and(|usual| below < tolerance * usual) {
                        dark.push(Dark { at, below });
                        continue;
                    }
                }
                let error = estimate.standard_error.filter(|_| batches_with_light > 0);
                let relative_error = error.map(|error| error / estimate.mean);
                // about how many times as many histories are needed
                let by_error = (relative_error.unwrap_or(0.0) / tolerance).powi(2);
                let by_number = enough / (batches_with_light as f64).max(0.5);
                let more = if face.is_enough() { by_error } else { by_error.max(by_number) };
                if more > farthest || worst.is_none() {
                    farthest = more;
                    worst = Some(Worst { at, relative_error, batches_with_light });
                }
            }
        }
        Accuracy { tolerance, met: farthest <= 1.0, worst, dark }
    }

    /// Returns the most that one history can contribute.
    fn brightest(&self, schedule: &Schedule) -> Brightest {
        let bands = self.scene.bands().len();
        let powers =
            (0..bands).map(|b| self.scene.lights().iter().map(|light| light.power[b]).sum());
        let powers: Vec<f64> = powers.collect();
        let batch = schedule.batches - 1;
        let histories = schedule.batch(batch) as f64;
        let brightest = self.shared.brightest.iter().map(|bits| bits.load(Ordering::Relaxed));
        let brightest: Vec<f64> = brightest.map(f64::from_bits).collect();
        let (flux, irradiance) = match &self.histories.work {
            Work::Photons(_) | Work::Lights => {
                let lamps = self.histories.lamps();
                // what guided photons have brought may be more than any was emitted with
                let mut most = brightest;
                for task in [0, schedule.tasks(batch) - 1] {
                    let (_, length) = schedule.range(batch, task);
                    let strata = self.histories.strata(self.scene, length);
                    for source in 0..strata.sources() {
                        let more = lamps.map_or(1.0, |lamps| lamps.most(source));
                        for (band, most) in most.iter_mut().enumerate() {
                            let own = strata.most(self.scene.lights(), source, band);
                            *most = most.max(more * own);
                        }
                    }
                }
                (most, vec![0.0; bands])
            }
            Work::Paths(_, pilot) => {
                let irradiance = brightest;
                // where no path has found anything, assume that one may bring all the power there
                // is
                let none = |(power, most): (&f64, &f64)| if *most > 0.0 { 0.0 } else { *power };
                let mut flux: Vec<f64> = powers.iter().zip(&irradiance).map(none).collect();
                if let Some((_, photons)) = schedule.photons_beside(batch, schedule.cuts - 1) {
                    let (paths, all) =
                        (schedule.range(batch, 0).1, !self.histories.by_photons.is_empty());
                    let strata = pilot.strata(self.scene, photons, paths, all);
                    for source in 0..strata.sources() {
                        for (band, most) in flux.iter_mut().enumerate() {
                            let own = strata.most(self.scene.lights(), source, band);
                            *most = most.max(pilot.most_gain() * own);
                        }
                    }
                }
                (flux, irradiance)
            }
        };
        let of_batch = |most: Vec<f64>| {
            self.scene.with_sums(&most).into_iter().map(|most| most / histories).collect()
        };
        Brightest {
            flux: of_batch(flux),
            irradiance: of_batch(irradiance),
            powers: self.scene.with_sums(&powers),
        }
    }
}

/// The most that one history can contribute to the estimate of a batch, per band and sum over
/// bands.
struct Brightest {
    /// For photons: the power of the heaviest one that is emitted or, where photons are guided, has
    /// come to a captor, W or umol/s, divided by the histories of a batch. The same for photons
    /// beside paths.
    flux: Vec<f64>,
    /// For paths: the largest irradiance that one has found on any face, W/m2 or umol/m2/s, divided
    /// likewise.
    irradiance: Vec<f64>,
    /// Power of all lights, W or umol/s.
    powers: Vec<f64>,
}

impl Brightest {
    /// Returns the most that one history can contribute on an area (m2), W or umol/s.
    fn on(&self, area: f64, band: usize) -> f64 {
        self.flux[band] + self.irradiance[band] * area
    }

    /// Returns the irradiance of all light on the sides of a box around the scene, or on all captors
    /// if these are larger, W/m2 or umol/m2/s.
    fn evenly(&self, scene: &Scene, band: usize) -> f64 {
        let captors = scene.captors().iter().map(|captor| captor.area).sum::<f64>();
        let whole = scene.triangles().extent().join(scene.captors_extent());
        self.powers[band] / captors.max(2.0 * f64::from(whole.half_area()))
    }
}

/// Returns what has been found of all that is watched, in a band or sum over bands.
fn found(watched: &[Watched], totals: &Totals, band: usize) -> Vec<OfFace> {
    let of_band = watched.iter().filter(|watched| watched.band.is_none_or(|b| b == band));
    let found = |watched: &Watched| {
        let Watched { captor, face, channel, area, on_surface, .. } = *watched;
        let running = totals.running(channel)[band];
        let estimate = totals.estimates(channel).nth(band).expect("it has all bands");
        OfFace { area, on_surface, at: FaceBand { captor, face, band }, running, estimate }
    };
    of_band.map(found).collect()
}

/// Median irradiances over the faces that have enough light, W/m2 or umol/m2/s.
struct Medians {
    /// Medians over the fronts and the backs of sensors, then over the fronts and the backs of
    /// surfaces, and over what these absorb.
    alike: [Option<f64>; 2 * CHANNELS.len()],
    all: Option<f64>,
}

impl Medians {
    fn of(found: &[OfFace]) -> Self {
        let median = |of: &dyn Fn(&OfFace) -> bool| {
            let lit = found.iter().filter(|face| face.is_enough() && of(face));
            let mut values: Vec<f64> = lit.map(|face| face.estimate.mean / face.area).collect();
            values.sort_by(f64::total_cmp);
            values.get(values.len() / 2).copied()
        };
        let alike = std::array::from_fn(|kind| median(&|face| kind_of(face) == kind));
        Self { alike, all: median(&|_| true) }
    }

    /// Returns the median over faces of the same kind or, if none of these has enough light, over
    /// all faces.
    fn beside(&self, face: &OfFace) -> Option<f64> {
        self.alike[kind_of(face)].or(self.all)
    }
}

fn kind_of(face: &OfFace) -> usize {
    CHANNELS.len() * usize::from(face.on_surface) + face.at.face as usize
}
