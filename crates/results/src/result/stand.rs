//! What a stand of plants as a whole does with the light: its layers, and the shares of the light of
//! sun and sky that it and the ground take.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Own, own};
use crate::lists::{are_errors, are_values};
use phylux_core::{
    math::stats::{Estimate, is_possible},
    scene::stand::{Balance, LayerBins},
    transport::{settings::Estimator, simulate::Simulation},
};

/// Light that the surface captors of a layer absorbed, without those of the ground.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct LayerResult {
    /// Lower end of the layer, m.
    pub from: f64,
    /// Upper end of the layer, m.
    pub to: f64,
    /// One-sided area of the captors in it, m2.
    pub area: f64,
    /// Power that they absorbed, per band, W or umol/s.
    pub absorbed: Vec<f64>,
    /// Standard error of the value above; null where nothing arrived or there was one batch.
    pub absorbed_se: Vec<Option<f64>>,
    /// Quantities that are known by their names alone.
    #[serde(flatten)]
    pub own: Own,
}

/// Where the light of sun and sky goes in a scene that repeats along x and y, as shares of what
/// comes in from above, per band.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct CanopyResult {
    /// Power that comes into one cell, W or umol/s.
    pub incident: Vec<f64>,
    /// Share that all but the ground absorbs (of PAR: fAPAR).
    pub absorbed: Vec<f64>,
    /// Standard error of the value above.
    pub absorbed_se: Vec<Option<f64>>,
    /// Share that leaves upwards.
    pub reflected: Vec<f64>,
    /// Standard error of the value above.
    pub reflected_se: Vec<Option<f64>>,
    /// Share that arrives on the ground from above (light that the ground sends up and leaves send
    /// back counts again) or, where no object is ground, that leaves downwards.
    pub transmitted: Vec<f64>,
    /// Standard error of the value above.
    pub transmitted_se: Vec<Option<f64>>,
    /// Share that the ground absorbs.
    pub ground: Vec<f64>,
    /// Standard error of the value above.
    pub ground_se: Vec<Option<f64>>,
}

/// Returns what each layer absorbed, from the lowest up; `None` where no layers were asked for.
pub(super) fn layers(simulation: &Simulation) -> Option<Vec<LayerResult>> {
    let scene = simulation.scene();
    let LayerBins { dz, first, areas, .. } = scene.stand().layers.as_ref()?;
    let own = own::of_layers(simulation);
    let layer = |(bin, &area): (usize, &f64)| {
        let (absorbed, absorbed_se) = of_stand(simulation, bin, None);
        let at = (first + bin as i64) as f64;
        let (from, to) = (at * dz, (at + 1.0) * dz);
        LayerResult { from, to, area, absorbed, absorbed_se, own: own(bin) }
    };
    Some(areas.iter().enumerate().map(layer).collect())
}

/// Returns where the light went, if photons have kept account of it.
pub(super) fn canopy(simulation: &Simulation) -> Option<CanopyResult> {
    let scene = simulation.scene();
    if !scene.stand().balances || simulation.estimator() == Estimator::Paths {
        return None;
    }
    let bands = 0..scene.bands().len();
    let power = |b: usize| scene.lights().iter().map(|light| light.power[b]).sum();
    let incident = scene.with_sums(&bands.map(power).collect::<Vec<f64>>());
    let share =
        |balance: Balance| of_stand(simulation, scene.stand().channel(balance), Some(&incident));
    let (absorbed, absorbed_se) = share(Balance::ByStand);
    let (reflected, reflected_se) = share(Balance::Up);
    let has_ground = scene.stand().is_ground.contains(&true);
    let below = if has_ground { Balance::OnGround } else { Balance::Down };
    let (transmitted, transmitted_se) = share(below);
    let (ground, ground_se) = share(Balance::ByGround);
    Some(CanopyResult {
        incident,
        absorbed,
        absorbed_se,
        reflected,
        reflected_se,
        transmitted,
        transmitted_se,
        ground,
        ground_se,
    })
}

/// Returns one of the sums of the stand, over the powers `of`, and its standard error.
fn of_stand(
    simulation: &Simulation,
    channel: usize,
    of: Option<&[f64]>,
) -> (Vec<f64>, Vec<Option<f64>>) {
    let column = |(b, found): (usize, Estimate)| {
        let whole = of.map_or(1.0, |of| of[b]);
        let share = |value: f64| if whole > 0.0 { value / whole } else { 0.0 };
        let error = found.standard_error.filter(|_| found.mean != 0.0);
        (share(found.mean), error.map(share))
    };
    simulation.totals().of_stand(simulation.scene(), channel).enumerate().map(column).unzip()
}

impl LayerResult {
    pub(super) fn is_valid(&self, bands: usize) -> bool {
        [self.from.abs(), self.to.abs(), self.area].into_iter().all(is_possible)
            && self.row().is_valid(bands, 0)
    }
}

/// A share of the light by its name, per band, with standard errors.
type NamedShare<'a> = (&'static str, &'a [f64], &'a [Option<f64>]);

impl CanopyResult {
    /// Returns the shares by name, with their standard errors.
    pub fn shares(&self) -> [NamedShare<'_>; 4] {
        [
            ("absorbed", &self.absorbed, &self.absorbed_se),
            ("reflected", &self.reflected, &self.reflected_se),
            ("transmitted", &self.transmitted, &self.transmitted_se),
            ("ground", &self.ground, &self.ground_se),
        ]
    }

    pub(super) fn is_valid(&self, bands: usize) -> bool {
        are_values(&self.incident, bands)
            && self
                .shares()
                .iter()
                .all(|(_, values, errors)| are_values(values, bands) && are_errors(errors, bands))
    }
}
