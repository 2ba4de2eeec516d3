//! Warnings: what a user should know before trusting a result.

use super::{CaptorResult, FaceResult, RunResult};
use phylux_core::{
    error::{CommandLine, LISTED, ToWords, Words, setting, some},
    transport::settings::Estimator,
    words,
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
    pub text: Words,
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
        let own = warnings(&self).into_iter().map(|warning| warning.text.spelled(&CommandLine));
        self.warnings = of_scene.into_iter().chain(own).collect();
        self
    }

    /// Returns the warnings about the scene of the result and the files that it comes from.
    pub fn warnings_of_scene(&self) -> Vec<String> {
        let own = warnings(self).into_iter().map(|warning| warning.text.spelled(&CommandLine));
        let own: Vec<String> = own.collect();
        let of_scene = self.warnings.iter().filter(|text| !own.contains(text));
        of_scene.cloned().collect()
    }
}

fn warnings(result: &RunResult) -> Vec<Warning> {
    let all = [lost, cut_off, few_batches, starved, unseen, dark, few_histories, groups_alone];
    all.into_iter().filter_map(|found| found(result)).collect()
}

fn lost(result: &RunResult) -> Option<Warning> {
    let energy = &result.energy;
    let shares =
        energy.lost.iter().zip(&energy.emitted).map(|(l, e)| if *e > 0.0 { l / e } else { 0.0 });
    let lost = shares.fold(0.0, f64::max);
    (lost > MUCH_LOST).then(|| Warning {
        kind: "power was lost at the length limits",
        text: format!(
            "{:.2} % of the power was on paths cut off at the length limits (lost); do all surfaces absorb? \
             (docs/method.md#following-a-photon)",
            100.0 * lost
        )
        .to_words(),
    })
}

fn cut_off(result: &RunResult) -> Option<Warning> {
    let cut_off = result.account.cut_off.filter(|share| *share > MUCH_LOST)?;
    Some(Warning {
        kind: "paths were cut off at the length limits",
        text: format!(
            "{:.2} % of the paths were cut off at the length limits, and miss light; do all surfaces absorb? \
             (docs/method.md#following-a-photon)",
            100.0 * cut_off
        )
        .to_words(),
    })
}

fn few_batches(result: &RunResult) -> Option<Warning> {
    match result.batches {
        1 => Some(Warning {
            kind: "one batch: no standard error is known",
            text: "one batch: no standard error is known; trace more (docs/results.md#standard-errors)".to_words(),
        }),
        batches if batches < FEW_BATCHES => Some(Warning {
            kind: "standard errors come from few batches",
            text: format!(
                "the standard errors come from {batches} batches only and are rough themselves; trace more \
                 (docs/results.md#standard-errors)"
            )
            .to_words(),
        }),
        _ => None,
    }
}

fn starved(result: &RunResult) -> Option<Warning> {
    result.starved.then(|| Warning {
        kind: "lamps are not guided",
        text: "too little light was found to guide lamps by: captors that little reaches may miss some; trace \
               more (docs/method.md#importance)"
            .to_words(),
    })
}

fn unseen(result: &RunResult) -> Option<Warning> {
    let largest = |shares: &Option<Vec<f64>>| shares.iter().flatten().copied().fold(0.0, f64::max);
    let [unseen, error] = [&result.account.unseen, &result.account.unseen_se].map(largest);
    (unseen > 0.0).then(|| Warning {
        kind: "paths cannot find some of the light",
        text: words![
            format!(
                "{:.2} ± {:.2} % of the flux on the captors is missing, which paths cannot find; ",
                100.0 * unseen,
                100.0 * error
            ),
            setting("estimator").is("photons"),
            " finds it (docs/method.md#paths-from-the-captors)",
        ],
    })
}

/// Returns whether the light of each lamp is kept apart, which complete paths do not.
fn is_split(result: &RunResult) -> bool {
    result.captors.iter().any(|captor| captor.front.by_light.is_some())
}

