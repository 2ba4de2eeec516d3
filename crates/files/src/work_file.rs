//! Files of work that is done, of a run (`run_work`) or of a year (`year_work`): a checkpoint holds
//! what is done so far, and a shard holds a share of the work and is complete. They are one format.
//!
//! A file begins with its head, a line of JSON, which says of which work it is. Then come records:
//! each is a line with its length (16 hexadecimal digits) and the SHA-256 of everything that has
//! been written up to its end, and then its content. A record without content ends the file.

use std::{
    fmt,
    fs::File,
    io::{self, BufRead, BufReader, Read, Seek, SeekFrom, Write},
    ops::Range,
    path::{Path, PathBuf},
};

use serde::{Deserialize, Serialize, de::DeserializeOwned};
use serde_json::Value;
use sha2::{Digest, Sha256};

use super::{input::hex, json};
use phylux_core::{
    error::{Error, Result, ToWords, call, setting},
    transport::shard::Shard,
    words,
};

/// The version of the files, of random numbers and of sums, and of their order. It is raised by one
/// when one of them changes, so that work from before and after the change is not put together.
pub const FORMAT: u32 = 10;
/// The version of phylux that writes the files.
pub const VERSION: &str = env!("CARGO_PKG_VERSION");
/// Says that a file was written by another [`FORMAT`].
pub const OTHER_FORMAT: &str = "was written by a phylux with other random numbers and counts";

/// What stands for the shard in a checkpoint.
const CHECKPOINT: &str = "checkpoint";
/// What a shard is called in messages.
const SHARD: &str = "shard";
/// The longest head, bytes.
const LONGEST: u64 = 1 << 20;
/// Digits of a length, and bytes of the line before a content.
const DIGITS: usize = 16;
const LINE: usize = DIGITS + 66;
/// The most bytes of a content that are read without a look at the memory that is left.
const SMALL: u64 = 1 << 20;

/// The kinds of work.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Work {
    /// A run of a scene.
    Run,
    /// A year, hour by hour.
    Year,
}

impl Work {
    fn name(self) -> &'static str {
        match self {
            Self::Run => "run",
            Self::Year => "year",
        }
    }
}

impl fmt::Display for Work {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// Says which work a file belongs to.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct WorkHead {
    phylux_work: Work,
    /// The index of the shard and the number of shards, `3/16`, or `checkpoint`.
    share: String,
    /// The version of the file, [`FORMAT`]; 0 if the file does not state it.
    #[serde(default)]
    pub format: u32,
    /// Version of phylux that wrote the file.
    pub phylux: String,
    /// Path of the scene file, as it was given; in a checkpoint of a run, the name of the scene.
    pub scene: String,
    /// Path of the control file of a year, as it was given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub control: Option<String>,
    /// SHA-256 of all files that were read; in a checkpoint of a run, of the scene made from them.
    pub inputs: String,
    /// The settings that the work depends on.
    pub settings: Value,
    /// What is to be written of a year.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tables: Option<TableSettings>,
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
    pub fn new(work: Work, scene: String, inputs: String, settings: &impl Serialize) -> Self {
        Self {
            phylux_work: work,
            share: CHECKPOINT.into(),
            format: FORMAT,
            phylux: VERSION.into(),
            scene,
            control: None,
            inputs,
            settings: serde_json::to_value(settings).unwrap_or_default(),
            tables: None,
        }
    }

    /// Makes the head of a shard of the same work.
    pub fn of_shard(&self, shard: Shard) -> Self {
        Self { share: shard.to_string(), ..self.clone() }
    }

    /// Returns the settings that the work depends on. Error: the shard at `path` has others than
    /// its work has.
    pub fn settings<S: DeserializeOwned>(&self, path: &Path) -> Result<S> {
        serde_json::from_value(self.settings.clone()).map_err(|_| self.no_settings(path))
    }

    /// Returns an error for settings that no such work has, in the shard at `path`.
    pub fn no_settings(&self, path: &Path) -> Error {
        let problem = format!("has settings that no {} has", self.phylux_work);
        Error::input(path.display(), problem).remedy("trace it again")
    }

