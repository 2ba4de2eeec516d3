//! Studies of error against cost: what they find where the truth is known, their table and their
//! pictures.

use std::path::Path;

use phylux::{
    Control, Estimator, LoadedScene, Settings,
    studies::{ConvergencePlan, ConvergenceStudy, Reference, Rung},
    transport::PhotonCount,
};
use serde_json::json;

use crate::{
    bad_input::{listing, phylux, refused},
    common::TestScene,
    world::{Mesh, World, beam, room},
};

/// The fraction of the lamp's power that the captor receives. Since the captor has an area of 1 m2
/// and the lamp a power of 1 W, it is also the captor's irradiance.
const SHARE: f64 = 0.200_043_776;

/// Returns two perpendicular unit squares that share an edge: one is a lamp of 1 W, the other a
/// captor.
fn corner() -> World {
    let floor = Mesh::rectangle([0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]);
    let wall = Mesh::rectangle([0.0; 3], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]);
    World::new().captor("wall", &wall).lamp("lamp", &floor, 1.0)
}

fn load(scene: &TestScene) -> LoadedScene {
    phylux::load(&scene.path("scene.json")).unwrap_or_else(|e| panic!("{e}"))
}

fn study(scene: &TestScene, truth: Option<&Path>, seeds: u64) -> ConvergenceStudy {
    let loaded = load(scene);
    let plan = ConvergencePlan { photons: 100_000, seed: 1, seeds, k: vec![400], threads: 0 };
    let control = Control::default();
    let truth =
        truth.map(|path| Reference::read(path, &loaded.scene).unwrap_or_else(|e| panic!("{e}")));
    phylux::studies::study(&loaded.scene, &plan, truth, &control).unwrap_or_else(|e| panic!("{e}"))
}

fn table(scene: &TestScene) -> std::path::PathBuf {
    let path = scene.path("truth.csv");
    let text = format!("captor,band,irradiance_W_m2,stderr\nwall,b0,{SHARE},0\n");
    std::fs::write(&path, text).expect("a table");
    path
}

/// Returns a lamp of 1 W in a cell of 1 m that repeats, 30 m above a captor of the area [`SHARE`]:
/// the captor receives this share of photons that come mixed, as if each were independent.
fn far_above() -> World {
    let lamp = Mesh::square([0.5, 0.5, 30.0], [0.0, 0.0, -1.0], 1.0);
    World::new()
        .captor("wall", &Mesh::square([0.5, 0.5, 0.0], [0.0, 0.0, 1.0], SHARE.sqrt()))
        .lamp("lamp", &lamp, 1.0)
        .with("periodic", json!({ "x": [0, 1], "y": [0, 1] }))
}

