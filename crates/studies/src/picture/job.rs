//! Which picture is asked for, and what goes together.

use std::path::PathBuf;

use super::camera::PictureCamera;
use phylux_core::{
    error::{Error, Result, Setting, setting},
    scene::camera::View,
    transport::settings::{Checked, MapLimit, PhotonCount, ThreadCount, TimeLimit},
    words,
};

/// Which picture of a scene is to be made, and how.
#[derive(Clone, Debug)]
pub struct PictureJob {
    /// What it shows.
    pub show: PictureOf,
    /// From where.
    pub camera: PictureCamera,
    /// Rays of each pixel.
    pub rays: u32,
    /// The time in which the picture should be made.
    pub max_time: Option<TimeLimit>,
    /// Number of directions to look into where a ray meets a surface that scatters; `None` for what
    /// is usual.
    pub gather: Option<u32>,
    /// Whether noise is smoothed out; `None` for what is usual.
    pub denoise: Option<bool>,
    /// A radiance of 2 to the power of minus this number is about white; `None` to choose it.
    pub exposure: Option<f64>,
    /// Whether the cast of the light is taken from the picture; `None` for what is usual.
    pub white_balance: Option<bool>,
    /// Whether sensors are drawn; `None` for what is usual.
    pub sensors: Option<bool>,
    /// Band or sum; `None` for what is usual.
    pub band: Option<String>,
    /// Whether colours are spaced by equal ratios.
    pub log: bool,
    /// Values at the ends of the colour bar; `None` to choose them.
    pub range: Option<(f64, f64)>,
    /// The file with the results of captors; without it, the scene is run.
    pub results: Option<PathBuf>,
    /// What the colours of photons show.
    pub colour: PhotonColour,
    /// Whether photons are ink on a light ground; `None` for what is usual.
    pub light_ground: Option<bool>,
    /// Number of photons whose paths are drawn.
    pub paths: u64,
    /// Arrivals of photons to store; `None` for what is usual.
    pub map_photons: Option<MapLimit>,
    /// Photons of each estimate; `None` for what is usual.
    pub k: Option<u64>,
    /// Number of photons; `None` for as many as bring the arrivals.
    pub photons: Option<PhotonCount>,
    /// Seed of the random numbers; `None` for the scene's.
    pub seed: Option<u64>,
    /// Number of threads; `None` for the scene's.
    pub threads: Option<ThreadCount>,
}

/// What a picture shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PictureOf {
    /// What a camera sees.
    Radiance,
    /// The light that arrives at surfaces.
    Irradiance,
    /// The light that surfaces absorb.
    Absorbed,
    /// The relative standard error of the light that arrives.
    Error,
    /// Captors, by their results.
    Captors,
    /// The photons.
    Photons,
}

/// What the colours of photons show.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PhotonColour {
    /// What they carry in each band.
    Band,
    /// How often they were scattered.
    Bounce,
    /// Their lamp.
    Lamp,
    /// The kind of surface that they come from.
    Surface,
    /// Their power.
    Power,
}

impl PictureOf {
    /// All, by their names.
    pub const ALL: [(&'static str, Self); 6] = [
        ("radiance", Self::Radiance),
        ("irradiance", Self::Irradiance),
        ("absorbed", Self::Absorbed),
        ("error", Self::Error),
        ("captors", Self::Captors),
        ("photons", Self::Photons),
    ];

    /// Whether it shows the light on surfaces.
    pub fn is_of_light(self) -> bool {
        !matches!(self, Self::Captors | Self::Photons)
    }
}

impl PhotonColour {
    /// All, by their names.
    pub const ALL: [(&'static str, Self); 5] = [
        ("band", Self::Band),
        ("bounce", Self::Bounce),
        ("lamp", Self::Lamp),
        ("surface", Self::Surface),
        ("power", Self::Power),
    ];
}

impl Default for PictureJob {
    fn default() -> Self {
        Self {
            show: PictureOf::Radiance,
            camera: PictureCamera::default(),
            rays: Self::RAYS,
            max_time: None,
            gather: None,
            denoise: None,
            exposure: None,
            white_balance: None,
            sensors: None,
            band: None,
            log: false,
            range: None,
            results: None,
            colour: PhotonColour::Bounce,
            light_ground: None,
            paths: 0,
            map_photons: None,
            k: None,
            photons: None,
            seed: None,
            threads: None,
        }
    }
}

impl PictureJob {
    /// The usual number of rays of each pixel, and the most.
    pub const RAYS: u32 = 6;
    /// The most rays of a pixel.
    pub const MOST_RAYS: u32 = 4096;
    /// The most directions to look into.
    pub const MOST_GATHERED: u32 = 100_000;
    /// The most photons whose paths are drawn.
    pub const MOST_PATHS: u64 = 10_000;
    /// The most photons of an estimate.
    pub const MOST_NEAREST: u64 = 1_000_000;
    /// The most pixels along a side.
    pub const MOST_PIXELS: u64 = View::MOST_PIXELS;

    /// Checks an exposure. Error: it is not from -1000 to 1000.
    pub fn exposure(stops: f64) -> Checked<f64> {
        match (-1000.0..=1000.0).contains(&stops) {
            true => Ok(stops),
            false => Err("must be a number, -1000 to 1000".into()),
        }
    }

    /// Refuses options that do not go together.
    pub fn check(&self) -> Result<()> {
        let of_light = "radiance, irradiance, absorbed or error";
        let in_colours = "irradiance, absorbed, error, captors or photons";
        let here = "irradiance, absorbed, error, captors or photons (here: ";
        let is = |of: PictureOf| self.show == of;
        let light = self.show.is_of_light();
        let radiance = is(PictureOf::Radiance);
        let goes = [
            ("gather", self.gather.is_some(), light, words![of_light]),
            ("max_time", self.max_time.is_some(), light, words![of_light]),
            ("denoise", self.denoise.is_some(), light, words![of_light]),
            ("exposure", self.exposure.is_some(), radiance, words!["radiance"]),
            ("white_balance", self.white_balance.is_some(), radiance, words!["radiance"]),
            ("sensors", self.sensors.is_some(), radiance, words!["radiance"]),
            ("range", self.range.is_some(), !radiance, words![here, setting("exposure"), ")"]),
            ("log", self.log, !radiance, words![in_colours]),
            ("results", self.results.is_some(), is(PictureOf::Captors), words!["captors"]),
            ("paths", self.paths > 0, is(PictureOf::Photons), words!["photons"]),
            ("ground", self.light_ground.is_some(), is(PictureOf::Photons), words!["photons"]),
        ];
        let show = || -> Setting { setting("show") };
        match goes.into_iter().find(|(_, given, goes, _)| *given && !goes) {
            None => Ok(()),
            Some((name, .., with)) => {
                let problem = words!["has no meaning here: it goes with ", show(), " ", with];
                Err(Error::input(setting(name), problem)
                    .remedy(words!["leave it out, or change ", show()]))
            }
        }
    }
}
