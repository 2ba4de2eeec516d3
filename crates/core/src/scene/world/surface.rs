//! What the photon loop needs of a triangle of a surface, and how far points are kept from its edges.

use glam::{DVec3, Vec3};

use crate::{
    math::geometry::{POINT, Ray, Triangle, across},
    scene::bvh::Hit,
};

/// Width of the margins of a triangle in which hits are looked at closely, in bounds of the error of
/// its points.
pub(super) const MARGINS: f32 = 4.0;

/// Distance of points from the edges of their triangle in ray offsets, besides the error of a point
/// along the triangle. A ray that leaves one of two faces close to their common edge then starts
/// inside the other if they meet at more than some 15 degrees.
const OFF_EDGES: f32 = 6.0;

/// The properties of one triangle of a surface that the photon loop needs.
#[derive(Clone, Copy, Debug)]
pub struct Surface {
    /// Unit normal of the front.
    pub normal: Vec3,
    /// Index of the material.
    pub material: u32,
    pub(super) captor: u32,
    /// What the way into the coordinates of a copy or of another cell adds to the distance from the
    /// triangle at which rays that leave it start, m.
    pub(super) extra_offset: f32,
    /// The largest change of a barycentric weight that a movement of
    /// [`ROUNDING`](crate::math::geometry::ROUNDING) times the distance 1 m makes.
    pub steepest: f32,
    /// The bound of the error of the triangle's points, over
    /// [`ROUNDING`](crate::math::geometry::ROUNDING), m.
    pub reach: f32,
}

pub(super) const NO_CAPTOR: u32 = u32::MAX;

impl Surface {
    /// Returns the index of the triangle's captor, if it is part of one.
    #[inline]
    pub fn captor(&self) -> Option<usize> {
        (self.captor != NO_CAPTOR).then_some(self.captor as usize)
    }

    /// Returns false where a hit is surely far enough from all edges of this triangle for the errors
    /// of the triangle's points and of a ray that comes from afar. It takes less time than to look at
    /// each edge.
    #[inline]
    pub(super) fn may_be_near_edge(&self, hit: &Hit) -> bool {
        let weights = Vec3::new(1.0 - hit.u - hit.v, hit.u, hit.v);
        weights.min_element() < self.steepest * (MARGINS * (self.reach + hit.t))
    }

    /// Returns the distance from the triangle at which rays that leave it at a point start, m: the
    /// bound of the error of the point and of the start of the ray across the triangle.
    #[inline(always)]
    pub fn offset_at(&self, point: Vec3) -> f32 {
        self.extra_offset + POINT * across(self.normal, point)
    }

    /// Returns the ray that leaves the triangle at a point. It starts off the surface, on the side of
    /// the unit normal `side`, by the error of the point.
    #[inline(always)]
    pub(super) fn leave(&self, point: Vec3, side: Vec3, direction: Vec3) -> Ray {
        Ray { origin: point + self.offset_at(point) * side, direction }
    }

    /// Returns a point of `triangle`, which is the surface's, rounded and moved inwards from edges
    /// that are nearer than its error: a point that rounding has put beyond the edge of a closed mesh
    /// would let light through its corner.
    pub(super) fn off_edges(&self, triangle: &Triangle, point: DVec3) -> Vec3 {
        triangle.off_edges(point, |point| self.apart(point))
    }

    /// Returns the distance of a point from the edges of the triangle, besides the error of the point
    /// along it, m.
    pub fn apart(&self, point: Vec3) -> f32 {
        OFF_EDGES * self.offset_at(point)
    }
}
