//! Rays, triangles, frames and transforms. Lengths are in metres. Vectors in single precision are
//! relative to the centre of the scene, vectors in double precision to the user's origin.

use std::borrow::Borrow;

use glam::{DMat3, DVec3, Vec2, Vec3};

#[cfg(test)]
mod tests;

/// A half-line: `origin + t direction`, with t > 0 and a `direction` of unit length.
#[derive(Clone, Copy, Debug)]
pub struct Ray {
    /// Start of the ray, m.
    pub origin: Vec3,
    /// Direction of the ray, unit vector.
    pub direction: Vec3,
}

impl Ray {
    /// Returns the point at distance `t`, m.
    pub fn at(&self, t: f32) -> Vec3 {
        self.origin + t * self.direction
    }
}

/// A triangle. Its front is the side from which a, b, c run counter-clockwise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Triangle {
    /// First corner, m.
    pub a: Vec3,
    /// Second corner, m.
    pub b: Vec3,
    /// Third corner, m.
    pub c: Vec3,
}

/// Bound of the relative rounding error of a place that is computed from the corners of a triangle
/// in single precision, and of what lies in it: 16 roundings of 2^-24.
pub const ROUNDING: f32 = 1.0 / (1 << 20) as f32;

/// Bound of the relative rounding error of the start of a ray that leaves a point of a surface: 4
/// roundings of 2^-24, of which the point, computed in double precision, takes one and the step off
/// the surface another (Pharr, Jakob and Humphreys, Physically Based Rendering, 4th ed., 6.8).
pub const POINT: f32 = 1.0 / (1 << 22) as f32;

/// The share of a point's distance that stands for the error of a normal in the error across it.
const NORMAL: f32 = 1.0 / (1 << 16) as f32;

/// Returns how far a point lies from the centre of the scene as its rounding errors across a plane
/// of this unit normal count, m: the error is the product with [`POINT`] or [`ROUNDING`]. Errors
/// along the plane do not count, and neither does the size of what lies in it: a point of a wide
/// floor has no larger error across the floor than a point of a small one at the same height.
#[inline(always)]
pub fn across(normal: Vec3, point: Vec3) -> f32 {
    (normal.abs() + NORMAL).dot(point.abs())
}

/// Distance within which two shapes near a point count as being in one place, m: what rounding of
/// their coordinates and of the numbers in files may put between them.
pub fn closeness(point: Vec3) -> f32 {
    4.0 * ROUNDING * point.length()
}

impl Triangle {
    /// Returns the largest distance of any corner from the centre of the scene along each axis, m.
    pub fn reach(&self) -> Vec3 {
        self.a.abs().max(self.b.abs()).max(self.c.abs())
    }

    /// Returns the distance from the plane of the triangle within which things near `point` count
    /// as lying in it, m.
    pub fn offset_at(&self, point: Vec3) -> f32 {
        ROUNDING * across(self.normal(), point)
    }

    /// Returns the largest of these distances at its points, m.
    pub fn offset(&self) -> f32 {
        self.offset_at(self.reach())
    }

    /// Returns the bound of the error of the triangle's points in any direction, m.
    pub fn blur(&self) -> f32 {
        ROUNDING * 1.1 * self.reach().length()
    }

    /// Returns a vector along the front normal whose length is twice the area, m2.
    pub fn cross(&self) -> Vec3 {
        (self.b - self.a).cross(self.c - self.a)
    }

    /// Returns the area, m2.
    pub fn area(&self) -> f32 {
        0.5 * self.cross().length()
    }

    /// Returns the unit normal of the front; zero for a triangle without area.
    pub fn normal(&self) -> Vec3 {
        let cross = self.cross();
        // the squares of a very small area would vanish
        let tiny = cross.length_squared() < 1e-30;
        if tiny { cross / cross.abs().max_element() } else { cross }.normalize_or_zero()
    }

    /// Returns the mean of the corners.
    pub fn centroid(&self) -> Vec3 {
        (self.a + self.b + self.c) / 3.0
    }

    /// Returns the point a + u (b - a) + v (c - a), rounded once.
    pub fn point(&self, u: f32, v: f32) -> Vec3 {
        self.exact_point(u.into(), v.into()).as_vec3()
    }

