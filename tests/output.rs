//! The files that are written, and what is left behind when a run ends early.

#![cfg(unix)]

use std::{
    fs,
    os::unix::fs::{FileTypeExt, PermissionsExt, symlink},
    path::Path,
    process::{Child, Command, Stdio},
};

use serde_json::Value;

use crate::{
    bad_input::{listing, phylux},
    common::{TestScene, binary, stderr},
    processes::{happens, kill, signal, start, start_until},
};

const OBJ: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";

/// Returns a scene whose runs take as long as the number of photons demands.
fn scene() -> TestScene {
    let scene = r#"{
        "materials": {"wall": {"type": "lambert", "reflectance": 0.5}},
        "objects": [{"obj": "a.obj", "material": "wall", "captor": true}],
        "lights": [{"type": "point", "position": [0.2, 0.2, 0.1], "power": 1}]
    }"#;
    TestScene::new(scene, &[("a.obj", OBJ)])
}

/// Starts a command of endless work, and waits until it has a temporary output.
fn begun(folder: &Path, line: &str) -> Child {
    let unfinished = || listing(folder).iter().any(|name| name.starts_with(".phylux-"));
    start_until(folder, line, unfinished)
}

const LONG: &str = "run scene.json --photons 1e14 --per-captor each";

#[test]
fn an_interrupted_run_leaves_nothing_behind() {
    let scene = scene();
    let folder = scene.path("");
    let before = listing(&folder);
    for (name, more) in
        [("-INT", "--csv t.csv"), ("-INT", "--max-time 1e12"), ("-TERM", "--tolerance 1e-9")]
    {
        let child = begun(&folder, &format!("{LONG} {more}"));
        signal(&child, name);
        let output = child.wait_with_output().expect("an end");
        assert_eq!(output.status.code(), Some(130), "{}", stderr(&output));
        assert_eq!(stderr(&output), "error: run: interrupted, nothing was written\n");
        assert_eq!(listing(&folder), before);
    }
}

