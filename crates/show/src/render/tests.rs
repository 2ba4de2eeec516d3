//! Pictures compared with closed forms and with paths from the camera.

use std::{path::Path, sync::atomic::AtomicBool};

use glam::Vec3;
use serde_json::{Value, json};

use super::{
    ColouredLight, FirstVisible, Fragments, Gather, Ghosts, Paths, Pixels, Sampling, Show,
    Viewpoint, gloss::Gloss, nearest_cell, painted, path_dots, photon_dots, render, sensor,
};
use crate::picture::Ground;
use phylux_core::{
    math::{
        geometry::{Frame, Ray},
        rng::Stream,
        sampling::uniform_cone,
    },
    scene::material::Material,
    transport::{
        paths,
        settings::{MapLimit, Settings, ThreadCount},
        simulate::{Control, light_surfaces},
        surface_light::SurfaceLight,
    },
};
use phylux_files::scene_file::{LoadedScene, load_value};

type Point = [f64; 3];

/// Writes quadrilaterals as OBJ text.
fn quads(quads: &[[Point; 4]]) -> String {
    let corners = quads.iter().flatten().map(|[x, y, z]| format!("v {x} {y} {z}\n"));
    let face = |i: usize| format!("f {} {} {} {}\n", 4 * i + 1, 4 * i + 2, 4 * i + 3, 4 * i + 4);
    corners.chain((0..quads.len()).map(face)).collect()
}

/// A box whose fronts face outwards, from its corners (x low, y low, z low) and (x high, y high, z
/// high).
fn cuboid([x, y, z]: Point, [u, v, w]: Point) -> [[Point; 4]; 6] {
    [
        [[x, y, z], [x, y, w], [x, v, w], [x, v, z]],
        [[u, y, z], [u, v, z], [u, v, w], [u, y, w]],
        [[x, y, z], [u, y, z], [u, y, w], [x, y, w]],
        [[x, v, z], [x, v, w], [u, v, w], [u, v, z]],
        [[x, y, z], [x, v, z], [u, v, z], [u, y, z]],
        [[x, y, w], [u, y, w], [u, v, w], [x, v, w]],
    ]
}

fn inside_out<const N: usize>(mut quads: [[Point; 4]; N]) -> [[Point; 4]; N] {
    quads.iter_mut().for_each(|quad| quad.reverse());
    quads
}

/// Loads a scene of objects (name, material, shape) with the other keys of `scene`. An object
/// without a material is only the shape of a light.
fn load(mut scene: Value, objects: &[(&str, &str, &[[Point; 4]])]) -> LoadedScene {
    let object = |(name, material, _): &(&str, &str, _)| json!({ "name": name, "obj": format!("{name}.obj"), "material": material });
    scene["objects"] =
        objects.iter().filter(|(_, material, _)| !material.is_empty()).map(object).collect();
    let read = |path: &Path| {
        let name = path.file_stem().expect("a name").to_string_lossy().into_owned();
        let (_, _, shape) = objects.iter().find(|(n, ..)| *n == name).expect("an object");
        Ok(quads(shape).into_bytes())
    };
    load_value(scene, Path::new("scene.json"), &read, None).unwrap_or_else(|e| panic!("{e}"))
}

static STOP: AtomicBool = AtomicBool::new(false);
const CONTROL: Control = Control { stop: &STOP, progress: &|_| {} };

fn lit(loaded: &LoadedScene, map_photons: usize) -> SurfaceLight<'_> {
    let settings =
        Settings { map_photons: MapLimit::nearest_to(map_photons), ..Settings::default() };
    light_surfaces(&loaded.scene, &settings, &CONTROL).unwrap_or_else(|e| panic!("{e}"))
}

fn viewpoint(loaded: &LoadedScene) -> Viewpoint<'_> {
    let view = loaded.view.expect("a camera");
    Viewpoint::new(&loaded.scene, &view).unwrap_or_else(|e| panic!("{e}"))
}

fn found(
    loaded: &LoadedScene,
    light: &SurfaceLight,
    show: Show,
    gather: u32,
    threads: usize,
) -> Fragments {
    let sampling = Sampling { rays: 4, before: 0, seed: 1, threads };
    let settings = Settings { threads: ThreadCount::nearest_to(threads), ..Settings::default() };
    let gather = (gather > 0).then(|| Gather::new(light, gather, &settings, &CONTROL));
    let gather = gather.transpose().unwrap_or_else(|e| panic!("{e}"));
    let found = render(light, gather.as_ref(), &viewpoint(loaded), show, sampling, &CONTROL);
    found.unwrap_or_else(|e| panic!("{e}"))
}

fn picture(loaded: &LoadedScene, light: &SurfaceLight, gather: u32, threads: usize) -> Pixels {
    found(loaded, light, Show::Radiance, gather, threads).pixels()
}

/// Returns means over blocks of `side` x `side` pixels.
fn blocks(pixels: &Pixels, side: usize) -> Vec<f64> {
    let height = pixels.covered.len() / pixels.width;
    let block = |(x, y): (usize, usize)| {
        let at = (0..side * side).map(|i| (y + i / side) * pixels.width + x + i % side);
        at.map(|i| f64::from(pixels.pixel(i)[0])).sum::<f64>() / (side * side) as f64
    };
    let corners = (0..height)
        .step_by(side)
        .flat_map(|y| (0..pixels.width).step_by(side).map(move |x| (x, y)));
    corners.map(block).collect()
}

