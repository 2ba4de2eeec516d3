//! Triangles, frames, transforms and polygons against brute force and closed forms.

use std::f32::consts::PI;

use glam::DVec2;

use super::*;
use crate::math::rng::Stream;

fn cube(rng: &mut Stream) -> Vec3 {
    Vec3::new(rng.uniform(), rng.uniform(), rng.uniform()) * 2.0 - 1.0
}

fn triangle(rng: &mut Stream) -> Triangle {
    Triangle { a: cube(rng), b: cube(rng), c: cube(rng) }
}

/// Computes the area in double precision: the length of the triangle's chord inside the disc, over
/// 4000 lines across it.
fn area_by_lines(t: &Triangle, center: Vec3, radius: f32) -> f64 {
    const LINES: usize = 4_000;
    let [a, b, c] = [t.a, t.b, t.c].map(|p| (p - center).as_dvec3());
    let normal = (b - a).cross(c - a).normalize();
    let (x, y) = normal.any_orthonormal_pair();
    let r2 = f64::from(radius).powi(2) - a.dot(normal).powi(2);
    if r2 <= 0.0 {
        return 0.0;
    }
    let flat = [a, b, c].map(|p| DVec2::new(p.dot(x), p.dot(y)));
    let bottom = flat.iter().map(|p| p.y).fold(f64::INFINITY, f64::min).max(-r2.sqrt());
    let top = flat.iter().map(|p| p.y).fold(f64::NEG_INFINITY, f64::max).min(r2.sqrt());
    if bottom >= top {
        return 0.0;
    }
    let step = (top - bottom) / LINES as f64;
    let chord = |i: usize| {
        let y = bottom + (i as f64 + 0.5) * step;
        let (mut left, mut right) = (f64::INFINITY, f64::NEG_INFINITY);
        for e in 0..3 {
            let (p, q) = (flat[e], flat[(e + 1) % 3]);
            if (p.y <= y) != (q.y <= y) {
                let x = p.x + (q.x - p.x) * (y - p.y) / (q.y - p.y);
                (left, right) = (left.min(x), right.max(x));
            }
        }
        let half = (r2 - y * y).max(0.0).sqrt();
        (right.min(half) - left.max(-half)).max(0.0)
    };
    (0..LINES).map(chord).sum::<f64>() * step
}

/// 4000 triangles of size 1, seed 1; balls around points inside, at corners, on edges, off the
/// plane and away, with radii of 0.003 to 6. Tolerance: 1e-6 of the squared distances that are
/// summed, and 1e-4 of the area (because of the lines).
#[test]
fn area_in_ball_is_exact() {
    let mut rng = Stream::new(1, 0, 0);
    for i in 0..4_000 {
        let t = triangle(&mut rng);
        if t.area() < 0.01 {
            continue;
        }
        let (u, v) = (rng.uniform(), rng.uniform());
        let center = match i % 5 {
            0 => t.point(0.5 * u, 0.5 * v),
            1 => [t.a, t.b, t.c][(3.0 * u) as usize],
            2 => t.a.lerp(t.b, u),
            3 => t.point(0.5 * u, 0.5 * v) + 0.2 * v * t.normal(),
            _ => 2.0 * cube(&mut rng),
        };
        let radius = 0.003 * 2_000f32.powf(rng.uniform());
        let (found, exact) =
            (f64::from(t.area_in_ball(center, radius)), area_by_lines(&t, center, radius));
        let far = [t.a, t.b, t.c].map(|p| p.distance(center)).into_iter().fold(0.0, f32::max);
        let tolerance = 1e-6 * f64::from(far.min(radius).powi(2)) + 1e-4 * exact + 1e-9;
        assert!(
            (found - exact).abs() < tolerance,
            "{i}: {found}, not {exact}: {t:?} {center} {radius}"
        );
        assert!(found >= 0.0 && found <= f64::from(t.area()) * (1.0 + 1e-5));
    }
}

