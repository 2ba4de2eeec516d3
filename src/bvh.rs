//! The ray kernel: nearest hit, occlusion and crossings among triangles, without losing a hit.
//!
//! obvhs builds the tree (PLOC, then reinsertion, then eight children a node); the walk and both
//! intersection tests are our own, because a photon that slips between two triangles is flux that
//! nobody can account for. Every path through here gives the same bits on every processor.

mod build;
mod triangle;
mod walk;

#[cfg(test)]
mod tests;

use glam::{Vec3, Vec4};

use crate::geometry::{Ray, Triangle};
use walk::Node;

pub use walk::Probe;

/// Where a ray meets a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Distance along the ray, > 0, in lengths of its direction (m when that is a unit vector).
    pub t: f32,
    /// Index of the triangle in the list the structure was built from.
    pub triangle: u32,
    /// Where the structure keeps that triangle.
    place: u32,
    /// Weight of the triangle's corner b, in [0, 1].
    pub u: f32,
    /// Weight of the triangle's corner c, in [0, 1]: the point is a + u (b - a) + v (c - a).
    pub v: f32,
    /// False where the ray passes through an edge that belongs to the triangle across it.
    pub owned: bool,
}

/// Triangles arranged for rays. Coordinates of triangles and rays must stay below 1e9 m.
#[derive(Clone, Debug, Default)]
pub struct Bvh {
    nodes: Vec<Node>,
    /// Rows x, y, z, each with the corners a, b, c (and 0), in leaf order.
    corners: Vec<[Vec4; 3]>,
    /// For each of `corners`, its index in the list that was built from.
    indices: Vec<u32>,
    /// Largest |x|, |y|, |z| of any corner: the scale of rounding errors, m.
    reach: Vec3,
    /// How many nodes can wait at a time in the worst walk.
    stack_size: usize,
}

impl Bvh {
    /// Arranges `triangles`, all finite. Those without area are left out: no ray hits them. It runs
    /// in the caller's rayon pool; the same triangles give the same structure on any number of
    /// threads.
    pub fn build(triangles: &[Triangle]) -> Self {
        build::build(triangles)
    }

    /// The nearest hit with 0 < t < `t_max` (which may be infinite); of several at the same t the
    /// one with the lowest triangle index.
    pub fn closest(&self, ray: &Ray, t_max: f32) -> Option<Hit> {
        self.closest_of(&Probe::new(ray, self.reach), t_max)
    }

    /// The same of a ray that is prepared for this [`reach`](Self::reach) or more.
    #[inline]
    pub fn closest_of(&self, probe: &Probe, t_max: f32) -> Option<Hit> {
        let none = Hit { t: t_max, triangle: 0, place: u32::MAX, u: 0.0, v: 0.0, owned: true };
        let nearest = self.walk(probe, t_max, none, |best, hit| {
            if hit.t < best.t || (hit.t == best.t && hit.triangle < best.triangle) {
                *best = hit;
            }
            best.t
        });
        (nearest.place != none.place).then_some(nearest)
    }

    /// The point of a hit in this structure.
    #[inline]
    pub fn point(&self, hit: &Hit) -> Vec3 {
        let weights = Vec3::new(1.0 - hit.u - hit.v, hit.u, hit.v);
        let along = |row: Vec4| weights.x * row.x + weights.y * row.y + weights.z * row.z;
        let [x, y, z] = self.corners[hit.place as usize];
        Vec3::new(along(x), along(y), along(z))
    }

    /// Whether a triangle that the ray hits with 0 < t < `t_max` (which may be infinite) `stops` it;
    /// asked for each at most once, in no particular order.
    pub fn occluded(&self, ray: &Ray, t_max: f32, stops: impl FnMut(Hit) -> bool) -> bool {
        let probe = Probe::new(ray, self.reach);
        let (found, _) = self.walk(&probe, t_max, (false, stops), |(found, stops), hit| {
            *found = *found || (hit.t < t_max && stops(hit));
            if *found { -1.0 } else { t_max }
        });
        found
    }

    /// Visits every triangle crossed with 0 < t < `t_max`, each once, in no particular order; of two
    /// that share an edge which the ray passes through, one.
    pub fn crossings(&self, ray: &Ray, t_max: f32, visit: impl FnMut(Hit)) {
        self.crossings_of(&Probe::new(ray, self.reach), t_max, visit);
    }

    /// The same of a ray that is prepared for this [`reach`](Self::reach) or more.
    #[inline]
    pub fn crossings_of(&self, probe: &Probe, t_max: f32, visit: impl FnMut(Hit)) {
        self.walk(probe, t_max, visit, |visit, hit| {
            if hit.t < t_max && hit.owned {
                visit(hit);
            }
            t_max
        });
    }

    /// Largest |x|, |y|, |z| of any corner, m.
    pub fn reach(&self) -> Vec3 {
        self.reach
    }

    /// Visits the index of every triangle that may reach into the ball of `radius` around `center`:
    /// of those in boxes that do.
    pub fn near(&self, center: Vec3, radius: f32, mut visit: impl FnMut(u32)) {
        self.walk_ball(center, radius, |place| visit(self.indices[place]));
    }

    /// Calls `visit` for hits with 0 < t <= limit, where the limit is `t_max` at first and then
    /// what `visit` returned last; a negative one ends the walk. The state that it gets comes back in the
    /// end: owned by the walk, it stays in registers.
    #[inline(always)]
    fn walk<S>(
        &self,
        probe: &Probe,
        t_max: f32,
        state: S,
        visit: impl Fn(&mut S, Hit) -> f32,
    ) -> S {
        #[cfg(target_arch = "x86_64")]
        if has_avx2() {
            #[allow(unsafe_code)]
            // SAFETY: the processor has what it needs, as was just asked.
            return unsafe { self.walk_avx2(probe, t_max, state, visit) };
        }
        self.walk_plain(probe, t_max, state, visit)
    }

    fn walk_plain<S>(
        &self,
        probe: &Probe,
        t_max: f32,
        state: S,
        visit: impl Fn(&mut S, Hit) -> f32,
    ) -> S {
        self.walk_with(probe, t_max, state, visit, |slabs, node, limit| slabs.enter(node, limit))
    }

    /// The same bits: Rust never contracts a * b + c.
    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2,bmi1,bmi2,lzcnt")]
    fn walk_avx2<S>(
        &self,
        probe: &Probe,
        t_max: f32,
        state: S,
        visit: impl Fn(&mut S, Hit) -> f32,
    ) -> S {
        self.walk_with(probe, t_max, state, visit, |slabs, node, limit| {
            slabs.enter_avx2(node, limit)
        })
    }
}

/// Whether the processor has all that the fast walk takes.
#[cfg(target_arch = "x86_64")]
#[inline(always)]
fn has_avx2() -> bool {
    is_x86_feature_detected!("avx2")
        && is_x86_feature_detected!("bmi1")
        && is_x86_feature_detected!("bmi2")
        && is_x86_feature_detected!("lzcnt")
}
