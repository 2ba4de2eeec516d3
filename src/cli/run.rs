//! `phylux run`: traces photons or paths through a scene, or one shard of them, and writes the
//! results.

use std::{
    ops::RangeInclusive,
    path::{Path, PathBuf},
    sync::atomic::Ordering,
    time::Instant,
};

use clap::Args;
use indicatif::ProgressBar;
use serde::Serialize;
use serde_json::json;

use super::{
    interrupt,
    outputs::{FILES, OutputArguments, Outputs, check_places, place_of},
    progress::{show, terminal_bar},
    terminal::{self, spelled},
};
use phylux_core::{
    error::{Error, NOTHING_WRITTEN, Result, percent, setting},
    scene::world::Scene,
    transport::{
        settings::{
            Checked, Estimator, Guiding, MapLimit, NearestCount, PhotonCount, Settings, Target,
            ThreadCount, TimeLimit, Tolerance,
        },
        shard::Shard,
        simulate::{
            Control, End, Plan, Progress, ShardSums, Simulation, check_shardable, simulate_shard,
        },
    },
};
use phylux_files::{
    output::{FilesRead, OutputFile},
    run_work::{KeptSettings, write_shard},
    scene_file::{self, LoadedScene},
    work_file::{Work, WorkHead},
};
use phylux_results::result::{RunResult, ToleranceResult, WorstResult};
use phylux_studies::{
    desk::Desk,
    run::{ReadyRun, RunJob, warnings_of},
    text::summary::{far_off, summary},
};

/// Headings of groups of options in the help.
const ENDS: &str = "When the run ends";
pub(super) const LONG_RUNS: &str = "Long runs";

#[derive(Args)]
pub(super) struct Arguments {
    /// Scene file (JSON)
    scene: PathBuf,
    /// Method: photons from the lights, or paths back from the captors [default: the scene's, or auto]
    #[arg(long, value_parser = super::choices::estimator())]
    estimator: Option<Estimator>,
    /// Photons to trace, e.g. 5e6, or paths over all captors where --estimator asks for them; with
    /// --tolerance: the most to trace. Where complete paths are chosen for you, as many are traced as
    /// take the same work
    #[arg(long, value_name = "N", value_parser = photons)]
    photons: Option<PhotonCount>,
    /// Seed of the random numbers: the same seed gives the same results, byte for byte
    #[arg(long, value_name = "N", value_parser = count)]
    seed: Option<u64>,
    /// Go on until the relative standard error of every captor, face and band is at most this. If a
    /// limit ends the run earlier, the results are written and the exit code is 3
    #[arg(long, help_heading = ENDS, value_name = "FRACTION", value_parser = tolerance)]
    tolerance: Option<Tolerance>,
    /// What --tolerance is asked of, in place of the irradiance of all faces: captors or groups by
    /// a pattern of their names, a quantity (irradiance, back or absorbed) and a band, as in
    /// "plant*:absorbed:PAR"; can be given several times
    #[arg(long, help_heading = ENDS, value_name = "PATTERN[:QUANTITY[:BAND]]", value_parser = Target::parse)]
    of: Vec<Target>,
    /// End soon after this time, if --photons or --tolerance have not ended the run before: give a
    /// large --photons. The number of photons or paths that the run reports, given as --photons with
    /// the same --estimator, gives the same results
    #[arg(long, help_heading = ENDS, value_name = "SECONDS", value_parser = max_time)]
    max_time: Option<TimeLimit>,
    /// Photons of each k-nearest estimate; 0 makes no such estimates and stores no photons
    /// [default: the scene's, or the number of photons on the face to the power 2/3, at least 50]
    #[arg(long, value_name = "N", value_parser = k)]
    k: Option<NearestCount>,
    /// The most arrivals that k-nearest estimates are taken from
    #[arg(long, value_name = "N", value_parser = map_photons)]
    map_photons: Option<MapLimit>,
    /// What guides photons to captors that light hardly reaches [default: the scene's, or what a
    /// trial finds cheapest]
    #[arg(long, value_name = "NAME", value_parser = super::choices::guiding())]
    guiding: Option<Guiding>,
    /// No longer an option: --guiding has taken its place
    #[arg(long, hide = true, value_name = "N", value_parser = splitting)]
    splitting: Option<u64>,
    /// Also write what each light contributes, for `phylux mix`; with photons only
    #[arg(long)]
    by_light: bool,
    /// Also find how much results depend on materials and lights: on all, or with =NAME on this
    /// one; can be given several times, and takes the place of the scene's key `sensitivity`
    #[arg(long, value_name = "NAME", num_args = 0..=1, require_equals = true, default_missing_value = "")]
    sensitivity: Option<Vec<String>>,
    /// Trace the I-th of N shards of the run; `phylux merge` joins their files to the results
    #[arg(long, help_heading = LONG_RUNS, value_name = "I/N", value_parser = Shard::parse, conflicts_with_all = ["csv", "per_captor", "stats", "sensitivity"])]
    shard: Option<Shard>,
    /// Keep what is done in this file, and go on from there if the file exists: the same command,
    /// after a kill or the end of a job's time, finds the same results. The file is removed once
    /// the results are written
    #[arg(long, help_heading = LONG_RUNS, value_name = "FILE", conflicts_with = "shard")]
    checkpoint: Option<PathBuf>,
    /// With --checkpoint: least time between two writings of the file
    #[arg(long, help_heading = LONG_RUNS, value_name = "SECONDS", value_parser = max_time, default_value = "60", requires = "checkpoint")]
    checkpoint_every: TimeLimit,
    /// Threads; 0 takes all processors. The results do not depend on it
    #[arg(long, value_name = "N", value_parser = threads)]
    threads: Option<ThreadCount>,
    #[command(flatten)]
    outputs: OutputArguments,
    /// Also write times and speeds (JSON)
    #[arg(long, help_heading = FILES, value_name = "FILE")]
    stats: Option<PathBuf>,
}

