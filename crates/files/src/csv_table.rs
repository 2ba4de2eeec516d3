//! Reads CSV files as records, each with its line number, and tells how their numbers are written.

use std::{fmt::Display, path::Path};

use csv::{ByteRecord, ReaderBuilder, StringRecord};

use crate::input::quoted;
use phylux_core::error::{Error, Result};

/// A line of a table, for errors.
pub struct Place<'a> {
    /// The path of the file.
    pub path: &'a Path,
    /// Number of the line, from 1.
    pub line: u64,
}

impl Place<'_> {
    /// Returns an error of input at this line.
    pub fn error(&self, problem: impl Display) -> Error {
        Error::input(format_args!("{}:{}", self.path.display(), self.line), problem)
    }
}

/// The names of the columns of a table of numbers.
pub struct Head(Vec<String>);

impl Head {
    /// Makes the head of a table from its first record.
    pub fn new(record: &StringRecord) -> Self {
        Self(record.iter().map(str::to_owned).collect())
    }

    /// Refuses a row with more or fewer cells than there are names, and one with a value below no
    /// name.
    pub fn check(&self, record: &StringRecord, place: &Place) -> Result<()> {
        let (found, expected) = (record.len(), self.0.len());
        if found != expected {
            let problem = format!("{found} values, but the header has {expected} columns");
            return Err(place.error(problem).remedy("numbers take a decimal point, not a comma"));
        }
        match (0..found).find(|&i| self.0[i].is_empty() && !record[i].is_empty()) {
            None => Ok(()),
            Some(i) => {
                let problem = format!("column {} has values, but no name", i + 1);
                Err(place.error(problem).remedy("name it, or leave it out"))
            }
        }
    }

    /// Reads the finite number in a column of a row that was checked.
    pub fn number(&self, record: &StringRecord, place: &Place, column: usize) -> Result<f64> {
        match record[column].parse::<f64>() {
            Ok(x) if x.is_finite() => Ok(x),
            _ => {
                let (name, cell) = (&self.0[column], quoted(&record[column]));
                let problem = format!("{name} is {cell}, not a finite number");
                Err(place.error(problem).remedy("write it like 0.25 or 2.5e-1"))
            }
        }
    }

    /// Returns the name of a column.
    pub fn name(&self, column: usize) -> &str {
        &self.0[column]
    }
}

/// Returns the error for two columns, counted from 0, of one name.
pub fn twice(place: &Place, name: &str, first: usize, second: usize) -> Error {
    let problem = format!("columns {} and {} are both {name}", first + 1, second + 1);
    place.error(problem).remedy("keep one of them")
}

/// Refuses a head that lacks these columns; `remedy` says which there must be.
pub fn check_missing(place: &Place, missing: &[&str], remedy: &str) -> Result<()> {
    if missing.is_empty() {
        return Ok(());
    }
    let s = if missing.len() == 1 { "" } else { "s" };
    let problem = format!("column{s} {} missing", missing.join(", "));
    Err(place.error(problem).remedy(remedy))
}

/// What to do about a row with more cells than the head has names; the remedy of an error.
pub const DECIMAL_COMMAS: &str =
    "numbers take a decimal point, or, where semicolons separate the columns, a comma";

/// Returns what is wrong with a row that has more cells than a table has `columns`; empty cells do
/// not count.
pub fn surplus<'a>(cells: impl Iterator<Item = &'a str> + Clone, columns: usize) -> Option<String> {
    let more = cells.clone().skip(columns).find(|cell| !cell.is_empty())?;
    let (count, more) = (cells.count(), quoted(more));
    Some(format!("{count} cells, with {more} in the last, but {columns} columns"))
}

/// Columns whose cells are names, which may begin with `#`, if they are the first of a table.
const NAMES: [&str; 2] = ["id", "captor"];

/// Returns what separates the columns of a table by one of its lines: a semicolon, a tab or a
/// comma, the first of these that occurs; `None` means blanks.
pub fn separator(line: &str) -> Option<char> {
    [';', '\t', ','].into_iter().find(|&c| line.contains(c))
}