/// A furnace: a room whose walls all have the same radiance. In it stand a mirror, a pane, a block
/// of glass and leaves, none of which absorbs light.
fn furnace() -> LoadedScene {
    let walls = inside_out(cuboid([-1.0; 3], [1.0; 3]));
    let upright =
        |x: f64| [[x, 0.3, -0.6], [x + 0.4, 0.4, -0.6], [x + 0.4, 0.4, 0.2], [x, 0.3, 0.2]];
    let block = cuboid([-0.2, -0.1, -0.9], [0.2, 0.2, -0.5]);
    let scene = json!({
        "materials": {
            "wall": { "type": "lambert", "reflectance": 0.5 },
            "mirror": { "type": "mirror", "reflectance": 1 },
            "pane": { "type": "transparent", "ior": 1.52, "thin": true },
            "glass": { "type": "transparent", "ior": 1.52 },
            "leaf": { "type": "leaf", "reflectance": 0.55, "transmittance": 0.45 },
        },
        "lights": [{ "type": "area", "name": "walls", "obj": "walls.obj", "radiance": 5,
                     "material": "wall" }],
        "camera": { "position": [0, -0.95, 0], "look_at": [0, 1, -0.2], "fov_deg": 80,
                    "width": 64, "height": 64 }
    });
    let objects: [(&str, &str, &[[Point; 4]]); 5] = [
        ("walls", "", &walls),
        ("mirror", "mirror", &[upright(-0.8)]),
        ("pane", "pane", &[upright(-0.2)]),
        ("leaf", "leaf", &[upright(0.4)]),
        ("glass", "glass", &block),
    ];
    load(scene, &objects)
}

/// Everything in a furnace of radiance 10 looks alike: through glass, in mirrors, on leaves and at
/// edges. Seed 1, a million arrivals, k = 200. At least half of the radiance of a pixel is
/// emission, or on leaves none of it, so its error is at most 7.1 %; none of 4096 pixels is off by
/// more than 5 such errors (odds at most 4096 x 2e-6), nor any mean of 8 x 8 pixels by more than 10
/// %, nor the mean of all by more than 1 %. With 4 directions to gather, blocks have the noise of
/// 1024 samples.
#[test]
fn a_furnace_looks_the_same_everywhere() {
    let loaded = furnace();
    for gather in [0, 4] {
        let pixels = picture(&loaded, &lit(&loaded, 1_000_000), gather, 0);
        let off = |value: f64| (value / 10.0 - 1.0).abs();
        let worst = pixels.values.iter().map(|v| off(f64::from(*v))).fold(0.0, f64::max);
        let blocks = blocks(&pixels, 8);
        let worst_block = blocks.iter().map(|v| off(*v)).fold(0.0, f64::max);
        let mean = blocks.iter().sum::<f64>() / blocks.len() as f64;
        println!("gather {gather}: mean {mean}, worst pixel {worst}, worst block {worst_block}");
        assert!(off(mean) < 0.01, "{mean}");
        assert!(worst_block < 0.1, "{worst_block}");
        assert!(gather > 0 || worst < 5.0 * 0.071, "{worst}");
    }
}

/// The gloss of a leaf loses no light: the density of its directions, over all that leave the
/// triangle, is 1 in all, also where half of the lobe would go into it. 65,536 directions give an
/// error of some 1 %; the odds that one of three is beyond 5 % are 2e-6.
#[test]
fn gloss_loses_no_light() {
    let loaded = furnace();
    let scene = &loaded.scene;
    for height in [1.0, 0.3, 0.02] {
        let towards = glam::Vec3::new(0.3, -1.0, 0.0).normalize();
        let leaf = (0..scene.triangles().len())
            .find(|&index| matches!(scene.material(&scene.surface(index)), Material::Leaf(_)));
        let leaf = leaf.expect("a leaf");
        let normal = scene.surface(leaf).normal;
        let along = (towards - towards.dot(normal) * normal).try_normalize();
        let along = along.unwrap_or_else(|| normal.any_orthonormal_vector());
        let sin = (1.0f32 - height * height).sqrt();
        let direction = sin * along - height * normal;
        let corners = scene.triangles().at(leaf);
        let middle = (corners.a + corners.b + corners.c) / 3.0;
        let ray = Ray { origin: middle - 0.01 * direction, direction };
        let at = scene.arrive(&ray).expect("the leaf");
        let gloss = Gloss::of(scene, &at).expect("gloss");
        let mut rng = Stream::new(1, 2, 3);
        const DIRECTIONS: usize = 65_536;
        let mut sum = 0.0;
        for _ in 0..DIRECTIONS {
            // uniform over the hemisphere of the facing side
            let local = uniform_cone(1.0, rng.square());
            sum += gloss.density(Frame::new(at.facing()).to_world(local));
        }
        let whole = sum * 2.0 * std::f32::consts::PI / DIRECTIONS as f32;
        assert!((whole - 1.0).abs() < 0.05, "{height}: {whole}");
        assert_eq!(gloss.density(-at.facing()), 0.0);
    }
}

