//! Results with the values that comparisons and tables need, from this run or from an earlier one
//! that was saved.

use serde::Deserialize;

use crate::{
    math::stats::is_possible,
    results::result::{
        Absorbed, BandResult, ByLight, CaptorResult, Electricity, FaceResult, GroupResult, Ratios,
        Uniformity,
        validate::{are_errors, are_values},
    },
};

/// The part of a results file that comparisons and tables read.
#[derive(Clone, Debug, Deserialize)]
pub struct ResultsFile {
    /// Name of the scene.
    pub scene: String,
    /// Seed of the random streams.
    pub seed: u64,
    /// Number of photons or paths.
    pub photons: u64,
    /// Name of the estimator that made the results.
    pub estimator: String,
    #[serde(default)]
    warnings: Vec<String>,
    #[serde(default)]
    warning_kinds: Option<Vec<String>>,
    /// Names of the units.
    pub(crate) unit: Unit,
    /// Bands and sums over bands.
    pub(crate) bands: Vec<BandResult>,
    /// Ratios of sums over bands.
    #[serde(default)]
    pub(crate) ratios: Vec<Named>,
    /// What the light costs and where it goes.
    #[serde(default)]
    pub(crate) electricity: Option<Electricity>,
    pub(crate) energy: EnergyValues,
    pub(crate) captors: Vec<CaptorValues>,
    pub(crate) groups: Vec<GroupValues>,
}

impl ResultsFile {
    /// Returns the kinds of the warnings. Only results of sweeps hold them; those without a format
    /// version hold them in place of the warnings.
    pub(crate) fn warning_kinds(&self) -> &[String] {
        self.warning_kinds.as_ref().unwrap_or(&self.warnings)
    }

    /// Returns whether every list has an entry for each band, as the lists of a run have, and no
    /// number is so large that sums and squares of such numbers are infinite.
    pub(crate) fn is_valid(&self) -> bool {
        let (bands, ratios) = (self.bands.len(), self.ratios.len());
        let EnergyValues { power, emitted, absorbed, escaped, lost } = &self.energy;
        let known = [emitted, absorbed, escaped, lost].into_iter().flatten();
        let groups = self.groups.iter().map(|group| &group.values);
        known.chain([power]).all(|values| are_values(values, bands))
            && self.electricity.iter().all(|found| found.is_valid(bands))
            && self.captors.iter().chain(groups).all(|captor| captor.is_valid(bands, ratios))
    }
}

impl CaptorValues {
    fn is_valid(&self, bands: usize, ratios: usize) -> bool {
        let mut numbers = self.center.iter().flatten().chain([&self.area]);
        numbers.all(|number| is_possible(*number))
            && std::iter::once(&self.front)
                .chain(&self.back)
                .all(|face| face.is_valid(bands, ratios))
            && self.absorbed_ratios.iter().all(|found| found.is_valid(ratios))
            && self.absorbed.iter().all(|values| are_values(values, bands))
            && self.absorbed_se.iter().all(|errors| are_errors(errors, bands))
            && self.by_light.iter().flat_map(|lights| lights.values()).all(|light| {
                are_values(&light.absorbed, bands) && are_errors(&light.absorbed_se, bands)
            })
    }
}

impl FaceValues {
    fn is_valid(&self, bands: usize, ratios: usize) -> bool {
        let mut values = [&self.irradiance].into_iter().chain(&self.min).chain(&self.max);
        values.all(|values| are_values(values, bands))
            && are_errors(&self.irradiance_se, bands)
            && self.uniformity.iter().all(|even| even.is_valid(bands))
            && self
                .by_light
                .iter()
                .flat_map(|lights| lights.values())
                .all(|l| l.is_valid(bands, ratios))
            && self.ratios.iter().all(|found| found.is_valid(ratios))
    }
}

#[derive(Clone, Debug, PartialEq, Deserialize)]
pub(crate) struct Unit {
    pub flux: String,
    pub irradiance: String,
}

