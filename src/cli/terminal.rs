//! All output to the terminal. Names come from files of other people, and a terminal obeys some
//! characters: these are shown as their codes and not sent.

use std::{
    borrow::Cow,
    io::{self, IsTerminal, Write},
    sync::{
        Mutex,
        atomic::{AtomicBool, Ordering},
    },
};

use phylux_core::error::{CommandLine, Error, ErrorKind, Result, Words, lock};
use phylux_studies::text::Page;
use terminal_size::{Height, Width, terminal_size_of};

/// Whether only results, warnings and errors are printed (`--quiet`).
static QUIET: AtomicBool = AtomicBool::new(false);
/// Whether the standard output is taken by a result, so that all other text goes to the standard
/// error.
static TAKEN: AtomicBool = AtomicBool::new(false);

/// Whether tables have all their rows and bands (`--full`).
static FULL: AtomicBool = AtomicBool::new(false);

/// The name of the command, which what is said of its interruption begins with.
static COMMAND: Mutex<String> = Mutex::new(String::new());

/// Names the command that begins.
pub fn name(command: &str) {
    command.clone_into(&mut lock(&COMMAND));
}

/// Begins a command: says whether it is quiet and whether its tables are full, and frees the standard
/// output.
pub fn begin(quiet: bool, full: bool) {
    QUIET.store(quiet, Ordering::Relaxed);
    FULL.store(full, Ordering::Relaxed);
    TAKEN.store(false, Ordering::Relaxed);
}

/// Whether only results, warnings and errors are printed.
pub fn is_quiet() -> bool {
    QUIET.load(Ordering::Relaxed)
}

/// Whether tables have all their rows and bands.
pub fn is_full() -> bool {
    FULL.load(Ordering::Relaxed)
}

/// Returns the page that texts are written for.
pub fn page() -> Page {
    let size = terminal_size_of(io::stdout());
    let width = size.map_or(Page::WIDTH, |(width, _)| usize::from(width.0).max(Page::WIDTH));
    Page { width, full: is_full(), spelling: &CommandLine }
}

/// Returns how many of the rows of a table are shown: so many, or all if these are asked for.
pub fn shown(most: usize) -> usize {
    page().shown(most)
}

/// Returns the line that stands below a table if it has more rows than are shown; nothing otherwise.
pub fn more(count: usize, most: usize) -> String {
    page().more(count, most)
}

/// Takes the standard output for a result. Error: another result has taken it.
pub fn take_output() -> Result<()> {
    match TAKEN.swap(true, Ordering::Relaxed) {
        false => Ok(()),
        true => Err(Error::input("-", "the standard output is named for two outputs")
            .remedy("write one of them to a file")),
    }
}

/// Prints a summary, unless the command is quiet: to the standard output, or to the standard error
/// if a result has taken the standard output. On a terminal, long lines break between words.
pub fn print(text: &str) -> Result<()> {
    match (is_quiet(), TAKEN.load(Ordering::Relaxed)) {
        (true, _) => Ok(()),
        (false, true) => {
            complain(text);
            Ok(())
        }
        (false, false) => print_result(&on(terminal_size_of(io::stdout()), text)),
    }
}

/// Returns the text as a terminal of this size shows it best; where there is none, as it is.
fn on(size: Option<(Width, Height)>, text: &str) -> Cow<'_, str> {
    match size {
        Some((columns, _)) if !is_full() => {
            wrapped(text, usize::from(columns.0).max(Page::WIDTH)).into()
        }
        _ => text.into(),
    }
}

/// Breaks lines of more than so many characters between words; what goes on is indented by two more.
fn wrapped(text: &str, width: usize) -> String {
    let mut all = String::with_capacity(text.len());
    for line in text.split_inclusive('\n') {
        let (words, end) = line.strip_suffix('\n').map_or((line, ""), |words| (words, "\n"));
        let (mut rest, mut first) = (words, true);
        // what is far to the right already goes on at the left, where there is room
        let indent = (words.len() - words.trim_start().len()).min(width / 2);
        loop {
            let room = width - if first { 0 } else { indent + 2 };
            let fit = rest.char_indices().nth(room).map(|(at, _)| &rest[..at]);
            // a word that is longer than a line stays whole
            let cut =
                fit.and_then(|fit| fit.rfind(' ')).filter(|&at| !rest[..at].trim().is_empty());
            if !first {
                all.extend(std::iter::repeat_n(' ', indent + 2));
            }
            let Some(cut) = cut else {
                all.push_str(rest);
                break;
            };
            all.push_str(rest[..cut].trim_end());
            all.push('\n');
            (rest, first) = (rest[cut..].trim_start(), false);
        }
        all.push_str(end);
    }
    all
}

