//! The record of the tables and plots that a sweep has written into its folder. The sweep may
//! remove or replace these files there, and no others. The record holds their names and SHA-256,
//! and is written before each file is put in its place.

use std::{
    collections::BTreeMap,
    fs::{self, File},
    io::{self, Write},
    path::{Component, Path, PathBuf},
    sync::{Mutex, PoisonError},
};

use sha2::{Digest, Sha256};

use crate::{
    error::{Error, Result},
    formats::{
        input::{hex, read_bytes},
        json,
        output::{FilesRead, OpenFile, OutputFile},
        result_file::write_lines,
    },
};

/// Name of the file of the record.
const RECORD: &str = "written.json";

/// The record of what a sweep has written into its folder.
#[derive(Debug)]
pub struct Written {
    folder: PathBuf,
    /// Whether the folder held a record when it was opened.
    known: bool,
    /// SHA-256 of each file, by its name.
    hashes: Mutex<BTreeMap<String, String>>,
}

impl Written {
    /// Reads the record of the folder `folder`; without one, it is empty. Error: the file is no
    /// such record.
    pub fn read(folder: &Path) -> Result<Self> {
        let path = folder.join(RECORD);
        let mut hashes = BTreeMap::new();
        let known = fs::symlink_metadata(&path).is_ok();
        if known {
            let name = path.display().to_string();
            let none = |why: String| {
                Error::input(&name, why).remedy("move it away, and the tables and plots too")
            };
            let value = json::parse(&name, &read_bytes(&path).map_err(none)?)?;
            hashes = serde_json::from_value(value)
                .map_err(|e| none(format!("does not say what a sweep has written: {e}")))?;
            // whoever wrote the record, it must not name anything outside the folder
            hashes.retain(|name: &String, _: &mut String| {
                Path::new(name).components().all(|part| matches!(part, Component::Normal(_)))
            });
        }
        Ok(Self { folder: folder.to_path_buf(), known, hashes: Mutex::new(hashes) })
    }

    /// Removes the files of the record. Error: there is another file at one of the places `needed`,
    /// or a file of the record has changed; then nothing is removed. The folder of an earlier
    /// version has no record. If `all` runs are done there, its tables can be made anew at once, so
    /// they stay and must then be the same.
    pub fn clear(&self, needed: &[String], all: bool) -> Result<()> {
        let mut hashes = self.lock();
        let there = |name: &String| fs::symlink_metadata(self.folder.join(name)).is_ok();
        let known = hashes.iter().filter(|(name, _)| there(name));
        let (own, changed): (Vec<_>, Vec<_>) =
            known.partition(|(name, hash)| self.hash(name).as_ref() == Some(*hash));
        let strange = needed.iter().filter(|name| !hashes.contains_key(*name) && there(name));
        if let Some(name) = changed.into_iter().map(|(name, _)| name).chain(strange).next()
            && (self.known || !all)
        {
            return Err(self.foreign(name));
        }
        for (name, _) in own {
            let path = self.folder.join(name);
            fs::remove_file(&path)
                .map_err(|e| Error::run(path.display(), format!("cannot be removed: {e}")))?;
        }
        hashes.clear();
        match fs::remove_file(self.folder.join(RECORD)) {
            Err(e) if e.kind() != io::ErrorKind::NotFound => Err(Error::run(
                self.folder.join(RECORD).display(),
                format!("cannot be removed: {e}"),
            )),
            _ => Ok(()),
        }
    }

    /// Begins to write the file `name`.
    pub fn create(&self, name: &str) -> Result<OwnFile<'_>> {
        let file = OutputFile::of_sweep(&self.folder.join(name))?.open(&FilesRead::default())?;
        Ok(OwnFile { written: self, name: name.into(), file, hash: Sha256::new() })
    }

    /// Records that `name` is to hold content of this hash. Error: it holds something else.
    fn add(&self, name: &str, hash: String) -> Result<()> {
        let there = fs::symlink_metadata(self.folder.join(name)).is_ok();
        if there && self.hash(name).as_ref() != Some(&hash) {
            return Err(self.foreign(name));
        }
        let mut hashes = self.lock();
        hashes.insert(name.into(), hash);
        let file = OutputFile::of_sweep(&self.folder.join(RECORD))?;
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
        let problem = "is not what this sweep has written there";
        Error::input(self.folder.join(name).display(), problem)
            .remedy("move it away; the same command goes on from there")
    }

    fn lock(&self) -> std::sync::MutexGuard<'_, BTreeMap<String, String>> {
        self.hashes.lock().unwrap_or_else(PoisonError::into_inner)
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
    use crate::formats::spoil::{check_error, spoiled};

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
            fs::write(folder.join(RECORD), &bytes).expect("a file");
            match Written::read(&folder) {
                Err(error) => check_error(&error, &folder.join(RECORD)),
                Ok(written) => {
                    let said = written.lock().clone();
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
