//! Where a command puts a result.

use std::{
    collections::HashSet,
    fs,
    io::{self, Write},
    path::{Path, PathBuf},
};

use clap::Args;

use super::interrupt::Interrupt;
use crate::{
    error::{Error, Result},
    formats::{
        output::OutputFile,
        result_file::{OutputFolder, write_csv, write_json},
    },
    results::result::RunResult,
};

#[derive(Args)]
pub(super) struct OutputArguments {
    /// Results file (JSON)
    #[arg(short, long, value_name = "FILE", default_value = "results.json")]
    pub(super) output: PathBuf,
    /// Also write one JSON file per captor into this folder
    #[arg(long, value_name = "DIR")]
    per_captor: Option<PathBuf>,
    /// Also write a tidy table: captor, face, band, quantity, value, standard error
    #[arg(long, value_name = "FILE")]
    csv: Option<PathBuf>,
}

/// Files of a result, to be written whole or not at all.
pub(super) struct Outputs {
    output: OutputFile,
    per_captor: Option<OutputFolder>,
    csv: Option<OutputFile>,
}

impl Outputs {
    /// Prepares them all; an immediate end removes what that has made.
    pub(super) fn create(arguments: &OutputArguments, interrupt: &Interrupt) -> Result<Self> {
        let output = OutputFile::create(&arguments.output)?;
        let per_captor = arguments.per_captor.as_deref().map(OutputFolder::create).transpose()?;
        let csv = arguments.csv.as_deref().map(OutputFile::create).transpose()?;
        let outputs = Self { output, per_captor, csv };
        interrupt.remove_at_end(outputs.files().filter_map(OutputFile::temporary));
        interrupt.remove_at_end(outputs.per_captor.iter().flat_map(OutputFolder::temporary));
        Ok(outputs)
    }

    fn files(&self) -> impl Iterator<Item = &OutputFile> {
        std::iter::once(&self.output).chain(&self.csv)
    }

    /// Where the files will be that are not of single captors.
    pub(super) fn places(&self) -> Vec<PathBuf> {
        self.files().filter_map(OutputFile::place).map(Path::to_path_buf).collect()
    }

    /// Where the files of captors of these ids will be.
    pub(super) fn captor_places<'a>(&self, ids: impl Iterator<Item = &'a str>) -> Vec<PathBuf> {
        self.per_captor.as_ref().map_or(Vec::new(), |folder| folder.places(ids))
    }

    /// Writes something else into the results file alone.
    pub(super) fn write_part(
        self,
        content: impl FnOnce(&mut dyn Write) -> io::Result<()>,
    ) -> Result<()> {
        self.output.write(content)
    }

    pub(super) fn write(self, result: &RunResult) -> Result<()> {
        self.output.write(|writer| write_json(result, writer))?;
        if let Some(folder) = self.per_captor {
            folder.write(result)?;
        }
        self.csv.map_or(Ok(()), |csv| csv.write(|writer| write_csv(result, writer)))
    }
}

/// No output may take the place of another, or of a file that is read.
pub(super) fn check_places(places: &[PathBuf], files: &[PathBuf]) -> Result<()> {
    let files: HashSet<PathBuf> =
        files.iter().filter_map(|file| fs::canonicalize(file).ok()).collect();
    let mut named = HashSet::new();
    for place in places {
        let problem = if !named.insert(place) {
            "is named for two outputs"
        } else if files.contains(place) {
            "is a file that is read, which the output would replace"
        } else {
            continue;
        };
        return Err(Error::input(place.display(), problem).remedy("write elsewhere"));
    }
    Ok(())
}
