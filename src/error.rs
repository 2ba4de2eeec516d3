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
        write!(f, "{}: {}", self.place, self.problem)?;
        match &self.remedy {
            Some(remedy) => write!(f, "; {remedy}"),
            None => Ok(()),
        }
    }
}

impl std::error::Error for Error {}

/// The name in `known` nearest to `name`, where one is near enough to be a typo.
pub fn nearest<'a>(name: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    known
        .into_iter()
        .map(|k| (strsim::damerau_levenshtein(name, k), k))
        .filter(|(distance, k)| *distance <= (k.len().max(name.len()) / 2).max(1))
        .min_by_key(|(distance, _)| *distance)
        .map(|(_, k)| k)
}
