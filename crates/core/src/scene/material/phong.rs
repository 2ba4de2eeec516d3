//! Lambertian reflection and transmission with a glossy (Phong) lobe or a mirror.

use std::f32::consts::PI;

use glam::Vec3;

use super::{
    BsdfSample, Interaction, Lobe, Scatterer, Transport, check_per_band, check_sum, choose,
    complement, diffuse, mirrored_way,
};
use crate::{
    error::{Problem, check_range},
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
    /// for a mirror. `bands` are the names of the bands. Error: a number is out of its range, there
    /// is not one for each band, or the sum of the fractions is above 1.
    pub fn new(
        fractions: PhongFractions,
        exponent: Option<f32>,
        bands: &[&str],
    ) -> Result<Self, Problem> {
        let PhongFractions { reflectance, specular, transmittance } = fractions;
        let named = [
            ("reflectance", reflectance),
            ("specular", specular),
            ("transmittance", transmittance),
        ];
        for (name, values) in named {
            check_per_band(name, values, bands.len())?;
        }
        if let Some(exponent) = exponent {
            let problem = check_range(exponent.into(), 0.0, MAX_EXPONENT);
            problem.map_err(|problem| problem.of("exponent"))?;
        }
        for band in 0..bands.len() {
            let sum = named.iter().map(|(_, values)| f64::from(values[band])).sum();
            check_sum("reflectance + specular + transmittance", sum, band, bands)?;
        }
        let [reflected, specular, transmitted] = named.map(|(_, values)| Lobe::new(values));
        Ok(Self { reflected, specular, transmitted, exponent })
    }

    fn fractions(&self) -> [f32; 3] {
        [self.reflected.largest, self.specular.largest, self.transmitted.largest]
    }

    /// Returns the density, 1/sr, of the lobe around the mirror direction. The lobe may reach below
    /// the surface.
    fn lobe_density(exponent: f32, at: &Interaction, outgoing: Vec3) -> f32 {
        cosine_power_density(exponent, 0.5 * outgoing.distance_squared(at.mirrored()))
    }
}

impl Scatterer for Phong {
    fn lanes(&self) -> usize {
        self.reflected.len()
    }

    fn placed(self, lanes: usize, _tangents: Vec<(u32, Vec3)>) -> Self {
        let Self { reflected, specular, transmitted, exponent } = self;
        let [reflected, specular, transmitted] =
            [reflected, specular, transmitted].map(|lobe| lobe.in_lanes(lanes));
        Self { reflected, specular, transmitted, exponent }
    }

    #[inline(never)]
    fn sample<L: Lanes>(
        &self,
        at: &Interaction,
        _transport: Transport,
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

    fn evaluate<L: Lanes>(&self, at: &Interaction, outgoing: Vec3) -> Spectrum<L> {
        if outgoing.dot(at.normal) <= 0.0 {
            return self.transmitted.fraction().scaled(1.0 / PI);
        }
        let diffuse = self.reflected.fraction().scaled(1.0 / PI);
        let Some(n) = self.exponent else { return diffuse };
        let lobe = (n + 2.0) / (n + 1.0) * Self::lobe_density(n, at, outgoing);
        diffuse + self.specular.fraction().scaled(lobe)
    }

    fn pdf(&self, at: &Interaction, _transport: Transport, outgoing: Vec3) -> f32 {
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

    fn smooth_ways<L: Lanes>(
        &self,
        at: &Interaction,
        _transport: Transport,
    ) -> [Option<BsdfSample<L>>; 2] {
        if self.has_mirror() { mirrored_way(at, self.specular.fraction()) } else { [None, None] }
    }

    #[inline]
    fn absorptance<L: Lanes>(&self, _at: &Interaction) -> Option<Spectrum<L>> {
        if self.exponent.is_some() && self.specular.largest > 0.0 {
            return None;
        }
        let diffuse = self.reflected.fraction() + self.transmitted.fraction();
        Some(complement(diffuse + self.specular.fraction()))
    }

    fn relative_radiance(&self, _cos: f32) -> Option<f32> {
        (self.glossy() == 0.0).then_some(1.0)
    }

    fn is_diffuse(&self) -> bool {
        true
    }

    fn transmits_diffusely(&self) -> bool {
        self.transmitted.largest > 0.0
    }

    fn has_mirror(&self) -> bool {
        self.exponent.is_none() && self.specular.largest > 0.0
    }

    fn glossy(&self) -> f32 {
        if self.exponent.is_some() { self.specular.largest } else { 0.0 }
    }
}
