//! Sweeps that are stopped, killed or divided into shards give the same bytes as one that ran
//! through.

#![cfg(unix)]

use std::{
    collections::HashSet,
    sync::{
        Mutex,
        atomic::{AtomicBool, Ordering},
    },
    thread::sleep,
    time::{Duration, Instant},
};

use phylux::math::Stream;

use super::*;
use crate::{
    bad_input::listing,
    processes::{kill, signal, start, start_until},
};

/// Three powers, four reflectances and three seeds; one run in four fails because of its
/// reflectance.
const SWEEP: &str = r#"{"scene": "scene.json", "seeds": 3, "vary": {
    "/lights/0/power": {"from": 1, "to": 3, "steps": 3}, "/materials/wall/reflectance": [0.1, 0.2, 0.3, 1.5]}}"#;

/// A sweep is killed at random moments and started again, until 60 kills have come before its end:
/// while it reads, compares, runs or writes tables. The moments come from the stream of seed 5. They
/// are earlier after each sweep that ended before its kill, and later after each one that did not,
/// so that they are spread over the sweep on any machine. The comparison does not depend on them.
#[test]
fn a_killed_sweep_ends_like_any_other() {
    let folder = folder(SWEEP);
    assert_eq!(any(&folder, "sweep sweep.json -o whole --threads 1").status.code(), Some(1));
    assert_eq!(content(&folder.path("whole")).len(), 36 + 11);
    let mut moments = Stream::new(5, 0, 0);
    let mut latest = Duration::from_millis(40);
    let (mut kills, mut sweeps) = (0, 0);
    while kills < 60 {
        let out = format!("out{sweeps}");
        for _ in 0..20 {
            let child = start(&folder.path(""), &format!("sweep sweep.json -o {out} --threads 3"));
            sleep(latest.mul_f64(moments.uniform_fine()));
            let in_time = kill(child);
            kills += usize::from(in_time);
            latest = latest.mul_f64(if in_time { 1.1 } else { 0.8 });
        }
        let output = any(&folder, &format!("sweep sweep.json -o {out} --threads 2"));
        assert_eq!(output.status.code(), Some(1), "{}", stderr(&output));
        let differ = differences(&folder.path("whole"), &folder.path(&out));
        assert!(differ.is_empty(), "{out}: {differ:?}");
        sweeps += 1;
        assert!(sweeps < 100, "it ends before it can be killed");
    }
}

