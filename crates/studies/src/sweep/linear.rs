//! Runs that share a simulation: light is linear in the powers of the lights, so runs that differ
//! in nothing else come from one simulation; those that differ in reflectances and transmittances, too,
//! share its histories (`optics`).

use std::collections::{BTreeMap, HashMap};

use serde_json::Value;
use sha2::{Digest, Sha256};

use super::{
    control::{Planning, SweepControl},
    optics::{self, Brightest},
};
use phylux_core::{error::Result, scene::world::Scene, transport::simulate::Simulation};
use phylux_files::{
    scene_file::LoadedScene,
    sweep_file::{Parameter, Run, Sweep, hash},
};
use phylux_results::result::RunResult;

/// Range of the powers of a scene, W or umol/s.
const POWERS: std::ops::RangeInclusive<f64> = 1e-30..=1e30;

/// Runs of a sweep that are done together.
#[derive(Clone, Debug)]
pub struct Job {
    /// Indices of the runs, in order.
    pub runs: Vec<usize>,
    /// SHA-256 of the scene that is run for all of them; `None` for a single run of its own.
    pub base: Option<String>,
    /// Whether the runs differ in reflectances or transmittances and share the histories of that scene,
    /// and not in powers alone.
    pub histories: bool,
}

/// All jobs of a sweep. They depend only on the whole sweep, not on which of its runs are done.
#[derive(Debug)]
pub struct Jobs {
    /// Jobs in the order of their first runs.
    pub jobs: Vec<Job>,
    of_run: Vec<u32>,
}

impl Jobs {
    /// Finds the jobs of a sweep. Error: stopped by `control`.
    pub fn new(sweep: &Sweep, control: &SweepControl) -> Result<Self> {
        let all = sweep.runs().len();
        let planning = control.planning(all);
        let powers: Vec<bool> = sweep.parameters().iter().map(sets_powers).collect();
        let scale = scaling(sweep);
        let optical: Vec<bool> = scale.iter().zip(&powers).map(|(a, b)| *a && !*b).collect();
        let mut jobs: Vec<Job> = Vec::new();
        for runs in alike(sweep, (0..all).collect(), &scale) {
            match optics::vary(sweep, &runs, &optical) {
                true => jobs.extend(sharing_histories(sweep, runs, &scale, &powers, &planning)?),
                false => jobs.extend(settled(sweep, runs, &planning)?),
            }
        }
        jobs.sort_by_key(|job| job.runs[0]);
        let mut of_run = vec![0; all];
        for (j, job) in jobs.iter().enumerate() {
            job.runs.iter().for_each(|&run| of_run[run] = j as u32);
        }
        Ok(Self { jobs, of_run })
    }

    /// Returns the index of the job that does a run.
    pub fn of(&self, run: &Run) -> usize {
        self.of_run[run.number - 1] as usize
    }

    /// Returns the hash of the scene that is run in place of a run's own, see [`Job::base`].
    pub fn base(&self, run: &Run) -> Option<&str> {
        self.jobs[self.of(run)].base.as_deref()
    }
}

fn sets_powers(parameter: &Parameter) -> bool {
    Powers::of(parameter).is_some()
}

/// Returns for each parameter whether it sets only numbers by which light is scaled.
pub fn scaling(sweep: &Sweep) -> Vec<bool> {
    let scales = |p: &Parameter| sets_powers(p) || optics::is_optical(sweep.scene(), p);
    sweep.parameters().iter().map(scales).collect()
}

/// Parts runs into those that differ only in parameters that `may` differ.
fn alike(sweep: &Sweep, runs: Vec<usize>, may: &[bool]) -> Vec<Vec<usize>> {
    if !may.contains(&true) {
        return runs.into_iter().map(|run| vec![run]).collect();
    }
    let mut known: HashMap<(Vec<usize>, u64), usize> = HashMap::new();
    let mut parts: Vec<Vec<usize>> = Vec::new();
    for index in runs {
        let run = sweep.run(index);
        let others = run.choices.iter().zip(may).filter(|(_, may)| !**may);
        let others = others.map(|(&choice, _)| choice).collect();
        let next = parts.len();
        let part = *known.entry((others, run.seed)).or_insert(next);
        if part == next {
            parts.push(Vec::new());
        }
        parts[part].push(index);
    }
    parts
}

/// Returns jobs whose runs share their histories, or where that is not possible, those of runs that
/// differ in powers alone. Error: `planning` is stopped.
fn sharing_histories(
    sweep: &Sweep,
    runs: Vec<usize>,
    scale: &[bool],
    powers: &[bool],
    planning: &Planning,
) -> Result<Vec<Job>> {
    let mut jobs: Vec<Job> = Vec::new();
    let by_powers = |jobs: &mut Vec<Job>, runs| -> Result<()> {
        for runs in alike(sweep, runs, powers) {
            jobs.extend(settled(sweep, runs, planning)?);
        }
        Ok(())
    };
    let possible = |run: &usize| optics::is_possible(sweep, *run, scale);
    let (runs, impossible): (Vec<usize>, Vec<usize>) = runs.into_iter().partition(possible);
    by_powers(&mut jobs, impossible)?;
    for some in runs.chunks(optics::MOST).map(<[usize]>::to_vec) {
        match Brightest::new(sweep, &some, scale).filter(|_| some.len() > 1) {
            Some(base) => {
                planning.add(some.len() as f64)?;
                jobs.push(Job { base: Some(base.hash()), histories: true, runs: some })
            }
            None => by_powers(&mut jobs, some)?,
        }
    }
    Ok(jobs)
}

