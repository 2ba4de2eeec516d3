//! Files of each format, well written, badly written and damaged.

use std::path::Path;

use base64::{Engine, engine::general_purpose::STANDARD};
use glam::DVec3;
use proptest::{collection::vec, prelude::*, sample::Index};
use serde_json::{Value, json};

use super::parse;
use crate::obj::ObjFile;
use phylux_core::error::Result;
use phylux_testing::{check_error, check_finite, spoiled};

type Triangles = Vec<[DVec3; 3]>;

fn read(name: &str, bytes: impl AsRef<[u8]>) -> Result<ObjFile> {
    parse(bytes.as_ref(), Path::new(name), |path| match path.to_str() {
        Some("dir/a b.bin") => Ok(points(&SQUARE)),
        _ => Err("there is no such file".into()),
    })
}

fn refused(name: &str, bytes: impl AsRef<[u8]>) -> String {
    read(name, bytes).expect_err("an error").to_string()
}

/// The name and the triangles of each group.
fn groups(file: &ObjFile) -> Vec<(Option<&str>, Triangles)> {
    let mut found: Vec<(Option<&str>, Triangles)> =
        file.groups.iter().map(|group| (group.name.as_deref(), Vec::new())).collect();
    for part in &file.parts {
        found[part.group].1.extend_from_slice(&part.triangles);
    }
    found
}

fn triangle(corners: [[f64; 3]; 3]) -> [DVec3; 3] {
    corners.map(DVec3::from)
}

const SQUARE: [[f32; 3]; 4] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];

/// The two triangles of the square.
fn halves() -> Triangles {
    let [a, b, c, d] = SQUARE.map(|p| p.map(f64::from));
    vec![triangle([a, b, c]), triangle([a, c, d])]
}

/// The bytes of points, as in binary files of little endian.
fn points(points: &[[f32; 3]]) -> Vec<u8> {
    points.iter().flatten().flat_map(|x| x.to_le_bytes()).collect()
}

const PLY: &str = "ply\nformat ascii 1.0\ncomment by hand\nelement vertex 4\nproperty float x\nproperty double y\n\
    property float32 z\nproperty uchar red\nelement face 2\nproperty list uchar int vertex_indices\n\
    property uchar flags\nend_header\n";
const PLY_BODY: &str = "0 0 0 255\n1 0 0 255\n1 1 0 255\n0 1 0 255\n3 0 1 2 0\n3 0 2 3 0\n";

/// The same file in binary.
fn binary_ply(big: bool) -> Vec<u8> {
    let form = if big { "binary_big_endian" } else { "binary_little_endian" };
    let mut bytes = PLY.replace("ascii", form).into_bytes();
    let mut put = |value: &[u8]| {
        let turned = value.iter().rev().copied();
        bytes.extend(if big { turned.collect() } else { value.to_vec() });
    };
    for [x, y, z] in SQUARE {
        put(&x.to_le_bytes());
        put(&f64::from(y).to_le_bytes());
        put(&z.to_le_bytes());
        put(&[255]);
    }
    for face in [[0, 1, 2], [0, 2, 3_i32]] {
        put(&[3]);
        face.iter().for_each(|corner| put(&corner.to_le_bytes()));
        put(&[0]);
    }
    bytes
}

#[test]
fn ply_files_are_read_however_they_are_written() {
    let text = format!("{PLY}{PLY_BODY}");
    let polygon = text
        .replace("element face 2", "element face 1")
        .replace("3 0 1 2 0\n3 0 2 3 0\n", "4 0 1 2 3 0\n");
    let first = "ply\nformat ascii 1.0\nelement face 2\nproperty list uint8 uint16 vertex_index\n\
         element vertex 4\nproperty float z\nproperty float x\nproperty float y\nend_header\n\
         3 0 1 2\n\n  3\t0 2 3\n0 0 0\n0 1 0\n0 1 1\n0 0 1\n";
    for bytes in [
        text.clone().into_bytes(),
        text.replace('\n', "\r\n").into_bytes(),
        text.replace('\n', "\r").into_bytes(),
        text.trim_end().as_bytes().to_vec(),
        text.replace("comment by hand", "obj_info x\nelement edge 0\nproperty int vertex1").into(),
        polygon.into_bytes(),
        first.as_bytes().to_vec(),
        binary_ply(false),
        binary_ply(true),
    ] {
        let file = read("dir/a.PLY", &bytes).unwrap_or_else(|e| panic!("{e}"));
        let text = String::from_utf8_lossy(&bytes);
        assert_eq!(groups(&file), [(None, halves())], "{text}");
        assert_eq!((file.notes, file.merged), (vec![], None), "{text}");
    }
    let far = text.replace("1 0 0 255", "10000.00000001 -.5 1e-3 255");
    let corner = read("a.ply", far).unwrap().parts[0].triangles[0][1];
    assert_eq!(corner, DVec3::new(10000.00000001, -0.5, 1e-3));
}

