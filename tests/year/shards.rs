//! Years that are divided over machines or over time: the same bytes.

use std::{fs, path::Path};

use serde_json::json;

use super::leaves::leaves_in_a_room;
use crate::{
    bad_input::{listing, phylux, refused},
    common::TestScene,
    processes::{enough, happens, kill, start},
    rendered::done,
};

/// Returns leaves in a room with a lamp that fills up at dusk, and a screen at night.
pub fn room() -> TestScene {
    let scene = leaves_in_a_room()
        .light(json!({ "type": "point", "name": "lamp", "position": [2, 2, 2.5], "power": 400 }))
        .edited(|scene| {
            scene["lights"][1]["watts"] = json!(50);
            scene["objects"][0]["present"] = json!(true);
        })
        .write();
    let control = json!({
        "states": [{ "name": "hazy", "changes": { "/objects/0/present": false }, "hours": [15, 24] }],
        "lamps": [{ "lights": "lamp", "fill_to": 60, "of": "both", "band": "all" }]
    });
    fs::write(scene.path("control.json"), control.to_string()).expect("control.json");
    scene
}

pub fn arguments<'a>(output: &'a str, more: &[&'a str]) -> Vec<&'a str> {
    let fixed = ["year", "scene.json", "--control", "control.json", "-o", output];
    [&fixed[..], more].concat()
}

/// Returns all tables in a folder with their bytes.
pub fn tables(folder: &Path) -> Vec<(String, Vec<u8>)> {
    let names = listing(folder);
    names
        .into_iter()
        .map(|name| (name.clone(), fs::read(folder.join(name)).expect("a file")))
        .collect()
}

/// Three shards, traced on one, two and five threads and merged in any order, give the bytes of the
/// whole year. Shards of other years, and too few of them, are refused.
#[test]
fn shards_make_the_same_year() {
    let scene = room();
    let folder = scene.path("");
    let year = ["--photons", "6000", "--results", "--hours", "s*"];
    done(&folder, &arguments("whole", &year));
    for (shard, threads) in [("1/3", "1"), ("2/3", "2"), ("3/3", "5")] {
        let name = format!("s{}", &shard[..1]);
        let more = [&year[..], &["--shard", shard, "--threads", threads]].concat();
        done(&folder, &arguments(&name, &more));
    }
    let drawn = [&year[..], &["--shard", "1/3", "--png"]].concat();
    refused(
        &folder,
        &arguments("drawn", &drawn),
        &["shards come without plots; give it when they"],
    );
    // what the whole year would be refused for, a shard is, before it is traced
    fs::write(scene.path("wrong.json"), r#"{"lamps": [{"lights": "lamq"}]}"#).expect("a file");
    let wrong = ["year", "scene.json", "--photons", "6000", "--shard", "1/3", "-o", "x"];
    for (more, words) in [
        (&["--control", "wrong.json"][..], "no lamp `lamq`; did you mean `lamp`?"),
        (&["--hours", "zzz*"], "zzz*"),
    ] {
        refused(&folder, &[&wrong[..], more].concat(), &[words]);
    }
    // each combination of states needs as many photons as it has lights
    let error = phylux(&folder, &arguments("x", &["--photons", "60"]));
    let said = String::from_utf8_lossy(&error.stderr).into_owned();
    let needed = said.rsplit_once("ask for at least ").map(|(_, needed)| needed.trim().to_string());
    assert!(said.contains("60 photons for 2 combinations of states"), "{said}");
    let needed: u64 = needed.and_then(|needed| needed.parse().ok()).expect("a number");
    let enough = needed.to_string();
    done(&folder, &arguments("enough", &["--photons", &enough, "--hours", "none"]));
    let less = (needed - 1).to_string();
    refused(&folder, &arguments("x", &["--photons", &less]), &["ask for at least"]);
    // a shard does not depend on threads
    done(&folder, &arguments("s4", &[&year[..], &["--shard", "2/3", "--threads", "1"]].concat()));
    assert!(
        fs::read(scene.path("s2")).expect("a shard") == fs::read(scene.path("s4")).expect("one")
    );
    done(&folder, &["merge", "s3", "s1", "s2", "-o", "joined"]);
    let (whole, joined) = (tables(&scene.path("whole")), tables(&scene.path("joined")));
    assert!(whole.len() == 15, "{:?}", listing(&scene.path("whole")));
    for (whole, joined) in whole.iter().zip(&joined) {
        assert_eq!(whole.0, joined.0);
        assert!(whole.1 == joined.1, "{} differs", whole.0);
    }
    assert_eq!(whole.len(), joined.len());
    done(&folder, &["merge", "s1", "s2", "s3", "-o", "drawn", "--png"]);
    let [of_svg, of_png] = ["svg", "png"].map(|end| {
        let with =
            |names: Vec<String>| names.into_iter().filter(|name| name.ends_with(end)).count();
        [with(listing(&scene.path("joined"))), with(listing(&scene.path("drawn")))]
    });
    assert!(of_svg[0] > 0 && of_svg == [of_png[1], 0] && of_png[0] == 0, "{of_svg:?} {of_png:?}");
    // the lamp has the electric power that the scene says
    let lamps = fs::read_to_string(scene.path("whole/lamps.csv")).expect("lamps");
    let kwh: Vec<&str> = lamps.lines().last().expect("a row").split(',').collect();
    assert!(kwh[..2] == ["lamp", "all"] && kwh[3].parse::<f64>().expect("kWh") > 0.0, "{lamps}");

    refused(&folder, &["merge", "s1", "s2", "-o", "out"], &["shard is missing: 3/3"]);
    refused(
        &folder,
        &["merge", "s1", "s2", "s4", "-o", "out"],
        &["s4: is shard 2/3, and so is s2"],
    );
    let other = [&year[2..], &["--photons", "7000", "--shard", "3/3"]].concat();
    done(&folder, &arguments("other", &other));
    refused(&folder, &["merge", "s1", "s2", "other", "-o", "out"], &["a year with other settings"]);
    let bytes = fs::read(scene.path("s3")).expect("a shard");
    fs::write(scene.path("cut"), &bytes[..bytes.len() - 1]).expect("a shard");
    refused(
        &folder,
        &["merge", "s1", "s2", "cut", "-o", "out"],
        &["cut: was cut short or changed"],
    );
    let control = fs::read_to_string(scene.path("control.json")).expect("a control");
    fs::write(scene.path("control.json"), control.replace("60", "50")).expect("a control");
    refused(&folder, &["merge", "s1", "s2", "s3", "-o", "out"], &["of another scene or control"]);
    fs::remove_file(scene.path("control.json")).expect("a control");
    refused(
        &folder,
        &["merge", "s1", "s2", "s3", "-o", "out"],
        &["control.json: a file that the shards"],
    );
    assert!(!scene.path("out").exists());
}

/// A year that is killed goes on from its checkpoint and writes the bytes of one that was not, on
/// another number of threads; then the checkpoint is gone.
#[test]
fn killed_years_go_on() {
    let scene = room();
    let folder = scene.path("");
    let size = || fs::metadata(scene.path("kept")).map_or(0, |kept| kept.len());
    let photons = enough(400_000, |photons| {
        let _ = fs::remove_dir_all(scene.path("out"));
        let photons = photons.to_string();
        let more = ["--photons", &photons, "--checkpoint", "kept"];
        let mut year = start(&folder, &arguments("out", &more).join(" "));
        happens(&mut year, || size() >= 2000);
        kill(year)
    });
    let photons = photons.to_string();
    let photons = ["--photons", &photons];
    done(&folder, &arguments("whole", &photons));
    let kept = [&photons[..], &["--checkpoint", "kept"]].concat();
    let before = size();
    assert!(before >= 2000, "{before}");
    let other = [&["--seed", "9"][..], &kept].concat();
    refused(&folder, &arguments("out", &other), &["kept: is of a year with other settings"]);
    assert_eq!(size(), before);
    done(&folder, &arguments("out", &[&kept[..], &["--threads", "1"]].concat()));
    assert!(!scene.path("kept").exists());
    assert!(tables(&scene.path("whole")) == tables(&scene.path("out")));
    fs::write(scene.path("kept"), "notes").expect("a file");
    refused(&folder, &arguments("out", &kept), &["kept: does not tell of a year"]);
    assert_eq!(fs::read(scene.path("kept")).expect("notes"), b"notes");
    assert!(phylux(&folder, &["year", "--help"]).status.success());
}
