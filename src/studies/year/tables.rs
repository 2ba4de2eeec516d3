//! The output of a year by the hour: tables of hours, days, months, the whole period and lamps, and
//! a chart.

use std::{
    io::{self, Write},
    path::Path,
};

use super::{
    Values, Year,
    hours::{Lamp, time},
};
use crate::{
    error::{Error, Result},
    formats::{
        output::{FilesRead, OutputFile},
        written::{CompleteOwn, OwnFile, Written},
    },
    scene::captor::Channel,
    show::chart::{Chart, Series, Stroke, Width},
    studies::table::{Cell, Kind, TableFile},
};

/// The files beside the table of hours: tables that are always CSV, and the chart.
const OTHERS: [&str; 8] = [
    "days.csv",
    "months.csv",
    "year.csv",
    "lamps.csv",
    CHART,
    "captors.csv",
    "states.csv",
    "ratios.csv",
];
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
        write(self, tables, &FilesRead::default(), &|_, _| {})
    }
}

/// Writes all tables and the chart. None of them may replace a file that was `read`.
/// `progress` is told how many hours are written, and of how many.
pub fn write(
    year: &Year,
    tables: YearTables,
    read: &FilesRead,
    progress: &dyn Fn(u64, u64),
) -> Result<()> {
    let YearTables { written, files, parquet } = tables;
    let mut files = files.into_iter();
    let mut next = || {
        let (name, file) = files.next().ok_or_else(|| Error::run("tables", "one is missing"))?;
        Ok(written.begin(&name, file.open(read)?))
    };
    let mut complete =
        vec![table(next()?, &columns(&["captor", "time", "band"]), parquet, |file| {
            hours(year, file, progress)
        })?];
    let days = || year.days.keys().enumerate().map(|(d, name)| (name.as_str(), year.day(d)));
    let months = || year.months.keys().enumerate().map(|(m, name)| (name.as_str(), year.month(m)));
    let whole = || std::iter::once(("all", year.whole()));
    complete.push(sums(year, next()?, "day", days())?);
    complete.push(sums(year, next()?, "month", months())?);
    complete.push(sums(year, next()?, "period", whole())?);
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
    complete.push(table(next()?, &CAPTORS, false, |file| captors(year, file))?);
    let columns = [("state", Kind::Text), ("month", Kind::Text), ("hours", Kind::Number)];
    complete.push(table(next()?, &columns, false, |file| states(year, file))?);
    complete.push(table(next()?, &RATIOS, false, |file| ratios(year, file))?);
    written.put(complete)
}

fn unwritten(e: io::Error) -> Error {
    Error::run("tables", format!("cannot be written: {e}"))
}

/// The values of a row: those of the front have the names that they had before there were others.
const VALUES: [&str; 8] = [
    "value",
    "standard_error",
    "back",
    "back_se",
    "absorbed",
    "absorbed_se",
    "sunlit",
    "sunlit_se",
];

/// Returns the columns of a table, the first of which have these names and hold text.
fn columns<'c>(texts: &[&'c str]) -> Vec<(&'c str, Kind)> {
    let texts = texts.iter().map(|&name| (name, Kind::Text));
    texts.chain(VALUES.map(|name| (name, Kind::Number))).collect()
}

fn table<'a>(
    file: OwnFile<'a>,
    columns: &[(&str, Kind)],
    parquet: bool,
    rows: impl FnOnce(&mut TableFile<OwnFile<'a>>) -> Result<()>,
) -> Result<CompleteOwn> {
    let mut table = TableFile::begin(file, columns, parquet).map_err(unwritten)?;
    rows(&mut table)?;
    table.end().map_err(unwritten)?.complete()
}

fn hours<W: Write + Send>(
    year: &Year,
    table: &mut TableFile<W>,
    progress: &dyn Fn(u64, u64),
) -> Result<()> {
    let ids: Vec<usize> = year.with_hours().collect();
    for (s, slot) in year.slots.iter().enumerate().filter(|_| !ids.is_empty()) {
        rows(year, &ids, &time(slot), None, &year.hour(s)?, table)?;
        progress(s as u64 + 1, year.slots.len() as u64);
    }
    Ok(())
}

/// Writes the table of sums over periods, the names of which stand in a column called `of`.
fn sums<'y>(
    year: &'y Year,
    file: OwnFile,
    of: &str,
    periods: impl Iterator<Item = (&'y str, Result<Values<'y>>)>,
) -> Result<CompleteOwn> {
    let ids: Vec<usize> = (0..year.places.ids.len()).collect();
    table(file, &columns(&["captor", of, "band", "unit"]), false, |table| {
        for (name, values) in periods {
            rows(year, &ids, name, Some(year.unit), &values?, table)?;
        }
        Ok(())
    })
}