/// Prints the result of a command to the standard output. A reader that has closed the pipe has
/// read enough: that is no error.
pub fn print_result(text: &str) -> Result<()> {
    let mut out = io::stdout().lock();
    match out.write_all(harmless(text).as_bytes()).and_then(|()| out.flush()) {
        Err(e) if e.kind() != io::ErrorKind::BrokenPipe => Err(Error::run("terminal", e)),
        _ => Ok(()),
    }
}

/// Returns sentences as the command line spells them.
pub fn spelled(sentences: &[Words]) -> Vec<String> {
    sentences.iter().map(|words| words.spelled(&CommandLine)).collect()
}

/// Prints a line for each warning.
pub fn warn(warnings: &[String]) {
    for warning in warnings {
        complain(&format!("warning: {}\n", warning.replace('\n', "\\n")));
    }
}

/// Prints the line of an error. Where the user has interrupted the command, it is the command that the
/// error names, whatever work was under way.
pub fn fail(error: &Error) {
    let command = lock(&COMMAND).clone();
    match (error.kind(), command.is_empty()) {
        (ErrorKind::Interrupted, false) => {
            complain(&format!("error: {}\n", error.clone().at(command)))
        }
        _ => complain(&format!("error: {error}\n")),
    }
}

/// Clears the line of a progress bar that nobody will end.
pub fn clear_line() {
    if !is_quiet() && io::stderr().is_terminal() {
        let _ = io::stderr().write_all(b"\r\x1b[2K");
    }
}

/// Prints lines to the standard error, such as warnings. If no one reads there, that is no error.
pub fn complain(text: &str) {
    let text = on(terminal_size_of(io::stderr()), text);
    let _ = io::stderr().write_all(harmless(&text).as_bytes());
}

/// Returns the text with all its lines, but with the code of each character that would move the
/// cursor, change colours or turn the direction of writing, in place of the character.
pub fn harmless(text: &str) -> Cow<'_, str> {
    let obeyed = |c: char| {
        let turns = matches!(c, '\u{200e}' | '\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}');
        c != '\n' && c.is_control() || turns
    };
    if !text.contains(obeyed) {
        return text.into();
    }
    let mut shown = String::with_capacity(text.len());
    for c in text.chars() {
        match obeyed(c) {
            true => shown.extend(c.escape_default()),
            false => shown.push(c),
        }
    }
    shown.into()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Lines break between words and go on indented, short ones and words without an end stay whole,
    /// and no word is lost.
    #[test]
    fn long_lines_break_between_words() {
        let long =
            "  warning: the errors at 331 of 720 faces rest on few paths; trace more (docs/a.md#b)";
        let text = format!("short\n{long}\n{}\n\n", "x".repeat(90));
        let found = wrapped(&text, 40);
        assert_eq!(
            found.split_whitespace().collect::<Vec<_>>(),
            text.split_whitespace().collect::<Vec<_>>()
        );
        let lines: Vec<&str> = found.lines().collect();
        assert!(lines[1..4].iter().all(|line| line.chars().count() <= 40), "{found}");
        assert!(lines[2].starts_with("    ") && !lines[2].starts_with("     "), "{found}");
        assert_eq!((lines.len(), lines[4].len(), lines[5]), (6, 90, ""));
        assert_eq!(wrapped("a\nb", 80), "a\nb");
        let far = format!("{}two words", " ".repeat(50));
        assert_eq!(wrapped(&far, 40).split_whitespace().count(), 2);
    }

    #[test]
    fn no_terminal_obeys_a_name() {
        assert_eq!(harmless("a leaf, 20 °C\nµmol\n"), "a leaf, 20 °C\nµmol\n");
        let name = "\u{1b}[2J\u{9b}31m\r\u{7}\u{202e}\u{7f}";
        assert_eq!(harmless(name), r"\u{1b}[2J\u{9b}31m\r\u{7}\u{202e}\u{7f}");
    }
}
