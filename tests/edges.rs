//! Edges of triangles: what is near an edge, or far from the captors, gets the same light as
//! elsewhere. Lengths are in m.

use phylux::{RunResult, results::FaceResult};
use serde_json::json;

use crate::world::{Mesh, Point, World, back, front};

const DOWN: Point = [0.0, 0.0, -1.0];
const LEAF: f64 = 0.01;

/// Returns the mean irradiance of a face in the first band, with its standard error.
fn irradiance(face: &FaceResult) -> [f64; 2] {
    [face.irradiance[0], face.irradiance_se[0].unwrap_or(0.0)]
}

/// Asserts that two means agree within 4 standard errors and a fraction of the second.
fn same(what: &str, [found, error]: [f64; 2], [expected, other]: [f64; 2], fraction: f64) {
    let off = (found - expected).abs() - fraction * expected;
    let error = error.hypot(other);
    assert!(expected > 0.0 && error < 0.12 * expected, "{what}: {expected} +- {error}");
    assert!(off <= 4.0 * error, "{what}: {found}, not {expected}, +- {error}");
}

/// Runs a scene by photons, by paths and by complete paths.
fn by_all(world: &World, photons: u64, paths: u64) -> [(&'static str, RunResult); 3] {
    [
        ("photons", world.run(photons, 1)),
        ("paths", world.run_paths(paths, 2)),
        ("complete paths", world.run_complete(paths, 3)),
    ]
}

fn materials(world: World) -> World {
    let mat = json!({ "type": "table", "angles_deg": [0, 40, 70], "direct": [0, 0, 0],
                      "diffuse": [0.1, 0.1, 0.1], "reflectance": [0.3, 0.3, 0.3] });
    world
        .lambert("soil", 0.3)
        .material("mat", mat)
        .material("leaf", json!({ "type": "leaf", "reflectance": 0.1, "transmittance": 0.05 }))
}

/// Returns a leaf of 1 cm, 3 mm above the middle of ground of this size, below a lamp. The edge
/// between the two triangles of the ground passes below the leaf. Both stand on a slope of this rise
/// along x.
fn leaf_on_ground(size: f64, rise: f64, material: &str, copies: bool) -> World {
    let along = 1.0 / (1.0 + rise * rise).sqrt();
    let up = [-rise * along, 0.0, along];
    let plane = |half: f64, height: f64| {
        let corner = |x: f64, y: f64| {
            let (x, y) = (half * x, half * y);
            [along * x + height * up[0], y, along * rise * x + height * up[2]]
        };
        Mesh(vec![vec![corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)]])
    };
    materials(World::new())
        .surface("ground", material, &plane(0.5 * size, 0.0))
        .counted("leaf", "leaf", &plane(0.5 * LEAF, 0.003))
        .lamp("lamp", &plane(0.02, 0.05).flipped(), 1.0)
        .edited(move |scene| {
            if copies {
                let far = [0.0, 4.0 * size, 0.0];
                scene["objects"][0]["instances"] =
                    json!([{ "translate": [0, 0, 0] }, { "translate": far }]);
                scene["objects"][0]["share"] = json!(true);
            }
        })
}

/// A leaf close above an inner edge of the ground gets the same light from ground of 2 m and of
/// 20 km, level and steep, of one or two materials, also where the ground is one of several copies
/// that share their triangles.
///
/// Seeds 1 to 3; 24 comparisons of two runs, odds of a false alarm 2e-3.
#[test]
fn the_size_of_the_ground_does_not_matter() {
    for (rise, material, copies) in
        [(0.0, "soil", false), (0.0, "mat", false), (0.75, "soil", true), (0.75, "mat", false)]
    {
        let of = |size: f64| by_all(&leaf_on_ground(size, rise, material, copies), 400_000, 60_000);
        for ((how, large), (_, small)) in of(20_000.0).iter().zip(&of(2.0)) {
            let what = format!("{rise}, {material}, {how}");
            same(&what, irradiance(front(large, "leaf")), irradiance(front(small, "leaf")), 0.0);
            same(&what, irradiance(back(large, "leaf")), irradiance(back(small, "leaf")), 0.0);
        }
    }
}

