//! Shard files: what one shard of a run has counted.
//!
//! The file is JSON by lines: one line for the head, one for each batch and one for each task of
//! the photon map, and one for the end. It can therefore be read with little memory, however large
//! it is.

use std::{
    fmt::Display,
    fs::File,
    io::{self, BufRead, BufReader, Read, Write},
    path::{Path, PathBuf},
};

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use crate::{
    error::{Error, Result},
    formats::{input::hex, json},
    transport::{
        photon_map::TaskKey,
        settings::{Estimator, Guiding, Settings},
        shard::Shard,
        simulate::{Choice, ShardSums},
        tally::Sums,
    },
};

/// The longest line that is read, bytes.
const LONGEST: u64 = 1 << 30;
/// The version of phylux that writes the files.
pub const VERSION: &str = env!("CARGO_PKG_VERSION");

/// The version of random numbers and sums, and of their order. It is raised by one when one of them
/// changes, so that shards from before and after the change are not joined.
pub const FORMAT: u32 = 7;

/// Says which run a shard belongs to.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ShardHead {
    /// The index of the shard and the number of shards: `3/16`.
    pub phylux_part: String,
    /// The version of random numbers and sums, [`FORMAT`]; 0 for files that do not state it.
    #[serde(default)]
    pub format: u32,
    /// Version of phylux that wrote the file.
    pub phylux: String,
    /// Path of the scene file, as it was given.
    pub scene: String,
    /// SHA-256 of the scene file and of all files that it names.
    pub inputs: String,
    /// Settings of the run.
    pub settings: ShardSettings,
}

/// The settings that the results of a run depend on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ShardSettings {
    estimator: Estimator,
    photons: u64,
    seed: u64,
    k: Option<usize>,
    map_photons: usize,
    guiding: Guiding,
    by_light: bool,
    /// The reason why this estimator was chosen, if a trial chose it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    chosen: Option<String>,
}

impl ShardSettings {
    /// Takes the settings of a run, and the reason for its estimator if a trial chose it.
    pub fn new(settings: &Settings, choice: Option<&Choice>) -> Self {
        let Settings { estimator, photons, seed, k, map_photons, guiding, by_light, .. } =
            *settings;
        let photons = photons.unwrap_or(Settings::DEFAULT_PHOTONS);
        let chosen = choice.map(|choice| choice.why.clone());
        Self { estimator, photons, seed, k, map_photons, guiding, by_light, chosen }
    }

    /// Returns the settings of a run on so many threads, or `None` if they contain a value that no
    /// run may have.
    pub fn settings(&self, threads: usize) -> Option<Settings> {
        let Self { estimator, photons, seed, k, map_photons, guiding, by_light, .. } = *self;
        if estimator == Estimator::Auto || guiding == Guiding::Auto {
            return None;
        }
        let photons = Some(Settings::check_photons(photons).ok()?);
        let k = k.map(|k| Settings::check_k(k as u64)).transpose().ok()?;
        let map_photons = Settings::check_map_photons(map_photons as u64).ok()?;
        let own = Settings {
            estimator,
            photons,
            seed,
            k,
            map_photons,
            guiding,
            by_light,
            threads,
            ..Settings::default()
        };
        Some(own)
    }

    /// Returns the choice of the estimator, if a trial chose it.
    pub fn choice(&self) -> Option<Choice> {
        let why = self.chosen.clone()?;
        Some(Choice { estimator: self.estimator, why })
    }
}

/// A line after the head.
#[derive(Debug, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Line {
    /// The sums of one batch.
    #[serde(rename = "block")]
    Batch {
        /// Index of the batch.
        index: u64,
        /// The counts of the batch.
        sums: Box<Sums>,
    },
    /// Arrivals on captors, for the photon map.
    #[serde(rename = "piece")]
    TaskArrivals {
        /// The task that found the arrivals.
        key: TaskKey,
        /// The arrivals, packed.
        words: Vec<u32>,
    },
    /// States that the arrivals of this task and of those after it no longer fit into the photon
    /// map.
    Full {
        /// The first task whose arrivals no longer fit.
        key: TaskKey,
    },
    /// The last line.
    End {
        /// Hash of everything before this line.
        sha256: String,
    },
}

