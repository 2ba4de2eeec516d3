//! Charts in a folder: runs the study of a scene, or takes the runs of earlier charts, and writes the
//! tables and the charts.

use std::{
    collections::BTreeMap,
    fs,
    io::{self, Write},
    path::{Path, PathBuf},
    sync::Arc,
};

use super::{ConvergencePlan, ConvergenceStudy, Row, study, truth::Reference};
use crate::desk::{Desk, check_folder};
use phylux_core::{
    error::{Error, Result, call},
    transport::{
        settings::{PhotonCount, Settings, ThreadCount},
        simulate::Control,
    },
    words,
};
use phylux_files::{
    input, json,
    output::{FilesRead, OutputFile, Temporary, check_places},
    scene_file::SceneSource,
    written::Written,
};
use phylux_show::plot::PlotStyle;

/// The tables of the runs: as rows, and all that was found.
const ROWS: &str = "rows.csv";
const STUDY: &str = "study.json";
/// The record of the files in their folder.
const RECORD: &str = "chart.written.json";

/// Where the runs of charts come from.
pub enum ChartRuns {
    /// From the scene.
    Scene {
        /// The scene.
        source: Arc<SceneSource>,
        /// A table of true irradiances (CSV); without it, a long run stands in for the truth.
        truth: Option<PathBuf>,
        /// Photons of the largest budget; `None` for the scene's.
        photons: Option<PhotonCount>,
        /// Seed of the first run of each budget; `None` for the scene's.
        seed: Option<u64>,
        /// Number of runs of each budget.
        seeds: u64,
        /// Values of k of the k-nearest estimates.
        k: Vec<usize>,
        /// Number of threads; `None` for the scene's.
        threads: Option<ThreadCount>,
    },
    /// From earlier charts, which are drawn anew.
    Study(Box<ConvergenceStudy>),
}

impl ChartRuns {
    /// Number of runs of each budget that is usual.
    pub const SEEDS: u64 = 5;
    /// The usual values of k.
    pub const NEAREST: [usize; 3] = [20, 50, 200];

    /// Reads the study of earlier charts at `path`; `None` if it is no study. Errors: it is damaged.
    pub fn of_study(path: &Path) -> Result<Option<Self>> {
        let place = path.display();
        if path.file_name().is_none_or(|name| name != STUDY) {
            return Ok(None);
        }
        let bytes = input::read_bytes(path).map_err(|problem| Error::input(&place, problem))?;
        json::check_memory(&bytes).map_err(|problem| Error::input(&place, problem))?;
        let is_study = serde_json::from_slice::<serde_json::Value>(&bytes)
            .is_ok_and(|value| value.get("rungs").is_some());
        if !is_study {
            return Ok(None);
        }
        let study = serde_json::from_slice(&bytes).map_err(|e| {
            Error::input(place, format!("is no study of charts: {e}")).remedy(words![
                "run ",
                call("chart"),
                " on the scene again"
            ])
        })?;
        Ok(Some(Self::Study(study)))
    }
}

/// Writes charts, and the runs that they show, into a folder, which is made if it does not exist.
/// Errors: those of [`study`]; a file in the folder that is not of earlier charts.
pub fn chart(
    runs: &ChartRuns,
    folder: &Path,
    style: PlotStyle,
    desk: &Desk,
) -> Result<ConvergenceStudy> {
    check_folder(folder)?;
    let new = !folder.is_dir();
    if new {
        fs::create_dir(folder).map_err(|e| {
            Error::input(folder.display(), format!("cannot be created: {}", e.kind()))
                .remedy("write elsewhere")
        })?;
    }
    let held = desk.hold(folder);
    let drawn =
        held.as_ref().map_err(Error::clone).and_then(|_| draw(runs, folder, style, desk, new));
    drop(held);
    if new && drawn.is_err() {
        // this fails, as it should, if anything was written into the folder
        let _ = fs::remove_dir(folder);
    }
    drawn
}

