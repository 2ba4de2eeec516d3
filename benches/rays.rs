//! Times the ray kernel, with rays of photons that surfaces scatter diffusely.

use divan::{Bencher, black_box_drop, counter::ItemsCount};
use phylux::Scene;

use crate::scenes::{bounces, canopy, shipped};

const RAYS: usize = 100_000;

fn closest(bencher: Bencher, scene: &Scene) {
    let rays = bounces(scene, RAYS);
    bencher
        .counter(ItemsCount::new(RAYS))
        .bench(|| rays.iter().filter(|ray| scene.closest(ray).is_some()).count());
}

#[divan::bench]
fn closest_in_chamber(bencher: Bencher) {
    closest(bencher, &shipped("growth-chamber.json").scene);
}

#[divan::bench]
fn closest_in_greenhouse(bencher: Bencher) {
    closest(bencher, &shipped("greenhouse.json").scene);
}

#[divan::bench]
fn closest_in_canopy(bencher: Bencher) {
    closest(bencher, &canopy().scene);
}

#[divan::bench]
fn crossings_in_greenhouse(bencher: Bencher) {
    let scene = shipped("greenhouse.json").scene;
    let rays = bounces(&scene, RAYS);
    bencher.counter(ItemsCount::new(RAYS)).bench(|| {
        rays.iter().for_each(|ray| scene.crossings(ray, f32::INFINITY, black_box_drop));
    });
}
