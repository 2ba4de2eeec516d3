//! Trials of a way to find the light: the variance that it would have.

use std::sync::Arc;

use super::{BATCHES, Control, Keep, Run, Work, channel, faces};
use crate::{
    error::Result,
    math::{rng::Purpose, stats::Estimate},
    scene::world::Scene,
    transport::{
        paths::{Face, Pilot},
        settings::{Estimator, Settings},
        tally::Totals,
    },
};

/// The most rays that the photons of one trial of guiding should trace. Between walls that absorb
/// nothing, one photon takes 10,000.
pub(super) const RAYS: u64 = 1 << 20;

/// Number of photons, or of paths from all faces together, of one trial of an estimator, and the most
/// rays that it should trace: some tenths of a second, so that short runs can afford it.
pub(super) const TRIAL: u64 = 1 << 14;
pub(super) const TRIAL_RAYS: u64 = 1 << 18;
/// The fewest batches of a trial of photons. With many lights more would take too long, as each batch
/// has a photon of each.
pub(super) const FEWEST: u64 = 16;
/// The most faces from which paths are tried. They are spread over all captors.
const FACES: usize = 64;
/// The variance at a face is known well enough if the trial is as accurate as this many photons of
/// equal power there.
const SURE: f64 = 100.0;

/// Returns the settings of a trial: photons of the same seed, which are counted and not stored.
pub(super) fn of_a_trial(settings: &Settings) -> Settings {
    Settings { k: Some(0), seed: settings.seed, threads: settings.threads, ..Settings::default() }
}

/// Returns the number of photons that a trial can afford: `photons` or, where paths are long, only
/// as many as trace about [`RAYS`], but at least one for each batch and source. That many are
/// traced to measure how long paths are. Errors: those of a run.
pub(super) fn affordable(
    scene: &Scene,
    settings: &Settings,
    control: &Control,
    photons: u64,
) -> Result<u64> {
    let settings = of_a_trial(settings);
    let run = Run::new(scene, &settings, Vec::new(), Keep::OnCaptors, control)?;
    let run = Run { purpose: Purpose::Guiding, ..run };
    let few = BATCHES.max(scene.sources() as u64);
    let totals = run.round(0, &run.schedule(few)?)?;
    Ok(photons.min((RAYS * few / totals.segments.max(1)).max(few)))
}

/// What a trial has found.
#[derive(Clone)]
pub(super) struct Found {
    /// Number of rays that it traced.
    pub(super) rays: u64,
    histories: f64,
    /// For each channel that was asked for, and each band, the relative variance of one history;
    /// `None` where nothing arrived.
    variances: Vec<Option<f64>>,
}

impl Found {
    /// Evaluates the totals of a trial of so many histories, in some channels.
    pub(super) fn new(
        scene: &Scene,
        totals: &Totals,
        histories: u64,
        channels: impl Iterator<Item = usize>,
    ) -> Self {
        let histories = histories as f64;
        let bands = channels.flat_map(|channel| &totals.running(channel)[..scene.bands.len()]);
        let variance = |estimate: Estimate| {
            let Estimate { mean, standard_error } = estimate;
            let relative = standard_error.unwrap_or(mean) / mean;
            (mean > 0.0).then_some(relative.powi(2) * histories)
        };
        let variances = bands.map(|band| variance(band.estimate(totals.batches))).collect();
        Self { rays: totals.segments, histories, variances }
    }

    /// Returns the relative variance of one history for each channel that was asked for, and each
    /// band; `None` where nothing arrived.
    pub(super) fn each(&self) -> impl Iterator<Item = Option<f64>> {
        self.variances.iter().copied()
    }

    /// Returns the same with other relative variances.
    pub(super) fn with(&self, variances: Vec<Option<f64>>) -> Self {
        Self { variances, ..*self }
    }

