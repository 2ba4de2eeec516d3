//! Reads tables of four angles, with the columns `theta_i,phi_i,theta_o,phi_o` and one column for
//! each band.

use std::path::Path;

use csv::StringRecord;

use super::file::{MOST, ScatterTable, Wanted};
use crate::{
    csv_table::{DECIMAL_COMMAS, Place, is_comment, number, separated, separator, surplus},
    input::quoted,
};
use phylux_core::{
    error::{Error, Result, nearest, some},
    scene::material::{Basis, BsdfFaces, FaceValues, PairValues},
};

const ANGLES: [&str; 4] = ["theta_i", "phi_i", "theta_o", "phi_o"];
const THETA_I: usize = 0;
const PHI_I: usize = 1;
const THETA_O: usize = 2;
const PHI_O: usize = 3;

/// Values at all combinations of four lists of angles, degrees.
struct Grid<'a> {
    path: &'a Path,
    angles: [Vec<f64>; 4],
    bands: usize,
    /// Values in the order of the lists: the index into the last list runs fastest, and each
    /// combination has one value per band.
    values: Vec<f32>,
}

/// One side of the sheet, with the angles to the normal that lie on it.
struct Side {
    /// Angles from the normal of this side, rad, rising.
    theta: Vec<f32>,
    /// Index of each of these angles in its list of the grid.
    indices: Vec<usize>,
}

/// Reads a table of four angles for the `wanted` bands.
pub(super) fn parse(bytes: &[u8], path: &Path, wanted: Wanted) -> Result<ScatterTable> {
    let grid = read(bytes, path, wanted)?.closed(PHI_I).closed(PHI_O);
    let [incident, leaving] = [THETA_I, THETA_O].map(|list| grid.sides(list));
    let mut warnings = Vec::new();
    for (sides, which) in [(&incident, "theta_i"), (&leaving, "theta_o")] {
        for (side, name) in sides.iter().zip(["front", "back"]) {
            warnings.extend(ends_early(side, which, name));
        }
    }
    let [front, back] = &incident;
    if front.theta.is_empty() {
        let problem = "no light on the front: every theta_i is above 90";
        return Err(grid.error(problem).remedy("angles are counted from the front's normal"));
    }
    let azimuths = grid.azimuths()?;
    let [above, below] = &leaving;
    let face = |from: &Side, here: &Side, there: &Side| {
        let reflected = grid.part(&azimuths, from, here)?;
        Ok(FaceValues { reflected, transmitted: grid.part(&azimuths, from, there)? })
    };
    let front = face(front, above, below)?;
    let back = (!back.theta.is_empty()).then(|| face(back, below, above)).transpose()?;
    let faces = BsdfFaces { front, back, bands: grid.bands };
    Ok(ScatterTable { faces, warnings, tolerated: 1.0 })
}

/// Returns a warning where the largest angle is more than half of the last step away from 90
/// degrees.
fn ends_early(side: &Side, which: &str, name: &str) -> Option<String> {
    let last = *side.theta.last()?;
    let before = side.theta.iter().rev().nth(1);
    let gap = std::f32::consts::FRAC_PI_2 - last;
    let reach = before.map_or(0.0, |before| 0.5 * (last - before));
    (gap > reach + 1e-4).then(|| {
        let degrees = last.to_degrees();
        format!("{which} ends {degrees:.1} degrees from the normal of the {name}: beyond, its last values hold")
    })
}

/// Reads the rows of a table into a grid.
fn read<'a>(bytes: &[u8], path: &'a Path, wanted: Wanted) -> Result<Grid<'a>> {
    let text = String::from_utf8_lossy(bytes);
    let mut lines = text.lines().filter(|line| !line.trim().is_empty() && !is_comment(line));
    let separator = lines.next().and_then(separator).unwrap_or(',');
    let mut rows = separated(bytes, path, separator);
    let Some(first) = rows.next() else {
        return Err(Error::input(path.display(), "is empty").remedy(HEADER));
    };
    let (place, names) = first?;
    let columns = Columns::find(names, &place, wanted, separator)?;
    let bands = wanted.bands.len();
    let (mut all, mut lines) = (Vec::new(), Vec::new());
    let mut values = Vec::new();
    for row in rows {
        let (place, row) = row?;
        if values.len() + bands > MOST {
            let problem = format!("more than {MOST} values");
            return Err(place.error(problem).remedy("use fewer angles or bands"));
        }
        if let Some(problem) = surplus(row.iter(), columns.names.len()) {
            return Err(place.error(problem).remedy(DECIMAL_COMMAS));
        }
        let mut angles = [0.0; 4];
        for (i, angle) in angles.iter_mut().enumerate() {
            *angle = columns.number(i, &row, &place)?;
        }
        for i in angles.len()..columns.read.len() {
            values.push(columns.number(i, &row, &place)? as f32);
        }
        all.push(angles);
        lines.push(place.line);
    }
    sorted(path, &all, &lines, &values, bands)
}

