//! Discs and spheres, which rays meet as they are.

use std::f64::consts::{PI, TAU};

use glam::{DVec3, Vec2, Vec3};

use crate::math::{
    geometry::{Extent, Ray, area},
    sampling::uniform_circle,
};

/// A disc or a sphere.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Round {
    /// Middle, m.
    pub center: DVec3,
    /// Radius, m, above 0.
    pub radius: f64,
    /// Unit normal of the front of a disc; `None` for a sphere, whose front is its outside.
    pub normal: Option<DVec3>,
}

/// The place where a ray crosses a [`Round`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RoundHit {
    /// Distance along the ray, m, > 0.
    pub t: f32,
    /// Whether the ray goes against the normal, and so arrives at the front.
    pub front: bool,
    /// The point, m.
    pub point: Vec3,
}

/// Number of triangles by which a disc is shown.
const DISC_TRIANGLES: usize = 32;
/// Number of segments that each edge of an octahedron is cut into to show a sphere.
const SPHERE_CUTS: usize = 16;

impl Round {
    /// Makes a disc whose front is on the side that the unit vector `normal` points to.
    pub fn disc(center: DVec3, normal: DVec3, radius: f64) -> Self {
        Self { center, radius, normal: Some(normal) }
    }

    /// Makes a sphere.
    pub fn sphere(center: DVec3, radius: f64) -> Self {
        Self { center, radius, normal: None }
    }

    /// Returns the area of the front, m2: of a sphere four times that of its cross-section.
    pub fn area(&self) -> f64 {
        let cross_section = PI * self.radius * self.radius;
        if self.normal.is_some() { cross_section } else { 4.0 * cross_section }
    }

    /// Returns the same shape elsewhere.
    pub fn moved(&self, by: DVec3) -> Self {
        Self { center: self.center + by, ..*self }
    }

    /// Returns half the sides of the smallest box around it, m.
    fn half(&self) -> DVec3 {
        let across = |normal: DVec3| (1.0 - normal * normal).max(DVec3::ZERO).map(f64::sqrt);
        self.radius * self.normal.map_or(DVec3::ONE, across)
    }

    /// Returns the corners of the smallest box around it, m.
    pub fn corners(&self) -> [DVec3; 8] {
        let half = self.half();
        std::array::from_fn(|corner| {
            let sign = |axis: usize| if corner >> axis & 1 == 0 { -1.0 } else { 1.0 };
            self.center + half * DVec3::new(sign(0), sign(1), sign(2))
        })
    }

    /// Returns the smallest box around it, m, rounded.
    pub fn extent(&self) -> Extent {
        let (low, high) = (self.center - self.half(), self.center + self.half());
        Extent { min: low.as_vec3(), max: high.as_vec3() }
    }

    /// Returns the largest distance of any of its points from the origin along each axis, m.
    pub fn reach(&self) -> Vec3 {
        (self.center.abs() + self.half()).as_vec3()
    }

    /// Returns the unit normal of the front at one of its points.
    #[inline]
    pub fn normal_at(&self, point: Vec3) -> Vec3 {
        let outward = || (point.as_dvec3() - self.center).normalize_or(DVec3::Z);
        self.normal.unwrap_or_else(outward).as_vec3()
    }

    /// Returns the point that two numbers in [0, 1] choose. Uniform numbers choose points uniform over
    /// the area.
    pub fn point(&self, u: Vec2) -> DVec3 {
        let (share, turn) = (f64::from(u.x), uniform_circle(u.y).as_dvec2());
        let out = match self.normal {
            Some(normal) => {
                let (x, y) = normal.any_orthonormal_pair();
                share.sqrt() * (turn.x * x + turn.y * y)
            }
            // areas between planes are as their distances (Archimedes)
            None => {
                let out = (share * (1.0 - share)).sqrt() * turn;
                out.extend(0.5 - share).normalize()
            }
        };
        self.center + self.radius * out
    }

    /// Returns where a ray crosses it before `t_max`: a disc at most once, a sphere where the ray comes
    /// in and where it leaves.
    #[inline]
    pub fn crossed(&self, ray: &Ray, t_max: f32) -> [Option<RoundHit>; 2] {
        let (origin, direction) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
        let to = self.center - origin;
        let hit = |t: f64, front: bool| {
            let point = (origin + t * direction).as_vec3();
            let t = t as f32;
            (t > 0.0 && t < t_max).then_some(RoundHit { t, front, point })
        };
        let square = self.radius * self.radius;
        let Some(normal) = self.normal else {
            // the way from the middle to the line: no large squares are subtracted (Haines et al.,
            // "Precision Improvements for Ray/Sphere Intersection", Ray Tracing Gems, 2019, ch. 7)
            let steps = direction.length_squared();
            let along = to.dot(direction);
            let off = along / steps * direction - to;
            let half = square - off.length_squared();
            if half < 0.0 {
                return [None; 2];
            }
            let far = along + (steps * half).sqrt().copysign(along);
            let [a, b] = [(to.length_squared() - square) / far, far / steps];
            return [hit(a.min(b), true), hit(a.max(b), false)];
        };
        let cos = direction.dot(normal);
        let t = to.dot(normal) / cos;
        let within = (t * direction - to).length_squared() <= square;
        // a ray in the plane crosses nothing: t is no finite number
        [if within { hit(t, cos < 0.0) } else { None }, None]
    }

