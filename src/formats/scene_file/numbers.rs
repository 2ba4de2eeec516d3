//! Numbers in their ranges, one for each band.

use super::{Loader, Result, format::PerBand};
use crate::{error::number, math::spectrum::lanes};

impl Loader<'_> {
    /// Refuses a number outside [`low`, `high`].
    pub(super) fn in_range(&self, pointer: &str, value: f64, low: f64, high: f64) -> Result<()> {
        if (low..=high).contains(&value) {
            return Ok(());
        }
        let range = match high {
            f64::MAX => format!("at least {low}"),
            _ => format!("from {low} to {high}"),
        };
        let error = self.error(pointer, format!("{}, must be {range}", number(value)));
        Err(if high == 1.0 && value > 1.0 { error.remedy("75 % is 0.75") } else { error })
    }

    /// One number per band, each in [0, `high`].
    pub(super) fn per_band(&self, pointer: &str, values: &PerBand, high: f64) -> Result<Vec<f64>> {
        match values {
            PerBand::All(value) => {
                self.in_range(pointer, *value, 0.0, high)?;
                Ok(vec![*value; self.bands])
            }
            PerBand::Each(values) if values.len() == self.bands => {
                for (i, value) in values.iter().enumerate() {
                    self.in_range(&format!("{pointer}/{i}"), *value, 0.0, high)?;
                }
                Ok(values.clone())
            }
            PerBand::Each(values) => {
                let s = if self.bands == 1 { "" } else { "s" };
                let problem = format!("{} numbers for {} band{s}", values.len(), self.bands);
                Err(self.error(pointer, problem).remedy("give one number, or one per band"))
            }
        }
    }

    /// The same in single precision, padded to the lanes of the scene.
    pub(super) fn lanes(&self, values: &[f64]) -> Vec<f32> {
        let mut padded: Vec<f32> = values.iter().map(|v| *v as f32).collect();
        padded.resize(lanes(self.bands), 0.0);
        padded
    }
}
