//! How much results depend on materials and lights: closed forms, differences between runs, and the
//! same by every estimator.

use phylux::{
    Estimator, Guiding, RunResult, Settings,
    results::SensitivityResult,
    transport::{NearestCount, PhotonCount, ThreadCount},
};
use serde_json::{Value, json};

use crate::{
    bad_input::{bad_scene, phylux},
    common::run_file,
    stability::furnace,
    world::{Mesh, World, front, room},
};

const UP: [f64; 3] = [0.0, 0.0, 1.0];

/// A way to run a scene: the estimator, the guiding and the number of photons or paths.
pub type Method = (Estimator, Guiding, u64);

const PHOTONS: Method = (Estimator::Photons, Guiding::Off, 200_000);
pub const METHODS: [Method; 5] = [
    PHOTONS,
    (Estimator::Photons, Guiding::Aim, 60_000),
    (Estimator::Photons, Guiding::Full, 60_000),
    (Estimator::Paths, Guiding::Off, 60_000),
    (Estimator::Complete, Guiding::Off, 60_000),
];

pub fn run(world: &World, (estimator, guiding, photons): Method, seed: u64) -> RunResult {
    let scene = world.write();
    run_file(&scene.path("scene.json"), |settings| {
        let photons = PhotonCount::new(photons).ok();
        let k = Some(NearestCount::NONE);
        *settings = Settings { estimator, guiding, photons, seed, k, ..settings.clone() };
    })
}

pub fn all(run: &RunResult) -> &[SensitivityResult] {
    run.extras.sensitivity.as_deref().expect("sensitivities")
}

/// Returns the light of a group with its error, W: `absorbed`, or what arrived at its `front` or `back`.
fn value(run: &RunResult, (group, face): (&str, &str)) -> (f64, f64) {
    let of = run.groups.iter().find(|of| of.id == group).expect("the group");
    if face == "absorbed" {
        let error = of.absorbed_se.as_ref().and_then(|se| se[0]).expect("an error");
        return (of.absorbed.as_ref().expect("a surface")[0], error);
    }
    let of = if face == "front" { &of.front } else { of.back.as_ref().expect("a back") };
    (of.flux[0], of.flux_se[0].expect("an error"))
}

/// Returns the elasticity of a group in a band, with its error; 0 where its light has never met the
/// parameter.
pub fn elasticity(run: &RunResult, group: &str, face: &str, parameter: &str) -> (f64, f64) {
    let is = |of: &&SensitivityResult| {
        of.group.as_deref() == Some(group) && of.face == face && of.parameter == parameter
    };
    let found = all(run).iter().find(is);
    found.map_or((0.0, 0.0), |of| {
        (of.elasticity[0].expect("light"), of.elasticity_se[0].expect("an error"))
    })
}

/// Returns the elasticity and its error from the values of two independent runs, of 5 % more and 5
/// % less of an input. Runs of one seed differ by less.
pub fn difference((more, more_se): (f64, f64), (less, less_se): (f64, f64)) -> (f64, f64) {
    let span = 1.05f64.ln() - 0.95f64.ln();
    ((more / less).ln() / span, (more_se / more).hypot(less_se / less) / span)
}

/// In a furnace of reflectance R, whose walls emit, the light on a captor has met walls R / (1 - R)
/// times, for R of 0.5 and 0.8.
///
/// Seeds 1 to 5; 10 comparisons within 4 standard errors, odds of a false alarm 1.1e-3.
#[test]
fn walls_of_a_furnace() {
    for rho in [0.5, 0.8] {
        let world = furnace(1.0, rho)
            .with("sensitivity", json!(["wall"]))
            .captor("disc", &Mesh::disc([0.2, 0.1, -0.3], UP, 0.3));
        let exact = rho / (1.0 - rho);
        for (seed, method) in METHODS.into_iter().enumerate() {
            let found = run(&world, method, seed as u64 + 1);
            let (e, error) = elasticity(&found, "disc", "front", "/materials/wall/reflectance");
            assert!((e - exact).abs() < 4.0 * error, "{method:?}: {e} ± {error}, not {exact}");
            assert!(error < 0.05 * exact, "{method:?}: {error}");
            // dE / dR = e E / R
            let of = &all(&found)[0];
            let irradiance = front(&found, "disc").irradiance[0];
            let derivative = of.derivative[0].expect("a number of the scene");
            assert!((derivative / (e * irradiance / rho) - 1.0).abs() < 1e-5, "{derivative}");
            assert!(of.derivative_se[0].is_some_and(|error| error > 0.0));
        }
    }
}

