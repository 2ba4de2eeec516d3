//! Pinned results of three small runs of shipped scenes, so that no change moves results unnoticed.
//!
//! The same program writes the same bytes on any x86-64 Linux with glibc. On such systems the
//! SHA-256 of each result file is compared with the one in tests/pinned/. Other systems compute
//! slightly different sines and logarithms, which send a few photons another way. On all systems,
//! the values of all groups must be within 4 of their standard errors. After a change that is meant
//! to move results
//!
//!     PHYLUX_PIN=1 cargo test --test main pinned
//!
//! writes the files anew, and CHANGELOG.md must say what moved and why.

use std::{env, fmt::Write, fs, path::Path};

use serde_json::Value;
use sha2::{Digest, Sha256};

use crate::bad_input::phylux;

/// Runs a shipped scene and compares its results with the pinned ones. The seed is 1, as the scenes
/// state it. As long as the random numbers are the same, the comparison of values cannot fail by
/// chance.
fn compare(name: &str, scene: &str, options: &str) {
    let folder = tempfile::tempdir().expect("a folder");
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let path = root.join("scenes").join(scene);
    let mut arguments = vec!["run", path.to_str().expect("a path in UTF-8")];
    arguments.extend(options.split(' '));
    let output = phylux(folder.path(), &arguments);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let text = fs::read_to_string(folder.path().join("results.json")).expect("results");
    let found = Pin::of(&text);
    let path = root.join(format!("tests/pinned/{name}.txt"));
    if env::var_os("PHYLUX_PIN").is_some() {
        fs::write(&path, found.text()).expect("written");
        return;
    }
    let pinned = Pin::read(&fs::read_to_string(&path).expect("a pin"));
    let pinned_bytes = cfg!(all(target_arch = "x86_64", target_os = "linux", target_env = "gnu"));
    let moved = found.far_from(&pinned);
    assert!(
        moved.is_empty() && (!pinned_bytes || found.sha256 == pinned.sha256),
        "the results of `phylux run scenes/{scene} {options}` have moved. Values beyond 4 standard errors: {}.\n\
         If this is not meant, it is a fault. If it is, run\n\n    \
         PHYLUX_PIN=1 cargo test --test main pinned\n\ncommit tests/pinned/, and say in CHANGELOG.md what \
         moved and why.",
        if moved.is_empty() { "none".into() } else { moved.join("; ") },
    );
}

/// The part of a result file that is pinned.
struct Pin {
    /// The SHA-256 of the file without the program's version.
    sha256: String,
    values: Vec<Pinned>,
}

/// A value of a group.
struct Pinned {
    what: String,
    value: f64,
    /// The standard error; 0 where it is not known.
    standard_error: f64,
}

impl Pin {
    fn of(text: &str) -> Self {
        let results: Value = serde_json::from_str(text).expect("JSON");
        let version = results["phylux"].as_str().expect("a version");
        let hash = Sha256::digest(text.replacen(version, "", 1));
        let sha256 = hash.iter().fold(String::new(), |hex, byte| format!("{hex}{byte:02x}"));
        let mut values = Vec::new();
        for group in results["groups"].as_array().expect("groups") {
            let faces = ["front", "back"].map(|face| (face, &group[face]["irradiance"]));
            let errors = ["front", "back"].map(|face| &group[face]["irradiance_se"]);
            let rows = faces.into_iter().zip(errors);
            let absorbed = (("absorbed", &group["absorbed"]), &group["absorbed_se"]);
            for ((what, row), errors) in rows.chain([absorbed]) {
                for (b, value) in row.as_array().into_iter().flatten().enumerate() {
                    values.push(Pinned {
                        what: format!("{} {what} {b}", group["id"].as_str().expect("an id")),
                        value: value.as_f64().expect("a number"),
                        standard_error: errors[b].as_f64().unwrap_or(0.0),
                    });
                }
            }
        }
        Self { sha256, values }
    }

    /// Writes the hash, then a line for each value with the value, its standard error and its name.
    fn text(&self) -> String {
        let mut text = format!("{}\n", self.sha256);
        for Pinned { what, value, standard_error } in &self.values {
            writeln!(text, "{value:.5e} {standard_error:.1e} {what}").expect("to memory");
        }
        text
    }

    fn read(text: &str) -> Self {
        let (sha256, lines) = text.split_once('\n').expect("a hash");
        let row = |line: &str| {
            let mut words = line.splitn(3, ' ');
            let mut word = || words.next().expect("three words");
            let (value, error) = (word(), word());
            let number = |word: &str| word.parse().expect("a number");
            Pinned { what: word().into(), value: number(value), standard_error: number(error) }
        };
        Self { sha256: sha256.into(), values: lines.lines().map(row).collect() }
    }

    /// Returns the values that differ by more than 4 standard errors, or one entry if the names of
    /// the values differ.
    fn far_from(&self, other: &Self) -> Vec<String> {
        let names = |pin: &Self| pin.values.iter().map(|row| row.what.clone()).collect::<Vec<_>>();
        if names(self) != names(other) {
            return vec!["other groups or bands than before".into()];
        }
        let pairs = self.values.iter().zip(&other.values);
        let far = pairs.filter(|(a, b)| {
            let rounding = 1e-5 * b.value.abs();
            let within = (a.value - b.value).abs() <= 4.0 * b.standard_error + rounding;
            !within
        });
        far.map(|(a, b)| format!("{}: {}, was {}", a.what, a.value, b.value)).collect()
    }
}

/// A run with few photons and the default k.
#[test]
fn box_by_photons() {
    compare("box", "box.json", "--photons 20000");
}

/// A run of a scene with leaves, a mirror, glass, water and sums of bands, with the 20 nearest
/// photons.
#[test]
fn growth_chamber_by_photons() {
    compare("growth-chamber", "growth-chamber.json", "--photons 20000 --k 20");
}

/// A run with the smallest possible number of paths: 100 from each face.
#[test]
fn greenhouse_by_paths() {
    compare("greenhouse", "greenhouse.json", "--photons 80400 --estimator paths");
}

/// A value that moved by more than 4 standard errors is found, and so is one that is missing.
#[test]
fn moved_values_are_found() {
    let pin = |rows: &[&str]| Pin::read(&format!("0\n{}\n", rows.join("\n")));
    let old = pin(&["2e0 1e-1 room front 0", "0e0 0e0 room back 0"]);
    let far = |rows: &[&str]| pin(rows).far_from(&old).len();
    assert_eq!(far(&["2.39e0 1e-1 room front 0", "0e0 0e0 room back 0"]), 0);
    assert_eq!(far(&["2.41e0 1e-1 room front 0", "0e0 0e0 room back 0"]), 1);
    assert_eq!(far(&["2.41e0 1e-1 room front 0", "1e-9 0e0 room back 0"]), 2);
    assert_eq!(far(&["2e0 1e-1 room front 0"]), 1);
    assert_eq!(Pin::read(&old.text()).far_from(&old).len(), 0);
}
