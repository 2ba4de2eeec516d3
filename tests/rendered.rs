//! `phylux export`, and what it shares with `phylux view`: the files can be read by other programs,
//! hold the numbers of the results, and are the same each time; wrong input is refused.

use std::{collections::HashMap, fs, path::Path};

use base64::{Engine, engine::general_purpose::STANDARD};
use serde_json::Value;

use crate::{
    bad_input::{listing, phylux, refused},
    common::TestScene,
};

/// Returns a closed grey room of 1 m with a lamp of 3 and 5 W in its middle. The floor and a sensor
/// are captors.
pub fn scene() -> TestScene {
    let scene = r#"{
        "name": "room <b>1</b> & \"2\"",
        "bands": [{"name": "a"}, {"name": "b&<"}],
        "sums": {"both": ["a", "b&<"]},
        "materials": {"grey": {"type": "lambert", "reflectance": [0.5, 0.2]}},
        "objects": [
            {"name": "walls", "obj": "walls.obj", "material": "grey"},
            {"name": "floor", "obj": "floor.obj", "material": "grey", "captor": true}
        ],
        "lights": [{"name": "lamp", "type": "point", "position": [10.5, 0.5, 0.5], "power": [3, 5]}],
        "captors": [{"name": "sensor", "disc": {"center": [10.5, 0.5, 0.2], "normal": [0, 0, 1], "radius": 0.1}}],
        "settings": {"photons": 80000, "map_photons": 80000, "k": 20}
    }"#;
    let corners =
        "v 10 0 0\nv 11 0 0\nv 11 1 0\nv 10 1 0\nv 10 0 1\nv 11 0 1\nv 11 1 1\nv 10 1 1\n";
    let walls = format!("{corners}f 8 7 6 5\nf 1 5 6 2\nf 2 6 7 3\nf 3 7 8 4\nf 4 8 5 1\n");
    let floor = format!("{corners}f 1 2 3 4\n");
    TestScene::new(scene, &[("walls.obj", &walls), ("floor.obj", &floor)])
}

/// Asserts that the command succeeds.
pub fn done(folder: &Path, arguments: &[&str]) {
    let output = phylux(folder, arguments);
    assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
}

fn export(scene: &TestScene, name: &str, more: &[&str]) -> Vec<u8> {
    done(&scene.path(""), &[&["export", "scene.json", "-o", name], more].concat());
    fs::read(scene.path(name)).expect(name)
}

fn results(scene: &TestScene) -> Value {
    done(&scene.path(""), &["run", "scene.json", "-o", "results.json"]);
    serde_json::from_slice(&fs::read(scene.path("results.json")).expect("results")).expect("JSON")
}

/// Returns the arrays of a VTK file by name, as bytes, and its XML text.
fn vtk(file: Vec<u8>) -> (HashMap<String, Vec<u8>>, String) {
    let xml = String::from_utf8(file).expect("text");
    let arrays = xml.split("Array type=").skip(1).map(|array| {
        let (attributes, rest) = array.split_once('>').expect("an element");
        let (_, name) = attributes.split_once("Name=\"").expect("a name");
        let name = name.split('"').next().expect("its end").to_string();
        assert!(attributes.contains("format=\"binary\""), "{attributes}");
        let text = rest.split('<').next().expect("its end").trim();
        let bytes = STANDARD.decode(text).unwrap_or_else(|e| panic!("{name}: {e}"));
        let (size, data) = bytes.split_at(8);
        assert_eq!(u64::from_le_bytes(size.try_into().expect("8 bytes")), data.len() as u64);
        (name, data.to_vec())
    });
    (arrays.collect(), xml.clone())
}

fn floats(bytes: &[u8]) -> Vec<f32> {
    bytes.as_chunks::<4>().0.iter().map(|b| f32::from_le_bytes(*b)).collect()
}

