//! The one error type of the crate, [`Error`]: where the problem is, what it is, and what to do
//! about it. The checks and texts that many error messages share are here too.

mod words;

use std::{
    borrow::Cow,
    fmt,
    sync::{Mutex, MutexGuard, PoisonError},
};

pub use words::{
    Call, CommandLine, Setting, SettingValue, Spelling, ToWords, Words, call, setting,
};

/// Whose fault an error is. It decides the exit code of the command.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ErrorKind {
    /// Wrong usage or input: exit code 2.
    Input,
    /// The run itself failed (disk full, ...): exit code 1.
    Run,
    /// The user interrupted the command: exit code 130.
    Interrupted,
}

/// What an interrupted command usually says about its files; the end of an error message.
pub const NOTHING_WRITTEN: &str = "nothing was written";

/// What to do where the system starts no threads; the remedy of an error.
pub const NO_THREADS: &str = "end other programs, or raise the limit on threads (`ulimit -u`)";

/// Makes [`Words`] of texts and of names of settings and commands, one after the other.
#[macro_export]
macro_rules! words {
    ($($part:expr),* $(,)?) => {
        $crate::error::Words::joined([$($crate::error::ToWords::to_words($part)),*])
    };
}

/// An error as a sentence for a person: where the problem is, what is wrong there, and what would
/// mend it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Error {
    kind: ErrorKind,
    place: Words,
    problem: Words,
    remedy: Option<Words>,
}

/// The parts of an error as texts, in the spelling of an interface.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Said {
    /// Where the problem is.
    pub place: String,
    /// What is wrong there.
    pub problem: String,
    /// What would mend it.
    pub remedy: Option<String>,
}

/// How many items a sentence usually lists before it says how many more there are.
pub const LISTED: usize = 5;

/// Lists the first `most` of `things` and says how many more there are: `a, b and 3 more`. The text
/// is empty where there are no things.
pub fn some(things: impl IntoIterator<Item: fmt::Display>, most: usize) -> String {
    let mut things = things.into_iter();
    let first: Vec<String> = things.by_ref().take(most).map(|thing| thing.to_string()).collect();
    match things.count() {
        0 => first.join(", "),
        more => format!("{} and {more} more", first.join(", ")),
    }
}

/// Result with the crate's [`Error`].
pub type Result<T> = std::result::Result<T, Error>;

/// Result of a check of values: what was made of them, or what is wrong with them.
pub type Checked<T = ()> = std::result::Result<T, Problem>;

impl Error {
    /// Makes an error for wrong input at `place`: a file, with the JSON pointer or line if there is
    /// one.
    pub fn input(place: impl ToWords, problem: impl ToWords) -> Self {
        Self::new(ErrorKind::Input, place, problem)
    }

    /// Makes an error for a run that failed at `place`, through no fault of the input.
    pub fn run(place: impl ToWords, problem: impl ToWords) -> Self {
        Self::new(ErrorKind::Run, place, problem)
    }

    /// Makes an error for work at `place` (a run, a merge) that the user interrupted; `left` says
    /// in which state that leaves it.
    pub fn interrupted(place: impl ToWords, left: impl fmt::Display) -> Self {
        Self::new(ErrorKind::Interrupted, place, format!("interrupted, {left}"))
    }

    /// Makes an error for a file at `place` that cannot be written.
    pub fn unwritable(place: impl ToWords, why: impl fmt::Display) -> Self {
        Self::run(place, format!("cannot be written: {why}"))
            .remedy("make room there, see that you may write there, or write elsewhere")
    }

    /// Makes an error for a file at `place` that cannot be read.
    pub fn unreadable(place: impl ToWords, why: impl ToWords) -> Self {
        Self::input(place, why).remedy("name a file that you may read")
    }

    /// Makes an error for a file at `place` that the memory does not hold.
    pub fn too_large(place: impl ToWords, why: impl ToWords) -> Self {
        Self::input(place, why).remedy("end other programs, or take a machine with more memory")
    }

    fn new(kind: ErrorKind, place: impl ToWords, problem: impl ToWords) -> Self {
        Self { kind, place: place.to_words(), problem: problem.to_words(), remedy: None }
    }

    /// Adds what the user can do about the error.
    pub fn remedy(mut self, remedy: impl ToWords) -> Self {
        self.remedy = Some(remedy.to_words());
        self
    }

    /// Adds the known name that was probably meant, or where `near` is none, another remedy.
    pub fn did_you_mean(self, near: Option<&str>, otherwise: impl ToWords) -> Self {
        match near {
            Some(near) => self.remedy(format!("did you mean `{near}`?")),
            None => self.remedy(otherwise),
        }
    }

    /// Adds the known name that was probably meant, if one is `near`, and which `names` there are.
    pub fn did_you_mean_of(self, near: Option<&str>, names: &str) -> Self {
        match near {
            Some(near) => self.remedy(format!("did you mean `{near}`? (there are {names})")),
            None => self.remedy(format!("there are {names}")),
        }
    }

    /// Returns the same error at another place.
    pub fn at(self, place: impl ToWords) -> Self {
        Self { place: place.to_words(), ..self }
    }

