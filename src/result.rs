//! What a run found: plain data, in the form of the results file. Lengths are metres; fluxes W or
//! umol/s; errors are standard errors (1 sigma).

use schemars::JsonSchema;
use serde::{Serialize, Serializer};

use crate::{
    captor::{CHANNELS, Captor, CaptorKind, Channel},
    estimate::{
        nearest::{self, NearestEstimate},
        paths::Unseen,
    },
    scene::Scene,
    settings::{Estimator, Settings},
    simulate::Simulation,
    stats::{Estimate, Running},
    tally::{Ledger, Totals},
    units::UnitNames,
};

/// Part of the squared deviations in one block above which few paths have made them; the odds that
/// one of 128 normal blocks exceeds it are 1e-7.
const CONCENTRATED: f64 = 0.25;

/// What a run found.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct RunResult {
    /// Version of phylux that wrote it.
    pub phylux: &'static str,
    /// Name of the scene.
    pub scene: String,
    /// Seed of the random streams.
    pub seed: u64,
    /// Photons traced, or paths from all faces.
    pub photons: u64,
    /// Blocks that the standard errors come from.
    pub blocks: u64,
    /// How the numbers were estimated.
    pub estimator: Estimator,
    /// Why, where it was left to a trial.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub chosen: Option<String>,
    /// Names of the units.
    pub unit: UnitNames,
    /// What the entries of every array stand for: the bands, then the sums over bands.
    pub bands: Vec<BandResult>,
    /// The energy balance.
    pub energy: Energy,
    /// In a run of paths: about which share of the flux on all captors together they cannot find
    /// (light of points and lines by way of mirrors or refraction), per band, in [0, 1]; absent
    /// where there can be none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub unseen: Option<Vec<f64>>,
    /// In a run of paths: the share of them that the length limits cut off, in [0, 1]; light that
    /// they could still have found is missing. Absent where there is none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cut_off: Option<f64>,
    /// What the k-nearest estimates were made from.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub map: Option<MapResult>,
    /// One entry per captor.
    pub captors: Vec<CaptorResult>,
    /// One entry per group of captors.
    pub groups: Vec<GroupResult>,
}

/// A band, or a sum over bands.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct BandResult {
    /// Its name.
    pub name: String,
    /// Wavelength, nm.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub from_nm: Option<f64>,
    /// Wavelength, nm.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub to_nm: Option<f64>,
    /// For a sum: the bands that it adds up.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sum_of: Option<Vec<String>>,
}

/// The energy balance per band: emitted = absorbed + escaped + lost. Paths from the captors know
/// `power` alone: the rest is empty or none, and null in the file.
#[derive(Clone, Debug, Default, Serialize, JsonSchema)]
pub struct Energy {
    /// Nominal power of all lights.
    pub power: Vec<f64>,
    /// What the photons carried.
    #[schemars(with = "Option<Vec<f64>>")]
    #[serde(serialize_with = "or_null")]
    pub emitted: Vec<f64>,
    /// What surfaces absorbed.
    #[schemars(with = "Option<Vec<f64>>")]
    #[serde(serialize_with = "or_null")]
    pub absorbed: Vec<f64>,
    /// What left the scene.
    #[schemars(with = "Option<Vec<f64>>")]
    #[serde(serialize_with = "or_null")]
    pub escaped: Vec<f64>,
    /// What was on paths cut off by the length limits.
    #[schemars(with = "Option<Vec<f64>>")]
    #[serde(serialize_with = "or_null")]
    pub lost: Vec<f64>,
    /// What the surfaces of each material absorbed.
    #[schemars(with = "Option<std::collections::BTreeMap<String, Vec<f64>>>")]
    #[serde(serialize_with = "as_map")]
    pub absorbed_by: Option<Vec<(String, Vec<f64>)>>,
}

fn or_null<S: Serializer>(values: &[f64], serializer: S) -> Result<S::Ok, S::Error> {
    (!values.is_empty()).then_some(values).serialize(serializer)
}

fn as_map<S: Serializer>(
    entries: &Option<Vec<(String, Vec<f64>)>>,
    serializer: S,
) -> Result<S::Ok, S::Error> {
    match entries {
        Some(entries) => {
            serializer.collect_map(entries.iter().map(|(name, values)| (name, values)))
        }
        None => serializer.serialize_none(),
    }
}

