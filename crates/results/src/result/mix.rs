//! Results at other powers of the lights: light is linear in these powers.

mod sensitivity;

use std::{borrow::Cow, collections::HashMap, iter::once, ops::DerefMut};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{
    Absorbed, AbsorbedByFace, Account, BandResult, ByLight, CaptorResult, Energy, Extras,
    FaceResult, GroupResult, OfLights, PerBand, Provenance, RatioResult, Ratios, RunResult, Whole,
    ratios::OfLight,
    spread::Spread,
    warnings::{FEW_HISTORIES, rests_on_few},
};
use phylux_core::{
    error::{Error, LISTED, Result, nearest, number, setting, some},
    words,
};

impl RunResult {
    /// Returns the result that the run would have had if the power of each light had been
    /// multiplied by its factor (at least 0; 1 for a light that is not named). Lights are strata of
    /// independent histories, so their variances add up. The k-nearest estimates are not split by
    /// light, and are dropped. Errors: the results are not split by light; they do not contain a
    /// light; a factor is not possible.
    pub fn mix(&self, factors: &ByLight<f64>) -> Result<Self> {
        let factors = factors.iter().map(|(name, factor)| (name.clone(), Factor::All(*factor)));
        self.mix_bands(&factors.collect())
    }

    /// Like [`mix`](Self::mix), with factors that may differ between bands. The errors of such bands
    /// are not independent, and how they vary together is kept only for ratios of the run: the
    /// standard errors of sums over them are upper bounds, and so are those of ratios unless
    /// numerator and denominator are combinations of what they were.
    pub fn mix_bands(&self, factors: &ByLight<Factor>) -> Result<Self> {
        let captors = self.captors.iter().map(Cow::Borrowed);
        self.mixed_of(factors, captors, self.warnings_of_scene())
    }

    /// Does the same, and gives up each captor for that of the mix, so that the light on captors by
    /// light is in memory once.
    pub fn into_mixed(mut self, factors: &ByLight<Factor>) -> Result<Self> {
        // sensitivities are mixed by the light on captors
        if self.extras.sensitivity.is_some() {
            return self.mix_bands(factors);
        }
        let warnings = self.warnings_of_scene();
        let captors = std::mem::take(&mut self.captors).into_iter().map(Cow::Owned);
        self.mixed_of(factors, captors, warnings)
    }

