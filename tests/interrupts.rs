//! Ctrl-C: every command ends soon, whatever it is at, and leaves nothing behind. "Soon" is measured
//! by the command itself: after the signal it works for at most half of what it still had to do. Work
//! is processor time, so neither the speed nor the load of the machine counts.

#![cfg(target_os = "linux")]

use std::{fmt::Write, fs, path::Path, process::Child};

use crate::{
    bad_input::listing,
    common::{TestScene, stderr},
    processes::{signal, start, wait_for},
};

/// Clock ticks (of 10 ms) that an end may take where little was left to do: processor time is counted
/// in steps, and includes the release of memory.
const TICKS: u64 = 5;

const BOX: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1
f 1 2 3 4\nf 5 8 7 6\nf 1 5 6 2\nf 3 7 8 4\nf 2 6 7 3\nf 1 4 8 5\n";

/// A room with a grid of sensors, and a camera.
const ROOM: &str = r#"{
    "materials": {"grey": {"type": "lambert", "reflectance": 0.5}},
    "objects": [{"name": "room", "obj": "box.obj", "material": "grey", "captor": true}],
    "lights": [{"name": "lamp", "type": "point", "position": [0.5, 0.5, 0.5], "power": 100}],
    "captors": [{"name": "g", "grid": {"x": [0.1, 0.9], "y": [0.1, 0.9], "nx": 20, "ny": 20, "z": 0.2, "radius": 0.01}}],
    "camera": {"position": [0.5, 0.02, 0.5], "look_at": [0.5, 1, 0.5], "fov_deg": 90, "width": 800, "height": 800},
    "settings": {"photons": 1000000000000, "threads": 1}
}"#;

/// Returns the processor time of a process in clock ticks, and whether it has ended.
fn work(child: &Child) -> (u64, bool) {
    let stat = fs::read_to_string(format!("/proc/{}/stat", child.id())).expect("a process");
    // the name in brackets may hold anything
    let (_, rest) = stat.rsplit_once(')').expect("a name");
    let fields: Vec<&str> = rest.split_whitespace().collect();
    let ticks = |i: usize| fields[i].parse::<u64>().expect("a number");
    (ticks(11) + ticks(12), fields[0] == "Z")
}

/// Waits until a command has worked for so many clock ticks, or has ended. Returns its work.
fn wait_for_work(child: &Child, ticks: u64) -> (u64, bool) {
    let mut now = (0, false);
    wait_for("work, or an end", || {
        now = work(child);
        now.1 || now.0 >= ticks
    });
    now
}

/// Removes what has come into a folder since it held the files `before`.
fn tidy(folder: &Path, before: &[String]) {
    for name in listing(folder).into_iter().filter(|name| !before.contains(name)) {
        let path = folder.join(name);
        if path.is_dir() { fs::remove_dir_all(path) } else { fs::remove_file(path) }.expect("gone");
    }
}

/// Returns how many clock ticks a command works if nothing interrupts it.
fn whole(folder: &Path, line: &str) -> u64 {
    let before = listing(folder);
    let child = start(folder, line);
    let (ticks, _) = wait_for_work(&child, u64::MAX);
    let output = child.wait_with_output().expect("an end");
    assert!(output.status.success(), "{line}: {}", stderr(&output));
    tidy(folder, &before);
    ticks
}

/// Interrupts a command when it has worked for so many clock ticks, and checks that it says so and
/// leaves the folder as it was, but for `keeps`. Returns for how many ticks it had worked when the
/// signal was sent, and for how many afterwards; `None` if it had already ended.
fn interrupted(folder: &Path, line: &str, ticks: u64, keeps: &str) -> Option<(u64, u64)> {
    let before = listing(folder);
    let child = start(folder, line);
    let (_, ended) = wait_for_work(&child, ticks);
    if !ended {
        signal(&child, "-INT");
    }
    let (worked, _) = work(&child);
    let (all, _) = wait_for_work(&child, u64::MAX);
    let output = child.wait_with_output().expect("an end");
    let words = stderr(&output);
    let interrupted = output.status.code() == Some(130);
    assert!(interrupted || output.status.success(), "{line}: {words}");
    if interrupted {
        assert!(words.contains("interrupted"), "{line}: {words}");
        let mut left = listing(folder);
        left.retain(|name| name != keeps);
        assert_eq!(left, before, "{line}");
    }
    tidy(folder, &before);
    interrupted.then_some((worked, all - worked))
}

