//! Lights as a point of the scene sees them: directions to sample, densities, radiance and
//! irradiance.

use std::f32::consts::PI;

use glam::{DVec2, DVec3, Vec3};

use super::{Emitter, Light, emitter::Chosen, tube_offset};
use crate::{
    math::{
        geometry::{Ray, Triangle},
        rng::Stream,
        spectrum::{Lanes, Spectrum},
    },
    scene::{daylight::DirectionSample, lattice::Cell},
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

/// A light that a ray meets.
#[derive(Clone, Copy, Debug)]
pub struct LightHit {
    /// Index of the light in the scene.
    pub light: usize,
    /// Point on the surface of the light, or `None` for a light at infinity.
    pub on: Option<EmitterHit>,
}

/// A sampled point of a light as seen from a point of the scene.
struct Seen {
    /// The point.
    point: Vec3,
    /// The point at which a shadow ray ends, slightly off the surface of the light.
    end: Vec3,
    /// Irradiance on a plane across the line of sight, over the density of the sample, per W of the
    /// light's power, 1/m2.
    per_watt: f32,
    /// Density of the sample, 1/sr, or `None` for a point or a line.
    pdf: Option<f32>,
}

impl Light {
    /// Returns whether the light is a point or a line, which no ray can meet, or has a sun, which
    /// no ray meets by chance.
    pub fn is_delta(&self) -> bool {
        match &self.emitter {
            Emitter::Cone { .. } | Emitter::IsotropicLine { .. } | Emitter::Luminaire { .. } => {
                true
            }
            Emitter::Tube { radius, .. } => *radius == 0.0,
            Emitter::Area { .. } | Emitter::LuminaireArea { .. } => false,
            Emitter::Infinite(entrance) => entrance.light.has_sun(),
        }
    }

    /// Returns the mean exitance of the light's surface per W of its power, 1/m2, or `None` for a
    /// light without a surface.
    pub fn exitance(&self) -> Option<f32> {
        match &self.emitter {
            Emitter::Tube { line, radius, aperture, .. } if *radius > 0.0 => {
                Some(1.0 / aperture.area(*radius, line.length))
            }
            Emitter::Area { surface, two_sided } => {
                let sides = if *two_sided { 2.0 } else { 1.0 };
                Some(1.0 / (sides * surface.area() as f32))
            }
            Emitter::LuminaireArea { surface, .. } => Some(1.0 / surface.area() as f32),
            _ => None,
        }
    }

    /// Returns the triangles of an area light; the list is empty for other lights.
    pub fn triangles(&self) -> &[Triangle] {
        match &self.emitter {
            Emitter::Area { surface, .. } | Emitter::LuminaireArea { surface, .. } => {
                &surface.triangles
            }
            _ => &[],
        }
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
        if let Emitter::Infinite(entrance) = &self.emitter {
            let most = self.power.iter().copied().fold(0.0, f64::max) as f32;
            let seen = normal.is_none_or(|normal| entrance.light.may_shine_on(normal));
            return if seen && most > 0.0 { entrance.irradiance() / most } else { 0.0 };
        }
        let (middle, radius) = self.ball;
        let towards = middle - point;
        if normal.is_some_and(|normal| towards.dot(normal) < -radius) {
            return 0.0;
        }
        let near = self.nearness(point);
        match &self.emitter {
            Emitter::Cone { frame, versine, .. } => {
                // slightly more than the cone, because of rounding
                let inside = 1.0 + frame.normal.dot(towards.normalize_or_zero()) <= versine + 1e-5;
                if inside { near / versine } else { 0.0 }
            }
            Emitter::Luminaire { intensity, .. } => {
                2.0 * PI * near * intensity.towards(-towards.normalize_or_zero())
            }
            Emitter::Area { surface, two_sided: false } if surface.triangles.len() <= 2 => {
                let seen = |t: &Triangle| (point - t.a).dot(t.cross()) > 0.0;
                if surface.triangles.iter().any(seen) { near } else { 0.0 }
            }
            _ => near,
        }
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
        let d2 = away.length_squared();
        match &self.emitter {
            Emitter::Cone { versine, .. } => Some(1.0 / (2.0 * PI * versine * d2)),
            Emitter::IsotropicLine(_) => Some(1.0 / (4.0 * PI * d2)),
            Emitter::Tube { frame, radius: 0.0, .. } => {
                let sin = away.reject_from_normalized(frame.normal).length() / d2.sqrt();
                Some(sin / (PI * PI * d2))
            }
            Emitter::Luminaire { intensity, .. } => {
                Some(intensity.towards(away.normalize_or_zero()) / d2)
            }
            _ => None,
        }
    }

    /// Samples a direction in which `point` may see the light: towards a point of the light, as far
    /// from its edges as [`emit`](Self::emit) starts, or towards a part of the sky.
    /// Returns `None` where the light sheds no light this way.
    pub fn sample_toward<L: Lanes>(&self, point: Vec3, rng: &mut Stream) -> Option<LightSample<L>> {
        if let Emitter::Infinite(entrance) = &self.emitter {
            let DirectionSample { toward, radiance_over_pdf, pdf } = entrance.light.sample(rng)?;
            let target = Toward::Direction(toward);
            return Some(LightSample { target, radiance_over_pdf, pdf, per_watt: 0.0 });
        }
        let Seen { point, end, per_watt, pdf } = self.choose_point(point, rng)?;
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

    /// Samples a point of a light that is not infinitely far away. Returns `None` where it sheds no
    /// light on `point`.
    fn choose_point(&self, point: Vec3, rng: &mut Stream) -> Option<Seen> {
        match &self.emitter {
            Emitter::Cone { position, frame, versine } => {
                let away = point - *position;
                let d2 = away.length_squared();
                let per_watt = 1.0 / (2.0 * PI * versine * d2);
                let inside = versine_between(frame.normal, away / d2.sqrt()) <= *versine;
                inside.then_some(Seen { point: *position, end: *position, per_watt, pdf: None })
            }
            Emitter::IsotropicLine(line) => {
                let on_axis = line.choose(rng);
                let per_watt = 1.0 / (4.0 * PI * point.distance_squared(on_axis));
                Some(Seen { point: on_axis, end: on_axis, per_watt, pdf: None })
            }
            Emitter::Tube { line, frame, radius, aperture } => {
                let on_axis = line.choose(rng);
                if *radius == 0.0 {
                    let away = point - on_axis;
                    let d2 = away.length_squared();
                    let sin = away.reject_from_normalized(frame.normal).length() / d2.sqrt();
                    let per_watt = sin / (PI * PI * d2);
                    return Some(Seen { point: on_axis, end: on_axis, per_watt, pdf: None });
                }
                let turn = aperture.turn(rng.uniform());
                let normal = turn.x * frame.tangent + turn.y * frame.bitangent;
                let area = aperture.area(*radius, line.length);
                let offset = tube_offset(line, *radius);
                let chosen = Chosen { point: on_axis + *radius * normal, normal, offset };
                seen(point, &chosen, area, 1.0)
            }
            Emitter::Area { surface, two_sided } => {
                let mut chosen = surface.choose(rng);
                if *two_sided && (point - chosen.point).dot(chosen.normal) < 0.0 {
                    chosen.normal = -chosen.normal;
                }
                let sides = if *two_sided { 2.0 } else { 1.0 };
                seen(point, &chosen, surface.area() as f32, sides)
            }
            Emitter::Luminaire { position, intensity } => {
                let away = point - *position;
                let towards = intensity.towards(away.normalize_or_zero());
                let per_watt = towards / away.length_squared();
                (towards > 0.0).then_some(Seen {
                    point: *position,
                    end: *position,
                    per_watt,
                    pdf: None,
                })
            }
            Emitter::LuminaireArea { surface, intensity } => {
                let chosen = surface.choose(rng);
                let normal = chosen.normal;
                let away = point - chosen.point;
                let d2 = away.length_squared();
                let direction = away.normalize_or_zero();
                let (towards, cos) = (intensity.towards(direction), direction.dot(normal));
                (towards > 0.0 && cos != 0.0).then(|| Seen {
                    point: chosen.point,
                    end: chosen.off(cos.signum() * normal, d2.sqrt()),
                    per_watt: towards / d2,
                    pdf: Some(d2 / (surface.area() as f32 * cos.abs())),
                })
            }
            Emitter::Infinite(_) => None,
        }
    }

    /// Returns the emitted radiance of an area light's triangle that a ray meets along `direction`,
    /// and the area that emits. `cos` is the cosine of the ray to the triangle's front, below 0 if
    /// the ray comes from behind. Returns `None` where the triangle is dark.
    pub fn emitted_radiance(&self, direction: Vec3, cos: f32) -> Option<EmittedRadiance> {
        match &self.emitter {
            Emitter::LuminaireArea { surface, intensity } => {
                let (towards, area) = (intensity.towards(-direction), surface.area() as f32);
                let radiance = towards / (area * cos.abs());
                (towards > 0.0 && cos != 0.0).then_some(EmittedRadiance { radiance, area })
            }
            Emitter::Area { surface, two_sided } if cos > 0.0 || *two_sided => {
                let area = surface.area() as f32;
                let sides = if *two_sided { 2.0 } else { 1.0 };
                Some(EmittedRadiance { radiance: 1.0 / (PI * area * sides), area })
            }
            _ => None,
        }
    }

    /// Returns where a ray enters a tube from outside, with the cosine there. The intersection is
    /// computed in double precision and from the point of the ray that is nearest to the axis: at a
    /// distance of many radii, the square of that distance in single precision would leave nothing
    /// of the radius.
    pub fn tube_hit(&self, ray: &Ray) -> Option<EmitterHit> {
        let Emitter::Tube { line, frame, radius, aperture } = &self.emitter else { return None };
        let (r, from) = (f64::from(*radius), line.from.as_dvec3());
        let (origin, direction) = (ray.origin.as_dvec3() - from, ray.direction.as_dvec3());
        let [x, y, z] = [frame.tangent, frame.bitangent, frame.normal].map(Vec3::as_dvec3);
        let across = |v: DVec3| DVec2::new(v.dot(x), v.dot(y));
        let (o, d) = (across(origin), across(direction));
        let d2 = d.length_squared();
        // half of the chord that the ray cuts off the cylinder, seen along the axis
        let half2 = r * r - o.perp_dot(d).powi(2) / d2;
        let is_outside = o.length_squared() > r * r;
        if !(half2 > 0.0 && is_outside) {
            return None;
        }
        let half = half2.sqrt();
        let t = -o.dot(d) / d2 - half / d2.sqrt();
        let height = origin.dot(z) + t * direction.dot(z);
        let along = (0.0..=f64::from(line.length)).contains(&height);
        if t <= 0.0 || !along || !aperture.holds(o + t * d) {
            return None;
        }
        let area = aperture.area(*radius, line.length);
        let cos = (half * d2.sqrt() / r) as f32;
        Some(EmitterHit {
            t: t as f32,
            cos,
            emitted: EmittedRadiance { radiance: 1.0 / (PI * area), area },
            image: [0, 0],
        })
    }
}

impl Emitter {
    /// Returns middle and radius, m, of a ball around the light.
    pub(super) fn ball(&self) -> (Vec3, f32) {
        match self {
            Self::Cone { position, .. } | Self::Luminaire { position, .. } => (*position, 0.0),
            Self::IsotropicLine(line) => (line.middle(), 0.5 * line.length),
            Self::Tube { line, radius, .. } => (line.middle(), 0.5 * line.length + radius),
            Self::Area { surface, .. } | Self::LuminaireArea { surface, .. } => {
                let corners = || surface.triangles.iter().flat_map(|t| [t.a, t.b, t.c]);
                let min = corners().fold(Vec3::INFINITY, Vec3::min);
                let max = corners().fold(Vec3::NEG_INFINITY, Vec3::max);
                (0.5 * (min + max), 0.5 * min.distance(max))
            }
            Self::Infinite(_) => (Vec3::ZERO, f32::INFINITY),
        }
    }
}

/// Returns 1 - cos of the angle between two unit vectors, accurate also where they are nearly the
/// same.
pub(super) fn versine_between(a: Vec3, b: Vec3) -> f32 {
    let cos = a.dot(b);
    if cos > 0.0 { a.cross(b).length_squared() / (1.0 + cos) } else { 1.0 - cos }
}

/// Describes a point that was sampled uniformly from a Lambertian surface of `area` m2 with so many
/// `sides`. Returns `None` where `point` is behind it.
fn seen(point: Vec3, chosen: &Chosen, area: f32, sides: f32) -> Option<Seen> {
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
