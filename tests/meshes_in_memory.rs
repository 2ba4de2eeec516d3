//! Scenes whose meshes are in memory give the same results as scenes from files, to the byte.

use std::{collections::HashMap, fs, path::Path, sync::atomic::AtomicBool};

use glam::DVec3;
use phylux::{Control, FlatResult, LoadedScene, Mesh, MeshGroup, RunResult, load, load_with};
use serde_json::{Value, json};

/// Reads the groups of an OBJ file that only has `v`, `g`, `usemtl` and `f` lines.
fn groups(obj: &str) -> Vec<MeshGroup> {
    let (mut vertices, mut groups) = (Vec::new(), vec![MeshGroup::default()]);
    for line in obj.lines() {
        let mut words = line.split_whitespace();
        let word = words.next();
        let rest: Vec<&str> = words.collect();
        match word {
            Some("v") => {
                let at = |i: usize| rest[i].parse::<f64>().expect("a number");
                vertices.push(DVec3::new(at(0), at(1), at(2)));
            }
            Some("g" | "o") => {
                let group = MeshGroup { name: Some(rest.join(" ")), ..MeshGroup::default() };
                groups.push(group);
            }
            Some("f") => {
                let corner = |i: &str| vertices[i.parse::<usize>().expect("an index") - 1];
                let corners: Vec<DVec3> = rest.iter().map(|i| corner(i)).collect();
                assert_eq!(corners.len(), 3, "a triangle");
                let group = groups.last_mut().expect("there is one");
                group.triangles.push([corners[0], corners[1], corners[2]]);
            }
            _ => {}
        }
    }
    groups
}

fn result(loaded: &LoadedScene) -> (RunResult, FlatResult) {
    let control = Control { stop: &AtomicBool::new(false), progress: &|_| {} };
    let settings = phylux::Settings { photons: Some(20_000), ..loaded.settings.clone() };
    let simulation = phylux::simulate(&loaded.scene, &settings, &control).expect("a run");
    let flat = FlatResult::new(&loaded.scene, &simulation.totals);
    (RunResult::new(&loaded.scene, &settings, &simulation), flat)
}

#[test]
fn a_scene_in_memory_gives_the_bytes_of_its_files() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/box.json");
    let folder = path.parent().expect("a folder");
    let mut scene: Value =
        serde_json::from_slice(&fs::read(&path).expect("the scene")).expect("JSON");
    scene["objects"][0]["obj"] = json!("mesh:room");
    let obj = fs::read_to_string(folder.join("box.obj")).expect("the mesh");
    let meshes = HashMap::from([("room".into(), Mesh::new(groups(&obj)).expect("a mesh"))]);
    let in_memory = load_with(scene, Path::new("nowhere"), &meshes).expect("a scene");
    assert!(in_memory.files.is_empty(), "{:?}", in_memory.files);

    let ((from_files, flat), (in_memory, _)) =
        (result(&load(&path).expect("a scene")), result(&in_memory));
    let json = |result: &RunResult| serde_json::to_string(result).expect("JSON");
    assert_eq!(json(&from_files), json(&in_memory));

    // the flat arrays hold the same numbers as the nested lists
    for (c, captor) in from_files.captors.iter().enumerate() {
        let (value, error) = flat.get(c, phylux::Channel::Front, 0);
        assert_eq!(Some(value), captor.front.flux.first().copied(), "{}", captor.id);
        let known = Some(error).filter(|error| !error.is_nan());
        assert_eq!(known, captor.front.flux_se[0]);
        let (absorbed, _) = flat.get(c, phylux::Channel::Absorbed, 0);
        assert_eq!(absorbed.is_nan(), captor.absorbed.is_none());
        assert!(captor.absorbed.as_ref().is_none_or(|values| values[0] == absorbed));
    }
}

#[test]
fn a_mesh_that_is_not_there_is_named() {
    let scene = |mesh: &str| {
        json!({
            "materials": { "grey": { "type": "lambert", "reflectance": 0.5 } },
            "objects": [{ "obj": mesh, "material": "grey" }],
            "lights": [{ "type": "point", "position": [0, 0, 1], "power": 1 }],
        })
    };
    let mesh = Mesh::from_faces(&[DVec3::X, DVec3::Y, DVec3::Z], &[[0, 1, 2]]).expect("a mesh");
    let meshes = HashMap::from([("leaf".to_string(), mesh)]);
    let error = |mesh: &str, meshes: &HashMap<String, Mesh>| {
        load_with(scene(mesh), Path::new(""), meshes).expect_err("an error").to_string()
    };
    let text = error("mesh:lead", &meshes);
    assert!(text.contains("/objects/0/obj") && text.contains("did you mean `leaf`?"), "{text}");
    let text = error("mesh:leaf", &HashMap::new());
    assert!(text.contains("meshes can only be handed over by a program"), "{text}");
    // an empty folder
    let text = error("none.obj", &meshes);
    assert!(text.contains("none.obj: there is no such file"), "{text}");
}
