//! `phylux chart`: charts the error of every estimator against its cost in a scene.

use std::{
    collections::BTreeMap,
    fs,
    io::{self, Write},
    path::{Path, PathBuf},
};

use clap::Args;

use super::{
    interrupt::{Interrupt, check_folder},
    outputs,
    progress::{during, show, terminal_bar},
    run,
    style::Plots,
    tracing::TracingArguments,
};
use phylux_core::{
    error::{Error, Result},
    transport::{
        settings::{Checked, NearestCount, PhotonCount, Settings, ThreadCount},
        simulate::{Control, Progress},
    },
};
use phylux_files::{
    input, json,
    output::{FilesRead, OutputFile, Temporary},
    scene_file,
    written::Written,
};
use phylux_studies::convergence::{ConvergencePlan, ConvergenceStudy, Reference, Row, study};

/// The options of [`TracingArguments`], of which the seed promises less.
#[derive(Args)]
struct ChartTracing {
    /// Photons of the largest budget, e.g. 5e6 [default: the scene's]
    #[arg(long, value_name = "N", value_parser = run::photons, allow_hyphen_values = true)]
    photons: Option<PhotonCount>,
    /// Seed of the random numbers: the same seed gives the same errors. CPU seconds are measured, so
    /// that they, their charts and the words about them differ each time [default: the scene's]
    #[arg(long, value_name = "N", value_parser = run::count, allow_hyphen_values = true)]
    seed: Option<u64>,
    /// Threads; 0 takes all processors. The errors do not depend on it [default: the scene's]
    #[arg(long, value_name = "N", value_parser = run::threads, allow_hyphen_values = true)]
    threads: Option<ThreadCount>,
}

/// The tables of the runs: as rows, and all that was found.
const ROWS: &str = "rows.csv";
const STUDY: &str = "study.json";
/// Defaults of --seeds and --k.
const SEEDS: u64 = 5;
const NEAREST: [usize; 3] = [20, 50, 200];
/// The record of the files in their folder.
const RECORD: &str = "chart.written.json";

#[derive(Args)]
pub(super) struct Arguments {
    /// Scene file (JSON), or the study.json of earlier charts, which draws them anew without a run
    scene: PathBuf,
    /// Folder for the charts and their numbers (CSV, JSON); made if it does not exist
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    /// Table of true irradiances: columns captor, band, irradiance and, if wanted, face and
    /// standard_error. Without it, a run of 16 times the largest budget stands in for the truth
    #[arg(long, value_name = "FILE")]
    truth: Option<PathBuf>,
    #[command(flatten)]
    tracing: ChartTracing,
    /// Number of runs for each budget: the first has the seed, the second the number after it, and
    /// so on
    #[arg(long, value_name = "N", default_value_t = SEEDS, value_parser = clap::value_parser!(u64).range(2..=1000))]
    seeds: u64,
    /// Values of k for the k-nearest estimates, separated by commas
    #[arg(long, value_name = "N", default_values_t = NEAREST, value_delimiter = ',', value_parser = k)]
    k: Vec<usize>,
    #[command(flatten)]
    plots: Plots,
}

pub(super) fn run(arguments: &Arguments) -> Result<()> {
    let interrupt = Interrupt::install()?;
    let folder = &arguments.output;
    check_folder(folder)?;
    let new = !folder.is_dir();
    if new {
        fs::create_dir(folder).map_err(|e| {
            Error::input(folder.display(), format!("cannot be created: {}", e.kind()))
                .remedy("write elsewhere")
        })?;
    }
    let held = interrupt.hold(folder);
    let drawn = held.as_ref().map_err(Error::clone).and_then(|_| draw(arguments, &interrupt, new));
    drop(held);
    if new && drawn.is_err() {
        // this fails, as it should, if anything was written into the folder
        let _ = fs::remove_dir(folder);
    }
    drawn
}

