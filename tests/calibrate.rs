//! Powers of lamps from measured readings: known factors are recovered, and readings in a real
//! growth chamber are predicted.

use std::path::Path;

use phylux::{RunResult, results::Calibration};
use serde_json::{Value, json};

use crate::{
    bad_input::phylux,
    common::{TestScene, shared},
    world::{self, Mesh, World, beam},
};

const LAMPS: [&str; 3] = ["left", "middle", "right"];
/// Factors of the lamps in two bands, which differ much.
const FACTORS: [[f64; 2]; 3] = [[0.7, 1.3], [1.2, 0.9], [1.0, 0.5]];

/// Returns a scene with 24 sensors under three lamps in the open, in two bands and their sum.
fn scene() -> TestScene {
    let lamp = |i: usize| json!({ "name": LAMPS[i], "type": "point", "position": [i as f64, 0.3 * i as f64, 1], "power": [100, 50] });
    let mut captors = "id,x,y,z,radius,nx,ny,nz\n".to_string();
    for i in 0..24 {
        let (x, y) = (0.5 * (i % 6) as f64 - 0.2, 0.4 * (i / 6) as f64 - 0.3);
        captors += &format!("s{i},{x},{y},0,0.2,0,0,1\n");
    }
    let scene = json!({
        "name": "lamps", "bands": [{ "name": "blue" }, { "name": "red" }], "sums": { "both": ["blue", "red"] },
        "lights": [lamp(0), lamp(1), lamp(2)], "captors": [{ "csv": "sensors.csv" }],
        "settings": { "photons": 400_000, "k": 0 }
    });
    TestScene::new(&scene.to_string(), &[("sensors.csv", &captors)])
}

fn command(scene: &TestScene, arguments: &str) -> (Option<i32>, String, String) {
    let arguments: Vec<&str> = arguments.split(' ').collect();
    let output = phylux(&scene.path(""), &arguments);
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (output.status.code(), text(&output.stdout), text(&output.stderr))
}

fn calibration(folder: &Path) -> Calibration {
    let text = std::fs::read_to_string(folder.join("calibration.json")).expect("a calibration");
    serde_json::from_str(&text).expect("JSON")
}

/// Writes the readings of an instrument if the lamps had these factors. Reading i is multiplied by
/// 1 + `error(i)`.
fn readings(result: &RunResult, error: impl Fn(usize) -> f64) -> String {
    let mut text = "captor,band,value,use\n".to_string();
    for (i, captor) in result.captors.iter().enumerate() {
        for (b, band) in ["blue", "red"].into_iter().enumerate() {
            let lights = captor.front.by_light.as_ref().expect("by light");
            let parts = lights.values().zip(FACTORS);
            let value: f64 = parts.map(|(part, factors)| part.irradiance[b] * factors[b]).sum();
            let value = value * (1.0 + error(2 * i + b));
            let purpose = if i % 3 == 0 { "fit" } else { "test" };
            text += &format!("{},{band},{value},{purpose}\n", captor.id);
        }
    }
    text
}

/// Readings that are computed from the simulation itself with known factors give these factors
/// back. The calibrated scene has powers by these factors, and a mix of the run with them gives the
/// readings. With one common factor for all lamps, the residual shows that this model does not fit.
#[test]
fn known_factors_are_found_again() {
    let scene = scene();
    let traced = command(&scene, "run scene.json --by-light -o all.json");
    assert_eq!(traced.0, Some(0), "{}", traced.2);
    let all = phylux::formats::read_json(&scene.path("all.json")).expect("results");
    std::fs::write(scene.path("m.csv"), readings(&all, |_| 0.0)).expect("a file");

    let done = command(&scene, "calibrate scene.json m.csv --results all.json --prior none");
    assert_eq!(done.0, Some(0), "{}", done.2);
    let found = calibration(&scene.path(""));
    assert_eq!(found.model.name(), "lamps");
    assert_eq!(found.covariance.len(), 6);
    for (lamp, factors) in LAMPS.iter().zip(FACTORS) {
        for (b, factor) in factors.into_iter().enumerate() {
            assert!((found.factors[*lamp][b] - factor).abs() < 1e-6, "{:?}", found.factors);
            // the readings are exact: the factors' errors come from the simulation's errors only
            assert!(found.factors_se[*lamp][b].expect("an error") < 0.2);
        }
    }
    assert!(found.test_rmse.iter().all(|rmse| rmse.expect("tests") < 1e-6));
    assert_eq!(found.test_inside, Some(1.0));
    let text = std::fs::read_to_string(scene.path("calibrated.json")).expect("a scene");
    let written: Value = serde_json::from_str(&text).expect("JSON");
    for (i, factors) in FACTORS.iter().enumerate() {
        for (b, power) in [100.0, 50.0].into_iter().enumerate() {
            let now = written["lights"][i]["power"][b].as_f64().expect("a number");
            assert!((now / power - factors[b]).abs() < 1e-6);
        }
    }
    // a mix by the same factors gives the readings, and their sums
    let mixed = command(&scene, "mix all.json --calibration calibration.json -o mixed.json");
    assert_eq!(mixed.0, Some(0), "{}", mixed.2);
    let mixed = phylux::formats::read_json(&scene.path("mixed.json")).expect("results");
    for (reading, captor) in found.readings.chunks(2).zip(&mixed.captors) {
        let face = &captor.front;
        assert!((face.irradiance[0] / reading[0].measured.expect("a reading") - 1.0).abs() < 1e-6);
        assert!((face.irradiance[1] / reading[1].measured.expect("a reading") - 1.0).abs() < 1e-6);
        let sum = face.irradiance[0] + face.irradiance[1];
        assert!((face.irradiance[2] / sum - 1.0).abs() < 1e-12);
        assert!(face.irradiance_se.iter().all(|error| error.is_some_and(|error| error > 0.0)));
    }
    // the calibrated scene is written to another folder and read there
    std::fs::create_dir(scene.path("other")).expect("a folder");
    let done = command(&scene, "calibrate scene.json m.csv --results all.json -o other/c.json");
    assert_eq!(done.0, Some(0), "{}", done.2);
    phylux::load(&scene.path("other/c.json")).expect("a scene whose files are found");
    // what was found is named after the scene
    assert!(scene.path("other/c-calibration.json").is_file());
    assert!(!scene.path("other/calibration.json").exists());
    // a model with fewer factors than the lamps have: the residual shows it
    let done = command(&scene, "calibrate scene.json m.csv --results all.json --model common");
    assert_eq!(done.0, Some(0), "{}", done.2);
    assert!(calibration(&scene.path("")).residual.iter().all(|residual| *residual > 0.1));
    // the lamps of a group share their factors
    let done =
        command(&scene, "calibrate scene.json m.csv --results all.json --group *t --model lamps");
    assert_eq!(done.0, Some(0), "{}", done.2);
    let found = calibration(&scene.path(""));
    assert_eq!(found.lamps, ["*t", "middle"]);
    assert_eq!(found.factors["left"], found.factors["right"]);
}

