//! The light of the sky and the sun behind openings, panes and edges.

use std::f64::consts::PI;

use serde_json::{Value, json};

use crate::{
    exact::{Comparisons, fresnel, integral, rounds_to},
    world::{Mesh, Point, World, front},
};

const UP: Point = [0.0, 0.0, 1.0];

fn sky(model: &str) -> Value {
    json!({ "type": "sky", "model": model, "irradiance": 100 })
}

/// A round captor lies under a round hole in a black roof; it receives only light that passes the
/// hole. Under a uniform sky the exact value is the view factor of two coaxial discs (Howell, A
/// Catalog of Radiation Heat Transfer Configuration Factors, C-41). Under an overcast sky of zenith
/// radiance Lz, a captor with a radius of 1 cm under a hole of half angle t receives Lz / 3 (pi
/// sin^2 t + 4 pi / 3 (1 - cos^3 t)).
///
/// Seed 1; standard errors at most 0.2 % of the exact value. 3 comparisons, odds of a false alarm
/// 2e-4.
#[test]
fn a_round_hole() {
    let mut check = Comparisons::new("round hole", 0.002).rounding(3e-4);
    let (hole, height) = (1.5, 1.0);
    let opening = Mesh::disc([0.0, 0.0, height], UP, hole).0;
    let world = |model: &str, radius: f64| {
        let mut light = sky(model);
        light["through"] = json!(opening);
        World::new().captor("sensor", &Mesh::disc([0.0; 3], UP, radius)).light(light)
    };
    let sensor = 1.5;
    let x = 1.0 + (height * height + hole * hole) / (sensor * sensor);
    let factor = 0.5 * (x - (x * x - 4.0 * (hole / sensor).powi(2)).sqrt());
    let uniform = world("uniform", sensor);
    for (how, run) in [
        ("uniform, photons", uniform.run(350_000, 1)),
        ("uniform, paths", uniform.run_paths(350_000, 1)),
    ] {
        check.irradiance(how, front(&run, "sensor"), 0, 100.0 * factor);
    }
    let (sin2, cos) = (2.25 / 3.25, (1.0f64 / 3.25).sqrt());
    let zenith = 900.0 / (7.0 * PI);
    let exact = zenith / 3.0 * (PI * sin2 + 4.0 * PI / 3.0 * (1.0 - cos.powi(3)));
    let run = world("overcast", 0.01).run_paths(200_000, 1);
    check.irradiance("overcast, paths", front(&run, "sensor"), 0, exact);
    check.finish(3);
}

/// A horizontal captor lies under a thin pane, which covers all of the uniform sky that it sees. It
/// receives 0.8464 of the open sky's irradiance: the mean transmittance over the hemisphere, half
/// from each polarisation.
///
/// Seed 1; standard errors at most 0.2 % of the exact value. 2 comparisons, odds of a false alarm
/// 2e-4.
#[test]
fn a_pane_under_the_sky() {
    let passed =
        |cos: f64| 0.5 * fresnel(cos, 1.52).map(|r| (1.0 - r) / (1.0 + r)).iter().sum::<f64>();
    let exact = integral(0.0, 1.0, 50, |cos| 2.0 * cos * passed(cos));
    rounds_to(exact, 0.8464, 1e-4);
    let world = World::new()
        .material("pane", json!({ "type": "transparent", "ior": 1.52, "thin": true }))
        .surface("pane", "pane", &Mesh::square([0.0, 0.0, 0.001], UP, 2.0))
        .captor("sensor", &Mesh::square([0.0; 3], UP, 1.0))
        .light(sky("uniform"));
    let mut check = Comparisons::new("pane under the sky", 0.002).rounding(3e-4);
    for (how, run) in [("photons", world.run(2_000_000, 1)), ("paths", world.run_paths(200_000, 1))]
    {
        check.irradiance(how, front(&run, "sensor"), 0, 100.0 * exact);
    }
    check.finish(2);
}

/// The sun stands in the zenith and a black roof ends in a straight edge 1 m above the ground. The
/// penumbra of the edge is 2 x 4.65 mm wide. At u, which goes from 0 in the middle of the penumbra
/// to 1 at its bright end, the visible fraction of the sun's disc is (acos(-u) + u sqrt(1 - u^2)) /
/// pi. The captor covers this bright half, where the mean fraction is 1 - 2 / (3 pi).
///
/// Seed 1; standard errors at most 0.2 % of the exact value. 2 comparisons, odds of a false alarm
/// 2e-4.
#[test]
fn the_penumbra_of_an_edge() {
    let half = 0.2666f64.to_radians().tan();
    let world = World::new()
        .lambert("black", 0.0)
        .surface(
            "roof",
            "black",
            &Mesh::rectangle([-0.006, -0.1, 1.0], [0.006, 0.0, 0.0], [0.0, 1.2, 0.0]),
        )
        .captor("bright", &Mesh::rectangle([0.0; 3], [half, 0.0, 0.0], [0.0, 1.0, 0.0]))
        .light(json!({ "type": "sun", "irradiance": 100 }))
        .with("sun_at", json!({ "elevation_deg": 90, "azimuth_deg": 0 }));
    let mut check = Comparisons::new("penumbra", 0.002).rounding(3e-4);
    for (how, run) in [("photons", world.run(1_200_000, 1)), ("paths", world.run_paths(200_000, 1))]
    {
        check.irradiance(how, front(&run, "bright"), 0, 100.0 * (1.0 - 2.0 / (3.0 * PI)));
    }
    check.finish(2);
}

/// In the polar night neither the sun nor the sky gives any light: the irradiance is exactly 0, and
/// a warning for each of the two lights says that it is dark.
#[test]
fn the_polar_night_is_dark() {
    let scene = World::new()
        .with("bands", json!([{ "name": "PAR", "from_nm": 400, "to_nm": 700 }]))
        .with("site", json!({ "latitude": 78.2, "longitude": 15.6 }))
        .with("time", json!("2025-12-21T12:00+01:00"))
        .with("weather", json!({ "direct_normal": 0, "diffuse_horizontal": 0 }))
        .captor("up", &Mesh::square([0.0; 3], UP, 1.0))
        .light(json!({ "type": "sun" }))
        .light(json!({ "type": "sky" }))
        .write();
    for run in [scene.run(1000, 1), scene.run_paths(1000, 1)] {
        assert_eq!(front(&run, "up").irradiance[..], [0.0]);
    }
    let loaded = phylux::load(&scene.path("scene.json")).expect("a scene");
    let warnings = phylux::studies::check(&loaded).expect("a check").warnings;
    let dark = |warning: &&String| warning.contains("no light comes from it: it is dark");
    assert_eq!(warnings.iter().filter(dark).count(), 2, "{warnings:?}");
}
