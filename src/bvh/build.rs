//! From triangles to the tree, by way of obvhs.

use std::thread;

use glam::{Vec3, Vec3A, Vec4};
use obvhs::aabb::Aabb;
use obvhs::bvh2::{Bvh2, reinsertion::ReinsertionOptimizer};
use obvhs::cwbvh::{CwBvh, bvh2_to_cwbvh::bvh2_to_cwbvh};
use obvhs::ploc::{PlocBuilder, PlocSearchDistance, SortPrecision};

use super::Bvh;
use super::walk::{Child, Node};
use crate::geometry::Triangle;

pub(super) fn build(triangles: &[Triangle]) -> Bvh {
    let solid: Vec<u32> =
        (0..).zip(triangles).filter(|(_, t)| has_area(t)).map(|(i, _)| i).collect();
    let boxes: Vec<Aabb> = solid.iter().map(|&i| loosened_box(&triangles[i as usize], i)).collect();
    let wide = wide_tree(&boxes);
    let indices: Vec<u32> = wide.primitive_indices.iter().map(|&i| solid[i as usize]).collect();
    let corners: Vec<[Vec4; 3]> = indices.iter().map(|&i| rows(&triangles[i as usize])).collect();
    let reach = solid.iter().map(|&i| reach(&triangles[i as usize])).fold(Vec3::ZERO, Vec3::max);
    let (nodes, stack_size) = nodes(&wide, &corners);
    Bvh { nodes, corners, indices, reach, stack_size }
}

/// Exactly, but for the rounding of doubles: whether the corners do not lie on one line.
fn has_area(t: &Triangle) -> bool {
    let (a, b, c) = (t.a.as_dvec3(), t.b.as_dvec3(), t.c.as_dvec3());
    (b - a).cross(c - a) != glam::DVec3::ZERO
}

fn rows(t: &Triangle) -> [Vec4; 3] {
    [0, 1, 2].map(|axis| Vec4::new(t.a[axis], t.b[axis], t.c[axis], 0.0))
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
    let (min, max) = (t.a.min(t.b).min(t.c), t.a.max(t.b).max(t.c));
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

/// The eight-way tree over `boxes`, up to three in a leaf.
fn wide_tree(boxes: &[Aabb]) -> CwBvh {
    if boxes.is_empty() {
        return CwBvh::default();
    }
    // what obvhs calls a medium build, unless they lie in a heap
    let indices = (0..boxes.len() as u32).collect();
    let distance = PlocSearchDistance::Medium;
    let mut binary = PlocBuilder::new().build(distance, boxes, indices, SortPrecision::U64, 3);
    if expected_visits(&binary) < HEAP {
        ReinsertionOptimizer::default().run(&mut binary, 0.1, None);
    }
    let convert = || bvh2_to_cwbvh(&binary, 3, true, false);
    // obvhs converts by recursion: a chain of nested triangles gets a call stack of its own
    let depth = depth(&binary);
    if depth < 500 {
        return convert();
    }
    thread::scope(|scope| {
        let deep = thread::Builder::new().stack_size((2 << 20) + depth * 4096);
        let handle = deep.spawn_scoped(scope, convert).expect("a thread for a deep tree");
        handle.join().expect("the conversion does not panic")
    })
}

fn depth(tree: &Bvh2) -> usize {
    let mut deepest = 0;
    let mut waiting = vec![(0, 1)];
    while let Some((node, depth)) = waiting.pop() {
        deepest = deepest.max(depth);
        let node = &tree.nodes[node as usize];
        if !node.is_leaf() {
            waiting.extend([(node.first_index, depth + 1), (node.first_index + 1, depth + 1)]);
        }
    }
    deepest
}

/// The nodes with exact boxes, and how many nodes can wait at a time in a walk.
fn nodes(wide: &CwBvh, corners: &[[Vec4; 3]]) -> (Vec<Node>, usize) {
    let mut nodes = vec![Node::EMPTY; wide.nodes.len()];
    let mut bounds = vec![(Vec3::INFINITY, Vec3::NEG_INFINITY); wide.nodes.len()];
    let mut waiting = vec![0; wide.nodes.len()];
    // a child comes after its parent
    for (i, node) in wide.nodes.iter().enumerate().rev() {
        let children = (0..8).filter(|&c| !node.is_child_empty(c));
        let beside = children.clone().count() - 1;
        waiting[i] = beside;
        for c in children {
            let (child, (min, max)) = if node.is_leaf(c) {
                let (first, count) = node.child_primitives(c);
                let range = first as usize..(first + count) as usize;
                (Child::leaf(first, count), extent(&corners[range]))
            } else {
                let index = node.child_node_index(c) as usize;
                waiting[i] = waiting[i].max(beside + waiting[index]);
                (Child::inner(index as u32), bounds[index])
            };
            nodes[i].set(c, child, min, max);
            bounds[i] = (bounds[i].0.min(min), bounds[i].1.max(max));
        }
    }
    (nodes, waiting.first().copied().unwrap_or(0))
}

/// Lower and upper corner of the box of some triangles.
fn extent(corners: &[[Vec4; 3]]) -> (Vec3, Vec3) {
    let mut bounds = (Vec3::INFINITY, Vec3::NEG_INFINITY);
    for [x, y, z] in corners {
        for i in 0..3 {
            let corner = Vec3::new(x[i], y[i], z[i]);
            bounds = (bounds.0.min(corner), bounds.1.max(corner));
        }
    }
    bounds
}