#[test]
fn what_a_ply_file_says_besides_is_told() {
    let text = format!("{PLY}{PLY_BODY}");
    let note = |text: &str| read("a.ply", text).unwrap().notes.join("; ");
    assert!(note(&text.replace("uchar flags", "uchar label")).starts_with("`label` of its faces"));
    assert_eq!(
        note(&format!("{text}\n9 9\n")),
        "text from line 20 on after its last element: not read"
    );
    let bent = text
        .replace("element face 2", "element face 1")
        .replace("1 1 0 255", "1 1 0.5 255")
        .replace("3 0 1 2 0\n3 0 2 3 0\n", "4 0 1 2 3 0\n");
    assert!(note(&bent).starts_with("1 of its faces are not flat"));
    let mut bytes = binary_ply(false);
    bytes.extend([1, 2, 3]);
    let notes = read("a.ply", bytes).unwrap().notes;
    assert_eq!(notes, ["3 bytes after its last element: not read"]);
}

#[test]
fn errors_of_ply_files_name_the_place() {
    let text = format!("{PLY}{PLY_BODY}");
    let huge = "ply\nformat ascii 1.0\nelement x 99999999999999999\nelement vertex 1\nproperty float x\n\
                property float y\nproperty float z\nelement face 0\nproperty list uchar int vertex_index\n\
                end_header\n0 0 0\n";
    for (text, start) in [
        ("", "dir/a.ply: is no PLY file"),
        ("solid x\n", "dir/a.ply: is no PLY file"),
        ("ply\nformat ascii 1.0\nelement vertex 4\n", "dir/a.ply:4: no `end_header`"),
        (&text.replace("ascii", "utf8"), "dir/a.ply:2: unknown format `utf8`"),
        (&text.replace("format ascii 1.0\n", ""), "dir/a.ply: no `format`"),
        (&text.replace("vertex 4", "vertex -4"), "dir/a.ply:4: `-4` is no number of elements"),
        (&text.replace("double y", "real y"), "dir/a.ply:6: `property real y` is no property"),
        (&text.replace("double y", "double x"), "dir/a.ply:6: a second property `x`"),
        (&text.replace("double y", "double w"), "dir/a.ply: its vertices have no `y`"),
        (
            &text.replace("vertex_indices", "corners"),
            "dir/a.ply: its faces have no list of corners",
        ),
        (&text.replace("element face", "element vertex"), "dir/a.ply:9: a second element `vertex`"),
        (&text.replace("element face", "element tristrips"), "dir/a.ply: strips of triangles"),
        (&text.replace("1 0 0 255", "1 nan 0 255"), "dir/a.ply:14: vertex 1 has a coordinate"),
        (&text.replace("1 0 0 255", "1 1e999 0 255"), "dir/a.ply:14: vertex 1 has a coordinate"),
        (&text.replace("1 0 0 255", "1 0,5 0 255"), "dir/a.ply:14: vertex 1: `0,5` is no number"),
        (
            &text.replace("1 0 0 255", "1 0 0"),
            "dir/a.ply:14: vertex 1: fewer numbers than the head",
        ),
        (&text.replace("1 0 0 255", "1 0 0 255 7"), "dir/a.ply:14: vertex 1: `7` is more than the"),
        (
            &text.replace("3 0 2 3 0", "3 0 2 4 0"),
            "dir/a.ply:18: corner 4 of face 1, but there are 4",
        ),
        (&text.replace("3 0 2 3 0", "3 0 2 -1 0"), "dir/a.ply:18: corner -1 of face 1"),
        (&text.replace("3 0 2 3 0", "3 0 2 1.5 0"), "dir/a.ply:18: face 1 has a corner that is no"),
        (&text.replace("3 0 2 3 0", "2 0 2 0"), "dir/a.ply:18: face 1 has 2 corners, must have"),
        (&text.replace("3 0 2 3 0\n", ""), "dir/a.ply: ends before the end of face 1 of 2"),
        (
            &text.replace("face 2", "face 99999999999"),
            "dir/a.ply: 99999999999 faces, must be at most",
        ),
        (huge, "dir/a.ply: holds no face (1 vertices)"),
    ] {
        let error = refused("dir/a.ply", text);
        assert!(error.starts_with(start), "{error}\n{start}");
    }
    let bytes = binary_ply(false);
    let error = refused("dir/a.ply", &bytes[..bytes.len() - 2]);
    assert!(error.starts_with("dir/a.ply: ends before the end of face 1 of 2"), "{error}");
    let mut long = bytes.clone();
    let at = long.len() - 14;
    long[at] = 200;
    assert!(refused("dir/a.ply", &long).starts_with("dir/a.ply: ends before the end of face 1"));
}

