//! What the light costs and where it goes: electric power of lamps, the shares of their light that
//! materials and groups absorb, and how much light a group, or the plane that it samples, has of a
//! kWh.

use indexmap::IndexMap;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{ByLight, planes::sampled_areas};
use crate::lists::are_errors;
use phylux_core::{
    math::{stats::Running, units::Quantity, weighting::WeightedUnit},
    scene::{
        captor::{Captor, CaptorKind, Channel},
        world::Scene,
    },
    transport::tally::Totals,
};

/// Micromoles per J in mol per kWh: 3.6e6 J and 1e-6 mol.
const MOL_PER_KWH: f64 = 3.6;

/// What the light costs and where it goes. Lists have an entry for each band, then for each sum.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct Electricity {
    /// Electric power of all lights whose `watts` the scene has, W.
    pub watts: f64,
    /// Units of `per_watt`: umol/J, W/W or lm/W.
    pub unit: Vec<String>,
    /// Light that these lights emit per electric power.
    pub per_watt: Vec<f64>,
    /// The same for growers.
    #[serde(flatten)]
    pub grown: PerKwh,
    /// The same of each of these lights.
    pub lights: ByLight<LampElectricity>,
    /// Where the light of these lights goes. Null for paths, and where other lights shine too and
    /// results are not kept by light.
    pub shares: Option<Shares>,
    /// What groups of captors have of it. Null where other lights shine too and results are not
    /// kept by light.
    pub groups: Option<IndexMap<String, GroupElectricity>>,
}

/// A light and its electric power.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct LampElectricity {
    /// Electric power, W.
    pub watts: f64,
    /// Light that it emits per electric power.
    pub per_watt: Vec<f64>,
    /// The same for growers.
    #[serde(flatten)]
    pub grown: PerKwh,
}

/// Emitted photons per electric energy. Lists are empty in results of versions before they existed.
#[derive(Clone, Debug, Default, Serialize, Deserialize, JsonSchema)]
pub struct PerKwh {
    /// Photons per electric energy, mol/kWh; null for bands and sums that are not in photons.
    #[serde(default)]
    pub mol_per_kwh: Vec<Option<f64>>,
    /// Electric energy of photons, kWh/mol; null, too, where none are emitted.
    #[serde(default)]
    pub kwh_per_mol: Vec<Option<f64>>,
}

/// Where the emitted light goes: the shares add up to 1.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct Shares {
    /// What the surfaces of each material absorb.
    pub absorbed_by: IndexMap<String, Share>,
    /// What leaves the scene.
    pub outside: Share,
    /// What was cut off by the limits on path length.
    pub lost: Share,
    /// What splitting and ending photons took, 0 on average; absent where photons were not guided
    /// by their importance.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub chance: Option<Share>,
}

/// A share of the emitted light, in bands and sums in which there is any.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct Share {
    /// The share; null where no light is emitted.
    pub share: Vec<Option<f64>>,
    /// Standard error of the value above.
    pub share_se: Vec<Option<f64>>,
}

/// What a group of captors has of the emitted light.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct GroupElectricity {
    /// `absorbed`: what its surfaces absorb; `front`: what arrives on the fronts of its sensors.
    pub of: String,
    /// Its share of the emitted light.
    #[serde(flatten)]
    pub share: Share,
    /// Photons per electric energy, mol/kWh; null for bands and sums that are not in photons.
    pub mol_per_kwh: Vec<Option<f64>>,
    /// Standard error of the value above.
    pub mol_per_kwh_se: Vec<Option<f64>>,
    /// What the plane has that its sensors sample; absent where these do not stand in rows and
    /// columns in one plane.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub plane: Option<PlaneElectricity>,
}

/// What the plane that sensors sample has of the emitted light: the mean of the sensors times the
/// area that they stand for.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct PlaneElectricity {
    /// Area of the plane, m2: that of the cells about all sensors.
    pub area: f64,
    /// Its share of the emitted light.
    #[serde(flatten)]
    pub share: Share,
    /// Photons on the plane per electric energy, mol/kWh; null for bands and sums that are not in
    /// photons.
    pub mol_per_kwh: Vec<Option<f64>>,
    /// Standard error of the value above.
    pub mol_per_kwh_se: Vec<Option<f64>>,
    /// Electric energy of photons on the plane, kWh/mol; null, too, where none arrive.
    pub kwh_per_mol: Vec<Option<f64>>,
    /// Standard error of the value above.
    pub kwh_per_mol_se: Vec<Option<f64>>,
}

