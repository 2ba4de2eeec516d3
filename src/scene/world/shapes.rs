//! Triangles with what finds them: what of a scene takes time to make, and does not depend on its
//! materials and powers.

use std::{
    ops::Range,
    sync::{Arc, Mutex, PoisonError, Weak},
};

use glam::Vec3;
use rayon::prelude::*;

use super::RAY_OFFSET;
use crate::{
    math::geometry::{Ray, Triangle},
    scene::bvh::Bvh,
};

/// Triangles, before they are arranged.
#[derive(Debug, PartialEq)]
pub struct Outlines {
    /// Triangles of all surfaces.
    pub triangles: Vec<Triangle>,
    /// Triangles of all virtual captors, where the user put them.
    pub captor_triangles: Vec<Triangle>,
    /// Index of the captor of each of the latter.
    pub captor_of_triangle: Vec<u32>,
    /// Half the diagonal of the scene, m.
    pub radius: f32,
}

/// Triangles, arranged for rays.
#[derive(Debug)]
pub struct Shapes {
    outlines: Outlines,
    /// Finds triangles of surfaces.
    pub surface_bvh: Bvh,
    /// Finds triangles of virtual captors, lifted off the surfaces that they lie in.
    pub captor_bvh: Bvh,
    /// Virtual captors that lie in a surface, in order.
    pub in_surface: Vec<usize>,
}

impl std::ops::Deref for Shapes {
    type Target = Outlines;
    fn deref(&self) -> &Outlines {
        &self.outlines
    }
}

/// Shapes of scenes, to be used again where the triangles are the same: the last ones that were
/// made, and all that are in use.
#[derive(Debug, Default)]
pub struct KeptShapes(Mutex<Shelf>);

#[derive(Debug, Default)]
struct Shelf {
    last: Option<Arc<Shapes>>,
    known: Vec<Weak<Shapes>>,
}

impl KeptShapes {
    /// The shapes of these outlines.
    pub fn shapes(&self, outlines: Outlines) -> Arc<Shapes> {
        let shelf = || self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let known: Vec<Arc<Shapes>> = shelf().known.iter().filter_map(Weak::upgrade).collect();
        let same = known.into_iter().find(|shapes| shapes.outlines == outlines);
        let is_new = same.is_none();
        // not locked: others may be made meanwhile
        let shapes = same.unwrap_or_else(|| Arc::new(Shapes::new(outlines)));
        let mut shelf = shelf();
        shelf.last = Some(shapes.clone());
        shelf.known.retain(|known| known.strong_count() > 0);
        if is_new {
            shelf.known.push(Arc::downgrade(&shapes));
        }
        shapes
    }
}

impl Shapes {
    /// Arranges triangles, in the caller's rayon pool. A virtual captor in the plane of a surface counts
    /// as lying off it, where its normal points: its triangles move to two ray offsets, above the
    /// points that rays start from.
    fn new(outlines: Outlines) -> Self {
        let Outlines { triangles, captor_triangles, captor_of_triangle, radius } = &outlines;
        let offset = RAY_OFFSET * radius;
        let surface_bvh = Bvh::build(triangles);
        let captor_bvh = Bvh::build_for_few(captor_triangles);
        let lies_in_surface = |triangle: &Triangle| {
            let normal = triangle.normal();
            let near_corners = [(0.05, 0.05), (0.9, 0.05), (0.05, 0.9)];
            [(1.0 / 3.0, 1.0 / 3.0)].iter().chain(&near_corners).any(|&(u, v)| {
                let point = triangle.point(u, v);
                parallel_neighbours(&surface_bvh, triangles, point, normal, offset).next().is_some()
            })
        };
        let captors = captors(captor_of_triangle);
        let mut in_surface: Vec<usize> = captors
            .par_iter()
            .filter(|(_, range)| captor_triangles[range.clone()].iter().any(&lies_in_surface))
            .map(|(captor, _)| *captor)
            .collect();
        // a captor larger than the surface that it lies in is found from the surface's side
        if !captor_triangles.is_empty() {
            let above = |t: &Triangle| {
                let (middle, normal) = (t.centroid(), t.normal());
                parallel_neighbours(&captor_bvh, captor_triangles, middle, normal, offset).min()
            };
            let covered: Vec<u32> = triangles.par_iter().filter_map(above).collect();
            in_surface.extend(covered.iter().map(|&t| captor_of_triangle[t as usize] as usize));
            in_surface.sort_unstable();
            in_surface.dedup();
        }
        if in_surface.is_empty() {
            return Self { outlines, surface_bvh, captor_bvh, in_surface };
        }
        let mut lifted = captor_triangles.clone();
        for (_, range) in captors.iter().filter(|(c, _)| in_surface.binary_search(c).is_ok()) {
            for triangle in &mut lifted[range.clone()] {
                let shift = 2.0 * offset * triangle.normal();
                *triangle = [triangle.a + shift, triangle.b + shift, triangle.c + shift].into();
            }
        }
        let captor_bvh = Bvh::build_for_few(&lifted);
        Self { outlines, surface_bvh, captor_bvh, in_surface }
    }
}

/// Each virtual captor with its triangles, which stand side by side.
fn captors(captor_of_triangle: &[u32]) -> Vec<(usize, Range<usize>)> {
    let mut first = 0;
    let runs = captor_of_triangle.chunk_by(|a, b| a == b);
    runs.map(|run| {
        let range = first..first + run.len();
        first = range.end;
        (run[0] as usize, range)
    })
    .collect()
}

/// The triangles parallel to `normal` within `reach` of `point`.
pub fn parallel_neighbours(
    bvh: &Bvh,
    triangles: &[Triangle],
    point: Vec3,
    normal: Vec3,
    reach: f32,
) -> impl Iterator<Item = u32> {
    let mut found = Vec::new();
    if normal != Vec3::ZERO {
        let ray = Ray { origin: point - reach * normal, direction: normal };
        bvh.crossings(&ray, 2.0 * reach, |hit| {
            if triangles[hit.triangle as usize].normal().dot(normal).abs() > 0.999_999 {
                found.push(hit.triangle);
            }
        });
    }
    found.into_iter()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_same_triangles_are_arranged_once() {
        let outlines = |z: f32| Outlines {
            triangles: vec![[Vec3::ZERO, Vec3::X, Vec3::new(0.0, 1.0, z)].into()],
            captor_triangles: Vec::new(),
            captor_of_triangle: Vec::new(),
            radius: 1.0,
        };
        let kept = KeptShapes::default();
        let (first, other) = (kept.shapes(outlines(0.0)), kept.shapes(outlines(1.0)));
        assert!(!Arc::ptr_eq(&first, &other));
        // not the last, but in use
        assert!(Arc::ptr_eq(&first, &kept.shapes(outlines(0.0))));
        drop(first);
        // not in use, but the last
        let first = Arc::downgrade(&kept.shapes(outlines(0.0)));
        assert!(first.upgrade().is_some());
        assert!(Arc::ptr_eq(&other, &kept.shapes(outlines(1.0))));
        assert!(first.upgrade().is_none(), "neither");
    }
}
