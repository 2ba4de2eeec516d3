//! A property test of scenes gone wrong: sound scenes whose numbers, keys and values are changed.
//! Whatever the change, there is an error with its place, or a run whose energies add up.

use std::{
    sync::LazyLock,
    time::{Duration, Instant},
};

use proptest::{
    collection::vec,
    prelude::*,
    sample::{Index, select},
};
use serde_json::{Value, json};

use super::parse;
use phylux_core::transport::{
    settings::{NearestCount, PhotonCount, Settings, ThreadCount},
    simulate::{Control, simulate},
};
use phylux_results::result::RunResult;
use phylux_testing::spoiled;

/// The files that the scenes name.
const FILES: [(&str, &str); 7] = [
    (
        "room.obj",
        "mtllib room.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\n\
         g floor\nusemtl matt\nf 1 2 3 4\ng ceiling\nusemtl glow\nf 8 7 6 5\ng walls\n\
         usemtl shiny\nf 1 5 6 2\nusemtl mirror\nf 2 6 7 3\nusemtl water\nf 3 7 8 4\n\
         usemtl leafy\nf 4 8 5 1\n",
    ),
    (
        "room.mtl",
        "newmtl matt\nillum 1\nKd 0.5 0.5 0.5\nnewmtl glow\nKd 0.1 0.1 0.1\nKe 1 2 3\n\
         newmtl shiny\nillum 2\nKd 0.3 0.3 0.3\nKs 0.5 0.5 0.5\nNs 10\nnewmtl mirror\nillum 5\n\
         Ks 0.9 0.9 0.9\nnewmtl water\nillum 7\nNi 1.33\nnewmtl leafy\nillum 6\nKd 0.1 0.4 0.1\n\
         Tf 0.1 0.3 0.1\n",
    ),
    (
        "leaf.obj",
        "v 0 0 0\nv 0.2 0 0.1\nv 0.2 0.2 0\nv 0 0.2 0.1\nf 1 2 3\nf 1 3 4\ng tip\nf 2 3 4\n",
    ),
    ("grid.csv", "x,y,z,radius,nx,ny,nz\n0.5,0.5,0.2,0.1,0,0,1\n0.5,0.5,0,0.2,0,0,-1\n"),
    (
        "room.rad",
        "void plastic paint 0 0 5 .5 .5 .5 .1 0\nvoid trans panel 0 0 7 .5 .5 .5 .1 0 .5 0\nvoid light lum 0 0 3 1 1 1\n\
         paint polygon floor 0 0 12 0 0 0 1 0 0 1 1 0 0 1 0\npanel ring sheet 0 0 8 .5 .5 .5 0 0 1 0 .4\n\
         lum cylinder tube 0 0 7 .2 .2 .8 .8 .2 .8 .01\nlum polygon lamp 0 0 9 0 0 .9 1 1 .9 1 0 .9\n",
    ),
    (
        "table.csv",
        "theta_i,phi_i,theta_o,phi_o,all\n20,0,20,0,0.1\n20,0,20,180,0.1\n20,0,120,0,0.1\n20,0,120,180,0.1\n\
         20,180,20,0,0.2\n20,180,20,180,0.1\n20,180,120,0,0.1\n20,180,120,180,0.2\n",
    ),
    (
        "table.xml",
        "<a><AngleBasis><AngleBasisName>b</AngleBasisName><AngleBasisBlock><nPhis>1</nPhis><UpperTheta>90</UpperTheta>\
         </AngleBasisBlock></AngleBasis><WavelengthDataBlock><WavelengthDataDirection>Transmission Front\
         </WavelengthDataDirection><ColumnAngleBasis>b</ColumnAngleBasis><RowAngleBasis>b</RowAngleBasis><ScatteringData>0.2,\
         </ScatteringData></WavelengthDataBlock></a>",
    ),
];

