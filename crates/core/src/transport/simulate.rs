//! Runs: from a scene and settings to totals and a photon map.
//!
//! A run is cut into batches of histories, which are the unit of statistics, and each batch into
//! tasks, which are the unit of scheduling. Sums of tasks are merged in order. Each task emits
//! every light in its exact share, and each random stream belongs to one (seed, purpose, batch,
//! history). The result therefore depends neither on the number of threads nor on the moment at
//! which a run ends early.
//!
//! Reading order: `histories` says what the histories of a run are, `schedule` cuts the run, `task`
//! follows the histories of one task, and `beside` the photons beside paths; `batches` puts tasks on
//! threads, `until` ends runs that are accurate enough or out of time. `plan`, `trial`, `tried`,
//! `pilot` and `lamps` are the short runs that come before; `checkpoint` divides one run over time, and
//! `shard` over machines.

mod accuracy;
mod batches;
mod beside;
mod checkpoint;
mod division;
mod found_and_unseen;
mod histories;
mod lamps;
mod light_by_light;
mod memory;
mod pilot;
mod plan;
mod schedule;
mod shard;
mod simulation;
mod stored;
mod surfaces;
mod task;
mod trial;
mod tried;
mod until;
mod watched;
mod within;

use std::{
    sync::{
        Arc, Mutex,
        atomic::{AtomicBool, AtomicU64, Ordering},
    },
    time::Instant,
};

use crate::{
    error::{Error, NOTHING_WRITTEN, Result, catch_panic, lock, unlocked},
    math::{machine, rng::Purpose},
    scene::{captor::Captor, light::Strata, patches::Patches, world::Scene},
    transport::{
        guiding::{Guidance, too_small_to_aim_at},
        nearest,
        paths::{Face, Pilot, Told, Unseen, reached, unaimed},
        photon_map::{MapBuilder, PhotonMap},
        settings::{Estimator, Guiding, PhotonCount, Settings},
        tally::{Tally, Totals},
    },
};

pub use accuracy::{Accuracy, Dark, FaceBand, Worst};
pub use checkpoint::{Keeper, KeptArrivals, Resumed, RunState};
pub use found_and_unseen::found_and_unseen;
pub use histories::check_photons;
use histories::{Histories, MIN_PATHS, TASK, Work};
pub use light_by_light::{photons_by_light, simulate_light_by_light};
pub use memory::map_bytes;
pub use plan::Plan;
pub use schedule::BATCHES;
use schedule::{Beside, Schedule};
pub use shard::{Joined, ShardSums, check_shardable, simulate_shard};
pub use simulation::Simulation;
pub use surfaces::{focused_light, light_surfaces};
pub use trial::Choice;

/// How far a run has come.
#[derive(Clone, Copy, Debug)]
pub struct Progress {
    /// Number of photons, or paths, done.
    pub photons: u64,
    /// Number of photons, or paths, to do, if it is known.
    pub of: Option<u64>,
    /// With a tolerance: the value that was farthest from it when the run was last checked.
    pub worst: Option<Worst>,
}

/// How a caller watches and stops a run.
pub struct Control<'a> {
    /// Setting it to `true` ends the run with an error.
    pub stop: &'a AtomicBool,
    /// Is called now and then, from any thread.
    pub progress: &'a (dyn Fn(Progress) + Sync),
}

impl Default for Control<'_> {
    /// Neither watches nor stops a run.
    fn default() -> Self {
        static NEVER: AtomicBool = AtomicBool::new(false);
        Self { stop: &NEVER, progress: &|_| {} }
    }
}

/// Why a run ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum End {
    /// All histories are done.
    Photons,
    /// The tolerance is met.
    Tolerance,
    /// The time is up.
    Time,
}

/// What a run has found.
struct Outcome {
    estimator: Estimator,
    beside: Option<u64>,
    by_photons: Arc<[bool]>,
    choice: Option<Choice>,
    guiding: Guiding,
    starved: bool,
    totals: Totals,
    map: Option<PhotonMap>,
    unseen: Option<Unseen>,
    too_small: Vec<bool>,
    end: End,
    accuracy: Option<Accuracy>,
    threads: usize,
}

