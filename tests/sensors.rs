//! Sensors as instruments have them: spheres, grids, strips and responses by angle; groups by
//! pattern and their uniformity; a tolerance for selected values only.

use std::f64::consts::PI;

use phylux::RunResult;
use phylux::transport::PhotonCount;
use serde_json::{Value, json};

use crate::{
    bad_input::{bad_scene, phylux},
    common::{TestScene, front, run_file},
};

fn scene(value: &Value, files: &[(&str, &str)]) -> TestScene {
    TestScene::new(&value.to_string(), files)
}

/// Runs the scene by photons and by paths (seed 3, this number of each).
fn both(scene: &TestScene, histories: u64) -> [RunResult; 2] {
    [scene.run(histories, 3), scene.run_paths(histories, 3)]
}

/// Asserts that an irradiance is within 4.5 standard errors of `expected` (odds of a false alarm
/// 7e-6), and that the standard error is at most the fraction `most` of it.
fn check(result: &RunResult, id: &str, expected: f64, most: f64) {
    let face = front(result, id);
    let (value, error) = (face.irradiance[0], face.irradiance_se[0].expect("an error"));
    assert!(error <= most * expected, "{id}: {value} ± {error}");
    assert!(
        (value - expected).abs() < 4.5 * error + 1e-6 * expected,
        "{id}: {value} ± {error}, not {expected}"
    );
}

/// A spherical captor measures the fluence rate. Beside a point light it is P Ω / 4π / (π r²), in
/// the sun's beam the normal irradiance, and under a uniform sky twice the horizontal irradiance.
///
/// Seed 3, 1e5 photons or paths; standard errors at most 2 % of the exact value, odds of a false
/// alarm 7e-6 for each value.
#[test]
fn a_sphere_shows_the_fluence_rate() {
    let ball = |center: [f64; 3], radius: f64| json!([{ "name": "ball", "sphere": { "center": center, "radius": radius } }]);
    let point = json!({ "lights": [{ "type": "point", "position": [0, 0, 0], "power": 100 }],
        "captors": ball([0.3, 0.4, 1.2], 0.5) });
    let (r, d) = (0.5, 1.3f64);
    let solid_angle = 2.0 * PI * (1.0 - (1.0 - r * r / (d * d)).sqrt());
    let expected = 100.0 * solid_angle / (4.0 * PI) / (PI * r * r);
    for result in both(&scene(&point, &[]), 100_000) {
        assert!((result.captors[0].area - PI * r * r).abs() < 1e-9);
        check(&result, "ball", expected, 0.02);
    }
    for (light, expected) in [
        (json!({ "type": "sun", "irradiance": 100 }), 100.0),
        (json!({ "type": "sky", "model": "uniform", "irradiance": 100 }), 200.0),
    ] {
        let mut open = json!({ "lights": [light], "captors": ball([0.0, 0.0, 0.0], 0.2) });
        if expected == 100.0 {
            open["sun_at"] = json!({ "elevation_deg": 30, "azimuth_deg": 120 });
        }
        for result in both(&scene(&open, &[]), 100_000) {
            check(&result, "ball", expected, 0.02);
        }
    }
}

/// A response of 1 at all angles changes no byte of a value. A response to light of a single angle
/// multiplies the reading by the factor at that angle. Under a uniform sky, a response that ends at
/// 45 degrees halves the reading.
///
/// Seed 3; under the sky 1e5 photons or paths, standard error at most 2 %, odds of a false alarm
/// 7e-6 for each value.
#[test]
fn a_response_weighs_arrivals_by_their_angle() {
    let with = |response: Option<Value>, light: Value| {
        let mut sensor = json!({ "name": "s", "disc": { "center": [1, 0, 0], "normal": [0, 0, 1], "radius": 0.05 } });
        if let Some(response) = response {
            sensor["response"] = response;
        }
        scene(&json!({ "lights": [light], "captors": [sensor] }), &[])
    };
    // the lamp is seen at 45 degrees
    let lamp = || json!({ "type": "point", "position": [0, 0, 1], "power": 100 });
    let plain = both(&with(None, lamp()), 200_000);
    let ones = both(&with(Some(json!([[0, 1], [90, 1]])), lamp()), 200_000);
    let cut = both(&with(Some(json!([[30, 1], [60, 0.5]])), lamp()), 200_000);
    for ((plain, ones), cut) in plain.iter().zip(&ones).zip(&cut) {
        let value = |result: &RunResult| front(result, "s").flux[0];
        assert_eq!(value(plain), value(ones));
        assert!((value(cut) / value(plain) - 0.75).abs() < 0.01);
    }
    // of uniform light, the fraction within an angle a of the normal is sin² a: here the response
    // ends there
    let sky = json!({ "type": "sky", "model": "uniform", "irradiance": 100 });
    let ends = json!([[0, 1], [45, 1], [45.001, 0]]);
    for result in both(&with(Some(ends), sky), 100_000) {
        check(&result, "s", 50.0, 0.02);
    }
}

