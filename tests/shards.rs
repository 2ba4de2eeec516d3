//! One run on several machines: shards of its batches are merged to the bytes of a single run.

use std::{fs, path::PathBuf, process::Output};

use phylux::{Control, math::Stream};
use serde_json::{Value, json};

use crate::{
    bad_input::{listing, phylux},
    common::TestScene,
    world::room_with_leaf,
};

fn scene() -> TestScene {
    room_with_leaf(30, 0.05)
        .with("sums", json!({ "both": ["b0", "b1"] }))
        .light(json!({ "type": "point", "position": [0.1, 0.2, 0.7], "power": [3, 4] }))
        .light(json!({ "type": "tube", "from": [-0.5, 0, 0.9], "to": [0.5, 0, 0.9],
                       "radius": 0.02, "power": [2, 0.1] }))
        .write()
}

fn run(folder: &TestScene, arguments: &str) -> Output {
    phylux(&folder.path(""), &arguments.split(' ').collect::<Vec<_>>())
}

fn ok(folder: &TestScene, arguments: &str) {
    let output = run(folder, arguments);
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{arguments}: {said}");
}

/// Returns the names in a random order, from the stream of seed 9.
fn shuffled(mut names: Vec<String>) -> String {
    let mut stream = Stream::new(9, names.len() as u64, 0);
    for i in (1..names.len()).rev() {
        names.swap(i, (stream.uniform_fine() * (i + 1) as f64) as usize);
    }
    names.join(" ")
}

/// Merged shards have the bytes of the whole run: photons with the default k, without a map, with a
/// map that is full in the first piece of some batch or in a later one, split by light, with aimed
/// flights (also if a trial chooses them), paths, complete paths, and fewer photons than batches. The test does not
/// depend on chance.
#[test]
fn shards_join_to_the_same_bytes() {
    let folder = scene();
    for (case, shards) in [
        ("--photons 100003", 3),
        ("--photons 100003 --k 0", 16),
        ("--photons 100003 --map-photons 3000 --threads 1", 5),
        ("--photons 100003 --map-photons 25000 --k 20", 5),
        ("--photons 50003 --by-light --seed 4", 2),
        ("--photons 50003 --guiding aim", 3),
        ("--photons 20003 --guiding auto", 2),
        ("--photons 20003 --estimator auto", 3),
        ("--photons 5003 --guiding full", 2),
        ("--photons 50003 --estimator paths", 3),
        ("--photons 50003 --estimator complete", 3),
        ("--photons 100 --k 2", 50),
        ("--photons 20000", 1),
    ] {
        ok(&folder, &format!("run scene.json {case} -o whole.json"));
        let names: Vec<String> = (1..=shards).map(|i| format!("shard{i}.json")).collect();
        for (name, i) in names.iter().zip(1..) {
            ok(&folder, &format!("run scene.json {case} --shard {i}/{shards} -o {name}"));
        }
        ok(&folder, &format!("merge {} -o merged.json", shuffled(names)));
        let read = |name: &str| fs::read(folder.path(name)).expect("results");
        assert!(read("whole.json") == read("merged.json"), "{case}");
        let whole: Value = serde_json::from_slice(&read("whole.json")).expect("JSON");
        let full = whole["map"]["photons"].as_u64() < whole["photons"].as_u64();
        assert!(full || !case.contains("--map-photons"), "{case}: {}", whole["map"]);
    }
}

