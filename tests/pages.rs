//! README.md and the pages of docs/ are easy to read as text: no line of prose is longer than 100
//! characters. What docs/results.md says of each quantity is what the registry says.

use std::{fs, path::Path};

use phylux::results::{QUANTITIES, Quantity};

/// Returns the lines of prose of a page that are too long, with their numbers. Lines of code and of
/// tables are left out, and so are lines without a space to break them at.
fn long_lines(page: &str) -> Vec<(usize, &str)> {
    let (mut fenced, mut blank, mut code, mut long) = (false, true, false, Vec::new());
    for (number, line) in page.lines().enumerate() {
        if line.starts_with("```") {
            fenced = !fenced;
        }
        code = line.starts_with("    ") && (blank || code);
        blank = line.trim().is_empty();
        let prose = !(fenced || code || line.starts_with(['|', '#']) || line.starts_with("<!--"));
        if prose && line.chars().count() > 100 && line.trim().contains(' ') {
            long.push((number + 1, line));
        }
    }
    long
}

#[test]
fn lines_of_prose_are_not_longer_than_100() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let entries = ["docs", "docs/notes", "docs/coming-from", "docs/python"]
        .map(|folder| fs::read_dir(root.join(folder)).expect(folder));
    let pages = entries.into_iter().flatten().map(|entry| entry.expect("an entry").path());
    let pages = pages.filter(|path| path.extension().is_some_and(|ending| ending == "md"));
    for path in ["README.md", "CHANGELOG.md", "CONTRIBUTING.md"]
        .map(|name| root.join(name))
        .into_iter()
        .chain(pages)
    {
        let page = fs::read_to_string(&path).expect("a page");
        assert_eq!(long_lines(&page), [], "{}", path.display());
    }
}

#[test]
fn long_prose_is_told_from_code_and_tables() {
    let long = "word ".repeat(30);
    let page = format!(
        "{long}\n\n    {long}\n| {long}\n```\n{long}\n```\n- a\n  {long}\n{}\n",
        "x".repeat(200)
    );
    let lines: Vec<usize> = long_lines(&page).into_iter().map(|(number, _)| number).collect();
    assert_eq!(lines, [1, 9]);
}

/// Returns the names of quantities by the parts of a table in which they stand, as the page has them.
fn names(part: fn(&Quantity) -> Option<u8>, is_in: fn(u8) -> bool) -> String {
    let found = QUANTITIES.iter().filter_map(|of| Some((part(of).filter(|p| is_in(*p))?, of.name)));
    let mut found: Vec<(u8, &str)> = found.collect();
    found.sort_by_key(|(part, _)| *part);
    found.iter().map(|(_, name)| format!("`{name}`")).collect::<Vec<_>>().join(", ")
}

#[test]
fn the_page_of_results_is_made_from_the_registry() {
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/results.md");
    let page = fs::read_to_string(page).expect("docs/results.md");
    let mut lines = Vec::new();
    for [keys, meaning] in QUANTITIES.iter().map(|quantity| quantity.docs) {
        if !keys.is_empty() {
            lines.push(format!("| {keys} | {meaning} |"));
        }
    }
    assert!(lines.len() > 5);
    lines.push(format!(
        "| `quantity` | {}, and after all captors {}; for groups of several captors {}; ",
        names(|of| of.captor_rows, |part| part == 0),
        names(|of| of.captor_rows, |part| part > 0),
        names(|of| of.group_rows, |_| true),
    ));
    for line in lines {
        assert!(
            page.lines().any(|own| own.starts_with(&line)),
            "docs/results.md must have\n{line}"
        );
    }
}

/// Names are names of one quantity alone, and what results only carry has all that is read from its
/// entry.
#[test]
fn the_registry_of_quantities_is_whole() {
    for (i, quantity) in QUANTITIES.iter().enumerate() {
        let Quantity { name, array, .. } = quantity;
        let same = |other: &Quantity| other.name == *name || other.array == *array;
        assert!(!QUANTITIES[..i].iter().any(same), "{name}");
        assert!(std::ptr::eq(Quantity::named(name), quantity));
        if quantity.is_own() {
            assert!(!quantity.meaning.is_empty() && !quantity.docs[0].is_empty(), "{name}");
            // the first part is that of light by band
            assert!(quantity.captor_rows.is_some_and(|part| part > 0), "{name}");
            assert!(!quantity.is_of_faces() && !name.ends_with("_se"), "{name}");
        }
    }
}
