//! Collects arrivals task by task.

use std::collections::{BTreeMap, BTreeSet};

use glam::Vec3;

use super::{Arrival, PackedDirection, PhotonMap, Seen, StoredPhoton, Thinning, Way, thinning};

/// Identifies a task of histories in a run by round, task within the batch, and batch. Keys are
/// ordered so that every batch has its first task before any batch has its second.
pub type TaskKey = (u64, u64, u64);

/// Number of words that an arrival takes, without its powers.
const WORDS: usize = 8;

/// In the words of a task, the triangle of what is no arrival but tells how many arrived at a face
/// that is thinned.
const NO_TRIANGLE: u32 = u32::MAX;

/// The arrivals of one task, in order, and their powers per band.
#[derive(Clone, Debug)]
pub struct TaskArrivals {
    pub(super) arrivals: Vec<Arrival>,
    power: Vec<f32>,
    ways: Vec<Way>,
    bands: usize,
    /// What estimates use of them; `None` if all are stored.
    thinning: Option<Thinning>,
    /// What arrives at the faces that are thinned.
    pub(super) seen: Vec<Seen>,
    /// Number of all arrivals, stored or not.
    all: usize,
}

impl TaskArrivals {
    fn new(bands: usize, thinning: Option<Thinning>) -> Self {
        let seen = thinning.iter().flat_map(Thinning::nothing).collect();
        let (arrivals, power, ways) = Default::default();
        Self { arrivals, power, ways, bands, thinning, seen, all: 0 }
    }

    /// Returns everything as whole numbers; floating-point numbers become their bits.
    pub fn words(&self) -> Vec<u32> {
        let bands = self.bands;
        let mut words = Vec::with_capacity(self.arrivals.len() * (WORDS + bands));
        for (i, Arrival { position, bin, photon }) in self.arrivals.iter().enumerate() {
            words.extend(position.to_array().map(f32::to_bits));
            let StoredPhoton { direction, triangle, light, history } = photon;
            words.extend([*bin, direction.bits(), *triangle, *light, *history]);
            words.extend(self.power[i * bands..][..bands].iter().map(|power| power.to_bits()));
        }
        for seen in self.seen.iter().filter(|seen| seen.photons > 0) {
            let Seen { bin, radius2, photons, histories, .. } = *seen;
            words.extend([radius2.to_bits(), 0, 0, bin, photons, NO_TRIANGLE, 0, histories]);
            words.extend((0..bands).map(|_| 0));
        }
        words
    }

    /// Reads the [`words`](Self::words) of photons with `bands` powers each. `None` if the words do
    /// not make up whole arrivals, or a position or power is not finite.
    pub fn from_words(words: &[u32], bands: usize) -> Option<Self> {
        if !words.len().is_multiple_of(WORDS + bands) {
            return None;
        }
        let mut task = Self::new(bands, None);
        for arrival in words.chunks(WORDS + bands) {
            let position = Vec3::from([0, 1, 2].map(|i| f32::from_bits(arrival[i])));
            let [bin, direction, triangle, light, history] = [3, 4, 5, 6, 7].map(|i| arrival[i]);
            if triangle == NO_TRIANGLE {
                task.seen.push(Seen::of(bin, position.x, [direction, history]));
                continue;
            }
            let direction = PackedDirection::from_bits(direction);
            let photon = StoredPhoton { direction, triangle, light, history };
            task.arrivals.push(Arrival { position, bin, photon });
            task.power.extend(arrival[WORDS..].iter().map(|bits| f32::from_bits(*bits)));
        }
        let of_seen: BTreeSet<u32> = task.seen.iter().map(|seen| seen.bin).collect();
        let others = task.arrivals.iter().filter(|arrival| !of_seen.contains(&arrival.bin)).count();
        task.all = others + task.seen.iter().map(|seen| seen.photons as usize).sum::<usize>();
        let finite = task.arrivals.iter().all(|arrival| arrival.position.is_finite());
        let known = task.seen.iter().all(|seen| seen.radius2 >= 0.0);
        (finite && known && task.power.iter().all(|power| power.is_finite())).then_some(task)
    }

    /// Returns the arrivals that are stored, in order.
    pub fn arrivals(&self) -> &[Arrival] {
        &self.arrivals
    }

