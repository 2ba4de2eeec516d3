//! Entry of light from infinitely far away into a scene, through the faces of a box around
//! everything that it may meet. Because a line enters a box only once, the faces divide the light
//! exactly. Where the light has openings, it enters through these instead.

use std::{fmt, sync::Arc};

use glam::{DVec3, Vec2, Vec3};

use super::emitter::{Emitter, Seen, Start};
use crate::{
    math::{
        geometry::{Extent, Ray, Triangle, closeness, triangulate},
        rng::Stream,
        sampling::{Chosen, uniform_triangle, weighted_choice},
        spectrum::{Lanes, Spectrum},
    },
    scene::{
        daylight::{InfiniteEntry, InfiniteLight},
        lattice::Lattice,
    },
};

/// Multiple of what rounding takes for one place by which the box is wider than its contents on
/// each side.
pub const MARGIN: f32 = 16.0;

/// Fraction of all light below which the light of one part through one face is left out.
const LEAST: f64 = 1e-9;

/// A prism around everything that light from infinitely far away may meet: a box, or the cell of a
/// scene that repeats, which has no faces towards its neighbours.
#[derive(Clone, Copy, Debug)]
pub struct Prism {
    /// One of its corners, m.
    pub corner: Vec3,
    /// Its edges from there, m.
    pub edges: [Vec3; 3],
    /// Whether light comes in by the two faces across each edge: that at the corner, and the far one.
    pub entered: [[bool; 2]; 3],
    /// Normal of the slope from below which no light comes, a unit vector.
    pub hillside: Option<DVec3>,
}

impl From<Extent> for Prism {
    fn from(extent: Extent) -> Self {
        let size = extent.size();
        let edges = [0, 1, 2].map(|axis| size[axis] * Vec3::AXES[axis]);
        Self { corner: extent.min, edges, entered: [[true; 2]; 3], hillside: None }
    }
}

impl Prism {
    /// Returns the prism around the cell of a scene that repeats: as high as `corners` reach above its
    /// slope, and along an axis on which nothing repeats as wide as the box `around` them.
    pub fn of_cell(
        lattice: &Lattice,
        around: &Extent,
        corners: impl Iterator<Item = Vec3>,
    ) -> Self {
        let levels = corners.map(|corner| lattice.level(corner.as_dvec3()));
        let (low, high) = levels
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), z| (low.min(z), high.max(z)));
        let (low, high) = if low <= high { (low, high) } else { (0.0, 0.0) };
        let margin = f64::from(MARGIN * closeness(around.max.abs().max(around.min.abs())));
        let (low, high) = (low - margin, high + margin);
        let mut corner = DVec3::new(0.0, 0.0, low);
        let mut edges = [DVec3::ZERO, DVec3::ZERO, (high - low) * DVec3::Z];
        // from within a hill comes no light
        let hillside = lattice.hillside();
        let mut entered = [[true; 2], [true; 2], [hillside.is_none(), true]];
        for axis in 0..2 {
            let along = DVec3::AXES[axis];
            match lattice.period(axis) {
                Some(period) => {
                    let rise = period.rise / period.length * DVec3::Z;
                    corner += period.from * (along + rise);
                    edges[axis] = period.length * (along + rise);
                    entered[axis] = [false; 2];
                }
                None => {
                    corner[axis] = f64::from(around.min[axis]);
                    edges[axis] = f64::from(around.max[axis] - around.min[axis]) * along;
                }
            }
        }
        let edges = edges.map(|edge| edge.as_vec3());
        Self { corner: corner.as_vec3(), edges, entered, hillside }
    }
}

/// A light at infinity, with the faces by which it enters a scene.
#[derive(Debug)]
pub struct Entrance {
    /// The light itself.
    pub light: InfiniteLight,
    faces: Vec<EntryFace>,
    /// Triangles of the openings, if the light comes in through openings alone; empty if it comes
    /// in everywhere.
    openings: Vec<Triangle>,
    /// Running sums of the powers of the faces, over all bands.
    running: Vec<f64>,
    /// Estimate of the irradiance, W/m2: the mean over all orientations of a plane, in the
    /// brightest band of each part.
    irradiance: f32,
}

/// A face of the box or an opening, and the part of the light that enters there.
#[derive(Debug)]
pub struct EntryFace {
    entry: InfiniteEntry,
    opening: Opening,
    /// Flux that enters per band, W or umol/s.
    power: Vec<f64>,
    /// Whether the light is that of a sun, which paths do not find by chance.
    is_sun: bool,
}

/// Area through which light comes in.
#[derive(Clone, Debug)]
enum Opening {
    /// Face of the box: a corner, and the vectors along its two sides, m.
    Face { corner: Vec3, sides: [Vec3; 2] },
    /// Polygon as triangles, with running sums of their areas, m2.
    Polygon { triangles: Vec<Triangle>, areas: Vec<f64> },
}

