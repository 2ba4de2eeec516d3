//! Numbers of a scene that are found by a grid of runs. A quadratic through the neighbours of the
//! best node gives the minimum of the deviance D. Its curvature H gives the uncertainty: the
//! covariance is 2 H⁻¹.

use super::numbers::{Numbers, Vary};
use phylux_core::math::least_squares::inverse;
use phylux_results::calibration::Varied;

/// Number of values that each number takes.
pub const NODES: usize = 5;

/// The grid of runs for some numbers of a scene.
#[derive(Debug)]
pub struct Grid<'a> {
    numbers: &'a Numbers<'a>,
}

impl<'a> Grid<'a> {
    /// Makes the grid for these numbers.
    pub fn new(numbers: &'a Numbers<'a>) -> Self {
        Self { numbers }
    }

    fn varies(&self) -> &'a [Vary] {
        self.numbers.varies()
    }

    /// Returns the number of runs.
    pub fn runs(&self) -> usize {
        NODES.pow(self.varies().len() as u32)
    }

    /// Returns the index of the run in the middle.
    pub fn middle(&self) -> usize {
        self.runs() / 2
    }

    /// Returns the values of a run, by its index.
    pub fn values(&self, run: usize) -> Vec<f64> {
        let digit = |i: usize| run / NODES.pow(i as u32) % NODES;
        self.varies().iter().enumerate().map(|(i, vary)| node(vary, digit(i))).collect()
    }

    /// Returns the values with the least deviance. `deviances` holds that of each run, in order.
    pub fn least(&self, deviances: &[f64]) -> Vec<Varied> {
        let total = |run: usize| deviances[run] + self.numbers.distance(&self.values(run));
        let totals: Vec<f64> = (0..self.runs()).map(total).collect();
        let best = (0..totals.len()).min_by(|&a, &b| totals[a].total_cmp(&totals[b])).unwrap_or(0);
        let n = self.varies().len();
        let digit = |i: usize| best / NODES.pow(i as u32) % NODES;
        // middle of the nodes through which the quadratic goes
        let middle: Vec<usize> = (0..n).map(|i| digit(i).clamp(1, NODES - 2)).collect();
        let (slope, curvature) = quadratic(&totals, &middle);
        let found = inverse(&curvature).map(|inverse| {
            let step = |row: &Vec<f64>| -row.iter().zip(&slope).map(|(h, g)| h * g).sum::<f64>();
            let steps: Vec<f64> = inverse.iter().map(step).collect();
            (steps, (0..n).map(|i| (2.0 * inverse[i][i]).sqrt()).collect::<Vec<f64>>())
        });
        let own = |(i, vary): (usize, &Vary)| {
            let (place, error) = match &found {
                Some((steps, errors)) => {
                    (middle[i] as f64 + steps[i].clamp(-1.0, 1.0), Some(step(vary) * errors[i]))
                }
                None => (digit(i) as f64, None),
            };
            let held = place <= 0.0 || place >= (NODES - 1) as f64;
            let value = (vary.from + step(vary) * place).min(vary.to);
            (value, error.filter(|_| !held))
        };
        self.numbers.varied(self.varies().iter().enumerate().map(own))
    }
}

/// Returns the value of a number at a node.
fn node(vary: &Vary, index: usize) -> f64 {
    vary.from + (vary.to - vary.from) * index as f64 / (NODES - 1) as f64
}

/// Returns the distance between two nodes of a number.
fn step(vary: &Vary) -> f64 {
    (vary.to - vary.from) / (NODES - 1) as f64
}

