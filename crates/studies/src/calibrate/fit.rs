//! A fit: the factors that bring simulated readings nearest to measured ones.
//!
//! A reading y_i is a sum over lamps. Each term is what the simulation found of a lamp, x_il, times
//! a factor of that lamp and band. The factors minimise
//!
//! Σ_i (1 - Σ_l f_l x_il / y_i)² / σ_i² + Σ_l (f_l / f0 - 1)² / p²,   f_l >= 0,
//!
//! in which σ_i² is the sum of the relative variances of the sensor, of the simulation and of the
//! model. The variance of the model is found from the residuals, so the fit is repeated until it no
//! longer changes. f0 is the best common factor, and p is the prior's relative standard deviation
//! about it. The prior only matters for models with factors of lamps.
//!
//! The error of a model at a captor is much the same in all bands there. Where bands are fitted
//! together, the readings of one captor therefore count as one reading: each has its share of the
//! weight.

use std::{borrow::Borrow, collections::HashMap};

use phylux_core::{
    error::{Problem, setting},
    math::{
        least_squares::{Matrix, inverse, nonnegative},
        stats::student_half_width,
    },
    words,
};
use phylux_results::calibration::Model;

/// Least relative standard error of a reading: σ² must not vanish where everything fits exactly.
const LEAST_ERROR: f64 = 1e-6;
/// The largest number of repetitions to find the variance of the model.
const REPETITIONS: usize = 200;

/// A reading, with what the simulation finds there.
#[derive(Clone, Debug)]
pub struct Point {
    /// Simulated reading of each lamp at its present power.
    pub of_lamps: Vec<f64>,
    /// Standard errors of the simulated readings.
    pub errors: Vec<f64>,
    /// The measured value, above 0.
    pub value: f64,
    /// Standard deviation of the sensor relative to the measured value.
    pub sensor: f64,
    /// Index of the band.
    pub band: usize,
    /// Index of the captor and face of the reading.
    pub place: usize,
    /// Index of the block with which the point is left out.
    pub block: usize,
}

/// The form of the factors in one system of equations.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Form {
    /// One factor for everything.
    One,
    /// One factor for each lamp.
    Lamps,
    /// One factor for each lamp times one for each band.
    Product,
}

/// The solution of one system of equations, with its uncertainty.
#[derive(Clone, Debug)]
struct Solution {
    form: Form,
    lamps: usize,
    theta: Vec<f64>,
    /// The value about which the prior holds the factors of lamps.
    middle: f64,
    /// Covariances of the parameters; zero for a parameter that is held at 0 or unknown.
    covariance: Matrix,
    /// For each parameter, whether the points depend on it and it is not held at 0.
    free: Vec<bool>,
    /// Per band: relative variance of the model, and the degrees of freedom with which it was
    /// found.
    spread: Vec<[f64; 2]>,
}

/// Factors by lamp and band, fitted to points.
#[derive(Clone, Debug)]
pub struct Fit {
    model: Model,
    lamps: usize,
    /// One system of equations for all bands, or one for each band.
    parts: Vec<Solution>,
}

/// The prediction of a fit at a point.
#[derive(Clone, Copy, Debug)]
pub struct Predicted {
    /// The calibrated reading.
    pub value: f64,
    /// Standard deviation, from the errors of factors, model, simulation and sensor.
    pub deviation: f64,
    /// Degrees of freedom that are left in its band.
    pub freedom: f64,
    /// Weight that the reading has, or would have, in its own prediction, in [0, 1].
    pub leverage: f64,
}

/// Half widths of 95 % intervals, in standard deviations, by degrees of freedom: the readings of a band
/// share theirs, which takes milliseconds to find.
#[derive(Debug, Default)]
pub struct HalfWidths(HashMap<u64, f64>);

impl HalfWidths {
    /// Returns the half width of the interval of a prediction.
    pub fn of(&mut self, predicted: &Predicted) -> f64 {
        let of_student = || student_half_width(predicted.freedom, 0.95);
        let width = self.0.entry(predicted.freedom.to_bits()).or_insert_with(of_student);
        *width * predicted.deviation
    }
}

