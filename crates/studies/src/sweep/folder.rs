//! The folder of a sweep: the sweep it belongs to, one file for each run, and the time of each run.

use std::{
    collections::HashMap,
    ffi::OsStr,
    fs::{self, File, TryLockError},
    io::{self, Write},
    path::{Path, PathBuf},
};

use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::{
    origin::{Inputs, Origin},
    sealed::{is_valid, seal},
};
use phylux_core::error::{Error, Result};
use phylux_files::{
    input::read_bytes,
    json,
    output::{FilesRead, OutputFile},
    result_file::write_lines,
    sweep_file::{Run, Sweep},
    unfinished::{is_unfinished, remove_leftovers},
    written::{OwnFile, Written},
};
use phylux_results::result::RunResult;

/// File that names the sweep to which a folder belongs.
const MANIFEST: &str = "sweep.json";
/// Folder of the runs' results.
const RUNS: &str = "runs";
/// File of the record of the tables and plots that a sweep has written into its folder.
const RECORD: &str = "written.json";
/// What to do about a file that a sweep has not written.
const GO_ON: &str = "move it away; the same command goes on from there";
/// Folder of the plots, which show the light on groups against each parameter.
const PICTURES: &str = "plots";
/// Table of the time that each run took. Times differ whenever a sweep is done, so they are kept
/// apart from the results.
const TIMES: &str = "times.csv";
/// Lock file, held by the process that works in the folder.
const LOCK: &str = ".lock";
/// Version of phylux; only its results count.
const VERSION: &str = env!("CARGO_PKG_VERSION");

/// Manifest of a folder: enough to make the same sweep again.
#[derive(Debug, PartialEq, Serialize, Deserialize)]
pub struct Manifest {
    /// Version of phylux.
    pub phylux: String,
    /// The sweep file.
    pub sweep: Value,
    /// The scene file.
    pub scene: Value,
}

impl Manifest {
    /// Makes the manifest of a sweep.
    pub fn new(sweep: &Sweep) -> Self {
        let (file, scene) = (sweep.file().clone(), sweep.scene().clone());
        Self { phylux: VERSION.into(), sweep: file, scene }
    }

    /// Reads the manifest of the sweep in the folder `path`.
    pub fn read(path: &Path) -> Result<Self> {
        let path = path.join(MANIFEST);
        let name = path.display().to_string();
        let none = |why| {
            Error::input(&name, why).remedy("name a folder that `phylux sweep -o` has written")
        };
        let bytes = read_bytes(&path).map_err(none)?;
        let value = json::parse(&name, &bytes)?;
        serde_json::from_value(value).map_err(|e| none(format!("is of no sweep: {e}")))
    }
}

/// A folder in which one sweep is at work.
#[derive(Debug)]
pub struct SweepFolder {
    path: PathBuf,
    /// Tables and plots that this program wrote there.
    written: Written,
    /// Lock of the folder. It is released when the process ends, for whatever reason.
    _lock: File,
}

/// State of a run.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum State {
    /// The folder holds the run's results.
    Done,
    /// The run ended with this error.
    Failed(String),
    /// The run's file is damaged: it is not as it was written.
    Damaged,
    /// The folder holds nothing of the run.
    Missing,
}

impl State {
    /// Returns whether the run is done or has failed.
    pub fn is_ended(&self) -> bool {
        matches!(self, Self::Done | Self::Failed(_))
    }
}

/// The entries of a run's file that are read first.
#[derive(Deserialize)]
struct Head {
    sweep: Origin,
    phylux: String,
    error: Option<String>,
    /// Checksum of everything before it. Files of earlier versions have none.
    sha256: Option<String>,
}

/// The results of a run, with the inputs that they were made from.
#[derive(Serialize)]
struct Finished<'a> {
    sweep: &'a Origin,
    /// Kinds of the run's warnings.
    warning_kinds: Vec<&'static str>,
    #[serde(flatten)]
    result: &'a RunResult,
}

/// The error of a run, with the inputs that it came from.
#[derive(Serialize)]
struct Failed<'a> {
    sweep: &'a Origin,
    phylux: &'a str,
    error: &'a str,
}

