//! Sweeps over the powers of lights, which need fewer simulations than runs.

use phylux::transport::PhotonCount;
use serde_json::{Value, json};

use super::*;
use crate::{
    common::run_file,
    sensitivity::mixed,
    world::{Mesh, World},
};

/// Returns a scene with two leaves in two bands under four point lights, one of which shines from
/// below.
fn scene() -> Value {
    json!({
        "bands": [{"name": "a"}, {"name": "b"}],
        "materials": {"leaf": {"type": "leaf", "reflectance": [0.1, 0.4], "transmittance": [0.1, 0.5]}},
        "objects": [{"name": "a", "obj": "a.obj", "material": "leaf", "captor": true},
                    {"name": "up", "obj": "up.obj", "material": "leaf", "captor": "triangle"}],
        "lights": [
            {"name": "left", "type": "point", "position": [0.2, 0.2, 0.1], "power": [1, 1]},
            {"type": "point", "position": [0.3, 0.3, 0.2], "power": 1},
            {"name": "below", "type": "point", "position": [0.3, 0.3, -0.1], "power": [1, 0]},
            {"name": "corner", "type": "point", "position": [0.1, 0.4, 0.1], "power": [0.5, 0.25]}
        ],
        "settings": {"photons": 20000, "seed": 7}
    })
}

const UP: &str = "v 0 0 0.5\nv 0 1 0.5\nv 1 0 0.5\nv 1 1 0.5\nf 1 2 3\nf 2 4 3\n";

fn write(folder: &TestScene, name: &str, value: &Value) {
    fs::write(folder.path(name), value.to_string()).expect("a file");
}

fn with(sweep: &Value, scene: &Value) -> TestScene {
    let sweep = sweep.to_string();
    TestScene::new(&scene.to_string(), &[("a.obj", OBJ), ("up.obj", UP), ("sweep.json", &sweep)])
}

/// Returns the results of each run, in order.
fn results(folder: &TestScene, out: &str) -> Vec<Value> {
    let table = fs::read_to_string(folder.path(out).join("runs.csv")).expect("a table");
    let file = |line: &str| line.split(',').nth(1).expect("a file").to_string();
    let read = |name: String| fs::read_to_string(folder.path(out).join("runs").join(name));
    let value = |line| serde_json::from_str(&read(file(line)).expect("results")).expect("JSON");
    table.lines().skip(1).map(value).collect()
}

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().expect("a list").iter().map(|v| v.as_f64().unwrap_or(0.0)).collect()
}

/// Returns every value of captors and groups with its error, and separately the k-nearest values.
fn values(result: &Value) -> (Vec<(f64, f64)>, Vec<f64>) {
    let (mut all, mut knn) = (Vec::new(), Vec::new());
    for list in ["captors", "groups"] {
        for captor in result[list].as_array().expect("a list") {
            for face in [&captor["front"], &captor["back"]] {
                all.extend(numbers(&face["flux"]).into_iter().zip(numbers(&face["flux_se"])));
                if face["knn"].is_object() {
                    knn.extend(numbers(&face["knn"]["irradiance"]));
                    knn.extend(numbers(&face["knn"]["radiance"]));
                }
            }
            let absorbed = numbers(&captor["absorbed"]).into_iter();
            all.extend(absorbed.zip(numbers(&captor["absorbed_se"])));
        }
    }
    (all, knn)
}

fn near(a: &[f64], b: &[f64], tolerance: f64) {
    assert_eq!(a.len(), b.len());
    for (a, b) in a.iter().zip(b) {
        assert!((a - b).abs() <= tolerance * a.abs().max(b.abs()), "{a} and {b}");
    }
}

