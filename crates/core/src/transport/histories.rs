//! How light reaches chosen captors: the histories that bring it, sorted by lamp and by the last
//! surface, each with its share in the light of the captor, and some of them as lines.
//!
//! Photons are traced, and at each emission and diffuse scattering one more flight is aimed at the
//! captors ([`Aimed`]), at surfaces among them too, so that small captors get their light from many
//! histories. Where a scene repeats, no flights are aimed, as captors have images without end there.
//! Each arrival counts for its lamp and its last surface: the last one that scattered or mirrored the
//! light. What only passes, straight on or refracted, leaves the last surface as it is.
//!
//! A share is a ratio of two means over the same batches, and its standard error that of such a ratio
//! (the delta method). Of all arrivals some are drawn as lines, each with a chance in proportion to
//! what it brings: those with the smallest keys, where the key of an arrival of weight w is a number of
//! the exponential distribution over w (Efraimidis and Spirakis, "Weighted random sampling with a
//! reservoir", Inf. Process. Lett. 97, 2006). Each line then stands for about the same light.
//!
//! Reading order: `course` keeps the places of a history, `steered` aims flights beside it; here they
//! are counted.

mod course;
mod steered;

use std::{
    cell::Cell,
    collections::{BTreeMap, BinaryHeap},
    sync::{
        Mutex,
        atomic::{AtomicU64, Ordering},
    },
};

use rayon::prelude::*;

use crate::{
    error::{Error, NOTHING_WRITTEN, Result, catch_panic, lock, unlocked},
    math::{
        machine,
        rng::{Purpose, Streams},
        spectrum::{Lanes, with_lanes},
        stats::{Estimate, Running, RunningPair, ratio},
    },
    scene::{captor::Channel, light::Strata, world::Scene},
    transport::{
        guiding::{Aimed, Targets},
        settings::{Guiding, Settings},
        simulate::{BATCHES, Control, Progress, check_photons},
        trace::{Event, trace},
    },
};
use course::Course;
pub use course::{HistoryLine, LastSurface, Origin};
use steered::Steered;

/// Number of photons between two looks at whether the user stops the work.
const LOOK: u64 = 1024;

/// Captors whose light is looked for, together.
#[derive(Clone, Debug)]
pub struct Goal {
    /// Indices of the captors.
    pub captors: Vec<usize>,
    /// The face at which light counts, front or back; `None` for all faces that count light.
    pub face: Option<Channel>,
}

/// What some of the histories bring, per band and sum over bands, in this order.
#[derive(Clone, Debug)]
pub struct Contribution {
    /// Number of histories: of arrivals, each with its way from the lamp.
    pub histories: u64,
    /// The flux, W or umol/s or the unit of a sum.
    pub flux: Vec<Estimate>,
    /// Its share in the flux of all histories, in [0, 1]; `None` where no light arrives.
    pub share: Vec<Option<Estimate>>,
}

/// The histories that bring the light of a goal.
#[derive(Clone, Debug)]
pub struct Histories {
    /// Number of photons that were traced.
    pub photons: u64,
    /// What all of them bring.
    pub whole: Contribution,
    /// By lamp and last surface, the largest share first.
    pub groups: Vec<(Origin, Contribution)>,
    /// By lamp alone, the largest share first.
    pub by_light: Vec<(usize, Contribution)>,
    /// By last surface alone, the largest share first; `None` stands for direct light.
    pub by_surface: Vec<(Option<LastSurface>, Contribution)>,
    /// Some of them as lines, in an order that chance has made: the first few are as good a sample as
    /// all.
    pub lines: Vec<HistoryLine>,
}

