//! The result of a run: plain data, in the form of the results file. Lengths are metres, fluxes W
//! or umol/s, errors standard errors (1 sigma).
//!
//! `found` makes a result from the sums of a run, `fields` reads one from a file, `spread` adds how
//! evenly a group is lit, `stand` what plants do with the light as a whole, `own` what the registry
//! of quantities alone knows, `row` what it reads, `dli` adds daily light integrals, `warnings`
//! adds warnings, `mix` rescales lamps, `calibrated` adds the errors of a calibration, and
//! `validate` checks results that were read from a file.

mod calibrated;
mod dli;
mod electricity;
mod fields;
mod found;
mod mix;
mod of_lights;
mod of_scene;
mod own;
mod planes;
mod ratios;
mod row;
mod sensitivity;
mod settings;
mod spread;
mod stand;
mod uncertain;
pub mod validate;
mod warnings;

pub use found::{band_results, light_name, light_word};
pub use spread::Spread;

use std::{
    borrow::Cow,
    ops::{Deref, DerefMut},
};

use indexmap::IndexMap;
use schemars::JsonSchema;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use smallvec::SmallVec;

use phylux_core::{
    math::units::UnitNames,
    transport::settings::{Estimator, Guiding},
};

pub use calibrated::FactorErrors;
pub use electricity::ElectricityRow;
pub use electricity::{
    Electricity, GroupElectricity, LampElectricity, PerKwh, PlaneElectricity, Share, Shares,
};
pub use mix::Factor;
pub use of_lights::OfLights;
pub use own::Own;
pub use ratios::{RatioResult, Ratios};
pub use row::Row;
pub use sensitivity::{
    Dependent, LightNames, LightSensitivity, RatioSensitivity, SensitivityResult,
};
pub use settings::RunSettings;
pub use spread::{Evenness, Uniformity};
pub use stand::{CanopyResult, LayerResult};
pub use uncertain::{BudgetResult, Deviations, InputResult, UncertainInput};
pub use warnings::{FEW_HISTORIES, Warning};

/// A value for each light by the light's name, in the order of the scene.
pub type ByLight<T> = IndexMap<String, T>;

/// A value for each band, then for each sum over bands. That of a single band needs no memory of its own:
/// results by light have millions of these lists.
pub type PerBand<T> = SmallVec<[T; 1]>;

/// Version of the format of results. It increases when a program that reads the version before
/// would misread them.
pub const FORMAT: u32 = 1;

/// The results of one run, as they are written to JSON.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct RunResult {
    /// How the results were made. Its fields are also those of the results, as in `results.seed`.
    #[serde(flatten)]
    pub provenance: Provenance,
    /// Names of the units.
    pub unit: UnitNames,
    /// Length of the period, h, whose mean the daylight is; absent for an instant.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub period_h: Option<f64>,
    /// The bands, then the sums over bands, to which the entries of every array belong.
    pub bands: Vec<BandResult>,
    /// Ratios of sums over bands, to which the entries of `ratios` of faces belong; absent where
    /// the scene has none.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub ratios: Vec<RatioResult>,
    /// The energy balance.
    pub energy: Energy,
    /// What the light costs, and how complete and accurate the results are.
    #[serde(flatten)]
    pub account: Account,
    /// One entry per captor.
    pub captors: Vec<CaptorResult>,
    /// One entry per group of captors.
    pub groups: Vec<GroupResult>,
    /// What goes beyond the light on captors and groups.
    #[serde(flatten)]
    pub extras: Extras,
}

