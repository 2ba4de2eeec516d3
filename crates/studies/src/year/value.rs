//! Values of a year with their errors.

use super::places::{Places, RATIO};
use phylux_core::{math::stats, scene::captor::Channel};

/// The quantity of captors and groups as a whole that a year knows beside their light.
pub(super) const OWN: &str = "sunlit";

/// A value, and the square of its standard error.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Value {
    /// Irradiance, or an integral of it.
    pub mean: f64,
    /// Square of the standard error of the mean.
    pub variance: f64,
}

impl Value {
    /// Adds a share of a value with a standard error of its own.
    pub(super) fn add(&mut self, share: f64, mean: f64, error: f64) {
        self.mean += share * mean;
        self.variance += (share * error).powi(2);
    }

    /// Returns the value and its standard error.
    pub(super) fn pair(self) -> [f32; 2] {
        [self.mean as f32, self.variance.max(0.0).sqrt() as f32]
    }

    pub(super) fn of_pair([mean, error]: [f32; 2]) -> Self {
        Self { mean: f64::from(mean), variance: f64::from(error).powi(2) }
    }
}

/// The values of captors and groups in an hour, a day, a month or the whole period.
#[derive(Clone, Debug)]
pub struct Values<'y> {
    pub(super) places: &'y Places,
    pub(super) values: Vec<[f32; 2]>,
    /// For each id its place among the values.
    pub(super) place: Option<&'y [Option<usize>]>,
}

impl Values<'_> {
    /// Returns the light of a channel of an id, by its index, in a band or sum: irradiance or an
    /// integral of it, and for absorbed light the same per area. `None` if the id does not count
    /// the channel, or its hours were not asked for.
    pub fn light(&self, id: usize, channel: Channel, band: usize) -> Option<Value> {
        self.light_pair(id, channel, band).map(Value::of_pair)
    }

    /// Returns the ratio with this index of the light of a channel of an id. `None` if the id does not
    /// count the channel, or nothing arrived that it could be divided by.
    pub fn ratio(&self, id: usize, channel: Channel, ratio: usize) -> Option<Value> {
        let first = self.places.columns - RATIO * (self.places.ratios.len() - ratio);
        let of = |part| self.light(id, channel, first + part);
        let (over, under, both) = (of(0)?, of(1)?, of(2)?);
        let covariance = 0.5 * (both.variance - over.variance - under.variance);
        let covariance = [over.variance, covariance, under.variance];
        let (mean, error) = stats::ratio([over.mean, under.mean], Some(covariance))?;
        // the number of equal histories by which what is divided by would be known as well
        let histories = (under.mean * under.mean / under.variance) as u64;
        let error = stats::error_of_ratio(mean, error.unwrap_or(0.0), histories);
        Some(Value { mean, variance: error.powi(2) })
    }

    /// Returns the fraction of the area of an id that has a straight path to the sun, on average
    /// over the time in which the sun shines. `None` if it does not shine.
    pub fn sunlit(&self, id: usize) -> Option<Value> {
        self.own(id)
    }

    /// Returns the value of [`OWN`], if it has one.
    pub(super) fn own(&self, id: usize) -> Option<Value> {
        self.own_pair(id).map(Value::of_pair)
    }

    /// Returns the same as [`light`](Self::light), as a value and its standard error.
    pub(super) fn light_pair(&self, id: usize, channel: Channel, band: usize) -> Option<[f32; 2]> {
        let counts = self.places.has(id, channel);
        let at = self.first(id)? + channel as usize * self.places.columns + band;
        counts.then(|| self.values[at])
    }

    /// Returns the same as [`sunlit`](Self::sunlit), as a value and its standard error.
    pub(super) fn own_pair(&self, id: usize) -> Option<[f32; 2]> {
        let pair = self.values[self.first(id)? + self.places.light()];
        (!pair[0].is_nan()).then_some(pair)
    }

    fn first(&self, id: usize) -> Option<usize> {
        let place = self.place.map_or(Some(id), |places| places[id])?;
        Some(place * self.places.row())
    }
}