/// Interrupts a command when this fraction of its work is done, or earlier if it has then ended
/// already. `whole` is the work of the command, or of its phase that is tested. A sweep keeps `out`,
/// and a run `kept`, once they have begun.
fn ends_soon(folder: &Path, line: &str, whole: u64, fraction: f64) {
    let keeps = if line.starts_with("sweep") { "out" } else { "kept" };
    let mut ticks = (fraction * whole as f64) as u64;
    let (worked, after) = loop {
        match interrupted(folder, line, ticks, keeps) {
            Some((worked, after)) if worked < whole || ticks == 0 => break (worked, after),
            _ => ticks /= 2,
        }
    };
    let most = whole.saturating_sub(worked) / 2 + TICKS;
    assert!(after <= most, "{line}: {after} ticks after {worked} of {whole}");
}

/// The work has no end. It is interrupted when it has worked twice as long as a check of the scene,
/// which reads it and traces a little.
#[test]
fn commands_that_trace_end() {
    let scene = TestScene::new(ROOM, &[("box.obj", BOX)]);
    fs::write(scene.path("m.csv"), "captor,value\ng/0-0,10\n").expect("readings");
    let folder = scene.path("");
    let read = whole(&folder, "check scene.json");
    for line in [
        "run scene.json --csv t.csv --per-captor each",
        "run scene.json --max-time 1e12",
        "run scene.json --tolerance 1e-9",
        "run scene.json --shard 1/2 -o s.json",
        "run scene.json --estimator paths",
        "run scene.json --estimator auto",
        "chart scene.json -o charts --photons 1e12",
        "calibrate scene.json m.csv",
        "view scene.json -o v.html",
        "export scene.json -o v.vtp",
        "render scene.json --photons 1e5 --rays 4096 -o z.png",
        "render scene.json --photons 1e12 --map-photons 1e8 -o z.png",
    ] {
        assert!(interrupted(&folder, line, 2 * read, "").is_some(), "{line}: ended");
    }
}

/// Light on tiles and the page are later phases of a command.
#[test]
fn later_phases_end_soon() {
    let few = r#""photons": 20000, "map_photons": 20000, "k": 10"#;
    let json = ROOM.replace(r#""photons": 1000000000000"#, few);
    let scene = TestScene::new(&json, &[("box.obj", BOX)]);
    let folder = scene.path("");
    let line = "view scene.json -o v.html";
    let whole = whole(&folder, line);
    for fraction in [0.2, 0.4, 0.7] {
        ends_soon(&folder, line, whole, fraction);
    }
}

/// Every hour of a week has a sun of its own, which each of 2000 sensors sees by shadow rays.
#[test]
fn years_end_soon_while_the_sun_is_traced() {
    let mut weather = String::from("time,ghi,dni,dhi\n");
    for day in 1..=7 {
        for hour in 0..24 {
            let high = (std::f64::consts::PI * (hour as f64 + 0.5 - 4.0) / 16.0).sin().max(0.0);
            let (dni, dhi) = (500.0 * high, 100.0 * high);
            let ghi = 0.8 * high * dni + dhi;
            let start = format!("2025-06-{day:02}T{hour:02}:00+00:00");
            let _ = writeln!(weather, "{start},{ghi:.2},{dni:.2},{dhi:.2}");
        }
    }
    let scene = r#"{
        "bands": [{"name": "PAR", "from_nm": 400, "to_nm": 700}],
        "site": {"latitude": 45, "longitude": 0},
        "weather": {"file": "w.csv", "stamp": "start"},
        "time": {"from": "2025-06-01T00:00+00:00", "to": "2025-06-08T00:00+00:00"},
        "materials": {"grey": {"type": "lambert", "reflectance": 0.3}},
        "objects": [{"name": "room", "obj": "box.obj", "material": "grey"}],
        "lights": [{"type": "sun"}, {"type": "sky"}],
        "captors": [{"name": "g", "grid": {"x": [2, 4], "y": [2, 4], "nx": 45, "ny": 45, "z": 0.2, "radius": 0.01}}],
        "settings": {"photons": 2000, "threads": 1, "guiding": "off"}
    }"#;
    let scene = TestScene::new(scene, &[("box.obj", BOX), ("w.csv", &weather)]);
    let (folder, line) = (scene.path(""), "year scene.json -o year");
    let whole = whole(&folder, line);
    for fraction in [0.2, 0.5, 0.7] {
        ends_soon(&folder, line, whole, fraction);
    }
}

