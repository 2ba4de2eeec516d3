//! A short trial of the estimators on the scene itself, which chooses the cheaper one, and how many
//! photons are traced beside complete paths.
//!
//! Cost is counted as work, never by the clock: the number of rays times the relative variance.
//! This is the number of rays for a relative standard error of 1; other errors take 1 / error^2
//! times as many.

use std::sync::Arc;

use super::{
    BATCHES, Control, Keep, Run, Simulation, TASK, Work, faces,
    schedule::{Beside, Schedule},
    tried::{Found, RAYS, affordable, of_a_trial},
};
use crate::{
    error::Result,
    math::rng::Purpose,
    scene::world::Scene,
    transport::{
        guiding::Guidance,
        paths::{Face, Pilot, Unseen},
        settings::{Estimator, Settings},
        tally::Totals,
    },
};

/// Number of photons, or of paths from all faces together, of a trial; fewer where they would take
/// more than [`RAYS`].
const TRIAL: u64 = 1 << 16;
/// The most faces from which paths are tried. They are spread over all captors.
const FACES: usize = 64;
/// Fraction of the light on captors that paths may miss. Where they would miss more, photons or
/// complete paths are chosen.
const MISSED: f64 = 1e-3;
/// The relative error for which the work is stated where no tolerance is asked for.
const GOAL: f64 = 0.01;
/// The variance at a face is known well enough if the trial is as accurate as this many photons of
/// equal power there.
const SURE: f64 = 100.0;
/// The other estimator is recommended if it would take less than this fraction of the work.
const MUCH_LESS: f64 = 0.25;
/// A trial of the other estimator may take one in this many of the rays of a run, and is made only
/// if that is at least [`TELLING`] rays.
const SPENT: u64 = 64;
const TELLING: u64 = 1 << 16;
/// Photons beside complete paths take at least and at most this fraction of the work.
const LEAST_BESIDE: f64 = 1.0 / 64.0;
const MOST_BESIDE: f64 = 0.75;

/// An estimator, and the reason why it was chosen.
#[derive(Clone, Debug, PartialEq)]
pub struct Choice {
    /// Photons, paths or complete paths.
    pub estimator: Estimator,
    /// The reason, as text for the user.
    pub why: String,
}

impl Choice {
    /// Chooses the cheaper estimator for the tolerance of `settings` on each captor or, without a
    /// tolerance, for the root mean square error over the captors. Photons are guided by
    /// `guidance`. Where paths would miss light, photons are compared with complete paths. Returns
    /// with the choice what the trial of paths has found, if they were tried. Errors: those of a
    /// run.
    pub(super) fn make<'a>(
        scene: &'a Scene,
        settings: &Settings,
        guidance: Option<Guidance<'a>>,
        control: &Control,
    ) -> Result<(Self, Option<TriedPaths>)> {
        let photons = |why: String| Ok((Self { estimator: Estimator::Photons, why }, None));
        if settings.by_light {
            return photons("only photons know which light they come from".into());
        }
        if scene.captors.is_empty() {
            return photons("there is no captor for paths to start from".into());
        }
        let photons = photons_of(scene, settings, guidance, RAYS, control)?;
        let missed = missed(scene, settings);
        let (of_paths, name) = match missed > MISSED {
            true => (TriedPaths::complete(scene, settings, control)?, Estimator::Complete),
            false => {
                let pilot = Arc::new(Pilot::run(scene, settings.seed));
                let tried = paths_of(scene, settings, &pilot, RAYS, control)?;
                (TriedPaths { pilot, beside: None, tried }, Estimator::Paths)
            }
        };
        let paths = &of_paths.tried;
        let hardest = settings.tolerance.is_some();
        let times = paths.work(&photons, hardest) / photons.work(paths, hardest);
        let (estimator, other, times) = match times < 1.0 {
            true => (name, Estimator::Photons, times.recip()),
            false => (Estimator::Photons, name, times),
        };
        let goal = settings.tolerance.unwrap_or(GOAL);
        let of = if hardest { "on every captor" } else { "at the median captor" };
        let photons_needed = photons.needed(paths, goal, hardest);
        let paths_needed = paths.needed(&photons, goal, hardest);
        let percent = 100.0 * goal;
        let why = format!(
            "{percent} % {of} takes {photons_needed} photons, or {paths_needed} {name}; {other} are {times:.1} \
             times the work"
        );
        let why = match name {
            Estimator::Complete => {
                let missed = 100.0 * missed;
                format!(
                    "{why}; paths cannot find {missed:.2} % of the light on the captors by themselves"
                )
            }
            _ => why,
        };
        Ok((Self { estimator, why }, Some(of_paths)))
    }
}

/// What a trial of paths has found.
pub(super) struct TriedPaths {
    /// What pilot photons have found for the paths.
    pub pilot: Arc<Pilot>,
    /// For complete paths: the best number of photons beside one path from each face.
    pub beside: Option<f64>,
    tried: Tried,
}

