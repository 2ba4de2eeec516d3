//! The files that a command writes results to.

use std::{
    io::{self, Write},
    path::{Path, PathBuf},
};

use clap::Args;

use phylux_core::error::Result;
pub(super) use phylux_files::output::check_places;
use phylux_files::{
    output::{CompleteFile, FilesRead, OutputFile},
    result_file::{CompleteFolder, OutputFolder, write_csv, write_json},
};
use phylux_results::result::RunResult;
use phylux_studies::desk::{Desk, STANDARD_OUTPUT};

/// Heading of a group of options in the help.
pub(super) const FILES: &str = "Files";

#[derive(Args)]
#[command(next_help_heading = FILES)]
pub(super) struct OutputArguments {
    /// Results file (JSON); `-` is the standard output
    #[arg(short, long, value_name = "FILE", default_value = "results.json")]
    pub(super) output: PathBuf,
    /// Also write one JSON file per captor into this folder
    #[arg(long, value_name = "DIR")]
    per_captor: Option<PathBuf>,
    /// Also write a tidy table (CSV): captor, face, band, quantity, value, standard error,
    /// position, area, group
    #[arg(long, value_name = "FILE")]
    csv: Option<PathBuf>,
}

/// The files of a result, each of which is written as a whole or not at all.
pub(super) struct Outputs {
    output: OutputFile,
    per_captor: Option<OutputFolder>,
    csv: Option<OutputFile>,
}

impl Outputs {
    /// Prepares all files. If a signal ends the command at once, what was prepared is removed.
    pub(super) fn create(arguments: &OutputArguments, desk: &Desk) -> Result<Self> {
        let output = desk.file(&arguments.output)?;
        let csv = arguments.csv.as_deref().map(|csv| desk.file(csv)).transpose()?;
        let per_captor = arguments.per_captor.as_deref();
        let per_captor = per_captor.map(|folder| desk.folder(folder)).transpose()?;
        Ok(Self { output, per_captor, csv })
    }

    fn files(&self) -> impl Iterator<Item = &OutputFile> {
        std::iter::once(&self.output).chain(&self.csv)
    }

    /// Returns where the files and the folder will be.
    pub(super) fn places(&self) -> Vec<PathBuf> {
        let folder = self.per_captor.iter().map(OutputFolder::place);
        self.files().filter_map(OutputFile::place).chain(folder).map(Path::to_path_buf).collect()
    }

    /// Returns where the files of these captors will be. Error: one of them cannot be there.
    pub(super) fn captor_places<'a>(
        &self,
        ids: impl Iterator<Item = &'a str>,
        read: &FilesRead,
    ) -> Result<Vec<PathBuf>> {
        self.per_captor.as_ref().map_or(Ok(Vec::new()), |folder| folder.places(ids, read))
    }

    /// Writes something other than results into the results file, and leaves out the other files.
    pub(super) fn write_shard(
        self,
        read: &FilesRead,
        content: impl FnOnce(&mut dyn Write) -> io::Result<()>,
    ) -> Result<()> {
        self.output.write(read, content)
    }

    pub(super) fn write(self, read: &FilesRead, result: &RunResult) -> Result<()> {
        // all are completed before the first has its place
        let json = self.output.complete(read, |writer| write_json(result, writer))?;
        let csv = self.csv.map(|csv| csv.complete(read, |writer| write_csv(result, writer)));
        let csv = csv.transpose()?;
        let folder = self.per_captor.map(|folder| folder.complete(read, result)).transpose()?;
        json.put()?;
        csv.map_or(Ok(()), CompleteFile::put)?;
        folder.map_or(Ok(()), CompleteFolder::put)
    }
}

/// Names the place of a result, for a sentence that begins with `wrote`.
pub(super) fn place_of(path: &Path) -> String {
    match path == Path::new(STANDARD_OUTPUT) {
        true => "to the standard output".into(),
        false => path.display().to_string(),
    }
}
