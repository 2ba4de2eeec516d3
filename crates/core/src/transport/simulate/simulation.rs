//! What a run has found, together with the scene and the settings that it is of.

use super::{Accuracy, Choice, End, Outcome};
use crate::{
    scene::world::Scene,
    transport::{
        paths::Unseen,
        photon_map::PhotonMap,
        settings::{Estimator, Guiding, NearestCount, Settings},
        tally::Totals,
    },
};

/// The result of a run. It holds on to its scene and to its settings, so that what it found cannot
/// pass for the result of another run.
pub struct Simulation<'s> {
    scene: &'s Scene,
    settings: Settings,
    outcome: Outcome,
}

impl<'s> Simulation<'s> {
    pub(super) fn new(scene: &'s Scene, settings: &Settings, outcome: Outcome) -> Self {
        Self { scene, settings: settings.clone(), outcome }
    }

    /// Returns the scene that was run.
    pub fn scene(&self) -> &'s Scene {
        self.scene
    }

    /// Returns the settings that were asked for.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// Returns the estimator that was used; never `Auto`.
    pub fn estimator(&self) -> Estimator {
        self.outcome.estimator
    }

    /// Returns, for complete paths, the number of photons beside them.
    pub fn beside(&self) -> Option<u64> {
        self.outcome.beside
    }

    /// Returns, for complete paths and per channel of captors, whether no paths start from this
    /// face, so that all photons count there. Empty if paths start from all faces, and for other
    /// estimators.
    pub fn by_photons(&self) -> &[bool] {
        &self.outcome.by_photons
    }

    /// Returns the reason for the estimator, if a trial has chosen it.
    pub fn choice(&self) -> Option<&Choice> {
        self.outcome.choice.as_ref()
    }

    /// Returns the guiding that was used.
    pub fn guiding(&self) -> Guiding {
        self.outcome.guiding
    }

    /// Returns whether the pilot found too little light to say how the lamps should emit.
    pub fn starved(&self) -> bool {
        self.outcome.starved
    }

    /// Returns the sums per captor, group and band, and the ledger.
    pub fn totals(&self) -> &Totals {
        &self.outcome.totals
    }

    /// Returns the arrivals stored on captors; `None` for k = 0 and for paths.
    pub fn map(&self) -> Option<&PhotonMap> {
        self.outcome.map.as_ref()
    }

    /// Returns, for paths alone, the light that they cannot find, if there may be such light.
    pub fn unseen(&self) -> Option<&Unseen> {
        self.outcome.unseen.as_ref()
    }

    /// Returns, for paths and aimed photons, per channel of captors and groups, whether its standard
    /// error is too small for the light that they find by chance alone, or paths have found nothing
    /// where there is light, as plain photons show. Empty if that is so nowhere.
    pub fn too_small(&self) -> &[bool] {
        &self.outcome.too_small
    }

    /// Returns the reason why the run ended.
    pub fn end(&self) -> End {
        self.outcome.end
    }

    /// Returns, with a tolerance, whether it is met, and which value is farthest from it.
    pub fn accuracy(&self) -> Option<&Accuracy> {
        self.outcome.accuracy.as_ref()
    }

    /// Returns the number of threads that took part.
    pub fn threads(&self) -> usize {
        self.outcome.threads
    }

    /// Returns the same run with k-nearest estimates of `k` photons each: they are made of the
    /// stored arrivals, after the run. A run that stored none has no such estimates.
    pub fn with_k(mut self, k: NearestCount) -> Self {
        if k == NearestCount::NONE {
            self.outcome.map = None;
        }
        self.settings.k = Some(k);
        self
    }

    /// Returns what the run has found of a variant of its scene, by the index with which it was given;
    /// `scene` is the variant. There are no k-nearest estimates.
    #[doc(hidden)]
    pub fn of_variant<'o>(&self, variant: usize, scene: &'o Scene) -> Simulation<'o> {
        let found = &self.outcome;
        let outcome = Outcome {
            choice: found.choice.clone(),
            by_photons: found.by_photons.clone(),
            totals: found.totals.of_part(variant),
            map: None,
            unseen: None,
            too_small: found.too_small.clone(),
            accuracy: None,
            ..*found
        };
        Simulation::new(scene, &self.settings, outcome).with_k(NearestCount::NONE)
    }

    /// Returns the result at other powers. The simulation must be one of photons that is split into
    /// parts, light l in part `part_of[l]`; the powers of each part are multiplied by its
    /// `factors`, one per band. `scene` is the scene at the new powers. Bands that are added up in
    /// a sum, or whose ratio is sought, must have equal factors, wherever they have light.
    #[doc(hidden)]
    pub fn at_powers<'o>(
        &self,
        scene: &'o Scene,
        part_of: &[usize],
        factors: &[Vec<f64>],
    ) -> Simulation<'o> {
        let with_sums = |factors: &Vec<f64>| {
            let of_sum = |bands: &Vec<usize>| bands.iter().map(|&b| factors[b]).fold(0.0, f64::max);
            let sums = scene.sums().iter().map(|sum| of_sum(&sum.bands));
            // the bands of a ratio have the same factor, too
            let ratios = scene
                .ratios()
                .iter()
                .map(|ratio| of_sum(&ratio.numerator.bands).max(of_sum(&ratio.denominator.bands)));
            factors.iter().copied().chain(sums).chain(ratios).collect()
        };
        let columns: Vec<Vec<f64>> = factors.iter().map(with_sums).collect();
        let of_light = |light: usize| &factors[part_of[light]][..];
        let found = &self.outcome;
        let outcome = Outcome {
            choice: found.choice.clone(),
            by_photons: found.by_photons.clone(),
            totals: found.totals.mixed(&columns),
            map: found.map.as_ref().map(|map| map.at_powers(of_light)),
            unseen: None,
            too_small: Vec::new(),
            accuracy: None,
            ..*found
        };
        Simulation::new(scene, &self.settings, outcome)
    }
}
