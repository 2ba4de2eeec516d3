//! The work of a year: the lights of all combinations of states, and the rays to the sun, as far as
//! they are not kept.

use std::sync::atomic::{AtomicU64, Ordering};

use rayon::prelude::*;

use super::{
    conditions::Outside,
    control::{Controlled, lamp_names},
    hours_of::HoursOf,
    options::YearOptions,
    part::Part,
    places::Places,
    states::{StateScene, YearScenes},
};
use phylux_core::{
    error::{Error, NOTHING_WRITTEN, Result},
    math::machine,
    scene::world::Scene,
    transport::{
        direct_sun::SunRays,
        settings::{PhotonCount, Settings},
        shard::Shard,
        simulate::{Control, Progress},
    },
};
use phylux_files::scene_file::HourlyLights;

/// Does the work of a shard, as far as it is not kept, and keeps it. Errors: those of a run; the
/// file cannot be written.
pub fn trace_shard(
    scenes: &YearScenes,
    options: &YearOptions,
    settings: &Settings,
    shard: Shard,
    control: &Control,
) -> Result<()> {
    let Begun { scene, hourly, places, rays } = Begun::new(scenes, options)?;
    // what the year is refused for when all shards are merged is refused before they are traced
    let (bands, integrated) = places.bands(scene);
    let controlled = Controlled {
        places: &places,
        bands: &bands,
        integrated: &integrated,
        outside: &Outside::new(scene, hourly, &bands),
        daylight: &|_, _| Ok(Vec::new()),
    };
    controlled.entries(&lamp_names(scene, hourly), options.control, &mut Vec::new())?;
    options.hours.chosen(&places)?;
    // the sums of hours and days are not made here
    let parts = traced(scenes, &places, options, settings, shard, control)?;
    (options.phase)("rays to the sun");
    let captors: Vec<usize> = (0..places.captors).filter(|&c| shard.holds(c)).collect();
    let suns: usize = parts.iter().map(|part| part.lights.len()).sum();
    let done = AtomicU64::new(0);
    let find = |part: &Part, captor: usize| -> Result<()> {
        part.direct(captor, &places, rays, options.kept, control.stop)?;
        let own = part.lights.len() as u64 * rays.count();
        let photons = done.fetch_add(own, Ordering::Relaxed) + own;
        let of = Some((suns * captors.len()) as u64 * rays.count());
        (control.progress)(Progress { photons, of, worst: None });
        Ok(())
    };
    let pool = machine::pool(settings.threads.get())?;
    for part in &parts {
        pool.install(|| captors.par_iter().try_for_each(|&captor| find(part, captor)))?;
    }
    match control.stop.load(Ordering::Relaxed) {
        true => Err(Error::interrupted("run", NOTHING_WRITTEN)),
        false => Ok(()),
    }
}

/// What is known of a year before anything is traced.
pub(super) struct Begun<'s> {
    pub scene: &'s Scene,
    pub hourly: &'s HourlyLights,
    pub places: Places,
    pub rays: SunRays,
}

impl<'s> Begun<'s> {
    pub fn new(scenes: &'s YearScenes, options: &YearOptions) -> Result<Self> {
        let Some(StateScene { loaded, .. }) = scenes.scenes.first() else {
            return Err(no_scene());
        };
        let scene = &loaded.scene;
        let hourly = loaded.hourly.as_ref().ok_or_else(|| {
            Error::input(scene.name(), "was not loaded by the hour").remedy("load it so")
        })?;
        let places = Places::new(scene);
        let rays = scenes.points(&places, options.sun_rays, &options.hours)?;
        Ok(Self { scene, hourly, places, rays })
    }
}

impl YearScenes {
    /// Returns the number of points of each captor from which the sun of an hour is looked for, if
    /// the light of these hours is wanted: as `asked` or, if nothing is asked for, as many as the
    /// numbers of captors and hours allow. Errors: there is no scene; nothing fits the pattern of
    /// `hours`.
    pub fn sun_rays(&self, asked: Option<u64>, hours: &HoursOf) -> Result<u64> {
        let scene = self.scenes.first().ok_or_else(no_scene)?;
        Ok(self.points(&Places::new(&scene.loaded.scene), asked, hours)?.count())
    }