/// The captor's numbers are those of a run. The mean of the light at places on the floor, times its
/// area, is the flux on it within 5 %: 300 photons give a standard error of 6 % at a place, and
/// some 30 independent places 1 % of the whole. The seed is fixed, so the outcome is too.
#[test]
fn vtk_files_hold_what_a_run_found() {
    let scene = scene();
    let results = results(&scene);
    let (arrays, xml) = vtk(export(&scene, "a.vtp", &[]));
    let captor = floats_of_i32(&arrays["captor"]);
    let floor = captor.iter().position(|c| *c == 0).expect("the floor");
    assert_eq!(results["captors"][0]["id"], "floor/floor");
    for (band, name) in ["a", "b&amp;&lt;", "both"].iter().enumerate() {
        let value = |array: &str| floats(&arrays[array])[floor];
        let front = &results["captors"][0]["front"];
        let same = |ours: f32, theirs: &Value| {
            let theirs = theirs.as_f64().expect("a number");
            assert!((f64::from(ours) - theirs).abs() <= 1e-6 * theirs, "{name}: {ours} {theirs}");
        };
        same(value(&format!("captor_irradiance_front_{name}")), &front["irradiance"][band]);
        same(value(&format!("captor_irradiance_front_{name}_se")), &front["irradiance_se"][band]);
        same(value(&format!("captor_absorbed_{name}")), &results["captors"][0]["absorbed"][band]);
        assert!(value(&format!("captor_irradiance_back_{name}_se")).is_nan(), "nothing arrived");
    }
    // all triangles of the floor have the same area, and their areas add up to 1 m2
    let local = floats(&arrays["irradiance_front_both"]);
    let on_floor: Vec<f32> =
        local.iter().zip(&captor).filter(|(_, c)| **c == 0).map(|(v, _)| *v).collect();
    let mean = on_floor.iter().sum::<f32>() / on_floor.len() as f32;
    let flux = results["captors"][0]["front"]["flux"][2].as_f64().expect("a number");
    assert!((f64::from(mean) / flux - 1.0).abs() < 0.05, "{mean} {flux}");

    let points: Vec<f64> =
        arrays["points"].as_chunks::<8>().0.iter().map(|b| f64::from_le_bytes(*b)).collect();
    let x = points.iter().step_by(3);
    assert!(x.clone().all(|x| (10.0..=11.0).contains(x)) && x.clone().any(|x| *x == 10.0));
    let cells = captor.len();
    assert_eq!(arrays["connectivity"].len(), 3 * 8 * cells);
    let last = arrays["offsets"].as_chunks::<8>().0.last().expect("cells");
    assert_eq!(u64::from_le_bytes(*last) as usize, 3 * cells);
    assert!(xml.contains(&format!("NumberOfPolys=\"{cells}\"")), "{}", &xml[..600]);
    assert_eq!(arrays["objects"], b"walls\0floor\0");
    assert_eq!(arrays["captors"], b"floor/floor\0sensor\0");
    assert!(xml.contains("Array type=\"String\" Name=\"captors\""));

    let (grid, xml) = vtk(export(&scene, "a.vtu", &["--threads", "1"]));
    assert_eq!(grid["types"], vec![5; cells]);
    assert_eq!(grid["irradiance_front_both"], arrays["irradiance_front_both"], "threads matter");
    assert!(xml.contains("type=\"UnstructuredGrid\""));
    // for readers that do not know strings
    assert_eq!(grid["captors"], b"floor/floor\nsensor\n");
    assert!(!xml.contains("String"));
}

fn floats_of_i32(bytes: &[u8]) -> Vec<i32> {
    bytes.as_chunks::<4>().0.iter().map(|b| i32::from_le_bytes(*b)).collect()
}

#[test]
fn a_glb_is_whole_and_coloured() {
    let scene = scene();
    let file =
        export(&scene, "a.glb", &["--quantity", "absorbed", "--band", "b&<", "--range", "0:4"]);
    let number =
        |at: usize| u32::from_le_bytes(file[at..][..4].try_into().expect("4 bytes")) as usize;
    assert_eq!((&file[..4], number(4), number(8)), (&b"glTF"[..], 2, file.len()));
    let length = number(12);
    let head: Value = serde_json::from_slice(&file[20..20 + length]).expect("JSON");
    let data = &file[28 + length..];
    assert_eq!(number(20 + length), data.len());
    assert_eq!(head["buffers"][0]["byteLength"], data.len());
    let shown = &head["scenes"][0]["extras"];
    assert_eq!(
        (&shown["quantity"], &shown["band"], &shown["range"]),
        (&"absorbed".into(), &"b&<".into(), &serde_json::json!([0.0, 4.0]))
    );
    let names: Vec<&str> = head["nodes"]
        .as_array()
        .expect("nodes")
        .iter()
        .map(|n| n["name"].as_str().expect("text"))
        .collect();
    assert_eq!(names, ["room <b>1</b> & \"2\"", "walls", "floor/floor", "sensor"]);
    let (floor, sensor) = (&head["nodes"][2], &head["nodes"][3]);
    assert!(floor["extras"]["absorbed_per_area a se"].as_f64() > Some(0.0), "{floor}");
    assert_eq!(sensor["extras"].get("absorbed_per_area a"), None, "a sensor absorbs nothing");
    for accessor in head["accessors"].as_array().expect("accessors") {
        let view = &head["bufferViews"][accessor["bufferView"].as_u64().expect("a view") as usize];
        let size = |key: &str| view[key].as_u64().expect(key) as usize;
        let each = if accessor["type"] == "VEC3" { 12 } else { 4 };
        assert_eq!(size("byteLength"), each * accessor["count"].as_u64().expect("count") as usize);
        assert!(size("byteOffset") + size("byteLength") <= data.len());
    }
    // the mean of the light on the floor is what it absorbed (within 5 %, as for the VTK file)
    let primitive = &head["meshes"][1]["primitives"][0];
    assert!(head["materials"][0]["extensions"]["KHR_materials_unlit"].is_object());
    assert_eq!((&primitive["material"], &floor["mesh"]), (&0.into(), &1.into()));
    let accessor = |name: &str| primitive["attributes"][name].as_u64().expect(name) as usize;
    let colour = &head["accessors"][accessor("COLOR_0")];
    assert_eq!((&colour["type"], &colour["normalized"]), (&"VEC4".into(), &true.into()));
    let values = &head["bufferViews"][accessor("_VALUE")];
    let size = |key: &str| values[key].as_u64().expect(key) as usize;
    let values = floats(&data[size("byteOffset")..][..size("byteLength")]);
    let mean = values.iter().sum::<f32>() / values.len() as f32;
    let absorbed = floor["extras"]["absorbed_per_area b&<"].as_f64().expect("a number");
    assert!((f64::from(mean) / absorbed - 1.0).abs() < 0.05, "{mean} {absorbed}");
    assert_eq!(
        file,
        export(
            &scene,
            "b.glb",
            &["--quantity", "absorbed", "--band", "b&<", "--range", "0:4", "--threads", "1"]
        )
    );
}