impl Fit {
    /// Fits `model` to `points`, for this number of lamps and bands, with the prior's relative
    /// standard deviation. Errors: a band without points, points that cannot tell the lamps apart,
    /// or points that no light reaches.
    pub fn new(
        model: Model,
        points: &[&Point],
        [lamps, bands]: [usize; 2],
        prior: Option<f64>,
    ) -> Result<Self, Problem> {
        let in_bands = || {
            let of = |band| points.iter().copied().filter(move |p| p.band == band).collect();
            (0..bands).map(of).collect::<Vec<Vec<&Point>>>()
        };
        let solve = |form, points: &[&Point]| Solution::new(form, points, [lamps, bands], prior);
        let parts = match model {
            Model::Common => vec![solve(Form::One, points)?],
            Model::Product => vec![solve(Form::Product, points)?],
            Model::Bands => {
                in_bands().iter().map(|p| solve(Form::One, p)).collect::<Result<_, _>>()?
            }
            Model::Lamps => {
                in_bands().iter().map(|p| solve(Form::Lamps, p)).collect::<Result<_, _>>()?
            }
        };
        Ok(Self { model, lamps, parts })
    }

    fn part(&self, band: usize) -> usize {
        if self.parts.len() == 1 { 0 } else { band }
    }

    /// Returns the factor of a lamp in a band.
    pub fn factor(&self, lamp: usize, band: usize) -> f64 {
        self.parts[self.part(band)].factor(lamp, band)
    }

    /// Returns the standard error of a factor; `None` if the factor is held at 0 or the points do
    /// not depend on it.
    pub fn factor_error(&self, lamp: usize, band: usize) -> Option<f64> {
        let part = &self.parts[self.part(band)];
        let mut alone = vec![0.0; self.lamps];
        alone[lamp] = 1.0;
        let gradient = part.gradient(&alone, band);
        let known = gradient.iter().zip(&part.free).all(|(g, free)| *g == 0.0 || *free);
        known.then(|| quadratic(&part.covariance, &gradient).sqrt())
    }

    /// Returns the covariances of the factors of all lamps in all bands. Rows and columns go lamp
    /// by lamp, and for each lamp band by band.
    pub fn covariance(&self, bands: usize) -> Matrix {
        let entries: Vec<(usize, Vec<f64>)> = (0..self.lamps * bands)
            .map(|i| {
                let mut alone = vec![0.0; self.lamps];
                alone[i / bands] = 1.0;
                let part = self.part(i % bands);
                (part, self.parts[part].gradient(&alone, i % bands))
            })
            .collect();
        let of = |(part, a): &(usize, Vec<f64>), (other, b): &(usize, Vec<f64>)| match part == other
        {
            true => bilinear(&self.parts[*part].covariance, a, b),
            false => 0.0,
        };
        entries.iter().map(|a| entries.iter().map(|b| of(a, b)).collect()).collect()
    }

    /// Predicts the reading that these points of a captor add up to, whether or not they were
    /// fitted. What the model does not explain at a captor is much the same in all bands there, and so
    /// is what it makes of the factors, and chance's deviations in the simulation of a lamp: the
    /// errors of points add up, as at most they do.
    pub fn predict<P: Borrow<Point>>(&self, points: &[P]) -> Predicted {
        let mut gradients = vec![Vec::new(); self.parts.len()];
        let (mut value, mut of_model, mut of_simulation) = (0.0, 0.0, 0.0);
        let (mut of_sensor, mut freedom) = (0.0f64, f64::INFINITY);
        for point in points {
            let point = point.borrow();
            let index = self.part(point.band);
            let (part, known) = (&self.parts[index], &mut gradients[index]);
            let gradient = part.gradient(&point.of_lamps, point.band);
            known.resize(gradient.len(), 0.0);
            known.iter_mut().zip(gradient).for_each(|(sum, more)| *sum += more);
            let own = part.value(point);
            let [model, own_freedom] = part.spread[point.band];
            value += own;
            of_model += own * model.sqrt();
            of_simulation += part.simulation(point).sqrt();
            of_sensor += own * point.sensor;
            freedom = freedom.min(own_freedom);
        }
        let parts = self.parts.iter().zip(&gradients).filter(|(_, known)| !known.is_empty());
        let of_factors: f64 = parts.map(|(part, g)| quadratic(&part.covariance, g).sqrt()).sum();
        let of_factors = of_factors * of_factors;
        let others = [of_model, of_sensor, of_simulation].map(|error| error * error);
        let weighed: f64 = others.iter().sum();
        Predicted {
            value,
            deviation: (of_factors + weighed).sqrt(),
            freedom,
            leverage: if weighed > 0.0 { (of_factors / weighed).min(1.0) } else { 0.0 },
        }
    }

