//! The light of a year for the page: what captors and groups receive in each hour, day and month, in
//! three bytes each.

use std::{
    collections::{HashMap, HashSet},
    path::{Path, PathBuf},
};

use indexmap::IndexSet;
use serde_json::{Value, json};

use super::levels::Levels;
use phylux_core::{
    error::{Error, Result, call},
    scene::world::Scene,
    words,
};
use phylux_files::year_table::{Face, YearTable};

/// Limit on the number of values of each table in a page, some 20 MB. If there are more, evenly
/// spaced days are kept and the others left out.
const MOST: usize = 8_000_000;

/// The tables of a year that a page shows: light on fronts.
pub struct YearLight {
    /// Irradiance in each hour, of all captors and groups or of some.
    pub hours: Option<YearTable>,
    /// Daily light integrals of each day, of all captors and groups.
    pub days: Option<YearTable>,
    /// The same of each month, as the mean of its days.
    pub months: Option<YearTable>,
}

impl YearLight {
    /// Reads the tables in a folder that `phylux year` wrote, which may lack those of hours. Errors:
    /// it has neither hours nor days; a table is not complete.
    pub fn read(folder: &Path) -> Result<Self> {
        let files = YearTable::files(folder);
        let of = |name: &str| -> Result<Option<YearTable>> {
            let has =
                files.iter().any(|file| file.is_file() && file.file_stem() == Some(name.as_ref()));
            let table = has.then(|| YearTable::read_rows(folder, name, Face::Front)).transpose()?;
            Ok(table.filter(|table| !table.values.is_empty()))
        };
        let (hours, days, months) = (of("hours")?, of("days")?, of("months")?);
        match (&hours, &days) {
            (None, None) => Ok(Self {
                hours: Some(YearTable::read(folder, "hours", Face::Front)?),
                days,
                months,
            }),
            _ => Ok(Self { hours, days, months }),
        }
    }

    /// Returns the tables, with their names in the page.
    pub fn tables(&self) -> impl Iterator<Item = (&'static str, &YearTable)> {
        let all = [("hours", &self.hours), ("days", &self.days), ("months", &self.months)];
        all.into_iter().filter_map(|(name, table)| Some((name, table.as_ref()?)))
    }

    /// Returns the paths of the tables.
    pub fn paths(&self) -> impl Iterator<Item = &PathBuf> {
        self.tables().map(|(_, table)| &table.path)
    }

    /// Refuses tables that do not fit `scene`: other bands, captors or groups.
    pub fn check_scene(&self, scene: &Scene) -> Result<()> {
        let own: HashSet<&str> = ids(scene).collect();
        for (name, table) in self.tables() {
            let refuse = |problem: String| {
                Err(Error::input(table.path.display(), format!("is of another scene: {problem}"))
                    .remedy(words![
                        "name the folder of ",
                        call("year"),
                        " of this scene, or leave it out"
                    ]))
            };
            // a daily light integral stands for some of the bands
            let bands: Vec<&str> = scene.band_names().collect();
            let others = table.bands.iter().any(|band| !bands.contains(&band.as_str()));
            if others || (name == "hours" && table.bands.len() != bands.len()) {
                return refuse(format!("its bands are {}", table.bands.join(", ")));
            }
            if let Some(id) = table.ids.iter().find(|id| !own.contains(id.as_str())) {
                return refuse(format!("it has `{id}`, which the scene does not have"));
            }
            // hours may be those of groups alone
            let known: HashSet<&str> = table.ids.iter().map(String::as_str).collect();
            let all = name != "hours" || self.days.is_none();
            if let Some(id) = ids(scene).find(|id| all && !known.contains(id)) {
                return refuse(format!("it has no `{id}`"));
            }
        }
        Ok(())
    }
}

/// Returns the names of the captors of a scene, then those of its groups.
fn ids(scene: &Scene) -> impl Iterator<Item = &str> {
    let captors = scene.captors().iter().map(|captor| captor.id.as_str());
    captors.chain(scene.groups().iter().map(String::as_str))
}

/// The encoded values of all hours, days or months that are not dark everywhere.
pub struct Series {
    days: Vec<String>,
    clocks: Vec<String>,
    /// For each captor and group its row, if it has one.
    rows: Vec<Option<usize>>,
    /// For each band and sum of the scene its place, if it has one.
    bands: Vec<Option<usize>>,
    values: Levels,
    /// The scale of standard errors relative to their values.
    errors: Levels,
    /// Day and time of day of each hour, as `day * clocks + clock`.
    pub slots: Vec<u32>,
    /// Levels of the values: hour by hour, in it band by band, in it captors and then groups.
    pub value_levels: Vec<u16>,
    /// Levels of the errors, in the same order.
    pub error_levels: Vec<u8>,
}

impl Series {
    /// Encodes the table of a scene for its captors and groups and its bands and sums, as far as the
    /// table has them.
    pub fn new(scene: &Scene, file: &YearTable) -> Self {
        Self::at_most(file, ids(scene), scene.band_names(), MOST)
    }