/// How results were made: by which program, of which scene, with which settings.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct Provenance {
    /// Version of the format: 1; 0 where the file does not say.
    #[serde(default)]
    pub format: u32,
    /// Version of phylux that wrote the results.
    pub phylux: String,
    /// Name of the scene.
    pub scene: String,
    /// [`Scene::digest`](phylux_core::scene::Scene::digest) of the scene: the same for the same scene, whether
    /// it comes from files or from memory.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub scene_hash: String,
    /// Seed of the random streams.
    pub seed: u64,
    /// Number of photons traced, or of paths from all faces.
    pub photons: u64,
    /// For complete paths: the number of photons beside them; else absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub photons_beside: Option<u64>,
    /// Number of batches, from whose spread the standard errors come.
    #[serde(rename = "blocks")]
    pub batches: u64,
    /// The estimator: photons, paths or complete paths.
    pub estimator: Estimator,
    /// The guiding of photons to virtual captors; absent where there was none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub guiding: Option<Guiding>,
    /// Whether lamps were not guided, because too few pilot photons found light that matters.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub starved: bool,
    /// The reason for the estimator, where a trial has chosen it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub chosen: Option<String>,
    /// In a sweep, where runs that differ in reflectances and transmittances share their histories: how
    /// much one is worth here, relative to what it is worth in the scene in which it was traced, the
    /// brightest of these runs, in [0.1, 1]; in the median over captors.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub shared: Option<f64>,
    /// In a mix: factors on the powers that the lights had in the run, each one number for all
    /// bands or a list with one for each band; lights that are not named have the factor 1.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mixed: Option<ByLight<Factor>>,
    /// Whether the lights have factors of a calibration, and standard errors include theirs.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub calibrated: bool,
    /// The settings that decide the numbers.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub settings: Option<RunSettings>,
    /// What a user should know before trusting the result, one sentence each.
    #[serde(default)]
    pub warnings: Vec<String>,
}

/// What the light of a run costs, and how complete and accurate its results are.
#[derive(Clone, Debug, Default, Serialize, JsonSchema)]
pub struct Account {
    /// What the light costs and where it goes, where the scene has `watts` of lights.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub electricity: Option<Electricity>,
    /// For paths: about which fraction of the flux on all captors together they cannot find (light
    /// of points and lines by way of mirrors or refraction, and light of the sun by way of more
    /// than one flat mirror), per band, in [0, 1]. Absent where there can be none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub unseen: Option<Vec<f64>>,
    /// About the standard error of it, by the number of photons that found such light.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub unseen_se: Option<Vec<f64>>,
    /// For paths: the fraction of them that the length limits cut off, in [0, 1]; light that they
    /// could still have found is missing. Absent where there is none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cut_off: Option<f64>,
    /// Whether the tolerance is met, for a run that was to go on until it is.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tolerance: Option<ToleranceResult>,
    /// The photon map that the k-nearest estimates were made from.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub map: Option<MapResult>,
}

/// What results have beyond the light on captors and groups.
#[derive(Clone, Debug, Default, Serialize, JsonSchema)]
pub struct Extras {
    /// What the surface captors absorbed in each layer, from the lowest up; absent unless the scene
    /// asks for layers.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub layers: Option<Vec<LayerResult>>,
    /// How much captors and groups depend on materials and lights; absent unless the scene asks for it.
    /// What light has never met is left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sensitivity: Option<Vec<SensitivityResult>>,
    /// How uncertain groups are (captors, where the scene has no groups) because inputs are, and which
    /// inputs make most of it; absent unless the scene says how uncertain inputs are.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub budget: Option<Vec<BudgetResult>>,
    /// The uncertain inputs, where results are split by light.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub uncertain: Option<Vec<UncertainInput>>,
    /// Where the light of sun and sky went; absent unless the scene repeats along x and y, has no
    /// lamp, and was traced by photons.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub canopy: Option<CanopyResult>,
    /// In the files of a sweep, where they were read: the kinds of the warnings.
    #[serde(default, skip_serializing)]
    #[schemars(skip)]
    pub warning_kinds: Option<Vec<String>>,
}

impl Deref for RunResult {
    type Target = Provenance;

    fn deref(&self) -> &Provenance {
        &self.provenance
    }
}

