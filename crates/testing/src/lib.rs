//! Damaged text files for property tests: valid files in which words, bytes and lines were changed.

use std::{fmt::Debug, path::Path};

use proptest::{
    collection::vec,
    prelude::*,
    sample::{Index, select},
};

use phylux_core::{
    error::Error,
    transport::{
        settings::{PhotonCount, Settings, ThreadCount},
        simulate::{Control, simulate},
    },
};
use phylux_files::{
    json,
    scene_file::{LoadedScene, load_value},
};
use phylux_results::result::RunResult;

/// A scene with a leaf and a sensor below two lamps.
pub const SCENE: &str = r#"{"bands": [{"name": "a", "from_nm": 400, "to_nm": 500}, {"name": "b", "from_nm": 500, "to_nm": 600}],
    "sums": {"ab": ["a", "b"]},
    "materials": {"green": {"type": "lambert", "reflectance": [0.1, 0.5]}},
    "objects": [{"name": "leaf", "obj": "leaf.obj", "material": "green", "captor": true, "group": "g"}],
    "lights": [{"name": "l1", "type": "point", "position": [0.2, 0.2, 0.6], "power": [1, 2]},
        {"name": "l2", "type": "point", "position": [0.1, 0.1, 0.5], "power": 3}],
    "captors": [{"name": "s", "disc": {"center": [0.2, 0.2, 0.3], "normal": [0, 0, 1], "radius": 0.1},
        "sides": "both", "group": "g"}]}"#;

/// The mesh that [`SCENE`] names `leaf.obj`.
pub const LEAF: &str = "v 0 0 0\nv 0.4 0 0\nv 0.4 0.4 0\nv 0 0.4 0\nf 1 2 3 4\n";

/// Loads [`SCENE`], without any file.
pub fn small_scene() -> LoadedScene {
    let value = json::parse("scene.json", SCENE.as_bytes()).expect("JSON");
    let read = |_: &Path| Ok(LEAF.as_bytes().to_vec());
    load_value(value, Path::new("scene.json"), &read, None).unwrap_or_else(|e| panic!("{e}"))
}

/// Runs [`SCENE`] with few photons and returns the results.
pub fn small_run(settings: Settings) -> RunResult {
    let scene = small_scene().scene;
    let settings =
        Settings { photons: PhotonCount::new(256).ok(), threads: ThreadCount::ONE, ..settings };
    let control = Control::default();
    let simulation = simulate(&scene, &settings, &control).unwrap_or_else(|e| panic!("{e}"));
    RunResult::new(&simulation)
}

/// Panics if an error does not begin with its place, or is not a readable sentence of moderate
/// length.
pub fn check_error(error: &Error, place: &Path) {
    let sentence = error.to_string();
    assert!(sentence.starts_with(&place.display().to_string()), "{sentence}");
    assert!(!sentence.contains(char::is_control), "{sentence:?}");
    assert!(sentence.len() < 3000, "{sentence}");
}

/// Panics if a number in `value` is not finite.
pub fn check_finite(value: &impl Debug) {
    let text = format!("{value:?}");
    // names may contain anything
    let unquoted = text.replace("\\\\", "").replace("\\\"", "");
    for part in unquoted.split('"').step_by(2) {
        let mut words = part.split(|c: char| !c.is_alphanumeric());
        assert!(words.all(|word| !["inf", "NaN"].contains(&word)), "{text}");
    }
}

/// Words that readers may fail on, wherever they stand.
#[rustfmt::skip]
const WORDS: [&str; 40] = [
    "nan", "inf", "-inf", "0", "-0", "1", "-1", "2", "-3", "4e9", "4000000000", "1e999", "1e308", "-1e200",
    "1e-320", "99999999999999999999", "-9223372036854775808", "0x1", "1,5", "+2", "/", "//", "1/", "1//2",
    "1/2/3/4", "-1/9/9", "#", "\\", "\\\n", "\n", "\r\n", "\t", "\"", ",", ";", "", "\u{fffd}", "ü", "\0", "f",
];

/// Generates one of `files` after up to seven changes; `words` are typical of its format.
pub fn spoiled(
    files: &'static [&'static str],
    words: &'static [&'static str],
) -> impl Strategy<Value = Vec<u8>> {
    let word = prop_oneof![select(&WORDS[..]), select(words)];
    let change = (0..9u8, any::<Index>(), any::<Index>(), word, any::<u8>());
    (select(files), vec(change, 0..8)).prop_map(|(file, changes)| {
        let mut text = file.as_bytes().to_vec();
        for (kind, here, there, word, byte) in changes {
            change_text(&mut text, kind, (here, there), word, byte);
        }
        text
    })
}

fn change_text(text: &mut Vec<u8>, kind: u8, at: (Index, Index), word: &str, byte: u8) {
    let pieces = |blanks: &[u8]| -> Vec<Vec<u8>> {
        text.split_inclusive(|b| blanks.contains(b)).map(<[u8]>::to_vec).collect()
    };
    let mut parts = if kind < 3 { pieces(b" \t\n/,") } else { pieces(b"\n") };
    if parts.is_empty() {
        return text.extend_from_slice(word.as_bytes());
    }
    let (i, j) = (at.0.index(parts.len()), at.1.index(parts.len()));
    match kind {
        // replaces a word, keeping the separator after it
        0 | 1 => {
            let end = parts[i].pop();
            parts[i] = word.bytes().chain(end).collect();
        }
        2 => parts.insert(i, word.bytes().chain([b' ']).collect()),
        3 => drop(parts.remove(i)),
        4 => parts.insert(i, parts[j].clone()),
        5 => parts.swap(i, j),
        6 => {
            let k = at.1.index(parts[i].len());
            parts[i].truncate(k);
        }
        _ => {
            let k = at.1.index(parts[i].len());
            parts[i][k] = byte;
        }
    }
    *text = parts.concat();
}
