//! Puts tasks on threads, and adds their sums up to batches in order.

use std::{
    collections::BTreeMap,
    ops::Range,
    sync::{Condvar, Mutex, PoisonError, atomic::Ordering},
};

use super::{
    Run, lock,
    schedule::{AHEAD, Schedule},
};
use crate::{
    error::{Result, unlocked},
    transport::{
        photon_map::{MapBuilder, TaskKey},
        tally::{Sums, Tally, Totals},
    },
};

/// How far a run is: the number of rounds done, of batches done in the next round, and of tasks in
/// the batch after these whose sums have been added.
pub(super) type Place = (u64, u64, u64);

/// What [`Run::batches`] hands to its caller.
pub(super) enum Turn {
    /// The sums of this batch, which comes next.
    Add(u64, Sums),
    /// A request to save what is done up to this place; the sums are those of the batch under way.
    Keep(Place, Sums),
}

impl Run<'_> {
    /// Runs rounds of batches, from a place on, and adds the batches to `totals` in order. No
    /// thread waits between the batches.
    pub(super) fn rounds(
        &self,
        schedule: &Schedule,
        from: Place,
        rounds: Range<u64>,
        of: Option<u64>,
        totals: &mut Totals,
        map: Option<&Mutex<MapBuilder>>,
    ) -> Result<()> {
        let mut take = |turn: Turn| match turn {
            Turn::Add(batch, sums) => totals.add_batch(self.scene, &sums, schedule.batch(batch)),
            Turn::Keep(place, sums) => self.keep(place, sums, totals, map),
        };
        let batches = 0..schedule.batches;
        self.batches(&|_| *schedule, from, rounds, batches, of, &mut take, map)
    }

    /// Runs one round alone, and returns what it has found. Rounds of different numbers, and of
    /// runs of different purposes, have random numbers of their own.
    pub(super) fn round(&self, round: u64, schedule: &Schedule) -> Result<Totals> {
        let mut totals = self.totals();
        self.rounds(schedule, (round, 0, 0), round..round + 1, None, &mut totals, None)?;
        Ok(totals)
    }

    /// Runs some batches of some rounds, and hands them to `take` in order. Threads take task after
    /// task, whichever batch it belongs to. The sums of the tasks are added in the order of the
    /// tasks, so that rounding does not depend on threads. Between tasks, and when the run is
    /// stopped, `take` is also asked to save what is done, if anything is to be saved. Each of the
    /// `rounds`, which are sorted, has the batches of its own `schedule` that are among `batches`.
    #[allow(clippy::too_many_arguments)]
    pub(super) fn batches(
        &self,
        schedule: &(dyn Fn(u64) -> Schedule + Sync),
        from: Place,
        rounds: impl Iterator<Item = u64> + Send,
        batches: Range<u64>,
        of: Option<u64>,
        take: &mut (dyn FnMut(Turn) + Send),
        map: Option<&Mutex<MapBuilder>>,
    ) -> Result<()> {
        let mut batch = self.tally();
        self.begun().iter().for_each(|sums| batch.add_sums(sums));
        let mut rounds = rounds.peekable();
        let place = from.max((rounds.peek().copied().unwrap_or(0), batches.start, 0));
        let done = move |&(round, task, batch): &TaskKey| (round, batch, task) < place;
        let of_round = |round| {
            let schedule = schedule(round);
            let batches = batches.start..batches.end.min(schedule.batches);
            schedule.keys(round..round + 1, batches)
        };
        let queue = Mutex::new(Queue {
            waiting: rounds.flat_map(of_round).skip_while(done),
            begun: 0,
            done: BTreeMap::new(),
            added: 0,
            place,
            batch,
            take,
        });
        let (shared, turn) = (&queue, &Condvar::new());
        let most = AHEAD * self.pool.current_num_threads() as u64;
        self.pool.broadcast(|_| {
            let _alarm = Alarm { run: self, turn, queue: shared };
            let mut tally = self.tally();
            loop {
                let mut queue = lock(shared);
                while queue.begun - queue.added >= most && !self.stopped() {
                    queue = turn.wait(queue).unwrap_or_else(PoisonError::into_inner);
                }
                let Some(key) = queue.waiting.next().filter(|_| !self.stopped()) else { return };
                let number = queue.begun;
                queue.begun += 1;
                drop(queue);
                let schedule = schedule(key.0);
                self.task(&schedule, key, &mut tally, map);
                // the task may be half done
                if self.stopped() {
                    turn.notify_all();
                    return;
                }
                let mut queue = lock(shared);
                queue.add(schedule.tasks(key.2), number, key, tally.take());
                if self.keeps_now() {
                    queue.keep();
                }
                drop(queue);
                turn.notify_all();
                self.report(of, None);
            }
        });
        if self.stopped() && !self.broken() {
            unlocked(queue).keep();
        }
        self.check_stopped()
    }
}

/// The tasks of a run: those not yet begun, and the sums that have not been added yet.
struct Queue<'t, I> {
    waiting: I,
    /// Number of tasks that threads have begun.
    begun: u64,
    /// Sums of tasks that were done before their turn, by the number of the task, with the number of
    /// tasks of the batch.
    done: BTreeMap<u64, (TaskKey, u64, Sums)>,
    /// Number of tasks whose sums have been added.
    added: u64,
    place: Place,
    /// What has been added up so far of the batch under way.
    batch: Tally,
    take: &'t mut (dyn FnMut(Turn) + Send),
}

impl<I> Queue<'_, I> {
    /// Takes in the sums of a task of a batch of so many `tasks`, and adds all sums whose turn it
    /// is.
    fn add(&mut self, tasks: u64, number: u64, key: TaskKey, sums: Sums) {
        self.done.insert(number, (key, tasks, sums));
        while let Some(((round, task, batch), tasks, sums)) = self.done.remove(&self.added) {
            self.batch.add_sums(&sums);
            self.added += 1;
            self.place = (round, batch, task + 1);
            if task + 1 == tasks {
                self.place = (round, batch + 1, 0);
                (self.take)(Turn::Add(batch, self.batch.take()));
            }
        }
    }

    fn keep(&mut self) {
        let sums = self.batch.take();
        self.batch.add_sums(&sums);
        (self.take)(Turn::Keep(self.place, sums));
    }
}

/// Wakes the other threads if the thread that holds it panics; they would wait for its task for
/// ever.
struct Alarm<'a, 'r, T> {
    run: &'a Run<'r>,
    turn: &'a Condvar,
    queue: &'a Mutex<T>,
}

impl<T> Drop for Alarm<'_, '_, T> {
    fn drop(&mut self) {
        if std::thread::panicking() {
            // under the lock, so that no thread can check just before and begin to wait just after
            let _queue = lock(self.queue);
            self.run.shared.broken.store(true, Ordering::Relaxed);
            self.turn.notify_all();
        }
    }
}