/// In a furnace whose walls scatter r and mirror s, the light on a captor has met what they scatter
/// r / (1 - r - s) times, and what they mirror s / (1 - r - s) times. Both have derivatives.
///
/// Two parameters by photons, aimed flights and paths: 6 comparisons within 4 standard errors, odds of
/// a false alarm 4e-4.
#[test]
fn walls_of_a_furnace_that_scatter_and_mirror() {
    let (r, s) = (0.4, 0.25);
    let world = furnace(1.0, 0.5)
        .material("wall", json!({ "type": "phong", "reflectance": r, "specular": s }))
        .with("sensitivity", json!(["wall"]))
        .captor("disc", &Mesh::disc([0.2, 0.1, -0.3], UP, 0.3));
    for (seed, method) in [METHODS[0], METHODS[1], METHODS[3]].into_iter().enumerate() {
        let found = run(&world, method, seed as u64 + 1);
        for (key, value) in [("reflectance", r), ("specular", s)] {
            let parameter = format!("/materials/wall/{key}");
            let (e, error) = elasticity(&found, "disc", "front", &parameter);
            let exact = value / (1.0 - r - s);
            assert!((e - exact).abs() < 4.0 * error, "{method:?}, {key}: {e} ± {error}, {exact}");
            assert!(error < 0.05 * exact, "{method:?}, {key}: {error}");
        }
        assert!(all(&found).iter().all(|of| of.derivative[0].is_some_and(|by| by > 0.0)));
    }
}

/// In a group of sensors of which some have a back, the derivative on the back is one per area of the
/// backs: dE / dR = e E / R with E the irradiance there. The test does not depend on chance.
#[test]
fn backs_of_a_group_have_their_own_area() {
    let rho = 0.5;
    let disc = |x: f64| Mesh::disc([x, 0.1, -0.3], UP, 0.2);
    let world = furnace(1.0, rho)
        .with("sensitivity", json!(["wall"]))
        .captor_of_both_sides("two", &disc(-0.4))
        .captor("one", &disc(0.4))
        .with("groups", json!({ "all": ["two", "one"] }));
    let found = run(&world, PHOTONS, 1);
    let group = found.groups.iter().find(|of| of.id == "all").expect("the group");
    let back = group.back.as_ref().expect("a back").irradiance[0];
    for (face, irradiance) in [("front", group.front.irradiance[0]), ("back", back)] {
        let is_it = |of: &&SensitivityResult| of.group.as_deref() == Some("all") && of.face == face;
        let of = all(&found).iter().find(is_it).expect("the face");
        let (e, derivative) =
            (of.elasticity[0].expect("light"), of.derivative[0].expect("a number"));
        assert!((derivative / (e * irradiance / rho) - 1.0).abs() < 1e-5, "{face}: {derivative}");
    }
}