impl TriedPaths {
    /// Tries paths, and the photons beside them, to learn how many photons are best. Errors: those
    /// of a run.
    pub fn complete(scene: &Scene, settings: &Settings, control: &Control) -> Result<Self> {
        let pilot = Arc::new(Pilot::beside_photons(scene, settings.seed));
        let paths = paths_of(scene, settings, &pilot, RAYS, control)?;
        let photons = beside_of(scene, settings, &pilot, &paths, control)?;
        let both = || paths.found.each().zip(&paths.means).zip(&photons.faces);
        let each = || {
            both().map(|((relative, own), beside)| {
                let all = own + beside.mean;
                [relative.unwrap_or(0.0) * own * own, beside.power * all, all]
            })
        };
        // the best number for a face follows from the two variances; that of the median face counts
        let mut best: Vec<f64> = each()
            .filter(|[.., all]| *all > 0.0)
            .map(|[own, beside, _]| match beside > 0.0 {
                true => (beside * paths.rays / (own * photons.rays)).sqrt(),
                false => 0.0,
            })
            .collect();
        best.sort_unstable_by(f64::total_cmp);
        let best = best.get(best.len() / 2).copied().unwrap_or(0.0);
        let of_share = |share: f64| share / (1.0 - share) * paths.rays / photons.rays;
        let best = best.clamp(of_share(LEAST_BESIDE), of_share(MOST_BESIDE));
        // a power of two is near enough
        let number = best.log2().round().exp2();
        let variance = |[own, beside, all]: [f64; 3]| {
            (all > 0.0).then(|| (own + beside / number) / (all * all))
        };
        let found = paths.found.with(each().map(variance).collect());
        let tried = Tried { found, rays: paths.rays + number * photons.rays, ..paths };
        Ok(Self { pilot, beside: Some(number), tried })
    }
}

/// The result of a trial of photons beside paths.
struct TriedBeside {
    /// For each face and band of the trial of paths.
    faces: Vec<BesideOn>,
    /// Number of rays of a photon.
    rays: f64,
}

/// What photons beside paths bring to a face, in a band.
#[derive(Clone, Copy)]
struct BesideOn {
    /// Flux, W or umol/s.
    mean: f64,
    /// The variance of one photon for each unit of the light of paths and photons together, W or
    /// umol/s. Few photons count, so it is that of all faces together.
    power: f64,
}

/// Tries photons beside `paths`.
fn beside_of(
    scene: &Scene,
    settings: &Settings,
    pilot: &Arc<Pilot>,
    paths: &Tried,
    control: &Control,
) -> Result<TriedBeside> {
    let settings = of_a_trial(settings);
    let least = scene.sources() as u64;
    let photons = affordable(scene, &settings, control, TRIAL)?.max(BATCHES * least);
    let run = Run::new(scene, &settings, Vec::new(), Keep::OnCaptors, control)?;
    let work = Work::Paths(Vec::new(), pilot.clone());
    let beside = Some(Beside { ratio: 1.0, least });
    let run = Run { work, beside, purpose: Purpose::Trial, ..run };
    let schedule = Schedule { beside, ..Schedule::new(photons, least, TASK.max(least)) };
    let mut totals = run.totals();
    run.rounds(&schedule, (2, 0, 0), 2..3, None, &mut totals, None)?;
    let estimate = |face: &Face, band: usize| {
        totals.running(channel(scene, face))[band].estimate(totals.batches)
    };
    let (all, tried) = (faces(scene), tried_faces(scene));
    let bands = 0..scene.bands.len();
    let power = |band: usize| {
        let errors = all.iter().filter_map(|face| estimate(face, band).standard_error);
        let variance = errors.map(|error| error * error).sum::<f64>() * photons as f64;
        let beside: f64 = all.iter().map(|face| estimate(face, band).mean).sum();
        let own: f64 = paths.means.iter().skip(band).step_by(bands.len()).sum();
        let light = beside + own * all.len() as f64 / tried.len() as f64;
        if light > 0.0 { variance / light } else { 0.0 }
    };
    let powers: Vec<f64> = bands.clone().map(power).collect();
    let on = |face: &Face| -> Vec<BesideOn> {
        let band = |band| BesideOn { mean: estimate(face, band).mean, power: powers[band] };
        bands.clone().map(band).collect()
    };
    let faces = tried.iter().flat_map(on).collect();
    Ok(TriedBeside { faces, rays: totals.segments as f64 / totals.histories as f64 })
}

/// Returns the channel of a face.
fn channel(scene: &Scene, face: &Face) -> usize {
    scene.captors[face.captor].first_channel + face.channel as usize
}

