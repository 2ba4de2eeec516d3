//! Measured scattering functions of thin sheets: tables of four angles (CSV), and the matrices of WINDOW (Klems, XML).
//!
//! Both give f, 1/sr, for directions of incidence and exit. Light comes to the front or the back, and goes back or through.

mod csv;
mod file;
mod klems;
#[cfg(test)]
mod tests;

use std::path::Path;

pub use file::{ScatterTable, Wanted};

use crate::error::Result;

/// Reads the `bytes` of the file at `path`; a name that ends with `.xml` is one of WINDOW, another a CSV file.
///
/// # Errors
/// At the line of a CSV file: columns or numbers that are missing or wrong, pairs of directions that are missing or come
/// twice. Of XML: what is not XML or no matrix of Klems' patches, numbers that are missing, left over or wrong. Of both:
/// values below 0, a band without values.
pub fn parse(bytes: &[u8], path: &Path, wanted: Wanted) -> Result<ScatterTable> {
    let extension = path.extension().unwrap_or_default();
    match extension.eq_ignore_ascii_case("xml") {
        true => klems::parse(bytes, path, wanted),
        false => csv::parse(bytes, path, wanted),
    }
}
