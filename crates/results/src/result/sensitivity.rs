//! How much results depend on the materials and lights of a scene.

use std::{borrow::Cow, collections::BTreeMap};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{ByLight, CaptorResult, FaceResult, GroupResult, Ratios, RunResult};
use crate::lists::are_errors;
use phylux_core::{
    math::stats::{Covariances, difference_of_ratios, is_possible, ratio, scaled_covariances},
    scene::{
        captor::{Captor, CaptorKind, Channel},
        parameter::{Factor, Parameter},
        world::{BandRatio, BandSum, Scene},
    },
    transport::{simulate::Simulation, tally::Totals},
};

/// How much the light on a face of a captor or group, or the light that it absorbs, depends on a
/// parameter: a reflectance, a transmittance, a tint or the power of a light.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct SensitivityResult {
    /// Id of the captor; absent where it is a group.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub captor: Option<String>,
    /// Name of the group; absent where it is a captor.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub group: Option<String>,
    /// `front`, `back` or `absorbed`.
    pub face: Cow<'static, str>,
    /// The parameter, as a pointer into the scene file. What stands after a `#` says what of it
    /// counts, where it is more than one value.
    pub parameter: String,
    /// Name of the light, where the parameter is of a light that has one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub light: Option<String>,
    /// By how many per cent the light changes for 1 % more of the parameter, per band, then per sum:
    /// d ln E / d ln x. For light that arrives it is how many times it has met the parameter, on
    /// average. (Light that passes a pane at an angle counts for more than once, as the tint does.)
    /// Null where no light arrived.
    pub elasticity: Vec<Option<f64>>,
    /// Standard error of the value above.
    pub elasticity_se: Vec<Option<f64>>,
    /// Change of the irradiance or of the absorbed power, in its unit, for one unit of the parameter:
    /// dE / dx, per band, then per sum, if all bands change by the same amount. Null where no number
    /// of the scene file stands for the parameter, and where that is 0.
    pub derivative: Vec<Option<f64>>,
    /// Standard error of the value above; null also for sums over bands in which the parameter
    /// differs.
    pub derivative_se: Vec<Option<f64>>,
    /// The same of each ratio, where the scene has any.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ratios: Option<RatioSensitivity>,
    /// The same for the light of each lamp, where results are split by light, and its light depends on
    /// the parameter.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub by_light: Option<ByLight<LightSensitivity>>,
}

/// How much the light of one lamp depends on a parameter, with what a mix needs of it.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct LightSensitivity {
    /// By how many per cent the light of the lamp changes for 1 % more of the parameter, per band, then
    /// per sum; null where none of it arrived.
    pub elasticity: Vec<Option<f64>>,
    /// Standard error of the value above.
    pub elasticity_se: Vec<Option<f64>>,
    /// Covariance of the elasticity and the flux (or absorbed power) of the lamp; null where it is not
    /// known.
    pub covariance: Vec<Option<f64>>,
    /// Change of the irradiance or of the absorbed power of the lamp for one unit of the parameter.
    pub derivative: Vec<Option<f64>>,
    /// Standard error of the value above.
    pub derivative_se: Vec<Option<f64>>,
    /// For each ratio, the covariances of the moment of its numerator (elasticity times flux), the
    /// numerator, the moment of its denominator, and the denominator: of each with itself and with those
    /// after it; null where they are not known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ratio_covariances: Option<Vec<Option<Covariances>>>,
}

impl LightSensitivity {
    fn is_valid(&self, bands: usize, ratios: usize) -> bool {
        let Self { elasticity, elasticity_se, covariance, derivative, derivative_se, .. } = self;
        let lists = [elasticity, elasticity_se, covariance, derivative, derivative_se];
        let of_ratios = self.ratio_covariances.as_ref().is_none_or(|all| {
            let mut numbers = all.iter().flatten().flatten();
            all.len() == ratios && numbers.all(|number| is_possible(number.abs().sqrt()))
        });
        lists.into_iter().all(|list| are_errors(list, bands)) && of_ratios
    }
}

