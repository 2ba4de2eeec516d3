//! A calibration from its beginning: traces the scene, or takes results of it, and finds the powers.

use std::path::{Path, PathBuf};

use serde_json::Value;

use super::{
    CalibrationPlan, calibrate, check_captors,
    even::{EvenPlan, even},
    numbers::{Numbers, Vary},
    powers::calibrated_scene,
    vary::{Runs, search},
};
use crate::desk::Desk;
use phylux_core::{
    error::{Error, Result, setting},
    transport::{
        settings::{
            Checked, Estimator, Guiding, NearestCount, PhotonCount, Settings, ThreadCount,
            Tolerance,
        },
        simulate::{Control, simulate},
    },
    words,
};
use phylux_files::{
    measured_csv::MeasuredRow,
    scene_file::{LoadedScene, SceneSource},
};
use phylux_results::{
    calibration::{Calibration, EvenPowers, Model},
    result::RunResult,
};

/// What a calibration is to find.
#[derive(Clone, Debug)]
pub enum CalibrationGoal {
    /// The powers, and other numbers of the scene, that explain readings best.
    Readings {
        /// The readings.
        rows: Vec<MeasuredRow>,
        /// Their file, which errors name.
        file: PathBuf,
        /// The model; `None` to choose it.
        model: Option<Model>,
        /// Relative standard deviation of the prior; `None` without one.
        prior: Option<f64>,
        /// Patterns of names of lights that share their factors.
        groups: Vec<String>,
        /// Other numbers to find.
        vary: Vec<Vary>,
    },
    /// The powers that light captors evenly.
    Even(EvenPlan),
}

/// Where the light of the scene comes from.
#[derive(Clone, Debug)]
pub enum CalibrationLight {
    /// From a result of the scene, by light, with the name that errors call it by.
    Found(Box<RunResult>, String),
    /// From runs with these settings; where one is not given, the scene's holds.
    Traced {
        /// Photons of each run.
        photons: Option<PhotonCount>,
        /// Seed of the random numbers.
        seed: Option<u64>,
        /// Relative standard error that every captor is to have.
        tolerance: Option<Tolerance>,
        /// What guides the photons.
        guiding: Option<Guiding>,
        /// Number of threads.
        threads: Option<ThreadCount>,
    },
}

impl CalibrationGoal {
    /// Reads the name of a model; `auto`, which is `None`, stands for the choice of one. Error: there
    /// is no such model.
    pub fn model(name: &str) -> Checked<Option<Model>> {
        let known = Model::ALL.into_iter().find(|model| model.name() == name);
        match (name, known) {
            ("auto", _) => Ok(None),
            (_, Some(model)) => Ok(Some(model)),
            _ => Err("must be auto, common, bands, lamps or product".into()),
        }
    }

    /// Checks a relative standard deviation of the prior. Error: it is not from 1e-6 to 1e6.
    pub fn prior(deviation: f64) -> Checked<f64> {
        match (1e-6..=1e6).contains(&deviation) {
            true => Ok(deviation),
            false => Err("must be `none`, or a number from 1e-6 to 1e6 (20 % is 0.2)".into()),
        }
    }

    /// Checks an irradiance that captors are to have. Error: it is not from 1e-30 to 1e30.
    pub fn irradiance(value: f64) -> Checked<f64> {
        match (1e-30..=1e30).contains(&value) {
            true => Ok(value),
            false => Err("must be a number above 0, in the scene's unit of irradiance".into()),
        }
    }
}

/// What a calibration has found.
#[derive(Debug)]
pub enum CalibrationReport {
    /// From readings.
    Readings(Box<Calibration>),
    /// Even light, and the result that it is mixed from.
    Even(Box<EvenPowers>, Box<RunResult>),
}

/// The calibrated scene, and how it was found.
#[derive(Debug)]
pub struct Calibrated {
    /// The JSON of the scene.
    pub scene: Value,
    /// What was found.
    pub report: CalibrationReport,
    /// Warnings of the calibration itself; those of the scene and its files stand before them in the
    /// report alone.
    pub warnings: Vec<String>,
}

