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

/// A light that is infinitely far away: the sun, the sky, an environment map.
///
/// Directions point towards the light; densities are per solid angle. Units are those of the scene's
/// quantity: W or umol/s.
#[derive(Clone, Debug)]
pub struct InfiniteLight {
    /// Unique name.
    pub name: String,
    /// Number of bands of every part.
    bands: usize,
    parts: Vec<InfinitePart>,
    /// Running sums of the chances of the parts.
    running: Vec<f64>,
    /// Planar polygons, m from the user's origin, front to the sky: its light comes in through these alone. None
    /// where it comes in everywhere.
    pub through: Vec<Vec<DVec3>>,
}

/// A part of such a light: a shape over the directions, and its strength in each band.
#[derive(Clone, Debug)]
pub struct InfinitePart {
    shape: InfiniteShape,
    /// Radiance per band over the shape's relative radiance, W/m2/sr.
    scale: Vec<f64>,
}

/// Relative radiance over the directions.
#[derive(Clone, Debug)]
pub enum InfiniteShape {
    /// Discs, or parallel rays; the scale is the irradiance across their direction, W/m2.
    Suns(Arc<Suns>),
    /// Cells of a sphere.
    Map(Arc<RadianceMap>),
}

/// A direction that was chosen as light may come from there.
#[derive(Clone, Copy, Debug)]
pub struct DirectionSample<L> {
    /// Towards the light, unit vector.
    pub toward: Vec3,
    /// Radiance divided by the density of the choice, W/m2.
    pub radiance_over_pdf: Spectrum<L>,
    /// Density of the choice, 1/sr; none for parallel rays, which no direction meets by chance.
    pub pdf: Option<f32>,
}

/// A part of a light as it enters through a plane face.
#[derive(Debug)]
pub struct InfiniteEntry {
    /// Irradiance of the face per band, W/m2.
    pub irradiance: Vec<f64>,
    shape: EntryShape,
}

#[derive(Debug)]
enum EntryShape {
    Suns(Arc<Suns>, SunsEntry),
    /// Per band, unless all bands are alike: integral of density x cosine over that of radiance x cosine.
    Map(Arc<RadianceMap>, MapEntry, Option<Vec<f32>>),
}

/// A photon as it enters through a face.
#[derive(Clone, Copy, Debug)]
pub struct Entering<L> {
    /// Where it goes, unit vector.
    pub direction: Vec3,
    /// Its power over the mean of all that enter, per band: 1 unless the bands of a map differ; 0 where
    /// the band brings nothing.
    pub factor: Spectrum<L>,
}

impl InfinitePart {
    /// From a shape and what its relative radiance is multiplied with in each band (at least 0).
    pub fn new(shape: InfiniteShape, scale: Vec<f64>) -> Self {
        Self { shape, scale }
    }

    /// Strength per band, as given.
    pub fn scale(&self) -> &[f64] {
        &self.scale
    }

    /// Integral of the radiance over all directions, summed over the bands, W/m2.
    fn strength(&self) -> f64 {
        let total = match &self.shape {
            InfiniteShape::Suns(suns) => suns.total(),
            InfiniteShape::Map(map) => map.total(),
        };
        total * self.scale.iter().sum::<f64>()
    }

    /// Whether it is suns: discs too small for chance, or parallel rays.
    pub fn is_sun(&self) -> bool {
        matches!(&self.shape, InfiniteShape::Suns(_))
    }

    /// Whether a plane that faces `normal` may see it.
    fn may_shine_on(&self, normal: Vec3) -> bool {
        match &self.shape {
            InfiniteShape::Suns(suns) => suns.may_shine_on(normal.as_dvec3()),
            InfiniteShape::Map(_) => true,
        }
    }

    /// Irradiance across all directions, a quarter of it, in the brightest of so many bands, W/m2.
    pub fn mean_irradiance(&self, bands: usize) -> f64 {
        let total = match &self.shape {
            InfiniteShape::Suns(suns) => suns.total(),
            InfiniteShape::Map(map) => map.total() / map.bands().unwrap_or(1) as f64,
        };
        0.25 * total * self.scale.iter().take(bands).copied().fold(0.0, f64::max)
    }

    /// Radiance, W/m2/sr, and density of [`sample`](InfiniteLight::sample)'s choice within the part, 1/sr.
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

    /// Irradiance of a plane that faces `normal`, per band, W/m2.
    pub fn irradiance(&self, normal: Vec3) -> Vec<f64> {
        let normal = normal.as_dvec3().normalize();
        match &self.shape {
            InfiniteShape::Suns(suns) => self.scaled(&[suns.irradiance(normal)]),
            InfiniteShape::Map(map) => self.scaled(&map.irradiance(normal)),
        }
    }