    /// Mixes these captors, and all else of the results, which warn so of their scene.
    fn mixed_of<'c>(
        &self,
        factors: &ByLight<Factor>,
        captors: impl Iterator<Item = Cow<'c, CaptorResult>>,
        mut warnings: Vec<String>,
    ) -> Result<Self> {
        let lights = self.lights_to_mix()?;
        self.check_factors(factors, lights)?;
        let mix = Mix::new(&self.bands, &self.ratios, factors);
        let captors: Vec<CaptorResult> = captors.map(|captor| mix.captor(&captor)).collect();
        let groups = mix.groups(&self.groups, &captors);
        // the light on captors is not copied, as it may be most of what memory holds
        let mut result = Self {
            provenance: Provenance {
                mixed: Some(self.mixed_by(factors)),
                ..self.provenance.clone()
            },
            unit: self.unit.clone(),
            period_h: self.period_h,
            bands: self.bands.clone(),
            ratios: self.ratios.clone(),
            energy: mix.energy(&self.energy, lights),
            account: Account {
                unseen: self.account.unseen.clone(),
                unseen_se: self.account.unseen_se.clone(),
                cut_off: self.account.cut_off,
                // what a lamp needs at another power is not known, and no run was made to a tolerance
                ..Account::default()
            },
            captors,
            groups,
            // layers and what a canopy does are not kept by light; the rest is mixed below
            extras: Extras::default(),
        };
        mix.add_dependence(self, &mut result);
        result.add_dli();
        let rows = || self.extras.sensitivity.iter().flatten();
        if rows().next().is_some() && rows().all(|row| row.by_light.is_none()) {
            warnings.push(NO_SENSITIVITIES.into());
            (result.extras.sensitivity, result.extras.budget) = (None, None);
        }
        Ok(result.with_warnings_of_scene(warnings))
    }

    /// Returns the energy of each light. Error: the results are not split by light.
    pub fn energy_by_light(&self) -> Result<&ByLight<Energy>> {
        self.energy.by_light.as_ref().ok_or_else(|| {
            Error::input(&self.scene, "these results are not split by light")
                .remedy(words!["run the scene again with ", setting("by_light").on()])
        })
    }

    /// Returns the energy of each light. Error: these results are not to be mixed.
    fn lights_to_mix(&self) -> Result<&ByLight<Energy>> {
        let lights = self.energy_by_light()?;
        if self.calibrated {
            let problem = "these results were mixed with a calibration, and their errors are its";
            return Err(Error::input(&self.scene, problem).remedy(words![
                "mix those of the run, with ",
                setting("calibration"),
                " and ",
                setting("power"),
                " together"
            ]));
        }
        Ok(lights)
    }

    /// Checks that each factor is of one of the lights, in range, and as many as there are bands.
    fn check_factors(&self, factors: &ByLight<Factor>, lights: &ByLight<Energy>) -> Result<()> {
        let bands = self.own_bands().len();
        for (name, factor) in factors {
            let error = |problem: String| Error::input(&self.scene, problem);
            if !lights.contains_key(name) {
                let near = nearest(name, lights.keys().map(String::as_str));
                let otherwise = format!("there are {}", some(lights.keys(), LISTED));
                return Err(error(format!("no light `{name}`")).did_you_mean(near, otherwise));
            }
            let values = factor.values();
            if let Some(wrong) = values.iter().find(|f| !(0.0..=MAX_FACTOR).contains(*f)) {
                return Err(error(format!("factor {} of light `{name}`", number(*wrong)))
                    .remedy(format!("it must be from 0 to {MAX_FACTOR:e}")));
            }
            if matches!(factor, Factor::Bands(_)) && values.len() != bands {
                let count = values.len();
                return Err(error(format!("{count} factors of light `{name}` for {bands} bands"))
                    .remedy("give one for each band"));
            }
        }
        Ok(())
    }

    /// Returns the factors on the powers of the run, of which these results may already have some.
    fn mixed_by(&self, factors: &ByLight<Factor>) -> ByLight<Factor> {
        let mut mixed = self.mixed.clone().unwrap_or_default();
        for (name, factor) in factors {
            let before = mixed.entry(name.clone()).or_insert(Factor::All(1.0));
            *before = before.times(factor);
        }
        mixed
    }
}

/// What a mix says of results that have what they depend on for all lights together.
const NO_SENSITIVITIES: &str = "the mix does not say on which inputs it depends, nor how uncertain \
     they make it, as its results do not hold that by light: run the scene again \
     (docs/sensitivity.md#limits)";

/// The largest factor. No power becomes infinite by it.
const MAX_FACTOR: f64 = 1e30;

/// A factor on the power of a light.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged, expecting = "must be a number, or a list with one for each band")]
pub enum Factor {
    /// The same factor in all bands.
    All(f64),
    /// A factor for each band.
    Bands(Vec<f64>),
}

impl Factor {
    /// Returns the one factor, or those of the bands.
    pub fn values(&self) -> &[f64] {
        match self {
            Self::All(factor) => std::slice::from_ref(factor),
            Self::Bands(factors) => factors,
        }
    }

    /// Returns the factor that stands for both, one after the other.
    pub fn times(&self, other: &Self) -> Self {
        match (self, other) {
            (Self::All(a), Self::All(b)) => Self::All(a * b),
            (Self::All(a), Self::Bands(b)) | (Self::Bands(b), Self::All(a)) => {
                Self::Bands(b.iter().map(|b| a * b).collect())
            }
            (Self::Bands(a), Self::Bands(b)) => {
                Self::Bands(a.iter().zip(b).map(|(a, b)| a * b).collect())
            }
        }
    }
}

