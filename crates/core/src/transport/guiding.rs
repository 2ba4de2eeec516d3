//! Guiding: photons are helped to captors that light hardly reaches.
//!
//! Wherever a photon starts or is scattered diffusely, one more flight is sent from there,
//! [aimed](Aimed) at one of the virtual [captors](Targets). It counts at the captors that it
//! crosses and is followed no further than the next diffuse surface.
//!
//! [`Importance`] says how much light at a place matters to the captors. Where importance is large,
//! a photon goes on as several; where it is small, a photon goes on only now and then. [`Guided`]
//! does both. Importance is learned from [importons](learn) before the run.
//!
//! [`Lamps`] emit more photons where and in the directions in which they matter.
//!
//! Whatever steers a photon also changes its weight by one over the chance, so that the mean stays
//! the same.
//!
//! Reading order: `targets` and `aimed` (flights at captors), `importance`, `cells` and `importons`
//! (how importance is learned), `guided` (what it does to a photon), `emission` (lamps). What is
//! learned, and when, is decided in `simulate`, not here.

mod aimed;
mod cells;
mod emission;
mod guided;
mod importance;
mod importons;
mod targets;
#[cfg(test)]
mod tests;

pub use aimed::Aimed;
pub use cells::Cells;
pub use emission::{EmissionTree, Lamps, Sample, emit_at};
pub use guided::{Guidance, Guided, Windows};
pub use importance::Importance;
pub use importons::{Sources, learn};
pub use targets::{Targets, too_small_to_aim_at};