/// Readings that are 3 % off by fixed patterns of signs, calibrated with a run of another seed. The
/// true factors are within 4 standard errors, and of 96 test readings at least 85 % are in their
/// 95 % intervals.
///
/// Seed 2 for the calibration; the outcome is fixed with it.
#[test]
fn noisy_readings_have_honest_intervals() {
    let scene = scene();
    let traced = command(&scene, "run scene.json --by-light -o all.json");
    assert_eq!(traced.0, Some(0), "{}", traced.2);
    let all = phylux::formats::read_json(&scene.path("all.json")).expect("results");
    let mut inside = 0.0;
    for pattern in 0..3 {
        let sign = |i: usize| {
            let i = i + 7 * pattern;
            if (i * i / 3 + i / 5).is_multiple_of(2) { 0.03 } else { -0.03 }
        };
        std::fs::write(scene.path("m.csv"), readings(&all, sign)).expect("a file");
        let arguments = "calibrate scene.json m.csv --seed 2 --model lamps --prior none";
        let done = command(&scene, arguments);
        assert_eq!(done.0, Some(0), "{}", done.2);
        let found = calibration(&scene.path(""));
        for (lamp, factors) in LAMPS.iter().zip(FACTORS) {
            for (b, factor) in factors.into_iter().enumerate() {
                let error = found.factors_se[*lamp][b].expect("an error");
                assert!(error > 0.005 && (found.factors[*lamp][b] - factor).abs() < 4.0 * error);
            }
        }
        inside += found.test_inside.expect("tests") / 3.0;
    }
    assert!(inside >= 0.85, "{inside}");
}

/// Where the readings' own errors explain what is left, more photons would change nothing, and
/// nobody is told to trace more. Readings of another run that say to be exact leave the simulation's
/// errors alone, so that more photons help.
///
/// Seeds 1 and 2, 20,000 photons: errors of the simulation are some 1 %, those of the readings 15 %.
#[test]
fn more_photons_are_asked_for_only_where_they_help() {
    let scene = scene();
    let traced = command(&scene, "run scene.json --by-light --photons 20000 -o all.json");
    assert_eq!(traced.0, Some(0), "{}", traced.2);
    let all = phylux::formats::read_json(&scene.path("all.json")).expect("results");
    let exact = readings(&all, |_| 0.0);
    let with_sd = |line: &str| match line.starts_with("captor") {
        true => format!("{line},sd\n"),
        false => {
            let value: f64 = line.split(',').nth(2).unwrap().parse().unwrap();
            format!("{line},{}\n", 0.15 * value)
        }
    };
    let rough: String = exact.lines().map(with_sd).collect();
    for (readings, asked) in [(exact, true), (rough, false)] {
        std::fs::write(scene.path("m.csv"), readings).expect("a file");
        let arguments =
            "calibrate scene.json m.csv --seed 2 --photons 20000 --model lamps --prior none";
        let done = command(&scene, arguments);
        assert_eq!(done.0, Some(0), "{}", done.2);
        assert_eq!(done.2.contains("trace more"), asked, "{}", done.2);
    }
}

