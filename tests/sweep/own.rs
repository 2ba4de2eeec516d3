//! The files that a sweep may replace or remove in its folder: only those that it has written
//! itself, and only if they are unchanged.

#![cfg(unix)]

use std::os::unix::fs::symlink;

use super::*;
use crate::bad_input::listing;

const SWEEP: &str = r#"{"scene": "scene.json", "vary": {"/lights/1/position/2": [0.1, 0.2, 0.3]}}"#;
const WIDER: &str =
    r#"{"scene": "scene.json", "vary": {"/lights/1/position/2": [0.1, 0.2, 0.3, 0.4]}}"#;
/// The file name of the plot.
const PLOT: &str = "lights_1_position_2.svg";

fn write(folder: &TestScene, name: &str, content: &str) {
    fs::write(folder.path(name), content).expect("a file");
}

fn read(folder: &TestScene, name: &str) -> String {
    fs::read_to_string(folder.path(name)).expect("a file")
}

/// Asserts that the sweep is refused with these words and that its folder does not change.
fn refused(folder: &TestScene, words: &str) {
    let before = content(&folder.path("out"));
    let output = any(folder, "sweep sweep.json -o out");
    assert_eq!(output.status.code(), Some(2), "{}", stderr(&output));
    assert!(stderr(&output).starts_with(&format!("error: {words}")), "{}", stderr(&output));
    assert!(content(&folder.path("out")) == before, "{words}");
}

/// A sweep that is started again removes and replaces its own tables and plots. All other files
/// stay, also those in `plots/`.
#[test]
fn files_of_others_stay() {
    let folder = folder(SWEEP);
    ok(&folder, "sweep sweep.json -o out");
    write(&folder, "out/plots/mine.svg", "mine");
    write(&folder, "out/notes.txt", "mine");
    write(&folder, "thesis.svg", "mine");
    symlink("../../thesis.svg", folder.path("out/plots/thesis.svg")).expect("a link");
    write(&folder, "sweep.json", WIDER);
    let said = ok(&folder, "sweep sweep.json -o out");
    assert_eq!(said, "4 of 4 runs are done, 3 of them from before; wrote out\n");
    assert_eq!(listing(&folder.path("out/plots")), [PLOT, "mine.svg", "thesis.svg"]);
    assert!(folder.path("out/plots/thesis.svg").is_symlink());
    for name in ["out/plots/mine.svg", "out/notes.txt", "thesis.svg"] {
        assert_eq!(read(&folder, name), "mine", "{name}");
    }
    assert_eq!(read(&folder, "out/runs.csv").lines().count(), 5);

    // the files are those of a folder in which nobody else has written
    ok(&folder, "sweep sweep.json -o clean");
    fs::remove_file(folder.path("out/notes.txt")).expect("removed");
    for name in ["mine.svg", "thesis.svg"] {
        fs::remove_file(folder.path("out/plots").join(name)).expect("removed");
    }
    assert!(differences(&folder.path("out"), &folder.path("clean")).is_empty());
}

