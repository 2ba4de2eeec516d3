//! What is [`Told`] about a scene, besides its errors, while it is put together.

use std::{
    collections::HashSet,
    fmt::Display,
    path::{Path, PathBuf},
};

use super::notes::TableNote;

/// What the user is told about a scene.
#[derive(Default)]
pub(super) struct Told {
    pub(super) warnings: Vec<String>,
    pub(super) notes: Vec<String>,
    pub(super) tables: Vec<TableNote>,
    /// What was said already of files that several objects may name, as place and kind.
    said: HashSet<(PathBuf, &'static str)>,
}

impl Told {
    /// Warns of a problem, unless there are too many warnings already.
    pub(super) fn warn(&mut self, place: impl Display, problem: impl Display) {
        const MOST: usize = 100;
        match self.warnings.len() {
            0..MOST => self.warnings.push(format!("{place}: {problem}")),
            MOST => self.warnings.push("and more warnings than these".into()),
            _ => {}
        }
    }

    /// Warns as [`warn`](Self::warn), unless the same was said before.
    pub(super) fn warn_once(&mut self, place: impl Display, problem: impl Display) {
        let sentence = format!("{place}: {problem}");
        if !self.warnings.contains(&sentence) {
            self.warn(place, problem);
        }
    }

    /// Notes what is worth knowing but may well be meant.
    pub(super) fn note(&mut self, place: impl Display, remark: impl Display) {
        self.notes.push(format!("{place}: {remark}"));
    }

    /// Returns whether something of this `kind` is to be said of a file for the first time, and
    /// keeps in mind that it was.
    pub(super) fn first_time(&mut self, file: &Path, kind: &'static str) -> bool {
        self.said.insert((file.to_path_buf(), kind))
    }
}
