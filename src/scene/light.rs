//! Where photons start: point, spot, tube and area lights.

use std::{collections::BinaryHeap, sync::Arc};

use glam::{DVec2, DVec3, Vec2, Vec3};

use crate::{
    error::{Problem, check_length, check_range, number},
    math::{
        geometry::{Extent, Frame, Ray, Triangle, unit_vector},
        rng::Stream,
        sampling::{
            Chosen, cosine_hemisphere, uniform_circle, uniform_cone, uniform_triangle,
            weighted_choice,
        },
        spectrum::{Lanes, Spectrum},
    },
    scene::daylight::InfiniteLight,
};

mod entrance;
mod illuminate;
mod intensity;
mod start;
#[cfg(test)]
mod tests;

pub use entrance::{Entrance, MARGIN};
pub use illuminate::{EmittedRadiance, LightSample, TubeHit};
pub use intensity::{Intensity, IntensityTable};
pub use start::Start;

/// Shape and direction pattern of a light, in metres from the user's origin.
#[derive(Clone, Debug)]
pub enum LightShape {
    /// A point, alike in all directions.
    Point {
        /// Where it is.
        position: DVec3,
    },
    /// A point with uniform intensity inside a cone.
    Spot {
        /// Where it is.
        position: DVec3,
        /// Axis of the cone; not zero.
        direction: DVec3,
        /// Half angle of the cone, rad, in (0, pi].
        half_angle: f64,
    },
    /// Lateral surface of a cylinder, Lambertian.
    Tube {
        /// One end of the axis.
        from: DVec3,
        /// The other end, not the same.
        to: DVec3,
        /// Radius, m; 0 is the line (intensity ~ sine of the angle to the axis).
        radius: f64,
    },
    /// The part of a cylinder's lateral surface within an angle, Lambertian.
    ApertureTube {
        /// One end of the axis.
        from: DVec3,
        /// The other end, not the same.
        to: DVec3,
        /// Radius, m, above 0.
        radius: f64,
        /// The middle of the part that shines, as seen from the axis; not along it.
        toward: DVec3,
        /// How much of the circumference shines, rad, in (0, 2 pi].
        opening: f64,
    },
    /// Points uniform on a line, directions uniform on the sphere.
    IsotropicLine {
        /// One end.
        from: DVec3,
        /// The other end.
        to: DVec3,
    },
    /// Triangles, Lambertian from the front, or from both sides.
    Area {
        /// Corners, counter-clockwise seen from the front; total area above zero.
        triangles: Vec<[DVec3; 3]>,
        /// Whether the back emits too.
        two_sided: bool,
    },
    /// A point whose intensity depends on the direction.
    Luminaire {
        /// Where it is.
        position: DVec3,
        /// Into which directions it shines.
        intensity: Intensity,
    },
    /// Triangles of which every point shines with the same intensity, from the front where that goes to the
    /// front, from the back where it goes to the back: with the radiance I / (area x |cosine|).
    LuminaireArea {
        /// Corners, counter-clockwise seen from the front; total area above zero.
        triangles: Vec<[DVec3; 3]>,
        /// Into which directions it shines.
        intensity: Intensity,
    },
    /// Infinitely far away: what enters the scene's box is its power.
    Infinite(InfiniteLight),
}

/// Powers that single precision can carry, W or umol/s.
const POWERS: std::ops::RangeInclusive<f64> = 1e-30..=1e30;

/// What a check of a value finds.
type Checked = Result<(), Problem>;

/// Refuses all but one power that single precision can carry for each of so many bands.
pub fn check_power(power: &[f64], bands: usize) -> Checked {
    check_length(power.len(), bands).map_err(|problem| problem.of("power"))?;
    power.iter().try_for_each(|&power| {
        check_range(power, 0.0, f64::MAX).map_err(|problem| problem.of("power"))?;
        if power == 0.0 || POWERS.contains(&power) {
            return Ok(());
        }
        let problem = format!("emits {} W or umol/s in a band", number(power));
        Err(Problem::new(problem, "it must be 0, or from 1e-30 to 1e30"))
    })
}

