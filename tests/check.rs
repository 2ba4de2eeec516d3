//! `phylux check`: one small scene for each warning, and similar scenes that must not be warned of.

use std::path::Path;

use phylux::studies::{LeafOptics, SceneSummary};

use crate::{bad_input::phylux, common::TestScene};

/// Returns a scene with a floor of 4 m, a lamp and a sensor above it, and the given additions.
fn scene(materials: &str, objects: &str, captors: &str, files: &[(&str, &str)]) -> TestScene {
    let text = format!(
        r#"{{
            "materials": {{ "ground": {{ "type": "lambert", "reflectance": 0.2 }} {materials} }},
            "objects": [ {{ "obj": "floor.obj", "material": "ground" }} {objects} ],
            "lights": [ {{ "type": "point", "name": "lamp", "position": [0, 0, 3], "power": 10 }} ],
            "captors": [ {{ "name": "sensor", "disc":
                {{ "center": [1.5, 0, 1], "normal": [0, 0, 1], "radius": 0.1 }} }} {captors} ]
        }}"#
    );
    let floor = "v -2 -2 0\nv 2 -2 0\nv 2 2 0\nv -2 2 0\nf 1 2 3 4\n";
    TestScene::new(&text, &[&[("floor.obj", floor)], files].concat())
}

/// The faces of a box with their normals outside. The eight corners are counted backwards, from -8
/// to -1.
const FACES: [&str; 6] = [
    "f -8 -6 -5 -7\n",
    "f -4 -3 -1 -2\n",
    "f -8 -7 -3 -4\n",
    "f -6 -2 -1 -5\n",
    "f -8 -4 -2 -6\n",
    "f -7 -5 -1 -3\n",
];

/// Returns the eight corners of a box, x changing fastest and z slowest.
fn corners(low: [f64; 3], high: [f64; 3]) -> String {
    let pick = |i: usize, axis: usize| if i >> axis & 1 == 0 { low[axis] } else { high[axis] };
    (0..8).map(|i| format!("v {} {} {}\n", pick(i, 0), pick(i, 1), pick(i, 2))).collect()
}

fn block(low: [f64; 3], high: [f64; 3]) -> String {
    corners(low, high) + &FACES.concat()
}

/// Turns the faces of a mesh around: the normals of a box then point inwards.
fn turned(block: &str) -> String {
    let turn = |line: &str| match line.strip_prefix("f ") {
        Some(face) => format!("f {}\n", face.split(' ').rev().collect::<Vec<_>>().join(" ")),
        None => format!("{line}\n"),
    };
    block.lines().map(turn).collect()
}

const CUBE: ([f64; 3], [f64; 3]) = ([-0.5, -0.5, 0.5], [0.5, 0.5, 1.5]);

fn cube() -> String {
    block(CUBE.0, CUBE.1)
}

/// Returns the scene with these faces as glass.
fn glass(obj: &str) -> TestScene {
    scene(
        r#", "glass": { "type": "transparent", "ior": 1.5 }"#,
        r#", { "obj": "glass.obj", "material": "glass" }"#,
        "",
        &[("glass.obj", obj)],
    )
}

fn check(scene: &TestScene) -> SceneSummary {
    check_file(&scene.path("scene.json"))
}

fn check_file(path: &Path) -> SceneSummary {
    let loaded = phylux::load(path).unwrap_or_else(|e| panic!("{e}"));
    phylux::studies::check(&loaded).unwrap_or_else(|e| panic!("{e}"))
}

/// Asserts that there is exactly one warning, and that it contains all `words`.
fn warns(scene: &TestScene, words: &[&str]) {
    let warnings = check(scene).warnings;
    assert_eq!(warnings.len(), 1, "expected {words:?}, found {warnings:#?}");
    for word in words {
        assert!(warnings[0].contains(word), "no {word:?} in {:?}", warnings[0]);
    }
}

fn is_clean(scene: &TestScene) {
    let SceneSummary { warnings, notes, .. } = check(scene);
    assert!(warnings.is_empty() && notes.is_empty(), "{warnings:#?} {notes:#?}");
}

#[test]
fn a_plain_scene_is_summed_up_without_a_warning() {
    let scene = scene("", "", "", &[]);
    is_clean(&scene);
    let summary = check(&scene);
    assert_eq!(summary.size.to_array(), [4.0, 4.0, 3.0]);
    let floor = &summary.surfaces[0];
    assert_eq!((&floor.material[..], floor.triangles, floor.area), ("ground", 2, 16.0));
}