/// A captor that receives the fraction p of n independent photons has the relative spread
/// sqrt((1 - p) / (p n)) and no bias; photons that come straight from a lamp spread less. The 400
/// nearest photons show the irradiance in the captor's middle, whose difference from the mean over
/// the captor appears as a bias.
///
/// 40 seeds: a spread is known to sqrt(1 / 78), which is 11 %, and is within 4 times that except
/// with odds of 1e-4. 15 comparisons, odds of a false alarm 2e-3.
#[test]
fn spread_and_bias_are_those_of_theory() {
    const SEEDS: u64 = 40;
    let scene = corner().write();
    let truth = table(&scene);
    let found = study(&scene, Some(&truth), SEEDS);
    assert_eq!((found.compared, found.floor), (1, 0.0));
    let of = |name: &'static str| found.rungs.iter().filter(move |rung| rung.estimator == name);
    assert_eq!((of("photons").count(), of("paths").count()), (7, 7));
    let within = 4.0 * (0.5 / (SEEDS as f64 - 1.0)).sqrt();
    let off = |rung: &Rung| {
        let expected = ((1.0 - SHARE) / (SHARE * rung.photons as f64)).sqrt();
        rung.spread / expected - 1.0
    };
    let mixed = study(&far_above().write(), None, SEEDS);
    for rung in mixed.rungs.iter().filter(|rung| rung.estimator == "photons") {
        assert!(off(rung).abs() < within, "{} photons: spread off by {}", rung.photons, off(rung));
    }
    for rung in of("photons") {
        assert!(off(rung) < within, "{} photons: spread off by {}", rung.photons, off(rung));
        // the mean of all seeds has no bias, within 4 of its errors
        assert!(rung.bias < 4.0 * rung.spread / (SEEDS as f64).sqrt(), "{}", rung.bias);
        // the root mean square contains spread and bias
        let whole = rung.spread.hypot(rung.bias);
        assert!((rung.error / whole - 1.0).abs() < 0.25, "{} {whole}", rung.error);
    }
    let middle = crate::exact::polygon_irradiance(
        [0.0, 0.5, 0.5],
        [1.0, 0.0, 0.0],
        &[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]],
    ) / std::f64::consts::PI;
    let expected = (middle / SHARE - 1.0).abs();
    let nearest = of("400 nearest photons").next_back().expect("a rung");
    let error = nearest.spread / (SEEDS as f64).sqrt();
    assert!(expected > 5.0 * error, "{expected} {error}");
    assert!((nearest.bias - expected).abs() < 4.0 * error, "{} for {expected}", nearest.bias);
    assert!(nearest.arrivals.is_some_and(|a| (a / (SHARE * 1e5) - 1.0).abs() < 0.02));
    // all light comes directly from the lamp
    assert_eq!(found.bounces.rows.len(), 1);
    assert_eq!((found.bounces.rows[0].bounces, found.bounces.rows[0].share), (0, 1.0));
}

/// In a closed room of reflectance rho, the fraction of the light that arrives after at most b
/// bounces is 1 - rho^(b + 1).
///
/// Seed 1, 1e4 photons, each of which arrives once directly. From the sizes of the terms, the
/// standard error of a fraction is below 0.003. 4 comparisons within 4 of these errors.
#[test]
fn light_arrives_after_bounces() {
    let scene = World::new()
        .lambert("wall", 0.5)
        .counted("room", "wall", &room([-1.0; 3], [1.0; 3]))
        .light(json!({ "type": "point", "position": [0.1, 0.2, 0.3], "power": 1 }))
        .write();
    let found = study(&scene, None, 2);
    assert_eq!(found.bounces.photons, 10_000);
    for (row, bounces) in found.bounces.rows.iter().zip(0..4) {
        assert_eq!(row.bounces, bounces);
        let expected = 1.0 - 0.5f64.powi(bounces as i32 + 1);
        assert!((row.share - expected).abs() < 0.012, "{bounces}: {} for {expected}", row.share);
    }
    assert!(found.floor > 0.0 && found.floor < 0.01, "{}", found.floor);
}

/// A trial chooses the cheaper estimator: complete paths for a small captor in a large room, where
/// photons cost more than four times as much; photons where all light is left to them.
///
/// Seed 1. The outcome depends on no other chance.
#[test]
fn a_trial_picks_the_cheaper_estimator() {
    let choice = |loaded: &LoadedScene| {
        let settings = Settings {
            estimator: Estimator::Auto,
            photons: PhotonCount::new(1_000_000).ok(),
            ..Settings::default()
        };
        let control = Control::default();
        let simulation = phylux::simulate(&loaded.scene, &settings, &control).expect("a run");
        let choice = simulation.choice().expect("a choice").clone();
        assert_eq!(choice.estimator, simulation.estimator());
        println!("{}: {}", choice.estimator, choice.why);
        choice
    };
    let hall = World::new()
        .lambert("white", 0.7)
        .surface("room", "white", &room([-5.0; 3], [5.0; 3]))
        .captor("sensor", &Mesh::square([1.0, 2.0, -4.0], [0.0, 0.0, 1.0], 0.01))
        .lamp("lamp", &Mesh::square([0.0, 0.0, 4.9], [0.0, 0.0, -1.0], 1.0), 1.0);
    let found = choice(&load(&hall.write()));
    assert_eq!(found.estimator, Estimator::Complete);
    let times = found.why.split(' ').next().and_then(|word| word.parse::<f64>().ok());
    assert!(times.is_some_and(|times| times > 4.0), "{}", found.why);

    let behind_glass = World::new()
        .material("glass", json!({ "type": "transparent", "ior": 1.5 }))
        .surface("block", "glass", &Mesh::cuboid([-0.5, -0.5, 0.4], [0.5, 0.5, 0.6]))
        .captor("sensor", &Mesh::square([0.0; 3], [0.0, 0.0, 1.0], 0.4))
        .light(beam([0.0, 0.0, 1.0], [0.0; 3], 5.0));
    let found = choice(&load(&behind_glass.write()));
    assert_eq!(found.estimator, Estimator::Photons);
    assert!(found.why.starts_with("complete paths would take "), "{}", found.why);
}

