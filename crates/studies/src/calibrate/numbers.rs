//! Numbers of a scene that are found together with the powers of its lamps: their places and ranges,
//! and what is known of them before.

use serde_json::{Value, json};

use phylux_core::error::{Error, Result, setting};
use phylux_files::{input::quoted, json};
use phylux_results::calibration::Varied;

/// The largest number of numbers that may vary.
const MOST: usize = 30;
/// Standard deviation of the prior about the number in the scene file.
pub(super) const PRIOR: f64 = 0.02;

/// A number of the scene that varies over a range.
#[derive(Clone, Debug, PartialEq)]
pub struct Vary {
    pub(super) pointer: String,
    pub(super) from: f64,
    pub(super) to: f64,
}

impl Vary {
    /// Parses text such as `/materials/wall/reflectance=0.7:0.85`.
    pub fn parse(text: &str) -> std::result::Result<Self, String> {
        let parts = || {
            let (pointer, range) = text.rsplit_once('=')?;
            let (from, to) = range.split_once(':')?;
            Some((pointer, from.trim().parse::<f64>().ok()?, to.trim().parse::<f64>().ok()?))
        };
        let (pointer, from, to) = parts().ok_or(Self::FORM)?;
        Self::new(pointer, from, to)
    }

    /// Makes the number at a JSON pointer, which varies from one value to another. Error: the pointer
    /// or the range is none.
    pub fn new(pointer: &str, from: f64, to: f64) -> std::result::Result<Self, String> {
        match pointer.starts_with('/') && from < to && (to - from).is_finite() {
            true => Ok(Self { pointer: pointer.into(), from, to }),
            false => Err(Self::FORM.into()),
        }
    }

    const FORM: &str = "must be a place in the scene and a range, as in \
                        /materials/wall/reflectance=0.7:0.85";
}

/// The numbers of a scene that vary.
#[derive(Debug)]
pub struct Numbers<'a> {
    document: &'a Value,
    varies: &'a [Vary],
    /// The numbers in the scene file.
    given: Vec<f64>,
    /// Whether there is a prior about these numbers.
    prior: bool,
}

impl<'a> Numbers<'a> {
    /// Finds the numbers in the scene file `name`, whose JSON is `document`. Errors: too many
    /// numbers, one number twice, no number at a place.
    pub fn new(name: &str, document: &'a Value, varies: &'a [Vary], prior: bool) -> Result<Self> {
        let wrong = |problem: String| Error::input(setting("vary"), problem);
        if varies.len() > MOST {
            return Err(wrong(format!("{} numbers", varies.len()))
                .remedy(format!("vary at most {MOST} of them")));
        }
        for (i, vary) in varies.iter().enumerate() {
            if varies[..i].iter().any(|other| other.pointer == vary.pointer) {
                return Err(wrong(format!("{} varies twice", quoted(&vary.pointer)))
                    .remedy("give one range"));
            }
            let within = |other: &&Vary| {
                vary.pointer.strip_prefix(&other.pointer).is_some_and(|rest| rest.starts_with('/'))
            };
            if let Some(whole) = varies.iter().find(within) {
                let [part, whole] = [vary, whole].map(|vary| quoted(&vary.pointer));
                return Err(wrong(format!("{part} varies by itself and with {whole}"))
                    .remedy("vary the whole list, or numbers in it"));
            }
        }
        let given = |vary: &Vary| {
            let place = json::place(name, &vary.pointer);
            let found = document.pointer(&vary.pointer).ok_or_else(|| {
                wrong(format!("{place}: there is nothing at this place"))
                    .remedy("name a number of the scene file, as in /materials/wall/reflectance")
            })?;
            mean(found).ok_or_else(|| {
                wrong(format!("{place}: is neither a number nor a list of numbers"))
                    .remedy("name a number in it; of a spectrum its `times`")
            })
        };
        let given = varies.iter().map(given).collect::<Result<_>>()?;
        Ok(Self { document, varies, given, prior })
    }