const FACET: &str = "facet normal 0 0 1\n outer loop\n  vertex 0 0 0\n  vertex 1 0 0\n  vertex 1 1 0\n endloop\n\
    endfacet\n";
const FACET_2: &str =
    "facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 1 0\nvertex 0 1 0\nendloop\nendfacet\n";

fn binary_stl(head: &str) -> Vec<u8> {
    let mut bytes = head.as_bytes().to_vec();
    bytes.resize(80, b' ');
    bytes.extend(2_u32.to_le_bytes());
    for corners in halves() {
        bytes.extend(points(&[[0.0, 0.0, 1.0]]));
        bytes.extend(points(&corners.map(|p| p.as_vec3().to_array())));
        bytes.extend([0; 2]);
    }
    bytes
}

#[test]
fn stl_files_are_read_however_they_are_written() {
    let text = format!("solid my part\n{FACET}{FACET_2}endsolid my part\n");
    for (bytes, name) in [
        (text.clone().into_bytes(), Some("my part")),
        (text.replace('\n', "\r\n").into_bytes(), Some("my part")),
        (text.replace('\n', "\r").into_bytes(), Some("my part")),
        (text.replace("endsolid my part\n", "").into_bytes(), Some("my part")),
        (text.replace("endsolid my part", "endsolidmy part").into_bytes(), Some("my part")),
        (text.replace("end", "end ").into_bytes(), Some("my part")),
        (text.to_uppercase().into_bytes(), Some("MY PART")),
        (text.replace("my part", "").into_bytes(), None),
        (text.replace("normal 0 0 1", "normal nan nan nan").into_bytes(), Some("my part")),
        (binary_stl("by hand"), None),
        (binary_stl("solid, as many programs write"), None),
    ] {
        let file = read("a.stl", &bytes).unwrap_or_else(|e| panic!("{e}"));
        assert_eq!(groups(&file), [(name, halves())]);
        assert_eq!((file.notes, file.merged), (vec![], None));
    }
    let [first, second] = [0, 1].map(|i| vec![halves()[i]]);
    let two = format!("solid a\n{FACET}endsolid a\nsolid b\n{FACET_2}endsolid\n");
    assert_eq!(
        groups(&read("a.stl", two).unwrap()),
        [(Some("a"), first.clone()), (Some("b"), second)]
    );
    let same = format!("solid a\n{FACET}endsolid a\nsolid a\n{FACET}endsolid a\n");
    let file = read("a.stl", same).unwrap();
    assert_eq!(groups(&file), [(Some("a"), [first.clone(), first].concat())]);
    assert!(file.merged.unwrap().starts_with("the name of a group comes again (`a` at line 10)"));
}

#[test]
fn what_an_stl_file_says_besides_is_told() {
    let turned = format!("solid a\n{FACET}{FACET_2}").replacen("0 0 1", "0 0 -1", 1);
    let notes = read("a.stl", turned).unwrap().notes;
    assert!(notes[0].starts_with("1 of 2 triangles have a normal on the other side"), "{notes:?}");
    let mut long = binary_stl("x");
    long.extend([7; 9]);
    let notes = read("a.stl", long).unwrap().notes;
    assert!(notes[0].starts_with("its last 9 bytes are not read"), "{notes:?}");
}

