//! Tables and plots of a whole sweep, made from the files of its runs. There are tables with one
//! row for each run, one for each captor, face and band, and one for each group, face and band.

use phylux_files::result_file::read_json;
use std::{collections::BTreeMap, io::Write};

use super::{
    control::{Step, SweepControl, SweepProgress},
    folder::{State, SweepFolder, result_path},
    response::Responses,
    table::Table,
};
use crate::table::{Cell, Kind};
use phylux_core::error::{Error, Result};
use phylux_files::{
    result_file::file_names,
    sweep_file::{BALANCE, Run, Sweep},
};
use phylux_results::{
    quantity::{Per, QUANTITIES, Quantity, WHOLE},
    result::{Energy, Row, RunResult},
};

/// Names of the faces in tables.
const FRONT: &str = "front";
const BACK: &str = "back";
/// Names of the tables, without endings.
const TABLES: [&str; 3] = ["captors", "groups", "runs"];
/// Names of the tables, without endings, that only sweeps of scenes with ratios have, and with lamps
/// whose electric power is known.
const RATIOS: &str = "ratios";
const ELECTRICITY: &str = "electricity";

/// Returns the names of all files of the tables.
pub fn names() -> Vec<String> {
    let endings = Table::ENDINGS.iter();
    let tables = || TABLES.into_iter().chain([RATIOS, ELECTRICITY]);
    endings.flat_map(|ending| tables().map(move |name| format!("{name}.{ending}"))).collect()
}

/// Number of runs that have warnings of each kind.
pub type Warned = BTreeMap<String, usize>;

/// Names of columns, with what stands in them.
type Columns = &'static [(&'static str, Kind)];
const SEED: (&str, Kind) = ("seed", Kind::Whole);
/// Columns of a captor or group: after its name and, of a group, after the number of its captors.
const OF_FACE: Columns = &[
    ("face", Kind::Text),
    ("band", Kind::Text),
    ("irradiance", Kind::Number),
    ("irradiance_se", Kind::Number),
    ("absorbed", Kind::Number),
    ("absorbed_se", Kind::Number),
    ("few_paths", Kind::Whole),
];
/// Further columns of a group.
const OF_GROUP: Columns = &[
    ("min", Kind::Number),
    ("max", Kind::Number),
    ("min_over_mean", Kind::Number),
    ("min_over_mean_se", Kind::Number),
    ("cv", Kind::Number),
    ("cv_se", Kind::Number),
];
const OF_RATIOS: Columns = &[
    SEED,
    ("captor", Kind::Text),
    ("face", Kind::Text),
    ("ratio", Kind::Text),
    ("value", Kind::Number),
    ("standard_error", Kind::Number),
];
const OF_LAMPS: Columns = &[
    SEED,
    ("of", Kind::Text),
    ("band", Kind::Text),
    ("quantity", Kind::Text),
    ("value", Kind::Number),
    ("standard_error", Kind::Number),
];

/// What was written of a whole sweep, besides its tables.
#[derive(Default)]
pub struct Written {
    /// How many runs have warnings of each kind.
    pub warned: Warned,
    /// Number of plots.
    pub plots: usize,
}

/// Writes the tables and plots of a sweep in which every run is done or has failed.
pub fn write(
    folder: &SweepFolder,
    sweep: &Sweep,
    states: &[State],
    control: &SweepControl,
) -> Result<Written> {
    let mut tables = Tables::create(folder, sweep)?;
    let (mut balance, mut responses) = (Balance::default(), Responses::default());
    let mut warned = Warned::new();
    for (run, state) in sweep.runs().zip(states) {
        if control.stopped() {
            return Err(Error::interrupted("sweep", "the tables are not written")
                .remedy("the same command writes them again"));
        }
        let step = Step::Writing;
        (control.progress)(SweepProgress { step, runs: run.number as f64, of: states.len() });
        if *state != State::Done {
            balance.runs.push(None);
            continue;
        }
        let results = read_json(&result_path(folder.path(), &sweep.key(&run)))?;
        for kind in results.extras.warning_kinds.as_ref().unwrap_or(&results.warnings) {
            *warned.entry(kind.clone()).or_default() += 1;
        }
        tables.add(&run, &results)?;
        responses.add(sweep, &run, &results);
        balance.add(results);
    }
    tables.finish()?;
    let charts = responses.charts(sweep);
    let ending = control.plots.ending();
    let pictures = file_names(charts.iter().map(|(name, _)| name.as_str()), ending);
    let plots = charts.len();
    for ((_, chart), name) in charts.into_iter().zip(pictures) {
        let drawn = control.plots.chart(chart)?;
        let mut file = folder.picture(&name)?;
        file.write_all(&drawn).map_err(|e| Error::unwritable(&name, e))?;
        file.finish()?;
    }
    write_runs(folder, sweep, states, &balance)?;
    Ok(Written { warned, plots })
}

