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

use glam::Vec3;

use super::{BsdfSample, Checked, Interaction, Transport};
use crate::math::{
    rng::Stream,
    spectrum::{Lanes, Spectrum},
};

/// A measured thin sheet.
#[derive(Clone, Debug, PartialEq)]
pub enum Table {
    /// Fractions that go straight on, are scattered and are mirrored, by the angle of incidence.
    Cover(Cover),
    /// Scattering function of both directions.
    Bsdf(Box<Bsdf>),
}

impl Table {
    pub(super) fn check(&self, names: &[&str]) -> Checked {
        match self {
            Self::Cover(table) => table.check(names),
            Self::Bsdf(table) => table.check(names),
        }
    }

    pub(super) fn pad(&mut self, lanes: usize) {
        match self {
            Self::Cover(table) => table.pad(lanes),
            Self::Bsdf(table) => table.pad(lanes),
        }
    }

    pub(super) fn needs_tangents(&self) -> bool {
        matches!(self, Self::Bsdf(table) if table.needs_tangents())
    }

    pub(super) fn set_tangents(&mut self, tangents: Vec<(u32, Vec3)>) {
        if let Self::Bsdf(table) = self {
            table.set_tangents(tangents);
        }
    }

    #[inline(never)]
    pub(super) fn sample<L: Lanes>(
        &self,
        at: &Interaction,
        transport: Transport,
        rng: &mut Stream,
    ) -> Option<BsdfSample<L>> {
        match self {
            Self::Cover(table) => table.sample(at, transport, rng),
            Self::Bsdf(table) => table.sample(at, transport, rng),
        }
    }

    pub(super) fn evaluate<L: Lanes>(&self, at: &Interaction, outgoing: Vec3) -> Spectrum<L> {
        match self {
            Self::Cover(table) => table.evaluate(at, outgoing),
            Self::Bsdf(table) => table.evaluate(at, outgoing),
        }
    }

    pub(super) fn pdf(&self, at: &Interaction, transport: Transport, outgoing: Vec3) -> f32 {
        match self {
            Self::Cover(table) => table.pdf(at, transport, outgoing),
            Self::Bsdf(table) => table.pdf(at, transport, outgoing),
        }
    }

    pub(super) fn absorptance<L: Lanes>(&self, at: &Interaction) -> Spectrum<L> {
        match self {
            Self::Cover(table) => table.absorptance(at),
            Self::Bsdf(table) => table.absorptance(at),
        }
    }

    /// Returns the mirrored and the straight direction, each with the fraction that it carries.
    pub(super) fn ways<L: Lanes>(&self, at: &Interaction) -> [Option<BsdfSample<L>>; 2] {
        match self {
            Self::Cover(table) => table.ways(at),
            Self::Bsdf(_) => [None, None],
        }
    }

    /// Returns the fraction per band that goes straight on.
    pub(super) fn straight<L: Lanes>(&self, at: &Interaction) -> Spectrum<L> {
        match self {
            Self::Cover(table) => table.straight(at),
            Self::Bsdf(table) => table.nothing(),
        }
    }

    pub(super) fn passes_straight(&self) -> bool {
        match self {
            Self::Cover(table) => table.passes_straight(),
            Self::Bsdf(_) => false,
        }
    }

    pub(super) fn has_mirror(&self) -> bool {
        match self {
            Self::Cover(table) => table.has_mirror(),
            Self::Bsdf(_) => false,
        }
    }

    pub(super) fn is_diffuse(&self) -> bool {
        match self {
            Self::Cover(table) => table.is_diffuse(),
            Self::Bsdf(_) => true,
        }
    }

    pub(super) fn transmits_diffusely(&self) -> bool {
        match self {
            Self::Cover(table) => table.is_diffuse(),
            Self::Bsdf(table) => table.transmits(),
        }
    }
}