/// Where the lamp's photons arrive first, their power adds up to that of the lamp. In all they
/// arrive 1 / (1 - R) times as often, where R is the reflectance. The first is exact except for
/// rounding; the second, with 20,000 arrivals, has a standard error below 1 %, and the seed is
/// fixed.
#[test]
fn photons_of_a_ply_carry_the_power_of_the_lamp() {
    let scene = scene();
    let file = export(&scene, "a.ply", &[]);
    let end = b"end_header\n";
    let at = file.windows(end.len()).position(|w| w == end).expect("a header") + end.len();
    let header = String::from_utf8(file[..at].to_vec()).expect("text");
    let count = header.lines().find_map(|line| line.strip_prefix("element vertex "));
    let count: usize = count.expect("a count").parse().expect("a number");
    let properties = "property double x\nproperty double y\nproperty double z\n\
        property float dx\nproperty float dy\nproperty float dz\n\
        property float power_0\nproperty float power_1\nproperty uint light\nproperty uint bounce\n";
    assert!(header.ends_with(&format!("{properties}end_header\n")), "{header}");
    assert!(header.contains("\ncomment power_1: b&<\n"), "{header}");
    const RECORD: usize = 3 * 8 + 3 * 4 + 2 * 4 + 2 * 4;
    assert_eq!(file.len() - at, count * RECORD);
    assert!(count > 15_000, "{count}");
    let (mut first, mut all) = ([0.0; 2], [0.0; 2]);
    for photon in file[at..].chunks(RECORD) {
        let x = f64::from_le_bytes(photon[..8].try_into().expect("8 bytes"));
        assert!((9.999..11.001).contains(&x), "{x}");
        let floats = floats(&photon[24..44]);
        let length = floats[..3].iter().map(|d| d * d).sum::<f32>();
        assert!((length - 1.0).abs() < 1e-3, "{length}");
        let bounce = u32::from_le_bytes(photon[48..].try_into().expect("4 bytes"));
        for band in 0..2 {
            all[band] += floats[3 + band];
            first[band] += if bounce == 0 { floats[3 + band] } else { 0.0 };
        }
    }
    for (band, (power, reflectance)) in [(3.0, 0.5), (5.0, 0.2)].into_iter().enumerate() {
        assert!((first[band] / power - 1.0).abs() < 1e-3, "{first:?}");
        assert!((all[band] * (1.0 - reflectance) / power - 1.0f32).abs() < 0.04, "{all:?}");
    }
    let again = export(&scene, "b.ply", &["--threads", "1"]);
    assert!(file == again, "threads matter");
}

