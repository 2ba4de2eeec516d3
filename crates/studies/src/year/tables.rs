//! The output of a year by the hour: tables of hours, days, months, the whole period and lamps, a
//! chart, and results of months.

use std::{
    borrow::Cow,
    cell::Cell,
    io::{self, Write},
    path::{Path, PathBuf},
};

use super::{
    Values, Year,
    hours::{Lamp, time},
    kept::{KeptLight, LIGHT},
    value::OWN,
};
use crate::table::{Cell as Entry, Kind, TableFile};
use phylux_core::{
    error::{Error, Result},
    scene::captor::Channel,
};
use phylux_files::{
    output::{FilesRead, OutputFile},
    result_file::{write_json, write_lines},
    written::{CompleteOwn, OwnFile, Written},
    year_table::{Face, YearFolder},
};
use phylux_show::{
    chart::Chart,
    plot::{DailyLight, OfId, PlotStyle},
};

/// The tables of values, which are Parquet unless CSV is asked for.
const TABLES: [&str; 4] = ["hours", "days", "months", "year"];
/// The other files, of which tables are always CSV.
const OTHERS: [&str; 7] = [
    "lamps.csv",
    CHART,
    "captors.csv",
    "states.csv",
    "ratios.csv",
    YearFolder::DAYLIGHT,
    YearFolder::FACTS,
];
/// The chart, without ending.
const CHART: &str = "dli";
/// The table of the ratios of hours, if the scene has ratios.
const HOUR_RATIOS: &str = "hour-ratios";
/// The record of these files in their folder, and what to do about one that is not of it.
const RECORD: &str = "year.written.json";
const REMEDY: &str = "move it away, or write into another folder";

/// The files of a year, all of which are written or none.
pub struct YearTables {
    written: Written,
    folder: PathBuf,
    /// The files and their names: tables of values, the others, ratios of hours, and results of
    /// months.
    files: Vec<(String, OutputFile)>,
    /// The file of the light.
    light: OutputFile,
    /// Whether the tables of values are Parquet.
    parquet: bool,
    /// How the chart is written.
    style: PlotStyle,
    /// Whether there are ratios of hours, and results of months.
    ratios: bool,
    results: bool,
}

impl YearTables {
    /// Prepares the files in an existing folder; `file` opens each. The tables of values are
    /// Parquet, or CSV if that is asked for or this build does not support Parquet. Error: there is
    /// a file that was not written by such tables, or has changed since.
    pub fn create(
        folder: &Path,
        csv: bool,
        style: PlotStyle,
        mut file: impl FnMut(&Path) -> Result<OutputFile>,
    ) -> Result<Self> {
        let ending = if csv { "csv" } else { TableFile::<OwnFile>::ENDING };
        let names = TABLES.iter().map(|name| format!("{name}.{ending}"));
        let named = |name| match name {
            CHART => format!("{CHART}.{}", style.ending()),
            other => other.to_string(),
        };
        let names = names.chain(OTHERS.map(named)).collect();
        let written = Written::read(folder, RECORD, REMEDY)?;
        written.check(&[LIGHT.into()])?;
        let mut tables = Self {
            light: file(&folder.join(LIGHT))?,
            written,
            folder: folder.to_path_buf(),
            files: Vec::new(),
            parquet: ending == "parquet",
            style,
            ratios: false,
            results: false,
        };
        tables.add(names, file)?;
        Ok(tables)
    }

    /// Returns the folder.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// Prepares a table of the ratios of hours besides. Error: as for [`create`](Self::create).
    pub fn with_ratios(mut self, file: impl FnMut(&Path) -> Result<OutputFile>) -> Result<Self> {
        let ending = if self.parquet { "parquet" } else { "csv" };
        self.add(vec![format!("{HOUR_RATIOS}.{ending}")], file)?;
        self.ratios = true;
        Ok(self)
    }