/// The reflectance of a wall is found together with the powers of two lamps: sensors below the
/// lamps determine the powers, and those beside them the wall. The readings come from another run,
/// with a reflectance of 0.6 and other powers. The found reflectance is within 4 standard errors of
/// 0.6.
#[test]
fn a_wall_is_found_beside_the_lamps() {
    let room = |reflectance: f64, powers: [f64; 2]| {
        let mut world = World::new()
            .lambert("wall", reflectance)
            .surface("room", "wall", &world::room([0.0; 3], [4.0, 3.0, 2.5]))
            .with("settings", json!({ "photons": 60_000, "k": 0 }));
        for (x, power) in [1.0, 3.0].into_iter().zip(powers) {
            let lamp = beam([x, 1.5, 2.4], [x, 1.5, 0.0], 20.0);
            let named = json!({ "name": format!("at {x}"), "power": power });
            let lamp = [lamp, named].into_iter().flat_map(|v| v.as_object().expect("keys").clone());
            world = world.light(lamp.collect::<serde_json::Map<_, _>>().into());
        }
        let sensor = |i: usize| {
            let place = [0.5 + (i % 4) as f64, 0.5 + (i / 4) as f64, 0.05];
            (format!("{i}"), Mesh::square(place, [0.0, 0.0, 1.0], 0.6))
        };
        world.captors("sensors", (0..12).map(sensor)).write()
    };
    let truth = room(0.6, [24.0, 16.0]).run(60_000, 7);
    let mut table = "captor,value,sd\n".to_string();
    for captor in &truth.captors {
        let [value, error] =
            [captor.front.irradiance[0], captor.front.irradiance_se[0].expect("an error")];
        table += &format!("{},{value},{error}\n", captor.id);
    }
    let scene = room(0.5, [20.0, 20.0]);
    std::fs::write(scene.path("m.csv"), table).expect("a file");
    let command_line = "calibrate scene.json m.csv --model lamps --prior none --vary";
    let done = command(&scene, &format!("{command_line} /materials/wall/reflectance=0.4:0.7"));
    assert_eq!(done.0, Some(0), "{}", done.2);
    assert!(done.1.contains("/materials/wall/reflectance: 0."), "{}", done.1);
    let found = calibration(&scene.path(""));
    let wall = &found.varied[0];
    let error = wall.standard_error.expect("an error");
    assert!(error < 0.05 && (wall.value - 0.6).abs() < 4.0 * error, "{wall:?}");
    assert_eq!((wall.given, wall.from, wall.to), (0.5, 0.4, 0.7));
    let text = std::fs::read_to_string(scene.path("calibrated.json")).expect("a scene");
    let written: Value = serde_json::from_str(&text).expect("JSON");
    let reflectance = written["materials"]["wall"]["reflectance"].as_f64().expect("a number");
    assert!((reflectance - wall.value).abs() < 1e-12);
    for (i, power) in [24.0, 16.0].into_iter().enumerate() {
        let now = written["lights"][i]["power"][0].as_f64().expect("a number");
        assert!((now / power - 1.0).abs() < 0.1, "{now}");
    }
    // a prior of 0.02 around 0.5 holds the reflectance nearer to 0.5, and a narrow range stops it
    // at its border
    let done =
        command(&scene, "calibrate scene.json m.csv --vary /materials/wall/reflectance=0.4:0.7");
    assert_eq!(done.0, Some(0), "{}", done.2);
    let held = calibration(&scene.path("")).varied[0].value;
    assert!(held > 0.5 && held < wall.value, "{held}");
    let done = command(&scene, &format!("{command_line} /materials/wall/reflectance=0.45:0.5"));
    assert!(done.2.contains("`/materials/wall/reflectance` is best at a border"), "{}", done.2);
    for (vary, sentence) in [
        (
            "/materials/wal/reflectance=0.4:0.7",
            "--vary: scene.json: /materials/wal/reflectance: there is nothing",
        ),
        ("/materials/wall=0.4:0.7", "--vary: scene.json: /materials/wall: is neither a number nor"),
        ("/materials/wall/reflectance=0.4", "must be a place in the scene and a range"),
        ("/materials/wall/reflectance=0.5:1.5", "scene.json: /materials/wall/reflectance: 1.5"),
    ] {
        let refused = command(&scene, &format!("{command_line} {vary}"));
        assert_eq!(refused.0, Some(2), "{vary}");
        assert!(refused.2.contains(sentence), "{}\n{sentence}", refused.2);
    }
}

/// Three reflectances are found together with the powers of two lamps that differ by half, from two
/// different scenes, in a few runs each. The readings, in two bands of which the wall reflects half as
/// much in one, come from another run. So are the two numbers of the wall, each by itself.
///
/// Eight values within 4 standard errors: odds of a false alarm 5e-4.
#[test]
fn surfaces_are_found_together() {
    let truth = [0.7, 0.3, 0.5];
    let room = |[wall, floor, board]: [f64; 3], powers: [f64; 2]| {
        let tent = world::room([0.0; 3], [4.0, 3.0, 2.5]);
        let mut world = World::new()
            .bands(2)
            .material("wall", json!({ "type": "lambert", "reflectance": [1.3 * wall, 0.7 * wall] }))
            .lambert("floor", floor)
            .material("board", json!({ "type": "phong", "reflectance": board, "specular": 0.1 }))
            .surface("room", "wall", &tent)
            .surface("floor", "floor", &Mesh::square([2.0, 1.5, 0.01], [0.0, 0.0, 1.0], 3.0))
            .surface("board", "board", &Mesh::square([0.05, 1.5, 1.2], [1.0, 0.0, 0.0], 2.0))
            .with("settings", json!({ "photons": 60_000, "k": 0 }));
        for (x, power) in [1.0, 3.0].into_iter().zip(powers) {
            let lamp = beam([x, 1.5, 2.4], [x, 1.5, 0.0], 40.0);
            let named = json!({ "name": format!("at {x}"), "power": power });
            let lamp = [lamp, named].into_iter().flat_map(|v| v.as_object().expect("keys").clone());
            world = world.light(lamp.collect::<serde_json::Map<_, _>>().into());
        }
        let turned = |i: usize| match i % 4 {
            0 => [0.0, 0.0, 1.0],
            1 => [0.0, 0.0, -1.0],
            2 => [-1.0, 0.0, 0.0],
            _ => [0.0, 1.0, 0.0],
        };
        let sensor = |i: usize| {
            let place = [0.4 + 0.45 * (i % 8) as f64, 0.4 + 0.7 * (i / 8) as f64, 0.6];
            (format!("{i}"), Mesh::square(place, turned(i + i / 8), 0.4))
        };
        world.captors("sensors", (0..32).map(sensor)).write()
    };
    let run = room(truth, [30.0, 15.0]).run(600_000, 7);
    let mut table = "captor,band,value,sd\n".to_string();
    for captor in &run.captors {
        for band in 0..2 {
            let value = captor.front.irradiance[band];
            let sd = captor.front.irradiance_se[band].expect("an error").max(0.01 * value);
            table += &format!("{},{},{value},{sd}\n", captor.id, run.bands[band].name);
        }
    }
    for (start, seed) in [([0.55, 0.5, 0.3], 1), ([0.75, 0.1, 0.7], 2)] {
        let scene = room(start, [20.0, 20.0]);
        std::fs::write(scene.path("m.csv"), &table).expect("a file");
        let vary = ["wall", "floor", "board"]
            .map(|name| format!("--vary /materials/{name}/reflectance=0.05:0.75"))
            .join(" ");
        let done = command(
            &scene,
            &format!("calibrate scene.json m.csv --model lamps --prior none --seed {seed} {vary}"),
        );
        assert_eq!(done.0, Some(0), "{}", done.2);
        let found = calibration(&scene.path(""));
        assert!(found.runs.is_some_and(|runs| (2..=6).contains(&runs)), "{:?}", found.runs);
        for (varied, exact) in found.varied.iter().zip(truth) {
            let error = varied.standard_error.expect("an error");
            assert!(error < 0.05 && (varied.value - exact).abs() < 4.0 * error, "{varied:?}");
        }
        for (name, exact) in [("at 1", 30.0 / 20.0), ("at 3", 15.0 / 20.0)] {
            let factors = &found.factors[name];
            assert!(factors.iter().all(|f| (f / exact - 1.0).abs() < 0.1), "{name}: {factors:?}");
        }
    }
    // of the wall each band by itself, 0.91 and 0.49, also from another ratio
    let scene = room([0.6, 0.3, 0.5], [20.0, 20.0]);
    std::fs::write(scene.path("m.csv"), &table).expect("a file");
    let vary = "--vary /materials/wall/reflectance/0=0.7:0.97 --vary /materials/wall/reflectance/1=0.2:0.7";
    let done =
        command(&scene, &format!("calibrate scene.json m.csv --model lamps --prior none {vary}"));
    assert_eq!(done.0, Some(0), "{}", done.2);
    let found = calibration(&scene.path(""));
    for (varied, exact) in found.varied.iter().zip([1.3 * truth[0], 0.7 * truth[0]]) {
        let error = varied.standard_error.expect("an error");
        assert!(error < 0.05 && (varied.value - exact).abs() < 4.0 * error, "{varied:?}");
    }
    // powers are no numbers that may vary beside their factors
    let scene = room(truth, [20.0; 2]);
    std::fs::write(scene.path("m.csv"), &table).expect("a file");
    let vary =
        ["/lights/0/power=10:30", "/lights/1/power=10:30", "/materials/floor/reflectance=0.1:0.2"]
            .map(|range| format!("--vary {range}"))
            .join(" ");
    let refused = command(&scene, &format!("calibrate scene.json m.csv {vary}"));
    assert_eq!(refused.0, Some(2));
    assert!(refused.2.contains("--vary: 3 numbers, of some of which no run"), "{}", refused.2);
}

