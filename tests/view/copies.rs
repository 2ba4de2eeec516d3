//! Plants that stand in several copies are stored in the page only once.

use super::{hover, number, open};
use crate::{common::TestScene, merged::sheets, rendered::done};
use serde_json::Value;
use std::{f64::consts::PI, fmt::Write, fs};

/// Number of copies of a plant of 120 triangles, which is a wavy band of 60 squares in two leaves.
const COPIES: usize = 40;

fn place(copy: usize) -> ([f64; 3], f64, f64) {
    let [x, y] = [(copy % 8) as f64, (copy / 8) as f64];
    ([0.5 * x, 0.5 * y, 0.0], 37.0 * copy as f64, 0.5 + 0.02 * copy as f64)
}

/// Returns a corner of the band as it is in the OBJ file.
fn corner(i: usize, right: usize) -> [f64; 3] {
    [0.03 * right as f64, 0.005 * i as f64, 0.2 + 0.01 * (0.2 * i as f64).sin()]
}

fn field() -> TestScene {
    let mut obj = String::new();
    for i in 0..=60 {
        for right in 0..2 {
            let [x, y, z] = corner(i, right);
            let _ = writeln!(obj, "v {x} {y} {z}");
        }
    }
    for i in 0..60 {
        if i % 30 == 0 {
            let _ = writeln!(obj, "g leaf{}", 1 + i / 30);
        }
        let first = 2 * i + 1;
        let _ = writeln!(obj, "f {first} {} {} {}", first + 1, first + 3, first + 2);
    }
    let instances: Vec<String> = (0..COPIES)
        .map(|copy| {
            let (translate, turn, scale) = place(copy);
            format!(
                r#"{{"translate": {translate:?}, "rotate_deg": [0, 0, {turn}], "scale": {scale}}}"#
            )
        })
        .collect();
    let scene = format!(
        r#"{{"materials": {{"grey": {{"type": "lambert", "reflectance": 0.5}}}},
        "objects": [{{"name": "floor", "obj": "floor.obj", "material": "grey"}},
            {{"name": "plant", "obj": "plant.obj", "material": "grey", "captor": true, "instances": [{}]}}],
        "lights": [{{"name": "lamp", "type": "point", "position": [2, 1, 3], "power": 100}}],
        "captors": [{{"name": "sensor", "disc": {{"center": [2, 1, 1.5], "normal": [0, 0, 1], "radius": 0.1}}}}],
        "settings": {{"photons": 20000, "map_photons": 20000, "k": 10}}}}"#,
        instances.join(", ")
    );
    let floor = "v -1 -1 0\nv 5 -1 0\nv 5 3 0\nv -1 3 0\nf 1 2 3 4\n";
    TestScene::new(&scene, &[("plant.obj", &obj), ("floor.obj", floor)])
}

/// Between the floor and the sensor, the page's data holds a single shape with all the copies.
#[test]
fn copies_are_stored_once() {
    let scene = field();
    done(&scene.path(""), &["view", "scene.json"]);
    let html = fs::read_to_string(scene.path("view.html")).expect("the page");
    let (_, facts) = html.split_once("id=\"facts\">").expect("the facts");
    let facts = facts.split("</script>").next().expect("their end");
    let facts: Value = serde_json::from_str(facts).expect("JSON");
    let shapes: Vec<(u64, u64)> = facts["shapes"]
        .as_array()
        .expect("shapes")
        .iter()
        .map(|shape| {
            (shape["tiles"].as_u64().expect("tiles"), shape["copies"].as_u64().expect("copies"))
        })
        .collect();
    let [(floor, 1), (120, 40), (sensor, 1)] = shapes[..] else { panic!("{shapes:?}") };
    assert_eq!(facts["tiles"], floor + 120 * 40 + sensor);
}

/// Each corner of each copy is where the scene has it, to a step of 1/65,535 of the plant's size.
/// The mouse finds the copy that it points at.
#[test]
#[ignore = "needs Chromium"]
fn needs_chromium_copies_stand_where_the_scene_has_them() {
    let page = open(&field(), &[]);
    let first = number(&page, "shapes[1].first");
    // the page measures from the centre of the scene
    let shown = |tile: usize| {
        let place = page.evaluate(&format!("cornersOf({})[0]", first as usize + tile));
        [0, 1, 2].map(|axis| place[axis].as_f64().expect("a number"))
    };
    let known = |copy: usize, square: usize| {
        let (translate, turn, scale) = place(copy);
        let [x, y, z] = corner(square, 0).map(|side| scale * side);
        let (sine, cosine) = (turn * PI / 180.0).sin_cos();
        [
            cosine * x - sine * y + translate[0],
            sine * x + cosine * y + translate[1],
            z + translate[2],
        ]
    };
    let (here, there) = (shown(0), known(0, 0));
    for (copy, square) in [(0, 59), (1, 0), (7, 31), (39, 58)] {
        let (a, b) = (shown(120 * copy + 2 * square), known(copy, square));
        for axis in 0..3 {
            let off = (a[axis] - here[axis]) - (b[axis] - there[axis]);
            assert!(off.abs() < 2e-5, "{copy} {square}: {a:?} {b:?}");
        }
    }
    for captor in ["plant/leaf2#0", "plant/leaf2#17", "plant/leaf1#39"] {
        let tip = hover(&page, captor);
        let instance = captor.rsplit('#').next().expect("a number");
        assert!(
            tip.starts_with("plant/leaf") && tip.contains(&format!("#{instance}")),
            "{captor}: {tip}"
        );
    }
    page.no_complaints();
}

/// Where triangles of copies are merged, the mouse finds the captor of each copy, and a tile has its
/// triangles where the copy stands. Captors show their results at first.
#[test]
#[ignore = "takes minutes, and needs Chromium: .ci/nightly runs it"]
fn nightly_merged_copies_are_found() {
    let page = open(&sheets(210, serde_json::json!("instance")), &["--photons", "20000"]);
    assert_eq!(page.evaluate("state.values"), "captor");
    let shape = "shapes[1]";
    assert_eq!(number(&page, &format!("{shape}.triangles")), 20_000.0);
    // the first tile of a copy begins at the corner of the sheet
    let corner = |copy: usize, axis: usize| {
        number(&page, &format!("cornersOf({shape}.first + {copy} * {shape}.tiles)[0][{axis}]"))
    };
    for copy in [1, 100, 209] {
        for (axis, along) in [2.0, 0.0, 0.01].into_iter().enumerate() {
            let off = corner(copy, axis) - corner(0, axis) - along * copy as f64;
            assert!(off.abs() < 1e-3, "{copy}: {off}");
        }
    }
    let area = "Array.from({ length: shapes[1].tiles }, (_, own) => areaOf(shapes[1].first + own))";
    let area = number(&page, &format!("{area}.reduce((sum, area) => sum + area)"));
    assert!((area - 1.0).abs() < 1e-3, "{area} m2");
    let tip = hover(&page, "sheet#100");
    assert!(tip.starts_with("sheet#100"), "{tip}");
    page.no_complaints();
}
