//! What is asked of a file of spectra, and what is read from it.

use phylux_core::math::curve::Curve;

/// A column of a table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
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
    /// A share of the light on a surface.
    Share(Share),
}

/// Which share of the light on a surface a spectrum is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Share {
    /// What it reflects.
    Reflectance,
    /// What it lets through.
    Transmittance,
    /// What it absorbs.
    Absorptance,
}

impl Share {
    /// Returns the name of the share, which is also that of the key that takes it, where there is one.
    pub fn name(self) -> &'static str {
        match self {
            Self::Reflectance => "reflectance",
            Self::Transmittance => "transmittance",
            Self::Absorptance => "absorptance",
        }
    }
}

/// A spectrum that was read from a file.
#[derive(Clone, Debug, PartialEq)]
pub struct Measured {
    /// The values over the wavelengths, nm.
    pub curve: Curve,
    /// What the values are; `None` in tables, which do not say it.
    pub counts: Option<Counts>,
    /// The names of all spectra that the file holds, if it is of the IES; empty for a table.
    pub names: Vec<String>,
}
