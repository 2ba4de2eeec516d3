//! What results of months hold besides the light on captors.

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
