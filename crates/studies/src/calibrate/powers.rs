//! A scene file with the powers that a calibration has found.

use std::path::Path;

use serde_json::{Value, json};

use phylux_core::{
    error::{Error, Result, call, setting},
    scene::light::Light,
    words,
};
use phylux_files::{input::quoted, output::folder_of, scene_file::LoadedScene};
use phylux_results::{calibration::Calibration, result::ByLight};

/// Returns the JSON `document` of the scene at `path` with the powers of its lights times `factors`
/// per band. `loaded` is the same scene. Where lights are `dimmed`, their `watts` go with their power;
/// else the same lamp has turned out to emit something else. If it is to be written into another `folder` than the scene's, its
/// files are named by their full paths. Error: a light has no entry whose `power` can be set.
pub fn calibrated_scene(
    mut document: Value,
    path: &Path,
    loaded: &LoadedScene,
    factors: &ByLight<Vec<f64>>,
    dimmed: bool,
    folder: &Path,
) -> Result<Value> {
    for light in loaded.scene.lights() {
        let Some(factors) = factors.get(&light.name) else { continue };
        let entry = entry(&mut document, &light.name);
        let entry = entry.filter(|e| e.contains_key("power") || e.contains_key("radiance"));
        let Some(entry) = entry else {
            let problem = format!("light {} has no `power` that could be set", quoted(&light.name));
            return Err(Error::input(path.display(), problem).remedy(words![
                "mix its results by the factors instead (",
                call("mix").with(setting("calibration")),
                "), or give the light an entry in `lights`",
            ]));
        };
        set(entry, light.power.iter().zip(factors).map(|(p, f)| p * f));
        let watts = entry.get("watts").and_then(Value::as_f64).filter(|_| dimmed);
        match (watts, factors.first()) {
            (Some(_), Some(0.0)) => drop(entry.remove("watts")),
            (Some(watts), Some(factor)) => {
                drop(entry.insert("watts".into(), json!(watts * factor)))
            }
            _ => {}
        }
    }
    let same = |a: &Path, b: &Path| a.canonicalize().ok() == b.canonicalize().ok();
    if !same(folder, &folder_of(path)) {
        name_in_full(&mut document, &folder_of(path), loaded);
    }
    Ok(document)
}

/// Writes the power of a light per band into its entry.
fn set(entry: &mut serde_json::Map<String, Value>, power: impl Iterator<Item = f64>) {
    entry.remove("radiance");
    entry.insert("power".into(), power.collect());
}

/// The power of a light in a run whose lights are mixed as a calibration has found.
pub struct Scale {
    light: String,
    factor: f64,
    /// Per band.
    power: Vec<f64>,
}

impl Scale {
    /// The smallest change that is worth a mix of its own.
    const LEAST: f64 = 0.05;

    /// Returns the powers of the lights of a scene, whose JSON is `document`, times the factors that a calibration has found,
    /// relative to the mean of these. The powers of daylight, and of lights of OBJ files, stay. No
    /// light stays dark, so that it can be told what each brings. Empty where the factors differ by
    /// less than 5 %.
    pub fn all(calibration: &Calibration, document: &Value, loaded: &LoadedScene) -> Vec<Self> {
        let mean = |factors: &[f64]| factors.iter().sum::<f64>() / factors.len().max(1) as f64;
        let means: Vec<f64> = calibration.factors.values().map(|factors| mean(factors)).collect();
        let middle = mean(&means);
        let scale = |light: &Light| {
            let factor = mean(calibration.factors.get(&light.name)?) / middle;
            let factor = factor.clamp(0.1, 10.0);
            let power = light.power.iter().map(|power| power * factor).collect();
            Some(Self { light: light.name.clone(), factor, power })
        };
        let can_be_set = |light: &&Light| {
            let own = entry_in(document, &light.name);
            own.is_some_and(|own| own.get("power").or(own.get("radiance")).is_some())
        };
        let lights = loaded.scene.lights().iter().filter(can_be_set);
        let scales: Vec<Self> = lights.filter_map(scale).collect();
        let differs = |scale: &Self| (scale.factor - 1.0).abs() > Self::LEAST;
        match middle > 0.0 && scales.iter().any(differs) {
            true => scales,
            false => Vec::new(),
        }
    }

    /// Returns the factor that leads back to the power of the scene.
    pub fn back(&self) -> (String, f64) {
        (self.light.clone(), 1.0 / self.factor)
    }
}

/// Returns the JSON of a scene with these powers.
pub fn with_powers(mut document: Value, scales: &[Scale]) -> Value {
    for Scale { light, power, .. } in scales {
        if let Some(entry) = entry(&mut document, light) {
            set(entry, power.iter().copied());
        }
    }
    document
}

/// Returns the entry of a light, by its name or, for an entry without a name, by the default name.
fn entry<'a>(
    document: &'a mut Value,
    name: &str,
) -> Option<&'a mut serde_json::Map<String, Value>> {
    let index = index_of(document, name)?;
    document.get_mut("lights")?.get_mut(index)?.as_object_mut()
}

/// Returns the same, for reading.
fn entry_in<'a>(document: &'a Value, name: &str) -> Option<&'a Value> {
    document.get("lights")?.get(index_of(document, name)?)
}

/// Returns the index of the entry of a light.
fn index_of(document: &Value, name: &str) -> Option<usize> {
    let lights = document.get("lights")?.as_array()?;
    let is_named = |(i, light): (usize, &Value)| match light.get("name").and_then(Value::as_str) {
        Some(own) => own == name,
        None => name == format!("light{i}"),
    };
    lights.iter().enumerate().position(is_named)
}

/// Replaces every text that names a file of the scene by the full path of that file.
fn name_in_full(value: &mut Value, folder: &Path, loaded: &LoadedScene) {
    match value {
        Value::String(text) => {
            let file = folder.join(&text);
            let full = loaded.files.iter().any(|read| *read == file || folder.join(read) == file);
            if let Some(full) = full.then(|| file.canonicalize().ok()).flatten() {
                *text = full.to_string_lossy().into_owned();
            }
        }
        Value::Array(values) => values.iter_mut().for_each(|v| name_in_full(v, folder, loaded)),
        Value::Object(map) => map.values_mut().for_each(|v| name_in_full(v, folder, loaded)),
        _ => {}
    }
}
