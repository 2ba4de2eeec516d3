//! Puts the rows of a table of hours in their places.

use std::{
    collections::HashSet,
    path::{Path, PathBuf},
};

use crate::{
    error::{Error, Result},
    formats::input::quoted,
    scene::world::Scene,
};

/// Irradiance on the fronts of captors and groups in every hour of a period.
#[derive(Debug, Default)]
pub struct HoursFile {
    /// Path of the file.
    pub path: PathBuf,
    /// Ids of captors, then of groups.
    pub ids: Vec<String>,
    /// Names of the bands, then of the sums.
    pub bands: Vec<String>,
    /// When each hour begins, as `2005-06-21T13:00+01:00`, in order.
    pub times: Vec<String>,
    /// Value and standard error, W/m2 or umol/m2/s: hour by hour, id by id, band by band.
    pub values: Vec<[f32; 2]>,
}

/// The columns of the table.
pub const COLUMNS: [&str; 5] = ["captor", "time", "band", "value", "standard_error"];
/// The largest number of values that is read; they take 800 MB.
const MOST: usize = 100_000_000;

/// A row of the table.
pub struct Row<'a> {
    pub captor: &'a str,
    pub time: &'a str,
    pub band: &'a str,
    pub value: f64,
    pub error: f64,
}

/// What is wrong with a row, in words.
pub type Problem = String;

impl HoursFile {
    /// Adds the next row. The rows of the first hour decide which ids and bands the table has.
    /// Error: the row does not follow the rows before it, or holds a value that is not finite.
    pub(crate) fn add(&mut self, row: &Row) -> std::result::Result<(), Problem> {
        if self.values.len() >= MOST {
            return Err(format!("more than {MOST} values"));
        }
        if !(row.value.is_finite() && row.error.is_finite()) {
            return Err("a value that is no number".into());
        }
        if self.times.is_empty() {
            self.times.push(row.time.into());
        }
        if self.times.len() == 1 && self.times[0] == row.time {
            if self.ids.last().is_none_or(|id| id != row.captor) {
                self.ids.push(row.captor.into());
            }
            if self.ids.len() == 1 {
                self.bands.push(row.band.into());
            }
        }
        let each = self.ids.len() * self.bands.len();
        if self.values.len() == self.times.len() * each {
            self.times.push(row.time.into());
        }
        // position of this row within its hour
        let at = self.values.len() - (self.times.len() - 1) * each;
        let (id, band) = (at / self.bands.len(), at % self.bands.len());
        let expected = self.ids.get(id).is_some_and(|id| id == row.captor)
            && self.bands[band] == row.band
            && self.times.last().is_some_and(|time| time == row.time);
        if !expected {
            let Row { captor, time, band, .. } = row;
            let [captor, time, band] = [captor, time, band].map(|word| quoted(word));
            return Err(format!("{captor}, {time}, {band} does not belong there"));
        }
        self.values.push([row.value as f32, row.error as f32]);
        Ok(())
    }

    /// Refuses a table of hours that does not fit `scene`: other bands, or no values for one of its
    /// captors or groups.
    pub fn check_scene(&self, scene: &Scene) -> Result<()> {
        let refuse = |problem: String| {
            Err(Error::input(self.path.display(), format!("is of another scene: {problem}"))
                .remedy("name the folder of `phylux year` of this scene, or leave it out"))
        };
        if !scene.band_names().eq(self.bands.iter().map(String::as_str)) {
            return refuse(format!("its bands are {}", self.bands.join(", ")));
        }
        let known: HashSet<&str> = self.ids.iter().map(String::as_str).collect();
        let ids = scene.captors.iter().map(|captor| &captor.id);
        match ids.chain(&scene.groups).find(|id| !known.contains(id.as_str())) {
            Some(id) => refuse(format!("it has no {}", quoted(id))),
            None => Ok(()),
        }
    }
}

/// Returns an error that concerns the whole file.
pub fn broken(path: &Path, problem: impl std::fmt::Display) -> Error {
    Error::input(path.display(), format!("is no table of hours: {problem}"))
        .remedy("write it again with `phylux year`")
}