/// Factors on the powers of lights.
struct Mix<'a> {
    of_lights: HashMap<&'a str, Scale>,
    one: Scale,
    ratios: &'a [RatioResult],
}

/// Factors on the entries of the lists of one light.
#[derive(Clone)]
struct Scale {
    /// Of bands, then of sums over bands.
    entries: Vec<Entry>,
    /// Of bands alone.
    of_bands: Vec<f64>,
}

/// How the entry of a list is rescaled.
#[derive(Clone)]
enum Entry {
    Times(f64),
    /// The entry is the sum of bands that have different factors.
    Sum(Vec<Member>),
}

/// A band of a sum, with its weight there, and its factor.
#[derive(Clone, Copy)]
struct Member {
    band: usize,
    weight: f64,
    factor: f64,
}

impl Scale {
    fn new(bands: &[BandResult], factor: &Factor) -> Self {
        let of_band = |b: usize| match factor {
            Factor::All(factor) => *factor,
            Factor::Bands(factors) => factors.get(b).copied().unwrap_or(1.0),
        };
        let entry = |(b, band): (usize, &BandResult)| {
            if band.sum_of.is_none() {
                return Entry::Times(of_band(b));
            }
            let member = |(band, weight)| Member { band, weight, factor: of_band(band) };
            let members: Vec<Member> = band.members(bands).map(member).collect();
            let first = members.first().map_or(1.0, |member| member.factor);
            match members.iter().all(|member| member.factor == first) {
                true => Entry::Times(first),
                false => Entry::Sum(members),
            }
        };
        let plain = (0..bands.len()).filter(|b| bands[*b].sum_of.is_none());
        Self {
            entries: bands.iter().enumerate().map(entry).collect(),
            of_bands: plain.map(of_band).collect(),
        }
    }

    /// Returns whether nothing of the light is left.
    fn is_dark(&self) -> bool {
        self.entries.iter().all(|entry| matches!(entry, Entry::Times(0.0)))
    }

    fn times<V: FromIterator<f64> + DerefMut<Target = [f64]>>(&self, values: &[f64]) -> V {
        let mut scaled: V = values.iter().copied().collect();
        for (value, entry) in scaled.iter_mut().zip(&self.entries) {
            *value *= if let Entry::Times(factor) = entry { *factor } else { 1.0 };
        }
        for (i, entry) in self.entries.iter().enumerate().take(values.len()) {
            if let Entry::Sum(members) = entry {
                let member = |of: &Member| Some(scaled.get(of.band)? * of.weight);
                scaled[i] = members.iter().filter_map(member).sum();
            }
        }
        scaled
    }

    /// Rescales the standard errors of these values; a factor of zero leaves no known error.
    fn error_times<V>(&self, values: &[f64], errors: &[Option<f64>]) -> V
    where
        V: FromIterator<Option<f64>>,
    {
        // what is dark does not vary
        let of_band = |band: usize| match errors.get(band).copied()? {
            None if values.get(band) == Some(&0.0) => Some(0.0),
            error => error,
        };
        let scaled = |(error, entry): (&Option<f64>, &Entry)| match entry {
            Entry::Times(factor) => error.filter(|_| *factor > 0.0).map(|e| e * factor),
            Entry::Sum(members) => largest_error((*error)?, members, of_band),
        };
        errors.iter().zip(&self.entries).map(scaled).collect()
    }
}

/// Returns an upper bound of the standard error of a sum whose bands have different factors, from
/// that of the sum before, and those of its bands; `None` where one of these is not known. By the
/// triangle inequality it is at most c times the error of the sum, and |factor - c| times that of
/// each band, for any c; the least of these bounds has a factor, or 0, as its c.
fn largest_error(
    of_sum: f64,
    members: &[Member],
    of_band: impl Fn(usize) -> Option<f64>,
) -> Option<f64> {
    let errors = members.iter().map(|member| Some(member.weight * of_band(member.band)?));
    let errors: Vec<f64> = errors.collect::<Option<_>>()?;
    let bound = |c: f64| {
        let rest =
            members.iter().zip(&errors).map(|(member, error)| (member.factor - c).abs() * error);
        c * of_sum + rest.sum::<f64>()
    };
    Some(members.iter().map(|member| bound(member.factor)).fold(bound(0.0), f64::min))
}

