//! Counts what phylux itself does not: how far photons fly before they end, and from how high above
//! the horizon the light of one sensor comes. The photon loop reports each event to a closure, which
//! may count whatever it likes. Run it with `cargo run --release --example own_tally`.

use std::path::Path;

use phylux::{
    Scene, load,
    math::{Running, Stream, Wide},
    scene::Strata,
    transport::{Event, trace},
};
use rayon::prelude::*;

/// Number of batches: their spread gives the standard errors.
const BATCHES: u64 = 64;
/// Number of photons of a batch.
const PHOTONS: u64 = 4096;
/// Number of bins of elevation, from the horizon to the zenith.
const BINS: usize = 6;

/// What one batch of photons found.
#[derive(Clone, Default)]
struct Found {
    /// Mean length of the way of a photon, m.
    way: f64,
    /// Flux on the sensor's front by the elevation that it comes from, W.
    flux: [f64; BINS],
}

fn main() -> phylux::Result<()> {
    let loaded = load(Path::new("scenes/box.json"))?;
    let scene = &loaded.scene;
    // the sensor in the middle of the box
    let sensor = scene.captors().iter().position(|captor| captor.id == "sensor");
    let sensor = sensor.expect("a captor of this name");
    let found: Vec<Found> =
        (0..BATCHES).into_par_iter().map(|index| batch(scene, sensor, index)).collect();

    let (way, error) = mean(found.iter().map(|batch| batch.way));
    println!("a photon flies {way:.3} +- {error:.3} m");
    for bin in 0..BINS {
        let (flux, error) = mean(found.iter().map(|batch| batch.flux[bin]));
        let degrees = |bin: usize| 90 * bin / BINS;
        println!(
            "from {:2} to {:2} degrees: {flux:8.4} +- {error:.4} W",
            degrees(bin),
            degrees(bin + 1)
        );
    }
    Ok(())
}

/// Follows the photons of a batch.
fn batch(scene: &Scene, sensor: usize, index: u64) -> Found {
    let strata = Strata::new(scene.lights(), PHOTONS, scene.lanes());
    let mut found = Found::default();
    for history in 0..PHOTONS {
        let mut rng = Stream::new(1, index, history);
        let photon = scene.emit::<Wide>(&strata, history, &mut rng);
        let watts = photon.weights[0] / PHOTONS as f64;
        trace(scene, photon.ray, photon.power, (), &mut rng, |event| match event {
            Event::Crossing { crossing, direction, power, .. }
                if crossing.captor == sensor && crossing.front =>
            {
                let elevation = (-direction.z).asin().to_degrees().max(0.0) as usize;
                found.flux[(elevation * BINS / 90).min(BINS - 1)] +=
                    watts * f64::from(power.values()[0]);
            }
            Event::Arrival { at, .. } => found.way += f64::from(at.hit.t) / PHOTONS as f64,
            _ => {}
        });
    }
    found
}

/// Returns the mean over batches, and its standard error.
fn mean(values: impl Iterator<Item = f64>) -> (f64, f64) {
    let mut running = Running::default();
    values.for_each(|value| running.add(value));
    let estimate = running.estimate(BATCHES);
    (estimate.mean, estimate.standard_error.unwrap_or(f64::NAN))
}
