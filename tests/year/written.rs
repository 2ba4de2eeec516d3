//! What a year writes for other programs: results of months, and plots of its folder.

use std::fs;

use super::leaves::leaves_in_a_room;
use crate::{
    bad_input::{phylux, refused},
    rendered::done,
    world::front,
};

/// Results of a month are those of a run: their daily light integral and what leaves absorb are
/// those of the table of months, groups are means, and `plot` and `view` read them.
#[test]
fn months_are_results_too() {
    let scene = leaves_in_a_room()
        .with("quantity", serde_json::json!("umol/s"))
        .with("bands", serde_json::json!([{ "name": "all", "from_nm": 400, "to_nm": 700 }]))
        .write();
    let folder = scene.path("");
    done(&folder, &["year", "scene.json", "-o", "y", "--photons", "200000", "--results", "--csv"]);
    let result =
        phylux::formats::read_json(&scene.path("y/results-2025-06.json")).expect("results");
    assert_eq!(result.period_h, Some(48.0));
    let table = fs::read_to_string(scene.path("y/months.csv")).expect("months");
    let heads: Vec<&str> = table.lines().next().expect("a head").split(',').collect();
    let cell = |id: &str, name: &str| -> f64 {
        let at = heads.iter().position(|head| *head == name).expect("a column");
        let row = table.lines().find(|line| line.starts_with(&format!("{id},"))).expect("a row");
        row.split(',').nth(at).expect("a cell").parse().expect("a number")
    };
    let close = |a: f64, b: f64| (a - b).abs() < 1e-5 * b.abs();
    for id in ["small", "large", "both"] {
        let group = result.groups.iter().find(|group| group.id == id).expect("a group");
        let dli = group.front.dli.as_ref().expect("integrals")[0].expect("one");
        assert!(close(dli, cell(id, "all_front")), "{id}: {dli}");
        let error = group.front.dli_se.as_ref().expect("errors")[0].expect("one");
        assert!(close(error, cell(id, "all_front_se")), "{id}: {error}");
        let absorbed = group.absorbed.as_ref().expect("leaves")[0] / group.area;
        assert!(close(0.0864 * absorbed, cell(id, "all_absorbed")), "{id}: {absorbed}");
        assert!(close(group.front.flux[0], group.area * group.front.irradiance[0]));
    }
    let both = front(&result, "both");
    assert!(close(0.0864 * both.irradiance[0], cell("both", "all_front")));
    assert!(both.min.as_ref().expect("a least")[0] < both.max.as_ref().expect("a most")[0]);
    assert!(result.energy.power[0] > 0.0 && both.flux[0] > 0.0);
    done(&folder, &["view", "scene.json", "--results", "y/results-all.json", "--no-trace"]);
    done(&folder, &["plot", "y/results-all.json", "--show", "profile", "-o", "profile.svg"]);
}

