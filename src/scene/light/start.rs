//! Where on a light a photon starts, and with which density it leaves in a direction.

use std::f32::consts::PI;

use glam::Vec3;

use super::{Emitter, Light, illuminate::versine_between};
use crate::math::{geometry::Ray, sampling::cosine_hemisphere_density};

/// Place on a light that a photon starts from.
#[derive(Clone, Copy, Debug)]
pub struct Start {
    /// Position, m.
    pub point: Vec3,
    /// Unit normal of the side that the photon leaves from, or zero for a point or a line.
    pub normal: Vec3,
    /// Distance from the surface at which the photon starts, m.
    pub offset: f32,
    /// Whether photons leave from this place to both sides.
    pub both_sides: bool,
}

impl Start {
    /// Makes a place without a surface, and a ray from it.
    #[inline]
    pub(super) fn of_point(point: Vec3, direction: Vec3) -> (Self, Ray) {
        let start = Self { point, normal: Vec3::ZERO, offset: 0.0, both_sides: true };
        (start, Ray { origin: point, direction })
    }
}

impl Light {
    /// Returns the density, 1/sr, with which a photon of [`emit`](Self::emit) that starts at this
    /// place and side leaves along a unit vector; 0 for a light at infinity.
    pub fn density(&self, start: &Start, direction: Vec3) -> f32 {
        match &self.emitter {
            Emitter::Cone { frame, versine, .. } => {
                let inside = versine_between(frame.normal, direction) <= *versine;
                if inside { 1.0 / (2.0 * PI * versine) } else { 0.0 }
            }
            Emitter::IsotropicLine(_) => 0.25 / PI,
            Emitter::Tube { .. } | Emitter::Area { .. } => {
                cosine_hemisphere_density(start.normal.dot(direction))
            }
            Emitter::Luminaire { intensity, .. } | Emitter::LuminaireArea { intensity, .. } => {
                intensity.towards(direction)
            }
            Emitter::Infinite(_) => 0.0,
        }
    }
}
