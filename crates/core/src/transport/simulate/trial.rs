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
    Arrivals, BATCHES, Control, MIN_PATHS, Run,
    division::{Division, TriedComplete},
    least_paths,
    tried::{FEWEST, Judged, Size, Tried, of_a_trial, of_photons, rays_of_a_photon, tried},
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

/// A run that traces fewer rays than this takes some hundredths of a second: it has no trial, and
/// traces photons.
const SHORTEST: f64 = (1u64 << 15) as f64;
/// One of fewer rays than this, some tenths of a second, has a trial only where its photons leave most
/// captors dark.
const SHORT: f64 = (1u64 << 19) as f64;
/// This share of its photons tells that.
const GLANCE: f64 = 0.05;
/// Complete paths are chosen where they take less than this fraction of the work of photons: a trial is
/// rough, does not know what photons of a run gain by being spread evenly, and photons alone are
/// simpler to read.
const CLEAR: f64 = 0.7;
/// They may take this many times the work that was asked for, where the least number of them is more.
const BEYOND: f64 = 1.25;
/// A trial has up to four parts, of paths and of photons, each of which may trace one in this many of
/// the rays of the run, but at least so many rays: no fewer tell anything.
const PART: f64 = 48.0;
const LEAST_RAYS: u64 = 1 << 14;
/// All trials together may take this share of the work of a run, but the first of them.
const SPENT: f64 = 0.1;

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
    /// The most rays of a part of the last trial, by which the same trial finds the same division of
    /// the work again; 0 without one.
    pub trial: u64,
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
        let estimator = Estimator::Photons;
        let choice = Choice { estimator, photons: asked(settings), why, trial: 0 };
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
        let Some(size) = first_size(scene, settings, guidance.as_ref(), control)? else {
            return by_photons("the run is too short to try paths");
        };
        let Trial { complete, photons, size } =
            Trial::of_run(scene, settings, guidance, size, control)?;
        let TriedComplete { pilot, division, tried: paths, left, .. } = complete;
        if !(paths.found.finds_light() || photons.found.finds_light()) {
            return by_photons("neither paths nor photons of a trial found light");
        }
        let judged = Judged::of(scene, settings);
        let times = paths.cost(&photons, judged) / photons.cost(&paths, judged);
        // so many paths, over all faces, take as much work as one photon of a run of photons
        let per_photon = paths.unit as f64 * photons.work / paths.work;
        let least = (paths.unit * MIN_PATHS) as f64;
        let are_few =
            asked(settings).is_some_and(|photons| BEYOND * photons as f64 * per_photon < least);
        if times >= CLEAR || are_few {
            let why = match times >= CLEAR {
                true => {
                    // of what is printed as less than 1 a reader expects paths
                    let rule = match times < 0.95 {
                        true => format!(", and are taken below {CLEAR}"),
                        false => String::new(),
                    };
                    format!(
                        "complete paths would take {} times the work for the same errors{rule}",
                        digits(times)
                    )
                }
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
        let choice = Choice {
            estimator: Estimator::Complete,
            photons: asked(settings),
            why,
            trial: size.rays,
        };
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

/// A trial of photons and of complete paths.
struct Trial {
    complete: TriedComplete,
    photons: Tried,
    size: Size,
}

impl Trial {
    /// The trial of a run. Where a tolerance is to be met by each captor, few photons of what paths
    /// leave to them decide: larger trials follow until enough of these have come, or the trials would
    /// take more than their share of the run.
    fn of_run(
        scene: &Scene,
        settings: &Settings,
        guidance: Option<Guidance>,
        mut size: Size,
        control: &Control,
    ) -> Result<Self> {
        let pilot = Arc::new(Pilot::beside_photons(scene, settings.seed));
        let judged = Judged::of(scene, settings);
        let mut spent = 0.0;
        loop {
            let trial = Self::new(scene, settings, guidance.clone(), (&pilot, size), control)?;
            let own = trial.complete.spent + trial.photons.spent;
            spent += own;
            let is_enough = judged != Judged::Hardest || trial.complete.is_left_known;
            let most = SPENT * trial.work_of_run(settings, judged);
            let fits = |next: &Size| spent + next.over(size) * own <= most;
            match size.next().filter(|next| !is_enough && fits(next)) {
                Some(next) => size = next,
                None => return Ok(trial),
            }
        }
    }

    fn new(
        scene: &Scene,
        settings: &Settings,
        guidance: Option<Guidance>,
        (pilot, size): (&Arc<Pilot>, Size),
        control: &Control,
    ) -> Result<Self> {
        let complete = TriedComplete::new(scene, settings, pilot, size, control)?;
        // photons beside paths may be sent through a box about the captors, as those alone are not
        let photons = match guidance {
            None if pilot.most_gain() == 1.0 => Tried { spent: 0.0, ..complete.photons.clone() },
            guidance => photons_of(scene, settings, guidance, size, control)?,
        };
        Ok(Self { complete, photons, size })
    }

    /// Returns about how much work the run takes: that of its photons or, if less meets its tolerance,
    /// that of the better way until then.
    fn work_of_run(&self, settings: &Settings, judged: Judged) -> f64 {
        let of = |photons: u64| photons as f64 * self.photons.work;
        let asked = asked(settings).map_or(f64::INFINITY, of);
        let Some(tolerance) = settings.tolerance else { return asked };
        let [paths, photons] = [&self.complete.tried, &self.photons];
        let costs = [paths.cost(photons, judged), photons.cost(paths, judged)];
        asked.min(costs[0].min(costs[1]) / tolerance.get().powi(2))
    }
}

/// Returns the size of the first trial of a run. `None` if the run is too short for one: it takes some
/// tenths of a second, and its photons reach most captors, or 100 paths from each face are more than it
/// has time for. Errors: those of a run.
fn first_size(
    scene: &Scene,
    settings: &Settings,
    guidance: Option<&Guidance>,
    control: &Control,
) -> Result<Option<Size>> {
    let Some(photons) = asked(settings).filter(|_| settings.max_time.is_none()) else {
        return Ok(Some(Size::USUAL));
    };
    if photons < scene.sources() as u64 {
        // the run itself says that these are too few
        return Ok(None);
    }
    let (few, each) = rays_of_a_photon(scene, settings, guidance.cloned(), control)?;
    let rays = photons as f64 * each;
    if rays < SHORTEST || photons < few {
        return Ok(None);
    }
    if rays >= SHORT {
        let rays = ((rays / PART) as u64).clamp(LEAST_RAYS, Size::USUAL.rays);
        return Ok(Some(Size { rays }));
    }
    if least_paths(scene) > photons {
        return Ok(None);
    }
    let glance = Size { rays: (GLANCE * rays) as u64 };
    let found = photons_of(scene, settings, guidance.cloned(), glance, control)?.found;
    Ok(found.is_dark().then_some(Size::FIRST))
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

/// Runs a trial of photons.
fn photons_of<'a>(
    scene: &'a Scene,
    settings: &Settings,
    guidance: Option<Guidance<'a>>,
    size: Size,
    control: &Control,
) -> Result<Tried> {
    let settings = of_a_trial(settings);
    let run = Run::new(scene, &settings, Vec::new(), Arrivals::OnCaptors, control)?;
    let run = run.guided_by(guidance);
    let first = BATCHES.max(FEWEST * scene.sources() as u64);
    let (totals, histories) = tried(run, 0, (first, size.histories(), size.rays))?;
    Ok(Tried::new(scene, (&totals, histories), size, 1, of_photons(scene)))
}