impl Arguments {
    /// Loads the scene, with the sensitivities that are asked for.
    fn load(&self) -> Result<LoadedScene> {
        let Some(names) = &self.sensitivity else { return scene_file::load(&self.scene) };
        let all = names.iter().any(String::is_empty);
        let asked = if all { json!(true) } else { json!(names) };
        let loaded = scene_file::load_with_sensitivity(&self.scene, asked);
        loaded.map_err(|error| match error.place().contains("/sensitivity/") {
            true => error.at(setting("sensitivity")),
            false => error,
        })
    }

    fn job(&self) -> RunJob {
        RunJob {
            estimator: self.estimator,
            photons: self.photons,
            seed: self.seed,
            tolerance: self.tolerance,
            of: self.of.clone(),
            max_time: self.max_time,
            k: self.k,
            map_photons: self.map_photons,
            guiding: self.guiding,
            by_light: self.by_light,
            checkpoint: self.checkpoint.clone(),
            checkpoint_every: Some(self.checkpoint_every),
            threads: self.threads,
        }
    }
}

/// Returns a parser of whole numbers within limits.
pub(super) fn whole<T: TryFrom<u64>>(
    limits: RangeInclusive<u64>,
) -> impl Fn(&str) -> Checked<T> + Clone {
    move |text| {
        let within = count(text).ok().filter(|number| limits.contains(number));
        let number = within.and_then(|number| T::try_from(number).ok());
        let (least, most) = (limits.start(), limits.end());
        number.ok_or_else(|| format!("must be a whole number from {least} to {most}"))
    }
}

/// Parses a whole number, which may be written like 1e8.
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

/// Parses a whole number that counts things in memory.
fn size(text: &str) -> Checked<usize> {
    Ok(usize::try_from(count(text)?).unwrap_or(usize::MAX))
}

fn number(text: &str) -> Checked<f64> {
    text.parse().map_err(|_| format!("must be a number{}", percent(text)))
}

/// Makes a number of the settings for an option, which is the place of its errors.
fn checked<T>(made: Result<T>) -> Checked<T> {
    made.map_err(|error| error.message())
}

