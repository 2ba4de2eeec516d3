//! The intersection test of a ray with eight triangles: Woop, Benthin and Wald, "Watertight
//! Ray/Triangle Intersection", JCGT 2 (1), 2013.
//!
//! The corners are sheared so that the ray becomes the z axis; the signs of the three edge
//! functions then tell whether the axis passes inside. Two triangles that share an edge compute the
//! same numbers for it with opposite signs, so no ray passes between them. A single-precision edge
//! function either has the exact sign or is zero; double precision decides the latter cases.

use glam::{DVec2, DVec3, Vec3, Vec3A};

use super::layout::{Gather, Hit, Row};
use crate::math::geometry::ROUNDING;

/// Up to eight triangles: nine rows with the corners a, b, c along x, along y and along z, m, and a
/// row with the indices of the triangles. An empty place has NaN corners, which no ray meets.
pub(super) type Leaf = [Row; 10];

/// The row of a leaf that holds the indices.
pub(super) const INDICES: usize = 9;

/// Returns corner a (0), b (1) or c (2) of one of a leaf's triangles.
#[inline(always)]
fn corner(leaf: &Leaf, lane: usize, i: usize) -> Vec3 {
    Vec3::new(leaf[i].0[lane], leaf[3 + i].0[lane], leaf[6 + i].0[lane])
}

/// The quantities of a ray that the watertight test of triangles needs.
pub(super) struct Shear {
    /// The axes of the scene that become x, y, z of the sheared space; z is the one with the
    /// largest component of the direction.
    axes: [usize; 3],
    /// Origin of the ray, in the order of `axes`.
    start: [f32; 3],
    /// Distance of the ray along x and along y for one step along z, and the inverse z component of
    /// the direction.
    slope: [f32; 3],
    origin: Vec3A,
    direction: Vec3A,
}

/// A leaf's triangles as the ray sees them, one per lane.
pub(super) struct Sheared {
    /// The corners a, b, c, across the ray.
    x: [[f32; 8]; 3],
    y: [[f32; 8]; 3],
    /// Distances of the nearest and the farthest corner along the ray.
    first: [f32; 8],
    last: [f32; 8],
    /// All ones where single precision suffices to tell that the ray passes inside.
    inside: [u32; 8],
    /// Bit mask of the triangles that the ray may meet.
    pub mask: u32,
}

impl Shear {
    /// Prepares a ray; `inverse` is one over each component of its direction, of which only the
    /// largest component is used.
    #[inline(always)]
    pub fn new(origin: Vec3A, direction: Vec3A, inverse: Vec3A) -> Self {
        let z = main_axis(direction);
        let x = if z == 2 { 0 } else { z + 1 };
        let y = if z == 0 { 2 } else { z - 1 };
        let (o, d, k) = (origin.to_array(), direction.to_array(), inverse.to_array()[z]);
        Self {
            axes: [x, y, z],
            start: [o[x], o[y], o[z]],
            slope: [d[x] * k, d[y] * k, k],
            origin,
            direction,
        }
    }

    /// Shears a leaf's triangles, and finds those that the ray may meet with 0 < t <= `limit`.
    #[inline(always)]
    pub fn apply(&self, leaf: &Leaf, limit: f32, gather: impl Gather) -> Sheared {
        let [x, y, z] = self.axes.map(|axis| [0, 1, 2].map(|corner| &leaf[3 * axis + corner].0));
        let mut s = Sheared {
            x: [[0.0; 8]; 3],
            y: [[0.0; 8]; 3],
            first: [0.0; 8],
            last: [0.0; 8],
            inside: [0; 8],
            mask: 0,
        };
        let mut possible = [0; 8];
        let ones = |yes: bool| if yes { u32::MAX } else { 0 };
        for i in 0..8 {
            let depth = z.map(|z| z[i] - self.start[2]);
            for c in 0..3 {
                s.x[c][i] = x[c][i] - self.start[0] - self.slope[0] * depth[c];
                s.y[c][i] = y[c][i] - self.start[1] - self.slope[1] * depth[c];
            }
            let edge = |p: usize, q: usize| s.x[q][i] * s.y[p][i] - s.y[q][i] * s.x[p][i];
            let edges = [edge(1, 2), edge(2, 0), edge(0, 1)];
            let distances = depth.map(|depth| depth * self.slope[2]);
            (s.first[i], s.last[i]) = (least(distances), most(distances));
            let (low, high) = (least(edges), most(edges));
            s.inside[i] = ones((low > 0.0) | (high < 0.0));
            let outside = (low < 0.0) & (high > 0.0);
            possible[i] = ones(!outside & (s.first[i] <= limit) & (s.last[i] > 0.0));
        }
        s.mask = gather(possible);
        s
    }

