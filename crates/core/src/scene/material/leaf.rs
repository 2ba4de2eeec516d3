//! The leaf: a thin scattering sheet under a smooth cuticle.

use std::f32::consts::PI;

use glam::Vec3;

use super::{
    BsdfSample, Fresnel, Interaction, Lobe, Scatterer, Transport, check_per_band, check_sum,
    checked_ior, choose, complement, diffuse_fresnel, mirrored_way, normal_fresnel,
};
use crate::{
    error::{Checked, Problem},
    math::{
        geometry::Frame,
        rng::Stream,
        sampling::cosine_hemisphere,
        spectrum::{Lanes, Spectrum},
    },
};

/// A leaf of index of refraction n. At the angle theta the cuticle mirrors F(theta). Of the light
/// that enters, the fraction r comes back out of the same face and t out of the other; it is
/// Lambertian inside and refracted on its way out: f = a (1-F_i) (1-F_o) / (pi (1-Fbar)), with a =
/// r or t of the face that the light enters. The model of a cuticle over a diffuse mesophyll is
/// after Govaerts et al. (1996) and Bousquet et al. (2005).
#[derive(Clone, Debug, PartialEq)]
pub struct Leaf {
    ior: f32,
    /// Fraction of diffuse light that passes the cuticle, 1 - Fbar.
    diffuse_transmittance: f32,
    front: Face,
    back: Face,
}

/// Fractions r and t, per lane, of the light that has entered through one face.
#[derive(Clone, Debug, PartialEq)]
struct Face {
    reflected: Lobe,
    transmitted: Lobe,
}

/// Reflectance and transmittance per band of one face of a leaf, in [0, 1], as an integrating
/// sphere measures them near normal incidence.
#[derive(Clone, Copy, Debug)]
pub struct LeafFace<'a> {
    /// Reflectance R, cuticle included. A value below F0 counts as F0.
    pub reflectance: &'a [f32],
    /// Transmittance T. The sum max(R, F0) + T is at most 1.
    pub transmittance: &'a [f32],
}

impl LeafFace<'_> {
    /// Checks the values of the face, with `side` before their names, below a cuticle that reflects
    /// `f0`. `bands` are the names of the bands.
    fn check(&self, side: &str, f0: f64, bands: &[&str]) -> Checked {
        let Self { reflectance, transmittance } = self;
        check_per_band(&format!("{side}reflectance"), reflectance, bands.len())?;
        check_per_band(&format!("{side}transmittance"), transmittance, bands.len())?;
        (0..bands.len()).try_for_each(|band| {
            let [r, t] = [reflectance[band], transmittance[band]].map(f64::from);
            let shown = if r <= f0 && f0 > 0.0 { " (of the cuticle alone)" } else { "" };
            let fractions = format!("{side}reflectance{shown} + transmittance");
            check_sum(&fractions, r.max(f0) + t, band, bands)
        })
    }
}

impl Face {
    /// Makes a face below a cuticle that reflects `f0` along the normal.
    fn new(face: &LeafFace, f0: f32) -> Self {
        let inside = |a: f32| a / (1.0 - f0);
        let below = |r: f32| if r < f0 { 0.0 } else { inside(r - f0) };
        let reflected: Vec<f32> = face.reflectance.iter().map(|&r| below(r)).collect();
        let transmitted: Vec<f32> = face.transmittance.iter().map(|&t| inside(t)).collect();
        Self { reflected: Lobe::new(&reflected), transmitted: Lobe::new(&transmitted) }
    }

    fn in_lanes(self, lanes: usize) -> Self {
        let Self { reflected, transmitted } = self;
        Self { reflected: reflected.in_lanes(lanes), transmitted: transmitted.in_lanes(lanes) }
    }
}

impl Leaf {
    /// Makes the material from the index of refraction (1 to 1000; with 1 it is a bi-Lambertian
    /// sheet) and the measured values of both faces. `bands` are the names of the bands. Error: a
    /// number is out of its range, there is not one for each band, or a face would send on more
    /// light than comes.
    pub fn new(ior: f64, front: LeafFace, back: LeafFace, bands: &[&str]) -> Result<Self, Problem> {
        let ior = checked_ior(ior)?;
        let f0 = normal_fresnel(ior.into());
        front.check("", f0, bands)?;
        back.check("back: ", f0, bands)?;
        let [front, back] = [front, back].map(|face| Face::new(&face, f0 as f32));
        let diffuse_transmittance = 1.0 - diffuse_fresnel(ior.into()) as f32;
        Ok(Self { ior, diffuse_transmittance, front, back })
    }

    /// Returns for each band the reflectance R that the front or the back has, near normal incidence,
    /// over what R has above the cuticle's: by how many per cent the light that is scattered back changes
    /// for 1 % more of R. 1 where nothing is scattered back.
    pub fn reflected_over_scattered(&self, front: bool) -> impl Iterator<Item = f64> {
        let f0 = normal_fresnel(self.ior.into());
        let Lobe { largest, relative } = &self.face(front).reflected;
        let scattered = relative.iter().map(move |of| (1.0 - f0) * f64::from(largest * of));
        scattered.map(move |above| if above > 0.0 { (f0 + above) / above } else { 1.0 })
    }

