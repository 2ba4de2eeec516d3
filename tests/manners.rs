//! What a command writes to standard output and standard error, and how it ends: pipes and exit
//! codes.

#![cfg(unix)]

use std::{
    fs,
    path::Path,
    process::{Command, Output, Stdio},
};

use serde_json::Value;

use crate::{
    bad_input::{listing, phylux},
    common::{TestScene, binary, stderr},
};

fn scene() -> TestScene {
    let scene = r#"{
        "name": "wall",
        "materials": {"wall": {"type": "lambert", "reflectance": 0.5}},
        "objects": [{"name": "w", "obj": "a.obj", "material": "wall", "captor": true}],
        "lights": [{"type": "point", "position": [0.2, 0.2, 0.1], "power": 1}],
        "settings": {"photons": 2000}
    }"#;
    TestScene::new(scene, &[("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")])
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// Asserts that a command ends with this exit code, and returns its output.
fn ends(folder: &Path, code: i32, arguments: &[&str]) -> Output {
    let output = phylux(folder, arguments);
    assert_eq!(output.status.code(), Some(code), "{arguments:?}: {}", stderr(&output));
    output
}

#[test]
fn results_go_to_the_standard_output_and_words_beside_it() {
    let scene = scene();
    let folder = scene.path("");
    let before = listing(&folder);
    let output = ends(&folder, 0, &["run", "scene.json", "-o", "-"]);
    let result: Value = serde_json::from_slice(&output.stdout).expect("results alone");
    assert_eq!(result["photons"], 2000);
    assert!(stderr(&output).starts_with("wall: 2000 photons"), "{}", stderr(&output));
    assert!(stderr(&output).ends_with("; wrote to the standard output\n"));
    assert_eq!(listing(&folder), before);
    ends(&folder, 0, &["run", "scene.json", "-o", "a.json"]);
    assert!(fs::read(scene.path("a.json")).expect("results") == output.stdout);

    let table = ends(&folder, 0, &["run", "scene.json", "--csv", "-"]).stdout;
    let mut lines = csv::Reader::from_reader(&table[..]);
    let header = lines.headers().expect("a header").iter().collect::<Vec<_>>().join(",");
    assert_eq!(header, "captor,face,band,quantity,value,standard_error,x,y,z,area,group");
    let row = lines.records().next().expect("a row").expect("a row");
    assert_eq!((&row[0], &row[9], &row[10]), ("w/a", "0.5", "w"));
    assert!((row[6].parse::<f64>().expect("x") - 1.0 / 3.0).abs() < 1e-7);

    let page = ends(&folder, 0, &["view", "scene.json", "-o", "-"]).stdout;
    assert!(text(&page).starts_with("<!"), "a page");
    let small = ["--map-photons", "500", "--width", "20", "--height", "20", "-o", "-"];
    let picture = ends(&folder, 0, &[&["render", "scene.json"], &small[..]].concat()).stdout;
    assert_eq!(&picture[1..4], b"PNG");
    let part = ends(&folder, 0, &["run", "scene.json", "--shard", "1/1", "-o", "-"]).stdout;
    assert!(text(&part).starts_with("{\"phylux_work\":\"run\",\"share\":\"1/1\""));
}

#[test]
fn one_output_has_the_standard_output_and_no_folder_is_there() {
    let scene = scene();
    let folder = scene.path("");
    let before = listing(&folder);
    let said = |arguments: &[&str]| text(&ends(&folder, 2, arguments).stderr);
    let two = said(&["run", "scene.json", "-o", "-", "--csv", "-"]);
    assert_eq!(
        two,
        "error: -: the standard output is named for two outputs; write one of them to a file\n"
    );
    for arguments in [
        &["run", "scene.json", "--per-captor", "-"][..],
        &["chart", "scene.json", "-o", "-"],
        &["sweep", "s.json", "-o", "-"],
    ] {
        assert!(said(arguments).contains("is the standard output, and several files"));
    }
    assert_eq!(listing(&folder), before);
}

