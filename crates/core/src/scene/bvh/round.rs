//! Discs and spheres in the tree: a leaf holds up to eight, and a test of all eight at once, in single
//! precision, leaves few to the exact one.

use glam::{Vec3, Vec3A};

use super::layout::{Bvh, Gather, Row};
use super::query::Query;
use super::walk::{Child, Slabs};
use super::wide::{Packed, Things, things_below};
use crate::math::{
    geometry::{Extent, ROUNDING, Ray},
    round::{Round, RoundHit},
};

/// Up to eight discs and spheres: rows with the middles along x, y and z, m; the normals, zero for a
/// sphere; the radii, m, wider by what rounding may do to the middles; and the indices. The middle of
/// an empty place is not a number.
type RoundLeaf = [Row; ROWS];

const ROWS: usize = 8;
const NORMAL: usize = 3;
const RADIUS: usize = 6;
const INDEX: usize = 7;

impl Things for [Round] {
    const IN_LEAF: usize = 8;
    const LEAF_ROWS: usize = ROWS;

    fn extent(&self, index: u32) -> Extent {
        self[index as usize].extent()
    }

    fn leaf(&self, binary: &[Packed], branch: usize, rows: &mut Vec<Row>) -> Child {
        let mut leaf: RoundLeaf = [Row([f32::NAN; 8]); ROWS];
        things_below(binary, branch, &mut |lane, index| {
            let round = &self[index as usize];
            let center = round.center.as_vec3();
            let normal = round.normal.map_or(Vec3::ZERO, |normal| normal.as_vec3());
            for axis in 0..3 {
                leaf[axis].0[lane] = center[axis];
                leaf[NORMAL + axis].0[lane] = normal[axis];
            }
            leaf[RADIUS].0[lane] = round.radius as f32 + ROUNDING * round.reach().element_sum();
            leaf[INDEX].0[lane] = f32::from_bits(index);
        });
        let child = Child::leaf(rows.len());
        rows.extend(leaf);
        child
    }
}

/// Returns a bit mask of those in a leaf that a ray may cross.
#[inline(always)]
fn may_cross(leaf: &RoundLeaf, origin: Vec3A, direction: Vec3A, gather: impl Gather) -> u32 {
    let mut possible = [0; 8];
    let ([ox, oy, oz], [dx, dy, dz]) = (origin.to_array(), direction.to_array());
    let far = ox.abs() + oy.abs() + oz.abs();
    for (i, possible) in possible.iter_mut().enumerate() {
        let (x, y, z) = (leaf[0].0[i] - ox, leaf[1].0[i] - oy, leaf[2].0[i] - oz);
        let [nx, ny, nz] = [0, 1, 2].map(|axis| leaf[NORMAL + axis].0[i]);
        let radius = leaf[RADIUS].0[i];
        let error = ROUNDING * (x.abs() + y.abs() + z.abs() + far + radius);
        // the ball around it
        let along = x * dx + y * dy + z * dz;
        let (ax, ay, az) = (x - along * dx, y - along * dy, z - along * dz);
        let ball = radius + error;
        let by_ball = ax * ax + ay * ay + az * az <= ball * ball;
        // where the ray meets the plane, times the cosine: zero for a sphere
        let (cos, height) = (nx * dx + ny * dy + nz * dz, nx * x + ny * y + nz * z);
        let (bx, by, bz) = (height * dx - cos * x, height * dy - cos * y, height * dz - cos * z);
        let disc = cos.abs() * radius + error;
        let by_plane = bx * bx + by * by + bz * bz <= disc * disc;
        *possible = if by_ball & by_plane { u32::MAX } else { 0 };
    }
    gather(possible)
}

/// The search of [`Bvh::cross_rounds`].
pub(super) struct CrossRounds<'a> {
    pub bvh: &'a Bvh,
    pub rounds: &'a [Round],
    pub ray: &'a Ray,
    pub t_max: f32,
    pub visit: &'a mut dyn FnMut(usize, RoundHit),
}

impl Query for CrossRounds<'_> {
    type Answer = ();

    #[inline(always)]
    fn answer(self, gather: impl Gather) {
        let Self { bvh, rounds, ray, t_max, visit } = self;
        let (origin, direction) = (Vec3A::from(ray.origin), Vec3A::from(ray.direction));
        bvh.walk_leaves(&Slabs::new(origin, direction), t_max, gather, |row, _| {
            let leaf = bvh.round_leaf(row);
            let mut mask = may_cross(leaf, origin, direction, gather);
            while mask != 0 {
                let index = leaf[INDEX].0[mask.trailing_zeros() as usize % 8].to_bits() as usize;
                mask &= mask - 1;
                let hits = rounds[index].crossed(ray, t_max);
                hits.into_iter().flatten().for_each(|hit| visit(index, hit));
            }
            t_max
        });
    }
}

impl Bvh {
    #[inline(always)]
    fn round_leaf(&self, row: usize) -> &RoundLeaf {
        self.rows[row..row + ROWS].try_into().expect("eight")
    }

    /// Visits the index of every disc or sphere of the tree, which holds no triangles, that may reach
    /// into the ball of `radius`, m, around `center`.
    pub fn near_rounds(&self, center: Vec3, radius: f32, mut visit: impl FnMut(usize)) {
        self.near_leaves(center, radius, |row| {
            let leaf = self.round_leaf(row);
            let filled = (0..8).filter(|&i| !leaf[0].0[i].is_nan());
            filled.for_each(|i| visit(leaf[INDEX].0[i].to_bits() as usize));
        });
    }
}