impl Opening {
    /// Draws a point uniform on the area.
    fn choose(&self, rng: &mut Stream) -> Vec3 {
        match self {
            Self::Face { corner, sides } => {
                let u = rng.square();
                *corner + u.x * sides[0] + u.y * sides[1]
            }
            Self::Polygon { triangles, areas } => {
                let Chosen { index, rest } = weighted_choice(areas, rng.uniform_fine());
                let weights = uniform_triangle(Vec2::new(rest, rng.uniform()));
                triangles[index].point(weights.x, weights.y)
            }
        }
    }

    /// Returns a point of the plane, and the area times the unit normal, m2.
    fn plane(&self) -> (Vec3, Vec3) {
        match self {
            Self::Face { corner, sides: [u, v] } => (*corner, u.cross(*v)),
            Self::Polygon { triangles, areas } => {
                let area = areas.last().copied().unwrap_or(0.0);
                (triangles[0].a, area as f32 * triangles[0].normal())
            }
        }
    }

    /// Returns whether a point of the plane lies on the area.
    fn holds(&self, point: Vec3) -> bool {
        match self {
            Self::Face { corner, sides } => sides.iter().all(|side| {
                let along = (point - *corner).dot(*side);
                (0.0..=side.length_squared()).contains(&along)
            }),
            Self::Polygon { triangles, .. } => {
                let normal = triangles[0].normal();
                let ray = Ray { origin: point + normal, direction: -normal };
                triangles.iter().any(|triangle| triangle.crossed_at(&ray).is_some())
            }
        }
    }
}

impl EntryFace {
    /// Returns the area, m2, across a beam along a unit vector.
    pub fn area_across(&self, direction: Vec3) -> f32 {
        self.opening.plane().1.dot(direction).abs()
    }

    /// Returns the ray along `direction` (unit vector) that enters here and arrives at `point`, or
    /// `None` if that ray enters elsewhere.
    pub fn entering(&self, point: Vec3, direction: Vec3) -> Option<Ray> {
        let (on, normal) = self.opening.plane();
        let far = (point - on).dot(normal) / direction.dot(normal);
        let origin = point - far * direction;
        (far > 0.0 && self.opening.holds(origin)).then_some(Ray { origin, direction })
    }
}

impl Entrance {
    /// Makes the entrance of a light of so many bands into the prism `inside` (not empty), or
    /// through the openings of the light. Coordinates become relative to `center`, as those of
    /// `inside` are.
    pub fn new(light: InfiniteLight, bands: usize, inside: &Prism, center: DVec3) -> Self {
        let polygons: Vec<Vec<Triangle>> = light
            .through
            .iter()
            .map(|polygon| {
                let corners = triangulate(polygon)
                    .into_iter()
                    .map(|t| t.map(|i| (polygon[i] - center).as_vec3()));
                let triangles = corners.map(Triangle::from);
                triangles.filter(|triangle| triangle.normal() != Vec3::ZERO).collect()
            })
            .collect();
        let mut faces: Vec<EntryFace> = Vec::new();
        for part in light.parts() {
            for triangles in polygons.iter().filter(|triangles| !triangles.is_empty()) {
                let normal = triangles[0].normal();
                let Some(entry) = part.entry(normal, inside.hillside) else { continue };
                let mut area = 0.0;
                let areas = triangles.iter().map(|triangle| {
                    area += f64::from(triangle.area());
                    area
                });
                let areas = areas.collect();
                let power = entry.irradiance.iter().map(|e| e * area).collect();
                let opening = Opening::Polygon { triangles: triangles.clone(), areas };
                faces.push(EntryFace { entry, opening, power, is_sun: part.is_sun() });
            }
            if !light.through.is_empty() {
                continue;
            }
            for axis in 0..3 {
                let sides = [(axis + 1) % 3, (axis + 2) % 3].map(|i| inside.edges[i]);
                let across = sides[0].as_dvec3().cross(sides[1].as_dvec3());
                let area = across.length();
                let normal = (across / area).as_vec3();
                for (far, outward) in [(true, normal), (false, -normal)] {
                    if !inside.entered[axis][usize::from(far)] {
                        continue;
                    }
                    // the face on the slope sees nothing from below it anyway
                    let hillside = inside.hillside.filter(|_| axis < 2);
                    let Some(entry) = part.entry(outward, hillside) else { continue };
                    let power = entry.irradiance.iter().map(|e| e * area).collect();
                    let corner = inside.corner + if far { inside.edges[axis] } else { Vec3::ZERO };
                    let opening = Opening::Face { corner, sides };
                    faces.push(EntryFace { entry, opening, power, is_sun: part.is_sun() });
                }
            }
        }
        let whole = |face: &EntryFace| face.power.iter().sum::<f64>();
        let total: f64 = faces.iter().map(whole).sum();
        faces.retain(|face| whole(face) > LEAST * total);
        let mut sum = 0.0;
        let running = faces.iter().map(|face| {
            sum += whole(face);
            sum
        });
        let running = running.collect();
        let irradiance = light.parts().iter().map(|part| part.mean_irradiance(bands)).sum::<f64>();
        let openings = polygons.into_iter().flatten().collect();
        Self { light, faces, openings, running, irradiance: irradiance as f32 }
    }

