//! Estimates at captors from what a run has collected.

pub mod nearest;
pub mod paths;
