//! Results: the numbers that a run has found, with standard errors.
//!
//! Read [`result`] first: it makes results from sums, groups them, rescales lamps and warns.
//! [`flat`] holds the same numbers as arrays, [`saved`] results that were read from a file.
//! [`compare`] compares two results. [`calibration`] holds factors on the powers of lamps that were
//! found from readings.
//!
//! Nothing in this module reads or writes files.

pub mod calibration;
pub mod compare;
pub mod flat;
pub mod result;
pub mod saved;