    /// Returns what has arrived at the faces that are thinned.
    pub fn seen(&self) -> &[Seen] {
        &self.seen
    }

    /// Returns whether an arrival of a history in a bin is to be stored, and counts it if it is not.
    #[inline]
    pub fn wants(&mut self, bin: u32, position: Vec3, history: u32) -> bool {
        let Some(thinning) = &self.thinning else { return true };
        let wanted = thinning.keep(&mut self.seen, bin, position, history);
        self.all += usize::from(!wanted && thinning.have(bin));
        wanted
    }

    /// Stores an arrival, unless there are more than `limit` already.
    #[inline]
    pub fn push(&mut self, limit: usize, arrival: Arrival, power: impl Iterator<Item = f32>) {
        if self.all <= limit {
            self.all += 1;
            self.arrivals.push(arrival);
            self.power.extend(power);
        }
    }

    /// Stores the way by which the arrival came that has just been stored.
    #[inline]
    pub fn came(&mut self, way: Way) {
        self.ways.resize(self.arrivals.len(), way);
    }

    /// Drops all arrivals but those that are `wanted`. There are no ways.
    pub(super) fn retain(&mut self, mut wanted: impl FnMut(&Arrival) -> bool) {
        let (mut kept, bands) = (0, self.bands);
        for i in 0..self.arrivals.len() {
            if wanted(&self.arrivals[i]) {
                self.arrivals[kept] = self.arrivals[i];
                self.power.copy_within(i * bands..(i + 1) * bands, kept * bands);
                kept += 1;
            }
        }
        self.arrivals.truncate(kept);
        self.power.truncate(kept * bands);
        self.arrivals.shrink_to_fit();
        self.power.shrink_to_fit();
    }

    /// Cuts before the first history of which arrivals come after the first `room`, and returns that
    /// history: the first of all where so few are stored, as only a damaged file has it.
    fn cut(&mut self, room: usize) -> u32 {
        let history = self.arrivals.get(room).map_or(0, |arrival| arrival.photon.history);
        let whole = self.arrivals.partition_point(|arrival| arrival.photon.history < history);
        self.arrivals.truncate(whole);
        self.power.truncate(whole * self.bands);
        self.ways.truncate(whole);
        self.seen.clear();
        history
    }
}

/// Collects the arrivals of tasks, in any order of the tasks. It keeps those of the first histories
/// that fit, whatever that order is.
#[derive(Debug)]
pub struct MapBuilder {
    limit: usize,
    bands: usize,
    /// What estimates use of the arrivals; `None` if all are stored.
    thinning: Option<Thinning>,
    tasks: BTreeMap<TaskKey, TaskArrivals>,
    /// Number of arrivals of these tasks, stored or not.
    all: usize,
    /// Number of those that are stored.
    stored: usize,
    /// The number of all at which it is looked up next which can still count.
    next: usize,
    /// The first task that no longer fits.
    end: Option<TaskKey>,
}

/// The task whose arrivals come first. They alone may be more than a map holds, so they are stored as
/// they are.
const FIRST_TASK: TaskKey = (0, 0, 0);

impl MapBuilder {
    /// Returns a builder of a map of at most `limit` arrivals of `bands` bands, all of which are stored.
    pub fn new(limit: usize, bands: usize) -> Self {
        let next = thinning::FIRST;
        Self {
            limit,
            bands,
            thinning: None,
            tasks: BTreeMap::new(),
            all: 0,
            stored: 0,
            next,
            end: None,
        }
    }

    /// Returns a builder of a map of at most `limit` arrivals of `bands` bands, of which those are stored
    /// that estimates use.
    pub fn for_estimates(limit: usize, bands: usize, thinning: Thinning) -> Self {
        Self { thinning: Some(thinning), ..Self::new(limit, bands) }
    }

    /// Returns the most arrivals that are taken into account.
    pub fn limit(&self) -> usize {
        self.limit
    }

    /// Returns the bytes that the arrivals take that are stored so far.
    pub fn bytes(&self) -> u64 {
        self.stored as u64 * Self::arrival_bytes(self.bands)
    }

    /// Returns the bytes that an arrival takes in so many bands.
    pub fn arrival_bytes(bands: usize) -> u64 {
        (size_of::<Arrival>() + size_of::<Way>() + bands * size_of::<f32>()) as u64
    }

