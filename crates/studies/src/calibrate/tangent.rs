//! Numbers of a scene that are found from how the light depends on them, which one run tells for all
//! numbers at once.
//!
//! A reading E has the elasticities of the run, d ln E / dv for each number v. Near the run it is
//! E exp(Σ (v - v0) d ln E / dv), and so is what each lamp brings of it. This is tangent to the truth,
//! and never becomes negative. The deviance of the fit of such readings is minimised within the
//! ranges of the numbers (Levenberg, Quarterly of Applied Mathematics 2:164, 1944), and the next run
//! is made there. Twice the inverse of the curvature of the deviance at its minimum is the covariance
//! of the numbers.

use std::{collections::HashMap, path::Path};

use serde_json::{Value, json};

use super::{
    CalibrationPlan, Lamps, MeasuredBands, Purpose, Reading, Readings,
    fit::{Fit, Point},
    numbers::{Numbers, Vary},
};
use phylux_core::{
    error::{Error, Result, setting},
    math::least_squares::inverse,
};
use phylux_files::{json, measured_csv::MeasuredRow, scene_file::LoadedScene};
use phylux_results::{
    calibration::Model,
    result::{BandResult, FaceResult, RunResult, SensitivityResult},
};

/// Steps for differences of the deviance, as a part of a number's range.
const STEP: f64 = 0.01;
/// The largest number of steps of a search.
const MOST_STEPS: usize = 50;

/// Returns the JSON of a scene whose runs tell how the light depends on the numbers.
pub fn counting(numbers: &Numbers, mut document: Value) -> Value {
    if let Some(scene) = document.as_object_mut() {
        let names: Vec<String> = numbers.varies().iter().filter_map(material).collect();
        scene.insert("sensitivity".into(), json!(names));
        scene.remove("uncertain");
    }
    document
}

/// Returns the name of the material to which a number belongs, if it belongs to one.
fn material(vary: &Vary) -> Option<String> {
    let (name, _) = vary.pointer.strip_prefix("/materials/")?.split_once('/')?;
    Some(json::unescaped(name))
}

/// Returns whether runs of the scene, which is loaded by `load`, tell how the light depends on all of the
/// numbers. Errors: those of loading the scene.
pub fn knows(numbers: &Numbers, load: &dyn Fn(&Value) -> Result<LoadedScene>) -> Result<bool> {
    if !numbers.varies().iter().all(|vary| material(vary).is_some()) {
        return Ok(false);
    }
    let loaded = load(&counting(numbers, numbers.document(&numbers.start())))?;
    let parameters = loaded.scene.parameters().all();
    Ok((0..numbers.varies().len()).all(|number| {
        let (input, band) = numbers.input(number);
        let own = parameters.iter().find(|parameter| parameter.name == input);
        own.is_some_and(|own| match band {
            Some(band) => own.values.get(band).is_some_and(|x| *x != 0.0),
            None => !own.values.is_empty() && own.values.iter().all(|x| *x != 0.0),
        })
    }))
}

/// The readings of a run that are fitted, and how they depend on the numbers.
#[derive(Debug)]
pub struct Tangent<'a> {
    numbers: &'a Numbers<'a>,
    /// The numbers of the run.
    values: Vec<f64>,
    points: Vec<Point>,
    /// For each point and number d ln E / dv.
    slopes: Vec<Vec<f64>>,
    model: Model,
    /// Number of lamps, and of bands.
    size: [usize; 2],
    prior: Option<f64>,
}

/// The numbers with the least deviance.
#[derive(Debug)]
pub struct Least {
    /// The numbers.
    pub values: Vec<f64>,
    /// Their standard errors; `None` for one that is held at an end of its range, or that the
    /// readings do not determine.
    pub errors: Vec<Option<f64>>,
    ranges: Vec<f64>,
}