/// Gathered irradiance in a furnace is π times its radiance: the mean of all pixels within 1 %, and
/// those of 8 x 8 pixels within 10 %, as above. The mirror and the leaves receive it, too.
#[test]
fn irradiance_is_that_of_a_furnace() {
    let loaded = furnace();
    let found = found(&loaded, &lit(&loaded, 1_000_000), Show::Irradiance, 4, 0);
    let blocks = blocks(&found.pixels(), 8);
    let off = |value: f64| (value / (10.0 * std::f64::consts::PI) - 1.0).abs();
    let worst = blocks.iter().map(|v| off(*v)).fold(0.0, f64::max);
    let mean = blocks.iter().sum::<f64>() / blocks.len() as f64;
    println!("mean {mean}, worst block {worst}");
    assert!(off(mean) < 0.01 && worst < 0.1, "{mean} {worst}");
}

/// A wall absorbs a fixed fraction of its irradiance, for every ray alike: all walls are lit from
/// one side only.
#[test]
fn walls_absorb_their_share() {
    let loaded = cornell();
    let light = lit(&loaded, 200_000);
    let of = |show| found(&loaded, &light, show, 1, 0).pixels().values;
    let shares: Vec<f32> =
        of(Show::Absorbed).iter().zip(of(Show::Irradiance)).map(|(a, e)| a / e).collect();
    let near = |share: f32| shares.iter().filter(|s| (**s - share).abs() < 1e-3).count();
    let [white, dark, darker] = [near(0.25), near(0.7), near(0.85)];
    println!("{white} {dark} {darker}");
    // pixels at edges show two walls
    assert!(white > 2000 && dark > 200 && darker > 200, "{white} {dark} {darker}");
    assert!(white + dark + darker > 3600, "{white} {dark} {darker}");
}

/// A box with a lamp at its ceiling and two blocks on its floor, like the Cornell box (Goral et
/// al., SIGGRAPH 1984), but with grey walls.
fn cornell() -> LoadedScene {
    let room = inside_out(cuboid([0.0; 3], [1.0; 3]));
    let left: [[Point; 4]; 1] = [room[0]];
    let right: [[Point; 4]; 1] = [room[1]];
    let tall = cuboid([0.15, 0.55, 0.0], [0.45, 0.85, 0.6]);
    let low = cuboid([0.55, 0.2, 0.0], [0.85, 0.5, 0.3]);
    let lamp =
        [[[0.35, 0.35, 0.999], [0.35, 0.65, 0.999], [0.65, 0.65, 0.999], [0.65, 0.35, 0.999]]];
    let scene = json!({
        "materials": {
            "dark": { "type": "lambert", "reflectance": 0.3 },
            "darker": { "type": "lambert", "reflectance": 0.15 },
            "white": { "type": "lambert", "reflectance": 0.75 },
        },
        "lights": [{ "type": "area", "name": "lamp", "obj": "lamp.obj", "power": 100 }],
        "camera": { "position": [0.5, 0.01, 0.5], "look_at": [0.5, 1, 0.45], "fov_deg": 90,
                    "width": 64, "height": 64 }
    });
    let objects: [(&str, &str, &[[Point; 4]]); 6] = [
        ("lamp", "", &lamp),
        ("left", "dark", &left),
        ("right", "darker", &right),
        ("room", "white", &room[2..]),
        ("tall", "white", &tall),
        ("low", "white", &low),
    ];
    load(scene, &objects)
}

/// Returns for each block of 8 x 8 pixels whether it shows no edge: the rays through all corners of
/// its pixels meet one smooth piece of surface.
fn without_edges(light: &SurfaceLight, viewpoint: &Viewpoint) -> Vec<bool> {
    let piece = |x: usize, y: usize| {
        let hit = viewpoint.opaque(&viewpoint.camera.ray(x as f32, y as f32));
        hit.map(|hit| light.patches.of(hit.triangle))
    };
    let block = |(x, y): (usize, usize)| {
        let mut pieces = (0..81).map(|i| piece(8 * x + i % 9, 8 * y + i / 9));
        let first = pieces.next();
        pieces.all(|piece| Some(piece) == first)
    };
    (0..64).map(|i| block((i % 8, i / 8))).collect()
}

/// The Cornell box from photons alone and with gathering, compared with paths from the camera
/// (32,768 for each block of 8 x 8 pixels, an error of some 0.5 %). Seeds 1. The mean relative
/// difference over blocks is at most 3 % without edges and 6 % with edges; with gathering 1 % and
/// 1.5 %, also after denoising. The difference beyond the noise of the paths is the bias of the
/// nearest photons at shadows.
#[test]
fn a_box_looks_as_paths_see_it() {
    const SIDE: usize = 8;
    const RAYS: u64 = 512;
    let loaded = cornell();
    let light = lit(&loaded, 1_000_000);
    let viewpoint = viewpoint(&loaded);
    let by_paths = |pixel: usize| {
        let (x, y) = ((pixel % 64) as f32, (pixel / 64) as f32);
        let radiance = |ray: u64| {
            let mut rng = Stream::new(2, pixel as u64, ray);
            let within = rng.square();
            let ray = viewpoint.camera.ray(x + within.x, y + within.y);
            f64::from(paths::radiance::<[f32; 1]>(&loaded.scene, ray, &mut rng).0[0])
        };
        ((0..RAYS).map(radiance).sum::<f64>() / RAYS as f64) as f32
    };
    let values: Vec<f32> = (0..64 * 64).map(by_paths).collect();
    let covered = vec![1.0; values.len()];
    let reference = Pixels { width: 64, bands: 1, covered, values };
    let reference = blocks(&reference, SIDE);
    let plain = without_edges(&light, &viewpoint);
    assert!(plain.iter().filter(|plain| **plain).count() >= 15);
    for (gather, denoised, limit, at_edges) in
        [(0, false, 0.03, 0.06), (8, false, 0.01, 0.015), (8, true, 0.01, 0.015)]
    {
        let found = found(&loaded, &light, Show::Radiance, gather, 0);
        let pixels = match denoised {
            true => found.denoised(&[0], 0).unwrap_or_else(|e| panic!("{e}")).pixels(),
            false => found.pixels(),
        };
        let found = blocks(&pixels, SIDE);
        let mean = |edges: bool| {
            let of = plain
                .iter()
                .zip(found.iter().zip(&reference))
                .filter(|(plain, _)| **plain != edges);
            let off: Vec<f64> = of.map(|(_, (a, b))| (a / b - 1.0).abs()).collect();
            (off.iter().sum::<f64>() / off.len() as f64, off.iter().copied().fold(0.0, f64::max))
        };
        let (plain, edges) = (mean(false), mean(true));
        println!(
            "gather {gather}, denoised {denoised}: {plain:?} without edges, {edges:?} with (mean, worst)"
        );
        assert!(plain.0 < limit, "gather {gather}: {plain:?}");
        assert!(edges.0 < at_edges, "gather {gather}: {edges:?}");
    }
}

