//! Tables, no wider than their page: columns that find no room stand below the others.

use std::{fmt::Write, ops::Range};

use super::Page;

/// The usual width of the names of rows, and the usual and the least one of a column, characters.
/// Columns are as narrow as it takes to stand in fewer parts, one below the other.
const NAMES: usize = 24;
const COLUMN: usize = 10;
const NARROW: usize = 2;
/// Longer names are shortened in the middle where not all is asked for.
const LONGEST: usize = 40;

/// Rows of cells under a head.
#[derive(Debug, Default)]
pub struct Table {
    title: String,
    columns: Vec<String>,
    /// The head of what stands behind the last column.
    last: String,
    rows: Vec<Row>,
}

#[derive(Debug)]
struct Row {
    name: String,
    cells: Vec<String>,
    /// What stands behind the last cell.
    last: String,
}

impl Table {
    /// Makes a table without rows; `last` is the head of what stands behind the last column of rows.
    pub fn new(
        title: impl Into<String>,
        columns: impl IntoIterator<Item = impl Into<String>>,
        last: impl Into<String>,
    ) -> Self {
        let columns = columns.into_iter().map(Into::into).collect();
        Self { title: title.into(), columns, last: last.into(), rows: Vec::new() }
    }

    /// Adds a row. One that has fewer cells than the table has columns ends early.
    pub fn row(
        &mut self,
        name: impl Into<String>,
        cells: impl IntoIterator<Item = String>,
        last: impl Into<String>,
    ) {
        let cells = cells.into_iter().collect();
        self.rows.push(Row { name: name.into(), cells, last: last.into() });
    }

    /// Returns whether it has no row.
    pub fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }

    /// Writes the table below an empty line.
    pub fn below(&self, text: &mut String, page: &Page) {
        text.push('\n');
        self.write(text, page);
    }

    /// Writes the table into lines that the page has room for, if names and cells allow it.
    pub fn write(&self, text: &mut String, page: &Page) {
        let Page { width, full, .. } = *page;
        let longest = if full { usize::MAX } else { LONGEST };
        let names: Vec<String> =
            self.rows.iter().map(|row| shortened(&row.name, longest)).collect();
        let count = |text: &String| text.chars().count();
        let name = names.iter().chain([&self.title]).map(count).max().unwrap_or(0);
        let column = |i: usize| {
            let cells = self.rows.iter().filter_map(|row| row.cells.get(i));
            cells.chain(self.columns.get(i)).map(count).max().unwrap_or(0) + 1
        };
        let last = self.rows.iter().map(|row| &row.last).chain([&self.last]).map(count).max();
        let last = last.filter(|last| *last > 0).map_or(0, |last| last + 3);
        let least: Vec<usize> = (0..self.columns.len()).map(column).collect();
        let widths = |column: usize| least.iter().map(|own| (*own).max(column)).collect::<Vec<_>>();
        let laid = (NARROW..=COLUMN).rev().map(|column| {
            let widths = widths(column);
            (parts(&widths, name, last, width), widths)
        });
        let fewest = laid.min_by_key(|(parts, _)| parts.len());
        let (parts, widths) = fewest.unwrap_or_default();
        // names have room where there is enough
        let spare = width.saturating_sub(widths.iter().sum::<usize>() + last);
        let name = name.max(NAMES.min(spare));
        for Range { start: from, end: to } in parts {
            let mut line = |name_of: &str, cells: &[String], end: &str| {
                let mut line = format!("{name_of:<name$}");
                for (cell, width) in cells.iter().zip(&widths).take(to).skip(from) {
                    let _ = write!(line, "{cell:>width$}");
                }
                if to == widths.len() && !end.is_empty() {
                    let _ = write!(line, "   {end}");
                }
                let _ = writeln!(text, "{}", line.trim_end());
            };
            line(&self.title, &self.columns, &self.last);
            for (name, row) in names.iter().zip(&self.rows) {
                if row.cells.len() > from || from == 0 {
                    line(name, &row.cells, &row.last);
                }
            }
        }
    }
}

