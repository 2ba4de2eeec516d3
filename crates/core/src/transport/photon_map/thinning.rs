//! How far from the middle of its face an arrival can still count. A k-nearest estimate uses the
//! photons nearest to the middle of a face, a share of them that shrinks as they become more. So a
//! map that is made for such estimates alone keeps the nearest, and only counts the others.

use std::{collections::HashSet, ops::Range, sync::Arc};

use glam::Vec3;

use super::{Arrival, TaskArrivals};

/// From so many stored arrivals on, and whenever they have doubled, it is looked up which of them can
/// still count.
pub(super) const FIRST: usize = 1 << 14;
/// A face is thinned once so many photons have arrived there.
const MANY: usize = 1 << 10;
/// So many times the photons that the estimate takes at present are kept, and so many more. What it
/// takes in the end, of the photons of other tasks, too, then lies within: that fewer than a third of
/// those expected arrive in so small a part of a face has odds below 1e-20.
const TIMES: usize = 3;
const MORE: usize = 200;
/// Of these, so many times and so many more are kept for other machines. They do not depend on when
/// each thread was how far.
const FINAL_TIMES: f64 = 1.5;
const FINAL_MORE: usize = 75;

/// The least k that is chosen; it gives an error of 14 %.
const LEAST_K: usize = 50;

/// Returns the k for a face on which `photons` photons of `histories` histories arrived. Counted in
/// histories it is their number to the power 2/3, the law of the least mean square error in the
/// plane (Silverman, Density Estimation, 1986, 5.2), and at least [`LEAST_K`]. From 354 histories
/// on, the relative error and the fraction of the captor's area are then equal, histories^(-1/3).
/// Photons of the same history, such as copies made by splitting, are not independent, so they do
/// not count as several.
pub fn chosen_k(photons: usize, histories: usize) -> usize {
    let independent = (histories as f64).powf(2.0 / 3.0).round().max(LEAST_K as f64);
    (independent * photons as f64 / histories.max(1) as f64).ceil() as usize
}

/// Which arrivals at the faces of captors are stored: those that k-nearest estimates may use.
#[derive(Clone, Debug)]
pub struct Thinning {
    /// The first bin of the faces of each captor that has estimates, and their common middle, m
    /// relative to the centre of the scene; by rising bins.
    middles: Arc<[(u32, Vec3)]>,
    /// The number of photons that estimates take, if it is given.
    k: Option<usize>,
    /// For each bin [`NOWHERE`], [`EVERYWHERE`], or its index in `limited`.
    of: Arc<[u32]>,
    /// The bins that are thinned.
    limited: Arc<[Reach]>,
}

/// No estimate uses arrivals of this bin.
const NOWHERE: u32 = u32::MAX;
/// Any arrival of this bin may count.
const EVERYWHERE: u32 = u32::MAX - 1;

/// How far arrivals of a bin are kept.
#[derive(Clone, Copy, Debug)]
struct Reach {
    bin: u32,
    middle: Vec3,
    /// The square of the distance from the middle below which all arrivals are kept, m2.
    radius2: f32,
}

impl Reach {
    fn holds(&self, position: Vec3) -> bool {
        position.distance_squared(self.middle) < self.radius2
    }
}

/// The arrivals of a task at a face that is thinned, also those that are not kept.
#[derive(Clone, Copy, Debug)]
pub struct Seen {
    /// The bin of the face.
    pub bin: u32,
    /// The square of the distance below which they are kept, m2.
    pub radius2: f32,
    /// Their number.
    pub photons: u32,
    /// The number of histories that they belong to.
    pub histories: u32,
    last: u32,
}

impl Seen {
    /// Nothing so far.
    fn nothing(Reach { bin, radius2, .. }: &Reach) -> Self {
        Self { bin: *bin, radius2: *radius2, photons: 0, histories: 0, last: u32::MAX }
    }

    /// What was counted elsewhere.
    pub(super) fn of(bin: u32, radius2: f32, [photons, histories]: [u32; 2]) -> Self {
        Self { bin, radius2, photons, histories, last: u32::MAX }
    }