/// A ratio, of which only the name is read.
#[derive(Clone, Debug, Deserialize)]
pub(crate) struct Named {
    pub name: String,
}

/// The energy balance, per band; for paths only the power is known.
#[derive(Clone, Debug, Deserialize)]
pub(crate) struct EnergyValues {
    pub power: Vec<f64>,
    pub emitted: Option<Vec<f64>>,
    pub absorbed: Option<Vec<f64>>,
    pub escaped: Option<Vec<f64>>,
    pub lost: Option<Vec<f64>>,
}

/// Light that a captor received, as read from a file.
#[derive(Clone, Debug, Deserialize)]
pub(crate) struct CaptorValues {
    pub id: String,
    /// Area, m2.
    pub area: f64,
    /// Area centroid, m; groups have none.
    #[serde(default)]
    pub center: Option<[f64; 3]>,
    pub front: FaceValues,
    pub back: Option<FaceValues>,
    pub absorbed: Option<Vec<f64>>,
    pub absorbed_se: Option<Vec<Option<f64>>>,
    #[serde(default)]
    pub absorbed_ratios: Option<Ratios>,
    /// Power absorbed of each light, where results are split by light.
    #[serde(default)]
    pub by_light: Option<ByLight<Absorbed>>,
}

/// Light that a group of captors received, as read from a file.
#[derive(Clone, Debug, Deserialize)]
pub(crate) struct GroupValues {
    pub captors: u64,
    #[serde(flatten)]
    pub values: CaptorValues,
}

/// Light that arrived on one face, as read from a file.
#[derive(Clone, Debug, Deserialize)]
pub(crate) struct FaceValues {
    pub irradiance: Vec<f64>,
    pub irradiance_se: Vec<Option<f64>>,
    pub min: Option<Vec<f64>>,
    pub max: Option<Vec<f64>>,
    pub uniformity: Option<Uniformity>,
    #[serde(default)]
    pub ratios: Option<Ratios>,
    #[serde(default)]
    pub few_paths: bool,
    /// The same values for each light, where results are split by light.
    #[serde(default)]
    pub by_light: Option<ByLight<FaceValues>>,
}

impl From<&CaptorResult> for CaptorValues {
    fn from(captor: &CaptorResult) -> Self {
        Self {
            id: captor.id.clone(),
            area: captor.area,
            center: Some(captor.center),
            front: FaceValues::from(&captor.front),
            back: captor.back.as_ref().map(FaceValues::from),
            absorbed: captor.absorbed.clone(),
            absorbed_se: captor.absorbed_se.clone(),
            absorbed_ratios: captor.absorbed_ratios.clone(),
            by_light: captor.by_light.clone(),
        }
    }
}

impl From<&GroupResult> for GroupValues {
    fn from(group: &GroupResult) -> Self {
        let values = CaptorValues {
            id: group.id.clone(),
            area: group.area,
            center: None,
            front: FaceValues::from(&group.front),
            back: group.back.as_ref().map(FaceValues::from),
            absorbed: group.absorbed.clone(),
            absorbed_se: group.absorbed_se.clone(),
            absorbed_ratios: group.absorbed_ratios.clone(),
            by_light: group.by_light.clone(),
        };
        Self { captors: group.captors as u64, values }
    }
}

impl From<&FaceResult> for FaceValues {
    fn from(face: &FaceResult) -> Self {
        Self {
            irradiance: face.irradiance.clone(),
            irradiance_se: face.irradiance_se.clone(),
            min: face.min.clone(),
            max: face.max.clone(),
            uniformity: face.uniformity.clone(),
            ratios: face.ratios.clone(),
            few_paths: face.few_paths,
            by_light: face.by_light.as_ref().map(|lights| {
                lights.iter().map(|(name, face)| (name.clone(), Self::from(face))).collect()
            }),
        }
    }
}
