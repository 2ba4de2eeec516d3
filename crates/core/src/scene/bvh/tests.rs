//! Tests of the ray kernel. Every random test is deterministic: its seed is written in it.

use std::f32::consts::TAU;

use glam::{DVec3, Vec3};
use rand_core::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

use super::build::balanced;
use super::query::{Crossings, ask, ask_plain};
use super::round::CrossRounds;
use super::walk::{ROOT_NODES, STACK};
use super::wide::{Branch, Packed, Wide, widen};
use super::{Bvh, Hit};
use crate::math::{
    geometry::{Ray, Triangle},
    round::Round,
};

struct Random(Xoshiro256PlusPlus);

impl Random {
    fn new(seed: u64) -> Self {
        Self(Xoshiro256PlusPlus::seed_from_u64(seed))
    }

    /// Draws a number, uniform in [0, 1).
    fn unit(&mut self) -> f32 {
        (self.0.next_u64() >> 40) as f32 / (1 << 24) as f32
    }

    /// Draws a point, uniform in the cube [-1, 1)^3.
    fn cube(&mut self) -> Vec3 {
        Vec3::new(self.unit(), self.unit(), self.unit()) * 2.0 - 1.0
    }

    fn direction(&mut self) -> Vec3 {
        let (z, phi) = (2.0 * self.unit() - 1.0, TAU * self.unit());
        let r = (1.0 - z * z).sqrt();
        Vec3::new(r * phi.cos(), r * phi.sin(), z).normalize()
    }

    fn pick<'a, T>(&mut self, items: &'a [T]) -> &'a T {
        &items[self.0.next_u64() as usize % items.len()]
    }

    /// Draws `n` triangles of about the given size with their first corner in the cube.
    fn soup(&mut self, n: usize, size: f32) -> Vec<Triangle> {
        let mut triangle = || {
            let a = self.cube();
            Triangle { a, b: a + size * self.cube(), c: a + size * self.cube() }
        };
        (0..n).map(|_| triangle()).collect()
    }
}

/// A sphere of 20 * 4^`levels` triangles.
fn icosphere(levels: u32, center: Vec3, radius: f32) -> Vec<Triangle> {
    let g = (1.0 + 5f32.sqrt()) / 2.0;
    let p: Vec<Vec3> = [(0, 1, 2), (1, 2, 0), (2, 0, 1)]
        .iter()
        .flat_map(|&(x, y, z)| {
            [(1.0, 1.0), (-1.0, 1.0), (1.0, -1.0), (-1.0, -1.0)].map(|(s, t)| {
                let mut p = Vec3::ZERO;
                (p[x], p[y], p[z]) = (0.0, s, t * g);
                p.normalize()
            })
        })
        .collect();
    // the faces are the triples of neighbours
    let near = |i: usize, j: usize| p[i].distance(p[j]) < 1.1;
    let mut faces = Vec::new();
    for i in 0..12 {
        for j in i + 1..12 {
            faces.extend(
                (j + 1..12)
                    .filter(|&k| near(i, j) && near(j, k) && near(i, k))
                    .map(|k| [p[i], p[j], p[k]]),
            );
        }
    }
    for _ in 0..levels {
        let split = |[a, b, c]: [Vec3; 3]| {
            let [d, e, f] = [a + b, b + c, c + a].map(Vec3::normalize);
            [[a, d, f], [b, e, d], [c, f, e], [d, e, f]]
        };
        faces = faces.into_iter().flat_map(split).collect();
    }
    faces
        .iter()
        .map(|f| f.map(|p| center + radius * p))
        .map(|[a, b, c]| Triangle { a, b, c })
        .collect()
}

/// The six walls of a box, each of n x n tiles of two triangles.
fn walls(min: Vec3, max: Vec3, n: u32) -> Vec<Triangle> {
    let mut triangles = Vec::new();
    for axis in 0..3 {
        let (x, y) = ((axis + 1) % 3, (axis + 2) % 3);
        for side in [min, max] {
            let point = |i: u32, j: u32| {
                // the last point lies exactly on the next wall
                let along = |axis: usize, i: u32| {
                    if i == n {
                        max[axis]
                    } else {
                        min[axis] + (max - min)[axis] * i as f32 / n as f32
                    }
                };
                let mut p = side;
                (p[x], p[y]) = (along(x, i), along(y, j));
                p
            };
            for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
                let (a, b, c, d) =
                    (point(i, j), point(i + 1, j), point(i + 1, j + 1), point(i, j + 1));
                triangles.extend([Triangle { a, b, c }, Triangle { a, b: c, c: d }]);
            }
        }
    }
    triangles
}

