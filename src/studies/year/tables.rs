//! The output of a year by the hour: tables of hours, days, months, the whole period and lamps, and
//! a chart.

use std::{
    io::{self, Write},
    path::Path,
};

use super::{Lamp, Value, Year, local};
use crate::{
    error::{Error, Result},
    formats::{
        output::{FilesRead, OutputFile},
        written::{CompleteOwn, OwnFile, Written},
    },
    scene::daylight::Date,
    show::chart::{Chart, Series, Stroke},
    studies::table::{Cell, Kind, TableFile},
};

/// The files beside the table of hours: tables that are always CSV, and the chart.
const OTHERS: [&str; 5] = ["days.csv", "months.csv", "year.csv", "lamps.csv", CHART];
const CHART: &str = "dli.svg";
/// The record of these files in their folder, and what to do about one that is not of it.
const RECORD: &str = "year.written.json";
const REMEDY: &str = "move it away, or write into another folder";

/// The files of a year, all of which are written or none.
pub struct YearTables {
    written: Written,
    /// The files and their names: the table of hours, then the others.
    files: Vec<(String, OutputFile)>,
    /// Whether the table of hours is Parquet.
    parquet: bool,
}

impl YearTables {
    /// Prepares the files in an existing folder; `file` opens each. The table of hours is Parquet,
    /// or CSV if that is asked for or this build does not support Parquet. Error: there is a file
    /// that was not written by such tables, or has changed since.
    pub fn create(
        folder: &Path,
        csv: bool,
        mut file: impl FnMut(&Path) -> Result<OutputFile>,
    ) -> Result<Self> {
        let ending = if csv { "csv" } else { TableFile::<OwnFile>::ENDING };
        let names = [&[format!("hours.{ending}")][..], &OTHERS.map(String::from)].concat();
        let written = Written::read(folder, RECORD, REMEDY)?;
        written.check(&names)?;
        let files = names.into_iter().map(|name| {
            let prepared = file(&folder.join(&name))?;
            Ok((name, prepared))
        });
        Ok(Self { files: files.collect::<Result<_>>()?, written, parquet: ending == "parquet" })
    }
}

impl Year {
    /// Writes the tables into an existing folder.
    pub fn write_tables(&self, folder: &Path, csv: bool) -> Result<()> {
        let tables = YearTables::create(folder, csv, OutputFile::create)?;
        write(self, tables, &FilesRead::default())
    }
}

/// Writes all tables and the chart. None of them may replace a file that was `read`.
pub fn write(year: &Year, tables: YearTables, read: &FilesRead) -> Result<()> {
    let YearTables { written, files, parquet } = tables;
    let mut files = files.into_iter();
    let mut next = || {
        let (name, file) = files.next().ok_or_else(|| Error::run("tables", "one is missing"))?;
        Ok(written.begin(&name, file.open(read)?))
    };
    let mut complete = vec![table(next()?, &hour_columns(), parquet, |file| hours(year, file))?];
    type Name = fn(Date) -> String;
    let names: [(&str, Name); 3] = [("day", day), ("month", month), ("period", |_| "all".into())];
    for (column, name) in names {
        let columns = ["captor", column, "band", "unit"].map(|name| (name, Kind::Text));
        let columns = [&columns[..], &VALUES].concat();
        complete.push(table(next()?, &columns, false, |file| sums(year, name, file))?);
    }
    let columns = [
        ("light", Kind::Text),
        ("month", Kind::Text),
        ("hours", Kind::Number),
        ("kwh", Kind::Number),
    ];
    complete.push(table(next()?, &columns, false, |file| lamps(year, file))?);
    let mut file = next()?;
    file.write_all(chart(year)?.as_bytes()).map_err(unwritten)?;
    complete.push(file.complete()?);
    written.put(complete)
}

fn unwritten(e: io::Error) -> Error {
    Error::run("tables", format!("cannot be written: {e}"))
}

const VALUES: [(&str, Kind); 2] = [("value", Kind::Number), ("standard_error", Kind::Number)];

fn hour_columns() -> Vec<(&'static str, Kind)> {
    [&["captor", "time", "band"].map(|name| (name, Kind::Text))[..], &VALUES].concat()
}