/// Where light is even and all photons have one power, the relative error of k photons is 1 /
/// sqrt(k - 1) everywhere: the k-th photon only sets the radius. Joined rounds of rays are the mean
/// over all of the rays.
#[test]
fn errors_are_those_of_k_photons_and_rounds_join() {
    let loaded = furnace();
    let light = lit(&loaded, 200_000);
    let rendered = |show, rays, before| {
        let sampling = Sampling { rays, before, seed: 1, threads: 0 };
        render(&light, None, &viewpoint(&loaded), show, sampling, &CONTROL)
            .unwrap_or_else(|e| panic!("{e}"))
    };
    let error = rendered(Show::Error { bands: &[0] }, 1, 0);
    let error = error.errors(0, false).unwrap_or_else(|e| panic!("{e}"));
    assert_eq!((error.bands, error.values.len()), (1, 64 * 64));
    let exact = 1.0 / 199f32.sqrt();
    let exactly = error.values.iter().filter(|error| (**error / exact - 1.0).abs() < 1e-3).count();
    // leaves have fewer than k photons on a face, and photons from glass have other powers
    assert!(exactly > 2000, "{exactly} of 4096");
    assert!(error.values.iter().all(|error| (0.06..0.4).contains(error)), "{:?}", error.values);

    let show = Show::Irradiance;
    let (first, second) = (rendered(show, 1, 0), rendered(show, 3, 1));
    let joined = first.joined(&second).pixels();
    let (first, second) = (first.pixels(), second.pixels());
    for (i, joined) in joined.values.iter().enumerate() {
        let mean = 0.25 * first.values[i] + 0.75 * second.values[i];
        assert!((joined / mean - 1.0).abs() < 1e-5, "{i}: {joined} {mean}");
    }
    assert_ne!(first.values, second.values);
}

/// Any number of threads gives the same picture.
#[test]
fn a_picture_does_not_depend_on_threads() {
    let loaded = furnace();
    let light = lit(&loaded, 20_000);
    for gather in [0, 1] {
        assert_eq!(picture(&loaded, &light, gather, 1), picture(&loaded, &light, gather, 3));
    }
}

/// A view that is chosen for a closed room looks into it, and shows all that is in it.
#[test]
fn a_closed_room_is_seen_from_inside() {
    let walls = inside_out(cuboid([0.0; 3], [2.0, 2.0, 1.0]));
    let thing = cuboid([0.9, 0.9, 0.0], [1.1, 1.1, 0.2]);
    let scene = json!({
        "materials": { "a": { "type": "lambert", "reflectance": 0.5 } },
        "lights": [{ "type": "point", "name": "lamp", "position": [1, 1, 0.9], "power": 1 }],
    });
    // whichever way the walls face
    for walls in [walls, inside_out(walls)] {
        let loaded = load(scene.clone(), &[("walls", "a", &walls), ("thing", "a", &thing)]);
        let view =
            Viewpoint::choose_view(&loaded.scene, (40, 30), 45.0).unwrap_or_else(|e| panic!("{e}"));
        let viewpoint =
            Viewpoint::new(&loaded.scene, &view).unwrap_or_else(|e| panic!("{e}")).cut_open();
        let middle = |corner: Point| glam::DVec3::from(corner) - loaded.scene.center();
        assert!(viewpoint.in_front_of(middle([1.0, 1.0, 0.21]).as_vec3(), 9) == 0);
        assert!(viewpoint.in_front_of(middle([1.9, 1.9, 0.1]).as_vec3(), 9) == 0);
        // the far walls are not cut away
        let beyond = middle([2.5, 2.5, 0.5]).as_vec3();
        assert!(viewpoint.in_front_of(beyond, 9) > 0);
        let sampling = Sampling { rays: 1, before: 0, seed: 1, threads: 1 };
        let seen =
            painted(&viewpoint, sampling, &CONTROL, |ray| match viewpoint.first_visible(ray) {
                FirstVisible::Nothing => glam::Vec3::ZERO,
                FirstVisible::Thing { .. } => glam::Vec3::ONE,
            });
        let seen = seen.unwrap_or_else(|e| panic!("{e}")).iter().filter(|c| c.x > 0.0).count();
        assert!((200..900).contains(&seen), "{seen} of 1200 pixels");
    }
}

