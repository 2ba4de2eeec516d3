//! The arguments of `phylux render`.

use std::path::PathBuf;

use clap::Args;
use glam::DVec3;

use crate::cli::{choices::named, run};
use phylux_core::{
    scene::camera::View,
    transport::settings::{Checked, MapLimit, PhotonCount, ThreadCount, TimeLimit},
};
use phylux_studies::picture::{
    PictureCamera,
    job::{PhotonColour, PictureJob, PictureOf},
};

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
    #[arg(long, default_value = "radiance", value_parser = named(PictureOf::ALL))]
    pub show: PictureOf,
    #[command(flatten)]
    pub view: ViewArguments,
    /// Rays of each pixel
    #[arg(long, visible_alias = "spp", value_name = "N", default_value_t = PictureJob::RAYS, value_parser = run::whole::<u32>(1..=u64::from(PictureJob::MOST_RAYS)))]
    pub rays: u32,
    /// End soon after this time: each pixel gets four rays at a time until the next four would end
    /// too late, or --rays are reached; give a large --rays. The first four are taken in any case
    #[arg(long, value_name = "SECONDS", value_parser = run::max_time)]
    pub max_time: Option<TimeLimit>,
    /// Number of directions to look into, and of shadow rays to the lamps, where a ray meets a
    /// surface that scatters: sharp shadows and true corners. 0 takes the light there from the
    /// photons alone, which is faster and blurred; not for captors and photons [default: 1]
    #[arg(long, value_name = "N", value_parser = run::whole::<u32>(0..=u64::from(PictureJob::MOST_GATHERED)))]
    pub gather: Option<u32>,
    /// Whether noise in the light on each surface is smoothed out in PNG pictures; --show error
    /// then shows the error that is left. The other numbers in EXR files are never smoothed; not
    /// for captors and photons [default: on]
    #[arg(long, value_name = "ON", value_parser = named([("on", true), ("off", false)]))]
    pub denoise: Option<bool>,
    /// With --show radiance: a value of 2^-STOPS is about white, and half of it half as bright
    /// [default: chosen for the picture]
    #[arg(long, value_name = "STOPS", value_parser = stops)]
    pub exposure: Option<f64>,
    /// With --show radiance: take the cast of pink or green lamps from the picture, as cameras do,
    /// or leave it [default: auto]
    #[arg(long, value_name = "HOW", value_parser = named([("auto", true), ("none", false)]))]
    pub white_balance: Option<bool>,
    /// With --show radiance: draw sensors, which no eye would see, in amber [default: on for up to
    /// 12, and in scenes without plants]
    #[arg(long, value_name = "ON", value_parser = named([("on", true), ("off", false)]))]
    pub sensors: Option<bool>,
    /// Band or sum of the scene to show, or `sum` for all bands together [default: all; in false
    /// colour the first sum, or the first band]
    #[arg(long, value_name = "NAME")]
    pub band: Option<String>,
    /// Space the colours by equal ratios of the values, not by equal differences
    #[arg(long)]
    pub log: bool,
    /// Values at the ends of the colour bar, to compare pictures [default: chosen for the picture]
    #[arg(long, value_name = "LOW:HIGH", value_parser = range)]
    pub range: Option<(f64, f64)>,
    /// With --show captors: take the results from this file of `phylux run`, and trace nothing
    #[arg(long, value_name = "FILE")]
    pub results: Option<PathBuf>,
    /// With --show photons: colour them by what they carry in each band, by how often they were
    /// scattered before, by the lamp or by the kind of surface that they come from, or by their
    /// power
    #[arg(long, default_value = "bounce", value_parser = named(PhotonColour::ALL))]
    pub colour: PhotonColour,
    /// With --show photons: let them shine on a dark ground, or be ink on a light one [default:
    /// dark]
    #[arg(long, value_parser = named([("dark", false), ("light", true)]))]
    pub ground: Option<bool>,
    /// With --show photons: also draw the paths of this many photons, which fade with their power
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = run::whole::<u64>(0..=PictureJob::MOST_PATHS))]
    pub paths: u64,
    /// Arrivals of photons to trace and store [default: 2e6, and 3e5 to show photons]
    #[arg(long, value_name = "N", value_parser = run::map_photons)]
    pub map_photons: Option<MapLimit>,
    /// Photons of each estimate: more are smoother and blur more [default: 200, and 150 to show
    /// photons]
    #[arg(long, value_name = "N", value_parser = run::whole::<u64>(2..=PictureJob::MOST_NEAREST))]
    pub k: Option<u64>,
    /// Photons to trace [default: as many as bring --map-photons arrivals; with --show captors the
    /// scene's]
    #[arg(long, value_name = "N", value_parser = run::photons)]
    pub photons: Option<PhotonCount>,
    /// Seed of the random numbers: the same seed gives the same picture, byte for byte
    #[arg(long, value_name = "N", value_parser = run::count)]
    pub seed: Option<u64>,
    /// Threads; 0 takes all processors. The picture does not depend on it [default: the scene's]
    #[arg(long, value_name = "N", value_parser = run::threads)]
    pub threads: Option<ThreadCount>,
}

