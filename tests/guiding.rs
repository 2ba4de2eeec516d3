//! Guided photons: flights aimed at captors, weight windows and guided emission. All must find the
//! same light as photons alone.

use std::f64::consts::PI;

use phylux::{
    Estimator, Guiding, RunResult,
    results::FaceResult,
    transport::{NearestCount, PhotonCount, ThreadCount, TimeLimit},
};
use serde_json::json;

use crate::{
    bad_input::phylux,
    closed_forms::glass::two_faces,
    common::run_file,
    daylight::{WINDOW, room_with_window},
    exact::{Comparisons, mean_over, polygon_irradiance},
    world::{Mesh, World, back, check_ledger, front, room, room_with_leaf},
};

const UP: [f64; 3] = [0.0, 0.0, 1.0];

fn guided(world: &World, name: &str, photons: u64, seed: u64) -> RunResult {
    let run = world.clone().with("settings", json!({ "guiding": name })).run(photons, seed);
    check_ledger(&run);
    run
}

/// A furnace whose walls have the reflectance 0.5 and emit L / 2. In it are a mirror, a pane of
/// glass, a block of glass and a leaf, all lossless. The irradiance is pi L at any place and tilt
/// and on both sides. Flights are aimed at discs with a radius of 3 cm (one of them 0.1 mm off a
/// wall, one in it), a tilted square, a strip, and a ball of triangles.
///
/// Seed 1, 400,000 photons; standard errors at most 2.5 % of the exact value. 8 comparisons, odds
/// of a false alarm 6e-4.
#[test]
fn furnace_round_aimed_sensors() {
    furnace(400_000, 0.025);
}

/// The same with 12,000,000 photons; standard errors at most 0.5 %.
#[test]
#[ignore = "takes a minute: .ci/nightly runs it"]
fn nightly_furnace_round_aimed_sensors() {
    furnace(12_000_000, 0.005);
}

fn furnace(photons: u64, largest_error: f64) {
    let world = World::new()
        .lambert("wall", 0.5)
        .material("mirror", json!({ "type": "mirror", "reflectance": 1 }))
        .material("pane", json!({ "type": "transparent", "ior": 1.52, "thin": true }))
        .material("glass", json!({ "type": "transparent", "ior": 1.52 }))
        .material("leaf", json!({ "type": "leaf", "reflectance": 0.55, "transmittance": 0.45 }))
        .glowing("walls", "wall", &room([-1.0; 3], [1.0; 3]), 5.0)
        .surface("mirror", "mirror", &Mesh::square([0.5, 0.0, 0.4], [0.0, 0.6, 0.8], 0.5))
        .surface("pane", "pane", &Mesh::square([-0.5, 0.3, 0.0], [0.8, 0.0, 0.6], 0.6))
        .surface("block", "glass", &Mesh::cuboid([-0.2, -0.9, -0.9], [0.4, -0.6, -0.7]))
        .surface("leaf", "leaf", &Mesh::square([0.2, -0.4, -0.4], [0.6, 0.0, 0.8], 0.6))
        .captor_of_both_sides("level", &Mesh::disc([0.0, 0.1, -0.1], [0.0, 0.0, 1.0], 0.03))
        .captor_of_both_sides("tilted", &Mesh::square([-0.3, -0.5, 0.5], [0.6, 0.8, 0.0], 0.05))
        .captor("near", &Mesh::disc([-0.9999, 0.5, 0.3], [1.0, 0.0, 0.0], 0.03))
        .captor("in the wall", &Mesh::disc([0.3, 0.4, -1.0], [0.0, 0.0, 1.0], 0.03))
        .captor("strip", &Mesh::rectangle([-0.5, 0.6, -0.5], [1.0, 0.0, 0.0], [0.0, 0.0, 0.01]))
        .captor("ball", &Mesh::sphere([0.4, 0.5, 0.6], 0.05, 6));
    let run = guided(&world, "aim", photons, 1);
    assert_eq!(run.guiding, Some(Guiding::Aim));
    let mut check = Comparisons::new("furnace, aimed", largest_error);
    for name in ["level", "tilted"] {
        check.irradiance(format!("{name}, front"), front(&run, name), 0, PI * 10.0);
        check.irradiance(format!("{name}, back"), back(&run, name), 0, PI * 10.0);
    }
    for name in ["near", "in the wall", "strip", "ball"] {
        check.irradiance(name, front(&run, name), 0, PI * 10.0);
    }
    check.finish(8);
}