    /// Returns the hit of the ray with one of the triangles, if 0 < t <= `limit`. Double precision
    /// gives the edge functions their exact sign.
    #[inline(always)]
    pub fn meet(&self, leaf: &Leaf, s: &Sheared, lane: usize, limit: f32) -> Option<Hit> {
        let x = DVec3::from([0, 1, 2].map(|i| s.x[i][lane].into()));
        let y = DVec3::from([0, 1, 2].map(|i| s.y[i][lane].into()));
        let u = x.z * y.y - y.z * x.y;
        let v = x.x * y.z - y.x * x.z;
        let w = x.y * y.x - y.y * x.x;
        let owned = s.inside[lane] != 0 || owns(x, y, DVec3::new(u, v, w))?;
        let inverse = 1.0 / (u + v + w);
        let (a, b, c) = (corner(leaf, lane, 0), corner(leaf, lane, 1), corner(leaf, lane, 2));
        let (u, v, w) = (u * inverse, v * inverse, w * inverse);
        let [a, b, c] = [a, b, c].map(|corner| corner.as_dvec3());
        let distance = self.distance(a, b, c).unwrap_or_else(|| {
            let z = self.axes[2];
            (u * a[z] + v * b[z] + w * c[z] - f64::from(self.start[2])) * f64::from(self.slope[2])
        });
        // where the ray grazes, t stays between the distances of the corners
        let (first, last) = (s.first[lane], s.last[lane]);
        let t = distance as f32;
        let t = if t > first { t } else { first };
        let t = if t < last { t } else { last };
        // the point where the ray meets the plane; the corners alone say it less well, and only where
        // the ray runs along the plane
        let rounding = ROUNDING * (first.abs() + last.abs() + self.start[2].abs());
        let point = if (t - distance as f32).abs() <= rounding {
            self.origin.as_dvec3() + distance * self.direction.as_dvec3()
        } else {
            u * a + v * b + w * c
        };
        let triangle = leaf[INDICES].0[lane].to_bits();
        let hit = Hit { t, triangle, u: v as f32, v: w as f32, point: point.as_vec3(), owned };
        (t > 0.0 && t <= limit).then_some(hit)
    }

    /// Returns the distance to the plane of a triangle, correct to the last bits unless the ray
    /// grazes the plane: of two leaves that nearly touch, the front one must be hit. `None` if the
    /// ray lies in the plane.
    #[inline(always)]
    fn distance(&self, a: DVec3, b: DVec3, c: DVec3) -> Option<f64> {
        let normal = (b - a).cross(c - a);
        let steepness = normal.dot(self.direction.as_dvec3());
        let t = normal.dot(a - self.origin.as_dvec3()) / steepness;
        (steepness != 0.0).then_some(t)
    }
}

/// Returns whether the edges through which a ray passes (those whose function is zero) belong to
/// the triangle. `None` if a ray near an edge does not meet the triangle.
#[cold]
#[inline(never)]
fn owns(x: DVec3, y: DVec3, edges: DVec3) -> Option<bool> {
    let outside = edges.min_element() < 0.0 && edges.max_element() > 0.0;
    let area = edges.element_sum();
    if outside || area == 0.0 {
        return None;
    }
    let [a, b, c] = [0, 1, 2].map(|i| DVec2::new(x[i], y[i]));
    let turn = area.signum();
    let owns = (edges.x != 0.0 || owns_edge(b, c, turn))
        && (edges.y != 0.0 || owns_edge(c, a, turn))
        && (edges.z != 0.0 || owns_edge(a, b, turn));
    Some(owns)
}

/// Returns whether a point on the edge from `p` to `q`, seen along the ray, belongs to the triangle
/// that has the edge on its left. The triangle on the other side has the same edge in the opposite
/// direction (the top-left rule of rasterisation).
fn owns_edge(p: DVec2, q: DVec2, turn: f64) -> bool {
    let along = (q - p) * turn;
    along.y < 0.0 || (along.y == 0.0 && along.x > 0.0)
}

/// Returns the least number. It uses comparisons, because `f32::min` would also check for NaNs.
#[inline(always)]
fn least([a, b, c]: [f32; 3]) -> f32 {
    let ab = if a < b { a } else { b };
    if ab < c { ab } else { c }
}

#[inline(always)]
fn most([a, b, c]: [f32; 3]) -> f32 {
    let ab = if a > b { a } else { b };
    if ab > c { ab } else { c }
}

/// Returns the axis of the largest component of `d`.
#[inline(always)]
fn main_axis(d: Vec3A) -> usize {
    let [x, y, z] = d.abs().to_array();
    if x > y && x > z { 0 } else { 1 + usize::from(z > y) }
}
