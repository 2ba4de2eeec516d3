//! The figures that README.md and docs/results.md quote from a run are those that the same run finds
//! today, to the last digit that is printed there.
//!
//! The same program finds the same numbers on any x86-64 Linux with glibc (see tests/pinned.rs).
//! Where other systems compute slightly different sines and logarithms, the tests are ignored.

use std::{fs, path::Path};

use serde_json::Value;

use crate::bad_input::phylux;

/// Returns a page of the repository.
fn page(name: &str) -> String {
    fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join(name)).expect(name)
}

/// Runs a command on a shipped scene, with further options that are separated by spaces, and returns
/// what it printed.
fn command(folder: &Path, command: &str, scene: &str, options: &str) -> String {
    let scene = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes").join(scene);
    let mut arguments = vec![command, scene.to_str().expect("a path in UTF-8")];
    arguments.extend(options.split_whitespace());
    let output = phylux(folder, &arguments);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).expect("UTF-8")
}

fn results(folder: &Path) -> Value {
    serde_json::from_slice(&fs::read(folder.join("results.json")).expect("results")).expect("JSON")
}

/// Returns the numbers of a text, as they are written there. A number may have digits, a point and
/// an exponent, and commas between thousands (which are left out).
fn numbers(text: &str) -> Vec<String> {
    let is_of_number = |c: char| c.is_ascii_digit() || matches!(c, '.' | ',');
    let words = text.split(|c: char| !is_of_number(c)).map(|word| word.trim_matches(['.', ',']));
    words.filter(|word| !word.is_empty()).map(|word| word.replace(',', "")).collect()
}

/// Checks that `value`, rounded to as many decimals as `printed` has, is what is printed.
fn check(what: &str, printed: &str, value: &Value) {
    let value = value.as_f64().unwrap_or_else(|| panic!("{what}: the run has no such number"));
    let decimals = printed.split_once('.').map_or(0, |(_, decimals)| decimals.len());
    let now = format!("{value:.decimals$}");
    assert_eq!(printed, now, "{what}: the page says {printed}, the run finds {value}");
}

/// Returns the entry of a list of captors or groups that has this id.
fn entry<'a>(results: &'a Value, list: &str, id: &str) -> &'a Value {
    let entries = results[list].as_array().expect("a list");
    entries.iter().find(|entry| entry["id"] == id).unwrap_or_else(|| panic!("{list}: no {id}"))
}