#[test]
fn what_cannot_be_calibrated_is_refused() {
    let scene = scene();
    let traced = command(&scene, "run scene.json --by-light --photons 2e4 -o all.json");
    assert_eq!(traced.0, Some(0), "{}", traced.2);
    let traced = command(&scene, "run scene.json --photons 2e4 -o whole.json");
    assert_eq!(traced.0, Some(0), "{}", traced.2);
    for (table, arguments, sentence) in [
        (
            "captor,band,value\nsensors/s,blue,1",
            "--results all.json",
            "m.csv:2: no captor `sensors/s`; did you mean `sensors/s",
        ),
        (
            "captor,band,value\nsensors/s1,bleu,1",
            "--results all.json",
            "m.csv:2: no band `bleu`; did you mean `blue`?",
        ),
        (
            "captor,value\nsensors/s1,1",
            "--results all.json",
            "m.csv:2: no column says in which band was measured",
        ),
        (
            "captor,band,value,face\nsensors/s1,blue,1,back",
            "--results all.json",
            "m.csv:2: captor `sensors/s1` has no back",
        ),
        (
            "captor,band,value,use\nsensors/s1,blue,1,test",
            "--results all.json",
            "m.csv: no reading in band `blue` is to be fitted",
        ),
        (
            "captor,band,value\nsensors/s1,blue,1\nsensors/s2,both,1",
            "--results all.json",
            "m.csv: band `blue` was measured alone and in a sum",
        ),
        (
            "captor,band,value\nsensors/s1,blue,1",
            "--results all.json --model lamps --prior none",
            "m.csv: the measured points cannot tell the lamps apart",
        ),
        (
            "captor,band,value\nsensors/s1,blue,1",
            "--results all.json --group x*",
            "--group: no light fits `x*`",
        ),
        (
            "captor,band,value\nsensors/s1,blue,1",
            "--results whole.json",
            "these results are not split by light",
        ),
        (
            "x,y,z,band,value\n9,9,9,blue,1",
            "--results all.json",
            "m.csv:2: there is no captor, or more than one",
        ),
        (
            "captor,band,value\nsensors/s1,blue,1",
            "--results all.json --prior 0",
            "must be `none`, or a number",
        ),
        (
            "captor,band,value\nsensors/s1,blue,1",
            "--results all.json -o all.json",
            "is a file that is read",
        ),
    ] {
        std::fs::write(scene.path("m.csv"), table).expect("a file");
        let refused = command(&scene, &format!("calibrate scene.json m.csv {arguments}"));
        assert_eq!(refused.0, Some(2), "{table} {arguments}");
        assert!(refused.2.contains(sentence), "{}\n{sentence}", refused.2);
        assert!(!scene.path("calibrated.json").exists());
    }
}

/// A real growth chamber: readings at 12 points predict those at 113 others in four bands. With 80
/// million photons the relative errors of the prediction are 5.0 4.2 4.8 5.2 % without the prior
/// and 5.7 4.7 4.9 5.7 % with it. The photons of this test leave an error of 2.5 %, which moves
/// these figures by about 0.6. Twelve points say little about the model's own error: with other
/// random numbers the 95 % intervals hold 86 to 99.3 % of the readings, and with 8e7 photons 92.5 %;
/// and in two of four runs like this one they choose a model of factors by band, whose errors are
/// 10.5 6.7 6.6 6.8 %.
#[test]
#[ignore = "needs PHYLUX_SHARED"]
fn needs_shared_chamber_is_calibrated() {
    let data = shared().join("data/sec2-chamber");
    let folder = TestScene::new("", &[]);
    let text = std::fs::read_to_string(data.join("measured-empty.csv")).expect("measurements");
    let mut table = "captor,band,value,use\n".to_string();
    for line in text.lines().skip(1) {
        let cells: Vec<&str> = line.split(',').collect();
        let purpose = if cells[4] == "calibration" { "fit" } else { "test" };
        table += &format!("captors-empty/{},{},{},{purpose}\n", cells[0], cells[1], cells[2]);
    }
    std::fs::write(folder.path("m.csv"), table).expect("a file");
    let scene = data.join("chamber-empty.json").display().to_string();
    let traced = command(
        &folder,
        &format!("run {scene} --by-light --guiding aim --photons 5e6 --seed 2 --k 0 -o all.json"),
    );
    assert_eq!(traced.0, Some(0), "{}", traced.2);
    for (arguments, most) in
        [("--model lamps --prior none", [6.4, 5.4, 5.9, 6.4]), ("", [7.2, 5.8, 6.4, 7.2])]
    {
        let line = format!("calibrate {scene} m.csv --results all.json {arguments}");
        let done = command(&folder, line.trim_end());
        assert_eq!(done.0, Some(0), "{}", done.2);
        let found = calibration(&folder.path(""));
        for (rmse, most) in found.test_rmse.iter().zip(most) {
            assert!(100.0 * rmse.expect("tests") <= most, "{:?}", found.test_rmse);
        }
        let inside = found.test_inside.expect("tests");
        assert!((0.86..=0.99).contains(&inside), "{inside}");
    }
}

