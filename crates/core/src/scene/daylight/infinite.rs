//! Light from infinitely far away, as photons and paths meet it.

use std::sync::Arc;

use glam::{DVec3, Vec3};

use super::{
    radiance_map::{MapEntry, RadianceMap},
    suns::{Suns, SunsEntry},
};
use crate::{
    error::{Problem, check_length, check_range},
    math::{
        rng::Stream,
        sampling::weighted_choice,
        spectrum::{Lanes, Spectrum},
    },
};

/// A light that is infinitely far away: the sun, the sky or an environment map.
///
/// Directions point towards the light, and densities are per solid angle. The unit W stands for
/// that of the scene's quantity: W or umol/s.
#[derive(Clone, Debug)]
pub struct InfiniteLight {
    /// Unique name.
    pub name: String,
    /// Number of bands of every part.
    bands: usize,
    parts: Vec<InfinitePart>,
    /// Running sums of the strengths of the parts, in proportion to which they are sampled.
    running: Vec<f64>,
    /// Planar polygons, m from the user's origin, with their front to the sky, through which alone
    /// the light comes in. It comes in everywhere if there are none.
    pub through: Vec<Vec<DVec3>>,
}

/// A part of a light at infinity: a shape over the directions, and its strength in each band.
#[derive(Clone, Debug)]
pub struct InfinitePart {
    shape: InfiniteShape,
    /// Ratio of the radiance, W/m2/sr, to the relative radiance of the shape, per band.
    scale: Vec<f64>,
}

/// Relative radiance by direction.
#[derive(Clone, Debug)]
pub enum InfiniteShape {
    /// Discs, or parallel rays. The scale is then the irradiance on a plane across their direction,
    /// W/m2.
    Suns(Arc<Suns>),
    /// Cells of a sphere.
    Map(Arc<RadianceMap>),
}

/// A direction that was sampled because light may come from there.
#[derive(Clone, Copy, Debug)]
pub struct DirectionSample<L> {
    /// Direction towards the light, unit vector.
    pub toward: Vec3,
    /// Radiance over the density of the sample, per band, W/m2.
    pub radiance_over_pdf: Spectrum<L>,
    /// Density of the sample, 1/sr, or `None` for parallel rays, which no other direction meets.
    pub pdf: Option<f32>,
}

/// The light of one part that enters through a plane face.
#[derive(Debug)]
pub struct InfiniteEntry {
    /// Irradiance on the face per band, W/m2.
    pub irradiance: Vec<f64>,
    shape: EntryShape,
}

#[derive(Debug)]
enum EntryShape {
    Suns(Arc<Suns>, SunsEntry),
    /// Map, with one factor for each band unless all bands are alike: the integral of density x
    /// cosine over that of radiance x cosine.
    Map(Arc<RadianceMap>, MapEntry, Option<Vec<f32>>),
}

/// A photon as it enters through a face.
#[derive(Clone, Copy, Debug)]
pub struct Entering<L> {
    /// Direction in which it flies, unit vector.
    pub direction: Vec3,
    /// Ratio of its power to the mean of all photons that enter, per band. It is 1 unless the bands
    /// of a map differ, and 0 in a band without light.
    pub factor: Spectrum<L>,
}

impl InfinitePart {
    /// Makes a part from a shape and the factor on its relative radiance in each band, at least 0.
    pub fn new(shape: InfiniteShape, scale: Vec<f64>) -> Self {
        Self { shape, scale }
    }

    /// Returns the strength per band, as it was given.
    pub fn scale(&self) -> &[f64] {
        &self.scale
    }

    /// Returns the integral of the radiance over all directions, summed over the bands, W/m2.
    fn strength(&self) -> f64 {
        let total = match &self.shape {
            InfiniteShape::Suns(suns) => suns.total(),
            InfiniteShape::Map(map) => map.total(),
        };
        total * self.scale.iter().sum::<f64>()
    }

    /// Returns whether the part consists of suns: discs that are too small to be met by chance, or
    /// parallel rays.
    pub fn is_sun(&self) -> bool {
        matches!(&self.shape, InfiniteShape::Suns(_))
    }

    /// Returns whether a plane that faces `normal` may see the part.
    fn may_shine_on(&self, normal: Vec3) -> bool {
        match &self.shape {
            InfiniteShape::Suns(suns) => suns.may_shine_on(normal.as_dvec3()),
            InfiniteShape::Map(_) => true,
        }
    }

