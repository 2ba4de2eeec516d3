//! Shapes that light leaves from: lines, tubes and triangles.

use glam::{DVec2, DVec3, Vec2, Vec3};

use crate::math::{
    geometry::{ROUNDING, Triangle},
    rng::Stream,
    sampling::{uniform_circle, uniform_triangle, weighted_choice},
};

/// Fraction of a tube's circumference that shines, centred on the tangent of the tube's frame.
#[derive(Clone, Copy, Debug)]
pub(super) struct Aperture(pub f32);

impl Aperture {
    /// The whole circumference.
    pub const WHOLE: Self = Self(1.0);

    /// Returns a unit vector turned from the tangent by an angle that is uniform in the aperture,
    /// where `u` is a uniform number.
    #[inline]
    pub fn turn(self, u: f32) -> Vec2 {
        if self.0 == 1.0 {
            return uniform_circle(u);
        }
        let turn = self.0 * (u - 0.5);
        uniform_circle(if turn < 0.0 { turn + 1.0 } else { turn })
    }

    /// Returns whether a vector across the axis, in coordinates along tangent and bitangent, points
    /// into the aperture.
    pub fn holds(self, across: DVec2) -> bool {
        self.0 == 1.0 || across.y.atan2(across.x).abs() <= std::f64::consts::PI * f64::from(self.0)
    }

    /// Returns the area of a tube within the aperture, m2.
    pub fn area(self, radius: f32, length: f32) -> f32 {
        2.0 * std::f32::consts::PI * radius * length * self.0
    }
}

/// Axis of a tube, or a line that shines.
#[derive(Clone, Copy, Debug)]
pub(super) struct Line {
    /// Start of the line, m.
    pub from: Vec3,
    /// Vector from the start of the line to its end, m.
    pub whole: Vec3,
    /// Length, m.
    pub length: f32,
    /// Bound of the error of points of the line, m.
    pub blur: f32,
}

impl Line {
    pub fn new(from: Vec3, whole: Vec3) -> Self {
        let farthest = from.length().max((from + whole).length());
        Self { from, whole, length: whole.length(), blur: ROUNDING * farthest }
    }

    pub fn middle(&self) -> Vec3 {
        self.from + 0.5 * self.whole
    }

    /// Draws a point uniform on the line, but not closer to its ends than the error of its points.
    #[inline]
    pub fn choose(&self, rng: &mut Stream) -> Vec3 {
        let margin = (self.blur / self.length).min(0.5);
        self.from + rng.uniform().clamp(margin, 1.0 - margin) * self.whole
    }
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
    /// Distance from the triangle at which photons start, m.
    offset: f32,
}

/// A point of an area light.
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
    pub fn new(triangles: &[[DVec3; 3]], local: impl Fn(DVec3) -> Vec3) -> Self {
        let mut surface = Self::default();
        let mut area = 0.0;
        for corners in triangles {
            let triangle = Triangle::from(corners.map(&local));
            // a sliver that rounding has left without a front emits nothing
            if triangle.normal() != Vec3::ZERO {
                let [a, b, c] = corners;
                area += 0.5 * (*b - *a).cross(*c - *a).length();
                surface.cumulative_area.push(area);
                surface.places.push(Place {
                    normal: triangle.normal(),
                    margins: Triangle::margins(triangle.slopes(), triangle.blur()),
                    offset: triangle.offset(),
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

    /// Draws a point uniform on the triangles, but not closer to their edges than its error.
    #[inline]
    pub fn choose(&self, rng: &mut Stream) -> Chosen {
        let choice = weighted_choice(&self.cumulative_area, rng.uniform_fine());
        let weights = uniform_triangle(Vec2::new(choice.rest, rng.uniform()));
        let Place { normal, margins, offset } = self.places[choice.index];
        let point = self.triangles[choice.index].point_within(weights.x, weights.y, margins);
        Chosen { point, normal, offset }
    }
}
