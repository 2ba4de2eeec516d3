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

/// Writes a value and its standard error, which is above 0, with the digits that the error leaves: one
/// of the error, or two if the first is 1. Very small and very large ones have two digits and a power of
/// ten.
pub fn rounded(value: f64, error: f64) -> [String; 2] {
    let power = error.log10().floor();
    let first = (error / 10f64.powf(power)).floor();
    let decimals = -power + if first < 2.0 { 1.0 } else { 0.0 };
    match (-6.0..7.0).contains(&decimals) {
        true => [value, error].map(|number| format!("{number:.*}", decimals.max(0.0) as usize)),
        false => [value, error].map(|number| format!("{number:.1e}")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_have_one_digit_or_two() {
        assert_eq!(rounded(429.08, 7.19), ["429", "7"]);
        assert_eq!(rounded(0.71234, 0.0123), ["0.712", "0.012"]);
        assert_eq!(rounded(1234.0, 150.0), ["1234", "150"]);
        assert_eq!(rounded(3e-12, 2e-13), ["3.0e-12", "2.0e-13"]);
    }

    #[test]
    fn units_are_printed_with_their_letters() {
        assert_eq!(printed("PAR, umol/m2/s"), "PAR, µmol/m²/s");
        assert_eq!(printed("room2, W/m2/nm"), "room2, W/m²/nm");
    }
}