/// Returns the columns of a table: the number of the run, those before the parameters, the parameters,
/// and those after them.
fn columns(sweep: &Sweep, before: Columns, after: &[Columns]) -> Vec<(String, Kind)> {
    let own = |names: &[(&str, Kind)]| {
        names.iter().map(|(name, kind)| (name.to_string(), *kind)).collect::<Vec<_>>()
    };
    let parameters = sweep.parameters().iter();
    let parameters = parameters.map(|p| (p.name.clone(), Kind::of(&p.values))).collect();
    [own(&[("run", Kind::Whole)]), own(before), parameters, own(&after.concat())].concat()
}

/// The tables of captors, groups and, where runs have them, ratios and electricity, while they are
/// written.
struct Tables<'a> {
    folder: &'a SweepFolder,
    sweep: &'a Sweep,
    captors: Table<'a>,
    groups: Table<'a>,
    ratios: Option<Table<'a>>,
    electricity: Option<Table<'a>>,
}

impl<'a> Tables<'a> {
    fn create(folder: &'a SweepFolder, sweep: &'a Sweep) -> Result<Self> {
        let create = |name, after: &[Columns]| {
            Table::create(folder.written(), name, &columns(sweep, &[], after))
        };
        let captors = create(TABLES[0], &[&[SEED, ("captor", Kind::Text)], OF_FACE])?;
        let group = &[SEED, ("group", Kind::Text), ("captors", Kind::Whole)];
        let groups = create(TABLES[1], &[group, OF_FACE, OF_GROUP])?;
        Ok(Self { folder, sweep, captors, groups, ratios: None, electricity: None })
    }

    /// Adds the rows of a run.
    fn add(&mut self, run: &Run, results: &RunResult) -> Result<()> {
        for captor in &results.captors {
            rows(&mut self.captors, results, run, (&captor.id, captor.row()), None)?;
        }
        for group in &results.groups {
            let members = Some(group.captors as u64);
            rows(&mut self.groups, results, run, (&group.id, group.row()), members)?;
        }
        let (folder, sweep) = (self.folder, self.sweep);
        let create =
            |name, own| Table::create(folder.written(), name, &columns(sweep, &[], &[own]));
        if !results.ratios.is_empty() {
            let table = opened(&mut self.ratios, || create(RATIOS, OF_RATIOS))?;
            let captors = results.captors.iter().map(|captor| (&captor.id, captor.row()));
            let groups = results.groups.iter().filter(|group| group.captors > 1);
            for of in captors.chain(groups.map(|group| (&group.id, group.row()))) {
                ratio_rows(table, results, run, of)?;
            }
        }
        if let Some(found) = &results.account.electricity {
            let table = opened(&mut self.electricity, || create(ELECTRICITY, OF_LAMPS))?;
            for row in found.rows() {
                let mut cells = begun(run);
                let band = &results.bands[row.band].name;
                cells.extend([Cell::Text(row.of), Cell::Text(band), Cell::Text(row.quantity)]);
                cells.extend([Cell::number(Some(row.value)), Cell::number(row.error)]);
                table.row(&cells)?;
            }
        }
        Ok(())
    }

    fn finish(self) -> Result<()> {
        let Self { captors, groups, ratios, electricity, .. } = self;
        [captors, groups].into_iter().chain(ratios).chain(electricity).try_for_each(Table::finish)
    }
}

/// Writes the table of runs, with their energy balances and errors.
fn write_runs(
    folder: &SweepFolder,
    sweep: &Sweep,
    states: &[State],
    balance: &Balance,
) -> Result<()> {
    let after: Columns = &[SEED, ("photons", Kind::Whole)];
    let mut of_runs = columns(sweep, &[("file", Kind::Text)], &[after]);
    let energy = balance.columns().map(|(word, band)| (format!("{word}{band}"), Kind::Number));
    of_runs.extend(energy);
    of_runs.push(("error".into(), Kind::Text));
    let mut runs = Table::create(folder.written(), TABLES[2], &of_runs)?;
    for ((run, state), found) in sweep.runs().zip(states).zip(&balance.runs) {
        let file = format!("{}.json", sweep.key(&run));
        let mut cells = vec![Cell::Whole(run.number as u64), Cell::Text(&file)];
        cells.extend(run.values.iter().map(|(_, value)| Cell::Value(value)));
        cells.push(Cell::Whole(run.seed));
        cells.push(found.as_ref().map_or(Cell::Nothing, |found| Cell::Whole(found.photons)));
        cells.extend(balance.columns().map(|(word, band)| {
            Cell::number(found.as_ref().and_then(|found| found.value(word, band)))
        }));
        cells.push(match state {
            State::Failed(error) => Cell::Text(error),
            _ => Cell::Nothing,
        });
        runs.row(&cells)?;
    }
    runs.finish()
}

