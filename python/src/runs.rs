//! What is made of one scene: runs, pictures, histories. Arguments come as JSON, an object with those
//! that were given.

use std::{ops::RangeInclusive, path::PathBuf};

use glam::DVec3;
use phylux::{
    Control, Error, Estimator, Guiding, LoadedScene, Result, Target,
    formats::spec::Count,
    scene::View,
    studies::{
        Desk, HistoriesJob, Made, PhotonColour, PictureCamera, PictureJob, PictureOf, RunJob,
        histories::warnings,
    },
    transport::{MapLimit, NearestCount, PhotonCount, ThreadCount, TimeLimit, Tolerance},
    words::setting,
};
use serde::Deserialize;

use crate::{
    errors::spelled,
    studies::{count, given, named, read},
};

/// Limits of time; the place of an error is the name of the argument.
fn seconds(name: &'static str, time: Option<f64>) -> Result<Option<TimeLimit>> {
    time.map(TimeLimit::new).transpose().map_err(|error| error.at(setting(name)))
}

/// Returns a number if it lies in a range.
fn in_range(name: &str, number: Option<Count>, range: RangeInclusive<u64>) -> Result<Option<u64>> {
    match number {
        Some(Count(n)) if !range.contains(&n) => {
            let problem = format!("{n}, must be {} to {}", range.start(), range.end());
            Err(Error::input(name, problem))
        }
        number => Ok(number.map(|n| n.0)),
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RunArguments {
    photons: Option<Count>,
    seed: Option<Count>,
    estimator: Option<Estimator>,
    tolerance: Option<f64>,
    #[serde(default)]
    of: Vec<String>,
    max_time: Option<f64>,
    k: Option<Count>,
    map_photons: Option<Count>,
    guiding: Option<Guiding>,
    #[serde(default)]
    by_light: bool,
    checkpoint: Option<PathBuf>,
    checkpoint_every: Option<f64>,
    threads: Option<Count>,
}

/// Reads what is asked of a run.
pub fn run(arguments: &str) -> Result<RunJob> {
    let all: RunArguments = read(arguments)?;
    if all.checkpoint_every.is_some() && all.checkpoint.is_none() {
        return Err(Error::input(setting("checkpoint_every"), "there is no checkpoint to write")
            .remedy("name its file by `checkpoint`, or leave it out"));
    }
    Ok(RunJob {
        photons: all.photons.map(|n| PhotonCount::new(n.0)).transpose()?,
        seed: all.seed.map(|n| n.0),
        estimator: all.estimator,
        tolerance: all.tolerance.map(Tolerance::new).transpose()?,
        of: all
            .of
            .iter()
            .map(|text| Target::parse(text).map_err(|why| Error::input(setting("of"), why)))
            .collect::<Result<_>>()?,
        max_time: seconds("max_time", all.max_time)?,
        k: count(all.k, NearestCount::new)?,
        map_photons: count(all.map_photons, MapLimit::new)?,
        guiding: all.guiding,
        by_light: all.by_light,
        checkpoint: all.checkpoint,
        checkpoint_every: seconds("checkpoint_every", all.checkpoint_every)?,
        threads: count(all.threads, ThreadCount::new)?,
    })
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct HistoriesArguments {
    to: String,
    face: Option<String>,
    band: Option<String>,
    lines: Option<Count>,
    photons: Option<Count>,
    seed: Option<Count>,
    threads: Option<Count>,
}

/// Returns how light reaches a captor, as JSON, and warnings.
pub fn histories(
    loaded: &LoadedScene,
    arguments: &str,
    desk: &Desk,
) -> Result<(String, Vec<String>)> {
    let all: HistoriesArguments = read(arguments)?;
    let job = HistoriesJob {
        to: all.to,
        face: named("face", all.face, &HistoriesJob::FACES)?.flatten(),
        band: all.band,
        lines: given("lines", all.lines, |n| HistoriesJob::lines(n.0))?
            .unwrap_or(HistoriesJob::LINES),
        photons: all.photons.map(|n| PhotonCount::new(n.0)).transpose()?,
        seed: all.seed.map(|n| n.0),
        threads: count(all.threads, ThreadCount::new)?,
    };
    let result = desk.during("photons", |progress| {
        job.found(loaded, &Control { stop: desk.stop(), progress })
    })?;
    let json = serde_json::to_string(&result).map_err(|e| Error::run("histories", e))?;
    Ok((json, spelled(&warnings(&result))))
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct PictureArguments {
    show: Option<String>,
    position: Option<[f64; 3]>,
    look_at: Option<[f64; 3]>,
    up: Option<[f64; 3]>,
    fov_deg: Option<f64>,
    width: Option<Count>,
    height: Option<Count>,
    #[serde(alias = "spp")]
    rays: Option<Count>,
    max_time: Option<f64>,
    gather: Option<Count>,
    denoise: Option<String>,
    exposure: Option<f64>,
    white_balance: Option<String>,
    sensors: Option<String>,
    band: Option<String>,
    #[serde(default)]
    log: bool,
    range: Option<(f64, f64)>,
    results: Option<PathBuf>,
    colour: Option<String>,
    ground: Option<String>,
    paths: Option<Count>,
    map_photons: Option<Count>,
    k: Option<Count>,
    photons: Option<Count>,
    seed: Option<Count>,
    threads: Option<Count>,
}

/// Makes a picture.
pub fn picture(loaded: &LoadedScene, arguments: &str, desk: &Desk) -> Result<Made> {
    let all: PictureArguments = read(arguments)?;
    let usual = PictureJob::default();
    let pixels = 1..=PictureJob::MOST_PIXELS;
    let camera = PictureCamera {
        position: all.position.map(DVec3::from_array),
        look_at: all.look_at.map(DVec3::from_array),
        up: all.up.map(DVec3::from_array),
        fov_deg: given("fov_deg", all.fov_deg, View::check_fov)?,
        width: in_range("width", all.width, pixels.clone())?,
        height: in_range("height", all.height, pixels)?,
    };
    let rays = in_range("rays", all.rays, 1..=PictureJob::MOST_RAYS.into())?;
    let gather = in_range("gather", all.gather, 0..=PictureJob::MOST_GATHERED.into())?;
    let small = |number: u64| u32::try_from(number).unwrap_or(u32::MAX);
    let job = PictureJob {
        show: named("show", all.show, &PictureOf::ALL)?.unwrap_or(usual.show),
        camera,
        rays: rays.map_or(usual.rays, small),
        max_time: seconds("max_time", all.max_time)?,
        gather: gather.map(small),
        denoise: named("denoise", all.denoise, &[("on", true), ("off", false)])?,
        exposure: given("exposure", all.exposure, PictureJob::exposure)?,
        white_balance: named(
            "white_balance",
            all.white_balance,
            &[("auto", true), ("none", false)],
        )?,
        sensors: named("sensors", all.sensors, &[("on", true), ("off", false)])?,
        band: all.band,
        log: all.log,
        range: all.range,
        results: all.results,
        colour: named("colour", all.colour, &PhotonColour::ALL)?.unwrap_or(usual.colour),
        light_ground: named("ground", all.ground, &[("dark", false), ("light", true)])?,
        paths: in_range("paths", all.paths, 0..=PictureJob::MOST_PATHS)?.unwrap_or(usual.paths),
        map_photons: count(all.map_photons, MapLimit::new)?,
        k: in_range("k", all.k, 2..=PictureJob::MOST_NEAREST)?.or(usual.k),
        photons: all.photons.map(|n| PhotonCount::new(n.0)).transpose()?,
        seed: all.seed.map(|n| n.0),
        threads: count(all.threads, ThreadCount::new)?,
    };
    job.picture(loaded, desk)
}
