//! Radiance of surfaces, found once at many points and looked up from then on: rays that gather light end at millions
//! of points, and each finds the nearest of these instead of the k nearest photons (Christensen, Faster Photon Map
//! Global Illumination, Journal of Graphics Tools 4 (3), 1999).

use glam::Vec3;
use rayon::prelude::*;

use super::SurfaceLight;
use crate::{
    error::Result,
    math::machine,
    transport::photon_map::{Arrival, PackedDirection, PhotonMap, StoredPhoton},
};

/// Points for as many photons as an estimate takes: those side by side share most of them.
const POINTS: usize = 12;

/// The radiance that surfaces send along their normals, at many points.
pub struct RadianceCache {
    /// In place of powers: radiance per band, and how far its photons reach.
    points: PhotonMap,
}

/// Radiance that is sent from near a point.
pub struct CachedRadiance<'a> {
    /// Along the normal, per band, W/m2/sr or umol/m2/s/sr.
    pub along_normal: &'a [f32],
    /// How far the photons reach that tell it, m.
    pub reach: f32,
}

/// A point to be found: where, and on which side of which triangle.
struct Point {
    position: Vec3,
    triangle: u32,
    front: bool,
}

impl RadianceCache {
    /// Finds it, on both faces of every piece of surface that photons have come to and whose radiance depends on its angle
    /// in a way of the material's own. Error: no threads to be had.
    pub fn new(light: &SurfaceLight, threads: usize) -> Result<Self> {
        let SurfaceLight { scene, map, patches, k, .. } = light;
        let positions = map.positions();
        let mut points = Vec::new();
        for (_, photons) in map.bins() {
            // all of them are one estimate
            let stride = if photons.len() < *k { photons.len() } else { k.div_ceil(POINTS) };
            for i in photons.step_by(stride) {
                let triangle = map.photons[i].triangle;
                let material = scene.material(scene.surface(triangle as usize));
                if material.relative_radiance(1.0).is_none() {
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
        let bands = scene.bands.len();
        let find = |point: &Point| {
            let Point { position, triangle, front } = *point;
            let normal = scene.surface(triangle as usize).normal;
            let along = if front { normal } else { -normal };
            let radiance = light.radiance(triangle as usize, position, along);
            let reach = light.reach(triangle as usize, front, position);
            radiance.into_iter().map(|r| r as f32).chain([reach]).collect::<Vec<f32>>()
        };
        let found =
            machine::pool(threads)?.install(|| points.par_iter().flat_map_iter(find).collect());
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
        Ok(Self { points: PhotonMap::new(arrivals, found, bands + 1, 1) })
    }

    /// What was found nearest to a point of a piece's face (`bin`); none where nothing was.
    pub fn near(&self, bin: u32, point: Vec3) -> Option<CachedRadiance<'_>> {
        let nearest = self.points.nearest(bin, point, 1);
        let (reach, along_normal) = self.points.power(nearest.first()?.index).split_last()?;
        Some(CachedRadiance { along_normal, reach: *reach })
    }
}
