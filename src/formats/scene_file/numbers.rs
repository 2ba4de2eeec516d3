//! Numbers in their ranges, one for each band.

use super::{format::PerBand, loader::Loader};
use crate::error::{Result, check_length, check_range};

impl Loader<'_> {
    /// Refuses a number outside [`low`, `high`].
    pub(super) fn in_range(&self, pointer: &str, value: f64, low: f64, high: f64) -> Result<()> {
        check_range(value, low, high).map_err(|problem| problem.at(self.place(pointer)))
    }

    /// One number per band, each in [0, `high`].
    pub(super) fn per_band(&self, pointer: &str, values: &PerBand, high: f64) -> Result<Vec<f64>> {
        match values {
            PerBand::All(value) => {
                self.in_range(pointer, *value, 0.0, high)?;
                Ok(vec![*value; self.bands])
            }
            PerBand::Each(values) => {
                check_length(values.len(), self.bands).map_err(|p| p.at(self.place(pointer)))?;
                for (i, value) in values.iter().enumerate() {
                    self.in_range(&format!("{pointer}/{i}"), *value, 0.0, high)?;
                }
                Ok(values.clone())
            }
            PerBand::Spectrum(spectrum) => self.average(pointer, spectrum, high),
        }
    }
}

/// The same in single precision.
pub(super) fn single(values: &[f64]) -> Vec<f32> {
    values.iter().map(|v| *v as f32).collect()
}