/// The command writes pictures with named axes, and the numbers that they show.
#[test]
fn the_command_draws_and_says() {
    let scene = corner().write();
    table(&scene);
    let folder = scene.path("");
    let arguments =
        ["chart", "scene.json", "--truth", "truth.csv", "--photons", "1e4", "--seeds", "8"];
    let output = phylux(&folder, &[&arguments[..], &["--k", "5,20", "-o", "charts"]].concat());
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    for words in ["1 % at the median captor: photons, ", "; paths, ", "20 nearest photons"] {
        assert!(said.contains(words), "{said}");
    }
    assert!(said.contains("of the light arrives within 0 bounces"), "{said}");
    let pictures = ["bias.svg", "bounces.svg", "error.svg", "map.svg", "merit.svg"];
    let charts = scene.path("charts");
    assert_eq!(
        listing(&charts),
        [
            &pictures[..1],
            &["bounces.svg", "chart.written.json"],
            &pictures[2..],
            &["rows.csv", "study.json"]
        ]
        .concat()
    );
    for name in pictures {
        let svg = std::fs::read_to_string(charts.join(name)).expect("a picture");
        assert!(svg.starts_with("<svg") && svg.trim_end().ends_with("</svg>"), "{name}");
        assert!(!svg.contains("NaN") && !svg.contains("inf"), "{name}");
    }
    let error = std::fs::read_to_string(charts.join("error.svg")).expect("a picture");
    for words in [
        "CPU time without starting, s",
        "relative RMS error of irradiance",
        "slope −1/2",
        "5 nearest",
    ] {
        assert!(error.contains(words), "{words}");
    }
    // spread and bias of each estimator are in a panel of its own
    let bias = std::fs::read_to_string(charts.join("bias.svg")).expect("a picture");
    for words in ["spread", "bias, where noise is not all of it", "paths", "20 nearest photons"] {
        assert!(bias.contains(words), "{words}");
    }
    // the same as pixels of a column's width, in place of the others, without another run
    let rows = std::fs::read(charts.join("rows.csv")).expect("rows");
    let study = std::fs::read(charts.join("study.json")).expect("a study");
    let again = ["chart", "charts/study.json", "-o", "charts"];
    let output = phylux(&folder, &[&again[..], &["--png", "--width", "3.5"]].concat());
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    assert!(said.lines().eq(String::from_utf8_lossy(&output.stdout).lines()), "the same words");
    assert!(rows == std::fs::read(charts.join("rows.csv")).expect("rows"), "the same rows");
    assert!(study == std::fs::read(charts.join("study.json")).expect("a study"), "the same study");
    refused(
        &folder,
        &[&again[..], &["--photons", "1e4"]].concat(),
        &["charts/study.json", "holds runs that are complete", "--width"],
    );
    std::fs::write(scene.path("study.json"), "{\"rungs\": 3}").expect("written");
    let wrong = ["chart", "study.json", "-o", "charts"];
    refused(&folder, &wrong, &["study.json: is no study of charts", "scene again"]);
    for name in pictures {
        assert!(!charts.join(name).exists(), "{name}");
        let bytes = std::fs::read(charts.join(name.replace("svg", "png"))).expect("a picture");
        let reader = png::Decoder::new(std::io::Cursor::new(bytes)).read_info().expect("PNG");
        assert_eq!(reader.info().width, 1050, "{name}");
    }
    // 7 budgets and 8 seeds for photons and two k; paths for the 5 budgets that allow 100 of them
    let rows = std::fs::read_to_string(charts.join("rows.csv")).expect("rows");
    assert_eq!(rows.lines().count(), 1 + 8 * (7 * 3 + 5));
}

