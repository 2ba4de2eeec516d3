//! The work of a year: what has been found of its lights and its suns. A checkpoint grows as the
//! work goes on. The content of a record is the unit of the work, a line of JSON, and what was found
//! of it.

use std::{
    collections::BTreeMap,
    fs::File,
    io::{self, Write},
    ops::Range,
    path::{Path, PathBuf},
    sync::Mutex,
};

use serde::{Deserialize, Serialize};

use super::{
    held_file::HeldFile,
    work_file::{Work, WorkHead, WorkReader, WorkWriter},
};
use phylux_core::{
    error::{Error, Result, lock, setting},
    transport::{settings::Guiding, shard::Shard},
    words,
};

/// What is found of a unit of the work.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum UnitKind {
    /// The light that a light of the scene brings to all captors.
    Light,
    /// The light that comes straight from the suns of all hours to a captor.
    Captor,
}

/// A unit of the work of a year, which is done at once.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Unit {
    /// Index of the combination of states.
    pub part: u32,
    /// What is found.
    pub kind: UnitKind,
    /// Index of the light or captor.
    pub index: u64,
}

impl Unit {
    /// Returns the record of what was found of it.
    fn record(self, found: &[u8]) -> io::Result<Vec<u8>> {
        Ok([&serde_json::to_vec(&self)?, &b"\n"[..], found].concat())
    }

    /// Returns the unit of a record, and what was found of it.
    fn of(record: &[u8]) -> Option<(Self, &[u8])> {
        let end = record.iter().position(|byte| *byte == b'\n')?;
        Some((serde_json::from_slice(&record[..end]).ok()?, &record[end + 1..]))
    }
}

/// The settings that the light of a year depends on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct YearSettings {
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

/// A file with work of a year.
#[derive(Debug)]
pub struct YearWork {
    path: PathBuf,
    /// The year that it belongs to.
    pub head: WorkHead,
    /// The place of a checkpoint, without links.
    place: Option<PathBuf>,
    open: Mutex<Open>,
    /// The most bytes that it keeps.
    most: u64,
}

#[derive(Debug)]
struct Open {
    writer: WorkWriter<File>,
    /// Whether more was found than it keeps, so that it keeps nothing.
    is_full: bool,
    /// Where in the file is what was found of each unit.
    known: BTreeMap<Unit, Range<u64>>,
    /// The hold on a checkpoint.
    held: Option<HeldFile>,
}

impl YearWork {
    /// Opens the checkpoint at `path`, or begins it. What was cut short in it is forgotten. Errors:
    /// another process is at work on it; it cannot be written; it is of another year, or is none.
    pub fn checkpoint(path: &Path, head: WorkHead) -> Result<Self> {
        let failed = |e: io::Error| unread(path, &e);
        let begun = WorkWriter::begin(Vec::new(), &head).map_err(failed)?.writer;
        let held = HeldFile::open(path, &begun)?;
        let file = held.file.try_clone().map_err(failed)?;
        let reader = WorkReader::checkpoint(path, Work::Year, file)?;
        let remedy = "name another file, or remove this one, and the work begins anew";
        head.check(path, &reader.head, remedy)?;
        let place = Some(held.place.clone());
        let (open, _) = Open::read(reader, Some(held))?;
        open.writer.writer.set_len(open.writer.length).map_err(failed)?;
        Ok(Self { path: path.into(), head, place, open: Mutex::new(open), most: u64::MAX })
    }

    /// Begins a file without a name in `folder`, which is gone in the end in any case. It keeps at
    /// most so many bytes: where there is more, it keeps nothing.
    pub fn temporary(folder: &Path, head: WorkHead, most: u64) -> Result<Self> {
        let begun = tempfile::tempfile_in(folder).and_then(|file| WorkWriter::begin(file, &head));
        let writer = begun.map_err(|e| Error::unwritable(folder.display(), e))?;
        let open = Open { writer, is_full: false, known: BTreeMap::new(), held: None };
        Ok(Self { path: folder.into(), head, place: None, open: Mutex::new(open), most })
    }

