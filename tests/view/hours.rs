//! Sliders that choose an hour of the year in the page of `phylux view`.

use super::{chromium::Page, number, open, text};
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
    choose(&page, "step", "all");
    assert_eq!(text(&page, "timeText()"), "");
    assert!(number(&page, "captorValue(0, FRONT, 0).value") > 0.0);
    page.evaluate(&format!("history.replaceState(null, '', '#{link}'); readLink(); 0"));
    assert_eq!(text(&page, "linkText()"), link);
    page.no_complaints();
}

fn choose(page: &Page, id: &str, value: &str) {
    page.evaluate(&format!(
        "element('{id}').value = '{value}'; element('{id}').dispatchEvent(new Event('change')); 0"
    ));
}

/// Days and months show the daily light integrals of the tables, in their unit. Bands that have none
/// say so.
#[test]
#[ignore = "needs Chromium"]
fn needs_chromium_days_and_months_show_the_daily_light_integral() {
    let scene = computed();
    let page = open(&scene, &["--year", "year"]);
    for (step, table) in [("days", "days.csv"), ("months", "months.csv")] {
        choose(&page, "step", step);
        let text_of = fs::read_to_string(scene.path(&format!("year/{table}"))).expect(table);
        let mut rows = csv::Reader::from_reader(text_of.as_bytes());
        let head = rows.headers().expect("a heading").clone();
        let column = |name: &str| head.iter().position(|own| own == name).expect(name);
        let mut seen = 0;
        for row in rows.records() {
            let row = row.expect("a row");
            if &row[0] != "up" {
                continue;
            }
            seen += 1;
            page.evaluate(&format!("readTime('{}'); showTime(false); 0", &row[1]));
            assert_eq!(text(&page, "timeText()"), row[1]);
            for (part, name) in [("value", "PAR_front"), ("error", "PAR_front_se")] {
                let known: f64 = row[column(name)].parse().expect("a number");
                let shown = number(&page, &format!("captorValue(0, FRONT, 0).{part}"));
                let near = if part == "value" { 3e-4 } else { 0.03 };
                assert!((shown / known - 1.0).abs() < near, "{step} {part}: {shown} {known}");
            }
        }
        assert!(seen > 0);
        let unit = text(&page, "element('unit').textContent");
        assert!(unit.starts_with("daily light integral, PAR, mol/m²/d, 2025-06"), "{unit}");
    }
    // far-red has no daily light integral
    page.evaluate("state.band = 1; repaint(true); 0");
    let unit = text(&page, "element('unit').textContent");
    assert!(unit.contains("has no daily light integral"), "{unit}");
    page.no_complaints();
}

/// The year plays from time to time and stops; the course of the captor that was clicked follows,
/// with a mark at the time that is shown, and a click on it chooses another.
#[test]
#[ignore = "needs Chromium"]
fn needs_chromium_the_year_plays_with_the_course_of_a_captor() {
    let page = open(&computed(), &["--year", "year"]);
    assert_eq!(page.evaluate("element('course').hidden"), true);
    page.evaluate("list(parts.find((p) => p.captor === 0).first); readTime('2025-06-20 08:00'); showTime(true); 0");
    assert_eq!(page.evaluate("element('course').hidden"), false);
    assert_eq!(text(&page, "element('courseName').textContent"), "up");
    let told = || text(&page, "element('courseText').textContent");
    assert!(told().starts_with("2025-06-20, PAR, µmol/m²/s: "), "{}", told());
    let drawn = "(() => { const c = element('courseChart'), d = c.getContext('2d').getImageData(0, 0, c.width, c.height).data;
        let line = 0; for (let i = 0; i < d.length; i += 4) line += d[i + 3] > 200 && d[i + 2] > d[i] + 60; return line; })()";
    assert!(number(&page, drawn) > 200.0, "no course");
    let before = told();
    page.evaluate("element('play').click(); 0");
    page.wait_for("timeText() > '2025-06-20 11:00'");
    assert_eq!(text(&page, "element('play').getAttribute('aria-pressed')"), "true");
    page.key("Escape", 27);
    assert_eq!(text(&page, "element('play').getAttribute('aria-pressed')"), "false");
    assert_ne!(told(), before);
    // dark hours are left out: after the last hour with light comes the first of the next day
    page.evaluate(
        "state.hour = [...series().slots].findLast((slot) => slot < 24); playYear(); stopYear(); 0",
    );
    let time = text(&page, "timeText()");
    assert!(("2025-06-21 02:00".."2025-06-21 08:00").contains(&time.as_str()), "{time}");
    page.evaluate(
        "const box = element('courseChart').getBoundingClientRect();
         element('courseChart').dispatchEvent(new PointerEvent('pointerdown', { clientX: box.left + 0.55 * box.width, clientY: box.top + 20, buttons: 1 })); 0",
    );
    let time = text(&page, "timeText()");
    assert!(("2025-06-21 10:00".."2025-06-21 15:00").contains(&time.as_str()), "{time}");
    page.evaluate("element('closeCourse').click(); 0");
    assert_eq!(page.evaluate("element('course').hidden"), true);
    page.no_complaints();
}

/// A folder whose hours are those of groups alone, or of none, makes a page too: its days are those
/// of all captors.
#[test]
fn hours_may_be_left_out() {
    let scene = two_days();
    let folder = scene.path("");
    for (hours, name) in [("none", "a"), ("groups", "b")] {
        let year = ["year", "scene.json", "-o", name, "--csv", "--photons", "20000"];
        done(&folder, &[&year[..], &["--hours", hours]].concat());
        let page = format!("{name}.html");
        done(&folder, &["view", "scene.json", "--year", name, "-o", &page]);
        let html = fs::read_to_string(scene.path(&page)).expect("the page");
        assert!(html.contains("id=\"dayValues\"") && html.contains("id=\"monthValues\""), "{name}");
        assert!(!html.contains("id=\"hourValues\"") || hours == "groups");
    }
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
        ("\nup,", "\nother,", &["another scene", "it has `other`"][..]),
        ("far_", "near_", &["another scene", "PAR, near"]),
        ("captor,time", "sensor,time", &["no such table of a year"]),
    ] {
        fs::write(scene.path("year/hours.csv"), table.replace(from, to)).expect("written");
        refused(&folder, &view, words);
    }
    fs::write(scene.path("year/hours.parquet"), "PAR1 and nothing else").expect("written");
    refused(&folder, &view, &["hours.parquet", "no such table of a year"]);
}
