//! Discs and spheres as captors, which are met as they are: their areas, and their light by photons,
//! aimed flights, importance, paths and complete paths, where it is known exactly.

use std::f64::consts::PI;

use phylux::RunResult;
use serde_json::{Value, json};

use crate::{
    exact::Comparisons,
    world::{Mesh, World, back, front, room},
};

fn with_captor(world: World, captor: Value) -> World {
    world.edited(|scene| scene["captors"].as_array_mut().expect("a list").push(captor))
}

fn with_disc(world: World, name: &str, center: [f64; 3], normal: [f64; 3], radius: f64) -> World {
    let disc = json!({ "center": center, "normal": normal, "radius": radius });
    with_captor(world, json!({ "name": name, "disc": disc, "sides": "both" }))
}

fn with_ball(world: World, name: &str, center: [f64; 3], radius: f64) -> World {
    let sphere = json!({ "center": center, "radius": radius });
    with_captor(world, json!({ "name": name, "sphere": sphere, "sides": "both" }))
}

/// Runs a scene by photons alone, with aimed flights and with importance, by paths and by complete
/// paths.
fn in_all_ways(world: &World, histories: u64) -> Vec<(&'static str, RunResult)> {
    let guided = |how: &str| world.clone().with("settings", json!({ "guiding": how, "k": 0 }));
    vec![
        ("photons", world.run(histories, 1)),
        ("aimed", guided("aim").run(histories / 4, 2)),
        ("importance", guided("full").run(histories / 4, 3)),
        ("paths", world.run_paths(histories / 4, 4)),
        ("complete", world.run_complete(histories / 4, 5)),
    ]
}

/// Areas and normals are exact, whatever the unit and wherever the captor is.
#[test]
fn areas_and_normals_are_exact() {
    let world = World::new().light(json!({ "type": "point", "position": [0, 0, 3], "power": 1 }));
    let world = with_disc(world, "level", [1.0, 2.0, -3.0], [0.0, 0.0, 2.0], 0.013);
    let world = with_disc(world, "tilted", [0.0, 0.3, 0.1], [3.0, 0.0, 4.0], 70.0);
    let world = with_ball(world, "ball", [100.0, -20.0, 5.0], 0.21);
    let loaded = phylux::load(&world.write().path("scene.json")).expect("a scene");
    let captors = loaded.scene.captors();
    for (captor, radius) in captors.iter().zip([0.013, 70.0, 0.21]) {
        let area = PI * radius * radius;
        assert!((captor.area / area - 1.0).abs() < 1e-12, "{}: {}", captor.id, captor.area);
    }
    assert_eq!(captors[0].normal, glam::DVec3::Z);
    assert!((captors[1].normal - glam::DVec3::new(0.6, 0.0, 0.8)).length() < 1e-15);
    assert_eq!(captors[2].normal, glam::DVec3::ZERO);
    assert_eq!(
        (captors[1].area_of_face(), captors[2].area_of_face()),
        (captors[1].area, 4.0 * captors[2].area)
    );
}

