//! The materials that a scene can use, and the indices of those that its surfaces use.

use std::collections::{BTreeMap, HashSet};

use phylux_core::{
    error::{Error, Result},
    scene::{
        material::{Material, Scatterer},
        world::{NamedMaterial, may_be_shared},
    },
};

/// The materials known while a scene is loaded: all of the scene file, those entries of MTL and
/// Radiance files that surfaces use, and the black material of the ends of tubes.
#[derive(Default)]
pub(super) struct Library {
    entries: Vec<Entry>,
    pub by_name: BTreeMap<String, usize>,
    pub by_mtl_place: BTreeMap<String, usize>,
    pub names: HashSet<String>,
    used: usize,
}

struct Entry {
    name: String,
    /// The material, or what is wrong with it: an error only if a surface has this material.
    material: Result<Material>,
    /// Index of the material in the scene, which holds only the materials that surfaces have;
    /// `None` while no surface has it.
    used: Option<usize>,
    reciprocal: bool,
}

impl Library {
    pub fn add(&mut self, name: String, material: Result<Material>, reciprocal: bool) -> usize {
        self.names.insert(name.clone());
        self.entries.push(Entry { name, material, used: None, reciprocal });
        self.entries.len() - 1
    }

    /// Adds a material that a surface has and returns its index in the scene.
    pub fn add_used(&mut self, name: String, material: Material) -> usize {
        let entry = self.add(name, Ok(material), true);
        self.index(entry)
    }

    /// Returns the index that a material has in the scene, giving it one if no surface had it
    /// before. Error: what is wrong with the material.
    pub fn use_entry(&mut self, entry: usize) -> Result<usize> {
        match &self.entries[entry].material {
            Ok(_) => Ok(self.index(entry)),
            Err(error) => Err(error.clone()),
        }
    }

    fn index(&mut self, entry: usize) -> usize {
        *self.entries[entry].used.get_or_insert_with(|| {
            self.used += 1;
            self.used - 1
        })
    }

    /// Whether the surfaces with this material (`index` in the scene) have to say where azimuth 0
    /// lies.
    pub fn needs_tangents(&self, index: usize) -> bool {
        let mut entries = self.entries.iter().filter(|entry| entry.used == Some(index));
        entries.any(|entry| matches!(&entry.material, Ok(material) if material.needs_tangents()))
    }

    /// Whether copies of a surface with this material (`index` in the scene) may share its triangles.
    pub fn may_be_shared(&self, index: usize) -> bool {
        let mut entries = self.entries.iter().filter(|entry| entry.used == Some(index));
        entries.all(|entry| matches!(&entry.material, Ok(material) if may_be_shared(material)))
    }

    /// Returns what is wrong with each material that could not be read; a scene is loaded only if
    /// no surface has one of these.
    pub fn unused_errors(&self) -> impl Iterator<Item = Error> + '_ {
        self.entries.iter().filter_map(|entry| entry.material.clone().err())
    }

    pub fn unused(&self) -> Vec<String> {
        let unused = self.entries.iter().filter(|entry| entry.used.is_none());
        unused.map(|entry| entry.name.clone()).collect()
    }

    pub fn non_reciprocal(&self) -> Vec<String> {
        let found = self.entries.iter().filter(|e| e.used.is_some() && !e.reciprocal);
        found.map(|entry| entry.name.clone()).collect()
    }

    pub fn into_used(self) -> Vec<NamedMaterial> {
        let named = |entry: Entry| {
            let Entry { name, material, used, .. } = entry;
            Some((used?, NamedMaterial { name, material: material.ok()? }))
        };
        let mut used: Vec<(usize, NamedMaterial)> =
            self.entries.into_iter().filter_map(named).collect();
        used.sort_by_key(|(index, _)| *index);
        used.into_iter().map(|(_, named)| named).collect()
    }
}