/// A room of 5 x 4 x 3 m with two boxes in it.
fn room() -> Vec<Triangle> {
    let corner = Vec3::new(2.5, 2.0, 1.5);
    let mut triangles = walls(-corner, corner, 12);
    triangles.extend(walls(Vec3::new(0.3, -0.4, -1.5), Vec3::new(1.1, 0.7, 0.2), 5));
    triangles.extend(walls(Vec3::new(-1.7, 0.3, -1.1), Vec3::new(-0.6, 1.3, 0.4), 5));
    triangles
}

/// Returns t, u, v of the ray's line and the triangle's plane, in double precision (Moeller and
/// Trumbore).
fn exact(ray: &Ray, t: &Triangle) -> [f64; 3] {
    let (a, b, c) = (t.a.as_dvec3(), t.b.as_dvec3(), t.c.as_dvec3());
    let (o, d): (DVec3, DVec3) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
    let (e1, e2) = (b - a, c - a);
    let p = d.cross(e2);
    let inverse = 1.0 / e1.dot(p);
    let s = o - a;
    let q = s.cross(e1);
    [e2.dot(q) * inverse, s.dot(p) * inverse, d.dot(q) * inverse]
}

/// Returns whether the ray surely hits (true), surely does not hit (false), or is too near an edge
/// or an end of its range to tell (`None`). `range` and t are relative to the size of the scene.
fn certainty([t, u, v]: [f64; 3], range: f64) -> Option<bool> {
    match u.min(v).min(1.0 - u - v).min(t).min(range - t) {
        x if x > 1e-5 => Some(true),
        x if x < -1e-5 => Some(false),
        _ => None,
    }
}

/// Compares all three searches with the exact test on every triangle, and returns how many rays
/// hit.
fn compare(random: &mut Random, triangles: &[Triangle], rays: usize, scale: f32) -> usize {
    let bvh = Bvh::build(triangles);
    let size = f64::from(scale);
    let mut hits = 0;
    for _ in 0..rays {
        let ray = Ray { origin: scale * random.cube(), direction: random.direction() };
        let t_max = if random.unit() < 0.5 { f32::INFINITY } else { scale * random.unit() };
        let found = crossed(&bvh, &ray, t_max);
        for (i, triangle) in (0..).zip(triangles) {
            let [t, u, v] = exact(&ray, triangle);
            let hit = found.iter().find(|h| h.triangle == i);
            if let Some(sure) = certainty([t / size, u, v], f64::from(t_max) / size) {
                assert_eq!(sure, hit.is_some(), "{ray:?} {t_max} triangle {i}: {t} {u} {v}");
            }
            let Some(hit) = hit else { continue };
            // rounding moves the corners by 1e-7 of the scene across the ray
            let close = 1e-6 * size / f64::from(triangle.area()).sqrt() + 1e-6;
            let steep = f64::from(triangle.normal().dot(ray.direction)).abs();
            assert!((f64::from(hit.t) - t).abs() < 1e-6 * size / steep, "{hit:?} {t}");
            assert!((f64::from(hit.u) - u).abs() < close / steep, "{hit:?} {u} {triangle:?}");
            assert!((f64::from(hit.v) - v).abs() < close / steep, "{hit:?} {v} {triangle:?}");
        }
        let nearest = |p: &&Hit, q: &&Hit| p.t.total_cmp(&q.t).then(p.triangle.cmp(&q.triangle));
        let first = found.iter().min_by(nearest).copied();
        assert_eq!(bvh.closest(&ray, t_max), first);
        assert_eq!(bvh.occluded(&ray, t_max, |_| true), first.is_some());
        let last = found.iter().map(|hit| hit.triangle).max();
        assert_eq!(bvh.occluded(&ray, t_max, |hit| Some(hit.triangle) == last), last.is_some());
        hits += usize::from(first.is_some());
    }
    hits
}

fn crossed(bvh: &Bvh, ray: &Ray, t_max: f32) -> Vec<Hit> {
    let mut hits = Vec::new();
    bvh.crossings(ray, t_max, |hit| hits.push(hit));
    let mut indices: Vec<u32> = hits.iter().map(|h| h.triangle).collect();
    indices.sort_unstable();
    indices.dedup();
    assert_eq!(indices.len(), hits.len(), "a triangle came twice");
    hits
}

