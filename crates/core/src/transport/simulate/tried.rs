//! Trials of a way to find the light: the variance that it would have.

use std::sync::Arc;

use super::{Arrivals, BATCHES, Control, Run, Work, channel, faces};
use crate::{
    error::Result,
    math::{pattern::fits, rng::Purpose, stats::Estimate},
    scene::world::Scene,
    transport::{
        guiding::Guidance,
        paths::{Face, Pilot},
        settings::{Estimator, NearestCount, Settings, Target},
        tally::Totals,
    },
};

/// The most rays that the photons of one trial of guiding should trace. Between walls that absorb
/// nothing, one photon takes 10,000.
pub(super) const RAYS: u64 = 1 << 20;

/// The rays of each part of the smallest, and usually of the largest, trial of an estimator: some
/// hundredths and some tenths of a second.
const FIRST_RAYS: u64 = 1 << 12;
const TRIAL_RAYS: u64 = 1 << 18;
/// Where few photons of the largest usual trial bring light that paths leave to them, trials go on to so
/// many rays.
const LONGEST_RAYS: u64 = 1 << 22;
/// A trial has so many times the rays of the one before.
const GROWTH: u64 = 4;
/// A trial has at most so many histories, or one for so many rays if these are more.
const HISTORIES: u64 = 1 << 14;
const RAYS_OF_HISTORY: u64 = 16;
/// The fewest batches of a trial of photons. With many lights more would take too long, as each batch
/// has a photon of each.
pub(super) const FEWEST: u64 = 16;
/// The most faces from which paths are tried, in the smallest trial and in larger ones. They are spread
/// over all captors.
const FEW_FACES: usize = 16;
const FACES: usize = 64;
/// A variance that fewer histories than these have shown is not known well.
const SEEN: u64 = 30;
/// No face counts as found with less than this fraction of the variance of the median face.
const FLOOR: f64 = 0.01;

/// How large a trial may be.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Size {
    /// The most rays that its paths, and each of its kinds of photons, should trace.
    pub rays: u64,
}

impl Size {
    /// The smallest trial.
    pub const FIRST: Self = Self { rays: FIRST_RAYS };
    /// The largest one, unless photons have to tell more.
    pub const USUAL: Self = Self { rays: TRIAL_RAYS };

    /// Returns a trial of so many rays, or of the nearest number that a trial may have.
    pub fn of(rays: u64) -> Self {
        Self { rays: rays.clamp(FIRST_RAYS, LONGEST_RAYS) }
    }

    /// Returns the next larger trial; `None` after the largest.
    pub fn next(self) -> Option<Self> {
        (self.rays < LONGEST_RAYS).then_some(Self::of(GROWTH * self.rays))
    }

    /// Returns how many times the rays of a smaller trial this has.
    pub fn over(self, smaller: Self) -> f64 {
        self.rays as f64 / smaller.rays as f64
    }

    /// Returns the most photons, or paths from all faces together.
    pub fn histories(self) -> u64 {
        (self.rays / RAYS_OF_HISTORY).max(HISTORIES)
    }

    /// Returns that of so many faces every so many one is tried.
    pub fn step(self, faces: usize) -> usize {
        let most = self.rays.saturating_mul(FEW_FACES as u64) / FIRST_RAYS;
        faces.div_ceil(most.clamp(1, FACES as u64) as usize)
    }
}

/// Returns the settings of a trial: photons of the same seed, which are counted and not stored.
pub(super) fn of_a_trial(settings: &Settings) -> Settings {
    Settings {
        k: Some(NearestCount::NONE),
        seed: settings.seed,
        threads: settings.threads,
        ..Settings::default()
    }
}

/// Returns the number of photons that a trial can afford: `photons` or, where paths are long, only
/// as many as trace about so many rays, but at least one for each batch and source. Errors: those of
/// a run.
pub(super) fn affordable(
    scene: &Scene,
    settings: &Settings,
    control: &Control,
    (photons, rays): (u64, u64),
) -> Result<u64> {
    let (few, each) = rays_of_a_photon(scene, settings, None, control)?;
    Ok(photons.min(((rays as f64 / each) as u64).max(few)))
}

/// Traces one photon for each batch and source. Returns their number and how many rays one takes, at
/// least 1, with the flights beside it where `guidance` has such. Errors: those of a run.
pub(super) fn rays_of_a_photon<'a>(
    scene: &'a Scene,
    settings: &Settings,
    guidance: Option<Guidance<'a>>,
    control: &Control,
) -> Result<(u64, f64)> {
    let settings = of_a_trial(settings);
    let run = Run::new(scene, &settings, Vec::new(), Arrivals::OnCaptors, control)?;
    let run = Run { purpose: Purpose::Guiding, ..run }.guided_by(guidance);
    let few = BATCHES.max(scene.sources() as u64);
    let totals = run.round(0, &run.histories.schedule(run.scene, few)?)?;
    Ok((few, (totals.segments as f64 / few as f64).max(1.0)))
}

