//! Reflectors: surfaces with a glossy lobe that lamps shine on. From a leaf the patch that a lamp makes in its
//! reflector is small and bright, and chance seldom takes a path there: so some are aimed.

use std::{
    collections::{BTreeMap, HashMap},
    ops::Range,
};

use glam::{Vec2, Vec3};

use super::vertex::Vertex;
use crate::{
    math::{
        rng::{Purpose, Stream, Streams},
        sampling::{Chosen, uniform_triangle, weighted_choice},
    },
    scene::{light::Light, world::Scene},
};

/// Photons of each light that tell what it shines on, and the most of all lights.
const PHOTONS: u64 = 4096;
const MOST_PHOTONS: u64 = 1 << 20;
/// Directions that are aimed, for each photon that is so reflected.
const SHARE: f32 = 0.5;

/// What lamps shine on and that reflects glossily.
pub struct Reflectors {
    /// Share of the directions that are aimed there, in [0, 1).
    pub share: f32,
    /// For each light.
    lit: Vec<Lit>,
    /// For each triangle the lights that shine on it, and the chance of its points, 1/m2.
    chances: HashMap<usize, Vec<(usize, f32)>>,
}

/// The triangles that a light shines on, and the running sums of what they reflect.
#[derive(Default)]
struct Lit {
    triangles: Vec<usize>,
    sums: Vec<f64>,
}

impl Reflectors {
    /// Finds them by photons that go no further than their first surface; none where none shines.
    pub fn find(scene: &Scene, seed: u64) -> Option<Self> {
        if !scene.materials.iter().any(|named| named.material.glossy() > 0.0) {
            return None;
        }
        let photons = PHOTONS.min((MOST_PHOTONS / scene.lights.len() as u64).max(1));
        let mut reflectors = Self { share: 0.0, lit: Vec::new(), chances: HashMap::new() };
        let (mut reflected, mut all) = (0.0, 0.0);
        for (l, light) in scene.lights.iter().enumerate() {
            let found = shone_on(scene, light, l as u64 * photons..(l as u64 + 1) * photons, seed);
            let total: f64 = found.values().sum();
            let mut lit = Lit::default();
            let mut sum = 0.0;
            for (triangle, reflected) in found {
                sum += reflected;
                lit.triangles.push(triangle);
                lit.sums.push(sum);
                let chance = (reflected / total) as f32 / scene.triangles()[triangle].area();
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

    /// A point that `u` and `rng` choose, and its triangle: first a light, as for next-event
    /// estimation, then what it shines on.
    pub(super) fn choose(
        &self,
        scene: &Scene,
        at: &Vertex,
        u: f32,
        rng: &mut Stream,
    ) -> Option<(usize, Vec3)> {
        let (light, _) = at.choice.choose(&scene.lights, || u)?;
        let lit = &self.lit[light];
        if lit.triangles.is_empty() {
            return None;
        }
        let Chosen { index, rest } = weighted_choice(&lit.sums, rng.uniform_fine());
        let weights = uniform_triangle(Vec2::new(rest, rng.uniform()));
        let triangle = lit.triangles[index];
        Some((triangle, scene.triangles()[triangle].point(weights.x, weights.y)))
    }

    /// Density with which a point of `triangle` is chosen at `at`, 1/m2, among all directions.
    pub(super) fn density(&self, scene: &Scene, at: &Vertex, triangle: usize) -> f32 {
        let Some(chances) = self.chances.get(&triangle) else { return 0.0 };
        let own = |light: usize| self.share * at.choice.chance(&scene.lights, light);
        chances.iter().map(|&(light, chance)| own(light) * chance).sum()
    }
}

/// The triangles with a glossy lobe that a light's photons meet first, and what they reflect.
fn shone_on(scene: &Scene, light: &Light, photons: Range<u64>, seed: u64) -> BTreeMap<usize, f64> {
    let mut found = BTreeMap::new();
    let streams = Streams::new(seed, Purpose::Reflectors, 0);
    for photon in photons {
        let mut rng = streams.history(photon);
        let ray = light.emit(scene.ray_offset(), &mut rng);
        let Some(hit) = scene.closest(&ray) else { continue };
        let glossy = scene.material(scene.surface(hit.triangle)).glossy();
        if glossy > 0.0 {
            *found.entry(hit.triangle).or_default() += f64::from(glossy);
        }
    }
    found
}
