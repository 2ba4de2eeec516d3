//! Photons that are split into several flights, for captors that are no surfaces.

use std::f64::consts::PI;

use serde_json::json;

use crate::{
    exact::Comparisons,
    world::{Mesh, World, back, front, room, room_with_leaf},
};

fn split(world: World, flights: u64) -> World {
    world.with("settings", json!({ "splitting": flights }))
}

/// Walls of reflectance 0.5 that emit L / 2, and between them a mirror, a pane of glass and a leaf that keep
/// nothing: irradiance pi L at any place and tilt, from both sides.
/// Seed 1, 2.8e6 photons of 6 flights, standard errors at most 0.5 %; 6 comparisons, odds of a
/// false alarm 7e-4.
#[test]
fn furnace_of_split_photons() {
    let walls = room([-1.0; 3], [1.0; 3]);
    let world = World::new()
        .lambert("wall", 0.5)
        .material("mirror", json!({ "type": "mirror", "reflectance": 1 }))
        .material("pane", json!({ "type": "transparent", "ior": 1.52, "thin": true }))
        .material("leaf", json!({ "type": "leaf", "reflectance": 0.55, "transmittance": 0.45 }))
        .glowing("walls", "wall", &walls, 5.0)
        .surface("mirror", "mirror", &Mesh::square([0.5, 0.0, 0.4], [0.0, 0.6, 0.8], 0.5))
        .surface("pane", "pane", &Mesh::square([-0.5, 0.3, 0.0], [0.8, 0.0, 0.6], 0.6))
        .surface("leaf", "leaf", &Mesh::square([0.2, -0.4, -0.4], [0.6, 0.0, 0.8], 0.6))
        .captor_of_both_sides("level", &Mesh::square([0.0, 0.1, -0.1], [0.0, 0.0, 1.0], 0.3))
        .captor_of_both_sides("tilted", &Mesh::square([-0.3, -0.5, 0.5], [0.6, 0.8, 0.0], 0.3))
        .captor_of_both_sides("wall", &Mesh::square([-0.99, 0.5, 0.3], [1.0, 0.0, 0.0], 0.3));
    let run = split(world, 6).run(2_800_000, 1);
    let mut check = Comparisons::new("furnace, split", 0.005);
    for name in ["level", "tilted", "wall"] {
        check.irradiance(format!("{name}, front"), front(&run, name), 0, PI * 10.0);
        check.irradiance(format!("{name}, back"), back(&run, name), 0, PI * 10.0);
    }
    check.finish(6);
}

/// A room with a leaf, six tiles side by side, and a lamp of each kind.
fn lit_room() -> World {
    room_with_leaf(6, 0.3)
        .light(json!({ "type": "point", "position": [0.1, 0.2, 0.7], "power": [3, 4] }))
        .light(json!({ "type": "tube", "from": [-0.5, 0, 0.9], "to": [0.5, 0, 0.9],
                       "radius": 0.02, "power": [2, 0.1] }))
        .light(json!({ "type": "spot", "position": [0.5, 0, 0.9], "direction": [0, 0, -1],
                       "half_angle_deg": 60, "power": [1, 1] }))
        .lamp("panel", &Mesh::square([-0.6, -0.6, 0.8], [0.0, 0.0, -1.0], 0.3), 1.0)
}

/// The same light, by all kinds of lamps: 12 differences of split photons from others, each within 4 of
/// its standard errors. Few flights reach a tile, so that 8 have little more than an eighth of the
/// variance: it falls 5 to 10 times (a mean over 6 tiles, each ratio with a spread of 18 %, that is
/// 7 %; the two bands are linked). Seeds 1 and 2; odds of a false alarm 1.5e-3.
#[test]
fn the_same_with_less_variance() {
    let whole = lit_room().run(200_000, 1);
    let run = split(lit_room(), 8).run(200_000, 2);
    assert_eq!((whole.splitting, run.splitting), (None, Some(8)));
    let (mut squares, mut split_squares, mut compared) = (0.0, 0.0, 0);
    let tiles = |result: &phylux::RunResult| {
        let tiles = result.captors.iter().filter(|c| c.id.starts_with("tiles/"));
        tiles.map(|c| c.front.clone()).collect::<Vec<_>>()
    };
    for (a, b) in tiles(&whole).iter().zip(&tiles(&run)) {
        for band in 0..2 {
            let [own, split] = [a, b].map(|face| face.flux_se[band].expect("an error"));
            let off = (a.flux[band] - b.flux[band]).abs();
            assert!(off < 4.0 * own.hypot(split), "{off} {own} {split}");
            squares += (own / a.flux[band]).powi(2);
            split_squares += (split / b.flux[band]).powi(2);
            compared += 1;
        }
    }
    assert_eq!(compared, 12);
    let gain = squares / split_squares;
    assert!(gain > 5.0 && gain < 10.0, "{gain}");
}

/// A lamp in a black room, and before it a square that covers a sixth of all directions: of N photons of M flights
/// N M / 6 arrive, of N (1 - (5/6)^M) histories. 20,000 photons of 8 flights, seed 1, each number within 5 standard
/// deviations; 2 comparisons, odds of a false alarm 1e-6. Where nothing is split both are the same.
#[test]
fn flights_of_one_photon_are_one_history() {
    let world = World::new()
        .lambert("black", 0.0)
        .surface("room", "black", &room([-1.0; 3], [1.0; 3]))
        .captor("square", &Mesh::square([0.0, 0.0, 0.5], [0.0, 0.0, -1.0], 1.0))
        .light(json!({ "type": "point", "position": [0, 0, 0], "power": 1 }));
    let (photons, chance) = (20_000.0, 1.0f64 / 6.0);
    for flights in [1, 8] {
        let run = split(world.clone(), flights).run(20_000, 1);
        let face = &run.captors[0].front;
        let expect = |found: u64, of: f64, chance: f64| {
            let z = (found as f64 - of * chance) / (of * chance * (1.0 - chance)).sqrt();
            assert!(z.abs() < 5.0, "{flights} flights: {found}, z {z}");
        };
        expect(face.photons, photons * flights as f64, chance);
        let histories = face.histories.expect("a captor knows its histories");
        expect(histories, photons, 1.0 - (1.0 - chance).powi(flights as i32));
        assert_eq!(histories == face.photons, flights == 1);
    }
    // some 256 arrivals, of no more than 24 photons: too few to believe
    let few = split(world, 64).run(24, 1);
    assert!(few.captors[0].front.photons > 100);
    assert!(few.warnings().iter().any(|w| w.kind == "few photons on a face of a captor"));
}

/// Where all captors are surfaces, photons are not split. No chance in it.
#[test]
fn surfaces_need_no_splitting() {
    let world = World::new()
        .lambert("wall", 0.5)
        .counted("room", "wall", &room([-1.0; 3], [1.0; 3]))
        .light(json!({ "type": "point", "position": [0.1, 0.2, 0.7], "power": 1 }));
    let result = |world: World| {
        // the settings say what was asked for
        let result = phylux::RunResult { settings: None, ..world.run(10_000, 1) };
        serde_json::to_string(&result).expect("text")
    };
    assert!(result(world.clone()) == result(split(world, 8)));
}