#[test]
fn a_pipe_that_is_closed_is_no_error() {
    let scene = scene();
    for arguments in [
        &["run", "scene.json", "-o", "-", "-q"][..],
        &["run", "scene.json", "--csv", "-", "-q"],
        &["schema"],
        &["check", "scene.json", "--json"],
        &["--help"],
        &["run", "--help"],
    ] {
        let mut command = Command::new(binary());
        command.args(arguments).current_dir(scene.path(""));
        let mut child =
            command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("a start");
        drop(child.stdout.take());
        let output = child.wait_with_output().expect("an end");
        assert_eq!(stderr(&output), "", "{arguments:?}");
        assert_eq!(output.status.code(), Some(0), "{arguments:?}");
    }
}

#[test]
fn quiet_commands_say_only_results_warnings_and_errors() {
    let scene = scene();
    let folder = scene.path("");
    for arguments in [
        &["run", "scene.json", "-q", "-o", "a.json"][..],
        &["run", "scene.json", "--quiet", "--seed", "2", "-o", "b.json"],
        &["-q", "check", "scene.json"],
        &["compare", "a.json", "b.json", "-q"],
    ] {
        let output = ends(&folder, 0, arguments);
        assert_eq!((text(&output.stdout), stderr(&output)), Default::default());
    }
    assert!(!ends(&folder, 0, &["schema", "-q"]).stdout.is_empty());
    let few = ends(&folder, 0, &["run", "scene.json", "-q", "--photons", "5", "-o", "c.json"]);
    assert!(stderr(&few).starts_with("warning: "), "{}", stderr(&few));
    assert!(stderr(&ends(&folder, 2, &["run", "none.json", "-q"])).starts_with("error: "));
}

/// `phylux compare --exit-code` ends with 0 if two results agree and with 1 if they do not.
///
/// Seeds 1 and 2 with 2000 photons each agree: chance exceeds the limit of |z| with odds of 1/1000,
/// and the seeds are fixed.
#[test]
fn comparing_can_end_with_its_finding() {
    let scene = scene();
    let folder = scene.path("");
    let json = fs::read_to_string(scene.path("scene.json")).expect("the scene");
    fs::write(scene.path("brighter.json"), json.replace("\"power\": 1", "\"power\": 2"))
        .expect("written");
    ends(&folder, 0, &["run", "scene.json", "-o", "a.json"]);
    ends(&folder, 0, &["run", "scene.json", "--seed", "2", "-o", "b.json"]);
    ends(&folder, 0, &["run", "brighter.json", "--seed", "3", "-o", "c.json"]);
    ends(&folder, 0, &["compare", "a.json", "b.json", "--exit-code"]);
    ends(&folder, 1, &["compare", "a.json", "c.json", "--exit-code"]);
    ends(&folder, 0, &["compare", "a.json", "c.json"]);
    ends(&folder, 2, &["compare", "a.json", "none.json", "--exit-code"]);
}

