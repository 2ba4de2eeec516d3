//! Ctrl-C: every command ends within a fifth of a second of processor time, whatever it is at, and
//! leaves nothing behind. Times are those of the process, so the load of the machine does not count.

#![cfg(target_os = "linux")]

use std::{
    fmt::Write,
    fs,
    path::Path,
    process::{Child, Command, Stdio},
    thread::sleep,
    time::{Duration, Instant},
};

use crate::{
    bad_input::listing,
    common::{TestScene, binary},
};

/// Processor time that an end may take, s: that of the statement, and as much again, because the
/// system counts in steps and releasing memory is counted too.
const MOST: f64 = 0.4;

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

/// Returns the processor time of a process in s, and whether it has ended.
fn cpu(child: &Child) -> (f64, bool) {
    let stat = fs::read_to_string(format!("/proc/{}/stat", child.id())).expect("a process");
    // the name in brackets may hold anything
    let (_, rest) = stat.rsplit_once(')').expect("a name");
    let fields: Vec<&str> = rest.split_whitespace().collect();
    let ticks = |i: usize| fields[i].parse::<f64>().expect("a number");
    ((ticks(11) + ticks(12)) / 100.0, fields[0] == "Z")
}

/// Starts a command, interrupts it when it has worked for `after` seconds, and checks that it ends
/// soon and leaves the folder as it was.
fn ends_soon(folder: &Path, line: &str, after: f64) {
    let before = listing(folder);
    let mut command = Command::new(binary());
    command.args(line.split(' ')).current_dir(folder);
    let child =
        command.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().expect("phylux starts");
    let started = Instant::now();
    let wait = |until: &dyn Fn((f64, bool)) -> bool, child: &Child| loop {
        let now = cpu(child);
        if until(now) {
            return now;
        }
        assert!(started.elapsed() < Duration::from_secs(200), "{line}: no end");
        sleep(Duration::from_millis(5));
    };
    let (worked, ended) = wait(&|(worked, ended)| ended || worked >= after, &child);
    assert!(!ended, "{line}: ended before {after} s");
    let id = child.id().to_string();
    assert!(Command::new("kill").args(["-INT", &id]).status().expect("kill").success());
    let (all, _) = wait(&|(_, ended)| ended, &child);
    let output = child.wait_with_output().expect("an end");
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(130), "{line}: {said}");
    assert!(said.contains("interrupted"), "{line}: {said}");
    assert!(all - worked < MOST, "{line}: {} s after {worked} s", all - worked);
    assert_eq!(listing(folder), before, "{line}");
}

#[test]
fn commands_that_trace_end_soon() {
    let scene = TestScene::new(ROOM, &[("box.obj", BOX)]);
    fs::write(scene.path("m.csv"), "captor,value\ng/0,10\n").expect("readings");
    let folder = scene.path("");
    for line in [
        "run scene.json",
        "run scene.json --shard 1/2 -o s.json",
        "run scene.json --estimator paths",
        "run scene.json --estimator auto",
        "chart scene.json -o charts --photons 1e9",
        "calibrate scene.json m.csv",
        "view scene.json -o v.html",
        "export scene.json -o v.vtp",
        "render scene.json --photons 1e5 --rays 4000 -o z.png",
        "render scene.json --photons 1e9 --map-photons 1e8 -o z.png",
    ] {
        ends_soon(&folder, line, 0.3);
    }
}

/// Rays of one row of pixels, light on tiles and the page are later phases of a command.
#[test]
fn later_phases_end_soon() {
    let json = ROOM.replace("1000000000000", "20000");
    let scene = TestScene::new(&json, &[("box.obj", BOX)]);
    let folder = scene.path("");
    for after in [0.5, 1.0] {
        ends_soon(&folder, "view scene.json -o v.html", after);
        ends_soon(
            &folder,
            "render scene.json --photons 2e4 --map-photons 1e4 --rays 4000 -o z.png",
            after,
        );
    }
}

/// Every hour of two weeks has a sun of its own, which each of 2000 sensors sees by shadow rays.
#[test]
fn years_end_soon_while_the_sun_is_traced() {
    let mut weather = String::from("time,ghi,dni,dhi\n");
    for day in 1..=28 {
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
        "time": {"from": "2025-06-01T00:00+00:00", "to": "2025-06-29T00:00+00:00"},
        "materials": {"grey": {"type": "lambert", "reflectance": 0.3}},
        "objects": [{"name": "room", "obj": "box.obj", "material": "grey"}],
        "lights": [{"type": "sun"}, {"type": "sky"}],
        "captors": [{"name": "g", "grid": {"x": [2, 4], "y": [2, 4], "nx": 45, "ny": 45, "z": 0.2, "radius": 0.01}}],
        "settings": {"photons": 2000, "threads": 1, "guiding": "off"}
    }"#;
    let scene = TestScene::new(scene, &[("box.obj", BOX), ("w.csv", &weather)]);
    for after in [0.5, 1.2, 2.0] {
        ends_soon(&scene.path(""), "year scene.json -o year", after);
    }
}

/// A mesh of 200,000 triangles is read and arranged for longer than an end may take.
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
    for (line, after) in [
        ("run scene.json", 0.1),
        ("run scene.json", 0.4),
        ("check scene.json", 0.3),
        ("render scene.json -o z.png", 0.2),
        ("run scene.json --checkpoint kept", 0.2),
        ("sweep s.json -o out --dry-run", 0.2),
    ] {
        ends_soon(&folder, line, after);
    }
}

/// An environment map of 2 million texels is read for longer than an end may take, by commands that
/// read scenes once and by one that reads them again for each of its runs.
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
        ends_soon(&folder, line, 0.08);
    }
}
