//! The estimate on captors whose density is known.

use glam::DVec3;

use super::*;
use crate::{
    light::LightShape,
    material::{Leaf, LeafFace, Material},
    odds::Mean,
    photon_map::{Arrival, MapBuilder, Piece},
    rng::Stream,
    sampling::uniform_triangle,
    scene::{Band, CaptorPart, LightPart, NamedMaterial, SceneParts, SurfacePart},
};

/// A scene of two bands with one captor, virtual or a leaf.
fn scene_of(triangles: Vec<[DVec3; 3]>, leaf: Option<Leaf>) -> Scene {
    let band = |name: &str| Band { name: name.into(), from_nm: None, to_nm: None };
    let position = triangles[0][0] + DVec3::new(0.0, 0.0, 1.0);
    let light = LightPart {
        name: "lamp".into(),
        power: vec![1.0; 2],
        shape: LightShape::Point { position },
    };
    let (kind, virtual_triangles, surfaces, materials) = match leaf {
        None => (CaptorKind::Virtual { both_sides: false }, triangles, vec![], vec![]),
        Some(leaf) => {
            let part = SurfacePart { material: 0, captor: Some(0), triangles };
            let material = NamedMaterial { name: "leaf".into(), material: Material::Leaf(leaf) };
            (CaptorKind::Surface, vec![], vec![part], vec![material])
        }
    };
    let captor =
        CaptorPart { id: "captor".into(), kind, triangles: virtual_triangles, groups: vec![] };
    Scene::new(SceneParts {
        bands: vec![band("a"), band("b")],
        lights: vec![light],
        captors: vec![captor],
        surfaces,
        materials,
        ..SceneParts::default()
    })
    .unwrap()
}

/// `n` photons uniform over the captor, of powers 1 and 3; as many histories.
fn scatter(scene: &Scene, n: usize, rng: &mut Stream) -> PhotonMap {
    let captor = &scene.captors[0];
    let triangles = scene.triangles_of(captor);
    let mut piece = Piece::default();
    for history in 0..n {
        let mut target = rng.uniform_fine() * captor.area;
        let chosen = triangles.iter().position(|t| {
            target -= f64::from(t.area());
            target < 0.0
        });
        let index = chosen.unwrap_or(triangles.len() - 1);
        let weights = uniform_triangle(rng.square());
        let arrival = Arrival {
            position: triangles[index].point(weights.x, weights.y),
            direction: Vec3::NEG_Z,
            triangle: index as u32,
            shelf: 0,
            light: 0,
            history: history as u32,
            front: true,
        };
        piece.push(usize::MAX, arrival, [1.0, 3.0].into_iter());
    }
    let mut builder = MapBuilder::new(usize::MAX, 2);
    builder.add((0, 0, 0), piece);
    builder.build(n as u64, |_| 0)
}

fn rectangle(x: f64, y: f64, width: f64, depth: f64) -> Vec<[DVec3; 3]> {
    let corner = |u: f64, v: f64| DVec3::new(x + u * width, y + v * depth, 0.5);
    let [a, b, c, d] = [corner(0.0, 0.0), corner(1.0, 0.0), corner(1.0, 1.0), corner(0.0, 1.0)];
    vec![[a, b, c], [a, c, d]]
}

