//! The modules of `crates/core` form layers (the crates do so by themselves), and within each crate
//! no two files use each other, not even by way of others.

use std::{
    collections::{BTreeMap, BTreeSet},
    fs,
    path::Path,
};

/// The modules of the core in order; each uses only itself and those before it.
const MODULES: [&str; 4] = ["error", "math", "scene", "transport"];

/// The folders of the crates.
const CRATES: [&str; 6] =
    ["crates/core", "crates/results", "crates/files", "crates/show", "crates/studies", "."];

/// Files that only tests use.
const FOR_TESTS: [&str; 3] = ["fuzz", "odds", "tests"];

#[test]
fn a_module_uses_only_those_above_it() {
    let files = sources("crates/core");
    let rank = |file: &str| {
        let module = file.split('/').next().unwrap_or_default();
        let rank = MODULES.iter().position(|known| *known == module);
        rank.unwrap_or_else(|| {
            panic!("crates/core/src/{file}.rs is in none of the modules {MODULES:?}")
        })
    };
    let mut seen = 0;
    for (file, used) in uses(&files) {
        for other in used {
            assert!(rank(&other) <= rank(&file), "{file} uses {other}, which is below it");
            seen += 1;
        }
    }
    assert!(seen > 150, "only {seen} uses were found: does the test still read them?");
}

#[test]
fn no_two_files_use_each_other() {
    for folder in CRATES {
        let mut uses = uses(&sources(folder));
        // removes files that use none of the remaining ones, and files that none of these use: what
        // stays is in a circle, or between two circles
        loop {
            let used: BTreeSet<String> = uses.values().flatten().cloned().collect();
            let before = uses.len();
            uses.retain(|file, of_file| !of_file.is_empty() && used.contains(file));
            let left: BTreeSet<String> = uses.keys().cloned().collect();
            uses.values_mut().for_each(|of_file| of_file.retain(|file| left.contains(file)));
            if uses.len() == before {
                break;
            }
        }
        assert!(uses.is_empty(), "{folder}: files that use each other: {uses:#?}");
    }
}

#[test]
fn the_reader_of_uses_sees_every_form() {
    let files = BTreeMap::from([
        ("a/mod".into(), "//! [`crate::b`]\npub mod c;\npub use c::Thing;".into()),
        ("a/c".into(), "use crate::{b::{X, d::Y}, e};\nfn f() { super::g::h() }".into()),
        ("a/g".into(), "mod k;\nuse k::Z;\n#[cfg(test)]\nmod tests { use crate::e; }".into()),
        ("a/g/k".into(), "use super::super::c;\n".into()),
        ("b".into(), "use crate::math_like::Other;\n".into()),
        ("b/d".into(), "let x = crate::e::W;\n".into()),
        ("e".into(), String::new()),
    ]);
    let expect = [
        ("a/c", vec!["a/g", "b", "b/d", "e"]),
        ("a/g", vec!["a/g/k"]),
        ("a/g/k", vec!["a/c"]),
        ("a/mod", vec![]),
        ("b", vec![]),
        ("b/d", vec!["e"]),
        ("e", vec![]),
    ];
    let found = uses(&files);
    let found: Vec<(&str, Vec<&str>)> = found
        .iter()
        .map(|(file, used)| (file.as_str(), used.iter().map(String::as_str).collect()))
        .collect();
    assert_eq!(found, expect);
}

/// Returns the text of each file below `src/` of the crate in this folder except those of tests, by
/// its path without `.rs`.
fn sources(folder: &str) -> BTreeMap<String, String> {
    let src = Path::new(env!("CARGO_MANIFEST_DIR")).join(folder).join("src");
    let mut found = BTreeMap::new();
    let mut folders = vec![src.clone()];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(folder).expect("a folder of src") {
            let path = entry.expect("an entry of src").path();
            if path.is_dir() {
                folders.push(path);
                continue;
            }
            let file = path.strip_prefix(&src).expect("below src").with_extension("");
            let name = file.file_name().expect("a name").to_string_lossy().into_owned();
            let of_tests = FOR_TESTS.contains(&name.as_str());
            let is_rust = path.extension().is_some_and(|ending| ending == "rs");
            let file = file.to_string_lossy().replace('\\', "/");
            if is_rust && !of_tests && !["lib", "main"].contains(&file.as_str()) {
                found.insert(file, fs::read_to_string(&path).expect("a source file"));
            }
        }
    }
    assert!(found.len() > 5, "only {} files in {folder}/src", found.len());
    found
}

