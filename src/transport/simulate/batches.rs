//! Batches on threads, added up in order.

use std::{
    ops::Range,
    sync::{
        Condvar, Mutex, PoisonError,
        atomic::{AtomicU64, Ordering},
    },
};

use super::{Run, lock, schedule::Schedule};
use crate::{
    error::Result,
    transport::{
        photon_map::MapBuilder,
        tally::{Tally, Totals},
    },
};

impl Run<'_> {
    /// One round of batches, added up in order, from one of them on.
    pub(super) fn round(
        &self,
        schedule: &Schedule,
        (round, first): (u64, u64),
        of: Option<u64>,
        totals: &mut Totals,
        map: Option<&Mutex<MapBuilder>>,
    ) -> Result<()> {
        let mut take = |turn: Turn| match turn {
            Turn::Add(batch, sums) => {
                totals.add_batch(self.scene, sums, schedule.batch(batch));
                self.forget(Some(batch));
            }
            Turn::Keep(next) => self.keep((round, next), totals, map),
        };
        self.batches(schedule, round, first..schedule.batches, of, &mut take, map)?;
        self.forget(None);
        Ok(())
    }

    /// Some batches of a round, each traced whole by one thread and handed over, to be emptied, in order. Between
    /// them, and when it is stopped, `take` is also asked to keep what is done, if anything is to be kept.
    pub(super) fn batches(
        &self,
        schedule: &Schedule,
        round: u64,
        batches: Range<u64>,
        of: Option<u64>,
        take: &mut (dyn FnMut(Turn) + Send),
        map: Option<&Mutex<MapBuilder>>,
    ) -> Result<()> {
        let next = AtomicU64::new(batches.start);
        let taken = Mutex::new((batches.start, take));
        let turn = Condvar::new();
        self.pool.broadcast(|_| {
            let _alarm = Alarm { run: self, turn: &turn, taken: &taken };
            let (mut task_sums, mut sums) = (self.tally(), self.tally());
            loop {
                let batch = next.fetch_add(1, Ordering::Relaxed);
                if batch >= batches.end {
                    return;
                }
                let (mut task, tasks) = (self.begun(batch, &mut sums), schedule.tasks(batch));
                while task < tasks {
                    self.task(schedule, (round, task, batch), &mut task_sums, map);
                    // it may be half done
                    if self.stopped() {
                        break;
                    }
                    sums.drain(&mut task_sums);
                    task += 1;
                    self.report(of, None);
                    if self.note_if_due(batch, task, &mut sums) {
                        let mut taken = lock(&taken);
                        let next = taken.0;
                        (taken.1)(Turn::Keep(next));
                    }
                }
                let mut taken = lock(&taken);
                while taken.0 != batch && !self.stopped() {
                    taken = turn.wait(taken).unwrap_or_else(PoisonError::into_inner);
                }
                if self.stopped() {
                    self.note(batch, task, &mut sums);
                    turn.notify_all();
                    return;
                }
                (taken.1)(Turn::Add(batch, &mut sums));
                taken.0 += 1;
                turn.notify_all();
            }
        });
        if self.stopped() && !self.broken() {
            let (next, take) = taken.into_inner().unwrap_or_else(PoisonError::into_inner);
            take(Turn::Keep(next));
        }
        self.check_stopped()
    }
}

/// What is asked of the one that takes batches.
pub(super) enum Turn<'a> {
    /// This batch comes next; its sums are to be emptied.
    Add(u64, &'a mut Tally),
    /// All before this batch have come: keep what is done.
    Keep(u64),
}

/// Tells the other threads of a panic in the one that holds it: they would wait for its batch for ever.
struct Alarm<'a, 'r, T> {
    run: &'a Run<'r>,
    turn: &'a Condvar,
    taken: &'a Mutex<T>,
}

impl<T> Drop for Alarm<'_, '_, T> {
    fn drop(&mut self) {
        if std::thread::panicking() {
            // under the lock, so that none can look just before and begin to wait just after
            let _taken = lock(self.taken);
            self.run.broken.store(true, Ordering::Relaxed);
            self.turn.notify_all();
        }
    }
}
