//! `phylux calibrate`: fits the powers of the lamps to the readings of an instrument.

use std::{
    fmt::Write,
    path::{Path, PathBuf},
};

use clap::Args;
use serde::Serialize;
use serde_json::Value;

use super::{
    interrupt::{Interrupt, STANDARD_OUTPUT},
    outputs::check_places,
    run,
    summary::{SHOWN_BANDS, short},
    table::Table,
    terminal,
};
use phylux_core::{
    error::{Error, Result},
    transport::{
        settings::{
            Checked, Estimator, Guiding, NearestCount, PhotonCount, Settings, ThreadCount,
            Tolerance,
        },
        simulate::{Control, Progress, simulate},
    },
};
use phylux_files::{
    calibration_file,
    input::read_bytes,
    json,
    measured_csv::{self, MeasuredRow},
    output::{FilesRead, NOT_OURS, OutputFile, folder_of},
    result_file::{read_json, write_lines},
    scene_file::{self, LoadedScene},
};
use phylux_results::{
    calibration::{Calibration, EvenPowers, Lit, Model, Varied},
    result::RunResult,
};
use phylux_studies::calibrate::{
    CalibrationPlan, EvenPlan, Found, Numbers, Runs, Vary, calibrate, calibrated_scene,
    check_captors, even, search,
};

/// The most lamps that are listed.
const LISTED: usize = 20;

#[derive(Args)]
pub(super) struct Arguments {
    /// Scene file (JSON)
    scene: PathBuf,
    /// Table of readings (CSV): captor (or x,y,z), band, value (empty where it is to be predicted)
    /// and, if wanted, sd, face, use (fit or test), block
    #[arg(required_unless_present = "even")]
    measured: Option<PathBuf>,
    /// In place of readings: find the powers that light these captors most evenly; a pattern of
    /// groups or of captors, as in "bench*"
    #[arg(long, value_name = "PATTERN", conflicts_with_all = ["measured", "model", "prior", "vary"])]
    even: Option<String>,
    /// With --even: the mean irradiance to reach [default: the present one]
    #[arg(long, value_name = "VALUE", requires = "even", value_parser = irradiance, allow_hyphen_values = true)]
    mean: Option<f64>,
    /// With --even: bring each captor at least this irradiance, with the least power
    #[arg(long, value_name = "VALUE", requires = "even", conflicts_with = "mean", value_parser = irradiance, allow_hyphen_values = true)]
    minimum: Option<f64>,
    /// With --even: the band or sum that counts [default: the only band, or the first sum]
    #[arg(long, value_name = "NAME", requires = "even")]
    band: Option<String>,
    /// File for the scene with the calibrated powers. What was found goes beside it: into
    /// calibration.json, or beside another NAME.json into NAME-calibration.json
    #[arg(short, long, value_name = "FILE", default_value = "calibrated.json")]
    output: PathBuf,
    /// Use these results of `phylux run --by-light` of the scene, and trace nothing
    #[arg(long, value_name = "FILE", conflicts_with_all = ["photons", "seed", "tolerance", "guiding", "threads", "vary"])]
    results: Option<PathBuf>,
    /// How the factors may differ: auto takes the simplest of the other models that predicts
    /// left-out blocks of readings as well as the best one does
    #[arg(long, value_name = "auto|common|bands|lamps|product", value_parser = model, default_value = "auto")]
    model: Chosen,
    /// Relative standard deviation of the lamps' factors about the common factor, or `none`
    #[arg(long, value_name = "FRACTION", value_parser = prior, allow_hyphen_values = true, default_value = "0.2")]
    prior: Prior,
    /// Lights that share their factors, by a pattern of their names, as in "row 1*"; can be given
    /// several times
    #[arg(long, value_name = "PATTERN")]
    group: Vec<String>,
    /// Also fit a number of the scene: its place as a JSON pointer and its range, as in
    /// /materials/wall/reflectance=0.7:0.85; up to 30 reflectances and transmittances together, in
    /// some 3 runs; of other numbers one (6 runs) or two (26 runs)
    #[arg(long, value_name = "PLACE=FROM:TO", value_parser = Vary::parse)]
    vary: Vec<Vary>,
    /// Photons to trace in each run [default: the scene's]
    #[arg(long, value_name = "N", value_parser = run::photons, allow_hyphen_values = true)]
    photons: Option<PhotonCount>,
    /// Seed of the random numbers [default: the scene's]
    #[arg(long, value_name = "N", value_parser = run::count, allow_hyphen_values = true)]
    seed: Option<u64>,
    /// Trace until the relative standard error of every captor is at most this
    #[arg(long, value_name = "FRACTION", value_parser = run::tolerance, allow_hyphen_values = true)]
    tolerance: Option<Tolerance>,
    /// What guides photons to sensors that light hardly reaches [default: the scene's]
    #[arg(long, value_name = "NAME", value_parser = super::choices::guiding())]
    guiding: Option<Guiding>,
    /// No longer an option: --guiding has taken its place
    #[arg(long, hide = true, value_name = "N", value_parser = run::splitting)]
    splitting: Option<u64>,
    /// Threads; 0 takes all processors. The results do not depend on it
    #[arg(long, value_name = "N", value_parser = run::threads, allow_hyphen_values = true)]
    threads: Option<ThreadCount>,
}