impl Least {
    /// Returns by how many standard errors the farthest of the numbers differs from others; where
    /// one has no standard error, by how many tenths of its range.
    pub fn farthest(&self, others: &[f64]) -> f64 {
        let unit = |(error, range): (&Option<f64>, &f64)| error.unwrap_or(0.1 * range);
        let units = self.errors.iter().zip(&self.ranges).map(unit);
        let far = |((a, b), unit): ((&f64, &f64), f64)| (a - b).abs() / unit;
        self.values.iter().zip(others).zip(units).map(far).fold(0.0, f64::max)
    }
}

impl<'a> Tangent<'a> {
    /// Gathers the readings from results by light at the powers of the scene. How they depend on the
    /// numbers is taken from results at powers nearer to those that are fitted.
    pub fn new(
        numbers: &'a Numbers,
        values: &[f64],
        [mixed, result]: [&RunResult; 2],
        (rows, path): (&[MeasuredRow], &Path),
        plan: &CalibrationPlan,
    ) -> Result<Self> {
        let lights = result.energy.by_light.iter().flat_map(|lights| lights.keys());
        let names: Vec<&str> = lights.map(String::as_str).collect();
        let lamps = Lamps::new(&names, &plan.groups)?;
        let bands = MeasuredBands::new(result, rows, path)?;
        let readings = Readings::new(result, rows, path, plan, &lamps, &bands)?;
        let depends = Depends::new(numbers, mixed)?;
        let fitted = || readings.all.iter().filter(|reading| reading.purpose == Purpose::Fit);
        Ok(Self {
            numbers,
            values: values.to_vec(),
            points: fitted().map(|reading| reading.point().clone()).collect(),
            slopes: fitted().map(|reading| depends.slopes(reading)).collect(),
            model: plan.model.unwrap_or(Model::Bands),
            size: [lamps.names.len(), bands.names.len()],
            prior: plan.prior,
        })
    }

    /// Returns the deviance of the fit at other numbers.
    fn deviance(&self, values: &[f64]) -> f64 {
        let moved = |(point, slopes): (&Point, &Vec<f64>)| {
            let steps = values.iter().zip(&self.values).map(|(value, own)| value - own);
            let factor = steps.zip(slopes).map(|(step, slope)| step * slope).sum::<f64>().exp();
            let scaled = |all: &[f64]| all.iter().map(|x| x * factor).collect();
            let (of_lamps, errors) = (scaled(&point.of_lamps), scaled(&point.errors));
            Point { of_lamps, errors, ..point.clone() }
        };
        let points: Vec<Point> = self.points.iter().zip(&self.slopes).map(moved).collect();
        let points: Vec<&Point> = points.iter().collect();
        match Fit::new(self.model, &points, self.size, self.prior) {
            Ok(fit) => fit.deviance(&points, self.prior) + self.numbers.distance(values),
            Err(_) => f64::INFINITY,
        }
    }

    /// Returns the numbers with the least deviance within their ranges.
    pub fn least(&self) -> Least {
        let varies = self.numbers.varies();
        let place = |(vary, value): (&Vary, &f64)| (value - vary.from) / (vary.to - vary.from);
        let value = |(vary, place): (&Vary, &f64)| vary.from + (vary.to - vary.from) * place;
        let of = |places: &[f64]| {
            self.deviance(&varies.iter().zip(places).map(value).collect::<Vec<f64>>())
        };
        let start = varies.iter().zip(&self.values).map(place).collect();
        let (places, errors) = minimum(&of, start);
        let ranges: Vec<f64> = varies.iter().map(|vary| vary.to - vary.from).collect();
        let error = |(error, range): (Option<f64>, &f64)| error.map(|error| error * range);
        Least {
            values: varies.iter().zip(&places).map(value).collect(),
            errors: errors.into_iter().zip(&ranges).map(error).collect(),
            ranges,
        }
    }
}

/// How the light of a run depends on the numbers.
struct Depends<'a> {
    bands: &'a [BandResult],
    faces: HashMap<(&'a str, &'a str), &'a FaceResult>,
    /// The input to which each number belongs.
    inputs: Vec<&'a str>,
    /// By captor, face and input.
    found: HashMap<(&'a str, &'a str, &'a str), &'a SensitivityResult>,
    /// For each number, by how much each band of it changes where it does by one.
    changes: Vec<Vec<f64>>,
}

