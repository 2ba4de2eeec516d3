//! Smooth dielectrics: the interface of a closed solid, and the thin pane.

use glam::Vec3;

use super::{
    BsdfSample, Fresnel, Interaction, Lobe, LobeKind, Scatterer, Transport, checked_ior, choose,
    complement,
};
use crate::{
    error::{Problem, check_length},
    math::{
        rng::Stream,
        spectrum::{Lanes, Spectrum},
    },
};

/// Smooth interface between air, on the front, and a solid, with Fresnel reflection and Snell
/// refraction.
#[derive(Clone, Debug, PartialEq)]
pub struct Dielectric {
    ior: f32,
    tint: Lobe,
}

impl Dielectric {
    /// Makes the material from the index of refraction (1 to 1000) and the tint per band, in
    /// [0, 1]. The tint is a factor on the light that is transmitted at each crossing. Error: a
    /// number is out of its range.
    pub fn new(ior: f64, tint: &[f32]) -> Result<Self, Problem> {
        Ok(Self { ior: checked_ior(ior)?, tint: Lobe::checked("tint", tint)? })
    }

    /// Returns the index of refraction of the solid.
    pub fn ior(&self) -> f32 {
        self.ior
    }

    /// Returns the index of the medium beyond the surface over the index on the side of incidence.
    #[inline]
    fn eta(&self, at: &Interaction) -> f32 {
        if at.front { self.ior } else { 1.0 / self.ior }
    }

    #[inline]
    fn reflected<L: Lanes>(
        &self,
        at: &Interaction,
        fresnel: &Fresnel,
        fraction: f32,
    ) -> BsdfSample<L> {
        let mirrored = BsdfSample::mirrored(at, self.tint.all(fraction));
        let total = fresnel.is_total();
        BsdfSample {
            lobe: if total { LobeKind::TotalReflection } else { mirrored.lobe },
            ..mirrored
        }
    }

    #[inline]
    fn refracted<L: Lanes>(
        &self,
        at: &Interaction,
        fresnel: &Fresnel,
        transport: Transport,
        fraction: Spectrum<L>,
    ) -> BsdfSample<L> {
        let eta = self.eta(at);
        let along = at.cos / eta - fresnel.cos_refracted;
        let direction = (at.direction / eta + along * at.normal).normalize();
        // the radiance of a backward path scales by (n here / n there)^2; the power of a photon
        // does not
        let scale = match transport {
            Transport::Light => 1.0,
            Transport::Importance => 1.0 / (eta * eta),
        };
        BsdfSample { direction, weight: fraction.scaled(scale), lobe: LobeKind::Refraction }
    }
}

impl Scatterer for Dielectric {
    fn lanes(&self) -> usize {
        self.tint.len()
    }

    fn check_bands(&self, bands: usize) -> Result<(), Problem> {
        check_length(self.lanes(), bands).map_err(|problem| problem.of("tint"))
    }

    fn placed(self, lanes: usize, _tangents: Vec<(u32, Vec3)>) -> Self {
        Self { tint: self.tint.in_lanes(lanes), ..self }
    }

    #[inline(never)]
    fn sample<L: Lanes>(
        &self,
        at: &Interaction,
        transport: Transport,
        rng: &mut Stream,
    ) -> Option<BsdfSample<L>> {
        let fresnel = Fresnel::new(at.cos, self.eta(at));
        let reflected = fresnel.unpolarised();
        let choice = choose([reflected, (1.0 - reflected) * self.tint.largest], rng)?;
        Some(match choice.lobe {
            0 => self.reflected(at, &fresnel, choice.weight),
            _ => {
                let relative = self.tint.relative().scaled(choice.weight);
                self.refracted(at, &fresnel, transport, relative)
            }
        })
    }

    fn smooth_ways<L: Lanes>(
        &self,
        at: &Interaction,
        transport: Transport,
    ) -> [Option<BsdfSample<L>>; 2] {
        let fresnel = Fresnel::new(at.cos, self.eta(at));
        let reflected = fresnel.unpolarised();
        let beyond = self.tint.fraction().scaled(1.0 - reflected);
        let crosses = !fresnel.is_total();
        [
            (reflected > 0.0).then(|| self.reflected(at, &fresnel, reflected)),
            crosses.then(|| self.refracted(at, &fresnel, transport, beyond)),
        ]
    }

