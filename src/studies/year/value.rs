//! Values of a year with their errors.

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