#[test]
fn an_interrupted_view_export_or_render_names_itself_and_leaves_nothing_behind() {
    let scene = scene();
    let text = fs::read_to_string(scene.path("scene.json")).expect("the scene");
    let long = text.replacen('{', r#"{"settings": {"photons": 1e14},"#, 1);
    fs::write(scene.path("scene.json"), long).expect("written");
    let folder = scene.path("");
    let before = listing(&folder);
    for line in [
        "view scene.json",
        "export scene.json -o a.vtu",
        "render scene.json --photons 1e12 --map-photons 1e8 -o a.png",
    ] {
        let child = begun(&folder, line);
        signal(&child, "-INT");
        let output = child.wait_with_output().expect("an end");
        assert_eq!(output.status.code(), Some(130), "{}", stderr(&output));
        let command = line.split(' ').next().unwrap_or_default();
        let said = format!("error: {command}: interrupted, nothing was written\n");
        assert_eq!(stderr(&output), said);
        assert_eq!(listing(&folder), before);
    }
}

#[test]
fn a_killed_run_leaves_the_old_results() {
    let scene = scene();
    let folder = scene.path("");
    fs::write(scene.path("results.json"), "old").expect("a file");
    assert!(kill(begun(&folder, "run scene.json --photons 1e14")));
    assert_eq!(fs::read_to_string(scene.path("results.json")).expect("a file"), "old");
    let output = phylux(&folder, &["run", "scene.json", "--photons", "1000"]);
    assert!(output.status.success(), "{}", stderr(&output));
    read_json(&scene.path("results.json"));
}

#[test]
fn whoever_stops_reading_has_read_enough() {
    let scene = scene();
    let folder = scene.path("");
    for line in ["run scene.json --photons 1000", "schema", "check scene.json"] {
        let mut command = Command::new(binary());
        command.args(line.split(' ')).current_dir(&folder);
        command.stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut child = command.spawn().expect("phylux starts");
        drop(child.stdout.take());
        let output = child.wait_with_output().expect("an end");
        assert_eq!(stderr(&output), "", "{line}");
        assert!(output.status.success(), "{line}: {}", output.status);
    }
    assert_eq!(read_json(&scene.path("results.json"))["photons"], 1000);
}

#[test]
fn devices_are_written_and_not_replaced() {
    let scene = scene();
    let folder = scene.path("");
    let before = listing(&folder);
    let run = |output: &str| {
        phylux(
            &folder,
            &["run", "scene.json", "--photons", "100", "-o", output, "--csv", "/dev/null"],
        )
    };
    let output = run("/dev/null");
    assert!(output.status.success(), "{}", stderr(&output));
    assert!(fs::metadata("/dev/null").expect("a device").file_type().is_char_device());
    if Path::new("/dev/full").exists() {
        let output = run("/dev/full");
        assert_eq!(output.status.code(), Some(1));
        assert!(stderr(&output).starts_with("error: /dev/full: cannot be written: No space"));
        assert_eq!(stderr(&output).lines().count(), 1);
    }
    assert_eq!(listing(&folder), before);
}

#[test]
fn links_are_followed_and_protection_is_kept() {
    let scene = scene();
    let folder = scene.path("");
    fs::create_dir(scene.path("far")).expect("a folder");
    fs::write(scene.path("far/r.json"), "old").expect("a file");
    symlink("far/r.json", scene.path("link.json")).expect("a link");
    let output = phylux(&folder, &["run", "scene.json", "--photons", "100", "-o", "link.json"]);
    assert!(output.status.success(), "{}", stderr(&output));
    assert!(scene.path("link.json").is_symlink());
    read_json(&scene.path("far/r.json"));

    let closed = fs::Permissions::from_mode(0o444);
    fs::set_permissions(scene.path("far/r.json"), closed).expect("permissions");
    let output = phylux(&folder, &["run", "scene.json", "-o", "far/r.json"]);
    assert_eq!(output.status.code(), Some(2));
    assert_eq!(stderr(&output), "error: far/r.json: is write-protected; write elsewhere\n");

    fs::set_permissions(scene.path("far"), fs::Permissions::from_mode(0o555)).expect("permissions");
    // root may write anywhere, so nothing is tested for root
    if fs::write(scene.path("far/new"), "").is_err() {
        for arguments in [["-o", "far/s.json"], ["--per-captor", "far"], ["--per-captor", "far/x"]]
        {
            let output = phylux(&folder, &[&["run", "scene.json"][..], &arguments].concat());
            assert_eq!(output.status.code(), Some(2));
            assert!(stderr(&output).contains("permission denied"), "{}", stderr(&output));
        }
    }
    fs::set_permissions(scene.path("far"), fs::Permissions::from_mode(0o755)).expect("permissions");
}

#[test]
fn every_output_is_written() {
    let scene = scene();
    let folder = scene.path("");
    let output = phylux(
        &folder,
        &[
            "run",
            "scene.json",
            "--photons",
            "1000",
            "-o",
            "r.json",
            "--csv",
            "t.csv",
            "--stats",
            "s.json",
            "--per-captor",
            "each",
        ],
    );
    assert!(output.status.success(), "{}", stderr(&output));
    assert_eq!(listing(&folder), ["a.obj", "each", "r.json", "s.json", "scene.json", "t.csv"]);
    assert_eq!(listing(&scene.path("each")), ["a_a.json"]);
    let whole = read_json(&scene.path("r.json"));
    let single = read_json(&scene.path("each/a_a.json"));
    for key in ["phylux", "scene", "seed", "photons", "unit", "bands"] {
        assert_eq!(single[key], whole[key], "{key}");
    }
    assert_eq!(single["front"], whole["captors"][0]["front"]);
    let stats = read_json(&scene.path("s.json"));
    assert_eq!(stats["photons"], 1000);
    assert!(stats["photons_per_second"].as_f64().expect("a number") > 0.0);
    let table = fs::read_to_string(scene.path("t.csv")).expect("a table");
    let rows: Vec<&str> = table.lines().collect();
    assert_eq!(rows[0], "captor,face,band,quantity,value,standard_error,x,y,z,area,group");
    let flux = &whole["captors"][0]["front"]["flux"][0];
    let error = &whole["captors"][0]["front"]["flux_se"][0];
    assert!(rows[1].starts_with(&format!("a/a,front,all,flux,{flux},{error},")), "{table}");
    assert!(rows.iter().any(|row| row.starts_with("a/a,back,all,irradiance,0,")), "{table}");
    assert!(rows.iter().any(|row| row.starts_with("a/a,,all,absorbed,")), "{table}");
}

/// Asserts that these arguments are refused with these words before anything is written.
fn refused(folder: &Path, arguments: &[&str], words: &str) {
    let before = listing(folder);
    let output = phylux(folder, arguments);
    assert_eq!(output.status.code(), Some(2), "{}", stderr(&output));
    assert!(stderr(&output).contains(words), "{}", stderr(&output));
    assert_eq!(listing(folder), before);
}

#[test]
fn files_of_captors_replace_nothing_else() {
    let scene = scene();
    let folder = scene.path("");
    fs::copy(scene.path("scene.json"), scene.path("a_a.json")).expect("a copy");
    refused(&folder, &["run", "a_a.json", "--per-captor", "."], "is a file that is read");
    fs::create_dir(scene.path("each")).expect("a folder");
    let both = ["run", "scene.json", "-o", "each/a_a.json", "--per-captor", "./each"];
    refused(&folder, &both, "is named for two outputs");
    let table = ["run", "scene.json", "--csv", "each/a_a.json", "--per-captor", "each"];
    refused(&folder, &table, "is named for two outputs");
}

/// While a scene is read no flag is checked, so an interrupt ends the program immediately. The scene
/// is so large that it is still being read when the temporary output is there.
#[test]
fn an_interrupt_while_reading_leaves_nothing_behind() {
    let scene = scene();
    let folder = scene.path("");
    fs::write(scene.path("a.obj"), OBJ.to_owned() + &"f 1 2 3\n".repeat(1_000_000))
        .expect("a file");
    let before = listing(&folder);
    let child = begun(&folder, &format!("{LONG} --csv t.csv"));
    signal(&child, "-INT");
    let output = child.wait_with_output().expect("an end");
    assert_eq!(output.status.code(), Some(130), "{}", stderr(&output));
    assert_eq!(stderr(&output), "error: run: interrupted, nothing was written\n");
    assert_eq!(listing(&folder), before);
}

#[test]
fn rough_errors_are_said_to_be_rough() {
    let scene = scene();
    let warns = |photons: &str| {
        let output = phylux(&scene.path(""), &["run", "scene.json", "--photons", photons]);
        assert!(output.status.success(), "{}", stderr(&output));
        stderr(&output).contains("the standard errors come from 15 batches only")
    };
    assert!(warns("15"));
    assert!(!warns("1000"));
}

/// A run warns if the k nearest photons lie in a disc that is wide compared with the captor. With
/// 30 photons all of them count, over the whole captor; with 1e5 about 1000 count, over a part of
/// it.
#[test]
fn a_wide_gather_disc_is_told_of() {
    let scene = scene();
    let told = |arguments: &[&str]| {
        let arguments = [&["run", "scene.json", "--photons"], arguments].concat();
        let output = phylux(&scene.path(""), &arguments);
        assert!(output.status.success(), "{}", stderr(&output));
        let text = String::from_utf8_lossy(&output.stdout).into_owned();
        ["knn, value at the middle", "on 1 of 1 faces more than half"].map(|w| text.contains(w))
    };
    assert_eq!(told(&["30"]), [true, true]);
    assert_eq!(told(&["1e5"]), [true, false]);
    assert_eq!(told(&["1e5", "--k", "0"]), [false, false]);
}

#[test]
fn solids_that_are_not_closed_are_warned_of_by_a_run() {
    let scene = scene();
    let text = fs::read_to_string(scene.path("scene.json")).expect("a file");
    let wall = r#""type": "lambert", "reflectance": 0.5"#;
    let glass = text.replace(wall, r#""type": "transparent", "ior": 1.5"#);
    assert_ne!(text, glass);
    fs::write(scene.path("scene.json"), glass).expect("a file");
    let output = phylux(&scene.path(""), &["run", "scene.json", "--photons", "1000"]);
    assert!(output.status.success(), "{}", stderr(&output));
    assert!(stderr(&output).contains("solids that are not closed"), "{}", stderr(&output));
}

fn read_json(path: &Path) -> Value {
    serde_json::from_slice(&fs::read(path).expect("a file")).expect("whole JSON")
}

/// An output may not replace a file that the run has read, which includes MTL files.
#[test]
fn an_mtl_file_is_not_replaced() {
    let scene = r#"{
        "objects": [{"obj": "a.obj", "captor": true}],
        "lights": [{"type": "point", "position": [0.2, 0.2, 0.1], "power": 1}]
    }"#;
    let obj = format!("mtllib a.mtl\nusemtl wall\n{OBJ}");
    let mtl = "newmtl wall\nillum 1\nKd 0.5 0.5 0.5\n";
    let scene = TestScene::new(scene, &[("a.obj", &obj), ("a.mtl", mtl)]);
    let output = phylux(&scene.path(""), &["run", "scene.json", "-o", "a.mtl"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(stderr(&output).contains("a.mtl: is a file that is read"), "{}", stderr(&output));
    assert_eq!(fs::read_to_string(scene.path("a.mtl")).expect("the file"), mtl);
}

/// The triangle of [`OBJ`].
const PLY: &str = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n\
                   property float z\nelement face 1\nproperty list uchar int vertex_indices\n\
                   end_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";

/// Returns the triangle of [`OBJ`] as a binary glTF.
fn glb() -> Vec<u8> {
    let mut json = r#"{"asset": {"version": "2.0"}, "nodes": [{"name": "a", "mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}],
        "bufferViews": [{"buffer": 0, "byteLength": 36}], "buffers": [{"byteLength": 36}]}"#
        .as_bytes()
        .to_vec();
    json.resize(json.len().next_multiple_of(4), b' ');
    let corners = [0.0f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0].map(f32::to_le_bytes).concat();
    let chunk = |kind: &[u8; 4], data: &[u8]| {
        [&(data.len() as u32).to_le_bytes()[..], &kind[..], data].concat()
    };
    let chunks = [chunk(b"JSON", &json), chunk(b"BIN\0", &corners)].concat();
    let head = [2, 12 + chunks.len() as u32].map(u32::to_le_bytes).concat();
    [b"glTF", &head[..], &chunks[..]].concat()
}

/// No command replaces a file that it reads, whichever of its outputs has that name. Here it is the
/// scene's mesh, then the scene, and then each other file that the command reads.
#[test]
fn no_output_replaces_an_input() {
    let of = |obj: &str| {
        let scene = format!(
            r#"{{
            "materials": {{"wall": {{"type": "lambert", "reflectance": 0.5}}}},
            "objects": [{{"name": "a", "obj": "{obj}", "material": "wall", "captor": true}}],
            "lights": [{{"name": "l", "type": "point", "position": [0.2, 0.2, 0.1], "power": 1}}],
            "camera": {{"position": [0.2, 0.2, 1], "look_at": [0.2, 0.3, 0], "fov_deg": 90, "width": 4, "height": 4}},
            "settings": {{"photons": 1000, "k": 0}}
        }}"#
        );
        let folder = TestScene::new(&scene, &[]);
        fs::create_dir(folder.path("each")).expect("a folder");
        fs::create_dir(folder.path("charts")).expect("a folder");
        let mesh = match obj.rsplit_once('.') {
            Some((_, "glb")) => glb(),
            Some((_, "ply")) => PLY.into(),
            _ => format!("g a\n{OBJ}").into_bytes(),
        };
        fs::write(folder.path(obj), mesh).expect("a mesh");
        for command in [
            "run scene.json --by-light -o before.json",
            "run scene.json --shard 1/2 -o part1.json",
            "run scene.json --shard 2/2 -o part2.json",
        ] {
            let output = phylux(&folder.path(""), &command.split(' ').collect::<Vec<_>>());
            assert!(output.status.success(), "{}", stderr(&output));
        }
        folder
    };
    let chart = "chart scene.json -o charts --seeds 2";
    let merge = "merge part1.json part2.json -o";
    for (read, command) in [
        ("x.json", "run scene.json -o x.json"),
        ("scene.json", "run scene.json -o scene.json"),
        ("x.csv", "run scene.json --csv x.csv"),
        ("x.json", "run scene.json --stats x.json"),
        ("each/a_a.json", "run scene.json --per-captor each"),
        ("x.json", "run scene.json --shard 1/2 -o x.json"),
        ("x.json", &format!("{merge} x.json")),
        ("scene.json", &format!("{merge} scene.json")),
        ("part2.json", &format!("{merge} part2.json")),
        ("before.json", "mix before.json --power l=2 -o before.json"),
        ("before.json", "mix before.json --power l=2 --csv before.json"),
        ("before.json", "compare before.json before.json --csv before.json"),
        ("x.png", "render scene.json -o x.png"),
        ("x.exr", "render scene.json -o y.png -o x.exr"),
        ("x.html", "view scene.json -o x.html"),
        ("before.json", "view scene.json --results before.json -o before.json"),
        ("x.glb", "export scene.json -o x.glb"),
        ("x.ply", "export scene.json -o x.ply"),
        ("charts/rows.csv", chart),
        ("charts/study.json", chart),
        ("charts/error.svg", chart),
        ("charts/map.svg", chart),
    ] {
        let obj = if ["scene.json", "part2.json", "before.json"].contains(&read) {
            "x.obj"
        } else {
            read
        };
        let folder = of(obj);
        let before = (listing(&folder.path("")), fs::read(folder.path(read)).expect("a file"));
        let output = phylux(&folder.path(""), &command.split(' ').collect::<Vec<_>>());
        assert_eq!(output.status.code(), Some(2), "{command}: {}", stderr(&output));
        // a folder of charts is refused first for what is not the program's own there
        let said = stderr(&output);
        let refusals = ["is a file that is read", "is not what phylux has written there"];
        assert!(refusals.iter().any(|words| said.contains(words)), "{command}: {said}");
        let after = (listing(&folder.path("")), fs::read(folder.path(read)).expect("a file"));
        assert!(before == after, "{command}");
    }
}

