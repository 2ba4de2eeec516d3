//! The step that all who follow rays share: to the nearest surface, and on from there.

use glam::Vec3;

use super::{Scene, Surface, SurfaceHit};
use crate::{
    math::geometry::Ray,
    scene::material::{Interaction, LobeKind, Material},
};

/// The arrival of a ray at a surface.
#[derive(Clone, Copy, Debug)]
pub struct Arrived<'s> {
    /// The point, and the index of the triangle.
    pub hit: SurfaceHit,
    /// The surface to which the triangle belongs.
    pub surface: Surface,
    /// The material of the surface.
    pub material: &'s Material,
    /// The direction from which the ray arrives, and the face.
    pub interaction: Interaction,
}

impl Scene {
    /// Follows a ray to the nearest surface. `None` if it meets none.
    #[inline(always)]
    pub fn arrive(&self, ray: &Ray) -> Option<Arrived<'_>> {
        self.closest(ray).map(|hit| self.arrived(hit, ray.direction))
    }

    /// Returns what a ray of this direction, a unit vector, finds where it meets a surface.
    #[inline(always)]
    pub fn arrived(&self, hit: SurfaceHit, direction: Vec3) -> Arrived<'_> {
        let surface = self.surface_at(&hit);
        let interaction = Interaction::new(direction, surface.normal).on(hit.triangle);
        Arrived { hit, surface, material: self.material(&surface), interaction }
    }
}

impl Arrived<'_> {
    /// Returns the interaction of a ray that comes to the same point along another direction, a
    /// unit vector.
    #[inline(always)]
    pub fn along(&self, direction: Vec3) -> Interaction {
        Interaction::new(direction, self.surface.normal).on(self.hit.triangle)
    }

    /// Returns the unit normal of the triangle on the side that the ray comes from.
    #[inline(always)]
    pub fn facing(&self) -> Vec3 {
        if self.interaction.front { self.surface.normal } else { -self.surface.normal }
    }

    /// Returns the lobe by which light is scattered between the way on which the ray comes and a
    /// direction, a unit vector.
    #[inline(always)]
    pub fn scattered(&self, direction: Vec3) -> LobeKind {
        LobeKind::diffuse(direction.dot(self.facing()) < 0.0)
    }

    /// Returns the ray that goes on from here by a lobe of the material, in this direction, a unit
    /// vector. It starts off the surface by the error of the point.
    #[inline(always)]
    pub fn leave(&self, lobe: LobeKind, direction: Vec3) -> Ray {
        let normal = self.facing();
        let side = if lobe.crosses() { -normal } else { normal };
        self.surface.leave(self.hit.point, side, direction)
    }
}