/// Calibrates a scene, `loaded` from its `source`, for a scene file in `folder`. Errors: those of
/// the runs, of [`calibrate`], [`search`] and [`even`]; a result of another scene.
pub fn calibrated(
    source: &SceneSource,
    loaded: &LoadedScene,
    goal: &CalibrationGoal,
    light: &CalibrationLight,
    folder: &Path,
    desk: &Desk,
) -> Result<Calibrated> {
    let of_scene = loaded.warnings.clone();
    let given = source.document();
    let (scene, report, warnings) = match goal {
        CalibrationGoal::Even(plan) => {
            let result = light.of(loaded, desk)?;
            let mut found = even(&result, loaded.scene.watts(), plan)?;
            let powers = &found.factors;
            let scene =
                calibrated_scene(given.clone(), source.path(), loaded, powers, true, folder)?;
            let own = found.warnings.clone();
            found.warnings.splice(0..0, of_scene);
            (scene, CalibrationReport::Even(Box::new(found), Box::new(result)), own)
        }
        CalibrationGoal::Readings { rows, file, model, prior, groups, vary } => {
            check_captors(&loaded.scene, rows, file)?;
            let metres = loaded.unit.metres();
            let plan =
                CalibrationPlan { model: *model, prior: *prior, groups: groups.clone(), metres };
            let (document, varied, mut found) = if vary.is_empty() {
                let result = light.of(loaded, desk)?;
                (given.clone(), None, calibrate(&result, rows, file, &plan)?)
            } else {
                let name = source.path().display().to_string();
                let numbers = Numbers::new(&name, given, vary, prior.is_some())?;
                let runs = Runs {
                    load: &|document| source.load_changed(document.clone()),
                    run: &|loaded| light.of(loaded, desk),
                };
                let found = search(&numbers, (rows, file), &plan, &runs)?;
                (found.document, Some(found.loaded), found.calibration)
            };
            let powers = &found.factors;
            let loaded = varied.as_ref().unwrap_or(loaded);
            let scene = calibrated_scene(document, source.path(), loaded, powers, false, folder)?;
            let own = found.warnings.clone();
            found.warnings.splice(0..0, of_scene);
            (scene, CalibrationReport::Readings(Box::new(found)), own)
        }
    };
    Ok(Calibrated { scene, report, warnings })
}

impl CalibrationLight {
    /// Returns the light of a scene, by light.
    fn of(&self, loaded: &LoadedScene, desk: &Desk) -> Result<RunResult> {
        let (photons, seed, tolerance, guiding, threads) = match self {
            Self::Found(result, name) => return of_this(result, name, loaded),
            Self::Traced { photons, seed, tolerance, guiding, threads } => {
                (photons, seed, tolerance, guiding, threads)
            }
        };
        let usual = &loaded.settings;
        let settings = Settings {
            estimator: Estimator::Photons,
            photons: photons.or(usual.photons),
            seed: seed.unwrap_or(usual.seed),
            k: Some(NearestCount::NONE),
            guiding: guiding.unwrap_or(usual.guiding),
            tolerance: tolerance.or(usual.tolerance),
            tolerance_limit: *photons,
            by_light: true,
            threads: threads.unwrap_or(usual.threads),
            ..usual.clone()
        };
        let simulation = desk.during("photons", |progress| {
            simulate(&loaded.scene, &settings, &Control { stop: desk.stop(), progress })
        });
        Ok(RunResult::new(&simulation?))
    }
}

/// Returns the result if it is one of this scene. Error: it is not.
fn of_this(result: &RunResult, name: &str, loaded: &LoadedScene) -> Result<RunResult> {
    let lights = result.energy.by_light.iter().flat_map(|lights| lights.keys());
    let same_lights = lights.eq(loaded.scene.lights().iter().map(|light| &light.name));
    let bands = result.bands.iter().map(|band| band.name.as_str());
    let same = same_lights || result.energy.by_light.is_none();
    match same && bands.eq(loaded.scene.band_names()) {
        true => Ok(result.clone()),
        false => Err(Error::input(name, "has other lights or bands than the scene")
            .remedy(words!["run the scene again with ", setting("by_light").on()])),
    }
}
