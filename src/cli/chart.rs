//! `phylux chart`: charts the error of every estimator against its cost in a scene.

use std::{path::PathBuf, sync::Arc};

use clap::Args;

use super::{interrupt, run, style::Plots};
use phylux_core::{
    error::{Error, Result},
    transport::settings::{Checked, NearestCount, PhotonCount, ThreadCount},
};
use phylux_files::scene_file::SceneSource;
use phylux_studies::{
    convergence::job::{ChartRuns, chart},
    desk::check_folder,
};

/// The options of commands that trace, of which the seed promises less.
#[derive(Args)]
struct ChartTracing {
    /// Photons of the largest budget, e.g. 5e6 [default: the scene's]
    #[arg(long, value_name = "N", value_parser = run::photons)]
    photons: Option<PhotonCount>,
    /// Seed of the random numbers: the same seed gives the same errors. CPU seconds are measured, so
    /// that they, their charts and the words about them differ each time [default: the scene's]
    #[arg(long, value_name = "N", value_parser = run::count)]
    seed: Option<u64>,
    /// Threads; 0 takes all processors. The errors do not depend on it [default: the scene's]
    #[arg(long, value_name = "N", value_parser = run::threads)]
    threads: Option<ThreadCount>,
}

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
    #[arg(long, value_name = "N", default_value_t = ChartRuns::SEEDS, value_parser = run::whole::<u64>(2..=1000))]
    seeds: u64,
    /// Values of k for the k-nearest estimates, separated by commas
    #[arg(long, value_name = "N", default_values_t = ChartRuns::NEAREST, value_delimiter = ',', value_parser = k)]
    k: Vec<usize>,
    #[command(flatten)]
    plots: Plots,
}

pub(super) fn run(arguments: &Arguments) -> Result<()> {
    let desk = interrupt::desk()?;
    let folder = &arguments.output;
    check_folder(folder)?;
    let runs = match ChartRuns::of_study(&arguments.scene)? {
        Some(study) => arguments.without_runs(study)?,
        None => arguments.runs()?,
    };
    let found = chart(&runs, folder, arguments.plots.style(), &desk)?;
    super::terminal::print(&format!("{}wrote {}\n", found.words(), folder.display()))
}

impl Arguments {
    /// Refuses options that would need runs.
    fn without_runs(&self, study: ChartRuns) -> Result<ChartRuns> {
        let ChartTracing { photons, seed, threads } = self.tracing;
        let needs_runs = photons.is_some()
            || seed.is_some()
            || threads.is_some()
            || self.truth.is_some()
            || self.seeds != ChartRuns::SEEDS
            || self.k != ChartRuns::NEAREST;
        match needs_runs {
            false => Ok(study),
            true => Err(Error::input(
                self.scene.display(),
                "holds runs that are complete, so only --output, --width and --png go with it",
            )
            .remedy("leave the other options out, or name the scene to run it again")),
        }
    }

    fn runs(&self) -> Result<ChartRuns> {
        let ChartTracing { photons, seed, threads } = self.tracing;
        Ok(ChartRuns::Scene {
            source: Arc::new(SceneSource::read(&self.scene)?),
            truth: self.truth.clone(),
            photons,
            seed,
            seeds: self.seeds,
            k: self.k.clone(),
            threads,
        })
    }
}

/// Parses a number of photons of a k-nearest estimate.
fn k(text: &str) -> Checked<usize> {
    run::k(text).map(NearestCount::get)
}
