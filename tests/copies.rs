//! Copies of objects: tables of them, and what they count.

use phylux::{RunResult, results::CaptorResult};
use serde_json::{Value, json};

use crate::{
    bad_input::bad_scene,
    common::{TestScene, run_file},
    world::{Mesh, World, check_ledger, room},
};

const PLANT: &str = "v 0 0 0\nv 0.2 0 0\nv 0.2 0.2 0.1\nv 0 0.2 0.1\n\
                     g low\nf 1 2 3\ng high\nf 1 3 4\n";

/// Returns a scene with copies of a plant, below a lamp.
fn field(instances: &Value, captor: &Value) -> Value {
    json!({
        "unit": "m",
        "materials": { "leaf": { "type": "lambert", "reflectance": 0.4 } },
        "objects": [{
            "name": "plant", "obj": "plant.obj", "material": "leaf",
            "transform": { "translate": [0.1, 0, 0] }, "instances": instances, "captor": captor
        }],
        "lights": [{ "type": "point", "position": [0.5, 0.5, 1], "power": 1 }],
        "settings": { "guiding": "off", "photons": 20_000 }
    })
}

fn run(scene: &Value, table: &str) -> phylux::RunResult {
    let files = [("plant.obj", PLANT), ("field.csv", table)];
    let scene = TestScene::new(&scene.to_string(), &files);
    run_file(&scene.path("scene.json"), |_| ())
}

/// The same field by an array, by a table of places and by a table of matrices: the same counts.
#[test]
fn a_table_of_copies_is_an_array() {
    let array = json!([
        { "translate": [0, 0, 0.1] },
        { "translate": [0.5, 0.4, 0], "rotate_deg": [0, 0, 90], "scale": 2 }
    ]);
    let places = "z,x,y,scale,turn_deg\n0.1,0,0,1,0\n0,0.5,0.4,2,90\n";
    let matrices = "m00,m01,m02,m03,m10,m11,m12,m13,m20,m21,m22,m23\n\
                    1,0,0,0,0,1,0,0,0,0,1,0.1\n0,-2,0,0.5,2,0,0,0.4,0,0,2,0\n";
    let captor = json!(true);
    let expected = run(&field(&array, &captor), "");
    let ids: Vec<&str> = expected.captors.iter().map(|c| c.id.as_str()).collect();
    assert_eq!(ids, ["plant/low#0", "plant/high#0", "plant/low#1", "plant/high#1"]);
    for table in [places, matrices] {
        let found = run(&field(&json!({ "csv": "field.csv" }), &captor), table);
        for (found, expected) in found.captors.iter().zip(&expected.captors) {
            assert_eq!(found.id, expected.id);
            let value = |c: &phylux::results::CaptorResult| c.absorbed.as_ref().unwrap()[0];
            let (found, expected) = (value(found), value(expected));
            assert!((found - expected).abs() <= 1e-6 * expected, "{found} {expected}");
        }
    }
}

/// A mirrored copy keeps its fronts: it counts the lamp above it on its front, as its mirror image
/// does below a lamp at the mirrored place.
#[test]
fn a_mirrored_copy_keeps_its_fronts() {
    let matrix = "m00,m01,m02,m03,m10,m11,m12,m13,m20,m21,m22,m23\n-1,0,0,1,0,1,0,0,0,0,1,0\n";
    let result = run(&field(&json!({ "csv": "field.csv" }), &json!("instance")), matrix);
    let [plant] = &result.captors[..] else { panic!("one captor") };
    assert!(plant.front.flux[0] > 0.0);
    assert_eq!(plant.back.as_ref().unwrap().flux[0], 0.0);
}

