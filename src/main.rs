//! The command `phylux`: parses its arguments, runs, prints an error if there is one, and ends with
//! the exit code.

use std::{env, process::ExitCode};

fn main() -> ExitCode {
    ExitCode::from(phylux::cli::main_from(env::args_os()))
}
