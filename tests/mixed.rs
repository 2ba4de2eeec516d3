//! On what the light of a mix depends, and how uncertain its inputs make it: as a run at its powers
//! finds it.

use phylux::{
    Estimator, Guiding, RunResult, Settings,
    results::{BudgetResult, ByLight, Factor, SensitivityResult},
    transport::{NearestCount, PhotonCount},
};
use serde_json::{Value, json};

use crate::{
    bad_input::phylux,
    common::run_file,
    sensitivity::{Method, all, mixed},
    world::World,
};

/// A room of everything with two lamps, in two bands, with a sum, a ratio and uncertain inputs: the
/// powers of the panel and of the point.
fn scene(panel: Value, point: Value) -> World {
    let share = |power: &Value, share: f64| match power {
        Value::Array(all) => all.iter().map(|p| json!(share * p.as_f64().expect("W"))).collect(),
        one => json!(share * one.as_f64().expect("W")),
    };
    let uncertain = json!({
        "/materials/wall/reflectance": 0.03,
        "/materials/leaf/transmittance": 0.02,
        "/materials/board/reflectance":
            { "deviation": -0.04, "with": "/materials/leaf/transmittance" },
        "/lights/0/power": share(&panel, 0.02),
        "/lights/1/power": share(&point, 0.05)
    });
    mixed(0.6, [0.3, 0.25], 0.8, 0.5)
        .edited(|scene| {
            scene["lights"][0]["power"] = panel;
            scene["lights"][1]["power"] = point;
        })
        .with("ratios", json!({ "of": { "numerator": "b0", "denominator": "b1" } }))
        .with("sensitivity", json!(true))
        .with("uncertain", uncertain)
}

const PANEL: f64 = 30.0;
const POINT: [f64; 2] = [10.0, 20.0];

fn usual() -> World {
    scene(json!(PANEL), json!(POINT))
}

fn run(
    world: &World,
    (estimator, guiding, photons): Method,
    seed: u64,
    by_light: bool,
) -> RunResult {
    let scene = world.write();
    run_file(&scene.path("scene.json"), |settings| {
        let photons = PhotonCount::new(photons).ok();
        let k = Some(NearestCount::NONE);
        *settings = Settings { estimator, guiding, photons, seed, k, by_light, ..settings.clone() };
    })
}

fn factors(panel: Factor, point: Factor) -> ByLight<Factor> {
    [("panel".to_string(), panel), ("light1".to_string(), point)].into()
}

/// Returns elasticity, derivative and their errors in each band, sum and ratio, as far as they are
/// known.
fn numbers(row: &SensitivityResult) -> Vec<[Option<f64>; 2]> {
    let ratios = row.ratios.as_ref().expect("ratios");
    let lists = [
        (&row.elasticity, &row.elasticity_se),
        (&row.derivative, &row.derivative_se),
        (&ratios.elasticity, &ratios.elasticity_se),
        (&ratios.derivative, &ratios.derivative_se),
    ];
    lists.iter().flat_map(|(a, b)| a.iter().zip(*b).map(|(a, b)| [*a, *b])).collect()
}

/// Returns pairs of rows of two results that tell of the same.
fn pairs<'a>(
    a: &'a RunResult,
    b: &'a RunResult,
) -> Vec<(&'a SensitivityResult, &'a SensitivityResult)> {
    let same = |a: &SensitivityResult, b: &SensitivityResult| {
        (a.of(), a.group.is_some(), &a.face, &a.parameter)
            == (b.of(), b.group.is_some(), &b.face, &b.parameter)
    };
    let other = |row| all(b).iter().find(|other| same(row, other)).map(|other| (row, other));
    all(a).iter().filter_map(other).collect()
}

fn budget(result: &RunResult) -> &[BudgetResult] {
    result.extras.budget.as_deref().expect("a budget")
}

