//! Reflectors: surfaces with a glossy lobe on which lamps shine. The patch of light that a lamp
//! makes in its reflector is small and bright as seen from a leaf, and random directions seldom
//! meet it. Some directions of paths are therefore aimed at reflectors.

use std::{
    collections::{BTreeMap, HashMap},
    ops::Range,
};

use glam::{Vec2, Vec3};

use super::{
    choice::{LightChoice, Place, ROUGH},
    vertex::Vertex,
};
use crate::{
    math::{
        rng::{Purpose, Stream, Streams},
        sampling::{Chosen, uniform_triangle, weighted_choice},
    },
    scene::{light::Light, material::Scatterer, world::Scene},
};

/// Number of photons of each light, which find the triangles that it shines on, and the largest
/// number for all lights together.
const PHOTONS: u64 = 4096;
const MOST_PHOTONS: u64 = 1 << 20;
/// Fraction of the directions that are aimed, divided by the fraction of the light that reflectors
/// reflect.
const SHARE: f32 = 0.5;

/// The triangles that reflect the light of lamps glossily.
pub struct Reflectors {
    /// Fraction of the directions that are aimed at reflectors, in [0, 1).
    pub share: f32,
    /// For each light, the triangles that it shines on.
    lit: Vec<Lit>,
    /// For each triangle, the lights that shine on it and the chance density of its points for
    /// each, 1/m2.
    chances: HashMap<usize, Vec<(usize, f32)>>,
}

/// The triangles that a light shines on, and the running sums of what they reflect.
#[derive(Default)]
struct Lit {
    triangles: Vec<usize>,
    sums: Vec<f64>,
}

impl Reflectors {
    /// Finds the reflectors, by photons that are followed to their first surface. `None` if no
    /// light shines on a glossy surface.
    pub fn find(scene: &Scene, seed: u64) -> Option<Self> {
        if !scene.materials().iter().any(|named| named.material.glossy() > 0.0) {
            return None;
        }
        let photons = PHOTONS.min((MOST_PHOTONS / scene.lights().len() as u64).max(1));
        let mut reflectors = Self { share: 0.0, lit: Vec::new(), chances: HashMap::new() };
        let (mut reflected, mut all) = (0.0, 0.0);
        for (l, light) in scene.lights().iter().enumerate() {
            let found = shone_on(scene, light, l as u64 * photons..(l as u64 + 1) * photons, seed);
            let total: f64 = found.values().sum();
            let mut lit = Lit::default();
            let mut sum = 0.0;
            for (triangle, reflected) in found {
                sum += reflected;
                lit.triangles.push(triangle);
                lit.sums.push(sum);
                let chance = (reflected / total) as f32 / scene.triangles().at(triangle).area();
                reflectors.chances.entry(triangle).or_default().push((l, chance));
            }
            let power = light.power.iter().copied().fold(0.0, f64::max);
            reflected += power * total;
            all += power * photons as f64;
            reflectors.lit.push(lit);
        }
        reflectors.share = SHARE * (reflected / all) as f32;
        (reflected > 0.0).then_some(reflectors)
    }

    /// Chooses a point of a reflector, and returns the index of its triangle and the point. First a
    /// light is chosen by `u` in [0, 1), as for next-event estimation, then a triangle that it
    /// shines on, with `rng`. `None` if the light shines on none.
    pub(super) fn choose(
        &self,
        scene: &Scene,
        at: &Vertex,
        u: f32,
        rng: &mut Stream,
    ) -> Option<(usize, Vec3)> {
        let (light, _) = at.choose(scene, Some(u), rng)?;
        let lit = &self.lit[light];
        if lit.triangles.is_empty() {
            return None;
        }
        let Chosen { index, rest } = weighted_choice(&lit.sums, rng.uniform_fine());
        let weights = uniform_triangle(Vec2::new(rest, rng.uniform()));
        let triangle = lit.triangles[index];
        Some((triangle, scene.triangles().at(triangle).point(weights.x, weights.y)))
    }

    /// Returns the density with which a point of `triangle` is chosen at `at`, 1/m2, as part of the
    /// choice among all directions, free and aimed.
    pub(super) fn density(&self, scene: &Scene, at: &Vertex, triangle: usize) -> f32 {
        let Some(chances) = self.chances.get(&triangle) else { return 0.0 };
        let own = |light: usize| self.share * at.chance(scene, light);
        chances.iter().map(|&(light, chance)| own(light) * chance).sum()
    }

    /// Estimates that density at a point that is on no surface, in a time that does not grow with
    /// the number of lights.
    pub(super) fn rough_density(&self, scene: &Scene, point: Vec3, triangle: usize) -> f32 {
        let Some(chances) = self.chances.get(&triangle) else { return 0.0 };
        let at = Place { point, one_sided: None };
        let choice = LightChoice::roughly(scene, at);
        let own = |light: usize| self.share * choice.chance(scene, at, light);
        let step = chances.len().div_ceil(ROUGH).max(1);
        let some = chances.iter().step_by(step).map(|&(light, chance)| own(light) * chance);
        step as f32 * some.sum::<f32>()
    }
}

/// Returns the triangles with a glossy lobe that a light's photons meet first, with the sum of what
/// they reflect.
fn shone_on(scene: &Scene, light: &Light, photons: Range<u64>, seed: u64) -> BTreeMap<usize, f64> {
    let mut found = BTreeMap::new();
    let streams = Streams::new(seed, Purpose::Reflectors, 0);
    for photon in photons {
        let mut rng = streams.history(photon);
        let ray = light.emit(&mut rng);
        let Some(hit) = scene.closest(&ray) else { continue };
        let glossy = scene.material(&scene.surface(hit.triangle)).glossy();
        if glossy > 0.0 {
            *found.entry(hit.triangle).or_default() += f64::from(glossy);
        }
    }
    found
}
