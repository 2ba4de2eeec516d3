//! Light in a scene: from a scene in memory to sums of what its captors receive.
//!
//! In the order in which light meets them: [`scene`] (surfaces, lights, captors, and the ray
//! kernel that finds them), [`transport`] (photons, paths, tallies, photon maps, runs), both over
//! [`math`] (vectors, random streams, statistics) and [`error`]. A module uses only those above it:
//! `error`, `math`, `scene`, `transport`. Nothing here reads or writes files (Clippy
//! refuses it, by `clippy.toml`), but for what Linux tells of the memory that is left.
//!
//! The crate `phylux` names what programs are promised of it.

#![deny(unsafe_code)]

pub mod error;

pub mod math;

pub mod scene;

pub mod transport;
