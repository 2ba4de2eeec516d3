//! The k-nearest estimate where the irradiance is known.

use std::f64::consts::PI;

use phylux::{
    Estimator, RunResult, Settings,
    results::NearestResult,
    transport::{MapLimit, NearestCount, PhotonCount},
};
use serde_json::json;

use crate::{
    common::{TestScene, run_file},
    exact::Comparisons,
    world::{Mesh, Point, World, check_ledger, room},
};

/// Returns 53 x 53 captors that tile a square of 2 m, under a uniform Lambertian sheet of power 4,
/// together with their irradiance. The sheet is close above them or, where it is not `close`, 40 m
/// away in a cell that repeats, from where its photons come mixed as if each were independent.
fn uniform_tiles(close: bool) -> (World, f64) {
    const SIDE: usize = 53;
    let size = 2.0 / SIDE as f64;
    let tiles = (0..SIDE * SIDE).map(|i| {
        let (x, y) = ((i % SIDE) as f64 + 0.5, (i / SIDE) as f64 + 0.5);
        let center = [x * size - 1.0, y * size - 1.0, 0.0];
        (format!("{i}"), Mesh::square(center, [0.0, 0.0, 1.0], size))
    });
    let lamp = Mesh::square([0.0, 0.0, if close { 1e-5 } else { 40.0 }], [0.0, 0.0, -1.0], 2.0);
    let mut world = World::new().captors("tiles", tiles).lamp("lamp", &lamp, 4.0);
    if !close {
        world = world.with("periodic", json!({ "x": [-1, 1], "y": [-1, 1] }));
    }
    (world, 1.0)
}

fn run(world: &World, photons: u64, k: usize, map_photons: usize) -> RunResult {
    let result = run_file(&world.write().path("scene.json"), |settings| {
        *settings = Settings {
            photons: PhotonCount::new(photons).ok(),
            seed: 1,
            k: NearestCount::new(k).ok(),
            map_photons: MapLimit::nearest_to(map_photons),
            ..settings.clone()
        };
    });
    check_ledger(&result);
    result
}

/// Returns the k-nearest irradiances of all captors.
fn nearest(result: &RunResult) -> Vec<f64> {
    let irradiance = |knn: &Option<Option<Box<phylux::results::NearestResult>>>| {
        knn.as_ref().and_then(|knn| knn.as_ref()).map_or(0.0, |knn| knn.irradiance[0])
    };
    result.captors.iter().map(|captor| irradiance(&captor.front.knn)).collect()
}

/// In uniform light of independent photons, the estimate (k - 1) photons over the area of the
/// captor within the k-th photon's distance is unbiased and has the relative variance 1 / (k - 2).
/// Its mean and variance over 2809 captors are compared with this, for balls that lie inside a
/// captor and for balls that reach beyond its edges (edges are not darkened). A map that holds a
/// quarter of the photons gives the same mean.
///
/// Seed 1, 1.4e6 photons (500 on each captor); standard errors of the mean at most 0.3 %, of the
/// variance 3 %. 6 comparisons within 4 standard errors, odds of a false alarm 4e-4.
#[test]
fn nearest_photons_of_uniform_light() {
    let (world, exact) = uniform_tiles(false);
    let mut check = Comparisons::new("k nearest", 0.04);
    for (k, map_photons) in [(50, 2_000_000), (400, 2_000_000), (50, 350_000)] {
        let result = run(&world, 1_400_000, k, map_photons);
        let map = result.account.map.as_ref().expect("a map");
        assert!(map.arrivals <= map_photons as u64);
        assert_eq!(
            map.photons < result.photons,
            map_photons < 1_000_000,
            "{} stored",
            map.arrivals
        );
        let values = nearest(&result);
        let n = values.len() as f64;
        let mean = values.iter().sum::<f64>() / n;
        let variance = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1.0);
        let expected = exact * exact / (k as f64 - 2.0);
        let what = format!("k {k}, map of {}", map.arrivals);
        assert!((expected / n).sqrt() < 0.003 * exact);
        check.add(format!("mean, {what}"), mean, (expected / n).sqrt(), exact);
        // the excess kurtosis of the inverse of a gamma variate is 30 / k
        let spread = expected * (2.0 / n + 30.0 / (k as f64 * n)).sqrt();
        check.add(format!("variance, {what}"), variance, spread, expected);
    }
    check.finish(6);
}

