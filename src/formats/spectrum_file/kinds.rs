//! What is asked of a file of spectra, and what is read from it.

use crate::math::curve::Curve;

/// A column of a table.
#[derive(Clone, Copy, Debug)]
pub enum Column<'a> {
    /// The number of the column, from 1; column 1 holds the wavelengths.
    Number(u64),
    /// The name of the column in the header.
    Name(&'a str),
}

/// What the values of a spectrum are, where its file says it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Counts {
    /// Energy of light per nm, in any unit.
    Energy,
    /// The share of the light that a surface reflects, lets through or absorbs.
    Share,
}

/// A spectrum that was read from a file.
#[derive(Clone, Debug, PartialEq)]
pub struct Measured {
    /// The values over the wavelengths, nm.
    pub curve: Curve,
    /// What the values are; `None` in tables, which do not say it.
    pub counts: Option<Counts>,
}
