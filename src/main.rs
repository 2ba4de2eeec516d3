//! The command `phylux`: parse, run, print the error, exit code.

use std::{env, process::ExitCode};

fn main() -> ExitCode {
    ExitCode::from(phylux::cli::main_from(env::args_os()))
}