    /// Returns the relative standard deviation of what the model does not explain in a band.
    pub fn spread(&self, band: usize) -> f64 {
        self.parts[self.part(band)].spread[band][0].sqrt()
    }

    /// Returns the standard error of the simulated part of the calibrated reading at a point, in
    /// the unit of the reading.
    pub fn simulation_error(&self, point: &Point) -> f64 {
        self.parts[self.part(point.band)].simulation(point).sqrt()
    }

    /// Returns -2 times the logarithm of the likelihood of the points that were fitted, plus what
    /// the prior adds, up to a constant.
    pub fn deviance(&self, points: &[&Point], prior: Option<f64>) -> f64 {
        let of = |(p, part): (usize, &Solution)| {
            let mine = points.iter().copied().filter(|point| self.part(point.band) == p);
            part.deviance(&mine.collect::<Vec<_>>(), prior)
        };
        self.parts.iter().enumerate().map(of).sum()
    }

    /// Returns how many numbers were fitted.
    pub fn numbers(&self) -> usize {
        let all: usize = self.parts.iter().map(|part| part.theta.len()).sum();
        // of lamps times bands, a common scale does not matter
        all - usize::from(self.model == Model::Product)
    }
}

impl Solution {
    fn new(
        form: Form,
        points: &[&Point],
        [lamps, bands]: [usize; 2],
        prior: Option<f64>,
    ) -> Result<Self, Problem> {
        let mut start = Self {
            form,
            lamps,
            theta: Vec::new(),
            middle: 1.0,
            covariance: Vec::new(),
            free: Vec::new(),
            spread: vec![[0.0, f64::INFINITY]; bands],
        };
        let common =
            |points: &[&Point]| Ok(Self::new(Form::One, points, [lamps, bands], prior)?.theta[0]);
        start.theta = match form {
            Form::One => vec![1.0],
            Form::Lamps => {
                start.middle = common(points)?;
                vec![start.middle; lamps]
            }
            Form::Product => {
                let of_band = |band| {
                    let points: Vec<_> =
                        points.iter().copied().filter(|p| p.band == band).collect();
                    common(&points)
                };
                let of_bands = (0..bands).map(of_band).collect::<Result<Vec<_>, _>>()?;
                [vec![1.0; lamps], of_bands].concat()
            }
        };
        if points.iter().all(|point| point.of_lamps.iter().all(|x| *x == 0.0)) {
            return Err(Problem::new(
                "the simulation finds no light at the measured captors",
                "check where they are and which way they face, and trace more photons",
            ));
        }
        start.repeat(points, prior)
    }

    /// Solves with the variances that the last solution implies, until they no longer change.
    fn repeat(mut self, points: &[&Point], prior: Option<f64>) -> Result<Self, Problem> {
        let shares = shares(points);
        for _ in 0..REPETITIONS {
            let before = (self.theta.clone(), self.spread.clone());
            let weights: Vec<f64> = points
                .iter()
                .zip(&shares)
                .map(|(point, share)| share / self.variance(point))
                .collect();
            self.solve(points, &weights, prior)?;
            self.find_spread(points);
            let near = |a: f64, b: f64| (a - b).abs() <= 1e-9 * a.abs().max(b.abs()).max(1e-12);
            let same_theta = self.theta.iter().zip(&before.0).all(|(a, b)| near(*a, *b));
            if same_theta && self.spread.iter().zip(&before.1).all(|(a, b)| near(a[0], b[0])) {
                break;
            }
        }
        Ok(self)
    }