/// What the header must be; the remedy of an error.
const HEADER: &str = "a table begins with `theta_i,phi_i,theta_o,phi_o` and the names of the bands";

/// The columns of a table that are read.
struct Columns {
    /// The names of all columns.
    names: StringRecord,
    /// Indices of the columns of the four angles, then of those of the bands.
    read: Vec<usize>,
    separator: char,
}

impl Columns {
    /// Finds the angles and the `wanted` bands among the names of the columns. Error, at the
    /// `place` of the names: one is missing.
    fn find(names: StringRecord, place: &Place, wanted: Wanted, separator: char) -> Result<Self> {
        let column = |name: &str| names.iter().position(|other| other == name);
        let mut read = Vec::new();
        for name in ANGLES {
            let missing = || place.error(format!("no column `{name}`")).remedy(HEADER);
            read.push(column(name).ok_or_else(missing)?);
        }
        let others = names.iter().enumerate().filter(|(_, name)| !ANGLES.contains(name));
        let others: Vec<(usize, &str)> = others.collect();
        for &band in wanted.bands {
            read.push(match (column(band), others.as_slice()) {
                (Some(index), _) => index,
                (None, [(only, _)]) if !wanted.named => *only,
                (None, _) => {
                    let error = place.error(format!("no column {} for that band", quoted(band)));
                    let known = others.iter().map(|(_, name)| *name);
                    return Err(match nearest(band, known.clone()) {
                        Some(near) => error.remedy(format!("did you mean {}?", quoted(near))),
                        None => error.remedy(format!("there are {}", some(known.map(quoted), 20))),
                    });
                }
            });
        }
        Ok(Self { names, read, separator })
    }

    /// Reads the angle `i` of a row, or, from 4 on, the value of a band. Error: it is no number, or
    /// beyond its range.
    fn number(&self, i: usize, row: &StringRecord, place: &Place) -> Result<f64> {
        let cell = row.get(self.read[i]).unwrap_or_default();
        let what = self.names.get(self.read[i]).unwrap_or_default();
        let number = number(cell, Some(self.separator)).ok_or_else(|| {
            place
                .error(format!("{} is {}, not a finite number", quoted(what), quoted(cell)))
                .remedy("every row has four angles, degrees, and a value for each band, 1/sr")
        })?;
        let high = match i {
            THETA_I | THETA_O => 180.0,
            PHI_I | PHI_O => 360.0,
            _ => f64::from(f32::MAX),
        };
        if (0.0..=high).contains(&number) {
            return Ok(number);
        }
        Err(match i {
            0..4 => place
                .error(format!("{what} = {number}, must be from 0 to {high}"))
                .remedy("angles are in degrees, and azimuths below 0 take 360 more"),
            _ => place
                .error(format!("{} is {number}, must be at least 0", quoted(what)))
                .remedy("noise below 0 counts as 0"),
        })
    }
}