/// Traces photons, and returns the histories that bring light to each of the `goals`. `column` is the
/// index of the band or sum over bands by which groups are sorted and lines are drawn, and `lines` the
/// most lines of each goal. The number of photons, the seed, the threads, and whether flights may be
/// aimed (`guiding` is not off) are taken from the settings. Errors: there are fewer photons than
/// lights; `control` stops the work; no threads are to be had.
pub fn trace_histories(
    scene: &Scene,
    goals: &[Goal],
    (column, lines): (usize, usize),
    settings: &Settings,
    control: &Control,
) -> Result<Vec<Histories>> {
    let (photons, sources) = (settings.photons_or_default(), scene.sources() as u64);
    check_photons(scene, photons)?;
    let batches = BATCHES.min(photons / sources);
    let mut goals_of = vec![Vec::new(); scene.captors().len()];
    for (goal, Goal { captors, .. }) in goals.iter().enumerate() {
        captors.iter().for_each(|captor| goals_of[*captor].push(goal));
    }
    let may_aim = settings.guiding != Guiding::Off && scene.lattice().is_none();
    let targets = may_aim.then(|| Targets::among(scene, |captor| !goals_of[captor].is_empty()));
    let search = Search {
        scene,
        goals,
        goals_of,
        targets: targets.flatten(),
        strata: Strata::new(scene.lights(), photons / batches, scene.lanes()),
        column,
        lines,
        seed: settings.seed,
    };
    catch_panic("trace", || search.go(batches, settings.threads.get(), control))
}

/// A search for the histories of some goals.
struct Search<'s> {
    scene: &'s Scene,
    goals: &'s [Goal],
    /// For each captor the indices of the goals that it belongs to.
    goals_of: Vec<Vec<usize>>,
    /// The captors at which flights are aimed; `None` if none are.
    targets: Option<Targets>,
    /// How the photons of a batch are shared among the lights.
    strata: Strata,
    column: usize,
    lines: usize,
    seed: u64,
}

/// What a batch has found for one goal.
#[derive(Default)]
struct Found {
    sums: BTreeMap<Origin, Sum>,
    lines: Lines,
}

/// The sums of one origin in a batch.
#[derive(Clone, Default)]
struct Sum {
    histories: u64,
    /// Power per band, times the number of photons of the batch, W or umol/s.
    power: Vec<f64>,
}

/// A line and its key.
struct Drawn {
    key: f64,
    /// The batch and the photon, for keys that are equal.
    photon: (u64, u64),
    line: HistoryLine,
}

/// The lines with the smallest keys, at most so many; the largest key is on top.
#[derive(Default)]
struct Lines(BinaryHeap<Drawn>);

impl PartialEq for Drawn {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other).is_eq()
    }
}

impl Eq for Drawn {}

impl PartialOrd for Drawn {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Drawn {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        self.key.total_cmp(&other.key).then(self.photon.cmp(&other.photon))
    }
}

impl Lines {
    /// Adds a line if it is among the `most` of the smallest keys.
    fn add(&mut self, most: usize, drawn: Drawn) {
        self.0.push(drawn);
        if self.0.len() > most {
            self.0.pop();
        }
    }

    /// Returns whether a line of this key would be among the `most` of the smallest keys.
    fn takes(&self, most: usize, key: f64) -> bool {
        most > 0 && (self.0.len() < most || self.0.peek().is_some_and(|last| key <= last.key))
    }
}

