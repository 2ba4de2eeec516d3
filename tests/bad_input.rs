//! Wrong input and wrong usage: one message that says where and what, exit code 2, and nothing
//! written.

use std::{
    fs,
    path::Path,
    process::{Command, Output},
};

use crate::common::{TestScene, binary};

/// The entries of a correct scene of one band; each row below puts an error into one of them.
const MATERIALS: &str = r#"{"wall": {"type": "lambert", "reflectance": 0.5}}"#;
const OBJECTS: &str = r#"[{"name": "a", "obj": "a.obj", "material": "wall", "captor": true}]"#;
const LIGHTS: &str = r#"[{"type": "point", "position": [0, 0, 1], "power": 1}]"#;
const CAPTORS: &str = "[]";
const OBJ: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
const CSV: &str = "x,y,z,radius,nx,ny,nz\n0,0,0.5,0.1,0,0,1\n";

pub fn phylux(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(binary()).args(arguments).current_dir(folder).output().expect("phylux starts")
}

/// Returns the names of the files in a folder, sorted.
pub fn listing(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).expect("a folder");
    let mut names: Vec<String> = entries
        .map(|entry| entry.expect("an entry").file_name().to_string_lossy().into_owned())
        .collect();
    names.sort();
    names
}

/// Asserts that the arguments are refused with one line that contains all `words`, and that nothing
/// is written.
pub fn refused(folder: &Path, arguments: &[&str], words: &[&str]) {
    let before = listing(folder);
    let output = phylux(folder, arguments);
    let stderr = String::from_utf8_lossy(&output.stderr);
    if std::env::var_os("PHYLUX_SHOW").is_some() {
        println!("{}", stderr.trim());
    }
    assert_eq!(output.status.code(), Some(2), "{arguments:?}: {stderr}");
    let lines: Vec<&str> = stderr.lines().filter(|line| line.starts_with("error: ")).collect();
    assert_eq!(lines.len(), 1, "{stderr}");
    assert!(!stderr.contains("panicked"), "{stderr}");
    for word in words {
        assert!(lines[0].contains(word), "`{word}` is missing: {}", lines[0]);
    }
    assert_eq!(listing(folder), before, "{arguments:?}");
}

/// Asserts that `phylux run` refuses a scene with these words.
pub fn bad_scene(scene: &str, files: &[(&str, &str)], words: &[&str]) {
    let scene = TestScene::new(scene, files);
    refused(scene.path("").as_path(), &["run", "scene.json"], words);
}

/// Returns the correct scene with these top-level entries in place of its own.
fn scene(entries: &[(&str, &str)]) -> String {
    let sound =
        [("materials", MATERIALS), ("objects", OBJECTS), ("lights", LIGHTS), ("captors", CAPTORS)];
    let kept = sound.iter().filter(|(key, _)| entries.iter().all(|(other, _)| other != key));
    let all = kept.chain(entries).map(|(key, value)| format!("\"{key}\": {value}"));
    format!("{{\n{}\n}}", all.collect::<Vec<_>>().join(",\n"))
}

const FILES: &[(&str, &str)] = &[("a.obj", OBJ), ("a.csv", CSV)];