/// A uniform sky of radiance L all around, above and below, with a lossless pane and leaf. The
/// irradiance is pi L = 100 W/m2 at any place and tilt.
///
/// Seed 1, 5,000,000 photons; standard errors at most 0.5 % of the exact value. 6 comparisons, odds
/// of a false alarm 4e-4.
#[test]
fn furnace_of_sky_round_aimed_sensors() {
    let world = World::new()
        .material("pane", json!({ "type": "transparent", "ior": 1.52, "thin": true }))
        .material("leaf", json!({ "type": "leaf", "reflectance": 0.55, "transmittance": 0.45 }))
        .surface("pane", "pane", &Mesh::square([-0.3, 0.3, 0.0], [0.8, 0.0, 0.6], 0.6))
        .surface("leaf", "leaf", &Mesh::square([0.2, -0.4, -0.2], [0.6, 0.0, 0.8], 0.6))
        .captor_of_both_sides("level", &Mesh::disc([0.0, 0.1, -0.1], [0.0, 0.0, 1.0], 0.03))
        .captor_of_both_sides("tilted", &Mesh::square([-0.3, -0.1, 0.4], [0.6, 0.8, 0.0], 0.05))
        .captor("strip", &Mesh::rectangle([-0.5, 0.4, -0.5], [1.0, 0.0, 0.0], [0.0, 0.0, 0.01]))
        .captor("ball", &Mesh::sphere([0.4, 0.4, 0.3], 0.05, 6))
        .light(json!({ "type": "sky", "model": "uniform", "irradiance": 100, "ground": 1 }));
    let run = guided(&world, "aim", 5_000_000, 1);
    let mut check = Comparisons::new("furnace of sky, aimed", 0.005);
    for name in ["level", "tilted"] {
        check.irradiance(format!("{name}, front"), front(&run, name), 0, 100.0);
        check.irradiance(format!("{name}, back"), back(&run, name), 0, 100.0);
    }
    for name in ["strip", "ball"] {
        check.irradiance(name, front(&run, name), 0, 100.0);
    }
    check.finish(6);
}

/// Small captors to which little light comes straight from infinitely far away.
///
/// - Two captors in a black room with a window, which is a hole in one run and the opening of the
///   sky in another. The exact value is the irradiance by the part of the window above the captor's
///   horizon, filled with the sky's radiance.
/// - A captor of 1 mm radius that stands upright in the sun, 1 m above a white floor of 4 x 4 m.
///   The exact value is the sun's irradiance times the cosine of incidence, plus the floor's light
///   by the view factor of a plane at a right angle to the captor.
///
/// Seed 1; standard errors at most 0.5 % of the exact value. 5 comparisons, odds of a false alarm
/// 3e-4.
#[test]
fn light_from_infinity_is_aimed() {
    let mut check = Comparisons::new("from infinity, aimed", 0.005).rounding(1e-4);
    let sky = json!({ "type": "sky", "model": "uniform", "irradiance": 100 });
    let mut opening = sky.clone();
    opening["through"] = json!([WINDOW]);
    for (what, sky, photons) in [("hole", sky, 7_500_000), ("opening", opening, 1_200_000)] {
        let mut world = World::new()
            .lambert("black", 0.0)
            .surface("room", "black", &room_with_window())
            .light(sky);
        let sensors =
            [("level", [1.3, 1.0, 0.8], UP), ("facing", [2.0, 4.0, 1.5], [0.0, -1.0, 0.0])];
        for (name, place, normal) in sensors {
            world = world.captor(name, &Mesh::disc(place, normal, 0.01));
        }
        let run = guided(&world, "aim", photons, 1);
        for (name, place, normal) in sensors {
            let above = WINDOW.map(|[x, y, z]| [x, y, z.max(place[2])]);
            let exact = 100.0 / PI * polygon_irradiance(place, normal, &above);
            check.irradiance(format!("{name}, {what}"), front(&run, name), 0, exact);
        }
    }
    let world = World::new()
        .lambert("white", 0.9)
        .surface("floor", "white", &Mesh::square([0.0; 3], UP, 4.0))
        .captor("sensor", &Mesh::disc([0.0, 0.0, 1.0], [1.0, 0.0, 0.0], 0.001))
        .with("sun_at", json!({ "elevation_deg": 45, "azimuth_deg": 90 }))
        .light(json!({ "type": "sun", "irradiance": 800, "half_angle_deg": 0 }));
    let run = guided(&world, "aim", 100_000, 1);
    let floor = (2.0f64.atan() - (2.0 / 5.0f64.sqrt()).atan() / 5.0f64.sqrt()) / PI;
    let exact = 800.0 * 0.5f64.sqrt() * (1.0 + 0.9 * floor);
    check.irradiance("upright in the sun", front(&run, "sensor"), 0, exact);
    check.finish(5);
}

/// A lamp of radiance L in a black room shines through a thin pane onto a captor of 1 cm; a black
/// blade hides a strip of the lamp. The exact irradiance is E = L times the integral of tau cos
/// cos' V / d2 over the lamp, where tau is the pane's transmittance and V is 1 where the captor
/// sees the lamp. Few photons arrive there unaided.
///
/// Seed 1, 200,000 photons; standard error at most 0.3 % of the exact value. 1 comparison, odds of
/// a false alarm 6e-5.
#[test]
fn lamp_behind_a_pane_and_a_blade() {
    let lamp = Mesh::square([0.0, 0.0, 1.0], [0.0, 0.0, -1.0], 1.0);
    let world = World::new()
        .lambert("black", 0.0)
        .material("pane", json!({ "type": "transparent", "ior": 1.52, "thin": true }))
        .surface("room", "black", &room([-2.0; 3], [2.0; 3]))
        .surface("pane", "pane", &Mesh::square([0.0, 0.0, 0.5], [0.0, 0.0, 1.0], 2.0))
        .surface(
            "blade",
            "black",
            &Mesh::rectangle([0.1, -1.5, 0.6], [0.0, 3.0, 0.0], [0.0, 0.0, 0.3]),
        )
        .lamp("lamp", &lamp, PI)
        .captor("sensor", &Mesh::disc([0.0; 3], [0.0, 0.0, 1.0], 0.005));
    let run = guided(&world, "aim", 200_000, 1);
    // as seen from the middle of the captor; the blade hides x between 0.1 / 0.9 and 0.1 / 0.6
    let of = |corner: f64, width: f64| {
        let seen = |p: [f64; 3]| {
            let d2 = p[0] * p[0] + p[1] * p[1] + 1.0;
            two_faces(d2.sqrt().recip(), true) / (d2 * d2)
        };
        let mean = mean_over([corner, -0.5, 1.0], [width, 0.0, 0.0], [0.0, 1.0, 0.0], seen);
        width * mean
    };
    let exact = of(-0.5, 0.5 + 0.1 / 0.9) + of(0.1 / 0.6, 0.5 - 0.1 / 0.6);
    let mut check = Comparisons::new("pane and blade, aimed", 0.003);
    check.irradiance("sensor", front(&run, "sensor"), 0, exact);
    check.finish(1);
    let plain = guided(&world, "off", 200_000, 1);
    let histories = |run: &RunResult| front(run, "sensor").photons;
    assert!(histories(&run) > 100 * histories(&plain).max(1));
}

