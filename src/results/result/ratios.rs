//! Ratios of sums over bands, such as red over far red.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{BandResult, validate::are_errors};
use crate::{
    math::stats::{RunningPair, is_possible, ratio},
    scene::world::{BandRatio, BandSum, Scene},
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
    pub(super) fn all(scene: &Scene) -> Vec<Self> {
        let weights = |sum: &BandSum| {
            let mut weights = vec![0.0; scene.bands.len()];
            sum.weighted().for_each(|(band, weight)| weights[band] = weight);
            weights
        };
        let of = |BandRatio { name, numerator, denominator }: &BandRatio| Self {
            name: name.clone(),
            numerator: weights(numerator),
            denominator: weights(denominator),
        };
        scene.ratios.iter().map(of).collect()
    }

    /// Returns whether there is a possible weight for each of so many bands.
    pub(super) fn is_valid(&self, bands: usize) -> bool {
        let is_valid = |weights: &Vec<f64>| {
            weights.len() == bands && weights.iter().all(|w| (0.0..=1e30).contains(w))
        };
        is_valid(&self.numerator) && is_valid(&self.denominator)
    }

    /// Returns both sums of the values of bands.
    pub(crate) fn sums(&self, values: &[f64]) -> [f64; 2] {
        [&self.numerator, &self.denominator]
            .map(|weights| weights.iter().zip(values).map(|(weight, value)| weight * value).sum())
    }

    /// Returns the factor that a light has in all bands that count, if it is one.
    fn factor(&self, of_band: impl Fn(usize) -> f64) -> Option<f64> {
        let counts = |band: &usize| self.numerator[*band] > 0.0 || self.denominator[*band] > 0.0;
        let mut factors = (0..self.numerator.len()).filter(counts).map(of_band);
        let first = factors.next().unwrap_or(1.0);
        factors.all(|factor| factor == first).then_some(first)
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
    /// Where results are kept by light: the variance of the numerator's flux, the covariance of
    /// numerator and denominator, and the variance of the denominator's flux, from which the errors
    /// at other powers follow; null where they are not known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub covariance: Option<Vec<Option<[f64; 3]>>>,
}

impl Ratios {
    /// Finds the ratios of these sums; `None` if there are none.
    pub(super) fn of(pairs: &[RunningPair], batches: u64, split: bool) -> Option<Self> {
        let found = pairs.iter().map(|pair| pair.estimate(batches));
        let of = |(means, covariance): ([f64; 2], Option<[f64; 3]>)| {
            let ratio = ratio(means, covariance);
            (ratio.map(|(ratio, _)| ratio), (ratio.and_then(|(_, error)| error), covariance))
        };
        let (ratio, (ratio_se, covariance)): (Vec<_>, (Vec<_>, Vec<_>)) = found.map(of).unzip();
        let covariance = split.then_some(covariance);
        (!pairs.is_empty()).then_some(Self { ratio, ratio_se, covariance })
    }

    /// Returns the ratios of one light at another power: `values` per band are those at this power,
    /// and `of_band` are the factors that led to them.
    pub(super) fn scaled(
        &self,
        ratios: &[RatioResult],
        values: &[f64],
        of_band: impl Fn(usize) -> f64,
    ) -> Self {
        let mut scaled = Self { covariance: Some(Vec::new()), ..Self::default() };
        for (r, ratio) in ratios.iter().enumerate() {
            let before = || self.covariance.as_ref()?.get(r).copied()?;
            let covariance = match ratio.factor(&of_band) {
                // what is dark does not vary
                Some(0.0) => Some([0.0; 3]),
                Some(factor) => before().map(|own| own.map(|own| factor * factor * own)),
                None => None,
            };
            scaled.push(ratio.sums(values), covariance);
        }
        scaled
    }

    /// Returns the ratios of the light of all lights together, whose errors are independent, from
    /// the ratios and the values of each.
    pub(super) fn summed<'a>(
        ratios: &[RatioResult],
        parts: impl Iterator<Item = (Option<&'a Self>, &'a [f64])> + Clone,
    ) -> Option<Self> {
        let mut summed = Self { covariance: Some(Vec::new()), ..Self::default() };
        for (r, ratio) in ratios.iter().enumerate() {
            let (mut sums, mut covariance) = ([0.0; 2], Some([0.0; 3]));
            for (found, values) in parts.clone() {
                let own = ratio.sums(values);
                sums = [sums[0] + own[0], sums[1] + own[1]];
                let of_part = found.and_then(|found| found.covariance.as_ref()?.get(r).copied()?);
                covariance = covariance
                    .zip(of_part)
                    .map(|(sum, own)| std::array::from_fn(|i| sum[i] + own[i]));
            }
            summed.push(sums, covariance);
        }
        (!ratios.is_empty()).then_some(summed)
    }

    /// Adds to the covariance of the sums of a ratio, where both are known.
    pub(super) fn add_covariance(&mut self, r: usize, sums: [f64; 2], more: Option<[f64; 3]>) {
        let own = self.covariance.as_ref().and_then(|all| all.get(r).copied()?);
        let all = own.zip(more).map(|(own, more)| std::array::from_fn(|i| own[i] + more[i]));
        if let Some(error) = self.ratio_se.get_mut(r) {
            *error = ratio(sums, all).and_then(|(_, error)| error);
        }
        if let Some(covariance) = self.covariance.as_mut().and_then(|all| all.get_mut(r)) {
            *covariance = all;
        }
    }

    fn push(&mut self, sums: [f64; 2], covariance: Option<[f64; 3]>) {
        let found = ratio(sums, covariance);
        self.ratio.push(found.map(|(ratio, _)| ratio));
        self.ratio_se.push(found.and_then(|(_, error)| error));
        self.covariance.iter_mut().for_each(|all| all.push(covariance));
    }

    /// Returns the ratio with this index, and its standard error.
    pub fn get(&self, ratio: usize) -> Option<(f64, Option<f64>)> {
        let value = self.ratio.get(ratio).copied()??;
        Some((value, self.ratio_se.get(ratio).copied()?))
    }

    /// Returns whether there are so many ratios, and all numbers are possible.
    pub(crate) fn is_valid(&self, ratios: usize) -> bool {
        // a covariance is a square of two values
        let is_valid = |all: &Vec<Option<[f64; 3]>>| {
            let mut numbers = all.iter().flatten().flatten();
            all.len() == ratios && numbers.all(|number| is_possible(number.abs().sqrt()))
        };
        are_errors(&self.ratio, ratios)
            && are_errors(&self.ratio_se, ratios)
            && self.covariance.iter().all(is_valid)
    }
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
