//! Importons: they start at the captors and follow the ways of light backwards, so that they arrive
//! where light matters to the captors.

use std::{
    f32::consts::PI,
    sync::atomic::{AtomicBool, Ordering},
};

use rayon::prelude::*;

use super::Cells;
use crate::{
    math::{
        geometry::{Frame, ROUNDING, Ray, across},
        rng::{Purpose, Stream, Streams},
        sampling::cosine_hemisphere,
        spectrum::{Lanes, Spectrum, with_lanes},
    },
    scene::{
        captor::Channel,
        material::{BsdfSample, Scatterer, Transport},
        world::{Outline, Scene},
    },
    transport::trace::roulette,
};

/// Importons are traced in blocks of this many.
const BLOCK: u64 = 512;
/// A block ends early once its importons have taken this many flights each, on average.
const FLIGHTS: u64 = 40;
/// Importons are split where few arrive and ended where many do, but not where their number is
/// within this factor of the usual one.
const BAND: f32 = 5.0;
/// The most importons into which one is split at a place.
const MOST_COPIES: f32 = 30.0;

/// The faces of all captors, from which importons start.
pub struct Sources<'a> {
    scene: &'a Scene,
    faces: Vec<Source<'a>>,
}

struct Source<'a> {
    outline: Outline<'a>,
    /// How far the captor is lifted above the surface that it lies in, m.
    lift: f32,
    face: Channel,
    /// Weight of an importon that starts from the face, per band.
    weights: Vec<f32>,
}

impl<'a> Sources<'a> {
    /// Takes the faces of a scene's captors. `expected` holds the light on each face per band, in
    /// any unit, above 0.
    pub fn new(scene: &'a Scene, expected: &[Vec<f64>]) -> Self {
        let mut expected = expected.iter();
        let mut faces: Vec<Source> = Vec::new();
        for (c, captor) in scene.captors().iter().enumerate() {
            for &face in captor.kind.faces() {
                let outline = scene.outline(captor);
                let light = expected.next().into_iter().flatten();
                let weights = light.map(|light| (1.0 / light) as f32).collect();
                let lift = scene.lift(c);
                faces.push(Source { outline, lift, face, weights });
            }
        }
        // a face emits importons of pi / light in all, and starts one in `faces.len()` of them
        let share = PI * faces.len() as f32;
        faces.iter_mut().flat_map(|face| &mut face.weights).for_each(|weight| *weight *= share);
        Self { scene, faces }
    }
}

impl Source<'_> {
    fn start(&self, rng: &mut Stream) -> Ray {
        let (shape, at) = self.outline.choose(rng);
        let shape = self.outline.shape(shape);
        let point = shape.point(at);
        let front = shape.normal_at(point);
        let normal = if self.face == Channel::Back { -front } else { front };
        let direction = Frame::new(normal).to_world(cosine_hemisphere(rng.square()));
        let lift = self.lift + ROUNDING * across(front, point);
        Ray { origin: point + lift * normal, direction }
    }
}

/// Traces this number of importons of a `round`. Returns the importance that arrives at each place
/// of `cells` per area. Where few importons arrived in the round `before`, they are split (as in
/// weight windows from the flux itself, MAGIC: Davis and Turner, Fusion Engineering and Design 86,
/// 2011), so that some pass several openings. Once `stop` is set, no more are traced.
pub fn learn(
    sources: &Sources,
    cells: &Cells,
    seed: u64,
    (round, importons): (u64, u64),
    before: Option<&[f32]>,
    stop: &AtomicBool,
) -> Vec<f32> {
    let scene = sources.scene;
    let streams = Streams::new(seed, Purpose::Importons, round);
    let usual = before.map(|density| (density, usual(sources, cells, density, streams)));
    let one = 1.0 / importons as f32;
    let trace = |block: u64| match stop.load(Ordering::Relaxed) {
        true => Vec::new(),
        false => {
            with_lanes!(scene.lanes(), L => trace_block::<L>(sources, cells, streams, (block, one), usual))
        }
    };
    // in the order of the blocks, whichever thread is first
    let blocks: Vec<Vec<(u32, f32)>> =
        (0..importons.div_ceil(BLOCK)).into_par_iter().map(trace).collect();
    cells.densities(blocks.into_iter().flatten().map(|(place, value)| (place, value.into())))
}