fn draw(arguments: &Arguments, interrupt: &Interrupt, new: bool) -> Result<()> {
    let folder = &arguments.output;
    let style = arguments.plots.style();
    let charts = ConvergenceStudy::CHARTS.map(|name| format!("{name}.{}", style.ending()));
    let names = [&[ROWS.to_string(), STUDY.to_string()][..], &charts].concat();
    let written = Written::read(folder, RECORD, "move it away, or write into another folder")?;
    written.check(&names)?;
    let prepared = names.into_iter().map(|name| {
        let file = interrupt.file(&folder.join(&name))?;
        Ok((name, file))
    });
    let mut files = prepared.collect::<Result<BTreeMap<_, _>>>()?;
    interrupt.make(|| Ok(()), |()| new.then(|| Temporary::IfEmpty(folder.clone())))?;

    let places = files.values().filter_map(OutputFile::place).map(Path::to_path_buf).collect();
    let (found, read) = match drawn_before(arguments)? {
        // it is read already, so its own file may be written again
        Some(found) => (found, FilesRead::default()),
        None => traced(arguments, interrupt, places)?,
    };
    interrupt.writing();
    let mut complete = Vec::new();
    let mut write = |name: &str, content: &[u8]| {
        let file = files.remove(name).ok_or_else(|| Error::run(name, "is no file of a chart"))?;
        let mut file = written.begin(name, file.open(&read)?);
        file.write_all(content).map_err(|e| Error::unwritable(name, e))?;
        complete.push(file.complete()?);
        Ok(())
    };
    let failed = |e: io::Error| Error::unwritable(folder.display(), e);
    write(ROWS, &rows(&found.rows).map_err(failed)?)?;
    let mut study = serde_json::to_vec_pretty(&found).map_err(|e| failed(e.into()))?;
    study.push(b'\n');
    write(STUDY, &study)?;
    for (name, chart) in found.charts() {
        write(&format!("{name}.{}", style.ending()), &style.chart(chart)?)?;
    }
    written.put(complete)?;
    super::terminal::print(&format!("{}wrote {}\n", found.words(), folder.display()))
}

/// Reads the study of earlier charts, if it is one and no scene. Errors: it is damaged; an option is
/// given that would need runs.
fn drawn_before(arguments: &Arguments) -> Result<Option<ConvergenceStudy>> {
    let path = &arguments.scene;
    let place = path.display();
    if path.file_name().is_none_or(|name| name != STUDY) {
        return Ok(None);
    }
    let bytes = input::read_bytes(path).map_err(|problem| Error::input(&place, problem))?;
    json::check_memory(&bytes).map_err(|problem| Error::input(&place, problem))?;
    let is_study = serde_json::from_slice::<serde_json::Value>(&bytes)
        .is_ok_and(|value| value.get("rungs").is_some());
    if !is_study {
        return Ok(None);
    }
    let ChartTracing { photons, seed, threads } = arguments.tracing;
    let needs_runs = photons.is_some()
        || seed.is_some()
        || threads.is_some()
        || arguments.truth.is_some()
        || arguments.seeds != SEEDS
        || arguments.k != NEAREST;
    if needs_runs {
        return Err(Error::input(
            place,
            "holds runs that are complete, so only --output, --width and --png go with it",
        )
        .remedy("leave the other options out, or name the scene to run it again"));
    }
    serde_json::from_slice(&bytes).map(Some).map_err(|e| {
        Error::input(place, format!("is no study of charts: {e}"))
            .remedy("run `phylux chart` on the scene again")
    })
}

/// Runs the study of a scene. Returns it with the files that were read.
fn traced(
    arguments: &Arguments,
    interrupt: &Interrupt,
    places: Vec<PathBuf>,
) -> Result<(ConvergenceStudy, FilesRead)> {
    let loaded = during("reading the scene", || scene_file::load(&arguments.scene))?;
    let read = FilesRead::new(loaded.files.iter().chain(&arguments.truth));
    outputs::check_places(&places, &read)?;
    let scene = &loaded.scene;
    super::terminal::warn(&loaded.warnings);
    if scene.captors().is_empty() {
        return Err(Error::input(
            format!("{}: /captors", arguments.scene.display()),
            "the scene has no captor, so there is nothing to compare",
        )
        .remedy("add a captor, or `\"captor\": true` to an object"));
    }
    let truth = arguments.truth.as_ref().map(|path| Reference::read(path, scene)).transpose()?;
    let ChartTracing { photons, seed, threads } = arguments.tracing;
    let tracing = TracingArguments { photons, seed, threads };
    let Settings { photons, seed, threads, .. } = tracing.settings(&loaded.settings);
    let plan = ConvergencePlan {
        photons: photons.map_or(Settings::DEFAULT_PHOTONS, PhotonCount::get),
        seed,
        seeds: arguments.seeds,
        k: arguments.k.iter().copied().filter(|k| *k > 0).collect(),
        threads: threads.get(),
    };

    let bar = terminal_bar("{bar:30} {percent}% {human_pos} photons, {speed}{left}");
    let progress = |progress: Progress| show(&bar, progress);
    let control = Control { stop: interrupt.stop(), progress: &progress };
    let found = study(scene, &plan, truth, &control);
    bar.finish_and_clear();
    Ok((found?, read))
}

/// Parses a number of photons of a k-nearest estimate.
fn k(text: &str) -> Checked<usize> {
    run::k(text).map(NearestCount::get)
}

fn rows(rows: &[Row]) -> io::Result<Vec<u8>> {
    let mut table = csv::Writer::from_writer(Vec::new());
    for row in rows {
        table.serialize(row)?;
    }
    table.into_inner().map_err(|e| e.into_error())
}
