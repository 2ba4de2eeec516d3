//! Results with other powers of lights.

use std::path::Path;

use phylux_core::error::{Error, Result, setting};
use phylux_files::calibration_file::{self, Factors};
use phylux_results::result::{ByLight, Factor, FactorErrors, RunResult};

/// Factors on the powers of the lights of a result.
pub struct Mix {
    factors: ByLight<Factor>,
    calibration: Option<Calibrated>,
}

/// The factors of a calibration, and their errors, if they were measured.
struct Calibrated {
    factors: ByLight<Factor>,
    errors: Option<FactorErrors>,
}

impl Mix {
    /// Makes a mix of the factors by light, in which the name `row*` stands for all lights whose
    /// names begin so, and of those of a file that `phylux calibrate` has written, which they are
    /// multiplied by. Errors: a light stands there twice; a file that cannot be read or that has
    /// other bands.
    pub fn new(
        result: &RunResult,
        factors: Vec<(String, Factor)>,
        calibration: Option<&Path>,
    ) -> Result<Self> {
        let factors = by_light(factors, result)?;
        let calibration = calibration.map(|file| Calibrated::read(file, result)).transpose()?;
        Ok(Self { factors, calibration })
    }

    /// Returns what the run of the result would have found with the factors. Errors then include those
    /// of the calibration's factors. Errors: those of [`RunResult::mix_bands`].
    pub fn of(&self, result: &RunResult) -> Result<RunResult> {
        self.made_by(|factors| result.mix_bands(factors))
    }

    /// Does the same, and [gives up](RunResult::into_mixed) the result, which may be large.
    pub fn of_own(&self, result: RunResult) -> Result<RunResult> {
        self.made_by(|factors| result.into_mixed(factors))
    }

    fn made_by(
        &self,
        mix: impl FnOnce(&ByLight<Factor>) -> Result<RunResult>,
    ) -> Result<RunResult> {
        let Some(Calibrated { factors: own, errors }) = &self.calibration else {
            return mix(&self.factors);
        };
        // one mix knows more of the errors of ratios than two
        let mut all = own.clone();
        for (light, factor) in &self.factors {
            let product = all.get(light).map_or_else(|| factor.clone(), |own| own.times(factor));
            all.insert(light.clone(), product);
        }
        let mixed = mix(&all)?;
        let Some(errors) = errors else { return Ok(mixed) };
        let mut warnings = mixed.warnings_of_scene();
        if mixed.extras.sensitivity.is_some() {
            warnings.push(NO_SENSITIVITIES.into());
        }
        Ok(mixed.with_errors_of(errors).with_warnings_of_scene(warnings))
    }
}

/// What a mix says that has the errors of a calibration.
const NO_SENSITIVITIES: &str = "the mix does not say on which inputs it depends, nor how uncertain \
     they make it, as the powers of a calibration have errors of their own \
     (docs/sensitivity.md#limits)";

impl Calibrated {
    fn read(file: &Path, result: &RunResult) -> Result<Self> {
        let calibration = calibration_file::read(file)?;
        let names = result.own_bands().iter().map(|band| &band.name);
        if !names.eq(&calibration.bands) {
            return Err(Error::input(file.display(), "its bands are not those of the results")
                .remedy("calibrate with this scene"));
        }
        let Factors { factors, lamps, measured_bands, covariance, .. } = calibration;
        let errors = match measured_bands.is_empty() {
            true => None,
            false => Some(
                FactorErrors::new(result, &factors, &lamps, &measured_bands, covariance)
                    .map_err(|problem| problem.at(file.display()))?,
            ),
        };
        let factors = factors.into_iter().map(|(light, factors)| (light, Factor::Bands(factors)));
        Ok(Self { factors: factors.collect(), errors })
    }
}

/// Returns the factor of each light that is named. A name that ends with `*`, and that is not
/// itself the name of a light, stands for all names that begin so.
fn by_light(entries: Vec<(String, Factor)>, result: &RunResult) -> Result<ByLight<Factor>> {
    let empty = ByLight::new();
    let lights = result.energy.by_light.as_ref().unwrap_or(&empty);
    let mut factors = ByLight::new();
    for (name, factor) in entries {
        let all = match name.strip_suffix('*') {
            Some(start) if !lights.contains_key(&name) => {
                lights.keys().filter(|light| light.starts_with(start)).cloned().collect()
            }
            _ => vec![name.clone()],
        };
        // a name that stands for no light is kept, so that an error lists the lights that exist
        for light in if all.is_empty() { vec![name] } else { all } {
            if factors.contains_key(&light) {
                let problem = format!("light `{light}` stands there twice");
                return Err(Error::input(setting("power"), problem).remedy("give one factor"));
            }
            factors.insert(light, factor.clone());
        }
    }
    Ok(factors)
}