#[test]
fn what_is_replaced_keeps_its_mode() {
    let scene = scene();
    let folder = scene.path("");
    fs::create_dir(scene.path("each")).expect("a folder");
    let names = ["r.json", "t.csv", "s.json", "each/a_a.json"];
    let mode =
        |name: &str| fs::metadata(scene.path(name)).expect("a file").permissions().mode() & 0o777;
    for kept in [0o600, 0o640, 0o664] {
        for name in names {
            // a file of a captor, which may be replaced, and files that are named
            let old = r#"{"phylux": "0.0.1", "id": "a/a"}"#;
            fs::write(scene.path(name), old).expect("a file");
            fs::set_permissions(scene.path(name), fs::Permissions::from_mode(kept))
                .expect("a mode");
        }
        let arguments =
            "run scene.json --photons 100 -o r.json --csv t.csv --stats s.json --per-captor each";
        let output = phylux(&folder, &arguments.split(' ').collect::<Vec<_>>());
        assert!(output.status.success(), "{}", stderr(&output));
        for name in names {
            assert_ne!(fs::read_to_string(scene.path(name)).expect("a file"), "old");
            assert_eq!(mode(name), kept, "{name}");
        }
    }
    // new files and folders have the permissions of any new file or folder
    fs::write(scene.path("other"), "").expect("a file");
    fs::create_dir(scene.path("others")).expect("a folder");
    let output = phylux(&folder, &["run", "scene.json", "--photons", "100", "--per-captor", "new"]);
    assert!(output.status.success(), "{}", stderr(&output));
    for (name, like) in [("results.json", "other"), ("new", "others"), ("new/a_a.json", "other")] {
        assert_eq!(mode(name), mode(like), "{name}");
    }
}