    /// Refuses the file at `path`, whose head is `there`, if it belongs to other work than this.
    pub fn check(&self, path: &Path, there: &Self, remedy: impl ToWords) -> Result<()> {
        let work = self.phylux_work;
        let problem = match () {
            () if there.phylux != self.phylux => {
                format!("is of phylux {}, this is {}", there.phylux, self.phylux)
            }
            () if there.format != self.format => OTHER_FORMAT.into(),
            () if there.inputs != self.inputs => {
                let control = if work == Work::Year { " or control" } else { "" };
                format!("is of another scene{control}, or of other contents of its files")
            }
            () if there.settings != self.settings => {
                let (key, before, now) = difference(&there.settings, &self.settings);
                format!("is of a {work} with other settings: {key} was {before} and is {now}")
            }
            () => return Ok(()),
        };
        Err(Error::input(path.display(), problem).remedy(remedy))
    }
}

/// Returns the first setting that differs, and its values `there` and `here`.
fn difference<'a>(there: &'a Value, here: &'a Value) -> (&'a str, &'a Value, &'a Value) {
    let keys = here.as_object().into_iter().flatten();
    let mut other = keys.map(|(key, value)| (&**key, &there[key], value));
    other.find(|(_, there, here)| there != here).unwrap_or(("something else", there, here))
}

/// Returns the line before a content, and adds the record to the hash of what is before it.
fn line(hash: &mut Sha256, content: &[u8]) -> String {
    let length = format!("{:0DIGITS$x}", content.len());
    hash.update(&length);
    hash.update(content);
    format!("{length} {}\n", hex(hash.clone()))
}

/// Writes a file of work.
#[derive(Debug)]
pub struct WorkWriter<W> {
    pub writer: W,
    /// The hash of what is written, and its length in bytes.
    hash: Sha256,
    pub length: u64,
}

impl<W: Write> WorkWriter<W> {
    /// Begins a file with its head.
    pub fn begin(mut writer: W, head: &WorkHead) -> io::Result<Self> {
        let mut line = serde_json::to_vec(head)?;
        line.push(b'\n');
        writer.write_all(&line)?;
        let hash = Sha256::new_with_prefix(&line);
        Ok(Self { writer, hash, length: line.len() as u64 })
    }

    /// Adds a record with this content, which must not be empty.
    pub fn put(&mut self, content: &[u8]) -> io::Result<()> {
        let mut hash = self.hash.clone();
        self.writer.write_all(line(&mut hash, content).as_bytes())?;
        self.writer.write_all(content)?;
        self.hash = hash;
        self.length += (LINE + content.len()) as u64;
        Ok(())
    }

    /// Ends a file that is complete.
    pub fn end(mut self) -> io::Result<W> {
        self.put(&[])?;
        Ok(self.writer)
    }
}

impl WorkWriter<File> {
    /// Reads a part of what is written.
    pub fn read(&mut self, part: Range<u64>) -> io::Result<Vec<u8>> {
        let mut bytes = vec![0; (part.end - part.start) as usize];
        self.writer.seek(SeekFrom::Start(part.start))?;
        self.writer.read_exact(&mut bytes)?;
        self.writer.seek(SeekFrom::Start(self.length))?;
        Ok(bytes)
    }
}

/// Reads a file of work, record by record.
#[derive(Debug)]
pub struct WorkReader {
    pub path: PathBuf,
    pub head: WorkHead,
    /// Which shard it is; [`Shard::WHOLE`] of a checkpoint.
    pub shard: Shard,
    reader: BufReader<File>,
    /// The hash of what was read, and its length in bytes.
    hash: Sha256,
    pub length: u64,
    /// The length of the whole file, bytes.
    all: u64,
}

impl WorkReader {
    /// Opens the checkpoint of some work, which is the `file` at `path`. Errors: it cannot be read,
    /// or is something else.
    pub fn checkpoint(path: &Path, work: Work, file: File) -> Result<Self> {
        Self::open(path, (CHECKPOINT, work), Ok(file))
    }

    /// Opens a shard of some work. Errors: it cannot be read, or is something else.
    pub fn shard(path: &Path, work: Work) -> Result<Self> {
        Self::open(path, (SHARD, work), File::open(path))
    }

