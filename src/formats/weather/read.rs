//! Reads the formats EPW, TMY3 and CSV.

use std::{fmt::Display, path::Path};

use super::record::{Clock, DAY, HOUR, Record, Site, Stamp, Weather};
use crate::{
    error::{Error, Result},
    formats::{input::quoted, iso8601::parse_time},
    scene::daylight::{Date, Timestamp},
};

/// EPW files use values from this one upwards for missing values.
const MISSING: f64 = 9999.0;
/// The largest irradiance that is accepted, W/m2; on the ground it is never larger.
const LARGEST: f64 = 2000.0;
/// The smallest value that is accepted, W/m2, because instruments show slightly negative values at
/// night.
const NIGHT: f64 = -20.0;

/// A line of the file, with its number for errors, and its values between commas.
struct Line<'a> {
    path: &'a Path,
    line: u64,
    values: Vec<&'a str>,
}

impl Line<'_> {
    fn place(&self) -> String {
        format!("{}:{}", self.path.display(), self.line)
    }

    fn error(&self, problem: impl Display) -> Error {
        Error::input(self.place(), problem)
    }

    /// Returns the value in `column`, which is counted from 0.
    fn text(&self, column: usize, name: &str) -> Result<&str> {
        self.values.get(column).copied().ok_or_else(|| {
            let problem =
                format!("{} values, {name} should be number {}", self.values.len(), column + 1);
            self.error(problem).remedy("the line is cut off: fetch the file again")
        })
    }

    fn number(&self, column: usize, name: &str) -> Result<f64> {
        let text = self.text(column, name)?;
        text.parse().ok().filter(|x: &f64| x.is_finite()).ok_or_else(|| {
            self.error(format!("{name} is {}, not a finite number", quoted(text)))
                .remedy("write it like 0.25 or 2.5e-1")
        })
    }

    /// Reads an integer within a range.
    fn integer(
        &self,
        column: usize,
        name: &str,
        range: std::ops::RangeInclusive<i64>,
    ) -> Result<i64> {
        let text = self.text(column, name)?;
        text.parse().ok().filter(|x| range.contains(x)).ok_or_else(|| {
            let (first, last) = (range.start(), range.end());
            self.error(format!("{name} is {}, must be {first} to {last}", quoted(text)))
                .remedy("fetch the file again")
        })
    }

    /// Reads an irradiance, W/m2; `None` where the file says that it is missing.
    fn irradiance(
        &self,
        column: usize,
        name: &str,
        missing: impl Fn(f64) -> bool,
    ) -> Result<Option<f64>> {
        if self.text(column, name)?.is_empty() {
            return Ok(None);
        }
        let value = self.number(column, name)?;
        if missing(value) {
            return Ok(None);
        }
        if !(NIGHT..=LARGEST).contains(&value) {
            let problem = format!("{name} is {value} W/m2, must be 0 to {LARGEST}");
            return Err(self.error(problem).remedy("leave out what is missing, or mend the value"));
        }
        Ok(Some(value.max(0.0)))
    }

    fn site(&self, latitude: usize, longitude: usize) -> Result<Site> {
        let site = Site {
            latitude: self.number(latitude, "the latitude")?,
            longitude: self.number(longitude, "the longitude")?,
        };
        if site.latitude.abs() > 90.0 || site.longitude.abs() > 180.0 {
            let problem =
                format!("no place has latitude {}, longitude {}", site.latitude, site.longitude);
            return Err(self.error(problem).remedy("fetch the file again"));
        }
        Ok(site)
    }

    /// Reads the offset of standard time from UTC, s; the file has it in hours.
    fn zone(&self, column: usize) -> Result<f64> {
        let hours = self.number(column, "the time zone")?;
        match hours.abs() <= 14.0 {
            true => Ok(hours * HOUR),
            false => Err(self
                .error(format!("the time zone is {hours} h, must be -14 to 14"))
                .remedy("fetch the file again")),
        }
    }
}

