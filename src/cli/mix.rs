//! `phylux mix`: says what a run would have found with other powers of its lights, without a new
//! run.

use std::path::{Path, PathBuf};

use clap::Args;

use super::{
    interrupt,
    outputs::{OutputArguments, Outputs, check_places, place_of},
    summary::{SHOWN_BANDS, short, summary},
    table::Table,
    terminal,
};
use phylux_core::error::{Error, Result};
use phylux_files::{
    calibration_file::{self, Factors},
    output::FilesRead,
    result_file::read_json,
};
use phylux_results::result::{ByLight, Factor, FactorErrors, RunResult};

/// The most lights that are listed.
const LISTED: usize = 20;

#[derive(Args)]
pub(super) struct Arguments {
    /// Results file (JSON) of `phylux run --by-light`
    results: PathBuf,
    /// Factors on the powers that the lights had in the run, as in "row 1=0.5,row 2=2"; 0 switches
    /// a light off, `row *` stands for all lights whose names begin so, and lights that are not
    /// named stay as they were
    #[arg(long, value_name = "LIGHT=FACTOR,...", required_unless_present = "calibration")]
    power: Vec<String>,
    /// Factors per band from a file that `phylux calibrate` has written; those of --power are
    /// multiplied on top
    #[arg(long, value_name = "FILE")]
    calibration: Option<PathBuf>,
    #[command(flatten)]
    outputs: OutputArguments,
}

pub(super) fn run(arguments: &Arguments) -> Result<()> {
    let desk = interrupt::desk()?;
    let outputs = Outputs::create(&arguments.outputs, &desk)?;
    let read = FilesRead::new([&arguments.results].into_iter().chain(&arguments.calibration));
    let mut places = outputs.places();
    check_places(&places, &read)?;
    let entries = entries(&arguments.power)?;
    let result = read_json(&arguments.results)?;
    let entries = entries.into_iter().map(|(name, factor)| (name, Factor::All(factor))).collect();
    let factors = factors(entries, &result)?;
    let calibration = arguments.calibration.as_deref();
    let calibration = calibration.map(|file| calibrated(file, &result)).transpose()?;
    let wrong = |e: Error| e.at(arguments.results.display());
    let mixed = mixed(&result, calibration.as_ref(), &factors).map_err(wrong)?;
    let ids = mixed.captors.iter().map(|captor| captor.id.as_str());
    places.extend(outputs.captor_places(ids, &read)?);
    check_places(&places, &read)?;
    desk.writing();
    outputs.write(&read, &mixed)?;
    let summary = summary(&mixed, ", mixed");
    super::terminal::warn(&mixed.warnings_of_scene());
    super::terminal::warn(&summary.warnings);
    let wrote = format!("\nwrote {}\n", place_of(&arguments.outputs.output));
    super::terminal::print(&(summary.text + &powers(&mixed) + &wrote))
}

/// Parses names and factors from texts such as `row 1=0.5,row 2=2`; names may contain commas.
fn entries(texts: &[String]) -> Result<Vec<(String, f64)>> {
    let mut entries = Vec::new();
    for text in texts {
        let mut entry = String::new();
        for piece in text.split(',') {
            entry += piece;
            let parsed =
                entry.rsplit_once('=').and_then(|(name, f)| Some((name, f.trim().parse().ok()?)));
            match parsed {
                Some((name, factor)) => {
                    entries.push((name.trim().to_string(), factor));
                    entry.clear();
                }
                None => entry.push(','),
            }
        }
        if !entry.is_empty() {
            let problem = format!("`{}` is no light with its factor", entry.trim_end_matches(','));
            return Err(Error::input("--power", problem).remedy("write \"row 1=0.5,row 2=2\""));
        }
    }
    Ok(entries)
}

/// The factors of a calibration, and their errors, if they were measured.
pub(super) struct Calibrated {
    factors: ByLight<Factor>,
    errors: Option<FactorErrors>,
}

/// Reads the factors of a calibration. Error: its bands are not those of the results.
pub(super) fn calibrated(file: &Path, result: &RunResult) -> Result<Calibrated> {
    let calibration = calibration_file::read(file)?;
    let names = result.bands.iter().filter(|band| band.sum_of.is_none());
    if !names.map(|band| &band.name).eq(&calibration.bands) {
        return Err(Error::input(file.display(), "its bands are not those of the results")
            .remedy("calibrate with this scene"));
    }
    let Factors { factors, lamps, measured_bands, covariance, .. } = calibration;
    let errors = match measured_bands.is_empty() {
        true => None,
        false => Some(
            FactorErrors::new(result, &factors, &lamps, &measured_bands, covariance)
                .map_err(|problem| problem.at(file.display()))?,
        ),
    };
    let factors = factors.into_iter().map(|(light, factors)| (light, Factor::Bands(factors)));
    Ok(Calibrated { factors: factors.collect(), errors })
}

/// Returns the results with the factors of a calibration, if there is one, and with other factors
/// on top. Errors then include those of the calibration's factors.
pub(super) fn mixed(
    result: &RunResult,
    calibration: Option<&Calibrated>,
    factors: &ByLight<Factor>,
) -> Result<RunResult> {
    let Some(Calibrated { factors: own, errors }) = calibration else {
        return result.mix_bands(factors);
    };
    // one mix knows more of the errors of ratios than two
    let mut all = own.clone();
    for (light, factor) in factors {
        let product = all.get(light).map_or_else(|| factor.clone(), |own| own.times(factor));
        all.insert(light.clone(), product);
    }
    let mixed = result.mix_bands(&all)?;
    Ok(match errors {
        Some(errors) => mixed.with_errors_of(errors),
        None => mixed,
    })
}

/// Returns the factor of each light that is named. A name that ends with `*`, and that is not
/// itself the name of a light, stands for all names that begin so.
pub(super) fn factors(
    entries: Vec<(String, Factor)>,
    result: &RunResult,
) -> Result<ByLight<Factor>> {
    let empty = ByLight::new();
    let lights = result.energy.by_light.as_ref().unwrap_or(&empty);
    let mut factors = ByLight::new();
    for (name, factor) in entries {
        let all = match name.strip_suffix('*') {
            Some(start) if !lights.contains_key(&name) => {
                lights.keys().filter(|light| light.starts_with(start)).cloned().collect()
            }
            _ => vec![name.clone()],
        };
        // a name that stands for no light is kept, so that an error lists the lights that exist
        for light in if all.is_empty() { vec![name] } else { all } {
            if factors.contains_key(&light) {
                let problem = format!("light `{light}` stands there twice");
                return Err(Error::input("--power", problem).remedy("give one factor"));
            }
            factors.insert(light, factor.clone());
        }
    }
    Ok(factors)
}

/// Returns a table of the power of each light in the mix.
fn powers(mixed: &RunResult) -> String {
    let lights = mixed.energy.by_light.iter().flatten();
    let bands = mixed.bands.len().min(terminal::shown(SHOWN_BANDS));
    let heads = mixed.bands[..bands].iter().map(|band| band.name.as_str());
    let mut table = Table::new(format!("power of lights, {}", mixed.unit.flux), heads, "");
    for (name, light) in lights.clone().take(terminal::shown(LISTED)) {
        table.row(format!("  {name}"), light.power[..bands].iter().map(|p| short(*p)), "");
    }
    let mut text = String::from("\n");
    table.write(&mut text, terminal::width(), terminal::is_full());
    text.push_str(&terminal::more(lights.count(), LISTED));
    text
}
