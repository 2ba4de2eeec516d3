//! How light reaches a captor: shares by light and last surface, lines, and the files of them.

use std::fs;

use phylux::{
    Settings,
    math::Estimate,
    results::HistoriesResult,
    transport::{Goal, Guiding, PhotonCount, ThreadCount, trace_histories},
};
use serde_json::{Value, json};

use crate::{
    bad_input::{phylux, refused},
    common::{TestScene, run_file, stderr},
    exact::Comparisons,
    world::{Mesh, World, room, room_with_leaf},
};

/// Follows the light to a captor of this name, on all its faces.
fn traced(
    scene: &TestScene,
    to: &str,
    photons: u64,
    change: impl Fn(&mut Settings),
) -> HistoriesResult {
    let loaded = phylux::load(&scene.path("scene.json")).unwrap_or_else(|e| panic!("{e}"));
    let captor = loaded.scene.captors().iter().position(|captor| captor.id == to);
    let captor = captor.unwrap_or_else(|| panic!("no captor {to}"));
    let goal = Goal { captors: vec![captor], face: None };
    let mut settings =
        Settings { photons: PhotonCount::new(photons).ok(), seed: 1, ..loaded.settings };
    if std::env::var_os("PHYLUX_RETRY").is_some() {
        settings.seed += 1;
        settings.photons = PhotonCount::new(4 * photons).ok();
    }
    change(&mut settings);
    let goals = std::slice::from_ref(&goal);
    let found = trace_histories(&loaded.scene, goals, (0, 300), &settings, &Default::default());
    let found = found.unwrap_or_else(|e| panic!("{e}"));
    HistoriesResult::new(&loaded.scene, to, &goal, 0, settings.seed, &found[0])
}

/// Returns the share of light with this last surface, in the first band.
fn share_of(found: &HistoriesResult, last: &str) -> Estimate {
    let part = found.by_surface.iter().find(|part| part.last_surface.as_deref() == Some(last));
    let part = part.unwrap_or_else(|| panic!("no light by {last}: {:?}", found.by_surface));
    Estimate { mean: part.share[0].expect("a share"), standard_error: part.share_se[0] }
}

/// The shares of all parts add up to 1, and their fluxes to the whole.
fn check_sums(found: &HistoriesResult) {
    for parts in [&found.groups, &found.by_light, &found.by_surface] {
        for band in 0..found.bands.len() {
            let shares: f64 = parts.iter().filter_map(|part| part.share[band]).sum();
            assert!((shares - 1.0).abs() < 1e-12, "{shares}");
            let flux: f64 = parts.iter().map(|part| part.flux[band]).sum();
            assert!((flux / found.whole.flux[band] - 1.0).abs() < 1e-12, "{flux}");
        }
        assert_eq!(parts.iter().map(|part| part.histories).sum::<u64>(), found.whole.histories);
    }
}

/// A furnace: walls of reflectance 0.6 that emit 0.4 of the radiance L. Everywhere, and on both sides of
/// a sensor and of a leaf that sends on all light, arrives pi L, of which 0.4 come straight from the
/// walls and 0.6 by way of them. Neither the sensor nor the leaf sees the leaf, which lies in the plane
/// of both. Flights are aimed at the captor, sensor or leaf; without them the same is found. Seed 1,
/// 300,000 photons (2 million without flights); standard errors at most 3 %; 8 comparisons, odds of a
/// false alarm 8.8e-4.
#[test]
fn shares_of_a_furnace_are_those_of_its_walls() {
    const L: f64 = 10.0;
    let leaf = json!({ "type": "leaf", "ior": 1, "reflectance": 0.3, "transmittance": 0.7,
                       "back": { "reflectance": 0.3 } });
    let (middle, tilt) = ([0.3, -0.2, 0.1], [0.0, 0.6, 0.8]);
    let world = World::new()
        .lambert("wall", 0.6)
        .material("leaf", leaf)
        .glowing("walls", "wall", &room([-1.0; 3], [1.0; 3]), 0.4 * L)
        .captor_of_both_sides("sensor", &Mesh::square(middle, tilt, 0.05))
        .counted("leaf", "leaf", &Mesh::square([-0.4, -0.2, 0.1], tilt, 0.1));
    let scene = world.with("settings", json!({ "guiding": "aim" })).write();
    let mut check = Comparisons::new("furnace", 0.03).rounding(1e-4);
    for (to, side) in [("sensor", 0.05), ("leaf/leaf", 0.1)] {
        let found = traced(&scene, to, 300_000, |_| ());
        check_sums(&found);
        let arrives = 2.0 * std::f64::consts::PI * L * side * side;
        let se = found.whole.flux_se[0].expect("an error");
        check.add(format!("{to}, flux"), found.whole.flux[0], se, arrives);
        for (last, share) in [("direct", 0.4), ("walls", 0.6)] {
            let of_all = share_of(&found, last);
            let se = of_all.standard_error.expect("an error");
            check.add(format!("{to}, {last}"), of_all.mean, se, share);
        }
        assert_eq!(found.by_surface.len(), 2, "{:?}", found.by_surface);
    }
    let found = traced(&scene, "leaf/leaf", 2_000_000, |settings| settings.guiding = Guiding::Off);
    let arrives = 2.0 * std::f64::consts::PI * L * 0.1 * 0.1;
    check.add(
        "plain, flux",
        found.whole.flux[0],
        found.whole.flux_se[0].expect("an error"),
        arrives,
    );
    let direct = share_of(&found, "direct");
    check.add("plain, direct", direct.mean, direct.standard_error.expect("an error"), 0.4);
    check.finish(8);
}

