//! How uncertain results are because inputs of the scene are.
//!
//! For light E and inputs x with standard deviations s, to first order (JCGM 100:2008, "Guide to the
//! expression of uncertainty in measurement", 5.1.2 and 5.2.2),
//!
//! model_se^2 = sum over sets (sum over the inputs of a set dE/dx s)^2,
//!
//! where the inputs of a set vary together, and the sets independently. An input varies in all bands
//! together, so that the parts of a sum over bands add up before they are squared.

use std::{borrow::Cow, collections::HashMap, ops::Deref};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{
    FaceResult, RatioResult, RunResult,
    sensitivity::{name_of, places},
};
use crate::lists::are_values;
use phylux_core::{
    math::stats::is_possible,
    scene::{
        captor::Channel,
        parameter::{Parameter, Uncertainty},
        world::Scene,
    },
    transport::simulate::Simulation,
};

/// How many inputs a budget names.
const LARGEST: usize = 3;

/// How uncertain the light on a face of a group, or what it absorbs, is because inputs are, and which
/// of these make most of it. Where a scene has no groups, it is of a captor.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct BudgetResult {
    /// Id of the captor; absent where it is a group.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub captor: Option<String>,
    /// Name of the group; absent where it is a captor.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub group: Option<String>,
    /// `front`, `back` or `absorbed`.
    pub face: Cow<'static, str>,
    /// Name of the band, sum or ratio.
    pub band: String,
    /// Standard deviation of the irradiance (of `absorbed`: of the power) or of the ratio by all
    /// uncertain inputs together, in its unit.
    pub model_se: f64,
    /// The up to three inputs, or sets of inputs that vary together, that make most of it, the largest
    /// first.
    pub largest: Vec<InputResult>,
}

/// An uncertain input in a budget.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct InputResult {
    /// The input, as a pointer into the scene file; of a set all, separated by commas.
    pub parameter: String,
    /// Standard deviation that it makes, in the unit of `model_se`.
    pub se: f64,
}

impl BudgetResult {
    /// Returns the id of the captor or the name of the group.
    pub fn of(&self) -> &str {
        self.captor.as_ref().or(self.group.as_ref()).map_or("", String::as_str)
    }

    pub(crate) fn is_valid(&self) -> bool {
        let mut numbers = self.largest.iter().map(|input| input.se).chain([self.model_se]);
        self.captor.is_some() != self.group.is_some() && numbers.all(is_possible)
    }
}

/// Standard deviations of the values of a face by uncertain inputs, per band, then per sum.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(transparent)]
pub struct Deviations(pub Vec<f64>);

impl Deref for Deviations {
    type Target = [f64];

    fn deref(&self) -> &[f64] {
        &self.0
    }
}

/// An uncertain input of the scene, in results that are split by light: a mix needs it.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct UncertainInput {
    /// The input, as a pointer into the scene file.
    pub parameter: String,
    /// Its standard deviation as a share of it, per band. A negative one goes the other way than the
    /// others of its set.
    pub share: Vec<f64>,
    /// Number of its set. Inputs of a set vary together, those of different sets independently.
    pub set: usize,
}

impl UncertainInput {
    pub(crate) fn is_valid(&self, bands: usize) -> bool {
        are_values(&self.share, bands)
    }

    /// Returns those of a scene.
    pub(super) fn all(scene: &Scene) -> Vec<Self> {
        let of = |parameter: &Parameter| {
            let Uncertainty { deviations, set } = parameter.uncertainty.as_ref()?;
            let (parameter, share) = (parameter.name.clone(), deviations.clone());
            Some(Self { parameter, share, set: *set })
        };
        scene.parameters().all().iter().filter_map(of).collect()
    }
}

/// The moment of an input in each band of a place, and its standard error.
pub(super) type Moments = Vec<[f64; 2]>;

/// How much a quantity varies with each set of inputs.
type Varies = Vec<f64>;

/// The uncertain inputs of results, and the sums and ratios that they enter.
pub(super) struct Inputs {
    inputs: Vec<UncertainInput>,
    /// For each set the indices of its inputs.
    sets: Vec<Vec<usize>>,
    bands: usize,
    /// Per sum, the weight of each band.
    sums: Vec<Vec<f64>>,
    ratios: Vec<RatioResult>,
}

