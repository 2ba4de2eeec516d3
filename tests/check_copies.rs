//! `phylux check` of copies that share their triangles: each copy is looked at by itself.

use serde_json::{Value, json};

use crate::common::TestScene;

/// Two leaves of a plant.
const PLANT: &str = "v -0.1 -0.05 0.1\nv 0.1 -0.05 0.1\nv 0.1 0.05 0.12\nv -0.1 0.05 0.12\n\
                     g low\nf 1 2 3\ng high\nf 1 3 4\n";
const GROUND: &str = "v -9 -9 0\nv 9 -9 0\nv 9 9 0\nv -9 9 0\nf 1 2 3 4\n";
/// A closed box of 1 m x 0.2 m x 0.1 m, normals outside.
const GUTTER: &str = "v 0 0 0\nv 1 0 0\nv 1 0.2 0\nv 0 0.2 0\nv 0 0 0.1\nv 1 0 0.1\nv 1 0.2 0.1\n\
                      v 0 0.2 0.1\nf 4 3 2 1\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";

/// Returns the warnings about a ground, copies of a plant above it at `places`, and lamps.
fn warnings(places: &[[f64; 3]], lamps: Value, more: &[Value], share: bool) -> Vec<String> {
    let instances: Vec<Value> = places.iter().map(|place| json!({ "translate": place })).collect();
    let plants = json!({
        "name": "plant", "obj": "plant.obj", "material": "leaf", "captor": true,
        "instances": instances, "share": share
    });
    let ground = json!({ "name": "soil", "obj": "ground.obj", "material": "leaf" });
    let objects: Vec<Value> = [ground, plants].into_iter().chain(more.iter().cloned()).collect();
    let scene = json!({
        "materials": { "leaf": { "type": "lambert", "reflectance": 0.3 } },
        "objects": objects, "lights": lamps
    });
    let files = [("plant.obj", PLANT), ("ground.obj", GROUND), ("gutter.obj", GUTTER)];
    let folder = TestScene::new(&scene.to_string(), &files);
    let loaded = phylux::load(&folder.path("scene.json")).unwrap_or_else(|e| panic!("{e}"));
    phylux::studies::check(&loaded).unwrap_or_else(|e| panic!("{e}")).warnings
}

fn lamp() -> Value {
    json!([{ "name": "lamp", "type": "point", "position": [0, 0, 2], "power": 10 }])
}

/// Nine plants in a row, 0.5 m apart.
fn row() -> Vec<[f64; 3]> {
    (0..9).map(|i| [0.5 * f64::from(i) - 2.0, 0.0, 0.0]).collect()
}

/// Asserts that one of the warnings contains all `words`, and that there is no other.
fn only(warnings: &[String], words: &[&str]) {
    assert_eq!(warnings.len(), 1, "expected {words:?}, found {warnings:#?}");
    for word in words {
        assert!(warnings[0].contains(word), "no {word:?} in {:?}", warnings[0]);
    }
}

#[test]
fn copies_that_stand_well_are_clean() {
    for share in [false, true] {
        let found = warnings(&row(), lamp(), &[], share);
        assert!(found.is_empty(), "{found:#?}");
    }
}

#[test]
fn copies_that_stand_twice_are_told() {
    // neither is the first copy
    let places = [row(), vec![row()[4], row()[7]]].concat();
    let found = warnings(&places, lamp(), &[], true);
    only(
        &found,
        &["stand where another copy stands", "`plant` at (0.00, 0.00, ", "`plant` at (1.50, "],
    );
}

#[test]
fn copies_below_the_ground_and_far_away_are_told() {
    for share in [false, true] {
        let below = [row(), vec![[1.0, 1.0, -0.4]]].concat();
        only(&warnings(&below, lamp(), &[], share), &["below the ground", "`plant` at (1.00"]);
        // metres for kilometres
        let far = [row(), vec![[1000.0, 0.0, 0.0]]].concat();
        let found = warnings(&far, lamp(), &[], share);
        let told =
            |f: &&String| f.contains("far away from all others") && f.contains("`plant` at (1000");
        assert_eq!(found.iter().filter(told).count(), 1, "{found:#?}");
    }
}

/// A lamp in a closed gutter, one that shines away from everything and one above a gutter bring
/// nothing to the plants. A lamp that reaches them by way of the ground alone is right.
#[test]
fn lamps_whose_light_gets_nowhere_are_told() {
    let with = |lamp: Value| {
        let usual = json!({ "name": "lamp", "type": "point", "position": [0, 0, 2], "power": 10 });
        let gutters = json!({
            "name": "gutter", "obj": "gutter.obj", "material": "leaf", "share": true,
            "instances": [{ "translate": [-3, 1, 0.5] }, { "translate": [2, 1, 0.5] }]
        });
        warnings(&row(), json!([usual, lamp]), &[gutters], true)
    };
    let spot = |position: [f64; 3], direction: [f64; 3]| {
        json!({
            "name": "other", "type": "spot", "position": position, "direction": direction,
            "half_angle_deg": 30, "power": 5
        })
    };
    let in_gutter =
        json!({ "name": "other", "type": "point", "position": [2.5, 1.1, 0.55], "power": 5 });
    only(&with(in_gutter), &["inside a closed object", "`other` in `gutter`"]);
    only(&with(spot([0.0, 0.0, 1.0], [0.0, 0.0, 1.0])), &["meets nothing", "`other`"]);
    // the plants fill 3 parts in 10,000 of the scene
    let on_gutter = spot([2.5, 1.1, 0.72], [0.0, 0.0, -1.0]);
    only(&with(on_gutter), &["nothing comes to a captor: `other`"]);
    let found = with(spot([0.3, 2.0, 1.0], [0.0, 0.0, -1.0]));
    assert!(found.is_empty(), "{found:#?}");
}

/// A single object below the ground is told, too; the ground itself, a shelf below another as wide as
/// it is, and an object that stands on the ground are not.
#[test]
fn an_object_below_the_ground_is_told() {
    let gutter = |name: &str, z: f64| {
        let place = json!({ "translate": [1, 1, z] });
        json!({ "name": name, "obj": "gutter.obj", "material": "leaf", "transform": place })
    };
    let found = warnings(&row(), lamp(), &[gutter("sunk", -0.6), gutter("bench", 0.3)], false);
    only(&found, &["objects below the ground", "`sunk`;"]);
    let shelf = |name: &str, z: f64| {
        let place = json!({ "translate": [0, 0, z] });
        json!({ "name": name, "obj": "shelf.obj", "material": "leaf", "transform": place })
    };
    let scene = json!({
        "materials": { "leaf": { "type": "lambert", "reflectance": 0.3 } },
        "objects": [shelf("low", 0.0), shelf("high", 0.5)], "lights": lamp()
    });
    let files = [("shelf.obj", "v 0 0 0\nv 3 0 0\nv 3 3 0\nv 0 3 0\nf 1 2 3 4\n")];
    let folder = TestScene::new(&scene.to_string(), &files);
    let loaded = phylux::load(&folder.path("scene.json")).unwrap_or_else(|e| panic!("{e}"));
    let found = phylux::studies::check(&loaded).unwrap_or_else(|e| panic!("{e}")).warnings;
    assert!(!found.iter().any(|warning| warning.contains("below the ground")), "{found:#?}");
}
