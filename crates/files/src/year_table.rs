//! The tables of values that `phylux year` writes as CSV or Parquet: of hours, days, months and the
//! whole period.
//!
//! The first columns are `captor` and `time`, `day`, `month` or `period`; sums have `unit` after
//! them. For each band there are columns such as `PAR_front` and `PAR_front_se`, at last those of a
//! quantity of the place as a whole. The rows go time by time; within a time captor by captor, then group by group.

#[cfg(feature = "parquet")]
mod parquet_rows;
mod rows;

use std::{
    collections::HashMap,
    path::{Path, PathBuf},
};

use crate::{csv_table::records, csv_text, input, json};
use phylux_core::{
    error::{Error, Result, call},
    words,
};
use phylux_results::year_facts::YearFacts;
use rows::{Columns, broken};
pub use rows::{Face, YearTable};

impl YearTable {
    /// Reads the table `name`, such as `hours`, in a folder that `phylux year` wrote: a Parquet file
    /// or else a CSV file, of which one face of each band is kept. Errors: the folder has neither
    /// file, or the file is not a complete table.
    pub fn read(folder: &Path, name: &str, face: Face) -> Result<Self> {
        let table = Self::read_rows(folder, name, face)?;
        match table.values.is_empty() {
            true => Err(broken(&table.path, "it has no row")),
            false => Ok(table),
        }
    }

    /// Reads a table as [`read`](Self::read) does, or one without a row, as hours are if none were
    /// asked for. Errors: those of `read` but this.
    pub fn read_rows(folder: &Path, name: &str, face: Face) -> Result<Self> {
        let [parquet, csv] = ["parquet", "csv"].map(|end| folder.join(format!("{name}.{end}")));
        let mut table = match (parquet.is_file(), csv.is_file()) {
            #[cfg(feature = "parquet")]
            (true, _) => parquet_rows::read(&parquet, face)?,
            (_, true) => Self::read_csv(&csv, face)?,
            (false, false) => {
                let problem = format!("holds no {name}.parquet and no {name}.csv");
                return Err(Error::input(folder.display(), problem).remedy(words![
                    "name the folder that ",
                    call("year"),
                    " has written"
                ]));
            }
            #[cfg(not(feature = "parquet"))]
            (true, false) => {
                return Err(Error::input(parquet.display(), "this build reads no Parquet").remedy(
                    words![
                        "write the tables with ",
                        call("year").with(phylux_core::error::setting("csv").on())
                    ],
                ));
            }
        };
        let all = table.times.len() * table.ids.len() * table.bands.len();
        if table.values.len() != all {
            return Err(broken(&table.path, "its last time is not complete"));
        }
        table.values.shrink_to_fit();
        Ok(table)
    }

    /// Returns the files of tables that a folder may have.
    pub fn files(folder: &Path) -> Vec<PathBuf> {
        let names = ["hours", "days", "months", "year"];
        let files =
            names.iter().flat_map(|name| ["parquet", "csv"].map(|end| format!("{name}.{end}")));
        files.map(|name| folder.join(name)).collect()
    }

    fn read_csv(path: &Path, face: Face) -> Result<Self> {
        let bytes =
            input::read_bytes(path).map_err(|why| Error::unreadable(path.display(), why))?;
        let mut rows = records(&bytes, path);
        let heading = rows.next().transpose()?;
        let heading: Vec<String> = heading
            .iter()
            .flat_map(|(_, row)| row.iter())
            .map(|cell| csv_text::text(cell).into())
            .collect();
        let columns = Columns::new(&heading, face).map_err(|problem| broken(path, problem))?;
        let mut table =
            Self { path: path.to_path_buf(), bands: columns.bands, face, ..Self::default() };
        let mut values = Vec::new();
        for record in rows {
            let (place, record) = record?;
            let cell = |i: usize| record.get(i).unwrap_or_default();
            let number = |i: usize| match cell(i) {
                "" => Ok(None),
                text => text.parse::<f32>().map(Some).map_err(|_| input::quoted(text)),
            };
            values.clear();
            let row = columns.places.iter().try_for_each(|at| {
                values.push([number(*at)?, number(at + 1)?]);
                Ok(())
            });
            let row = row.and_then(|()| {
                table.add(
                    csv_text::text(cell(0)).as_ref(),
                    csv_text::text(cell(1)).as_ref(),
                    &values,
                )
            });
            row.map_err(|problem| broken(path, format!("line {}: {problem}", place.line)))?;
        }
        Ok(table)
    }
}

