//! Reads a column of a table of spectra.

use std::path::Path;

use super::kinds::Column;
use crate::{
    csv_table::{DECIMAL_COMMAS, Place, is_comment, number, separator, surplus},
    input::quoted,
};
use phylux_core::{
    error::{Error, Result, nearest},
    math::curve::Curve,
};

/// The first line of a table.
struct Head<'a> {
    place: Place<'a>,
    /// Whether its cells are names, or already the first numbers.
    named: bool,
    cells: Vec<String>,
}

impl Head<'_> {
    /// Returns the number of columns. Empty names at the end are none: spreadsheets leave them.
    fn columns(&self) -> usize {
        self.cells.iter().rposition(|name| !name.is_empty()).map_or(0, |last| last + 1)
    }

    /// Returns the index of a column of values. Error: there is none, or there are two of the name.
    fn index(&self, column: Column) -> Result<usize> {
        let count = self.cells.len();
        match column {
            Column::Number(number) => usize::try_from(number)
                .ok()
                .filter(|number| (2..=count).contains(number))
                .map(|number| number - 1)
                .ok_or_else(|| {
                    self.place
                        .error(format!("column {number} of {count}"))
                        .remedy("columns count from 1, and the first has the wavelengths")
                }),
            Column::Name(name) if !self.named => {
                let problem = format!("no header that names a column {}", quoted(name));
                Err(self.place.error(problem).remedy("give its number: 2 is the second"))
            }
            Column::Name(name) => self.named_index(name),
        }
    }

    /// Returns the index of the column of values of this name.
    fn named_index(&self, name: &str) -> Result<usize> {
        let mut fits = (1..self.cells.len()).filter(|&column| self.cells[column] == name);
        match (fits.next(), fits.next()) {
            (Some(column), None) => Ok(column),
            (Some(_), Some(twice)) => {
                let problem = format!("column {} is named {} too", twice + 1, quoted(name));
                Err(self.place.error(problem).remedy("give the number of the one that is meant"))
            }
            (None, _) => {
                let known = || self.cells.iter().skip(1).take(20).map(String::as_str);
                let all = known().map(quoted).collect::<Vec<_>>().join(", ");
                let error = self.place.error(format!("no column {}", quoted(name)));
                Err(error.did_you_mean_of(nearest(name, known()), &all))
            }
        }
    }
}

/// A row of numbers.
struct Row<'a> {
    place: Place<'a>,
    cells: Vec<String>,
    separator: Option<char>,
}

impl Row<'_> {
    /// Reads the finite number in a column; `what` names it for the error.
    fn number(&self, column: usize, what: &str) -> Result<f64> {
        let cell = self.cells.get(column).map_or("", String::as_str);
        number(cell, self.separator).ok_or_else(|| {
            self.place
                .error(format!("{what} is {}, not a finite number", quoted(cell)))
                .remedy(DECIMAL_COMMAS)
        })
    }
}

/// Reads a column of the table in the `bytes` of the file at `path`.
pub(super) fn parse(bytes: &[u8], path: &Path, column: Column) -> Result<Curve> {
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    let text = String::from_utf8_lossy(bytes);
    let lines = text.lines().zip(1u64..).filter(|(line, _)| !line.trim().is_empty());
    let comment = lines.clone().take_while(|(line, _)| is_comment(line)).last();
    let mut lines = lines.filter(|(line, _)| !is_comment(line)).peekable();
    let Some(&(first, line)) = lines.peek() else {
        let remedy = "a table has wavelengths, nm, and values in columns";
        return Err(Error::input(path.display(), "is empty").remedy(remedy));
    };
    let separator = separator(first);
    let first = cells(first, separator);
    let has_header = number(&first[0], separator).is_none();
    let names =
        comment.map(|(comment, _)| cells(comment.trim().trim_start_matches('#'), separator));
    let names = names.filter(|names| !has_header && names.len() == first.len());
    let named = has_header || names.is_some();
    let head = Head { place: Place { path, line }, named, cells: names.unwrap_or(first) };
    let rows = lines.skip(usize::from(has_header));
    let rows = rows.map(|(text, line)| (cells(text, separator), line));
    if separator == Some(',') && head.cells.len() > 2 && !named {
        check_commas(rows.clone().map(|(cells, _)| cells)).map_err(|problem| {
            head.place
                .error(problem)
                .remedy("name the columns in a first line, or separate them by semicolons")
        })?;
    }
    let index = head.index(column)?;
    let columns = head.columns();
    let mut points: Vec<[f64; 2]> = Vec::new();
    for (cells, line) in rows {
        let row = Row { place: Place { path, line }, cells, separator };
        if let Some(problem) = surplus(row.cells.iter().map(String::as_str), columns) {
            return Err(row.place.error(problem).remedy(DECIMAL_COMMAS));
        }
        let (nm, value) = (row.number(0, "the wavelength")?, row.number(index, "the value")?);
        let last = points.last().map_or(0.0, |point| point[0]);
        if nm < 0.0 || nm <= last && !points.is_empty() {
            let problem = format!("the wavelength {nm} nm comes after {last} nm");
            return Err(row.place.error(problem).remedy("sort the rows by wavelength"));
        }
        points.push([nm, value]);
    }
    Curve::new(points).map_err(|problem| problem.at(path.display()))
}

/// Splits a line into cells, without quotes and surrounding blanks.
fn cells(line: &str, separator: Option<char>) -> Vec<String> {
    let mut cells = vec![String::new()];
    let mut in_quotes = false;
    for c in line.trim().chars() {
        let ends = match separator {
            Some(separator) => c == separator,
            None => c.is_whitespace(),
        };
        match c {
            '"' => in_quotes = !in_quotes,
            _ if ends && !in_quotes => {
                // consecutive blanks separate only once
                if separator.is_some() || cells.last().is_some_and(|cell| !cell.is_empty()) {
                    cells.push(String::new());
                }
            }
            _ => cells.last_mut().into_iter().for_each(|cell| cell.push(c)),
        }
    }
    cells.into_iter().map(|cell| cell.trim().to_string()).collect()
}

/// Refuses rows without a head and without any decimal point, of which nobody can tell whether
/// their commas separate columns or decimals.
fn check_commas(mut rows: impl Iterator<Item = Vec<String>>) -> std::result::Result<(), String> {
    let whole = |cell: &String| cell.chars().all(|c| c.is_ascii_digit() || c == '-');
    match rows.all(|row| row.iter().skip(1).all(whole)) {
        true => Err("rows of whole numbers between commas, without names of their columns: \
            `400,0,05` may be two numbers or three"
            .into()),
        false => Ok(()),
    }
}
