//! Reads ANSI/IES LM-63: keywords, then numbers, which blanks, commas and line ends separate
//! anywhere.

use super::{
    file::{FETCH, File, MOST, MeasuredLamp, Photometry},
    symmetry::{Plane, Symmetry, symmetry_of},
};
use crate::input::quoted;
use phylux_core::error::{Error, Result};

/// The numbers after the tilt, in order, with their lines.
struct Numbers<'a> {
    file: &'a File<'a>,
    words: Box<dyn Iterator<Item = (usize, &'a str)> + 'a>,
    line: usize,
}

/// What the numbers before the angles say.
struct Head {
    /// The number of vertical angles.
    vertical: usize,
    /// The number of horizontal angles.
    horizontal: usize,
    /// What the intensities are multiplied by.
    factor: f64,
}

impl<'a> Numbers<'a> {
    /// The numbers after line `at`.
    fn after(file: &'a File, at: usize) -> Self {
        let separators = |c: char| c.is_whitespace() || c == ',' || c == '\u{1a}';
        let lines = file.lines.iter().enumerate().skip(at + 1);
        let words =
            lines.flat_map(move |(i, line)| line.split(separators).map(move |word| (i, word)));
        let words = Box::new(words.filter(|(_, word)| !word.is_empty()));
        Self { file, words, line: file.lines.len().saturating_sub(1) }
    }

    fn word(&mut self, what: impl std::fmt::Display) -> Result<&str> {
        let Some((line, word)) = self.words.next() else {
            let problem = format!("the file ends before {what}");
            return Err(self.file.error(self.line, problem).remedy(FETCH));
        };
        self.line = line;
        Ok(word)
    }

    fn number(&mut self, what: &str) -> Result<f64> {
        let word = self.word(what)?.to_string();
        self.file.number(self.line, &word, what)
    }

    fn count(&mut self, what: &str, most: usize) -> Result<usize> {
        let word = self.word(what)?.to_string();
        self.file.count(self.line, &word, what, 1..=most)
    }

    fn list(&mut self, what: &str, count: usize) -> Result<Vec<f64>> {
        (1..=count).map(|i| self.number(&format!("{what} {i} of {count}"))).collect()
    }

    /// Reads the table of TILT=INCLUDE, and returns its factor where the tilt is 0.
    fn factor_at_tilt_0(&mut self) -> Result<f64> {
        self.count("how the lamp lies in the luminaire", 3)?;
        let pairs = self.count("the number of tilts", MOST)?;
        let tilts = self.list("tilt", pairs)?;
        let factors = self.list("factor of tilt", pairs)?;
        let zero = tilts.iter().position(|&tilt| tilt == 0.0).map(|i| factors[i]);
        zero.filter(|factor| *factor > 0.0).ok_or_else(|| {
            let problem = "the table of tilts has no factor above 0 for the tilt 0";
            self.error(problem).remedy("export it with TILT=NONE")
        })
    }

    /// Reads the numbers between the tilt, where the flux is `tilt` times that in the file, and the
    /// angles.
    fn head(&mut self, tilt: f64) -> Result<Head> {
        self.number("the number of lamps")?;
        self.number("the lumens of a lamp")?;
        let multiplier = self.number("the multiplier of candela")?;
        let vertical = self.count("the number of vertical angles", MOST)?;
        let horizontal = self.count("the number of horizontal angles", MOST)?;
        let kind = self.number("the photometric type")?;
        if kind != 1.0 {
            return Err(self.error(format!("photometric type {kind}, must be 1 (C)")).remedy(
                "export it with type C coordinates; 3 (A) and 2 (B) are for car lamps and floodlights",
            ));
        }
        if vertical.saturating_mul(horizontal) > MOST {
            let problem = format!("{vertical} x {horizontal} angles, more than {MOST} intensities");
            return Err(self.error(problem).remedy("export it with fewer angles"));
        }
        for what in ["the unit of lengths", "the width", "the length", "the height"] {
            self.number(what)?;
        }
        let ballast = self.number("the ballast factor")?;
        let photometric = self.number("the ballast-lamp photometric factor")?;
        self.number("the input watts")?;
        let old = before_1995(self.file.lines[0].trim());
        let factor = multiplier * ballast * if old { photometric } else { 1.0 } * tilt;
        if !(factor > 0.0 && factor.is_finite()) {
            let problem = format!("multiplier and ballast factor make {factor}, must be above 0");
            return Err(self.error(problem).remedy(FETCH));
        }
        Ok(Head { vertical, horizontal, factor })
    }