/// A folder that cannot be filled is found before any photon is traced.
#[test]
fn a_folder_that_cannot_be_filled_is_refused() {
    let scene = scene();
    let folder = scene.path("");
    for arguments in [["-o", "x", "--per-captor", "x"], ["--csv", "x", "--per-captor", "./x"]] {
        refused(
            &folder,
            &[&["run", "scene.json"][..], &arguments].concat(),
            "is named for two outputs",
        );
    }
    refused(
        &folder,
        &["run", "scene.json", "--stats", "x", "--per-captor", "x"],
        "is named for two outputs",
    );
    fs::create_dir_all(scene.path("each/a_a.json")).expect("a folder");
    refused(
        &folder,
        &["run", "scene.json", "--per-captor", "each"],
        "each/a_a.json: is not a file",
    );
    symlink("nowhere", scene.path("link")).expect("a link");
    refused(
        &folder,
        &["run", "scene.json", "--per-captor", "link"],
        "link: is a link to what is not there",
    );
}

/// File names are cut to 255 bytes, whatever letters they have, and remain different from each
/// other.
#[test]
fn files_of_captors_with_long_names_are_written() {
    let disc = |id: &str| {
        format!(
            r#"{{"name": "{id}", "disc": {{"center": [0, 0, 1], "normal": [0, 0, 1], "radius": 0.1}}}}"#
        )
    };
    let ids = ["ü".repeat(199) + "a", "ü".repeat(199) + "b", "漢".repeat(300), "x".repeat(198)];
    let captors = ids.iter().map(|id| disc(id)).collect::<Vec<_>>().join(", ");
    let scene = TestScene::new(
        &format!(
            r#"{{"lights": [{{"type": "point", "position": [0, 0, 2], "power": 1}}], "captors": [{captors}]}}"#
        ),
        &[],
    );
    let arguments = ["run", "scene.json", "--photons", "100", "--per-captor", "each"];
    let output = phylux(&scene.path(""), &arguments);
    assert!(output.status.success(), "{}", stderr(&output));
    let names = listing(&scene.path("each"));
    assert_eq!(names.len(), 4, "{names:?}");
    assert!(names.iter().all(|name| name.len() <= 255), "{names:?}");
    assert!(names.contains(&format!("{}.json", "x".repeat(198))));
    let found: Vec<String> = names
        .iter()
        .map(|name| read_json(&scene.path("each").join(name))["id"].as_str().expect("an id").into())
        .collect();
    assert!(ids.iter().all(|id| found.contains(id)), "{found:?}");
}

