//! The commands for programs that embed phylux, such as the Python package: options mean there what
//! they mean on the command line, and texts are the same.

use std::{error::Error as _, path::Path, sync::atomic::AtomicBool};

use clap::{
    Parser,
    error::{ContextKind, ContextValue},
};

use super::{check, compare, mix, render, run, summary::summary, trace};
use phylux_core::{
    error::{Error, Result},
    scene::world::Scene,
    transport::{settings::Settings, simulate::Control},
};
use phylux_files::scene_file::LoadedScene;
use phylux_results::{
    compare::Comparison,
    histories::HistoriesResult,
    result::{Factor, RunResult},
    saved::ResultsFile,
};
use phylux_show::{following::Following, picture::Picture, render::Pixels};

/// A text for a person, with warnings.
pub struct Words {
    /// The text, as the command prints it.
    pub text: String,
    /// Warnings, one sentence each.
    pub warnings: Vec<String>,
}

/// A picture, with the numbers that it shows.
pub struct Rendering {
    /// The picture, as the command writes it.
    pub picture: Picture,
    /// The light on surfaces; `None` in pictures of captors or photons.
    pub pixels: Option<Pixels>,
}

#[derive(Parser)]
struct RunOptions {
    #[command(flatten)]
    arguments: run::Arguments,
}

#[derive(Parser)]
struct TraceOptions {
    #[command(flatten)]
    arguments: trace::Arguments,
}

#[derive(Parser)]
struct RenderOptions {
    #[command(flatten)]
    arguments: render::Arguments,
}

/// Returns the settings of a run: those of the scene, replaced by options of `phylux run` such as
/// `["--photons=1e7", "--by-light"]`. Errors: an unknown option, or a value that it cannot have.
/// The place of the error is the option's name.
pub fn run_settings(options: &[String], of_scene: &Settings) -> Result<Settings> {
    let parsed: RunOptions = parse(&["phylux", "scene"], options)?;
    parsed.arguments.settings(of_scene.clone())
}

/// Runs the scene with options of `phylux run`, but for `--sensitivity`, which belongs to the
/// scene. A run with `--checkpoint` goes on from its file if that exists, and the file is removed
/// once the result is known. Errors: those of [`run_settings`], and those of a run.
pub fn found(loaded: &LoadedScene, options: &[String], control: &Control) -> Result<RunResult> {
    let RunOptions { arguments } = parse(&["phylux", "scene"], options)?;
    if arguments.asks_for_sensitivity() {
        let problem = "the scene is loaded, and does not count what its results depend on";
        return Err(Error::input("sensitivity", problem)
            .remedy("give the scene its key `sensitivity` before it is loaded"));
    }
    loaded.check_captors()?;
    let (scene, settings) = (&loaded.scene, arguments.settings(loaded.settings.clone())?);
    let checkpoint = arguments.checkpoint(scene, &settings);
    let simulation = arguments.simulate(scene, &settings, control, checkpoint.as_ref());
    // the place of an error about a setting is the argument's name or, if there is none, the scene's
    let simulation = simulation.map_err(|error| match arguments.gives(error.place()) {
        true => error,
        false => loaded.placed(error),
    })?;
    let result = RunResult::new(&simulation).with_warnings_of_scene(run::warnings_of(loaded)?);
    if let Some(checkpoint) = checkpoint {
        checkpoint.remove();
    }
    Ok(result)
}

/// Returns what `phylux check` says of a scene, and the same as the JSON of `--json`.
pub fn describe(loaded: &LoadedScene) -> Result<(Words, String)> {
    let summary = phylux_studies::check::check(loaded)?;
    let json = check::as_json(loaded, &summary)?;
    Ok((Words { text: check::describe(loaded, &summary), warnings: summary.warnings }, json))
}

/// Compares two results, and returns the comparison with the text that `phylux compare` prints.
/// Errors: those of [`Comparison::new`].
pub fn compared(a: &ResultsFile, b: &ResultsFile) -> Result<(Comparison, String)> {
    let comparison = Comparison::new(a, b)?;
    let text = compare::text(a, b, &comparison, compare::WORST);
    Ok((comparison, text))
}

/// Returns the summary that `phylux run` prints at its end, with all warnings of the result.
pub fn summarise(result: &RunResult) -> Words {
    let found = summary(result, "");
    let mut warnings = result.warnings_of_scene();
    warnings.extend(found.warnings);
    Words { text: found.text, warnings }
}

