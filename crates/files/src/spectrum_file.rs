//! Tables of spectra: wavelengths, nm, in the first column, and values in the others.
//!
//! Columns are separated by semicolons, tabs, commas or blanks: the first of these that occurs in
//! the first line. Decimals may have a comma, except where commas separate. Text may be in quotes.
//! Lines that begin with `#` are comments. A first line that does not begin with a number is the
//! header; where there is none, a comment just before the numbers names the columns, if it has one
//! word for each.

//!
//! Files of XML are those of the IES: TM-27 (`.spdx`) and TM-33 (`ies`).

mod ies;
mod kinds;
#[cfg(test)]
mod tests;

use std::path::Path;

pub use kinds::{Column, Counts, Measured, Share};

use super::{
    csv_table::{DECIMAL_COMMAS, is_comment, number, separator},
    input::quoted,
    xml,
};
use phylux_core::{
    error::{Error, Result, nearest},
    math::curve::Curve,
};

/// Reads a spectrum from the `bytes` of the file at `path`: a column of a table, or a spectrum of a
/// file of the IES, in which column 2 is the first spectrum, and names are those of emitters.
///
/// # Errors
/// Those of a table ([`parse_table`]), and at the line of an XML file: it is neither TM-27 nor
/// TM-33, has no such spectrum, or one whose values or wavelengths are wrong.
pub fn parse(bytes: &[u8], path: &Path, column: Column) -> Result<Measured> {
    match xml::is_xml(bytes) {
        true => ies::parse(bytes, path, column),
        false => Ok(Measured {
            curve: parse_table(bytes, path, column)?,
            counts: None,
            names: Vec::new(),
        }),
    }
}

/// Reads a column of the table in the `bytes` of the file at `path`.
///
/// # Errors
/// At the line of the file: there is no such column, a value is missing or not a finite number, or
/// wavelengths are negative or do not increase. At the file: it has fewer than two rows.
fn parse_table(bytes: &[u8], path: &Path, column: Column) -> Result<Curve> {
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    let text = String::from_utf8_lossy(bytes);
    let error =
        |line: u64, problem: String| Error::input(format!("{}:{line}", path.display()), problem);
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
    let header = names.unwrap_or(first);
    let mut rows = lines.skip(usize::from(has_header));
    if !has_header && separator == Some(',') && header.len() > 2 && !named {
        check_commas(rows.clone().map(|(text, _)| cells(text, separator))).map_err(|problem| {
            error(line, problem)
                .remedy("name the columns in a first line, or separate them by semicolons")
        })?;
    }
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
            let mut fits = (1..header.len()).filter(|&column| header[column] == name);
            match (fits.next(), fits.next()) {
                (Some(_), Some(twice)) if named => {
                    let problem = format!("column {} is named {} too", twice + 1, quoted(name));
                    let remedy = "give the number of the one that is meant";
                    return Err(error(line, problem).remedy(remedy));
                }
                (Some(column), _) if named => column,
                _ if !named => {
                    let problem = format!("no header that names a column {}", quoted(name));
                    return Err(error(line, problem).remedy("give its number: 2 is the second"));
                }
                _ => {
                    let all = known().map(quoted).collect::<Vec<_>>().join(", ");
                    let error = error(line, format!("no column {}", quoted(name)));
                    return Err(error.did_you_mean_of(nearest(name, known()), &all));
                }
            }
        }
    };
    let mut points: Vec<[f64; 2]> = Vec::new();
    // cells below an empty name, which spreadsheets leave at the end of a line, are empty too
    let columns = header.iter().rposition(|name| !name.is_empty()).map_or(0, |last| last + 1);
    for (text, line) in &mut rows {
        let cells = cells(text, separator);
        if let Some(more) = cells.iter().skip(columns).find(|cell| !cell.is_empty()) {
            let problem = format!(
                "{} cells, with {} in the last, but {columns} columns",
                cells.len(),
                quoted(more)
            );
            return Err(error(line, problem).remedy(DECIMAL_COMMAS));
        }
        let number = |i: usize, what: &str| {
            let cell = cells.get(i).map_or("", String::as_str);
            number(cell, separator).ok_or_else(|| {
                error(line, format!("{what} is {}, not a finite number", quoted(cell)))
                    .remedy(DECIMAL_COMMAS)
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
