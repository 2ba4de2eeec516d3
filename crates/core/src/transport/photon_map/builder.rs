//! Collects arrivals task by task.

use std::collections::BTreeMap;

use glam::Vec3;

use super::{Arrival, PackedDirection, PhotonMap, StoredPhoton, Way};

/// Identifies a task of histories in a run by round, task within the batch, and batch. Keys are
/// ordered so that every batch has its first task before any batch has its second.
pub type TaskKey = (u64, u64, u64);

/// Number of words that an arrival takes, without its powers.
const WORDS: usize = 8;

/// The arrivals of one task, in order, and their powers per band.
#[derive(Clone, Debug, Default)]
pub struct TaskArrivals {
    arrivals: Vec<Arrival>,
    power: Vec<f32>,
    ways: Vec<Way>,
}

impl TaskArrivals {
    /// Returns everything as whole numbers; floating-point numbers become their bits.
    pub fn words(&self) -> Vec<u32> {
        let bands = self.power.len() / self.arrivals.len().max(1);
        let mut words = Vec::with_capacity(self.arrivals.len() * (WORDS + bands));
        for (i, Arrival { position, bin, photon }) in self.arrivals.iter().enumerate() {
            words.extend(position.to_array().map(f32::to_bits));
            let StoredPhoton { direction, triangle, light, history } = photon;
            words.extend([*bin, direction.bits(), *triangle, *light, *history]);
            words.extend(self.power[i * bands..][..bands].iter().map(|power| power.to_bits()));
        }
        words
    }

    /// Reads the [`words`](Self::words) of photons with `bands` powers each. `None` if the words do
    /// not make up whole arrivals, or a position or power is not finite.
    pub fn from_words(words: &[u32], bands: usize) -> Option<Self> {
        if !words.len().is_multiple_of(WORDS + bands) {
            return None;
        }
        let mut task = Self::default();
        for arrival in words.chunks(WORDS + bands) {
            let position = Vec3::from([0, 1, 2].map(|i| f32::from_bits(arrival[i])));
            let [bin, direction, triangle, light, history] = [3, 4, 5, 6, 7].map(|i| arrival[i]);
            let direction = PackedDirection::from_bits(direction);
            let photon = StoredPhoton { direction, triangle, light, history };
            task.arrivals.push(Arrival { position, bin, photon });
            task.power.extend(arrival[WORDS..].iter().map(|bits| f32::from_bits(*bits)));
        }
        let finite = task.arrivals.iter().all(|arrival| arrival.position.is_finite());
        (finite && task.power.iter().all(|power| power.is_finite())).then_some(task)
    }

    /// Returns the arrivals, in order.
    pub fn arrivals(&self) -> &[Arrival] {
        &self.arrivals
    }

    /// Stores an arrival, unless more than `limit` are stored already.
    #[inline]
    pub fn push(&mut self, limit: usize, arrival: Arrival, power: impl Iterator<Item = f32>) {
        if self.arrivals.len() <= limit {
            self.arrivals.push(arrival);
            self.power.extend(power);
        }
    }

    /// Stores the way by which the arrival came that has just been stored.
    #[inline]
    pub fn came(&mut self, way: Way) {
        self.ways.resize(self.arrivals.len(), way);
    }
}

/// Collects the arrivals of tasks, in any order of the tasks. It keeps those of the first histories
/// that fit, whatever that order is.
#[derive(Debug)]
pub struct MapBuilder {
    limit: usize,
    bands: usize,
    tasks: BTreeMap<TaskKey, TaskArrivals>,
    stored: usize,
    /// The first task that no longer fits.
    end: Option<TaskKey>,
}

impl MapBuilder {
    /// Returns a builder of a map that holds at most `limit` arrivals of `bands` bands.
    pub fn new(limit: usize, bands: usize) -> Self {
        Self { limit, bands, tasks: BTreeMap::new(), stored: 0, end: None }
    }

    /// Returns the most arrivals that are kept.
    pub fn limit(&self) -> usize {
        self.limit
    }

    /// Returns the bytes that the arrivals take that are kept so far.
    pub fn bytes(&self) -> u64 {
        self.stored as u64 * Self::arrival_bytes(self.bands)
    }

    /// Returns the bytes that an arrival takes in so many bands.
    pub fn arrival_bytes(bands: usize) -> u64 {
        (size_of::<Arrival>() + size_of::<Way>() + bands * size_of::<f32>()) as u64
    }

    /// Returns whether arrivals of this task may still be kept.
    pub fn wants(&self, key: TaskKey) -> bool {
        self.end.is_none_or(|end| key < end)
    }

    /// Adds the arrivals of a task.
    pub fn add(&mut self, key: TaskKey, task: TaskArrivals) {
        if task.arrivals.is_empty() || !self.wants(key) {
            return;
        }
        self.stored += task.arrivals.len();
        self.tasks.insert(key, task);
        while let Some(last) = self.tasks.last_entry() {
            let rest = self.stored - last.get().arrivals.len();
            if rest <= self.limit {
                break;
            }
            self.stored = rest;
            self.end = Some(last.remove_entry().0);
        }
    }

    /// Returns the tasks that are kept so far, in order.
    pub fn tasks(&self) -> &BTreeMap<TaskKey, TaskArrivals> {
        &self.tasks
    }

    /// Returns the first task that no longer fits.
    pub fn end(&self) -> Option<TaskKey> {
        self.end
    }

    /// Returns the tasks that are kept so far, in order, and the first task that no longer fits.
    pub fn into_pieces(self) -> (BTreeMap<TaskKey, TaskArrivals>, Option<TaskKey>) {
        (self.tasks, self.end)
    }

    /// Takes into account that task `end` no longer fits, as found by another builder, which has
    /// seen only some of the tasks.
    pub fn end_at(&mut self, end: TaskKey) {
        self.end = Some(self.end.map_or(end, |own| own.min(end)));
    }

    /// Makes the map of the first histories of the run. `histories` returns how many histories come
    /// before a task; `all` is the number of all histories.
    pub fn build(self, all: u64, histories: impl Fn(TaskKey) -> u64) -> PhotonMap {
        let mut arrivals = Vec::with_capacity(self.stored.min(self.limit));
        let mut power = Vec::with_capacity(arrivals.capacity() * self.bands);
        let mut ways = Vec::new();
        let mut count = self.end.map_or(all, &histories);
        let mut first = 0;
        for (key, mut task) in self.tasks {
            let room = self.limit - arrivals.len();
            if task.arrivals.len() > room {
                // cut before the first history that does not fit whole
                let history = task.arrivals[room].photon.history;
                let whole = task.arrivals.partition_point(|a| a.photon.history < history);
                task.arrivals.truncate(whole);
                task.power.truncate(whole * self.bands);
                task.ways.truncate(whole);
                count = histories(key) + u64::from(history);
            }
            let same = |a: &Arrival, b: &Arrival| a.photon.history == b.photon.history;
            for history in task.arrivals.chunk_by_mut(same) {
                history.iter_mut().for_each(|arrival| arrival.photon.history = first);
                first += 1;
            }
            arrivals.append(&mut task.arrivals);
            power.append(&mut task.power);
            ways.append(&mut task.ways);
        }
        PhotonMap::file(arrivals, power, ways, self.bands, count)
    }
}