    /// Adds what another task has counted.
    pub(super) fn add(&mut self, other: &Self) {
        self.photons = self.photons.saturating_add(other.photons);
        self.histories = self.histories.saturating_add(other.histories);
    }

    /// Counts an arrival; those of a history follow each other.
    #[inline]
    fn count(&mut self, history: u32) {
        self.photons += 1;
        self.histories += u32::from(history != self.last);
        self.last = history;
    }
}

impl Thinning {
    /// Returns what estimates use of which `k` is given or, if `None`, is [chosen](chosen_k) by the
    /// number of photons. There are `bins` bins. `middles` holds, for each captor that has estimates,
    /// the bins of its faces and their middle, m relative to the centre of the scene; by rising bins.
    pub fn new(
        bins: usize,
        middles: impl Iterator<Item = (Range<usize>, Vec3)>,
        k: Option<usize>,
    ) -> Self {
        let mut of = vec![NOWHERE; bins];
        let first = |(faces, middle): (Range<usize>, Vec3)| {
            of[faces.clone()].fill(EVERYWHERE);
            (faces.start as u32, middle)
        };
        let middles = middles.map(first).collect();
        Self { middles, k, of: of.into(), limited: Arc::default() }
    }

    /// Returns the same before any face is thinned.
    pub(super) fn unlimited(&self) -> Self {
        let before = |&of: &u32| if of == NOWHERE { NOWHERE } else { EVERYWHERE };
        Self { of: self.of.iter().map(before).collect(), limited: Arc::default(), ..self.clone() }
    }

    /// Returns the counts of a task without arrivals, for the faces that are thinned.
    pub(super) fn nothing(&self) -> impl Iterator<Item = Seen> {
        self.limited.iter().map(Seen::nothing)
    }

    /// Returns whether estimates use arrivals of this bin.
    pub fn have(&self, bin: u32) -> bool {
        self.of.get(bin as usize).is_some_and(|&of| of != NOWHERE)
    }

    /// Returns whether an arrival is kept, and counts it in `seen` if its face is thinned.
    #[inline]
    pub(super) fn keep(&self, seen: &mut [Seen], bin: u32, position: Vec3, history: u32) -> bool {
        match self.of[bin as usize] {
            NOWHERE => false,
            EVERYWHERE => true,
            place => {
                seen[place as usize].count(history);
                self.limited[place as usize].holds(position)
            }
        }
    }

    /// Brings a task up to date: counts its arrivals at faces that are thinned since it was begun, and
    /// drops those that are too far away.
    pub(super) fn thin(&self, task: &mut TaskArrivals) {
        let mut all: Vec<Seen> = self.nothing().collect();
        let mut is_known = vec![false; all.len()];
        for own in std::mem::take(&mut task.seen) {
            if let Some(place) = self.place(own.bin) {
                all[place] = Seen { radius2: all[place].radius2, ..own };
                is_known[place] = true;
            }
        }
        task.retain(|Arrival { position, bin, photon }| match self.place(*bin) {
            None => true,
            Some(place) => {
                if !is_known[place] {
                    all[place].count(photon.history);
                }
                self.limited[place].holds(*position)
            }
        });
        all.retain(|seen| seen.photons > 0);
        task.seen = all;
    }

    /// Takes into account that a task, read from a file, was thinned elsewhere. Returns whether this
    /// changes what other tasks may keep.
    pub(super) fn join(&mut self, task: &TaskArrivals) -> bool {
        if task.seen.is_empty() {
            return false;
        }
        let mut limited = self.limited.to_vec();
        let mut of = self.of.to_vec();
        let mut changed = false;
        for seen in &task.seen {
            match of[seen.bin as usize] {
                NOWHERE => {}
                EVERYWHERE => {
                    of[seen.bin as usize] = limited.len() as u32;
                    let (bin, radius2) = (seen.bin, seen.radius2);
                    limited.push(Reach { bin, middle: self.middle(bin), radius2 });
                    changed = true;
                }
                place => {
                    let own = &mut limited[place as usize].radius2;
                    changed |= seen.radius2 < *own;
                    *own = own.min(seen.radius2);
                }
            }
        }
        if changed {
            (self.limited, self.of) = (limited.into(), of.into());
        }
        changed
    }

