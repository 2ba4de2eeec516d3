//! The convex hull of measured points: does a place lie among them?

use glam::DVec3;

/// Number of directions in which the hull is bounded, besides the axes.
const DIRECTIONS: usize = 200;
/// Fraction of the size of the hull by which a place may lie outside.
const SLACK: f64 = 0.01;

/// A convex hull that contains some points, as their farthest extent in each of many directions.
pub struct Hull {
    reach: Vec<(DVec3, f64)>,
}

impl Hull {
    /// Computes the hull of points, m.
    pub fn new(points: impl Iterator<Item = DVec3> + Clone) -> Self {
        // directions on a spiral of equal areas on the sphere
        let turn = std::f64::consts::PI * (3.0 - 5f64.sqrt());
        let spiral = (0..DIRECTIONS).map(|i| {
            let z = 1.0 - (2 * i + 1) as f64 / DIRECTIONS as f64;
            let (sin, cos) = (turn * i as f64).sin_cos();
            DVec3::new(cos, sin, 0.0) * (1.0 - z * z).sqrt() + DVec3::Z * z
        });
        let axes = [DVec3::X, DVec3::Y, DVec3::Z].into_iter().flat_map(|axis| [axis, -axis]);
        let (low, high) = points
            .clone()
            .fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(l, h), p| (l.min(p), h.max(p)));
        let slack = SLACK * (high - low).length();
        let reach = |direction: DVec3| {
            let far = points.clone().map(|p| direction.dot(p)).fold(f64::NEG_INFINITY, f64::max);
            (direction, far + slack)
        };
        Self { reach: axes.chain(spiral).map(reach).collect() }
    }

    /// Returns whether a point is inside the hull.
    pub fn holds(&self, point: DVec3) -> bool {
        self.reach.iter().all(|(direction, reach)| direction.dot(point) <= *reach)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_plane_of_points_holds_what_is_among_them() {
        let corners = [[0.0, 0.0, 1.0], [2.0, 0.0, 1.0], [0.0, 2.0, 1.0]].map(DVec3::from);
        let hull = Hull::new(corners.into_iter());
        for inside in [[0.5, 0.5, 1.0], [0.0, 0.0, 1.0], [1.0, 1.0, 1.0]] {
            assert!(hull.holds(inside.into()));
        }
        for outside in [[1.5, 1.5, 1.0], [0.5, 0.5, 1.2], [-0.2, 0.5, 1.0]] {
            assert!(!hull.holds(outside.into()));
        }
    }
}