/// The unit vector of the axis of a spot; refuses one of length 0.
pub fn check_direction(direction: DVec3) -> Result<DVec3, Problem> {
    unit_vector(direction).ok_or_else(|| {
        let remedy = "say where the spot points: [0, 0, -1] is down";
        Problem::new("a direction of length 0", remedy)
    })
}

/// Refuses a half angle of a cone, degrees, outside (0, 180].
pub fn check_half_angle(degrees: f64) -> Checked {
    if degrees > 0.0 && degrees <= 180.0 {
        return Ok(());
    }
    let remedy = "it is the angle between the axis and the rim, in degrees";
    Err(Problem::new(format!("{degrees}, must be above 0 and at most 180"), remedy))
}

/// The unit vector of the axis of a tube; refuses one of length 0.
pub fn check_axis(from: DVec3, to: DVec3) -> Result<DVec3, Problem> {
    unit_vector(to - from).ok_or_else(|| {
        let problem = "a tube of length 0: `from` is `to`";
        Problem::new(problem, "move one end, or take a point light")
    })
}

/// The unit vector across a tube's `axis` where it shines; refuses one along it, and an opening, degrees, outside
/// (0, 360].
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

/// Refuses triangles that together have no area.
pub fn check_area(area: f64) -> Checked {
    if area > 0.0 {
        return Ok(());
    }
    Err(Problem::new("an area light without area", "its corners must not lie on one line"))
}

impl LightShape {
    /// Refuses what cannot shine. That coordinates are finite is for the scene to check.
    pub fn check(&self) -> Checked {
        match self {
            Self::Point { .. } | Self::Luminaire { .. } | Self::Infinite(_) => Ok(()),
            Self::Spot { direction, half_angle, .. } => {
                check_direction(*direction).map_err(|problem| problem.of("direction"))?;
                let degrees = half_angle.to_degrees();
                check_half_angle(degrees).map_err(|problem| problem.of("half angle"))
            }
            Self::Tube { from, to, radius } => {
                check_axis(*from, *to)?;
                check_range(*radius, 0.0, f64::MAX).map_err(|problem| problem.of("radius"))
            }
            Self::ApertureTube { from, to, radius, toward, opening } => {
                check_range(*radius, f64::MIN_POSITIVE, f64::MAX)
                    .map_err(|problem| problem.of("radius"))?;
                let axis = check_axis(*from, *to)?;
                check_aperture(axis, *toward, opening.to_degrees()).map(|_| ())
            }
            Self::IsotropicLine { from, to } => check_axis(*from, *to).map(|_| ()),
            Self::Area { triangles, .. } | Self::LuminaireArea { triangles, .. } => {
                let area = |[a, b, c]: &[DVec3; 3]| 0.5 * (*b - *a).cross(*c - *a).length();
                check_area(triangles.iter().map(area).sum())
            }
        }
    }

    /// The triangles that it is made of, if it is.
    pub fn triangles(&self) -> &[[DVec3; 3]] {
        match self {
            Self::Area { triangles, .. } | Self::LuminaireArea { triangles, .. } => triangles,
            _ => &[],
        }
    }
}

/// A light: power per band and a way to emit it.
#[derive(Clone, Debug)]
pub struct Light {
    /// Unique name.
    pub name: String,
    /// Total emitted flux per band, W or umol/s, at least 0.
    pub power: Vec<f64>,
    emitter: Emitter,
    /// A ball around it: middle and radius, m.
    ball: (Vec3, f32),
}

#[derive(Clone, Debug)]
enum Emitter {
    Cone { position: Vec3, frame: Frame, versine: f32 },
    Tube { line: Line, frame: Frame, radius: f32, aperture: Aperture },
    IsotropicLine(Line),
    Area { surface: EmittingSurface, two_sided: bool },
    Luminaire { position: Vec3, intensity: Intensity },
    LuminaireArea { surface: EmittingSurface, intensity: Intensity },
    Infinite(Arc<Entrance>),
}

