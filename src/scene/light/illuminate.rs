//! Lights as a point of the scene sees them.

use std::f32::consts::PI;

use glam::{DVec2, DVec3, Vec3};

use super::{Emitter, Light};
use crate::{
    math::{
        geometry::{Ray, Triangle},
        rng::Stream,
        spectrum::{Lanes, Spectrum},
    },
    scene::daylight::DirectionSample,
};

/// Where a light that was sampled is.
#[derive(Clone, Copy, Debug)]
pub enum Toward {
    /// A point of it, a little off its surface, m.
    Point(Vec3),
    /// A direction, unit vector: it is infinitely far away.
    Direction(Vec3),
}

/// A direction that was chosen because a light may shine from there.
#[derive(Clone, Copy, Debug)]
pub struct LightSample<L> {
    /// Where a shadow ray goes.
    pub target: Toward,
    /// Radiance over the density of the choice: the irradiance that it brings across its direction, per band,
    /// W/m2 or umol/m2/s.
    pub radiance_over_pdf: Spectrum<L>,
    /// Density of the choice, 1/sr; none for a light that no direction meets by chance (a point, a line, parallel
    /// rays).
    pub pdf: Option<f32>,
    /// The irradiance per W of the light's power, 1/m2; 0 of a light at infinity.
    pub per_watt: f32,
}

/// How bright a light's surface is, per W of its power.
#[derive(Clone, Copy, Debug)]
pub struct EmittedRadiance {
    /// Radiance, 1/(m2 sr).
    pub radiance: f32,
    /// Area that emits, m2.
    pub area: f32,
}

/// Where a ray meets the bright side of a light's surface.
#[derive(Clone, Copy, Debug)]
pub struct EmitterHit {
    /// Distance along the ray, m.
    pub t: f32,
    /// Cosine to the surface's normal, above 0.
    pub cos: f32,
    /// How bright it is there.
    pub emitted: EmittedRadiance,
}

impl EmitterHit {
    /// Density of its direction as seen from a `point` of the ray's line, 1/sr, where a point of the surface is
    /// chosen uniformly.
    pub fn pdf_toward(&self, point: Vec3, ray: &Ray) -> f32 {
        ray.at(self.t).distance_squared(point) / (self.emitted.area * self.cos)
    }
}

/// A light that a ray meets.
#[derive(Clone, Copy, Debug)]
pub struct LightHit {
    /// Index of the light.
    pub light: usize,
    /// Where on its surface; none of a light at infinity.
    pub on: Option<EmitterHit>,
}

/// A chosen point of a light as seen from a point of the scene.
struct Seen {
    /// A little off the surface.
    point: Vec3,
    /// Irradiance across the line of sight over the density of the choice, per W, 1/m2.
    per_watt: f32,
    /// 1/sr.
    pdf: Option<f32>,
}

impl Light {
    /// Whether it is a point or a line, which no ray can hit, or the sun, which none hits by chance.
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

    /// Power that leaves its surface, per m2 and W of its power, 1/m2: the mean over it; none of a light without a surface.
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

    /// The triangles that emit, for an area light.
    pub fn triangles(&self) -> &[Triangle] {
        match &self.emitter {
            Emitter::Area { surface, .. } | Emitter::LuminaireArea { surface, .. } => {
                &surface.triangles
            }
            _ => &[],
        }
    }

    /// About the irradiance at `point` per W of its power, 1/m2, for choosing among lights; zero only
    /// where it sheds no light directly. `normal`: of a face that light from behind does not reach.
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
                // a little more than the cone, for rounding
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

    /// One over the squared distance of `point` from the middle of the light but, close by, not more than over that of its rim,
    /// 1/m2.
    pub fn nearness(&self, point: Vec3) -> f32 {
        let (middle, radius) = self.ball;
        let d2 = point.distance_squared(middle);
        1.0 / d2.max(radius * radius).max(f32::MIN_POSITIVE)
    }

    /// The irradiance that one of its points brings as far `away`, across the line of sight, per W, 1/m2; none of a light that
    /// has a surface.
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

    /// Chooses a direction in which a `point` may see the light: towards a point of it, as far from its edges as
    /// [`emit`](Self::emit) starts, or towards a part of the sky. None where it sheds no light this way.
    pub fn sample_toward<L: Lanes>(
        &self,
        point: Vec3,
        offset: f32,
        rng: &mut Stream,
    ) -> Option<LightSample<L>> {
        if let Emitter::Infinite(entrance) = &self.emitter {
            let DirectionSample { toward, radiance_over_pdf, pdf } = entrance.light.sample(rng)?;
            let target = Toward::Direction(toward);
            return Some(LightSample { target, radiance_over_pdf, pdf, per_watt: 0.0 });
        }
        let Seen { point, per_watt, pdf } = self.choose_point(point, offset, rng)?;
        let radiance_over_pdf = self.spectrum::<L>().scaled(per_watt);
        Some(LightSample { target: Toward::Point(point), radiance_over_pdf, pdf, per_watt })
    }

    /// Density with which [`sample_toward`](Self::sample_toward) from `point` chooses the direction of a ray that comes
    /// from there, straight or through panes, and meets the light at `on`, 1/sr.
    pub fn pdf_toward(&self, point: Vec3, ray: &Ray, on: Option<&EmitterHit>) -> f32 {
        match on {
            Some(hit) => hit.pdf_toward(point, ray),
            None => self.entrance().map_or(0.0, |entrance| entrance.light.pdf(ray.direction)),
        }
    }