    /// Returns the same point in double precision.
    #[inline(always)]
    pub fn exact_point(&self, u: f64, v: f64) -> DVec3 {
        let [a, b, c] = self.exact_corners();
        (1.0 - u - v) * a + u * b + v * c
    }

    fn exact_corners(&self) -> [DVec3; 3] {
        [self.a, self.b, self.c].map(|corner| corner.as_dvec3())
    }

    /// Returns the point of the plane of the triangle that is nearest to `point`.
    pub fn foot(&self, point: DVec3) -> DVec3 {
        let [a, b, c] = self.exact_corners();
        let normal = (b - a).cross(c - a);
        let foot = point - (point - a).dot(normal) / normal.length_squared() * normal;
        if foot.is_finite() { foot } else { point }
    }

    /// Returns the barycentric weights of the corners b and c of the point of the triangle's plane that
    /// is nearest to `point`; 0 for a triangle without area.
    pub fn weights(&self, point: Vec3) -> [f64; 2] {
        let [ab, ac, ap] = [self.b, self.c, point].map(|p| p.as_dvec3() - self.a.as_dvec3());
        let cross = ab.cross(ac);
        let square = cross.length_squared();
        if square == 0.0 {
            return [0.0; 2];
        }
        [ap.cross(ac), ab.cross(ap)].map(|part| part.dot(cross) / square)
    }

    /// Returns how fast the barycentric weight of each corner grows with the distance from the edge
    /// opposite it, 1/m; zero for a triangle without area.
    pub fn slopes(&self) -> Vec3 {
        let double_area = self.cross().length();
        if double_area == 0.0 {
            return Vec3::ZERO;
        }
        let edges = Vec3::new(
            (self.c - self.b).length(),
            (self.a - self.c).length(),
            (self.b - self.a).length(),
        );
        edges / double_area
    }

    /// For a triangle of these slopes, returns the barycentric weights, one per corner, of the
    /// points at `distance` (m) from the edge opposite that corner; at most 1/3, the weight of the
    /// centroid.
    #[inline]
    pub fn margins(slopes: Vec3, distance: f32) -> Vec3 {
        (slopes * distance).min(Vec3::splat(1.0 / 3.0))
    }

    /// Returns the point with the weights `weights` of the corners b and c, rounded. Where it may be
    /// too near to an edge, as its weights are below `margins`, it is moved [off](Self::off_edges).
    #[inline]
    pub fn point_within(
        &self,
        weights: Vec2,
        margins: Vec3,
        apart: impl FnOnce(Vec3) -> f32,
    ) -> Vec3 {
        let point = self.exact_point(weights.x.into(), weights.y.into());
        let near = Vec3::new(1.0 - weights.x - weights.y, weights.x, weights.y).cmplt(margins);
        if near.any() { self.off_edges(point, apart) } else { point.as_vec3() }
    }

    /// Returns a point of the triangle, or a little beside it, rounded. Where it is nearer to an edge
    /// than its error along the triangle and `apart`, m, it is moved to the nearest point that is
    /// not; that distance is at most a third of the altitude, where the centroid is. What counts is
    /// the place of the point: the size of the triangle does not matter.
    #[cold]
    pub fn off_edges(&self, point: DVec3, apart: impl FnOnce(Vec3) -> f32) -> Vec3 {
        let rounded = point.as_vec3();
        let apart = apart(rounded);
        let corners = self.exact_corners();
        let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
        let square = normal.length_squared();
        // the weight of each corner at the point, and the least one
        let [mut weights, mut least] = [[0.0; 3]; 2];
        for i in 0..3 {
            let (p, q) = (corners[(i + 1) % 3], corners[(i + 2) % 3]);
            let inwards = normal.cross(q - p);
            weights[i] = (point - p).dot(inwards) / square;
            let unit = inwards.normalize_or_zero();
            let margin = POINT * unit.as_vec3().abs().dot(rounded.abs()) + apart;
            least[i] = (f64::from(margin) / (corners[i] - p).dot(unit)).min(1.0 / 3.0);
        }
        if square == 0.0 || (0..3).all(|i| weights[i] >= least[i]) {
            return rounded;
        }
        // the points that are far enough from all edges make a triangle. Moved off one edge after the
        // other, a point near an acute corner would come back to the first edge.
        let at = |w: [f64; 3]| w[0] * corners[0] + w[1] * corners[1] + w[2] * corners[2];
        let inner = [0, 1, 2].map(|i| {
            let mut weights = least;
            weights[i] += 1.0 - least.iter().sum::<f64>();
            at(weights)
        });
        let foot = at(weights);
        let on_edge = |i: usize| {
            let (p, along) = (inner[i], inner[(i + 1) % 3] - inner[i]);
            // not a number where the triangle is a point
            let part = (foot - p).dot(along) / along.length_squared();
            let part = if part > 0.0 { part.min(1.0) } else { 0.0 };
            p + part * along
        };
        let nearer = |p: DVec3, q: DVec3| {
            if foot.distance_squared(q) < foot.distance_squared(p) { q } else { p }
        };
        let nearest = nearer(nearer(on_edge(0), on_edge(1)), on_edge(2));
        (point + (nearest - foot)).as_vec3()
    }