/// In a closed room whose walls send back 0.6 of all light, the walls receive P / 0.4 of a power P: 0.4
/// of it straight from the lamps, and of each group the lamp's share. Lamps of powers 3 and 1, seed 1,
/// 100,000 photons; standard errors at most 1 %; 4 comparisons, odds of a false alarm 4.4e-4.
#[test]
fn shares_of_lamps_are_those_of_their_powers() {
    let point = |name: &str, position: [f64; 3], power: f64| json!({ "type": "point", "name": name, "position": position, "power": power });
    let world = World::new()
        .lambert("wall", 0.6)
        .counted("room", "wall", &room([-1.0, -2.0, -1.0], [1.0, 1.5, 1.0]))
        .light(point("strong", [0.2, 0.1, 0.3], 3.0))
        .light(point("weak", [-0.5, 0.4, -0.6], 1.0));
    let found = traced(&world.write(), "room/room", 100_000, |_| ());
    check_sums(&found);
    let mut check = Comparisons::new("lamps", 0.01).rounding(1e-4);
    for part in &found.groups {
        let [light, last] =
            [&part.light, &part.last_surface].map(|name| name.as_deref().expect("a name"));
        let power = if light == "strong" { 0.75 } else { 0.25 };
        let share = if last == "direct" { 0.4 } else { 0.6 };
        let se = part.share_se[0].expect("an error");
        check.add(format!("{light}, {last}"), part.share[0].expect("a share"), se, power * share);
    }
    check.finish(4);
}

/// The fluxes by light are those of a run with `--by-light`, at a leaf and at a small sensor of a room
/// with three lights, in two bands: each of two independent runs of 50,000 photons, seeds 1 and 3,
/// within 4 standard errors of the difference. 12 comparisons, odds of a false alarm 8e-4.
#[test]
fn fluxes_by_light_are_those_of_a_run_by_light() {
    let lights = [
        json!({ "name": "left", "type": "point", "position": [-0.7, 0.2, 0.3], "power": [3.0, 4.0] }),
        json!({ "name": "right", "type": "tube", "from": [0.5, 0, 0.9], "to": [0.9, 0, 0.9],
                "radius": 0.02, "power": [2.0, 0.5] }),
        json!({ "name": "spot", "type": "spot", "position": [0, 0, 0.9], "direction": [0, 0, -1],
                "half_angle_deg": 20, "power": [1.0, 0.0] }),
    ];
    let world = lights.into_iter().fold(room_with_leaf(3, 0.5), World::light);
    let scene = world.with("settings", json!({ "guiding": "aim" })).write();
    let run = run_file(&scene.path("scene.json"), |settings| {
        (settings.photons, settings.seed, settings.by_light) =
            (PhotonCount::new(200_000).ok(), 3, true);
    });
    for to in ["leaf/leaf", "tiles/1"] {
        let captor = run.captors.iter().find(|captor| captor.id == to);
        let captor = captor.unwrap_or_else(|| {
            panic!("no {to}: {:?}", run.captors.iter().map(|c| &c.id).collect::<Vec<_>>())
        });
        let found = traced(&scene, to, 200_000, |_| ());
        check_sums(&found);
        for light in ["left", "right", "spot"] {
            let own = found.by_light.iter().find(|part| part.light.as_deref() == Some(light));
            for band in 0..2 {
                let faces =
                    captor.faces().map(|face| &face.by_light.as_ref().expect("by light")[light]);
                let (flux, variance) = faces.fold((0.0, 0.0), |(flux, variance), face| {
                    (flux + face.flux[band], variance + face.flux_se[band].unwrap_or(0.0).powi(2))
                });
                let [mine, se] = own.map_or([0.0, 0.0], |own| {
                    [own.flux[band], own.flux_se[band].expect("an error")]
                });
                let error = (variance + se * se).sqrt();
                assert!(
                    (mine - flux).abs() <= 4.0 * error,
                    "{to}, {light}, {band}: {mine} {flux} {error}"
                );
                assert!(error <= 0.05 * flux, "{to}, {light}, {band}: {error} of {flux}");
            }
        }
    }
}

