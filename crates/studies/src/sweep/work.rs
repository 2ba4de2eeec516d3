//! Does the runs of a sweep, several at a time.

use std::{
    sync::{
        Mutex,
        atomic::{AtomicUsize, Ordering},
    },
    thread,
    time::Instant,
};

use super::{
    control::{Step, SweepControl, SweepPlan, SweepProgress},
    folder::{State, SweepFolder, Time, Times},
    linear::{Base, Job, at_powers, scaling},
    optics::{self, Brightest},
    origin::{Inputs, Origin},
};
use phylux_core::{
    error::{Error, Result, catch_panic, lock, unlocked},
    transport::{
        settings::{Settings, ThreadCount},
        simulate::{Control, Progress, Simulation, simulate, simulate_split},
    },
};
use phylux_files::{
    scene_file::LoadedScene,
    sweep_file::{Run, Sweep},
};
use phylux_results::result::RunResult;

/// The states of runs that have ended, by number of the run.
type Found = Vec<(usize, State)>;

/// Does the runs of a sweep that are missing, several jobs at a time.
pub struct Work<'a> {
    sweep: &'a Sweep,
    folder: &'a SweepFolder,
    inputs: &'a Inputs<'a>,
    control: &'a SweepControl<'a>,
    threads: usize,
    /// The largest number of jobs at a time; 0 takes as many as there are threads.
    jobs: usize,
}

/// A job, with those of its runs that are to be done.
struct Todo<'a> {
    job: &'a Job,
    runs: Vec<Run<'a>>,
}

/// Work in progress, shared by all workers.
struct Progressing<'a> {
    todo: Vec<Todo<'a>>,
    /// Number of runs of all jobs together.
    runs: usize,
    times: Mutex<Times>,
    next: AtomicUsize,
    jobs_ended: AtomicUsize,
    runs_ended: AtomicUsize,
    /// For each worker, the runs done of its job that have not ended, with fractions.
    parts: Mutex<Vec<f64>>,
    found: Mutex<Found>,
    /// The error because of which nothing more can be written.
    broken: Mutex<Option<Error>>,
}

/// The scene that several runs share: with the part of each of its lights, or with variants of it for
/// each run.
enum SharedScene {
    Powers { loaded: LoadedScene, part_of: Vec<usize> },
    Histories(LoadedScene),
}

/// The simulation that several runs share, when it is done.
enum Shared<'s> {
    Powers { part_of: &'s [usize], simulation: Simulation<'s> },
    Histories { simulation: Simulation<'s>, brightest: Box<RunResult> },
}

/// A worker, which does one job at a time, and the number of its threads.
#[derive(Clone, Copy)]
struct Worker {
    index: usize,
    threads: usize,
}

impl<'a> Work<'a> {
    /// Prepares work in `folder`, as `plan` says.
    pub fn new(
        sweep: &'a Sweep,
        folder: &'a SweepFolder,
        inputs: &'a Inputs<'a>,
        control: &'a SweepControl<'a>,
        plan: &SweepPlan,
    ) -> Self {
        Self { sweep, folder, inputs, control, threads: plan.threads(), jobs: plan.jobs }
    }

