//! The light that stored photons bring to each place of a surface, in the colours of the photons: what
//! one sees of a photon map from so far that its photons run together.

use glam::Vec3;
use rayon::prelude::*;

use super::{
    Viewpoint,
    dots::{LAYERS, ON_GLASS, TRANSLUCENT},
};
use phylux_core::{
    error::Result,
    math::{geometry::Ray, machine},
    transport::{
        photon_map::{Arrival, PhotonMap},
        surface_light::SurfaceLight,
    },
};

/// Number of estimates for as many photons as one estimate takes; neighbours share most of them.
const POINTS: usize = 24;
/// Number of estimates of which a place shows the mean, the nearer ones counting more.
const AROUND: usize = 12;

/// Irradiance estimates at many places, as colours.
pub struct ColouredLight<'a> {
    light: &'a SurfaceLight<'a>,
    /// A photon map that holds estimates in place of powers.
    estimates: PhotonMap,
}

impl<'a> ColouredLight<'a> {
    /// Estimates the irradiance, times the colours of the photons that bring it, where photons have
    /// arrived. `shines` gives the power of each photon, times its colour. Error: no threads can be
    /// started.
    pub fn new(light: &'a SurfaceLight, shines: &[Vec3], threads: usize) -> Result<Self> {
        let SurfaceLight { map, k, .. } = light;
        let positions = map.positions();
        let mut arrivals = Vec::new();
        for (bin, photons) in map.bins() {
            // few photons are one estimate, so one place will do
            let step = if photons.len() < *k { photons.len() } else { k.div_ceil(POINTS) };
            let arrival =
                |i: usize| Arrival { position: positions[i], bin, photon: map.photons[i] };
            arrivals.extend(photons.step_by(step).map(arrival));
        }
        let find = |arrival: &Arrival| {
            let triangle = arrival.photon.triangle as usize;
            let normal = light.scene.surface(triangle).normal;
            let front = arrival.photon.direction.unpack().dot(normal) < 0.0;
            estimate(light, shines, triangle, front, arrival.position).to_array()
        };
        let pool = machine::pool(threads)?;
        let found = pool.install(|| arrivals.par_iter().flat_map_iter(find).collect());
        let estimates = pool.install(|| PhotonMap::new(arrivals, found, 3, 1));
        Ok(Self { light, estimates })
    }

    /// Returns the light on a face of a triangle at a point.
    fn at(&self, triangle: usize, front: bool, point: Vec3) -> Vec3 {
        let bin = self.light.patches.bin(triangle, front);
        let near = self.estimates.nearest(bin, point, AROUND);
        let Some(last) = near.last() else { return Vec3::ZERO };
        // the farthest has no weight, so that the light changes evenly from place to place
        let reach = 1.0001 * last.distance2 + f32::MIN_POSITIVE;
        let (mut sum, mut weights) = (Vec3::ZERO, 0.0);
        for near in &near {
            let weight = (1.0 - near.distance2 / reach).powi(2);
            sum += weight * Vec3::from_slice(self.estimates.power(near.index));
            weights += weight;
        }
        sum / weights
    }

    /// Returns the light of all surfaces along a ray from the viewpoint, each of which lets some of
    /// what is behind it through, also what has come to its own other face.
    pub fn along(&self, viewpoint: &Viewpoint, ray: &Ray) -> Vec3 {
        let (mut sum, mut through, mut opaque) = (Vec3::ZERO, 1.0, 0);
        viewpoint.each_surface(ray, |hit, is_clear| {
            let front = ray.direction.dot(viewpoint.scene.surface(hit.triangle).normal) < 0.0;
            let [seen, other] = [front, !front].map(|face| self.at(hit.triangle, face, hit.point));
            if is_clear {
                sum += through * ON_GLASS * (seen + other);
                return true;
            }
            sum += through * (seen + TRANSLUCENT * other);
            through *= TRANSLUCENT;
            opaque += 1;
            opaque <= LAYERS
        });
        sum
    }
}

/// Returns the sum over the photons nearest to a point of what they shine, per area.
fn estimate(
    light: &SurfaceLight,
    shines: &[Vec3],
    triangle: usize,
    front: bool,
    point: Vec3,
) -> Vec3 {
    let Some(gathered) = light.gather(triangle, front, point, light.k) else { return Vec3::ZERO };
    let sum: Vec3 = gathered.photons.iter().map(|photon| shines[photon.index]).sum();
    gathered.weight as f32 * sum
}
