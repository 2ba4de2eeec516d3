//! Calibration: from measured readings to the powers of lamps. It finds the factors on the powers
//! that bring a simulation nearest to what an instrument read, how uncertain they are, and what
//! they predict elsewhere.
//!
//! Read [`calibrate`] first, then `fit` (one fit), `choose` (which model), `vary` (other numbers of
//! the scene) and `powers` (the calibrated scene). `even` finds powers that light captors evenly;
//! `job` does all of it from a scene.

mod choose;
mod even;
mod fit;
mod grid;
mod hull;
pub mod job;
mod numbers;
mod powers;
mod tangent;
mod vary;

use std::{
    collections::{HashMap, HashSet},
    path::Path,
    slice,
};

use glam::DVec3;

use choose::{blocked, each_block, line, on_lines, relative_rmse, simplest};
pub use even::{EvenPlan, even};
use fit::{Fit, HalfWidths, Point};
use hull::Hull;
pub use numbers::{Numbers, Vary};
pub use powers::calibrated_scene;
pub use vary::{Found, Runs, search};

use phylux_core::{
    error::{Error, Problem, Result, nearest, setting},
    math::pattern,
    scene::world::Scene,
    words,
};
use phylux_files::{
    input::quoted,
    measured_csv::{MeasuredAt, MeasuredRow},
};
use phylux_results::{
    calibration::{Calibration, Model, ReadingResult, SlopeIntercept},
    result::{BandResult, ByLight, CaptorResult, FaceResult, RunResult},
};

/// The largest number of factors that are fitted: normal equations grow with its square.
const MOST_FACTORS: usize = 300;
/// With fewer readings than this for each factor of a lamp there is a warning.
const FEW_POINTS: usize = 3;
/// Relative standard error of a factor above which there is a warning.
const UNSURE: f64 = 0.2;
/// The largest number of names that a warning lists.
const LISTED: usize = 5;

/// The options of a calibration.
#[derive(Clone, Debug)]
pub struct CalibrationPlan {
    /// The model; `None` to choose it by leaving out blocks of readings.
    pub model: Option<Model>,
    /// Relative standard deviation of the factors of lamps about the common factor; `None` for no
    /// prior.
    pub prior: Option<f64>,
    /// Patterns of names of lights. The lights that fit one pattern share their factors.
    pub groups: Vec<String>,
    /// The scene's unit of length, m, for readings that are located by a point.
    pub metres: f64,
}

/// Fits the powers of the lamps to readings. `result` is a run that is split by light, and `rows`
/// are the readings of the file at `path`. Errors: results that are not split, a reading at no
/// captor or in no band, too few readings.
pub fn calibrate(
    result: &RunResult,
    rows: &[MeasuredRow],
    path: &Path,
    plan: &CalibrationPlan,
) -> Result<Calibration> {
    let names: Vec<&str> = result.energy_by_light()?.keys().map(String::as_str).collect();
    let lamps = Lamps::new(&names, &plan.groups)?;
    let bands = MeasuredBands::new(result, rows, path)?;
    let size = [lamps.names.len(), bands.measured.len()];
    let readings = Readings::new(result, rows, path, plan, &lamps, &bands)?;
    let (fitted, tests) = (readings.of(Purpose::Fit), readings.of(Purpose::Test));
    let models = match plan.model {
        Some(model) => vec![model],
        None => Model::ALL.to_vec(),
    };
    let wrong = |problem: Problem| problem.at(path.display());
    check(&models, &fitted, &bands, size).map_err(wrong)?;
    let prior = plan.prior;
    let blocks = readings.blocks;
    let compared: Vec<_> =
        models.iter().map(|model| blocked(*model, &fitted, blocks, size, prior)).collect();
    // with too few blocks none can be left out
    let model = plan.model.or_else(|| simplest(&compared)).unwrap_or(Model::Bands);
    let fit = Fit::new(model, &fitted, size, prior).map_err(wrong)?;
    if prior.is_none() && fit.numbers() >= fitted.len() {
        let problem = format!("{} factors from {} readings", fit.numbers(), fitted.len());
        return Err(wrong(Problem::new(
            problem,
            words!["measure more, keep the prior, or take a simpler ", setting("model")],
        )));
    }
    let common = Fit::new(Model::Common, &fitted, size, prior).map_err(wrong)?.factor(0, 0);

    let predicted = |points: &[&Point]| {
        points.iter().map(|point| fit.predict(slice::from_ref(point)).value).collect::<Vec<_>>()
    };
    let of_band = |band: &Option<usize>, lamp| band.map_or(common, |b| fit.factor(lamp, b));
    let error_of_band = |band: &Option<usize>, lamp| band.and_then(|b| fit.factor_error(lamp, b));
    let factors = names.iter().zip(&lamps.of_light).map(|(name, &lamp)| {
        (name.to_string(), bands.of_band.iter().map(|b| of_band(b, lamp)).collect())
    });
    let errors = names.iter().zip(&lamps.of_light).map(|(name, &lamp)| {
        (name.to_string(), bands.of_band.iter().map(|b| error_of_band(b, lamp)).collect())
    });
    let mut widths = HalfWidths::default();
    let results: Vec<ReadingResult> =
        readings.all.iter().map(|reading| reading.result(&fit, &mut widths)).collect();
    Ok(Calibration {
        phylux: env!("CARGO_PKG_VERSION").into(),
        scene: result.scene.clone(),
        model,
        prior,
        varied: Vec::new(),
        runs: None,
        deviance: fit.deviance(&fitted, prior),
        bands: result.own_bands().iter().map(|band| band.name.clone()).collect(),
        factors: factors.collect::<ByLight<_>>(),
        factors_se: errors.collect::<ByLight<_>>(),
        measured_bands: bands.names.clone(),
        lamps: lamps.names.clone(),
        covariance: fit.covariance(size[1]),
        residual: (0..size[1]).map(|band| fit.spread(band)).collect(),
        models: compared,
        slope_intercept: slope_intercept(&fitted, &tests, blocks, size[1]),
        fit_rmse: rmse(&fitted, Some(predicted(&fitted)), size[1]),
        test_rmse: rmse(&tests, Some(predicted(&tests)), size[1]),
        test_inside: inside(&results),
        warnings: warnings(result, &readings, &fit, &lamps, &bands),
        readings: results,
    })
}

