//! Compares the ray kernel with Embree: `cargo bench --bench embree`. See benches/README.md.

#[allow(dead_code, reason = "other benchmarks use the rest")]
mod scenes;

use std::{
    env, fs,
    io::{self, BufRead, BufReader, Write},
    process::{Command, Stdio},
};

use cpu_time::ProcessTime;
use glam::Vec3;
use phylux::Scene;

use scenes::{bounces, canopy, shipped};

const RAYS: usize = 200_000;
/// Number of pairs of timings; the first pair warms up and is not used.
const PAIRS: usize = 16;

fn main() -> io::Result<()> {
    // without `--bench`, as in `cargo test --benches`, do nothing: that only checks that the
    // program runs
    if !env::args().any(|argument| argument == "--bench") {
        return Ok(());
    }
    println!("millions of rays a CPU-second; ratio to Embree: median (least, largest) of pairs");
    println!("{:16}{:>9}{:>9}{:>24}{:>9}{:>24}", "", "phylux", "default", "", "robust", "");
    for (name, scene) in [
        ("growth chamber", shipped("growth-chamber.json").scene),
        ("greenhouse", shipped("greenhouse.json").scene),
        ("canopy", canopy().scene),
    ] {
        if !compare(name, &scene)? {
            return Ok(());
        }
    }
    Ok(())
}

/// Compares one scene and prints a line of results. Returns false if Embree is missing.
fn compare(name: &str, scene: &Scene) -> io::Result<bool> {
    let rays = bounces(scene, RAYS);
    let folder = tempfile::tempdir()?;
    let corners = scene.triangles().iter().flat_map(|t| [t.a, t.b, t.c]);
    write_points(&folder.path().join("triangles"), corners)?;
    write_points(&folder.path().join("rays"), rays.iter().flat_map(|r| [r.origin, r.direction]))?;

    let python = env::var("PYTHON").unwrap_or_else(|_| "python3".into());
    let mut embree = Command::new(python)
        .arg(concat!(env!("CARGO_MANIFEST_DIR"), "/benches/embree.py"))
        .arg(folder.path())
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()?;
    let mut ask = embree.stdin.take().expect("piped");
    let mut answers = BufReader::new(embree.stdout.take().expect("piped")).lines();
    let mut timings = Vec::new();
    for _ in 0..PAIRS {
        let start = ProcessTime::now();
        let hits = rays.iter().filter(|ray| scene.closest(ray).is_some()).count();
        let own = start.elapsed().as_secs_f64();
        // the Python process has ended if Embree is missing
        if writeln!(ask).is_err() {
            return Ok(false);
        }
        let Some(line) = answers.next().transpose()? else { return Ok(false) };
        let answer: Vec<f64> = line.split(' ').map(|n| n.parse().expect("a number")).collect();
        assert!((answer[2] - hits as f64).abs() < 1e-4 * RAYS as f64, "{hits} hits, {line}");
        timings.push([own, answer[0], answer[1]]);
    }
    drop(ask);
    embree.wait()?;

    let timings = &timings[1..];
    let median = |of: &dyn Fn(&[f64; 3]) -> f64| {
        let mut all: Vec<f64> = timings.iter().map(of).collect();
        all.sort_by(f64::total_cmp);
        (all[all.len() / 2], all[0], all[all.len() - 1])
    };
    let rate = |i: usize| RAYS as f64 * 1e-6 / median(&|t| t[i]).0;
    let ratio = |i: usize| {
        let (middle, least, largest) = median(&|t| t[i] / t[0]);
        format!("{middle:.2} ({least:.2}, {largest:.2})")
    };
    println!(
        "{name:16}{:9.2}{:9.2}{:>24}{:9.2}{:>24}",
        rate(0),
        rate(1),
        ratio(1),
        rate(2),
        ratio(2)
    );
    Ok(true)
}

/// Writes three single-precision numbers for each point.
fn write_points(path: &std::path::Path, points: impl Iterator<Item = Vec3>) -> io::Result<()> {
    let bytes: Vec<u8> = points.flat_map(|p| p.to_array()).flat_map(f32::to_le_bytes).collect();
    fs::write(path, bytes)
}
