//! A tally as it travels: only what is not zero.

use serde::{Deserialize, Serialize};

use super::{Counts, Ledger, Tally};
use crate::math::stats::is_possible;

/// What a tally holds, channel by channel where anything was counted.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Sums {
    channels: Vec<u32>,
    photons: Vec<u64>,
    histories: Vec<u64>,
    /// Per channel and band.
    flux: Vec<f64>,
    segments: u64,
    cut_off: u64,
    ledger: Ledger,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    parts: Vec<Sums>,
}

/// The most that any count of a batch can be.
const MOST: u64 = 1 << 53;

impl Tally {
    /// Takes out all that it holds.
    pub fn take(&mut self) -> Sums {
        let mut channels = std::mem::take(&mut self.touched);
        channels.sort_unstable();
        let counts = |&c: &u32| {
            let mut counts = Counts::default();
            counts.add(&mut self.counts[c as usize]);
            (counts.photons, counts.histories)
        };
        let (photons, histories) = channels.iter().map(counts).unzip();
        let mut flux = Vec::with_capacity(channels.len() * self.bands);
        for &c in &channels {
            let all = &mut self.flux[c as usize * self.bands..][..self.bands];
            flux.extend(all.iter_mut().map(std::mem::take));
        }
        let mut ledger = self.ledger.clone();
        ledger.entries().into_iter().for_each(|entry| entry.fill(0.0));
        ledger.missed.clear();
        std::mem::swap(&mut ledger, &mut self.ledger);
        Sums {
            channels,
            photons,
            histories,
            flux,
            segments: std::mem::take(&mut self.segments),
            cut_off: std::mem::take(&mut self.cut_off),
            ledger,
            parts: self.parts.iter_mut().map(Self::take).collect(),
        }
    }

    /// Puts what another one of the same scene held into this one, which is empty. None, and anything in it, where
    /// that cannot be.
    pub fn fill(&mut self, sums: Sums) -> Option<()> {
        let Sums { channels, photons, histories, flux, segments, cut_off, ledger, parts } = sums;
        let mut counts = photons.iter().chain(&histories).chain([&segments, &cut_off]);
        let entries = |ledger: &Ledger| {
            [&ledger.emitted, &ledger.absorbed, &ledger.escaped, &ledger.lost].map(Vec::len)
        };
        let Ledger { emitted, absorbed, escaped, missed, lost } = &ledger;
        let possible = |powers: &Vec<f64>| powers.iter().all(|power| is_possible(*power));
        let fits = channels.is_sorted_by(|a, b| a < b)
            && channels.last().is_none_or(|last| (*last as usize) < self.counts.len())
            && photons.len() == channels.len()
            && histories.len() == channels.len()
            && flux.len() == channels.len() * self.bands
            && counts.all(|count| *count <= MOST)
            && [emitted, absorbed, escaped, missed, lost, &flux].into_iter().all(possible)
            && entries(&ledger) == entries(&self.ledger)
            && (missed.is_empty() || missed.len() == self.bands)
            && parts.len() == self.parts.len();
        if !fits {
            return None;
        }
        for (i, &channel) in channels.iter().enumerate() {
            let (c, bands) = (channel as usize, self.bands);
            self.counts[c].photons = photons[i];
            self.counts[c].histories = histories[i];
            self.flux[c * bands..][..bands].copy_from_slice(&flux[i * bands..][..bands]);
        }
        (self.touched, self.ledger) = (channels, ledger);
        (self.segments, self.cut_off) = (segments, cut_off);
        self.parts.iter_mut().zip(parts).try_for_each(|(part, sums)| part.fill(sums))
    }
}
