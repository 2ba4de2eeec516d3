//! Lamps close to what they light: backward paths find the small bright spots, too.

use std::f64::consts::PI;

use serde_json::{Value, json};

use crate::{
    exact::{Comparisons, integral},
    world::{Mesh, Point, World, back, front, room},
};

const UP: Point = [0.0, 0.0, 1.0];
const DOWN: Point = [0.0, 0.0, -1.0];

/// Radius of the ceiling, of the floor and of their distance, m.
const CEILING: f64 = 1.0;
const FLOOR: f64 = 0.8;
const HEIGHT: f64 = 2.0;

fn bulb(z: f64) -> Value {
    json!({ "type": "point", "position": [0, 0, z], "power": 1 })
}

/// Share of a point's light that meets a disc of `radius` at distance `d` around its axis.
fn share(d: f64, radius: f64) -> f64 {
    0.5 * (1.0 - d / d.hypot(radius))
}

/// Share of what a small Lambertian patch sends that meets the floor below; `r` off its axis (Howell, catalogue of
/// configuration factors, B-13).
fn to_floor(r: f64) -> f64 {
    let z = r * r + HEIGHT * HEIGHT + FLOOR * FLOOR;
    0.5 * (1.0 - (z - 2.0 * FLOOR * FLOOR) / (z * z - 4.0 * r * r * FLOOR * FLOOR).sqrt())
}

/// What a bulb of power 1, `h` under a round ceiling, brings to the round floor: straight, and by way of the ceiling of
/// reflectance `rho`.
fn on_floor(h: f64, rho: f64) -> f64 {
    // in place of r the angle from the bulb's axis: evenly spread light, however close the bulb
    let widest = (CEILING / h).atan();
    let by_ceiling = integral(0.0, widest, 400, |a| 0.5 * a.sin() * to_floor(h * a.tan()));
    share(HEIGHT - h, FLOOR) + rho * by_ceiling
}

/// A bulb 1 mm and 2 cm under a white ceiling, and what comes to the floor, a sensor or a surface. Seeds 1 and 4,
/// 6e4 paths each, errors below 0.2 %; 4 comparisons, odds of a false alarm 5e-4. Paths to which no light
/// is sent find 11 % less.
#[test]
fn bulb_close_to_a_white_ceiling() {
    let mut check = Comparisons::new("bulb under a white ceiling", 0.002).rounding(1e-4);
    for (h, seed) in [(0.001, 1), (0.02, 4)] {
        let floor = Mesh::disc([0.0; 3], UP, FLOOR);
        let world = World::new()
            .lambert("white", 0.9)
            .lambert("black", 0.0)
            .surface("ceiling", "white", &Mesh::disc([0.0, 0.0, HEIGHT], DOWN, CEILING))
            .light(bulb(HEIGHT - h));
        let sensor = world.clone().captor("floor", &floor);
        let surface = world.counted("floor", "black", &floor);
        for (what, world) in [("sensor", sensor), ("surface", surface)] {
            let run = world.run_paths(60_000, seed);
            check.flux(format!("{what}, {h} m"), front(&run, "floor"), 0, on_floor(h, 0.9));
        }
    }
    check.finish(4);
}

/// A bulb 1 mm above a captor, as a sensor that counts both sides and as a surface, and 1 mm under a ceiling
/// that counts. Seed 1, 4e4 paths, errors below 0.2 %; 3 comparisons, odds of a false alarm 3e-4.
#[test]
fn bulb_close_to_a_captor() {
    let mut check = Comparisons::new("bulb at a captor", 0.002).rounding(1e-4);
    // 2 m wide: the solid angle that it is seen under
    let (square, h) = (Mesh::square([0.0; 3], UP, 2.0), 0.001f64);
    let lit = (1.0 / (1.0 + h * h)).asin() / PI;
    let world = World::new().lambert("black", 0.0).light(bulb(h));
    let run = world.clone().captor_of_both_sides("sensor", &square).run_paths(40_000, 1);
    check.flux("sensor", front(&run, "sensor"), 0, lit);
    assert_eq!(back(&run, "sensor").flux, [0.0]);
    let run = world.clone().counted("surface", "black", &square).run_paths(40_000, 1);
    check.flux("surface", front(&run, "surface"), 0, lit);
    let run = world.counted("ceiling", "black", &square.flipped()).run_paths(40_000, 1);
    check.flux("back", back(&run, "ceiling"), 0, lit);
    check.finish(3);
}

/// Photons and paths agree in a room with a lamp 1 to 3 mm from its ceiling: a point, a thin tube and a
/// spot that points up; white and glossy. Seeds 1 and 2, 2e5 photons and 6e4 paths, errors below
/// 3 %; 10 comparisons, odds of a false alarm 1e-3.
#[test]
fn lamps_close_to_surfaces() {
    let materials = [
        ("white", json!({ "type": "lambert", "reflectance": 0.8 })),
        ("glossy", json!({ "type": "phong", "reflectance": 0.3, "specular": 0.5, "exponent": 30 })),
    ];
    let line = |radius: f64| {
        json!({ "type": "tube", "from": [-0.3, 0.2, 0.997], "to": [0.4, 0.3, 0.997],
                "radius": radius, "power": 1 })
    };
    let point = json!({ "type": "point", "position": [0.3, 0.2, 0.999], "power": 1 });
    let up = json!({ "type": "spot", "position": [0.3, 0.2, 0.997], "direction": [0.1, 0, 1],
                     "half_angle_deg": 40, "power": 1 });
    let cases = [
        ("white", point.clone()),
        ("glossy", point),
        ("glossy", line(0.001)),
        ("white", up.clone()),
        ("glossy", up),
    ];
    let mut check = Comparisons::new("lamps close to surfaces", 0.03);
    let walls = room([-1.0; 3], [1.0; 3]);
    for (ceiling, lamp) in cases {
        let name = format!("{ceiling}, {}", lamp["type"]);
        let mut world = World::new().lambert("wall", 0.4);
        for (name, material) in &materials {
            world = world.material(name, material.clone());
        }
        let others = (0..4).map(|wall| walls.face(wall)).reduce(Mesh::and).expect("walls");
        let world = world
            .surface("others", "wall", &others)
            .counted("floor", "wall", &walls.face(4))
            .surface("ceiling", ceiling, &walls.face(5))
            .captor("tilted", &Mesh::square([0.2, -0.3, -0.2], [0.6, 0.0, 0.8], 0.8))
            .light(lamp);
        let (photons, paths) = (world.run(200_000, 1), world.run_paths(60_000, 2));
        for captor in ["floor", "tilted"] {
            let [a, b] = [&photons, &paths].map(|run| front(run, captor));
            let error = a.flux_se[0].expect("light").hypot(b.flux_se[0].expect("light"));
            check.add(format!("{name}, {captor}"), b.flux[0], error, a.flux[0]);
        }
    }
    check.finish(10);
}
