//! Photons on their way to captors that light hardly reaches.
//!
//! Wherever a photon starts or is scattered diffusely, one more flight is sent from there, [aimed](Aimed) at one of
//! the virtual [captors](Targets). It counts at the captors that it crosses and is followed no further than the next
//! diffuse surface, so that the photon's own way, and what surfaces and the ledger count, stay what they are.

mod aimed;
mod targets;
#[cfg(test)]
mod tests;

pub use aimed::Aimed;
pub use targets::Targets;
