//! `phylux render`: the files that it writes, and the messages for what cannot be drawn.

use std::{fs, path::Path};

use assert_cmd::Command;
use serde_json::json;

use crate::{
    common::{TestScene, binary},
    world::{Mesh, World, room},
};

fn phylux(scene: &TestScene, arguments: &[&str]) -> Command {
    let mut command = Command::new(binary());
    command.arg("render").arg(scene.path("scene.json"));
    command.current_dir(scene.path(".")).args(arguments);
    command
}

/// Returns a grey room with a captor, two bands and a sum.
fn small_room() -> World {
    let sensor = Mesh::square([0.0, 0.0, -0.5], [0.0, 0.0, 1.0], 0.6);
    World::new()
        .bands(2)
        .with("sums", json!({ "both": ["b0", "b1"] }))
        .with("settings", json!({ "photons": 20_000 }))
        .with("camera", json!({ "position": [0, -0.9, 0], "look_at": [0, 1, -0.2], "fov_deg": 90 }))
        .lambert("wall", 0.5)
        .surface("walls", "wall", &room([-1.0; 3], [1.0; 3]))
        .light(json!({ "type": "point", "position": [0, 0, 0.9], "power": [2, 1] }))
        .captor("sensor", &sensor)
}

const SMALL: [&str; 6] = ["--width", "40", "--height", "30", "--map-photons", "20000"];

/// Returns the width, the height and the RGB pixels of a PNG file.
fn read_png(path: &Path) -> (usize, usize, Vec<u8>) {
    let file = std::io::BufReader::new(fs::File::open(path).expect("a picture"));
    let mut reader = png::Decoder::new(file).read_info().expect("a PNG");
    let mut pixels = vec![0; reader.output_buffer_size().expect("a small picture")];
    let info = reader.next_frame(&mut pixels).expect("pixels");
    assert_eq!((info.color_type, info.bit_depth), (png::ColorType::Rgb, png::BitDepth::Eight));
    (info.width as usize, info.height as usize, pixels)
}

/// Every kind of picture is drawn, with the same bytes on 1 and 3 threads. Pictures in false
/// colours have a colour bar, those of photons by kind a key.
#[test]
fn every_kind_is_drawn() {
    let scene = small_room().write();
    for (show, more, bar) in [
        ("radiance", vec![], false),
        ("radiance", vec!["--gather", "0"], false),
        ("radiance", vec!["--gather", "8", "--exposure", "1.5", "--band", "b1"], false),
        ("irradiance", vec!["--log", "--band", "both"], true),
        ("absorbed", vec!["--range", "0:2", "--rays", "1"], true),
        ("error", vec!["--band", "both", "--k", "50"], true),
        ("captors", vec![], true),
        ("photons", vec!["--paths", "5"], true),
        ("photons", vec!["--colour", "power"], true),
        ("photons", vec!["--colour", "band", "--ground", "light"], false),
        ("photons", vec!["--colour", "lamp"], true),
        ("photons", vec!["--colour", "surface", "--ground", "light", "--paths", "3"], true),
    ] {
        let mut bytes = Vec::new();
        for threads in ["1", "3"] {
            let name = format!("{threads}.png");
            let arguments = ["-o", &name, "--show", show, "--threads", threads];
            phylux(&scene, &arguments).args(SMALL).args(&more).assert().success();
            bytes.push(fs::read(scene.path(&name)).expect("a picture"));
        }
        assert!(bytes[0] == bytes[1], "{show} {more:?}");
        let (width, height, pixels) = read_png(&scene.path("1.png"));
        if bar {
            assert!(width > 100 && height > 60, "{show}: {width} x {height}");
        } else {
            assert_eq!((width, height), (40, 30));
        }
        // there is light everywhere: the room has no black corner
        if show == "radiance" {
            assert!(pixels.iter().all(|p| *p > 20), "{more:?}");
        }
    }
}