/// Shards that do not belong to one run, and runs that cannot be divided, are refused with a
/// message, and nothing is written.
#[test]
fn what_does_not_belong_together_is_refused() {
    let folder = scene();
    for i in 1..=3 {
        ok(&folder, &format!("run scene.json --photons 5000 --shard {i}/3 -o p{i}.json"));
    }
    ok(&folder, "run scene.json --photons 5000 --shard 1/8 -o eighth.json");
    ok(&folder, "run scene.json --photons 5000 --seed 2 --shard 2/3 -o seed.json");
    let shard = fs::read_to_string(folder.path("p2.json")).expect("a shard");
    fs::write(folder.path("cut.json"), &shard[..shard.len() - 100]).expect("a file");
    fs::write(folder.path("old.json"), shard.replacen("\"phylux\":\"0.", "\"phylux\":\"9.", 1))
        .expect("a file");
    let (head, rest) = shard.split_once("\"format\":").expect("a format");
    let before = head.to_string() + rest.split_once(',').expect("more keys").1;
    fs::write(folder.path("before.json"), before).expect("a file");
    let earlier = r#"{"phylux_part":"1/1","format":7,"phylux":"0.1.0","scene":"scene.json"}"#;
    fs::write(folder.path("earlier.json"), earlier).expect("a file");
    let kept = shard.replacen("\"share\":\"2/3\"", "\"share\":\"checkpoint\"", 1);
    fs::write(folder.path("kept.json"), kept).expect("a file");
    let year = shard.replacen("\"phylux_work\":\"run\"", "\"phylux_work\":\"year\"", 1);
    fs::write(folder.path("year.json"), year).expect("a file");
    let spoiled = shard.replacen("\"segments\":", "\"segments\":1", 1);
    fs::write(folder.path("spoiled.json"), spoiled).expect("a file");
    for (name, more) in [("more.json", "x"), ("blank.json", "\n"), ("twice.json", &*shard)] {
        fs::write(folder.path(name), shard.clone() + more).expect("a file");
    }
    let text = fs::read_to_string(folder.path("scene.json")).expect("the scene");
    fs::create_dir(folder.path("other")).expect("a folder");
    for file in listing(&folder.path("")).iter().filter(|name| name.ends_with(".obj")) {
        fs::copy(folder.path(file), folder.path("other").join(file)).expect("a copy");
    }
    fs::write(folder.path("other/scene.json"), &text).expect("a scene");
    // a scene with the same content in another place is the same scene
    ok(&folder, "merge p1.json p2.json p3.json -o merged.json --scene other/scene.json");
    let leaf = fs::read_to_string(folder.path("other/leaf.obj")).expect("a mesh");
    fs::write(folder.path("other/leaf.obj"), leaf + "\n").expect("a mesh");
    ok(&folder, "run other/scene.json --photons 5000 --shard 2/3 -o content.json");
    fs::create_dir(folder.path("folder")).expect("a folder");
    let before = listing(&folder.path(""));
    let rows = [
        ("merge p1.json p3.json -o m.json", "merge: shard is missing: 2/3; name the files"),
        (
            "merge eighth.json -o m.json",
            "merge: shards are missing: 2/8, 3/8, 4/8, 5/8, 6/8, 7/8 and 1 more",
        ),
        (
            "merge p1.json p2.json p3.json p1.json -o m.json",
            "p1.json: is shard 1/3, and so is p1.json; name",
        ),
        (
            "merge p1.json seed.json p3.json -o m.json",
            "seed.json: is of other settings than p1.json",
        ),
        (
            "merge p1.json content.json p3.json -o m.json",
            "content.json: is of another scene, or of other contents of its files, than p1.json",
        ),
        (
            "merge p1.json p2.json eighth.json -o m.json",
            "eighth.json: is of another number of shards than",
        ),
        (
            "merge old.json -o m.json",
            "old.json: is of phylux 9.1.0, this is 0.1.0; merge with the version",
        ),
        (
            "merge before.json -o m.json",
            "before.json: was written by a phylux with other random numbers and counts; trace",
        ),
        (
            "merge p1.json before.json p3.json -o m.json",
            "before.json: was written by a phylux with other random numbers and counts; trace",
        ),
        (
            "merge earlier.json -o m.json",
            "earlier.json: was written by a phylux with other random numbers and counts; trace",
        ),
        (
            "merge p1.json kept.json p3.json -o m.json",
            "kept.json: is no shard of a run: it is a checkpoint of a run; name files",
        ),
        (
            "merge p1.json year.json -o m",
            "p1.json: is no shard of a year: it is a shard of a run; name files",
        ),
        (
            "run scene.json --photons 5000 --checkpoint p1.json -o m.json",
            "p1.json: is no checkpoint of a run: it is a shard of a run; name a file",
        ),
        (
            "merge p1.json old.json p3.json -o m.json",
            "old.json: is of another version of phylux than",
        ),
        ("merge p1.json cut.json p3.json -o m.json", "cut.json: was cut short or changed"),
        ("merge p1.json spoiled.json p3.json -o m.json", "spoiled.json: was cut short or changed"),
        ("merge p1.json more.json p3.json -o m.json", "more.json: was cut short or changed"),
        ("merge p1.json blank.json p3.json -o m.json", "blank.json: was cut short or changed"),
        ("merge p1.json twice.json p3.json -o m.json", "twice.json: was cut short or changed"),
        (
            "merge p1.json p2.json p3.json -o m.json --scene other/scene.json",
            "other/scene.json: it, or a file that it names, is not what",
        ),
        (
            "merge p1.json p2.json p3.json -o m.json --scene none.json",
            "none.json: the scene of the shards is not there; say where it is with --scene",
        ),
        ("merge scene.json -o m.json", "scene.json: is no shard of a run: "),
        ("merge p1.json folder -o m.json", "folder: is no shard of a run: it is not a file"),
        ("merge p1.json p2.json p3.json -o p1.json", "is a file that is read"),
        (
            "merge folder -o m.json --scene scene.json",
            "--scene: folders of sweeps know their scene",
        ),
        (
            "run scene.json --shard 1/200 -o m.json",
            "--shard: 200 shards of a run of 128 batches; ask for fewer",
        ),
        (
            "run scene.json --shard 1/2 --tolerance 0.1 -o m.json",
            "--shard: when a tolerance is met only all batches",
        ),
        (
            "run scene.json --shard 1/2 --max-time 1 -o m.json",
            "--shard: a time limit means another number of photons",
        ),
        ("run scene.json --shard 3/2 -o m.json", "invalid value '3/2' for '--shard <I/N>'"),
        (
            "run scene.json --shard 1/2 --csv m.csv",
            "the argument '--shard <I/N>' cannot be used with '--csv <FILE>'",
        ),
    ];
    for (arguments, words) in rows {
        let output = run(&folder, arguments);
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(2), "{arguments}: {said}");
        assert!(
            said.contains(&format!("error: {words}")) || said.contains(words),
            "{arguments}: {said}"
        );
        assert_eq!(listing(&folder.path("")), before, "{arguments}");
    }
}

/// A shard file in which any one byte is changed gives an error, and no panic (300 changes from the
/// stream of seed 11).
#[test]
fn no_spoiled_shard_is_believed() {
    let folder = scene();
    for i in 1..=2 {
        ok(&folder, &format!("run scene.json --photons 300 --k 2 --shard {i}/2 -o p{i}.json"));
    }
    let shard = fs::read(folder.path("p2.json")).expect("a shard");
    let control = Control::default();
    let join = |name: &str| {
        let shards: Vec<PathBuf> = vec![folder.path("p1.json"), folder.path(name)];
        phylux::studies::join(&shards, Some(&folder.path("scene.json")), &control)
    };
    join("p2.json").unwrap_or_else(|e| panic!("{e}"));
    let mut stream = Stream::new(11, 0, 0);
    let mut number = |below: usize| (stream.uniform_fine() * below as f64) as usize;
    for _ in 0..300 {
        let mut spoiled = shard.clone();
        let place = number(shard.len());
        spoiled[place] = spoiled[place].wrapping_add(1 + number(255) as u8);
        fs::write(folder.path("spoiled.json"), &spoiled).expect("a file");
        assert!(join("spoiled.json").is_err(), "byte {place}");
    }
}
