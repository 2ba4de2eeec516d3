//! Lights as a point of the scene sees them: directions to sample, densities, radiance and
//! irradiance.

use glam::Vec3;

use super::{
    Light,
    emitter::{EmittedRadiance, Emitter, EmitterHit, Seen},
};
use crate::{
    math::{
        geometry::{Ray, Triangle},
        rng::Stream,
        spectrum::{Lanes, Spectrum},
    },
    scene::daylight::DirectionSample,
};

/// Where a sampled light is.
#[derive(Clone, Copy, Debug)]
pub enum Toward {
    /// A point of the light.
    Point {
        /// The point, m.
        point: Vec3,
        /// The end of a shadow ray towards it, slightly off the surface of the light, m.
        end: Vec3,
    },
    /// Direction of a light that is infinitely far away, unit vector.
    Direction(Vec3),
}

/// A direction that was sampled because a light may shine from there.
#[derive(Clone, Copy, Debug)]
pub struct LightSample<L> {
    /// Target of the shadow ray.
    pub target: Toward,
    /// Radiance over the density of the sample: the irradiance that it brings to a plane across its
    /// direction, per band, W/m2 or umol/m2/s.
    pub radiance_over_pdf: Spectrum<L>,
    /// Density of the sample, 1/sr, or `None` for a light that no sampled direction meets (a point,
    /// a line, parallel rays).
    pub pdf: Option<f32>,
    /// The same irradiance per W of the light's power, 1/m2; 0 for a light at infinity.
    pub per_watt: f32,
}

/// A light that a ray meets.
#[derive(Clone, Copy, Debug)]
pub struct LightHit {
    /// Index of the light in the scene.
    pub light: usize,
    /// Point on the surface of the light, or `None` for a light at infinity.
    pub on: Option<EmitterHit>,
}

impl Light {
    /// Returns whether the light is a point or a line, which no ray can meet, or has a sun, which
    /// no ray meets by chance.
    pub fn is_delta(&self) -> bool {
        self.emitter.is_delta()
    }

    /// Returns the mean exitance of the light's surface per W of its power, 1/m2, or `None` for a
    /// light without a surface.
    pub fn exitance(&self) -> Option<f32> {
        self.emitter.exitance()
    }

    /// Returns the triangles of an area light; the list is empty for other lights.
    pub fn triangles(&self) -> &[Triangle] {
        self.emitter.triangles()
    }

    /// Returns middle and radius, m, of a ball around the light; the radius is infinite for a light
    /// at infinity.
    pub fn ball(&self) -> (Vec3, f32) {
        self.ball
    }

    /// Returns an estimate of the irradiance at `point` per W of the light's power, 1/m2, by which
    /// lights are chosen. It is 0 only where the light sheds no direct light. `normal` is that of a
    /// face that light from behind does not reach, or `None`.
    pub fn importance(&self, point: Vec3, normal: Option<Vec3>) -> f32 {
        if let Some(entrance) = self.entrance() {
            let most = self.power.iter().copied().fold(0.0, f64::max) as f32;
            let seen = normal.is_none_or(|normal| entrance.light.may_shine_on(normal));
            return if seen && most > 0.0 { entrance.irradiance() / most } else { 0.0 };
        }
        let (middle, radius) = self.ball;
        let towards = middle - point;
        if normal.is_some_and(|normal| towards.dot(normal) < -radius) {
            return 0.0;
        }
        self.emitter.importance(point, towards, self.nearness(point))
    }

    /// Returns 1 / d^2, 1/m2, with d the distance of `point` from the middle of the light, but not
    /// less than the radius of the ball around it.
    pub fn nearness(&self, point: Vec3) -> f32 {
        let (middle, radius) = self.ball;
        let d2 = point.distance_squared(middle);
        1.0 / d2.max(radius * radius).max(f32::MIN_POSITIVE)
    }

    /// Returns the irradiance per W of power, 1/m2, that a point of the light brings to a plane
    /// across the line of sight at `away`, the vector from the light to there, m. Returns `None`
    /// for a light with a surface.
    pub fn irradiance(&self, away: Vec3) -> Option<f32> {
        self.emitter.irradiance(away)
    }

    /// Samples a direction in which `point` may see the light: towards a point of the light, as far
    /// from its edges as [`emit`](Self::emit) starts, or towards a part of the sky.
    /// Returns `None` where the light sheds no light this way.
    pub fn sample_toward<L: Lanes>(&self, point: Vec3, rng: &mut Stream) -> Option<LightSample<L>> {
        if let Some(entrance) = self.entrance() {
            let DirectionSample { toward, radiance_over_pdf, pdf } = entrance.light.sample(rng)?;
            let target = Toward::Direction(toward);
            return Some(LightSample { target, radiance_over_pdf, pdf, per_watt: 0.0 });
        }
        let Seen { point, end, per_watt, pdf } = self.emitter.choose_point(point, rng)?;
        let radiance_over_pdf = self.spectrum::<L>().scaled(per_watt);
        Some(LightSample { target: Toward::Point { point, end }, radiance_over_pdf, pdf, per_watt })
    }

    /// Returns the density, 1/sr, with which [`sample_toward`](Self::sample_toward) from `point`
    /// samples the direction of a ray that comes from there, straight or through panes, and meets
    /// the light at `on`.
    pub fn pdf_toward(&self, point: Vec3, ray: &Ray, on: Option<&EmitterHit>) -> f32 {
        match on {
            Some(hit) => hit.pdf_toward(point, ray),
            None => self.entrance().map_or(0.0, |entrance| entrance.light.pdf(ray.direction)),
        }
    }

    /// Returns the radiance that comes back along a ray that meets the light at `on`, per band,
    /// W/m2/sr or umol/m2/s/sr. It does not include parallel rays.
    pub fn radiance<L: Lanes>(&self, ray: &Ray, on: Option<&EmitterHit>) -> Spectrum<L> {
        match (on, self.entrance()) {
            (Some(hit), _) => self.spectrum().scaled(hit.emitted.radiance),
            (None, Some(entrance)) => entrance.light.radiance(ray.direction),
            (None, None) => Spectrum::from_fn(self.power.len(), |_| 0.0),
        }
    }

    /// Returns the radiance like [`radiance`](Self::radiance), but without suns, which are too
    /// small to be met by chance.
    pub fn radiance_without_suns<L: Lanes>(
        &self,
        ray: &Ray,
        on: Option<&EmitterHit>,
    ) -> Spectrum<L> {
        match self.entrance() {
            Some(entrance) => entrance.light.radiance_without_suns(ray.direction),
            None => self.radiance(ray, on),
        }
    }

    /// Returns the power of the light in lanes, W or umol/s.
    pub fn spectrum<L: Lanes>(&self) -> Spectrum<L> {
        Spectrum::from_fn(self.power.len(), |b| self.power.get(b).map_or(0.0, |p| *p as f32))
    }

    /// Returns the emitted radiance of an area light's triangle that a ray meets along `direction`,
    /// and the area that emits. `cos` is the cosine of the ray to the triangle's front, below 0 if
    /// the ray comes from behind. Returns `None` where the triangle is dark.
    pub fn emitted_radiance(&self, direction: Vec3, cos: f32) -> Option<EmittedRadiance> {
        self.emitter.emitted_radiance(direction, cos)
    }

    /// Returns where a ray meets the bright side of a surface that is not made of triangles: a tube.
    pub fn hit(&self, ray: &Ray) -> Option<EmitterHit> {
        self.emitter.hit(ray)
    }
}
