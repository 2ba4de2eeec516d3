//! Scenes whose meshes are PLY, STL and glTF files, and what their files say but is not used.

use std::{fs, process::Command};

use serde_json::{Value, json};

use crate::common::{TestScene, binary, front};

/// A square of 1 m that faces up, as each of the formats writes it.
const OBJ: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\ng blade\nf 1 2 3\nf 1 3 4\n";
const PLY: &str = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n\
    element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3\n";
const STL: &str = "solid blade\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 1 1 0\nendloop\n\
    endfacet\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 1 0\nvertex 0 1 0\nendloop\nendfacet\n\
    endsolid blade\n";

/// A glTF of one node, with its square in a file beside it.
fn gltf(node: &Value) -> String {
    json!({
        "asset": { "version": "2.0" },
        "scenes": [{ "nodes": [0] }],
        "nodes": [node],
        "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0 }, "indices": 1, "material": 0 }] }],
        "materials": [{ "name": "green", "alphaMode": "MASK" }],
        "accessors": [
            { "bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3" },
            { "bufferView": 1, "componentType": 5121, "count": 6, "type": "SCALAR" }
        ],
        "bufferViews": [
            { "buffer": 0, "byteLength": 48 }, { "buffer": 0, "byteOffset": 48, "byteLength": 6 }
        ],
        "buffers": [{ "byteLength": 54, "uri": "blade.bin" }]
    })
    .to_string()
}

/// The corners of the square with y up, and of its triangles.
fn buffer() -> Vec<u8> {
    let points = [[0, 0, 0], [1, 0, 0], [1, 0, -1], [0, 0, -1]];
    let bytes = points.iter().flatten().flat_map(|&x: &i32| (x as f32).to_le_bytes());
    bytes.chain([0, 1, 2, 0, 2, 3]).collect()
}

/// A scene of one object below the zenith sun of 100 W/m2, whose front reflects 0.1 and whose back
/// reflects 0.6: the light absorbed says which side is up.
fn scene(object: Value) -> Value {
    let mut object = object;
    object["captor"] = json!(true);
    json!({
        "materials": { "green": { "type": "leaf", "ior": 1, "reflectance": 0.1,
            "transmittance": 0, "back": { "reflectance": 0.6 } } },
        "objects": [object],
        "sun_at": { "elevation_deg": 90, "azimuth_deg": 0 },
        "lights": [{ "type": "sun", "irradiance": 100, "half_angle_deg": 0 }]
    })
}

fn written(scene: &Value) -> TestScene {
    let node = json!({ "name": "blade", "mesh": 0 });
    let mirrored =
        json!({ "name": "blade", "mesh": 0, "scale": [-1, 1, 1], "translation": [1, 0, 0] });
    let (plain, mirrored) = (gltf(&node), gltf(&mirrored));
    let files = [
        ("a.obj", OBJ),
        ("a.ply", PLY),
        ("a.stl", STL),
        ("a.gltf", plain.as_str()),
        ("mirrored.gltf", mirrored.as_str()),
    ];
    let written = TestScene::new(&scene.to_string(), &files);
    fs::write(written.path("blade.bin"), buffer()).expect("a buffer");
    written
}

/// Every format gives the same square, facing the same way; also a mirrored node does.
///
/// The light absorbed has no error beyond rounding, since every photon of the sun that meets the
/// square leaves its mean: 20,000 photons, seed 1, and 3 % are more than 6 errors.
#[test]
fn all_formats_are_the_same_square() {
    for (file, id) in [
        ("a.obj", "o/blade"),
        ("a.ply", "o/a"),
        ("a.stl", "o/blade"),
        ("a.gltf", "o/blade"),
        ("mirrored.gltf", "o/blade"),
    ] {
        let scene = scene(json!({ "name": "o", "obj": file, "material": "green" }));
        let result = written(&scene).run(20_000, 1);
        let captor = &result.captors[0];
        assert_eq!(captor.id, id, "{file}");
        assert!(
            (captor.area - 1.0).abs() < 1e-6 && captor.center[2].abs() < 1e-6,
            "{file}: {captor:?}"
        );
        assert!(captor.center[1] > 0.4, "{file}: {captor:?}");
        let absorbed = captor.absorbed.as_ref().expect("a surface")[0];
        assert!((absorbed - 90.0).abs() < 3.0, "{file}: {absorbed}");
    }
}