/// EXR files hold the numbers: in a furnace, the mean over the picture is the value of the furnace,
/// within 5 %.
///
/// Seed 1, 200,000 arrivals, whose noise is about 1 %.
#[test]
fn numbers_are_in_exr() {
    use exr::prelude::*;
    let walls = room([-1.0; 3], [1.0; 3]);
    let scene = World::new()
        .lambert("wall", 0.5)
        .glowing("walls", "wall", &walls, 0.5)
        .with("camera", json!({ "position": [0, 0, 0], "look_at": [0, 1, 0] }))
        .write();
    let exact = [
        ("irradiance", std::f32::consts::PI),
        ("absorbed", std::f32::consts::FRAC_PI_2),
        ("radiance", 1.0),
    ];
    for (show, exact) in exact {
        let arguments = ["--show", show, "-o", "a.exr", "-o", "a.png"];
        let many = ["--width", "40", "--height", "30", "--map-photons", "200000"];
        phylux(&scene, &arguments).args(many).assert().success();
        let image = read_all_flat_layers_from_file(scene.path("a.exr")).expect("an EXR file");
        let channels = &image.layer_data[0].channel_data.list;
        let name = format!("{show}.all");
        let channel = channels.iter().find(|channel| channel.name == *name.as_str());
        let values: Vec<f32> =
            channel.expect("a channel per band").sample_data.values_as_f32().collect();
        assert_eq!(values.len(), 1200);
        let mean = values.iter().sum::<f32>() / 1200.0;
        assert!((mean / exact - 1.0).abs() < 0.05, "{show}: {mean}");
        let more = if show == "radiance" { vec!["B", "G", "R"] } else { vec!["A"] };
        for name in more {
            assert!(channels.iter().any(|channel| channel.name == *name), "{show}: {name}");
        }
    }
}

/// Captors that are coloured from a results file look the same as those of the run that wrote it.
#[test]
fn results_are_drawn_without_tracing() {
    let scene = small_room().write();
    let mut run = Command::new(binary());
    run.args(["run", "scene.json"]).current_dir(scene.path(".")).assert().success();
    phylux(&scene, &["--show", "captors", "-o", "a.png"]).args(SMALL).assert().success();
    let from_file = ["--show", "captors", "--results", "results.json", "-o", "b.png"];
    phylux(&scene, &from_file).args(SMALL).assert().success();
    let [a, b] = ["a.png", "b.png"].map(|name| fs::read(scene.path(name)).expect("a picture"));
    assert!(a == b);
    assert_eq!(read_png(&scene.path("a.png")).1, 200);
}

/// A picture with too little time ends after four rays for each pixel and says so; one with enough
/// time takes all rays.
#[test]
fn a_picture_ends_in_time() {
    let scene = small_room().write();
    for (seconds, rays) in [("1e-9", "4 rays a pixel"), ("1e9", "10 rays a pixel")] {
        for show in ["radiance", "irradiance", "error"] {
            let arguments = ["-o", "a.png", "--show", show, "--spp", "10", "--max-time", seconds];
            let assert = phylux(&scene, &arguments).args(SMALL).assert().success();
            let said = String::from_utf8_lossy(&assert.get_output().stdout).into_owned();
            assert!(said.contains(rays), "{show} {seconds}: {said}");
        }
    }
}