fn draw(
    runs: &ChartRuns,
    folder: &Path,
    style: PlotStyle,
    desk: &Desk,
    new: bool,
) -> Result<ConvergenceStudy> {
    let charts = ConvergenceStudy::CHARTS.map(|name| format!("{name}.{}", style.ending()));
    let names = [&[ROWS.to_string(), STUDY.to_string()][..], &charts].concat();
    let written = Written::read(folder, RECORD, "move it away, or write into another folder")?;
    written.check(&names)?;
    let prepared = names.into_iter().map(|name| {
        let file = desk.file(&folder.join(&name))?;
        Ok((name, file))
    });
    let mut files = prepared.collect::<Result<BTreeMap<_, _>>>()?;
    desk.make(|| Ok(()), |()| new.then(|| Temporary::IfEmpty(folder.to_path_buf())))?;

    let places: Vec<PathBuf> =
        files.values().filter_map(OutputFile::place).map(Path::to_path_buf).collect();
    let (found, read) = runs.found(&places, desk)?;
    desk.writing();
    let mut complete = Vec::new();
    let mut write = |name: &str, content: &[u8]| {
        let file = files.remove(name).ok_or_else(|| Error::run(name, "is no file of a chart"))?;
        let mut file = written.begin(name, file.open(&read)?);
        file.write_all(content).map_err(|e| Error::unwritable(name, e))?;
        complete.push(file.complete()?);
        Ok(())
    };
    let failed = |e: io::Error| Error::unwritable(folder.display(), e);
    write(ROWS, &rows(&found.rows).map_err(failed)?)?;
    let mut study = serde_json::to_vec_pretty(&found).map_err(|e| failed(e.into()))?;
    study.push(b'\n');
    write(STUDY, &study)?;
    for (name, chart) in found.charts() {
        write(&format!("{name}.{}", style.ending()), &style.chart(chart)?)?;
    }
    written.put(complete)?;
    Ok(found)
}

impl ChartRuns {
    /// Returns what the runs have found, with the files that were read. No output may stand at
    /// `places` that would replace one of these.
    fn found(&self, places: &[PathBuf], desk: &Desk) -> Result<(ConvergenceStudy, FilesRead)> {
        let (source, truth, photons, seed, seeds, k, threads) = match self {
            // it is read already, so its own file may be written again
            Self::Study(study) => return Ok((study.as_ref().clone(), FilesRead::default())),
            Self::Scene { source, truth, photons, seed, seeds, k, threads } => {
                (source, truth, photons, seed, seeds, k, threads)
            }
        };
        let loaded = desk.during("reading the scene", |_| source.load())?;
        let read = FilesRead::new(loaded.files.iter().chain(truth));
        check_places(places, &read)?;
        let scene = &loaded.scene;
        desk.warn(&loaded.warnings);
        if scene.captors().is_empty() {
            return Err(Error::input(
                json::place(&source.path().display().to_string(), "/captors"),
                "the scene has no captor, so there is nothing to compare",
            )
            .remedy("add a captor, or `\"captor\": true` to an object"));
        }
        let truth = truth.as_ref().map(|path| Reference::read(path, scene)).transpose()?;
        let usual = &loaded.settings;
        let photons = photons.or(usual.photons);
        let plan = ConvergencePlan {
            photons: photons.map_or(Settings::DEFAULT_PHOTONS, PhotonCount::get),
            seed: seed.unwrap_or(usual.seed),
            seeds: *seeds,
            k: k.iter().copied().filter(|k| *k > 0).collect(),
            threads: threads.unwrap_or(usual.threads).get(),
        };
        let found = desk.during("photons", |progress| {
            study(scene, &plan, truth, &Control { stop: desk.stop(), progress })
        });
        Ok((found?, read))
    }
}

fn rows(rows: &[Row]) -> io::Result<Vec<u8>> {
    let mut table = csv::Writer::from_writer(Vec::new());
    for row in rows {
        table.serialize(row)?;
    }
    table.into_inner().map_err(|e| e.into_error())
}