/// Writes a shard.
pub fn write_shard(
    head: &ShardHead,
    shard_sums: ShardSums,
    writer: &mut dyn Write,
) -> io::Result<()> {
    let mut hash = Sha256::new();
    let mut line = |value: Vec<u8>| {
        hash.update(&value);
        hash.update(b"\n");
        writer.write_all(&value)?;
        writer.write_all(b"\n")
    };
    line(serde_json::to_vec(head)?)?;
    for (index, sums) in shard_sums.batches {
        line(serde_json::to_vec(&Line::Batch { index, sums: Box::new(sums) })?)?;
    }
    for (key, task) in shard_sums.tasks {
        line(serde_json::to_vec(&Line::TaskArrivals { key, words: task.words() })?)?;
    }
    if let Some(key) = shard_sums.end {
        line(serde_json::to_vec(&Line::Full { key })?)?;
    }
    writer.write_all(&end(hash)?)
}

/// Returns the last line of a file; `before` is the hash of the lines before it.
pub(super) fn end(before: Sha256) -> io::Result<Vec<u8>> {
    let mut line = serde_json::to_vec(&Line::End { sha256: hex(before) })?;
    line.push(b'\n');
    Ok(line)
}

/// A shard file that is read line by line.
pub struct ShardReader {
    path: PathBuf,
    reader: BufReader<File>,
    hash: Sha256,
    /// The run that the shard belongs to.
    pub head: ShardHead,
    /// The index of the shard and the number of shards.
    pub shard: Shard,
}

impl ShardReader {
    /// Opens the file at `path` and reads its head. Errors: the file cannot be read, or is not a
    /// shard.
    pub fn open(path: &Path) -> Result<Self> {
        let fail = |why: &dyn Display| Error::input(path.display(), why);
        let none = |why: &dyn Display| {
            fail(&format!("is no shard of a run: {why}"))
                .remedy("name files that `phylux run --shard` has written")
        };
        let unreadable = |e: io::Error| fail(&format!("cannot be read: {}", e.kind()));
        if !path.is_file() {
            return Err(none(&"it is not a file"));
        }
        let mut reader = BufReader::new(File::open(path).map_err(unreadable)?);
        let mut hash = Sha256::new();
        let line = line(&mut reader, &mut hash).map_err(unreadable)?;
        let head: ShardHead = serde_json::from_slice(&line).map_err(|e| none(&e))?;
        let shard = Shard::parse(&head.phylux_part).map_err(|why| none(&why))?;
        Ok(Self { path: path.to_path_buf(), reader, hash, head, shard })
    }

    /// Returns the path of the file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Reads the next line. [`Line::End`] is returned once, and only if the whole file is as it was
    /// written. Error: the file was damaged, or a line takes more memory than is left.
    pub fn next(&mut self) -> Result<Line> {
        let spoiled = || {
            Error::input(self.path.display(), "was cut short or changed since it was written")
                .remedy("trace this shard again")
        };
        let before = self.hash.clone();
        let bytes = line(&mut self.reader, &mut self.hash).map_err(|_| spoiled())?;
        let place = self.path.display();
        json::check_memory(&bytes).map_err(|why| Error::input(place, why))?;
        let line = serde_json::from_slice(&bytes).map_err(|_| spoiled())?;
        if let Line::End { .. } = line {
            let last = self.reader.fill_buf().is_ok_and(<[u8]>::is_empty);
            let whole = last && end(before).is_ok_and(|end| end == bytes);
            return if whole { Ok(line) } else { Err(spoiled()) };
        }
        Ok(line)
    }

    /// Returns an error for content that the reader accepts line by line but that does not fit the
    /// scene and settings of the run.
    pub fn does_not_fit(&self) -> Error {
        Error::input(self.path.display(), "does not fit its own scene and settings")
            .remedy("trace this shard again")
    }
}

/// Reads the next line, including its line end, and adds it to the hash.
pub(super) fn line(reader: &mut BufReader<File>, hash: &mut Sha256) -> io::Result<Vec<u8>> {
    let mut line = Vec::new();
    reader.take(LONGEST).read_until(b'\n', &mut line)?;
    hash.update(&line);
    Ok(line)
}