/// How much the ratios of a face of a captor or group, or of what it absorbs, depend on a
/// parameter.
#[derive(Clone, Debug, Default, Serialize, Deserialize, JsonSchema)]
pub struct RatioSensitivity {
    /// By how many per cent each ratio changes for 1 % more of the parameter: the elasticity of its
    /// numerator less that of its denominator. Null where the ratio is not known.
    pub elasticity: Vec<Option<f64>>,
    /// Standard error of the value above.
    pub elasticity_se: Vec<Option<f64>>,
    /// Change of each ratio for one unit of the parameter, if all bands change by the same amount.
    /// Null where no number of the scene file stands for the parameter, and where that is 0.
    pub derivative: Vec<Option<f64>>,
    /// Standard error of the value above; null also where the parameter differs between bands of
    /// the ratio.
    pub derivative_se: Vec<Option<f64>>,
}

impl SensitivityResult {
    /// Returns the id of the captor or the name of the group.
    pub fn of(&self) -> &str {
        self.captor.as_ref().or(self.group.as_ref()).map_or("", String::as_str)
    }

    /// Returns the elasticity of a column and its standard error. Columns are bands, then sums, then
    /// ratios.
    pub fn of_column(&self, column: usize) -> (Option<f64>, Option<f64>) {
        let bands = self.elasticity.len();
        let (lists, at) = match column.checked_sub(bands) {
            None => (Some((&self.elasticity, &self.elasticity_se)), column),
            Some(ratio) => {
                (self.ratios.as_ref().map(|of| (&of.elasticity, &of.elasticity_se)), ratio)
            }
        };
        let of = |list: &[Option<f64>]| list.get(at).copied().flatten();
        lists.map_or((None, None), |(values, errors)| (of(values), of(errors)))
    }

    pub(crate) fn is_valid(&self, bands: usize, ratios: usize) -> bool {
        let Self { elasticity, elasticity_se, derivative, derivative_se, .. } = self;
        let lists = [elasticity, elasticity_se, derivative, derivative_se];
        let of_ratios = self.ratios.as_ref().is_none_or(|of| {
            let lists = [&of.elasticity, &of.elasticity_se, &of.derivative, &of.derivative_se];
            lists.into_iter().all(|list| are_errors(list, ratios))
        });
        self.captor.is_some() != self.group.is_some()
            && lists.into_iter().all(|list| are_errors(list, bands))
            && of_ratios
            && self.by_light.iter().flat_map(ByLight::values).all(|of| of.is_valid(bands, ratios))
    }
}

/// A group, or a captor of results without groups, with the light of it by which its dependence is
/// told: what it absorbs, or where it is no surface what arrives on its front.
#[derive(Clone, Copy, Debug)]
pub struct Dependent<'a> {
    /// Name of the group, or id of the captor.
    pub name: &'a str,
    /// `absorbed` or `front`.
    pub face: &'static str,
    /// Irradiance or absorbed power, per band, then per sum, in its unit.
    pub values: &'a [f64],
    /// Standard errors of the values above.
    pub errors: &'a [Option<f64>],
    /// What uncertain inputs make of the values above, if that is known.
    pub model_errors: Option<&'a [f64]>,
    /// The ratios of this light, if there are any.
    pub ratios: Option<&'a Ratios>,
}

impl<'a> Dependent<'a> {
    fn of_group(group: &'a GroupResult) -> Self {
        let absorbed = group.absorbed.as_deref().zip(group.absorbed_se.as_deref());
        let ratios = group.absorbed_ratios.as_deref();
        Self::new(&group.id, absorbed, group.absorbed_model_se.as_deref(), ratios, &group.front)
    }

    /// Takes a captor.
    pub fn of_captor(captor: &'a CaptorResult) -> Self {
        let absorbed = captor.absorbed.as_deref().zip(captor.absorbed_se.as_deref());
        let ratios = captor.absorbed_ratios.as_deref();
        Self::new(&captor.id, absorbed, captor.absorbed_model_se.as_deref(), ratios, &captor.front)
    }

