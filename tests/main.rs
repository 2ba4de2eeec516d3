//! The tests of whole runs, in one binary.

mod common;
mod floors;
