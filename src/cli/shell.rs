//! `phylux completions` and `phylux man`: tell a shell and the system's manual about the commands.

use std::{
    fs,
    path::{Path, PathBuf},
};

use clap::{Args, Command};
use clap_complete::Shell;
use clap_mangen::Man;

use super::{help, terminal};
use phylux_core::error::{Error, Result};
use phylux_files::output::{FilesRead, OutputFile};
use phylux_studies::desk::check_folder;

#[derive(Args)]
pub(super) struct CompletionArguments {
    /// Shell that the script is for
    #[arg(value_enum)]
    shell: Shell,
}

#[derive(Args)]
pub(super) struct ManArguments {
    /// Folder for the pages (phylux.1, phylux-run.1, ...); made if it does not exist
    folder: PathBuf,
}

/// Prints the script that lets a shell complete the commands of `phylux`.
pub(super) fn complete(arguments: &CompletionArguments, mut phylux: Command) -> Result<()> {
    let mut script = Vec::new();
    clap_complete::generate(arguments.shell, &mut phylux, "phylux", &mut script);
    terminal::print_result(&String::from_utf8_lossy(&script))
}

/// Writes a manual page for `phylux` and one for each command.
pub(super) fn man(arguments: &ManArguments, phylux: Command) -> Result<()> {
    let folder = &arguments.folder;
    check_folder(folder)?;
    fs::create_dir_all(folder).map_err(|e| {
        Error::input(folder.display(), format!("cannot be created: {}", e.kind()))
            .remedy("write elsewhere")
    })?;
    // building adds the options that all commands share; `help` gets no page
    let mut phylux = phylux.disable_help_subcommand(true);
    phylux.build();
    for (name, examples) in help::GROUPS.iter().flat_map(|(_, commands)| *commands) {
        if let Some(command) = phylux.find_subcommand(name) {
            write(folder, &format!("phylux-{name}"), command, &examples_section(examples))?;
        }
    }
    write(folder, "phylux", &phylux, &command_sections(&phylux))?;
    terminal::print(&format!("wrote {}\n", folder.display()))
}

/// Writes one manual page; `more` stands after the options.
fn write(folder: &Path, name: &str, command: &Command, more: &str) -> Result<()> {
    let version = concat!("phylux ", env!("CARGO_PKG_VERSION"));
    let page = Man::new(command.clone()).source(version).manual("phylux");
    let codes = help::EXIT_CODES.iter();
    let codes = codes.map(|(code, meaning)| format!(".TP\n.B {code}\n{}\n", escaped(meaning)));
    let rest = format!("{more}.SH EXIT STATUS\n{}", codes.collect::<String>());
    let file = OutputFile::create(&folder.join(format!("{name}.1")))?;
    file.write(&FilesRead::default(), |mut writer| {
        page.render_title(&mut writer)?;
        page.render_name_section(&mut writer)?;
        page.render_synopsis_section(&mut writer)?;
        page.render_description_section(&mut writer)?;
        page.render_options_section(&mut writer)?;
        writer.write_all(rest.as_bytes())
    })
}

/// Returns the sections of the page of `phylux`: the commands in their groups, each with the name
/// of its page.
fn command_sections(phylux: &Command) -> String {
    let mut text = String::new();
    for (title, commands) in help::GROUPS {
        text += &format!(".SH {}\n", title.to_uppercase());
        for command in commands.iter().filter_map(|(name, _)| phylux.find_subcommand(name)) {
            let about = command.get_about().map(ToString::to_string).unwrap_or_default();
            text += &format!(".TP\n.BR phylux\\-{} (1)\n{}\n", command.get_name(), escaped(&about));
        }
    }
    text
}

/// Returns the section with the examples of a command, each on a line of its own.
fn examples_section(examples: &[&str]) -> String {
    let lines = examples.iter().map(|example| format!("{}\n", escaped(example)));
    format!(".SH EXAMPLES\n.nf\n{}.fi\n", lines.collect::<String>())
}

/// Returns a line of text as roff must read it: with hyphens that can be copied into a shell.
fn escaped(text: &str) -> String {
    text.replace('\\', "\\e").replace('-', "\\-")
}