/// A mix with the factors 1 has the values of the run, whatever guides the photons: elasticities,
/// derivatives and budgets, and standard errors that are those of lamps which share no history.
///
/// Seeds 1 to 3. The values do not depend on chance; the ratios of errors of both ways do by
/// some 10 %, and their mean over 100 values or more is 1 within 0.1.
#[test]
fn a_mix_of_the_same_powers_is_the_run() {
    let ways = [Guiding::Off, Guiding::Aim, Guiding::Full];
    for (seed, guiding) in ways.into_iter().enumerate() {
        let method = (Estimator::Photons, guiding, 60_000);
        let found = run(&usual(), method, seed as u64 + 1, true);
        let same = found.mix(&ByLight::new()).expect("a mix");
        assert_eq!(all(&found).len(), all(&same).len(), "{guiding:?}");
        let (mut ratios, mut compared) = (Vec::new(), 0);
        for (a, b) in pairs(&found, &same) {
            for ([x, x_se], [y, y_se]) in numbers(a).into_iter().zip(numbers(b)) {
                let what = format!("{guiding:?}, {} {} {}", a.of(), a.face, a.parameter);
                assert_eq!((x.is_some(), x_se.is_some()), (y.is_some(), y_se.is_some()), "{what}");
                let (Some(x), Some(y)) = (x, y) else { continue };
                assert!((x - y).abs() <= 1e-7 * x.abs().max(1e-3), "{what}: {x}, {y}");
                compared += 1;
                if let (Some(x_se), Some(y_se)) = (x_se, y_se)
                    && x_se > 1e-3 * x.abs()
                {
                    ratios.push(y_se / x_se);
                }
            }
        }
        let mean = ratios.iter().sum::<f64>() / ratios.len() as f64;
        assert!(compared > 300 && ratios.len() > 100, "{compared}, {}", ratios.len());
        assert!((mean - 1.0).abs() < 0.1, "{guiding:?}: {mean} of {}", ratios.len());
        for (a, b) in budget(&found).iter().zip(budget(&same)) {
            let what = format!("{guiding:?}, {} {} {}", a.of(), a.face, a.band);
            assert_eq!((a.of(), &a.face, &a.band), (b.of(), &b.face, &b.band));
            // the noise that is taken off of a leaf's ratio is large
            if a.band != "of" || a.of() == "shelf" {
                assert!((b.model_se / a.model_se - 1.0).abs() < 0.01, "{what}: {a:?}, {b:?}");
                assert_eq!(a.largest[0].parameter, b.largest[0].parameter, "{what}");
            }
        }
        let model = |of: &RunResult| of.captors[0].front.irradiance_model_se.as_deref().cloned();
        let (a, b) = (model(&found).expect("its own"), model(&same).expect("its own"));
        assert!(a.iter().zip(b.iter()).all(|(a, b)| (a / b - 1.0).abs() < 0.02), "{a:?}, {b:?}");
    }
}

/// A mix has what a run at its powers finds by photons, complete paths and by default; by paths alone,
/// too, where nothing mirrors (they do not find the point in a mirror), and where factors differ between
/// bands.
///
/// Seeds 1 to 9. Seven runs beside two mixes, some 600 values each in groups: all z below 5, which
/// chance exceeds with odds of 2.5e-3; those of a run are far from independent, and their root mean
/// square is 0.6 to 1.4. Budgets agree within 15 %, and those of the shelf within 6 %, in bands and sums.
#[test]
fn a_mix_is_the_run_at_its_powers() {
    let cases = [
        (Factor::All(0.25), Factor::All(2.0), "mirror"),
        (Factor::Bands(vec![0.2, 1.5]), Factor::Bands(vec![3.0, 0.5]), "lambert"),
    ];
    let methods = [
        (Estimator::Photons, Guiding::Off, 400_000),
        (Estimator::Complete, Guiding::Off, 200_000),
        (Estimator::Auto, Guiding::Auto, 200_000),
        (Estimator::Paths, Guiding::Off, 200_000),
    ];
    for (case, (panel, point, mirror)) in cases.into_iter().enumerate() {
        let scattering = |world: World| {
            world.edited(|scene| scene["materials"]["mirror"]["type"] = json!(mirror))
        };
        let method = (Estimator::Photons, Guiding::Off, 400_000);
        let found = run(&scattering(usual()), method, 1, true);
        let power = |power: &[f64], factor: &Factor| -> Value {
            let of = |(b, power): (usize, &f64)| power * factor.values()[b % factor.values().len()];
            power.iter().enumerate().map(of).collect()
        };
        let world = scattering(scene(power(&[PANEL; 2], &panel), power(&POINT, &point)));
        let mix = found.mix_bands(&factors(panel, point)).expect("a mix");
        for (m, method) in methods.into_iter().take(3 + case).enumerate() {
            let other = run(&world, method, 2 + (4 * case + m) as u64, false);
            let mut zs = Vec::new();
            for (a, b) in pairs(&mix, &other).into_iter().filter(|(a, _)| a.group.is_some()) {
                for (i, ([x, x_se], [y, y_se])) in
                    numbers(a).into_iter().zip(numbers(b)).enumerate()
                {
                    let (Some(x), Some(y), Some(x_se), Some(y_se)) = (x, y, x_se, y_se) else {
                        continue;
                    };
                    let z = (x - y) / x_se.hypot(y_se).max(1e-9 * x.abs());
                    let what = format!("{method:?}, {} {} {}", a.of(), a.face, a.parameter);
                    assert!(z.abs() < 5.0, "{what}, {i}: {x} ± {x_se}, {y} ± {y_se}");
                    zs.push(z);
                }
            }
            let rms = (zs.iter().map(|z| z * z).sum::<f64>() / zs.len() as f64).sqrt();
            println!("{case}, {method:?}: rms {rms} of {}", zs.len());
            assert!(zs.len() > 500 && (0.6..1.4).contains(&rms), "{method:?}: {rms}");
            for (a, b) in budget(&mix).iter().zip(budget(&other)) {
                assert_eq!((a.of(), &a.face, &a.band), (b.of(), &b.face, &b.band));
                let most = match (&*a.band, a.of()) {
                    ("of", "shelf") => 0.15,
                    // what a leaf's ratio varies by is known worse
                    ("of", _) => continue,
                    (_, "shelf") => 0.06,
                    _ => 0.15,
                };
                let off = (a.model_se / b.model_se - 1.0).abs();
                assert!(off < most, "{method:?}, {} {} {}: {a:?}, {b:?}", a.of(), a.face, a.band);
            }
        }
    }
}

