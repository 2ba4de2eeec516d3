//! Times the photon map: building it, and finding the k nearest photons.

use divan::{Bencher, counter::ItemsCount};
use glam::Vec3;
use phylux::{
    Scene,
    math::Stream,
    scene::{Captor, CaptorKind},
    transport::{Arrival, PackedDirection, PhotonMap, StoredPhoton},
};

use crate::scenes::shipped;

/// Number of photons in each map.
const PHOTONS: usize = 1_000_000;
/// Number of queries in one sample.
const QUERIES: u64 = 1_000;

/// Scenes in which the photons lie: on the six walls of the box, and on both faces of the leaves
/// and stems of the greenhouse, which are 300 captors.
const PLACES: [&str; 2] = ["box.json", "greenhouse.json"];

/// Returns photons of one band, spread uniformly over the surface captors of a scene.
fn arrivals(scene: &Scene) -> Vec<Arrival> {
    let surfaces = scene.captors().iter().filter(|captor| captor.kind == CaptorKind::Surface);
    let captors: Vec<&Captor> = surfaces.collect();
    // no light arrives behind the walls of the box
    let faces = if scene.triangles().len() < 100 { 1 } else { 2 };
    let mut rng = Stream::new(1, 0, 0);
    let arrival = |i: usize| {
        let captor = captors[i % captors.len()];
        let bin = (captor.first_channel + i / captors.len() % faces) as u32;
        let (triangle, position) = point_on(scene, captor, &mut rng);
        let direction = PackedDirection::new(Vec3::NEG_Z);
        let (triangle, history) = (triangle as u32, i as u32);
        let photon = StoredPhoton { direction, triangle, light: 0, history };
        Arrival { position, bin, photon }
    };
    (0..PHOTONS).map(arrival).collect()
}

/// Returns a triangle of a captor and a point on it, uniform over the area of the captor.
fn point_on(scene: &Scene, captor: &Captor, rng: &mut Stream) -> (usize, Vec3) {
    let mut rest = rng.uniform_fine() * captor.area;
    let here = |triangle: &usize| {
        rest -= f64::from(scene.triangles().at(*triangle).area());
        rest < 0.0
    };
    let triangle = captor.triangles.clone().find(here).unwrap_or(captor.triangles.start);
    let (mut u, mut v) = rng.square().into();
    if u + v > 1.0 {
        (u, v) = (1.0 - u, 1.0 - v);
    }
    (triangle, scene.triangles().at(triangle).point(u, v))
}

fn map_of(arrivals: Vec<Arrival>) -> PhotonMap {
    PhotonMap::new(arrivals, vec![1.0; PHOTONS], 1, PHOTONS as u64)
}

#[divan::bench(args = PLACES, sample_count = 15)]
fn build(bencher: Bencher, place: &str) {
    let arrivals = arrivals(&shipped(place).scene);
    bencher.counter(ItemsCount::new(PHOTONS)).with_inputs(|| arrivals.clone()).bench_values(map_of);
}

#[divan::bench(args = PLACES, sample_count = 50)]
fn nearest_100(bencher: Bencher, place: &str) {
    let arrivals = arrivals(&shipped(place).scene);
    let queries: Vec<(u32, Vec3)> = (0..QUERIES as usize)
        .map(|i| {
            let a = arrivals[i * 997 % PHOTONS];
            (a.bin, a.position)
        })
        .collect();
    let map = map_of(arrivals);
    bencher.counter(ItemsCount::new(QUERIES)).bench(|| {
        queries.iter().map(|&(bin, point)| map.nearest(bin, point, 100).len()).sum::<usize>()
    });
}
