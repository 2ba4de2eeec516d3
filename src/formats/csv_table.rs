//! The records of a CSV file, each with its line.

use std::{fmt::Display, path::Path};

use csv::{ByteRecord, ReaderBuilder, StringRecord};

use crate::error::{Error, Result};

/// A line of the file, for errors.
pub struct Place<'a> {
    path: &'a Path,
    /// From 1.
    pub line: u64,
}

impl Place<'_> {
    /// An error there.
    pub fn error(&self, problem: impl Display) -> Error {
        Error::input(format_args!("{}:{}", self.path.display(), self.line), problem)
    }
}

/// The records of the CSV file at `path`, without blanks around the cells. What spreadsheets leave below a table,
/// rows without content, is left out, but never the first record. Error: a record that is not UTF-8 text.
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
        // reading from memory cannot fail, and neither UTF-8 nor lengths are checked there
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

/// Counts lines, for those of the csv crate are wrong after CR LF and after blank lines.
struct LineCounter<'a> {
    bytes: &'a [u8],
    at: usize,
    line: u64,
}

impl LineCounter<'_> {
    /// The line of the record that starts at or after `byte`; calls go forward.
    fn at_record(&mut self, byte: usize) -> u64 {
        while let Some(&b) = self.bytes.get(self.at)
            && (self.at < byte || matches!(b, b'\n' | b'\r'))
        {
            // CR, LF and CR LF all end a line
            let ends = b == b'\n' || b == b'\r' && self.bytes.get(self.at + 1) != Some(&b'\n');
            self.line += u64::from(ends);
            self.at += 1;
        }
        self.line
    }
}
