//! Warnings: what a user should know before trusting a result.

use super::{CaptorResult, FaceResult, RunResult};
use phylux_core::{
    error::{LISTED, some},
    transport::settings::Estimator,
};

/// A warning is given if more than this fraction of the emitted power was lost.
const MUCH_LOST: f64 = 1e-3;
/// With fewer batches, standard errors are off by more than a fifth: their own relative error is 1
/// / sqrt(2 (batches - 1)).
const FEW_BATCHES: u64 = 16;
/// With fewer histories, a value and its standard error are not reliable.
pub const FEW_HISTORIES: u64 = 30;

/// Returns whether a value by photons, with its standard error, rests on fewer histories than these:
/// n histories of equal power have a relative error of 1 / sqrt(n).
pub(super) fn rests_on_few(mean: f64, standard_error: Option<f64>) -> bool {
    mean > 0.0 && standard_error.is_some_and(|se| se * (FEW_HISTORIES as f64).sqrt() > mean)
}

/// A warning about a result.
#[derive(Clone, Debug, PartialEq)]
pub struct Warning {
    /// Kind of the warning: the same words in all runs, so that sweeps can count them.
    pub kind: &'static str,
    /// The warning in full, with the figures of this run.
    pub text: String,
}

impl RunResult {
    /// Returns the warnings about what the run found, which a user should read before trusting the
    /// result.
    pub fn warnings(&self) -> Vec<Warning> {
        warnings(self)
    }

    /// Returns the same result, whose warnings begin with these about its scene and the files that it
    /// comes from.
    pub fn with_warnings_of_scene(mut self, of_scene: impl IntoIterator<Item = String>) -> Self {
        self.warnings = of_scene.into_iter().collect();
        self.warnings.extend(warnings(&self).into_iter().map(|warning| warning.text));
        self
    }

    /// Returns the warnings about the scene of the result and the files that it comes from.
    pub fn warnings_of_scene(&self) -> Vec<String> {
        let own = warnings(self);
        let of_scene = self.warnings.iter().filter(|text| own.iter().all(|w| w.text != **text));
        of_scene.cloned().collect()
    }
}

fn warnings(result: &RunResult) -> Vec<Warning> {
    let mut warnings = Vec::new();
    let mut warn = |kind, text| warnings.push(Warning { kind, text });
    let energy = &result.energy;
    let lost =
        energy.lost.iter().zip(&energy.emitted).map(|(l, e)| if *e > 0.0 { l / e } else { 0.0 });
    let lost = lost.fold(0.0, f64::max);
    if lost > MUCH_LOST {
        warn(
            "power was lost at the length limits",
            format!(
                "{:.2} % of the power was on paths cut off at the length limits (lost); do all surfaces absorb? \
                 (docs/method.md#following-a-photon)",
                100.0 * lost
            ),
        );
    }
    let cut_off = result.cut_off.unwrap_or(0.0);
    if cut_off > MUCH_LOST {
        warn(
            "paths were cut off at the length limits",
            format!(
                "{:.2} % of the paths were cut off at the length limits, and miss light; do all surfaces absorb? \
                 (docs/method.md#following-a-photon)",
                100.0 * cut_off
            ),
        );
    }
    match result.batches {
        1 => warn(
            "one batch: no standard error is known",
            "one batch: no standard error is known; trace more (docs/results.md#standard-errors)"
                .into(),
        ),
        batches if batches < FEW_BATCHES => warn(
            "standard errors come from few batches",
            format!(
                "the standard errors come from {batches} batches only and are rough themselves; trace more \
                 (docs/results.md#standard-errors)"
            ),
        ),
        _ => {}
    }
    if result.starved {
        warn(
            "lamps are not guided",
            "too little light was found to guide lamps by: captors that little reaches may miss some; trace \
             more (docs/method.md#importance)"
                .into(),
        );
    }
    let unseen = result.unseen.iter().flatten().copied().fold(0.0, f64::max);
    if unseen > 0.0 {
        warn(
            "paths cannot find some of the light",
            format!(
                "about {:.2} % of the flux on the captors is missing, which paths cannot find; \
                 --estimator photons finds it (docs/method.md#paths-from-the-captors)",
                100.0 * unseen
            ),
        );
    }
    let lit = |face: &FaceResult| face.flux.iter().any(|&flux| flux > 0.0);
    let reached =
        |captor: &CaptorResult| lit(&captor.front) || captor.back.as_ref().is_some_and(lit);
    let dark: Vec<&str> =
        result.captors.iter().filter(|c| !reached(c)).map(|c| c.id.as_str()).collect();
    if !dark.is_empty() {
        let nothing = match result.estimator {
            Estimator::Paths => "no path found light from",
            Estimator::Complete => "neither paths nor photons found light on",
            _ => "no photon reached",
        };
        let split = result.captors.iter().any(|captor| captor.front.by_light.is_some());
        let remedy = match result.estimator {
            Estimator::Photons if !split => {
                "; --estimator complete starts from the captors (docs/accuracy.md#which-estimator)"
            }
            _ => "",
        };
        let which = some(&dark, LISTED);
        warn("a captor that no light reached", format!("{nothing} {which}{remedy}"));
    }
    let few = |captor: &&CaptorResult| captor.faces().any(|face| face.few_paths);
    let rough: Vec<&str> = result.captors.iter().filter(few).map(|c| c.id.as_str()).collect();
    if rough.is_empty() {
        return warnings;
    }
    // complete paths keep no lights apart
    let by_light = result.captors.iter().any(|captor| captor.front.by_light.is_some());
    match result.estimator {
        Estimator::Paths | Estimator::Complete => {
            let or = match result.estimator {
                Estimator::Paths if by_light => ", or --estimator photons",
                Estimator::Paths => ", or --estimator complete",
                _ => "",
            };
            let faces = || result.captors.iter().flat_map(CaptorResult::faces);
            warn(
                "errors that rest on few paths",
                format!(
                    "the errors at {} of {} faces of captors rest on few paths, and may be far too small, as may \
                     the values; trace more{or} (docs/results.md#standard-errors)",
                    faces().filter(|face| face.few_paths).count(),
                    faces().count()
                ),
            );
        }
        _ => {
            // a face may be marked although many photons came to it
            let many = |face: &FaceResult| {
                face.few_paths && face.histories.is_some_and(|n| n >= FEW_HISTORIES)
            };
            let or = match result.captors.iter().flat_map(CaptorResult::faces).any(many) {
                true => ", or so few that brought most of its light",
                false => "",
            };
            warn(
                "few photons on a face of a captor",
                format!(
                    "fewer than {FEW_HISTORIES} photons on a face of {}{or}: values and errors are not reliable; trace \
                     more{} (docs/results.md#standard-errors)",
                    some(&rough, LISTED),
                    match (by_light, &result.chosen) {
                        (true, _) => ", or try --estimator paths",
                        (false, None) => ", or leave the estimator to a trial (--estimator auto)",
                        // a trial has found that paths take more work
                        (false, Some(_)) => "",
                    }
                ),
            );
        }
    }
    warnings
}
