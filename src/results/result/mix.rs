//! A result at other powers of its lights: light is linear in them.

use std::collections::HashMap;

use super::{
    Absorbed, AllAbsorbed, ByLight, CaptorResult, Energy, FaceResult, GroupResult, Range, RunResult,
};
use crate::error::{Error, LISTED, Result, nearest, number, some};

impl RunResult {
    /// What the run would have found, had each light had its power times its factor (at least 0; 1 for
    /// a light that is not named). Lights are strata of independent histories, so variances add up. The
    /// k-nearest estimates are not split and go. Errors: results that are not split by light, a light that
    /// is not in them, a factor that none can be.
    pub fn mix(&self, factors: &ByLight<f64>) -> Result<Self> {
        let Some(lights) = &self.energy.by_light else {
            return Err(Error::input(&self.scene, "these results are not split by light")
                .remedy("run the scene again with --by-light"));
        };
        for (name, factor) in factors {
            if !lights.contains_key(name) {
                let error = Error::input(&self.scene, format!("no light `{name}`"));
                return Err(match nearest(name, lights.keys().map(String::as_str)) {
                    Some(near) => error.remedy(format!("did you mean `{near}`?")),
                    None => error.remedy(format!("there are {}", some(lights.keys(), LISTED))),
                });
            }
            if !(0.0..=MAX_FACTOR).contains(factor) {
                let problem = format!("factor {} of light `{name}`", number(*factor));
                return Err(Error::input(&self.scene, problem)
                    .remedy(format!("it must be from 0 to {MAX_FACTOR:e}")));
            }
        }
        let mix = Mix(factors);
        let captors: Vec<CaptorResult> = self.captors.iter().map(|c| mix.captor(c)).collect();
        let mut ranges: HashMap<&str, [Range; 2]> = HashMap::new();
        for captor in &captors {
            for group in captor.groups.iter().flatten() {
                let [front, back] = ranges.entry(group).or_default();
                front.add(&captor.front);
                captor.back.iter().for_each(|face| back.add(face));
            }
        }
        let group = |group: &GroupResult| {
            let range = ranges.get(group.id.as_str()).cloned().unwrap_or_default();
            mix.group(group, range)
        };
        let groups = self.groups.iter().map(group).collect();
        let mut mixed = self.mixed.clone().unwrap_or_default();
        for (name, factor) in factors {
            *mixed.entry(name.clone()).or_insert(1.0) *= factor;
        }
        let mut result = Self {
            mixed: Some(mixed),
            energy: mix.energy(&self.energy, lights),
            tolerance: None,
            map: None,
            captors,
            groups,
            ..self.clone()
        };
        result.add_dli();
        Ok(result.with_warnings())
    }
}

/// The largest factor: no power becomes infinite by it.
const MAX_FACTOR: f64 = 1e30;

/// Factors on the powers of lights.
struct Mix<'a>(&'a ByLight<f64>);