/// The sky and the sun light the back of a leaf by way of the ground, however wide this is, also where
/// their light comes in through an opening.
///
/// Seed 2; 8 comparisons of two runs, odds of a false alarm 5e-4.
#[test]
fn daylight_comes_below_a_leaf_on_wide_ground() {
    let opening = [[-0.5, -0.5, 0.5], [0.5, -0.5, 0.5], [0.5, 0.5, 0.5], [-0.5, 0.5, 0.5]];
    for (rise, through) in [(0.0, false), (0.5, false), (0.0, true), (0.5, true)] {
        let of = |size: f64| {
            let world = leaf_on_ground(size, rise, "soil", false)
                .with("sun_at", json!({ "elevation_deg": 60, "azimuth_deg": 45 }))
                .light(json!({ "type": "sun", "irradiance": 800 }))
                .light(json!({ "type": "sky", "model": "uniform", "irradiance": 100 }));
            world.edited(|scene| {
                let lights = scene["lights"].as_array_mut().unwrap();
                lights.remove(0);
                for light in lights.iter_mut().filter(|_| through) {
                    light["through"] = json!([opening]);
                }
            })
        };
        let [large, small] = [20_000.0, 20.0].map(|size| of(size).run_paths(60_000, 2));
        let what = format!("{rise}, through {through}");
        same(&what, irradiance(front(&large, "leaf")), irradiance(front(&small, "leaf")), 2e-4);
        same(&what, irradiance(back(&large, "leaf")), irradiance(back(&small, "leaf")), 2e-4);
    }
}

/// A sensor 3 mm below the inner edge of a ceiling that shines, of 2 m and of 20 km, sees nothing
/// else: it gets pi times the radiance, whether paths meet the light or are joined with it.
///
/// Seeds 2 and 3; 4 comparisons with a closed form, odds of a false alarm 3e-4.
#[test]
fn a_wide_ceiling_shines_below_its_inner_edge() {
    for size in [2.0, 20_000.0] {
        let half = 0.5 * size;
        let ceiling = Mesh::rectangle([-half, -half, 0.0], [0.0, size, 0.0], [size, 0.0, 0.0]);
        let world = World::new()
            .lambert("grey", 0.5)
            .glowing("ceiling", "grey", &ceiling, 1.0)
            .captor("sensor", &Mesh::square([0.0, 0.0, -0.003], [0.0, 0.0, 1.0], LEAF));
        for (how, result) in
            [("paths", world.run_paths(60_000, 2)), ("complete", world.run_complete(60_000, 3))]
        {
            let found = irradiance(front(&result, "sensor"));
            same(&format!("{size}, {how}"), found, [std::f64::consts::PI, 0.0], 2e-4);
        }
    }
}

/// Returns two leaves of 1 cm, 2 mm apart, below a lamp, at this place; sensors stand at the origin.
fn two_leaves(at: Point, share: bool) -> World {
    let leaf = |z: f64| {
        let half = 0.5 * LEAF;
        Mesh::rectangle([-half, -half, z], [LEAF, 0.0, 0.0], [0.0, LEAF, 0.0])
    };
    let sensor = |i: usize| {
        let mesh = Mesh::square([0.3 * i as f64 - 1.2, 0.5, 0.1], [0.0, 0.0, 1.0], 0.1);
        (format!("sensor{i}"), mesh)
    };
    World::new()
        .lambert("grey", 0.5)
        .lambert("dark", 0.1)
        .counted("low", "grey", &leaf(0.0))
        .counted("high", "dark", &leaf(0.002))
        .lamp("lamp", &Mesh::square([at[0], at[1], at[2] + 0.02], DOWN, 0.06), 10.0)
        .captors("row", (0..9).map(sensor))
        .edited(move |scene| {
            for object in scene["objects"].as_array_mut().unwrap() {
                object["instances"] = json!([{ "translate": at }, { "translate": [0, -9, 0] }]);
                object["share"] = json!(share);
            }
        })
}