/// Returns a room with a leaf, six captors side by side, and one lamp of each kind.
fn lit_room() -> World {
    room_with_leaf(6, 0.3)
        .light(json!({ "type": "point", "position": [0.1, 0.2, 0.7], "power": [3, 4] }))
        .light(json!({ "type": "tube", "from": [-0.5, 0, 0.9], "to": [0.5, 0, 0.9],
                       "radius": 0.02, "power": [2, 0.1] }))
        .light(json!({ "type": "tube", "from": [-0.5, 0.6, 0.9], "to": [0.5, 0.6, 0.9],
                       "radius": 0, "power": [0.5, 0.3] }))
        .light(json!({ "type": "spot", "position": [0.5, 0, 0.9], "direction": [0, 0, -1],
                       "half_angle_deg": 60, "power": [1, 1] }))
        .light(
            json!({ "type": "point", "position": [0.5, -0.6, 0.9], "cosine": 3, "aim": [0, 0, -1],
                       "power": [1, 0.5] }),
        )
        .lamp("panel", &Mesh::square([-0.6, -0.6, 0.8], [0.0, 0.0, -1.0], 0.3), 1.0)
}

fn tiles(run: &RunResult) -> Vec<&FaceResult> {
    run.captors.iter().filter(|c| c.id.starts_with("tiles/")).map(|c| &c.front).collect()
}

/// In a room with lamps of all kinds, aimed flights find the same as photons alone, with at most a
/// third of the variance. 12 fluxes of the small captors are compared, each within 4 combined
/// standard errors. The fluxes of the room's walls and of the leaf are compared as well: aimed
/// flights do not count there, but the two runs use different random numbers.
///
/// Seeds 1 and 2, 100,000 photons; odds of a false alarm 1e-3.
#[test]
fn the_same_with_less_variance() {
    let plain = guided(&lit_room(), "off", 100_000, 1);
    let aimed = guided(&lit_room(), "aim", 100_000, 2);
    assert_eq!((plain.guiding, aimed.guiding), (None, Some(Guiding::Aim)));
    let (mut squares, mut aimed_squares) = (0.0, 0.0);
    let close = |a: f64, b: f64, errors: [Option<f64>; 2]| {
        let [own, other] = errors.map(|error| error.expect("an error"));
        assert!((a - b).abs() < 4.0 * own.hypot(other), "{a} +- {own}, {b} +- {other}");
    };
    for (a, b) in tiles(&plain).into_iter().zip(tiles(&aimed)) {
        for band in 0..2 {
            close(a.flux[band], b.flux[band], [a.flux_se[band], b.flux_se[band]]);
            squares += (a.flux_se[band].unwrap() / a.flux[band]).powi(2);
            aimed_squares += (b.flux_se[band].unwrap() / b.flux[band]).powi(2);
        }
    }
    assert!(squares > 3.0 * aimed_squares, "{}", squares / aimed_squares);
    for name in ["room", "leaf"] {
        let [a, b] = [&plain, &aimed].map(|run| front(run, name));
        close(a.flux[0], b.flux[0], [a.flux_se[0], b.flux_se[0]]);
    }
}

/// A point light faces a square captor that covers a sixth of all directions, in a black room. A
/// history counts at most once in `histories`, although both its own flight and its aimed one may
/// arrive, and nearly all histories arrive. The flux is compared with a sixth of the power.
///
/// Seed 1, 20,000 photons; standard error at most 1 % of the exact value. With 24 photons the
/// results say that few photons arrived.
#[test]
fn counts_are_of_histories() {
    let world = World::new()
        .lambert("black", 0.0)
        .surface("room", "black", &room([-1.0; 3], [1.0; 3]))
        .captor("square", &Mesh::square([0.0, 0.0, 0.5], [0.0, 0.0, -1.0], 1.0))
        .light(json!({ "type": "point", "position": [0, 0, 0], "power": 1 }));
    let run = guided(&world, "aim", 20_000, 1);
    let face = &run.captors[0].front;
    let histories = face.histories.expect("a captor knows its histories");
    assert!(histories <= 20_000 && histories > 10_000, "{histories}");
    assert!(face.photons > histories, "{} of {histories}", face.photons);
    let mut check = Comparisons::new("a sixth, aimed", 0.01);
    check.flux("square", face, 0, 1.0 / 6.0);
    check.finish(1);
    assert!(!face.few_paths);
    let few = guided(&world, "aim", 24, 1);
    assert!(few.captors[0].front.few_paths);
    assert!(few.warnings().iter().any(|w| w.kind == "few photons on a face of a captor"));
}

