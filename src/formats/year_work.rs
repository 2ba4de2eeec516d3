//! Work files of a year: what has been found of its lights and its suns. A checkpoint grows as the
//! work goes on; a shard holds a share of the work and is complete.
//!
//! A file begins with a line of JSON. Each record after it has a kind (one byte), a part (4 bytes),
//! an index and a length (8 bytes each, all little-endian), its content, and the first 8 bytes of
//! the SHA-256 of all that. A shard ends with a record without content, whose index is the number of
//! the others.

use std::{
    collections::BTreeMap,
    fs::File,
    io::{self, BufRead, BufReader, Read, Seek, SeekFrom, Write},
    path::{Path, PathBuf},
    sync::{Mutex, MutexGuard, PoisonError},
};

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use super::{held_file::HeldFile, shard_file::VERSION};
use crate::{
    error::{Error, Result},
    transport::{settings::Guiding, shard::Shard},
};

/// The version of the files, of random numbers and of sums. It is raised by one when any of them
/// changes.
pub const FORMAT: u32 = 2;

/// What stands for the shard in a checkpoint.
const CHECKPOINT: &str = "checkpoint";
/// The longest line of a head, bytes.
const LONGEST: u64 = 1 << 20;
/// Bytes of a record before its content, and of the hash after it.
const BEFORE: usize = 21;
const HASH: usize = 8;
/// The most bytes of a content.
const MOST: u64 = 1 << 40;

/// What is found of a unit of the work.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum UnitKind {
    /// The light that a light of the scene brings to all captors.
    Light,
    /// The light that comes straight from the suns of all hours to a captor.
    Captor,
}

/// A unit of the work of a year, which is done at once.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Unit {
    /// Index of the combination of states.
    pub part: u32,
    /// What is found.
    pub kind: UnitKind,
    /// Index of the light or captor.
    pub index: u64,
}

/// Says which year a file belongs to.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct WorkHead {
    /// The index of the shard and the number of shards, `3/16`, or `checkpoint`.
    phylux_year: String,
    /// The version of the files, [`FORMAT`].
    format: u32,
    /// Version of phylux that wrote the file.
    phylux: String,
    /// Path of the scene file, as it was given.
    pub scene: String,
    /// Path of the control file, as it was given.
    pub control: Option<String>,
    /// SHA-256 of all files that were read.
    pub inputs: String,
    /// What the light depends on.
    pub settings: WorkSettings,
    /// What is to be written of it.
    pub tables: TableSettings,
}

/// The settings that the light of a year depends on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct WorkSettings {
    /// Number of patches of the sky.
    pub patches: u32,
    /// Number of photons.
    pub photons: u64,
    /// Seed of the random numbers.
    pub seed: u64,
    /// What guides photons.
    pub guiding: Guiding,
    /// Number of points of each captor from which the sun is looked for.
    pub sun_rays: u64,
}

/// The options of the tables of a year.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct TableSettings {
    /// Whose hours are written, if that was given.
    pub hours: Option<String>,
    /// Whether the tables are CSV.
    pub csv: bool,
    /// Whether there are results of months.
    pub results: bool,
}

impl WorkHead {
    /// Makes the head of a checkpoint.
    pub fn new(
        scene: &Path,
        control: Option<&Path>,
        inputs: String,
        settings: WorkSettings,
        tables: TableSettings,
    ) -> Self {
        Self {
            phylux_year: CHECKPOINT.into(),
            format: FORMAT,
            phylux: VERSION.into(),
            scene: scene.display().to_string(),
            control: control.map(|path| path.display().to_string()),
            inputs,
            settings,
            tables,
        }
    }

    /// Returns what is other in the head of another file of the same year; `None` if nothing is.
    fn differs(&self, other: &Self) -> Option<String> {
        Some(match () {
            () if other.phylux != self.phylux => {
                format!("is of phylux {}, this is {}", other.phylux, self.phylux)
            }
            () if other.format != self.format => {
                "was written by a phylux with other random numbers and counts".into()
            }
            () if other.inputs != self.inputs => {
                "is of another scene or control, or of other contents of its files".into()
            }
            () if other.settings != self.settings => "is of a year with other settings".into(),
            () => return None,
        })
    }

    fn line(&self) -> Result<Vec<u8>> {
        let mut line = serde_json::to_vec(self).map_err(|e| Error::run("year", e))?;
        line.push(b'\n');
        Ok(line)
    }
}

