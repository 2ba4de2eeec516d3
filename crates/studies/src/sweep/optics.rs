//! Runs that share their histories: a history brings to a captor a power in proportion to the nth
//! power of what a surface reflects, if it was reflected by it n times. So runs that differ only in
//! reflectances, transmittances and powers come from one simulation, of the scene in which each of
//! these has its largest value (Hayakawa, Spanier et al., Optics Letters 26, 2001).

use std::collections::BTreeMap;

use serde_json::{Value, json};

use phylux_core::transport::simulate::Simulation;
use phylux_files::{
    json::unescaped,
    scene_file::LoadedScene,
    sweep_file::{Parameter, Run, Sweep, hash},
};
use phylux_results::result::{FaceResult, RunResult};

/// The most runs of a simulation: each costs memory and time.
pub const MOST: usize = 24;
/// A run for which a history is worth less than this part of what it is in the brightest scene is run by
/// itself.
pub const LEAST_WORTH: f64 = 0.1;

/// Returns whether a parameter sets only numbers by which light can be scaled: reflectances and
/// transmittances, as far as the scene file alone can say.
pub fn is_optical(scene: &Value, parameter: &Parameter) -> bool {
    let number = |pointer: &String| {
        let parts: Vec<String> = pointer.split('/').skip(1).map(unescaped).collect();
        let parts: Vec<&str> = parts.iter().map(String::as_str).collect();
        let ["materials", name, keys @ ..] = &parts[..] else { return false };
        let band = |text: &str| text.parse::<usize>().is_ok();
        let (of_back, key) = match keys {
            [key] => (false, *key),
            ["back", key] => (true, *key),
            ["back", key, last] if band(last) => (true, *key),
            [key, last] if band(last) => (false, *key),
            _ => return false,
        };
        let Some(material) = scene.get("materials").and_then(|all| all.get(name)) else {
            return false;
        };
        let text = |key: &str| material.get(key).and_then(Value::as_str);
        let flag = |key: &str| material.get(key).and_then(Value::as_bool);
        let has = |key: &str| material.get(key).is_some_and(|value| !value.is_null());
        match (text("type"), of_back, key) {
            (Some("lambert" | "mirror"), false, "reflectance") => true,
            (Some("phong"), false, "transmittance") => true,
            (Some("phong"), false, "reflectance" | "specular") => {
                !(has("specular") && has("exponent"))
            }
            (Some("leaf"), _, "reflectance" | "transmittance") => !has("prospect"),
            // the tint of a solid; that of a pane is no factor on light, as light goes to and fro
            // in it
            (Some("transparent"), false, "tint") => flag("thin") != Some(true),
            (Some("leaf"), false, "tint") => flag("thin") == Some(false),
            _ => false,
        }
    };
    !parameter.is_read && parameter.at.iter().all(number)
}

/// Returns whether the values of a run by which light is scaled are possible ones, as far as each can be
/// told by itself.
pub fn is_possible(sweep: &Sweep, run: usize, scale: &[bool]) -> bool {
    fn fits(value: &Value, most: f64) -> bool {
        match value {
            Value::Array(all) => all.iter().all(|value| fits(value, most)),
            one => one.as_f64().is_some_and(|value| (0.0..=most).contains(&value)),
        }
    }
    let run = sweep.run(run);
    run.values.iter().zip(scale).filter(|(_, scales)| **scales).all(|((parameter, value), _)| {
        parameter.at.iter().all(|place| {
            let most = if place.starts_with("/materials/") { 1.0 } else { 1e30 };
            fits(&sweep.value_at(&run, value, place), most)
        })
    })
}

/// The scene that is run for several runs: each number by which light is scaled has its largest value
/// among them.
#[derive(Debug)]
pub struct Brightest {
    /// The scene file. Its runs keep account of these numbers.
    pub document: Value,
    /// The places of these numbers, as JSON pointers.
    pub places: Vec<String>,
}

impl Brightest {
    /// Makes the scene for runs that differ only in parameters that `scale` light. `None` if something
    /// in the scene goes beyond what the histories of another run can tell, or if the values are no
    /// numbers.
    pub fn new(sweep: &Sweep, runs: &[usize], scale: &[bool]) -> Option<Self> {
        let first = sweep.run(*runs.first()?);
        let mut document = sweep.document(&first);
        let setting = |key| document.pointer(&format!("/settings/{key}")).filter(|v| !v.is_null());
        let limits = ["tolerance", "max_time"].into_iter().any(|key| setting(key).is_some());
        let by_light = setting("by_light").is_some_and(|value| *value != false);
        let nearest = setting("k").is_some_and(|value| *value != 0);
        let more = ["layers", "sensitivity", "uncertain"];
        let more = more.into_iter().any(|key| document.get(key).is_some_and(|v| !v.is_null()));
        if limits || by_light || nearest || more {
            return None;
        }
        let mut largest: BTreeMap<String, Value> = BTreeMap::new();
        for &run in runs {
            let run = sweep.run(run);
            let scaling = run.values.iter().zip(scale).filter(|(_, scales)| **scales);
            for ((parameter, value), _) in scaling {
                for place in &parameter.at {
                    let value = sweep.value_at(&run, value, place);
                    let before = largest.entry(place.clone()).or_insert_with(|| value.clone());
                    *before = larger(before, &value)?;
                }
            }
        }
        let places = largest.keys().cloned().collect();
        let mut names: Vec<String> = Vec::new();
        for (place, value) in largest {
            *document.pointer_mut(&place)? = value;
            names.push(name_of(&document, &place)?);
        }
        names.sort();
        names.dedup();
        document.as_object_mut()?.insert("sensitivity".into(), json!(names));
        Some(Self { document, places })
    }

