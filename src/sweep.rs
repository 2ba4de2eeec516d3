//! Many runs of one scene: each is done once, whatever comes between.
//!
//! What is finished stands in a file of its own, put there whole; tables are made from these files
//! alone. So it does not matter when a sweep was stopped, in how many parts it ran, or on how many
//! threads.

mod folder;
mod forecast;
mod merge;
mod origin;
mod response;
mod table;
mod tables;

use std::{
    fmt,
    num::NonZero,
    path::Path,
    sync::{
        Mutex, PoisonError,
        atomic::{AtomicBool, AtomicUsize, Ordering},
    },
    thread,
    time::Instant,
};

use crate::{
    error::{Error, Result},
    result::RunResult,
    scene_file::{LoadedScene, load_value},
    settings::{Checked, Settings},
    simulate::{Control, Progress, simulate},
    sweep_file::{Run, Sweep},
};
use folder::{SweepFolder, Time, Times};
use origin::{Inputs, Origin};

pub use folder::State;
pub use forecast::Forecast;
pub use merge::merge;

/// A fixed share of the runs of a sweep.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shard {
    index: usize,
    of: usize,
}

impl Shard {
    /// All runs.
    pub const WHOLE: Self = Self { index: 0, of: 1 };

    /// From text such as `3/16`.
    pub fn parse(text: &str) -> Checked<Self> {
        let numbers =
            text.split_once('/').and_then(|(i, n)| Some((i.parse().ok()?, n.parse().ok()?)));
        match numbers {
            Some((index @ 1.., of)) if index <= of => Ok(Self { index: index - 1, of }),
            _ => Err("must be I/N with I from 1 to N, as in 3/16".into()),
        }
    }

    /// Whether a run is in it: neighbours, which take about as long, are in different ones.
    pub fn holds(self, run: &Run) -> bool {
        (run.number - 1) % self.of == self.index
    }
}

/// How a sweep is to be done.
#[derive(Clone, Copy, Debug)]
pub struct SweepPlan {
    /// Which runs.
    pub shard: Shard,
    /// Threads; 0 takes all processors. The results do not depend on it.
    pub threads: usize,
    /// The most runs at a time; 0 takes as many as there are threads.
    pub jobs: usize,
}

impl SweepPlan {
    fn threads(&self) -> usize {
        match self.threads {
            0 => thread::available_parallelism().map_or(1, NonZero::get),
            threads => threads,
        }
    }
}

/// What a sweep is watched and stopped by.
pub struct SweepControl<'a> {
    /// Set it to end the sweep with an error; what is finished stays.
    pub stop: &'a AtomicBool,
    /// Called now and then, from any thread.
    pub progress: &'a (dyn Fn(SweepProgress) + Sync),
}

impl SweepControl<'_> {
    fn stopped(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }
}

/// How far a sweep has come.
#[derive(Clone, Copy, Debug)]
pub struct SweepProgress {
    /// What it is at.
    pub step: Step,
    /// Runs behind it, with the parts of those that are under way.
    pub runs: f64,
    /// Runs in this step.
    pub of: usize,
}

/// What a sweep is at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Step {
    /// It looks what is there already.
    Looking,
    /// It runs.
    Running,
    /// It writes tables.
    Writing,
}

impl fmt::Display for Step {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Looking => "looking what is done",
            Self::Running => "running",
            Self::Writing => "writing tables",
        })
    }
}

/// What has become of a sweep.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// Runs of the shard.
    pub runs: usize,
    /// How many of them were there already.
    pub kept: usize,
    /// Those that failed: number and values, and the error.
    pub failed: Vec<(String, String)>,
    /// Runs of the whole sweep that are not in the folder, so that there are no tables.
    pub missing: usize,
}

/// The scene of a sweep with its own values, as a run would load it.
pub fn load_base(sweep: &Sweep) -> Result<LoadedScene> {
    let inputs = Inputs::new(sweep.folder());
    let read = |path: &Path| inputs.read(path);
    let path = Path::new(sweep.scene_path());
    let loaded = load_value(sweep.scene().clone(), path, &read)?;
    loaded.check_captors()?;
    Ok(loaded)
}

/// How far each run of the sweep is in the folder at `path`, which need not be there.
pub fn states(path: &Path, sweep: &Sweep, control: &SweepControl) -> Result<Vec<State>> {
    look(path, sweep, &Inputs::new(sweep.folder()), control)
}

fn look(path: &Path, sweep: &Sweep, inputs: &Inputs, control: &SweepControl) -> Result<Vec<State>> {
    let runs = sweep.runs();
    let of = runs.len();
    let mut states = Vec::with_capacity(of);
    for run in runs {
        if control.stopped() {
            return Err(Error::run("sweep", "interrupted"));
        }
        (control.progress)(SweepProgress { step: Step::Looking, runs: run.number as f64, of });
        states.push(folder::state(path, sweep, &run, inputs));
    }
    Ok(states)
}

