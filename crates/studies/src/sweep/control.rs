//! Options, progress and stopping of a sweep.

use std::{
    cell::Cell,
    fmt,
    sync::atomic::{AtomicBool, Ordering},
};

use phylux_core::{
    error::{Error, Result},
    math::machine,
    transport::shard::Shard,
};
use phylux_show::plot::PlotStyle;

/// The options of a sweep.
#[derive(Clone, Copy, Debug)]
pub struct SweepPlan {
    /// The shard whose runs this machine does.
    pub shard: Shard,
    /// Number of threads; 0 takes all processors. The results do not depend on it.
    pub threads: usize,
    /// The largest number of runs at a time; 0 takes as many as there are threads.
    pub jobs: usize,
}

impl SweepPlan {
    pub(super) fn threads(&self) -> usize {
        machine::threads(self.threads)
    }
}

/// Progress and stopping of a sweep, and how its plots look.
pub struct SweepControl<'a> {
    /// Set it to end the sweep with an error. Finished runs stay in the folder.
    pub stop: &'a AtomicBool,
    /// Called now and then, from any thread.
    pub progress: &'a (dyn Fn(SweepProgress) + Sync),
    /// How plots are written.
    pub plots: PlotStyle,
}

impl SweepControl<'_> {
    pub(super) fn stopped(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }

    /// Says now and then which of the runs is looked for in the folder.
    pub(super) fn looking(&self, run: usize, of: usize) {
        const EACH: usize = 100;
        if run % EACH == 1 || run == of {
            (self.progress)(SweepProgress { step: Step::Looking, runs: run as f64, of });
        }
    }

    /// Begins to decide which of this number of runs come from one simulation.
    pub(super) fn planning(&self, of: usize) -> Planning<'_> {
        Planning { control: self, of, runs: Cell::new(0.0), told: Cell::new(0.0) }
    }
}

/// How far it is decided which runs come from one simulation.
pub struct Planning<'a> {
    control: &'a SweepControl<'a>,
    of: usize,
    /// Number of runs of which it is decided, with fractions.
    runs: Cell<f64>,
    /// What of it has been told.
    told: Cell<f64>,
}

impl Planning<'_> {
    /// Between two reports, this many runs are decided.
    const EACH: f64 = 1000.0;

    /// Says that this number of runs, or a part of one, is decided. Error: the sweep is stopped.
    pub fn add(&self, runs: f64) -> Result<()> {
        self.runs.set(self.runs.get() + runs);
        if self.runs.get() < self.told.get() + Self::EACH {
            return Ok(());
        }
        self.told.set(self.runs.get());
        let (step, runs) = (Step::Planning, self.runs.get().min(self.of as f64));
        (self.control.progress)(SweepProgress { step, runs, of: self.of });
        match self.control.stopped() {
            true => Err(Error::interrupted("sweep", "no run was started")),
            false => Ok(()),
        }
    }
}

/// How far a sweep has come.
#[derive(Clone, Copy, Debug)]
pub struct SweepProgress {
    /// The step that the sweep is at.
    pub step: Step,
    /// Number of runs that are done, with fractions for those under way.
    pub runs: f64,
    /// Number of runs in this step.
    pub of: usize,
}

/// The steps of a sweep.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Step {
    /// Deciding which runs come from one simulation.
    Planning,
    /// Reading the runs that the folder already holds.
    Looking,
    /// Simulating the runs.
    Running,
    /// Writing tables and plots.
    Writing,
}

impl fmt::Display for Step {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Planning => "planning",
            Self::Looking => "looking what is done",
            Self::Running => "running",
            Self::Writing => "writing tables",
        })
    }
}