/// If a user's file, a changed file or a link is in the place of a table or plot, it is neither
/// removed nor replaced. The sweep is refused until the user has moved it away.
#[test]
fn a_strange_file_in_the_way_is_refused() {
    let folder = folder(SWEEP);
    ok(&folder, "sweep sweep.json -o out");
    let table = read(&folder, "out/captors.csv");
    let not_own = |name: &str| format!("out/{name}: is not what phylux has written there; move");
    for done in [true, false] {
        write(&folder, "sweep.json", if done { SWEEP } else { WIDER });
        write(&folder, "out/captors.csv", "x,y,z,radius,nx,ny,nz\n0,0,1,0.1,0,0,1\n");
        refused(&folder, &not_own("captors.csv"));
        write(&folder, "out/captors.csv", &table);
        let plot = read(&folder, &format!("out/plots/{PLOT}"));
        write(&folder, &format!("out/plots/{PLOT}"), "my own");
        refused(&folder, &not_own(&format!("plots/{PLOT}")));
        write(&folder, &format!("out/plots/{PLOT}"), &plot);
        // a link to an identical table is not the sweep's own table
        fs::rename(folder.path("out/groups.csv"), folder.path("away.csv")).expect("moved");
        symlink("../away.csv", folder.path("out/groups.csv")).expect("a link");
        refused(&folder, "out/groups.csv: is not ");
        fs::remove_file(folder.path("out/groups.csv")).expect("removed");
        fs::rename(folder.path("away.csv"), folder.path("out/groups.csv")).expect("moved");
        let times = read(&folder, "out/times.csv");
        write(&folder, "out/times.csv", "my own\n");
        refused(&folder, "out/times.csv: is no table of times that a sweep has written; move");
        write(&folder, "out/times.csv", &times);
        let record = read(&folder, "out/written.json");
        write(&folder, "out/written.json", "[1]");
        refused(&folder, "out/written.json: does not say what phylux has written");
        write(&folder, "out/written.json", &record);
    }
    ok(&folder, "sweep sweep.json -o out");

    fs::rename(folder.path("out/plots"), folder.path("far")).expect("moved");
    symlink("../far", folder.path("out/plots")).expect("a link");
    refused(&folder, "out/plots: is a link, which no sweep has made; move it away");
    assert_eq!(listing(&folder.path("far")), [PLOT]);
    // a changed record cannot lead the sweep to files outside its folder
    fs::remove_file(folder.path("out/plots")).expect("removed");
    let record = read(&folder, "out/written.json");
    let far = record.replace(&format!("plots/{PLOT}"), &format!("../far/{PLOT}"));
    assert_ne!(record, far);
    write(&folder, "out/written.json", &far);
    ok(&folder, "sweep sweep.json -o out");
    assert_eq!(listing(&folder.path("far")), [PLOT]);
}

/// Files of others stay, whatever their names; those that an interrupted sweep has left are removed.
#[test]
fn temporary_files_of_others_stay() {
    let folder = folder(SWEEP);
    ok(&folder, "sweep sweep.json -o out");
    let left = ["out/.phylux-abcdefABCDEF.unfinished", "out/runs/.phylux-0123456789ab.unfinished"];
    for name in left.iter().chain(&["out/.phylux-abcdef"]) {
        write(&folder, name, "");
    }
    ok(&folder, "sweep sweep.json -o out");
    assert!(folder.path("out/.phylux-abcdef").exists());
    assert!(left.iter().all(|name| !folder.path(name).exists()));
}

/// Returns the paths of the files of runs.
fn runs(folder: &TestScene) -> Vec<String> {
    listing(&folder.path("out/runs")).iter().map(|name| format!("out/runs/{name}")).collect()
}

/// Returns the file of a run as older versions wrote it, without a checksum.
fn unsealed(text: &str) -> String {
    let (body, seal) = text.rsplit_once(",\n  \"sha256\": ").expect("a checksum");
    assert_eq!(seal.len(), 64 + 2 + 3);
    format!("{body}\n}}\n")
}

/// If the file of a run is damaged in any way, the run is done again, and the folder is as before.
#[test]
fn a_damaged_run_is_done_again() {
    let folder = folder(
        r#"{"scene": "scene.json", "vary": {"/materials/wall/reflectance": [0.1, 0.2, 1.5]}}"#,
    );
    assert_eq!(any(&folder, "sweep sweep.json -o out").status.code(), Some(1));
    let whole = content(&folder.path("out"));
    let names = runs(&folder);
    let results = names.iter().find(|name| !name.ends_with(".failed.json")).expect("results");
    let failure = names.iter().find(|name| name.ends_with(".failed.json")).expect("an error");
    let text = read(&folder, results);
    let digit = {
        let at = text.find("\"irradiance\": [").expect("irradiance") + "\"irradiance\": [".len();
        let other = if &text[at..=at] == "1" { "2" } else { "1" };
        format!("{}{other}{}", &text[..at], &text[at + 1..])
    };
    let captors = text.find("\"captors\": [").expect("captors") + "\"captors\": [".len();
    let end = text.rfind("\"groups\"").expect("groups");
    let empty = format!("{}],\n  {}", &text[..captors], &text[end..]);
    serde_json::from_str::<serde_json::Value>(&empty).expect("JSON");
    let key = text.replace("\"irradiance\"", "\"irradianse\"");
    let band = text.replacen("\"irradiance\": [", "\"irradiance\": [], \"was\": [", 1);
    let more = text.clone() + "\n";
    for (what, damaged, file) in [
        ("digit", &digit, results),
        ("empty array", &empty, results),
        ("key", &key, results),
        ("key, no checksum", &unsealed(&key), results),
        ("no band, no checksum", &unsealed(&band), results),
        ("half", &text[..text.len() / 2].to_string(), results),
        ("nothing", &String::new(), results),
        ("a line more", &more, results),
        ("error", &read(&folder, failure).replace("must be", "may be"), failure),
    ] {
        assert_ne!(*damaged, read(&folder, file), "{what}");
        write(&folder, file, damaged);
        let dry = ok(&folder, "sweep sweep.json -o out --dry-run");
        assert_eq!(dry.matches(": damaged, to do\n").count(), 1, "{what}: {dry}");
        let output = any(&folder, "sweep sweep.json -o out");
        assert_eq!(output.status.code(), Some(1), "{what}");
        let said = stderr(&output);
        assert!(
            said.contains("warning: 1 run was done again, whose files were damaged\n"),
            "{said}"
        );
        assert!(content(&folder.path("out")) == whole, "{what}");
    }
}

