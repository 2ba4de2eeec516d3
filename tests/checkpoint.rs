//! Runs that are killed and continued have the results of an uninterrupted run.

#![cfg(unix)]

use std::{
    fs,
    path::Path,
    process::{Child, Command, Output, Stdio},
    thread::sleep,
    time::{Duration, Instant},
};

use crate::{
    bad_input::{listing, phylux},
    common::{TestScene, binary},
};

/// Returns a scene with a wall and a sensor above it, under two lights.
fn scene() -> TestScene {
    let scene = r#"{
        "materials": {"wall": {"type": "lambert", "reflectance": 0.5}},
        "objects": [{"obj": "a.obj", "material": "wall", "captor": true}],
        "lights": [
            {"name": "a", "type": "point", "position": [0.2, 0.2, 0.1], "power": 1},
            {"name": "b", "type": "tube", "from": [0, 0, 0.5], "to": [1, 0, 0.5], "radius": 0.01, "power": 2}
        ],
        "captors": [{"name": "s", "disc": {"center": [0.3, 0.3, 0.05], "normal": [0, 0, 1], "radius": 0.05}}]
    }"#;
    TestScene::new(scene, &[("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")])
}

const KEPT: [&str; 6] =
    ["run", "scene.json", "--checkpoint", "kept", "--checkpoint-every", "0.001"];

fn start(folder: &Path, more: &[&str]) -> Child {
    let mut command = Command::new(binary());
    command.args(KEPT).args(more).current_dir(folder);
    command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("phylux starts")
}

fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// Starts the run and ends it as soon as it has written a new checkpoint, with Ctrl-C if
/// `interrupt` is set and by a kill otherwise. Returns its output.
fn end_soon(folder: &Path, more: &[&str], interrupt: bool) -> Output {
    let kept = folder.join("kept");
    // the file is there from the beginning of the run on, with a head and its hash alone
    let written = || {
        let lines = fs::read(&kept).ok()?.iter().filter(|byte| **byte == b'\n').count();
        fs::metadata(&kept).and_then(|file| file.modified()).ok().filter(|_| lines > 2)
    };
    let before = written();
    let mut child = start(folder, more);
    let started = Instant::now();
    while (written().is_none() || written() == before)
        && child.try_wait().expect("a child").is_none()
    {
        assert!(started.elapsed() < Duration::from_secs(120), "no checkpoint");
        sleep(Duration::from_millis(1));
    }
    if interrupt {
        let id = child.id().to_string();
        assert!(Command::new("kill").args(["-INT", &id]).status().expect("kill").success());
    } else {
        child.kill().expect("a kill");
    }
    child.wait_with_output().expect("an end")
}

/// Kills a run ten times, lets it finish, and compares its results with those of a run that was not
/// killed. `code` is the exit code of both.
fn killed_ten_times(options: &[&str], code: i32) {
    let scene = scene();
    let folder = scene.path("");
    let more = [options, &["-o", "killed.json"]].concat();
    for kill in 1..=10 {
        let output = end_soon(&folder, &more, false);
        assert_eq!(output.status.code(), None, "kill {kill}: {}", stderr(&output));
    }
    assert!(!scene.path("killed.json").exists());
    let output = start(&folder, &more).wait_with_output().expect("an end");
    assert_eq!(output.status.code(), Some(code), "{}", stderr(&output));
    let whole = [&["run", "scene.json"], options, &["-o", "whole.json"]].concat();
    assert_eq!(phylux(&folder, &whole).status.code(), Some(code));
    let read = |name| fs::read(scene.path(name)).expect("results");
    assert!(read("killed.json") == read("whole.json"), "the bytes differ");
    let left: Vec<String> =
        listing(&folder).into_iter().filter(|n| n.starts_with("kept")).collect();
    assert_eq!(left, [""; 0], "the checkpoint goes when the results are there");
}

