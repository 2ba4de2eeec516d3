//! The pages of docs/ as a site: each page is in the contents, and links lead to files that exist.

use std::{
    fs,
    path::{Path, PathBuf},
    process::Command,
};

fn docs() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("docs")
}

/// Returns the pages of docs/, each with its name within docs/ and its text.
fn pages() -> Vec<(String, String)> {
    let files = |folder: &str| {
        let entries = fs::read_dir(docs().join(folder)).expect("a folder");
        let paths = entries.map(|entry| entry.expect("an entry").path());
        paths.filter(|path| path.extension().is_some_and(|e| e == "md")).collect::<Vec<_>>()
    };
    let name = |path: &Path| {
        let within = path.strip_prefix(docs()).expect("in docs");
        within.to_string_lossy().replace('\\', "/")
    };
    let pages =
        [files(""), files("notes"), files("coming-from"), files("python")].concat().into_iter();
    pages.map(|path| (name(&path), fs::read_to_string(&path).expect("a page"))).collect()
}

/// Returns the targets of the links and pictures of a page, except web addresses.
fn links(text: &str) -> impl Iterator<Item = &str> {
    let targets = text.split("](").skip(1).filter_map(|rest| rest.split(')').next());
    targets.filter(|target| !target.contains("://") && !target.contains(char::is_whitespace))
}

#[test]
fn every_page_is_in_the_contents() {
    let pages = pages();
    let (_, contents) = pages.iter().find(|(name, _)| name == "SUMMARY.md").expect("contents");
    let named: Vec<&str> = links(contents).collect();
    for (name, _) in pages.iter().filter(|(name, _)| name != "SUMMARY.md") {
        assert!(named.contains(&name.as_str()), "{name} is not in docs/SUMMARY.md");
    }
    assert!(named.len() > 10, "{named:?}");
}

/// Returns the anchor that a heading has on GitHub and in the book.
fn anchor(heading: &str) -> String {
    let kept = heading.trim_start_matches('#').trim().chars().filter_map(|c| match c {
        ' ' => Some('-'),
        c if c.is_alphanumeric() || c == '-' || c == '_' => Some(c.to_ascii_lowercase()),
        _ => None,
    });
    kept.collect()
}

/// Returns the texts between quotation marks in a file of the program, without those of its tests.
fn texts(source: &str) -> Vec<String> {
    let code = source.split("#[cfg(test)]").next().unwrap_or_default();
    let lines = code.lines().filter(|line| !line.trim_start().starts_with("//"));
    let code = lines.collect::<Vec<_>>().join("\n").replace("'\"'", "' '");
    let (mut texts, mut text) = (Vec::new(), None::<String>);
    let mut chars = code.chars().peekable();
    while let Some(c) = chars.next() {
        match (c, &mut text) {
            ('"', None) => text = Some(String::new()),
            ('"', Some(_)) => texts.extend(text.take()),
            ('\\', Some(_)) if chars.peek() == Some(&'\n') => {
                while chars.next_if(|c| c.is_whitespace()).is_some() {}
            }
            ('\\', Some(text)) => text.extend(chars.next()),
            (c, Some(text)) => text.push(c),
            _ => {}
        }
    }
    texts
}

/// Returns a text without what is filled in, and the pages that it names with their headings.
fn without_links(text: &str) -> (String, Vec<String>) {
    let (mut rest, mut links) = (text.to_owned(), Vec::new());
    while let Some(start) = rest.find("docs/") {
        let end = rest[start..].find([')', ' ', ',', '`']).map_or(rest.len(), |end| start + end);
        links.push(rest[start..end].to_owned());
        rest.replace_range(start..end, "");
    }
    while let Some((start, end)) = rest.find('{').zip(rest.find('}')).filter(|(a, b)| a < b) {
        rest.replace_range(start..=end, "");
    }
    (rest, links)
}

/// A warning is one line: at most so many characters beside names, numbers and the page where more
/// stands. Each page that the program names is there, with the heading.
#[test]
fn warnings_are_short_and_name_pages_that_exist() {
    const MOST: usize = 160;
    const OF_WARNINGS: [&str; 8] = [
        "crates/results/src/result/warnings.rs",
        "crates/studies/src/year",
        "crates/studies/src/check",
        "crates/studies/src/calibrate",
        "crates/files/src/scene_file/",
        "crates/files/src/weather/clock.rs",
        "crates/files/src/weather/period.rs",
        "crates/files/src/mesh_file/",
    ];
    let root = docs().parent().expect("the root").to_path_buf();
    let mut folders = vec![root.join("crates"), root.join("src")];
    let (mut looked_at, mut followed) = (0, 0);
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(folder).expect("a folder") {
            let path = entry.expect("an entry").path();
            let name = path.strip_prefix(&root).expect("a path inside").display().to_string();
            let name = name.replace('\\', "/");
            if path.is_dir() {
                folders.push(path);
                continue;
            }
            if !name.ends_with(".rs") || name.ends_with("/tests.rs") || name.ends_with("/fuzz.rs") {
                continue;
            }
            let warns = OF_WARNINGS.iter().any(|start| name.starts_with(start));
            for text in texts(&fs::read_to_string(&path).expect("a file")) {
                let (own, links) = without_links(&text);
                let length = own.trim_end_matches(" ()").chars().count();
                assert!(!warns || length <= MOST, "{name}: {length} characters: {text}");
                looked_at += usize::from(warns && length > 60);
                for (page, heading) in links.iter().filter_map(|link| link.split_once('#')) {
                    let page = fs::read_to_string(root.join(page)).unwrap_or_default();
                    let mut headings = page.lines().filter(|line| line.starts_with('#'));
                    assert!(headings.any(|line| anchor(line) == heading), "{name}: {text}");
                    followed += 1;
                }
            }
        }
    }
    assert!(looked_at > 100 && followed > 30, "{looked_at} {followed}");
}

