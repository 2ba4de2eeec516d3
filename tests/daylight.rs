//! Sun, sky and environment maps: closed forms by photons and by paths, how the commands take
//! daylight, and wrong input.

use std::{f64::consts::PI, path::Path};

use phylux::{
    Estimator, Guiding, RunResult,
    results::FaceResult,
    transport::{NearestCount, PhotonCount, ThreadCount},
};
use serde_json::{Value, json};

use crate::{
    bad_input::bad_scene,
    common::{TestScene, run_file, shared, sunlit},
    exact::{Comparisons, fresnel, mean_over, polygon_irradiance},
    world::{Mesh, Point, World, check_ledger, front, room},
};

const UP: Point = [0.0, 0.0, 1.0];

/// Compares both estimators with the exact irradiances of the named captors. A captor whose exact
/// value is 0 must receive exactly nothing. `histories` are the photons in all, and the paths for
/// each captor.
fn both(check: &mut Comparisons, world: &World, exact: &[(String, f64)], histories: [u64; 2]) {
    for (how, run) in [
        ("photons", world.run(histories[0], 1)),
        ("paths", world.run_paths(histories[1] * exact.len() as u64, 1)),
    ] {
        for (name, exact) in exact {
            if *exact > 0.0 {
                check.irradiance(format!("{name}, {how}"), front(&run, name), 0, *exact);
            } else {
                assert_eq!(front(&run, name).irradiance[0], 0.0, "{name}, {how}");
            }
        }
    }
}

/// Returns a normal that is tilted from upwards to the south by this angle (degrees).
fn tilted(tilt: f64) -> Point {
    let (sin, cos) = tilt.to_radians().sin_cos();
    [0.0, -sin, cos]
}

const TILTS: [f64; 5] = [0.0, 30.0, 90.0, 120.0, 180.0];

/// Returns an open scene with tilted square captors, which do not shade each other.
fn open_field() -> World {
    TILTS.iter().fold(World::new(), |world, &tilt| {
        world.captor(&format!("tilt {tilt}"), &Mesh::square([0.0; 3], tilted(tilt), 1.0))
    })
}

/// Tilted planes in the open under a uniform sky, an overcast sky, a sun of parallel rays, and a
/// sun with a disc.
///
/// Seed 1; standard errors at most 0.2 % of the exact value. 32 comparisons, odds of a false alarm
/// 4e-3.
#[test]
fn open_planes_have_their_closed_forms() {
    let mut check = Comparisons::new("open field", 0.002).rounding(1e-4);
    let zenith = 900.0 / (7.0 * PI);
    let uniform = |b: f64| 50.0 * (1.0 + b.cos());
    let overcast =
        |b: f64| zenith * (PI / 6.0 * (1.0 + b.cos()) + 4.0 / 9.0 * (b.sin() + (PI - b) * b.cos()));
    type Tilted<'a> = &'a dyn Fn(f64) -> f64;
    for (model, formula) in [("uniform", &uniform as Tilted), ("overcast", &overcast)] {
        let sky = json!({ "type": "sky", "model": model, "irradiance": 100 });
        let exact = TILTS.map(|tilt| {
            let e = if tilt == 180.0 { 0.0 } else { formula(tilt.to_radians()) };
            (format!("tilt {tilt}"), e)
        });
        both(&mut check, &open_field().light(sky), &exact, [6_000_000, 200_000]);
    }
    // the sun stands in the south, 35 degrees high
    for half_angle in [0.0, 0.2666] {
        let sun = json!({ "type": "sun", "irradiance": 800, "half_angle_deg": half_angle });
        let world = open_field()
            .light(sun)
            .with("sun_at", json!({ "elevation_deg": 35, "azimuth_deg": 180 }));
        let exact = TILTS.map(|tilt: f64| {
            let cos = (tilt - 55.0).to_radians().cos();
            (format!("tilt {tilt}"), 800.0 * cos.max(0.0))
        });
        both(&mut check, &world, &exact, [1_000_000, 20_000]);
    }
    check.finish(32);
}

/// Light from the ground is half of what falls on it, with a uniform radiance below the horizon,
/// whether it comes from the sky or from the sun. A captor that looks down receives all of it, a
/// vertical one half.
///
/// Seed 1; standard errors at most 0.2 % of the exact value. 8 comparisons, odds of a false alarm
/// 9e-4.
#[test]
fn the_ground_sends_light_back() {
    let mut check = Comparisons::new("ground", 0.002).rounding(1e-4);
    let world = || {
        World::new()
            .captor("down", &Mesh::square([0.0; 3], [0.0, 0.0, -1.0], 1.0))
            .captor("wall", &Mesh::square([0.0; 3], [0.0, 1.0, 0.0], 1.0))
    };
    let sky = json!({ "type": "sky", "model": "uniform", "irradiance": 100, "ground": 0.5 });
    let exact = [("down".into(), 50.0), ("wall".into(), 75.0)];
    both(&mut check, &world().light(sky), &exact, [5_000_000, 100_000]);
    let sun = json!({ "type": "sun", "irradiance": 200, "ground": 0.5 });
    // the sun stands behind the vertical captor, 30 degrees high: 100 W/m2 on the ground
    let world =
        world().light(sun).with("sun_at", json!({ "elevation_deg": 30, "azimuth_deg": 180 }));
    let exact = [("down".into(), 50.0), ("wall".into(), 25.0)];
    both(&mut check, &world, &exact, [5_000_000, 100_000]);
    check.finish(8);
}

/// Returns the text of a map of 4 x 2 texels. A texel `@@@\x7f` has the radiance 64.5 x 2^(127 -
/// 136), which is 1 over [`SCALE`].
fn map(texels: &str) -> String {
    format!("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 2 +X 4\n{texels}")
}

const SCALE: f64 = 512.0 / 64.5;