/// Four lamps in a row at 0.5 m over 21 sensors along it: the evenest light has brighter ends, is
/// symmetrical, and is what a search by hand (Nelder-Mead on the exact inverse squares, done here by
/// scanning the one free ratio) finds. Its mean is the one that was asked for.
#[test]
fn a_row_of_lamps_lights_a_line_evenly() {
    let scene = row_of_lamps();
    let (code, told, warned) =
        command(&scene, "calibrate scene.json --even line --mean 50 --threads 1 -o even.json");
    assert_eq!(code, Some(0), "{warned}");
    for word in ["before", "after", "coefficient of variation", "±", "wrote even.json"] {
        assert!(told.contains(word), "{told}");
    }
    let report: Value = serde_json::from_slice(
        &std::fs::read(scene.path("even-calibration.json")).expect("a report"),
    )
    .expect("JSON");
    let factor = |lamp: usize| report["factors"][format!("l{lamp}")][0].as_f64().expect("a factor");
    let (outer, inner) = (factor(0), factor(1));
    assert!((factor(3) / outer - 1.0).abs() < 0.02 && (factor(2) / inner - 1.0).abs() < 0.02);
    // cos / r² of each lamp at each sensor, in closed form
    let at = |lamp: usize, sensor: usize| {
        let (x, h) = (sensor as f64 * 0.075 - lamp as f64 * 0.5, 0.5f64);
        h / (x * x + h * h).powf(1.5)
    };
    let cv = |ratio: f64| {
        let light: Vec<f64> =
            (0..21).map(|s| ratio * (at(0, s) + at(3, s)) + at(1, s) + at(2, s)).collect();
        let mean = light.iter().sum::<f64>() / 21.0;
        (light.iter().map(|e| (e / mean - 1.0).powi(2)).sum::<f64>() / 21.0).sqrt()
    };
    let best = (0..4000).map(|i| f64::from(i) * 1e-3).min_by(|a, b| cv(*a).total_cmp(&cv(*b)));
    let best = best.expect("a ratio");
    assert!((outer / inner / best - 1.0).abs() < 0.03, "{} {best}", outer / inner);
    for (when, ratio) in [("before", 1.0), ("after", best)] {
        let found = report[when]["cv"].as_f64().expect("a CV");
        let error = report[when]["cv_se"].as_f64().expect("an error");
        assert!((found - cv(ratio)).abs() < 4.0 * error + 0.002, "{when}: {found} {}", cv(ratio));
    }
    // the scene that was written has this mean, and its lamps the watts that go with their light
    let (code, _, warned) = command(&scene, "run even.json --threads 1 -o again.json --quiet");
    assert_eq!(code, Some(0), "{warned}");
    let again = phylux::formats::read_json(&scene.path("again.json")).expect("results");
    let line = again.groups.iter().find(|group| group.id == "line").expect("the group");
    assert!((line.front.irradiance[0] / 50.0 - 1.0).abs() < 0.02);
    let watts = again.account.electricity.as_ref().expect("electricity").lights["l0"].watts;
    assert!((watts / (10.0 * outer) - 1.0).abs() < 1e-9);
    // a mix takes the same factors
    for arguments in [
        "run scene.json --by-light --threads 1 -o all.json --quiet",
        "mix all.json --calibration even-calibration.json -o mixed.json --quiet",
        "calibrate scene.json --even line --results all.json --minimum 40 -o least.json",
        "calibrate scene.json --even line/1* --results all.json --group l* --band all -o joined.json",
    ] {
        let (code, _, warned) = command(&scene, arguments);
        assert_eq!(code, Some(0), "{arguments}: {warned}");
    }
    let mixed = phylux::formats::read_json(&scene.path("mixed.json")).expect("results");
    let mean = mixed.groups[0].front.irradiance[0];
    assert!((mean / 50.0 - 1.0).abs() < 1e-6, "{mean}");
    // the least power reaches the minimum exactly somewhere, with less power than the evenest light
    // that does
    let read = |name: &str| -> Value {
        serde_json::from_slice(&std::fs::read(scene.path(name)).expect("a report")).expect("JSON")
    };
    let least = read("least-calibration.json");
    let number = |value: &Value| value.as_f64().expect("a number");
    assert!((number(&least["after"]["min"]) / 40.0 - 1.0).abs() < 1e-6);
    let scale = 40.0 / number(&report["after"]["min"]);
    assert!(
        number(&least["after"]["power"]) <= scale * number(&report["after"]["power"]) * 1.000_001
    );
    let joined = read("joined-calibration.json");
    assert_eq!(joined["factors"]["l0"], joined["factors"]["l3"]);
    assert!((number(&joined["factors"]["l0"][0]) - 1.0).abs() < 1e-9);
}

