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
    progress::{show, terminal_bar},
    run,
    tracing::TracingArguments,
};
use crate::{
    error::{Error, Result},
    formats::{
        output::{FilesRead, OutputFile, Temporary},
        scene_file,
    },
    studies::convergence::{ConvergencePlan, ConvergenceStudy, Reference, Row, study},
    transport::{
        settings::Settings,
        simulate::{Control, Progress},
    },
};

#[derive(Args)]
pub(super) struct Arguments {
    /// Scene file (JSON)
    scene: PathBuf,
    /// Folder for the pictures (SVG) and their numbers (CSV, JSON); made if it does not exist
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    /// Table of true irradiances: columns captor, band, irradiance and, if wanted, face and
    /// standard_error. Without it, a run of 16 times the largest budget stands in for the truth
    #[arg(long, value_name = "FILE")]
    truth: Option<PathBuf>,
    #[command(flatten)]
    tracing: TracingArguments,
    /// Number of runs for each budget: the first has the seed, the second the number after it, and
    /// so on
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = clap::value_parser!(u64).range(2..=1000))]
    seeds: u64,
    /// Values of k for the k-nearest estimates, separated by commas
    #[arg(long, value_name = "N", default_values_t = [20, 50, 200], value_delimiter = ',', value_parser = run::k)]
    k: Vec<usize>,
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
    let drawn = draw(arguments, &interrupt, new);
    if new && drawn.is_err() {
        // this fails, as it should, if anything was written into the folder
        let _ = fs::remove_dir(folder);
    }
    drawn
}

fn draw(arguments: &Arguments, interrupt: &Interrupt, new: bool) -> Result<()> {
    let folder = &arguments.output;
    let create = |name: &str| interrupt.file(&folder.join(name));
    let (csv, json) = (create("rows.csv")?, create("study.json")?);
    let pictures = ConvergenceStudy::CHARTS.map(|name| Ok((name, create(&format!("{name}.svg"))?)));
    let mut pictures = pictures.into_iter().collect::<Result<BTreeMap<_, _>>>()?;
    interrupt.make(|| Ok(()), |()| new.then(|| Temporary::IfEmpty(folder.clone())))?;

    let loaded = scene_file::load(&arguments.scene)?;
    let places = [&csv, &json].into_iter().chain(pictures.values());
    let places = places.filter_map(OutputFile::place).map(Path::to_path_buf);
    let read = FilesRead::new(loaded.files.iter().chain(&arguments.truth));
    outputs::check_places(&places.collect::<Vec<_>>(), &read)?;
    let scene = &loaded.scene;
    super::terminal::warn(&loaded.warnings);
    if scene.captors.is_empty() {
        return Err(Error::input(
            format!("{}: /captors", arguments.scene.display()),
            "the scene has no captor, so there is nothing to compare",
        )
        .remedy("add a captor, or `\"captor\": true` to an object"));
    }
    let truth = arguments.truth.as_ref().map(|path| Reference::read(path, scene)).transpose()?;
    let Settings { photons, seed, threads, .. } = arguments.tracing.settings(&loaded.settings);
    let plan = ConvergencePlan {
        photons: photons.unwrap_or(Settings::DEFAULT_PHOTONS),
        seed,
        seeds: arguments.seeds,
        k: arguments.k.iter().copied().filter(|k| *k > 0).collect(),
        threads,
    };

    let bar = terminal_bar("{bar:30} {percent}% {human_pos} photons, {speed}, {eta} left");
    let progress = |progress: Progress| show(&bar, progress);
    let control = Control { stop: interrupt.stop(), progress: &progress };
    let found = interrupt.listening(|| study(scene, &plan, truth, &control));
    bar.finish_and_clear();
    let found = found?;
    interrupt.writing();
    csv.write(&read, |writer| write_rows(&found.rows, writer))?;
    json.write(&read, |writer| {
        serde_json::to_writer_pretty(&mut *writer, &found)?;
        writer.write_all(b"\n")
    })?;
    for (name, chart) in found.charts() {
        let svg = chart.svg().map_err(|e| Error::run(name, e))?;
        if let Some(file) = pictures.remove(name) {
            file.write(&read, |writer| writer.write_all(svg.as_bytes()))?;
        }
    }
    super::terminal::print(&format!("{}wrote {}\n", found.words(), folder.display()))
}

fn write_rows(rows: &[Row], writer: &mut dyn Write) -> io::Result<()> {
    let mut table = csv::Writer::from_writer(writer);
    for row in rows {
        table.serialize(row)?;
    }
    table.flush()
}