/// In a black room, a disc receives the share of a point lamp's light that is its solid angle over 4
/// pi. The lamp is over its middle; another disc, tilted, and turned away; a sphere beside the lamp,
/// whose mean irradiance is a fourth of that across the light as it is small, and a sphere around the
/// lamp, whose inside receives all of its light.
///
/// Seeds 1 to 5, 4e5 photons or 1e5 with aimed flights or of paths; standard errors at most 7 % of
/// the exact value. 25 comparisons, odds of a false alarm 3e-3.
#[test]
fn a_lamp_lights_discs_and_spheres() {
    let world = World::new()
        .lambert("black", 0.0)
        .surface("walls", "black", &room([-2.0; 3], [2.0; 3]))
        .light(json!({ "type": "point", "position": [0, 0, 0.5], "power": 1.0 }));
    let world = with_disc(world, "under", [0.0; 3], [0.0, 0.0, 1.0], 0.3);
    // its middle is 1 m away, along its normal
    let world = with_disc(world, "turned", [0.6, 0.0, 1.3], [3.0, 0.0, 4.0], 0.4);
    let world = with_ball(world, "small", [-0.6, 0.0, 1.3], 0.05);
    let world = with_ball(world, "near", [-0.3, 0.4, 0.5], 0.4);
    let world = with_ball(world, "around", [0.1, 0.1, 0.4], 1.5);
    let share = |height: f64, radius: f64| 0.5 * (1.0 - height / height.hypot(radius));
    let seen =
        |distance: f64, radius: f64| 0.5 * (1.0 - (1.0 - (radius / distance).powi(2)).sqrt());
    let mut check = Comparisons::new("lamp over discs and spheres", 0.07);
    for (way, run) in in_all_ways(&world, 400_000) {
        check.flux(format!("under, {way}"), front(&run, "under"), 0, share(0.5, 0.3));
        check.flux(format!("turned, {way}"), back(&run, "turned"), 0, share(1.0, 0.4));
        check.flux(format!("near, {way}"), front(&run, "near"), 0, seen(0.5, 0.4));
        check.flux(format!("around, {way}"), back(&run, "around"), 0, 1.0);
        // of a small sphere phi / (4 pi d2) / 4 in the mean over its surface, to r2 / (4 d2)
        let mean = |value: f64| value / (4.0 * PI * 0.05 * 0.05);
        let face = front(&run, "small");
        let error = face.flux_se[0].expect("an error");
        check.add(format!("small, {way}"), mean(face.flux[0]), mean(error), mean(seen(1.0, 0.05)));
        assert!((mean(seen(1.0, 0.05)) * 16.0 * PI - 1.0).abs() < 7e-4);
        assert_eq!((front(&run, "turned").flux[0], front(&run, "around").flux[0]), (0.0, 0.0));
    }
    check.finish(25);
}

/// In a furnace whose walls glow with the radiance L and reflect half of what comes, the radiance is 2
/// L everywhere. A disc then receives 2 pi L on either side, and so does each patch of a sphere, from
/// outside and from inside, so that its fluence rate is four times as much.
///
/// Seeds 1 to 5, 2e5 photons or 5e4 with aimed flights or of paths; standard errors at most 3 % of
/// the exact value. 20 comparisons, odds of a false alarm 2e-3.
#[test]
fn uniform_light_comes_to_discs_and_spheres() {
    let world =
        World::new().lambert("wall", 0.5).glowing("walls", "wall", &room([-1.0; 3], [1.0; 3]), 1.0);
    let world = with_disc(world, "disc", [0.2, -0.3, 0.1], [1.0, 2.0, -2.0], 0.3);
    let world = with_ball(world, "ball", [-0.3, 0.4, -0.2], 0.35);
    let mut check = Comparisons::new("furnace with discs and spheres", 0.03);
    for (way, run) in in_all_ways(&world, 200_000) {
        check.irradiance(format!("front, {way}"), front(&run, "disc"), 0, 2.0 * PI);
        check.irradiance(format!("back, {way}"), back(&run, "disc"), 0, 2.0 * PI);
        check.irradiance(format!("outside, {way}"), front(&run, "ball"), 0, 8.0 * PI);
        check.irradiance(format!("inside, {way}"), back(&run, "ball"), 0, 8.0 * PI);
    }
    check.finish(20);
}

/// A disc in the floor shows on its front what arrives there, and on its back what the floor sends
/// back: half of it. One that is larger than the tile that it lies in, and whose middle is beside the
/// tile, shows on its back what the tile sends back.
///
/// Seeds 1 to 5, 4e5 photons or 1e5 with aimed flights or of paths; standard errors of the difference
/// at most 6 %. 10 comparisons, odds of a false alarm 1e-3.
#[test]
fn discs_lie_in_surfaces() {
    let world = World::new()
        .lambert("grey", 0.5)
        .surface("floor", "grey", &Mesh::square([0.0; 3], [0.0, 0.0, 1.0], 2.0))
        .counted("tile", "grey", &Mesh::square([0.0, 0.0, 0.5], [0.0, 0.0, -1.0], 0.1))
        .light(json!({ "type": "point", "position": [0, 0, 0.4], "power": 1.0 }));
    let world = with_disc(world, "low", [0.5, 0.0, 0.0], [0.0, 0.0, 1.0], 0.2);
    let world = with_disc(world, "high", [0.1, 0.0, 0.5], [0.0, 0.0, -1.0], 0.17);
    let scene = phylux::load(&world.write().path("scene.json")).expect("a scene").scene;
    assert_eq!(scene.captors_in_surfaces().len(), 2);
    for (way, run) in in_all_ways(&world, 400_000) {
        let mut check = Comparisons::new("discs in surfaces", 0.06).rounding(1e-3);
        let of =
            |face: &phylux::results::FaceResult| (face.flux[0], face.flux_se[0].expect("an error"));
        let (arrives, error) = of(front(&run, "low"));
        let (leaves, other) = of(back(&run, "low"));
        check.add(format!("floor, {way}"), 2.0 * leaves, error.hypot(2.0 * other), arrives);
        let (arrives, error) = of(front(&run, "tile"));
        let (leaves, other) = of(back(&run, "high"));
        check.add(format!("tile, {way}"), 2.0 * leaves, error.hypot(2.0 * other), arrives);
        check.finish(2);
    }
}

