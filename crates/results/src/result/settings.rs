//! The settings that decide the result of a run.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use phylux_core::transport::{
    settings::{Estimator, Guiding, NearestCount, PhotonCount, Target, Tolerance},
    simulate::Simulation,
};

/// The settings that decide the numbers of a result: a run with the same settings finds the same.
/// Threads, time limits and shards do not belong to them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct RunSettings {
    /// The estimator: photons, paths or complete paths.
    pub estimator: Estimator,
    /// Number of photons, or of paths over all captors, that were traced. Where a tolerance has
    /// ended the run, the limit on their number; absent if there was none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub photons: Option<u64>,
    /// Where a trial has chosen complete paths: the number of photons whose work the run was to take;
    /// absent if only a tolerance ended it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub work_of_photons: Option<u64>,
    /// Seed of the random streams.
    pub seed: u64,
    /// The relative standard error at which to stop, if one was asked for.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tolerance: Option<f64>,
    /// What had to meet the tolerance, each as pattern:quantity or pattern:quantity:band; absent
    /// for the irradiance of all faces.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub of: Vec<String>,
    /// Number of photons of a k-nearest estimate, where it was given; 0 made no estimates.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub k: Option<usize>,
    /// The most arrivals that k-nearest estimates are taken from, where there are any.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub map_photons: Option<usize>,
    /// For photons: the help that they got to reach captors that little light reaches.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub guiding: Option<Guiding>,
    /// Whether results are split by light; absent where they are not.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub by_light: bool,
}

impl RunSettings {
    /// Returns the settings of the run that `simulation` resulted from.
    pub fn new(simulation: &Simulation) -> Self {
        let settings = simulation.settings();
        let of_photons = simulation.estimator() == Estimator::Photons;
        let has_photons = simulation.estimator() != Estimator::Paths;
        let met = simulation.accuracy().is_some_and(|accuracy| accuracy.met);
        Self {
            estimator: simulation.estimator(),
            photons: if met {
                settings.tolerance_limit.map(PhotonCount::get)
            } else {
                Some(simulation.totals().histories)
            },
            work_of_photons: simulation
                .choice()
                .filter(|choice| choice.estimator == Estimator::Complete)
                .and_then(|choice| choice.photons),
            seed: settings.seed,
            tolerance: settings.tolerance.map(Tolerance::get),
            of: settings.of.iter().map(Target::to_string).collect(),
            k: settings.k.filter(|_| has_photons).map(NearestCount::get),
            map_photons: simulation.map().map(|_| settings.map_photons.get()),
            guiding: of_photons.then_some(simulation.guiding()),
            by_light: settings.by_light,
        }
    }
}