    /// Returns the scene file of a run that keeps account of the same numbers.
    pub fn counting(&self, mut document: Value) -> Value {
        document["sensitivity"] = self.document["sensitivity"].clone();
        document
    }

    /// Returns the SHA-256 of the scene.
    pub fn hash(&self) -> String {
        hash(self.document.to_string().as_bytes())
    }
}

/// Returns the larger of two numbers, or of each pair in two lists; `None` of anything else, and of
/// numbers below 0.
fn larger(a: &Value, b: &Value) -> Option<Value> {
    match (a, b) {
        (Value::Array(a), Value::Array(b)) if a.len() == b.len() => {
            a.iter().zip(b).map(|(a, b)| larger(a, b)).collect()
        }
        _ => {
            let (x, y) = (a.as_f64()?, b.as_f64()?);
            (x >= 0.0 && y >= 0.0).then(|| if y > x { b.clone() } else { a.clone() })
        }
    }
}

/// Returns the name of the material or light to which a place belongs.
fn name_of(document: &Value, place: &str) -> Option<String> {
    let mut parts = place.split('/').skip(1).map(unescaped);
    match (parts.next()?.as_str(), parts.next()?) {
        ("materials", name) => Some(name),
        ("lights", index) => {
            let name = document.get("lights")?.get(index.parse::<usize>().ok()?)?.get("name");
            Some(name.and_then(Value::as_str).map_or(format!("light{index}"), String::from))
        }
        _ => None,
    }
}

/// Makes the brightest scene of runs, whose numbers stand at these places, ready to be run for all of
/// them. `None` if one of them is no scene, or if it cannot tell what that finds, as of solid leaves:
/// they are then run one by one.
pub fn shared(
    brightest: LoadedScene,
    places: &[String],
    runs: impl Iterator<Item = Option<LoadedScene>>,
) -> Option<LoadedScene> {
    let LoadedScene { mut scene, .. } = brightest;
    let is_known = |place: &String| {
        scene.parameters().all().iter().any(|parameter| {
            let rest = place.strip_prefix(&parameter.name);
            rest.is_some_and(|rest| rest.is_empty() || rest.starts_with('/'))
                && !parameter.values.is_empty()
        })
    };
    if !places.iter().all(is_known) {
        return None;
    }
    for run in runs {
        scene = scene.with_variant(&run?.scene).ok()?;
    }
    Some(LoadedScene { scene, ..brightest })
}

/// Returns the results of a run from the simulation that it shares, and of which `brightest` are the
/// results, by its index among those that share it; `None` if the histories tell too little about it.
pub fn of_run(
    (simulation, brightest): (&Simulation, &RunResult),
    index: usize,
    run: &LoadedScene,
) -> Option<RunResult> {
    let mut own = RunResult::new(&simulation.of_variant(index, &run.scene));
    let worth = worth(brightest, &own);
    own.shared = Some(worth.min(1.0));
    (worth >= LEAST_WORTH).then_some(own)
}

/// Returns how much a history is worth for a run, relative to what it is for the scene in which it was
/// traced: the ratio of relative variances in the median over captors, faces and bands. 0 where nothing
/// is known.
fn worth(all: &RunResult, own: &RunResult) -> f64 {
    let relative = |face: &FaceResult, band: usize| {
        let (value, error) = (face.flux[band], face.flux_se[band]?);
        (value > 0.0 && error > 0.0).then(|| (error / value).powi(2))
    };
    let pairs = all.captors.iter().zip(&own.captors);
    let faces = pairs.flat_map(|(all, own)| all.faces().zip(own.faces()));
    let ratios = faces.flat_map(|(all, own)| {
        let bands = 0..all.flux.len();
        bands.filter_map(move |band| Some(relative(all, band)? / relative(own, band)?))
    });
    let mut ratios: Vec<f64> = ratios.collect();
    ratios.sort_by(f64::total_cmp);
    ratios.get(ratios.len() / 2).copied().unwrap_or(0.0)
}

/// Returns whether runs differ in one of these parameters.
pub fn vary(sweep: &Sweep, runs: &[usize], parameters: &[bool]) -> bool {
    let choices = |run: &usize| -> Vec<usize> {
        let Run { choices, .. } = sweep.run(*run);
        choices.into_iter().zip(parameters).filter(|(_, counts)| **counts).map(|(c, _)| c).collect()
    };
    let mut all = runs.iter().map(choices);
    let first = all.next();
    all.any(|other| Some(other) != first)
}
