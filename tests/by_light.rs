//! Results that are split by light, and mixed again at other powers.

use phylux::{
    Estimator, Guiding, RunResult, Settings,
    results::{ByLight, FaceResult, Factor},
    transport::{PhotonCount, ThreadCount},
};
use serde_json::{Value, json};

use crate::{
    bad_input::phylux,
    common::{TestScene, binary, run_file},
    world::{Mesh, World, room, room_with_leaf},
};

const LIGHTS: [&str; 3] = ["left, low", "right", "spot"];

/// Returns a room with a leaf, 16 tiles, and three lights of these powers in two bands.
fn scene(powers: [[f64; 2]; 3]) -> TestScene {
    room_with_leaf(16, 0.1)
        .with("sums", json!({ "both": ["b0", "b1"] }))
        .light(json!({ "name": LIGHTS[0], "type": "point", "position": [-0.7, 0.2, 0.3],
                       "power": powers[0] }))
        .light(json!({ "name": LIGHTS[1], "type": "tube", "from": [0.5, 0, 0.9],
                       "to": [0.9, 0, 0.9], "radius": 0.02, "power": powers[1] }))
        .light(json!({ "name": LIGHTS[2], "type": "spot", "position": [0, 0, 0.9],
                       "direction": [0, 0, -1], "half_angle_deg": 20, "power": powers[2] }))
        .write()
}

const POWERS: [[f64; 2]; 3] = [[3.0, 4.0], [2.0, 0.5], [1.0, 0.0]];

fn run(scene: &TestScene, change: impl FnOnce(&mut Settings)) -> RunResult {
    run_file(&scene.path("scene.json"), change)
}

/// Returns the results of 100,003 photons of seed 3, split by light.
fn split() -> RunResult {
    run(&scene(POWERS), |settings| {
        (settings.photons, settings.seed, settings.by_light) =
            (PhotonCount::new(100_003).ok(), 3, true);
    })
}

fn value(result: &RunResult) -> Value {
    serde_json::to_value(result).expect("JSON")
}

/// Removes the entries that a split adds to results.
fn without_split(value: &mut Value) {
    match value {
        Value::Object(map) => {
            map.remove("by_light");
            map.values_mut().for_each(without_split);
        }
        Value::Array(values) => values.iter_mut().for_each(without_split),
        _ => {}
    }
}

/// Returns every face of captors and groups.
fn faces(result: &RunResult) -> Vec<&FaceResult> {
    let captors = result.captors.iter().flat_map(|c| c.faces());
    let groups = result.groups.iter().flat_map(|g| std::iter::once(&g.front).chain(&g.back));
    captors.chain(groups).collect()
}

/// Asserts that the parts add up to the whole, to rounding.
fn check_sum<'a>(whole: &[f64], parts: impl Iterator<Item = &'a [f64]>) {
    let mut sum = vec![0.0; whole.len()];
    parts.for_each(|part| sum.iter_mut().zip(part).for_each(|(sum, v)| *sum += v));
    for (sum, whole) in sum.iter().zip(whole) {
        assert!((sum - whole).abs() <= 1e-11 * whole.abs() + 1e-13, "{sum} and {whole}");
    }
}

/// The parts by light add up to the whole, and a split changes no other number, on 1 and on 3
/// threads. The test does not depend on chance.
#[test]
fn a_split_adds_up_and_changes_nothing_else() {
    let scene = scene(POWERS);
    let run = |by_light, threads| {
        run(&scene, |settings| {
            (settings.photons, settings.seed) = (PhotonCount::new(100_003).ok(), 3);
            (settings.by_light, settings.threads) = (by_light, ThreadCount::nearest_to(threads));
        })
    };
    let split = run(true, 3);
    assert_eq!(value(&split), value(&run(true, 1)));
    let mut stripped = value(&split);
    without_split(&mut stripped);
    assert_eq!(stripped.to_string(), value(&run(false, 2)).to_string());

    for face in faces(&split) {
        let parts = face.by_light.as_ref().expect("a split");
        assert!(parts.keys().eq(LIGHTS));
        check_sum(&face.flux, parts.values().map(|part| &part.flux[..]));
        check_sum(&face.irradiance, parts.values().map(|part| &part.irradiance[..]));
        assert_eq!(face.photons, parts.values().map(|part| part.photons).sum::<u64>());
    }
    let absorbed = split.captors.iter().map(|c| (&c.absorbed, &c.by_light));
    let absorbed = absorbed.chain(split.groups.iter().map(|g| (&g.absorbed, &g.by_light)));
    let absorbed: Vec<_> =
        absorbed.filter_map(|(a, parts)| a.as_ref().zip(parts.as_ref())).collect();
    assert_eq!(absorbed.len(), 4);
    for (whole, parts) in absorbed {
        check_sum(whole, parts.values().map(|part| &part.absorbed[..]));
    }
    let (energy, lights) = (&split.energy, split.energy.by_light.as_ref().expect("a split"));
    type Entry = fn(&phylux::results::Energy) -> &[f64];
    let entries: [Entry; 5] =
        [|e| &e.power, |e| &e.emitted, |e| &e.absorbed, |e| &e.escaped, |e| &e.lost];
    for of in entries {
        check_sum(of(energy), lights.values().map(of));
    }
    for (name, whole) in energy.absorbed_by.iter().flatten() {
        let of = |light: &'static str| &lights[light].absorbed_by.as_ref().expect("a ledger")[name];
        check_sum(whole, LIGHTS.iter().map(|light| &of(light)[..]));
    }
    assert_eq!(lights["spot"].power, [1.0, 0.0, 1.0]);
    assert_eq!(split.captors[2].groups, Some(vec!["tiles".to_string()]));
}