    /// Returns the mean irradiance over all orientations of a plane, W/m2, in the brightest of the
    /// first `bands` bands. It is a quarter of the integral of the radiance.
    pub fn mean_irradiance(&self, bands: usize) -> f64 {
        let total = match &self.shape {
            InfiniteShape::Suns(suns) => suns.total(),
            InfiniteShape::Map(map) => map.total() / map.bands().unwrap_or(1) as f64,
        };
        0.25 * total * self.scale.iter().take(bands).copied().fold(0.0, f64::max)
    }

    /// Returns the radiance, W/m2/sr, and the density, 1/sr, with which
    /// [`sample`](InfiniteLight::sample) samples this direction within the part.
    fn look<L: Lanes>(&self, toward: Vec3) -> (Spectrum<L>, f64) {
        let toward = toward.as_dvec3();
        match &self.shape {
            InfiniteShape::Suns(suns) => {
                let radiance = suns.radiance(toward);
                (self.spectrum(|_| radiance), radiance / suns.total())
            }
            InfiniteShape::Map(map) if map.is_dark() => (self.spectrum(|_| 0.0), 0.0),
            InfiniteShape::Map(map) => {
                let cell = map.cell(toward);
                let radiance = self.spectrum(|b| f64::from(map.radiance(cell, b)));
                (radiance, f64::from(map.density(cell)) / map.total())
            }
        }
    }

    fn spectrum<L: Lanes>(&self, relative: impl Fn(usize) -> f64) -> Spectrum<L> {
        let value = |b: usize| self.scale.get(b).map_or(0.0, |scale| (scale * relative(b)) as f32);
        Spectrum::from_fn(self.scale.len(), value)
    }

    /// Returns the irradiance on a plane that faces `normal`, per band, W/m2.
    pub fn irradiance(&self, normal: Vec3) -> Vec<f64> {
        let normal = normal.as_dvec3().normalize();
        match &self.shape {
            InfiniteShape::Suns(suns) => self.scaled(&[suns.irradiance(normal)]),
            InfiniteShape::Map(map) => self.scaled(&map.irradiance(normal)),
        }
    }

    /// Multiplies relative values, one for all bands or one for each, with the strengths of the
    /// bands.
    fn scaled(&self, relative: &[f64]) -> Vec<f64> {
        let of = |b: usize| relative.get(b).or(relative.first()).copied().unwrap_or(0.0);
        self.scale.iter().enumerate().map(|(b, scale)| scale * of(b)).collect()
    }

    /// Returns the light that enters through a face whose outer side faces `outward`, or `None`
    /// where no light does. None comes from below a slope that faces `hillside`.
    pub fn entry(&self, outward: Vec3, hillside: Option<DVec3>) -> Option<InfiniteEntry> {
        let normal = outward.as_dvec3().normalize();
        let (irradiance, shape) = match &self.shape {
            InfiniteShape::Suns(suns) => {
                let entry = suns.entry(normal, hillside)?;
                (self.scaled(&[entry.total()]), EntryShape::Suns(suns.clone(), entry))
            }
            InfiniteShape::Map(map) => {
                let (entry, relative) = map.entry(normal, hillside)?;
                let factors = map.bands().map(|_| {
                    let of = |&e: &f64| if e > 0.0 { (entry.total() / e) as f32 } else { 0.0 };
                    relative.iter().map(of).collect()
                });
                (self.scaled(&relative), EntryShape::Map(map.clone(), entry, factors))
            }
        };
        let some = irradiance.iter().any(|&e| e > 0.0);
        some.then_some(InfiniteEntry { irradiance, shape })
    }
}

impl InfiniteLight {
    /// Makes a light from its parts, each with so many bands. Without parts it is dark, as the sun
    /// is at night.
    pub fn new(name: String, bands: usize, parts: Vec<InfinitePart>) -> Self {
        let mut sum = 0.0;
        let running = parts.iter().map(|part| {
            sum += part.strength();
            sum
        });
        let running = running.collect();
        Self { name, bands, parts, running, through: Vec::new() }
    }

    /// Checks the strengths. Error: a part has not one for each of `bands` bands, one is not a
    /// finite number of at least 0, or a map has another number of bands.
    pub fn check(&self, bands: usize) -> Result<(), Problem> {
        for part in &self.parts {
            check_length(part.scale.len(), bands).map_err(|problem| problem.of("strength"))?;
            for &scale in &part.scale {
                check_range(scale, 0.0, 1e30).map_err(|problem| problem.of("strength"))?;
            }
            if let InfiniteShape::Map(map) = &part.shape
                && let Some(of_map) = map.bands()
            {
                check_length(of_map, bands).map_err(|problem| problem.of("map"))?;
            }
        }
        Ok(())
    }

