//! What the files of other programs give a scene, and what is told of them, in scenes whose files
//! are in memory.

use std::{collections::BTreeMap, path::Path};

use glam::Vec3;
use serde_json::{Value, json};

use super::*;
use phylux_core::scene::material::{Interaction, Material, Scatterer};

type Files<'a> = BTreeMap<&'a str, String>;

fn loaded(scene: Value, files: &Files) -> Result<LoadedScene> {
    let read = |path: &Path| {
        let found = path.to_str().and_then(|name| files.get(name));
        found.map(|text| text.clone().into_bytes()).ok_or_else(|| "there is no such file".into())
    };
    load_value(scene, Path::new("scene.json"), &read, None)
}

#[track_caller]
fn warnings(scene: Value, files: &Files) -> String {
    loaded(scene, files).unwrap_or_else(|e| panic!("{e}")).warnings.join("\n")
}

const SHEET: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";

/// A scene of a sheet of some material between 400 and 600 nm.
fn sheet(material: Value, power: Value) -> Value {
    json!({ "quantity": "umol/s", "bands": [{ "name": "a", "from_nm": 400, "to_nm": 600 }],
        "spectra": { "weight": "flat" }, "materials": { "m": material },
        "objects": [{ "obj": "a.obj", "material": "m" }],
        "lights": [{ "type": "point", "position": [0, 0, 1], "power": power }] })
}

/// A table of `rows` values of 0.5, of which the first `below` are `value`.
fn table(rows: usize, below: usize, value: f64) -> String {
    let step = 200.0 / (rows - 1) as f64;
    let row = |i: usize| {
        let value = if i < below { value } else { 0.5 };
        format!("{},{value}\n", 400.0 + step * i as f64)
    };
    "nm,R\n".to_string() + &(0..rows).map(row).collect::<String>()
}

/// Names of sums are compared with all others, so there is a limit on their number.
#[test]
fn too_many_sums_are_refused() {
    let sums = |count: usize| {
        let sum = |i: usize| (format!("s{i}"), json!(["a"]));
        let mut scene = sheet(json!({ "type": "lambert", "reflectance": 0.5 }), json!(1));
        scene["sums"] = Value::Object((0..count).map(sum).collect());
        let files = Files::from([("a.obj", SHEET.into())]);
        loaded(scene, &files).map(|loaded| loaded.scene.sums().len()).map_err(|e| e.to_string())
    };
    assert_eq!(sums(100), Ok(100));
    assert!(sums(4097).unwrap_err().contains("/sums: 4097 sums, must be at most 4096"));
}

/// A few values below 0 are noise, more are told, in reflectances and in lamps.
#[test]
fn spectra_below_zero_are_told() {
    let material = json!({ "type": "lambert", "reflectance": { "spectrum": "t.csv" } });
    for (spectrum, words) in [
        (table(21, 0, 0.0), ""),
        (table(21, 1, -0.1), ""),
        (table(21, 2, -1e-3), "t.csv: 2 of its 21 values in band `a` are below 0"),
        (table(21, 18, -0.1), "t.csv: 18 of its 21 values in band `a` are below 0"),
        (table(21, 18, -0.1), "below 0 too, and counts as 0: look at the measurement"),
    ] {
        let files = Files::from([("a.obj", SHEET.into()), ("t.csv", spectrum.clone())]);
        let told = warnings(sheet(material.clone(), json!(1)), &files);
        assert!(told.contains(words) && told.is_empty() == words.is_empty(), "{told}\n{words}");
        assert!(told.lines().count() <= 1, "{told}");
    }
    let lamp = json!({ "spectrum": "t.csv", "total": 10 });
    let grey = json!({ "type": "lambert", "reflectance": 0.5 });
    for (spectrum, told) in [(table(21, 6, -0.01), false), (table(21, 6, -0.1), true)] {
        let files = Files::from([("a.obj", SHEET.into()), ("t.csv", spectrum)]);
        let found = warnings(sheet(grey.clone(), lamp.clone()), &files);
        let words = "t.csv: its values below 0 from 400 to 600 nm, which count as 0, come to 7 %";
        assert!(found.contains(words) == told && found.is_empty() != told, "{found}");
    }
}

/// Writes a file of WINDOW with one ring of 4 patches and one matrix.
fn window(direction: &str, value: impl Fn(usize, usize) -> f64) -> String {
    let pairs = (0..4).flat_map(|row| (0..4).map(move |column| (row, column)));
    let values: Vec<String> = pairs.map(|(row, column)| value(row, column).to_string()).collect();
    format!(
        "<WindowElement><AngleBasis><AngleBasisName>four</AngleBasisName><AngleBasisBlock><nPhis>4</nPhis>\
        <UpperTheta>90</UpperTheta></AngleBasisBlock></AngleBasis><WavelengthData><Wavelength>Visible</Wavelength>\
        <WavelengthDataBlock><WavelengthDataDirection>{direction}</WavelengthDataDirection>\
        <ColumnAngleBasis>four</ColumnAngleBasis><RowAngleBasis>four</RowAngleBasis>\
        <ScatteringData>{}</ScatteringData></WavelengthDataBlock></WavelengthData></WindowElement>",
        values.join(", ")
    )
}

