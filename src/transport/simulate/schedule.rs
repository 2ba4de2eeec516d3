//! How a run is cut: rounds into batches, batches into tasks.

use crate::transport::photon_map::TaskKey;

/// Batches of a run, and of each round of a run that goes on until it is accurate enough.
pub const BATCHES: u64 = 128;

/// The cut of a round into batches and tasks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Schedule {
    /// Batches.
    pub batches: u64,
    /// Histories of all batches.
    pub histories: u64,
    /// Histories of a task.
    pub task: u64,
}

impl Schedule {
    /// Of `histories`, at least `least` to a batch.
    pub fn new(histories: u64, least: u64, task: u64) -> Self {
        Self { batches: BATCHES.min(histories / least), histories, task }
    }

    /// Histories of a batch.
    pub fn batch(&self, batch: u64) -> u64 {
        self.histories / self.batches + u64::from(batch < self.histories % self.batches)
    }

    /// Tasks of a batch; the last one takes what is left over.
    pub fn tasks(&self, batch: u64) -> u64 {
        (self.batch(batch) / self.task).max(1)
    }

    /// First history and number of histories of a task within its batch.
    pub fn range(&self, batch: u64, task: u64) -> (u64, u64) {
        let first = task * self.task;
        let last = task + 1 == self.tasks(batch);
        (first, if last { self.batch(batch) - first } else { self.task })
    }

    /// The same batches, ended after `tasks` tasks each.
    pub fn ended_after(&self, tasks: u64) -> Self {
        Self { histories: self.batches * tasks * self.task, ..*self }
    }

    /// Histories before a task, in the order of the photon map.
    pub fn histories_before(&self, (round, task, batch): TaskKey) -> u64 {
        let in_round: u64 = (0..self.batches)
            .map(|b| {
                let whole = if b < batch { task + 1 } else { task };
                if whole >= self.tasks(b) { self.batch(b) } else { whole * self.task }
            })
            .sum();
        round * self.histories + in_round
    }
}
