//! `phylux calibrate`: fits the powers of the lamps to the readings of an instrument.

use std::{
    fmt::Write,
    path::{Path, PathBuf},
};

use clap::Args;
use serde::Serialize;
use serde_json::Value;

use super::{interrupt, outputs::check_places, run, terminal};
use phylux_core::{
    error::{Error, Result},
    transport::settings::{Checked, Guiding, PhotonCount, ThreadCount, Tolerance},
};
use phylux_files::{
    calibration_file,
    input::read_bytes,
    measured_csv,
    output::{FilesRead, NOT_OURS, OutputFile, folder_of},
    result_file::{read_json, write_lines},
    scene_file::SceneSource,
};
use phylux_results::{
    calibration::{Calibration, EvenPowers, Lit, Model, Varied},
    result::RunResult,
};
use phylux_studies::{
    calibrate::{
        EvenPlan, Vary,
        job::{CalibrationGoal, CalibrationLight, CalibrationReport, calibrated},
    },
    desk::STANDARD_OUTPUT,
    text::{short, summary::SHOWN_BANDS, table::Table, with_error},
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
    #[arg(long, value_name = "VALUE", requires = "even", value_parser = irradiance)]
    mean: Option<f64>,
    /// With --even: bring each captor at least this irradiance, with the least power
    #[arg(long, value_name = "VALUE", requires = "even", conflicts_with = "mean", value_parser = irradiance)]
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
    #[arg(long, value_name = "FRACTION", value_parser = prior, default_value = "0.2")]
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
    #[arg(long, value_name = "N", value_parser = run::photons)]
    photons: Option<PhotonCount>,
    /// Seed of the random numbers [default: the scene's]
    #[arg(long, value_name = "N", value_parser = run::count)]
    seed: Option<u64>,
    /// Trace until the relative standard error of every captor is at most this
    #[arg(long, value_name = "FRACTION", value_parser = run::tolerance)]
    tolerance: Option<Tolerance>,
    /// What guides photons to sensors that light hardly reaches [default: the scene's]
    #[arg(long, value_name = "NAME", value_parser = super::choices::guiding())]
    guiding: Option<Guiding>,
    /// No longer an option: --guiding has taken its place
    #[arg(long, hide = true, value_name = "N", value_parser = run::splitting)]
    splitting: Option<u64>,
    /// Threads; 0 takes all processors. The results do not depend on it
    #[arg(long, value_name = "N", value_parser = run::threads)]
    threads: Option<ThreadCount>,
}

/// The model that is asked for; `None` for `auto`.
#[derive(Clone, Copy, Debug)]
struct Chosen(Option<Model>);

fn model(text: &str) -> Checked<Chosen> {
    CalibrationGoal::model(text).map(Chosen)
}

fn irradiance(text: &str) -> Checked<f64> {
    // what is no number is none above 0
    CalibrationGoal::irradiance(text.parse().unwrap_or(f64::NAN))
}

/// Relative standard deviation of the prior; `None` without a prior.
#[derive(Clone, Copy, Debug)]
struct Prior(Option<f64>);

fn prior(text: &str) -> Checked<Prior> {
    match text {
        "none" => Ok(Prior(None)),
        _ => CalibrationGoal::prior(text.parse().unwrap_or(f64::NAN)).map(|p| Prior(Some(p))),
    }
}

pub(super) fn run(arguments: &Arguments) -> Result<()> {
    let desk = interrupt::desk()?;
    let scene_output = desk.file(&arguments.output)?;
    let folder = folder_of(&arguments.output);
    let report_path = report_beside(&arguments.output);
    let report = desk.file(&report_path)?;
    let places = [&scene_output, &report].map(|file| file.place().map(Path::to_path_buf));
    let places: Vec<PathBuf> = places.into_iter().flatten().collect();
    check_places(&places, &FilesRead::default())?;
    if report_path.is_file() && calibration_file::read(&report_path).is_err() {
        return Err(Error::input(report_path.display(), NOT_OURS)
            .remedy("move it away, or write into another folder"));
    }

    let source = SceneSource::read(&arguments.scene)?;
    let loaded = desk.during("reading the scene", |_| source.load())?;
    loaded.check_captors()?;
    let read = loaded.files.iter().chain(&arguments.measured).chain(&arguments.results);
    let read = FilesRead::new(read);
    check_places(&places, &read)?;
    desk.warn(&loaded.warnings);
    let outputs = Outputs { scene: scene_output, report, report_path, read };
    let goal = arguments.goal()?;
    let light = arguments.light()?;
    let found = calibrated(&source, &loaded, &goal, &light, &folder, &desk)?;
    desk.writing();
    let (text, wrote) = match &found.report {
        CalibrationReport::Readings(report) => {
            (describe(report), outputs.write(arguments, &found.scene, report)?)
        }
        CalibrationReport::Even(report, result) => {
            (describe_even(report, result), outputs.write(arguments, &found.scene, report)?)
        }
    };
    // those of the scene and its files have been said
    desk.warn(&found.warnings);
    terminal::print(&(text + &wrote))
}

impl Arguments {
    fn goal(&self) -> Result<CalibrationGoal> {
        let groups = self.group.clone();
        let Some(file) = &self.measured else {
            return Ok(CalibrationGoal::Even(EvenPlan {
                captors: self.even.clone().unwrap_or_default(),
                band: self.band.clone(),
                mean: self.mean,
                minimum: self.minimum,
                groups,
            }));
        };
        let bytes = read_bytes(file).map_err(|why| Error::unreadable(file.display(), why))?;
        let rows = measured_csv::parse(&bytes, file)?;
        let (model, prior, vary) = (self.model.0, self.prior.0, self.vary.clone());
        Ok(CalibrationGoal::Readings { rows, file: file.clone(), model, prior, groups, vary })
    }

    fn light(&self) -> Result<CalibrationLight> {
        Ok(match &self.results {
            Some(path) => {
                CalibrationLight::Found(Box::new(read_json(path)?), path.display().to_string())
            }
            None => CalibrationLight::Traced {
                photons: self.photons,
                seed: self.seed,
                tolerance: self.tolerance,
                guiding: self.guiding,
                threads: self.threads,
            },
        })
    }
}

/// The two files that the command writes.
struct Outputs {
    scene: OutputFile,
    report: OutputFile,
    report_path: PathBuf,
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

/// Returns the factors, and how evenly the captors are lit before and after, as tables.
fn describe_even(found: &EvenPowers, result: &RunResult) -> String {
    let band = result.bands.iter().position(|band| band.name == found.band).unwrap_or(0);
    let [_, irradiance] = result.units(band);
    let mut text = format!(
        "{}: {} captors of `{}`, {}\n",
        found.scene, found.count, found.captors, found.band
    );
    let write = |text: &mut String, table: &Table| {
        table.below(text, &terminal::page());
    };
    let mut table = Table::new("factors on the power of lights", [""], "");
    for (name, factors) in found.factors.iter().take(terminal::shown(LISTED)) {
        let factor = factors.first().copied().unwrap_or(1.0);
        table.row(format!("  {name}"), [format!("{factor:.4}")], "");
    }
    write(&mut text, &table);
    text.push_str(&terminal::more(found.factors.len(), LISTED));
    let with = |value: f64, error: Option<f64>| match error {
        Some(error) => with_error(value, error),
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
        table.below(text, &terminal::page());
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