impl SweepFolder {
    /// Opens the folder at `path` for a sweep, and creates it if it does not exist. Errors: the
    /// folder holds something else; another process is at work in it.
    pub fn open(path: &Path) -> Result<Self> {
        let fail =
            |problem: String| Error::input(path.display(), problem).remedy("write elsewhere");
        if path.exists() && !path.is_dir() {
            return Err(fail("is a file, not a folder".into()));
        }
        if !path.exists() {
            fs::create_dir(path).map_err(|e| fail(format!("cannot be created: {}", e.kind())))?;
        }
        let unreadable = |e: io::Error| fail(format!("cannot be read: {}", e.kind()));
        let strange = |name: &OsStr| name != LOCK && name != RUNS && !is_unfinished(name);
        if Manifest::read(path).is_err() {
            for entry in fs::read_dir(path).map_err(unreadable)? {
                let name = entry.map_err(unreadable)?.file_name();
                if strange(&name) {
                    let what = name.to_string_lossy();
                    let problem = format!("holds {what} and is not the folder of a sweep");
                    return Err(Error::input(path.display(), problem).remedy("name a new folder"));
                }
            }
        }
        if path.join(PICTURES).is_symlink() {
            let problem = "is a link, which no sweep has made";
            return Err(Error::input(path.join(PICTURES).display(), problem).remedy("move it away"));
        }
        let unwritable = |e: io::Error| fail(format!("cannot be written: {}", e.kind()));
        let lock = File::options().create(true).truncate(false).write(true).open(path.join(LOCK));
        let lock = lock.map_err(unwritable)?;
        // some file systems have no locks: the sweep then goes on without one
        if let Err(TryLockError::WouldBlock) = lock.try_lock() {
            return Err(Error::run(path.display(), "another phylux is at work in this folder")
                .remedy("wait for its end; shards need a folder each"));
        }
        fs::create_dir_all(path.join(RUNS)).map_err(unwritable)?;
        let written = Written::read(path, RECORD, GO_ON)?;
        Times::check(path)?;
        [path.to_path_buf(), path.join(RUNS), path.join(PICTURES)].iter().for_each(|folder| {
            remove_leftovers(folder);
        });
        Ok(Self { path: path.to_path_buf(), written, _lock: lock })
    }

    /// Returns the path of the folder.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Writes the manifest, unless it is there already.
    pub fn write_manifest(&self, sweep: &Sweep) -> Result<()> {
        let manifest = Manifest::new(sweep);
        if Manifest::read(&self.path).is_ok_and(|there| there == manifest) {
            return Ok(());
        }
        let file = OutputFile::of_sweep(&self.path.join(MANIFEST))?;
        file.write(&FilesRead::default(), |writer| write_lines(&manifest, writer))
    }

    /// Writes the results of a run.
    pub fn write_result(&self, key: &str, origin: &Origin, result: &RunResult) -> Result<()> {
        let warning_kinds = result.warnings().iter().map(|warning| warning.kind).collect();
        let finished = Finished { sweep: origin, warning_kinds, result };
        write_sealed(&result_path(&self.path, key), &finished)?;
        let _ = fs::remove_file(failure_path(&self.path, key));
        Ok(())
    }

    /// Writes the error of a run, and removes results that no longer hold.
    pub fn write_failure(&self, key: &str, origin: &Origin, error: &str) -> Result<()> {
        let failed = Failed { sweep: origin, phylux: VERSION, error };
        write_sealed(&failure_path(&self.path, key), &failed)?;
        let _ = fs::remove_file(result_path(&self.path, key));
        Ok(())
    }

    /// Copies the file of a run from another folder.
    pub fn copy(&self, from: &Path) -> Result<()> {
        let name = from.file_name().unwrap_or_default();
        let bytes = read_bytes(from).map_err(|why| Error::run(from.display(), why))?;
        let file = OutputFile::of_sweep(&self.path.join(RUNS).join(name))?;
        file.write(&FilesRead::default(), |writer| writer.write_all(&bytes))
    }

    /// Opens the table of times, to add finished runs.
    pub fn times(&self) -> Result<Times> {
        Times::open(self.path.join(TIMES))
    }

