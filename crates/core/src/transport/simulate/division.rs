//! How complete paths divide their work: from which faces paths start, and how many photons are
//! traced beside them.
//!
//! A path serves one face, and a photon serves all of them. So paths pay at small faces, and photons
//! at large ones. A trial finds, for each face, the relative variance p of a path, h of a photon that
//! counts where paths leave light to it, and u of a photon that always counts. With n photons beside
//! one path from each face from which paths start, the relative variance of a run of one such history
//! is p + h / n at these faces, and u / n at the others. Its work is k c + n c', where k is the number
//! of these faces, and c and c' the rays of a path and of a photon. The product of the work and of the
//! geometric mean of the variances is made as small as it can be.

use std::sync::Arc;

use super::{
    Control, Keep, Run, TASK, channel, faces,
    schedule::{Beside, Schedule},
    tried::{FEWEST, TRIAL, TRIAL_RAYS, Tried, affordable, of_a_trial, paths_of, step},
};
use crate::{
    error::Result,
    math::rng::Purpose,
    scene::world::Scene,
    transport::{
        paths::{Face, Pilot},
        settings::Settings,
        tally::Totals,
    },
};

/// Photons take at least and at most this fraction of the work.
const LEAST_PHOTONS: f64 = 1.0 / 64.0;
const MOST_PHOTONS: f64 = 0.875;
/// At a face that fewer photons of the trial have come to, their variance is taken to be in
/// proportion to its area.
const KNOWN: u64 = 100;

/// How complete paths divide their work.
#[derive(Clone, Debug)]
pub struct Division {
    /// Number of photons beside one path from each face from which paths start: a power of two.
    pub photons: f64,
    /// For each channel of the captors whether no paths start from this face, so that all photons
    /// count there. Empty if paths start from all faces.
    pub by_photons: Arc<[bool]>,
}

/// What a trial of complete paths has found.
pub(super) struct TriedComplete {
    /// What pilot photons have found for the paths.
    pub pilot: Arc<Pilot>,
    pub division: Division,
    pub tried: Tried,
    /// What photons alone would find.
    pub photons: Tried,
    /// Fraction of the light on the captors that paths leave to photons, in [0, 1]: the largest over
    /// the bands.
    pub left: f64,
}

impl TriedComplete {
    /// Tries paths, and photons beside them, and divides the work. Errors: those of a run.
    pub fn new(scene: &Scene, settings: &Settings, control: &Control) -> Result<Self> {
        let pilot = Arc::new(Pilot::beside_photons(scene, settings.seed));
        let paths = paths_of(scene, settings, &pilot, TRIAL_RAYS, control)?;
        let photons = TriedPhotons::new(scene, settings, &pilot, control)?;
        let variances = Variances::new(scene, &paths, &photons);
        let number = variances.faces.len();
        let work = Work { path: paths.rays / number as f64, photon: photons.rays };
        let Divided { photons: each, alone } = divide(&variances.all(), work);
        let starts = alone.iter().filter(|&&alone| !alone).count();
        let mut by_photons = Vec::new();
        if starts < number {
            by_photons = vec![false; scene.channels()];
            let channels = variances.faces.iter().map(|face| channel(scene, face));
            channels.zip(&alone).for_each(|(channel, &alone)| by_photons[channel] = alone);
            // so is what a captor absorbs, if photons alone count at its faces
            for captor in scene.captors() {
                let all = captor.first_channel..captor.first_channel + captor.channels();
                let faces = captor.kind.faces().iter();
                if faces.map(|&face| captor.first_channel + face as usize).all(|c| by_photons[c]) {
                    by_photons[all].fill(true);
                }
            }
        }
        let bands = scene.bands().len();
        let of_tried = |i: usize| {
            let face = i / bands * variances.step;
            Some(variances.of(face, i % bands)?.with(each, alone[face]))
        };
        let found = paths.found.with((0..paths.means.len()).map(of_tried).collect());
        let left = variances.left();
        let rays = starts as f64 * work.path + each * work.photon;
        let tried = Tried { found, rays, unit: starts as u64, ..paths };
        let division = Division { photons: each, by_photons: by_photons.into() };
        let photons = Tried::new(scene, &photons.all, photons.all.histories, 1);
        Ok(Self { pilot, division, tried, photons, left })
    }
}