    #[inline]
    fn absorptance<L: Lanes>(&self, at: &Interaction) -> Option<Spectrum<L>> {
        let transmitted = 1.0 - Fresnel::new(at.cos, self.eta(at)).unpolarised();
        Some(complement(self.tint.fraction()).scaled(transmitted))
    }

    fn has_mirror(&self) -> bool {
        true
    }

    fn is_clear(&self) -> bool {
        true
    }

    fn is_solid(&self) -> bool {
        true
    }
}

/// A pane with two parallel faces, represented by one polygon. With F the reflectance of a face and
/// a the fraction of light that one passage between the faces leaves, the sum over all reflections
/// between the faces is F + F (1-F)^2 a^2 / (1 - F^2 a^2) for the mirrored light and (1-F)^2 a /
/// (1 - F^2 a^2) for the light that goes straight on. Both are averaged over the two polarisations
/// (Stokes, Proc. R. Soc. 11, 1862).
#[derive(Clone, Debug, PartialEq)]
pub struct Pane {
    ior: f32,
    tint: Lobe,
}

/// Fractions of the light that meets a pane; their sum is 1.
struct Shares {
    mirrored: f32,
    passed: f32,
    absorbed: f32,
}

impl Pane {
    /// Makes the material from the index of refraction (1 to 1000) and the tint per band, in
    /// [0, 1]. The tint is the internal transmittance: the fraction of light that one passage along
    /// the normal leaves. At an angle it is tint^(1 / cosine inside), by the Beer-Lambert law.
    /// Error: a number is out of its range.
    pub fn new(ior: f64, tint: &[f32]) -> Result<Self, Problem> {
        Ok(Self { ior: checked_ior(ior)?, tint: Lobe::checked("tint", tint)? })
    }

    /// Returns the fractions for one value of the tint. `faces` holds the reflectances of one face.
    #[inline(always)]
    fn shares(faces: &Fresnel, tint: f32) -> Shares {
        let passage = tint.powf(1.0 / faces.cos_refracted);
        let [s, p] = [faces.s, faces.p].map(|f| {
            let enters = 1.0 - f;
            // the sum of the reflections, (1 - f) / (1 - f a), in a form that stays exact where f
            // and a are nearly 1
            let inside =
                if enters > 0.0 { enters / (1.0 - passage + passage * enters) } else { 0.0 };
            let passed = enters * passage * inside / (1.0 + f * passage);
            Shares {
                mirrored: f + f * passage * passed,
                passed,
                absorbed: (1.0 - passage) * inside,
            }
        });
        let mirrored = 0.5 * (s.mirrored + p.mirrored);
        // a pane that absorbs nothing must not lose light to rounding either
        let passed = if passage == 1.0 { 1.0 - mirrored } else { 0.5 * (s.passed + p.passed) };
        Shares { mirrored, passed, absorbed: 0.5 * (s.absorbed + p.absorbed) }
    }

    /// Returns the power with which the tint enters into what is mirrored, if it `mirrors`, or into
    /// what goes straight on: d ln f / d ln tint. Light that goes through between the faces k times
    /// brings k / cosine inside. 0 where there is no light.
    fn power(faces: &Fresnel, tint: f32, mirrors: bool) -> f32 {
        let passage = tint.powf(1.0 / faces.cos_refracted);
        let mut sums = [0.0; 2];
        for f in [faces.s, faces.p] {
            let (enters, twice) = (1.0 - f, f * passage);
            // 1 - f^2 a^2, exact where f and a are nearly 1
            let left = (1.0 - passage + passage * enters) * (1.0 + twice);
            if left <= 0.0 {
                sums[0] += f32::from(mirrors);
                continue;
            }
            let passed = enters * enters * passage / left;
            // the mean number of passages of what goes straight on; what is mirrored from within
            // makes one more
            let passages = (1.0 + twice * twice) / left;
            let (all, counted) = match mirrors {
                true => (f + twice * passed, twice * passed * (passages + 1.0)),
                false => (passed, passed * passages),
            };
            sums = [sums[0] + all, sums[1] + counted];
        }
        let power = sums[1] / sums[0] / faces.cos_refracted;
        if power.is_finite() { power } else { 0.0 }
    }