/// A sweep says that it runs before the files of its first run are read, which may take long.
#[test]
fn running_is_reported_before_the_first_run() {
    let folder = folder(r#"{"scene": "scene.json", "vary": {"/lights/0/power": [1, 2]}}"#);
    let file = phylux::formats::Sweep::load(&folder.path("sweep.json")).expect("a sweep");
    let first = Mutex::new(None);
    let progress = |progress: phylux::studies::SweepProgress| {
        if progress.step == phylux::studies::Step::Running {
            first.lock().expect("no panic").get_or_insert(progress.runs);
        }
    };
    let control = phylux::studies::SweepControl {
        stop: &AtomicBool::new(false),
        progress: &progress,
        plots: Default::default(),
    };
    let plan =
        phylux::studies::SweepPlan { shard: phylux::transport::Shard::WHOLE, threads: 1, jobs: 1 };
    phylux::studies::sweep(&file, &folder.path("out"), &plan, &control).expect("it runs");
    assert_eq!(*first.lock().expect("no panic"), Some(0.0));
}

/// A sweep of many runs says how far it has come while it decides which of them come from one
/// simulation, and can be stopped there.
#[test]
fn planning_is_reported_and_can_be_stopped() {
    let vary = r#"{"/lights/0/power": {"from": 1, "to": 2, "steps": 20000}}"#;
    let folder = folder(&format!(r#"{{"scene": "scene.json", "vary": {vary}}}"#));
    let file = phylux::formats::Sweep::load(&folder.path("sweep.json")).expect("a sweep");
    let (stop, told) = (AtomicBool::new(false), Mutex::new(Vec::new()));
    let progress = |progress: phylux::studies::SweepProgress| {
        assert_eq!(progress.step, phylux::studies::Step::Planning);
        assert_eq!(progress.of, 20000);
        told.lock().expect("no panic").push(progress.runs);
        stop.store(progress.runs > 15000.0, Ordering::Relaxed);
    };
    let control = phylux::studies::SweepControl {
        stop: &stop,
        progress: &progress,
        plots: Default::default(),
    };
    let plan =
        phylux::studies::SweepPlan { shard: phylux::transport::Shard::WHOLE, threads: 1, jobs: 1 };
    let out = folder.path("out");
    let error = phylux::studies::sweep(&file, &out, &plan, &control).expect_err("stopped");
    assert_eq!(error.to_string(), "sweep: interrupted, no run was started");
    let told = told.into_inner().expect("no panic");
    assert!(told.len() > 10 && told.is_sorted(), "{told:?}");
    assert!(told.iter().filter(|runs| **runs > 15000.0).count() == 1, "{told:?}");
}

/// A design of many runs is read without the names of their files: in less time than these take.
#[test]
fn a_large_design_is_read_soon() {
    let vary = r#"{"/lights/0/power": {"from": 1, "to": 2}, "/lights/0/position/2": {"from": 1, "to": 2}}"#;
    let combine = r#"{"sample": "latin-hypercube", "count": 100000}"#;
    let folder =
        folder(&format!(r#"{{"scene": "scene.json", "vary": {vary}, "combine": {combine}}}"#));
    let started = Instant::now();
    let file = phylux::formats::Sweep::load(&folder.path("sweep.json")).expect("a sweep");
    let reading = started.elapsed();
    let started = Instant::now();
    let names: HashSet<String> = file.runs().map(|run| file.key(&run)).collect();
    let naming = started.elapsed();
    assert_eq!(names.len(), 100_000);
    assert!(reading < naming, "{reading:?}, {naming:?}");
}

/// Ctrl-C ends a sweep in order: finished runs stay, no incomplete file is left, and the sweep can
/// be continued.
#[test]
fn an_interrupted_sweep_goes_on() {
    let folder = folder(r#"{"scene": "scene.json", "vary": {"/settings/photons": [1000, 1e14]}}"#);
    let runs = folder.path("out/runs");
    let child = start_until(&folder.path(""), "sweep sweep.json -o out --threads 2", || {
        runs.is_dir() && listing(&runs).iter().any(|name| !name.starts_with('.'))
    });
    // a second sweep cannot work in the same folder at the same time
    let output = any(&folder, "sweep sweep.json -o out");
    assert_eq!(output.status.code(), Some(1));
    assert!(stderr(&output).starts_with("error: out: another phylux is at work in this folder"));
    signal(&child, "-INT");
    let output = child.wait_with_output().expect("an end");
    assert_eq!(output.status.code(), Some(130));
    let said =
        "error: sweep: interrupted, 1 of 2 runs are done; the same command goes on from there\n";
    assert_eq!(stderr(&output), said);
    assert_eq!(listing(&folder.path("out")), [".lock", "runs", "sweep.json", "times.csv"]);
    fs::write(
        folder.path("sweep.json"),
        r#"{"scene": "scene.json", "vary": {"/settings/photons": [1000, 2000]}}"#,
    )
    .expect("a sweep");
    let said = ok(&folder, "sweep sweep.json -o out");
    assert_eq!(said, "2 of 2 runs are done, 1 of them from before; wrote out\n");
}

/// Shards that are merged in any order give the bytes of a sweep on one machine. Shards that do not
/// belong together are refused.
#[test]
fn shards_merge_to_the_same_bytes() {
    let folder = folder(SWEEP);
    assert_eq!(any(&folder, "sweep sweep.json -o whole").status.code(), Some(1));
    for i in 1..=3 {
        let output = any(&folder, &format!("sweep sweep.json -o part{i} --shard {i}/3"));
        assert_eq!(output.status.code(), Some(1));
        assert_eq!(listing(&folder.path(&format!("part{i}/runs"))).len(), 12);
    }
    for (i, parts) in
        ["part1 part2 part3", "part3 part1 part2", "part2 part3 part1 part3"].iter().enumerate()
    {
        let output = any(&folder, &format!("merge {parts} -o merged{i}"));
        assert_eq!(output.status.code(), Some(1));
        assert!(stderr(&output).ends_with("(also in merged0/runs)\n") || i > 0);
        let differ = differences(&folder.path("whole"), &folder.path(&format!("merged{i}")));
        assert!(differ.is_empty(), "{parts}: {differ:?}");
        let times = |out: &str| {
            fs::read_to_string(folder.path(out).join("times.csv")).expect("a table").lines().count()
        };
        assert_eq!(times(&format!("merged{i}")), times("whole"));
    }

    let refused = |parts: &str, words: &str| {
        let output = any(&folder, &format!("merge {parts} -o none"));
        assert_eq!(output.status.code(), Some(2), "{}", stderr(&output));
        assert!(stderr(&output).starts_with(words), "{}", stderr(&output));
        assert!(!folder.path("none").exists());
    };
    refused(
        "part1 part3",
        "error: merge: 12 of 36 runs are in none of the folders, the first: run 2 (",
    );
    let shard = |out: &str| {
        let output = any(&folder, &format!("sweep sweep.json -o {out} --shard 3/3"));
        assert!(matches!(output.status.code(), Some(0 | 1)), "{}", stderr(&output));
    };
    fs::write(folder.path("a.obj"), OBJ.replace("v 0 1 0", "v 0 2 0")).expect("an OBJ file");
    shard("other");
    refused(
        "part1 part2 other",
        "error: other: read another content of a.obj than part1; run the older",
    );
    refused("part1 part2 part3 other", "error: other: has other results of run ");
    fs::write(folder.path("a.obj"), OBJ).expect("an OBJ file");
    fs::write(folder.path("scene.json"), SCENE.replace("2000", "2001")).expect("a scene");
    shard("scene");
    refused(
        "part1 part2 scene",
        "error: scene: is of another scene than part1; merge shards of one",
    );
    fs::write(folder.path("scene.json"), SCENE).expect("a scene");
    fs::write(folder.path("sweep.json"), SWEEP.replace("\"seeds\": 3", "\"seeds\": 2"))
        .expect("a sweep");
    shard("sweep");
    refused("part1 part2 sweep", "error: sweep: is of another sweep file than part1");
}
