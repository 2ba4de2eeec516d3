//! Smooth dielectrics: the interface of a closed solid, and the thin pane.

use super::{
    Checked, Encounter, Fresnel, Lobe, Onward, Scatter, Transport, check_ior, choose, complement,
};
use crate::math::{rng::Stream, spectrum::Spectrum};

/// Interface between air, on the front, and a solid: Fresnel reflection, Snell refraction.
#[derive(Clone, Debug, PartialEq)]
pub struct Dielectric {
    ior: f32,
    pub(super) tint: Lobe,
}

impl Dielectric {
    /// From the index of refraction (at least 1) and the tint per band, in [0, 1], that
    /// multiplies what is transmitted at each crossing.
    pub fn new(ior: f32, tint: &[f32]) -> Self {
        Self { ior, tint: Lobe::new(tint) }
    }

    pub(super) fn check(&self, bands: usize) -> Checked {
        check_ior(self.ior.into())?;
        self.tint.check("tint", bands)
    }

    /// Index of refraction of the solid.
    pub fn ior(&self) -> f32 {
        self.ior
    }

    /// Index beyond the surface relative to the index on the side of incidence.
    #[inline]
    fn eta(&self, at: &Encounter) -> f32 {
        if at.front { self.ior } else { 1.0 / self.ior }
    }

    #[inline(never)]
    pub(super) fn sample<const N: usize>(
        &self,
        at: &Encounter,
        transport: Transport,
        rng: &mut Stream,
    ) -> Option<Scatter<N>> {
        let fresnel = Fresnel::new(at.cos, self.eta(at));
        let reflected = fresnel.unpolarised();
        let choice = choose([reflected, (1.0 - reflected) * self.tint.largest], transport, rng)?;
        Some(match choice.lobe {
            0 => Self::reflected(at, &fresnel, choice.weight),
            _ => {
                let relative = self.tint.relative().scaled(choice.weight);
                self.refracted(at, &fresnel, transport, relative)
            }
        })
    }

    /// Both ways on, each with the fraction that it carries.
    pub(super) fn ways<const N: usize>(
        &self,
        at: &Encounter,
        transport: Transport,
    ) -> [Option<Scatter<N>>; 2] {
        let fresnel = Fresnel::new(at.cos, self.eta(at));
        let reflected = fresnel.unpolarised();
        let beyond = self.tint.fraction().scaled(1.0 - reflected);
        let crosses = !fresnel.is_total();
        [
            (reflected > 0.0).then(|| Self::reflected(at, &fresnel, reflected)),
            crosses.then(|| self.refracted(at, &fresnel, transport, beyond)),
        ]
    }

    #[inline]
    fn reflected<const N: usize>(at: &Encounter, fresnel: &Fresnel, fraction: f32) -> Scatter<N> {
        let scatter = Scatter::specular(at.mirrored(), Spectrum::ONE.scaled(fraction), false);
        Scatter { total_reflection: fresnel.is_total(), ..scatter }
    }

    #[inline]
    fn refracted<const N: usize>(
        &self,
        at: &Encounter,
        fresnel: &Fresnel,
        transport: Transport,
        fraction: Spectrum<N>,
    ) -> Scatter<N> {
        let eta = self.eta(at);
        let along = at.cos / eta - fresnel.cos_refracted;
        let direction = (at.direction / eta + along * at.normal).normalize();
        // radiance, seen backward, scales by (n here / n there)^2; photon power does not
        let scale = match transport {
            Transport::Light => 1.0,
            Transport::Importance => 1.0 / (eta * eta),
        };
        Scatter::specular(direction, fraction.scaled(scale), true)
    }

    #[inline]
    pub(super) fn absorptance<const N: usize>(&self, at: &Encounter) -> Spectrum<N> {
        let transmitted = 1.0 - Fresnel::new(at.cos, self.eta(at)).unpolarised();
        complement(self.tint.fraction()).scaled(transmitted)
    }
}

/// A pane with two parallel faces, seen as one polygon: with F the reflectance of one face,
/// 2F/(1+F) is mirrored and (1-F)/(1+F) goes straight on, averaged over the polarisations.
#[derive(Clone, Debug, PartialEq)]
pub struct Pane {
    ior: f32,
    pub(super) tint: Lobe,
}

impl Pane {
    /// From the index of refraction (at least 1) and the tint of the whole pane per band, in [0, 1].
    pub fn new(ior: f32, tint: &[f32]) -> Self {
        Self { ior, tint: Lobe::new(tint) }
    }

    pub(super) fn check(&self, bands: usize) -> Checked {
        check_ior(self.ior.into())?;
        self.tint.check("tint", bands)
    }

    #[inline]
    fn reflectance(&self, at: &Encounter) -> f32 {
        let Fresnel { s, p, .. } = Fresnel::new(at.cos, self.ior);
        s / (1.0 + s) + p / (1.0 + p)
    }

    #[inline(never)]
    pub(super) fn sample<const N: usize>(
        &self,
        at: &Encounter,
        transport: Transport,
        rng: &mut Stream,
    ) -> Option<Scatter<N>> {
        let reflected = self.reflectance(at);
        let choice = choose([reflected, (1.0 - reflected) * self.tint.largest], transport, rng)?;
        Some(match choice.lobe {
            0 => Scatter::specular(at.mirrored(), Spectrum::ONE.scaled(choice.weight), false),
            _ => Scatter {
                onward: Onward::Straight,
                ..Scatter::new(at.direction, self.tint.relative().scaled(choice.weight), true)
            },
        })
    }

    #[inline]
    pub(super) fn absorptance<const N: usize>(&self, at: &Encounter) -> Spectrum<N> {
        complement(self.tint.fraction()).scaled(1.0 - self.reflectance(at))
    }

    /// Both ways on, each with the fraction that it carries.
    pub(super) fn ways<const N: usize>(&self, at: &Encounter) -> [Option<Scatter<N>>; 2] {
        let reflected = Spectrum::ONE.scaled(self.reflectance(at));
        let straight = Scatter::new(at.direction, self.transmittance(at), true);
        [
            (self.ior > 1.0).then(|| Scatter::specular(at.mirrored(), reflected, false)),
            Some(Scatter { onward: Onward::Straight, ..straight }),
        ]
    }

    /// Fraction that goes straight through, per band.
    pub fn transmittance<const N: usize>(&self, at: &Encounter) -> Spectrum<N> {
        self.tint.fraction().scaled(1.0 - self.reflectance(at))
    }
}
