//! Runs that end when they are accurate enough, or when their time is up.

use std::{
    sync::{
        Mutex,
        atomic::{AtomicU64, Ordering},
    },
    time::{Duration, Instant},
};

use super::{BLOCKS, End, Run, Simulation, Work, lock, memory::most_open, parts, plan::Plan};
use crate::{
    error::{Error, Result},
    transport::{settings::MAX_PHOTONS, tally::Tally},
};

impl Run<'_> {
    /// Rounds of equal blocks, until every captor is accurate enough.
    pub(super) fn until_accurate<const N: usize>(
        &self,
        tolerance: f64,
        limit: Option<u64>,
    ) -> Result<Simulation> {
        let (piece, unit) = (self.full_piece(), self.unit());
        // a block is worth adding up once it has some photons for each captor; paths always have
        let enough = match self.work {
            Work::Photons(_) => self.scene.channels() as u64 / 8 / piece,
            Work::Paths(..) => 2,
        };
        let block = piece * enough.max(2);
        let whole = self.plan(limit.unwrap_or(u64::MAX).min(BLOCKS * block * unit))?;
        let short = self.less_than::<N>(&whole, whole.block(0))?;
        let rounds = match short {
            Some(_) => 1,
            None => (limit.unwrap_or(MAX_PHOTONS) / (whole.histories * unit)).max(1),
        };
        let plan = short.unwrap_or(whole);
        let (mut totals, map) = (self.totals(), self.map_builder());
        let (mut look, mut accuracy) = (1, None);
        let mut end = End::Photons;
        for round in 1..=rounds {
            self.round::<N>(&plan, round - 1, limit, &mut totals, map.as_ref())?;
            let time_is_up = short.is_some() || self.time_is_up();
            if round < look && round < rounds && !time_is_up {
                continue;
            }
            look = next_look(round);
            let found = self.accuracy(&plan, &totals, tolerance);
            let (met, worst) = (found.met, found.worst);
            accuracy = Some(found);
            if met {
                end = End::Tolerance;
                break;
            }
            self.report(limit, worst);
            if time_is_up {
                end = End::Time;
                break;
            }
        }
        Ok(Simulation { accuracy, ..self.finish::<N>(totals, map, &plan, end)? })
    }

    /// All blocks side by side, piece by piece, so that the run can end after any piece with
    /// blocks as if it had been asked for just so many photons.
    pub(super) fn until_time<const N: usize>(
        &self,
        plan: &Plan,
        limit: Duration,
    ) -> Result<Simulation> {
        let bytes = Tally::bytes(self.scene, parts(&self.part_of)) as u64 * plan.blocks;
        if bytes > most_open() {
            let gib = bytes as f64 / f64::from(1 << 30);
            return Err(Error::input(
                "max_time",
                format!("its block sums would take {gib:.0} GiB"),
            )
            .remedy("limit the run by photons or tolerance, or ask for fewer captors"));
        }
        if let Some(short) = self.less_than::<N>(plan, plan.block(0).min(plan.piece))? {
            let (mut totals, map) = (self.totals(), self.map_builder());
            let of = Some(short.histories * self.unit());
            self.round::<N>(&short, 0, of, &mut totals, map.as_ref())?;
            return self.finish::<N>(totals, map, &short, End::Time);
        }
        let map = self.map_builder();
        let blocks: Vec<Mutex<Tally>> =
            (0..plan.blocks).map(|_| Mutex::new(self.tally())).collect();
        let most = plan.pieces(0);
        let mut ended = *plan;
        let mut end = End::Photons;
        for piece in 0..most {
            let began = Instant::now();
            let next = AtomicU64::new(0);
            self.pool.broadcast(|_| {
                let mut piece_sums = self.tally();
                loop {
                    let block = next.fetch_add(1, Ordering::Relaxed);
                    if block >= plan.blocks || self.stopped() {
                        return;
                    }
                    if piece < plan.pieces(block) {
                        self.piece::<N>(plan, (0, piece, block), &mut piece_sums, map.as_ref());
                        lock(&blocks[block as usize]).drain(&mut piece_sums);
                        self.report(Some(plan.histories * self.unit()), None);
                    }
                }
            });
            self.check_stopped()?;
            // the last piece of a block is of another length: there the run is complete or not
            let whole = (0..plan.blocks).all(|b| piece + 1 < plan.pieces(b));
            // at the border nearest to the limit
            if self.started.elapsed() + began.elapsed() / 2 >= limit && whole {
                ended = plan.ended_after(piece + 1);
                end = End::Time;
                break;
            }
        }
        let mut totals = self.totals();
        for (block, sums) in blocks.iter().enumerate() {
            totals.add_block(self.scene, &mut lock(sums), ended.block(block as u64));
        }
        self.finish::<N>(totals, map, &ended, end)
    }

    /// With a time limit that will be up before each block of `plan` has done `most` histories: a
    /// plan that fits into it. Trials show how fast that goes, longer ones where short ones leave doubt.
    fn less_than<const N: usize>(&self, plan: &Plan, most: u64) -> Result<Option<Plan>> {
        let Some(limit) = self.settings.max_time else { return Ok(None) };
        let each = match &self.work {
            Work::Photons(_) => self.scene.sources() as u64,
            Work::Paths(..) => 1,
        };
        // like parts of all blocks
        let cut = |parts: u64| Plan { histories: plan.blocks * each * parts, ..*plan };
        let most = most / each;
        let mut parts = 1;
        while parts < most {
            let began = Instant::now();
            self.round::<N>(&cut(parts), 0, None, &mut self.totals(), None)?;
            self.done.store(0, Ordering::Relaxed);
            self.brightest.iter().for_each(|most| most.store(0, Ordering::Relaxed));
            let taken = began.elapsed();
            let left = limit.saturating_sub(self.started.elapsed());
            let fit = parts as f64 * left.as_secs_f64() / taken.as_secs_f64();
            if fit >= most as f64 {
                break;
            }
            if taken >= limit / 32 {
                return Ok(Some(cut((fit as u64).max(1))));
            }
            parts *= 2;
        }
        Ok(None)
    }
}

/// The round after which the tolerance is looked at again, after it was after `round`: each of the first six, then
/// after a quarter more. To look more often gives chance more occasions to end a run too early.
fn next_look(round: u64) -> u64 {
    (round + 1).max((5 * round + 2) / 4)
}

#[cfg(test)]
mod tests {
    use super::next_look;

    #[test]
    fn looks_become_rarer() {
        let looks: Vec<u64> =
            std::iter::successors(Some(1), |&at| Some(next_look(at))).take(13).collect();
        assert_eq!(looks, [1, 2, 3, 4, 5, 6, 8, 10, 13, 16, 20, 25, 31]);
    }
}
