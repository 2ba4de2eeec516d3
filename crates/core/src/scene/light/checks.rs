//! Checks of what several kinds of lights have.

use glam::DVec3;

use crate::{
    error::{Checked, Problem, check_length, check_range, number},
    math::geometry::unit_vector,
};

/// Range of powers above 0 that single precision can carry, W or umol/s.
const POWERS: std::ops::RangeInclusive<f64> = 1e-30..=1e30;

/// Checks the powers of a light, W or umol/s. Error: there is not one for each of `bands` bands, or
/// one is negative or beyond what single precision can carry.
pub fn check_power(power: &[f64], bands: usize) -> Checked {
    check_length(power.len(), bands).map_err(|problem| problem.of("power"))?;
    power.iter().try_for_each(|&power| {
        check_range(power, 0.0, f64::MAX).map_err(|problem| problem.of("power"))?;
        if power == 0.0 || POWERS.contains(&power) {
            return Ok(());
        }
        let problem = format!("emits {} W or umol/s in a band", number(power));
        Err(Problem::new(problem, "it must be 0, or from 1e-30 to 1e30"))
    })
}

/// Returns the unit vector along the axis of a spot. Error: its length is 0.
pub fn check_direction(direction: DVec3) -> Checked<DVec3> {
    unit_vector(direction).ok_or_else(|| {
        let remedy = "say where the spot points: [0, 0, -1] is down";
        Problem::new("a direction of length 0", remedy)
    })
}