/// The folder of a year: what its tables do not say themselves.
#[derive(Debug)]
pub struct YearFolder {
    /// How the light was found, and the units.
    pub facts: YearFacts,
    /// Names of the groups, with the numbers of their captors in rising order.
    groups: HashMap<String, Vec<usize>>,
    /// Ids of the captors, then names of the groups, in the order of the scene.
    ids: Vec<String>,
    /// Number of captors.
    captors: usize,
}

impl YearFolder {
    /// Names of the files that say it.
    pub const FACTS: &'static str = "year.json";
    /// Name of the table of daylight alone.
    pub const DAYLIGHT: &'static str = "daylight.csv";
    const CAPTORS: &'static str = "captors.csv";

    /// Reads the facts in a folder. Error: it holds no year.
    pub fn open(folder: &Path) -> Result<Self> {
        let path = folder.join(Self::FACTS);
        let none = |why: String| {
            Error::input(path.display(), why).remedy(words![
                "name the folder that ",
                call("year"),
                " has written"
            ])
        };
        let bytes = input::read_bytes(&path).map_err(none)?;
        json::check_memory(&bytes).map_err(none)?;
        let facts = serde_json::from_slice(&bytes)
            .map_err(|e| none(format!("does not tell of a year: {e}")))?;
        let path = folder.join(Self::CAPTORS);
        let bytes =
            input::read_bytes(&path).map_err(|why| Error::unreadable(path.display(), why))?;
        let mut rows = records(&bytes, &path);
        let head = rows.next().transpose()?;
        let column = head.and_then(|(_, head)| head.iter().position(|name| name == "groups"));
        let (mut ids, mut names, mut groups_of) = (Vec::new(), Vec::new(), Vec::new());
        for row in rows {
            let (_, row) = row?;
            let cell = |column: usize| csv_text::text(row.get(column).unwrap_or_default());
            ids.push(cell(0).to_string());
            match row.get(1) {
                Some("group") => names.push(cell(0).to_string()),
                _ => groups_of.push(column.map_or_else(String::new, |column| cell(column).into())),
            }
        }
        let mut groups: HashMap<_, _> = names.into_iter().map(|name| (name, Vec::new())).collect();
        for (captor, of) in groups_of.iter().enumerate() {
            for name in of.split("; ") {
                groups.entry(name.into()).and_modify(|members| members.push(captor));
            }
        }
        Ok(Self { facts, groups, ids, captors: groups_of.len() })
    }

    /// Reads what is daylight of the daily light integral on fronts in a band, by captor or group and
    /// day. Empty where the folder does not tell it, as where no lamps are switched. Error: the table
    /// is damaged.
    pub fn daylight(folder: &Path, band: &str) -> Result<HashMap<(String, String), f64>> {
        let path = folder.join(Self::DAYLIGHT);
        if !path.is_file() {
            return Ok(HashMap::new());
        }
        let bytes =
            input::read_bytes(&path).map_err(|why| Error::unreadable(path.display(), why))?;
        let mut found = HashMap::new();
        for record in records(&bytes, &path).skip(1) {
            let (place, record) = record?;
            let cell = |i: usize| csv_text::text(record.get(i).unwrap_or_default());
            let light = cell(3).parse::<f64>().ok().filter(|light| light.is_finite());
            let problem = || format!("line {}: {}", place.line, input::quoted(cell(3)));
            let light = light.ok_or_else(|| broken(&path, problem()))?;
            if cell(2) == band {
                found.insert((cell(0).to_string(), cell(1).to_string()), light);
            }
        }
        Ok(found)
    }