/// The share of a tube's circumference that shines, about the tangent of its frame.
#[derive(Clone, Copy, Debug)]
struct Aperture(f32);

impl Aperture {
    /// All around.
    const WHOLE: Self = Self(1.0);

    /// A turn from the tangent that is uniform in it, from a uniform number.
    #[inline]
    fn turn(self, u: f32) -> Vec2 {
        if self.0 == 1.0 {
            return uniform_circle(u);
        }
        let turn = self.0 * (u - 0.5);
        uniform_circle(if turn < 0.0 { turn + 1.0 } else { turn })
    }

    /// Whether it holds the turn of a vector from the tangent.
    fn holds(self, across: DVec2) -> bool {
        self.0 == 1.0 || across.y.atan2(across.x).abs() <= std::f64::consts::PI * f64::from(self.0)
    }

    /// Area of a tube within it, m2.
    fn area(self, radius: f32, length: f32) -> f32 {
        2.0 * std::f32::consts::PI * radius * length * self.0
    }
}

/// The axis of a tube, or a line that shines.
#[derive(Clone, Copy, Debug)]
struct Line {
    /// Its start, m.
    from: Vec3,
    /// From its start to its end, m.
    whole: Vec3,
    /// m.
    length: f32,
}

impl Line {
    fn new(from: Vec3, whole: Vec3) -> Self {
        Self { from, whole, length: whole.length() }
    }

    fn middle(&self) -> Vec3 {
        self.from + 0.5 * self.whole
    }

    /// A point uniform on it, `offset` from its ends.
    #[inline]
    fn choose(&self, offset: f32, rng: &mut Stream) -> Vec3 {
        let margin = (offset / self.length).min(0.5);
        self.from + rng.uniform().clamp(margin, 1.0 - margin) * self.whole
    }
}

/// The triangles of an area light, and what of them each photon needs.
#[derive(Clone, Debug, Default)]
struct EmittingSurface {
    triangles: Vec<Triangle>,
    normals: Vec<Vec3>,
    slopes: Vec<Vec3>,
    cumulative_area: Vec<f64>,
}

