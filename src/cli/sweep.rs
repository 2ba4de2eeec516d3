//! `phylux sweep` runs a scene with many values of some of its numbers; `phylux merge` joins the
//! shards of a sweep, or of one run.

use std::{
    fmt::Write,
    path::{Path, PathBuf},
};

use clap::Args;
use indicatif::ProgressBar;

use super::{
    interrupt,
    outputs::{check_places, place_of},
    progress::terminal_bar,
    style::Plots,
    terminal::{self, spelled},
    tracing::TracingArguments,
    year,
};
use phylux_core::{
    error::{Error, Result},
    transport::{
        settings::{Checked, PhotonCount},
        shard::Shard,
        simulate::{Control, Progress},
    },
};
use phylux_files::{
    output::FilesRead,
    result_file::write_json,
    sweep_file::Sweep,
    work_file::{Work, WorkReader},
};
use phylux_show::plot::PlotStyle;
use phylux_studies::desk::{Desk, check_folder};
use phylux_studies::{
    check::check_meshes,
    join::Shards,
    sweep::{
        Forecast, Outcome, State, SweepControl, SweepPlan, SweepProgress, from_simulations,
        load_base, merge, sweep,
    },
    text::summary::summary,
};

/// The most failed runs that are listed; all of them are in the table of runs.
const LISTED: usize = 10;

#[derive(Args)]
pub(super) struct Arguments {
    /// Sweep file (JSON)
    sweep: PathBuf,
    /// Folder for the results and tables; made if it does not exist. Finished runs in it are kept
    #[arg(short, long, value_name = "DIR", required_unless_present = "dry_run")]
    output: Option<PathBuf>,
    /// List the runs, and the time and disk space that they would take, and write nothing; needs no
    /// -o
    #[arg(long)]
    dry_run: bool,
    /// Do the I-th of N shards of the runs, each shard in a folder of its own; `phylux merge` joins
    /// them
    #[arg(long, value_name = "I/N", value_parser = Shard::parse, default_value = "1/1")]
    shard: Shard,
    #[command(flatten)]
    tracing: TracingArguments,
    /// The most runs at the same time; 0 takes as many as there are threads. Fewer take less memory
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = jobs)]
    jobs: usize,
    #[command(flatten)]
    plots: Plots,
}

fn jobs(text: &str) -> Checked<usize> {
    text.parse().map_err(|_| "must be a whole number, at least 0".into())
}

#[derive(Args)]
pub(super) struct MergeArguments {
    /// Folders that `phylux sweep --shard` has written, or files that `phylux run --shard` or
    /// `phylux year --shard` has written
    #[arg(required = true)]
    shards: Vec<PathBuf>,
    /// Folder for the whole sweep or year, made if it does not exist; or results file (JSON) of the
    /// run
    #[arg(short, long, value_name = "DIR|FILE")]
    output: PathBuf,
    /// Scene file of a run or year, if it is not where it was when the shards were traced
    #[arg(long, value_name = "FILE")]
    scene: Option<PathBuf>,
    #[command(flatten)]
    plots: Plots,
}

pub(super) fn run(arguments: &Arguments) -> Result<()> {
    let desk = interrupt::desk()?;
    arguments.output.as_deref().map_or(Ok(()), check_folder)?;
    let TracingArguments { photons, seed, threads } = arguments.tracing;
    let file = desk.during("reading the sweep", |_| Sweep::load(&arguments.sweep))?;
    let file = file.with_settings(photons.map(PhotonCount::get), seed);
    let base = desk.during("reading the scene", |_| load_base(&file))?;
    let threads = threads.unwrap_or(base.settings.threads).get();
    let plan = SweepPlan { shard: arguments.shard, threads, jobs: arguments.jobs };
    terminal::warn(&base.warnings);
    terminal::warn(&check_meshes(&base.scene)?);
    drop(base);
    let style = arguments.plots.style();
    match &arguments.output {
        Some(folder) if !arguments.dry_run => {
            let outcome = watched(&desk, style, |control| sweep(&file, folder, &plan, control))?;
            finish(&outcome, folder)
        }
        folder => dry_run(&file, folder.as_deref(), &plan, &desk),
    }
}

pub(super) fn run_merge(arguments: &MergeArguments) -> Result<()> {
    let style = arguments.plots.style();
    if arguments.shards.iter().any(|shard| WorkReader::shard(shard, Work::Year).is_ok()) {
        return year::merge(
            &arguments.shards,
            arguments.scene.as_deref(),
            &arguments.output,
            style,
        );
    }
    if arguments.shards.iter().any(|shard| shard.is_file()) {
        arguments.plots.refuse("results of a run", "leave them out")?;
        return run_join(arguments);
    }
    if arguments.scene.is_some() {
        let problem = "folders of sweeps know their scene";
        return Err(Error::input("--scene", problem).remedy("leave it out"));
    }
    check_folder(&arguments.output)?;
    let desk = interrupt::desk()?;
    let outcome =
        watched(&desk, style, |control| merge(&arguments.shards, &arguments.output, control))?;
    finish(&outcome, &arguments.output)
}

