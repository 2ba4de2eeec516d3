//! The materials that a scene can use, and those that it does.

use std::collections::{BTreeMap, HashSet};

use crate::{
    error::{Error, Result},
    scene::{material::Material, world::NamedMaterial},
};

/// The materials of a scene: all of its file's, and the MTL entries that are used.
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
    /// Or what is wrong with it, which matters only to those who use it.
    material: Result<Material>,
    /// Index among the materials that surfaces have.
    used: Option<usize>,
    reciprocal: bool,
}

impl Library {
    pub fn add(&mut self, name: String, material: Result<Material>, reciprocal: bool) -> usize {
        self.names.insert(name.clone());
        self.entries.push(Entry { name, material, used: None, reciprocal });
        self.entries.len() - 1
    }

    /// Adds a material that a surface has. Its index in the scene.
    pub fn add_used(&mut self, name: String, material: Material) -> usize {
        let entry = self.add(name, Ok(material), true);
        self.index(entry)
    }

    /// The index that a material has in the scene, now that a surface has it. Error: what is wrong with it.
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

    /// Whether the surfaces of the material with this index in the scene have to say where azimuth 0 is.
    pub fn needs_tangents(&self, index: usize) -> bool {
        let mut entries = self.entries.iter().filter(|entry| entry.used == Some(index));
        entries.any(|entry| matches!(&entry.material, Ok(material) if material.needs_tangents()))
    }

    /// What is wrong with materials that no surface has.
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