#[test]
fn random_triangles_as_exactly() {
    let mut random = Random::new(1);
    for (n, size) in [(1, 1.0), (2, 1.0), (7, 0.5), (100, 0.5), (1000, 0.1)] {
        let triangles = random.soup(n, size);
        compare(&mut random, &triangles, 1000, 1.0);
    }
}

#[test]
fn closed_meshes_as_exactly_at_any_scale() {
    let mut random = Random::new(2);
    for scale in [1e-3, 1.0, 1e3] {
        let sphere = icosphere(2, Vec3::ZERO, scale);
        assert_eq!(sphere.len(), 320);
        compare(&mut random, &sphere, 1000, scale);
        let box_ = walls(Vec3::splat(-scale), Vec3::splat(scale), 4);
        let hits = compare(&mut random, &box_, 1000, scale);
        assert!(hits > 500);
    }
}

/// A closed mesh, and a ball inside it.
struct Closed {
    mesh: Vec<Triangle>,
    center: Vec3,
    radius: f32,
}

impl Closed {
    fn all() -> Vec<Self> {
        let closed = |mesh, center, radius| Self { mesh, center, radius };
        let mut all = vec![closed(room(), Vec3::ZERO, 0.2)];
        for scale in [1e-3, 1.0, 1e3] {
            let (low, high) = (Vec3::splat(-scale), Vec3::splat(1.1 * scale));
            all.push(closed(icosphere(4, Vec3::ZERO, scale), Vec3::ZERO, 0.9 * scale));
            all.push(closed(walls(low, high, 12), Vec3::ZERO, 0.9 * scale));
        }
        let far = Vec3::new(100.0, -30.0, 7.0);
        all.push(closed(icosphere(3, far, 1.0), far, 0.9));
        all
    }

    fn inside(&self, random: &mut Random) -> Vec3 {
        self.center + self.radius * random.unit() * random.direction()
    }
}

/// 2e5 rays are aimed at corners and 2e5 at edges.
#[test]
fn no_ray_leaves_a_closed_mesh_through_an_edge_or_a_corner() {
    let mut random = Random::new(3);
    for closed in Closed::all() {
        let bvh = Bvh::build(&closed.mesh);
        for _ in 0..25_000 {
            let origin = closed.inside(&mut random);
            let t = random.pick(&closed.mesh);
            for target in [t.a, t.a.lerp(t.b, random.unit())] {
                let ray = Ray { origin, direction: (target - origin).normalize() };
                assert!(bvh.closest(&ray, f32::INFINITY).is_some(), "{ray:?}");
            }
        }
    }
}

/// 1e6 rays are traced.
#[test]
fn no_ray_leaves_a_closed_mesh() {
    let mut random = Random::new(4);
    for closed in Closed::all() {
        let bvh = Bvh::build(&closed.mesh);
        for _ in 0..125_000 {
            let origin = closed.inside(&mut random);
            let ray = Ray { origin, direction: random.direction() };
            assert!(bvh.closest(&ray, f32::INFINITY).is_some(), "{ray:?}");
        }
    }
}

/// Axis-parallel and diagonal rays with both kinds of zero start from points inside, on the planes
/// of faces, on edges and on the grid of the tiles: each must meet the wall that it points to.
#[test]
fn rays_along_axes_and_faces() {
    let bvh = Bvh::build(&walls(Vec3::splat(-1.0), Vec3::splat(1.0), 4));
    let steps = [-1.0, -0.5, -0.0, 0.0, 0.5, 1.0, 0.3];
    let (mut rays, mut walls_met) = (0, 0);
    for o in steps
        .iter()
        .flat_map(|&x| steps.iter().flat_map(move |&y| steps.map(|z| Vec3::new(x, y, z))))
    {
        for d in directions() {
            // the distance that the ray goes in the closed cube
            let inside = (0..3).filter(|&i| d[i] != 0.0).map(|i| (d[i].signum() - o[i]) / d[i]);
            let exit = inside.fold(f32::INFINITY, f32::min);
            let ray = Ray { origin: o, direction: d };
            let hit = bvh.closest(&ray, f32::INFINITY);
            rays += 1;
            if exit > 0.0 {
                let t = hit.unwrap_or_else(|| panic!("{ray:?} misses")).t;
                assert!(t <= exit * (1.0 + 1e-6), "{ray:?} {t} {exit}");
                walls_met += 1;
            } else {
                assert_eq!(hit, None, "{ray:?}");
            }
        }
    }
    assert!(walls_met > rays / 2 && walls_met < rays);
}

