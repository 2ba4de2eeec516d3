//! Blocks, threads, ordered merge: from a scene and settings to totals and a photon map.
//!
//! A run is cut into blocks of histories, a block into pieces. Each piece emits every light in its
//! exact share, and random streams belong to (seed, block, history): so neither the number of
//! threads nor the moment at which a run ends early can be seen in what it found.

mod plan;
mod surfaces;
mod trial;
mod until;

use std::{
    sync::{
        Condvar, Mutex, MutexGuard, PoisonError,
        atomic::{AtomicBool, AtomicU64, Ordering},
    },
    time::Instant,
};

use crate::{
    captor::Captor,
    error::{Error, Result},
    estimate::paths::{Face, Unseen},
    light::{Emission, Strata},
    material::Onward,
    patches::Patches,
    photon_map::{
        Arrival, MapBuilder, PackedDirection, PhotonMap, Piece, PieceKey, StoredPhoton, Way,
    },
    rng::{Sequence, Stream},
    scene::Scene,
    settings::{Estimator, Settings},
    spectrum::{Spectrum, with_lanes},
    tally::{Tally, Totals},
    trace::{Event, trace},
};

use plan::Plan;
pub use surfaces::light_surfaces;
pub use trial::Choice;

/// Blocks of a run, and of each round of a run that goes on until it is accurate enough.
pub const BLOCKS: u64 = 128;
/// Histories of a piece, unless there are more lights than that.
const PIECE: u64 = 1024;
/// Coordinates of a Sobol point that a path starts with, so that its start and first bounces are
/// spread evenly over a block. Photons gain less from that than it costs, unless captors are as large as walls.
const SOBOL_NUMBERS: u32 = 16;
/// The least number of paths from each face.
const MIN_PATHS: u64 = 100;
/// The most memory that a run may take for its sums and results, bytes.
const MAX_SUM_BYTES: usize = 16 << 30;
/// The most memory that the photon map may take, bytes. Building it takes twice as much, and in a
/// room of mirrors the piece of each thread may be as large.
const MAX_MAP_BYTES: usize = 1 << 30;

/// How far a run has come.
#[derive(Clone, Copy, Debug)]
pub struct Progress {
    /// Histories done.
    pub photons: u64,
    /// Histories to do, where that is known.
    pub of: Option<u64>,
    /// With a tolerance: the largest relative standard error after the last round.
    pub worst_error: Option<f64>,
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
    /// Sums per captor, group and band, and the ledger.
    pub totals: Totals,
    /// Stored arrivals on captors; none for k = 0.
    pub map: Option<PhotonMap>,
    /// In a run of paths: what they cannot find, where there may be such light.
    pub unseen: Option<Unseen>,
    /// Why it ended.
    pub end: End,
    /// Threads that took part.
    pub threads: usize,
}

/// Runs `scene`. Errors: fewer photons than lights, no captor for paths to start from, stopped by
/// `control`, no threads to be had, too many captors for a time limit.
pub fn simulate(scene: &Scene, settings: &Settings, control: &Control) -> Result<Simulation> {
    if settings.estimator == Estimator::Auto {
        let choice = Choice::make(scene, settings, control)?;
        let settings = Settings { estimator: choice.estimator, ..settings.clone() };
        let simulation = simulate(scene, &settings, control)?;
        return Ok(Simulation { choice: Some(choice), ..simulation });
    }
    let run = Run::new(scene, settings, Keep::OnCaptors, control)?;
    with_lanes!(scene.lanes(), N => run.go::<N>())
}

struct Run<'a> {
    scene: &'a Scene,
    settings: &'a Settings,
    keep: Keep<'a>,
    control: &'a Control<'a>,
    pool: rayon::ThreadPool,
    started: Instant,
    work: Work<'a>,
    done: AtomicU64,
}

/// Which photons the map keeps.
#[derive(Clone, Copy)]
enum Keep<'a> {
    /// Those on captors, filed by channel.
    OnCaptors,
    /// All, filed by smooth piece of surface and face.
    OnSurfaces(&'a Patches),
}