impl EmittingSurface {
    fn new(triangles: &[[DVec3; 3]], local: impl Fn(DVec3) -> Vec3) -> Self {
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
    fn area(&self) -> f64 {
        self.cumulative_area[self.cumulative_area.len() - 1]
    }

    /// A point uniform on it, as far as `offset` from the edges of its triangles, and the normal there.
    #[inline]
    fn choose(&self, offset: f32, rng: &mut Stream) -> (Vec3, Vec3) {
        let Chosen { index, rest } = weighted_choice(&self.cumulative_area, rng.uniform_fine());
        let weights = uniform_triangle(Vec2::new(rest, rng.uniform()));
        let margins = Triangle::margins(self.slopes[index], offset);
        let point = self.triangles[index].point_within(weights.x, weights.y, margins);
        (point, self.normals[index])
    }
}

impl Light {
    /// From its shape, with coordinates taken relative to `center`. The power of a light at infinity is what
    /// enters `inside`, a box relative to it.
    pub fn new(
        name: String,
        mut power: Vec<f64>,
        shape: &LightShape,
        center: DVec3,
        inside: &Extent,
    ) -> Self {
        let local = |p: DVec3| (p - center).as_vec3();
        let along = |v: DVec3| Frame::new(unit_vector(v).unwrap_or(DVec3::Z).as_vec3().normalize());
        let emitter = match shape {
            LightShape::Point { position } => Emitter::Cone {
                position: local(*position),
                frame: Frame::new(Vec3::Z),
                versine: 2.0,
            },
            LightShape::Spot { position, direction, half_angle } => Emitter::Cone {
                position: local(*position),
                frame: along(*direction),
                versine: (2.0 * (half_angle / 2.0).sin().powi(2)) as f32,
            },
            LightShape::Tube { from, to, radius } => Emitter::Tube {
                line: Line::new(local(*from), (*to - *from).as_vec3()),
                frame: along(*to - *from),
                radius: *radius as f32,
                aperture: Aperture::WHOLE,
            },
            LightShape::ApertureTube { from, to, radius, toward, opening } => {
                let axis = unit_vector(*to - *from).unwrap_or(DVec3::Z);
                let tangent = check_aperture(axis, *toward, opening.to_degrees())
                    .unwrap_or(axis.any_orthonormal_vector());
                Emitter::Tube {
                    line: Line::new(local(*from), (*to - *from).as_vec3()),
                    frame: Frame {
                        tangent: tangent.as_vec3(),
                        bitangent: axis.cross(tangent).as_vec3(),
                        normal: axis.as_vec3(),
                    },
                    radius: *radius as f32,
                    aperture: Aperture((opening / std::f64::consts::TAU) as f32),
                }
            }
            LightShape::IsotropicLine { from, to } => {
                Emitter::IsotropicLine(Line::new(local(*from), (*to - *from).as_vec3()))
            }
            LightShape::Area { triangles, two_sided } => {
                let surface = EmittingSurface::new(triangles, local);
                Emitter::Area { surface, two_sided: *two_sided }
            }
            LightShape::Luminaire { position, intensity } => {
                Emitter::Luminaire { position: local(*position), intensity: intensity.clone() }
            }
            LightShape::LuminaireArea { triangles, intensity } => {
                let surface = EmittingSurface::new(triangles, local);
                Emitter::LuminaireArea { surface, intensity: intensity.clone() }
            }
            LightShape::Infinite(light) => {
                let entrance = Entrance::new(light.clone(), power.len(), inside, local);
                for (b, power) in power.iter_mut().enumerate() {
                    *power = (0..entrance.doors()).map(|door| entrance.power(door)[b]).sum();
                }
                Emitter::Infinite(Arc::new(entrance))
            }
        };
        let ball = emitter.ball();
        Self { name, power, emitter, ball }
    }

    /// A box around it, m from the centre of the scene.
    pub fn extent(&self) -> Extent {
        match &self.emitter {
            Emitter::Cone { position, .. } | Emitter::Luminaire { position, .. } => {
                Extent::of([*position])
            }
            Emitter::Tube { line, radius, .. } => {
                let r = Vec3::splat(*radius);
                let ends = [line.from, line.from + line.whole];
                Extent::of(ends.into_iter().flat_map(|p| [p - r, p + r]))
            }
            Emitter::IsotropicLine(line) => Extent::of([line.from, line.from + line.whole]),
            Emitter::Area { surface, .. } | Emitter::LuminaireArea { surface, .. } => {
                Extent::of_triangles(&surface.triangles)
            }
            Emitter::Infinite(_) => Extent::EMPTY,
        }
    }

    /// Places where a surface may cut it, as far as it is a point, a line or a tube: on its axis, at the middles of so many
    /// equal pieces.
    pub(super) fn places(&self, pieces: usize) -> Vec<Vec3> {
        match &self.emitter {
            Emitter::Cone { position, .. } | Emitter::Luminaire { position, .. } => vec![*position],
            Emitter::Tube { line, .. } | Emitter::IsotropicLine(line) => {
                let at = |i: usize| line.from + (i as f32 + 0.5) / pieces as f32 * line.whole;
                (0..pieces).map(at).collect()
            }
            Emitter::Area { .. } | Emitter::LuminaireArea { .. } | Emitter::Infinite(_) => {
                Vec::new()
            }
        }
    }

    /// Unit vector along a line or tube.
    pub(super) fn along(&self) -> Option<Vec3> {
        match &self.emitter {
            Emitter::Tube { line, .. } | Emitter::IsotropicLine(line) => {
                Some(line.whole / line.length)
            }
            _ => None,
        }
    }

    /// Unit vector along the axis of a spot, unless it shines everywhere, or where a luminaire aims.
    pub(super) fn axis(&self) -> Option<Vec3> {
        match &self.emitter {
            Emitter::Cone { frame, versine, .. } if *versine < 2.0 => Some(frame.normal),
            Emitter::Luminaire { intensity, .. } => Some(intensity.axes().normal),
            _ => None,
        }
    }

