//! Compares the light below five covers of a greenhouse: one scene for each, all of them traced in
//! parallel. Run it with `cargo run --release --example materials`.

use phylux::{
    Control, FlatResult, LoadedScene, Settings,
    formats::{Mesh, SceneBuilder, spec::*},
    scene::Channel,
    simulate,
    transport::{NearestCount, PhotonCount, ThreadCount},
};
use rayon::prelude::*;

/// A cover's name, and what it lets through straight on and diffusely, at 0 and 80 degrees.
const COVERS: [(&str, [f64; 2], [f64; 2]); 5] = [
    ("none", [1.0, 1.0], [0.0, 0.0]),
    ("clear glass", [0.9, 0.5], [0.0, 0.0]),
    ("low-haze glass", [0.6, 0.33], [0.3, 0.17]),
    ("diffuse glass", [0.2, 0.1], [0.7, 0.4]),
    ("whitewash", [0.1, 0.05], [0.35, 0.25]),
];

fn main() -> phylux::Result<()> {
    let results: phylux::Result<Vec<(f64, f64)>> = COVERS.par_iter().map(below).collect();
    for ((name, ..), (flux, error)) in COVERS.iter().zip(results?) {
        println!("{name:<15} {flux:6.1} +- {error:.1} W/m2");
    }
    Ok(())
}

/// Returns the irradiance on a sensor below a cover, W/m2, and its standard error.
fn below(cover: &(&str, [f64; 2], [f64; 2])) -> phylux::Result<(f64, f64)> {
    let LoadedScene { scene, .. } = greenhouse(cover)?;
    let settings = Settings {
        photons: Some(PhotonCount::new(200_000)?),
        k: Some(NearestCount::NONE),
        threads: ThreadCount::ONE,
        ..Settings::default()
    };
    let simulation = simulate(&scene, &settings, &Control::default())?;
    let (flux, error) = FlatResult::new(&simulation).get(0, Channel::Front, 0);
    Ok((flux / scene.captors()[0].area, error / scene.captors()[0].area))
}

/// Builds a roof of 20 m x 20 m above a sensor, under the sun of a clear day.
fn greenhouse((_, direct, diffuse): &(&str, [f64; 2], [f64; 2])) -> phylux::Result<LoadedScene> {
    let corner = |x, y| glam::DVec3::new(x, y, 4.0);
    let corners = [corner(-10., -10.), corner(10., -10.), corner(10., 10.), corner(-10., 10.)];
    let by_angle = |values: &[f64; 2]| Some(values.map(PerBand::from).into());
    let cover = TableSpec {
        angles_deg: Some(vec![0.0, 80.0]),
        direct: by_angle(direct),
        diffuse: by_angle(diffuse),
        ..TableSpec::default()
    };
    let sun = SunSpec { irradiance: Some(800.0.into()), ..SunSpec::default() };
    SceneBuilder::new()
        .sun_at(50.0, 180.0)
        .material("cover", cover)
        .mesh("roof", Mesh::from_faces(&corners, &[[0, 1, 2], [0, 2, 3]])?)
        .object(ObjectSpec::mesh("roof", "cover"))
        .light(sun)
        .captor(CaptorSpec::disc("sensor", [0.0, 0.0, 1.0], [0.0, 0.0, 1.0], 0.5))
        .build()
}
