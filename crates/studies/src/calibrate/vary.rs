//! Numbers of a scene, such as the reflectance of a wall, that are found together with the powers
//! of its lamps.
//!
//! Light is not linear in these numbers. For each choice of them the powers are fitted anew (variable
//! projection: Golub and Pereyra, SIAM Journal on Numerical Analysis 10:413, 1973). The best numbers
//! minimise the deviance D of that fit, -2 times the logarithm of its likelihood, plus a prior about
//! the numbers in the scene file: the numbers trade with the powers, and readings alone may not tell
//! one from the other. Where runs say how the light depends on the numbers, each run leads to the
//! next ones (`tangent`); else a grid of runs is made (`grid`).

use std::path::Path;

use serde_json::Value;

use super::{
    CalibrationPlan, calibrate,
    grid::{Grid, NODES},
    numbers::{Numbers, Vary, warnings},
    powers::{Scale, with_powers},
    tangent::{self, Tangent},
};
use phylux_core::error::{Error, Result, setting};
use phylux_files::{measured_csv::MeasuredRow, scene_file::LoadedScene};
use phylux_results::{calibration::Calibration, result::RunResult};

/// The largest number of numbers that may vary by a grid of runs: two take 25 runs.
const MOST_BY_GRID: usize = 2;
/// The largest number of runs that lead from one to the next.
const MOST_RUNS: usize = 8;
/// The numbers are found once a run moves none by more than this part of its standard error.
const NEAR: f64 = 0.1;

/// A scene with the values that explain readings best, and its calibration.
#[derive(Debug)]
pub struct Found {
    /// The JSON of the scene.
    pub document: Value,
    /// The same scene.
    pub loaded: LoadedScene,
    /// The calibration, with the numbers in `varied`.
    pub calibration: Calibration,
}

/// Loads scenes, and runs them.
pub struct Runs<'a> {
    /// Loads the scene of this JSON.
    pub load: &'a dyn Fn(&Value) -> Result<LoadedScene>,
    /// Runs a scene, and splits the results by light.
    pub run: &'a dyn Fn(&LoadedScene) -> Result<RunResult>,
}

/// Finds the values of some numbers that explain the readings best. `rows` are the readings of the
/// file at `path`. Errors: too many numbers; a range that ends where there is no scene; those of
/// [`calibrate`], and of the runs.
pub fn search(
    numbers: &Numbers,
    (rows, path): (&[MeasuredRow], &Path),
    plan: &CalibrationPlan,
    runs: &Runs,
) -> Result<Found> {
    let count = numbers.varies().len();
    for ends in [|vary: &Vary| vary.from, |vary: &Vary| vary.to] {
        let values: Vec<f64> = numbers.varies().iter().map(ends).collect();
        (runs.load)(&numbers.document(&values))?;
    }
    if tangent::knows(numbers, runs.load)? {
        return by_tangents(numbers, (rows, path), plan, runs);
    }
    if count > MOST_BY_GRID {
        let problem = format!(
            "{count} numbers, of some of which no run can say what depends on them, so that each \
             takes {NODES} times the runs"
        );
        let remedy = format!(
            "vary at most {MOST_BY_GRID}, or only reflectances, transmittances and tints that are \
             numbers"
        );
        return Err(Error::input(setting("vary"), problem).remedy(remedy));
    }
    by_grid(numbers, (rows, path), plan, runs)
}

/// Each run leads to the next values, until they no longer change.
fn by_tangents(
    numbers: &Numbers,
    (rows, path): (&[MeasuredRow], &Path),
    plan: &CalibrationPlan,
    runs: &Runs,
) -> Result<Found> {
    let mut values = numbers.start();
    let mut plan = plan.clone();
    let mut first: Option<Calibration> = None;
    let mut scales = Vec::new();
    let mut far = f64::INFINITY;
    let mut count = 0;
    loop {
        count += 1;
        let document = numbers.document(&values);
        let traced = tangent::counting(numbers, with_powers(document.clone(), &scales));
        let mixed = (runs.run)(&(runs.load)(&traced)?)?;
        let result = mixed.mix(&scales.iter().map(Scale::back).collect())?;
        let mut calibration = calibrate(&result, rows, path, &plan)?;
        plan.model = Some(calibration.model);
        let tangent = Tangent::new(numbers, &values, [&mixed, &result], (rows, path), &plan)?;
        let least = tangent.least();
        let before = std::mem::replace(&mut far, least.farthest(&values));
        // once steps no longer become smaller, they are those of chance
        let restless = count > 3 && far > before / 2.0;
        if far > NEAR && !restless && count < MOST_RUNS {
            if first.is_none() {
                scales = Scale::all(&calibration, &document, &(runs.load)(&document)?);
                first = Some(calibration);
            }
            values = least.values;
            continue;
        }
        let varied = numbers.varied(values.iter().copied().zip(least.errors));
        if let Some(first) = first {
            calibration.models = first.models;
        }
        calibration.warnings.extend(warnings(&varied));
        if far > NEAR {
            calibration.warnings.push(format!(
                "another run would move the numbers by up to {far:.1} standard errors: trace more \
                 photons"
            ));
        }
        calibration.varied = varied;
        calibration.runs = Some(count);
        return Ok(Found { loaded: (runs.load)(&document)?, document, calibration });
    }
}

/// Runs a grid of values, and the one with the least deviance.
fn by_grid(
    numbers: &Numbers,
    (rows, path): (&[MeasuredRow], &Path),
    plan: &CalibrationPlan,
    runs: &Runs,
) -> Result<Found> {
    let grid = Grid::new(numbers);
    let fitted = |values: &[f64], plan: &CalibrationPlan| -> Result<_> {
        let document = numbers.document(values);
        let loaded = (runs.load)(&document)?;
        let calibration = calibrate(&(runs.run)(&loaded)?, rows, path, plan)?;
        Ok(Found { document, loaded, calibration })
    };
    // all runs take the same model: the one that is chosen in the middle of the grid
    let middle = fitted(&grid.values(grid.middle()), plan)?.calibration;
    let plan = CalibrationPlan { model: Some(middle.model), ..plan.clone() };
    let deviance = |run: usize| match run == grid.middle() {
        true => Ok(middle.deviance),
        false => fitted(&grid.values(run), &plan).map(|found| found.calibration.deviance),
    };
    let deviances = (0..grid.runs()).map(deviance).collect::<Result<Vec<f64>>>()?;
    let varied = grid.least(&deviances);
    let values: Vec<f64> = varied.iter().map(|varied| varied.value).collect();
    let mut found = fitted(&values, &plan)?;
    found.calibration.models = middle.models;
    found.calibration.warnings.extend(warnings(&varied));
    found.calibration.varied = varied;
    found.calibration.runs = Some(grid.runs() + 1);
    Ok(found)
}
