//! Light from infinitely far away as it enters a scene, through the faces of a box around all that
//! it may meet: a line enters a box once, so the faces split the light exactly.

use glam::{DVec3, Vec2, Vec3};

use crate::{
    math::{
        geometry::{Extent, Ray, Triangle, triangulate},
        rng::Stream,
        sampling::{Chosen, uniform_triangle, weighted_choice},
        spectrum::{Lanes, Spectrum},
    },
    scene::daylight::{InfiniteEntry, InfiniteLight},
};

/// Ray offsets that the box is wider on all sides than what is in it.
pub const MARGIN: f32 = 16.0;

/// What enters through a face and part of the light, as a fraction of all, below which it is left out.
const LEAST: f64 = 1e-9;

/// A light at infinity, and the faces that it enters a scene through.
#[derive(Debug)]
pub struct Entrance {
    /// The light.
    pub light: InfiniteLight,
    faces: Vec<EntryFace>,
    /// The triangles of the openings that it comes in through alone; none where it comes in everywhere.
    openings: Vec<Triangle>,
    /// Running sums of the faces' powers, over all bands.
    running: Vec<f64>,
    /// About its irradiance, W/m2.
    irradiance: f32,
}

/// A face, and a part of the light that enters there.
#[derive(Debug)]
pub struct EntryFace {
    entry: InfiniteEntry,
    opening: Opening,
    /// Per band, W.
    power: Vec<f64>,
    /// Whether it is light of a sun, which paths do not find by chance.
    is_sun: bool,
}

/// What light comes in through.
#[derive(Clone, Debug)]
enum Opening {
    /// A corner of a face of the box, and its sides, m.
    Face { corner: Vec3, sides: [Vec3; 2] },
    /// A polygon cut into triangles, and running sums of their areas.
    Polygon { triangles: Vec<Triangle>, areas: Vec<f64> },
}

impl Opening {
    /// A point uniform on it.
    fn choose(&self, rng: &mut Stream) -> Vec3 {
        match self {
            Self::Face { corner, sides } => {
                let u = rng.square();
                *corner + u.x * sides[0] + u.y * sides[1]
            }
            Self::Polygon { triangles, areas } => {
                let Chosen { index, rest } = weighted_choice(areas, rng.uniform_fine());
                let weights = uniform_triangle(Vec2::new(rest, rng.uniform()));
                triangles[index].point_within(weights.x, weights.y, Vec3::ZERO)
            }
        }
    }

    /// A point of its plane, and its area times the unit normal there, m2.
    fn plane(&self) -> (Vec3, Vec3) {
        match self {
            Self::Face { corner, sides: [u, v] } => (*corner, u.cross(*v)),
            Self::Polygon { triangles, areas } => {
                let area = areas.last().copied().unwrap_or(0.0);
                (triangles[0].a, area as f32 * triangles[0].normal())
            }
        }
    }

    /// Whether a point of its plane lies on it.
    fn holds(&self, point: Vec3) -> bool {
        match self {
            Self::Face { corner, sides } => sides.iter().all(|side| {
                let along = (point - *corner).dot(*side);
                (0.0..=side.length_squared()).contains(&along)
            }),
            Self::Polygon { triangles, .. } => {
                let normal = triangles[0].normal();
                let ray = Ray { origin: point + normal, direction: -normal };
                triangles.iter().any(|triangle| crossing(triangle, &ray).is_some())
            }
        }
    }
}

impl EntryFace {
    /// Its area across a beam along a unit vector, m2.
    pub fn area_across(&self, direction: Vec3) -> f32 {
        self.opening.plane().1.dot(direction).abs()
    }

    /// The ray along a unit vector that enters here and comes to a point; none where that comes in elsewhere.
    pub fn entering(&self, point: Vec3, direction: Vec3) -> Option<Ray> {
        let (on, normal) = self.opening.plane();
        let far = (point - on).dot(normal) / direction.dot(normal);
        let origin = point - far * direction;
        (far > 0.0 && self.opening.holds(origin)).then_some(Ray { origin, direction })
    }
}