    /// Radius of a tube, m; 0 for other lights.
    pub(super) fn tube_radius(&self) -> f32 {
        match &self.emitter {
            Emitter::Tube { radius, .. } => *radius,
            _ => 0.0,
        }
    }

    /// Middle of a ball around it.
    pub(super) fn middle(&self) -> Vec3 {
        self.ball.0
    }

    /// Moves a point, a spot, a line or a tube.
    pub(super) fn shift(&mut self, by: Vec3) {
        match &mut self.emitter {
            Emitter::Cone { position, .. } | Emitter::Luminaire { position, .. } => *position += by,
            Emitter::Tube { line, .. } | Emitter::IsotropicLine(line) => line.from += by,
            Emitter::Area { .. } | Emitter::LuminaireArea { .. } | Emitter::Infinite(_) => return,
        }
        self.ball.0 += by;
    }

    /// How its intensity depends on the direction, for a luminaire.
    pub fn intensity(&self) -> Option<&Intensity> {
        match &self.emitter {
            Emitter::Luminaire { intensity, .. } | Emitter::LuminaireArea { intensity, .. } => {
                Some(intensity)
            }
            _ => None,
        }
    }

    /// How it enters the scene, for a light at infinity.
    #[inline]
    pub fn entrance(&self) -> Option<&Entrance> {
        match &self.emitter {
            Emitter::Infinite(entrance) => Some(entrance),
            _ => None,
        }
    }

    /// How many strata its photons are of: one, or the doors that it enters by.
    pub fn sources(&self) -> usize {
        self.entrance().map_or(1, Entrance::doors)
    }

    /// Power of one of them, per band, W or umol/s.
    fn source_power(&self, source: usize) -> &[f64] {
        self.entrance().map_or(&self.power, |entrance| entrance.power(source))
    }

    /// The ray of one photon. It starts `offset` metres off a light that has a surface, and as far
    /// from the edges of a polygon and the ends of a line: a light that reaches from wall to wall
    /// must not shine behind them by rounding.
    #[inline]
    pub fn emit(&self, offset: f32, rng: &mut Stream) -> Ray {
        self.emit_from(offset, rng).1
    }

    /// The ray of one photon, and the place of the light that it starts from.
    #[inline]
    fn emit_from(&self, offset: f32, rng: &mut Stream) -> (Start, Ray) {
        match &self.emitter {
            Emitter::Cone { position, frame, versine } => {
                let direction = frame.to_world(uniform_cone(*versine, rng.square()));
                Start::of_point(*position, direction)
            }
            Emitter::Tube { line, frame, radius, aperture } => {
                let turn = aperture.turn(rng.uniform());
                let normal = turn.x * frame.tangent + turn.y * frame.bitangent;
                let on_axis = line.choose(offset, rng);
                leave(on_axis + *radius * normal, normal, offset, rng)
            }
            Emitter::IsotropicLine(line) => {
                let point = line.choose(offset, rng);
                Start::of_point(point, uniform_cone(2.0, rng.square()))
            }
            Emitter::Area { surface, two_sided } => {
                let (point, normal) = surface.choose(offset, rng);
                let front = !*two_sided || rng.uniform() < 0.5;
                leave(point, if front { normal } else { -normal }, offset, rng)
            }
            Emitter::Luminaire { position, intensity } => {
                Start::of_point(*position, intensity.sample(rng))
            }
            Emitter::LuminaireArea { surface, intensity } => {
                let (point, normal) = surface.choose(offset, rng);
                let direction = intensity.sample(rng);
                let side = normal * normal.dot(direction).signum();
                let start = Start { point, normal, both_sides: true };
                (start, Ray { origin: point + offset * side, direction })
            }
            Emitter::Infinite(entrance) => {
                let dark = || Ray { origin: Vec3::ZERO, direction: Vec3::NEG_Z };
                let ray = entrance.enter_anywhere(rng).unwrap_or_else(dark);
                Start::of_point(ray.origin, ray.direction)
            }
        }
    }
}

/// Strata of all lights: each needs a history of its own.
pub fn sources(lights: &[Light]) -> usize {
    lights.iter().map(Light::sources).sum::<usize>().max(1)
}

/// A ray with Lambertian direction from a surface.
#[inline]
fn leave(point: Vec3, normal: Vec3, offset: f32, rng: &mut Stream) -> (Start, Ray) {
    let start = Start { point, normal, both_sides: false };
    let direction = Frame::new(normal).to_world(cosine_hemisphere(rng.square()));
    (start, Ray { origin: point + offset * normal, direction })
}

/// A photon as it leaves its light.
pub struct Emission<'a, L> {
    /// Index of the light.
    pub light: usize,
    /// Index of its stratum.
    pub source: usize,
    /// Mean power of the photons of its stratum per lane, times the histories of the piece, W or umol/s.
    pub weights: &'a [f64],
    /// Where it starts.
    pub ray: Ray,
    /// The place of the light that it starts from; none of a light at infinity.
    pub start: Option<Start>,
    /// What it starts with, as a fraction of these `weights`: 1, or 0 in bands that the light does not emit;
    /// something else where the bands of a light at infinity come from different directions.
    pub power: Spectrum<L>,
}

