//! What docs/scene-format.md promises about ids, groups, units, MTL files and results.

use serde_json::Value;

use phylux::RunResult;

use crate::{
    bad_input::phylux,
    common::{TestScene, front},
};

const LEAF: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3\no tip\nf 1 3 4\ng base\nf 1 2 4\nf 2 3 4\n\
                    g tip\nf 1 2 3\n";
const CSV: &str = "x,y,z,radius,nx,ny,nz\n0,0,0.5,0.1,0,0,1\n0,1,0.5,0.1,0,0,1\n";
const NAMED_CSV: &str = "id,X,Y,Z,rayon_capteur,Xnorm,Ynorm,Znorm\nwest,0,0,0.5,0.1,0,0,1\n";
const LIGHT: &str = r#"{"type": "point", "position": [0.5, 0.5, 1], "power": 1}"#;

fn ids(result: &RunResult) -> Vec<&str> {
    result.captors.iter().map(|captor| captor.id.as_str()).collect()
}

#[test]
fn captors_have_the_ids_and_groups_of_the_contract() {
    let scene = r#"{
        "$schema": "scene.schema.json",
        "materials": {"m": {"type": "lambert", "reflectance": 0.5}},
        "objects": [
            {"name": "one", "obj": "leaf.obj", "material": "m", "captor": true},
            {"obj": "leaf.obj", "material": "m", "captor": true, "group": "all leaves",
             "instances": [{"translate": [3, 0, 0]}, {"translate": [6, 0, 0]}]},
            {"name": "fine", "obj": "leaf.obj", "material": "m", "captor": "triangle", "group": "all leaves",
             "instances": [{"translate": [9, 0, 0]}]},
            {"name": "fine too", "obj": "leaf.obj", "material": "m", "captor": "triangle", "transform": {"translate": [0, 5, 0]}},
            {"name": "floor", "obj": "leaf.obj", "material": "m", "transform": {"translate": [0, 0, -1]}}
        ],
        "lights": [LIGHT],
        "captors": [
            {"csv": "grid.csv", "group": "sensors"},
            {"name": "row", "csv": "named.csv", "group": "sensors"},
            {"name": "port", "obj": "leaf.obj", "sides": "both"},
            {"name": "flat", "obj": "bare.obj"},
            {"name": "probe", "disc": {"center": [0, 0, 2], "normal": [0, 0, -1], "radius": 1}}
        ]
    }"#
    .replace("LIGHT", LIGHT);
    let bare = "v 0 0 3\nv 1 0 3\nv 1 1 3\nf 1 2 3\n";
    let scene = TestScene::new(
        &scene,
        &[("leaf.obj", LEAF), ("grid.csv", CSV), ("named.csv", NAMED_CSV), ("bare.obj", bare)],
    );
    let result = scene.run(2000, 1);
    assert_eq!(
        ids(&result),
        [
            "one/leaf",
            "one/tip",
            "one/base",
            "leaf/leaf#0",
            "leaf/tip#0",
            "leaf/base#0",
            "leaf/leaf#1",
            "leaf/tip#1",
            "leaf/base#1",
            "fine/leaf#0/0",
            "fine/tip#0/0",
            "fine/base#0/0",
            "fine/base#0/1",
            "fine/tip#0/1",
            "fine too/leaf/0",
            "fine too/tip/0",
            "fine too/base/0",
            "fine too/base/1",
            "fine too/tip/1",
            "grid/0",
            "grid/1",
            "row/west",
            "port/leaf",
            "port/tip",
            "port/base",
            "flat",
            "probe",
        ]
    );
    let groups: Vec<(&str, usize)> =
        result.groups.iter().map(|group| (group.id.as_str(), group.captors)).collect();
    for group in [
        ("one", 3),
        ("leaf", 6),
        ("leaf#0", 3),
        ("leaf#1", 3),
        ("all leaves", 11),
        ("fine", 5),
        ("fine#0", 5),
        ("fine too", 5),
        ("grid", 2),
        ("row", 1),
        ("sensors", 3),
        ("port", 3),
        ("flat", 1),
        ("probe", 1),
    ] {
        assert!(groups.contains(&group), "{group:?} is not in {groups:?}");
    }
    assert_eq!(groups.len(), 14, "{groups:?}");
    let whole = |id: &str| result.groups.iter().find(|group| group.id == id).expect("a group");
    let sum: f64 = result.captors[..3].iter().map(|captor| captor.front.flux[0]).sum();
    assert!((whole("one").front.flux[0] - sum).abs() < 1e-12);
    assert!((whole("one").area - 2.5).abs() < 1e-12);
    assert!(whole("sensors").absorbed.is_none() && whole("sensors").back.is_none());
    assert!(whole("port").back.is_some() && whole("all leaves").absorbed.is_some());
    // one-sided captors count nothing on their backs, so their results have no back
    let kinds = |id: &str| result.captors.iter().find(|captor| captor.id == id).expect("a captor");
    assert!(kinds("flat").back.is_none() && kinds("port/tip").back.is_some());
    assert_eq!((&*kinds("one/tip").kind, &*kinds("probe").kind), ("surface", "virtual"));
    assert_eq!(kinds("probe").normal, [0.0, 0.0, -1.0]);
    assert!((kinds("probe").area - std::f64::consts::PI).abs() < 1e-9);
}

