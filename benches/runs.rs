//! Times whole runs, on one thread unless stated otherwise.

use divan::{Bencher, counter::ItemsCount};
use phylux::{
    Control, Estimator, LoadedScene, Settings, simulate,
    transport::{NearestCount, PhotonCount, ThreadCount},
};

use crate::scenes::{in_bands, shipped};

const HISTORIES: u64 = 100_000;
const SCENES: [&str; 3] = ["box.json", "growth-chamber.json", "greenhouse.json"];

fn run(bencher: Bencher, loaded: &LoadedScene, change: impl FnOnce(&mut Settings)) {
    let (photons, threads) = (PhotonCount::new(HISTORIES).ok(), ThreadCount::ONE);
    let mut settings =
        Settings { photons, threads, k: Some(NearestCount::NONE), ..loaded.settings.clone() };
    change(&mut settings);
    let control = Control::default();
    bencher
        .counter(ItemsCount::new(HISTORIES))
        .bench(|| simulate(&loaded.scene, &settings, &control).expect("a run"));
}

/// Photons that are counted but not stored.
#[divan::bench(args = SCENES, sample_count = 15)]
fn photons(bencher: Bencher, scene: &str) {
    run(bencher, &shipped(scene), |_| {});
}

/// The same photons, stored in a photon map.
#[divan::bench(args = SCENES, sample_count = 15)]
fn photons_and_map(bencher: Bencher, scene: &str) {
    run(bencher, &shipped(scene), |settings| settings.k = None);
}

#[divan::bench(args = SCENES, sample_count = 15)]
fn photons_on_two_threads(bencher: Bencher, scene: &str) {
    run(bencher, &shipped(scene), |settings| settings.threads = ThreadCount::nearest_to(2));
}

/// The same photons with 1, 4 and 12 bands of equal values.
#[divan::bench(args = [1, 4, 12], sample_count = 15)]
fn chamber_in_bands(bencher: Bencher, bands: usize) {
    run(bencher, &in_bands("growth-chamber.json", bands), |_| {});
}

#[divan::bench(args = [1, 4, 12], sample_count = 15)]
fn greenhouse_in_bands(bencher: Bencher, bands: usize) {
    run(bencher, &in_bands("greenhouse.json", bands), |_| {});
}

/// Backward paths from all captors; their total number is that of the photons above.
#[divan::bench(args = SCENES, sample_count = 7)]
fn paths(bencher: Bencher, scene: &str) {
    run(bencher, &shipped(scene), |settings| settings.estimator = Estimator::Paths);
}
