//! How much work the tracing of light takes, counted and not timed, so that it is the same on every
//! machine: what two ways to find light take is compared by it.
//!
//! Counting takes time itself. A thread counts only while it has been asked to, as in the trials
//! before a run. One unit is about a nanosecond on a processor of 2020; only their proportions matter.
//! They are those with which the counts of 51 runs of eleven shipped scenes, by photons, guided or not,
//! by paths and by complete paths, come closest to their CPU time; `cargo bench --bench choices` shows
//! how far off they are.

use std::cell::Cell;

/// A ray that is cast, beside what it visits.
pub const RAY: u64 = 40;
/// A visit of a node of a tree of boxes, or of a leaf: eight boxes or triangles are tested.
pub const VISIT: u64 = 19;
/// A straight piece of the way of a photon or path: how it is scattered, and counted.
pub const SEGMENT: u64 = 8;
/// A path that starts on a face.
pub const PATH: u64 = 50;
/// A point of a path at which light is gathered.
pub const VERTEX: u64 = 110;
/// A light that is weighed against others at a point.
pub const LIGHT: u64 = 7;
/// A direction of the sky that is sampled.
pub const SKY: u64 = 220;
/// A captor that is weighed against others as the target of a flight.
pub const TARGET: u64 = 3;

thread_local! {
    static COUNTS: Cell<bool> = const { Cell::new(false) };
    static SPENT: Cell<u64> = const { Cell::new(0) };
}

/// Returns whether this thread counts.
#[inline(always)]
pub fn is_counted() -> bool {
    COUNTS.get()
}

/// Adds so many units, if this thread counts.
#[inline(always)]
pub fn spend(units: u64) {
    if is_counted() {
        SPENT.set(SPENT.get() + units);
    }
}

/// Does something, and returns how much was spent on it in this thread.
pub fn count(does: impl FnOnce()) -> u64 {
    let before = (COUNTS.replace(true), SPENT.replace(0));
    does();
    COUNTS.set(before.0);
    SPENT.replace(before.1)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What is done while nobody counts is not counted, and what is done meanwhile is counted once.
    #[test]
    fn only_what_is_asked_for_is_counted() {
        spend(RAY);
        assert_eq!(count(|| [VISIT, RAY].into_iter().for_each(spend)), VISIT + RAY);
        assert_eq!((count(|| ()), is_counted()), (0, false));
    }
}