    /// Where the error is.
    pub fn place(&self) -> Cow<'_, str> {
        self.place.place(&CommandLine)
    }

    /// Returns the parts of the error in the spelling of an interface, each on one line.
    pub fn said(&self, spelling: &dyn Spelling) -> Said {
        let line = |words: &Words| OneLine(&words.spelled(spelling)).to_string();
        Said {
            place: OneLine(&self.place.place(spelling)).to_string(),
            problem: line(&self.problem),
            remedy: self.remedy.as_ref().map(line),
        }
    }

    /// Returns the problem and what to do about it, without the place.
    pub fn message(&self) -> String {
        self.said(&CommandLine).message()
    }

    /// Whose fault the error is.
    pub fn kind(&self) -> ErrorKind {
        self.kind
    }
}

impl Said {
    /// Returns the problem and what to do about it, without the place.
    pub fn message(&self) -> String {
        match &self.remedy {
            Some(remedy) => format!("{}; {remedy}", self.problem),
            None => self.problem.clone(),
        }
    }
}

impl fmt::Display for Said {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.place, self.message())
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.said(&CommandLine).fmt(f)
    }
}

/// What is wrong with a value and what to do about it, before the place of the value is known.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Problem {
    problem: Words,
    remedy: Option<Words>,
}

impl Problem {
    /// Makes a problem from what is wrong and what to do about it.
    pub fn new(problem: impl ToWords, remedy: impl ToWords) -> Self {
        Self { problem: problem.to_words(), remedy: Some(remedy.to_words()) }
    }

    /// Says that the problem lies in `part` of the value that was checked.
    pub fn of(self, part: impl fmt::Display) -> Self {
        Self { problem: words![part, ": ", self.problem], ..self }
    }

    /// Adds `other` as an alternative remedy.
    pub fn or(self, other: impl ToWords) -> Self {
        let remedy = match self.remedy {
            Some(first) => words![first, ", or ", other],
            None => other.to_words(),
        };
        Self { remedy: Some(remedy), ..self }
    }

    /// Makes the problem an error of the input at `place`.
    pub fn at(self, place: impl ToWords) -> Error {
        Error { remedy: self.remedy, ..Error::input(place, self.problem) }
    }
}

/// Refuses a number outside the closed range from `low` to `high`, and NaN. A `high` of `f64::MAX`
/// means that there is no upper limit.
pub fn check_range(value: f64, low: f64, high: f64) -> std::result::Result<(), Problem> {
    if (low..=high).contains(&value) {
        return Ok(());
    }
    let range = match high {
        f64::MAX => format!("at least {}", number(low)),
        _ => format!("from {} to {}", number(low), number(high)),
    };
    let problem = format!("{}, must be {range}", number(value)).to_words();
    let remedy = (high == 1.0 && value > 1.0).then(|| "75 % is 0.75".to_words());
    Err(Problem { problem, remedy })
}

/// Says which number a text like `3%` means; the text is empty for any other.
pub fn percent(text: &str) -> String {
    let value = text.trim().strip_suffix('%').and_then(|text| text.trim_end().parse::<f64>().ok());
    match value.filter(|value| value.is_finite()) {
        // rounded, so that 7 / 100 is not written as 0.07000000000000001
        Some(value) => format!(" ({value} % is {})", (value * 1e10).round() / 1e12),
        None => String::new(),
    }
}

/// Refuses a list of `numbers` entries unless it has one entry for each of the `bands` bands.
pub fn check_length(numbers: usize, bands: usize) -> std::result::Result<(), Problem> {
    if numbers == bands {
        return Ok(());
    }
    let s = if bands == 1 { "" } else { "s" };
    let problem = format!("{numbers} numbers for {bands} band{s}");
    Err(Problem::new(problem, "give one number, or one per band"))
}

/// Runs `work` and returns an error if it panics, which is a fault of this program or of a function
/// that a caller gave it.
pub fn catch_panic<T>(place: &str, work: impl FnOnce() -> Result<T>) -> Result<T> {
    // whatever `work` has left half done is dropped together with it
    std::panic::catch_unwind(std::panic::AssertUnwindSafe(work)).unwrap_or_else(|panic| {
        let text = panic.downcast_ref::<&str>().map(|text| text.to_string());
        let text = text.or_else(|| panic.downcast_ref::<String>().cloned());
        let why = text.map_or(String::new(), |text| format!(" ({text})"));
        Err(Error::run(place, format!("it broke off by a fault in the program{why}"))
            .remedy("nothing was found; please report this"))
    })
}

/// Locks a mutex. What a thread that panicked has left there is taken as it is: the panic itself is
/// reported elsewhere.
pub fn lock<T: ?Sized>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Returns what is in a mutex, as [`lock`] does.
pub fn unlocked<T>(mutex: Mutex<T>) -> T {
    mutex.into_inner().unwrap_or_else(PoisonError::into_inner)
}

/// Shows text that may come from a file on one line: control characters are escaped, and the text
/// is cut off after 1000 characters.
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

/// Formats a number as a person would write it, however large or small it is.
pub fn number(value: f64) -> String {
    match value.abs() {
        0.0 => "0".into(),
        1e-5..1e15 => value.to_string(),
        _ => format!("{value:e}"),
    }
}

/// Returns the name in `known` that is nearest to `name`, or `None` where no name is so near that
/// `name` may be a typo of it.
pub fn nearest<'a>(name: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    // time and memory of a comparison grow with the product of the lengths
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