/// Lights are independent, so the squares of their errors add up to the square of the whole's
/// error, on average over 17 faces and 2 bands within 15 %.
///
/// Seed 3. Each of the squares has a relative error of 12 %, and the faces are largely independent,
/// so 15 % is 5 standard errors or more.
#[test]
fn errors_of_lights_are_independent() {
    let split = split();
    let mut ratios = Vec::new();
    for face in split.captors.iter().filter(|c| c.id != "room/room").map(|c| &c.front) {
        for b in 0..2 {
            let square = |face: &FaceResult| face.flux_se[b].unwrap_or(0.0).powi(2);
            let parts =
                face.by_light.iter().flat_map(|lights| lights.iter()).map(|(_, part)| square(part));
            ratios.push(parts.sum::<f64>() / square(face));
        }
    }
    let mean = ratios.iter().sum::<f64>() / ratios.len() as f64;
    assert!(ratios.len() >= 34 && (mean - 1.0).abs() < 0.15, "{mean} of {}", ratios.len());
}

fn factors(factors: [f64; 3]) -> ByLight<f64> {
    LIGHTS.iter().map(|name| name.to_string()).zip(factors).collect()
}

/// The properties of a mix that are exact and do not depend on chance.
#[test]
fn a_mix_is_linear() {
    let split = split();
    let mix = |f: [f64; 3]| split.mix(&factors(f)).expect("a mix");
    let (same, alone, twice) = (mix([1.0; 3]), mix([0.0, 1.0, 0.0]), mix([2.0; 3]));
    for (i, face) in faces(&split).into_iter().enumerate() {
        check_sum(&face.flux, [&faces(&same)[i].flux[..]].into_iter());
        let part = &face.by_light.as_ref().expect("a split")["right"];
        let of = faces(&alone)[i];
        assert_eq!((&of.flux, &of.flux_se, of.photons), (&part.flux, &part.flux_se, part.photons));
        assert_eq!(of.irradiance_se, part.irradiance_se);
        for (twice, same) in faces(&twice)[i].flux.iter().zip(&faces(&same)[i].flux) {
            assert_eq!(*twice, 2.0 * same);
        }
        assert_eq!(face.knn.is_some(), of.knn.is_some());
        assert!(matches!(of.knn, None | Some(None)));
    }
    // the captors and groups of a mix are consistent
    let tiles = alone.groups.iter().find(|g| g.id == "tiles").expect("tiles");
    let of_tiles = || alone.captors.iter().filter(|c| c.id.starts_with("tiles/"));
    let least = of_tiles().map(|c| c.front.irradiance[0]).fold(f64::INFINITY, f64::min);
    assert_eq!(tiles.front.min.as_ref().expect("several")[0], least);
    assert_eq!(alone.energy.power, [2.0, 0.5, 2.5]);
    let e = &alone.energy;
    let accounted = e.absorbed[0] + e.escaped[0] + e.lost[0];
    assert!((accounted - e.emitted[0]).abs() < 1e-9 && (e.emitted[0] - 2.0).abs() < 1e-12);
    // a mix of a mix, and results that are read again from their file
    let half = mix([0.5, 1.0, 4.0]).mix(&factors([2.0, 1.0, 0.25])).expect("a mix");
    assert_eq!(value(&half)["captors"], value(&same)["captors"]);
    let all = |f: [f64; 3]| factors(f).into_iter().map(|(name, one)| (name, Factor::All(one)));
    // one that gives up what it is made of is the same
    let own = split.clone().into_mixed(&all([0.5, 1.0, 4.0]).collect()).expect("a mix");
    assert_eq!(value(&own), value(&mix([0.5, 1.0, 4.0])));
    let ones = all([1.0; 3]);
    assert_eq!(half.mixed, Some(ones.collect()));
    let read: RunResult = serde_json::from_str(&value(&split).to_string()).expect("a result");
    assert_eq!(value(&read), value(&split));
}