    /// Returns the value of a column and its standard error; `None` of a ratio that is not known.
    /// Columns are bands, then sums, then ratios.
    pub fn of_column(&self, column: usize) -> Option<(f64, Option<f64>)> {
        match column.checked_sub(self.values.len()) {
            None => Some((self.values[column], self.errors[column])),
            Some(ratio) => {
                let Ratios { ratio: values, ratio_se: errors, .. } = self.ratios?;
                Some(((*values.get(ratio)?)?, *errors.get(ratio)?))
            }
        }
    }

    fn new(
        name: &'a str,
        absorbed: Option<(&'a [f64], &'a [Option<f64>])>,
        absorbed_model_se: Option<&'a [f64]>,
        absorbed_ratios: Option<&'a Ratios>,
        front: &'a FaceResult,
    ) -> Self {
        let (face, (values, errors), model_errors, ratios) = match absorbed {
            Some(absorbed) => ("absorbed", absorbed, absorbed_model_se, absorbed_ratios),
            None => {
                let light = (&front.irradiance[..], &front.irradiance_se[..]);
                let model_errors = front.irradiance_model_se.as_deref().map(|of| &**of);
                ("front", light, model_errors, front.ratios.as_deref())
            }
        };
        Self { name, face, values, errors, model_errors, ratios }
    }
}

impl RunResult {
    /// Returns the groups, or where there are none the captors, of which a run says on what they
    /// depend.
    pub fn dependents(&self) -> Vec<Dependent<'_>> {
        match self.groups.is_empty() {
            true => self.captors.iter().map(Dependent::of_captor).collect(),
            false => self.groups.iter().map(Dependent::of_group).collect(),
        }
    }
}

/// The names of the lights whose parameters are in results.
#[derive(Debug, Default)]
pub struct LightNames(BTreeMap<String, String>);

impl LightNames {
    /// Takes the names from what results depend on.
    pub fn of(rows: &[SensitivityResult]) -> Self {
        let named = |row: &SensitivityResult| Some((row.parameter.clone(), row.light.clone()?));
        Self(rows.iter().filter_map(named).collect())
    }

    /// Returns a parameter with the name of its light, if it has one, in place of its number.
    pub fn pointer(&self, parameter: &str) -> String {
        let Some(name) = self.0.get(parameter) else { return parameter.into() };
        let key = parameter.trim_start_matches("/lights/").trim_start_matches(char::is_numeric);
        // the name of a copy tells which it is
        let key = key.split('#').next().unwrap_or_default();
        format!("/lights/{}{key}", name.replace('~', "~0").replace('/', "~1"))
    }

    /// Returns all parameters, separated by commas, of a set that varies together. A name in a pointer
    /// may hold a comma, but no slash, with which the next pointer begins.
    pub fn pointers<'a>(&self, parameters: &'a str) -> impl Iterator<Item = String> + use<'a, '_> {
        let between = if parameters.starts_with('/') { ", /" } else { ", " };
        let slash = &between[2..];
        let parts = parameters.split(between).enumerate();
        parts.map(move |(i, one)| match i {
            0 => self.pointer(one),
            _ => self.pointer(&format!("{slash}{one}")),
        })
    }
}

/// Returns how each captor and group depends on each parameter that its light has met; `None` if the
/// scene does not ask for it.
pub(super) fn sensitivities(simulation: &Simulation) -> Option<Vec<SensitivityResult>> {
    let scene = simulation.scene();
    let parameters = scene.parameters().all();
    if parameters.is_empty() {
        return None;
    }
    let mut all = Vec::new();
    for place in places(scene) {
        for face in &place.faces {
            for (index, parameter) in parameters.iter().enumerate() {
                all.extend(sensitivity(simulation, &place, face, (index, parameter)));
            }
        }
    }
    Some(all)
}

