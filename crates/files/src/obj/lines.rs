//! Splits OBJ and MTL texts into lines and words.

use std::borrow::Cow;

/// Returns the text of a file. Bytes that are not UTF-8 become replacement characters, because they
/// are harmless in a comment. Error: the file is binary or UTF-16.
pub fn decode(bytes: &[u8]) -> std::result::Result<Cow<'_, str>, String> {
    if bytes.iter().take(8192).any(|&b| b == 0) {
        return Err("is not UTF-8 text but binary, or UTF-16".into());
    }
    Ok(String::from_utf8_lossy(bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes)))
}

/// Returns the words of a line up to a comment.
pub fn values(rest: &str) -> impl Iterator<Item = &str> {
    rest.split_ascii_whitespace().take_while(|word| !word.starts_with('#'))
}

/// A line, together with the lines that backslashes join to it.
pub struct Line<'a> {
    /// Number of its first line in the file, from 1.
    pub number: usize,
    text: Cow<'a, str>,
}

impl Line<'_> {
    /// Returns the first word and the rest of the line, without surrounding blanks.
    pub fn split(&self) -> (&str, &str) {
        let text = self.text.trim();
        let (word, rest) = text.split_once([' ', '\t']).unwrap_or((text, ""));
        (word, rest.trim_start())
    }
}

/// The lines of an OBJ or MTL text that are neither empty nor comments.
pub struct Lines<'a> {
    lines: std::iter::Enumerate<std::str::Lines<'a>>,
}

impl<'a> Lines<'a> {
    /// Splits a text into lines.
    pub fn new(text: &'a str) -> Self {
        Self { lines: text.lines().enumerate() }
    }
}

impl<'a> Iterator for Lines<'a> {
    type Item = Line<'a>;

    fn next(&mut self) -> Option<Line<'a>> {
        let (i, first) = self.lines.find(|(_, line)| {
            let line = line.trim_start();
            !line.is_empty() && !line.starts_with('#')
        })?;
        let mut text = Cow::Borrowed(first);
        let mut last = first;
        while let Some(kept) = joined(last) {
            let whole = text.to_mut();
            whole.truncate(whole.len() - (last.len() - kept.len()));
            let Some((_, next)) = self.lines.next() else { break };
            whole.push(' ');
            whole.push_str(next);
            last = next;
        }
        Some(Line { number: i + 1, text })
    }
}

/// Returns the part of the line before a backslash that joins the next line, or `None` if no line
/// is joined. In a comment a backslash joins nothing, because Windows paths end with backslashes.
fn joined(line: &str) -> Option<&str> {
    let kept = line.trim_end().strip_suffix('\\')?;
    let comment = kept.split_ascii_whitespace().any(|word| word.starts_with('#'));
    (!comment).then_some(kept)
}
