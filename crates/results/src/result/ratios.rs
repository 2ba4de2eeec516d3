//! Ratios of sums over bands, such as red over far red.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{BandResult, Deviations};
use phylux_core::{
    math::stats::{error_of_ratio, is_possible, ratio},
    scene::world::{BandRatio, BandSum, Scene},
    transport::tally::Totals,
};

/// A ratio of sums over bands.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct RatioResult {
    /// Unique name.
    pub name: String,
    /// Weight of each band in the sum that is divided; 0 for a band that does not count.
    pub numerator: Vec<f64>,
    /// Weight of each band in the sum that it is divided by.
    pub denominator: Vec<f64>,
}

impl RatioResult {
    /// Returns the ratios of a scene.
    pub fn all(scene: &Scene) -> Vec<Self> {
        let weights = |sum: &BandSum| {
            let mut weights = vec![0.0; scene.bands().len()];
            sum.weighted().for_each(|(band, weight)| weights[band] = weight);
            weights
        };
        let of = |BandRatio { name, numerator, denominator }: &BandRatio| Self {
            name: name.clone(),
            numerator: weights(numerator),
            denominator: weights(denominator),
        };
        scene.ratios().iter().map(of).collect()
    }

    /// Returns whether there is a possible weight for each of so many bands.
    pub(super) fn is_valid(&self, bands: usize) -> bool {
        let is_valid = |weights: &Vec<f64>| {
            weights.len() == bands && weights.iter().all(|w| (0.0..=1e30).contains(w))
        };
        is_valid(&self.numerator) && is_valid(&self.denominator)
    }

    /// Returns both sums of the values of bands.
    pub fn sums(&self, values: &[f64]) -> [f64; 2] {
        [&self.numerator, &self.denominator]
            .map(|weights| weights.iter().zip(values).map(|(weight, value)| weight * value).sum())
    }

    /// Returns the bands that count.
    fn counting(&self) -> impl Iterator<Item = usize> + Clone + '_ {
        (0..self.numerator.len()).filter(|b| self.numerator[*b] > 0.0 || self.denominator[*b] > 0.0)
    }

    /// Returns both sums at other powers, as combinations of both sums before, where they are that:
    /// (a, b) stands for a times the numerator and b times the denominator.
    fn combined(&self, factors: &[f64]) -> Option<[[f64; 2]; 2]> {
        let [over, under] = [&self.numerator, &self.denominator].map(|weights| {
            let mut own = weights.iter().zip(factors).filter(|(w, _)| **w > 0.0).map(|(_, f)| *f);
            let first = own.next()?;
            own.all(|factor| factor == first).then_some(first)
        });
        if let (Some(over), Some(under)) = (over, under) {
            return Some([[over, 0.0], [0.0, under]]);
        }
        let mut counting = self.counting();
        let first = counting.next()?;
        let places = counting.find_map(|b| self.solve([first, b], [0.0; 2]).map(|_| [first, b]))?;
        let combination = |weights: &[f64]| {
            let wanted = |b: usize| weights[b] * factors[b];
            let of = self.solve(places, places.map(wanted))?;
            let most = self.counting().map(wanted).fold(0.0, f64::max);
            let rest = |b: usize| (wanted(b) - self.weight(of, b)).abs();
            self.counting().all(|b| rest(b) <= ROUNDING * most).then_some(of)
        };
        Some([combination(&self.numerator)?, combination(&self.denominator)?])
    }

    /// Returns the weight of a band in a combination of both sums.
    fn weight(&self, [over, under]: [f64; 2], band: usize) -> f64 {
        over * self.numerator[band] + under * self.denominator[band]
    }

    /// Returns the combination of both sums in which two bands have these weights, if there is one.
    fn solve(&self, [i, j]: [usize; 2], [a, b]: [f64; 2]) -> Option<[f64; 2]> {
        let ([n_i, n_j], [d_i, d_j]) =
            ([self.numerator[i], self.numerator[j]], [self.denominator[i], self.denominator[j]]);
        let determinant = n_i * d_j - n_j * d_i;
        (determinant.abs() > ROUNDING * (n_i * d_j + n_j * d_i))
            .then(|| [(a * d_j - b * d_i) / determinant, (n_i * b - n_j * a) / determinant])
    }

    /// Returns an upper bound of the standard error of N - r D, where N and D are both sums at other
    /// powers of a light and r is `ratio`; `None` where no bound is known. How all bands vary
    /// together is not kept, only how both sums did before, and each band alone.
    ///
    /// N - r D is the sum of g X over the bands, where X is the light of a band before, and g its
    /// factor times its weight n - r d. Take any combination a N0 + b D0 of both sums before. The
    /// rest of N - r D has the weights g - a n - b d. By the triangle inequality (standard errors
    /// are norms: Cauchy and Schwarz) the error is at most that of a N0 + b D0, which follows from
    /// the covariance, and |g - a n - b d| times that of each band. The least of these bounds is
    /// returned over these combinations: none (a = b = 0); f (N0 - r D0) for factors f; and those
    /// that leave no rest in two bands, with which the bound is the error itself where N and D are
    /// combinations of N0 and D0.
    fn largest_error(&self, ratio: f64, light: &OfLight, before: Option<[f64; 3]>) -> Option<f64> {
        let factor = |b: usize| light.factors[b];
        let wanted = |b: usize| factor(b) * self.weight([1.0, -ratio], b);
        // bands that differ in kind; more than a few would cost time and gain little
        let mut kinds: Vec<usize> = Vec::new();
        for b in self.counting() {
            let kind = |b: usize| (factor(b), self.numerator[b] > 0.0, self.denominator[b] > 0.0);
            if kinds.len() < MOST_KINDS && kinds.iter().all(|other| kind(*other) != kind(b)) {
                kinds.push(b);
            }
        }
        let bound = |of: [f64; 2]| {
            let known = match (of, before) {
                ([0.0, 0.0], _) => 0.0,
                (_, covariance) => variance(of, covariance?).max(0.0).sqrt(),
            };
            self.counting().try_fold(known, |sum, b| {
                let rest = (wanted(b) - self.weight(of, b)).abs();
                Some(if rest > 0.0 { sum + rest * light.error(b)? } else { sum })
            })
        };
        let pairs = kinds.iter().enumerate().flat_map(|(n, i)| kinds[..n].iter().map(|j| [*i, *j]));
        let solved = pairs.filter_map(|pair| self.solve(pair, pair.map(wanted)));
        let scaled = kinds.iter().map(|b| [factor(*b), -ratio * factor(*b)]);
        let bounds = std::iter::once([0.0; 2]).chain(scaled).chain(solved).filter_map(bound);
        bounds.min_by(f64::total_cmp)
    }
}

