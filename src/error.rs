//! The one error type: where, problem, what to do.

use std::fmt;

/// Whose fault it is, and so the exit code.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ErrorKind {
    /// Wrong usage or input: exit code 2.
    Input,
    /// The run itself failed (disk full, ...): exit code 1.
    Run,
}

/// A sentence for a person: where it is, what is wrong there, and what would mend it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Error {
    kind: ErrorKind,
    place: String,
    problem: String,
    remedy: Option<String>,
}

/// Result with the crate's [`Error`].
pub type Result<T> = std::result::Result<T, Error>;

impl Error {
    /// Wrong input at `place` (a file, with JSON pointer or line where there is one).
    pub fn input(place: impl fmt::Display, problem: impl fmt::Display) -> Self {
        Self::new(ErrorKind::Input, place, problem)
    }

    /// The run failed at `place`, through no fault of the input.
    pub fn run(place: impl fmt::Display, problem: impl fmt::Display) -> Self {
        Self::new(ErrorKind::Run, place, problem)
    }

    fn new(kind: ErrorKind, place: impl fmt::Display, problem: impl fmt::Display) -> Self {
        let (place, problem) = (place.to_string(), problem.to_string());
        Self { kind, place, problem, remedy: None }
    }

    /// Adds what to do about it.
    pub fn remedy(mut self, remedy: impl fmt::Display) -> Self {
        self.remedy = Some(remedy.to_string());
        self
    }

    /// The same at another place.
    pub fn at(self, place: impl fmt::Display) -> Self {
        Self { place: place.to_string(), ..self }
    }

    /// Where it is.
    pub fn place(&self) -> &str {
        &self.place
    }

    /// Whose fault it is.
    pub fn kind(&self) -> ErrorKind {
        self.kind
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", OneLine(&self.place), OneLine(&self.problem))?;
        match &self.remedy {
            Some(remedy) => write!(f, "; {}", OneLine(remedy)),
            None => Ok(()),
        }
    }
}

/// Text of which parts may come from a file: without its control characters, and not without end.
struct OneLine<'a>(&'a str);

impl fmt::Display for OneLine<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        const MOST: usize = 1000;
        for c in self.0.chars().take(MOST) {
            match c.is_control() {
                true => write!(f, "{}", c.escape_default())?,
                false => write!(f, "{c}")?,
            }
        }
        if self.0.chars().nth(MOST).is_some() { f.write_str("...") } else { Ok(()) }
    }
}

impl std::error::Error for Error {}

/// A number as a person would write it, however large or small.
pub fn number(value: f64) -> String {
    match value.abs() {
        0.0 => "0".into(),
        1e-5..1e15 => value.to_string(),
        _ => format!("{value:e}"),
    }
}

/// The name in `known` nearest to `name`, where one is near enough to be a typo.
pub fn nearest<'a>(name: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    // comparing takes time and memory of the product of the lengths
    let short = |name: &str| name.len() <= 100;
    known
        .into_iter()
        .filter(|k| short(k) && short(name))
        .map(|k| (strsim::damerau_levenshtein(name, k), k))
        .filter(|(distance, k)| *distance <= (k.len().max(name.len()) / 2).max(1))
        .min_by_key(|(distance, _)| *distance)
        .map(|(_, k)| k)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sentence_stays_on_one_line_and_has_an_end() {
        let error = Error::input("a\nb", "x".repeat(1_000_000)).remedy("\u{1b}[2J");
        let sentence = error.to_string();
        assert!(sentence.starts_with("a\\nb: xxx"), "{sentence}");
        assert!(sentence.ends_with("x...; \\u{1b}[2J"), "{sentence}");
        assert!(sentence.len() < 1100);
    }

    #[test]
    fn numbers_are_short() {
        for (value, text) in
            [(-0.0, "0"), (75.0, "75"), (-0.1, "-0.1"), (1e300, "1e300"), (5e-324, "5e-324")]
        {
            assert_eq!(number(value), text);
        }
    }

    #[test]
    fn a_typo_is_near_and_a_novel_is_not() {
        assert_eq!(nearest("bnads", ["unit", "bands"]), Some("bands"));
        assert_eq!(nearest("water", ["unit", "bands"]), None);
        assert_eq!(nearest(&"x".repeat(100_000_000), ["unit"]), None);
    }
}
