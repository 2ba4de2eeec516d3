//! The schedule of a run: rounds are cut into batches, which are for statistics, and batches into
//! tasks, which are for threads.

use std::ops::Range;

use crate::transport::photon_map::TaskKey;

/// Number of batches of a run, and of each round of a run that goes on until it is accurate enough.
pub const BATCHES: u64 = 128;

/// The most tasks per thread that may be begun, or done and waiting to be added, at a time.
pub(super) const AHEAD: u64 = 4;

/// How a round is cut into batches and tasks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Schedule {
    /// Number of batches.
    pub batches: u64,
    /// Number of histories of all batches together.
    pub histories: u64,
    /// Number of histories of a task.
    pub task: u64,
    /// Number of tasks that share one range of histories. The tasks of paths share it by the faces
    /// that the paths start from, and photons beside them are one task more; for photons alone the
    /// number is 1.
    pub cuts: u64,
    /// For paths beside which photons are traced: how many photons.
    pub beside: Option<Beside>,
}

/// How many photons are traced beside a range of histories of paths.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Beside {
    /// Number of photons for each history, which is one path from each face.
    pub ratio: f64,
    /// The least number of photons of a task: one of each source.
    pub least: u64,
}

impl Beside {
    /// Returns the number of photons beside so many histories.
    pub fn photons(self, histories: u64) -> u64 {
        self.least.max((self.ratio * histories as f64) as u64)
    }
}

impl Schedule {
    /// Cuts `histories` into batches of at least `least` histories, and into tasks of `task`
    /// histories.
    pub fn new(histories: u64, least: u64, task: u64) -> Self {
        Self { batches: BATCHES.min(histories / least), histories, task, cuts: 1, beside: None }
    }

    /// Returns the number of histories of a batch.
    pub fn batch(&self, batch: u64) -> u64 {
        self.histories / self.batches + u64::from(batch < self.histories % self.batches)
    }

    /// Returns the number of ranges of histories of a batch; the last range takes what is left
    /// over.
    fn ranges(&self, batch: u64) -> u64 {
        (self.batch(batch) / self.task).max(1)
    }

    /// Returns the number of tasks of a batch.
    pub fn tasks(&self, batch: u64) -> u64 {
        self.ranges(batch) * self.cuts
    }

    /// Returns the first history of a task within its batch, and the number of its histories.
    pub fn range(&self, batch: u64, task: u64) -> (u64, u64) {
        let range = task / self.cuts;
        let first = range * self.task;
        let last = range + 1 == self.ranges(batch);
        (first, if last { self.batch(batch) - first } else { self.task })
    }

    /// Returns which of `faces` faces the paths of a task start from: none if it is one of photons
    /// beside paths.
    pub fn faces(&self, task: u64, faces: usize) -> Range<usize> {
        let cuts = (self.cuts - u64::from(self.beside.is_some())) as usize;
        let cut = (task % self.cuts) as usize;
        if cut == cuts { faces..faces } else { cut * faces / cuts..(cut + 1) * faces / cuts }
    }

    /// Returns the first photon of a task of photons beside paths, within its batch, and their
    /// number. `None` for other tasks.
    pub fn photons_beside(&self, batch: u64, task: u64) -> Option<(u64, u64)> {
        let beside = self.beside.filter(|_| task % self.cuts + 1 == self.cuts)?;
        let before = task / self.cuts * beside.photons(self.task);
        Some((before, beside.photons(self.range(batch, task).1)))
    }

    /// Returns the number of photons beside the paths of all batches.
    pub fn all_beside(&self) -> u64 {
        let of = |(_, task, batch)| Some(self.photons_beside(batch, task)?.1);
        self.keys(0..1, 0..self.batches).filter_map(of).sum()
    }

    /// Returns the tasks of some batches of some rounds, in the order in which their sums are
    /// added.
    pub fn keys(self, rounds: Range<u64>, batches: Range<u64>) -> impl Iterator<Item = TaskKey> {
        rounds.flat_map(move |round| {
            batches
                .clone()
                .flat_map(move |batch| (0..self.tasks(batch)).map(move |task| (round, task, batch)))
        })
    }

    /// Returns the schedule of the same batches, each ended after `tasks` tasks. `None` where that
    /// would leave a range of histories with only some of its faces.
    pub fn ended_after(&self, tasks: u64) -> Option<Self> {
        let histories = self.batches * (tasks / self.cuts) * self.task;
        tasks.is_multiple_of(self.cuts).then_some(Self { histories, ..*self })
    }

    /// Returns the number of photons of a task: of its histories, or beside its paths.
    pub fn photons(&self, batch: u64, task: u64) -> u64 {
        match self.beside {
            None => self.range(batch, task).1,
            Some(_) => self.photons_beside(batch, task).map_or(0, |(_, photons)| photons),
        }
    }

