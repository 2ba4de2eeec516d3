//! The tests of whole runs, in one binary.

mod bad_input;
mod check;
mod common;
mod contract;
mod floors;
mod output;
