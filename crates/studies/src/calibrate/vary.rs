//! Numbers of a scene, such as the reflectance of a wall, that are found together with the powers
//! of its lamps.
//!
//! Light is not linear in these numbers. They are therefore varied on a grid of runs, and in each
//! run the powers are fitted anew (variable projection: Golub and Pereyra, SIAM Journal on
//! Numerical Analysis 10:413, 1973). The best numbers minimise the deviance D of that fit, -2 times
//! the logarithm of its likelihood, plus a prior about the numbers in the scene file: the numbers
//! trade with the powers, and readings alone may not tell one from the other. A quadratic through
//! the neighbours of the best node gives the minimum of D. Its curvature H gives the uncertainty:
//! the covariance is 2 H⁻¹.

use serde_json::{Value, json};

use phylux_core::{
    error::{Error, Result},
    math::least_squares::inverse,
};
use phylux_files::{input::quoted, json};
use phylux_results::calibration::Varied;

/// Number of values that each number takes.
const NODES: usize = 5;
/// The largest number of numbers that may vary: two take 25 runs.
const MOST: usize = 2;
/// Standard deviation of the prior about the number in the scene file.
const PRIOR: f64 = 0.02;

/// A number of the scene that varies over a range.
#[derive(Clone, Debug, PartialEq)]
pub struct Vary {
    pointer: String,
    from: f64,
    to: f64,
}

impl Vary {
    /// Parses text such as `/materials/wall/reflectance=0.7:0.85`.
    pub fn parse(text: &str) -> std::result::Result<Self, String> {
        let parts = || {
            let (pointer, range) = text.rsplit_once('=')?;
            let (from, to) = range.split_once(':')?;
            Some((pointer, from.trim().parse::<f64>().ok()?, to.trim().parse::<f64>().ok()?))
        };
        match parts() {
            Some((pointer, from, to))
                if pointer.starts_with('/') && from < to && (to - from).is_finite() =>
            {
                Ok(Self { pointer: pointer.into(), from, to })
            }
            _ => Err("must be a place in the scene and a range, as in /materials/wall/reflectance=0.7:0.85".into()),
        }
    }

    fn node(&self, index: usize) -> f64 {
        self.from + (self.to - self.from) * index as f64 / (NODES - 1) as f64
    }

    fn step(&self) -> f64 {
        (self.to - self.from) / (NODES - 1) as f64
    }
}

/// The grid of runs for some numbers of a scene.
#[derive(Debug)]
pub struct Grid<'a> {
    document: &'a Value,
    varies: &'a [Vary],
    /// The numbers in the scene file.
    given: Vec<f64>,
    /// Whether there is a prior about these numbers.
    prior: bool,
}

impl<'a> Grid<'a> {
    /// Makes the grid for the scene file `name`, whose JSON is `document`. Errors: too many
    /// numbers, one number twice, no number at a place.
    pub fn new(name: &str, document: &'a Value, varies: &'a [Vary], prior: bool) -> Result<Self> {
        let wrong = |problem: String| Error::input("--vary", problem);
        if varies.len() > MOST {
            let problem =
                format!("{} numbers, of which each takes {NODES} times the runs", varies.len());
            return Err(wrong(problem).remedy(format!("vary at most {MOST}")));
        }
        if let [first, second] = varies
            && first.pointer == second.pointer
        {
            return Err(
                wrong(format!("{} varies twice", quoted(&first.pointer))).remedy("give one range")
            );
        }
        let given = |vary: &Vary| {
            let place = json::place(name, &vary.pointer);
            let found = document.pointer(&vary.pointer).ok_or_else(|| {
                wrong(format!("{place}: there is nothing at this place"))
                    .remedy("name a number of the scene file, as in /materials/wall/reflectance")
            })?;
            mean(found).ok_or_else(|| {
                wrong(format!("{place}: is neither a number nor a list of numbers"))
                    .remedy("name a number in it; of a spectrum its `times`")
            })
        };
        let given = varies.iter().map(given).collect::<Result<_>>()?;
        Ok(Self { document, varies, given, prior })
    }

    /// Returns the number of runs.
    pub fn runs(&self) -> usize {
        NODES.pow(self.varies.len() as u32)
    }

