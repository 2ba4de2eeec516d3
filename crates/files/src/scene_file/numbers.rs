//! Checks numbers against their ranges, and values that have one number per band.

use super::{loader::Loader, spec::PerBand};
use phylux_core::error::{Result, check_length, check_range};

impl Loader<'_> {
    /// Refuses a number outside the closed range from `low` to `high`.
    pub(super) fn in_range(&self, pointer: &str, value: f64, low: f64, high: f64) -> Result<()> {
        check_range(value, low, high).map_err(|problem| problem.at(self.place(pointer)))
    }

    /// Returns one number per band, each from 0 to `high`; a spectrum is averaged over each band.
    pub(super) fn per_band(&self, pointer: &str, values: &PerBand, high: f64) -> Result<Vec<f64>> {
        match values {
            PerBand::All(value) => {
                self.in_range(pointer, *value, 0.0, high)?;
                Ok(vec![*value; self.bands()])
            }
            PerBand::Each(values) => {
                check_length(values.len(), self.bands()).map_err(|p| p.at(self.place(pointer)))?;
                for (i, value) in values.iter().enumerate() {
                    self.in_range(&format!("{pointer}/{i}"), *value, 0.0, high)?;
                }
                Ok(values.clone())
            }
            PerBand::Spectrum(spectrum) => self.average(pointer, spectrum, high),
        }
    }
}

/// Converts numbers to single precision.
pub(super) fn single(values: &[f64]) -> Vec<f32> {
    values.iter().map(|v| *v as f32).collect()
}
