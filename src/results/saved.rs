//! Results as far as comparisons and tables need them, whether of this run or saved by an earlier one.

use serde::Deserialize;

use crate::results::result::{CaptorResult, FaceResult};

/// What comparisons and tables read of a results file.
#[derive(Clone, Debug, Deserialize)]
pub struct ResultsFile {
    /// Name of the scene.
    pub scene: String,
    /// Seed of the random streams.
    pub seed: u64,
    /// How many photons or paths.
    pub photons: u64,
    /// Which of them.
    pub estimator: String,
    /// In a sweep: what kinds of warnings it has.
    #[serde(default)]
    pub(crate) warnings: Vec<String>,
    /// Names of the units.
    pub(crate) unit: Unit,
    /// Bands and sums over bands.
    pub(crate) bands: Vec<Band>,
    pub(crate) energy: EnergyValues,
    pub(crate) captors: Vec<CaptorValues>,
    pub(crate) groups: Vec<GroupValues>,
}

#[derive(Clone, Debug, PartialEq, Deserialize)]
pub(crate) struct Unit {
    pub flux: String,
    pub irradiance: String,
}

#[derive(Clone, Debug, Deserialize)]
pub(crate) struct Band {
    pub name: String,
}

/// The energy balance, per band; paths know the power alone.
#[derive(Clone, Debug, Deserialize)]
pub(crate) struct EnergyValues {
    pub power: Vec<f64>,
    pub emitted: Option<Vec<f64>>,
    pub absorbed: Option<Vec<f64>>,
    pub escaped: Option<Vec<f64>>,
    pub lost: Option<Vec<f64>>,
}

/// What a captor received.
#[derive(Clone, Debug, Deserialize)]
pub(crate) struct CaptorValues {
    pub id: String,
    /// m2
    pub area: f64,
    /// m; groups have none.
    #[serde(default)]
    pub center: Option<[f64; 3]>,
    pub front: FaceValues,
    pub back: Option<FaceValues>,
    pub absorbed: Option<Vec<f64>>,
    pub absorbed_se: Option<Vec<Option<f64>>>,
}

/// What a group received: a captor of captors.
#[derive(Clone, Debug, Deserialize)]
pub(crate) struct GroupValues {
    pub captors: u64,
    #[serde(flatten)]
    pub values: CaptorValues,
}

/// What arrived on one face.
#[derive(Clone, Debug, Deserialize)]
pub(crate) struct FaceValues {
    pub irradiance: Vec<f64>,
    pub irradiance_se: Vec<Option<f64>>,
    pub min: Option<Vec<f64>>,
    pub max: Option<Vec<f64>>,
    #[serde(default)]
    pub few_paths: bool,
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
        }
    }
}

impl From<&FaceResult> for FaceValues {
    fn from(face: &FaceResult) -> Self {
        Self {
            irradiance: face.irradiance.clone(),
            irradiance_se: face.irradiance_se.clone(),
            min: face.min.clone(),
            max: face.max.clone(),
            few_paths: face.few_paths,
        }
    }
}
