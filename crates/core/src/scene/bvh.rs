//! The ray kernel: nearest hits, occlusion and crossings among triangles, without losing a hit.
//!
//! A binary tree (`binary`), which the crate obvhs improves, becomes a wide tree (`wide`): each
//! node has eight children, the root up to 32, and each leaf up to eight triangles; boxes and
//! triangles are tested eight at a time. The walk through the tree (`walk`) and both tests (boxes
//! in `walk`, triangles in `triangle`) are written here, because a photon that slips between two
//! triangles is flux that is missing from the balance. A tree may also hold discs and spheres
//! (`round`). `query` holds the entry points of the search. All code paths give the same bits on
//! every processor.

mod binary;
mod build;
mod layout;
mod pages;
mod query;
mod round;
mod triangle;
mod walk;
mod wide;

#[cfg(test)]
mod tests;

use crate::math::{
    geometry::{Extent, Ray, Triangle},
    round::{Round, RoundHit},
};
use query::{Closest, ClosestWithin, Crossings, Meet, Occluded, OccludedWithin};
use round::CrossRounds;
use walk::ROOT_NODES;

pub use layout::{Bvh, Hit};
pub(in crate::scene) use query::Enter;
pub use query::Kernel;

impl Bvh {
    /// Builds the search structure of `triangles`, all finite. Triangles without area are left out:
    /// no ray hits them. It runs in the caller's rayon pool; the same triangles give the same
    /// structure on any number of threads.
    pub fn build(triangles: &[Triangle]) -> Self {
        build::build(triangles, 0..triangles.len() as u32, ROOT_NODES)
    }

    /// Builds the search structure of the triangles with these indices.
    pub fn build_of(triangles: &[Triangle], indices: impl Iterator<Item = u32>) -> Self {
        build::build(triangles, indices, ROOT_NODES)
    }

    /// Builds the search structure of the triangles with these indices, the last of which rays meet
    /// only within `boxes`, one for each.
    pub fn build_within(
        triangles: &[Triangle],
        indices: impl Iterator<Item = u32>,
        boxes: Vec<Extent>,
    ) -> Self {
        build::build_within(triangles, indices, boxes)
    }

    /// Builds the search structure of triangles that most rays pass by: the root has no more
    /// children than other nodes.
    pub fn build_for_few(triangles: &[Triangle]) -> Self {
        build::build(triangles, 0..triangles.len() as u32, 1)
    }

    /// Builds a tree of boxes, at least one, around what has trees of its own.
    pub fn build_of_boxes(boxes: &[Extent]) -> Self {
        build::build_of_boxes(boxes)
    }

    /// Builds a tree of the discs and spheres with these indices.
    pub fn build_of_rounds(rounds: &[Round], indices: Vec<u32>) -> Self {
        if indices.is_empty() { Self::default() } else { build::build_of_rounds(rounds, indices) }
    }

    /// Visits every crossing of a ray with 0 < t < `t_max` with the discs and spheres that the tree was
    /// built of, in no particular order, each with its index among them.
    pub fn cross_rounds(
        &self,
        rounds: &[Round],
        ray: &Ray,
        t_max: f32,
        mut visit: impl FnMut(usize, RoundHit),
    ) {
        query::ask(CrossRounds { bvh: self, rounds, ray, t_max, visit: &mut visit });
    }

    /// Returns, for a tree of boxes, the nearest hit with 0 < t < `t_max` in what the boxes hold,
    /// with the index of its box.
    pub(in crate::scene) fn closest_within(
        &self,
        ray: &Ray,
        t_max: f32,
        enter: Enter,
    ) -> Option<(u32, Hit)> {
        query::ask(ClosestWithin { boxes: self, ray, t_max, enter })
    }

    /// Returns, for a tree of boxes, whether any triangle in what the boxes hold that the ray hits
    /// with 0 < t < `t_max` `stops` it; its first argument is the index of the box.
    pub(in crate::scene) fn occluded_within(
        &self,
        ray: &Ray,
        t_max: f32,
        enter: Enter,
        mut stops: impl FnMut(u32, Hit) -> bool,
    ) -> bool {
        query::ask(OccludedWithin { boxes: self, ray, t_max, enter, stops: &mut stops })
    }

    /// Returns the nearest hit with 0 < t < `t_max` (which may be infinite); of several at the same
    /// t the one with the lowest triangle index.
    pub fn closest(&self, ray: &Ray, t_max: f32) -> Option<Hit> {
        query::ask(Closest { bvh: self, ray, t_max })
    }

    /// Returns whether any triangle that the ray hits with 0 < t < `t_max` (which may be infinite)
    /// `stops` it. `stops` is called at most once for each triangle, in no particular order.
    pub fn occluded(&self, ray: &Ray, t_max: f32, mut stops: impl FnMut(Hit) -> bool) -> bool {
        query::ask(Occluded { bvh: self, ray, t_max, stops: &mut stops })
    }

    /// Returns whether any triangle that [`crossings`](Self::crossings) would visit is `wanted`,
    /// which is called until it returns true.
    pub fn crosses(&self, ray: &Ray, t_max: f32, mut wanted: impl FnMut(Hit) -> bool) -> bool {
        self.occluded(ray, t_max, |hit| hit.owned && wanted(hit))
    }

    /// Visits every triangle crossed with 0 < t < `t_max`, each once, in no particular order; if
    /// the ray passes through an edge that two triangles share, only one of them.
    pub fn crossings(&self, ray: &Ray, t_max: f32, mut visit: impl FnMut(Hit)) {
        query::ask(Crossings { bvh: self, ray, t_max, visit: &mut visit });
    }

    /// Returns the nearest hit, as [`closest`](Self::closest), after it has visited all crossings
    /// of the other structure `crossed` before that hit, or at the same t, of which the second
    /// argument of `visit` tells: less work than two separate searches.
    pub fn meet(&self, crossed: &Self, ray: &Ray, mut visit: impl FnMut(Hit, bool)) -> Option<Hit> {
        query::ask(Meet { surfaces: self, crossed, ray, visit: &mut visit })
    }

    /// Returns whether the structure holds nothing.
    pub fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }
}
