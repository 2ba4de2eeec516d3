//! From triangles to the tree, by way of obvhs.

use glam::{Vec3, Vec3A};
use obvhs::aabb::Aabb;
use obvhs::bvh2::{Bvh2, node::Bvh2Node, reinsertion::ReinsertionOptimizer};
use obvhs::ploc::{PlocBuilder, PlocSearchDistance, SortPrecision};

use super::Bvh;
use super::walk::STACK;
use super::wide::{Branch, widen};
use crate::geometry::{Extent, Triangle};

pub(super) fn build(triangles: &[Triangle]) -> Bvh {
    let solid: Vec<u32> =
        (0..).zip(triangles).filter(|(_, t)| has_area(t)).map(|(i, _)| i).collect();
    if solid.is_empty() {
        return Bvh::default();
    }
    let boxes: Vec<Aabb> = solid.iter().map(|&i| loosened_box(&triangles[i as usize], i)).collect();
    let binary = binary_tree(&boxes, &solid);
    let (rows, waiting) = widen(&binary, triangles);
    let rows = if waiting > STACK { widen(&balanced(&binary), triangles).0 } else { rows };
    let reach = solid.iter().map(|&i| reach(&triangles[i as usize])).fold(Vec3::ZERO, Vec3::max);
    Bvh { rows, reach }
}

/// Exactly, but for the rounding of doubles: whether the corners do not lie on one line.
fn has_area(t: &Triangle) -> bool {
    let (a, b, c) = (t.a.as_dvec3(), t.b.as_dvec3(), t.c.as_dvec3());
    (b - a).cross(c - a) != glam::DVec3::ZERO
}

fn reach(t: &Triangle) -> Vec3 {
    t.a.abs().max(t.b.abs()).max(t.c.abs())
}

/// The box of a triangle, each side moved out by up to 1/1000 of the extent, the same each time.
///
/// PLOC joins boxes that are each other's best neighbour. Among equal boxes (a strip or grid of
/// equal tiles, copies of a triangle) only one pair agrees a round: the build takes quadratic time
/// and makes a chain, not a tree, and rays take three to five times as long. Slightly unequal boxes
/// it joins well. The nodes get the exact ones.
fn loosened_box(t: &Triangle, index: u32) -> Aabb {
    let Extent { min, max } = Extent::of_triangles([t]);
    let slack = |side: u32| {
        let [x, y, z] = [0, 1, 2].map(|axis| noise(6 * u64::from(index) + u64::from(side + axis)));
        Vec3::new(x, y, z) * (max - min) * 1e-3
    };
    Aabb::new(Vec3A::from(min - slack(0)), Vec3A::from(max + slack(3)))
}

/// A number in [0, 1) that looks random (splitmix64).
fn noise(n: u64) -> f32 {
    let mut z = n.wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    (z >> 40) as f32 / (1 << 24) as f32
}

/// Visits from which on triangles are a heap: reinsertion looks through all that overlap, for each of
/// them (a minute for 100,000 discs at one place), and finds nothing better. Rooms and plants have
/// tens to hundreds.
const HEAP: f32 = 5000.0;

/// How many nodes a random ray through the tree meets: their areas over the area of the root.
fn expected_visits(tree: &Bvh2) -> f32 {
    let root = tree.nodes[0].aabb.half_area();
    tree.nodes.iter().map(|node| node.aabb.half_area() / root).sum()
}

/// What obvhs calls a medium build, unless the triangles lie in a heap.
fn binary_tree(boxes: &[Aabb], indices: &[u32]) -> Vec<Branch> {
    let places = (0..boxes.len() as u32).collect();
    let distance = PlocSearchDistance::Medium;
    let mut tree = PlocBuilder::new().build(distance, boxes, places, SortPrecision::U64, 3);
    if expected_visits(&tree) < HEAP {
        ReinsertionOptimizer::default().run(&mut tree, 0.1, None);
    }
    let branch = |node: &Bvh2Node| {
        let first = node.first_index as usize;
        if node.is_leaf() {
            Branch::Triangle(indices[tree.primitive_indices[first] as usize])
        } else {
            Branch::Fork([first, first + 1])
        }
    };
    tree.nodes.iter().map(branch).collect()
}

/// The same triangles in the same order in a tree without long branches, where a chain of nested triangles
/// has made some.
fn balanced(binary: &[Branch]) -> Vec<Branch> {
    let mut order = Vec::new();
    let mut waiting = vec![0];
    while let Some(i) = waiting.pop() {
        match binary[i] {
            Branch::Fork([l, r]) => waiting.extend([r, l]),
            Branch::Triangle(index) => order.push(index),
        }
    }
    let mut tree = Vec::with_capacity(binary.len());
    let mut ranges = vec![(0, order.len())];
    // the two halves of a range come last in the list, to be halved in their turn
    while let Some(&(start, end)) = ranges.get(tree.len()) {
        tree.push(if end - start == 1 {
            Branch::Triangle(order[start])
        } else {
            let (middle, next) = (start.midpoint(end), ranges.len());
            ranges.extend([(start, middle), (middle, end)]);
            Branch::Fork([next, next + 1])
        });
    }
    tree
}