/// Runs `scene`. Errors: there are fewer photons than lights; there is no captor for paths to start
/// from; paths are to be split by light; `control` stops the run; no threads are to be had; there
/// are too many captors for a time limit; `control`'s callback or the program panics. Where a setting
/// is the reason, its name is the place of the error.
pub fn simulate<'s>(
    scene: &'s Scene,
    settings: &Settings,
    control: &Control,
) -> Result<Simulation<'s>> {
    simulate_kept(scene, settings, control, None)
}

/// Like [`simulate`], but `keeper` saves what the run has done, so that it can be resumed. Error
/// besides: there is a time limit, which would end a resumed run elsewhere.
pub fn simulate_kept<'s>(
    scene: &'s Scene,
    settings: &Settings,
    control: &Control,
    keeper: Option<&Keeper>,
) -> Result<Simulation<'s>> {
    if keeper.is_some() && settings.max_time.is_some() {
        let problem = "a time limit ends a run for good, and this one is to be gone on with";
        return Err(Error::input("checkpoint", problem).remedy(
            "leave the time limit out: whenever the run is killed, the same command goes on",
        ));
    }
    let outcome = catch_panic("run", || {
        let plan = &Plan::make(scene, settings, control)?;
        let mut run = Run::planned(scene, plan, part_of(scene, settings), control)?;
        run.kept.keeper = keeper;
        Ok(Outcome { choice: plan.choice.clone(), ..run.go()? })
    })?;
    Ok(Simulation::new(scene, settings, outcome))
}

/// Returns the part in which each light is counted; an empty list if results are not split by
/// light.
fn part_of(scene: &Scene, settings: &Settings) -> Vec<usize> {
    if settings.by_light { (0..scene.lights().len()).collect() } else { Vec::new() }
}

/// Like [`simulate`], but each light is also counted in a part: light l in part `part_of[l]`.
/// Several lights may share a part; parts are numbered from 0 without gaps. An empty list splits
/// nothing; otherwise photons are traced where a trial was to choose, as only they know their lights.
pub fn simulate_split<'s>(
    scene: &'s Scene,
    settings: &Settings,
    part_of: Vec<usize>,
    control: &Control,
) -> Result<Simulation<'s>> {
    let estimator = match settings.estimator {
        Estimator::Auto if !part_of.is_empty() => Estimator::Photons,
        named => named,
    };
    let settings = &Settings { estimator, ..settings.clone() };
    let outcome = catch_panic("run", || {
        let plan = &Plan::make(scene, settings, control)?;
        Run::planned(scene, plan, part_of, control)?.go()
    })?;
    Ok(Simulation::new(scene, settings, outcome))
}

/// A run: its scene and settings, what its histories are, what it keeps, and the state that its threads
/// share.
struct Run<'a> {
    scene: &'a Scene,
    settings: &'a Settings,
    /// The purpose of its random numbers.
    purpose: Purpose,
    control: &'a Control<'a>,
    pool: rayon::ThreadPool,
    started: Instant,
    histories: Histories<'a>,
    /// The part in which each light is counted; empty if nothing is split.
    part_of: Vec<usize>,
    kept: Kept<'a>,
    shared: Shared,
}

/// What a run keeps beside its sums.
struct Kept<'a> {
    arrivals: Arrivals<'a>,
    /// The most bytes that the arrivals may take, and whether they took more.
    room: u64,
    too_large: AtomicBool,
    /// Saves what the run has done, if it may have to be resumed.
    keeper: Option<&'a Keeper<'a>>,
}

impl<'a> Kept<'a> {
    fn new(arrivals: Arrivals<'a>) -> Self {
        let too_large = AtomicBool::new(false);
        Self { arrivals, room: memory::map_room(), too_large, keeper: None }
    }
}