#[test]
fn checks_can_be_strict_and_read_by_programs() {
    let scene = scene();
    let folder = scene.path("");
    for more in [&[][..], &["--strict"]] {
        let output = ends(&folder, 0, &[&["check", "scene.json"], more].concat());
        assert!(text(&output.stdout).ends_with("\nno problems found\n"), "{more:?}");
    }
    let json = fs::read_to_string(scene.path("scene.json")).expect("the scene");
    let more = json.replace(
        "\"materials\": {",
        "\"materials\": {\"spare\": {\"type\": \"mirror\", \"reflectance\": 1}, ",
    );
    fs::write(scene.path("spare.json"), more).expect("written");
    let output = ends(&folder, 0, &["check", "spare.json"]);
    assert_eq!(stderr(&output).matches("warning: ").count(), 1);
    assert!(text(&output.stdout).ends_with("\n1 warning, see above\n"));
    let dark = fs::read_to_string(scene.path("spare.json")).expect("the scene");
    fs::write(scene.path("dark.json"), dark.replace("\"power\": 1", "\"power\": 0"))
        .expect("written");
    let output = ends(&folder, 0, &["check", "dark.json"]);
    assert_eq!(stderr(&output).matches("warning: ").count(), 2);
    assert!(text(&output.stdout).ends_with("\n2 warnings, see above\n"));
    let output = ends(&folder, 1, &["check", "spare.json", "--strict"]);
    assert!(
        stderr(&output).ends_with(
            "error: spare.json: 1 warning; change what they name, or leave out --strict\n"
        )
    );
    let output = ends(&folder, 0, &["check", "spare.json", "--json"]);
    assert_eq!(stderr(&output), "");
    let found: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    assert_eq!(found["scene"], "wall");
    assert_eq!(found["surfaces"][0]["material"], "wall");
    assert_eq!(found["captors"]["surface"], 1);
    assert!(found["warnings"][0].as_str().expect("a text").contains("spare"));
    ends(&folder, 2, &["check", "none.json", "--json"]);
}

#[test]
fn every_command_that_traces_takes_the_same_options() {
    let scene = scene();
    let folder = scene.path("");
    for command in ["run", "chart", "render", "view", "export", "sweep", "year", "calibrate"] {
        let help = text(&ends(&folder, 0, &[command, "--help"]).stdout);
        for option in ["--seed <N>", "--photons <N>", "--threads <N>"] {
            assert!(help.contains(option), "{command} has no {option}");
        }
        assert!(help.contains("Examples:"), "{command} has no example");
    }
}

#[test]
fn usage_that_is_wrong_ends_with_2_and_help_with_0() {
    let scene = scene();
    let folder = scene.path("");
    for arguments in [&["run"][..], &["fly"], &["run", "scene.json", "--fotons", "1"], &[]] {
        assert_eq!(text(&ends(&folder, 2, arguments).stdout), "", "{arguments:?}");
    }
    for arguments in [&["--help"][..], &["--version"], &["help", "run"]] {
        assert_eq!(stderr(&ends(&folder, 0, arguments)), "", "{arguments:?}");
    }
}

#[test]
fn shells_and_the_manual_know_all_commands() {
    let scene = scene();
    let folder = scene.path("");
    for shell in ["bash", "zsh", "fish", "powershell", "elvish"] {
        let script = text(&ends(&folder, 0, &["completions", shell]).stdout);
        assert!(script.contains("--checkpoint") && script.contains("sweep"), "{shell}");
    }
    ends(&folder, 0, &["man", "pages"]);
    let pages = listing(&scene.path("pages"));
    assert!(
        pages.contains(&"phylux.1".into()) && pages.contains(&"phylux-run.1".into()),
        "{pages:?}"
    );
    let page = fs::read_to_string(scene.path("pages/phylux-run.1")).expect("a page");
    assert!(page.starts_with(".ie") || page.contains(".TH phylux-run 1"), "{page}");
    assert!(
        page.contains("checkpoint") && page.contains(".SH EXAMPLES\n.nf\nphylux run"),
        "{page}"
    );
    assert!(page.contains(".TH phylux-run 1  \"phylux 0") && page.contains(".B 130\n"), "{page}");
    assert!(!page.contains('\u{1b}'), "{page}");
    let front = fs::read_to_string(scene.path("pages/phylux.1")).expect("a page");
    for name in pages.iter().filter_map(|page| page.strip_prefix("phylux-")?.strip_suffix(".1")) {
        assert!(front.contains(&format!(".BR phylux\\-{name} (1)\n")), "{front}");
    }
    assert!(!front.contains("phylux\\-help") && !front.contains("phylux-help"), "{front}");
    // folders that a new user does not have yet
    ends(&folder, 0, &["man", "share/man/man1"]);
    ends(&folder, 2, &["man", "scene.json/man"]);
    ends(&folder, 2, &["completions", "tcsh"]);
}

