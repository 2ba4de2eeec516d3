//! `phylux check`: says what a scene holds, warns of what looks wrong in it, and ends with a verdict.

use std::path::PathBuf;

use clap::Args;

use super::{interrupt, terminal};
use phylux_core::{
    error::{Error, Result, setting},
    words,
};
use phylux_files::scene_file;
use phylux_studies::{
    check::check,
    text::scene::{as_json, describe},
};

#[derive(Args)]
pub(super) struct Arguments {
    /// Scene file (JSON)
    scene: PathBuf,
    /// End with exit code 1 if there is a warning
    #[arg(long)]
    strict: bool,
    /// Print everything as JSON, warnings included
    #[arg(long)]
    json: bool,
}

pub(super) fn run(arguments: &Arguments) -> Result<()> {
    let _desk = interrupt::desk()?;
    let loaded = scene_file::load(&arguments.scene)?;
    let summary = check(&loaded)?;
    match arguments.json {
        true => {
            terminal::print_result(&(as_json(&loaded, &summary)? + "\n"))?;
        }
        false => {
            terminal::print(&describe(&terminal::page(), &loaded, &summary))?;
            terminal::warn(&summary.warnings);
        }
    }
    let count = summary.warnings.len();
    let found = format!("{count} warning{}", if count == 1 { "" } else { "s" });
    match count {
        // the error is the verdict
        1.. if arguments.strict => Err(Error::run(arguments.scene.display(), found)
            .remedy(words!["change what they name, or leave out ", setting("strict")])),
        _ if arguments.json => Ok(()),
        0 => terminal::print("\nno problems found\n"),
        _ => terminal::print(&format!("\n{found}, see above\n")),
    }
}
