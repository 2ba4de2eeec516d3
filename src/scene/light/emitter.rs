//! The shapes that light leaves from: lines, tubes, triangles.

use glam::{DVec2, DVec3, Vec2, Vec3};

use crate::math::{
    geometry::Triangle,
    rng::Stream,
    sampling::{Chosen, uniform_circle, uniform_triangle, weighted_choice},
};

/// The share of a tube's circumference that shines, about the tangent of its frame.
#[derive(Clone, Copy, Debug)]
pub(super) struct Aperture(pub f32);

impl Aperture {
    /// All around.
    pub const WHOLE: Self = Self(1.0);

    /// A turn from the tangent that is uniform in it, from a uniform number.
    #[inline]
    pub fn turn(self, u: f32) -> Vec2 {
        if self.0 == 1.0 {
            return uniform_circle(u);
        }
        let turn = self.0 * (u - 0.5);
        uniform_circle(if turn < 0.0 { turn + 1.0 } else { turn })
    }

    /// Whether it holds the turn of a vector from the tangent.
    pub fn holds(self, across: DVec2) -> bool {
        self.0 == 1.0 || across.y.atan2(across.x).abs() <= std::f64::consts::PI * f64::from(self.0)
    }

    /// Area of a tube within it, m2.
    pub fn area(self, radius: f32, length: f32) -> f32 {
        2.0 * std::f32::consts::PI * radius * length * self.0
    }
}

/// The axis of a tube, or a line that shines.
#[derive(Clone, Copy, Debug)]
pub(super) struct Line {
    /// Its start, m.
    pub from: Vec3,
    /// From its start to its end, m.
    pub whole: Vec3,
    /// m.
    pub length: f32,
}

impl Line {
    pub fn new(from: Vec3, whole: Vec3) -> Self {
        Self { from, whole, length: whole.length() }
    }

    pub fn middle(&self) -> Vec3 {
        self.from + 0.5 * self.whole
    }

    /// A point uniform on it, `offset` from its ends.
    #[inline]
    pub fn choose(&self, offset: f32, rng: &mut Stream) -> Vec3 {
        let margin = (offset / self.length).min(0.5);
        self.from + rng.uniform().clamp(margin, 1.0 - margin) * self.whole
    }
}

/// The triangles of an area light, and what of them each photon needs.
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

    /// m2.
    pub fn area(&self) -> f64 {
        self.cumulative_area[self.cumulative_area.len() - 1]
    }

    /// A point uniform on it, as far as `offset` from the edges of its triangles, and the normal there.
    #[inline]
    pub fn choose(&self, offset: f32, rng: &mut Stream) -> (Vec3, Vec3) {
        let Chosen { index, rest } = weighted_choice(&self.cumulative_area, rng.uniform_fine());
        let weights = uniform_triangle(Vec2::new(rest, rng.uniform()));
        let margins = Triangle::margins(self.slopes[index], offset);
        let point = self.triangles[index].point_within(weights.x, weights.y, margins);
        (point, self.normals[index])
    }
}
