//! Photons for pictures, which are stored on all surfaces. No more photons are traced than that
//! takes.

use super::{Arrivals, Control, Outcome, Run, memory, tried::RAYS};
use crate::{
    error::{Result, catch_panic},
    math::{machine, rng::Purpose},
    scene::{material::Scatterer, patches::Patches, world::Scene},
    transport::{
        photon_map::Way,
        settings::{Estimator, Guiding, MapLimit, NearestCount, PhotonCount, Settings},
        surface_light::SurfaceLight,
        tally::Totals,
    },
};

/// Number of photons of the trial that measures how many arrivals a photon has, and the least from
/// which the light is found; fewer where they would take more than [`RAYS`].
const TRIAL: u64 = 10_000;
/// Number of photons that measure how many rays a photon takes.
const FIRST: u64 = 128;
/// The most photons that are traced for each arrival that is to be stored; it limits the run where
/// nearly all photons escape.
const MOST: u64 = 4;

/// The most photons that are traced for focused light, relative to those that found all the light.
const FOCUSED: u64 = 8;
/// The most photons that are stored of it, relative to those of all the light. Focused light is
/// seen as it is estimated, and has sharp edges: many photons keep both its noise and its blur
/// small.
const FOCUSED_STORED: usize = 2;

/// Traces photons until `settings.map_photons` arrivals are stored, and returns the light on all
/// surfaces, estimated from the `settings.k` nearest of them. The seed, the threads and, if it is
/// given, the number of `photons` to trace are also taken from the settings. Errors: as
/// [`simulate`](super::simulate()).
pub fn light_surfaces<'a>(
    scene: &'a Scene,
    settings: &Settings,
    control: &Control,
) -> Result<SurfaceLight<'a>> {
    let patches = Patches::new(scene);
    let arrivals = Arrivals::OnSurfaces(&patches);
    let photons = match settings.photons {
        Some(photons) => photons.get(),
        None => {
            memory::check_map(scene, memory::map_limit(scene, settings))?;
            let control = Control { progress: &|_| {}, ..*control };
            let trial =
                |photons| kept(scene, settings, Purpose::Trial, arrivals, photons, &control);
            let first = trial(FIRST)?;
            let Totals { histories, segments, .. } = first.totals;
            let least = (RAYS * histories / segments.max(1)).clamp(FIRST, TRIAL);
            // the same photons again would find the same
            let trial = match least {
                FIRST => first,
                least => trial(least)?,
            };
            let kept = trial.map.map_or(0, |map| map.photons.len()) as f64;
            let wanted = settings.map_photons.get() as u64;
            // a little more, because of chance
            let needed = 1.02 * wanted as f64 * trial.totals.histories as f64 / kept;
            (needed.ceil() as u64).clamp(least, (MOST * wanted).max(least))
        }
    };
    let found = kept(scene, settings, Purpose::Run, arrivals, photons, control)?;
    let map = found.map.expect("a run of photons keeps a map");
    let k = settings.k.map(NearestCount::get).filter(|k| *k > 1).unwrap_or(SurfaceLight::DEFAULT_K);
    Ok(SurfaceLight { scene, patches, map, k })
}

/// Returns the part of the light on surfaces that scatter diffusely that came from its lamp by
/// mirrors, refraction or gloss alone, estimated from as many of such photons as `light`. What
/// passes glass is met there many times, and seen where it ends. More photons are traced for it:
/// until twice `settings.map_photons` arrivals are stored, and at most eight times as many as found
/// all the light. Errors: as [`simulate`](super::simulate()).
pub fn focused_light<'a>(
    light: &SurfaceLight<'a>,
    settings: &Settings,
    control: &Control,
) -> Result<SurfaceLight<'a>> {
    let scatters = |&index: &usize| {
        let surface = light.scene.surface(light.map.photons[index].triangle as usize);
        light.map.ways()[index].is_focused() && light.scene.material(&surface).is_diffuse()
    };
    let own = (0..light.map.photons.len()).filter(scatters).count();
    // where most of the light is focused, it has been found
    if own == 0 || 2 * own > settings.map_photons.get() {
        return Ok(machine::pool(settings.threads.get())?.install(|| light.part(Way::is_focused)));
    }
    let arrivals = Arrivals::Focused(&light.patches);
    let photons = FOCUSED * light.map.histories;
    let stored = MapLimit::nearest_to(FOCUSED_STORED * settings.map_photons.get());
    let settings = Settings { map_photons: stored, ..settings.clone() };
    let found = kept(light.scene, &settings, Purpose::Focused, arrivals, photons, control)?;
    let map = found.map.expect("a run of photons keeps a map");
    Ok(SurfaceLight { map, patches: light.patches.clone(), ..*light })
}

/// Runs the scene for the arrivals that `keep` selects.
fn kept(
    scene: &Scene,
    settings: &Settings,
    purpose: Purpose,
    arrivals: Arrivals,
    photons: u64,
    control: &Control,
) -> Result<Outcome> {
    let settings = Settings {
        estimator: Estimator::Photons,
        photons: Some(PhotonCount::nearest_to(photons.max(scene.sources() as u64))),
        guiding: Guiding::Off,
        tolerance: None,
        max_time: None,
        ..settings.clone()
    };
    catch_panic("run", || {
        let run = Run::new(scene, &settings, Vec::new(), arrivals, control)?;
        let run = Run { purpose, ..run };
        run.go()
    })
}
