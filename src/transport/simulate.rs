//! Batches, threads, ordered merge: from a scene and settings to totals and a photon map.
//!
//! A run is cut into batches of histories, a batch into tasks. Each task emits every light in its
//! exact share, and random streams belong to (seed, purpose, batch, history): so neither the number of
//! threads nor the moment at which a run ends early can be seen in what it found.

mod accuracy;
mod batches;
mod checkpoint;
mod found_and_unseen;
mod lamps;
mod memory;
mod mixed;
mod pilot;
mod plan;
mod schedule;
mod shard;
mod surfaces;
mod task;
mod trial;
mod tried;
mod until;
mod watched;

use std::{
    sync::{
        Mutex, MutexGuard, PoisonError,
        atomic::{AtomicBool, AtomicU64, Ordering},
    },
    time::Instant,
};

use crate::{
    error::{Error, NOTHING_WRITTEN, Result, catch_panic},
    math::{machine, rng::Purpose},
    scene::{captor::Captor, light::Strata, patches::Patches, world::Scene},
    transport::{
        guiding::Guidance,
        paths::{Face, Pilot, Told, Unseen},
        photon_map::{Arrival, MapBuilder, PhotonMap},
        settings::{Estimator, Guiding, Settings},
        tally::{Tally, Totals},
    },
};

pub use accuracy::{Accuracy, Dark, FaceBand, Worst};
pub use checkpoint::{Keeper, KeptArrivals, Resumed, RunState};
pub use found_and_unseen::found_and_unseen;
pub use plan::Plan;
pub use schedule::BATCHES;
use schedule::Schedule;
pub use shard::{Joined, ShardSums, check_shardable, simulate_shard};
pub use surfaces::{focused_light, light_surfaces};
pub use trial::{Choice, other_estimator};

/// Histories of a task, unless there are more lights than that.
const TASK: u64 = 1024;
/// The least number of paths from each face.
const MIN_PATHS: u64 = 100;
/// The most memory that the photon map may take, bytes. Building it takes twice as much, and in a
/// room of mirrors the task of each thread may be as large.
const MAX_MAP_BYTES: usize = 1 << 30;

/// How far a run has come.
#[derive(Clone, Copy, Debug)]
pub struct Progress {
    /// Histories done.
    pub photons: u64,
    /// Histories to do, where that is known.
    pub of: Option<u64>,
    /// With a tolerance: what was farthest from it when it was last looked at.
    pub worst: Option<Worst>,
}

/// What a run is watched and stopped by.
pub struct Control<'a> {
    /// Set it to end the run with an error.
    pub stop: &'a AtomicBool,
    /// Called now and then, from any thread.
    pub progress: &'a (dyn Fn(Progress) + Sync),
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

/// What a run found.
pub struct Simulation {
    /// What was traced: photons or paths.
    pub estimator: Estimator,
    /// Why, where a trial has chosen it.
    pub choice: Option<Choice>,
    /// What guided photons.
    pub guiding: Guiding,
    /// Whether too little was found to say how lamps are to emit.
    pub starved: bool,
    /// Sums per captor, group and band, and the ledger.
    pub totals: Totals,
    /// Stored arrivals on captors; none for k = 0.
    pub map: Option<PhotonMap>,
    /// In a run of paths: what they cannot find, where there may be such light.
    pub unseen: Option<Unseen>,
    /// Per channel of captors and groups, whether photons know of more light there that paths find by chance alone than
    /// its error does; empty where there is no such light, and in a run of photons.
    pub too_small: Vec<bool>,
    /// Why it ended.
    pub end: End,
    /// With a tolerance: whether it is met, and what is farthest from it.
    pub accuracy: Option<Accuracy>,
    /// Threads that took part.
    pub threads: usize,
}

/// Runs `scene`. Errors: fewer photons than lights, no captor for paths to start from, paths that are
/// to be split by light, stopped by `control`, no threads to be had, too many captors for a time limit, a
/// panic in `control`'s callback or in the program.
pub fn simulate(scene: &Scene, settings: &Settings, control: &Control) -> Result<Simulation> {
    simulate_kept(scene, settings, control, None)
}

