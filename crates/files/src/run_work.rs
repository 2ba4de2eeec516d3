//! The work of a run: what one shard of it has counted, or what it has done so far. Each record is a
//! line of JSON. A file can therefore be read with little memory, however large it is.

use std::{
    fs::File,
    io::{self, BufWriter, Write},
    path::{Path, PathBuf},
    sync::Mutex,
};

use serde::{Deserialize, Serialize};

use super::{
    held_file::HeldFile,
    json,
    output::{folder_of, place_of},
    unfinished::unfinished_file,
    work_file::{Work, WorkHead, WorkReader, WorkWriter},
};
use phylux_core::{
    error::{Error, Result, lock},
    scene::world::Scene,
    transport::{
        photon_map::TaskKey,
        settings::{
            Estimator, Guiding, MapLimit, NearestCount, PhotonCount, Settings, Target, ThreadCount,
            Tolerance,
        },
        simulate::{Choice, KeptArrivals, Resumed, RunState, ShardSums},
        tally::Sums,
    },
};

/// The settings that the results of a run depend on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct KeptSettings {
    estimator: Estimator,
    photons: u64,
    seed: u64,
    k: Option<usize>,
    map_photons: usize,
    guiding: Guiding,
    by_light: bool,
    tolerance: Option<f64>,
    tolerance_limit: Option<u64>,
    /// The values that the tolerance applies to.
    of: Vec<String>,
    /// The reason why this estimator was chosen, if a trial chose it.
    chosen: Option<String>,
    /// The number of photons whose work the run was to take, if a trial chose the estimator.
    asked: Option<u64>,
    /// The size of that trial.
    trial: u64,
}

impl KeptSettings {
    /// Takes the settings of a run, and the reason for its estimator if a trial chose it.
    pub fn new(settings: &Settings, choice: Option<&Choice>) -> Self {
        let tolerance = settings.tolerance.map(Tolerance::get);
        Self {
            estimator: settings.estimator,
            photons: settings.photons_or_default(),
            seed: settings.seed,
            k: settings.k.map(NearestCount::get),
            map_photons: settings.map_photons.get(),
            guiding: settings.guiding,
            by_light: settings.by_light,
            tolerance,
            tolerance_limit: tolerance.and(settings.tolerance_limit).map(PhotonCount::get),
            of: settings.of.iter().map(Target::to_string).collect(),
            chosen: choice.map(|choice| choice.why.clone()),
            asked: choice.and_then(|choice| choice.photons),
            trial: choice.map_or(0, |choice| choice.trial),
        }
    }

    /// Returns the settings of a shard on so many threads, or `None` if they contain a value that no
    /// shard may have.
    pub fn settings(&self, threads: ThreadCount) -> Option<Settings> {
        let (estimator, guiding) = (self.estimator, self.guiding);
        if estimator == Estimator::Auto || guiding == Guiding::Auto || self.tolerance.is_some() {
            return None;
        }
        Some(Settings {
            estimator,
            photons: Some(PhotonCount::new(self.photons).ok()?),
            seed: self.seed,
            k: self.k.map(NearestCount::new).transpose().ok()?,
            map_photons: MapLimit::new(self.map_photons).ok()?,
            guiding,
            by_light: self.by_light,
            threads,
            ..Settings::default()
        })
    }

    /// Returns the choice of the estimator, if a trial chose it.
    pub fn choice(&self) -> Option<Choice> {
        let why = self.chosen.clone()?;
        let Self { estimator, asked: photons, trial, .. } = *self;
        Some(Choice { estimator, photons, why, trial })
    }
}

/// A record of a run. A shard has its batches, a checkpoint has the sum of them in its state; both
/// have arrivals.
#[derive(Debug, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum RunRecord {
    /// What the run has done, without its arrivals.
    State(Box<RunState>),
    /// The sums of one batch.
    Batch {
        /// Index of the batch.
        index: u64,
        /// The counts of the batch.
        sums: Box<Sums>,
    },
    /// Arrivals on captors, for the photon map.
    Arrivals {
        /// The task that found the arrivals.
        key: TaskKey,
        /// The arrivals, packed.
        words: Vec<u32>,
    },
    /// States that the arrivals of this task and of those after it no longer fit into the photon
    /// map.
    Full {
        /// The first task whose arrivals no longer fit.
        key: TaskKey,
    },
}