/// Adds one row for each of these captors and groups and each band. Daily light integrals have a
/// row only for the bands that have one.
fn rows<W: Write + Send>(
    year: &Year,
    ids: &[usize],
    when: &str,
    unit: Option<&str>,
    values: &Values,
    table: &mut TableFile<W>,
) -> Result<()> {
    let of_bands = year.bands.iter().zip(&year.integrated).enumerate();
    let of_bands = of_bands.filter(|(_, (_, integrated))| unit.is_none() || **integrated);
    let mut cells = Vec::new();
    for &id in ids {
        let sunlit = values.sunlit(id);
        for (b, (band, _)) in of_bands.clone() {
            cells.clear();
            let texts = [&year.places.ids[id], when, &band.name];
            cells.extend(texts.map(Cell::Text));
            cells.extend(unit.map(Cell::Text));
            let light = [Channel::Front, Channel::Back, Channel::Absorbed]
                .map(|channel| values.light(id, channel, b));
            for value in light.into_iter().chain([sunlit]) {
                cells.push(Cell::number(value.map(|value| value.mean)));
                cells.push(Cell::number(value.map(|value| value.variance.sqrt())));
            }
            table.row(&cells).map_err(unwritten)?;
        }
    }
    Ok(())
}

/// Draws the daily light integral in the last band or sum that has one: the mean of each month with
/// the range of its days, or each day if there is one month alone.
fn chart(year: &Year) -> Result<String> {
    let mut chart = Chart { linear_x: true, linear_y: true, ..Chart::default() };
    if let Some(band) = year.charted.band {
        let name = &year.bands[band].name;
        chart.title = format!("daily light integral, {name}");
        chart.y = format!("{name}, {}", year.unit);
        let ids = &year.charted.ids;
        let light = |values: &Values, id: usize| {
            values.light(id, Channel::Front, band).map_or(0.0, |v| v.mean)
        };
        let mut all = vec![Vec::new(); ids.len()];
        for day in 0..year.days.len() {
            let values = year.day(day)?;
            for (all, &id) in all.iter_mut().zip(ids) {
                all.push(light(&values, id));
            }
        }
        let is_by_month = year.months.len() > 1;
        for (colour, &id) in ids.iter().enumerate() {
            let name = Some(year.places.ids[id].clone());
            let daylight = year.charted.daylight.get(colour);
            let mut add = |name, colour, stroke, points: Vec<(f64, f64)>| {
                if !points.is_empty() {
                    chart.series.push(Series { name, colour, stroke, points });
                }
            };
            if !is_by_month {
                let line = |values: &[f64]| values.iter().zip(1..).map(at).collect();
                add(name, colour, Stroke::Line, line(&all[colour]));
                add(None, colour, Stroke::Dashed, daylight.map_or(Vec::new(), |v| line(v)));
                continue;
            }
            let width = 0.8 / ids.len() as f64;
            let aside = width * (colour as f64 - 0.5 * (ids.len() as f64 - 1.0));
            let (mut means, mut shares, mut ranges) = (Vec::new(), Vec::new(), Vec::new());
            let mut first = 0;
            for (m, month) in year.months.keys().enumerate() {
                let x = (m + 1) as f64 + aside;
                let last = first
                    + year.days.keys().skip(first).take_while(|d| d.starts_with(month)).count();
                let days = &all[colour][first..last];
                let mean = light(&year.month(m)?, id);
                means.push((x, mean));
                let sum: f64 = days.iter().sum();
                if let Some(daylight) = daylight.filter(|_| sum > 0.0) {
                    shares.push((x, mean * daylight[first..last].iter().sum::<f64>() / sum));
                }
                let of = |best: fn(f64, f64) -> f64| days.iter().copied().reduce(best);
                ranges.extend([of(f64::min), of(f64::max)].into_iter().flatten().map(|y| (x, y)));
                first = last;
            }
            let column = |pale| Stroke::Columns { width: 0.94 * width, pale };
            add(name, colour, column(daylight.is_some()), means);
            add(None, colour, column(false), shares);
            // grey is seen on columns and beside them
            add(None, Series::GREY, Stroke::Bars, ranges);
        }
        if is_by_month {
            chart.x = "month, with the range of its days".into();
            chart.x_names =
                year.months.keys().zip(1..).map(|(m, i)| (f64::from(i), month_name(m))).collect();
        } else {
            let first = year.days.keys().next();
            chart.x = first.map_or(String::new(), |day| format!("day, the first is {day}"));
        }
        if !year.charted.daylight.is_empty() {
            chart.title += match is_by_month {
                true => " (dark: daylight alone)",
                false => " (dashed: daylight alone)",
            };
        }
    }
    chart.svg(Width::Page).map_err(|e| Error::run(CHART, e))
}

fn at((value, x): (&f64, i32)) -> (f64, f64) {
    (f64::from(x), *value)
}

