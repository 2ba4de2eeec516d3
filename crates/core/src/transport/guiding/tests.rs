//! Tests of the density of aimed directions against the directions themselves.

use std::f32::consts::PI;

use glam::{DVec3, Vec3};

use super::targets::{Facing, Seen, Targets, View};
use crate::{
    math::{
        geometry::{Frame, Ray},
        odds::Mean,
        rng::Stream,
        sampling::uniform_cone,
    },
    scene::{
        captor::CaptorKind,
        light::{Cone, Lamp},
        material::{Dielectric, Lambert, Material, Pane},
        world::{Band, CaptorPart, LightPart, NamedMaterial, Scene, SceneParts, SurfacePart},
    },
};

/// Builds a scene of `side` x `side` captors, squares of 0.2 m that are 0.25 m apart in the plane z
/// = 0. Every third captor counts both sides. There is also one square of `material`: far away, or
/// over the captors if it is a pane.
fn squares(side: usize, material: Material) -> Scene {
    let square = |x: f64, y: f64, z: f64, size: f64| {
        let at = |u: f64, v: f64| DVec3::new(x + u * size, y + v * size, z);
        let [a, b, c, d] = [at(0.0, 0.0), at(1.0, 0.0), at(1.0, 1.0), at(0.0, 1.0)];
        vec![[a, b, c], [a, c, d]]
    };
    let captor = |i: usize| CaptorPart {
        id: format!("{i}"),
        kind: CaptorKind::Virtual { both_sides: i.is_multiple_of(3) },
        triangles: square(0.25 * (i % side) as f64, 0.25 * (i / side) as f64, 0.0, 0.2),
        groups: Vec::new(),
        sensor: Default::default(),
    };
    let triangles = match material {
        Material::Pane(_) => square(-1.0, -1.0, 1.0, 8.0),
        _ => square(-9.0, -9.0, 0.0, 1.0),
    };
    let scene = Scene::new(SceneParts {
        bands: vec![Band { name: "all".into(), from_nm: None, to_nm: None }],
        lights: vec![LightPart::new(
            "lamp",
            Lamp::new([1.0], Cone::point(DVec3::new(0.3, 0.4, 1.0))),
        )],
        materials: vec![NamedMaterial { name: "wall".into(), material }],
        surfaces: vec![SurfacePart { object: None, material: 0, captor: None, triangles }],
        captors: (0..side * side).map(captor).collect(),
        ..SceneParts::default()
    });
    scene.unwrap_or_else(|e| panic!("{e}"))
}

/// Over all directions the density integrates to 1, and the mean of a function with the density as
/// weight is that over the directions that are chosen. With 9 squares, which are compared one by
/// one, and with 400, for which a tree is descended first; from a point above, and from a surface
/// that stands upright; also with solid glass, where flights aim at more than the captors, and with
/// a pane that shows them. 200,000 uniform directions and as many chosen ones, seed 1; 24
/// comparisons with odds of 1e-6 each.
#[test]
fn directions_have_their_density() {
    let wall = Material::Lambert(Lambert::new(&[0.5]).unwrap());
    let glass = Material::Dielectric(Dielectric::new(1.5, &[1.0]).unwrap());
    let pane = Material::Pane(Pane::new(1.5, &[1.0]).unwrap());
    for (side, material) in
        [(3, &wall), (20, &wall), (3, &glass), (20, &glass), (3, &pane), (20, &pane)]
    {
        let scene = squares(side, material.clone());
        let targets = Targets::of(&scene).expect("captors");
        for (n, facing) in [Facing::Anywhere, Facing::Front(Vec3::X)].into_iter().enumerate() {
            // away from the scene's centre, 0.6 m above the squares
            let point = scene.captor_triangles()[0].a + Vec3::new(-0.4, 0.2, 0.6);
            let mut rng = Stream::new(1, side as u64, n as u64);
            let weigh = |d: Vec3| f64::from(d.x + 2.0 * d.y * d.y);
            let ray = |direction: Vec3| Ray { origin: point, direction };
            let view = View::Point(point, facing);
            let [mut all, mut differs] = [Mean::default(); 2];
            for _ in 0..200_000 {
                let d = uniform_cone(2.0, rng.square());
                let density = 4.0 * PI * targets.density(view, &ray(d), Seen::default());
                let direction = chosen(&targets, view, ray, &mut rng);
                all.add(density.into());
                differs.add(f64::from(density) * weigh(d) - weigh(direction));
            }
            all.assert("whole", 1.0, 1e-4);
            differs.assert("weighed", 0.0, 1e-4);
        }
    }
}

/// The same holds for places across a beam from above, and for a beam from below, which comes only
/// to some of the captors, or to all by way of a pane. 200,000 uniform places on a square of 20 m
/// across the beam; 24 comparisons with odds of 1e-6 each.
#[test]
fn places_across_a_beam_have_their_density() {
    const SIDE: f32 = 20.0;
    let wall = Material::Lambert(Lambert::new(&[0.5]).unwrap());
    let glass = Material::Dielectric(Dielectric::new(1.5, &[1.0]).unwrap());
    let pane = Material::Pane(Pane::new(1.5, &[1.0]).unwrap());
    for (side, material) in
        [(3, &wall), (20, &wall), (3, &glass), (20, &glass), (3, &pane), (20, &pane)]
    {
        let scene = squares(side, material.clone());
        let targets = Targets::of(&scene).expect("captors");
        for (n, z) in [-2.0, 3.0].into_iter().enumerate() {
            let beam = Frame::new(Vec3::new(1.0, 0.5, z).normalize());
            let middle = scene.captor_triangles()[0].a - 20.0 * beam.normal;
            let view = View::Beam(beam.normal);
            let ray = |origin: Vec3| Ray { origin, direction: beam.normal };
            let weigh = |p: Vec3| {
                let (x, y) = ((p - middle).dot(beam.tangent), (p - middle).dot(beam.bitangent));
                f64::from(x + 2.0 * y * y)
            };
            let mut rng = Stream::new(1, side as u64, n as u64);
            let [mut all, mut differs] = [Mean::default(); 2];
            for _ in 0..200_000 {
                let [x, y] = [(); 2].map(|()| SIDE * (rng.uniform() - 0.5));
                let place = middle + x * beam.tangent + y * beam.bitangent;
                let density = SIDE * SIDE * targets.density(view, &ray(place), Seen::default());
                let back = |point: Vec3| ray(point - 20.0 * beam.normal);
                let chosen = chosen(&targets, view, back, &mut rng);
                all.add(density.into());
                differs.add(f64::from(density) * weigh(place) - weigh(chosen));
            }
            all.assert("whole", 1.0, 1e-4);
            differs.assert("weighed", 0.0, 1e-4);
        }
    }
}

/// Draws a direction or a place in a view. Its ray must have the same density with what the choice
/// has learned as without.
fn chosen(targets: &Targets, view: View, ray: impl Fn(Vec3) -> Ray, rng: &mut Stream) -> Vec3 {
    let chosen = targets.choose(view, rng);
    let (seen, to) = (chosen.seen, chosen.to.expect("one is in sight"));
    let [known, found] = [seen, Seen::default()].map(|seen| targets.density(view, &ray(to), seen));
    // rounding may make a ray to the rim miss it
    assert!((known - found).abs() <= 1e-5 * known, "{known} {found}");
    assert!(targets.is_sent(&chosen, &ray(to)), "the pane is larger than what it shows");
    to
}