fn dark(result: &RunResult) -> Option<Warning> {
    let is_lit = |face: &FaceResult| face.flux.iter().any(|&flux| flux > 0.0);
    let dark = result.captors.iter().filter(|captor| !captor.faces().any(is_lit));
    let dark: Vec<&str> = dark.map(|captor| captor.id.as_str()).collect();
    if dark.is_empty() {
        return None;
    }
    let nothing = match result.estimator {
        Estimator::Paths => "no path found light from",
        Estimator::Complete => "neither paths nor photons found light on",
        _ => "no photon reached",
    };
    let remedy = match result.estimator {
        Estimator::Photons if !is_split(result) => words![
            "; ",
            setting("estimator").is("complete"),
            " starts from the captors (docs/accuracy.md#which-estimator)"
        ],
        _ => words![],
    };
    let which = some(&dark, LISTED);
    let text = words![nothing, " ", which, remedy];
    Some(Warning { kind: "a captor that no light reached", text })
}

fn groups_alone(result: &RunResult) -> Option<Warning> {
    let rows = result.extras.sensitivity.as_ref()?;
    let is_lit = |face: &FaceResult| face.flux.iter().any(|&flux| flux > 0.0);
    let lit = result.captors.iter().any(|captor| captor.faces().any(is_lit));
    if !lit || rows.iter().any(|row| row.captor.is_some()) {
        return None;
    }
    Some(match rows.is_empty() {
        true => Warning {
            kind: "nothing says on which inputs it depends",
            text: "no captor says on which inputs it depends: none that was asked for is met by its light, or \
                   there are too many captors (docs/sensitivity.md#limits)"
                .to_words(),
        },
        false => Warning {
            kind: "only groups say on which inputs they depend",
            text: "only groups say on which inputs they depend, as there are too many captors \
                   (docs/sensitivity.md#limits)"
                .to_words(),
        },
    })
}

fn few_histories(result: &RunResult) -> Option<Warning> {
    let few = |captor: &&CaptorResult| captor.faces().any(|face| face.few_paths);
    let rough: Vec<&str> = result.captors.iter().filter(few).map(|c| c.id.as_str()).collect();
    if rough.is_empty() {
        return None;
    }
    let faces = || result.captors.iter().flat_map(CaptorResult::faces);
    let by_light = is_split(result);
    if let Estimator::Paths | Estimator::Complete = result.estimator {
        let or = match result.estimator {
            Estimator::Paths if by_light => words![", or ", setting("estimator").is("photons")],
            Estimator::Paths => words![", or ", setting("estimator").is("complete")],
            _ => words![],
        };
        let text = words![
            format!(
                "the errors at {} of {} faces of captors rest on few paths, and may be far too small, as may \
                 the values; trace more",
                faces().filter(|face| face.few_paths).count(),
                faces().count()
            ),
            or,
            " (docs/results.md#standard-errors)",
        ];
        return Some(Warning { kind: "errors that rest on few paths", text });
    }
    // a face may be marked although many photons came to it
    let many =
        |face: &FaceResult| face.few_paths && face.histories.is_some_and(|n| n >= FEW_HISTORIES);
    let or = match faces().any(many) {
        true => ", or so few that brought most of its light",
        false => "",
    };
    let remedy = match (by_light, &result.chosen) {
        (true, _) => words![", or try ", setting("estimator").is("paths")],
        (false, None) => {
            let auto = setting("estimator").is("auto");
            words![", or leave the estimator to a trial (", auto, ")"]
        }
        // a trial has found that paths take more work
        (false, Some(_)) => words![],
    };
    let text = words![
        format!(
            "fewer than {FEW_HISTORIES} photons on a face of {}{or}: values and errors are not reliable; trace more",
            some(&rough, LISTED)
        ),
        remedy,
        " (docs/results.md#standard-errors)",
    ];
    Some(Warning { kind: "few photons on a face of a captor", text })
}