/// One number of what the light costs and where it goes.
pub struct ElectricityRow<'a> {
    /// Name of a light, material or group, or `all lights`, `outside`, `lost` or `chance`.
    pub of: &'a str,
    /// `per_watt`, `material_share`, `share`, `group_share`, `mol_per_kwh`, `plane_share`,
    /// `plane_mol_per_kwh` or `plane_kwh_per_mol`.
    pub quantity: &'static str,
    /// Index of the band or sum.
    pub band: usize,
    /// The number.
    pub value: f64,
    /// Its standard error, where it is known.
    pub error: Option<f64>,
}

impl Electricity {
    /// Returns all numbers that are known, as tables have them.
    pub fn rows(&self) -> Vec<ElectricityRow<'_>> {
        let mut all = Vec::new();
        let mut add = |of, quantity, values: &[Option<f64>], errors: &[Option<f64>]| {
            let found = values.iter().enumerate().filter_map(|(b, value)| Some((b, (*value)?)));
            all.extend(found.map(|(band, value)| {
                let error = errors.get(band).copied().flatten();
                ElectricityRow { of, quantity, band, value, error }
            }));
        };
        let known = |values: &[f64]| values.iter().copied().map(Some).collect::<Vec<_>>();
        for (name, lamp) in &self.lights {
            add(name.as_str(), "per_watt", &known(&lamp.per_watt), &[]);
        }
        add("all lights", "per_watt", &known(&self.per_watt), &[]);
        if let Some(shares) = &self.shares {
            for (name, Share { share, share_se }) in shares.all() {
                let is_material = shares.absorbed_by.contains_key(name);
                add(name, if is_material { "material_share" } else { "share" }, share, share_se);
            }
        }
        for (name, group) in self.groups.iter().flatten() {
            add(name, "group_share", &group.share.share, &group.share.share_se);
            add(name, "mol_per_kwh", &group.mol_per_kwh, &group.mol_per_kwh_se);
            if let Some(plane) = &group.plane {
                add(name, "plane_share", &plane.share.share, &plane.share.share_se);
                add(name, "plane_mol_per_kwh", &plane.mol_per_kwh, &plane.mol_per_kwh_se);
                add(name, "plane_kwh_per_mol", &plane.kwh_per_mol, &plane.kwh_per_mol_se);
            }
        }
        all
    }

    /// Finds what the light of a run costs and where it goes; `None` if the scene does not say what
    /// its lights cost.
    pub(super) fn new(scene: &Scene, totals: &Totals, photons: bool) -> Option<Self> {
        if scene.watts().is_empty() {
            return None;
        }
        let metered: Vec<usize> = (0..scene.lights().len())
            .filter(|&l| scene.watts().contains_key(&scene.lights()[l].name))
            .collect();
        let power_of = |lights: &mut dyn Iterator<Item = usize>| {
            let mut power = vec![0.0; scene.bands().len()];
            for light in lights {
                power.iter_mut().zip(&scene.lights()[light].power).for_each(|(sum, p)| *sum += p);
            }
            scene.with_sums(&power)
        };
        let lights = metered.iter().map(|&l| {
            let watts = scene.watts()[&scene.lights()[l].name];
            let power = power_of(&mut std::iter::once(l));
            let per_watt: Vec<f64> = power.iter().map(|p| p / watts).collect();
            let grown = PerKwh::of(scene, &per_watt);
            (scene.lights()[l].name.clone(), LampElectricity { watts, per_watt, grown })
        });
        let lights: ByLight<LampElectricity> = lights.collect();
        let watts: f64 = lights.values().map(|lamp| lamp.watts).sum();
        let power = power_of(&mut metered.iter().copied());
        let others = (0..scene.lights().len()).filter(|l| !metered.contains(l));
        let alone = power_of(&mut others.clone()).iter().all(|p| *p == 0.0);
        let light = match (alone, totals.parts().is_empty()) {
            (true, _) => Some(Metered { totals, parts: None }),
            (false, false) => Some(Metered { totals, parts: Some(&metered) }),
            (false, true) => None,
        };
        let per_watt: Vec<f64> = power.iter().map(|p| p / watts).collect();
        Some(Self {
            watts,
            unit: (0..power.len()).map(|c| unit(scene, c)).collect(),
            grown: PerKwh::of(scene, &per_watt),
            per_watt,
            lights,
            shares: light.as_ref().filter(|_| photons).map(|light| light.shares(scene, &power)),
            groups: light.as_ref().map(|light| light.groups(scene, &power, watts)),
        })
    }

    /// Returns whether every list has an entry for each band, and all numbers are possible.
    pub fn is_valid(&self, bands: usize) -> bool {
        let Self { watts, unit, per_watt, grown, lights, shares, groups } = self;
        let numbers = |values: &[f64]| {
            let values: Vec<Option<f64>> = values.iter().copied().map(Some).collect();
            are_errors(&values, bands)
        };
        let is_valid =
            |share: &Share| are_errors(&share.share, bands) && are_errors(&share.share_se, bands);
        *watts > 0.0
            && unit.len() == bands
            && numbers(per_watt)
            && grown.is_valid(bands)
            && lights.values().all(|lamp| {
                lamp.watts > 0.0 && numbers(&lamp.per_watt) && lamp.grown.is_valid(bands)
            })
            && shares.iter().all(|shares| shares.all().all(|(_, share)| is_valid(share)))
            && groups.iter().flat_map(IndexMap::values).all(|group| {
                is_valid(&group.share)
                    && are_errors(&group.mol_per_kwh, bands)
                    && are_errors(&group.mol_per_kwh_se, bands)
                    && group.plane.iter().all(|plane| plane.is_valid(bands))
            })
    }
}