    fn open(path: &Path, wanted: (&'static str, Work), file: io::Result<File>) -> Result<Self> {
        let (share, work) = wanted;
        let refuse = |problem: String| {
            let remedy = match share {
                CHECKPOINT => "name a file that is not there, or that",
                _ => "name files that",
            };
            Error::input(path.display(), problem).remedy(words![
                remedy,
                " ",
                call(work.name()).with(setting(share)),
                " has written"
            ])
        };
        let none = |why: &dyn fmt::Display| refuse(format!("is no {share} of a {work}: {why}"));
        let unreadable = |e: io::Error| refuse(format!("cannot be read: {}", e.kind()));
        if !path.is_file() {
            return Err(none(&"it is not a file"));
        }
        let mut file = file.map_err(unreadable)?;
        file.rewind().map_err(unreadable)?;
        let all = file.metadata().map_err(unreadable)?.len();
        let mut reader = BufReader::with_capacity(1 << 16, file);
        let mut line = Vec::new();
        reader.by_ref().take(LONGEST).read_until(b'\n', &mut line).map_err(unreadable)?;
        let head: WorkHead =
            serde_json::from_slice(&line).map_err(|e| match serde_json::from_slice(&line) {
                Ok(Before { format }) if format != FORMAT => {
                    Error::input(path.display(), OTHER_FORMAT).remedy(anew(share))
                }
                _ if work == Work::Year => refuse(format!("does not tell of a year: {e}")),
                _ => none(&e),
            })?;
        let is = (if head.share == CHECKPOINT { CHECKPOINT } else { SHARD }, head.phylux_work);
        if is != wanted {
            return Err(none(&format!("it is a {} of a {}", is.0, is.1)));
        }
        let shard = match share {
            CHECKPOINT => Shard::WHOLE,
            _ => Shard::parse(&head.share).map_err(|why| none(&why))?,
        };
        let (hash, length) = (Sha256::new_with_prefix(&line), line.len() as u64);
        Ok(Self { path: path.into(), head, shard, reader, hash, length, all })
    }

    /// Reads the content of the next record; it is empty at the end of a complete file. `None` if
    /// the file was cut short or changed from there on. Error: the content takes more memory than is
    /// left.
    pub fn next_record(&mut self) -> Result<Option<Vec<u8>>> {
        let mut before = [0; LINE];
        if self.reader.read_exact(&mut before).is_err() {
            return Ok(None);
        }
        let digits = str::from_utf8(&before[..DIGITS]).unwrap_or_default();
        let Ok(size) = u64::from_str_radix(digits, 16) else { return Ok(None) };
        let left = self.all.saturating_sub(self.length + LINE as u64);
        // nothing comes after the end
        if size > left || (size == 0 && left > 0) {
            return Ok(None);
        }
        if size > SMALL {
            json::check_left(size).map_err(|why| Error::too_large(self.path.display(), why))?;
        }
        let mut content = vec![0; size as usize];
        let mut hash = self.hash.clone();
        let whole = self.reader.read_exact(&mut content).is_ok();
        if !whole || line(&mut hash, &content).as_bytes() != before {
            return Ok(None);
        }
        if size > 0 {
            self.hash = hash;
            self.length += LINE as u64 + size;
        }
        Ok(Some(content))
    }

    /// Goes on with the file after what was read. Error: its place there cannot be found.
    pub fn writer(self) -> io::Result<WorkWriter<File>> {
        let Self { reader, hash, length, .. } = self;
        let mut writer = reader.into_inner();
        writer.seek(SeekFrom::Start(length))?;
        Ok(WorkWriter { writer, hash, length })
    }

    /// Returns an error for a file that is not as it was written.
    pub fn spoiled(&self) -> Error {
        Error::input(self.path.display(), "was cut short or changed since it was written")
            .remedy(anew(&self.head.share))
    }
}

/// Says what to do about a file that is of no use.
fn anew(share: &str) -> &'static str {
    match share {
        CHECKPOINT => "remove it, and the run begins anew",
        _ => "trace this shard again",
    }
}

/// What the heads of files of before tell.
#[derive(Deserialize)]
struct Before {
    #[serde(alias = "phylux_checkpoint")]
    format: u32,
}

/// Gives a file of a run, whose lines were changed, the lengths and hashes that fit its records.
#[doc(hidden)]
pub fn sealed(text: &[u8]) -> Vec<u8> {
    let mut records =
        text.split_inclusive(|byte| *byte == b'\n').filter(|line| !line.starts_with(b"00000000"));
    let mut file = records.next().unwrap_or_default().to_vec();
    let mut hash = Sha256::new_with_prefix(&file);
    for content in records.chain([&[][..]]) {
        file.extend(line(&mut hash, content).into_bytes());
        file.extend(content);
    }
    file
}