/// One captor for each plant counts what the captors of its leaves count together.
#[test]
fn a_plant_is_one_captor() {
    let table = "x,y,z\n0,0,0.1\n0.5,0.4,0\n";
    let instances = json!({ "csv": "field.csv" });
    let leaves = run(&field(&instances, &json!(true)), table);
    let plants = run(&field(&instances, &json!("instance")), table);
    let ids: Vec<&str> = plants.captors.iter().map(|c| c.id.as_str()).collect();
    assert_eq!(ids, ["plant#0", "plant#1"]);
    for plant in &plants.captors {
        let group = leaves.groups.iter().find(|g| g.id == plant.id).expect("a group");
        let (own, all) = (plant.absorbed.as_ref().unwrap()[0], group.absorbed.as_ref().unwrap()[0]);
        assert!((own - all).abs() < 1e-9 * all, "{}: {own} {all}", plant.id);
        assert!((plant.area - group.area).abs() < 1e-12);
    }
}

#[test]
fn tables_that_cannot_be_read_are_named() {
    let scene = |instances: Value| field(&instances, &json!(true)).to_string();
    let csv = scene(json!({ "csv": "field.csv" }));
    let files = |table: &'static str| [("plant.obj", PLANT), ("field.csv", table)];
    bad_scene(&csv, &files("x,y,z\n0,0\n"), &["field.csv:2", "2 values"]);
    bad_scene(&csv, &files("x,y,z,turn\n"), &["field.csv:1", "turn_deg"]);
    bad_scene(&scene(json!({ "csv": "none.csv" })), &files(""), &["none.csv"]);
    bad_scene(&scene(json!({ "csv": "" })), &files(""), &["/objects/0/instances/csv"]);
    bad_scene(&scene(json!({ "table": "a" })), &files(""), &["/objects/0/instances"]);
    bad_scene(&scene(json!([])), &files(""), &["/objects/0/instances", "empty"]);
    let word = field(&json!([{}]), &json!("plant")).to_string();
    bad_scene(&word, &files(""), &["/objects/0/captor", "\"instance\""]);
}

/// Copies that are turned about all axes, small, large and mirrored, as rows of matrices.
const MATRICES: &str = "m00,m01,m02,m03,m10,m11,m12,m13,m20,m21,m22,m23\n\
    1,0,0,0.5,0,1,0,0.5,0,0,1,0.2\n\
    0,-1.5,0,1.6,1.5,0,0,0.6,0,0,1.5,0.1\n\
    0.36,0.48,-0.8,0.6,-0.8,0.6,0,1.4,0.48,0.64,0.6,0.7\n\
    -0.5,0,0,1.5,0,0.5,0,1.5,0,0,0.5,0.4\n";

/// Returns a plant of upright and lying leaves and a ball on its stem.
fn plant() -> Mesh {
    let leaf = |z: f64, x: f64| Mesh::rectangle([0.0, -0.1, z], [x, 0.0, 0.1], [0.0, 0.2, 0.0]);
    let ball = Mesh::sphere([0.0, 0.0, 0.4], 0.08, 6);
    leaf(0.1, 0.3).and(leaf(0.25, -0.3)).and(ball)
}

/// Returns a room with copies of that plant, whose triangles are shared or not.
fn stand(share: bool, captor: Value, world: World) -> World {
    let floor = Mesh::rectangle([0.0; 3], [2.0, 0.0, 0.0], [0.0, 2.0, 0.0]);
    let leaf = json!({ "type": "leaf", "reflectance": [0.1, 0.45], "transmittance": [0.05, 0.45] });
    world
        .bands(2)
        .material("leaf", leaf)
        .lambert("soil", 0.3)
        .with_file("field.csv", MATRICES)
        .captor("sensor", &Mesh::square([1.0, 1.0, 0.35], [0.0, 0.0, 1.0], 0.4))
        .counted("soil", "soil", &floor)
        .counted("plant", "leaf", &plant())
        .edited(move |scene| {
            let plant = scene["objects"].as_array_mut().unwrap().last_mut().unwrap();
            plant["instances"] = json!({ "csv": "field.csv" });
            plant["share"] = json!(share);
            plant["captor"] = captor;
        })
}

fn lamps(world: World) -> World {
    world
        .lambert("wall", 0.6)
        .surface("room", "wall", &room([-0.5, -0.5, -0.1], [2.5, 2.5, 2.0]))
        .lamp("lamp", &Mesh::square([0.8, 0.9, 1.9], [0.0, 0.0, -1.0], 0.5), 100.0)
}

