//! Sliders that choose an hour of the year in the page of `phylux view`.

use super::{number, open, text};
use crate::{bad_input::refused, common::TestScene, rendered::done, year::two_days};
use std::{collections::HashMap, fs};

/// Computes the hours of two days in June, written as CSV.
fn computed() -> TestScene {
    let scene = two_days();
    done(&scene.path(""), &["year", "scene.json", "-o", "year", "--csv", "--photons", "100000"]);
    scene
}

/// For every chosen hour the page shows the values of the table and their errors. Its sliders reach
/// all hours.
#[test]
#[ignore = "needs Chromium"]
fn needs_chromium_hours_and_days_are_chosen_by_sliders() {
    let scene = computed();
    let table = fs::read_to_string(scene.path("year/hours.csv")).expect("the hours");
    let known: HashMap<(String, String), (f64, f64)> = table
        .lines()
        .skip(1)
        .filter(|line| line.starts_with("up,"))
        .flat_map(|line| {
            let cells: Vec<&str> = line.split(',').collect();
            let number = |i: usize| cells[i].parse().expect("a number");
            let time: String = cells[1][..16].into();
            [("PAR", 2), ("far", 4)]
                .map(|(band, i)| ((time.clone(), band.to_string()), (number(i), number(i + 1))))
        })
        .collect();
    assert_eq!(known.len(), 2 * 48);
    let page = open(&scene, &["--year", "year"]);
    assert_eq!(text(&page, "element('day').max + ' ' + element('clock').max"), "1 23");
    assert_eq!(page.evaluate("state.hour >= 0 && !element('timeSection').hidden"), true);
    let mut colours = Vec::new();
    for (day, clock) in [(0, 12), (0, 7), (1, 12), (1, 0)] {
        for (id, value) in [("day", day), ("clock", clock)] {
            page.evaluate(&format!(
                "element('{id}').value = {value}; element('{id}').dispatchEvent(new Event('input')); 0"
            ));
        }
        let time = text(&page, "timeText()");
        assert_eq!(time, format!("2025-06-{} {clock:02}:00", 20 + day));
        assert!(text(&page, "element('unit').textContent").ends_with(&time));
        for (b, band) in ["PAR", "far"].into_iter().enumerate() {
            let (value, error) = known[&(time.replace(' ', "T"), band.to_string())];
            let shown = number(&page, &format!("captorValue(0, FRONT, {b}).value"));
            assert!((shown - value).abs() <= 3e-4 * value, "{time} {band}: {shown} {value}");
            if value > 0.0 {
                let shown = number(&page, &format!("captorValue(0, FRONT, {b}).error"));
                assert!(
                    (shown - error).abs() <= 0.02 * error + 1e-4 * value,
                    "{time}: {shown} {error}"
                );
            }
        }
        colours.push(number(
            &page,
            "valueTexture.image.data[4 * parts.find((p) => p.captor === 0).first]",
        ));
    }
    assert!(colours[0] > colours[1] && colours[2] > 0.0 && colours[3] == 0.0, "{colours:?}");
    // the link restores the hour; without an hour the page shows the mean over all of them again
    let link = text(&page, "linkText()");
    assert!(link.contains("time=2025-06-21+00%3A00"), "{link}");
    page.evaluate("element('byHour').click(); 0");
    assert_eq!(text(&page, "timeText()"), "");
    assert!(number(&page, "captorValue(0, FRONT, 0).value") > 0.0);
    page.evaluate(&format!("history.replaceState(null, '', '#{link}'); readLink(); 0"));
    assert_eq!(text(&page, "linkText()"), link);
    page.no_complaints();
}

/// Hours that are read from Parquet give the same page, byte for byte, as hours that are read from
/// CSV.
#[test]
fn hours_of_parquet_and_of_csv_make_the_same_page() {
    let scene = computed();
    let folder = scene.path("");
    done(&folder, &["year", "scene.json", "-o", "table", "--photons", "100000"]);
    for (year, page) in [("year", "a.html"), ("table", "b.html")] {
        done(&folder, &["view", "scene.json", "--year", year, "-o", page]);
    }
    let page = |name: &str| fs::read(scene.path(name)).expect(name);
    assert!(page("a.html") == page("b.html"), "they differ");
}

#[test]
fn hours_of_another_scene_are_refused() {
    let scene = computed();
    let folder = scene.path("");
    let view = ["view", "scene.json", "--year", "year"];
    refused(&folder, &["view", "scene.json", "--year", "none"], &["none", "phylux year"]);
    let table = fs::read_to_string(scene.path("year/hours.csv")).expect("the hours");
    for (from, to, words) in [
        ("\nup,", "\nother,", &["another scene", "no `up`"][..]),
        ("far_", "near_", &["another scene", "PAR, near"]),
        ("captor,time", "sensor,time", &["no such table of a year"]),
    ] {
        fs::write(scene.path("year/hours.csv"), table.replace(from, to)).expect("written");
        refused(&folder, &view, words);
    }
    fs::write(scene.path("year/hours.parquet"), "PAR1 and nothing else").expect("written");
    refused(&folder, &view, &["hours.parquet", "no such table of a year"]);
}
