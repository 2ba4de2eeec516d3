//! Light from infinitely far away as it enters a scene, through the faces of a box around all that
//! it may meet: a line enters a box once, so the faces split the light exactly.

use glam::Vec3;

use crate::{
    math::{
        geometry::{Extent, Ray},
        rng::Stream,
        sampling::weighted_choice,
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
    doors: Vec<Door>,
    /// Running sums of the doors' powers, over all bands.
    running: Vec<f64>,
    /// About its irradiance, W/m2.
    irradiance: f32,
}

/// A face, and a part of the light that enters there.
#[derive(Debug)]
struct Door {
    entry: InfiniteEntry,
    /// A corner of the face and its sides, m.
    corner: Vec3,
    sides: [Vec3; 2],
    /// Per band, W.
    power: Vec<f64>,
    /// Whether it is light of a sun, which paths do not find by chance.
    is_sun: bool,
}

impl Entrance {
    /// Of a light of so many bands into `inside`, m, which is not empty.
    pub fn new(light: InfiniteLight, bands: usize, inside: &Extent) -> Self {
        let size = inside.size();
        let mut doors: Vec<Door> = Vec::new();
        for part in light.parts() {
            for axis in 0..3 {
                for outward in [Vec3::AXES[axis], -Vec3::AXES[axis]] {
                    let Some(entry) = part.entry(outward) else { continue };
                    let [u, v] = [(axis + 1) % 3, (axis + 2) % 3];
                    let sides = [u, v].map(|i| size[i] * Vec3::AXES[i]);
                    let area = f64::from(size[u]) * f64::from(size[v]);
                    let power = entry.irradiance.iter().map(|e| e * area).collect();
                    let up = outward.dot(Vec3::ONE) > 0.0;
                    let corner = inside.min + if up { size * Vec3::AXES[axis] } else { Vec3::ZERO };
                    doors.push(Door { entry, corner, sides, power, is_sun: part.is_sun() });
                }
            }
        }
        let whole = |door: &Door| door.power.iter().sum::<f64>();
        let total: f64 = doors.iter().map(whole).sum();
        doors.retain(|door| whole(door) > LEAST * total);
        let mut sum = 0.0;
        let running = doors.iter().map(|door| {
            sum += whole(door);
            sum
        });
        let running = running.collect();
        let irradiance = light.parts().iter().map(|part| part.mean_irradiance(bands)).sum::<f64>();
        Self { light, doors, running, irradiance: irradiance as f32 }
    }

    /// Pairs of a face and a part that light enters by.
    pub fn doors(&self) -> usize {
        self.doors.len()
    }

    /// What enters by a door, per band, W or umol/s.
    pub fn power(&self, door: usize) -> &[f64] {
        &self.doors[door].power
    }

    /// Whether what enters by a door is light of a sun.
    pub fn is_sun(&self, door: usize) -> bool {
        self.doors[door].is_sun
    }

    /// About its irradiance, W/m2.
    pub fn irradiance(&self) -> f32 {
        self.irradiance
    }

    /// A photon that enters by a door, and its power over the mean there.
    pub fn enter<L: Lanes>(&self, door: usize, rng: &mut Stream) -> (Ray, Spectrum<L>) {
        let Door { entry, corner, sides, .. } = &self.doors[door];
        let u = rng.square();
        let origin = *corner + u.x * sides[0] + u.y * sides[1];
        let entering = entry.sample::<L>(rng);
        (Ray { origin, direction: entering.direction }, entering.factor)
    }

    /// The ray of a photon by any of the doors; none of a dark light.
    pub fn enter_anywhere(&self, rng: &mut Stream) -> Option<Ray> {
        self.running.last()?;
        let door = weighted_choice(&self.running, rng.uniform_fine()).index;
        Some(self.enter::<[f32; 1]>(door, rng).0)
    }
}