/// What cannot be drawn ends with exit code 2, a message and no file.
#[test]
fn refusals_are_sentences() {
    let scene = small_room().write();
    fs::write(scene.path("none.json"), "{}").expect("a file");
    let cases: [(&[&str], &[&str]); 26] = [
        (
            &["--band", "b2"],
            &["--band: the scene has no band or sum `b2`; there are b0, b1, both, sum"],
        ),
        (&["--width", "0"], &["--width", "a whole number from 1 to 65536"]),
        (&["--width", "65536", "--height", "65536"], &["GiB; ask for a smaller one"]),
        (
            &["--show", "captors", "--width", "65536", "--height", "65536"],
            &["GiB; ask for a smaller one"],
        ),
        (&["-o", "b.jpg"], &["b.jpg: is neither .png nor .exr"]),
        (&["-o", "a.png"], &["is named for two outputs"]),
        (
            &["--show", "photons", "-o", "b.exr"],
            &["b.exr: EXR holds the light on surfaces", "write .png"],
        ),
        (&["--show", "irradiance", "--range", "5:1"], &["range: 5 to 1 is no range"]),
        (&["--show", "irradiance", "--range", "0:1", "--log"], &["range: 0 has no logarithm"]),
        (&["--range", "1"], &["must be two numbers with a colon"]),
        (&["--range", "0:1"], &["--range: has no meaning here", "--exposure"]),
        (&["--show", "captors", "--gather", "4"], &["--gather: has no meaning here"]),
        (&["--results", "none.json"], &["--results: has no meaning here"]),
        (&["--max-time", "0"], &["--max-time", "must be above 0"]),
        (&["--show", "captors", "--max-time", "1"], &["--max-time: has no meaning here", "error"]),
        (&["--show", "photons", "--denoise", "on"], &["--denoise: has no meaning here"]),
        (&["--ground", "light"], &["--ground: has no meaning here", "photons"]),
        (&["--show", "absorbed", "--white-balance", "none"], &["--white-balance", "radiance"]),
        (&["--show", "photons", "--sensors", "on"], &["--sensors", "radiance"]),
        (&["--show", "captors", "--results", "none.json"], &["none.json: is no results file"]),
        (
            &["--position", "0,0,1", "--look-at", "0,0,1"],
            &["camera: `look_at` is the position itself"],
        ),
        (&["--position", "1e30,0,0"], &["camera: its position is 1.000e30 m from the middle"]),
        (&["--position", "0,nan,0"], &["three numbers with commas"]),
        // values may begin with a minus
        (&["--position", "-1,0", "--up", "0,0,1"], &["three numbers with commas"]),
        (&["--position", "-1,0,1", "--look-at", "-1,0,1"], &["`look_at` is the position itself"]),
        (&["--show", "irradiance", "--range", "-1:-2"], &["range: -1 to -2 is no range"]),
    ];
    for (arguments, sentence) in cases {
        let assert = phylux(&scene, &["-o", "a.png"]).args(arguments).assert().code(2);
        let said = String::from_utf8_lossy(&assert.get_output().stderr).into_owned();
        for part in sentence {
            assert!(said.contains(part), "{arguments:?}: {said}");
        }
        assert!(!scene.path("a.png").exists(), "{arguments:?}");
    }
}

/// A scene without surfaces, one without captors, and results of another scene are refused.
#[test]
fn scenes_that_do_not_fit_are_refused() {
    let lamp = json!({ "type": "point", "position": [0, 0, 1], "power": 1 });
    let bare = World::new().light(lamp.clone()).write();
    let refused = |scene: &TestScene, arguments: &[&str], sentence: &str| {
        let assert = phylux(scene, &["-o", "a.png"]).args(arguments).assert().code(2);
        let said = String::from_utf8_lossy(&assert.get_output().stderr).into_owned();
        assert!(said.contains(sentence), "{said}");
    };
    refused(&bare, &[], "it has no surface, so there is nothing to see");
    let floor = Mesh::square([0.0; 3], [0.0, 0.0, 1.0], 1.0);
    let floor = World::new().lambert("a", 0.5).surface("floor", "a", &floor).light(lamp).write();
    refused(&floor, &["--show", "captors"], "the scene has no captor");

    let scene = small_room().write();
    let mut run = Command::new(binary());
    run.args(["run", "scene.json"]).current_dir(scene.path(".")).assert().success();
    let results = fs::read_to_string(scene.path("results.json")).expect("results");
    for (from, to, sentence) in [
        (
            "\"id\": \"sensor\"",
            "\"id\": \"other\"",
            "they have captor `other` where it has `sensor`",
        ),
        ("\"b1\"", "\"b3\"", "they have band `b3`, it has band `b1`"),
        ("\"flux\": \"W\"", "\"flux\": \"umol/s\"", "they are in umol/s, it is in W"),
    ] {
        assert!(results.contains(from), "{from}");
        fs::write(scene.path("other.json"), results.replace(from, to)).expect("a file");
        refused(&scene, &["--show", "captors", "--results", "other.json"], sentence);
    }
}