    /// Returns whether a ray along `direction` that meets both triangles must meet this one first,
    /// because they share an edge and are folded back there, like the two faces at the outline of a
    /// mesh: the other triangle lies behind the plane of this one. Only the corners decide that;
    /// the exact points near the edge where the ray meets the triangles do not matter.
    pub fn is_before_at_fold(&self, other: &Self, direction: Vec3) -> bool {
        let (mine, theirs) = (self.exact_corners(), other.exact_corners());
        let apex = |of: [DVec3; 3], not: [DVec3; 3]| {
            let mut free = of.into_iter().filter(|corner| !not.contains(corner));
            free.next().filter(|_| free.next().is_none())
        };
        let (Some(my_apex), Some(their_apex)) = (apex(mine, theirs), apex(theirs, mine)) else {
            return false;
        };
        // above 0 on the side of the triangle's plane to which the ray goes
        let behind = |[a, b, c]: [DVec3; 3], point: DVec3| {
            let normal = (b - a).cross(c - a);
            normal.dot(point - a) * normal.dot(direction.as_dvec3())
        };
        // if each lay behind the other, they would lie on either side of the edge
        behind(mine, their_apex) > 0.0 && behind(theirs, my_apex) < 0.0
    }

    /// Returns the distance along a ray at which its line crosses the triangle; it may be negative
    /// (Moeller and Trumbore, Journal of Graphics Tools 2:21, 1997).
    pub fn crossed_at(&self, ray: &Ray) -> Option<f32> {
        let [a, b, c] = self.exact_corners();
        let (origin, direction) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
        let (u, v) = (b - a, c - a);
        let across = direction.cross(v);
        let det = u.dot(across);
        if det == 0.0 {
            return None;
        }
        let off = origin - a;
        let (x, lift) = (off.dot(across) / det, off.cross(u));
        let y = direction.dot(lift) / det;
        let inside = x >= 0.0 && y >= 0.0 && x + y <= 1.0;
        inside.then(|| (v.dot(lift) / det) as f32)
    }

    /// Returns the point of the triangle nearest to `p` (Ericson, Real-Time Collision Detection,
    /// 5.1.5).
    pub fn nearest_point(&self, p: Vec3) -> Vec3 {
        let (ab, ac, ap) = (self.b - self.a, self.c - self.a, p - self.a);
        let (d1, d2) = (ab.dot(ap), ac.dot(ap));
        if d1 <= 0.0 && d2 <= 0.0 {
            return self.a;
        }
        let bp = p - self.b;
        let (d3, d4) = (ab.dot(bp), ac.dot(bp));
        if d3 >= 0.0 && d4 <= d3 {
            return self.b;
        }
        let vc = d1 * d4 - d3 * d2;
        if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
            return self.a + d1 / (d1 - d3) * ab;
        }
        let cp = p - self.c;
        let (d5, d6) = (ab.dot(cp), ac.dot(cp));
        if d6 >= 0.0 && d5 <= d6 {
            return self.c;
        }
        let vb = d5 * d2 - d1 * d6;
        if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
            return self.a + d2 / (d2 - d6) * ac;
        }
        let va = d3 * d6 - d5 * d4;
        if va <= 0.0 && d4 >= d3 && d5 >= d6 {
            return self.b + (d4 - d3) / ((d4 - d3) + (d5 - d6)) * (self.c - self.b);
        }
        let denominator = va + vb + vc;
        self.a + vb / denominator * ab + vc / denominator * ac
    }

    /// Returns the area of the part of the triangle inside the ball of `radius` around `center`,
    /// m2. It is exact: the ball cuts a disc out of the plane, and each edge contributes its sector
    /// or triangle.
    pub fn area_in_ball(&self, center: Vec3, radius: f32) -> f32 {
        let frame = Frame::new(self.normal());
        let height = frame.normal.dot(self.a - center);
        let r2 = radius * radius - height * height;
        if r2 <= 0.0 {
            return 0.0;
        }
        let flat = |p: Vec3| {
            let d = p - center;
            Vec2::new(d.dot(frame.tangent), d.dot(frame.bitangent))
        };
        let corners = [flat(self.a), flat(self.b), flat(self.c)];
        let area: f32 = (0..3).map(|i| edge_in_disc(corners[i], corners[(i + 1) % 3], r2)).sum();
        area.abs()
    }
}

