//! Convergence studies: accuracy against cost of every estimator, over a ladder of budgets with
//! several seeds each.
//!
//! Read [`study`] first, then `truth` (what errors are measured against), `bounces` and `figures`
//! (charts and words). `job` writes all of it into a folder.

mod bounces;
mod figures;
pub mod job;
mod truth;

use std::cell::Cell;

use cpu_time::ProcessTime;
use serde::{Deserialize, Serialize};

use phylux_core::{
    error::{Error, Result},
    scene::world::Scene,
    transport::{
        settings::{Estimator, NearestCount, PhotonCount, Settings, ThreadCount},
        simulate::{Control, Progress, Simulation, least_paths, simulate},
    },
};
use phylux_results::result::{CaptorResult, FaceResult, RunResult};

pub use bounces::{Bounces, Within};
pub use truth::{Reference, TrueValue};

/// Ratio of each rung's budget to that of the rung below: half a decade.
const RUNG: f64 = 3.162_277_660_168_379_5;
/// Number of rungs of the ladder.
const RUNGS: i32 = 7;
/// The run that stands in for the truth has the largest budget times this.
const LONG_RUN: u64 = 16;
/// This many photons show the shares of bounces well enough.
const MOST_FOR_BOUNCES: u64 = 1_000_000;
/// Seed of the long run. It differs from the seeds of the ladder.
const LONG_RUN_SEED: u64 = 1_000_003;

/// The runs of a convergence study.
#[derive(Clone, Debug)]
pub struct ConvergencePlan {
    /// The largest budget, in photons.
    pub photons: u64,
    /// Seed of the first run of each budget.
    pub seed: u64,
    /// Number of runs of each budget, with `seed` and the seeds after it; at least 2.
    pub seeds: u64,
    /// The values of k of the k-nearest estimates.
    pub k: Vec<usize>,
    /// Number of threads; 0 takes all processors. Times are CPU seconds of all threads together.
    pub threads: usize,
}

/// One run of a convergence study, a row of its table.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Row {
    /// Name of the estimator.
    pub estimator: String,
    /// Number of photons traced, or of paths from all faces together.
    pub photons: u64,
    /// Number of arrivals in the photon map, if the estimator uses one.
    pub arrivals: Option<u64>,
    /// Seed of the random streams.
    pub seed: u64,
    /// CPU seconds of tracing and estimating, without loading.
    pub cpu_seconds: f64,
    /// Relative root mean square difference from the reference, over captors, faces and bands.
    pub error: f64,
}

/// The runs of one estimator and budget together.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Rung {
    /// Name of the estimator.
    pub estimator: String,
    /// Number of photons or paths of each run.
    pub photons: u64,
    /// Mean number of arrivals in the photon map, if the estimator uses one.
    pub arrivals: Option<f64>,
    /// Mean CPU seconds of a run.
    pub cpu_seconds: f64,
    /// Root mean square of the runs' errors.
    pub error: f64,
    /// Relative error of the mean over the seeds, with the noise subtracted; 0 if noise explains
    /// all of it.
    pub bias: f64,
    /// Relative standard deviation between the seeds.
    pub spread: f64,
    /// Figure of merit 1 / (spread^2 x time), 1/s.
    pub merit: f64,
    /// Median over captors, faces and bands of the relative standard deviation between the seeds.
    pub median_spread: f64,
}

/// The results of a convergence study.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct ConvergenceStudy {
    /// Name of the scene.
    pub scene: String,
    /// Name of the reference against which errors are measured.
    pub reference: String,
    /// Relative root mean square standard error of the reference. Errors below it mean nothing.
    pub floor: f64,
    /// Number of values, by captor, face and band, that were compared.
    pub compared: usize,
    /// Number of values that are left out because the reference does not know them to 5 %, although
    /// light reaches them.
    pub left_out: usize,
    /// One row for each run.
    pub rows: Vec<Row>,
    /// One rung for each estimator and budget.
    pub rungs: Vec<Rung>,
    /// How often the light on the captors was scattered before it arrived.
    pub bounces: Bounces,
}

