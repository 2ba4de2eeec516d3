//! Triangles that light leaves from.

use std::sync::Arc;

use glam::{DVec3, Vec2, Vec3};

use super::shape::{Outline, Unplaced};
use crate::{
    error::{Checked, Problem},
    math::{
        geometry::{Extent, ROUNDING, Triangle, across, area},
        rng::Stream,
        sampling::{uniform_triangle, weighted_choice},
    },
};

/// Checks the total area of the triangles of a light. Error: it is 0.
pub fn check_area(area: f64) -> Checked {
    if area > 0.0 {
        return Ok(());
    }
    Err(Problem::new("an area light without area", "its corners must not lie on one line"))
}

/// Triangles of an area light, with the values that each photon needs of them.
#[derive(Clone, Debug, Default)]
pub(super) struct EmittingSurface {
    pub triangles: Vec<Triangle>,
    places: Vec<Place>,
    cumulative_area: Vec<f64>,
}

/// How photons leave a triangle of an area light.
#[derive(Clone, Copy, Debug)]
struct Place {
    /// Unit normal of the front.
    normal: Vec3,
    /// Barycentric weights below which a point is too near to the edge opposite each corner.
    margins: Vec3,
}

/// A point of a light with a surface.
pub(super) struct Chosen {
    pub point: Vec3,
    /// Unit normal of the front.
    pub normal: Vec3,
    /// Distance from the surface at which photons start, m.
    pub offset: f32,
}

impl Chosen {
    /// Returns the point at which a shadow ray of length `distance`, m, ends, on the side of `side`:
    /// off the surface by the error of the point and that of the ray's own end.
    #[inline]
    pub fn off(&self, side: Vec3, distance: f32) -> Vec3 {
        self.point + (self.offset + ROUNDING * distance) * side
    }
}

impl EmittingSurface {
    /// Makes a light of triangles, m, of which `emitter` makes an emitter once they are in a scene.
    /// Error: they have no area.
    pub fn of<E: 'static>(
        triangles: Vec<[DVec3; 3]>,
        emitter: impl Fn(Self) -> E + Send + Sync + 'static,
    ) -> Result<Unplaced<E>, Problem> {
        check_area(triangles.iter().map(area).sum())?;
        let triangles: Arc<[[DVec3; 3]]> = triangles.into();
        let outline = Outline::Triangles(triangles.clone());
        Ok(Unplaced::new(outline, move |center| emitter(Self::new(&triangles, center))))
    }

    /// Makes the surface of triangles, in coordinates relative to `center`.
    fn new(triangles: &[[DVec3; 3]], center: DVec3) -> Self {
        let mut surface = Self::default();
        let mut sum = 0.0;
        for corners in triangles {
            let triangle = Triangle::from(corners.map(|p| (p - center).as_vec3()));
            // a sliver that rounding has left without a front emits nothing
            if triangle.normal() != Vec3::ZERO {
                sum += area(corners);
                surface.cumulative_area.push(sum);
                surface.places.push(Place {
                    normal: triangle.normal(),
                    margins: Triangle::margins(triangle.slopes(), triangle.blur()),
                });
                surface.triangles.push(triangle);
            }
        }
        surface
    }

    /// Returns the total area, m2.
    pub fn area(&self) -> f64 {
        self.cumulative_area[self.cumulative_area.len() - 1]
    }

    /// Returns a box around the triangles, m.
    pub fn extent(&self) -> Extent {
        Extent::of_triangles(&self.triangles)
    }

    /// Returns middle and radius, m, of a ball around the triangles.
    pub fn ball(&self) -> (Vec3, f32) {
        let corners = || self.triangles.iter().flat_map(|t| [t.a, t.b, t.c]);
        let min = corners().fold(Vec3::INFINITY, Vec3::min);
        let max = corners().fold(Vec3::NEG_INFINITY, Vec3::max);
        (0.5 * (min + max), 0.5 * min.distance(max))
    }

    /// Draws a point uniform on the triangles, but not closer to their edges than its error.
    #[inline]
    pub fn choose(&self, rng: &mut Stream) -> Chosen {
        let choice = weighted_choice(&self.cumulative_area, rng.uniform_fine());
        let weights = uniform_triangle(Vec2::new(choice.rest, rng.uniform()));
        let Place { normal, margins } = self.places[choice.index];
        let offset = |point: Vec3| ROUNDING * across(normal, point);
        let point = self.triangles[choice.index].point_within(weights, margins, offset);
        Chosen { point, normal, offset: offset(point) }
    }
}
