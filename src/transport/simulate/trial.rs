//! A short trial of both estimators on the scene itself, to pick the cheaper one.
//!
//! Cost is counted as work, never by the clock: rays x relative variance, which is the number of
//! rays for a relative standard error of 1, and falls as 1 / error^2.

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

/// Photons, and paths from all faces together, of a trial; fewer where they would take more than [`RAYS`].
const TRIAL: u64 = 1 << 16;
/// The most faces that are tried, spread over all captors.
const FACES: usize = 64;
/// Share of the light on captors that paths may miss; where they would miss more, photons do it.
const MISSED: f64 = 1e-3;
/// The error that work is told for, where no tolerance is asked for.
const GOAL: f64 = 0.01;
/// Photons alike that say what the variance at a face is.
const SURE: f64 = 100.0;
/// The other estimator is named where it would take less than this share of the work.
const MUCH_LESS: f64 = 0.25;
/// The share of the rays of a run that may be spent on finding that out, and the least number that tells something.
const SPENT: u64 = 64;
const TELLING: u64 = 1 << 16;

/// An estimator and why it was chosen.
#[derive(Clone, Debug, PartialEq)]
pub struct Choice {
    /// Photons or paths.
    pub estimator: Estimator,
    /// A sentence for the user.
    pub why: String,
}

impl Choice {
    /// Picks the cheaper estimator for the tolerance of `settings` on each captor or, without one, for
    /// the root mean square error over captors. Photons are guided so. Errors: those of a run.
    pub(super) fn make<'a>(
        scene: &'a Scene,
        settings: &Settings,
        guidance: Option<Guidance<'a>>,
        control: &Control,
    ) -> Result<Self> {
        let photons = |why: String| Ok(Self { estimator: Estimator::Photons, why });
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
        let paths = paths_of(scene, settings, RAYS, control)?;
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
        Ok(Self { estimator, why })
    }
}

/// Says so where the other estimator would take much less work than a run did, as far as a short trial of it tells.
/// Errors: those of a run.
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
            (own, paths_of(scene, settings, rays.min(RAYS), control)?, Estimator::Paths)
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

/// The share of the light on captors that paths cannot find.
fn missed(scene: &Scene, settings: &Settings) -> f64 {
    Unseen::find(scene, settings.seed).map_or(0.0, |unseen| unseen.share())
}

/// Faces that stand for all.
fn tried_faces(scene: &Scene) -> Vec<Face<'_>> {
    let all = faces(scene);
    let step = all.len().div_ceil(FACES);
    all.into_iter().step_by(step).collect()
}

/// A trial of photons, until they have taken so many rays.
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
    // one photon of each light in each batch, then twice as many, ...
    let first = BATCHES * scene.sources() as u64;
    let (totals, histories) = tried(run, 0, (first, TRIAL, rays))?;
    Ok(Tried::new(scene, &totals, histories, 1))
}

/// A trial of paths.
fn paths_of(scene: &Scene, settings: &Settings, rays: u64, control: &Control) -> Result<Tried> {
    let settings = Settings { estimator: Estimator::Paths, ..of_a_trial(settings) };
    let (tried_faces, all) = (tried_faces(scene), faces(scene).len());
    let share = tried_faces.len() as f64 / all as f64;
    let each = TRIAL / tried_faces.len() as u64;
    let run = Run::new(scene, &settings, Vec::new(), Keep::OnCaptors, control)?;
    let work = Work::Paths(tried_faces, Pilot::run(scene, settings.seed));
    let (totals, histories) = tried(Run { work, ..run }, 1, (BATCHES, each, rays))?;
    let tried = Tried::new(scene, &totals, histories, all as u64);
    Ok(Tried { rays: tried.rays / share, ..tried })
}

/// What a round finds with the first number of histories, or with twice as many, and so on: up to the second number, or until
/// that would take too many rays; and how many they were.
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

/// A trial of one estimator.
struct Tried {
    found: Found,
    /// Histories: photons, or paths from each face.
    histories: u64,
    /// Rays of a history of all faces.
    rays: f64,
    /// What counts as one of `--photons`, in a history of all faces.
    unit: u64,
}

impl Tried {
    /// What totals of so many histories say, each of which counts as so many.
    fn new(scene: &Scene, totals: &Totals, histories: u64, unit: u64) -> Self {
        let channel = |face: Face| scene.captors[face.captor].first_channel + face.channel as usize;
        let channels = tried_faces(scene).into_iter().map(channel);
        let found = Found::new(scene, totals, histories, channels);
        Self { found, histories, rays: totals.segments as f64 / histories as f64, unit }
    }

    /// Rays for a relative error of 1: at the hardest face, or in the mean.
    fn work(&self, other: &Self, hardest: bool) -> f64 {
        let variance = match hardest {
            true => *self.found.variances(&other.found).last().expect("one at least"),
            false => self.found.mean(&other.found),
        };
        self.rays * variance
    }

    /// How many photons, or paths over all captors, find an error: at the hardest face, or the median one. Where the trial
    /// has not found that to a tenth, as by a hundred photons alike, at least so many.
    fn needed(&self, other: &Self, goal: f64, hardest: bool) -> String {
        let all = self.found.variances(&other.found);
        let variance = all[if hardest { all.len() - 1 } else { all.len() / 2 }];
        let sure = self.histories as f64 >= SURE * variance;
        let about = if sure { "about" } else { "at least" };
        format!("{about} {:.1e}", self.unit as f64 * variance / goal.powi(2))
    }
}
