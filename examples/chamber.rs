//! Builds a growth chamber in memory and prints the PPFD that three sensors on its shelf and two
//! plants receive. No file is read or written. Run it with `cargo run --release --example chamber`.

use glam::DVec3;
use phylux::{
    Control, FlatResult, Settings,
    formats::{Mesh, SceneBuilder, spec::*},
    math::Quantity,
    scene::Channel,
    simulate,
    transport::{NearestCount, PhotonCount},
};

fn main() -> phylux::Result<()> {
    let sensor = |x: f64| {
        let name = format!("sensor at x = {x} m");
        CaptorSpec::disc(&name, [x, 0.25, 0.1], [0.0, 0.0, 1.0], 0.02)
    };
    let loaded = SceneBuilder::new()
        .quantity(Quantity::Micromole)
        .band("PAR", 400.0, 700.0)
        .material("white paint", LambertSpec::new(0.8))
        .material("leaf", LeafSpec::new(0.07, 0.04))
        .mesh("walls", room()?)
        .mesh("plant", Mesh::from_faces(&leaf_corners(), &[[0, 1, 2], [0, 2, 3]])?)
        .object(ObjectSpec::mesh("walls", "white paint"))
        .object(ObjectSpec::mesh("plant", "leaf").captor().at([[0.3, 0.5, 0.2], [0.7, 0.5, 0.25]]))
        .light(TubeSpec::new([0.1, 0.5, 0.95], [0.9, 0.5, 0.95], 0.013, 100.0))
        .captor(sensor(0.2))
        .captor(sensor(0.5))
        .captor(sensor(0.8))
        .build()?;

    let settings = Settings {
        photons: Some(PhotonCount::new(1_000_000)?),
        k: Some(NearestCount::NONE),
        ..loaded.settings
    };
    let simulation = simulate(&loaded.scene, &settings, &Control::default())?;
    let found = FlatResult::new(&simulation);
    for (c, captor) in loaded.scene.captors().iter().enumerate() {
        let (flux, error) = found.get(c, Channel::Front, 0);
        let (ppfd, error) = (flux / captor.area, error / captor.area);
        println!("{:<22} {ppfd:6.1} +- {error:.1} umol/m2/s", captor.id);
    }
    Ok(())
}

/// Returns the walls of a cube of 1 m, whose fronts face inwards.
fn room() -> phylux::Result<Mesh> {
    let corner = |i: usize| DVec3::new((i & 1) as f64, (i >> 1 & 1) as f64, (i >> 2) as f64);
    let vertices: Vec<DVec3> = (0..8).map(corner).collect();
    let walls =
        [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]];
    let faces: Vec<[usize; 3]> =
        walls.iter().flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]]).collect();
    Mesh::from_faces(&vertices, &faces)
}

/// Returns the corners of a leaf of 16 x 10 cm that is slightly bent.
fn leaf_corners() -> [DVec3; 4] {
    [[-0.08, 0.0, 0.0], [0.0, -0.05, 0.02], [0.08, 0.0, 0.0], [0.0, 0.05, 0.02]].map(DVec3::from)
}
