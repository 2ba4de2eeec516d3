//! On what the light of a mix depends, and how uncertain its inputs make it.
//!
//! A moment M (elasticity times light E) is linear in the powers of the lamps, as E is. So the
//! elasticity of a mix is M / E with both summed over the lamps, each times its factor, and its
//! variance is, by the delta method, the sum over the lamps of that of factor (M - e E) / E, as
//! lamps share no history.

use std::collections::HashMap;

use super::{Entry, Mix, Scale, absorbed, largest_error, on_face};
use crate::result::{
    Absorbed, FaceResult, LightSensitivity, OfLights, RatioResult, RatioSensitivity, RunResult,
    SensitivityResult,
    ratios::OfLight,
    uncertain::{Inputs, Moments, Spot},
};
use phylux_core::{
    math::stats::{Covariances, is_possible, scaled_covariances, variance_of_sum},
    scene::captor::Channel,
};

/// The light of one lamp on a face, and how it depends on a parameter.
struct Lamp<'a> {
    name: &'a str,
    light: OfLight<'a>,
    scale: &'a Scale,
    /// `None` where its light does not depend on the parameter.
    own: Option<&'a LightSensitivity>,
}

impl Lamp<'_> {
    /// Returns the moment in a column before.
    fn moment(&self, column: usize) -> f64 {
        let elasticity = self.own.and_then(|own| own.elasticity.get(column).copied()?);
        elasticity.unwrap_or(0.0) * self.light.values[column]
    }

    /// Returns the standard error of M - e E in a column before; an upper bound where it is not known
    /// how the elasticity and the light vary together.
    fn error(&self, column: usize, e: f64) -> Option<f64> {
        let light = self.light.values[column];
        let light_se = self.light.error(column)?;
        let Some(own) = self.own.filter(|_| light > 0.0) else { return Some(e.abs() * light_se) };
        let (elasticity, error) = (own.elasticity[column]?, light * own.elasticity_se[column]?);
        let off = elasticity - e;
        Some(match own.covariance[column] {
            Some(both) => {
                let variance = error * error + 2.0 * off * light * both + (off * light_se).powi(2);
                variance.max(0.0).sqrt()
            }
            None => error + off.abs() * light_se,
        })
    }

    /// Returns how the moment and the light of the numerator of a ratio, and those of its denominator,
    /// vary together before.
    fn covariances(&self, r: usize) -> Option<Covariances> {
        let known = self.own.map(|own| &own.ratio_covariances);
        if let Some(Some(all)) = known {
            return all.get(r).copied()?;
        }
        // all light of a lamp, or none, has met the parameter
        let all = self.own.map_or(Some(0.0), |own| {
            own.elasticity.iter().flatten().all(|elasticity| *elasticity == 1.0).then_some(1.0)
        })?;
        let [over, both, under] = self.light.before(r)?;
        let pairs = [over, over, both, both, over, both, both, under, under, under];
        Some(scaled_covariances([all, 1.0, all, 1.0], &pairs))
    }
}

/// The light of all lamps on a face, and how it depends on a parameter.
struct Lamps<'a>(Vec<Lamp<'a>>);

