//! Work that is cut into fixed shards, one for each of several machines.

use std::{fmt, ops::Range};

use crate::transport::settings::Checked;

/// A shard: a fixed share of the runs of a sweep, or of the batches of a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shard {
    index: usize,
    of: usize,
}

impl Shard {
    /// The shard that holds everything.
    pub const WHOLE: Self = Self { index: 0, of: 1 };

    /// Reads text such as `3/16`, the third of sixteen shards. Error: the text does not have this
    /// form.
    pub fn parse(text: &str) -> Checked<Self> {
        let numbers =
            text.split_once('/').and_then(|(i, n)| Some((i.parse().ok()?, n.parse().ok()?)));
        match numbers {
            Some((index @ 1.., of)) if index <= of => Ok(Self { index: index - 1, of }),
            _ => Err("must be I/N with I from 1 to N, as in 3/16".into()),
        }
    }

    /// Returns whether the shard holds entry `index` of a list. Neighbouring entries, which take
    /// about the same time, are in different shards.
    pub fn holds(self, index: usize) -> bool {
        index % self.of == self.index
    }

    /// Returns the shard's range of `of` entries that must stay in order. The ranges of the shards
    /// differ in length by at most one.
    pub fn range(self, of: u64) -> Range<u64> {
        let border = |index: usize| (of as u128 * index as u128 / self.of as u128) as u64;
        border(self.index)..border(self.index + 1)
    }

    /// Index of the shard, from 0.
    pub fn index(self) -> usize {
        self.index
    }

    /// Number of shards.
    pub fn of(self) -> usize {
        self.of
    }
}

impl fmt::Display for Shard {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.index + 1, self.of)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_are_whole_and_alike() {
        for (of, shards) in [(128, 1), (128, 16), (128, 3), (5, 5), (2, 5)] {
            let shard = |index| Shard { index, of: shards };
            let ranges: Vec<Range<u64>> = (0..shards).map(|i| shard(i).range(of)).collect();
            assert_eq!((ranges[0].start, ranges[shards - 1].end), (0, of));
            assert!(ranges.windows(2).all(|pair| pair[0].end == pair[1].start));
            let lengths = || ranges.iter().map(|range| range.end - range.start);
            assert!(lengths().max().unwrap() - lengths().min().unwrap() <= 1);
        }
        assert_eq!(Shard::parse("3/16").unwrap().to_string(), "3/16");
    }
}