impl<'a> Depends<'a> {
    fn new(numbers: &'a Numbers, result: &'a RunResult) -> Result<Self> {
        let count = numbers.varies().len();
        let inputs: Vec<&str> = (0..count).map(|number| numbers.input(number).0).collect();
        let entry = |row: &'a SensitivityResult| {
            let input = &row.parameter[..];
            let place = (row.captor.as_deref()?, &*row.face, input);
            inputs.contains(&input).then_some((place, row))
        };
        let found: HashMap<_, _> =
            result.extras.sensitivity.iter().flatten().filter_map(entry).collect();
        if found.is_empty() {
            let problem = "no captor has light that has met any of the materials, or there are too \
                           many captors to tell";
            return Err(Error::input(setting("vary"), problem)
                .remedy("trace more photons, or leave captors out that were not measured"));
        }
        let of_captor = |captor: &'a phylux_results::result::CaptorResult| {
            let id = captor.id.as_str();
            let back = captor.back.iter().map(move |face| ((id, "back"), face));
            std::iter::once(((id, "front"), &captor.front)).chain(back)
        };
        let bands = result.own_bands().len();
        Ok(Self {
            bands: &result.bands,
            faces: result.captors.iter().flat_map(of_captor).collect(),
            inputs,
            found,
            changes: (0..count).map(|number| numbers.changes(number, bands)).collect(),
        })
    }

    /// Returns d ln E / dv of a reading for each number v; 0 where its light has not met the number.
    fn slopes(&self, reading: &Reading) -> Vec<f64> {
        let column = self.bands.iter().position(|band| band.name == reading.band);
        let slope = |number: usize| {
            let column = column?;
            let place = (reading.captor.id.as_str(), reading.face);
            let input = self.inputs[number];
            let derivative = &self.found.get(&(place.0, place.1, input))?.derivative;
            let of_band = |(band, weight): (usize, f64)| {
                Some(weight * derivative[band]? * self.changes[number][band])
            };
            let change: f64 = match self.bands[column].sum_of {
                None => of_band((column, 1.0))?,
                Some(_) => self.bands[column].members(self.bands).filter_map(of_band).sum(),
            };
            let light = self.faces.get(&place)?.irradiance[column];
            (light > 0.0).then(|| change / light)
        };
        (0..self.changes.len()).map(|number| slope(number).unwrap_or(0.0)).collect()
    }
}

/// Minimises a function of places from 0 to 1, and returns where it is least, and for each place the
/// root of twice its inverse curvature; `None` for a place at an end, and where it is flat.
fn minimum(of: &dyn Fn(&[f64]) -> f64, start: Vec<f64>) -> (Vec<f64>, Vec<Option<f64>>) {
    let mut at = start;
    let mut least = of(&at);
    let mut damping = 1e-3;
    for _ in 0..MOST_STEPS {
        let (slope, curvature) = differences(of, &at, least);
        let free = free(&at, &slope);
        let mut moved = None;
        while moved.is_none() && damping < 1e9 {
            let entry = |i: usize, j: usize| match i == j {
                true => curvature[i][i] + damping * curvature[i][i].abs().max(1e-3),
                false => curvature[i][j],
            };
            let among = |&i: &usize| free.iter().map(|&j| entry(i, j)).collect();
            let steps = inverse(&free.iter().map(among).collect());
            let next = steps.map(|inverse| {
                let mut next = at.clone();
                for (row, &i) in inverse.iter().zip(&free) {
                    let step: f64 = row.iter().zip(&free).map(|(h, &j)| h * slope[j]).sum();
                    next[i] = (at[i] - step).clamp(0.0, 1.0);
                }
                next
            });
            moved = next.map(|next| (of(&next), next)).filter(|(found, _)| *found < least);
            damping *= if moved.is_some() { 0.1 } else { 10.0 };
        }
        let Some((found, next)) = moved else { break };
        let far = at.iter().zip(&next).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        (least, at) = (found, next);
        damping = damping.max(1e-6);
        if far < 1e-5 {
            break;
        }
    }
    let (slope, curvature) = differences(of, &at, least);
    let inside: Vec<usize> =
        free(&at, &slope).into_iter().filter(|&i| at[i] > 0.0 && at[i] < 1.0).collect();
    let among = |&i: &usize| inside.iter().map(|&j| curvature[i][j]).collect();
    let mut errors = vec![None; at.len()];
    if let Some(inverse) = inverse(&inside.iter().map(among).collect()) {
        for (k, &i) in inside.iter().enumerate() {
            errors[i] = Some((2.0 * inverse[k][k]).sqrt());
        }
    }
    (at, errors)
}