/// First a black box in a map of uniform radiance L: every face receives pi L, and all the light
/// that enters is absorbed. Then a map with a single bright texel, which the captor that faces it
/// sees completely.
///
/// Seed 1; standard errors at most 0.2 % of the exact value. 2 comparisons, odds of a false alarm
/// 2e-4.
#[test]
fn a_map_shines_from_all_sides() {
    let furnace = World::new()
        .lambert("black", 0.0)
        .counted("box", "black", &Mesh::cuboid([0.0; 3], [1.0, 2.0, 3.0]))
        .light(json!({ "type": "environment", "file": "map.hdr", "scale": SCALE }));
    let with = |world: &World, texels: &str| {
        let scene = world.write();
        std::fs::write(scene.path("map.hdr"), map(texels)).expect("a map");
        scene
    };
    let run = with(&furnace, &"@@@\x7f".repeat(8)).run(100_000, 1);
    check_ledger(&run);
    let flux = PI * 22.0;
    assert!((run.energy.emitted[0] / flux - 1.0).abs() < 1e-3, "{:?}", run.energy);
    assert!((run.energy.absorbed[0] / flux - 1.0).abs() < 1e-3);
    assert!(run.energy.missed[0] < 1e-3 * flux && run.energy.missed == run.energy.escaped);
    // the texel right of the middle of the upper row covers azimuths 0 to 90 with heading 0, and 90
    // to 180 with heading 90
    let mut check = Comparisons::new("texel", 0.002).rounding(1e-4);
    let mut texels = ["\0\0\0\0"; 8];
    texels[2] = "@@@\x7f";
    let wall = Mesh::square([0.0; 3], [1.0, 0.0, 0.0], 1.0);
    let away = Mesh::square([0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], 1.0);
    let world = World::new().captor("east", &wall).captor("west", &away).light(
        json!({ "type": "environment", "file": "map.hdr", "scale": SCALE, "heading_deg": 90 }),
    );
    let scene = with(&world, &texels.concat());
    for run in [scene.run(500_000, 1), scene.run_paths(1_000_000, 1)] {
        // the integral of the squared cosine of the elevation, times the integral of the azimuth's
        // cosine
        check.irradiance("east", front(&run, "east"), 0, PI / 4.0);
        assert_eq!(front(&run, "west").irradiance[0], 0.0);
    }
    check.finish(2);
}

/// The sun 30 degrees high behind a thin pane, which transmits (1 - R) / (1 + R), averaged over the
/// polarisations.
///
/// Seed 1; standard errors at most 0.2 % of the exact value. 2 comparisons, odds of a false alarm
/// 2e-4.
#[test]
fn the_sun_shines_through_a_pane() {
    let transmitted = fresnel(0.5, 1.52).map(|r| (1.0 - r) / (1.0 + r));
    let transmitted = 0.5 * (transmitted[0] + transmitted[1]);
    assert!((transmitted - 0.8435).abs() < 1e-4);
    let world = World::new()
        .material("pane", json!({ "type": "transparent", "ior": 1.52, "thin": true }))
        .surface("pane", "pane", &Mesh::square([0.0, 0.0, 0.05], UP, 1.3))
        .captor("sensor", &Mesh::square([0.0; 3], UP, 1.0))
        .light(json!({ "type": "sun", "irradiance": 800 }))
        .with("sun_at", json!({ "elevation_deg": 30, "azimuth_deg": 77 }));
    let mut check = Comparisons::new("pane", 0.002).rounding(1e-4);
    both(&mut check, &world, &[("sensor".into(), 400.0 * transmitted)], [2_000_000, 20_000]);
    check.finish(2);
}

/// Light that enters through openings only. The sky's irradiance is that of a polygon of the sky's
/// radiance; the sun lights the patch below the opening. Neither a second opening behind the first
/// nor a roof above it lets light start twice.
///
/// Seed 1; standard errors at most 0.2 % of the exact value. 6 comparisons, odds of a false alarm
/// 4e-4.
#[test]
fn light_comes_through_openings() {
    let mut check = Comparisons::new("openings", 0.002).rounding(2e-4);
    // 2 x 1 m, 0.8 m above the captor; counter-clockwise seen from above
    let window = [[0.0, 0.0, 0.8], [2.0, 0.0, 0.8], [2.0, 1.0, 0.8], [0.0, 1.0, 0.8]];
    let behind = window.map(|[x, y, z]| [x, y, z - 0.3]);
    let corner = [0.0; 3];
    let captor = Mesh::rectangle(corner, [2.0, 0.0, 0.0], [0.0, 1.0, 0.0]);
    let exact =
        mean_over(corner, [2.0, 0.0, 0.0], [0.0, 1.0, 0.0], |p| polygon_irradiance(p, UP, &window));
    let world = |light: Value| World::new().captor("up", &captor).light(light);
    let sky = |through: &[[Point; 4]]| json!({ "type": "sky", "model": "uniform", "irradiance": 100, "through": through });
    let seen = [("up".to_string(), 100.0 / PI * exact)];
    both(&mut check, &world(sky(&[window])), &seen, [1_000_000, 1_000_000]);
    // an opening behind the first one adds the light that enters from its sides: together they
    // admit all that the second one alone would
    let wide =
        mean_over(corner, [2.0, 0.0, 0.0], [0.0, 1.0, 0.0], |p| polygon_irradiance(p, UP, &behind));
    let scene = world(sky(&[window, behind])).write();
    for run in [scene.run(1_500_000, 1), scene.run_paths(1_000_000, 1)] {
        check.irradiance("two openings", front(&run, "up"), 0, 100.0 / PI * wide);
    }
    // the sun in the zenith lights what lies below the opening, and nothing if there is a roof
    // above it
    let sun = json!({ "type": "sun", "irradiance": 100, "half_angle_deg": 0, "through": [window] });
    let noon = json!({ "elevation_deg": 90, "azimuth_deg": 0 });
    let lit = world(sun).with("sun_at", noon);
    both(&mut check, &lit, &[("up".to_string(), 100.0)], [20_000, 20_000]);
    let roof = Mesh::rectangle([-1.0, -1.0, 1.0], [4.0, 0.0, 0.0], [0.0, 3.0, 0.0]);
    let roofed = lit.lambert("roof", 0.0).surface("roof", "roof", &roof);
    let scene = roofed.write();
    for run in [scene.run(10_000, 1), scene.run_paths(1_000, 1)] {
        assert_eq!(front(&run, "up").irradiance[0], 0.0);
    }
    let loaded = phylux::load(&scene.path("scene.json")).expect("a scene");
    let notes = phylux::studies::check(&loaded).expect("a check").notes;
    assert!(
        notes.iter().any(|note| note.contains("comes in through its openings alone: 0.0 %")),
        "{notes:?}"
    );
    check.finish(6);
}