/// Sorts rows, which may come in any order, by their angles.
fn sorted<'a>(
    path: &'a Path,
    rows: &[[f64; 4]],
    lines: &[u64],
    values: &[f32],
    bands: usize,
) -> Result<Grid<'a>> {
    let angles = [0, 1, 2, 3].map(|i| {
        let mut list: Vec<f64> = rows.iter().map(|row| row[i]).collect();
        list.sort_by(f64::total_cmp);
        list.dedup();
        list
    });
    let empty = Grid { path, angles, bands, values: Vec::new() };
    if rows.is_empty() {
        return Err(empty.error("has no values").remedy("below the header stand rows of numbers"));
    }
    let sizes = empty.angles.each_ref().map(Vec::len);
    let pairs = sizes.iter().try_fold(1usize, |all, size| all.checked_mul(*size));
    let full = "a table has every combination of its theta_i, phi_i, theta_o and phi_o once";
    let place = |row: &[f64; 4]| {
        let index = |i: usize| empty.angles[i].partition_point(|angle| *angle < row[i]);
        (0..4).fold(0, |all, i| all * sizes[i] + index(i))
    };
    // use no more than a few times the memory of the file
    let few = pairs.filter(|&pairs| pairs <= 4 * rows.len());
    let mut sorted = vec![f32::NAN; few.unwrap_or(0) * bands];
    if few.is_some() {
        for (row, (line, of_row)) in rows.iter().zip(lines.iter().zip(values.chunks(bands))) {
            let at = &mut sorted[place(row) * bands..][..bands];
            if !at[0].is_nan() {
                let [theta_i, phi_i, theta_o, phi_o] = row;
                let problem = format!("a second row for {theta_i}, {phi_i}, {theta_o}, {phi_o}");
                let at = format!("{}:{line}", path.display());
                return Err(Error::input(at, problem).remedy("delete one of them"));
            }
            at.copy_from_slice(of_row);
        }
    }
    let missing = sorted.chunks(bands).position(|of_row| of_row[0].is_nan());
    match (few, missing) {
        (Some(_), None) => Ok(Grid { values: sorted, ..empty }),
        (_, missing) => {
            let [a, b, c, d] = sizes;
            let mut problem = format!(
                "{} rows for {a} theta_i, {b} phi_i, {c} theta_o and {d} phi_o",
                rows.len()
            );
            if let Some(missing) = missing {
                let indices = indices(missing, sizes);
                let [a, b, c, d] = [0, 1, 2, 3].map(|i| empty.angles[i][indices[i]]);
                problem += &format!(": none for {a}, {b}, {c}, {d}");
            }
            Err(empty.error(problem).remedy(full))
        }
    }
}

/// Returns the indices into four lists of these `sizes` of the combination at `place`.
fn indices(place: usize, sizes: [usize; 4]) -> [usize; 4] {
    let mut rest = place;
    let mut indices = [0; 4];
    for i in (0..4).rev() {
        indices[i] = rest % sizes[i];
        rest /= sizes[i];
    }
    indices
}

/// Azimuths of a grid, rad, each with its index in its list.
struct Azimuths {
    /// Azimuths of the incident light; `None` where the table does not change when the sheet is
    /// turned about its normal.
    incident: Option<Vec<(f32, usize)>>,
    /// Azimuths of the leaving light, or, if `incident` is `None`, their differences from the
    /// azimuth of the incident light.
    leaving: Vec<(f32, usize)>,
}