/// A total of up to 1.05 is noise of the measurement, and is scaled down with a word; a larger one
/// is an error.
#[test]
fn files_of_window_with_too_much_light_are_scaled() {
    let material = json!({ "type": "table", "file": "w.xml" });
    let at = Interaction::new(Vec3::new(0.0, 0.6, -0.8), Vec3::Z);
    for (total, words) in [
        (0.9, ""),
        (1.0005, ""),
        (
            1.03,
            "w.xml: of the light from one direction 1.0300 goes on, more than comes: all values are scaled by 0.9709",
        ),
        (1.0499, "scaled by 0.9525"),
    ] {
        let text = window("Transmission Front", |_, _| total / std::f64::consts::PI);
        let files = Files::from([("a.obj", SHEET.into()), ("w.xml", text)]);
        let loaded = loaded(sheet(material.clone(), json!(1)), &files).unwrap();
        let told = loaded.warnings.join("\n");
        assert!(told.contains(words) && told.is_empty() == words.is_empty(), "{told}\n{words}");
        let absorbed =
            loaded.scene.materials()[0].material.absorptance::<[f32; 1]>(&at).unwrap().0[0];
        assert!((f64::from(absorbed) - (1.0 - total).max(0.0)).abs() < 1e-5, "{total}: {absorbed}");
    }
    let text = window("Transmission Front", |_, _| 1.06 / std::f64::consts::PI);
    let files = Files::from([("a.obj", SHEET.into()), ("w.xml", text)]);
    let error = loaded(sheet(material, json!(1)), &files).unwrap_err().to_string();
    assert!(error.starts_with("w.xml: of the light that comes to the front"), "{error}");
}

fn room(rad: &str, materials: Value) -> Value {
    json!({ "materials": materials, "objects": [{ "name": "o", "rad": rad }],
        "lights": [{ "type": "point", "position": [0, 0, 1], "power": 1 }] })
}

/// In Radiance the front of a surface is what WINDOW calls the back, and azimuth 90 lies towards
/// the direction up that the material names. The file stands beside the room.
#[test]
fn a_measured_material_of_a_room_is_a_table() {
    let text = window("Transmission Front", |row, column| 0.01 * (4 * row + column + 1) as f64);
    let rad = "void BSDF b 6 0 w.xml 0 1 0 . 0 0\n\
        b polygon s 0 0 9 0 0 0  3 1 0  0 2 0\n";
    let files = Files::from([("rooms/a.rad", rad.into()), ("rooms/w.xml", text.clone())]);
    let known = loaded(room("rooms/a.rad", json!({})), &files).unwrap_or_else(|e| panic!("{e}"));
    assert!(known.warnings[0].contains("it has no `Transmission Back`: that is taken"));
    let material: &Material = &known.scene.materials()[0].material;
    // light from the outside, below, that travels towards +x: azimuth 0 as seen from inside, which
    // column 0 is for; it leaves towards +y, azimuth 90, row 1
    for (comes, goes, value) in [
        ([0.6, 0.0, 0.8], [0.0, 0.6, 0.8], 0.05),
        ([0.6, 0.0, 0.8], [-0.6, 0.0, 0.8], 0.09),
        ([0.0, -0.6, 0.8], [0.6, 0.0, 0.8], 0.04),
        // and the other way around
        ([0.0, -0.6, -0.8], [-0.6, 0.0, -0.8], 0.05),
    ] {
        let at = Interaction::new(Vec3::from(comes), Vec3::Z);
        let found = material.evaluate::<[f32; 1]>(&at, Vec3::from(goes)).0[0];
        assert!((found - value).abs() < 1e-6, "{comes:?} {goes:?}: {found}");
    }
    // in the working directory
    let files = Files::from([("rooms/a.rad", rad.into()), ("w.xml", text)]);
    assert!(loaded(room("rooms/a.rad", json!({})), &files).is_ok());
    // nowhere: an error that says what to do, unless the scene has the material
    let files = Files::from([("rooms/a.rad", rad.into())]);
    let error = loaded(room("rooms/a.rad", json!({})), &files).unwrap_err().to_string();
    assert!(
        error.starts_with("rooms/a.rad:1: `b`: rooms/w.xml: there is no such file; give the scene")
    );
    let own = json!({ "b": { "type": "lambert", "reflectance": 0.5 } });
    for rad in [rad.to_string(), rad.replace("BSDF", "trans2"), rad.replace("void", "pattern")] {
        let files = Files::from([("rooms/a.rad", rad)]);
        let known =
            loaded(room("rooms/a.rad", own.clone()), &files).unwrap_or_else(|e| panic!("{e}"));
        assert!(matches!(known.scene.materials()[0].material, Material::Lambert(_)));
    }
    let files = Files::from([("rooms/a.rad", rad.replace("BSDF", "trans2"))]);
    let error = loaded(room("rooms/a.rad", json!({})), &files).unwrap_err().to_string();
    assert!(
        error.starts_with("rooms/a.rad:1: void trans2 b: `trans2` is not read; give"),
        "{error}"
    );
}

/// What the head of a map says and is not used is told.
#[test]
fn heads_of_maps_are_told() {
    let map = |head: &str| {
        format!("#?RADIANCE\n{head}FORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 2\n@@@\x7f@@@\x7f")
    };
    let scene = json!({ "lights": [{ "type": "environment", "file": "m.hdr" }] });
    let told = |head: &str| warnings(scene.clone(), &Files::from([("m.hdr", map(head))]));
    assert_eq!(told("SOFTWARE=none\nVIEW\n VIEW=-vtv\n"), "");
    assert!(
        told("VIEW=-vta -vh 180\n").starts_with("m.hdr: its VIEW=-vta -vh 180 is a projection")
    );
    assert!(told("GAMMA=2.2\n").starts_with("m.hdr: its GAMMA=2.2 is not used"));
}
