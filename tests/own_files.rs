//! What is not ours stays as it is: files beside a checkpoint, in folders of tables, and of other
//! processes. What is ours and was left behind goes.

#![cfg(unix)]

use std::{
    fs,
    os::unix::fs::symlink,
    path::Path,
    process::{Child, Command},
};

use crate::{
    bad_input::{listing, phylux, refused},
    common::{TestScene, binary, stderr},
    processes::{kill, start, start_until},
    year::two_days,
};

fn scene() -> TestScene {
    let scene = r#"{
        "materials": {"wall": {"type": "lambert", "reflectance": 0.5}},
        "objects": [{"obj": "a.obj", "material": "wall", "captor": true}],
        "lights": [{"type": "point", "position": [0.2, 0.2, 0.1], "power": 1}],
        "settings": {"photons": 2000, "threads": 1}
    }"#;
    TestScene::new(scene, &[("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")])
}

fn done(folder: &Path, line: &str) {
    let output = phylux(folder, &line.split(' ').collect::<Vec<_>>());
    assert_eq!(output.status.code(), Some(0), "{line}: {}", stderr(&output));
}

fn refuses(folder: &Path, line: &str, words: &[&str]) {
    refused(folder, &line.split(' ').collect::<Vec<_>>(), words);
}

/// Names that a checkpoint, a table or a results file might have been written to on the way.
#[test]
fn files_beside_an_output_stay() {
    let scene = scene();
    let folder = scene.path("");
    for end in ["~", ".tmp", ".part", ".lock", ".bak", ".new", ".unfinished"] {
        for name in ["kept", "r.json", "t.csv"] {
            fs::write(scene.path(&format!("{name}{end}")), "precious").expect("a file");
        }
    }
    fs::write(scene.path(".phylux-notes"), "precious").expect("a file");
    fs::write(scene.path("far"), "precious").expect("a file");
    symlink("far", scene.path("linked~")).expect("a link");
    let before = listing(&folder);
    let line = "run scene.json --photons 2e5 -o r.json --csv t.csv --checkpoint kept \
                --checkpoint-every 0.001";
    done(&folder, line);
    done(&folder, &line.replace("--checkpoint kept", "--checkpoint linked"));
    let mut after = listing(&folder);
    after.retain(|name| name != "r.json" && name != "t.csv");
    assert_eq!(after, before);
    for name in before.iter().filter(|name| !["scene.json", "a.obj"].contains(&&***name)) {
        assert_eq!(fs::read(scene.path(name)).expect("a file"), b"precious", "{name}");
    }
    // outputs with such names are outputs like others
    done(&folder, "run scene.json -o other~ --checkpoint other");
    assert!(scene.path("other~").exists() && !scene.path("other").exists());
}

/// Through a link, the file is written that the link leads to, also where that is not there yet.
#[test]
fn links_stay_links() {
    let scene = scene();
    let folder = scene.path("");
    fs::create_dir(scene.path("away")).expect("a folder");
    symlink("away/kept", scene.path("kept")).expect("a link");
    symlink("away/r.json", scene.path("r.json")).expect("a link");
    symlink("nowhere/r.json", scene.path("n.json")).expect("a link");
    symlink("loop.json", scene.path("loop.json")).expect("a link");
    let line = "run scene.json --photons 1e14 --checkpoint kept --checkpoint-every 0.001";
    kill(start_until(&folder, line, || scene.path("away/kept").exists()));
    assert!(scene.path("kept").is_symlink());
    done(&folder, "run scene.json -o r.json");
    assert!(scene.path("r.json").is_symlink() && scene.path("away/r.json").is_file());
    for name in ["n.json", "loop.json"] {
        let words = "cannot be written: it is a link that leads nowhere";
        refuses(&folder, &format!("run scene.json -o {name}"), &[words]);
    }
}