/// 200 captors, which are divided into a tree of halves. Each agrees with photons alone.
///
/// Seeds 1 and 2, 20,000 photons. The sum of 200 squared z is below 300 (odds of a false alarm 5e-6
/// if the z are normal).
#[test]
fn many_sensors_are_aimed_at() {
    let tiles = (0..200).map(|i| {
        let (x, y) = (f64::from(i % 20), f64::from(i / 20));
        let place = [-0.9 + 0.09 * x, -0.9 + 0.18 * y, -0.4];
        (format!("{i}"), Mesh::square(place, [0.0, 0.0, 1.0], 0.08))
    });
    let world = World::new()
        .lambert("wall", 0.5)
        .surface("room", "wall", &room([-1.0; 3], [1.0; 3]))
        .captors("tiles", tiles)
        .light(json!({ "type": "point", "position": [0.1, 0.2, 0.7], "power": 1 }));
    let [plain, aimed] =
        [("off", 1), ("aim", 2)].map(|(name, seed)| guided(&world, name, 20_000, seed));
    let z = |(a, b): (&phylux::results::CaptorResult, &phylux::results::CaptorResult)| {
        let [own, other] = [a, b].map(|c| c.front.flux_se[0].expect("an error"));
        ((a.front.flux[0] - b.front.flux[0]) / own.hypot(other)).powi(2)
    };
    let sum: f64 = plain.captors.iter().zip(&aimed.captors).map(z).sum();
    assert!(sum < 300.0, "{sum}");
}

/// With `auto`, a trial chooses how photons are guided: it aims at small captors, also learns
/// importance where aimed flights are not enough, and guides nothing where photons alone do as
/// well. The results are those of the chosen kind of guiding, byte for byte, and the choice does
/// not depend on the number of photons.
#[test]
fn a_trial_says_what_pays() {
    let small = World::new()
        .lambert("wall", 0.5)
        .surface("room", "wall", &room([-1.0; 3], [1.0; 3]))
        .captor("sensor", &Mesh::disc([0.0; 3], [0.0, 0.0, 1.0], 0.01))
        .light(json!({ "type": "point", "position": [0.1, 0.2, 0.7], "power": 1 }));
    let large = World::new()
        .lambert("wall", 0.5)
        .surface("room", "wall", &room([-1.0; 3], [1.0; 3]))
        .captor("sheet", &Mesh::square([0.0; 3], [0.0, 0.0, 1.0], 1.98))
        .light(json!({ "type": "point", "position": [0.1, 0.2, 0.7], "power": 1 }));
    let text = |run: &RunResult| serde_json::to_string(run).expect("text");
    let cases = [
        (small, Some(Guiding::Aim), "aim"),
        (large, None, "off"),
        (vent(10.0).0, Some(Guiding::Full), "full"),
    ];
    for (world, chosen, name) in cases {
        for photons in [1000, 5000] {
            let run = guided(&world, "auto", photons, 1);
            assert_eq!(run.guiding, chosen);
            assert!(text(&run) == text(&guided(&world, name, photons, 1)));
        }
    }
}

/// A run that names no estimator takes complete paths where they take a twentieth of the work for the
/// same errors, and says so; photons beside them give the balance of energy and the k nearest. A run
/// that is too short for a trial traces photons, and so does one that asks for them.
#[test]
fn the_default_is_chosen_by_a_trial() {
    let scene = format!("{}/scenes/box.json", env!("CARGO_MANIFEST_DIR"));
    let folder = tempfile::tempdir().expect("a folder");
    let run = |settings: &str| {
        let arguments = format!("run {scene} -o results.json {settings}");
        let output = phylux(folder.path(), &arguments.split(' ').collect::<Vec<_>>());
        assert!(output.status.success(), "{output:?}");
        let said = String::from_utf8_lossy(&output.stdout).into_owned();
        let text = std::fs::read_to_string(folder.path().join("results.json")).expect("results");
        (said, serde_json::from_str::<serde_json::Value>(&text).expect("results"))
    };
    let (said, result) = run("--photons 1e6");
    let line = "complete paths were chosen, for as much work as 1000000 photons: ";
    assert!(
        said.contains(line) && said.contains("(--estimator photons traces photons alone)"),
        "{said}"
    );
    assert_eq!(result["settings"]["work_of_photons"], 1_000_000);
    let floor =
        |at: &str| result.pointer(at).and_then(serde_json::Value::as_f64).expect("a number");
    let [emitted, absorbed, escaped, lost] =
        ["emitted", "absorbed", "escaped", "lost"].map(|part| floor(&format!("/energy/{part}/0")));
    assert!((emitted - absorbed - escaped - lost).abs() < 1e-9 * emitted);
    // the middle of a wall is half a metre from the lamp, which shines on it with 100 / (4 pi 0.5^2), and
    // has about the 16.7 W/m2 of all walls from these; an estimate of some thousand photons has an error
    // of 2 %, and the light falls by less than 5 % within its disc
    let nearest = floor("/captors/0/front/knn/irradiance/0");
    let middle = 100.0 / std::f64::consts::PI + 50.0 / 3.0;
    assert!((nearest / middle - 1.0).abs() < 0.15, "{nearest} {middle}");
    let (said, result) = run("--photons 1e4");
    assert!(said.contains("photons were chosen: the run is too short to try paths"), "{said}");
    assert_eq!(result["estimator"], "photons");
    let (said, _) = run("--photons 1e6 --estimator photons");
    assert!(!said.contains("chosen"), "{said}");
}

