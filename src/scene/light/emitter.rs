//! Shapes that light leaves from: lines, tubes and triangles.

use glam::{DVec2, DVec3, Vec2, Vec3};

use crate::math::{
    geometry::Triangle,
    rng::Stream,
    sampling::{Chosen, uniform_circle, uniform_triangle, weighted_choice},
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
}

impl Line {
    pub fn new(from: Vec3, whole: Vec3) -> Self {
        Self { from, whole, length: whole.length() }
    }

    pub fn middle(&self) -> Vec3 {
        self.from + 0.5 * self.whole
    }

    /// Draws a point uniform on the line, but not closer than `offset` metres to its ends.
    #[inline]
    pub fn choose(&self, offset: f32, rng: &mut Stream) -> Vec3 {
        let margin = (offset / self.length).min(0.5);
        self.from + rng.uniform().clamp(margin, 1.0 - margin) * self.whole
    }
}

/// Triangles of an area light, with the values that each photon needs of them.
#[derive(Clone, Debug, Default)]
pub(super) struct EmittingSurface {
    pub triangles: Vec<Triangle>,
    normals: Vec<Vec3>,
    slopes: Vec<Vec3>,
    cumulative_area: Vec<f64>,
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
                surface.normals.push(triangle.normal());
                surface.slopes.push(triangle.slopes());
                surface.triangles.push(triangle);
            }
        }
        surface
    }

    /// Returns the total area, m2.
    pub fn area(&self) -> f64 {
        self.cumulative_area[self.cumulative_area.len() - 1]
    }

    /// Draws a point uniform on the triangles, at least `offset` metres from their edges, and
    /// returns it with the normal there.
    #[inline]
    pub fn choose(&self, offset: f32, rng: &mut Stream) -> (Vec3, Vec3) {
        let Chosen { index, rest } = weighted_choice(&self.cumulative_area, rng.uniform_fine());
        let weights = uniform_triangle(Vec2::new(rest, rng.uniform()));
        let margins = Triangle::margins(self.slopes[index], offset);
        let point = self.triangles[index].point_within(weights.x, weights.y, margins);
        (point, self.normals[index])
    }
}