impl Grid<'_> {
    fn error(&self, problem: impl std::fmt::Display) -> Error {
        Error::input(self.path.display(), problem)
    }

    /// Returns the values, one per band, at a combination of angles.
    fn at(&self, indices: [usize; 4]) -> &[f32] {
        let place = (0..4).fold(0, |all, i| all * self.angles[i].len() + indices[i]);
        &self.values[place * self.bands..][..self.bands]
    }

    /// Replaces 360 degrees by 0 in a list of azimuths. If the list has both, the values are
    /// averaged.
    fn closed(self, list: usize) -> Self {
        let azimuths = &self.angles[list];
        if azimuths.last() != Some(&360.0) {
            return self;
        }
        let last = azimuths.len() - 1;
        let has_zero = azimuths[0] == 0.0 && last > 0;
        let mut angles = self.angles.clone();
        angles[list].pop();
        if !has_zero {
            angles[list].insert(0, 0.0);
        }
        let sizes = angles.each_ref().map(Vec::len);
        let mut values = Vec::with_capacity(sizes.iter().product::<usize>() * self.bands);
        for place in 0..sizes.iter().product() {
            let mut indices = indices(place, sizes);
            let mut other = indices;
            match (has_zero, indices[list]) {
                (true, 0) => other[list] = last,
                (false, 0) => (indices[list], other[list]) = (last, last),
                (false, i) => (indices[list], other[list]) = (i - 1, i - 1),
                _ => {}
            }
            let pairs = self.at(indices).iter().zip(self.at(other));
            values.extend(pairs.map(|(a, b)| 0.5 * (a + b)));
        }
        Self { angles, values, ..self }
    }

    /// Returns the front and the back: the angles of a list that lie on each, measured from the
    /// normal of that side.
    fn sides(&self, list: usize) -> [Side; 2] {
        let angles = self.angles[list].iter().copied().enumerate();
        let front: Vec<(usize, f64)> = angles.clone().filter(|(_, theta)| *theta <= 90.0).collect();
        let back = angles.filter(|(_, theta)| *theta > 90.0).map(|(i, theta)| (i, 180.0 - theta));
        let mut back: Vec<(usize, f64)> = back.collect();
        back.reverse();
        [front, back].map(|side| Side {
            theta: side.iter().map(|(_, theta)| theta.to_radians() as f32).collect(),
            indices: side.iter().map(|(i, _)| *i).collect(),
        })
    }

    fn azimuths(&self) -> Result<Azimuths> {
        let [phi_i, phi_o] = [PHI_I, PHI_O].map(|list| &self.angles[list]);
        let circle = |name: &str, list: &[f64]| {
            let gaps = list.windows(2).map(|pair| pair[1] - pair[0]).fold(0.0, f64::max);
            let (first, last) = (list[0], list[list.len() - 1]);
            // two azimuths may be half a turn apart
            if list.len() > 1
                && first + 360.0 - last > (2.0 * gaps).max(180.1 * f64::from(list.len() == 2))
            {
                let problem = format!("{name} goes from {first} to {last} degrees only");
                return Err(self.error(problem).remedy(
                    "give the whole circle, 0 to 360; half of it, 0 to 180, does for phi_o where there is one phi_i",
                ));
            }
            Ok(())
        };
        let radians = |list: &[f64]| -> Vec<(f32, usize)> {
            list.iter().enumerate().map(|(i, phi)| (phi.to_radians() as f32, i)).collect()
        };
        let &[only] = phi_i.as_slice() else {
            circle("phi_i", phi_i)?;
            circle("phi_o", phi_o)?;
            return Ok(Azimuths { incident: Some(radians(phi_i)), leaving: radians(phi_o) });
        };
        let half = phi_o.len() > 1 && phi_o.iter().all(|&phi| phi <= 180.0);
        // differences of azimuths, above -180 and up to 180
        let turn = |phi: f64| 180.0 - (180.0 - (phi - only)).rem_euclid(360.0);
        let mut turns: Vec<(f64, usize)> =
            phi_o.iter().enumerate().map(|(i, &phi)| (turn(phi), i)).collect();
        if half {
            let on_one_side = |sign: f64| {
                turns
                    .iter()
                    .all(|(turn, _)| (0.0..=180.0).contains(&(sign * turn)) || *turn == 180.0)
            };
            if !on_one_side(1.0) && !on_one_side(-1.0) {
                let problem =
                    format!("phi_o goes over half a turn, and phi_i = {only} lies within");
                return Err(self.error(problem).remedy(
                    "give the whole circle, or the half that begins where the light comes from",
                ));
            }
            let mirrored = turns.iter().filter(|(turn, _)| *turn != 0.0 && *turn != 180.0);
            let mirrored: Vec<(f64, usize)> = mirrored.map(|(turn, i)| (-turn, *i)).collect();
            turns.extend(mirrored);
        } else {
            circle("phi_o", phi_o)?;
        }
        turns.sort_by(|a, b| a.0.total_cmp(&b.0));
        let leaving = turns.iter().map(|(turn, i)| (turn.to_radians() as f32, *i)).collect();
        Ok(Azimuths { incident: None, leaving })
    }

    /// Returns the values for light that arrives on one side of the sheet and leaves on one side;
    /// they are 0 where the table has none.
    fn part(&self, azimuths: &Azimuths, from: &Side, to: &Side) -> Result<PairValues> {
        let phi_i = azimuths.incident.as_deref().unwrap_or(&[(0.0, 0)]);
        let turns: Vec<f32> = azimuths.leaving.iter().map(|(phi, _)| *phi).collect();
        let of_rows: Vec<f32> = phi_i.iter().map(|(phi, _)| *phi).collect();
        let isotropic = azimuths.incident.is_none();
        let of_columns = if isotropic { &[0.0][..] } else { &turns };
        for list in [&from.theta, &to.theta, &of_rows, &turns] {
            if list.windows(2).any(|pair| pair[1] - pair[0] < 1e-5) {
                let problem = "two angles are less than 0.0006 degrees apart";
                return Err(self.error(problem).remedy("round them alike in all rows"));
            }
        }
        let rows = Basis::linear(&from.theta, &of_rows);
        if to.theta.is_empty() {
            let turns = isotropic.then(|| vec![0.0]);
            let values = vec![0.0; rows.len() * self.bands];
            return Ok(PairValues { rows, columns: Basis::cells(&[0.0], &[0.0]), turns, values });
        }
        let columns = Basis::cells(&to.theta, of_columns);
        let mut values = Vec::new();
        for &theta_i in &from.indices {
            for &(_, phi_i) in phi_i {
                for &theta_o in &to.indices {
                    for &(_, phi_o) in &azimuths.leaving {
                        values.extend_from_slice(self.at([theta_i, phi_i, theta_o, phi_o]));
                    }
                }
            }
        }
        Ok(PairValues { rows, columns, turns: isotropic.then_some(turns), values })
    }
}
