//! Lines and cells of weather files, and what counts as missing.

use std::{fmt::Display, path::Path};

use super::record::{DAY, HOUR, Site};
use crate::input::quoted;
use phylux_core::{
    error::{Error, Result},
    scene::daylight::Date,
};

/// EPW files use values from this one upwards for missing values.
const MISSING: f64 = 9999.0;
/// Files use values up to this one for missing values: -99, -999, -9900.
const MISSING_BELOW: f64 = -99.0;
/// The largest irradiance that is accepted, W/m2; on the ground it is never larger.
const LARGEST: f64 = 2000.0;
/// The smallest value that is accepted, W/m2, because instruments show slightly negative values at
/// night.
const NIGHT: f64 = -20.0;
/// What may be read.
pub(super) const KINDS: &str = "weather files are EPW, TMY3, TMY2, tables of PVGIS, NSRDB, Open-Meteo and NASA \
     POWER as they come, or CSV with columns time, ghi, dni, dhi";
/// Words for a missing value.
const WORDS: [&str; 12] =
    ["", "nan", "na", "n/a", "#n/a", "null", "none", "nil", "-", "--", "missing", "nodata"];

/// Cells that hold neither an irradiance nor a usual sign of a missing one.
#[derive(Debug, Default)]
pub(super) struct Odd {
    count: usize,
    first: Option<String>,
}

impl Odd {
    /// Reads an irradiance, W/m2, from a cell in units of `factor` W/m2; `None` where it is
    /// missing.
    pub(super) fn irradiance(
        &mut self,
        text: &str,
        factor: f64,
        name: &str,
        line: u64,
    ) -> Option<f64> {
        if WORDS.iter().any(|word| word.eq_ignore_ascii_case(text)) {
            return None;
        }
        let value = text.parse().ok().filter(|x: &f64| x.is_finite());
        if value.is_some_and(|x| x >= MISSING || x <= MISSING_BELOW) {
            return None;
        }
        let value = value.map(|x| x * factor).filter(|x| (NIGHT..=LARGEST).contains(x));
        if value.is_none() {
            self.count += 1;
            let say = || format!("{} as {name} in line {line}", quoted(text));
            self.first.get_or_insert_with(say);
        }
        value.map(|x| x.max(0.0))
    }

    /// Returns a warning of such cells.
    pub(super) fn note(&self) -> Option<String> {
        let first = self.first.as_ref()?;
        let cells = match self.count {
            1 => ["1 cell holds".to_owned(), "counts".to_owned()],
            count => [format!("{count} cells hold"), "count".to_owned()],
        };
        let [cells, count] = cells;
        Some(format!(
            "{cells} no irradiance, which is 0 to {LARGEST} W/m2, and {count} as missing; the first is {first}"
        ))
    }
}

/// Returns the values of a line, which stand between commas. A comma in quotes is part of a value.
pub(super) fn cells(line: &str) -> Vec<&str> {
    let mut cells = Vec::new();
    let mut rest = Some(line);
    while let Some(text) = rest {
        let quoted = text.trim_start().strip_prefix('"').and_then(|inner| inner.split_once('"'));
        let quoted = quoted.filter(|(_, after)| {
            let after = after.trim_start();
            after.is_empty() || after.starts_with(',')
        });
        let (cell, after) = match quoted {
            Some((cell, after)) => (cell, after.split_once(',').map(|(_, after)| after)),
            None => match text.split_once(',') {
                Some((cell, after)) => (cell.trim().trim_matches('"'), Some(after)),
                None => (text.trim().trim_matches('"'), None),
            },
        };
        cells.push(cell.trim());
        rest = after;
    }
    cells
}

/// A line of the file, with its number for errors, and its values between commas.
pub(super) struct Line<'a> {
    pub(super) path: &'a Path,
    pub(super) line: u64,
    pub(super) whole: &'a str,
    pub(super) values: Vec<&'a str>,
}