    /// Returns whether light arrived in any of the channels.
    pub(super) fn finds_light(&self) -> bool {
        self.variances.iter().any(Option::is_some)
    }

    /// Returns whether no light arrived in most of the channels and bands.
    pub(super) fn is_dark(&self) -> bool {
        2 * self.variances.iter().flatten().count() < self.variances.len()
    }

    /// Returns the relative variance of one history wherever this trial or the other has found
    /// light, in rising order. Where this trial has missed light it takes the number of its own
    /// histories, because the variance is at least about that large.
    pub(super) fn variances(&self, other: &Self) -> Vec<f64> {
        let both = self.variances.iter().zip(&other.variances);
        let lit = both.filter(|(mine, theirs)| mine.is_some() || theirs.is_some());
        let mut all: Vec<f64> = lit.map(|(mine, _)| mine.unwrap_or(self.histories)).collect();
        all.sort_unstable_by(f64::total_cmp);
        if all.is_empty() { vec![self.histories] } else { all }
    }

    /// Returns the mean of [`variances`](Self::variances).
    pub(super) fn mean(&self, other: &Self) -> f64 {
        let all = self.variances(other);
        all.iter().sum::<f64>() / all.len() as f64
    }

    /// Returns the geometric mean of [`variances`](Self::variances). A few faces that hardly any
    /// light reaches, where all variances are alike, do not hide how the others differ.
    pub(super) fn typical(&self, other: &Self) -> f64 {
        let all = self.variances(other);
        let log = |variance: &f64| variance.max(f64::MIN_POSITIVE).ln();
        (all.iter().map(log).sum::<f64>() / all.len() as f64).exp()
    }
}

/// The result of a trial of one estimator.
#[derive(Clone)]
pub(super) struct Tried {
    /// The relative variances at each tried face and in each band.
    pub found: Found,
    /// For each tried face and each band, the flux, W or umol/s.
    pub means: Vec<f64>,
    /// Number of histories: photons, or paths from each face.
    pub histories: u64,
    /// Number of rays of a history over all faces.
    pub rays: f64,
    /// How many photons, or paths, a history over all faces counts as in `--photons`.
    pub unit: u64,
}

impl Tried {
    /// Evaluates the totals of `histories` histories, each of which counts as `unit` photons or
    /// paths.
    pub fn new(scene: &Scene, totals: &Totals, histories: u64, unit: u64) -> Self {
        let channels = tried_faces(scene).into_iter().map(|face| channel(scene, &face));
        let channels: Vec<usize> = channels.collect();
        let found = Found::new(scene, totals, histories, channels.iter().copied());
        let bands = |&channel: &usize| &totals.running(channel)[..scene.bands.len()];
        let means = channels.iter().flat_map(bands).map(|band| band.estimate(totals.batches).mean);
        let means = means.collect();
        Self { found, means, histories, rays: totals.segments as f64 / histories as f64, unit }
    }

    /// Returns the number of rays for a relative error of 1, at the face where it is hardest to
    /// reach or, as a geometric mean, at all faces.
    pub fn work(&self, other: &Self, hardest: bool) -> f64 {
        let variance = match hardest {
            true => *self.found.variances(&other.found).last().expect("one at least"),
            false => self.found.typical(&other.found),
        };
        self.rays * variance
    }

    /// Returns how many photons, or paths over all captors, reach the relative error `goal`, at the
    /// face where it is hardest or at the median face. It says "at least" where the trial has not
    /// reached an error of a tenth itself, as a hundred photons of equal power would.
    pub fn needed(&self, other: &Self, goal: f64, hardest: bool) -> String {
        let all = self.found.variances(&other.found);
        let variance = all[if hardest { all.len() - 1 } else { all.len() / 2 }];
        let sure = self.histories as f64 >= SURE * variance;
        let about = if sure { "about" } else { "at least" };
        format!("{about} {:.1e}", self.unit as f64 * variance / goal.powi(2))
    }
}