    /// Opens a shard that is complete, and returns which one it is. Errors: it cannot be read, is no
    /// shard, or was cut short or changed.
    pub fn shard(path: &Path) -> Result<(Self, Shard)> {
        let reader = WorkReader::shard(path, Work::Year)?;
        let (head, shard, spoiled) = (reader.head.clone(), reader.shard, reader.spoiled());
        let (open, complete) = Open::read(reader, None)?;
        let open = Mutex::new(open);
        let own = Self { path: path.into(), head, place: None, open, most: u64::MAX };
        if complete { Ok((own, shard)) } else { Err(spoiled) }
    }

    /// Returns its path.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Returns the place of a checkpoint, without links.
    pub fn place(&self) -> Option<&Path> {
        self.place.as_deref()
    }

    /// Refuses the shard of another year than that of `head`.
    pub fn check(&self, head: &WorkHead) -> Result<()> {
        let remedy = "merge the shards of one year, with the files that they were traced with";
        head.check(&self.path, &self.head, remedy)
    }

    /// Returns what was found of a unit; `None` if it is not done. Error: the file cannot be read.
    pub fn get(&self, unit: Unit) -> Result<Option<Vec<u8>>> {
        let Open { writer, known, .. } = &mut *lock(&self.open);
        let Some(part) = known.get(&unit) else { return Ok(None) };
        writer.read(part.clone()).map(Some).map_err(|e| unread(&self.path, &e))
    }

    /// Adds what was found of a unit. Error: the file cannot be written.
    pub fn put(&self, unit: Unit, content: &[u8]) -> Result<()> {
        let Open { writer, is_full, known, held } = &mut *lock(&self.open);
        if *is_full || writer.length + content.len() as u64 > self.most {
            *is_full = true;
            known.clear();
            return writer.writer.set_len(0).map_err(|e| unread(&self.path, &e));
        }
        unit.record(content).and_then(|record| writer.put(&record)).map_err(|e| {
            let problem = format!("cannot be written: {e}");
            Error::run(self.path.display(), problem).remedy(words![
                "make room there; with ",
                setting("checkpoint"),
                " the same command goes on"
            ])
        })?;
        known.insert(unit, writer.length - content.len() as u64..writer.length);
        held.iter_mut().for_each(|held| held.kept = true);
        Ok(())
    }

    /// Writes all that is done as this shard, in the order of the units.
    pub fn write_shard(&self, shard: Shard, writer: &mut dyn Write) -> io::Result<()> {
        Self::write_all(&[self], &self.head.of_shard(shard), writer)
    }

    /// Writes what is done in several files of one year, in the order of the units.
    pub fn write_all(files: &[&Self], head: &WorkHead, writer: &mut dyn Write) -> io::Result<()> {
        let mut all = WorkWriter::begin(writer, head)?;
        let mut units = BTreeMap::new();
        for file in files {
            units.extend(lock(&file.open).known.keys().map(|unit| (*unit, *file)));
        }
        for (unit, file) in units {
            let Open { writer, known, .. } = &mut *lock(&file.open);
            let Some(part) = known.get(&unit) else { continue };
            all.put(&unit.record(&writer.read(part.clone())?)?)?;
        }
        all.end().map(drop)
    }

    /// Returns how many bytes of work it keeps; `None` if there was more than it was to keep.
    pub fn size(&self) -> Option<u64> {
        let Open { writer, is_full, .. } = &*lock(&self.open);
        (!is_full).then_some(writer.length)
    }

    /// Removes a checkpoint, once the tables are written.
    pub fn remove(&self) {
        if let Some(held) = lock(&self.open).held.take() {
            held.remove();
        }
    }
}