/// A box with a lamp in its middle and walls that are captors, whose power is all absorbed by them:
/// what they absorb does not depend on their reflectance.
///
/// Photons and paths within 4 standard errors, odds of a false alarm 2e-4.
#[test]
fn what_walls_absorb_of_all_light_depends_on_nothing() {
    let world = World::new()
        .lambert("wall", 0.6)
        .counted("walls", "wall", &room([-0.5; 3], [0.5; 3]))
        .light(json!({ "type": "point", "position": [0.1, 0.0, 0.0], "power": 10 }))
        .with("sensitivity", json!(true));
    for method in [PHOTONS, METHODS[3], METHODS[4]] {
        let found = run(&world, method, 7);
        let (e, error) = elasticity(&found, "walls", "absorbed", "/materials/wall/reflectance");
        assert!(e.abs() < 4.0 * error && error < 0.02, "{method:?}: {e} ± {error}");
        // all light is the lamp's
        let (e, _) = elasticity(&found, "walls", "absorbed", "/lights/0/power");
        assert!((e - 1.0).abs() < 1e-5, "{method:?}: {e}");
    }
}

/// A leaf in the open absorbs (1 - r - t) of what comes: by r, -r / (1 - r - t); by t, -t / (1 - r - t);
/// with a back of its own, only the parameters of the face that is lit count. What comes to a sensor
/// behind it has met t once.
///
/// Photons and paths, 3 comparisons each within 4 standard errors, odds of a false alarm 6e-4.
#[test]
fn a_leaf_in_the_open() {
    let (r, t) = (0.3, 0.2);
    let world = World::new()
        .material(
            "leaf",
            json!({ "type": "leaf", "ior": 1.0, "reflectance": r, "transmittance": t,
                    "back": { "reflectance": 0.4 } }),
        )
        .counted("leaf", "leaf", &Mesh::square([0.0, 0.0, 1.0], UP, 1.0))
        .captor_of_both_sides("below", &Mesh::square([0.9, 0.0, 0.6], UP, 0.5))
        .lamp("lamp", &Mesh::square([0.0, 0.0, 1.5], [0.0, 0.0, -1.0], 0.1), 10.0)
        .surface("shade", "black", &Mesh::square([0.6, 0.0, 1.4], UP, 0.7))
        .lambert("black", 0.0)
        .with("sensitivity", json!(["leaf"]));
    let exact = |by: f64| -by / (1.0 - r - t);
    for method in [PHOTONS, METHODS[3], METHODS[4]] {
        let found = run(&world, method, 3);
        let close = |parameter: &str, exact: f64| {
            let (e, error) = elasticity(&found, "leaf", "absorbed", parameter);
            assert!(
                (e - exact).abs() <= 4.0 * error && error < 0.05,
                "{method:?}, {parameter}: {e} ± {error}, not {exact}"
            );
        };
        close("/materials/leaf/reflectance", exact(r));
        close("/materials/leaf/transmittance", exact(t));
        // nothing comes back to its lower face
        close("/materials/leaf/back/reflectance", 0.0);
    }
}

/// The reflectance R of a leaf holds the 3 % that its cuticle mirrors, whatever is below it. Of light along
/// the normal a leaf absorbs 1 - R - T: by R, - R / (1 - R - T) in each band, and in a sum of bands the sum
/// of the R over that of the parts that stay.
///
/// Photons and paths, 3 comparisons each within 4 standard errors, odds of a false alarm 6e-4.
#[test]
fn reflectances_of_leaves_are_those_of_the_scene_file() {
    let (r, t) = ([0.05, 0.4], 0.2);
    let world = World::new()
        .bands(2)
        .material("leaf", json!({ "type": "leaf", "reflectance": r, "transmittance": t }))
        .counted("leaf", "leaf", &Mesh::square([0.0; 3], UP, 1.0))
        .with("sun_at", json!({ "elevation_deg": 90, "azimuth_deg": 0 }))
        .light(json!({ "type": "sun", "irradiance": 100, "half_angle_deg": 0 }))
        .with("sums", json!({ "both": ["b0", "b1"] }))
        .with("sensitivity", json!(["leaf"]));
    let stays = r.map(|r| 1.0 - r - t);
    let exact = [-r[0] / stays[0], -r[1] / stays[1], -(r[0] + r[1]) / (stays[0] + stays[1])];
    for method in [PHOTONS, METHODS[3], METHODS[4]] {
        let found = run(&world, method, 3);
        let is = |of: &&SensitivityResult| {
            of.group.as_deref() == Some("leaf")
                && of.face == "absorbed"
                && of.parameter == "/materials/leaf/reflectance"
        };
        let of = all(&found).iter().find(is).expect("the leaf");
        let errors = of.elasticity_se.iter().map(|error| error.expect("an error"));
        for ((e, error), exact) in of.elasticity.iter().zip(errors).zip(exact) {
            let e = e.expect("light");
            let what = format!("{method:?}: {e} ± {error}, not {exact}");
            assert!((e - exact).abs() <= 4.0 * error + 1e-5 && error < 0.01, "{what}");
        }
    }
}