/// Returns the mean of the density at the places to which importons come first.
fn usual(sources: &Sources, cells: &Cells, density: &[f32], streams: Streams) -> f32 {
    let first = |index: u64| {
        let mut rng = streams.history(u64::MAX - index);
        let source = &sources.faces[(index % sources.faces.len() as u64) as usize];
        let ray = source.start(&mut rng);
        let hit = sources.scene.closest(&ray)?;
        let front = ray.direction.dot(sources.scene.surface(hit.triangle).normal) < 0.0;
        Some(density[cells.at(&hit, front)])
    };
    let found: Vec<f32> = (0..4096).filter_map(first).collect();
    found.iter().sum::<f32>() / found.len().max(1) as f32
}

/// Traces the importons of a block, each of which counts the fraction `one` of the total. Returns
/// the places where they arrive, and what they bring.
fn trace_block<L: Lanes>(
    sources: &Sources,
    cells: &Cells,
    streams: Streams,
    (block, one): (u64, f32),
    usual: Option<(&[f32], f32)>,
) -> Vec<(u32, f32)> {
    let mut walk =
        Walk { scene: sources.scene, cells, usual, waiting: Vec::new(), found: Vec::new() };
    let (mut flights, mut done) = (0, 0);
    while done < BLOCK && flights < BLOCK * FLIGHTS {
        let index = block * BLOCK + done;
        let mut rng = streams.history(index);
        let source = &sources.faces[(index % sources.faces.len() as u64) as usize];
        let lanes = sources.scene.lanes();
        let weight = |b: usize| source.weights.get(b).copied().unwrap_or(0.0);
        let carried = Spectrum::<L>::from_fn(lanes, weight);
        let first = sum(&carried);
        walk.waiting.push((source.start(&mut rng), carried));
        flights += walk.go(first, 50 * FLIGHTS, &mut rng);
        done += 1;
    }
    let scale = one * BLOCK as f32 / done.max(1) as f32;
    walk.found.iter_mut().for_each(|(_, value)| *value *= scale);
    walk.found
}

/// An importon and its copies, which are followed one after the other.
struct Walk<'a, 's, L> {
    scene: &'a Scene,
    cells: &'a Cells<'s>,
    /// The density of the round before, and its mean at the places to which importons come first.
    usual: Option<(&'a [f32], f32)>,
    waiting: Vec<(Ray, Spectrum<L>)>,
    found: Vec<(u32, f32)>,
}

impl<L: Lanes> Walk<'_, '_, L> {
    /// Follows all flights in `waiting`, which started with the weight `first`, for at most `most`
    /// flights. Returns the number of flights.
    fn go(&mut self, first: f32, most: u64, rng: &mut Stream) -> u64 {
        let mut flights = 0;
        while let Some((mut ray, mut carried)) = self.waiting.pop() {
            while let Some((next, onward)) = self.step(&ray, carried, first, rng) {
                flights += 1;
                (ray, carried) = (next, onward);
                if flights >= most {
                    self.waiting.clear();
                    return flights;
                }
            }
            flights += 1;
        }
        flights
    }

    fn step(
        &mut self,
        ray: &Ray,
        carried: Spectrum<L>,
        first: f32,
        rng: &mut Stream,
    ) -> Option<(Ray, Spectrum<L>)> {
        let scene = self.scene;
        let at = scene.arrive(ray)?;
        let mut copies = 1.0;
        if at.material.is_diffuse() {
            let place = self.cells.at(&at.hit, at.interaction.front);
            let weight = sum(&carried);
            self.found.push((place as u32, weight));
            if let Some((density, usual)) = self.usual {
                let wanted = weight / first * usual / density[place].max(1e-6 * usual);
                if !(1.0 / BAND..BAND).contains(&wanted) {
                    copies = wanted.clamp(1.0 / MOST_COPIES, MOST_COPIES);
                }
            }
        }
        let number = match copies {
            1.0 => 1,
            _ => (copies + rng.uniform()) as u32,
        };
        let mut onward = || {
            let BsdfSample { direction, weight, lobe } =
                at.material.sample::<L>(&at.interaction, Transport::Importance, rng)?;
            let survival = weight.largest_within(&carried);
            let scattered = roulette(weight * &carried, survival, rng)?.scaled(1.0 / copies);
            Some((at.leave(lobe, direction), scattered))
        };
        self.waiting.extend((1..number).filter_map(|_| onward()));
        if number > 0 { onward() } else { None }
    }
}

fn sum<L: Lanes>(carried: &Spectrum<L>) -> f32 {
    carried.values().iter().sum()
}
