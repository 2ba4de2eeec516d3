//! Studies: years, calibrations, charts, and plots of years. Their arguments come as JSON, an object
//! with those that were given.

use std::{
    path::{Path, PathBuf},
    sync::{Arc, Mutex},
};

use phylux::{
    Error, Guiding, Result,
    formats::{
        FilesRead, OutputFile, SkyDivision, TableSettings, parse_readings, read_arguments,
        spec::Count,
    },
    show::{PlotJob, PlotLight, PlotStyle, PlotWhat, Width},
    studies::{
        Calibrated, CalibrationGoal, CalibrationLight, CalibrationReport, ChartRuns, Desk,
        EvenPlan, HoursOf, Listener, Vary, YearJob, calibrated, chart,
    },
    transport::{NearestCount, PhotonCount, Progress, Shard, ThreadCount, Tolerance},
};
use pyo3::prelude::*;
use serde::{Deserialize, de::DeserializeOwned};

use crate::{
    errors::spelled,
    result::Found,
    scene::Loaded,
    watched::{Watch, watched},
};

/// What is heard of a study: how far it is goes to the calling thread, and warnings are kept.
struct Heard {
    watch: Arc<Watch>,
    warnings: Mutex<Vec<String>>,
}

impl Listener for Heard {
    fn begin(&self, _: &str) {
        self.watch.begin();
    }

    fn progress(&self, progress: Progress) {
        self.watch.note(progress);
    }

    fn end(&self) {}

    fn warn(&self, warning: &str) {
        if let Ok(mut warnings) = self.warnings.lock() {
            warnings.push(warning.to_owned());
        }
    }

    fn note(&self, _: &str) {}

    fn take_output(&self) -> Result<()> {
        Err(Error::input("-", "is the standard output of a command").remedy("name a file"))
    }
}

/// Does a study. Returns what it found, and its warnings.
pub fn studied<T: Send + 'static>(
    py: Python<'_>,
    progress: Option<&Bound<'_, PyAny>>,
    work: impl FnOnce(&Desk) -> Result<T> + Send + 'static,
) -> PyResult<(T, Vec<String>)> {
    watched(py, progress, move |watch| {
        let heard = Arc::new(Heard { watch: watch.clone(), warnings: Mutex::default() });
        let found = work(&Desk::new(watch.stop.clone(), heard.clone()))?;
        let warnings = heard.warnings.lock().map(|warnings| warnings.clone());
        Ok((found, warnings.unwrap_or_default()))
    })
}

/// Reads arguments that were given as JSON.
pub fn read<T: DeserializeOwned>(json: &str) -> Result<T> {
    let value = serde_json::from_str(json).map_err(|e| Error::input("arguments", e))?;
    read_arguments(value)
}

/// Returns what is made of an argument, if it is given. The place of an error is its name.
pub fn given<N, T>(
    name: &str,
    argument: Option<N>,
    make: impl FnOnce(N) -> std::result::Result<T, String>,
) -> Result<Option<T>> {
    argument.map(make).transpose().map_err(|problem| Error::input(name, problem))
}

pub fn count<T>(number: Option<Count>, make: impl FnOnce(usize) -> Result<T>) -> Result<Option<T>> {
    number.map(|n| make(usize::try_from(n.0).unwrap_or(usize::MAX))).transpose()
}

/// How plots look.
#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
struct Style {
    width: Option<f64>,
    #[serde(default)]
    png: bool,
}