/// All directions with components -1, -0.0, 0.0 and 1, of unit length.
fn directions() -> Vec<Vec3> {
    let c = [-1.0, -0.0, 0.0, 1.0];
    let all = c.iter().flat_map(|&x| c.iter().flat_map(move |&y| c.map(|z| Vec3::new(x, y, z))));
    all.filter(|d| *d != Vec3::ZERO).map(Vec3::normalize).collect()
}

#[test]
fn hits_at_tiny_distances() {
    let bvh = Bvh::build(&walls(Vec3::splat(-1.0), Vec3::splat(0.0), 3));
    for t in [1e-3, 1e-7, 1e-12, 1e-30] {
        let start = Vec3::new(-0.4, -0.3, -t);
        let up = Ray { origin: start, direction: Vec3::Z };
        assert_eq!(bvh.closest(&up, f32::INFINITY).unwrap().t, t);
        let down = Ray { origin: start, direction: Vec3::NEG_Z };
        assert_eq!(bvh.closest(&down, f32::INFINITY).unwrap().t, 1.0 - t);
    }
    let on = Ray { origin: Vec3::new(-0.4, -0.3, 0.0), direction: Vec3::Z };
    assert_eq!(bvh.closest(&on, f32::INFINITY), None);
}

#[test]
fn of_coincident_triangles_the_first() {
    let mut random = Random::new(5);
    let t = Triangle { a: Vec3::ZERO, b: Vec3::X, c: Vec3::Y };
    let mut triangles = random.soup(300, 0.1);
    triangles.extend(std::iter::repeat_n(t, 10_000));
    for t in &mut triangles[..300] {
        (t.a.z, t.b.z, t.c.z) = (t.a.z - 2.0, t.b.z - 2.0, t.c.z - 2.0);
    }
    let bvh = Bvh::build(&triangles);
    let ray = Ray { origin: Vec3::new(0.2, 0.3, 1.0), direction: Vec3::NEG_Z };
    let hit = bvh.closest(&ray, f32::INFINITY).unwrap();
    assert_eq!(hit, Hit { t: 1.0, triangle: 300, u: 0.2, v: 0.3, owned: true, ..hit });
    assert_eq!(crossed(&bvh, &ray, 1.5).len(), 10_000);
    assert_eq!(bvh.closest(&ray, 1.0), None);
}

/// A ray through an edge or a corner crosses exactly one of the triangles that meet there,
/// whichever way they are oriented: a photon through the diagonal of a captor is one photon.
#[test]
fn shared_edges_are_crossed_once() {
    let p = |x: i32, y: i32| Vec3::new(x as f32, y as f32, 0.0);
    let mut fans = Vec::new();
    for (x, y) in (0..4).flat_map(|x| (0..4).map(move |y| (2 * x, 2 * y))) {
        let ring: Vec<Vec3> = [(0, 0), (1, 0), (2, 0), (2, 1), (2, 2), (1, 2), (0, 2), (0, 1)]
            .map(|(i, j)| p(x + i, y + j))
            .to_vec();
        for i in 0..8 {
            let [a, b, c] = [p(x + 1, y + 1), ring[i], ring[(i + 1) % 8]];
            fans.push(if i % 3 == 0 { Triangle { a: c, b, c: a } } else { Triangle { a, b, c } });
        }
    }
    let bvh = Bvh::build(&fans);
    let slants = [Vec3::ZERO, Vec3::new(0.25, 0.5, 0.0), Vec3::new(-0.5, 0.125, 0.0)];
    for (i, j, slant) in (1..32)
        .flat_map(|i| (1..32).map(move |j| (i, j)))
        .flat_map(|(i, j)| slants.map(|slant| (i, j, slant)))
    {
        let to = Vec3::new(i as f32 * 0.25, j as f32 * 0.25, 0.0);
        for z in [1.0, -1.0] {
            let ray = Ray { origin: to + slant + Vec3::Z * z, direction: -slant - Vec3::Z * z };
            assert_eq!(crossed(&bvh, &ray, f32::INFINITY).len(), 1, "{ray:?}");
            assert!(bvh.closest(&ray, f32::INFINITY).is_some());
        }
    }
}

