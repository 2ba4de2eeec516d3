//! What the histories of a run are.

use std::sync::Arc;

use super::schedule::{Beside, Schedule};
use crate::{
    error::{Error, Result},
    scene::{light::Strata, world::Scene},
    transport::{
        guiding::{Guidance, Lamps},
        paths::{Face, Pilot},
    },
};

/// Number of histories of a task, unless there are more lights than that.
pub(super) const TASK: u64 = 1024;
/// The least number of paths from each face.
pub(super) const MIN_PATHS: u64 = 100;

/// What the histories of a run are.
pub(super) struct Histories<'a> {
    pub work: Work<'a>,
    /// For complete paths: the photons beside them.
    pub beside: Option<Beside>,
    /// For complete paths, per channel of captors: whether all photons count there, and no paths
    /// start. Empty if that is so nowhere.
    pub by_photons: Arc<[bool]>,
    /// What guides the photons; `None` if they are not guided.
    pub guidance: Option<Guidance<'a>>,
    /// Whether photons of suns count only once they have been scattered.
    pub without_direct_sun: bool,
}

/// What one history is.
pub(super) enum Work<'a> {
    /// A photon. The strata hold the lights' shares in a task of the usual length.
    Photons(Strata),
    /// A photon of the light whose index is that of the round.
    Lights,
    /// A path from each of these faces, and what the pilot photons have found for the paths.
    Paths(Vec<Face<'a>>, Arc<Pilot>),
}

impl<'a> Histories<'a> {
    /// Histories without photons beside them or guiding.
    pub fn new(work: Work<'a>) -> Self {
        let by_photons = Arc::default();
        Self { work, beside: None, by_photons, guidance: None, without_direct_sun: false }
    }

    /// Returns the same with photons that are guided by `guidance`.
    pub fn guided_by(mut self, scene: &Scene, guidance: Option<Guidance<'a>>) -> Self {
        self.guidance = guidance;
        if let Work::Photons(strata) = &self.work {
            self.work = Work::Photons(self.strata(scene, strata.histories()));
        }
        self
    }

    /// Shares a number of photons among the lights.
    pub fn strata(&self, scene: &Scene, photons: u64) -> Strata {
        let shares = self.lamps().and_then(|lamps| lamps.shares.as_deref());
        Strata::shared(scene.lights(), photons, scene.lanes(), shares)
    }

    /// Returns how lamps are guided, if they are.
    pub fn lamps(&self) -> Option<&Lamps> {
        self.guidance.as_ref().and_then(|guidance| guidance.lamps.as_deref())
    }

    /// Returns the number of histories of a task of the usual length.
    pub fn full_task(&self) -> u64 {
        match &self.work {
            Work::Photons(strata) => strata.histories(),
            Work::Lights => TASK,
            // about as many paths in all, and enough photons beside them
            Work::Paths(faces, _) => {
                let paths = (TASK / faces.len() as u64).max(1);
                self.beside.map_or(paths, |beside| paths.max(beside.full_task()))
            }
        }
    }

    /// Returns the number of photons, or of paths, that one history is.
    pub fn unit(&self) -> u64 {
        match &self.work {
            Work::Photons(_) | Work::Lights => 1,
            Work::Paths(faces, _) => faces.len() as u64,
        }
    }

    /// Cuts a number of photons or paths into batches and tasks. Error: there are fewer photons than
    /// lights.
    pub fn schedule(&self, scene: &Scene, number: u64) -> Result<Schedule> {
        if let Work::Paths(..) = self.work {
            let each = (number / self.unit()).max(MIN_PATHS);
            let cuts = self.unit().div_ceil(TASK) + u64::from(self.beside.is_some());
            let beside = self.beside;
            return Ok(Schedule { cuts, beside, ..Schedule::new(each, 1, self.full_task()) });
        }
        check_photons(scene, number)?;
        let lights = scene.sources() as u64;
        Ok(Schedule::new(number, lights, self.full_task()))
    }
}

/// Checks that there are enough photons for each light to have one.
pub fn check_photons(scene: &Scene, photons: u64) -> Result<()> {
    let lights = scene.sources() as u64;
    if photons >= lights {
        return Ok(());
    }
    let (what, each) = match scene.has_daylight() {
        true => ("lights and faces that daylight enters by", "each of them"),
        false => ("lights", "every light"),
    };
    let problem = format!("{photons} photons for {lights} {what}");
    Err(Error::input("photons", problem)
        .remedy(format!("{each} needs one: ask for at least {lights}")))
}