/// Every plot of a year draws what the tables hold, from Parquet as from CSV; what is not there, or
/// makes no sense, has its sentence.
#[test]
fn folders_of_years_are_plotted() {
    let scene = leaves_in_a_room().write();
    let folder = scene.path("");
    done(&folder, &["year", "scene.json", "-o", "y", "--photons", "3000", "--results"]);
    done(&folder, &["year", "scene.json", "-o", "c", "--photons", "3000", "--csv"]);
    for (show, texts) in [
        ("months", &["daily light integral", "both", "MJ/m²/d"][..]),
        ("carpet", &["hour of the day", "both", "W/m²", "20 Jun"]),
        ("day", &["hour of the day", "2025-06-2", "W/m²"]),
    ] {
        for (year, output) in [("y", "y.svg"), ("c", "c.svg")] {
            done(&folder, &["plot", year, "--show", show, "-o", output]);
        }
        let svg = fs::read_to_string(scene.path("y.svg")).expect("a plot");
        assert!(texts.iter().all(|text| svg.contains(text)), "{show}: {svg}");
        assert!(svg == fs::read_to_string(scene.path("c.svg")).expect("a plot"), "{show}");
    }
    // a single day is drawn by its hours, if nothing else is asked for
    let days = fs::read_to_string(scene.path("c/days.csv")).expect("days");
    let one: Vec<&str> = days.lines().filter(|line| !line.contains("2025-06-21")).collect();
    assert!(one.len() > 1 && one.len() < days.lines().count());
    fs::write(scene.path("c/days.csv"), one.join("\n") + "\n").expect("written");
    done(&folder, &["plot", "c", "-o", "one.svg"]);
    let svg = fs::read_to_string(scene.path("one.svg")).expect("a plot");
    assert!(svg.contains("hour of the day") && svg.contains(" on 2025-06-2"), "{svg}");
    // beside the 64 colours of the bar each day has hours in the dark, in the light and in the dark
    let rectangles = |svg: &str| svg.matches("<rect").count();
    let carpets = ["plot", "y", "--show", "carpet", "--quantity", "absorbed", "--captors", "*"];
    done(&folder, &[&carpets[..], &["-o", "a.svg"]].concat());
    let absorbed = fs::read_to_string(scene.path("a.svg")).expect("a plot");
    assert!(rectangles(&absorbed) > 64 + 3 * 2 * 3 - 1, "{}", rectangles(&absorbed));
    done(
        &folder,
        &["plot", "y", "--show", "day", "--day", "2025-06-21", "--captors", "s*", "-o", "d.png"],
    );
    done(&folder, &["plot", "y", "--show", "profile", "--month", "2025-06", "-o", "p.svg"]);
    let refuse = |line: &str, words: &[&str]| {
        let arguments: Vec<&str> = ["plot"].into_iter().chain(line.split(' ')).collect();
        refused(&folder, &arguments, words);
    };
    refuse("scene.json --show carpet", &["scene.json: is no folder of a year"]);
    refuse(
        "y --show day --day 2025-07-01",
        &["--day: the year has no day `2025-07-01`", "2025-06-20 to 2025-06-21"],
    );
    refuse("y --show profile --month 2025-07", &["holds no results-2025-07.json", "--results"]);
    refuse("y --band far", &["--band", "no band or sum `far`; there are all"]);
    refuse("y --captors tulip", &["--captors: no captor or group `tulip`"]);
    refuse("y --quantity back --captors s0", &["no captor or group `s0` with light of `back`"]);
    refuse("y --show months --range 0:1", &["--range: has no meaning here"]);
    refuse("y --month 2025-06", &["--month: has no meaning here"]);
    fs::create_dir(scene.path("empty")).expect("a folder");
    refuse("empty", &["empty/year.json", "name the folder that `phylux year` has written"]);
    let facts = fs::read(scene.path("y/year.json")).expect("facts");
    fs::write(scene.path("c/year.json"), &facts[..facts.len() / 2]).expect("facts");
    refuse("c", &["c/year.json: does not tell of a year"]);
    assert!(phylux(&folder, &["plot", "y", "-o", "-"]).stdout.starts_with(b"<svg"));
}

/// Warnings about the files of a scene are in the results of its year, and are said once.
#[test]
fn warnings_about_files_are_in_results() {
    let pane = "mtllib pane.mtl\nv 1 1 2\nv 2 1 2\nv 2 2 2\nusemtl glass\nf 1 2 3\n";
    let scene = leaves_in_a_room()
        .with_file("pane.obj", pane)
        .with_file("pane.mtl", "newmtl glass\nKd 0.5 0.5 0.5\nd 0.5\n")
        .edited(|scene| {
            let pane = serde_json::json!({ "name": "pane", "obj": "pane.obj", "material": "leaf" });
            scene["objects"].as_array_mut().expect("objects").push(pane);
        })
        .write();
    let line = ["year", "scene.json", "-o", "y", "--photons", "3000", "--results"];
    let output = phylux(&scene.path(""), &line);
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success(), "{said}");
    assert_eq!(said.matches("its MTL says `d 0.5`").count(), 1, "{said}");
    for name in ["y/results-2025-06.json", "y/results-all.json"] {
        let result = phylux::formats::read_json(&scene.path(name)).expect("results");
        let first = &result.warnings[0];
        assert!(first.contains("its MTL says `d 0.5`"), "{name}: {:?}", result.warnings);
    }
}