/// Photons that come straight from a lamp lie more evenly than independent ones. Then the variance
/// is smaller than 1 / (k - 2), and the estimate is low by at most 1 / (2 k): a k-th photon among
/// evenly spaced ones is k - 1/2 spaces away in the mean.
///
/// Seed 1, 1.4e6 photons; the mean is within 4 of its standard errors of these bounds, with odds of
/// a false alarm 1e-4.
#[test]
fn nearest_photons_that_lie_evenly() {
    let (world, exact) = uniform_tiles(true);
    for k in [50, 400] {
        let values = nearest(&run(&world, 1_400_000, k, 2_000_000));
        let n = values.len() as f64;
        let mean = values.iter().sum::<f64>() / n;
        let variance = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1.0);
        let of_independent = exact * exact / (k as f64 - 2.0);
        assert!(variance < 0.7 * of_independent, "{k}: {variance}, not below {of_independent}");
        let low = (1.0 - mean / exact) * 2.0 * k as f64;
        let error = 2.0 * k as f64 * (variance / n).sqrt() / exact;
        assert!((-4.0 * error..1.0 + 4.0 * error).contains(&low), "{k}: {low} ± {error}");
    }
}

/// With fewer photons than k on a captor, the estimate counts all of them over the whole captor, so
/// it is the captor's irradiance.
///
/// Seed 1, 2.56e5 photons, which makes all batches equally long. The test does not depend on
/// chance.
#[test]
fn fewer_photons_than_k_count_over_the_whole_captor() {
    let (world, _) = uniform_tiles(true);
    let result = run(&world, 128 * 2_000, 200, 2_000_000);
    for captor in &result.captors {
        let knn = captor.front.knn.as_ref().and_then(|knn| knn.as_ref()).expect("an estimate");
        assert_eq!(knn.k as u64, captor.front.photons);
        let off = knn.irradiance[0] - captor.front.irradiance[0];
        assert!(off.abs() < 1e-6 * captor.front.irradiance[0], "{}: off by {off}", captor.id);
        assert!((knn.radius - 2f64.sqrt() / 53.0).abs() < 1e-5, "{}", knn.radius);
        assert_eq!(knn.coverage, 1.0);
    }
}

const UP: Point = [0.0, 0.0, 1.0];

/// Three bands, which photons carry in four lanes, each keep their own power in the map, of photons alone
/// and of those beside paths. The test does not depend on chance.
#[test]
fn every_band_has_its_own_power() {
    let lamp = Mesh::square([0.0, 0.0, 0.5], [0.0, 0.0, -1.0], 1.0);
    let world = World::new()
        .bands(3)
        .lamp("lamp", &lamp, 1.0)
        .captor("sensor", &Mesh::square([0.0; 3], [0.0, 0.0, 1.0], 1.0))
        .edited(|scene| scene["lights"][0]["power"] = json!([1, 2, 4]));
    for estimator in [Estimator::Photons, Estimator::Complete] {
        let result = run_file(&world.write().path("scene.json"), |settings| {
            settings.photons = PhotonCount::new(20_000).ok();
            (settings.estimator, settings.k) = (estimator, NearestCount::new(50).ok());
        });
        let found = result.captors[0].front.knn.as_ref().and_then(Option::as_ref);
        let irradiance = &found.expect("an estimate").irradiance;
        assert!(irradiance[0] > 0.0, "{estimator:?}: {irradiance:?}");
        for (band, times) in [(1, 2.0), (2, 4.0)] {
            let ratio = irradiance[band] / irradiance[0];
            assert!((ratio / times - 1.0).abs() < 1e-5, "{estimator:?}: {irradiance:?}");
        }
    }
}

