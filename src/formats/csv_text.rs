//! Texts in CSV files that we write. A spreadsheet takes a cell that begins with `=`, say, for a formula, and a
//! formula can run a program; so an apostrophe goes before such a text, as OWASP advises ("CSV Injection"), and
//! before one that begins with an apostrophe itself: whoever takes the first apostrophe away has the text.

use std::borrow::Cow;

/// What a formula may begin with: the characters that OWASP names, those of double width among them.
const FORMULA: [char; 12] =
    ['=', '+', '-', '@', '\t', '\r', '\n', '\0', '\u{ff1d}', '\u{ff0b}', '\u{ff0d}', '\u{ff20}'];

/// The cell for a text; not for numbers, which may begin with a sign.
pub fn cell(text: &str) -> Cow<'_, str> {
    match text.starts_with('\'') || text.starts_with(FORMULA) {
        true => format!("'{text}").into(),
        false => text.into(),
    }
}

/// The text of a cell.
pub fn text(cell: &str) -> &str {
    cell.strip_prefix('\'').unwrap_or(cell)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_text_is_a_formula_and_all_read_back() {
        for start in FORMULA.iter().chain(&['\'']) {
            let name = format!("{start}1+1");
            assert_eq!(cell(&name), format!("'{name}"));
            assert_eq!(text(&cell(&name)), name);
        }
        for name in ["", "leaf", "a=b", "plants/leaf-1", "\"=1\"", "1e-3"] {
            assert_eq!(cell(name), name);
            assert_eq!(text(&cell(name)), name);
        }
    }
}