/// What a trial has found.
#[derive(Clone)]
pub(super) struct Found {
    histories: f64,
    /// For each channel that was asked for, and each band.
    values: Vec<Value>,
    /// Per band, the power that a history brings to a captor if it comes there, W or umol/s: the mean
    /// over all that came. It is 0 for paths, which come to every captor.
    brings: Vec<f64>,
}

/// What a trial has found at a face in a band.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Value {
    /// The flux, W or umol/s; 0 where the face stayed dark.
    pub flux: f64,
    /// The relative variance of one history; 0 where the face stayed dark.
    pub variance: f64,
    /// Whether few histories came there, so that the variance is not known well.
    pub is_rough: bool,
}

impl Found {
    /// Evaluates the totals of a trial of so many histories, in some channels. A history brings at
    /// most this power, per band, to a captor.
    pub(super) fn new(
        scene: &Scene,
        totals: &Totals,
        histories: u64,
        channels: impl Iterator<Item = usize>,
        most: Vec<f64>,
    ) -> Self {
        let bands = scene.bands().len();
        let number = histories as f64;
        let values = channels.flat_map(|channel| {
            let is_rough = totals.histories_in(channel).is_some_and(|came| came < SEEN);
            totals.estimates(channel).take(bands).map(move |estimate| {
                let Estimate { mean: flux, standard_error } = estimate;
                let relative = standard_error.unwrap_or(flux) / flux;
                let variance = if flux > 0.0 { relative.powi(2) * number } else { 0.0 };
                Value { flux, variance, is_rough }
            })
        });
        let values: Vec<Value> = values.collect();
        let brings = most.into_iter().enumerate().map(|(band, most)| {
            let of_band = || values.iter().skip(band).step_by(bands);
            let flux: f64 = of_band().map(|value| value.flux).sum();
            let second: f64 = of_band().map(|value| value.variance * value.flux.powi(2)).sum();
            if flux > 0.0 { (second / flux).min(most) } else { most }
        });
        let brings = brings.collect();
        Self { histories: number, values, brings }
    }

    /// Returns what was found for each channel that was asked for, and each band.
    pub(super) fn each(&self) -> &[Value] {
        &self.values
    }

    /// Returns the same with other values.
    pub(super) fn with(&self, values: Vec<Value>) -> Self {
        Self { values, brings: self.brings.clone(), ..*self }
    }

    /// Returns whether light arrived in any of the channels.
    pub(super) fn finds_light(&self) -> bool {
        self.values.iter().any(|value| value.flux > 0.0)
    }

    /// Returns whether no light arrived in most of the channels and bands.
    pub(super) fn is_dark(&self) -> bool {
        2 * self.values.iter().filter(|value| value.flux > 0.0).count() < self.values.len()
    }

    /// Returns the relative variance of one history wherever this trial or the other has found
    /// light, in rising order.
    ///
    /// A face that this trial left dark counts against it. Photons that each bring the power w to a
    /// face have there, at the flux F that the other trial has found, the relative variance w / F; in
    /// any case it is at least about the number of histories that did not come. A variance is at
    /// least [`FLOOR`] of that of the median face: what is found faster than anything else needs no
    /// work of its own.
    pub(super) fn variances(&self, other: &Self) -> Vec<f64> {
        let bands = self.brings.len();
        let both = self.values.iter().zip(&other.values).enumerate();
        let mut all: Vec<f64> = both
            .filter(|(_, (mine, theirs))| mine.flux > 0.0 || theirs.flux > 0.0)
            .map(|(i, (mine, theirs))| {
                let missed = match theirs.flux > 0.0 && mine.is_rough {
                    true => self.brings[i % bands] / theirs.flux,
                    false => 0.0,
                };
                let own = if mine.flux > 0.0 { mine.variance } else { self.histories };
                own.max(missed)
            })
            .collect();
        all.sort_unstable_by(f64::total_cmp);
        // no trial tells that a history varies by less than one of all its histories does
        let least = (FLOOR * all.get(all.len() / 2).copied().unwrap_or(self.histories))
            .max(self.histories.recip());
        all.iter_mut().for_each(|variance| *variance = variance.max(least));
        if all.is_empty() { vec![self.histories] } else { all }
    }

