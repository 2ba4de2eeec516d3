//! `phylux run`

use std::{
    collections::HashSet,
    fs,
    io::{self, IsTerminal},
    path::{Path, PathBuf},
    sync::atomic::Ordering,
    time::{Duration, Instant},
};

use clap::Args;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressState, ProgressStyle};
use serde::Serialize;

use super::{
    interrupt::{Interrupt, NOTHING_WRITTEN},
    summary::summary,
};
use crate::{
    check::check_meshes,
    error::{Error, Result},
    output::OutputFile,
    result::RunResult,
    result_file::{OutputFolder, write_csv, write_json},
    scene_file::{self, LoadedScene},
    settings::{Checked, Estimator, Settings},
    simulate::{Control, Progress, simulate},
};

#[derive(Args)]
pub(super) struct Arguments {
    /// Scene file (JSON)
    scene: PathBuf,
    /// How to read the captors: photons from the lights, or paths back from the captors
    #[arg(long, value_enum)]
    estimator: Option<Estimator>,
    /// Photons (or paths over all captors) to trace, e.g. 5e6; with --tolerance: at most so many
    #[arg(long, value_name = "N", value_parser = photons, allow_negative_numbers = true)]
    photons: Option<u64>,
    /// Seed of the random numbers: the same seed gives the same results, byte for byte
    #[arg(long, value_name = "N", value_parser = count, allow_negative_numbers = true)]
    seed: Option<u64>,
    /// Go on until the relative standard error of every captor, face and band is at most this
    #[arg(long, value_name = "FRACTION", value_parser = tolerance, allow_negative_numbers = true)]
    tolerance: Option<f64>,
    /// End soon after this time, if --photons or --tolerance have not ended it before: give a large
    /// --photons. The photons that it reports, given as --photons, give the same results
    #[arg(long, value_name = "SECONDS", value_parser = max_time, allow_negative_numbers = true)]
    max_time: Option<Duration>,
    /// Photons of a k-nearest estimate; 0 makes none and stores no photons [default: the scene's, or
    /// the number of those on the face to the power 2/3, at least 50]
    #[arg(long, value_name = "N", value_parser = k, allow_negative_numbers = true)]
    k: Option<usize>,
    /// The most arrivals to store for k-nearest estimates
    #[arg(long, value_name = "N", value_parser = map_photons, allow_negative_numbers = true)]
    map_photons: Option<usize>,
    /// Threads; 0 takes all processors. The results do not depend on it
    #[arg(long, value_name = "N", value_parser = threads, allow_negative_numbers = true)]
    threads: Option<usize>,
    /// Results file (JSON)
    #[arg(short, long, value_name = "FILE", default_value = "results.json")]
    output: PathBuf,
    /// Also write one JSON file per captor into this folder
    #[arg(long, value_name = "DIR")]
    per_captor: Option<PathBuf>,
    /// Also write a tidy table: captor, face, band, quantity, value, standard error
    #[arg(long, value_name = "FILE")]
    csv: Option<PathBuf>,
    /// Also write times and speeds (JSON)
    #[arg(long, value_name = "FILE")]
    stats: Option<PathBuf>,
}

/// A whole number that may be written 1e8.
pub(super) fn count(text: &str) -> Checked<u64> {
    if let Ok(count) = text.parse() {
        return Ok(count);
    }
    match text.parse::<f64>() {
        Ok(v) if v > 9e15 => Err("must be at most 9e15".into()),
        Ok(v) if v >= 0.0 && v.fract() == 0.0 => Ok(v as u64),
        _ => Err("must be a whole number, at least 0 (1e6 is one)".into()),
    }
}

fn number(text: &str) -> Checked<f64> {
    text.parse().map_err(|_| "must be a number".into())
}

pub(super) fn photons(text: &str) -> Checked<u64> {
    Settings::check_photons(count(text)?)
}

pub(super) fn k(text: &str) -> Checked<usize> {
    Settings::check_k(count(text)?)
}

pub(super) fn map_photons(text: &str) -> Checked<usize> {
    Settings::check_map_photons(count(text)?)
}

pub(super) fn threads(text: &str) -> Checked<usize> {
    Settings::check_threads(count(text)?)
}

fn tolerance(text: &str) -> Checked<f64> {
    Settings::check_tolerance(number(text)?)
}

fn max_time(text: &str) -> Checked<Duration> {
    Settings::check_max_time(number(text)?)
}

/// Times and speeds of a run: what must not be in the results, which are the same each time.
#[derive(Serialize)]
struct Stats {
    photons: u64,
    segments: u64,
    threads: usize,
    load_seconds: f64,
    trace_seconds: f64,
    estimate_seconds: f64,
    photons_per_second: f64,
    segments_per_second: f64,
}