/// What the threads of a run share.
struct Shared {
    /// Number of photons, or of paths, done.
    done: AtomicU64,
    /// Whether a thread has panicked, so that the others need not go on.
    broken: AtomicBool,
    /// Per band, the bits of the largest irradiance that one path has found, W/m2 or umol/m2/s, or,
    /// for guided photons of a run with a tolerance, of the largest power times the histories of a
    /// task with which one has come to a captor, W or umol/s. The bits of floats that are not negative
    /// have the same order as the floats.
    brightest: Vec<AtomicU64>,
    /// Number of arrivals of photons beside paths at surfaces, and how many of them are light that paths
    /// leave to photons; counted in trials.
    arrivals: [AtomicU64; 2],
}

impl Shared {
    fn new(bands: usize) -> Self {
        Self {
            done: AtomicU64::new(0),
            broken: AtomicBool::new(false),
            brightest: (0..bands).map(|_| AtomicU64::new(0)).collect(),
            arrivals: [AtomicU64::new(0), AtomicU64::new(0)],
        }
    }
}

/// The arrivals that the photon map keeps.
#[derive(Clone, Copy)]
enum Arrivals<'a> {
    /// Arrivals on captors, filed by channel.
    OnCaptors,
    /// All arrivals on surfaces, filed by smooth piece of surface and face.
    OnSurfaces(&'a Patches),
    /// Those of the photons that came by mirrors, refraction or gloss alone; photons are not
    /// followed any further.
    Focused(&'a Patches),
}

impl<'a> Run<'a> {
    /// A run as it was planned: planning is part of its time.
    fn planned(
        scene: &'a Scene,
        plan: &'a Plan<'a>,
        part_of: Vec<usize>,
        control: &'a Control<'a>,
    ) -> Result<Self> {
        let run = Self::of_plan(scene, &plan.settings, plan, part_of, control)?;
        Ok(Self { started: plan.started, ..run })
    }

    /// A run with what is known from its plan, whose settings are `settings`.
    fn of_plan(
        scene: &'a Scene,
        settings: &'a Settings,
        plan: &Plan<'a>,
        part_of: Vec<usize>,
        control: &'a Control<'a>,
    ) -> Result<Self> {
        let (arrivals, known) = (Arrivals::OnCaptors, plan.of_paths.clone());
        let run = Self::knowing(scene, settings, part_of, arrivals, control, known)?;
        let run = run.guided_by(plan.guidance.clone());
        let (Some(division), Work::Paths(_, pilot)) = (&plan.division, &run.histories.work) else {
            return Ok(run);
        };
        let by_photons = division.by_photons.clone();
        let work = Work::Paths(faces_of_paths(scene, &by_photons), pilot.clone());
        let beside = Some(Beside { ratio: division.photons, least: scene.sources() as u64 });
        let histories = Histories { work, beside, by_photons, ..run.histories };
        Ok(Self { histories, ..run })
    }

    fn new(
        scene: &'a Scene,
        settings: &'a Settings,
        part_of: Vec<usize>,
        arrivals: Arrivals<'a>,
        control: &'a Control<'a>,
    ) -> Result<Self> {
        Self::knowing(scene, settings, part_of, arrivals, control, None)
    }

    /// A run whose paths take what pilot photons have found from `known`, if it is given.
    fn knowing(
        scene: &'a Scene,
        settings: &'a Settings,
        part_of: Vec<usize>,
        arrivals: Arrivals<'a>,
        control: &'a Control<'a>,
        known: Option<Arc<Pilot>>,
    ) -> Result<Self> {
        let started = Instant::now();
        let pool = machine::pool(settings.threads.get())?;
        let nearest = matches!(arrivals, Arrivals::OnCaptors) && settings.keeps_map();
        let counted = parts(&part_of).max(scene.parameters().variants().len());
        memory::check(scene, counted, pool.current_num_threads(), nearest)?;
        let work = match settings.estimator {
            // by now the estimator is known, even where a trial chooses it
            Estimator::Photons | Estimator::Auto => {
                let task = TASK.max((scene.sources() as u64).next_power_of_two());
                Work::Photons(Strata::new(scene.lights(), task, scene.lanes()))
            }
            Estimator::Paths | Estimator::Complete if !part_of.is_empty() => {
                let problem = "only photons know which light they come from";
                return Err(Error::input("by_light", problem)
                    .remedy("take photons as the estimator, or do not split by light"));
            }
            Estimator::Paths | Estimator::Complete if scene.captors().is_empty() => {
                return Err(Error::input("captors", "there are none for paths to start from")
                    .remedy("add a captor, or run photons"));
            }
            Estimator::Paths | Estimator::Complete => {
                let pilot = known.unwrap_or_else(|| Arc::new(Pilot::run(scene, settings.seed)));
                Work::Paths(faces(scene), pilot)
            }
        };
        Ok(Self {
            scene,
            settings,
            purpose: Purpose::Run,
            control,
            pool,
            started,
            histories: Histories::new(work),
            part_of,
            kept: Kept::new(arrivals),
            shared: Shared::new(scene.bands().len()),
        })
    }

    /// Returns the same run with photons that are guided by `guidance`.
    fn guided_by(self, guidance: Option<Guidance<'a>>) -> Self {
        Self { histories: self.histories.guided_by(self.scene, guidance), ..self }
    }

    /// Returns the number of parts of the light, or of variants of the scene, that are counted apart.
    fn parts(&self) -> usize {
        let variants = self.scene.parameters().variants().len();
        if self.purpose == Purpose::Run && variants > 0 { variants } else { parts(&self.part_of) }
    }

    fn tally(&self) -> Tally {
        let tally = Tally::new(self.scene, self.parts());
        let tally = if self.histories.guidance.is_some() { tally.weighing() } else { tally };
        if self.purpose == Purpose::Run { tally.with_moments(self.scene) } else { tally }
    }

    fn totals(&self) -> Totals {
        let totals = Totals::new(self.scene, self.parts());
        let totals = match self.purpose == Purpose::Run {
            true => totals.with_moments(self.scene),
            false => totals,
        };
        if self.histories.beside.is_some() {
            totals.beside_paths(self.scene, &self.histories.by_photons)
        } else {
            totals
        }
    }

    fn go(&self) -> Result<Outcome> {
        let photons = self.settings.photons_or_default();
        match (self.settings.tolerance, self.settings.max_time) {
            (Some(tolerance), _) => {
                let limit = self.settings.tolerance_limit.map(PhotonCount::get);
                self.until_accurate(tolerance.get(), limit)
            }
            (None, None) => {
                let schedule = self.histories.schedule(self.scene, photons)?;
                let (mut totals, map) = (self.totals(), self.map_builder());
                let of = Some(schedule.histories * self.histories.unit());
                let begin = self.begin(&schedule, &mut totals, map.as_ref())?;
                self.rounds(&schedule, begin, 0..1, of, &mut totals, map.as_ref())?;
                self.finish(totals, map, &schedule, End::Photons)
            }
            (None, Some(limit)) => {
                let schedule = self.histories.schedule(self.scene, photons)?;
                self.until_time(&schedule, limit.get())
            }
        }
    }

    fn map_builder(&self) -> Option<Mutex<MapBuilder>> {
        let photons =
            matches!(self.histories.work, Work::Photons(_)) || self.histories.beside.is_some();
        let asked = match self.kept.arrivals {
            Arrivals::OnCaptors => self.settings.keeps_map() && !self.scene.captors().is_empty(),
            Arrivals::OnSurfaces(_) | Arrivals::Focused(_) => true,
        };
        let limit = memory::map_limit(self.scene, self.settings);
        let bands = self.scene.bands().len();
        let builder = || match self.kept.arrivals {
            Arrivals::OnCaptors => {
                let k = self.settings.k.map(|k| k.get());
                MapBuilder::for_estimates(limit, bands, nearest::thinning(self.scene, k))
            }
            Arrivals::OnSurfaces(_) | Arrivals::Focused(_) => MapBuilder::new(limit, bands),
        };
        (photons && asked).then(|| Mutex::new(builder()))
    }

    fn finish(
        &self,
        mut totals: Totals,
        map: Option<Mutex<MapBuilder>>,
        schedule: &Schedule,
        end: End,
    ) -> Result<Outcome> {
        let rounds = totals.histories / schedule.histories;
        let beside = self.histories.beside.map(|_| rounds * schedule.all_beside());
        let photons = beside.unwrap_or(totals.histories);
        let build = |map: Mutex<MapBuilder>| {
            let builder = unlocked(map);
            let pool = machine::pool(self.settings.threads.get())?;
            Ok(pool.install(|| builder.build(photons, |key| schedule.photons_before(key))))
        };
        let map = map.map(build).transpose()?;
        let paths = totals.histories;
        totals.histories *= self.histories.unit();
        let (unseen, too_small) = match &self.histories.work {
            Work::Photons(_) | Work::Lights => {
                let targets =
                    self.histories.guidance.as_ref().and_then(|guidance| guidance.targets.as_ref());
                let unaimed = targets.and_then(|targets| {
                    let shows = |point, normal| targets.shows(point, normal);
                    unaimed(self.scene, shows, totals.histories, self.settings.seed)
                });
                let photons = Some(totals.histories);
                let too_small =
                    unaimed.map(|found| found.too_small(self.scene, &totals, 1, photons, &[]));
                let too_small = too_small.unwrap_or_default();
                (None, if targets.is_some() { self.or_tiny(too_small) } else { too_small })
            }
            Work::Paths(_, pilot) => {
                let Told { unseen, by_chance } = {
                    let rays = totals.segments;
                    Told::find(self.scene, pilot, self.settings.seed, rays)
                };
                let by_photons = &self.histories.by_photons;
                let too_small = by_chance
                    .map(|found| found.too_small(self.scene, &totals, paths, beside, by_photons));
                let missed = self.missed(&totals);
                let too_small = match (too_small, missed) {
                    (Some(mut all), missed) => {
                        all.iter_mut().zip(missed).for_each(|(any, missed)| *any |= missed);
                        all
                    }
                    (None, missed) => missed,
                };
                (unseen.filter(|_| beside.is_none()), too_small)
            }
        };
        Ok(Outcome {
            estimator: self.settings.estimator,
            beside,
            by_photons: self.histories.by_photons.clone(),
            choice: None,
            guiding: self.histories.guidance.as_ref().map_or(Guiding::Off, Guidance::guiding),
            starved: self.histories.guidance.as_ref().is_some_and(|guidance| guidance.starved),
            totals,
            map,
            unseen,
            too_small,
            end,
            accuracy: None,
            threads: self.pool.current_num_threads(),
        })
    }

    /// Returns, for each channel of captors and groups, whether paths have found nothing in a band of
    /// which photons find light there; empty if paths have found light in all bands everywhere. The
    /// photons take a small share of the rays of the run, but some tenths of a second are always
    /// worth it.
    fn missed(&self, totals: &Totals) -> Vec<bool> {
        const SHARE: u64 = 16;
        const RAYS: [u64; 2] = [1 << 18, 1 << 21];
        let Work::Paths(faces, _) = &self.histories.work else { return Vec::new() };
        let (scene, bands) = (self.scene, self.scene.bands().len());
        let found = |channel: usize| {
            let found = totals.running(channel)[..bands].iter();
            found.map(|band| band.above_zero() > 0)
        };
        let lit = |b: usize| scene.lights().iter().any(|light| light.power[b] > 0.0);
        let lit: Vec<bool> = (0..bands).map(lit).collect();
        let nothing = |channel| found(channel).zip(&lit).any(|(found, lit)| !found && *lit);
        let dark: Vec<&Face> = faces.iter().filter(|face| nothing(channel(scene, face))).collect();
        if dark.is_empty() {
            return Vec::new();
        }
        let rays = (totals.segments / SHARE).clamp(RAYS[0], RAYS[1]);
        let reached = reached(scene, rays, self.settings.seed);
        let mut missed = vec![false; channels_with_groups(scene)];
        for face in dark {
            let own = channel(scene, face);
            for channel in with_groups(scene, face) {
                let reached = reached[own * bands..][..bands].iter();
                missed[channel] |=
                    found(channel).zip(reached).any(|(found, light)| !found && *light);
            }
        }
        missed
    }

    /// Adds to a list of channels whose errors are too small those of captors that are too small to be
    /// aimed at, whose light guided photons miss.
    fn or_tiny(&self, too_small: Vec<bool>) -> Vec<bool> {
        let tiny = too_small_to_aim_at(self.scene);
        if tiny.is_empty() {
            return too_small;
        }
        let mut all = too_small;
        all.resize(channels_with_groups(self.scene), false);
        let faces = faces(self.scene);
        for face in faces.iter().filter(|face| tiny.binary_search(&face.captor).is_ok()) {
            with_groups(self.scene, face).for_each(|channel| all[channel] = true);
        }
        all
    }

    fn report(&self, of: Option<u64>, worst: Option<Worst>) {
        let photons = self.shared.done.load(Ordering::Relaxed);
        (self.control.progress)(Progress { photons, of, worst });
    }

    fn time_is_up(&self) -> bool {
        self.settings.max_time.is_some_and(|limit| self.started.elapsed() >= limit.get())
    }

    fn stopped(&self) -> bool {
        self.control.stop.load(Ordering::Relaxed) || self.broken()
    }

    fn broken(&self) -> bool {
        self.shared.broken.load(Ordering::Relaxed)
    }

    fn check_stopped(&self) -> Result<()> {
        if self.kept.too_large.load(Ordering::Relaxed) {
            return Err(memory::map_too_large(self.scene));
        }
        if self.stopped() {
            return Err(Error::interrupted("run", NOTHING_WRITTEN));
        }
        Ok(())
    }
}

/// Returns the faces of all captors.
fn faces(scene: &Scene) -> Vec<Face<'_>> {
    let of = |(c, captor): (usize, &Captor)| {
        captor.kind.faces().iter().map(move |&face| Face::new(scene, c, face))
    };
    scene.captors().iter().enumerate().flat_map(of).collect()
}

