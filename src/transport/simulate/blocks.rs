//! Blocks on threads, added up in order.

use std::{
    ops::Range,
    sync::{
        Condvar, Mutex, PoisonError,
        atomic::{AtomicU64, Ordering},
    },
};

use super::{Run, lock, plan::Plan};
use crate::{
    error::Result,
    transport::{
        photon_map::MapBuilder,
        tally::{Tally, Totals},
    },
};

impl Run<'_> {
    /// One round of blocks, added up in order.
    pub(super) fn round<const N: usize>(
        &self,
        plan: &Plan,
        round: u64,
        of: Option<u64>,
        totals: &mut Totals,
        map: Option<&Mutex<MapBuilder>>,
    ) -> Result<()> {
        let mut add = |block, sums: &mut Tally| {
            totals.add_block(self.scene, sums, plan.block(block));
        };
        self.blocks::<N>(plan, round, 0..plan.blocks, of, &mut add, map)
    }

    /// Some blocks of a round, each traced whole by one thread and handed over, to be emptied, in order.
    pub(super) fn blocks<const N: usize>(
        &self,
        plan: &Plan,
        round: u64,
        blocks: Range<u64>,
        of: Option<u64>,
        take: &mut (dyn FnMut(u64, &mut Tally) + Send),
        map: Option<&Mutex<MapBuilder>>,
    ) -> Result<()> {
        let next = AtomicU64::new(blocks.start);
        let taken = Mutex::new((blocks.start, take));
        let turn = Condvar::new();
        self.pool.broadcast(|_| {
            let _alarm = Alarm { run: self, turn: &turn, taken: &taken };
            let (mut piece_sums, mut sums) = (self.tally(), self.tally());
            loop {
                let block = next.fetch_add(1, Ordering::Relaxed);
                if block >= blocks.end {
                    return;
                }
                for piece in 0..plan.pieces(block) {
                    if self.stopped() {
                        break;
                    }
                    self.piece::<N>(plan, (round, piece, block), &mut piece_sums, map);
                    sums.drain(&mut piece_sums);
                    self.report(of, None);
                }
                let mut taken = lock(&taken);
                while taken.0 != block && !self.broken() {
                    taken = turn.wait(taken).unwrap_or_else(PoisonError::into_inner);
                }
                if self.broken() {
                    return;
                }
                (taken.1)(block, &mut sums);
                taken.0 += 1;
                turn.notify_all();
            }
        });
        self.check_stopped()
    }
}

/// Tells the other threads of a panic in the one that holds it: they would wait for its block for ever.
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