/// The model that is asked for; `None` for `auto`.
#[derive(Clone, Copy, Debug)]
struct Chosen(Option<Model>);

fn model(text: &str) -> Checked<Chosen> {
    let known = Model::ALL.into_iter().find(|model| model.name() == text);
    match (text, known) {
        ("auto", _) => Ok(Chosen(None)),
        (_, Some(model)) => Ok(Chosen(Some(model))),
        _ => Err("must be auto, common, bands, lamps or product".into()),
    }
}

fn irradiance(text: &str) -> Checked<f64> {
    match text.parse::<f64>() {
        Ok(value) if (1e-30..=1e30).contains(&value) => Ok(value),
        _ => Err("must be a number above 0, in the scene's unit of irradiance".into()),
    }
}

/// Relative standard deviation of the prior; `None` without a prior.
#[derive(Clone, Copy, Debug)]
struct Prior(Option<f64>);

fn prior(text: &str) -> Checked<Prior> {
    if text == "none" {
        return Ok(Prior(None));
    }
    match text.parse::<f64>() {
        Ok(prior) if (1e-6..=1e6).contains(&prior) => Ok(Prior(Some(prior))),
        _ => Err("must be `none`, or a number from 1e-6 to 1e6 (20 % is 0.2)".into()),
    }
}

pub(super) fn run(arguments: &Arguments) -> Result<()> {
    let interrupt = Interrupt::install()?;
    let scene_output = interrupt.file(&arguments.output)?;
    let folder = folder_of(&arguments.output);
    let report_path = report_beside(&arguments.output);
    let report = interrupt.file(&report_path)?;
    let places = [&scene_output, &report].map(|file| file.place().map(Path::to_path_buf));
    let places: Vec<PathBuf> = places.into_iter().flatten().collect();
    check_places(&places, &FilesRead::default())?;
    if report_path.is_file() && calibration_file::read(&report_path).is_err() {
        return Err(Error::input(report_path.display(), NOT_OURS)
            .remedy("move it away, or write into another folder"));
    }

    let path = &arguments.scene;
    let bytes = read_bytes(path)
        .map_err(|why| Error::input(path.display(), why).remedy("name a scene file (JSON)"))?;
    let document = json::parse(&path.display().to_string(), &bytes)?;
    let loaded = super::progress::during("reading the scene", || scene_file::parse(&bytes, path))?;
    loaded.check_captors()?;
    let read = loaded.files.iter().chain(&arguments.measured).chain(&arguments.results);
    let read = FilesRead::new(read);
    check_places(&places, &read)?;
    terminal::warn(&loaded.warnings);
    let outputs = Outputs { scene: scene_output, report, report_path, folder, read };
    let Some(measured) = &arguments.measured else {
        return lit_evenly(arguments, document, &loaded, outputs, &interrupt);
    };
    let bytes = read_bytes(measured).map_err(|why| Error::unreadable(measured.display(), why))?;
    let rows = measured_csv::parse(&bytes, measured)?;
    check_captors(&loaded.scene, &rows, measured)?;

    let plan = CalibrationPlan {
        model: arguments.model.0,
        prior: arguments.prior.0,
        groups: arguments.group.clone(),
        metres: loaded.unit.metres(),
    };
    let (document, loaded, mut calibration) = match &arguments.vary[..] {
        [] => {
            let result = match &arguments.results {
                Some(path) => results_of(path, &loaded)?,
                None => trace(arguments, &loaded, &interrupt)?,
            };
            let calibration = calibrate(&result, &rows, measured, &plan)?;
            (document, loaded, calibration)
        }
        _ => {
            let found = vary(arguments, measured, &document, &rows, &plan, &interrupt)?;
            (found.document, found.loaded, found.calibration)
        }
    };
    let folder = &outputs.folder;
    let scene = calibrated_scene(document, path, &loaded, &calibration.factors, false, folder)?;
    interrupt.writing();
    // those of the scene and its files have been said
    let own = calibration.warnings.clone();
    calibration.warnings.splice(0..0, loaded.warnings.iter().cloned());
    let wrote = outputs.write(arguments, &scene, &calibration)?;
    terminal::warn(&own);
    terminal::print(&(describe(&calibration) + &wrote))
}

