//! The result that a simulation would have had with other powers of the lights.

use super::Simulation;
use crate::scene::world::Scene;

impl Simulation {
    /// Returns the result at other powers. The simulation must be one of photons that is split into
    /// parts, light l in part `part_of[l]`; the powers of each part are multiplied by its
    /// `factors`, one per band. `scene` is the scene at the new powers. Bands that are added up in
    /// a sum, or whose ratio is sought, must have equal factors, wherever they have light.
    pub fn at_powers(&self, scene: &Scene, part_of: &[usize], factors: &[Vec<f64>]) -> Self {
        let with_sums = |factors: &Vec<f64>| {
            let of_sum = |bands: &Vec<usize>| bands.iter().map(|&b| factors[b]).fold(0.0, f64::max);
            let sums = scene.sums.iter().map(|sum| of_sum(&sum.bands));
            // the bands of a ratio have the same factor, too
            let ratios = scene
                .ratios
                .iter()
                .map(|ratio| of_sum(&ratio.numerator.bands).max(of_sum(&ratio.denominator.bands)));
            factors.iter().copied().chain(sums).chain(ratios).collect()
        };
        let columns: Vec<Vec<f64>> = factors.iter().map(with_sums).collect();
        let of_light = |light: usize| &factors[part_of[light]][..];
        Self {
            choice: self.choice.clone(),
            by_photons: self.by_photons.clone(),
            totals: self.totals.mixed(&columns),
            map: self.map.as_ref().map(|map| map.at_powers(of_light)),
            unseen: None,
            too_small: Vec::new(),
            accuracy: None,
            ..*self
        }
    }
}