/// A mix of a mix is the mix of both; with one lamp alone it is what the results have of it, and its own
/// power has the elasticity 1; the rows of a lamp are its share. The test does not depend on chance.
#[test]
fn mixes_of_mixes_and_of_single_lamps() {
    let found = run(&usual(), (Estimator::Photons, Guiding::Off, 60_000), 1, true);
    let mix = |of: &RunResult, panel: f64, point: f64| {
        of.mix_bands(&factors(Factor::All(panel), Factor::All(point))).expect("a mix")
    };
    let (once, twice) = (mix(&found, 0.5, 3.0), mix(&mix(&found, 2.0, 0.5), 0.25, 6.0));
    assert_eq!(all(&once).len(), all(&twice).len());
    for (a, b) in pairs(&once, &twice) {
        for ([x, x_se], [y, y_se]) in numbers(a).into_iter().zip(numbers(b)) {
            for (x, y) in [(x, y), (x_se, y_se)] {
                assert_eq!(x.is_some(), y.is_some());
                let (x, y) = (x.unwrap_or(0.0), y.unwrap_or(0.0));
                assert!((x - y).abs() <= 1e-6 * x.abs().max(1e-3), "{}: {x}, {y}", a.parameter);
            }
        }
    }
    let alone = mix(&found, 1.0, 0.0);
    assert!(all(&alone).iter().all(|row| row.parameter != "/lights/1/power"));
    for (of_run, row) in pairs(&found, &alone) {
        let own = &of_run.by_light.as_ref().expect("parts")["panel"];
        for (x, y) in row.elasticity.iter().zip(&own.elasticity) {
            let (x, y) = (x.expect("light"), y.expect("light"));
            assert!((x - y).abs() < 1e-9 * y.abs().max(1.0), "{}: {x}, {y}", row.parameter);
        }
        if row.parameter == "/lights/0/power" {
            assert!(row.elasticity.iter().all(|e| e.is_some_and(|e| (e - 1.0).abs() < 1e-12)));
            assert_eq!(row.derivative, of_run.derivative);
        }
    }
    // the share of a lamp
    let group = once.groups.iter().find(|of| of.id == "shelf").expect("the shelf");
    let of = group.front.by_light.as_ref().expect("parts")["light1"].flux[1] / group.front.flux[1];
    let is_it = |row: &&SensitivityResult| {
        row.group.as_deref() == Some("shelf")
            && row.face == "front"
            && row.parameter == "/lights/1/power"
    };
    let row = all(&once).iter().find(is_it).expect("the row");
    assert!((row.elasticity[1].expect("light") - of).abs() < 1e-12);
}

