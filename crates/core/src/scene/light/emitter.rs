//! What every light does, in one interface. Each kind of light is a file with its own
//! implementation, and `kinds` lists them.

use std::fmt;

use enum_dispatch::enum_dispatch;
use glam::Vec3;

use super::intensity::Intensity;
use crate::{
    math::{
        geometry::{Extent, Ray, Triangle},
        rng::Stream,
    },
    scene::lattice::Cell,
};

/// Place on a light that a photon starts from.
#[derive(Clone, Copy, Debug)]
pub struct Start {
    /// Position, m.
    pub point: Vec3,
    /// Unit normal of the side that the photon leaves from, or zero for a point or a line.
    pub normal: Vec3,
    /// Distance from the surface at which the photon starts, m.
    pub offset: f32,
    /// Whether photons leave from this place to both sides.
    pub both_sides: bool,
}

impl Start {
    /// Makes a place without a surface, and a ray from it.
    #[inline]
    pub(super) fn of_point(point: Vec3, direction: Vec3) -> (Self, Ray) {
        let start = Self { point, normal: Vec3::ZERO, offset: 0.0, both_sides: true };
        (start, Ray { origin: point, direction })
    }
}

/// A sampled point of a light as seen from a point of the scene.
pub struct Seen {
    /// The point.
    pub point: Vec3,
    /// The point at which a shadow ray ends, slightly off the surface of the light.
    pub end: Vec3,
    /// Irradiance on a plane across the line of sight, over the density of the sample, per W of the
    /// light's power, 1/m2.
    pub per_watt: f32,
    /// Density of the sample, 1/sr, or `None` for a point or a line.
    pub pdf: Option<f32>,
}

impl Seen {
    /// Describes the point of a light that is a point or a line, which brings `per_watt`.
    #[inline]
    pub fn of_point(point: Vec3, per_watt: f32) -> Self {
        Self { point, end: point, per_watt, pdf: None }
    }
}

/// Emitted radiance of a light's surface, per W of the light's power.
#[derive(Clone, Copy, Debug)]
pub struct EmittedRadiance {
    /// Radiance per W, 1/(m2 sr).
    pub radiance: f32,
    /// Area that emits, m2.
    pub area: f32,
}

/// Point where a ray meets the bright side of a light's surface.
#[derive(Clone, Copy, Debug)]
pub struct EmitterHit {
    /// Distance along the ray, m.
    pub t: f32,
    /// Cosine of the angle between the ray and the surface's normal, above 0.
    pub cos: f32,
    /// Emitted radiance at this point.
    pub emitted: EmittedRadiance,
    /// The cell of the image that is met, from the origin of the ray's coordinates; (0, 0) in a
    /// scene that does not repeat.
    pub image: Cell,
}

impl EmitterHit {
    /// Returns the density, 1/sr, with which the direction of this hit is sampled from `point` on
    /// the line of the ray, if points of the surface are sampled uniformly.
    pub fn pdf_toward(&self, point: Vec3, ray: &Ray) -> f32 {
        ray.at(self.t).distance_squared(point) / (self.emitted.area * self.cos)
    }
}

/// What a light does: how photons leave it, and how a point of the scene sees it. A method with a
/// default says that the light has no such thing; a kind overrides those of what it has.
#[enum_dispatch]
pub trait Emitter: fmt::Debug {
    /// Writes the light as its kind has it; the digest of a scene is made of this text.
    fn write(&self, to: &mut fmt::Formatter) -> fmt::Result {
        fmt::Debug::fmt(self, to)
    }

    /// Returns a box around the light, m from the centre of the scene; empty for a light at
    /// infinity.
    fn extent(&self) -> Extent;

    /// Returns middle and radius, m, of a ball around the light; the radius is infinite for a light
    /// at infinity.
    fn ball(&self) -> (Vec3, f32);

    /// Draws the ray of one photon, and returns with it the place that it starts from.
    fn emit(&self, rng: &mut Stream) -> (Start, Ray);

    /// Returns the density, 1/sr, with which a photon of [`emit`](Self::emit) that starts at this
    /// place and side leaves along a unit vector; 0 for a light at infinity.
    fn density(&self, start: &Start, direction: Vec3) -> f32;

    /// Samples a point of the light. Returns `None` where it sheds no light on `point`, and for a
    /// light at infinity.
    fn choose_point(&self, point: Vec3, rng: &mut Stream) -> Option<Seen>;

    /// Returns whether the light is a point or a line, which no ray can meet, or has a sun, which
    /// no ray meets by chance.
    fn is_delta(&self) -> bool {
        false
    }

    /// Returns the irradiance per W of power, 1/m2, that a point of the light brings to a plane
    /// across the line of sight at `away`, the vector from the light to there, m. Returns `None`
    /// for a light with a surface.
    fn irradiance(&self, _away: Vec3) -> Option<f32> {
        None
    }

    /// Returns an estimate of the irradiance at `point` per W of the light's power, 1/m2, which is
    /// 0 only where the light sheds no direct light: from `near`, 1 over the squared distance, and
    /// `towards`, the vector from the point to the middle of the light.
    fn importance(&self, _point: Vec3, _towards: Vec3, near: f32) -> f32 {
        near
    }

    /// Returns the mean exitance of the light's surface per W of its power, 1/m2, or `None` for a
    /// light without a surface.
    fn exitance(&self) -> Option<f32> {
        None
    }

    /// Returns the triangles of an area light; the list is empty for other lights.
    fn triangles(&self) -> &[Triangle] {
        &[]
    }

    /// Returns the emitted radiance of an area light's triangle that a ray meets along `direction`,
    /// and the area that emits. `cos` is the cosine of the ray to the triangle's front, below 0 if
    /// the ray comes from behind. Returns `None` where the triangle is dark.
    fn emitted_radiance(&self, _direction: Vec3, _cos: f32) -> Option<EmittedRadiance> {
        None
    }

    /// Returns where a ray meets the bright side of a surface that is not made of triangles.
    fn hit(&self, _ray: &Ray) -> Option<EmitterHit> {
        None
    }

    /// Returns the radius of such a surface about the [`places`](Self::places), m; 0 for lights
    /// without one.
    fn radius(&self) -> f32 {
        0.0
    }

    /// Returns points of a point, line or tube light, at which to look for surfaces that cut it: on
    /// its axis, at the middles of so many equal `pieces`. The list is empty for other lights.
    fn places(&self, _pieces: usize) -> Vec<Vec3> {
        Vec::new()
    }

    /// Returns the unit vector along a line or tube.
    fn along(&self) -> Option<Vec3> {
        None
    }

    /// Returns the unit vector along the axis of a spot, or in which a luminaire aims. Returns
    /// `None` for other lights, and for a spot that shines in all directions.
    fn axis(&self) -> Option<Vec3> {
        None
    }

    /// Returns the unit vector along which a light shines in the mean, and whether it shines in the
    /// opposite direction as well. `None` where it shines to all sides alike.
    fn facing(&self) -> Option<(Vec3, bool)> {
        self.axis().map(|axis| (axis, false))
    }

    /// Returns the position of a point, or the start of a line or tube, by which it is moved; other
    /// lights stay where they are.
    fn position_mut(&mut self) -> Option<&mut Vec3> {
        None
    }

    /// Returns the intensity by direction of a luminaire.
    fn intensity(&self) -> Option<&Intensity> {
        None
    }
}