#[test]
fn units_change_the_numbers_and_not_the_scene() {
    let scene = |unit: &str, scale: f64| {
        let [near, far, radius] = [0.5, 1.0, 0.2].map(|x| x * scale);
        let text = format!(
            r#"{{"unit": "{unit}", "materials": {{"m": {{"type": "lambert", "reflectance": 0.5}}}},
            "objects": [{{"obj": "leaf.obj", "material": "m", "captor": true,
                "transform": {{"scale": {scale}, "translate": [{near}, 0, 0]}}}}],
            "lights": [{{"type": "point", "position": [{near}, {near}, {far}], "power": 1}}],
            "captors": [{{"name": "p", "disc": {{"center": [{near}, 0, {near}], "normal": [0, 0, 1], "radius": {radius}}}}}]}}"#
        );
        TestScene::new(&text, &[("leaf.obj", LEAF)]).run(4000, 1)
    };
    let metres = scene("m", 1.0);
    for (unit, scale) in [("cm", 100.0), ("mm", 1000.0)] {
        let other = scene(unit, scale);
        for (a, b) in metres.captors.iter().zip(&other.captors) {
            assert!((a.area - b.area).abs() < 1e-9, "{unit} {}", a.id);
            assert!((a.center[0] - b.center[0]).abs() < 1e-9, "{unit} {}", a.id);
            let (x, y) = (a.front.irradiance[0], b.front.irradiance[0]);
            assert!((x - y).abs() <= 0.02 * x, "{unit} {}: {x} {y}", a.id);
        }
    }
}

/// Returns the results and the warnings of a scene whose faces have these MTL entries, with one
/// sensor above them.
fn with_mtl(mtl: &str, bands: &str) -> (RunResult, Vec<String>) {
    let obj = "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nusemtl soil\nf 1 2 3 4\n";
    let text = format!(
        r#"{{{bands} "objects": [{{"name": "a", "obj": "a.obj", "captor": true}}],
        "lights": [{{"type": "point", "position": [0.5, 0.5, 1], "power": 1}}],
        "captors": [{{"name": "p", "disc": {{"center": [0.5, 0.5, 0.5], "normal": [0, 0, -1], "radius": 0.2}}}}]}}"#
    );
    let scene = TestScene::new(&text, &[("a.obj", obj), ("a.mtl", mtl)]);
    let warnings = phylux::load(&scene.path("scene.json")).expect("a scene").warnings;
    (scene.run(20_000, 1), warnings)
}