/// A captor or a group of a scene.
pub(super) struct Place<'a> {
    pub captor: Option<&'a str>,
    pub group: Option<&'a str>,
    pub faces: Vec<Face>,
}

/// A face of a captor or group, or the power that it absorbs.
pub(super) struct Face {
    pub kind: Channel,
    /// Its channel in the sums of a run.
    pub channel: usize,
    /// What a flux is divided by: the area of a face, m2, and 1 for what is absorbed.
    pub per: f64,
}

/// Returns the name of a face, or of what is absorbed, in results.
pub(super) fn name_of(kind: Channel) -> Cow<'static, str> {
    let name = match kind {
        Channel::Front => "front",
        Channel::Back => "back",
        Channel::Absorbed => "absorbed",
    };
    name.into()
}

/// Returns the captors of a scene, then its groups.
pub(super) fn places(scene: &Scene) -> Vec<Place<'_>> {
    let has = |captor: &Captor, kind| match kind {
        Channel::Front => true,
        Channel::Back => captor.kind.has_back(),
        Channel::Absorbed => captor.kind == CaptorKind::Surface,
    };
    let faces = |first: usize, areas: [Option<f64>; 3]| {
        let kinds = [Channel::Front, Channel::Back, Channel::Absorbed].into_iter().zip(areas);
        let face = |(kind, area): (Channel, Option<f64>)| {
            let per = if kind == Channel::Absorbed { 1.0 } else { area? };
            area.map(|_| Face { kind, channel: first + kind as usize, per })
        };
        kinds.filter_map(face).collect()
    };
    let mut areas = vec![[None; 3]; scene.groups().len()];
    let mut places = Vec::with_capacity(scene.captors().len() + areas.len());
    for captor in scene.captors() {
        let own = [Channel::Front, Channel::Back, Channel::Absorbed]
            .map(|kind| has(captor, kind).then_some(captor.area));
        for &group in &captor.groups {
            for (sum, area) in areas[group].iter_mut().zip(own) {
                *sum = area.map(|area| sum.unwrap_or(0.0) + area).or(*sum);
            }
        }
        let faces = faces(captor.first_channel, own);
        places.push(Place { captor: Some(&captor.id), group: None, faces });
    }
    for (g, (name, areas)) in scene.groups().iter().zip(areas).enumerate() {
        let faces = faces(scene.first_channel_of_group(g), areas);
        places.push(Place { captor: None, group: Some(name), faces });
    }
    places
}

/// In a band or sum the mean moment and the mean flux, and how they vary.
type Moment = ([f64; 2], Option<[f64; 3]>);

/// The moments of a parameter on a face.
struct Found {
    /// Per band and sum.
    moments: Vec<Moment>,
    /// What one more history might add to the elasticity: few tell little of how much they vary, and
    /// one more, of mean light, might meet the parameter once.
    one_more: f64,
    /// Per band the [gain](Parameter::gains) of the parameter.
    gains: Vec<f64>,
}

impl Found {
    /// Returns the moments of a parameter, which has this index; `None` where none are kept.
    fn of(
        scene: &Scene,
        totals: &Totals,
        (index, parameter): (usize, &Parameter),
        channel: usize,
    ) -> Option<Self> {
        let moments = totals.moments(index, channel)?.collect();
        let histories = totals.misses_of(channel);
        let one_more = if histories > 0 { 1.0 / histories as f64 } else { 0.0 };
        let gains = parameter.gains(|m| &scene.materials()[m].material, scene.bands().len());
        Some(Self { moments, one_more, gains })
    }

    /// Returns the moment of a sum over bands, of which the mean is `moment` without gains.
    fn gained(&self, moment: f64, sum: &BandSum) -> f64 {
        let more = |(band, weight): (usize, f64)| {
            weight * (self.gains[band] - 1.0) * self.moments[band].0[0]
        };
        moment + sum.weighted().map(more).sum::<f64>()
    }

