//! The text of a photometric file, and the distribution that is read from it.

use std::{fmt::Display, path::Path, sync::Arc};

use super::symmetry::{Plane, Symmetry, round};
use crate::input::quoted;
use phylux_core::{
    error::{Error, Result},
    scene::light::IntensityTable,
};

/// The remedy for a damaged file.
pub(super) const FETCH: &str = "the file is broken: fetch it again, or export it anew";

/// The largest number of intensities in a file.
pub(super) const MOST: usize = 1_000_000;

/// What a photometric file says of the lamps in a luminaire.
#[derive(Clone, Debug)]
pub struct Photometry {
    /// The sets of lamps that may be in the luminaire one at a time (EULUMDAT), or its emitters,
    /// which shine together (TM-33); at least one.
    pub lamps: Vec<MeasuredLamp>,
    /// Index of the first set that has lamps and light; `None` where several emitters shine
    /// together, so that none stands for all.
    pub usual: Option<usize>,
}

/// The intensity distribution of a lamp, and its flux.
#[derive(Clone, Debug)]
pub struct MeasuredLamp {
    /// The shape of the distribution, scaled to a flux of 1.
    pub table: Arc<IntensityTable>,
    /// The flux that the lamp emits according to the file, in `unit`: the integral of its
    /// intensities (times the factors of the file) over all directions; 0 for a set without light.
    pub flux: f64,
    /// The unit of the flux.
    pub unit: FluxUnit,
    /// Wavelengths between which it counts, nm; `None` where the file does not say it.
    pub range: Option<[f64; 2]>,
    /// What a user of the flux should know of it.
    pub notes: Vec<String>,
}

/// The unit of the flux that a file states.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FluxUnit {
    /// Lumens.
    Lumen,
    /// Watts of light.
    Watt,
    /// Photons, umol/s.
    Micromole,
}

impl FluxUnit {
    /// Returns the name of the unit.
    pub fn name(self) -> &'static str {
        match self {
            Self::Lumen => "lm",
            Self::Watt => "W",
            Self::Micromole => "umol/s",
        }
    }
}

impl MeasuredLamp {
    /// Makes a lamp from the planes in the file at the vertical angles `v`, degrees; its flux is
    /// theirs. Error: the angles or intensities make no distribution.
    pub(super) fn new(
        path: &Path,
        planes: Vec<Plane>,
        symmetry: Symmetry,
        v: &[f64],
    ) -> Result<Self> {
        let (c, values) = round(planes, symmetry);
        let table =
            IntensityTable::new(&c, v, values).map_err(|problem| problem.at(path.display()))?;
        let (flux, table) = (table.flux(), Arc::new(table));
        Ok(Self { table, flux, unit: FluxUnit::Lumen, range: None, notes: Vec::new() })
    }

    /// Returns the lamp with `scale` times its flux. Error: that is not 0, and beyond 1e-30 to 1e30.
    pub(super) fn scaled(&self, path: &Path, scale: f64) -> Result<Self> {
        let flux = scale * self.flux;
        if flux != 0.0 && !(1e-30..1e30).contains(&flux) {
            let problem = format!("a flux of {flux:e}");
            return Err(Error::input(path.display(), problem).remedy(FETCH));
        }
        Ok(Self { flux, ..self.clone() })
    }
}

/// The lines of a file, with its path for errors.
pub(super) struct File<'a> {
    pub(super) path: &'a Path,
    pub(super) lines: Vec<&'a str>,
}

impl File<'_> {
    /// Returns an error at a line; `line` counts from 0.
    pub(super) fn error(&self, line: usize, problem: impl Display) -> Error {
        Error::input(format!("{}:{}", self.path.display(), line + 1), problem)
    }

    /// Reads a finite number. Error, at the line: `word` is not one; `what` names the value.
    pub(super) fn number(&self, line: usize, word: &str, what: impl Display) -> Result<f64> {
        word.parse().ok().filter(|x: &f64| x.is_finite()).ok_or_else(|| {
            self.error(line, format!("{what} is {}, not a finite number", quoted(word)))
                .remedy(FETCH)
        })
    }

    /// Reads a whole number within a range. Error, at the line: `word` is not one; `what` names the
    /// value.
    pub(super) fn count(
        &self,
        line: usize,
        word: &str,
        what: &str,
        range: std::ops::RangeInclusive<usize>,
    ) -> Result<usize> {
        let value = self.number(line, word, what)?;
        let count = value as usize;
        if count as f64 == value && range.contains(&count) {
            return Ok(count);
        }
        let (low, high) = (range.start(), range.end());
        let problem = format!("{what} is {}, must be {low} to {high}", quoted(word));
        Err(self.error(line, problem).remedy(FETCH))
    }
}
