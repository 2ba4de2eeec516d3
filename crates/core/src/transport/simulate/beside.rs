//! Photons beside the paths of a run. They count at captors where they bring light that paths leave
//! to them, and at the faces from which no paths start, so that both together find all light, and no
//! light twice. What becomes of all their power is scored, too, and where they arrive is stored in the
//! photon map.

use std::sync::{Mutex, atomic::Ordering};

use super::{
    BATCHES, Run,
    schedule::{Beside, Schedule},
};
use crate::{
    math::{
        rng::{Purpose, Streams},
        spectrum::Lanes,
    },
    scene::light::Emission,
    transport::{
        met::Account,
        paths::{Finding, Pilot},
        photon_map::{MapBuilder, TaskKey, Way},
        tally::Tally,
        trace::{Counted, Event, trace},
    },
};

/// The least number of photons of a task of the usual length, for each source: enough to share them
/// in proportion.
const EACH: u64 = 8;

impl Beside {
    /// Returns the least number of histories of a task of the usual length.
    pub fn full_task(self) -> u64 {
        ((EACH * self.least) as f64 / self.ratio).ceil() as u64
    }
}

impl Run<'_> {
    /// Traces the photons of a task of photons beside paths; other tasks have none.
    pub(super) fn photons_beside<L: Lanes>(
        &self,
        schedule: &Schedule,
        key: TaskKey,
        pilot: &Pilot,
        tally: &mut Tally,
        map: Option<&Mutex<MapBuilder>>,
    ) {
        let (round, task, batch) = key;
        let Some((first, photons)) = schedule.photons_beside(batch, task) else { return };
        let scene = self.scene;
        let (_, histories) = schedule.range(batch, task);
        let by_photons = &*self.histories.by_photons;
        // the photon map wants all light in proportion, and so do faces at which photons alone count
        let all = !by_photons.is_empty() || map.is_some();
        let strata = pilot.strata(scene, photons, histories, all);
        // photons that are sent near the captors choose their places by their own rule
        let spreads = self.spreads() && pilot.may_serve_alone();
        // weights are those of photons that are divided by the number of paths
        let mut stored = self.stored(map, key, photons as f64 / histories as f64);
        let purpose = match self.purpose {
            Purpose::Run => Purpose::Beside,
            other => other,
        };
        let mut account = tally.keeps_account(scene).then(Account::<L>::default);
        let mut arrivals = [0; 2];
        let streams = Streams::new(self.settings.seed, purpose, round * BATCHES + batch);
        for index in 0..photons {
            if self.stopped() {
                return;
            }
            let mut rng = streams.history(first + index);
            if spreads {
                strata.spread(scene.lights(), index, first, streams, &mut rng);
            }
            let (photon, usual) = pilot.emit::<L>(scene, &strata, index, &mut rng);
            let left = pilot.leaves(photon.light);
            let delta = left || strata.is_delta(scene.lights(), photon.source);
            let mut finding = Finding::new(scene, photon.light, delta);
            let emitted = usual.as_ref().unwrap_or(&photon.power);
            let of = (photon.light, None);
            self.count_emission(tally, &mut account, of, photon.weights, emitted);
            if let Some(before) = &usual {
                let event = Event::Chance { before, after: &photon.power };
                tally.score(scene, None, photon.weights, &event);
                if let Some(account) = &mut account {
                    tally.score_met(scene, None, photon.weights, &event, account, |_| false);
                }
            }
            if photon.power.is_zero() {
                continue;
            }
            let Emission { light, weights, ray, power, .. } = photon;
            trace(scene, ray, power, (), &mut rng, |event| {
                let alone = |face: usize| by_photons.get(face).is_some_and(|&alone| alone);
                let counts = |counted: &Counted<L>| finding.hidden || alone(counted.channel());
                tally.score_beside(scene, weights, &event, counts);
                if let Some(account) = &mut account {
                    tally.score_met(scene, None, weights, &event, account, counts);
                    account.then(&event);
                }
                if let Some(stored) = &mut stored {
                    stored.add(&event, Way::default(), (light, index), weights);
                }
                if let Event::Arrival { at, lobe, .. } = event {
                    let more = [1, u64::from(finding.hidden)];
                    arrivals.iter_mut().zip(more).for_each(|(sum, more)| *sum += more);
                    finding.arrived(at.hit.triangle, lobe);
                }
            });
        }
        if self.purpose == Purpose::Trial {
            let sums = self.shared.arrivals.iter().zip(arrivals);
            sums.for_each(|(sum, more)| {
                sum.fetch_add(more, Ordering::Relaxed);
            });
        }
        self.store(map, key, stored);
    }
}
