//! Points with the same intensity in all directions of a cone: point lights, whose cone is the
//! whole sphere, and spots.

use std::f32::consts::PI;

use glam::{DVec3, Vec3};

use super::{
    checks::check_direction,
    emitter::{Emitter, Seen, Start},
    shape::{Outline, Unplaced},
};
use crate::{
    error::{Checked, Problem},
    math::{
        geometry::{Extent, Frame, Ray},
        rng::Stream,
        sampling::uniform_cone,
    },
};

/// A point that shines into a cone.
#[derive(Clone, Debug)]
pub struct Cone {
    position: Vec3,
    /// Its normal is the axis of the cone.
    frame: Frame,
    /// 1 - cos of the half angle: 2 for the whole sphere.
    versine: f32,
}

/// Checks the half angle of a cone, degrees. Error: it is outside (0, 180].
pub fn check_half_angle(degrees: f64) -> Checked {
    if degrees > 0.0 && degrees <= 180.0 {
        return Ok(());
    }
    let remedy = "it is the angle between the axis and the rim, in degrees";
    Err(Problem::new(format!("{degrees}, must be above 0 and at most 180"), remedy))
}

impl Cone {
    /// Makes a point light at a position, m.
    pub fn point(position: DVec3) -> Unplaced<Self> {
        Self::at(position, Frame::new(Vec3::Z), 2.0)
    }

    /// Makes a spot at a position, m, with its axis along a vector and a half angle, rad. Error: the
    /// vector has length 0, or the angle is outside (0, pi].
    pub fn spot(
        position: DVec3,
        direction: DVec3,
        half_angle: f64,
    ) -> Result<Unplaced<Self>, Problem> {
        let axis = check_direction(direction).map_err(|problem| problem.of("direction"))?;
        check_half_angle(half_angle.to_degrees()).map_err(|problem| problem.of("half angle"))?;
        let versine = (2.0 * (half_angle / 2.0).sin().powi(2)) as f32;
        Ok(Self::at(position, frame_along(axis), versine))
    }

    fn at(position: DVec3, frame: Frame, versine: f32) -> Unplaced<Self> {
        Unplaced::new(Outline::Points(vec![position]), move |center| {
            let position = (position - center).as_vec3();
            Self { position, frame, versine }
        })
    }
}

/// Returns a frame whose normal lies along a unit vector.
pub(super) fn frame_along(axis: DVec3) -> Frame {
    Frame::new(axis.as_vec3().normalize())
}

impl Emitter for Cone {
    fn extent(&self) -> Extent {
        Extent::of([self.position])
    }

    fn ball(&self) -> (Vec3, f32) {
        (self.position, 0.0)
    }

    #[inline]
    fn emit(&self, rng: &mut Stream) -> (Start, Ray) {
        let direction = self.frame.to_world(uniform_cone(self.versine, rng.square()));
        Start::of_point(self.position, direction)
    }

    fn density(&self, _: &Start, direction: Vec3) -> f32 {
        let inside = versine_between(self.frame.normal, direction) <= self.versine;
        if inside { 1.0 / (2.0 * PI * self.versine) } else { 0.0 }
    }

    fn choose_point(&self, point: Vec3, _: &mut Stream) -> Option<Seen> {
        let away = point - self.position;
        let d2 = away.length_squared();
        let per_watt = 1.0 / (2.0 * PI * self.versine * d2);
        let inside = versine_between(self.frame.normal, away / d2.sqrt()) <= self.versine;
        inside.then_some(Seen::of_point(self.position, per_watt))
    }

    fn is_delta(&self) -> bool {
        true
    }

    fn irradiance(&self, away: Vec3) -> Option<f32> {
        Some(1.0 / (2.0 * PI * self.versine * away.length_squared()))
    }

    fn importance(&self, _: Vec3, towards: Vec3, near: f32) -> f32 {
        // slightly more than the cone, because of rounding
        let inside =
            1.0 + self.frame.normal.dot(towards.normalize_or_zero()) <= self.versine + 1e-5;
        if inside { near / self.versine } else { 0.0 }
    }

    fn places(&self, _: usize) -> Vec<Vec3> {
        vec![self.position]
    }

    fn axis(&self) -> Option<Vec3> {
        (self.versine < 2.0).then_some(self.frame.normal)
    }

    fn position_mut(&mut self) -> Option<&mut Vec3> {
        Some(&mut self.position)
    }
}

/// Returns 1 - cos of the angle between two unit vectors, accurate also where they are nearly the
/// same.
fn versine_between(a: Vec3, b: Vec3) -> f32 {
    let cos = a.dot(b);
    if cos > 0.0 { a.cross(b).length_squared() / (1.0 + cos) } else { 1.0 - cos }
}
