//! Changes that must not change a result: where the scene stands, its unit, how many bands are
//! traced together, and how captors are grouped. Also whether standard errors are as large as
//! reported.

use phylux::{RunResult, results::FaceResult};
use serde_json::{Value, json};

use crate::{
    exact::Comparisons,
    world::{Mesh, Point, World, back, front, room},
};

/// Returns a room with a leaf, a glass block, a lamp and a spot, shifted by a vector (m).
pub fn bay(mut world: World, by: Point, per_metre: f64, reflectance: Value) -> World {
    let at = |p: Point| [0, 1, 2].map(|i| (p[i] + by[i]) * per_metre);
    let spot = json!({ "type": "spot", "position": at([0.5, 0.5, 0.9]), "direction": [0.1, 0.2, -1],
                       "half_angle_deg": 40, "power": 3 });
    let lamp = [[-0.7, -0.7, 0.95], [-0.7, -0.3, 0.95], [-0.3, -0.3, 0.95], [-0.3, -0.7, 0.95]];
    world = world
        .material("wall", json!({ "type": "lambert", "reflectance": reflectance }))
        .material("glass", json!({ "type": "transparent", "ior": 1.5 }))
        .material("leaf", json!({ "type": "leaf", "reflectance": 0.3, "transmittance": 0.2 }))
        .counted("room", "wall", &room([-1.0; 3], [1.0; 3]).shifted(by))
        .counted("leaf", "leaf", &Mesh::square([0.0, 0.0, 0.2], [0.0, 0.6, 0.8], 0.8).shifted(by))
        .surface("block", "glass", &Mesh::cuboid([0.2, 0.2, -0.6], [0.6, 0.7, -0.2]).shifted(by))
        .light(spot)
        .light(json!({ "type": "area", "vertices": lamp.map(at), "power": 2 }));
    for (name, center, normal) in [
        ("floor", [-0.3, -0.3, -1.0], [0.0, 0.0, 1.0]),
        ("middle", [-0.3, 0.4, -0.4], [0.0, 0.0, 1.0]),
        ("wall", [-1.0, 0.0, 0.0], [1.0, 0.0, 0.0]),
    ] {
        let square = Mesh::square(center, normal, 0.8).shifted(by);
        world = world.captor_of_both_sides(name, &square);
    }
    world
}

/// Returns the faces of a bay's captors that light reached.
fn faces(run: &RunResult) -> Vec<(String, &FaceResult)> {
    ["room", "leaf", "floor", "middle", "wall"]
        .into_iter()
        .flat_map(|name| {
            let names = [format!("{name}, front"), format!("{name}, back")];
            names.into_iter().zip([front(run, name), back(run, name)])
        })
        .filter(|(_, face)| face.flux_se[0].is_some())
        .collect()
}

/// Compares two independent runs of the same scene.
fn agree(topic: &'static str, one: &RunResult, other: &RunResult, comparisons: usize) {
    let mut check = Comparisons::new(topic, 0.02);
    for ((name, a), (_, b)) in faces(one).into_iter().zip(faces(other)) {
        for band in 0..a.flux.len() {
            let error = a.flux_se[band].unwrap().hypot(b.flux_se[band].unwrap());
            check.add(format!("{name}, band {band}"), a.flux[band], error, b.flux[band]);
        }
    }
    check.finish(comparisons);
}

/// Compares two runs with the same seed. The same photons take the same ways, except for a few that
/// rounding sends elsewhere, so the results differ by far less than their standard errors.
fn same_photons(one: &RunResult, other: &RunResult) {
    for ((name, a), (_, b)) in faces(one).into_iter().zip(faces(other)) {
        let off = (a.flux[0] - b.flux[0]).abs() / a.flux_se[0].unwrap();
        assert!(off < 0.3, "{name}: {} and {} differ by {off:.2} errors", a.flux[0], b.flux[0]);
    }
    for escaped in [one, other].map(|run| run.energy.escaped.first()) {
        assert!(escaped.is_none_or(|&escaped| escaped == 0.0), "{escaped:?}");
    }
}

/// Asks that two independent runs differ by at most 4 errors at the faces that light reaches in the
/// first, whatever the size of the errors.
fn within_4_errors(one: &RunResult, other: &RunResult) {
    let others = faces(other);
    for (name, a) in faces(one) {
        let (_, b) = others.iter().find(|(other, _)| *other == name).expect("the same face");
        let error = a.flux_se[0].unwrap().hypot(b.flux_se[0].unwrap());
        let z = (b.flux[0] - a.flux[0]) / error;
        assert!(z.abs() <= 4.0, "{name}: {} and {}, z {z:.2}", a.flux[0], b.flux[0]);
    }
}