/// Differences below this share of the numbers are those of rounding.
const ROUNDING: f64 = 1e-12;

/// The most bands whose pairs are tried for a bound of an error.
const MOST_KINDS: usize = 8;

/// Returns the variance of a combination of two values from their covariance.
fn variance([a, b]: [f64; 2], [first, both, second]: [f64; 3]) -> f64 {
    a * a * first + 2.0 * a * b * both + b * b * second
}

/// The light of one lamp, as it was, and the factors on its power.
#[derive(Clone, Copy)]
pub(super) struct OfLight<'a> {
    /// The ratios before.
    pub ratios: Option<&'a Ratios>,
    /// Values before, per band and sum.
    pub values: &'a [f64],
    /// Their standard errors.
    pub errors: &'a [Option<f64>],
    /// Factor in each band.
    pub factors: &'a [f64],
}

impl OfLight<'_> {
    /// Returns the standard error of a band or sum before; what is dark does not vary.
    pub fn error(&self, band: usize) -> Option<f64> {
        let is_dark = self.values.get(band) == Some(&0.0);
        self.errors.get(band).copied()?.or(is_dark.then_some(0.0))
    }

    /// Returns both sums of a ratio at the new power.
    pub fn sums(&self, ratio: &RatioResult) -> [f64; 2] {
        let scaled = self.values.iter().zip(self.factors).map(|(value, factor)| value * factor);
        [&ratio.numerator, &ratio.denominator].map(|weights| {
            weights.iter().zip(scaled.clone()).map(|(weight, value)| weight * value).sum()
        })
    }

    /// Returns the covariance of both sums of a ratio before.
    pub fn before(&self, r: usize) -> Option<[f64; 3]> {
        self.ratios?.covariance.as_ref()?.get(r).copied()?
    }

    /// Returns the covariance of both sums at the new power, where it follows from the one before.
    fn covariance(&self, r: usize, ratio: &RatioResult) -> Option<[f64; 3]> {
        let [over, under] = ratio.combined(self.factors)?;
        if over == [0.0; 2] && under == [0.0; 2] {
            // what is dark does not vary
            return Some([0.0; 3]);
        }
        let before = self.before(r)?;
        let [first, both, second] = before;
        let cross = over[0] * under[0] * first
            + (over[0] * under[1] + over[1] * under[0]) * both
            + over[1] * under[1] * second;
        Some([variance(over, before), cross, variance(under, before)])
    }
}