/// A scene without captors, and one without surfaces, are written with what remains.
#[test]
fn little_is_still_something() {
    let scene = scene();
    let text = fs::read_to_string(scene.path("scene.json")).expect("the scene");
    let cut = |text: &str, key: &str, end: &str| {
        let at = text.find(key).expect(key);
        let to = at + text[at..].find(end).expect(end) + end.len();
        text[..at].to_string() + &text[to..]
    };
    let sensors = cut(&text, "\"objects\": [", "],");
    let walls = cut(&text, "\"captors\": [", "}],").replace(", \"captor\": true", "");
    for (name, scene_text, cells) in
        [("sensors", sensors, 1..1000), ("walls", walls, 60_000..61_000)]
    {
        fs::write(scene.path("scene.json"), scene_text).expect("written");
        let (arrays, _) = vtk(export(&scene, "a.vtp", &[]));
        let shown = floats(&arrays["irradiance_front_both"]);
        assert!(cells.contains(&shown.len()), "{name}: {}", shown.len());
        assert!(shown.iter().all(|v| *v >= 0.0) && shown.iter().any(|v| *v > 0.0), "{name}");
        export(&scene, "a.glb", &["--log"]);
        done(&scene.path(""), &["view", "scene.json", "-o", &format!("{name}.html")]);
    }
    let sensors = cut(&text, "\"objects\": [", "],");
    fs::write(scene.path("scene.json"), sensors).expect("written");
    refused(&scene.path(""), &["export", "scene.json", "-o", "b.ply"], &["no surface", ".vtp"]);
}

#[test]
fn wrong_wishes_are_refused() {
    let scene = scene();
    results(&scene);
    let folder = scene.path("");
    let export = ["export", "scene.json", "-o"];
    for (more, words) in [
        (&["a.obj"][..], &["a.obj", "ending", ".vtp, .vtu, .glb or .ply"][..]),
        (&["no-ending"], &["no-ending", "ending"]),
        (&["a.vtp", "--band", "a"], &["--band", ".glb", "leave them out"]),
        (&["a.glb", "--band", "botj"], &["no band `botj`", "did you mean `both`?"]),
        (&["a.glb", "--range", "5:1"], &["5 to 1", "the lower number first"]),
        (&["a.glb", "--range", "0:1", "--log"], &["logarithm", "above 0"]),
        (&["a.ply", "--no-trace", "--results", "results.json"], &["--no-trace", "photons"]),
        (&["a.vtp", "--results", "scene.json"], &["scene.json", "is no results file"]),
        (&["scene.json"], &["scene.json"]),
    ] {
        refused(&folder, &[&export, more].concat(), words);
    }
    // these are refused in the words of the argument parser
    for more in [&["a.glb", "--range", "5"][..], &["a.vtp", "--no-trace"]] {
        let output = phylux(&folder, &[&export, more].concat());
        assert_eq!(output.status.code(), Some(2), "{more:?}");
    }
}

#[test]
fn results_of_another_scene_are_refused() {
    let scene = scene();
    results(&scene);
    let folder = scene.path("");
    let text = fs::read_to_string(scene.path("scene.json")).expect("the scene");
    for (old, new, words) in [
        ("\"sensor\"", "\"other\"", &["captor `sensor`", "`other`"][..]),
        ("0.2], \"normal\"", "0.3], \"normal\"", &["captor `sensor`", "moved"]),
        ("\"radius\": 0.1", "\"radius\": 0.2", &["captor `sensor`", "size"]),
        (
            "[{\"name\": \"sensor\"",
            "[{\"name\": \"first\", \"obj\": \"floor.obj\"}, {\"name\": \"sensor\"",
            &["captor"],
        ),
        ("\"sums\": {\"both\"", "\"sums\": {\"all\"", &["band `both`", "band `all`"]),
        (", \"captor\": true", "", &["captor `floor/floor`"]),
        ("\"bands\"", "\"quantity\": \"umol/s\", \"bands\"", &["W", "umol/s"]),
    ] {
        assert!(text.contains(old), "{old}");
        fs::write(scene.path("scene.json"), text.replacen(old, new, 1)).expect("written");
        for command in [&["export", "-o", "a.vtp"][..], &["view"]] {
            let arguments = [command, &["scene.json", "--results", "results.json"]].concat();
            refused(&folder, &arguments, &[&["another scene"], words].concat());
        }
    }
}

/// With results, captors need no run. Without a trace, nothing is known of other surfaces.
#[test]
fn results_are_shown_without_tracing() {
    let scene = scene();
    results(&scene);
    let (arrays, _) = vtk(export(&scene, "a.vtp", &["--results", "results.json", "--no-trace"]));
    let captor = floats_of_i32(&arrays["captor"]);
    let shown = floats(&arrays["irradiance_front_both"]);
    let result = floats(&arrays["captor_irradiance_front_both"]);
    for ((captor, shown), result) in captor.iter().zip(shown).zip(result) {
        let as_it_should = if *captor < 0 { shown.is_nan() } else { shown == result };
        assert!(as_it_should, "{captor} {shown} {result}");
    }
    let listed = listing(&scene.path(""));
    assert!(!listed.iter().any(|name| name.starts_with(".phylux")), "{listed:?}");
}