/// The scene stands 10 km from the origin, and it is written in millimetres.
///
/// Seeds 1 and 2, 5e5 photons. 18 comparisons, odds of a false alarm 2e-3.
#[test]
fn place_and_unit_do_not_matter() {
    const FAR: Point = [10_000.0, -10_000.0, 3_000.0];
    let plain = bay(World::new(), [0.0; 3], 1.0, json!(0.6));
    let far = bay(World::new(), FAR, 1.0, json!(0.6));
    let mm = bay(World::in_millimetres(), [0.0; 3], 1000.0, json!(0.6));
    let here = plain.run(500_000, 1);
    same_photons(&here, &far.run(500_000, 1));
    same_photons(&here, &mm.run(500_000, 1));
    agree("10 km away", &here, &far.run(500_000, 2), 9);
    agree("in mm", &here, &mm.run(500_000, 2), 9);
}

/// A triangle, a lamp and a captor stand 1, 30 and 1000 km away. Nothing of them reaches into the
/// room, and neither do their coordinates' rounding errors: photons, paths and the captors that lie in
/// walls count as without them.
///
/// Seeds 1 to 4, 1e5 photons and 5e4 paths. 54 comparisons within 4 errors, odds of a false alarm
/// 5e-3; with the triangle alone and the same seed, all are within 0.3 errors.
#[test]
fn things_far_away_do_not_matter() {
    let near = bay(World::new(), [0.0; 3], 1.0, json!(0.6));
    let (photons, paths) = (near.run(100_000, 1), near.run_paths(50_000, 1));
    for (distance, seed) in [(1e3, 2), (3e4, 3), (1e6, 4)] {
        let at = |x: f64, y: f64, z: f64| [x, y, z].map(|c| c * distance);
        let triangle = Mesh(vec![vec![at(0.7, -0.4, 0.5), at(0.9, 0.3, -0.6), at(0.6, 0.5, 0.8)]]);
        let with_triangle = near.clone().surface("far", "wall", &triangle);
        same_photons(&photons, &with_triangle.run(100_000, 1));
        same_photons(&paths, &with_triangle.run_paths(50_000, 1));
        let pad = Mesh::square(at(-0.3, 0.6, -0.7), [0.0, 0.6, 0.8], 0.1 * distance);
        let with_all = with_triangle
            .captor("far captor", &pad)
            .light(json!({ "type": "point", "position": at(-0.5, -0.6, 0.6), "power": 1 }));
        within_4_errors(&photons, &with_all.run(100_000, seed));
        within_4_errors(&paths, &with_all.run_paths(50_000, seed));
    }
}

/// Twelve equal bands give twelve times the result of one band, bit for bit. Twelve different bands
/// agree with runs of one band each. A sum over bands is the sum of their values, with the error of
/// that sum.
///
/// Seeds 1 to 4, 3e5 photons. 27 comparisons, odds of a false alarm 3e-3.
#[test]
fn bands_do_not_matter_to_each_other() {
    let one = bay(World::new(), [0.0; 3], 1.0, json!(0.6)).run(300_000, 1);
    let twelve = bay(World::new().bands(12), [0.0; 3], 1.0, json!(vec![0.6; 12])).run(300_000, 1);
    for ((name, a), (_, b)) in faces(&one).into_iter().zip(faces(&twelve)) {
        assert_eq!(b.flux[..], [a.flux[0]; 12], "{name}");
        assert_eq!(b.flux_se[..], [a.flux_se[0]; 12], "{name}");
    }

    let rho = |band: usize| 0.05 + 0.06 * band as f64;
    let each: Vec<f64> = (0..12).map(rho).collect();
    let world = bay(World::new().bands(12), [0.0; 3], 1.0, json!(each));
    let sums = json!({ "some": ["b2", "b7", "b11"] });
    let all = world.with("sums", sums).run(300_000, 1);
    for (_, face) in faces(&all) {
        let sum = |values: &[f64]| values[2] + values[7] + values[11];
        assert!((face.flux[12] - sum(&face.flux)).abs() < 1e-12 * face.flux[12]);
        // the bands of one photon rise and fall together
        let errors: Vec<f64> = face.flux_se.iter().map(|se| se.unwrap()).collect();
        let most = [2, 7, 11].map(|b: usize| errors[b]).into_iter().fold(0.0, f64::max);
        assert!(errors[12] >= most && errors[12] <= sum(&errors) * (1.0 + 1e-12));
    }
    let mut check = Comparisons::new("one of twelve bands", 0.08);
    for (band, seed) in [(0, 2), (5, 3), (11, 4)] {
        let alone = bay(World::new(), [0.0; 3], 1.0, json!(rho(band))).run(300_000, seed);
        for ((name, a), (_, b)) in faces(&all).into_iter().zip(faces(&alone)) {
            let error = a.flux_se[band].unwrap().hypot(b.flux_se[0].unwrap());
            check.add(format!("{name}, band {band}"), a.flux[band], error, b.flux[0]);
        }
    }
    check.finish(27);
}