impl<'a> Mix<'a> {
    fn new(bands: &[BandResult], ratios: &'a [RatioResult], factors: &'a ByLight<Factor>) -> Self {
        let scales =
            factors.iter().map(|(name, factor)| (name.as_str(), Scale::new(bands, factor)));
        Self { of_lights: scales.collect(), one: Scale::new(bands, &Factor::All(1.0)), ratios }
    }

    /// Returns the factors of a light.
    fn scale(&self, light: &str) -> &Scale {
        self.of_lights.get(light).unwrap_or(&self.one)
    }

    /// Rescales each light's part.
    fn scaled<T>(&self, parts: &OfLights<T>, scale: impl Fn(&T, &Scale) -> T) -> OfLights<T> {
        parts.map(|light, part| scale(part, self.scale(light)))
    }

    fn energy(&self, energy: &Energy, lights: &ByLight<Energy>) -> Energy {
        let of = |part: &Energy, scale: &Scale| Energy {
            power: scale.times(&part.power),
            emitted: scale.times(&part.emitted),
            absorbed: scale.times(&part.absorbed),
            escaped: scale.times(&part.escaped),
            missed: scale.times(&part.missed),
            lost: scale.times(&part.lost),
            chance: part.chance.as_ref().map(|taken| scale.times(taken)),
            chance_se: part.chance_se.as_ref().map(|errors| {
                scale.error_times(part.chance.as_deref().unwrap_or_default(), errors)
            }),
            absorbed_by: part.absorbed_by.as_ref().map(|materials| {
                materials.iter().map(|(name, values)| (name.clone(), scale.times(values))).collect()
            }),
            by_light: None,
        };
        let of_light =
            |(name, part): (&String, &Energy)| (name.clone(), of(part, self.scale(name)));
        let parts: ByLight<Energy> = lights.iter().map(of_light).collect();
        let all = |of: fn(&Energy) -> &[f64]| sum(parts.values().map(of), of(energy).len());
        let by = |(name, values): (&String, &Vec<f64>)| {
            let materials = parts.values().filter_map(|part| part.absorbed_by.as_ref());
            let of = materials.filter_map(|materials| materials.get(name));
            (name.clone(), sum(of.map(Vec::as_slice), values.len()))
        };
        let chances =
            || parts.values().filter_map(|p| Some((p.chance.as_deref()?, p.chance_se.as_deref()?)));
        Energy {
            power: all(|part| &part.power),
            emitted: all(|part| &part.emitted),
            absorbed: all(|part| &part.absorbed),
            escaped: all(|part| &part.escaped),
            missed: all(|part| &part.missed),
            lost: all(|part| &part.lost),
            chance: energy
                .chance
                .as_ref()
                .map(|_| all(|part| part.chance.as_deref().unwrap_or(&[]))),
            chance_se: energy.chance.as_ref().map(|taken| error(chances(), taken.len())),
            absorbed_by: energy.absorbed_by.as_ref().map(|all| all.iter().map(by).collect()),
            by_light: Some(parts),
        }
    }

    fn captor(&self, captor: &CaptorResult) -> CaptorResult {
        CaptorResult {
            front: self.face(&captor.front),
            back: captor.back.as_ref().map(|face| self.face(face)),
            whole: self.whole(&captor.whole),
            id: captor.id.clone(),
            kind: captor.kind.clone(),
            groups: captor.groups.clone(),
            ..*captor
        }
    }