/// Runs the ladder on `scene` and compares with `truth` or, without one, with a long run. Errors:
/// those of [`simulate`]; fewer than 2 seeds; no captor that the reference knows.
pub fn study(
    scene: &Scene,
    plan: &ConvergencePlan,
    truth: Option<Reference>,
    control: &Control,
) -> Result<ConvergenceStudy> {
    if plan.seeds < 2 {
        let problem = format!("{} seeds, must be at least 2", plan.seeds);
        return Err(Error::input("seeds", problem).remedy("a spread needs several runs"));
    }
    let budgets: Vec<u64> = (1 - RUNGS..=0)
        .map(|i| ((plan.photons as f64 * RUNG.powi(i)).round() as u64).max(scene.sources() as u64))
        .collect();
    let each = plan.seeds * budgets.iter().sum::<u64>();
    let all =
        least_paths(scene) + 3 * each + if truth.is_none() { LONG_RUN * plan.photons } else { 0 };
    let mut ladder = Ladder { scene, plan, control, all, complete: false, done: Cell::new(0) };
    // where paths miss no light, and start from all faces, complete paths are the same
    let few = |estimator| {
        let settings =
            ladder.settings(estimator, least_paths(scene), plan.seed, NearestCount::NONE);
        ladder.simulate(&settings)
    };
    if few(Estimator::Paths)?.unseen().is_some()
        || !few(Estimator::Complete)?.by_photons().is_empty()
    {
        (ladder.complete, ladder.all) = (true, all + least_paths(scene) + each);
    }

    let reference = match truth {
        Some(reference) => reference,
        None => {
            let long = LONG_RUN * plan.photons;
            let settings =
                ladder.settings(Estimator::Auto, long, LONG_RUN_SEED, NearestCount::NONE);
            let simulation = ladder.simulate(&settings)?;
            Reference::of_run(&RunResult::new(&simulation), scene)
        }
    };
    if reference.compared() == 0 {
        let problem = format!("{} knows the irradiance of no captor to 5 %", reference.name);
        return Err(Error::input(format!("scene {}", scene.name()), problem)
            .remedy("give more photons, or a table of true values"));
    }
    let (mut rows, mut rungs) = (Vec::new(), Vec::new());
    for &photons in &budgets {
        let mut runs = Vec::new();
        for seed in (0..plan.seeds).map(|run| plan.seed.wrapping_add(run)) {
            runs.extend(ladder.runs(photons, seed)?);
        }
        rows.extend(runs.iter().map(|run| run.row(&reference)));
        // every seed gives the same estimators in the same order
        let estimators = runs.len() / plan.seeds as usize;
        for e in 0..estimators {
            let same: Vec<&Run> = runs.iter().skip(e).step_by(estimators).collect();
            rungs.push(Rung::of(&same, &reference));
        }
    }
    let enough = MOST_FOR_BOUNCES.max(scene.sources() as u64);
    let bounces = Bounces::count(scene, budgets[budgets.len() - 3].min(enough), control)?;
    Ok(ConvergenceStudy {
        scene: scene.name().into(),
        reference: reference.name.clone(),
        floor: reference.floor(),
        compared: reference.compared(),
        left_out: reference.left_out,
        rows,
        rungs,
        bounces,
    })
}

/// What all runs of a study share: scene, reference and settings.
struct Ladder<'a> {
    scene: &'a Scene,
    plan: &'a ConvergencePlan,
    control: &'a Control<'a>,
    /// Whether complete paths differ from paths.
    complete: bool,
    /// Number of photons of all runs together, and of those that are done.
    all: u64,
    done: Cell<u64>,
}

impl<'a> Ladder<'a> {
    fn settings(&self, estimator: Estimator, photons: u64, seed: u64, k: NearestCount) -> Settings {
        let photons = Some(PhotonCount::nearest_to(photons));
        let threads = ThreadCount::nearest_to(self.plan.threads);
        Settings { estimator, photons, seed, k: Some(k), threads, ..Settings::default() }
    }