/// Of two runs on one checkpoint the second ends at once with a sentence, and the first goes on. A
/// run that was killed holds nothing.
#[test]
fn a_checkpoint_has_one_run() {
    let scene = scene();
    let folder = scene.path("");
    let line = "run scene.json --photons 1e14 --checkpoint kept --checkpoint-every 0.001";
    // the first has the checkpoint when it has written a new one
    let written = || fs::metadata(scene.path("kept")).and_then(|file| file.modified()).ok();
    for round in 0..3 {
        let before = written();
        let first = start_until(&folder, line, || written() != before);
        let second = start(&folder, line).wait_with_output().expect("an end");
        let said = stderr(&second);
        assert_eq!(second.status.code(), Some(1), "{round}: {said}");
        assert_eq!(
            said,
            "error: kept: another phylux is at work on this checkpoint; wait for its end, or name another file\n"
        );
        assert!(kill(first), "the first run ended");
    }
    // several that begin together: all but one are refused, and that one finds the usual results
    fs::remove_file(scene.path("kept")).expect("a checkpoint");
    let line = "run scene.json --photons 3e5 --checkpoint kept -o r.json -q";
    let all: Vec<Child> = (0..4).map(|_| start(&folder, line)).collect();
    let codes: Vec<_> = all
        .into_iter()
        .map(|child| child.wait_with_output().expect("an end").status.code())
        .collect();
    assert!(codes.contains(&Some(0)), "{codes:?}");
    assert!(codes.iter().all(|code| [Some(0), Some(1)].contains(code)), "{codes:?}");
    done(&folder, "run scene.json --photons 3e5 -o whole.json -q");
    let read = |name| fs::read(scene.path(name)).expect("results");
    assert!(read("r.json") == read("whole.json"));
    assert!(!scene.path("kept").exists());
}

/// A run that is killed before its first checkpoint leaves a file that any run can begin with.
#[test]
fn a_checkpoint_that_holds_nothing_is_none() {
    let scene = scene();
    let folder = scene.path("");
    let line = "run scene.json --photons 1e14 --checkpoint kept --checkpoint-every 1e9";
    kill(start_until(&folder, line, || scene.path("kept").exists()));
    assert!(scene.path("kept").exists());
    done(&folder, "run scene.json --seed 7 --checkpoint kept");
    assert!(!scene.path("kept").exists());
    // a user's file is no such file
    fs::write(scene.path("kept"), "").expect("a file");
    refuses(&folder, "run scene.json --checkpoint kept", &["kept: is no checkpoint of a run"]);
    assert!(scene.path("kept").exists());
}

/// What a killed command has left unfinished, the next one removes, but not what another command is
/// at work on.
#[test]
fn leftovers_of_killed_commands_go() {
    let scene = scene();
    let folder = scene.path("");
    let unfinished = || {
        let names = listing(&folder).into_iter();
        names.filter(|name| name.ends_with(".unfinished")).collect::<Vec<_>>()
    };
    let line = "run scene.json --photons 1e14 --csv t.csv --per-captor each";
    kill(start_until(&folder, line, || unfinished().len() == 3));
    let left = unfinished();
    assert_eq!(left.len(), 3, "{left:?}");
    let is_left = |name: &String| left.contains(name);
    // a file that is made and not yet held is taken for a leftover, and made again
    let is_held = |name: &String| {
        let lock = fs::File::open(scene.path(name)).map(|file| file.try_lock());
        matches!(lock, Ok(Err(fs::TryLockError::WouldBlock)))
    };
    let working = start_until(&folder, line, || {
        let now = unfinished();
        now.len() == 3 && !now.iter().any(is_left) && now.iter().all(is_held)
    });
    let of_working = unfinished();
    done(&folder, "run scene.json -o r.json");
    assert_eq!(unfinished(), of_working);
    kill(working);
    done(&folder, "plot r.json --show profile -o p.svg");
    assert_eq!(unfinished(), [""; 0]);
}

/// The files for single captors, and what a calibration found, have names that nobody gave: they
/// replace files of their own kind, and nothing else.
#[test]
fn files_of_no_given_name_replace_only_their_kind() {
    let scene = scene();
    let folder = scene.path("");
    fs::create_dir(scene.path("each")).expect("a folder");
    fs::write(scene.path("m.csv"), "captor,band,value\na/a,all,1\n").expect("readings");
    for (line, name) in [
        ("run scene.json --per-captor each", "each/a_a.json"),
        ("calibrate scene.json m.csv --model common", "calibration.json"),
        ("calibrate scene.json m.csv --model common -o hall.json", "hall-calibration.json"),
    ] {
        for foreign in ["precious", "", "{}", r#"{"phylux": "0.1.0", "captors": []}"#] {
            fs::write(scene.path(name), foreign).expect("a file");
            let before = listing(&folder);
            let problem = format!("{name}: is not what phylux has written there");
            refuses(&folder, line, &[&problem]);
            assert_eq!(fs::read_to_string(scene.path(name)).expect("a file"), foreign);
            assert_eq!(listing(&folder), before);
        }
        fs::remove_file(scene.path(name)).expect("a file");
        done(&folder, line);
        let first = fs::read(scene.path(name)).expect("a file");
        done(&folder, &format!("{line} --seed 7"));
        assert!(fs::read(scene.path(name)).expect("a file") != first, "{name}");
    }
}