/// The photon map that k-nearest estimates were made from.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct MapResult {
    /// Arrivals stored.
    pub arrivals: u64,
    /// The first so many histories: those whose arrivals are all in it.
    pub photons: u64,
}

/// What one captor received.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct CaptorResult {
    /// Its unique name.
    pub id: String,
    /// `virtual` or `surface`.
    pub kind: &'static str,
    /// One-sided area, m2.
    pub area: f64,
    /// Area centroid, m.
    pub center: [f64; 3],
    /// Area-weighted mean normal; zeros where it cancels.
    pub normal: [f64; 3],
    /// Light against the normal.
    pub front: FaceResult,
    /// Light along the normal.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub back: Option<FaceResult>,
    /// Power absorbed by a surface, per band.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub absorbed: Option<Vec<f64>>,
    /// Its standard error; null where nothing arrived.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub absorbed_se: Option<Vec<Option<f64>>>,
}

/// What a group of captors received together.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct GroupResult {
    /// Its name.
    pub id: String,
    /// Number of captors.
    pub captors: usize,
    /// Their one-sided area together, m2.
    pub area: f64,
    /// Light against the normals; irradiance is the mean over the area.
    pub front: FaceResult,
    /// Light along the normals, of those captors that count it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub back: Option<FaceResult>,
    /// Power absorbed by the surfaces, per band.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub absorbed: Option<Vec<f64>>,
    /// Its standard error; null where nothing arrived.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub absorbed_se: Option<Vec<Option<f64>>>,
}

impl CaptorResult {
    /// Its front and, where it counts, its back.
    pub fn faces(&self) -> impl Iterator<Item = &FaceResult> {
        std::iter::once(&self.front).chain(&self.back)
    }
}

/// What arrived on one face.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct FaceResult {
    /// Photons counted; paths that started here.
    pub photons: u64,
    /// Power that arrived, per band.
    pub flux: Vec<f64>,
    /// Its standard error; null where nothing arrived.
    pub flux_se: Vec<Option<f64>>,
    /// Flux per area.
    pub irradiance: Vec<f64>,
    /// Its standard error; null where nothing arrived.
    pub irradiance_se: Vec<Option<f64>>,
    /// In a run of paths: whether the error rests on what few paths found, so that it and the value
    /// may be far too small.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub few_paths: bool,
    /// Of a group of several: the least irradiance of its captors, per band.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub min: Option<Vec<f64>>,
    /// The greatest one; noise drives both apart.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max: Option<Vec<f64>>,
    /// The k-nearest estimate; null where nothing arrived, absent where none was asked for;
    /// null in a run of paths.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub knn: Option<Option<NearestResult>>,
}

/// The k-nearest estimate at the middle of a captor.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct NearestResult {
    /// Photons gathered.
    pub k: usize,
    /// Radius of the gather ball, m.
    pub radius: f64,
    /// Share of the captor's area that it is a mean over, in (0, 1]: near 1 it says nothing of the
    /// middle that the summed flux does not say better.
    pub coverage: f64,
    /// Per band.
    pub irradiance: Vec<f64>,
    /// Its standard error: the noise alone, not the bias of a mean over the disc; null for fewer than
    /// two photons and where nothing arrived.
    pub irradiance_se: Vec<Option<f64>>,
    /// Sent along the face's normal, per band; null on transparent and mirror surfaces.
    pub radiance: Option<Vec<f64>>,
    /// Its standard error, likewise.
    pub radiance_se: Option<Vec<Option<f64>>>,
}