impl Line<'_> {
    pub(super) fn place(&self) -> String {
        format!("{}:{}", self.path.display(), self.line)
    }

    pub(super) fn error(&self, problem: impl Display) -> Error {
        Error::input(self.place(), problem)
    }

    /// Refuses a line about the place that has another number of values than `due`, apart from empty
    /// ones at its end: a comma in a name would shift the place and the time zone.
    pub(super) fn count(&self, due: std::ops::RangeInclusive<usize>) -> Result<()> {
        let filled = self.values.iter().rposition(|v| !v.is_empty()).map_or(0, |last| last + 1);
        let most = due.end();
        if filled <= *most && due.start() <= &self.values.len() {
            return Ok(());
        }
        let error = self.error(format!("{filled} values between commas in place of {most}"));
        Err(match filled > *most {
            true => error.remedy("put a name that holds a comma in quotes, or take the comma out"),
            false => {
                error.remedy("fetch the file again, or add the commas of values that are missing")
            }
        })
    }

    /// Returns the value in `column`, which is counted from 0.
    pub(super) fn text(&self, column: usize, name: &str) -> Result<&str> {
        self.values.get(column).copied().ok_or_else(|| {
            let problem =
                format!("{} values, {name} should be number {}", self.values.len(), column + 1);
            self.error(problem).remedy("the line is cut off: fetch the file again")
        })
    }

    pub(super) fn number(&self, column: usize, name: &str) -> Result<f64> {
        let text = self.text(column, name)?;
        text.parse().ok().filter(|x: &f64| x.is_finite()).ok_or_else(|| {
            self.error(format!("{name} is {}, not a finite number", quoted(text)))
                .remedy("write it like 0.25 or 2.5e-1")
        })
    }

    /// Reads an integer within a range.
    pub(super) fn integer(
        &self,
        column: usize,
        name: &str,
        range: std::ops::RangeInclusive<i64>,
    ) -> Result<i64> {
        self.within(self.text(column, name)?, name, range)
    }

    fn within(&self, text: &str, name: &str, range: std::ops::RangeInclusive<i64>) -> Result<i64> {
        text.parse().ok().filter(|x| range.contains(x)).ok_or_else(|| {
            let (first, last) = (range.start(), range.end());
            self.error(format!("{name} is {}, must be {first} to {last}", quoted(text)))
                .remedy("fetch the file again")
        })
    }

    /// Reads an irradiance, W/m2; `None` where it is missing.
    pub(super) fn irradiance(
        &self,
        column: usize,
        name: &str,
        odd: &mut Odd,
    ) -> Result<Option<f64>> {
        let text = self.text(column, name)?;
        Ok(odd.irradiance(text, 1.0, name, self.line))
    }

    pub(super) fn site(&self, latitude: usize, longitude: usize) -> Result<Site> {
        let site = Site {
            latitude: self.number(latitude, "the latitude")?,
            longitude: self.number(longitude, "the longitude")?,
        };
        self.checked(site)
    }

    /// Returns a site if it is on the earth.
    pub(super) fn checked(&self, site: Site) -> Result<Site> {
        if site.latitude.abs() > 90.0 || site.longitude.abs() > 180.0 {
            let problem =
                format!("no place has latitude {}, longitude {}", site.latitude, site.longitude);
            return Err(self.error(problem).remedy("fetch the file again"));
        }
        Ok(site)
    }

    /// Reads the offset of standard time from UTC, s; the file has it in hours.
    pub(super) fn zone(&self, column: usize) -> Result<f64> {
        let hours = self.number(column, "the time zone")?;
        match hours.abs() <= 14.0 {
            true => Ok(hours * HOUR),
            false => Err(self
                .error(format!("the time zone is {hours} h, must be -14 to 14"))
                .remedy("fetch the file again")),
        }
    }

    /// Returns the text of a column of fixed width.
    pub(super) fn cut(&self, columns: std::ops::Range<usize>) -> Result<&str> {
        self.whole.get(columns.clone()).map(str::trim).ok_or_else(|| {
            let problem = format!("ends before column {}", columns.end);
            self.error(problem).remedy("the line is cut off: fetch the file again")
        })
    }

    /// Reads an integer within a range from a column of fixed width.
    pub(super) fn fixed(
        &self,
        columns: std::ops::Range<usize>,
        name: &str,
        range: std::ops::RangeInclusive<i64>,
    ) -> Result<i64> {
        let text = self.cut(columns)?;
        self.within(text, name, range)
    }
}

/// Reads a date from the columns of its month and its day.
pub(super) fn date(line: &Line, year: i64, month: usize, day: usize) -> Result<Date> {
    let month = line.integer(month, "the month", 1..=12)?;
    let day = line.integer(day, "the day", 1..=31)?;
    existing(line, year, month, day)
}

/// Returns a day if it exists.
pub(super) fn existing(line: &Line, year: i64, month: i64, day: i64) -> Result<Date> {
    Date::new(year, month as u32, day as u32).ok_or_else(|| {
        let problem = format!("there is no day {year}-{month:02}-{day:02}");
        line.error(problem).remedy("fetch the file again")
    })
}

/// Returns the start of a day on the clock of a typical year, which has 366 days, s.
pub(super) fn in_typical_year(date: Date) -> f64 {
    (Date { year: 2000, ..date }.day_of_year() - 1) as f64 * DAY
}
