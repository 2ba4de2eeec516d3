//! What is read from a file, and for which bands.

use crate::scene::material::BsdfFaces;

/// The most values in a file.
pub(super) const MOST: usize = 20_000_000;

/// What a file says about a sheet.
#[derive(Debug)]
pub struct ScatterTable {
    /// The scattering function.
    pub faces: BsdfFaces,
    /// What a user should know: angles that it does not reach.
    pub warnings: Vec<String>,
}

/// The bands that a file is read for.
#[derive(Clone, Copy, Debug)]
pub struct Wanted<'a> {
    /// Their names.
    pub bands: &'a [&'a str],
    /// Whether the user has named them; else a table of one column has their values, whatever its name.
    pub named: bool,
}