/// Runs a trial of paths that takes up to about `rays` rays.
pub(super) fn paths_of(
    scene: &Scene,
    settings: &Settings,
    pilot: &Arc<Pilot>,
    rays: u64,
    control: &Control,
) -> Result<Tried> {
    let settings = Settings { estimator: Estimator::Paths, ..of_a_trial(settings) };
    let (tried_faces, all) = (tried_faces(scene), faces(scene).len());
    let share = tried_faces.len() as f64 / all as f64;
    let each = TRIAL / tried_faces.len() as u64;
    let (keep, known) = (Keep::OnCaptors, Some(pilot.clone()));
    let run = Run::knowing(scene, &settings, Vec::new(), keep, control, known)?;
    let work = Work::Paths(tried_faces, pilot.clone());
    let (totals, histories) = tried(Run { work, ..run }, 1, (BATCHES, each, rays))?;
    let tried = Tried::new(scene, &totals, histories, all as u64);
    Ok(Tried { rays: tried.rays / share, ..tried })
}

/// Runs a round with `first` histories, and another with so many times two as are at most `most` and
/// take at most about `rays` rays, judging by the first. Returns the totals of the last one and its
/// number of histories.
pub(super) fn tried(
    run: Run,
    round: u64,
    (first, most, rays): (u64, u64, u64),
) -> Result<(Totals, u64)> {
    let run = Run { purpose: Purpose::Trial, ..run };
    let of = |histories: u64| run.round(round, &run.schedule(histories * run.unit())?);
    let few = of(first)?;
    let each = few.segments as f64 / first as f64;
    let mut histories = first;
    while 2 * histories <= most && 2.0 * histories as f64 * each <= rays as f64 {
        histories *= 2;
    }
    Ok((if histories == first { few } else { of(histories)? }, histories))
}

/// Returns faces that stand for all faces.
fn tried_faces(scene: &Scene) -> Vec<Face<'_>> {
    let all = faces(scene);
    let step = step(all.len());
    all.into_iter().step_by(step).collect()
}

/// Returns that of so many faces every so many one is tried.
pub(super) fn step(faces: usize) -> usize {
    faces.div_ceil(FACES)
}

#[cfg(test)]
mod tests {

    use glam::DVec3;

    use super::*;
    use crate::scene::{
        light::{Cone, Lamp},
        material::{Lambert, Material},
        world::{Band, LightPart, NamedMaterial, SceneParts, SurfacePart},
    };

    /// A tetrahedron with a lamp in it. Where the walls absorb everything, each photon ends at the
    /// first wall, and as many are traced as were asked for. Where they absorb nothing a photon
    /// takes 10,000 rays, and one photon for each batch is traced. Chance plays no part in this.
    #[test]
    fn fewer_photons_are_tried_where_paths_are_long() {
        let corners = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z];
        let photons = |reflectance: f32| {
            let wall = Material::Lambert(Lambert::new(&[reflectance]).unwrap());
            let scene = Scene::new(SceneParts {
                bands: vec![Band { name: "PAR".into(), from_nm: None, to_nm: None }],
                lights: vec![LightPart::new(
                    "lamp",
                    Lamp::new([1.0], Cone::point(DVec3::splat(0.1))),
                )],
                materials: vec![NamedMaterial { name: "wall".into(), material: wall }],
                surfaces: vec![SurfacePart {
                    object: None,
                    material: 0,
                    captor: None,
                    triangles: [[0, 1, 2], [0, 1, 3], [0, 2, 3], [1, 2, 3]]
                        .map(|face| face.map(|corner: usize| corners[corner]))
                        .to_vec(),
                }],
                ..SceneParts::default()
            });
            let control = Control::default();
            affordable(&scene.unwrap(), &Settings::default(), &control, 4096).unwrap()
        };
        assert_eq!(photons(0.0), 4096);
        assert_eq!(photons(1.0), BATCHES);
    }
}
