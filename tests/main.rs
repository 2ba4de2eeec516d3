//! The tests of whole runs, in one binary.

mod check;
mod common;
mod floors;