/// Two leaves that nearly touch, 1 km from the captors, get the light that they get close to them,
/// to 1 %: coordinates there are rounded to 0.06 mm.
///
/// Seeds 1 to 3; 24 comparisons of two runs, odds of a false alarm 2e-3.
#[test]
fn leaves_far_from_the_captors_get_their_light() {
    for share in [false, true] {
        let of = |at: Point| by_all(&two_leaves(at, share), 400_000, 120_000);
        for ((how, far), (_, near)) in of([1000.0, 0.0, 0.0]).iter().zip(&of([0.0, 3.0, 0.0])) {
            let face = |result: &RunResult, id: &str, is_front: bool| {
                let captor = result.captors.iter().find(|c| c.id.starts_with(id)).expect("a leaf");
                let back = || captor.back.as_ref().expect("a back");
                irradiance(if is_front { &captor.front } else { back() })
            };
            for (leaf, is_front) in [("low", true), ("low", false), ("high", true), ("high", false)]
            {
                let what = format!("{leaf}, front {is_front}, shared {share}, {how}");
                let [far, near] = [far, near].map(|result| face(result, leaf, is_front));
                if near[0] > 0.0 {
                    same(&what, far, near, 0.01);
                } else {
                    assert_eq!(far[0], 0.0, "{what}");
                }
            }
        }
    }
}

/// Sensors that are so small where they stand that rounding changes them are refused, discs, which have
/// no corners, later than triangles; what is not refused is right. Closed form of a point lamp; seed 1;
/// 0.1 % beside 4 standard errors.
#[test]
fn tiny_sensors_far_away_are_right_or_refused() {
    let scene = |radius: f64, at: [f64; 2], is_disc: bool| {
        let near = json!({ "name": "near", "grid": { "x": [-0.4, 0.4], "y": [-0.1, 0.1], "nx": 3,
                           "ny": 1, "z": 0, "radius": 0.1 } });
        let (middle, normal) = ([at[0], at[1], 0.0], [-0.2, 0.4, 1.0]);
        let world = World::new()
            .light(json!({ "type": "point", "position": [at[0], at[1], 1.5], "power": 100 }))
            .edited(|scene| scene["captors"] = json!([near]));
        match is_disc {
            true => world.edited(|scene| {
                let disc = json!({ "center": middle, "normal": normal, "radius": radius });
                scene["captors"] = json!([near, { "name": "tiny", "disc": disc }]);
            }),
            false => {
                let length = 1.2f64.sqrt();
                world.captor("tiny", &Mesh::square(middle, normal.map(|x| x / length), radius))
            }
        }
    };
    let mut refusals = [0, 0];
    let sizes = [
        (3e-5, [9.0, 11.0]),
        (1e-4, [83.0, 51.0]),
        (1e-3, [83.0, 51.0]),
        (1e-2, [83.0, 51.0]),
        (1e-3, [9000.0, 8000.0]),
    ];
    for ((radius, at), is_disc) in sizes.into_iter().flat_map(|size| [(size, true), (size, false)])
    {
        let world = scene(radius, at, is_disc);
        let loaded = phylux::load(&world.write().path("scene.json"));
        if let Err(error) = loaded {
            let error = error.to_string();
            assert!(error.contains("`tiny`") && error.contains("drowns"), "{error}");
            refusals[usize::from(is_disc)] += 1;
            continue;
        }
        let exact = 100.0 / (4.0 * std::f64::consts::PI * 1.5f64.powi(2)) / 1.2f64.sqrt();
        let aimed = world.clone().with("settings", json!({ "guiding": "aim" }));
        for (how, result) in [("paths", world.run_paths(2_000, 1)), ("aimed", aimed.run(40_000, 1))]
        {
            let what = format!("{radius}, {how}, {is_disc}");
            same(&what, irradiance(front(&result, "tiny")), [exact, 0.0], 1e-3);
        }
    }
    assert_eq!(refusals, [4, 1]);
}

/// Flights are not aimed at a sensor from more than 100,000 times its radius, so its light by such a lamp
/// is missing, and it is marked; a sensor ten times as large is not. Closed form of two lamps; seed 1.
#[test]
fn sensors_too_small_for_flights_are_marked() {
    let found = |radius: f64| {
        let disc = json!({ "center": [0, 0, 0], "normal": [0, 0, 1], "radius": radius });
        let lamp = |x: f64| json!({ "type": "point", "position": [x, 0, 1], "power": 100 });
        World::new()
            .light(lamp(0.0))
            .light(lamp(0.5))
            .edited(|scene| scene["captors"] = json!([{ "name": "a", "disc": disc }]))
            .with("settings", json!({ "guiding": "aim" }))
            .run(40_000, 1)
    };
    let exact = 100.0 / (4.0 * std::f64::consts::PI) * (1.0 + 1.25f64.powf(-1.5));
    let [large, small] = [1e-4, 1e-5].map(found);
    same("large", irradiance(front(&large, "a")), [exact, 0.0], 1e-3);
    assert!(!large.captors[0].front.few_paths);
    assert!(small.captors[0].front.irradiance[0] < 0.7 * exact);
    assert!(small.captors[0].front.few_paths);
}

