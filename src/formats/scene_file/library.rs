//! The materials that a scene can use, and those that it does.

use std::collections::{BTreeMap, HashSet};

use crate::scene::{material::Material, world::NamedMaterial};

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
    named: NamedMaterial,
    /// Index among the materials that surfaces have.
    used: Option<usize>,
    reciprocal: bool,
}

impl Library {
    pub fn add(&mut self, name: String, material: Material, reciprocal: bool) -> usize {
        self.names.insert(name.clone());
        let named = NamedMaterial { name, material };
        self.entries.push(Entry { named, used: None, reciprocal });
        self.entries.len() - 1
    }

    /// The index that a material has in the scene, now that a surface has it.
    pub fn use_entry(&mut self, entry: usize) -> usize {
        *self.entries[entry].used.get_or_insert_with(|| {
            self.used += 1;
            self.used - 1
        })
    }

    pub fn unused(&self) -> Vec<String> {
        let unused = self.entries.iter().filter(|entry| entry.used.is_none());
        unused.map(|entry| entry.named.name.clone()).collect()
    }

    pub fn non_reciprocal(&self) -> Vec<String> {
        let found = self.entries.iter().filter(|e| e.used.is_some() && !e.reciprocal);
        found.map(|entry| entry.named.name.clone()).collect()
    }

    pub fn into_used(self) -> Vec<NamedMaterial> {
        let mut used: Vec<(usize, NamedMaterial)> =
            self.entries.into_iter().filter_map(|e| Some((e.used?, e.named))).collect();
        used.sort_by_key(|(index, _)| *index);
        used.into_iter().map(|(_, named)| named).collect()
    }
}