    /// Prepares results of each of these months, and of the whole period, besides. Error: as for
    /// [`create`](Self::create).
    pub fn with_results<'m>(
        mut self,
        months: impl Iterator<Item = &'m String>,
        file: impl FnMut(&Path) -> Result<OutputFile>,
    ) -> Result<Self> {
        let months = months.map(String::as_str).chain(["all"]);
        self.add(months.map(|month| format!("results-{month}.json")).collect(), file)?;
        self.results = true;
        Ok(self)
    }

    fn add(
        &mut self,
        names: Vec<String>,
        mut file: impl FnMut(&Path) -> Result<OutputFile>,
    ) -> Result<()> {
        self.written.check(&names)?;
        for name in names {
            let prepared = file(&self.folder.join(&name))?;
            self.files.push((name, prepared));
        }
        Ok(())
    }
}

/// Writes all tables and the chart, and the light if it is to be kept. None of them may replace a
/// file that was `read`. `progress` is told how many rows are written, and of how many.
pub fn write(
    year: &Year,
    tables: YearTables,
    kept: Option<&KeptLight>,
    read: &FilesRead,
    progress: &dyn Fn(u64, u64),
) -> Result<()> {
    let YearTables { written, files, light, parquet, style, .. } = tables;
    let (with_ratios, results) = (tables.ratios, tables.results);
    let mut files = files.into_iter();
    let mut next = || {
        let (name, file) = files.next().ok_or_else(|| Error::run("tables", "one is missing"))?;
        Ok(written.begin(&name, file.open(read)?))
    };
    let counted = Counted::new(year, progress);
    let all: Vec<usize> = (0..year.places.ids.len()).collect();
    let with_hours: Vec<usize> = year.with_hours().collect();
    let hours = || {
        let hours = year.slots.iter().enumerate();
        let hours = hours.map(|(s, slot)| (Cow::Owned(time(slot)), year.hour(s)));
        hours.filter(|_| !with_hours.is_empty())
    };
    let days = || year.days.keys().enumerate().map(|(d, name)| (name.into(), year.day(d)));
    let months = || year.months.keys().enumerate().map(|(m, name)| (name.into(), year.month(m)));
    let whole = || std::iter::once((Cow::Borrowed("all"), year.whole()));
    let mut complete = vec![
        values(year, next()?, ("time", &with_hours), parquet, hours(), &counted)?,
        values(year, next()?, ("day", &all), parquet, days(), &counted)?,
        values(year, next()?, ("month", &all), parquet, months(), &counted)?,
        values(year, next()?, ("period", &all), parquet, whole(), &counted)?,
    ];
    let columns = [
        ("light", Kind::Text),
        ("month", Kind::Text),
        ("hours", Kind::Number),
        ("kwh", Kind::Number),
    ];
    complete.push(table(next()?, &columns, false, |file| lamps(year, file))?);
    let mut file = next()?;
    file.write_all(&style.chart(chart(year)?)?).map_err(unwritten)?;
    complete.push(file.complete()?);
    complete.push(table(next()?, &CAPTORS, false, |file| captors(year, file))?);
    let columns = [("state", Kind::Text), ("month", Kind::Text), ("hours", Kind::Number)];
    complete.push(table(next()?, &columns, false, |file| states(year, file))?);
    let sums = days().chain(months()).chain(whole()).filter(|_| !year.places.ratios.is_empty());
    let columns = ratio_columns("period", Kind::Number);
    complete.push(table(next()?, &columns, false, |file| ratios(year, &all, sums, file))?);
    let columns = [
        ("captor", Kind::Text),
        ("day", Kind::Text),
        ("band", Kind::Text),
        ("daylight", Kind::Number),
    ];
    complete.push(table(next()?, &columns, false, |file| daylight(year, file))?);
    let mut file = next()?;
    write_lines(&year.facts(), &mut file).map_err(unwritten)?;
    let facts = file.complete()?;
    if with_ratios {
        let columns = ratio_columns("time", Kind::Single);
        let rows = |file: &mut _| ratios(year, &with_hours, hours(), file);
        complete.push(table(next()?, &columns, parquet, rows)?);
    }
    if results {
        for month in (0..year.months.len()).map(Some).chain([None]) {
            let mut file = next()?;
            write_json(&year.result(month)?, &mut file).map_err(unwritten)?;
            complete.push(file.complete()?);
        }
    }
    if let Some(kept) = kept {
        let mut file = written.begin(LIGHT, light.open(read)?);
        kept.write(&mut file).map_err(unwritten)?;
        complete.push(file.complete()?);
    }
    complete.push(facts);
    written.put(complete)
}

