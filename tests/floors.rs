//! The house has floors: a file uses only files on its own floor listed before it, or on floors
//! below.

use std::{collections::HashMap, fs, path::Path};

/// Every file of the library (a folder counts as the file of its name), floor by floor.
const FLOORS: [&[&str]; 8] = [
    &["error", "input", "output", "units", "spectrum", "rng", "stats", "geometry", "sampling"],
    &["bvh", "photon_map", "obj"],
    &["material", "light", "captor", "camera"],
    &["scene", "patches", "tiles"],
    &["settings", "shard", "trace", "estimate", "tally", "simulate", "render", "result"],
    &[
        "captor_csv",
        "json",
        "scene_file",
        "sweep_file",
        "result_file",
        "share_file",
        "chart",
        "picture",
        "exhibit",
        "vtk",
        "glb",
        "ply",
        "view",
    ],
    &["check", "study", "compare", "join", "export", "sweep"],
    &["cli", "lib", "main"],
];

/// Only tests use these.
const TEST_FILES: [&str; 4] = ["fuzz", "odds", "spoil", "tests"];

#[test]
fn files_use_only_what_is_below_them() {
    let rank: HashMap<&str, usize> = FLOORS.iter().flat_map(|f| *f).copied().zip(0..).collect();
    let src = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut seen = 0;
    for (name, text) in sources(&src) {
        if name == "lib" {
            continue;
        }
        let Some(own) = rank.get(name.as_str()) else {
            panic!("src/{name}.rs stands on no floor: add it to this test")
        };
        // not the name of a tests file alone: that may stand above the uses
        let code = text.split("#[cfg(test)]\nmod tests {").next().unwrap_or_default();
        for used in uses(code) {
            let Some(other) = rank.get(used.as_str()) else {
                panic!("{name} uses {used}, which stands on no floor")
            };
            assert!(other <= own, "{name} uses {used}, which stands above it");
            seen += 1;
        }
    }
    assert!(seen > 30, "found only {seen} uses: does the test still read them?");
}

/// Name and text of each file but those of tests; files in a folder under the folder's name.
fn sources(src: &Path) -> Vec<(String, String)> {
    let mut found = Vec::new();
    for entry in fs::read_dir(src).expect("src") {
        let path = entry.expect("an entry of src").path();
        let name = path.file_stem().expect("a name").to_string_lossy().into_owned();
        if ["tests", "fuzz"].contains(&name.as_str()) {
            continue;
        }
        if path.is_dir() {
            found.extend(sources(&path).into_iter().map(|(_, text)| (name.clone(), text)));
        } else if !TEST_FILES.contains(&name.as_str()) {
            found.push((name, fs::read_to_string(&path).expect("a source file")));
        }
    }
    found
}

/// The files that a text names as `crate::file`, also in `use crate::{file, file::...}`.
fn uses(code: &str) -> Vec<String> {
    let mut found = Vec::new();
    for (at, _) in code.match_indices("crate::") {
        let rest = &code[at + "crate::".len()..];
        if let Some(list) = rest.strip_prefix('{') {
            let mut depth = 0;
            let mut word = String::new();
            let mut first = true;
            for c in list.chars() {
                match c {
                    '{' => depth += 1,
                    '}' if depth == 0 => break,
                    '}' => depth -= 1,
                    ',' if depth == 0 => {
                        found.push(std::mem::take(&mut word));
                        first = true;
                        continue;
                    }
                    ':' if depth == 0 => first = false,
                    c if depth == 0 && first && (c.is_alphanumeric() || c == '_') => word.push(c),
                    _ => {}
                }
            }
            found.push(word);
        } else {
            found.push(rest.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect());
        }
    }
    // types at the crate's root, and macros
    found.retain(|name| name.chars().next().is_some_and(char::is_lowercase));
    found
}