    /// Rescales groups, whose captors have been.
    fn groups(&self, groups: &[GroupResult], captors: &[CaptorResult]) -> Vec<GroupResult> {
        let mut ranges: HashMap<&str, [Spread; 2]> = HashMap::new();
        for captor in captors {
            for group in captor.groups.iter().flatten() {
                let [front, back] = ranges.entry(group).or_default();
                front.add(&captor.front, captor.area);
                captor.back.iter().for_each(|face| back.add(face, captor.area));
            }
        }
        let group = |group: &GroupResult| {
            let range = ranges.get(group.id.as_str()).cloned().unwrap_or_default();
            self.group(group, &range)
        };
        groups.iter().map(group).collect()
    }

    fn group(&self, group: &GroupResult, [front, back]: &[Spread; 2]) -> GroupResult {
        let face = |face: &FaceResult, spread: &Spread| spread.on(self.face(face));
        GroupResult {
            front: face(&group.front, front),
            back: group.back.as_ref().map(|of| face(of, back)),
            whole: self.whole(&group.whole),
            id: group.id.clone(),
            ..*group
        }
    }

    fn face(&self, face: &FaceResult) -> FaceResult {
        let none = OfLights::from_iter([] as [(&str, FaceResult); 0]);
        let before = face.by_light.as_deref().unwrap_or(&none);
        let parts = self.scaled(before, |part, scale| {
            FaceResult {
                // photons of a dark light bring nothing
                photons: if scale.is_dark() { 0 } else { part.photons },
                histories: part.histories.map(|n| if scale.is_dark() { 0 } else { n }),
                flux: scale.times(&part.flux),
                flux_se: scale.error_times(&part.flux, &part.flux_se),
                irradiance: scale.times(&part.irradiance),
                irradiance_se: scale.error_times(&part.irradiance, &part.irradiance_se),
                ratios: Ratios::mixed(self.ratios, once(on_face(part, scale))),
                ..part.clone()
            }
        });
        let bands = face.flux.len();
        let values = || parts.values();
        // no two lights share a history
        let histories =
            values().try_fold(0u64, |sum, part| Some(sum.saturating_add(part.histories?)));
        let flux: PerBand<f64> = sum(values().map(|part| &part.flux[..]), bands);
        let flux_se: PerBand<_> =
            error(values().map(|part| (&part.flux[..], &part.flux_se[..])), bands);
        let few = histories.is_some_and(|n| 0 < n && n < FEW_HISTORIES)
            || flux.iter().zip(&flux_se).any(|(&mean, &error)| rests_on_few(mean, error));
        FaceResult {
            photons: values().fold(0, |sum, part| sum.saturating_add(part.photons)),
            histories,
            flux,
            flux_se,
            irradiance: sum(values().map(|part| &part.irradiance[..]), bands),
            irradiance_se: error(
                values().map(|part| (&part.irradiance[..], &part.irradiance_se[..])),
                bands,
            ),
            ratios: Ratios::mixed(
                self.ratios,
                before.iter().map(|(light, part)| on_face(part, self.scale(light))),
            ),
            few_paths: face.few_paths || few,
            knn: face.knn.as_ref().map(|_| None),
            by_light: Some(parts.into()),
            ..FaceResult::default()
        }
    }