impl RunRecord {
    /// Reads the next record of a run; `None` at the end, if the whole file is as it was written.
    /// Error: the file was damaged, or a record takes more memory than is left.
    pub fn next(reader: &mut WorkReader) -> Result<Option<Self>> {
        let content = reader.next_record()?.ok_or_else(|| reader.spoiled())?;
        if content.is_empty() { Ok(None) } else { Self::parse(reader, &content).map(Some) }
    }

    fn parse(reader: &WorkReader, content: &[u8]) -> Result<Self> {
        json::check_memory(content).map_err(|why| Error::too_large(reader.path.display(), why))?;
        serde_json::from_slice(content).map_err(|_| reader.spoiled())
    }
}

/// Writes a whole file.
fn write<W: Write>(
    head: &WorkHead,
    records: impl Iterator<Item = RunRecord>,
    writer: W,
) -> io::Result<W> {
    let mut writer = WorkWriter::begin(writer, head)?;
    for record in records {
        let mut content = serde_json::to_vec(&record)?;
        content.push(b'\n');
        writer.put(&content)?;
    }
    writer.end()
}

/// Writes a shard.
pub fn write_shard(head: &WorkHead, sums: ShardSums, writer: &mut dyn Write) -> io::Result<()> {
    let ShardSums { batches, tasks, end } = sums;
    let batches =
        batches.into_iter().map(|(index, sums)| RunRecord::Batch { index, sums: Box::new(sums) });
    let arrivals =
        tasks.into_iter().map(|(key, task)| RunRecord::Arrivals { key, words: task.words() });
    let full = end.map(|key| RunRecord::Full { key });
    write(head, batches.chain(arrivals).chain(full), writer).map(drop)
}

/// The checkpoint of a run. The process that keeps it holds a lock of the system on the file that is
/// there, from the first moment on: it begins with a file that has no records. Later files are
/// written beside its place, and moved there only when they are complete.
#[derive(Debug)]
pub struct Checkpoint {
    path: PathBuf,
    head: WorkHead,
    /// The file at the checkpoint's place, once this process holds it.
    held: Mutex<Option<HeldFile>>,
}

impl Checkpoint {
    /// Describes the checkpoint at `path` for a run of `scene` with these `settings`; it touches no
    /// file.
    pub fn new(path: &Path, scene: &Scene, settings: &Settings) -> Self {
        let settings = KeptSettings::new(settings, None);
        let head = WorkHead::new(Work::Run, scene.name().to_string(), scene.digest(), &settings);
        Self { path: path.to_path_buf(), head, held: Mutex::default() }
    }

    /// Returns the path of the checkpoint, as it was given.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Returns the path of the checkpoint with all links resolved, or `None` if its folder does not
    /// exist.
    pub fn place(&self) -> Option<PathBuf> {
        place_of(&self.path).ok()
    }

    /// Takes the checkpoint for this process, and returns what its run has done so far; `None` if
    /// there is nothing yet. Errors: another process is at work on it; it cannot be written; the
    /// file is not a checkpoint, is damaged, or belongs to another run.
    pub fn open(&self) -> Result<Option<Resumed>> {
        let empty = write(&self.head, [].into_iter(), Vec::new())
            .map_err(|e| Error::run(self.path.display(), e))?;
        let mut held = HeldFile::open(&self.path, &empty)?;
        // a file can be replaced only if another can be made beside it
        unfinished_file(&folder_of(&held.place), None).map_err(|e| {
            let problem = format!("cannot be written: {}", e.kind());
            Error::input(self.path.display(), problem).remedy("write elsewhere")
        })?;
        let resumed = if held.kept { self.read(&held.file)? } else { None };
        held.kept = resumed.is_some();
        *lock(&self.held) = Some(held);
        Ok(resumed)
    }

    /// Reads what the run has done so far; `None` if that is nothing. Errors: the file is not a
    /// checkpoint, is damaged, or belongs to another run.
    fn read(&self, file: &File) -> Result<Option<Resumed>> {
        let file = file.try_clone().map_err(|e| Error::run(self.path.display(), e))?;
        let mut reader = WorkReader::checkpoint(&self.path, Work::Run, file)?;
        let first = reader.next_record()?.ok_or_else(|| reader.spoiled())?;
        if first.is_empty() {
            // of whatever run it is: nothing is lost with it
            return Ok(None);
        }
        let remedy = "name another file, or remove this one, and the run begins anew";
        self.head.check(&self.path, &reader.head, remedy)?;
        let RunRecord::State(state) = RunRecord::parse(&reader, &first)? else {
            return Err(reader.spoiled());
        };
        let mut arrivals = Vec::new();
        while let Some(record) = RunRecord::next(&mut reader)? {
            let RunRecord::Arrivals { key, words } = record else { return Err(reader.spoiled()) };
            arrivals.push((key, words));
        }
        Ok(Some(Resumed { state: *state, arrivals }))
    }

