//! A table of a sweep, which is written row by row as CSV and, with the feature `parquet`, at the
//! same time as Parquet.

use std::io;

use crate::table::{Cell, Kind, TableFile};
use phylux_core::error::{Error, Result};
use phylux_files::written::{OwnFile, Written};

/// A table that is being written.
pub struct Table<'a> {
    name: &'a str,
    files: Vec<TableFile<OwnFile<'a>>>,
}

impl<'a> Table<'a> {
    /// Endings of the names of its files, in any build of the program.
    pub const ENDINGS: [&'static str; 2] = ["csv", "parquet"];

    /// Begins a table in a folder. The names of the columns must differ.
    pub fn create(written: &'a Written, name: &'a str, columns: &[(String, Kind)]) -> Result<Self> {
        let begin = |ending: &str| {
            let file = written.create(&format!("{name}.{ending}"))?;
            let begun = TableFile::begin(file, columns, ending == "parquet");
            begun.map_err(|e| unwritten(name, e))
        };
        let endings = &Self::ENDINGS[..if cfg!(feature = "parquet") { 2 } else { 1 }];
        Ok(Self { name, files: endings.iter().map(|ending| begin(ending)).collect::<Result<_>>()? })
    }

    /// Adds a row with one cell for each column.
    pub fn row(&mut self, cells: &[Cell]) -> Result<()> {
        let added = self.files.iter_mut().try_for_each(|file| file.row(cells));
        added.map_err(|e| unwritten(self.name, e))
    }

    /// Ends the table and puts its files in their places.
    pub fn finish(self) -> Result<()> {
        let Self { name, files } = self;
        let ended = files.into_iter().map(|file| file.end().map_err(|e| unwritten(name, e)));
        ended.collect::<Result<Vec<_>>>()?.into_iter().try_for_each(OwnFile::finish)
    }
}

fn unwritten(name: &str, e: io::Error) -> Error {
    Error::unwritable(name, e)
}