#[test]
fn leaves_are_listed_by_band_with_their_cuticle() {
    // the cuticle of the third leaf reflects more than was measured; the last has none
    let leaves = r#"{
        "bands": [{ "name": "red" }, { "name": "far red" }],
        "materials": {
            "a": { "type": "leaf", "reflectance": [0.08, 0.45], "transmittance": [0.04, 0.40] },
            "b": { "type": "leaf", "reflectance": [0.08, 0.45], "transmittance": [0.04, 0.40],
                   "back": { "reflectance": [0.15, 0.45] } },
            "c": { "type": "leaf", "reflectance": 0, "transmittance": 0.1, "ior": 1.5 },
            "d": { "type": "leaf", "reflectance": [0, 0.5], "transmittance": [0, 0.5], "ior": 1 },
            "ground": { "type": "lambert", "reflectance": 0.2 }
        },
        "objects": [ { "obj": "sheets.obj" } ],
        "lights": [ { "type": "point", "position": [0, 0, 3], "power": 10 } ]
    }"#;
    let sheet = |name: &str, z: usize| {
        format!("v 0 0 {z}\nv 1 0 {z}\nv 1 1 {z}\nv 0 1 {z}\nusemtl {name}\nf -4 -3 -2 -1\n")
    };
    let names = ["a", "b", "c", "d", "ground"];
    let sheets: String = names.iter().enumerate().map(|(z, name)| sheet(name, z)).collect();
    let scene = TestScene::new(leaves, &[("sheets.obj", &sheets)]);
    let found = check(&scene).leaves;
    assert_eq!(found.iter().map(|leaf| &leaf.material[..]).collect::<Vec<_>>(), names[..4]);
    // reflectance, transmittance and absorptance of both bands
    let is = |optics: &LeafOptics, expected: [[f64; 2]; 3]| {
        let LeafOptics { reflectance, transmittance, absorptance } = optics;
        for (of, expected) in [reflectance, transmittance, absorptance].into_iter().zip(expected) {
            let near = of.iter().zip(expected).all(|(found, value)| (found - value).abs() < 2e-6);
            assert!(near && of.len() == 2, "{optics:?}: {expected:?}");
        }
    };
    let front = [[0.08, 0.45], [0.04, 0.40], [0.88, 0.15]];
    is(&found[0].front, front);
    is(&found[1].front, front);
    is(found[1].back.as_ref().unwrap(), [[0.15, 0.45], [0.04, 0.40], [0.81, 0.15]]);
    is(&found[2].front, [[0.04; 2], [0.1; 2], [0.86; 2]]);
    is(&found[3].front, [[0.0, 0.5], [0.0, 0.5], [1.0, 0.0]]);
    assert!([0, 2, 3].iter().all(|&leaf| found[leaf].back.is_none()));

    let output = phylux(&scene.path(""), &["check", "scene.json"]);
    let text = String::from_utf8(output.stdout).unwrap();
    let row = |name: &str| {
        let line = text.lines().find(|line| line.trim_start().starts_with(name));
        line.unwrap_or_else(|| panic!("{name}: {text}")).split_whitespace().collect::<Vec<_>>()
    };
    assert_eq!(row("a absorbs")[2..], ["0.880", "0.150"]);
    assert_eq!(row("b, back, reflects")[3..], ["0.150", "0.450"]);
}

#[test]
fn sound_solids_are_clean() {
    let hollow = cube() + &turned(&block([-0.4, -0.4, 0.6], [0.4, 0.4, 1.4]));
    let filled = hollow.clone() + &block([-0.3, -0.3, 0.7], [0.3, 0.3, 1.3]);
    let apart = cube() + &block([0.501, -0.5, 0.5], [1.0, 0.5, 1.5]);
    let on_floor = block([-0.5, -0.5, 0.0], [0.5, 0.5, 1.0]);
    for obj in [cube(), hollow, filled, apart, on_floor] {
        is_clean(&glass(&obj));
    }
}

