//! The command line: the list of commands, how one is chosen and run, and its exit code. Each
//! command has a file of its own with its arguments and their help. What several commands share is
//! in `outputs`, `progress`, `interrupt`, `terminal`, `tracing` and `rendered`.

mod calibrate;
mod chart;
mod check;
mod choices;
mod compare;
mod export;
mod help;
mod interrupt;
mod mix;
mod outputs;
mod plot;
mod progress;
mod render;
mod rendered;
mod run;
mod schema;
mod shell;
mod style;
mod sweep;
mod terminal;
mod trace;
mod tracing;
mod view;
mod year;

use std::{ffi::OsString, sync::LazyLock};

use clap::{CommandFactory, FromArgMatches, Parser, Subcommand};

use phylux_core::error::{ErrorKind, Result};
use phylux_core::scene::bvh::Kernel;

/// Text that `--version` prints.
static VERSION: LazyLock<String> = LazyLock::new(|| {
    format!("{}\nrays traced by the {} kernel", env!("CARGO_PKG_VERSION"), Kernel::used().name())
});

/// Photon mapping for plant science: how much light every sensor and every leaf receives.
#[derive(Parser)]
#[command(name = "phylux", version, long_version = VERSION.as_str(), max_term_width = 100)]
struct Cli {
    /// Print no summary and no progress; warnings, errors and exit codes stay
    #[arg(short, long, global = true, display_order = 998)]
    quiet: bool,
    /// Print all rows and bands of tables, and names however long
    #[arg(long, global = true, display_order = 998)]
    full: bool,
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Trace photons through a scene and write what its captors received
    Run(Box<run::Arguments>),
    /// Say what a scene holds, and warn of what looks wrong in it
    Check(check::Arguments),
    /// Chart error against cost for every estimator, and say what the scene needs
    ///
    /// Every estimator runs with seven budgets, each 3.16 times the one before, up to --photons.
    Chart(chart::Arguments),
    /// Fit the powers of the lamps to what an instrument read
    Calibrate(calibrate::Arguments),
    /// Make a picture of a scene: what a camera would see, or its light in false colour
    Render(Box<render::Arguments>),
    /// Compare two results captor by captor, worst first
    Compare(compare::Arguments),
    /// Say what a run would have found with other powers of its lights, without a new one
    Mix(mix::Arguments),
    /// Plot results: a map of sensors, a profile over height, what plants absorbed, spectra
    Plot(plot::Arguments),
    /// Say on which ways light reaches a captor: from which lamp, by which last surface
    Trace(trace::Arguments),
    /// Write a page that shows the scene and its light in a browser
    View(view::Arguments),
    /// Write surfaces, captors and their light, or photons, for ParaView, Blender and others
    Export(export::Arguments),
    /// Run a scene with many values of some of its numbers, and tabulate the results
    Sweep(sweep::Arguments),
    /// Find daylight and lamps by the hour of a period or year, and daily light integrals
    Year(Box<year::Arguments>),
    /// Join the shards of a sweep, or of one run
    Merge(sweep::MergeArguments),
    /// Print the JSON Schema of scenes, sweeps, results, control files or files of one captor
    Schema {
        /// Kind of files that the schema describes
        #[arg(value_enum, default_value = "scene")]
        of: schema::Of,
    },
    /// Print a script that lets a shell complete the commands
    ///
    /// bash reads it from ~/.local/share/bash-completion/completions/phylux, fish from
    /// ~/.config/fish/completions/phylux.fish, zsh from a file named _phylux in a folder of its
    /// $fpath. Make the folder first if it does not exist.
    Completions(shell::CompletionArguments),
    /// Write manual pages
    ///
    /// `man phylux` finds them in ~/.local/share/man/man1, or in a folder man1 of any folder in
    /// $MANPATH.
    Man(shell::ManArguments),
}

/// The names that the help gives to values that are numbers: these may begin with a minus.
const NUMBERS: [&str; 10] =
    ["N", "I/N", "VALUE", "FRACTION", "SECONDS", "DEGREES", "INCHES", "STOPS", "X,Y,Z", "LOW:HIGH"];