fn table<'a>(
    file: OwnFile<'a>,
    columns: &[(&str, Kind)],
    parquet: bool,
    rows: impl FnOnce(&mut TableFile<OwnFile<'a>>) -> io::Result<()>,
) -> Result<CompleteOwn> {
    let mut table = TableFile::begin(file, columns, parquet).map_err(unwritten)?;
    rows(&mut table).map_err(unwritten)?;
    table.end().map_err(unwritten)?.complete()
}

fn hours<W: Write + Send>(year: &Year, table: &mut TableFile<W>) -> io::Result<()> {
    for (s, slot) in year.slots.iter().enumerate() {
        let (date, start) = local(slot);
        let minutes = (start * 60.0).round() as u32;
        let offset = (slot.start.offset / 60.0).round() as i32;
        let sign = if offset < 0 { '-' } else { '+' };
        let time = format!(
            "{}T{:02}:{:02}{sign}{:02}:{:02}",
            day(date),
            minutes / 60,
            minutes % 60,
            offset.abs() / 60,
            offset.abs() % 60
        );
        rows(year, &time, None, &year.hour(s), table)?;
    }
    Ok(())
}

fn sums<W: Write + Send>(
    year: &Year,
    name: fn(Date) -> String,
    table: &mut TableFile<W>,
) -> io::Result<()> {
    for (name, slots) in year.periods(name) {
        rows(year, &name, Some(year.unit), &year.daily(&slots), table)?;
    }
    Ok(())
}

/// Adds one row for each captor or group and each band. Daily light integrals have a row only for
/// the bands that have one.
fn rows<W: Write + Send>(
    year: &Year,
    when: &str,
    unit: Option<&str>,
    values: &[Value],
    table: &mut TableFile<W>,
) -> io::Result<()> {
    for (id, values) in year.ids.iter().zip(values.chunks(year.bands.len())) {
        for ((band, integrated), value) in year.bands.iter().zip(&year.integrated).zip(values) {
            if unit.is_some() && !integrated {
                continue;
            }
            let mut cells = vec![Cell::Text(id), Cell::Text(when), Cell::Text(&band.name)];
            cells.extend(unit.map(Cell::Text));
            cells.extend([Cell::Number(value.mean), Cell::Number(value.variance.sqrt())]);
            table.row(&cells)?;
        }
    }
    Ok(())
}

/// The largest number of groups, or of captors if there are no groups, that the chart shows.
const CHARTED: usize = 6;

/// Draws the daily light integral in the last band or sum that has one: the mean of each month with
/// the range of its days, or each day if there is one month alone.
fn chart(year: &Year) -> Result<String> {
    let first = match year.ids.len() > year.run.captors.len() {
        true => year.run.captors.len(),
        false => 0,
    };
    let shown: Vec<(usize, &String)> =
        year.ids.iter().enumerate().skip(first).take(CHARTED).collect();
    let mut chart = Chart { linear_x: true, linear_y: true, ..Chart::default() };
    // sums come after bands, so the last one is taken
    if let Some(band) = year.integrated.iter().rposition(|&integrated| integrated) {
        let name = &year.bands[band].name;
        chart.title = format!("daily light integral, {name}");
        chart.y = format!("{name}, {}", year.unit);
        let places: Vec<usize> = shown.iter().map(|(id, _)| id * year.bands.len() + band).collect();
        let months = year.periods(month);
        let is_by_month = months.len() > 1;
        let split = if is_by_month { months } else { year.periods(day) };
        let all = integrals(split.values().map(|slots| year.daily(slots)), &places);
        let daylight = match year.lamps.is_empty() {
            true => vec![Vec::new(); places.len()],
            false => integrals(split.values().map(|slots| year.daily_daylight(slots)), &places),
        };
        let ranges = if is_by_month { ranges(year, &places) } else { Vec::new() };
        for (colour, ((_, id), (all, daylight))) in
            shown.iter().zip(all.into_iter().zip(daylight)).enumerate()
        {
            let mut add = |name: Option<&String>, stroke, points: Vec<(f64, f64)>| {
                if !points.is_empty() {
                    chart.series.push(Series { name: name.cloned(), colour, stroke, points });
                }
            };
            if !is_by_month {
                add(Some(id), Stroke::Line, all);
                add(None, Stroke::Dashed, daylight);
                continue;
            }
            let width = 0.8 / shown.len() as f64;
            let aside = width * (colour as f64 - 0.5 * (shown.len() as f64 - 1.0));
            let beside = |points: Vec<(f64, f64)>| -> Vec<(f64, f64)> {
                points.into_iter().map(|(x, y)| (x + aside, y)).collect()
            };
            let column = |pale| Stroke::Columns { width: 0.94 * width, pale };
            add(Some(id), column(!year.lamps.is_empty()), beside(all));
            add(None, column(false), beside(daylight));
            // grey is seen on columns and beside them
            let (colour, points) = (Series::GREY, beside(ranges[colour].clone()));
            chart.series.push(Series { name: None, colour, stroke: Stroke::Bars, points });
        }
        if is_by_month {
            chart.x = "month, with the range of its days".into();
            let names = split.keys().zip(1..).map(|(name, i)| (f64::from(i), month_name(name)));
            chart.x_names = names.collect();
        } else {
            let first = split.keys().next();
            chart.x = first.map_or(String::new(), |day| format!("day, the first is {day}"));
        }
        if !year.lamps.is_empty() {
            chart.title += match is_by_month {
                true => " (dark: daylight alone)",
                false => " (dashed: daylight alone)",
            };
        }
    }
    chart.svg().map_err(|e| Error::run(CHART, e))
}