/// A default run takes the work of the photons that it is asked for, and a trial says how much less
/// work its errors take than those of photons. So the squared errors of that many photons are larger
/// by this factor, within a factor of 2.5 for what a trial does not know. The scene is a room with six
/// captors side by side.
///
/// Seed 1. The median error rests on a few hundred batches, so the odds of a false alarm are below
/// 1e-6.
#[test]
fn a_trial_says_how_much_less_work_an_error_takes() {
    let world = room_with_leaf(6, 0.3).lamp(
        "panel",
        &Mesh::square([-0.6, -0.6, 0.8], [0.0, 0.0, -1.0], 0.3),
        1.0,
    );
    let run = |settings: serde_json::Value| {
        world.clone().with("settings", settings).write().run(400_000, 1)
    };
    // the squared errors of faces that have light
    let errors = |run: &RunResult| {
        let faces = run.captors.iter().flat_map(|c| [Some(&c.front), c.back.as_ref()]).flatten();
        let squares = faces.flat_map(|face| {
            let pairs = face.flux.iter().zip(&face.flux_se).filter(|(flux, _)| **flux > 0.0);
            pairs
                .map(|(flux, error)| (error.expect("an error") / flux).powi(2))
                .collect::<Vec<f64>>()
        });
        squares.map(f64::ln).collect::<Vec<f64>>()
    };
    let auto = run(json!({ "estimator": "auto", "guiding": "off" }));
    let photons = run(json!({ "estimator": "photons", "guiding": "off" }));
    assert_eq!(auto.estimator, Estimator::Complete);
    let said = auto.chosen.clone().expect("a reason");
    let times: f64 = said.split(' ').next().and_then(|word| word.parse().ok()).expect("a number");
    let mean = |logs: Vec<f64>| logs.iter().sum::<f64>() / logs.len() as f64;
    let found = (mean(errors(&photons)) - mean(errors(&auto))).exp();
    assert!((0.4..2.5).contains(&(found / times)), "{said}: {found}");
}

/// Of a million photons of sun and sky on 900 m of ground hardly any comes to 30 level leaves of 12 cm.
/// The trial of the estimators counts the dark leaves against photons, whatever the seed, and the
/// light on their fronts is that of the sun, 800 W/m2 at 30 degrees, and of the uniform sky, 200 W/m2.
///
/// Seeds 1 to 3; standard errors at most 5 % of the exact value. 9 comparisons, odds of a false alarm
/// 1e-3.
#[test]
fn leaves_on_wide_ground_are_found() {
    let mut world = World::new()
        .lambert("soil", 0.2)
        .material("leaf", json!({ "type": "leaf", "reflectance": 0.1, "transmittance": 0.05 }))
        .surface("ground", "soil", &Mesh::square([0.0; 3], UP, 900.0))
        .with("sun_at", json!({ "elevation_deg": 30, "azimuth_deg": 100 }))
        .light(json!({ "type": "sun", "irradiance": 800 }))
        .light(json!({ "type": "sky", "model": "uniform", "irradiance": 200 }))
        .with("settings", json!({ "estimator": "auto" }));
    for i in 0..30 {
        let at = [f64::from(i % 6), f64::from(i / 6), 0.5];
        world = world.counted(&format!("leaf{i}"), "leaf", &Mesh::square(at, UP, 0.12));
    }
    let mut check = Comparisons::new("leaves on wide ground", 0.05);
    for seed in 1..=3 {
        let run = world.run(1_000_000, seed);
        assert_eq!(run.estimator, Estimator::Complete, "{:?}", run.chosen);
        for leaf in ["leaf0", "leaf13", "leaf29"] {
            check.irradiance(format!("{leaf}, seed {seed}"), front(&run, leaf), 0, 600.0);
        }
        let lit = |face: &FaceResult| face.flux[0] > 0.0 && !face.few_paths;
        assert!(run.captors.iter().all(|captor| lit(&captor.front)));
    }
    check.finish(9);
    // a run that is too short for a trial has one, as its photons leave the leaves dark
    let run = world.run(60_000, 1);
    assert_eq!(run.estimator, Estimator::Complete, "{:?}", run.chosen);
    assert!(run.captors.iter().all(|captor| captor.front.flux[0] > 0.0));
}

/// Outside a grey box with a lamp in it shines a sun without extent. Its walls vary by neither photons
/// nor paths on the outside, which says nothing about which are the cheaper: the ratio is that of the
/// other faces. Seed 1; the odds that a trial of this length finds a ratio beyond these limits are
/// below 1e-6.
#[test]
fn walls_in_the_sun_do_not_decide() {
    let world = World::new()
        .lambert("grey", 0.5)
        .counted("room", "grey", &room([0.0; 3], [1.0; 3]))
        .captor("sensor", &Mesh::disc([0.5, 0.5, 0.1], UP, 0.05))
        .with("sun_at", json!({ "elevation_deg": 40, "azimuth_deg": 150 }))
        .light(json!({ "type": "sun", "irradiance": 100, "half_angle_deg": 0 }))
        .light(json!({ "type": "point", "position": [0.5, 0.5, 0.5], "power": 100 }))
        .with("settings", json!({ "estimator": "auto" }));
    let said = world.run(400_000, 1).provenance.chosen.expect("a reason");
    let (ratio, _) = said.split_once(" times less work than photons").expect("a ratio");
    let ratio: f64 = ratio.parse().expect("a number");
    assert!((1.0..1e4).contains(&ratio), "{said}");
}