    /// Finds anew how far arrivals must be kept, from those of all tasks. `finally` keeps fewer: what
    /// the tasks together use in the end.
    pub(super) fn narrow<'t>(
        &mut self,
        tasks: impl Iterator<Item = &'t TaskArrivals> + Clone,
        finally: bool,
    ) {
        let mut count = vec![0; self.of.len()];
        for task in tasks.clone() {
            task.arrivals.iter().for_each(|arrival| count[arrival.bin as usize] += 1);
            task.seen.iter().for_each(|seen| count[seen.bin as usize] += seen.photons as usize);
        }
        let mut limited = self.limited.to_vec();
        let mut of = self.of.to_vec();
        for (bin, _) in count.iter().enumerate().filter(|(_, count)| **count >= MANY) {
            if of[bin] == EVERYWHERE {
                of[bin] = limited.len() as u32;
                let (bin, middle) = (bin as u32, self.middle(bin as u32));
                limited.push(Reach { bin, middle, radius2: f32::INFINITY });
            }
        }
        let mut near: Vec<Near> = limited.iter().map(|_| Near::default()).collect();
        for (t, task) in tasks.enumerate() {
            for seen in &task.seen {
                let Some(near) = near.get_mut(of[seen.bin as usize] as usize) else { continue };
                near.photons += seen.photons as usize;
                near.histories += seen.histories as usize;
            }
            for Arrival { position, bin, photon } in &task.arrivals {
                let place = of[*bin as usize] as usize;
                let Some(near) = near.get_mut(place) else { continue };
                let history = (t as u64) << 32 | u64::from(photon.history);
                // those of faces that are thinned already have been counted
                if place >= self.limited.len() {
                    near.photons += 1;
                    near.histories += usize::from(near.last != Some(history));
                    near.last = Some(history);
                }
                near.found.push((position.distance_squared(limited[place].middle), history));
            }
        }
        for (reach, near) in limited.iter_mut().zip(near) {
            reach.radius2 = reach.radius2.min(near.radius2(self.k, finally));
        }
        (self.limited, self.of) = (limited.into(), of.into());
    }

    fn place(&self, bin: u32) -> Option<usize> {
        let place = self.of[bin as usize] as usize;
        (place < self.limited.len()).then_some(place)
    }

    pub(super) fn middle(&self, bin: u32) -> Vec3 {
        let after = self.middles.partition_point(|(first, _)| *first <= bin);
        self.middles[after - 1].1
    }
}

/// What has arrived at a face so far.
#[derive(Default)]
struct Near {
    /// The square of the distance of each arrival that is kept from the middle, m2, and its history.
    found: Vec<(f32, u64)>,
    /// The number of all arrivals, and of the histories that they belong to.
    photons: usize,
    histories: usize,
    last: Option<u64>,
}

impl Near {
    /// Returns the square of the distance within which there are surely more photons, of more
    /// histories, than an estimate takes, m2; infinite if there are too few.
    fn radius2(mut self, k: Option<usize>, finally: bool) -> f32 {
        let enough = |count: usize| match finally {
            true => (FINAL_TIMES * count as f64) as usize + FINAL_MORE,
            false => TIMES * count + MORE,
        };
        let k = k.unwrap_or_else(|| chosen_k(self.photons, self.histories));
        // photons of one history are not independent
        let each = self.photons as f64 / self.histories.max(1) as f64;
        let (photons, histories) = (enough(k), enough((k as f64 / each).ceil() as usize));
        self.found.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let mut met = HashSet::new();
        for (i, (distance2, history)) in self.found.iter().enumerate() {
            met.insert(*history);
            if i >= photons && met.len() >= histories {
                return *distance2;
            }
        }
        f32::INFINITY
    }
}
