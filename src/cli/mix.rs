//! `phylux mix`: says what a run would have found with other powers of its lights, without a new
//! run.

use std::path::PathBuf;

use clap::Args;

use super::{
    interrupt,
    outputs::{OutputArguments, Outputs, check_places, place_of},
    terminal::{self, spelled},
};
use phylux_core::error::{Error, Result, setting};
use phylux_files::{output::FilesRead, result_file::read_json};
use phylux_results::result::{Factor, RunResult};
use phylux_studies::{
    mix::Mix,
    text::{
        short,
        summary::{SHOWN_BANDS, summary},
        table::Table,
    },
};

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
    let mix = Mix::new(&result, entries, arguments.calibration.as_deref())?;
    let mixed = mix.of_own(result).map_err(|e| e.at(arguments.results.display()))?;
    let ids = mixed.captors.iter().map(|captor| captor.id.as_str());
    places.extend(outputs.captor_places(ids, &read)?);
    check_places(&places, &read)?;
    desk.writing();
    outputs.write(&read, &mixed)?;
    let summary = summary(&terminal::page(), &mixed, ", mixed");
    terminal::warn(&mixed.warnings_of_scene());
    terminal::warn(&spelled(&summary.warnings));
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
            return Err(
                Error::input(setting("power"), problem).remedy("write \"row 1=0.5,row 2=2\"")
            );
        }
    }
    Ok(entries)
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
    table.write(&mut text, &terminal::page());
    text.push_str(&terminal::more(lights.count(), LISTED));
    text
}