/// Where all captors are surfaces, no flights are aimed, and the results are those of photons
/// alone, byte for byte. The test does not depend on chance.
#[test]
fn surfaces_are_not_aimed_at() {
    let world = World::new()
        .lambert("wall", 0.5)
        .counted("room", "wall", &room([-1.0; 3], [1.0; 3]))
        .light(json!({ "type": "point", "position": [0.1, 0.2, 0.7], "power": 1 }));
    let [off, aim] = ["off", "aim"].map(|name| guided(&world, name, 10_000, 1));
    let text = |run: &RunResult| serde_json::to_string(run).expect("text");
    assert!(text(&off) == text(&aim));
}

/// The k-nearest estimate only takes the photons' own flights. The number of stored arrivals with
/// aimed flights is therefore that of photons alone, within 4 standard errors.
///
/// Seeds 1 and 2, 100,000 photons; odds of a false alarm 4e-4.
#[test]
fn nearest_takes_own_flights() {
    let scene = lit_room().write();
    let run = |guiding, seed| {
        run_file(&scene.path("scene.json"), |settings| {
            settings.guiding = guiding;
            (settings.photons, settings.k, settings.seed) =
                (PhotonCount::new(100_000).ok(), NearestCount::new(50).ok(), seed);
        })
    };
    let (plain, aimed) = (run(Guiding::Off, 1), run(Guiding::Aim, 2));
    let arrivals = |run: &RunResult| run.account.map.as_ref().expect("a map").arrivals as f64;
    let (a, b) = (arrivals(&plain), arrivals(&aimed));
    // one photon may arrive several times, so the spread is a little larger than Poisson's
    assert!((a - b).abs() < 4.0 * (3.0 * (a + b)).sqrt(), "{a} and {b}");
}

/// Returns a sphere of radius 1 around (0, 0, z) with its fronts inside, of which only the part
/// between two angles (rad) from the upward axis is kept.
fn ring(z: f64, from: f64, to: f64) -> Mesh {
    const COLUMNS: usize = 120;
    let rows = (60.0 * (to - from) / PI).ceil() as usize;
    let at = |row: usize, column: usize| {
        let (sin, cos) = (from + (to - from) * row as f64 / rows as f64).sin_cos();
        let turn = 2.0 * PI * (column % COLUMNS) as f64 / COLUMNS as f64;
        [sin * turn.cos(), sin * turn.sin(), z + cos]
    };
    let mut polygons = Vec::new();
    for (row, column) in (0..rows).flat_map(|row| (0..COLUMNS).map(move |column| (row, column))) {
        let [a, b] = [at(row, column), at(row, column + 1)];
        let [c, d] = [at(row + 1, column + 1), at(row + 1, column)];
        if row > 0 || from > 0.0 {
            polygons.push(vec![a, b, c]);
        }
        if row + 1 < rows || to < PI {
            polygons.push(vec![a, c, d]);
        }
    }
    Mesh(polygons)
}

/// A chain of integrating spheres of radius 1 on one axis, each cut off where it meets the next. On
/// the wall of a sphere, a part with radiosity B that covers a fraction a of the sphere causes the
/// irradiance a B, everywhere on the wall. The wall of the first sphere emits light; all walls
/// reflect half.
struct Chain {
    /// Irradiance of the wall of each sphere, W/m2.
    walls: Vec<f64>,
    world: World,
}

const RHO: f64 = 0.5;
const EMITTED: f64 = PI * 10.0;

/// Builds one sphere for each entry of `walls`. The caps that are cut off have this height (m). A
/// captor with a radius of 3 cm lies in front of the last sphere's wall.
fn chain(walls: Vec<f64>, height: f64) -> Chain {
    let angle = (1.0 - height).acos();
    let step = 2.0 * (1.0 - height);
    let last = walls.len() - 1;
    let mut world = World::new().lambert("wall", RHO);
    for i in 0..=last {
        let name = format!("{i}");
        let low = if i == last { 0.0 } else { angle };
        let mesh = ring(step * i as f64, low, if i == 0 { PI } else { PI - angle });
        world = match i {
            0 => world.glowing(&name, "wall", &mesh, EMITTED / PI),
            _ if i < last => world.surface(&name, "wall", &mesh),
            _ => world.counted(&name, "wall", &mesh),
        };
    }
    let sensor = [0.0, 0.0, step * last as f64 + 0.999];
    let world = world.captor("sensor", &Mesh::disc(sensor, [0.0, 0.0, -1.0], 0.03));
    Chain { walls, world }
}

/// Compares the irradiance of the last sphere's wall and of the captor in front of it with the
/// closed form. Standard errors are at most 0.5 % of the exact value; 2e-3 is allowed for polygons
/// in place of spheres.
fn check_chain(topic: &'static str, Chain { walls, world }: Chain, photons: u64) {
    let run = guided(&world, "full", photons, 1);
    assert_eq!(run.guiding, Some(Guiding::Full));
    assert!(run.energy.chance.is_some());
    let last = walls.len() - 1;
    let mut check = Comparisons::new(topic, 0.005).rounding(2e-3);
    check.irradiance("wall", front(&run, &format!("{last}")), 0, walls[last]);
    check.irradiance("sensor", front(&run, "sensor"), 0, walls[last]);
    check.finish(2);
}

