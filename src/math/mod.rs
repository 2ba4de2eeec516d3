//! Mathematics that knows nothing of light: vectors and frames ([`geometry`]), random streams ([`rng`]),
//! samplers with their densities ([`sampling`]), numbers per band ([`spectrum`]), means with standard
//! errors ([`stats`]), fits ([`least_squares`]) and units ([`units`]); what the machine has to give for it
//! ([`machine`]), patterns of names ([`pattern`]) and expressions of numbers ([`expression`]).
//!
//! Read `rng` and `sampling` first: every estimator draws from them. What knows a light, a surface or a
//! photon belongs to a later module.

pub mod curve;
pub mod expression;
pub mod geometry;
pub mod least_squares;
pub mod machine;
#[cfg(test)]
pub mod odds;
pub mod pattern;
pub mod rng;
pub mod sampling;
pub mod spectrum;
pub mod stats;
pub mod units;