/// Adds a room with a mirror, a glossy board, leaves that share their triangles, and two lamps.
pub fn mixed(wall: f64, leaf: [f64; 2], mirror: f64, board: f64) -> World {
    let plant = Mesh::square([0.0, 0.0, 0.0], [0.4, 0.0, 0.9], 0.4).and(Mesh::square(
        [0.1, 0.1, 0.15],
        [-0.5, 0.3, 0.8],
        0.3,
    ));
    World::new()
        .bands(2)
        .with("sums", json!({ "both": { "b0": 1, "b1": 2 } }))
        .material("wall", json!({ "type": "lambert", "reflectance": [wall, 0.5 * wall] }))
        .material(
            "leaf",
            json!({ "type": "leaf", "reflectance": leaf[0], "transmittance": leaf[1] }),
        )
        .material("mirror", json!({ "type": "mirror", "reflectance": mirror }))
        .material(
            "board",
            json!({ "type": "phong", "reflectance": board, "specular": 0.0, "transmittance": 0.1 }),
        )
        .surface("room", "wall", &room([-1.0; 3], [1.0; 3]))
        .counted("plants", "leaf", &plant)
        .surface("glass", "mirror", &Mesh::square([-0.98, 0.0, 0.0], [1.0, 0.0, 0.0], 1.2))
        .surface("board", "board", &Mesh::square([0.5, 0.5, 0.2], [-0.4, -0.6, 0.3], 0.8))
        .captor_of_both_sides("shelf", &Mesh::square([0.3, -0.4, -0.7], UP, 0.6))
        .edited(|scene| {
            scene["objects"][1]["instances"] = json!([
                { "translate": [0.2, 0.1, -0.5] },
                { "translate": [-0.4, -0.3, -0.4], "rotate_deg": [0, 0, 70] }
            ]);
        })
        .lamp("panel", &Mesh::square([0.0, 0.0, 0.9], [0.0, 0.0, -1.0], 0.5), 30.0)
        .light(json!({ "type": "point", "position": [0.6, -0.6, 0.5], "power": [10, 20] }))
}

