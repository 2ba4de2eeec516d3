//! Years from the light of another one: the same bytes as anew, without tracing anything.

use std::{fs, path::Path};

use serde_json::{Value, json};

use super::shards::{arguments, room, tables};
use crate::{
    bad_input::{phylux, refused},
    rendered::done,
};

fn write_control(folder: &Path, name: &str, change: impl FnOnce(&mut Value)) {
    let text = fs::read_to_string(folder.join("control.json")).expect("control.json");
    let mut control: Value = serde_json::from_str(&text).expect("JSON");
    change(&mut control);
    fs::write(folder.join(name), control.to_string()).expect("a control file");
}

/// Another control of the lamps gives the bytes of that year run anew, with states, too, and with
/// other tables; the folder that the light comes from stays as it is.
#[test]
fn another_control_takes_the_light_of_a_year() {
    let scene = room();
    let folder = scene.path("");
    done(&folder, &arguments("first", &["--photons", "6000", "--hours", "s*"]));
    let before = tables(&scene.path("first"));
    write_control(&folder, "other.json", |control| {
        control["lamps"] = json!([{ "lights": "lamp", "fill_day": 3, "of": "both", "band": "all",
                                    "hours": [3, 21], "watts": 70 }]);
    });
    let other = ["year", "scene.json", "--control", "other.json"];
    let tables_of = |more: &[&str], output: &str| {
        done(&folder, &[&other[..], more, &["-o", output, "--results", "--csv"]].concat());
        tables(&scene.path(output))
    };
    let anew = tables_of(&["--photons", "6000"], "anew");
    let from = tables_of(&["--from", "first"], "from");
    let names = |of: &[(String, Vec<u8>)]| of.iter().map(|f| f.0.clone()).collect::<Vec<_>>();
    assert_eq!(names(&anew), names(&from));
    for (anew, from) in anew.iter().zip(&from) {
        assert!(anew.1 == from.1, "{} differs", anew.0);
    }
    assert!(tables(&scene.path("first")) == before);
    // and once more from there, back to the first control
    done(&folder, &arguments("again", &["--from", "from", "--hours", "s*"]));
    assert!(tables(&scene.path("again")) == before);
    // into its own folder nothing is written
    refused(
        &folder,
        &arguments("first", &["--from", "first"]),
        &["the folder that the light comes"],
    );
    assert!(tables(&scene.path("first")) == before);
}

/// What the light does not fit is refused: other states, another scene, settings beside it, folders
/// without a year or without its light.
#[test]
fn other_light_is_refused() {
    let scene = room();
    let folder = scene.path("");
    done(&folder, &arguments("first", &["--photons", "6000", "--hours", "none"]));
    let from = ["--from", "first"];
    write_control(&folder, "states.json", |control| {
        control["states"][0]["hours"] = json!([16, 24]);
    });
    let states = ["year", "scene.json", "--control", "states.json", "-o", "x"];
    let words = ["light.work: is of another scene or control", "leave out --from"];
    refused(&folder, &[&states[..], &from].concat(), &words);
    refused(&folder, &[&["year", "scene.json", "-o", "x"][..], &from].concat(), &words);
    for (option, value) in [("--photons", "6000"), ("--seed", "2"), ("--shard", "1/2")] {
        let output = phylux(&folder, &arguments("x", &["--from", "first", option, value]));
        let error = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(
            output.status.code() == Some(2) && error.contains("cannot be used with"),
            "{error}"
        );
    }
    refused(&folder, &arguments("x", &["--from", "nowhere"]), &["nowhere: holds no year"]);
    let light = fs::read(scene.path("first/light.work")).expect("the light");
    fs::write(scene.path("first/light.work"), &light[..light.len() - 9]).expect("a part of it");
    refused(&folder, &arguments("x", &from), &["light.work: was cut short or changed"]);
    fs::remove_file(scene.path("first/light.work")).expect("the light");
    refused(&folder, &arguments("x", &from), &["first: holds no light.work", "--keep-light"]);
    let text = fs::read_to_string(scene.path("scene.json")).expect("the scene");
    fs::write(scene.path("first/light.work"), &light).expect("the light");
    fs::write(scene.path("scene.json"), text.replace("400", "401")).expect("another scene");
    refused(&folder, &arguments("x", &from), &["is of another scene"]);
    assert!(!scene.path("x").exists());
}