/// An interrupt at any moment while the files of captors are written leaves all of them or none.
#[test]
fn an_interrupt_while_writing_leaves_no_folder() {
    let mut rows = "x,y,z,radius,nx,ny,nz\n".to_string();
    (0..5000).for_each(|i| rows += &format!("{i},0,1,0.1,0,0,1\n"));
    let scene = TestScene::new(
        r#"{"lights": [{"type": "point", "position": [0, 0, 2], "power": 1}], "captors": [{"csv": "a.csv"}]}"#,
        &[("a.csv", &rows)],
    );
    let folder = scene.path("");
    let staged = || {
        // the temporary folder is in the working folder, or in `each` where that exists
        let places = [folder.clone(), scene.path("each")];
        let names = places.iter().filter(|place| place.is_dir()).flat_map(|place| {
            listing(place).into_iter().map(|name| place.join(name)).collect::<Vec<_>>()
        });
        names
            .filter(|path| path.is_dir() && path.to_string_lossy().contains(".phylux-"))
            .filter_map(|path| fs::read_dir(path).ok())
            .map(|entries| entries.count())
            .max()
            .unwrap_or(0)
    };
    for round in 0..10 {
        let line = "run scene.json --photons 1000 --guiding off --k 0 --per-captor each";
        let mut child = start(&folder, line);
        if happens(&mut child, || staged() > 100 * round) {
            signal(&child, "-INT");
        }
        let output = child.wait_with_output().expect("an end");
        let left = listing(&folder);
        assert!(!left.iter().any(|name| name.starts_with(".phylux-")), "{left:?}");
        if left.contains(&"each".to_string()) {
            assert_eq!(listing(&scene.path("each")).len(), 5000, "{}", stderr(&output));
            fs::remove_dir_all(scene.path("each")).expect("removed");
        } else {
            let said = stderr(&output);
            let errors = said.lines().filter(|line| line.starts_with("error: "));
            assert_eq!(errors.count(), 1, "{said}");
        }
        let _ = fs::remove_file(scene.path("results.json"));
    }
}

