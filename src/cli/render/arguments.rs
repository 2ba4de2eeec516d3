//! The arguments of `phylux render`.

use std::{path::PathBuf, time::Duration};

use clap::{Args, ValueEnum};

use super::view;
use crate::{
    cli::run,
    transport::{settings::Checked, surface_light::SurfaceLight},
};

#[derive(Args)]
pub struct Arguments {
    /// Scene file (JSON)
    pub scene: PathBuf,
    /// Picture: .png (also `-`, the standard output), or .exr for the numbers (W/m2/sr, W/m2); may be given twice for both
    #[arg(short, long, value_name = "FILE", required = true)]
    pub output: Vec<PathBuf>,
    /// What to show: what a camera sees, or in false colour the light that arrives at or is absorbed by
    /// every surface, the relative standard error of what arrives, the captors by their results, the photons
    /// themselves
    #[arg(long, value_enum, default_value = "radiance")]
    pub show: What,
    #[command(flatten)]
    pub view: view::ViewArguments,
    /// Rays of each pixel
    #[arg(long, visible_alias = "spp", value_name = "N", default_value_t = 6, value_parser = clap::value_parser!(u32).range(1..=4096))]
    pub rays: u32,
    /// End soon after this time: rays are taken four by four for each pixel until it would be over, or --rays are
    /// taken; give a large --rays. Four are taken in any case
    #[arg(long, value_name = "SECONDS", value_parser = run::max_time, allow_negative_numbers = true)]
    pub max_time: Option<Duration>,
    /// Look into so many directions where a ray meets a surface that scatters, and join it with the lamps: sharp
    /// shadows and true corners. 0 takes the light there from the photons alone: sooner, and blurred; not of captors
    /// and photons [default: 1]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(0..=100_000))]
    pub gather: Option<u32>,
    /// Whether the light on each piece of surface is evened out in PNG pictures, and --show error is that of what is
    /// left; other numbers (EXR) never are; not of captors and photons [default: on]
    #[arg(long, value_enum, value_name = "ON")]
    pub denoise: Option<Denoise>,
    /// With --show radiance: a value of 2^-STOPS is about white, and half of it as bright as half [default: chosen for the picture]
    #[arg(long, value_name = "STOPS", value_parser = stops, allow_negative_numbers = true)]
    pub exposure: Option<f64>,
    /// A band or a sum of the scene, or `sum` for all bands together [default: all; sum in false colour]
    #[arg(long, value_name = "NAME")]
    pub band: Option<String>,
    /// Colours by equal ratios, not equal differences
    #[arg(long)]
    pub log: bool,
    /// The numbers at the ends of the colour bar, to compare pictures [default: chosen for the picture]
    #[arg(long, value_name = "LOW:HIGH", value_parser = range, allow_negative_numbers = true)]
    pub range: Option<(f64, f64)>,
    /// With --show captors: take their results from this file of `phylux run`, and trace nothing
    #[arg(long, value_name = "FILE")]
    pub results: Option<PathBuf>,
    /// With --show photons: colour them by their power, or by how often they were scattered before
    #[arg(long, value_enum, default_value = "power")]
    pub colour: By,
    /// With --show photons: also draw the paths of so many of them
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = clap::value_parser!(u64).range(0..=10_000))]
    pub paths: u64,
    /// Arrivals of photons to trace and store [default: 2e6, and 1e5 to show photons]
    #[arg(long, value_name = "N", value_parser = run::map_photons, allow_negative_numbers = true)]
    pub map_photons: Option<usize>,
    /// Photons of an estimate: more are smoother and blur more
    #[arg(long, value_name = "N", default_value_t = SurfaceLight::DEFAULT_K as u64, value_parser = clap::value_parser!(u64).range(2..=1_000_000))]
    pub k: u64,
    /// Photons to trace [default: as many as bring --map-photons arrivals; with --show captors the scene's]
    #[arg(long, value_name = "N", value_parser = run::photons, allow_negative_numbers = true)]
    pub photons: Option<u64>,
    /// Seed of the random numbers: the same seed gives the same picture, byte for byte
    #[arg(long, value_name = "N", value_parser = run::count, allow_negative_numbers = true)]
    pub seed: Option<u64>,
    /// Threads; 0 takes all processors. The picture does not depend on it [default: the scene's]
    #[arg(long, value_name = "N", value_parser = run::threads, allow_negative_numbers = true)]
    pub threads: Option<usize>,
}

/// What to show.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum What {
    Radiance,
    Irradiance,
    Absorbed,
    Error,
    Captors,
    Photons,
}

/// Whether noise is taken out of a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Denoise {
    On,
    Off,
}

/// What colours photons.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum By {
    Power,
    Bounce,
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