impl DerefMut for RunResult {
    fn deref_mut(&mut self) -> &mut Provenance {
        &mut self.provenance
    }
}

/// A band, or a sum over bands.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct BandResult {
    /// Unique name of the band or sum.
    pub name: String,
    /// Lower end of the band, nm.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub from_nm: Option<f64>,
    /// Upper end of the band, nm.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub to_nm: Option<f64>,
    /// Names of the bands that a sum adds up; absent for bands.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sum_of: Option<Vec<String>>,
    /// Weights of these bands; absent where each counts as it is.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub weights: Option<Vec<f64>>,
    /// Units of a sum that is not in those of the bands.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub unit: Option<SumUnit>,
}

/// Units of a sum over bands that is not measured in those of the bands.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct SumUnit {
    /// Flux.
    pub flux: Cow<'static, str>,
    /// Flux per area.
    pub irradiance: Cow<'static, str>,
}

/// The energy balance per band: emitted = absorbed + escaped + lost, plus `chance` where photons
/// were split or ended. For paths only `power` is known; the other entries are null or absent.
#[derive(Clone, Debug, Default, Serialize, Deserialize, JsonSchema)]
pub struct Energy {
    /// Nominal power of all lights, W (or umol/s).
    pub power: Vec<f64>,
    /// Power that the lights emitted per band, W (or umol/s).
    #[schemars(with = "Option<Vec<f64>>")]
    #[serde(with = "or_null")]
    pub emitted: Vec<f64>,
    /// Power that surfaces absorbed per band, in the same unit.
    #[schemars(with = "Option<Vec<f64>>")]
    #[serde(with = "or_null")]
    pub absorbed: Vec<f64>,
    /// Power that left the scene per band, in the same unit.
    #[schemars(with = "Option<Vec<f64>>")]
    #[serde(with = "or_null")]
    pub escaped: Vec<f64>,
    /// The part of `escaped` that met no surface, where light comes from infinitely far away.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub missed: Vec<f64>,
    /// Power per band of photons that were cut off by the limits on path length.
    #[schemars(with = "Option<Vec<f64>>")]
    #[serde(with = "or_null")]
    pub lost: Vec<f64>,
    /// Where photons were split or ended depending on how much light at a place matters to the
    /// captors: the power that this took, less the power that it gave, per band; 0 on average.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub chance: Option<Vec<f64>>,
    /// Standard error of the value above; null where there was one batch.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub chance_se: Option<Vec<Option<f64>>>,
    /// Power that the surfaces of each material absorbed per band.
    pub absorbed_by: Option<IndexMap<String, Vec<f64>>>,
    /// The same balance for each light, where results are kept by light.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub by_light: Option<ByLight<Energy>>,
}

/// Reads and writes a missing list as null.
mod or_null {
    use super::*;

    pub fn serialize<S: Serializer>(values: &[f64], serializer: S) -> Result<S::Ok, S::Error> {
        (!values.is_empty()).then_some(values).serialize(serializer)
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<f64>, D::Error> {
        Ok(Option::deserialize(deserializer)?.unwrap_or_default())
    }
}

/// Accuracy of a run compared with the tolerance that was asked for.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct ToleranceResult {
    /// The largest relative standard error that was asked for, in (0, 1).
    pub asked: f64,
    /// Whether every value meets the tolerance, in every band that carries power, or is dark.
    pub met: bool,
    /// The value that is farthest from the tolerance; null where there is none.
    pub worst: Option<WorstResult>,
    /// Values that were left out because hardly any light reaches the captor.
    pub dark: Vec<DarkResult>,
}

