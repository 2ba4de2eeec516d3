//! Powers of lamps from measured readings: known factors are recovered, and readings in a real
//! growth chamber are predicted.

use std::path::Path;

use phylux::{Calibration, RunResult};
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
    let all = phylux::read_json(&scene.path("all.json")).expect("results");
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
    // a mix by the same factors gives the readings, and its sums, whose errors are not known
    let mixed = command(&scene, "mix all.json --calibration calibration.json -o mixed.json");
    assert_eq!(mixed.0, Some(0), "{}", mixed.2);
    let mixed = phylux::read_json(&scene.path("mixed.json")).expect("results");
    for (reading, captor) in found.readings.chunks(2).zip(&mixed.captors) {
        let face = &captor.front;
        assert!((face.irradiance[0] / reading[0].measured - 1.0).abs() < 1e-6);
        assert!((face.irradiance[1] / reading[1].measured - 1.0).abs() < 1e-6);
        let sum = face.irradiance[0] + face.irradiance[1];
        assert!((face.irradiance[2] / sum - 1.0).abs() < 1e-12);
        assert!(face.irradiance_se[0].is_some() && face.irradiance_se[2].is_none());
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

/// Readings that are 3 % off by a fixed pattern of signs, calibrated with a run of another seed.
/// The true factors are within 4 standard errors, and at least 26 of the 32 test readings are in
/// their 95 % intervals.
///
/// Seed 2 for the calibration; the outcome is fixed with it.
#[test]
fn noisy_readings_have_honest_intervals() {
    let scene = scene();
    let traced = command(&scene, "run scene.json --by-light -o all.json");
    assert_eq!(traced.0, Some(0), "{}", traced.2);
    let all = phylux::read_json(&scene.path("all.json")).expect("results");
    let sign = |i: usize| if (i * i / 3 + i / 5).is_multiple_of(2) { 0.03 } else { -0.03 };
    std::fs::write(scene.path("m.csv"), readings(&all, sign)).expect("a file");
    let done = command(&scene, "calibrate scene.json m.csv --seed 2 --model lamps --prior none");
    assert_eq!(done.0, Some(0), "{}", done.2);
    let found = calibration(&scene.path(""));
    for (lamp, factors) in LAMPS.iter().zip(FACTORS) {
        for (b, factor) in factors.into_iter().enumerate() {
            let error = found.factors_se[*lamp][b].expect("an error");
            assert!(error > 0.005 && (found.factors[*lamp][b] - factor).abs() < 4.0 * error);
        }
    }
    let inside = found.test_inside.expect("tests");
    assert!(inside >= 26.0 / 32.0, "{inside}");
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
    let all = phylux::read_json(&scene.path("all.json")).expect("results");
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
        ("/materials/wall/reflectance=1:1.5", "scene.json: /materials/wall/reflectance: 1.25"),
    ] {
        let refused = command(&scene, &format!("{command_line} {vary}"));
        assert_eq!(refused.0, Some(2), "{vary}");
        assert!(refused.2.contains(sentence), "{}\n{sentence}", refused.2);
    }
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
/// these figures by about 0.6. Twelve points say little about the model's own error: with seeds 1
/// and 3 the 95 % intervals hold 96.7 and 86.1 % of the readings without a prior, and with 8e7
/// photons 92.5 %.
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
        &format!("run {scene} --by-light --guiding aim --photons 5e6 --seed 1 --k 0 -o all.json"),
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
