//! Makes results from the sums of a run.

use std::borrow::Cow;

use super::{
    Absorbed, AbsorbedByFace, Account, BandResult, CaptorResult, DarkResult, Electricity, Energy,
    Extras, FORMAT, FaceResult, GroupResult, MapResult, NearestResult, Own, PerBand, Provenance,
    RatioResult, Ratios, RunResult, RunSettings, SumUnit, ToleranceResult, Whole, WorstResult,
    own::{self, Means},
    sensitivity::sensitivities,
    spread::Spread,
    stand,
    warnings::{FEW_HISTORIES, rests_on_few},
};
use phylux_core::{
    math::{
        stats::{Estimate, Running},
        units::Quantity,
    },
    scene::{
        captor::{ABSORBED_FRONT, Captor, CaptorKind, Channel},
        light::Light,
        world::Scene,
    },
    transport::{
        nearest::{self, NearestEstimate},
        paths::Unseen,
        settings::{Estimator, Guiding, NearestCount},
        simulate::{Accuracy, Dark, FaceBand, Simulation, Worst},
        tally::{Ledger, Totals},
    },
};

/// If one batch makes up more than this fraction of the squared deviations, few paths have found
/// most of the light. The odds that one of 128 normal batches exceeds it are 1e-7.
const CONCENTRATED: f64 = 0.25;

impl RunResult {
    /// Makes the result of a run.
    pub fn new(simulation: &Simulation) -> Self {
        let (scene, settings) = (simulation.scene(), simulation.settings());
        let (totals, map) = (simulation.totals(), simulation.map());
        let powers: Vec<f64> = (0..scene.bands().len())
            .map(|b| scene.lights().iter().fold(0.0, |sum, light| sum + light.power[b]))
            .collect();
        let alone = simulation.estimator() == Estimator::Paths;
        let energy = match alone {
            false => Energy {
                by_light: by_light(scene, totals, |light, part| balance(scene, &light.power, part))
                    .map(|lights| lights.map(|(name, of)| (name.to_string(), of)).collect()),
                ..balance(scene, &powers, totals)
            },
            true => Energy { power: scene.with_sums(&powers), ..Energy::default() },
        };
        let estimates = map.map(|map| (map, settings.k.map(NearestCount::get)));
        let own = own::of_captors(simulation);
        let captors: Vec<CaptorResult> = scene
            .captors()
            .iter()
            .enumerate()
            .map(|(c, captor)| {
                let nearest = match simulation.estimator() {
                    Estimator::Paths => Some([None, None]),
                    _ => estimates.map(|(map, k)| nearest::estimate(scene, map, captor, k)),
                };
                captor_result(simulation, captor, nearest, own(c))
            })
            .collect();
        let bands = band_results(scene);
        let photons = scene.quantity() == Quantity::Micromole;
        let dli =
            scene.period_h().is_some() && bands.iter().any(|band| band.has_dli(&bands, photons));
        let mut unit = scene.quantity().unit_names();
        unit.dli = dli.then_some(Cow::Borrowed("mol/m2/d"));
        let mut result = Self {
            provenance: Provenance::new(simulation),
            unit,
            period_h: scene.period_h(),
            bands,
            ratios: RatioResult::all(scene),
            energy,
            account: Account::new(simulation),
            groups: group_results(simulation, &captors),
            captors,
            extras: Extras {
                layers: stand::layers(simulation),
                sensitivity: sensitivities(simulation),
                canopy: stand::canopy(simulation),
                ..Extras::default()
            },
        };
        result.add_uncertainty(simulation);
        result.add_dli();
        result.with_warnings_of_scene([])
    }
}

impl Provenance {
    fn new(simulation: &Simulation) -> Self {
        let (scene, settings) = (simulation.scene(), simulation.settings());
        let totals = simulation.totals();
        Self {
            format: FORMAT,
            phylux: env!("CARGO_PKG_VERSION").into(),
            scene: scene.name().into(),
            scene_hash: scene.digest(),
            seed: settings.seed,
            photons: totals.histories,
            photons_beside: simulation.beside(),
            batches: totals.batches,
            estimator: simulation.estimator(),
            guiding: Some(simulation.guiding()).filter(|guiding| *guiding != Guiding::Off),
            starved: simulation.starved(),
            chosen: simulation.choice().map(|choice| choice.why.clone()),
            shared: None,
            mixed: None,
            calibrated: false,
            settings: Some(RunSettings::new(simulation)),
            warnings: Vec::new(),
        }
    }
}