/// Light of openings does not fall on what lies outside them, so a ground that a window sees is told,
/// by every command that reads the scene: it takes half of the view of an upright window, and its
/// share is known to 0.04 (4 errors of 4096 rays are 0.031). A black ground would send nothing in, and
/// a ground behind the window is not seen.
#[test]
fn surfaces_outside_openings_are_told() {
    let window = [[0.0, 0.0, 1.0], [1.0, 0.0, 1.0], [1.0, 0.0, 2.0], [0.0, 0.0, 2.0]];
    let sky = json!({ "type": "sky", "model": "uniform", "irradiance": 100, "through": [window] });
    let sun = json!({ "type": "sun", "irradiance": 100, "through": [window] });
    let ground = |low: f64, depth: f64| {
        Mesh::rectangle([-500.0, low, 0.0], [1000.0, 0.0, 0.0], [0.0, depth, 0.0])
    };
    let warnings = |reflectance: f64, ground: &Mesh| {
        let world = World::new()
            .captor("in", &Mesh::rectangle([0.0, 1.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]))
            .light(sky.clone())
            .light(sun.clone())
            .with("sun_at", json!({ "elevation_deg": 50, "azimuth_deg": 180 }))
            .lambert("soil", reflectance)
            .surface("ground", "soil", ground);
        let scene = world.write();
        let loaded = phylux::load(&scene.path("scene.json")).expect("a scene");
        let told = phylux::studies::check(&loaded).expect("a check").warnings;
        let outside = |warnings: &[String]| {
            let of = warnings.iter().filter(|warning| warning.contains("through openings alone"));
            of.cloned().collect::<Vec<String>>()
        };
        assert_eq!(outside(&told), outside(&loaded.warnings));
        outside(&told)
    };
    let south = ground(-500.0, 500.0);
    let [told] = &warnings(0.2, &south)[..] else { panic!("one warning") };
    assert!(told.contains("`sky`, `sun` come in through openings alone"), "{told}");
    assert!(told.contains("surfaces (`ground`)") && told.contains("give the lights `ground`"));
    let percent = told.split(" % of what").next().and_then(|text| text.split(' ').next_back());
    let share = percent.expect("a share").parse::<f64>().expect("a number");
    assert!((share - 50.0).abs() < 4.0, "{told}");
    assert!(warnings(0.0, &south).is_empty());
    assert!(warnings(0.2, &ground(0.1, 500.0)).is_empty());
}

/// A black room that light enters through its window only. The captor's irradiance is that of the
/// window with the sky's radiance, all photons start at the window, and all their power stays in
/// the room.
///
/// Seed 1; standard errors at most 0.2 % of the exact value. 2 comparisons, odds of a false alarm
/// 2e-4.
#[test]
fn a_window_lights_a_black_room() {
    let (corner, u, v) = ([1.0, 0.5, 0.5], [2.0, 0.0, 0.0], [0.0, 1.5, 0.0]);
    let exact = mean_over(corner, u, v, |p| polygon_irradiance(p, UP, &WINDOW));
    let sky = json!({ "type": "sky", "model": "uniform", "irradiance": 100, "through": [WINDOW] });
    let world = World::new()
        .lambert("black", 0.0)
        .surface("room", "black", &room_with_window())
        .captor("sensor", &Mesh::rectangle(corner, u, v))
        .light(sky);
    let mut check = Comparisons::new("window", 0.002).rounding(2e-4);
    let photons = world.run(2_000_000, 1);
    check_ledger(&photons);
    // a vertical window receives half of the sky's light
    assert!((photons.energy.emitted[0] / 150.0 - 1.0).abs() < 1e-6, "{:?}", photons.energy);
    assert!(photons.energy.missed[0] < 1e-5 * photons.energy.emitted[0], "{:?}", photons.energy);
    for run in [photons, world.run_paths(1_000_000, 1)] {
        check.irradiance("sensor", front(&run, "sensor"), 0, 100.0 / PI * exact);
    }
    check.finish(2);
}

/// A captor that faces away from the sun receives its reflection in a flat pane or mirror: E
/// R(theta) cos(theta), for a sun with a disc and for one of parallel rays.
///
/// Seed 1; standard errors at most 0.2 % of the exact value. 6 comparisons, odds of a false alarm
/// 7e-4.
#[test]
fn the_sun_is_seen_in_flat_mirrors() {
    let mut check = Comparisons::new("mirrored sun", 0.002).rounding(1e-4);
    let (_, mirrored) = pane_shares(0.5);
    for (name, material, share, photons) in [
        ("pane", json!({ "type": "transparent", "ior": 1.52, "thin": true }), mirrored, 2_000_000),
        ("mirror", json!({ "type": "mirror", "reflectance": 0.8 }), 0.8, 400_000),
    ] {
        let world = |half_angle: f64| {
            over_a_mirror(half_angle).material("mirror", material.clone()).surface(
                "mirror",
                "mirror",
                &Mesh::square([0.0; 3], UP, 1.1),
            )
        };
        for half_angle in [0.0, 0.2666] {
            let paths = world(half_angle).run_paths(250_000, 1);
            check.irradiance(format!("{name}, paths"), front(&paths, "down"), 0, 400.0 * share);
        }
        let photons = world(0.2666).run(photons, 1);
        check.irradiance(format!("{name}, photons"), front(&photons, "down"), 0, 400.0 * share);
    }
    check.finish(6);
}

/// Two panes below a captor that looks down at the sun's reflections. Paths find the light that one
/// of the panes reflects once, also through the other pane, and report that the rest, which is
/// reflected more often, is unseen.
///
/// Seed 1; standard error at most 0.2 % of the exact value. 1 comparison, odds of a false alarm
/// 6e-5.
#[test]
fn the_sun_in_two_panes() {
    let pane = |z: f64| Mesh::square([0.0, 0.0, z], UP, 3.0);
    let world = over_a_mirror(0.2666)
        .material("pane", json!({ "type": "transparent", "ior": 1.52, "thin": true }))
        .surface("first", "pane", &pane(0.0))
        .surface("second", "pane", &pane(-0.05));
    let (passed, mirrored) = pane_shares(0.5);
    let once = mirrored + passed * passed * mirrored;
    let all = mirrored + passed * passed * mirrored / (1.0 - mirrored * mirrored);
    let run = world.run_paths(400_000, 1);
    let mut check = Comparisons::new("two panes", 0.002).rounding(1e-4);
    check.irradiance("down", front(&run, "down"), 0, 400.0 * once);
    check.finish(1);
    let told = |warning: &phylux::results::Warning| {
        warning.text.spelled(&phylux::words::CommandLine).contains("which paths cannot find")
    };
    assert!(run.warnings().iter().any(told), "{:?}", run.warnings());
    // the captor is virtual: it also counts light between and below the panes, nearly all of which
    // comes straight
    let unseen = run.account.unseen.expect("unseen")[0];
    let exact = (all - once) / all;
    // the reported value rests on few of the 2000 photons of a short run, those that come by a
    // mirror
    assert!(unseen > 0.2 * exact && unseen < 3.0 * exact, "{unseen}, not {exact}");
}

