//! Thin sheets as they were measured: covers, whose transmittance is known at some angles of
//! incidence (`cover`), and scattering functions, known for pairs of directions (`bsdf`).
//!
//! A scattering function is made of four parts at most (`part`): reflection and transmission of
//! light on either face. `basis` holds the functions of direction that its values belong to.

mod basis;
mod bsdf;
mod cover;
mod part;

pub use basis::Basis;
pub use bsdf::{Bsdf, BsdfFaces, FaceValues};
pub use cover::{Cover, CoverRow};
pub use part::PairValues;

use enum_dispatch::enum_dispatch;

/// A measured thin sheet.
#[enum_dispatch(Scatterer)]
#[derive(Clone, Debug, PartialEq)]
pub enum Table {
    /// Fractions that go straight on, are scattered and are mirrored, by the angle of incidence.
    Cover(Cover),
    /// Scattering function of both directions.
    Bsdf(Bsdf),
}
