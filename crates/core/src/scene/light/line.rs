//! Lines: the axes of tubes, and lines that shine in all directions alike.

use std::f32::consts::PI;

use glam::{DVec3, Vec3};

use super::{
    emitter::{Emitter, Seen, Start},
    shape::{Outline, Unplaced},
};
use crate::{
    error::Problem,
    math::{
        geometry::{Extent, ROUNDING, Ray, unit_vector},
        rng::Stream,
        sampling::uniform_cone,
    },
};

/// Returns the unit vector along a tube, from the vector from end to end. Error: its length is 0.
pub fn check_axis(whole: DVec3) -> Result<DVec3, Problem> {
    unit_vector(whole).ok_or_else(|| {
        let problem = "a tube of length 0: `from` is `to`";
        Problem::new(problem, "move one end, or take a point light")
    })
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
    /// Makes a line between two points, in coordinates relative to `center`.
    pub fn new(from: DVec3, to: DVec3, center: DVec3) -> Self {
        let (from, whole) = ((from - center).as_vec3(), (to - from).as_vec3());
        let farthest = from.length().max((from + whole).length());
        Self { from, whole, length: whole.length(), blur: ROUNDING * farthest }
    }

    pub fn middle(&self) -> Vec3 {
        self.from + 0.5 * self.whole
    }

    /// Returns the unit vector along the line.
    pub fn along(&self) -> Vec3 {
        self.whole / self.length
    }

    /// Returns the middles of so many equal pieces.
    pub fn places(&self, pieces: usize) -> Vec<Vec3> {
        let at = |i: usize| self.from + (i as f32 + 0.5) / pieces as f32 * self.whole;
        (0..pieces).map(at).collect()
    }

    /// Draws a point uniform on the line, but not closer to its ends than the error of its points.
    #[inline]
    pub fn choose(&self, rng: &mut Stream) -> Vec3 {
        let margin = (self.blur / self.length).min(0.5);
        self.from + rng.uniform().clamp(margin, 1.0 - margin) * self.whole
    }
}

/// A line whose points shine in all directions alike.
#[derive(Clone, Debug)]
pub struct IsotropicLine(Line);

impl IsotropicLine {
    /// Makes a line from one point to another, m. Error: its length is 0.
    pub fn new(from: DVec3, to: DVec3) -> Result<Unplaced<Self>, Problem> {
        check_axis(to - from)?;
        Ok(Unplaced::new(Outline::Points(vec![from, to]), move |center| {
            Self(Line::new(from, to, center))
        }))
    }
}

impl Emitter for IsotropicLine {
    fn extent(&self) -> Extent {
        Extent::of([self.0.from, self.0.from + self.0.whole])
    }

    fn ball(&self) -> (Vec3, f32) {
        (self.0.middle(), 0.5 * self.0.length)
    }

    #[inline]
    fn emit(&self, rng: &mut Stream) -> (Start, Ray) {
        let point = self.0.choose(rng);
        Start::of_point(point, uniform_cone(2.0, rng.square()))
    }

    fn density(&self, _: &Start, _: Vec3) -> f32 {
        0.25 / PI
    }

    fn choose_point(&self, point: Vec3, rng: &mut Stream) -> Option<Seen> {
        let on_axis = self.0.choose(rng);
        Some(Seen::of_point(on_axis, 1.0 / (4.0 * PI * point.distance_squared(on_axis))))
    }

    fn is_delta(&self) -> bool {
        true
    }

    fn irradiance(&self, away: Vec3) -> Option<f32> {
        Some(1.0 / (4.0 * PI * away.length_squared()))
    }

    fn places(&self, pieces: usize) -> Vec<Vec3> {
        self.0.places(pieces)
    }

    fn along(&self) -> Option<Vec3> {
        Some(self.0.along())
    }

    fn position_mut(&mut self) -> Option<&mut Vec3> {
        Some(&mut self.0.from)
    }
}