#[test]
fn links_lead_somewhere() {
    let mut followed = 0;
    for (name, text) in pages() {
        for target in links(&text) {
            let (file, heading) = target.split_once('#').unwrap_or((target, ""));
            let own = docs().join(&name);
            let beside = own.parent().expect("a folder").join(file);
            let path = if file.is_empty() { own } else { beside };
            assert!(path.exists(), "docs/{name}: {target} leads nowhere");
            if !heading.is_empty() && path.extension().is_some_and(|e| e == "md") {
                let page = fs::read_to_string(&path).expect("a page");
                let mut headings = page.lines().filter(|line| line.starts_with('#'));
                assert!(headings.any(|line| anchor(line) == heading), "docs/{name}: {target}");
            }
            followed += 1;
        }
    }
    assert!(followed > 60, "{followed}");
}

/// Returns the files in a folder and its subfolders whose names have this ending.
fn files(folder: &Path, ending: &str) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).expect("a folder").map(|entry| entry.expect("an entry"));
    let of_entry = |path: PathBuf| match path.is_dir() {
        true => files(&path, ending),
        false => vec![path],
    };
    let all = entries.flat_map(|entry| of_entry(entry.path()));
    all.filter(|path| path.extension().is_some_and(|e| e == ending)).collect()
}

/// mdBook builds the site with its search, and the target of every link and picture exists.
#[test]
#[ignore = "needs mdBook"]
fn needs_mdbook_the_site_is_whole() {
    let site = tempfile::tempdir().expect("a folder");
    let mut mdbook = Command::new("mdbook");
    mdbook.args(["build", "--dest-dir"]).arg(site.path()).arg(docs());
    let output = mdbook.output().expect("install mdBook: none is on the PATH");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let mut followed = 0;
    for path in files(site.path(), "html") {
        // left out: the whole book on one page, which repeats the others, and pages that a server
        // may show anywhere
        let name = path.file_name().and_then(|name| name.to_str()).unwrap_or_default();
        if ["print.html", "404.html", "toc.html"].contains(&name) {
            continue;
        }
        let page = fs::read_to_string(&path).expect("a page");
        let after = |mark: &'static str| page.split(mark).skip(1);
        for target in after(" href=\"").chain(after(" src=\"")) {
            let target = target.split(['"', '#']).next().unwrap_or_default();
            if target.is_empty() || target.contains(':') {
                continue;
            }
            let file = path.parent().expect("a folder").join(target);
            assert!(file.exists(), "{}: {target} leads nowhere", path.display());
            followed += 1;
        }
    }
    assert!(followed > 500, "{followed}");
    assert!(
        files(site.path(), "js").iter().any(|path| path.to_string_lossy().contains("searchindex"))
    );
}

/// Returns whether a pattern of `include` in Cargo.toml matches this file. A pattern is a file, a
/// folder, or a name with one `*`.
fn includes(pattern: &str, file: &str) -> bool {
    let pattern = pattern.trim_start_matches('/');
    match pattern.split_once('*') {
        None => file == pattern || file.starts_with(&format!("{pattern}/")),
        Some((before, after)) => {
            let middle = file.strip_prefix(before).and_then(|rest| rest.strip_suffix(after));
            middle.is_some_and(|middle| !middle.contains('/'))
        }
    }
}

#[test]
fn the_readme_leads_to_files_of_the_package() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let manifest = fs::read_to_string(root.join("Cargo.toml")).expect("a manifest");
    let list = manifest.split_once("\ninclude = [").and_then(|(_, rest)| rest.split_once(']'));
    let list = list.expect("a list of files").0;
    let patterns: Vec<&str> = list.split('"').skip(1).step_by(2).collect();
    assert!(includes("/docs/*.md", "docs/a.md") && !includes("/docs/*.md", "docs/notes/a.md"));
    let readme = fs::read_to_string(root.join("README.md")).expect("the README");
    let mut followed = 0;
    for target in links(&readme) {
        let file = match target.split('#').next() {
            // a section of the README itself
            None | Some("") => "README.md",
            Some(file) => file,
        };
        assert!(root.join(file).is_file(), "README.md: {target} leads nowhere");
        // the files of the other crates are in their own packages
        let included =
            file.starts_with("crates/") || patterns.iter().any(|pattern| includes(pattern, file));
        assert!(included, "README.md: {target} is not in the package (`include` in Cargo.toml)");
        followed += 1;
    }
    assert!(followed > 15, "{followed}");
}
