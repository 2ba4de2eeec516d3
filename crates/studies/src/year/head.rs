//! What results of months hold besides the light on captors.

use super::{part::Part, places::Places};

/// What results hold besides the light on captors.
#[derive(Debug, Default)]
pub(super) struct Head {
    /// Name of the scene.
    pub scene: String,
    /// The least number of batches of a light.
    pub batches: u64,
    /// For each captor the photons that arrived on its front and on its back.
    pub arrived: Vec<[u64; 2]>,
    /// For each period the mean power of all lights, in bands and sums.
    pub powers: Vec<Vec<f64>>,
}

impl Head {
    /// Takes what the parts of a year have in common; `powers` are those of its periods.
    pub fn of(parts: &[Part], places: &Places, powers: Vec<Vec<f64>>) -> Self {
        let arrived = |captor: usize| {
            parts.iter().fold([0; 2], |sum, part| {
                let own = part.arrived[captor];
                [sum[0] + own[0], sum[1] + own[1]]
            })
        };
        Self {
            scene: parts[0].scene.name().into(),
            batches: parts.iter().filter_map(|part| part.batches).min().unwrap_or(1),
            arrived: (0..places.captors).map(arrived).collect(),
            powers,
        }
    }
}