/// In folders of older versions, the files of runs have no checksum and there is no record of
/// tables. Complete runs are reused. Tables that would be the same stay; others must be moved away
/// by the user.
#[test]
fn folders_of_before_go_on() {
    let folder = folder(SWEEP);
    ok(&folder, "sweep sweep.json -o out");
    let new = content(&folder.path("out"));
    let age = || {
        for name in runs(&folder) {
            write(&folder, &name, &unsealed(&read(&folder, &name)));
        }
        fs::remove_file(folder.path("out/written.json")).expect("removed");
    };
    age();
    let said = ok(&folder, "sweep sweep.json -o out");
    assert_eq!(said, "3 of 3 runs are done, 3 of them from before; wrote out\n");
    let mut again = content(&folder.path("out"));
    for (name, bytes) in &new {
        let again = again.remove(name).expect("a file");
        if name.starts_with("runs/") {
            assert_eq!(again, unsealed(&String::from_utf8_lossy(bytes)).into_bytes());
        } else {
            assert_eq!(again, *bytes, "{name}");
        }
    }
    assert!(again.is_empty());

    fs::remove_file(folder.path("out/written.json")).expect("removed");
    write(&folder, "sweep.json", WIDER);
    refused(&folder, "out/captors.csv: is not what phylux has written there; move it away");
    fs::create_dir(folder.path("old")).expect("a folder");
    for name in listing(&folder.path("out")) {
        if name.ends_with(".csv") && name != "times.csv"
            || name.ends_with(".parquet")
            || name == "plots"
        {
            fs::rename(folder.path("out").join(&name), folder.path("old").join(&name))
                .expect("moved");
        }
    }
    let said = ok(&folder, "sweep sweep.json -o out");
    assert_eq!(said, "4 of 4 runs are done, 3 of them from before; wrote out\n");
}

/// The folders of shards are not written into when they are merged, and a damaged one is named. A
/// shard of an older version has the same results.
#[test]
fn parts_stay_as_they_are() {
    let folder = folder(SWEEP);
    for i in 1..=2 {
        ok(&folder, &format!("sweep sweep.json -o part{i} --shard {i}/2"));
    }
    let parts = || [content(&folder.path("part1")), content(&folder.path("part2"))];
    let before = parts();
    let output = any(&folder, "merge part1 part2 -o ./part1");
    assert_eq!(output.status.code(), Some(2));
    assert!(
        stderr(&output).starts_with("error: part1: is a shard, and so must stay as it is; name")
    );
    assert!(parts() == before);

    let name = format!("part2/runs/{}", listing(&folder.path("part2/runs"))[0]);
    let text = read(&folder, &name);
    write(&folder, &name, &text.replacen("\"photons\": 2", "\"photons\": 3", 1));
    let output = any(&folder, "merge part1 part2 -o all");
    assert_eq!(output.status.code(), Some(2));
    let words = "error: part2: its file of run 2 is damaged; do this shard again";
    assert!(stderr(&output).starts_with(words), "{}", stderr(&output));
    assert!(!folder.path("all").exists());
    ok(&folder, "sweep sweep.json -o part2 --shard 2/2");
    assert!(parts() == before);

    ok(&folder, "sweep sweep.json -o old --shard 2/2");
    let name = format!("old/runs/{}", listing(&folder.path("old/runs"))[0]);
    write(&folder, &name, &unsealed(&text));
    ok(&folder, "merge part1 part2 old -o all");
    ok(&folder, "sweep sweep.json -o whole");
    assert!(differences(&folder.path("all"), &folder.path("whole")).is_empty());
}
