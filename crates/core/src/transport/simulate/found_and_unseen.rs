//! Photons that are counted apart by whether paths could find them, so that the two estimators can
//! be compared.

use crate::{
    math::{
        rng::{Purpose, Streams},
        spectrum::{Lanes, with_lanes},
    },
    scene::{light::Strata, world::Scene},
    transport::{
        paths::Finding,
        tally::{Tally, Totals},
        trace::{Event, trace},
    },
};

/// Traces photons of `scene` in `batches` batches of `histories` each (at least one for each light
/// and for each face by which daylight enters). Returns the light that they bring to the captors,
/// split into two [parts](Totals::parts): the light that paths can find, and the light that they
/// cannot.
pub fn found_and_unseen(scene: &Scene, batches: u64, histories: u64, seed: u64) -> Totals {
    with_lanes!(scene.lanes(), L => split::<L>(scene, batches, histories, seed))
}

fn split<L: Lanes>(scene: &Scene, batches: u64, histories: u64, seed: u64) -> Totals {
    let strata = Strata::new(scene.lights(), histories.max(scene.sources() as u64), scene.lanes());
    let (mut tally, mut totals) = (Tally::new(scene, 2), Totals::new(scene, 2));
    for batch in 0..batches {
        let streams = Streams::new(seed, Purpose::Run, batch);
        for history in 0..strata.histories() {
            let mut rng = streams.history(history);
            let photon = scene.emit::<L>(&strata, history, &mut rng);
            let delta = strata.is_delta(scene.lights(), photon.source);
            let mut finding = Finding::new(scene, photon.light, delta);
            tally.emitted(Some(0), photon.weights, &photon.power);
            trace(scene, photon.ray, photon.power, (), &mut rng, |event| {
                let part = usize::from(finding.hidden);
                tally.score(scene, Some(part), photon.weights, &event);
                if let Event::Arrival { at, lobe, .. } = event {
                    finding.arrived(at.hit.triangle, lobe);
                }
            });
        }
        totals.add_batch(scene, &tally.take(), strata.histories());
    }
    totals
}