/// Returns the transmittance and the reflectance of a thin pane of index 1.52 at this cosine of
/// incidence, averaged over the polarisations.
fn pane_shares(cos: f64) -> (f64, f64) {
    let mean = |share: fn(f64) -> f64| 0.5 * fresnel(cos, 1.52).map(share).iter().sum::<f64>();
    (mean(|r| (1.0 - r) / (1.0 + r)), mean(|r| 2.0 * r / (1.0 + r)))
}

/// Returns a captor that looks down from a height of 2 cm, and the sun 30 degrees high with 800
/// W/m2 across its rays.
fn over_a_mirror(half_angle: f64) -> World {
    World::new()
        .captor("down", &Mesh::square([0.0, 0.0, 0.02], [0.0, 0.0, -1.0], 1.0))
        .light(json!({ "type": "sun", "irradiance": 800, "half_angle_deg": half_angle }))
        .with("sun_at", json!({ "elevation_deg": 30, "azimuth_deg": 0 }))
}

/// In a room, the sun is reflected by a window pane and by a mirror on the floor, onto captors that
/// look down or up and by way of the ceiling. Photons and paths agree. Where a map's light comes by
/// way of a mirror, paths miss nothing.
///
/// Seed 1. 7 comparisons within 4 combined standard errors, odds of a false alarm 4e-4.
#[test]
fn the_mirrored_sun_by_photons_and_paths() {
    let scene = room_by_day()
        .material("glass", json!({ "type": "transparent", "ior": 1.52, "thin": true }))
        .surface("window", "glass", &Mesh::rectangle(WINDOW[0], [2.0, 0.0, 0.0], [0.0, 0.0, 1.5]))
        .material("mirror", json!({ "type": "mirror", "reflectance": [0.9, 0.6] }))
        .surface("strip", "mirror", &Mesh::square([2.0, 1.8, 0.01], UP, 1.0))
        .captor("high", &Mesh::square([2.0, 4.5, 2.8], [0.0, 0.0, -1.0], 1.0))
        .write();
    let (photons, paths) = (scene.run(400_000, 1), scene.run_paths(150_000, 1));
    for name in ["near", "far", "high"] {
        assert_alike(name, front(&photons, name), front(&paths, name));
    }
    assert!(paths.account.unseen.expect("unseen").iter().all(|share| *share < 0.02));
    let sky = World::new()
        .material("mirror", json!({ "type": "mirror", "reflectance": 1 }))
        .surface("mirror", "mirror", &Mesh::square([0.0; 3], UP, 2.0))
        .captor("down", &Mesh::square([0.0, 0.0, 0.3], [0.0, 0.0, -1.0], 0.5))
        .light(json!({ "type": "sky", "model": "uniform", "irradiance": 100 }));
    let (photons, paths) = (sky.run(400_000, 1), sky.run_paths(100_000, 1));
    assert_eq!(paths.account.unseen, None);
    assert_alike("mirrored sky", front(&photons, "down"), front(&paths, "down"));
}

/// Asserts that two irradiances agree within 4 combined standard errors in every band.
fn assert_alike(what: &str, a: &FaceResult, b: &FaceResult) {
    for i in 0..a.irradiance.len() {
        let se = |face: &FaceResult| face.irradiance_se[i].expect("a standard error");
        let allowed = 4.0 * se(a).hypot(se(b));
        let (a, b) = (a.irradiance[i], b.irradiance[i]);
        assert!((a - b).abs() <= allowed, "{what}, band {i}: {a} and {b}, allowed {allowed}");
    }
}

/// A window in the south wall, which is the plane y = 0; counter-clockwise seen from outside.
pub const WINDOW: [Point; 4] = [[1.0, 0.0, 1.0], [3.0, 0.0, 1.0], [3.0, 0.0, 2.5], [1.0, 0.0, 2.5]];

/// Returns the walls of a room of 4 x 6 x 3 m around the window.
pub fn room_with_window() -> Mesh {
    let walls = room([0.0; 3], [4.0, 6.0, 3.0]);
    let south = |x: [f64; 2], z: [f64; 2]| {
        Mesh::rectangle([x[0], 0.0, z[0]], [0.0, 0.0, z[1] - z[0]], [x[1] - x[0], 0.0, 0.0])
    };
    let mut mesh = Mesh::default();
    for (i, face) in walls.0.iter().enumerate() {
        if face.iter().any(|p| p[1] > 0.0) {
            mesh = mesh.and(walls.face(i));
        }
    }
    for (x, z) in [
        ([0.0, 1.0], [0.0, 3.0]),
        ([3.0, 4.0], [0.0, 3.0]),
        ([1.0, 3.0], [0.0, 1.0]),
        ([1.0, 3.0], [2.5, 3.0]),
    ] {
        mesh = mesh.and(south(x, z));
    }
    mesh
}

/// Returns a grey room with a window, under the sun and a clear sky, in two bands.
fn room_by_day() -> World {
    let bands = json!([{ "name": "PAR", "from_nm": 400, "to_nm": 700 }, { "name": "NIR", "from_nm": 700, "to_nm": 1100 }]);
    World::new()
        .with("bands", bands)
        .with("site", json!({ "latitude": 43.61, "longitude": 3.88 }))
        .with("time", json!("2025-03-21T11:00+01:00"))
        .with("weather", json!({ "direct_normal": 700, "diffuse_horizontal": 90 }))
        .material("wall", json!({ "type": "lambert", "reflectance": [0.5, 0.7] }))
        .surface("room", "wall", &room_with_window())
        .captor("near", &Mesh::square([2.0, 1.0, 0.8], UP, 0.4))
        .captor("far", &Mesh::square([2.0, 4.5, 0.8], UP, 0.4))
        .light(json!({ "type": "sun" }))
        .light(json!({ "type": "sky", "ground": 0.2 }))
}

