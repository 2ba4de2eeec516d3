//! Text in XML and in pages. XML has no way to write most control characters, so that a parser
//! refuses a file with one of them, however it came there.

use std::borrow::Cow;

/// Returns the text with U+FFFD, the character for what cannot be shown, in place of each character
/// that XML 1.0 does not allow, and of all other control characters but tabs and line ends.
pub fn allowed(text: &str) -> Cow<'_, str> {
    let refused = |c: char| {
        (c.is_control() && !matches!(c, '\t' | '\n' | '\r')) || matches!(c, '\u{fffe}' | '\u{ffff}')
    };
    match text.contains(refused) {
        true => text.replace(refused, "\u{fffd}").into(),
        false => text.into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_no_parser_reads_is_replaced() {
        assert_eq!(allowed("a leaf, 20 °C\n\tµmol"), "a leaf, 20 °C\n\tµmol");
        assert_eq!(
            allowed("a\u{1b}b\0\u{7f}\u{9b}\u{ffff}c"),
            "a\u{fffd}b\u{fffd}\u{fffd}\u{fffd}\u{fffd}c"
        );
    }
}