/// In a room of everything, elasticities are those of the difference between two runs in which the
/// parameter is 5 % larger and smaller, and all methods agree with each other. Light of all lamps
/// together has the elasticity 1.
///
/// 4 parameters, 3 places: 12 differences of paths within 4 standard errors of both, and 4 methods of
/// 12 values against paths; odds of a false alarm 4e-3.
#[test]
fn differences_between_runs_in_a_room_of_everything() {
    let usual = (0.6, [0.3, 0.25], 0.8, 0.5);
    let at = |which: usize, factor: f64| {
        let (mut wall, mut leaf, mut mirror, mut board) = usual;
        match which {
            0 => wall *= factor,
            1 => leaf[1] *= factor,
            2 => mirror *= factor,
            _ => board *= factor,
        }
        mixed(wall, leaf, mirror, board)
    };
    let parameters = [
        "/materials/wall/reflectance",
        "/materials/leaf/transmittance",
        "/materials/mirror/reflectance",
        "/materials/board/reflectance",
    ];
    let places = [("shelf", "front"), ("shelf", "back"), ("plants", "absorbed")];
    let world = at(0, 1.0).with("sensitivity", json!(true));
    let paths = run(&world, (Estimator::Paths, Guiding::Off, 400_000), 1);
    for (which, parameter) in parameters.into_iter().enumerate() {
        let method = (Estimator::Paths, Guiding::Off, 400_000);
        let [more, less] = [1.05, 0.95].map(|factor| run(&at(which, factor), method, 2));
        for place in places {
            let ((more, more_se), (less, less_se)) = (value(&more, place), value(&less, place));
            let (difference, error) = difference((more, more_se), (less, less_se));
            let (e, own) = elasticity(&paths, place.0, place.1, parameter);
            let off = (e - difference).abs();
            assert!(error < 0.1, "{parameter}, {place:?}: {difference} ± {error}");
            assert!(
                off < 4.0 * error.hypot(own) + 2e-3,
                "{parameter}, {place:?}: {e} ± {own}, not {difference} ± {error}"
            );
            assert!(own < 0.1, "{parameter}, {place:?}: {own}");
        }
    }
    for (seed, (estimator, guiding, photons)) in METHODS.into_iter().enumerate() {
        let photons = if estimator == Estimator::Photons { 2 * photons } else { photons };
        let found = run(&world, (estimator, guiding, photons), 10 + seed as u64);
        for parameter in parameters {
            for place in places {
                let (e, error) = elasticity(&found, place.0, place.1, parameter);
                let (exact, own) = elasticity(&paths, place.0, place.1, parameter);
                let off = (e - exact).abs();
                assert!(
                    off < 4.0 * error.hypot(own),
                    "{estimator}, {guiding:?}, {parameter}, {place:?}: {e} ± {error}, not {exact} ± {own}"
                );
            }
        }
        for (group, face) in places {
            let of = |light| elasticity(&found, group, face, light).0;
            let sum = of("/lights/0/power") + of("/lights/1/power");
            assert!((sum - 1.0).abs() < 1e-5, "{group}: {sum}");
        }
    }
}

/// In a furnace whose walls reflect R0 and R1 in two bands, the ratio of the light in them has the
/// elasticity R0 / (1 - R0) - R1 / (1 - R1), and by R it changes by the ratio times
/// 1 / (1 - R0) - 1 / (1 - R1). The standard error comes from how both bands vary together.
///
/// Two methods: 4 comparisons within 4 standard errors, odds of a false alarm 3e-4.
#[test]
fn ratios_in_a_furnace() {
    let r = [0.5, 0.8];
    let world = World::new()
        .bands(2)
        .with("ratios", json!({ "of": { "numerator": "b0", "denominator": "b1" } }))
        .material("wall", json!({ "type": "lambert", "reflectance": r }))
        .glowing("walls", "wall", &room([-1.0; 3], [1.0; 3]), 0.5)
        .captor("disc", &Mesh::disc([0.2, 0.1, -0.3], UP, 0.6))
        .with("sensitivity", json!(["wall"]));
    let exact = r[0] / (1.0 - r[0]) - r[1] / (1.0 - r[1]);
    for method in [PHOTONS, METHODS[3]] {
        let found = run(&world, method, 1);
        for group in [true, false] {
            let is_it = |of: &&SensitivityResult| of.group.is_some() == group && of.face == "front";
            let row = all(&found).iter().find(is_it).expect("the walls");
            let of = row.ratios.as_ref().expect("ratios");
            let (e, error) =
                (of.elasticity[0].expect("a ratio"), of.elasticity_se[0].expect("an error"));
            assert!((e - exact).abs() < 4.0 * error, "{method:?}: {e} ± {error}, not {exact}");
            assert!(error < 0.03 * exact.abs(), "{method:?}: {error}");
            // the same light brings both bands, so that errors partly cancel
            let apart = row.elasticity_se[0]
                .expect("an error")
                .hypot(row.elasticity_se[1].expect("an error"));
            assert!(error < apart, "{method:?}: {error} of {apart}");
            let ratio = front(&found, "disc").ratios.as_ref().expect("ratios").ratio[0];
            let by = ratio.expect("a ratio") * (1.0 / (1.0 - r[0]) - 1.0 / (1.0 - r[1]));
            let derivative = of.derivative[0].expect("numbers of the scene");
            assert!((derivative / by - 1.0).abs() < 0.03, "{method:?}: {derivative}, not {by}");
            assert!(of.derivative_se[0].is_none(), "the bands have different values");
        }
    }
}