    /// Begins to write a plot.
    pub fn picture(&self, name: &str) -> Result<OwnFile<'_>> {
        let path = self.path.join(PICTURES);
        let made = fs::create_dir_all(&path);
        made.map_err(|e| Error::unwritable(path.display(), e.kind()))?;
        self.written.create(&format!("{PICTURES}/{name}"))
    }

    /// Returns the record of tables and plots that this program wrote into the folder.
    pub fn written(&self) -> &Written {
        &self.written
    }
}

/// Writes JSON with a checksum at its end.
fn write_sealed(path: &Path, value: &impl Serialize) -> Result<()> {
    let file = OutputFile::of_sweep(path)?;
    file.write(&FilesRead::default(), |writer| writer.write_all(&seal(value)?))
}

/// Returns the path of a run's results in the folder of a sweep.
pub fn result_path(folder: &Path, key: &str) -> PathBuf {
    folder.join(RUNS).join(format!("{key}.json"))
}

/// Returns the path of a run's error in the folder of a sweep.
fn failure_path(folder: &Path, key: &str) -> PathBuf {
    folder.join(RUNS).join(format!("{key}.failed.json"))
}

/// The file of a run in a folder.
#[derive(Debug)]
pub struct RunFile {
    /// Path of the run's file.
    pub path: PathBuf,
    /// What the file says: results or an error.
    pub state: State,
    /// The inputs from which the results or the error came.
    pub origin: Origin,
}

/// Finds the file of `run` in the folder at `path`, by this version and from the same scene and
/// `base`: its results, or else its error. `None` if there is none. Error: there is only a damaged
/// file of this name.
pub fn run_file(
    path: &Path,
    sweep: &Sweep,
    run: &Run,
    base: Option<&str>,
) -> std::result::Result<Option<RunFile>, Damaged> {
    let key = sweep.key(run);
    let mut found = Ok(None);
    for path in [result_path(path, &key), failure_path(path, &key)] {
        match read_head(&path) {
            Ok(None) => {}
            Ok(Some(head)) if head.phylux != VERSION || !head.sweep.is_of(sweep, run, base) => {}
            Ok(Some(Head { sweep: origin, error, .. })) => {
                let state = error.map_or(State::Done, State::Failed);
                return Ok(Some(RunFile { path, state, origin }));
            }
            Err(damaged) => found = Err(damaged),
        }
    }
    found
}

/// Error: a file is not as it was written.
#[derive(Debug)]
pub struct Damaged;

/// Reads the first entries of a run's file; `None` if it does not exist. A file of an earlier
/// version, without a checksum, must at least hold everything that results have.
fn read_head(path: &Path) -> std::result::Result<Option<Head>, Damaged> {
    if fs::symlink_metadata(path).is_err_and(|e| e.kind() == io::ErrorKind::NotFound) {
        return Ok(None);
    }
    let bytes = read_bytes(path).map_err(|_| Damaged)?;
    json::check_memory(&bytes).map_err(|_| Damaged)?;
    let head: Head = serde_json::from_slice(&bytes).map_err(|_| Damaged)?;
    let results = || serde_json::from_slice(&bytes).is_ok_and(|r: RunResult| r.is_valid());
    let whole = match (&head.sha256, &head.error) {
        (Some(_), _) => is_valid(&bytes),
        (None, Some(_)) => true,
        (None, None) => results(),
    };
    if whole { Ok(Some(head)) } else { Err(Damaged) }
}

/// Returns the state of `run` in the folder at `path`. Results or an error count only if they came
/// from the same files.
pub fn state(path: &Path, sweep: &Sweep, run: &Run, base: Option<&str>, inputs: &Inputs) -> State {
    match run_file(path, sweep, run, base) {
        Ok(Some(file)) if file.origin.stands(inputs) => file.state,
        Ok(_) => State::Missing,
        Err(Damaged) => State::Damaged,
    }
}

/// Table of the time that runs took. It grows by a line after each run.
#[derive(Debug)]
pub struct Times {
    path: PathBuf,
    file: File,
}

