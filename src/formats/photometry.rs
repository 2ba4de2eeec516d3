//! Measured lamps: intensity distributions in the IES format (ANSI/IES LM-63, 1986 to 2019, type C) and in EULUMDAT.
//!
//! Both give intensities at vertical angles (0 is where the lamp aims) for horizontal angles C, of which a
//! symmetric lamp needs but a part: [`Symmetry::round`] completes the circle.

mod eulumdat;
mod lm63;
mod symmetry;
#[cfg(test)]
mod tests;

use std::{fmt::Display, path::Path, sync::Arc};

use symmetry::{Plane, Symmetry, round};

use super::input::quoted;
use crate::{
    error::{Error, Result},
    scene::light::IntensityTable,
};

/// What to do about a broken file.
const FETCH: &str = "the file is broken: fetch it again, or export it anew";

/// The most intensities in a file.
const MOST: usize = 1_000_000;

/// The intensity distribution of a lamp.
#[derive(Clone, Debug)]
pub struct Photometry {
    /// Its shape, scaled to a flux of 1.
    pub table: Arc<IntensityTable>,
    /// What the file says that the lamp emits: the integral of its intensities (candela times the factors of the file)
    /// over all directions.
    pub flux: f64,
}

impl Photometry {
    /// Reads the `bytes` of the file at `path`; a line that begins with `TILT=` makes it LM-63.
    ///
    /// # Errors
    /// At the line of the file: neither of both formats, other coordinates than type C, a tilt, numbers that are
    /// missing, not finite, negative or left over, angles that do not rise or do not fit the symmetry, no light.
    pub fn parse(bytes: &[u8], path: &Path) -> Result<Self> {
        let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
        // names are in any encoding; numbers are ASCII in all of them
        let text = String::from_utf8_lossy(bytes);
        let file = File { path, lines: text.lines().collect() };
        match file.lines.iter().position(|line| line.trim_start().starts_with("TILT=")) {
            Some(tilt) => lm63::read(&file, tilt),
            None => eulumdat::read(&file),
        }
    }

    /// From the planes that a file has, in candela.
    fn new(file: &File, planes: Vec<Plane>, symmetry: Symmetry, v: &[f64]) -> Result<Self> {
        let (c, values) = round(planes, symmetry);
        let table = IntensityTable::new(&c, v, values)
            .map_err(|problem| problem.at(file.path.display()))?;
        Ok(Self { flux: table.flux(), table: Arc::new(table) })
    }
}

/// The lines of a file, for errors.
struct File<'a> {
    path: &'a Path,
    lines: Vec<&'a str>,
}

impl File<'_> {
    /// At a line that counts from 0.
    fn error(&self, line: usize, problem: impl Display) -> Error {
        Error::input(format!("{}:{}", self.path.display(), line + 1), problem)
    }

    /// A finite number.
    fn number(&self, line: usize, word: &str, what: impl Display) -> Result<f64> {
        word.parse().ok().filter(|x: &f64| x.is_finite()).ok_or_else(|| {
            self.error(line, format!("{what} is {}, not a finite number", quoted(word)))
                .remedy(FETCH)
        })
    }

    /// A whole number in a range.
    fn count(
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
