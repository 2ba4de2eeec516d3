//! One run on several machines: each traces a shard of the batches, and the results are added up as
//! if one machine had traced them all.

use std::{ops::Range, sync::Mutex};

use super::{
    Choice, Control, End, Outcome, Plan, Run, Simulation, batches::Turn, memory::most_open,
    part_of, schedule::Schedule,
};
use crate::{
    error::{Error, Result, catch_panic, unlocked},
    scene::{captor::CaptorKind, world::Scene},
    transport::{
        photon_map::{MapBuilder, Seen, TaskArrivals, TaskKey},
        settings::Settings,
        shard::Shard,
        tally::{Sums, Tally, Totals},
    },
};

/// The result of the batches of a shard.
#[derive(Debug)]
pub struct ShardSums {
    /// The sums of each batch, with the index of the batch, in order.
    pub batches: Vec<(u64, Sums)>,
    /// The arrivals for the photon map, in order.
    pub tasks: Vec<(TaskKey, TaskArrivals)>,
    /// The first task whose arrivals no longer fit into the photon map of these batches.
    pub end: Option<TaskKey>,
}

/// Checks that a run with these settings can be cut into shards. Error: there is a tolerance or a
/// time limit.
pub fn check_shardable(settings: &Settings) -> Result<()> {
    let (problem, remedy) = match settings {
        Settings { tolerance: Some(_), .. } => (
            "when a tolerance is met only all batches together can tell",
            "take it out, and give the number of photons",
        ),
        Settings { max_time: Some(_), .. } => (
            "a time limit means another number of photons on each machine",
            "take it out, and give the number of photons",
        ),
        _ => return Ok(()),
    };
    Err(Error::input("shard", problem).remedy(remedy))
}

/// Runs the batches of a shard. Errors: those of a run; there are more shards than batches; the
/// settings are not [shardable](check_shardable).
pub fn simulate_shard(
    scene: &Scene,
    plan: &Plan,
    shard: Shard,
    control: &Control,
) -> Result<ShardSums> {
    check_shardable(&plan.settings)?;
    catch_panic("run", || {
        let part_of = part_of(scene, &plan.settings);
        Run::planned(scene, plan, part_of, control)?.shard_sums(shard)
    })
}

impl Run<'_> {
    fn shard_schedule(&self) -> Result<Schedule> {
        self.histories.schedule(self.scene, self.settings.photons_or_default())
    }

    fn shard_sums(&self, shard: Shard) -> Result<ShardSums> {
        let schedule = self.shard_schedule()?;
        if shard.of() as u64 > schedule.batches {
            let problem = format!("{} shards of a run of {} batches", shard.of(), schedule.batches);
            return Err(Error::input("shard", problem).remedy("ask for fewer shards"));
        }
        let range = shard.range(schedule.batches);
        let bytes = Tally::bytes(self.scene, self.parts(), usize::MAX);
        if (bytes as u64).saturating_mul(range.end - range.start) > most_open() {
            let problem =
                "the batch sums of so many captors, lights and bands do not fit into memory";
            return Err(Error::input("shard", problem).remedy("ask for more shards"));
        }
        let histories: u64 = range.clone().map(|batch| schedule.batch(batch)).sum();
        let map = self.map_builder();
        let mut batches = Vec::new();
        let mut take = |turn: Turn| {
            if let Turn::Add(batch, sums) = turn {
                batches.push((batch, sums));
            }
        };
        let of = Some(histories * self.histories.unit());
        self.batches(&|_| schedule, (0, 0, 0), 0..1, range, of, &mut take, map.as_ref())?;
        let map = map.map(unlocked);
        let (tasks, end) = map.map_or_else(Default::default, MapBuilder::into_pieces);
        Ok(ShardSums { batches, tasks: tasks.into_iter().collect(), end })
    }
}

/// A run that is put together from its shards.
pub struct Joined<'a> {
    run: Run<'a>,
    schedule: Schedule,
    totals: Totals,
    /// An empty tally, against which sums are checked.
    tally: Tally,
    /// The batch that comes next.
    next: u64,
    map: Option<MapBuilder>,
    /// The reason for the estimator, if a trial has chosen it.
    choice: Option<Choice>,
}