/// Checks that the models can be fitted: they have not too many factors, and each band has readings.
fn check(
    models: &[Model],
    fitted: &[&Point],
    bands: &MeasuredBands,
    [lamps, count]: [usize; 2],
) -> std::result::Result<(), Problem> {
    if models != [Model::Common] && models != [Model::Bands] && lamps * count > MOST_FACTORS {
        let problem =
            format!("{lamps} lamps in {count} bands are more than {MOST_FACTORS} factors");
        let model = setting("model").is("bands");
        let remedy = words!["join lamps by ", setting("group"), ", or take ", model];
        return Err(Problem::new(problem, remedy));
    }
    for (band, name) in bands.names.iter().enumerate() {
        if !fitted.iter().any(|point| point.band == band) {
            let problem = format!("no reading in band {} is to be fitted", quoted(name));
            return Err(Problem::new(problem, "`use` of some of its rows must be `fit`"));
        }
    }
    Ok(())
}

/// Returns the root mean square of relative errors in each band, if there are values.
fn rmse(points: &[&Point], values: Option<Vec<f64>>, bands: usize) -> Vec<Option<f64>> {
    match values {
        Some(values) => relative_rmse(points, &values, bands),
        None => vec![None; bands],
    }
}

/// Fits a line to each band, and finds how well lines predict what they were not fitted to.
fn slope_intercept(
    fitted: &[&Point],
    tests: &[&Point],
    blocks: usize,
    bands: usize,
) -> SlopeIntercept {
    let lines_of =
        |points: &[&Point]| (0..bands).map(|band| line(points, band)).collect::<Vec<_>>();
    let by_lines = |others: &[&Point], left_out: &[&Point]| on_lines(&lines_of(others), left_out);
    let lines = lines_of(fitted);
    SlopeIntercept {
        slope: lines.iter().map(|line| line.map(|[slope, _]| slope)).collect(),
        intercept: lines.iter().map(|line| line.map(|[_, intercept]| intercept)).collect(),
        blocked_rmse: rmse(fitted, each_block(fitted, blocks, by_lines), bands),
        test_rmse: rmse(tests, on_lines(&lines, tests), bands),
    }
}

/// Returns the share of the readings for tests that lie within their intervals; `None` if there are none.
fn inside(results: &[ReadingResult]) -> Option<f64> {
    let tested = results.iter().filter(|reading| reading.purpose == "test");
    let held = tested.clone().filter(|reading| {
        let [low, high] = reading.interval;
        reading.measured.is_some_and(|value| (low..=high).contains(&value))
    });
    let count = tested.clone().count();
    (count > 0).then(|| held.count() as f64 / count as f64)
}