    /// Returns the number of photons before a task, in the order of the photon map. Beside paths it
    /// must be a task of photons.
    pub fn photons_before(&self, (round, task, batch): TaskKey) -> u64 {
        let of = |histories| self.beside.map_or(histories, |beside| beside.photons(histories));
        let (range, each) = (task / self.cuts, of(self.task));
        let in_batch = |b: u64, ranges: u64| match self.ranges(b) {
            all if ranges >= all => (all - 1) * each + of(self.batch(b) - (all - 1) * self.task),
            _ => ranges * each,
        };
        let all: u64 = (0..self.batches).map(|b| in_batch(b, u64::MAX)).sum();
        let done = |b: u64| if b < batch { range + 1 } else { range };
        round * all + (0..self.batches).map(|b| in_batch(b, done(b))).sum::<u64>()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Simulates workers that take the tasks of a run in order, each as soon as it is idle. Returns
    /// the fewest tasks of one worker, and the fraction of their time for which they wait for the
    /// last task. A task costs as much as it has histories.
    fn work(schedule: &Schedule, workers: usize) -> (usize, f64) {
        let (mut busy, mut tasks) = (vec![0; workers], vec![0; workers]);
        for (_, task, batch) in schedule.keys(0..1, 0..schedule.batches) {
            let idle = (0..workers).min_by_key(|&worker| busy[worker]).unwrap();
            busy[idle] += schedule.range(batch, task).1;
            tasks[idle] += 1;
        }
        let all: u64 = busy.iter().sum();
        assert_eq!(all, schedule.histories * schedule.cuts);
        let end = busy.iter().max().unwrap() * workers as u64;
        (*tasks.iter().min().unwrap(), 1.0 - all as f64 / end as f64)
    }

    /// The number of batches is always 128, and yet 1e7 histories keep 500 workers busy; so do 100
    /// paths from each of 1e5 faces, of which each batch has at most one per face.
    #[test]
    fn many_workers_have_enough_to_do() {
        let photons = Schedule::new(10_000_000, 3, 1024);
        let paths = Schedule { cuts: 98, ..Schedule::new(100, 1, 1) };
        for schedule in [photons, paths] {
            let (least, idle) = work(&schedule, 500);
            assert!(least >= 4 && idle < 0.1, "{least} tasks, {idle} idle");
        }
    }

    /// Every history of every face belongs to exactly one task.
    #[test]
    fn tasks_are_whole() {
        let schedule = Schedule { cuts: 3, ..Schedule::new(1000, 1, 3) };
        let mut seen = vec![0; 7 * 1000];
        for (_, task, batch) in schedule.keys(0..1, 0..schedule.batches) {
            let before: u64 = (0..batch).map(|b| schedule.batch(b)).sum();
            let (first, histories) = schedule.range(batch, task);
            for history in before + first..before + first + histories {
                schedule.faces(task, 7).for_each(|face| seen[history as usize * 7 + face] += 1);
            }
        }
        assert!(seen.into_iter().all(|times| times == 1));
    }

    /// Every photon beside paths belongs to exactly one task, and such a task follows no paths.
    #[test]
    fn photons_beside_paths_are_whole() {
        let beside = Some(Beside { ratio: 0.75, least: 5 });
        let schedule = Schedule { cuts: 3, beside, ..Schedule::new(1000, 1, 3) };
        for batch in 0..schedule.batches {
            let tasks = || 0..schedule.tasks(batch);
            let photons = tasks().filter_map(|task| schedule.photons_beside(batch, task));
            let mut next = 0;
            for (first, number) in photons {
                assert!(first == next && number >= 5);
                next += number;
            }
            let alone = |&task: &u64| schedule.faces(task, 7).is_empty();
            assert_eq!(tasks().filter(alone).count() as u64, schedule.tasks(batch) / 3);
            let faces: usize = tasks().map(|task| schedule.faces(task, 7).len()).sum();
            assert_eq!(faces as u64, 7 * schedule.tasks(batch) / 3);
        }
    }

    /// The photons before a task of the photon map are those of all tasks before it in the order of
    /// the map, in which each batch has its first task before any has its second.
    #[test]
    fn photons_before_a_task_are_those_of_the_tasks_before() {
        let beside = Some(Beside { ratio: 0.75, least: 5 });
        let alone = Schedule::new(1000, 1, 3);
        for schedule in [alone, Schedule { cuts: 3, beside, ..alone }] {
            let mut keys: Vec<TaskKey> = schedule.keys(0..2, 0..schedule.batches).collect();
            keys.sort_unstable();
            let mut before = 0;
            for key in keys {
                let photons = schedule.photons(key.2, key.1);
                assert!(photons == 0 || schedule.photons_before(key) == before, "{key:?}");
                before += photons;
            }
        }
    }
}