/// A grid has discs in the middles of its cells, a strip has its front on the side of its normal,
/// and a table of captors may have a column that is ignored.
#[test]
fn grids_strips_and_tables_with_more_columns() {
    let text = json!({ "unit": "cm", "lights": [{ "type": "point", "position": [0, 0, 100], "power": 100 }],
    "captors": [
        { "name": "g", "grid": { "x": [0, 40], "y": [-10, 20], "nx": 2, "ny": 3, "z": 50, "radius": 2 } },
        { "name": "l", "line": { "from": [0, 0, 10], "to": [100, 0, 10], "width": 2, "normal": [1, 0, 1] } },
        { "name": "t", "csv": "t.csv", "ignore": ["Orientation"] }
    ] });
    let table = "id,Orientation,x,y,z,radius,nx,ny,nz\na,up,0,0,0,1,0,0,1\n";
    let loaded =
        phylux::load(&scene(&text, &[("t.csv", table)]).path("scene.json")).expect("a scene");
    let captors = loaded.scene.captors();
    let ids: Vec<&str> = captors.iter().map(|captor| captor.id.as_str()).collect();
    assert_eq!(ids, ["g/0-0", "g/1-0", "g/0-1", "g/1-1", "g/0-2", "g/1-2", "l", "t/a"]);
    let at = |id: &str| captors.iter().find(|captor| captor.id == id).expect("a captor");
    assert!((at("g/1-2").center - glam(0.3, 0.15, 0.5)).length() < 1e-12);
    assert!((at("g/1-2").normal - glam(0.0, 0.0, 1.0)).length() < 1e-12);
    let line = at("l");
    assert!(
        (line.area - 0.02).abs() < 1e-12 && (line.center - glam(0.5, 0.0, 0.1)).length() < 1e-12
    );
    assert!((line.normal - glam(0.0, 0.0, 1.0)).length() < 1e-12);
}

/// Returns a vector of the type that captors have.
fn glam(x: f64, y: f64, z: f64) -> glam::DVec3 {
    glam::DVec3::new(x, y, z)
}

/// Returns a scene with twelve sensors on a line beside a lamp, and groups of them.
fn rows() -> Value {
    json!({ "bands": [{ "name": "a" }, { "name": "b" }],
        "lights": [{ "type": "point", "position": [0, 0, 1], "power": [100, 1] }],
        "captors": [{ "name": "s", "grid": { "x": [0, 3], "y": [0, 0.2], "nx": 12, "ny": 1, "z": 0, "radius": 0.1 } }],
        "groups": { "near": ["s/0-*", "s/1-*", "*/1-0"], "far": "s/1*-0" } })
}

