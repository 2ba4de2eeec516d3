//! The light at points of surfaces, from a photon map of all surfaces.

use std::{
    f64::consts::PI,
    sync::atomic::{AtomicBool, AtomicU64, Ordering},
};

use glam::Vec3;
use phylux::{
    Control, LoadedScene, Settings,
    scene::Patches,
    transport::{MapLimit, NearestCount, SurfaceLight, ThreadCount, light_surfaces},
};
use serde_json::json;

use crate::world::{Mesh, World, room};

const K: usize = 400;

/// Loads a scene, lights its surfaces with this many stored arrivals of seed 1, and hands the light
/// to `then`.
fn lit<T>(world: &World, map_photons: usize, then: impl FnOnce(&SurfaceLight) -> T) -> T {
    with_threads(world, map_photons, 0, then)
}

fn with_threads<T>(
    world: &World,
    map_photons: usize,
    threads: usize,
    then: impl FnOnce(&SurfaceLight) -> T,
) -> T {
    let loaded = load(world);
    let settings = Settings {
        map_photons: MapLimit::nearest_to(map_photons),
        threads: ThreadCount::nearest_to(threads),
        k: NearestCount::new(K).ok(),
        ..Settings::default()
    };
    let control = Control::default();
    let light =
        light_surfaces(&loaded.scene, &settings, &control).unwrap_or_else(|e| panic!("{e}"));
    then(&light)
}

fn load(world: &World) -> LoadedScene {
    phylux::load(&world.write().path("scene.json")).unwrap_or_else(|e| panic!("{e}"))
}

fn furnace() -> World {
    let walls = room([-1.0; 3], [1.0; 3]);
    World::new().lambert("wall", 0.5).glowing("walls", "wall", &walls, 1.0 / (2.0 * PI))
}

/// In a furnace of irradiance 1, each estimate from k = 400 photons is unbiased and has a relative
/// error of 1 / sqrt(398) = 5 %: in the middle of walls, at edges, and right in the corners, where
/// a disc would reach over three walls and out of the room.
///
/// Seed 1, 400,000 arrivals. Each of 84 estimates is within 5 errors, odds of a false alarm 84 x
/// 3e-6 (a gamma law of 400). The mean of the 36 estimates in corners, of which at least 20 share
/// no photon, is within 4 of its errors, odds of a false alarm 6e-5.
#[test]
fn irradiance_reaches_into_corners() {
    lit(&furnace(), 400_000, |light| {
        let error = 1.0 / f64::sqrt(K as f64 - 2.0);
        let near_corners = [[0.998, 0.001], [0.001, 0.998], [0.001, 0.001]];
        let elsewhere = [[0.001, 0.5], [0.5, 0.001], [0.499, 0.5], [0.3, 0.3]];
        let irradiance = |triangle: usize, [u, v]: [f32; 2]| {
            let found =
                light.irradiance(triangle, true, light.scene.triangles().at(triangle).point(u, v));
            assert!((found[0] - 1.0).abs() < 5.0 * error, "{found:?} at {triangle} {u} {v}");
            assert_eq!(light.irradiance(triangle, false, Vec3::ZERO), [0.0]);
            found[0]
        };
        let triangles = 0..light.scene.triangles().len();
        assert_eq!(triangles.len(), 12);
        for (triangle, at) in triangles.clone().flat_map(|t| elsewhere.map(|at| (t, at))) {
            irradiance(triangle, at);
        }
        let corners = triangles.flat_map(|t| near_corners.map(|at| irradiance(t, at)));
        let mean = corners.sum::<f64>() / 36.0;
        println!("mean in corners {mean}");
        assert!((mean - 1.0).abs() < 4.0 * error / 20f64.sqrt(), "{mean}");
    });
}