fn unwritten(e: io::Error) -> Error {
    Error::unwritable("tables", e)
}

/// Counts the rows of the tables of values.
struct Counted<'p> {
    done: Cell<u64>,
    of: u64,
    progress: &'p dyn Fn(u64, u64),
}

impl<'p> Counted<'p> {
    fn new(year: &Year, progress: &'p dyn Fn(u64, u64)) -> Self {
        let sums = year.days.len() + year.months.len() + 1;
        let of = year.with_hours().count() * year.slots.len() + year.places.ids.len() * sums;
        Self { done: Cell::new(0), of: of as u64, progress }
    }

    fn add(&self, rows: usize) {
        self.done.set(self.done.get() + rows as u64);
        (self.progress)(self.done.get(), self.of);
    }
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

/// Writes a table of values: a row for each time, the names of which stand in a column called `of`,
/// and each of these ids. Tables of sums have the bands that have one, and a column with their unit.
fn values<'y>(
    year: &'y Year,
    file: OwnFile,
    (of, ids): (&str, &[usize]),
    parquet: bool,
    times: impl Iterator<Item = (Cow<'y, str>, Result<Values<'y>>)>,
    counted: &Counted,
) -> Result<CompleteOwn> {
    let sums = of != "time";
    let bands: Vec<usize> =
        (0..year.bands.len()).filter(|&band| !sums || year.integrated[band]).collect();
    let faces = [(Channel::Front, Face::Front), (Channel::Back, Face::Back)];
    let faces = faces.into_iter().chain([(Channel::Absorbed, Face::Absorbed)]);
    let faces: Vec<(Channel, Face)> = faces.take(year.places.channels).collect();
    let name = |band: usize, face: Face| format!("{}_{}", year.bands[band].name, face.word());
    let of_bands = bands.iter().flat_map(|&band| faces.iter().map(move |face| name(band, face.1)));
    let with_error = |name: String| {
        let error = format!("{name}_se");
        [name, error]
    };
    let numbers: Vec<String> = of_bands.chain([OWN.into()]).flat_map(with_error).collect();
    let texts = [Some("captor"), Some(of), sums.then_some("unit")].into_iter().flatten();
    let numbers = numbers.iter().map(|name| (name.as_str(), Kind::Single));
    let columns: Vec<(&str, Kind)> = texts.map(|name| (name, Kind::Text)).chain(numbers).collect();
    table(file, &columns, parquet, |table| {
        for (when, values) in times {
            let values = values?;
            let mut cells = Vec::with_capacity(columns.len());
            for &id in ids {
                cells.clear();
                cells.extend([Entry::Text(&year.places.ids[id]), Entry::Text(&when)]);
                cells.extend(sums.then_some(Entry::Text(year.unit)));
                let light = bands.iter().flat_map(|&band| {
                    let values = &values;
                    faces.iter().map(move |face| values.light_pair(id, face.0, band))
                });
                for pair in light.chain([values.own_pair(id)]) {
                    let both = pair.map(|pair| pair.map(Entry::Single));
                    cells.extend(both.unwrap_or([Entry::Nothing, Entry::Nothing]));
                }
                table.row(&cells).map_err(unwritten)?;
            }
            counted.add(ids.len());
        }
        Ok(())
    })
}

