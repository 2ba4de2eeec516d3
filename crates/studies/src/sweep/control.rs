//! Options, progress and stopping of a sweep.

use std::{
    fmt,
    sync::atomic::{AtomicBool, Ordering},
};

use phylux_core::{math::machine, transport::shard::Shard};
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
            Self::Looking => "looking what is done",
            Self::Running => "running",
            Self::Writing => "writing tables",
        })
    }
}
