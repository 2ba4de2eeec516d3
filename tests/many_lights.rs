//! Scenes with more lights than are scanned one by one: arrays of diodes and of tubes.

use std::f64::consts::PI;

use serde_json::{Value, json};

use crate::{
    exact::Comparisons,
    world::{Mesh, World, front, room},
};

const SENSORS: [[f64; 3]; 3] = [[0.5, 0.5, 0.2], [0.05, 0.9, 0.0], [1.6, -0.4, 0.4]];

/// Returns the places and powers of an array of 20 by 20 diodes, 0.8 m above the floor. Every third
/// is dark, and one corner is ten times as bright.
fn diodes() -> Vec<([f64; 3], f64)> {
    let diode = |i: usize| {
        let (x, y) = (i % 20, i / 20);
        let power = match (x + y) % 3 {
            0 => 0.0,
            _ if x < 4 && y < 4 => 1.0,
            _ => 0.1,
        };
        ([0.05 * x as f64, 0.05 * y as f64, 0.8], power)
    };
    (0..400).map(diode).collect()
}

fn points() -> Vec<Value> {
    let point = |([x, y, z], power): &([f64; 3], f64)| json!({ "type": "point", "position": [x, y, z], "power": power });
    let named = |(i, lamp): (usize, Value)| {
        let mut lamp = lamp;
        lamp["name"] = json!(format!("diode{i}"));
        lamp
    };
    diodes().iter().map(point).enumerate().map(named).collect()
}

fn sensors(world: World) -> World {
    SENSORS.iter().enumerate().fold(world, |world, (i, center)| {
        world.captor(&format!("s{i}"), &Mesh::square(*center, [0.0, 0.0, 1.0], 0.02))
    })
}

/// Irradiances below an array of 400 diodes, also beside it and together with a uniform sky, are the
/// sums over the diodes, by paths, which choose one diode by a tree.
///
/// Seed 1; standard errors at most 0.2 % of the exact value. 6 comparisons, odds of a false alarm
/// 4e-4.
#[test]
fn an_array_of_diodes_is_the_sum_of_them() {
    let mut check = Comparisons::new("diodes", 0.002).rounding(1e-4);
    for sky in [0.0, 0.3] {
        let mut world = points().into_iter().fold(sensors(World::new()), World::light);
        if sky > 0.0 {
            world = world.light(json!({ "type": "sky", "model": "uniform", "irradiance": sky }));
        }
        let result = world.run_paths(150_000, 1);
        for (i, [x, y, z]) in SENSORS.iter().enumerate() {
            let of = |([a, b, c], power): &([f64; 3], f64)| {
                let (d2, up) = ((a - x).powi(2) + (b - y).powi(2) + (c - z).powi(2), c - z);
                power * up / (4.0 * PI * d2 * d2.sqrt())
            };
            let exact = diodes().iter().map(of).sum::<f64>() + sky;
            let sensor = front(&result, &format!("s{i}"));
            check.irradiance(format!("{i}, sky {sky}"), sensor, 0, exact);
        }
    }
    check.finish(6);
}

/// A grey room with 60 tubes, some of which stand in each other's light: paths that meet tubes by
/// chance and by choice find what photons find.
///
/// Seed 1; standard errors at most 2 %. 2 comparisons, odds of a false alarm 1e-4.
#[test]
fn a_room_of_tubes_is_lit_alike_by_both_estimators() {
    let mut check = Comparisons::new("tubes", 0.02);
    let mut world = World::new()
        .lambert("wall", 0.5)
        .surface("room", "wall", &room([-0.5, -0.5, 0.0], [1.5, 1.5, 1.2]))
        .captor("floor", &Mesh::square([0.5, 0.5, 0.05], [0.0, 0.0, 1.0], 0.5))
        .captor("side", &Mesh::square([1.2, 0.4, 0.5], [-1.0, 0.0, 0.0], 0.3));
    for i in 0..60 {
        let (x, y) = (0.1 * f64::from(i % 10), 0.15 * f64::from(i / 10));
        let (from, to) = ([x, y, 0.9], [x + 0.05, y + 0.1, 1.0]);
        world = world.light(json!({
            "name": format!("tube{i}"), "type": "tube", "from": from, "to": to, "radius": 0.004, "power": 1
        }));
    }
    let photons = world.run(2_000_000, 1);
    let paths = world.run_paths(60_000, 1);
    for name in ["floor", "side"] {
        let (a, b) = (front(&photons, name), front(&paths, name));
        let error = a.irradiance_se[0].unwrap().hypot(b.irradiance_se[0].unwrap());
        check.add(name, b.irradiance[0], error, a.irradiance[0]);
    }
    check.finish(2);
}

/// Below three shelves of 400 diodes each that shine down, few paths find light that is not off by
/// many errors, unless they are flagged: 48 sensors, each with 100 paths. Exact are the sums over the
/// diodes.
///
/// Seed 1. With errors from 100 batches the odds that one of 48 normal values is off by 5 errors are
/// 1e-4.
#[test]
fn few_paths_below_many_diodes_are_not_far_off() {
    let diode = |i: usize| {
        let (shelf, at) = (i / 400, i % 400);
        [0.1 * (at % 40) as f64, 0.12 * (at / 40) as f64, 0.9 + 0.6 * shelf as f64]
    };
    let mut world = World::new();
    for i in 0..1200 {
        world = world
            .light(json!({ "type": "point", "name": format!("d{i}"), "position": diode(i),
                                    "cosine": 1, "power": 1 }));
    }
    let place = |s: usize| {
        [0.25 + 0.5 * (s % 8) as f64, 0.3 + 0.4 * (s / 8 % 2) as f64, 0.55 + 0.6 * (s / 16) as f64]
    };
    for s in 0..48 {
        world = world.captor(&format!("s{s}"), &Mesh::square(place(s), [0.0, 0.0, 1.0], 0.01));
    }
    let run = world.run_paths(4_800, 1);
    let (mut flagged, mut squares) = (0, 0.0);
    for s in 0..48 {
        let [x, y, z] = place(s);
        let exact: f64 = (0..1200)
            .map(diode)
            .filter(|[_, _, c]| *c > z)
            .map(|[a, b, c]| {
                let d2 = (a - x).powi(2) + (b - y).powi(2) + (c - z).powi(2);
                (c - z).powi(2) / (PI * d2 * d2)
            })
            .sum();
        let face = front(&run, &format!("s{s}"));
        let off = (face.irradiance[0] - exact) / face.irradiance_se[0].expect("an error");
        if face.few_paths {
            flagged += 1;
        } else {
            assert!(
                off.abs() < 5.0,
                "s{s}: {} for {exact}, off by {off} errors",
                face.irradiance[0]
            );
            squares += off * off;
        }
    }
    assert!(flagged <= 12, "{flagged} flagged");
    let rms = (squares / f64::from(48 - flagged)).sqrt();
    assert!((0.6..1.5).contains(&rms), "{rms}");
}