impl RunResult {
    /// From what `simulate` found in `scene` with `settings`.
    pub fn new(scene: &Scene, settings: &Settings, simulation: &Simulation) -> Self {
        let Simulation { totals, map, .. } = simulation;
        let with_sums = |values: &[f64]| scene.with_sums(values);
        let powers: Vec<f64> = (0..scene.bands.len())
            .map(|b| scene.lights.iter().map(|light| light.power[b]).sum())
            .collect();
        let of_paths = simulation.estimator == Estimator::Paths;
        let energy = match of_paths {
            false => balance(scene, with_sums(&powers), totals.ledger()),
            true => Energy { power: with_sums(&powers), ..Energy::default() },
        };
        let estimates = map.as_ref().map(|map| (map, settings.k));
        let captors: Vec<CaptorResult> = scene
            .captors
            .iter()
            .map(|captor| {
                let nearest = match of_paths {
                    false => estimates.map(|(map, k)| nearest::estimate(scene, map, captor, k)),
                    true => Some([None, None]),
                };
                captor_result(simulation, captor, nearest)
            })
            .collect();
        Self {
            phylux: env!("CARGO_PKG_VERSION"),
            scene: scene.name.clone(),
            seed: settings.seed,
            photons: totals.histories,
            blocks: totals.blocks,
            estimator: simulation.estimator,
            chosen: simulation.choice.as_ref().map(|choice| choice.why.clone()),
            unit: scene.quantity.unit_names(),
            bands: band_results(scene),
            energy,
            unseen: simulation.unseen.as_ref().map(|unseen| shares(scene, unseen)),
            cut_off: (totals.cut_off > 0).then(|| totals.cut_off as f64 / totals.histories as f64),
            map: map.as_ref().map(|map| MapResult {
                arrivals: map.photons.len() as u64,
                photons: map.histories,
            }),
            groups: group_results(scene, simulation, &captors),
            captors,
        }
    }
}

/// The share per band, then per sum, that paths cannot find.
fn shares(scene: &Scene, unseen: &Unseen) -> Vec<f64> {
    let (hidden, all) = (scene.with_sums(&unseen.hidden), scene.with_sums(&unseen.all));
    let share = |(hidden, all): (f64, f64)| if all > 0.0 { hidden / all } else { 0.0 };
    hidden.into_iter().zip(all).map(share).collect()
}

/// The energy balance of a photon run.
fn balance(scene: &Scene, power: Vec<f64>, ledger: Ledger) -> Energy {
    let Ledger { emitted, absorbed, escaped, lost } = ledger;
    let bands = scene.bands.len();
    let by_material: Vec<&[f64]> = absorbed.chunks(bands).collect();
    let total: Vec<f64> = (0..bands).map(|b| by_material.iter().map(|m| m[b]).sum()).collect();
    let named = scene.materials.iter().zip(&by_material);
    Energy {
        power,
        emitted: scene.with_sums(&emitted),
        absorbed: scene.with_sums(&total),
        escaped: scene.with_sums(&escaped),
        lost: scene.with_sums(&lost),
        absorbed_by: Some(
            named.map(|(m, values)| (m.name.clone(), scene.with_sums(values))).collect(),
        ),
    }
}

fn band_results(scene: &Scene) -> Vec<BandResult> {
    let bands = scene.bands.iter().map(|band| BandResult {
        name: band.name.clone(),
        from_nm: band.from_nm,
        to_nm: band.to_nm,
        sum_of: None,
    });
    let sums = scene.sums.iter().map(|sum| BandResult {
        name: sum.name.clone(),
        from_nm: None,
        to_nm: None,
        sum_of: Some(sum.bands.iter().map(|&b| scene.bands[b].name.clone()).collect()),
    });
    bands.chain(sums).collect()
}

fn captor_result(
    simulation: &Simulation,
    captor: &Captor,
    nearest: Option<[Option<NearestEstimate>; 2]>,
) -> CaptorResult {
    let channel = |channel: Channel| captor.first_channel + channel as usize;
    let [nearest_front, nearest_back] = match nearest {
        Some(faces) => faces.map(|face| Some(face.map(nearest_result))),
        None => [None, None],
    };
    let face = |c: Channel, knn| FaceResult { knn, ..face(simulation, channel(c), captor.area) };
    let absorbed = (captor.kind == CaptorKind::Surface)
        .then(|| Sums::of(&simulation.totals, channel(Channel::Absorbed)));
    let (absorbed, absorbed_se) = absorbed.map(|a| (a.mean, a.standard_error)).unzip();
    CaptorResult {
        id: captor.id.clone(),
        kind: match captor.kind {
            CaptorKind::Virtual { .. } => "virtual",
            CaptorKind::Surface => "surface",
        },
        area: captor.area,
        center: captor.center.to_array(),
        normal: captor.normal.to_array(),
        front: face(Channel::Front, nearest_front),
        back: captor.kind.has_back().then(|| face(Channel::Back, nearest_back)),
        absorbed,
        absorbed_se,
    }
}

