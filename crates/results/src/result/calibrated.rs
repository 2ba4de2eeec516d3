//! Errors of results whose lamps have powers of a calibration: its factors are known with errors
//! that vary together, on top of those of the simulation.

use super::{
    AbsorbedByFace, BandResult, ByLight, FaceResult, RatioResult, Ratios, RunResult, Whole,
};
use phylux_core::{
    error::Problem,
    math::{pattern, stats::is_possible},
};

/// The factors on the powers of lamps that a calibration has found, and how they vary together.
#[derive(Clone, Debug)]
pub struct FactorErrors {
    /// For each light of the results: its lamp, and its factor in each band.
    lights: ByLight<(usize, Vec<f64>)>,
    /// For each band, the index of the measured band or sum whose factor it has.
    measured: Vec<Option<usize>>,
    /// Number of measured bands and sums.
    bands: usize,
    /// Covariances of the factors: lamp by lamp, and for each lamp by measured band.
    covariance: Vec<Vec<f64>>,
}

impl FactorErrors {
    /// Takes what a calibration says: `lamps` are names of lights or patterns of them, and the
    /// covariances go lamp by lamp, and for each lamp by measured band. `result` is the run that was
    /// calibrated. Errors: there is not one covariance for each pair; a light belongs to no lamp; no
    /// band has a name that was measured.
    pub fn new(
        result: &RunResult,
        factors: &ByLight<Vec<f64>>,
        lamps: &[String],
        measured: &[String],
        covariance: Vec<Vec<f64>>,
    ) -> Result<Self, Problem> {
        const FIND: &str = "calibrate with this scene";
        let size = lamps.len() * measured.len();
        let square = covariance.len() == size && covariance.iter().all(|row| row.len() == size);
        if !square || covariance.iter().flatten().any(|c| !is_possible(c.abs().sqrt())) {
            let problem = format!(
                "its `covariance` is no table of {size} x {size} numbers, for {} lamps in {} bands",
                lamps.len(),
                measured.len()
            );
            return Err(Problem::new(problem, "calibrate anew"));
        }
        for name in measured {
            if result.bands.iter().all(|band| band.name != *name) {
                return Err(Problem::new(format!("the results have no band `{name}`"), FIND));
            }
        }
        let mut lights = ByLight::new();
        for (light, factors) in factors {
            let Some(lamp) = lamps.iter().position(|lamp| pattern::fits(lamp, light)) else {
                return Err(Problem::new(format!("light `{light}` is none of its `lamps`"), FIND));
            };
            lights.insert(light.clone(), (lamp, factors.clone()));
        }
        let of_band = |band: &BandResult| {
            measured.iter().position(|name| {
                let sum = result.bands.iter().find(|other| other.name == *name);
                let members = sum.and_then(|sum| sum.sum_of.as_ref());
                *name == band.name || members.is_some_and(|all| all.contains(&band.name))
            })
        };
        let of_bands = result.own_bands().iter().map(of_band).collect();
        Ok(Self { lights, measured: of_bands, bands: measured.len(), covariance })
    }