/// The test compares bytes and does not depend on chance. The run is so long that ten kills come
/// before its end.
#[test]
fn a_run_that_is_killed_ten_times_finds_the_same_bytes() {
    killed_ten_times(&["--photons", "2e6", "--by-light", "--map-photons", "2000"], 0);
}

#[test]
fn a_run_with_a_tolerance_that_is_killed_ten_times_finds_the_same_bytes() {
    killed_ten_times(&["--tolerance", "1e-6", "--photons", "2e6", "--map-photons", "2000"], 3);
}

#[test]
fn an_interrupted_run_of_paths_says_how_to_go_on_and_does() {
    for estimator in ["paths", "complete"] {
        let scene = scene();
        let folder = scene.path("");
        let of_paths = ["--estimator", estimator, "--photons", "2e5"];
        let more = [&of_paths[..], &["-o", "a.json"]].concat();
        let output = end_soon(&folder, &more, true);
        assert_eq!(output.status.code(), Some(130), "{}", stderr(&output));
        assert_eq!(
            stderr(&output),
            "error: run: interrupted, what was traced is in kept; the same command goes on from there\n"
        );
        // the run continues on another number of threads
        let more = [&more[..], &["--threads", "1"]].concat();
        let output = start(&folder, &more).wait_with_output().expect("an end");
        assert!(output.status.success(), "{}", stderr(&output));
        let whole = [&["run", "scene.json", "-o", "b.json"], &of_paths[..]].concat();
        assert!(phylux(&folder, &whole).status.success());
        let read = |name| fs::read(scene.path(name)).expect("results");
        assert!(read("a.json") == read("b.json"), "{estimator}: the bytes differ");
    }
}

#[test]
fn what_is_of_another_run_or_damaged_is_refused() {
    let scene = scene();
    let folder = scene.path("");
    let output = end_soon(&folder, &["--photons", "1e9"], true);
    assert_eq!(output.status.code(), Some(130), "{}", stderr(&output));
    let refuses = |more: &[&str], said: &str| {
        let output = start(&folder, more).wait_with_output().expect("an end");
        assert_eq!(output.status.code(), Some(2), "{}", stderr(&output));
        assert!(stderr(&output).contains(said), "{said}: {}", stderr(&output));
        assert!(!scene.path("results.json").exists());
    };
    refuses(&["--photons", "2e9"], "other settings: photons was 1000000000 and is 2000000000");
    refuses(&["--photons", "1e9", "--seed", "2"], "other settings: seed was 1 and is 2");
    refuses(
        &["--photons", "1e9", "--max-time", "9"],
        "--checkpoint: a time limit ends a run for good",
    );
    refuses(&["--photons", "1e9", "--shard", "1/2"], "cannot be used with");
    refuses(&["--photons", "1e9", "-o", "kept"], "is named for two outputs");
    let text = fs::read_to_string(scene.path("scene.json")).expect("the scene");
    fs::write(scene.path("scene.json"), text.replace("0.5}", "0.6}")).expect("written");
    refuses(&["--photons", "1e9"], "kept: is of another scene");
    fs::write(scene.path("scene.json"), text).expect("written");

    let kept = fs::read(scene.path("kept")).expect("a checkpoint");
    fs::write(scene.path("kept"), &kept[..kept.len() - 9]).expect("written");
    refuses(&["--photons", "1e9"], "kept: was cut short or changed since it was written");
    let changed = String::from_utf8_lossy(&kept).replacen("\"sum\":", "\"sum\":1", 1);
    fs::write(scene.path("kept"), changed).expect("written");
    refuses(&["--photons", "1e9"], "kept: was cut short or changed since it was written");
    let before = r#"{"phylux_checkpoint":7,"phylux":"0.1.0","scene_hash":"ab","settings":{}}"#;
    fs::write(scene.path("kept"), before).expect("written");
    refuses(&["--photons", "1e9"], "kept: was written by a phylux with other random numbers");
    fs::write(scene.path("kept"), "{}").expect("written");
    refuses(&["--photons", "1e9"], "kept: is no checkpoint of a run");
}
