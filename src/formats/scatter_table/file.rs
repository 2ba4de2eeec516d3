//! The content of a file of scattering functions, and the bands that it is read for.

use crate::scene::material::BsdfFaces;

/// The largest number of values in a file.
pub(super) const MOST: usize = 20_000_000;

/// What a file says about a sheet.
#[derive(Debug)]
pub struct ScatterTable {
    /// The scattering function.
    pub faces: BsdfFaces,
    /// Messages for the user: ranges of angles that the file does not cover.
    pub warnings: Vec<String>,
}

/// The bands that a file is read for.
#[derive(Clone, Copy, Debug)]
pub struct Wanted<'a> {
    /// Names of the bands.
    pub bands: &'a [&'a str],
    /// Whether the user has named them. If not, a table with a single column of values is used
    /// whatever the name of that column.
    pub named: bool,
}
