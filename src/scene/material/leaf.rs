//! The leaf: a thin scattering sheet under a smooth cuticle.

use std::f32::consts::PI;

use glam::Vec3;

use super::{
    BsdfSample, Checked, Fresnel, Interaction, Lobe, Transport, check_ior, check_sum, choose,
    complement, diffuse_fresnel, normal_fresnel,
};
use crate::math::{
    geometry::Frame,
    rng::Stream,
    sampling::cosine_hemisphere,
    spectrum::{Lanes, Spectrum},
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

impl Leaf {
    /// Makes the material from the index of refraction (at least 1; with 1 it is a bi-Lambertian
    /// sheet) and the measured values of both faces.
    pub fn new(ior: f32, front: LeafFace, back: LeafFace) -> Self {
        let f0 = normal_fresnel(f64::from(ior)) as f32;
        let face = |face: LeafFace| {
            let inside = |a: f32| a / (1.0 - f0);
            let below = |r: f32| if (0.0..f0).contains(&r) { 0.0 } else { inside(r - f0) };
            let reflected: Vec<f32> = face.reflectance.iter().map(|&r| below(r)).collect();
            let transmitted: Vec<f32> = face.transmittance.iter().map(|&t| inside(t)).collect();
            Face { reflected: Lobe::new(&reflected), transmitted: Lobe::new(&transmitted) }
        };
        let diffuse_transmittance = 1.0 - diffuse_fresnel(f64::from(ior)) as f32;
        Self { ior, diffuse_transmittance, front: face(front), back: face(back) }
    }

    pub(super) fn check(&self, names: &[&str]) -> Checked {
        let bands = names.len();
        check_ior(self.ior.into())?;
        let f0 = normal_fresnel(self.ior.into());
        for (side, face) in [("", &self.front), ("back: ", &self.back)] {
            let measured = |r: f64| if r == 0.0 { 0.0 } else { f0 + (1.0 - f0) * r };
            face.reflected.check_as(&format!("{side}reflectance"), bands, measured)?;
            let measured = |t| (1.0 - f0) * t;
            face.transmitted.check_as(&format!("{side}transmittance"), bands, measured)?;
            for band in 0..bands {
                let reflected = face.reflected.of_band(band);
                let sum = f0 + (1.0 - f0) * (reflected + face.transmitted.of_band(band));
                let shown =
                    if reflected == 0.0 && f0 > 0.0 { " (of the cuticle alone)" } else { "" };
                let fractions = format!("{side}reflectance{shown} + transmittance");
                check_sum(&fractions, sum, band, names)?;
            }
        }
        Ok(())
    }

    pub(super) fn lobes_mut(&mut self) -> [&mut Lobe; 4] {
        let Self { front, back, .. } = self;
        [&mut front.reflected, &mut front.transmitted, &mut back.reflected, &mut back.transmitted]
    }

    /// Returns whether the cuticle mirrors: an index of 1 makes a plain bi-Lambertian sheet.
    pub(super) fn has_cuticle(&self) -> bool {
        self.ior > 1.0
    }

    /// Returns the fraction per band that the cuticle mirrors.
    pub(super) fn mirrored<L: Lanes>(&self, at: &Interaction) -> Spectrum<L> {
        self.front.reflected.all(if self.has_cuticle() { self.cuticle(at.cos) } else { 0.0 })
    }

    #[inline]
    fn cuticle(&self, cos: f32) -> f32 {
        Fresnel::new(cos, self.ior).unpolarised()
    }

    #[inline]
    fn face(&self, front: bool) -> &Face {
        if front { &self.front } else { &self.back }
    }

    /// Returns the radiance that leaves the sheet at an angle of this cosine, relative to the
    /// radiance along the normal.
    pub(super) fn relative_radiance(&self, cos: f32) -> f32 {
        (1.0 - self.cuticle(cos)) / (1.0 - self.cuticle(1.0))
    }

    /// Returns the lobe of light that crosses the sheet, for a path at `at`. It belongs to the face
    /// that the light enters, which for a path of importance is the face on the other side.
    #[inline]
    fn transmitted(&self, at: &Interaction, transport: Transport) -> &Lobe {
        &self.face(at.front == (transport == Transport::Light)).transmitted
    }

    #[inline(never)]
    pub(super) fn sample<L: Lanes>(
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

    pub(super) fn evaluate<L: Lanes>(&self, at: &Interaction, outgoing: Vec3) -> Spectrum<L> {
        let cos = outgoing.dot(at.normal);
        let face = self.face(at.front);
        let lobe = if cos > 0.0 { &face.reflected } else { &face.transmitted };
        let through = (1.0 - self.cuticle(at.cos)) * (1.0 - self.cuticle(cos.abs()));
        lobe.fraction().scaled(through / (PI * self.diffuse_transmittance))
    }

    pub(super) fn pdf(&self, at: &Interaction, transport: Transport, outgoing: Vec3) -> f32 {
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

    #[inline]
    pub(super) fn absorptance<L: Lanes>(&self, at: &Interaction) -> Spectrum<L> {
        let face = self.face(at.front);
        let scattered = face.reflected.fraction() + face.transmitted.fraction();
        complement(scattered).scaled(1.0 - self.cuticle(at.cos))
    }
}