impl From<[Vec3; 3]> for Triangle {
    fn from([a, b, c]: [Vec3; 3]) -> Self {
        Self { a, b, c }
    }
}

/// Returns the signed area between the origin and the edge p-q, within the disc of squared radius
/// `r2`.
fn edge_in_disc(p: Vec2, q: Vec2, r2: f32) -> f32 {
    let edge = q - p;
    let length2 = edge.length_squared();
    if length2 == 0.0 {
        return 0.0;
    }
    let sector = |u: Vec2, v: Vec2| 0.5 * r2 * u.perp_dot(v).atan2(u.dot(v));
    // where the line of the edge enters and leaves the disc, as fractions of the edge
    let middle = -p.dot(edge) / length2;
    let half2 = (r2 - (p + middle * edge).length_squared()) / length2;
    if half2 <= 0.0 {
        return sector(p, q);
    }
    let half = half2.sqrt();
    let (enter, leave) = ((middle - half).max(0.0), (middle + half).min(1.0));
    if enter >= leave {
        return sector(p, q);
    }
    let (inner_p, inner_q) = (p + enter * edge, p + leave * edge);
    let mut area = 0.5 * inner_p.perp_dot(inner_q);
    if enter > 0.0 {
        area += sector(p, inner_p);
    }
    if leave < 1.0 {
        area += sector(inner_q, q);
    }
    area
}

/// An axis-aligned box.
#[derive(Clone, Copy, Debug)]
pub struct Extent {
    /// Lowest coordinates, m.
    pub min: Vec3,
    /// Highest coordinates, m.
    pub max: Vec3,
}

impl Extent {
    /// The empty box; joined with another box it leaves that one unchanged.
    pub const EMPTY: Self = Self { min: Vec3::INFINITY, max: Vec3::NEG_INFINITY };

    /// Returns the smallest box around `points`.
    pub fn of(points: impl IntoIterator<Item = Vec3>) -> Self {
        points.into_iter().fold(Self::EMPTY, |e, p| Self { min: e.min.min(p), max: e.max.max(p) })
    }

    /// Returns the smallest box around `triangles`.
    pub fn of_triangles(triangles: impl IntoIterator<Item: Borrow<Triangle>>) -> Self {
        let corners = |t: &Triangle| [t.a, t.b, t.c];
        Self::of(triangles.into_iter().flat_map(|triangle| corners(triangle.borrow())))
    }

    /// Returns the eight corners.
    pub fn corners(&self) -> [Vec3; 8] {
        std::array::from_fn(|corner| {
            let side =
                |axis: usize| if corner >> axis & 1 == 0 { self.min } else { self.max }[axis];
            Vec3::new(side(0), side(1), side(2))
        })
    }

    /// Returns the smallest box around both boxes.
    pub fn join(self, other: Self) -> Self {
        Self { min: self.min.min(other.min), max: self.max.max(other.max) }
    }

    /// Returns the box that is wider by `margin`, m, on all sides.
    pub fn wider(self, margin: f32) -> Self {
        Self { min: self.min - margin, max: self.max + margin }
    }

    /// Returns whether a point lies in the box.
    pub fn holds(&self, point: Vec3) -> bool {
        point.cmpge(self.min).all() && point.cmple(self.max).all()
    }

