//! The result of a run as flat arrays, captor x channel x band, for programs that compute with it.

use phylux_core::{
    math::stats::Estimate,
    scene::captor::{CHANNELS, Channel},
    transport::simulate::Simulation,
};

/// Fluxes of all captors with their standard errors, W or umol/s, in arrays of captor x channel x
/// column. The channels are flux on the front, flux on the back and absorbed power ([`CHANNELS`]);
/// the columns are the bands, then the sums over bands.
#[derive(Clone, Debug)]
pub struct FlatResult {
    /// Number of captors, in the order of the scene.
    pub captors: usize,
    /// Number of bands and sums.
    pub columns: usize,
    /// Flux or absorbed power; NaN where the captor has no such channel.
    pub flux: Vec<f64>,
    /// Standard error (1 sigma); NaN where it is not known, because nothing arrived or there was
    /// one batch only.
    pub flux_se: Vec<f64>,
    /// Photons or paths that were counted, captor x channel; 0 where the captor has no such channel.
    pub photons: Vec<u64>,
}

impl FlatResult {
    /// Makes the arrays of a run.
    pub fn new(simulation: &Simulation) -> Self {
        let (scene, totals) = (simulation.scene(), simulation.totals());
        let (captors, columns) = (scene.captors().len(), scene.bands().len() + scene.sums().len());
        let cells = captors * CHANNELS.len();
        let mut flat = Self {
            captors,
            columns,
            flux: vec![f64::NAN; cells * columns],
            flux_se: vec![f64::NAN; cells * columns],
            photons: vec![0; cells],
        };
        for (c, captor) in scene.captors().iter().enumerate() {
            for channel in 0..captor.kind.channels() {
                let cell = c * CHANNELS.len() + channel;
                let of_scene = captor.first_channel + channel;
                flat.photons[cell] = totals.photons(of_scene);
                for (column, estimate) in totals.estimates(of_scene).enumerate() {
                    let Estimate { mean, standard_error } = estimate;
                    let i = cell * columns + column;
                    flat.flux[i] = mean;
                    let known = standard_error.filter(|_| mean != 0.0);
                    flat.flux_se[i] = known.unwrap_or(f64::NAN);
                }
            }
        }
        flat
    }

    /// Returns flux and standard error of a captor's channel in a column; NaN where there is none.
    /// Panics where `captor` or `column` is out of range.
    pub fn get(&self, captor: usize, channel: Channel, column: usize) -> (f64, f64) {
        assert!(captor < self.captors && column < self.columns, "no such captor or column");
        let i = (captor * CHANNELS.len() + channel as usize) * self.columns + column;
        (self.flux[i], self.flux_se[i])
    }
}