fn nearest_result(estimate: NearestEstimate) -> NearestResult {
    let columns = |of: Vec<Estimate>| of.into_iter().map(|e| (e.mean, e.standard_error)).unzip();
    let (irradiance, irradiance_se) = columns(estimate.irradiance);
    let (radiance, radiance_se) = estimate.radiance.map(columns).unzip();
    NearestResult {
        k: estimate.k,
        radius: estimate.radius,
        coverage: estimate.coverage,
        irradiance,
        irradiance_se,
        radiance,
        radiance_se,
    }
}

/// What the captors of a group are together.
#[derive(Clone, Default)]
struct Members {
    captors: usize,
    area: f64,
    back_area: f64,
    surfaces: usize,
    front: Range,
    back: Range,
}

/// The least and the greatest irradiance of some captors, per band.
#[derive(Clone, Default)]
struct Range(Option<(Vec<f64>, Vec<f64>)>);

impl Range {
    fn add(&mut self, face: &FaceResult) {
        let values = &face.irradiance;
        let (low, high) = self.0.get_or_insert_with(|| (values.clone(), values.clone()));
        for (low, v) in low.iter_mut().zip(values) {
            *low = low.min(*v);
        }
        for (high, v) in high.iter_mut().zip(values) {
            *high = high.max(*v);
        }
    }
}

fn group_results(
    scene: &Scene,
    simulation: &Simulation,
    captors: &[CaptorResult],
) -> Vec<GroupResult> {
    let mut members = vec![Members::default(); scene.groups.len()];
    for (captor, found) in scene.captors.iter().zip(captors) {
        for &group in &captor.groups {
            let members = &mut members[group];
            members.captors += 1;
            members.area += captor.area;
            members.back_area += if captor.kind.has_back() { captor.area } else { 0.0 };
            members.surfaces += usize::from(captor.kind == CaptorKind::Surface);
            members.front.add(&found.front);
            found.back.iter().for_each(|back| members.back.add(back));
        }
    }
    let groups = scene.groups.iter().zip(members).enumerate();
    groups.map(|(g, (name, members))| group_result(scene, simulation, g, name, members)).collect()
}

fn group_result(
    scene: &Scene,
    simulation: &Simulation,
    group: usize,
    name: &str,
    members: Members,
) -> GroupResult {
    let channel = |c: Channel| scene.channels() + group * CHANNELS.len() + c as usize;
    let absorbed =
        (members.surfaces > 0).then(|| Sums::of(&simulation.totals, channel(Channel::Absorbed)));
    let (absorbed, absorbed_se) = absorbed.map(|a| (a.mean, a.standard_error)).unzip();
    let several = members.captors > 1;
    let face = |c: Channel, area, range: Range| {
        let (min, max) = range.0.filter(|_| several).unzip();
        FaceResult { min, max, ..face(simulation, channel(c), area) }
    };
    GroupResult {
        id: name.to_string(),
        captors: members.captors,
        area: members.area,
        front: face(Channel::Front, members.area, members.front),
        back: (members.back_area > 0.0)
            .then(|| face(Channel::Back, members.back_area, members.back)),
        absorbed,
        absorbed_se,
    }
}

/// Means and standard errors of one channel, per band and sum.
struct Sums {
    mean: Vec<f64>,
    standard_error: Vec<Option<f64>>,
}

impl Sums {
    fn of(totals: &Totals, channel: usize) -> Self {
        let estimates: Vec<_> =
            totals.running(channel).iter().map(|r: &Running| r.estimate(totals.blocks)).collect();
        let arrived = |mean: f64| mean != 0.0;
        Self {
            mean: estimates.iter().map(|e| e.mean).collect(),
            standard_error: estimates
                .iter()
                .map(|e| e.standard_error.filter(|_| arrived(e.mean)))
                .collect(),
        }
    }
}

fn face(simulation: &Simulation, channel: usize, area: f64) -> FaceResult {
    let totals = &simulation.totals;
    let flux = Sums::of(totals, channel);
    let concentrated = |r: &Running| r.concentration(totals.blocks) > CONCENTRATED;
    let of_paths = simulation.estimator == Estimator::Paths;
    FaceResult {
        photons: totals.photons(channel),
        irradiance: flux.mean.iter().map(|f| f / area).collect(),
        irradiance_se: flux.standard_error.iter().map(|se| se.map(|se| se / area)).collect(),
        flux: flux.mean,
        flux_se: flux.standard_error,
        few_paths: of_paths && totals.running(channel).iter().any(concentrated),
        min: None,
        max: None,
        knn: None,
    }
}