/// Photons, paths and aimed photons find the same in a room by day. The parts of the single lights
/// add up to the whole, and the number of threads changes no byte.
///
/// Seeds 1 and 5. 8 comparisons within 4 combined standard errors, odds of a false alarm 5e-4.
#[test]
fn estimators_agree_in_a_room_by_day() {
    let scene = room_by_day().write();
    let run = |change: &dyn Fn(&mut phylux::Settings)| {
        run_file(&scene.path("scene.json"), |settings| {
            (settings.photons, settings.k) =
                (PhotonCount::new(400_000).ok(), Some(NearestCount::NONE));
            change(settings);
        })
    };
    let photons =
        run(&|settings| (settings.by_light, settings.threads) = (true, ThreadCount::nearest_to(1)));
    check_ledger(&photons);
    let paths = run(&|settings| settings.estimator = Estimator::Paths);
    let aimed = run(&|settings| (settings.guiding, settings.seed) = (Guiding::Aim, 5));
    check_ledger(&aimed);
    for name in ["near", "far"] {
        assert_alike(name, front(&photons, name), front(&paths, name));
        assert_alike(&format!("{name}, aimed"), front(&aimed, name), front(&paths, name));
        let parts = front(&photons, name).by_light.as_ref().expect("lights");
        assert_eq!(parts.len(), 2);
        for b in 0..2 {
            let sum: f64 = parts.values().map(|part| part.flux[b]).sum();
            assert!((sum / front(&photons, name).flux[b] - 1.0).abs() < 1e-9, "{name}");
        }
    }
    assert!(paths.account.unseen.is_none());
    let text = |run: &RunResult| serde_json::to_string(run).expect("JSON");
    let again =
        run(&|settings| (settings.by_light, settings.threads) = (true, ThreadCount::nearest_to(3)));
    assert_eq!(text(&photons), text(&again));
}

/// Every command accepts a scene by day, and merged shards are the whole run, byte for byte. The
/// test does not depend on chance.
#[test]
fn every_command_takes_daylight() {
    let few = json!({ "photons": 4000, "map_photons": 2000 });
    let scene = room_by_day().with("settings", few).write();
    let sweep = r#"{"scene": "scene.json", "vary": {"/weather/direct_normal": [100, 700]}}"#;
    std::fs::write(scene.path("a.sweep.json"), sweep).expect("a sweep");
    for line in [
        "check scene.json",
        "run scene.json --photons 4000 --by-light -o whole.json --csv whole.csv",
        "mix whole.json --power sky=0.5 -o mixed.json",
        "run scene.json --photons 4000 --k 20 -o near.json",
        "run scene.json --photons 4000 --shard 1/2 -o one.json",
        "run scene.json --photons 4000 --shard 2/2 -o two.json",
        "merge two.json one.json -o merged.json",
        "run scene.json --photons 4000 -o plain.json",
        "run scene.json --tolerance 0.3 --estimator paths --k 0 -o close.json",
        "run scene.json --photons 20000 --estimator auto -o auto.json",
        "run scene.json --photons 4000 --guiding aim -o aimed.json",
        "compare plain.json near.json",
        "render scene.json --map-photons 2000 --width 40 --height 30 -o a.png",
        "render scene.json --show irradiance --band PAR --map-photons 2000 --width 40 --height 30 -o b.png",
        "view scene.json --results plain.json -o view.html",
        "export scene.json --results plain.json -o a.vtp",
        "sweep a.sweep.json -o swept",
    ] {
        let arguments: Vec<&str> = line.split(' ').collect();
        let output = crate::bad_input::phylux(&scene.path(""), &arguments);
        assert!(output.status.success(), "{line}: {}", String::from_utf8_lossy(&output.stderr));
    }
    let read = |name: &str| std::fs::read(scene.path(name)).expect("a file");
    assert!(read("merged.json") == read("plain.json"));
}

/// At noon most photons that enter the box around the greenhouse meet something in it: 0.87 of them
/// do, and at least 0.8 must.
#[test]
fn photons_meet_the_greenhouse() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/greenhouse-day.json");
    let run = run_file(&path, |settings| {
        (settings.photons, settings.k) = (PhotonCount::new(20_000).ok(), Some(NearestCount::NONE));
    });
    for (missed, emitted) in run.energy.missed.iter().zip(&run.energy.emitted) {
        assert!(*missed < 0.2 * emitted, "{missed} of {emitted}");
    }
}

