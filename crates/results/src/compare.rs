//! Compares two results captor by captor: do they differ by more than chance explains?

use std::collections::{HashMap, HashSet};

use serde::Serialize;

use crate::{quantity::QUANTITIES, result::RunResult};
use phylux_core::{
    error::{Error, Result},
    transport::settings::{Estimator, Guiding},
};

/// Odds of a false alarm over all values of a comparison.
pub const ODDS: f64 = 1e-3;
/// Half the width of an interval of 95 %, in standard errors.
const HALF_WIDTH: f64 = 1.98;

impl RunResult {
    /// Returns every value that is compared with its captor, face and band, in the order of the file.
    fn values(&self) -> Vec<(Key<'_>, Value)> {
        let mut all = Vec::new();
        let compared = || QUANTITIES.iter().filter(|quantity| quantity.is_compared);
        for captor in &self.captors {
            let row = captor.row();
            let few = |face: usize| row.faces[face].is_some_and(|face| face.few_paths);
            for (face, quantity) in (0..3).flat_map(|face| compared().map(move |of| (face, of))) {
                let Some(column) = quantity.at(&row, face) else { continue };
                let (what, area, few_paths) = match face {
                    0 | 1 => (["front", "back"][face], captor.area, few(face)),
                    _ => (quantity.name, 1.0, few(0) || few(1)),
                };
                for (b, (band, power)) in self.bands.iter().zip(&self.energy.power).enumerate() {
                    let (Some(mean), [error, _]) = (column.value(b), column.errors(b)) else {
                        continue;
                    };
                    let nothing = mean == 0.0 && error.is_none() && *power > 0.0;
                    let error = if nothing { self.of_nothing(*power, area) } else { error };
                    let unknown = nothing && error.is_none();
                    let key = (captor.id.as_str(), what, band.name.as_str());
                    all.push((key, Value { mean, error, few_paths, unknown }));
                }
            }
        }
        all
    }

    /// Returns the standard error of light of which nothing arrived, where the lights have this power,
    /// per area, m2: so large that the interval of 95 % ends at the bound 3 power / photons. `None`
    /// where no bound is known: for paths, and where splitting changes the power of photons.
    fn of_nothing(&self, power: f64, area: f64) -> Option<f64> {
        let is_plain = self.estimator == Estimator::Photons && self.guiding != Some(Guiding::Full);
        let bound = 3.0 * power / self.photons as f64 / area;
        (is_plain && bound > 0.0).then_some(bound / HALF_WIDTH)
    }
}

/// Identifies a value: captor; `front` or `back` (irradiance) or `absorbed` (power); band.
type Key<'a> = (&'a str, &'static str, &'a str);

#[derive(Clone, Copy, Debug)]
struct Value {
    mean: f64,
    error: Option<f64>,
    few_paths: bool,
    /// Whether nothing arrived, and it is not known how much there may be.
    unknown: bool,
}

/// One value, of a captor, face and band, as both results have it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Difference {
    /// Id of the captor.
    pub captor: String,
    /// `front` or `back`, the irradiance of that face; or `absorbed`, the power.
    pub what: &'static str,
    /// Name of the band or sum.
    pub band: String,
    /// Value in the first results.
    pub a: f64,
    /// Value in the second results.
    pub b: f64,
    /// b - a, divided by the standard error of the difference; `None` where no standard error is
    /// known.
    pub z: Option<f64>,
}

/// The comparison of two results: the values that both have, and the names of those that only one
/// has.
#[derive(Clone, Debug)]
pub struct Comparison {
    /// The differences, worst first: those without a known standard error, then the others by |z|.
    pub differences: Vec<Difference>,
    /// Number of further common values, which are not compared, because their standard error rests
    /// on few paths in one of the results, or because nothing arrived and no bound of it is known.
    pub few_paths: usize,
    /// Captors, faces and bands that only one of the results has.
    pub unmatched: Vec<String>,
    /// The |z| that chance exceeds anywhere among the differences with odds below 1/1000.
    pub limit: f64,
    /// Whether both results have the same estimator and seed. They then share random numbers, and
    /// differ by less than independent results.
    pub dependent: bool,
}

