//! Scenes whose meshes are in memory give the same results as scenes from files, to the byte.

use std::{collections::HashMap, fs, path::Path};

use glam::DVec3;
use phylux::{
    Control, FlatResult, LoadedScene, RunResult, Scene,
    formats::{Mesh, MeshGroup, SceneBuilder, load_with, spec::*},
    load,
    math::Quantity,
    transport::PhotonCount,
};
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
    let control = Control::default();
    let settings =
        phylux::Settings { photons: PhotonCount::new(20_000).ok(), ..loaded.settings.clone() };
    let simulation = phylux::simulate(&loaded.scene, &settings, &control).expect("a run");
    let flat = FlatResult::new(&simulation);
    (RunResult::new(&simulation), flat)
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
        let (value, error) = flat.get(c, phylux::scene::Channel::Front, 0);
        assert_eq!(Some(value), captor.front.flux.first().copied(), "{}", captor.id);
        let known = Some(error).filter(|error| !error.is_nan());
        assert_eq!(known, captor.front.flux_se[0]);
        let (absorbed, _) = flat.get(c, phylux::scene::Channel::Absorbed, 0);
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

/// A scene of typed values is the scene of the JSON that says the same: by its digest, by its ids,
/// and by the sentences of its errors. The test does not depend on chance.
#[test]
fn a_builder_makes_the_scene_of_a_file() {
    let floor = || {
        let corners = [[0., 0., 0.], [1., 0., 0.], [1., 1., 0.], [0., 1., 0.]].map(DVec3::from);
        Mesh::from_faces(&corners, &[[0, 1, 2], [0, 2, 3]]).expect("a floor")
    };
    let scene = |reflectance: f64| {
        SceneBuilder::new()
            .name("both")
            .quantity(Quantity::Micromole)
            .band("blue", 400.0, 500.0)
            .band("red", 600.0, 700.0)
            .material("soil", LambertSpec::new([0.1, reflectance]))
            .material("leaf", LeafSpec::new(0.08, 0.05))
            .mesh("floor", floor())
            .object(ObjectSpec::mesh("floor", "soil"))
            .object(ObjectSpec {
                name: Some("plant".into()),
                ..ObjectSpec::mesh("floor", "leaf").captor().at([[0., 0., 1.], [2., 0., 1.]])
            })
            .light(PointSpec { watts: Some(50.0), ..PointSpec::new([0., 0., 2.], [1.0, 2.0]) })
            .light(TubeSpec::new([0., 0., 3.], [1., 0., 3.], 0.02, 5.0))
            .captor(CaptorSpec::disc("sensor", [0., 0., 0.5], [0., 0., 1.], 0.1))
            .group("all", ["sensor", "plant*"])
            .build()
    };
    let file = |reflectance: f64| {
        let json = json!({
            "name": "both",
            "quantity": "umol/s",
            "bands": [{ "name": "blue", "from_nm": 400, "to_nm": 500 },
                      { "name": "red", "from_nm": 600, "to_nm": 700 }],
            "materials": {
                "soil": { "type": "lambert", "reflectance": [0.1, reflectance] },
                "leaf": { "type": "leaf", "reflectance": 0.08, "transmittance": 0.05 },
            },
            "objects": [
                { "name": "floor", "obj": "mesh:floor", "material": "soil" },
                { "name": "plant", "obj": "mesh:floor", "material": "leaf", "captor": true,
                  "instances": [{ "translate": [0, 0, 1] }, { "translate": [2, 0, 1] }] },
            ],
            "lights": [
                { "type": "point", "position": [0, 0, 2], "power": [1, 2], "watts": 50 },
                { "type": "tube", "from": [0, 0, 3], "to": [1, 0, 3], "radius": 0.02, "power": 5 },
            ],
            "captors": [{ "name": "sensor",
                          "disc": { "center": [0, 0, 0.5], "normal": [0, 0, 1], "radius": 0.1 } }],
            "groups": { "all": ["sensor", "plant*"] },
        });
        load_with(json, Path::new(""), &HashMap::from([("floor".to_string(), floor())]))
    };
    let (made, read) = (scene(0.2).expect("a scene"), file(0.2).expect("a scene"));
    assert_eq!(made.scene.digest(), read.scene.digest());
    let ids = |scene: &Scene| scene.captors().iter().map(|c| c.id.clone()).collect::<Vec<_>>();
    assert_eq!(ids(&made.scene), ids(&read.scene));
    assert_eq!(ids(&made.scene).len(), 3);
    assert_eq!(made.warnings, read.warnings);
    let sentence = |result: phylux::Result<LoadedScene>| result.expect_err("refused").to_string();
    let refused = sentence(scene(1.2));
    assert_eq!(refused, sentence(file(1.2)));
    assert!(refused.starts_with("scene: /materials/soil/reflectance"), "{refused}");
    let twice = SceneBuilder::new()
        .material("soil", LambertSpec::new(0.1))
        .material("soil", LambertSpec::new(0.2))
        .light(PointSpec::new([0.; 3], 1.0));
    let twice = twice.build().expect_err("two of one name").to_string();
    assert!(twice.starts_with("scene: /materials: `soil` is there twice"), "{twice}");
}

/// Errors of a run of a scene in memory name the scene and the place in it, and not a mesh that was
/// read for it.
#[test]
fn errors_name_the_scene() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    fs::write(folder.path().join("a.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").expect("a file");
    let scene = json!({
        "materials": { "k": { "type": "lambert", "reflectance": 0.5 } },
        "objects": [{ "obj": "a.obj", "material": "k" }],
        "lights": [{ "type": "point", "position": [0, 0, 1], "power": 1 }],
        "settings": { "guiding": "aim" }
    });
    let loaded = load_with(scene, folder.path(), &HashMap::new()).unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(loaded.files, [folder.path().join("a.obj")]);
    let at = |pointer| format!("{}: {pointer}", folder.path().join("scene").display());
    assert_eq!(loaded.check_captors().unwrap_err().place(), at("/captors"));
    let error = loaded.placed(phylux::Error::input("guiding", "not here"));
    assert_eq!(error.place(), at("/settings/guiding"));
}
