//! Tubes: the lateral surfaces of cylinders, or parts of them, with Lambertian light. Where the
//! radius is 0 a tube is a line, whose intensity is in proportion to the sine of the angle to it.

use std::f32::consts::PI;

use glam::{DVec2, DVec3, Vec2, Vec3};

use super::{
    area::{leave, seen},
    cone::frame_along,
    emitter::{EmittedRadiance, Emitter, EmitterHit, Seen, Start},
    line::{Line, check_axis},
    shape::{Outline, Unplaced},
    surface::Chosen,
};
use crate::{
    error::{Problem, check_range},
    math::{
        geometry::{Extent, Frame, ROUNDING, Ray, unit_vector},
        rng::Stream,
        sampling::{cosine_hemisphere_density, uniform_circle},
    },
};

/// Returns the unit vector across a tube's `axis` towards the middle of the part that shines.
/// Error: `toward` is along the axis, or the opening, degrees, is outside (0, 360].
pub fn check_aperture(axis: DVec3, toward: DVec3, opening: f64) -> Result<DVec3, Problem> {
    if !(opening > 0.0 && opening <= 360.0) {
        let remedy = "it is the part of the circumference that shines, in degrees";
        let problem = format!("opening_deg: {opening}, must be above 0 and at most 360");
        return Err(Problem::new(problem, remedy));
    }
    let across = unit_vector(toward).map(|v| v.reject_from_normalized(axis));
    across.filter(|v| v.length() > 1e-6).and_then(unit_vector).ok_or_else(|| {
        let problem = "toward: has no part across the tube";
        Problem::new(problem, "say to which side of its axis the tube shines")
    })
}

/// Fraction of a tube's circumference that shines, centred on the tangent of the tube's frame.
#[derive(Clone, Copy, Debug)]
struct Aperture(f32);

impl Aperture {
    /// Returns a unit vector turned from the tangent by an angle that is uniform in the aperture,
    /// where `u` is a uniform number.
    #[inline]
    fn turn(self, u: f32) -> Vec2 {
        if self.0 == 1.0 {
            return uniform_circle(u);
        }
        let turn = self.0 * (u - 0.5);
        uniform_circle(if turn < 0.0 { turn + 1.0 } else { turn })
    }

    /// Returns whether a vector across the axis, in coordinates along tangent and bitangent, points
    /// into the aperture.
    fn holds(self, across: DVec2) -> bool {
        self.0 == 1.0 || across.y.atan2(across.x).abs() <= std::f64::consts::PI * f64::from(self.0)
    }
}

/// A tube.
#[derive(Clone, Debug)]
pub struct Tube {
    line: Line,
    /// Its normal lies along the axis, its tangent towards the middle of the part that shines.
    frame: Frame,
    radius: f32,
    aperture: Aperture,
}

impl Tube {
    /// Makes a tube of which all shines, between two points and of a radius, m. With a radius of 0 it
    /// is a line. Error: it has no length, or a radius below 0.
    pub fn whole(from: DVec3, to: DVec3, radius: f64) -> Result<Unplaced<Self>, Problem> {
        let axis = check_axis(to - from)?;
        check_range(radius, 0.0, f64::MAX).map_err(|problem| problem.of("radius"))?;
        Ok(Self::around([from, to], radius, frame_along(axis), 1.0))
    }

    /// Makes a tube that shines `toward` one side, within an angle `opening`, rad, about its axis.
    /// Error: it has no length or no radius, the side is along the axis, or the angle outside
    /// (0, 2 pi].
    pub fn part(
        from: DVec3,
        to: DVec3,
        radius: f64,
        toward: DVec3,
        opening: f64,
    ) -> Result<Unplaced<Self>, Problem> {
        check_range(radius, f64::MIN_POSITIVE, f64::MAX).map_err(|problem| problem.of("radius"))?;
        let axis = check_axis(to - from)?;
        let tangent = check_aperture(axis, toward, opening.to_degrees())?;
        let frame = Frame {
            tangent: tangent.as_vec3(),
            bitangent: axis.cross(tangent).as_vec3(),
            normal: axis.as_vec3(),
        };
        let aperture = (opening / std::f64::consts::TAU) as f32;
        Ok(Self::around([from, to], radius, frame, aperture))
    }

