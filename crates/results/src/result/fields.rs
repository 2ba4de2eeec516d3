//! Reads the fields of results and of their flattened parts in one pass over the text. What serde derives for
//! flattened fields would first keep all others as values, unknown ones among them, and know their places no more.

use serde::{Deserialize, Deserializer};

use super::{
    Account, BandResult, BudgetResult, ByLight, CanopyResult, CaptorResult, Electricity, Energy,
    Extras, Factor, GroupResult, LayerResult, MapResult, Provenance, RatioResult, RunResult,
    RunSettings, SensitivityResult, ToleranceResult, UncertainInput,
};
use phylux_core::{
    math::units::UnitNames,
    transport::settings::{Estimator, Guiding},
};

/// The fields of a results file.
#[derive(Deserialize)]
#[serde(rename = "RunResult")]
struct Fields {
    #[serde(default)]
    format: u32,
    phylux: String,
    scene: String,
    #[serde(default)]
    scene_hash: String,
    seed: u64,
    photons: u64,
    photons_beside: Option<u64>,
    #[serde(rename = "blocks")]
    batches: u64,
    estimator: Estimator,
    guiding: Option<Guiding>,
    #[serde(default)]
    starved: bool,
    chosen: Option<String>,
    shared: Option<f64>,
    mixed: Option<ByLight<Factor>>,
    #[serde(default)]
    calibrated: bool,
    settings: Option<RunSettings>,
    #[serde(default)]
    warnings: Vec<String>,
    warning_kinds: Option<Vec<String>>,
    unit: UnitNames,
    period_h: Option<f64>,
    bands: Vec<BandResult>,
    #[serde(default)]
    ratios: Vec<RatioResult>,
    energy: Energy,
    electricity: Option<Electricity>,
    unseen: Option<Vec<f64>>,
    unseen_se: Option<Vec<f64>>,
    cut_off: Option<f64>,
    tolerance: Option<ToleranceResult>,
    map: Option<MapResult>,
    captors: Vec<CaptorResult>,
    groups: Vec<GroupResult>,
    layers: Option<Vec<LayerResult>>,
    sensitivity: Option<Vec<SensitivityResult>>,
    budget: Option<Vec<BudgetResult>>,
    uncertain: Option<Vec<UncertainInput>>,
    canopy: Option<CanopyResult>,
}

impl<'de> Deserialize<'de> for RunResult {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let fields = Fields::deserialize(deserializer)?;
        Ok(Self {
            provenance: Provenance {
                format: fields.format,
                phylux: fields.phylux,
                scene: fields.scene,
                scene_hash: fields.scene_hash,
                seed: fields.seed,
                photons: fields.photons,
                photons_beside: fields.photons_beside,
                batches: fields.batches,
                estimator: fields.estimator,
                guiding: fields.guiding,
                starved: fields.starved,
                chosen: fields.chosen,
                shared: fields.shared,
                mixed: fields.mixed,
                calibrated: fields.calibrated,
                settings: fields.settings,
                warnings: fields.warnings,
            },
            unit: fields.unit,
            period_h: fields.period_h,
            bands: fields.bands,
            ratios: fields.ratios,
            energy: fields.energy,
            account: Account {
                electricity: fields.electricity,
                unseen: fields.unseen,
                unseen_se: fields.unseen_se,
                cut_off: fields.cut_off,
                tolerance: fields.tolerance,
                map: fields.map,
            },
            captors: fields.captors,
            groups: fields.groups,
            extras: Extras {
                layers: fields.layers,
                sensitivity: fields.sensitivity,
                budget: fields.budget,
                uncertain: fields.uncertain,
                canopy: fields.canopy,
                warning_kinds: fields.warning_kinds,
            },
        })
    }
}