impl Account {
    fn new(simulation: &Simulation) -> Self {
        let (scene, totals) = (simulation.scene(), simulation.totals());
        let photons = simulation.estimator() != Estimator::Paths;
        let unseen = simulation.unseen().map(|unseen| (unseen, shares(scene, unseen)));
        Self {
            electricity: Electricity::new(scene, totals, photons),
            unseen_se: unseen.as_ref().map(|(unseen, shares)| {
                shares.iter().map(|share| unseen.error_of(*share)).collect()
            }),
            unseen: unseen.map(|(_, shares)| shares),
            cut_off: (totals.cut_off > 0).then(|| totals.cut_off as f64 / totals.histories as f64),
            tolerance: simulation.accuracy().map(|found| ToleranceResult::new(scene, found)),
            map: simulation
                .map()
                .map(|map| MapResult { arrivals: map.arrivals(), photons: map.histories }),
        }
    }
}

/// Returns a value for each light, if the run counted lights apart.
fn by_light<'a, T>(
    scene: &'a Scene,
    totals: &'a Totals,
    of: impl Fn(&Light, &Totals) -> T + 'a,
) -> Option<impl Iterator<Item = (&'a str, T)>> {
    let lights = scene.lights().iter().zip(totals.parts());
    let each = lights.map(move |(light, part)| (light.name.as_str(), of(light, part)));
    (!totals.parts().is_empty()).then_some(each)
}

/// Returns the fraction of the light that paths cannot find, per band, then per sum.
fn shares(scene: &Scene, unseen: &Unseen) -> Vec<f64> {
    let (hidden, all) = (scene.with_sums(&unseen.hidden), scene.with_sums(&unseen.all));
    let share = |(hidden, all): (f64, f64)| if all > 0.0 { hidden / all } else { 0.0 };
    hidden.into_iter().zip(all).map(share).collect()
}

impl ToleranceResult {
    fn new(scene: &Scene, accuracy: &Accuracy) -> Self {
        let dark = |dark: &Dark| {
            let Names { captor, group, face, band } = names(scene, &dark.at);
            DarkResult { captor, group, face: face.into(), band, below: dark.below }
        };
        Self {
            asked: accuracy.tolerance,
            met: accuracy.met,
            worst: accuracy.worst.as_ref().map(|worst| WorstResult::new(scene, worst)),
            dark: accuracy.dark.iter().map(dark).collect(),
        }
    }
}

impl WorstResult {
    /// Makes the entry, with the names that captor and band have in `scene`.
    pub fn new(scene: &Scene, worst: &Worst) -> Self {
        let Names { captor, group, face, band } = names(scene, &worst.at);
        let Worst { relative_error, batches_with_light, .. } = *worst;
        Self { captor, group, face: face.into(), band, relative_error, batches_with_light }
    }
}

/// The names of a value: those of captor or group, face and band.
struct Names {
    captor: String,
    group: bool,
    face: &'static str,
    band: String,
}

fn names(scene: &Scene, at: &FaceBand) -> Names {
    let face = match at.face {
        Channel::Front => "front",
        Channel::Back => "back",
        Channel::Absorbed => "absorbed",
    };
    let band = scene.band_names().nth(at.band).unwrap_or_default();
    let name = match scene.captors().get(at.captor) {
        Some(captor) => &captor.id,
        None => &scene.groups()[at.captor - scene.captors().len()],
    };
    let group = at.captor >= scene.captors().len();
    Names { captor: name.clone(), group, face, band: band.into() }
}