#[rustfmt::skip]
const SCENES: &[&str] = &[
    r#"{"objects": [{"name": "room", "obj": "room.obj", "captor": "triangle"}],
        "lights": [{"type": "point", "position": [0.5, 0.5, 0.5], "power": 1}],
        "captors": [{"csv": "grid.csv", "sides": "both", "group": "g", "ignore": ["note"], "response": [[0, 1], [80, 0.5]]},
            {"name": "ball", "sphere": {"center": [0.5, 0.5, 0.5], "radius": 0.1}},
            {"name": "rows", "grid": {"x": [0.1, 0.9], "y": [0.2, 0.8], "nx": 2, "ny": 3, "z": 0.3, "radius": 0.02, "normal": [0, 1, 1]}},
            {"name": "bar", "line": {"from": [0.1, 0.1, 0.4], "to": [0.9, 0.1, 0.4], "width": 0.01, "normal": [0, 0, 1]}}],
        "groups": {"low": "rows/*-0", "ends": ["bar", "rows/*-2", "ball"]},
        "camera": {"position": [0.5, 0, 0.5], "look_at": [0.5, 1, 0.5], "fov_deg": 90, "width": 4, "height": 4},
        "settings": {"photons": 1e2, "seed": 1, "k": 5, "map_photons": 1000, "threads": 1}}"#,
    r#"{"name": "b", "unit": "cm", "quantity": "umol/s",
        "bands": [{"name": "a", "from_nm": 400, "to_nm": 500}, {"name": "b", "from_nm": 500, "to_nm": 800}],
        "sums": {"PAR": ["a", "b"], "lux": "photopic", "y": {"weighting": "YPF", "bands": ["b"]}, "w": {"a": 0.5, "b": 2},
            "r": {"from_nm": 600, "to_nm": 700}},
        "ratios": {"p": "PSS", "q": {"numerator": "lux", "denominator": {"a": 1}}, "s": "R:FR"},
        "materials": {
            "leaf": {"type": "leaf", "ior": 1.4, "reflectance": [0.1, 0.4], "transmittance": 0.05, "back": {"reflectance": 0.2}},
            "solid": {"type": "leaf", "thin": false, "ior": 1.2, "tint": [0.5, 1]},
            "gloss": {"type": "phong", "reflectance": 0.2, "specular": [0.5, 0], "exponent": 3, "transmittance": 0.1},
            "wall": {"type": "lambert", "reflectance": [0.75, 0.70]}},
        "objects": [
            {"name": "p", "obj": "leaf.obj", "material": "leaf", "captor": true, "group": "g",
             "transform": {"scale": 2, "rotate_deg": [10, 20, 30], "translate": [1, 2, 3]},
             "instances": [{"translate": [0, 0, 0.8]}, {"scale": 0.5, "rotate_deg": [0, 0, 40]}]},
            {"obj": "leaf.obj", "material": "solid", "up": "y"},
            {"name": "q", "obj": "leaf.obj", "material": "gloss"}],
        "lights": [
            {"type": "spot", "position": [0, 0, 2], "direction": [0, 0, -1], "half_angle_deg": 30, "power": [40, 5]},
            {"type": "tube", "name": "row", "from": [0, 0, 2], "to": [1.2, 0, 2], "radius": 0.013, "power": 36, "material": "wall"}],
        "captors": [{"name": "port", "obj": "leaf.obj"}]}"#,
    r#"{"materials": {
            "glass": {"type": "transparent", "ior": 1.5, "tint": 0.9},
            "pane": {"type": "transparent", "ior": 1.5, "thin": true},
            "mirror": {"type": "mirror", "reflectance": 0.95}, "glint": {"type": "phong", "specular": 0.7},
            "wall": {"type": "lambert", "reflectance": 0.9}},
        "objects": [{"name": "a", "obj": "room.obj", "material": "glass", "captor": true},
            {"name": "b", "obj": "leaf.obj", "material": "pane", "captor": "triangle"},
            {"name": "c", "obj": "room.obj", "material": "mirror", "transform": {"scale": 3, "translate": [-1, -1, -1]}},
            {"name": "d", "obj": "leaf.obj", "material": "glint"}],
        "lights": [
            {"type": "area", "vertices": [[0,0,2],[1,0,2],[1,1,2],[0.4,0.4,2],[0,1,2]], "radiance": 50, "two_sided": true},
            {"type": "area", "obj": "leaf.obj", "power": 5, "material": "wall", "transform": {"scale": 0.5}},
            {"type": "tube", "from": [0, 0, 0.1], "to": [0.2, 0.1, 0.3], "radius": 0, "power": 36, "emission": "isotropic"}],
        "captors": [{"name": "probe", "disc": {"center": [1, 1, 1], "normal": [0, 0, 1], "radius": 0.1}, "sides": "both"}]}"#,
    r#"{"materials": {
            "film": {"type": "table", "angles_deg": [0, 40, 60], "direct": [0.5, 0.4, 0.2], "diffuse": [[0.3], 0.3, 0.3],
                "reflectance": [0.1, 0.1, 0.2]},
            "weave": {"type": "table", "file": "table.csv", "reciprocal": true},
            "blind": {"type": "table", "file": "table.xml"}},
        "objects": [{"name": "a", "obj": "room.obj", "material": "film", "captor": true},
            {"name": "b", "obj": "leaf.obj", "material": "weave", "captor": "triangle", "transform": {"rotate_deg": [0, 90, 0]}},
            {"name": "c", "obj": "leaf.obj", "material": "blind", "instances": [{"translate": [0, 0, 0.5]}]}],
        "lights": [{"type": "area", "obj": "leaf.obj", "power": 5, "material": "weave", "transform": {"translate": [0, 0, 0.4]}}],
        "captors": [{"name": "probe", "disc": {"center": [0.5, 0.5, 0.5], "normal": [0, 0, 1], "radius": 0.1}, "sides": "both"}]}"#,
    r#"{"objects": [{"name": "room", "rad": "room.rad", "dialect": "sec2", "captor": true, "up": "y",
            "transform": {"scale": 2}, "instances": [{"translate": [0, 0, 0]}, {"translate": [3, 0, 0]}]}],
        "lights": [{"type": "rad", "object": "room", "material": "lum", "power": 5}],
        "captors": [{"name": "probe", "disc": {"center": [1, 1, 1], "normal": [0, 0, 1], "radius": 0.1}, "sides": "both"}]}"#,
];

