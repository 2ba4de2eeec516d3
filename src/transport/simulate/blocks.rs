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
                while taken.0 != block {
                    taken = turn.wait(taken).unwrap_or_else(PoisonError::into_inner);
                }
                (taken.1)(block, &mut sums);
                taken.0 += 1;
                turn.notify_all();
            }
        });
        self.check_stopped()
    }
}