/// A group by pattern contains each captor once, has the mean of its captors, and reports its
/// uniformity.
#[test]
fn groups_by_pattern_and_how_even_they_are() {
    let result = scene(&rows(), &[]).run(400_000, 1);
    let group = |id: &str| result.groups.iter().find(|group| group.id == id).expect("a group");
    // the captors s/1-0, s/10-0 and s/11-0
    assert_eq!((group("near").captors, group("far").captors, group("s").captors), (2, 3, 12));
    let values: Vec<f64> =
        ["s/1-0", "s/10-0", "s/11-0"].iter().map(|id| front(&result, id).irradiance[0]).collect();
    let mean = values.iter().sum::<f64>() / 3.0;
    let face = &group("far").front;
    assert!((face.irradiance[0] / mean - 1.0).abs() < 1e-9);
    let even = face.uniformity.as_ref().expect("several");
    let least = values.iter().copied().fold(f64::INFINITY, f64::min);
    assert!((even.min_over_mean[0].expect("light") - least / mean).abs() < 1e-9);
    let variance = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / 3.0;
    assert!((even.cv[0].expect("light") - variance.sqrt() / mean).abs() < 1e-9);
    for errors in [&even.min_over_mean_se, &even.cv_se] {
        assert!((0.0001..0.5).contains(&errors[0].expect("an error")));
    }
}

/// The standard errors of uniformities are honest. For each uniformity, the deviation from the
/// truth is divided by its reported standard error, and the root mean square is taken over seeds 1
/// to 30 with 20,000 photons each. One group is a row of sensors whose light falls off to a sixth;
/// the other is a ring of sensors that receive the same, where all variation is noise. The root
/// mean square must be between 0.6 and 1.5. For normal deviations it is outside with odds of 4e-4;
/// the seeds are fixed.
#[test]
fn errors_of_uniformity_are_honest() {
    let disc = |name: String, x: f64, y: f64| json!({ "name": name, "disc": { "center": [x, y, 0], "normal": [0, 0, 1], "radius": 0.1 } });
    let row = (0..6).map(|i| disc(format!("row{i}"), 0.25 * f64::from(i), 0.0));
    let ring = (0..12).map(|i| {
        let (y, x) = (PI / 6.0 * f64::from(i)).sin_cos();
        disc(format!("ring{i}"), 0.7 * x, 0.7 * y)
    });
    let scene = scene(
        &json!({ "lights": [{ "type": "spot", "position": [0, 0, 1], "direction": [0, 0, -1], "half_angle_deg": 80, "power": 100 }],
            "captors": row.chain(ring).collect::<Vec<_>>(), "groups": { "row": "row*", "ring": "ring*" } }),
        &[],
    );
    // the mean over a disc of E = I h / (r² + h²)^1.5, by the midpoint rule
    let truth = |x: f64| {
        let n = 50;
        let at = |i: usize, j: usize| {
            let (r, a) =
                (0.1 * ((i as f64 + 0.5) / n as f64).sqrt(), 2.0 * PI * j as f64 / n as f64);
            (1.0 + (x + r * a.cos()).powi(2) + (r * a.sin()).powi(2)).powf(-1.5)
        };
        (0..n * n).map(|k| at(k / n, k % n)).sum::<f64>() / (n * n) as f64
    };
    let row: Vec<f64> = (0..6).map(|i| truth(0.25 * f64::from(i))).collect();
    let mean = row.iter().sum::<f64>() / 6.0;
    let variance = row.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / 6.0;
    let exact = [[row[5] / mean, variance.sqrt() / mean], [1.0, 0.0]];
    let mut squares = [[0.0; 2]; 2];
    for seed in 1..=30 {
        let result = scene.run(20_000, seed);
        for ((id, exact), squares) in ["row", "ring"].into_iter().zip(exact).zip(&mut squares) {
            let group = result.groups.iter().find(|group| group.id == id).expect("a group");
            let even = group.front.uniformity.as_ref().expect("several");
            let found = [(&even.min_over_mean, &even.min_over_mean_se), (&even.cv, &even.cv_se)];
            for (((value, error), exact), squares) in found.into_iter().zip(exact).zip(squares) {
                let deviation = (value[0].expect("light") - exact) / error[0].expect("an error");
                *squares += deviation.powi(2) / 30.0;
            }
        }
    }
    for deviation in squares.iter().flatten().map(|square| square.sqrt()) {
        assert!((0.6..1.5).contains(&deviation), "{squares:?}");
    }
}