fn row_of_lamps() -> TestScene {
    let lamps: Vec<Value> = (0..4)
        .map(|i| {
            json!({ "name": format!("l{i}"), "type": "point", "position": [0.5 * f64::from(i), 0, 0.5],
                    "power": 100, "watts": 10 })
        })
        .collect();
    let mut captors = "id,x,y,z,radius,nx,ny,nz\n".to_string();
    for i in 0..21 {
        captors += &format!("{i},{},0,0,0.02,0,0,1\n", 0.075 * f64::from(i));
    }
    let scene = json!({ "name": "row", "lights": lamps, "captors": [{ "csv": "line.csv" }],
        "settings": { "photons": 200_000, "k": 0, "guiding": "aim" } });
    TestScene::new(&scene.to_string(), &[("line.csv", &captors)])
}

/// What `--even` cannot do is said with the cure, and options that do not fit are refused.
#[test]
fn even_light_of_nothing_is_refused() {
    let scene = row_of_lamps();
    let run = "run scene.json --by-light --photons 20000 --threads 1 -o all.json --quiet";
    assert_eq!(command(&scene, run).0, Some(0));
    for (arguments, expected) in [
        (
            "--even bench",
            "--even: no group and no captor is like `bench`; `*` stands for any characters; there are the groups line",
        ),
        ("--even line --band PAR", "--even line --band PAR"),
        ("--even line --mean 0", "must be a number above 0"),
        ("--even line --mean 5 --minimum 3", "cannot be used with"),
        ("--even line --group x*", "no light fits `x*`"),
        ("--mean 5", "required"),
        ("--even line --model lamps", "cannot be used with"),
    ] {
        let arguments = format!("calibrate scene.json --results all.json {arguments}");
        let (code, _, error) = command(&scene, &arguments);
        assert_eq!(code, Some(2), "{arguments}: {error}");
        let expected = if expected.starts_with("--even line --band") {
            "no band or sum `PAR`"
        } else {
            expected
        };
        assert!(error.contains(expected), "{arguments}: {error}");
    }
    assert_eq!(command(&scene, "calibrate scene.json").0, Some(2));
}

/// A row without a value is predicted as a reading kept for a test is, does not change the fit, and
/// has no measured value.
#[test]
fn places_without_a_reading_are_predicted() {
    let scene = scene();
    let code = command(
        &scene,
        "run scene.json --by-light --photons 100000 --threads 1 -o all.json --quiet",
    )
    .0;
    assert_eq!(code, Some(0));
    let result = phylux::formats::read_json(&scene.path("all.json")).expect("results");
    let text = readings(&result, |i| 0.01 * (i as f64).sin());
    let tested = text.clone();
    let predicted: String = text
        .lines()
        .map(|line| match line.strip_suffix(",test") {
            Some(start) => format!("{},,\n", start.rsplit_once(',').expect("a value").0),
            None => format!("{line}\n"),
        })
        .collect();
    let mut found = Vec::new();
    for text in [tested, predicted] {
        std::fs::write(scene.path("m.csv"), text).expect("a file");
        let (code, told, error) =
            command(&scene, "calibrate scene.json m.csv --results all.json --model lamps");
        assert_eq!(code, Some(0), "{error}");
        found.push((calibration(&scene.path("")), told));
    }
    let [(a, _), (b, told)] = &found[..] else { panic!() };
    assert_eq!(a.factors, b.factors);
    assert!(told.contains("predicted readings") && told.contains("95 % interval"), "{told}");
    assert_eq!((b.test_inside, a.readings.len()), (None, b.readings.len()));
    for (a, b) in a.readings.iter().zip(&b.readings) {
        assert_eq!((a.calibrated, a.interval), (b.calibrated, b.interval));
        let purpose = if a.purpose == "test" { "predict" } else { "fit" };
        assert_eq!(b.purpose, purpose);
        assert_eq!(b.measured.is_none(), purpose == "predict");
    }
}

/// What was measured in bands is predicted in their sum, and the other way around; a band in which
/// nothing was measured is not.
#[test]
fn other_bands_than_those_measured_are_predicted() {
    let scene = scene();
    let text = std::fs::read_to_string(scene.path("scene.json")).expect("a scene");
    let mut file: Value = serde_json::from_str(&text).expect("JSON");
    // a band without weight is none of the sum's
    file["sums"]["mostly"] = json!({ "blue": 1, "red": 0 });
    std::fs::write(scene.path("scene.json"), file.to_string()).expect("a file");
    let line = "run scene.json --by-light --photons 100000 --threads 1 -o all.json --quiet";
    assert_eq!(command(&scene, line).0, Some(0));
    let result: RunResult = phylux::formats::read_json(&scene.path("all.json")).expect("results");
    let calibrate = |text: &str, model: &str| {
        std::fs::write(scene.path("m.csv"), text).expect("a file");
        let line =
            format!("calibrate scene.json m.csv --results all.json --prior none --model {model}");
        command(&scene, &line)
    };
    let others = || result.captors.iter().enumerate().filter(|(i, _)| i % 3 != 0);
    let of = |band: &str, value: &dyn Fn(usize) -> String| -> String {
        let rows = result.captors.iter().enumerate().filter(|(i, _)| i % 3 == 0);
        rows.map(|(i, captor)| format!("{},{band},{}\n", captor.id, value(i))).collect()
    };
    let predict = |band: &str| -> String {
        others().map(|(_, captor)| format!("{},{band},\n", captor.id)).collect()
    };
    // factors by lamp and band are known exactly
    let all = readings(&result, |_| 0.0);
    let fitted = all.lines().filter_map(|line| line.strip_suffix(",fit"));
    let fitted: String = fitted.map(|line| format!("{line}\n")).collect();
    let text = format!("captor,band,value\n{fitted}{}", predict("both"));
    let (code, _, error) = calibrate(&text, "lamps");
    assert_eq!(code, Some(0), "{error}");
    let found = calibration(&scene.path(""));
    let predicted: Vec<_> = found.readings.iter().filter(|r| r.purpose == "predict").collect();
    assert_eq!(predicted.len(), others().count());
    for (reading, (_, captor)) in predicted.iter().zip(others()) {
        let lights = captor.front.by_light.as_ref().expect("by light");
        let parts = lights.values().zip(FACTORS);
        let right: f64 = parts.map(|(p, f)| p.irradiance[0] * f[0] + p.irradiance[1] * f[1]).sum();
        assert_eq!((reading.captor.as_str(), reading.band.as_str()), (&*captor.id, "both"));
        assert!((reading.calibrated / right - 1.0).abs() < 1e-6, "{} {right}", reading.calibrated);
        assert!((reading.simulated / captor.front.irradiance[2] - 1.0).abs() < 1e-9);
        // at least the error of the simulation, with factors of one half to 1.3
        let [low, high] = reading.interval;
        let least = captor.front.irradiance_se[2].expect("an error");
        assert!(low < right && right < high && high - low > least, "{low} {high} {least}");
    }
    // of the sum, the band is a known part
    let twice = |i: usize| (2.0 * result.captors[i].front.irradiance[2]).to_string();
    let text = format!("captor,band,value\n{}{}", of("both", &twice), predict("red"));
    let (code, _, error) = calibrate(&text, "common");
    assert_eq!(code, Some(0), "{error}");
    let found = calibration(&scene.path(""));
    let predicted = found.readings.iter().filter(|r| r.purpose == "predict");
    for (reading, (_, captor)) in predicted.zip(others()) {
        let right = 2.0 * captor.front.irradiance[1];
        assert!((reading.calibrated / right - 1.0).abs() < 1e-6, "{} {right}", reading.calibrated);
    }
    let once = |i: usize| result.captors[i].front.irradiance[0].to_string();
    let text = format!("captor,band,value\n{}{}", of("blue", &once), predict("both"));
    let (code, _, error) = calibrate(&text, "common");
    let words = "m.csv:10: nothing was measured in band `red`, alone or in a sum, so that it cannot be predicted";
    assert!(code == Some(2) && error.contains(words), "{error}");
    let text = format!("captor,band,value\n{}{}", of("blue", &once), predict("mostly"));
    let (code, _, error) = calibrate(&text, "common");
    assert_eq!(code, Some(0), "{error}");
    let found = calibration(&scene.path(""));
    let predicted = found.readings.iter().filter(|r| r.purpose == "predict");
    for (reading, (_, captor)) in predicted.zip(others()) {
        assert!((reading.calibrated / captor.front.irradiance[0] - 1.0).abs() < 1e-6);
    }
    let (code, _, error) = calibrate(&format!("captor,band,value\n{}", predict("both")), "common");
    assert!(code == Some(2) && error.contains("nothing was measured: no row has"), "{error}");
}