#[test]
fn errors_of_stl_files_name_the_place() {
    let text = format!("solid a\n{FACET}endsolid a\n");
    for (text, start) in [
        ("", "dir/a.stl: is too short for an STL file"),
        ("v 0 0 0\n", "dir/a.stl: is too short"),
        ("solid a\nendsolid a\n", "dir/a.stl: holds no face (0 triangles)"),
        (&text.replace("1 1 0", "1 1"), "dir/a.stl:6: a vertex of fewer than 3 numbers"),
        (&text.replace("1 1 0", "1 1 0 0"), "dir/a.stl:6: a vertex of more than 3 numbers"),
        (&text.replace("1 1 0", "1 nan 0"), "dir/a.stl:6: `nan` is not a finite number"),
        (&text.replace("  vertex 1 1 0\n", ""), "dir/a.stl:7: a facet of 2 corners"),
        (
            &text.replace("vertex 1 1 0", "vertex 1 1 0\nvertex 0 1 0"),
            "dir/a.stl:7: a facet of more",
        ),
        (&text.replace("outer loop", "inner loop"), "dir/a.stl:3: `inner` inside of a facet"),
        (&text.replace("facet normal", "face normal"), "dir/a.stl:2: `face` outside of a facet"),
        (&text.replace("endfacet\nendsolid a\n", ""), "dir/a.stl: ends inside of a facet"),
    ] {
        let error = refused("dir/a.stl", text);
        assert!(error.starts_with(start), "{error}\n{start}");
    }
    let bytes = binary_stl("x");
    let error = refused("dir/a.stl", &bytes[..bytes.len() - 1]);
    assert!(error.starts_with("dir/a.stl: says 2 triangles, but holds 1 and then ends"), "{error}");
    let mut bad = bytes;
    bad[84 + 50 + 12..][..4].copy_from_slice(&f32::NAN.to_le_bytes());
    assert!(refused("dir/a.stl", bad).starts_with("dir/a.stl: triangle 1 has a coordinate"));
}

/// A glTF with the square as one mesh, its y axis up: after turning it stands upright.
fn gltf() -> Value {
    let bytes = [points(&SQUARE), [0, 1, 2, 0, 2, 3].to_vec()].concat();
    json!({
        "asset": { "version": "2.0" },
        "scene": 0,
        "scenes": [{ "nodes": [0] }],
        "nodes": [{ "name": "leaf", "mesh": 0 }],
        "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0 }, "indices": 1, "material": 0 }] }],
        "materials": [{ "name": "green" }],
        "accessors": [
            { "bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3" },
            { "bufferView": 1, "componentType": 5121, "count": 6, "type": "SCALAR" }
        ],
        "bufferViews": [
            { "buffer": 0, "byteLength": 48 }, { "buffer": 0, "byteOffset": 48, "byteLength": 6 }
        ],
        "buffers": [{ "byteLength": 54, "uri": uri(&bytes) }]
    })
}

fn uri(bytes: &[u8]) -> String {
    format!("data:application/octet-stream;base64,{}", STANDARD.encode(bytes))
}

/// The same with changes: pairs of JSON pointers and values.
fn changed(changes: &[(&str, Value)]) -> Vec<u8> {
    let mut scene = gltf();
    for (pointer, value) in changes {
        let (parent, key) = pointer.rsplit_once('/').expect("a pointer");
        match scene.pointer_mut(parent).expect("a parent") {
            Value::Object(map) => drop(map.insert(key.into(), value.clone())),
            Value::Array(list) if key == "-" => list.push(value.clone()),
            Value::Array(list) => list[key.parse::<usize>().expect("an index")] = value.clone(),
            _ => panic!("{pointer}"),
        }
    }
    serde_json::to_vec(&scene).expect("JSON")
}

fn glb(json: &[u8], own: &[u8]) -> Vec<u8> {
    let mut bytes = b"glTF".to_vec();
    let padded = |bytes: &[u8], pad| {
        let mut bytes = bytes.to_vec();
        bytes.resize(bytes.len().next_multiple_of(4), pad);
        bytes
    };
    let (json, own) = (padded(json, b' '), padded(own, 0));
    bytes.extend(2_u32.to_le_bytes());
    bytes.extend((28 + json.len() as u32 + own.len() as u32).to_le_bytes());
    for (kind, chunk) in [(b"JSON", json), (b"BIN\0", own)] {
        bytes.extend((chunk.len() as u32).to_le_bytes());
        bytes.extend(kind);
        bytes.extend(chunk);
    }
    bytes
}

/// Triangles with y up, turned so that z is up.
fn upright(triangles: Triangles) -> Triangles {
    triangles.iter().map(|t| t.map(|p| DVec3::new(p.x, -p.z, p.y))).collect()
}

