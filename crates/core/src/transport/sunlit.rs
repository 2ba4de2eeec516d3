//! Sunlit shares of captors and layers, found by shadow rays.
//!
//! The area of a captor is parted into even cells, and the sun is looked for from two independent
//! points of each. The points are spread evenly, and how often the two of a pair differ gives the
//! standard error without bias, from as many differences as there are cells on an edge of shade.

use rayon::prelude::*;

use crate::{
    math::{
        rng::{FIRST, Purpose, Streams},
        spectrum::{Lanes, with_lanes},
    },
    scene::{
        captor::{Captor, CaptorKind},
        daylight::InfiniteLight,
        world::Scene,
    },
    transport::paths::Face,
};

/// Number of cells of each captor, up to [`CAPTORS`] captors; at least [`FEW`] with more.
const CELLS: usize = 36;
const CAPTORS: usize = 5_000;
const FEW: usize = 4;
/// Number of cells of all leaves together for the shares of layers; each leaf has one at least.
const LAYER_CELLS: f64 = 65_536.0;

/// What is found at a point: whether the sun shines there, and the layer in which it counts.
#[derive(Clone, Copy, Debug)]
struct Point {
    is_sunlit: bool,
    layer: Option<usize>,
}

/// Returns the fraction of each captor's area that has a straight path to the sun, also through thin
/// panes, by one of its faces, or by the front of a sensor that counts one side; with its standard
/// error. The scene has one sun. The same seed gives the same values on any number of threads. `None`
/// if no sun is there, or if there are several.
pub fn sunlit_shares(scene: &Scene, seed: u64) -> Option<Vec<[f64; 2]>> {
    let sun = only_sun(scene)?;
    let captors = scene.captors().len();
    let cells = (CELLS * CAPTORS / captors.max(1)).clamp(FEW, CELLS);
    let share = |captor: usize| share_of(&pairs(scene, captor, sun, seed, cells));
    Some((0..captors).into_par_iter().map(share).collect())
}

/// Returns the light that is the scene's one sun; `None` if no sun is there, or several are.
fn only_sun(scene: &Scene) -> Option<&InfiniteLight> {
    let mut suns = scene.infinite_lights().filter(|(_, light)| light.suns() > 0);
    let (_, light) = suns.next().filter(|(_, light)| light.suns() == 1)?;
    suns.next().is_none().then_some(light)
}

/// Returns the share of points in the sun with its standard error: a pair that differs adds a quarter
/// of a cell's square to the variance. Where none does, one more might, as one more history may
/// [miss](crate::math::stats::Estimate::with_misses).
fn share_of(pairs: &[[Point; 2]]) -> [f64; 2] {
    let points = 2.0 * pairs.len() as f64;
    let sunlit = pairs.iter().flatten().filter(|point| point.is_sunlit).count();
    let differ = pairs.iter().filter(|[a, b]| a.is_sunlit != b.is_sunlit).count();
    [sunlit as f64 / points, (differ.max(1) as f64).sqrt() / points]
}

/// Looks for the sun from two points in each of about so many cells of a captor.
fn pairs(
    scene: &Scene,
    captor: usize,
    sun: &InfiniteLight,
    seed: u64,
    cells: usize,
) -> Vec<[Point; 2]> {
    let columns = cells.isqrt();
    with_lanes!(scene.lanes(), L => in_cells::<L>(scene, captor, sun, seed, [columns, cells / columns]))
}