/// Relative variances at a face.
#[derive(Clone, Copy, Debug)]
struct Variance {
    /// Of a path, p.
    path: f64,
    /// Of a photon that counts where paths leave light to it, h.
    beside: f64,
    /// Of a photon that always counts, u.
    photon: f64,
}

impl Variance {
    /// Returns the relative variance of so many photons, `alone` or beside one path.
    fn with(self, photons: f64, alone: bool) -> f64 {
        if alone { self.photon / photons } else { self.path + self.beside / photons }
    }
}

/// Number of rays of a path and of a photon.
#[derive(Clone, Copy)]
struct Work {
    path: f64,
    photon: f64,
}

/// The best way to divide the work.
struct Divided {
    /// Number of photons beside one path from each face from which paths start.
    photons: f64,
    /// For each face whether no paths start from it.
    alone: Vec<bool>,
}

/// Divides the work among paths and photons. At a face without a variance nothing has arrived.
fn divide(variances: &[Option<Variance>], work: Work) -> Divided {
    let lit: Vec<usize> = (0..variances.len()).filter(|&face| variances[face].is_some()).collect();
    let dark = (variances.len() - lit.len()) as f64;
    let log = |face: usize, photons: f64, alone: bool| {
        let variance = variances[face].map_or(1.0, |variance| variance.with(photons, alone));
        variance.max(f64::MIN_POSITIVE).ln()
    };
    // the number of photons that take this share of the work beside paths from so many faces
    let of_share =
        |share: f64, starts: f64| share / (1.0 - share) * starts * work.path / work.photon;
    let all = variances.len() as f64;
    let first = of_share(LEAST_PHOTONS, 1.0).log2().ceil() as i32;
    let last = of_share(MOST_PHOTONS, all).log2().floor().max(first.into()) as i32;
    let mut best = (f64::INFINITY, Divided { photons: 1.0, alone: vec![false; variances.len()] });
    for exponent in first..=last {
        let photons = f64::from(exponent).exp2();
        // the less photons gain at a face, the earlier it gets paths
        let mut order: Vec<(f64, usize)> = Vec::with_capacity(lit.len());
        order.extend(lit.iter().map(|&f| (log(f, photons, false) - log(f, photons, true), f)));
        order.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let mut logs: f64 = lit.iter().map(|&face| log(face, photons, true)).sum();
        let mut most = None;
        for starts in 0..=order.len() {
            if let Some((more, _)) = starts.checked_sub(1).map(|last| order[last]) {
                logs += more;
            }
            let paths = starts as f64 + dark;
            let fits = of_share(LEAST_PHOTONS, paths)..=of_share(MOST_PHOTONS, paths);
            if paths == 0.0 || !fits.contains(&photons) {
                continue;
            }
            let rays = paths * work.path + photons * work.photon;
            let cost = logs + lit.len() as f64 * rays.ln();
            if cost < best.0 {
                best.0 = cost;
                most = Some(starts);
            }
        }
        if let Some(starts) = most {
            let mut alone = vec![false; variances.len()];
            order[starts..].iter().for_each(|&(_, face)| alone[face] = true);
            best.1 = Divided { photons, alone };
        }
    }
    best.1
}

/// What photons have found in a trial.
struct TriedPhotons {
    /// Where they count while paths leave their light to them.
    beside: Totals,
    /// Where they always count.
    all: Totals,
    /// Number of rays of a photon.
    rays: f64,
}

