//! Photons for pictures: kept on all surfaces, and no more than that takes.

use super::{Control, Keep, Run, Simulation, tried::RAYS};
use crate::{
    error::{Result, catch_panic},
    math::rng::Purpose,
    scene::{patches::Patches, world::Scene},
    transport::{
        photon_map::Way,
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

/// The most photons whose focused light is found, over those that found all of it.
const FOCUSED: u64 = 4;

/// Traces photons until `settings.map_photons` arrivals are kept, and finds the light on all surfaces
/// from them, by the nearest `settings.k`. Of the settings it also heeds seed, threads and, if they
/// are given, `photons` to trace. Errors: as [`simulate`](super::simulate()).
pub fn light_surfaces<'a>(
    scene: &'a Scene,
    settings: &Settings,
    control: &Control,
) -> Result<SurfaceLight<'a>> {
    let patches = Patches::new(scene);
    let keep = Keep::OnSurfaces(&patches);
    let photons = match settings.photons {
        Some(photons) => photons,
        None => {
            let control = Control { progress: &|_| {}, ..*control };
            let trial = |photons| kept(scene, settings, Purpose::Trial, keep, photons, &control);
            let first = trial(FIRST)?;
            let Totals { histories, segments, .. } = first.totals;
            let least = (RAYS * histories / segments.max(1)).clamp(FIRST, TRIAL);
            // the same photons again find the same
            let trial = match least {
                FIRST => first,
                least => trial(least)?,
            };
            let kept = trial.map.map_or(0, |map| map.photons.len()) as f64;
            let wanted = settings.map_photons as u64;
            // a little more, for chance
            let needed = 1.02 * wanted as f64 * trial.totals.histories as f64 / kept;
            (needed.ceil() as u64).clamp(least, (MOST * wanted).max(least))
        }
    };
    let found = kept(scene, settings, Purpose::Run, keep, photons, control)?;
    let map = found.map.expect("a run of photons keeps a map");
    let k = settings.k.filter(|k| *k > 1).unwrap_or(SurfaceLight::DEFAULT_K);
    Ok(SurfaceLight { scene, patches, map, k })
}

/// What of the light on all surfaces came from its lamp by mirrors, refraction or gloss alone, by the nearest `k` of more
/// photons that did: as many as `settings.map_photons`, of at most four times those that found all of it. Errors: as
/// [`simulate`](super::simulate()).
pub fn focused_light<'a>(
    light: &SurfaceLight<'a>,
    k: usize,
    settings: &Settings,
    control: &Control,
) -> Result<SurfaceLight<'a>> {
    let own = light.part(k, Way::is_focused);
    // where most of the light is focused, it has been found
    if own.map.photons.is_empty() || 2 * own.map.photons.len() > settings.map_photons {
        return Ok(own);
    }
    let keep = Keep::Focused(&own.patches);
    let photons = FOCUSED * light.map.histories;
    let found = kept(light.scene, settings, Purpose::Focused, keep, photons, control)?;
    Ok(SurfaceLight { map: found.map.expect("a run of photons keeps a map"), ..own })
}

/// Runs the scene for the photons that are to be kept.
fn kept(
    scene: &Scene,
    settings: &Settings,
    purpose: Purpose,
    keep: Keep,
    photons: u64,
    control: &Control,
) -> Result<Simulation> {
    let settings = Settings {
        estimator: Estimator::Photons,
        photons: Some(photons.max(scene.sources() as u64)),
        guiding: Guiding::Off,
        tolerance: None,
        max_time: None,
        ..settings.clone()
    };
    catch_panic("run", || {
        let run = Run::new(scene, &settings, Vec::new(), keep, control)?;
        let run = Run { purpose, ..run };
        run.go()
    })
}
