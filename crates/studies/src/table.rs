//! Tables: cells in columns, written as CSV or Parquet.

mod cell;
#[cfg(feature = "parquet")]
mod parquet_file;

pub use cell::{Cell, Kind};

use std::io::{self, Write};

#[cfg(feature = "parquet")]
use self::parquet_file::ParquetTable;
use phylux_files::csv_text;

/// A table that is written row by row into one file.
pub enum TableFile<W: Write + Send> {
    /// A CSV file.
    Csv(csv::Writer<W>),
    /// A Parquet file.
    #[cfg(feature = "parquet")]
    Parquet(ParquetTable<W>),
}

impl<W: Write + Send> TableFile<W> {
    /// Ending of the file's name, unless CSV is asked for.
    pub const ENDING: &str = if cfg!(feature = "parquet") { "parquet" } else { "csv" };

    /// Begins a table with columns of these names, as Parquet if `parquet` is set and this build
    /// supports it.
    pub fn begin(file: W, columns: &[(impl AsRef<str>, Kind)], parquet: bool) -> io::Result<Self> {
        #[cfg(feature = "parquet")]
        if parquet {
            return Ok(Self::Parquet(ParquetTable::begin(file, columns)?));
        }
        let _ = parquet;
        let mut csv = csv::Writer::from_writer(file);
        csv.write_record(
            columns.iter().map(|(name, _)| csv_text::cell(name.as_ref()).into_owned()),
        )?;
        Ok(Self::Csv(csv))
    }

    /// Adds a row with one cell for each column.
    pub fn row(&mut self, cells: &[Cell]) -> io::Result<()> {
        match self {
            Self::Csv(csv) => Ok(csv.write_record(cells.iter().map(Cell::csv))?),
            #[cfg(feature = "parquet")]
            Self::Parquet(table) => table.row(cells),
        }
    }

    /// Ends the table and returns the file with all of its rows.
    pub fn end(self) -> io::Result<W> {
        match self {
            Self::Csv(csv) => csv.into_inner().map_err(|e| e.into_error()),
            #[cfg(feature = "parquet")]
            Self::Parquet(table) => table.end(),
        }
    }
}
