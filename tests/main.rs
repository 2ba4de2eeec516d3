//! The tests of whole runs, in one binary.

mod bad_input;
mod by_light;
mod bytes;
mod check;
mod closed_forms;
mod common;
mod compare;
mod contract;
mod coverage;
mod exact;
mod exhibit;
mod floors;
mod invariance;
mod nearest;
mod nearest_study;
mod output;
mod paths;
mod render;
mod shards;
mod stability;
mod study;
mod surfaces;
mod sweep;
mod truths;
mod view;
mod world;