pub(super) fn photons(text: &str) -> Checked<PhotonCount> {
    checked(PhotonCount::new(count(text)?))
}

pub(super) fn k(text: &str) -> Checked<NearestCount> {
    checked(NearestCount::new(size(text)?))
}

pub(super) fn map_photons(text: &str) -> Checked<MapLimit> {
    checked(MapLimit::new(size(text)?))
}

/// Refuses an option that no longer exists.
pub(super) fn splitting(_: &str) -> Checked<u64> {
    Err("photons are no longer split: flights aimed at the sensors find them better; take it out, or say --guiding aim"
        .into())
}

pub(super) fn threads(text: &str) -> Checked<ThreadCount> {
    checked(ThreadCount::new(size(text)?))
}

pub(super) fn tolerance(text: &str) -> Checked<Tolerance> {
    checked(Tolerance::new(number(text)?))
}

pub(super) fn max_time(text: &str) -> Checked<TimeLimit> {
    checked(TimeLimit::new(number(text)?))
}

/// Times and speeds of a run. They are not in the results, which are the same each time.
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

impl Stats {
    /// Finds them by when the run started, had read the scene, traced and estimated.
    fn new(simulation: &Simulation, times: [Instant; 4]) -> Self {
        let [load_seconds, trace_seconds, estimate_seconds] =
            [0, 1, 2].map(|i| (times[i + 1] - times[i]).as_secs_f64());
        let totals = simulation.totals();
        Self {
            photons: totals.histories,
            segments: totals.segments,
            threads: simulation.threads(),
            load_seconds,
            trace_seconds,
            estimate_seconds,
            photons_per_second: totals.histories as f64 / trace_seconds,
            segments_per_second: totals.segments as f64 / trace_seconds,
        }
    }
}

/// Exit code of a run that ended before its tolerance was met; its results are written.
const TOLERANCE_NOT_MET: u8 = 3;

pub(super) fn run(arguments: &Arguments) -> Result<u8> {
    let started = Instant::now();
    // first of all, so that neither Ctrl-C nor SIGTERM leaves a temporary file behind
    let desk = interrupt::desk()?;

    let outputs = Outputs::create(&arguments.outputs, &desk)?;
    let stats_file = arguments.stats.as_deref().map(|path| desk.file(path)).transpose()?;
    let stats_place = stats_file.as_ref().and_then(OutputFile::place).map(Path::to_path_buf);
    let mut places = [outputs.places(), stats_place.as_slice().to_vec()].concat();
    check_places(&places, &FilesRead::default())?;

    let (loaded, digest) = desk.during("reading the scene", |_| match arguments.shard {
        Some(_) => scene_file::load_with_digest(&arguments.scene),
        None => Ok((arguments.load()?, String::new())),
    })?;
    loaded.check_captors()?;
    let scene = &loaded.scene;
    let read = FilesRead::new(&loaded.files);
    let ids = scene.captors().iter().map(|captor| captor.id.as_str());
    places.extend(outputs.captor_places(ids, &read)?);
    check_places(&places, &read)?;
    let warnings = warnings_of(&loaded)?;
    super::terminal::warn(&warnings);
    let job = arguments.job();
    let ready = job.ready(&loaded)?;
    let scene_read = Instant::now();

    if let Some(shard) = arguments.shard {
        let write = |plan: &Plan, shard_sums| {
            let kept = KeptSettings::new(&plan.settings, plan.choice.as_ref());
            let scene = arguments.scene.display().to_string();
            let head = WorkHead::new(Work::Run, scene, digest, &kept).of_shard(shard);
            desk.writing();
            outputs.write_shard(&read, |writer| write_shard(&head, shard_sums, writer))
        };
        let done = run_shard(scene, &ready.settings, shard, &desk, write);
        return done.map(|()| 0).map_err(|error| match &*error.place() {
            "shard" => error.at(setting("shard")),
            _ => ready.placed(error),
        });
    }
    places.extend(ready.place());
    check_places(&places, &read)?;
    let simulation = simulate(&ready, scene, &desk)?;
    let traced = Instant::now();
    let result = desk.during("estimating", |_| RunResult::new(&simulation));
    let result = result.with_warnings_of_scene(warnings);
    let estimated = Instant::now();
    if desk.stop().load(Ordering::Relaxed) {
        return Err(Error::interrupted("run", NOTHING_WRITTEN));
    }
    desk.writing();

    desk.during("writing", |_| outputs.write(&read, &result))?;
    let stats = Stats::new(&simulation, [started, scene_read, traced, estimated]);
    if let Some(file) = stats_file {
        file.write(&read, |writer| {
            serde_json::to_writer_pretty(&mut *writer, &stats)?;
            writer.write_all(b"\n")
        })?;
    }
    ready.finish();
    let summary = summary(&terminal::page(), &result, reason(simulation.end(), &result));
    terminal::warn(&spelled(&summary.warnings));
    let speed = format!(
        "\n{:.1} s on {} thread{}, {:.2e} {}/s; wrote {}\n",
        stats.trace_seconds,
        stats.threads,
        if stats.threads == 1 { "" } else { "s" },
        stats.photons_per_second,
        simulation.estimator(),
        place_of(&arguments.outputs.output),
    );
    super::terminal::print(&(summary.text + &speed))?;
    Ok(match result.account.tolerance {
        Some(ToleranceResult { met: false, .. }) => TOLERANCE_NOT_MET,
        _ => 0,
    })
}