impl Comparison {
    /// Compares the values that both results have. Errors: they have nothing in common; their units
    /// differ.
    pub fn new(a: &RunResult, b: &RunResult) -> Result<Self> {
        if [&a.unit.flux, &a.unit.irradiance] != [&b.unit.flux, &b.unit.irradiance] {
            let problem = format!("one is in {}, the other in {}", a.unit.flux, b.unit.flux);
            return Err(Error::input("results", problem).remedy("compare results of one unit"));
        }
        let (ours, theirs) = (a.values(), b.values());
        let known: HashMap<Key, Value> = theirs.iter().copied().collect();
        let mine: HashSet<Key> = ours.iter().map(|(key, _)| *key).collect();
        let only_ours = ours.iter().filter(|(key, _)| !known.contains_key(key));
        let only_theirs = theirs.iter().filter(|(key, _)| !mine.contains(key));
        let name = |((captor, what, band), _): &(Key, Value)| format!("{captor} {what} {band}");
        let unmatched = only_ours.chain(only_theirs).map(name).collect();

        let common: Vec<(Key, Value, Value)> =
            ours.iter().filter_map(|&(key, value)| Some((key, value, *known.get(&key)?))).collect();
        if common.is_empty() {
            return Err(Error::input("results", "they have no captor and band in common")
                .remedy("compare results of one scene"));
        }
        let unknown = |a: &Value, b: &Value| (a.unknown || b.unknown) && a.mean != b.mean;
        let sure = common.iter().filter(|(_, a, b)| !a.few_paths && !b.few_paths && !unknown(a, b));
        let mut differences: Vec<_> = sure.map(|&(key, a, b)| difference(key, a, b)).collect();
        let few_paths = common.len() - differences.len();
        // by Gauss's tail, P(|z| > x) <= exp(-x^2 / 2), for all of them together
        let limit = (2.0 * (differences.len().max(1) as f64 / ODDS).ln()).sqrt();
        differences.sort_by(|p, q| q.weight().total_cmp(&p.weight()));
        let dependent = (a.estimator, a.seed) == (b.estimator, b.seed);
        Ok(Self { differences, few_paths, unmatched, limit, dependent })
    }

    /// Returns the number of values that differ by more than chance explains.
    pub fn beyond_chance(&self) -> usize {
        self.differences.iter().filter(|d| d.weight() > self.limit).count()
    }

    /// Returns whether both results have the same captors, faces and bands, at least one, and no
    /// value differs by more than chance explains.
    pub fn agrees(&self) -> bool {
        self.beyond_chance() == 0 && self.unmatched.is_empty() && !self.differences.is_empty()
    }

    /// Returns the root mean square of z where standard errors are known: about 1 for two runs of
    /// one scene.
    pub fn rms(&self) -> Option<f64> {
        let z: Vec<f64> = self.differences.iter().filter_map(|d| d.z).collect();
        // squares of very large values would be infinite
        let length = z.iter().fold(0.0, |length, z| f64::hypot(length, *z));
        (!z.is_empty()).then(|| length / (z.len() as f64).sqrt())
    }
}

impl Difference {
    /// Returns the weight for sorting: |z|; without a known standard error, infinite if the values
    /// differ, else 0.
    fn weight(&self) -> f64 {
        self.z.map_or(if self.a == self.b { 0.0 } else { f64::INFINITY }, f64::abs)
    }
}

fn difference((captor, what, band): Key, a: Value, b: Value) -> Difference {
    // one batch has no error, and then only the error of the other value is known
    let variance = |value: Value| value.error.map(|error| error * error);
    let known = [variance(a), variance(b)].into_iter().flatten();
    let error = known.sum::<f64>().sqrt();
    // two values of 0 agree, and say nothing of their errors
    let any = error > 0.0 && (a.mean, b.mean) != (0.0, 0.0);
    let z = any.then(|| (b.mean - a.mean) / error);
    Difference { captor: captor.into(), what, band: band.into(), a: a.mean, b: b.mean, z }
}