/// Reads a weather file; [`Weather::parse`] describes the errors.
pub(super) fn parse(bytes: &[u8], path: &Path, stamp: Option<Stamp>) -> Result<Weather> {
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    // names of places may be in any encoding, but numbers are ASCII in all of them
    let text = String::from_utf8_lossy(bytes);
    let lines = text.lines().zip(1..).map(|(text, line)| Line {
        path,
        line,
        values: text.split(',').map(|v| v.trim().trim_matches('"')).collect(),
    });
    // skip lines without content
    let lines: Vec<Line> = lines.filter(|l| l.values.iter().any(|v| !v.is_empty())).collect();
    let Some(first) = lines.first() else {
        return Err(Error::input(path.display(), "is empty").remedy(KINDS));
    };
    let epw = first.values[0].eq_ignore_ascii_case("LOCATION");
    if bytes.contains(&0) {
        return Err(Error::input(path.display(), "is not text but binary").remedy(KINDS));
    }
    let tmy3 = lines.get(1).is_some_and(|l| l.values[0].starts_with("Date (MM/DD/YYYY)"));
    let mut weather = match (epw || tmy3, stamp) {
        (true, Some(_)) => {
            let problem = "`stamp` goes with CSV alone: EPW and TMY3 give the hour that ends";
            return Err(Error::input(path.display(), problem).remedy("leave `stamp` out"));
        }
        (false, None) => {
            let problem = "does not say where in its interval the time of a row stands";
            let remedy = "set `stamp` beside the file to `start`, `middle` or `end`";
            return Err(Error::input(path.display(), problem).remedy(remedy));
        }
        (true, None) if epw => read_epw(path, &lines)?,
        (true, None) => read_tmy3(path, &lines)?,
        (false, Some(stamp)) => read_csv(path, &lines, stamp)?,
    };
    if weather.records.is_empty() {
        return Err(Error::input(path.display(), "holds no hour").remedy(KINDS));
    }
    weather.records.sort_by(|a, b| a.from.total_cmp(&b.from));
    for pair in weather.records.windows(2) {
        // times may be rounded to decimal minutes, so allow for an overlap of a second
        if pair[1].from < pair[0].to - 1.0 {
            let line = pair[0].line.max(pair[1].line);
            let problem = format!("its hour stands in line {} too", pair[0].line.min(pair[1].line));
            return Err(Error::input(format_args!("{}:{line}", path.display()), problem)
                .remedy("keep one of them"));
        }
    }
    Ok(weather)
}

const KINDS: &str = "weather files are EPW, TMY3, or CSV with columns time, ghi, dni, dhi";

/// Returns the start of a record that ends at `hour` of a day, on the clock of a typical year and
/// as a real time; `None` on a leap day.
fn typical(date: Date, hour: i64, zone: f64) -> Option<(f64, Timestamp)> {
    let since_midnight = (hour - 1) as f64 * HOUR;
    let unix = date.days() as f64 * DAY + since_midnight - zone;
    if (date.month, date.day) == (2, 29) {
        return None;
    }
    let common = Date { year: 2001, ..date };
    let from = (common.day_of_year() - 1) as f64 * DAY + since_midnight;
    Some((from, Timestamp { unix, offset: zone }))
}

/// Reads EnergyPlus weather (Auxiliary programs, EnergyPlus 9.6): eight lines about the place, then
/// one line per hour.
fn read_epw(path: &Path, lines: &[Line]) -> Result<Weather> {
    let site = lines[0].site(6, 7)?;
    let zone = lines[0].zone(8)?;
    let periods = lines.iter().position(|l| l.values[0].eq_ignore_ascii_case("DATA PERIODS"));
    let Some(periods) = periods else {
        return Err(Error::input(path.display(), "has no line `DATA PERIODS`")
            .remedy("fetch the file again: an EPW file begins with eight such lines"));
    };
    let per_hour = lines[periods].integer(2, "the number of records in an hour", 1..=60)?;
    if per_hour != 1 {
        let problem = format!("{per_hour} records in an hour");
        return Err(lines[periods].error(problem).remedy("use a file of whole hours"));
    }
    let mut records = Vec::new();
    for line in &lines[periods + 1..] {
        let year = line.integer(0, "the year", 1900..=2100)?;
        let date = date(line, year, 1, 2)?;
        let hour = line.integer(3, "the hour", 1..=24)?;
        let value = |column, name| line.irradiance(column, name, |x| x >= MISSING);
        let [global, direct, diffuse] =
            [value(13, "global")?, value(14, "direct normal")?, value(15, "diffuse")?];
        let Some((from, start)) = typical(date, hour, zone) else { continue };
        let to = from + HOUR;
        records.push(Record { line: line.line, from, to, start, global, direct, diffuse });
    }
    Ok(Weather { path: path.into(), site: Some(site), clock: Clock::TypicalYear { zone }, records })
}

/// Reads a date from the columns of its month and its day.
fn date(line: &Line, year: i64, month: usize, day: usize) -> Result<Date> {
    let month = line.integer(month, "the month", 1..=12)?;
    let day = line.integer(day, "the day", 1..=31)?;
    Date::new(year, month as u32, day as u32).ok_or_else(|| {
        let problem = format!("there is no day {year}-{month:02}-{day:02}");
        line.error(problem).remedy("fetch the file again")
    })
}