/// A mesh of 200,000 triangles is read and arranged for some time. All these commands do what a
/// check does, and some of them more.
#[test]
fn commands_that_read_end_soon() {
    let n = 316;
    let mut obj = String::new();
    for i in 0..=n {
        (0..=n).for_each(|j| {
            let _ = writeln!(obj, "v {i} {j} {}", (i * j) % 7);
        });
    }
    for i in 0..n {
        for j in 0..n {
            let a = i * (n + 1) + j + 1;
            let _ = writeln!(obj, "f {a} {} {} {}", a + 1, a + n + 2, a + n + 1);
        }
    }
    let scene = r#"{
        "materials": {"grey": {"type": "lambert", "reflectance": 0.5}},
        "objects": [{"name": "field", "obj": "field.obj", "material": "grey"}],
        "lights": [{"name": "lamp", "type": "point", "position": [0, 0, 90], "power": 1}],
        "captors": [{"name": "s", "disc": {"center": [0, 0, 50], "normal": [0, 0, 1], "radius": 1}}],
        "settings": {"photons": 1000000000000, "threads": 1}
    }"#;
    let scene = TestScene::new(scene, &[("field.obj", &obj)]);
    let sweep = r#"{"scene": "scene.json", "vary": {"/lights/0/power": [1, 2]}}"#;
    fs::write(scene.path("s.json"), sweep).expect("a sweep");
    let folder = scene.path("");
    let whole = whole(&folder, "check scene.json");
    for (line, fraction) in [
        ("run scene.json", 0.1),
        ("run scene.json", 0.4),
        ("check scene.json", 0.3),
        ("render scene.json -o z.png", 0.2),
        ("run scene.json --checkpoint kept", 0.2),
        ("sweep s.json -o out --dry-run", 0.2),
    ] {
        ends_soon(&folder, line, whole, fraction);
    }
}

/// An environment map of 2 million texels is read for some time, by commands that read scenes once
/// and by one that reads them again for each of its runs.
#[test]
fn commands_that_read_maps_end_soon() {
    let scene = r#"{
        "materials": {"grey": {"type": "lambert", "reflectance": 0.5}},
        "objects": [{"name": "room", "obj": "box.obj", "material": "grey"}],
        "lights": [{"type": "environment", "file": "sky.hdr"}],
        "captors": [{"name": "s", "disc": {"center": [0.5, 0.5, 2], "normal": [0, 0, 1], "radius": 1}}],
        "settings": {"photons": 1000, "threads": 1}
    }"#;
    let scene = TestScene::new(scene, &[("box.obj", BOX)]);
    let (width, height) = (2048u32, 1024u32);
    let head = format!("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {height} +X {width}\n");
    let texels = (0..width * height).flat_map(|i| [100, (i % 90) as u8 + 60, (i % 7) as u8, 128]);
    let map: Vec<u8> = head.into_bytes().into_iter().chain(texels).collect();
    fs::write(scene.path("sky.hdr"), map).expect("a map");
    let sweep = r#"{"scene": "scene.json", "vary": {"/materials/grey/reflectance": [0.1, 0.2]}}"#;
    fs::write(scene.path("s.json"), sweep).expect("a sweep");
    let folder = scene.path("");
    for line in ["chart scene.json -o charts", "sweep s.json -o out"] {
        ends_soon(&folder, line, whole(&folder, line), 0.2);
    }
}
