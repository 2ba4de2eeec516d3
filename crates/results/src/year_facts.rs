//! What the tables of a year do not say themselves.

use serde::{Deserialize, Serialize};

use super::result::{BandResult, SumUnit};
use phylux_core::math::units::{Quantity, UnitNames};

/// How the light of a year was found, and the units of its tables.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct YearFacts {
    /// Version of phylux that wrote the tables.
    pub phylux: String,
    /// Name of the scene.
    pub scene: String,
    /// Seed of the random numbers.
    pub seed: u64,
    /// Number of photons, for all hours together.
    pub photons: u64,
    /// Number of points of each captor from which the sun of an hour was looked for.
    pub sun_rays: u64,
    /// When the period begins, as `2005-06-21T13:00+01:00`.
    pub from: String,
    /// Number of hours.
    pub hours: usize,
    /// Names of the units; that of daily light integrals is the unit of sums.
    pub unit: UnitNames,
    /// The bands, then the sums over bands.
    pub bands: Vec<BandResult>,
    /// What a user should know before trusting the tables.
    pub warnings: Vec<String>,
}

/// Returns the unit of daily light integrals where photons carry this quantity.
pub fn daily_unit(quantity: Quantity) -> &'static str {
    match quantity {
        Quantity::Watt => "MJ/m2/d",
        Quantity::Micromole => "mol/m2/d",
    }
}

impl YearFacts {
    /// Returns the unit of the irradiance in a band or sum.
    pub fn irradiance(&self, band: &str) -> &str {
        let own = self.bands.iter().find(|known| known.name == band).and_then(|b| b.unit.as_ref());
        own.map_or(&self.unit.irradiance, |SumUnit { irradiance, .. }| irradiance)
    }
}