    /// Returns the parts, each of which enters a scene by itself.
    pub fn parts(&self) -> &[InfinitePart] {
        &self.parts
    }

    /// Returns whether the light is dark in every band.
    pub fn is_dark(&self) -> bool {
        self.running.last().is_none_or(|&sum| sum <= 0.0)
    }

    /// Returns the radiance that comes from a direction, per band, W/m2/sr. It does not include
    /// parallel rays.
    pub fn radiance<L: Lanes>(&self, toward: Vec3) -> Spectrum<L> {
        self.sum(self.parts.iter().map(|part| part.look(toward).0))
    }

    /// Returns the density, 1/sr, with which [`sample`](Self::sample) samples a direction. It does
    /// not include parallel rays.
    pub fn pdf(&self, toward: Vec3) -> f32 {
        let parts = self.parts.iter().enumerate();
        parts.map(|(p, part)| self.chance(p) * part.look::<[f32; 1]>(toward).1).sum::<f64>() as f32
    }

    /// Returns the chance that a direction is sampled from part `p`.
    fn chance(&self, p: usize) -> f64 {
        let before = if p == 0 { 0.0 } else { self.running[p - 1] };
        let total = self.running[self.running.len() - 1];
        if total > 0.0 { (self.running[p] - before) / total } else { 0.0 }
    }

    /// Returns whether a plane that faces `normal` may see the light.
    pub fn may_shine_on(&self, normal: Vec3) -> bool {
        self.parts.iter().any(|part| part.may_shine_on(normal))
    }

    /// Returns the number of suns that are part of the light.
    pub fn suns(&self) -> usize {
        let of_part = |part: &InfinitePart| match &part.shape {
            InfiniteShape::Suns(suns) => suns.count(),
            InfiniteShape::Map(_) => 0,
        };
        self.parts.iter().map(of_part).sum()
    }

    /// Returns whether suns are part of the light.
    pub fn has_sun(&self) -> bool {
        self.parts.iter().any(InfinitePart::is_sun)
    }

    /// Returns whether suns are part of the light, and all of them stand behind a slope that faces
    /// `hillside`, from where no light comes.
    pub fn is_behind(&self, hillside: DVec3) -> bool {
        let mut suns = self.parts.iter().filter(|part| part.is_sun());
        self.has_sun() && !suns.any(|part| part.may_shine_on(hillside.as_vec3()))
    }

    /// Returns the radiance that comes from a direction without that of suns, per band, W/m2/sr.
    pub fn radiance_without_suns<L: Lanes>(&self, toward: Vec3) -> Spectrum<L> {
        let parts = self.parts.iter().filter(|part| !part.is_sun());
        self.sum(parts.map(|part| part.look(toward).0))
    }

    /// Returns the sum of the radiances of parts.
    fn sum<L: Lanes>(&self, radiances: impl Iterator<Item = Spectrum<L>>) -> Spectrum<L> {
        let nothing = Spectrum::from_fn(self.bands, |_| 0.0);
        radiances.fold(nothing, |sum, radiance| sum + radiance)
    }

    /// Samples a direction in proportion to the radiance (over all bands). Returns `None` where the
    /// light is dark.
    pub fn sample<L: Lanes>(&self, rng: &mut Stream) -> Option<DirectionSample<L>> {
        if self.is_dark() {
            return None;
        }
        let chosen = match self.parts.len() {
            1 => 0,
            _ => weighted_choice(&self.running, rng.uniform().into()).index,
        };
        let (part, chance) = (&self.parts[chosen], self.chance(chosen));
        let (toward, mut radiance, mut pdf) = match &part.shape {
            InfiniteShape::Suns(suns) => {
                let (toward, radiance) = suns.sample(rng);
                if suns.is_parallel() {
                    let radiance_over_pdf = part.spectrum(|_| 1.0 / chance);
                    let toward = toward.as_vec3();
                    return Some(DirectionSample { toward, radiance_over_pdf, pdf: None });
                }
                (toward, part.spectrum(|_| radiance), radiance / suns.total())
            }
            InfiniteShape::Map(map) => {
                let (toward, cell) = map.sample(rng);
                let radiance = part.spectrum(|b| f64::from(map.radiance(cell, b)));
                (toward, radiance, f64::from(map.density(cell)) / map.total())
            }
        };
        let toward = toward.as_vec3();
        pdf *= chance;
        for (p, other) in self.parts.iter().enumerate().filter(|(p, _)| *p != chosen) {
            let (more, density) = other.look(toward);
            radiance += more;
            pdf += self.chance(p) * density;
        }
        let radiance_over_pdf = radiance.scaled((1.0 / pdf) as f32);
        (pdf > 0.0).then_some(DirectionSample { toward, radiance_over_pdf, pdf: Some(pdf as f32) })
    }