/// A scene to be refused, which differs from the correct one in a single entry: the key, the value,
/// and words of the message.
type Row<'a> = (&'a str, &'a str, &'a [&'a str]);

fn refuse_rows(rows: &[Row]) {
    for (key, value, words) in rows {
        let start = ["error: scene.json: "];
        bad_scene(&scene(&[(key, value)]), FILES, &[&start, *words].concat());
    }
}

#[test]
fn the_sound_scene_runs() {
    let folder = TestScene::new(&scene(&[]), FILES);
    let output = phylux(&folder.path(""), &["run", "scene.json", "--photons", "1000"]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    assert_eq!(listing(&folder.path("")), ["a.csv", "a.obj", "results.json", "scene.json"]);
}

#[test]
fn broken_json() {
    let deep = format!("{}1{}", "[".repeat(100_000), "]".repeat(100_000));
    let long = format!("{{\"name\": \"{}\", \"x\": 1}}", "x".repeat(1_000_000));
    let rows: &[(&str, &[&str])] = &[
        ("", &["scene.json: is empty; it must be a JSON file"]),
        (" \n\t ", &["scene.json: is empty"]),
        ("{", &["line 1, column 1: EOF while parsing an object; close every bracket"]),
        ("{\n \"name\": \"x\",\n}", &["line 3, column 1: trailing comma; delete the comma"]),
        ("{\n \"name\" \"x\"\n}", &["line 2, column 9: expected `:`; correct"]),
        ("{\"a\": NaN}", &["line 1, column 7: expected value; write a finite number"]),
        ("{\"a\": Infinity}", &["line 1, column 7: expected value; write a finite number"]),
        ("{\"a\": -Infinity}", &["line 1, column 8: invalid number; write a finite number"]),
        ("{\"a\": nan}", &["line 1, column 8: expected ident; write a finite number, true, false"]),
        ("{\"a\": 1e999}", &["line 1, column 11: number out of range; numbers are at most"]),
        ("{\"a\": +1}", &["line 1, column 7: expected value", "no leading +"]),
        ("{\"a\": .5}", &["line 1, column 7: expected value; correct the JSON"]),
        ("// my scene\n{}", &["line 1, column 1: expected value; the file must be JSON"]),
        ("{'a': 1}", &["line 1, column 2: key must be a string; JSON has double quotes only"]),
        ("{} {}", &["line 1, column 4: trailing characters; the file must end"]),
        ("{\"a\": \"\u{1}\"}", &["line 1, column 8: control character"]),
        ("{\"a\": 1, \"a\": 2}", &["line 1, column 16: the key `a` stands here twice; delete one"]),
        ("{\"x\": [{\"y\": {\"a\": 1,\n\"a\": 1}}]}", &["line 2", "`a` stands here twice"]),
        (&deep, &["line 1, column 128: recursion limit exceeded; nothing needs to be nested so"]),
        (&long, &["scene.json: /x: unknown key `x`", "lights"]),
        ("[]", &["scene.json: an array, must be an object"]),
        ("\"scene\"", &["scene.json: \"scene\", must be an object"]),
        ("null", &["scene.json: null, must be an object"]),
        ("v 0 0 0\nf 1 2 3", &["line 1, column 1: expected value"]),
        ("<xml/>", &["line 1, column 1: expected value"]),
    ];
    for (text, words) in rows {
        bad_scene(text, &[], words);
    }
    let binary = TestScene::new("", &[]);
    for bytes in [
        &b"\x7fELF\x02\x01\0\0"[..],
        b"\x89PNG\r\n\x1a\n",
        b"\xff\xfe{\0}\0",
        b"{\"name\": \"\xfc\"}",
    ] {
        fs::write(binary.path("scene.json"), bytes).expect("scene.json");
        refused(&binary.path(""), &["run", "scene.json"], &["scene.json: "]);
    }
    refused(&binary.path(""), &["run", "scene.json"], &["is not text: byte 10 is not UTF-8"]);
}

#[test]
fn keys_and_types() {
    refuse_rows(&[
        ("bnads", "[]", &["/bnads: unknown key `bnads`; did you mean `bands`?", "sums"]),
        ("Lights", "[]", &["/Lights: unknown key `Lights`; did you mean `lights`?"]),
        (
            "sun",
            "{}",
            &[
                "/sun: unknown key `sun`; a light with `\"type\": \"sun\"` stands in the scene's list `lights` (keys here: name",
            ],
        ),
        ("sky", "{}", &["/sky: unknown key `sky`; a light with `\"type\": \"sky\"` stands in"]),
        ("tolerance", "0.1", &["/tolerance: unknown key", "a key of the scene's `settings`"]),
        (
            "settings",
            r#"{"layers": 1}"#,
            &["/settings/layers: unknown", "a key of the scene itself"],
        ),
        ("camera", r#"{"photons": 1}"#, &["/camera/photons: unknown", "the scene's `settings`"]),
        (
            "lights",
            r#"[{"type": "spot", "intensity": "a.ies"}]"#,
            &["/lights/0/intensity: unknown", "is its `photometry`"],
        ),
        ("endless", "true", &["/endless: unknown key `endless`"]),
        ("a\\n\\u001bb", "1", &["unknown key `a\\n\\u{1b}b`"]),
        ("name", "5", &["/name: 5, must be a string"]),
        ("unit", "\"km\"", &["/unit: unknown value `km`", "m, cm, mm"]),
        ("unit", "1000", &["/unit: a number, must be one of m, cm, mm"]),
        ("quantity", "\"lux\"", &["/quantity: unknown value `lux`", "W, umol/s"]),
        ("lights", "{}", &["/lights: an object, must be an array"]),
        ("lights", "[[0, 0, 1]]", &["/lights/0: an array, must be an object"]),
        (
            "lights",
            r#"[{"position": [0, 0, 1], "power": 1}]"#,
            &["/lights/0: has no `type`", "point, spot, tube, area"],
        ),
        (
            "lights",
            r#"[{"type": "moon"}]"#,
            &["/lights/0/type: unknown type `moon`", "area, rad, sun, sky, environment"],
        ),
        (
            "lights",
            r#"[{"type": "pointt"}]"#,
            &["/lights/0/type: unknown type `pointt` (did you mean `point`?)"],
        ),
        ("lights", r#"[{"type": 1}]"#, &["/lights/0/type: must be one of point"]),
        (
            "lights",
            r#"[{"type": "point", "position": [0, 0, 1], "intensity": {}}]"#,
            &["/lights/0/intensity: unknown key `intensity`"],
        ),
        (
            "lights",
            r#"[{"type": "point", "power": 1}]"#,
            &["/lights/0: missing key `position`; add it"],
        ),
        (
            "lights",
            r#"[{"type": "point", "position": [0, 1], "power": 1}]"#,
            &["/lights/0/position: 2 entries, must be 3"],
        ),
        (
            "lights",
            r#"[{"type": "point", "position": [0, 1, 2, 3], "power": 1}]"#,
            &["/lights/0/position: 4 entries, must be 3"],
        ),
        (
            "lights",
            r#"[{"type": "point", "position": [0, "a", 2], "power": 1}]"#,
            &["/lights/0/position/1: \"a\", must be a number"],
        ),
        (
            "lights",
            r#"[{"type": "point", "position": [0, null, 2], "power": 1}]"#,
            &["/lights/0/position/1: null, must be a number"],
        ),
        (
            "lights",
            r#"[{"type": "point", "position": [0, 0, 2], "power": "1 W"}]"#,
            &["/lights/0/power: \"1 W\", must be a number, or an array"],
        ),
        (
            "objects",
            r#"[{"obj": "a.obj", "material": "wall", "captor": "yes"}]"#,
            &["/objects/0/captor: \"yes\", must be true, false, \"triangle\" or \"instance\""],
        ),
        (
            "objects",
            r#"[{"obj": "a.obj", "material": "wall", "transform": [1, 2, 3]}]"#,
            &["/objects/0/transform: an array, must be an object"],
        ),
        (
            "objects",
            r#"[{"obj": "a.obj", "material": "wall", "instances": [[0, 0, 1]]}]"#,
            &["/objects/0/instances/0: an array, must be an object"],
        ),
        (
            "objects",
            r#"[{"obj": "a.obj", "material": "wall", "transform": {"rotate": 3}}]"#,
            &["/objects/0/transform/rotate: unknown key `rotate`; did you mean `rotate_deg`?"],
        ),
        (
            "objects",
            r#"[{"obj": "a.obj", "material": "wall", "captr": true}]"#,
            &["/objects/0/captr: unknown key `captr`; did you mean `captor`?"],
        ),
        ("objects", r#"[{"name": "x"}]"#, &["/objects/0: missing key `obj`"]),
        ("materials", "[]", &["/materials: an array, must be an object"]),
        (
            "materials",
            r#"{"a/b": {"type": "lambert"}}"#,
            &["/materials/a~1b: missing key `reflectance`; add it"],
        ),
        (
            "materials",
            r#"{"a": {"type": "lambert", "reflectance": 0.5, "colour": 1}}"#,
            &["/materials/a/colour: unknown key `colour`", "reflectance"],
        ),
        (
            "captors",
            r#"[{"disc": [[0, 0, 1], [0, 0, 1], 1]}]"#,
            &["/captors/0/disc: an array, must be an object"],
        ),
        (
            "captors",
            r#"[{"csv": "a.csv", "sides": "back"}]"#,
            &["/captors/0/sides: unknown value `back`", "front, both"],
        ),
        (
            "settings",
            r#"{"photons": "many"}"#,
            &["/settings/photons: \"many\", must be a whole number"],
        ),
        ("settings", r#"{"photons": 1.5}"#, &["/settings/photons: 1.5, must be a whole number"]),
        (
            "settings",
            r#"{"seed": -1}"#,
            &["/settings/seed: -1, must be a whole number, at least 0"],
        ),
        (
            "settings",
            r#"{"estimator": "backwards"}"#,
            &["/settings/estimator: unknown value `backwards`", "photons", "paths"],
        ),
        ("settings", "[1000]", &["/settings: an array, must be an object"]),
    ]);
}

#[test]
fn bands() {
    refuse_rows(&[
        ("bands", "[]", &["/bands: 0 bands, must be 1 to 4096; leave it out for a single band"]),
        ("bands", r#"[{"name": "a"}, {"name": "a"}]"#, &["/bands/1: a second band named `a`"]),
        (
            "bands",
            r#"[{"name": "a", "from_nm": 700, "to_nm": 400}]"#,
            &["/bands/0: from_nm = 700 is not below to_nm = 400; swap"],
        ),
        (
            "bands",
            r#"[{"name": "a", "from_nm": 400, "to_nm": 400}]"#,
            &["/bands/0: from_nm = 400 is not below"],
        ),
        (
            "bands",
            r#"[{"name": "a", "from_nm": -1}]"#,
            &["/bands/0/from_nm: -1, must be at least 0"],
        ),
        ("bands", r#"[{"from_nm": 1}]"#, &["/bands/0: missing key `name`"]),
        ("bands", r#"[["PAR", 400, 700]]"#, &["/bands/0: an array, must be an object"]),
        (
            "sums",
            r#"{"all": ["all"]}"#,
            &["/sums/all: a band has this name too; give the sum another"],
        ),
        ("sums", r#"{"s": []}"#, &["/sums/s: adds up no band"]),
        ("sums", r#"{"s": ["al"]}"#, &["/sums/s/0: no band `al`; did you mean `all`?"]),
        ("sums", r#"{"s": ["all", "all"]}"#, &["/sums/s: `all` stands here twice"]),
        (
            "materials",
            r#"{"wall": {"type": "lambert", "reflectance": [0.5, 0.5]}}"#,
            &[
                "/materials/wall/reflectance: 2 numbers for 1 band; give one number, or one per band",
            ],
        ),
        (
            "lights",
            r#"[{"type": "point", "position": [0, 0, 1], "power": []}]"#,
            &["/lights/0/power: 0 numbers for 1 band"],
        ),
    ]);
}

#[test]
fn materials() {
    let rows: &[(&str, &[&str])] = &[
        (
            r#"{"type": "lambert", "reflectance": 1.5}"#,
            &["/reflectance: 1.5, must be from 0 to 1; 75 % is 0.75"],
        ),
        (
            r#"{"type": "lambert", "reflectance": 75}"#,
            &["/reflectance: 75, must be from 0 to 1; 75 % is 0.75"],
        ),
        (
            r#"{"type": "lambert", "reflectance": [-0.1]}"#,
            &["/reflectance/0: -0.1, must be from 0 to 1"],
        ),
        (r#"{"type": "mirror", "reflectance": 1.0001}"#, &["/reflectance: 1.0001, must be"]),
        (
            r#"{"type": "leaf", "reflectance": 0.6, "transmittance": 0.5}"#,
            &[": reflectance + transmittance = 1.1000, must be at most 1; lower one of them"],
        ),
        (
            r#"{"type": "leaf", "reflectance": 0, "transmittance": 0.99}"#,
            &[": reflectance (of the cuticle alone) + transmittance = 1.0207"],
        ),
        (
            r#"{"type": "leaf", "reflectance": 0.1, "transmittance": 0.1, "back": {"reflectance": 0.95}}"#,
            &[": back: reflectance + transmittance = 1.0500"],
        ),
        (
            r#"{"type": "leaf", "reflectance": 0.1, "transmittance": 0.1, "back": {"reflectanse": 0.95}}"#,
            &["/back/reflectanse: unknown key", "did you mean `reflectance`?"],
        ),
        (
            r#"{"type": "leaf", "reflectance": 0.1}"#,
            &[
                ": a thin leaf has no `transmittance`; give it as an integrating sphere measures it, or what the leaf is made of (`prospect`)",
            ],
        ),
        (
            r#"{"type": "leaf", "reflectance": 0.1, "transmittance": 0.1, "tint": 1}"#,
            &["/tint: only a solid leaf"],
        ),
        (
            r#"{"type": "leaf", "thin": false, "reflectance": 0.1}"#,
            &["/reflectance: a solid leaf (thin: false)"],
        ),
        (
            r#"{"type": "leaf", "thin": false, "transmittance": 0.1}"#,
            &["/transmittance: a solid leaf"],
        ),
        (r#"{"type": "leaf", "thin": false, "back": {}}"#, &["/back: a solid leaf"]),
        (
            r#"{"type": "leaf", "reflectance": 0.1, "transmittance": 0.1, "ior": 0.9}"#,
            &[": ior = 0.9, must be from 1 to 1000"],
        ),
        (
            r#"{"type": "transparent", "ior": 0}"#,
            &[": ior = 0, must be from 1 to 1000; water has 1.33"],
        ),
        (r#"{"type": "transparent", "ior": 1e300}"#, &[": ior = ", "must be from 1 to 1000"]),
        (r#"{"type": "transparent"}"#, &[": missing key `ior`"]),
        (r#"{"type": "transparent", "ior": 1.5, "tint": 2}"#, &["/tint: 2, must be from 0 to 1"]),
        (
            r#"{"type": "phong", "reflectance": 0.5, "specular": 0.4, "transmittance": 0.2}"#,
            &[": reflectance + specular + transmittance = 1.1000, must be at most 1"],
        ),
        (r#"{"type": "phong", "reflectance": -0.5}"#, &["/reflectance: -0.5, must be from 0 to 1"]),
        (
            r#"{"type": "phong", "specular": 0.5, "exponent": -1}"#,
            &["/exponent: -1, must be from 0 to"],
        ),
        (
            r#"{"type": "phong", "specular": 0.5, "exponent": 1e300}"#,
            &["/exponent: ", "must be from 0 to"],
        ),
        (
            r#"{"type": "wood"}"#,
            &["/type: unknown type `wood`", "lambert, transparent, leaf, phong, mirror"],
        ),
        (r#""wall.mtl""#, &[": \"wall.mtl\", must be an object"]),
    ];
    for (material, words) in rows {
        let materials = format!(r#"{{"w": {material}}}"#);
        let place = "error: scene.json: /materials/w";
        bad_scene(&scene(&[("materials", &materials)]), FILES, &[&[place], *words].concat());
    }
}

#[test]
fn lights() {
    let rows: &[(&str, &[&str])] = &[
        (
            "",
            &[
                "/lights: the scene has no light; add a light: point, spot, tube, area, sun, sky or environment",
            ],
        ),
        (
            r#"{"type": "point", "position": [0, 0, 1], "power": -1}"#,
            &["/lights/0/power: -1, must be at least 0"],
        ),
        (
            r#"{"type": "point", "position": [0, 0, 1], "power": 1e300}"#,
            &["/lights/0", "1e300", "1e30"],
        ),
        (
            r#"{"type": "point", "position": [0, 0, 1], "radiance": 1}"#,
            &["/lights/0/radiance: unknown key `radiance`"],
        ),
        (
            r#"{"type": "point", "position": [0, 0, 1e300], "power": 1}"#,
            &["half of the diagonal", "check the unit, transforms and coordinates"],
        ),
        (
            r#"{"name": "a", "type": "point", "position": [0, 0, 1], "power": 1}, {"name": "a", "type": "point", "position": [0, 0, 1], "power": 1}"#,
            &["/lights/1: a second light named `a`"],
        ),
        (
            r#"{"name": "light1", "type": "point", "position": [0, 0, 1], "power": 1}, {"type": "point", "position": [0, 0, 1], "power": 1}"#,
            &["/lights/1: a second light named `light1`"],
        ),
        (
            r#"{"type": "spot", "position": [0, 0, 1], "direction": [0, 0, 0], "half_angle_deg": 30, "power": 1}"#,
            &["/lights/0/direction: a direction of length 0", "[0, 0, -1] is down"],
        ),
        (
            r#"{"type": "spot", "position": [0, 0, 1], "direction": [0, 0, 1], "half_angle_deg": 0, "power": 1}"#,
            &["/lights/0/half_angle_deg: 0, must be above 0 and at most 180"],
        ),
        (
            r#"{"type": "spot", "position": [0, 0, 1], "direction": [0, 0, 1], "half_angle_deg": 181, "power": 1}"#,
            &["/lights/0/half_angle_deg: 181, must be"],
        ),
        (
            r#"{"type": "spot", "position": [0, 0, 1], "direction": [0, 0, 1], "half_angle_deg": -30, "power": 1}"#,
            &["/lights/0/half_angle_deg: -30, must be"],
        ),
        (
            r#"{"type": "spot", "position": [0, 0, 1], "direction": [0, 0, 1], "power": 1}"#,
            &["/lights/0: missing key `half_angle_deg`"],
        ),
        (
            r#"{"type": "tube", "from": [0, 0, 1], "to": [0, 0, 1], "radius": 0.1, "power": 1}"#,
            &["/lights/0: a tube of length 0: `from` is `to`"],
        ),
        (
            r#"{"type": "tube", "from": [0, 0, 1], "to": [0, 1, 1], "radius": -0.1, "power": 1}"#,
            &["/lights/0/radius: -0.1, must be at least 0"],
        ),
        (
            r#"{"type": "tube", "from": [0, 0, 1], "to": [0, 1, 1], "radius": 0.1, "power": 1, "emission": "isotropic"}"#,
            &["/lights/0/emission: only a line (radius 0) is isotropic"],
        ),
        (
            r#"{"type": "tube", "from": [0, 0, 1], "to": [0, 1, 1], "radius": 0.1, "power": 1, "emission": "uniform"}"#,
            &["/lights/0/emission: unknown value `uniform`", "lambert, isotropic"],
        ),
        (
            r#"{"type": "tube", "from": [0, 0, 1], "to": [0, 1, 1], "radius": 0, "power": 1, "material": "wall"}"#,
            &["/lights/0/material: a line (radius 0) has no surface"],
        ),
        (
            r#"{"type": "tube", "from": [0, 0, 1], "to": [0, 1, 1], "radius": 0.1, "power": 1, "material": "wal"}"#,
            &["/lights/0/material: no material `wal` in the scene; did you mean `wall`?"],
        ),
        (
            r#"{"type": "area", "vertices": [[0,0,2],[1,0,2],[1,1,2]], "power": 1, "radiance": 1}"#,
            &["/lights/0: both `power` and `radiance`; give exactly one"],
        ),
        (
            r#"{"type": "area", "vertices": [[0,0,2],[1,0,2],[1,1,2]]}"#,
            &["/lights/0: neither `power` nor `radiance`; give exactly one"],
        ),
        (
            r#"{"type": "area", "vertices": [[0,0,2],[1,0,2],[1,1,2]], "radiance": -1}"#,
            &["/lights/0/radiance: -1, must be at least 0"],
        ),
        (
            r#"{"type": "area", "vertices": [[0,0,2],[1,0,2]], "power": 1}"#,
            &["/lights/0/vertices: 2 corners, must be 3 to 10000"],
        ),
        (
            r#"{"type": "area", "vertices": [[0,0,2],[1,0,2],[2,0,2]], "power": 1}"#,
            &["/lights/0: an area light without area"],
        ),
        (
            r#"{"type": "area", "vertices": [[0,0,2],[1,0,2],[1,1,2]], "obj": "a.obj", "power": 1}"#,
            &["/lights/0: both `vertices` and `obj`"],
        ),
        (r#"{"type": "area", "power": 1}"#, &["/lights/0: neither `vertices` nor `obj`"]),
        (
            r#"{"type": "area", "vertices": [[0,0,2],[1,0,2],[1,1,2]], "transform": {}, "power": 1}"#,
            &["/lights/0/transform: goes with `obj` only"],
        ),
        (
            r#"{"type": "area", "obj": "b.obj", "power": 1}"#,
            &["/lights/0/obj: b.obj: there is no such file"],
        ),
        (
            r#"{"type": "area", "obj": "a.obj", "transform": {"scale": 1e-9}, "power": 1}"#,
            &["light `light0`", "drowns in the rounding"],
        ),
    ];
    for (light, words) in rows {
        bad_scene(&scene(&[("lights", &format!("[{light}]"))]), FILES, words);
    }
}

#[test]
fn objects() {
    refuse_rows(&[
        (
            "objects",
            r#"[{"obj": "a.obj", "material": "wal"}]"#,
            &["/objects/0/material: no material `wal` in the scene; did you mean `wall`?"],
        ),
        (
            "objects",
            r#"[{"obj": "a.obj", "material": "xxxxxxxx"}]"#,
            &["no material `xxxxxxxx` in the scene; there are wall"],
        ),
        ("objects", r#"[{"obj": "", "material": "wall"}]"#, &["/objects/0/obj: no file name"]),
        (
            "objects",
            r#"[{"obj": "a.obj", "material": "wall", "instances": []}]"#,
            &["/objects/0/instances: an empty list; leave it out for one copy"],
        ),
        (
            "objects",
            r#"[{"obj": "a.obj", "material": "wall", "transform": {"scale": 0}}]"#,
            &["/objects/0/transform/scale: 0, must be above 0"],
        ),
        (
            "objects",
            r#"[{"obj": "a.obj", "material": "wall", "transform": {"scale": -1}}]"#,
            &["/objects/0/transform/scale: -1, must be above 0; a mirrored copy"],
        ),
        (
            "objects",
            r#"[{"obj": "a.obj", "material": "wall", "transform": {"scale": [1, 1, 2]}}]"#,
            &["/objects/0/transform/scale: an array, must be a number"],
        ),
        (
            "objects",
            r#"[{"obj": "a.obj", "material": "wall", "instances": [{"scale": -2}]}]"#,
            &["/objects/0/instances/0/scale: -2, must be above 0"],
        ),
        (
            "objects",
            r#"[{"obj": "a.obj", "material": "wall", "transform": {"scale": 1e300}}]"#,
            &["check the unit, transforms and coordinates"],
        ),
        (
            "objects",
            r#"[{"obj": "a.obj", "material": "wall", "transform": {"translate": [1e308, 1e308, 1e308], "scale": 1e308}}]"#,
            &["check the unit, transforms and coordinates"],
        ),
        (
            "objects",
            r#"[{"name": "a", "obj": "a.obj", "material": "wall", "captor": true}, {"name": "a", "obj": "a.obj", "material": "wall", "captor": true}]"#,
            &[
                "/objects/1: a second captor entry or captor object named `a`; give one of them a `name`",
            ],
        ),
    ]);
    let rows: &[(&str, &[&str])] = &[
        ("", &["a.obj: is empty"]),
        ("v 0 0 0\n", &["a.obj: holds no face (1 vertices)"]),
        ("\0\u{1}\u{2}", &["a.obj: is not UTF-8 text but binary"]),
        ("v 0 0 nan\n", &["a.obj:1: `nan` is not a finite number"]),
        ("v 0 0 inf\n", &["a.obj:1: `inf` is not a finite number"]),
        (
            "v 0 0 0\nv 1 0 0\nf 1 2 3\n",
            &["a.obj:3: corner 3, but only 2 vertices stand before this face"],
        ),
        ("v 0 0 0\nv 1 0 0\nf 0 1 2\n", &["a.obj:3: corner 0 does not exist"]),
        (
            "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2\n",
            &["a.obj:4: face of 2 corners, must have at least 3"],
        ),
        ("{\"name\": 1}", &["a.obj:1: unknown word"]),
    ];
    for (obj, words) in rows {
        bad_scene(&scene(&[]), &[("a.obj", obj)], words);
    }
    bad_scene(
        &scene(&[]),
        &[],
        &[
            "scene.json: /objects/0/obj: a.obj: there is no such file",
            "paths are relative to the file that names them",
        ],
    );
    let folder = scene(&[("objects", r#"[{"obj": ".", "material": "wall"}]"#)]);
    bad_scene(&folder, &[], &["is a directory, not a file"]);
}

#[test]
fn mtl_files() {
    let obj = |head: &str| format!("{head}v 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl soil\nf 1 2 3\n");
    let objects = r#"[{"obj": "a.obj", "captor": true}]"#;
    let named = obj("mtllib a.mtl\n");
    let bare = scene(&[("objects", objects)]);
    bad_scene(
        &bare,
        &[("a.obj", OBJ)],
        &["a.obj:4: a face without `usemtl`; name its material there, or give the object"],
    );
    bad_scene(&bare, &[("a.obj", &obj(""))], &["a.obj:5: no material `soil`; there are wall"]);
    bad_scene(
        &bare,
        &[("a.obj", &named)],
        &["a.obj:6: no material `soil` (a.mtl: there is no such file)"],
    );
    let mtl = |text: &str, words: &[&str]| {
        bad_scene(&bare, &[("a.obj", &named), ("a.mtl", text)], words);
    };
    mtl("", &["a.obj:6: no material `soil`; there are wall"]);
    mtl(
        "newmtl sol\nKd 1 1 1\nnewmtl leaf\n",
        &["a.obj:6: no material `soil`; did you mean `sol`?", "wall, sol, leaf"],
    );
    mtl(
        "newmtl soil\nillum 1\nKd 2 0 0\n",
        &["a.mtl:1: Kd = 2 of material soil, must be from 0 to 1"],
    );
    mtl(
        "newmtl soil\nillum 1\nKd -1 0 0\n",
        &["a.mtl:3: material `soil`: Kd holds `-1`, must be a finite number, not negative"],
    );
    mtl("newmtl soil\nillum 1\nKd nan 0 0\n", &["a.mtl:3: material `soil`: Kd holds `nan`"]);
    mtl(
        "newmtl soil\nillum 7\nNi 0.5\n",
        &["a.mtl:1: material soil: ior = 0.5, must be from 1 to 1000"],
    );
    mtl(
        "newmtl soil\nillum 2\nKd .9 .9 .9\nKs .2 .2 .2\n",
        &[
            "a.mtl:1: material soil: reflectance + specular + transmittance = 1.1000",
            "or give the scene a material of this name",
        ],
    );
    mtl(
        "newmtl soil\nillum 6\nKd .9 .9 .9\nTf .2 .2 .2\n",
        &["a.mtl:1: material soil: reflectance + transmittance = 1.1000"],
    );
    mtl(
        "newmtl soil\nKd .1 .1 .1\nnewmtl soil\nKd .2 .2 .2\n",
        &["a.mtl:3: `soil` stands at a.mtl:1 too, otherwise"],
    );
    let two = scene(&[("objects", objects), ("bands", r#"[{"name": "a"}, {"name": "b"}]"#)]);
    bad_scene(
        &two,
        &[("a.obj", &named), ("a.mtl", "newmtl soil\nillum 1\nKd .1 .1 .1\n")],
        &[
            "a.mtl:1: material soil has r, g, b, the scene has 2 bands; give the scene a material `soil` in /materials",
        ],
    );
}

#[test]
fn captors() {
    refuse_rows(&[
        (
            "captors",
            r#"[{}]"#,
            &["/captors/0: has none of `csv`, `obj`, `disc`, `sphere`, `grid` and `line`"],
        ),
        (
            "captors",
            r#"[{"name": "x"}]"#,
            &["/captors/0: has none of `csv`, `obj`, `disc`, `sphere`, `grid` and `line`"],
        ),
        (
            "captors",
            r#"[{"name": "b", "csv": "a.csv", "obj": "a.obj"}]"#,
            &["/captors/0: must have exactly one of"],
        ),
        (
            "captors",
            r#"[{"disc": {"center": [0, 0, 0], "normal": [0, 0, 1], "radius": 1}}]"#,
            &["/captors/0: a disc without `name`; give it a name"],
        ),
        (
            "captors",
            r#"[{"name": "p", "disc": {"center": [0, 0, 0], "normal": [0, 0, 1], "radius": 0}}]"#,
            &["/captors/0/disc/radius: 0, must be above 0"],
        ),
        (
            "captors",
            r#"[{"name": "p", "disc": {"center": [0, 0, 0], "normal": [0, 0, 1], "radius": -1}}]"#,
            &["/captors/0/disc/radius: -1, must be above 0"],
        ),
        (
            "captors",
            r#"[{"name": "p", "disc": {"center": [0, 0, 0], "normal": [0, 0, 0], "radius": 1}}]"#,
            &["/captors/0/disc/normal: a normal of length 0"],
        ),
        (
            "captors",
            r#"[{"name": "p", "disc": {"center": [0, 0, 0], "normal": [0, 0, 1], "radius": 1e-12}}]"#,
            &["captor `p`", "drowns in the rounding"],
        ),
        (
            "captors",
            r#"[{"name": "p", "disc": {"center": [1e12, 0, 0], "normal": [0, 0, 1], "radius": 1}}]"#,
            &["half of the diagonal"],
        ),
        (
            "captors",
            r#"[{"csv": "a.csv"}, {"csv": "a.csv"}]"#,
            &[
                "/captors/0: a second captor entry or captor object named `a`; give one of them a `name`",
            ],
        ),
        (
            "captors",
            r#"[{"name": "a/a", "disc": {"center": [0, 0, 0], "normal": [0, 0, 1], "radius": 1}}]"#,
            &["/captors/0", "a second captor with the id `a/a`"],
        ),
        ("captors", r#"[{"csv": ""}]"#, &["/captors/0/csv: no file name"]),
        ("captors", r#"[{"obj": ""}]"#, &["/captors/0/obj: no file name"]),
    ]);
    let csv = scene(&[("captors", r#"[{"csv": "grid.csv"}]"#)]);
    let rows: &[(&str, &[&str])] = &[
        ("", &["grid.csv: is empty"]),
        ("x,y,z,radius,nx,ny,nz\n", &["grid.csv: holds no captor row"]),
        ("x,y,z,r,nx,ny,nz\n0,0,1,1,0,0,1\n", &["grid.csv:1: unknown column `r`"]),
        ("x,y,z,radius,nx,ny\n0,0,1,1,0,0\n", &["grid.csv:1: column nz missing"]),
        (
            "x;y;z;radius;nx;ny;nz\n0;0;1;1;0;0;1\n",
            &["grid.csv:1: the columns are separated by semicolons"],
        ),
        ("x,y,z,radius,nx,ny,nz\n0,0,1,0,0,0,1\n", &["grid.csv:2: radius is 0, must be above 0"]),
        ("x,y,z,radius,nx,ny,nz\n0,0,1,-2,0,0,1\n", &["grid.csv:2: radius is -2"]),
        ("x,y,z,radius,nx,ny,nz\n0,0,1,1,0,0,0\n", &["grid.csv:2: the normal is 0,0,0"]),
        (
            "x,y,z,radius,nx,ny,nz\n0,nan,1,1,0,0,1\n",
            &["grid.csv:2: y is `nan`, not a finite number"],
        ),
        (
            "x,y,z,radius,nx,ny,nz\n0,inf,1,1,0,0,1\n",
            &["grid.csv:2: y is `inf`, not a finite number"],
        ),
        (
            "x,y,z,radius,nx,ny,nz,id\n0,0,1,1,0,0,1,a\n0,0,1,1,0,0,1,a\n",
            &["grid.csv:3: id `a` stands in line 2 too"],
        ),
        ("\u{7f}ELF\0\u{1}", &["grid.csv:1: "]),
    ];
    for (text, words) in rows {
        bad_scene(&csv, &[("a.obj", OBJ), ("grid.csv", text)], words);
    }
    bad_scene(
        &csv,
        FILES,
        &["/captors/0/csv: grid.csv: there is no such file; paths are relative"],
    );
    let none = scene(&[("objects", r#"[{"obj": "a.obj", "material": "wall"}]"#)]);
    bad_scene(&none, FILES, &["scene.json: /captors: the scene has no captor", "\"captor\": true"]);
    let flat = scene(&[("captors", r#"[{"obj": "b.obj"}]"#)]);
    let files = [("a.obj", OBJ), ("b.obj", "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n")];
    bad_scene(&flat, &files, &["b.obj: captor `b` has no area"]);
}

#[test]
fn settings_and_camera() {
    let rows: &[(&str, &[&str])] = &[
        (r#"{"photons": 0}"#, &["photons: 0 photons, must be 1 to 1e15"]),
        (r#"{"photons": 1e300}"#, &["photons: ", "must be at most 9e15"]),
        (r#"{"photons": 1e16}"#, &["photons: 1e16, must be at most 9e15"]),
        (r#"{"photons": -5}"#, &["photons: -5, must be a whole number, at least 0"]),
        (r#"{"seed": 1.5}"#, &["seed: 1.5, must be a whole number"]),
        (r#"{"seed": 18446744073709551616}"#, &["seed: ", "must be a whole number"]),
        (r#"{"k": 1}"#, &["k: k = 1, must be 0 (no k-nearest estimate) or at least 2"]),
        (r#"{"k": -5}"#, &["k: -5, must be a whole number, at least 0"]),
        (r#"{"map_photons": 1e12}"#, &["map_photons: 1000000000000 arrivals, must be at most 1e9"]),
        (
            r#"{"splitting": 8}"#,
            &["/settings/splitting: photons are no longer split", "`guiding` says whether"],
        ),
        (r#"{"guiding": "on"}"#, &["guiding", "aim"]),
        (r#"{"tolerance": 0}"#, &["tolerance: 0, must be between 0 and 1; 1 % is 0.01"]),
        (r#"{"tolerance": 1}"#, &["tolerance: 1, must be between"]),
        (r#"{"tolerance": "3%"}"#, &["must be a number (3 % is 0.03)"]),
        (r#"{"tolerance": 3}"#, &["tolerance: 3, must be between 0 and 1; 3 % is 0.03"]),
        (r#"{"tolerance": -1}"#, &["tolerance: -1, must be between"]),
        (r#"{"tolerance": "nan"}"#, &["tolerance: \"nan\", must be a number"]),
        (r#"{"max_time": 0}"#, &["max_time: 0 s, must be above 0 and below 1e19 s"]),
        (r#"{"max_time": -1}"#, &["max_time: -1 s, must be"]),
        (r#"{"max_time": 1e300}"#, &["max_time: ", "must be"]),
        (r#"{"threads": 1e9}"#, &["threads: 1000000000 threads, must be at most 1024"]),
        (r#"{"threads": -1}"#, &["threads: -1, must be a whole number"]),
        (r#"{"photon": 10}"#, &["photon: unknown key `photon`; did you mean `photons`?"]),
    ];
    for (settings, words) in rows {
        let place = "error: scene.json: /settings/";
        bad_scene(&scene(&[("settings", settings)]), FILES, &[&[place], *words].concat());
    }
    refuse_rows(&[
        ("camera", "{}", &["/camera: missing key `position`"]),
        (
            "camera",
            r#"{"position": [0,0,0], "look_at": [0,0,0]}"#,
            &["/camera: `look_at` is the position itself, or straight along `up`"],
        ),
        (
            "camera",
            r#"{"position": [0,0,0], "look_at": [0,0,1]}"#,
            &["/camera: `look_at` is", "straight along `up`"],
        ),
        (
            "camera",
            r#"{"position": [0,0,0], "look_at": [1,0,0], "up": [0,0,0]}"#,
            &["/camera: `look_at` is", "`up`"],
        ),
        (
            "camera",
            r#"{"position": [0,0,0], "look_at": [1,0,0], "fov_deg": 180}"#,
            &["/camera/fov_deg: 180, must be between 0 and 180"],
        ),
        (
            "camera",
            r#"{"position": [0,0,0], "look_at": [1,0,0], "width": 0}"#,
            &["/camera/width: 0, must be from 1 to 65536"],
        ),
        (
            "camera",
            r#"{"position": [0,0,0], "look_at": [1,0,0], "height": 1e9}"#,
            &["/camera/height: 1000000000, must be from 1 to 65536"],
        ),
        (
            "camera",
            r#"{"position": [0,0,0], "look_at": [1,0,0], "width": 1.5}"#,
            &["/camera/width: 1.5, must be a whole number"],
        ),
    ]);
}

#[test]
fn sizes() {
    let small = "[{\"name\": \"a\", \"obj\": \"a.obj\", \"material\": \"wall\", \"captor\": true, \"transform\": {\"scale\": 1e-30}}]";
    let light = r#"[{"type": "point", "position": [0, 0, 1e-30], "power": 1}]"#;
    bad_scene(
        &scene(&[("objects", small), ("lights", light)]),
        FILES,
        &["half of the diagonal", "must be 1e-6 to 1e9 m"],
    );
    let few = r#"{"photons": 1}"#;
    let lights =
        format!("[{}]", [r#"{"type": "point", "position": [0, 0, 1], "power": 1}"#; 2].join(","));
    bad_scene(
        &scene(&[("settings", few), ("lights", &lights)]),
        FILES,
        &["1 photons for 2 lights", "at least 2"],
    );
}

#[test]
fn command_line() {
    let folder = TestScene::new(&scene(&[]), FILES);
    let rows: &[(&[&str], &[&str])] = &[
        (&[], &[]),
        (&["walk"], &["walk"]),
        (&["run"], &["required"]),
        (&["run", "none.json"], &["none.json: there is no such file"]),
        (&["run", "."], &[".: is a directory, not a file"]),
        (&["check", "none.json"], &["none.json: there is no such file"]),
        (&["run", "scene.json", "extra"], &["extra"]),
        (&["run", "scene.json", "--photns", "5"], &["--photns"]),
        (&["run", "scene.json", "--photons", "0"], &["0 photons, must be 1 to 1e15"]),
        (&["run", "scene.json", "--photons", "-5"], &["must be a whole number"]),
        (&["run", "scene.json", "--photons", "1.5"], &["must be a whole number"]),
        (&["run", "scene.json", "--photons", "many"], &["must be a whole number"]),
        (&["run", "scene.json", "--photons", "1e300"], &["must be"]),
        (&["run", "scene.json", "--photons", "nan"], &["must be a whole number"]),
        (&["run", "scene.json", "--photons", ""], &["must be a whole number"]),
        (&["run", "scene.json", "--photons"], &["--photons"]),
        (&["run", "scene.json", "--seed", "-1"], &["-1", "--seed"]),
        (&["run", "scene.json", "--seed", "1.5"], &["1.5", "--seed"]),
        (
            &["run", "scene.json", "--k", "1"],
            &["k = 1, must be 0 (no k-nearest estimate) or at least 2"],
        ),
        (&["run", "scene.json", "--k", "-1"], &["must be a whole number"]),
        (&["run", "scene.json", "--map-photons", "1e12"], &["must be at most 1e9"]),
        (&["run", "scene.json", "--tolerance", "0"], &["must be between 0 and 1"]),
        (&["run", "scene.json", "--tolerance", "1"], &["must be between 0 and 1"]),
        (&["run", "scene.json", "--tolerance", "-1"], &["must be between 0 and 1"]),
        (&["run", "scene.json", "--tolerance", "nan"], &["must be between 0 and 1"]),
        (&["run", "scene.json", "--tolerance", "3%"], &["must be a number (3 % is 0.03)"]),
        (&["run", "scene.json", "--max-time", "0"], &["must be above 0 and below 1e19 s"]),
        (&["run", "scene.json", "--max-time", "-1"], &["must be above 0 and below 1e19 s"]),
        (&["run", "scene.json", "--max-time", "nan"], &["must be above 0 and below 1e19 s"]),
        (&["run", "scene.json", "--max-time", "inf"], &["must be above 0 and below 1e19 s"]),
        (&["run", "scene.json", "--threads", "1e9"], &["must be at most 1024"]),
        (&["run", "scene.json", "--threads", "-1"], &["must be a whole number"]),
        (&["schema", "book"], &["book"]),
        (
            &["run", "scene.json", "-o", "none/r.json"],
            &["none/r.json: there is no folder none; create it"],
        ),
        (&["run", "scene.json", "-o", "."], &[".: is a directory; name a file in it"]),
        (&["run", "scene.json", "-o", ""], &["--output"]),
        (
            &["run", "scene.json", "-o", "new/"],
            &["new/: cannot be written: it does not name a file"],
        ),
        (&["run", "scene.json", "-o", "a.obj/r.json"], &["a.obj/r.json: "]),
        (&["run", "scene.json", "-o", "scene.json"], &["scene.json: is a file that is read"]),
        (
            &["run", "scene.json", "-o", "./a.obj"],
            &["a.obj: is a file that is read, which the output would replace"],
        ),
        (
            &["run", "scene.json", "--csv", "results.json"],
            &["results.json: is named for two outputs"],
        ),
        (&["run", "scene.json", "--csv", "none/r.csv"], &["none/r.csv: there is no folder none"]),
        (&["run", "scene.json", "--stats", "none/r.csv"], &["none/r.csv: there is no folder none"]),
        (
            &["run", "scene.json", "--per-captor", "none/deep"],
            &["none/deep: there is no folder none"],
        ),
        (&["run", "scene.json", "--per-captor", "a.obj"], &["a.obj: is a file, not a folder"]),
        (&["run", "none.json", "--per-captor", "new"], &["none.json: there is no such file"]),
    ];
    for (arguments, words) in rows {
        if arguments.is_empty() {
            assert_eq!(phylux(&folder.path(""), arguments).status.code(), Some(2));
            continue;
        }
        refused(&folder.path(""), arguments, words);
    }
    let long = "x".repeat(300);
    refused(&folder.path(""), &["run", "scene.json", "-o", &long], &["cannot be written"]);
}