/// Returns the estimates on all faces of a run.
fn of_seed(scene: &TestScene, photons: u64, seed: u64, k: Option<usize>) -> Vec<NearestResult> {
    let result = run_file(&scene.path("scene.json"), |settings| {
        *settings = Settings {
            photons: PhotonCount::new(photons).ok(),
            seed,
            k: k.and_then(|k| NearestCount::new(k).ok()),
            ..settings.clone()
        };
    });
    let faces = result.captors.iter().flat_map(|captor| captor.faces());
    faces.filter_map(|face| face.knn.clone().flatten().map(|knn| *knn)).collect()
}

/// Where light varies, the estimate's bias is that of the mean over the disc of the k nearest
/// photons. Under a lamp at height h it is -3/4 r^2 / h^2 for a disc of radius r. At an edge of the
/// captor, where the disc only holds photons on one side, it is the slope of E times the distance
/// of a half disc's centroid, 4 r / (3 pi).
///
/// Seeds 1 to 60, k = 1000 and 200; standard errors 0.4 and 1 % of E, for biases of -6 and -9 %. A
/// tenth of the bias is allowed for third-order terms. 2 comparisons within 4 standard errors, odds
/// of a false alarm 1e-4.
#[test]
fn bias_is_that_of_the_disc() {
    const SEEDS: u64 = 60;
    // the centroid of the L lies outside it, so its query point is on the inner edge of the long
    // arm
    let long = Mesh::rectangle([0.0; 3], [1.0, 0.0, 0.0], [0.0, 0.1, 0.0]);
    let short = Mesh::rectangle([0.0, 0.1, 0.0], [0.1, 0.0, 0.0], [0.0, 0.4, 0.0]);
    let middle = (0.1 * 0.5 + 0.04 * 0.05) / 0.14;
    let centre: fn(f64) -> f64 = |r| -0.75 * (r / 0.2).powi(2);
    // E = z / d^3 falls by the fraction 3 y / d^2 per metre away from the lamp
    let edge: fn(f64) -> f64 = |r| -(3.0 * 0.3 / 0.18) * 4.0 * r / (3.0 * PI);
    let cases = [
        ("lamp", Mesh::square([0.0; 3], UP, 1.0), [0.0, 0.0, 0.2], 0.0, 20_000, 1_000, centre),
        ("edge", long.and(short), [middle, 0.4, 0.3], 0.3, 100_000, 200, edge),
    ];
    for (what, captor, lamp, aside, photons, k, expected) in cases {
        let angle = 1.3f64;
        let power = 2.0 * PI * (1.0 - angle.cos());
        let light = json!({ "type": "spot", "position": lamp, "direction": [0, 0, -1],
                            "half_angle_deg": angle.to_degrees(), "power": power });
        let scene = World::new().captor("captor", &captor).light(light).write();
        let exact = lamp[2] / f64::hypot(lamp[2], aside).powi(3);
        let (mut bias, mut due, mut variance) = (0.0, 0.0, 0.0);
        for seed in 1..=SEEDS {
            let found = of_seed(&scene, photons, seed, Some(k)).remove(0);
            assert_eq!(found.k, k);
            let n = SEEDS as f64;
            bias += (found.irradiance[0] / exact - 1.0) / n;
            due += expected(found.radius) / n;
            variance += (found.irradiance_se[0].expect("photons") / exact / n).powi(2);
        }
        let error = variance.sqrt();
        println!("{what}: bias {bias:.4} +- {error:.4}, expected {due:.4}");
        assert!(due < -5.0 * error, "{what}: {due} +- {error} shows nothing");
        assert!((bias - due).abs() < 4.0 * error + 0.1 * due.abs(), "{what}");
    }
}