    /// Samples a direction towards the suns of the light in proportion to their radiance (over all
    /// bands). Returns with it the irradiance of the suns on a plane across the direction, over the
    /// probability of the choice, per band, W/m2. Returns `None` where the light has no suns.
    pub fn sample_suns<L: Lanes>(&self, rng: &mut Stream) -> Option<(Vec3, Spectrum<L>)> {
        self.suns_by(rng, |suns, rng| (suns.direction(rng), 1.0))
    }

    /// Samples like [`sample_suns`](Self::sample_suns), but each sun of a part as likely as the others:
    /// if they are those of an hour, each stands for the same time.
    pub fn sample_suns_alike<L: Lanes>(&self, rng: &mut Stream) -> Option<(Vec3, Spectrum<L>)> {
        self.suns_by(rng, Suns::each_alike)
    }

    /// Samples a part of the light that has suns in proportion to its strength, and a direction in it
    /// by `choose`, which returns with it the ratio of radiance to the density of the choice over the
    /// part's integral of radiance.
    fn suns_by<L: Lanes>(
        &self,
        rng: &mut Stream,
        choose: impl Fn(&Suns, &mut Stream) -> (DVec3, f64),
    ) -> Option<(Vec3, Spectrum<L>)> {
        let suns = self.parts.iter().filter_map(|part| match &part.shape {
            InfiniteShape::Suns(suns) => Some((part, suns)),
            InfiniteShape::Map(_) => None,
        });
        let all: f64 = suns.clone().map(|(part, _)| part.strength()).sum();
        let mut rest = match suns.clone().nth(1) {
            Some(_) => f64::from(rng.uniform()) * all,
            None => 0.0,
        };
        let (part, suns) = suns.filter(|(part, _)| part.strength() > 0.0).find(|(part, _)| {
            rest -= part.strength();
            rest < 0.0
        })?;
        let irradiance = suns.total() * all / part.strength();
        let (toward, ratio) = choose(suns, rng);
        Some((toward.as_vec3(), part.spectrum(|_| ratio * irradiance)))
    }

    /// Returns the irradiance on a plane that faces `normal`, per band, W/m2.
    pub fn irradiance(&self, normal: Vec3) -> Vec<f64> {
        let mut sum: Vec<f64> = Vec::new();
        for part in &self.parts {
            let irradiance = part.irradiance(normal);
            sum.resize(irradiance.len(), 0.0);
            sum.iter_mut().zip(irradiance).for_each(|(s, e)| *s += e);
        }
        sum
    }
}

impl InfiniteEntry {
    /// Returns the largest [`factor`](Entering::factor) of a photon in a band.
    pub fn largest_factor(&self, band: usize) -> f64 {
        match &self.shape {
            EntryShape::Map(map, _, Some(factors)) => {
                f64::from(factors.get(band).map_or(0.0, |factor| factor * map.most(band)))
            }
            EntryShape::Suns(..) | EntryShape::Map(_, _, None) => 1.0,
        }
    }

    /// Draws a photon that enters through the face; the density of its direction is in proportion
    /// to radiance x cosine.
    pub fn sample<L: Lanes>(&self, rng: &mut Stream) -> Entering<L> {
        let bands = self.irradiance.len();
        let bright = Spectrum::from_fn(bands, |b| {
            f32::from(self.irradiance.get(b).is_some_and(|&e| e > 0.0))
        });
        match &self.shape {
            EntryShape::Suns(suns, entry) => {
                let toward = suns.sample_entry(entry, rng);
                Entering { direction: -toward.as_vec3(), factor: bright }
            }
            EntryShape::Map(map, entry, factors) => {
                let (toward, cell) = map.sample_entry(entry, rng);
                let factor = match factors {
                    None => bright,
                    Some(factors) => {
                        let own = |b: usize| map.radiance(cell, b) / map.density(cell);
                        let factor = |b: usize| factors.get(b).map_or(0.0, |f| f * own(b));
                        bright * Spectrum::from_fn(bands, factor)
                    }
                };
                Entering { direction: -toward.as_vec3(), factor }
            }
        }
    }
}
