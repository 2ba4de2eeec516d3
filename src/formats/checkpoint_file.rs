//! Checkpoint files: what a run has done so far, so that it can go on later.
//!
//! The file is JSON by lines: one line for the head, one for the sums, one for each task of the
//! photon map, and one for the end. It is written beside its place and moved there only when it is
//! complete.
//!
//! The process that keeps a checkpoint holds a lock of the system on the file that is there, from
//! the first moment on: it begins with a file that holds nothing but the head and the end.

use std::{
    fs::File,
    io::{self, BufReader, BufWriter, Seek, Write},
    path::{Path, PathBuf},
    sync::{Mutex, PoisonError},
};

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use super::shard_file::{FORMAT, Line, VERSION, end, line};
use crate::{
    error::{Error, Result},
    formats::{
        held_file::HeldFile,
        json,
        output::{folder_of, place_of},
        unfinished::unfinished_file,
    },
    scene::world::Scene,
    transport::{
        settings::{Estimator, Guiding, Settings, Target},
        simulate::{KeptArrivals, Resumed, RunState},
    },
};

/// Says which run a checkpoint belongs to.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Head {
    /// The version of random numbers and sums, [`FORMAT`].
    phylux_checkpoint: u32,
    /// Version of phylux that wrote the file.
    phylux: String,
    /// Hash of the scene, [`Scene::digest`].
    scene_hash: String,
    settings: KeptSettings,
}

/// The settings that the results of a run depend on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct KeptSettings {
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
    #[serde(default)]
    of: Vec<String>,
}

/// The checkpoint file of a run.
#[derive(Debug)]
pub struct Checkpoint {
    path: PathBuf,
    head: Head,
    /// The file at the checkpoint's place, once this process holds it.
    held: Mutex<Option<Held>>,
}

/// The file at the checkpoint's place, with the lock of this process.
#[derive(Debug)]
struct Held {
    file: HeldFile,
    /// Whether it holds something that a run has done.
    kept: bool,
}

impl Checkpoint {
    /// Describes the checkpoint at `path` for a run of `scene` with these `settings`; it touches no
    /// file.
    pub fn new(path: &Path, scene: &Scene, settings: &Settings) -> Self {
        let Settings { estimator, photons, seed, k, map_photons, guiding, by_light, .. } =
            *settings;
        let Settings { tolerance, tolerance_limit, .. } = *settings;
        let photons = photons.unwrap_or(Settings::DEFAULT_PHOTONS);
        let settings = KeptSettings {
            estimator,
            photons,
            seed,
            k,
            map_photons,
            guiding,
            by_light,
            tolerance,
            tolerance_limit: tolerance_limit.filter(|_| tolerance.is_some()),
            of: settings.of.iter().map(Target::to_string).collect(),
        };
        let head = Head {
            phylux_checkpoint: FORMAT,
            phylux: VERSION.into(),
            scene_hash: scene.digest(),
            settings,
        };
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
        let (held, new) = HeldFile::open(&self.path, &self.empty()?)?;
        // a file can be replaced only if another can be made beside it
        unfinished_file(&folder_of(&held.place), None).map_err(|e| {
            let problem = format!("cannot be written: {}", e.kind());
            Error::input(self.path.display(), problem).remedy("write elsewhere")
        })?;
        let resumed = if new { None } else { self.read(&held.file)? };
        *self.lock() = Some(Held { file: held, kept: resumed.is_some() });
        Ok(resumed)
    }

    /// Returns the content of a checkpoint that holds nothing yet.
    fn empty(&self) -> Result<Vec<u8>> {
        let content = || -> io::Result<Vec<u8>> {
            let mut hash = Sha256::new();
            let mut head = serde_json::to_vec(&self.head)?;
            head.push(b'\n');
            hash.update(&head);
            head.extend(end(hash)?);
            Ok(head)
        };
        content().map_err(|e| Error::run(self.path.display(), e))
    }

    fn lock(&self) -> std::sync::MutexGuard<'_, Option<Held>> {
        self.held.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Reads what the run has done so far; `None` if that is nothing. Errors: the file is not a
    /// checkpoint, is damaged, or belongs to another run.
    fn read(&self, file: &File) -> Result<Option<Resumed>> {
        let place = self.path.display();
        let spoiled = || {
            Error::input(&place, "was cut short or changed since it was written")
                .remedy("remove it, and the run begins anew")
        };
        let mut reader = file.try_clone().map_err(|_| spoiled())?;
        reader.rewind().map_err(|_| spoiled())?;
        let mut reader = BufReader::new(reader);
        let mut hash = Sha256::new();
        let first = line(&mut reader, &mut hash).map_err(|_| spoiled())?;
        let head: Head = serde_json::from_slice(&first).map_err(|e| {
            Error::input(&place, format!("is no checkpoint of a run: {e}")).remedy(
                "name a file that is not there, or that `phylux run --checkpoint` has written",
            )
        })?;
        let of_head = hash.clone();
        let second = line(&mut reader, &mut hash).map_err(|_| spoiled())?;
        if end(of_head).is_ok_and(|end| end == second) {
            // of whatever run it is: nothing is lost with it
            return Ok(None);
        }
        self.check(&head)?;
        json::check_memory(&second).map_err(|why| Error::input(&place, why))?;
        let state: RunState = serde_json::from_slice(&second).map_err(|_| spoiled())?;
        let mut arrivals = Vec::new();
        loop {
            let before = hash.clone();
            let bytes = line(&mut reader, &mut hash).map_err(|_| spoiled())?;
            json::check_memory(&bytes).map_err(|why| Error::input(&place, why))?;
            match serde_json::from_slice(&bytes) {
                Ok(Line::TaskArrivals { key, words }) => arrivals.push((key, words)),
                Ok(Line::End { .. }) if end(before).is_ok_and(|end| end == bytes) => {
                    return Ok(Some(Resumed { state, arrivals }));
                }
                _ => return Err(spoiled()),
            }
        }
    }