impl PerKwh {
    fn of(scene: &Scene, per_watt: &[f64]) -> Self {
        let photons = per_watt.iter().enumerate().map(|(column, per_watt)| {
            (unit(scene, column) == "umol/J").then_some(MOL_PER_KWH * per_watt)
        });
        let mol_per_kwh: Vec<Option<f64>> = photons.collect();
        let inverse = |mol: &Option<f64>| mol.filter(|mol| *mol > 0.0).map(f64::recip);
        Self { kwh_per_mol: mol_per_kwh.iter().map(inverse).collect(), mol_per_kwh }
    }

    fn is_valid(&self, bands: usize) -> bool {
        let Self { mol_per_kwh, kwh_per_mol } = self;
        [mol_per_kwh, kwh_per_mol].iter().all(|of| of.is_empty() || are_errors(of, bands))
    }
}

impl PlaneElectricity {
    /// Makes it of what a group of sensors has on their own area, and of the area of the plane, which
    /// is `times` as large.
    fn new(area: f64, times: f64, of: &GroupElectricity) -> Self {
        let scaled = |values: &[Option<f64>]| -> Vec<Option<f64>> {
            values.iter().map(|value| value.map(|value| times * value)).collect()
        };
        let Share { share, share_se } = &of.share;
        let [mol, mol_se] = [&of.mol_per_kwh, &of.mol_per_kwh_se].map(|values| scaled(values));
        let inverse = mol.iter().zip(&mol_se).map(|(mol, error)| {
            let mol = mol.filter(|mol| *mol > 0.0)?;
            Some((mol.recip(), error.map(|error| error / mol.powi(2))))
        });
        let inverse: Vec<Option<(f64, Option<f64>)>> = inverse.collect();
        Self {
            area,
            share: Share { share: scaled(share), share_se: scaled(share_se) },
            mol_per_kwh: mol,
            mol_per_kwh_se: mol_se,
            kwh_per_mol: inverse.iter().map(|found| found.map(|found| found.0)).collect(),
            kwh_per_mol_se: inverse.iter().map(|found| found.and_then(|found| found.1)).collect(),
        }
    }

    fn is_valid(&self, bands: usize) -> bool {
        let Self { area, share, mol_per_kwh, mol_per_kwh_se, kwh_per_mol, kwh_per_mol_se } = self;
        let lists = [&share.share, &share.share_se, mol_per_kwh, mol_per_kwh_se];
        let mut lists = lists.into_iter().chain([kwh_per_mol, kwh_per_mol_se]);
        *area > 0.0 && area.is_finite() && lists.all(|values| are_errors(values, bands))
    }
}

impl Shares {
    /// Returns all shares with their names: of materials, `outside`, `lost` and `chance`.
    pub fn all(&self) -> impl Iterator<Item = (&str, &Share)> {
        let materials = self.absorbed_by.iter().map(|(name, share)| (name.as_str(), share));
        let chance = self.chance.iter().map(|share| ("chance", share));
        materials.chain([("outside", &self.outside), ("lost", &self.lost)]).chain(chance)
    }
}