    /// Returns whether the light comes in through openings alone.
    pub fn has_openings(&self) -> bool {
        !self.light.through.is_empty()
    }

    /// Returns the triangles of the openings, with their fronts to the sky; empty if the light comes
    /// in everywhere.
    pub fn openings(&self) -> &[Triangle] {
        &self.openings
    }

    /// Returns the farthest opening that a ray crosses: the distance along the ray, m, and whether
    /// the ray crosses it towards the sky. Openings whose plane the start of the ray lies in, to
    /// within `offset` metres, are left out.
    pub fn last_opening(&self, ray: &Ray, offset: f32) -> Option<(f32, bool)> {
        let starts_in = |t: &Triangle| (ray.origin - t.a).dot(t.normal()).abs() < offset;
        let others = self.openings.iter().filter(|triangle| !starts_in(triangle));
        let crossed = others.filter_map(|triangle| {
            let t = triangle.crossed_at(ray).filter(|t| *t > 0.0)?;
            Some((t, triangle.normal().dot(ray.direction) > 0.0))
        });
        crossed.max_by(|a, b| a.0.total_cmp(&b.0))
    }

    /// Returns the number of pairs of a face and a part of the light that enters there.
    pub fn faces(&self) -> usize {
        self.faces.len()
    }

    /// Returns one of these pairs, or `None` if there are not so many.
    pub fn face(&self, face: usize) -> Option<&EntryFace> {
        self.faces.get(face)
    }

    /// Returns the flux that enters by a face, per band, W or umol/s.
    pub fn power(&self, face: usize) -> &[f64] {
        &self.faces[face].power
    }

    /// Returns the flux that enters by all faces, in each of so many bands, W or umol/s.
    pub fn whole_power(&self, bands: usize) -> Vec<f64> {
        let by_face = |b: usize| self.faces.iter().map(move |face| face.power[b]);
        (0..bands).map(|b| by_face(b).sum()).collect()
    }

    /// Returns the largest ratio, in a band, of the power of a photon that enters by a face to the
    /// mean of all photons that enter there.
    pub fn largest_factor(&self, face: usize, band: usize) -> f64 {
        self.faces[face].entry.largest_factor(band)
    }

    /// Returns whether the light that enters by a face is that of a sun.
    pub fn is_sun(&self, face: usize) -> bool {
        self.faces[face].is_sun
    }

    /// Returns an estimate of the irradiance, W/m2: the mean over all orientations of a plane, in
    /// the brightest band of each part.
    pub fn irradiance(&self) -> f32 {
        self.irradiance
    }

    /// Draws the ray of a photon that enters by a face. Returns it with the ratio of the photon's
    /// power to the mean of all photons that enter there, per band.
    pub fn enter<L: Lanes>(&self, face: usize, rng: &mut Stream) -> (Ray, Spectrum<L>) {
        let EntryFace { entry, opening, .. } = &self.faces[face];
        let origin = opening.choose(rng);
        let entering = entry.sample::<L>(rng);
        (Ray { origin, direction: entering.direction }, entering.factor)
    }

    /// Draws the ray of a photon that enters by any of the faces. Returns `None` for a dark light.
    pub fn enter_anywhere(&self, rng: &mut Stream) -> Option<Ray> {
        self.running.last()?;
        let face = weighted_choice(&self.running, rng.uniform_fine()).index;
        Some(self.enter::<[f32; 1]>(face, rng).0)
    }
}

impl Emitter for Arc<Entrance> {
    fn write(&self, to: &mut fmt::Formatter) -> fmt::Result {
        to.debug_tuple("Infinite").field(self).finish()
    }

    fn extent(&self) -> Extent {
        Extent::EMPTY
    }

    fn ball(&self) -> (Vec3, f32) {
        (Vec3::ZERO, f32::INFINITY)
    }

    #[inline]
    fn emit(&self, rng: &mut Stream) -> (Start, Ray) {
        let dark = || Ray { origin: Vec3::ZERO, direction: Vec3::NEG_Z };
        let ray = self.enter_anywhere(rng).unwrap_or_else(dark);
        Start::of_point(ray.origin, ray.direction)
    }

    fn density(&self, _: &Start, _: Vec3) -> f32 {
        0.0
    }

    fn choose_point(&self, _: Vec3, _: &mut Stream) -> Option<Seen> {
        None
    }

    fn is_delta(&self) -> bool {
        self.light.has_sun()
    }
}
