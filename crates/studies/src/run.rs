//! A run of a scene: its settings over those of the scene, and the file that keeps what is done.

use std::{
    path::PathBuf,
    sync::atomic::{AtomicBool, Ordering},
};

use crate::{check::check_meshes, desk::Desk};
use phylux_core::{
    error::{Error, ErrorKind, Result, setting},
    scene::world::Scene,
    transport::{
        settings::{
            Estimator, Guiding, MapLimit, NearestCount, PhotonCount, Settings, Target, ThreadCount,
            TimeLimit, Tolerance,
        },
        simulate::{Control, Keeper, KeptArrivals, RunState, Simulation, simulate, simulate_kept},
    },
    words,
};
use phylux_files::{run_work::Checkpoint, scene_file::LoadedScene};
use phylux_results::result::RunResult;

/// How a scene is to be run. Where a setting is not given, the scene's holds.
#[derive(Clone, Debug)]
pub struct RunJob {
    /// The method.
    pub estimator: Option<Estimator>,
    /// Number of photons, or of paths over all captors; with a tolerance, the most.
    pub photons: Option<PhotonCount>,
    /// Seed of the random numbers.
    pub seed: Option<u64>,
    /// Relative standard error to reach.
    pub tolerance: Option<Tolerance>,
    /// What the tolerance is asked of; none for the irradiance of all faces.
    pub of: Vec<Target>,
    /// The time after which the run should end.
    pub max_time: Option<TimeLimit>,
    /// Photons of each k-nearest estimate.
    pub k: Option<NearestCount>,
    /// The most arrivals that these are taken from.
    pub map_photons: Option<MapLimit>,
    /// What guides the photons.
    pub guiding: Option<Guiding>,
    /// Whether the part of each light is kept apart.
    pub by_light: bool,
    /// The file that keeps what is done.
    pub checkpoint: Option<PathBuf>,
    /// Least time between two writings of this file; `None` for [`Self::USUAL_EVERY`].
    pub checkpoint_every: Option<TimeLimit>,
    /// Number of threads.
    pub threads: Option<ThreadCount>,
}

/// A run that can begin.
pub struct ReadyRun<'a> {
    job: &'a RunJob,
    loaded: &'a LoadedScene,
    /// The settings.
    pub settings: Settings,
    checkpoint: Option<Checkpoint>,
}

impl RunJob {
    /// Usual least time between two writings of a checkpoint, s.
    pub const USUAL_EVERY: f64 = 60.0;

    /// Joins the settings with those of the scene. Error: something is named that a tolerance
    /// applies to, and there is none.
    pub fn ready<'a>(&'a self, loaded: &'a LoadedScene) -> Result<ReadyRun<'a>> {
        let settings = self.settings(&loaded.settings)?;
        let checkpoint = self.checkpoint.as_deref();
        let checkpoint = checkpoint.map(|path| Checkpoint::new(path, &loaded.scene, &settings));
        Ok(ReadyRun { job: self, loaded, settings, checkpoint })
    }

    /// Runs the scene, and goes on from the checkpoint if its file exists, which is removed at the
    /// end. Errors: those of [`ready`](Self::ready) and of the run.
    pub fn found(&self, loaded: &LoadedScene, desk: &Desk) -> Result<RunResult> {
        loaded.check_captors()?;
        let warnings = warnings_of(loaded)?;
        let ready = self.ready(loaded)?;
        let simulation = desk.during("photons", |progress| {
            ready.simulate(&Control { stop: desk.stop(), progress }, desk)
        })?;
        let result = RunResult::new(&simulation).with_warnings_of_scene(warnings);
        ready.finish();
        Ok(result)
    }

    fn settings(&self, of_scene: &Settings) -> Result<Settings> {
        let settings = Settings {
            estimator: self.estimator.unwrap_or(of_scene.estimator),
            photons: self.photons.or(of_scene.photons),
            seed: self.seed.unwrap_or(of_scene.seed),
            k: self.k.or(of_scene.k),
            map_photons: self.map_photons.unwrap_or(of_scene.map_photons),
            guiding: self.guiding.unwrap_or(of_scene.guiding),
            tolerance: self.tolerance.or(of_scene.tolerance),
            tolerance_limit: self.photons,
            of: self.of.clone(),
            max_time: self.max_time.or(of_scene.max_time),
            by_light: self.by_light,
            threads: self.threads.unwrap_or(of_scene.threads),
        };
        match settings.of.is_empty() || settings.tolerance.is_some() {
            true => Ok(settings),
            false => Err(Error::input(setting("of"), "no tolerance is asked for")
                .remedy(words!["add ", setting("tolerance").is("0.02")])),
        }
    }

