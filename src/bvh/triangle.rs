//! Ray against triangle: Woop, Benthin and Wald, "Watertight Ray/Triangle Intersection",
//! JCGT 2 (1), 2013.
//!
//! The corners are sheared so that the ray becomes the z axis; the signs of the three edge
//! functions then tell whether the axis passes inside. Two triangles that share an edge compute
//! the same numbers for it with opposite signs, so no ray passes between them. A single-precision
//! edge function has either the exact sign or is zero; double precision decides what is left.

use glam::{DVec2, DVec3, Vec3, Vec4, Vec4Swizzles};

use crate::geometry::Ray;

/// A ray, and what the test needs of it.
pub(super) struct Shear {
    /// The axes of the scene in the order x, y, z of the sheared space; z has the largest
    /// component of the direction.
    axes: [usize; 3],
    /// Origin, in the order of `axes`.
    origin: Vec3,
    /// How far the ray goes along x and y for one step along z, and the inverse z component of the
    /// direction.
    slope: Vec3,
    ray: Ray,
}

/// A hit before its triangle is known: distance and weights of the corners b and c.
pub(super) struct Meeting {
    pub t: f32,
    pub u: f32,
    pub v: f32,
    pub owned: bool,
}

/// Whether a ray that passes through edges of a triangle (those whose function is zero) counts as
/// its own.
#[cold]
#[inline(never)]
fn owns_edges(px: DVec3, py: DVec3, edges: DVec3) -> bool {
    let [a, b, c] = [0, 1, 2].map(|i| DVec2::new(px[i], py[i]));
    let turn = edges.element_sum().signum();
    (edges.x != 0.0 || owns_edge(b, c, turn))
        && (edges.y != 0.0 || owns_edge(c, a, turn))
        && (edges.z != 0.0 || owns_edge(a, b, turn))
}

/// Whether a point on the edge from `p` to `q`, seen along the ray, belongs to the triangle that has
/// it on its left: the triangle on the other side runs along it the other way (the top-left rule of
/// rasterisation).
#[inline(always)]
fn owns_edge(p: DVec2, q: DVec2, turn: f64) -> bool {
    let along = (q - p) * turn;
    along.y < 0.0 || (along.y == 0.0 && along.x > 0.0)
}

impl Shear {
    /// Of a ray, and one over each component of its direction (used only of the largest).
    #[inline(always)]
    pub fn new(ray: &Ray, inverse: [f32; 3]) -> Self {
        let z = main_axis(ray.direction);
        let (x, y) = ([1, 2, 0][z], [2, 0, 1][z]);
        let (o, d) = (ray.origin.to_array(), ray.direction.to_array());
        let slope = Vec3::new(d[x] * inverse[z], d[y] * inverse[z], inverse[z]);
        Self { axes: [x, y, z], origin: Vec3::new(o[x], o[y], o[z]), slope, ray: *ray }
    }

    /// Where the ray meets the triangle with `corners` (rows x, y, z of a, b, c), if 0 < t <=
    /// `limit`.
    #[inline(always)]
    pub fn meet(&self, corners: &[Vec4; 3], limit: f32) -> Option<Meeting> {
        let [x, y, z] = self.axes;
        let depth = corners[z] - Vec4::splat(self.origin.z);
        let px = corners[x] - Vec4::splat(self.origin.x) - self.slope.x * depth;
        let py = corners[y] - Vec4::splat(self.origin.y) - self.slope.y * depth;
        let edges = px.zxyw() * py.yzxw() - py.zxyw() * px.yzxw();
        let (minus, plus) = (edges.cmplt(Vec4::ZERO).bitmask(), edges.cmpgt(Vec4::ZERO).bitmask());
        if minus & 7 != 0 && plus & 7 != 0 {
            return None;
        }
        self.settle(corners, px, py, depth, limit)
    }

    /// Decides in double precision, in which the edge functions have their exact sign.
    #[inline(always)]
    fn settle(
        &self,
        corners: &[Vec4; 3],
        px: Vec4,
        py: Vec4,
        depth: Vec4,
        limit: f32,
    ) -> Option<Meeting> {
        let (px, py) = (px.truncate().as_dvec3(), py.truncate().as_dvec3());
        let u = px.z * py.y - py.z * px.y;
        let v = px.x * py.z - py.x * px.z;
        let w = px.y * py.x - py.y * px.x;
        if (u < 0.0 || v < 0.0 || w < 0.0) && (u > 0.0 || v > 0.0 || w > 0.0) {
            return None;
        }
        let determinant = u + v + w;
        if determinant == 0.0 {
            return None;
        }
        let inverse = 1.0 / determinant;
        let t = self.distance(corners, DVec3::new(u, v, w) * inverse, depth);
        let owned = u * v * w != 0.0 || owns_edges(px, py, DVec3::new(u, v, w));
        let (u, v) = ((v * inverse) as f32, (w * inverse) as f32);
        (t > 0.0 && t <= limit).then_some(Meeting { t, u, v, owned })
    }

    /// Distance to the plane of the triangle, right to the last bit unless the ray grazes it: of
    /// two leaves that nearly touch the front one must be hit. Where the ray grazes, the distance
    /// stays between those of the corners.
    #[inline(always)]
    fn distance(&self, corners: &[Vec4; 3], weights: DVec3, depth: Vec4) -> f32 {
        let corner =
            |i: usize| DVec3::new(corners[0][i].into(), corners[1][i].into(), corners[2][i].into());
        let (a, b, c) = (corner(0), corner(1), corner(2));
        let normal = (b - a).cross(c - a);
        let steepness = normal.dot(self.ray.direction.as_dvec3());
        let depth = depth.truncate() * self.slope.z;
        let (first, last) = (depth.min_element(), depth.max_element());
        let t = if steepness == 0.0 {
            weights.dot(depth.as_dvec3())
        } else {
            normal.dot(a - self.ray.origin.as_dvec3()) / steepness
        };
        (t as f32).max(first).min(last)
    }
}

/// The axis of the largest component of `d`.
#[inline(always)]
pub(super) fn main_axis(d: Vec3) -> usize {
    let [x, y, z] = d.abs().to_array();
    if x > y && x > z { 0 } else { 1 + usize::from(z > y) }
}