/// A dark scene is no error, and the colour bar still has numbers.
#[test]
fn darkness_is_drawn() {
    let lamp = json!({ "type": "point", "position": [0, 0, 1], "power": 0 });
    let floor = Mesh::square([0.0; 3], [0.0, 0.0, 1.0], 1.0);
    let scene = World::new().lambert("a", 0.5).surface("floor", "a", &floor).light(lamp).write();
    for show in ["radiance", "irradiance", "absorbed", "photons"] {
        phylux(&scene, &["-o", "a.png", "--show", show]).args(SMALL).assert().success();
    }
}

/// Pictures are denoised and numbers are not: on the visible flat walls neighbouring pixels differ
/// less in the denoised picture, while the numbers (EXR) are the same to the byte.
#[test]
fn pictures_are_denoised_and_numbers_are_not() {
    let scene = small_room().write();
    let roughness = |denoise: &str| {
        let show = ["--show", "irradiance", "-o", "a.png", "-o", "a.exr", "--denoise", denoise];
        phylux(&scene, &[&SMALL[..], &["--k", "20"], &show[..]].concat()).assert().success();
        let (width, _, pixels) = read_png(&scene.path("a.png"));
        // the green channel of the picture, without its colour bar
        let green = |x: usize, y: usize| f64::from(pixels[3 * (y * width + x) + 1]);
        let rough = |(x, y): (usize, usize)| (green(x, y) - green(x + 1, y)).abs();
        let sum: f64 = (0..30).flat_map(|y| (0..39).map(move |x| (x, y))).map(rough).sum();
        (sum, fs::read(scene.path("a.exr")).expect("numbers"))
    };
    let ((off, numbers), (on, same)) = (roughness("off"), roughness("on"));
    // the corners of the room are not smoothed
    assert!(on < 0.85 * off, "{on} {off}");
    assert!(numbers == same, "numbers were filtered");
    let mut misplaced = phylux(&scene, &["--show", "photons", "--denoise", "on", "-o", "b.png"]);
    let output = misplaced.output().expect("phylux starts");
    let words = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.code() == Some(2) && words.contains("--denoise"), "{words}");
}

/// Returns a leaf, soil and white paper on the ground, side by side, under a lamp with this power
/// in these bands. A camera looks down at them, beyond whose edges there is nothing.
fn things(bands: serde_json::Value, power: serde_json::Value, leaf: serde_json::Value) -> World {
    let tile = |x: f64| Mesh::square([x, 0.0, 0.0], [0.0, 0.0, 1.0], 1.0);
    World::new()
        .with("bands", bands)
        .with(
            "camera",
            json!({ "position": [0, 0, 5], "look_at": [0, 0, 0], "up": [0, 1, 0], "fov_deg": 45 }),
        )
        .material("leaf", json!({ "type": "lambert", "reflectance": leaf }))
        .lambert("soil", 0.15)
        .lambert("paper", 0.9)
        .surface("crop", "leaf", &tile(-1.1))
        .surface("bed", "soil", &tile(0.0))
        .surface("sheet", "paper", &tile(1.1))
        .light(json!({ "type": "spot", "position": [0, 0, 40], "direction": [0, 0, -1], "half_angle_deg": 4, "power": power }))
}