/// In a stand that repeats, whose plants are copies that share their triangles, under sun and sky,
/// with a mirror in which the sun stands and a sensor with a response, elasticities are those of
/// the difference between two runs, and photons find the same. (Paths alone do not find the sun in the
/// mirror of a scene that repeats.)
///
/// 4 inputs, 4 values: 16 differences of complete paths within 4 standard errors of both, and 16
/// values of photons against them; odds of a false alarm 2e-3.
#[test]
fn a_stand_under_the_sun() {
    let usual = [0.45, 0.35, 0.3, 0.8];
    let at = |which: usize, factor: f64| {
        let mut values = usual;
        values[which] *= factor;
        // without a cuticle, all of the reflectance is a factor
        let leaf = json!({
            "type": "leaf", "ior": 1.0, "reflectance": values[0], "transmittance": values[1]
        });
        let plant = Mesh::square([0.1, 0.0, 0.1], [0.5, 0.0, 0.9], 0.2).and(Mesh::square(
            [-0.1, 0.05, 0.25],
            [-0.6, 0.3, 0.7],
            0.25,
        ));
        let soil = Mesh::rectangle([0.0; 3], [0.8, 0.0, 0.0], [0.0, 0.7, 0.0]);
        World::new()
            .with("periodic", json!({ "x": [0, 0.8], "y": [0, 0.7] }))
            .material("leaf", leaf)
            .lambert("soil", values[2])
            .material("mirror", json!({ "type": "mirror", "reflectance": values[3] }))
            .counted("plants", "leaf", &plant)
            .counted("ground", "soil", &soil)
            .surface("glass", "mirror", &Mesh::square([0.4, 0.68, 0.3], [0.0, -1.0, 0.0], 0.5))
            .edited(|scene| {
                scene["objects"][0]["instances"] = json!([
                    { "translate": [0.2, 0.2, 0.05] },
                    { "translate": [0.6, 0.5, 0.15], "rotate_deg": [0, 0, 130] }
                ]);
                scene["objects"][0]["share"] = json!(true);
                scene["objects"][1]["ground"] = json!(true);
            })
            .captor_of_both_sides("sensor", &Mesh::square([0.4, 0.35, 0.02], UP, 0.5))
            .response(json!([[0, 1], [45, 0.9], [75, 0.6], [90, 0.1]]))
            .with("sun_at", json!({ "elevation_deg": 40, "azimuth_deg": 170 }))
            .light(json!({ "type": "sun", "irradiance": 300 }))
            .light(json!({ "type": "sky", "model": "uniform", "irradiance": 100 }))
    };
    let parameters = [
        "/materials/leaf/reflectance",
        "/materials/leaf/transmittance",
        "/materials/soil/reflectance",
        "/materials/mirror/reflectance",
    ];
    let places =
        [("sensor", "front"), ("sensor", "back"), ("plants", "absorbed"), ("ground", "absorbed")];
    let world = at(0, 1.0).with("sensitivity", json!(true));
    let known = run(&world, (Estimator::Complete, Guiding::Off, 75_000), 1);
    for (which, parameter) in parameters.into_iter().enumerate() {
        let method = (Estimator::Complete, Guiding::Off, 75_000);
        let [more, less] = [1.05, 0.95].map(|factor| run(&at(which, factor), method, 2));
        for place in places {
            let (exact, error) = difference(value(&more, place), value(&less, place));
            assert!(error < 0.1, "{parameter}, {place:?}: {exact} ± {error}");
            let (e, own) = elasticity(&known, place.0, place.1, parameter);
            assert!(
                (e - exact).abs() < 4.0 * error.hypot(own) + 2e-3,
                "{parameter}, {place:?}: {e} ± {own}, not {exact} ± {error}"
            );
            assert!(own < 0.1, "{parameter}, {place:?}: {own}");
        }
    }
    let found = run(&world, (Estimator::Photons, Guiding::Off, 200_000), 3);
    for parameter in parameters {
        for place in places {
            let (e, error) = elasticity(&found, place.0, place.1, parameter);
            let (exact, own) = elasticity(&known, place.0, place.1, parameter);
            assert!(
                (e - exact).abs() < 4.0 * error.hypot(own),
                "{parameter}, {place:?}: {e} ± {error}, not {exact} ± {own}"
            );
        }
    }
}

