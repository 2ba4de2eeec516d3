//! Photons on their way to captors that light hardly reaches.
//!
//! Wherever a photon starts or is scattered diffusely, one more flight is sent from there, [aimed](Aimed) at one of
//! the virtual [captors](Targets). It counts at the captors that it crosses and is followed no further than the next
//! diffuse surface.
//!
//! [`Importance`] says how much light at a place matters to the captors. Where it is large a photon goes on as several,
//! where it is small only now and then: [`Guided`] does that. It is learned from [importons](learn), before the run.
//!
//! [`Lamps`] emit more of what matters there.
//!
//! All that steers a photon is a weight times a chance, so that the mean stays what it is.

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
pub use targets::Targets;
