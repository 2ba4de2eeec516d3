//! Follows the histories of one task.

use std::sync::{Mutex, atomic::Ordering};

use super::{Arrivals, BATCHES, Run, Work, schedule::Schedule};

use crate::{
    math::{
        effort,
        rng::{Purpose, Stream, Streams},
        spectrum::{Lanes, Spectrum, with_lanes},
    },
    scene::{
        light::{Emission, Strata},
        material::Scatterer,
        world::Scene,
    },
    transport::{
        guiding::Lamps,
        met::Account,
        paths::{Face, Finding, Pilot},
        photon_map::{MapBuilder, TaskKey, Way},
        tally::Tally,
        trace::{Event, UntilDiffused, trace},
    },
};

/// Number of coordinates of the Sobol point with which a path starts, so that its start and first
/// bounces are spread evenly over a batch. Photons gain less from Sobol points than these cost,
/// unless captors are as large as walls.
const SOBOL_NUMBERS: u32 = 16;

impl Run<'_> {
    /// Follows the histories of one task, and adds what they find to `tally` and `map`.
    pub(super) fn task(
        &self,
        schedule: &Schedule,
        key: TaskKey,
        tally: &mut Tally,
        map: Option<&Mutex<MapBuilder>>,
    ) {
        if self.counts() {
            let effort = effort::count(|| self.followed(schedule, key, tally, map));
            tally.spend(effort);
        } else {
            self.followed(schedule, key, tally, map);
        }
        self.shared.done.fetch_add(self.photons_in(schedule, key.2, key.1), Ordering::Relaxed);
    }

    /// Returns whether the work is counted.
    fn counts(&self) -> bool {
        matches!(self.purpose, Purpose::Trial | Purpose::Guiding)
    }

    fn followed(
        &self,
        schedule: &Schedule,
        key: TaskKey,
        tally: &mut Tally,
        map: Option<&Mutex<MapBuilder>>,
    ) {
        let (round, task, batch) = key;
        let (_, histories) = schedule.range(batch, task);
        with_lanes!(self.scene.lanes(), L => match &self.histories.work {
            Work::Paths(faces, pilot) => {
                self.paths::<L>(schedule, key, faces, pilot, tally);
                self.photons_beside::<L>(schedule, key, pilot, tally, map);
            }
            Work::Photons(strata) => {
                let own = (strata.histories() != histories).then(|| self.histories.strata(self.scene, histories));
                let strata = own.as_ref().unwrap_or(strata);
                self.emitted::<L>(schedule, key, strata, tally, map);
            }
            Work::Lights => {
                let (lights, light) = (self.scene.lights(), round as usize);
                let strata = Strata::of_light(lights, light, histories, self.scene.lanes());
                self.emitted::<L>(schedule, key, &strata, tally, map);
            }
        });
    }

    /// Returns the number of photons, or of paths, of a task.
    pub(super) fn photons_in(&self, schedule: &Schedule, batch: u64, task: u64) -> u64 {
        let (_, histories) = schedule.range(batch, task);
        match &self.histories.work {
            Work::Photons(_) | Work::Lights => histories,
            Work::Paths(faces, _) => histories * schedule.faces(task, faces.len()).len() as u64,
        }
    }

    /// Returns whether only the photon map of the run is wanted. Once the map is full, there is
    /// then no more to do.
    fn keeps_map_alone(&self) -> bool {
        !matches!(self.kept.arrivals, Arrivals::OnCaptors) && self.purpose != Purpose::Trial
    }

    /// Returns the random streams of a batch.
    fn streams(&self, round: u64, batch: u64) -> Streams {
        Streams::new(self.settings.seed, self.purpose, round * BATCHES + batch)
    }

    /// Follows paths from the faces of a task.
    fn paths<L: Lanes>(
        &self,
        schedule: &Schedule,
        (round, task, batch): TaskKey,
        faces: &[Face],
        pilot: &Pilot,
        tally: &mut Tally,
    ) {
        let (first, histories) = schedule.range(batch, task);
        let streams = self.streams(round, batch);
        let account = tally.keeps_account(self.scene);
        for f in schedule.faces(task, faces.len()) {
            let face = &faces[f];
            if self.stopped() {
                return;
            }
            let mut brightest = Spectrum::<L>::splat(self.scene.lanes(), 0.0);
            let sequence = streams.sequence(f as u64);
            for index in first..first + histories {
                let stream = index * faces.len() as u64 + f as u64;
                let rng = streams.history(stream);
                let mut rng = rng.with_sobol(sequence, index, SOBOL_NUMBERS);
                let score = face.path::<L>(pilot, account, &mut rng);
                let captor = &self.scene.captors()[face.captor];
                tally.score_path(self.scene, captor, face.channel, &score);
                brightest = brightest.zip(&score.flux, f32::max);
            }
            let area = self.scene.captors()[face.captor].area;
            self.keep_brightest(brightest.values().iter().map(|&most| f64::from(most) / area));
        }
    }

    /// Keeps for the run the most that a history has brought in each band.
    fn keep_brightest(&self, most: impl IntoIterator<Item = f64>) {
        for (all, most) in self.shared.brightest.iter().zip(most) {
            all.fetch_max(most.to_bits(), Ordering::Relaxed);
        }
    }

    /// Emits the photons of a task, and follows them.
    fn emitted<L: Lanes>(
        &self,
        schedule: &Schedule,
        key: TaskKey,
        strata: &Strata,
        tally: &mut Tally,
        map: Option<&Mutex<MapBuilder>>,
    ) {
        match self.histories.guidance.is_some() || tally.keeps_account(self.scene) {
            false => self.photons::<L, false>(schedule, key, strata, tally, map),
            true => self.photons::<L, true>(schedule, key, strata, tally, map),
        }
    }

    /// Returns whether photons are spread evenly. Those of trials are not: what they gain by it
    /// depends on their number, and says nothing of the gain of another number.
    pub(super) fn spreads(&self) -> bool {
        self.purpose == Purpose::Run
    }

    /// Counts the emission of a photon by a light of which `part` of the sums has the light, and begins
    /// its account.
    #[inline(always)]
    pub(super) fn count_emission<L: Lanes>(
        &self,
        tally: &mut Tally,
        account: &mut Option<Account<L>>,
        (light, part): (usize, Option<usize>),
        weights: &[f64],
        emitted: &Spectrum<L>,
    ) {
        tally.emitted(part, weights, emitted);
        if let Some(account) = account {
            account.start(self.scene.parameters().of_light(light));
            tally.emitted_in_variants(self.scene, weights, emitted, account);
        }
    }

    /// Emits and follows photons. The loop is compiled once for those that nothing guides and that keep
    /// no account of what they meet, and once for all others.
    fn photons<L: Lanes, const MORE: bool>(
        &self,
        schedule: &Schedule,
        key: TaskKey,
        strata: &Strata,
        tally: &mut Tally,
        map: Option<&Mutex<MapBuilder>>,
    ) {
        let scene = self.scene;
        let (round, task, batch) = key;
        let (first, histories) = schedule.range(batch, task);
        let mut stored = self.stored(map, key, 1.0);
        if stored.is_none() && self.keeps_map_alone() {
            return;
        }
        let streams = self.streams(round, batch);
        let guidance = self.histories.guidance.as_ref().filter(|_| MORE);
        let lamps = guidance.and_then(|guidance| guidance.lamps.as_deref());
        let spreads = self.spreads() && lamps.is_none();
        let mut account = (MORE && tally.keeps_account(scene)).then(Account::<L>::default);
        let mut copies = Vec::new();
        let mut brightest = vec![0.0f64; scene.bands().len()];
        let heavy = MORE && guidance.is_some() && self.settings.tolerance.is_some();
        for index in 0..histories {
            if self.stopped() {
                return;
            }
            let mut rng = streams.history(first + index);
            if spreads {
                strata.spread(scene.lights(), index, first, streams, &mut rng);
            }
            let (photon, density) = emit::<L>(scene, lamps, (strata, index), &mut rng);
            // taken apart, so that only the power is kept in memory where nothing guides photons
            let Emission { light, source, weights, ray, start, face, power } = photon;
            let part = self.part_of.get(light).copied();
            // the density of light from infinitely far away may depend on where it comes from
            let chosen = (density != 1.0 && start.is_none()).then_some(1.0 / density);
            let emitted = chosen.map(|factor| power.clone().scaled(factor));
            let emitted = emitted.as_ref().unwrap_or(&power);
            self.count_emission(tally, &mut account, (light, part), weights, emitted);
            let mut way = Way::default();
            let of_sun = self.histories.without_direct_sun && strata.is_sun(scene.lights(), source);
            let mut found = of_sun.then(|| Finding::new(scene, light, true));
            let on = |event: Event<'_, L>| {
                if found.as_mut().is_some_and(|found| found.takes(&event)) {
                    return;
                }
                tally.score(scene, part, weights, &event);
                if let Some(account) = &mut account {
                    tally.score_met(scene, part, weights, &event, account, |_| true);
                    account.then(&event);
                }
                if heavy && let Some(counted) = event.counted(scene) {
                    keep_largest(&mut brightest, counted.power, weights);
                }
                let Some(stored) = &mut stored else { return };
                stored.add(&event, way, (light, index), weights);
                if let Event::Arrival { at, lobe, .. } = event {
                    way = way.then(lobe, || at.material.glossy() > 0.0);
                }
            };
            match (guidance, self.kept.arrivals) {
                (None, Arrivals::Focused(_)) => {
                    trace(scene, ray, power, UntilDiffused, &mut rng, on);
                }
                (None, _) => trace(scene, ray, power, (), &mut rng, on),
                (Some(guidance), _) => {
                    let photon = Emission { light, source, weights, ray, start, face, power };
                    let aims = guidance.targets.is_some() && !of_sun;
                    let other =
                        (aims && density != 1.0).then(|| scene.emit::<L>(strata, index, &mut rng));
                    let flights = aims.then_some(other.as_ref());
                    guidance.trace(scene, (photon, density), flights, &mut copies, &mut rng, on);
                }
            }
        }
        self.keep_brightest(brightest);
        self.store(map, key, stored);
    }
}

/// Emits a photon, by guided lamps where there are any. Returns with it its density over that without
/// guiding.
#[inline(always)]
fn emit<'a, L: Lanes>(
    scene: &'a Scene,
    lamps: Option<&'a Lamps>,
    (strata, index): (&'a Strata, u64),
    rng: &mut Stream,
) -> (Emission<'a, L>, f32) {
    match lamps {
        None => (scene.emit(strata, index, rng), 1.0),
        Some(lamps) => lamps.emit(scene, strata, index, rng),
    }
}

/// Keeps in `largest`, band by band, what exceeds it.
fn keep_largest<L: Lanes>(largest: &mut [f64], power: &Spectrum<L>, weights: &[f64]) {
    let own = power.values().iter().zip(weights).map(|(power, weight)| f64::from(*power) * weight);
    largest.iter_mut().zip(own).for_each(|(most, own)| *most = most.max(own));
}