/// Returns the energy balance of a run of photons.
fn balance(scene: &Scene, power: &[f64], totals: &Totals) -> Energy {
    let Ledger { emitted, absorbed, escaped, mut missed, lost, .. } = totals.ledger();
    let chance = totals.chance().iter().map(|taken| taken.estimate(totals.batches));
    let chance: Vec<Estimate> = chance.collect();
    let games = !chance.is_empty();
    let bands = scene.bands().len();
    let by_material: Vec<&[f64]> = absorbed.chunks(bands).collect();
    let total = (0..bands).map(|b| by_material.iter().fold(0.0, |sum, m| sum + m[b]));
    let total: Vec<f64> = total.collect();
    let named = scene.materials().iter().zip(&by_material);
    Energy {
        power: scene.with_sums(power),
        emitted: scene.with_sums(&emitted),
        absorbed: scene.with_sums(&total),
        escaped: scene.with_sums(&escaped),
        missed: match scene.has_daylight() {
            true => {
                missed.resize(bands, 0.0);
                scene.with_sums(&missed)
            }
            false => Vec::new(),
        },
        lost: scene.with_sums(&lost),
        chance: games.then(|| chance.iter().map(|taken| taken.mean).collect()),
        chance_se: games.then(|| chance.iter().map(|taken| taken.standard_error).collect()),
        absorbed_by: Some(
            named.map(|(m, values)| (m.name.clone(), scene.with_sums(values))).collect(),
        ),
        by_light: None,
    }
}

/// Returns the word for light per area that is measured so (the unit of its flux): photon flux
/// density, PFD, where photons are counted.
pub fn light_word(flux: &str) -> &'static str {
    match flux {
        "umol/s" => "PFD",
        "lm" => "illuminance",
        _ => "irradiance",
    }
}

/// Returns the name of the light per area in a band or sum (`None`: in all bands together) of results
/// in this unit of flux, as it stands at axes: PPFD, if it counts photons within 400 to 700 nm (those
/// of a band called PAR that has no wavelengths), or else its word; with the name of the band where
/// there are others and PPFD does not say which.
pub fn light_name(bands: &[BandResult], of: Option<usize>, flux: &str) -> String {
    let own = of.map(|of| &bands[of]);
    let is_part = |band: &BandResult| match own.map(|own| (own, &own.sum_of)) {
        None => true,
        Some((_, Some(parts))) => parts.contains(&band.name),
        Some((own, None)) => own.name == band.name,
    };
    let parts = bands.iter().filter(|band| band.sum_of.is_none() && is_part(band));
    let range = |band: &BandResult| match (band.from_nm, band.to_nm) {
        (None, None) if band.name.eq_ignore_ascii_case("PAR") => (400.0, 700.0),
        (from, to) => (from.unwrap_or(0.0), to.unwrap_or(f64::MAX)),
    };
    let ranges: Vec<(f64, f64)> = parts.map(range).collect();
    let counts = flux == "umol/s" && own.is_none_or(|own| own.weights.is_none());
    let within = ranges.iter().all(|&(from, to)| from >= 399.0 && to <= 701.0);
    let is_ppfd = counts && within && !ranges.is_empty();
    let own_flux = own.and_then(|own| own.unit.as_ref()).map_or(flux, |unit| &unit.flux);
    let name = if is_ppfd { "PPFD" } else { light_word(own_flux) };
    let single = ranges.len() == 1;
    let whole = !single || ranges.iter().any(|&(from, to)| from <= 401.0 && to >= 699.0);
    match own {
        Some(own) if bands.len() > 1 && !(is_ppfd && whole) => format!("{name}, {}", own.name),
        None if bands.len() > 1 && !is_ppfd => format!("{name}, all bands"),
        _ => name.into(),
    }
}

/// Returns the bands of a scene, then its sums.
pub fn band_results(scene: &Scene) -> Vec<BandResult> {
    let bands = scene.bands().iter().map(|band| BandResult {
        name: band.name.clone(),
        from_nm: band.from_nm,
        to_nm: band.to_nm,
        sum_of: None,
        weights: None,
        unit: None,
    });
    let sums = scene.sums().iter().map(|sum| BandResult {
        name: sum.name.clone(),
        from_nm: None,
        to_nm: None,
        sum_of: Some(sum.bands.iter().map(|&b| scene.bands()[b].name.clone()).collect()),
        weights: (!sum.weights.is_empty()).then(|| sum.weights.clone()),
        unit: sum.unit.map(|unit| {
            let [flux, irradiance] = unit.names().map(Cow::Borrowed);
            SumUnit { flux, irradiance }
        }),
    });
    bands.chain(sums).collect()
}

