//! A table that is written row by row as CSV and, with the feature `parquet`, at the same time as
//! Parquet.

use std::io;

#[cfg(feature = "parquet")]
use crate::studies::table::ParquetTable;
use crate::{
    error::{Error, Result},
    formats::{
        csv_text,
        written::{OwnFile, Written},
    },
    studies::table::{Cell, Kind},
};

/// A table that is being written.
pub struct Table<'a> {
    name: &'a str,
    csv: csv::Writer<OwnFile<'a>>,
    #[cfg(feature = "parquet")]
    parquet: ParquetTable<OwnFile<'a>>,
}

impl<'a> Table<'a> {
    /// Endings of the names of its files, in any build of the program.
    pub const ENDINGS: [&'static str; 2] = ["csv", "parquet"];

    /// Begins a table in a folder. The names of the columns must differ.
    pub fn create(
        written: &'a Written,
        name: &'a str,
        columns: Vec<(String, Kind)>,
    ) -> Result<Self> {
        let open = |ending| written.create(&format!("{name}.{ending}"));
        let csv = open("csv")?;
        #[cfg(feature = "parquet")]
        let parquet = ParquetTable::begin(open("parquet")?, &columns);
        let mut csv = csv::Writer::from_writer(csv);
        csv.write_record(columns.iter().map(|(name, _)| csv_text::cell(name).into_owned()))
            .map_err(|e| unwritten(name, e.into()))?;
        Ok(Self {
            #[cfg(feature = "parquet")]
            parquet: parquet.map_err(|e| unwritten(name, e))?,
            name,
            csv,
        })
    }

    /// Adds a row with one cell for each column.
    pub fn row(&mut self, cells: &[Cell]) -> Result<()> {
        let written = self.csv.write_record(cells.iter().map(Cell::csv));
        written.map_err(|e| unwritten(self.name, e.into()))?;
        #[cfg(feature = "parquet")]
        self.parquet.row(cells).map_err(|e| unwritten(self.name, e))?;
        Ok(())
    }

    /// Ends the table and puts its files in their places.
    pub fn finish(self) -> Result<()> {
        let Self { name, csv, .. } = self;
        let csv = csv.into_inner().map_err(|e| unwritten(name, e.into_error()))?;
        #[cfg(feature = "parquet")]
        self.parquet.end().map_err(|e| unwritten(name, e))?.finish()?;
        csv.finish()
    }
}

fn unwritten(name: &str, e: io::Error) -> Error {
    Error::run(name, format!("cannot be written: {e}"))
}
