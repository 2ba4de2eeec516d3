//! Makes a field of plants that has no edge, in memory, and prints what its leaves absorb by height.
//! The plants stand in a cell that repeats for ever. Run it with
//! `cargo run --release --example field`.

use glam::DVec3;
use phylux::{
    Control, RunResult, Settings,
    formats::{Mesh, SceneBuilder, spec::*},
    math::Stream,
    simulate,
    transport::{NearestCount, PhotonCount},
};

/// Number of plants along each side of the cell, which is 1 m long.
const PLANTS: usize = 4;
/// Number of leaves of a plant, one above the other.
const LEAVES: usize = 8;

fn main() -> phylux::Result<()> {
    let place = |i: usize| (i as f64 + 0.5) / PLANTS as f64;
    let places = (0..PLANTS * PLANTS).map(|i| [place(i % PLANTS), place(i / PLANTS), 0.0]);
    let mut scene = SceneBuilder::new()
        .material("leaf", LeafSpec::new(0.08, 0.05))
        .material("soil", LambertSpec::new(0.15))
        .mesh("soil", square(1.0)?)
        .object(ObjectSpec { ground: true, ..ObjectSpec::mesh("soil", "soil").captor() })
        .light(SkySpec {
            model: SkyModelSpec::Overcast,
            irradiance: Some(100.0.into()),
            ..SkySpec::default()
        })
        .periodic([0.0, 1.0], [0.0, 1.0])
        .layers(0.2);
    let mut rng = Stream::new(1, 0, 0);
    for leaf in 0..LEAVES {
        let name = format!("leaf {leaf}");
        scene = scene
            .mesh(&name, disc(0.1, 0.1 + 0.1 * leaf as f64, &mut rng)?)
            .object(ObjectSpec::mesh(&name, "leaf").captor().at(places.clone()));
    }
    let loaded = scene.build()?;

    let settings = Settings {
        photons: Some(PhotonCount::new(200_000)?),
        k: Some(NearestCount::NONE),
        ..loaded.settings
    };
    let simulation = simulate(&loaded.scene, &settings, &Control::default())?;
    let result = RunResult::new(&simulation);
    for layer in result.extras.layers.iter().flatten().rev() {
        println!(
            "{:.1} to {:.1} m: {:6.2} +- {:.2} W",
            layer.from,
            layer.to,
            layer.absorbed[0],
            layer.absorbed_se[0].unwrap_or(f64::NAN)
        );
    }
    Ok(())
}

/// Returns a level square from the origin to (`side`, `side`), m.
fn square(side: f64) -> phylux::Result<Mesh> {
    let corners = [[0.0, 0.0], [side, 0.0], [side, side], [0.0, side]];
    let corners = corners.map(|[x, y]| DVec3::new(x, y, 0.0));
    Mesh::from_faces(&corners, &[[0, 1, 2], [0, 2, 3]])
}

/// Returns a leaf of eight corners at a height, m, that leans to a side drawn at random.
fn disc(radius: f64, height: f64, rng: &mut Stream) -> phylux::Result<Mesh> {
    let lean = std::f64::consts::TAU * f64::from(rng.uniform());
    let corner = |i: usize| {
        let angle = std::f64::consts::TAU * i as f64 / 8.0;
        let rise = 0.4 * radius * (angle - lean).cos();
        DVec3::new(radius * angle.cos(), radius * angle.sin(), height + rise)
    };
    let corners: Vec<DVec3> = (0..8).map(corner).collect();
    let faces: Vec<[usize; 3]> = (1..7).map(|i| [0, i, i + 1]).collect();
    Mesh::from_faces(&corners, &faces)
}