/// Returns the chart of the daily light integral in the last band or sum that has one.
fn chart(year: &Year) -> Result<Chart> {
    let mut light = DailyLight::default();
    if let Some(band) = year.charted.band {
        light.band.clone_from(&year.bands[band].name);
        light.unit = year.unit.into();
        light.months = year.months.keys().cloned().collect();
        light.days = year.days.keys().cloned().collect();
        light.of = OfId::some(&year.places.ids, &year.charted.ids);
        for (of, daylight) in light.of.iter_mut().zip(&year.charted.daylight) {
            of.daylight.clone_from(daylight);
        }
        let light_of = |values: &Values, id| {
            values.light(id, Channel::Front, band).unwrap_or_default().pair().map(f64::from)
        };
        for day in 0..year.days.len() {
            let values = year.day(day)?;
            let ids = year.charted.ids.iter().zip(&mut light.of);
            ids.for_each(|(&id, of)| of.days.push(light_of(&values, id)));
        }
        for month in 0..year.months.len() {
            let values = year.month(month)?;
            let ids = year.charted.ids.iter().zip(&mut light.of);
            ids.for_each(|(&id, of)| of.months.push(light_of(&values, id)));
        }
    }
    Ok(light.chart())
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

/// Adds what is daylight of the light of each day that the chart shows, if lamps are switched.
fn daylight<W: Write + Send>(year: &Year, table: &mut TableFile<W>) -> Result<()> {
    let Some(band) = year.charted.band else { return Ok(()) };
    for (&id, daylight) in year.charted.ids.iter().zip(&year.charted.daylight) {
        for (day, &light) in year.days.keys().zip(daylight) {
            let texts = [&*year.places.ids[id], day, &*year.bands[band].name].map(Entry::Text);
            let cells: Vec<Entry> = texts.into_iter().chain([Entry::Number(light)]).collect();
            table.row(&cells).map_err(unwritten)?;
        }
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
            let cells = [Entry::Text(name), Entry::Text(when), Entry::Number(hours)];
            table.row(&cells).map_err(unwritten)?;
        }
    }
    Ok(())
}

/// Returns the columns of a table of ratios at times, which stand in a column called `of`.
fn ratio_columns(of: &str, kind: Kind) -> Vec<(&str, Kind)> {
    let texts = ["captor", of, "ratio"].map(|name| (name, Kind::Text));
    let numbers = ["front", "front_se", "back", "back_se", "absorbed", "absorbed_se"];
    texts.into_iter().chain(numbers.map(|name| (name, kind))).collect()
}

/// Adds a row for each time, each of these ids and each ratio.
fn ratios<'y, W: Write + Send>(
    year: &'y Year,
    ids: &[usize],
    times: impl Iterator<Item = (Cow<'y, str>, Result<Values<'y>>)>,
    table: &mut TableFile<W>,
) -> Result<()> {
    for (when, values) in times {
        let values = values?;
        for &id in ids {
            for (r, ratio) in year.places.ratios.iter().enumerate() {
                let texts = [&*year.places.ids[id], &*when, &*ratio.name];
                let mut cells: Vec<Entry> = texts.map(Entry::Text).into();
                for channel in [Channel::Front, Channel::Back, Channel::Absorbed] {
                    let found = values.ratio(id, channel, r);
                    cells.push(Entry::number(found.map(|found| found.mean)));
                    cells.push(Entry::number(found.map(|found| found.variance.sqrt())));
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
        let mut cells = vec![Entry::Text(name), Entry::Text(shape.kind)];
        match shape.center.zip(shape.normal) {
            Some((center, normal)) => {
                cells.extend(
                    center.to_array().into_iter().chain(normal.to_array()).map(Entry::Number),
                );
            }
            None => cells.resize(8, Entry::Nothing),
        }
        cells.push(Entry::Number(places.areas[id][Channel::Front as usize]));
        let groups = shape.groups.join("; ");
        cells.push(Entry::Text(&groups));
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
        [Entry::Text(&lamp.name), Entry::Text(when), Entry::Number(hours), Entry::number(energy)];
    table.row(&cells).map_err(unwritten)
}