/// The value of a run that is farthest from its tolerance.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct WorstResult {
    /// Id of the captor, or name of the group.
    pub captor: String,
    /// Whether it is a group; absent where it is a captor, which may have the name of a group.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub group: bool,
    /// `front`, `back` or `absorbed`.
    pub face: Cow<'static, str>,
    /// Name of the band or sum.
    pub band: String,
    /// Relative standard error; null where nothing arrived.
    pub relative_error: Option<f64>,
    /// Number of batches that found light there. With fewer than 30 the standard error cannot be
    /// trusted, and the tolerance is not met.
    #[serde(rename = "blocks_with_light")]
    pub batches_with_light: u64,
}

/// A face that hardly any light reaches, in a band.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct DarkResult {
    /// Id of the captor, or name of the group.
    pub captor: String,
    /// Whether it is a group; absent where it is a captor, which may have the name of a group.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub group: bool,
    /// `front`, `back` or `absorbed`.
    pub face: Cow<'static, str>,
    /// Name of the band or sum.
    pub band: String,
    /// Upper bound of the irradiance with 95 % confidence.
    pub below: f64,
}

/// The photon map that k-nearest estimates were made from.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct MapResult {
    /// Number of arrivals stored.
    pub arrivals: u64,
    /// Number of histories, counted from the first, whose arrivals are all in the map.
    pub photons: u64,
}

/// Light that one captor received.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct CaptorResult {
    /// Unique name of the captor.
    pub id: String,
    /// `virtual` or `surface`.
    pub kind: Cow<'static, str>,
    /// One-sided area, m2.
    pub area: f64,
    /// Area centroid, m.
    pub center: [f64; 3],
    /// Area-weighted mean normal; zeros where the normals cancel.
    pub normal: [f64; 3],
    /// Light that arrived against the normal.
    pub front: FaceResult,
    /// Light that arrived along the normal.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub back: Option<FaceResult>,
    /// What it absorbed, and more.
    #[serde(flatten)]
    pub whole: Whole,
    /// Names of the groups that the captor belongs to, where results are kept by light.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub groups: Option<Vec<String>>,
}

/// Light that a group of captors received together.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct GroupResult {
    /// Unique name of the group.
    pub id: String,
    /// Number of captors.
    pub captors: usize,
    /// Sum of the captors' one-sided areas, m2.
    pub area: f64,
    /// Light that arrived against the normals; the irradiance is the mean over the area.
    pub front: FaceResult,
    /// Light that arrived along the normals, on those captors that count it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub back: Option<FaceResult>,
    /// What its surfaces absorbed, and more.
    #[serde(flatten)]
    pub whole: Whole,
}

/// What is true of a captor or group as a whole, whichever face its light arrived on.
#[derive(Clone, Debug, Default, Serialize, Deserialize, JsonSchema)]
pub struct Whole {
    /// Power absorbed by the surfaces, per band.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub absorbed: Option<PerBand<f64>>,
    /// Standard error of the value above; null where nothing arrived or there was one batch.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub absorbed_se: Option<PerBand<Option<f64>>>,
    /// Standard deviation of it by inputs that are uncertain, where the scene has any.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub absorbed_model_se: Option<Vec<f64>>,
    /// Power absorbed of each light, where results are kept by light.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub by_light: Option<OfLights<Absorbed>>,
    /// Quantities that are known by their names alone.
    #[serde(flatten)]
    pub own: Own,
    /// What the surfaces absorbed of the light on each face, where the scene asks for it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub absorbed_by_face: Option<Box<AbsorbedByFace>>,
    /// Ratios of the power that the surfaces absorbed, where the scene asks for ratios.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub absorbed_ratios: Option<Box<Ratios>>,
}

/// Power that a captor absorbed of one light.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct Absorbed {
    /// Power, per band.
    pub absorbed: PerBand<f64>,
    /// Standard error of the value above; null where nothing arrived or there was one batch.
    pub absorbed_se: PerBand<Option<f64>>,
    /// The parts of it by face, where the scene asks for them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub absorbed_by_face: Option<Box<AbsorbedByFace>>,
    /// Ratios of this power, where the scene asks for ratios.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub absorbed_ratios: Option<Box<Ratios>>,
}