/// How the histories of one piece are shared among the lights: which history belongs to which
/// light, and the power that each carries. A light at infinity has a stratum for each face that it enters by.
#[derive(Clone, Debug)]
pub struct Strata {
    /// Light of each stratum, and its index there.
    sources: Vec<(usize, usize)>,
    /// First rank of each stratum, and the number of histories at the end.
    first: Vec<u64>,
    stride: u64,
    /// Per stratum and lane: power of a photon x histories of the piece.
    weights: Vec<f64>,
    lanes: usize,
}

impl Strata {
    /// Shares `histories` (at least one for each of the [`sources`]) in proportion to the strata's largest
    /// band power, but at least 1 % / number of strata each.
    pub fn new(lights: &[Light], histories: u64, lanes: usize) -> Self {
        let mut sources: Vec<(usize, usize)> = Vec::with_capacity(lights.len());
        for (l, light) in lights.iter().enumerate() {
            sources.extend((0..light.sources()).map(|source| (l, source)));
        }
        let powers = sources.iter().map(|&(l, source)| lights[l].source_power(source));
        let powers: Vec<&[f64]> = powers.collect();
        // where all is dark
        if sources.is_empty() {
            sources.push((0, 0));
        }
        let counts = match powers.is_empty() {
            true => vec![histories],
            false => apportion(&powers, histories),
        };
        let mut first = vec![0];
        let mut weights = vec![0.0; sources.len() * lanes];
        for s in 0..sources.len() {
            first.push(first[s] + counts[s]);
            for (b, power) in powers.get(s).copied().unwrap_or_default().iter().enumerate() {
                weights[s * lanes + b] = power * (histories as f64 / counts[s] as f64);
            }
        }
        Self { sources, first, stride: golden_stride(histories), weights, lanes }
    }

    /// Number of histories.
    pub fn histories(&self) -> u64 {
        self.first[self.first.len() - 1]
    }

    /// The stratum of history `index`. Ranks follow a golden-ratio sequence, so that any run of
    /// neighbouring histories has nearly each stratum's share.
    #[inline]
    fn source(&self, index: u64) -> usize {
        // a piece has far fewer than 2^32 histories
        let rank = index * self.stride % self.histories();
        self.first.partition_point(|&first| first <= rank) - 1
    }