/// Like [`simulate`], and what it does is kept, to be gone on with. Errors besides: a time limit, which would end it
/// elsewhere each time.
pub fn simulate_kept(
    scene: &Scene,
    settings: &Settings,
    control: &Control,
    keeper: Option<&Keeper>,
) -> Result<Simulation> {
    if keeper.is_some() && settings.max_time.is_some() {
        let problem = "a time limit ends a run for good, and this one is to be gone on with";
        return Err(Error::input("--checkpoint", problem).remedy(
            "leave the time limit out: whenever the run is killed, the same command goes on",
        ));
    }
    catch_panic("run", || {
        let Plan { settings, choice, guidance } = &Plan::make(scene, settings, control)?;
        let part_of = part_of(scene, settings);
        let run = Run::new(scene, settings, part_of, Keep::OnCaptors, control)?;
        let run = Run { keeper, ..run.guided_by(guidance.clone()) };
        Ok(Simulation { choice: choice.clone(), ..run.go()? })
    })
}

/// Like [`simulate`] of photons, each light in a part of its own, without what comes straight or through thin
/// panes from a sun to a captor: [`direct_sun`](crate::transport::direct_sun) finds that better.
pub fn simulate_without_direct_sun(
    scene: &Scene,
    settings: &Settings,
    control: &Control,
) -> Result<Simulation> {
    let settings =
        Settings { estimator: Estimator::Photons, by_light: true, k: Some(0), ..settings.clone() };
    catch_panic("run", || {
        let Plan { settings, guidance, .. } = &Plan::make(scene, &settings, control)?;
        // copies of a photon do not know whether it comes straight
        let guidance = guidance.as_ref().and_then(|_| Guidance::aim(scene));
        let part_of = part_of(scene, settings);
        let run = Run::new(scene, settings, part_of, Keep::OnCaptors, control)?;
        let run = Run { without_direct_sun: true, ..run.guided_by(guidance) };
        run.go()
    })
}

/// The part that each light is counted in.
fn part_of(scene: &Scene, settings: &Settings) -> Vec<usize> {
    if settings.by_light { (0..scene.lights.len()).collect() } else { Vec::new() }
}

/// Like [`simulate`], of photons or paths; each light is also counted in a part of its own or of several, from 0
/// without gaps. An empty list splits nothing.
pub fn simulate_split(
    scene: &Scene,
    settings: &Settings,
    part_of: Vec<usize>,
    control: &Control,
) -> Result<Simulation> {
    catch_panic("run", || {
        let Plan { settings, guidance, .. } = &Plan::make(scene, settings, control)?;
        let run = Run::new(scene, settings, part_of, Keep::OnCaptors, control)?;
        run.guided_by(guidance.clone()).go()
    })
}

struct Run<'a> {
    scene: &'a Scene,
    settings: &'a Settings,
    keep: Keep<'a>,
    /// What its random numbers are for.
    purpose: Purpose,
    control: &'a Control<'a>,
    pool: rayon::ThreadPool,
    started: Instant,
    work: Work<'a>,
    /// What guides photons, if they are guided.
    guidance: Option<Guidance<'a>>,
    /// The part that each light is counted in; empty where nothing is split.
    part_of: Vec<usize>,
    /// Whether photons of suns count only once they have been scattered.
    without_direct_sun: bool,
    done: AtomicU64,
    /// Keeps what it does.
    keeper: Option<&'a Keeper<'a>>,
    /// Whether a thread has panicked, so that the others need not go on.
    broken: AtomicBool,
    /// Of paths, per band: the bits of the largest irradiance that one of them found. Bits of floats that are not
    /// negative have the order of these.
    brightest: Vec<AtomicU64>,
}

