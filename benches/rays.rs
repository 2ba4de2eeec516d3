//! The ray kernel, on the rays of photons that bounce diffusely.

use divan::{Bencher, black_box_drop, counter::ItemsCount};
use phylux::{Encounter, Lambert, Material, Ray, Scene, Stream, Transport};

use crate::scenes::{canopy, shipped};

const RAYS: usize = 100_000;

/// Rays from one bounce to the next, of white diffuse surfaces, in the order that photons take them.
fn bounces(scene: &Scene) -> Vec<Ray> {
    let white = Material::Lambert(Lambert::new(&[1.0]));
    let mut rng = Stream::new(1, 0, 0);
    let mut rays = Vec::with_capacity(RAYS);
    for light in scene.lights.iter().cycle() {
        let mut ray = light.emit(scene.ray_offset(), &mut rng);
        for _ in 0..8 {
            let Some(hit) = scene.closest(&ray) else { break };
            let encounter = Encounter::new(ray.direction, scene.surface(hit.triangle).normal);
            let Some(on) = white.sample::<1>(&encounter, Transport::Light, &mut rng) else { break };
            ray = scene.leave(hit.point, encounter.normal, on.direction);
            rays.push(ray);
            if rays.len() == RAYS {
                return rays;
            }
        }
    }
    rays
}

fn closest(bencher: Bencher, scene: &Scene) {
    let rays = bounces(scene);
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
    let rays = bounces(&scene);
    bencher.counter(ItemsCount::new(RAYS)).bench(|| {
        rays.iter().for_each(|ray| scene.crossings(ray, f32::INFINITY, black_box_drop));
    });
}
