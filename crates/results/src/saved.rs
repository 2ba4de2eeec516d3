//! Results with the values that comparisons and tables need, from this run or from an earlier one
//! that was saved.

use serde::Deserialize;

use crate::result::{
    Absorbed, BandResult, BudgetResult, ByLight, CaptorResult, Electricity, FaceResult,
    GroupResult, Ratios, SensitivityResult, Uniformity,
    validate::{are_errors, are_values},
};
use phylux_core::error::{Error, Result};
use phylux_core::math::stats::{Estimate, is_possible};
use phylux_core::scene::captor::{CaptorKind, Channel};
use phylux_core::scene::world::Scene;

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
    /// What guided the photons, if anything did.
    #[serde(default)]
    pub guiding: Option<String>,
    #[serde(default)]
    warnings: Vec<String>,
    #[serde(default)]
    warning_kinds: Option<Vec<String>>,
    /// Names of the units.
    pub unit: Unit,
    /// Bands and sums over bands.
    pub bands: Vec<BandResult>,
    /// Ratios of sums over bands.
    #[serde(default)]
    pub ratios: Vec<Named>,
    /// What the light costs and where it goes.
    #[serde(default)]
    pub electricity: Option<Electricity>,
    pub energy: EnergyValues,
    pub captors: Vec<CaptorValues>,
    pub groups: Vec<GroupValues>,
    /// How much captors and groups depend on materials and lights.
    #[serde(default)]
    pub sensitivity: Option<Vec<SensitivityResult>>,
    /// How uncertain they are because inputs are.
    #[serde(default)]
    pub budget: Option<Vec<BudgetResult>>,
}

impl ResultsFile {
    /// Returns how many of what were traced and with which seed, in words.
    pub fn origin(&self) -> String {
        let Self { photons, estimator, seed, .. } = self;
        let what = if estimator == "complete" { "complete paths" } else { estimator };
        format!("{photons} {what}, seed {seed}")
    }

    /// Returns the kinds of the warnings. Only results of sweeps hold them; those without a format
    /// version hold them in place of the warnings.
    pub fn warning_kinds(&self) -> &[String] {
        self.warning_kinds.as_ref().unwrap_or(&self.warnings)
    }

    /// Returns whether every list has an entry for each band, as the lists of a run have, and no
    /// number is so large that sums and squares of such numbers are infinite.
    pub fn is_valid(&self) -> bool {
        let (bands, ratios) = (self.bands.len(), self.ratios.len());
        let EnergyValues { power, emitted, absorbed, escaped, lost } = &self.energy;
        let known = [emitted, absorbed, escaped, lost].into_iter().flatten();
        let groups = self.groups.iter().map(|group| &group.values);
        known.chain([power]).all(|values| are_values(values, bands))
            && self.electricity.iter().all(|found| found.is_valid(bands))
            && self.captors.iter().chain(groups).all(|captor| captor.is_valid(bands, ratios))
            && self.sensitivity.iter().flatten().all(|found| found.is_valid(bands, ratios))
            && self.budget.iter().flatten().all(BudgetResult::is_valid)
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
pub struct Unit {
    pub flux: String,
    pub irradiance: String,
}

/// A ratio, of which only the name is read.
#[derive(Clone, Debug, Deserialize)]
pub struct Named {
    pub name: String,
}

/// The energy balance, per band; for paths only the power is known.
#[derive(Clone, Debug, Deserialize)]
pub struct EnergyValues {
    pub power: Vec<f64>,
    pub emitted: Option<Vec<f64>>,
    pub absorbed: Option<Vec<f64>>,
    pub escaped: Option<Vec<f64>>,
    pub lost: Option<Vec<f64>>,
}

/// Light that a captor received, as read from a file.
#[derive(Clone, Debug, Deserialize)]
pub struct CaptorValues {
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
pub struct GroupValues {
    pub captors: u64,
    #[serde(flatten)]
    pub values: CaptorValues,
}

/// Light that arrived on one face, as read from a file.
#[derive(Clone, Debug, Deserialize)]
pub struct FaceValues {
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
            uniformity: face.uniformity.as_deref().cloned(),
            ratios: face.ratios.clone(),
            few_paths: face.few_paths,
            by_light: face.by_light.as_ref().map(|lights| {
                lights.iter().map(|(name, face)| (name.clone(), Self::from(face))).collect()
            }),
        }
    }
}
impl CaptorValues {
    /// Returns whether the value of some face rests on few paths.
    pub fn few_paths(&self) -> bool {
        self.front.few_paths || self.back.as_ref().is_some_and(|back| back.few_paths)
    }

