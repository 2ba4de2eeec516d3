//! Files and folders that one process at a time works on, such as checkpoints: it holds a lock of the
//! system on the file, or on one in the folder, from the first moment on.

use std::{
    fmt::Display,
    fs::{self, File},
    io::{self, Write},
    path::{Path, PathBuf},
};

use crate::{
    output::{folder_of, writable_place},
    unfinished::{is_at, is_held, remove_leftovers, unfinished_file},
};
use phylux_core::error::{Error, Result};

/// The file whose lock says that a process is at work in its folder.
const OF_FOLDER: &str = ".phylux.lock";

/// A file with the lock of this process. It is removed in the end unless something is kept in it.
#[derive(Debug)]
pub struct HeldFile {
    /// The file, open to read and to write.
    pub file: File,
    /// Its path without links.
    pub place: PathBuf,
    /// Whether something is kept in it.
    pub kept: bool,
}

impl HeldFile {
    /// Opens the file at `path`, or begins one that holds `content`. What was there is kept. Errors:
    /// another process is at work on it; it cannot be written.
    pub fn open(path: &Path, content: &[u8]) -> Result<Self> {
        Self::unless_busy(path, content, || {
            Error::run(path.display(), "another phylux is at work on this checkpoint")
                .remedy("wait for its end, or name another file")
        })
    }

    /// Says that this process is at work in `folder`, by a file that is gone in the end. Errors: another
    /// process is at work there; the folder cannot be written.
    pub fn folder(folder: &Path) -> Result<Self> {
        let mut held = Self::unless_busy(&folder.join(OF_FOLDER), b"", || {
            Error::run(folder.display(), "another phylux is at work in this folder")
                .remedy("wait for its end, or name another folder")
        })?;
        // one that holds something is not ours
        held.kept = held.file.metadata().is_ok_and(|file| file.len() > 0);
        Ok(held)
    }

    fn unless_busy(path: &Path, content: &[u8], busy: impl Fn() -> Error) -> Result<Self> {
        let unwritable = |why: &dyn Display| {
            let problem = format!("cannot be written: {why}");
            Error::input(path.display(), problem).remedy("write elsewhere")
        };
        let place = writable_place(path)?;
        if place.exists() && !place.is_file() {
            return Err(unwritable(&"it is not a file"));
        }
        remove_leftovers(&folder_of(&place));
        let (file, kept) = loop {
            match File::options().read(true).write(true).open(&place) {
                // the file may go away or be replaced between the two steps
                Ok(file) if is_held(&file, &place) => break (file, true),
                Ok(file) if is_at(&file, &place) => return Err(busy()),
                Ok(_) => {}
                Err(e) if e.kind() == io::ErrorKind::NotFound => {
                    let begun = begin(&place, content).map_err(|e| unwritable(&e.kind()))?;
                    if let Some(file) = begun {
                        break (file, false);
                    }
                }
                Err(e) => return Err(unwritable(&e.kind())),
            }
        };
        Ok(Self { file, place, kept })
    }

    /// Removes the file.
    pub fn remove(mut self) {
        self.kept = false;
    }
}

impl Drop for HeldFile {
    /// Removes a file in which nothing is kept, unless somebody has put another one in its place.
    fn drop(&mut self) {
        if !self.kept && is_at(&self.file, &self.place) {
            let _ = fs::remove_file(&self.place);
        }
    }
}

/// Makes a file at `place` with this content; `None` if there is a file by now.
fn begin(place: &Path, content: &[u8]) -> io::Result<Option<File>> {
    let mut file = unfinished_file(&folder_of(place), None)?;
    file.write_all(content)?;
    match file.persist_noclobber(place) {
        Ok(file) => Ok(Some(file)),
        Err(e) if e.error.kind() == io::ErrorKind::AlreadyExists => Ok(None),
        Err(e) => Err(e.error),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_at_a_time_is_at_work_in_a_folder() {
        let folder = tempfile::tempdir().expect("a folder");
        let left = || fs::read_dir(folder.path()).expect("a folder").count();
        let held = HeldFile::folder(folder.path()).expect("free");
        let error = HeldFile::folder(folder.path()).unwrap_err().to_string();
        assert!(error.contains("another phylux is at work in this folder; wait"), "{error}");
        drop(held);
        assert_eq!(left(), 0);
        // what a process that was killed has left does not matter, and what is not ours stays
        for (content, after) in [("", 0), ("notes", 1)] {
            fs::write(folder.path().join(OF_FOLDER), content).expect("a file");
            drop(HeldFile::folder(folder.path()).expect("free"));
            assert_eq!(left(), after);
        }
    }
}
