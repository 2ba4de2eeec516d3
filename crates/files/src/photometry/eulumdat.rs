//! Reads EULUMDAT (Stockmar 1990): one value per line, in a fixed order.

use super::{
    file::{FETCH, File, MOST, MeasuredLamp, Photometry},
    symmetry::{Plane, Symmetry},
};
use phylux_core::error::Result;

/// Number of lines for each set of lamps; the third of them is the flux.
const SET: usize = 6;

/// The values of a file, by their line numbers in the format, counted from 1.
struct Values<'a>(&'a File<'a>);

impl Values<'_> {
    fn word(&self, line: usize, what: &str) -> Result<String> {
        let Some(text) = self.0.lines.get(line - 1) else {
            let end = self.0.lines.len().saturating_sub(1);
            let problem = format!("the file ends before line {line}, {what}");
            return Err(self.0.error(end, problem).remedy(
                "an EULUMDAT file has one value a line; an IES file has a line TILT=NONE",
            ));
        };
        // some files have decimal commas
        Ok(text.trim().replace(',', "."))
    }

    fn number(&self, line: usize, what: &str) -> Result<f64> {
        self.0.number(line - 1, &self.word(line, what)?, what)
    }

    fn count(&self, line: usize, what: &str, low: usize, high: usize) -> Result<usize> {
        self.0.count(line - 1, &self.word(line, what)?, what, low..=high)
    }

    fn list(&self, first: usize, count: usize, what: &str) -> Result<Vec<f64>> {
        let value = |i| self.number(first + i, &format!("{what} {} of {count}", i + 1));
        (0..count).map(value).collect()
    }
}

/// Reads a file as EULUMDAT.
pub(super) fn read(file: &File) -> Result<Photometry> {
    let values = Values(file);
    let symmetry = values.count(3, "the symmetry (Isym)", 0, 4)?;
    let planes = values.count(4, "the number of C planes (Mc)", 1, MOST)?;
    let gammas = values.count(6, "the number of angles gamma (Ng)", 2, MOST)?;
    let factor = values.number(24, "the conversion factor")?;
    let sets = values.count(26, "the number of lamp sets", 1, 20)?;
    // the sets are alternatives: the luminaire holds one of them at a time, and some are empty
    let (mut scales, mut any_lamps) = (Vec::new(), Vec::new());
    for set in 0..sets {
        let line = 27 + SET * set;
        let lumens = values.number(line + 2, "the flux of the lamps, lm")?;
        let scale = lumens / 1000.0 * factor;
        let no_light = set + 1 == sets && lumens == 0.0 && scales.iter().all(|&scale| scale == 0.0);
        if !(factor > 0.0 && lumens >= 0.0 && scale.is_finite()) || no_light {
            let problem = format!("lamps of {lumens} lm and a conversion factor of {factor}");
            return Err(file.error(line + 1, problem).remedy("both must be above 0"));
        }
        scales.push(scale);
        any_lamps.push(values.word(line, "the number of lamps")?.parse() != Ok(0.0));
    }
    let with_light = |&set: &usize| scales[set] > 0.0;
    let with_lamps = |&set: &usize| scales[set] > 0.0 && any_lamps[set];
    let usual = (0..sets).find(with_lamps).or_else(|| (0..sets).find(with_light)).unwrap_or(0);
    let first = 27 + SET * sets + 10;
    let c = values.list(first, planes, "C angle")?;
    let v = values.list(first + planes, gammas, "angle gamma")?;

    let (symmetry, given, divisor) = match symmetry {
        0 => (Symmetry::None, 0..planes, 1),
        1 => (Symmetry::Axial, 0..1, 1),
        2 => (Symmetry::At0, 0..planes / 2 + 1, 2),
        // the given planes run from C = 270 through 0 to 90
        3 => (Symmetry::At90, 3 * planes / 4..3 * planes / 4 + planes / 2 + 1, 4),
        _ => (Symmetry::Quadrant, 0..planes / 4 + 1, 4),
    };
    if planes % divisor != 0 {
        let problem = format!("{planes} C planes do not suit this symmetry");
        return Err(file.error(3, problem).remedy(format!("they must be a multiple of {divisor}")));
    }
    if given.len().saturating_mul(gammas) > MOST {
        let problem = format!("{} x {gammas} angles, more than {MOST} intensities", given.len());
        return Err(file.error(3, problem).remedy("export it with fewer angles"));
    }
    let circle = |i: usize| c[i % planes] + if i < planes { 0.0 } else { 360.0 };
    let ends = match symmetry {
        Symmetry::Axial => None,
        Symmetry::None => Some((0.0, 360.0)),
        Symmetry::At0 => Some((0.0, 180.0)),
        Symmetry::At90 => Some((270.0, 450.0)),
        Symmetry::Quadrant => Some((0.0, 90.0)),
    };
    let rising = |angles: &[f64]| angles.windows(2).all(|pair| pair[0] < pair[1]);
    let of_given: Vec<f64> = given.clone().map(circle).collect();
    if let Some((low, high)) = ends {
        let (from, to) = (of_given[0], of_given[of_given.len() - 1]);
        // without symmetry, the last plane lies before 360
        let fits = match symmetry {
            Symmetry::None => from == low && to <= high,
            _ => from == low && to == high,
        };
        if !(fits && rising(&of_given)) {
            let problem = format!("C angles from {from} to {to}, must rise from {low} to {high}");
            return Err(file.error(first - 1, problem).remedy(FETCH));
        }
    }
    let mut line = first + planes + gammas;
    let mut half_planes = Vec::with_capacity(of_given.len());
    for (i, c) in of_given.iter().enumerate() {
        let what = format!("of C plane {} of {}, intensity", i + 1, of_given.len());
        let values = values.list(line, gammas, &what)?;
        if let Some(k) = values.iter().position(|&value| value < 0.0) {
            let problem = format!("an intensity of {}, must be at least 0", values[k]);
            return Err(file.error(line + k - 1, problem).remedy(FETCH));
        }
        line += gammas;
        let c = if symmetry == Symmetry::At90 { c % 360.0 } else { *c };
        half_planes.push(Plane { c, values });
    }
    let rest = file.lines.iter().enumerate().skip(line - 1);
    let mut rest = rest.map(|(i, text)| (i, text.trim_matches(['\u{1a}', ' ', '\t', '\r', '\0'])));
    // words may follow, but a number means that one of the counts is wrong
    if let Some((i, text)) = rest.find(|(_, text)| !text.is_empty())
        && text.replace(',', ".").parse::<f64>().is_ok()
    {
        let problem = "a number comes after the last intensity";
        return Err(file.error(i, problem).remedy(FETCH));
    }
    let lamp = MeasuredLamp::new(file.path, half_planes, symmetry, &v)?;
    let lamps = scales.iter().map(|&scale| lamp.scaled(file.path, scale)).collect::<Result<_>>()?;
    Ok(Photometry { lamps, usual: Some(usual) })
}