/// Reads a typical meteorological year, third collection (Wilcox and Marion, NREL/TP-581-43156,
/// 2008).
fn read_tmy3(path: &Path, lines: &[Line]) -> Result<Weather> {
    let zone = lines[0].zone(3)?;
    let site = lines[0].site(4, 5)?;
    let header = &lines[1];
    let column = |name: &str| {
        header.values.iter().position(|v| v.starts_with(name)).ok_or_else(|| {
            header.error(format!("no column `{name}`")).remedy("fetch the file again")
        })
    };
    let columns = [column("GHI (W/m^2)")?, column("DNI (W/m^2)")?, column("DHI (W/m^2)")?];
    let mut records = Vec::new();
    for line in &lines[2..] {
        let text = line.text(0, "the date")?;
        let numbers: Vec<Option<i64>> = text.split('/').map(|part| part.parse().ok()).collect();
        let date = match numbers[..] {
            [Some(month @ 1..=12), Some(day @ 1..=31), Some(year)] => {
                Date::new(year, month as u32, day as u32)
            }
            _ => None,
        };
        let date = date.ok_or_else(|| {
            line.error(format!("the date is {}", quoted(text))).remedy("write it like 06/21/1998")
        })?;
        let text = line.text(1, "the time")?;
        let hour = text.split(':').next().and_then(|hour| hour.parse().ok());
        let hour = hour.filter(|hour| (1..=24).contains(hour)).ok_or_else(|| {
            line.error(format!("the time is {}, must be 01:00 to 24:00", quoted(text)))
                .remedy("fetch the file again")
        })?;
        let value =
            |k: usize, name| line.irradiance(columns[k], name, |x| x <= -9900.0 || x >= MISSING);
        let [global, direct, diffuse] = [value(0, "GHI")?, value(1, "DNI")?, value(2, "DHI")?];
        let Some((from, start)) = typical(date, hour, zone) else { continue };
        let to = from + HOUR;
        records.push(Record { line: line.line, from, to, start, global, direct, diffuse });
    }
    Ok(Weather { path: path.into(), site: Some(site), clock: Clock::TypicalYear { zone }, records })
}

/// Reads a CSV file: a header with `time`, `ghi` and, where measured, `dni` and `dhi`, then rows
/// that are 1 s to 1 h apart.
fn read_csv(path: &Path, lines: &[Line], stamp: Stamp) -> Result<Weather> {
    const NAMES: [&str; 4] = ["time", "ghi", "dni", "dhi"];
    let header = &lines[0];
    let mut columns = [None; 4];
    for (i, name) in header.values.iter().enumerate() {
        let Some(known) = NAMES.iter().position(|known| known.eq_ignore_ascii_case(name)) else {
            return Err(header.error(format!("unknown column {}", quoted(name))).remedy(KINDS));
        };
        if columns[known].replace(i).is_some() {
            return Err(header.error(format!("two columns {name}")).remedy("keep one of them"));
        }
    }
    let Some(time) = columns[0] else {
        return Err(header.error("no column `time`").remedy(KINDS));
    };
    if columns[1].is_none() && (columns[2].is_none() || columns[3].is_none()) {
        return Err(header.error("neither `ghi` nor `dni` and `dhi`").remedy(KINDS));
    }
    let mut records = Vec::new();
    for line in &lines[1..] {
        if line.values.len() != header.values.len() {
            let problem = format!(
                "{} values, but the header has {} columns",
                line.values.len(),
                header.values.len()
            );
            return Err(line.error(problem).remedy("numbers take a decimal point, not a comma"));
        }
        let start = parse_time(line.text(time, "time")?, line.place())?;
        let value = |k: usize| match columns[k] {
            Some(column) => line.irradiance(column, NAMES[k], |x| x >= MISSING),
            None => Ok(None),
        };
        let [global, direct, diffuse] = [value(1)?, value(2)?, value(3)?];
        let (from, to) = (start.unix, start.unix);
        records.push(Record { line: line.line, from, to, start, global, direct, diffuse });
    }
    let step = step(path, &records)?;
    let back = match stamp {
        Stamp::Start => 0.0,
        Stamp::Middle => 0.5 * step,
        Stamp::End => step,
    };
    for record in &mut records {
        record.from -= back;
        record.to = record.from + step;
        record.start.unix = record.from;
    }
    Ok(Weather { path: path.into(), site: None, clock: Clock::Unix, records })
}

/// Returns the shortest time between neighbouring rows, s. Error: it is not 1 s to 1 h, or there
/// are fewer than two rows.
fn step(path: &Path, records: &[Record]) -> Result<f64> {
    let mut times: Vec<f64> = records.iter().map(|record| record.from).collect();
    times.sort_by(f64::total_cmp);
    let steps = times.windows(2).map(|pair| pair[1] - pair[0]).filter(|&step| step > 0.0);
    let step = steps.fold(f64::INFINITY, f64::min);
    match (1.0..=HOUR).contains(&step) {
        true => Ok(step),
        false if records.len() < 2 => Err(Error::input(path.display(), "holds less than two rows")
            .remedy("the time between rows says how long each one counts")),
        false => Err(Error::input(path.display(), format!("rows are {step} s apart"))
            .remedy("use rows 1 s to 1 h apart")),
    }
}