fn unit(scene: &Scene, column: usize) -> String {
    let sum = column.checked_sub(scene.bands().len()).and_then(|sum| scene.sums()[sum].unit);
    match (sum, scene.quantity()) {
        (Some(WeightedUnit::Lumen), _) => "lm/W",
        (Some(WeightedUnit::Photons), _) | (None, Quantity::Micromole) => "umol/J",
        (Some(WeightedUnit::Watts), _) | (None, Quantity::Watt) => "W/W",
    }
    .into()
}

/// The light of the lights whose electric power is known.
struct Metered<'a> {
    totals: &'a Totals,
    /// Indices of these lights, where there are others.
    parts: Option<&'a [usize]>,
}

impl Metered<'_> {
    /// Returns the sums of these lights alone.
    fn sums(&self, of: &dyn Fn(&Totals) -> Vec<Running>) -> Vec<Running> {
        let Some(parts) = self.parts else { return of(self.totals) };
        let parts: Vec<Vec<Running>> = parts.iter().map(|&p| of(&self.totals.parts()[p])).collect();
        let mixed =
            |i: usize| Running::mixed(parts.iter().map(|part| (part[i], 1.0)), self.totals.batches);
        (0..parts.first().map_or(0, Vec::len)).map(mixed).collect()
    }

    fn share(&self, sums: &[Running], power: &[f64]) -> Share {
        let found = sums.iter().zip(power).map(|(running, power)| {
            let found = running.estimate(self.totals.batches);
            let error = found.standard_error.map(|error| error / power);
            (*power > 0.0).then_some((found.mean / power, error))
        });
        let found: Vec<Option<(f64, Option<f64>)>> = found.collect();
        Share {
            share: found.iter().map(|found| found.map(|(share, _)| share)).collect(),
            share_se: found.iter().map(|found| found.and_then(|(_, error)| error)).collect(),
        }
    }

    fn shares(&self, scene: &Scene, power: &[f64]) -> Shares {
        let columns = power.len();
        let spent = self.sums(&|totals| totals.spent().flatten().copied().collect());
        let mut rows = spent.chunks(columns).map(|sums| self.share(sums, power));
        let names = scene.materials().iter().map(|material| material.name.clone());
        let mut next = || rows.next().unwrap_or_else(|| self.share(&[], &[]));
        let absorbed_by = names.map(|name| (name, next())).collect();
        let (outside, lost, chance) = (next(), next(), next());
        let games = !self.totals.chance().is_empty();
        Shares { absorbed_by, outside, lost, chance: games.then_some(chance) }
    }

    fn groups(
        &self,
        scene: &Scene,
        power: &[f64],
        watts: f64,
    ) -> IndexMap<String, GroupElectricity> {
        let mut absorbs = vec![false; scene.groups().len()];
        let surfaces = scene.captors().iter().filter(|captor| captor.kind == CaptorKind::Surface);
        surfaces
            .flat_map(|captor: &Captor| &captor.groups)
            .for_each(|&group| absorbs[group] = true);
        let planes = sampled_areas(scene);
        let mut areas = vec![0.0; scene.groups().len()];
        let captors = scene.captors().iter();
        captors.for_each(|captor| captor.groups.iter().for_each(|&g| areas[g] += captor.area));
        let of = |(group, name): (usize, &String)| {
            let (of, channel) = match absorbs[group] {
                true => ("absorbed", Channel::Absorbed),
                false => ("front", Channel::Front),
            };
            let channel = scene.first_channel_of_group(group) + channel as usize;
            let sums = self.sums(&|totals| totals.running(channel).to_vec());
            let per_kwh = sums.iter().enumerate().map(|(column, running)| {
                let found = running.estimate(self.totals.batches);
                let scale = MOL_PER_KWH / watts;
                let error = found.standard_error.map(|error| scale * error);
                (unit(scene, column) == "umol/J").then_some((scale * found.mean, error))
            });
            let per_kwh: Vec<Option<(f64, Option<f64>)>> = per_kwh.collect();
            let mut found = GroupElectricity {
                plane: None,
                of: of.into(),
                share: self.share(&sums, power),
                mol_per_kwh: per_kwh.iter().map(|found| found.map(|(mol, _)| mol)).collect(),
                mol_per_kwh_se: per_kwh.iter().map(|found| found.and_then(|f| f.1)).collect(),
            };
            found.plane =
                planes[group].map(|area| PlaneElectricity::new(area, area / areas[group], &found));
            (name.clone(), found)
        };
        scene.groups().iter().enumerate().map(of).collect()
    }
}
