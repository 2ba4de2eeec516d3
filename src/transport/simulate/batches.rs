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
    /// One round of batches, added up in order.
    pub(super) fn round<const N: usize>(
        &self,
        schedule: &Schedule,
        round: u64,
        of: Option<u64>,
        totals: &mut Totals,
        map: Option<&Mutex<MapBuilder>>,
    ) -> Result<()> {
        let mut add = |batch, sums: &mut Tally| {
            totals.add_batch(self.scene, sums, schedule.batch(batch));
        };
        self.batches::<N>(schedule, round, 0..schedule.batches, of, &mut add, map)
    }

    /// Some batches of a round, each traced whole by one thread and handed over, to be emptied, in order.
    pub(super) fn batches<const N: usize>(
        &self,
        schedule: &Schedule,
        round: u64,
        batches: Range<u64>,
        of: Option<u64>,
        take: &mut (dyn FnMut(u64, &mut Tally) + Send),
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
                for task in 0..schedule.tasks(batch) {
                    if self.stopped() {
                        break;
                    }
                    self.task::<N>(schedule, (round, task, batch), &mut task_sums, map);
                    sums.drain(&mut task_sums);
                    self.report(of, None);
                }
                let mut taken = lock(&taken);
                while taken.0 != batch && !self.broken() {
                    taken = turn.wait(taken).unwrap_or_else(PoisonError::into_inner);
                }
                if self.broken() {
                    return;
                }
                (taken.1)(batch, &mut sums);
                taken.0 += 1;
                turn.notify_all();
            }
        });
        self.check_stopped()
    }
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