const WORDS: &[&str] =
    &["{", "}", "[", "]", ":", "null", "true", "\"type\"", "\"power\"", "1e-300"];

/// The bytes of a scene, which a failure of the test shows as text.
struct Text(Vec<u8>);

impl std::fmt::Debug for Text {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        f.write_str(&String::from_utf8_lossy(&self.0))
    }
}

/// Generates values that may stand in the place of any value of a scene.
fn odd_value() -> impl Strategy<Value = Value> {
    let numbers: &[f64] = &[
        0.0,
        -0.0,
        1.0,
        -1.0,
        0.5,
        2.0,
        3.0,
        1e-3,
        1e3,
        1e6,
        1e-6,
        1e9,
        1e-9,
        1e12,
        1e-12,
        1e15,
        1e30,
        1e38,
        1e39,
        1e-30,
        1e-38,
        1e-45,
        1e100,
        1e-100,
        1e300,
        1e308,
        -1e308,
        1e-308,
        5e-324,
        180.0,
        179.999,
        90.0,
        0.999_999_9,
        1.000_000_1,
        1e7,
        4_294_967_296.0,
    ];
    let others = vec![
        Value::Null,
        json!(true),
        json!(false),
        json!(""),
        json!("a"),
        json!("wall"),
        json!("both"),
        json!("leaf.obj"),
        json!("room.obj"),
        json!("grid.csv"),
        json!("."),
        json!([]),
        json!({}),
        json!([0, 0, 0]),
        json!([1, 2]),
        json!([[0, 0, 0], [1, 0, 0], [0, 1, 0]]),
        json!("triangle"),
        json!({"scale": 1e-20}),
        json!({"translate": [1e7, 0, 0]}),
        json!(u64::MAX),
        json!(i64::MIN),
        json!("\n\u{1}"),
        json!("x".repeat(1000)),
        json!(-1),
        json!(1e2),
    ];
    prop_oneof![
        4 => select(numbers).prop_map(|x| json!(x)),
        1 => any::<f64>().prop_map(|x| json!(x)),
        1 => (-40..40i32).prop_map(|e| json!(10f64.powi(e))),
        2 => select(others),
    ]
}

/// Generates one of the scenes after up to five changes.
fn changed() -> impl Strategy<Value = Vec<u8>> {
    let change = (0..10u8, any::<Index>(), any::<Index>(), odd_value());
    (select(SCENES), vec(change, 0..6)).prop_map(|(scene, changes)| {
        let mut value: Value = serde_json::from_str(scene).expect("JSON");
        for (kind, here, there, new) in changes {
            change_value(&mut value, kind, here, there, new);
        }
        value.to_string().into_bytes()
    })
}

fn pointers(value: &Value, at: String, found: &mut Vec<String>) {
    match value {
        Value::Array(values) => {
            values.iter().enumerate().for_each(|(i, v)| pointers(v, format!("{at}/{i}"), found));
        }
        Value::Object(map) => {
            for (key, v) in map {
                pointers(v, format!("{at}/{}", crate::json::escaped(key)), found);
            }
        }
        _ => {}
    }
    if !at.is_empty() {
        found.push(at);
    }
}