/// Does what is missing of `sweep` in the folder at `path`; once every run is there, writes the tables.
/// Errors: another process is at work there, it holds something else, nothing can be written (disk
/// full), stopped by `control`. A run that fails is none: it is in the outcome.
pub fn sweep(
    sweep: &Sweep,
    path: &Path,
    plan: &SweepPlan,
    control: &SweepControl,
) -> Result<Outcome> {
    let folder = SweepFolder::open(path)?;
    folder.write_manifest(sweep)?;
    let inputs = Inputs::new(sweep.folder());
    let mut states = look(path, sweep, &inputs, control)?;
    let mine: Vec<Run> = sweep.runs().filter(|run| plan.shard.holds(run)).collect();
    let todo: Vec<&Run> = mine.iter().filter(|run| states[run.number - 1] != State::Done).collect();
    folder.remove(&tables::names())?;
    let kept = mine.len() - todo.len();
    let work = Work {
        sweep,
        folder: &folder,
        inputs: &inputs,
        control,
        todo,
        threads: plan.threads(),
        times: Mutex::new(folder.times()?),
        next: AtomicUsize::new(0),
        ended: AtomicUsize::new(0),
        parts: Mutex::default(),
        found: Mutex::default(),
        broken: Mutex::new(None),
    };
    let found = work.go(plan.jobs)?;
    for (number, state) in found {
        states[number - 1] = state;
    }
    let ended = mine.iter().filter(|run| states[run.number - 1] != State::Missing).count();
    if control.stopped() {
        let problem = format!("interrupted, {ended} of {} runs are done", mine.len());
        return Err(Error::run("sweep", problem).remedy("the same command goes on from there"));
    }
    let missing = states.iter().filter(|state| **state == State::Missing).count();
    if missing == 0 {
        Times::tidy(&folder, sweep, &Times::read(path))?;
        tables::write(&folder, sweep, &states, control)?;
    }
    let failed = failures(sweep, plan.shard, &states);
    Ok(Outcome { runs: mine.len(), kept, failed, missing })
}

/// Those of the shard that failed: number and values, and the error.
fn failures(sweep: &Sweep, shard: Shard, states: &[State]) -> Vec<(String, String)> {
    let mine = sweep.runs().zip(states).filter(|(run, _)| shard.holds(run));
    let failed = mine.filter_map(|(run, state)| match state {
        State::Failed(error) => Some((format!("run {} ({run})", run.number), error.clone())),
        _ => None,
    });
    failed.collect()
}

/// Runs to do, and what has become of them.
struct Work<'a> {
    sweep: &'a Sweep,
    folder: &'a SweepFolder,
    inputs: &'a Inputs<'a>,
    control: &'a SweepControl<'a>,
    todo: Vec<&'a Run<'a>>,
    threads: usize,
    times: Mutex<Times>,
    next: AtomicUsize,
    ended: AtomicUsize,
    /// The parts done of the runs under way.
    parts: Mutex<Vec<f64>>,
    found: Mutex<Vec<(usize, State)>>,
    /// Why nothing more can be written.
    broken: Mutex<Option<Error>>,
}

impl Work<'_> {
    /// As many runs side by side as there are threads for: one thread has nothing to wait for. Towards
    /// the end fewer runs share the threads.
    fn go(self, jobs: usize) -> Result<Vec<(usize, State)>> {
        let most = if jobs == 0 { self.threads } else { jobs.min(self.threads) };
        let workers = most.min(self.todo.len());
        lock(&self.parts).resize(workers, 0.0);
        thread::scope(|scope| {
            for worker in 0..workers {
                let work = &self;
                scope.spawn(move || work.worker(worker, workers));
            }
        });
        match self.broken.into_inner().unwrap_or_else(PoisonError::into_inner) {
            Some(error) => Err(error),
            None => Ok(self.found.into_inner().unwrap_or_else(PoisonError::into_inner)),
        }
    }

    fn worker(&self, worker: usize, workers: usize) {
        while let Some(run) = self.todo.get(self.next.fetch_add(1, Ordering::Relaxed)) {
            if self.control.stopped() || lock(&self.broken).is_some() {
                return;
            }
            let left = self.todo.len() - self.ended.load(Ordering::Relaxed);
            let threads = (self.threads / workers.min(left)).max(1);
            match self.one(run, worker, threads) {
                Ok(Some(state)) => lock(&self.found).push((run.number, state)),
                Ok(None) => return,
                Err(error) => {
                    lock(&self.broken).get_or_insert(error);
                }
            }
            self.ended.fetch_add(1, Ordering::Relaxed);
            self.report(worker, 0.0);
        }
    }

    /// One run; none if it was stopped. Error: what it found cannot be written.
    fn one(&self, run: &Run, worker: usize, threads: usize) -> Result<Option<State>> {
        let started = Instant::now();
        let (origin, loaded) = Origin::load(self.sweep, run, self.inputs);
        let progress = |progress: Progress| {
            let of = progress.of.unwrap_or(u64::MAX) as f64;
            self.report(worker, progress.photons as f64 / of);
        };
        let control = Control { stop: self.control.stop, progress: &progress };
        let found = loaded.and_then(|loaded| simulated(&loaded, threads, &control));
        let key = self.sweep.key(run);
        match found {
            _ if self.control.stopped() => Ok(None),
            Ok(result) => {
                self.folder.write_result(&key, &origin, &result)?;
                let time = Time { seconds: started.elapsed().as_secs_f64(), threads };
                lock(&self.times).add(run, &key, time)?;
                Ok(Some(State::Done))
            }
            Err(error) => {
                let error = error.to_string();
                self.folder.write_failure(&key, &origin, &error)?;
                Ok(Some(State::Failed(error)))
            }
        }
    }

    fn report(&self, worker: usize, part: f64) {
        let under_way: f64 = {
            let mut parts = lock(&self.parts);
            parts[worker] = part.min(1.0);
            parts.iter().sum()
        };
        let runs = self.ended.load(Ordering::Relaxed) as f64 + under_way;
        (self.control.progress)(SweepProgress { step: Step::Running, runs, of: self.todo.len() });
    }
}

fn simulated(loaded: &LoadedScene, threads: usize, control: &Control) -> Result<RunResult> {
    loaded.check_captors()?;
    let settings = Settings { threads, ..loaded.settings.clone() };
    let simulation = simulate(&loaded.scene, &settings, control)?;
    Ok(RunResult::new(&loaded.scene, &settings, &simulation))
}

fn lock<T>(mutex: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
