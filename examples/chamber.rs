//! Builds a growth chamber in memory and prints the PPFD that three sensors on its shelf receive.
//! No file is read or written. Run it with `cargo run --release --example chamber`.

use std::{collections::HashMap, path::Path, sync::atomic::AtomicBool};

use glam::DVec3;
use phylux::{Channel, Control, FlatResult, Mesh, load_with, simulate};
use serde_json::json;

fn main() -> phylux::Result<()> {
    let sensor = |x: f64| {
        json!({ "name": format!("sensor at x = {x} m"),
                "disc": { "center": [x, 0.25, 0.1], "normal": [0, 0, 1], "radius": 0.02 } })
    };
    let sensors = [0.2, 0.5, 0.8].map(sensor);
    let scene = json!({
        "quantity": "umol/s",
        "bands": [{ "name": "PAR", "from_nm": 400, "to_nm": 700 }],
        "materials": {
            "white paint": { "type": "lambert", "reflectance": 0.8 },
            "leaf": { "type": "leaf", "reflectance": 0.07, "transmittance": 0.04 },
        },
        "objects": [
            { "name": "walls", "obj": "mesh:walls", "material": "white paint" },
            { "name": "plant", "obj": "mesh:leaf", "material": "leaf", "captor": true,
              "instances": [{ "translate": [0.3, 0.5, 0.2] }, { "translate": [0.7, 0.5, 0.25] }] },
        ],
        "lights": [{ "name": "tube", "type": "tube", "from": [0.1, 0.5, 0.95], "to": [0.9, 0.5, 0.95],
                     "radius": 0.013, "power": 100 }],
        "captors": sensors,
        "settings": { "photons": 1e6, "seed": 1, "k": 0 },
    });
    let meshes = HashMap::from([
        ("walls".to_string(), room()?),
        ("leaf".to_string(), Mesh::from_faces(&leaf_corners(), &[[0, 1, 2], [0, 2, 3]])?),
    ]);
    let loaded = load_with(scene, Path::new("."), &meshes)?;

    let control = Control { stop: &AtomicBool::new(false), progress: &|_| {} };
    let simulation = simulate(&loaded.scene, &loaded.settings, &control)?;
    let found = FlatResult::new(&loaded.scene, &simulation.totals);
    for (c, captor) in loaded.scene.captors.iter().enumerate() {
        let (flux, error) = found.get(c, Channel::Front, 0);
        let (ppfd, error) = (flux / captor.area, error / captor.area);
        println!("{:<22} {ppfd:6.1} +- {error:.1} umol/m2/s", captor.id);
    }
    Ok(())
}

/// Returns the walls of a cube of 1 m, whose fronts face inwards.
fn room() -> phylux::Result<Mesh> {
    let corner = |i: usize| DVec3::new((i & 1) as f64, (i >> 1 & 1) as f64, (i >> 2) as f64);
    let vertices: Vec<DVec3> = (0..8).map(corner).collect();
    let walls =
        [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]];
    let faces: Vec<[usize; 3]> =
        walls.iter().flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]]).collect();
    Mesh::from_faces(&vertices, &faces)
}

/// Returns the corners of a leaf of 16 x 10 cm that is slightly bent.
fn leaf_corners() -> [DVec3; 4] {
    [[-0.08, 0.0, 0.0], [0.0, -0.05, 0.02], [0.08, 0.0, 0.0], [0.0, 0.05, 0.02]].map(DVec3::from)
}
