//! k-nearest estimates where irradiance is known to be uniform.

use phylux::{RunResult, Settings};

use crate::{
    common::run_file,
    exact::Comparisons,
    world::{Mesh, World, check_ledger},
};

/// 53 x 53 captors that tile a square of 2 m, close under a uniform Lambertian sheet of power 4, and
/// their irradiance.
fn uniform_tiles() -> (World, f64) {
    const SIDE: usize = 53;
    let size = 2.0 / SIDE as f64;
    let tiles = (0..SIDE * SIDE).map(|i| {
        let (x, y) = ((i % SIDE) as f64 + 0.5, (i / SIDE) as f64 + 0.5);
        let center = [x * size - 1.0, y * size - 1.0, 0.0];
        (format!("{i}"), Mesh::square(center, [0.0, 0.0, 1.0], size))
    });
    let lamp = Mesh::square([0.0, 0.0, 1e-5], [0.0, 0.0, -1.0], 2.0);
    (World::new().captors("tiles", tiles).lamp("lamp", &lamp, 4.0), 1.0)
}

fn run(world: &World, photons: u64, k: usize, map_photons: usize) -> RunResult {
    let result = run_file(&world.write().path("scene.json"), |settings| {
        *settings =
            Settings { photons: Some(photons), seed: 1, k, map_photons, ..settings.clone() };
    });
    check_ledger(&result);
    result
}

/// The k-nearest irradiances of all captors.
fn nearest(result: &RunResult) -> Vec<f64> {
    let irradiance = |knn: &Option<Option<phylux::NearestResult>>| {
        knn.as_ref().and_then(|knn| knn.as_ref()).map_or(0.0, |knn| knn.irradiance[0])
    };
    result.captors.iter().map(|captor| irradiance(&captor.front.knn)).collect()
}

/// With n photons on a captor of which the ball of the k-th holds a part, sum of k-1 / area is unbiased
/// and has the relative variance 1 / (k - 2): the mean over 2809 captors, and the variance, for balls
/// in the middle of a captor and for balls that its edges cut (edges are not darkened). A map that
/// holds a quarter of the photons has the same mean.
/// Seed 1, 1.4e6 photons (500 a captor), standard errors of the mean at most 0.3 %, of the variance
/// 3 %; 6 comparisons at 4 standard errors, odds of a false alarm 4e-4.
#[test]
fn nearest_photons_of_uniform_light() {
    let (world, exact) = uniform_tiles();
    let mut check = Comparisons::new("k nearest", 0.04);
    for (k, map_photons) in [(50, 2_000_000), (400, 2_000_000), (50, 350_000)] {
        let result = run(&world, 1_400_000, k, map_photons);
        let map = result.map.as_ref().expect("a map");
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
        // excess kurtosis of a gamma variate's inverse: 30 / k
        let spread = expected * (2.0 / n + 30.0 / (k as f64 * n)).sqrt();
        check.add(format!("variance, {what}"), variance, spread, expected);
    }
    check.finish(6);
}

/// With fewer photons than k a captor's estimate is all of them over all of it: its irradiance.
/// Seed 1, 2.56e5 photons, which makes all blocks alike; no chance in it.
#[test]
fn fewer_photons_than_k_count_over_the_whole_captor() {
    let (world, _) = uniform_tiles();
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