/// Power that surfaces absorbed of the light on each face, per band; both add up to what they
/// absorbed.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct AbsorbedByFace {
    /// Of the light that arrived on the front.
    pub front: Vec<f64>,
    /// Standard error of the value above; null where nothing arrived or there was one batch.
    pub front_se: Vec<Option<f64>>,
    /// Of the light that arrived on the back.
    pub back: Vec<f64>,
    /// Standard error of the value above.
    pub back_se: Vec<Option<f64>>,
}

impl RunResult {
    /// Returns the units of flux and irradiance of a band or sum.
    pub fn units(&self, band: usize) -> [&str; 2] {
        match self.bands.get(band).and_then(|band| band.unit.as_ref()) {
            Some(unit) => [&unit.flux, &unit.irradiance],
            None => [&self.unit.flux, &self.unit.irradiance],
        }
    }

    /// Returns the bands without the sums over bands, which come after them.
    pub fn own_bands(&self) -> &[BandResult] {
        &self.bands[..self.bands.iter().filter(|band| band.sum_of.is_none()).count()]
    }
}

/// The faces and the whole of a captor or group, to change them.
type Parts<'a> = ([Option<&'a mut FaceResult>; 2], &'a mut Whole);

impl RunResult {
    /// Returns the parts of all captors, then of all groups.
    fn parts_mut(&mut self) -> impl Iterator<Item = Parts<'_>> {
        let captors = self.captors.iter_mut().map(CaptorResult::parts_mut);
        captors.chain(self.groups.iter_mut().map(GroupResult::parts_mut))
    }

    /// Returns the parts of the captor or, after all captors, of the group at this place.
    fn part_mut(&mut self, place: usize) -> Parts<'_> {
        match place.checked_sub(self.captors.len()) {
            None => self.captors[place].parts_mut(),
            Some(group) => self.groups[group].parts_mut(),
        }
    }
}

impl CaptorResult {
    /// Returns the front face and, for two-sided captors, the back face.
    pub fn faces(&self) -> impl Iterator<Item = &FaceResult> {
        std::iter::once(&self.front).chain(&self.back)
    }

    fn parts_mut(&mut self) -> Parts<'_> {
        ([Some(&mut self.front), self.back.as_mut()], &mut self.whole)
    }

    /// Returns its row in the table of results.
    pub fn row(&self) -> Row<'_> {
        self.whole.row(self.area, [Some(&self.front), self.back.as_ref()])
    }
}

impl GroupResult {
    fn parts_mut(&mut self) -> Parts<'_> {
        ([Some(&mut self.front), self.back.as_mut()], &mut self.whole)
    }

    /// Returns its row in the table of results.
    pub fn row(&self) -> Row<'_> {
        self.whole.row(self.area, [Some(&self.front), self.back.as_ref()])
    }
}

impl Deref for CaptorResult {
    type Target = Whole;

    fn deref(&self) -> &Whole {
        &self.whole
    }
}

impl Deref for GroupResult {
    type Target = Whole;

    fn deref(&self) -> &Whole {
        &self.whole
    }
}

