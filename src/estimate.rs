//! Estimates at captors and on surfaces from what a run has collected.

pub mod nearest;
pub mod paths;
pub mod surface;