/// Eight runs are computed from one simulation. The run at the largest powers is what `phylux run`
/// finds, to rounding, and the run at half of all powers is half of that. All runs agree with
/// separate runs of other seeds.
///
/// The simulation has 20 times the photons of the separate runs, five of each, so that z is theirs. The
/// values of a run rest on the same photons, some three of them are independent. Of some 870 z none is
/// above 4.8 (odds 2e-3), and their root mean square is 0.8 to 1.2 (odds 3e-3).
#[test]
fn a_power_sweep_is_one_simulation() {
    let sweep = json!({ "scene": "scene.json", "combine": "zip", "vary": {
        "/lights/0/power": [[2, 3], [1, 1.5], [0, 0], [2, 0.5], [0.1, 3], [2, 3], [1, 1], [0, 1]],
        "/lights/1/power": [4, 2, 1, 0, 3, 4, 0.5, 0],
        "/lights/2/power/0": [1, 0.5, 1, 1, 1, 0, 0.25, 1],
        "/lights/3/power": [[0.5, 0.25], [0.25, 0.125], 0.25, 0, 0.125, [0.5, 0], 0.25, 0.125] } });
    let mut scene = scene();
    scene["lights"][2]["power"] = json!([1, 0]);
    scene["settings"]["photons"] = json!(400_000);
    let folder = with(&sweep, &scene);
    let said = ok(&folder, "sweep sweep.json -o out");
    let from = "8 runs from 1 simulation: light is linear in the powers\n";
    assert_eq!(said, format!("{from}8 of 8 runs are done; wrote out\n"));
    let found = results(&folder, "out");
    let (largest, halves) = (values(&found[0]), values(&found[1]));
    let run = |number: usize, seed: u64, photons: u64| {
        let mut own = scene.clone();
        for (place, all) in sweep["vary"].as_object().expect("places") {
            *own.pointer_mut(place).expect("a place") = all[number].clone();
        }
        write(&folder, "own.json", &own);
        let result = run_file(&folder.path("own.json"), |settings| {
            (settings.photons, settings.seed) = (PhotonCount::new(photons).ok(), seed);
        });
        serde_json::to_value(result).expect("JSON")
    };
    let same = run(0, 7, 400_000);
    let means = |of: &[(f64, f64)]| of.iter().map(|(mean, _)| *mean).collect::<Vec<_>>();
    near(&means(&values(&same).0), &means(&largest.0), 1e-12);
    near(&values(&same).1, &largest.1, 1e-6);
    assert!(largest.1.len() >= 16 && found[0]["map"] == same["map"]);
    for ((whole, whole_se), (half, half_se)) in largest.0.iter().zip(&halves.0) {
        assert_eq!(0.5 * whole, *half);
        assert!((0.5 * whole_se - half_se).abs() <= 1e-9 * whole_se);
    }
    let mut zs = Vec::new();
    for (seed, (number, found)) in (100..).zip((0..5).flat_map(|_| found.iter().enumerate())) {
        let own = run(number, seed, 20_000);
        for entry in ["power", "emitted"] {
            near(&numbers(&own["energy"][entry]), &numbers(&found["energy"][entry]), 1e-12);
        }
        let ledger = |key: &str| numbers(&found["energy"][key]);
        let accounted = [ledger("absorbed"), ledger("escaped"), ledger("lost")];
        let accounted: Vec<f64> = (0..2).map(|b| accounted.iter().map(|v| v[b]).sum()).collect();
        near(&accounted, &ledger("emitted"), 1e-9);
        for ((a, a_se), (b, b_se)) in values(&own).0.into_iter().zip(values(found).0) {
            if a_se > 0.0 || b_se > 0.0 {
                zs.push((a - b) / a_se.hypot(b_se));
            }
        }
    }
    let worst = zs.iter().fold(0.0f64, |worst, z| worst.max(z.abs()));
    let rms = (zs.iter().map(|z| z * z).sum::<f64>() / zs.len() as f64).sqrt();
    assert!(
        zs.len() > 750 && worst < 4.8 && (0.8..1.2).contains(&rms),
        "{worst} {rms} {}",
        zs.len()
    );
}