impl Search<'_> {
    fn go(&self, batches: u64, threads: usize, control: &Control) -> Result<Vec<Histories>> {
        let done = AtomicU64::new(0);
        let all = batches * self.strata.histories();
        let looked = |photons: u64| {
            let photons = done.fetch_add(photons, Ordering::Relaxed) + photons;
            (control.progress)(Progress { photons, of: Some(all), worst: None });
            !control.stop.load(Ordering::Relaxed)
        };
        // lines are joined as soon as a batch has them, as all batches together may have many; which of
        // them remain does not depend on the order of batches
        let lines: Vec<Mutex<Lines>> = self.goals.iter().map(|_| Mutex::default()).collect();
        let batch = |batch: u64| {
            let mut found = with_lanes!(self.scene.lanes(), L => self.batch::<L>(batch, &looked));
            for (found, lines) in found.iter_mut().zip(&lines) {
                let mut lines = lock(lines);
                let own = std::mem::take(&mut found.lines.0).into_iter();
                own.for_each(|drawn| lines.add(self.lines, drawn));
            }
            found
        };
        let pool = machine::pool(threads)?;
        let found: Vec<Vec<Found>> =
            pool.install(|| (0..batches).into_par_iter().map(batch).collect());
        if control.stop.load(Ordering::Relaxed) {
            return Err(Error::interrupted("trace", NOTHING_WRITTEN));
        }
        let mut by_goal: Vec<Vec<Found>> = self.goals.iter().map(|_| Vec::new()).collect();
        for batch in found {
            by_goal.iter_mut().zip(batch).for_each(|(goal, found)| goal.push(found));
        }
        let lines = lines.into_iter().map(unlocked);
        let by_goal = by_goal.into_iter().zip(lines);
        Ok(by_goal.map(|(found, lines)| self.histories(&found, lines)).collect())
    }

    /// Follows the photons of a batch. `looked` is told how many are done, and whether to go on.
    fn batch<L: Lanes>(&self, batch: u64, looked: &dyn Fn(u64) -> bool) -> Vec<Found> {
        let mut found: Vec<Found> = self.goals.iter().map(|_| Found::default()).collect();
        let streams = Streams::new(self.seed, Purpose::Histories, batch);
        let choices = Streams::new(self.seed, Purpose::Choice, batch);
        let photons = self.strata.histories();
        for index in 0..photons {
            if index.is_multiple_of(LOOK) && !looked(LOOK.min(photons - index)) {
                break;
            }
            let mut rng = streams.history(index);
            let photon = self.scene.emit::<L>(&self.strata, index, &mut rng);
            let mut course = Course::of(self.scene, &photon);
            let mut choice = None;
            let share = Cell::new(1.0);
            let mut on = |event: Event<'_, L>| {
                let mut draw =
                    || choice.get_or_insert_with(|| choices.history(index)).uniform_fine();
                let from = (photon.weights, share.get(), (batch, index));
                self.count(&event, from, &course, &mut draw, &mut found);
                course.then(&event);
            };
            let Some(targets) = &self.targets else {
                trace(self.scene, photon.ray, photon.power, (), &mut rng, on);
                continue;
            };
            let mut aimed = Aimed::new(self.scene, targets);
            aimed.start(&photon, None, &mut rng, &mut on);
            let guide = Steered { aimed, goals_of: &self.goals_of, share: &share };
            trace(self.scene, photon.ray, photon.power, guide, &mut rng, on);
        }
        found
    }

    /// Counts an event for the goals of its captor, if it has one. It is one of a photon of these
    /// weights, whose own arrivals on surfaces count with the weight `share`.
    fn count<L: Lanes>(
        &self,
        event: &Event<'_, L>,
        (weights, share, photon): (&[f64], f32, (u64, u64)),
        course: &Course,
        draw: &mut dyn FnMut() -> f64,
        found: &mut [Found],
    ) {
        let (captor, share) = match event {
            Event::Crossing { crossing, .. } => (crossing.captor, 1.0),
            Event::ArrivalBeside { at, .. } => {
                let Some(captor) = at.surface.captor() else { return };
                (captor, 1.0)
            }
            Event::Arrival { at, .. } => {
                let Some(captor) = at.surface.captor() else { return };
                (captor, share)
            }
            _ => return,
        };
        if self.goals_of[captor].is_empty() {
            return;
        }
        let Some(counted) = event.counted(self.scene) else { return };
        let response = counted.captor.sensor.response.as_ref();
        let read = response.map_or(1.0, |response| response.factor(event.cosine(self.scene)));
        let factor = f64::from(share) * f64::from(read);
        let bands = self.scene.bands().len();
        let brought = counted.power.values()[..bands].iter().zip(weights);
        let power: Vec<f64> =
            brought.map(|(power, weight)| f64::from(*power) * weight * factor).collect();
        if power.iter().all(|power| *power == 0.0) {
            return;
        }
        let origin = course.origin(self.scene, event);
        let weight = self.value(&power);
        for goal in &self.goals_of[captor] {
            if self.goals[*goal].face.is_some_and(|face| face != counted.face) {
                continue;
            }
            let Found { sums, lines } = &mut found[*goal];
            let sum = sums.entry(origin).or_insert_with(|| Sum::new(bands));
            sum.histories += 1;
            sum.power.iter_mut().zip(&power).for_each(|(sum, power)| *sum += power);
            if weight <= 0.0 {
                continue;
            }
            let key = -f64::ln(1.0 - draw()) / weight;
            if lines.takes(self.lines, key) {
                let front = counted.face == Channel::Front;
                let line = course.line(self.scene, event, HistoryLine::new(origin, captor, front));
                lines.add(self.lines, Drawn { key, photon, line });
            }
        }
    }

    /// Returns the value of the band or sum by which lines are drawn, from values per band.
    fn value(&self, of_bands: &[f64]) -> f64 {
        match self.column.checked_sub(of_bands.len()) {
            None => of_bands[self.column],
            Some(sum) => self.scene.sums()[sum].of(of_bands),
        }
    }

    /// Joins what the batches have found for a goal.
    fn histories(&self, batches: &[Found], lines: Lines) -> Histories {
        let whole = self.contributions(batches, |_| ());
        let none = || Contribution::none(self.scene.band_names().count());
        Histories {
            photons: batches.len() as u64 * self.strata.histories(),
            whole: whole.into_iter().next().map_or_else(none, |(_, whole)| whole),
            groups: self.contributions(batches, |origin| origin),
            by_light: self.contributions(batches, |origin| origin.light),
            by_surface: self.contributions(batches, |origin| origin.last),
            lines: lines.0.into_sorted_vec().into_iter().map(|drawn| drawn.line).collect(),
        }
    }

    /// Returns what the histories of each key bring, the largest share first.
    fn contributions<K: Copy + Ord>(
        &self,
        batches: &[Found],
        key: impl Fn(Origin) -> K,
    ) -> Vec<(K, Contribution)> {
        let photons = self.strata.histories() as f64;
        let bands = self.scene.bands().len();
        // the sums of each batch by key, and of each batch as a whole, of its bands and sums over bands
        let mut by_key: BTreeMap<K, Vec<Sum>> = BTreeMap::new();
        let mut whole = vec![Sum::new(bands); batches.len()];
        for (batch, found) in batches.iter().enumerate() {
            for (origin, sum) in &found.sums {
                let none = || vec![Sum::new(bands); batches.len()];
                by_key.entry(key(*origin)).or_insert_with(none)[batch].add(sum);
                whole[batch].add(sum);
            }
        }
        let columns = |sum: &Sum| -> Vec<f64> {
            let sums = self.scene.with_sums(&sum.power);
            sums.into_iter().map(|sum| sum / photons).collect()
        };
        let whole: Vec<Vec<f64>> = whole.iter().map(columns).collect();
        let contribution = |sums: Vec<Sum>| {
            let count = self.scene.band_names().count();
            let mut running = vec![(Running::default(), RunningPair::default()); count];
            for (own, whole) in sums.iter().map(columns).zip(&whole) {
                for (running, (own, whole)) in running.iter_mut().zip(own.iter().zip(whole)) {
                    running.0.add(*own);
                    running.1.add(*own, *whole);
                }
            }
            let batches = batches.len() as u64;
            let share = |pair: &RunningPair| {
                let (means, covariance) = pair.estimate(batches);
                let (mean, standard_error) = ratio(means, covariance)?;
                Some(Estimate { mean, standard_error })
            };
            Contribution {
                histories: sums.iter().map(|sum| sum.histories).sum(),
                flux: running.iter().map(|(flux, _)| flux.estimate(batches)).collect(),
                share: running.iter().map(|(_, pair)| share(pair)).collect(),
            }
        };
        let mut all: Vec<(K, Contribution)> =
            by_key.into_iter().map(|(key, sums)| (key, contribution(sums))).collect();
        let flux = |(_, own): &(K, Contribution)| own.flux[self.column].mean;
        all.sort_by(|a, b| flux(b).total_cmp(&flux(a)));
        all
    }
}

impl Sum {
    fn new(bands: usize) -> Self {
        Self { histories: 0, power: vec![0.0; bands] }
    }

    fn add(&mut self, other: &Self) {
        self.histories += other.histories;
        self.power.iter_mut().zip(&other.power).for_each(|(sum, power)| *sum += power);
    }
}

impl Contribution {
    /// That of no histories, of so many bands and sums.
    fn none(columns: usize) -> Self {
        let flux = vec![Estimate { mean: 0.0, standard_error: Some(0.0) }; columns];
        Self { histories: 0, flux, share: vec![None; columns] }
    }
}

impl HistoryLine {
    /// A line that still has no places.
    fn new(origin: Origin, captor: usize, front: bool) -> Self {
        Self { origin, captor, front, points: Vec::new(), met: Vec::new() }
    }
}