    /// Returns places and ranges of the numbers.
    pub fn varies(&self) -> &'a [Vary] {
        self.varies
    }

    /// Returns the pointer of the input of a run to which a number belongs and, where it is that of one
    /// band in a list, its place there.
    pub(super) fn input(&self, number: usize) -> (&'a str, Option<usize>) {
        let pointer = &self.varies[number].pointer[..];
        let in_list = || {
            let (list, place) = pointer.rsplit_once('/')?;
            self.document.pointer(list)?.as_array()?;
            Some((list, Some(place.parse().ok()?)))
        };
        in_list().unwrap_or((pointer, None))
    }

    /// Returns the numbers in the scene file, or where they are outside of their ranges, the nearest
    /// ones inside.
    pub(super) fn start(&self) -> Vec<f64> {
        let inside = |(vary, given): (&Vary, &f64)| given.clamp(vary.from, vary.to);
        self.varies.iter().zip(&self.given).map(inside).collect()
    }

    /// Returns the scene file with these values. A list keeps its ratios, and its mean takes the
    /// value.
    pub fn document(&self, values: &[f64]) -> Value {
        let mut document = self.document.clone();
        for ((vary, value), given) in self.varies.iter().zip(values).zip(&self.given) {
            if let Some(place) = document.pointer_mut(&vary.pointer) {
                *place = match place.as_array() {
                    Some(list) if *given != 0.0 => {
                        let scaled = |number: &Value| number.as_f64().map(|x| x * value / given);
                        list.iter().map(scaled).collect()
                    }
                    Some(list) => list.iter().map(|_| json!(value)).collect(),
                    None => json!(value),
                };
            }
        }
        document
    }

    /// Returns by how much each band of a number changes where the number does by one.
    pub(super) fn changes(&self, number: usize, bands: usize) -> Vec<f64> {
        if let (_, Some(own)) = self.input(number) {
            return (0..bands).map(|band| if band == own { 1.0 } else { 0.0 }).collect();
        }
        let list = self.document.pointer(&self.varies[number].pointer).and_then(Value::as_array);
        match list {
            Some(list) if self.given[number] != 0.0 => {
                list.iter().map(|x| x.as_f64().unwrap_or(0.0) / self.given[number]).collect()
            }
            _ => vec![1.0; bands],
        }
    }

    /// Returns what the prior adds to the deviance.
    pub(super) fn distance(&self, values: &[f64]) -> f64 {
        let square = |(value, given): (&f64, &f64)| ((value - given) / PRIOR).powi(2);
        if self.prior { values.iter().zip(&self.given).map(square).sum() } else { 0.0 }
    }

    /// Returns the numbers with these values and standard errors.
    pub(super) fn varied(&self, found: impl Iterator<Item = (f64, Option<f64>)>) -> Vec<Varied> {
        let each = self.varies.iter().zip(&self.given).zip(found);
        each.map(|((vary, given), (value, standard_error))| Varied {
            place: vary.pointer.clone(),
            from: vary.from,
            to: vary.to,
            given: *given,
            value,
            standard_error,
        })
        .collect()
    }
}

/// Returns what a user should know of the numbers that were found.
pub(super) fn warnings(found: &[Varied]) -> Vec<String> {
    let unsure = found.iter().filter(|varied| varied.standard_error.is_none());
    let warning = |varied: &Varied| {
        let Varied { place, from, to, value, .. } = varied;
        let place = quoted(place);
        let border = 1e-9 * (to - from);
        match value - from < border || to - value < border {
            true => format!(
                "{place} is best at a border of its range, {value}: let it vary in a wider one"
            ),
            false => format!("the readings do not tell {place}: measure more, or keep the prior"),
        }
    };
    unsure.map(warning).collect()
}