/// Mistakes of new users are named where they are, or are no mistakes any more.
#[test]
fn mistakes_are_named_where_they_are() {
    let scene = scene();
    let folder = scene.path("");
    let json = fs::read_to_string(scene.path("scene.json")).expect("the scene");
    let said = |code, json: String| {
        fs::write(scene.path("other.json"), json).expect("written");
        text(&ends(&folder, code, &["run", "other.json", "-q", "-o", "r.json"]).stderr)
    };
    let comma = said(2, json.replace("0.5}", "0,5}"));
    assert!(comma.contains("numbers take a decimal point, not a comma"), "{comma}");
    let leaf =
        r#""leaf": {"type": "leaf", "reflectance": [0.1, 0.5], "transmittance": [0.1, 0.51]}"#;
    let leaf = format!(
        "\"bands\": [{{\"name\": \"PAR\"}}, {{\"name\": \"NIR\"}}], \"materials\": {{{leaf}, "
    );
    let unused = json.replace("\"materials\": {", &leaf);
    let warning = said(0, unused.clone());
    assert!(warning.starts_with("warning: other.json: /materials/leaf: "), "{warning}");
    assert!(warning.contains("reflectance + transmittance = 1.0100 in band `NIR`"), "{warning}");
    let error = said(2, unused.replace("\"material\": \"wall\"", "\"material\": \"leaf\""));
    assert!(error.starts_with("error: other.json: /materials/leaf: "), "{error}");
    fs::write(scene.path("a.obj"), "v 0 0 0\nv 1 0 0\nv 1 1 0.3\nv 0 1 0\nf 1 2 3 4\n")
        .expect("written");
    let bent = said(0, json);
    assert!(bent.contains("a.obj:5: 1 of the faces from here on are not flat"), "{bent}");
}

/// The results contain everything that decides their numbers, and nothing else of how they were
/// made.
#[test]
fn results_say_what_they_are_of() {
    let scene = scene();
    let folder = scene.path("");
    ends(&folder, 0, &["run", "scene.json", "--threads", "1", "--k", "0", "-o", "a.json"]);
    let a = fs::read_to_string(scene.path("a.json")).expect("results");
    let result: Value = serde_json::from_str(&a).expect("JSON");
    assert_eq!(result["format"], 1);
    assert_eq!(
        result["settings"],
        serde_json::json!({
            "estimator": "photons", "photons": 2000, "seed": 1, "k": 0, "guiding": "off"
        })
    );
    assert_eq!(result["warnings"], serde_json::json!([]));
    assert_eq!(result["captors"][0]["groups"], serde_json::json!(["w"]));
    // a scene that is written in another way and has another name is the same scene
    let json = fs::read_to_string(scene.path("scene.json")).expect("the scene");
    let other = json.replace("0.5}", "5e-1}").replace("\"name\": \"wall\"", "\"name\": \"other\"");
    fs::write(scene.path("other.json"), other).expect("written");
    ends(&folder, 0, &["run", "other.json", "--photons", "5", "--seed", "3", "-o", "b.json"]);
    let b: Value =
        serde_json::from_slice(&fs::read(scene.path("b.json")).expect("results")).expect("JSON");
    assert_eq!(result["scene_hash"], b["scene_hash"]);
    assert_eq!(result["scene_hash"].as_str().map(str::len), Some(64));
    assert!(b["warnings"][0].as_str().expect("a warning").contains("5 batches"));
    fs::write(scene.path("other.json"), json.replace("0.5}", "0.6}")).expect("written");
    ends(&folder, 0, &["run", "other.json", "-o", "b.json"]);
    let b: Value =
        serde_json::from_slice(&fs::read(scene.path("b.json")).expect("results")).expect("JSON");
    assert_ne!(result["scene_hash"], b["scene_hash"]);
}