#[test]
fn gltf_files_are_read_however_they_are_written() {
    let own = [points(&SQUARE), [0, 1, 2, 0, 2, 3].to_vec()].concat();
    let short = [0_u16, 1, 2, 0, 2, 3].map(u16::to_le_bytes).concat();
    let wide = [points(&SQUARE), [0_u32, 1, 2, 0, 2, 3].map(u32::to_le_bytes).concat()].concat();
    let strip = [points(&SQUARE), vec![1, 2, 0, 3]].concat();
    let fan = [points(&SQUARE), vec![0, 1, 2, 3]].concat();
    let indices = |kind, count| json!({ "bufferView": 1, "componentType": kind, "count": count, "type": "SCALAR" });
    let buffer = |bytes: &[u8]| json!([{ "byteLength": bytes.len(), "uri": uri(bytes) }]);
    let view = |length: usize| json!({ "buffer": 0, "byteOffset": 48, "byteLength": length });
    let small: Vec<u8> = SQUARE.iter().flat_map(|p| p.map(|x| (x * 127.0) as u8)).collect();
    let small = [small, vec![0, 1, 2, 0, 2, 3]].concat();
    // zeros, of which three are replaced
    let sparse = [vec![1, 2, 3, 0], points(&SQUARE[1..])].concat();
    let mode = "/meshes/0/primitives/0/mode";
    for (what, bytes) in [
        ("base64", changed(&[])),
        ("glb", glb(&changed(&[("/buffers/0", json!({ "byteLength": 54 }))]), &own)),
        ("no scene", changed(&[("/scene", Value::Null), ("/scenes", json!([]))])),
        (
            "16 bits",
            changed(&[
                ("/buffers/-", buffer(&short)[0].clone()),
                ("/bufferViews/1", json!({ "buffer": 1, "byteLength": 12 })),
                ("/accessors/1", indices(5123, 6)),
            ]),
        ),
        (
            "32 bits",
            changed(&[
                ("/buffers", buffer(&wide)),
                ("/bufferViews/1", view(24)),
                ("/accessors/1", indices(5125, 6)),
            ]),
        ),
        (
            "a file beside",
            changed(&[
                ("/buffers/-", buffer(&[0, 1, 2, 0, 2, 3])[0].clone()),
                ("/buffers/0", json!({ "byteLength": 48, "uri": "a%20b.bin" })),
                ("/bufferViews/1", json!({ "buffer": 1, "byteLength": 6 })),
            ]),
        ),
        (
            "whole numbers, scaled",
            changed(&[
                ("/buffers", buffer(&small)),
                ("/bufferViews/0", json!({ "buffer": 0, "byteLength": 12 })),
                ("/bufferViews/1", json!({ "buffer": 0, "byteOffset": 12, "byteLength": 6 })),
                ("/accessors/0/componentType", json!(5120)),
                ("/accessors/0/normalized", json!(true)),
                ("/extensionsUsed", json!(["KHR_mesh_quantization"])),
                ("/extensionsRequired", json!(["KHR_mesh_quantization"])),
            ]),
        ),
        (
            "sparse",
            changed(&[
                ("/buffers/-", buffer(&sparse)[0].clone()),
                ("/bufferViews/-", json!({ "buffer": 1, "byteLength": 40 })),
                (
                    "/accessors/0",
                    json!({ "componentType": 5126, "count": 4, "type": "VEC3", "sparse": {
                        "count": 3, "indices": { "bufferView": 2, "componentType": 5121 },
                        "values": { "bufferView": 2, "byteOffset": 4 } } }),
                ),
            ]),
        ),
        (
            "nodes",
            changed(&[
                (
                    "/nodes/0",
                    json!({ "children": [1], "translation": [0, 0, 5], "scale": [2, 2, 2] }),
                ),
                (
                    "/nodes/-",
                    json!({ "name": "leaf", "mesh": 0, "scale": [0.5, 0.5, 0.5],
                        "matrix": null, "translation": [0, 0, -2.5] }),
                ),
            ]),
        ),
    ] {
        let file = read("dir/a.gltf", &bytes).unwrap_or_else(|e| panic!("{what}: {e}"));
        assert_eq!(groups(&file), [(Some("leaf"), upright(halves()))], "{what}");
        assert_eq!(file.parts[0].material.as_deref(), Some("green"));
        assert_eq!((file.notes, file.merged), (vec![], None), "{what}");
    }
    for (what, bytes, second) in [("strip", strip, [2, 3, 0]), ("fan", fan, [2, 3, 0])] {
        let file = changed(&[
            ("/buffers", buffer(&bytes)),
            ("/bufferViews/1", view(4)),
            ("/accessors/1", indices(5121, 4)),
            (mode, json!(if what == "strip" { 5 } else { 6 })),
        ]);
        let file = read("a.gltf", file).unwrap();
        let face =
            |[a, b, c]: [usize; 3]| triangle([a, b, c].map(|i: usize| SQUARE[i].map(f64::from)));
        // the first corner may be another one, but the order is the same
        let first = [1, 2, 0];
        let found = &groups(&file)[0].1;
        let normals = |t: &[DVec3; 3]| (t[1] - t[0]).cross(t[2] - t[0]);
        let expected = upright(vec![face(first), face(second)]);
        assert_eq!(found.len(), 2, "{what}");
        for (a, b) in found.iter().zip(&expected) {
            assert_eq!(normals(a), normals(b), "{what}");
            assert_eq!(a.iter().sum::<DVec3>(), b.iter().sum::<DVec3>(), "{what}");
        }
    }
}

