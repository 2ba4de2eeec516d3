//! Tables of spectra: wavelengths, nm, in the first column, and values in the others.
//!
//! Columns are separated by semicolons (decimals may then have a comma), tabs, commas or blanks:
//! the first of these that occurs in the first line. Text may be in quotes. A first line that does
//! not begin with a number is the header.

#[cfg(test)]
mod tests;

use std::path::Path;

use super::input::quoted;
use crate::{
    error::{Error, Result, nearest},
    math::curve::Curve,
};

/// A column of a table.
#[derive(Clone, Copy, Debug)]
pub enum Column<'a> {
    /// The number of the column, from 1; column 1 holds the wavelengths.
    Number(u64),
    /// The name of the column in the header.
    Name(&'a str),
}

/// Reads a column of the table in the `bytes` of the file at `path`.
///
/// # Errors
/// At the line of the file: there is no such column, a value is missing or not a finite number, or
/// wavelengths are negative or do not increase. At the file: it has fewer than two rows.
pub fn parse(bytes: &[u8], path: &Path, column: Column) -> Result<Curve> {
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    let text = String::from_utf8_lossy(bytes);
    let mut lines = text.lines().zip(1..).filter(|(line, _)| !line.trim().is_empty()).peekable();
    let error =
        |line: u64, problem: String| Error::input(format!("{}:{line}", path.display()), problem);
    let Some(&(first, line)) = lines.peek() else {
        let remedy = "a table has wavelengths, nm, and values in columns";
        return Err(Error::input(path.display(), "is empty").remedy(remedy));
    };
    let separator = [';', '\t', ','].into_iter().find(|&c| first.contains(c));
    let header = cells(first, separator);
    let has_header = value(&header[0], separator).is_none();
    let index = match column {
        Column::Number(number) => match usize::try_from(number) {
            Ok(number) if (2..=header.len()).contains(&number) => number - 1,
            _ => {
                let problem = format!("column {number} of {}", header.len());
                return Err(error(line, problem)
                    .remedy("columns count from 1, and the first has the wavelengths"));
            }
        },
        Column::Name(name) => {
            let known = || header.iter().skip(1).take(20).map(String::as_str);
            match header.iter().skip(1).position(|other| other == name) {
                Some(position) if has_header => position + 1,
                _ if !has_header => {
                    let problem = format!("no header that names a column {}", quoted(name));
                    return Err(error(line, problem).remedy("give its number: 2 is the second"));
                }
                _ => {
                    let all = known().map(quoted).collect::<Vec<_>>().join(", ");
                    let remedy = match nearest(name, known()) {
                        Some(near) => format!("did you mean `{near}`? (there are {all})"),
                        None => format!("there are {all}"),
                    };
                    return Err(error(line, format!("no column {}", quoted(name))).remedy(remedy));
                }
            }
        }
    };
    let mut points: Vec<[f64; 2]> = Vec::new();
    for (text, line) in lines.skip(usize::from(has_header)) {
        let cells = cells(text, separator);
        let number = |i: usize, what: &str| {
            let cell = cells.get(i).map_or("", String::as_str);
            value(cell, separator).ok_or_else(|| {
                error(line, format!("{what} is {}, not a finite number", quoted(cell)))
                    .remedy("decimals take a point or, between semicolons, a comma")
            })
        };
        let (nm, value) = (number(0, "the wavelength")?, number(index, "the value")?);
        let last = points.last().map_or(0.0, |point| point[0]);
        if nm < 0.0 || nm <= last && !points.is_empty() {
            let problem = format!("the wavelength {nm} nm comes after {last} nm");
            return Err(error(line, problem).remedy("sort the rows by wavelength"));
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

/// Reads a cell as a finite number.
fn value(cell: &str, separator: Option<char>) -> Option<f64> {
    let parsed = match separator {
        Some(';') => cell.replace(',', ".").parse(),
        _ => cell.parse(),
    };
    parsed.ok().filter(|x: &f64| x.is_finite())
}
