//! A short trial of the estimators on the scene itself, which chooses the cheaper one.
//!
//! Cost is counted as [work](crate::math::effort), never by the clock, times the relative variance.
//! This is the work for a relative standard error of 1; other errors take 1 / error^2 times as much.
//!
//! Photons are traced in any case: alone, or beside paths. Paths alone are never chosen, because
//! those that leave some light to photons miss nothing, and cost hardly more where there is little of
//! it.

use std::sync::Arc;

use super::{
    BATCHES, Control, Keep, MIN_PATHS, Run,
    division::{Division, TriedComplete},
    tried::{
        FEWEST, Judged, TRIAL, TRIAL_RAYS, Tried, of_a_trial, of_photons, rays_of_a_photon, tried,
    },
};
use crate::{
    error::Result,
    scene::world::Scene,
    transport::{
        guiding::Guidance,
        paths::Pilot,
        settings::{Estimator, PhotonCount, Settings},
    },
};

/// A run that traces fewer rays than this takes some tenths of a second: it has no trial, and traces
/// photons.
const SHORT: f64 = (1u64 << 19) as f64;
/// A trial has up to four parts, of paths and of photons, each of which may trace one in this many of
/// the rays of the run.
const SPENT: f64 = 48.0;
/// The least number of rays of a part: no fewer tell anything.
const LEAST_RAYS: u64 = 1 << 14;

/// An estimator that a trial has chosen.
#[derive(Clone, Debug, PartialEq)]
pub struct Choice {
    /// Photons, or complete paths.
    pub estimator: Estimator,
    /// Number of photons whose work the run was to take; `None` if only a tolerance or a time limit
    /// ends it.
    pub photons: Option<u64>,
    /// The reason, as text for the user.
    pub why: String,
}

/// What is known once an estimator has been chosen.
pub(super) struct Chosen {
    pub choice: Choice,
    /// For complete paths: what the trial has found for them.
    pub of_paths: Option<OfPaths>,
    /// Number of histories of the chosen estimator that take as much work as one photon.
    pub per_photon: f64,
}

/// What a trial has found for a run of complete paths.
pub(super) struct OfPaths {
    /// What pilot photons have found for the paths.
    pub pilot: Arc<Pilot>,
    /// How they divide their work.
    pub division: Division,
}

impl Chosen {
    /// Photons, for this reason.
    pub fn photons(settings: &Settings, why: String) -> Self {
        let choice = Choice { estimator: Estimator::Photons, photons: asked(settings), why };
        Self { choice, of_paths: None, per_photon: 1.0 }
    }

    /// Chooses the estimator that takes less work for the tolerance of `settings` on each captor or,
    /// without a tolerance, for the variances over all captors. Photons are guided by `guidance`.
    /// Errors: those of a run.
    pub fn make<'a>(
        scene: &'a Scene,
        settings: &Settings,
        guidance: Option<Guidance<'a>>,
        control: &Control,
    ) -> Result<Self> {
        let by_photons = |why: &str| Ok(Self::photons(settings, why.into()));
        if settings.by_light {
            return by_photons("only photons know which light they come from");
        }
        if scene.captors().is_empty() {
            return by_photons("there is no captor for paths to start from");
        }
        let Some(rays) = rays_of_a_trial(scene, settings, asked(settings), control)? else {
            return by_photons("the run is too short to try paths");
        };
        let complete = TriedComplete::new(scene, settings, rays, control)?;
        // photons beside paths may be sent through a box about the captors, as those alone are not
        let photons = match guidance {
            None if complete.pilot.most_gain() == 1.0 => complete.photons.clone(),
            guidance => photons_of(scene, settings, guidance, rays, control)?,
        };
        let TriedComplete { pilot, division, tried: paths, left, .. } = complete;
        if !(paths.found.finds_light() || photons.found.finds_light()) {
            return by_photons("neither paths nor photons of a trial found light");
        }
        let judged = Judged::of(scene, settings);
        let times = paths.cost(&photons, judged) / photons.cost(&paths, judged);
        // so many paths, over all faces, take as much work as one photon of a run of photons
        let per_photon = paths.unit as f64 * photons.work / paths.work;
        let least = (paths.unit * MIN_PATHS) as f64;
        let are_few = asked(settings).is_some_and(|photons| photons as f64 * per_photon < least);
        if times >= 1.0 || are_few {
            let why = match times >= 1.0 {
                true => format!(
                    "complete paths would take {} times the work for the same errors",
                    digits(times)
                ),
                false => format!(
                    "complete paths would take {} times less work for the same errors, but more in all \
                     than was asked for",
                    digits(times.recip())
                ),
            };
            return Ok(Self::photons(settings, why));
        }
        let mut why =
            format!("{} times less work than photons for the same errors", digits(times.recip()));
        if left > 0.0 {
            why += &format!(
                "; paths leave about {:.2} % of the light on the captors to photons",
                100.0 * left
            );
        }
        let choice = Choice { estimator: Estimator::Complete, photons: asked(settings), why };
        Ok(Self { choice, of_paths: Some(OfPaths { pilot, division }), per_photon })
    }
}

/// Returns the number of photons whose work a run is to take, if it is limited by that.
pub(super) fn asked(settings: &Settings) -> Option<u64> {
    match settings.tolerance {
        Some(_) => settings.tolerance_limit.map(PhotonCount::get),
        None => Some(settings.photons_or_default()),
    }
}

/// Returns the most rays of each part of a trial before a run of so many photons; `None` if the run
/// is too short for a trial. Errors: those of a run.
pub(super) fn rays_of_a_trial(
    scene: &Scene,
    settings: &Settings,
    photons: Option<u64>,
    control: &Control,
) -> Result<Option<u64>> {
    let Some(photons) = photons.filter(|_| settings.max_time.is_none()) else {
        return Ok(Some(TRIAL_RAYS));
    };
    let (few, each) = match photons < scene.sources() as u64 {
        // the run itself says that these are too few
        true => return Ok(None),
        false => rays_of_a_photon(scene, settings, control)?,
    };
    let rays = photons as f64 * each;
    let short = rays < SHORT || photons < few;
    Ok((!short).then_some(((rays / SPENT) as u64).clamp(LEAST_RAYS, TRIAL_RAYS)))
}

/// Writes a number with two significant digits.
fn digits(number: f64) -> String {
    match number {
        ..9.95 => format!("{number:.1}"),
        ..99.5 => format!("{number:.0}"),
        ..1e5 => format!("{:.0}", {
            let unit = 10f64.powi(number.log10().floor() as i32 - 1);
            (number / unit).round() * unit
        }),
        _ => format!("{number:.1e}"),
    }
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
    let first = BATCHES.max(FEWEST * scene.sources() as u64);
    let (totals, histories) = tried(run, 0, (first, TRIAL, rays))?;
    Ok(Tried::new(scene, &totals, histories, 1, of_photons(scene)))
}