impl Open {
    /// Finds the records of a file up to the first that is not whole. Returns whether the file ends
    /// as a shard does.
    fn read(mut reader: WorkReader, mut held: Option<HeldFile>) -> Result<(Self, bool)> {
        let mut known = BTreeMap::new();
        let complete = loop {
            let Some(content) = reader.next_record()? else { break false };
            let Some((unit, found)) = Unit::of(&content) else { break content.is_empty() };
            known.insert(unit, reader.length - found.len() as u64..reader.length);
        };
        held.iter_mut().for_each(|held| held.kept = !known.is_empty());
        let path = reader.path.clone();
        let writer = reader.writer().map_err(|e| unread(&path, &e))?;
        Ok((Self { writer, is_full: false, known, held }, complete))
    }
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
            YearSettings { patches: 145, photons, seed: 1, guiding: Guiding::Off, sun_rays: 16 };
        WorkHead::new(Work::Year, "s.json".into(), "ab".into(), &settings)
    }

    fn unit(index: u64) -> Unit {
        Unit { part: 3, kind: UnitKind::Captor, index }
    }

    fn done(file: &YearWork) -> usize {
        lock(&file.open).known.len()
    }

    #[test]
    fn what_is_whole_is_kept() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("c");
        let checkpoint = YearWork::checkpoint(&path, head(9)).unwrap();
        checkpoint.put(unit(7), b"seven").unwrap();
        checkpoint.put(unit(1), b"").unwrap();
        let error = YearWork::checkpoint(&path, head(9)).unwrap_err().to_string();
        assert!(error.contains("another phylux is at work"), "{error}");
        drop(checkpoint);
        let error = YearWork::checkpoint(&path, head(8)).unwrap_err().to_string();
        assert!(error.contains("with other settings"), "{error}");
        // a record that was cut short is forgotten, and the next stands in its place
        let whole = fs::read(&path).unwrap();
        fs::write(&path, &whole[..whole.len() - 1]).unwrap();
        let checkpoint = YearWork::checkpoint(&path, head(9)).unwrap();
        assert_eq!((done(&checkpoint), checkpoint.get(unit(1)).unwrap()), (1, None));
        checkpoint.put(unit(2), b"two").unwrap();
        let get = |file: &YearWork, index| file.get(unit(index)).unwrap();
        assert_eq!(get(&checkpoint, 7), Some(b"seven".to_vec()));
        // the shard has the units in their order
        let mut bytes = Vec::new();
        checkpoint.write_shard(Shard::parse("2/3").unwrap(), &mut bytes).unwrap();
        let place = folder.path().join("s");
        fs::write(&place, &bytes).unwrap();
        let (shard, which) = YearWork::shard(&place).unwrap();
        assert_eq!((done(&shard), which.to_string()), (2, "2/3".into()));
        assert_eq!(get(&shard, 2), Some(b"two".to_vec()));
        assert!(shard.check(&head(9)).is_ok());
        assert!(WorkReader::shard(&place, Work::Run).is_err());
        drop((checkpoint, shard));
        let again = YearWork::checkpoint(&path, head(9)).unwrap();
        assert_eq!(done(&again), 2);
        again.remove();
        assert!(!path.exists());
        // a checkpoint without anything does not stay
        drop(YearWork::checkpoint(&path, head(9)).unwrap());
        assert!(!path.exists());
    }

    #[test]
    fn too_much_is_not_kept() {
        let folder = tempfile::tempdir().unwrap();
        let most = 2000;
        let file = YearWork::temporary(folder.path(), head(9), most).unwrap();
        file.put(unit(1), &[1; 400]).unwrap();
        assert!(file.size().unwrap() < most && file.get(unit(1)).unwrap().is_some());
        for index in 2..9 {
            file.put(unit(index), &[2; 400]).unwrap();
        }
        assert_eq!((file.size(), file.get(unit(1)).unwrap(), done(&file)), (None, None, 0));
    }

    /// Files that have the units of a year between them make the file that one of all makes.
    #[test]
    fn files_are_put_together() {
        let folder = tempfile::tempdir().unwrap();
        let begin = || YearWork::temporary(folder.path(), head(9), u64::MAX).unwrap();
        let (whole, odd, even) = (begin(), begin(), begin());
        for index in [5, 2, 9, 4] {
            whole.put(unit(index), &[index as u8; 20]).unwrap();
            let own = if index % 2 == 1 { &odd } else { &even };
            own.put(unit(index), &[index as u8; 20]).unwrap();
        }
        let bytes = |files: &[&YearWork]| {
            let mut bytes = Vec::new();
            YearWork::write_all(files, &head(9).of_shard(Shard::WHOLE), &mut bytes).unwrap();
            bytes
        };
        assert!(bytes(&[&whole]) == bytes(&[&odd, &even]));
    }

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

        /// A shard that was changed anywhere, or cut short, is refused.
        #[test]
        fn no_spoiled_shard_passes(at in 0usize..1000, byte: u8, cut: bool) {
            let folder = tempfile::tempdir().unwrap();
            let file = YearWork::temporary(folder.path(), head(9), u64::MAX).unwrap();
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
            match YearWork::shard(&path) {
                Ok(_) => prop_assert!(same && !cut),
                Err(error) => prop_assert!(error.to_string().contains("cut short"), "{error}"),
            }
        }
    }
}