    /// Returns the relative variance of the sum over all faces, as it is for a group of captors: what counts
    /// is the light of each of them. It is that of one history wherever light was found.
    pub(super) fn of_sum(&self, other: &Self) -> f64 {
        let bands = self.brings.len();
        let of_band = |band: usize| {
            let both = self.values.iter().zip(&other.values).skip(band).step_by(bands);
            let (mut sum, mut variance) = (0.0, 0.0);
            for (mine, theirs) in both {
                let flux = mine.flux.max(theirs.flux);
                let own = match (mine.flux > 0.0, theirs.flux > 0.0) {
                    (true, _) => mine.variance * mine.flux * mine.flux,
                    // photons bring what they bring; paths vary by about their number
                    (false, true) if self.brings[band] > 0.0 => self.brings[band] * flux,
                    (false, true) => self.histories * flux * flux,
                    (false, false) => 0.0,
                };
                (sum, variance) = (sum + flux, variance + own);
            }
            (sum > 0.0).then(|| variance / (sum * sum))
        };
        let all: Vec<f64> = (0..bands).filter_map(of_band).collect();
        let worst = all.into_iter().reduce(f64::max).unwrap_or(self.histories);
        worst.max(self.histories.recip())
    }

    /// Returns the geometric mean of [`variances`](Self::variances) over all faces and over the
    /// tenth of them where the variance is largest, which counts as much as all. A few faces that
    /// hardly any light reaches, where all variances are alike, do not hide how the others differ,
    /// and these do not hide a tenth that is found badly.
    pub(super) fn typical(&self, other: &Self) -> f64 {
        let all = self.variances(other);
        let mean = |some: &[f64]| some.iter().map(|v| v.ln()).sum::<f64>() / some.len() as f64;
        (0.5 * (mean(&all) + mean(&all[all.len() - all.len().div_ceil(10)..]))).exp()
    }
}

/// The error by which ways to find the light are judged.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Judged {
    /// That of all faces, as a geometric mean.
    All,
    /// That of the face where it is hardest to become small: all must meet a tolerance.
    Hardest,
    /// That of groups, where these alone must meet a tolerance.
    Sum,
}

impl Judged {
    /// Returns the relative variance that decides for a way beside another one.
    fn variance(self, own: &Found, other: &Found) -> f64 {
        match self {
            Self::Hardest => *own.variances(other).last().expect("one at least"),
            Self::Sum => own.of_sum(other),
            Self::All => own.typical(other),
        }
    }

    /// Returns by which error a run is judged.
    pub fn of(scene: &Scene, settings: &Settings) -> Self {
        let is_group = |target: &Target| {
            let captors = || scene.captors().iter().map(|captor| captor.id.as_str());
            let mut groups = scene.groups().iter();
            groups.any(|group| fits(&target.pattern, group))
                && !captors().any(|id| fits(&target.pattern, id))
        };
        match (settings.tolerance, &settings.of[..]) {
            (None, _) => Self::All,
            (Some(_), []) => Self::Hardest,
            (Some(_), of) if of.iter().all(is_group) => Self::Sum,
            (Some(_), _) => Self::All,
        }
    }
}

/// The result of a trial of one estimator.
#[derive(Clone)]
pub(super) struct Tried {
    /// What was found at each tried face and in each band.
    pub found: Found,
    /// Number of histories: photons, or paths from each face.
    pub histories: u64,
    /// Work of a history over all faces.
    pub work: f64,
    /// Work of the whole trial.
    pub spent: f64,
    /// How many photons, or paths, a history over all faces counts as in `--photons`.
    pub unit: u64,
}

impl Tried {
    /// Evaluates the totals of `histories` histories, each of which counts as `unit` photons or
    /// paths, and brings at most this power, per band, to a captor that it comes to.
    pub fn new(
        scene: &Scene,
        (totals, histories): (&Totals, u64),
        size: Size,
        unit: u64,
        most: Vec<f64>,
    ) -> Self {
        let channels = tried_faces(scene, size).into_iter().map(|face| channel(scene, &face));
        let found = Found::new(scene, totals, histories, channels, most);
        let spent = totals.work() as f64;
        Self { found, histories, work: spent / histories as f64, spent, unit }
    }

    /// Returns the work for a relative error of 1.
    pub fn cost(&self, other: &Self, judged: Judged) -> f64 {
        self.work * judged.variance(&self.found, &other.found)
    }
}