/// What is said of files on the screen is in the results, too, and in what is mixed from them.
#[test]
fn warnings_about_files_are_in_the_results() {
    let obj = "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nusemtl soil\nf 1 2 3 4\n";
    let text = r#"{"objects": [{"name": "a", "obj": "a.obj", "captor": true}],
        "lights": [{"type": "point", "name": "lamp", "position": [0.5, 0.5, 1], "power": 1}]}"#;
    let mtl = "newmtl soil\nillum 2\nKd .1 .1 .1\nKs .2 .2 .2\nNs 5\n";
    let scene = TestScene::new(text, &[("a.obj", obj), ("a.mtl", mtl)]);
    let about_file = phylux::load(&scene.path("scene.json")).expect("a scene").warnings;
    assert_eq!(about_file.len(), 1);
    let run = |arguments: &str| {
        let output = phylux(&scene.path(""), &arguments.split(' ').collect::<Vec<_>>());
        assert!(output.status.success(), "{output:?}");
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(said.matches("illum 2 with Ks").count() <= 1, "{said}");
    };
    run("run scene.json --photons 1e4 --by-light -o a.json");
    run("mix a.json --power lamp=2 -o b.json");
    for name in ["a.json", "b.json"] {
        let result = phylux::formats::read_json(&scene.path(name)).expect("a result");
        // the command names the file as it was called: by its place in the folder
        assert!(about_file[0].ends_with(&result.warnings[0]), "{name}: {:?}", result.warnings);
    }
}

/// The place of an error about a setting is where the value came from.
#[test]
fn errors_of_settings_name_the_file_or_the_option() {
    let scene = |settings: &str| {
        let text = format!(
            r#"{{"periodic": {{"x": [0, 2], "y": [0, 2]}}, "settings": {settings},
            "lights": [{{"type": "point", "position": [1, 1, 1], "power": 1}}],
            "captors": [{{"name": "s", "disc": {{"center": [1, 1, 0], "normal": [0, 0, 1], "radius": 0.1}}}}]}}"#
        );
        TestScene::new(&text, &[])
    };
    let file = "error: scene.json: /settings/guiding: ";
    for (settings, options, place) in [
        (r#"{"guiding": "full"}"#, "", file),
        (r#"{"guiding": "full"}"#, " --guiding aim", "error: --guiding: "),
        ("{}", " --guiding aim", "error: --guiding: "),
    ] {
        let arguments = format!("run scene.json --photons 1e3 -o -{options}");
        let output = phylux(&scene(settings).path(""), &arguments.split(' ').collect::<Vec<_>>());
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(said.starts_with(place) && said.contains("; leave guiding out"), "{said}");
    }
}

/// Returns the absorbed fraction of the light that arrives from above, in each band.
fn absorptance(result: &RunResult) -> Vec<f64> {
    let floor = &result.captors[0];
    let absorbed = floor.absorbed.as_ref().expect("a surface");
    absorbed.iter().zip(&floor.front.flux).map(|(absorbed, flux)| absorbed / flux).collect()
}

const RGB: &str = r#""bands": [{"name": "r"}, {"name": "g"}, {"name": "b"}],"#;

#[test]
fn mtl_entries_become_materials() {
    let near = |found: &[f64], expected: &[f64]| {
        assert_eq!(found.len(), expected.len());
        for (x, y) in found.iter().zip(expected) {
            assert!((x - y).abs() < 1e-6, "{found:?} {expected:?}");
        }
    };
    // one band takes the mean of r, g and b; three bands take r, g and b in order
    for illum in ["illum 1", "illum 3", "illum 2"] {
        let (result, warnings) = with_mtl(&format!("newmtl soil\n{illum}\nKd 0.1 0.2 0.6\n"), "");
        near(&absorptance(&result), &[0.7]);
        assert!(warnings.is_empty(), "{warnings:?}");
        let (result, _) = with_mtl(&format!("newmtl soil\n{illum}\nKd 0.1 0.2 0.6\n"), RGB);
        near(&absorptance(&result), &[0.9, 0.8, 0.4]);
    }
    let shiny = "newmtl soil\nillum 3\nKd 0.1 0.2 0.6\nKs 0.3 0.3 0.3\n";
    let (result, warnings) = with_mtl(shiny, RGB);
    near(&absorptance(&result), &[0.9, 0.8, 0.4]);
    assert!(warnings.len() == 1 && warnings[0].contains("without what Ks mirrors"), "{warnings:?}");
    let (result, warnings) = with_mtl("newmtl soil\nillum 5\nKd 1 1 1\nKs 0.9 0.8 0.7\n", RGB);
    near(&absorptance(&result), &[0.1, 0.2, 0.3]);
    assert!(warnings.is_empty(), "{warnings:?}");
    for (illum, word) in [("", "no illum"), ("illum 4", "illum 4")] {
        let (result, warnings) = with_mtl(&format!("newmtl soil\n{illum}\nKd 0.1 0.2 0.6\n"), RGB);
        near(&absorptance(&result), &[0.9, 0.8, 0.4]);
        assert_eq!(warnings.len(), 1);
        assert!(warnings[0].contains(word) && warnings[0].contains("lambert"), "{warnings:?}");
    }
    let (result, warnings) = with_mtl("newmtl soil\nillum 2\nKd .1 .1 .1\nKs .2 .2 .2\nNs 5\n", "");
    assert!(absorptance(&result)[0] > 0.7);
    assert_eq!(warnings.len(), 1);
    assert!(warnings[0].contains("soil") && warnings[0].contains("phong"), "{warnings:?}");
    // missing entries reflect nothing and textures are not read; a warning says so
    for (entry, word) in [
        ("illum 1", "no Kd"),
        ("illum 5\nKd 1 1 1", "no Ks"),
        ("illum 1\nKd 0 0 0\nmap_Kd soil.png", "map_Kd"),
    ] {
        let (result, warnings) = with_mtl(&format!("newmtl soil\n{entry}\n"), "");
        near(&absorptance(&result), &[1.0]);
        assert_eq!(warnings.len(), 1);
        assert!(warnings[0].contains("soil") && warnings[0].contains(word), "{warnings:?}");
    }
    // a leaf transmits light unless Tf is the default 1 1 1, and so does water
    let through = |mtl: &str| with_mtl(mtl, "").0.energy.escaped[0];
    let opaque = through("newmtl soil\nillum 6\nKd .1 .1 .1\nTf 1 1 1\n");
    let leaf = through("newmtl soil\nillum 6\nKd .1 .1 .1\nTf .5 .5 .5\n");
    let water = through("newmtl soil\nillum 7\nNi 1.33\nKd .5 .5 .5\n");
    assert!(leaf > opaque + 0.01 && water > opaque + 0.01, "{opaque} {leaf} {water}");
}

#[test]
fn faces_that_cross_themselves_are_warned_of() {
    let bow_tie = "v 0 0 0\nv 1 1 0\nv 1 0 0\nv 0 1 0\nv 2 0 0\nf 1 2 5\nf 1 2 3 4\n";
    let text = r#"{"materials": {"wall": {"type": "lambert", "reflectance": 0.5}},
        "objects": [{"obj": "a.obj", "material": "wall"}],
        "lights": [{"type": "point", "position": [0, 0, 1], "power": 1}]}"#;
    let scene = TestScene::new(text, &[("a.obj", bow_tie)]);
    let warnings = phylux::load(&scene.path("scene.json")).expect("a scene").warnings;
    assert_eq!(warnings.len(), 1);
    assert!(warnings[0].contains("a.obj:6: 1 of the faces"), "{warnings:?}");
}

