//! The arguments of `phylux render`.

use std::path::PathBuf;

use clap::{Args, ValueEnum};

use super::view;
use crate::cli::run;
use phylux_core::transport::settings::{Checked, MapLimit, PhotonCount, ThreadCount, TimeLimit};

#[derive(Args)]
pub struct Arguments {
    /// Scene file (JSON)
    pub scene: PathBuf,
    /// Picture: .png (also `-`, the standard output), or .exr for the numbers (W/m2/sr, W/m2); may
    /// be given twice for both
    #[arg(short, long, value_name = "FILE", required = true)]
    pub output: Vec<PathBuf>,
    /// What to show: what a camera sees; in false colour the light that arrives at every surface or
    /// is absorbed by it, or the relative standard error of the light that arrives; the captors
    /// coloured by their results; or the photons themselves
    #[arg(long, value_enum, default_value = "radiance")]
    pub show: What,
    #[command(flatten)]
    pub view: view::ViewArguments,
    /// Rays of each pixel
    #[arg(long, visible_alias = "spp", value_name = "N", default_value_t = 6, value_parser = clap::value_parser!(u32).range(1..=4096))]
    pub rays: u32,
    /// End soon after this time: each pixel gets four rays at a time until the next four would end
    /// too late, or --rays are reached; give a large --rays. The first four are taken in any case
    #[arg(long, value_name = "SECONDS", value_parser = run::max_time, allow_hyphen_values = true)]
    pub max_time: Option<TimeLimit>,
    /// Number of directions to look into, and of shadow rays to the lamps, where a ray meets a
    /// surface that scatters: sharp shadows and true corners. 0 takes the light there from the
    /// photons alone, which is faster and blurred; not for captors and photons [default: 1]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(0..=100_000))]
    pub gather: Option<u32>,
    /// Whether noise in the light on each surface is smoothed out in PNG pictures; --show error
    /// then shows the error that is left. The other numbers in EXR files are never smoothed; not
    /// for captors and photons [default: on]
    #[arg(long, value_enum, value_name = "ON")]
    pub denoise: Option<Denoise>,
    /// With --show radiance: a value of 2^-STOPS is about white, and half of it half as bright
    /// [default: chosen for the picture]
    #[arg(long, value_name = "STOPS", value_parser = stops, allow_hyphen_values = true)]
    pub exposure: Option<f64>,
    /// With --show radiance: take the cast of pink or green lamps from the picture, as cameras do, or
    /// leave it [default: auto]
    #[arg(long, value_enum, value_name = "HOW")]
    pub white_balance: Option<Balance>,
    /// Band or sum of the scene to show, or `sum` for all bands together [default: all; in false
    /// colour the first sum, or the first band]
    #[arg(long, value_name = "NAME")]
    pub band: Option<String>,
    /// Space the colours by equal ratios of the values, not by equal differences
    #[arg(long)]
    pub log: bool,
    /// Values at the ends of the colour bar, to compare pictures [default: chosen for the picture]
    #[arg(long, value_name = "LOW:HIGH", value_parser = range, allow_hyphen_values = true)]
    pub range: Option<(f64, f64)>,
    /// With --show captors: take the results from this file of `phylux run`, and trace nothing
    #[arg(long, value_name = "FILE")]
    pub results: Option<PathBuf>,
    /// With --show photons: colour them by what they carry in each band, by how often they were
    /// scattered before, by the lamp or by the kind of surface that they come from, or by their power
    #[arg(long, value_enum, default_value = "bounce")]
    pub colour: By,
    /// With --show photons: let them shine on a dark ground, or be ink on a light one [default: dark]
    #[arg(long, value_enum)]
    pub ground: Option<Shade>,
    /// With --show photons: also draw the paths of this many photons, which fade with their power
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = clap::value_parser!(u64).range(0..=10_000))]
    pub paths: u64,
    /// Arrivals of photons to trace and store [default: 2e6, and 3e5 to show photons]
    #[arg(long, value_name = "N", value_parser = run::map_photons, allow_hyphen_values = true)]
    pub map_photons: Option<MapLimit>,
    /// Photons of each estimate: more are smoother and blur more [default: 200, and 150 to show
    /// photons]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(2..=1_000_000))]
    pub k: Option<u64>,
    /// Photons to trace [default: as many as bring --map-photons arrivals; with --show captors the
    /// scene's]
    #[arg(long, value_name = "N", value_parser = run::photons, allow_hyphen_values = true)]
    pub photons: Option<PhotonCount>,
    /// Seed of the random numbers: the same seed gives the same picture, byte for byte
    #[arg(long, value_name = "N", value_parser = run::count, allow_hyphen_values = true)]
    pub seed: Option<u64>,
    /// Threads; 0 takes all processors. The picture does not depend on it [default: the scene's]
    #[arg(long, value_name = "N", value_parser = run::threads, allow_hyphen_values = true)]
    pub threads: Option<ThreadCount>,
}

/// What a picture shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum What {
    Radiance,
    Irradiance,
    Absorbed,
    Error,
    Captors,
    Photons,
}

/// Whether noise is smoothed out in a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Denoise {
    On,
    Off,
}

/// Whether the cast of light is taken from a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Balance {
    Auto,
    None,
}

/// What the colours of photons show.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum By {
    Band,
    Bounce,
    Lamp,
    Surface,
    Power,
}

/// The ground of a picture of photons.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Shade {
    Dark,
    Light,
}

fn stops(text: &str) -> Checked<f64> {
    match text.parse() {
        Ok(stops) if (-1000.0..=1000.0).contains(&stops) => Ok(stops),
        _ => Err("must be a number, -1000 to 1000".into()),
    }
}

pub fn range(text: &str) -> Checked<(f64, f64)> {
    let number = |text: &str| text.trim().parse().ok();
    text.split_once(':')
        .and_then(|(low, high)| Some((number(low)?, number(high)?)))
        .ok_or_else(|| "must be two numbers with a colon between them, as 0:100".into())
}