impl<'a> Joined<'a> {
    /// Starts with no batches. `settings` are those of the run, and leave no choice to a trial.
    /// Errors: those of a run; the settings are not [shardable](check_shardable).
    pub fn new(
        scene: &'a Scene,
        settings: &'a Settings,
        choice: Option<Choice>,
        control: &'a Control<'a>,
    ) -> Result<Self> {
        check_shardable(settings)?;
        let plan = Plan::again(scene, settings, choice.clone(), control)?;
        let run = Run::of_plan(scene, settings, &plan, part_of(scene, settings), control)?;
        let (schedule, totals, tally) = (run.shard_schedule()?, run.totals(), run.tally());
        let map = run.map_builder();
        let map = map.map(unlocked);
        Ok(Self { run, schedule, totals, tally, next: 0, map, choice })
    }

    /// Returns the batches of a shard.
    pub fn range(&self, shard: Shard) -> Range<u64> {
        shard.range(self.schedule.batches)
    }

    /// Adds a batch; batches must come in order. `None` if the batch does not belong to this run.
    pub fn add_batch(&mut self, batch: u64, sums: Sums) -> Option<()> {
        if batch != self.next || batch >= self.schedule.batches {
            return None;
        }
        self.tally.fits(&sums).then_some(())?;
        self.totals.add_batch(self.run.scene, &sums, self.schedule.batch(batch));
        self.next += 1;
        Some(())
    }

    /// Adds the arrivals of a task, given as words, to the photon map. `None` if they do not belong
    /// to this run.
    pub fn add_task(&mut self, key: TaskKey, words: &[u32]) -> Option<()> {
        if key.0 != 0 {
            return None;
        }
        let map = self.map.as_mut()?;
        let found = check_arrivals(self.run.scene, &self.schedule, key, words, map)?;
        map.add(key, found);
        Some(())
    }

    /// Takes into account that the photon map of a shard ended before task `end`.
    pub fn end_at(&mut self, end: TaskKey) {
        self.map.iter_mut().for_each(|map| map.end_at(end));
    }

    /// Returns the result of the whole run. Error: batches are missing.
    pub fn finish(self) -> Result<Simulation<'a>> {
        let Self { run, schedule, totals, next, map, choice, .. } = self;
        if next != schedule.batches {
            return Err(
                Error::input("merge", "not all batches are there").remedy("name all shards")
            );
        }
        let map = map.map(Mutex::new);
        let found = run.finish(totals, map, &schedule, End::Photons)?;
        Ok(Simulation::new(run.scene, run.settings, Outcome { choice, ..found }))
    }
}

/// Reads the arrivals of a task from their [words](TaskArrivals::words), for this `map`. `None` if they
/// cannot come from a run of `scene` by `schedule`.
pub(super) fn check_arrivals(
    scene: &Scene,
    schedule: &Schedule,
    (_, task, batch): TaskKey,
    words: &[u32],
    map: &MapBuilder,
) -> Option<TaskArrivals> {
    if batch >= schedule.batches || task >= schedule.tasks(batch) {
        return None;
    }
    let found = TaskArrivals::from_words(words, scene.bands().len())?;
    let photons = schedule.photons(batch, task);
    for arrival in found.arrivals() {
        let captor = scene.captors().partition_point(|c| c.first_channel <= arrival.bin as usize);
        let captor = scene.captors().get(captor.checked_sub(1)?)?;
        let triangles = match captor.kind {
            CaptorKind::Surface => scene.triangles().len(),
            CaptorKind::Virtual { .. } => scene.captor_shapes(),
        };
        let photon = &arrival.photon;
        let fits = (arrival.bin as usize) < scene.channels()
            && (photon.triangle as usize) < triangles
            && (photon.light as usize) < scene.lights().len()
            && u64::from(photon.history) < photons;
        fits.then_some(())?;
    }
    let is_possible = |seen: &Seen| {
        let histories = u64::from(seen.histories);
        map.uses(seen.bin) && seen.histories <= seen.photons && histories <= photons
    };
    found.seen().iter().all(is_possible).then_some(found)
}
