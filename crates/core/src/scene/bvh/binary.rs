//! Builds a binary tree from triangles or boxes: splits them from the top down, then improves the
//! tree.

use arrayvec::ArrayVec;
use glam::{Vec3, Vec3A};
use obvhs::aabb::Aabb;
use obvhs::bvh2::{Bvh2, node::Bvh2Node, reinsertion::ReinsertionOptimizer};
use rayon::prelude::*;

use super::wide::{Branch, Packed, Things};
use crate::math::geometry::Extent;

/// A triangle, or what else the tree arranges, and the box around it.
struct Boxed {
    extent: Extent,
    index: u32,
}

/// Returns the tree of the things with these indices, of which there must be at least one.
pub(super) fn binary_tree<T: Things + ?Sized>(things: &T, indices: &[u32]) -> Vec<Packed> {
    let boxed = |&index: &u32| Boxed { extent: things.extent(index), index };
    let mut all: Vec<Boxed> = indices.par_iter().map(boxed).collect();
    let mut tree = Bvh2 { nodes: cut(&mut all), ..Bvh2::default() };
    drop(all);
    mend(&mut tree);
    let branch = |node: &Bvh2Node| match node.first_index {
        index if node.is_leaf() => Packed::from(Branch::Thing(index)),
        first => Packed::from(Branch::Fork(first)),
    };
    tree.nodes.iter().map(branch).collect()
}

/// Returns the nodes of a tree with one triangle in each leaf, level by level.
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

/// Limit on the number of bins along an axis.
const BINS: usize = 32;

static EMPTY_BINS: [Bin; BINS] = [Bin::EMPTY; BINS];

/// Bounds and number of the triangles whose centres lie in a bin, or in several bins. Its corners
/// are vectors of the processor, which find all minima in one step.
#[derive(Clone, Copy)]
struct Bin {
    min: Vec3A,
    max: Vec3A,
    count: usize,
}

impl Bin {
    const EMPTY: Self = Self { min: Vec3A::INFINITY, max: Vec3A::NEG_INFINITY, count: 0 };

    fn of(extent: &Extent) -> Self {
        Self { min: extent.min.into(), max: extent.max.into(), count: 1 }
    }

    fn join(self, other: Self) -> Self {
        let (min, max) = (self.min.min(other.min), self.max.max(other.max));
        Self { min, max, count: self.count + other.count }
    }

    fn extent(&self) -> Extent {
        Extent { min: self.min.into(), max: self.max.into() }
    }

    /// Returns the cost for a random ray: how often it meets the box, times the number of triangles
    /// to be tested then. Triangles are counted in fours, as a leaf tests several at once. An empty
    /// part costs infinitely much, so that no cut makes one.
    fn cost(&self) -> f32 {
        match self.count {
            0 => f32::INFINITY,
            count => self.extent().half_area() * count.div_ceil(4) as f32,
        }
    }
}

/// Cuts a part in two, across the axis and at the boundary between bins that make the halves
/// cheapest: the surface area heuristic (Wald, "On fast Construction of SAH-based Bounding Volume
/// Hierarchies", Symposium on Interactive Ray Tracing, 2007). A single triangle comes back with an
/// empty second half.
fn cut_in_two(part: &mut [Boxed]) -> [&mut [Boxed]; 2] {
    let middle = if part.len() <= 2 { 1 } else { best_middle(part) };
    let (one, other) = part.split_at_mut(middle);
    [one, other]
}

/// Reorders a part so that one half comes before the other, and returns where the other starts.
fn best_middle(part: &mut [Boxed]) -> usize {
    let bins = BINS.min(2 * part.len());
    let center = |boxed: &Boxed| {
        let center = boxed.extent.center();
        Bin::of(&Extent { min: center, max: center })
    };
    let centers = part.iter().map(center).fold(Bin::EMPTY, Bin::join).extent();
    let scale = bins as f32 / centers.size();
    // along an axis on which all centres agree, 0 times infinity is a NaN, which becomes bin 0
    let places = |boxed: &Boxed| (boxed.extent.center() - centers.min) * scale;
    let bin = |places: Vec3, axis: usize| (places[axis] as u32).min(bins as u32 - 1) as usize;
    // no more bins than are used: most parts are small
    let mut table = [const { ArrayVec::<Bin, BINS>::new_const() }; 3];
    table.iter_mut().for_each(|table| table.extend(EMPTY_BINS[..bins].iter().copied()));
    for boxed in part.iter() {
        let (own, places) = (Bin::of(&boxed.extent), places(boxed));
        for (axis, table) in table.iter_mut().enumerate() {
            let known = &mut table[bin(places, axis)];
            *known = known.join(own);
        }
    }
    let mut best = (f32::INFINITY, 0, 0);
    for (axis, table) in table.iter().enumerate() {
        let (cost, cut) = best_cut(table);
        if cost < best.0 {
            best = (cost, axis, cut);
        }
    }
    match best {
        // all centres at one place
        (f32::INFINITY, ..) => part.len() / 2,
        (_, axis, cut) => partition(part, |boxed| bin(places(boxed), axis) < cut),
    }
}

/// Returns the cost of the halves at the best cut through a row of bins, and the index of the bin
/// above the cut.
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

/// Reorders a part so that the triangles that are `low` come first, and returns their number.
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

/// Expected node visits from which on triangles count as a heap, which is not improved. Reinsertion
/// looks through all overlapping nodes for each node (a minute for 100,000 discs at one place), and
/// finds nothing better. Rooms and plants have tens to hundreds of visits.
const HEAP: f32 = 5000.0;

/// Limit on the number of nodes that are moved to better places, those near the root. More would
/// take long in a canopy and gain nothing there.
const MENDED: f32 = 20_000.0;

/// Moves nodes that make boxes large (Meister and Bittner, "Parallel Reinsertion for Bounding
/// Volume Hierarchy Optimization", Computer Graphics Forum 37 (2), 2018), unless the triangles lie
/// in a heap.
fn mend(tree: &mut Bvh2) {
    if expected_visits(tree) < HEAP {
        let ratio = (MENDED / tree.nodes.len() as f32).min(1.0);
        ReinsertionOptimizer::default().run(tree, ratio, None);
    }
}

/// Returns the number of nodes that a random ray through the tree is expected to meet: the sum of
/// their areas over the area of the root.
fn expected_visits(tree: &Bvh2) -> f32 {
    let root = tree.nodes[0].aabb.half_area();
    tree.nodes.iter().map(|node| node.aabb.half_area() / root).sum()
}
