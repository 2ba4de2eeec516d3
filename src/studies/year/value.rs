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
    pub(super) fn add(&mut self, share: f64, mean: f32, error: f32) {
        self.mean += share * f64::from(mean);
        self.variance += (share * f64::from(error)).powi(2);
    }
}
