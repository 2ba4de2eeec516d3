//! Where the scene of a study comes from: a scene file, or a scene in memory that stands for one.

use std::{
    collections::HashMap,
    path::{Path, PathBuf},
};

use serde_json::Value;
use sha2::{Digest, Sha256};

use super::{ByHour, InMemory, LoadedScene, load_in_memory, load_sources, loader::Sources};
use crate::{
    input::{hex, read_bytes},
    json,
};
use phylux_core::error::{Error, Result};

/// A scene file with its content, or a scene in memory.
#[derive(Debug)]
pub struct SceneSource {
    path: PathBuf,
    document: Value,
    /// Meshes and tables that stand for files; `None` for a scene file.
    memory: Option<InMemory>,
}

impl SceneSource {
    /// Reads the scene file at `path`. Errors: it cannot be read; it is no JSON.
    pub fn read(path: &Path) -> Result<Self> {
        let place = path.display().to_string();
        let bytes = read_bytes(path)
            .map_err(|why| Error::input(&place, why).remedy("name a scene file (JSON)"))?;
        Ok(Self { path: path.into(), document: json::parse(&place, &bytes)?, memory: None })
    }

    /// Takes a scene in memory: `document` is the JSON of a scene file that would stand at `path`.
    pub fn in_memory(document: Value, path: PathBuf, memory: InMemory) -> Self {
        Self { path, document, memory: Some(memory) }
    }

    /// The scene file, or where it would stand.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The JSON of the scene file.
    pub fn document(&self) -> &Value {
        &self.document
    }

    /// Loads the scene. Errors: those of [`load`](super::load).
    pub fn load(&self) -> Result<LoadedScene> {
        self.load_changed(self.document.clone(), None)
    }

    /// Loads the scene with another JSON, and with the lights of each hour if it is asked for
    /// `by_hour`. Errors: those of [`load`](super::load) and [`load_by_hour`](super::load_by_hour).
    pub fn load_changed(&self, document: Value, by_hour: Option<ByHour>) -> Result<LoadedScene> {
        let none = (&HashMap::new(), &HashMap::new());
        let (meshes, tables) =
            self.memory.as_ref().map_or(none, |memory| (&memory.meshes, &memory.tables));
        let sources = Sources { read: &read_bytes, kept: None, meshes, tables, by_hour };
        match self.memory {
            None => load_sources(document, &self.path, &sources),
            Some(_) => load_in_memory(document, &self.path, &sources),
        }
    }

    /// Returns a SHA-256 in hexadecimal digits over the scene file and the `files` that were read for
    /// it, in this order. Error: a file can no longer be read.
    pub fn digest<'a>(&self, files: impl IntoIterator<Item = &'a PathBuf>) -> Result<String> {
        let mut hash = Sha256::new();
        if let Some(memory) = &self.memory {
            hash.update(Sha256::digest(self.document.to_string()));
            let mut tables: Vec<_> = memory.tables.iter().collect();
            tables.sort();
            for (name, bytes) in tables {
                hash.update(Sha256::digest(name));
                hash.update(Sha256::digest(bytes));
            }
            let mut meshes: Vec<_> = memory.meshes.iter().collect();
            meshes.sort_by_key(|(name, _)| *name);
            for (name, mesh) in meshes {
                // in the shortest digits that tell all numbers apart
                hash.update(Sha256::digest(format!("{name} {mesh:?}")));
            }
        }
        for file in files {
            let bytes = read_bytes(file).map_err(|why| Error::unreadable(file.display(), why))?;
            hash.update(Sha256::digest(&bytes));
        }
        Ok(hex(hash))
    }
}