/// Returns the parser of the command line, with its help.
fn command() -> clap::Command {
    let is_number = |argument: &clap::Arg| {
        let names = argument.get_value_names().unwrap_or_default();
        names.iter().any(|name| NUMBERS.contains(&name.as_str()))
    };
    let signed = |argument: clap::Arg| match is_number(&argument) {
        true => argument.allow_hyphen_values(true),
        false => argument,
    };
    help::add(Cli::command()).mut_subcommands(|command| command.mut_args(signed))
}

/// Runs a command line, whose first argument is the name of the program, and returns the exit code:
/// 0 done, 1 the run failed, 2 wrong usage or input, 3 a tolerance was not met (the results are
/// written), 130 interrupted.
///
/// It is meant for a process of its own: it takes over Ctrl-C, and may end the process at that
/// signal.
pub fn main_from(arguments: impl IntoIterator<Item = OsString>) -> u8 {
    let parsed = command().try_get_matches_from(arguments);
    let parsed = parsed.inspect(|matches| terminal::name(matches.subcommand_name().unwrap_or("")));
    let cli = match parsed.and_then(|matches| Cli::from_arg_matches(&matches)) {
        Ok(cli) => cli,
        Err(usage) if usage.use_stderr() => {
            terminal::complain(&usage.render().to_string());
            return 2;
        }
        Err(help) => {
            // printing fails if the reader has closed the pipe, and then it has read enough
            let _ = help.print();
            return 0;
        }
    };
    terminal::begin(cli.quiet, cli.full);
    let outcome = match cli.command {
        Command::Run(arguments) => return finish(run::run(&arguments)),
        Command::Check(arguments) => check::run(&arguments),
        Command::Chart(arguments) => chart::run(&arguments),
        Command::Calibrate(arguments) => calibrate::run(&arguments),
        Command::Render(arguments) => render::run(&arguments),
        Command::Compare(arguments) => return finish(compare::run(&arguments)),
        Command::Mix(arguments) => mix::run(&arguments),
        Command::Plot(arguments) => plot::run(&arguments),
        Command::Trace(arguments) => trace::run(&arguments),
        Command::View(arguments) => view::run(&arguments),
        Command::Export(arguments) => export::run(&arguments),
        Command::Sweep(arguments) => sweep::run(&arguments),
        Command::Year(arguments) => year::run(&arguments),
        Command::Merge(arguments) => sweep::run_merge(&arguments),
        Command::Schema { of } => schema::print(of),
        Command::Completions(arguments) => shell::complete(&arguments, command()),
        Command::Man(arguments) => shell::man(&arguments, Cli::command()),
    };
    finish(outcome.map(|()| 0))
}

/// Returns the exit code of a command, and prints its error if there is one.
fn finish(outcome: Result<u8>) -> u8 {
    let error = match outcome {
        Ok(code) => return code,
        Err(error) => error,
    };
    terminal::fail(&error);
    match error.kind() {
        ErrorKind::Run => 1,
        ErrorKind::Input => 2,
        ErrorKind::Interrupted => interrupt::EXIT_CODE,
    }
}

#[cfg(test)]
mod tests {
    use clap::error::ErrorKind;

    use super::*;

    /// A number below 0 is the value of its option, whichever that is, and not taken for an option
    /// that does not exist.
    #[test]
    fn every_number_may_have_a_sign() {
        let mut tried = 0;
        for of in command().get_subcommands() {
            for option in of.get_opts() {
                let names = option.get_value_names().unwrap_or_default();
                if !names.iter().any(|name| NUMBERS.contains(&name.as_str())) {
                    continue;
                }
                let long = format!("--{}", option.get_long().expect("a long name"));
                let line = ["phylux", of.get_name(), &long, "-1"];
                if let Err(error) = command().try_get_matches_from(line) {
                    let problem = error.render().to_string();
                    assert_ne!(error.kind(), ErrorKind::UnknownArgument, "{line:?}: {problem}");
                }
                tried += 1;
            }
        }
        assert!(tried > 50, "{tried}");
    }
}
