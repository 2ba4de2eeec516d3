//! Photons beside the paths of a run. They count at captors where they bring light that paths leave
//! to them, and at the faces from which no paths start, so that both together find all light, and no
//! light twice. What becomes of all their power is scored, too.

use super::{
    BATCHES, Run,
    schedule::{Beside, Schedule},
};
use crate::{
    math::{
        rng::{Purpose, Streams},
        spectrum::Lanes,
    },
    transport::{
        paths::{Finding, Pilot},
        photon_map::TaskKey,
        tally::Tally,
        trace::{Event, trace},
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
        (round, task, batch): TaskKey,
        pilot: &Pilot,
        tally: &mut Tally,
    ) {
        let Some((first, photons)) = schedule.photons_beside(batch, task) else { return };
        let scene = self.scene;
        let (_, histories) = schedule.range(batch, task);
        let by_photons = &*self.by_photons;
        let strata = pilot.strata(scene, photons, histories, !by_photons.is_empty());
        let purpose = match self.purpose {
            Purpose::Run => Purpose::Beside,
            other => other,
        };
        let streams = Streams::new(self.settings.seed, purpose, round * BATCHES + batch);
        for index in 0..photons {
            if self.stopped() {
                return;
            }
            let mut rng = streams.history(first + index);
            let (photon, usual) = pilot.emit::<L>(scene, &strata, index, &mut rng);
            let left = pilot.leaves(photon.light);
            let delta = left || strata.is_delta(scene.lights(), photon.source);
            let mut finding = Finding::new(scene, photon.light, delta);
            tally.emitted(None, photon.weights, usual.as_ref().unwrap_or(&photon.power));
            if let Some(before) = &usual {
                let event = Event::Chance { before, after: &photon.power };
                tally.score(scene, None, photon.weights, &event);
            }
            if photon.power.is_zero() {
                continue;
            }
            trace(scene, photon.ray, photon.power, (), &mut rng, |event| {
                let alone = |face: usize| by_photons.get(face).is_some_and(|&alone| alone);
                tally.score_beside(scene, photon.weights, &event, |counted| {
                    finding.hidden || alone(counted.channel())
                });
                if let Event::Arrival { at, lobe, .. } = event {
                    finding.arrived(at.hit.triangle, lobe);
                }
            });
        }
    }
}