/// Three spheres in a row, joined by discs that transmit a quarter diffusely and reflect nothing;
/// 0.2 % of the light arrives in the last sphere. A disc receives the irradiance of the cap that it
/// replaces, which is a fraction f of the sphere, divided by 1 - f, because that is the disc's area
/// over the cap's. The light that the disc emits, with the radiant exitance M, causes the
/// irradiance f M on the sphere's wall.
///
/// Seed 1, 500,000 photons. 2 comparisons, odds of a false alarm 1.3e-4.
#[test]
fn chain_of_integrating_spheres() {
    let (height, through) = (0.2, 0.25);
    let f = 0.5 * height;
    let mut walls = vec![0.0; 3];
    for _ in 0..100 {
        let b = [EMITTED + RHO * walls[0], RHO * walls[1], RHO * walls[2]];
        let (from_first, from_third) = (through * b[0], through * b[2]);
        // the middle sphere also lights this disc from the disc on its other side
        let onward = |other: f64| through * (b[1] * (1.0 - 2.0 * f) + other * f) / (1.0 - f);
        walls = vec![
            b[0] * (1.0 - f) + onward(from_third) * f,
            b[1] * (1.0 - 2.0 * f) + (from_first + from_third) * f,
            b[2] * (1.0 - f) + onward(from_first) * f,
        ];
    }
    let angle = f64::acos(1.0 - height);
    let disc = |z: f64| {
        let corner = |k: usize| {
            let (sin, cos) = (2.0 * PI * k as f64 / 120.0).sin_cos();
            [angle.sin() * cos, angle.sin() * sin, z]
        };
        Mesh(vec![(0..120).map(corner).collect()])
    };
    let discs = disc(1.0 - height).and(disc(3.0 * (1.0 - height)));
    let chain = chain(walls, height);
    let cloth = json!({ "type": "phong", "reflectance": 0, "transmittance": through });
    let world = chain.world.material("cloth", cloth).surface("discs", "cloth", &discs);
    check_chain("three spheres", Chain { world, ..chain }, 500_000);
}

/// Two spheres, joined by a hole whose cap is a fortieth of each sphere. The radiosity B is uniform
/// in each sphere.
///
/// Seed 1, 1,000,000 photons. 2 comparisons, odds of a false alarm 1.3e-4.
#[test]
fn two_integrating_spheres() {
    let f = 0.025;
    let mut walls = vec![0.0; 2];
    for _ in 0..100 {
        let b = [EMITTED + RHO * walls[0], RHO * walls[1]];
        walls = vec![b[0] * (1.0 - f) + b[1] * f, b[1] * (1.0 - f) + b[0] * f];
    }
    check_chain("two spheres", chain(walls, 2.0 * f), 1_000_000);
}

/// The results have the same bytes on 1, 2 and 5 threads, including what the pilot learned, in a
/// room with a screen that lets little light pass. The test does not depend on chance.
#[test]
fn threads_do_not_matter_to_what_is_learned() {
    let scene = lit_room()
        .surface("screen", "wall", &Mesh::square([0.0, 0.0, -0.2], [0.0, 0.0, 1.0], 1.9))
        .write();
    let text = |threads: usize| {
        let run = run_file(&scene.path("scene.json"), |settings| {
            settings.guiding = Guiding::Full;
            (settings.photons, settings.k, settings.threads) = (
                PhotonCount::new(3001).ok(),
                Some(NearestCount::NONE),
                ThreadCount::nearest_to(threads),
            );
        });
        assert_eq!(run.guiding, Some(Guiding::Full));
        serde_json::to_string(&run).expect("text")
    };
    let one = text(1);
    assert!(one == text(2) && one == text(5));
}

/// Where importance hardly varies, no weight windows are used, and the results are those of aimed
/// flights alone, byte for byte. The test does not depend on chance.
#[test]
fn windows_stay_away_where_importance_is_even() {
    let world = World::new()
        .lambert("wall", 0.9)
        .surface("room", "wall", &room([-1.0; 3], [1.0; 3]))
        .captor("sensor", &Mesh::disc([0.0; 3], [0.0, 0.0, 1.0], 0.1))
        .light(json!({ "type": "point", "position": [0.1, 0.2, 0.7], "power": 1 }));
    let [full, aim] = ["full", "aim"].map(|name| guided(&world, name, 5000, 1));
    assert_eq!(full.guiding, Some(Guiding::Aim));
    let text = |run: &RunResult| serde_json::to_string(run).expect("text");
    assert!(text(&full) == text(&aim));
}