/// A mirrored node keeps its fronts: what faces the viewer still does.
#[test]
fn a_mirrored_node_keeps_its_fronts() {
    let normal = |node: Value| {
        let file = read("a.gltf", changed(&[("/nodes/0", node)])).unwrap();
        let [a, b, c] = file.parts[0].triangles[0];
        (b - a).cross(c - a).normalize()
    };
    // the square faces z of the glTF, which is -y here
    let front = -DVec3::Y;
    let near = |a: DVec3, b: DVec3| assert!(a.distance(b) < 1e-12, "{a} {b}");
    near(normal(json!({ "mesh": 0 })), front);
    near(normal(json!({ "mesh": 0, "scale": [-1, 1, 1] })), front);
    near(normal(json!({ "mesh": 0, "scale": [1, -2, 1] })), front);
    near(normal(json!({ "mesh": 0, "scale": [-1, -1, 1] })), front);
    near(normal(json!({ "mesh": 0, "scale": [1, 1, -1] })), -front);
    let mirror = [-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 3, 0, 0, 1];
    near(normal(json!({ "mesh": 0, "matrix": mirror })), front);
    // half a turn about y
    near(normal(json!({ "mesh": 0, "rotation": [0, 1, 0, 0] })), -front);
}

#[test]
fn what_a_gltf_says_besides_is_told() {
    let two =
        [("/scenes/0/nodes", json!([0, 1])), ("/nodes/-", json!({ "name": " leaf\n", "mesh": 0 }))];
    let merged = read("a.gltf", changed(&two)).unwrap().merged.unwrap();
    assert!(merged.starts_with("the name of a group comes again (`leaf` at node 1)"), "{merged}");
    for (pointer, value, start) in [
        ("/animations", json!([{}]), "its animations are not read"),
        ("/cameras", json!([{}]), "its cameras are not read"),
        ("/nodes/0/skin", json!(0), "its skins (bones) are not applied"),
        ("/meshes/0/primitives/0/targets", json!([{}]), "its morph targets are not applied"),
        ("/materials/0/alphaMode", json!("MASK"), "the alphaMode of `green` is not read"),
        ("/materials/0/emissiveFactor", json!([0, 1, 0]), "the emissiveFactor of `green` is not"),
        ("/extensionsUsed", json!(["KHR_lights_punctual"]), "its lights are not read"),
        ("/extensionsUsed", json!(["X_y"]), "its extensions `X_y` are not read"),
        ("/scenes/-", json!({}), "2 scenes: only scene 0 is read"),
        (
            "/meshes/0/primitives/-",
            json!({ "attributes": { "POSITION": 0 }, "mode": 1 }),
            "1 sets of points or lines",
        ),
    ] {
        let notes = read("a.gltf", changed(&[(pointer, value)])).unwrap().notes;
        assert!(notes.len() == 1 && notes[0].starts_with(start), "{notes:?}\n{start}");
    }
    for (pointer, value) in [
        ("/materials/0/alphaMode", json!("OPAQUE")),
        ("/materials/0/doubleSided", json!(true)),
        ("/extensionsUsed", json!(["KHR_materials_unlit", "KHR_texture_transform"])),
        ("/meshes/0/primitives/0/attributes/_ID", json!(0)),
        ("/extras", json!({ "any": "thing" })),
    ] {
        let notes = read("a.gltf", changed(&[(pointer, value)])).unwrap().notes;
        assert_eq!(notes, Vec::<String>::new());
    }
}

