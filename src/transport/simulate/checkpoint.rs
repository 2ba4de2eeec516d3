//! What a run has done so far, kept so that it can be gone on with: batches that are added up, those that have begun
//! and how far, and the arrivals of both. Each batch is independent of the others and has its tasks in order, so a
//! run that goes on from there finds the same bytes, wherever each thread was.

use std::{
    collections::BTreeMap,
    sync::{Mutex, atomic::Ordering},
    time::{Duration, Instant},
};

use serde::{Deserialize, Serialize};

use super::{Run, lock, schedule::Schedule, shard::check_arrivals};
use crate::{
    error::{Error, Result},
    transport::{
        photon_map::{MapBuilder, TaskArrivals, TaskKey},
        tally::{Sums, Tally, Totals},
    },
};

/// Writing takes at most one part in so many of a run's time.
const SHARE: u32 = 20;

/// What a run has done, without the arrivals.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct RunState {
    /// The round under way, from 0.
    round: u64,
    /// The first batch of it that is not added up.
    next: u64,
    /// What is added up.
    totals: Totals,
    /// Batches that have begun, with the tasks done of each and their sums.
    begun: BTreeMap<u64, (u64, Sums)>,
    /// The first task whose arrivals no longer fit into the map.
    full: Option<TaskKey>,
    /// Of paths, per band: the bits of the largest irradiance that one found.
    brightest: Vec<u64>,
}

/// A run to go on with.
#[derive(Clone, Debug)]
pub struct Resumed {
    /// What it has done.
    pub state: RunState,
    /// Arrivals in the form of [`TaskArrivals::words`].
    pub arrivals: Vec<(TaskKey, Vec<u32>)>,
}

/// Arrivals of tasks, in order.
pub type KeptArrivals<'i, 'a> = &'i mut dyn Iterator<Item = (TaskKey, &'a TaskArrivals)>;

/// Keeps what a run has done now and then, and once more when it is stopped.
pub struct Keeper<'a> {
    /// The least time between two times of keeping.
    every: Duration,
    /// Puts it where it lasts.
    save: &'a (dyn Fn(&RunState, KeptArrivals<'_, '_>) + Sync),
    resumed: Mutex<Option<Resumed>>,
    begun: Mutex<BTreeMap<u64, (u64, Sums)>>,
    due: Mutex<Instant>,
}

impl<'a> Keeper<'a> {
    /// Keeps with `save`, at most once in `every`; the run goes on from `resumed`, if that is given.
    pub fn new(
        every: Duration,
        resumed: Option<Resumed>,
        save: &'a (dyn Fn(&RunState, KeptArrivals<'_, '_>) + Sync),
    ) -> Self {
        let due = Mutex::new(Instant::now() + every);
        Self { every, save, resumed: Mutex::new(resumed), begun: Mutex::default(), due }
    }

    /// Whether it is time to keep.
    fn is_due(&self) -> bool {
        Instant::now() >= *lock(&self.due)
    }
}

