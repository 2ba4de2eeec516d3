//! Forecast of the time and disk space of a sweep, from a short trial of its first run.

use std::{
    collections::HashSet,
    fmt,
    path::Path,
    time::{Duration, Instant},
};

use super::{
    Simulations, State, SweepControl, SweepPlan,
    folder::{Time, Times},
    linear::Jobs,
    look,
    origin::{Inputs, Origin},
    runs_of, simulations,
};
use phylux_core::{
    error::Result,
    transport::{
        settings::{PhotonCount, Settings, ThreadCount, TimeLimit},
        simulate::{Control, simulate},
    },
};
use phylux_files::{
    result_file::write_lines,
    sweep_file::{Run, Sweep},
};
use phylux_results::result::RunResult;

/// Number of photons of the trial.
const TRIAL: u64 = 50_000;
/// Approximate size of a row of the table of captors, without its parameters, bytes.
const ROW: usize = 80;

/// The runs that a sweep would do, with the time and disk space that they would take.
#[derive(Clone, Debug)]
pub struct Forecast {
    /// Runs of the shard: number and values, and the state of each.
    pub runs: Vec<(String, State)>,
    /// Number of simulations from which the runs come, if it is smaller than the number of runs.
    simulations: Option<Simulations>,
    todo: usize,
    threads: usize,
    /// Time of all runs that are to be done, on one thread, s; `None` if it cannot be known.
    seconds: Option<f64>,
    /// Disk space of all runs that are to be done, bytes.
    bytes: f64,
    /// Error of the trial, if the trial failed.
    failure: Option<String>,
}

impl Forecast {
    /// Makes the forecast for the runs of the shard that are not done in `folder`, if one is named.
    /// The folder need not exist. The forecast measures time, so it differs from one time to the
    /// next.
    pub fn make(
        sweep: &Sweep,
        folder: Option<&Path>,
        plan: &SweepPlan,
        control: &SweepControl,
    ) -> Result<Self> {
        let jobs = Jobs::new(sweep, control)?;
        let states = match folder {
            Some(path) => look(path, sweep, &jobs, &Inputs::new(sweep.folder()), control)?,
            None => vec![State::Missing; sweep.runs().len()],
        };
        let is_todo = |run: &Run| states[run.number - 1] != State::Done;
        let todo: Vec<Run> = runs_of(sweep, &jobs, plan.shard).filter(is_todo).collect();
        let name =
            |run: Run| (format!("run {}: {run}", run.number), states[run.number - 1].clone());
        let mut forecast = Self {
            runs: runs_of(sweep, &jobs, plan.shard).map(name).collect(),
            simulations: simulations(&jobs, plan.shard),
            todo: todo.len(),
            threads: plan.threads(),
            seconds: None,
            bytes: 0.0,
            failure: None,
        };
        let Some(first) = todo.first() else { return Ok(forecast) };
        let simulations: HashSet<usize> = todo.iter().map(|run| jobs.of(run)).collect();
        match trial(sweep, first, control) {
            Ok(trial) => {
                forecast.seconds = trial.seconds.map(|each| each * simulations.len() as f64);
                forecast.bytes = (trial.bytes * todo.len()) as f64;
            }
            Err(error) => forecast.failure = Some(format!("run {}: {error}", first.number)),
        }
        // the times of runs that are done are better than that of the trial
        let times = folder.map(Times::read).unwrap_or_default();
        if !times.is_empty() {
            let all: f64 =
                times.values().map(|Time { seconds, threads }| seconds * *threads as f64).sum();
            forecast.seconds = Some(all / times.len() as f64 * todo.len() as f64);
        }
        Ok(forecast)
    }
}

impl fmt::Display for Forecast {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { runs, simulations, todo, threads, seconds, bytes, failure } = self;
        if let Some(simulations) = simulations {
            writeln!(f, "{}", from_simulations(runs.len(), *simulations))?;
        }
        let s = if runs.len() == 1 { "" } else { "s" };
        write!(f, "{} run{s}, {todo} to do", runs.len())?;
        if *todo == 0 {
            return Ok(());
        }
        if let Some(failure) = failure {
            return write!(f, "; the first fails: {failure}");
        }
        match seconds {
            Some(seconds) => {
                write!(f, ": about {} on {threads} threads", span(seconds / *threads as f64))?;
            }
            None => write!(f, ": until they are accurate, which may take any time")?,
        }
        match *bytes < 1e5 {
            true => write!(f, ", {:.0} kB of disk", bytes / 1e3),
            false => write!(f, ", {:.1} MB of disk", bytes / 1e6),
        }
    }
}

/// Writes that runs share simulations.
pub fn from_simulations(runs: usize, Simulations { count, histories }: Simulations) -> String {
    let s = if count == 1 { "" } else { "s" };
    let why = match histories {
        false => "light is linear in the powers",
        true => "histories are weighted anew for other reflectances and transmittances",
    };
    format!("{runs} runs from {count} simulation{s}: {why}")
}

/// Writes a time in units that people read easily.
fn span(seconds: f64) -> String {
    match seconds {
        ..120.0 => format!("{seconds:.1} s"),
        120.0..7200.0 => format!("{:.0} min", seconds / 60.0),
        _ => format!("{:.1} h", seconds / 3600.0),
    }
}

struct Trial {
    seconds: Option<f64>,
    bytes: usize,
}

/// Does a short run on one thread.
fn trial(sweep: &Sweep, run: &Run, control: &SweepControl) -> Result<Trial> {
    let started = Instant::now();
    let (origin, loaded) = Origin::load(sweep, run, None, &Inputs::new(sweep.folder()));
    let loaded = loaded?;
    loaded.check_captors()?;
    let load = started.elapsed();
    let asked = &loaded.settings;
    let photons = asked.photons_or_default();
    let few = photons.min(TRIAL.max(loaded.scene.sources() as u64));
    let (tolerance, max_time) = (None, None);
    let settings = Settings {
        photons: Some(PhotonCount::nearest_to(few)),
        tolerance,
        max_time,
        threads: ThreadCount::ONE,
        ..asked.clone()
    };
    let started = Instant::now();
    let control = Control { stop: control.stop, progress: &|_| {} };
    let simulation = simulate(&loaded.scene, &settings, &control)?;
    let result = RunResult::new(&simulation);
    let each = started.elapsed().as_secs_f64() / few as f64;
    let traced = each * photons as f64;
    let limit = asked.max_time.map_or(Duration::MAX, TimeLimit::get).as_secs_f64();
    let seconds = asked.tolerance.is_none().then(|| load.as_secs_f64() + traced.min(limit));

    let mut json = Vec::new();
    // writing to memory cannot fail
    let _ = write_lines(&result, &mut json);
    let faces: usize = result.captors.iter().map(|captor| captor.faces().count()).sum();
    let row = ROW + serde_json::Value::from(origin.parameters).to_string().len();
    Ok(Trial { seconds, bytes: json.len() + faces * result.bands.len() * row })
}