#[test]
fn errors_of_gltf_files_name_the_place() {
    let nan = [points(&[[f32::NAN; 3]; 4]), vec![0; 6]].concat();
    for (pointer, value, start) in [
        ("/asset/version", json!("1.0"), "a.gltf: /asset: version `1.0`, must be 2.0"),
        ("/scene", json!(7), "a.gltf: /scene: there is no scene 7"),
        ("/scenes/0/nodes", json!([9]), "a.gltf: /nodes: there is no node 9"),
        ("/nodes/0/children", json!([0]), "a.gltf: /nodes/0: stands twice"),
        ("/nodes/0/mesh", json!(3), "a.gltf: /nodes/0: there is no mesh 3"),
        ("/nodes/0/matrix", json!(vec![1e308; 16]), "a.gltf: /accessors/0: vertex 1 is no finite"),
        ("/meshes/0/primitives/0/attributes", json!({}), "a.gltf: /meshes/0/primitives/0: has no"),
        ("/meshes/0/primitives/0/indices", json!(8), "a.gltf: /accessors/8: there is none"),
        (
            "/meshes/0/primitives/0/mode",
            json!(9),
            "a.gltf: /meshes/0/primitives/0: mode 9, must be",
        ),
        ("/meshes/0/primitives/0/mode", json!(1), "a.gltf: holds no face (1 meshes in its scene)"),
        ("/accessors/0/type", json!("VEC2"), "a.gltf: /accessors/0: type `VEC2`, must be VEC3"),
        ("/accessors/0/componentType", json!(1), "a.gltf: /accessors/0: componentType 1"),
        ("/accessors/0/count", json!(5), "a.gltf: /accessors/0: 5 elements, but bufferView 0 ends"),
        ("/accessors/0/count", json!(u64::MAX), "a.gltf: /accessors/0: 18446744073709551615 elem"),
        (
            "/accessors/0/count",
            json!(2),
            "a.gltf: /accessors/0: vertex 2 of a face, but there are 2",
        ),
        ("/accessors/0/bufferView", Value::Null, "a.gltf: /accessors/0: has no `bufferView`"),
        (
            "/accessors/1/count",
            json!(5),
            "a.gltf: /meshes/0/primitives/0: 5 corners, which are not",
        ),
        ("/bufferViews/0/byteStride", json!(4), "a.gltf: /accessors/0: byteStride 4"),
        ("/bufferViews/0/byteOffset", json!(99), "a.gltf: /accessors/0: bufferView 0 is beyond"),
        ("/bufferViews/0/buffer", json!(1), "a.gltf: /accessors/0: there is no buffer 1"),
        ("/buffers/0/byteLength", json!(55), "a.gltf: /buffers/0: 54 bytes, must be 55"),
        ("/buffers/0/uri", json!("no.bin"), "a.gltf: /buffers/0: no.bin: there is no such file"),
        ("/buffers/0/uri", json!("http://x/y"), "a.gltf: /buffers/0: `http://x/y` is not a file"),
        ("/buffers/0/uri", json!("data:;base64,?"), "a.gltf: /buffers/0: data in base64 that"),
        ("/buffers/0/uri", json!(uri(&nan)), "a.gltf: /accessors/0: vertex 0 is no finite point"),
        ("/buffers/0/uri", Value::Null, "a.gltf: /buffers/0: has no `uri`"),
        ("/extensionsUsed", json!(["KHR_draco_mesh_compression"]), "a.gltf: uses KHR_draco_mesh"),
        ("/extensionsUsed", json!(["EXT_mesh_gpu_instancing"]), "a.gltf: uses EXT_mesh_gpu_inst"),
        ("/extensionsRequired", json!(["X_y"]), "a.gltf: /extensionsRequired: `X_y` is needed"),
        // also where the head of the file does not name them
        (
            "/nodes/0/extensions",
            json!({ "EXT_mesh_gpu_instancing": {} }),
            "a.gltf: uses EXT_mesh_gpu_instancing",
        ),
        (
            "/meshes/0/primitives/0/extensions",
            json!({ "KHR_draco_mesh_compression": {} }),
            "a.gltf: uses KHR_draco_mesh_compression",
        ),
        (
            "/bufferViews/0/extensions",
            json!({ "EXT_meshopt_compression": {} }),
            "a.gltf: uses EXT_meshopt_compression",
        ),
        ("/meshes", json!(3), "a.gltf: is no glTF: "),
    ] {
        let error = match read("a.gltf", changed(&[(pointer, value.clone())])) {
            Ok(_) => panic!("{pointer} {value}"),
            Err(error) => error.to_string(),
        };
        assert!(error.starts_with(start), "{error}\n{start}");
    }
    assert!(refused("a.glb", b"glTF\x01\0\0\0").starts_with("a.glb: is of version 1 of glTF"));
    assert!(refused("a.glb", b"glTF\x02\0").starts_with("a.glb: ends in its head"));
    let whole = glb(&changed(&[]), b"");
    assert!(refused("a.glb", &whole[..60]).starts_with("a.glb: ends after 40 of the"));
    assert!(refused("a.glb", "{").starts_with("a.glb: is no glTF"));
}

