//! What a simulation would have found at other powers of the lights.

use super::Simulation;
use crate::scene::world::Scene;

impl Simulation {
    /// Of photons, split into the parts `part_of` lights: with each part's powers times its factors, per band.
    /// `scene` is the scene at these powers. Bands that a sum adds up have equal factors, where they have light.
    pub fn at_powers(&self, scene: &Scene, part_of: &[usize], factors: &[Vec<f64>]) -> Self {
        let with_sums = |factors: &Vec<f64>| {
            let of_sum = |bands: &Vec<usize>| bands.iter().map(|&b| factors[b]).fold(0.0, f64::max);
            let sums = scene.sums.iter().map(|sum| of_sum(&sum.bands));
            factors.iter().copied().chain(sums).collect()
        };
        let columns: Vec<Vec<f64>> = factors.iter().map(with_sums).collect();
        let of_light = |light: usize| &factors[part_of[light]][..];
        Self {
            choice: self.choice.clone(),
            totals: self.totals.mixed(&columns),
            map: self.map.as_ref().map(|map| map.at_powers(of_light)),
            unseen: None,
            too_small: Vec::new(),
            accuracy: None,
            ..*self
        }
    }
}
