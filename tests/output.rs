//! What is written, and what is left behind when a run ends before its time.

#![cfg(unix)]

use std::{
    fs,
    os::unix::fs::{FileTypeExt, PermissionsExt, symlink},
    path::Path,
    process::{Child, Command, Output, Stdio},
    thread::sleep,
    time::{Duration, Instant},
};

use serde_json::Value;

use crate::{
    bad_input::{listing, phylux},
    common::{TestScene, binary},
};

const OBJ: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";

/// A scene that runs as long as it is asked to.
fn scene() -> TestScene {
    let scene = r#"{
        "materials": {"wall": {"type": "lambert", "reflectance": 0.5}},
        "objects": [{"obj": "a.obj", "material": "wall", "captor": true}],
        "lights": [{"type": "point", "position": [0.2, 0.2, 0.1], "power": 1}]
    }"#;
    TestScene::new(scene, &[("a.obj", OBJ)])
}

fn start(folder: &Path, arguments: &[&str]) -> Child {
    Command::new(binary())
        .args(arguments)
        .current_dir(folder)
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("phylux starts")
}

/// Waits until the temporary output is there, and a little more.
fn wait_for_start(folder: &Path) {
    let started = Instant::now();
    while !listing(folder).iter().any(|name| name.starts_with(".phylux-")) {
        assert!(started.elapsed() < Duration::from_secs(20), "no temporary file");
        sleep(Duration::from_millis(5));
    }
    sleep(Duration::from_millis(100));
}

fn signal(child: &Child, name: &str) {
    let id = child.id().to_string();
    let status = Command::new("kill").args([name, &id]).status().expect("kill");
    assert!(status.success());
}

fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

const LONG: [&str; 6] = ["run", "scene.json", "--photons", "1e14", "--per-captor", "each"];

#[test]
fn an_interrupted_run_leaves_nothing_behind() {
    let scene = scene();
    let folder = scene.path("");
    let before = listing(&folder);
    for (name, more) in [
        ("-INT", &["--csv", "t.csv"][..]),
        ("-INT", &["--max-time", "1e6"]),
        ("-TERM", &["--tolerance", "1e-9"]),
    ] {
        let child = start(&folder, &[&LONG[..], more].concat());
        wait_for_start(&folder);
        signal(&child, name);
        let output = child.wait_with_output().expect("an end");
        assert_eq!(output.status.code(), Some(1), "{}", stderr(&output));
        assert_eq!(stderr(&output), "error: run: interrupted, nothing was written\n");
        assert_eq!(listing(&folder), before);
    }
}

#[test]
fn an_interrupted_view_or_export_leaves_nothing_behind() {
    let scene = scene();
    let text = fs::read_to_string(scene.path("scene.json")).expect("the scene");
    let long = text.replacen('{', r#"{"settings": {"photons": 1e14},"#, 1);
    fs::write(scene.path("scene.json"), long).expect("written");
    let folder = scene.path("");
    let before = listing(&folder);
    for arguments in [&["view", "scene.json"][..], &["export", "scene.json", "-o", "a.vtu"]] {
        let child = start(&folder, arguments);
        wait_for_start(&folder);
        signal(&child, "-INT");
        let output = child.wait_with_output().expect("an end");
        assert_eq!(output.status.code(), Some(1), "{}", stderr(&output));
        assert_eq!(stderr(&output), "error: run: interrupted, nothing was written\n");
        assert_eq!(listing(&folder), before);
    }
}

#[test]
fn a_killed_run_leaves_the_old_results() {
    let scene = scene();
    let folder = scene.path("");
    fs::write(scene.path("results.json"), "old").expect("a file");
    let mut child = start(&folder, &["run", "scene.json", "--photons", "1e14"]);
    wait_for_start(&folder);
    signal(&child, "-KILL");
    assert!(!child.wait().expect("an end").success());
    assert_eq!(fs::read_to_string(scene.path("results.json")).expect("a file"), "old");
    let output = phylux(&folder, &["run", "scene.json", "--photons", "1000"]);
    assert!(output.status.success(), "{}", stderr(&output));
    read_json(&scene.path("results.json"));
}

#[test]
fn whoever_stops_reading_has_read_enough() {
    let scene = scene();
    let folder = scene.path("");
    for arguments in
        [&["run", "scene.json", "--photons", "1000"][..], &["schema"], &["check", "scene.json"]]
    {
        let mut child = start(&folder, arguments);
        drop(child.stdout.take());
        let output = child.wait_with_output().expect("an end");
        assert_eq!(stderr(&output), "", "{arguments:?}");
        assert!(output.status.success(), "{arguments:?}: {}", output.status);
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
    // root may write anywhere
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
    assert_eq!(rows[0], "captor,face,band,quantity,value,standard_error");
    let flux = &whole["captors"][0]["front"]["flux"][0];
    let error = &whole["captors"][0]["front"]["flux_se"][0];
    assert_eq!(rows[1], format!("a/a,front,all,flux,{flux},{error}"));
    assert!(rows.iter().any(|row| row.starts_with("a/a,back,all,irradiance,0,")), "{table}");
    assert!(rows.iter().any(|row| row.starts_with("a/a,,all,absorbed,")), "{table}");
}

/// That these arguments are refused with these words, before anything is written.
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

/// While a scene is read nothing looks at a flag: the end is immediate.
#[test]
fn an_interrupt_while_reading_leaves_nothing_behind() {
    let scene = scene();
    let folder = scene.path("");
    fs::write(scene.path("a.obj"), OBJ.to_owned() + &"f 1 2 3\n".repeat(1_000_000))
        .expect("a file");
    let before = listing(&folder);
    let child = start(&folder, &[&LONG[..], &["--csv", "t.csv"]].concat());
    wait_for_start(&folder);
    signal(&child, "-INT");
    let output = child.wait_with_output().expect("an end");
    assert_eq!(output.status.code(), Some(1), "{}", stderr(&output));
    assert_eq!(stderr(&output), "error: run: interrupted, nothing was written\n");
    assert_eq!(listing(&folder), before);
}

#[test]
fn rough_errors_are_said_to_be_rough() {
    let scene = scene();
    let warns = |photons: &str| {
        let output = phylux(&scene.path(""), &["run", "scene.json", "--photons", photons]);
        assert!(output.status.success(), "{}", stderr(&output));
        stderr(&output).contains("the standard errors come from 15 blocks only")
    };
    assert!(warns("15"));
    assert!(!warns("1000"));
}

/// With 30 photons all count, over the whole captor; with 1e5 some 1000 of them, over a part of it.
#[test]
fn a_wide_gather_disc_is_told_of() {
    let scene = scene();
    let told = |arguments: &[&str]| {
        let arguments = [&["run", "scene.json", "--photons"], arguments].concat();
        let output = phylux(&scene.path(""), &arguments);
        assert!(output.status.success(), "{}", stderr(&output));
        let text = String::from_utf8_lossy(&output.stdout).into_owned();
        ["error of the k nearest", "more than half on 1 of 1 faces"].map(|w| text.contains(w))
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

/// An output may take the place of no file that the run has read: MTL files, too.
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
