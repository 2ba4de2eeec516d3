//! From triangles to a tree with two children a node: cut from the top down, then mended.

use glam::UVec3;
use obvhs::aabb::Aabb;
use obvhs::bvh2::{Bvh2, node::Bvh2Node, reinsertion::ReinsertionOptimizer};
use rayon::prelude::*;

use super::wide::Branch;
use crate::math::geometry::{Extent, Triangle};

/// A triangle and the box around it.
struct Boxed {
    extent: Extent,
    index: u32,
}

/// The tree of the triangles with these indices, at least one.
pub(super) fn binary_tree(triangles: &[Triangle], indices: &[u32]) -> Vec<Branch> {
    let boxed =
        |&index: &u32| Boxed { extent: Extent::of_triangles([&triangles[index as usize]]), index };
    let mut all: Vec<Boxed> = indices.par_iter().map(boxed).collect();
    let mut tree = Bvh2 { nodes: cut(&mut all), ..Bvh2::default() };
    mend(&mut tree);
    let branch = |node: &Bvh2Node| match node.first_index {
        index if node.is_leaf() => Branch::Triangle(index),
        first => Branch::Fork([first as usize, first as usize + 1]),
    };
    tree.nodes.iter().map(branch).collect()
}

/// The nodes of a tree with a triangle in each leaf, level by level.
fn cut(all: &mut [Boxed]) -> Vec<Bvh2Node> {
    let mut nodes = Vec::with_capacity(2 * all.len());
    let mut level = vec![all];
    while !level.is_empty() {
        let parts: Vec<_> = level.into_par_iter().map(cut_in_two).collect();
        let next = nodes.len() + parts.len();
        level = Vec::new();
        for [one, other] in parts {
            nodes.push(match one {
                [Boxed { extent: Extent { min, max }, index }] if other.is_empty() => {
                    Bvh2Node::new(Aabb::new((*min).into(), (*max).into()), 1, *index)
                }
                _ => {
                    let first = next + level.len();
                    level.extend([one, other]);
                    Bvh2Node::new(Aabb::empty(), 0, first as u32)
                }
            });
        }
    }
    for i in (0..nodes.len()).rev() {
        let first = nodes[i].first_index as usize;
        if !nodes[i].is_leaf() {
            nodes[i].aabb = nodes[first].aabb.union(&nodes[first + 1].aabb);
        }
    }
    nodes
}

/// Bins along an axis, at most.
const BINS: usize = 32;

/// Bounds and number of the triangles whose middles lie in a bin, or in several bins.
#[derive(Clone, Copy)]
struct Bin {
    extent: Extent,
    count: usize,
}

impl Bin {
    const EMPTY: Self = Self { extent: Extent::EMPTY, count: 0 };

    fn join(self, other: Self) -> Self {
        Self { extent: self.extent.join(other.extent), count: self.count + other.count }
    }

    /// How often a random ray meets it times the triangles to be tested then. Counted by fours, as a leaf
    /// takes several at once. A part must not be empty.
    fn cost(&self) -> f32 {
        match self.count {
            0 => f32::INFINITY,
            count => self.extent.half_area() * count.div_ceil(4) as f32,
        }
    }
}

/// Cuts a part in two, across the axis and at the place that make the halves cheapest, of those between bins:
/// the surface area heuristic (Wald, "On fast Construction of SAH-based Bounding Volume
/// Hierarchies", Symposium on Interactive Ray Tracing, 2007). A single triangle comes back with
/// nothing beside it.
fn cut_in_two(part: &mut [Boxed]) -> [&mut [Boxed]; 2] {
    let middle = if part.len() <= 2 { 1 } else { best_middle(part) };
    let (one, other) = part.split_at_mut(middle);
    [one, other]
}

/// Brings one half of a part before the other; where that starts.
fn best_middle(part: &mut [Boxed]) -> usize {
    let bins = BINS.min(2 * part.len());
    let centers = Extent::of(part.iter().map(|boxed| boxed.extent.center()));
    let scale = bins as f32 / centers.size();
    // all in bin 0 along an axis on which they are in line, as 0 times infinity is no number
    let place = |boxed: &Boxed| {
        let place = (boxed.extent.center() - centers.min) * scale;
        place.as_uvec3().min(UVec3::splat(bins as u32 - 1))
    };
    let mut table = [[Bin::EMPTY; BINS]; 3];
    for boxed in part.iter() {
        for (bins, place) in table.iter_mut().zip(place(boxed).to_array()) {
            let bin = &mut bins[place as usize];
            *bin = bin.join(Bin { extent: boxed.extent, count: 1 });
        }
    }
    let mut best = (f32::INFINITY, 0, 0);
    for (axis, table) in table.iter().enumerate() {
        let (cost, cut) = best_cut(&table[..bins]);
        if cost < best.0 {
            best = (cost, axis, cut);
        }
    }
    match best {
        // all at one place
        (f32::INFINITY, ..) => part.len() / 2,
        (_, axis, cut) => partition(part, |boxed| (place(boxed)[axis] as usize) < cut),
    }
}

/// What the halves cost at the best cut through a row of bins, and the bin above the cut.
fn best_cut(bins: &[Bin]) -> (f32, usize) {
    let mut above = [0.0; BINS];
    let mut sum = Bin::EMPTY;
    for (cut, &bin) in bins.iter().enumerate().rev() {
        sum = sum.join(bin);
        above[cut] = sum.cost();
    }
    let mut best = (f32::INFINITY, 0);
    let mut sum = Bin::EMPTY;
    for (below, &bin) in bins[..bins.len() - 1].iter().enumerate() {
        sum = sum.join(bin);
        let cost = sum.cost() + above[below + 1];
        if cost < best.0 {
            best = (cost, below + 1);
        }
    }
    best
}

/// Brings those that are `low` before the others; how many they are.
fn partition(part: &mut [Boxed], low: impl Fn(&Boxed) -> bool) -> usize {
    let (mut start, mut end) = (0, part.len());
    while start < end {
        if low(&part[start]) {
            start += 1;
        } else {
            end -= 1;
            part.swap(start, end);
        }
    }
    start
}

/// Visits from which on triangles are a heap: reinsertion looks through all that overlap, for each of
/// them (a minute for 100,000 discs at one place), and finds nothing better. Rooms and plants have
/// tens to hundreds.
const HEAP: f32 = 5000.0;

/// Nodes that are put to better places, at most, of those near the root. More would take long in a canopy and
/// gain nothing there.
const MENDED: f32 = 20_000.0;

/// Moves nodes that make boxes large (Meister and Bittner, "Parallel Reinsertion for Bounding Volume
/// Hierarchy Optimization", Computer Graphics Forum 37 (2), 2018), unless the triangles lie in a heap.
fn mend(tree: &mut Bvh2) {
    if expected_visits(tree) < HEAP {
        let ratio = (MENDED / tree.nodes.len() as f32).min(1.0);
        ReinsertionOptimizer::default().run(tree, ratio, None);
    }
}

/// How many nodes a random ray through the tree meets: their areas over the area of the root.
fn expected_visits(tree: &Bvh2) -> f32 {
    let root = tree.nodes[0].aabb.half_area();
    tree.nodes.iter().map(|node| node.aabb.half_area() / root).sum()
}