    /// Returns the gain of the error in a sum over bands, in which those bands count the more whose light
    /// has met the parameter more often.
    fn gain_of(&self, sum: &BandSum) -> f64 {
        let met = |(band, weight): (usize, f64)| weight * self.moments[band].0[0].abs();
        let all: f64 = sum.weighted().map(met).sum();
        let gained: f64 = sum.weighted().map(|of| self.gains[of.0] * met(of)).sum();
        if all > 0.0 { gained / all } else { 1.0 }
    }

    /// Returns, for errors, the factors on the moment and on the light of the numerator of a ratio, and on
    /// those of its denominator.
    fn gains_of(&self, ratio: &BandRatio) -> [f64; 4] {
        [self.gain_of(&ratio.numerator), 1.0, self.gain_of(&ratio.denominator), 1.0]
    }

    /// Returns the elasticity and its standard error in each band and sum.
    fn elasticities(&self, scene: &Scene) -> (Vec<Option<f64>>, Vec<Option<f64>>) {
        let bands = self.gains.iter().zip(&self.moments).map(|(gain, of)| (gain * of.0[0], *gain));
        let moments = self.moments.iter().skip(self.gains.len()).zip(scene.sums());
        let sums = moments.map(|(of, sum)| (self.gained(of.0[0], sum), self.gain_of(sum)));
        let gained = bands.chain(sums);
        let each = self.moments.iter().zip(gained).map(|(&(means, covariance), (moment, gain))| {
            let (_, error) = ratio(means, covariance)?;
            let (elasticity, _) = ratio([moment, means[1]], None)?;
            Some((elasticity, error.map(|error| gain * error.hypot(self.one_more))))
        });
        each.map(|of| (of.map(|of| of.0), of.and_then(|of| of.1))).unzip()
    }

    /// Returns the derivative and its standard error in each band and sum, where a flux is divided by
    /// `per`.
    fn derivatives(
        &self,
        scene: &Scene,
        values: &[f64],
        per: f64,
    ) -> (Vec<Option<f64>>, Vec<Option<f64>>) {
        let each = self.moments.iter().map(|&([moment, light], covariance)| {
            let error = |variance: f64| variance.max(0.0).sqrt().hypot(self.one_more * light) / per;
            (moment / per, covariance.map(|[variance, ..]| error(variance)))
        });
        let moments: Vec<(f64, Option<f64>)> = each.collect();
        derivatives(scene, values, &moments).into_iter().unzip()
    }
}

/// Returns how a place depends on a parameter; `None` where its light has never met the parameter.
fn sensitivity(
    simulation: &Simulation,
    place: &Place,
    face: &Face,
    (index, parameter): (usize, &Parameter),
) -> Option<SensitivityResult> {
    let (scene, totals) = (simulation.scene(), simulation.totals());
    let found = Found::of(scene, totals, (index, parameter), face.channel)?;
    if found.moments.iter().all(|([moment, _], _)| *moment == 0.0) {
        return None;
    }
    let (elasticity, elasticity_se) = found.elasticities(scene);
    let (derivative, derivative_se) = found.derivatives(scene, &parameter.values, face.per);
    let ratios = of_ratios(simulation, face, (index, parameter), &found);
    let (captor, group) = (place.captor.map(str::to_string), place.group.map(str::to_string));
    let row = SensitivityResult {
        captor,
        group,
        face: name_of(face.kind),
        parameter: parameter.name.clone(),
        light: light_of(scene, parameter),
        elasticity,
        elasticity_se,
        derivative,
        derivative_se,
        ratios,
        by_light: None,
    };
    let kept = totals.parts().first().is_some_and(|part| part.keeps_moments_of(face.channel));
    Some(match (kept, &parameter.factor) {
        (false, _) => row,
        (true, Factor::Light(light)) => {
            let name = scene.lights()[*light].name.clone();
            let by_light = Some([(name, LightSensitivity::of_own(&row))].into());
            SensitivityResult { by_light, ..row }
        }
        (true, Factor::Material { .. }) => {
            let parts = scene.lights().iter().zip(totals.parts());
            let each = parts.filter_map(|(light, part)| {
                let of = LightSensitivity::of_part(scene, part, face, (index, parameter))?;
                Some((light.name.clone(), of))
            });
            SensitivityResult { by_light: Some(each.collect()), ..row }
        }
    })
}