fn sky(world: World) -> World {
    world
        .with("periodic", json!({ "x": [0, 2], "y": [0, 2] }))
        .light(json!({ "type": "sky", "model": "uniform", "irradiance": 1 }))
        .with("sun_at", json!({ "elevation_deg": 40, "azimuth_deg": 20 }))
        .light(json!({ "type": "sun", "irradiance": 1 }))
}

/// Returns all values of a captor with their standard errors.
fn values(captor: &CaptorResult) -> Vec<(f64, f64)> {
    let faces = [Some(&captor.front), captor.back.as_ref()];
    let of_faces = faces.into_iter().flatten().flat_map(|face| {
        face.flux.iter().zip(&face.flux_se).map(|(value, error)| (*value, error.unwrap_or(0.0)))
    });
    let absorbed = captor.absorbed.iter().flatten().zip(captor.absorbed_se.iter().flatten());
    of_faces.chain(absorbed.map(|(value, error)| (*value, error.unwrap_or(0.0)))).collect()
}

/// Compares two runs of the same field: captors, areas, and values in units of their errors. The
/// limits on the mean square and on the largest have odds of 1e-4 together for 30 independent values
/// and more; with fixed seeds the 14 comparisons are always the same.
fn agree(what: &str, shared: &RunResult, own: &RunResult) {
    let mut z = Vec::new();
    for (found, expected) in shared.captors.iter().zip(&own.captors) {
        assert_eq!(found.id, expected.id);
        assert_eq!(found.groups, expected.groups);
        let [area, other] = [found, expected].map(|captor| captor.area);
        assert!((area / other - 1.0).abs() < 1e-9, "{what}, {}: {area} {other}", found.id);
        let near = |axis: usize| (found.center[axis] - expected.center[axis]).abs() < 1e-9;
        assert!((0..3).all(near), "{what}: {:?} {:?}", found.center, expected.center);
        for ((a, ea), (b, eb)) in values(found).into_iter().zip(values(expected)) {
            let error = ea.hypot(eb) + 1e-6 * b.abs();
            if error > 0.0 {
                z.push((a - b) / error);
            }
        }
    }
    assert_eq!(shared.captors.len(), own.captors.len());
    let square = z.iter().map(|z| z * z).sum::<f64>() / z.len() as f64;
    let largest = z.iter().fold(0.0f64, |largest, z| largest.max(z.abs()));
    assert!(z.len() >= 30 && square < 2.3 && largest < 5.2, "{what}: {square} {largest} {z:?}");
}

/// Copies that share their triangles count what copies with triangles of their own count: under
/// lamps and under sun and sky without edges, by photons, by guided photons and by paths; however
/// they are turned, mirrored and scaled.
#[test]
fn shared_copies_count_as_others() {
    for (light, name) in [(lamps as fn(World) -> World, "lamps"), (sky, "sky")] {
        for captor in [json!(true), json!("instance"), json!("triangle")] {
            let world = |share| light(stand(share, captor.clone(), World::new()));
            let (shared, own) = (world(true), world(false));
            let what = format!("{name}, {captor}");
            let photons = shared.run(200_000, 1);
            check_ledger(&photons);
            agree(&what, &photons, &own.run(200_000, 2));
            agree(&what, &shared.run_paths(2_000, 1), &own.run_paths(2_000, 2));
        }
    }
    for guiding in ["aim", "full"] {
        let world = |share| {
            let settings = json!({ "guiding": guiding, "k": 0 });
            lamps(stand(share, json!(true), World::new())).with("settings", settings)
        };
        agree(guiding, &world(true).run(100_000, 3), &world(false).run(100_000, 4));
    }
}