/// A run over a period of weather finds the mean of the runs of its rows. The file has four rows of 10
/// minutes, each of which has one sun.
///
/// Seed 1, 200,000 paths. The deviation is within 4 standard errors plus 2e-4, in all at most 2 %
/// of the value.
#[test]
fn a_period_is_the_mean_of_its_rows() {
    let mut csv = String::from("time,ghi,dni,dhi\n");
    for (minute, direct, diffuse) in [(0, 300, 80), (10, 500, 100), (20, 0, 200), (30, 600, 90)] {
        csv += &format!("2025-06-21T09:{minute:02}Z,0,{direct},{diffuse}\n");
    }
    let scene = |time: Value| {
        let world = World::new()
            .with("bands", json!([{ "name": "PAR", "from_nm": 400, "to_nm": 700 }]))
            .with("quantity", json!("umol/s"))
            .with("site", json!({ "latitude": 43.61, "longitude": 3.88 }))
            .with("weather", json!({ "file": "w.csv", "stamp": "start" }))
            .with("time", time)
            .captor("tilt", &Mesh::square([0.0; 3], tilted(40.0), 1.0))
            .captor("up", &Mesh::square([0.0, 2.0, 0.0], UP, 1.0))
            .light(json!({ "type": "sun" }))
            .light(json!({ "type": "sky" }));
        let scene = world.write();
        std::fs::write(scene.path("w.csv"), &csv).expect("weather");
        scene.run_paths(200_000, 1)
    };
    let whole = scene(json!({ "from": "2025-06-21T09:00Z", "to": "2025-06-21T09:40Z" }));
    // the sun of a row stands where it does in its middle
    let hours: Vec<RunResult> =
        (0..4).map(|row| scene(json!(format!("2025-06-21T09:{row}5Z")))).collect();
    for name in ["tilt", "up"] {
        let mean = hours.iter().map(|run| front(run, name).irradiance[0]).sum::<f64>() / 4.0;
        let errors =
            hours.iter().map(|run| front(run, name).irradiance_se[0].expect("error").powi(2));
        let se = (errors.sum::<f64>() / 16.0).sqrt();
        let found = front(&whole, name);
        let allowed = 4.0 * se.hypot(found.irradiance_se[0].expect("error")) + 2e-4 * mean;
        let off = found.irradiance[0] - mean;
        assert!(off.abs() < allowed, "{name}: {} and {mean}", found.irradiance[0]);
        assert!(allowed < 0.02 * mean, "{name}: {allowed}");
        // the daily light integral: the mean times the seconds of the period
        let (dli, dli_se) = (found.dli.as_ref().expect("DLI"), found.dli_se.as_ref().expect("DLI"));
        let part = 0.0864 * (40.0 / 1440.0);
        let near = |found: &[Option<f64>], mean: f64| {
            assert!(
                (found[0].expect("DLI") / (part * mean) - 1.0).abs() < 1e-9,
                "{found:?}, {mean}"
            );
        };
        near(&dli[..], found.irradiance[0]);
        near(&dli_se[..], found.irradiance_se[0].expect("error"));
    }
    assert_eq!(whole.unit.dli.as_deref(), Some("mol/m2/d"));
    assert!(hours.iter().all(|run| run.unit.dli.is_none() && front(run, "up").dli.is_none()));
}

/// The daily light integral (DLI) exists for photosynthetic bands only, is written to the CSV, and
/// follows the powers in a mix.
#[test]
fn a_period_has_its_daily_light_integral() {
    let scene = World::new()
        .with("quantity", json!("umol/s"))
        .with("bands", json!([{ "name": "blue", "from_nm": 400, "to_nm": 500 }, { "name": "far", "from_nm": 700, "to_nm": 800 }]))
        .with("sums", json!({ "all": ["blue", "far"] }))
        .with("site", json!({ "latitude": 43.61, "longitude": 3.88 }))
        .with("weather", json!({ "file": "w.csv", "stamp": "start" }))
        .with("time", json!({ "from": "2025-06-21T09:00Z", "to": "2025-06-21T11:00Z" }))
        .captor("up", &Mesh::square([0.0; 3], UP, 1.0))
        .light(json!({ "type": "sky" }))
        .light(json!({ "type": "point", "position": [0, 0, 1], "power": 10 }))
        .write();
    let csv = "time,ghi,dni,dhi\n2025-06-21T09:00Z,0,0,80\n2025-06-21T10:00Z,0,0,100\n";
    std::fs::write(scene.path("w.csv"), csv).expect("weather");
    let run = run_file(&scene.path("scene.json"), |settings| {
        (settings.photons, settings.k, settings.by_light) =
            (PhotonCount::new(20_000).ok(), Some(NearestCount::NONE), true);
    });
    let mixed = run.mix(&[("light1".to_string(), 3.0)].into_iter().collect()).expect("a mix");
    for run in [&run, &mixed] {
        let face = front(run, "up");
        let parts = face.by_light.as_ref().expect("lights").values();
        for face in parts.chain([face]) {
            let dli = face.dli.as_ref().expect("DLI");
            assert_eq!(dli[..], [Some(0.0864 * (2.0 / 24.0) * face.irradiance[0]), None, None]);
        }
        let group = run.groups.iter().find(|group| group.id == "up").expect("a group");
        assert_eq!(group.front.dli, face.dli);
    }
    assert!(front(&mixed, "up").dli > front(&run, "up").dli);
    let mut table = Vec::new();
    phylux::formats::write_csv(&run, &mut table).expect("a table");
    let table = String::from_utf8(table).expect("text");
    assert_eq!(table.lines().filter(|line| line.contains(",dli,")).count(), 1, "{table}");
    let warnings = phylux::load(&scene.path("scene.json")).expect("a scene").warnings;
    assert!(warnings[0].starts_with("/time: lamps and environment maps shine the whole period"));
}

/// `check` warns of captors below which neither a surface nor the ground sends light upwards.
#[test]
fn missing_ground_is_warned_of() {
    let warned = |world: &World| {
        let loaded = phylux::load(&world.write().path("scene.json")).expect("a scene");
        let found = phylux::studies::check(&loaded).expect("a check").warnings;
        found.into_iter().find(|warning| warning.contains("no surface below"))
    };
    let sky = json!({ "type": "sky", "model": "uniform", "irradiance": 100 });
    let mut ground = sky.clone();
    ground["ground"] = json!(0.2);
    let open = || World::new().captor("bare", &Mesh::square([0.0, 0.0, 1.0], UP, 0.1));
    let warning = warned(&open().light(sky.clone())).expect("a warning");
    assert!(warning.contains("in light of `sky` without `ground`: `bare"), "{warning}");
    assert_eq!(warned(&open().light(ground)), None);
    let floor = Mesh::square([0.0; 3], UP, 1.0);
    let on_floor = open().lambert("soil", 0.1).counted("floor", "soil", &floor).light(sky.clone());
    assert_eq!(warned(&on_floor), None);
    let leaf = json!({ "type": "leaf", "ior": 1.425, "reflectance": 0.1, "transmittance": 0.1 });
    let leaf = World::new().material("leaf", leaf).counted("leaf", "leaf", &floor).light(sky);
    assert!(warned(&leaf).is_some());
}