/// README's greenhouse: the counts in its first lines, its table, the summary and the entry of a
/// captor. The run is the one of README's main command, so nothing here depends on chance.
#[test]
#[cfg_attr(
    not(all(target_arch = "x86_64", target_os = "linux", target_env = "gnu")),
    ignore = "other systems compute slightly different sines and logarithms"
)]
fn readme_quotes_its_own_run() {
    let folder = tempfile::tempdir().expect("a folder");
    let readme = page("README.md");
    let summary = command(folder.path(), "run", "greenhouse.json", "");
    let results = results(folder.path());

    let mut printed = summary.lines();
    let quoted = readme.split_once("A run ends with a summary:").expect("the summary").1;
    let quoted = quoted.lines().skip(1).take_while(|l| l.is_empty() || l.starts_with("    "));
    let quoted: Vec<&str> = quoted.map(str::trim_end).filter(|l| !l.is_empty()).collect();
    assert!(quoted.len() > 8, "{quoted:?}");
    for line in quoted.iter().map(|line| &line[4..]).filter(|line| line.trim() != "...") {
        let found = printed.any(|now| now.trim_end() == line);
        assert!(
            found,
            "README's summary has this line, which the run does not print:\n{line}\n{summary}"
        );
    }

    for (id, faces) in [("canopy-top", 4), ("bench-grid", 4), ("tomato", 6), ("cucumber", 6)] {
        let row = readme.lines().find(|l| l.starts_with('|') && l.contains(&format!("(`{id}`)")));
        let row = row.unwrap_or_else(|| panic!("README's table has no row of {id}"));
        let group = entry(&results, "groups", id);
        let irradiance = |key: &str, band: usize| group["front"][key][band].clone();
        let mut values = vec![group["captors"].clone()];
        for band in 0..2 {
            values.extend([irradiance("irradiance", band), irradiance("irradiance_se", band)]);
        }
        if faces == 6 {
            values.extend([group["absorbed"][0].clone(), group["absorbed"][1].clone()]);
        }
        let cells = row.split_once(&format!("(`{id}`)")).expect("a name");
        let count = numbers(cells.0).pop().expect("a count");
        let printed: Vec<String> = [count].into_iter().chain(numbers(cells.1)).collect();
        assert_eq!(printed.len(), values.len(), "{row}");
        for (printed, value) in printed.iter().zip(&values) {
            check(&format!("README's table, {id}"), printed, value);
        }
    }

    let line = readme.split_once("    {\"id\": \"").expect("the entry of a captor").1;
    let quoted = line.split_once("\n\n").expect("the end of the entry").0;
    let captor = entry(&results, "captors", quoted.split('"').next().expect("an id"));
    check("area", &after(quoted, "area")[0], &captor["area"]);
    check("photons", &after(quoted, "photons")[0], &captor["front"]["photons"]);
    for key in ["flux", "irradiance", "irradiance_se"] {
        for (band, printed) in after(quoted, key).iter().enumerate().take(2) {
            check(key, printed, &captor["front"][key][band]);
        }
    }
    for key in ["k", "radius"] {
        check(key, &after(quoted, key)[0], &captor["front"]["knn"][key]);
    }

    let text = command(folder.path(), "check", "greenhouse.json", "--json");
    let checked: Value = serde_json::from_str(&text).expect("JSON");
    let triangles = checked["surfaces"].as_array().expect("surfaces").iter();
    let triangles: u64 = triangles.filter_map(|s| s["triangles"].as_u64()).sum();
    let plants = |id: &str| entry(&results, "groups", id)["captors"].as_u64().expect("a count");
    // a captor of a plant is a rank of its leaves or its stem
    assert_eq!((plants("tomato") / 8, plants("cucumber") / 9), (24, 12));
    let first = readme.split_once("One command on").expect("the first paragraph").1;
    let first = first.split_once("among them").expect("its end").0;
    let captors = results["captors"].as_array().expect("captors").len();
    let lamps = checked["lights"].as_array().expect("lights").len();
    let fast = format!("{captors} captors of a greenhouse bay with {} plants in less", 24 + 12);
    assert!(readme.replace('\n', " ").contains(&fast), "README's first lines do not say: {fast}");
    let counts = [lamps as u64, 24 + 12, triangles, 4, captors as u64];
    assert_eq!(numbers(first), counts.map(|count| count.to_string()));
    assert_eq!(results["photons"], 4_000_000);
}

/// Returns the numbers that follow a key of a quoted entry, up to the next key.
fn after(quoted: &str, key: &str) -> Vec<String> {
    let rest = quoted.split_once(&format!("\"{key}\":")).unwrap_or_else(|| panic!("no {key}")).1;
    numbers(rest.split('"').next().expect("a value"))
}

/// README's box: what arrives at its walls is what it works out by hand, within 4 standard errors.
/// The seed is the scene's, 1, so the test cannot fail by chance as long as the random numbers are
/// the same.
#[test]
fn the_box_of_readme_is_worked_out_by_hand() {
    let folder = tempfile::tempdir().expect("a folder");
    command(folder.path(), "run", "box.json", "");
    let results = results(folder.path());
    let front = &entry(&results, "groups", "room")["front"];
    let [value, error] = ["irradiance", "irradiance_se"].map(|k| front[k][0].as_f64().expect(k));
    assert!(page("README.md").contains("which is 33.3 W/m2 on average"));
    assert!((value - 100.0 / 3.0).abs() <= 4.0 * error, "{value} ± {error}");
}

/// docs/results.md tells how large results are with and without a split by light. Sizes are the
/// same wherever the bytes are.
#[test]
#[cfg_attr(
    not(all(target_arch = "x86_64", target_os = "linux", target_env = "gnu")),
    ignore = "other systems compute slightly different sines and logarithms"
)]
fn docs_tell_how_large_results_are() {
    let folder = tempfile::tempdir().expect("a folder");
    let docs = page("docs/results.md").replace('\n', " ");
    let sizes = docs.split_once("with its 8 lamps makes").expect("the sentence").1;
    let printed = &numbers(sizes)[..2];
    for (printed, option) in printed.iter().zip(["--by-light", ""]) {
        let options = format!("--photons 2e5 --k 0 {option}");
        command(folder.path(), "run", "greenhouse.json", &options);
        let size = fs::metadata(folder.path().join("results.json")).expect("results").len();
        check(&format!("MB of results {option}"), printed, &Value::from(size as f64 / 1e6));
    }
}