/// A lamp 1 m above a sensor of both sides, and a mirror of reflectance 0.9 as far below it, in which
/// the lamp stands 3 m below: the mirror's share is 0.1 / 1.1. Light through a pane between lamp and
/// sensor stays direct. The values hold for a point; the disc of 1 cm differs by 3e-5. Seed 1, 100,000
/// photons; odds of a false alarm 1.1e-4.
#[test]
fn a_mirror_is_a_last_surface_and_a_pane_is_none() {
    let with = |material: Value, z: f64| {
        World::new()
            .material("thing", material)
            .light(json!({ "type": "point", "name": "lamp", "position": [0, 0, 1], "power": 1 }))
            .captor_of_both_sides("sensor", &Mesh::disc([0.0; 3], [0.0, 0.0, 1.0], 0.01))
            .surface("thing", "thing", &Mesh::square([0.0, 0.0, z], [0.0, 0.0, 1.0], 40.0))
            .with("settings", json!({ "guiding": "aim" }))
            .write()
    };
    let mirror = traced(
        &with(json!({ "type": "mirror", "reflectance": 0.9 }), -1.0),
        "sensor",
        100_000,
        |_| (),
    );
    check_sums(&mirror);
    let mut check = Comparisons::new("mirror", 0.02).rounding(1e-3);
    let share = share_of(&mirror, "thing");
    check.add("share", share.mean, share.standard_error.expect("an error"), 0.1 / 1.1);
    check.finish(1);
    let line = mirror.lines.iter().find(|line| line.last_surface == "thing").expect("a line");
    assert_eq!(line.met, [["thing", "thing"].map(String::from)]);
    assert_eq!([line.points.len(), usize::from(line.face == "back")], [3, 1]);
    assert!(line.points[1][2] + 1.0 < 1e-5, "{line:?}");

    let pane = traced(
        &with(json!({ "type": "transparent", "ior": 1.5, "thin": true }), 0.5),
        "sensor",
        100_000,
        |_| (),
    );
    assert_eq!(pane.groups.len(), 1);
    assert_eq!(share_of(&pane, "direct").mean, 1.0);
    assert!(pane.lines.iter().all(|line| line.met.len() == 1 && line.points[1][2] - 0.5 < 1e-5));
}

