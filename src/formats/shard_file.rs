//! What a shard found, as a file: JSON, a line for the head, one for each batch and each task of
//! the photon map, and one for the end, so that it is read in little memory however large it is.

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
/// The version that wrote it.
pub const VERSION: &str = env!("CARGO_PKG_VERSION");

/// Goes up by one where random numbers or sums change, so that no shards of before and after are joined.
pub const FORMAT: u32 = 5;

/// What a shard is a shard of.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ShardHead {
    /// Which one: `3/16`.
    pub phylux_part: String,
    /// What its random numbers and sums are, [`FORMAT`]; 0 of those that do not say.
    #[serde(default)]
    pub format: u32,
    /// Version of phylux.
    pub phylux: String,
    /// The scene file, as it was named.
    pub scene: String,
    /// SHA-256 of it and of all files that it names.
    pub inputs: String,
    /// How it is run.
    pub settings: ShardSettings,
}

/// Settings that the results of a run depend on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ShardSettings {
    estimator: Estimator,
    photons: u64,
    seed: u64,
    k: Option<usize>,
    map_photons: usize,
    guiding: Guiding,
    by_light: bool,
    /// Why this estimator was chosen, if a trial did.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    chosen: Option<String>,
}

impl ShardSettings {
    /// Those of a run, whose estimator was chosen for a reason if it was.
    pub fn new(settings: &Settings, choice: Option<&Choice>) -> Self {
        let Settings { estimator, photons, seed, k, map_photons, guiding, by_light, .. } =
            *settings;
        let photons = photons.unwrap_or(Settings::DEFAULT_PHOTONS);
        let chosen = choice.map(|choice| choice.why.clone());
        Self { estimator, photons, seed, k, map_photons, guiding, by_light, chosen }
    }

    /// A run with them, on so many threads; none where a number is none that a run may have.
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

    /// Why its estimator was chosen, if it was.
    pub fn choice(&self) -> Option<Choice> {
        let why = self.chosen.clone()?;
        Some(Choice { estimator: self.estimator, why })
    }
}

/// A line behind the head.
#[derive(Debug, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Line {
    /// The sums of a batch.
    #[serde(rename = "block")]
    Batch {
        /// Its index.
        index: u64,
        /// What was counted.
        sums: Box<Sums>,
    },
    /// Arrivals on captors.
    #[serde(rename = "piece")]
    TaskArrivals {
        /// The task that found them.
        key: TaskKey,
        /// The arrivals, packed.
        words: Vec<u32>,
    },
    /// The first task whose arrivals no longer fit into the map.
    Full {
        /// That task.
        key: TaskKey,
    },
    /// Nothing comes after it.
    End {
        /// Hash of all before this line.
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

/// The last line, behind lines of this hash.
pub(super) fn end(before: Sha256) -> io::Result<Vec<u8>> {
    let mut line = serde_json::to_vec(&Line::End { sha256: hex(before) })?;
    line.push(b'\n');
    Ok(line)
}

/// A file of a shard, read line by line.
pub struct ShardReader {
    path: PathBuf,
    reader: BufReader<File>,
    hash: Sha256,
    /// What it is of.
    pub head: ShardHead,
    /// Which shard it is.
    pub shard: Shard,
}

impl ShardReader {
    /// Opens the file at `path`. Errors: it cannot be read, or is no part of a run.
    pub fn open(path: &Path) -> Result<Self> {
        let fail = |why: &dyn Display| Error::input(path.display(), why);
        let none = |why: &dyn Display| {
            fail(&format!("is no part of a run: {why}"))
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

    /// Where it is.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The next line; the end comes once, and only if the whole file is as it was written.
    pub fn next(&mut self) -> Result<Line> {
        let spoiled = || {
            Error::input(self.path.display(), "was cut short or changed since it was written")
                .remedy("trace this part again")
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

    /// An error in it that no reader of lines can see.
    pub fn does_not_fit(&self) -> Error {
        Error::input(self.path.display(), "does not fit its own scene and settings")
            .remedy("trace this part again")
    }
}

/// The next line, with its end, which is hashed.
pub(super) fn line(reader: &mut BufReader<File>, hash: &mut Sha256) -> io::Result<Vec<u8>> {
    let mut line = Vec::new();
    reader.take(LONGEST).read_until(b'\n', &mut line)?;
    hash.update(&line);
    Ok(line)
}
