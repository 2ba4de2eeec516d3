//! Mathematics without any notion of light.
//!
//! Read `rng` and `sampling` first: every estimator draws from the random streams and samplers
//! with their densities that these define. `geometry` holds vectors and frames, `round` discs and
//! spheres, `spectrum` numbers per band, `stats` means with standard errors, `curve` measured
//! curves, `least_squares` fits, `linear_program` least costs, `units` units, `luminosity` lumens,
//! `phytochrome` its cross-sections and `weighting` what plants make of a wavelength. `machine` says
//! how many processors and how much memory there are, and `effort` counts work. `pattern` and
//! `expression` read patterns of names and arithmetic expressions.
//!
//! Whatever needs to know about a light, a surface or a photon belongs to a later module.

pub mod curve;
pub mod effort;
pub mod expression;
pub mod geometry;
pub mod least_squares;
pub mod linear_program;
pub mod luminosity;
pub mod machine;
#[cfg(test)]
pub mod odds;
pub mod pattern;
pub mod phytochrome;
pub mod rng;
pub mod round;
pub mod sampling;
pub mod spectrum;
pub mod stats;
pub mod units;
pub mod weighting;

pub use curve::Curve;
pub use geometry::{Extent, Frame, Ray, Transform, Triangle};
pub use rng::Stream;
pub use spectrum::{Lanes, Spectrum, Wide};
pub use stats::{Estimate, Running};
pub use units::{LengthUnit, Quantity, UnitNames};
pub use weighting::WeightedUnit;
