//! Sweeps: many runs of one scene. Each run is done once, even if the sweep is interrupted.
//!
//! The results of a finished run are in a file of their own, which is put in place as a whole.
//! Tables are made from these files alone. The tables therefore do not depend on when a sweep was
//! stopped, in how many parts it ran, or on how many threads.
//!
//! Read the function `sweep` first, then `folder` (the files), `work` (doing the runs), `linear`
//! (runs that share a simulation), `origin` (whether a result still holds), `tables` and `response`
//! (what is written), and `merge` (shards).

mod control;
mod folder;
mod forecast;
mod linear;
mod merge;
mod optics;
mod origin;
mod response;
mod sealed;
mod table;
mod tables;
mod work;

use std::{collections::BTreeMap, path::Path};

use folder::{SweepFolder, Times};
use linear::Jobs;
use origin::Inputs;
use phylux_core::{
    error::{Error, Result},
    transport::shard::Shard,
};
use phylux_files::{
    scene_file::LoadedScene,
    sweep_file::{Run, Sweep},
};
use tables::Written;
use work::Work;

pub use control::{Step, SweepControl, SweepPlan, SweepProgress};
pub use folder::State;
pub use forecast::{Forecast, from_simulations};
pub use merge::merge;

/// The outcome of a sweep.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// Number of runs of the shard.
    pub runs: usize,
    /// Number of these runs whose results were in the folder already.
    pub kept: usize,
    /// Number of these runs whose files had been damaged, so that they were done again.
    pub damaged: usize,
    /// Number of simulations from which the runs come, if that is smaller: light is linear in the
    /// powers.
    pub simulations: Option<Simulations>,
    /// Runs that failed: number and values of the run, and its error.
    pub failed: Vec<(String, String)>,
    /// Number of runs of the whole sweep that are not in the folder. Tables are only written when
    /// it is 0.
    pub missing: usize,
    /// Number of runs of the whole sweep with warnings, by kind of warning; empty if runs are
    /// missing.
    pub warned: BTreeMap<String, usize>,
    /// Number of plots; 0 if runs are missing.
    pub plots: usize,
}

/// Loads the scene of a sweep with its own values, as a run would load it.
pub fn load_base(sweep: &Sweep) -> Result<LoadedScene> {
    let loaded = Inputs::new(sweep.folder()).load(sweep, sweep.scene().clone())?;
    loaded.check_captors()?;
    Ok(loaded)
}

/// Returns the runs of a shard, in order.
fn runs_of<'a>(
    sweep: &'a Sweep,
    jobs: &'a Jobs,
    shard: Shard,
) -> impl Iterator<Item = Run<'a>> + 'a {
    sweep.runs().filter(move |run| shard.holds(jobs.of(run)))
}

/// The simulations from which runs come, fewer than these.
#[derive(Clone, Copy, Debug)]
pub struct Simulations {
    /// Their number.
    pub count: usize,
    /// Whether some runs differ in reflectances or transmittances, and share histories.
    pub histories: bool,
}

/// Returns the simulations from which the runs of a shard come, if they are fewer than the runs.
fn simulations(jobs: &Jobs, shard: Shard) -> Option<Simulations> {
    let held = jobs.jobs.iter().enumerate().filter(|(index, _)| shard.holds(*index));
    let held: Vec<_> = held.map(|(_, job)| job).collect();
    let histories = held.iter().any(|job| job.histories);
    let runs: usize = held.iter().map(|job| job.runs.len()).sum();
    (held.len() < runs).then_some(Simulations { count: held.len(), histories })
}

/// Returns the state of each run in the folder at `path`.
fn look(
    path: &Path,
    sweep: &Sweep,
    jobs: &Jobs,
    inputs: &Inputs,
    control: &SweepControl,
) -> Result<Vec<State>> {
    let runs = sweep.runs();
    let of = runs.len();
    let mut states = Vec::with_capacity(of);
    for run in runs {
        if control.stopped() {
            return Err(Error::interrupted("sweep", "no run was started"));
        }
        control.looking(run.number, of);
        states.push(folder::state(path, sweep, &run, jobs.base(&run), inputs));
    }
    Ok(states)
}

/// Does the runs of `sweep` that are missing in the folder at `path`. Once every run is there, it
/// writes the tables. Errors: another process is at work in the folder, the folder holds something
/// else, nothing can be written (disk full), stopped by `control`. A run that fails is not an error
/// of the sweep: the outcome lists it.
pub fn sweep(
    sweep: &Sweep,
    path: &Path,
    plan: &SweepPlan,
    control: &SweepControl,
) -> Result<Outcome> {
    let folder = SweepFolder::open(path)?;
    let inputs = Inputs::new(sweep.folder());
    let jobs = Jobs::new(sweep, control)?;
    let mut states = look(path, sweep, &jobs, &inputs, control)?;
    let mine: Vec<usize> = runs_of(sweep, &jobs, plan.shard).map(|run| run.number - 1).collect();
    let kept = mine.iter().filter(|&&run| states[run] == State::Done).count();
    let damaged = mine.iter().filter(|&&run| states[run] == State::Damaged).count();
    let all = states.iter().all(|state| *state == State::Done);
    folder.written().clear(&tables::names(), all)?;
    folder.write_manifest(sweep)?;
    let work = Work::new(sweep, &folder, &inputs, control, plan);
    let held = jobs.jobs.iter().enumerate().filter(|(index, _)| plan.shard.holds(*index));
    let found = work.go(held.map(|(_, job)| job), &states)?;
    for (number, state) in found {
        states[number - 1] = state;
    }
    let ended = mine.iter().filter(|&&run| states[run].is_ended()).count();
    if control.stopped() {
        let left = format!("{ended} of {} runs are done", mine.len());
        return Err(Error::interrupted("sweep", left).remedy("the same command goes on from there"));
    }
    let missing = states.iter().filter(|state| !state.is_ended()).count();
    let mut written = Written::default();
    if missing == 0 {
        Times::tidy(&folder, sweep, &Times::read(path))?;
        written = tables::write(&folder, sweep, &states, control)?;
    }
    let failed = failures(runs_of(sweep, &jobs, plan.shard), &states);
    let simulations = simulations(&jobs, plan.shard);
    let Written { warned, plots } = written;
    Ok(Outcome { runs: mine.len(), kept, damaged, simulations, failed, missing, warned, plots })
}

/// Returns the runs that failed: number and values of the run, and its error.
fn failures<'a>(runs: impl Iterator<Item = Run<'a>>, states: &[State]) -> Vec<(String, String)> {
    let failed = runs.filter_map(|run| match &states[run.number - 1] {
        State::Failed(error) => Some((format!("run {} ({run})", run.number), error.clone())),
        _ => None,
    });
    failed.collect()
}
