//! Sweeps: what they find, which files they leave, and what they refuse.

mod linear;
mod own;
mod refused;
mod stopped;
mod tables;

use std::{collections::BTreeMap, fs, path::Path, process::Output};

use crate::{
    bad_input::phylux,
    common::{TestScene, stderr},
};

const OBJ: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";

/// A correct scene that runs in no time.
const SCENE: &str = r#"{
    "materials": {"wall": {"type": "lambert", "reflectance": 0.5}},
    "objects": [{"name": "a", "obj": "a.obj", "material": "wall", "captor": true}],
    "lights": [
        {"name": "left", "type": "point", "position": [0.2, 0.2, 0.1], "power": 1},
        {"name": "right", "type": "point", "position": [0.2, 0.3, 0.1], "power": 1}
    ],
    "settings": {"photons": 2000, "seed": 7, "k": 0}
}"#;

/// Returns a folder with the scene and this sweep of it.
fn folder(sweep: &str) -> TestScene {
    TestScene::new(SCENE, &[("a.obj", OBJ), ("sweep.json", sweep)])
}

/// Runs `phylux` in the folder and asserts that it succeeds. Returns its standard output.
fn ok(folder: &TestScene, arguments: &str) -> String {
    let output = any(folder, arguments);
    assert!(output.status.success(), "{arguments}: {}", stderr(&output));
    String::from_utf8_lossy(&output.stdout).into_owned()
}

fn any(folder: &TestScene, arguments: &str) -> Output {
    phylux(&folder.path(""), &arguments.split(' ').collect::<Vec<_>>())
}

/// Returns the path and the content of all files in a sweep's folder, except the one that differs
/// each time.
fn content(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut found = BTreeMap::new();
    for entry in fs::read_dir(folder).expect("a folder") {
        let path = entry.expect("an entry").path();
        let name = path.file_name().expect("a name").to_string_lossy().into_owned();
        if path.is_dir() {
            let inner = content(&path).into_iter();
            found.extend(inner.map(|(inner, bytes)| (format!("{name}/{inner}"), bytes)));
        } else if name != "times.csv" {
            found.insert(name, fs::read(&path).expect("a file"));
        }
    }
    found
}

/// Returns the names of the files that differ between two folders.
fn differences(a: &Path, b: &Path) -> Vec<String> {
    let (a, b) = (content(a), content(b));
    let names: Vec<&String> = a.keys().chain(b.keys()).collect();
    names.into_iter().filter(|name| a.get(*name) != b.get(*name)).cloned().collect()
}