#[test]
fn glowing_mtl_entries_are_lights() {
    let (result, _) = with_mtl("newmtl soil\nillum 1\nKd 0 0 0\nKe 1 2 3\n", RGB);
    let pi = std::f64::consts::PI;
    for (b, radiance) in [1.0, 2.0, 3.0].into_iter().enumerate() {
        assert!((result.energy.power[b] - (1.0 + pi * radiance)).abs() < 1e-9, "a square of 1 m2");
    }
    assert!(front(&result, "p").flux[2] > front(&result, "p").flux[0]);
}

#[test]
fn results_have_the_fields_of_the_contract() {
    let scene = format!(
        r#"{{"name": "bay", "quantity": "umol/s",
        "bands": [{{"name": "PAR", "from_nm": 400, "to_nm": 700}}, {{"name": "x"}}], "sums": {{"all": ["PAR", "x"]}},
        "materials": {{"m": {{"type": "lambert", "reflectance": 0.5}}, "glass": {{"type": "mirror", "reflectance": 1}}}},
        "objects": [{{"name": "a", "obj": "leaf.obj", "material": "m", "captor": true}},
            {{"name": "b", "obj": "leaf.obj", "material": "glass", "captor": true, "transform": {{"translate": [0, 0, -1]}}}}],
        "lights": [{LIGHT}], "captors": [{{"csv": "grid.csv"}}],
        "settings": {{"photons": 1e4, "seed": 7, "k": 10}}}}"#
    );
    let folder =
        TestScene::new(&format!("\u{feff}{scene}"), &[("leaf.obj", LEAF), ("grid.csv", CSV)]);
    let output = phylux(&folder.path(""), &["run", "scene.json"]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let text = std::fs::read_to_string(folder.path("results.json")).expect("results");
    let result: Value = serde_json::from_str(&text).expect("JSON");
    assert_eq!(result["scene"], "bay");
    for (key, value) in [("seed", 7), ("photons", 10_000), ("blocks", 128)] {
        assert_eq!(result[key], value, "{key}");
    }
    assert_eq!(result["estimator"], "photons");
    assert_eq!(result["unit"]["irradiance"], "umol/m2/s");
    assert_eq!(result["bands"][0]["from_nm"], 400.0);
    assert_eq!(result["bands"][2]["sum_of"], serde_json::json!(["PAR", "x"]));
    for key in ["power", "emitted", "absorbed", "escaped", "lost"] {
        assert_eq!(result["energy"][key].as_array().map(Vec::len), Some(3), "{key}");
    }
    assert_eq!(result["energy"]["absorbed_by"]["glass"][0], 0.0);
    let captors = result["captors"].as_array().expect("captors");
    for captor in captors {
        for key in ["id", "kind", "area", "center", "normal", "front"] {
            assert!(!captor[key].is_null(), "{key} of {captor}");
        }
        let surface = captor["kind"] == "surface";
        for key in ["back", "absorbed", "absorbed_se"] {
            assert_eq!(captor.get(key).is_some(), surface, "{key} of {captor}");
        }
        for key in ["photons", "flux", "flux_se", "irradiance", "irradiance_se", "knn"] {
            assert!(captor["front"].get(key).is_some(), "{key} of {captor}");
        }
    }
    let dark = captors.iter().find(|captor| captor["back"]["photons"] == 0).expect("a dark back");
    assert!(dark["back"]["flux_se"][0].is_null() && dark["back"]["knn"].is_null(), "{dark}");
    assert_eq!(dark["back"]["flux"][0], 0.0);
    let lit = &captors[0]["front"];
    for key in ["k", "radius", "coverage", "irradiance", "irradiance_se", "radiance", "radiance_se"]
    {
        assert!(!lit["knn"][key].is_null(), "{key} of {lit}");
    }
    let mirror = captors.iter().find(|c| c["id"] == "b/base").expect("a mirror");
    assert!(mirror["front"]["knn"].is_null() || mirror["front"]["knn"]["radiance"].is_null());
    for key in ["id", "captors", "area", "front"] {
        assert!(!result["groups"][0][key].is_null(), "{key}");
    }
}

#[test]
fn schemas_know_every_key() {
    let folder = TestScene::new("{}", &[]);
    let schema = |of: &str| -> Value {
        let output = phylux(&folder.path(""), &["schema", of]);
        serde_json::from_slice(&output.stdout).expect("JSON")
    };
    let scene = schema("scene");
    assert_eq!(scene["additionalProperties"], false);
    for key in [
        "name",
        "unit",
        "quantity",
        "bands",
        "sums",
        "materials",
        "objects",
        "lights",
        "captors",
        "settings",
        "camera",
        "$schema",
    ] {
        assert!(scene["properties"].get(key).is_some(), "{key}");
    }
    let results = schema("results");
    for key in [
        "phylux", "scene", "seed", "photons", "blocks", "unit", "bands", "energy", "captors",
        "groups",
    ] {
        assert!(results["properties"].get(key).is_some(), "{key}");
    }
    let captor = schema("captor");
    for key in ["phylux", "scene", "seed", "photons", "unit", "bands", "id", "area", "front"] {
        assert!(captor["properties"].get(key).is_some(), "{key}");
    }
}
