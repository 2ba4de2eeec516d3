//! How much results depend on the materials and lights of a scene.

use std::borrow::Cow;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::validate::are_errors;
use phylux_core::{
    math::stats::{error_of_ratio, ratio},
    scene::{
        captor::{CaptorKind, Channel},
        parameter::Parameter,
        world::{BandSum, Scene},
    },
    transport::simulate::Simulation,
};

/// How much the light on a face of a captor or group, or the light that it absorbs, depends on a
/// parameter: a reflectance, a transmittance or the power of a light.
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
    /// By how many per cent the light changes for 1 % more of the parameter, per band, then per sum:
    /// d ln E / d ln x. For light that arrives it is how many times it has met the parameter, on
    /// average. Null where no light arrived.
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
}

impl SensitivityResult {
    /// Returns the id of the captor or the name of the group.
    pub fn of(&self) -> &str {
        self.captor.as_ref().or(self.group.as_ref()).map_or("", String::as_str)
    }

    pub(super) fn is_valid(&self, bands: usize) -> bool {
        let Self { elasticity, elasticity_se, derivative, derivative_se, .. } = self;
        let lists = [elasticity, elasticity_se, derivative, derivative_se];
        self.captor.is_some() != self.group.is_some()
            && lists.into_iter().all(|list| are_errors(list, bands))
    }
}

/// A captor or a group of a run.
struct Place<'a> {
    captor: Option<&'a str>,
    group: Option<&'a str>,
    /// Its first channel.
    first: usize,
    area: f64,
    faces: Vec<Channel>,
}

/// Returns how each captor and group depends on each parameter that its light has met; `None` if the
/// scene does not ask for it.
pub(super) fn sensitivities(simulation: &Simulation) -> Option<Vec<SensitivityResult>> {
    let scene = simulation.scene();
    let parameters = scene.parameters().all();
    if parameters.is_empty() {
        return None;
    }
    let faces = |back: bool, absorbs: bool| {
        let all = [(Channel::Front, true), (Channel::Back, back), (Channel::Absorbed, absorbs)];
        all.into_iter().filter_map(|(face, counts)| counts.then_some(face)).collect()
    };
    let captors = scene.captors().iter().map(|captor| Place {
        captor: Some(&captor.id),
        group: None,
        first: captor.first_channel,
        area: captor.area,
        faces: faces(captor.kind.has_back(), captor.kind == CaptorKind::Surface),
    });
    let mut groups: Vec<Place> = scene
        .groups()
        .iter()
        .enumerate()
        .map(|(g, name)| Place {
            captor: None,
            group: Some(name),
            first: scene.channels() + g * scene.group_channels(),
            area: 0.0,
            faces: Vec::new(),
        })
        .collect();
    let mut kinds = vec![[false; 2]; groups.len()];
    for captor in scene.captors() {
        for &group in &captor.groups {
            groups[group].area += captor.area;
            kinds[group][0] |= captor.kind.has_back();
            kinds[group][1] |= captor.kind == CaptorKind::Surface;
        }
    }
    for (group, [back, absorbs]) in groups.iter_mut().zip(kinds) {
        group.faces = faces(back, absorbs);
    }
    let mut all = Vec::new();
    for place in captors.chain(groups) {
        for &face in &place.faces {
            for (index, parameter) in parameters.iter().enumerate() {
                all.extend(sensitivity(simulation, &place, face, (index, parameter)));
            }
        }
    }
    Some(all)
}

/// Returns how a place depends on a parameter; `None` where its light has never met the parameter.
fn sensitivity(
    simulation: &Simulation,
    place: &Place,
    face: Channel,
    (index, parameter): (usize, &Parameter),
) -> Option<SensitivityResult> {
    let (scene, totals) = (simulation.scene(), simulation.totals());
    let channel = place.first + face as usize;
    let found: Vec<_> = totals.moments(scene, index, channel)?.collect();
    if found.iter().all(|([moment, _], _)| *moment == 0.0) {
        return None;
    }
    let histories = totals.misses_of(channel);
    let elasticities = found.iter().map(|&(means, covariance)| {
        let of = ratio(means, covariance)?;
        let floor = |error: f64| error.max(error_of_ratio(of.0.abs(), error, histories));
        Some((of.0, of.1.map(floor)))
    });
    let (elasticity, elasticity_se) =
        elasticities.map(|of| (of.map(|of| of.0), of.and_then(|of| of.1))).unzip();
    let per = if face == Channel::Absorbed { 1.0 } else { place.area };
    let moments: Vec<(f64, Option<f64>)> = found
        .iter()
        .map(|&([moment, _], covariance)| {
            (moment / per, covariance.map(|[variance, ..]| variance.max(0.0).sqrt() / per))
        })
        .collect();
    let (derivative, derivative_se) =
        derivatives(scene, &parameter.values, &moments).into_iter().unzip();
    let (captor, group) = (place.captor.map(str::to_string), place.group.map(str::to_string));
    let face = match face {
        Channel::Front => "front",
        Channel::Back => "back",
        Channel::Absorbed => "absorbed",
    };
    let parameter = parameter.name.clone();
    let face = face.into();
    Some(SensitivityResult {
        captor,
        group,
        face,
        parameter,
        elasticity,
        elasticity_se,
        derivative,
        derivative_se,
    })
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