/// No light comes into balls, however they are placed: their triangles close in the coordinates of
/// the object, and rays leave them by more than what placing them rounds.
#[test]
fn shared_balls_are_tight() {
    let world = |share: bool| {
        let far = [30.0, -20.0, 10.0];
        let ball = Mesh::sphere([0.0; 3], 0.5, 12);
        let at = |i: usize| far[i] + [0.7, 1.2, 0.3][i];
        let inside = Mesh::sphere([at(0), at(1), at(2)], 0.45, 4);
        World::new()
            .lambert("white", 0.99)
            .surface("room", "white", &room(far, far.map(|x| x + 2.0)))
            .surface("ball", "white", &ball)
            .captor("inside", &inside)
            .lamp("lamp", &Mesh::square([31.6, -19.0, 11.99], [0.0, 0.0, -1.0], 0.5), 1.0)
            .edited(move |scene| {
                let ball = &mut scene["objects"][1];
                let turned = |x: f64, y: f64, z: f64, deg: f64| {
                    json!({ "translate": [far[0] + x, far[1] + y, far[2] + z], "scale": 1.0 + 0.001 * deg,
                            "rotate_deg": [deg, 2.0 * deg, 3.0 * deg] })
                };
                ball["instances"] = json!([turned(0.7, 1.2, 0.3, 11.0), turned(1.4, 1.0, 1.0, 50.0)]);
                ball["share"] = json!(share);
            })
    };
    let result = world(true).run(100_000, 1);
    check_ledger(&result);
    // light goes round, and hardly any is left when a photon is given up
    assert!(result.energy.lost[0] < 0.02 * result.energy.power[0], "{:?}", result.energy.lost);
    assert_eq!(result.captors[0].front.flux[0], 0.0);
}

/// Copies share triangles where that pays: many of them, of an object of many triangles. `share`
/// decides otherwise.
#[test]
fn copies_share_where_it_pays() {
    // balls of 4 n (n - 1) triangles
    for (rows, each, copies, share, shared) in [
        (36, 5_040, 40, None, true),
        (36, 5_040, 39, None, false),
        (230, 210_680, 1, None, false),
        (36, 5_040, 40, Some(false), false),
        (6, 120, 1_700, None, false),
        (6, 120, 3, Some(true), true),
    ] {
        let ball = Mesh::sphere([0.0; 3], 0.4, rows);
        let table: String = (0..copies).map(|i| format!("{i},0,0\n")).collect();
        let world = World::new()
            .lambert("a", 0.5)
            .light(json!({ "type": "point", "position": [0, 0, 3], "power": 1 }))
            .with_file("field.csv", &format!("x,y,z\n{table}"))
            .surface("ball", "a", &ball)
            .edited(|scene| {
                scene["objects"][0]["instances"] = json!({ "csv": "field.csv" });
                if let Some(share) = share {
                    scene["objects"][0]["share"] = json!(share);
                }
            });
        let loaded = phylux::load(&world.write().path("scene.json")).expect("a scene");
        let distinct = if shared { each } else { each * copies };
        assert_eq!(loaded.scene.triangles().len(), each * copies);
        assert_eq!(loaded.scene.distinct_triangles(), distinct, "{copies} of {each}");
        let unshared = if shared { 0 } else { each * copies };
        assert_eq!(loaded.scene.unshared(), unshared, "{copies} of {each}");
    }
}

/// A matrix that a file rounds to six digits turns what it moves by less than that, so its copies
/// share their triangles; the plant stands where its own copy stands.
#[test]
fn rounded_matrices_share() {
    let (sin, cos) = 0.4f64.sin_cos();
    let row = |digits: usize| {
        let [a, b] = [1.5 * cos, 1.5 * sin].map(|x| format!("{x:.digits$}"));
        format!("{a},-{b},0,2,{b},{a},0,1,0,0,1.5,0\n")
    };
    let head = "m00,m01,m02,m03,m10,m11,m12,m13,m20,m21,m22,m23\n";
    let found = |digits: usize, share: bool| {
        let world = World::new()
            .lambert("a", 0.5)
            .light(json!({ "type": "point", "position": [0, 0, 3], "power": 1 }))
            .with_file("field.csv", &format!("{head}{}", row(digits)))
            .surface("ball", "a", &Mesh::sphere([0.5, 0.0, 0.0], 0.4, 12))
            .edited(|scene| {
                scene["objects"][0]["instances"] = json!({ "csv": "field.csv" });
                scene["objects"][0]["share"] = json!(share);
            });
        phylux::load(&world.write().path("scene.json")).expect("a scene").scene
    };
    let (shared, own) = (found(6, true), found(15, false));
    assert_eq!(shared.triangles().len(), own.triangles().len());
    for (a, b) in shared.triangles().iter().zip(own.triangles().iter()) {
        for (a, b) in [(a.a, b.a), (a.b, b.b), (a.c, b.c)] {
            assert!(a.distance(b) < 3e-6, "{a} {b}");
        }
    }
}