/// A work file.
#[derive(Debug)]
pub struct WorkFile {
    path: PathBuf,
    /// The year that it belongs to.
    pub head: WorkHead,
    /// The file, its length, and where the content of each unit is: its start and its length.
    open: Mutex<Open>,
    held: Option<HeldFile>,
}

#[derive(Debug)]
struct Open {
    file: File,
    end: u64,
    known: BTreeMap<Unit, (u64, u64)>,
}

impl WorkFile {
    /// Opens the checkpoint at `path`, or begins it. What was cut short in it is forgotten. Errors:
    /// another process is at work on it; it cannot be written; it is of another year, or is none.
    pub fn checkpoint(path: &Path, head: WorkHead) -> Result<Self> {
        let (held, _) = HeldFile::open(path, &head.line()?)?;
        let file = held.file.try_clone().map_err(|e| unread(path, &e))?;
        let (there, mut open, _) = read(path, file)?;
        if there.phylux_year != CHECKPOINT {
            return Err(none(path, "is no checkpoint, but a shard"));
        }
        if let Some(problem) = head.differs(&there) {
            return Err(Error::input(path.display(), problem)
                .remedy("name another file, or remove this one, and the work begins anew"));
        }
        open.file.set_len(open.end).map_err(|e| unread(path, &e))?;
        open.file.seek(SeekFrom::End(0)).map_err(|e| unread(path, &e))?;
        Ok(Self { path: path.into(), head, open: Mutex::new(open), held: Some(held) })
    }

    /// Begins a file without a name in `folder`, which is gone in the end in any case.
    pub fn temporary(folder: &Path, head: WorkHead) -> Result<Self> {
        let failed = |e: io::Error| Error::run(folder.display(), format!("cannot be written: {e}"));
        let mut file = tempfile::tempfile_in(folder).map_err(failed)?;
        let line = head.line()?;
        file.write_all(&line).map_err(failed)?;
        let open = Open { file, end: line.len() as u64, known: BTreeMap::new() };
        Ok(Self { path: folder.into(), head, open: Mutex::new(open), held: None })
    }

    /// Opens a shard that is complete, and returns its index and the number of shards. Errors: it
    /// cannot be read, is no shard, or was cut short or changed.
    pub fn shard(path: &Path) -> Result<(Self, Shard)> {
        if !path.is_file() {
            return Err(none(path, "is not a file"));
        }
        let file = File::open(path).map_err(|e| unread(path, &e))?;
        let (head, open, complete) = read(path, file)?;
        let shard = Shard::parse(&head.phylux_year)
            .map_err(|why| none(path, &format!("is no shard: {why}")))?;
        if !complete {
            return Err(Error::input(
                path.display(),
                "was cut short or changed since it was written",
            )
            .remedy("trace this shard again"));
        }
        Ok((Self { path: path.into(), head, open: Mutex::new(open), held: None }, shard))
    }

    /// Returns whether a file looks like a shard of a year.
    pub fn is_shard(path: &Path) -> bool {
        let mut begins = [0; 15];
        let read = File::open(path).and_then(|mut file| file.read_exact(&mut begins));
        read.is_ok() && begins == *b"{\"phylux_year\":"
    }

    /// Returns its path.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Returns the place of a checkpoint, without links.
    pub fn place(&self) -> Option<&Path> {
        self.held.as_ref().map(|held| held.place.as_path())
    }

    /// Refuses the file of another year than that of `head`.
    pub fn check(&self, head: &WorkHead) -> Result<()> {
        match head.differs(&self.head) {
            None => Ok(()),
            Some(problem) => Err(Error::input(self.path.display(), problem)
                .remedy("merge the shards of one year, with the files that they were traced with")),
        }
    }

    /// Returns how many units are done.
    pub fn done(&self) -> usize {
        self.lock().known.len()
    }

    /// Returns what was found of a unit; `None` if it is not done. Error: the file cannot be read.
    pub fn get(&self, unit: Unit) -> Result<Option<Vec<u8>>> {
        let mut open = self.lock();
        let Some(&(start, length)) = open.known.get(&unit) else { return Ok(None) };
        let content = open.content(start, length).map_err(|e| unread(&self.path, &e))?;
        let end = open.end;
        open.file.seek(SeekFrom::Start(end)).map_err(|e| unread(&self.path, &e))?;
        Ok(Some(content))
    }