/// Lines begin at their lamp, bend on surfaces and end on the captor; lines of a group are as many as
/// its share says, within chance (300 lines, odds of a false alarm below 1e-3). Neither they nor the
/// shares depend on the number of threads.
#[test]
fn lines_are_a_sample_of_the_light() {
    let world = room_with_leaf(3, 0.5)
        .light(json!({ "name": "left", "type": "point", "position": [-0.7, 0.2, 0.3], "power": [3, 4] }))
        .with("settings", json!({ "guiding": "aim" }));
    let scene = world.write();
    let threads = |threads: usize| {
        let found = traced(&scene, "tiles/1", 50_000, |settings| {
            settings.threads = ThreadCount::new(threads).expect("a number of threads");
        });
        serde_json::to_string(&found).expect("JSON")
    };
    assert_eq!(threads(1), threads(3));
    let found = traced(&scene, "tiles/1", 50_000, |_| ());
    assert_eq!(found.lines.len(), 300);
    for line in &found.lines {
        let (first, last) = (line.points[0], line.points[line.points.len() - 1]);
        let far =
            [-0.7, 0.2, 0.3].iter().zip(first).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(far < 1e-5, "{line:?}");
        // the tile of 0.3 m at (-0.3, 0.1, -0.4)
        let on = [-0.3, 0.1, -0.4].iter().zip(last).map(|(a, b)| (a - b).abs()).collect::<Vec<_>>();
        assert!(on[0] < 0.151 && on[1] < 0.151 && on[2] < 1e-5, "{line:?}");
        assert_eq!(line.points.len(), line.met.len() + 2);
        for (point, met) in line.points[1..].iter().zip(&line.met) {
            let wall = point.iter().any(|x| (x.abs() - 1.0).abs() < 1e-5);
            let leaf = (0.6 * point[1] + 0.8 * point[2]).abs() < 1e-5;
            assert!(if met[0] == "room" { wall } else { leaf }, "{met:?} {point:?}");
        }
    }
    for group in &found.groups {
        let share = group.share[0].expect("a share");
        let drawn = found.lines.iter().filter(|line| group.has(line)).count() as f64 / 300.0;
        let chance = (share * (1.0 - share) / 300.0).sqrt();
        assert!(
            (drawn - share).abs() < 3.5 * chance + 2.0 * group.share_se[0].expect("an error"),
            "{drawn} {share}"
        );
    }
}

/// Where a scene repeats, lines are unfolded: direct sunlight comes on straight lines along the sun's
/// direction, however many cells it crosses, and ends where the scene describes the sensor.
#[test]
fn lines_of_a_scene_that_repeats_are_unfolded() {
    let world = World::new()
        .lambert("soil", 0.3)
        .surface("soil", "soil", &Mesh::square([0.0; 3], [0.0, 0.0, 1.0], 1.0))
        .captor("sensor", &Mesh::square([0.1, 0.2, 0.05], [0.0, 0.0, 1.0], 0.2))
        .light(json!({ "type": "sun", "name": "sun", "irradiance": 100, "half_angle_deg": 0 }))
        .with("sun_at", json!({ "elevation_deg": 10, "azimuth_deg": 60 }))
        .with("periodic", json!({ "x": [-0.5, 0.5], "y": [-0.5, 0.5] }))
        .captor("high", &Mesh::square([0.0, 0.0, 2.0], [0.0, 0.0, 1.0], 0.1));
    let found = traced(&world.write(), "sensor", 20_000, |_| ());
    let (elevation, azimuth) = (10f64.to_radians(), 60f64.to_radians());
    let sun = [azimuth.sin() * elevation.cos(), azimuth.cos() * elevation.cos(), elevation.sin()];
    let direct: Vec<_> = found.lines.iter().filter(|line| line.last_surface == "direct").collect();
    let mut longest: f64 = 0.0;
    for line in &direct {
        let way = [0, 1, 2].map(|i| line.points[0][i] - line.points[1][i]);
        let length = way.iter().map(|x| x * x).sum::<f64>().sqrt();
        let along: f64 = way.iter().zip(sun).map(|(a, b)| a * b).sum();
        // all of the sun in one direction, and places in single precision
        assert!(line.points.len() == 2 && along > 0.99998 * length, "{line:?} {sun:?}");
        assert!((line.points[1][2] - 0.05).abs() < 1e-5 && (line.points[1][0] - 0.1).abs() < 0.101);
        longest = longest.max(length);
    }
    assert!(direct.len() > 100 && longest > 5.0, "{} {longest}", direct.len());
}