/// `--sensitivity` gives the bytes that the key gives, for all inputs and for some; a shard has
/// none of the option, and what is not in the scene is refused at the option.
#[test]
fn the_option_is_the_key() {
    let world = mixed(0.6, [0.3, 0.25], 0.8, 0.5);
    let plain = world.clone().write();
    let command = |scene: &crate::common::TestScene, options: &[&str]| {
        let mut all = vec!["run", "scene.json", "--photons", "5000", "-o", "r.json"];
        all.extend(options);
        phylux(&scene.path(""), &all)
    };
    let bytes = |scene: &crate::common::TestScene, options: &[&str]| {
        let output = command(scene, options);
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        std::fs::read(scene.path("r.json")).expect("results")
    };
    for (key, options) in [
        (json!(true), &["--sensitivity"][..]),
        (json!(["wall", "leaf"]), &["--sensitivity=wall", "--sensitivity=leaf"]),
    ] {
        let with = world.clone().with("sensitivity", key).write();
        assert!(bytes(&with, &[]) == bytes(&plain, options), "{options:?}");
    }
    let said = |options: &[&str]| {
        let output = command(&plain, options);
        assert!(!output.status.success(), "{options:?}");
        String::from_utf8_lossy(&output.stderr).into_owned()
    };
    let error = said(&["--sensitivity=wal"]);
    for words in ["--sensitivity", "no material or light `wal`", "did you mean `wall`"] {
        assert!(error.contains(words), "{error}");
    }
    let error = said(&["--sensitivity", "--shard=1/2"]);
    assert!(error.contains("--shard") && error.contains("--sensitivity"), "{error}");
}

/// Lights are told by their places in the scene file, sun and sky without names, too. Uncertain ones
/// may also be given by their names.
#[test]
fn lights_are_told_by_their_places() {
    let world = World::new()
        .lambert("soil", 0.3)
        .surface("soil", "soil", &Mesh::square([0.0; 3], UP, 4.0))
        .captor("disc", &Mesh::disc([0.0, 0.0, 0.5], UP, 0.3))
        .with("sun_at", json!({ "elevation_deg": 40, "azimuth_deg": 170 }))
        .light(json!({ "type": "sun", "irradiance": 300 }))
        .light(json!({ "type": "sky", "model": "uniform", "irradiance": 100 }))
        .lamp("tile", &Mesh::square([0.0, 0.0, 2.0], [0.0, 0.0, -1.0], 0.3), 30.0)
        .with("sensitivity", json!(true))
        .with("uncertain", json!({ "sun": 0.1, "/lights/sky": 0.2, "/lights/tile/power": 3 }));
    let found = run(&world, (Estimator::Photons, Guiding::Off, 20_000), 1);
    let rows = all(&found).iter().filter(|row| row.group.is_some() && row.face == "front");
    let lights: Vec<_> = rows
        .filter(|row| row.parameter.starts_with("/lights/"))
        .map(|row| (&*row.parameter, row.light.as_deref()))
        .collect();
    let expected =
        [("/lights/0", Some("sun")), ("/lights/1", Some("sky")), ("/lights/2/power", Some("tile"))];
    assert_eq!(lights, expected);
    let of = found.extras.budget.as_ref().expect("a budget")[0].largest.iter();
    let mut names: Vec<&str> = of.map(|input| &*input.parameter).collect();
    names.sort_unstable();
    assert_eq!(names, ["/lights/0", "/lights/1", "/lights/2/power"]);
}

