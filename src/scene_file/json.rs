//! Reading JSON strictly: no key twice, no unknown key, and every error with its place.

use std::fmt;

use serde::{
    Deserialize,
    de::{self, DeserializeOwned},
};
use serde_json::{Map, Value};

use crate::error::{Error, Result, nearest};

/// Reads `text` (the content of `file`) into a type. Errors name line and column for syntax, and
/// the JSON pointer for meaning.
pub fn read<T: DeserializeOwned>(file: &str, text: &str) -> Result<T> {
    let Strict(value) = serde_json::from_str(text).map_err(|e| {
        let message = e.to_string();
        let problem = message.split(" at line ").next().unwrap_or(&message);
        let place = format!("{file}: line {}, column {}", e.line(), e.column());
        Error::input(place, problem).remedy("correct the JSON there")
    })?;
    typed(value).map_err(|Misplaced { pointer, problem }| {
        let error = Error::input(place(file, &pointer), plain_words(&problem));
        match unknown_key(&problem) {
            Some(remedy) => error.remedy(remedy),
            None => error.remedy("change it"),
        }
    })
}

/// `file: /pointer`, or only the file for the whole document.
pub fn place(file: &str, pointer: &str) -> String {
    if pointer.is_empty() { file.to_string() } else { format!("{file}: {pointer}") }
}

/// An error inside a document.
struct Misplaced {
    pointer: String,
    problem: String,
}

/// Separates pointer and problem while an error passes through serde, which carries one text.
const SEPARATOR: char = '\u{1}';

impl fmt::Display for Misplaced {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}{SEPARATOR}{}", self.pointer, self.problem)
    }
}

fn typed<T: DeserializeOwned>(value: Value) -> std::result::Result<T, Misplaced> {
    serde_path_to_error::deserialize(value).map_err(|e| {
        let mut pointer = String::new();
        for segment in e.path() {
            use serde_path_to_error::Segment;
            match segment {
                Segment::Map { key } => pointer += &format!("/{}", escaped(key)),
                Segment::Seq { index } => pointer += &format!("/{index}"),
                Segment::Enum { .. } | Segment::Unknown => {}
            }
        }
        let message = e.into_inner().to_string();
        match message.split_once(SEPARATOR) {
            Some((inner, problem)) => {
                Misplaced { pointer: pointer + inner, problem: problem.to_string() }
            }
            None => Misplaced { pointer, problem: message },
        }
    })
}

/// A key as part of a JSON pointer (RFC 6901).
pub fn escaped(key: &str) -> String {
    key.replace('~', "~0").replace('/', "~1")
}

/// Reads one variant of a tagged union, for [`tagged`].
pub fn variant<T: DeserializeOwned, E: de::Error>(
    map: Map<String, Value>,
) -> std::result::Result<T, E> {
    typed(Value::Object(map)).map_err(E::custom)
}

/// Takes the `type` out of a tagged union, which must be one of `known`.
pub fn tag<E: de::Error>(
    map: &mut Map<String, Value>,
    known: &[&str],
) -> std::result::Result<String, E> {
    let wrong = |pointer: &str, problem: String| {
        E::custom(Misplaced { pointer: pointer.to_string(), problem })
    };
    match map.remove("type") {
        Some(Value::String(tag)) if known.contains(&tag.as_str()) => Ok(tag),
        Some(Value::String(tag)) => {
            let hint = nearest(&tag, known.iter().copied())
                .map_or(String::new(), |name| format!(" (did you mean `{name}`?)"));
            let known = known.join(", ");
            Err(wrong("/type", format!("unknown type `{tag}`{hint}, must be one of {known}")))
        }
        Some(_) => Err(wrong("/type", format!("must be one of {}", known.join(", ")))),
        None => Err(wrong("", format!("has no `type`, which is one of {}", known.join(", ")))),
    }
}