    /// Returns the ids of captors, then the names of groups, in the order of the scene.
    pub fn ids(&self) -> impl Iterator<Item = &str> {
        self.ids.iter().map(String::as_str)
    }

    /// Returns whether an id is the name of a group.
    pub fn is_group(&self, id: &str) -> bool {
        self.groups.contains_key(id)
    }

    /// Returns the numbers of the captors of a group, in rising order; none where the table does not
    /// tell them.
    pub fn members(&self, group: &str) -> &[usize] {
        self.groups.get(group).map_or(&[], Vec::as_slice)
    }

    /// Returns the number of captors.
    pub fn captors(&self) -> usize {
        self.captors
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TABLE: &str = "captor,time,PAR_front,PAR_front_se,PAR_back,PAR_back_se,far_front,far_front_se,far_back,far_back_se,whole,whole_se\n\
        a,2025-06-20T00:00+01:00,1,0.1,,,2,0.2,,,,\n\
        '=b,2025-06-20T00:00+01:00,3,0.3,5,0.5,4,0,6,0,1,0\n\
        a,2025-06-20T01:00+01:00,5,0.5,,,6,0.6,,,,\n\
        '=b,2025-06-20T01:00+01:00,7,0.7,9,0.9,8,0.8,10,1,1,0\n";

    fn read_face(text: &str, face: Face) -> Result<YearTable> {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("hours.csv"), text).unwrap();
        YearTable::read(folder.path(), "hours", face)
    }

    fn read(text: &str) -> Result<YearTable> {
        read_face(text, Face::Front)
    }

    #[test]
    fn hours_are_read_in_order() {
        let hours = read(TABLE).unwrap();
        assert_eq!(hours.ids, ["a", "=b"]);
        assert_eq!(hours.bands, ["PAR", "far"]);
        assert_eq!(hours.times, ["2025-06-20T00:00+01:00", "2025-06-20T01:00+01:00"]);
        assert_eq!(hours.values[2], [3.0, 0.3]);
        assert_eq!(hours.values[7], [8.0, 0.8]);
        // what a captor does not count is not a number
        let backs = read_face(TABLE, Face::Back).unwrap();
        assert!(backs.values[0][0].is_nan() && backs.values[3] == [6.0, 0.0]);
        let error = read_face(TABLE, Face::Absorbed).unwrap_err().to_string();
        assert!(error.contains("no captor absorbs"), "{error}");
        // one captor
        let one = TABLE.lines().filter(|line| !line.contains("=b"));
        let hours = read(&one.collect::<Vec<_>>().join("\n")).unwrap();
        assert_eq!(hours.values, [[1.0, 0.1], [2.0, 0.2], [5.0, 0.5], [6.0, 0.6]]);
    }

    #[test]
    fn what_is_no_table_of_hours_is_refused() {
        for (text, words) in [
            ("", "columns"),
            ("a,b\n", "columns"),
            (&TABLE[..TABLE.find('\n').unwrap() + 1], "no row"),
            (TABLE.rsplit_once("'=b").unwrap().0, "not complete"),
            (
                &TABLE.replacen("a,2025-06-20T01", "c,2025-06-20T01", 1),
                "line 4: `c`, `2025-06-20T01:00+01:00`",
            ),
            (&TABLE.replacen("'=b,2025-06-20T01", "'=b,2025-06-20T02", 1), "line 5"),
            (&TABLE.replacen(",5,0.5,,", ",five,0.5,,", 1), "line 4: `five`"),
            (&TABLE.replacen(",5,0.5,,", ",nan,0.5,,", 1), "line 4: a value that is no number"),
            (&TABLE.replacen(",1,0.1,", ",,,", 1), "line 2: a value that is no number"),
        ] {
            let error = read(text).unwrap_err().to_string();
            assert!(error.contains(words), "{error}: {words}");
        }
        let folder = tempfile::tempdir().unwrap();
        let error = YearTable::read(folder.path(), "hours", Face::Front).unwrap_err().to_string();
        assert!(error.contains("phylux year"), "{error}");
    }
}