/// A sweep of powers whose runs name no estimator, and of which each alone is long enough for a trial
/// that takes complete paths, traces photons once for all of them: the light doubles with the power,
/// to rounding. The test does not depend on chance.
#[test]
fn a_long_power_sweep_traces_photons() {
    let shipped = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes");
    let read = |name: &str| fs::read_to_string(shipped.join(name)).expect("a file");
    let sweep = json!({ "scene": "scene.json", "vary": { "/lights/0/power": [50, 100] } });
    let (scene, mesh, sweep) = (read("box.json"), read("box.obj"), sweep.to_string());
    let folder = TestScene::new(&scene, &[("box.obj", &mesh), ("sweep.json", &sweep)]);
    ok(&folder, "sweep sweep.json -o out");
    ok(&folder, "run scene.json -o alone.json");
    let alone = fs::read_to_string(folder.path("alone.json")).expect("results");
    assert_eq!(serde_json::from_str::<Value>(&alone).expect("JSON")["estimator"], "complete");
    let found = results(&folder, "out");
    let [half, whole] = &found[..] else { panic!("two runs") };
    assert_eq!([&half["estimator"], &whole["estimator"]], ["photons"; 2]);
    let flux = |result: &Value| numbers(&result["captors"][0]["front"]["flux"])[0];
    assert!((2.0 * flux(half) / flux(whole) - 1.0).abs() < 1e-9);
}

/// Sweeps that are not linear in powers, or not certainly so, simulate each run.
#[test]
fn other_sweeps_run_each() {
    let sweep = |vary: Value| json!({ "scene": "scene.json", "vary": vary });
    let powers = || json!({ "/lights/0/power": [[1, 2], [2, 1]], "/lights/1/power": [1, 2] });
    let runs = |change: &dyn Fn(&mut Value), sweep: Value| {
        let mut scene = scene();
        change(&mut scene);
        let said = ok(&with(&sweep, &scene), "sweep sweep.json --dry-run");
        let from = said.lines().find(|line| line.contains("linear"));
        from.map(|line| line.split(':').next().expect("words").to_string())
    };
    let linear = |runs: usize, simulations: &str| Some(format!("{runs} runs from {simulations}"));
    assert_eq!(runs(&|_| {}, sweep(powers())), linear(4, "1 simulation"));
    assert_eq!(runs(&|s| s["settings"]["estimator"] = json!("paths"), sweep(powers())), None);
    // photons that are split by light serve all powers, whatever a trial would choose for one
    let auto = |s: &mut Value| s["settings"]["estimator"] = json!("auto");
    assert_eq!(runs(&auto, sweep(powers())), linear(4, "1 simulation"));
    assert_eq!(runs(&|s| s["settings"]["max_time"] = json!(10), sweep(powers())), None);
    assert_eq!(runs(&|s| s["settings"]["tolerance"] = json!(0.5), sweep(powers())), None);
    // for a sum of bands that vary separately, the error could not be computed
    let sums = |s: &mut Value| s["sums"] = json!({ "both": ["a", "b"] });
    assert_eq!(runs(&sums, sweep(powers())), None);
    let alike = json!({ "/lights/0/power": [[1, 2], [2, 4]], "/lights/1/power": [1, 2] });
    assert_eq!(runs(&sums, sweep(alike)), linear(4, "1 simulation"));
    let two = json!({ "/lights/1/power": [1, 2, 3], "/settings/photons": [1000, 2000] });
    assert_eq!(runs(&|_| {}, sweep(two)), linear(6, "2 simulations"));
    let estimators =
        json!({ "/lights/1/power": [1, 2, 3], "/settings/estimator": ["photons", "paths"] });
    let photons = |s: &mut Value| s["settings"]["estimator"] = json!("photons");
    assert_eq!(runs(&photons, sweep(estimators)), linear(6, "4 simulations"));
    let sampled = json!({ "scene": "scene.json", "combine": { "sample": "sobol", "count": 8 },
        "vary": { "/lights/1/power": { "from": 0, "to": 2 }, "/lights/0/power/1": { "from": 1, "to": 2 } } });
    assert_eq!(runs(&|_| {}, sampled), linear(8, "1 simulation"));
}