/// Seed 1, 2000 maps of each captor, number of photons and k; odds 1e-6 each. The ball reaches beyond
/// the edges of the strip, of the L whose centroid is outside of it, and of every captor
/// where k is nearly n; the fourth is 1 mm wide, the fifth of two parts.
#[test]
fn irradiance_is_unbiased() {
    let both = |a: Vec<_>, b: Vec<_>| [a, b].concat();
    let captors = [
        ("square", rectangle(0.0, 0.0, 1.0, 1.0)),
        ("strip", rectangle(0.0, 0.0, 1.0, 0.02)),
        ("L", both(rectangle(0.0, 0.0, 2.0, 0.1), rectangle(0.0, 0.1, 0.1, 1.9))),
        ("small", rectangle(5.0, 5.0, 1e-3, 1e-3)),
        ("apart", both(rectangle(0.0, 0.0, 0.5, 0.5), rectangle(0.7, 0.0, 0.2, 0.9))),
    ];
    for (what, triangles) in captors {
        let scene = scene_of(triangles, None);
        let captor = &scene.captors[0];
        for (n, k) in [(300, 50), (60, 50), (50, 50), (40, 3)] {
            let mut rng = Stream::new(1, 0, n as u64);
            let mut means = [Mean::default(); 2];
            let mut coverage = Mean::default();
            for _ in 0..2_000 {
                let map = scatter(&scene, n, &mut rng);
                let [Some(front), None] = estimate(&scene, &map, captor, k) else {
                    panic!("a front alone")
                };
                assert_eq!(front.k, k);
                coverage.add(front.coverage);
                for (mean, e) in means.iter_mut().zip(&front.irradiance) {
                    mean.add(e * captor.area);
                }
                let radiance = front.radiance.unwrap();
                assert!((radiance[1] * PI - front.irradiance[1]).abs() < 1e-9 * radiance[1]);
            }
            let what = format!("{what}, {k} of {n}");
            means[0].assert(&what, 1.0, 1e-5);
            means[1].assert(&what, 3.0, 1e-5);
            // the share of n uniform points' area up to the k-th is the k-th of n uniform numbers
            coverage.assert(&what, k as f64 / (n as f64 + 1.0), 1e-5);
        }
    }
}

/// With fewer photons than k it is the flux / area, exactly; with none there is no estimate.
#[test]
fn few_photons_count_over_the_whole_captor() {
    let scene = scene_of(rectangle(0.0, 0.0, 2.0, 0.5), None);
    let captor = &scene.captors[0];
    let mut rng = Stream::new(2, 0, 0);
    let [Some(front), None] = estimate(&scene, &scatter(&scene, 7, &mut rng), captor, 50) else {
        panic!("a front alone")
    };
    assert_eq!(front.k, 7);
    assert!((front.irradiance[0] - 1.0).abs() < 1e-6 && (front.irradiance[1] - 3.0).abs() < 1e-6);
    assert!((front.radius - 1.0625f64.sqrt()).abs() < 1e-6, "the farthest corner");
    assert_eq!(front.coverage, 1.0);
    assert_eq!(estimate(&scene, &scatter(&scene, 0, &mut rng), captor, 50), [None, None]);
}

/// A leaf's face sends what its own photons reflect and what those of the other face transmit,
/// along its normal: sum of f x irradiance, f by hand for each face.
#[test]
fn radiance_joins_both_faces() {
    let face = |reflectance: &'static [f32], transmittance: &'static [f32]| LeafFace {
        reflectance,
        transmittance,
    };
    let leaf = Leaf::new(1.0, face(&[0.4, 0.1], &[0.2, 0.3]), face(&[0.5, 0.25], &[0.1, 0.05]));
    let scene = scene_of(rectangle(0.0, 0.0, 1.0, 1.0), Some(leaf));
    let mut piece = Piece::default();
    // 4 photons on the front, 10 on the back
    for i in 0..14u32 {
        let front = i < 4;
        let arrival = Arrival {
            position: scene.triangles[0].point(0.1 + 0.02 * i as f32, 0.3),
            direction: if front { Vec3::new(0.6, 0.0, -0.8) } else { Vec3::new(0.0, 0.28, 0.96) },
            triangle: 0,
            shelf: u32::from(!front),
            light: 0,
            history: i,
            front,
        };
        piece.push(100, arrival, [1.0, 2.0].into_iter());
    }
    let mut builder = MapBuilder::new(100, 2);
    builder.add((0, 0, 0), piece);
    let map = builder.build(1, |_| 0);
    let [Some(front), Some(back)] = estimate(&scene, &map, &scene.captors[0], 50) else {
        panic!("both faces have photons")
    };
    let near = |found: &[f64], expected: [f64; 2]| {
        for (f, e) in found.iter().zip(expected) {
            assert!((f - e).abs() < 1e-5 * e, "{found:?}, not {expected:?}");
        }
    };
    near(&front.irradiance, [4.0, 8.0]);
    near(&back.irradiance, [10.0, 20.0]);
    let sent = |own: f64, r: f64, other: f64, t: f64| (own * r + other * t) / PI;
    near(&front.radiance.unwrap(), [sent(4.0, 0.4, 10.0, 0.1), sent(8.0, 0.1, 20.0, 0.05)]);
    near(&back.radiance.unwrap(), [sent(10.0, 0.5, 4.0, 0.2), sent(20.0, 0.25, 8.0, 0.3)]);
}