/// No light leaves closed meshes through their edges and corners: boxes of 3 m and of 540 m, at the
/// captors and up to 2 km away, straight and turned, of own triangles and as one of two copies that
/// share them.
///
/// Seed 1; exact.
#[test]
fn closed_meshes_far_away_are_tight() {
    let low = [-1.5, -1.0, -0.5];
    let box_at = |size: f64, at: Point, turn: [f64; 3], share: bool| {
        let low = low.map(|x| size * x);
        let sensor = |i: usize| {
            let mesh = Mesh::square([0.2 * i as f64 - 0.8, 0.0, 0.0], [0.0, 0.0, 1.0], 0.1);
            (format!("s{i}"), mesh)
        };
        World::new()
            .lambert("white", 0.98)
            .surface("box", "white", &Mesh::cuboid(low, low.map(|x| -x)).flipped())
            .light(json!({ "type": "point", "position": at, "power": 1 }))
            .captors("row", (0..9).map(sensor))
            .edited(move |scene| {
                let place = json!({ "translate": at, "rotate_deg": turn });
                let object = &mut scene["objects"][0];
                if share {
                    let beside = at.map(|x| x + 9.0 * size);
                    object["instances"] = json!([place, { "translate": beside }]);
                    object["share"] = json!(true);
                } else {
                    object["transform"] = place;
                }
            })
    };
    let (straight, turned) = ([0.0; 3], [31.0, 17.0, 53.0]);
    for (size, at, turn) in [
        (1.0, [0.0; 3], turned),
        (180.0, [0.0; 3], straight),
        (180.0, [0.0; 3], turned),
        (1.0, [400.0, -300.0, 200.0], straight),
        (1.0, [400.0, -300.0, 200.0], turned),
        (1.0, [-40.0, 2000.0, 70.0], [5.0, 80.0, 3.0]),
    ] {
        for share in [false, true] {
            let result = box_at(size, at, turn, share).run(60_000, 1);
            let escaped = result.energy.escaped[0];
            assert_eq!(escaped, 0.0, "{size} at {at:?}, turned {turn:?}, shared {share}");
        }
    }
}

/// Walls that shine themselves send nothing out through their edges, 2 km from the captors.
///
/// Seed 1; exact.
#[test]
fn light_starts_inside_the_edges_of_a_closed_lamp() {
    let low = [-1.5, -1.0, -0.5];
    let walls = Mesh::cuboid(low, low.map(|x| -x)).flipped();
    let world = World::new()
        .lambert("white", 0.5)
        .glowing("walls", "white", &walls, 1.0)
        .captor("sensor", &Mesh::square([0.0; 3], [0.0, 0.0, 1.0], 0.1))
        .edited(|scene| {
            scene["lights"][0]["transform"] =
                json!({ "translate": [-40, 2000, 70], "rotate_deg": [5, 80, 3] });
        });
    assert_eq!(world.run(400_000, 1).energy.escaped[0], 0.0);
}

/// A black leaf of 8 mm, 2 mm above wide ground, in sun and sky. Photons are sent near the leaf, and
/// most light on its back comes from the ground beside that box: complete paths find it as paths do.
///
/// Seeds 1 to 3; 4 comparisons of two runs, odds of a false alarm 3e-4.
#[test]
fn complete_paths_find_what_wide_ground_scatters() {
    let up = [0.0, 0.0, 1.0];
    for size in [3.0, 3e4] {
        let world = World::new()
            .lambert("soil", 0.4)
            .lambert("black", 0.0)
            .surface("ground", "soil", &Mesh::square([0.0; 3], up, size))
            .counted("leaf", "black", &Mesh::square([0.0, 0.0, 0.002], up, 0.008))
            .with("sun_at", json!({ "elevation_deg": 45, "azimuth_deg": 135 }))
            .light(json!({ "type": "sun", "irradiance": 600 }))
            .light(json!({ "type": "sky", "model": "overcast", "irradiance": 150 }));
        let expected = irradiance(back(&world.run_paths(100_000, 2), "leaf"));
        for seed in [1, 3] {
            let run = world.run_complete(100_000, seed);
            let found = irradiance(back(&run, "leaf"));
            same(&format!("{size} m, seed {seed}"), found, expected, 0.0);
        }
    }
}
