//! Runs that end when they are accurate enough, or when their time is up.

use std::{
    sync::{
        Mutex,
        atomic::{AtomicU64, Ordering},
    },
    time::{Duration, Instant},
};

use super::{BATCHES, End, Outcome, Run, Work, lock, memory::most_open, schedule::Schedule};
use crate::{
    error::{Error, Result},
    math::machine::gib,
    transport::{
        settings::{MAX_PHOTONS, TimeLimit},
        tally::Tally,
    },
};

impl Run<'_> {
    /// Runs rounds of equal batches until every captor is accurate enough.
    pub(super) fn until_accurate(&self, tolerance: f64, limit: Option<u64>) -> Result<Outcome> {
        let watched = self.watched()?;
        let (task, unit) = (self.histories.full_task(), self.histories.unit());
        // a batch is worth adding up once it has some photons for each captor; for paths it always
        // is
        let enough = match self.histories.work {
            Work::Photons(_) | Work::Lights => self.scene.channels() as u64 / 8 / task,
            Work::Paths(..) => 2,
        };
        let batch = task * enough.max(2);
        // rounds are alike, and with a limit nearly all of it can be used
        let most = BATCHES * batch * unit;
        let limited = limit.map(|limit| limit.div_ceil(most));
        let whole = self
            .histories
            .schedule(self.scene, limit.zip(limited).map_or(most, |(all, rounds)| all / rounds))?;
        let short = self.less_than(&whole, whole.batch(0))?;
        let rounds = match short {
            Some(_) => 1,
            None => limited.unwrap_or_else(|| (MAX_PHOTONS / (whole.histories * unit)).max(1)),
        };
        let schedule = short.unwrap_or(whole);
        let (mut totals, map) = (self.totals(), self.map_builder());
        let (mut look, mut accuracy) = (1, None);
        let mut end = End::Photons;
        let begin = self.begin(&schedule, &mut totals, map.as_ref())?;
        let mut done = begin.0;
        while look <= done {
            look = next_look(look);
        }
        while done < rounds {
            // all rounds up to the next check at once; with a time limit one by one
            let to = if self.settings.max_time.is_some() { done + 1 } else { look.min(rounds) };
            self.rounds(&schedule, begin, done..to, limit, &mut totals, map.as_ref())?;
            done = to;
            let time_is_up = short.is_some() || self.time_is_up();
            if done < look && done < rounds && !time_is_up {
                continue;
            }
            look = next_look(done);
            let found = self.accuracy(&schedule, &totals, &watched, tolerance);
            let (met, worst) = (found.met, found.worst);
            accuracy = Some(found);
            if met {
                end = End::Tolerance;
                break;
            }
            self.report(limit, worst);
            if time_is_up {
                end = End::Time;
                break;
            }
        }
        Ok(Outcome { accuracy, ..self.finish(totals, map, &schedule, end)? })
    }

    /// Runs all batches side by side, task by task. The run can then end after any task, and its
    /// batches are as if it had been asked for just so many photons.
    pub(super) fn until_time(&self, schedule: &Schedule, limit: Duration) -> Result<Outcome> {
        let bytes = Tally::bytes(self.scene, self.parts(), usize::MAX) as u64 * schedule.batches;
        if bytes > most_open() {
            return Err(Error::input(
                "max_time",
                format!("its batch sums would take {:.0} GiB", gib(bytes)),
            )
            .remedy("limit the run by photons or tolerance, or ask for fewer captors"));
        }
        if let Some(short) = self.less_than(schedule, schedule.batch(0).min(schedule.task))? {
            let (mut totals, map) = (self.totals(), self.map_builder());
            let of = Some(short.histories * self.histories.unit());
            self.rounds(&short, (0, 0, 0), 0..1, of, &mut totals, map.as_ref())?;
            return self.finish(totals, map, &short, End::Time);
        }
        let map = self.map_builder();
        let batches: Vec<Mutex<Tally>> =
            (0..schedule.batches).map(|_| Mutex::new(self.tally())).collect();
        let most = schedule.tasks(0);
        let mut ended = *schedule;
        let mut end = End::Photons;
        for task in 0..most {
            let began = Instant::now();
            let next = AtomicU64::new(0);
            self.pool.broadcast(|_| {
                let mut task_sums = self.tally();
                loop {
                    let batch = next.fetch_add(1, Ordering::Relaxed);
                    if batch >= schedule.batches || self.stopped() {
                        return;
                    }
                    if task < schedule.tasks(batch) {
                        self.task(schedule, (0, task, batch), &mut task_sums, map.as_ref());
                        lock(&batches[batch as usize]).add_sums(&task_sums.take());
                        self.report(Some(schedule.histories * self.histories.unit()), None);
                    }
                }
            });
            self.check_stopped()?;
            // the last task of a batch has another length: the run ends either before it or
            // complete
            let more = (0..schedule.batches).all(|b| task + schedule.cuts < schedule.tasks(b));
            // stop at the border between tasks that is nearest to the limit
            if self.started.elapsed() + began.elapsed() / 2 >= limit
                && let Some(short) = schedule.ended_after(task + 1).filter(|_| more)
            {
                ended = short;
                end = End::Time;
                break;
            }
        }
        let mut totals = self.totals();
        for (batch, sums) in batches.iter().enumerate() {
            totals.add_batch(self.scene, &lock(sums).take(), ended.batch(batch as u64));
        }
        self.finish(totals, map, &ended, end)
    }

    /// With a time limit that will pass before each batch of `schedule` has done `most` histories,
    /// returns a schedule that fits into the limit; otherwise `None`. Trials measure the speed:
    /// short ones first, and longer ones while the short ones leave doubt.
    fn less_than(&self, schedule: &Schedule, most: u64) -> Result<Option<Schedule>> {
        let Some(limit) = self.settings.max_time.map(TimeLimit::get) else { return Ok(None) };
        let each = match &self.histories.work {
            Work::Photons(_) | Work::Lights => self.scene.sources() as u64,
            Work::Paths(..) => 1,
        };
        // the same batches, each with only `parts` photons of each light, or paths of each face
        let cut = |parts: u64| Schedule { histories: schedule.batches * each * parts, ..*schedule };
        let most = most / each;
        let mut parts = 1;
        while parts < most {
            let began = Instant::now();
            self.round(0, &cut(parts))?;
            self.shared.done.store(0, Ordering::Relaxed);
            self.shared.brightest.iter().for_each(|most| most.store(0, Ordering::Relaxed));
            let taken = began.elapsed();
            let left = limit.saturating_sub(self.started.elapsed());
            let fit = parts as f64 * left.as_secs_f64() / taken.as_secs_f64();
            if fit >= most as f64 {
                break;
            }
            if taken >= limit / 32 || left.is_zero() {
                return Ok(Some(cut((fit as u64).max(1))));
            }
            parts *= 2;
        }
        Ok(None)
    }
}