/// Returns the channel of a face.
fn channel(scene: &Scene, face: &Face) -> usize {
    scene.captors()[face.captor].first_channel + face.channel as usize
}

/// Returns the number of channels of all captors and groups.
fn channels_with_groups(scene: &Scene) -> usize {
    scene.channels() + scene.groups().len() * scene.group_channels()
}

/// Returns the channels of a face and of the groups that it belongs to.
fn with_groups(scene: &Scene, face: &Face) -> impl Iterator<Item = usize> {
    let groups = scene.captors()[face.captor].groups.iter();
    let of_group = |group: &usize| scene.first_channel_of_group(*group) + face.channel as usize;
    groups.map(of_group).chain([channel(scene, face)])
}

/// Returns the faces from which paths start, where all photons count `by_photons`.
fn faces_of_paths<'a>(scene: &'a Scene, by_photons: &[bool]) -> Vec<Face<'a>> {
    let mut all = faces(scene);
    all.retain(|face| !by_photons.get(channel(scene, face)).is_some_and(|&alone| alone));
    all
}

/// Returns the least number of paths of a run, over all faces.
pub fn least_paths(scene: &Scene) -> u64 {
    MIN_PATHS * scene.captors().iter().map(|captor| captor.kind.faces().len() as u64).sum::<u64>()
}

/// Returns the number of parts.
fn parts(part_of: &[usize]) -> usize {
    part_of.iter().max().map_or(0, |last| last + 1)
}