/// To 1e-5 of the area, and to 5e-7 of the squared radius where nearly nothing is cut.
#[test]
fn area_in_ball_has_closed_forms() {
    let side = 3f32.sqrt();
    let t = Triangle {
        a: Vec3::new(0.0, 0.0, 1.0),
        b: Vec3::new(2.0, 0.0, 1.0),
        c: Vec3::new(1.0, side, 1.0),
    };
    let middle = t.centroid();
    let off = Vec3::new(0.0, 0.0, 0.3);
    let segment = |r: f32, d: f32| r * r * (d / r).acos() - d * (r * r - d * d).sqrt();
    let inradius = 1.0 / side;
    let cases = [
        ("whole", middle, 5.0, side),
        ("whole, centre off the plane", middle + 7.0 * off, 5.0, side),
        ("whole, centre outside", middle + Vec3::new(3.0, 1.0, 0.0), 9.0, side),
        ("disc", middle, 0.3, PI * 0.09),
        ("disc off the plane", middle + off, 0.5, PI * 0.16),
        ("half a disc on an edge", Vec3::new(1.0, 0.0, 1.0), 0.3, PI * 0.045),
        ("a sixth in a corner", t.a, 0.3, PI * 0.015),
        ("three segments beyond", middle, 0.8, PI * 0.64 - 3.0 * segment(0.8, inradius)),
        ("a segment", Vec3::new(1.0, -0.2, 1.0), 0.3, segment(0.3, 0.2)),
        ("beside", Vec3::new(-1.0, -1.0, 1.0), 1.0, 0.0),
        ("below", middle - Vec3::Z, 0.999, 0.0),
        ("touching", middle - Vec3::Z, 1.0, 0.0),
        ("empty", middle, 0.0, 0.0),
    ];
    let flipped = Triangle { a: t.a, b: t.c, c: t.b };
    for (what, center, radius, exact) in cases {
        for t in [&t, &flipped] {
            let found = t.area_in_ball(center, radius);
            assert!((found - exact).abs() <= 1e-5 * exact + 5e-7, "{what}: {found}, not {exact}");
        }
    }
    let line = Triangle { a: Vec3::ZERO, b: Vec3::ONE, c: 2.0 * Vec3::ONE };
    assert!(line.area_in_ball(Vec3::ZERO, 1.0).abs() < 1e-6);
}

/// Returns the distance from a triangle in double precision: to the foot of the perpendicular where
/// this is inside, else to the nearest edge.
fn distance(t: &Triangle, p: Vec3) -> f64 {
    let [a, b, c, p] = [t.a, t.b, t.c, p].map(|p| p.as_dvec3());
    let normal = (b - a).cross(c - a);
    let foot = p - (p - a).dot(normal) / normal.length_squared() * normal;
    let edges = [(a, b), (b, c), (c, a)];
    if edges.iter().all(|&(q, r)| (r - q).cross(foot - q).dot(normal) >= 0.0) {
        return p.distance(foot);
    }
    let to_edge = |(q, r): (DVec3, DVec3)| {
        let along = ((p - q).dot(r - q) / q.distance_squared(r)).clamp(0.0, 1.0);
        p.distance(q.lerp(r, along))
    };
    edges.map(to_edge).into_iter().fold(f64::INFINITY, f64::min)
}

/// 20 000 triangles and points of seed 2, slivers included, to 1e-5.
#[test]
fn nearest_point_is_nearest() {
    let mut rng = Stream::new(2, 0, 0);
    for _ in 0..20_000 {
        let t = triangle(&mut rng);
        let p = 2.0 * cube(&mut rng);
        let found = t.nearest_point(p);
        let far = found.as_dvec3().distance(p.as_dvec3());
        assert!((far - distance(&t, p)).abs() < 1e-5, "{t:?} {p}: {far}");
        assert!(distance(&t, found) < 1e-5, "{t:?} {p}: {found} is not on it");
    }
}