impl TriedPhotons {
    fn new(
        scene: &Scene,
        settings: &Settings,
        pilot: &Arc<Pilot>,
        control: &Control,
    ) -> Result<Self> {
        let settings = of_a_trial(settings);
        let least = scene.sources() as u64;
        let photons = affordable(scene, &settings, control, TRIAL)?.max(FEWEST * least);
        let beside = Some(Beside { ratio: 1.0, least });
        let schedule = Schedule { beside, ..Schedule::new(photons, least, TASK.max(least)) };
        let totals = |by_photons: Arc<[bool]>| {
            let run = Run::new(scene, &settings, Vec::new(), Keep::OnCaptors, control)?;
            let work = super::Work::Paths(Vec::new(), pilot.clone());
            Run { work, beside, by_photons, purpose: Purpose::Trial, ..run }.round(2, &schedule)
        };
        let channels = scene.channels();
        let beside = totals(vec![false; channels].into())?;
        let all = totals(vec![true; channels].into())?;
        let rays = all.segments as f64 / all.histories as f64;
        Ok(Self { beside, all, rays })
    }
}

/// What the trials say of all faces.
struct Variances<'t> {
    scene: &'t Scene,
    faces: Vec<Face<'t>>,
    paths: &'t Tried,
    photons: &'t TriedPhotons,
    /// Every so many faces one was tried by paths.
    step: usize,
    /// Per band, what holds for all faces.
    of_all: Vec<OfAll>,
}

/// What holds for all faces, in a band.
struct OfAll {
    /// Median of the relative variances of a path.
    path: f64,
    /// Variance of a photon that counts where paths leave light to it, for each unit of all light,
    /// W or umol/s.
    beside: f64,
    /// The same for a photon that always counts, at the faces that few photons have come to.
    photon: f64,
    /// Irradiance of these faces, W/m2 or umol/m2/s.
    irradiance: f64,
}

impl<'t> Variances<'t> {
    fn new(scene: &'t Scene, paths: &'t Tried, photons: &'t TriedPhotons) -> Self {
        let faces = faces(scene);
        let step = step(faces.len());
        let all = Self { scene, faces, paths, photons, step, of_all: Vec::new() };
        let of_all = (0..scene.bands().len()).map(|band| all.of_all(band)).collect();
        Self { of_all, ..all }
    }

    fn of_all(&self, band: usize) -> OfAll {
        let photons = self.photons.all.histories as f64;
        let own: Vec<usize> = (0..self.faces.len()).step_by(self.step).collect();
        let mut tried: Vec<f64> = own.iter().filter_map(|&face| self.path(face, band)).collect();
        tried.sort_unstable_by(f64::total_cmp);
        let (mut left, mut light) = (0.0, 0.0);
        let (mut variance, mut flux, mut area) = (0.0, 0.0, 0.0);
        for face in &self.faces {
            let [of_left, of_all] = [&self.photons.beside, &self.photons.all]
                .map(|totals| estimate(self.scene, totals, face, band));
            left += of_left[1] * photons;
            light += of_all[0];
            if !self.is_known(face) {
                variance += of_all[1] * photons;
                flux += of_all[0];
                area += self.scene.captors()[face.captor].area;
            }
        }
        let ratio = |over: f64, under: f64| if under > 0.0 { over / under } else { 0.0 };
        OfAll {
            path: tried.get(tried.len() / 2).copied().unwrap_or(0.0),
            beside: ratio(left, light),
            photon: ratio(variance, flux),
            irradiance: ratio(flux, area),
        }
    }

    /// Returns the fraction of the light on all faces that paths leave to photons, in [0, 1]: the
    /// largest over the bands.
    fn left(&self) -> f64 {
        let share = |band: usize| {
            let [left, all] = [&self.photons.beside, &self.photons.all].map(|totals| {
                let flux = |face: &Face| estimate(self.scene, totals, face, band)[0];
                self.faces.iter().map(flux).sum::<f64>()
            });
            if all > 0.0 { (left / all).min(1.0) } else { 0.0 }
        };
        (0..self.scene.bands().len()).map(share).fold(0.0, f64::max)
    }

    /// Returns whether enough photons have come to a face to tell how much they differ.
    fn is_known(&self, face: &Face) -> bool {
        let counted = self.photons.all.histories_in(channel(self.scene, face));
        counted.is_some_and(|photons| photons >= KNOWN)
    }