impl Lamps<'_> {
    /// Returns a sum over the lamps of what is linear in their powers, in a column.
    fn sum(&self, column: usize, of: impl Fn(&Lamp, usize) -> Option<f64>) -> Option<f64> {
        let each = self.0.iter().map(|lamp| match &lamp.scale.entries[column] {
            Entry::Times(factor) => Some(factor * of(lamp, column)?),
            Entry::Sum(members) => {
                members.iter().map(|m| Some(m.weight * m.factor * of(lamp, m.band)?)).sum()
            }
        });
        each.sum()
    }

    /// Returns the standard error of such a sum, from those of the lamps.
    fn error(&self, column: usize, of: impl Fn(&Lamp, usize) -> Option<f64>) -> Option<f64> {
        self.0.iter().try_fold(0.0f64, |all, lamp| {
            let own = match &lamp.scale.entries[column] {
                Entry::Times(0.0) => 0.0,
                Entry::Times(factor) => factor * of(lamp, column)?,
                Entry::Sum(members) => {
                    largest_error(of(lamp, column)?, members, |band| of(lamp, band))?
                }
            };
            Some(all.hypot(own)).filter(|error| is_possible(*error))
        })
    }

    fn moment(&self, column: usize) -> f64 {
        self.sum(column, |lamp, column| Some(lamp.moment(column))).unwrap_or(0.0)
    }

    fn light(&self, column: usize) -> f64 {
        self.sum(column, |lamp, column| Some(lamp.light.values[column])).unwrap_or(0.0)
    }

    /// Returns the elasticity in a column and its standard error.
    fn elasticity(&self, column: usize) -> (Option<f64>, Option<f64>) {
        let light = self.light(column);
        let elasticity = (light > 0.0).then(|| self.moment(column) / light);
        let elasticity = elasticity.filter(|elasticity| is_possible(*elasticity));
        let error = elasticity.and_then(|e| self.error(column, |lamp, c| lamp.error(c, e)));
        (elasticity, error.map(|error| error / light))
    }

    /// Returns the derivative by a parameter of a material in a column and its standard error.
    fn derivative(&self, column: usize) -> (Option<f64>, Option<f64>) {
        let of = |list: fn(&LightSensitivity) -> &[Option<f64>]| {
            move |lamp: &Lamp, c: usize| lamp.own.map_or(Some(0.0), |own| list(own)[c])
        };
        let derivative = self.sum(column, of(|own| &own.derivative));
        let error = self.error(column, of(|own| &own.derivative_se));
        (derivative, derivative.and(error))
    }

    /// Returns the moments of the bands, and their standard errors.
    fn moments(&self, bands: usize) -> Moments {
        let error = |band| self.error(band, |lamp, c| lamp.error(c, 0.0)).unwrap_or(0.0);
        (0..bands).map(|band| [self.moment(band), error(band)]).collect()
    }

    /// Returns the elasticity of a ratio and its standard error; an upper bound where bands of its
    /// sums have different factors.
    fn of_ratio(&self, r: usize, ratio: &RatioResult) -> Option<(f64, Option<f64>)> {
        let sum = |weights: &[f64], of: &dyn Fn(&Lamp, usize) -> f64| -> f64 {
            let lamp = |lamp: &Lamp| -> f64 {
                let factors = lamp.light.factors.iter().zip(weights).enumerate();
                factors.map(|(b, (factor, weight))| weight * factor * of(lamp, b)).sum()
            };
            self.0.iter().map(lamp).sum()
        };
        let sides = [&ratio.numerator, &ratio.denominator];
        let light = sides.map(|weights| sum(weights, &|lamp, b| lamp.light.values[b]));
        let moment = sides.map(|weights| sum(weights, &|lamp, b| lamp.moment(b)));
        let e = [0, 1].map(|side| moment[side] / light[side]);
        let elasticity = (light[0] > 0.0 && light[1] > 0.0).then(|| e[0] - e[1])?;
        let error = self.0.iter().try_fold(0.0f64, |all, lamp| {
            let factors = sides.map(|weights| same(weights, lamp.light.factors));
            let exact = || {
                let [Some(over), Some(under)] = factors else { return None };
                let [over, under] = [over / light[0], under / light[1]];
                let weights = [over, -over * e[0], -under, under * e[1]];
                Some(variance_of_sum(weights, &lamp.covariances(r)?).sqrt())
            };
            // bands that go together are assumed
            let bound = || {
                let mut sum = 0.0;
                for side in 0..2 {
                    for (b, weight) in sides[side].iter().enumerate().filter(|(_, w)| **w > 0.0) {
                        let factor = weight * lamp.light.factors[b] / light[side];
                        sum += factor * lamp.error(b, e[side])?;
                    }
                }
                Some(sum)
            };
            exact().or_else(bound).map(|own| all.hypot(own))
        });
        Some((elasticity, error.filter(|error| is_possible(*error))))
    }
}

/// Returns the factor of all bands that have a weight, if it is the same.
fn same(weights: &[f64], factors: &[f64]) -> Option<f64> {
    let mut counting = weights.iter().zip(factors).filter(|(w, _)| **w > 0.0).map(|(_, f)| *f);
    let first = counting.next()?;
    counting.all(|factor| factor == first).then_some(first)
}

/// The light of each lamp on a face of a captor or group of the run, or of what it absorbed.
struct Source<'a> {
    spot: Spot,
    lamps: Vec<(&'a str, OfLight<'a>, &'a Scale)>,
}

