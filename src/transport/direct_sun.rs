//! Direct and mirrored sunlight on the fronts of captors, found by shadow rays.

use std::sync::atomic::{AtomicU64, Ordering};

use glam::Vec3;
use rayon::prelude::*;

use crate::{
    error::{Error, NOTHING_WRITTEN, Result},
    math::{
        rng::{Purpose, Streams},
        spectrum::{Lanes, with_lanes},
    },
    scene::{captor::Channel, daylight::InfiniteLight, world::Scene},
    transport::{
        paths::Face,
        simulate::{Control, Progress},
    },
};

/// The points are drawn in this many sets, the spread of which gives the standard error. The
/// [`POINTS`] points of a set are spread evenly.
const SETS: u64 = 8;
const POINTS: u64 = 8;
/// Number of random numbers that a shadow ray takes.
const NUMBERS: u32 = 8;

/// Returns the irradiance (W/m2) that the suns of each of some lights at infinity bring to the front
/// of each captor, straight, through thin panes or by way of one flat pane or mirror, and its
/// standard error. There is one list for each captor; it holds the lights one after the other, and
/// for each of them the bands and then the sums over bands. Each value is found at 64 points, by a
/// shadow ray to the sun and one to each of its images that may be seen from there. A light that
/// shines on no triangle of a captor gives 0. The same seed gives the same result on any number of
/// threads. The progress counts points. Error: `control` stopped the work.
pub fn direct_sun(
    scene: &Scene,
    lights: &[InfiniteLight],
    seed: u64,
    control: &Control,
) -> Result<Vec<Vec<[f32; 2]>>> {
    let of = (scene.captors.len() * lights.len()) as u64 * SETS * POINTS;
    let done = AtomicU64::new(0);
    let go_on = || {
        let photons = done.fetch_add(SETS * POINTS, Ordering::Relaxed);
        (control.progress)(Progress { photons, of: Some(of), worst: None });
        !control.stop.load(Ordering::Relaxed)
    };
    let found = with_lanes!(scene.lanes(), L => {
        let captors = (0..scene.captors.len()).into_par_iter();
        captors.map(|captor| of_captor::<L>(scene, captor, lights, seed, &go_on)).collect()
    });
    match control.stop.load(Ordering::Relaxed) {
        true => Err(Error::interrupted("run", NOTHING_WRITTEN)),
        false => Ok(found),
    }
}

fn of_captor<L: Lanes>(
    scene: &Scene,
    captor: usize,
    lights: &[InfiniteLight],
    seed: u64,
    go_on: &impl Fn() -> bool,
) -> Vec<[f32; 2]> {
    let face = Face::new(scene, captor, Channel::Front);
    let streams = Streams::new(seed, Purpose::DirectSun, captor as u64);
    let bands = scene.bands.len();
    let normals = scene.triangles_of(&scene.captors[captor]).iter().map(|t| t.normal());
    let normals: Vec<Vec3> = normals.collect();
    let of = |(l, light): (usize, &InfiniteLight)| {
        let mut sums = vec![[0.0; 2]; bands + scene.sums.len()];
        // a mirror may turn the light of any sun to the captor
        let mirrored = scene.flat_mirrors().is_some();
        if go_on() && (mirrored || normals.iter().any(|normal| light.may_shine_on(*normal))) {
            for set in (0..SETS).map(|set| l as u64 * SETS + set) {
                let sequence = streams.sequence(set);
                let mut found = vec![0.0; bands];
                for point in 0..POINTS {
                    let rng = streams.history(set * POINTS + point);
                    let mut rng = rng.with_sobol(sequence, point, NUMBERS);
                    let direct = face.direct::<L>(light, &mut rng);
                    for (sum, value) in found.iter_mut().zip(direct.iter().flat_map(|d| d.values()))
                    {
                        *sum += f64::from(*value) / POINTS as f64;
                    }
                }
                for ([sum, squares], value) in sums.iter_mut().zip(scene.with_sums(&found)) {
                    *sum += value;
                    *squares += value * value;
                }
            }
        }
        let n = SETS as f64;
        sums.into_iter().map(move |[sum, squares]| {
            let mean = sum / n;
            let variance = ((squares / n - mean * mean) / (n - 1.0)).max(0.0);
            [mean as f32, variance.sqrt() as f32]
        })
    };
    lights.iter().enumerate().flat_map(of).collect()
}
