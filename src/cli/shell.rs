//! `phylux completions` and `phylux man`: what a shell and the system's manual know of the commands.

use std::{
    fs,
    path::{Path, PathBuf},
};

use clap::{Args, Command};
use clap_complete::Shell;

use super::{interrupt::check_folder, terminal};
use crate::{
    error::{Error, Result},
    formats::output::{FilesRead, OutputFile},
};

#[derive(Args)]
pub(super) struct CompletionArguments {
    /// The shell that they are for
    #[arg(value_enum)]
    shell: Shell,
}

#[derive(Args)]
pub(super) struct ManArguments {
    /// Folder for the pages, made if it is not there: phylux.1, phylux-run.1, ...
    folder: PathBuf,
}

/// Prints what lets the shell complete the commands of `phylux`.
pub(super) fn complete(arguments: &CompletionArguments, mut phylux: Command) -> Result<()> {
    let mut script = Vec::new();
    clap_complete::generate(arguments.shell, &mut phylux, "phylux", &mut script);
    terminal::print_result(&String::from_utf8_lossy(&script))
}

/// Writes a page for `phylux` and one for each command.
pub(super) fn man(arguments: &ManArguments, mut phylux: Command) -> Result<()> {
    let folder = &arguments.folder;
    check_folder(folder)?;
    if !folder.is_dir() {
        fs::create_dir(folder).map_err(|e| {
            Error::input(folder.display(), format!("cannot be created: {}", e.kind()))
                .remedy("write elsewhere")
        })?;
    }
    // with the options that all commands have
    phylux.build();
    for command in phylux.get_subcommands().filter(|command| command.get_name() != "help") {
        let name = format!("phylux-{}", command.get_name());
        write(folder, &name, command.clone())?;
    }
    write(folder, "phylux", phylux)?;
    terminal::print(&format!("wrote {}\n", folder.display()))
}

fn write(folder: &Path, name: &str, command: Command) -> Result<()> {
    let page = clap_mangen::Man::new(command);
    let file = OutputFile::create(&folder.join(format!("{name}.1")))?;
    file.write(&FilesRead::default(), |mut writer| page.render(&mut writer))
}
