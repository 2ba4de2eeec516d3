//! Tests of whole runs, all in one test binary. They use the library's public interface or the
//! program itself.
//!
//! `closed_forms` compares scenes with exact solutions, `random_scenes` compares photons with
//! paths, and most other modules test one command or one promise of the documentation. `common`,
//! `world` and `exact` hold what the tests share.

mod bad_input;
mod blotches;
mod bright_spots;
mod by_light;
mod bytes;
mod calibrate;
mod check;
mod check_copies;
mod checkpoint;
mod closed_forms;
mod coming_from;
mod common;
mod compare;
mod complete;
mod contract;
mod copies;
mod coverage;
mod daylight;
mod edges;
mod electricity;
mod exact;
mod examples;
mod figures;
mod grazing;
mod guiding;
mod hard_to_reach;
mod histories;
mod in_memory;
mod interrupts;
mod invariance;
mod layers;
mod manners;
mod many_lights;
mod masks;
mod merged;
mod mesh_files;
mod meshes_in_memory;
mod mixed;
mod names;
mod nearest;
mod nearest_study;
mod output;
mod own_files;
mod pages;
mod paths;
mod periodic;
mod photometry;
mod pinned;
mod plot;
mod processes;
mod rad;
mod random_scenes;
mod render;
mod rendered;
mod sensitivity;
mod sensors;
mod shards;
mod site;
mod spectra;

mod stability;
mod study;
mod sums;
mod surfaces;
mod sweep;
mod tables;
mod tints;
mod tolerance;
mod truths;
mod uncertain;
mod view;
mod world;
mod year;