/// Returns what the run would have found with these factors on the powers of its lights; the name
/// `row*` stands for all lights whose names begin so. The factors are multiplied by those of a file
/// that `phylux calibrate` has written, if one is given. Errors: those of [`RunResult::mix_bands`];
/// a file that cannot be read or that has other bands.
pub fn mixed(
    result: &RunResult,
    factors: Vec<(String, Factor)>,
    calibration: Option<&Path>,
) -> Result<RunResult> {
    let factors = mix::factors(factors, result)?;
    let calibration = calibration.map(|file| mix::calibrated(file, result)).transpose()?;
    mix::mixed(result, calibration.as_ref(), &factors)
}

/// Makes a picture with options of `phylux render`, such as `["--show=irradiance", "--width=400"]`.
/// Setting `stop` ends the work. Errors: those of [`run_settings`] and of the command.
pub fn picture(loaded: &LoadedScene, options: &[String], stop: &AtomicBool) -> Result<Rendering> {
    let parsed: RenderOptions = parse(&["phylux", "scene", "--output=picture.png"], options)?;
    render::check(&parsed.arguments)?;
    // the standard error is not that of a command
    super::terminal::begin(true, false);
    let render::Made { picture, pixels, .. } = render::make(&parsed.arguments, loaded, stop)?;
    Ok(Rendering { picture, pixels })
}

/// Returns how light reaches a captor or a group, with options of `phylux trace` such as
/// `["--to=sensor"]`, and the warnings that the command prints. Errors: those of the command.
pub fn histories(
    loaded: &LoadedScene,
    options: &[String],
    control: &Control,
) -> Result<(HistoriesResult, Vec<String>)> {
    let parsed: TraceOptions = parse(&["phylux", "scene"], options)?;
    let result = parsed.arguments.found(loaded, control)?;
    let warnings = trace::warnings(&result);
    Ok((result, warnings))
}

/// Returns the captors whose light a page follows: the captor or the group of this name or, without a
/// name, all captors of a scene that has few. Errors: there is no such name; there are too many of
/// them.
pub fn following(scene: &Scene, to: Option<&str>) -> Result<Following> {
    trace::following(scene, to)
}

fn parse<T: Parser>(before: &[&str], options: &[String]) -> Result<T> {
    let all = before.iter().copied().chain(options.iter().map(String::as_str));
    T::try_parse_from(all).map_err(|error| {
        let place = match error.get(ContextKind::InvalidArg) {
            Some(ContextValue::String(option)) => {
                let name = option.trim_start_matches('-').split([' ', '=']).next();
                name.unwrap_or_default().replace('-', "_")
            }
            _ => "options".into(),
        };
        let text = error.to_string();
        let line = text.lines().next().unwrap_or_default().trim_start_matches("error: ");
        let known = match (error.get(ContextKind::ValidValue), error.get(ContextKind::SuggestedArg))
        {
            (Some(ContextValue::Strings(values)), _) => {
                Some(format!("there are {}", values.join(", ")))
            }
            (_, Some(ContextValue::String(option))) => Some(format!("did you mean {option}?")),
            _ => None,
        };
        let error = match error.source() {
            Some(why) => Error::input(place, why),
            None => Error::input(place, line),
        };
        match known {
            Some(known) => error.remedy(known),
            None => error,
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn settings(options: &[&str]) -> Result<Settings> {
        let options: Vec<String> = options.iter().map(|option| option.to_string()).collect();
        run_settings(&options, &Settings { seed: 7, ..Settings::default() })
    }

    #[test]
    fn options_mean_what_they_mean_on_the_command_line() {
        let found = settings(&["--photons=1e3", "--by-light"]).unwrap();
        assert_eq!((found.photons_or_default(), found.seed, found.by_light), (1000, 7, true));
        assert_eq!(found.tolerance_limit, found.photons);
    }

    #[test]
    fn a_tolerance_of_something_needs_a_tolerance() {
        let error = settings(&["--of=bench"]).unwrap_err();
        assert_eq!(error.to_string(), "--of: no tolerance is asked for; add --tolerance 0.02");
        assert_eq!(settings(&["--of=bench", "--tolerance=0.1"]).unwrap().of.len(), 1);
    }

    #[test]
    fn errors_name_the_option() {
        let error = settings(&["--max-time=0"]).unwrap_err();
        assert_eq!(
            error.to_string(),
            "max_time: 0 s, must be above 0 and below 1e19 s; leave it out for no limit"
        );
        let error = settings(&["--fotons=1"]).unwrap_err();
        assert!(error.to_string().starts_with("fotons: unexpected argument"), "{error}");
        assert!(error.to_string().ends_with("; did you mean --photons?"), "{error}");
        let error = settings(&["--estimator=none"]).unwrap_err();
        assert!(error.to_string().starts_with("estimator: invalid value 'none'"), "{error}");
        assert!(
            error.to_string().ends_with("; there are photons, paths, complete, auto"),
            "{error}"
        );
    }
}