    /// Returns the irradiance on a face, or the absorbed power per area, in a band or sum, W/m2 or
    /// umol/m2/s.
    pub fn value(&self, channel: Channel, band: usize) -> Option<Estimate> {
        let face = match channel {
            Channel::Front => &self.front,
            Channel::Back => self.back.as_ref()?,
            Channel::Absorbed => {
                let errors = self.absorbed_se.as_ref()?;
                return per_area(self.absorbed.as_ref()?, errors, band, self.area);
            }
        };
        per_area(&face.irradiance, &face.irradiance_se, band, 1.0)
    }

    /// Returns the same value for the light of one lamp, where results are split by light.
    pub fn of_light(&self, light: usize, channel: Channel, band: usize) -> Option<Estimate> {
        let face = match channel {
            Channel::Front => &self.front,
            Channel::Back => self.back.as_ref()?,
            Channel::Absorbed => {
                let (_, light) = self.by_light.as_ref()?.get_index(light)?;
                return per_area(&light.absorbed, &light.absorbed_se, band, self.area);
            }
        };
        let (_, light) = face.by_light.as_ref()?.get_index(light)?;
        per_area(&light.irradiance, &light.irradiance_se, band, 1.0)
    }
}

fn per_area(values: &[f64], errors: &[Option<f64>], band: usize, area: f64) -> Option<Estimate> {
    let error = errors.get(band).copied().flatten();
    let mean = values.get(band)? / area;
    Some(Estimate { mean, standard_error: error.map(|error| error / area) })
}

impl ResultsFile {
    /// Checks that the results are of this scene. Error: bands, unit or captors differ.
    pub fn check_scene(&self, scene: &Scene) -> Result<()> {
        let refuse = |problem: String| {
            Err(Error::input("results", format!("are of another scene: {problem}"))
                .remedy("name the results of a run of this scene as it is, or leave them out"))
        };
        let mut bands = scene.band_names();
        let mut theirs = self.bands.iter().map(|band| band.name.as_str());
        loop {
            match (bands.next(), theirs.next()) {
                (None, None) => break,
                (ours, theirs) if ours == theirs => {}
                (ours, theirs) => {
                    let name = |band: Option<&str>| {
                        band.map_or("no more".into(), |name| format!("band `{name}`"))
                    };
                    return refuse(format!("they have {}, it has {}", name(theirs), name(ours)));
                }
            }
        }
        let unit = scene.quantity().unit_names().flux;
        if self.unit.flux != unit {
            return refuse(format!("they are in {}, it is in {unit}", self.unit.flux));
        }
        for (ours, theirs) in scene.captors().iter().zip(&self.captors) {
            let id = &ours.id;
            if *id != theirs.id {
                return refuse(format!("they have captor `{}` where it has `{id}`", theirs.id));
            }
            // results hold both numbers to the last digit
            if ours.area != theirs.area
                || theirs.center.is_some_and(|c| c != ours.center.to_array())
            {
                return refuse(format!("captor `{id}` has moved or changed its size"));
            }
            let absorbs = ours.kind == CaptorKind::Surface;
            if ours.kind.has_back() != theirs.back.is_some() || absorbs != theirs.absorbed.is_some()
            {
                return refuse(format!("captor `{id}` counts other sides"));
            }
        }
        let (ours, theirs) = (scene.captors().len(), self.captors.len());
        if let Some(captor) = scene.captors().get(theirs) {
            return refuse(format!("they have no captor `{}`", captor.id));
        }
        if let Some(captor) = self.captors.get(ours) {
            return refuse(format!("they have captor `{}`, which it has not", captor.id));
        }
        Ok(())
    }
}
