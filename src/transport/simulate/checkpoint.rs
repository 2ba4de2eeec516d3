//! What a run has done so far, kept so that it can be gone on with: batches that are added up, how far the next one is,
//! and the arrivals of both. Tasks are added up in order, so a run that goes on from there finds the same
//! bytes, wherever each thread was.

use std::{
    sync::{Mutex, atomic::Ordering},
    time::{Duration, Instant},
};

use serde::{Deserialize, Serialize};

use super::{Run, batches::Place, lock, schedule::Schedule, shard::check_arrivals};
use crate::{
    error::{Error, Result},
    transport::{
        photon_map::{MapBuilder, TaskArrivals, TaskKey},
        settings::MAX_PHOTONS,
        tally::{Sums, Totals},
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
    /// Tasks of that batch that are, to these sums.
    tasks: u64,
    sums: Sums,
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
    /// What the batch had that the run goes on with.
    begun: Mutex<Option<Sums>>,
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
    /// Where to begin, and what was done before in `totals` and `map`. Error: what was kept is of no such run.
    pub(super) fn begin(
        &self,
        schedule: &Schedule,
        totals: &mut Totals,
        map: Option<&Mutex<MapBuilder>>,
    ) -> Result<Place> {
        let Some(keeper) = self.keeper else { return Ok((0, 0, 0)) };
        let Some(Resumed { state, arrivals }) = lock(&keeper.resumed).take() else {
            return Ok((0, 0, 0));
        };
        let RunState { round, next, tasks, sums, totals: before, full, brightest } = state;
        let whole = if next < schedule.batches { schedule.tasks(next) } else { 1 };
        let done = |all: u64, of_round: u64| round.checked_mul(all)?.checked_add(of_round);
        let is_of_run = |(of, task, batch): TaskKey| {
            of <= round && batch < schedule.batches && task < schedule.tasks(batch)
        };
        let fits = before.fits(totals)
            && next <= schedule.batches
            && done(schedule.batches, next) == Some(before.batches)
            && done(schedule.histories, (0..next).map(|batch| schedule.batch(batch)).sum())
                == Some(before.histories)
            && before.histories.checked_mul(self.unit()).is_some_and(|all| all <= MAX_PHOTONS)
            && full.is_none_or(is_of_run)
            && arrivals.iter().all(|(key, _)| is_of_run(*key))
            && arrivals.is_sorted_by(|(a, _), (b, _)| a < b)
            && brightest.len() == self.brightest.len()
            && tasks < whole
            && self.tally().fits(&sums);
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
        let of_batch: u64 = (0..tasks).map(|task| self.photons_in(schedule, next, task)).sum();
        self.done.store(before.histories * self.unit() + of_batch, Ordering::Relaxed);
        for (bits, most) in brightest.iter().zip(&self.brightest) {
            most.store(*bits, Ordering::Relaxed);
        }
        *totals = before;
        *lock(&keeper.begun) = Some(sums);
        Ok((round, next, tasks))
    }

    /// What the batch had that the run goes on with; once.
    pub(super) fn begun(&self) -> Option<Sums> {
        lock(&self.keeper?.begun).take()
    }

    /// Whether it is time to keep what is done.
    pub(super) fn keeps_now(&self) -> bool {
        self.keeper.is_some_and(Keeper::is_due)
    }

    /// Keeps what the run has done.
    pub(super) fn keep(
        &self,
        (round, next, tasks): Place,
        sums: Sums,
        totals: &Totals,
        map: Option<&Mutex<MapBuilder>>,
    ) {
        let Some(keeper) = self.keeper else { return };
        let began = Instant::now();
        let map = map.map(|map| lock(map));
        let state = RunState {
            round,
            next,
            totals: totals.clone(),
            tasks,
            sums,
            full: map.as_ref().and_then(|map| map.end()),
            brightest: self.brightest.iter().map(|most| most.load(Ordering::Relaxed)).collect(),
        };
        // what else there is belongs to tasks that will be done again
        let is_kept = |(of, task, batch): TaskKey| (of, batch, task) < (round, next, tasks);
        let arrivals = map.as_ref().into_iter().flat_map(|map| map.tasks());
        let mut kept = arrivals.map(|(key, task)| (*key, task)).filter(|(key, _)| is_kept(*key));
        (keeper.save)(&state, &mut kept);
        *lock(&keeper.due) = Instant::now() + keeper.every.max(SHARE * began.elapsed());
    }
}
