//! Mathematics without any notion of light.
//!
//! Read `rng` and `sampling` first: every estimator draws from the random streams and samplers
//! with their densities that these define. `geometry` holds vectors and frames, `spectrum`
//! numbers per band, `stats` means with standard errors, `curve` measured curves,
//! `least_squares` fits, `linear_program` least costs, `units` units, `luminosity` lumens,
//! `phytochrome` its cross-sections and `weighting` what plants make of a wavelength. `machine` says how many processors and how much memory there are.
//! `pattern` and `expression` read patterns of names and arithmetic expressions.
//!
//! Whatever needs to know about a light, a surface or a photon belongs to a later module.

pub(crate) mod curve;
pub(crate) mod expression;
pub(crate) mod geometry;
pub(crate) mod least_squares;
pub(crate) mod linear_program;
pub(crate) mod luminosity;
pub(crate) mod machine;
#[cfg(test)]
pub(crate) mod odds;
pub(crate) mod pattern;
pub(crate) mod phytochrome;
pub(crate) mod rng;
pub(crate) mod sampling;
pub(crate) mod spectrum;
pub(crate) mod stats;
pub(crate) mod units;
pub(crate) mod weighting;

pub use curve::Curve;
pub use geometry::{Extent, Frame, Ray, Transform, Triangle};
pub use rng::Stream;
pub use spectrum::{Lanes, Spectrum, Wide};
pub use stats::{Estimate, Running};
pub use units::{LengthUnit, Quantity, UnitNames};
pub use weighting::WeightedUnit;
