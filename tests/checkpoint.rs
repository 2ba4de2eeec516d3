//! Runs that are killed and continued have the results of an uninterrupted run.

#![cfg(unix)]

use std::{fs, path::Path, process::Output};

use crate::{
    bad_input::listing,
    common::{TestScene, stderr},
    processes::{enough, happens, signal, start},
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

/// Returns the line of a run that writes checkpoints as often as possible.
fn kept(options: &str) -> String {
    format!("run scene.json --checkpoint kept --checkpoint-every 0.001 {options}")
}

/// Does a run to its end, or on to its end.
fn goes_on(folder: &Path, line: &str) -> Output {
    start(folder, line).wait_with_output().expect("an end")
}

/// Starts the run and ends it as soon as it has written a new checkpoint, with Ctrl-C if
/// `interrupt` is set and by a kill otherwise. Returns its output, or `None` if it ended by itself.
fn end_soon(folder: &Path, options: &str, interrupt: bool) -> Option<Output> {
    let place = folder.join("kept");
    // the file is there from the beginning of the run on, with a head and its hash alone
    let written = || {
        let lines = fs::read(&place).ok()?.iter().filter(|byte| **byte == b'\n').count();
        fs::metadata(&place).and_then(|file| file.modified()).ok().filter(|_| lines > 2)
    };
    let before = written();
    let mut child = start(folder, &kept(options));
    happens(&mut child, || written().is_some() && written() != before);
    if !interrupt {
        child.kill().expect("a kill");
    } else if child.try_wait().expect("a state").is_none() {
        signal(&child, "-INT");
    }
    let output = child.wait_with_output().expect("an end");
    let code = if interrupt { Some(130) } else { None };
    (output.status.code() == code).then_some(output)
}

/// Kills a run ten times, lets it finish, and compares its results with those of a run that was not
/// killed. `code` is the exit code of both. The run has so many photons that ten kills come before
/// its end.
fn killed_ten_times(options: &str, code: i32) {
    let scene = scene();
    let folder = scene.path("");
    let line = |photons| format!("--photons {photons} {options}");
    let photons = enough(2_000_000, |photons| {
        let _ = fs::remove_file(scene.path("kept"));
        let more = format!("{} -o killed.json", line(photons));
        let all = (0..10).all(|_| end_soon(&folder, &more, false).is_some());
        assert!(!all || !scene.path("killed.json").exists());
        let _ = fs::remove_file(scene.path("killed.json"));
        all
    });
    let options = line(photons);
    let output = goes_on(&folder, &kept(&format!("{options} -o killed.json")));
    assert_eq!(output.status.code(), Some(code), "{}", stderr(&output));
    let output = goes_on(&folder, &format!("run scene.json {options} -o whole.json"));
    assert_eq!(output.status.code(), Some(code), "{}", stderr(&output));
    let read = |name| fs::read(scene.path(name)).expect("results");
    assert!(read("killed.json") == read("whole.json"), "the bytes differ");
    let left: Vec<String> =
        listing(&folder).into_iter().filter(|n| n.starts_with("kept")).collect();
    assert_eq!(left, [""; 0], "the checkpoint goes when the results are there");
}

/// The test compares bytes and does not depend on chance.
#[test]
fn a_run_that_is_killed_ten_times_finds_the_same_bytes() {
    killed_ten_times("--by-light --map-photons 2000", 0);
}

#[test]
fn a_run_with_a_tolerance_that_is_killed_ten_times_finds_the_same_bytes() {
    killed_ten_times("--tolerance 1e-6 --map-photons 2000", 3);
}

#[test]
fn a_run_with_sensitivities_that_is_killed_ten_times_finds_the_same_bytes() {
    killed_ten_times("--sensitivity --by-light --k 0", 0);
}

#[test]
fn an_interrupted_run_of_paths_says_how_to_go_on_and_does() {
    for estimator in ["paths", "complete"] {
        let scene = scene();
        let folder = scene.path("");
        let line = |photons| format!("--estimator {estimator} --photons {photons}");
        let photons = enough(200_000, |photons| {
            let _ = fs::remove_file(scene.path("kept"));
            let output = end_soon(&folder, &format!("{} -o a.json", line(photons)), true);
            if let Some(output) = &output {
                assert_eq!(
                    stderr(output),
                    "error: run: interrupted, what was traced is in kept; the same command goes on from there\n"
                );
            }
            output.is_some()
        });
        let of_paths = line(photons);
        // the run continues on another number of threads
        let output = goes_on(&folder, &kept(&format!("{of_paths} -o a.json --threads 1")));
        assert!(output.status.success(), "{}", stderr(&output));
        let output = goes_on(&folder, &format!("run scene.json {of_paths} -o b.json"));
        assert!(output.status.success(), "{}", stderr(&output));
        let read = |name| fs::read(scene.path(name)).expect("results");
        assert!(read("a.json") == read("b.json"), "{estimator}: the bytes differ");
    }
}

#[test]
fn what_is_of_another_run_or_damaged_is_refused() {
    let scene = scene();
    let folder = scene.path("");
    end_soon(&folder, "--photons 1e14", true).expect("an interrupt");
    let refuses = |more: &str, said: &str| {
        let output = goes_on(&folder, &kept(more));
        assert_eq!(output.status.code(), Some(2), "{}", stderr(&output));
        assert!(stderr(&output).contains(said), "{said}: {}", stderr(&output));
        assert!(!scene.path("results.json").exists());
    };
    refuses("--photons 2e14", "other settings: photons was 100000000000000 and is 200000000000000");
    refuses("--photons 1e14 --seed 2", "other settings: seed was 1 and is 2");
    refuses("--photons 1e14 --max-time 9", "--checkpoint: a time limit ends a run for good");
    refuses("--photons 1e14 --shard 1/2", "cannot be used with");
    refuses("--photons 1e14 -o kept", "is named for two outputs");
    let text = fs::read_to_string(scene.path("scene.json")).expect("the scene");
    fs::write(scene.path("scene.json"), text.replace("0.5}", "0.6}")).expect("written");
    refuses("--photons 1e14", "kept: is of another scene");
    fs::write(scene.path("scene.json"), text).expect("written");

    let kept = fs::read(scene.path("kept")).expect("a checkpoint");
    fs::write(scene.path("kept"), &kept[..kept.len() - 9]).expect("written");
    refuses("--photons 1e14", "kept: was cut short or changed since it was written");
    let changed = String::from_utf8_lossy(&kept).replacen("\"sum\":", "\"sum\":1", 1);
    fs::write(scene.path("kept"), changed).expect("written");
    refuses("--photons 1e14", "kept: was cut short or changed since it was written");
    let before = r#"{"phylux_checkpoint":7,"phylux":"0.1.0","scene_hash":"ab","settings":{}}"#;
    fs::write(scene.path("kept"), before).expect("written");
    refuses("--photons 1e14", "kept: was written by a phylux with other random numbers");
    fs::write(scene.path("kept"), "{}").expect("written");
    refuses("--photons 1e14", "kept: is no checkpoint of a run");
}