    fn simulate(&self, settings: &Settings) -> Result<Simulation<'a>> {
        let before = self.done.get();
        let (all, report) = (self.all, self.control.progress);
        let progress = |progress: Progress| {
            let photons = before + progress.photons;
            report(Progress { photons, of: Some(all), worst: None });
        };
        let control = Control { stop: self.control.stop, progress: &progress };
        let simulation = simulate(self.scene, settings, &control)?;
        self.done.set(before + settings.photons_or_default());
        Ok(simulation)
    }

    /// Runs all estimators with one budget and seed. The time of each includes all that it needs.
    fn runs(&self, photons: u64, seed: u64) -> Result<Vec<Run>> {
        let mut runs = vec![self.summed(Estimator::Photons, photons, seed)?];
        // smaller budgets than the least for paths would all be the same run
        if photons >= least_paths(self.scene) || photons == self.plan.photons {
            runs.push(self.summed(Estimator::Paths, photons, seed)?);
            if self.complete {
                runs.push(self.summed(Estimator::Complete, photons, seed)?);
            }
        }
        let Some(&most) = self.plan.k.iter().max() else { return Ok(runs) };

        let most = NearestCount::new(most)?;
        let started = ProcessTime::now();
        let mut simulation =
            self.simulate(&self.settings(Estimator::Photons, photons, seed, most))?;
        let tracing = started.elapsed().as_secs_f64();
        for &k in &self.plan.k {
            let started = ProcessTime::now();
            simulation = simulation.with_k(NearestCount::new(k)?);
            let result = RunResult::new(&simulation);
            let cpu_seconds = tracing + started.elapsed().as_secs_f64();
            let values = irradiances(self.scene, &result, |face| {
                face.knn.as_ref()?.as_ref().map(|knn| &knn.irradiance[..])
            });
            let arrivals = result.account.map.map(|map| map.arrivals);
            let estimator = format!("{k} nearest photons");
            runs.push(Run { estimator, photons, arrivals, seed, cpu_seconds, values });
        }
        Ok(runs)
    }

    /// Estimates flux by photons, by paths or by complete paths.
    fn summed(&self, estimator: Estimator, photons: u64, seed: u64) -> Result<Run> {
        let started = ProcessTime::now();
        let settings = self.settings(estimator, photons, seed, NearestCount::NONE);
        let result = RunResult::new(&self.simulate(&settings)?);
        let cpu_seconds = started.elapsed().as_secs_f64();
        let values = irradiances(self.scene, &result, |face| Some(&face.irradiance[..]));
        let (estimator, photons) = (estimator.to_string(), result.photons);
        Ok(Run { estimator, photons, arrivals: None, seed, cpu_seconds, values })
    }
}

/// Returns the irradiances of all captors, faces and bands, in order; 0 where there is none.
fn irradiances(
    scene: &Scene,
    result: &RunResult,
    of: impl Fn(&FaceResult) -> Option<&[f64]>,
) -> Vec<f64> {
    let bands = scene.bands().len();
    let faces = result.captors.iter().flat_map(CaptorResult::faces);
    faces
        .flat_map(|face| of(face).map_or_else(|| vec![0.0; bands], |v| v[..bands].to_vec()))
        .collect()
}

/// One run of the ladder, with its irradiances.
struct Run {
    estimator: String,
    photons: u64,
    arrivals: Option<u64>,
    seed: u64,
    cpu_seconds: f64,
    values: Vec<f64>,
}

impl Run {
    fn row(&self, reference: &Reference) -> Row {
        Row {
            estimator: self.estimator.clone(),
            photons: self.photons,
            arrivals: self.arrivals,
            seed: self.seed,
            cpu_seconds: self.cpu_seconds,
            error: reference.rms(|i, truth| self.values[i] / truth.value - 1.0),
        }
    }
}

impl Rung {
    /// Averages runs that differ in nothing but the seed.
    fn of(runs: &[&Run], reference: &Reference) -> Self {
        let n = runs.len() as f64;
        let average = |of: &dyn Fn(&Run) -> f64| runs.iter().map(|run| of(run)).sum::<f64>() / n;
        let mean = |i: usize| average(&|run| run.values[i]);
        // variance of a single run, relative to the truth
        let variance = |i: usize, truth: f64| {
            let mean = mean(i);
            average(&|run| ((run.values[i] - mean) / truth).powi(2)) * n / (n - 1.0)
        };
        // the squared difference of the mean includes the noise of the mean and of the reference
        let bias2 = reference.mean(|i, truth| {
            let noise = variance(i, truth.value) / n + (truth.standard_error / truth.value).powi(2);
            (mean(i) / truth.value - 1.0).powi(2) - noise
        });
        let spread2 = reference.mean(|i, truth| variance(i, truth.value));
        let cpu_seconds = average(&|run| run.cpu_seconds);
        let mut spreads = reference.map(|i, truth| variance(i, truth.value).sqrt());
        spreads.sort_by(f64::total_cmp);
        let arrivals = runs.iter().map(|run| run.arrivals.map(|a| a as f64));
        Self {
            estimator: runs[0].estimator.clone(),
            photons: runs[0].photons,
            arrivals: arrivals.sum::<Option<f64>>().map(|sum| sum / n),
            cpu_seconds,
            error: average(&|run| run.row(reference).error.powi(2)).sqrt(),
            bias: bias2.max(0.0).sqrt(),
            spread: spread2.sqrt(),
            merit: 1.0 / (spread2 * cpu_seconds),
            median_spread: spreads[spreads.len() / 2],
        }
    }
}