/// What one history is.
enum Work<'a> {
    /// A photon; the lights' shares in a piece of the usual length.
    Photons(Strata),
    /// A path from each of these faces.
    Paths(Vec<Face<'a>>),
}

impl<'a> Run<'a> {
    fn new(
        scene: &'a Scene,
        settings: &'a Settings,
        keep: Keep<'a>,
        control: &'a Control<'a>,
    ) -> Result<Self> {
        let started = Instant::now();
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(settings.threads)
            .build()
            .map_err(|e| Error::run("threads", e).remedy("ask for fewer"))?;
        check_memory(scene, pool.current_num_threads())?;
        let work = match settings.estimator {
            // what a trial finds cheaper is known by now
            Estimator::Photons | Estimator::Auto => {
                let piece = PIECE.max((scene.lights.len() as u64).next_power_of_two());
                Work::Photons(Strata::new(&scene.lights, piece, scene.lanes()))
            }
            Estimator::Paths if scene.captors.is_empty() => {
                return Err(Error::input("captors", "there are none for paths to start from")
                    .remedy("add a captor, or run photons"));
            }
            Estimator::Paths => Work::Paths(faces(scene)),
        };
        let done = AtomicU64::new(0);
        Ok(Self { scene, settings, keep, control, pool, started, work, done })
    }

    /// Histories of a piece of the usual length.
    fn full_piece(&self) -> u64 {
        match &self.work {
            Work::Photons(strata) => strata.histories(),
            // about as many paths in all
            Work::Paths(faces) => (PIECE / faces.len() as u64).max(1),
        }
    }

    /// Photons, or paths, that a history is.
    fn unit(&self) -> u64 {
        match &self.work {
            Work::Photons(_) => 1,
            Work::Paths(faces) => faces.len() as u64,
        }
    }

    fn plan(&self, histories: u64) -> Result<Plan> {
        if let Work::Paths(_) = self.work {
            let each = (histories / self.unit()).max(MIN_PATHS);
            return Ok(Plan::new(each, 1, self.full_piece()));
        }
        let lights = self.scene.lights.len() as u64;
        if histories < lights {
            let problem = format!("{histories} photons for {lights} lights");
            return Err(Error::input("photons", problem)
                .remedy(format!("every light needs one: ask for at least {lights}")));
        }
        Ok(Plan::new(histories, lights, self.full_piece()))
    }

    fn go<const N: usize>(&self) -> Result<Simulation> {
        let photons = self.settings.photons;
        match (self.settings.tolerance, self.settings.max_time) {
            (Some(tolerance), _) => {
                self.until_accurate::<N>(tolerance, self.settings.tolerance_limit)
            }
            (None, None) => {
                let plan = self.plan(photons.unwrap_or(Settings::DEFAULT_PHOTONS))?;
                let (mut totals, map) = (Totals::new(self.scene), self.map_builder());
                let of = Some(plan.histories * self.unit());
                self.round::<N>(&plan, 0, of, &mut totals, map.as_ref())?;
                self.finish::<N>(totals, map, &plan, End::Photons)
            }
            (None, Some(limit)) => {
                let plan = self.plan(photons.unwrap_or(Settings::DEFAULT_PHOTONS))?;
                self.until_time::<N>(&plan, limit)
            }
        }
    }