/// Returns a table, which is made when it is used first.
fn opened<'t, 'w>(
    table: &'t mut Option<Table<'w>>,
    create: impl FnOnce() -> Result<Table<'w>>,
) -> Result<&'t mut Table<'w>> {
    match table {
        Some(table) => Ok(table),
        none => Ok(none.insert(create()?)),
    }
}

/// Returns the first cells of a row of a run: its number, the values of its parameters and its seed.
fn begun<'r>(run: &'r Run) -> Vec<Cell<'r>> {
    let values = run.values.iter().map(|(_, value)| Cell::Value(value));
    let number = std::iter::once(Cell::Whole(run.number as u64));
    number.chain(values).chain([Cell::Whole(run.seed)]).collect()
}

/// Adds one row for each face and band of a captor or group.
fn rows(
    table: &mut Table,
    results: &RunResult,
    run: &Run,
    (id, row): (&str, Row),
    members: Option<u64>,
) -> Result<()> {
    for (face, word) in [FRONT, BACK].into_iter().enumerate() {
        let Some(values) = row.faces[face] else { continue };
        for (b, band) in results.bands.iter().enumerate() {
            let mut cells = begun(run);
            cells.push(Cell::Text(id));
            cells.extend(members.map(Cell::Whole));
            cells.extend([Cell::Text(word), Cell::Text(&band.name)]);
            let found = |name: &str| {
                let quantity = Quantity::named(name);
                // absorbed power is that of both faces: it is written once, so that sums over the
                // table are right
                let whole = || quantity.at(&row, WHOLE).filter(|_| word == FRONT);
                let column = quantity.at(&row, face).or_else(whole);
                let error = column.and_then(|column| column.errors(b)[0]);
                [column.and_then(|column| column.value(b)), error].map(Cell::number)
            };
            cells.extend(["irradiance", "absorbed"].into_iter().flat_map(found));
            cells.push(Cell::Whole(values.few_paths.into()));
            if members.is_some() {
                let ends = ["irradiance_min", "irradiance_max"].map(|end| found(end)[0].clone());
                cells.extend(ends);
                cells.extend(["min_over_mean", "cv"].into_iter().flat_map(found));
            }
            table.row(&cells)?;
        }
    }
    Ok(())
}

/// Adds one row for each ratio of a captor or of a group of several, by face; those of absorbed
/// power have the face `absorbed`.
fn ratio_rows(
    table: &mut Table,
    results: &RunResult,
    run: &Run,
    (id, row): (&String, Row),
) -> Result<()> {
    let quantities = || QUANTITIES.iter().filter(|quantity| quantity.per == Per::Ratio);
    for (face, word) in [FRONT, BACK, "absorbed"].into_iter().enumerate() {
        let Some(column) = quantities().find_map(|quantity| quantity.at(&row, face)) else {
            continue;
        };
        for (r, ratio) in results.ratios.iter().enumerate() {
            let Some(value) = column.value(r) else { continue };
            let mut cells = begun(run);
            cells.extend([Cell::Text(id), Cell::Text(word), Cell::Text(&ratio.name)]);
            cells.extend([Cell::number(Some(value)), Cell::number(column.errors(r)[0])]);
            table.row(&cells)?;
        }
    }
    Ok(())
}

/// The part of every run's results that the table of runs needs.
#[derive(Default)]
struct Balance {
    /// Names of the bands of all runs, in the order in which they first occur.
    bands: Vec<String>,
    runs: Vec<Option<RunBalance>>,
}

struct RunBalance {
    photons: u64,
    bands: Vec<String>,
    energy: Energy,
}

impl Balance {
    fn add(&mut self, results: RunResult) {
        let RunResult { provenance, energy, bands, .. } = results;
        let bands: Vec<String> = bands.into_iter().map(|band| band.name).collect();
        for band in &bands {
            if !self.bands.contains(band) {
                self.bands.push(band.clone());
            }
        }
        self.runs.push(Some(RunBalance { photons: provenance.photons, bands, energy }));
    }

    /// Returns each entry of the energy balance for each band.
    fn columns(&self) -> impl Iterator<Item = (&'static str, &str)> {
        self.bands.iter().flat_map(|band| BALANCE.iter().map(move |word| (*word, band.as_str())))
    }
}

impl RunBalance {
    fn value(&self, word: &str, band: &str) -> Option<f64> {
        let Energy { power, emitted, absorbed, escaped, lost, .. } = &self.energy;
        let all = [power, emitted, absorbed, escaped, lost];
        let of = BALANCE.iter().position(|entry| *entry == word)?;
        let band = self.bands.iter().position(|name| name == band)?;
        all[of].get(band).copied()
    }
}