    /// Returns triangles that show it, of its area, with the same front. Those of a disc are a fan; those
    /// of a sphere have corners on a sphere that is a little larger.
    pub fn triangles(&self) -> Vec<[DVec3; 3]> {
        match self.normal {
            Some(normal) => fan(self.center, normal, self.radius),
            None => octahedron(self.center, self.radius),
        }
    }

    /// Returns the number of these triangles.
    pub fn shown_by(&self) -> usize {
        if self.normal.is_some() { DISC_TRIANGLES } else { 8 * SPHERE_CUTS * SPHERE_CUTS }
    }
}

/// Makes a fan of triangles with the area of the disc.
fn fan(center: DVec3, normal: DVec3, radius: f64) -> Vec<[DVec3; 3]> {
    let (x, y) = normal.any_orthonormal_pair();
    let n = DISC_TRIANGLES as f64;
    let rim = radius * (TAU / n / (TAU / n).sin()).sqrt();
    let corner = |i: usize| {
        let (sin, cos) = (TAU * (i % DISC_TRIANGLES) as f64 / n).sin_cos();
        center + rim * (cos * x + sin * y)
    };
    (0..DISC_TRIANGLES).map(|i| [center, corner(i), corner(i + 1)]).collect()
}

/// Makes an octahedron whose faces are cut into triangles with corners on a sphere and normals out.
/// Their total area is four times that of the wanted sphere's cross-section: then their mean
/// cross-section is that of the sphere, too (Cauchy).
fn octahedron(center: DVec3, radius: f64) -> Vec<[DVec3; 3]> {
    let n = SPHERE_CUTS;
    let mut triangles = Vec::with_capacity(8 * n * n);
    for octant in 0..8 {
        let sign = |axis: usize| if octant >> axis & 1 == 0 { 1.0 } else { -1.0 };
        let signs = DVec3::new(sign(0), sign(1), sign(2));
        let corner = |i: usize, j: usize| {
            (DVec3::new((n - i - j) as f64, i as f64, j as f64).normalize()) * signs
        };
        let mut add = |a: DVec3, b: DVec3, c: DVec3| {
            let outward = (b - a).cross(c - a).dot(a) > 0.0;
            triangles.push(if outward { [a, b, c] } else { [a, c, b] });
        };
        for (i, j) in (0..n).flat_map(|i| (0..n - i).map(move |j| (i, j))) {
            add(corner(i, j), corner(i + 1, j), corner(i, j + 1));
            if i + j + 1 < n {
                add(corner(i + 1, j), corner(i + 1, j + 1), corner(i, j + 1));
            }
        }
    }
    let total: f64 = triangles.iter().map(area).sum();
    let scale = radius * (4.0 * PI / total).sqrt();
    triangles.iter().map(|triangle| triangle.map(|p| center + scale * p)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::rng::Stream;

    const NORMALS: [DVec3; 3] = [DVec3::Z, DVec3::NEG_Z, DVec3::new(0.48, -0.6, 0.64)];

    /// The triangles of a sphere have its area, all their normals point out, and their outline from any
    /// side has the circle's area to 0.2 %.
    #[test]
    fn a_sphere_is_shown_round() {
        let center = DVec3::new(1.0, -2.0, 3.0);
        let sphere = Round::sphere(center, 0.5);
        let triangles = sphere.triangles();
        assert_eq!(triangles.len(), sphere.shown_by());
        let total: f64 = triangles.iter().map(area).sum();
        assert!((total - PI).abs() < 1e-12 && (sphere.area() - PI).abs() < 1e-15);
        let vectors = triangles.iter().map(|[a, b, c]| (*a, 0.5 * (b - a).cross(c - a)));
        assert!(vectors.clone().all(|(a, vector)| (a - center).dot(vector) > 0.0));
        for from in [DVec3::X, DVec3::ONE, DVec3::new(1.0, 1.0, 0.0), DVec3::new(3.0, -1.0, 0.5)] {
            let from = from.normalize();
            let seen: f64 = vectors.clone().map(|(_, vector)| vector.dot(from).max(0.0)).sum();
            assert!((seen / (0.25 * PI) - 1.0).abs() < 2e-3, "{seen}");
        }
    }

    #[test]
    fn a_disc_is_shown_with_its_area_and_front() {
        for normal in NORMALS {
            let disc = Round::disc(DVec3::new(3.0, 2.0, 1.0), normal, 0.4);
            let triangles = disc.triangles();
            assert_eq!(triangles.len(), disc.shown_by());
            let total: f64 = triangles.iter().map(area).sum();
            assert!((total - PI * 0.16).abs() < 1e-12 && (disc.area() - PI * 0.16).abs() < 1e-15);
            assert!(triangles.iter().all(|[a, b, c]| (b - a).cross(c - a).dot(normal) > 0.0));
        }
    }

    /// A ray towards a point inside the rim crosses a disc there, one towards a point outside does not,
    /// and a sphere is crossed twice, at points of its surface. From near by, and from a place a million
    /// radii away, as exactly as the single precision of the ray allows.
    #[test]
    fn rays_cross_what_they_are_aimed_at() {
        let mut rng = Stream::new(1, 0, 0);
        let center = DVec3::new(0.2, -0.1, 0.3);
        let discs = NORMALS.map(|normal| Round::disc(center, normal, 0.05));
        for round in discs.into_iter().chain([Round::sphere(center, 0.05)]) {
            for far in [0.2, 3.0, 500.0] {
                let mut crossed = 0;
                for _ in 0..2_000 {
                    let away = Round::sphere(DVec3::ZERO, far).point(rng.square());
                    let origin = (round.center + away).as_vec3();
                    let within = rng.uniform() < 0.5;
                    let share = if within { 0.98 } else { 1.02 };
                    let rim = Vec2::new(1.0, rng.uniform());
                    let across = round
                        .normal
                        .unwrap_or_else(|| (origin.as_dvec3() - round.center).normalize());
                    let size = match round.normal {
                        // the outline of a sphere is a cone of this radius at its middle
                        None => 0.05 / (1.0 - (0.05 / away.length()).powi(2)).sqrt(),
                        Some(_) => 0.05,
                    };
                    let target = Round::disc(round.center, across, share * size).point(rim);
                    let direction = (target - origin.as_dvec3()).normalize().as_vec3();
                    // the rounding of the direction, and of the cosine where the ray grazes a disc
                    let cos = across.as_vec3().dot(direction).abs();
                    if 3e-7 * far as f32 > 0.02 * 0.05 * cos * 0.5 {
                        continue;
                    }
                    let hits = round.crossed(&Ray { origin, direction }, f32::INFINITY);
                    assert_eq!(hits[0].is_some(), within, "{round:?} from {far}");
                    assert_eq!(hits[1].is_some(), within && round.normal.is_none());
                    for hit in hits.into_iter().flatten() {
                        crossed += 1;
                        let off = (hit.point.as_dvec3() - round.center).length() - 0.05;
                        assert!(if round.normal.is_some() { off < 0.0 } else { off.abs() < 1e-7 });
                        let facing = round.normal_at(hit.point).dot(direction) < 0.0;
                        assert_eq!(facing, hit.front);
                    }
                }
                assert!(crossed > 100 || far > 100.0, "{crossed}");
            }
        }
    }

    /// Of a sphere around it a ray meets the inside alone; before its limit, and not behind it.
    #[test]
    fn a_ray_leaves_a_sphere_that_it_starts_in() {
        let sphere = Round::sphere(DVec3::ZERO, 2.0);
        let ray = Ray { origin: Vec3::new(0.0, 0.0, 0.5), direction: Vec3::Z };
        let [entry, exit] = sphere.crossed(&ray, f32::INFINITY);
        assert_eq!(entry, None);
        assert_eq!(exit, Some(RoundHit { t: 1.5, front: false, point: 2.0 * Vec3::Z }));
        assert_eq!(sphere.crossed(&ray, 1.5), [None; 2]);
        let away = Ray { origin: Vec3::new(0.0, 0.0, 2.5), direction: Vec3::Z };
        assert_eq!(sphere.crossed(&away, f32::INFINITY), [None; 2]);
    }

    /// Points are uniform: as many in each of 8 rings or zones of equal area by 8 sectors, all on the
    /// shape, and within the box around it.
    #[test]
    fn points_are_uniform() {
        for round in [Round::disc(DVec3::ONE, NORMALS[2], 0.3), Round::sphere(DVec3::ONE, 0.3)] {
            let extent = round.extent();
            let (mut counts, mut rng) = ([0u32; 64], Stream::new(1, 0, 0));
            for _ in 0..64_000 {
                let point = round.point(rng.square());
                let out = (point - DVec3::ONE) / 0.3;
                assert!(extent.wider(1e-6).holds(point.as_vec3()));
                let (x, y) = round.normal.unwrap_or(DVec3::Z).any_orthonormal_pair();
                let ring = match round.normal {
                    Some(normal) => {
                        assert!(out.dot(normal).abs() < 1e-12);
                        out.length_squared()
                    }
                    None => {
                        assert!((out.length() - 1.0).abs() < 1e-12);
                        0.5 * (1.0 + out.z)
                    }
                };
                let sector = out.dot(y).atan2(out.dot(x)) / TAU + 0.5;
                let bin = |share: f64| ((8.0 * share) as usize).min(7);
                counts[8 * bin(ring) + bin(sector)] += 1;
            }
            let chi2: f64 = counts.iter().map(|&n| (f64::from(n) - 1000.0).powi(2) / 1000.0).sum();
            // 63 degrees of freedom: beyond 130 once in a million
            assert!(chi2 < 130.0, "{round:?}: {chi2}");
        }
    }
}