impl LightSensitivity {
    /// Returns how the light of a lamp depends on its own power, from how all light depends on it.
    fn of_own(row: &SensitivityResult) -> Self {
        let met = row.elasticity.iter().map(|of| of.filter(|elasticity| *elasticity > 0.0));
        let all = |value: f64| met.clone().map(|of| of.map(|_| value)).collect();
        Self {
            elasticity: all(1.0),
            elasticity_se: all(0.0),
            covariance: all(0.0),
            derivative: row.derivative.clone(),
            derivative_se: row.derivative_se.clone(),
            ratio_covariances: None,
        }
    }

    /// Returns how the light of a lamp, of which these are the totals, depends on a parameter of a
    /// material; `None` where none of it arrives.
    fn of_part(
        scene: &Scene,
        part: &Totals,
        face: &Face,
        (index, parameter): (usize, &Parameter),
    ) -> Option<Self> {
        let found = Found::of(scene, part, (index, parameter), face.channel)?;
        if found.moments.iter().all(|([_, light], _)| *light == 0.0) {
            return None;
        }
        let (elasticity, elasticity_se) = found.elasticities(scene);
        let (derivative, derivative_se) = found.derivatives(scene, &parameter.values, face.per);
        let gains = found.gains.iter().copied();
        let gains = gains.chain(scene.sums().iter().map(|sum| found.gain_of(sum)));
        let covariance = |(&([moment, light], covariance), gain): (&Moment, f64)| {
            let [_, both, of_light] = covariance.filter(|_| light > 0.0)?;
            Some(gain * (both - moment / light * of_light) / light)
        };
        let covariance = found.moments.iter().zip(gains).map(covariance).collect();
        let (fours, batches) = part.ratio_moments(scene, index, face.channel)?;
        let of_ratios = fours.iter().zip(scene.ratios()).map(|(four, ratio)| {
            let [_, over, _, under] = four.means(batches);
            let mut covariances = four.covariances(batches)?;
            // the variances of both moments
            covariances[0] += (found.one_more * over).powi(2);
            covariances[7] += (found.one_more * under).powi(2);
            Some(scaled_covariances(found.gains_of(ratio), &covariances))
        });
        Some(Self {
            elasticity,
            elasticity_se,
            covariance,
            derivative,
            derivative_se,
            ratio_covariances: (!scene.ratios().is_empty()).then(|| of_ratios.collect()),
        })
    }
}

/// Returns the name of the light of a parameter. A light without one goes by its number, as
/// `light0`.
fn light_of(scene: &Scene, parameter: &Parameter) -> Option<String> {
    let Factor::Light(light) = parameter.factor else { return None };
    let name = &scene.lights()[light].name;
    let number = parameter.name.strip_prefix("/lights/")?.split('/').next()?;
    (name.strip_prefix("light") != Some(number)).then(|| name.clone())
}

