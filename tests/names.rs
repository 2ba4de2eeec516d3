//! The name of a test says whether a plain `cargo test` runs it: one that begins with `needs_` or
//! `nightly_` is ignored, with its reason, and no other test is.

use std::{fs, path::Path};

/// How names begin, and how the reason then ends.
const REASONS: [(&str, &str); 5] = [
    ("needs_avx2_", "needs a processor with AVX2"),
    ("needs_chromium_", "needs Chromium"),
    ("needs_mdbook_", "needs mdBook"),
    ("needs_shared_", "needs PHYLUX_SHARED"),
    ("nightly_", ": .ci/nightly runs it"),
];

/// The reason of tests that `cfg_attr` ignores where a system has other digits than the one that
/// they were written on.
const ELSEWHERE: &str = "other systems compute slightly different sines and logarithms";

#[test]
fn a_name_says_whether_a_test_is_ignored() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let (mut seen, mut ignored) = (0, 0);
    for folder in ["src", "crates", "tests", "benches", "examples", "python/src"] {
        for (file, text) in texts(&root.join(folder)) {
            let tests = tests(&text).unwrap_or_else(|line| panic!("{file}: {line}: which test?"));
            seen += tests.len();
            for test in tests {
                ignored += usize::from(test.reason.is_some());
                if let Some(problem) = problem(&test) {
                    panic!("{file}: {}: {problem}", test.name);
                }
            }
        }
    }
    assert!(seen > 400 && ignored > 40, "{seen} tests, {ignored} ignored: are all of them read?");
}

#[test]
fn the_reader_of_tests_sees_every_form() {
    let found = |text: &str| {
        let found = tests(text)?.into_iter();
        Ok::<_, String>(found.map(|test| (problem(&test).is_none(), test.name)).collect::<Vec<_>>())
    };
    let ignore = "#[ignore = \"";
    for (attributes, name, is_right) in [
        ("#[test]\n".into(), "plain", true),
        ("#[test]\n".into(), "needs_shared_x", false),
        ("#[test]\n".into(), "nightly_x", false),
        ("#[test]\n#[ignore]\n".into(), "plain", false),
        ("#[ignore]\n#[test]\n".into(), "needs_shared_x", false),
        (format!("{ignore}needs PHYLUX_SHARED\"]\n#[test]\n"), "needs_shared_x", true),
        (format!("#[test]\n// why\n{ignore}needs PHYLUX_SHARED\"]\n"), "needs_mdbook_x", false),
        (format!("#[test]\n{ignore}needs PHYLUX_SHARED\"]\n"), "plain", false),
        (format!("#[test]\n{ignore}needs a moon\"]\n"), "needs_moon_x", false),
        (
            format!("    #[test]\n    {ignore}takes long: .ci/nightly runs it\"]\n    "),
            "nightly_x",
            true,
        ),
        (
            format!(
                "#[test]\n#[cfg_attr(\n    target_os = \"windows\",\n    ignore = \"{ELSEWHERE}\"\n)]\n"
            ),
            "x",
            true,
        ),
        ("#[test]\n#[cfg_attr(windows, ignore = \"who knows\")]\n".into(), "x", false),
    ] {
        let text = format!("fn before() {{}}\n\n{attributes}fn {name}() {{\n}}\nfn after() {{}}\n");
        assert_eq!(found(&text), Ok(vec![(is_right, name.to_string())]), "{text}");
    }
    for text in ["#[test]\nconst X: u8 = 1;\nfn x() {}\n", "#[test]\nfn $name() {}\n"] {
        assert!(found(text).is_err(), "{text}");
    }
}

/// A test, and why it is ignored.
struct Test {
    name: String,
    reason: Option<String>,
    /// Why it is ignored on other systems.
    elsewhere: Option<String>,
}

/// Returns what is wrong with a test, if something is.
fn problem(test: &Test) -> Option<String> {
    if test.elsewhere.as_deref().is_some_and(|reason| reason != ELSEWHERE) {
        return Some(format!("is ignored on some systems, and not because {ELSEWHERE}"));
    }
    let named = ["needs_", "nightly_"].iter().any(|start| test.name.starts_with(start));
    let ends = REASONS.iter().find(|(start, _)| test.name.starts_with(start)).map(|(_, end)| end);
    match (named, ends, &test.reason) {
        (false, _, None) => None,
        (false, _, Some(_)) => {
            Some("is ignored: begin its name with `needs_` or `nightly_`".into())
        }
        (true, None, _) => {
            Some("needs what no other test needs: say in this file what it is".into())
        }
        (true, Some(end), Some(reason)) if reason.ends_with(end) => None,
        (true, Some(end), _) => {
            Some(format!("must be ignored with a reason that ends with `{end}`"))
        }
    }
}

/// Returns the tests of a source text. Error: a line that follows the attributes of a test, and does
/// not name it.
fn tests(text: &str) -> Result<Vec<Test>, String> {
    let (mut found, mut attributes) = (Vec::new(), Vec::<String>::new());
    let mut is_open = false;
    for line in text.lines().map(str::trim).filter(|line| !line.starts_with("//")) {
        if is_open || line.starts_with("#[") {
            match attributes.last_mut().filter(|_| is_open) {
                Some(attribute) => attribute.push_str(line),
                None => attributes.push(line.to_string()),
            }
            is_open = !line.ends_with(']');
            continue;
        }
        let of_line = std::mem::take(&mut attributes);
        if !of_line.iter().any(|attribute| attribute == "#[test]") {
            continue;
        }
        let words = line.split_once("fn ").map_or("", |(_, rest)| rest);
        let name: String = words.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect();
        if name.is_empty() {
            return Err(line.to_string());
        }
        let reason = |start: &str| {
            let mut of_kind = of_line.iter().filter(|attribute| attribute.starts_with(start));
            let (_, rest) = of_kind.find_map(|attribute| attribute.split_once("ignore"))?;
            Some(rest.split('"').nth(1).unwrap_or_default().to_string())
        };
        found.push(Test { name, reason: reason("#[ignore"), elsewhere: reason("#[cfg_attr") });
    }
    Ok(found)
}

/// Returns the paths and texts of all Rust files in a folder and the folders in it.
fn texts(folder: &Path) -> Vec<(String, String)> {
    let entries = fs::read_dir(folder).expect("a folder of sources");
    let paths = entries.map(|entry| entry.expect("an entry").path());
    paths
        .flat_map(|path| match path.is_dir() {
            true => texts(&path),
            false if path.extension().is_some_and(|ending| ending == "rs") => {
                let text = fs::read_to_string(&path).expect("a source file");
                vec![(path.display().to_string(), text)]
            }
            false => Vec::new(),
        })
        .collect()
}
