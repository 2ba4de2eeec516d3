//! Every wrong sweep file is refused with a message, and nothing is written.

use super::*;
use crate::bad_input::listing;

/// Asserts that the sweep is refused with these words after `error: sweep.json: `.
fn bad(sweep: &str, words: &str) {
    let folder = folder(sweep);
    let before = listing(&folder.path(""));
    let output = any(&folder, "sweep sweep.json -o out");
    let said = stderr(&output);
    assert_eq!(output.status.code(), Some(2), "{sweep}: {said}");
    assert_eq!(said.lines().count(), 1, "{said}");
    assert!(said.starts_with(&format!("error: sweep.json: {words}")), "{sweep}: {said}");
    assert_eq!(listing(&folder.path("")), before);
}

#[test]
fn bad_sweep_files() {
    let vary = |entries: &str| format!(r#"{{"scene": "scene.json", "vary": {{{entries}}}}}"#);
    let with = |more: &str| {
        format!(r#"{{"scene": "scene.json", "vary": {{"/lights/0/power": [1, 2]}}, {more}}}"#)
    };
    let rows: &[(String, &str)] = &[
        ("".into(), "is empty; it must be a JSON file"),
        ("{".into(), "line 1, column 1: EOF"),
        ("[]".into(), "an array, must be an object"),
        ("{}".into(), "missing key `scene`; add it"),
        (r#"{"scene": "scene.json"}"#.into(), "missing key `vary`"),
        (with(r#""sceen": 1"#), "/sceen: unknown key `sceen`; did you mean `scene`? (keys here:"),
        (
            r#"{"scene": "none.json", "vary": {}}"#.into(),
            "/scene: none.json: there is no such file",
        ),
        (vary(""), "/vary: nothing varies; name a place"),
        (
            vary(r#""/lights/0/powr": [1]"#),
            "/vary: `/lights/0/powr`: the scene has no `/lights/0/powr`; the nearest that it has is /lights/0/power",
        ),
        (
            vary(r#""/lights/2/power": [1]"#),
            "/vary: `/lights/2/power`: the scene has no `/lights/2/power`; the nearest that it has is /lights/0/power",
        ),
        (
            vary(r#""lamp": [1, 2]"#),
            "/vary: `lamp`: does not say where in the scene its value goes; give `at`",
        ),
        (vary(r#""lamp": {"at": [], "values": [1]}"#), "/vary: `lamp`: does not say where"),
        (
            vary(r#""lamp": {"at": ["lights"], "values": [1]}"#),
            "/vary: `lamp`: `lights` is no JSON pointer; begin it with /",
        ),
        (
            vary(r#""lamp": {"at": ["/lights/0/power"]}"#),
            "/vary: `lamp`: needs `values`, or `from` and `to`",
        ),
        (
            vary(r#""lamp": {"at": "/lights/0/power", "values": [1]}"#),
            "/vary/lamp/at: \"/lights/0/power\", must be an array",
        ),
        (
            vary(r#""lamp": {"at": ["/lights/0/power"], "valeus": [1]}"#),
            "/vary/lamp/valeus: unknown key `valeus`; did you mean `values`?",
        ),
        (
            vary(r#""/lights/0/power": 3"#),
            "/vary/~1lights~10~1power: 3, must be an array of values, or an object",
        ),
        (vary(r#""/lights/0/power": []"#), "/vary: `/lights/0/power`: has no values; list"),
        (vary(r#""/lights/0/power": [null]"#), "/vary: `/lights/0/power`: a value is null"),
        (
            vary(r#""/lights/0/power": [1, 2, 1.0]"#),
            "/vary: runs 1 and 3 are the same (/lights/0/power = 1, seed 7); name each value once",
        ),
        (
            vary(r#""/lights/0/power": {"from": 1, "to": 2}"#),
            "/vary: `/lights/0/power`: `from` and `to` without `steps`",
        ),
        (
            vary(r#""/lights/0/power": {"from": 1, "steps": 2}"#),
            "/vary: `/lights/0/power`: needs `values`",
        ),
        (
            vary(r#""/lights/0/power": {"from": 1, "to": 2, "steps": 1}"#),
            "/vary: `/lights/0/power`: 1 steps, must be 2",
        ),
        (
            vary(r#""/lights/0/power": {"from": 1, "to": 2, "steps": 2.5}"#),
            "/vary/~1lights~10~1power/steps: 2.5, must be a whole",
        ),
        (
            vary(r#""/lights/0/power": {"values": [1], "from": 1, "to": 2}"#),
            "/vary: `/lights/0/power`: needs `values`",
        ),
        (
            vary(r#""/lights/0": [{}], "/lights/0/power": [1]"#),
            "/vary: `/lights/0/power`: /lights/0/power is a part of /lights/0, which is set too",
        ),
        (
            vary(r#""/lights/0/power": [1], "x": {"at": ["/lights/0/power"], "values": [1]}"#),
            "/vary: `x`: /lights/0/power is set twice; set each",
        ),
        (
            vary(r#""/settings/seed": [1, 2]"#),
            "/vary: `/settings/seed`: /settings/seed cannot vary; `seeds` repeats",
        ),
        (
            vary(r#""run": {"at": ["/lights/0/power"], "values": [1]}"#),
            "/vary: `run`: the tables have a column of this name",
        ),
        (
            vary(r#""lost_x": {"at": ["/lights/0/power"], "values": [1]}"#),
            "/vary: `lost_x`: the tables have",
        ),
        (vary(r#""": {"at": ["/lights/0/power"], "values": [1]}"#), "/vary: ``: a name must be"),
        (
            vary(
                r#""/lights/0/power": {"from": 1, "to": 2, "steps": 1000000}, "/lights/1/power": {"from": 1, "to": 2, "steps": 1000000}"#,
            ),
            "1000000000000 runs, must be at most 1000000; take fewer values",
        ),
        (
            vary(r#""/lights/0/power": {"from": 1, "to": 2, "steps": 1e12}"#),
            "/vary: `/lights/0/power`: ",
        ),
        (with(r#""combine": "gird""#), "/combine: unknown value `gird`; values here: grid, zip"),
        (with(r#""combine": 3"#), "/combine: 3, must be grid, zip, or an object"),
        (with(r#""combine": {"sample": "sobol"}"#), "/combine: missing key `count`"),
        (
            with(r#""combine": {"sample": "halton", "count": 3}"#),
            "/combine/sample: unknown value `halton`; values here: sobol, latin-hypercube",
        ),
        (
            with(r#""combine": {"sample": "sobol", "count": 0}"#),
            "/combine/count: 0, must be at least 1",
        ),
        (
            with(r#""combine": {"sample": "sobol", "count": 70000}"#),
            "/combine: 70000 points, at most 65536; latin-hypercube takes more",
        ),
        (with(r#""combine": {"sample": "sobol", "count": 8}"#), "/vary: runs 1 and"),
        (with(r#""combine": "zip", "seeds": 0"#), "/seeds: 0, must be at least 1"),
        (with(r#""seeds": -1"#), "/seeds: -1, must be a whole number"),
        (with(r#""seeds": 1e7"#), "20000000 runs, must be at most"),
        (
            vary(r#""/lights/0/power": [1, 2], "/lights/1/power": [1]"#)
                .replace("{\"scene\"", "{\"combine\": \"zip\", \"scene\""),
            "/combine: zip takes values in pairs, but `/lights/0/power` has 2 and `/lights/1/power` has 1",
        ),
    ];
    for (sweep, words) in rows {
        bad(sweep, words);
    }
}

#[test]
fn bad_scenes_and_folders() {
    let folder = folder(r#"{"scene": "scene.json", "vary": {"/lights/0/power": [1, 2]}}"#);
    let refused = |arguments: &str, code: i32, words: &str| {
        let output = any(&folder, arguments);
        assert_eq!(output.status.code(), Some(code), "{}", stderr(&output));
        assert!(stderr(&output).starts_with(words), "{}", stderr(&output));
    };
    fs::write(folder.path("scene.json"), SCENE.replace("\"a.obj\"", "\"b.obj\"")).expect("a scene");
    refused(
        "sweep sweep.json -o out",
        2,
        "error: scene.json: /objects/0/obj: b.obj: there is no such file",
    );
    fs::write(folder.path("scene.json"), SCENE.replace(", \"captor\": true", "")).expect("a scene");
    refused("sweep sweep.json -o out", 2, "error: scene.json: /captors: the scene has no captor");
    fs::write(folder.path("scene.json"), "{").expect("a scene");
    refused("sweep sweep.json -o out", 2, "error: scene.json: line 1");
    fs::write(folder.path("scene.json"), SCENE).expect("a scene");
    // a folder that is not a sweep's keeps all its files
    let before = listing(&folder.path(""));
    refused("sweep sweep.json -o .", 2, "error: .: holds ");
    refused("sweep sweep.json -o a.obj", 2, "error: a.obj: is a file, not a folder");
    refused("sweep sweep.json -o no/out", 2, "error: no/out: cannot be created");
    refused(
        "sweep sweep.json -o out --shard 4/3",
        2,
        "error: invalid value '4/3' for '--shard <I/N>': must be I/N",
    );
    refused("merge none -o out", 2, "error: none/sweep.json: there is no such file; name a folder");
    assert_eq!(listing(&folder.path("")), before);
}