/// The lamps of a calibration: lights that have factors of their own, and groups of lights that
/// share factors.
struct Lamps {
    names: Vec<String>,
    of_light: Vec<usize>,
}

impl Lamps {
    fn new(lights: &[&str], groups: &[String]) -> Result<Self> {
        let mut names: Vec<String> = groups.to_vec();
        let mut found = vec![false; groups.len()];
        let mut of_light = Vec::new();
        for light in lights {
            let mut fitting = (0..groups.len()).filter(|&g| pattern::fits(&groups[g], light));
            let group = fitting.next();
            if let (Some(first), Some(second)) = (group, fitting.next()) {
                let (first, second) = (quoted(&groups[first]), quoted(&groups[second]));
                let problem = format!("light {} fits {first} and {second}", quoted(light));
                return Err(
                    Error::input(setting("group"), problem).remedy("a light has one factor")
                );
            }
            group.iter().for_each(|&g| found[g] = true);
            of_light.push(group.unwrap_or_else(|| {
                names.push(light.to_string());
                names.len() - 1
            }));
        }
        if let Some(group) = found.iter().position(|found| !found) {
            let problem = format!("no light fits {}", quoted(&groups[group]));
            let some: Vec<&str> = lights.iter().take(20).copied().collect();
            return Err(Error::input(setting("group"), problem)
                .remedy(format!("there are {}", some.join(", "))));
        }
        Ok(Self { names, of_light })
    }
}

/// The bands, or sums of bands, in which there are readings.
struct MeasuredBands {
    names: Vec<String>,
    /// Indices among the bands and sums of the results.
    measured: Vec<usize>,
    /// For each band of the scene, the index of the measured band whose factor it takes.
    of_band: Vec<Option<usize>>,
}

impl MeasuredBands {
    fn new(result: &RunResult, rows: &[MeasuredRow], path: &Path) -> Result<Self> {
        let mut measured: Vec<usize> = Vec::new();
        for row in rows.iter().filter(|row| row.value.is_some()) {
            let column = column_of(result, row, path)?;
            if !measured.contains(&column) {
                measured.push(column);
            }
        }
        if measured.is_empty() {
            return Err(Error::input(path.display(), "nothing was measured: no row has a `value`")
                .remedy("give some readings"));
        }
        measured.sort_unstable();
        let mut of_band = Vec::new();
        for (b, band) in result.own_bands().iter().enumerate() {
            let holds = |m: &usize| {
                *m == b || members(&result.bands[*m]).any(|(name, _)| *name == band.name)
            };
            let mut holding = (0..measured.len()).filter(|&i| holds(&measured[i]));
            let first = holding.next();
            if first.is_some() && holding.next().is_some() {
                let problem =
                    format!("band {} was measured alone and in a sum", quoted(&band.name));
                return Err(Error::input(path.display(), problem)
                    .remedy("keep the readings of the one or of the other"));
            }
            of_band.push(first);
        }
        let names = measured.iter().map(|&m| result.bands[m].name.clone()).collect();
        Ok(Self { names, measured, of_band })
    }

    /// Returns what adds up to a band or sum of the results: for each measured band, the columns
    /// that take its factors, with their weights. Error, at `place`: a band that has no factors.
    fn parts(&self, result: &RunResult, column: usize, place: &str) -> Result<Vec<Part>> {
        let whole = |measured| Part { measured, columns: vec![(column, 1.0)] };
        if let Some(measured) = self.measured.iter().position(|&m| m == column) {
            return Ok(vec![whole(measured)]);
        }
        let band = &result.bands[column];
        let own = band.sum_of.is_none().then_some((&band.name, 1.0));
        let mut parts: Vec<Part> = Vec::new();
        for (name, weight) in members(band).chain(own) {
            let member = result.bands.iter().position(|band| band.name == *name);
            let known = member.and_then(|b| Some((b, *self.of_band.get(b)?.as_ref()?)));
            let Some((member, measured)) = known else {
                let problem = format!(
                    "nothing was measured in band {}, alone or in a sum, so that it cannot be predicted",
                    quoted(name)
                );
                return Err(
                    Error::input(place, problem).remedy("measure it, or leave this row out")
                );
            };
            match parts.iter_mut().find(|part| part.measured == measured) {
                Some(part) => part.columns.push((member, weight)),
                None => parts.push(Part { measured, columns: vec![(member, weight)] }),
            }
        }
        match &parts[..] {
            // the results know the error of the whole
            [only] => Ok(vec![whole(only.measured)]),
            _ => Ok(parts),
        }
    }
}