    /// Returns one of the fractions, per band.
    #[inline(always)]
    fn per_band<L: Lanes>(&self, at: &Interaction, which: impl Fn(Shares) -> f32) -> Spectrum<L> {
        let faces = Fresnel::new(at.cos, self.ior);
        self.tint.fraction::<L>().map(|tint| which(Self::shares(&faces, tint)))
    }

    /// Returns what is mirrored and what goes straight through, per band.
    #[inline(always)]
    fn fractions<L: Lanes>(&self, at: &Interaction) -> [Spectrum<L>; 2] {
        let faces = Fresnel::new(at.cos, self.ior);
        let tint = self.tint.fraction::<L>();
        let mut mirrored = tint.clone();
        let passed = Spectrum::<L>::from_fn(tint.values().len(), |band| {
            let shares = Self::shares(&faces, tint.values()[band]);
            mirrored.0.values_mut()[band] = shares.mirrored;
            shares.passed
        });
        [mirrored, passed]
    }

    /// Returns the fraction that a pane of index `ior` without absorption transmits at a cosine of
    /// incidence.
    pub(super) fn lossless(cos: f32, ior: f32) -> f32 {
        Self::shares(&Fresnel::new(cos, ior), 1.0).passed
    }

    /// Returns the fraction that goes straight through, per band.
    pub fn transmittance<L: Lanes>(&self, at: &Interaction) -> Spectrum<L> {
        self.per_band(at, |shares| shares.passed)
    }
}

impl Scatterer for Pane {
    fn lanes(&self) -> usize {
        self.tint.len()
    }

    fn check_bands(&self, bands: usize) -> Result<(), Problem> {
        check_length(self.lanes(), bands).map_err(|problem| problem.of("tint"))
    }

    fn placed(self, lanes: usize, _tangents: Vec<(u32, Vec3)>) -> Self {
        Self { tint: self.tint.in_lanes(lanes), ..self }
    }

    #[inline(never)]
    fn sample<L: Lanes>(
        &self,
        at: &Interaction,
        _transport: Transport,
        rng: &mut Stream,
    ) -> Option<BsdfSample<L>> {
        let [mirrored, passed] = self.fractions::<L>(at);
        let largest = [mirrored.largest(), passed.largest()];
        let choice = choose(largest, rng)?;
        let relative =
            |share: Spectrum<L>| share.map(|share| share / largest[choice.lobe] * choice.weight);
        Some(match choice.lobe {
            0 => BsdfSample::mirrored(at, relative(mirrored)),
            _ => BsdfSample::straight(at, relative(passed)),
        })
    }

    fn smooth_ways<L: Lanes>(
        &self,
        at: &Interaction,
        _transport: Transport,
    ) -> [Option<BsdfSample<L>>; 2] {
        let [mirrored, passed] = self.fractions(at);
        [
            (self.ior > 1.0).then(|| BsdfSample::mirrored(at, mirrored)),
            Some(BsdfSample::straight(at, passed)),
        ]
    }

    #[inline]
    fn straight<L: Lanes>(&self, direction: Vec3, front_normal: Vec3) -> Option<Spectrum<L>> {
        Some(self.transmittance(&Interaction::new(direction, front_normal)))
    }

    fn powers<L: Lanes>(&self, at: &Interaction, lobe: LobeKind) -> Option<Spectrum<L>> {
        let mirrors = match lobe {
            LobeKind::Straight => false,
            LobeKind::MirrorReflection => true,
            _ => return None,
        };
        let faces = Fresnel::new(at.cos, self.ior);
        Some(self.tint.fraction::<L>().map(|tint| Self::power(&faces, tint, mirrors)))
    }

    #[inline]
    fn absorptance<L: Lanes>(&self, at: &Interaction) -> Option<Spectrum<L>> {
        Some(self.per_band(at, |shares| shares.absorbed))
    }

    fn has_mirror(&self) -> bool {
        true
    }

    fn is_clear(&self) -> bool {
        true
    }
}