/// A sheet that reflects 0.6 and transmits 0.3 of the light, a black sheet 1 mm below it, and a
/// lamp 1 m above. The upper face receives phi / (4 pi) = 1, the top of the black sheet 0.3 of that
/// through the sheet. The lower face of the first sheet and the underside of the black one receive
/// nothing.
///
/// Seed 1. The two values are within 5 errors, odds of a false alarm 3e-6 each; over the disc of
/// the k nearest photons the irradiance falls by 0.1 %.
#[test]
fn a_sheet_is_lit_from_its_own_side() {
    let sheet = |z: f64| Mesh::rectangle([-0.1, -0.1, z], [0.2, 0.0, 0.0], [0.0, 0.2, 0.0]);
    let both = json!({ "type": "leaf", "ior": 1, "reflectance": 0.6, "transmittance": 0.3 });
    let world = World::new()
        .material("leaf", both)
        .lambert("black", 0.0)
        .surface("leaf", "leaf", &sheet(0.0))
        .surface("black", "black", &sheet(-0.001))
        .light(json!({ "type": "point", "position": [0, 0, 1], "power": 4.0 * PI }));
    lit(&world, 8_000, |light| {
        let [leaf, black] = [0.0, -0.001].map(|z: f32| {
            let at = |t: phylux::math::Triangle| {
                (t.a.z + light.scene.center().z as f32 - z).abs() < 1e-5
            };
            light.scene.triangles().iter().position(at).expect("a triangle")
        });
        let middle = light.scene.triangles().at(leaf).point(0.4, 0.3);
        let under = light.scene.triangles().at(black).point(0.4, 0.3);
        let error = 1.0 / f64::sqrt(K as f64 - 2.0);
        let above = light.irradiance(leaf, true, middle)[0];
        assert!((above - 1.0).abs() < 5.0 * error, "{above}");
        let below = light.irradiance(black, true, under)[0];
        assert!((below - 0.3).abs() < 5.0 * 0.3 * error, "{below}");
        // the black sheet reflects nothing
        assert_eq!(light.irradiance(leaf, false, middle), [0.0]);
        assert_eq!(light.irradiance(black, false, under), [0.0]);

        let [up, down] = [Vec3::Z, -Vec3::Z].map(|way| light.radiance(leaf, middle, way)[0]);
        assert!((up - 0.6 / PI * above).abs() < 1e-6, "{up}");
        assert!((down - 0.3 / PI * above).abs() < 1e-6, "{down}");
        let absorbed = light.absorbed(leaf, middle)[0];
        assert!((absorbed - 0.1 * above).abs() < 1e-6, "{absorbed}");
        assert!((light.absorbed(black, under)[0] - below).abs() < 1e-6);
        assert_eq!(light.radiance(black, under, Vec3::Z), [0.0]);
    });
}

/// The map is the same for any number of threads. Where no photon escapes, the number of arrivals
/// without a bounce is the number of histories.
#[test]
fn the_map_does_not_depend_on_threads() {
    let [one, three] = [1, 3].map(|threads| {
        with_threads(&furnace(), 50_000, threads, |light| {
            let map = &light.map;
            let straight = map.ways().iter().filter(|way| way.bounces == 0).count();
            assert_eq!(straight as u64, map.histories);
            let powers: Vec<Vec<f32>> =
                (0..map.photons.len()).map(|i| map.power(i).to_vec()).collect();
            (map.photons.clone(), map.positions(), map.ways().to_vec(), powers)
        })
    });
    assert!(one.0.len() > 49_000, "{}", one.0.len());
    assert!(one == three);
}

/// The walls of a room are six pieces. A sheet of two halves is one piece, but two where a third
/// surface stands on the edge between them. A sphere is many pieces, each of triangles that lean by
/// at most 30 degrees from its first.
#[test]
fn pieces_are_smooth() {
    let count = |world: &World| {
        let loaded = load(world);
        let patches = Patches::new(&loaded.scene);
        let area = (0..patches.count()).map(|patch| patches.area(patch)).sum::<f64>();
        (patches.count(), area)
    };
    assert_eq!(count(&furnace()).0, 6);

    let half = |x: f64| Mesh::rectangle([x, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]);
    let lamp = json!({ "type": "point", "position": [0, 0, 5], "power": 1 });
    let with =
        |mesh: &Mesh| World::new().lambert("a", 0.5).light(lamp.clone()).surface("s", "a", mesh);
    let sheet = half(-1.0).and(half(0.0));
    assert_eq!(count(&with(&sheet)), (1, 2.0));
    let wall = Mesh::rectangle([0.0; 3], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]);
    assert_eq!(count(&with(&sheet.and(wall))), (3, 3.0));

    let (pieces, area) = count(&with(&Mesh::sphere([0.0; 3], 1.0, 30)));
    assert!((8..60).contains(&pieces), "{pieces}");
    assert!((area / (4.0 * PI) - 1.0).abs() < 0.01, "{area}");
}