    /// Returns the relative variance of a path from a face from which paths were tried.
    fn path(&self, face: usize, band: usize) -> Option<f64> {
        let tried = face / self.step * self.scene.bands().len() + band;
        let own = self.paths.means[tried];
        let left = estimate(self.scene, &self.photons.beside, &self.faces[face], band)[0];
        let relative = self.paths.found.each().nth(tried).flatten()?;
        Some(relative * (own / (own + left)).powi(2))
    }

    /// Returns the relative variances at a face in a band; `None` where there is no light.
    fn of(&self, face: usize, band: usize) -> Option<Variance> {
        let all = &self.of_all[band];
        let place = &self.faces[face];
        let tried = face.is_multiple_of(self.step).then(|| self.path(face, band)).flatten();
        let path = tried.unwrap_or(all.path);
        let (flux, photon) = if self.is_known(place) {
            let [flux, variance] = estimate(self.scene, &self.photons.all, place, band);
            (flux, variance * self.photons.all.histories as f64 / (flux * flux))
        } else {
            let flux = all.irradiance * self.scene.captors()[place.captor].area;
            (flux, all.photon / flux)
        };
        (flux > 0.0).then_some(Variance { path, beside: all.beside / flux, photon })
    }

    /// Returns the relative variances at each face, averaged over the bands that have light.
    fn all(&self) -> Vec<Option<Variance>> {
        let mean = |face: usize| {
            let bands = (0..self.scene.bands().len()).filter_map(|band| self.of(face, band));
            let bands: Vec<Variance> = bands.collect();
            let of = |part: fn(&Variance) -> f64| {
                bands.iter().map(part).sum::<f64>() / bands.len() as f64
            };
            let (path, beside, photon) = (of(|v| v.path), of(|v| v.beside), of(|v| v.photon));
            (!bands.is_empty()).then_some(Variance { path, beside, photon })
        };
        (0..self.faces.len()).map(mean).collect()
    }
}

/// Returns the mean that a trial has found at a face in a band, and the variance of this mean.
fn estimate(scene: &Scene, totals: &Totals, face: &Face, band: usize) -> [f64; 2] {
    let found = totals.estimates(channel(scene, face)).nth(band).expect("it has all bands");
    [found.mean, found.standard_error.unwrap_or(found.mean).powi(2)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::rng::{Purpose, Streams};

    /// Of every division of seven faces, by every number of photons that is allowed, the best is
    /// found. A face without light gets paths. Chance plays no part, as the stream is fixed.
    #[test]
    fn the_best_division_is_found() {
        for case in 0..50 {
            let mut rng = Streams::new(1, Purpose::Run, 0).history(case);
            let mut number = |least: f64, factor: f64| least * factor.powf(rng.uniform().into());
            let work = Work { path: number(1.0, 30.0), photon: number(1.0, 30.0) };
            let mut faces: Vec<Option<Variance>> = (0..7)
                .map(|_| {
                    let path = number(0.1, 1e3);
                    Some(Variance { path, beside: number(0.01, 1e3), photon: number(1.0, 1e5) })
                })
                .collect();
            faces.push(None);
            let cost = |photons: f64, alone: &[bool]| {
                let starts = alone.iter().filter(|&&alone| !alone).count() as f64;
                let rays = starts * work.path + photons * work.photon;
                let share = photons * work.photon / rays;
                let lit =
                    faces.iter().zip(alone).filter_map(|(face, &alone)| Some(((*face)?, alone)));
                let variances: f64 = lit.map(|(face, alone)| face.with(photons, alone).ln()).sum();
                let fits = (LEAST_PHOTONS..=MOST_PHOTONS).contains(&share);
                if fits { variances + 7.0 * rays.ln() } else { f64::INFINITY }
            };
            let mut least = f64::INFINITY;
            for exponent in -20..=20 {
                for subset in 0..128u32 {
                    let mut alone: Vec<bool> = (0..7).map(|face| subset >> face & 1 == 1).collect();
                    alone.push(false);
                    least = least.min(cost(f64::from(exponent).exp2(), &alone));
                }
            }
            let Divided { photons, alone } = divide(&faces, work);
            let found = cost(photons, &alone);
            assert!(!alone[7] && (found - least).abs() < 1e-9, "{case}: {found} {least}");
        }
    }
}