/// Returns the places that are inside of their ranges, or go there.
fn free(at: &[f64], slope: &[f64]) -> Vec<usize> {
    let held = |i: usize| at[i] <= 0.0 && slope[i] > 0.0 || at[i] >= 1.0 && slope[i] < 0.0;
    (0..at.len()).filter(|&i| !held(i)).collect()
}

/// Returns slopes and curvatures of a function, whose value at `at` is `middle`.
fn differences(of: &dyn Fn(&[f64]) -> f64, at: &[f64], middle: f64) -> (Vec<f64>, Vec<Vec<f64>>) {
    let n = at.len();
    let moved = |steps: &[(usize, f64)]| {
        let mut place = at.to_vec();
        steps.iter().for_each(|&(i, step)| place[i] += step * STEP);
        of(&place)
    };
    let up: Vec<f64> = (0..n).map(|i| moved(&[(i, 1.0)])).collect();
    let down: Vec<f64> = (0..n).map(|i| moved(&[(i, -1.0)])).collect();
    let slope = (0..n).map(|i| (up[i] - down[i]) / (2.0 * STEP)).collect();
    let mut curvature = vec![vec![0.0; n]; n];
    for i in 0..n {
        curvature[i][i] = (up[i] - 2.0 * middle + down[i]) / (STEP * STEP);
        for j in 0..i {
            // on both sides, so that what is cubic cancels
            let both = moved(&[(i, 1.0), (j, 1.0)]) + moved(&[(i, -1.0), (j, -1.0)]);
            let alone = up[i] + down[i] + up[j] + down[j];
            let entry = (both - alone + 2.0 * middle) / (2.0 * STEP * STEP);
            (curvature[i][j], curvature[j][i]) = (entry, entry);
        }
    }
    (slope, curvature)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The minimum of a function that is not quadratic, with one place inside, one at an end and one
    /// on which nothing depends.
    #[test]
    fn the_minimum_is_found() {
        let of = |x: &[f64]| {
            let (u, v) = ((x[0] - 0.4) / 0.05, (x[1] - 0.7) / 0.1);
            u * u + u * v + v * v + (u * u).cosh().ln() * 0.01
        };
        let (at, errors) = minimum(&of, vec![0.9, 0.1]);
        assert!((at[0] - 0.4).abs() < 1e-4 && (at[1] - 0.7).abs() < 1e-4, "{at:?}");
        // the inverse of [[2, 1], [1, 2]] has 2/3 on its diagonal
        for (error, scale) in errors.iter().zip([0.05, 0.1]) {
            assert!((error.unwrap() / (scale * f64::sqrt(4.0 / 3.0)) - 1.0).abs() < 1e-2);
        }
        let at_end = |x: &[f64]| (x[0] + 0.3).powi(2) * 100.0 + (x[1] - 0.5).powi(2) * 100.0;
        let (at, errors) = minimum(&at_end, vec![0.5, 0.5]);
        assert_eq!((at[0], errors[0]), (0.0, None));
        assert!((at[1] - 0.5).abs() < 1e-6 && (errors[1].unwrap() - 0.1).abs() < 1e-3);
        let (at, errors) = minimum(&|_: &[f64]| 1.0, vec![0.5]);
        assert_eq!((at, errors), (vec![0.5], vec![None]));
    }
}