    /// Returns whether estimates use arrivals of a bin.
    pub fn uses(&self, bin: u32) -> bool {
        self.thinning.as_ref().is_none_or(|thinning| thinning.have(bin))
    }

    /// Returns a task that is to be traced. `None` if its arrivals no longer fit.
    pub fn task(&self, key: TaskKey) -> Option<TaskArrivals> {
        let thinning = self.thinning.as_ref().map(|thinning| match key {
            FIRST_TASK => thinning.unlimited(),
            _ => thinning.clone(),
        });
        self.wants(key).then(|| TaskArrivals::new(self.bands, thinning))
    }

    fn wants(&self, key: TaskKey) -> bool {
        self.end.is_none_or(|end| key < end)
    }

    /// Adds the arrivals of a task.
    pub fn add(&mut self, key: TaskKey, mut task: TaskArrivals) {
        if task.all == 0 || !self.wants(key) {
            return;
        }
        let is_of_file = task.thinning.take().is_none();
        let mut changed = false;
        if let Some(thinning) = self.thinning.as_mut().filter(|_| is_of_file) {
            // files of older versions hold arrivals at all captors
            let before = task.arrivals.len();
            task.retain(|arrival| thinning.have(arrival.bin));
            task.all -= before - task.arrivals.len();
            changed = thinning.join(&task);
        }
        self.all += task.all;
        self.stored += task.arrivals.len();
        self.tasks.insert(key, task);
        if changed {
            self.thin_all();
        } else {
            self.thin(key);
        }
        let cuts = self.cuts();
        while let Some(last) = self.tasks.last_entry() {
            let rest = self.all - last.get().all;
            let whole = if cuts || *last.key() == FIRST_TASK { rest } else { self.all };
            if whole <= self.limit {
                break;
            }
            self.all = rest;
            self.stored -= last.get().arrivals.len();
            self.end = Some(last.remove_entry().0);
        }
        if self.all >= self.next {
            self.next = 2 * self.all;
            self.narrow(false);
        }
    }

    /// Drops the arrivals that can no longer count.
    fn narrow(&mut self, finally: bool) {
        if self.cuts() {
            return;
        }
        if let Some(thinning) = &mut self.thinning {
            thinning.narrow(self.tasks.values(), finally);
            self.thin_all();
        }
    }

    fn thin_all(&mut self) {
        for key in self.tasks.keys().copied().collect::<Vec<_>>() {
            self.thin(key);
        }
    }

    fn thin(&mut self, key: TaskKey) {
        if let (Some(thinning), Some(task)) = (&self.thinning, self.tasks.get_mut(&key))
            && task.all <= self.limit
        {
            let before = task.arrivals.len();
            thinning.thin(task);
            self.stored -= before - task.arrivals.len();
        }
    }

    /// Returns whether the last task that fits is cut where the map is full. A task that is thinned
    /// cannot be cut, but small maps are not thinned.
    fn cuts(&self) -> bool {
        self.thinning.is_none() || self.limit < thinning::FIRST
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
    pub fn into_pieces(mut self) -> (BTreeMap<TaskKey, TaskArrivals>, Option<TaskKey>) {
        self.narrow(true);
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
        let (mut arrivals, mut power, mut ways) =
            (Vec::with_capacity(self.stored), Vec::new(), Vec::new());
        let mut thinned = BTreeMap::<u32, Seen>::new();
        let mut count = self.end.map_or(all, &histories);
        let (mut before, mut first) = (0, 0);
        for (key, mut task) in self.tasks {
            let room = self.limit - before;
            before += task.all.min(room);
            if task.all > room {
                count = histories(key) + u64::from(task.cut(room));
            }
            let same = |a: &Arrival, b: &Arrival| a.photon.history == b.photon.history;
            for history in task.arrivals.chunk_by_mut(same) {
                history.iter_mut().for_each(|arrival| arrival.photon.history = first);
                first += 1;
            }
            for seen in &task.seen {
                thinned.entry(seen.bin).and_modify(|sum| sum.add(seen)).or_insert(*seen);
            }
            arrivals.append(&mut task.arrivals);
            power.append(&mut task.power);
            ways.append(&mut task.ways);
        }
        let thinned = thinned.into_values().collect();
        PhotonMap::file(arrivals, power, ways, self.bands, count, thinned)
    }
}
