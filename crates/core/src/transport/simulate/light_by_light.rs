//! Runs that trace the lights one after the other, so that what each of them brings need not be in
//! memory beside the others.

use std::sync::atomic::Ordering;

use super::{Arrivals, Control, Plan, Run, Work, batches::Turn, schedule::Schedule};
use crate::{
    error::{Error, Result, catch_panic},
    scene::{light::Strata, world::Scene},
    transport::{
        guiding::Guidance,
        settings::{Estimator, NearestCount, Settings},
        tally::Totals,
    },
};

/// The least number of photons of each light and face that daylight enters by, where there are that
/// many for each: from a few batches an error can be estimated.
const LEAST: u64 = 8;

/// Number of photons of each of these faces in a batch, where there are enough for several batches.
const EACH: u64 = 4;

/// What is done with the sums of a light once all its photons are traced: it gets the index of the
/// light. An error ends the run.
pub type Take<'t> = dyn FnMut(usize, &Totals) -> Result<()> + Send + 't;

/// Traces the photons of these lights, one light after the other, in their order, and hands the sums
/// of each to `take`. The photons of a light do not depend on which others are traced. Left out is the light that comes from a sun to a captor straight, through thin panes or
/// by way of one flat pane or mirror, which [`direct_sun`](crate::transport::direct_sun) finds
/// better. Errors: those of a run, and of `take`.
pub fn simulate_light_by_light(
    scene: &Scene,
    settings: &Settings,
    control: &Control,
    lights: &[usize],
    take: &mut Take,
) -> Result<()> {
    let settings = Settings {
        estimator: Estimator::Photons,
        by_light: false,
        k: Some(NearestCount::NONE),
        ..settings.clone()
    };
    if lights.is_empty() {
        return Ok(());
    }
    catch_panic("run", || {
        let Plan { settings, guidance, .. } = &Plan::make(scene, &settings, control)?;
        // copies of a photon do not know whether it came straight, so there are no weight windows
        let guidance = guidance.as_ref().and_then(|_| Guidance::aim(scene));
        let run = Run::new(scene, settings, Vec::new(), Arrivals::OnCaptors, control)?;
        let mut run = run.guided_by(guidance);
        run.histories.without_direct_sun = true;
        let photons = settings.photons_or_default();
        // this checks that there are enough photons
        run.histories.schedule(run.scene, photons)?;
        run.light_by_light(photons, lights, take)
    })
}

/// Returns how many of so many photons each light gets where lights are traced one by one.
pub fn photons_by_light(scene: &Scene, photons: u64) -> Vec<u64> {
    let least = LEAST.min(photons / scene.sources().max(1) as u64);
    Strata::photons_of_lights(scene.lights(), photons, least)
}

impl Run<'_> {
    fn light_by_light(self, photons: u64, lights: &[usize], take: &mut Take) -> Result<()> {
        let shares = photons_by_light(self.scene, photons);
        let mut run = self;
        run.histories.work = Work::Lights;
        let schedule = |light: u64| {
            let light = light as usize;
            let sources = run.scene.lights()[light].sources().max(1) as u64;
            // several photons of each face in a batch, so that the faces have their shares
            let batch = (shares[light] / LEAST).clamp(sources, EACH * sources);
            Schedule::new(shares[light], batch, super::TASK.max(batch))
        };
        let mut failed = None;
        let (mut next, mut totals) = (0, run.totals());
        let mut add = |turn: Turn| {
            let Turn::Add(batch, sums) = turn else { return };
            let light = lights[next];
            let schedule = schedule(light as u64);
            totals.add_batch(run.scene, &sums, schedule.batch(batch));
            if batch + 1 < schedule.batches || failed.is_some() {
                return;
            }
            if let Err(error) = take(light, &totals) {
                failed = Some(error);
                run.shared.broken.store(true, Ordering::Relaxed);
            }
            next += 1;
            totals = run.totals();
        };
        let of = Some(lights.iter().map(|&light| shares[light]).sum());
        let rounds = lights.iter().map(|&light| light as u64);
        let all = 0..u64::MAX;
        let done = run.batches(&schedule, (0, 0, 0), rounds, all, of, &mut add, None);
        failed.map_or(done, |error: Error| Err(error))
    }
}