/// Returns the colours of the leaf, the soil, the paper and what is beyond them in such a picture,
/// and what the program says.
fn seen(world: &World, more: &[&str]) -> ([[f64; 3]; 4], String) {
    let scene = world.write();
    let assert = phylux(&scene, &["-o", "a.png", "--width", "80", "--height", "60"])
        .args(["--map-photons", "30000"])
        .args(more)
        .assert()
        .success();
    let said = String::from_utf8_lossy(&assert.get_output().stdout).into_owned();
    let (width, _, pixels) = read_png(&scene.path("a.png"));
    let colour = |x: usize, y: usize| [0, 1, 2].map(|c| f64::from(pixels[3 * (y * width + x) + c]));
    ([colour(19, 30), colour(40, 30), colour(61, 30), colour(40, 3)], said)
}

/// One broad band has plausible colours: leaves are green, soil is brown, paper is white, and what
/// is beyond is a plain backdrop, not black.
#[test]
fn a_broad_band_has_plausible_colours() {
    for band in
        [json!([{ "name": "PAR", "from_nm": 400, "to_nm": 700 }]), json!([{ "name": "light" }])]
    {
        let ([leaf, soil, paper, beyond], _) = seen(&things(band, json!(100), json!(0.12)), &[]);
        assert!(leaf[1] > 1.15 * leaf[0] && leaf[1] > 1.3 * leaf[2], "leaf {leaf:?}");
        assert!(soil[0] > 1.1 * soil[1] && soil[1] > 1.1 * soil[2], "soil {soil:?}");
        assert!(leaf[1] < 190.0 && leaf[1] > 70.0, "leaf {leaf:?}");
        let [least, most] = [f64::min, f64::max].map(|f| paper.into_iter().reduce(f));
        assert!(least > Some(200.0) && most < least.map(|least| least + 6.0), "paper {paper:?}");
        assert!(beyond.iter().all(|c| (50.0..150.0).contains(c)), "beyond {beyond:?}");
    }
}

/// The light of red and blue lamps is white by default, and says so; with `--white-balance none` it
/// is pink.
#[test]
fn pink_light_is_balanced() {
    let bands = json!([
        { "name": "blue", "from_nm": 400, "to_nm": 500 },
        { "name": "green", "from_nm": 500, "to_nm": 600 },
        { "name": "red", "from_nm": 600, "to_nm": 700 }
    ]);
    let pink = things(bands, json!([30, 15, 80]), json!([0.05, 0.15, 0.06]));
    let ([leaf, _, paper, _], said) = seen(&pink, &[]);
    assert!(said.contains("white balance: red x 0."), "{said}");
    assert!(paper.iter().all(|c| *c > 175.0), "{paper:?}");
    assert!(leaf[1] > 1.2 * leaf[0] && leaf[1] > 1.2 * leaf[2], "{leaf:?}");
    let ([leaf, _, paper, _], said) = seen(&pink, &["--white-balance", "none"]);
    assert!(!said.contains("white balance"), "{said}");
    assert!(paper[0] > paper[1] + 30.0, "{paper:?}");
    assert!(leaf[1] < 1.2 * leaf[0], "{leaf:?}");
}

/// Renders a scene that ships with the program, small, without any option that changes its look.
/// Returns its width and its pixels, and what the program says.
fn shipped(name: &str, [width, height]: [&str; 2], more: &[&str]) -> (usize, Vec<[u8; 3]>, String) {
    let folder = tempfile::tempdir().expect("a folder");
    let picture = folder.path().join("a.png");
    let mut command = Command::new(binary());
    command
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .arg("render")
        .arg(format!("scenes/{name}.json"));
    command.args(["--width", width, "--height", height, "--rays", "2", "--map-photons", "30000"]);
    let assert = command.arg("-o").arg(&picture).args(more).assert().success();
    let said = String::from_utf8_lossy(&assert.get_output().stdout).into_owned();
    let (width, _, pixels) = read_png(&picture);
    (width, pixels.as_chunks().0.to_vec(), said)
}

