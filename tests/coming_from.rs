//! The cases of docs/coming-from/ and its tables of factors: a page that says "the same number in
//! both" is held to it.

use phylux::transport::{NearestCount, PhotonCount};
use std::{fs, path::Path};

use serde_json::json;

use crate::{
    common::{TestScene, run_file},
    examples::files_of,
};

fn pages() -> Vec<(String, String)> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/coming-from");
    let mut pages: Vec<_> = fs::read_dir(folder)
        .expect("a folder")
        .map(|entry| entry.expect("an entry").path())
        .map(|path| {
            let name = path.file_name().expect("a name").to_string_lossy().into_owned();
            (name, fs::read_to_string(&path).expect("a page"))
        })
        .collect();
    pages.sort();
    pages
}

/// Each number that a page marks as found in a scene is found: within five standard errors and a
/// rounding of 4 digits, with errors of at most 1 %. The number also stands in the words of the page.
#[test]
fn the_numbers_of_the_pages_are_found() {
    let mut found = 0;
    for (page, text) in pages() {
        let files = files_of(&text);
        let marks = text.lines().filter_map(|line| {
            line.strip_prefix("<!-- found in ")?.strip_suffix(" -->")?.split_once(": ")
        });
        let marks: Vec<(&str, &str)> = marks.collect();
        let Some(&(scene, _)) = marks.first() else { continue };
        let content = |name: &str| {
            let found = files.iter().find(|(file, _)| file == name);
            &found.unwrap_or_else(|| panic!("{page}: no file {name}")).1
        };
        let others = files.iter().map(|(name, text)| (name.as_str(), text.as_str()));
        let folder = TestScene::new(content(scene), &others.collect::<Vec<_>>());
        let result = run_file(&folder.path("scene.json"), |settings| {
            settings.photons = settings.photons.or(PhotonCount::new(1_000_000).ok());
            settings.k = Some(NearestCount::NONE);
        });
        for (of, mark) in marks {
            assert_eq!(of, scene, "{page}");
            let words: Vec<&str> = mark.split(' ').collect();
            let [id, quantity, value] = words[..] else { panic!("{page}: {mark}") };
            let captor = result.captors.iter().find(|captor| captor.id == id);
            let captor = captor.unwrap_or_else(|| panic!("{page}: no captor {id}"));
            let (own, error) = match quantity {
                "front" => (captor.front.irradiance[0], captor.front.irradiance_se[0]),
                "flux" => (captor.front.flux[0], captor.front.flux_se[0]),
                "absorbed" => (
                    captor.absorbed.as_ref().expect("a surface")[0] / captor.area,
                    captor.absorbed_se.as_ref().expect("a surface")[0].map(|e| e / captor.area),
                ),
                other => panic!("{page}: no quantity {other}"),
            };
            let (said, error) = (value.parse::<f64>().expect("a number"), error.expect("an error"));
            let close = (own - said).abs() <= 5.0 * error + 1e-3 * said;
            assert!(close && error < 0.01 * said, "{page}: {mark}: {own} +- {error}");
            let whole = value.split('.').next().expect("a number");
            let plain = text.replace(',', "");
            let prose = plain.lines().filter(|line| !line.starts_with("<!--"));
            assert!(prose.clone().any(|line| line.contains(whole)), "{page}: {value} is not said");
            found += 1;
        }
    }
    assert!(found >= 10, "{found}");
}

/// Returns the rows of the table below a heading that begins with these words.
fn table<'a>(text: &'a str, head: &str) -> Vec<Vec<&'a str>> {
    let lines = text.lines().skip_while(|line| !line.starts_with(head)).skip(2);
    let rows = lines.take_while(|line| line.starts_with('|'));
    rows.map(|row| row.trim_matches('|').split('|').map(str::trim).collect()).collect()
}

fn page(name: &str) -> String {
    pages().into_iter().find(|(own, _)| own == name).unwrap_or_else(|| panic!("no {name}")).1
}

/// The factors between lux and PPFD are those of the spectra that phylux has, in bands of 1 nm.
#[test]
fn lux_per_ppfd_is_that_of_the_spectra() {
    let text = page("lux.md");
    let rows = table(&text, "| spectrum |");
    let bands: Vec<_> = (380..780)
        .map(|nm| json!({ "name": format!("{nm}"), "from_nm": nm, "to_nm": nm + 1 }))
        .collect();
    let names: Vec<&str> = rows.iter().map(|row| row[0].trim_matches('`')).collect();
    let lights = names.iter().map(|name| {
        json!({ "name": name, "type": "point", "position": [0, 0, 1],
            "power": { "spectrum": name, "total": 1, "from_nm": 400, "to_nm": 700 } })
    });
    let scene = json!({ "quantity": "umol/s", "bands": bands, "sums": { "lux": "photopic", "PPF": "PPF" },
        "lights": lights.collect::<Vec<_>>() });
    let folder = TestScene::new(&scene.to_string(), &[]);
    let loaded = phylux::load(&folder.path("scene.json")).unwrap_or_else(|e| panic!("{e}"));
    for (light, row) in loaded.scene.lights().iter().zip(&rows) {
        let powers = loaded.scene.with_sums(&light.power);
        // the sums stand behind the bands: lux, PPF
        let factor = powers[powers.len() - 2] / powers[powers.len() - 1];
        for (cell, value) in [(row[1], factor), (row[2], 1000.0 / factor)] {
            let said: f64 = cell.parse().unwrap_or_else(|_| panic!("{}: {value:.4}", light.name));
            assert!((said / value - 1.0).abs() < 0.006, "{}: {said} {value:.4}", light.name);
        }
    }
    assert!(rows.len() >= 20, "{}", rows.len());
}

/// The exponents of beam angles halve the intensity where they say.
#[test]
fn beam_angles_are_those_of_their_cosines() {
    let text = page("beam-angle.md");
    let rows = table(&text, "| beam angle |");
    for row in &rows {
        let angle: f64 = row[0].trim_end_matches('°').parse().expect("an angle");
        let n: f64 = row[1].parse().expect("a number");
        let half = (0.5 * angle).to_radians().cos().powf(n);
        assert!((half - 0.5).abs() < 2e-3, "{angle} {n} {half}");
    }
    assert_eq!(rows.len(), 6);
    // the other angles of the page
    let field = |n: f64| 2.0 * 0.1_f64.powf(1.0 / n).acos().to_degrees();
    assert!((field(1.0) - 168.5).abs() < 0.05 && (field(4.82) - 103.3).abs() < 0.1);
    let inside = 1.0 - 30.0_f64.to_radians().cos().powf(5.82);
    assert!((inside - 0.57).abs() < 0.01, "{inside}");
}

/// A page leads from the terms of the other program to ours, and says what differs.
#[test]
fn each_page_of_a_program_has_terms_and_differences() {
    let programs = ["caribu.md", "helios.md", "spice.md", "radiance.md", "mitsuba.md", "dialux.md"];
    for name in programs {
        let text = page(name);
        for heading in ["## The same ", "## Terms and units", "## What differs, and why"] {
            assert!(text.contains(heading), "{name}: {heading}");
        }
        assert!(text.contains("<!-- found in "), "{name}");
    }
}