    fn points(&self, places: &Places, asked: Option<u64>, hours: &HoursOf) -> Result<SunRays> {
        let chosen = hours.chosen(places)?;
        let slots = self.scenes.iter().filter_map(|scene| scene.loaded.hourly.as_ref()).next();
        let suns = (0..slots.map_or(0, |h| h.slots.len())).filter(|&s| self.is_sunny(s)).count();
        let by_hour = chosen[..places.captors].contains(&true);
        Ok(asked.map_or_else(|| SunRays::usual(places.captors, suns, by_hour), SunRays::new))
    }
}

fn no_scene() -> Error {
    Error::input("scene", "there is none").remedy("load one by the hour")
}

/// Traces the lights of all combinations of states that `shard` holds and that are not kept.
pub(super) fn traced<'s>(
    scenes: &'s YearScenes,
    places: &Places,
    options: &YearOptions,
    settings: &Settings,
    shard: Shard,
    control: &Control,
) -> Result<Vec<Part<'s>>> {
    let photons = settings.photons_or_default();
    let shares = energies(scenes);
    check_photons(scenes, &shares, photons)?;
    let mut parts = Vec::new();
    for (index, (scene, share)) in scenes.scenes.iter().zip(shares).enumerate() {
        let settings = Settings {
            photons: Some(PhotonCount::nearest_to((share * photons as f64).round() as u64)),
            // the parts are independent
            seed: settings.seed ^ (index as u64) << 56,
            ..settings.clone()
        };
        let of = match (index, scenes.scenes.len()) {
            (_, 1) => String::new(),
            (index, all) => format!(" (scene {} of {all})", index + 1),
        };
        (options.phase)(&format!("photons{of}"));
        let mut part = Part::new(index, scene, places, settings.seed, &options.scratch)?;
        part.trace(places, &settings, shard, options.kept, control)?;
        parts.push(part);
    }
    Ok(parts)
}

/// Refuses a number of photons of which a combination of states gets fewer than it has lights. What
/// a single one needs is said where it is traced.
fn check_photons(scenes: &YearScenes, shares: &[f64], photons: u64) -> Result<()> {
    let all = scenes.scenes.iter().zip(shares);
    let needed = all.map(|(scene, share)| (scene.loaded.scene.sources() as f64 / share).ceil());
    let needed = needed.fold(0.0, f64::max) as u64;
    let combinations = shares.len();
    if combinations == 1 || photons >= needed {
        return Ok(());
    }
    let problem = format!(
        "{photons} photons for {combinations} combinations of states, each of which has a part of them"
    );
    Err(Error::input("photons", problem).remedy(format!(
        "every light, sun and piece of the sky needs one in each of them: ask for at least {needed}"
    )))
}

/// Returns the fractions of the photons for the combinations of states: by their energy, but at
/// least 2 % for each, divided by the sum of all. Lamps are taken to be as bright as daylight, since
/// it is not yet known when they are on.
pub(super) fn energies(scenes: &YearScenes) -> Vec<f64> {
    const LEAST: f64 = 0.02;
    let of = |scene: &StateScene| {
        let slots = scene.loaded.hourly.iter().flat_map(|hourly| &hourly.slots);
        let (mut energy, mut time) = (0.0, 0.0);
        for (slot, share) in slots.zip(&scene.shares) {
            energy += share * slot.length * slot.global.max(0.0);
            time += share * slot.length;
        }
        [energy, time]
    };
    let each: Vec<[f64; 2]> = scenes.scenes.iter().map(of).collect();
    let total = |i: usize| each.iter().map(|sums| sums[i]).sum::<f64>();
    let lamps = scenes.scenes.iter().all(|scene| {
        let daylight = scene.loaded.hourly.as_ref().map_or(0, |hourly| hourly.lights.len());
        scene.loaded.scene.lights().len() > daylight
    });
    let part = |sums: &[f64; 2], i: usize| if total(i) > 0.0 { sums[i] / total(i) } else { 0.0 };
    let share = |sums| match lamps {
        true => 0.5 * (part(sums, 0) + part(sums, 1)),
        false => part(sums, 0),
    };
    let shares: Vec<f64> = each.iter().map(|sums| share(sums).max(LEAST)).collect();
    let all: f64 = shares.iter().sum();
    shares.iter().map(|share| share / all).collect()
}