/// A glTF is in metres, whatever the scene's unit, and `up` says otherwise only if it is given.
#[test]
fn a_gltf_is_in_metres_with_y_up() {
    let bounds = |unit: &str, keys: Value| {
        let mut object = json!({ "name": "o", "obj": "a.gltf" });
        object.as_object_mut().expect("an object").extend(keys.as_object().expect("keys").clone());
        let mut scene = scene(object);
        scene["unit"] = json!(unit);
        let captor = &written(&scene).run(1000, 1).captors[0];
        (captor.area, captor.normal)
    };
    let close = |(area, normal): (f64, [f64; 3]), (a, n): (f64, [f64; 3])| {
        let near = normal.iter().zip(n).all(|(x, y)| (x - y).abs() < 1e-6);
        assert!((area - a).abs() < 1e-5 && near, "{area} {normal:?}");
    };
    close(bounds("cm", json!({})), (1.0, [0.0, 0.0, 1.0]));
    close(bounds("cm", json!({ "up": "y", "transform": { "scale": 2 } })), (4.0, [0.0, 0.0, 1.0]));
    close(bounds("m", json!({ "up": "z" })), (1.0, [0.0, 1.0, 0.0]));
}

/// Captors and area lights take the same files.
#[test]
fn captors_and_lights_take_all_formats() {
    for file in ["a.ply", "a.stl", "a.gltf"] {
        let scene = json!({
            "unit": "m",
            "lights": [{ "type": "area", "obj": file, "power": 10 }],
            "captors": [{ "name": "above", "obj": file }]
        });
        let found = TestScene::run(&written(&scene), 1000, 1);
        assert!((found.captors[0].area - 1.0).abs() < 1e-6, "{file}");
    }
}