#[test]
fn two_tints_of_one_glass_may_share_a_solid() {
    let obj = format!(
        "{}usemtl clear\n{}usemtl dim\n{}",
        corners(CUBE.0, CUBE.1),
        FACES[0],
        FACES[1..].concat()
    );
    let materials = r#", "clear": { "type": "transparent", "ior": 1.5 },
        "dim": { "type": "transparent", "ior": 1.5, "tint": 0.5 }"#;
    is_clean(&scene(materials, r#", { "obj": "glass.obj" }"#, "", &[("glass.obj", &obj)]));
}

#[test]
fn solids_that_are_not_closed() {
    let open = corners(CUBE.0, CUBE.1) + &FACES[1..].concat();
    let at = "`glass` at (0.000, 0.000, 1.000) m";
    warns(&glass(&open), &["not closed", at, "(4 open edges)", "thin"]);
    let one_turned = corners(CUBE.0, CUBE.1) + &turned(FACES[0]) + &FACES[1..].concat();
    warns(&glass(&one_turned), &["opposite sides", at, "(4 edges)", "turn"]);
    let walled = cube() + "f -8 -6 -1 -3\n";
    warns(&glass(&walled), &["not closed", "open edges"]);
}

#[test]
fn solids_that_are_inside_out() {
    warns(&glass(&turned(&cube())), &["solids inside out: `glass` at", "turn their normals"]);
}

#[test]
fn solids_that_touch() {
    let ([x0, y0, z0], [x1, y1, z1]) = CUBE;
    let middle = 0.5 * (x0 + x1);
    for other in [
        // boxes that share a face, without a gap and with a tiny one
        block([x1, y0, z0], [2.0 * x1, y1, z1]),
        block([x1 + 1e-5, y0, z0], [2.0 * x1, y1, z1]),
        // a smaller face on a larger one, and crossed bars
        block([x1, y0 + 0.1, z0 + 0.1], [2.0 * x1, y1 - 0.1, z1 - 0.1]),
        block([-1.0, -0.1, z1], [1.0, 0.1, 1.7]),
        // a box that cuts through, one that overlaps, and the same box twice
        block([-1.0, -0.1, 0.9], [1.0, 0.1, 1.1]),
        block([middle, y0, z0], [2.0 * x1, y1, z1]),
        cube(),
        // boxes that share an edge
        block([x1, y0, z1], [2.0 * x1, y1, z1 + 0.5]),
    ] {
        warns(
            &glass(&(cube() + &other)),
            &["solids that touch or cut", "`glass` at", " and ", "gap above"],
        );
    }
    let water = scene(
        r#", "glass": { "type": "transparent", "ior": 1.5 },
             "water": { "type": "leaf", "thin": false, "ior": 1.33 }"#,
        r#", { "obj": "glass.obj", "material": "glass" }, { "obj": "water.obj", "material": "water" }"#,
        "",
        &[("glass.obj", &cube()), ("water.obj", &block([x0, y0, z1], [x1, y1, 1.7]))],
    );
    warns(
        &water,
        &["solids that touch or cut", "`glass` at", "`water` at (0.000, 0.000, 1.600) m"],
    );
}

#[test]
fn solids_that_nest() {
    let inner = block([-0.3, -0.3, 0.7], [0.3, 0.3, 1.3]);
    warns(&glass(&(cube() + &inner)), &["solids inside another", " in `glass` at", "cavity"]);
    // a cavity must be of the same material as the solid around it
    let water = scene(
        r#", "glass": { "type": "transparent", "ior": 1.5 },
             "water": { "type": "transparent", "ior": 1.33 }"#,
        r#", { "obj": "glass.obj", "material": "glass" }, { "obj": "water.obj", "material": "water" }"#,
        "",
        &[("glass.obj", &cube()), ("water.obj", &turned(&inner))],
    );
    warns(&water, &["solids inside another", "`water` at", " in `glass` at"]);
}

#[test]
fn solids_too_thin_and_sheets_too_thick() {
    let foil = block([-0.5, -0.5, 1.0], [0.5, 0.5, 1.000_01]);
    warns(&glass(&foil), &["thinner", "`glass` at", "thin"]);
    let pane = |kind: &str, thickness: f64| {
        scene(
            &format!(r#", "sheet": {{ {kind} }}"#),
            r#", { "name": "s", "obj": "s.obj", "material": "sheet", "captor": true }"#,
            "",
            &[("s.obj", &block([-0.5, -0.5, 1.0], [0.5, 0.5, 1.0 + thickness]))],
        )
    };
    let thin = r#""type": "transparent", "ior": 1.5, "thin": true"#;
    warns(&pane(thin, 0.004), &["flat closed boxes", "`s/s` at", "4.0 mm thick", "one face"]);
    let leaf = r#""type": "leaf", "reflectance": 0.1, "transmittance": 0.1"#;
    warns(&pane(leaf, 0.0003), &["flat closed boxes", "0.30 mm thick"]);
    // a terrarium of thin panes is no warning
    is_clean(&pane(thin, 0.5));
}

#[test]
fn long_lists_are_cut_short() {
    let open = |i: usize| {
        let x = -1.0 + 0.3 * i as f64;
        corners([x, 0.0, 1.0], [x + 0.2, 0.2, 1.2]) + &FACES[1..].concat()
    };
    let seven: String = (0..7).map(open).collect();
    warns(&glass(&seven), &["(4 open edges) and 2 more; close"]);
}

#[test]
fn materials_and_lights_without_effect() {
    let spare = r#", "spare": { "type": "mirror", "reflectance": 0.9 }"#;
    warns(&scene(spare, "", "", &[]), &["materials on no surface: `spare`", "usemtl"]);
    let dark = TestScene::new(
        r#"{ "lights": [ { "type": "point", "position": [0, 0, 1], "power": 10 },
             { "type": "tube", "name": "off", "from": [0, 0, 0], "to": [1, 0, 0], "radius": 0.1, "power": 0 } ] }"#,
        &[],
    );
    warns(&dark, &["lights without power in any band: `off`"]);
}

#[test]
fn leaves_whose_transmittance_differs_between_the_faces() {
    let with_back = |back: &str| {
        let leaf = format!(
            r#", "rose": {{ "type": "leaf", "reflectance": 0.1, "transmittance": 0.1,
            "back": {{ "transmittance": {back} }} }}"#
        );
        let object = r#", { "obj": "rose.obj", "material": "rose" }"#;
        let triangle = "v 0 0 1\nv 0.1 0 1\nv 0 0.1 1\nf 1 2 3\n";
        scene(&leaf, object, "", &[("rose.obj", triangle)])
    };
    let words = ["leaves whose faces differ in transmittance", "`rose`", "reciprocity"];
    warns(&with_back("0.2"), &words);
    is_clean(&with_back("0.1"));
    // the same value, written for each band
    is_clean(&with_back("[0.1]"));
}