/// The command writes its table to the terminal and its four kinds of files, each the same every time;
/// without light it says so, and writes files without rows.
#[test]
fn the_command_writes_tables_and_lines() {
    let scene = room_with_leaf(3, 0.5)
        .light(json!({ "name": "left", "type": "point", "position": [-0.7, 0.2, 0.3], "power": [3, 4] }))
        .with("settings", json!({ "guiding": "aim" }))
        .write();
    let folder = scene.path("");
    let options =
        ["--photons", "20000", "-o", "a.csv", "-o", "a.json", "-o", "a.vtp", "-o", "a.glb"];
    let trace = |more: &[&str]| {
        let output = phylux(&folder, &[&["trace", "scene.json"], more, &options].concat());
        assert!(output.status.success(), "{}", stderr(&output));
        let files = ["a.csv", "a.json", "a.vtp", "a.glb"]
            .map(|file| fs::read(scene.path(file)).expect(file));
        (String::from_utf8_lossy(&output.stdout).into_owned(), stderr(&output), files)
    };
    let (text, said, files) = trace(&["--to", "tiles/1"]);
    assert_eq!(said, "");
    for word in
        ["tiles/1: ", "W in b0", "last surface", "direct", "room (wall)", "share, %", "wrote a.glb"]
    {
        assert!(text.contains(word), "`{word}`: {text}");
    }
    assert!(files == trace(&["--to", "tiles/1", "--threads", "1"]).2);
    let csv = String::from_utf8_lossy(&files[0]).into_owned();
    assert!(
        csv.starts_with(
            "captor,face,light,last_surface,material,band,share,share_se,flux,flux_se,histories\n"
        ),
        "{csv}"
    );
    let shares = csv.lines().skip(1).map(|row| row.split(',').collect::<Vec<_>>());
    let of_band: f64 = shares
        .filter(|row| row[5] == "b1")
        .map(|row| row[6].parse::<f64>().expect("a number"))
        .sum();
    assert!((of_band - 1.0).abs() < 1e-12, "{csv}");
    let json: Value = serde_json::from_slice(&files[1]).expect("JSON");
    assert_eq!(json["lines"].as_array().expect("lines").len(), 500);
    assert!(files[2].starts_with(b"<?xml") && files[3].starts_with(b"glTF"));
    // a group of captors, the back of one, and a band
    let (text, ..) = trace(&["--to", "tiles", "--band", "b1"]);
    assert!(text.contains("tiles: ") && text.contains("in b1"), "{text}");
    let (text, ..) = trace(&["--to", "leaf/leaf", "--face", "back"]);
    assert!(text.contains("leaf/leaf, back: "), "{text}");

    let dark = room_with_leaf(1, 0.5)
        .light(
            json!({ "name": "out", "type": "spot", "position": [0, 0, 5], "direction": [0, 0, 1],
                       "half_angle_deg": 10, "power": [1, 1] }),
        )
        .write();
    let output = phylux(
        &dark.path(""),
        &[
            "trace",
            "scene.json",
            "--to",
            "tiles",
            "--photons",
            "1000",
            "-o",
            "a.csv",
            "-o",
            "a.vtp",
        ],
    );
    assert!(
        output.status.success()
            && stderr(&output).contains("warning: no light has come to tiles in "),
        "{}",
        stderr(&output)
    );
    assert_eq!(fs::read_to_string(dark.path("a.csv")).expect("a table").lines().count(), 1);
}

/// Names that are not there are refused with the nearest one, and so are faces that count no light,
/// forms that are not known, and more captors than a page follows.
#[test]
fn wrong_names_and_forms_are_refused() {
    let scene = room_with_leaf(3, 0.5)
        .light(json!({ "name": "left", "type": "point", "position": [-0.7, 0.2, 0.3], "power": [3, 4] }))
        .write();
    let folder = scene.path("");
    let refuses = |more: &[&str], words: &[&str]| {
        refused(&folder, &[&["trace", "scene.json", "--photons", "1000"], more].concat(), words);
    };
    refuses(&["--to", "tile"], &["--to: ", "no captor or group `tile`", "did you mean `tiles`?"]);
    refuses(&["--to", "nothing-like-it"], &["no captor or group", "`phylux check` name them"]);
    refuses(&["--to", "tiles", "--band", "b2"], &["--band: ", "no band `b2`", "did you mean `b"]);
    refuses(&["--to", "tiles/1", "--face", "back"], &["--face: ", "no light at its back"]);
    refuses(&["--to", "tiles", "-o", "a.png"], &["a.png", ".csv, .json, .vtp or .glb"]);
    refuses(&["--to", "tiles", "-o", "a.csv", "-o", "a.csv"], &["named for two outputs"]);
    let to_none = ["view", "scene.json", "--to", "tile", "-o", "a.html"];
    refused(&folder, &to_none, &["no captor or group `tile`"]);
    let many = room_with_leaf(1001, 0.001)
        .light(json!({ "type": "point", "position": [0, 0, 0.9], "power": [1, 1] }))
        .write();
    let too_many = ["view", "scene.json", "--to", "tiles", "-o", "a.html"];
    refused(&many.path(""), &too_many, &["--to: ", "names 1001 captors", "at most 1000"]);
}