/// Independently computed cases: sun and sky alone, and a room with a window. The truths come from
/// closed forms, quadrature, Mitsuba and Radiance.
///
/// Seed 1, 1,000,000 photons and 360,000 paths. Each value is within 4 combined standard errors
/// plus 1e-4 of the truth.
#[test]
#[ignore = "needs PHYLUX_SHARED"]
fn needs_shared_daylight() {
    let folder = shared().join("truth/daylight");
    let read = |path: &Path| -> Value {
        serde_json::from_str(&std::fs::read_to_string(path).expect("a file")).expect("JSON")
    };
    let discs = |truth: &Value| -> Vec<Value> {
        let sensors = truth["sensors"].as_array().expect("sensors");
        sensors
            .iter()
            .map(|s| json!({ "name": s["id"], "disc": { "center": s["center"], "normal": s["normal"], "radius": s["radius"] } }))
            .collect()
    };
    let sun = json!({ "type": "sun", "irradiance": 800, "half_angle_deg": 0 });
    let sun_at = json!({ "elevation_deg": 35, "azimuth_deg": 120 });
    let sky = |model: &str| json!({ "type": "sky", "model": model, "irradiance": 100 });
    let mut compared = 0;
    let mut compare = |what: &str, scene: &Value, values: &Value, key: Option<&str>| {
        let scene = TestScene::new(&scene.to_string(), &[]);
        for (how, run) in
            [("photons", scene.run(1_000_000, 1)), ("paths", scene.run_paths(360_000, 1))]
        {
            for row in values.as_array().expect("values") {
                let id = row["id"].as_str().expect("an id");
                let truth = key.map_or(row, |key| &row[key]);
                let number = |name: &str| truth[name].as_f64().expect("a number");
                let found = front(&run, id);
                let Some(se) = found.irradiance_se[0] else {
                    assert_eq!(number("irradiance"), 0.0, "{what} {id}");
                    continue;
                };
                let off = found.irradiance[0] - number("irradiance");
                let allowed = 4.0 * se.hypot(number("se")) + 1e-4 * number("irradiance");
                assert!(
                    off.abs() <= allowed,
                    "{what} {id} {how}: {} {off} {allowed}",
                    found.irradiance[0]
                );
                compared += 1;
            }
        }
    };
    for (case, light) in [("S1", sun.clone()), ("S3", sky("overcast"))] {
        let truth = read(&folder.join(case).join("truth.json"));
        let mut scene = json!({ "captors": discs(&truth), "lights": [light] });
        if case == "S1" {
            scene["sun_at"] = sun_at.clone();
        }
        compare(case, &scene, &truth["values"], None);
    }
    let truth = read(&folder.join("S6/truth.json"));
    for (key, lights) in [
        ("overcast", vec![sky("overcast")]),
        ("uniform", vec![sky("uniform")]),
        ("sun", vec![sun.clone()]),
        ("sun_and_uniform", vec![sun, sky("uniform")]),
    ] {
        let mut scene = read(&folder.join("S6/scene-without-lights.json"));
        scene["objects"][0]["obj"] = json!(folder.join("S6/room.obj"));
        if lights.iter().any(|light| light["type"] == "sun") {
            scene["sun_at"] = sun_at.clone();
        }
        scene["lights"] = json!(lights);
        compare(&format!("S6 {key}"), &scene, &truth["values"], Some(key));
    }
    assert!(compared > 100, "{compared} values");
}