/// Control characters in names from files and from the command line are shown by the terminal and
/// never obeyed.
#[test]
fn a_terminal_obeys_no_name() {
    let bad = "\u{1b}[2J\u{9b}31m\u{7}\u{202e}x";
    let scene = r#"{
        "name": "BAD", "bands": [{"name": "BAD"}],
        "materials": {"BAD": {"type": "lambert", "reflectance": 0.5}},
        "objects": [{"name": "BAD", "obj": "a.obj", "material": "BAD", "captor": true}],
        "lights": [{"name": "BAD", "type": "point", "position": [0.2, 0.2, 0.1], "power": 1}],
        "settings": {"photons": 20, "k": 0}
    }"#;
    let escaped = serde_json::to_string(bad).expect("text");
    let scene = TestScene::new(&scene.replace("BAD", escaped.trim_matches('"')), &[("a.obj", OBJ)]);
    let obeyed = |c: char| c != '\n' && c.is_control() || c == '\u{202e}';
    let power = format!("{bad}=2");
    let unknown = format!("--{bad}");
    for (arguments, code) in [
        (&["run", "scene.json", "--by-light", "-o", bad][..], 0),
        (&["check", "scene.json"], 0),
        (&["mix", bad, "--power", &power, "-o", "m.json"], 0),
        (&["compare", bad, "m.json"], 0),
        (&["run", bad], 2),
        (&["check", bad], 2),
        (&["merge", bad, "-o", "n.json"], 2),
    ] {
        let output = phylux(&scene.path(""), arguments);
        assert_eq!(output.status.code(), Some(code), "{arguments:?}: {}", stderr(&output));
        let said = String::from_utf8_lossy(&output.stdout).into_owned() + &stderr(&output);
        assert!(said.contains(r"\u{1b}[2J\u{9b}31m\u{7}\u{202e}x"), "{arguments:?}: {said}");
        assert!(!said.contains(obeyed), "{arguments:?}: {said:?}");
    }
    for arguments in
        [&["run", "scene.json", &unknown][..], &["run", "scene.json", "--estimator", bad], &[bad]]
    {
        let output = phylux(&scene.path(""), arguments);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {}", stderr(&output));
        assert!(!stderr(&output).contains(obeyed), "{arguments:?}: {:?}", stderr(&output));
    }
}