/// Returns the name of a month at the axis, such as `Jun` for `2005-06`.
fn month_name(month: &str) -> String {
    let names =
        ["Jan", "Feb", "Mar", "Apr", "May", "Jun", "Jul", "Aug", "Sep", "Oct", "Nov", "Dec"];
    let number: Option<usize> = month.rsplit('-').next().and_then(|number| number.parse().ok());
    number.and_then(|n| names.get(n.wrapping_sub(1))).map_or(month.into(), |name| name.to_string())
}

/// Returns the means at each of some places in period after period, which count from 1.
fn integrals(periods: impl Iterator<Item = Vec<Value>>, places: &[usize]) -> Vec<Vec<(f64, f64)>> {
    let mut points = vec![Vec::new(); places.len()];
    for (values, x) in periods.zip(1..) {
        for (points, &place) in points.iter_mut().zip(places) {
            points.push((f64::from(x), values[place].mean));
        }
    }
    points
}

/// Returns the least and the greatest daily integral of each month, one after the other, at each
/// place.
fn ranges(year: &Year, places: &[usize]) -> Vec<Vec<(f64, f64)>> {
    let mut ranges = vec![Vec::new(); places.len()];
    for (slots, x) in year.periods(month).values().zip(1..) {
        let date = |slot: usize| local(&year.slots[slot]).0;
        let days = slots.chunk_by(|&a, &b| date(a) == date(b));
        let days: Vec<Vec<Value>> = days.map(|slots| year.daily(slots)).collect();
        for (ranges, &place) in ranges.iter_mut().zip(places) {
            let of =
                |best: fn(f64, f64) -> f64| days.iter().map(|day| day[place].mean).reduce(best);
            let ends = [of(f64::min), of(f64::max)].into_iter().flatten();
            ranges.extend(ends.map(|end| (f64::from(x), end)));
        }
    }
    ranges
}

/// Adds the hours and energy of each lamp for every month, then for the whole period.
fn lamps<W: Write + Send>(year: &Year, table: &mut TableFile<W>) -> io::Result<()> {
    let months = year.periods(month);
    for lamp in &year.lamps {
        for (name, slots) in &months {
            lamp_row(year, lamp, name, slots.iter().copied(), table)?;
        }
        lamp_row(year, lamp, "all", 0..year.slots.len(), table)?;
    }
    Ok(())
}

fn lamp_row<W: Write + Send>(
    year: &Year,
    lamp: &Lamp,
    when: &str,
    slots: impl Iterator<Item = usize>,
    table: &mut TableFile<W>,
) -> io::Result<()> {
    let hours = year.hours_on(lamp, slots);
    let energy = lamp.watts.map(|watts| watts * hours / 1000.0);
    table.row(&[
        Cell::Text(&lamp.name),
        Cell::Text(when),
        Cell::Number(hours),
        Cell::number(energy),
    ])
}

/// Writes a date as `2005-06-21`.
pub fn day(date: Date) -> String {
    format!("{}-{:02}-{:02}", date.year, date.month, date.day)
}

/// Writes a month as `2005-06`.
pub fn month(date: Date) -> String {
    format!("{}-{:02}", date.year, date.month)
}