#[test]
fn captors_off_the_scene_and_in_a_surface() {
    let disc = |z: f64| {
        format!(
            r#", {{ "name": "probe", "disc":
                {{ "center": [1, 1, {z}], "normal": [0, 0, 1], "radius": 0.1 }} }}"#
        )
    };
    warns(&scene("", "", &disc(3.1), &[]), &["captors outside the box", "`probe`", "unit"]);
    is_clean(&scene("", "", &disc(2.9), &[]));
    let on_floor = check(&scene("", "", &disc(0.0), &[]));
    assert!(on_floor.warnings.is_empty(), "{:?}", on_floor.warnings);
    assert!(on_floor.notes[0].contains("captors in the plane of a surface: `probe`"));
}

#[test]
fn a_light_inside_a_solid_is_noted() {
    let lamp_in = glass(&block([-0.5, -0.5, 2.5], [0.5, 0.5, 3.5]));
    let summary = check(&lamp_in);
    assert!(summary.warnings.is_empty(), "{:?}", summary.warnings);
    assert!(summary.notes[0].contains("`lamp` in `glass` at (0.000, 0.000, 3.000) m"));
}

#[test]
fn triangles_twice_or_without_area() {
    let paint = r#", "paint": { "type": "lambert", "reflectance": 0.9 }"#;
    let object = r#", { "obj": "paint.obj", "material": "paint" }"#;
    let again = "v 2 2 0\nv -2 -2 0\nv 2 -2 0\nf 1 2 3\n";
    let twice = scene(paint, object, "", &[("paint.obj", again)]);
    warns(&twice, &["in the same place", "1 of `paint` on `ground`"]);
    // the same square with its front below, and cut along the other diagonal
    let back = "v 2 2 0\nv 2 -2 0\nv -2 -2 0\nv -2 2 0\nf 2 3 4\nf 2 4 1\n";
    warns(&scene(paint, object, "", &[("paint.obj", back)]), &["2 of `paint` on `ground`"]);
    let pot = "v 0 0 0\nv 0 1 0\nv 1 0 0\nf 1 2 3\n";
    is_clean(&scene(paint, object, "", &[("paint.obj", pot)]));
    let line = "v 0 0 1\nv 1 1 1\nv 2 2 1\nv 0 1 1\nf 1 2 3\nf 1 2 4\n";
    let flat = scene(paint, object, "", &[("paint.obj", line)]);
    warns(&flat, &["without area", "1 of `paint`"]);
}