    fn solve(
        &mut self,
        points: &[&Point],
        weights: &[f64],
        prior: Option<f64>,
    ) -> Result<(), Problem> {
        let n = self.theta.len();
        let mut normal = vec![vec![0.0; n]; n];
        let mut target = vec![0.0; n];
        for (point, weight) in points.iter().zip(weights) {
            let mut row = self.gradient(&point.of_lamps, point.band);
            row.iter_mut().for_each(|r| *r /= point.value);
            // Gauss-Newton step; for a linear form the aim is 1
            let reached: f64 = row.iter().zip(&self.theta).map(|(r, t)| r * t).sum();
            let aim = 1.0 - self.value(point) / point.value + reached;
            add(&mut normal, &mut target, &row, aim, *weight);
        }
        let informed: Vec<bool> = (0..n).map(|j| normal[j][j] > 0.0).collect();
        match (self.form, prior) {
            (Form::One, _) | (Form::Lamps, None) => {}
            (_, Some(prior)) => (0..self.lamps).for_each(|lamp| {
                let mut row = vec![0.0; n];
                row[lamp] = 1.0 / self.middle;
                add(&mut normal, &mut target, &row, 1.0, 1.0 / (prior * prior));
            }),
            // only the products matter, so the mean over the lamps is set to 1
            (Form::Product, None) => {
                let largest = (0..n).map(|j| normal[j][j]).fold(0.0, f64::max);
                let share = 1.0 / self.lamps as f64;
                let row: Vec<f64> =
                    (0..n).map(|j| if j < self.lamps { share } else { 0.0 }).collect();
                add(&mut normal, &mut target, &row, 1.0, largest);
            }
        }
        nonnegative(&normal, &target, &mut self.theta);
        self.free = (0..n).map(|j| informed[j] && self.theta[j] > 0.0).collect();
        let free: Vec<usize> = (0..n).filter(|&j| self.free[j]).collect();
        let among = free.iter().map(|&i| free.iter().map(|&j| normal[i][j]).collect()).collect();
        let Some(found) = inverse(&among) else {
            return Err(Problem::new(
                "the measured points cannot tell the lamps apart",
                words![
                    "join lamps by ",
                    setting("group"),
                    ", keep the prior, or measure at more places"
                ],
            ));
        };
        self.covariance = vec![vec![0.0; n]; n];
        for (a, &i) in free.iter().enumerate() {
            free.iter().enumerate().for_each(|(b, &j)| self.covariance[i][j] = found[a][b]);
        }
        Ok(())
    }

    /// Finds the variance of the model in each band: the variance of the residuals beyond that of
    /// sensor and simulation, over the degrees of freedom that the fit leaves. One band can
    /// determine no more numbers than there are lamps.
    fn find_spread(&mut self, points: &[&Point]) {
        let mut sums = vec![[0.0; 4]; self.spread.len()];
        for point in points {
            let mut row = self.gradient(&point.of_lamps, point.band);
            row.iter_mut().for_each(|r| *r /= point.value);
            let sum = &mut sums[point.band];
            sum[0] += 1.0;
            sum[1] += (quadratic(&self.covariance, &row) / self.variance(point)).min(1.0);
            sum[2] += (1.0 - self.value(point) / point.value).powi(2);
            sum[3] += self.known_variance(point);
        }
        for (spread, [points, leverage, squares, known]) in self.spread.iter_mut().zip(sums) {
            let freedom = (points - leverage.min(self.lamps as f64)).max(1.0);
            *spread = [(squares / freedom - known / points.max(1.0)).max(0.0), freedom];
        }
    }

