//! `phylux render`

mod captors;
mod light;
mod photons;
mod task;
mod view;

use std::{
    path::{Path, PathBuf},
    sync::atomic::Ordering,
    time::Duration,
};

use clap::{Args, ValueEnum};

use super::{
    interrupt::Interrupt,
    outputs::check_places,
    run::{self, terminal_bar},
};
use crate::{
    error::{Error, NOTHING_WRITTEN, Result},
    formats::{
        output::{FilesRead, OutputFile},
        scene_file,
    },
    transport::{settings::Checked, surface_light::SurfaceLight},
};
use task::make;
#[cfg(feature = "exr")]
use {crate::show::picture::write_exr, light::channels};

#[derive(Args)]
pub(super) struct Arguments {
    /// Scene file (JSON)
    scene: PathBuf,
    /// Picture: .png, or .exr for the numbers (W/m2/sr, W/m2); may be given twice for both
    #[arg(short, long, value_name = "FILE", required = true)]
    output: Vec<PathBuf>,
    /// What to show: what an eye sees, or in false colour the light that arrives at or is absorbed by
    /// every surface, the captors by their results, the photons themselves
    #[arg(long, value_enum, default_value = "radiance")]
    show: What,
    #[command(flatten)]
    view: view::ViewArguments,
    /// Rays of each pixel
    #[arg(long, value_name = "N", default_value_t = 4, value_parser = clap::value_parser!(u32).range(1..=4096))]
    rays: u32,
    /// With --show radiance: look into so many directions from every point that scatters, and join it with
    /// the lamps: sharp shadows and smooth walls, for a longer time
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = clap::value_parser!(u32).range(0..=100_000))]
    gather: u32,
    /// With --show radiance: a value of 2^-STOPS is white [default: chosen for the picture]
    #[arg(long, value_name = "STOPS", value_parser = stops, allow_negative_numbers = true)]
    exposure: Option<f64>,
    /// A band or a sum of the scene, or `sum` for all bands together [default: all; sum in false colour]
    #[arg(long, value_name = "NAME")]
    band: Option<String>,
    /// Colours by equal ratios, not equal differences
    #[arg(long)]
    log: bool,
    /// The numbers at the ends of the colour bar, to compare pictures [default: chosen for the picture]
    #[arg(long, value_name = "LOW:HIGH", value_parser = range, allow_negative_numbers = true)]
    range: Option<(f64, f64)>,
    /// With --show captors: take their results from this file of `phylux run`, and trace nothing
    #[arg(long, value_name = "FILE")]
    results: Option<PathBuf>,
    /// With --show photons: colour them by their power, or by how often they were scattered before
    #[arg(long, value_enum, default_value = "power")]
    colour: By,
    /// With --show photons: also draw the paths of so many of them
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = clap::value_parser!(u64).range(0..=10_000))]
    paths: u64,
    /// Arrivals of photons to trace and store [default: 2e6, and 1e5 to show photons]
    #[arg(long, value_name = "N", value_parser = run::map_photons, allow_negative_numbers = true)]
    map_photons: Option<usize>,
    /// Photons of an estimate: more are smoother and blur more
    #[arg(long, value_name = "N", default_value_t = SurfaceLight::DEFAULT_K as u64, value_parser = clap::value_parser!(u64).range(2..=1_000_000))]
    k: u64,
    /// Seed of the random numbers: the same seed gives the same picture, byte for byte
    #[arg(long, value_name = "N", value_parser = run::count, allow_negative_numbers = true)]
    seed: Option<u64>,
    /// Threads; 0 takes all processors. The picture does not depend on it
    #[arg(long, value_name = "N", value_parser = run::threads, allow_negative_numbers = true)]
    threads: Option<usize>,
}

/// What to show.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum What {
    Radiance,
    Irradiance,
    Absorbed,
    Captors,
    Photons,
}

/// What colours photons.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum By {
    Power,
    Bounce,
}

fn stops(text: &str) -> Checked<f64> {
    match text.parse() {
        Ok(stops) if (-1000.0..=1000.0).contains(&stops) => Ok(stops),
        _ => Err("must be a number, -1000 to 1000".into()),
    }
}