    fn at_most<'a>(
        file: &YearTable,
        names: impl Iterator<Item = &'a str>,
        band_names: impl Iterator<Item = &'a str>,
        most: usize,
    ) -> Self {
        let known: HashMap<&str, usize> = file.ids.iter().map(String::as_str).zip(0..).collect();
        let (mut rows, mut row_of) = (Vec::new(), Vec::new());
        for name in names {
            let row = known.get(name).copied();
            row_of.push(row.map(|_| rows.len()));
            rows.extend(row);
        }
        let band_of = |name: &str| file.bands.iter().position(|band| band == name);
        let band_of = band_names.map(band_of).collect();
        let (bands, each) = (file.bands.len(), file.ids.len() * file.bands.len());
        let lit: Vec<(usize, (&str, &str))> = file
            .times
            .iter()
            .map(|time| parted(time))
            .enumerate()
            .filter(|(h, _)| file.values[h * each..][..each].iter().any(|[value, _]| *value > 0.0))
            .collect();
        let days: IndexSet<&str> = file.times.iter().map(|time| parted(time).0).collect();
        let apart = (lit.len() * rows.len() * bands).div_ceil(most).max(1);
        let days: IndexSet<&str> = days.into_iter().step_by(apart).collect();
        let mut clocks: Vec<&str> = file.times.iter().map(|time| parted(time).1).collect();
        clocks.sort_unstable();
        clocks.dedup();
        let place = |(day, clock): &(&str, &str)| {
            let clock = clocks.binary_search(clock).ok()?;
            Some((days.get_index_of(day)? * clocks.len() + clock) as u32)
        };
        let shown: Vec<(usize, u32)> =
            lit.iter().filter_map(|(hour, time)| Some((*hour, place(time)?))).collect();
        let (rows, shown) = (&rows, &shown);
        let of_hour = move |hour: usize| {
            let places = (0..bands).flat_map(move |b| rows.iter().map(move |row| row * bands + b));
            places.map(move |at| file.values[hour * each + at])
        };
        let all = || shown.iter().flat_map(move |(hour, _)| of_hour(*hour));
        let relative = |[value, error]: [f32; 2]| if value > 0.0 { error / value } else { 0.0 };
        let values = Levels::fine(all().map(|[value, _]| value).fold(f32::MIN_POSITIVE, f32::max));
        let errors = Levels::coarse(all().map(relative).fold(f32::MIN_POSITIVE, f32::max), 0.0);
        Self {
            value_levels: all().map(|[value, _]| values.level(value)).collect(),
            error_levels: all().map(|both| errors.level(relative(both)) as u8).collect(),
            slots: shown.iter().map(|(_, slot)| *slot).collect(),
            days: days.into_iter().map(String::from).collect(),
            clocks: clocks.into_iter().map(String::from).collect(),
            rows: row_of,
            bands: band_of,
            values,
            errors,
        }
    }

    pub fn facts(&self) -> Value {
        let place = |place: &Option<usize>| place.map_or(-1, |place| place as i64);
        let count = self.rows.iter().flatten().count();
        // most often there is a row for each, in order
        let rows = self.rows.iter().map(place).collect::<Vec<_>>();
        let rows = (count < rows.len()).then_some(rows);
        json!({
            "days": self.days, "clocks": self.clocks, "count": count, "rows": rows,
            "bands": self.bands.iter().map(place).collect::<Vec<_>>(),
            "values": self.values.facts(), "errors": self.errors.facts(),
        })
    }
}

/// Splits a time such as `2005-06-21T13:00+01:00` into day and time of day. A day or month is all of
/// it.
fn parted(time: &str) -> (&str, &str) {
    let (day, clock) = time.split_once('T').unwrap_or((time, ""));
    (day, clock.get(..5).unwrap_or(clock))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hours_without_light_and_days_beyond_the_most_are_left_out() {
        let times = |hour| (1..=4).map(move |day| format!("2025-06-0{day}T{hour:02}:00+01:00"));
        let file = YearTable {
            ids: vec!["a".into(), "b".into()],
            bands: vec!["PAR".into()],
            times: times(0).zip(times(12)).flat_map(|(night, noon)| [night, noon]).collect(),
            values: (0..4)
                .flat_map(|d| [[0.0; 2], [0.0; 2], [d as f32 + 1.0, 0.5], [8.0, 0.0]])
                .collect(),
            ..YearTable::default()
        };
        let names = || ["b", "none", "a"].into_iter();
        let bands = || ["far", "PAR"].into_iter();
        let hours = Series::at_most(&file, names(), bands(), 100);
        assert_eq!(hours.rows, [Some(0), None, Some(1)]);
        assert_eq!(hours.bands, [None, Some(0)]);
        assert_eq!(hours.facts()["rows"], json!([0, -1, 1]));
        assert_eq!(hours.days.len(), 4);
        assert_eq!(hours.clocks, ["00:00", "12:00"]);
        assert_eq!(hours.slots, [1, 3, 5, 7]);
        assert_eq!(hours.value_levels.len(), 8);
        assert_eq!((hours.value_levels[0], hours.value_levels[2]), (u16::MAX, u16::MAX));
        assert!(hours.value_levels[1] < hours.value_levels[3]);
        assert_eq!(hours.error_levels[..2], [0, 255]);
        let few = Series::at_most(&file, names(), bands(), 4);
        assert_eq!((few.days.len(), few.slots.len()), (2, 2));
        assert_eq!(few.days[1], "2025-06-03");
    }
}