/// Returns the bands that count in a sum, with their weights; none of a band.
fn members(sum: &BandResult) -> impl Iterator<Item = (&String, f64)> {
    let weight = |i: usize| sum.weights.as_ref().map_or(1.0, |weights| weights[i]);
    let all = sum.sum_of.iter().flatten().enumerate();
    all.map(move |(i, name)| (name, weight(i))).filter(|(_, weight)| *weight > 0.0)
}

/// What a band or sum has of the light whose factors are those of one measured band.
struct Part {
    /// Index among the measured bands.
    measured: usize,
    /// Indices among the bands and sums of the results, with their weights.
    columns: Vec<(usize, f64)>,
}

/// Returns the index of the band or sum of a row, among those of the results.
fn column_of(result: &RunResult, row: &MeasuredRow, path: &Path) -> Result<usize> {
    let place = format!("{}:{}", path.display(), row.line);
    let known = || result.bands.iter().map(|band| band.name.as_str());
    match &row.band {
        None if result.bands.len() == 1 => Ok(0),
        None => Err(Error::input(place, "no column says in which band was measured")
            .remedy("add a column `band`")),
        Some(name) => known().position(|band| band == name).ok_or_else(|| {
            let error = Error::input(&place, format!("no band {}", quoted(name)));
            let all: Vec<&str> = known().take(20).collect();
            error.did_you_mean(nearest(name, known()), format!("there are {}", all.join(", ")))
        }),
    }
}

/// A reading, or what is to be predicted.
struct Reading<'a> {
    captor: &'a CaptorResult,
    face: &'static str,
    band: String,
    purpose: Purpose,
    /// Standard deviation of the reading, in its unit.
    sd: Option<f64>,
    /// The point that is fitted; of a band or sum that is only predicted, one for each measured band
    /// whose factors it takes.
    points: Vec<Point>,
}

/// What a row of the readings is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Purpose {
    Fit,
    Test,
    /// Nothing was read there; the value of the point does not matter.
    Predict,
}

impl Reading<'_> {
    /// Returns the point of a reading that was measured.
    fn point(&self) -> &Point {
        &self.points[0]
    }

    fn result(&self, fit: &Fit, widths: &mut HalfWidths) -> ReadingResult {
        let mut predicted = fit.predict(&self.points);
        if let (Purpose::Predict, Some(sd)) = (self.purpose, self.sd)
            && predicted.value > 0.0
        {
            let sensor = sd / predicted.value;
            let points = self.points.iter().map(|point| Point { sensor, ..point.clone() });
            predicted = fit.predict(&points.collect::<Vec<_>>());
        }
        let (value, half) = (predicted.value, widths.of(&predicted));
        ReadingResult {
            captor: self.captor.id.clone(),
            face: self.face.into(),
            band: self.band.clone(),
            purpose: match self.purpose {
                Purpose::Fit => "fit",
                Purpose::Test => "test",
                Purpose::Predict => "predict",
            }
            .into(),
            measured: (self.purpose != Purpose::Predict).then_some(self.point().value),
            simulated: self.points.iter().flat_map(|point| &point.of_lamps).sum(),
            calibrated: value,
            interval: [(value - half).max(0.0), value + half],
            leverage: (self.purpose == Purpose::Fit).then_some(predicted.leverage),
        }
    }
}

/// All readings. Those that are fitted are in blocks, each of which is left out as a whole.
struct Readings<'a> {
    all: Vec<Reading<'a>>,
    /// Number of blocks of the readings that are fitted; they are counted from 0.
    blocks: usize,
}