/// A mix is what a run at these powers finds. Of 52 values of two independent runs (seeds 3 and 4),
/// all z are below 4.5, which chance exceeds with odds of 4e-4, and their root mean square is 0.7
/// to 1.3.
#[test]
fn a_mix_is_the_run_at_these_powers() {
    let mixed = split().mix(&factors([0.5, 3.0, 2.0])).expect("a mix");
    let powers = [[1.5, 2.0], [6.0, 1.5], [2.0, 0.0]];
    let run = run(&scene(powers), |s| (s.photons, s.seed) = (PhotonCount::new(100_003).ok(), 4));
    assert_eq!(mixed.energy.power, run.energy.power);
    let mut all = Vec::new();
    for (a, b) in mixed.captors.iter().zip(&run.captors) {
        let absorbed =
            |c: &phylux::results::CaptorResult| (c.absorbed.clone(), c.absorbed_se.clone());
        let flux = |c: &phylux::results::CaptorResult| {
            (Some(c.front.flux.clone()), Some(c.front.flux_se.clone()))
        };
        for of in [flux as fn(&phylux::results::CaptorResult) -> _, absorbed] {
            let ((Some(a), Some(a_se)), (Some(b), Some(b_se))) = (of(a), of(b)) else { continue };
            for i in 0..3 {
                let (Some(x), Some(y)) = (a_se[i], b_se[i]) else { continue };
                all.push((a[i] - b[i]) / x.hypot(y));
            }
        }
    }
    assert!(all.len() >= 52, "{}", all.len());
    let rms = (all.iter().map(|z| z * z).sum::<f64>() / all.len() as f64).sqrt();
    let worst = all.iter().fold(0.0f64, |worst, z| worst.max(z.abs()));
    assert!(worst < 4.5 && (0.7..1.3).contains(&rms), "worst {worst}, rms {rms}");
}

/// A mix without the bright lamp rests on the few photons of the faint one, and is marked; the whole
/// run is not. Seed 3.
#[test]
fn a_mix_of_few_photons_is_marked() {
    let lamp = |name: &str, power: f64| json!({ "name": name, "type": "point", "position": [0.5, 0.5, 0.8], "power": power });
    let scene = World::new()
        .lambert("wall", 0.5)
        .surface("room", "wall", &room([0.0; 3], [1.0; 3]))
        .light(lamp("bright", 1000.0))
        .light(lamp("faint", 1.0))
        .captor("sensor", &Mesh::square([0.5, 0.5, 0.2], [0.0, 0.0, 1.0], 0.3))
        .write();
    let whole = run(&scene, |settings| {
        (settings.photons, settings.seed, settings.by_light) =
            (PhotonCount::new(10_000).ok(), 3, true);
        settings.guiding = Guiding::Off;
    });
    let faint = whole.mix(&ByLight::from_iter([("bright".to_string(), 0.0)])).expect("a mix");
    let histories = faint.captors[0].front.histories.expect("a number");
    assert!(0 < histories && histories < 30, "{histories}");
    assert_eq!([&whole, &faint].map(|result| result.captors[0].front.few_paths), [false, true]);
    let brighter = whole.mix(&ByLight::from_iter([("bright".to_string(), 2.0)])).expect("a mix");
    assert!(!brighter.captors[0].front.few_paths);
}