#[test]
fn wrong_daylight_has_its_sentence() {
    let site = r#""site": {"latitude": 43.61, "longitude": 3.88}"#;
    let noon = r#""time": "2025-06-21T13:46+02:00""#;
    let weather = r#""weather": {"direct_normal": 850, "diffuse_horizontal": 100}"#;
    let nm = r#""bands": [{"name": "PAR", "from_nm": 400, "to_nm": 700}]"#;
    let at = r#""sun_at": {"elevation_deg": 30, "azimuth_deg": 0}"#;
    let captors = r#""captors": [{"name": "c", "disc": {"center": [0,0,0], "normal": [0,0,1], "radius": 1}}]"#;
    let rows: &[(&str, &[&str], &[&str])] = &[
        (
            r#"{"type": "sun"}"#,
            &[nm],
            &["/lights/0: neither `irradiance` nor weather; add `weather`"],
        ),
        (
            r#"{"type": "sun", "irradiance": 1}"#,
            &[],
            &["/lights/0: the scene does not say where the sun"],
        ),
        (
            r#"{"type": "sky", "irradiance": 1}"#,
            &[at],
            &["/lights/0/irradiance: the sky of Perez follows"],
        ),
        (
            r#"{"type": "sky", "model": "cie", "irradiance": 1}"#,
            &[at],
            &["/lights/0: `cie_type` (1 to 15)"],
        ),
        (
            r#"{"type": "sky", "model": "cie", "cie_type": 16, "irradiance": 1}"#,
            &[at],
            &["/lights/0/cie_type: 16, must be"],
        ),
        (
            r#"{"type": "sun"}"#,
            &[nm, noon, weather],
            &["/time: the scene does not say where it is; add"],
        ),
        (
            r#"{"type": "sun"}"#,
            &[nm, site, r#""time": "2025-06-21T13:46""#, weather],
            &["/time: `2025-06-21T13:46` does not say the clock's offset from UTC; write"],
        ),
        (
            r#"{"type": "sun"}"#,
            &[nm, site, r#""time": "2025-06-21T23:46+02:00""#, weather],
            &[
                "/weather/direct_normal: direct light, but the sun stands",
                "below the horizon; correct",
            ],
        ),
        (
            r#"{"type": "sun"}"#,
            &[site, noon, weather],
            &["/bands/0: band `all` needs its part of daylight"],
        ),
        (
            r#"{"type": "sun"}"#,
            &[nm, site, noon, at, weather],
            &["/sun_at: both `sun_at` and `time`"],
        ),
        (
            r#"{"type": "sun"}"#,
            &[nm, weather],
            &["/weather: the scene does not say where the sun stands"],
        ),
        (
            r#"{"type": "sun"}"#,
            &[
                nm,
                site,
                weather,
                r#""time": {"from": "2025-06-21T00:00Z", "to": "2025-06-22T00:00Z"}"#,
            ],
            &["/weather: a period needs a weather file"],
        ),
        (
            r#"{"type": "sun", "irradiance": 1, "share": 1}"#,
            &[at],
            &["/lights/0/share: both `share` and `irradiance`"],
        ),
        (
            r#"{"type": "sun", "irradiance": 1, "half_angle_deg": 6}"#,
            &[at],
            &["/lights/0/half_angle_deg: 6"],
        ),
        (
            r#"{"type": "sun", "irradiance": 1, "ground": 2}"#,
            &[at],
            &["/lights/0/ground: 2, must be"],
        ),
        (
            r#"{"type": "sun", "irradiance": 1}"#,
            &[r#""sun_at": {"elevation_deg": -1, "azimuth_deg": 0}"#],
            &["/lights/0/irradiance: the sun stands 1.00 degrees below the horizon"],
        ),
        (
            r#"{"type": "sun", "irradiance": 1, "through": [[[0,0,1],[1,0,1]]]}"#,
            &[at],
            &["/lights/0/through/0: fewer than three corners"],
        ),
        (
            r#"{"type": "sun", "irradiance": 1, "through": [[[0,0,1],[1,0,1],[1,1,1],[0,1,2]]]}"#,
            &[at],
            &["/lights/0/through/0: its corners do not lie in one plane"],
        ),
        (
            r#"{"type": "point", "position": [0, 0, 1], "power": 1}"#,
            &[site],
            &["/site: no light uses it; add a light of type `sun` or `sky`"],
        ),
        (
            r#"{"type": "environment", "file": "no.hdr"}"#,
            &[],
            &["/lights/0/file: ", "no.hdr: there is no such"],
        ),
        (
            r#"{"type": "sun"}"#,
            &[nm, site, noon, r#""weather": {"file": "no.epw"}"#],
            &["/weather/file: ", "no.epw: there is no such file"],
        ),
        (
            r#"{"type": "sun"}"#,
            &[nm, site, noon, r#""weather": {"direct_normal": 1}"#],
            &["/weather: neither `file` nor `direct_normal` and `diffuse_horizontal`"],
        ),
        (
            r#"{"type": "sun", "irradiance": 1}"#,
            &[r#""site": {"latitude": 1}"#, at],
            &["/site: only one of `latitude` and `longitude`"],
        ),
    ];
    for (light, keys, words) in rows {
        let mut parts: Vec<&str> = keys.to_vec();
        parts.push(captors);
        let text = format!(r#"{{"lights": [{light}], {}}}"#, parts.join(", "));
        bad_scene(&text, &[], words);
    }
}

/// Nearly every photon of daylight meets the outside of a closed box, so that all batches bring the
/// same: the sky of radiance 100 / pi is an irradiance of 100 W/m2 on the top and of 50 W/m2 on each
/// side, and only the few photons that enter at the rim of the scene's box miss. The 95 % intervals
/// of 60 short runs hold these values in at least 90 % of the 300 cases (without account of the
/// misses it was less than half), although the errors are below 1 %.
#[test]
fn errors_of_outer_walls_are_honest() {
    let side = |a: Point, u: Point, v: Point| Mesh::rectangle(a, u, v);
    let (x, y, z) = ([1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]);
    let walls = [
        ("top", side(z, x, y), 100.0),
        ("south", side([0.0; 3], x, z), 50.0),
        ("east", side(x, y, z), 50.0),
        ("north", side(y, z, x), 50.0),
        ("west", side([0.0; 3], z, y), 50.0),
    ];
    let sky = json!({ "type": "sky", "model": "uniform", "irradiance": 100 });
    let mut world = World::new().light(sky).lambert("grey", 0.5);
    for (name, mesh, _) in &walls {
        world = world.counted(name, "grey", mesh);
    }
    let scene = world.write();
    let (mut held, mut all) = (0, 0);
    for seed in 1..=60 {
        let run = run_file(&scene.path("scene.json"), |settings| {
            (settings.photons, settings.seed, settings.k) =
                (PhotonCount::new(2000).ok(), seed, Some(NearestCount::NONE));
            settings.guiding = Guiding::Off;
        });
        for (name, _, exact) in &walls {
            let face = front(&run, name);
            let (found, error) = (face.irradiance[0], face.irradiance_se[0].expect("an error"));
            assert!(error < found / 100.0, "{name}: {found} {error}");
            held += u32::from((found - exact).abs() <= 1.98 * error);
            all += 1;
        }
    }
    println!("{held} of {all} held");
    assert!(f64::from(held) >= 0.9 * f64::from(all), "{held} of {all}");
}

/// Straight shadow edges across 180 discs: the intervals of their sunlit shares hold the closed form,
/// the share of a disc beyond a chord, in 91 % at least, and the errors of the discs that an edge
/// crosses state is at most a quarter larger than the true one. Seed 1; if 95 % hold, the odds of fewer
/// than 91 % are 1 %; the root of the mean square of some 160 has an error of 6 %.
#[test]
fn intervals_of_sunlit_shares_hold() {
    const DISCS: usize = 180;
    const RADIUS: f64 = 0.05;
    let disc = |i: usize| {
        let off = RADIUS * (2.2 * (i as f64 + 0.5) / DISCS as f64 - 1.1);
        let center = [off, 0.2 * i as f64, 0.1];
        json!({ "name": format!("d{i}"), "disc": {
            "center": center, "normal": [0, 0, 1], "radius": RADIUS } })
    };
    let roof = Mesh::rectangle([0.0, -1.0, 1.0], [3.0, 0.0, 0.0], [0.0, 40.0, 0.0]);
    let result = World::new()
        .lambert("black", 0.0)
        .with("sunlit", json!(true))
        .with("sun_at", json!({ "elevation_deg": 90, "azimuth_deg": 0 }))
        .surface("roof", "black", &roof)
        .light(json!({ "type": "sun", "irradiance": 800, "half_angle_deg": 0 }))
        .edited(|scene| scene["captors"] = (0..DISCS).map(disc).collect())
        .run(1000, 1);
    let (mut held, mut squares) = (0, [0.0; 2]);
    for captor in &result.captors {
        // the sun shines on what lies at x below 0
        let t = (-captor.center[0] / RADIUS).clamp(-1.0, 1.0);
        let share = 0.5 + (t * (1.0 - t * t).sqrt() + t.asin()) / PI;
        let (found, error) = sunlit(&captor.own);
        held += usize::from((found - share).abs() <= 1.98 * error);
        assert!(error < 0.1, "{}: {error}", captor.id);
        if t.abs() < 1.0 {
            let [stated, true_one] = &mut squares;
            (*stated, *true_one) = (*stated + error * error, *true_one + (found - share).powi(2));
        }
    }
    assert!(held as f64 >= 0.91 * DISCS as f64, "{held} of {DISCS}");
    let [stated, true_one] = squares;
    let times = (stated / true_one).sqrt();
    assert!((0.85..1.25).contains(&times), "{times} times the true error");
}