    /// Returns whether a ray meets the box or starts in it (Kay and Kajiya, SIGGRAPH 1986).
    pub fn is_met(&self, ray: &Ray) -> bool {
        let along = ray.direction.recip();
        let [a, b] = [self.min, self.max].map(|side| (side - ray.origin) * along);
        let (enters, leaves) = (a.min(b).max_element(), a.max(b).min_element());
        enters <= leaves && leaves >= 0.0
    }

    /// Returns the lengths of the sides, m; zero for the empty box.
    pub fn size(&self) -> Vec3 {
        (self.max - self.min).max(Vec3::ZERO)
    }

    /// Returns half of the surface area, m2.
    pub fn half_area(&self) -> f32 {
        let size = self.size();
        size.x * size.y + size.y * size.z + size.z * size.x
    }

    /// Returns the centre of the box.
    pub fn center(&self) -> Vec3 {
        0.5 * (self.min + self.max)
    }

    /// Returns whether the two boxes are farther apart than `gap`, m, along some axis.
    pub fn is_clear_of(&self, other: &Self, gap: f32) -> bool {
        let gap = Vec3::splat(gap);
        (self.min - gap).cmpgt(other.max).any() || (other.min - gap).cmpgt(self.max).any()
    }
}

/// A right-handed orthonormal frame around a normal.
#[derive(Clone, Copy, Debug)]
pub struct Frame {
    /// First axis across the normal.
    pub tangent: Vec3,
    /// Second axis across the normal.
    pub bitangent: Vec3,
    /// Third axis, along the normal.
    pub normal: Vec3,
}

impl Frame {
    /// Returns the frame whose z axis is the unit vector `normal` (Duff et al., JCGT 6 (1), 2017).
    #[inline]
    pub fn new(normal: Vec3) -> Self {
        let sign = 1f32.copysign(normal.z);
        let a = -1.0 / (sign + normal.z);
        let b = normal.x * normal.y * a;
        Self {
            tangent: Vec3::new(1.0 + sign * normal.x * normal.x * a, sign * b, -sign * normal.x),
            bitangent: Vec3::new(b, sign + normal.y * normal.y * a, -normal.y),
            normal,
        }
    }

    /// Turns a vector from the frame's coordinates to those of the scene.
    #[inline]
    pub fn to_world(&self, v: Vec3) -> Vec3 {
        v.x * self.tangent + v.y * self.bitangent + v.z * self.normal
    }
}

/// Returns the direction of `v`; `None` where `v` has no length or is not finite. Squares of the
/// components neither overflow nor vanish.
pub fn unit_vector(v: DVec3) -> Option<DVec3> {
    (v / v.abs().max_element()).try_normalize()
}

/// A transform: scaling, then rotation about x, then y, then z, then translation.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Transform {
    linear: DMat3,
    translate: DVec3,
}

impl Transform {
    /// Makes the transform of a positive `scale`, angles in degrees and a translation in metres.
    pub fn new(scale: f64, rotate_deg: DVec3, translate: DVec3) -> Self {
        let r = DVec3::new(
            rotate_deg.x.to_radians(),
            rotate_deg.y.to_radians(),
            rotate_deg.z.to_radians(),
        );
        let rotation =
            DMat3::from_rotation_z(r.z) * DMat3::from_rotation_y(r.y) * DMat3::from_rotation_x(r.x);
        Self { linear: rotation * scale, translate }
    }

    /// Makes the transform p -> `linear` p + `translate`, m.
    pub fn of_matrix(linear: DMat3, translate: DVec3) -> Self {
        Self { linear, translate }
    }

    /// Returns whether the transform turns what it moves inside out.
    pub fn is_mirrored(&self) -> bool {
        self.linear.determinant() < 0.0
    }

    /// Returns the transformed point, m.
    pub fn point(&self, p: DVec3) -> DVec3 {
        self.linear * p + self.translate
    }

    /// Returns a vector rotated and scaled by the transform, but not translated.
    pub fn turned(&self, v: DVec3) -> DVec3 {
        self.linear * v
    }