/// Decides which scene is run for runs that differ in powers alone. Runs for which that is not possible
/// get jobs of their own. Error: `planning` is stopped.
fn settled(sweep: &Sweep, runs: Vec<usize>, planning: &Planning) -> Result<Vec<Job>> {
    let alone = |run| Job { runs: vec![run], base: None, histories: false };
    let place = if runs.len() > 1 { Place::of(sweep, &runs) } else { None };
    let Some(place) = place else {
        planning.add(runs.len() as f64)?;
        return Ok(runs.into_iter().map(alone).collect());
    };
    // each run is looked at three times, here and for the largest powers
    let third = || planning.add(1.0 / 3.0);
    let (mut sound, mut jobs) = (Vec::new(), Vec::new());
    for run in runs {
        third()?;
        match place.powers(sweep, run) {
            Some(_) => sound.push(run),
            None => jobs.push(alone(run)),
        }
    }
    let base = match Place::of(sweep, &sound) {
        Some(place) => Base::of(sweep, place, &sound, &third)?,
        None => None,
    };
    match base {
        Some(base) if sound.len() > 1 => {
            jobs.push(Job { runs: sound, base: Some(base.hash()), histories: false })
        }
        _ => jobs.extend(sound.into_iter().map(alone)),
    }
    Ok(jobs)
}

/// The lights whose powers a parameter sets, each with a band if the parameter sets only that band.
struct Powers(Vec<(usize, Option<usize>)>);

impl Powers {
    /// `None` for a parameter that sets anything else, or that expressions of other parameters
    /// read.
    fn of(parameter: &Parameter) -> Option<Self> {
        if parameter.is_read {
            return None;
        }
        let place = |pointer: &String| {
            let mut words = pointer.strip_prefix("/lights/")?.split('/');
            let (light, power, band) = (words.next()?, words.next()?, words.next());
            let band = band.map(|band| band.parse().ok());
            (power == "power" && words.next().is_none() && band != Some(None))
                .then_some((light.parse().ok()?, band.flatten()))
        };
        parameter.at.iter().map(place).collect::<Option<_>>().map(Self)
    }
}

/// The scene that some runs share, except for powers.
struct Place {
    document: Value,
    bands: usize,
    /// The lights whose powers each parameter of the sweep sets; `None` where it sets anything else.
    set: Vec<Option<Powers>>,
}

impl Place {
    /// Takes the scene of the first of these runs. `None` if the results may not be linear in the
    /// powers.
    fn of(sweep: &Sweep, runs: &[usize]) -> Option<Self> {
        let document = sweep.document(&sweep.run(*runs.first()?));
        let setting = |key| document.pointer(&format!("/settings/{key}")).filter(|v| !v.is_null());
        // results that are split by light are those of photons, whatever a trial would choose
        let photons = setting("estimator")
            .is_none_or(|estimator| estimator == "photons" || estimator == "auto");
        // what results depend on is kept by lamp, not by what varies together
        let depends =
            |key| document.get(key).is_some_and(|value| !value.is_null() && *value != false);
        let limits = setting("tolerance").is_some() || setting("max_time").is_some();
        if !photons || limits || depends("sensitivity") || depends("uncertain") {
            return None;
        }
        let bands =
            document.get("bands").map_or(Some(1), |bands| bands.as_array().map(Vec::len))?;
        let set = sweep.parameters().iter().map(Powers::of).collect();
        Some(Self { document, bands, set })
    }

    /// Returns the power per band of each light that varies in a run. `None` if one of the values
    /// is no power.
    fn powers(&self, sweep: &Sweep, run: usize) -> Option<BTreeMap<usize, Vec<f64>>> {
        let mut powers = BTreeMap::new();
        let run = sweep.run(run);
        for ((parameter, value), set) in run.values.iter().zip(&self.set) {
            let Some(Powers(lights)) = set else { continue };
            for (&(light, band), place) in lights.iter().zip(&parameter.at) {
                let value = sweep.value_at(&run, value, place);
                let own = || self.document.pointer(&format!("/lights/{light}/power")).cloned();
                let power: &mut Value = powers.entry(light).or_insert(own()?);
                match band {
                    Some(band) => *power.get_mut(band)? = value,
                    None => *power = value,
                }
            }
        }
        let sound = |power: &f64| *power == 0.0 || POWERS.contains(power);
        let spread = |(light, power): (usize, Value)| {
            let each = match power {
                Value::Array(each) => {
                    each.iter().map(Value::as_f64).collect::<Option<Vec<f64>>>()?
                }
                one => vec![one.as_f64()?; self.bands],
            };
            (each.len() == self.bands && each.iter().all(sound)).then_some((light, each))
        };
        powers.into_iter().map(spread).collect()
    }
}

