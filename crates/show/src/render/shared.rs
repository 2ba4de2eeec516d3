//! Photon estimates that the rays of one pixel share.

use glam::Vec3;

use phylux_core::scene::world::SurfaceHit;

/// The largest distance between points that share an estimate, in pixels.
pub(super) const PIXELS: f32 = 2.0;

/// The estimates that the rays of one pixel have made so far, for others that come to the same
/// place.
#[derive(Default)]
pub(super) struct Shared(Vec<Found>);

struct Found {
    triangle: usize,
    front: bool,
    point: Vec3,
    value: Vec<f64>,
}

impl Shared {
    /// Returns the value, per band, that was found within `reach` (m) of a hit on the same side of
    /// the same triangle; where there is none, calls `find` for it and keeps the result.
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
