//! Copies of objects: tables of them, and what they count.

use serde_json::{Value, json};

use crate::{
    bad_input::bad_scene,
    common::{TestScene, run_file},
};

const PLANT: &str = "v 0 0 0\nv 0.2 0 0\nv 0.2 0.2 0.1\nv 0 0.2 0.1\n\
                     g low\nf 1 2 3\ng high\nf 1 3 4\n";

/// Returns a scene with copies of a plant, below a lamp.
fn field(instances: &Value, captor: &Value) -> Value {
    json!({
        "unit": "m",
        "materials": { "leaf": { "type": "lambert", "reflectance": 0.4 } },
        "objects": [{
            "name": "plant", "obj": "plant.obj", "material": "leaf",
            "transform": { "translate": [0.1, 0, 0] }, "instances": instances, "captor": captor
        }],
        "lights": [{ "type": "point", "position": [0.5, 0.5, 1], "power": 1 }],
        "settings": { "guiding": "off", "photons": 20_000 }
    })
}

fn run(scene: &Value, table: &str) -> phylux::RunResult {
    let files = [("plant.obj", PLANT), ("field.csv", table)];
    let scene = TestScene::new(&scene.to_string(), &files);
    run_file(&scene.path("scene.json"), |_| ())
}

/// The same field by an array, by a table of places and by a table of matrices: the same counts.
#[test]
fn a_table_of_copies_is_an_array() {
    let array = json!([
        { "translate": [0, 0, 0.1] },
        { "translate": [0.5, 0.4, 0], "rotate_deg": [0, 0, 90], "scale": 2 }
    ]);
    let places = "z,x,y,scale,turn_deg\n0.1,0,0,1,0\n0,0.5,0.4,2,90\n";
    let matrices = "m00,m01,m02,m03,m10,m11,m12,m13,m20,m21,m22,m23\n\
                    1,0,0,0,0,1,0,0,0,0,1,0.1\n0,-2,0,0.5,2,0,0,0.4,0,0,2,0\n";
    let captor = json!(true);
    let expected = run(&field(&array, &captor), "");
    let ids: Vec<&str> = expected.captors.iter().map(|c| c.id.as_str()).collect();
    assert_eq!(ids, ["plant/low#0", "plant/high#0", "plant/low#1", "plant/high#1"]);
    for table in [places, matrices] {
        let found = run(&field(&json!({ "csv": "field.csv" }), &captor), table);
        for (found, expected) in found.captors.iter().zip(&expected.captors) {
            assert_eq!(found.id, expected.id);
            let value = |c: &phylux::results::CaptorResult| c.absorbed.as_ref().unwrap()[0];
            let (found, expected) = (value(found), value(expected));
            assert!((found - expected).abs() <= 1e-6 * expected, "{found} {expected}");
        }
    }
}

/// A mirrored copy keeps its fronts: it counts the lamp above it on its front, as its mirror image
/// does below a lamp at the mirrored place.
#[test]
fn a_mirrored_copy_keeps_its_fronts() {
    let matrix = "m00,m01,m02,m03,m10,m11,m12,m13,m20,m21,m22,m23\n-1,0,0,1,0,1,0,0,0,0,1,0\n";
    let result = run(&field(&json!({ "csv": "field.csv" }), &json!("instance")), matrix);
    let [plant] = &result.captors[..] else { panic!("one captor") };
    assert!(plant.front.flux[0] > 0.0);
    assert_eq!(plant.back.as_ref().unwrap().flux[0], 0.0);
}

/// One captor for each plant counts what the captors of its leaves count together.
#[test]
fn a_plant_is_one_captor() {
    let table = "x,y,z\n0,0,0.1\n0.5,0.4,0\n";
    let instances = json!({ "csv": "field.csv" });
    let leaves = run(&field(&instances, &json!(true)), table);
    let plants = run(&field(&instances, &json!("instance")), table);
    let ids: Vec<&str> = plants.captors.iter().map(|c| c.id.as_str()).collect();
    assert_eq!(ids, ["plant#0", "plant#1"]);
    for plant in &plants.captors {
        let group = leaves.groups.iter().find(|g| g.id == plant.id).expect("a group");
        let (own, all) = (plant.absorbed.as_ref().unwrap()[0], group.absorbed.as_ref().unwrap()[0]);
        assert!((own - all).abs() < 1e-9 * all, "{}: {own} {all}", plant.id);
        assert!((plant.area - group.area).abs() < 1e-12);
    }
}

#[test]
fn tables_that_cannot_be_read_are_named() {
    let scene = |instances: Value| field(&instances, &json!(true)).to_string();
    let csv = scene(json!({ "csv": "field.csv" }));
    let files = |table: &'static str| [("plant.obj", PLANT), ("field.csv", table)];
    bad_scene(&csv, &files("x,y,z\n0,0\n"), &["field.csv:2", "2 values"]);
    bad_scene(&csv, &files("x,y,z,turn\n"), &["field.csv:1", "turn_deg"]);
    bad_scene(&scene(json!({ "csv": "none.csv" })), &files(""), &["none.csv"]);
    bad_scene(&scene(json!({ "csv": "" })), &files(""), &["/objects/0/instances/csv"]);
    bad_scene(&scene(json!({ "table": "a" })), &files(""), &["/objects/0/instances"]);
    bad_scene(&scene(json!([])), &files(""), &["/objects/0/instances", "empty"]);
    let word = field(&json!([{}]), &json!("plant")).to_string();
    bad_scene(&word, &files(""), &["/objects/0/captor", "\"instance\""]);
}
