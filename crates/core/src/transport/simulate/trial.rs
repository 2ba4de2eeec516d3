//! A short trial of the estimators on the scene itself, which chooses the cheaper one.
//!
//! Cost is counted as [work](crate::math::effort), never by the clock, times the relative variance.
//! This is the work for a relative standard error of 1; other errors take 1 / error^2 times as much.

use std::sync::Arc;

use super::{
    BATCHES, Control, Keep, Run, Simulation,
    division::{Division, TriedComplete},
    faces_of_paths,
    tried::{FEWEST, TRIAL, TRIAL_RAYS, Tried, of_a_trial, of_photons, paths_of, tried, unknown},
};
use crate::{
    error::Result,
    scene::world::Scene,
    transport::{
        guiding::Guidance,
        paths::{Pilot, Unseen},
        settings::{Estimator, Guiding, Settings, Tolerance},
    },
};

/// The relative error for which the work is stated where no tolerance is asked for.
const GOAL: f64 = 0.01;
/// The other estimator is recommended if it would take less than this fraction of the work.
const MUCH_LESS: f64 = 0.25;
/// A trial of the other estimator may take one in this many of the rays of a run, and is made only
/// if that is at least [`TELLING`] rays.
const SPENT: u64 = 16;
const TELLING: u64 = 1 << 14;

/// An estimator, and the reason why it was chosen.
#[derive(Clone, Debug, PartialEq)]
pub struct Choice {
    /// Photons, paths or complete paths.
    pub estimator: Estimator,
    /// The reason, as text for the user.
    pub why: String,
}

impl Choice {
    /// Chooses photons where there was no time for a trial.
    pub(super) fn without_trial() -> Self {
        let why = "the time is too short to compare photons with paths".into();
        Self { estimator: Estimator::Photons, why }
    }

    /// Chooses the cheaper estimator for the tolerance of `settings` on each captor or, without a
    /// tolerance, for the geometric mean of the variances over the captors. Photons are guided by
    /// `guidance`. Where paths may miss light, or where photons are better at some faces, photons are
    /// compared with complete paths. Returns with the choice what the trial of paths has found,
    /// if they were tried. Errors: those of a run.
    pub(super) fn make<'a>(
        scene: &'a Scene,
        settings: &Settings,
        guidance: Option<Guidance<'a>>,
        control: &Control,
    ) -> Result<(Self, Option<OfPaths>)> {
        let photons = |why: String| Ok((Self { estimator: Estimator::Photons, why }, None));
        if settings.by_light {
            return photons("only photons know which light they come from".into());
        }
        if scene.captors().is_empty() {
            return photons("there is no captor for paths to start from".into());
        }
        let complete = TriedComplete::new(scene, settings, TRIAL_RAYS, control)?;
        let left = complete.left;
        // photons beside paths may be sent through a box about the captors, as those alone are not
        let photons = match guidance {
            None if complete.pilot.most_gain() == 1.0 => complete.photons.clone(),
            guidance => photons_of(scene, settings, guidance, TRIAL_RAYS, control)?,
        };
        let (paths, of_paths, name) =
            match Unseen::may_be(scene) || !complete.division.by_photons.is_empty() {
                true => {
                    let TriedComplete { pilot, division, tried, .. } = complete;
                    (tried, OfPaths { pilot, division: Some(division) }, Estimator::Complete)
                }
                false => {
                    let pilot = Arc::new(Pilot::run(scene, settings.seed));
                    let tried = paths_of(scene, settings, &pilot, TRIAL_RAYS, control)?;
                    (tried, OfPaths { pilot, division: None }, Estimator::Paths)
                }
            };
        let paths = &paths;
        let hardest = settings.tolerance.is_some();
        let times = paths.cost(&photons, hardest) / photons.cost(paths, hardest);
        let (estimator, other, times) = match times < 1.0 {
            true => (name, Estimator::Photons, times.recip()),
            false => (Estimator::Photons, name, times),
        };
        let goal = settings.tolerance.map_or(GOAL, Tolerance::get);
        let of = if hardest { "on every captor" } else { "at the median captor" };
        let photons_needed = photons.needed(paths, goal, hardest);
        let paths_needed = paths.needed(&photons, goal, hardest);
        let percent = 100.0 * goal;
        let why = format!(
            "{percent} % {of} takes {photons_needed} photons, or {paths_needed} {name}; {other} are {times:.1} \
             times the work"
        );
        let why = match name {
            Estimator::Complete if left > 0.0 => {
                let left = 100.0 * left;
                format!(
                    "{why}; paths leave about {left:.2} % of the light on the captors to photons"
                )
            }
            _ => why,
        };
        Ok((Self { estimator, why }, Some(of_paths)))
    }
}

/// What a trial has found for a run of paths.
pub(super) struct OfPaths {
    /// What pilot photons have found for the paths.
    pub pilot: Arc<Pilot>,
    /// For complete paths: how they divide their work.
    pub division: Option<Division>,
}

/// An estimator that would have taken less work than that of a run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OtherEstimator {
    /// The estimator.
    pub estimator: Estimator,
    /// How many times less work it takes for the same errors.
    pub times: f64,
}

/// Returns the other estimator if, judging by a short trial, it would take much less work than this
/// run did. Errors: those of a run.
pub fn other_estimator(run: &Simulation, control: &Control) -> Result<Option<OtherEstimator>> {
    let (scene, settings) = (run.scene(), run.settings());
    let rays = run.totals().segments / SPENT;
    if run.choice().is_some() || settings.by_light || scene.captors().is_empty() || rays < TELLING {
        return Ok(None);
    }
    let rays = rays.min(TRIAL_RAYS);
    let control = &Control { progress: &|_| {}, ..*control };
    let number = faces_of_paths(scene, run.by_photons()).len() as u64;
    let (own, other, name) = match run.estimator() {
        Estimator::Paths | Estimator::Complete => {
            let histories = run.totals().histories / number;
            let own = Tried::new(scene, run.totals(), histories, number, unknown(scene));
            let pilot = Arc::new(Pilot::run(scene, settings.seed));
            let own = own.counted_as(&paths_of(scene, settings, &pilot, rays, control)?);
            (own, photons_of(scene, settings, None, rays, control)?, Estimator::Photons)
        }
        _ => {
            let brings = match run.guiding() {
                Guiding::Off => of_photons(scene),
                _ => unknown(scene),
            };
            let own = Tried::new(scene, run.totals(), run.totals().histories, 1, brings);
            let own = own.counted_as(&photons_of(scene, settings, None, rays, control)?);
            match Unseen::may_be(scene) {
                true => {
                    let complete = TriedComplete::new(scene, settings, rays, control)?;
                    (own, complete.tried, Estimator::Complete)
                }
                false => {
                    let pilot = Arc::new(Pilot::run(scene, settings.seed));
                    (own, paths_of(scene, settings, &pilot, rays, control)?, Estimator::Paths)
                }
            }
        }
    };
    let share = other.cost(&own, false) / own.cost(&other, false);
    Ok((share < MUCH_LESS).then(|| OtherEstimator { estimator: name, times: share.recip() }))
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
    let brings = if guidance.is_some() { unknown(scene) } else { of_photons(scene) };
    let run = run.guided_by(guidance);
    let first = BATCHES.max(FEWEST * scene.sources() as u64);
    let (totals, histories) = tried(run, 0, (first, TRIAL, rays))?;
    Ok(Tried::new(scene, &totals, histories, 1, brings))
}
