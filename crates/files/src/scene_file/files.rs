//! The [`Files`] of a scene: where they are found, what was read of them, and errors that say where
//! in the scene file they are.

use std::{
    cell::RefCell,
    collections::HashMap,
    fmt::Display,
    path::{Path, PathBuf},
    sync::Arc,
};

use super::{hourly_lights::ByHour, kept::Kept};
use crate::{
    input::{Fetch, RELATIVE, quoted},
    json, mesh_file,
    obj::{Mesh, ObjFile},
    photometry::Photometry,
};
use phylux_core::error::{Error, Result, nearest};

/// The most names that a sentence lists of those that are known: all spectra at hand.
const NAMED: usize = 30;

/// The places where a scene finds the files, meshes and tables that its JSON only names.
pub(super) struct Sources<'a> {
    /// Reads the file at a path.
    pub(super) read: &'a Fetch<'a>,
    /// Files and arranged triangles of other scenes, to be used again if they are the same.
    pub(super) kept: Option<&'a Kept>,
    /// Meshes in memory, by name.
    pub(super) meshes: &'a HashMap<String, Mesh>,
    /// Tables of captors in memory (the bytes of CSV files), by name.
    pub(super) tables: &'a HashMap<String, Vec<u8>>,
    /// How finely the sky is divided, if the sun and the sky are to become the lights of
    /// [`HourlyLights`](super::HourlyLights); else `None`.
    pub(super) by_hour: Option<ByHour<'a>>,
}

/// The scene file, the files that it names, and what is kept of them while the scene is put
/// together.
pub(super) struct Files<'a> {
    /// The path of the scene file.
    pub(super) path: PathBuf,
    pub(super) sources: &'a Sources<'a>,
    /// Every file that was read, the scene file first.
    pub(super) read: RefCell<Vec<PathBuf>>,
    pub(super) obj_files: HashMap<PathBuf, Arc<ObjFile>>,
    photometries: HashMap<PathBuf, Photometry>,
}

impl<'a> Files<'a> {
    /// Starts with the scene file at `path`, which has been read.
    pub(super) fn new(path: &Path, sources: &'a Sources) -> Self {
        Self {
            path: path.to_path_buf(),
            sources,
            read: RefCell::new(vec![path.to_path_buf()]),
            obj_files: HashMap::new(),
            photometries: HashMap::new(),
        }
    }

    /// Names the place of a JSON pointer in the scene file, for errors.
    pub(super) fn place(&self, pointer: impl Display) -> String {
        json::place(&self.path.display().to_string(), &pointer.to_string())
    }

    /// Makes an error at a JSON pointer of the scene file.
    pub(super) fn error(&self, pointer: impl Display, problem: impl Display) -> Error {
        Error::input(self.place(pointer), problem)
    }

    /// Returns the path of a file that the scene file names, relative to the scene file.
    pub(super) fn sibling(&self, file: &str) -> PathBuf {
        self.path.parent().unwrap_or(Path::new("")).join(file)
    }

    /// Reads the bytes of a file that the scene file names at `pointer`.
    pub(super) fn bytes(&self, pointer: &str, path: &Path) -> Result<Vec<u8>> {
        let error = |why| self.error(pointer, format!("{}: {why}", path.display()));
        self.fetch(path).map_err(|why| error(why).remedy(RELATIVE))
    }

    /// Reads the bytes of a file, or says why they cannot be read.
    pub(super) fn fetch(&self, path: &Path) -> std::result::Result<Vec<u8>, String> {
        let bytes = (self.sources.read)(path)?;
        self.read.borrow_mut().push(path.to_path_buf());
        Ok(bytes)
    }

    /// Reads the mesh in the file at `path`, or takes it as another scene has read it.
    pub(super) fn read_obj(&self, pointer: &str, path: &Path) -> Result<Arc<ObjFile>> {
        let bytes = self.bytes(pointer, path)?;
        let fetch = |path: &Path| self.fetch(path);
        match self.sources.kept {
            Some(kept) => kept.obj(&bytes, path, &fetch),
            None => Ok(Arc::new(mesh_file::parse(&bytes, path, fetch)?)),
        }
    }

    /// Returns a mesh that is in memory.
    pub(super) fn mesh(&self, pointer: &str, name: &str) -> Result<Arc<ObjFile>> {
        let meshes = self.sources.meshes;
        if let Some(mesh) = meshes.get(name) {
            return Ok(mesh.as_obj());
        }
        let mut known: Vec<&str> = meshes.keys().map(String::as_str).collect();
        known.sort_unstable();
        let error = self.error(pointer, format!("there is no mesh {} in memory", quoted(name)));
        Err(match known.is_empty() {
            true => error.remedy("name a file; meshes can only be handed over by a program"),
            false => unknown(error, name, known.into_iter()),
        })
    }

    /// Returns the bytes of a table that is in memory.
    pub(super) fn table(&self, pointer: &str, name: &str) -> Result<&[u8]> {
        self.sources.tables.get(name).map(Vec::as_slice).ok_or_else(|| {
            self.error(pointer, format!("there is no table {} in memory", quoted(name)))
                .remedy("name a CSV file; tables can only be handed over by a program")
        })
    }

    /// Returns what a photometry file says, which is read once.
    pub(super) fn photometry(&mut self, pointer: &str, file: &str) -> Result<Photometry> {
        let path = self.sibling(file);
        if let Some(known) = self.photometries.get(&path) {
            return Ok(known.clone());
        }
        let photometry = Photometry::parse(&self.bytes(pointer, &path)?, &path)?;
        self.photometries.insert(path, photometry.clone());
        Ok(photometry)
    }
}

/// Adds to an error about an unknown `name` the nearest known name, if one is near, and a list of
/// the known names.
pub(super) fn unknown<'a>(
    error: Error,
    name: &str,
    known: impl Iterator<Item = &'a str> + Clone,
) -> Error {
    let mut all: Vec<&str> = known.clone().take(NAMED + 1).collect();
    if all.is_empty() {
        return error.remedy("there is none");
    }
    if let Some(more) = all.get_mut(NAMED) {
        *more = "...";
    }
    error.did_you_mean_of(nearest(name, known), &all.join(", "))
}