    /// Returns the derivatives of a weighted sum of values by the factors: `of_lights` are the
    /// values of lights in all bands, with their factors. `None` where a factor has no known error.
    fn gradient<'a>(
        &self,
        of_lights: impl Iterator<Item = (&'a str, &'a [f64])>,
        weights: &[(usize, f64)],
    ) -> Option<Vec<f64>> {
        let mut gradient = vec![0.0; self.covariance.len()];
        for (light, values) in of_lights {
            for &(band, weight) in weights {
                let value = weight * values.get(band)?;
                if value == 0.0 {
                    continue;
                }
                let (lamp, factors) = self.lights.get(light)?;
                let measured = (*self.measured.get(band)?)?;
                gradient[lamp * self.bands + measured] += value / factors.get(band)?;
            }
        }
        gradient.iter().all(|x| x.is_finite()).then_some(gradient)
    }

    fn covariance(&self, a: &[f64], b: &[f64]) -> f64 {
        let row = |(x, row): (&f64, &Vec<f64>)| {
            if *x == 0.0 { 0.0 } else { x * row.iter().zip(b).map(|(c, y)| c * y).sum::<f64>() }
        };
        a.iter().zip(&self.covariance).map(row).sum()
    }

    /// Adds to the standard errors of values, per band and sum, what the factors bring.
    fn add<'a>(
        &self,
        errors: &mut [Option<f64>],
        weights: &[Vec<(usize, f64)>],
        of_lights: impl Iterator<Item = (&'a str, &'a [f64])> + Clone,
    ) {
        for (error, weights) in errors.iter_mut().zip(weights) {
            let gradient = self.gradient(of_lights.clone(), weights);
            let variance = gradient.map(|gradient| self.covariance(&gradient, &gradient).max(0.0));
            *error = error.zip(variance).map(|(error, variance)| error.hypot(variance.sqrt()));
        }
    }

    /// Adds to the errors of ratios what the factors bring.
    fn add_to_ratios<'a>(
        &self,
        found: &mut Option<Box<Ratios>>,
        ratios: &[RatioResult],
        of_lights: impl Iterator<Item = (&'a str, &'a [f64])> + Clone,
    ) {
        let Some(found) = found else { return };
        for (r, ratio) in ratios.iter().enumerate() {
            let sums = [&ratio.numerator, &ratio.denominator].map(|weights| {
                let weights = weights.iter().copied().enumerate().filter(|(_, w)| *w > 0.0);
                self.gradient(of_lights.clone(), &weights.collect::<Vec<_>>())
            });
            let more = match &sums {
                [Some(a), Some(b)] => {
                    Some([self.covariance(a, a), self.covariance(a, b), self.covariance(b, b)])
                }
                _ => None,
            };
            let mut totals = [0.0; 2];
            for (_, values) in of_lights.clone() {
                let own = ratio.sums(values);
                totals = [totals[0] + own[0], totals[1] + own[1]];
            }
            found.add_covariance(r, totals, more);
        }
    }

    fn add_to_face(
        &self,
        face: &mut FaceResult,
        weights: &[Vec<(usize, f64)>],
        ratios: &[RatioResult],
    ) {
        let Some(parts) = &face.by_light else { return };
        self.add(&mut face.flux_se, weights, parts.iter().map(|(l, part)| (l, &part.flux[..])));
        let irradiance = parts.iter().map(|(l, part)| (l, &part.irradiance[..]));
        self.add(&mut face.irradiance_se, weights, irradiance);
        let flux = parts.iter().map(|(l, part)| (l, &part.flux[..]));
        self.add_to_ratios(&mut face.ratios, ratios, flux);
    }

    fn add_to_whole(
        &self,
        whole: &mut Whole,
        weights: &[Vec<(usize, f64)>],
        ratios: &[RatioResult],
    ) {
        let Some(parts) = &whole.by_light else { return };
        let values = parts.iter().map(|(light, part)| (light, &part.absorbed[..]));
        let errors = whole.absorbed_se.iter_mut();
        errors.for_each(|errors| self.add(errors, weights, values.clone()));
        self.add_to_ratios(&mut whole.absorbed_ratios, ratios, values);
        let Some(faces) = &mut whole.absorbed_by_face else { return };
        let of = |part: fn(&AbsorbedByFace) -> &[f64]| {
            parts.iter().filter_map(move |(l, own)| Some((l, part(own.absorbed_by_face.as_ref()?))))
        };
        self.add(&mut faces.front_se, weights, of(|faces| &faces.front));
        self.add(&mut faces.back_se, weights, of(|faces| &faces.back));
    }
}

impl RunResult {
    /// Returns results whose lights were multiplied by the factors of a calibration, and perhaps by
    /// others, with standard errors that include those of the calibration's factors. How even groups
    /// are, and the parts of single lights, keep the errors of the simulation. On what results depend is
    /// left out.
    pub fn with_errors_of(mut self, factors: &FactorErrors) -> Self {
        let weights = |(b, band): (usize, &BandResult)| match band.sum_of {
            None => vec![(b, 1.0)],
            Some(_) => band.members(&self.bands).collect(),
        };
        let weights: Vec<Vec<(usize, f64)>> = self.bands.iter().enumerate().map(weights).collect();
        let ratios = self.ratios.clone();
        for (faces, whole) in self.parts_mut() {
            faces.into_iter().flatten().for_each(|f| factors.add_to_face(f, &weights, &ratios));
            factors.add_to_whole(whole, &weights, &ratios);
        }
        self.calibrated = true;
        self.forget_dependence();
        self.add_dli();
        self
    }
}
