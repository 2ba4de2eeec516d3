//! Whether the lists of results are whole.

use phylux_core::math::stats::is_possible;

/// Returns whether these are values of so many bands.
pub fn are_values(values: &[f64], bands: usize) -> bool {
    values.len() == bands && values.iter().all(|value| is_possible(*value))
}

/// Returns whether these are standard errors of so many bands, some of which may be unknown.
pub fn are_errors(errors: &[Option<f64>], bands: usize) -> bool {
    errors.len() == bands && errors.iter().flatten().all(|error| is_possible(*error))
}
