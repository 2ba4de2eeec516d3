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
mod table;
#[cfg(test)]
mod tests;

use std::path::Path;

pub use kinds::{Column, Counts, Measured, Share};

use super::xml;
use phylux_core::error::Result;

/// Reads a spectrum from the `bytes` of the file at `path`: a column of a table, or a spectrum of a
/// file of the IES, in which column 2 is the first spectrum, and names are those of emitters.
///
/// # Errors
/// At the line of a table: there is no such column, a value is missing or not a finite
/// number, or wavelengths are negative or do not increase; at the table: it has fewer than two
/// rows. At the line of an XML file: it is neither TM-27 nor TM-33, has no such spectrum, or one
/// whose values or wavelengths are wrong.
pub fn parse(bytes: &[u8], path: &Path, column: Column) -> Result<Measured> {
    match xml::is_xml(bytes) {
        true => ies::parse(bytes, path, column),
        false => Ok(Measured {
            curve: table::parse(bytes, path, column)?,
            counts: None,
            names: Vec::new(),
        }),
    }
}