pub(super) fn range(text: &str) -> Checked<(f64, f64)> {
    let number = |text: &str| text.trim().parse().ok();
    text.split_once(':')
        .and_then(|(low, high)| Some((number(low)?, number(high)?)))
        .ok_or_else(|| "must be two numbers with a colon between them, as 0:100".into())
}

pub(super) fn run(arguments: &Arguments) -> Result<()> {
    let interrupt = Interrupt::install()?;
    check(arguments)?;
    let mut outputs = Vec::new();
    for path in &arguments.output {
        outputs.push((Kind::of(path)?, interrupt.file(path)?));
    }
    let places: Vec<PathBuf> = outputs
        .iter()
        .filter_map(|(_, o): &(_, OutputFile)| o.place())
        .map(Path::to_path_buf)
        .collect();
    check_places(&places, &FilesRead::default())?;

    let reading = terminal_bar("{elapsed} reading the scene");
    reading.enable_steady_tick(Duration::from_millis(200));
    let loaded = scene_file::load(&arguments.scene)?;
    reading.finish_and_clear();
    let read = FilesRead::new(loaded.files.iter().chain(&arguments.results));
    check_places(&places, &read)?;
    super::warn(&loaded.warnings);

    let made = interrupt.listening(|| make(arguments, &loaded, &interrupt))?;
    if interrupt.stop().load(Ordering::Relaxed) {
        return Err(Error::interrupted("render", NOTHING_WRITTEN));
    }
    interrupt.writing();
    for (kind, output) in outputs {
        match kind {
            Kind::Png => output.write(&read, |writer| made.picture.write_png(writer))?,
            #[cfg(feature = "exr")]
            Kind::Exr => {
                let pixels = made.pixels.as_ref();
                let channels = pixels.map(|pixels| channels(pixels, &loaded.scene, arguments.show));
                let width = pixels.map_or(1, |pixels| pixels.width);
                output.write(&read, write_exr(width, channels.unwrap_or_default())?)?;
            }
        }
    }
    super::print(&format!("{}wrote {}\n", made.words, list(&arguments.output)))
}

fn list(paths: &[PathBuf]) -> String {
    let names: Vec<String> = paths.iter().map(|path| path.display().to_string()).collect();
    names.join(", ")
}

/// Refuses what does not go together.
fn check(arguments: &Arguments) -> Result<()> {
    let show = arguments.show;
    let misplaced = |option: &str, with: &str| {
        Err(Error::input(option, format!("has no meaning here: it goes with --show {with}"))
            .remedy("leave it out, or change --show"))
    };
    if show != What::Radiance && arguments.gather > 0 {
        return misplaced("--gather", "radiance");
    }
    if show != What::Radiance && arguments.exposure.is_some() {
        return misplaced("--exposure", "radiance");
    }
    if show == What::Radiance && arguments.range.is_some() {
        return misplaced("--range", "irradiance, absorbed, captors or photons (here: --exposure)");
    }
    if show == What::Radiance && arguments.log {
        return misplaced("--log", "irradiance, absorbed, captors or photons");
    }
    if show != What::Captors && arguments.results.is_some() {
        return misplaced("--results", "captors");
    }
    if show != What::Photons && arguments.paths > 0 {
        return misplaced("--paths", "photons");
    }
    let numbers = matches!(show, What::Radiance | What::Irradiance | What::Absorbed);
    for path in &arguments.output {
        if !numbers && Kind::of(path)? != Kind::Png {
            return Err(Error::input(
                path.display(),
                "EXR holds the light on surfaces, no captors or photons",
            )
            .remedy("write .png"));
        }
    }
    Ok(())
}

/// The form of a picture.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Kind {
    Png,
    #[cfg(feature = "exr")]
    Exr,
}

impl Kind {
    fn of(path: &Path) -> Result<Self> {
        let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase());
        match extension.as_deref() {
            Some("png") => Ok(Self::Png),
            #[cfg(feature = "exr")]
            Some("exr") => Ok(Self::Exr),
            #[cfg(not(feature = "exr"))]
            Some("exr") => {
                Err(Error::input(path.display(), "this program was built without OpenEXR")
                    .remedy("write .png, or build it with `cargo build --release --features exr`"))
            }
            _ => Err(Error::input(path.display(), "is neither .png nor .exr")
                .remedy("let its name end so")),
        }
    }
}