/// 1e5 normals of seed 3, and the axes: orthonormal and right-handed to 1e-6.
#[test]
fn frames_are_orthonormal() {
    let mut rng = Stream::new(3, 0, 0);
    let random = (0..100_000).map(|_| cube(&mut rng).normalize());
    let axes = [Vec3::X, Vec3::Y, Vec3::Z].into_iter().flat_map(|v| [v, -v]);
    let poles = [1.0, -1.0, 0.0, -0.0].into_iter().flat_map(|z| {
        [1e-3, 1e-5, 1e-7].map(|x| Vec3::new(x, -0.5 * x, z).try_normalize().unwrap_or(Vec3::X))
    });
    for normal in random.chain(axes).chain(poles) {
        let Frame { tangent, bitangent, normal: z } = Frame::new(normal);
        assert_eq!(z, normal);
        for v in [tangent, bitangent] {
            assert!((v.length() - 1.0).abs() < 1e-6 && v.dot(normal).abs() < 1e-6, "{normal}");
        }
        assert!(tangent.cross(bitangent).distance(normal) < 1e-6, "{normal}");
        let v = Frame::new(normal).to_world(Vec3::new(1.0, 2.0, 3.0));
        assert!(v.distance(tangent + 2.0 * bitangent + 3.0 * normal) < 1e-5);
    }
}

#[test]
fn transform_scales_turns_about_x_y_z_and_shifts() {
    let near = |p: DVec3, q: [f64; 3]| assert!(p.distance(q.into()) < 1e-12, "{p}, not {q:?}");
    let turn = |x, y, z| Transform::new(1.0, DVec3::new(x, y, z), DVec3::ZERO);
    // counter-clockwise, seen against the axis
    near(turn(90.0, 0.0, 0.0).point(DVec3::Y), [0.0, 0.0, 1.0]);
    near(turn(0.0, 90.0, 0.0).point(DVec3::Z), [1.0, 0.0, 0.0]);
    near(turn(0.0, 0.0, 90.0).point(DVec3::X), [0.0, 1.0, 0.0]);
    // about x first: y becomes z, which the rotation about z leaves unchanged
    near(turn(90.0, 0.0, 90.0).point(DVec3::Y), [0.0, 0.0, 1.0]);
    near(turn(90.0, 90.0, 0.0).point(DVec3::Y), [1.0, 0.0, 0.0]);
    near(turn(0.0, 90.0, 90.0).point(DVec3::Z), [0.0, 1.0, 0.0]);
    let all = Transform::new(2.0, DVec3::new(0.0, 0.0, 90.0), DVec3::new(10.0, 0.0, 0.0));
    near(all.point(DVec3::X), [10.0, 2.0, 0.0]);

    let first = Transform::new(0.5, DVec3::new(10.0, 20.0, 30.0), DVec3::new(1.0, 2.0, 3.0));
    let p = DVec3::new(-1.0, 0.3, 2.0);
    near(all.after(&first).point(p), all.point(first.point(p)).to_array());
}

// --- polygons -----------------------------------------------------------------------------------

fn area_vector(polygon: &[DVec3]) -> DVec3 {
    let n = polygon.len();
    let corner = |i: usize| polygon[i % n] - polygon[0];
    0.5 * (0..n).map(|i| corner(i).cross(corner(i + 1))).sum::<DVec3>()
}

/// All triangles keep the orientation of the polygon, and their areas add up to its area.
#[track_caller]
fn assert_cut(what: &str, polygon: &[DVec3]) {
    let triangles = triangulate(polygon);
    let whole = area_vector(polygon);
    let normal = whole.normalize();
    let mut sum = 0.0;
    for t in &triangles {
        let area = area_vector(&t.map(|i| polygon[i])).dot(normal);
        assert!(area >= -1e-9 * whole.length(), "{what}: a triangle is turned over");
        sum += area;
    }
    let exact = whole.length();
    assert!((sum - exact).abs() < 1e-7 * exact, "{what}: area {sum}, not {exact}");
    assert!(triangles.len() <= polygon.len() - 2, "{what}: {} triangles", triangles.len());
    assert!(!is_tangled(polygon, &triangles), "{what}");
}