/// The two files that the command writes.
struct Outputs {
    scene: OutputFile,
    report: OutputFile,
    report_path: PathBuf,
    folder: PathBuf,
    read: FilesRead,
}

impl Outputs {
    /// Writes both, and returns words about them.
    fn write(
        self,
        arguments: &Arguments,
        scene: &Value,
        report: &impl Serialize,
    ) -> Result<String> {
        let written = self.scene.complete(&self.read, |writer| {
            serde_json::to_writer_pretty(&mut *writer, scene)?;
            writer.write_all(b"\n")
        })?;
        self.report.complete(&self.read, |writer| write_lines(report, writer))?.put()?;
        written.put()?;
        let (scene, report) = (arguments.output.display(), self.report_path.display());
        Ok(format!("\nwrote {scene} and {report}\n"))
    }
}

/// Finds the powers that light captors evenly, and writes the scene with them.
fn lit_evenly(
    arguments: &Arguments,
    document: Value,
    loaded: &LoadedScene,
    outputs: Outputs,
    interrupt: &Interrupt,
) -> Result<()> {
    let plan = EvenPlan {
        captors: arguments.even.clone().unwrap_or_default(),
        band: arguments.band.clone(),
        mean: arguments.mean,
        minimum: arguments.minimum,
        groups: arguments.group.clone(),
    };
    let result = match &arguments.results {
        Some(path) => results_of(path, loaded)?,
        None => trace(arguments, loaded, interrupt)?,
    };
    let mut found = even(&result, loaded.scene.watts(), &plan)?;
    let path = &arguments.scene;
    let scene = calibrated_scene(document, path, loaded, &found.factors, true, &outputs.folder)?;
    interrupt.writing();
    let own = found.warnings.clone();
    found.warnings.splice(0..0, loaded.warnings.iter().cloned());
    let wrote = outputs.write(arguments, &scene, &found)?;
    terminal::warn(&own);
    terminal::print(&(describe_even(&found, &result) + &wrote))
}