/// Layers know the areas of shared copies, and where they absorb.
#[test]
fn layers_know_shared_copies() {
    let world =
        |share| sky(stand(share, json!(true), World::new())).with("layers", json!({ "dz": 0.1 }));
    let (shared, own) = (world(true).run(100_000, 1), world(false).run(100_000, 2));
    let [shared, own] = [&shared, &own].map(|run| run.extras.layers.as_ref().expect("layers"));
    assert_eq!(shared.len(), own.len());
    for (found, expected) in shared.iter().zip(own) {
        assert!((found.area - expected.area).abs() < 1e-9, "{} {}", found.area, expected.area);
        let error =
            found.absorbed_se[0].unwrap_or(0.0).hypot(expected.absorbed_se[0].unwrap_or(0.0));
        let difference = found.absorbed[0] - expected.absorbed[0];
        assert!(difference.abs() <= 5.0 * error + 1e-6, "{difference} {error}");
    }
}

/// What may not share its triangles says why, if it is asked to.
#[test]
fn what_cannot_be_shared_says_why() {
    let with = |table: &'static str, material: Value| {
        let mut scene = field(&json!({ "csv": "field.csv" }), &json!(true));
        scene["materials"]["leaf"] = material;
        scene["objects"][0]["share"] = json!(true);
        (scene.to_string(), [("plant.obj", PLANT), ("field.csv", table)])
    };
    let grey = || json!({ "type": "lambert", "reflectance": 0.4 });
    let matrix = "m00,m01,m02,m03,m10,m11,m12,m13,m20,m21,m22,m23\n2,0,0,1,0,1,0,0,0,0,1,0\n";
    let (scene, files) = with(matrix, grey());
    bad_scene(&scene, &files, &["/objects/0/share", "stretched", "leave `share` out"]);
    let (scene, files) = with("x,y,z\n0,0,0\n", json!({ "type": "mirror", "reflectance": 0.9 }));
    bad_scene(&scene, &files, &["/objects/0/share", "mirror"]);
    let mut many = field(&json!({ "csv": "field.csv" }), &json!(true));
    many["objects"][0]["share"] = json!(true);
    let rows: String = (0..1_000_001).map(|i| format!("{i},0,0\n")).collect();
    let table = format!("x,y,z\n{rows}");
    bad_scene(&many.to_string(), &[("plant.obj", PLANT), ("field.csv", &table)], &["captors"]);
}

/// So many copies at one place that no ray would get through are refused, the same or nearly the same
/// ones, whether they share their triangles or not; as many side by side are not.
#[test]
fn crowds_are_refused() {
    let places = |step: f64| {
        let row = |i: u32| format!("{},0,0\n", 0.1 + step * f64::from(i));
        (0..10_500).map(row).fold(String::from("x,y,z\n"), |table, row| table + &row)
    };
    for share in [false, true] {
        let mut scene = field(&json!({ "csv": "field.csv" }), &json!(false));
        scene["objects"][0]["share"] = json!(share);
        for step in [0.0, 1e-6] {
            let files = [("plant.obj", PLANT), ("field.csv", &*places(step))];
            let words = ["/objects/0/instances", "10500 of its copies", "at one place", "spread"];
            bad_scene(&scene.to_string(), &files, &words);
        }
        let files = [("plant.obj", PLANT), ("field.csv", &*places(0.5))];
        let scene = TestScene::new(&scene.to_string(), &files);
        phylux::load(&scene.path("scene.json")).unwrap_or_else(|e| panic!("{e}"));
    }
}