/// The time that a run took.
#[derive(Clone, Copy, Debug, Deserialize)]
pub struct Time {
    /// Time from reading the run's files to having its results, s.
    pub seconds: f64,
    /// Number of threads of the run.
    pub threads: usize,
}

impl Times {
    const HEAD: &str = "run,file,seconds,threads\n";

    fn open(path: PathBuf) -> Result<Self> {
        let fail = |e: io::Error| Error::unwritable(path.display(), e);
        let mut file = File::options().create(true).append(true).open(&path).map_err(fail)?;
        let text = fs::read(&path).map_err(fail)?;
        // after a power cut, the last line may be incomplete
        let start = match text.last() {
            None => Self::HEAD,
            Some(b'\n') => "",
            Some(_) => "\n",
        };
        file.write_all(start.as_bytes()).map_err(fail)?;
        Ok(Self { path, file })
    }

    /// Checks that the file of this name in the folder at `path`, if there is one, is such a table.
    fn check(path: &Path) -> Result<()> {
        let path = path.join(TIMES);
        let Ok(there) = fs::symlink_metadata(&path) else { return Ok(()) };
        let (text, head) = (fs::read(&path).unwrap_or_default(), Self::HEAD.as_bytes());
        if there.is_file() && (text.starts_with(head) || head.starts_with(&text)) {
            return Ok(());
        }
        let problem = "is no table of times that a sweep has written";
        Err(Error::input(path.display(), problem).remedy("move it away"))
    }

    /// Adds the time of a run.
    pub fn add(&mut self, run: &Run, key: &str, time: Time) -> Result<()> {
        let line = format!("{},{key}.json,{:.3},{}\n", run.number, time.seconds, time.threads);
        let added = self.file.write_all(line.as_bytes());
        added.map_err(|e| Error::unwritable(self.path.display(), e))
    }

    /// Returns the last time of each run in the table of the folder at `path`, by the name of the
    /// run's file.
    pub fn read(path: &Path) -> HashMap<String, Time> {
        let text = fs::read_to_string(path.join(TIMES)).unwrap_or_default();
        let line = |line: &str| {
            let mut cells = line.split(',').skip(1);
            let name = cells.next()?.to_string();
            let seconds =
                cells.next()?.parse().ok().filter(|s: &f64| s.is_finite() && *s >= 0.0)?;
            let threads = cells.next()?.parse().ok()?;
            Some((name, Time { seconds, threads }))
        };
        text.lines().filter_map(line).collect()
    }

    /// Writes the table anew: one line for each run of the sweep whose time is known, in order.
    pub fn tidy(folder: &SweepFolder, sweep: &Sweep, known: &HashMap<String, Time>) -> Result<()> {
        let file = OutputFile::of_sweep(&folder.path.join(TIMES))?;
        file.write(&FilesRead::default(), |writer| {
            writer.write_all(Self::HEAD.as_bytes())?;
            for run in sweep.runs() {
                let name = format!("{}.json", sweep.key(&run));
                if let Some(Time { seconds, threads }) = known.get(&name) {
                    writeln!(writer, "{},{name},{seconds:.3},{threads}", run.number)?;
                }
            }
            Ok(())
        })
    }
}

#[cfg(test)]
mod tests {
    use std::{collections::BTreeMap, sync::LazyLock};

    use proptest::prelude::*;
    use serde_json::{Map, json};

    use super::*;
    use phylux_core::transport::settings::{NearestCount, Settings};
    use phylux_files::{result_file::read_json, sweep_file::hash};
    use phylux_testing::{SCENE, check_error, check_finite, small_run, spoiled};

    #[rustfmt::skip]
    const WORDS: &[&str] = &[
        "null", "[", "]", "{", "}", "1e300", "\"error\": \"x\",", "\"sha256\":", "\"warnings\":", "\"base\":",
    ];