/// Results do not depend on threads or on shards, and the rest of the results does not change by the
/// key.
#[test]
fn the_same_bytes_and_the_same_rest() {
    let world = mixed(0.6, [0.3, 0.25], 0.8, 0.5);
    let scene = world.clone().with("sensitivity", json!(true)).write();
    let results = |threads: u32, estimator: &str, options: &[&str]| -> Value {
        let threads = threads.to_string();
        let mut all = vec!["run", "scene.json", "--photons", "20000", "--threads", &threads];
        all.extend(["--estimator", estimator, "-o", "r.json"]);
        all.extend(options);
        let output = phylux(&scene.path(""), &all);
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let text = std::fs::read_to_string(scene.path("r.json")).expect("results");
        serde_json::from_str(&text).expect("JSON")
    };
    for estimator in ["photons", "complete"] {
        let one = results(1, estimator, &[]);
        assert!(one["sensitivity"].as_array().is_some_and(|rows| rows.len() > 20));
        assert_eq!(one, results(3, estimator, &[]), "{estimator}");
        let command = |line: &str| {
            let words: Vec<&str> = line.split_whitespace().collect();
            let output = phylux(&scene.path(""), &words);
            assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        };
        for part in [1, 2] {
            let run = "run scene.json --photons 20000 --estimator";
            command(&format!("{run} {estimator} --shard {part}/2 -o {estimator}{part}.json"));
        }
        command(&format!("merge {estimator}1.json {estimator}2.json -o joined.json"));
        let text = std::fs::read_to_string(scene.path("joined.json")).expect("results");
        let joined: Value = serde_json::from_str(&text).expect("JSON");
        assert_eq!(one["sensitivity"], joined["sensitivity"], "{estimator}");
    }
    let settings = |settings: &mut Settings| {
        settings.estimator = Estimator::Photons;
        settings.photons = PhotonCount::new(20_000).ok();
        settings.threads = ThreadCount::new(2).expect("a number");
    };
    let with = run_file(&scene.path("scene.json"), settings);
    let without = run_file(&world.write().path("scene.json"), settings);
    let captors = |of: &RunResult| serde_json::to_value((&of.captors, &of.groups)).expect("JSON");
    assert_eq!(captors(&with), captors(&without));
    assert!(without.extras.sensitivity.is_none());
}

/// What cannot be is refused with its place; what sends on nothing is said.
#[test]
fn names_are_checked() {
    let scene = |names: Value| {
        json!({
            "materials": { "white": { "type": "lambert", "reflectance": 0.5 },
                           "black": { "type": "lambert", "reflectance": 0 } },
            "objects": [{ "name": "a", "obj": "a.obj", "material": "white", "captor": true },
                        { "name": "b", "obj": "a.obj", "material": "black",
                          "transform": { "translate": [0, 0, 1] } }],
            "lights": [{ "type": "point", "position": [0.2, 0.2, 0.5], "power": 1 }],
            "sensitivity": names
        })
        .to_string()
    };
    let files = [("a.obj", "v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 3\n")];
    bad_scene(
        &scene(json!(["whit"])),
        &files,
        &["/sensitivity/0", "no material or light `whit`", "did you mean `white`"],
    );
    bad_scene(&scene(json!("white")), &files, &["/sensitivity", "true, false or a list of names"]);
    let world = crate::common::TestScene::new(&scene(json!(["black", "white"])), &files);
    let output = phylux(&world.path(""), &["check", "scene.json"]);
    let said = String::from_utf8_lossy(&output.stdout).into_owned()
        + &String::from_utf8_lossy(&output.stderr);
    assert!(said.contains("`black` sends on no light"), "{said}");
}
