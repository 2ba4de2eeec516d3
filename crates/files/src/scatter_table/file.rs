//! The content of a file of scattering functions, and the bands that it is read for.

use phylux_core::scene::material::BsdfFaces;

/// The largest number of values in a file.
pub(super) const MOST: usize = 20_000_000;

/// What a file says about a sheet.
#[derive(Debug)]
pub struct ScatterTable {
    /// The scattering function.
    pub faces: BsdfFaces,
    /// Messages for the user: ranges of angles that the file does not cover, and what it says that
    /// is not used.
    pub warnings: Vec<String>,
    /// The largest share of light that may go on; above 1, all values are then scaled down.
    pub tolerated: f64,
}

/// The bands that a file is read for.
#[derive(Clone, Copy, Debug)]
pub struct Wanted<'a> {
    /// Names of the bands.
    pub bands: &'a [&'a str],
    /// Wavelengths of the bands, nm, where they are known.
    pub limits: &'a [Option<[f64; 2]>],
    /// Whether the user has named them. If not, a table with a single column of values is used
    /// whatever the name of that column.
    pub named: bool,
    /// The side of a device that is the front here; files of four angles name their front.
    pub front: Side,
}

/// A side of a device that WINDOW describes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Side {
    /// The side that its files call the front.
    #[default]
    Outside,
    /// The side that its files call the back.
    Inside,
}
