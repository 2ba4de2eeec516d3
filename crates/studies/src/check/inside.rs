//! Whether a point is inside a closed object.

use glam::Vec3;

use phylux_core::{math::geometry::Ray, scene::world::Scene};

/// After this many crossings a ray is assumed to have left all objects.
const MOST_CROSSINGS: usize = 1000;

/// Returns whether a point is in a closed object: every ray from there crosses the object's surface
/// an odd number of times.
pub(super) fn is_in(scene: &Scene, point: Vec3, object: usize) -> bool {
    let ways =
        [[0.3, 0.5, 0.8], [-0.7, 0.2, 0.4], [0.1, -0.9, -0.2], [-0.4, -0.3, 0.6], [0.8, 0.1, -0.5]];
    ways.map(Vec3::from).into_iter().all(|way| {
        let direction = way.normalize();
        let (mut ray, mut crossings) = (Ray { origin: point, direction }, 0);
        for _ in 0..MOST_CROSSINGS {
            let Some(hit) = scene.closest(&ray) else { break };
            crossings += usize::from(scene.object(hit.triangle) == Some(object));
            ray = scene.pass(&hit, direction);
        }
        crossings % 2 == 1
    })
}