    /// Returns the names of the settings that are given.
    fn given(&self) -> impl Iterator<Item = &'static str> {
        let all = [
            ("estimator", self.estimator.is_some()),
            ("photons", self.photons.is_some()),
            ("tolerance", self.tolerance.is_some()),
            ("of", !self.of.is_empty()),
            ("max_time", self.max_time.is_some()),
            ("k", self.k.is_some()),
            ("map_photons", self.map_photons.is_some()),
            ("guiding", self.guiding.is_some()),
            ("by_light", self.by_light),
            ("checkpoint", self.checkpoint.is_some()),
            ("threads", self.threads.is_some()),
        ];
        all.into_iter().filter(|(_, given)| *given).map(|(name, _)| name)
    }
}

impl<'a> ReadyRun<'a> {
    /// Returns where the checkpoint is.
    pub fn place(&self) -> Option<PathBuf> {
        self.checkpoint.as_ref().and_then(Checkpoint::place)
    }

    /// Runs the scene. Errors: those of the run; a checkpoint that is not of this run.
    pub fn simulate(&self, control: &Control, desk: &Desk) -> Result<Simulation<'a>> {
        let (scene, settings) = (&self.loaded.scene, &self.settings);
        let simulation = match &self.checkpoint {
            None => simulate(scene, settings, control),
            // what was traced is kept
            Some(checkpoint) => {
                desk.listening(None, || self.kept(scene, checkpoint, control, desk))
            }
        };
        simulation.map_err(|error| self.placed(error))
    }

    /// Returns the error of a run. Where a setting is the reason, its place is that which the value
    /// came from: the job, or the scene file.
    pub fn placed(&self, error: Error) -> Error {
        let given = self.job.given().find(|name| error.place() == *name);
        match given {
            Some(name) => error.at(setting(name)),
            None => self.loaded.placed(error),
        }
    }

    /// Removes the checkpoint, once the results are safe.
    pub fn finish(self) {
        if let Some(checkpoint) = self.checkpoint {
            checkpoint.remove();
        }
    }

    /// Runs the scene, or goes on with a run that `checkpoint` holds, and keeps what is done there.
    fn kept(
        &self,
        scene: &'a Scene,
        checkpoint: &Checkpoint,
        control: &Control,
        desk: &Desk,
    ) -> Result<Simulation<'a>> {
        let resumed = checkpoint.open()?;
        let path = checkpoint.path().display();
        let written = AtomicBool::new(resumed.is_some());
        let save =
            |state: RunState, arrivals: KeptArrivals| match checkpoint.write(state, arrivals) {
                Ok(()) => written.store(true, Ordering::Relaxed),
                Err(e) => desk
                    .warn(&[format!("{path}: cannot be written, so the run goes on alone: {e}")]),
            };
        let every = match self.job.checkpoint_every {
            Some(every) => every,
            None => TimeLimit::new(RunJob::USUAL_EVERY)?,
        };
        let keeper = Keeper::new(every.get(), resumed, &save);
        simulate_kept(scene, &self.settings, control, Some(&keeper)).map_err(|error| {
            match error.kind() == ErrorKind::Interrupted && written.load(Ordering::Relaxed) {
                true => Error::interrupted("run", format!("what was traced is in {path}"))
                    .remedy("the same command goes on from there"),
                false => error,
            }
        })
    }
}

/// Returns the warnings about a scene and the files that it comes from. Error: threads cannot be
/// started.
pub fn warnings_of(loaded: &LoadedScene) -> Result<Vec<String>> {
    let mut warnings = loaded.warnings.clone();
    warnings.extend(check_meshes(&loaded.scene)?);
    Ok(warnings)
}