impl<'a> Readings<'a> {
    fn new(
        result: &'a RunResult,
        rows: &[MeasuredRow],
        path: &Path,
        plan: &CalibrationPlan,
        lamps: &Lamps,
        bands: &MeasuredBands,
    ) -> Result<Self> {
        let mut of_id: HashMap<&str, &CaptorResult> = HashMap::new();
        of_id.extend(result.captors.iter().map(|captor| (captor.id.as_str(), captor)));
        let mut blocks: HashMap<String, usize> = HashMap::new();
        let mut places: HashMap<(&str, bool), usize> = HashMap::new();
        let mut all = Vec::new();
        for row in rows {
            let place = format!("{}:{}", path.display(), row.line);
            let captor = match &row.at {
                MeasuredAt::Captor(id) => of_id
                    .get(id.as_str())
                    .copied()
                    .ok_or_else(|| no_captor(place.clone(), id, of_id.keys().copied()))?,
                MeasuredAt::Point(point) => {
                    captor_at(result, *point * plan.metres).ok_or_else(|| {
                        Error::input(
                            &place,
                            "there is no captor, or more than one has its middle there",
                        )
                        .remedy("give the captor's id, or add a captor to the scene")
                    })?
                }
            };
            let face = match (row.back, &captor.back) {
                (false, _) => &captor.front,
                (true, Some(back)) => back,
                (true, None) => {
                    let problem = format!("captor {} has no back that counts", quoted(&captor.id));
                    return Err(
                        Error::input(place, problem).remedy("set `sides` to both in the scene")
                    );
                }
            };
            let column = column_of(result, row, path)?;
            let parts = bands.parts(result, column, &place)?;
            let purpose = match (row.value, row.test) {
                (None, _) => Purpose::Predict,
                (_, true) => Purpose::Test,
                (_, false) => Purpose::Fit,
            };
            let block = match (purpose, &row.block) {
                (Purpose::Test | Purpose::Predict, _) => 0,
                (Purpose::Fit, name) => {
                    let key = name
                        .as_ref()
                        .map_or(format!("captor {}", captor.id), |n| format!("block {n}"));
                    let next = blocks.len();
                    *blocks.entry(key).or_insert(next)
                }
            };
            let value = row.value.unwrap_or(1.0);
            let sensor = row.value.map_or(0.0, |value| row.sd.unwrap_or(0.0) / value);
            let next = places.len();
            let place = *places.entry((captor.id.as_str(), row.back)).or_insert(next);
            let point = |Part { measured: band, columns }: Part| {
                let [of_lamps, errors] = by_lamp(face, lamps, &columns);
                Point { of_lamps, errors, value, sensor, band, place, block }
            };
            let points = parts.into_iter().map(point).collect();
            let band = result.bands[column].name.clone();
            let face = if row.back { "back" } else { "front" };
            all.push(Reading { captor, face, band, purpose, sd: row.sd, points });
        }
        Ok(Self { all, blocks: blocks.len() })
    }

    fn of(&self, purpose: Purpose) -> Vec<&Point> {
        self.all.iter().filter(|r| r.purpose == purpose).map(Reading::point).collect()
    }
}

/// Makes the error that there is no captor of this id at a place, among those of these ids.
fn no_captor<'a>(place: String, id: &str, ids: impl Iterator<Item = &'a str>) -> Error {
    let error = Error::input(place, format!("no captor {}", quoted(id)));
    let otherwise = "give ids as in the results, with the name of their entry";
    error.did_you_mean(nearest(id, ids.take(10_000)), otherwise)
}

/// Checks, before anything is traced, that a scene has the captors of the readings in the file at `path`.
/// Error: it has not.
pub fn check_captors(scene: &Scene, rows: &[MeasuredRow], path: &Path) -> Result<()> {
    let ids: HashSet<&str> = scene.captors().iter().map(|captor| captor.id.as_str()).collect();
    let missing = rows.iter().find_map(|row| match &row.at {
        MeasuredAt::Captor(id) if !ids.contains(id.as_str()) => Some((row.line, id)),
        _ => None,
    });
    match missing {
        None => Ok(()),
        Some((line, id)) => {
            let all = scene.captors().iter().map(|captor| captor.id.as_str());
            Err(no_captor(format!("{}:{line}", path.display()), id, all))
        }
    }
}

/// Returns the captor whose middle is nearest to a point, m. `None` if the point is farther away
/// than the radius of a disc of the captor's area, or if another captor is as near.
fn captor_at(result: &RunResult, point: DVec3) -> Option<&CaptorResult> {
    let far = |captor: &CaptorResult| DVec3::from(captor.center).distance(point);
    let nearest = result.captors.iter().min_by(|a, b| far(a).total_cmp(&far(b)))?;
    let as_near = result.captors.iter().filter(|captor| far(captor) <= far(nearest)).count();
    let radius = (nearest.area / std::f64::consts::PI).sqrt();
    (far(nearest) <= radius && as_near == 1).then_some(nearest)
}

