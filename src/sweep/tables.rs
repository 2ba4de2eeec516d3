//! Tables of a whole sweep, made from the files of its runs: one row a run, one row a captor, one
//! row a group.

use std::io;

use serde_json::Value;

use super::{
    Step, SweepControl, SweepProgress,
    folder::{State, SweepFolder, result_path},
};
use crate::{
    error::{Error, Result},
    result_file::{CaptorValues, EnergyValues, FaceValues, OpenFile, OutputFile, ResultsFile},
    sweep_file::{BALANCE, Run, Sweep},
};

/// The tables, without what their files end with.
const TABLES: [&str; 3] = ["captors", "groups", "runs"];

/// Names of all files that are written here.
pub fn names() -> Vec<String> {
    TABLES.iter().map(|name| format!("{name}.csv")).collect()
}

/// What stands in a column of a row.
#[derive(Clone, Debug)]
enum Cell<'a> {
    Whole(u64),
    Number(f64),
    Text(&'a str),
    Value(&'a Value),
    Nothing,
}

impl Cell<'_> {
    fn number(value: Option<f64>) -> Self {
        value.map_or(Self::Nothing, Self::Number)
    }

    fn text(&self) -> String {
        match self {
            Self::Whole(n) => n.to_string(),
            Self::Number(v) => v.to_string(),
            Self::Text(text) => text.to_string(),
            Self::Value(Value::String(text)) => text.clone(),
            Self::Value(value) => value.to_string(),
            Self::Nothing => String::new(),
        }
    }
}

/// A table while it is written.
struct Table {
    name: String,
    csv: csv::Writer<OpenFile>,
}

impl Table {
    fn create(folder: &SweepFolder, name: &str, columns: &[String]) -> Result<Self> {
        let path = folder.path().join(format!("{name}.csv"));
        let mut csv = csv::Writer::from_writer(OutputFile::create(&path)?.open()?);
        let name = path.display().to_string();
        csv.write_record(columns).map_err(|e| unwritten(&name, e.into()))?;
        Ok(Self { name, csv })
    }

    fn row(&mut self, cells: &[Cell]) -> Result<()> {
        let written = self.csv.write_record(cells.iter().map(Cell::text));
        written.map_err(|e| unwritten(&self.name, e.into()))
    }

    fn finish(self) -> Result<()> {
        match self.csv.into_inner() {
            Ok(file) => file.finish(Ok(())),
            Err(e) => Err(unwritten(&self.name, e.into_error())),
        }
    }
}

fn unwritten(name: &str, e: io::Error) -> Error {
    Error::run(name, format!("cannot be written: {e}"))
}