    #[inline]
    fn cuticle(&self, cos: f32) -> f32 {
        Fresnel::new(cos, self.ior).unpolarised()
    }

    #[inline]
    fn face(&self, front: bool) -> &Face {
        if front { &self.front } else { &self.back }
    }

    /// Returns the lobe of light that crosses the sheet, for a path at `at`. It belongs to the face
    /// that the light enters, which for a path of importance is the face on the other side.
    #[inline]
    fn transmitted(&self, at: &Interaction, transport: Transport) -> &Lobe {
        &self.face(at.front == (transport == Transport::Light)).transmitted
    }

    /// Draws a direction out of the sheet about `normal`, with density (1-F) cos / (pi (1-Fbar)).
    #[inline]
    fn leave(&self, normal: Vec3, rng: &mut Stream) -> Vec3 {
        loop {
            let local = cosine_hemisphere(rng.square());
            if rng.uniform() >= self.cuticle(local.z) {
                return Frame::new(normal).to_world(local);
            }
        }
    }
}

impl Scatterer for Leaf {
    fn lanes(&self) -> usize {
        self.front.reflected.len()
    }

    fn placed(self, lanes: usize, _tangents: Vec<(u32, Vec3)>) -> Self {
        Self { front: self.front.in_lanes(lanes), back: self.back.in_lanes(lanes), ..self }
    }

    #[inline(never)]
    fn sample<L: Lanes>(
        &self,
        at: &Interaction,
        transport: Transport,
        rng: &mut Stream,
    ) -> Option<BsdfSample<L>> {
        let mirrored = self.cuticle(at.cos);
        let entered = 1.0 - mirrored;
        let reflected = &self.face(at.front).reflected;
        let transmitted = self.transmitted(at, transport);
        let fractions = [mirrored, entered * reflected.largest, entered * transmitted.largest];
        let choice = choose(fractions, rng)?;
        let scale = |s: Spectrum<L>| s.scaled(choice.weight);
        Some(match choice.lobe {
            0 => BsdfSample::mirrored(at, reflected.all(choice.weight)),
            1 => {
                BsdfSample::diffuse(self.leave(at.normal, rng), scale(reflected.relative()), false)
            }
            _ => BsdfSample::diffuse(
                self.leave(-at.normal, rng),
                scale(transmitted.relative()),
                true,
            ),
        })
    }

    fn evaluate<L: Lanes>(&self, at: &Interaction, outgoing: Vec3) -> Spectrum<L> {
        let cos = outgoing.dot(at.normal);
        let face = self.face(at.front);
        let lobe = if cos > 0.0 { &face.reflected } else { &face.transmitted };
        let through = (1.0 - self.cuticle(at.cos)) * (1.0 - self.cuticle(cos.abs()));
        lobe.fraction().scaled(through / (PI * self.diffuse_transmittance))
    }

    fn pdf(&self, at: &Interaction, transport: Transport, outgoing: Vec3) -> f32 {
        let cos = outgoing.dot(at.normal);
        let mirrored = self.cuticle(at.cos);
        let reflected = self.face(at.front).reflected.largest;
        let transmitted = self.transmitted(at, transport).largest;
        let total = mirrored + (1.0 - mirrored) * (reflected + transmitted);
        let lobe = if cos > 0.0 { reflected } else { transmitted };
        let chance = lobe * (1.0 - mirrored) / total.max(f32::MIN_POSITIVE);
        let leaves = (1.0 - self.cuticle(cos.abs())) * cos.abs();
        chance * leaves / (PI * self.diffuse_transmittance)
    }

    fn smooth_ways<L: Lanes>(
        &self,
        at: &Interaction,
        _transport: Transport,
    ) -> [Option<BsdfSample<L>>; 2] {
        let mirrored = if self.has_mirror() { self.cuticle(at.cos) } else { 0.0 };
        mirrored_way(at, self.front.reflected.all(mirrored))
    }

    #[inline]
    fn absorptance<L: Lanes>(&self, at: &Interaction) -> Option<Spectrum<L>> {
        let face = self.face(at.front);
        let scattered = face.reflected.fraction() + face.transmitted.fraction();
        Some(complement(scattered).scaled(1.0 - self.cuticle(at.cos)))
    }

    fn relative_radiance(&self, cos: f32) -> Option<f32> {
        Some((1.0 - self.cuticle(cos)) / (1.0 - self.cuticle(1.0)))
    }

    fn is_diffuse(&self) -> bool {
        true
    }

    fn transmits_diffusely(&self) -> bool {
        true
    }

    /// Returns whether the cuticle mirrors: an index of 1 makes a plain bi-Lambertian sheet.
    fn has_mirror(&self) -> bool {
        self.ior > 1.0
    }
}