/// Declares an enum that reads `{"type": ...}` objects. Serde's own tagged enums forget where in
/// the object an error was.
macro_rules! tagged {
    ($(#[$doc:meta])* pub enum $name:ident {
        $($(#[$variant_doc:meta])* $tag:literal => $variant:ident($content:ty),)*
    }) => {
        $(#[$doc])*
        #[derive(Debug, schemars::JsonSchema)]
        #[schemars(tag = "type")]
        pub enum $name {
            $($(#[$variant_doc])* #[schemars(rename = $tag)] $variant($content),)*
        }

        impl<'de> serde::Deserialize<'de> for $name {
            fn deserialize<D: serde::Deserializer<'de>>(
                deserializer: D,
            ) -> std::result::Result<Self, D::Error> {
                let mut map = serde_json::Map::deserialize(deserializer)?;
                let tag: String = $crate::scene_file::json::tag(&mut map, &[$($tag),*])?;
                $(if tag == $tag {
                    return $crate::scene_file::json::variant(map).map(Self::$variant);
                })*
                unreachable!("tag() returns known tags only")
            }
        }
    };
}
pub(super) use tagged;

/// Serde's words in those of a user of JSON.
fn plain_words(problem: &str) -> String {
    let mut words = problem.to_string();
    for (theirs, ours) in [
        ("unknown field", "unknown key"),
        ("missing field", "missing key"),
        ("expected f64", "expected a number"),
        ("expected u64", "expected a whole number, at least 0"),
        ("expected a sequence", "expected an array"),
        ("expected a map", "expected an object"),
        ("expected a boolean", "expected true or false"),
        ("invalid type: map", "invalid type: object"),
        ("invalid type: sequence", "invalid type: array"),
        ("invalid type: floating point", "invalid value: number"),
        ("invalid type: integer", "invalid value: number"),
        ("invalid value: floating point", "invalid value: number"),
        ("invalid value: integer", "invalid value: number"),
        ("unknown variant", "unknown value"),
    ] {
        words = words.replace(theirs, ours);
    }
    if let Some(at) = words.find("expected struct ") {
        words.replace_range(at.., "expected an object");
    }
    match words.find(", expected one of") {
        Some(at) if words.starts_with("unknown key") => words[..at].to_string(),
        _ => words,
    }
}

/// For an unknown key: the nearest known one, and all of them.
fn unknown_key(problem: &str) -> Option<String> {
    let mut quoted = problem.split('`').skip(1).step_by(2);
    if !problem.starts_with("unknown field") {
        return None;
    }
    let key = quoted.next()?;
    let known: Vec<&str> = quoted.filter(|name| !name.starts_with('$')).collect();
    let all = format!("known here: {}", known.join(", "));
    Some(match nearest(key, known.iter().copied()) {
        Some(name) => format!("did you mean `{name}`? ({all})"),
        None => all,
    })
}

/// A JSON value in which no object has a key twice.
struct Strict(Value);

impl<'de> Deserialize<'de> for Strict {
    fn deserialize<D: de::Deserializer<'de>>(
        deserializer: D,
    ) -> std::result::Result<Self, D::Error> {
        struct Visitor;
        impl<'de> de::Visitor<'de> for Visitor {
            type Value = Value;
            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str("JSON")
            }
            fn visit_unit<E>(self) -> std::result::Result<Value, E> {
                Ok(Value::Null)
            }
            fn visit_bool<E>(self, v: bool) -> std::result::Result<Value, E> {
                Ok(v.into())
            }
            fn visit_u64<E>(self, v: u64) -> std::result::Result<Value, E> {
                Ok(v.into())
            }
            fn visit_i64<E>(self, v: i64) -> std::result::Result<Value, E> {
                Ok(v.into())
            }
            fn visit_f64<E>(self, v: f64) -> std::result::Result<Value, E> {
                Ok(v.into())
            }
            fn visit_str<E>(self, v: &str) -> std::result::Result<Value, E> {
                Ok(v.into())
            }
            fn visit_seq<A: de::SeqAccess<'de>>(
                self,
                mut seq: A,
            ) -> std::result::Result<Value, A::Error> {
                let mut values = Vec::new();
                while let Some(Strict(value)) = seq.next_element()? {
                    values.push(value);
                }
                Ok(Value::Array(values))
            }
            fn visit_map<A: de::MapAccess<'de>>(
                self,
                mut access: A,
            ) -> std::result::Result<Value, A::Error> {
                let mut map = Map::new();
                while let Some(key) = access.next_key::<String>()? {
                    let Strict(value) = access.next_value()?;
                    if map.contains_key(&key) {
                        return Err(de::Error::custom(format!(
                            "the key `{key}` stands here twice"
                        )));
                    }
                    map.insert(key, value);
                }
                Ok(Value::Object(map))
            }
        }
        deserializer.deserialize_any(Visitor).map(Strict)
    }
}
