//! Reads CSV files as records, each with its line number.

use std::{fmt::Display, path::Path};

use csv::{ByteRecord, ReaderBuilder, StringRecord};

use crate::error::{Error, Result};

/// A line of a CSV file, for errors.
pub struct Place<'a> {
    path: &'a Path,
    /// Number of the line, from 1.
    pub line: u64,
}

impl Place<'_> {
    /// Returns an error of input at this line.
    pub fn error(&self, problem: impl Display) -> Error {
        Error::input(format_args!("{}:{}", self.path.display(), self.line), problem)
    }
}

/// Returns the records of the CSV file at `path`, with the blanks around each cell removed. Rows
/// without content, which spreadsheets leave below a table, are skipped, but never the first
/// record. Error: a record is not UTF-8 text.
pub fn records<'a>(
    bytes: &'a [u8],
    path: &'a Path,
) -> impl Iterator<Item = Result<(Place<'a>, StringRecord)>> {
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    let mut csv = ReaderBuilder::new().has_headers(false).flexible(true).from_reader(bytes);
    let mut lines = LineCounter { bytes, at: 0, line: 1 };
    let mut first = true;
    std::iter::from_fn(move || {
        let mut raw = ByteRecord::new();
        // reading from memory cannot fail, and the reader checks neither UTF-8 nor the number of
        // cells
        while csv.read_byte_record(&mut raw).unwrap_or(false) {
            let start = raw.position().map_or(0, |p| p.byte());
            let place = Place { path, line: lines.at_record(start as usize) };
            let Ok(mut record) = StringRecord::from_byte_record(raw.clone()) else {
                let error = place.error("is not UTF-8 text");
                return Some(Err(error.remedy("save the file as CSV in UTF-8")));
            };
            record.trim();
            if !std::mem::take(&mut first) && record.iter().all(str::is_empty) {
                continue;
            }
            return Some(Ok((place, record)));
        }
        None
    })
}

/// Counts lines, because the line numbers of the csv crate are wrong after CR LF and after blank
/// lines.
struct LineCounter<'a> {
    bytes: &'a [u8],
    at: usize,
    line: u64,
}

impl LineCounter<'_> {
    /// Returns the number of the line on which the record at or after `byte` starts. `byte` must
    /// not decrease from call to call.
    fn at_record(&mut self, byte: usize) -> u64 {
        while let Some(&b) = self.bytes.get(self.at)
            && (self.at < byte || matches!(b, b'\n' | b'\r'))
        {
            // a line ends with CR, LF or CR LF
            let ends = b == b'\n' || b == b'\r' && self.bytes.get(self.at + 1) != Some(&b'\n');
            self.line += u64::from(ends);
            self.at += 1;
        }
        self.line
    }
}