    /// One round of blocks, each traced whole by one thread and added up in order.
    fn round<const N: usize>(
        &self,
        plan: &Plan,
        round: u64,
        of: Option<u64>,
        totals: &mut Totals,
        map: Option<&Mutex<MapBuilder>>,
    ) -> Result<()> {
        let next = AtomicU64::new(0);
        let merged = Mutex::new((0, totals));
        let turn = Condvar::new();
        self.pool.broadcast(|_| {
            let (mut piece_sums, mut sums) = (Tally::new(self.scene), Tally::new(self.scene));
            loop {
                let block = next.fetch_add(1, Ordering::Relaxed);
                if block >= plan.blocks {
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
                let mut merged = lock(&merged);
                while merged.0 != block {
                    merged = turn.wait(merged).unwrap_or_else(PoisonError::into_inner);
                }
                merged.1.add_block(self.scene, &mut sums, plan.block(block));
                merged.0 += 1;
                turn.notify_all();
            }
        });
        self.check_stopped()
    }

    /// Follows the histories of one piece.
    fn piece<const N: usize>(
        &self,
        plan: &Plan,
        key: PieceKey,
        tally: &mut Tally,
        map: Option<&Mutex<MapBuilder>>,
    ) {
        let (_, piece, block) = key;
        let (_, histories) = plan.range(block, piece);
        match &self.work {
            Work::Paths(faces) => self.paths::<N>(plan, key, faces, tally),
            Work::Photons(strata) if strata.histories() == histories => {
                self.photons::<N>(plan, key, strata, tally, map);
            }
            Work::Photons(_) => {
                let strata = Strata::new(&self.scene.lights, histories, N);
                self.photons::<N>(plan, key, &strata, tally, map);
            }
        }
        self.done.fetch_add(histories * self.unit(), Ordering::Relaxed);
    }

    /// Follows paths from every face.
    fn paths<const N: usize>(
        &self,
        plan: &Plan,
        (round, piece, block): PieceKey,
        faces: &[Face],
        tally: &mut Tally,
    ) {
        let (first, histories) = plan.range(block, piece);
        let (seed, block) = (self.settings.seed, round * BLOCKS + block);
        for (f, face) in faces.iter().enumerate() {
            if self.stopped() {
                return;
            }
            let sequence = Sequence::new(seed, block, f as u64);
            for index in first..first + histories {
                let stream = index * faces.len() as u64 + f as u64;
                let rng = Stream::new(seed, block, stream);
                let mut rng = rng.with_sobol(sequence, index, SOBOL_NUMBERS);
                let score = face.path::<N>(&mut rng);
                tally.score_path(&self.scene.captors[face.captor], face.channel, &score);
            }
        }
    }

    /// Emits and follows photons.
    fn photons<const N: usize>(
        &self,
        plan: &Plan,
        key: PieceKey,
        strata: &Strata,
        tally: &mut Tally,
        map: Option<&Mutex<MapBuilder>>,
    ) {
        let (round, piece, block) = key;
        let (first, histories) = plan.range(block, piece);
        let limit = map.map_or(0, |map| lock(map).limit());
        let mut stored = map.filter(|map| lock(map).wants(key)).map(|_| Piece::default());
        let bands = self.scene.bands.len();
        for index in 0..histories {
            if self.stopped() {
                return;
            }
            let mut rng = Stream::new(self.settings.seed, round * BLOCKS + block, first + index);
            let Emission { light, weights, ray, power } =
                strata.emit::<N>(&self.scene.lights, index, self.scene.ray_offset(), &mut rng);
            tally.emitted(weights);
            let mut way = Way::default();
            trace(self.scene, ray, power, &mut rng, |event: Event<'_, N>| {
                tally.score(self.scene, weights, &event);
                let Some(piece) = &mut stored else { return };
                if let Some((mut arrival, power)) = self.keep.arrival(self.scene, &event) {
                    arrival.photon.light = light as u32;
                    arrival.photon.history = index as u32;
                    let power = (0..bands).map(|b| (f64::from(power.0[b]) * weights[b]) as f32);
                    piece.push(limit, arrival, power);
                    if let Keep::OnSurfaces(_) = self.keep {
                        piece.came(way);
                    }
                }
                if let Event::Arrival { onward, .. } = event {
                    way = way.then(onward);
                }
            });
        }
        if let (Some(map), Some(stored)) = (map, stored) {
            lock(map).add(key, stored);
        }
    }

    fn map_builder(&self) -> Option<Mutex<MapBuilder>> {
        let photons = matches!(self.work, Work::Photons(_));
        let asked = match self.keep {
            Keep::OnCaptors => self.settings.k != Some(0) && !self.scene.captors.is_empty(),
            Keep::OnSurfaces(_) => true,
        };
        let bands = self.scene.bands.len();
        let most = MAX_MAP_BYTES / (size_of::<Arrival>() + bands * size_of::<f32>());
        let limit = self.settings.map_photons.min(most);
        (photons && asked).then(|| Mutex::new(MapBuilder::new(limit, bands)))
    }