/// Returns a recommendation of the other estimator if, judging by a short trial, it would take much
/// less work than this run did. Errors: those of a run.
pub fn other_estimator(
    scene: &Scene,
    settings: &Settings,
    run: &Simulation,
    control: &Control,
) -> Result<Option<String>> {
    let rays = run.totals.segments / SPENT;
    if run.choice.is_some() || settings.by_light || scene.captors.is_empty() || rays < TELLING {
        return Ok(None);
    }
    let control = &Control { progress: &|_| {}, ..*control };
    let number = faces(scene).len() as u64;
    let (own, other, name) = match run.estimator {
        Estimator::Paths | Estimator::Complete => {
            let own = Tried::new(scene, &run.totals, run.totals.histories / number, number);
            (own, photons_of(scene, settings, None, rays.min(RAYS), control)?, Estimator::Photons)
        }
        _ => {
            let own = Tried::new(scene, &run.totals, run.totals.histories, 1);
            let pilot = Arc::new(Pilot::run(scene, settings.seed));
            (own, paths_of(scene, settings, &pilot, rays.min(RAYS), control)?, Estimator::Paths)
        }
    };
    let share = other.work(&own, false) / own.work(&other, false);
    let much_less =
        share < MUCH_LESS && (name == Estimator::Photons || missed(scene, settings) <= MISSED);
    Ok(much_less.then(|| {
        let times = share.recip();
        format!(
            "--estimator {name} would take about {times:.0} times less work for the same errors"
        )
    }))
}

/// Returns the fraction of the light on captors that paths cannot find.
fn missed(scene: &Scene, settings: &Settings) -> f64 {
    Unseen::find(scene, settings.seed).map_or(0.0, |unseen| unseen.share())
}

/// Returns faces that stand for all faces.
fn tried_faces(scene: &Scene) -> Vec<Face<'_>> {
    let all = faces(scene);
    let step = all.len().div_ceil(FACES);
    all.into_iter().step_by(step).collect()
}

/// Runs a trial of photons that takes up to about `rays` rays.
fn photons_of<'a>(
    scene: &'a Scene,
    settings: &Settings,
    guidance: Option<Guidance<'a>>,
    rays: u64,
    control: &Control,
) -> Result<Tried> {
    let settings = of_a_trial(settings);
    let run = Run::new(scene, &settings, Vec::new(), Keep::OnCaptors, control)?;
    let run = run.guided_by(guidance);
    // one photon of each light in each batch, then twice as many, and so on
    let first = BATCHES * scene.sources() as u64;
    let (totals, histories) = tried(run, 0, (first, TRIAL, rays))?;
    Ok(Tried::new(scene, &totals, histories, 1))
}

/// Runs a trial of paths that takes up to about `rays` rays.
fn paths_of(
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

/// Runs a round with `first` histories, then with twice as many, and so on, until twice as many
/// again would be more than `most` or take more than `rays` rays. Returns the totals of the last
/// one and its number of histories.
fn tried(run: Run, round: u64, (first, most, rays): (u64, u64, u64)) -> Result<(Totals, u64)> {
    let run = Run { purpose: Purpose::Trial, ..run };
    let mut histories = first;
    loop {
        let mut totals = run.totals();
        let schedule = run.schedule(histories * run.unit())?;
        run.rounds(&schedule, (round, 0, 0), round..round + 1, None, &mut totals, None)?;
        if 2 * histories > most || 2 * totals.segments > rays {
            return Ok((totals, histories));
        }
        histories *= 2;
    }
}

/// The result of a trial of one estimator.
struct Tried {
    found: Found,
    /// For each tried face and each band, the flux, W or umol/s.
    means: Vec<f64>,
    /// Number of histories: photons, or paths from each face.
    histories: u64,
    /// Number of rays of a history over all faces.
    rays: f64,
    /// How many photons, or paths, a history over all faces counts as in `--photons`.
    unit: u64,
}

impl Tried {
    /// Evaluates the totals of `histories` histories, each of which counts as `unit` photons or
    /// paths.
    fn new(scene: &Scene, totals: &Totals, histories: u64, unit: u64) -> Self {
        let channels = tried_faces(scene).into_iter().map(|face| channel(scene, &face));
        let channels: Vec<usize> = channels.collect();
        let found = Found::new(scene, totals, histories, channels.iter().copied());
        let bands = |&channel: &usize| &totals.running(channel)[..scene.bands.len()];
        let means = channels.iter().flat_map(bands).map(|band| band.estimate(totals.batches).mean);
        let means = means.collect();
        Self { found, means, histories, rays: totals.segments as f64 / histories as f64, unit }
    }

    /// Returns the number of rays for a relative error of 1, at the face where it is hardest to
    /// reach or averaged over the faces.
    fn work(&self, other: &Self, hardest: bool) -> f64 {
        let variance = match hardest {
            true => *self.found.variances(&other.found).last().expect("one at least"),
            false => self.found.mean(&other.found),
        };
        self.rays * variance
    }

    /// Returns how many photons, or paths over all captors, reach the relative error `goal`, at the
    /// face where it is hardest or at the median face. It says "at least" where the trial has not
    /// reached an error of a tenth itself, as a hundred photons of equal power would.
    fn needed(&self, other: &Self, goal: f64, hardest: bool) -> String {
        let all = self.found.variances(&other.found);
        let variance = all[if hardest { all.len() - 1 } else { all.len() / 2 }];
        let sure = self.histories as f64 >= SURE * variance;
        let about = if sure { "about" } else { "at least" };
        format!("{about} {:.1e}", self.unit as f64 * variance / goal.powi(2))
    }
}
