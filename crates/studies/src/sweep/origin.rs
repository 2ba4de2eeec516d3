//! The inputs of a result: as long as none of them has changed, the result holds.

use std::{
    cell::RefCell,
    collections::{BTreeMap, HashMap},
    path::{Path, PathBuf},
    sync::Mutex,
};

use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};

use phylux_core::error::{Result, lock};
use phylux_files::{
    input::read_bytes,
    scene_file::{Kept, LoadedScene, load_value},
    sweep_file::{Run, Sweep, hash},
};

/// The inputs from which a result was made.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Origin {
    /// The value of each parameter.
    pub parameters: Map<String, Value>,
    /// SHA-256 of the scene with these values and with the seed.
    pub scene: String,
    /// SHA-256 of the scene that was run in its place, if only the powers of lights differ.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub base: Option<String>,
    /// SHA-256 of each file that the scene named; `None` for a file that could not be read.
    pub files: BTreeMap<String, Option<String>>,
}

impl Origin {
    /// Loads the scene of `run`, and records its inputs. `base` is the hash of the scene that is
    /// run in its place.
    pub fn load(
        sweep: &Sweep,
        run: &Run,
        base: Option<&str>,
        inputs: &Inputs,
    ) -> (Self, Result<LoadedScene>) {
        let document = sweep.document(run);
        let scene = hash(document.to_string().as_bytes());
        let files = RefCell::new(BTreeMap::new());
        let read = |path: &Path| {
            let bytes = inputs.read(path);
            let digest = bytes.as_ref().ok().map(|bytes| hash(bytes));
            files.borrow_mut().insert(path.to_string_lossy().into_owned(), digest);
            bytes
        };
        let path = Path::new(sweep.scene_path());
        let loaded = load_value(document, path, &read, Some(&inputs.kept));
        let (parameters, base) = (parameters(run), base.map(String::from));
        (Self { parameters, scene, base, files: files.into_inner() }, loaded)
    }

    /// Returns whether the scene of `run`, and the scene that is run in its place, are still the
    /// same.
    pub fn is_of(&self, sweep: &Sweep, run: &Run, base: Option<&str>) -> bool {
        self.base.as_deref() == base
            && self.scene == hash(sweep.document(run).to_string().as_bytes())
    }

    /// Returns whether the files that the scene names are still the same.
    pub fn stands(&self, inputs: &Inputs) -> bool {
        self.files.iter().all(|(path, digest)| inputs.hash(Path::new(path)) == *digest)
    }
}

fn parameters(run: &Run) -> Map<String, Value> {
    run.values.iter().map(|(p, value)| (p.name.clone(), (*value).clone())).collect()
}

/// The files that scenes name, with the hashes that they had when they were first read.
pub struct Inputs<'a> {
    folder: &'a Path,
    kept: Kept,
    known: Mutex<HashMap<PathBuf, Option<String>>>,
}

impl<'a> Inputs<'a> {
    /// Starts with no file read; paths are relative to `folder`.
    pub fn new(folder: &'a Path) -> Self {
        Self { folder, kept: Kept::default(), known: Mutex::default() }
    }

    /// Loads the scene `document` of `sweep`, which is not that of a single run.
    pub fn load(&self, sweep: &Sweep, document: Value) -> Result<LoadedScene> {
        let read = |path: &Path| self.read(path);
        load_value(document, Path::new(sweep.scene_path()), &read, Some(&self.kept))
    }

    /// Reads a file. Error: the file has changed while the sweep runs; tables would otherwise mix
    /// runs of different scenes, which nobody could see.
    pub fn read(&self, path: &Path) -> std::result::Result<Vec<u8>, String> {
        let bytes = read_bytes(&self.folder.join(path));
        let digest = bytes.as_ref().ok().map(|bytes| hash(bytes));
        let mut known = lock(&self.known);
        if *known.entry(path.to_path_buf()).or_insert_with(|| digest.clone()) != digest {
            return Err("has changed while the sweep ran: start it again".into());
        }
        bytes
    }

    /// Returns the hash of a file; `None` if it cannot be read.
    fn hash(&self, path: &Path) -> Option<String> {
        let known = || lock(&self.known);
        if !known().contains_key(path) {
            let _ = self.read(path);
        }
        known().get(path).cloned().flatten()
    }
}