    /// Adds what was found of a unit. Error: the file cannot be written.
    pub fn put(&self, unit: Unit, content: &[u8]) -> Result<()> {
        let kind = 1 + unit.kind as u8;
        let bytes = record(kind, unit.part, unit.index, content);
        let mut open = self.lock();
        open.file.write_all(&bytes).map_err(|e| {
            let problem = format!("cannot be written: {e}");
            Error::run(self.path.display(), problem)
                .remedy("make room there; with --checkpoint the same command goes on")
        })?;
        let start = open.end + BEFORE as u64;
        open.known.insert(unit, (start, content.len() as u64));
        open.end += bytes.len() as u64;
        Ok(())
    }

    /// Writes all that is done as this shard, in the order of the units.
    pub fn write_shard(&self, shard: Shard, writer: &mut dyn Write) -> io::Result<()> {
        let head = WorkHead { phylux_year: shard.to_string(), ..self.head.clone() };
        serde_json::to_writer(&mut *writer, &head)?;
        writer.write_all(b"\n")?;
        let mut open = self.lock();
        let known: Vec<(Unit, (u64, u64))> = open.known.iter().map(|(u, at)| (*u, *at)).collect();
        for (unit, (start, length)) in &known {
            let content = open.content(*start, *length)?;
            writer.write_all(&record(1 + unit.kind as u8, unit.part, unit.index, &content))?;
        }
        writer.write_all(&record(0, 0, known.len() as u64, &[]))
    }

    /// Removes a checkpoint, once the tables are written.
    pub fn remove(&self) {
        self.held.iter().for_each(HeldFile::remove);
    }

    fn lock(&self) -> MutexGuard<'_, Open> {
        self.open.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Drop for WorkFile {
    /// Removes a checkpoint that holds nothing.
    fn drop(&mut self) {
        if self.done() == 0 {
            self.remove();
        }
    }
}

impl Open {
    fn content(&mut self, start: u64, length: u64) -> io::Result<Vec<u8>> {
        let mut content = vec![0; length as usize];
        self.file.seek(SeekFrom::Start(start))?;
        self.file.read_exact(&mut content)?;
        Ok(content)
    }
}

fn record(kind: u8, part: u32, index: u64, content: &[u8]) -> Vec<u8> {
    let mut bytes = vec![kind];
    bytes.extend(part.to_le_bytes());
    bytes.extend(index.to_le_bytes());
    bytes.extend((content.len() as u64).to_le_bytes());
    bytes.extend(content);
    let hash = Sha256::digest(&bytes);
    bytes.extend(&hash[..HASH]);
    bytes
}

/// Reads the head of a file, and finds its records up to the first that is not whole. Returns
/// whether the file ends as a shard does.
fn read(path: &Path, mut file: File) -> Result<(WorkHead, Open, bool)> {
    let failed = |e: io::Error| unread(path, &e);
    file.rewind().map_err(failed)?;
    let length = file.metadata().map_err(failed)?.len();
    let mut reader = BufReader::with_capacity(1 << 16, file.try_clone().map_err(failed)?);
    let mut line = Vec::new();
    reader.by_ref().take(LONGEST).read_until(b'\n', &mut line).map_err(failed)?;
    let head: WorkHead = serde_json::from_slice(&line)
        .map_err(|e| none(path, &format!("does not tell of a year: {e}")))?;
    let mut end = line.len() as u64;
    let mut known = BTreeMap::new();
    let mut complete = false;
    let mut before = [0; BEFORE];
    while !complete && reader.read_exact(&mut before).is_ok() {
        let [part, index, content] = fields(&before);
        let size = (BEFORE + HASH) as u64 + content.min(MOST);
        if content > MOST || end + size > length {
            break;
        }
        let mut hash = Sha256::new_with_prefix(before);
        let (mut left, mut hashed) = (content, [0; HASH]);
        let whole = loop {
            let Ok(bytes) = reader.fill_buf() else { break false };
            if left == 0 || bytes.is_empty() {
                break left == 0;
            }
            let some = (bytes.len() as u64).min(left) as usize;
            hash.update(&bytes[..some]);
            reader.consume(some);
            left -= some as u64;
        };
        let whole = whole && reader.read_exact(&mut hashed).is_ok();
        if !whole || hash.finalize()[..HASH] != hashed {
            break;
        }
        let kind = match before[0] {
            1 => UnitKind::Light,
            2 => UnitKind::Captor,
            kind => {
                complete = kind == 0 && content == 0 && index == known.len() as u64;
                complete &= end + size == length;
                break;
            }
        };
        known.insert(Unit { part: part as u32, kind, index }, (end + BEFORE as u64, content));
        end += size;
    }
    Ok((head, Open { file, end, known }, complete))
}

/// Returns part, index and length of a record.
fn fields(before: &[u8; BEFORE]) -> [u64; 3] {
    let number = |bytes: &[u8]| bytes.iter().rev().fold(0, |sum, &byte| sum << 8 | u64::from(byte));
    [number(&before[1..5]), number(&before[5..13]), number(&before[13..])]
}

fn none(path: &Path, why: &str) -> Error {
    Error::input(path.display(), why)
        .remedy("name a file that `phylux year` has written with --shard or --checkpoint")
}

fn unread(path: &Path, e: &io::Error) -> Error {
    Error::input(path.display(), format!("cannot be read or written: {e}"))
}

#[cfg(test)]
mod tests {
    use std::fs;

