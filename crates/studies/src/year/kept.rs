//! What is kept of the work of a year, in checkpoints, in shards and in the folder of the year: rows
//! of values with their errors, without those that are zero.

use std::{
    io::{self, Write},
    path::{Path, PathBuf},
};

use phylux_core::{
    error::{Error, Result, call, setting},
    transport::shard::Shard,
    words,
};
use phylux_files::{
    work_file::WorkHead,
    year_work::{Unit, YearWork},
};

/// The most bytes of light that a folder of a year keeps unless it is asked to.
pub const USUAL_LIGHT: u64 = 256 << 20;
/// The file of it.
pub const LIGHT: &str = "light.work";

/// The light of sun, sky and lamps that the folder of a year keeps, from which a year with other
/// hours of its lamps is found without tracing any.
pub struct KeptLight<'a> {
    files: Vec<&'a YearWork>,
    head: WorkHead,
}

impl<'a> KeptLight<'a> {
    /// Takes what files hold of a year, whose head is `head`; `None` if it is more than `most`
    /// bytes.
    pub fn new(
        files: impl Iterator<Item = &'a YearWork>,
        head: &WorkHead,
        most: u64,
    ) -> Option<Self> {
        let files: Vec<&YearWork> = files.collect();
        let size = files.iter().map(|file| file.size()).sum::<Option<u64>>()?;
        (size <= most).then(|| Self { files, head: head.of_shard(Shard::WHOLE) })
    }

    pub(super) fn write(&self, writer: &mut dyn Write) -> io::Result<()> {
        YearWork::write_all(&self.files, &self.head, writer)
    }

    /// Returns the path of the light in the folder of a year. Error: it is no such folder, or has no
    /// light.
    pub fn path(folder: &Path) -> Result<PathBuf> {
        let path = folder.join(LIGHT);
        match (path.is_file(), folder.join("year.json").is_file()) {
            (true, _) => Ok(path),
            (false, true) => Err(Error::input(folder.display(), format!("holds no {LIGHT}"))
                .remedy(words![
                    "trace that year once more with ",
                    setting("keep_light").on(),
                    ": it was too large to be kept, or a phylux from before wrote it",
                ])),
            (false, false) => Err(Error::input(folder.display(), "holds no year").remedy(words![
                "name the folder that ",
                call("year"),
                " has written"
            ])),
        }
    }
}

/// Work that is done, and where more of it is kept.
#[derive(Clone, Copy, Default)]
pub struct Kept<'a> {
    /// Files with work that is done.
    pub done: &'a [YearWork],
    /// The file that takes what is done now.
    pub now: Option<&'a YearWork>,
}

impl Kept<'_> {
    /// Returns what was found of a unit: some counts, and a row of so many values. `None` if it is
    /// not done. Errors: a file cannot be read, or holds something else.
    pub(super) fn get(&self, unit: Unit, counts: usize, values: usize) -> Result<Option<Row>> {
        for file in self.done.iter().chain(self.now) {
            if let Some(bytes) = file.get(unit)? {
                return match Row::decode(&bytes, counts, values) {
                    Some(row) => Ok(Some(row)),
                    None => {
                        let problem = "does not fit its own scene and settings";
                        Err(Error::input(file.path().display(), problem)
                            .remedy("trace it again, or remove it"))
                    }
                };
            }
        }
        Ok(None)
    }

    /// Keeps what was found of a unit. Error: the file cannot be written.
    pub(super) fn put(&self, unit: Unit, counts: &[u32], values: &[[f32; 2]]) -> Result<()> {
        let Some(file) = self.now else { return Ok(()) };
        let mut bytes: Vec<u8> = counts.iter().flat_map(|count| count.to_le_bytes()).collect();
        encode(values, &mut bytes);
        file.put(unit, &bytes)
    }
}

/// Counts and values with their errors.
pub(super) struct Row {
    pub counts: Vec<u32>,
    pub values: Vec<[f32; 2]>,
}

/// Number of values that a bit stands for.
const TOGETHER: usize = 4;

/// Adds the bytes of values; of each few values that are all zero there is only a bit.
pub(super) fn encode(values: &[[f32; 2]], bytes: &mut Vec<u8>) {
    let is_there = |some: &[[f32; 2]]| some.iter().flatten().any(|value| value.to_bits() != 0);
    for eight in values.chunks(8 * TOGETHER) {
        let bits = eight.chunks(TOGETHER).zip(0..);
        bytes.push(bits.fold(0, |bits, (some, i)| bits | u8::from(is_there(some)) << i));
    }
    for some in values.chunks(TOGETHER).filter(|some| is_there(some)) {
        bytes.extend(some.iter().flatten().flat_map(|value| value.to_le_bytes()));
    }
}

/// Returns so many values by their bytes; `None` if these are no such values.
pub(super) fn decode(bytes: &[u8], values: usize) -> Option<Vec<[f32; 2]>> {
    let (bits, bytes) = bytes.split_at_checked(values.div_ceil(8 * TOGETHER))?;
    let (numbers, rest) = bytes.as_chunks();
    let mut numbers = numbers.iter().map(|bytes| f32::from_le_bytes(*bytes));
    let mut found = vec![[0.0; 2]; values];
    for (i, some) in found.chunks_mut(TOGETHER).enumerate() {
        if bits[i / 8] >> (i % 8) & 1 == 1 {
            for value in some.iter_mut().flatten() {
                *value = numbers.next()?;
            }
        }
    }
    (numbers.next().is_none() && rest.is_empty()).then_some(found)
}

impl Row {
    fn decode(bytes: &[u8], counts: usize, values: usize) -> Option<Self> {
        let (own, bytes) = bytes.split_at_checked(4 * counts)?;
        let counts = own.as_chunks().0.iter().map(|bytes| u32::from_le_bytes(*bytes)).collect();
        Some(Self { counts, values: decode(bytes, values)? })
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn rows_are_read_as_they_were_written(
            counts in prop::collection::vec(any::<u32>(), 0..5),
            values in prop::collection::vec(prop_oneof![Just([0f32; 2]), any::<[f32; 2]>()], 0..90),
        ) {
            let mut bytes: Vec<u8> = counts.iter().flat_map(|count| count.to_le_bytes()).collect();
            encode(&values, &mut bytes);
            let row = Row::decode(&bytes, counts.len(), values.len()).unwrap();
            prop_assert_eq!(&row.counts, &counts);
            let bits = |values: &[[f32; 2]]| -> Vec<u32> {
                values.iter().flatten().map(|v| v.to_bits()).collect()
            };
            prop_assert_eq!(bits(&row.values), bits(&values));
            // no bytes panic
            for length in 0..bytes.len() {
                prop_assert!(Row::decode(&bytes[..length], counts.len(), values.len()).is_none());
            }
        }
    }
}