/// Reads a cell as a finite number. Where something else than commas separates the columns,
/// decimals may have a comma.
pub fn number(cell: &str, separator: Option<char>) -> Option<f64> {
    let parsed = match separator {
        Some(',') => cell.parse(),
        _ => cell.replace(',', ".").parse(),
    };
    parsed.ok().filter(|x: &f64| x.is_finite())
}

/// Returns whether a line is a comment: its first character is `#`.
pub fn is_comment(line: &str) -> bool {
    line.trim_start().starts_with('#')
}

/// Returns the records of the CSV file at `path`, like [`separated`] by commas.
pub fn records<'a>(
    bytes: &'a [u8],
    path: &'a Path,
) -> impl Iterator<Item = Result<(Place<'a>, StringRecord)>> {
    separated(bytes, path, ',')
}

/// Returns the records of the CSV file at `path`, with the blanks around each cell removed. Rows
/// without content, which spreadsheets leave below a table, are skipped, but never the first
/// record. Comments are skipped too, except rows of a full length where the first column holds
/// names. Error: a record is not UTF-8 text.
pub fn separated<'a>(
    bytes: &'a [u8],
    path: &'a Path,
    separator: char,
) -> impl Iterator<Item = Result<(Place<'a>, StringRecord)>> {
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    let mut csv = ReaderBuilder::new();
    csv.delimiter(separator as u8).has_headers(false).flexible(true);
    let mut csv = csv.from_reader(bytes);
    let mut lines = LineCounter { bytes, at: 0, line: 1 };
    let mut first = true;
    let mut names = None;
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
            if record.get(0).is_some_and(is_comment) && names != Some(record.len()) {
                continue;
            }
            if first && record.get(0).is_some_and(|name| NAMES.contains(&name)) {
                names = Some(record.len());
            }
            if !std::mem::take(&mut first) && record.iter().all(str::is_empty) {
                continue;
            }
            return Some(Ok((place, record)));
        }
        None
    })
}

/// Reads the table at `path`: `head` its first record, `row` each other by what that gave. Error:
/// there are no rows; the sentence says so by `what` they are, and what the `header` must be.
pub fn rows<H, R>(
    bytes: &[u8],
    path: &Path,
    (what, header): (&str, &str),
    head: impl FnOnce(&StringRecord, &Place) -> Result<H>,
    mut row: impl FnMut(&H, &StringRecord, &Place) -> Result<R>,
) -> Result<Vec<R>> {
    let none = |found: String| Err(Error::input(path.display(), found).remedy(header));
    let mut records = records(bytes, path);
    let Some((place, first)) = records.next().transpose()? else {
        return none("is empty".into());
    };
    let head = head(&first, &place)?;
    let read = records.map(|record| record.and_then(|(place, record)| row(&head, &record, &place)));
    let rows: Vec<R> = read.collect::<Result<_>>()?;
    if rows.is_empty() { none(format!("holds no {what}")) } else { Ok(rows) }
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

#[cfg(test)]
mod tests {
    use super::*;

    /// Comments are skipped, but no captor whose id begins with `#`.
    #[test]
    fn comments_are_skipped() {
        let cells = |text: &'static str| -> Vec<(u64, String)> {
            let records = records(text.as_bytes(), Path::new("a.csv"));
            let lines = records.map(|record| record.map(|(p, r)| (p.line, r.iter().collect())));
            lines.collect::<Result<_>>().unwrap()
        };
        let text = "# a, b\n #c\n\nx,y\n#1,2\n3,4\n# end";
        assert_eq!(cells(text), [(4, "xy".into()), (6, "34".into())]);
        let text = "id,x\n#1,2\n# a comment\nb,3\n";
        assert_eq!(cells(text), [(1, "idx".into()), (2, "#12".into()), (4, "b3".into())]);
    }

    #[test]
    fn decimals_may_have_a_comma_where_no_comma_separates() {
        assert_eq!(number("0,5", Some(';')), Some(0.5));
        assert_eq!(number("-1,5e1", None), Some(-15.0));
        assert_eq!(number("0,5", Some(',')), None);
        assert_eq!(number("1,000.5", Some('\t')), None);
        assert_eq!(number("inf", None), None);
    }
}