/// Returns points of the plane, placed so that the plane is perpendicular to no axis, and shifted
/// from the origin.
fn placed(points: &[[f64; 2]], shift: f64) -> Vec<DVec3> {
    let x = DVec3::new(1.0, 2.0, 2.0) / 3.0;
    let y = DVec3::new(2.0, 1.0, -2.0) / 3.0;
    points.iter().map(|p| shift * DVec3::new(1.0, -0.7, 0.3) + p[0] * x + p[1] * y).collect()
}

#[test]
fn polygons_keep_their_area_and_front() {
    let star = |n: usize, inner: f64| -> Vec<[f64; 2]> {
        (0..n)
            .map(|i| {
                let (sin, cos) = (std::f64::consts::TAU * i as f64 / n as f64).sin_cos();
                let r = if i % 2 == 0 { 1.0 } else { inner };
                [r * cos, r * sin]
            })
            .collect()
    };
    let shapes: [(&str, Vec<[f64; 2]>); 8] = [
        ("triangle", vec![[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]),
        ("square", vec![[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]),
        ("arrow", vec![[0.0, 0.0], [2.0, 1.0], [0.0, 2.0], [0.5, 1.0]]),
        ("L", vec![[0.0, 0.0], [3.0, 0.0], [3.0, 1.0], [1.0, 1.0], [1.0, 3.0], [0.0, 3.0]]),
        (
            "square with corners in its edges",
            vec![
                [0.0, 0.0],
                [0.5, 0.0],
                [1.0, 0.0],
                [1.0, 0.3],
                [1.0, 1.0],
                [0.2, 1.0],
                [0.0, 1.0],
            ],
        ),
        (
            "L with corners in its edges and one twice",
            vec![
                [0.0, 0.0],
                [1.0, 0.0],
                [3.0, 0.0],
                [3.0, 1.0],
                [3.0, 1.0],
                [1.0, 1.0],
                [1.0, 2.0],
                [1.0, 3.0],
                [0.0, 3.0],
            ],
        ),
        ("disc", star(64, 1.0)),
        ("star", star(64, 0.3)),
    ];
    for (what, points) in &shapes {
        for first in 0..points.len() {
            for (scale, shift) in [(1.0, 0.0), (1.0, 1e4), (1e-3, 1e4), (1e-2, 1e6)] {
                let mut turned: Vec<[f64; 2]> =
                    points.iter().map(|p| p.map(|x| x * scale)).collect();
                turned.rotate_left(first);
                let polygon = placed(&turned, shift);
                assert_cut(what, &polygon);
                let reversed: Vec<DVec3> = polygon.iter().rev().copied().collect();
                assert_cut(what, &reversed);
            }
        }
    }
}

/// Simple outlines with 5 to 400 corners at random radii, seed 4.
#[test]
fn random_simple_polygons_keep_their_area() {
    let mut rng = Stream::new(4, 0, 0);
    for n in 5..400 {
        let points: Vec<[f64; 2]> = (0..n)
            .map(|i| {
                let (sin, cos) = (std::f64::consts::TAU * f64::from(i) / f64::from(n)).sin_cos();
                let r = 0.05 + f64::from(rng.uniform());
                [r * cos, r * sin]
            })
            .collect();
        assert_cut("random outline", &placed(&points, 100.0));
    }
}

#[test]
fn a_quad_is_bent_from_a_hundredth_of_its_size_on() {
    let quad =
        |z| [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, z], [0.0, 1.0, 0.0]].map(DVec3::from);
    // the corners are z / 4 off the mean plane, and sqrt(1/2) from the middle
    assert!(!is_bent(&quad(0.0)) && !is_bent(&quad(0.02)) && is_bent(&quad(0.04)));
    assert!(!is_bent(&quad(0.0)[..3]));
}

/// An outline that crosses itself has no well-defined surface. The cut may drop parts of it, but it
/// ends, with valid corners and no more triangles than a simple outline would have.
#[test]
fn outlines_that_cross_themselves_are_cut_somehow() {
    let bow_tie = placed(&[[0.0, 0.0], [1.0, 1.0], [1.0, 0.0], [0.0, 1.0]], 0.0);
    assert!(triangulate(&bow_tie).len() <= 2);
    assert!(is_tangled(&bow_tie, &triangulate(&bow_tie)));
    let mut rng = Stream::new(5, 0, 0);
    for n in [5, 50, 2_000] {
        let points: Vec<[f64; 2]> =
            (0..n).map(|_| [f64::from(rng.uniform()), f64::from(rng.uniform())]).collect();
        let polygon = placed(&points, 0.0);
        let triangles = triangulate(&polygon);
        assert!(!triangles.is_empty() && triangles.len() <= n - 2, "{n}: {}", triangles.len());
        assert!(triangles.iter().flatten().all(|&i| i < n));
        assert!(is_tangled(&polygon, &triangles), "{n}");
    }
    // nothing to cut
    assert!(triangulate(&[]).is_empty());
    assert!(triangulate(&[DVec3::ZERO, DVec3::X]).is_empty());
    assert_eq!(triangulate(&[DVec3::ZERO; 5]).len(), 3);
}

/// Points near the edges and corners of 20,000 triangles, some of them slivers, up to 2 km away:
/// they are moved off all three edges at once, also in acute corners, by no more than they must,
/// and points inside stay where they are. Seed 1; distances to 2 roundings of the coordinates.
#[test]
fn points_near_edges_are_moved_off_all_of_them() {
    const APART: f32 = 3e-3;
    let mut rng = Stream::new(1, 0, 0);
    let (mut moved, mut kept) = (0, 0);
    for i in 0..20_000 {
        let far = if i % 2 == 0 { 0.0 } else { 2000.0 } * cube(&mut rng);
        let sliver = if i % 3 == 0 { 0.1 } else { 1.0 };
        let [a, b, c] = [(); 3].map(|()| cube(&mut rng));
        let c = a + 0.7 * (b - a) + sliver * (c - a);
        let t = Triangle { a: far + a, b: far + b, c: far + c };
        let corners = [t.a, t.b, t.c].map(|corner| corner.as_dvec3());
        let unit = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalize();
        let from_edge = |i: usize, point: DVec3| {
            let (p, q) = (corners[(i + 1) % 3], corners[(i + 2) % 3]);
            (point - p).dot(unit.cross(q - p).normalize())
        };
        // half of the points lie close to a corner
        let near = if i % 4 < 2 { 1.0 } else { 0.01 };
        let [u, v] = [rng.uniform() * near, rng.uniform() * near].map(f64::from);
        if u + v > 1.0 {
            continue;
        }
        let point = t.exact_point(u, v);
        let found = t.off_edges(point, |_| APART);
        let rounding = 2.0 * f64::from(f32::EPSILON) * point.length();
        let margin = |i: usize| f64::from(APART).min(from_edge(i, corners[i]) / 3.0);
        for i in 0..3 {
            let distance = from_edge(i, found.as_dvec3());
            assert!(distance >= margin(i) - rounding, "{t:?} {u} {v}: {distance}");
        }
        let least = f64::from(APART + POINT * point.as_vec3().length() * 2.0);
        if (0..3).all(|i| from_edge(i, point) > least) {
            assert_eq!(found, point.as_vec3(), "{t:?} {u} {v}");
            kept += 1;
        } else {
            moved += 1;
        }
    }
    assert!(moved > 3_000 && kept > 3_000, "{moved} {kept}");
}