    fn whole(&self, whole: &Whole) -> Whole {
        // quantities of the place alone do not depend on powers
        let rest = Whole { own: whole.own.clone(), ..Whole::default() };
        let Some(before) = &whole.by_light else { return rest };
        let parts = self.scaled(before, |part, scale| Absorbed {
            absorbed: scale.times(&part.absorbed),
            absorbed_se: scale.error_times(&part.absorbed, &part.absorbed_se),
            absorbed_by_face: part.absorbed_by_face.as_ref().map(|faces| {
                Box::new(AbsorbedByFace {
                    front: scale.times(&faces.front),
                    front_se: scale.error_times(&faces.front, &faces.front_se),
                    back: scale.times(&faces.back),
                    back_se: scale.error_times(&faces.back, &faces.back_se),
                })
            }),
            absorbed_ratios: Ratios::mixed(self.ratios, once(absorbed(part, scale))),
        });
        let ratios = Ratios::mixed(
            self.ratios,
            before.iter().map(|(light, part)| absorbed(part, self.scale(light))),
        );
        let bands = parts.values().map(|part| part.absorbed.len()).max().unwrap_or(0);
        let faces = || parts.values().filter_map(|part| part.absorbed_by_face.as_ref());
        let by_face = faces().next().map(|_| AbsorbedByFace {
            front: sum(faces().map(|of| &of.front[..]), bands),
            front_se: error(faces().map(|of| (&of.front[..], &of.front_se[..])), bands),
            back: sum(faces().map(|of| &of.back[..]), bands),
            back_se: error(faces().map(|of| (&of.back[..], &of.back_se[..])), bands),
        });
        let absorbed = sum(parts.values().map(|part| &part.absorbed[..]), bands);
        let errors = parts.values().map(|part| (&part.absorbed[..], &part.absorbed_se[..]));
        Whole {
            absorbed: Some(absorbed),
            absorbed_se: Some(error(errors, bands)),
            absorbed_by_face: by_face.map(Box::new),
            absorbed_ratios: ratios,
            by_light: Some(parts),
            ..rest
        }
    }
}

/// Returns the light of a lamp on a face.
fn on_face<'a>(part: &'a FaceResult, scale: &'a Scale) -> OfLight<'a> {
    let (values, errors) = (&part.flux, &part.flux_se);
    OfLight { ratios: part.ratios.as_deref(), values, errors, factors: &scale.of_bands }
}

/// Returns the light of a lamp that was absorbed.
fn absorbed<'a>(part: &'a Absorbed, scale: &'a Scale) -> OfLight<'a> {
    let (values, errors) = (&part.absorbed, &part.absorbed_se);
    OfLight { ratios: part.absorbed_ratios.as_deref(), values, errors, factors: &scale.of_bands }
}

fn sum<'a, V: From<Vec<f64>>>(parts: impl Iterator<Item = &'a [f64]>, bands: usize) -> V {
    let mut sums = vec![0.0; bands];
    for part in parts {
        sums.iter_mut().zip(part).for_each(|(sum, value)| *sum += value);
    }
    sums.into()
}

/// Returns the standard error of a sum of independent values; `None` where the error of a value
/// that is not zero is unknown.
fn error<'a, V: FromIterator<Option<f64>>>(
    parts: impl Iterator<Item = (&'a [f64], &'a [Option<f64>])>,
    bands: usize,
) -> V {
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

#[cfg(test)]
mod tests {
    use super::*;

    /// Whatever two bands have to do with each other, the bound is not below the error of their
    /// sum; it is that error where the factors are equal, and at most that of bands that go together.
    #[test]
    fn errors_of_sums_have_a_bound() {
        let (errors, weights): ([f64; 2], [f64; 2]) = ([1.0, 2.0], [1.0, 3.0]);
        for correlation in [-1.0, -0.5, 0.0, 0.5, 1.0] {
            let of = |factors: [f64; 2]| {
                let [a, b] = [0, 1].map(|i| factors[i] * weights[i] * errors[i]);
                (a * a + b * b + 2.0 * correlation * a * b).sqrt()
            };
            for factors in [[2.0, 2.0], [1.0, 1.1], [1.0, 5.0], [0.0, 2.0]] {
                let members = [0, 1].map(|band| Member {
                    band,
                    weight: weights[band],
                    factor: factors[band],
                });
                let bound = largest_error(of([1.0, 1.0]), &members, |band| Some(errors[band]));
                let (bound, exact) = (bound.unwrap(), of(factors));
                let together = factors[0] * errors[0] + 3.0 * factors[1] * errors[1];
                assert!((exact - 1e-12..=together + 1e-12).contains(&bound), "{bound} {exact}");
                assert!(factors[0] != factors[1] || (bound - exact).abs() < 1e-12);
                assert_eq!(largest_error(1.0, &members, |band| (band > 0).then_some(1.0)), None);
            }
        }
    }
}