/// Where captors are a small part of a scene, the chosen view is of them and what is around them:
/// the ground beyond is cut off.
#[test]
fn a_view_of_a_wide_scene_is_of_its_captors() {
    let ground = [[[-50.0, -50.0, 0.0], [50.0, -50.0, 0.0], [50.0, 50.0, 0.0], [-50.0, 50.0, 0.0]]];
    let scene = |captors: serde_json::Value| {
        json!({
            "materials": { "a": { "type": "lambert", "reflectance": 0.5 } },
            "lights": [{ "type": "point", "name": "lamp", "position": [0, 0, 9], "power": 1 }],
            "captors": captors,
        })
    };
    let distance = |captors: serde_json::Value| {
        let loaded = load(scene(captors), &[("ground", "a", &ground)]);
        let view = Viewpoint::choose_view(&loaded.scene, (40, 30), 45.0);
        let view = view.unwrap_or_else(|e| panic!("{e}"));
        (view.look_at - view.position).length()
    };
    let sensor = |x: f64| json!({ "name": format!("at {x}"), "disc": { "center": [x, 20, 1], "normal": [0, 0, 1], "radius": 0.1 } });
    let (none, near) = (distance(json!([])), distance(json!([sensor(20.0), sensor(21.0)])));
    let wide = distance(json!([sensor(-40.0), sensor(40.0)]));
    assert!(near < 0.4 * none && wide == none, "{near} {wide} {none}");
}

/// A scene that repeats and has no camera is seen along its rows: from above; under a roof from below
/// it, between the crop and the roof; and panels above what is measured from between them, below a
/// sky.
#[test]
fn a_field_is_seen_along_its_rows() {
    let lying = |[x, y]: [f64; 2], z: f64| [[[0.0, 0.0, z], [x, 0.0, z], [x, y, z], [0.0, y, z]]];
    let measured = |[x, y]: [f64; 2], z: f64| {
        json!({
            "periodic": { "x": [0, x], "y": [0, y] },
            "materials": { "a": { "type": "lambert", "reflectance": 0.5 } },
            "lights": [{ "type": "sky", "model": "uniform", "irradiance": 300 }],
            "captors": [{ "name": "a", "disc": { "center": [2, 1, z], "normal": [0, 0, 1], "radius": 0.1 } }],
        })
    };
    let scene = |size: [f64; 2]| measured(size, 0.3);
    let chosen = |loaded: &LoadedScene| {
        let view = Viewpoint::choose_view(&loaded.scene, (40, 30), 45.0);
        view.unwrap_or_else(|e| panic!("{e}"))
    };
    let panel = [[[1.0, 0.0, 2.0], [3.0, 0.0, 3.0], [3.0, 2.0, 3.0], [1.0, 2.0, 2.0]]];
    let ground = lying([6.0, 2.0], 0.0);
    let field = [("ground", "a", &ground[..]), ("panel", "a", &panel)];
    // what is measured stands on benches
    let above = chosen(&load(measured([6.0, 2.0], 3.2), &field)).position;
    assert!(above.z > 4.0, "{above}");
    let loaded = load(scene([6.0, 2.0]), &field);
    let view = chosen(&loaded);
    let eye = view.position;
    assert!((0.9..1.9).contains(&eye.z) && (4.0..6.0).contains(&eye.x), "{eye}");
    let viewpoint = Viewpoint::new(&loaded.scene, &view).unwrap_or_else(|e| panic!("{e}"));
    let viewpoint = viewpoint.cut_open();
    let (mut sky, mut tilted, mut level) = (0, 0, 0);
    for (x, y) in (0..30).flat_map(|y| (0..40).map(move |x| (x, y))) {
        let ray = viewpoint.camera.ray(x as f32 + 0.5, y as f32 + 0.5);
        match viewpoint.opaque(&ray) {
            None => sky += 1,
            Some(hit) if loaded.scene.surface(hit.triangle).normal.z > 0.99 => level += 1,
            Some(_) => tilted += 1,
        }
    }
    assert!((30..500).contains(&sky), "{sky} of 1200");
    assert!(tilted > 80 && level > 250, "{tilted} {level} of 1200");

    let roofed = [("ground", lying([1.6, 1.2], 0.0)), ("roof", lying([1.6, 1.2], 4.0))];
    let crop = [[[0.4, 0.2, 1.5], [0.8, 0.2, 1.5], [0.8, 0.9, 1.5], [0.4, 0.9, 1.5]]];
    let [(_, ground), (_, roof)] = &roofed;
    let objects = [("ground", "a", &ground[..]), ("crop", "a", &crop), ("roof", "a", &roof[..])];
    let view = chosen(&load(scene([1.6, 1.2]), &objects));
    assert!((1.9..3.6).contains(&view.position.z), "{}", view.position);
    // along the rows, which follow the shorter period
    let ahead = view.look_at - view.position;
    assert!(ahead.y > ahead.x && ahead.x > 0.0 && ahead.z < 0.0, "{ahead}");
}