impl Style {
    fn plots(&self) -> Result<PlotStyle> {
        let width = match self.width {
            None | Some(7.0) => Width::Page,
            Some(3.5) => Width::Column,
            Some(other) => {
                let problem = format!("{other} inches");
                return Err(Error::input("width", problem).remedy("there are 3.5, 7"));
            }
        };
        Ok(PlotStyle { width, png: self.png })
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct YearArguments {
    patches: Option<Count>,
    photons: Option<Count>,
    seed: Option<Count>,
    guiding: Option<Guiding>,
    #[serde(default)]
    csv: bool,
    hours: Option<String>,
    #[serde(default)]
    results: bool,
    sun_rays: Option<Count>,
    #[serde(default)]
    keep_light: bool,
    threads: Option<Count>,
}

impl YearArguments {
    /// Checks that no setting of the light is given, where the light is that of an earlier year.
    fn check_light(&self) -> Result<()> {
        let given = [
            ("patches", self.patches.is_some()),
            ("photons", self.photons.is_some()),
            ("seed", self.seed.is_some()),
            ("guiding", self.guiding.is_some()),
            ("sun_rays", self.sun_rays.is_some()),
        ];
        match given.iter().find(|(_, given)| *given) {
            None => Ok(()),
            Some((name, _)) => Err(Error::input(name, "the light is that of an earlier year")
                .remedy("leave it out, or leave out `from_`")),
        }
    }

    fn job(
        self,
        scene: PathBuf,
        control: Option<PathBuf>,
        from: Option<PathBuf>,
        plots: PlotStyle,
    ) -> Result<YearJob> {
        if from.is_some() {
            self.check_light()?;
        }
        let hours = given("hours", self.hours.as_deref(), HoursOf::parse)?.unwrap_or_default();
        Ok(YearJob {
            scene,
            control,
            division: match self.patches {
                None | Some(Count(577)) => SkyDivision::Reinhart,
                Some(Count(145)) => SkyDivision::Tregenza,
                Some(Count(other)) => {
                    let problem = format!("{other} patches of the sky");
                    return Err(Error::input("patches", problem).remedy("there are 145, 577"));
                }
            },
            photons: self.photons.map(|n| PhotonCount::new(n.0)).transpose()?,
            seed: self.seed.map(|n| n.0),
            guiding: self.guiding,
            sun_rays: given("sun_rays", self.sun_rays, |n| YearJob::sun_rays(n.0))?,
            tables: TableSettings { hours: hours.text(), csv: self.csv, results: self.results },
            plots,
            hours,
            from,
            keep_light: self.keep_light,
            threads: count(self.threads, ThreadCount::new)?,
        })
    }
}

/// Finds a year, and writes its tables into the folder `output`, or the work of a shard, such as
/// `3/16`, into a file; with the folder `light` of an earlier year, from its light. Returns the
/// warnings.
#[pyfunction]
#[pyo3(signature = (scene, control, output, arguments, style, checkpoint=None, shard=None, light=None, progress=None))]
#[expect(clippy::too_many_arguments, reason = "files, whose names may be no text, are no JSON")]
pub fn year(
    py: Python<'_>,
    scene: PathBuf,
    control: Option<PathBuf>,
    output: PathBuf,
    arguments: String,
    style: String,
    checkpoint: Option<PathBuf>,
    shard: Option<String>,
    light: Option<PathBuf>,
    progress: Option<&Bound<'_, PyAny>>,
) -> PyResult<Vec<String>> {
    let folder = scene.parent().unwrap_or(Path::new("")).to_path_buf();
    let of_errors = folder.clone();
    let (_, warnings) = studied(py, progress, move |desk| {
        let work = || {
            let job = read::<YearArguments>(&arguments)?;
            let job = job.job(scene, control, light, read::<Style>(&style)?.plots()?)?;
            let checkpoint = checkpoint.as_deref();
            match given("shard", shard.as_deref(), Shard::parse)? {
                None => job.tables(&output, checkpoint, desk).map(|_| ()),
                Some(shard) => job.shard(&output, shard, checkpoint, desk).map(|_| ()),
            }
        };
        work().map_err(|error| {
            let own = within(&of_errors, &error.place());
            if own == error.place() { error } else { error.at(own) }
        })
    })?;
    Ok(warnings.iter().map(|warning| within(&folder, warning)).collect())
}

/// Joins the shards of a year, and writes its tables into the folder `output`. Returns the warnings.
#[pyfunction]
pub fn merged_year(
    py: Python<'_>,
    shards: Vec<PathBuf>,
    output: PathBuf,
    style: String,
) -> PyResult<Vec<String>> {
    let (_, warnings) = studied(py, None, move |desk| {
        let plots = read::<Style>(&style)?.plots()?;
        YearJob::merge(&shards, None, &output, plots, desk)
    })?;
    Ok(warnings)
}

/// Returns a text in which files that the package has written into `folder`, for a scene in memory,
/// have the names of what they stand for.
fn within(folder: &Path, text: &str) -> String {
    let path = |name: &str| folder.join(name).display().to_string();
    text.replace(&path("scene.json"), "scene")
        .replace(&path("control.json"), "control")
        .replace(&path(""), "")
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ChartArguments {
    photons: Option<Count>,
    seed: Option<Count>,
    seeds: Option<Count>,
    k: Option<Vec<Count>>,
    threads: Option<Count>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct CalibrationArguments {
    even: Option<String>,
    mean: Option<f64>,
    minimum: Option<f64>,
    band: Option<String>,
    model: Option<String>,
    prior: Option<f64>,
    #[serde(default)]
    groups: Vec<String>,
    #[serde(default)]
    vary: Vec<(String, f64, f64)>,
    photons: Option<Count>,
    seed: Option<Count>,
    tolerance: Option<f64>,
    guiding: Option<Guiding>,
    threads: Option<Count>,
}

impl CalibrationArguments {
    /// Returns what is to be found, from readings (the bytes of a CSV file, and its name) if there are
    /// any.
    fn goal(&self, readings: Option<(Vec<u8>, PathBuf)>) -> Result<CalibrationGoal> {
        let groups = self.groups.clone();
        let Some((bytes, file)) = readings else {
            return Ok(CalibrationGoal::Even(EvenPlan {
                captors: self.even.clone().unwrap_or_default(),
                band: self.band.clone(),
                mean: given("mean", self.mean, CalibrationGoal::irradiance)?,
                minimum: given("minimum", self.minimum, CalibrationGoal::irradiance)?,
                groups,
            }));
        };
        let vary = |(pointer, from, to): &(String, f64, f64)| {
            Vary::new(pointer, *from, *to)
                .map_err(|problem| Error::input(format!("vary/{pointer}"), problem))
        };
        Ok(CalibrationGoal::Readings {
            rows: parse_readings(&bytes, &file)?,
            file,
            model: given("model", self.model.as_deref(), CalibrationGoal::model)?.flatten(),
            prior: given("prior", self.prior, CalibrationGoal::prior)?,
            groups,
            vary: self.vary.iter().map(vary).collect::<Result<_>>()?,
        })
    }

    fn light(&self, result: Option<phylux::RunResult>) -> Result<CalibrationLight> {
        Ok(match result {
            Some(result) => CalibrationLight::Found(Box::new(result), "result".into()),
            None => CalibrationLight::Traced {
                photons: self.photons.map(|n| PhotonCount::new(n.0)).transpose()?,
                seed: self.seed.map(|n| n.0),
                tolerance: self.tolerance.map(Tolerance::new).transpose()?,
                guiding: self.guiding,
                threads: count(self.threads, ThreadCount::new)?,
            },
        })
    }
}

/// Calibrates a scene by readings (the bytes of a CSV file, and its name), or lights captors
/// evenly. Returns the scene and the report, as JSON, and the warnings.
#[pyfunction]
#[pyo3(signature = (scene, arguments, readings, result, progress=None))]
pub fn calibrate(
    py: Python<'_>,
    scene: &Bound<'_, Loaded>,
    arguments: String,
    readings: Option<(Vec<u8>, PathBuf)>,
    result: Option<&Found>,
    progress: Option<&Bound<'_, PyAny>>,
) -> PyResult<(String, String, Vec<String>)> {
    let (source, loaded) = (scene.get().source.clone(), scene.get().loaded.clone());
    let result = result.map(|found| found.result.clone());
    let ((scene, report), warnings) = studied(py, progress, move |desk| {
        let arguments: CalibrationArguments = read(&arguments)?;
        let (goal, light) = (arguments.goal(readings)?, arguments.light(result)?);
        loaded.check_captors()?;
        desk.warn(&loaded.warnings);
        let folder = source.path().parent().unwrap_or(Path::new("")).to_path_buf();
        let Calibrated { scene, report, warnings } =
            calibrated(&source, &loaded, &goal, &light, &folder, desk)?;
        desk.warn(&warnings);
        let report = match report {
            CalibrationReport::Readings(report) => serde_json::to_string(&report),
            CalibrationReport::Even(report, _) => serde_json::to_string(&report),
        };
        Ok((scene.to_string(), report.map_err(|e| Error::run("calibrate", e))?))
    })?;
    Ok((scene, report, warnings))
}

/// Charts error against cost in a scene, and writes the charts into a folder. Returns the warnings.
#[pyfunction]
#[pyo3(signature = (scene, output, truth, arguments, style, progress=None))]
pub fn charts(
    py: Python<'_>,
    scene: &Bound<'_, Loaded>,
    output: PathBuf,
    truth: Option<PathBuf>,
    arguments: String,
    style: String,
    progress: Option<&Bound<'_, PyAny>>,
) -> PyResult<Vec<String>> {
    let source = scene.get().source.clone();
    let (_, warnings) = studied(py, progress, move |desk| {
        let given: ChartArguments = read(&arguments)?;
        let nearest =
            |k: Count| Ok(count(Some(k), NearestCount::new)?.map_or(0, NearestCount::get));
        let k = given.k.map(|all| all.into_iter().map(nearest).collect::<Result<Vec<_>>>());
        let runs = ChartRuns::Scene {
            source,
            truth,
            photons: given.photons.map(|n| PhotonCount::new(n.0)).transpose()?,
            seed: given.seed.map(|n| n.0),
            seeds: given.seeds.map_or(ChartRuns::SEEDS, |n| n.0),
            k: k.transpose()?.unwrap_or_else(|| ChartRuns::NEAREST.to_vec()),
            threads: count(given.threads, ThreadCount::new)?,
        };
        chart(&runs, &output, read::<Style>(&style)?.plots()?, desk)
    })?;
    Ok(warnings)
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct PlotArguments {
    show: Option<String>,
    band: Option<String>,
    #[serde(default)]
    captors: Vec<String>,
    quantity: Option<String>,
    day: Option<String>,
    month: Option<String>,
    range: Option<(f64, f64)>,
    width: Option<f64>,
}

/// Draws the year in a folder into the file `output`. Returns what is to be known of the plot.
#[pyfunction]
pub fn plot(
    py: Python<'_>,
    folder: PathBuf,
    output: PathBuf,
    arguments: String,
) -> PyResult<Vec<String>> {
    let (notes, _) = studied(py, None, move |desk| {
        let given: PlotArguments = read(&arguments)?;
        let png = PlotStyle::is_png(&output)?;
        let style = Style { width: given.width, png }.plots()?;
        let job = PlotJob {
            results: folder,
            show: named("show", given.show, &PlotWhat::ALL)?,
            band: given.band,
            captors: given.captors,
            quantity: named("quantity", given.quantity, &PlotLight::ALL)?,
            day: given.day,
            month: given.month,
            range: given.range,
        };
        let file: OutputFile = desk.file(&output)?;
        let (plot, files) = job.plot()?;
        let drawn = style.plot(&plot)?;
        file.write(&FilesRead::new(&files), |writer| writer.write_all(&drawn))?;
        Ok(spelled(&plot.notes))
    })?;
    Ok(notes)
}

/// Returns one of the choices of the library by its name.
pub fn named<T: Copy>(place: &str, name: Option<String>, all: &[(&str, T)]) -> Result<Option<T>> {
    let Some(name) = name else { return Ok(None) };
    let found = all.iter().find(|(known, _)| *known == name);
    let names = || all.iter().map(|(known, _)| *known).collect::<Vec<_>>().join(", ");
    match found {
        Some((_, choice)) => Ok(Some(*choice)),
        None => {
            Err(Error::input(place, format!("no `{name}`"))
                .remedy(format!("there are {}", names())))
        }
    }
}