/// Traces the photons or paths of the run, and shows how far it is.
fn simulate<'a>(ready: &ReadyRun<'a>, scene: &Scene, desk: &Desk) -> Result<Simulation<'a>> {
    let bar = progress_bar(&ready.settings);
    let progress = |progress: Progress| {
        if let Some(worst) = progress.worst {
            let said = far_off(&WorstResult::new(scene, &worst));
            bar.set_message(terminal::harmless(&said).into_owned());
        }
        show(&bar, progress);
    };
    let control = Control { stop: desk.stop(), progress: &progress };
    let simulation = ready.simulate(&control, desk);
    bar.finish_and_clear();
    simulation
}

/// Traces one shard of the run, and hands it to `write` with the plan of the run.
fn run_shard(
    scene: &Scene,
    settings: &Settings,
    shard: Shard,
    desk: &Desk,
    write: impl FnOnce(&Plan, ShardSums) -> Result<()>,
) -> Result<()> {
    check_shardable(settings)?;
    // the trial is made here, since the file of the shard must say what it has chosen
    let quiet = Control { stop: desk.stop(), progress: &|_| {} };
    let plan = Plan::make(scene, settings, &quiet)?;
    let bar = progress_bar(&plan.settings);
    let progress = |progress: Progress| show(&bar, progress);
    let control = Control { stop: desk.stop(), progress: &progress };
    let shard_sums = simulate_shard(scene, &plan, shard, &control);
    bar.finish_and_clear();
    let shard_sums = shard_sums?;
    let text = format!("shard {shard} of {}: {} batches\n", scene.name(), shard_sums.batches.len());
    write(&plan, shard_sums)?;
    super::terminal::print(&text)
}

/// Says why the run ended, after a comma; empty if all its photons were traced and no tolerance was
/// asked for.
fn reason(end: End, result: &RunResult) -> &'static str {
    match (end, &result.account.tolerance) {
        (End::Tolerance, _) => ", tolerance met",
        (End::Time, None) => ", time is up",
        (End::Time, Some(_)) => ", time is up, tolerance not met",
        (End::Photons, Some(_)) => ", tolerance not met",
        (End::Photons, None) => "",
    }
}

fn progress_bar(settings: &Settings) -> ProgressBar {
    let what = settings.estimator;
    terminal_bar(&match settings.tolerance {
        Some(_) => format!("{{elapsed}} {{human_pos}} {what}, {{speed}}, {{msg}}"),
        None => format!("{{bar:30}} {{percent}}% {{human_pos}} {what}, {{speed}}{{left}}"),
    })
}