/// Returns the name of a month at the axis, such as `Jun` for `2005-06`.
fn month_name(month: &str) -> String {
    let names =
        ["Jan", "Feb", "Mar", "Apr", "May", "Jun", "Jul", "Aug", "Sep", "Oct", "Nov", "Dec"];
    let number: Option<usize> = month.rsplit('-').next().and_then(|number| number.parse().ok());
    number.and_then(|n| names.get(n.wrapping_sub(1))).map_or(month.into(), |name| name.to_string())
}

/// Adds the hours and energy of each lamp for every month, then for the whole period.
fn lamps<W: Write + Send>(year: &Year, table: &mut TableFile<W>) -> Result<()> {
    for lamp in &year.lamps {
        for (name, slots) in &year.months {
            lamp_row(year, lamp, name, slots.iter().copied(), table)?;
        }
        lamp_row(year, lamp, "all", 0..year.slots.len(), table)?;
    }
    Ok(())
}

/// Adds the hours in which each state held for every month, then for the whole period.
fn states<W: Write + Send>(year: &Year, table: &mut TableFile<W>) -> Result<()> {
    let all: Vec<usize> = (0..year.slots.len()).collect();
    for (name, shares) in &year.states {
        let months = year.months.iter().map(|(month, slots)| (month.as_str(), slots));
        for (when, slots) in months.chain([("all", &all)]) {
            let hours = slots.iter().map(|&s| shares[s] * year.slots[s].length).sum();
            let cells = [Cell::Text(name), Cell::Text(when), Cell::Number(hours)];
            table.row(&cells).map_err(unwritten)?;
        }
    }
    Ok(())
}

const RATIOS: [(&str, Kind); 9] = [
    ("captor", Kind::Text),
    ("period", Kind::Text),
    ("ratio", Kind::Text),
    ("front", Kind::Number),
    ("front_se", Kind::Number),
    ("back", Kind::Number),
    ("back_se", Kind::Number),
    ("absorbed", Kind::Number),
    ("absorbed_se", Kind::Number),
];

/// Adds the ratios of the light of each day, then of each month, then of the whole period.
fn ratios<W: Write + Send>(year: &Year, table: &mut TableFile<W>) -> Result<()> {
    if year.places.ratios.is_empty() {
        return Ok(());
    }
    let days = year.days.keys().enumerate().map(|(d, name)| (name.as_str(), year.day(d)));
    let months = year.months.keys().enumerate().map(|(m, name)| (name.as_str(), year.month(m)));
    for (when, values) in days.chain(months).chain(std::iter::once(("all", year.whole()))) {
        let values = values?;
        for (id, name) in year.places.ids.iter().enumerate() {
            for (r, ratio) in year.places.ratios.iter().enumerate() {
                let mut cells = vec![Cell::Text(name), Cell::Text(when), Cell::Text(ratio)];
                for channel in [Channel::Front, Channel::Back, Channel::Absorbed] {
                    let found = values.ratio(id, channel, r);
                    cells.push(Cell::number(found.map(|found| found.mean)));
                    cells.push(Cell::number(found.map(|found| found.variance.sqrt())));
                }
                table.row(&cells).map_err(unwritten)?;
            }
        }
    }
    Ok(())
}

const CAPTORS: [(&str, Kind); 10] = [
    ("captor", Kind::Text),
    ("kind", Kind::Text),
    ("x", Kind::Number),
    ("y", Kind::Number),
    ("z", Kind::Number),
    ("nx", Kind::Number),
    ("ny", Kind::Number),
    ("nz", Kind::Number),
    ("area", Kind::Number),
    ("groups", Kind::Text),
];

/// Adds a row for each captor and group: what it is, and where.
fn captors<W: Write + Send>(year: &Year, table: &mut TableFile<W>) -> Result<()> {
    let places = &year.places;
    for (id, (name, shape)) in places.ids.iter().zip(&places.shapes).enumerate() {
        let mut cells = vec![Cell::Text(name), Cell::Text(shape.kind)];
        match shape.center.zip(shape.normal) {
            Some((center, normal)) => {
                cells.extend(
                    center.to_array().into_iter().chain(normal.to_array()).map(Cell::Number),
                );
            }
            None => cells.resize(8, Cell::Nothing),
        }
        cells.push(Cell::Number(places.areas[id][Channel::Front as usize]));
        cells.push(Cell::Text(&shape.groups));
        table.row(&cells).map_err(unwritten)?;
    }
    Ok(())
}

fn lamp_row<W: Write + Send>(
    year: &Year,
    lamp: &Lamp,
    when: &str,
    slots: impl Iterator<Item = usize> + Clone,
    table: &mut TableFile<W>,
) -> Result<()> {
    let hours = year.hours_on(lamp, slots.clone());
    let energy = year.energy(lamp, slots);
    let cells =
        [Cell::Text(&lamp.name), Cell::Text(when), Cell::Number(hours), Cell::number(energy)];
    table.row(&cells).map_err(unwritten)
}
