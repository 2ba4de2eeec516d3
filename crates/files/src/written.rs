//! The record of the tables and pictures that a command has written into a folder. The command may
//! remove or replace these files there, and no others. The record holds their names and SHA-256,
//! and is written before each file is put in its place.

use std::{
    collections::BTreeMap,
    fs::{self, File},
    io::{self, Write},
    path::{Component, Path, PathBuf},
    sync::Mutex,
};

use sha2::{Digest, Sha256};

use crate::{
    input::{hex, read_bytes},
    json,
    output::{CompleteFile, FilesRead, NOT_OURS, OpenFile, OutputFile},
    result_file::write_lines,
};
use phylux_core::error::{Error, Result, lock};

/// The record of what a command has written into a folder.
#[derive(Debug)]
pub struct Written {
    folder: PathBuf,
    /// Name of the file of the record.
    record: &'static str,
    /// What the user can do about a file that is not of the record.
    remedy: &'static str,
    /// Whether the folder held a record when it was opened.
    known: bool,
    /// SHA-256 of each file, by its name. While a file is replaced, the hash of what was there stands
    /// before that of what comes, with a space between them.
    hashes: Mutex<BTreeMap<String, String>>,
}

impl Written {
    /// Reads the record of this name in the folder `folder`; without one, it is empty. `remedy` says
    /// what to do about a file that is not of the record. Error: the file is no such record.
    pub fn read(folder: &Path, record: &'static str, remedy: &'static str) -> Result<Self> {
        let path = folder.join(record);
        let mut hashes = BTreeMap::new();
        let known = fs::symlink_metadata(&path).is_ok();
        if known {
            let name = path.display().to_string();
            let none = |why: String| {
                Error::input(&name, why).remedy("move it away, and the tables and plots too")
            };
            let value = json::parse(&name, &read_bytes(&path).map_err(none)?)?;
            hashes = serde_json::from_value(value)
                .map_err(|e| none(format!("does not say what phylux has written: {e}")))?;
            // whoever wrote the record, it must not name anything outside the folder
            hashes.retain(|name: &String, _: &mut String| {
                Path::new(name).components().all(|part| matches!(part, Component::Normal(_)))
            });
        }
        let folder = folder.to_path_buf();
        Ok(Self { folder, record, remedy, known, hashes: Mutex::new(hashes) })
    }

    /// Removes the files of the record. Error: there is another file at one of the places `needed`,
    /// or a file of the record has changed; then nothing is removed. The folder of an earlier
    /// version has no record. If `all` runs are done there, its tables can be made anew at once, so
    /// they stay and must then be the same.
    pub fn clear(&self, needed: &[String], all: bool) -> Result<()> {
        let mut hashes = lock(&self.hashes);
        let there = |name: &String| fs::symlink_metadata(self.folder.join(name)).is_ok();
        let known = hashes.iter().filter(|(name, _)| there(name));
        let (own, changed): (Vec<_>, Vec<_>) =
            known.partition(|(name, hashes)| self.is_own(name, hashes));
        let strange = needed.iter().filter(|name| !hashes.contains_key(*name) && there(name));
        if let Some(name) = changed.into_iter().map(|(name, _)| name).chain(strange).next()
            && (self.known || !all)
        {
            return Err(self.foreign(name));
        }
        for (name, _) in own {
            self.remove(name)?;
        }
        hashes.clear();
        self.remove(self.record)
    }

    /// Removes the file `name`, if it is there.
    fn remove(&self, name: &str) -> Result<()> {
        let path = self.folder.join(name);
        match fs::remove_file(&path) {
            Err(e) if e.kind() != io::ErrorKind::NotFound => {
                Err(Error::run(path.display(), format!("cannot be removed: {e}")))
            }
            _ => Ok(()),
        }
    }

