//! Measured scattering functions of thin sheets: tables of four angles (CSV), and the matrices of
//! WINDOW (Klems, XML).
//!
//! Both give f, 1/sr, for pairs of directions of incidence and exit. Light arrives at the front or
//! at the back, and is reflected or transmitted.

mod csv;
mod file;
mod klems;
#[cfg(test)]
mod tests;

use std::path::Path;

pub use file::{ScatterTable, Side, Wanted};

use phylux_core::error::Result;

/// Reads the `bytes` of the file at `path`: a file of WINDOW if its name ends with `.xml`,
/// otherwise a CSV file.
///
/// # Errors
/// At the line of a CSV file: columns or numbers are missing or wrong, or pairs of directions are
/// missing or repeated. In an XML file: it is not XML or has no matrix of Klems' patches, or
/// numbers are missing, left over or wrong. In both: values are below 0, or a band has no values.
pub fn parse(bytes: &[u8], path: &Path, wanted: Wanted) -> Result<ScatterTable> {
    let extension = path.extension().unwrap_or_default();
    match extension.eq_ignore_ascii_case("xml") {
        true => klems::parse(bytes, path, wanted),
        false => csv::parse(bytes, path, wanted),
    }
}