    static SWEEP: LazyLock<Sweep> = LazyLock::new(|| {
        let file = json!({ "scene": "s.json", "vary": { "/lights/0/power": [1, 2] } });
        let scene = serde_json::from_str(SCENE).expect("JSON");
        Sweep::new("sweep", file, scene, PathBuf::new()).unwrap_or_else(|e| panic!("{e}"))
    });
    /// Results and an error with their checksums, and results of an earlier version, which had
    /// none.
    static FILES: LazyLock<Vec<&'static str>> = LazyLock::new(|| {
        let own = tempfile::tempdir().expect("a temporary folder");
        let (run, path) = (SWEEP.run(0), own.path());
        let (key, folder) = (SWEEP.key(&run), SweepFolder::open(path));
        let folder = folder.unwrap_or_else(|e| panic!("{e}"));
        let scene = hash(SWEEP.document(&run).to_string().as_bytes());
        let files = BTreeMap::from([("leaf.obj".into(), Some(hash(b"")))]);
        let origin = Origin { parameters: Map::new(), scene, base: None, files };
        let result = small_run(Settings { k: Some(NearestCount::NONE), ..Settings::default() });
        folder.write_result(&key, &origin, &result).unwrap_or_else(|e| panic!("{e}"));
        let results = fs::read_to_string(result_path(path, &key)).expect("results");
        folder.write_failure(&key, &origin, "no light").unwrap_or_else(|e| panic!("{e}"));
        let failure = fs::read_to_string(failure_path(path, &key)).expect("an error");
        let before =
            String::from_utf8(unsealed(results.as_bytes()).to_vec()).expect("UTF-8") + "\n}\n";
        [results, failure, before].map(|text| &*text.leak()).to_vec()
    });

    /// Returns the text without its checksum.
    fn unsealed(bytes: &[u8]) -> &[u8] {
        let seal = b",\n  \"sha256\"";
        let at = bytes.windows(seal.len()).rposition(|words| words == seal);
        &bytes[..at.unwrap_or(bytes.len())]
    }

    #[test]
    fn the_sound_files_are_believed() {
        let states = FILES.iter().map(|text| {
            let folder = folder_with(text.as_bytes());
            state_in(folder.path()).expect("not damaged")
        });
        let failed = State::Failed("no light".into());
        assert_eq!(states.collect::<Vec<_>>(), [State::Done, failed, State::Done].map(Some));
    }

    /// Creates a folder in which the file of the first run has these bytes.
    fn folder_with(bytes: &[u8]) -> tempfile::TempDir {
        let folder = tempfile::tempdir().expect("a temporary folder");
        fs::create_dir(folder.path().join(RUNS)).expect("a folder");
        fs::write(result_path(folder.path(), &SWEEP.key(&SWEEP.run(0))), bytes).expect("a file");
        folder
    }

    /// Returns the state that the file of the first run gives.
    fn state_in(folder: &Path) -> std::result::Result<Option<State>, Damaged> {
        let file = run_file(folder, &SWEEP, &SWEEP.run(0), None)?;
        Ok(file.map(|file| file.state))
    }

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

        /// Whatever the text, a file with a checksum is accepted only as it was written, and what
        /// is accepted goes into tables as finite numbers.
        #[test]
        fn no_spoiled_run_panics(bytes in spoiled(FILES.as_slice(), WORDS)) {
            let folder = folder_with(&bytes);
            if let Ok(Some(state)) = state_in(folder.path()) {
                let value: Value = serde_json::from_slice(&bytes).expect("JSON");
                assert!(value.get("sha256").is_none_or(|seal| {
                    seal.is_null() || FILES.iter().any(|file| file.as_bytes() == bytes)
                }));
                if state == State::Done {
                    let path = result_path(folder.path(), &SWEEP.key(&SWEEP.run(0)));
                    check_finite(&read_json(&path).expect("results"));
                }
            }
        }

        /// Any text leads to times that are numbers.
        #[test]
        fn no_spoiled_times_panic(
            bytes in spoiled(&["run,file,seconds,threads\n1,a.json,0.5,2\n2,b.json,7,1\n"], &["1e300"]),
        ) {
            let folder = tempfile::tempdir().expect("a temporary folder");
            fs::write(folder.path().join(TIMES), &bytes).expect("a file");
            check_finite(&Times::read(folder.path()));
            Times::check(folder.path()).unwrap_or_else(|e| check_error(&e, &folder.path().join(TIMES)));
        }
    }
}