/// A mix with a calibration has the errors of its factors. With one factor for all lamps and bands it
/// is the same relative error for every value, which cancels in ratios; with a factor for each lamp it
/// is that of the covariances. How even a group is does not change. Limits: rounding.
#[test]
fn a_mix_carries_the_covariance_of_the_factors() {
    let scene = scene();
    let mut file: Value =
        serde_json::from_str(&std::fs::read_to_string(scene.path("scene.json")).expect("a scene"))
            .expect("JSON");
    file["ratios"] = json!({ "share": { "numerator": "red", "denominator": "both" } });
    file["captors"][0]["group"] = json!("bench");
    std::fs::write(scene.path("scene.json"), file.to_string()).expect("written");
    assert_eq!(command(&scene, "run scene.json --by-light -o all.json").0, Some(0));
    let all = phylux::formats::read_json(&scene.path("all.json")).expect("results");
    let noise = |i: usize| 0.2 * (f64::from((7 * i % 11) as u32) / 5.0 - 1.0);
    std::fs::write(scene.path("m.csv"), readings(&all, noise)).expect("a file");
    let calibrate = |model: &str| {
        let line = format!("calibrate scene.json m.csv --results all.json --model {model}");
        let done = command(&scene, &line);
        assert_eq!(done.0, Some(0), "{}", done.2);
        let found = calibration(&scene.path(""));
        let done = command(&scene, "mix all.json --calibration calibration.json -o mixed.json");
        assert_eq!(done.0, Some(0), "{}", done.2);
        let plain: Vec<String> =
            found.factors.iter().map(|(light, f)| format!("{light}={}", f[0])).collect();
        let mixed = phylux::formats::read_json(&scene.path("mixed.json")).expect("results");
        assert!(mixed.calibrated);
        (found, mixed, plain.join(","))
    };
    let (found, mixed, powers) = calibrate("common");
    let line = ["mix", "all.json", "--power", &powers, "-o", "plain.json"];
    assert!(phylux(&scene.path(""), &line).status.success());
    let plain = phylux::formats::read_json(&scene.path("plain.json")).expect("results");
    let sigma = found.factors_se["left"][0].expect("an error") / found.factors["left"][0];
    assert!((0.01..0.2).contains(&sigma), "{sigma}");
    // numbers in files of results have some seven digits
    let close = |a: f64, b: f64| assert!((a / b - 1.0).abs() < 3e-6, "{a} {b}");
    let faces = |result: &RunResult| {
        let captors = result.captors.iter().map(|captor| captor.front.clone());
        captors.chain(result.groups.iter().map(|group| group.front.clone())).collect::<Vec<_>>()
    };
    for (own, before) in faces(&mixed).iter().zip(&faces(&plain)) {
        for band in 0..3 {
            let expected =
                |value: f64, se: Option<f64>| (sigma * value).hypot(se.expect("an error"));
            let irradiance = expected(before.irradiance[band], before.irradiance_se[band]);
            close(own.irradiance_se[band].expect("an error"), irradiance);
            close(
                own.flux_se[band].expect("an error"),
                expected(before.flux[band], before.flux_se[band]),
            );
        }
        let ratio =
            |face: &phylux::results::FaceResult| face.ratios.as_ref().expect("ratios").get(0);
        let [(a, a_se), (b, b_se)] = [own, before].map(|face| ratio(face).expect("a ratio"));
        close(a, b);
        let [a_se, b_se] = [a_se, b_se].map(|error| error.expect("an error"));
        assert!((a_se - b_se).abs() < 1e-6 * a, "{a_se} {b_se}");
    }
    let evenness = |result: &RunResult| {
        let bench = result.groups.iter().find(|group| group.id == "bench").expect("a group");
        bench.front.uniformity.clone().expect("several captors").cv_se[0].expect("an error")
    };
    close(evenness(&mixed), evenness(&plain));

    let (found, mixed, _) = calibrate("lamps");
    for (captor, all) in mixed.captors.iter().zip(&all.captors) {
        for band in 0..2 {
            let parts = all.front.by_light.as_ref().expect("by light");
            let of = |lamp: &str| parts[lamp].irradiance[band];
            let mut variance = 0.0;
            for (i, a) in found.lamps.iter().enumerate() {
                variance += (found.factors[a][band]
                    * parts[a.as_str()].irradiance_se[band].unwrap_or(0.0))
                .powi(2);
                for (j, b) in found.lamps.iter().enumerate() {
                    variance += of(a) * of(b) * found.covariance[2 * i + band][2 * j + band];
                }
            }
            close(captor.front.irradiance_se[band].expect("an error"), variance.sqrt());
        }
        // the sum has an upper bound; with two bands, their covariance follows from their own errors
        let parts = all.front.by_light.as_ref().expect("by light");
        let (mut simulated, mut fitted) = (0.0, 0.0);
        for (i, a) in found.lamps.iter().enumerate() {
            let [blue, red, sum] = [0, 1, 2].map(|b| parts[a].irradiance_se[b].unwrap_or(0.0));
            let factors = &found.factors[a];
            let both = sum * sum - blue * blue - red * red;
            simulated += (factors[0] * blue).powi(2) + (factors[1] * red).powi(2);
            simulated += factors[0] * factors[1] * both;
            for (j, b) in found.lamps.iter().enumerate() {
                for (m, n) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
                    let values = parts[a].irradiance[m] * parts[b].irradiance[n];
                    fitted += values * found.covariance[2 * i + m][2 * j + n];
                }
            }
        }
        let error = captor.front.irradiance_se[2].expect("a bound");
        let [exact, most] = [1.0, 2.0].map(|times: f64| (times * simulated + fitted).sqrt());
        assert!((exact * 0.999999..most).contains(&error), "{exact} {error} {most}");
        // red over both: its error follows from the covariance of both sums
        let ratios = captor.front.ratios.as_ref().expect("ratios");
        let (share, error) = ratios.get(0).expect("a ratio");
        let weights = [-share, 1.0 - share];
        let mut variance = 0.0;
        for (i, a) in found.lamps.iter().enumerate() {
            let [blue, red, sum] = [0, 1, 2].map(|b| parts[a].irradiance_se[b].unwrap_or(0.0));
            let [of_blue, of_red] = [0, 1].map(|b| weights[b] * found.factors[a][b]);
            variance += (of_blue * blue).powi(2) + (of_red * red).powi(2);
            variance += of_blue * of_red * (sum * sum - blue * blue - red * red);
            for (j, b) in found.lamps.iter().enumerate() {
                for (m, n) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
                    let values = parts[a].irradiance[m] * parts[b].irradiance[n];
                    let covariance = found.covariance[2 * i + m][2 * j + n];
                    variance += weights[m] * weights[n] * values * covariance;
                }
            }
        }
        close(error.expect("an error"), variance.sqrt() / captor.front.irradiance[2]);
    }
    // it is mixed once
    let again = command(&scene, "mix mixed.json --power left=2 -o again.json");
    assert_eq!(again.0, Some(2));
    assert!(again.2.contains("mixed with a calibration"), "{}", again.2);
    let both =
        command(&scene, "mix all.json --calibration calibration.json --power left=2 -o b.json");
    assert_eq!(both.0, Some(0), "{}", both.2);
    let text = std::fs::read_to_string(scene.path("calibration.json")).expect("a report");
    let report: Value = serde_json::from_str(&text).expect("JSON");
    for (key, value, words) in [
        ("covariance", json!([[1.0]]), "its `covariance` is no table of 6 x 6 numbers"),
        ("lamps", json!(["left", "middle", "other"]), "light `right` is none of its `lamps`"),
        ("measured_bands", json!(["blue", "green"]), "the results have no band `green`"),
    ] {
        let mut report = report.clone();
        report[key] = value;
        std::fs::write(scene.path("bad.json"), report.to_string()).expect("written");
        let done = command(&scene, "mix all.json --calibration bad.json -o b.json");
        assert_eq!(done.0, Some(2), "{words}");
        assert!(done.2.contains("bad.json: ") && done.2.contains(words), "{}", done.2);
    }
}

