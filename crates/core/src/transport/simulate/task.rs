//! Follows the histories of one task.

use std::sync::{Mutex, atomic::Ordering};

use super::{BATCHES, Keep, Run, Work, lock, schedule::Schedule};
use glam::Vec3;

use crate::{
    math::{
        effort,
        rng::{Purpose, Streams},
        spectrum::{Lanes, Spectrum, with_lanes},
    },
    scene::{
        light::{Emission, Strata},
        material::{LobeKind, Scatterer},
        world::Scene,
    },
    transport::{
        guiding::{Aimed, Guided},
        met::Account,
        paths::{Face, Finding, Pilot},
        photon_map::{
            Arrival, MapBuilder, PackedDirection, StoredPhoton, TaskArrivals, TaskKey, Way,
        },
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
        self.done.fetch_add(self.photons_in(schedule, key.2, key.1), Ordering::Relaxed);
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
        with_lanes!(self.scene.lanes(), L => match &self.work {
            Work::Paths(faces, pilot) => {
                self.paths::<L>(schedule, key, faces, pilot, tally);
                self.photons_beside::<L>(schedule, key, pilot, tally, map);
            }
            Work::Photons(strata) => {
                let own = (strata.histories() != histories).then(|| self.strata(histories));
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
        match &self.work {
            Work::Photons(_) | Work::Lights => histories,
            Work::Paths(faces, _) => histories * schedule.faces(task, faces.len()).len() as u64,
        }
    }

    /// Returns whether only the photon map of the run is wanted. Once the map is full, there is
    /// then no more to do.
    fn keeps_map_alone(&self) -> bool {
        !matches!(self.keep, Keep::OnCaptors) && self.purpose != Purpose::Trial
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
            for (all, &most) in self.brightest.iter().zip(brightest.values()) {
                all.fetch_max((f64::from(most) / area).to_bits(), Ordering::Relaxed);
            }
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
        match self.guidance.is_some() || tally.keeps_account(self.scene) {
            false => self.photons::<L, false>(schedule, key, strata, tally, map),
            true => self.photons::<L, true>(schedule, key, strata, tally, map),
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
        let (round, task, batch) = key;
        let (first, histories) = schedule.range(batch, task);
        let limit = map.map_or(0, |map| lock(map).limit());
        let mut stored = map.and_then(|map| lock(map).task(key));
        if stored.is_none() && self.keeps_map_alone() {
            return;
        }
        let bands = self.scene.bands().len();
        let streams = self.streams(round, batch);
        let guidance = self.guidance.as_ref().filter(|_| MORE);
        let mut account = (MORE && tally.keeps_account(self.scene)).then(Account::<L>::default);
        let mut copies = Vec::new();
        let mut brightest = vec![0.0f64; bands];
        let heavy = MORE && guidance.is_some() && self.settings.tolerance.is_some();
        for index in 0..histories {
            if self.stopped() {
                return;
            }
            let mut rng = streams.history(first + index);
            let lamps = guidance.and_then(|guidance| guidance.lamps.as_deref());
            let (photon, density) = match lamps {
                None => (self.scene.emit::<L>(strata, index, &mut rng), 1.0),
                Some(lamps) => lamps.emit(self.scene, strata, index, &mut rng),
            };
            // taken apart, so that only the power is kept in memory where nothing guides photons
            let Emission { light, source, weights, ray, start, face, power } = photon;
            let part = self.part_of.get(light).copied();
            // the density of light from infinitely far away may depend on where the light comes
            // from
            let chosen = (density != 1.0 && start.is_none()).then_some(1.0 / density);
            let emitted = chosen.map(|factor| power.clone().scaled(factor));
            let emitted = emitted.as_ref().unwrap_or(&power);
            tally.emitted(part, weights, emitted);
            if let Some(account) = &mut account {
                account.start(self.scene.parameters().of_light(light));
                tally.emitted_in_variants(self.scene, weights, emitted, account.now(self.scene));
            }
            let mut way = Way::default();
            let of_sun = self.without_direct_sun && strata.is_sun(self.scene.lights(), source);
            let mut found = of_sun.then(|| Finding::new(self.scene, light, true));
            let mut on = |event: Event<'_, L>| {
                // a flight that accompanies the photon carries light that was scattered
                let beside =
                    matches!(event, Event::FlightBeside | Event::Crossing { carried: None, .. });
                if let Some(finding) = found.as_mut().filter(|f| !beside && f.is_direct()) {
                    if let Event::Arrival { at, lobe, .. } = event {
                        finding.arrived(at.hit.triangle, lobe);
                    }
                    return;
                }
                tally.score(self.scene, part, weights, &event);
                if let Some(account) = &mut account {
                    tally.score_met(self.scene, part, weights, &event, account, |_| true);
                    account.then(&event);
                }
                if let Some(counted) = event.counted(self.scene).filter(|_| heavy) {
                    let values = counted.power.values().iter().zip(weights);
                    let brought = values.map(|(power, weight)| f64::from(*power) * weight);
                    brightest.iter_mut().zip(brought).for_each(|(most, own)| *most = most.max(own));
                }
                let Some(task) = &mut stored else { return };
                let history = index as u32;
                let wants = |bin, position| task.wants(bin, position, history);
                let kept = self.keep.arrival(self.scene, &event, way, wants);
                if let Some((mut arrival, power)) = kept {
                    arrival.photon.light = light as u32;
                    arrival.photon.history = history;
                    let power = power.values();
                    let power = (0..bands).map(|b| (f64::from(power[b]) * weights[b]) as f32);
                    task.push(limit, arrival, power);
                    if !matches!(self.keep, Keep::OnCaptors) {
                        task.came(way);
                    }
                }
                if let Event::Arrival { at, lobe, .. } = event {
                    way = way.then(lobe, || at.material.glossy() > 0.0);
                }
            };
            let Some(guidance) = guidance else {
                match self.keep {
                    Keep::Focused(_) => trace(self.scene, ray, power, UntilDiffused, &mut rng, on),
                    _ => trace(self.scene, ray, power, (), &mut rng, on),
                }
                continue;
            };
            let photon = Emission { light, source, weights, ray, start, face, power };
            let power = photon.power.clone().scaled(1.0 / density);
            if start.is_some() && density != 1.0 {
                on(Event::Chance { before: &photon.power, after: &power });
            }
            let mut aimed = guidance.targets.as_ref().map(|to| Aimed::new(self.scene, to));
            if let Some(aimed) = aimed.as_mut().filter(|_| !of_sun) {
                let other = (density != 1.0).then(|| self.scene.emit::<L>(strata, index, &mut rng));
                aimed.start(&photon, other.as_ref(), &mut rng, &mut on);
            }
            let windows = guidance.windows.as_ref().map(|windows| {
                let largest = weights.iter().copied().fold(0.0, f64::max);
                (&*windows.importance, largest as f32 / windows.usual)
            });
            copies.clear();
            let guide = Guided::new(aimed, windows, &mut copies);
            trace(self.scene, ray, power, guide, &mut rng, on);
        }
        for (all, &most) in self.brightest.iter().zip(&brightest) {
            all.fetch_max(most.to_bits(), Ordering::Relaxed);
        }
        self.store(map, key, stored);
    }

    /// Adds the arrivals of a task to the map. The run ends where they take more memory than is
    /// left.
    pub(super) fn store(
        &self,
        map: Option<&Mutex<MapBuilder>>,
        key: TaskKey,
        stored: Option<TaskArrivals>,
    ) {
        let (Some(map), Some(stored)) = (map, stored) else { return };
        let mut map = lock(map);
        map.add(key, stored);
        if map.bytes() > self.map_room {
            self.map_too_large.store(true, Ordering::Relaxed);
            self.broken.store(true, Ordering::Relaxed);
        }
    }
}

impl Way {
    /// Returns the way after one more surface, which scattered the photon by `lobe` and may have a
    /// glossy lobe.
    #[inline]
    fn then(self, lobe: Option<LobeKind>, is_glossy: impl Fn() -> bool) -> Self {
        match lobe {
            Some(lobe) if lobe.is_diffuse() => Self {
                bounces: self.bounces.saturating_add(1),
                diffused: self.diffused || !is_glossy(),
                ..self
            },
            Some(lobe) if lobe.is_specular() => Self { mirrored: true, ..self },
            _ => self,
        }
    }
}

impl Keep<'_> {
    /// Returns the arrival to store of an event, and its power, for a photon that came this `way`.
    /// `None` if the event is not stored. `wants` says of a bin and a position whether it is.
    #[inline]
    pub(super) fn arrival<'e, L: Lanes>(
        self,
        scene: &'e Scene,
        event: &'e Event<'_, L>,
        way: Way,
        wants: impl FnOnce(u32, Vec3) -> bool,
    ) -> Option<(Arrival, &'e Spectrum<L>)> {
        let (position, direction, triangle) = match *event {
            Event::Crossing { crossing, direction, carried: Some(_), .. } => {
                (crossing.point, direction, crossing.triangle)
            }
            Event::Arrival { at, .. } => (at.hit.point, at.interaction.direction, at.hit.triangle),
            Event::Crossing { carried: None, .. }
            | Event::FlightBeside
            | Event::ArrivalBeside { .. }
            | Event::Chance { .. }
            | Event::Turn(_)
            | Event::Escaped { .. }
            | Event::Lost(_) => return None,
        };
        let (bin, power) = match (self, event) {
            (Keep::OnCaptors, _) => {
                let counted = event.counted(scene)?;
                let carried = match event {
                    Event::Crossing { carried, .. } => *carried,
                    _ => None,
                };
                (counted.channel() as u32, carried.unwrap_or(counted.power))
            }
            (Keep::Focused(_), _) if !way.is_focused() => return None,
            (Keep::Focused(_), Event::Arrival { at, .. }) if !at.material.is_diffuse() => {
                return None;
            }
            (
                Keep::OnSurfaces(patches) | Keep::Focused(patches),
                Event::Arrival { at, power, .. },
            ) => (patches.bin(triangle, at.interaction.front), *power),
            (Keep::OnSurfaces(_) | Keep::Focused(_), _) => return None,
        };
        if !wants(bin, position) {
            return None;
        }
        let direction = PackedDirection::new(direction);
        let photon = StoredPhoton { direction, triangle: triangle as u32, light: 0, history: 0 };
        Some((Arrival { position, bin, photon }, power))
    }
}