/// Without options a picture has shadows and lights, is neither dark nor pale on the whole, and no
/// surface is so bright that it is white: in rooms, by day and by night. Fields show green.
#[test]
fn shipped_scenes_are_exposed_well() {
    for (scene, most_white) in [
        ("box", 0.01),
        ("growth-room", 0.03),
        ("greenhouse", 0.01),
        ("greenhouse-day", 0.01),
        ("canopy", 0.01),
        ("agrivoltaic", 0.01),
        ("season", 0.03),
    ] {
        let (_, pixels, _) = shipped(scene, ["96", "64"], &["--sensors", "off"]);
        let mut grey: Vec<u32> =
            pixels.iter().map(|rgb| rgb.iter().map(|c| u32::from(*c)).sum::<u32>() / 3).collect();
        grey.sort_unstable();
        let at = |share: f64| grey[(share * (grey.len() - 1) as f64) as usize];
        let white = pixels.iter().filter(|rgb| rgb.iter().all(|c| *c > 250)).count();
        let white = white as f64 / pixels.len() as f64;
        let told = format!("{scene}: {} {} {}, {white}", at(0.02), at(0.5), at(0.98));
        assert!(white < most_white, "{told}");
        assert!((40..200).contains(&at(0.5)), "{told}");
        assert!(at(0.98) - at(0.02) > 45 && at(0.98) > 110, "{told}");
        if ["canopy", "season"].contains(&scene) {
            let is_green = |rgb: &&[u8; 3]| rgb[1] > rgb[0] && rgb[1] > rgb[2] && rgb[1] > 40;
            let green = pixels.iter().filter(is_green).count() as f64 / pixels.len() as f64;
            assert!(green > 0.35, "{scene}: {green}");
        }
    }
}

/// The box shows its lamp, a point, which is white with a glow about it, and its sensor, which
/// light crosses, in amber; the sensor can be left out. Of the growth room, which has no camera,
/// all six lamps and the grid of sensors are seen.
#[test]
fn lamps_and_sensors_are_seen() {
    let is_white = |rgb: &[u8; 3]| rgb.iter().all(|c| *c > 245);
    let is_amber = |rgb: &[u8; 3]| rgb[0] > 170 && rgb[2] < 90 && (90..200).contains(&rgb[1]);
    let (width, pixels, said) = shipped("box", ["200", "200"], &[]);
    let places = |wanted: &dyn Fn(&[u8; 3]) -> bool| {
        let found = pixels.iter().enumerate().filter(|(_, rgb)| wanted(rgb));
        found.map(|(i, _)| [i % width, i / width]).collect::<Vec<[usize; 2]>>()
    };
    let (lamp, sensor) = (places(&is_white), places(&is_amber));
    assert!((10..200).contains(&lamp.len()), "{}", lamp.len());
    assert!(lamp.iter().all(|[x, y]| x.abs_diff(100) < 12 && y.abs_diff(100) < 12), "{lamp:?}");
    // the disc of radius 0.05 at the distance 0.48, 0.4 below the eye, seen from above
    assert!((120..420).contains(&sensor.len()), "{}", sensor.len());
    assert!(sensor.iter().all(|[x, y]| x.abs_diff(100) < 14 && y.abs_diff(184) < 16), "{sensor:?}");
    assert!(said.contains("sensors are amber"), "{said}");
    let (_, plain, said) = shipped("box", ["200", "200"], &["--sensors", "off"]);
    assert!(!plain.iter().any(is_amber) && !said.contains("sensors"), "{said}");

    let (_, room, _) = shipped("growth-room", ["320", "240"], &[]);
    assert!(room.iter().filter(|rgb| is_white(rgb)).count() > 6 * 5);
    assert!(room.iter().filter(|rgb| is_amber(rgb)).count() > 24 * 8);
}