impl Run<'_> {
    /// Where to begin: the round and the batch in it, and what was done before in `totals` and `map`. Error: what was
    /// kept is of no such run.
    pub(super) fn begin(
        &self,
        schedule: &Schedule,
        totals: &mut Totals,
        map: Option<&Mutex<MapBuilder>>,
    ) -> Result<(u64, u64)> {
        let Some(keeper) = self.keeper else { return Ok((0, 0)) };
        let Some(Resumed { state, arrivals }) = lock(&keeper.resumed).take() else {
            return Ok((0, 0));
        };
        let RunState { round, next, totals: before, begun, full, brightest } = state;
        let fits = before.fits(totals)
            && next <= schedule.batches
            && round.checked_mul(schedule.batches).and_then(|n| n.checked_add(next))
                == Some(before.batches)
            && brightest.len() == self.brightest.len()
            && begun.iter().all(|(batch, (tasks, sums))| {
                (next..schedule.batches).contains(batch)
                    && *tasks <= schedule.tasks(*batch)
                    && self.tally().fill(sums.clone()).is_some()
            });
        let none = || {
            Error::input("--checkpoint", "does not fit its own scene and settings")
                .remedy("remove the file, and the run begins anew")
        };
        if !fits {
            return Err(none());
        }
        for (key, words) in arrivals {
            let task = check_arrivals(self.scene, schedule, key, &words).ok_or_else(none)?;
            lock(map.ok_or_else(none)?).add(key, task);
        }
        if let (Some(map), Some(full)) = (map, full) {
            lock(map).end_at(full);
        }
        let tasks = begun.iter().flat_map(|(batch, (tasks, _))| (0..*tasks).map(|t| (*batch, t)));
        let histories: u64 = tasks.map(|(batch, task)| schedule.range(batch, task).1).sum();
        self.done.store((before.histories + histories) * self.unit(), Ordering::Relaxed);
        for (bits, most) in brightest.iter().zip(&self.brightest) {
            most.store(*bits, Ordering::Relaxed);
        }
        *totals = before;
        *lock(&keeper.begun) = begun;
        Ok((round, next))
    }

    /// Tasks of a batch that were done before, and their sums in `sums`, which is empty.
    pub(super) fn begun(&self, batch: u64, sums: &mut Tally) -> u64 {
        let Some(keeper) = self.keeper else { return 0 };
        let before = lock(&keeper.begun).get(&batch).cloned();
        before.and_then(|(tasks, before)| sums.fill(before).map(|()| tasks)).unwrap_or(0)
    }

    /// Notes how far a batch is, where it is time for that. Whether it was.
    pub(super) fn note_if_due(&self, batch: u64, tasks: u64, sums: &mut Tally) -> bool {
        let Some(keeper) = self.keeper.filter(|keeper| keeper.is_due()) else { return false };
        let so_far = sums.take();
        // it is empty, and these were its own
        let filled = sums.fill(so_far.clone());
        debug_assert!(filled.is_some(), "a tally takes back what it held");
        lock(&keeper.begun).insert(batch, (tasks, so_far));
        true
    }

    /// Notes how far a batch is that is given up.
    pub(super) fn note(&self, batch: u64, tasks: u64, sums: &mut Tally) {
        if let Some(keeper) = self.keeper {
            lock(&keeper.begun).insert(batch, (tasks, sums.take()));
        }
    }

    /// Keeps what the run has done.
    pub(super) fn keep(
        &self,
        (round, next): (u64, u64),
        totals: &Totals,
        map: Option<&Mutex<MapBuilder>>,
    ) {
        let Some(keeper) = self.keeper else { return };
        let began = Instant::now();
        let mut begun = lock(&keeper.begun).clone();
        begun.retain(|batch, _| *batch >= next);
        let map = map.map(|map| lock(map));
        let state = RunState {
            round,
            next,
            totals: totals.clone(),
            begun,
            full: map.as_ref().and_then(|map| map.end()),
            brightest: self.brightest.iter().map(|most| most.load(Ordering::Relaxed)).collect(),
        };
        // what else there is belongs to tasks that will be done again
        let is_kept = |(of, task, batch): TaskKey| {
            of < round
                || batch < next
                || state.begun.get(&batch).is_some_and(|(tasks, _)| task < *tasks)
        };
        let arrivals = map.as_ref().into_iter().flat_map(|map| map.tasks());
        let mut kept = arrivals.map(|(key, task)| (*key, task)).filter(|(key, _)| is_kept(*key));
        (keeper.save)(&state, &mut kept);
        *lock(&keeper.due) = Instant::now() + keeper.every.max(SHARE * began.elapsed());
    }

    /// Forgets how far a batch was that is added up, or all of them at the end of a round.
    pub(super) fn forget(&self, batch: Option<u64>) {
        let Some(keeper) = self.keeper else { return };
        let mut begun = lock(&keeper.begun);
        match batch {
            Some(batch) => {
                begun.remove(&batch);
            }
            None => begun.clear(),
        }
    }
}