    /// Returns the index of the run in the middle.
    pub fn middle(&self) -> usize {
        self.runs() / 2
    }

    /// Returns the values of a run, by its index.
    pub fn values(&self, run: usize) -> Vec<f64> {
        let digit = |i: usize| run / NODES.pow(i as u32) % NODES;
        self.varies.iter().enumerate().map(|(i, vary)| vary.node(digit(i))).collect()
    }

    /// Returns the scene file with these values. A list keeps its ratios, and its mean takes the
    /// value.
    pub fn document(&self, values: &[f64]) -> Value {
        let mut document = self.document.clone();
        for ((vary, value), given) in self.varies.iter().zip(values).zip(&self.given) {
            if let Some(place) = document.pointer_mut(&vary.pointer) {
                *place = match place.as_array() {
                    Some(list) if *given != 0.0 => {
                        let scaled = |number: &Value| number.as_f64().map(|x| x * value / given);
                        list.iter().map(scaled).collect()
                    }
                    Some(list) => list.iter().map(|_| json!(value)).collect(),
                    None => json!(value),
                };
            }
        }
        document
    }

    /// Returns the values with the least deviance. `deviances` holds that of each run, in order.
    pub fn least(&self, deviances: &[f64]) -> Vec<Varied> {
        let total = |run: usize| deviances[run] + self.distance(&self.values(run));
        let totals: Vec<f64> = (0..self.runs()).map(total).collect();
        let best = (0..totals.len()).min_by(|&a, &b| totals[a].total_cmp(&totals[b])).unwrap_or(0);
        let n = self.varies.len();
        let digit = |i: usize| best / NODES.pow(i as u32) % NODES;
        // middle of the nodes through which the quadratic goes
        let middle: Vec<usize> = (0..n).map(|i| digit(i).clamp(1, NODES - 2)).collect();
        let (slope, curvature) = self.quadratic(&totals, &middle);
        let found = inverse(&curvature).map(|inverse| {
            let step = |row: &Vec<f64>| -row.iter().zip(&slope).map(|(h, g)| h * g).sum::<f64>();
            let steps: Vec<f64> = inverse.iter().map(step).collect();
            (steps, (0..n).map(|i| (2.0 * inverse[i][i]).sqrt()).collect::<Vec<f64>>())
        });
        let own = |(i, vary): (usize, &Vary)| {
            let (place, error) = match &found {
                Some((steps, errors)) => {
                    (middle[i] as f64 + steps[i].clamp(-1.0, 1.0), Some(vary.step() * errors[i]))
                }
                None => (digit(i) as f64, None),
            };
            let held = place <= 0.0 || place >= (NODES - 1) as f64;
            Varied {
                place: vary.pointer.clone(),
                from: vary.from,
                to: vary.to,
                given: self.given[i],
                value: (vary.from + vary.step() * place).min(vary.to),
                standard_error: error.filter(|_| !held),
            }
        };
        self.varies.iter().enumerate().map(own).collect()
    }

    /// Returns what the prior adds to the deviance.
    fn distance(&self, values: &[f64]) -> f64 {
        let square = |(value, given): (&f64, &f64)| ((value - given) / PRIOR).powi(2);
        if self.prior { values.iter().zip(&self.given).map(square).sum() } else { 0.0 }
    }

