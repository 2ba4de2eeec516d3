//! Guided emission: lamps emit more photons where, and in the directions in which, they matter to
//! the captors.
//!
//! The first random numbers of a history decide what a lamp emits: they are the coordinates of a
//! point in a cube. The cube is halved, over and over, where importance differs between its parts.
//! A part is chosen in proportion to the importance of its photons where they first come to a
//! diffuse surface. A photon counts one over the density of the choice, which is nowhere below a
//! fifth of the density without guiding.

use crate::{
    math::{
        rng::{FIRST, Stream},
        spectrum::Lanes,
    },
    scene::{
        light::{Emission, Strata},
        world::Scene,
    },
};

/// The share of the photons that are emitted as though nothing guided them.
const FREE: f64 = 0.2;
/// A side of a box is cut into this many parts, whose importance tells whether the box is worth
/// halving.
const BINS: usize = 8;
/// A box is halved where its parts differ by more than this many times what chance alone explains.
const CLEAR: f64 = 4.0;
/// The depth of the tree: a box is the result of at most this many halvings.
const DEEPEST: u32 = 48;

/// How the lamps of a scene emit.
#[derive(Clone, Debug)]
pub struct Lamps {
    /// Share of the photons for each [stratum](Strata), where it is not that of its power.
    pub shares: Option<Vec<f64>>,
    /// The tree of each stratum.
    pub trees: Vec<Option<EmissionTree>>,
}

impl Lamps {
    /// Returns the most that a photon of the stratum `source` can count, in photons that are not
    /// guided.
    pub fn most(&self, source: usize) -> f64 {
        self.trees[source].as_ref().map_or(1.0, EmissionTree::most)
    }

    /// Emits history `index` of some strata. Returns the photon, with its full power, and the
    /// density with which it was chosen, relative to the density without guiding.
    pub fn emit<'s, L: Lanes>(
        &self,
        scene: &Scene,
        strata: &'s Strata,
        index: u64,
        rng: &mut Stream,
    ) -> (Emission<'s, L>, f32) {
        match &self.trees[strata.source(index)] {
            None => (scene.emit(strata, index, rng), 1.0),
            Some(tree) => {
                let (numbers, density) = tree.choose(rng);
                (emit_at(scene, strata, index, numbers, rng), density)
            }
        }
    }
}

/// Emits history `index` at a point of the cube.
pub fn emit_at<'s, L: Lanes>(
    scene: &Scene,
    strata: &'s Strata,
    index: u64,
    numbers: [f32; FIRST],
    rng: &mut Stream,
) -> Emission<'s, L> {
    rng.with_first(numbers);
    let emission = scene.emit(strata, index, rng);
    rng.without_first();
    emission
}

/// A point of the cube, and the importance of its photon over the density with which the point was
/// chosen.
#[derive(Clone, Copy, Debug)]
pub struct Sample {
    /// The coordinates of the point, each in [0, 1).
    pub numbers: [f32; FIRST],
    /// The importance over the density, in any unit, not negative.
    pub value: f64,
}

/// Boxes that fill the cube, and the chances to choose them.
#[derive(Clone, Debug)]
pub struct EmissionTree {
    boxes: Vec<Part>,
    /// Running sums of the chances of the boxes.
    chances: Vec<f64>,
}

/// A box of random numbers: a part of the cube.
#[derive(Clone, Copy, Debug)]
struct Part {
    low: [f32; FIRST],
    sides: [f32; FIRST],
    /// The density with which a point in it is chosen: the chance of the box over its volume.
    density: f32,
}

impl EmissionTree {
    /// Builds the tree from points with their importance. `None` if importance does not differ
    /// clearly between parts of the cube.
    pub fn new(mut samples: Vec<Sample>) -> Option<Self> {
        samples.retain(|sample| sample.value > 0.0);
        let all: f64 = samples.iter().map(|sample| sample.value).sum();
        let mut tree = Self { boxes: Vec::new(), chances: Vec::new() };
        let whole = Part { low: [0.0; FIRST], sides: [1.0; FIRST], density: 1.0 };
        tree.cut(whole, &mut samples, all, 0);
        (tree.boxes.len() > 1).then_some(tree)
    }

    fn cut(&mut self, part: Part, samples: &mut [Sample], all: f64, depth: u32) {
        if let Some(axis) = differs(&part, samples).filter(|_| depth < DEEPEST) {
            let mut halves = [part; 2];
            halves.iter_mut().for_each(|half| half.sides[axis] *= 0.5);
            halves[1].low[axis] += halves[1].sides[axis];
            let middle = halves[1].low[axis];
            samples.sort_unstable_by(|a, b| a.numbers[axis].total_cmp(&b.numbers[axis]));
            let first = samples.partition_point(|sample| sample.numbers[axis] < middle);
            let (low, high) = samples.split_at_mut(first);
            self.cut(halves[0], low, all, depth + 1);
            return self.cut(halves[1], high, all, depth + 1);
        }
        let volume: f64 = part.sides.iter().map(|side| f64::from(*side)).product();
        let own: f64 = samples.iter().map(|sample| sample.value).sum();
        let chance = (1.0 - FREE) * own / all + FREE * volume;
        let before = self.chances.last().copied().unwrap_or(0.0);
        self.chances.push(before + chance);
        self.boxes.push(Part { density: (chance / volume) as f32, ..part });
    }

    /// Returns one over the smallest density with which a point is drawn.
    fn most(&self) -> f64 {
        let densities = self.boxes.iter().map(|part| part.density);
        f64::from(densities.fold(f32::INFINITY, f32::min)).recip()
    }

    /// Draws a point, and returns with it the density with which it is drawn.
    pub fn choose(&self, rng: &mut Stream) -> ([f32; FIRST], f32) {
        let last = self.chances.last().copied().unwrap_or(1.0);
        let u = rng.uniform_fine() * last;
        let index = self.chances.partition_point(|sum| *sum <= u).min(self.boxes.len() - 1);
        let Part { low, sides, density } = self.boxes[index];
        let inside = |i: usize| (low[i] + sides[i] * rng.uniform()).min(1.0 - f32::EPSILON);
        (std::array::from_fn(inside), density)
    }
}

/// Returns the axis along which importance is spread least evenly over a box, if the difference is
/// larger than chance explains.
fn differs(part: &Part, samples: &[Sample]) -> Option<usize> {
    let noise: f64 = samples.iter().map(|sample| sample.value * sample.value).sum();
    let all: f64 = samples.iter().map(|sample| sample.value).sum();
    let unevenness = |axis: usize| {
        let mut bins = [0.0; BINS];
        for sample in samples {
            let share = (sample.numbers[axis] - part.low[axis]) / part.sides[axis];
            bins[((share * BINS as f32) as usize).min(BINS - 1)] += sample.value;
        }
        let even = all / BINS as f64;
        bins.iter().map(|sum| (sum - even).powi(2)).sum::<f64>()
    };
    // random numbers have 24 bits, so a narrower box is not halved
    let wide = |axis: &usize| part.sides[*axis] > 1e-6;
    let (axis, most) = (0..FIRST)
        .filter(wide)
        .map(|axis| (axis, unevenness(axis)))
        .max_by(|a, b| a.1.total_cmp(&b.1))?;
    // for independent samples that are spread evenly, the unevenness is about the noise
    let flat = most < 0.05 * all * all / BINS as f64;
    (most > CLEAR * noise && !flat).then_some(axis)
}