/// Of the sensors of a scene that repeats those of one cell are told apart, the one that is seen most.
#[test]
fn sensors_know_their_cell() {
    let ground = [[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]]];
    let scene = json!({
        "periodic": { "x": [0, 1], "y": [0, 1] },
        "materials": { "a": { "type": "lambert", "reflectance": 0.5 } },
        "lights": [{ "type": "sky", "model": "uniform", "irradiance": 300 }],
        "captors": [{ "name": "a", "disc": { "center": [0.5, 0.5, 0.1], "normal": [0, 0, 1], "radius": 0.3 } }],
        "camera": { "position": [3.5, -0.6, 1.2], "look_at": [3.5, 0.7, 0], "width": 80, "height": 60 },
    });
    let loaded = load(scene, &[("ground", "a", &ground)]);
    let viewpoint = viewpoint(&loaded);
    assert_eq!(nearest_cell(&viewpoint), [3, 0]);
    for (point, cell) in [
        ([3.5, 0.5, 0.1], Some([3, 0])),
        ([3.5, 1.0, 0.1], None),
        ([3.5, 1.5, 0.1], Some([3, 1])),
        ([4.4, 1.5, 0.1], Some([4, 1])),
    ] {
        let from_centre = (glam::DVec3::from(point) - loaded.scene.center()).as_vec3();
        let [x, y] = viewpoint.camera.project(from_centre).expect("in front of the camera");
        let met = sensor(&viewpoint, &viewpoint.camera.ray(x, y)).map(|(_, cell)| cell);
        assert_eq!(met, cell, "{point:?}");
    }
}

/// Of a closed rack with two floors, seen from above, the roof is cut away, and no floor.
#[test]
fn the_floors_of_a_rack_stay() {
    let walls = inside_out(cuboid([0.0; 3], [1.2, 0.6, 2.0]));
    let lying = |z: f64| [[[0.0, 0.0, z], [1.2, 0.0, z], [1.2, 0.6, z], [0.0, 0.6, z]]];
    let scene = json!({
        "materials": { "a": { "type": "lambert", "reflectance": 0.5 } },
        "lights": [{ "type": "point", "name": "lamp", "position": [0.6, 0.3, 1.9], "power": 1 }],
    });
    let (low, high) = (lying(0.4), lying(1.3));
    let loaded = load(scene, &[("walls", "a", &walls), ("low", "a", &low), ("high", "a", &high)]);
    let view =
        Viewpoint::choose_view(&loaded.scene, (40, 30), 45.0).unwrap_or_else(|e| panic!("{e}"));
    let viewpoint = Viewpoint::new(&loaded.scene, &view).unwrap_or_else(|e| panic!("{e}"));
    let viewpoint = viewpoint.cut_open();
    let above = |z: f64| (glam::DVec3::new(0.6, 0.3, z) - loaded.scene.center()).as_vec3();
    // the upper floor hides the middle of the lower one, and nothing hides the upper one
    assert!(viewpoint.in_front_of(above(1.31), 9) + viewpoint.in_front_of(above(1.9), 9) == 0);
    let down = phylux_core::math::geometry::Ray { origin: above(2.5), direction: -glam::Vec3::Z };
    let first = viewpoint.opaque(&down).expect("a floor");
    assert!((first.t - 1.2).abs() < 0.01, "the upper floor is {} m below", first.t);
}

/// Returns what the pixels of the middle row of a picture show of one thing under a lamp far away,
/// from the left to the right, over the largest of them.
fn middle_row(shape: &[[Point; 4]], placed: Value) -> Vec<f32> {
    let mut scene = json!({
        "materials": { "a": { "type": "lambert", "reflectance": 0.5 } },
        "lights": [{ "type": "point", "name": "lamp", "position": [-600, -500, 300], "power": 1e9 }],
        "camera": { "position": [0, -6, 0.5], "look_at": [0, 0, 0.5], "fov_deg": 22,
                    "width": 120, "height": 40 }
    });
    let object = json!({ "name": "thing", "obj": "thing.obj", "material": "a" });
    scene["objects"] = json!([object]);
    placed.as_object().expect("keys").iter().for_each(|(key, value)| {
        scene["objects"][0][key] = value.clone();
    });
    let mirrored = "m00,m01,m02,m03,m10,m11,m12,m13,m20,m21,m22,m23\n\
                    1,0,0,50,0,1,0,0,0,0,1,0\n-1,0,0,0,0,1,0,0,0,0,1,0\n";
    let read = |path: &Path| match path.extension().is_some_and(|ext| ext == "csv") {
        true => Ok(mirrored.into()),
        false => Ok(quads(shape).into_bytes()),
    };
    let loaded = load_value(scene, Path::new("scene.json"), &read, None);
    let loaded = loaded.unwrap_or_else(|e| panic!("{e}"));
    let pixels = picture(&loaded, &lit(&loaded, 10_000), 1, 0);
    let row: Vec<f32> = (0..120).map(|x| pixels.pixel(20 * 120 + x)[0]).collect();
    let largest = row.iter().copied().fold(0.0, f32::max);
    row.iter().map(|value| value / largest).collect()
}