fn in_cells<L: Lanes>(
    scene: &Scene,
    captor: usize,
    sun: &InfiniteLight,
    seed: u64,
    [columns, rows]: [usize; 2],
) -> Vec<[Point; 2]> {
    let faces = scene.captors()[captor].kind.faces();
    let faces: Vec<_> = faces.iter().map(|&face| Face::new(scene, captor, face)).collect();
    let streams = Streams::new(seed, Purpose::DirectSun, captor as u64);
    let look = |column: usize, row: usize, which: usize| {
        let mut rng = streams.history(((row * columns + column) * 2 + which) as u64);
        let mut numbers: [f32; FIRST] = std::array::from_fn(|_| rng.uniform());
        for (number, cell, cells) in [(0, column, columns), (1, row, rows)] {
            // rounded, the last number of the last cell could be 1
            let within = (cell as f32 + numbers[number]) / cells as f32;
            numbers[number] = within.min(1.0_f32.next_down());
        }
        rng.with_first(numbers);
        let Some(beam) = faces[0].sunbeam::<L>(sun, &mut rng) else {
            return Point { is_sunlit: false, layer: None };
        };
        let is_sunlit = faces.iter().any(|face| face.is_lit(&beam));
        Point { is_sunlit, layer: faces[0].layer_of(&beam) }
    };
    let cells = (0..rows).flat_map(|row| (0..columns).map(move |column| (column, row)));
    cells.map(|(column, row)| [0, 1].map(|which| look(column, row, which))).collect()
}

/// Returns the fraction of the leaves of each layer, by area, that has a straight path to the sun,
/// also through thin panes, by either face; with its standard error. The points are spread evenly over
/// all leaves of the scene, which has one sun. The same seed gives the same values on any number of
/// threads. `None` for a layer in which no point lies; for the whole if the scene has no layers or not
/// one sun.
pub fn sunlit_layers(scene: &Scene, seed: u64) -> Option<Vec<Option<[f64; 2]>>> {
    let mut layers = vec![InLayer::default(); scene.stand().layers.as_ref()?.areas.len()];
    let sun = only_sun(scene)?;
    let is_leaf = |captor: &Captor| {
        captor.kind == CaptorKind::Surface && !scene.is_ground(captor.triangles.start)
    };
    let leaves: Vec<_> = scene.captors().iter().enumerate().filter(|(_, c)| is_leaf(c)).collect();
    let all: f64 = leaves.iter().map(|(_, captor)| captor.area).sum();
    let of_leaf = |&(index, captor): &(usize, &Captor)| {
        let cells = ((LAYER_CELLS * captor.area / all) as usize).max(1);
        let pairs = pairs(scene, index, sun, seed, cells);
        (captor.area / (2.0 * pairs.len() as f64), pairs)
    };
    let found: Vec<_> = leaves.par_iter().map(of_leaf).collect();
    for (area, pairs) in found {
        for pair in pairs {
            for (which, point) in pair.into_iter().enumerate() {
                let Some(layer) = point.layer else { continue };
                let other = Some(pair[1 - which]).filter(|other| other.layer == Some(layer));
                layers[layer].add(area, point.is_sunlit, other.map(|other| other.is_sunlit));
            }
        }
    }
    Some(layers.iter().map(InLayer::share).collect())
}

/// Sums over the points of a layer, each of which stands for some area.
#[derive(Clone, Copy, Debug, Default)]
struct InLayer {
    points: f64,
    area: f64,
    sunlit: f64,
    /// Squares of the areas of pairs of which one point is in the sun and both are in the layer.
    differ: f64,
    /// Squares of the areas of points whose pair lies elsewhere, in the shade and in the sun.
    alone: [f64; 2],
}

impl InLayer {
    /// Adds a point; `other` says whether the other one of its pair is in the sun, if it lies in the
    /// layer too.
    fn add(&mut self, area: f64, is_sunlit: bool, other: Option<bool>) {
        self.points += 1.0;
        self.area += area;
        self.sunlit += if is_sunlit { area } else { 0.0 };
        match other {
            // each point of the pair adds one half
            Some(other) if other != is_sunlit => self.differ += area * area / 2.0,
            Some(_) => {}
            None => self.alone[usize::from(is_sunlit)] += area * area,
        }
    }

    /// Returns the share that is in the sun, with its standard error. How much of the area lies in the
    /// layer depends on chance as well, so that points count by how far they are from the share.
    fn share(&self) -> Option<[f64; 2]> {
        let share = self.sunlit / self.area;
        let [shaded, sunlit] = self.alone;
        let variance = self.differ + shaded * share.powi(2) + sunlit * (1.0 - share).powi(2);
        let error = (variance.sqrt() / self.area).max(1.0 / self.points);
        (self.points > 0.0).then_some([share, error])
    }
}