/// The command `phylux mix`, and the message of every refusal.
#[test]
fn mixing_on_the_command_line() {
    let scene = scene(POWERS);
    let folder = scene.path("");
    let run = |arguments: &[&str]| {
        let output = phylux(&folder, arguments);
        let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
        (output.status.code(), text(&output.stdout), text(&output.stderr))
    };
    let traced = run(&["run", "scene.json", "--photons", "1e4", "--by-light", "-o", "a.json"]);
    assert_eq!(traced.0, Some(0), "{}", traced.2);
    let mixed = run(&["mix", "a.json", "--power", "left, low=0.5,spot=2", "-o", "b.json"]);
    assert_eq!(mixed.0, Some(0), "{}", mixed.2);
    assert!(mixed.1.contains("seed 1, mixed"), "{}", mixed.1);
    let line = mixed.1.lines().find(|line| line.contains("left, low")).expect("its power");
    assert_eq!(
        line.split_whitespace().collect::<Vec<_>>(),
        ["left,", "low", "1.500", "2.000", "3.500"]
    );
    let read = |name: &str| phylux::formats::read_json(&scene.path(name)).expect("a result");
    let by_library = read("a.json").mix(&factors([0.5, 1.0, 2.0])).expect("a mix");
    assert_eq!(value(&read("b.json"))["captors"], value(&by_library)["captors"]);
    assert_eq!(run(&["mix", "a.json", "--power", "l*=0.5,*t=1,spot=2", "-o", "b.json"]).0, Some(2));
    assert_eq!(run(&["mix", "a.json", "--power", "l*=0.5,s*=2", "-o", "b.json"]).0, Some(0));
    assert_eq!(value(&read("b.json"))["captors"], value(&by_library)["captors"]);
    assert_eq!(run(&["run", "scene.json", "--photons", "1e4", "-o", "whole.json"]).0, Some(0));
    let cut = std::fs::read_to_string(scene.path("a.json")).expect("a result");
    std::fs::write(scene.path("cut.json"), cut.replacen("\"flux\": [", "\"flux\": [1, ", 1))
        .expect("a file");
    let refused = [
        (
            "mix whole.json --power spot=2",
            "error: whole.json: these results are not split by light; run the scene again with --by-light",
        ),
        ("mix a.json --power spto=2", "error: a.json: no light `spto`; did you mean `spot`?"),
        (
            "mix a.json --power sun=2",
            "error: a.json: no light `sun`; there are left, low, right, spot",
        ),
        (
            "mix a.json --power spot=-1",
            "error: a.json: factor -1 of light `spot`; it must be from 0",
        ),
        ("mix a.json --power spot=nan", "error: a.json: factor NaN of light `spot`; it must be"),
        ("mix a.json --power spot=1,spot=2", "error: --power: light `spot` stands there twice"),
        ("mix a.json --power s*=1,spot=2", "error: --power: light `spot` stands there twice"),
        ("mix a.json --power spot", "error: --power: `spot` is no light with its factor; write"),
        ("mix a.json --power spot=2 -o a.json", "is a file that is read"),
        ("mix scene.json --power spot=2", "error: scene.json: is no results file: "),
        (
            "mix cut.json --power spot=2",
            "error: cut.json: is no results file: a list has not one entry",
        ),
        (
            "run scene.json --by-light --estimator paths",
            "error: --by-light: only photons know which light they come from; take photons as the estimator, or do \
             not split by light",
        ),
    ];
    for (arguments, words) in refused {
        let (code, _, said) = run(&arguments.split(' ').collect::<Vec<_>>());
        assert_eq!(code, Some(2), "{arguments}: {said}");
        assert!(said.contains(words), "{arguments}: {said}");
    }
    let auto = run(&["run", "scene.json", "--photons", "1e4", "--by-light", "--estimator", "auto"]);
    assert!(auto.1.contains("photons were chosen: only photons know"), "{}{}", auto.1, auto.2);
    assert_eq!(read("results.json").estimator, Estimator::Photons);
}

/// A split that would take more memory than a run may take is refused before the run begins.
#[test]
fn a_huge_split_is_refused() {
    let lights = (0..20_000).map(
        |i| json!({ "type": "point", "position": [0, 0, 0.5 + 1e-5 * f64::from(i)], "power": 1 }),
    );
    let captors = (0..20_000).map(|i| {
        (format!("{i}"), Mesh::square([0.0, 0.0, 1e-5 * f64::from(i)], [0.0, 0.0, 1.0], 0.3))
    });
    let world = World::new().captors("tiles", captors);
    let scene = lights.fold(world, World::light).write();
    let output =
        phylux(&scene.path(""), &["run", "scene.json", "--photons", "20000", "--by-light"]);
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{said}");
    assert!(
        said.contains(
            "that they may; ask for fewer captors, groups, bands, lights or threads, or do not split"
        ),
        "{said}"
    );
}

/// A split by light for 10,000 sensors in 4096 bands does not fit into the 8 GB that the shell
/// grants, and is refused before the run begins.
#[cfg(target_os = "linux")]
#[test]
fn what_the_machine_has_no_memory_for_is_refused() {
    let captors = (0..10_000).map(|i| {
        (format!("{i}"), Mesh::square([0.0, 0.0, 1e-4 * f64::from(i)], [0.0, 0.0, 1.0], 0.3))
    });
    let lamp = json!({ "type": "point", "position": [0, 0, 2], "power": 1 });
    let scene = World::new().bands(4096).captors("tiles", captors).light(lamp).write();
    let script = "ulimit -v 8000000; exec \"$0\" run scene.json --photons 1e4 --by-light";
    let mut command = std::process::Command::new("sh");
    command.args(["-c", script]).arg(binary()).current_dir(scene.path(""));
    let output = command.output().expect("sh");
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{said}");
    assert!(
        said.contains("the sums and results of 10000 captors, 4096 bands and 1 lights"),
        "{said}"
    );
    assert!(
        said.contains("of 7.") && said.contains("that they may; ask for fewer captors"),
        "{said}"
    );
}

/// Results of 1,200 lights have a face for each light on each face of each captor: what such a face
/// never has takes no room in it.
#[test]
fn a_face_of_one_light_is_small() {
    let bytes = size_of::<phylux::results::FaceResult>();
    assert!(bytes <= 224, "{bytes} bytes");
}