    /// Radiance that comes back along a ray that meets the light at `on`, per band, W/m2/sr or umol/m2/s/sr; that of
    /// parallel rays not included.
    pub fn radiance<L: Lanes>(&self, ray: &Ray, on: Option<&EmitterHit>) -> Spectrum<L> {
        match (on, self.entrance()) {
            (Some(hit), _) => self.spectrum().scaled(hit.emitted.radiance),
            (None, Some(entrance)) => entrance.light.radiance(ray.direction),
            (None, None) => Spectrum::from_fn(self.power.len(), |_| 0.0),
        }
    }

    /// The same but of suns, which are too small for chance.
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

    /// Its power in lanes, W or umol/s.
    pub fn spectrum<L: Lanes>(&self) -> Spectrum<L> {
        Spectrum::from_fn(self.power.len(), |b| self.power.get(b).map_or(0.0, |p| *p as f32))
    }

    /// Chooses a point of a light that is not infinitely far away.
    fn choose_point(&self, point: Vec3, offset: f32, rng: &mut Stream) -> Option<Seen> {
        match &self.emitter {
            Emitter::Cone { position, frame, versine } => {
                let away = point - *position;
                let d2 = away.length_squared();
                let per_watt = 1.0 / (2.0 * PI * versine * d2);
                let inside = versine_between(frame.normal, away / d2.sqrt()) <= *versine;
                inside.then_some(Seen { point: *position, per_watt, pdf: None })
            }
            Emitter::IsotropicLine(line) => {
                let on_axis = line.choose(offset, rng);
                let per_watt = 1.0 / (4.0 * PI * point.distance_squared(on_axis));
                Some(Seen { point: on_axis, per_watt, pdf: None })
            }
            Emitter::Tube { line, frame, radius, aperture } => {
                let on_axis = line.choose(offset, rng);
                if *radius == 0.0 {
                    let away = point - on_axis;
                    let d2 = away.length_squared();
                    let sin = away.reject_from_normalized(frame.normal).length() / d2.sqrt();
                    let per_watt = sin / (PI * PI * d2);
                    return Some(Seen { point: on_axis, per_watt, pdf: None });
                }
                let turn = aperture.turn(rng.uniform());
                let normal = turn.x * frame.tangent + turn.y * frame.bitangent;
                let area = aperture.area(*radius, line.length);
                seen(point, on_axis + *radius * normal, normal, area, 1.0, offset)
            }
            Emitter::Area { surface, two_sided } => {
                let (on_light, normal) = surface.choose(offset, rng);
                let (normal, sides) = match two_sided {
                    true if (point - on_light).dot(normal) < 0.0 => (-normal, 2.0),
                    true => (normal, 2.0),
                    false => (normal, 1.0),
                };
                seen(point, on_light, normal, surface.area() as f32, sides, offset)
            }
            Emitter::Luminaire { position, intensity } => {
                let away = point - *position;
                let towards = intensity.towards(away.normalize_or_zero());
                let per_watt = towards / away.length_squared();
                (towards > 0.0).then_some(Seen { point: *position, per_watt, pdf: None })
            }
            Emitter::LuminaireArea { surface, intensity } => {
                let (on_light, normal) = surface.choose(offset, rng);
                let away = point - on_light;
                let d2 = away.length_squared();
                let direction = away.normalize_or_zero();
                let (towards, cos) = (intensity.towards(direction), direction.dot(normal));
                (towards > 0.0 && cos != 0.0).then(|| Seen {
                    point: on_light + offset * cos.signum() * normal,
                    per_watt: towards / d2,
                    pdf: Some(d2 / (surface.area() as f32 * cos.abs())),
                })
            }
            Emitter::Infinite(_) => None,
        }
    }

    /// Radiance per W of power, 1/(m2 sr), of an area light's triangle for a ray that meets it along `direction`, with
    /// the cosine `cos` to its front, below zero from behind, and the area that emits, m2; none where it is dark.
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

    /// Where a ray enters a tube from outside, and the cosine there. In double precision, and from the
    /// point of the ray that is nearest to the axis: of a distance of many radii, squared, single
    /// precision would leave nothing of the radius.
    pub fn tube_hit(&self, ray: &Ray) -> Option<EmitterHit> {
        let Emitter::Tube { line, frame, radius, aperture } = &self.emitter else { return None };
        let (r, from) = (f64::from(*radius), line.from.as_dvec3());
        let (origin, direction) = (ray.origin.as_dvec3() - from, ray.direction.as_dvec3());
        let [x, y, z] = [frame.tangent, frame.bitangent, frame.normal].map(Vec3::as_dvec3);
        let across = |v: DVec3| DVec2::new(v.dot(x), v.dot(y));
        let (o, d) = (across(origin), across(direction));
        let d2 = d.length_squared();
        // half of what the ray cuts off the cylinder, seen along the axis
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
        })
    }
}

impl Emitter {
    /// Middle and radius of a ball around it.
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

/// 1 - cos of the angle between two unit vectors, exact where they are nearly the same.
pub(super) fn versine_between(a: Vec3, b: Vec3) -> f32 {
    let cos = a.dot(b);
    if cos > 0.0 { a.cross(b).length_squared() / (1.0 + cos) } else { 1.0 - cos }
}

/// A point chosen uniformly from a Lambertian surface of `area` with so many `sides`.
fn seen(
    point: Vec3,
    on_light: Vec3,
    normal: Vec3,
    area: f32,
    sides: f32,
    offset: f32,
) -> Option<Seen> {
    let away = point - on_light;
    let d2 = away.length_squared();
    let cos = away.dot(normal) / d2.sqrt();
    (cos > 0.0).then(|| Seen {
        point: on_light + offset * normal,
        per_watt: cos / (PI * sides * d2),
        pdf: Some(d2 / (area * cos)),
    })
}