/// Joins the shards of one run.
fn run_join(arguments: &MergeArguments) -> Result<()> {
    let desk = interrupt::desk()?;
    let output = desk.file(&arguments.output)?;
    let place = output.place().map(Path::to_path_buf);
    // checked before the shards are read: this says more than the errors of a shard that the output
    // would replace
    check_places(place.as_slice(), &FilesRead::new(&arguments.shards))?;
    let bar = terminal_bar("{elapsed} adding up, {pos} batches");
    let progress = |progress: Progress| bar.set_position(progress.photons);
    let control = Control { stop: desk.stop(), progress: &progress };
    let scene = arguments.scene.as_deref();
    let shards = Shards::open(&arguments.shards, scene)?;
    let read = FilesRead::new(&shards.files);
    check_places(place.as_slice(), &read)?;
    let joined = shards.join(&control);
    bar.finish_and_clear();
    let result = joined?;
    desk.writing();
    output.write(&read, |writer| write_json(&result, writer))?;
    let summary = summary(&terminal::page(), &result, "");
    terminal::warn(&spelled(&summary.warnings));
    let from = format!("\nfrom {} shards; ", arguments.shards.len());
    terminal::print(&(summary.text + &from + &format!("wrote {}\n", place_of(&arguments.output))))
}

/// Does `work` with a progress bar, and ends it in an orderly way at a signal.
fn watched<T>(
    desk: &Desk,
    plots: PlotStyle,
    work: impl FnOnce(&SweepControl) -> Result<T>,
) -> Result<T> {
    desk.writing();
    let bar = terminal_bar("{bar:30} {msg}, {elapsed} so far{left}");
    bar.set_message("planning the runs");
    let progress = |progress| show(&bar, progress);
    let control = SweepControl { stop: desk.stop(), progress: &progress, plots };
    let late = Error::interrupted("sweep", "what is done stays in its folder")
        .remedy("the same command goes on from there");
    let done = desk.listening(Some(late), || work(&control));
    bar.finish_and_clear();
    done
}

fn show(bar: &ProgressBar, progress: SweepProgress) {
    let SweepProgress { step, runs, of } = progress;
    bar.set_length(1000 * of as u64);
    bar.set_message(format!("{step}: {} of {of} runs", runs.floor()));
    bar.set_position((1000.0 * runs) as u64);
}

/// Prints how a sweep or a merge ended. Error: some of its runs have failed.
fn finish(outcome: &Outcome, folder: &Path) -> Result<()> {
    let Outcome { runs, kept, damaged, simulations, failed, missing, warned, plots } = outcome;
    if *damaged > 0 {
        let s = if *damaged == 1 { " was" } else { "s were" };
        terminal::warn(&[format!("{damaged} run{s} done again, whose files were damaged")]);
    }
    for (run, error) in failed.iter().take(LISTED) {
        terminal::warn(&[format!("{run}: {error}")]);
    }
    if failed.len() > LISTED {
        terminal::warn(&[format!("and {} more", failed.len() - LISTED)]);
    }
    for (kind, runs) in warned {
        let s = if *runs == 1 { "" } else { "s" };
        terminal::warn(&[format!("{runs} run{s}: {kind}")]);
    }
    let mut text = String::new();
    if let Some(simulations) = simulations {
        let _ = writeln!(text, "{}", from_simulations(*runs, *simulations));
    }
    let are = if *runs == 1 { "run is" } else { "runs are" };
    let _ = write!(text, "{} of {runs} {are} done", runs - failed.len());
    if *kept > 0 {
        let _ = write!(text, ", {kept} of them from before");
    }
    let folder = folder.display();
    let _ = match missing {
        0 => writeln!(text, "; wrote {folder}"),
        _ => writeln!(text, "; {missing} runs of other shards are not in {folder}: no tables yet"),
    };
    if *missing == 0 && *plots == 0 && failed.is_empty() {
        text +=
            "no plots: they need a parameter with two numbers or more, and a group of captors\n";
    }
    terminal::print(&text)?;
    match failed.len() {
        0 => Ok(()),
        n => Err(Error::run("sweep", format!("{n} of {runs} runs failed")).remedy(format!(
            "correct what their errors name; the same command runs them again (also in {folder}/runs)"
        ))),
    }
}

fn dry_run(file: &Sweep, folder: Option<&Path>, plan: &SweepPlan, desk: &Desk) -> Result<()> {
    let forecast =
        watched(desk, PlotStyle::default(), |control| Forecast::make(file, folder, plan, control))?;
    let mut text = String::new();
    for (run, state) in &forecast.runs {
        let state = match state {
            State::Done => "done",
            State::Failed(_) => "failed, to do",
            State::Damaged => "damaged, to do",
            State::Missing => "to do",
        };
        let _ = writeln!(text, "{run}: {state}");
    }
    let _ = writeln!(text, "{forecast}");
    terminal::print(&text)
}