    use proptest::prelude::*;

    use super::*;

    fn head(photons: u64) -> WorkHead {
        let settings =
            WorkSettings { patches: 145, photons, seed: 1, guiding: Guiding::Off, sun_rays: 16 };
        WorkHead::new(Path::new("s.json"), None, "ab".into(), settings, TableSettings::default())
    }

    fn unit(index: u64) -> Unit {
        Unit { part: 3, kind: UnitKind::Captor, index }
    }

    #[test]
    fn what_is_whole_is_kept() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("c");
        let checkpoint = WorkFile::checkpoint(&path, head(9)).unwrap();
        checkpoint.put(unit(7), b"seven").unwrap();
        checkpoint.put(unit(1), b"").unwrap();
        let error = WorkFile::checkpoint(&path, head(9)).unwrap_err().to_string();
        assert!(error.contains("another phylux is at work"), "{error}");
        drop(checkpoint);
        let error = WorkFile::checkpoint(&path, head(8)).unwrap_err().to_string();
        assert!(error.contains("with other settings"), "{error}");
        // a record that was cut short is forgotten, and the next stands in its place
        let whole = fs::read(&path).unwrap();
        fs::write(&path, &whole[..whole.len() - 1]).unwrap();
        let checkpoint = WorkFile::checkpoint(&path, head(9)).unwrap();
        assert_eq!((checkpoint.done(), checkpoint.get(unit(1)).unwrap()), (1, None));
        checkpoint.put(unit(2), b"two").unwrap();
        let get = |file: &WorkFile, index| file.get(unit(index)).unwrap();
        assert_eq!(get(&checkpoint, 7), Some(b"seven".to_vec()));
        // the shard has the units in their order
        let mut bytes = Vec::new();
        checkpoint.write_shard(Shard::parse("2/3").unwrap(), &mut bytes).unwrap();
        let place = folder.path().join("s");
        fs::write(&place, &bytes).unwrap();
        let (shard, which) = WorkFile::shard(&place).unwrap();
        assert_eq!((shard.done(), which.to_string()), (2, "2/3".into()));
        assert_eq!(get(&shard, 2), Some(b"two".to_vec()));
        assert!(WorkFile::is_shard(&place) && shard.check(&head(9)).is_ok());
        drop((checkpoint, shard));
        let again = WorkFile::checkpoint(&path, head(9)).unwrap();
        assert_eq!(again.done(), 2);
        again.remove();
        assert!(!path.exists());
        // a checkpoint without anything does not stay
        drop(WorkFile::checkpoint(&path, head(9)).unwrap());
        assert!(!path.exists());
    }

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

        /// A shard that was changed anywhere, or cut short, is refused.
        #[test]
        fn no_spoiled_shard_passes(at in 0usize..1000, byte: u8, cut: bool) {
            let folder = tempfile::tempdir().unwrap();
            let file = WorkFile::temporary(folder.path(), head(9)).unwrap();
            file.put(unit(7), b"seven").unwrap();
            file.put(unit(8), &[9; 40]).unwrap();
            let mut bytes = Vec::new();
            file.write_shard(Shard::WHOLE, &mut bytes).unwrap();
            let line = bytes.iter().position(|byte| *byte == b'\n').unwrap() + 1;
            let at = line + at % (bytes.len() - line);
            let same = bytes[at] == byte;
            match cut {
                true => bytes.truncate(at),
                false => bytes[at] = byte,
            }
            let path = folder.path().join("s");
            fs::write(&path, &bytes).unwrap();
            match WorkFile::shard(&path) {
                Ok(_) => prop_assert!(same && !cut),
                Err(error) => prop_assert!(error.to_string().contains("cut short"), "{error}"),
            }
        }
    }
}