/// Returns the irradiance of a face by lamp, and its standard errors: the sum over some bands, with
/// their weights. Errors of bands add up, as at most they do.
fn by_lamp(face: &FaceResult, lamps: &Lamps, columns: &[(usize, f64)]) -> [Vec<f64>; 2] {
    let mut values = vec![0.0; lamps.names.len()];
    let mut variances = values.clone();
    let parts = face.by_light.iter().flat_map(|lights| lights.values());
    for (part, &lamp) in parts.zip(&lamps.of_light) {
        let error = |band: usize| part.irradiance_se[band].unwrap_or(0.0);
        values[lamp] += columns.iter().map(|&(b, weight)| weight * part.irradiance[b]).sum::<f64>();
        let error: f64 = columns.iter().map(|&(b, weight)| weight * error(b)).sum();
        variances[lamp] += error.powi(2);
    }
    [values, variances.into_iter().map(f64::sqrt).collect()]
}

/// Returns what a user should know before trusting the factors.
fn warnings(
    result: &RunResult,
    readings: &Readings,
    fit: &Fit,
    lamps: &Lamps,
    bands: &MeasuredBands,
) -> Vec<String> {
    let mut warnings = Vec::new();
    let fitted: Vec<&Reading> = readings.all.iter().filter(|r| r.purpose == Purpose::Fit).collect();
    let count = |band: usize| fitted.iter().filter(|r| r.point().band == band).count();
    let each = fit.numbers() / bands.names.len().max(1);
    let fewest = (0..bands.names.len()).map(count).min().unwrap_or(0);
    if each > 1 && fewest < FEW_POINTS * each {
        warnings.push(format!(
            "{fewest} readings in a band for {each} lamps, fewer than {FEW_POINTS} for each: their factors rest on \
            little; measure at more places, or join lamps in groups"
        ));
    }
    let mut unsure = Vec::new();
    for (l, lamp) in lamps.names.iter().enumerate() {
        for (b, band) in bands.names.iter().enumerate() {
            let factor = fit.factor(l, b);
            match fit.factor_error(l, b) {
                Some(error) if error <= UNSURE * factor => {}
                Some(error) => {
                    unsure.push(format!("{lamp} in {band} ({:.0} %)", 100.0 * error / factor))
                }
                None => unsure.push(format!("{lamp} in {band} (held at {factor:.3})")),
            }
        }
    }
    if !unsure.is_empty() {
        warnings.push(format!(
            "factors with a standard error above {:.0} %: {}; they are effective powers, not those of the lamps",
            100.0 * UNSURE,
            some(&unsure)
        ));
    }
    let loud = (0..bands.names.len()).filter(|&band| {
        let mut of_band = fitted.iter().filter(|r| r.point().band == band);
        // of what is left, the reading's own error explains a part, and the model the rest
        let left = |r: &Reading| fit.spread(band).hypot(r.point().sensor);
        of_band.any(|r| 3.0 * fit.simulation_error(r.point()) / r.point().value > left(r))
    });
    let loud: Vec<String> = loud.map(|band| bands.names[band].clone()).collect();
    if !loud.is_empty() {
        warnings.push(format!(
            "the simulation's own error is more than a third of that of the readings and the model, in {}: trace more \
            photons",
            some(&loud)
        ));
    }
    let unmeasured = bands.of_band.iter().zip(&result.bands).filter(|(of, _)| of.is_none());
    let unmeasured: Vec<String> = unmeasured.map(|(_, band)| band.name.clone()).collect();
    if !unmeasured.is_empty() {
        warnings.push(format!(
            "bands in which nothing was measured have the common factor: {}",
            some(&unmeasured)
        ));
    }
    let hull = Hull::new(fitted.iter().map(|r| DVec3::from(r.captor.center)));
    let outside = result.captors.iter().filter(|c| !hull.holds(c.center.into()));
    let outside: Vec<String> = outside.map(|captor| format!("`{}`", captor.id)).collect();
    if !outside.is_empty() {
        warnings.push(format!(
            "captors outside the hull of the measured points, for which the factors are extrapolated: {}",
            some(&outside)
        ));
    }
    warnings
}

/// Lists the first few things, and says how many more there are.
fn some(things: &[String]) -> String {
    let shown = things[..things.len().min(LISTED)].join(", ");
    match things.len().saturating_sub(LISTED) {
        0 => shown,
        more => format!("{shown} and {more} more"),
    }
}