/// The ratios of the light on a face, or of the light that was absorbed, in the order of the
/// `ratios` of the results.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Ratios {
    /// The ratio; null where nothing arrived that it could be divided by.
    pub ratio: Vec<Option<f64>>,
    /// Standard error of the value above.
    pub ratio_se: Vec<Option<f64>>,
    /// Standard deviation of the ratio by inputs that are uncertain, where the scene has any.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ratio_model_se: Option<Box<Deviations>>,
    /// Where results are kept by light: the variance of the numerator's flux, the covariance of
    /// numerator and denominator, and the variance of the denominator's flux, from which the errors
    /// at other powers follow; null where they are not known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub covariance: Option<Vec<Option<[f64; 3]>>>,
}

impl Ratios {
    /// Finds the ratios of what was counted in a channel; `None` if there are none.
    pub(super) fn of(totals: &Totals, channel: usize, split: bool) -> Option<Box<Self>> {
        let found = totals.ratios(channel);
        let (any, histories) = (found.len() > 0, totals.misses_of(channel));
        let of = |(means, covariance): ([f64; 2], Option<[f64; 3]>)| {
            let ratio = ratio(means, covariance);
            // of a numerator of which nothing arrived no error is known
            let error =
                ratio.and_then(|(ratio, error)| Some(error_of_ratio(ratio, error?, histories)));
            let error = error.filter(|_| means[0] != 0.0);
            (ratio.map(|(ratio, _)| ratio), (error, covariance))
        };
        let (ratio, (ratio_se, covariance)): (Vec<_>, (Vec<_>, Vec<_>)) = found.map(of).unzip();
        let covariance = split.then_some(covariance);
        any.then(|| Box::new(Self { ratio, ratio_se, ratio_model_se: None, covariance }))
    }

    /// Returns the ratios of the light of these lamps together at their new powers; lamps have
    /// independent errors. `None` if there are no ratios. Where the covariance of both sums does not
    /// follow from those before, it is null, and the standard error an upper bound.
    pub(super) fn mixed<'a>(
        ratios: &[RatioResult],
        lights: impl Iterator<Item = OfLight<'a>> + Clone,
    ) -> Option<Box<Self>> {
        let mut mixed = Self { covariance: Some(Vec::new()), ..Self::default() };
        for (r, of) in ratios.iter().enumerate() {
            let (mut sums, mut all) = ([0.0; 2], Some([0.0; 3]));
            for light in lights.clone() {
                let own = light.sums(of);
                sums = [sums[0] + own[0], sums[1] + own[1]];
                all = added(all, light.covariance(r, of));
            }
            let mut found = ratio(sums, all);
            if let (Some((value, error @ None)), None) = (&mut found, all) {
                let bound = lights.clone().try_fold(0.0, |sum: f64, light| {
                    Some(sum.hypot(of.largest_error(*value, &light, light.before(r))?))
                });
                *error = bound.map(|bound| bound / sums[1]).filter(|bound| is_possible(*bound));
            }
            mixed.ratio.push(found.map(|(ratio, _)| ratio));
            mixed.ratio_se.push(found.and_then(|(_, error)| error));
            mixed.covariance.iter_mut().for_each(|found| found.push(all));
        }
        (!ratios.is_empty()).then(|| Box::new(mixed))
    }

    /// Adds an independent covariance of both `sums` of a ratio, where it is known.
    pub(super) fn add_covariance(&mut self, r: usize, sums: [f64; 2], more: Option<[f64; 3]>) {
        if let Some(error) = self.ratio_se.get_mut(r) {
            let own = ratio(sums, more).and_then(|(_, error)| error);
            *error = error.zip(own).map(|(error, own)| error.hypot(own));
        }
        if let Some(own) = self.covariance.as_mut().and_then(|all| all.get_mut(r)) {
            *own = added(*own, more);
        }
    }

    /// Returns the ratio with this index, and its standard error.
    pub fn get(&self, ratio: usize) -> Option<(f64, Option<f64>)> {
        let value = self.ratio.get(ratio).copied()??;
        Some((value, self.ratio_se.get(ratio).copied()?))
    }

    /// Returns whether there are covariances of so many ratios, and all their numbers are possible.
    pub(super) fn has_covariances(&self, ratios: usize) -> bool {
        // a covariance is a square of two values
        let is_valid = |all: &Vec<Option<[f64; 3]>>| {
            let mut numbers = all.iter().flatten().flatten();
            all.len() == ratios && numbers.all(|number| is_possible(number.abs().sqrt()))
        };
        self.covariance.iter().all(is_valid)
    }
}

/// Returns the covariance of sums of independent values.
fn added(a: Option<[f64; 3]>, b: Option<[f64; 3]>) -> Option<[f64; 3]> {
    a.zip(b).map(|(a, b)| std::array::from_fn(|i| a[i] + b[i]))
}

