//! So many copies that a page or a file has no room for the triangles of each: these are merged, and
//! the copies stand as instances of one mesh.

use std::fs;

use serde_json::{Value, json};

use crate::{
    bad_input::{phylux, refused},
    common::{TestScene, binary},
    rendered::done,
};

/// Squares along a side of a sheet, of two triangles each.
const SIDE: usize = 100;

/// Returns sheets of 1 m2 and 20,000 triangles in a row, each higher than the last by 1 cm, below a
/// lamp, and a floor.
pub fn sheets(copies: usize, captor: Value) -> TestScene {
    let mut sheet = String::new();
    for i in 0..=SIDE {
        (0..=SIDE).for_each(|j| sheet += &format!("v {} {} 0\n", 0.01 * i as f64, 0.01 * j as f64));
    }
    for i in 0..SIDE {
        for j in 0..SIDE {
            let (a, next) = (i * (SIDE + 1) + j + 1, SIDE + 1);
            let half = if j == SIDE / 2 && i == 0 { "g right\n" } else { "" };
            sheet += &format!("{half}f {a} {} {} {}\n", a + next, a + next + 1, a + 1);
        }
    }
    let mut places = "x,y,z\n".to_string();
    (0..copies).for_each(|i| places += &format!("{},0,{}\n", 2 * i, 0.01 * i as f64));
    let scene = json!({
        "materials": {
            "leaf": { "type": "leaf", "reflectance": 0.1, "transmittance": 0.1 },
            "soil": { "type": "lambert", "reflectance": 0.2 }
        },
        "objects": [
            { "name": "floor", "obj": "floor.obj", "material": "soil" },
            {
                "name": "sheet", "obj": "sheet.obj", "material": "leaf", "captor": captor,
                "instances": { "csv": "places.csv" }, "share": true
            }
        ],
        "lights": [{ "name": "lamp", "type": "point", "position": [0.5, 0.5, 3], "power": 100 }],
        "settings": { "photons": 300_000, "map_photons": 20_000, "k": 10 }
    });
    let floor = "v -1 -1 -1\nv 9 -1 -1\nv 9 2 -1\nv -1 2 -1\nf 1 2 3 4\n";
    let files = [("floor.obj", floor), ("sheet.obj", &*sheet), ("places.csv", &*places)];
    TestScene::new(&scene.to_string(), &files)
}

fn results(scene: &TestScene) -> Value {
    done(&scene.path(""), &["run", "scene.json", "-o", "results.json"]);
    serde_json::from_slice(&fs::read(scene.path("results.json")).expect("results")).expect("JSON")
}

/// Returns the JSON of a binary glTF file.
fn head(file: &[u8]) -> Value {
    let length = u32::from_le_bytes(file[12..16].try_into().expect("4 bytes")) as usize;
    serde_json::from_slice(&file[20..20 + length]).expect("JSON")
}

fn numbers(list: &Value) -> Vec<f64> {
    list.as_array().expect("a list").iter().map(|n| n.as_f64().expect("a number")).collect()
}