/// A trial ends soon although paths between perfect mirrors never end. Without a captor there is no
/// trial.
#[test]
fn a_trial_has_an_end() {
    let mirrors = World::new()
        .material("mirror", json!({ "type": "mirror", "reflectance": 1 }))
        .surface("room", "mirror", &room([-1.0; 3], [1.0; 3]))
        .lamp("lamp", &Mesh::square([0.0, 0.0, 0.9], [0.0, 0.0, -1.0], 0.3), 1.0);
    let run = |world: &World| {
        let loaded = load(&world.write());
        let settings = Settings {
            estimator: Estimator::Auto,
            photons: PhotonCount::new(128).ok(),
            ..Settings::default()
        };
        let control = Control::default();
        let simulation = phylux::simulate(&loaded.scene, &settings, &control).expect("a run");
        simulation.choice().cloned()
    };
    // the trial stops at its limit of work: 65,536 photons of 10,000 interactions each would take
    // minutes
    let captor = Mesh::square([0.0; 3], [0.0, 0.0, 1.0], 0.5);
    assert!(run(&mirrors.clone().captor("captor", &captor)).is_some());
    let choice = run(&mirrors).expect("a choice");
    assert_eq!(choice.estimator, Estimator::Photons);
    assert!(choice.why.contains("no captor"), "{}", choice.why);
}

/// A study of a captor that receives no light is refused, because no irradiance is known.
#[test]
fn a_study_of_the_dark_is_refused() {
    let scene = World::new()
        .captor("away", &Mesh::square([0.0; 3], [0.0, 0.0, 1.0], 1.0))
        .light(beam([0.0, 0.0, 1.0], [0.0, 0.0, 2.0], 5.0))
        .write();
    let folder = scene.path("");
    let output = phylux(&folder, &["chart", "scene.json", "--photons", "1e4", "-o", "charts"]);
    assert_eq!(output.status.code(), Some(2));
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(said.contains("knows the irradiance of no captor to 5 %"), "{said}");
    assert!(!scene.path("charts").exists());

    let plan = ConvergencePlan { photons: 1000, seed: 1, seeds: 1, k: vec![], threads: 1 };
    let control = Control::default();
    let error =
        phylux::studies::study(&load(&scene).scene, &plan, None, &control).expect_err("one seed");
    assert!(error.to_string().contains("1 seeds, must be at least 2"), "{error}");
}

#[test]
fn bad_tables_of_truths() {
    let scene = corner().write();
    let loaded = load(&scene);
    let path = scene.path("truth.csv");
    for (text, words) in [
        ("", "truth.csv:1: has no column `captor`"),
        ("captor,band\nwall,b0\n", "truth.csv:1: has no column `irradiance`"),
        ("captor,band,irradiance\n", "holds no value above 0"),
        (
            "captor,band,irradiance\nwal,b0,1\n",
            "truth.csv:2: no captor `wal` in the scene; did you mean",
        ),
        ("captor,band,irradiance\nwall,b1,1\n", "truth.csv:2: no band `b1` in the scene"),
        (
            "captor,band,irradiance\nwall,b0,nan\n",
            "truth.csv:2: `nan` must be a number, 0 or from 1e-60 to 1e60",
        ),
        (
            "captor,band,irradiance\nwall,b0,-1\n",
            "truth.csv:2: `-1` must be a number, 0 or from 1e-60 to 1e60",
        ),
        ("captor,band,irradiance\nwall,b0\n", "is no CSV table"),
        ("captor,face,band,irradiance\nwall,back,b0,1\n", "truth.csv:2: no face `back`"),
    ] {
        std::fs::write(&path, text).expect("a table");
        let error = Reference::read(&path, &loaded.scene).expect_err(text).to_string();
        assert!(error.contains(words), "{text}: {error}");
    }
    assert!(Reference::read(&scene.path("none.csv"), &loaded.scene).is_err());
}