/// The scene that is run for several runs: each light has its largest power among them.
pub struct Base {
    /// The scene file.
    pub document: Value,
    /// The part in which each varying light is counted, from 1. Lights that always vary alike share
    /// a part. All other lights are in part 0.
    part_of: BTreeMap<usize, usize>,
}

impl Base {
    /// Makes the scene for runs that differ only in powers. `None` if there are sums over bands
    /// or their ratios, and bands do not vary alike: the errors would be lost.
    pub fn new(sweep: &Sweep, runs: &[usize]) -> Option<Self> {
        Self::of(sweep, Place::of(sweep, runs)?, runs, &|| Ok(())).ok().flatten()
    }

    /// Makes the scene for runs with a `place`, as [`Base::new`] does; `look` is called twice for
    /// each run. Error: that of `look`.
    fn of(
        sweep: &Sweep,
        place: Place,
        runs: &[usize],
        look: &dyn Fn() -> Result<()>,
    ) -> Result<Option<Self>> {
        let mut largest: BTreeMap<usize, Vec<f64>> = BTreeMap::new();
        for &run in runs {
            look()?;
            let Some(powers) = place.powers(sweep, run) else { return Ok(None) };
            for (light, power) in powers {
                let most = largest.entry(light).or_insert_with(|| power.clone());
                most.iter_mut().zip(&power).for_each(|(most, power)| *most = most.max(*power));
            }
        }
        let has_sums = ["sums", "ratios"].into_iter().any(|key| {
            let entries = place.document.get(key).and_then(Value::as_object);
            entries.is_some_and(|entries| !entries.is_empty())
        });
        let mut variations: BTreeMap<usize, Sha256> = BTreeMap::new();
        for &run in runs {
            look()?;
            for (light, power) in place.powers(sweep, run).unwrap_or_default() {
                let factors = factors(&power, &largest[&light]);
                let lit = factors.iter().zip(&largest[&light]).filter(|(_, most)| **most > 0.0);
                let lit: Vec<f64> = lit.map(|(factor, _)| *factor).collect();
                if has_sums && lit.iter().any(|factor| (factor - lit[0]).abs() > 1e-12) {
                    return Ok(None);
                }
                let variation = variations.entry(light).or_default();
                factors.iter().for_each(|factor| variation.update(factor.to_le_bytes()));
            }
        }
        let mut parts = HashMap::new();
        let mut part_of = BTreeMap::new();
        for (light, variation) in variations {
            let next = parts.len() + 1;
            let digest: [u8; 32] = variation.finalize().into();
            part_of.insert(light, *parts.entry(digest).or_insert(next));
        }
        let mut document = place.document;
        for (light, power) in largest {
            let Some(there) = document.pointer_mut(&format!("/lights/{light}/power")) else {
                return Ok(None);
            };
            *there = power.into();
        }
        Ok(Some(Self { document, part_of }))
    }

    /// Returns the SHA-256 of the scene.
    pub fn hash(&self) -> String {
        hash(self.document.to_string().as_bytes())
    }

    /// Returns the part of each light of the scene.
    pub fn parts(&self, scene: &Scene) -> Vec<usize> {
        // lights of MTL entries may come before or after those of the file, so names are compared
        let lights = self.document.get("lights").and_then(Value::as_array);
        let name = |(i, light): (usize, &Value)| {
            let name = light.get("name").and_then(Value::as_str);
            (name.map_or(format!("light{i}"), String::from), self.part_of.get(&i).copied())
        };
        let named: HashMap<String, Option<usize>> =
            lights.into_iter().flatten().enumerate().map(name).collect();
        let part = |name: &str| named.get(name).copied().flatten().unwrap_or(0);
        scene.lights().iter().map(|light| part(&light.name)).collect()
    }
}

/// Returns the results of `run`, whose scene is that of `simulation` with other powers. The
/// simulation was split by `part_of`, the part of each light.
pub fn at_powers(simulation: &Simulation, part_of: &[usize], run: &LoadedScene) -> RunResult {
    let parts = part_of.iter().max().map_or(0, |last| last + 1);
    let base = simulation.scene();
    let mut of_parts = vec![vec![0.0f64; base.bands().len()]; parts];
    for ((was, is), &part) in base.lights().iter().zip(run.scene.lights()).zip(part_of) {
        let factors = factors(&is.power, &was.power);
        // a light that is dark in a band has the factor 0 there, which changes no maximum
        of_parts[part].iter_mut().zip(factors).for_each(|(all, factor)| *all = all.max(factor));
    }
    RunResult::new(&simulation.at_powers(&run.scene, part_of, &of_parts))
}

/// Returns the factors of `power` over `largest`, per band; 0 where `largest` is 0.
fn factors(power: &[f64], largest: &[f64]) -> Vec<f64> {
    let factor = |(power, most): (&f64, &f64)| if *most > 0.0 { power / most } else { 0.0 };
    power.iter().zip(largest).map(factor).collect()
}
