//! The radiance of surfaces, computed once at many points and looked up from then on. Gathering
//! rays end at millions of points; each looks up the nearest cached point instead of the k nearest
//! photons (Christensen, Faster Photon Map Global Illumination, Journal of Graphics Tools 4 (3),
//! 1999).

use std::f64::consts::PI;

use glam::Vec3;
use rayon::prelude::*;

use super::SurfaceLight;
use crate::{
    error::Result,
    math::machine,
    scene::material::{Material, Scatterer},
    transport::photon_map::{Arrival, PackedDirection, PhotonMap, StoredPhoton},
};

/// Number of cached points per k photons, k being those of one estimate; neighbouring points share
/// most of their photons.
const POINTS: usize = 3;

/// The radiance that surfaces send out along their normals, at many points.
pub struct RadianceCache {
    /// A photon map that holds, in place of powers, the radiance per band and the radius of the
    /// estimate.
    points: PhotonMap,
}

/// The radiance at the cached point nearest to a given one.
pub struct CachedRadiance<'a> {
    /// Radiance along the normal, per band, W/m2/sr or umol/m2/s/sr.
    pub along_normal: &'a [f32],
    /// Radius over which the photons of the estimate are spread, m.
    pub reach: f32,
}

/// A point at which radiance is to be computed: its position, triangle and side.
struct Point {
    position: Vec3,
    triangle: u32,
    front: bool,
}

impl RadianceCache {
    /// Computes the radiance at points where photons arrived. These are on all materials whose
    /// radiance depends on the outgoing angle in a way of their own, whatever direction the light
    /// comes from; on materials that transmit light diffusely they are on both faces. Error: no
    /// threads are to be had.
    pub fn new(light: &SurfaceLight, threads: usize) -> Result<Self> {
        let sends = |material: &Material| material.relative_radiance(1.0).is_some();
        Self::of(light, threads, sends, |triangle, front, position| {
            let normal = light.scene.surface(triangle).normal;
            let along = if front { normal } else { -normal };
            light.radiance(triangle, position, along)
        })
    }

    /// Computes the radiance that white sheets would have in the place of all surfaces, which is
    /// their irradiance over π. Error: no threads are to be had.
    pub fn of_white(light: &SurfaceLight, threads: usize) -> Result<Self> {
        Self::of(
            light,
            threads,
            |_| true,
            |triangle, front, position| {
                let irradiance = light.irradiance(triangle, front, position);
                irradiance.into_iter().map(|irradiance| irradiance / PI).collect()
            },
        )
    }

    /// Computes what `radiance` gives on a face of a triangle at a position, on all materials that
    /// are `wanted`.
    fn of(
        light: &SurfaceLight,
        threads: usize,
        wanted: impl Fn(&Material) -> bool,
        radiance: impl Fn(usize, bool, Vec3) -> Vec<f64> + Sync,
    ) -> Result<Self> {
        let SurfaceLight { scene, map, patches, k, .. } = light;
        let positions = map.positions();
        let mut points = Vec::new();
        for (_, photons) in map.bins() {
            // few photons are one estimate, so one point will do
            let stride = if photons.len() < *k { photons.len() } else { k.div_ceil(POINTS) };
            for i in photons.step_by(stride) {
                let triangle = map.photons[i].triangle;
                let material = scene.material(&scene.surface(triangle as usize));
                if !wanted(material) {
                    continue;
                }
                let from = map.photons[i].direction.unpack();
                let front = from.dot(scene.surface(triangle as usize).normal) < 0.0;
                points.push(Point { position: positions[i], triangle, front });
                if material.transmits_diffusely() {
                    points.push(Point { position: positions[i], triangle, front: !front });
                }
            }
        }
        let bands = scene.bands().len();
        let find = |point: &Point| {
            let Point { position, triangle, front } = *point;
            let radiance = radiance(triangle as usize, front, position);
            let reach = light.reach(triangle as usize, front, position);
            radiance.into_iter().map(|r| r as f32).chain([reach]).collect::<Vec<f32>>()
        };
        let pool = machine::pool(threads)?;
        let found = pool.install(|| points.par_iter().flat_map_iter(find).collect());
        let arrival = |&Point { position, triangle, front }: &Point| Arrival {
            position,
            bin: patches.bin(triangle as usize, front),
            photon: StoredPhoton {
                direction: PackedDirection::new(Vec3::Z),
                triangle,
                light: 0,
                history: 0,
            },
        };
        let arrivals = points.iter().map(arrival).collect();
        Ok(Self { points: pool.install(|| PhotonMap::new(arrivals, found, bands + 1, 1)) })
    }

    /// Returns the mean radiance along the normal, per band, over the `count` cached points nearest
    /// to `point` on the face of a piece (`bin`); empty if there is no cached point on it. The
    /// nearer a point is the more it counts, and the farthest does not, so that the mean changes
    /// evenly from place to place.
    pub fn mean_along_normal(&self, bin: u32, point: Vec3, count: usize) -> Vec<f64> {
        let nearest = self.points.nearest(bin, point, count);
        let Some(last) = nearest.last() else { return Vec::new() };
        let reach = 1.0001 * last.distance2 + f32::MIN_POSITIVE;
        let (mut mean, mut weights) = (Vec::new(), 0.0);
        for near in &nearest {
            let [along_normal @ .., _] = self.points.power(near.index) else { continue };
            let weight = f64::from(1.0 - near.distance2 / reach).powi(2);
            weights += weight;
            mean.resize(along_normal.len(), 0.0);
            mean.iter_mut().zip(along_normal).for_each(|(sum, v)| *sum += weight * f64::from(*v));
        }
        mean.iter_mut().for_each(|sum| *sum /= weights);
        mean
    }

    /// Returns the radiance at the cached point nearest to `point` on the face of a piece (`bin`).
    /// `None` if there is no cached point on it.
    pub fn near(&self, bin: u32, point: Vec3) -> Option<CachedRadiance<'_>> {
        let nearest = self.points.nearest(bin, point, 1);
        let (reach, along_normal) = self.points.power(nearest.first()?.index).split_last()?;
        Some(CachedRadiance { along_normal, reach: *reach })
    }
}
