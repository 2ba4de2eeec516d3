//! Text cells of the CSV files that phylux writes.
//!
//! A spreadsheet takes a cell that begins with `=`, for example, for a formula, and a formula can
//! run a program. Therefore an apostrophe is put before such a text, as OWASP advises ("CSV
//! Injection"). An apostrophe is also put before a text that begins with one itself, so that
//! removing the first apostrophe always gives the text back.
//!
//! A terminal obeys control characters, and some readers end at a NUL. Therefore they stand as codes
//! like `\u{1b}`, apart from tabs and line ends.

use std::borrow::Cow;

/// The characters that a formula may begin with: those that OWASP names, including those of double
/// width.
const FORMULA: [char; 12] =
    ['=', '+', '-', '@', '\t', '\r', '\n', '\0', '\u{ff1d}', '\u{ff0b}', '\u{ff0d}', '\u{ff20}'];

/// Returns the cell for a text. It is not meant for numbers, which may begin with a sign.
pub fn cell(text: &str) -> Cow<'_, str> {
    let obeyed = |c: char| c.is_control() && !matches!(c, '\t' | '\n' | '\r');
    if text.contains(obeyed) {
        let code = |c: char| match obeyed(c) {
            true => c.escape_default().to_string(),
            false => c.to_string(),
        };
        return cell(&text.chars().map(code).collect::<String>()).into_owned().into();
    }
    match text.starts_with('\'') || text.starts_with(FORMULA) {
        true => format!("'{text}").into(),
        false => text.into(),
    }
}

/// Returns the text of a cell that [`cell`] made.
pub fn text(cell: &str) -> &str {
    cell.strip_prefix('\'').unwrap_or(cell)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_text_is_a_formula_and_all_read_back() {
        for start in FORMULA.iter().filter(|c| **c != '\0').chain(&['\'']) {
            let name = format!("{start}1+1");
            assert_eq!(cell(&name), format!("'{name}"));
            assert_eq!(text(&cell(&name)), name);
        }
        assert_eq!(cell("a\u{1b}[2J\0"), "a\\u{1b}[2J\\u{0}");
        assert_eq!(cell("=\u{7}"), "'=\\u{7}");
        for name in ["", "leaf", "a=b", "plants/leaf-1", "\"=1\"", "1e-3"] {
            assert_eq!(cell(name), name);
            assert_eq!(text(&cell(name)), name);
        }
    }
}
