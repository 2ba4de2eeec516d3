//! Light at any point of any surface, from the k nearest of all photons that arrived there.
//!
//! Photons are filed by smooth piece of surface and face, so that no light leaks through a sheet,
//! around a corner or from leaf to leaf. Their power is divided by the true area of the piece
//! within the ball that they span, so that edges are not too dark. Like every k-nearest estimate it
//! is biased by the size of that ball: a shadow is blurred over the ball, and so is light where the
//! piece continues beneath an object that stands on it.

mod cache;

use std::f64::consts::PI;

use glam::Vec3;

use crate::{
    math::{
        rng::{Purpose, Streams},
        spectrum::{Lanes, Spectrum, with_lanes},
    },
    scene::{
        material::{Interaction, Material, Scatterer, Transport},
        patches::Patches,
        world::Scene,
    },
    transport::photon_map::{Gathered, PhotonMap, Way},
};

pub use cache::RadianceCache;

/// The light on all surfaces of a scene. Points are in metres from the centre of the scene.
pub struct SurfaceLight<'a> {
    /// The scene.
    pub scene: &'a Scene,
    /// The smooth pieces of its surfaces.
    pub patches: Patches,
    /// All arrivals of the first histories on all surfaces, filed by piece and face, with the ways
    /// by which they came.
    pub map: PhotonMap,
    /// Number of photons of an estimate, at least 2.
    pub k: usize,
}

impl<'a> SurfaceLight<'a> {
    /// Number of photons of an estimate for which no number is given; it gives an error of 7 %.
    pub const DEFAULT_K: usize = 200;

    /// Returns the irradiance on a face of a triangle near `point`, per band, W/m2 or umol/m2/s. It
    /// is zero where no photon has reached that face of the piece.
    pub fn irradiance(&self, triangle: usize, front: bool, point: Vec3) -> Vec<f64> {
        self.arrived(triangle, front, point, 1, |_| 0)
    }

    /// Like [`irradiance`](Self::irradiance), but by each light: all bands for the first light,
    /// then for the second, and so on.
    pub fn irradiance_by_light(&self, triangle: usize, front: bool, point: Vec3) -> Vec<f64> {
        let light = |photon: usize| self.map.photons[photon].light as usize;
        self.arrived(triangle, front, point, self.scene.lights().len(), light)
    }

    /// Returns the relative standard error of [`irradiance`](Self::irradiance), for some bands
    /// together: √Σp² / Σp of the powers p of its photons, as if these were independent. `None`
    /// where no photon arrived.
    pub fn relative_error(
        &self,
        triangle: usize,
        front: bool,
        point: Vec3,
        bands: &[usize],
    ) -> Option<f64> {
        let gathered = self.gather(triangle, front, point, self.k)?;
        let (mut sum, mut squares) = (0.0, 0.0);
        for photon in &gathered.photons {
            let power = self.map.power(photon.index);
            let power: f64 = bands.iter().map(|&b| f64::from(power[b])).sum();
            sum += power;
            squares += power * power;
        }
        (sum > 0.0).then(|| squares.sqrt() / sum)
    }

    /// Returns the relative standard error of an estimate from `self.k` photons of equal power.
    pub fn error_of_alike(&self) -> f32 {
        Self::error_of(self.k)
    }

    /// Returns the relative standard error of an estimate from `k` photons of equal power.
    pub fn error_of(k: usize) -> f32 {
        1.0 / (k as f32).sqrt()
    }

    /// Returns the irradiance in `parts` parts; `part` returns the part to which a photon belongs.
    fn arrived(
        &self,
        triangle: usize,
        front: bool,
        point: Vec3,
        parts: usize,
        part: impl Fn(usize) -> usize,
    ) -> Vec<f64> {
        let bands = self.scene.bands().len();
        let mut sums = vec![0.0; parts * bands];
        let Some(gathered) = self.gather(triangle, front, point, self.k) else { return sums };
        for photon in &gathered.photons {
            let sum = &mut sums[part(photon.index) * bands..][..bands];
            let power = self.map.power(photon.index);
            sum.iter_mut().zip(power).for_each(|(sum, p)| *sum += f64::from(*p));
        }
        sums.iter_mut().for_each(|sum| *sum *= gathered.weight);
        sums
    }

    /// Returns what the surface absorbs near `point`, from both sides, per band, W/m2 or umol/m2/s.
    pub fn absorbed(&self, triangle: usize, point: Vec3) -> Vec<f64> {
        self.absorbed_from([true, false], triangle, point)
    }

    /// Returns the fraction of the light arriving at a face near `point` that the surface absorbs,
    /// per band, estimated from the photons there. It is zero where no photon has reached the face.
    pub fn absorptance(&self, triangle: usize, front: bool, point: Vec3) -> Vec<f64> {
        let absorbed = self.absorbed_from([front, !front], triangle, point);
        let arrived = self.irradiance(triangle, front, point);
        let share = |(absorbed, arrived): (f64, f64)| absorbed / arrived.max(f64::MIN_POSITIVE);
        absorbed.into_iter().zip(arrived).map(share).collect()
    }

    /// Returns what the surface absorbs of the light that arrives at the chosen `faces` (front,
    /// back).
    fn absorbed_from(&self, faces: [bool; 2], triangle: usize, point: Vec3) -> Vec<f64> {
        with_lanes!(self.scene.lanes(), L => {
            self.sum::<L>(triangle, point, faces, self.k, |material, at, photon| {
                // without a closed form: what one scattering leaves behind, on average
                material.absorptance(at).unwrap_or_else(|| {
                    let mut rng = Streams::new(0, Purpose::Surfaces, 0).history(photon as u64);
                    let scatter = material.sample::<L>(at, Transport::Light, &mut rng);
                    let all = || Spectrum::splat(self.scene.lanes(), 1.0);
                    scatter.map_or_else(all, |s| s.weight.map(|scattered| 1.0 - scattered))
                })
            })
        })
    }

