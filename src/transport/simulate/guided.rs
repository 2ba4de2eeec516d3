//! A short trial that says whether flights aimed at virtual captors pay.
//!
//! Cost is work, never time: rays x relative variance, meaned over the faces of all captors. What it decides depends on
//! the scene and the seed alone, so that a run of as many photons as another one had finds the same bytes.

use super::{Control, Keep, Run, trial::Found};
use crate::{
    error::{Result, catch_panic},
    math::{rng::Purpose, stats::Estimate},
    scene::{captor::CaptorKind, world::Scene},
    transport::{
        settings::{Estimator, Guiding, Settings},
        tally::Totals,
    },
};

/// Photons that each way is tried with first; twice as many as long as they see too little, up to ...
const FIRST: u64 = 1 << 12;
/// ... this number. All together take about the rays of 4e5 photons.
const MOST: u64 = 1 << 16;
/// Or until so many rays were traced: where paths are long.
const RAYS: u64 = 1 << 21;
/// Histories that must have come to a face for its variance to say something.
const SEEN: u64 = 30;
/// Aimed flights must be so much cheaper: a trial is rough.
const GAIN: f64 = 0.8;

/// The same settings, of which `guiding` is no longer left to a trial. Errors: those of a run.
pub fn choose_guiding(scene: &Scene, settings: &Settings, control: &Control) -> Result<Settings> {
    let guiding = match settings.guiding {
        Guiding::Auto => catch_panic("run", || decide(scene, settings, control))?,
        decided => decided,
    };
    Ok(Settings { guiding, ..settings.clone() })
}

fn decide(scene: &Scene, settings: &Settings, control: &Control) -> Result<Guiding> {
    if settings.estimator == Estimator::Paths || !scene.has_virtual_captors() {
        return Ok(Guiding::Off);
    }
    let control = &Control { progress: &|_| {}, ..*control };
    let (mut photons, mut rays) = (FIRST.max(scene.sources() as u64), 0);
    loop {
        let plain = tried(scene, settings, Guiding::Off, photons, control)?;
        let aimed = tried(scene, settings, Guiding::Aim, photons, control)?;
        rays += plain.segments + aimed.segments;
        if sees_enough(scene, &aimed) || 2 * photons > MOST || rays > RAYS {
            let [plain, aimed] = [&plain, &aimed].map(|totals| found(scene, totals));
            let cost = |one: &Found, other| one.rays as f64 * one.variance(other, photons, false);
            let pays = cost(&aimed, &plain) < GAIN * cost(&plain, &aimed);
            return Ok(if pays { Guiding::Aim } else { Guiding::Off });
        }
        photons *= 2;
    }
}

/// What so many photons find one way.
fn tried(
    scene: &Scene,
    settings: &Settings,
    guiding: Guiding,
    photons: u64,
    control: &Control,
) -> Result<Totals> {
    let settings = Settings {
        estimator: Estimator::Photons,
        guiding,
        k: Some(0),
        seed: settings.seed,
        threads: settings.threads,
        ..Settings::default()
    };
    let run = Run::new(scene, &settings, Vec::new(), Keep::OnCaptors, control)?;
    let run = Run { purpose: Purpose::Guiding, ..run };
    let mut totals = run.totals();
    run.rounds(&run.schedule(photons)?, (0, 0, 0), 0..1, None, &mut totals, None)?;
    Ok(totals)
}

/// Whether at least half of the faces that can be aimed at have light of enough histories.
fn sees_enough(scene: &Scene, totals: &Totals) -> bool {
    let sensors = scene.captors.iter().filter(|captor| captor.kind != CaptorKind::Surface);
    let faces = sensors.flat_map(|captor| {
        captor.kind.faces().iter().map(move |&face| captor.first_channel + face as usize)
    });
    let (mut all, mut lit) = (0, 0);
    for channel in faces {
        all += 1;
        lit += usize::from(totals.histories_in(channel).is_some_and(|of| of >= SEEN));
    }
    2 * lit >= all
}

/// The relative variance of one history on each face, in each band.
fn found(scene: &Scene, totals: &Totals) -> Found {
    let mut found = Found { rays: totals.segments, ..Found::default() };
    for captor in &scene.captors {
        for &face in captor.kind.faces() {
            let running = totals.running(captor.first_channel + face as usize);
            for band in &running[..scene.bands.len()] {
                let Estimate { mean, standard_error } = band.estimate(totals.batches);
                let relative = standard_error.unwrap_or(mean) / mean;
                found.add(mean, relative.powi(2) * totals.histories as f64);
            }
        }
    }
    found
}