/// A furnace whose bands have different reflectances, so that photons carry different powers and
/// cross a captor several times. The mean of the estimate is exact, and its spread over the seeds
/// is the reported standard error.
///
/// Seeds 1 to 60, 6 captors with two faces: 720 values in each band, whose mean is known to 0.5 %
/// and whose variance to about 6 % (excess kurtosis below 1). 4 comparisons within 4 of these
/// errors, odds of a false alarm 3e-4.
#[test]
fn standard_error_is_the_spread_in_a_furnace() {
    let mut world = World::new()
        .bands(2)
        .material("wall", json!({ "type": "lambert", "reflectance": [0.8, 0.2] }))
        .glowing("walls", "wall", &room([-1.0; 3], [1.0; 3]), 1.0);
    for i in 0..6 {
        let place =
            [0.25 * f64::from(i) - 0.6, 0.1 * f64::from(i % 3), 0.3 * f64::from(i % 4) - 0.4];
        let normal = if i % 2 == 0 { UP } else { [0.6, 0.0, 0.8] };
        world = world.captor_of_both_sides(&format!("{i}"), &Mesh::square(place, normal, 0.3));
    }
    let scene = world.write();
    let found: Vec<NearestResult> =
        (1..=60).flat_map(|seed| of_seed(&scene, 30_000, seed, None)).collect();
    assert_eq!(found.len(), 720);
    for (band, exact) in [PI / 0.2, PI / 0.8].into_iter().enumerate() {
        let n = found.len() as f64;
        let mean = found.iter().map(|f| f.irradiance[band]).sum::<f64>() / n;
        let spread = found.iter().map(|f| (f.irradiance[band] - mean).powi(2)).sum::<f64>() / n;
        let errors = found.iter().map(|f| f.irradiance_se[band].expect("light").powi(2));
        let variance = errors.sum::<f64>() / n;
        let (off, ratio) =
            ((mean / exact - 1.0) / ((spread / n).sqrt() / exact), variance / spread);
        println!(
            "band {band}: mean off by {off:.2} errors, reported variance {ratio:.3} of the spread's"
        );
        assert!(off.abs() < 4.0 && (ratio - 1.0).abs() < 0.24, "{off} {ratio}");
    }
}

/// A sphere, a folded leaf and two shelves in one group of a file do not lie in one plane and have no
/// estimate; flat captors of several parts, tilted and far away have. Chance plays no part in this.
#[test]
fn only_what_lies_in_one_plane_has_an_estimate() {
    let leaf = |lift: f64| {
        let half = |x: f64| Mesh::rectangle([0.0; 3], [x, 0.0, lift], [0.0, 0.2, 0.0]);
        half(-0.1).flipped().and(half(0.1))
    };
    let far = |mesh: Mesh| mesh.shifted([40.0, 0.0, 0.0]);
    let shelf = |z: f64| Mesh::square([0.5, 0.5, z], UP, 0.2);
    let tilted = Mesh::square([0.3, -0.4, 0.3], [0.6, 0.0, 0.8], 0.1).and(Mesh::square(
        [0.3, -0.7, 0.3],
        [0.6, 0.0, 0.8],
        0.1,
    ));
    let sphere = json!({ "name": "ball", "sphere": { "center": [0, 0, 0.5], "radius": 0.1 } });
    let world = World::new()
        .lambert("grey", 0.5)
        .counted("folded", "grey", &leaf(0.05))
        .counted("flat", "grey", &leaf(0.0).shifted([0.0, 0.5, 0.0]))
        .counted("far", "grey", &far(leaf(0.0)))
        .captor("shelves", &shelf(0.2).and(shelf(0.4)))
        .captor("tilted", &tilted)
        .light(json!({ "type": "sky", "model": "uniform", "irradiance": 1 }))
        .edited(|scene| scene["captors"].as_array_mut().expect("captors").push(sphere));
    let result = run(&world, 200_000, 50, 2_000_000);
    for captor in &result.captors {
        let flat = ["flat/flat", "far/far", "tilted"].contains(&captor.id.as_str());
        assert!(captor.front.photons > 0, "{}", captor.id);
        let knn = captor.front.knn.as_ref().expect("a key");
        assert_eq!(knn.is_some(), flat, "{}", captor.id);
    }
}