    /// Begins to write the file `name`.
    pub fn create(&self, name: &str) -> Result<OwnFile<'_>> {
        let file = OutputFile::of_sweep(&self.folder.join(name))?.open(&FilesRead::default())?;
        Ok(OwnFile { written: self, name: name.into(), file, hash: Sha256::new() })
    }

    /// Begins to write the file `name`, which was prepared.
    pub fn begin(&self, name: &str, file: OpenFile) -> OwnFile<'_> {
        OwnFile { written: self, name: name.into(), file, hash: Sha256::new() }
    }

    /// Checks that the files `needed` may be written. Error: there is a file that is not of the
    /// record, or has changed since.
    pub fn check(&self, needed: &[String]) -> Result<()> {
        let hashes = lock(&self.hashes);
        let is_foreign = |name: &&String| {
            let own = || hashes.get(*name).is_some_and(|hashes| self.is_own(name, hashes));
            fs::symlink_metadata(self.folder.join(name)).is_ok() && !own()
        };
        needed.iter().find(is_foreign).map_or(Ok(()), |name| Err(self.foreign(name)))
    }

    /// Puts files in their places, which are all of the record from then on: whatever else it named
    /// is removed. Meanwhile the last of them is not there: readers take it for the sign that the
    /// others belong together. Error: there is a file that is not of the record.
    pub fn put(&self, files: Vec<CompleteOwn>) -> Result<()> {
        let names: Vec<String> = files.iter().map(|file| file.name.clone()).collect();
        self.check(&names)?;
        let old = lock(&self.hashes).clone();
        let mut both = old.clone();
        for CompleteOwn { name, hash, .. } in &files {
            both.entry(name.clone())
                .and_modify(|old| {
                    *old = self.hash(name).map_or(String::new(), |old| old + " ") + hash;
                })
                .or_insert_with(|| hash.clone());
        }
        self.record(both)?;
        if let Some(last) = names.last().filter(|last| old.contains_key(*last)) {
            self.remove(last)?;
        }
        let mut new = BTreeMap::new();
        for CompleteOwn { name, hash, file } in files {
            file.put()?;
            new.insert(name, hash);
        }
        for (name, hashes) in old.iter().filter(|(name, _)| !new.contains_key(*name)) {
            if self.is_own(name, hashes) {
                let _ = fs::remove_file(self.folder.join(name));
            }
        }
        self.record(new)
    }

    /// Writes the record anew.
    fn record(&self, new: BTreeMap<String, String>) -> Result<()> {
        let file = OutputFile::of_sweep(&self.folder.join(self.record))?;
        file.write(&FilesRead::default(), |writer| write_lines(&new, writer))?;
        *lock(&self.hashes) = new;
        Ok(())
    }

    /// Returns whether the file `name` holds what one of these hashes says.
    fn is_own(&self, name: &str, hashes: &str) -> bool {
        self.hash(name).is_some_and(|hash| hashes.split(' ').any(|own| own == hash))
    }

    /// Records that `name` is to hold content of this hash. Error: it holds something else.
    fn add(&self, name: &str, hash: String) -> Result<()> {
        let there = fs::symlink_metadata(self.folder.join(name)).is_ok();
        if there && self.hash(name).as_ref() != Some(&hash) {
            return Err(self.foreign(name));
        }
        let mut hashes = lock(&self.hashes);
        hashes.insert(name.into(), hash);
        let file = OutputFile::of_sweep(&self.folder.join(self.record))?;
        file.write(&FilesRead::default(), |writer| write_lines(&*hashes, writer))
    }

    /// Returns the SHA-256 of the file `name`; `None` if it is a link or cannot be read.
    fn hash(&self, name: &str) -> Option<String> {
        let path = self.folder.join(name);
        fs::symlink_metadata(&path).ok().filter(fs::Metadata::is_file)?;
        let mut hash = Sha256::new();
        io::copy(&mut File::open(path).ok()?, &mut HashWriter(&mut hash)).ok()?;
        Some(hex(hash))
    }

    fn foreign(&self, name: &str) -> Error {
        Error::input(self.folder.join(name).display(), NOT_OURS).remedy(self.remedy)
    }
}