/// The tables of a year and of a chart replace their own files, and nothing else; files that belong
/// together change together.
#[test]
fn tables_replace_only_themselves() {
    let scene = two_days();
    let folder = scene.path("");
    for (line, names) in [
        ("year scene.json --photons 2000 --csv -o", ["hours.csv", "days.csv", "year.json"]),
        ("chart scene.json --photons 2000 --seeds 2 -o", ["rows.csv", "study.json", "error.svg"]),
    ] {
        if line.starts_with("chart") {
            let text = fs::read_to_string(scene.path("scene.json")).expect("a scene");
            let instant = serde_json::json!("2025-06-20T12:00+01:00");
            let mut json: serde_json::Value = serde_json::from_str(&text).expect("JSON");
            json["time"] = instant;
            fs::write(scene.path("scene.json"), json.to_string()).expect("a scene");
        }
        for name in names {
            fs::create_dir(scene.path("out")).expect("a folder");
            fs::write(scene.path("out").join(name), "precious").expect("a file");
            let problem = format!("out/{name}: is not what phylux has written there; move it away");
            refuses(&folder, &format!("{line} out"), &[&problem]);
            assert_eq!(fs::read(scene.path("out").join(name)).expect("a file"), b"precious");
            assert_eq!(listing(&scene.path("out")), [name]);
            fs::remove_dir_all(scene.path("out")).expect("a folder");
        }
        done(&folder, &format!("{line} out"));
        fs::write(scene.path("out/notes.txt"), "precious").expect("a file");
        // again, over its own files
        done(&folder, &format!("{line} out --seed 3"));
        let all = listing(&scene.path("out"));
        assert!(all.iter().all(|name| !name.ends_with(".unfinished")), "{all:?}");
        // a file that the user has changed is the user's
        fs::write(scene.path("out").join(names[0]), "mine").expect("a file");
        let problem = format!("out/{}: is not what phylux has written there", names[0]);
        refuses(&folder, &format!("{line} out"), &[&problem]);
        assert_eq!(fs::read(scene.path("out").join(names[0])).expect("a file"), b"mine");
        assert!(scene.path("out/notes.txt").exists());
        fs::remove_dir_all(scene.path("out")).expect("a folder");
    }
}

/// The table of hours in another format takes the place of the first: no table of another year
/// stays beside the new ones.
#[test]
fn no_table_of_an_earlier_year_stays() {
    let scene = two_days();
    let folder = scene.path("");
    done(&folder, "year scene.json --photons 2000 -o out");
    assert!(scene.path("out/hours.parquet").exists());
    done(&folder, "year scene.json --photons 2000 --csv -o out");
    let names = listing(&scene.path("out"));
    assert!(names.contains(&"hours.csv".into()) && !names.contains(&"hours.parquet".into()));
}

/// Control characters of names are in no file that a parser refuses, and reach no terminal.
#[test]
fn files_with_hostile_names_are_read() {
    let name = "a\u{1b}[2Jb\u{0}\u{7}\u{9b}\u{ffff}<&>";
    let sensor = |x: f64, id: &str| serde_json::json!({ "name": id, "disc": { "center": [x, 0, 0], "normal": [0, 0, 1], "radius": 0.1 } });
    let scene = serde_json::json!({
        "name": name,
        "bands": [{ "name": name }],
        "lights": [{ "name": name, "type": "point", "position": [0, 0, 1], "power": 1 }],
        "captors": [sensor(0.0, name), sensor(0.3, "d"), sensor(0.6, "e")],
        "settings": { "photons": 3000, "threads": 1 },
    });
    let scene = TestScene::new(&scene.to_string(), &[]);
    let sweep = serde_json::json!({
        "scene": "scene.json", "vary": { "/lights/0/position/2": [1, 2], "/name": [name, "b\u{1}"] },
    });
    fs::write(scene.path("s.json"), sweep.to_string()).expect("a sweep");
    let folder = scene.path("");
    done(&folder, "run scene.json -o r.json --csv t.csv");
    done(&folder, "view scene.json -o v.html");
    done(&folder, "export scene.json -o v.vtp");
    done(&folder, "export scene.json -o v.vtu");
    done(&folder, "sweep s.json -o out");
    done(&folder, "chart scene.json -o charts --photons 1000 --seeds 2");
    for show in ["map", "profile"] {
        done(&folder, &format!("plot r.json --show {show} -o {show}.svg"));
    }
    let mut files: Vec<_> = ["t.csv", "v.html", "v.vtp", "v.vtu", "map.svg", "profile.svg"]
        .map(|name| scene.path(name))
        .to_vec();
    for inside in ["charts", "out", "out/plots"] {
        let inside = scene.path(inside);
        files.extend(listing(&inside).iter().map(|name| inside.join(name)));
    }
    let text = |ending: &str| [".csv", ".html", ".vtp", ".vtu", ".svg"].contains(&ending);
    let mut read = 0;
    for file in files {
        let ending = file.extension().map(|e| format!(".{}", e.to_string_lossy()));
        if !ending.is_some_and(|ending| text(&ending)) {
            continue;
        }
        let content = fs::read_to_string(&file).expect("a text");
        // three.js in the page has its own texts, which end where the data begin
        let is = |ending: &str| file.extension().is_some_and(|e| e == ending);
        let (is_page, is_table) = (is("html"), is("csv"));
        let refused = |c: char| {
            (c.is_control() && !"\t\r\n".contains(c))
                || (!is_table && ['\u{fffe}', '\u{ffff}'].contains(&c))
        };
        let found = content.find(refused);
        assert!(is_page || found.is_none(), "{}: {found:?}", file.display());
        assert!(!content.contains("\u{1b}[2J"), "{}", file.display());
        read += 1;
    }
    assert!(read > 12, "{read} files");
}