    /// Checks that the head `there`, read from a file, belongs to this run. Error: it belongs to
    /// another run.
    fn check(&self, there: &Head) -> Result<()> {
        let here = &self.head;
        let (a, b) = (&there.settings, &here.settings);
        let problem = match () {
            () if there.phylux != here.phylux => {
                format!("is of phylux {}, this is {}", there.phylux, here.phylux)
            }
            () if there.phylux_checkpoint != here.phylux_checkpoint => {
                "was written by a phylux with other random numbers and counts".into()
            }
            () if there.scene_hash != here.scene_hash => {
                "is of another scene, or of other contents of its files".into()
            }
            () if a != b => format!("is of a run with other settings: {}", difference(a, b)),
            () => return Ok(()),
        };
        Err(Error::input(self.path.display(), problem)
            .remedy("name another file, or remove this one, and the run begins anew"))
    }

    /// Writes what the run has done so far beside the checkpoint's place, then moves it there.
    /// Error: it cannot be written, or the checkpoint was not opened.
    pub fn write(&self, state: &RunState, arrivals: KeptArrivals) -> io::Result<()> {
        let mut held = self.lock();
        let held = held.as_mut().ok_or_else(|| io::Error::other("it is not open"))?;
        let old = held.file.file.metadata().ok();
        let mut writer = BufWriter::with_capacity(
            1 << 16,
            unfinished_file(&folder_of(&held.file.place), old.as_ref())?,
        );
        let mut hash = Sha256::new();
        let mut line = |value: Vec<u8>| {
            hash.update(&value);
            hash.update(b"\n");
            writer.write_all(&value)?;
            writer.write_all(b"\n")
        };
        line(serde_json::to_vec(&self.head)?)?;
        line(serde_json::to_vec(state)?)?;
        for (key, task) in arrivals {
            line(serde_json::to_vec(&Line::TaskArrivals { key, words: task.words() })?)?;
        }
        writer.write_all(&end(hash)?)?;
        let file = writer.into_inner()?;
        file.as_file().sync_all()?;
        held.file.file = file.persist(&held.file.place).map_err(|e| e.error)?;
        held.kept = true;
        Ok(())
    }

    /// Removes the checkpoint, once the results are written.
    pub fn remove(&self) {
        if let Some(held) = self.lock().take() {
            held.file.remove();
        }
    }
}

impl Drop for Checkpoint {
    /// Removes a checkpoint that holds nothing.
    fn drop(&mut self) {
        if let Some(held) = self.lock().take().filter(|held| !held.kept) {
            held.file.remove();
        }
    }
}

/// Describes the first setting that differs, with its value in the file (`there`) and in this run
/// (`here`).
fn difference(there: &KeptSettings, here: &KeptSettings) -> String {
    let values = |settings| serde_json::to_value(settings).unwrap_or_default();
    let (there, here) = (values(there), values(here));
    let keys = here.as_object().into_iter().flatten();
    let mut other = keys.filter(|(key, value)| there.get(key) != Some(value));
    other.next().map_or(String::new(), |(key, value)| {
        let before = there.get(key).unwrap_or(&serde_json::Value::Null);
        format!("{key} was {before} and is {value}")
    })
}

#[cfg(test)]
mod tests {
    use std::{fs, sync::LazyLock, time::Duration};

    use proptest::prelude::*;

    use super::*;
    use crate::{
        error::ErrorKind,
        formats::spoil::{check_error, small_scene, spoiled},
        transport::simulate::{Control, Keeper, simulate_kept},
    };

    const WORDS: &[&str] = &[
        "18446744073709551615",
        "9007199254740993",
        "null",
        "[]",
        "[0]",
        "{\"piece\":{\"key\":[0,0,0],\"words\":[]}}",
    ];

    fn settings() -> Settings {
        Settings { photons: Some(20_000), k: Some(5), threads: 1, ..Settings::default() }
    }

    /// Two checkpoints, the first and the last, of a run of 20,000 photons that was saved as often
    /// as possible.
    static FILES: LazyLock<&'static [&'static str]> = LazyLock::new(|| {
        let folder = tempfile::tempdir().expect("a folder");
        let scene = small_scene().scene;
        let checkpoint = Checkpoint::new(&folder.path().join("kept"), &scene, &settings());
        assert!(checkpoint.open().expect("a new file").is_none());
        let texts = std::sync::Mutex::new(Vec::new());
        let save = |state: &RunState, arrivals: KeptArrivals| {
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

    /// Replaces the last line of a checkpoint by one that holds the hash of the other lines.
    fn signed(text: &[u8]) -> Vec<u8> {
        let mut lines: Vec<&[u8]> = text.split_inclusive(|byte| *byte == b'\n').collect();
        lines.pop();
        let lines = lines.concat();
        let last = end(Sha256::new_with_prefix(&lines)).expect("a line");
        [lines, last].concat()
    }

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
            fs::write(checkpoint.path(), if sign { signed(&text) } else { text }).expect("written");
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