/// The places of results with their faces: the name of a captor or group, and of the face.
type Sources<'a> = HashMap<(bool, &'a str, &'static str), Source<'a>>;

impl<'a> Mix<'a> {
    /// Returns where the light comes from on each face of results.
    fn sources(&'a self, result: &'a RunResult) -> Sources<'a> {
        let captors = result
            .captors
            .iter()
            .map(|of| (false, &of.id, [Some(&of.front), of.back.as_ref()], &of.by_light));
        let groups = result
            .groups
            .iter()
            .map(|of| (true, &of.id, [Some(&of.front), of.back.as_ref()], &of.by_light));
        let mut all = HashMap::new();
        for (place, (is_group, id, faces, absorbed)) in captors.chain(groups).enumerate() {
            let kinds = [(Channel::Front, "front"), (Channel::Back, "back")];
            for (face, (kind, name)) in faces.into_iter().zip(kinds) {
                let found = face.and_then(|face| self.source_on(face, place, kind));
                found.into_iter().for_each(|of| drop(all.insert((is_group, &**id, name), of)));
            }
            if let Some(parts) = absorbed {
                let spot = Spot { place, kind: Channel::Absorbed, per: 1.0 };
                let source = self.source_of(parts, spot);
                all.insert((is_group, &**id, "absorbed"), source);
            }
        }
        all
    }

    fn source_on(
        &'a self,
        face: &'a FaceResult,
        place: usize,
        kind: Channel,
    ) -> Option<Source<'a>> {
        let lit = face.flux.iter().zip(&face.irradiance).find(|(_, light)| **light > 0.0);
        let per = lit.map_or(1.0, |(flux, irradiance)| flux / irradiance);
        let lamps = face.by_light.as_ref()?.iter().map(|(name, part)| {
            let scale = self.scale(name);
            (name, on_face(part, scale), scale)
        });
        Some(Source { spot: Spot { place, kind, per }, lamps: lamps.collect() })
    }

    fn source_of(&'a self, parts: &'a OfLights<Absorbed>, spot: Spot) -> Source<'a> {
        let lamps = parts.iter().map(|(name, part)| {
            let scale = self.scale(name);
            (name, absorbed(part, scale), scale)
        });
        Source { spot, lamps: lamps.collect() }
    }

    /// Adds to the results of this mix how they depend on what the run's results depend on, and how
    /// uncertain that makes them, as far as the run has kept it by light.
    pub(super) fn add_dependence(&'a self, before: &'a RunResult, mixed: &mut RunResult) {
        let Some(rows) = &before.extras.sensitivity else { return };
        let sources = self.sources(before);
        let uncertain = before.extras.uncertain.clone().unwrap_or_default();
        let inputs = before.extras.budget.as_ref().and_then(|_| Inputs::new(before, uncertain));
        let lights = before.energy.by_light.as_ref();
        let is_light = |name: &str| {
            name.starts_with("/lights/") || lights.is_some_and(|all| all.contains_key(name))
        };
        mixed.extras.budget = inputs.as_ref().map(|_| Vec::new());
        let mut all = Vec::new();
        let same = |a: &SensitivityResult, b: &SensitivityResult| {
            (&a.captor, &a.group, &a.face) == (&b.captor, &b.group, &b.face)
        };
        for rows in rows.chunk_by(same).filter(|rows| rows.iter().all(|row| row.by_light.is_some()))
        {
            let (is_group, id) = (rows[0].group.is_some(), rows[0].of());
            let Some(source) = FACES
                .into_iter()
                .find(|face| *face == rows[0].face)
                .and_then(|face| sources.get(&(is_group, id, face)))
            else {
                continue;
            };
            for row in rows {
                all.extend(self.row(row, source, is_light(&row.parameter)));
            }
            if let Some(inputs) = &inputs {
                self.add_uncertainty(mixed, inputs, source, rows);
            }
        }
        mixed.extras.sensitivity = Some(all);
        mixed.extras.uncertain.clone_from(&before.extras.uncertain);
    }

    fn add_uncertainty(
        &self,
        mixed: &mut RunResult,
        inputs: &Inputs,
        source: &Source,
        rows: &[SensitivityResult],
    ) {
        let bands = self.one.of_bands.len();
        let moments = |name: &str| {
            let row = rows.iter().find(|row| row.parameter == name);
            // light that has never met an input does not depend on it
            let none = || vec![[0.0; 2]; bands];
            Some(row.map_or_else(none, |row| source.lamps_of(row).moments(bands)))
        };
        let sums = self.ratios.iter().map(|ratio| {
            source.lamps.iter().fold([0.0; 2], |[over, under], (_, light, _)| {
                let own = light.sums(ratio);
                [over + own[0], under + own[1]]
            })
        });
        if let Some(varies) = inputs.varies(&moments, sums) {
            mixed.set_uncertainty(inputs, source.spot, &varies);
        }
    }

    /// Returns how the light of the mix on a face depends on a parameter; `None` where none of it has
    /// met it.
    fn row(
        &self,
        row: &SensitivityResult,
        source: &Source,
        is_light: bool,
    ) -> Option<SensitivityResult> {
        let lamps = source.lamps_of(row);
        let columns = row.elasticity.len();
        if (0..columns).all(|column| lamps.moment(column) == 0.0) {
            return None;
        }
        let own = Own { row, is_light, per: source.spot.per };
        let by_light = lamps.0.iter().filter_map(|lamp| {
            let own = own.of_light(lamp, self.ratios)?;
            (!lamp.scale.is_dark()).then(|| (lamp.name.to_string(), own))
        });
        let by_light = Some(by_light.collect());
        let [elasticity, elasticity_se, derivative, derivative_se] = own.columns(&lamps);
        let ratios = row.ratios.as_ref().map(|_| own.ratios(&lamps, self.ratios, &derivative));
        let (captor, group) = (row.captor.clone(), row.group.clone());
        let (face, parameter) = (row.face.clone(), row.parameter.clone());
        let light = row.light.clone();
        Some(SensitivityResult {
            captor,
            group,
            face,
            parameter,
            light,
            elasticity,
            elasticity_se,
            derivative,
            derivative_se,
            ratios,
            by_light,
        })
    }
}