/// The uniformity of many groups in many bands is shown of the sum alone, unless all is asked for.
#[test]
fn many_uniformities_are_those_of_the_sum() {
    let bands: Vec<Value> = (0..6).map(|i| json!({ "name": format!("b{i}") })).collect();
    let grid = |i: i32| json!({ "name": format!("bed{i}"), "grid": { "x": [0, 1], "y": [i, i], "nx": 2, "ny": 1, "z": 0, "radius": 0.1 } });
    let scene = json!({ "bands": bands, "sums": { "all": ["b0", "b1", "b2", "b3", "b4", "b5"] },
        "lights": [{ "type": "point", "position": [0, 0, 1], "power": [1, 1, 1, 1, 1, 1] }],
        "captors": (0..4).map(grid).collect::<Vec<Value>>() });
    let scene = self::scene(&scene, &[]);
    let rows = |line: &str| {
        let done = command(&scene, line);
        assert_eq!(done.0, Some(0), "{}", done.2);
        let (_, table) = done.1.split_once("uniformity of groups").expect("its table");
        let own = table.lines().skip(1).take_while(|line| line.starts_with("  bed"));
        (own.map(String::from).collect::<Vec<_>>(), table.contains("(--full has all)"))
    };
    let (short, said) = rows("run scene.json --photons 1e4");
    assert!(said && short.len() == 4 && short.iter().all(|row| row.contains(" all ")), "{short:?}");
    let (full, said) = rows("run scene.json --photons 1e4 --full");
    assert!(!said && full.len() == 28, "{full:?}");
}

/// The summary, the table of a run and the tables of a sweep contain the uniformity of groups.
#[test]
fn tables_say_how_even_groups_are() {
    let sweep = json!({ "scene": "scene.json", "vary": { "/lights/0/position/2": [1, 2] } });
    let scene = scene(&rows(), &[("sweep.json", &sweep.to_string())]);
    let done = command(&scene, "run scene.json --photons 1e5 --csv r.csv");
    assert_eq!(done.0, Some(0), "{}", done.2);
    assert!(done.1.contains("uniformity of groups") && done.1.contains("min / mean"), "{}", done.1);
    let result = phylux::formats::read_json(&scene.path("results.json")).expect("results");
    let even =
        result.groups.iter().find(|g| g.id == "far").and_then(|g| g.front.uniformity.clone());
    let even = even.expect("several");
    let table = std::fs::read_to_string(scene.path("r.csv")).expect("a table");
    for (quantity, value, error) in [
        ("min_over_mean", &even.min_over_mean, &even.min_over_mean_se),
        ("cv", &even.cv, &even.cv_se),
    ] {
        let (value, error) = (value[1].expect("light"), error[1].expect("an error"));
        let row = format!("far,front,b,{quantity},{value},{error},,,,0.09");
        assert!(table.lines().any(|line| line.starts_with(&row)), "{row}\n{table}");
    }
    let done = command(&scene, "sweep sweep.json --photons 1e5 -o swept");
    assert_eq!(done.0, Some(0), "{}", done.2);
    let table = std::fs::read_to_string(scene.path("swept/groups.csv")).expect("a table");
    let header: Vec<&str> = table.lines().next().expect("a header").split(',').collect();
    for name in ["min_over_mean", "min_over_mean_se", "cv", "cv_se"] {
        let column = header.iter().position(|column| *column == name).expect(name);
        let cells = table.lines().skip(1).map(|line| line.split(',').nth(column));
        assert!(
            cells.clone().count() == 12 && cells.flatten().all(|cell| !cell.is_empty()),
            "{table}"
        );
    }
}

fn command(scene: &TestScene, arguments: &str) -> (Option<i32>, String, String) {
    let arguments: Vec<&str> = arguments.split(' ').collect();
    let output = phylux(&scene.path(""), &arguments);
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (output.status.code(), text(&output.stdout), text(&output.stderr))
}

