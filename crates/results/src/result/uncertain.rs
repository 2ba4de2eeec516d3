//! How uncertain results are because inputs of the scene are.
//!
//! For light E and inputs x with standard deviations s, to first order (JCGM 100:2008, "Guide to the
//! expression of uncertainty in measurement", 5.1.2 and 5.2.2),
//!
//! model_se^2 = sum over sets (sum over the inputs of a set dE/dx s)^2,
//!
//! where the inputs of a set vary together, and the sets independently. An input varies in all bands
//! together, so that the parts of a sum over bands add up before they are squared.

use std::{borrow::Cow, ops::Deref};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{
    RunResult,
    sensitivity::{Face, Place, places},
};
use phylux_core::{
    math::stats::is_possible,
    scene::{
        captor::Channel,
        world::{BandSum, Scene},
    },
    transport::{simulate::Simulation, tally::Totals},
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

/// The uncertain inputs of a scene.
struct Inputs<'a> {
    scene: &'a Scene,
    totals: &'a Totals,
    /// The parameters of each set.
    sets: Vec<Vec<usize>>,
}

/// How much a quantity varies with each set of inputs.
type Varies = Vec<f64>;

impl<'a> Inputs<'a> {
    /// Returns the uncertain inputs of a run; `None` if there are none.
    fn of(simulation: &'a Simulation) -> Option<Self> {
        let (scene, totals) = (simulation.scene(), simulation.totals());
        let parameters = scene.parameters().all();
        let mut sets: Vec<(usize, Vec<usize>)> = Vec::new();
        for (index, parameter) in parameters.iter().enumerate() {
            let Some(uncertainty) = &parameter.uncertainty else { continue };
            match sets.iter_mut().find(|(set, _)| *set == uncertainty.set) {
                Some((_, members)) => members.push(index),
                None => sets.push((uncertainty.set, vec![index])),
            }
        }
        let sets: Vec<_> = sets.into_iter().map(|(_, members)| members).collect();
        (!sets.is_empty()).then_some(Self { scene, totals, sets })
    }

    /// Returns the names of the inputs of a set.
    fn name(&self, set: usize) -> String {
        let all = self.scene.parameters().all();
        let names = self.sets[set].iter().map(|&index| &*all[index].name);
        names.collect::<Vec<_>>().join(", ")
    }

    /// Returns how much the flux in a channel varies with each set in each band, and the standard
    /// error of that; `None` if no moments are kept there.
    fn by_set(&self, channel: usize) -> Option<Vec<Vec<[f64; 2]>>> {
        let bands = self.scene.bands().len();
        let mut sets = Vec::with_capacity(self.sets.len());
        for members in &self.sets {
            let mut sums = vec![[0.0; 2]; bands];
            for &index in members {
                let moments = self.totals.moments(self.scene, index, channel)?;
                let uncertainty = self.scene.parameters().all()[index].uncertainty.as_ref()?;
                for (sum, (([moment, _], covariance), deviation)) in
                    sums.iter_mut().zip(moments.zip(&uncertainty.deviations))
                {
                    let error = covariance.map_or(0.0, |[variance, ..]| variance.max(0.0).sqrt());
                    sum[0] += moment * deviation;
                    sum[1] += error * deviation.abs();
                }
            }
            sets.push(sums);
        }
        Some(sets)
    }

    /// Returns how much each band, sum and ratio of a channel varies with each set; a ratio that is not
    /// known does not vary.
    fn varies(&self, channel: usize) -> Option<Vec<Varies>> {
        let (scene, bands) = (self.scene, self.scene.bands().len());
        let sets = self.by_set(channel)?;
        // the noise of a run is no uncertainty of an input, but makes what varies larger on average
        let of = |weight: &dyn Fn(usize) -> f64| -> Varies {
            let of_set = |set: &Vec<[f64; 2]>| {
                let sum = |i: usize| -> f64 {
                    let weight = |b: usize| if i == 0 { weight(b) } else { weight(b).abs() };
                    (0..bands).map(|b| weight(b) * set[b][i]).sum()
                };
                let [found, noise] = [0, 1].map(sum);
                (found * found - noise * noise).max(0.0).sqrt()
            };
            sets.iter().map(of_set).collect()
        };
        let weights = |sum: &BandSum| {
            let mut weights = vec![0.0; bands];
            sum.weighted().for_each(|(band, weight)| weights[band] = weight);
            weights
        };
        let of_bands = (0..bands).map(|band| of(&|b| if b == band { 1.0 } else { 0.0 }));
        let of_sums = scene.sums().iter().map(|sum| {
            let weights = weights(sum);
            of(&|b| weights[b])
        });
        let means = self.totals.ratios(channel).map(|(means, _)| means);
        let of_ratios = scene.ratios().iter().zip(means).map(|(ratio, [over, under])| {
            // the change of N / D is that of N - N / D of the denominator, divided by D
            let [n, d] = [&ratio.numerator, &ratio.denominator].map(weights);
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

impl RunResult {
    /// Adds how uncertain all values are because inputs are, if the scene states that of any.
    pub(super) fn add_uncertainty(&mut self, simulation: &Simulation) {
        let Some(inputs) = Inputs::of(simulation) else { return };
        let columns = self.bands.len();
        let of_captors = self.captors.len();
        let mut budget = Vec::new();
        for (p, place) in places(simulation.scene()).iter().enumerate() {
            for face in &place.faces {
                let Some(varies) = inputs.varies(face.channel) else { continue };
                let all: Vec<f64> = varies.iter().map(together).collect();
                let (of_bands, of_ratios) = all.split_at(columns);
                let per_area = || of_bands.iter().map(|flux| flux / face.per).collect();
                let boxed = |values: Vec<f64>| Some(Box::new(Deviations(values)));
                let (front, back, whole) = match p < of_captors {
                    true => {
                        let of = &mut self.captors[p];
                        (&mut of.front, &mut of.back, &mut of.whole)
                    }
                    false => {
                        let of = &mut self.groups[p - of_captors];
                        (&mut of.front, &mut of.back, &mut of.whole)
                    }
                };
                let of_face = match face.kind {
                    Channel::Front => Some(front),
                    Channel::Back => back.as_mut(),
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
                if place.group.is_some() || self.groups.is_empty() {
                    budget.extend(self.budget_of(&inputs, place, face, &varies));
                }
            }
        }
        self.budget = Some(budget);
    }

    /// Returns the budget of each band, sum and ratio of a face.
    fn budget_of(
        &self,
        inputs: &Inputs,
        place: &Place,
        face: &Face,
        varies: &[Varies],
    ) -> Vec<BudgetResult> {
        let bands = self.bands.iter().map(|band| (&band.name, face.per));
        let names = bands.chain(self.ratios.iter().map(|ratio| (&ratio.name, 1.0)));
        let of = |((band, per), varies): ((&String, f64), &Varies)| {
            let mut sets: Vec<usize> = (0..varies.len()).filter(|s| varies[*s] > 0.0).collect();
            sets.sort_by(|a, b| varies[*b].total_cmp(&varies[*a]));
            let input =
                |&set: &usize| InputResult { parameter: inputs.name(set), se: varies[set] / per };
            BudgetResult {
                captor: place.captor.map(str::to_string),
                group: place.group.map(str::to_string),
                face: face.name(),
                band: band.clone(),
                model_se: together(varies) / per,
                largest: sets.iter().take(LARGEST).map(input).collect(),
            }
        };
        names.zip(varies).map(of).collect()
    }
}