    /// Writes what the run has done so far beside the checkpoint's place, then moves it there.
    /// Error: it cannot be written, or the checkpoint was not opened.
    pub fn write(&self, state: RunState, arrivals: KeptArrivals) -> io::Result<()> {
        let mut held = lock(&self.held);
        let held = held.as_mut().ok_or_else(|| io::Error::other("it is not open"))?;
        let old = held.file.metadata().ok();
        let file = unfinished_file(&folder_of(&held.place), old.as_ref())?;
        let state = [RunRecord::State(Box::new(state))].into_iter();
        let arrivals = arrivals.map(|(key, task)| RunRecord::Arrivals { key, words: task.words() });
        let writer = BufWriter::with_capacity(1 << 16, file);
        let file = write(&self.head, state.chain(arrivals), writer)?.into_inner()?;
        file.as_file().sync_all()?;
        held.file = file.persist(&held.place).map_err(|e| e.error)?;
        held.kept = true;
        Ok(())
    }

    /// Removes the checkpoint, once the results are written.
    pub fn remove(&self) {
        if let Some(held) = lock(&self.held).take() {
            held.remove();
        }
    }
}

#[cfg(test)]
mod tests {
    use std::{fs, sync::LazyLock, time::Duration};

    use proptest::prelude::*;

    use super::*;
    use crate::work_file::sealed;
    use phylux_core::{
        error::ErrorKind,
        transport::simulate::{Control, Keeper, simulate_kept},
    };
    use phylux_testing::{check_error, small_scene, spoiled};

    const WORDS: &[&str] = &[
        "18446744073709551615",
        "9007199254740993",
        "null",
        "[]",
        "[0]",
        "{\"arrivals\":{\"key\":[0,0,0],\"words\":[]}}",
    ];

    fn settings() -> Settings {
        Settings {
            photons: PhotonCount::new(20_000).ok(),
            k: NearestCount::new(5).ok(),
            threads: ThreadCount::ONE,
            ..Settings::default()
        }
    }

    /// Two checkpoints, the first and the last, of a run of 20,000 photons that was saved as often
    /// as possible.
    static FILES: LazyLock<&'static [&'static str]> = LazyLock::new(|| {
        let folder = tempfile::tempdir().expect("a folder");
        let scene = small_scene().scene;
        let checkpoint = Checkpoint::new(&folder.path().join("kept"), &scene, &settings());
        assert!(checkpoint.open().expect("a new file").is_none());
        let texts = std::sync::Mutex::new(Vec::new());
        let save = |state: RunState, arrivals: KeptArrivals| {
            checkpoint.write(state, arrivals).expect("a checkpoint");
            let text = fs::read_to_string(checkpoint.path()).expect("a checkpoint");
            texts.lock().expect("no panic").push(text);
        };
        let keeper = Keeper::new(Duration::ZERO, None, &save);
        let control = Control::default();
        simulate_kept(&scene, &settings(), &control, Some(&keeper)).expect("a run");
        let texts = texts.into_inner().expect("no panic");
        let chosen = [texts.first(), texts.last()].map(|text| text.expect("kept").clone().leak());
        Vec::leak(chosen.map(|text| &*text).to_vec())
    });

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

        /// However a checkpoint is changed, even if its hash is made to fit again, the run either
        /// goes on or ends with an error of input. It never panics; a run would report a panic as
        /// an error of another kind.
        #[test]
        fn no_spoiled_checkpoint_panics(text in spoiled(&FILES, WORDS), sign: bool) {
            let folder = tempfile::tempdir().expect("a folder");
            let scene = small_scene().scene;
            let checkpoint = Checkpoint::new(&folder.path().join("kept"), &scene, &settings());
            fs::write(checkpoint.path(), if sign { sealed(&text) } else { text }).expect("written");
            match checkpoint.open() {
                Err(error) => check_error(&error, checkpoint.path()),
                Ok(resumed) => {
                    let keeper = Keeper::new(Duration::from_secs(1000), resumed, &|_, _| {});
                    let control = Control::default();
                    if let Err(error) = simulate_kept(&scene, &settings(), &control, Some(&keeper)) {
                        prop_assert!(error.kind() == ErrorKind::Input, "{}", error);
                    }
                }
            }
        }
    }
}