/// Light that arrived on one face of a captor. There is one for each light of each captor, where
/// results are kept by light: what these do not have takes a pointer's place at most.
#[derive(Clone, Debug, Default, Serialize, Deserialize, JsonSchema)]
pub struct FaceResult {
    /// Number of photons counted here, or of paths that started here.
    pub photons: u64,
    /// Number of histories to which the photons belong: of emitted photons that came here, however
    /// often and in however many flights. Not known for groups.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub histories: Option<u64>,
    /// Power that arrived, per band.
    pub flux: PerBand<f64>,
    /// Standard error of the value above; null where nothing arrived or there was one batch.
    pub flux_se: PerBand<Option<f64>>,
    /// Standard deviation of the flux by inputs that are uncertain, where the scene has any.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub flux_model_se: Option<Box<Deviations>>,
    /// Flux per area.
    pub irradiance: PerBand<f64>,
    /// Standard error of the value above; null where nothing arrived or there was one batch.
    pub irradiance_se: PerBand<Option<f64>>,
    /// Standard deviation of the irradiance by inputs that are uncertain, where the scene has any.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub irradiance_model_se: Option<Box<Deviations>>,
    /// For a scene in umol/s over a period: the daily light integral, averaged over its days,
    /// mol/m2/d. Null for bands and sums that are not within 400 to 700 nm.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub dli: Option<Box<PerBand<Option<f64>>>>,
    /// Standard error of the value above; null where nothing arrived or there was one batch.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub dli_se: Option<Box<PerBand<Option<f64>>>>,
    /// Ratios of the light that arrived, where the scene asks for ratios.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ratios: Option<Box<Ratios>>,
    /// Whether value and standard error may be far too small: because few paths found most of the
    /// light, because paths missed light that photons found here, or because fewer than 30
    /// histories of photons came here.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub few_paths: bool,
    /// With complete paths: whether no paths start from here, because all photons beside them count
    /// here. Always false for groups.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub by_photons: bool,
    /// For a group of several captors: the smallest irradiance of its captors, per band.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub min: Option<Box<PerBand<f64>>>,
    /// The largest irradiance of its captors, per band; noise drives smallest and largest apart.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max: Option<Box<PerBand<f64>>>,
    /// For a group of several captors: how evenly it is lit.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub uniformity: Option<Box<Uniformity>>,
    /// The k-nearest estimate. Null where nothing arrived, for paths and in a mix; absent where
    /// none was asked for.
    #[serde(default, skip_serializing_if = "Option::is_none", deserialize_with = "maybe_null")]
    pub knn: Option<Option<Box<NearestResult>>>,
    /// The same values for each light, where results are kept by light.
    #[serde(default, skip_serializing_if = "Option::is_none", deserialize_with = "fitted")]
    pub by_light: Option<Box<OfLights<FaceResult>>>,
}

/// Reads values by light, and leaves no room for more bands.
fn fitted<'de, D: Deserializer<'de>>(
    deserializer: D,
) -> Result<Option<Box<OfLights<FaceResult>>>, D::Error> {
    let mut lights: Option<Box<OfLights<FaceResult>>> = Option::deserialize(deserializer)?;
    for face in lights.iter_mut().flat_map(|lights| lights.values_mut()) {
        [&mut face.flux, &mut face.irradiance].into_iter().for_each(PerBand::shrink_to_fit);
        [&mut face.flux_se, &mut face.irradiance_se].into_iter().for_each(PerBand::shrink_to_fit);
    }
    Ok(lights)
}

/// Distinguishes a value that is null from one that is absent.
fn maybe_null<'de, T: Deserialize<'de>, D: Deserializer<'de>>(
    deserializer: D,
) -> Result<Option<Option<T>>, D::Error> {
    Option::deserialize(deserializer).map(Some)
}

/// The k-nearest estimate at the middle of a captor.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct NearestResult {
    /// Number of photons gathered.
    pub k: usize,
    /// Radius of the gather ball, m.
    pub radius: f64,
    /// Fraction of the captor's area over which the estimate is a mean, in (0, 1]. Near 1 it says
    /// nothing about the middle that the flux on the captor does not say better.
    pub coverage: f64,
    /// Irradiance estimate per band.
    pub irradiance: Vec<f64>,
    /// Standard error of the irradiance estimate: of the noise alone, without the bias of a mean
    /// over the disc. Null for fewer than two photons and where nothing arrived.
    pub irradiance_se: Vec<Option<f64>>,
    /// Radiance along the normal of the face, per band; null on transparent and mirror surfaces.
    pub radiance: Option<Vec<f64>>,
    /// Standard error of the radiance estimate, with the same shape.
    pub radiance_se: Option<Vec<Option<f64>>>,
}
