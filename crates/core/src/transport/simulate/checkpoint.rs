//! Checkpoints: what a run has done so far, saved so that the run can be resumed. A checkpoint
//! holds the batches that have been added up, the state of the batch under way, and the arrivals of
//! both. Tasks are added up in order, so a resumed run finds the same bytes, however far each
//! thread was.

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

/// Writing checkpoints takes at most one part in this many of the time of a run.
const SHARE: u32 = 20;

/// What a run has done, without its arrivals.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct RunState {
    /// The round under way, from 0.
    round: u64,
    /// The first batch of the round that has not been added up.
    next: u64,
    /// The totals of the batches that have been added up.
    totals: Totals,
    /// Number of tasks of the batch under way whose sums have been added to `sums`.
    tasks: u64,
    sums: Sums,
    /// The first task whose arrivals no longer fit into the photon map.
    full: Option<TaskKey>,
    /// For paths, per band: the bits of the largest irradiance that one path has found, W/m2 or
    /// umol/m2/s.
    brightest: Vec<u64>,
}

/// A run that is to be resumed.
#[derive(Clone, Debug)]
pub struct Resumed {
    /// What the run has done.
    pub state: RunState,
    /// Its arrivals, in the form of [`TaskArrivals::words`].
    pub arrivals: Vec<(TaskKey, Vec<u32>)>,
}

/// The arrivals of tasks, in order.
pub type KeptArrivals<'i, 'a> = &'i mut dyn Iterator<Item = (TaskKey, &'a TaskArrivals)>;

/// Saves what a run has done: now and then, and once more when the run is stopped.
pub struct Keeper<'a> {
    /// The least time between two checkpoints.
    every: Duration,
    /// Writes a checkpoint to where it lasts.
    save: &'a (dyn Fn(RunState, KeptArrivals<'_, '_>) + Sync),
    resumed: Mutex<Option<Resumed>>,
    /// The sums of the batch under way in which the run is resumed, until the run takes them.
    begun: Mutex<Option<Sums>>,
    due: Mutex<Instant>,
}

impl<'a> Keeper<'a> {
    /// Saves with `save`, at most once in `every`. If `resumed` is given, the run goes on from
    /// there.
    pub fn new(
        every: Duration,
        resumed: Option<Resumed>,
        save: &'a (dyn Fn(RunState, KeptArrivals<'_, '_>) + Sync),
    ) -> Self {
        let due = Mutex::new(Instant::now() + every);
        Self { every, save, resumed: Mutex::new(resumed), begun: Mutex::default(), due }
    }

    /// Returns whether a checkpoint is due.
    fn is_due(&self) -> bool {
        Instant::now() >= *lock(&self.due)
    }
}

impl Run<'_> {
    /// Returns the place at which to begin, and restores `totals` and `map` if the run is resumed.
    /// Error: the checkpoint does not belong to such a run.
    pub(super) fn begin(
        &self,
        schedule: &Schedule,
        totals: &mut Totals,
        map: Option<&Mutex<MapBuilder>>,
    ) -> Result<Place> {
        let Some(keeper) = self.kept.keeper else { return Ok((0, 0, 0)) };
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
            && before
                .histories
                .checked_mul(self.histories.unit())
                .is_some_and(|all| all <= MAX_PHOTONS)
            && full.is_none_or(is_of_run)
            && arrivals.iter().all(|(key, _)| is_of_run(*key))
            && arrivals.is_sorted_by(|(a, _), (b, _)| a < b)
            && brightest.len() == self.shared.brightest.len()
            && tasks < whole
            && self.tally().fits(&sums);
        let none = || {
            Error::input("checkpoint", "does not fit its own scene and settings")
                .remedy("remove the file, and the run begins anew")
        };
        if !fits {
            return Err(none());
        }
        for (key, words) in arrivals {
            let mut map = lock(map.ok_or_else(none)?);
            let task = check_arrivals(self.scene, schedule, key, &words, &map).ok_or_else(none)?;
            map.add(key, task);
        }
        if let (Some(map), Some(full)) = (map, full) {
            lock(map).end_at(full);
        }
        let of_batch: u64 = (0..tasks).map(|task| self.photons_in(schedule, next, task)).sum();
        self.shared
            .done
            .store(before.histories * self.histories.unit() + of_batch, Ordering::Relaxed);
        for (bits, most) in brightest.iter().zip(&self.shared.brightest) {
            most.store(*bits, Ordering::Relaxed);
        }
        *totals = before;
        *lock(&keeper.begun) = Some(sums);
        Ok((round, next, tasks))
    }

    /// Returns, once, the sums of the batch under way in which the run is resumed.
    pub(super) fn begun(&self) -> Option<Sums> {
        lock(&self.kept.keeper?.begun).take()
    }

    /// Returns whether a checkpoint is due.
    pub(super) fn keeps_now(&self) -> bool {
        self.kept.keeper.is_some_and(Keeper::is_due)
    }

    /// Saves what the run has done.
    pub(super) fn keep(
        &self,
        (round, next, tasks): Place,
        sums: Sums,
        totals: &Totals,
        map: Option<&Mutex<MapBuilder>>,
    ) {
        let Some(keeper) = self.kept.keeper else { return };
        let began = Instant::now();
        let map = map.map(|map| lock(map));
        let state = RunState {
            round,
            next,
            totals: totals.clone(),
            tasks,
            sums,
            full: map.as_ref().and_then(|map| map.end()),
            brightest: self
                .shared
                .brightest
                .iter()
                .map(|most| most.load(Ordering::Relaxed))
                .collect(),
        };
        // other arrivals belong to tasks that will be done again
        let is_kept = |(of, task, batch): TaskKey| (of, batch, task) < (round, next, tasks);
        let arrivals = map.as_ref().into_iter().flat_map(|map| map.tasks());
        let mut kept = arrivals.map(|(key, task)| (*key, task)).filter(|(key, _)| is_kept(*key));
        (keeper.save)(state, &mut kept);
        *lock(&keeper.due) = Instant::now() + keeper.every.max(SHARE * began.elapsed());
    }
}
