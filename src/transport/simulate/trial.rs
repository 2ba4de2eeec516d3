//! A short trial of both estimators on the scene itself, which chooses the cheaper one.
//!
//! Cost is counted as work, never by the clock: the number of rays times the relative variance.
//! This is the number of rays for a relative standard error of 1; other errors take 1 / error^2
//! times as many.

use std::sync::Arc;

use super::{
    BATCHES, Control, Keep, Run, Simulation, Work, faces,
    tried::{Found, RAYS, of_a_trial},
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
/// Fraction of the light on captors that paths may miss. Where they would miss more, photons are
/// chosen.
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

/// An estimator, and the reason why it was chosen.
#[derive(Clone, Debug, PartialEq)]
pub struct Choice {
    /// Photons or paths.
    pub estimator: Estimator,
    /// The reason, as text for the user.
    pub why: String,
}

impl Choice {
    /// Chooses the cheaper estimator for the tolerance of `settings` on each captor or, without a
    /// tolerance, for the root mean square error over the captors. Photons are guided by
    /// `guidance`. Returns with the choice what pilot photons have found for paths, if these were
    /// tried. Errors: those of a run.
    pub(super) fn make<'a>(
        scene: &'a Scene,
        settings: &Settings,
        guidance: Option<Guidance<'a>>,
        control: &Control,
    ) -> Result<(Self, Option<Arc<Pilot>>)> {
        let photons = |why: String| Ok((Self { estimator: Estimator::Photons, why }, None));
        if settings.by_light {
            return photons("only photons know which light they come from".into());
        }
        let missed = missed(scene, settings);
        if missed > MISSED {
            let percent = 100.0 * missed;
            return photons(format!(
                "paths cannot find {percent:.2} % of the light on the captors"
            ));
        }
        if scene.captors.is_empty() {
            return photons("there is no captor for paths to start from".into());
        }
        let photons = photons_of(scene, settings, guidance, RAYS, control)?;
        let pilot = Arc::new(Pilot::run(scene, settings.seed));
        let paths = paths_of(scene, settings, &pilot, RAYS, control)?;
        let hardest = settings.tolerance.is_some();
        let times = paths.work(&photons, hardest) / photons.work(&paths, hardest);
        let (estimator, other, times) = match times < 1.0 {
            true => (Estimator::Paths, Estimator::Photons, times.recip()),
            false => (Estimator::Photons, Estimator::Paths, times),
        };
        let goal = settings.tolerance.unwrap_or(GOAL);
        let of = if hardest { "on every captor" } else { "at the median captor" };
        let photons_needed = photons.needed(&paths, goal, hardest);
        let paths_needed = paths.needed(&photons, goal, hardest);
        let percent = 100.0 * goal;
        let why = format!(
            "{percent} % {of} takes {photons_needed} photons, or {paths_needed} paths; {other} are {times:.1} times \
             the work"
        );
        Ok((Self { estimator, why }, Some(pilot)))
    }
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
        Estimator::Paths => {
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
        let channel = |face: Face| scene.captors[face.captor].first_channel + face.channel as usize;
        let channels = tried_faces(scene).into_iter().map(channel);
        let found = Found::new(scene, totals, histories, channels);
        Self { found, histories, rays: totals.segments as f64 / histories as f64, unit }
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