/// Where a scene repeats, discs and spheres across the borders of the cell count as those within. A
/// floor that reflects half of the light of a uniform sky makes the radiance upwards half of that
/// downwards.
///
/// Seeds 1 and 4, 2e5 photons or 5e4 paths; standard errors at most 3 % of the exact value. 12
/// comparisons, odds of a false alarm 1.3e-3.
#[test]
fn discs_and_spheres_cross_borders() {
    let world = World::new()
        .with("periodic", json!({ "x": [0, 1], "y": [0, 1] }))
        .lambert("soil", 0.5)
        .surface("soil", "soil", &Mesh::rectangle([0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]))
        .light(json!({ "type": "sky", "model": "uniform", "irradiance": 100 }));
    let world = with_disc(world, "within", [0.5, 0.5, 0.4], [0.0, 0.0, 1.0], 0.1);
    let world = with_disc(world, "across", [0.98, 0.03, 0.3], [0.0, 0.0, 1.0], 0.1);
    let world = with_disc(world, "tilted", [0.02, 0.4, 0.5], [3.0, 0.0, 4.0], 0.15);
    let world = with_ball(world, "ball", [1.0, 0.98, 0.6], 0.2);
    let mut check = Comparisons::new("discs across borders", 0.03);
    for (way, run) in [("photons", world.run(200_000, 1)), ("paths", world.run_paths(50_000, 4))] {
        for name in ["within", "across"] {
            check.irradiance(format!("{name}, {way}"), front(&run, name), 0, 100.0);
            check.irradiance(format!("{name}, back, {way}"), back(&run, name), 0, 50.0);
        }
        check.irradiance(format!("tilted, {way}"), front(&run, "tilted"), 0, 90.0 + 5.0);
        check.irradiance(format!("ball, {way}"), front(&run, "ball"), 0, 200.0 + 100.0);
    }
    check.finish(12);
}

/// A disc counts what a polygon of 96 corners counts in its place, of whose photons all but a few
/// thousandths are the same, and the estimate from the nearest photons is that of its own photons.
///
/// Seed 1, 3e5 photons: fluxes differ by less than 0.5 %, the estimate at the middle by less than 4
/// standard errors.
#[test]
fn a_disc_counts_as_a_polygon_does() {
    let (center, normal) = ([0.1, -0.2, 0.0], [0.0, 0.6, 0.8]);
    let world = World::new()
        .lambert("wall", 0.5)
        .surface("walls", "wall", &room([-1.0; 3], [1.0; 3]))
        .captor("polygon", &Mesh::disc(center, normal, 0.4))
        .light(json!({ "type": "point", "position": [0, 0, 0.8], "power": 1.0 }));
    let world = with_disc(world, "disc", center, normal, 0.4);
    let run = crate::common::run_file(&world.write().path("scene.json"), |settings| {
        (settings.photons, settings.seed) = (phylux::transport::PhotonCount::new(300_000).ok(), 1);
        settings.k = phylux::transport::NearestCount::new(500).ok();
    });
    let [disc, polygon] = ["disc", "polygon"].map(|name| front(&run, name));
    let ratio = disc.flux[0] / polygon.flux[0];
    assert!((ratio - 1.0).abs() < 5e-3, "{ratio}");
    let knn = |id: &str| {
        let captor = run.captors.iter().find(|captor| captor.id == id).expect("a captor");
        captor.front.knn.clone().flatten().expect("an estimate")
    };
    let (own, other) = (knn("disc"), knn("polygon"));
    let error = own.irradiance_se[0].expect("an error");
    assert!((own.irradiance[0] - other.irradiance[0]).abs() < 4.0 * error);
    assert!((own.coverage - PI * own.radius.powi(2) / (PI * 0.16)).abs() < 1e-6);
}
