//! Reads ANSI/IES LM-63: keywords, then numbers, which blanks, commas and line ends separate
//! anywhere.

use super::{
    file::{FETCH, File, MOST, Photometry},
    symmetry::{Plane, Symmetry},
};
use crate::{
    error::{Error, Result},
    formats::input::quoted,
};

/// The numbers after the tilt, in order, with their lines.
struct Numbers<'a> {
    file: &'a File<'a>,
    words: Box<dyn Iterator<Item = (usize, &'a str)> + 'a>,
    line: usize,
}

impl Numbers<'_> {
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

    fn error(&self, problem: impl std::fmt::Display) -> Error {
        self.file.error(self.line, problem)
    }
}

/// Reads a file in which line `tilt`, counted from 0, begins with `TILT=`.
pub(super) fn read(file: &File, tilt: usize) -> Result<Photometry> {
    let how = file.lines[tilt].trim().trim_start_matches("TILT=").trim();
    if how != "NONE" {
        return Err(file
            .error(tilt, format!("TILT={} is not read", quoted(how)))
            .remedy("a lamp whose flux depends on its tilt: export it with TILT=NONE"));
    }
    // before 1995 this is a factor for lamp and ballast together; later the place has another
    // meaning
    let version = file.lines[0].trim();
    let old = version.starts_with("IESNA91")
        || version.starts_with("IESNA:LM-63-1991")
        || version.starts_with("IESNA:LM-63-1986")
        || !version.starts_with("IES");
    let separators = |c: char| c.is_whitespace() || c == ',' || c == '\u{1a}';
    let lines = file.lines.iter().enumerate().skip(tilt + 1);
    let words = lines.flat_map(move |(i, line)| line.split(separators).map(move |word| (i, word)));
    let words = Box::new(words.filter(|(_, word)| !word.is_empty()));
    let mut numbers = Numbers { file, words, line: file.lines.len().saturating_sub(1) };

    numbers.number("the number of lamps")?;
    numbers.number("the lumens of a lamp")?;
    let multiplier = numbers.number("the multiplier of candela")?;
    let vertical = numbers.count("the number of vertical angles", MOST)?;
    let horizontal = numbers.count("the number of horizontal angles", MOST)?;
    let kind = numbers.number("the photometric type")?;
    if kind != 1.0 {
        return Err(numbers
            .error(format!("photometric type {kind}, must be 1 (C)"))
            .remedy("export it with type C coordinates; A and B are for floodlights and cars"));
    }
    if vertical.saturating_mul(horizontal) > MOST {
        let problem = format!("{vertical} x {horizontal} angles, more than {MOST} intensities");
        return Err(numbers.error(problem).remedy("export it with fewer angles"));
    }
    for what in ["the unit of lengths", "the width", "the length", "the height"] {
        numbers.number(what)?;
    }
    let ballast = numbers.number("the ballast factor")?;
    let photometric = numbers.number("the ballast-lamp photometric factor")?;
    numbers.number("the input watts")?;
    let factor = multiplier * ballast * if old { photometric } else { 1.0 };
    if !(factor > 0.0 && factor.is_finite()) {
        let problem = format!("multiplier and ballast factor make {factor}, must be above 0");
        return Err(numbers.error(problem).remedy(FETCH));
    }

    let v = numbers.list("vertical angle", vertical)?;
    let c = numbers.list("horizontal angle", horizontal)?;
    let symmetry = symmetry(&numbers, &c)?;
    let mut planes = Vec::with_capacity(horizontal);
    for (i, &c) in c.iter().enumerate() {
        let what = format!("horizontal angle {} of {horizontal}: intensity", i + 1);
        let mut values = numbers.list(&what, vertical)?;
        if let Some(bad) = values.iter().find(|&&value| value < 0.0) {
            let problem =
                format!("an intensity of {bad} at horizontal angle {c}, must be at least 0");
            return Err(numbers.error(problem).remedy(FETCH));
        }
        values.iter_mut().for_each(|value| *value *= factor);
        planes.push(Plane { c, values });
    }
    if let Ok(word) = numbers.word("") {
        let problem = format!("{} comes after the last intensity", quoted(word));
        return Err(numbers.error(problem).remedy(FETCH));
    }
    Photometry::new(file, planes, symmetry, &v)
}

/// Returns the symmetry that the horizontal angles imply: there is one angle, or they go from 0 to
/// 90, 180 or 360, or from 90 to 270.
fn symmetry(numbers: &Numbers, c: &[f64]) -> Result<Symmetry> {
    if let Some(pair) = c.windows(2).find(|pair| pair[0] >= pair[1]) {
        let problem = format!("horizontal angle {} comes after {}", pair[1], pair[0]);
        return Err(numbers.error(problem).remedy(FETCH));
    }
    match (c[0], c[c.len() - 1]) {
        _ if c.len() == 1 => Ok(Symmetry::Axial),
        (0.0, 90.0) => Ok(Symmetry::Quadrant),
        (0.0, 180.0) => Ok(Symmetry::At0),
        (0.0, 360.0) => Ok(Symmetry::None),
        (90.0, 270.0) => Ok(Symmetry::At90),
        (first, last) => {
            let problem = format!("horizontal angles from {first} to {last}");
            let remedy = "they go from 0 to 90, 180 or 360, or from 90 to 270, or there is one";
            Err(numbers.error(problem).remedy(remedy))
        }
    }
}
