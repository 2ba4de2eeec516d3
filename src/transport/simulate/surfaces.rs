//! Photons for pictures: kept on all surfaces, and no more than that takes.

use super::{Control, Keep, Run, Simulation, tried::RAYS};
use crate::{
    error::{Result, catch_panic},
    math::rng::Purpose,
    scene::{patches::Patches, world::Scene},
    transport::{
        settings::{Estimator, Guiding, Settings},
        surface_light::SurfaceLight,
        tally::Totals,
    },
};

/// Photons of the run that tells how often one arrives, and the least that light is found from: fewer where
/// they would take more than [`RAYS`].
const TRIAL: u64 = 10_000;
/// Photons that tell how many rays one takes.
const FIRST: u64 = 128;
/// The most photons that are traced for one that is to be kept: where nearly all escape.
const MOST: u64 = 4;

/// Traces photons until `settings.map_photons` arrivals are kept, and finds the light on all surfaces
/// from them, by the nearest `settings.k`. Of the settings it also heeds seed, threads and, if they
/// are given, `photons` to trace. Errors: as [`simulate`](super::simulate()).
pub fn light_surfaces<'a>(
    scene: &'a Scene,
    settings: &Settings,
    control: &Control,
) -> Result<SurfaceLight<'a>> {
    let patches = Patches::new(scene);
    let trace = |purpose, photons: u64, control: &Control| -> Result<Simulation> {
        let settings = Settings {
            estimator: Estimator::Photons,
            photons: Some(photons.max(scene.sources() as u64)),
            guiding: Guiding::Off,
            tolerance: None,
            max_time: None,
            ..settings.clone()
        };
        catch_panic("run", || {
            let run = Run::new(scene, &settings, Vec::new(), Keep::OnSurfaces(&patches), control)?;
            let run = Run { purpose, ..run };
            run.go()
        })
    };
    let photons = match settings.photons {
        Some(photons) => photons,
        None => {
            let control = Control { progress: &|_| {}, ..*control };
            let first = trace(Purpose::Trial, FIRST, &control)?;
            let Totals { histories, segments, .. } = first.totals;
            let least = (RAYS * histories / segments.max(1)).clamp(FIRST, TRIAL);
            // the same photons again find the same
            let trial = match least {
                FIRST => first,
                least => trace(Purpose::Trial, least, &control)?,
            };
            let kept = trial.map.map_or(0, |map| map.photons.len()) as f64;
            let wanted = settings.map_photons as u64;
            // a little more, for chance
            let needed = 1.02 * wanted as f64 * trial.totals.histories as f64 / kept;
            (needed.ceil() as u64).clamp(least, (MOST * wanted).max(least))
        }
    };
    let map = trace(Purpose::Run, photons, control)?.map.expect("a run of photons keeps a map");
    let k = settings.k.filter(|k| *k > 1).unwrap_or(SurfaceLight::DEFAULT_K);
    Ok(SurfaceLight { scene, patches, map, k })
}