/// In tables, a text that a spreadsheet would run as a formula begins with an apostrophe. It can be
/// read back, and numbers stay numbers.
#[test]
fn no_name_is_a_formula() {
    let scene = TestScene::new(
        r#"{
        "bands": [{"name": "-red"}, {"name": "@cmd"}],
        "materials": {"wall": {"type": "lambert", "reflectance": 0.5}},
        "objects": [{"name": "=1+1", "obj": "a.obj", "material": "wall", "captor": true}],
        "lights": [{"type": "point", "position": [0.2, 0.2, 0.1], "power": [1, 2]}],
        "settings": {"photons": 2000, "k": 0}
    }"#,
        &[("a.obj", &format!("g a\n{OBJ}"))],
    );
    let folder = scene.path("");
    for arguments in [
        "run scene.json -o r.json --csv t.csv",
        "run scene.json -o s.json --seed 2",
        "compare r.json s.json --csv c.csv",
    ] {
        let output = phylux(&folder, &arguments.split(' ').collect::<Vec<_>>());
        assert!(output.status.success(), "{}", stderr(&output));
    }
    let result = read_json(&scene.path("r.json"));
    let id = result["captors"][0]["id"].as_str().expect("an id");
    assert!(id.starts_with("=1+1"));
    for name in ["t.csv", "c.csv"] {
        let mut table = csv::Reader::from_path(scene.path(name)).expect("a table");
        let bands = table.headers().expect("names").iter().position(|name| name == "band");
        let mut numbers = 0;
        for row in table.records() {
            let row = row.expect("a row");
            assert_eq!(&row[0], format!("'{id}"));
            assert!(["'-red", "'@cmd"].contains(&&row[bands.expect("bands")]), "{row:?}");
            numbers += row.iter().skip(3).filter(|cell| cell.parse::<f64>().is_ok()).count();
        }
        assert!(numbers > 4, "{name}");
    }
    // a table of a run is used as a table of true values
    let table = fs::read_to_string(scene.path("t.csv")).expect("a table");
    let rows = table.lines().filter(|row| row.contains(",irradiance,") && row.contains(",front,"));
    // the first six columns
    let cut = |row: &str| row.split(',').take(6).collect::<Vec<_>>().join(",");
    let rows: Vec<String> = rows.map(|row| cut(&row.replace(",irradiance,", ",,"))).collect();
    let truth =
        "captor,face,band,,irradiance,standard_error\n".to_string() + &rows.join("\n") + "\n";
    fs::write(scene.path("truth.csv"), truth).expect("a table");
    let arguments = "chart scene.json --truth truth.csv -o charts --photons 1e4 --seeds 2";
    let output = phylux(&folder, &arguments.split(' ').collect::<Vec<_>>());
    assert!(output.status.success(), "{}", stderr(&output));
}