/// Returns the factors, and how evenly the captors are lit before and after, as tables.
fn describe_even(found: &EvenPowers, result: &RunResult) -> String {
    let band = result.bands.iter().position(|band| band.name == found.band).unwrap_or(0);
    let [_, irradiance] = result.units(band);
    let mut text = format!(
        "{}: {} captors of `{}`, {}\n",
        found.scene, found.count, found.captors, found.band
    );
    let write = |text: &mut String, table: &Table| {
        text.push('\n');
        table.write(text, terminal::width(), terminal::is_full());
    };
    let mut table = Table::new("factors on the power of lights", [""], "");
    for (name, factors) in found.factors.iter().take(terminal::shown(LISTED)) {
        let factor = factors.first().copied().unwrap_or(1.0);
        table.row(format!("  {name}"), [format!("{factor:.4}")], "");
    }
    write(&mut text, &table);
    text.push_str(&terminal::more(found.factors.len(), LISTED));
    let with = |value: f64, error: Option<f64>| match error {
        Some(error) => format!("{} ± {}", short(value), short(error)),
        None => short(value),
    };
    let share = |value: Option<f64>, error| value.map_or("-".into(), |value| with(value, error));
    let both = |of: &dyn Fn(&Lit) -> String| [of(&found.before), of(&found.after)];
    let mut table = Table::new("", ["before", "after"], "");
    for (title, [before, after]) in [
        (format!("mean, {irradiance}"), both(&|lit| with(lit.mean, lit.mean_se))),
        (format!("least, {irradiance}"), both(&|lit| with(lit.min, lit.min_se))),
        ("coefficient of variation".into(), both(&|lit| share(lit.cv, lit.cv_se))),
        (format!("power of all lights, {}", result.unit.flux), both(&|lit| short(lit.power))),
        ("electricity, W".into(), both(&|lit| lit.watts.map_or("-".into(), short))),
    ] {
        if before != "-" || after != "-" {
            table.row(title, [before, after], "");
        }
    }
    write(&mut text, &table);
    text
}

/// Returns the path of what was found, beside the scene: it is named after the scene, so that a
/// second calibration into the same folder does not replace the first.
fn report_beside(scene: &Path) -> PathBuf {
    let name = match scene.file_stem().map(|stem| stem.to_string_lossy()) {
        None => "calibration.json".into(),
        Some(stem) if stem == "calibrated" || scene == Path::new(STANDARD_OUTPUT) => {
            "calibration.json".into()
        }
        Some(stem) => format!("{stem}-calibration.json"),
    };
    folder_of(scene).join(name)
}

/// Reads the results at `path`. Error: they are not of this scene.
fn results_of(path: &Path, loaded: &LoadedScene) -> Result<RunResult> {
    let result = read_json(path)?;
    let lights = result.energy.by_light.iter().flat_map(|lights| lights.keys());
    let same_lights = lights.eq(loaded.scene.lights().iter().map(|light| &light.name));
    let bands = result.bands.iter().map(|band| band.name.as_str());
    let same = same_lights || result.energy.by_light.is_none();
    match same && bands.eq(loaded.scene.band_names()) {
        true => Ok(result),
        false => Err(Error::input(path.display(), "has other lights or bands than the scene")
            .remedy("run the scene again with --by-light")),
    }
}

/// Runs the scene with photons, and returns the results by light.
fn trace(arguments: &Arguments, loaded: &LoadedScene, interrupt: &Interrupt) -> Result<RunResult> {
    let usual = &loaded.settings;
    let settings = Settings {
        estimator: Estimator::Photons,
        photons: arguments.photons.or(usual.photons),
        seed: arguments.seed.unwrap_or(usual.seed),
        k: Some(NearestCount::NONE),
        guiding: arguments.guiding.unwrap_or(usual.guiding),
        tolerance: arguments.tolerance.or(usual.tolerance),
        tolerance_limit: arguments.photons,
        by_light: true,
        threads: arguments.threads.unwrap_or(usual.threads),
        ..usual.clone()
    };
    let bar = super::progress::terminal_bar("{elapsed} {human_pos} photons, {speed}");
    let progress = |progress: Progress| super::progress::show(&bar, progress);
    let control = Control { stop: interrupt.stop(), progress: &progress };
    let simulation = simulate(&loaded.scene, &settings, &control);
    bar.finish_and_clear();
    let simulation = simulation?;
    Ok(RunResult::new(&simulation))
}

/// Finds the values of the varied numbers that explain the readings best.
fn vary(
    arguments: &Arguments,
    measured: &Path,
    document: &Value,
    rows: &[MeasuredRow],
    plan: &CalibrationPlan,
    interrupt: &Interrupt,
) -> Result<Found> {
    let path = &arguments.scene;
    let name = path.display().to_string();
    let numbers = Numbers::new(&name, document, &arguments.vary, plan.prior.is_some())?;
    let runs = Runs {
        load: &|document| scene_file::load_value(document.clone(), path, &read_bytes, None),
        run: &|loaded| trace(arguments, loaded, interrupt),
    };
    search(&numbers, (rows, measured), plan, &runs)
}