/// Strips, piles and nests of triangles, of which a naive build makes a chain.
#[test]
fn degenerate_distributions() {
    let t = Triangle { a: Vec3::ZERO, b: Vec3::X, c: Vec3::Y };
    let moved = |s: Vec3| Triangle { a: t.a + s, b: t.b + s, c: t.c + s };
    let scaled = |s: f32| Triangle { a: s * t.a, b: s * t.b, c: s * t.c };
    let strip: Vec<Triangle> = (0..20_000).map(|i| moved(i as f32 * Vec3::X)).collect();
    let pile: Vec<Triangle> = (0..20_000).map(|i| moved(i as f32 * -Vec3::Z)).collect();
    let nest: Vec<Triangle> = (0..2_000).map(|i| scaled(1.01f32.powi(i - 1000))).collect();
    for (triangles, crossings) in [(strip, 1), (pile, 20_000), (nest, 1_028)] {
        let bvh = Bvh::build(&triangles);
        let ray = Ray { origin: Vec3::new(0.5, 0.25, 1.0), direction: Vec3::NEG_Z };
        assert_eq!(crossed(&bvh, &ray, f32::INFINITY).len(), crossings);
        assert_eq!(bvh.closest(&ray, f32::INFINITY).unwrap().t, 1.0);
    }
}

/// In a tree that is a chain, more children would wait than there is room for; balancing it helps.
#[test]
fn a_chain_is_balanced() {
    let mut random = Random::new(7);
    let triangles = random.soup(1_000, 0.1);
    let link = |i: usize| [Branch::Fork(2 * i as u32 + 1), Branch::Thing(i as u32)];
    let mut chain: Vec<Packed> = (0..999).flat_map(link).map(Packed::from).collect();
    chain.push(Packed::from(Branch::Thing(999)));
    assert!(widen(&chain, &triangles[..], ROOT_NODES).waiting > STACK);
    let Wide { rows, root_nodes, waiting } = widen(&balanced(&chain), &triangles[..], ROOT_NODES);
    assert!(waiting <= STACK);
    assert_eq!(rows.len(), rows.capacity());
    let usual = Bvh::build(&triangles);
    let bvh = Bvh { rows, root_nodes };
    let mut hits = 0;
    for _ in 0..1_000 {
        let ray = Ray { origin: random.cube(), direction: random.direction() };
        let hit = usual.closest(&ray, f32::INFINITY);
        assert_eq!(bvh.closest(&ray, f32::INFINITY), hit);
        hits += usize::from(hit.is_some());
    }
    assert!(hits > 100);
}

#[test]
fn nothing_to_hit() {
    let ray = Ray { origin: Vec3::new(0.2, 0.3, 1.0), direction: Vec3::NEG_Z };
    let point = Triangle { a: Vec3::ZERO, b: Vec3::ZERO, c: Vec3::ZERO };
    let line = Triangle { a: Vec3::ZERO, b: Vec3::new(0.2, 0.3, 0.0), c: Vec3::new(0.4, 0.6, 0.0) };
    for triangles in [vec![], vec![point], vec![line, point]] {
        let bvh = Bvh::build(&triangles);
        assert_eq!(bvh.closest(&ray, f32::INFINITY), None);
        assert!(crossed(&bvh, &ray, 9.0).is_empty());
    }
    let real = Triangle { a: Vec3::ZERO, b: Vec3::X, c: Vec3::Y };
    let hit = Bvh::build(&[line, point, real]).closest(&ray, f32::INFINITY).unwrap();
    assert_eq!(hit.triangle, 2);
    let beside = Ray { origin: Vec3::new(0.6, 0.6, 1.0), ..ray };
    assert_eq!(Bvh::build(&[real]).closest(&beside, f32::INFINITY), None);
}

