//! Splits a Radiance file into words, with their lines.

/// Reads words between white space. A `#` at the beginning of a word makes the rest of the line a
/// comment. A `!` where a primitive may begin makes the line a command, which continues on the next
/// line after a `\` at its end.
pub struct Lexer<'a> {
    rest: &'a str,
    /// Line of the word that was read last, from 1.
    pub line: usize,
    next_line: usize,
}

impl<'a> Lexer<'a> {
    /// Starts at the beginning of a text.
    pub fn new(text: &'a str) -> Self {
        Self { rest: text, line: 1, next_line: 1 }
    }

    fn skip(&mut self, bytes: usize) -> &'a str {
        let (skipped, rest) = self.rest.split_at(bytes);
        self.next_line += skipped.matches('\n').count();
        self.rest = rest;
        skipped
    }

    fn skip_blanks(&mut self) {
        loop {
            let blanks = self.rest.len() - self.rest.trim_start().len();
            self.skip(blanks);
            if !self.rest.starts_with('#') {
                break;
            }
            let comment = self.rest.find('\n').unwrap_or(self.rest.len());
            self.skip(comment);
        }
        self.line = self.next_line;
    }

    /// Returns the next word.
    pub fn word(&mut self) -> Option<&'a str> {
        self.skip_blanks();
        let end = self.rest.find(char::is_whitespace).unwrap_or(self.rest.len());
        (end > 0).then(|| self.skip(end))
    }

    /// Returns the next word without reading it.
    pub fn peek(&mut self) -> Option<&'a str> {
        self.skip_blanks();
        self.rest.split(char::is_whitespace).next().filter(|word| !word.is_empty())
    }

    /// Reads a command and returns its words without the `!`, if a command comes next.
    pub fn command(&mut self) -> Option<Vec<&'a str>> {
        self.skip_blanks();
        if !self.rest.starts_with('!') {
            return None;
        }
        self.skip(1);
        let mut words = Vec::new();
        loop {
            let end = self.rest.find('\n').map_or(self.rest.len(), |at| at + 1);
            let line = self.skip(end).trim_end();
            let (line, goes_on) = match line.strip_suffix('\\') {
                Some(line) => (line, end > 0 && !self.rest.is_empty()),
                None => (line, false),
            };
            words.extend(line.split_whitespace());
            if !goes_on {
                return Some(words);
            }
        }
    }
}