/// Copies that share their triangles have the light of copies that do not: the piece around a point
/// is looked for in its own copy alone. The members of each piece have its area.
///
/// Seed 1, 1,600,000 arrivals, of which some 110,000 are on three balls. Were no photon the same in
/// both, an estimate from 400 would differ by 7 %, and the sum over the balls by 0.4 %: the limits of
/// 30 and 2 % are more than 4 errors, odds of a false alarm below 1e-4.
#[test]
fn shared_copies_are_lit_alike() {
    let world = |share: bool| {
        furnace().surface("ball", "wall", &Mesh::sphere([0.0; 3], 0.3, 24)).edited(|scene| {
            let places = [[-0.5, 0.0, 0.0], [0.3, 0.2, 0.1], [0.3, 0.2, -0.55]];
            let ball = &mut scene["objects"][0];
            ball["instances"] = places.map(|at| json!({ "translate": at, "scale": 0.9 })).into();
            ball["share"] = share.into();
        })
    };
    let [own, shared] = [false, true].map(|share| {
        lit(&world(share), 1_600_000, |light| {
            for patch in 0..light.patches.count() {
                let members = light.patches.members(patch);
                let area: f64 =
                    members.map(|t| f64::from(light.scene.triangles().at(t).area())).sum();
                assert!((area / light.patches.area(patch) - 1.0).abs() < 1e-5, "{patch}: {area}");
            }
            let all = 0..light.scene.triangles().len();
            let found = all.map(|t| {
                let middle = light.scene.triangles().at(t).point(1.0 / 3.0, 1.0 / 3.0);
                light.irradiance(t, true, middle)[0]
            });
            found.collect::<Vec<f64>>()
        })
    });
    assert_eq!(own.len(), shared.len());
    // some photons take another way, by rounding, and small pieces have few
    let unlike = own.iter().zip(&shared).filter(|(a, b)| (*a / *b - 1.0).abs() > 0.3).count();
    assert!(100 * unlike < own.len(), "{unlike} of {}", own.len());
    let [own, shared] = [own, shared].map(|found| found.iter().sum::<f64>());
    assert!((own / shared - 1.0).abs() < 0.02, "{own} {shared}");
}

/// Between walls that absorb nothing a photon takes 10,000 rays, so two photons fill the map. Only
/// as many photons are traced as a trial of about a million rays has (128, and 2 % more to allow
/// for chance), and not 10,000.
#[test]
fn walls_that_absorb_nothing() {
    let walls = room([-1.0; 3], [1.0; 3]);
    let lamp = json!({ "type": "point", "position": [0.1, 0.2, 0.3], "power": 1 });
    let loaded =
        load(&World::new().lambert("wall", 1.0).surface("walls", "wall", &walls).light(lamp));
    let settings = Settings {
        map_photons: MapLimit::nearest_to(20_000),
        k: NearestCount::new(K).ok(),
        ..Settings::default()
    };
    let traced = AtomicU64::new(0);
    let progress = |progress: phylux::transport::Progress| {
        traced.fetch_max(progress.photons, Ordering::Relaxed);
    };
    let control = Control { stop: &AtomicBool::new(false), progress: &progress };
    let light =
        light_surfaces(&loaded.scene, &settings, &control).unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(traced.into_inner(), 131);
    assert!((10_000..=20_000).contains(&light.map.photons.len()), "{}", light.map.photons.len());
}
