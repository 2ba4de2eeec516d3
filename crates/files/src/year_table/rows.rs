//! Puts the rows of a table in their places.

use std::path::{Path, PathBuf};

use crate::input::quoted;
use phylux_core::{
    error::{Error, call},
    words,
};

/// Light on captors and groups in every hour, day or month of a period.
#[derive(Debug, Default)]
pub struct YearTable {
    /// Path of the file.
    pub path: PathBuf,
    /// Ids of captors, then of groups.
    pub ids: Vec<String>,
    /// Names of the bands, then of the sums.
    pub bands: Vec<String>,
    /// When each hour begins, as `2005-06-21T13:00+01:00`, or the names of days or months, in
    /// order.
    pub times: Vec<String>,
    /// The light that the values are of.
    pub face: Face,
    /// Value and standard error in the unit of the table: time by time, id by id, band by band. Not
    /// numbers where a captor does not count this light.
    pub values: Vec<[f32; 2]>,
}

/// The light of a captor that is read.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Face {
    /// Light on the front.
    #[default]
    Front,
    /// Light on the back.
    Back,
    /// Light that a surface absorbs, per area.
    Absorbed,
}

impl Face {
    /// Returns the word for it in the columns' names.
    pub fn word(self) -> &'static str {
        match self {
            Self::Front => "front",
            Self::Back => "back",
            Self::Absorbed => "absorbed",
        }
    }
}

/// The bands of a table, and where the values of a face are.
pub struct Columns {
    pub bands: Vec<String>,
    /// For each band the column of its value; that of its error follows.
    pub places: Vec<usize>,
}

impl Columns {
    /// Finds the columns of a face among these names.
    pub fn new(names: &[String], face: Face) -> std::result::Result<Self, Problem> {
        let is_time = |name: &str| ["time", "day", "month", "period"].contains(&name);
        let begins = names.first().is_some_and(|name| name == "captor")
            && names.get(1).is_some_and(|name| is_time(name));
        let of = |face: Face| {
            let found = names.iter().enumerate().skip(2).filter_map(move |(i, name)| {
                let band = name.strip_suffix(face.word())?.strip_suffix('_')?;
                (names.get(i + 1) == Some(&format!("{name}_se"))).then(|| (band.to_string(), i))
            });
            found.unzip()
        };
        let (bands, places): (Vec<String>, Vec<usize>) = of(face);
        match (begins, bands.is_empty()) {
            (true, false) => Ok(Self { bands, places }),
            (true, true) if face != Face::Front && !of(Face::Front).1.is_empty() => {
                Err(match face {
                    Face::Back => "no captor of it counts light on a back".into(),
                    _ => "no captor absorbs light".into(),
                })
            }
            _ => Err("its columns are others".into()),
        }
    }
}

/// The largest number of values that is read; they take 800 MB.
const MOST: usize = 100_000_000;

/// What is wrong with a row, in words.
pub type Problem = String;

impl YearTable {
    /// Adds the next row, with value and error for each band. The rows of the first time decide
    /// which ids the table has. Error: the row does not follow the rows before it, or a value is
    /// not finite.
    pub fn add(
        &mut self,
        captor: &str,
        time: &str,
        values: &[[Option<f32>; 2]],
    ) -> std::result::Result<(), Problem> {
        if self.values.len() + values.len() > MOST {
            return Err(format!("more than {MOST} values"));
        }
        let is_whole = |[value, error]: &[Option<f32>; 2]| match (value, error) {
            (Some(value), Some(error)) => value.is_finite() && error.is_finite(),
            (None, None) => self.face != Face::Front,
            _ => false,
        };
        if !values.iter().all(is_whole) {
            return Err("a value that is no number".into());
        }
        if self.times.is_empty() {
            self.times.push(time.into());
        }
        if self.times.len() == 1 && self.times[0] == time {
            self.ids.push(captor.into());
        }
        let each = self.ids.len() * self.bands.len();
        if self.values.len() == self.times.len() * each {
            self.times.push(time.into());
        }
        // position of this row within its time
        let id = (self.values.len() - (self.times.len() - 1) * each) / self.bands.len();
        let expected = self.ids.get(id).is_some_and(|id| id == captor)
            && self.times.last().is_some_and(|last| last == time);
        if !expected {
            let [captor, time] = [captor, time].map(quoted);
            return Err(format!("{captor}, {time} does not belong there"));
        }
        self.values.extend(values.iter().map(|both| both.map(|value| value.unwrap_or(f32::NAN))));
        Ok(())
    }

    /// Returns the value and the standard error of a time, an id and a band, by their indices.
    pub fn value(&self, time: usize, id: usize, band: usize) -> [f32; 2] {
        self.values[(time * self.ids.len() + id) * self.bands.len() + band]
    }
}

/// Returns an error that concerns the whole file.
pub fn broken(path: &Path, problem: impl std::fmt::Display) -> Error {
    Error::input(path.display(), format!("is no such table of a year: {problem}"))
        .remedy(words!["write it again with ", call("year")])
}