/// Checks what must hold of every result.
fn check(name: &str, bytes: &[u8]) {
    match read(name, bytes) {
        Err(error) => check_error(&error, Path::new(name)),
        Ok(file) => {
            check_finite(&file.parts.iter().map(|part| &part.triangles).collect::<Vec<_>>());
            assert!(file.parts.iter().all(|part| !part.triangles.is_empty()));
        }
    }
}

/// Bytes with up to seven changes: other bytes, pieces left out, pieces repeated.
fn spoiled_bytes(bytes: Vec<u8>) -> impl Strategy<Value = Vec<u8>> {
    let byte = prop_oneof![any::<u8>(), Just(0), Just(255), Just(127)];
    vec((0..6u8, any::<Index>(), byte, 1..9_usize), 0..8).prop_map(move |changes| {
        let mut bytes = bytes.clone();
        for (kind, at, byte, length) in changes {
            let at = at.index(bytes.len().max(1)).min(bytes.len());
            let end = (at + length).min(bytes.len());
            match kind {
                0..3 => bytes[at..(at + 1).min(end)].fill(byte),
                3 => bytes[at..end].fill(byte),
                4 => drop(bytes.drain(at..end)),
                _ => bytes.extend_from_within(at..end),
            }
        }
        bytes
    })
}

const PLY_FILES: &[&str] = &[
    "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n\
     element face 2\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n\
     4 0 1 2 3\n3 0 1 2\n",
];
const STL_FILES: &[&str] = &[
    "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 1 1 0\nendloop\nendfacet\n\
     endsolid a\nsolid b\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 1 1 0\nendloop\n\
     endfacet\nendsolid b\n",
];
const WORDS: &[&str] =
    &["element", "property", "list", "solid", "endsolid", "facet", "vertex", "int8"];

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn no_spoiled_ply_panics(text in spoiled(PLY_FILES, WORDS), little in spoiled_bytes(binary_ply(false)),
                             big in spoiled_bytes(binary_ply(true))) {
        [text, little, big].iter().for_each(|bytes| check("a.ply", bytes));
    }

    #[test]
    fn no_spoiled_stl_panics(text in spoiled(STL_FILES, WORDS), binary in spoiled_bytes(binary_stl("solid"))) {
        [text, binary].iter().for_each(|bytes| check("a.stl", bytes));
    }

    #[test]
    fn no_spoiled_gltf_panics(text in spoiled_bytes(changed(&[])),
                              binary in spoiled_bytes(glb(&changed(&[]), &[0; 64]))) {
        [text, binary].iter().for_each(|bytes| check("a.gltf", bytes));
    }

    /// Numbers of a glTF replaced by others, which leaves the JSON sound.
    #[test]
    fn no_spoiled_numbers_of_a_gltf_panic(
        changes in vec((any::<Index>(), prop_oneof![
            Just(json!(0)), Just(json!(1)), Just(json!(5)), Just(json!(5123)), Just(json!(u64::MAX)),
            Just(json!(-1)), Just(json!(1e308)), Just(json!(1_000_000_000)), (0..60_u32).prop_map(|x| json!(x)),
        ]), 1..4),
    ) {
        let mut scene = gltf();
        scene["nodes"][0]["scale"] = json!([1, 2, 3]);
        scene["meshes"][0]["primitives"][0]["mode"] = json!(4);
        scene["accessors"][0]["byteOffset"] = json!(0);
        scene["bufferViews"][0]["byteStride"] = json!(12);
        scene["accessors"][0]["sparse"] = json!({
            "count": 2, "indices": { "bufferView": 1, "componentType": 5121 }, "values": { "bufferView": 0 } });
        let count = numbers(&mut scene).len();
        for (at, value) in changes {
            *numbers(&mut scene)[at.index(count)] = value;
        }
        check("a.gltf", &serde_json::to_vec(&scene).expect("JSON"));
    }
}

/// All numbers in a JSON value, to be changed.
fn numbers(value: &mut Value) -> Vec<&mut Value> {
    match value {
        Value::Number(_) => vec![value],
        Value::Array(list) => list.iter_mut().flat_map(numbers).collect(),
        Value::Object(map) => map.values_mut().flat_map(numbers).collect(),
        _ => Vec::new(),
    }
}