/// Returns the number at a place, or the mean of a list of numbers.
fn mean(value: &Value) -> Option<f64> {
    match value {
        Value::Array(list) if !list.is_empty() => {
            let sum: Option<f64> = list.iter().map(Value::as_f64).sum();
            sum.map(|sum| sum / list.len() as f64)
        }
        other => other.as_f64(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn vary(text: &str) -> Vary {
        Vary::parse(text).unwrap_or_else(|e| panic!("{text}: {e}"))
    }

    #[test]
    fn places_and_ranges_are_read() {
        let read = vary("/materials/a=b/reflectance=0.7:0.85");
        assert_eq!(
            (read.pointer.as_str(), read.from, read.to),
            ("/materials/a=b/reflectance", 0.7, 0.85)
        );
        for wrong in
            ["/a", "/a=1", "a=1:2", "/a=2:1", "/a=1:1", "/a=1:x", "/a=0:inf", "/a=nan:1", ""]
        {
            assert!(Vary::parse(wrong).is_err(), "{wrong}");
        }
    }

    /// A number in a list belongs to the input whose list it is, and is one band of it.
    #[test]
    fn numbers_of_one_band() {
        let document = json!({ "a": { "0": 0.5 }, "b": [0.2, 0.4] });
        let three = ["/a/0=0.4:0.8", "/b/1=0.1:0.5", "/b/0=0.1:0.3"].map(vary);
        let numbers = Numbers::new("s", &document, &three, false).unwrap();
        let inputs = [0, 1, 2].map(|number| numbers.input(number));
        assert_eq!(inputs, [("/a/0", None), ("/b", Some(1)), ("/b", Some(0))]);
        assert_eq!(numbers.start(), [0.5, 0.4, 0.2]);
        let written = numbers.document(&[0.6, 0.45, 0.1]);
        assert_eq!(written, json!({ "a": { "0": 0.6 }, "b": [0.1, 0.45] }));
        assert_eq!(
            [0, 1, 2].map(|number| numbers.changes(number, 2)),
            [[1.0; 2], [0.0, 1.0], [1.0, 0.0]]
        );
    }

    /// A list keeps its ratios, and changes with the number by what they are.
    #[test]
    fn numbers_are_written() {
        let document = json!({ "a": 0.5, "b": [0.2, 0.4] });
        let two = [vary("/a=0.4:0.8"), vary("/b=0.1:0.5")];
        let numbers = Numbers::new("s", &document, &two, false).unwrap();
        let written = numbers.document(&[0.6, 0.45]);
        assert_eq!(written["a"], 0.6);
        assert!((written["b"][0].as_f64().unwrap() - 0.3).abs() < 1e-12);
        assert!((written["b"][1].as_f64().unwrap() - 0.6).abs() < 1e-12);
        assert_eq!(numbers.changes(0, 2), [1.0, 1.0]);
        let changes = numbers.changes(1, 2);
        assert!((changes[0] - 2.0 / 3.0).abs() < 1e-12 && (changes[1] - 4.0 / 3.0).abs() < 1e-12);
        let start = numbers.start();
        assert!(start[0] == 0.5 && (start[1] - 0.3).abs() < 1e-12);
    }

    #[test]
    fn what_cannot_vary_is_refused() {
        let document = json!({ "a": 0.5, "c": [0.1, 0.2] });
        for (varies, words) in [
            (vec![vary("/b=0:1")], "s: /b: there is nothing at this place"),
            (vec![vary("/c/2=0:1")], "s: /c/2: there is nothing at this place"),
            (vec![vary("/c/1=0:1"), vary("/c=0:1")], "`/c/1` varies by itself and with `/c`"),
            (vec![vary("/a=0:1"), vary("/a=0:2")], "`/a` varies twice"),
            ((0..31).map(|i| vary(&format!("/{i}=0:1"))).collect(), "31 numbers"),
        ] {
            let error = Numbers::new("s", &document, &varies, true).unwrap_err().to_string();
            assert!(error.starts_with("--vary: ") && error.contains(words), "{error}");
        }
    }
}
