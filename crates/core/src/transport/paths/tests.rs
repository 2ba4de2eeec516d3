//! Tests of aimed paths against free ones.

use glam::DVec3;

use super::*;
use crate::{
    math::{
        geometry::Triangle,
        odds::{Mean, assert_counts},
    },
    scene::{
        captor::{CaptorKind, Channel},
        light::{Cone, Lamp, Tube},
        material::{Lambert, Material, Phong, PhongFractions},
        world::{Band, CaptorPart, LightPart, NamedMaterial, SceneParts, SurfacePart},
    },
};

/// Two tubes under glossy reflectors, which are bent as parabolas and throw the light on a captor 2
/// m below.
fn lamps() -> SceneParts {
    let strip = |a: DVec3, b: DVec3| {
        let along = DVec3::Y;
        [[a, b, b + along], [a, b + along, a + along]]
    };
    let lamp = |x: f64, name: &str| {
        let [from, to] = [0.2, 0.8].map(|y| DVec3::new(x, y, 2.05));
        LightPart::new(name, Lamp::new([100.0], Tube::whole(from, to, 0.01).unwrap()))
    };
    let reflector = |middle: f64| {
        let at = move |i: i32| {
            let x = 0.02 * f64::from(i);
            DVec3::new(middle + x, 0.0, 2.1 - 5.0 * x * x)
        };
        (-5..5).flat_map(move |i| strip(at(i), at(i + 1)))
    };
    let metal = Phong::new(
        PhongFractions { reflectance: &[0.1], specular: &[0.8], transmittance: &[0.0] },
        Some(100.0),
        &["PAR"],
    )
    .unwrap();
    let corners = [DVec3::ZERO, DVec3::X, DVec3::X + DVec3::Y, DVec3::Y];
    SceneParts {
        bands: vec![Band { name: "PAR".into(), from_nm: None, to_nm: None }],
        lights: vec![lamp(0.2, "left"), lamp(1.5, "right")],
        materials: vec![NamedMaterial { name: "metal".into(), material: Material::Phong(metal) }],
        surfaces: vec![SurfacePart {
            object: None,
            material: 0,
            captor: None,
            triangles: reflector(0.2).chain(reflector(1.5)).collect(),
        }],
        captors: vec![CaptorPart {
            id: "bench".into(),
            kind: CaptorKind::Virtual { both_sides: false },
            triangles: vec![
                [corners[0], corners[1], corners[2]],
                [corners[0], corners[2], corners[3]],
            ],
            groups: vec![],
            sensor: Default::default(),
        }],
        ..SceneParts::default()
    }
}

/// Aiming changes the error, not the value. Seed 1, 2e6 paths each, errors of 0.8 and 0.3 %. The
/// comparison has odds of a false alarm of 6e-5.
#[test]
fn aimed_paths_find_the_same_and_with_less_error() {
    let scene = Scene::new(lamps()).unwrap();
    let reflectors = Reflectors::find(&scene, 1);
    assert!(reflectors.is_some());
    let face = Face::new(&scene, 0, Channel::Front);
    let pilots = [Pilot::NONE, Pilot { reflectors, ..Pilot::NONE }];
    let [free, aimed] = pilots.map(|pilot| {
        let mut mean = Mean::default();
        for path in 0..2_000_000 {
            let mut rng = Stream::new(1, u64::from(pilot.reflectors.is_some()), path);
            mean.add(face.path::<[f32; 1]>(&pilot, false, &mut rng).flux.0[0].into());
        }
        mean
    });
    let errors = [&free, &aimed].map(|mean| mean.standard_error() / mean.mean());
    let z = (free.mean() - aimed.mean()) / free.standard_error().hypot(aimed.standard_error());
    assert!(z.abs() < 4.0, "{} free, {} aimed, z {z}", free.mean(), aimed.mean());
    assert!(errors[0] < 0.01 && errors[1] < 0.5 * errors[0], "{errors:?}");
}

/// The density of the chosen points is that of the choice. 1e5 choices, seed 1, chi-square test
/// over the triangles with odds of a false alarm of 1e-6.
#[test]
fn reflectors_are_chosen_with_their_density() {
    let scene = Scene::new(lamps()).unwrap();
    let reflectors = Reflectors::find(&scene, 1).unwrap();
    let at = Vertex::new(&scene, Vec3::new(0.3, -0.4, -1.0));
    let mut rng = Stream::new(1, 0, 0);
    let mut counts = vec![0; scene.triangles().len()];
    let choices = 100_000;
    for _ in 0..choices {
        let u = rng.uniform();
        let (triangle, _) = reflectors.choose(&scene, &at, u, &mut rng).unwrap();
        counts[triangle] += 1;
    }
    let expected = |(t, triangle): (usize, Triangle)| {
        let density = reflectors.density(&scene, &at, t) / reflectors.share;
        f64::from(density * triangle.area()) * f64::from(choices)
    };
    let expected: Vec<f64> = scene.triangles().iter().enumerate().map(expected).collect();
    let total: f64 = expected.iter().sum();
    assert!((total / f64::from(choices) - 1.0).abs() < 1e-5, "{total}");
    let expected: Vec<f64> = expected.iter().map(|e| e / total * f64::from(choices)).collect();
    assert_counts("reflectors", &counts, &expected);
}

/// Paths aim at nothing where no surface is glossy, or where no lamp shines on a glossy one.
#[test]
fn what_no_lamp_shines_on_is_no_reflector() {
    let mut dull = lamps();
    dull.materials[0].material = Material::Lambert(Lambert::new(&[0.8]).unwrap());
    assert!(Reflectors::find(&Scene::new(dull).unwrap(), 1).is_none());
    let mut dark = lamps();
    let spot = Cone::spot(DVec3::Z, -DVec3::Z, 0.5).unwrap();
    dark.lights = vec![LightPart::new("down", Lamp::new([1.0], spot))];
    assert!(Reflectors::find(&Scene::new(dark).unwrap(), 1).is_none());
}