/// Runs a trial of paths.
pub(super) fn paths_of(
    scene: &Scene,
    settings: &Settings,
    pilot: &Arc<Pilot>,
    size: Size,
    control: &Control,
) -> Result<Tried> {
    let settings = Settings { estimator: Estimator::Paths, ..of_a_trial(settings) };
    let (tried_faces, all) = (tried_faces(scene, size), faces(scene).len());
    let share = tried_faces.len() as f64 / all as f64;
    let each = size.histories() / tried_faces.len() as u64;
    let (arrivals, known) = (Arrivals::OnCaptors, Some(pilot.clone()));
    let mut run = Run::knowing(scene, &settings, Vec::new(), arrivals, control, known)?;
    let work = Work::Paths(tried_faces, pilot.clone());
    run.histories.work = work;
    let (totals, histories) = tried(run, 1, (BATCHES, each, size.rays))?;
    let none = of_no_photons(scene);
    let tried = Tried::new(scene, (&totals, histories), size, all as u64, none);
    Ok(Tried { work: tried.work / share, ..tried })
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
    let of = |histories: u64| {
        run.round(round, &run.histories.schedule(run.scene, histories * run.histories.unit())?)
    };
    let few = of(first)?;
    let each = few.segments as f64 / first as f64;
    let mut histories = first;
    while 2 * histories <= most && 2.0 * histories as f64 * each <= rays as f64 {
        histories *= 2;
    }
    Ok((if histories == first { few } else { of(histories)? }, histories))
}

/// Returns the most power that a photon brings, per band, W or umol/s: that of all lights, as a sum is
/// divided by the number of photons and their lights share them in proportion.
pub(super) fn of_photons(scene: &Scene) -> Vec<f64> {
    let power = |band: usize| scene.lights().iter().map(|light| light.power[band]).sum();
    (0..scene.bands().len()).map(power).collect()
}

/// Returns the same of paths: none, as each of them comes to its captor.
fn of_no_photons(scene: &Scene) -> Vec<f64> {
    vec![0.0; scene.bands().len()]
}

/// Returns faces that stand for all faces.
fn tried_faces(scene: &Scene, size: Size) -> Vec<Face<'_>> {
    let all = faces(scene);
    let step = size.step(all.len());
    all.into_iter().step_by(step).collect()
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
            affordable(&scene.unwrap(), &Settings::default(), &control, (4096, RAYS)).unwrap()
        };
        assert_eq!(photons(0.0), 4096);
        assert_eq!(photons(1.0), BATCHES);
    }

    fn found(values: &[(f64, f64)], histories: f64, brings: f64) -> Found {
        let value = |&(flux, variance)| Value { flux, variance, is_rough: flux == 0.0 };
        Found { histories, values: values.iter().map(value).collect(), brings: vec![brings] }
    }

    /// Photons of 1e6 W that come to none of a hundred leaves on each of which 1 W falls have the
    /// relative variance 1e6 there, however few were traced. Paths that miss what photons find have at
    /// least about their number.
    #[test]
    fn what_stays_dark_counts_against_it() {
        let photons = found(&[(0.0, 0.0); 100], 16_384.0, 1e6);
        let paths = found(&[(1.0, 0.5); 100], 128.0, 0.0);
        assert!(photons.variances(&paths).iter().all(|&variance| variance == 1e6));
        assert!(paths.variances(&photons).iter().all(|&variance| variance == 0.5));
        let lit = found(&[(1.0, 3.0)], 16_384.0, 1e6);
        assert_eq!(found(&[(0.0, 0.0)], 128.0, 0.0).variances(&lit), [128.0]);
    }

    /// Of four equal faces as a group, one history of relative variance 2 at each has 2 / 4; photons of 10 W
    /// that have missed one of 1 W bring it the variance 10.
    #[test]
    fn groups_are_known_better_than_their_faces() {
        let paths = found(&[(1.0, 2.0); 4], 128.0, 0.0);
        let photons = found(&[(1.0, 10.0), (1.0, 10.0), (1.0, 10.0), (0.0, 0.0)], 1e4, 10.0);
        assert_eq!((paths.of_sum(&photons), photons.of_sum(&paths)), (0.5, 2.5));
        let missed = found(&[(1.0, 2.0), (0.0, 0.0)], 128.0, 0.0);
        assert_eq!(missed.of_sum(&found(&[(1.0, 2.0); 2], 128.0, 0.0)), (2.0 + 128.0) / 4.0);
    }

    /// Faces at which one of two ways has no variance, such as the outer walls of a box under the sun,
    /// do not decide alone: the ratio of the ways is that of the faces where light varies, within a
    /// hundredfold. What differs at a tenth of the faces counts.
    #[test]
    fn a_face_without_variance_does_not_decide() {
        let (mut one, mut other) = ([(1.0, 2.0); 9], [(1.0, 8.0); 9]);
        one[..4].fill((1.0, 1e-3));
        other[..4].fill((1.0, 0.0));
        let [one, other] = [one, other].map(|values| found(&values, 1000.0, 0.0));
        let ratio = one.typical(&other) / other.typical(&one);
        assert!((0.1..1.0).contains(&ratio), "{ratio}");
        let even = found(&[(1.0, 1.0); 20], 1000.0, 0.0);
        let mut values = [(1.0, 0.9); 20];
        values[..2].fill((1.0, 1e3));
        let uneven = found(&values, 1000.0, 0.0);
        assert!(even.typical(&uneven) < uneven.typical(&even));
    }
}