/// A table or plot that is being written.
pub struct OwnFile<'a> {
    written: &'a Written,
    name: String,
    file: OpenFile,
    hash: Sha256,
}

impl OwnFile<'_> {
    /// Puts the file in its place. Error: there is something else, which is not of this sweep.
    pub fn finish(self) -> Result<()> {
        self.written.add(&self.name, hex(self.hash))?;
        self.file.finish(Ok(()))
    }

    /// Ends the content of the file, which does not have its place yet: [`Written::put`] gives it
    /// that. Error: it could not be written completely.
    pub fn complete(self) -> Result<CompleteOwn> {
        let file = self.file.complete(Ok(()))?;
        Ok(CompleteOwn { name: self.name, hash: hex(self.hash), file })
    }
}

/// A file that holds all of its content and waits for its place.
#[derive(Debug)]
pub struct CompleteOwn {
    name: String,
    hash: String,
    file: CompleteFile,
}

impl Write for OwnFile<'_> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let written = self.file.write(bytes)?;
        self.hash.update(&bytes[..written]);
        Ok(written)
    }
    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}

struct HashWriter<'a>(&'a mut Sha256);

impl Write for HashWriter<'_> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0.update(bytes);
        Ok(bytes.len())
    }
    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use phylux_testing::{check_error, spoiled};

    /// Records with the SHA-256 of the contents of [`OWN`] and of files outside the folder.
    const FILES: &[&str] = &[
        "{\n  \"captors.csv\": \"ca978112ca1bbdcafac231b39a23dc4da786eff8147c4e72b9807785afee48bb\",\n  \"plots/p.svg\": \"ca978112ca1bbdcafac231b39a23dc4da786eff8147c4e72b9807785afee48bb\"\n}\n",
        "{\"../outside\": \"3e23e8160039594a33894f6564e1b1348bbd7a0088d42c4acb73eeaed59c009d\", \"plots/../../outside\": \"3e23e8160039594a33894f6564e1b1348bbd7a0088d42c4acb73eeaed59c009d\"}",
    ];
    const WORDS: &[&str] = &[
        "{",
        "}",
        ":",
        "null",
        "[]",
        "\"\":",
        "\"/\":",
        "\"..\":",
        "\"plots\":",
        "\"notes\":",
        "\"\\u0000\":",
    ];
    const OWN: [&str; 2] = ["captors.csv", "plots/p.svg"];

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

        /// Any text leads to an error that names a file, or only files that the record names are
        /// removed.
        #[test]
        fn no_spoiled_record_panics(bytes in spoiled(FILES, WORDS), all: bool) {
            let above = tempfile::tempdir().expect("a temporary folder");
            let folder = above.path().join("sweep");
            fs::create_dir_all(folder.join("plots")).expect("a folder");
            for name in OWN {
                fs::write(folder.join(name), "a").expect("a file");
            }
            let others = [folder.join("notes"), above.path().join("outside")];
            for other in &others {
                fs::write(other, "b").expect("a file");
            }
            fs::write(folder.join("w.json"), &bytes).expect("a file");
            match Written::read(&folder, "w.json", "move it away") {
                Err(error) => check_error(&error, &folder.join("w.json")),
                Ok(written) => {
                    let said = lock(&written.hashes).clone();
                    let cleared = written.clear(&OWN.map(String::from), all);
                    for name in OWN {
                        assert!(folder.join(name).exists() || said.contains_key(name));
                        assert!(folder.join(name).exists() || cleared.is_ok());
                    }
                    cleared.unwrap_or_else(|error| check_error(&error, &folder));
                }
            }
            for other in &others {
                assert_eq!(fs::read(other).expect("not ours"), b"b");
            }
        }
    }
}