impl Entrance {
    /// Of a light of so many bands into `inside`, m, which is not empty; or through its openings, which `local`
    /// takes to the coordinates of `inside`.
    pub fn new(
        light: InfiniteLight,
        bands: usize,
        inside: &Extent,
        local: impl Fn(DVec3) -> Vec3,
    ) -> Self {
        let polygons: Vec<Vec<Triangle>> = light
            .through
            .iter()
            .map(|polygon| {
                let corners =
                    triangulate(polygon).into_iter().map(|t| t.map(|i| local(polygon[i])));
                let triangles = corners.map(Triangle::from);
                triangles.filter(|triangle| triangle.normal() != Vec3::ZERO).collect()
            })
            .collect();
        let size = inside.size();
        let mut faces: Vec<EntryFace> = Vec::new();
        for part in light.parts() {
            for triangles in polygons.iter().filter(|triangles| !triangles.is_empty()) {
                let Some(entry) = part.entry(triangles[0].normal()) else { continue };
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
                for outward in [Vec3::AXES[axis], -Vec3::AXES[axis]] {
                    let Some(entry) = part.entry(outward) else { continue };
                    let [u, v] = [(axis + 1) % 3, (axis + 2) % 3];
                    let sides = [u, v].map(|i| size[i] * Vec3::AXES[i]);
                    let area = f64::from(size[u]) * f64::from(size[v]);
                    let power = entry.irradiance.iter().map(|e| e * area).collect();
                    let up = outward.dot(Vec3::ONE) > 0.0;
                    let corner = inside.min + if up { size * Vec3::AXES[axis] } else { Vec3::ZERO };
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

    /// Whether its light comes in through openings alone.
    pub fn has_openings(&self) -> bool {
        !self.light.through.is_empty()
    }

    /// The farthest of its openings that a ray crosses, but those in whose plane it starts, to `offset`: how far, m,
    /// and whether it is crossed towards the sky.
    pub fn last_opening(&self, ray: &Ray, offset: f32) -> Option<(f32, bool)> {
        let starts_in = |t: &Triangle| (ray.origin - t.a).dot(t.normal()).abs() < offset;
        let others = self.openings.iter().filter(|triangle| !starts_in(triangle));
        let crossed = others.filter_map(|triangle| {
            let t = crossing(triangle, ray).filter(|t| *t > 0.0)?;
            Some((t, triangle.normal().dot(ray.direction) > 0.0))
        });
        crossed.max_by(|a, b| a.0.total_cmp(&b.0))
    }

    /// Pairs of a face and a part that light enters by.
    pub fn faces(&self) -> usize {
        self.faces.len()
    }

    /// One of them, if there are so many.
    pub fn face(&self, face: usize) -> Option<&EntryFace> {
        self.faces.get(face)
    }

    /// What enters by a face, per band, W or umol/s.
    pub fn power(&self, face: usize) -> &[f64] {
        &self.faces[face].power
    }

    /// Whether what enters by a face is light of a sun.
    pub fn is_sun(&self, face: usize) -> bool {
        self.faces[face].is_sun
    }

    /// About its irradiance, W/m2.
    pub fn irradiance(&self) -> f32 {
        self.irradiance
    }

    /// A photon that enters by a face, and its power over the mean there.
    pub fn enter<L: Lanes>(&self, face: usize, rng: &mut Stream) -> (Ray, Spectrum<L>) {
        let EntryFace { entry, opening, .. } = &self.faces[face];
        let origin = opening.choose(rng);
        let entering = entry.sample::<L>(rng);
        (Ray { origin, direction: entering.direction }, entering.factor)
    }

    /// The ray of a photon by any of the faces; none of a dark light.
    pub fn enter_anywhere(&self, rng: &mut Stream) -> Option<Ray> {
        self.running.last()?;
        let face = weighted_choice(&self.running, rng.uniform_fine()).index;
        Some(self.enter::<[f32; 1]>(face, rng).0)
    }
}

/// How far along a ray its line crosses a triangle (Moeller and Trumbore, Journal of Graphics Tools 2:21, 1997).
fn crossing(triangle: &Triangle, ray: &Ray) -> Option<f32> {
    let [a, b, c] = [triangle.a, triangle.b, triangle.c].map(|p| p.as_dvec3());
    let (origin, direction) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
    let (u, v) = (b - a, c - a);
    let across = direction.cross(v);
    let det = u.dot(across);
    if det == 0.0 {
        return None;
    }
    let off = origin - a;
    let (x, lift) = (off.dot(across) / det, off.cross(u));
    let y = direction.dot(lift) / det;
    let inside = x >= 0.0 && y >= 0.0 && x + y <= 1.0;
    inside.then(|| (v.dot(lift) / det) as f32)
}