/// A run to a tolerance for selected values ends sooner than one for all values, and reports which
/// of the selected ones was farthest from it.
#[test]
fn a_tolerance_of_what_matters() {
    let scene = scene(&rows(), &[]);
    let run = |arguments: &str| {
        let done = command(
            &scene,
            &format!(
                "run scene.json --k 0 --estimator photons --guiding off --tolerance 0.015 -o r.json {arguments}"
            ),
        );
        assert_eq!(done.0, Some(0), "{}", done.2);
        phylux::formats::read_json(&scene.path("r.json")).expect("results")
    };
    let worst = |result: &RunResult| {
        result
            .account
            .tolerance
            .as_ref()
            .and_then(|t| t.worst.as_ref())
            .expect("a worst value")
            .captor
            .clone()
    };
    let (near, far) = (run("--of near"), run("--of far:irradiance:b --of s"));
    assert_eq!((worst(&near).as_str(), worst(&far).as_str()), ("near", "far"));
    assert!(near.photons < far.photons);
    let error = |result: &RunResult, group: &str| {
        let face = &result.groups.iter().find(|g| g.id == group).expect("a group").front;
        face.irradiance_se[1].expect("an error") / face.irradiance[1]
    };
    assert!(error(&near, "near") <= 0.015 && error(&far, "far") <= 0.015);
    for (of, sentence) in [
        ("--of x*", "--of: no captor and no group like `x*` counts this quantity"),
        ("--of s*:absorbed", "--of: no captor and no group like `s*` counts this quantity"),
        ("--of s*:irradiance:c", "--of: no band `c`; there are a, b"),
    ] {
        let refused = command(&scene, &format!("run scene.json --tolerance 0.1 {of}"));
        assert_eq!(refused.0, Some(2), "{}", refused.2);
        assert!(refused.2.contains(sentence), "{}", refused.2);
    }
    let refused = command(&scene, "run scene.json --of s*");
    assert!(
        refused.2.contains("--of: no tolerance is asked for; add --tolerance"),
        "{}",
        refused.2
    );
}

/// Every wrong sensor and group is refused with a message that says what is wrong.
#[test]
fn bad_sensors_and_groups_are_refused() {
    let sphere = json!({ "name": "b", "sphere": { "center": [0, 0, 0], "radius": 1 } });
    let changed = |key: &str, value: Value| {
        let mut captor = sphere.clone();
        captor[key] = value;
        captor
    };
    let grid = |nx: u64, radius: f64| json!({ "name": "g", "grid": { "x": [0, 1], "y": [0, 1], "nx": nx, "ny": 1, "z": 0, "radius": radius } });
    let line = |to: [f64; 3], normal: [f64; 3]| json!({ "name": "l", "line": { "from": [0, 0, 0], "to": to, "width": 0.1, "normal": normal } });
    for (captor, groups, sentence) in [
        (
            changed("disc", json!({ "center": [0, 0, 0], "normal": [0, 0, 1], "radius": 1 })),
            json!({}),
            "/captors/0: must have exactly one of",
        ),
        (changed("ignore", json!(["a"])), json!({}), "/captors/0/ignore: there is no table"),
        (changed("response", json!([])), json!({}), "/captors/0/response: an empty list"),
        (
            changed("response", json!([[0, 1], [100, 1]])),
            json!({}),
            "/captors/0/response: angle: 100, must be from 0 to 90",
        ),
        (
            changed("response", json!([[10, 1], [5, 1]])),
            json!({}),
            "/captors/0/response: angles that do not rise",
        ),
        (
            changed("response", json!([[10, -1]])),
            json!({}),
            "/captors/0/response: factor: -1, must be",
        ),
        (
            json!({ "sphere": { "center": [0, 0, 0], "radius": 1 } }),
            json!({}),
            "/captors/0: a sphere without `name`",
        ),
        (grid(0, 0.1), json!({}), "/captors/0/grid/nx: 0 cells"),
        (grid(2, 0.0), json!({}), "/captors/0/grid/radius: 0, must be above 0"),
        (
            line([0.0; 3], [0.0, 0.0, 1.0]),
            json!({}),
            "/captors/0/line: `from` and `to` are the same",
        ),
        (
            line([1.0, 0.0, 0.0], [2.0, 0.0, 0.0]),
            json!({}),
            "/captors/0/line/normal: a normal of length 0, or along",
        ),
        (sphere.clone(), json!({ "n": "x*" }), "/groups/n: no captor has an id like `x*`"),
        (sphere.clone(), json!({ "n": [] }), "/groups/n: no pattern"),
        (sphere.clone(), json!({ "n": ["b", "c"] }), "/groups/n: no captor has an id like `c`"),
        (
            sphere.clone(),
            json!({ "b": "*" }),
            "/groups/b: an entry, an object or a `group` has this name",
        ),
        (sphere.clone(), json!({ "n": 3 }), "/groups/n: "),
    ] {
        let text = json!({ "lights": [{ "type": "point", "position": [0, 0, 3], "power": 1 }],
            "captors": [captor], "groups": groups });
        let error =
            phylux::load(&scene(&text, &[]).path("scene.json")).expect_err("bad").to_string();
        assert!(error.contains(sentence), "{error}\n{sentence}");
    }
}

