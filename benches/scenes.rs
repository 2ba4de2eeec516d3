//! The scenes of the benchmarks: shipped scenes, unchanged or changed, and a canopy of their
//! plants.

use std::{fs, path::Path};

use phylux::{
    LoadedScene, Scene, load,
    math::{Ray, Stream},
    scene::{Interaction, Lambert, Material, Transport},
};
use serde_json::{Value, json};

const SCENES: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes");

/// Loads a shipped scene.
pub fn shipped(name: &str) -> LoadedScene {
    load(&Path::new(SCENES).join(name)).expect("a shipped scene")
}

/// Loads a shipped scene with this number of bands, which all have the values of its first band.
pub fn in_bands(name: &str, bands: usize) -> LoadedScene {
    let text = fs::read_to_string(Path::new(SCENES).join(name)).expect("a shipped scene");
    let mut scene: Value = serde_json::from_str(&text).expect("JSON");
    scene["bands"] = (0..bands).map(|band| json!({ "name": band.to_string() })).collect();
    scene["sums"] = json!({});
    for part in ["materials", "lights"] {
        each(&mut scene[part], &mut |key, value| {
            if ["reflectance", "transmittance", "tint", "specular", "power"].contains(&key)
                && let Some(first) = value.as_array().map(|bands| bands[0].clone())
            {
                *value = first;
            }
        });
    }
    scene_of(scene)
}

/// Makes rows of tomato plants below a uniform sheet of light: 336 plants, half a million
/// triangles.
pub fn canopy() -> LoadedScene {
    let plant = |i: u32| {
        let (x, y) = (f64::from(i % 21) * 0.45, f64::from(i / 21) * 0.6);
        json!({ "translate": [x, y, 0], "rotate_deg": [0, 0, i * 137 % 360] })
    };
    scene_of(json!({
        "materials": { "leaf": { "type": "lambert", "reflectance": 0.5 } },
        "objects": [{ "name": "tomato", "obj": "tomato.obj", "material": "leaf",
                      "instances": (0..336).map(plant).collect::<Vec<_>>() }],
        "lights": [{ "type": "area", "name": "sheet", "power": 1,
                     "vertices": [[0, 0, 2], [0, 9, 2], [9, 9, 2], [9, 0, 2]] }]
    }))
}

/// Returns the rays between the bounces of photons in a scene with white diffuse surfaces, in the
/// order in which photons take them.
pub fn bounces(scene: &Scene, count: usize) -> Vec<Ray> {
    let white = Material::Lambert(Lambert::new(&[1.0]).unwrap());
    let mut rng = Stream::new(1, 0, 0);
    let mut rays = Vec::with_capacity(count);
    for light in scene.lights().iter().cycle() {
        let mut ray = light.emit(&mut rng);
        for _ in 0..8 {
            let Some(hit) = scene.closest(&ray) else { break };
            let interaction = Interaction::new(ray.direction, scene.surface(hit.triangle).normal);
            let Some(on) = white.sample::<[f32; 1]>(&interaction, Transport::Light, &mut rng)
            else {
                break;
            };
            ray = scene.leave(&hit, interaction.normal, on.direction);
            rays.push(ray);
            if rays.len() == count {
                return rays;
            }
        }
    }
    rays
}

/// Loads a scene in memory that uses the meshes and tables of the shipped scenes.
fn scene_of(mut scene: Value) -> LoadedScene {
    each(&mut scene, &mut |key, value| {
        if let ("obj" | "csv", Value::String(path)) = (key, value) {
            *path = format!("{SCENES}/{path}");
        }
    });
    let file = tempfile::NamedTempFile::with_suffix(".json").expect("a file");
    serde_json::to_writer(file.as_file(), &scene).expect("written");
    load(file.path()).expect("a scene")
}

/// Calls `change` with every key and its value, at all depths.
fn each(value: &mut Value, change: &mut impl FnMut(&str, &mut Value)) {
    match value {
        Value::Object(map) => map.iter_mut().for_each(|(key, value)| {
            change(key, value);
            each(value, change);
        }),
        Value::Array(values) => values.iter_mut().for_each(|value| each(value, change)),
        _ => {}
    }
}