    /// Reads the intensities at the vertical angles for one horizontal angle after the other.
    fn planes(&mut self, c: &[f64], vertical: usize) -> Result<Vec<Plane>> {
        let mut planes = Vec::with_capacity(c.len());
        for (i, &angle) in c.iter().enumerate() {
            let what = format!("horizontal angle {} of {}: intensity", i + 1, c.len());
            let values = self.list(&what, vertical)?;
            if let Some(bad) = values.iter().find(|&&value| value < 0.0) {
                let problem = format!(
                    "an intensity of {bad} at horizontal angle {angle}, must be at least 0"
                );
                return Err(self.error(problem).remedy(FETCH));
            }
            planes.push(Plane { c: angle, values });
        }
        Ok(planes)
    }

    fn error(&self, problem: impl std::fmt::Display) -> Error {
        self.file.error(self.line, problem)
    }
}

/// Whether a file of this version is of before 1995, when the place after the ballast factor had a
/// factor for lamp and ballast together; later it has another meaning.
fn before_1995(version: &str) -> bool {
    ["IESNA91", "IESNA:LM-63-1991", "IESNA:LM-63-1986"].iter().any(|old| version.starts_with(old))
        || !version.starts_with("IES")
}

/// Returns what a line says of the tilt, in capitals; `None` if it does not begin with `TILT=`.
pub(super) fn tilt(line: &str) -> Option<String> {
    let line = line.trim();
    let word = line.get(..4).filter(|word| word.eq_ignore_ascii_case("TILT"))?;
    let how = line[word.len()..].trim_start().strip_prefix('=')?;
    Some(how.trim().to_ascii_uppercase())
}

/// Reads a file in which line `at`, counted from 0, begins with `TILT=`.
pub(super) fn read(file: &File, at: usize) -> Result<Photometry> {
    let how = tilt(file.lines[at]).unwrap_or_default();
    let tilted = how == "INCLUDE";
    if how != "NONE" && !tilted {
        return Err(file
            .error(at, format!("TILT={} names another file, which is not read", quoted(&how)))
            .remedy(
                "a lamp whose flux depends on its tilt: export it with TILT=INCLUDE or TILT=NONE",
            ));
    }
    let mut numbers = Numbers::after(file, at);
    let tilt = if tilted { numbers.factor_at_tilt_0()? } else { 1.0 };
    let Head { vertical, horizontal, factor } = numbers.head(tilt)?;
    let v = numbers.list("vertical angle", vertical)?;
    let c = numbers.list("horizontal angle", horizontal)?;
    let symmetry = symmetry(&numbers, &c)?;
    let planes = numbers.planes(&c, vertical)?;
    // words may follow, but a number means that one of the counts is wrong
    if let Ok(word) = numbers.word("")
        && word.parse::<f64>().is_ok()
    {
        let problem = format!("{} comes after the last intensity", quoted(word));
        return Err(numbers.error(problem).remedy(FETCH));
    }
    let lamp = MeasuredLamp::new(file.path, planes, symmetry, &v)?;
    let mut lamp = lamp.scaled(file.path, factor)?;
    if tilted {
        lamp.notes.push(
            "its flux depends on the lamp's tilt (TILT=INCLUDE): that of tilt 0 is taken, the \
             position in which it was measured"
                .into(),
        );
    }
    Ok(Photometry { lamps: vec![lamp], usual: Some(0) })
}

/// Returns the symmetry of the horizontal angles. Error: they do not rise, or have none.
fn symmetry(numbers: &Numbers, c: &[f64]) -> Result<Symmetry> {
    if let Some(pair) = c.windows(2).find(|pair| pair[0] >= pair[1]) {
        let problem = format!("horizontal angle {} comes after {}", pair[1], pair[0]);
        return Err(numbers.error(problem).remedy(FETCH));
    }
    symmetry_of(c).ok_or_else(|| {
        let problem = format!("horizontal angles from {} to {}", c[0], c[c.len() - 1]);
        let remedy = "they go from 0 to 90, 180 or 360, or from 90 to 270, or all around, or there is one; \
            below 0 they belong to the types A and B: export it with type C coordinates";
        numbers.error(problem).remedy(remedy)
    })
}
