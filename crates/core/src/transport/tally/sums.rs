//! The contents of a tally in the form in which they are sent and stored: only what is not zero.

use serde::{Deserialize, Serialize};

use super::{
    Ledger, Tally, Weighed,
    moments::{MomentSums, MomentTally},
};
use crate::math::stats::is_possible;

/// The contents of a tally, for each channel in which anything was counted.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Sums {
    pub(super) channels: Vec<u32>,
    pub(super) photons: Vec<u64>,
    pub(super) histories: Vec<u64>,
    /// Power per channel and band.
    pub(super) flux: Vec<f64>,
    /// Per channel: the sum of the powers that the histories brought, and the sum of the squares of
    /// these powers. Empty if they are not recorded.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(super) weighed: Vec<[f64; 2]>,
    pub(super) segments: u64,
    #[serde(default, skip_serializing_if = "is_zero")]
    pub(super) effort: u64,
    pub(super) cut_off: u64,
    pub(super) ledger: Ledger,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(super) parts: Vec<Sums>,
    /// The moments of the scene's parameters, if they were asked for.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) moments: Option<MomentSums>,
}

/// The largest possible value of a stored count.
pub(super) const MOST: u64 = 1 << 53;

fn is_zero(number: &u64) -> bool {
    *number == 0
}

impl Tally {
    /// Takes out everything that the tally holds, in the order of the channels.
    pub fn take(&mut self) -> Sums {
        let mut channels = self.touched.clone();
        channels.sort_unstable();
        let places: Vec<usize> = channels
            .iter()
            .map(|&c| std::mem::take(&mut self.places[c as usize]) as usize - 1)
            .collect();
        let counts = |&place: &usize| (self.counts[place].photons, self.counts[place].histories);
        let (photons, histories) = places.iter().map(counts).unzip();
        let flux = |&place: &usize| &self.flux[place * self.bands..][..self.bands];
        let flux = places.iter().flat_map(flux).copied().collect();
        let mut weighed = Vec::new();
        if let Some(all) = &mut self.weighed {
            all.iter_mut().for_each(Weighed::settle);
            weighed.extend(places.iter().map(|&place| all[place].before));
            all.clear();
        }
        self.touched.clear();
        self.counts.clear();
        self.flux.clear();
        let materials = self.ledger.absorbed.len() / self.bands;
        Sums {
            channels,
            photons,
            histories,
            flux,
            weighed,
            segments: std::mem::take(&mut self.segments),
            effort: std::mem::take(&mut self.effort),
            cut_off: std::mem::take(&mut self.cut_off),
            ledger: std::mem::replace(&mut self.ledger, Ledger::new(self.bands, materials)),
            parts: self.parts.iter_mut().map(Self::take).collect(),
            moments: self.moments.as_mut().map(MomentTally::take),
        }
    }

    /// Adds the contents of another tally of the same scene, of other histories.
    pub fn add_sums(&mut self, sums: &Sums) {
        for (i, &channel) in sums.channels.iter().enumerate() {
            let place = self.place(channel as usize);
            self.counts[place].photons += sums.photons[i];
            self.counts[place].histories += sums.histories[i];
            if let (Some(all), Some(theirs)) = (&mut self.weighed, sums.weighed.get(i)) {
                all[place].before.iter_mut().zip(theirs).for_each(|(a, b)| *a += b);
            }
            let mine = &mut self.flux[place * self.bands..][..self.bands];
            let theirs = &sums.flux[i * self.bands..][..self.bands];
            mine.iter_mut().zip(theirs).for_each(|(a, b)| *a += b);
        }
        self.segments += sums.segments;
        self.effort += sums.effort;
        self.cut_off += sums.cut_off;
        self.ledger.add(&sums.ledger, |_| 1.0);
        self.parts.iter_mut().zip(&sums.parts).for_each(|(part, sums)| part.add_sums(sums));
        self.moments.iter_mut().zip(&sums.moments).for_each(|(own, theirs)| own.add_sums(theirs));
    }

    /// Returns whether `sums` can be the contents of a tally of the same scene.
    pub fn fits(&self, sums: &Sums) -> bool {
        let Sums {
            channels,
            photons,
            histories,
            flux,
            weighed,
            segments,
            effort,
            cut_off,
            ledger,
            parts,
            moments,
        } = sums;
        let mut counts = photons.iter().chain(histories).chain([segments, effort, cut_off]);
        let entries = |ledger: &Ledger| {
            [&ledger.emitted, &ledger.absorbed, &ledger.escaped, &ledger.lost].map(Vec::len)
        };
        let Ledger { emitted, absorbed, escaped, missed, lost, chance } = ledger;
        let possible = |powers: &Vec<f64>| powers.iter().all(|power| is_possible(*power));
        channels.is_sorted_by(|a, b| a < b)
            && channels.last().is_none_or(|last| (*last as usize) < self.places.len())
            && photons.len() == channels.len()
            && histories.len() == channels.len()
            && flux.len() == channels.len() * self.bands
            && counts.all(|count| *count <= MOST)
            && (weighed.is_empty() || weighed.len() == channels.len())
            && weighed.iter().flatten().all(|sum| is_possible(*sum))
            && [emitted, absorbed, escaped, missed, lost, chance, flux].into_iter().all(possible)
            && entries(ledger) == entries(&self.ledger)
            && [missed, chance].into_iter().all(|list| [0, self.bands].contains(&list.len()))
            && parts.len() == self.parts.len()
            && self.parts.iter().zip(parts).all(|(part, sums)| part.fits(sums))
            && moments.is_some() == self.moments.is_some()
            && self.moments.iter().zip(moments).all(|(own, theirs)| own.fits(theirs))
    }
}