/// Returns what the command says on its standard error.
fn said(scene: &TestScene, command: &[&str]) -> String {
    let output = Command::new(binary())
        .args(command)
        .arg(scene.path("scene.json"))
        .current_dir(scene.path(""))
        .output()
        .expect("the program");
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// `run` and `check` say the same once.
fn said_once(scene: &TestScene, sentence: &str) {
    let run = ["run", "--photons", "1000", "-o", "out.json", "--quiet"];
    for command in [&run[..], &["check"]] {
        let said = said(scene, command);
        assert_eq!(said.matches(sentence).count(), 1, "{command:?}: {sentence}\n{said}");
    }
}

#[test]
fn what_a_file_says_but_is_not_used_is_said_once() {
    let gltf = scene(json!({ "name": "o", "obj": "a.gltf" }));
    said_once(&written(&gltf), "a.gltf: the alphaMode of `green` is not read");
    let twice = format!("{OBJ}g stem\nf 1 2 3\ng blade\nf 1 2 4\n");
    let merged = scene(json!({ "name": "o", "obj": "twice.obj", "material": "green",
        "instances": [{}, { "translate": [2, 0, 0] }] }));
    let merged = TestScene::new(&merged.to_string(), &[("twice.obj", &twice)]);
    said_once(&merged, "twice.obj: the name of a group comes again (`blade` at line 11)");
    // where groups count no light, their names do not matter
    let mut quiet = scene(json!({ "name": "o", "obj": "twice.obj", "material": "green" }));
    quiet["objects"][0]["captor"] = json!(false);
    quiet["captors"] = json!([{ "name": "s", "disc": { "center": [0.5, 0.5, 2], "normal": [0, 0, 1], "radius": 0.1 } }]);
    let quiet = TestScene::new(&quiet.to_string(), &[("twice.obj", &twice)]);
    assert!(!said(&quiet, &["check"]).contains("comes again"));
}

/// A pane that its MTL makes clear, under materials of the scene and without.
fn pane(statement: &str, keys: Value) -> TestScene {
    let mut object = json!({ "name": "o", "obj": "pane.obj" });
    object.as_object_mut().expect("an object").extend(keys.as_object().expect("keys").clone());
    let obj = OBJ.replace("g blade", "mtllib pane.mtl\ng blade\nusemtl glass");
    let mtl = format!(
        "newmtl glass\nKd 0.1 0.1 0.1\nKs 0 0 0\n{statement}\nillum 2\nnewmtl other\nd 0.5\n"
    );
    let mut scene = scene(object);
    scene["materials"]["glass"] = scene["materials"]["green"].clone();
    if keys == json!({}) {
        scene["materials"].as_object_mut().expect("materials").remove("glass");
    }
    TestScene::new(&scene.to_string(), &[("pane.obj", &obj), ("pane.mtl", &mtl)])
}

#[test]
fn what_an_mtl_says_but_is_not_used_is_said_whatever_overrides_it() {
    // by the MTL itself, by the object's material, by the scene's material of this name
    for keys in [json!({}), json!({ "material": "green" }), json!({ "group": "x" })] {
        for statement in [
            "d 0.2",
            "d -halo 0.2",
            "D 0",
            "Tr 0.8",
            "Tf 0.8 0.8 0.8",
            "Tf 0.8",
            "bump -bm 0.5 b.png",
            "map_Bump b.png",
            "norm b.png",
            "disp b.png",
            "decal b.png",
            "refl -type sphere b.png",
            "map_Ks b.png",
            "map_Ns b.png",
            "map_Ke b.png",
            "map_opacity b.png",
            "Pm 1",
            "Kdd 1 1 1",
        ] {
            let sentence = format!("its MTL says `{statement}` of `glass`, which means something");
            let scene = pane(statement, keys.clone());
            let said = said(&scene, &["check"]);
            assert_eq!(said.matches(&sentence).count(), 1, "{keys} {statement}\n{said}");
        }
        for statement in [
            "d 1.0",
            "d 1",
            "Tr 0",
            "Tr 0.000",
            "Tf 1 1 1",
            "Ka 1 1 1",
            "Ni 1.5",
            "Pr 0.5",
            "sharpness 60",
            "Pm 0.0",
            "# d 0.2",
        ] {
            let said = said(&pane(statement, keys.clone()), &["check"]);
            assert!(!said.contains("its MTL says"), "{keys} {statement}\n{said}");
        }
    }
    said_once(
        &pane("d 0.2\nTr 0.8\nTf 0.1 0.1 0.1", json!({ "material": "green" })),
        "its MTL says \
        `d 0.2` of `glass`, `Tr 0.8` of `glass`, `Tf 0.1 0.1 0.1` of `glass`, which means something",
    );
    // light of the MTL that a material of the scene puts out
    said_once(
        &pane("Ke 5 5 5", json!({ "material": "green" })),
        "its MTL says `Ke 5 5 5` of `glass`",
    );
    // a leaf uses its filter
    let leaf = pane("illum 6\nTf 0.1 0.1 0.1", json!({}));
    let mtl = "newmtl glass\nKd 0.1 0.1 0.1\nTf 0.1 0.1 0.1\nillum 6\n";
    fs::write(leaf.path("pane.mtl"), mtl).expect("the MTL");
    assert!(!said(&leaf, &["check"]).contains("its MTL says"));
}

#[test]
fn statements_of_an_obj_that_are_not_used_are_said_or_refused() {
    let object = || scene(json!({ "name": "o", "obj": "b.obj", "material": "green" }));
    for (statement, sentence) in [
        ("usemap a.png", "b.obj: `usemap` at line 1 is not read: a picture on the faces"),
        ("shadow_obj a.obj", "b.obj: `shadow_obj` at line 1 is not read"),
        ("trace_obj a.obj", "b.obj: `trace_obj` at line 1 is not read"),
        ("bsp 1 2 3", "b.obj:1: free-form surfaces (`bsp`) are not supported"),
        ("bzp 1 2 3", "b.obj:1: free-form surfaces (`bzp`) are not supported"),
        ("call a.obj", "b.obj:1: `call` (another file or a command) is not followed"),
    ] {
        let obj = format!("{statement}\n{OBJ}");
        said_once(&TestScene::new(&object().to_string(), &[("b.obj", &obj)]), sentence);
    }
}

#[test]
fn files_without_materials_say_what_to_do() {
    for (file, sentence) in [
        ("a.ply", "a.ply: the file names no material; give the object a `material`"),
        ("a.stl", "a.stl: the file names no material"),
        ("none.glb", "none.glb: there is no such file"),
    ] {
        let said = said(&written(&scene(json!({ "name": "o", "obj": file }))), &["check"]);
        assert!(said.contains(sentence), "{said}");
    }
    let mut other = scene(json!({ "name": "o", "obj": "a.gltf" }));
    other["materials"] = json!({ "greens": other["materials"]["green"] });
    let said = said(&written(&other), &["check"]);
    assert!(said.contains("a.gltf: no material `green`; did you mean `greens`?"), "{said}");
}

/// The buffers of a glTF count among the files of a scene, as those of an OBJ do.
#[test]
fn every_file_that_is_read_is_known() {
    let scene = written(&scene(json!({ "name": "o", "obj": "a.gltf" })));
    let loaded = phylux::load(&scene.path("scene.json")).expect("a scene");
    let names: Vec<_> = loaded.files.iter().filter_map(|file| file.file_name()).collect();
    assert_eq!(names, ["scene.json", "a.gltf", "blade.bin"]);
    let front = front(&scene.run(1000, 1), "o/blade").irradiance[0];
    assert!((front - 100.0).abs() < 10.0, "{front}");
}
