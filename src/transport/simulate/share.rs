//! One run on several machines: each traces a share of the blocks, and what they found is added up as if
//! one had.

use std::{
    ops::Range,
    sync::{Mutex, PoisonError},
};

use super::{Control, End, Keep, Run, Simulation, memory::most_open, part_of, parts, plan::Plan};
use crate::{
    error::{Error, Result, catch_panic},
    math::spectrum::with_lanes,
    scene::{captor::CaptorKind, world::Scene},
    transport::{
        photon_map::{MapBuilder, Piece, PieceKey},
        settings::{Estimator, Settings},
        shard::Shard,
        tally::{Sums, Tally, Totals},
    },
};

/// What a share of a run's blocks found.
#[derive(Debug)]
pub struct Share {
    /// The sums of each block, with its index, in order.
    pub blocks: Vec<(u64, Sums)>,
    /// Arrivals for the photon map, in order.
    pub pieces: Vec<(PieceKey, Piece)>,
    /// The first piece whose arrivals no longer fit into the map of these blocks.
    pub end: Option<PieceKey>,
}

/// Refuses settings with which shares of a run would not know what to do.
pub fn check_shareable(settings: &Settings) -> Result<()> {
    let (problem, remedy) = match settings {
        Settings { tolerance: Some(_), .. } => (
            "when a tolerance is met only all blocks together can tell",
            "take it out, and give --photons",
        ),
        Settings { max_time: Some(_), .. } => (
            "a time limit means another number of photons on each machine",
            "take it out, and give --photons",
        ),
        Settings { estimator: Estimator::Auto, .. } => {
            ("what a trial chooses is not kept in the parts", "say --estimator photons, or paths")
        }
        _ => return Ok(()),
    };
    Err(Error::input("--shard", problem).remedy(remedy))
}

/// Runs the blocks of a shard. Errors: those of a run, more shards than blocks, settings that are not
/// [shareable](check_shareable).
pub fn simulate_share(
    scene: &Scene,
    settings: &Settings,
    shard: Shard,
    control: &Control,
) -> Result<Share> {
    check_shareable(settings)?;
    catch_panic("run", || {
        let run = Run::new(scene, settings, part_of(scene, settings), Keep::OnCaptors, control)?;
        with_lanes!(scene.lanes(), N => run.share::<N>(shard))
    })
}

impl Run<'_> {
    fn share_plan(&self) -> Result<Plan> {
        self.plan(self.settings.photons.unwrap_or(Settings::DEFAULT_PHOTONS))
    }

    fn share<const N: usize>(&self, shard: Shard) -> Result<Share> {
        let plan = self.share_plan()?;
        if shard.of() as u64 > plan.blocks {
            let problem = format!("{} shards of a run of {} blocks", shard.of(), plan.blocks);
            return Err(Error::input("--shard", problem).remedy("ask for fewer shards"));
        }
        let range = shard.range(plan.blocks);
        let bytes = Tally::bytes(self.scene, parts(&self.part_of));
        if (bytes as u64).saturating_mul(range.end - range.start) > most_open() {
            let problem =
                "the block sums of so many captors, lights and bands do not fit into memory";
            return Err(Error::input("--shard", problem).remedy("ask for more shards"));
        }
        let histories: u64 = range.clone().map(|block| plan.block(block)).sum();
        let map = self.map_builder();
        let mut blocks = Vec::new();
        let mut take = |block, sums: &mut Tally| blocks.push((block, sums.take()));
        let of = Some(histories * self.unit());
        self.blocks::<N>(&plan, 0, range, of, &mut take, map.as_ref())?;
        let map = map.map(|map| map.into_inner().unwrap_or_else(PoisonError::into_inner));
        let (pieces, end) = map.map_or_else(Default::default, MapBuilder::into_pieces);
        Ok(Share { blocks, pieces: pieces.into_iter().collect(), end })
    }
}

/// A run that is put together from its shares.
pub struct Joined<'a> {
    run: Run<'a>,
    plan: Plan,
    totals: Totals,
    tally: Tally,
    /// The block that comes next.
    next: u64,
    map: Option<MapBuilder>,
}

impl<'a> Joined<'a> {
    /// Nothing yet, of the run of `scene` with these settings.
    pub fn new(scene: &'a Scene, settings: &'a Settings, control: &'a Control<'a>) -> Result<Self> {
        check_shareable(settings)?;
        let run = Run::new(scene, settings, part_of(scene, settings), Keep::OnCaptors, control)?;
        let (plan, totals, tally) = (run.share_plan()?, run.totals(), run.tally());
        let map = run.map_builder();
        let map = map.map(|map| map.into_inner().unwrap_or_else(PoisonError::into_inner));
        Ok(Self { run, plan, totals, tally, next: 0, map })
    }

    /// The blocks of a shard.
    pub fn range(&self, shard: Shard) -> Range<u64> {
        shard.range(self.plan.blocks)
    }

    /// Adds a block; they come in order. None where it is not of this run.
    pub fn add_block(&mut self, block: u64, sums: Sums) -> Option<()> {
        if block != self.next || block >= self.plan.blocks {
            return None;
        }
        self.tally.fill(sums)?;
        self.totals.add_block(self.run.scene, &mut self.tally, self.plan.block(block));
        self.next += 1;
        Some(())
    }

    /// Adds the words of a piece of the photon map. None where it is not of this run.
    pub fn add_piece(&mut self, key: PieceKey, words: &[u32]) -> Option<()> {
        let scene = self.run.scene;
        let (round, piece, block) = key;
        if round != 0 || block >= self.plan.blocks || piece >= self.plan.pieces(block) {
            return None;
        }
        let found = Piece::from_words(words, scene.bands.len())?;
        let (_, histories) = self.plan.range(block, piece);
        for arrival in found.arrivals() {
            let captor =
                scene.captors.partition_point(|c| c.first_channel <= arrival.shelf as usize);
            let captor = scene.captors.get(captor.checked_sub(1)?)?;
            let triangles = match captor.kind {
                CaptorKind::Surface => scene.triangles(),
                CaptorKind::Virtual { .. } => scene.captor_triangles(),
            };
            let photon = &arrival.photon;
            let fits = (arrival.shelf as usize) < scene.channels()
                && (photon.triangle as usize) < triangles.len()
                && (photon.light as usize) < scene.lights.len()
                && u64::from(photon.history) < histories;
            fits.then_some(())?;
        }
        self.map.as_mut()?.add(key, found);
        Some(())
    }

    /// Takes in where the map of a share ended.
    pub fn end_at(&mut self, end: PieceKey) {
        self.map.iter_mut().for_each(|map| map.end_at(end));
    }

    /// What the whole run found. Error: blocks are missing.
    pub fn finish(self) -> Result<Simulation> {
        let Self { run, plan, totals, next, map, .. } = self;
        if next != plan.blocks {
            return Err(Error::input("merge", "not all blocks are there").remedy("name all parts"));
        }
        let map = map.map(Mutex::new);
        with_lanes!(run.scene.lanes(), N => run.finish::<N>(totals, map, &plan, End::Photons))
    }
}