    fn finish<const N: usize>(
        &self,
        mut totals: Totals,
        map: Option<Mutex<MapBuilder>>,
        plan: &Plan,
        end: End,
    ) -> Result<Simulation> {
        let map = map.map(|map| {
            let builder = map.into_inner().unwrap_or_else(PoisonError::into_inner);
            builder.build(totals.histories, |key| plan.histories_before(key))
        });
        totals.histories *= self.unit();
        let unseen = match self.work {
            Work::Photons(_) => None,
            Work::Paths(_) => Unseen::find::<N>(self.scene, self.settings.seed),
        };
        Ok(Simulation {
            estimator: self.settings.estimator,
            choice: None,
            totals,
            map,
            unseen,
            end,
            threads: self.pool.current_num_threads(),
        })
    }

    fn report(&self, of: Option<u64>, worst_error: Option<f64>) {
        let photons = self.done.load(Ordering::Relaxed);
        (self.control.progress)(Progress { photons, of, worst_error });
    }

    fn time_is_up(&self) -> bool {
        self.settings.max_time.is_some_and(|limit| self.started.elapsed() >= limit)
    }

    fn stopped(&self) -> bool {
        self.control.stop.load(Ordering::Relaxed)
    }

    fn check_stopped(&self) -> Result<()> {
        if self.stopped() {
            return Err(Error::run("run", "interrupted, nothing was written"));
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

/// Refuses a run whose sums would not fit into memory, before it begins.
fn check_memory(scene: &Scene, threads: usize) -> Result<()> {
    let strata = scene.lights.len() * scene.lanes() * size_of::<f64>();
    let bytes = threads * (2 * Tally::bytes(scene) + strata) + Totals::bytes(scene);
    if bytes <= MAX_SUM_BYTES {
        return Ok(());
    }
    let problem = format!(
        "the sums for {} captors, {} bands and {} lights on {threads} threads would take {:.0} GiB",
        scene.captors.len(),
        scene.bands.len(),
        scene.lights.len(),
        bytes as f64 / f64::from(1 << 30)
    );
    Err(Error::input(format!("scene {}", scene.name), problem)
        .remedy("ask for fewer captors, bands or threads"))
}

fn lock<T: ?Sized>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Way {
    /// After one more surface.
    #[inline]
    fn then(self, onward: Option<Onward>) -> Self {
        match onward {
            Some(Onward::Diffuse) => Self { bounces: self.bounces.saturating_add(1), ..self },
            Some(Onward::Specular) => Self { mirrored: true, ..self },
            Some(Onward::Straight) | None => self,
        }
    }
}

impl Keep<'_> {
    /// The arrival to store of an event, and its power.
    #[inline]
    fn arrival<'e, const N: usize>(
        self,
        scene: &'e Scene,
        event: &'e Event<'_, N>,
    ) -> Option<(Arrival, &'e Spectrum<N>)> {
        let (position, direction, triangle) = match event {
            Event::Crossing { crossing, direction, .. } => {
                (crossing.point, *direction, crossing.triangle)
            }
            Event::Arrival { hit, encounter, .. } => (hit.point, encounter.direction, hit.triangle),
            Event::Escaped(_) | Event::Lost(_) => return None,
        };
        let (shelf, power) = match (self, event) {
            (Keep::OnCaptors, _) => {
                let counted = event.counted(scene)?;
                (counted.channel() as u32, counted.power)
            }
            (Keep::OnSurfaces(patches), Event::Arrival { encounter, power, .. }) => {
                (patches.shelf(triangle, encounter.front), power)
            }
            (Keep::OnSurfaces(_), _) => return None,
        };
        let direction = PackedDirection::new(direction);
        let photon = StoredPhoton { direction, triangle: triangle as u32, light: 0, history: 0 };
        Some((Arrival { position, shelf, photon }, power))
    }
}
