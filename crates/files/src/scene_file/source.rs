//! Where the scene of a study comes from: a scene file, or a scene in memory that stands for one.

use std::path::{Path, PathBuf};

use serde_json::Value;

use super::{InMemory, LoadedScene, load_from, load_value, read_document};
use crate::input::read_bytes;
use phylux_core::error::Result;

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
        Ok(Self { path: path.into(), document: read_document(path, &read_bytes)?, memory: None })
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
        self.load_changed(self.document.clone())
    }

    /// Loads the scene with another JSON. Errors: those of [`load`](super::load).
    pub fn load_changed(&self, document: Value) -> Result<LoadedScene> {
        match &self.memory {
            None => load_value(document, &self.path, &read_bytes, None),
            Some(memory) => load_from(document, &self.path, memory),
        }
    }
}