pub(super) fn run(arguments: &Arguments) -> Result<()> {
    let started = Instant::now();
    // first of all, so that neither Ctrl-C nor SIGTERM leaves a temporary file behind
    let interrupt = Interrupt::install()?;

    let output = OutputFile::create(&arguments.output)?;
    let per_captor = arguments.per_captor.as_deref().map(OutputFolder::create).transpose()?;
    let csv = arguments.csv.as_deref().map(OutputFile::create).transpose()?;
    let stats_file = arguments.stats.as_deref().map(OutputFile::create).transpose()?;
    let outputs = [Some(&output), csv.as_ref(), stats_file.as_ref()].into_iter().flatten();
    interrupt.remove_at_end(outputs.clone().filter_map(OutputFile::temporary));
    interrupt.remove_at_end(per_captor.iter().flat_map(OutputFolder::temporary));
    let mut places: Vec<PathBuf> =
        outputs.filter_map(OutputFile::place).map(Path::to_path_buf).collect();
    check_places(&places, &[])?;

    let reading = terminal_bar("{elapsed} reading the scene");
    reading.enable_steady_tick(Duration::from_millis(200));
    let loaded = scene_file::load(&arguments.scene)?;
    reading.finish_and_clear();
    loaded.check_captors()?;
    let LoadedScene { scene, settings, warnings, files, .. } = loaded;
    let ids = || scene.captors.iter().map(|captor| captor.id.as_str());
    places.extend(per_captor.iter().flat_map(|folder| folder.places(ids())));
    check_places(&places, &files)?;
    super::warn(&warnings);
    super::warn(&check_meshes(&scene)?);
    let settings = Settings {
        estimator: arguments.estimator.unwrap_or(settings.estimator),
        photons: arguments.photons.or(settings.photons),
        seed: arguments.seed.unwrap_or(settings.seed),
        k: arguments.k.or(settings.k),
        map_photons: arguments.map_photons.unwrap_or(settings.map_photons),
        tolerance: arguments.tolerance.or(settings.tolerance),
        tolerance_limit: arguments.photons,
        max_time: arguments.max_time.or(settings.max_time),
        threads: arguments.threads.unwrap_or(settings.threads),
    };
    let loaded = Instant::now();

    let bar = progress_bar(&settings);
    let progress = |progress: Progress| show(&bar, progress);
    let control = Control { stop: interrupt.stop(), progress: &progress };
    let simulation = interrupt.listening(|| simulate(&scene, &settings, &control));
    bar.finish_and_clear();
    let simulation = simulation?;
    let traced = Instant::now();
    let result = RunResult::new(&scene, &settings, &simulation);
    let estimated = Instant::now();
    if interrupt.stop().load(Ordering::Relaxed) {
        return Err(Error::run("run", NOTHING_WRITTEN));
    }
    interrupt.writing();

    output.write(|writer| write_json(&result, writer))?;
    if let Some(folder) = per_captor {
        folder.write(&result)?;
    }
    if let Some(csv) = csv {
        csv.write(|writer| write_csv(&result, writer))?;
    }
    let trace_seconds = (traced - loaded).as_secs_f64();
    let totals = &simulation.totals;
    let stats = Stats {
        photons: totals.histories,
        segments: totals.segments,
        threads: simulation.threads,
        load_seconds: (loaded - started).as_secs_f64(),
        trace_seconds,
        estimate_seconds: (estimated - traced).as_secs_f64(),
        photons_per_second: totals.histories as f64 / trace_seconds,
        segments_per_second: totals.segments as f64 / trace_seconds,
    };
    if let Some(file) = stats_file {
        file.write(|writer| {
            serde_json::to_writer_pretty(&mut *writer, &stats)?;
            writer.write_all(b"\n")
        })?;
    }
    let summary = summary(&result, &settings, simulation.end);
    super::warn(&summary.warnings);
    let speed = format!(
        "\n{:.1} s on {} threads, {:.2e} {}/s; wrote {}\n",
        trace_seconds,
        stats.threads,
        stats.photons_per_second,
        simulation.estimator,
        arguments.output.display(),
    );
    super::print(&(summary.text + &speed))
}

/// No output may take the place of another, or of a file that is read.
pub(super) fn check_places(places: &[PathBuf], files: &[PathBuf]) -> Result<()> {
    let files: HashSet<PathBuf> =
        files.iter().filter_map(|file| fs::canonicalize(file).ok()).collect();
    let mut named = HashSet::new();
    for place in places {
        let problem = if !named.insert(place) {
            "is named for two outputs"
        } else if files.contains(place) {
            "is a file that is read, which the output would replace"
        } else {
            continue;
        };
        return Err(Error::input(place.display(), problem).remedy("write elsewhere"));
    }
    Ok(())
}

fn progress_bar(settings: &Settings) -> ProgressBar {
    let what = settings.estimator;
    terminal_bar(&match settings.tolerance {
        Some(_) => format!("{{elapsed}} {{human_pos}} {what}, {{speed}}, {{msg}}"),
        None => format!("{{bar:30}} {{percent}}% {{human_pos}} {what}, {{speed}}, {{eta}} left"),
    })
}

/// Progress in the form of `template`; on a terminal only.
pub(super) fn terminal_bar(template: &str) -> ProgressBar {
    let target = match io::stderr().is_terminal() {
        true => ProgressDrawTarget::stderr_with_hz(10),
        false => ProgressDrawTarget::hidden(),
    };
    let bar = ProgressBar::with_draw_target(None, target);
    if let Ok(style) = ProgressStyle::with_template(template) {
        let speed = |state: &ProgressState, text: &mut dyn std::fmt::Write| {
            let _ = write!(text, "{:.2e}/s", state.per_sec());
        };
        bar.set_style(style.with_key("speed", speed));
    }
    bar
}

pub(super) fn show(bar: &ProgressBar, progress: Progress) {
    if let Some(of) = progress.of {
        bar.set_length(of);
    }
    if let Some(worst) = progress.worst_error {
        bar.set_message(format!("worst relative error {:.2} %", 100.0 * worst));
    }
    bar.set_position(progress.photons);
}