/// Warnings about the files of a scene are in the report of a calibration, too, and are said once.
#[test]
fn warnings_about_files_are_in_the_report() {
    let scene = scene();
    let folder = scene.path("");
    let text = std::fs::read_to_string(scene.path("scene.json")).expect("the scene");
    let mut document: Value = serde_json::from_str(&text).expect("JSON");
    document["materials"] = json!({ "grey": { "type": "lambert", "reflectance": 0.1 } });
    document["objects"] = json!([{ "name": "pane", "obj": "pane.obj", "material": "grey" }]);
    let pane = "mtllib pane.mtl\nv 0 0 -1\nv 1 0 -1\nv 1 1 -1\nusemtl glass\nf 1 2 3\n";
    for (name, text) in [
        ("scene.json", &*document.to_string()),
        ("pane.obj", pane),
        ("pane.mtl", "newmtl glass\nKd 0.5 0.5 0.5\nd 0.5\n"),
    ] {
        std::fs::write(folder.join(name), text).expect("written");
    }
    let line = "calibrate scene.json --even sensors* -o even.json";
    let (code, _, said) = command(&scene, line);
    assert_eq!(code, Some(0), "{said}");
    assert_eq!(said.matches("its MTL says `d 0.5`").count(), 1, "{said}");
    let report = std::fs::read_to_string(folder.join("even-calibration.json")).expect("a report");
    let report: Value = serde_json::from_str(&report).expect("JSON");
    let first = report["warnings"][0].as_str().expect("a warning");
    assert!(first.contains("its MTL says `d 0.5`"), "{report:#}");
}