/// The lit sides of a tube of twelve look as those of a true one under direct light, to a tenth of
/// the brightest place and without greater steps; those that turn away from the lamp get no light.
/// So do copies that share their triangles, mirrored ones too. A block keeps its edge.
#[test]
fn tubes_are_round_and_blocks_have_edges() {
    let at = |i: usize, z: f64| {
        let (sin, cos) = (std::f64::consts::TAU * i as f64 / 12.0).sin_cos();
        [cos, sin, z]
    };
    // the last side ends where the first begins
    let side = |i: usize| [at(i, 0.0), at((i + 1) % 12, 0.0), at((i + 1) % 12, 1.0), at(i, 1.0)];
    let tube: Vec<[Point; 4]> = (0..12).map(side).collect();
    // what a pixel shows of a true tube: where its ray meets it, and the cosine to the lamp there
    let lamp = glam::Vec2::new(-6.0, -5.0).normalize();
    let truth = |x: usize| {
        let across = 11f32.to_radians().tan() * (x as f32 + 0.5 - 60.0) / 60.0;
        let (eye, ray) = (glam::Vec2::new(0.0, -6.0), glam::Vec2::new(across, 1.0).normalize());
        let along = -eye.dot(ray);
        let inside = 1.0 - (eye + along * ray).length_squared();
        (inside > 0.1).then(|| (eye + (along - inside.sqrt()) * ray).dot(lamp).max(0.0))
    };
    let far = json!({ "translate": [50, 0, 0] });
    for placed in [
        json!({}),
        json!({ "share": true, "instances": [far, {}] }),
        json!({ "share": true, "instances": { "csv": "mirrored.csv" } }),
    ] {
        let row = middle_row(&tube, placed.clone());
        let mut worst = [0.0f32; 3];
        for x in 1..120 {
            let Some((before, here)) = truth(x - 1).zip(truth(x)) else { continue };
            // a side that turns away from the lamp, a little sooner than the true tube does
            let [was_dark, is_dark] = [row[x - 1], row[x]].map(|value| value < 0.02);
            let shadow = if here == 0.0 { row[x] } else { 0.0 };
            assert!(!is_dark || here < 0.2, "{placed}: {} at {x} in place of {here}", row[x]);
            if was_dark || is_dark {
                worst[2] = shadow.max(worst[2]);
                continue;
            }
            let step = (row[x] - row[x - 1]) - (here - before);
            for (worst, off) in worst.iter_mut().zip([row[x] - here, step, shadow]) {
                *worst = worst.max(off.abs());
            }
        }
        println!("{placed}: {worst:.3?}");
        assert!(worst[0] < 0.1 && worst[1] < 0.1 && worst[2] < 1e-3, "{placed}: {worst:?}");
    }
    let turned = json!({ "transform": { "rotate_deg": [0, 0, 45] } });
    let block = middle_row(&cuboid([-0.5, -0.5, 0.0], [0.5, 0.5, 1.0]), turned);
    // the right side is in the shade, and each side is even
    assert!(block[35..58].iter().all(|value| *value > 0.98), "{block:?}");
    assert!(block[62..85].iter().all(|value| *value < 0.2), "{block:?}");
}

/// Returns a room with grey walls that a camera in it sees, with a sheet across its middle.
fn grey_room(sheet: bool) -> LoadedScene {
    let walls = inside_out(cuboid([-1.0; 3], [1.0; 3]));
    let across = [[[-1.0, 0.0, -1.0], [1.0, 0.0, -1.0], [1.0, 0.0, 0.5], [-1.0, 0.0, 0.5]]];
    let scene = json!({
        "materials": { "wall": { "type": "lambert", "reflectance": 0.5 } },
        "lights": [{ "type": "point", "position": [0, 0.4, 0.9], "power": 1 }],
        "camera": {
            "position": [0, -0.9, 0], "look_at": [0, 1, 0], "fov_deg": 80, "width": 80, "height": 60
        },
    });
    let objects: [(&str, &str, &[_]); 2] = [("walls", "wall", &walls), ("across", "wall", &across)];
    load(scene, if sheet { &objects } else { &objects[..1] })
}

fn some_paths(loaded: &LoadedScene) -> Paths {
    let viewpoint = viewpoint(loaded);
    path_dots(&loaded.scene, &viewpoint, 50, &[0], 1, &CONTROL).unwrap_or_else(|e| panic!("{e}"))
}

/// A path fades with its power: it leaves its lamp with all, and each wall of reflectance 0.5 takes
/// half of what is left, until it ends. All along a leg its dots are alike, and none is farther
/// than about a pixel from the one before it.
#[test]
fn paths_bend_at_surfaces_and_fade() {
    let paths = some_paths(&grey_room(false));
    let mut met = [0; 6];
    for of_leg in paths.dots.chunk_by(|(a, _), (b, _)| a.index == b.index) {
        let leg = &paths.legs[of_leg[0].0.index];
        let bounces = usize::from(leg.way.bounces);
        let exact = 0.5f32.powi(bounces as i32);
        for (dot, strength) in of_leg {
            assert!((strength - exact).abs() < 1e-5, "{bounces}: {strength}");
            assert_eq!(dot.clear, 1.0, "nothing stands in the room");
        }
        for pair in of_leg.windows(2) {
            let [a, b] = [pair[0].0.at, pair[1].0.at];
            assert!((a[0] - b[0]).hypot(a[1] - b[1]) < 1.5, "{a:?} {b:?}");
        }
        met[bounces.min(5)] += 1;
    }
    // every photon goes on until little is left, so there are as many legs of each kind
    assert!(met.iter().all(|met| *met >= 20), "{met:?}");
}