/// Returns the round after which the tolerance is checked again, when it has been checked after
/// `round`: each of the first six, then after a quarter more rounds each time. More frequent checks
/// would give chance more occasions to end a run too early.
fn next_look(round: u64) -> u64 {
    (round + 1).max((5 * round + 2) / 4)
}

#[cfg(test)]
mod tests {
    use std::sync::{Arc, atomic::AtomicBool};

    use glam::DVec3;

    use super::{
        super::{Control, Plan},
        *,
    };
    use crate::{
        scene::{
            captor::{CaptorKind, Sensor},
            light::{Cone, Lamp},
            world::{Band, CaptorPart, LightPart, Scene, SceneParts},
        },
        transport::settings::{Estimator, PhotonCount, Settings, ThreadCount},
    };

    #[test]
    fn looks_become_rarer() {
        let looks: Vec<u64> =
            std::iter::successors(Some(1), |&at| Some(next_look(at))).take(13).collect();
        assert_eq!(looks, [1, 2, 3, 4, 5, 6, 8, 10, 13, 16, 20, 25, 31]);
    }

    /// A lamp in the open, and a sensor.
    fn scene() -> Scene {
        let scene = Scene::new(SceneParts {
            bands: vec![Band { name: "PAR".into(), from_nm: None, to_nm: None }],
            lights: vec![LightPart::new("lamp", Lamp::new([1.0], Cone::point(DVec3::ZERO)))],
            captors: vec![CaptorPart {
                id: "sensor".into(),
                kind: CaptorKind::Virtual { both_sides: false },
                triangles: vec![[DVec3::Z, DVec3::Z + DVec3::Y, DVec3::Z + DVec3::X]],
                groups: Vec::new(),
                sensor: Sensor::default(),
            }],
            ..SceneParts::default()
        });
        scene.expect("a scene")
    }

    /// Where planning has taken longer than the limit on time, the run is as short as can be: one
    /// photon in each batch.
    #[test]
    fn planning_is_part_of_the_time() {
        let (scene, stop) = (scene(), AtomicBool::new(false));
        let control = Control { stop: &stop, progress: &|_| {} };
        let limit = Duration::from_secs(60);
        let settings = Settings {
            estimator: Estimator::Photons,
            max_time: TimeLimit::new(limit.as_secs_f64()).ok(),
            photons: PhotonCount::new(1 << 40).ok(),
            threads: ThreadCount::ONE,
            ..Settings::default()
        };
        let mut plan = Plan::make(&scene, &settings, &control).expect("a plan");
        plan.started = Instant::now().checked_sub(2 * limit).expect("a time before");
        let run = Run::planned(&scene, &plan, Vec::new(), &control).expect("a run");
        let simulation = run.go().expect("results");
        assert_eq!((simulation.totals.histories, simulation.end), (BATCHES, End::Time));
    }

    /// What pilot photons have found for the trial of paths is used again by the run.
    #[test]
    fn the_pilot_of_paths_is_run_once() {
        let (scene, stop) = (scene(), AtomicBool::new(false));
        let control = Control { stop: &stop, progress: &|_| {} };
        let settings = Settings {
            estimator: Estimator::Auto,
            threads: ThreadCount::ONE,
            ..Settings::default()
        };
        let plan = Plan::make(&scene, &settings, &control).expect("a plan");
        let run = Run::planned(&scene, &plan, Vec::new(), &control).expect("a run");
        let (Work::Paths(_, own), Some(known)) = (&run.histories.work, &plan.of_paths) else {
            panic!("{:?}", plan.choice)
        };
        assert!(Arc::ptr_eq(own, known));
    }
}