/// Shared leaves at 1 km that lie 2 mm apart are two, whose numbers are right; those that lie in one
/// place are not.
#[test]
fn leaves_close_together_far_away() {
    let leaves = |apart: f64| {
        let copy = |name: &str, z: f64| {
            format!(
                r#", {{ "name": "{name}", "obj": "leaf.obj", "material": "{name}", "share": true, "captor": true,
                    "instances": [{{ "translate": [1000, 0, {z}] }}] }}"#
            )
        };
        let materials = r#", "low": { "type": "lambert", "reflectance": 0.5 },
            "high": { "type": "lambert", "reflectance": 0 }"#;
        let leaf = "v -.1 -.1 0\nv .1 -.1 0\nv .1 .1 0\nv -.1 .1 0\nf 1 2 3 4\n";
        let scene = scene(
            materials,
            &(copy("low", 1.0) + &copy("high", 1.0 + apart)),
            "",
            &[("leaf.obj", leaf)],
        );
        check(&scene).warnings.iter().any(|warning| warning.contains("in the same place"))
    };
    assert!(!leaves(0.002) && leaves(0.0));
}

#[test]
fn scenes_of_unlikely_size() {
    let of_size = |unit: &str, size: f64| {
        let text = format!(
            r#"{{ "unit": "{unit}", "materials": {{ "m": {{ "type": "mirror", "reflectance": 1 }} }},
                 "objects": [ {{ "obj": "t.obj", "material": "m" }} ],
                 "lights": [ {{ "type": "point", "position": [0, 0, {above}], "power": 1 }} ] }}"#,
            above = 0.1 * size
        );
        let obj = format!("v 0 0 0\nv {size} 0 0\nv 0 {size} 0\nf 1 2 3\n");
        TestScene::new(&text, &[("t.obj", &obj)])
    };
    warns(&of_size("m", 6400.0), &["very large", "6400 m across", "lengths in m;", "`unit`"]);
    warns(&of_size("mm", 6.4), &["very small", "6.4 mm across", "lengths in mm;"]);
    is_clean(&of_size("mm", 6400.0));
}

/// A lamp ten times the scene's size away, and at least 10 m, is one whose unit is in doubt.
#[test]
fn lamps_far_from_everything_are_told() {
    let at = |height: f64| {
        let scene = scene("", "", "", &[]);
        let text = std::fs::read_to_string(scene.path("scene.json")).expect("a scene");
        let text = text.replace("[0, 0, 3]", &format!("[0, 0, {height}]"));
        std::fs::write(scene.path("scene.json"), text).expect("a scene");
        scene
    };
    // the scene is 4 x 4 x 1 m
    warns(
        &at(100.0),
        &["10 times the scene's size", "`lamp`", "check their position and its unit"],
    );
    is_clean(&at(50.0));
}

/// A lamp of a scene in W cannot emit more than it takes.
#[test]
fn lamps_of_more_power_than_their_watts_are_told() {
    let of = |quantity: &str, watts: f64| {
        let scene = scene("", "", "", &[]);
        let text = std::fs::read_to_string(scene.path("scene.json")).expect("a scene");
        let text = text.replace("\"power\": 10", &format!("\"power\": 10, \"watts\": {watts}"));
        let text = text.replacen('{', &format!("{{ \"quantity\": \"{quantity}\","), 1);
        std::fs::write(scene.path("scene.json"), text).expect("a scene");
        phylux::load(&scene.path("scene.json")).unwrap_or_else(|e| panic!("{e}")).warnings
    };
    let said = of("W", 9.0);
    assert!(said.len() == 1 && said[0].contains("emits 10 W of light and takes 9 W"), "{said:?}");
    assert!(of("W", 10.0).is_empty() && of("umol/s", 4.0).is_empty());
    // 10 umol/s of light up to 700 nm carry at least 1.71 W
    let of_par = |watts: f64| {
        let text = format!(
            r#"{{ "quantity": "umol/s", "bands": [{{ "name": "PAR", "from_nm": 400, "to_nm": 700 }}],
                 "lights": [{{ "type": "point", "position": [0, 0, 1], "power": 10, "watts": {watts} }}] }}"#
        );
        let scene = TestScene::new(&text, &[]);
        phylux::load(&scene.path("scene.json")).unwrap_or_else(|e| panic!("{e}")).warnings
    };
    let said = of_par(1.7);
    assert!(
        said.len() == 1 && said[0].contains("W of light and takes 1.7 W; its power"),
        "{said:?}"
    );
    assert!(of_par(1.72).is_empty());
}

#[test]
fn the_shipped_scenes_are_clean() {
    let scenes = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes");
    for name in
        ["box", "growth-chamber", "greenhouse", "glasshouse-noon", "vertical-farm", "evening"]
    {
        let warnings = check_file(&scenes.join(name).with_extension("json")).warnings;
        assert!(warnings.is_empty(), "{name}: {warnings:#?}");
    }
}