impl Inputs {
    /// Arranges the inputs of results; `None` if there are none.
    pub fn new(result: &RunResult, inputs: Vec<UncertainInput>) -> Option<Self> {
        let mut sets: Vec<(usize, Vec<usize>)> = Vec::new();
        for (index, input) in inputs.iter().enumerate() {
            match sets.iter_mut().find(|(set, _)| *set == input.set) {
                Some((_, members)) => members.push(index),
                None => sets.push((input.set, vec![index])),
            }
        }
        let bands = result.own_bands().len();
        let sums = result.bands[bands..].iter().map(|sum| {
            let mut weights = vec![0.0; bands];
            sum.members(&result.bands).for_each(|(band, weight)| weights[band] = weight);
            weights
        });
        let any = !sets.is_empty();
        any.then(|| Self {
            sets: sets.into_iter().map(|(_, members)| members).collect(),
            bands,
            sums: sums.collect(),
            ratios: result.ratios.clone(),
            inputs,
        })
    }

    /// Returns the names of the inputs of a set.
    fn name(&self, set: usize) -> String {
        let names = self.sets[set].iter().map(|&index| &*self.inputs[index].parameter);
        names.collect::<Vec<_>>().join(", ")
    }

    /// Returns how much the flux varies with each set in each band, and the standard error of that;
    /// `None` if the moments of an input are not known.
    fn by_set(&self, moments: &dyn Fn(&str) -> Option<Moments>) -> Option<Vec<Moments>> {
        let of_set = |members: &Vec<usize>| {
            let mut sums = vec![[0.0; 2]; self.bands];
            for input in members.iter().map(|&index| &self.inputs[index]) {
                let found = moments(&input.parameter)?;
                for (sum, ([moment, error], share)) in
                    sums.iter_mut().zip(found.iter().zip(&input.share))
                {
                    sum[0] += moment * share;
                    sum[1] += error * share.abs();
                }
            }
            Some(sums)
        };
        self.sets.iter().map(of_set).collect()
    }

    /// Returns how much each band, sum and ratio of a place varies with each set, from the moments of
    /// each input and from both sums of each ratio; a ratio that is not known does not vary.
    pub fn varies(
        &self,
        moments: &dyn Fn(&str) -> Option<Moments>,
        ratios: impl Iterator<Item = [f64; 2]>,
    ) -> Option<Vec<Varies>> {
        let bands = self.bands;
        let sets = self.by_set(moments)?;
        // the noise of a run is no uncertainty of an input, but makes what varies larger on average
        let of = |weight: &dyn Fn(usize) -> f64| -> Varies {
            let of_set = |set: &Moments| {
                let sum = |i: usize| -> f64 {
                    let weight = |b: usize| if i == 0 { weight(b) } else { weight(b).abs() };
                    (0..bands).map(|b| weight(b) * set[b][i]).sum()
                };
                let [found, noise] = [0, 1].map(sum);
                (found * found - noise * noise).max(0.0).sqrt()
            };
            sets.iter().map(of_set).collect()
        };
        let of_bands = (0..bands).map(|band| of(&|b| if b == band { 1.0 } else { 0.0 }));
        let of_sums = self.sums.iter().map(|weights| of(&|b| weights[b]));
        let of_ratios = self.ratios.iter().zip(ratios).map(|(ratio, [over, under])| {
            // the change of N / D is that of N - N / D of the denominator, divided by D
            let (n, d) = (&ratio.numerator, &ratio.denominator);
            match under > 0.0 {
                true => of(&|b| (n[b] - over / under * d[b]) / under),
                false => vec![0.0; sets.len()],
            }
        });
        Some(of_bands.chain(of_sums).chain(of_ratios).collect())
    }
}

/// Returns the standard deviation by independent inputs.
fn together(varies: &Varies) -> f64 {
    varies.iter().map(|of| of * of).sum::<f64>().sqrt()
}

/// A face of a captor or group of results, or the power that it absorbs.
#[derive(Clone, Copy)]
pub(super) struct Spot {
    /// Index of the captor, or beyond the captors that of the group.
    pub place: usize,
    pub kind: Channel,
    /// What a flux is divided by: the area of a face, m2, and 1 for what is absorbed.
    pub per: f64,
}