/// Returns the factors, and how well they predict readings, as tables.
fn describe(found: &Calibration) -> String {
    let mut text = format!("{}: model {}", found.scene, found.model.name());
    text += &found.prior.map_or(", no prior".into(), |prior| format!(", prior {prior}"));
    text += &found.runs.map_or("\n".into(), |runs| format!(", {runs} runs\n"));
    for Varied { place, from, to, given, value, standard_error } in &found.varied {
        let error = standard_error.map_or(String::new(), |error| format!(" ± {error:.4}"));
        let _ = writeln!(
            text,
            "  {place}: {value:.4}{error} (the scene has {}; tried from {} to {})",
            short(*given),
            short(*from),
            short(*to)
        );
    }
    let most = terminal::shown(SHOWN_BANDS);
    let write = |text: &mut String, table: &Table| {
        text.push('\n');
        table.write(text, terminal::width(), terminal::is_full());
    };
    let names = || found.bands.iter().take(most).cloned();
    let mut table = Table::new("factors on the power of lights", names(), "");
    for (name, factors) in found.factors.iter().take(terminal::shown(LISTED)) {
        let errors = &found.factors_se[name];
        let cell = |b: usize| match errors[b] {
            Some(error) => format!("{:.3} ± {:.3}", factors[b], error),
            None => format!("{:.3}", factors[b]),
        };
        table.row(format!("  {name}"), (0..names().count()).map(cell), "");
    }
    write(&mut text, &table);
    text.push_str(&terminal::more(found.factors.len(), LISTED));
    let measured = found.measured_bands.iter().take(most).cloned();
    let mut table = Table::new("RMSE / mean reading, %", measured, "");
    let mut percent = |title: &str, values: &[Option<f64>]| {
        let cell = |value: &Option<f64>| value.map_or("-".into(), |v| format!("{:.1}", 100.0 * v));
        table.row(title, values.iter().take(most).map(cell), "");
    };
    percent("  of the fitted readings", &found.fit_rmse);
    for model in &found.models {
        let title = format!("  left out in blocks, {} ({})", model.model.name(), model.numbers);
        percent(&title, &model.blocked_rmse);
    }
    percent("  left out, slope and intercept", &found.slope_intercept.blocked_rmse);
    if found.test_inside.is_some() {
        percent("  of the test readings", &found.test_rmse);
        percent("    by slope and intercept", &found.slope_intercept.test_rmse);
    }
    write(&mut text, &table);
    if let Some(inside) = found.test_inside {
        let tests = found.readings.iter().filter(|reading| reading.purpose == "test").count();
        let share = short(100.0 * inside);
        let inside = "test readings lie in their 95 % intervals";
        let _ = writeln!(text, "\n{share} % of {tests} {inside}");
    }
    predictions(&mut text, found);
    let _ = writeln!(
        text,
        "\nThe sensor's own scale, often 5 % uncertain, is common to all readings: it is in the factors, not in \
        their errors."
    );
    text
}

/// Writes the readings that are predicted, with their intervals.
fn predictions(text: &mut String, found: &Calibration) {
    let predicted: Vec<_> =
        found.readings.iter().filter(|reading| reading.purpose == "predict").collect();
    if predicted.is_empty() {
        return;
    }
    let _ = writeln!(text, "\n{:<40}{:>12}{:>28}", "predicted readings", "", "95 % interval");
    for reading in predicted.iter().take(LISTED) {
        let back = if reading.face == "back" { ", back" } else { "" };
        let title = format!("  {}{back}, {}", reading.captor, reading.band);
        let [low, high] = reading.interval.map(short);
        let interval = format!("{low} to {high}");
        let _ = writeln!(text, "{title:<40}{:>12}{interval:>28}", short(reading.calibrated));
    }
    if predicted.len() > LISTED {
        let _ = writeln!(text, "  and {} more, in the file", predicted.len() - LISTED);
    }
}