impl Mix<'_> {
    fn factor(&self, light: &str) -> f64 {
        self.0.get(light).copied().unwrap_or(1.0)
    }

    /// Each light's part, times its factor.
    fn scaled<T>(&self, parts: &ByLight<T>, scale: impl Fn(&T, f64) -> T) -> ByLight<T> {
        let scaled = |(name, part): (&String, &T)| (name.clone(), scale(part, self.factor(name)));
        parts.iter().map(scaled).collect()
    }

    fn energy(&self, energy: &Energy, lights: &ByLight<Energy>) -> Energy {
        let parts = self.scaled(lights, |part, factor| Energy {
            power: times(&part.power, factor),
            emitted: times(&part.emitted, factor),
            absorbed: times(&part.absorbed, factor),
            escaped: times(&part.escaped, factor),
            missed: times(&part.missed, factor),
            lost: times(&part.lost, factor),
            absorbed_by: part.absorbed_by.as_ref().map(|materials| {
                materials
                    .iter()
                    .map(|(name, values)| (name.clone(), times(values, factor)))
                    .collect()
            }),
            by_light: None,
        });
        let all = |of: fn(&Energy) -> &[f64]| sum(parts.values().map(of), of(energy).len());
        let by = |(name, values): (&String, &Vec<f64>)| {
            let materials = parts.values().filter_map(|part| part.absorbed_by.as_ref());
            let of = materials.filter_map(|materials| materials.get(name));
            (name.clone(), sum(of.map(Vec::as_slice), values.len()))
        };
        Energy {
            power: all(|part| &part.power),
            emitted: all(|part| &part.emitted),
            absorbed: all(|part| &part.absorbed),
            escaped: all(|part| &part.escaped),
            missed: all(|part| &part.missed),
            lost: all(|part| &part.lost),
            absorbed_by: energy.absorbed_by.as_ref().map(|all| all.iter().map(by).collect()),
            by_light: Some(parts),
        }
    }

    fn captor(&self, captor: &CaptorResult) -> CaptorResult {
        let AllAbsorbed { absorbed, absorbed_se, by_light } =
            self.absorbed(captor.by_light.as_ref());
        CaptorResult {
            front: self.face(&captor.front),
            back: captor.back.as_ref().map(|face| self.face(face)),
            absorbed,
            absorbed_se,
            by_light,
            ..captor.clone()
        }
    }

    fn group(&self, group: &GroupResult, [front, back]: [Range; 2]) -> GroupResult {
        let AllAbsorbed { absorbed, absorbed_se, by_light } =
            self.absorbed(group.by_light.as_ref());
        let face = |face: &FaceResult, range: Range| {
            let several = face.min.is_some();
            let (min, max) = (range.min.filter(|_| several), range.max.filter(|_| several));
            FaceResult { min, max, ..self.face(face) }
        };
        GroupResult {
            front: face(&group.front, front),
            back: group.back.as_ref().map(|of| face(of, back)),
            absorbed,
            absorbed_se,
            by_light,
            ..group.clone()
        }
    }

    fn face(&self, face: &FaceResult) -> FaceResult {
        let parts =
            self.scaled(face.by_light.as_ref().unwrap_or(&ByLight::new()), |part, factor| {
                FaceResult {
                    // those of a dark light bring nothing
                    photons: if factor > 0.0 { part.photons } else { 0 },
                    histories: part.histories.map(|n| if factor > 0.0 { n } else { 0 }),
                    flux: times(&part.flux, factor),
                    flux_se: error_times(&part.flux_se, factor),
                    irradiance: times(&part.irradiance, factor),
                    irradiance_se: error_times(&part.irradiance_se, factor),
                    ..part.clone()
                }
            });
        let bands = face.flux.len();
        let values = || parts.values();
        FaceResult {
            photons: values().fold(0, |sum, part| sum.saturating_add(part.photons)),
            // no two lights share a history
            histories: values()
                .try_fold(0u64, |sum, part| Some(sum.saturating_add(part.histories?))),
            flux: sum(values().map(|part| &part.flux[..]), bands),
            flux_se: error(values().map(|part| (&part.flux[..], &part.flux_se[..])), bands),
            irradiance: sum(values().map(|part| &part.irradiance[..]), bands),
            irradiance_se: error(
                values().map(|part| (&part.irradiance[..], &part.irradiance_se[..])),
                bands,
            ),
            dli: None,
            dli_se: None,
            few_paths: face.few_paths,
            min: None,
            max: None,
            knn: face.knn.as_ref().map(|_| None),
            by_light: Some(parts),
        }
    }

    fn absorbed(&self, parts: Option<&ByLight<Absorbed>>) -> AllAbsorbed {
        let Some(parts) = parts else { return AllAbsorbed::default() };
        let parts = self.scaled(parts, |part, factor| Absorbed {
            absorbed: times(&part.absorbed, factor),
            absorbed_se: error_times(&part.absorbed_se, factor),
        });
        let bands = parts.values().map(|part| part.absorbed.len()).max().unwrap_or(0);
        let absorbed = sum(parts.values().map(|part| &part.absorbed[..]), bands);
        let errors = parts.values().map(|part| (&part.absorbed[..], &part.absorbed_se[..]));
        AllAbsorbed {
            absorbed: Some(absorbed),
            absorbed_se: Some(error(errors, bands)),
            by_light: Some(parts),
        }
    }
}

fn times(values: &[f64], factor: f64) -> Vec<f64> {
    values.iter().map(|value| value * factor).collect()
}

/// Scales standard errors; a factor of zero leaves no known error.
fn error_times(errors: &[Option<f64>], factor: f64) -> Vec<Option<f64>> {
    errors.iter().map(|error| error.filter(|_| factor > 0.0).map(|e| e * factor)).collect()
}

fn sum<'a>(parts: impl Iterator<Item = &'a [f64]>, bands: usize) -> Vec<f64> {
    let mut sums = vec![0.0; bands];
    for part in parts {
        sums.iter_mut().zip(part).for_each(|(sum, value)| *sum += value);
    }
    sums
}

/// The error of a sum of independent values; none where one of them that is not zero has none.
fn error<'a>(
    parts: impl Iterator<Item = (&'a [f64], &'a [Option<f64>])>,
    bands: usize,
) -> Vec<Option<f64>> {
    let mut variances = vec![None; bands];
    let mut known = vec![true; bands];
    for (values, errors) in parts {
        for b in 0..bands.min(values.len()).min(errors.len()) {
            match errors[b] {
                Some(error) => *variances[b].get_or_insert(0.0) += error * error,
                None => known[b] &= values[b] == 0.0,
            }
        }
    }
    let error = |(variance, known): (Option<f64>, bool)| variance.filter(|_| known).map(f64::sqrt);
    variances.into_iter().zip(known).map(error).collect()
}
