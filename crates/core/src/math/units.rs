//! Units: conversions and constants. Inside the program every length is in metres.

use std::borrow::Cow;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Unit of every length in a scene and its OBJ and captor files.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum LengthUnit {
    /// Metre.
    #[default]
    M,
    /// Centimetre.
    Cm,
    /// Millimetre.
    Mm,
}

impl LengthUnit {
    /// Name of the unit in scene files.
    pub fn name(self) -> &'static str {
        match self {
            Self::M => "m",
            Self::Cm => "cm",
            Self::Mm => "mm",
        }
    }

    /// Returns the number of metres in one unit.
    pub fn metres(self) -> f64 {
        match self {
            Self::M => 1.0,
            Self::Cm => 0.01,
            Self::Mm => 0.001,
        }
    }
}

/// Number of micromoles of photons in 1 J, per nm of wavelength: the energy of one photon is h c /
/// wavelength.
pub const UMOL_PER_J_NM: f64 = 0.008_359_347_2;

/// The quantity that photons carry. The physics does not depend on it, only the names of the units
/// do.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, JsonSchema)]
pub enum Quantity {
    /// Radiant flux, W.
    #[default]
    #[serde(rename = "W")]
    Watt,
    /// Photon flux, umol/s.
    #[serde(rename = "umol/s")]
    Micromole,
}

/// The names of the units of a result.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct UnitNames {
    /// Length and, squared, area.
    pub length: Cow<'static, str>,
    /// Flux.
    pub flux: Cow<'static, str>,
    /// Flux per area.
    pub irradiance: Cow<'static, str>,
    /// Flux per projected area and solid angle.
    pub radiance: Cow<'static, str>,
    /// Daily light integral, where the results have one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub dli: Option<Cow<'static, str>>,
}

impl Quantity {
    /// Returns the names of the units that belong to this quantity.
    pub fn unit_names(self) -> UnitNames {
        let [flux, irradiance, radiance] = match self {
            Self::Watt => ["W", "W/m2", "W/m2/sr"],
            Self::Micromole => ["umol/s", "umol/m2/s", "umol/m2/s/sr"],
        }
        .map(Cow::Borrowed);
        UnitNames { length: "m".into(), flux, irradiance, radiance, dli: None }
    }
}

/// Returns a label with its units as they are printed: umol/m2/s is µmol/m²/s.
pub fn printed(label: &str) -> String {
    label.replace("umol/", "µmol/").replace("/m2", "/m²")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_are_printed_with_their_letters() {
        assert_eq!(printed("PAR, umol/m2/s"), "PAR, µmol/m²/s");
        assert_eq!(printed("room2, W/m2/nm"), "room2, W/m²/nm");
    }
}