/// A run with an impossible power fails alone, with the message of `phylux run`. If the sweep is
/// started again with an additional larger power, all runs are computed anew from a new simulation;
/// with a smaller one they are not.
#[test]
fn values_that_come_and_fail() {
    let sweep = |powers: &str| {
        format!(r#"{{"scene": "scene.json", "vary": {{"/lights/0/power": {powers}}}}}"#)
    };
    let folder = folder(&sweep(r#"[1, -1, "x", 1e300, 3]"#));
    let output = any(&folder, "sweep sweep.json -o out");
    assert_eq!(output.status.code(), Some(1));
    let said = stderr(&output);
    assert!(said.contains("/lights/0/power: -1, must be at least 0"), "{said}");
    assert!(said.contains("1e300 W or umol/s in a band"), "{said}");
    let stdout = String::from_utf8_lossy(&output.stdout).into_owned();
    assert_eq!(
        stdout,
        "5 runs from 4 simulations: light is linear in the powers\n2 of 5 runs are done; wrote out\n"
    );
    let again = |powers: &str| {
        fs::write(folder.path("sweep.json"), sweep(powers)).expect("a sweep");
        ok(&folder, "sweep sweep.json -o grown").lines().last().expect("a line").to_string()
    };
    assert_eq!(again("[1, 3]"), "2 of 2 runs are done; wrote grown");
    assert_eq!(again("[1, 3, 2]"), "3 of 3 runs are done, 2 of them from before; wrote grown");
    assert_eq!(again("[1, 3, 2, 4]"), "4 of 4 runs are done; wrote grown");
    ok(&folder, "sweep sweep.json -o fresh");
    let differ = differences(&folder.path("grown"), &folder.path("fresh"));
    assert!(differ.is_empty(), "{differ:?}");
}

/// Returns every value of groups with its error.
fn light(result: &Value) -> Vec<(f64, f64)> {
    let mut all = Vec::new();
    for group in result["groups"].as_array().expect("a list") {
        let parts = [&group["front"], &group["back"]].map(|face| (&face["flux"], &face["flux_se"]));
        for (values, errors) in
            parts.into_iter().chain([(&group["absorbed"], &group["absorbed_se"])])
        {
            if values.is_array() {
                all.extend(numbers(values).into_iter().zip(numbers(errors)));
            }
        }
    }
    all
}

/// Runs that differ in the tint of a solid share their histories, and have the light of runs of
/// their own: behind a slab of index 1 it is in proportion to the square of the tint. Those that
/// differ in the tint of a pane are run one by one.
#[test]
fn runs_share_histories_through_solids() {
    let slab = Mesh::cuboid([-0.5, -0.5, 0.0], [0.5, 0.5, 0.1]);
    let up = [0.0, 0.0, 1.0];
    let world = World::new()
        .material("slab", json!({ "type": "transparent", "ior": 1.0, "tint": 0.8 }))
        .material("pane", json!({ "type": "transparent", "ior": 1.5, "tint": 0.8, "thin": true }))
        .surface("slab", "slab", &slab)
        .surface("pane", "pane", &Mesh::square([0.0, 0.0, -0.05], up, 1.0))
        .captor("below", &Mesh::disc([0.0, 0.0, -0.1], up, 0.15))
        .lamp("lamp", &Mesh::square([0.0, 0.0, 0.3], [0.0, 0.0, -1.0], 0.1), 10.0)
        .with("settings", json!({ "estimator": "photons", "photons": 20_000, "k": 0 }));
    let sweep = |place: &str| {
        let scene = world.write();
        let sweep = json!({ "scene": "scene.json", "vary": { (place): [0.4, 0.8] } });
        fs::write(scene.path("sweep.json"), sweep.to_string()).expect("a file");
        let said = ok(&scene, "sweep sweep.json -o out");
        let mut found: Vec<(f64, f64)> = results(&scene, "out")
            .iter()
            .map(|run| {
                let tint = run["sweep"]["parameters"][place].as_f64().expect("a tint");
                (tint, light(run)[0].0)
            })
            .collect();
        found.sort_by(|a, b| a.0.total_cmp(&b.0));
        (said, found)
    };
    let (said, found) = sweep("/materials/slab/tint");
    assert!(said.starts_with("2 runs from 1 simulation"), "{said}");
    near(&[found[0].1 / found[1].1], &[0.25], 1e-5);
    let (said, found) = sweep("/materials/pane/tint");
    assert!(!said.contains("from 1 simulation"), "{said}");
    assert!(found[0].1 < 0.6 * found[1].1, "{found:?}");
}

/// Runs that differ in reflectances, transmittances and powers share the histories of the brightest
/// scene. In a room of everything (a mirror, leaves that share their triangles, a glossy board, two
/// lamps), sixteen runs agree with runs of their own, of other seeds, and the energy balance of each
/// closes. By photons, aimed flights, paths and complete paths.
///
/// Of each estimator some hundreds of z, which are not independent: none above 4.8, and their root mean
/// square is 0.75 to 1.25; odds of a false alarm 4e-3.
#[test]
fn runs_share_histories() {
    let world = mixed(0.6, [0.3, 0.25], 0.8, 0.5);
    for (estimator, guiding, photons) in [
        ("photons", "off", 60_000),
        ("photons", "aim", 20_000),
        ("paths", "off", 20_000),
        ("complete", "off", 20_000),
    ] {
        let settings = json!({ "estimator": estimator, "guiding": guiding, "photons": photons });
        let sweep = json!({ "scene": "scene.json", "vary": {
            "/materials/wall/reflectance": [[0.2, 0.3], [0.6, 0.1]],
            "/materials/leaf/reflectance": [0.1, 0.3],
            "/materials/leaf/transmittance": [0.05, 0.25],
            "/lights/1/power": [[10, 2], [0, 20]] } });
        let scene = world.clone().with("settings", settings).write();
        fs::write(scene.path("sweep.json"), sweep.to_string()).expect("a file");
        let said = ok(&scene, "sweep sweep.json -o out");
        let from = "16 runs from 1 simulation: histories are weighted anew for other reflectances";
        assert!(said.starts_with(from), "{said}");
        let found = results(&scene, "out");
        assert_eq!(found.len(), 16);
        let (mut squares, mut count) = (0.0, 0.0);
        for (number, found) in found.iter().enumerate() {
            assert!(found["shared"].as_f64().is_some_and(|worth| (0.1..=1.0).contains(&worth)));
            let parameters = found["sweep"]["parameters"].as_object().expect("parameters");
            let mut document: Value = serde_json::from_str(
                &fs::read_to_string(scene.path("scene.json")).expect("a scene"),
            )
            .expect("JSON");
            for (place, value) in parameters {
                *document.pointer_mut(place).expect("a place") = value.clone();
            }
            write(&scene, "own.json", &document);
            let own =
                run_file(&scene.path("own.json"), |settings| settings.seed = 100 + number as u64);
            let own = serde_json::to_value(own).expect("JSON");
            for ((a, a_se), (b, b_se)) in light(found).into_iter().zip(light(&own)) {
                let error = a_se.hypot(b_se);
                if error > 0.0 {
                    let z = (a - b) / error;
                    assert!(
                        z.abs() < 4.8,
                        "{estimator}, {guiding}, run {number}: {a} ± {a_se}, {b} ± {b_se}"
                    );
                    (squares, count) = (squares + z * z, count + 1.0);
                } else {
                    near(&[a], &[b], 1e-6);
                }
            }
            if estimator != "paths" {
                let energy = |key: &str| numbers(&found["energy"][key]);
                let chance = found["energy"]["chance"].as_array().map(|_| energy("chance"));
                for b in 0..2 {
                    let spent = energy("absorbed")[b] + energy("escaped")[b] + energy("lost")[b];
                    let spent = spent + chance.as_ref().map_or(0.0, |chance| chance[b]);
                    near(&[energy("emitted")[b]], &[spent], 1e-5);
                }
            }
        }
        let rms = f64::sqrt(squares / count);
        assert!((0.75..1.25).contains(&rms), "{estimator}, {guiding}: {rms} of {count}");
    }
}