/// The code for this processor and the code for any processor give the same bits.
#[test]
fn fast_and_plain_agree() {
    let mut random = Random::new(6);
    let mut meshes = vec![random.soup(20_000, 0.1)];
    meshes.extend(Closed::all().into_iter().map(|closed| closed.mesh));
    for mesh in meshes {
        let bvh = Bvh::build(&mesh);
        let size = mesh.iter().map(|t| t.reach().max_element()).fold(0.0, f32::max);
        for _ in 0..5_000 {
            let ray = Ray { origin: size * random.cube(), direction: random.direction() };
            let (mut fast, mut plain) = (Vec::new(), Vec::new());
            let t_max = f32::INFINITY;
            ask(Crossings { bvh: &bvh, ray: &ray, t_max, visit: &mut |hit| fast.push(hit) });
            ask_plain(Crossings { bvh: &bvh, ray: &ray, t_max, visit: &mut |hit| plain.push(hit) });
            assert_eq!(fast, plain);
        }
    }
}

#[test]
fn any_number_of_threads_builds_the_same() {
    let triangles = Random::new(7).soup(20_000, 0.05);
    let build = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let bvh = pool.install(|| Bvh::build(&triangles));
        format!("{bvh:?}")
    };
    let one = build(1);
    assert!(one == build(2) && one == build(5));
}

/// Every triangle with some area in a ball is visited, and few others: 200 triangles, 500 balls.
#[test]
fn near_finds_all_in_a_ball() {
    let mut random = Random::new(7);
    let triangles = random.soup(200, 0.2);
    let bvh = Bvh::build(&triangles);
    let mut visits = 0;
    for ball in 0..500 {
        let (center, radius) = (random.cube(), 0.001 * ball as f32);
        let mut found = Vec::new();
        bvh.near(center, radius, |triangle| found.push(triangle as usize));
        visits += found.len();
        for (i, triangle) in triangles.iter().enumerate() {
            // above the rounding error of sectors that cancel
            let inside = triangle.area_in_ball(center, radius) > 1e-5 * radius * radius;
            assert!(!inside || found.contains(&i), "{i} within {radius} of {center}");
        }
    }
    assert!((500..50_000).contains(&visits), "{visits} of 100000 visits");
}

/// Of discs and spheres of all sizes, some of them far away, level or in one place, a ray crosses those
/// that it crosses when each is tested exactly; with the code for any processor, too.
#[test]
fn rounds_are_crossed_as_one_by_one() {
    let mut random = Random::new(11);
    for (n, size) in [(1, 0.5), (9, 0.3), (300, 0.1), (2000, 0.03)] {
        let mut rounds: Vec<Round> = Vec::new();
        for i in 0..n {
            let far = if i % 50 == 7 { 1e3 } else { 1.0 };
            let center = (far * random.cube()).as_dvec3();
            let radius = f64::from(size * far * (0.1 + random.unit()));
            let normal = random.direction().as_dvec3().normalize();
            rounds.push(match i % 5 {
                0 => Round::sphere(center, radius),
                1 => Round::disc(center, DVec3::Z, radius),
                2 => Round { radius, ..rounds[random.0.next_u64() as usize % rounds.len()] },
                _ => Round::disc(center, normal, radius),
            });
        }
        let bvh = Bvh::build_of_rounds(&rounds, (0..n).collect());
        let mut crossings = 0;
        for _ in 0..2_000 {
            let origin = 2.0 * random.cube();
            let target = random.pick(&rounds).center.as_vec3() + size * random.cube();
            let ray = Ray { origin, direction: (target - origin).normalize() };
            let t_max = if random.unit() < 0.5 { f32::INFINITY } else { 3.0 * random.unit() };
            let hits = |(i, round): (usize, &Round)| {
                round.crossed(&ray, t_max).into_iter().flatten().map(move |hit| (i, hit))
            };
            let expected: Vec<_> = rounds.iter().enumerate().flat_map(hits).collect();
            let (mut found, mut plain) = (Vec::new(), Vec::new());
            bvh.cross_rounds(&rounds, &ray, t_max, |i, hit| found.push((i, hit)));
            let visit = &mut |i, hit| plain.push((i, hit));
            ask_plain(CrossRounds { bvh: &bvh, rounds: &rounds, ray: &ray, t_max, visit });
            assert_eq!(found, plain);
            found.sort_by(|(i, a), (j, b)| i.cmp(j).then(b.front.cmp(&a.front)));
            assert_eq!(found, expected);
            crossings += found.len();
        }
        assert!(crossings > 200, "{crossings}");
        let mut near = Vec::new();
        bvh.near_rounds(rounds[0].center.as_vec3(), 0.01, |i| near.push(i));
        assert!(near.contains(&0));
    }
}