/// Returns slopes and curvatures, per step, at the node with these digits, by least squares through
/// the node and its neighbours.
fn quadratic(totals: &[f64], middle: &[usize]) -> (Vec<f64>, Vec<Vec<f64>>) {
    let n = middle.len();
    let around = 3usize.pow(n as u32);
    // all neighbours: their steps from the middle, and their values
    let near: Vec<(Vec<f64>, f64)> = (0..around)
        .map(|i| {
            let steps: Vec<usize> = (0..n).map(|j| i / 3usize.pow(j as u32) % 3).collect();
            let index = |(j, step): (usize, &usize)| (middle[j] + step - 1) * NODES.pow(j as u32);
            let run: usize = steps.iter().enumerate().map(index).sum();
            (steps.iter().map(|step| *step as f64 - 1.0).collect(), totals[run])
        })
        .collect();
    let sum = |of: &dyn Fn(&[f64]) -> f64| near.iter().map(|(u, d)| of(u) * d).sum::<f64>();
    // number of neighbours with the same step along one direction
    let each = around as f64 / 3.0;
    let slope = (0..n).map(|i| sum(&|u| u[i]) / (2.0 * each)).collect();
    let entry = |i: usize, j: usize| match i == j {
        true => sum(&|u| 3.0 * u[i] * u[i] - 2.0) / each,
        false => sum(&|u| u[i] * u[j]) / 4.0,
    };
    (slope, (0..n).map(|i| (0..n).map(|j| entry(i, j)).collect()).collect())
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;
    use crate::calibrate::numbers::{PRIOR, warnings};

    fn vary(text: &str) -> Vary {
        Vary::parse(text).unwrap_or_else(|e| panic!("{text}: {e}"))
    }

    /// The minimum of a known quadratic deviance is found exactly, in one direction and in two. The
    /// errors are those of its curvature and, where it is flat, that of the prior.
    #[test]
    fn the_least_place_of_a_quadratic_is_found() {
        let document = json!({ "a": 0.5, "b": [0.2, 0.4] });
        let one = [vary("/a=0.4:0.8")];
        let numbers = Numbers::new("s", &document, &one, false).unwrap();
        let grid = Grid::new(&numbers);
        let of = |x: f64| 7.0 + ((x - 0.63) / 0.05).powi(2);
        let deviances: Vec<f64> = (0..grid.runs()).map(|run| of(grid.values(run)[0])).collect();
        let found = &grid.least(&deviances)[0];
        assert!((found.value - 0.63).abs() < 1e-9 && found.given == 0.5);
        assert!((found.standard_error.unwrap() - 0.05).abs() < 1e-9);
        let numbers = Numbers::new("s", &document, &one, true).unwrap();
        let flat = Grid::new(&numbers).least(&[1.0; NODES]);
        assert!((flat[0].value - 0.5).abs() < 1e-9);
        assert!((flat[0].standard_error.unwrap() - PRIOR).abs() < 1e-9);

        let two = [vary("/a=0.4:0.8"), vary("/b=0.1:0.5")];
        let numbers = Numbers::new("s", &document, &two, false).unwrap();
        let grid = Grid::new(&numbers);
        let middle = grid.values(grid.middle());
        assert!(
            grid.runs() == 25 && (middle[0] - 0.6).abs() < 1e-12 && (middle[1] - 0.3).abs() < 1e-12
        );
        // precision [[4, 1.5], [1.5, 1]] over 0.1²: the diagonal of its inverse is 1/1.75 and
        // 4/1.75
        let of = |x: &[f64]| {
            let (u, v) = ((x[0] - 0.52) / 0.1, (x[1] - 0.36) / 0.1);
            4.0 * u * u + 3.0 * u * v + v * v
        };
        let deviances: Vec<f64> = (0..grid.runs()).map(|run| of(&grid.values(run))).collect();
        let found = grid.least(&deviances);
        for (found, [value, error]) in found.iter().zip([[0.52, 1.0 / 1.75], [0.36, 4.0 / 1.75]]) {
            assert!((found.value - value).abs() < 1e-9, "{found:?}");
            assert!((found.standard_error.unwrap() - 0.1 * f64::sqrt(error)).abs() < 1e-9);
        }
    }

    #[test]
    fn a_value_at_the_border_is_held() {
        let document = json!({ "a": 0.5 });
        let one = [vary("/a=0.4:0.8")];
        let numbers = Numbers::new("s", &document, &one, false).unwrap();
        let found = &Grid::new(&numbers).least(&[1.0, 2.0, 4.0, 7.0, 11.0])[0];
        assert_eq!((found.value, found.standard_error), (0.4, None));
        assert!(warnings(std::slice::from_ref(found))[0].contains("at a border of its range, 0.4"));
    }
}