/// Returns, for each file, the files that it uses. What a file passes on from its children (`pub
/// use`) does not count.
fn uses(files: &BTreeMap<String, String>) -> BTreeMap<String, BTreeSet<String>> {
    let mut all = BTreeMap::new();
    for (file, text) in files {
        let code = code(text);
        let own = file.strip_suffix("/mod").unwrap_or(file);
        let children: Vec<&str> = words_after(&code, "mod ");
        let mut paths = Vec::new();
        let mut rest = String::new();
        for line in statements(&code) {
            match line.split_once("use ") {
                Some((before, tree))
                    if ["", "pub ", "pub(crate) ", "pub(super) "].contains(&before) =>
                {
                    let mut of_line = Vec::new();
                    flatten("", tree, &mut of_line);
                    let passed_on = !before.is_empty();
                    let of_child = |path: &String| {
                        children.iter().any(|child| path.split("::").next() == Some(child))
                    };
                    paths.extend(of_line.into_iter().filter(|path| !(passed_on && of_child(path))));
                }
                _ => rest.push_str(line),
            }
        }
        for start in ["crate::", "super::"]
            .into_iter()
            .map(String::from)
            .chain(children.iter().map(|child| format!("{child}::")))
        {
            for (at, _) in rest.match_indices(&start) {
                let follows_a_word =
                    rest[..at].ends_with(|c: char| c.is_alphanumeric() || "_:".contains(c));
                if !follows_a_word {
                    let end = |c: char| !(c.is_alphanumeric() || c == '_' || c == ':');
                    paths.push(rest[at..].split(end).next().unwrap_or_default().to_owned());
                }
            }
        }
        let resolved = paths.iter().filter_map(|path| resolve(path, own, &children, files));
        all.insert(file.clone(), resolved.filter(|used| used != file).collect());
    }
    all
}

/// Returns the text without comments, and without what follows the start of the module of tests.
fn code(text: &str) -> String {
    let text = text.split("#[cfg(test)]\nmod tests {").next().unwrap_or_default();
    let mut code = String::new();
    let mut of_tests = false;
    for line in text.lines() {
        let line = line.trim();
        if !of_tests && !line.starts_with("//") {
            code.push_str(line.split(" // ").next().unwrap_or_default());
            code.push('\n');
        }
        of_tests = line == "#[cfg(test)]";
    }
    code
}

/// Splits code at semicolons, at line ends, and at opening braces that are not in a list of uses.
fn statements(code: &str) -> Vec<&str> {
    let mut found = Vec::new();
    let mut start = 0;
    for (at, c) in code.char_indices() {
        let so_far = code[start..at].trim_start();
        let in_use =
            so_far.starts_with("use ") || (so_far.starts_with("pub") && so_far.contains(" use "));
        if c == ';' || (c == '\n' && !in_use) || (c == '{' && !in_use) {
            found.push(code[start..at].trim());
            start = at + 1;
        }
    }
    found.push(code[start..].trim());
    found
}

/// Returns the names that follow `start` up to a semicolon, which are the children that a file
/// declares.
fn words_after<'a>(code: &'a str, start: &str) -> Vec<&'a str> {
    let lines = code.lines().filter_map(|line| line.split_once(start));
    let declared = lines.filter(|(before, _)| before.is_empty() || before.starts_with("pub"));
    declared.filter_map(|(_, name)| name.strip_suffix(';')).collect()
}

/// Adds the paths of a tree of uses to `found`: `a::{b, c::d}` is `a::b` and `a::c::d`.
fn flatten(before: &str, tree: &str, found: &mut Vec<String>) {
    let tree = tree.trim();
    let Some((head, list)) = tree.split_once('{') else {
        return found.push(format!("{before}{tree}"));
    };
    let before = format!("{before}{}", head.trim());
    let list = list.trim_end().strip_suffix('}').expect("a list of uses ends");
    let (mut depth, mut start) = (0, 0);
    for (at, c) in list.char_indices().chain([(list.len(), ',')]) {
        match c {
            '{' => depth += 1,
            '}' => depth -= 1,
            ',' if depth == 0 => {
                if !list[start..at].trim().is_empty() {
                    flatten(&before, &list[start..at], found);
                }
                start = at + 1;
            }
            _ => {}
        }
    }
}

/// Returns the file that a path leads to from the file `own`, whose children are `children`.
fn resolve(
    path: &str,
    own: &str,
    children: &[&str],
    files: &BTreeMap<String, String>,
) -> Option<String> {
    let mut place: Vec<&str> = own.split('/').collect();
    let mut names = path.split("::").map(str::trim).peekable();
    match *names.peek()? {
        "crate" => {
            names.next();
            place.clear();
        }
        "super" => {
            while names.next_if_eq(&"super").is_some() {
                place.pop();
            }
        }
        "self" => {
            names.next();
        }
        child if children.contains(&child) => {}
        _ => return None,
    }
    place.extend(names);
    // the longest beginning of the path that is a file
    (1..=place.len()).rev().find_map(|length| {
        let file = place[..length].join("/");
        [file.clone(), format!("{file}/mod")].into_iter().find(|file| files.contains_key(file))
    })
}