#[test]
fn the_command_describes_the_scene_and_warns() {
    let check = |scene: &TestScene| phylux(&scene.path(""), &["check", "scene.json"]);
    let output = check(&glass(&turned(&cube())));
    let text = String::from_utf8(output.stdout).expect("text");
    for line in [
        "scene: 4.00 x 4.00 x 3.00 m",
        "surfaces                 triangles  area, m2",
        "  ground                         2     16.00",
        "  glass                         12     6.000",
        "  total                         14     22.00",
        "lights, W                      all",
        "  lamp                       10.00",
        "captors: 1 sensor, 0 surfaces; groups: 1",
    ] {
        assert!(text.contains(line), "no {line:?} in\n{text}");
    }
    let warnings = String::from_utf8(output.stderr).expect("text");
    assert!(warnings.starts_with("warning: solids inside out: `glass`"), "{warnings}");
    assert_eq!(output.status.code(), Some(0));
    assert_eq!(check(&TestScene::new("{}", &[])).status.code(), Some(2));
}

/// Neighbouring lamps that are alike are one row, and the total counts each, as does the line below
/// a list that is cut short; `--full` has a row for each.
#[test]
fn lamps_that_are_alike_are_one_row() {
    let room = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/growth-room.json");
    let said = |more: &[&str]| {
        let room = room.to_str().expect("text");
        let output = phylux(Path::new("."), &[&["check", room], more].concat());
        String::from_utf8(output.stdout).expect("text")
    };
    let (short, full) = (said(&[]), said(&["--full"]));
    let lamps = |text: &str| text.matches("\n  lamp ").count();
    assert_eq!((lamps(&short), lamps(&full)), (2, 12), "{short}\n{full}");
    for row in
        ["  lamp 1 to lamp 6 (6), each     250.0\n", "  total                           1500\n"]
    {
        assert!(short.contains(row), "no {row:?} in\n{short}");
    }
    assert!(short.contains("  lamp 1 to lamp 6 (6), each (0, 0, -1), down\n"), "{short}");
    assert!(full.contains("  lamp 4                 (0, 0, -1), down\n"), "{full}");

    let light =
        |power: usize| format!(r#"{{ "type": "point", "position": [0, 0, 1], "power": {power} }}"#);
    let lights: Vec<String> = (1..=32).chain([99; 10]).map(light).collect();
    let many = TestScene::new(&format!(r#"{{ "lights": [{}] }}"#, lights.join(", ")), &[]);
    let said = phylux(&many.path(""), &["check", "scene.json"]);
    let said = String::from_utf8(said.stdout).expect("text");
    assert!(said.contains("  and 12 more (--full has all)\n"), "{said}");
}

/// Thousands of copies of a block of glass, in one place and slightly apart. For each face only
/// some of the others are compared, and a warning says so. The test takes a second or two; it would
/// take a minute if the time grew with the square of the number.
#[test]
fn many_solids_in_one_place() {
    for (copies, step) in [(8000, 0.0), (1000, 1e-5)] {
        let at = |i: i32, corner: [f64; 3]| corner.map(|x| x + step * f64::from(i));
        let obj: String = (0..copies).map(|i| block(at(i, CUBE.0), at(i, CUBE.1))).collect();
        let warnings = check(&glass(&obj)).warnings;
        let of = |words: &str| {
            let found = warnings.iter().find(|warning| warning.contains(words));
            found.unwrap_or_else(|| panic!("no {words:?} in {warnings:#?}"))
        };
        of("solids that touch more than 16 others in one place, too many to be looked");
        // 12 triangles of each block with 16 others, while all pairs of a thousand blocks would be
        // 499,500
        let touching = of("solids that touch or cut each other: ");
        let (_, more) = touching.split_once(" m and ").expect("a list");
        let more = more.split(" and ").find_map(|part| part.split_once(" more; ")).expect("more");
        let more: i32 = more.0.parse().expect("a number");
        assert!((copies - 5..192 * copies).contains(&more), "{touching}");
    }
}

/// 1100 cubes inside each other, in turn a cavity in the glass around it and glass in that cavity.
/// For cubes with more than a thousand faces on the way out, the surroundings are not searched, and
/// the only warning says so.
#[test]
fn solids_deep_inside_others() {
    let shell = |i: i32| {
        let half = 0.1 + 1e-3 * f64::from(i);
        let shell = block([-half, -half, 1.5 - half], [half, half, 1.5 + half]);
        if i % 2 == 0 { turned(&shell) } else { shell }
    };
    let obj: String = (0..1100).map(shell).collect();
    warns(
        &glass(&obj),
        &["solids with more than 1000 faces of solids on the way out of them", " and 595 more"],
    );
}

/// A thousand triangles nearly in one place are not all compared, and a warning says so. Exact
/// copies are all counted.
#[test]
fn many_triangles_in_one_place() {
    let at = |x: f64| format!("v {x} 0 1\nv {} 0 1\nv {x} 1 1\nf -3 -2 -1\n", x + 1.0);
    let apart: String = (0..1000).map(|i| at(1e-6 * f64::from(i))).collect();
    let thing = |obj: &str| {
        let thing = r#", { "obj": "thing.obj", "material": "thing" }"#;
        let material = r#", "thing": { "type": "lambert", "reflectance": 0.5 }"#;
        check(&scene(material, thing, "", &[("thing.obj", obj)])).warnings
    };
    let warnings = thing(&apart);
    assert!(warnings.iter().any(|w| w.starts_with("triangles in the same place as others")));
    let crowded = "triangles with more than 100 others in one place, of which only so many were looked at: 1000 of";
    assert!(warnings.iter().any(|w| w.starts_with(crowded)), "{warnings:#?}");
    let warnings = thing(&at(0.0).repeat(1000));
    assert_eq!(warnings.len(), 1, "{warnings:#?}");
    assert!(
        warnings[0].ends_with("meets only one: 999 of `thing` on `thing`; remove one of the two")
    );
}

/// `check` warns of a point light in the plane of a surface, within rounding, and of a tube that
/// reaches into a surface, but not of lights that are a millimetre away.
#[test]
fn lights_in_surfaces_are_told() {
    let above = |height: f64| {
        let obj =
            format!("v -2 -2 {0}\nv 2 -2 {0}\nv 2 2 {0}\nv -2 2 {0}\nf 4 3 2 1\n", 3.0 + height);
        let object = r#", { "obj": "ceiling.obj", "material": "ground" }"#;
        scene("", object, "", &[("ceiling.obj", &obj)])
    };
    warns(&above(0.0), &["`lamp` in `ceiling`", "shine on one side of it"]);
    warns(&above(1e-6), &["`lamp` in `ceiling`"]);
    is_clean(&above(1e-3));
    is_clean(&above(-1e-3));
    let tube = |z: f64| {
        let floor = "v -2 -2 0\nv 2 -2 0\nv 2 2 0\nv -2 2 0\nf 1 2 3 4\n";
        let text = format!(
            r#"{{ "materials": {{ "ground": {{ "type": "lambert", "reflectance": 0.2 }} }},
                  "objects": [ {{ "obj": "floor.obj", "material": "ground", "captor": true }} ],
                  "lights": [ {{ "type": "tube", "name": "lamp", "from": [-1, 0, {z}], "to": [1, 0, {z}],
                                 "radius": 0.013, "power": 10 }} ] }}"#
        );
        TestScene::new(&text, &[("floor.obj", floor)])
    };
    warns(&tube(0.012), &["`lamp` in `floor`", "beyond"]);
    is_clean(&tube(0.014));
}

/// A closed room of 4 m with a lamp, in which objects are too large, reach through the walls or
/// stand in the wrong place. Each of these usual mistakes is warned of.
#[test]
fn objects_are_described_and_usual_slips_are_warned_of() {
    let corners = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\n";
    let inward = "f 1 2 3 4\nf 8 7 6 5\nf 1 5 6 2\nf 2 6 7 3\nf 3 7 8 4\nf 4 8 5 1\n";
    let room = format!("{corners}{inward}");
    let leaf = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n";
    let text = |leaf: &str, lamp: &str, sensor: &str| {
        format!(
            r#"{{"materials": {{"m": {{"type": "lambert", "reflectance": 0.5}}}},
            "objects": [{{"name": "room", "obj": "room.obj", "material": "m", "transform": {{"scale": 4}}}},
                {{"name": "pot", "obj": "room.obj", "material": "m", "transform": {{"scale": 0.5, "translate": [2, 2, 0.01]}}}},
                {{"name": "leaf", "obj": "leaf.obj", "material": "m", {leaf}}}],
            "lights": [{{"name": "lamp", "type": "point", "position": [{lamp}], "power": 1}}],
            "captors": [{{"name": "s", "disc": {{{sensor}}}}}]}}"#
        )
    };
    let good_leaf = r#""transform": {"translate": [1, 1, 0.5]}"#;
    let up = r#""center": [1, 3, 1], "normal": [0, 0, 1], "radius": 0.2"#;
    let checked = |text: String| {
        let scene = TestScene::new(&text, &[("room.obj", &room), ("leaf.obj", leaf)]);
        let loaded = phylux::load(&scene.path("scene.json")).expect("a scene");
        phylux::studies::check(&loaded).expect("a summary")
    };
    let good = checked(text(good_leaf, "1.5, 1.5, 3.5", up));
    assert_eq!(good.warnings, Vec::<String>::new());
    let [room_found, pot, leaf_found] = &good.objects[..] else { panic!("three objects") };
    assert!((room_found.to - room_found.from).abs_diff_eq(glam::DVec3::splat(4.0), 1e-5));
    // of six walls whose fronts are inside, only the floor faces upwards
    assert!((room_found.facing_up - 1.0 / 6.0).abs() < 1e-6);
    assert!((pot.height[0] - 0.01).abs() < 1e-5 && (pot.height[1] - 0.51).abs() < 1e-5);
    assert_eq!((leaf_found.object.as_str(), leaf_found.facing_up), ("leaf", 1.0));

    for (leaf, lamp, sensor, words) in [
        (
            r#""up": "y", "transform": {"scale": 15, "translate": [1, 1, 0]}"#,
            "1.5, 1.5, 1",
            up,
            "far above the highest lamp",
        ),
        (
            r#""transform": {"scale": 3, "translate": [2, 2, 1]}"#,
            "1.5, 1.5, 3",
            up,
            "reach through the walls of `room`: `leaf`",
        ),
        (
            // 2 cm of a leaf of 10 cm that stands on the floor are under it
            r#""up": "y", "captor": true, "transform": {"scale": 0.1, "translate": [1, 1, -0.02]}"#,
            "1.5, 1.5, 3",
            up,
            "reach through the walls of `room`: `leaf`",
        ),
        (good_leaf, "9, 1, 3", up, "outside the closed room `room`: `lamp`"),
        (good_leaf, "9, 1, 3", up, "none came to any captor"),
        (
            good_leaf,
            "1.5, 1.5, 3",
            r#""center": [1.9, 2.2, 0.2], "normal": [0, 0, 1], "radius": 0.3"#,
            "half inside an object: `s`",
        ),
    ] {
        let found = checked(text(leaf, lamp, sensor)).warnings;
        assert!(found.iter().any(|warning| warning.contains(words)), "{found:?}\n{words}");
    }
}