/// The command mixes them, also those of shards; of results that have them for all lights together, or
/// with the errors of a calibration, it says that it has none.
#[test]
fn mixes_on_the_command_line() {
    let scene = usual().write();
    let said = |line: &str| {
        let words: Vec<&str> = line.split_whitespace().collect();
        let output = phylux(&scene.path(""), &words);
        let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
        assert!(output.status.success(), "{}", text(&output.stderr));
        (text(&output.stdout), text(&output.stderr))
    };
    let read = |name: &str| std::fs::read_to_string(scene.path(name)).expect("results");
    let run = "run scene.json --photons 20000 --estimator photons --by-light";
    said(&format!("{run} -o r.json"));
    for shard in ["1", "2"] {
        said(&format!("{run} --shard {shard}/2 -o {shard}.json"));
    }
    said("merge 1.json 2.json -o joined.json");
    let mixed = said("mix r.json --power panel=0.5 -o m.json");
    assert!(mixed.0.contains("per cent for 1 % more of each"), "{}", mixed.0);
    assert!(mixed.0.contains("per cent by uncertain inputs"), "{}", mixed.0);
    assert!(!mixed.1.contains("does not say on which"), "{}", mixed.1);
    said("mix joined.json --power panel=0.5 -o m2.json");
    assert_eq!(read("m.json"), read("m2.json"));
    // the powers of a calibration, with their errors
    let calibration = json!({ "bands": ["b0", "b1"], "lamps": ["panel", "light1"],
                              "factors": { "panel": [2, 2], "light1": [1, 1] },
                              "measured_bands": ["both"], "covariance": [[0.01, 0], [0, 0.01]] });
    std::fs::write(scene.path("c.json"), calibration.to_string()).expect("written");
    let words = "does not say on which inputs it depends";
    let none = |mix: &str| {
        let warned = said(&format!("mix {mix} -o m.json")).1;
        assert_eq!(warned.matches(words).count(), 1, "{warned}");
        let mixed = read("m.json");
        let named = ["\"sensitivity\"", "\"budget\"", "_model_se"];
        assert!(named.iter().all(|key| !mixed.contains(key)), "{mixed}");
    };
    none("r.json --calibration c.json");
    // results as they were before they had this by light
    let mut old: Value = serde_json::from_str(&read("r.json")).expect("JSON");
    for row in old["sensitivity"].as_array_mut().expect("rows") {
        row.as_object_mut().expect("a row").remove("by_light").expect("parts");
    }
    old.as_object_mut().expect("results").remove("uncertain").expect("inputs");
    std::fs::write(scene.path("old.json"), old.to_string()).expect("written");
    none("old.json --power panel=2");
}

/// Runs of a sweep of powers have them as runs of their own do. The test compares values and does not
/// depend on chance.
#[test]
fn sweeps_of_powers_say_on_which_inputs_they_depend() {
    let without = |scene: &mut Value| {
        scene
            .as_object_mut()
            .expect("a scene")
            .retain(|key, _| !["sums", "ratios"].contains(&&**key));
        scene["settings"] = json!({ "estimator": "photons", "photons": 5000, "guiding": "off" });
    };
    let scene = usual().edited(without).write();
    let sweep = json!({ "scene": "scene.json",
                        "vary": { "p": { "at": ["/lights/0/power"], "values": [PANEL, 10] } } });
    std::fs::write(scene.path("sweep.json"), sweep.to_string()).expect("written");
    for line in ["sweep sweep.json -o runs", "run scene.json -o own.json"] {
        let output = phylux(&scene.path(""), &line.split(' ').collect::<Vec<_>>());
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    }
    let read = |path: &std::path::Path| -> Value {
        serde_json::from_str(&std::fs::read_to_string(path).expect("results")).expect("JSON")
    };
    let own = read(&scene.path("own.json"));
    let files = std::fs::read_dir(scene.path("runs/runs")).expect("a folder");
    let runs: Vec<Value> = files.map(|file| read(&file.expect("a file").path())).collect();
    assert_eq!(runs.len(), 2);
    for key in ["sensitivity", "budget"] {
        assert!(runs.iter().all(|run| run[key].as_array().is_some_and(|rows| rows.len() > 20)));
        assert!(runs.iter().any(|run| run[key] == own[key]), "{key}");
    }
}