    /// Emits history `index`, from `offset` metres off its light.
    #[inline]
    pub fn emit<L: Lanes>(
        &self,
        lights: &[Light],
        index: u64,
        offset: f32,
        rng: &mut Stream,
    ) -> Emission<'_, L> {
        self.emit_of(lights, self.source(index), offset, rng)
    }

    /// Emits a history of stratum `source`.
    #[inline]
    fn emit_of<L: Lanes>(
        &self,
        lights: &[Light],
        source: usize,
        offset: f32,
        rng: &mut Stream,
    ) -> Emission<'_, L> {
        let (light, door) = self.sources[source];
        let weights = self.weights(source);
        let power = Spectrum::from_fn(self.lanes, |b| f32::from(weights[b] > 0.0));
        let (start, ray, power) = match lights[light].entrance() {
            Some(entrance) if entrance.doors() > 0 => {
                let (ray, factor) = entrance.enter(door, rng);
                (None, ray, power * factor)
            }
            Some(_) => (None, lights[light].emit(offset, rng), power),
            None => {
                let (start, ray) = lights[light].emit_from(offset, rng);
                (Some(start), ray, power)
            }
        };
        Emission { light, source, weights, ray, start, power }
    }

    /// Power of a photon of stratum `source` per lane, times the histories of the piece, W or umol/s.
    #[inline]
    pub fn weights(&self, source: usize) -> &[f64] {
        &self.weights[source * self.lanes..][..self.lanes]
    }

    /// Whether no path meets by chance the light of stratum `source`: that of a point, a line or the sun.
    pub fn is_delta(&self, lights: &[Light], source: usize) -> bool {
        let (light, door) = self.sources[source];
        match lights[light].entrance() {
            Some(entrance) => entrance.doors() > 0 && entrance.is_sun(door),
            None => lights[light].is_delta(),
        }
    }
}

impl Strata {
    /// Whether stratum `source` is light of a sun at infinity.
    pub fn is_sun(&self, lights: &[Light], source: usize) -> bool {
        let (light, door) = self.sources[source];
        let entrance = lights.get(light).and_then(Light::entrance);
        entrance.is_some_and(|entrance| entrance.doors() > 0 && entrance.is_sun(door))
    }
}

/// Whole numbers of histories: largest remainders, at least one each.
fn apportion(powers: &[&[f64]], histories: u64) -> Vec<u64> {
    let largest: Vec<f64> =
        powers.iter().map(|power| power.iter().copied().fold(0.0, f64::max)).collect();
    let total: f64 = largest.iter().sum();
    let least = 0.01 / powers.len() as f64;
    let shares: Vec<f64> = largest
        .iter()
        .map(|power| if total > 0.0 { (power / total).max(least) } else { 1.0 })
        .collect();
    let scale = histories as f64 / shares.iter().sum::<f64>();
    let mut counts: Vec<u64> =
        shares.iter().map(|share| ((share * scale).floor() as u64).max(1)).collect();
    let remainder = |counts: &[u64], l: usize| shares[l] * scale - counts[l] as f64;
    let mut rest = histories as i64 - counts.iter().sum::<u64>() as i64;
    let mut order: Vec<usize> = (0..powers.len()).collect();
    order.sort_by(|&a, &b| remainder(&counts, b).total_cmp(&remainder(&counts, a)));
    for &l in order.iter().cycle() {
        if rest <= 0 {
            break;
        }
        counts[l] += 1;
        rest -= 1;
    }
    // the minimum of one may have handed out too many: the largest give back
    let mut largest: BinaryHeap<(u64, usize)> =
        counts.iter().enumerate().map(|(l, &count)| (count, l)).collect();
    for _ in rest..0 {
        let mut top = largest.peek_mut().expect("there is a light");
        top.0 -= 1;
        counts[top.1] -= 1;
    }
    counts
}

/// The first number from the golden section of `n` up that has no common divisor with it.
fn golden_stride(n: u64) -> u64 {
    let golden = (n as f64 * 0.618_033_988_749_895) as u64;
    let coprime = |&k: &u64| gcd(k, n) == 1;
    (golden.max(1)..=n.max(1)).find(coprime).unwrap_or(1)
}

fn gcd(a: u64, b: u64) -> u64 {
    if b == 0 { a } else { gcd(b, a % b) }
}