/// Which photons the map keeps.
#[derive(Clone, Copy)]
enum Keep<'a> {
    /// Those on captors, filed by channel.
    OnCaptors,
    /// All, filed by smooth piece of surface and face.
    OnSurfaces(&'a Patches),
    /// Those of them that came by mirrors, refraction or gloss alone; none is followed beyond that.
    Focused(&'a Patches),
}

/// What one history is.
enum Work<'a> {
    /// A photon; the lights' shares in a task of the usual length.
    Photons(Strata),
    /// A path from each of these faces, and what pilot photons have found for them.
    Paths(Vec<Face<'a>>, Pilot),
}

impl<'a> Run<'a> {
    fn new(
        scene: &'a Scene,
        settings: &'a Settings,
        part_of: Vec<usize>,
        keep: Keep<'a>,
        control: &'a Control<'a>,
    ) -> Result<Self> {
        let started = Instant::now();
        let pool = machine::pool(settings.threads)?;
        let nearest = matches!(keep, Keep::OnCaptors) && settings.k != Some(0);
        memory::check(scene, parts(&part_of), pool.current_num_threads(), nearest)?;
        let work = match settings.estimator {
            // what a trial finds cheaper is known by now
            Estimator::Photons | Estimator::Auto => {
                let task = TASK.max((scene.sources() as u64).next_power_of_two());
                Work::Photons(Strata::new(&scene.lights, task, scene.lanes()))
            }
            Estimator::Paths if !part_of.is_empty() => {
                let problem = "only photons know which light they come from";
                return Err(Error::input("--by-light", problem).remedy("add --estimator photons"));
            }
            Estimator::Paths if scene.captors.is_empty() => {
                return Err(Error::input("captors", "there are none for paths to start from")
                    .remedy("add a captor, or run photons"));
            }
            Estimator::Paths => Work::Paths(faces(scene), Pilot::run(scene, settings.seed)),
        };
        let (done, broken) = (AtomicU64::new(0), AtomicBool::new(false));
        let brightest = scene.bands.iter().map(|_| AtomicU64::new(0)).collect();
        Ok(Self {
            scene,
            settings,
            keep,
            purpose: Purpose::Run,
            control,
            pool,
            started,
            work,
            guidance: None,
            part_of,
            keeper: None,
            without_direct_sun: false,
            done,
            broken,
            brightest,
        })
    }

    /// The same with photons that are guided so.
    fn guided_by(mut self, guidance: Option<Guidance<'a>>) -> Self {
        self.guidance = guidance;
        if let Work::Photons(strata) = &self.work {
            self.work = Work::Photons(self.strata(strata.histories()));
        }
        self
    }

    fn tally(&self) -> Tally {
        let tally = Tally::new(self.scene, parts(&self.part_of));
        if self.guidance.is_some() { tally.weighing() } else { tally }
    }

    fn totals(&self) -> Totals {
        Totals::new(self.scene, parts(&self.part_of))
    }

    /// So many histories of photons, shared among the lights.
    fn strata(&self, histories: u64) -> Strata {
        let lamps = self.guidance.as_ref().and_then(|guidance| guidance.lamps.as_deref());
        let shares = lamps.and_then(|lamps| lamps.shares.as_deref());
        Strata::shared(&self.scene.lights, histories, self.scene.lanes(), shares)
    }

    /// Histories of a task of the usual length.
    fn full_task(&self) -> u64 {
        match &self.work {
            Work::Photons(strata) => strata.histories(),
            // about as many paths in all
            Work::Paths(faces, _) => (TASK / faces.len() as u64).max(1),
        }
    }

    /// Photons, or paths, that a history is.
    fn unit(&self) -> u64 {
        match &self.work {
            Work::Photons(_) => 1,
            Work::Paths(faces, _) => faces.len() as u64,
        }
    }

    fn schedule(&self, histories: u64) -> Result<Schedule> {
        if let Work::Paths(..) = self.work {
            let each = (histories / self.unit()).max(MIN_PATHS);
            let cuts = self.unit().div_ceil(TASK);
            return Ok(Schedule { cuts, ..Schedule::new(each, 1, self.full_task()) });
        }
        let lights = self.scene.sources() as u64;
        if histories < lights {
            let (what, each) = match self.scene.has_daylight() {
                true => ("lights and faces that daylight enters by", "each of them"),
                false => ("lights", "every light"),
            };
            let problem = format!("{histories} photons for {lights} {what}");
            return Err(Error::input("photons", problem)
                .remedy(format!("{each} needs one: ask for at least {lights}")));
        }
        Ok(Schedule::new(histories, lights, self.full_task()))
    }

    fn go(&self) -> Result<Simulation> {
        let photons = self.settings.photons;
        match (self.settings.tolerance, self.settings.max_time) {
            (Some(tolerance), _) => self.until_accurate(tolerance, self.settings.tolerance_limit),
            (None, None) => {
                let schedule = self.schedule(photons.unwrap_or(Settings::DEFAULT_PHOTONS))?;
                let (mut totals, map) = (self.totals(), self.map_builder());
                let of = Some(schedule.histories * self.unit());
                let begin = self.begin(&schedule, &mut totals, map.as_ref())?;
                self.rounds(&schedule, begin, 0..1, of, &mut totals, map.as_ref())?;
                self.finish(totals, map, &schedule, End::Photons)
            }
            (None, Some(limit)) => {
                let schedule = self.schedule(photons.unwrap_or(Settings::DEFAULT_PHOTONS))?;
                self.until_time(&schedule, limit)
            }
        }
    }

    fn map_builder(&self) -> Option<Mutex<MapBuilder>> {
        let photons = matches!(self.work, Work::Photons(_));
        let asked = match self.keep {
            Keep::OnCaptors => self.settings.k != Some(0) && !self.scene.captors.is_empty(),
            Keep::OnSurfaces(_) | Keep::Focused(_) => true,
        };
        let bands = self.scene.bands.len();
        let most = MAX_MAP_BYTES / (size_of::<Arrival>() + bands * size_of::<f32>());
        let limit = self.settings.map_photons.min(most);
        (photons && asked).then(|| Mutex::new(MapBuilder::new(limit, bands)))
    }

    fn finish(
        &self,
        mut totals: Totals,
        map: Option<Mutex<MapBuilder>>,
        schedule: &Schedule,
        end: End,
    ) -> Result<Simulation> {
        let map = map.map(|map| {
            let builder = map.into_inner().unwrap_or_else(PoisonError::into_inner);
            builder.build(totals.histories, |key| schedule.histories_before(key))
        });
        let paths = totals.histories;
        totals.histories *= self.unit();
        let (unseen, too_small) = match &self.work {
            Work::Photons(_) => (None, Vec::new()),
            Work::Paths(_, pilot) => {
                let Told { unseen, by_chance } = Told::find(self.scene, pilot, self.settings.seed);
                let too_small = by_chance.map(|found| found.too_small(self.scene, &totals, paths));
                (unseen, too_small.unwrap_or_default())
            }
        };
        Ok(Simulation {
            estimator: self.settings.estimator,
            choice: None,
            guiding: self.guidance.as_ref().map_or(Guiding::Off, Guidance::guiding),
            starved: self.guidance.as_ref().is_some_and(|guidance| guidance.starved),
            totals,
            map,
            unseen,
            too_small,
            end,
            accuracy: None,
            threads: self.pool.current_num_threads(),
        })
    }

    fn report(&self, of: Option<u64>, worst: Option<Worst>) {
        let photons = self.done.load(Ordering::Relaxed);
        (self.control.progress)(Progress { photons, of, worst });
    }

    fn time_is_up(&self) -> bool {
        self.settings.max_time.is_some_and(|limit| self.started.elapsed() >= limit)
    }

    fn stopped(&self) -> bool {
        self.control.stop.load(Ordering::Relaxed) || self.broken()
    }

    fn broken(&self) -> bool {
        self.broken.load(Ordering::Relaxed)
    }

    fn check_stopped(&self) -> Result<()> {
        if self.stopped() {
            return Err(Error::interrupted("run", NOTHING_WRITTEN));
        }
        Ok(())
    }
}

/// The faces of all captors.
fn faces(scene: &Scene) -> Vec<Face<'_>> {
    let of = |(c, captor): (usize, &Captor)| {
        captor.kind.faces().iter().map(move |&face| Face::new(scene, c, face))
    };
    scene.captors.iter().enumerate().flat_map(of).collect()
}

/// The least number of paths of a run: some from each face.
pub fn least_paths(scene: &Scene) -> u64 {
    MIN_PATHS * scene.captors.iter().map(|captor| captor.kind.faces().len() as u64).sum::<u64>()
}

/// How many parts there are.
fn parts(part_of: &[usize]) -> usize {
    part_of.iter().max().map_or(0, |last| last + 1)
}

fn lock<T: ?Sized>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