    fn around([from, to]: [DVec3; 2], radius: f64, frame: Frame, aperture: f32) -> Unplaced<Self> {
        Unplaced::new(Outline::Around([from, to], radius), move |center| {
            let (line, radius) = (Line::new(from, to, center), radius as f32);
            Self { line, frame, radius, aperture: Aperture(aperture) }
        })
    }

    /// Returns the area that shines, m2.
    fn area(&self) -> f32 {
        2.0 * PI * self.radius * self.line.length * self.aperture.0
    }

    /// Returns the point of the surface beside a point of the axis, turned from the tangent by an
    /// angle of the aperture.
    #[inline]
    fn beside(&self, on_axis: Vec3, turn: Vec2) -> Chosen {
        let normal = turn.x * self.frame.tangent + turn.y * self.frame.bitangent;
        // the distance at which photons start
        let offset = self.line.blur + ROUNDING * self.radius;
        Chosen { point: on_axis + self.radius * normal, normal, offset }
    }

    /// Returns the irradiance that a point of a line, a tube of radius 0, brings to a plane across
    /// the line of sight at `away`, per W of the light's power, 1/m2.
    fn of_line(&self, away: Vec3) -> f32 {
        let d2 = away.length_squared();
        let sin = away.reject_from_normalized(self.frame.normal).length() / d2.sqrt();
        sin / (PI * PI * d2)
    }
}

impl Emitter for Tube {
    fn extent(&self) -> Extent {
        let r = Vec3::splat(self.radius);
        let ends = [self.line.from, self.line.from + self.line.whole];
        Extent::of(ends.into_iter().flat_map(|p| [p - r, p + r]))
    }

    fn ball(&self) -> (Vec3, f32) {
        (self.line.middle(), 0.5 * self.line.length + self.radius)
    }

    #[inline]
    fn emit(&self, rng: &mut Stream) -> (Start, Ray) {
        let turn = self.aperture.turn(rng.uniform());
        leave(self.beside(self.line.choose(rng), turn), rng)
    }

    fn density(&self, start: &Start, direction: Vec3) -> f32 {
        cosine_hemisphere_density(start.normal.dot(direction))
    }

    fn choose_point(&self, point: Vec3, rng: &mut Stream) -> Option<Seen> {
        let on_axis = self.line.choose(rng);
        if self.radius == 0.0 {
            return Some(Seen::of_point(on_axis, self.of_line(point - on_axis)));
        }
        let turn = self.aperture.turn(rng.uniform());
        seen(point, &self.beside(on_axis, turn), self.area(), 1.0)
    }

    fn is_delta(&self) -> bool {
        self.radius == 0.0
    }

    fn irradiance(&self, away: Vec3) -> Option<f32> {
        (self.radius == 0.0).then(|| self.of_line(away))
    }

    fn exitance(&self) -> Option<f32> {
        (self.radius > 0.0).then(|| 1.0 / self.area())
    }

    /// The intersection is computed in double precision and from the point of the ray that is nearest
    /// to the axis: at a distance of many radii, the square of that distance in single precision would
    /// leave nothing of the radius.
    fn hit(&self, ray: &Ray) -> Option<EmitterHit> {
        let Self { line, frame, radius, aperture } = self;
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
        let area = self.area();
        let cos = (half * d2.sqrt() / r) as f32;
        Some(EmitterHit {
            t: t as f32,
            cos,
            emitted: EmittedRadiance { radiance: 1.0 / (PI * area), area },
            image: [0, 0],
        })
    }

    fn radius(&self) -> f32 {
        self.radius
    }

    fn places(&self, pieces: usize) -> Vec<Vec3> {
        self.line.places(pieces)
    }

    fn along(&self) -> Option<Vec3> {
        Some(self.line.along())
    }

    fn facing(&self) -> Option<(Vec3, bool)> {
        (self.aperture.0 < 1.0).then_some((self.frame.tangent, false))
    }

    fn position_mut(&mut self) -> Option<&mut Vec3> {
        Some(&mut self.line.from)
    }
}
