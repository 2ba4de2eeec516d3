//! Lambertian reflection and transmission with a glossy (Phong) lobe or a mirror.

use std::f32::consts::PI;

use glam::Vec3;

use super::{BsdfSample, Checked, Interaction, Lobe, check_sum, choose, complement, diffuse};
use crate::{
    error::check_range,
    math::{
        geometry::Frame,
        rng::Stream,
        sampling::{cosine_hemisphere_density, cosine_power, cosine_power_density},
        spectrum::{Lanes, Spectrum},
    },
};

/// Largest exponent of the lobe. In single precision a narrower lobe could not be told from a
/// mirror.
pub const MAX_EXPONENT: f64 = 1e9;

/// Modified Phong model, with both faces alike. Above the surface f is the sum of reflectance / pi
/// and specular (n+2) / (2 pi) cos^n(alpha), with alpha the angle to the mirror direction; below it
/// f is transmittance / pi (Lafortune and Willems, 1994). Without an exponent the lobe is a mirror
/// at every angle.
#[derive(Clone, Debug, PartialEq)]
pub struct Phong {
    reflected: Lobe,
    specular: Lobe,
    transmitted: Lobe,
    exponent: Option<f32>,
}

/// Fractions per band of a [`Phong`] material. Each is in [0, 1], and the sum of the three is at
/// most 1.
#[derive(Clone, Copy, Debug)]
pub struct PhongFractions<'a> {
    /// Lambertian reflectance.
    pub reflectance: &'a [f32],
    /// Specular reflectance, at normal incidence.
    pub specular: &'a [f32],
    /// Lambertian transmittance.
    pub transmittance: &'a [f32],
}

impl Phong {
    /// Makes the material from its fractions and the exponent of the lobe (0 to 10^9), or `None`
    /// for a mirror.
    pub fn new(fractions: PhongFractions, exponent: Option<f32>) -> Self {
        Self {
            reflected: Lobe::new(fractions.reflectance),
            specular: Lobe::new(fractions.specular),
            transmitted: Lobe::new(fractions.transmittance),
            exponent,
        }
    }

    pub(super) fn check(&self, names: &[&str]) -> Checked {
        let bands = names.len();
        let Self { reflected, specular, transmitted, exponent } = self;
        reflected.check("reflectance", bands)?;
        specular.check("specular", bands)?;
        transmitted.check("transmittance", bands)?;
        if let Some(exponent) = *exponent {
            let problem = check_range(exponent.into(), 0.0, MAX_EXPONENT);
            problem.map_err(|problem| problem.of("exponent"))?;
        }
        (0..bands).try_for_each(|band| {
            let sum = [reflected, specular, transmitted].map(|lobe| lobe.of_band(band));
            let sum = sum.iter().sum();
            check_sum("reflectance + specular + transmittance", sum, band, names)
        })
    }

    pub(super) fn lobes_mut(&mut self) -> [&mut Lobe; 3] {
        [&mut self.reflected, &mut self.specular, &mut self.transmitted]
    }

    /// Returns whether the specular lobe is a mirror and reflects some light.
    pub(super) fn has_mirror(&self) -> bool {
        self.exponent.is_none() && self.specular.largest > 0.0
    }

    /// Returns the largest specular fraction in any band, or 0 where the lobe is a mirror.
    pub(super) fn glossy(&self) -> f32 {
        if self.exponent.is_some() { self.specular.largest } else { 0.0 }
    }

    /// Returns the fraction per band that is mirrored; 0 for a glossy lobe.
    pub(super) fn mirrored<L: Lanes>(&self) -> Spectrum<L> {
        if self.has_mirror() { self.specular.fraction() } else { self.specular.nothing() }
    }

    /// Returns whether some light is transmitted.
    pub(super) fn transmits(&self) -> bool {
        self.transmitted.largest > 0.0
    }

    fn fractions(&self) -> [f32; 3] {
        [self.reflected.largest, self.specular.largest, self.transmitted.largest]
    }

    #[inline(never)]
    pub(super) fn sample<L: Lanes>(
        &self,
        at: &Interaction,
        rng: &mut Stream,
    ) -> Option<BsdfSample<L>> {
        let choice = choose(self.fractions(), rng)?;
        let scale = |s: Spectrum<L>| s.scaled(choice.weight);
        Some(match (choice.lobe, self.exponent) {
            (0, _) => BsdfSample::diffuse(
                diffuse(at.normal, rng),
                scale(self.reflected.relative()),
                false,
            ),
            (1, None) => BsdfSample::mirrored(at, scale(self.specular.relative())),
            (1, Some(n)) => {
                let around_mirror = cosine_power(n, rng.square());
                let direction = Frame::new(at.mirrored()).to_world(around_mirror);
                let cos = direction.dot(at.normal);
                if cos <= 0.0 {
                    return None;
                }
                let weight = (n + 2.0) / (n + 1.0) * cos;
                BsdfSample::diffuse(
                    direction,
                    scale(self.specular.relative()).scaled(weight),
                    false,
                )
            }
            _ => BsdfSample::diffuse(
                diffuse(-at.normal, rng),
                scale(self.transmitted.relative()),
                true,
            ),
        })
    }

    pub(super) fn evaluate<L: Lanes>(&self, at: &Interaction, outgoing: Vec3) -> Spectrum<L> {
        if outgoing.dot(at.normal) <= 0.0 {
            return self.transmitted.fraction().scaled(1.0 / PI);
        }
        let diffuse = self.reflected.fraction().scaled(1.0 / PI);
        let Some(n) = self.exponent else { return diffuse };
        let lobe = (n + 2.0) / (n + 1.0) * Self::lobe_density(n, at, outgoing);
        diffuse + self.specular.fraction().scaled(lobe)
    }

    /// Returns the density, 1/sr, of the lobe around the mirror direction. The lobe may reach below
    /// the surface.
    fn lobe_density(exponent: f32, at: &Interaction, outgoing: Vec3) -> f32 {
        cosine_power_density(exponent, 0.5 * outgoing.distance_squared(at.mirrored()))
    }

    pub(super) fn pdf(&self, at: &Interaction, outgoing: Vec3) -> f32 {
        let [reflected, specular, transmitted] = self.fractions();
        let total = (reflected + specular + transmitted).max(f32::MIN_POSITIVE);
        let cos = outgoing.dot(at.normal);
        let density = if cos <= 0.0 {
            transmitted * cosine_hemisphere_density(-cos)
        } else {
            let lobe = self.exponent.map_or(0.0, |n| Self::lobe_density(n, at, outgoing));
            reflected * cosine_hemisphere_density(cos) + specular * lobe
        };
        density / total
    }

    #[inline]
    pub(super) fn absorptance<L: Lanes>(&self) -> Option<Spectrum<L>> {
        if self.exponent.is_some() && self.specular.largest > 0.0 {
            return None;
        }
        let diffuse = self.reflected.fraction() + self.transmitted.fraction();
        Some(complement(diffuse + self.specular.fraction()))
    }
}