impl RunResult {
    /// Adds how uncertain all values are because inputs are, if the scene states that of any.
    pub(super) fn add_uncertainty(&mut self, simulation: &Simulation) {
        let (scene, totals) = (simulation.scene(), simulation.totals());
        let inputs = UncertainInput::all(scene);
        self.extras.uncertain =
            (!inputs.is_empty() && !totals.parts().is_empty()).then(|| inputs.clone());
        let Some(inputs) = Inputs::new(self, inputs) else { return };
        let parameters = scene.parameters().all().iter().enumerate();
        let places_of: HashMap<&str, usize> =
            parameters.map(|(index, parameter)| (parameter.name.as_str(), index)).collect();
        self.extras.budget = Some(Vec::new());
        for (place, of) in places(scene).iter().enumerate() {
            for face in &of.faces {
                let moments = |name: &str| {
                    let found = totals
                        .moments(*places_of.get(name)?, face.channel)?
                        .take(scene.bands().len());
                    let of = |([moment, _], covariance): ([f64; 2], Option<[f64; 3]>)| {
                        let error = |[variance, ..]: [f64; 3]| variance.max(0.0).sqrt();
                        [moment, covariance.map_or(0.0, error)]
                    };
                    Some(found.map(of).collect())
                };
                let ratios = totals.ratios(face.channel).map(|(means, _)| means);
                if let Some(varies) = inputs.varies(&moments, ratios) {
                    let spot = Spot { place, kind: face.kind, per: face.per };
                    self.set_uncertainty(&inputs, spot, &varies);
                }
            }
        }
    }

    /// Takes out on what the results depend, and how uncertain that makes them.
    pub(super) fn forget_dependence(&mut self) {
        (self.extras.sensitivity, self.extras.budget, self.extras.uncertain) = (None, None, None);
        let forget = |face: &mut FaceResult| {
            (face.flux_model_se, face.irradiance_model_se) = (None, None);
            face.ratios.iter_mut().for_each(|ratios| ratios.ratio_model_se = None);
        };
        for (faces, whole) in self.parts_mut() {
            faces.into_iter().flatten().for_each(forget);
            whole.absorbed_model_se = None;
            whole.absorbed_ratios.iter_mut().for_each(|ratios| ratios.ratio_model_se = None);
        }
    }

    /// Sets how uncertain the values of a spot are, per band, sum and ratio.
    pub(super) fn set_uncertainty(&mut self, inputs: &Inputs, spot: Spot, varies: &[Varies]) {
        let all: Vec<f64> = varies.iter().map(together).collect();
        let (of_bands, of_ratios) = all.split_at(self.bands.len());
        let per_area = || of_bands.iter().map(|flux| flux / spot.per).collect();
        let boxed = |values: Vec<f64>| Some(Box::new(Deviations(values)));
        let ([front, back], whole) = self.part_mut(spot.place);
        let of_face = match spot.kind {
            Channel::Front => front,
            Channel::Back => back,
            Channel::Absorbed => None,
        };
        let ratios = match of_face {
            Some(found) => {
                found.flux_model_se = boxed(of_bands.to_vec());
                found.irradiance_model_se = boxed(per_area());
                &mut found.ratios
            }
            None => {
                whole.absorbed_model_se = Some(of_bands.to_vec());
                &mut whole.absorbed_ratios
            }
        };
        if let Some(found) = ratios {
            found.ratio_model_se = boxed(of_ratios.to_vec());
        }
        if spot.place >= self.captors.len() || self.groups.is_empty() {
            let rows = self.budget_of(inputs, spot, varies);
            self.extras.budget.get_or_insert_default().extend(rows);
        }
    }

    /// Returns the budget of each band, sum and ratio of a spot.
    fn budget_of(&self, inputs: &Inputs, spot: Spot, varies: &[Varies]) -> Vec<BudgetResult> {
        let bands = self.bands.iter().map(|band| (&band.name, spot.per));
        let names = bands.chain(self.ratios.iter().map(|ratio| (&ratio.name, 1.0)));
        let group = spot.place.checked_sub(self.captors.len());
        let group = group.map(|group| self.groups[group].id.clone());
        let captor = self.captors.get(spot.place).map(|captor| captor.id.clone());
        let of = |((band, per), varies): ((&String, f64), &Varies)| {
            let mut sets: Vec<usize> = (0..varies.len()).filter(|s| varies[*s] > 0.0).collect();
            sets.sort_by(|a, b| varies[*b].total_cmp(&varies[*a]));
            let input =
                |&set: &usize| InputResult { parameter: inputs.name(set), se: varies[set] / per };
            BudgetResult {
                captor: captor.clone(),
                group: group.clone(),
                face: name_of(spot.kind),
                band: band.clone(),
                model_se: together(varies) / per,
                largest: sets.iter().take(LARGEST).map(input).collect(),
            }
        };
        names.zip(varies).map(of).collect()
    }
}
