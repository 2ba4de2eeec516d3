//! The ray kernel: nearest hit, occlusion and crossings among triangles, without losing a hit.
//!
//! A binary tree, which obvhs mends, becomes one of eight children a node, up to 32 at the root, and up to
//! eight triangles a leaf; boxes and triangles are tested eight at a time. The walk and both tests are our own, because a
//! photon that slips between two triangles is flux that nobody can account for. Every path through here
//! gives the same bits on every processor.

mod binary;
mod build;
mod layout;
mod pages;
mod query;
mod triangle;
mod walk;
mod wide;

#[cfg(test)]
mod tests;

use crate::math::geometry::{Ray, Triangle};
use query::{Closest, Crossings, Meet, Occluded};
use walk::ROOT_NODES;

pub use layout::{Bvh, Hit};
pub use query::Kernel;

impl Bvh {
    /// Arranges `triangles`, all finite. Those without area are left out: no ray hits them. It runs
    /// in the caller's rayon pool; the same triangles give the same structure on any number of
    /// threads.
    pub fn build(triangles: &[Triangle]) -> Self {
        build::build(triangles, 0..triangles.len() as u32, ROOT_NODES)
    }

    /// The same, of those of the triangles that have these indices.
    pub fn build_of(triangles: &[Triangle], indices: impl Iterator<Item = u32>) -> Self {
        build::build(triangles, indices, ROOT_NODES)
    }

    /// The same, for triangles that most rays pass by: the root has no more children than other nodes.
    pub fn build_for_few(triangles: &[Triangle]) -> Self {
        build::build(triangles, 0..triangles.len() as u32, 1)
    }

    /// The nearest hit with 0 < t < `t_max` (which may be infinite); of several at the same t the
    /// one with the lowest triangle index.
    pub fn closest(&self, ray: &Ray, t_max: f32) -> Option<Hit> {
        query::ask(Closest { bvh: self, ray, t_max })
    }

    /// Whether a triangle that the ray hits with 0 < t < `t_max` (which may be infinite) `stops` it;
    /// asked for each at most once, in no particular order.
    pub fn occluded(&self, ray: &Ray, t_max: f32, mut stops: impl FnMut(Hit) -> bool) -> bool {
        query::ask(Occluded { bvh: self, ray, t_max, stops: &mut stops })
    }

    /// Whether a triangle that [`crossings`](Self::crossings) would visit is `wanted`; asked until one is.
    pub fn crosses(&self, ray: &Ray, t_max: f32, mut wanted: impl FnMut(Hit) -> bool) -> bool {
        self.occluded(ray, t_max, |hit| hit.owned && wanted(hit))
    }

    /// Visits every triangle crossed with 0 < t < `t_max`, each once, in no particular order; of two
    /// that share an edge which the ray passes through, one.
    pub fn crossings(&self, ray: &Ray, t_max: f32, mut visit: impl FnMut(Hit)) {
        query::ask(Crossings { bvh: self, ray, t_max, visit: &mut visit });
    }

    /// The nearest hit, as [`closest`](Self::closest), after all `crossings` of another structure
    /// before it: less work than asking for one after the other.
    pub fn meet(&self, crossed: &Self, ray: &Ray, mut visit: impl FnMut(Hit)) -> Option<Hit> {
        query::ask(Meet { surfaces: self, crossed, ray, visit: &mut visit })
    }

    /// Whether there is no triangle in it.
    pub fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }
}