    /// Relative values, one for all bands or one for each, times the strength of the bands.
    fn scaled(&self, relative: &[f64]) -> Vec<f64> {
        let of = |b: usize| relative.get(b).or(relative.first()).copied().unwrap_or(0.0);
        self.scale.iter().enumerate().map(|(b, scale)| scale * of(b)).collect()
    }

    /// How it enters through a face whose outer side faces `outward`; none where nothing does.
    pub fn entry(&self, outward: Vec3) -> Option<InfiniteEntry> {
        let normal = outward.as_dvec3().normalize();
        let (irradiance, shape) = match &self.shape {
            InfiniteShape::Suns(suns) => {
                let entry = suns.entry(normal)?;
                (self.scaled(&[suns.irradiance(normal)]), EntryShape::Suns(suns.clone(), entry))
            }
            InfiniteShape::Map(map) => {
                let (entry, relative) = (map.entry(normal)?, map.irradiance(normal));
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
    /// From its parts, each with so many bands; without any it is dark, as the sun is at night.
    pub fn new(name: String, bands: usize, parts: Vec<InfinitePart>) -> Self {
        let mut sum = 0.0;
        let running = parts.iter().map(|part| {
            sum += part.strength();
            sum
        });
        let running = running.collect();
        Self { name, bands, parts, running, through: Vec::new() }
    }

    /// Refuses strengths that are not one finite number, at least 0, for each of so many bands.
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

    /// Its parts; each enters by itself.
    pub fn parts(&self) -> &[InfinitePart] {
        &self.parts
    }

    /// Whether it is dark in every band.
    pub fn is_dark(&self) -> bool {
        self.running.last().is_none_or(|&sum| sum <= 0.0)
    }

    /// Radiance that comes from a direction, W/m2/sr; that of parallel rays not included.
    pub fn radiance<L: Lanes>(&self, toward: Vec3) -> Spectrum<L> {
        self.sum(self.parts.iter().map(|part| part.look(toward).0))
    }

    /// Density with which [`sample`](Self::sample) chooses a direction, 1/sr, parallel rays not included.
    pub fn pdf(&self, toward: Vec3) -> f32 {
        let parts = self.parts.iter().enumerate();
        parts.map(|(p, part)| self.chance(p) * part.look::<[f32; 1]>(toward).1).sum::<f64>() as f32
    }

    /// Chance that a direction is chosen by part `p`.
    fn chance(&self, p: usize) -> f64 {
        let before = if p == 0 { 0.0 } else { self.running[p - 1] };
        let total = self.running[self.running.len() - 1];
        if total > 0.0 { (self.running[p] - before) / total } else { 0.0 }
    }

    /// Whether a plane that faces `normal` may see it.
    pub fn may_shine_on(&self, normal: Vec3) -> bool {
        self.parts.iter().any(|part| part.may_shine_on(normal))
    }

    /// Whether suns are part of it.
    pub fn has_sun(&self) -> bool {
        self.parts.iter().any(InfinitePart::is_sun)
    }

    /// Radiance that comes from a direction but from suns, W/m2/sr.
    pub fn radiance_without_suns<L: Lanes>(&self, toward: Vec3) -> Spectrum<L> {
        let parts = self.parts.iter().filter(|part| !part.is_sun());
        self.sum(parts.map(|part| part.look(toward).0))
    }

    /// The sum of what parts send.
    fn sum<L: Lanes>(&self, radiances: impl Iterator<Item = Spectrum<L>>) -> Spectrum<L> {
        let nothing = Spectrum::from_fn(self.bands, |_| 0.0);
        radiances.fold(nothing, |sum, radiance| sum + radiance)
    }

    /// Chooses a direction in proportion to the radiance (over all bands); none where it is dark.
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

    /// Chooses a direction towards its suns in proportion to their radiance (over all bands), and has their irradiance
    /// across it over the density of the choice, per band, W/m2; none where it has no suns.
    pub fn sample_suns<L: Lanes>(&self, rng: &mut Stream) -> Option<(Vec3, Spectrum<L>)> {
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
        Some((suns.sample(rng).0.as_vec3(), part.spectrum(|_| irradiance)))
    }

    /// Irradiance of a plane that faces `normal`, in each band, W/m2.
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
    /// A photon that enters through the face, with density in proportion to radiance x cosine.
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
