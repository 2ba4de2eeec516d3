//! The memory layout of the search structure, and the result of a search.

use glam::Vec3;

/// The place where a ray meets a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Distance along the ray, > 0, in lengths of its direction (m when that is a unit vector).
    pub t: f32,
    /// Index of the triangle in the list the structure was built from.
    pub triangle: u32,
    /// Weight of the triangle's corner b, in [0, 1].
    pub u: f32,
    /// Weight of the triangle's corner c, in [0, 1]: the point is a + u (b - a) + v (c - a).
    pub v: f32,
    /// The point of the hit, m.
    pub point: Vec3,
    /// False where the ray passes through an edge that belongs to the neighbouring triangle.
    pub owned: bool,
}

/// Eight numbers that the processor handles at once.
#[derive(Clone, Copy, Debug)]
#[repr(align(32))]
pub(super) struct Row(pub [f32; 8]);

/// The search structure: triangles arranged for the tracing of rays. Coordinates of triangles and
/// rays must stay below 1e9 m.
#[derive(Clone, Debug, Default)]
pub struct Bvh {
    /// Nodes and leaves, a parent before its children.
    pub(super) rows: Vec<Row>,
    /// Number of nodes that form the root, the first ones; 0 where there is no triangle.
    pub(super) root_nodes: usize,
}

/// A function that gathers one bit of each of eight numbers, whose bits are all ones or all zeros.
pub(super) trait Gather: Fn([u32; 8]) -> u32 + Copy {}

impl<F: Fn([u32; 8]) -> u32 + Copy> Gather for F {}
