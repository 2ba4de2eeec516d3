//! What is [`Taken`] while a scene is put together: names, and the number of triangles. Whoever
//! adds something to the scene claims it here first.

use std::collections::{BTreeMap, HashSet};

use phylux_core::{
    error::{Checked, Problem},
    math::machine::{gib, memory_left},
    scene::world::{MAX_CAPTORS, MAX_LIGHTS, MAX_TRIANGLES},
};

/// The names that are taken, and how many triangles there are.
#[derive(Default)]
pub(super) struct Taken {
    /// The index of each group of captors, by name.
    pub(super) groups: BTreeMap<String, usize>,
    /// Names of the captor entries and of the objects with captors. Each is the name of a group of
    /// captors too.
    pub(super) entries: HashSet<String>,
    /// The groups that entries and objects join by the key `group`, with the JSON pointer of one of
    /// them.
    pub(super) joined: BTreeMap<String, String>,
    captor_ids: HashSet<String>,
    pub(super) light_names: HashSet<String>,
    triangles: usize,
}

impl Taken {
    /// Returns the index of the group `name`; a group that is new gets the next index.
    pub(super) fn group(&mut self, name: &str) -> usize {
        let next = self.groups.len();
        *self.groups.entry(name.to_string()).or_insert(next)
    }

    /// Returns the index of the group that the entry or object `name` joins by the key `group`.
    pub(super) fn joined(&mut self, pointer: &str, name: &str, group: &str) -> usize {
        if group != name && !self.joined.contains_key(group) {
            self.joined.insert(group.into(), format!("{pointer}/group"));
        }
        self.group(group)
    }

    /// Takes out the names of all groups, in the order of their indices.
    pub(super) fn take_groups(&mut self) -> Vec<String> {
        let mut groups: Vec<(usize, String)> = std::mem::take(&mut self.groups)
            .into_iter()
            .map(|(name, index)| (index, name))
            .collect();
        groups.sort();
        groups.into_iter().map(|(_, name)| name).collect()
    }

    /// Claims the name of a captor entry or of an object with captors. Error: the name is taken.
    pub(super) fn claim_entry(&mut self, name: &str) -> Checked {
        if self.entries.insert(name.to_string()) {
            return Ok(());
        }
        Err(Problem::new(
            format!("a second captor entry or captor object named `{name}`"),
            "give one of them a `name` of its own",
        ))
    }

    /// Claims the id of a captor. Error: the id is taken, or there are too many captors.
    pub(super) fn claim_captor(&mut self, id: &str) -> Checked {
        if self.captor_ids.len() == MAX_CAPTORS {
            return Err(too_many_captors());
        }
        if self.captor_ids.insert(id.to_string()) {
            return Ok(());
        }
        Err(Problem::new(
            format!("a second captor with the id `{id}`"),
            "give one of the entries a `name` of its own",
        ))
    }

    /// Claims the name of a light. Error: the name is taken, or there are too many lights.
    pub(super) fn claim_light(&mut self, name: &str) -> Checked {
        if !self.light_names.insert(name.to_string()) {
            return Err(Problem::new(
                format!("a second light named `{name}`"),
                "give it a `name` of its own",
            ));
        }
        if self.light_names.len() > MAX_LIGHTS {
            return Err(Problem::new(
                format!("more than {MAX_LIGHTS} lights"),
                "make one area light of many small ones",
            ));
        }
        Ok(())
    }

    /// Claims room for more triangles. Error: they take more memory than is left, or there are too
    /// many.
    pub(super) fn claim_triangles(&mut self, more: usize) -> Checked {
        // while the search structure is made, measured with meshes of 1e6 triangles; and what a
        // triangle takes that has its place already, bytes
        const EACH: usize = 220;
        const PLACED: usize = 72;
        // how many more triangles it takes to ask the system again
        const STEP: usize = 20_000;
        let before = self.triangles;
        self.triangles += more;
        if self.triangles / STEP > before / STEP {
            let (bytes, left) = (EACH * self.triangles - PLACED * before, memory_left());
            if bytes as u64 > left {
                let problem = format!(
                    "at least {} triangles take {:.1} GiB of memory, of {:.1} that are left",
                    self.triangles,
                    gib(bytes as u64),
                    gib(left)
                );
                return Err(Problem::new(problem, "use fewer instances or coarser meshes"));
            }
        }
        if self.triangles <= MAX_TRIANGLES {
            return Ok(());
        }
        Err(Problem::new(
            format!("more than {MAX_TRIANGLES} triangles"),
            "use fewer instances, coarser meshes or fewer captors",
        ))
    }
}

/// Says that a scene has more captors than it can have.
pub(super) fn too_many_captors() -> Problem {
    Problem::new(
        format!("more than {MAX_CAPTORS} captors"),
        "let groups count in place of triangles, or fewer instances",
    )
}