    /// Returns the part of [`Fit::deviance`] that this system of equations contributes.
    fn deviance(&self, points: &[&Point], prior: Option<f64>) -> f64 {
        let of = |(point, share): (&&Point, f64)| {
            let (variance, residual) =
                (self.variance(point), 1.0 - self.value(point) / point.value);
            share * (variance.ln() + residual * residual / variance)
        };
        let of_points: f64 = points.iter().zip(shares(points)).map(of).sum();
        let of_lamps = match (self.form, prior) {
            (Form::One, _) | (_, None) => 0.0,
            (_, Some(prior)) => {
                let far = |factor: &f64| ((factor / self.middle - 1.0) / prior).powi(2);
                self.theta[..self.lamps].iter().map(far).sum()
            }
        };
        of_points + of_lamps
    }

    fn factor(&self, lamp: usize, band: usize) -> f64 {
        match self.form {
            Form::One => self.theta[0],
            Form::Lamps => self.theta[lamp],
            Form::Product => self.theta[lamp] * self.theta[self.lamps + band],
        }
    }

    fn value(&self, point: &Point) -> f64 {
        let terms = point.of_lamps.iter().enumerate();
        terms.map(|(lamp, x)| self.factor(lamp, point.band) * x).sum()
    }

    /// Returns the derivatives of a reading by the parameters. `of_lamps` are the parts of the
    /// reading.
    fn gradient(&self, of_lamps: &[f64], band: usize) -> Vec<f64> {
        match self.form {
            Form::One => vec![of_lamps.iter().sum()],
            Form::Lamps => of_lamps.to_vec(),
            Form::Product => {
                let mut gradient = vec![0.0; self.theta.len()];
                for (lamp, x) in of_lamps.iter().enumerate() {
                    gradient[lamp] = x * self.theta[self.lamps + band];
                    gradient[self.lamps + band] += x * self.theta[lamp];
                }
                gradient
            }
        }
    }

    /// Returns the variance of the simulated reading, with independent lamps.
    fn simulation(&self, point: &Point) -> f64 {
        let terms = point.errors.iter().enumerate();
        terms.map(|(lamp, error)| (self.factor(lamp, point.band) * error).powi(2)).sum()
    }

    /// Returns the variance of sensor and simulation, relative to the squared reading.
    fn known_variance(&self, point: &Point) -> f64 {
        point.sensor.powi(2) + self.simulation(point) / point.value.powi(2)
    }

    fn variance(&self, point: &Point) -> f64 {
        self.known_variance(point) + self.spread[point.band][0] + LEAST_ERROR * LEAST_ERROR
    }
}

/// Returns the weight of each point: points at one place share the weight of one point.
fn shares(points: &[&Point]) -> Vec<f64> {
    let mut at_place: HashMap<usize, f64> = HashMap::new();
    points.iter().for_each(|point| *at_place.entry(point.place).or_default() += 1.0);
    points.iter().map(|point| 1.0 / at_place[&point.place]).collect()
}

/// Adds the equation `row` θ = `aim` with this weight to the normal equations.
fn add(normal: &mut Matrix, target: &mut [f64], row: &[f64], aim: f64, weight: f64) {
    for (i, a) in row.iter().enumerate().filter(|(_, a)| **a != 0.0) {
        target[i] += weight * a * aim;
        normal[i].iter_mut().zip(row).for_each(|(n, b)| *n += weight * a * b);
    }
}

fn bilinear(matrix: &Matrix, a: &[f64], b: &[f64]) -> f64 {
    let dot = |row: &[f64]| row.iter().zip(b).map(|(m, x)| m * x).sum::<f64>();
    matrix.iter().zip(a).filter(|(_, x)| **x != 0.0).map(|(row, x)| x * dot(row)).sum()
}

fn quadratic(matrix: &Matrix, vector: &[f64]) -> f64 {
    bilinear(matrix, vector, vector).max(0.0)
}
