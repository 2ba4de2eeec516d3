//! The command `phylux`: parse, run, print the error, exit code.

use std::process::ExitCode;

fn main() -> ExitCode {
    phylux::cli::main()
}