    /// Does those runs of `jobs` that are not done according to `states`. As many jobs run side by
    /// side as there are threads, because a job on one thread never waits for another. Towards the
    /// end, the jobs that are left share the threads.
    pub fn go<'j>(&self, jobs: impl Iterator<Item = &'j Job>, states: &[State]) -> Result<Found> {
        let missing = |job: &'j Job| {
            let runs = job.runs.iter().filter(|&&run| states[run] != State::Done);
            let runs: Vec<Run> = runs.map(|&run| self.sweep.run(run)).collect();
            (!runs.is_empty()).then_some(Todo { job, runs })
        };
        let todo: Vec<Todo> = jobs.filter_map(missing).collect();
        let most = if self.jobs == 0 { self.threads } else { self.jobs.min(self.threads) };
        let workers = most.min(todo.len());
        let all = Progressing {
            runs: todo.iter().map(|todo| todo.runs.len()).sum(),
            todo,
            times: Mutex::new(self.folder.times()?),
            next: AtomicUsize::new(0),
            jobs_ended: AtomicUsize::new(0),
            runs_ended: AtomicUsize::new(0),
            parts: Mutex::new(vec![0.0; workers]),
            found: Mutex::default(),
            broken: Mutex::new(None),
        };
        // the files of the first runs may take long to read
        (self.control.progress)(SweepProgress { step: Step::Running, runs: 0.0, of: all.runs });
        thread::scope(|scope| {
            for worker in 0..workers {
                let all = &all;
                scope.spawn(move || self.worker(all, worker, workers));
            }
        });
        match unlocked(all.broken) {
            Some(error) => Err(error),
            None => Ok(unlocked(all.found)),
        }
    }

    fn worker(&self, all: &Progressing, index: usize, workers: usize) {
        while let Some(todo) = all.todo.get(all.next.fetch_add(1, Ordering::Relaxed)) {
            if self.control.stopped() || lock(&all.broken).is_some() {
                return;
            }
            let left = all.todo.len() - all.jobs_ended.load(Ordering::Relaxed);
            let threads = (self.threads / workers.min(left)).max(1);
            let job = || self.job(all, todo, Worker { index, threads });
            if let Err(error) = catch_panic("sweep", job) {
                lock(&all.broken).get_or_insert(error);
            }
            all.jobs_ended.fetch_add(1, Ordering::Relaxed);
        }
    }

    /// Does the runs of one job, until it is stopped. Error: results cannot be written.
    fn job(&self, all: &Progressing, todo: &Todo, worker: Worker) -> Result<()> {
        let started = Instant::now();
        // the shared simulation is the same whichever runs of the job are done already
        let base = self.base(todo).transpose();
        let shared = base.as_ref().map(|base| match base {
            Ok(base) => self.shared(all, todo, worker, base),
            Err(error) => Err(error.clone()),
        });
        let each = started.elapsed().as_secs_f64() / todo.runs.len() as f64;
        let next = AtomicUsize::new(0);
        let hand = || {
            while let Some(run) = todo.runs.get(next.fetch_add(1, Ordering::Relaxed)) {
                self.one(all, todo.job, run, shared.as_ref(), worker, each)?;
            }
            Ok(())
        };
        thread::scope(|scope| {
            let hands: Vec<_> =
                (1..worker.threads.min(todo.runs.len())).map(|_| scope.spawn(hand)).collect();
            let own = hand();
            let others = hands.into_iter().map(|hand| match hand.join() {
                Ok(done) => done,
                Err(panic) => std::panic::resume_unwind(panic),
            });
            others.fold(own, Result::and)
        })
    }

    /// Does one run, unless it is stopped. `each` is the run's part of the time spent on its job
    /// before, s.
    fn one(
        &self,
        all: &Progressing,
        job: &Job,
        run: &Run,
        shared: Option<&Result<Shared>>,
        worker: Worker,
        each: f64,
    ) -> Result<()> {
        if self.control.stopped() {
            return Ok(());
        }
        let started = Instant::now();
        let (origin, loaded) = Origin::load(self.sweep, run, job.base.as_deref(), self.inputs);
        let found = loaded.and_then(|loaded| {
            loaded.check_captors()?;
            let found = match shared {
                Some(Ok(Shared::Powers { part_of, simulation })) => {
                    Some(at_powers(simulation, part_of, &loaded))
                }
                Some(Ok(Shared::Histories { simulation, brightest })) => {
                    let index = job.runs.iter().position(|&index| index + 1 == run.number);
                    index.and_then(|index| optics::of_run((simulation, brightest), index, &loaded))
                }
                Some(Err(error)) => return Err(error.clone()),
                None => None,
            };
            let found = match found {
                Some(found) => found,
                None => self.alone(all, &loaded, worker).map_err(|error| loaded.placed(error))?,
            };
            Ok(found.with_warnings_of_scene(loaded.warnings))
        });
        if self.control.stopped() {
            return Ok(());
        }
        // runs that share a simulation have one thread of the worker each
        let own = started.elapsed().as_secs_f64();
        let seconds = if shared.is_some() { each + own / worker.threads as f64 } else { own };
        let time = Time { seconds, threads: worker.threads };
        let state = self.keep(run, &origin, found, &all.times, time)?;
        lock(&all.found).push((run.number, state));
        all.runs_ended.fetch_add(1, Ordering::Relaxed);
        // the run's part of the shared simulation now counts with the run
        let traced = lock(&all.parts)[worker.index];
        self.report(all, worker, (traced - 1.0).max(0.0));
        Ok(())
    }

    /// Loads the scene that all runs of a job share; `None` if they share none.
    fn base(&self, todo: &Todo) -> Result<Option<SharedScene>> {
        let job = todo.job;
        if job.base.is_none() {
            return Ok(None);
        }
        let load = |document| self.inputs.load(self.sweep, document);
        if !job.histories {
            let missing = || Error::run("sweep", "the powers of a group of runs have no largest");
            let base = Base::new(self.sweep, &job.runs).ok_or_else(missing)?;
            let loaded = load(base.document.clone())?;
            let part_of = base.parts(&loaded.scene);
            return Ok(Some(SharedScene::Powers { part_of, loaded }));
        }
        // values that are possible one by one may be too much together
        let brightest = Brightest::new(self.sweep, &job.runs, &scaling(self.sweep));
        let Some(brightest) = brightest else { return Ok(None) };
        let Ok(base) = load(brightest.document.clone()) else { return Ok(None) };
        let variant =
            |&run: &usize| load(brightest.counting(self.sweep.document(&self.sweep.run(run)))).ok();
        let variants = job.runs.iter().map(variant);
        Ok(optics::shared(base, &brightest.places, variants).map(SharedScene::Histories))
    }

    /// Does the simulation that all runs of a job share.
    fn shared<'s>(
        &self,
        all: &Progressing,
        todo: &Todo,
        worker: Worker,
        shared: &'s SharedScene,
    ) -> Result<Shared<'s>> {
        let threads = ThreadCount::nearest_to(worker.threads);
        let settings = |loaded: &LoadedScene| Settings { threads, ..loaded.settings.clone() };
        match shared {
            SharedScene::Powers { loaded, part_of } => {
                let simulation = self.watched(all, worker, todo.runs.len(), |control| {
                    simulate_split(&loaded.scene, &settings(loaded), part_of.clone(), control)
                })?;
                Ok(Shared::Powers { part_of, simulation })
            }
            SharedScene::Histories(loaded) => {
                let simulation = self.watched(all, worker, todo.runs.len(), |control| {
                    simulate(&loaded.scene, &settings(loaded), control)
                })?;
                let brightest = Box::new(RunResult::new(&simulation));
                Ok(Shared::Histories { simulation, brightest })
            }
        }
    }

    fn alone(&self, all: &Progressing, loaded: &LoadedScene, worker: Worker) -> Result<RunResult> {
        let threads = ThreadCount::nearest_to(worker.threads);
        let settings = Settings { threads, ..loaded.settings.clone() };
        let simulation =
            self.watched(all, worker, 1, |control| simulate(&loaded.scene, &settings, control))?;
        Ok(RunResult::new(&simulation))
    }

    /// Does work for which this number of runs waits, and reports its progress.
    fn watched<T>(
        &self,
        all: &Progressing,
        worker: Worker,
        runs: usize,
        work: impl FnOnce(&Control) -> T,
    ) -> T {
        let progress = |progress: Progress| {
            let of = progress.of.unwrap_or(u64::MAX) as f64;
            let part = (progress.photons as f64 / of).min(1.0);
            self.report(all, worker, part * runs as f64);
        };
        work(&Control { stop: self.control.stop, progress: &progress })
    }

    fn keep(
        &self,
        run: &Run,
        origin: &Origin,
        found: Result<RunResult>,
        times: &Mutex<Times>,
        time: Time,
    ) -> Result<State> {
        let key = self.sweep.key(run);
        match found {
            Ok(result) => {
                self.folder.write_result(&key, origin, &result)?;
                lock(times).add(run, &key, time)?;
                Ok(State::Done)
            }
            Err(error) => {
                let error = error.to_string();
                self.folder.write_failure(&key, origin, &error)?;
                Ok(State::Failed(error))
            }
        }
    }

    /// Reports progress. `part` is the number of runs that the worker has done, but not ended.
    fn report(&self, all: &Progressing, worker: Worker, part: f64) {
        let under_way: f64 = {
            let mut parts = lock(&all.parts);
            parts[worker.index] = part;
            parts.iter().sum()
        };
        let runs = all.runs_ended.load(Ordering::Relaxed) as f64 + under_way;
        let runs = runs.min(all.runs as f64);
        (self.control.progress)(SweepProgress { step: Step::Running, runs, of: all.runs });
    }
}
