//! Scenes whose irradiances others have computed, by closed forms, quadrature, and a backward path
//! tracer (Mitsuba). They are not part of the repository, but in the folder truth of PHYLUX_SHARED.

use std::path::Path;

use phylux::{Estimator, RunResult, results::FaceResult};
use serde_json::{Value, json};

use crate::{
    common::{TestScene, shared},
    world::check_ledger,
};

const PHOTONS: u64 = 2_000_000;
/// In a furnace each photon goes a long way, and 27 captors share what is found.
const PHOTONS_OF_FURNACE: u64 = 400_000;
const PATHS: u64 = 500_000;

/// Runs the scene of a truth, with captors that count on both sides.
fn run(folder: &Path, seed: u64, estimator: Estimator, count: u64) -> RunResult {
    let text = std::fs::read_to_string(folder.join("scene.json")).expect("scene.json");
    let mut scene: Value = serde_json::from_str(&text).expect("a scene");
    for list in ["objects", "lights", "captors"] {
        for entry in scene[list].as_array_mut().into_iter().flatten() {
            if let Some(obj) = entry.get("obj").and_then(Value::as_str) {
                entry["obj"] = json!(folder.join(obj));
            }
        }
    }
    for captor in scene["captors"].as_array_mut().expect("captors") {
        captor["sides"] = json!("both");
    }
    let scene = TestScene::new(&scene.to_string(), &[]);
    match estimator {
        Estimator::Paths => scene.run_paths(count, seed),
        _ => {
            let result = scene.run(count, seed);
            check_ledger(&result);
            result
        }
    }
}

struct Truth {
    captor: String,
    band: usize,
    irradiance: f64,
    standard_error: f64,
}

/// Reads the rows of a truth's table: captor, band, irradiance, standard error, method.
fn truths(path: &Path, result: &RunResult) -> Vec<Truth> {
    let mut reader = csv::Reader::from_path(path).expect("a table of truths");
    let row = |row: csv::StringRecord| {
        let band = &row[1];
        let named = result.bands.iter().position(|b| b.name == *band);
        // in scenes with one unnamed band the table calls it b0
        let band = named.unwrap_or_else(|| band[1..].parse().expect("a band"));
        let number = |i: usize| row[i].parse().expect("a number");
        Truth { captor: row[0].into(), band, irradiance: number(2), standard_error: number(3) }
    };
    reader.records().map(|record| row(record.expect("a row"))).collect()
}

/// Returns the standard error of an irradiance. It comes from the batches if at least 100 photons
/// arrived. Otherwise it is Poisson's for the number of photons that the truth lets expect, which
/// carry the mean power of those that arrived or, if none did, the lowest mean power of all
/// captors.
fn standard_error(run: &RunResult, face: &FaceResult, truth: &Truth, area: f64) -> f64 {
    if face.photons >= 100 {
        return face.irradiance_se[truth.band].unwrap_or(f64::INFINITY);
    }
    let weight = |face: &FaceResult| face.flux[truth.band] / face.photons as f64;
    let weight = match face.photons {
        0 => {
            let lit = run.captors.iter().map(|captor| &captor.front).filter(|f| f.photons > 0);
            lit.map(weight).fold(f64::INFINITY, f64::min)
        }
        _ => weight(face),
    };
    (truth.irradiance * weight / area).sqrt()
}

/// Compares every captor and band with the truth, within 4 combined standard errors plus 0.1 % of
/// the value.
fn compare(estimator: Estimator, count: u64, name: &str, comparisons: usize) {
    let folder = shared().join("truth").join(name);
    let result = run(&folder, 1, estimator, count);
    let mut wrong = Vec::new();
    let mut compared = 0;
    let mut sum_of_squares = 0.0;
    for (file, front) in [("truth.csv", true), ("truth_back.csv", false)] {
        if !folder.join(file).is_file() {
            continue;
        }
        for truth in truths(&folder.join(file), &result) {
            let id = format!("captors/{}", truth.captor);
            let captor = result.captors.iter().find(|c| c.id == id).expect("the captor");
            let face = if front { &captor.front } else { captor.back.as_ref().expect("a back") };
            let se = standard_error(&result, face, &truth, captor.area);
            let combined = se.hypot(truth.standard_error);
            let off = face.irradiance[truth.band] - truth.irradiance;
            let line = format!(
                "{name} {} {}, front {front}: {:.6} truth {:.6}, standard error {:.2} %, z {:+.2}",
                truth.captor,
                result.bands[truth.band].name,
                face.irradiance[truth.band],
                truth.irradiance,
                100.0 * combined / truth.irradiance,
                off / combined,
            );
            println!("{line}");
            let holds = off.abs() <= 4.0 * combined + 1e-3 * truth.irradiance;
            if !holds {
                wrong.push(line);
            }
            compared += 1;
            sum_of_squares += if off == 0.0 { 0.0 } else { (off / combined).powi(2) };
        }
    }
    println!("{name}: {compared} comparisons, mean z2 {:.2}", sum_of_squares / compared as f64);
    assert!(wrong.is_empty(), "\n{}", wrong.join("\n"));
    assert_eq!(compared, comparisons);
}

// Seed 1, 2e6 photons (4e5 in the furnace) or 5e5 paths; odds of a false alarm at most 1.1e-4 for
// each comparison (Student's t, 127 degrees of freedom).

#[test]
#[ignore = "needs PHYLUX_SHARED"]
fn needs_shared_area_lamp() {
    compare(Estimator::Photons, PHOTONS, "A2_area", 15);
}

#[test]
#[ignore = "needs PHYLUX_SHARED"]
fn needs_shared_spot() {
    compare(Estimator::Photons, PHOTONS, "A4_spot", 11);
}

#[test]
#[ignore = "needs PHYLUX_SHARED"]
fn needs_shared_furnace() {
    compare(Estimator::Photons, PHOTONS_OF_FURNACE, "A5a_furnace_centre", 27);
}

#[test]
#[ignore = "needs PHYLUX_SHARED"]
fn needs_shared_slab() {
    compare(Estimator::Photons, PHOTONS, "A6_slab", 10);
}

#[test]
#[ignore = "needs PHYLUX_SHARED"]
fn needs_shared_cornell_box_both_sides() {
    compare(Estimator::Photons, PHOTONS, "B_cornell", 72);
}

#[test]
#[ignore = "needs PHYLUX_SHARED"]
fn needs_shared_dim_lamp_behind_a_thin_wall() {
    compare(Estimator::Photons, PHOTONS, "D3b_thin_wall_dimlamp", 10);
}

#[test]
#[ignore = "needs PHYLUX_SHARED"]
fn needs_shared_area_lamp_by_paths() {
    compare(Estimator::Paths, PATHS, "A2_area", 15);
}

#[test]
#[ignore = "needs PHYLUX_SHARED"]
fn needs_shared_spot_by_paths() {
    compare(Estimator::Paths, PATHS, "A4_spot", 11);
}

#[test]
#[ignore = "needs PHYLUX_SHARED"]
fn needs_shared_furnace_by_paths() {
    compare(Estimator::Paths, PATHS, "A5a_furnace_centre", 27);
}

#[test]
#[ignore = "needs PHYLUX_SHARED"]
fn needs_shared_cornell_box_both_sides_by_paths() {
    compare(Estimator::Paths, PATHS, "B_cornell", 72);
}

#[test]
#[ignore = "needs PHYLUX_SHARED"]
fn needs_shared_dim_lamp_behind_a_thin_wall_by_paths() {
    compare(Estimator::Paths, PATHS, "D3b_thin_wall_dimlamp", 10);
}
