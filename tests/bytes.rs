//! The same scene, settings and seed give the same bytes.

use std::{fs, path::Path, process::Command};

use phylux::{
    Estimator, Guiding, RunResult, Settings,
    transport::{MapLimit, NearestCount, PhotonCount, ThreadCount, TimeLimit, Tolerance},
};
use serde_json::json;

use crate::{
    common::{TestScene, binary, run_file},
    world::room_with_leaf,
};

fn scene() -> TestScene {
    room_with_leaf(30, 0.05)
        .light(json!({ "type": "point", "position": [0.1, 0.2, 0.7], "power": [3, 4] }))
        .light(json!({ "type": "tube", "from": [-0.5, 0, 0.9], "to": [0.5, 0, 0.9],
                       "radius": 0.02, "power": [2, 0.1] }))
        .edited(|scene| {
            let disc = json!({ "center": [0.4, 0, 0.2], "normal": [0, 0.6, 0.8], "radius": 0.2 });
            let sphere = json!({ "center": [-0.5, 0.2, 0.3], "radius": 0.1 });
            let captors = scene["captors"].as_array_mut().expect("a list");
            captors.push(json!({ "name": "disc", "disc": disc, "sides": "both" }));
            captors.push(json!({ "name": "sphere", "sphere": sphere }));
        })
        .write()
}

fn bytes(result: &RunResult) -> String {
    let mut bytes = Vec::new();
    phylux::formats::write_json(result, &mut bytes).expect("written to memory");
    String::from_utf8(bytes).expect("text")
}

fn run(scene: &TestScene, change: impl FnOnce(&mut Settings)) -> RunResult {
    run_file(&scene.path("scene.json"), |settings| {
        settings.k = NearestCount::new(20).ok();
        change(settings);
    })
}

/// The results have the same bytes on 1, 2 and 5 threads, and where a thousand are asked for: with
/// a number of photons that nothing divides, with a tolerance, with a photon map that is full, with
/// aimed flights, by paths, and by complete paths. The test does not depend on chance.
#[test]
fn threads_do_not_matter() {
    let scene = scene();
    type Change = fn(&mut Settings);
    let cases: [(&str, Change); 8] = [
        ("plain", |s| s.photons = PhotonCount::new(30_003).ok()),
        ("tolerance", |s| s.tolerance = Tolerance::new(0.08).ok()),
        ("full map", |s| {
            (s.photons, s.map_photons) =
                (PhotonCount::new(30_003).ok(), MapLimit::nearest_to(6_000))
        }),
        ("aimed flights", |s| {
            (s.photons, s.guiding) = (PhotonCount::new(10_003).ok(), Guiding::Aim)
        }),
        ("paths", |s| (s.photons, s.estimator) = (PhotonCount::new(15_003).ok(), Estimator::Paths)),
        ("accurate paths", |s| {
            (s.tolerance, s.estimator) = (Tolerance::new(0.2).ok(), Estimator::Paths)
        }),
        ("complete", |s| {
            (s.photons, s.estimator) = (PhotonCount::new(15_003).ok(), Estimator::Complete)
        }),
        ("accurate complete", |s| {
            (s.tolerance, s.estimator) = (Tolerance::new(0.2).ok(), Estimator::Complete)
        }),
    ];
    for (name, change) in cases {
        let on = |threads: usize| {
            bytes(&run(&scene, |settings| {
                change(settings);
                settings.threads = ThreadCount::nearest_to(threads);
            }))
        };
        let one = on(1);
        assert!(one == on(2), "{name}: 1 and 2 threads differ");
        assert!(one == on(5), "{name}: 1 and 5 threads differ");
        assert!(one == on(1000), "{name}: 1 and 1000 threads differ");
        assert!(one == on(2), "{name}: two runs differ");
    }
}

/// The kernel (the innermost code) for any processor, which `PHYLUX_KERNEL` forces, gives the same
/// bytes as the kernel for this processor: photons with their map, and paths, in a room and in the
/// shipped growth chamber. The test does not depend on chance.
#[test]
#[ignore = "needs a processor with AVX2"]
fn needs_avx2_kernels_do_not_matter() {
    let room = scene();
    let chamber = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/growth-chamber.json");
    let phylux = |plain: bool, arguments: &[&str]| {
        let mut command = Command::new(binary());
        command.args(arguments).current_dir(room.path("."));
        if plain {
            command.env("PHYLUX_KERNEL", "plain");
        } else {
            command.env_remove("PHYLUX_KERNEL");
        }
        let output = command.output().expect("phylux starts");
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        String::from_utf8(output.stdout).expect("text")
    };
    assert!(phylux(true, &["--version"]).ends_with("the plain kernel\n"));
    assert!(phylux(false, &["--version"]).ends_with("the AVX2 kernel\n"));
    for scene in [room.path("scene.json"), chamber] {
        for estimator in ["photons", "paths"] {
            let bytes = |plain| {
                let scene = scene.to_str().expect("a path in UTF-8");
                let count = ["--photons", "30000", "--estimator", estimator, "-o", "out.json"];
                phylux(plain, &[&["run", scene], &count[..]].concat());
                fs::read(room.path("out.json")).expect("results")
            };
            assert!(bytes(false) == bytes(true), "{} {estimator}", scene.display());
        }
    }
}

/// Another seed gives other bytes, so the tests of equal bytes can fail.
#[test]
fn seeds_matter() {
    let scene = scene();
    let of = |seed: u64| {
        let result = run(&scene, |s| (s.photons, s.seed) = (PhotonCount::new(10_000).ok(), seed));
        serde_json::to_string(&result.captors).expect("text")
    };
    assert!(of(1) != of(2));
}

/// More photons than any machine traces in a second.
const ENDLESS: u64 = 100_000_000_000_000;

/// A run that its time limit ends has the results of a run of that many photons or paths, however
/// many these are on this machine. The limits are so short that they always end the run.
#[test]
fn time_limit_is_a_number_of_photons() {
    let scene = scene();
    for (estimator, milliseconds) in [
        (Estimator::Photons, 1),
        (Estimator::Photons, 20),
        (Estimator::Photons, 700),
        (Estimator::Paths, 1),
        (Estimator::Paths, 300),
        (Estimator::Complete, 1),
        (Estimator::Complete, 300),
    ] {
        let limited = run(&scene, |settings| {
            settings.estimator = estimator;
            settings.photons = PhotonCount::new(ENDLESS).ok();
            settings.max_time = TimeLimit::new(milliseconds as f64 / 1000.0).ok();
        });
        assert!(limited.photons < ENDLESS && limited.photons % 128 == 0);
        let again = run(&scene, |settings| {
            (settings.photons, settings.estimator) =
                (PhotonCount::new(limited.photons).ok(), estimator);
        });
        assert!(bytes(&limited) == bytes(&again), "{} {estimator:?}", limited.photons);
    }
}