fn change_value(value: &mut Value, kind: u8, here: Index, there: Index, new: Value) {
    let mut all = Vec::new();
    pointers(value, String::new(), &mut all);
    if all.is_empty() {
        return;
    }
    let at = all[here.index(all.len())].clone();
    let other = all[there.index(all.len())].clone();
    let copy = value.pointer(&other).cloned();
    let parent = value.pointer_mut(at.rsplit_once('/').expect("a slash").0);
    let last = at.rsplit('/').next().expect("a slash").to_string();
    match (kind, parent) {
        (0, Some(Value::Object(map))) => drop(map.remove(&last)),
        (0, Some(Value::Array(list))) => drop(list.remove(last.parse().expect("an index"))),
        (1, Some(Value::Object(map))) => {
            if let (Some(v), Value::String(key)) = (map.remove(&last), &new) {
                map.insert(key.clone(), v);
            }
        }
        (2, Some(Value::Array(list))) => {
            let copy = list[last.parse::<usize>().expect("an index")].clone();
            list.extend(std::iter::repeat_n(copy, 1 + there.index(20)));
        }
        (3, _) => {
            if let (Some(target), Some(copy)) = (value.pointer_mut(&at), copy) {
                *target = copy;
            }
        }
        // multiplies a number by some power of ten
        (4 | 5, _) => {
            if let Some(target) = value.pointer_mut(&at)
                && let Some(x) = target.as_f64()
            {
                *target = json!(x * 10f64.powi(there.index(60) as i32 - 30));
            }
        }
        _ => *value.pointer_mut(&at).expect("it was found there") = new,
    }
}

/// A folder with the files that the scenes name. The scene itself is in no file: it is handed over
/// as bytes.
static FOLDER: LazyLock<tempfile::TempDir> = LazyLock::new(|| {
    let folder = tempfile::tempdir().expect("a temporary folder");
    for (name, content) in FILES {
        std::fs::write(folder.path().join(name), content).expect("a file");
    }
    folder
});

/// Checks what holds of every text, be it a scene or not: the error is one line with its place, or
/// the run adds up.
fn check(bytes: &[u8]) {
    let started = Instant::now();
    let path = FOLDER.path().join("scene.json");
    match parse(bytes, &path) {
        Err(error) => {
            let sentence = error.to_string();
            assert!(sentence.starts_with(FOLDER.path().to_str().expect("UTF-8")), "{sentence}");
            assert!(!sentence.contains(char::is_control), "{sentence:?}");
            assert!(sentence.len() < 3000, "{sentence}");
        }
        Ok(loaded) => {
            let settings = Settings {
                photons: PhotonCount::new(100).ok(),
                k: NearestCount::new(5).ok(),
                threads: ThreadCount::ONE,
                tolerance: None,
                max_time: None,
                ..loaded.settings
            };
            let control = Control::default();
            if let Ok(simulation) = simulate(&loaded.scene, &settings, &control) {
                check_result(&RunResult::new(&simulation));
            }
        }
    }
    // some thousand times what a slow and busy machine takes
    assert!(started.elapsed() < Duration::from_secs(900), "{:?}", started.elapsed());
}

fn check_result(result: &RunResult) {
    let energy = &result.energy;
    for b in 0..result.bands.len() {
        let (power, emitted) = (energy.power[b], energy.emitted[b]);
        let chance = energy.chance.as_ref().map_or(0.0, |chance| chance[b]);
        let rest = energy.absorbed[b] + energy.escaped[b] + energy.lost[b] + chance;
        assert!((power - emitted).abs() <= 1e-9 * power, "{power} emitted as {emitted}");
        assert!((emitted - rest).abs() <= 1e-9 * power, "{emitted} ends as {rest}");
    }
    check_finite(&serde_json::to_value(result).expect("JSON"), "");
}

/// Checks that all numbers are finite: JSON writes others as null, which is allowed for some keys
/// alone.
fn check_finite(value: &Value, key: &str) {
    match value {
        Value::Null => assert!(
            key.ends_with("_se")
                || ["knn", "radiance", "min_over_mean", "cv", "ratio"].contains(&key),
            "{key}"
        ),
        Value::Array(values) if key == "radiance" => {
            values.iter().for_each(|v| check_finite(v, "radiance of a band"));
        }
        Value::Array(values) => values.iter().for_each(|v| check_finite(v, key)),
        Value::Object(map) => map.iter().for_each(|(key, v)| check_finite(v, key)),
        _ => {}
    }
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn no_changed_scene_panics(text in changed().prop_map(Text)) {
        check(&text.0);
    }

    #[test]
    fn no_spoiled_scene_panics(text in spoiled(SCENES, WORDS).prop_map(Text)) {
        check(&text.0);
    }
}