    /// Returns whether two transforms turn and mirror vectors alike, whatever their scales.
    pub fn turns_like(&self, other: &Self) -> bool {
        let turned = |transform: &Self, axis: DVec3| transform.turned(axis).normalize_or_zero();
        DMat3::IDENTITY
            .to_cols_array_2d()
            .map(DVec3::from)
            .into_iter()
            .all(|axis| turned(self, axis).distance_squared(turned(other, axis)) < 1e-18)
    }

    /// Returns the inverse transform; not finite where the scale is too small for a number.
    pub fn inverse(&self) -> Self {
        let linear = self.linear.inverse();
        Self { linear, translate: -(linear * self.translate) }
    }

    /// Returns the transform that applies `first`, then `self`.
    pub fn after(&self, first: &Self) -> Self {
        Self { linear: self.linear * first.linear, translate: self.point(first.translate) }
    }
}

/// Returns the area of a triangle, m2.
pub fn area([a, b, c]: &[DVec3; 3]) -> f64 {
    0.5 * (*b - *a).cross(*c - *a).length()
}

/// Returns twice the vector area of a polygon (Newell), which is robust for collinear corners and
/// slightly bent outlines. It is computed relative to the first corner, as otherwise nothing would
/// be left of a small polygon far from the origin.
fn newell(polygon: &[DVec3]) -> DVec3 {
    let n = polygon.len();
    let from_first = |i: usize| polygon[i % n] - polygon[0];
    (1..n).map(|i| from_first(i).cross(from_first(i + 1))).sum()
}

/// Cuts a planar polygon, convex or not, into triangles (corner indices, same orientation). A
/// convex polygon becomes a fan. Where no further ear can be cut, the triangles cut so far are
/// returned.
pub fn triangulate(polygon: &[DVec3]) -> Vec<[usize; 3]> {
    let fan = || (1..polygon.len().saturating_sub(1)).map(|i| [0, i, i + 1]).collect();
    let n = polygon.len();
    let normal = newell(polygon);
    let convex = (0..n).all(|i| {
        let (p, q, r) = (polygon[i], polygon[(i + 1) % n], polygon[(i + 2) % n]);
        (q - p).cross(r - q).dot(normal) >= 0.0
    });
    if n <= 3 || convex || normal.length_squared() == 0.0 {
        return fan();
    }
    let z = normal.normalize();
    let (x, y) = z.any_orthonormal_pair();
    let flat = polygon.iter().map(|p| p - polygon[0]).map(|p| [p.dot(x), p.dot(y)]);
    let mut corners: Vec<usize> = Vec::new();
    earcut::Earcut::new().earcut(flat, &[], &mut corners);
    let mut triangles: Vec<[usize; 3]> = corners.as_chunks::<3>().0.to_vec();
    for t in &mut triangles {
        let [p, q, r] = t.map(|i| polygon[i]);
        if (q - p).cross(r - p).dot(normal) < 0.0 {
            t.swap(1, 2);
        }
    }
    triangles
}

/// Returns whether a corner of the polygon is off its mean plane by more than a hundredth of its
/// size, the largest distance of a corner from the middle. Such a polygon has more than one
/// possible surface.
pub fn is_bent(polygon: &[DVec3]) -> bool {
    let Some(normal) = newell(polygon).try_normalize() else { return false };
    let middle = polygon.iter().sum::<DVec3>() / polygon.len() as f64;
    let from_middle = || polygon.iter().map(|corner| corner - middle);
    let size = from_middle().map(DVec3::length).fold(0.0, f64::max);
    from_middle().any(|corner| corner.dot(normal).abs() > 0.01 * size)
}

/// Returns whether the `triangles` of [`triangulate`] do not cover the polygon exactly once. Seen
/// along its normal, their areas add up to that of the polygon, unless its outline crosses itself.
pub fn is_tangled(polygon: &[DVec3], triangles: &[[usize; 3]]) -> bool {
    let whole = newell(polygon);
    let area = |t: &[usize; 3]| {
        let cross = newell(&t.map(|i| polygon[i]));
        whole.try_normalize().map_or(cross.length(), |normal| cross.dot(normal).abs())
    };
    let covered: f64 = triangles.iter().map(area).sum();
    let n = polygon.len();
    let edges: f64 = (0..n).map(|i| polygon[i].distance_squared(polygon[(i + 1) % n])).sum();
    (covered - whole.length()).abs() > 1e-6 * whole.length() + 1e-12 * edges
}