    /// Returns the radiance that leaves a surface near `point` along `outgoing`, by scattering
    /// other than mirror reflection, per band, W/m2/sr or umol/m2/s/sr. It is reflected from
    /// photons on that side and, where the material lets light through, transmitted from photons on
    /// the other side.
    pub fn radiance(&self, triangle: usize, point: Vec3, outgoing: Vec3) -> Vec<f64> {
        let surface = &self.scene.surface(triangle);
        let Material::Lambert(lambert) = self.scene.material(surface) else {
            return self.radiance_of(triangle, point, outgoing, self.k, |_| true);
        };
        let irradiance = self.irradiance(triangle, outgoing.dot(surface.normal) > 0.0, point);
        irradiance.iter().zip(lambert.reflectance()).map(|(e, r)| e * f64::from(r) / PI).collect()
    }

    /// Like [`radiance`](Self::radiance), but from the nearest `k` photons, of which only those
    /// count that came by a wanted way.
    pub fn radiance_of(
        &self,
        triangle: usize,
        point: Vec3,
        outgoing: Vec3,
        k: usize,
        wanted: impl Fn(Way) -> bool,
    ) -> Vec<f64> {
        let surface = &self.scene.surface(triangle);
        let front = outgoing.dot(surface.normal) > 0.0;
        let material = self.scene.material(surface);
        if !material.is_diffuse() {
            return vec![0.0; self.scene.bands().len()];
        }
        let through = material.transmits_diffusely();
        let faces = [front || through, !front || through];
        with_lanes!(self.scene.lanes(), L => {
            self.sum::<L>(triangle, point, faces, k, |material, at, photon| {
                match self.map.ways().get(photon).is_none_or(|way| wanted(*way)) {
                    true => material.evaluate(at, outgoing),
                    false => Spectrum::splat(self.scene.lanes(), 0.0),
                }
            })
        })
    }

    /// Returns the light of those photons alone that came by a wanted way. Their map is made on the
    /// threads of the current pool.
    pub fn part(&self, wanted: impl Fn(Way) -> bool) -> SurfaceLight<'a> {
        SurfaceLight { map: self.map.part(wanted), patches: self.patches.clone(), ..*self }
    }

    /// Returns the number of photons of an estimate over `divisor`, rounded up, and at least 2.
    pub fn coarse(&self, divisor: usize) -> usize {
        self.k.div_ceil(divisor).max(2)
    }

    /// Returns the radius, m, over which the photons of an estimate on a face near `point` are
    /// spread: the distance of the k-th or, where there are fewer, the radius of a disc with the
    /// area of the piece.
    fn reach(&self, triangle: usize, front: bool, point: Vec3) -> f32 {
        let nearest = self.map.nearest(self.patches.bin(triangle, front), point, self.k);
        match nearest.last() {
            Some(last) if nearest.len() == self.k => last.distance2.sqrt(),
            _ => (self.patches.area(self.patches.of(triangle)) / PI).sqrt() as f32,
        }
    }

    /// Sums over the `k` nearest photons on each of the chosen `faces` (front, back) their power
    /// times `score`, a function of the material, the interaction and the photon's index, per area.
    fn sum<L: Lanes>(
        &self,
        triangle: usize,
        point: Vec3,
        faces: [bool; 2],
        k: usize,
        score: impl Fn(&Material, &Interaction, usize) -> Spectrum<L>,
    ) -> Vec<f64> {
        let surface = &self.scene.surface(triangle);
        let material = self.scene.material(surface);
        let mut sums = vec![0.0; self.scene.bands().len()];
        for (front, wanted) in [true, false].into_iter().zip(faces) {
            let gathered = wanted.then(|| self.gather(triangle, front, point, k)).flatten();
            let Some(gathered) = gathered else { continue };
            for photon in &gathered.photons {
                let stored = &self.map.photons[photon.index];
                let direction = stored.direction.unpack();
                // the photon came to this face, with the slope of the triangle that it met
                let own = self.scene.surface(stored.triangle as usize).normal;
                let at = Interaction {
                    normal: if front { surface.normal } else { -surface.normal },
                    front,
                    ..Interaction::new(direction, own).on(triangle)
                };
                let scored = score(material, &at, photon.index);
                let power = self.map.power(photon.index);
                for ((sum, score), power) in sums.iter_mut().zip(scored.values()).zip(power) {
                    *sum += gathered.weight * f64::from(*score) * f64::from(*power);
                }
            }
        }
        sums
    }

    /// Gathers the `k` nearest photons on this face of the piece, and the area of the piece on
    /// which they arrived. `None` where no photon has reached the face.
    pub fn gather(&self, triangle: usize, front: bool, point: Vec3, k: usize) -> Option<Gathered> {
        /// Up to so many triangles are faster looked at one by one than searched for. The ball on a
        /// thin bar, where few photons arrive, may hold whole plants.
        const FEW: usize = 64;
        let patch = self.patches.of(triangle);
        let inside = |radius| {
            let part =
                |other| f64::from(self.scene.triangles().at(other).area_in_ball(point, radius));
            let members = self.patches.members(patch);
            if members.len() <= FEW {
                return members.map(part).sum();
            }
            let mut area = 0.0;
            self.scene.near(triangle, point, radius, |other| {
                if self.patches.of(other) == patch {
                    area += part(other);
                }
            });
            area
        };
        let bin = self.patches.bin(triangle, front);
        self.map.gather(bin, point, k, self.patches.area(patch), inside)
    }
}
