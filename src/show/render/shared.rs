//! Estimates that rays of one pixel share.

use glam::Vec3;

use crate::scene::world::SurfaceHit;

/// How far apart, in pixels, points may be that share an estimate.
pub(super) const PIXELS: f32 = 2.0;

/// What rays of one pixel have found, for others that come to the same place.
#[derive(Default)]
pub(super) struct Shared(Vec<Found>);

struct Found {
    triangle: usize,
    front: bool,
    point: Vec3,
    value: Vec<f64>,
}

impl Shared {
    /// What was found within `reach` of a hit on the same side of its triangle, or else `find`s it.
    pub fn value(
        &mut self,
        hit: &SurfaceHit,
        front: bool,
        reach: f32,
        find: impl FnOnce() -> Vec<f64>,
    ) -> &[f64] {
        let near = |found: &Found| {
            found.triangle == hit.triangle
                && found.front == front
                && found.point.distance_squared(hit.point) <= reach * reach
        };
        let index = self.0.iter().position(near).unwrap_or_else(|| {
            let (triangle, point) = (hit.triangle, hit.point);
            self.0.push(Found { triangle, front, point, value: find() });
            self.0.len() - 1
        });
        &self.0[index].value
    }
}