/// What leaves the scene fades to nothing along its way.
#[test]
fn a_path_that_leaves_fades_to_nothing() {
    let floor = [[[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [1.0, 1.0, 0.0], [-1.0, 1.0, 0.0]]];
    let scene = json!({
        "materials": { "floor": { "type": "lambert", "reflectance": 0.8 } },
        "lights": [{ "type": "spot", "position": [0, 0, 1], "direction": [0, 0, -1], "half_angle_deg": 20, "power": 1 }],
        "camera": { "position": [0, -5, 1], "look_at": [0, 0, 0.3], "width": 200, "height": 150 },
    });
    let paths = some_paths(&load(scene, &[("floor", "floor", &floor)]));
    let scattered = |index: usize| paths.legs[index].way.bounces == 1;
    let legs = paths.dots.chunk_by(|(a, _), (b, _)| a.index == b.index);
    let legs: Vec<_> = legs.filter(|dots| scattered(dots[0].0.index) && dots.len() > 9).collect();
    assert!(legs.len() > 25, "{}", legs.len());
    for dots in legs {
        let strengths: Vec<f32> = dots.iter().map(|(_, strength)| *strength).collect();
        assert!(strengths.is_sorted_by(|a, b| a > b), "{strengths:?}");
        assert!(strengths[0] > 0.7 && strengths[strengths.len() - 1] < 0.1, "{strengths:?}");
    }
}

/// Photons are dimmer behind a sheet and on the sides that face away, and all of them are there; so
/// are the same on any number of threads. Surfaces behind them are dim on a dark ground, and pale
/// on a light one.
#[test]
fn photons_shine_through_surfaces() {
    let loaded = grey_room(true);
    let light = lit(&loaded, 20_000);
    let viewpoint = viewpoint(&loaded);
    let dots = |threads| {
        photon_dots(&light, &viewpoint, threads, &CONTROL).unwrap_or_else(|e| panic!("{e}"))
    };
    let positions = light.map.positions();
    let (all, centre) = (dots(1), loaded.scene.center().as_vec3());
    assert_eq!(all, dots(3));
    let mut counts = [0; 2];
    for dot in &all {
        let point = positions[dot.index] + centre;
        // the sheet hides the far half of the room from the eye, but for what is above its edge
        let sight = 0.9 / (point.y + 0.9) * point.z;
        let is_hidden = point.y > 1e-3 && sight < 0.499;
        let is_open = point.y < -1e-3 || (point.y > 1e-3 && sight > 0.501);
        let expected = if is_hidden { 0.12 } else { 1.0 };
        if is_hidden || is_open {
            assert_eq!(dot.clear, expected, "{point}");
            counts[usize::from(is_hidden)] += 1;
        }
    }
    assert!(counts.iter().all(|count| *count > 500), "{counts:?}");

    for (ground, range) in [(Ground::Dark, 0.001..0.08), (Ground::Light, 0.5..0.95)] {
        let ghosts = Ghosts::new(&viewpoint, ground);
        let ray = viewpoint.camera.ray(40.0, 30.0);
        let seen = ghosts.colour(&viewpoint, &ray);
        assert!(seen.to_array().iter().all(|c| range.contains(c)), "{ground:?}: {seen}");
    }
}

/// The light that photons make together is the irradiance that they give, in their colours: smooth
/// where they are crowded, and through a sheet, whose two sides and what is behind it add up.
#[test]
fn photons_together_are_irradiance_in_their_colours() {
    for sheet in [false, true] {
        let loaded = grey_room(sheet);
        let (light, viewpoint) = (lit(&loaded, 200_000), viewpoint(&loaded));
        let straight = |index: usize| light.map.ways()[index].bounces == 0;
        let shine = |index: usize| {
            let colour = if straight(index) { Vec3::X } else { Vec3::Z };
            light.map.power(index)[0] * colour
        };
        let shines: Vec<Vec3> = (0..light.map.photons.len()).map(shine).collect();
        let coloured = |threads| {
            ColouredLight::new(&light, &shines, threads).unwrap_or_else(|e| panic!("{e}"))
        };
        let (one, three) = (coloured(1), coloured(3));
        let (mut count, mut found, mut exact, mut squares) = (0, 0.0, 0.0, 0.0);
        let mut red = 0.0;
        for pixel in (0..80 * 60).step_by(7) {
            let [x, y] = [pixel % 80, pixel / 80].map(|at| at as f32 + 0.5);
            let ray = viewpoint.camera.ray(x, y);
            let along = one.along(&viewpoint, &ray);
            assert_eq!(along, three.along(&viewpoint, &ray));
            assert_eq!(along.y, 0.0);
            let (mut expected, mut through) = (0.0, 1.0);
            viewpoint.each_surface(&ray, |hit, _| {
                let front = ray.direction.dot(loaded.scene.surface(hit.triangle).normal) < 0.0;
                let arrived = |face| light.irradiance(hit.triangle, face, hit.point)[0];
                expected += through * (arrived(front) + 0.12 * arrived(!front));
                through *= 0.12;
                true
            });
            let sum = f64::from(along.element_sum());
            count += 1;
            (found, exact) = (found + sum, exact + expected);
            squares += (sum / expected - 1.0).powi(2);
            red += f64::from(along.x);
        }
        assert!((found / exact - 1.0).abs() < 0.01, "{sheet}: {found} {exact}");
        let rms = (squares / f64::from(count)).sqrt();
        assert!(rms < 0.07, "{sheet}: {rms}");
        // half of what arrives in a closed grey room comes straight from its lamp
        if !sheet {
            assert!((red / found - 0.5).abs() < 0.1, "{}", red / found);
        }
    }
}