/// The names of faces in results.
const FACES: [&str; 3] = ["front", "back", "absorbed"];

impl Source<'_> {
    /// Returns its lamps, as they depend on the parameter of a row of the run.
    fn lamps_of<'r>(&'r self, row: &'r SensitivityResult) -> Lamps<'r> {
        let parts = row.by_light.as_ref();
        let lamps = self.lamps.iter().map(|&(name, light, scale)| {
            let own = parts.and_then(|parts| parts.get(name));
            Lamp { name, light, scale, own }
        });
        Lamps(lamps.collect())
    }
}

/// A row of the run that is mixed anew.
#[derive(Clone, Copy)]
struct Own<'a> {
    row: &'a SensitivityResult,
    /// Whether its parameter is of a light.
    is_light: bool,
    /// What a flux is divided by.
    per: f64,
}

impl Own<'_> {
    /// Returns elasticities, derivatives and their errors in all bands and sums of these lamps.
    fn columns(&self, lamps: &Lamps) -> [Vec<Option<f64>>; 4] {
        let columns = 0..self.row.elasticity.len();
        let mut lists = [(); 4].map(|()| Vec::with_capacity(columns.len()));
        for column in columns {
            let (elasticity, error) = lamps.elasticity(column);
            let (derivative, derivative_se) = match self.is_light {
                // light is in proportion to the power of its lamp
                true => self.by_power(lamps, column),
                false => lamps.derivative(column),
            };
            let all = [elasticity, error, derivative, derivative_se];
            lists.iter_mut().zip(all).for_each(|(list, value)| list.push(value));
        }
        lists
    }

    /// Returns the derivative by the power of a light, which is that of the run, and its standard
    /// error; none where the light is dark.
    fn by_power(&self, lamps: &Lamps, column: usize) -> (Option<f64>, Option<f64>) {
        let lit = |factor: f64| (factor > 0.0).then_some(());
        let entry = lamps.0.iter().find(|lamp| lamp.own.is_some());
        let entry = entry.map(|lamp| &lamp.scale.entries[column]);
        let (derivative, error) = (self.row.derivative[column], self.row.derivative_se[column]);
        match entry {
            Some(Entry::Times(factor)) => {
                let lit = lit(*factor);
                (derivative.and_then(|d| lit.map(|()| d)), error.and_then(|e| lit.map(|()| e)))
            }
            Some(Entry::Sum(members)) if members.iter().all(|m| m.factor > 0.0) => {
                (derivative, None)
            }
            _ => (None, None),
        }
    }

    /// Returns how the light of one lamp of the mix depends on the parameter; `None` where it does not.
    fn of_light(&self, lamp: &Lamp, ratios: &[RatioResult]) -> Option<LightSensitivity> {
        let own = lamp.own?;
        let &Lamp { name, light, scale, .. } = lamp;
        let alone = Lamps(vec![Lamp { name, light, scale, own: Some(own) }]);
        let [elasticity, elasticity_se, derivative, derivative_se] = self.columns(&alone);
        let covariance = |(column, entry): (usize, &Entry)| match entry {
            Entry::Times(factor) => own.covariance[column].map(|both| factor * both),
            Entry::Sum(_) => None,
        };
        let of_ratio = |(r, ratio): (usize, &RatioResult)| {
            let [over, under] =
                [&ratio.numerator, &ratio.denominator].map(|weights| same(weights, light.factors));
            let (over, under) = over.zip(under)?;
            Some(scaled_covariances([over, over, under, under], &lamp.covariances(r)?))
        };
        Some(LightSensitivity {
            elasticity,
            elasticity_se,
            covariance: scale.entries.iter().enumerate().map(covariance).collect(),
            derivative,
            derivative_se,
            ratio_covariances: (!ratios.is_empty())
                .then(|| ratios.iter().enumerate().map(of_ratio).collect()),
        })
    }

    /// Returns how the ratios of these lamps depend on the parameter, from the derivatives of the bands.
    fn ratios(
        &self,
        lamps: &Lamps,
        ratios: &[RatioResult],
        derivatives: &[Option<f64>],
    ) -> RatioSensitivity {
        let mut all = RatioSensitivity::default();
        for (r, ratio) in ratios.iter().enumerate() {
            let found = lamps.of_ratio(r, ratio);
            let sides = [&ratio.numerator, &ratio.denominator];
            let light = sides.map(|weights| -> f64 {
                weights.iter().enumerate().map(|(b, weight)| weight * lamps.light(b)).sum()
            });
            let slope = |weights: &[f64]| -> Option<f64> {
                let counting = weights.iter().enumerate().filter(|(_, w)| **w > 0.0);
                counting.map(|(b, weight)| Some(weight * self.per * derivatives[b]?)).sum()
            };
            let value = light[0] / light[1];
            let slopes = slope(sides[0]).zip(slope(sides[1]));
            let derivative =
                slopes.filter(|_| found.is_some()).map(|(n, d)| (n - value * d) / light[1]);
            let error = found.and_then(|(_, error)| error);
            let by_one = self.value(lamps, (r, ratio), derivatives).zip(error);
            let derivative_se = by_one.map(|(x, error)| error * (value / x).abs());
            all.elasticity.push(found.map(|(elasticity, _)| elasticity));
            all.elasticity_se.push(error);
            all.derivative.push(derivative);
            all.derivative_se.push(derivative.and(derivative_se));
        }
        all
    }

    /// Returns the value of the parameter, if it is the same in all bands of a ratio: there M = x dE / dx.
    fn value(
        &self,
        lamps: &Lamps,
        (r, ratio): (usize, &RatioResult),
        derivatives: &[Option<f64>],
    ) -> Option<f64> {
        self.row.ratios.as_ref()?.derivative_se.get(r).copied()??;
        let counts = |b: &usize| ratio.numerator[*b] > 0.0 || ratio.denominator[*b] > 0.0;
        let counting = || (0..ratio.numerator.len()).filter(counts);
        let lamp = lamps.0.iter().find(|lamp| self.is_light && lamp.own.is_some());
        let weights: Vec<f64> =
            ratio.numerator.iter().zip(&ratio.denominator).map(|(n, d)| n + d).collect();
        if lamp.is_some_and(|lamp| same(&weights, lamp.light.factors).is_none()) {
            return None;
        }
        let of_band = |b: usize| {
            let slope = self.per * derivatives[b].filter(|slope| *slope != 0.0)?;
            Some(lamps.moment(b) / slope)
        };
        counting().find_map(of_band)
    }
}