    /// Returns slopes and curvatures, per step, at the node with these digits, by least squares
    /// through the node and its neighbours.
    fn quadratic(&self, totals: &[f64], middle: &[usize]) -> (Vec<f64>, Vec<Vec<f64>>) {
        let n = middle.len();
        let around = 3usize.pow(n as u32);
        // all neighbours: their steps from the middle, and their values
        let near: Vec<(Vec<f64>, f64)> = (0..around)
            .map(|i| {
                let steps: Vec<usize> = (0..n).map(|j| i / 3usize.pow(j as u32) % 3).collect();
                let index =
                    |(j, step): (usize, &usize)| (middle[j] + step - 1) * NODES.pow(j as u32);
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
}

/// Returns what a user should know of the numbers that were found.
pub fn warnings(found: &[Varied]) -> Vec<String> {
    let unsure = found.iter().filter(|varied| varied.standard_error.is_none());
    let warning = |varied: &Varied| {
        let Varied { place, from, to, value, .. } = varied;
        let place = quoted(place);
        let border = 1e-9 * (to - from);
        match value - from < border || to - value < border {
            true => format!(
                "{place} is best at a border of its range, {value}: give a wider one to --vary"
            ),
            false => format!("the readings do not tell {place}: measure more, or keep the prior"),
        }
    };
    unsure.map(warning).collect()
}

/// Returns the number at a place, or the mean of a list of numbers.
fn mean(value: &Value) -> Option<f64> {
    match value {
        Value::Array(list) if !list.is_empty() => {
            let sum: Option<f64> = list.iter().map(Value::as_f64).sum();
            sum.map(|sum| sum / list.len() as f64)
        }
        other => other.as_f64(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn vary(text: &str) -> Vary {
        Vary::parse(text).unwrap_or_else(|e| panic!("{text}: {e}"))
    }

    #[test]
    fn places_and_ranges_are_read() {
        let read = vary("/materials/a=b/reflectance=0.7:0.85");
        assert_eq!(
            (read.pointer.as_str(), read.from, read.to),
            ("/materials/a=b/reflectance", 0.7, 0.85)
        );
        for wrong in
            ["/a", "/a=1", "a=1:2", "/a=2:1", "/a=1:1", "/a=1:x", "/a=0:inf", "/a=nan:1", ""]
        {
            assert!(Vary::parse(wrong).is_err(), "{wrong}");
        }
    }

    /// The minimum of a known quadratic deviance is found exactly, in one direction and in two. The
    /// errors are those of its curvature and, where it is flat, that of the prior.
    #[test]
    fn the_least_place_of_a_quadratic_is_found() {
        let document = json!({ "a": 0.5, "b": [0.2, 0.4] });
        let one = [vary("/a=0.4:0.8")];
        let grid = Grid::new("s", &document, &one, false).unwrap();
        let of = |x: f64| 7.0 + ((x - 0.63) / 0.05).powi(2);
        let deviances: Vec<f64> = (0..grid.runs()).map(|run| of(grid.values(run)[0])).collect();
        let found = &grid.least(&deviances)[0];
        assert!((found.value - 0.63).abs() < 1e-9 && found.given == 0.5);
        assert!((found.standard_error.unwrap() - 0.05).abs() < 1e-9);
        let flat = Grid::new("s", &document, &one, true).unwrap().least(&[1.0; NODES]);
        assert!((flat[0].value - 0.5).abs() < 1e-9);
        assert!((flat[0].standard_error.unwrap() - PRIOR).abs() < 1e-9);

        let two = [vary("/a=0.4:0.8"), vary("/b=0.1:0.5")];
        let grid = Grid::new("s", &document, &two, false).unwrap();
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
        // a list keeps its ratios
        let written = grid.document(&[0.6, 0.45]);
        assert_eq!(written["a"], 0.6);
        assert!((written["b"][0].as_f64().unwrap() - 0.3).abs() < 1e-12);
        assert!((written["b"][1].as_f64().unwrap() - 0.6).abs() < 1e-12);
    }

    #[test]
    fn a_value_at_the_border_is_held() {
        let document = json!({ "a": 0.5 });
        let one = [vary("/a=0.4:0.8")];
        let grid = Grid::new("s", &document, &one, false).unwrap();
        let found = &grid.least(&[1.0, 2.0, 4.0, 7.0, 11.0])[0];
        assert_eq!((found.value, found.standard_error), (0.4, None));
        assert!(warnings(std::slice::from_ref(found))[0].contains("at a border of its range, 0.4"));
        for (varies, words) in [
            (vec![vary("/b=0:1")], "s: /b: there is nothing at this place"),
            (vec![vary("/a=0:1"), vary("/a=0:2")], "`/a` varies twice"),
            (vec![vary("/a=0:1"); 3], "3 numbers"),
        ] {
            let error = Grid::new("s", &document, &varies, true).unwrap_err().to_string();
            assert!(error.starts_with("--vary: ") && error.contains(words), "{error}");
        }
    }
}
