//! Photons in a closed room, where the light has a closed form.

use glam::{DMat3, DVec3};

use super::*;
use crate::{
    math::{
        odds::Mean,
        rng::{Purpose, Streams},
    },
    scene::{
        captor::CaptorKind,
        light::{Cone, Lamp, Strata},
        material::Lambert,
        world::{Band, CaptorPart, LightPart, NamedMaterial, SceneParts, SurfacePart},
    },
};

/// Returns a closed cube with sides of 1 m that reflect 0.1 of the blue and 0.98 of the near
/// infrared, and a lamp in it with these powers, W.
fn room(power: [f64; 2]) -> Scene {
    let corner = |i: usize| DVec3::new((i & 1) as f64, (i >> 1 & 1) as f64, (i >> 2) as f64);
    let sides =
        [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let triangles = |[a, b, c, d]: [usize; 4]| [[a, b, c], [a, c, d]].map(|t| t.map(corner));
    let band = |name: &str| Band { name: name.into(), from_nm: None, to_nm: None };
    let scene = Scene::new(SceneParts {
        bands: vec![band("blue"), band("infrared")],
        lights: vec![LightPart::new(
            "lamp",
            Lamp::new(power, Cone::point(DVec3::new(0.3, 0.4, 0.6))),
        )],
        materials: vec![NamedMaterial {
            name: "wall".into(),
            material: Material::Lambert(Lambert::new(&[0.1, 0.98]).unwrap()),
        }],
        surfaces: vec![SurfacePart {
            object: None,
            material: 0,
            captor: None,
            triangles: sides.into_iter().flat_map(triangles).collect(),
        }],
        ..SceneParts::default()
    });
    scene.unwrap_or_else(|e| panic!("{e}"))
}

/// Returns the power that arrives at the walls per photon, in each band, and the number of arrivals
/// per photon.
fn arrivals(scene: &Scene, photons: u64) -> [Mean; 3] {
    let strata = Strata::new(scene.lights(), photons, scene.lanes());
    let streams = Streams::new(1, Purpose::Run, 0);
    let mut means = [Mean::default(); 3];
    for index in 0..photons {
        let mut rng = streams.history(index);
        let photon = strata.emit::<[f32; 4]>(scene.lights(), index, &mut rng);
        let mut sums = [0.0; 3];
        trace(scene, photon.ray, photon.power, (), &mut rng, |event| {
            if let Event::Arrival { power: Spectrum([blue, infrared, ..]), .. } = event {
                let values = [f64::from(*blue), f64::from(*infrared), 1.0];
                sums.iter_mut().zip(values).for_each(|(sum, value)| *sum += value);
            }
        });
        means.iter_mut().zip(sums).for_each(|(mean, sum)| mean.add(sum));
    }
    means
}

/// Between walls of reflectance r, light arrives 1 / (1 - r) times. A band that the lamp does not
/// emit must keep no photon alive: there are then 1.11 arrivals per photon, not 50. 20,000 and
/// 2,000 photons of seed 1, four comparisons with odds of 1e-6 each.
#[test]
fn only_bands_with_power_keep_a_photon_alive() {
    let [blue, infrared, arrived] = arrivals(&room([1.0, 0.0]), 20_000);
    assert!(infrared.mean() == 0.0 && arrived.mean() < 1.15, "{} arrivals", arrived.mean());
    blue.assert("blue alone", 1.0 / 0.9, 1e-6);
    let [blue, infrared, arrived] = arrivals(&room([1.0, 1.0]), 2_000);
    blue.assert("blue", 1.0 / 0.9, 1e-6);
    infrared.assert("infrared", 50.0, 1e-6);
    arrived.assert("both", 50.0, 1e-6);
}

/// Returns a closed white box with these half sides, m, turned and moved, with a lamp in it. A captor
/// stands at the origin, to which coordinates are relative.
fn box_at(half: DVec3, turn: DMat3, at: DVec3) -> Scene {
    let corner = |i: usize| {
        let side = |bit: usize| if i >> bit & 1 == 0 { -1.0 } else { 1.0 };
        at + turn * (half * DVec3::new(side(0), side(1), side(2)))
    };
    let sides =
        [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let triangles = |[a, b, c, d]: [usize; 4]| [[a, b, c], [a, c, d]].map(|t| t.map(corner));
    let beside = |x: f64, y: f64| DVec3::new(x - 1.0 / 3.0, y - 1.0 / 3.0, 0.0);
    let scene = Scene::new(SceneParts {
        bands: vec![Band { name: "light".into(), from_nm: None, to_nm: None }],
        lights: vec![LightPart::new("lamp", Lamp::new([1.0], Cone::point(at)))],
        materials: vec![NamedMaterial {
            name: "wall".into(),
            material: Material::Lambert(Lambert::new(&[0.98]).unwrap()),
        }],
        surfaces: vec![SurfacePart {
            object: None,
            material: 0,
            captor: None,
            triangles: sides.into_iter().flat_map(triangles).collect(),
        }],
        captors: vec![CaptorPart {
            id: "origin".into(),
            kind: CaptorKind::Virtual { both_sides: false },
            triangles: vec![[beside(0.0, 0.0), beside(1.0, 0.0), beside(0.0, 1.0)]],
            groups: vec![],
            sensor: Default::default(),
        }],
        ..SceneParts::default()
    });
    scene.unwrap_or_else(|e| panic!("{e}"))
}

/// No photon leaves a closed box by an edge or a corner, however large it is, wherever it stands and
/// however it is turned. 20,000 photons of seed 1 with some 50 arrivals each; exact.
#[test]
fn closed_boxes_are_tight() {
    const PHOTONS: u64 = 20_000;
    let turns = |x: f64, y: f64, z: f64| {
        let [x, y, z] = [x, y, z].map(f64::to_radians);
        DMat3::from_rotation_z(z) * DMat3::from_rotation_y(y) * DMat3::from_rotation_x(x)
    };
    let straight = DMat3::IDENTITY;
    let small = DVec3::new(1.5, 1.0, 0.5);
    let far = DVec3::new(400.0, -300.0, 200.0);
    for (half, turn, at) in [
        (small, straight, DVec3::ZERO),
        (small, turns(31.0, 17.0, 53.0), DVec3::ZERO),
        (180.0 * small, straight, DVec3::ZERO),
        (180.0 * small, turns(31.0, 17.0, 53.0), DVec3::ZERO),
        (small, straight, far),
        (small, turns(31.0, 17.0, 53.0), far),
        (small, turns(5.0, 80.0, 3.0), DVec3::new(-40.0, 2000.0, 70.0)),
        (DVec3::new(5.0, 0.2, 0.01), turns(5.0, 80.0, 3.0), DVec3::new(-40.0, 2000.0, 70.0)),
    ] {
        let scene = box_at(half, turn, at);
        let strata = Strata::new(scene.lights(), PHOTONS, scene.lanes());
        let streams = Streams::new(1, Purpose::Run, 0);
        for index in 0..PHOTONS {
            let mut rng = streams.history(index);
            let photon = strata.emit::<[f32; 1]>(scene.lights(), index, &mut rng);
            trace(&scene, photon.ray, photon.power, (), &mut rng, |event| {
                let leaks = matches!(event, Event::Escaped { .. });
                assert!(!leaks, "half sides {half} at {at}: photon {index}");
            });
        }
    }
}

/// On average, what goes on by roulette carries as much as everything would: 100,000 plays of seed
/// 1, odds of a false alarm 1e-6. Where survival is certain no random number is drawn, and a chance
/// of 0 lets nothing go on.
#[test]
fn roulette_keeps_the_mean() {
    let mut rng = Stream::new(1, 0, 0);
    let mut mean = Mean::default();
    for _ in 0..100_000 {
        let onward = roulette(Spectrum([0.3, 0.2]), 0.3, &mut rng);
        assert!(onward.is_none_or(|onward| onward == Spectrum([1.0, 0.2 / 0.3])));
        mean.add(onward.map_or(0.0, |onward| onward.0[1].into()));
    }
    mean.assert("second band", 0.2, 1e-6);
    let before = rng.clone().uniform();
    assert_eq!(roulette(Spectrum([2.0]), 1.5, &mut rng), Some(Spectrum([2.0])));
    assert_eq!(rng.clone().uniform(), before);
    assert_eq!(roulette(Spectrum([0.0]), 0.0, &mut rng), None);
}
