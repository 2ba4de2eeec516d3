//! Areas with Lambertian light, from the front or from both sides.

use std::f32::consts::PI;

use glam::{DVec3, Vec3};

use super::{
    emitter::{EmittedRadiance, Emitter, Seen, Start},
    shape::Unplaced,
    surface::{Chosen, EmittingSurface},
};
use crate::{
    error::Problem,
    math::{
        geometry::{Extent, Frame, Ray, Triangle, unit_vector},
        rng::Stream,
        sampling::{cosine_hemisphere, cosine_hemisphere_density},
    },
};

/// An area that shines.
#[derive(Clone, Debug)]
pub struct Area {
    surface: EmittingSurface,
    two_sided: bool,
}

impl Area {
    /// Makes an area of triangles, whose corners, m, are counter-clockwise seen from the front. It
    /// shines from its front, or from both sides. Error: the triangles have no area.
    pub fn new(triangles: Vec<[DVec3; 3]>, two_sided: bool) -> Result<Unplaced<Self>, Problem> {
        EmittingSurface::of(triangles, move |surface| Self { surface, two_sided })
    }

    /// Returns the number of sides that shine.
    fn sides(&self) -> f32 {
        if self.two_sided { 2.0 } else { 1.0 }
    }
}

impl Emitter for Area {
    fn extent(&self) -> Extent {
        self.surface.extent()
    }

    fn ball(&self) -> (Vec3, f32) {
        self.surface.ball()
    }

    #[inline]
    fn emit(&self, rng: &mut Stream) -> (Start, Ray) {
        let chosen = self.surface.choose(rng);
        let front = !self.two_sided || rng.uniform() < 0.5;
        let normal = if front { chosen.normal } else { -chosen.normal };
        leave(Chosen { normal, ..chosen }, rng)
    }

    fn density(&self, start: &Start, direction: Vec3) -> f32 {
        cosine_hemisphere_density(start.normal.dot(direction))
    }

    fn choose_point(&self, point: Vec3, rng: &mut Stream) -> Option<Seen> {
        let mut chosen = self.surface.choose(rng);
        if self.two_sided && (point - chosen.point).dot(chosen.normal) < 0.0 {
            chosen.normal = -chosen.normal;
        }
        seen(point, &chosen, self.surface.area() as f32, self.sides())
    }

    fn importance(&self, point: Vec3, _: Vec3, near: f32) -> f32 {
        if self.two_sided || self.surface.triangles.len() > 2 {
            return near;
        }
        let faces = |t: &Triangle| (point - t.a).dot(t.cross()) > 0.0;
        if self.surface.triangles.iter().any(faces) { near } else { 0.0 }
    }

    fn exitance(&self) -> Option<f32> {
        Some(1.0 / (self.sides() * self.surface.area() as f32))
    }

    fn triangles(&self) -> &[Triangle] {
        &self.surface.triangles
    }

    fn emitted_radiance(&self, _: Vec3, cos: f32) -> Option<EmittedRadiance> {
        let area = self.surface.area() as f32;
        let radiance = 1.0 / (PI * area * self.sides());
        (cos > 0.0 || self.two_sided).then_some(EmittedRadiance { radiance, area })
    }

    fn facing(&self) -> Option<(Vec3, bool)> {
        let normal: DVec3 = self.surface.triangles.iter().map(|t| t.cross().as_dvec3()).sum();
        Some((unit_vector(normal)?.as_vec3(), self.two_sided))
    }
}

/// Draws a ray with a Lambertian direction from a surface.
#[inline]
pub(super) fn leave(Chosen { point, normal, offset }: Chosen, rng: &mut Stream) -> (Start, Ray) {
    let start = Start { point, normal, offset, both_sides: false };
    let direction = Frame::new(normal).to_world(cosine_hemisphere(rng.square()));
    (start, Ray { origin: point + offset * normal, direction })
}

/// Describes a point that was sampled uniformly from a Lambertian surface of `area` m2 with so many
/// `sides`. Returns `None` where `point` is behind it.
pub(super) fn seen(point: Vec3, chosen: &Chosen, area: f32, sides: f32) -> Option<Seen> {
    let normal = chosen.normal;
    let away = point - chosen.point;
    let d2 = away.length_squared();
    let cos = away.dot(normal) / d2.sqrt();
    (cos > 0.0).then(|| Seen {
        point: chosen.point,
        end: chosen.off(normal, d2.sqrt()),
        per_watt: cos / (PI * sides * d2),
        pdf: Some(d2 / (area * cos)),
    })
}