/// What would not fit into memory is refused with a sentence, before the memory is taken.
#[cfg(target_os = "linux")]
#[test]
fn what_does_not_fit_into_memory_has_its_sentence() {
    let limited = |folder: &Path, kilobytes: u64, line: &str, words: &str| {
        let script = format!("ulimit -v {kilobytes}; exec \"$0\" {line}");
        let output = Command::new("sh")
            .args(["-c", &script])
            .arg(binary())
            .current_dir(folder)
            .output()
            .expect("a shell");
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(2), "{line}: {said}");
        let last = said.lines().last().unwrap_or_default();
        assert!(last.contains(words) && last.starts_with("error: "), "{line}: {said}");
    };
    let quad = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n";
    let bands: Vec<_> = (0..2000).map(|b| serde_json::json!({ "name": format!("b{b}") })).collect();
    let sensors = serde_json::json!({
        "name": "g",
        "grid": { "x": [0, 1], "y": [0, 1], "nx": 60, "ny": 60, "z": 0.3, "radius": 0.001 },
    });
    let groups: serde_json::Map<_, _> =
        (0..3000).map(|g| (format!("g{g}"), serde_json::json!("*"))).collect();
    let base = serde_json::json!({
        "materials": { "grey": { "type": "lambert", "reflectance": 0.5 } },
        "objects": [{ "name": "q", "obj": "q.obj", "material": "grey", "captor": true }],
        "lights": [{ "type": "point", "position": [0.5, 0.5, 0.5], "power": 1 }],
        "settings": { "photons": 300, "threads": 1 },
    });
    let with = |key: &str, value: serde_json::Value| {
        let mut scene = base.clone();
        scene[key] = value;
        scene
    };
    let scene = TestScene::new(&with("bands", bands.into()).to_string(), &[("q.obj", quad)]);
    let folder = scene.path("");
    for line in ["view scene.json -o v.html", "export scene.json -o v.vtp"] {
        limited(&folder, 1_200_000, line, "GiB of memory");
    }
    let mut many = with("captors", serde_json::json!([sensors]));
    many["groups"] = groups.into();
    fs::write(scene.path("many.json"), many.to_string()).expect("a scene");
    for line in ["run many.json -o r.json", "check many.json"] {
        limited(&folder, 500_000, line, "many.json: /groups: up to `g/");
    }
    // a field of 100 x 100 squares, 500 times
    let mut field = String::new();
    for i in 0..=100 {
        (0..=100).for_each(|j| field += &format!("v {i} {j} 0\n"));
    }
    for i in 0..100 {
        for j in 0..100 {
            let a = i * 101 + j + 1;
            field += &format!("f {a} {} {} {}\n", a + 1, a + 102, a + 101);
        }
    }
    fs::write(scene.path("field.obj"), field).expect("a mesh");
    let copies: Vec<_> = (0..500).map(|i| serde_json::json!({ "translate": [0, 0, i] })).collect();
    let field = serde_json::json!([{
        "name": "f", "obj": "field.obj", "material": "grey", "instances": copies, "share": false
    }]);
    fs::write(scene.path("fields.json"), with("objects", field).to_string()).expect("a scene");
    for line in ["run fields.json -o r.json", "check fields.json", "view fields.json -o v.html"] {
        limited(&folder, 800_000, line, "triangles take");
    }
}