/// Returns how the ratios of a face depend on a parameter, of which these moments were found; `None`
/// if the scene has none.
fn of_ratios(
    simulation: &Simulation,
    face: &Face,
    (index, parameter): (usize, &Parameter),
    found: &Found,
) -> Option<RatioSensitivity> {
    let (scene, totals) = (simulation.scene(), simulation.totals());
    let (fours, batches) = totals.ratio_moments(scene, index, face.channel)?;
    if scene.ratios().is_empty() {
        return None;
    }
    let values = &parameter.values;
    let each = scene.ratios().iter().zip(fours).map(|(ratio, four)| {
        let gains = found.gains_of(ratio);
        let Some((_, error)) = difference_of_ratios(&four.scaled(gains), batches) else {
            return [None; 4];
        };
        let error = error.map(|error| error.hypot(gains[0].max(gains[2]) * found.one_more));
        // each band has a value of the parameter of its own
        let [met_over, over, met_under, under] = four.means(batches);
        let elasticity = found.gained(met_over, &ratio.numerator) / over
            - found.gained(met_under, &ratio.denominator) / under;
        let slope = |sum: &BandSum| {
            let each = sum.weighted().filter(|(_, weight)| *weight != 0.0).map(|(b, weight)| {
                let value = values.get(b).copied().filter(|value| *value != 0.0)?;
                Some(weight * found.moments[b].0[0] / value)
            });
            each.sum::<Option<f64>>()
        };
        let both = slope(&ratio.numerator).zip(slope(&ratio.denominator));
        let derivative = both.map(|(n, d)| (n - over / under * d) / under);
        let value = value_of_all(ratio, values).map(|value| gains[0] * value);
        let derivative_se = error.zip(value).map(|(error, x)| error * (over / under / x).abs());
        [Some(elasticity), error, derivative, derivative.and(derivative_se)]
    });
    let all: Vec<[Option<f64>; 4]> = each.collect();
    let list = |i: usize| all.iter().map(|of| of[i]).collect();
    let (elasticity, elasticity_se) = (list(0), list(1));
    Some(RatioSensitivity {
        elasticity,
        elasticity_se,
        derivative: list(2),
        derivative_se: list(3),
    })
}

/// Returns the value that a parameter has in all bands of a ratio; `None` where they differ.
fn value_of_all(ratio: &BandRatio, values: &[f64]) -> Option<f64> {
    let bands = || ratio.numerator.weighted().chain(ratio.denominator.weighted());
    let mut counted = bands().filter(|(_, weight)| *weight != 0.0).map(|(band, _)| band);
    let first = values.get(counted.next()?).copied()?;
    (first != 0.0 && counted.all(|band| values[band] == first)).then_some(first)
}

/// Returns the derivative by the parameter and its standard error in each band and sum, from the
/// moments: dE / dx = M / x.
fn derivatives(
    scene: &Scene,
    values: &[f64],
    moments: &[(f64, Option<f64>)],
) -> Vec<(Option<f64>, Option<f64>)> {
    let bands = scene.bands().len();
    let of = |band: usize| {
        let value = values.get(band).copied().filter(|value| *value != 0.0)?;
        let (moment, error) = moments[band];
        Some((moment / value, error.map(|error| error / value.abs())))
    };
    let of_sum = |(s, sum): (usize, &BandSum)| {
        let weighted = || sum.weighted().filter(|(_, weight)| *weight != 0.0);
        let each = weighted().map(|(band, weight)| Some(weight * of(band)?.0));
        let total = each.sum::<Option<f64>>()?;
        let first = values[weighted().next()?.0];
        let alike = weighted().all(|(band, _)| values[band] == first);
        let error = moments[bands + s].1.filter(|_| alike).map(|error| error / first.abs());
        Some((total, error))
    };
    let sums = scene.sums().iter().enumerate().map(of_sum);
    let all = (0..bands).map(of).chain(sums);
    all.map(|found| (found.map(|of| of.0), found.and_then(|of| of.1))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// In a sum each band keeps its own gain, also where the moments of bands have opposite signs; the
    /// error has the mean of the gains.
    #[test]
    fn bands_of_a_sum_have_their_own_gains() {
        let moments = [-1.0, 0.5].map(|moment| ([moment, 2.0], None)).to_vec();
        let found = Found { moments, one_more: 0.0, gains: vec![2.5, 1.1] };
        let sum =
            BandSum { name: "both".into(), bands: vec![0, 1], weights: vec![1.0, 2.0], unit: None };
        assert!((found.gained(0.0, &sum) - (-2.5 + 2.0 * 1.1 * 0.5)).abs() < 1e-12);
        assert!((found.gain_of(&sum) - (2.5 + 1.1) / 2.0).abs() < 1e-12);
    }
}
