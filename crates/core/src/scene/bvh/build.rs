//! Builds the tree from triangles, discs and spheres, or boxes.

use super::binary::binary_tree;
use super::layout::Bvh;
use super::walk::{ROOT_NODES, STACK};
use super::wide::{Branch, Packed, Things, Within, widen};
use crate::math::{
    geometry::{Extent, Triangle},
    round::Round,
};

pub(super) fn build(
    triangles: &[Triangle],
    indices: impl Iterator<Item = u32>,
    root_nodes: usize,
) -> Bvh {
    let solid: Vec<u32> = indices.filter(|&i| has_area(&triangles[i as usize])).collect();
    if solid.is_empty() {
        return Bvh::default();
    }
    arrange(triangles, solid, root_nodes)
}

/// Builds the tree of triangles, the last of which are met only within these boxes.
pub(super) fn build_within(
    triangles: &[Triangle],
    indices: impl Iterator<Item = u32>,
    boxes: Vec<Extent>,
) -> Bvh {
    let solid: Vec<u32> = indices.filter(|&i| has_area(&triangles[i as usize])).collect();
    if solid.is_empty() {
        return Bvh::default();
    }
    arrange(&Within { triangles, boxes }, solid, ROOT_NODES)
}

/// Builds the tree of boxes, of which there must be at least one.
pub(super) fn build_of_boxes(boxes: &[Extent]) -> Bvh {
    let all: Vec<u32> = (0..boxes.len() as u32).collect();
    arrange(boxes, all, 1)
}

/// Builds the tree of the discs and spheres with these indices, of which there must be at least one.
pub(super) fn build_of_rounds(rounds: &[Round], indices: Vec<u32>) -> Bvh {
    arrange(rounds, indices, 1)
}

fn arrange<T: Things + ?Sized>(things: &T, indices: Vec<u32>, root_nodes: usize) -> Bvh {
    let binary = binary_tree(things, &indices);
    drop(indices);
    let mut wide = widen(&binary, things, root_nodes);
    if wide.waiting > STACK {
        wide = widen(&balanced(&binary), things, root_nodes);
    }
    Bvh { rows: wide.rows, root_nodes: wide.root_nodes }
}

/// Returns whether the corners do not lie on one line; exact, apart from the rounding of doubles.
fn has_area(t: &Triangle) -> bool {
    let (a, b, c) = (t.a.as_dvec3(), t.b.as_dvec3(), t.c.as_dvec3());
    (b - a).cross(c - a) != glam::DVec3::ZERO
}

/// Returns a balanced tree of the same triangles in the same order. It replaces a tree in which a
/// chain of nested triangles has made long branches.
pub(super) fn balanced(binary: &[Packed]) -> Vec<Packed> {
    let mut order = Vec::new();
    let mut waiting = vec![0];
    while let Some(i) = waiting.pop() {
        match binary[i].branch() {
            Branch::Fork(first) => waiting.extend([first as usize + 1, first as usize]),
            Branch::Thing(index) => order.push(index),
        }
    }
    let mut tree = Vec::with_capacity(binary.len());
    let mut ranges = vec![(0, order.len())];
    // the two halves of a range go to the end of the list, to be halved later
    while let Some(&(start, end)) = ranges.get(tree.len()) {
        let branch = if end - start == 1 {
            Branch::Thing(order[start])
        } else {
            let (middle, next) = (start.midpoint(end), ranges.len());
            ranges.extend([(start, middle), (middle, end)]);
            Branch::Fork(next as u32)
        };
        tree.push(Packed::from(branch));
    }
    tree
}