impl BandResult {
    /// Returns the bands of a sum among `bands`, each with its weight; none for a band.
    pub fn members<'a>(&'a self, bands: &'a [Self]) -> impl Iterator<Item = (usize, f64)> + 'a {
        let weight = |i: usize| self.weights.as_ref().map_or(Some(1.0), |all| all.get(i).copied());
        let place = |name: &String| {
            bands.iter().position(|band| band.sum_of.is_none() && band.name == *name)
        };
        let names = self.sum_of.iter().flatten().enumerate();
        names.filter_map(move |(i, name)| Some((place(name)?, weight(i)?)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// However bands vary together, the error of a ratio at other powers is not below that of its
    /// closed form, nor above that of bands that go together; it is the closed form where both sums
    /// are combinations of those before.
    #[test]
    fn errors_of_ratios_have_a_bound() {
        // bands as sums of three independent parts
        let loadings = [
            [[1.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.0, 0.0, 1.0]],
            [[1.0, 0.5, 0.2], [0.9, 0.4, 0.3], [0.8, 0.6, 0.1]],
            [[1.0, -0.5, 0.2], [-0.9, 0.4, 0.3], [0.1, -0.6, 0.7]],
            [[1.0, 0.0, 0.0], [1.5, 0.0, 0.0], [0.5, 0.0, 0.0]],
        ];
        let values = [10.0, 30.0, 20.0];
        let weights = [
            ([1.0, 0.0, 0.0], [0.0, 1.0, 1.0]),
            ([1.0, 0.0, 0.0], [1.0, 1.0, 1.0]),
            ([0.3, 0.5, 2.0], [0.5, 1.0, 2.1]),
        ];
        let all_factors = [
            ([2.0, 2.0, 2.0], [true, true, true]),
            ([0.5, 3.0, 3.0], [true, true, false]),
            ([0.0, 1.0, 1.0], [true, true, false]),
            ([0.5, 3.0, 1.1], [false, false, false]),
            ([0.0, 0.0, 0.0], [false, false, false]),
        ];
        for parts in loadings {
            let error = |weights: [f64; 3]| -> f64 {
                let part = |k: usize| (0..3).map(|b| weights[b] * parts[b][k]).sum::<f64>();
                (0..3).map(|k| part(k).powi(2)).sum::<f64>().sqrt()
            };
            let errors = [0, 1, 2].map(|b| {
                let mut alone = [0.0; 3];
                alone[b] = 1.0;
                Some(error(alone))
            });
            for (case, (numerator, denominator)) in weights.into_iter().enumerate() {
                let sum: [f64; 3] = std::array::from_fn(|b| numerator[b] + denominator[b]);
                let [over, under] = [numerator, denominator].map(|weights| error(weights).powi(2));
                let both = (error(sum).powi(2) - over - under) / 2.0;
                let of = RatioResult {
                    name: "r".into(),
                    numerator: numerator.into(),
                    denominator: denominator.into(),
                };
                let before = Ratios {
                    ratio_model_se: None,
                    covariance: Some(vec![Some([over, both, under])]),
                    ..Ratios::default()
                };
                for (factors, exact) in all_factors {
                    let light = |ratios, errors| OfLight {
                        ratios,
                        values: &values,
                        errors,
                        factors: &factors,
                    };
                    let found = |light: OfLight| {
                        let of = std::slice::from_ref(&of);
                        Ratios::mixed(of, [light].into_iter()).expect("ratios").get(0)
                    };
                    let Some((ratio, bound)) = found(light(Some(&before), &errors)) else {
                        assert_eq!(factors, [0.0; 3]);
                        continue;
                    };
                    let scaled = [0, 1, 2].map(|b| values[b] * factors[b]);
                    let [top, bottom] = of.sums(&scaled);
                    assert!((ratio - top / bottom).abs() < 1e-12);
                    let weight = |b: usize| factors[b] * (numerator[b] - ratio * denominator[b]);
                    let expected = error([0, 1, 2].map(weight)) / bottom;
                    let together = |b: usize| weight(b).abs() * errors[b].expect("an error");
                    let most = [0, 1, 2].map(together).iter().sum::<f64>() / bottom;
                    let bound = bound.expect("a bound");
                    assert!(bound > expected * 0.999_999_9 - 1e-9, "{bound} {expected}");
                    assert!(bound < most * 1.000_000_1 + 1e-9, "{bound} {most}");
                    assert!(!exact[case] || (bound - expected).abs() < 1e-7, "{bound} {expected}");
                    // without the covariance before, bands that go together are assumed
                    let (_, alone) = found(light(None, &errors)).expect("a ratio");
                    assert!((alone.expect("a bound") - most).abs() < 1e-9 * most + 1e-12);
                    let unknown = [errors[0], None, errors[2]];
                    let (_, none) = found(light(None, &unknown)).expect("a ratio");
                    assert_eq!(none.is_none(), weight(1) != 0.0);
                }
            }
        }
    }
}