/// Writes the tables of a sweep of which every run is done or has failed.
pub fn write(
    folder: &SweepFolder,
    sweep: &Sweep,
    states: &[State],
    control: &SweepControl,
) -> Result<()> {
    let columns = |before: &[&str], after: &[&str]| {
        let own = |names: &[&str]| names.iter().map(|name| name.to_string()).collect::<Vec<_>>();
        let parameters = sweep.parameters().iter().map(|p| p.name.clone()).collect();
        [own(before), parameters, own(after)].concat()
    };
    let values = ["face", "band", "irradiance", "irradiance_se", "absorbed", "absorbed_se"];
    let of_captors = columns(&["run"], &[&["seed", "captor"], &values[..]].concat());
    let of_groups = columns(&["run"], &[&["seed", "group", "captors"], &values[..]].concat());
    let mut captors = Table::create(folder, TABLES[0], &of_captors)?;
    let mut groups = Table::create(folder, TABLES[1], &of_groups)?;
    let mut balance = Balance::default();
    for (run, state) in sweep.runs().zip(states) {
        if control.stopped() {
            return Err(Error::run("sweep", "interrupted while writing tables")
                .remedy("the same command writes them again"));
        }
        let step = Step::Writing;
        (control.progress)(SweepProgress { step, runs: run.number as f64, of: states.len() });
        if *state != State::Done {
            balance.runs.push(None);
            continue;
        }
        let results = ResultsFile::read(&result_path(folder.path(), &sweep.key(&run)))?;
        for captor in &results.captors {
            rows(&mut captors, &results, &run, captor, None)?;
        }
        for group in &results.groups {
            rows(&mut groups, &results, &run, &group.values, Some(group.captors))?;
        }
        balance.add(results);
    }
    captors.finish()?;
    groups.finish()?;

    let of_runs = columns(&["run", "file"], &["seed", "photons"]);
    let of_energy = balance.columns().map(|(word, band)| format!("{word}{band}"));
    let all: Vec<String> = of_runs.into_iter().chain(of_energy).chain(["error".into()]).collect();
    let mut runs = Table::create(folder, TABLES[2], &all)?;
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

/// A row for each face and band of a captor or group.
fn rows(
    table: &mut Table,
    results: &ResultsFile,
    run: &Run,
    captor: &CaptorValues,
    members: Option<u64>,
) -> Result<()> {
    let faces: [(&str, Option<&FaceValues>); 2] =
        [("front", Some(&captor.front)), ("back", captor.back.as_ref())];
    for (face, values) in faces.into_iter().filter_map(|(name, face)| Some((name, face?))) {
        for (b, band) in results.bands.iter().enumerate() {
            let mut cells = vec![Cell::Whole(run.number as u64)];
            cells.extend(run.values.iter().map(|(_, value)| Cell::Value(value)));
            cells.extend([Cell::Whole(run.seed), Cell::Text(&captor.id)]);
            cells.extend(members.map(Cell::Whole));
            cells.extend([Cell::Text(face), Cell::Text(&band.name)]);
            let at = |values: &[f64]| Cell::number(values.get(b).copied());
            let error = |errors: &[Option<f64>]| Cell::number(errors.get(b).copied().flatten());
            cells.extend([at(&values.irradiance), error(&values.irradiance_se)]);
            // both faces together: once, so that sums over the table are right
            let absorbed = captor.absorbed.as_deref().filter(|_| face == "front");
            let absorbed_se = captor.absorbed_se.as_deref().filter(|_| face == "front");
            cells.extend([
                absorbed.map_or(Cell::Nothing, at),
                absorbed_se.map_or(Cell::Nothing, error),
            ]);
            table.row(&cells)?;
        }
    }
    Ok(())
}

/// What is kept of every run for the table of runs.
#[derive(Default)]
struct Balance {
    /// All names of bands, in the order in which they come.
    bands: Vec<String>,
    runs: Vec<Option<RunBalance>>,
}

struct RunBalance {
    photons: u64,
    bands: Vec<String>,
    energy: EnergyValues,
}

impl Balance {
    fn add(&mut self, results: ResultsFile) {
        let ResultsFile { photons, energy, bands, .. } = results;
        let bands: Vec<String> = bands.into_iter().map(|band| band.name).collect();
        for band in &bands {
            if !self.bands.contains(band) {
                self.bands.push(band.clone());
            }
        }
        self.runs.push(Some(RunBalance { photons, bands, energy }));
    }

    /// Each entry of the balance of each band.
    fn columns(&self) -> impl Iterator<Item = (&'static str, &str)> {
        self.bands.iter().flat_map(|band| BALANCE.iter().map(move |word| (*word, band.as_str())))
    }
}

impl RunBalance {
    fn value(&self, word: &str, band: &str) -> Option<f64> {
        let EnergyValues { power, emitted, absorbed, escaped, lost } = &self.energy;
        let all =
            [Some(power), emitted.as_ref(), absorbed.as_ref(), escaped.as_ref(), lost.as_ref()];
        let of = BALANCE.iter().position(|entry| *entry == word)?;
        let band = self.bands.iter().position(|name| name == band)?;
        all[of]?.get(band).copied()
    }
}