/// 22 million triangles are 1,100 nodes of a few meshes, each where its copy stands and in the colour
/// of its light; the file has the triangles of one copy.
#[test]
fn shared_copies_are_nodes_of_a_glb() {
    let scene = sheets(1100, json!("instance"));
    let results = results(&scene);
    let line = ["export", "scene.json", "--results", "results.json", "--no-trace", "-o", "a.glb"];
    done(&scene.path(""), &line);
    let file = fs::read(scene.path("a.glb")).expect("a file");
    assert!(file.len() < 4_000_000, "{} bytes", file.len());
    let head = head(&file);
    let nodes = head["nodes"].as_array().expect("nodes");
    let (copies, others): (Vec<&Value>, Vec<&Value>) =
        nodes.iter().partition(|node| node.get("matrix").is_some());
    assert_eq!((copies.len(), others.len()), (1100, 2));
    let place = |node: &Value| numbers(&node["matrix"]);
    let origin = place(copies[0]);
    for (i, node) in copies.iter().enumerate() {
        assert_eq!(node["name"], format!("sheet#{i}"));
        let matrix = place(node);
        assert_eq!(matrix[..12], [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0]);
        for (axis, along) in [2.0, 0.0, 0.01].into_iter().enumerate() {
            let off = matrix[12 + axis] - origin[12 + axis] - along * i as f64;
            assert!(off.abs() < 1e-3, "{i}: {matrix:?}");
        }
        for (face, key) in ["front", "back"].into_iter().enumerate() {
            let known = results["captors"][i][key]["irradiance"][0].as_f64().expect("a number");
            assert_eq!(node["extras"]["value"][face], known, "{i} {key}");
        }
    }
    // the first sheet, which is right below the lamp, is brighter than the fourth
    let colour = |node: &Value| {
        let mesh = node["mesh"].as_u64().expect("a mesh") as usize;
        let material = head["meshes"][mesh]["primitives"][0]["material"].as_u64().expect("one");
        numbers(&head["materials"][material as usize]["pbrMetallicRoughness"]["baseColorFactor"])
    };
    let [near, far] = [copies[0], copies[3]].map(colour);
    assert!(near[0] > far[0] + 0.1 && near[1] > far[1] + 0.1, "{near:?} {far:?}");
    // dark sheets share one mesh, and all meshes the triangles of two faces
    let meshes = head["meshes"].as_array().expect("meshes").len();
    assert!(meshes < 600, "{meshes}");
    let positions = head["accessors"].as_array().expect("accessors").iter();
    let sheets = positions.filter(|accessor| accessor["count"] == 6 * SIDE * SIDE);
    assert_eq!(sheets.count(), 2);
}

/// A page has up to four million tiles: those of 210 copies of 20,000 triangles have two or more
/// triangles each, and none belongs to two captors. The light is that at the middle of each.
#[test]
#[ignore = "takes minutes: .ci/nightly runs it"]
fn nightly_shared_copies_of_a_page_have_merged_tiles() {
    let scene = sheets(210, json!(true));
    done(&scene.path(""), &["view", "scene.json", "--photons", "20000"]);
    let html = fs::read_to_string(scene.path("view.html")).expect("the page");
    assert!(html.len() < 20_000_000, "{} bytes", html.len());
    let (_, facts) = html.split_once("id=\"facts\">").expect("the facts");
    let facts: Value =
        serde_json::from_str(facts.split("</script>").next().expect("their end")).expect("JSON");
    let tiles = facts["tiles"].as_u64().expect("a number");
    assert!((1_000_000..=4_000_000).contains(&tiles), "{tiles}");
    let sheet = &facts["shapes"][1];
    assert_eq!((&sheet["copies"], &sheet["triangles"]), (&json!(210), &json!(2 * SIDE * SIDE)));
    let starts = html.contains("id=\"starts\"");
    assert!(starts && facts["local"].is_object());
}

/// What has no shared copies, or too many parts of them, has its sentence. Files of VTK have no
/// copies.
#[test]
fn too_many_copies_have_their_sentence() {
    let scene = sheets(1100, json!("instance"));
    let line = ["export", "scene.json", "-o", "a.vtp"];
    refused(&scene.path(""), &line, &["22000002 triangles", "export a .glb"]);
    // tiles that do not fit into memory are not begun
    #[cfg(target_os = "linux")]
    for name in ["a.glb", "a.vtu"] {
        let few = sheets(210, json!("instance"));
        let script = format!("ulimit -v 280000; exec \"$0\" export scene.json -o {name}");
        let mut limited = std::process::Command::new("sh");
        limited.args(["-c", &script]).arg(binary()).current_dir(few.path(""));
        let said = limited.output().expect("a shell").stderr;
        let said = String::from_utf8_lossy(&said);
        assert!(said.contains("pieces of surfaces to show take"), "{name}: {said}");
    }
    // photons are not bound to tiles
    let line = ["export", "scene.json", "--photons", "1000", "-o", "a.ply"];
    let output = phylux(&scene.path(""), &line);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let own = fs::read_to_string(scene.path("scene.json")).expect("the scene");
    fs::write(scene.path("own.json"), own.replace("\"share\":true", "\"share\":false")).expect("");
    let places = fs::read_to_string(scene.path("places.csv")).expect("places");
    let few: Vec<&str> = places.lines().take(211).collect();
    fs::write(scene.path("places.csv"), few.join("\n")).expect("places");
    refused(&scene.path(""), &["view", "own.json"], &["4200002 triangles", "a page holds 4000000"]);
}
