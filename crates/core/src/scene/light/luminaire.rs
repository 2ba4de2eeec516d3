//! Luminaires: points and areas whose intensity depends on the direction, as a photometric file or
//! a cosine says.

use std::f32::consts::PI;

use glam::{DVec3, Vec3};

use super::{
    emitter::{EmittedRadiance, Emitter, Seen, Start},
    intensity::Intensity,
    shape::{Outline, Unplaced},
    surface::{Chosen, EmittingSurface},
};
use crate::{
    error::Problem,
    math::{
        geometry::{Extent, Ray, Triangle},
        rng::Stream,
    },
};

/// A luminaire as a point.
#[derive(Clone, Debug)]
pub struct Luminaire {
    position: Vec3,
    intensity: Intensity,
}

impl Luminaire {
    /// Makes a point at a position, m, with an intensity by direction.
    pub fn new(position: DVec3, intensity: Intensity) -> Unplaced<Self> {
        Unplaced::new(Outline::Points(vec![position]), move |center| {
            let position = (position - center).as_vec3();
            Self { position, intensity: intensity.clone() }
        })
    }
}

impl Emitter for Luminaire {
    fn extent(&self) -> Extent {
        Extent::of([self.position])
    }

    fn ball(&self) -> (Vec3, f32) {
        (self.position, 0.0)
    }

    #[inline]
    fn emit(&self, rng: &mut Stream) -> (Start, Ray) {
        Start::of_point(self.position, self.intensity.sample(rng))
    }

    fn density(&self, _: &Start, direction: Vec3) -> f32 {
        self.intensity.towards(direction)
    }

    fn choose_point(&self, point: Vec3, _: &mut Stream) -> Option<Seen> {
        let away = point - self.position;
        let towards = self.intensity.towards(away.normalize_or_zero());
        let per_watt = towards / away.length_squared();
        (towards > 0.0).then_some(Seen::of_point(self.position, per_watt))
    }

    fn is_delta(&self) -> bool {
        true
    }

    fn irradiance(&self, away: Vec3) -> Option<f32> {
        Some(self.intensity.towards(away.normalize_or_zero()) / away.length_squared())
    }

    fn importance(&self, _: Vec3, towards: Vec3, near: f32) -> f32 {
        2.0 * PI * near * self.intensity.towards(-towards.normalize_or_zero())
    }

    fn places(&self, _: usize) -> Vec<Vec3> {
        vec![self.position]
    }

    fn axis(&self) -> Option<Vec3> {
        Some(self.intensity.axes().normal)
    }

    fn position_mut(&mut self) -> Option<&mut Vec3> {
        Some(&mut self.position)
    }

    fn intensity(&self) -> Option<&Intensity> {
        Some(&self.intensity)
    }
}

/// A luminaire as an area, each point of which shines with the same intensity.
#[derive(Clone, Debug)]
pub struct LuminaireArea {
    surface: EmittingSurface,
    intensity: Intensity,
}

impl LuminaireArea {
    /// Makes an area of triangles, whose corners, m, are counter-clockwise seen from the front. Its
    /// radiance is I / (area x |cosine|): light leaves from the front into directions on the front's
    /// side, and from the back into the others. Error: the triangles have no area.
    pub fn new(
        triangles: Vec<[DVec3; 3]>,
        intensity: Intensity,
    ) -> Result<Unplaced<Self>, Problem> {
        EmittingSurface::of(triangles, move |surface| Self {
            surface,
            intensity: intensity.clone(),
        })
    }
}

impl Emitter for LuminaireArea {
    fn extent(&self) -> Extent {
        self.surface.extent()
    }

    fn ball(&self) -> (Vec3, f32) {
        self.surface.ball()
    }

    #[inline]
    fn emit(&self, rng: &mut Stream) -> (Start, Ray) {
        let Chosen { point, normal, offset } = self.surface.choose(rng);
        let direction = self.intensity.sample(rng);
        let side = normal * normal.dot(direction).signum();
        let start = Start { point, normal, offset, both_sides: true };
        (start, Ray { origin: point + offset * side, direction })
    }

    fn density(&self, _: &Start, direction: Vec3) -> f32 {
        self.intensity.towards(direction)
    }

    fn choose_point(&self, point: Vec3, rng: &mut Stream) -> Option<Seen> {
        let chosen = self.surface.choose(rng);
        let normal = chosen.normal;
        let away = point - chosen.point;
        let d2 = away.length_squared();
        let direction = away.normalize_or_zero();
        let (towards, cos) = (self.intensity.towards(direction), direction.dot(normal));
        (towards > 0.0 && cos != 0.0).then(|| Seen {
            point: chosen.point,
            end: chosen.off(cos.signum() * normal, d2.sqrt()),
            per_watt: towards / d2,
            pdf: Some(d2 / (self.surface.area() as f32 * cos.abs())),
        })
    }

    fn exitance(&self) -> Option<f32> {
        Some(1.0 / self.surface.area() as f32)
    }

    fn triangles(&self) -> &[Triangle] {
        &self.surface.triangles
    }

    fn emitted_radiance(&self, direction: Vec3, cos: f32) -> Option<EmittedRadiance> {
        let (towards, area) = (self.intensity.towards(-direction), self.surface.area() as f32);
        let radiance = towards / (area * cos.abs());
        (towards > 0.0 && cos != 0.0).then_some(EmittedRadiance { radiance, area })
    }

    fn facing(&self) -> Option<(Vec3, bool)> {
        Some((self.intensity.axes().normal, false))
    }

    fn intensity(&self) -> Option<&Intensity> {
        Some(&self.intensity)
    }
}
