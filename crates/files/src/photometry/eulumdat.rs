//! Reads EULUMDAT (Stockmar 1990): one value per line, in a fixed order.

use std::ops::Range;

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

    /// Returns the factor of each set of lamps, by which the intensities are multiplied, and the
    /// index of the first set that has lamps and light. The sets are alternatives: the luminaire
    /// holds one of them at a time, and some are empty. Error: none of them has light.
    fn sets(&self, count: usize, factor: f64) -> Result<(Vec<f64>, usize)> {
        let (mut scales, mut any_lamps) = (Vec::new(), Vec::new());
        for set in 0..count {
            let line = 27 + SET * set;
            let lumens = self.number(line + 2, "the flux of the lamps, lm")?;
            let scale = lumens / 1000.0 * factor;
            let dark = lumens == 0.0 && scales.iter().all(|&scale| scale == 0.0);
            let no_light = set + 1 == count && dark;
            if !(factor > 0.0 && lumens >= 0.0 && scale.is_finite()) || no_light {
                let problem = format!("lamps of {lumens} lm and a conversion factor of {factor}");
                return Err(self.0.error(line + 1, problem).remedy("both must be above 0"));
            }
            scales.push(scale);
            any_lamps.push(self.word(line, "the number of lamps")?.parse() != Ok(0.0));
        }
        let with_light = |&set: &usize| scales[set] > 0.0;
        let with_lamps = |&set: &usize| scales[set] > 0.0 && any_lamps[set];
        let usual = (0..count).find(with_lamps).or_else(|| (0..count).find(with_light));
        Ok((scales, usual.unwrap_or(0)))
    }

    /// Returns the symmetry that a file states, and the indices of those C planes that it gives, of
    /// all `planes` around the circle. Error: so many planes do not have this symmetry.
    fn symmetry(&self, stated: usize, planes: usize) -> Result<(Symmetry, Range<usize>)> {
        let (symmetry, given, divisor) = match stated {
            0 => (Symmetry::None, 0..planes, 1),
            1 => (Symmetry::Axial, 0..1, 1),
            2 => (Symmetry::At0, 0..planes / 2 + 1, 2),
            // the given planes run from C = 270 through 0 to 90
            3 => (Symmetry::At90, 3 * planes / 4..3 * planes / 4 + planes / 2 + 1, 4),
            _ => (Symmetry::Quadrant, 0..planes / 4 + 1, 4),
        };
        match planes % divisor {
            0 => Ok((symmetry, given)),
            _ => {
                let problem = format!("{planes} C planes do not suit this symmetry");
                let remedy = format!("they must be a multiple of {divisor}");
                Err(self.0.error(3, problem).remedy(remedy))
            }
        }
    }

    /// Checks that the C angles of the given planes, which begin in the line `first`, rise and
    /// cover what their symmetry asks for.
    fn check_angles(&self, first: usize, c: &[f64], symmetry: Symmetry) -> Result<()> {
        let (low, high) = match symmetry {
            Symmetry::Axial => return Ok(()),
            Symmetry::None => (0.0, 360.0),
            Symmetry::At0 => (0.0, 180.0),
            Symmetry::At90 => (270.0, 450.0),
            Symmetry::Quadrant => (0.0, 90.0),
        };
        let (from, to) = (c[0], c[c.len() - 1]);
        // without symmetry, the last plane lies before 360
        let ends = if symmetry == Symmetry::None { to <= high } else { to == high };
        if from == low && ends && c.windows(2).all(|pair| pair[0] < pair[1]) {
            return Ok(());
        }
        let problem = format!("C angles from {from} to {to}, must rise from {low} to {high}");
        Err(self.0.error(first - 1, problem).remedy(FETCH))
    }

    /// Reads the intensities at the angles gamma of one plane after the other, from the line
    /// `first` on.
    fn planes(&self, first: usize, c: &[f64], gammas: usize) -> Result<Vec<Plane>> {
        let count = c.len();
        let plane = |(i, &c): (usize, &f64)| {
            let line = first + i * gammas;
            let what = format!("of C plane {} of {count}, intensity", i + 1);
            let values = self.list(line, gammas, &what)?;
            if let Some(k) = values.iter().position(|&value| value < 0.0) {
                let problem = format!("an intensity of {}, must be at least 0", values[k]);
                return Err(self.0.error(line + k - 1, problem).remedy(FETCH));
            }
            Ok(Plane { c, values })
        };
        c.iter().enumerate().map(plane).collect()
    }

    /// Checks that no number stands from the line `first` on, after the last intensity: it means
    /// that one of the counts is wrong. Words may follow.
    fn check_end(&self, first: usize) -> Result<()> {
        let blank = ['\u{1a}', ' ', '\t', '\r', '\0'];
        let rest = self.0.lines.iter().enumerate().skip(first - 1);
        let mut rest = rest.map(|(i, text)| (i, text.trim_matches(blank)));
        match rest.find(|(_, text)| !text.is_empty()) {
            Some((i, text)) if text.replace(',', ".").parse::<f64>().is_ok() => {
                let problem = "a number comes after the last intensity";
                Err(self.0.error(i, problem).remedy(FETCH))
            }
            _ => Ok(()),
        }
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
    let (scales, usual) = values.sets(sets, factor)?;

    let first = 27 + SET * sets + 10;
    let circle = values.list(first, planes, "C angle")?;
    let v = values.list(first + planes, gammas, "angle gamma")?;
    let (symmetry, given) = values.symmetry(symmetry, planes)?;
    if given.len().saturating_mul(gammas) > MOST {
        let problem = format!("{} x {gammas} angles, more than {MOST} intensities", given.len());
        return Err(file.error(3, problem).remedy("export it with fewer angles"));
    }
    let mut c: Vec<f64> =
        given.map(|i| circle[i % planes] + if i < planes { 0.0 } else { 360.0 }).collect();
    values.check_angles(first, &c, symmetry)?;
    if symmetry == Symmetry::At90 {
        c.iter_mut().for_each(|c| *c %= 360.0);
    }

    let intensities = first + planes + gammas;
    let given = values.planes(intensities, &c, gammas)?;
    values.check_end(intensities + given.len() * gammas)?;
    let lamp = MeasuredLamp::new(file.path, given, symmetry, &v)?;
    let lamps = scales.iter().map(|&scale| lamp.scaled(file.path, scale)).collect::<Result<_>>()?;
    Ok(Photometry { lamps, usual: Some(usual) })
}