/// A sensor whose `group` is the name of another entry joins that one's own group, which is said.
#[test]
fn a_group_that_merges_with_an_entry_is_said() {
    let captor = |name: &str, group: Value| json!({ "name": name, "group": group, "disc": { "center": [0, 0, 0], "normal": [0, 0, 1], "radius": 1 } });
    let warnings = |group: &str| {
        let text = json!({ "lights": [{ "type": "point", "position": [0, 0, 3], "power": 1 }],
            "captors": [captor("a", json!(group)), captor("b", Value::Null)] });
        phylux::load(&scene(&text, &[]).path("scene.json")).expect("a scene").warnings
    };
    let merged = warnings("b");
    let said = "/captors/0/group: an entry or object is named `b` too, and its group has these";
    assert!(merged.len() == 1 && merged[0].contains(said), "{merged:?}");
    assert!(warnings("a").is_empty() && warnings("c").is_empty());
}

/// `"up": "y"` turns (x, y, z) into (x, -z, y), before the transform is applied.
#[test]
fn a_file_whose_y_points_up_is_turned() {
    let text = json!({ "lights": [{ "type": "point", "position": [0, 0, 9], "power": 1 }],
        "materials": { "m": { "type": "lambert", "reflectance": 0 } },
        "objects": [{ "name": "o", "obj": "o.obj", "material": "m", "up": "y", "captor": true,
            "transform": { "translate": [0, 0, 1] } }] });
    let obj = "v 1 2 3\nv 2 2 3\nv 1 2 4\nf 1 2 3\n";
    let loaded =
        phylux::load(&scene(&text, &[("o.obj", obj)]).path("scene.json")).expect("a scene");
    let captor = &loaded.scene.captors()[0];
    let middle = |a: f64, b: f64, c: f64| (a + b + c) / 3.0;
    let expected = glam(middle(1.0, 2.0, 1.0), -middle(3.0, 3.0, 4.0), 3.0);
    assert!((captor.center - expected).length() < 1e-12, "{}", captor.center);
    // the normal (1, 0, 0) x (0, 0, 1) = (0, -1, 0) turns into (0, 0, -1)
    assert!((captor.normal - glam(0.0, 0.0, -1.0)).length() < 1e-12);
    let again = run_file(&scene(&text, &[("o.obj", obj)]).path("scene.json"), |s| {
        s.photons = PhotonCount::new(10).ok()
    });
    assert_eq!(again.captors.len(), 1);
}

/// A grid of more discs than a scene holds is refused before they are made.
#[test]
fn endless_grids_are_refused() {
    for (nx, ny) in [(1_000_000_000u64, 1_000_000_000u64), (1, 1 << 52), (1500, 1500)] {
        let scene = json!({
            "lights": [{ "type": "point", "position": [0, 0, 1], "power": 1 }],
            "captors": [{ "name": "a", "grid": {
                "x": [0, 1], "y": [0, 1], "nx": nx, "ny": ny, "z": 0, "radius": 0.01 } }]
        });
        let words = ["/captors/0/grid", &format!("{nx} x {ny} discs"), "at most 2000000"];
        bad_scene(&scene.to_string(), &[], &words);
    }
}
