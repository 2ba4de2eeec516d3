//! What a run found, in numbers with standard errors: [`result`] makes them from sums, groups them,
//! rescales lamps and warns; [`flat`] has them as arrays; [`calibration`] has factors on lamps found from readings; [`saved`] is what is known of results that come from a file, and
//! [`compare`] sets two of them side by side. Nothing here reads or writes.

pub mod calibration;
pub mod compare;
pub mod flat;
pub mod result;
pub mod saved;