fn captor_result(
    simulation: &Simulation,
    captor: &Captor,
    nearest: Option<[Option<NearestEstimate>; 2]>,
    own: Own,
) -> CaptorResult {
    let scene = simulation.scene();
    let channel = |channel: Channel| captor.first_channel + channel as usize;
    let [nearest_front, nearest_back] = match nearest {
        Some(faces) => faces.map(|face| Some(face.map(nearest_result).map(Box::new))),
        None => [None, None],
    };
    let face = |c: Channel, knn| {
        let face = face(simulation, channel(c), captor.area);
        FaceResult { knn, ..face }
    };
    let counts = captor.kind == CaptorKind::Surface;
    let whole = counts.then(|| whole(scene, simulation.totals(), channel(Channel::Absorbed)));
    let groups = captor.groups.iter().map(|&group| scene.groups()[group].clone());
    CaptorResult {
        id: captor.id.clone(),
        kind: match captor.kind {
            CaptorKind::Virtual { .. } => "virtual",
            CaptorKind::Surface => "surface",
        }
        .into(),
        area: captor.area,
        center: captor.center.to_array(),
        normal: captor.normal.to_array(),
        front: face(Channel::Front, nearest_front),
        back: captor.kind.has_back().then(|| face(Channel::Back, nearest_back)),
        whole: Whole { own, ..whole.unwrap_or_default() },
        groups: Some(groups.collect()),
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

/// The captors of a group: their number, areas and faces.
#[derive(Clone, Default)]
struct Members<'a> {
    captors: usize,
    area: f64,
    back_area: f64,
    surfaces: usize,
    means: Means,
    front: Spread<'a>,
    back: Spread<'a>,
}

fn group_results(simulation: &Simulation, captors: &[CaptorResult]) -> Vec<GroupResult> {
    let scene = simulation.scene();
    let mut members = vec![Members::default(); scene.groups().len()];
    for (captor, found) in scene.captors().iter().zip(captors) {
        for &group in &captor.groups {
            let members = &mut members[group];
            members.captors += 1;
            members.area += captor.area;
            members.back_area += if captor.kind.has_back() { captor.area } else { 0.0 };
            members.surfaces += usize::from(captor.kind == CaptorKind::Surface);
            members.means.add(&found.own, captor.area);
            members.front.add(&found.front, captor.area);
            found.back.iter().for_each(|back| members.back.add(back, captor.area));
        }
    }
    let groups = scene.groups().iter().zip(members).enumerate();
    groups.map(|(g, (name, members))| group_result(simulation, g, name, &members)).collect()
}

fn group_result(
    simulation: &Simulation,
    group: usize,
    name: &str,
    members: &Members,
) -> GroupResult {
    let scene = simulation.scene();
    let channel = |c: Channel| scene.first_channel_of_group(group) + c as usize;
    let counts = members.surfaces > 0;
    let whole = counts.then(|| whole(scene, simulation.totals(), channel(Channel::Absorbed)));
    let face = |c: Channel, area, spread: &Spread| spread.on(face(simulation, channel(c), area));
    GroupResult {
        id: name.to_string(),
        captors: members.captors,
        area: members.area,
        front: face(Channel::Front, members.area, &members.front),
        back: (members.back_area > 0.0)
            .then(|| face(Channel::Back, members.back_area, &members.back)),
        whole: Whole { own: members.means.over(members.area), ..whole.unwrap_or_default() },
    }
}

/// Means and standard errors of one channel, per band, then per sum.
struct Sums {
    mean: PerBand<f64>,
    standard_error: PerBand<Option<f64>>,
}

impl Sums {
    fn of(totals: &Totals, channel: usize) -> Self {
        let estimates: Vec<Estimate> = totals.estimates(channel).collect();
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
    let scene = simulation.scene();
    let totals = simulation.totals();
    let concentrated = |r: &Running| r.concentration(totals.batches) > CONCENTRATED;
    let by_photons = simulation.by_photons().get(channel).is_some_and(|&alone| alone);
    let of_paths = simulation.estimator() != Estimator::Photons && !by_photons;
    let split = !totals.parts().is_empty();
    let few = match of_paths {
        true => totals.running(channel).iter().any(concentrated),
        false => {
            let counted = || totals.histories_in(channel).map(|n| n as f64);
            let histories = totals.equal_histories(channel).or_else(counted);
            histories.is_some_and(|n| 0.0 < n && n < FEW_HISTORIES as f64)
                || totals
                    .estimates(channel)
                    .take(scene.bands().len())
                    .any(|band| rests_on_few(band.mean, band.standard_error))
        }
    };
    let too_small = simulation.too_small().get(channel).is_some_and(|&too_small| too_small);
    FaceResult {
        few_paths: few || too_small,
        by_photons,
        by_light: by_light(scene, totals, move |_, part| flux(part, channel, area, split))
            .map(|lights| Box::new(lights.collect())),
        ..flux(totals, channel, area, split)
    }
}

fn flux(totals: &Totals, channel: usize, area: f64, split: bool) -> FaceResult {
    let flux = Sums::of(totals, channel);
    FaceResult {
        photons: totals.photons(channel),
        histories: totals.histories_in(channel),
        irradiance: flux.mean.iter().map(|f| f / area).collect(),
        irradiance_se: flux.standard_error.iter().map(|se| se.map(|se| se / area)).collect(),
        ratios: Ratios::of(totals, channel, split),
        flux: flux.mean,
        flux_se: flux.standard_error,
        ..FaceResult::default()
    }
}

/// Returns what was counted in the channel of absorbed power, of all light and of each light.
fn whole(scene: &Scene, totals: &Totals, channel: usize) -> Whole {
    let split = !totals.parts().is_empty();
    let of = |totals: &Totals| {
        let Sums { mean, standard_error } = Sums::of(totals, channel);
        let absorbed_ratios = Ratios::of(totals, channel, split);
        let absorbed_by_face = scene.asked().absorbed_by_face.then(|| {
            let first = channel - Channel::Absorbed as usize + ABSORBED_FRONT;
            let [front, back] = [first, first + 1].map(|channel| Sums::of(totals, channel));
            Box::new(AbsorbedByFace {
                front: front.mean.into_vec(),
                front_se: front.standard_error.into_vec(),
                back: back.mean.into_vec(),
                back_se: back.standard_error.into_vec(),
            })
        });
        Absorbed { absorbed: mean, absorbed_se: standard_error, absorbed_by_face, absorbed_ratios }
    };
    let Absorbed { absorbed, absorbed_se, absorbed_by_face, absorbed_ratios } = of(totals);
    Whole {
        absorbed_by_face,
        absorbed_ratios,
        absorbed: Some(absorbed),
        absorbed_se: Some(absorbed_se),
        by_light: by_light(scene, totals, |_, part| of(part)).map(Iterator::collect),
        ..Whole::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn band(name: &str, nm: Option<[f64; 2]>) -> BandResult {
        let [from_nm, to_nm] = [0, 1].map(|end| nm.map(|nm| nm[end]));
        BandResult { name: name.into(), from_nm, to_nm, sum_of: None, weights: None, unit: None }
    }

    /// Photons per area are a flux density, and PPFD where they are photosynthetic; only energy is an
    /// irradiance. A sum has the word of its own unit.
    #[test]
    fn light_has_the_word_of_its_quantity() {
        let sum = |name: &str, of: &[&str], unit: Option<[&'static str; 2]>| BandResult {
            sum_of: Some(of.iter().map(|name| name.to_string()).collect()),
            weights: unit.map(|_| vec![1.0; of.len()]),
            unit: unit.map(|[flux, irradiance]| SumUnit {
                flux: flux.into(),
                irradiance: irradiance.into(),
            }),
            ..band(name, None)
        };
        let bands = [
            band("blue", Some([400.0, 500.0])),
            band("rest", Some([500.0, 700.0])),
            band("far red", Some([700.0, 750.0])),
            sum("PAR", &["blue", "rest"], None),
            sum("lux", &["blue", "rest"], Some(["lm", "lx"])),
        ];
        let bands = &bands;
        let names = |flux| (0..bands.len()).map(move |b| light_name(bands, Some(b), flux));
        let photons: Vec<String> = names("umol/s").collect();
        let known = ["PPFD, blue", "PPFD, rest", "PFD, far red", "PPFD", "illuminance, lux"];
        assert_eq!(photons, known);
        assert_eq!(light_name(bands, None, "umol/s"), "PFD, all bands");
        assert_eq!(names("W").next().expect("a name"), "irradiance, blue");
        // a band by itself, without wavelengths
        let alone = |name, flux| light_name(&[band(name, None)], Some(0), flux);
        assert_eq!(alone("all", "umol/s"), "PFD");
        assert_eq!(alone("PAR", "umol/s"), "PPFD");
        assert_eq!(alone("PAR", "W"), "irradiance");
    }
}