/// Two lamps whose powers differ by 1e8, each in a room of its own. The light in the room of the
/// dim lamp is known as well.
///
/// Seed 1, 4e6 photons, of which half a per cent come from the dim lamp; standard errors at most
/// 0.2 % of the exact value. 2 comparisons, odds of a false alarm 2e-4.
#[test]
fn powers_that_differ_by_1e8() {
    let mut world = World::new().lambert("wall", 0.04);
    for (name, x, power) in [("bright", 0.0, 1e4), ("dim", 3.0, 1e-4)] {
        world = world
            .counted(name, "wall", &room([-1.0; 3], [1.0; 3]).shifted([x, 0.0, 0.0]))
            .light(json!({ "type": "point", "position": [x, 0.3, 0.2], "power": power }));
    }
    let run = world.run(4_000_000, 1);
    let mut check = Comparisons::new("two powers", 0.002);
    check.flux("bright", front(&run, "bright"), 0, 1e4 / 0.96);
    check.flux("dim", front(&run, "dim"), 0, 1e-4 / 0.96);
    check.finish(2);
}

/// Standard errors are as large as reported, also those of groups whose captors share photons. Over
/// 200 seeds, the mean of z2 = ((estimate - exact) / standard error)^2 is that of Student's t. The
/// exact values are view factors of 0.2, of perpendicular squares: two single captors, a group of
/// both, and a group of two captors in the same place, which count the same photons.
///
/// Seeds 1 to 200, 2e4 photons each. 4 comparisons within 4 standard errors of the mean z2 (sqrt(2
/// / 200)), odds of a false alarm 1e-3 (the tail of chi-square is longer than that of a normal
/// law).
#[test]
fn errors_are_honest() {
    const RUNS: usize = 200;
    let wall = Mesh::rectangle([0.0; 3], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]);
    let opposite = Mesh::rectangle([1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, 1.0, 0.0]);
    let floor = Mesh::rectangle([0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]);
    let mut world = World::new()
        .captor("wall", &wall)
        .captor("opposite", &opposite)
        .captor("again", &wall)
        .lamp("lamp", &floor, 1.0);
    for (captor, group) in [(0, "both"), (1, "both"), (2, "none")] {
        world = world.grouped(captor, group);
    }
    let twice = world.clone().grouped(0, "twice").grouped(2, "twice").grouped(1, "none");
    let z2 = |run: &RunResult, group: &str, exact: f64| {
        let face = front(run, group);
        ((face.flux[0] - exact) / face.flux_se[0].unwrap()).powi(2)
    };
    const FACTOR: f64 = 0.200_043_776;
    let mut sums = [0.0; 4];
    for seed in 1..=RUNS as u64 {
        let (run, doubled) = (world.run(20_000, seed), twice.run(20_000, seed));
        let terms = [
            z2(&run, "wall", FACTOR),
            z2(&run, "opposite", FACTOR),
            z2(&run, "both", 2.0 * FACTOR),
            z2(&doubled, "twice", 2.0 * FACTOR),
        ];
        sums.iter_mut().zip(terms).for_each(|(sum, term)| *sum += term);
    }
    let mut check = Comparisons::new("z2", 0.11);
    for (what, sum) in ["captor", "other captor", "two captors", "one twice"].iter().zip(sums) {
        let n = RUNS as f64;
        check.add(*what, sum / n, (2.0 / n).sqrt(), 127.0 / 125.0);
    }
    check.finish(4);
}