/// Options of the camera. For those that are not given, the scene's camera is taken, or one is
/// chosen.
#[derive(Args)]
pub struct ViewArguments {
    /// Where the camera is, in the scene's unit of length [default: the scene's camera, or outside
    /// with the surfaces in the way cut off]
    #[arg(long, value_name = "X,Y,Z", value_parser = point)]
    position: Option<DVec3>,
    /// The point in the middle of the picture [default: the camera's, or the middle of the scene]
    #[arg(long, value_name = "X,Y,Z", value_parser = point)]
    look_at: Option<DVec3>,
    /// Direction that points up in the picture [default: the camera's, or 0,0,1]
    #[arg(long, value_name = "X,Y,Z", value_parser = point)]
    up: Option<DVec3>,
    /// Angle of view from left to right across the picture, degrees [default: the camera's, or 45]
    #[arg(long, value_name = "DEGREES", value_parser = fov)]
    fov_deg: Option<f64>,
    /// Width of the picture in pixels [default: the camera's, or 800]
    #[arg(long, value_name = "N", value_parser = run::whole::<u64>(1..=View::MOST_PIXELS))]
    width: Option<u64>,
    /// Height of the picture in pixels [default: the camera's, or 600]
    #[arg(long, value_name = "N", value_parser = run::whole::<u64>(1..=View::MOST_PIXELS))]
    height: Option<u64>,
}

impl Arguments {
    pub fn job(&self) -> PictureJob {
        let ViewArguments { position, look_at, up, fov_deg, width, height } = self.view;
        PictureJob {
            show: self.show,
            camera: PictureCamera { position, look_at, up, fov_deg, width, height },
            rays: self.rays,
            max_time: self.max_time,
            gather: self.gather,
            denoise: self.denoise,
            exposure: self.exposure,
            white_balance: self.white_balance,
            sensors: self.sensors,
            band: self.band.clone(),
            log: self.log,
            range: self.range,
            results: self.results.clone(),
            colour: self.colour,
            light_ground: self.ground,
            paths: self.paths,
            map_photons: self.map_photons,
            k: self.k,
            photons: self.photons,
            seed: self.seed,
            threads: self.threads,
        }
    }
}

fn point(text: &str) -> Checked<DVec3> {
    let numbers: Option<Vec<f64>> =
        text.split(',').map(|n| n.trim().parse().ok().filter(|n: &f64| n.is_finite())).collect();
    match numbers.as_deref() {
        Some(&[x, y, z]) => Ok(DVec3::new(x, y, z)),
        _ => Err("must be three numbers with commas between them, as 1,-2,0.5".into()),
    }
}

fn fov(text: &str) -> Checked<f64> {
    View::check_fov(text.parse().map_err(|_| "must be a number")?)
}

fn stops(text: &str) -> Checked<f64> {
    PictureJob::exposure(text.parse().unwrap_or(f64::NAN))
}

pub fn range(text: &str) -> Checked<(f64, f64)> {
    let number = |text: &str| text.trim().parse().ok();
    text.split_once(':')
        .and_then(|(low, high)| Some((number(low)?, number(high)?)))
        .ok_or_else(|| "must be two numbers with a colon between them, as 0:100".into())
}