/// Returns a sphere with a hole in its top and a spot far above it, together with the irradiance of
/// the sphere's wall by reflected light (W/m2). With a half angle of 5 degrees, the beam is about a
/// thousand times as large as the hole. A captor of 1 cm lies in front of the wall, outside the
/// direct beam.
fn vent(half_angle_deg: f64) -> (World, f64) {
    let (height, far, power): (f64, f64, f64) = (0.01, 50.0, 1e5);
    let angle = (1.0 - height).acos();
    let seen = |tan: f64| 1.0 - (1.0 + tan * tan).sqrt().recip();
    // the hole is a polygon of 120 corners
    let step = 2.0 * PI / 120.0;
    let hole = seen(angle.sin() / (far - angle.cos())) * step.sin() / step;
    let enters = power * hole / seen(half_angle_deg.to_radians().tan());
    let f = 0.5 * height;
    let irradiance = RHO * enters / (4.0 * PI * (1.0 - RHO * (1.0 - f)));
    let world = World::new()
        .lambert("wall", RHO)
        .surface("sphere", "wall", &ring(0.0, angle, PI))
        .captor("sensor", &Mesh::disc([0.998, 0.0, 0.0], [-1.0, 0.0, 0.0], 0.01))
        .light(json!({ "type": "spot", "position": [0, 0, far], "direction": [0, 0, -1],
                       "half_angle_deg": half_angle_deg, "power": power }));
    (world, irradiance)
}

/// The flux Phi that enters the sphere through its hole causes the irradiance E = rho Phi / (4 pi
/// r2 (1 - rho (1 - f))) outside the spot that it lights directly. Without guiding, one photon in a
/// thousand enters.
///
/// Seed 1, 100,000 photons; standard error at most 0.5 % of the exact value, and 2e-3 is allowed
/// for polygons in place of spheres. 1 comparison, odds of a false alarm 6e-5.
#[test]
fn light_through_a_vent() {
    let (world, irradiance) = vent(5.0);
    let run = guided(&world, "full", 100_000, 1);
    assert_eq!(run.guiding, Some(Guiding::Full));
    assert!(!run.starved);
    let mut check = Comparisons::new("vent", 0.005).rounding(2e-3);
    check.irradiance("sensor", front(&run, "sensor"), 0, irradiance);
    check.finish(1);
}

/// Where so few pilot photons find the captor that their result is left to chance, lamps are not
/// guided, and the run warns. Here a spot that shines nearly everywhere sends four of two million
/// pilot photons into the sphere.
///
/// Seed 1; the odds that 25 photons enter, enough for a sufficiently small error, are 1e-11.
#[test]
fn a_starved_pilot_warns() {
    let (world, _) = vent(170.0);
    let run = guided(&world, "full", 2000, 1);
    assert!(run.starved);
    assert!(run.warnings().iter().any(|warning| warning.kind == "lamps are not guided"));
}

/// A lamp in a closed room of thick walls, and a sensor outside, which no light reaches: whatever is
/// learned of the outside, the energy balance closes within the error of its games of chance, and
/// nearly all power is absorbed. A trial does not take importance for cheap because its photons end.
///
/// Seeds 1 to 4, 50,000 photons; 4 comparisons within 4 standard errors, odds 3e-4.
#[test]
fn games_of_chance_where_nothing_can_be_reached() {
    const WALL: f64 = 0.15;
    let (low, high) = (-WALL, 1.0 + WALL);
    let walls = [
        Mesh::cuboid([low, low, low], [high, high, 0.0]),
        Mesh::cuboid([low, low, 1.0], [high, high, high]),
        Mesh::cuboid([low, low, 0.0], [0.0, high, 1.0]),
        Mesh::cuboid([1.0, low, 0.0], [high, high, 1.0]),
        Mesh::cuboid([0.0, low, 0.0], [1.0, 0.0, 1.0]),
        Mesh::cuboid([0.0, 1.0, 0.0], [1.0, high, 1.0]),
    ];
    let walls = walls.into_iter().reduce(Mesh::and).expect("walls");
    let world = World::new()
        .lambert("white", 0.9)
        .surface("walls", "white", &walls)
        .captor_of_both_sides("outside", &Mesh::square([0.5, 0.5, 3.0], UP, 2.0))
        .light(json!({ "type": "point", "position": [0.5, 0.5, 0.4], "power": 10 }));
    for seed in 1..=4 {
        let run = guided(&world, "full", 50_000, seed);
        if let (Some(chance), Some(error)) = (&run.energy.chance, &run.energy.chance_se) {
            let (chance, error) = (chance[0], error[0].expect("an error"));
            assert!(chance.abs() <= 4.0 * error, "{seed}: {chance} +- {error}");
            assert!((run.energy.absorbed[0] - 10.0).abs() < 1.0, "{seed}: {:?}", run.energy);
        }
    }
    let run = guided(&world, "auto", 50_000, 1);
    assert_eq!(run.guiding, None);
    assert!((run.energy.absorbed[0] - 10.0).abs() < 1e-6, "{:?}", run.energy);
}

/// Where the time is up before planning begins, photons are guided by what needs no planning, and the
/// results name it. Chance and the clock play no part in this.
#[test]
fn planning_ends_with_its_time() {
    let lamp = json!({ "type": "point", "position": [0.3, 0.2, 0.4], "power": 1 });
    let scene = room_with_leaf(2, 0.5).light(lamp).write();
    for (asked, done) in [(Guiding::Full, Some(Guiding::Aim)), (Guiding::Auto, Some(Guiding::Aim))]
    {
        let result = run_file(&scene.path("scene.json"), |settings| {
            settings.guiding = asked;
            settings.max_time = TimeLimit::new(1e-9).ok();
            settings.photons = PhotonCount::new(1_000_000).ok();
        });
        assert_eq!(result.guiding, done, "{asked:?}");
    }
}
