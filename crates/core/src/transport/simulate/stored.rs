//! What the photon map stores of the photons of a task.

use std::sync::{Mutex, atomic::Ordering};

use glam::Vec3;

use super::{Arrivals, Run, lock};
use crate::{
    math::spectrum::{Lanes, Spectrum},
    scene::{
        material::{LobeKind, Scatterer},
        world::Scene,
    },
    transport::{
        photon_map::{
            Arrival, MapBuilder, PackedDirection, StoredPhoton, TaskArrivals, TaskKey, Way,
        },
        trace::Event,
    },
};

/// The arrivals of a task that the photon map stores.
pub(super) struct Stored<'a> {
    scene: &'a Scene,
    arrivals: Arrivals<'a>,
    task: TaskArrivals,
    limit: usize,
    /// By what the weights of photons are multiplied.
    scale: f64,
}

impl<'a> Stored<'a> {
    /// Adds an event of a photon that came this `way`, if the map stores it. `of` has the photon's light
    /// and its number in the task, and `weights` those of its bands.
    #[inline(always)]
    pub fn add<L: Lanes>(
        &mut self,
        event: &Event<'_, L>,
        way: Way,
        of: (usize, u64),
        weights: &[f64],
    ) {
        let (light, history) = (of.0 as u32, of.1 as u32);
        let wants = |bin, position| self.task.wants(bin, position, history);
        let Some((mut arrival, power)) = self.arrivals.arrival(self.scene, event, way, wants)
        else {
            return;
        };
        (arrival.photon.light, arrival.photon.history) = (light, history);
        // there may be more lanes than bands, and the map has a number for each band
        let power = power.values().iter().zip(weights).take(self.scene.bands().len());
        let power = power.map(|(power, weight)| (f64::from(*power) * weight * self.scale) as f32);
        self.task.push(self.limit, arrival, power);
        if !matches!(self.arrivals, Arrivals::OnCaptors) {
            self.task.came(way);
        }
    }
}

impl<'a> Run<'a> {
    /// Returns where the arrivals of a task are stored; `None` where the run has no map, or has enough
    /// for it. The weights of photons are multiplied by `scale`.
    pub(super) fn stored(
        &self,
        map: Option<&Mutex<MapBuilder>>,
        key: TaskKey,
        scale: f64,
    ) -> Option<Stored<'a>> {
        let map = lock(map?);
        let (task, limit) = (map.task(key)?, map.limit());
        Some(Stored { scene: self.scene, arrivals: self.kept.arrivals, task, limit, scale })
    }

    /// Adds the arrivals of a task to the map. The run ends where they take more memory than is
    /// left.
    pub(super) fn store(
        &self,
        map: Option<&Mutex<MapBuilder>>,
        key: TaskKey,
        stored: Option<Stored>,
    ) {
        let (Some(map), Some(stored)) = (map, stored) else { return };
        let mut map = lock(map);
        map.add(key, stored.task);
        if map.bytes() > self.kept.room {
            self.kept.too_large.store(true, Ordering::Relaxed);
            self.shared.broken.store(true, Ordering::Relaxed);
        }
    }
}

impl Way {
    /// Returns the way after one more surface, which scattered the photon by `lobe` and may have a
    /// glossy lobe.
    #[inline]
    pub(super) fn then(self, lobe: Option<LobeKind>, is_glossy: impl Fn() -> bool) -> Self {
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

impl Arrivals<'_> {
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
            (Arrivals::OnCaptors, _) => {
                let counted = event.counted(scene)?;
                let carried = match event {
                    Event::Crossing { carried, .. } => *carried,
                    _ => None,
                };
                (counted.channel() as u32, carried.unwrap_or(counted.power))
            }
            (Arrivals::Focused(_), _) if !way.is_focused() => return None,
            (Arrivals::Focused(_), Event::Arrival { at, .. }) if !at.material.is_diffuse() => {
                return None;
            }
            (
                Arrivals::OnSurfaces(patches) | Arrivals::Focused(patches),
                Event::Arrival { at, power, .. },
            ) => (patches.bin(triangle, at.interaction.front), *power),
            (Arrivals::OnSurfaces(_) | Arrivals::Focused(_), _) => return None,
        };
        if !wants(bin, position) {
            return None;
        }
        let direction = PackedDirection::new(direction);
        let photon = StoredPhoton { direction, triangle: triangle as u32, light: 0, history: 0 };
        Some((Arrival { position, bin, photon }, power))
    }
}