/// Returns the columns of each part of a table: as many as have room beside the names; what stands
/// behind the last column goes with it.
fn parts(widths: &[usize], name: usize, last: usize, width: usize) -> Vec<Range<usize>> {
    let mut parts: Vec<Range<usize>> = Vec::new();
    let mut from = 0;
    loop {
        let (mut to, mut used) = (from, name);
        while to < widths.len() && (to == from || used + widths[to] <= width) {
            used += widths[to];
            to += 1;
        }
        if to == widths.len() && to > from + 1 && used + last > width {
            to -= 1;
        }
        parts.push(from..to);
        if to == widths.len() {
            return parts;
        }
        from = to;
    }
}

/// Returns a text of at most so many characters, with an ellipsis in the middle of a longer one.
fn shortened(text: &str, most: usize) -> String {
    let count = text.chars().count();
    if count <= most {
        return text.into();
    }
    let end = (most - 1) / 2;
    let begin: String = text.chars().take(most - 1 - end).collect();
    let end: String = text.chars().skip(count - end).collect();
    format!("{begin}…{end}")
}

#[cfg(test)]
mod tests {
    use super::*;
    use phylux_core::error::CommandLine;

    fn page(width: usize, full: bool) -> Page {
        Page { width, full, spelling: &CommandLine }
    }

    /// Each cell stands once, below its head, and no line is too wide; the last word of rows stands
    /// behind the last column.
    #[test]
    fn columns_that_find_no_room_stand_below() {
        for (columns, width) in [(3, 80), (6, 80), (12, 80), (31, 80), (12, 120)] {
            let heads: Vec<String> = (0..columns).map(|i| format!("band {i}")).collect();
            let mut table = Table::new("lights, W", heads.clone(), "error");
            for row in 0..3 {
                let cells = (0..columns).map(|i| format!("{row}.{i:02}"));
                table.row(format!("  lamp {row}"), cells, "0.35 (0.12 to 12) %");
            }
            let mut text = String::new();
            table.write(&mut text, &page(width, false));
            assert!(text.lines().all(|line| line.chars().count() <= width), "{text}");
            for head in &heads {
                let found = text.split_whitespace().collect::<Vec<_>>().join(" ");
                assert!(found.contains(head.as_str()), "{head}: {text}");
            }
            for row in 0..3 {
                for i in 0..columns {
                    let cell = format!("{row}.{i:02}");
                    assert_eq!(
                        text.split_whitespace().filter(|w| **w == cell).count(),
                        1,
                        "{text}"
                    );
                }
            }
            assert_eq!(text.matches("0.35 (0.12 to 12) %").count(), 3, "{text}");
        }
    }

    /// A table that fits the page by narrower columns is not parted.
    #[test]
    fn columns_are_narrow_before_they_are_parted() {
        let mut table = Table::new("6 surfaces, W/m2", ["min", "median", "max"], "error: median");
        let cells = || ["33.31", "33.34", "33.36"].map(String::from);
        table.row("  k nearest, at the middle", cells(), "0.058 (0.056 to 0.060) %");
        for (wide, lines) in [(80, 2), (120, 2), (70, 4)] {
            let mut text = String::new();
            table.write(&mut text, &page(wide, false));
            assert_eq!(text.lines().count(), lines, "{text}");
            assert!(text.lines().all(|line| line.chars().count() <= wide), "{text}");
        }
    }

    #[test]
    fn long_names_are_shortened() {
        let name = "greenhouse-bay-with-a-long-name/tomato-leaf3#10";
        assert_eq!(shortened(name, 20).chars().count(), 20);
        assert!(shortened(name, 20).ends_with("leaf3#10"));
        assert_eq!(shortened("short", 20), "short");
        let mut table = Table::new("a", ["x"], "");
        table.row(name, ["1".to_string()], "");
        let mut text = String::new();
        table.write(&mut text, &page(80, true));
        assert!(text.contains(name), "{text}");
    }
}