/// A lamp above a room of 4 x 4 x 3 m is warned of as outside if the roof is closed, but not if it
/// shines in through a vent of 10 x 10 cm.
#[test]
fn lamps_may_shine_in_by_a_vent() {
    let walls = "v 0 0 0\nv 4 0 0\nv 4 4 0\nv 0 4 0\nv 0 0 3\nv 4 0 3\nv 4 4 3\nv 0 4 3\n\
                 f 1 2 3 4\nf 1 5 6 2\nf 2 6 7 3\nf 3 7 8 4\nf 4 8 5 1\n";
    let whole = format!("{walls}f 8 7 6 5\n");
    let corners = "v 1.9 1.9 3\nv 2 1.9 3\nv 2 2 3\nv 1.9 2 3\n";
    let vented = format!("{walls}{corners}f 5 9 10 6\nf 6 10 11 7\nf 7 11 12 8\nf 8 12 9 5\n");
    let text = r#"{"materials": {"m": {"type": "lambert", "reflectance": 0.5}},
        "objects": [{"name": "room", "obj": "room.obj", "material": "m"}],
        "lights": [{"name": "sun", "type": "spot", "position": [2, 2, 50], "direction": [0, 0, -1],
                    "half_angle_deg": 5, "power": 1}],
        "captors": [{"name": "s", "disc": {"center": [2, 2, 1], "normal": [0, 0, 1], "radius": 0.2}}]}"#;
    for (room, is_outside) in [(whole, true), (vented, false)] {
        let scene = TestScene::new(text, &[("room.obj", &room)]);
        let loaded = phylux::load(&scene.path("scene.json")).expect("a scene");
        let found = phylux::studies::check(&loaded).expect("a summary").warnings;
        let told = found.iter().any(|warning| warning.contains("outside the closed room `room`"));
        assert_eq!(told, is_outside, "{found:?}");
    }
}

/// The table of objects of a shipped scene fits the 80 columns of a terminal in one part.
#[test]
fn objects_stand_in_one_table() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes");
    let output = phylux(&folder, &["check", "caustic.json"]);
    let text = String::from_utf8(output.stdout).expect("text");
    assert_eq!(text.matches("objects, m").count(), 1, "{text}");
    let beaker = text.lines().find(|line| line.starts_with("  beaker")).expect("a row");
    assert!(beaker.len() <= 80 && beaker.ends_with("0.001 to 0.101      10 %"), "{beaker}");
}
