//! Reads JSON strictly: no object may have a key twice, no key may be unknown, and every error
//! names its place.

use std::{fmt, vec};

use serde::{
    Deserialize,
    de::{self, DeserializeOwned, IntoDeserializer as _},
};
use serde_json::{Map, Value};

use phylux_core::{
    error::{Error, Result, nearest, percent},
    math::machine::{gib, memory_left},
};

/// The length of the longest JSON file that is read, bytes.
const LONGEST: usize = 64 << 20;
/// The most memory that the values of a JSON file may take, bytes; the values of 300,000 sensors
/// take this much. Short values take up to a hundred times as much memory as their text.
const LARGEST: usize = 1 << 30;

/// Parses the `bytes` of `file`. Errors name line and column, or only the file where the problem
/// concerns all of it.
pub fn parse(file: &str, bytes: &[u8]) -> Result<Value> {
    let remedy = "put shapes into OBJ files and sensors into CSV files";
    if bytes.len() > LONGEST {
        return Err(Error::input(file, format!("is longer than {LONGEST} bytes")).remedy(remedy));
    }
    let bytes_of_values = Counts::of(bytes).value_bytes();
    if bytes_of_values > LARGEST {
        let problem = format!(
            "its numbers, lists and objects take {bytes_of_values} bytes, more than {LARGEST}"
        );
        return Err(Error::input(file, problem).remedy(remedy));
    }
    let text = std::str::from_utf8(bytes).map_err(|e| {
        Error::input(file, format!("is not text: byte {} is not UTF-8", e.valid_up_to()))
            .remedy(IS_JSON)
    })?;
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    if text.trim().is_empty() {
        return Err(Error::input(file, "is empty").remedy(IS_JSON));
    }
    let Strict(value) = serde_json::from_str(text).map_err(|e| {
        let message = e.to_string();
        let problem = message.rsplit_once(" at line ").map_or(&*message, |(problem, _)| problem);
        let place = format!("{file}: line {}, column {}", e.line(), e.column());
        let line = text.lines().nth(e.line().saturating_sub(1)).unwrap_or_default();
        let rest = line.get(e.column().saturating_sub(1)..).unwrap_or_default();
        let remedy = match text.trim_start().starts_with(['{', '[']) {
            true => syntax_remedy(problem, rest),
            // the file may be of another format, for example an OBJ file that begins with a comment
            false => "the file must be JSON, which begins with { and has no comments",
        };
        Error::input(place, problem).remedy(remedy)
    })?;
    Ok(value)
}

/// Refuses a text of results whose numbers would not fit into the memory that is left. The error is
/// the problem alone, without the place.
pub fn check_memory(text: &[u8]) -> std::result::Result<(), String> {
    check_left(Counts::of(text).result_bytes() as u64)
}

/// Refuses content that takes so many bytes, if less memory is left. The error is the problem alone,
/// without the place.
pub fn check_left(needed: u64) -> std::result::Result<(), String> {
    let left = memory_left();
    if needed <= left {
        return Ok(());
    }
    let (needed, left) = (gib(needed), gib(left));
    Err(format!("what is in it takes {needed:.1} GiB of memory, of {left:.1} that are left"))
}

/// The number of values of each kind in a JSON text, counted without parsing it.
#[derive(Debug, Default, PartialEq)]
struct Counts {
    arrays: usize,
    objects: usize,
    /// Entries of arrays, without the first entry of each array.
    array_entries: usize,
    /// Entries of objects, without the first entry of each object.
    object_entries: usize,
}

impl Counts {
    /// Counts the values of a JSON text. The counts of a text that is not JSON have no meaning.
    fn of(text: &[u8]) -> Self {
        let mut counts = Self::default();
        // for each value that is open, whether it is an object
        let mut open = Vec::new();
        let mut bytes = text.iter();
        while let Some(byte) = bytes.next() {
            match byte {
                b'"' => loop {
                    match bytes.next() {
                        Some(b'\\') => bytes.next(),
                        Some(b'"') | None => break,
                        Some(other) => Some(other),
                    };
                },
                b'[' | b'{' if open.len() == DEEPEST => return counts,
                b'[' | b'{' => {
                    let object = *byte == b'{';
                    *(if object { &mut counts.objects } else { &mut counts.arrays }) += 1;
                    open.push(object);
                }
                b']' | b'}' => {
                    open.pop();
                }
                b',' if open.last() == Some(&true) => counts.object_entries += 1,
                b',' => counts.array_entries += 1,
                _ => {}
            }
        }
        counts
    }

    /// Returns an upper bound of the memory that the parsed values take, in bytes, without the text
    /// of strings. A list starts with room for four entries and never has room for more than twice
    /// the entries in it.
    fn value_bytes(&self) -> usize {
        // each entry of an object is stored with a hash and an index
        const ENTRY: usize = size_of::<(String, Value)>() + 2 * size_of::<usize>();
        const VALUE: usize = size_of::<Value>();
        let arrays = 4 * self.arrays + 2 * self.array_entries;
        let objects = 4 * self.objects + 2 * self.object_entries;
        arrays * VALUE + objects * ENTRY
    }

    /// Returns about how many bytes the results take that are read from this text: numbers in
    /// lists, and objects with some lists.
    fn result_bytes(&self) -> usize {
        const NUMBER: usize = size_of::<Option<f64>>();
        const OBJECT: usize = 1024;
        // when a list grows, its old and its new memory exist at the same time
        3 * NUMBER * (self.array_entries + self.object_entries) + OBJECT * self.objects
    }
}

/// The deepest allowed nesting of values; serde_json refuses texts with more.
const DEEPEST: usize = 128;

/// The remedy for a file that is not JSON.
const IS_JSON: &str = "it must be a JSON file";

/// Reads `value` (the content of `file`) into a type. Errors name the JSON pointer.
pub fn read<T: DeserializeOwned>(file: &str, value: Value) -> Result<T> {
    read_with(file, value, |_| None)
}

/// Reads the arguments of a call, an object, into a type. The place of an error is the name of the
/// argument, and what is inside it.
pub fn read_arguments<T: DeserializeOwned>(arguments: Value) -> Result<T> {
    read("", arguments).map_err(|error| {
        let place = error.place().trim_start_matches(": /").to_string();
        error.at(place)
    })
}

/// Reads like [`read`]. `home` says of a key that is unknown where it stands where it belongs, if
/// it belongs anywhere.
pub fn read_with<T: DeserializeOwned>(
    file: &str,
    value: Value,
    home: impl Fn(&str) -> Option<String>,
) -> Result<T> {
    typed(value).map_err(|Misplaced { pointer, problem }| {
        let error = Error::input(place(file, &pointer), plain_words(&problem));
        match known_names(&problem, home).or_else(|| missing_key(&problem)) {
            Some(remedy) => error.remedy(remedy),
            None => error,
        }
    })
}

/// Returns the remedy for an error of syntax, from serde's message and the text that begins at the
/// error.
fn syntax_remedy(problem: &str, rest: &str) -> &'static str {
    let at = |words: &[&str]| words.iter().any(|word| rest.starts_with(word));
    match problem {
        _ if problem.ends_with(TWICE) => "delete one of the two",
        _ if problem.starts_with("EOF") => "close every bracket and quote; is the file whole?",
        "trailing comma" => "delete the comma before it",
        "number out of range" => "numbers are at most 1.8e308",
        "key must be a string" if rest.starts_with(|c: char| c.is_ascii_digit()) => {
            "numbers take a decimal point, not a comma"
        }
        "recursion limit exceeded" => "nothing needs to be nested so deeply",
        "expected ident" => "write a finite number, true, false or null",
        "trailing characters" => "the file must end with its closing bracket",
        _ if at(&["N", "n", "I", "i", "+", "-"]) => {
            "write a finite number; JSON has no NaN, no infinity and no leading +"
        }
        _ if at(&["/", "#"]) => "JSON has no comments; delete it",
        _ if at(&["'"]) => "JSON has double quotes only",
        _ => "correct the JSON there",
    }
}

/// The end of the message about a key that an object has twice.
const TWICE: &str = "stands here twice";

/// Returns the place of an error: `file: /pointer`, or only the file for the whole document.
pub fn place(file: &str, pointer: &str) -> String {
    if pointer.is_empty() { file.to_string() } else { format!("{file}: {pointer}") }
}

/// An error at a place inside a document.
struct Misplaced {
    pointer: String,
    problem: String,
}

/// Separates the pointer from the problem while an error passes through serde, whose errors hold a
/// single text.
const SEPARATOR: char = '\u{1}';

impl fmt::Display for Misplaced {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}{SEPARATOR}{}", self.pointer, self.problem)
    }
}

impl Misplaced {
    fn of(error: &serde_json::Error) -> Self {
        let message = error.to_string();
        let (pointer, problem) = message.split_once(SEPARATOR).unwrap_or(("", &message));
        Self { pointer: pointer.to_string(), problem: problem.to_string() }
    }
}

/// Turns an error inside the value of `key` (or inside the entry with that index) into an error of
/// the object or array around it, by putting the key before the pointer.
#[cold]
#[inline(never)]
fn within(key: &dyn fmt::Display, error: &serde_json::Error) -> serde_json::Error {
    let Misplaced { pointer, problem } = Misplaced::of(error);
    let pointer = format!("/{}{pointer}", escaped(&key.to_string()));
    de::Error::custom(Misplaced { pointer, problem })
}

fn typed<T: DeserializeOwned>(value: Value) -> std::result::Result<T, Misplaced> {
    T::deserialize(Json(value)).map_err(|e| Misplaced::of(&e))
}

/// Returns a key in the form that a JSON pointer needs (RFC 6901).
pub fn escaped(key: &str) -> String {
    key.replace('~', "~0").replace('/', "~1")
}

/// Returns the key that is meant by its form in a JSON pointer (RFC 6901).
pub fn unescaped(key: &str) -> String {
    key.replace("~1", "/").replace("~0", "~")
}

/// Reads the content of one variant of a tagged union, for [`tagged`].
pub fn variant<T: DeserializeOwned, E: de::Error>(
    map: Map<String, Value>,
) -> std::result::Result<T, E> {
    typed(Value::Object(map)).map_err(E::custom)
}

/// Removes the key `type` from the object of a tagged union and returns its value. Errors: there is
/// no `type`, or it is none of `known`.
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

/// Declares an enum that is read from objects `{"type": ...}`. It replaces serde's own tagged
/// enums, whose errors do not say where in the object they occurred.
macro_rules! tagged {
    ($(#[$doc:meta])* pub enum $name:ident {
        $($(#[$variant_doc:meta])* $tag:literal => $variant:ident($content:ident $(<$boxed:ident>)?),)*
    }) => {
        $(#[$doc])*
        #[derive(Debug, schemars::JsonSchema)]
        #[schemars(tag = "type")]
        pub enum $name {
            $($(#[$variant_doc])* #[schemars(rename = $tag)] $variant($content$(<$boxed>)?),)*
        }

        impl<'de> serde::Deserialize<'de> for $name {
            fn deserialize<D: serde::Deserializer<'de>>(
                deserializer: D,
            ) -> std::result::Result<Self, D::Error> {
                let mut map = serde_json::Map::deserialize(deserializer)?;
                let tag: String = $crate::json::tag(&mut map, &[$($tag),*])?;
                $(if tag == $tag {
                    return $crate::json::variant(map).map(Self::$variant);
                })*
                unreachable!("tag() returns known tags only")
            }
        }

        $(impl From<tagged!(@content $content $($boxed)?)> for $name {
            fn from(content: tagged!(@content $content $($boxed)?)) -> Self {
                Self::$variant(content.into())
            }
        })*
    };
    (@content Box $content:ident) => { $content };
    (@content $content:ident) => { $content };
}
pub(crate) use tagged;

/// Declares how a type is read that JSON may give in one of several forms. First comes a name for
/// all forms together, for the error about any other; then each form, with a pattern for what is
/// read and the value that it becomes, which may end with `?`.
macro_rules! one_of {
    ($type:ident: $expected:literal, $($form:ident $read:tt $(=> $value:expr)?,)*) => {
        impl<'de> serde::Deserialize<'de> for $type {
            fn deserialize<D: serde::Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
                struct Visitor;
                impl<'de> serde::de::Visitor<'de> for Visitor {
                    type Value = $type;
                    fn expecting(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
                        f.write_str($expected)
                    }
                    $($crate::json::one_of!(@$form $read $(=> $value)?);)*
                }
                from.deserialize_any(Visitor)
            }
        }
    };
    (@flag ($read:pat) => $value:expr) => {
        fn visit_bool<E>(self, $read: bool) -> Result<Self::Value, E> {
            Ok($value)
        }
    };
    (@whole ($read:pat) => $value:expr) => {
        fn visit_u64<E>(self, $read: u64) -> Result<Self::Value, E> {
            Ok($value)
        }
    };
    (@number ($read:pat) => $value:expr) => {
        fn visit_f64<E>(self, $read: f64) -> Result<Self::Value, E> {
            Ok($value)
        }
        fn visit_u64<E: serde::de::Error>(self, whole: u64) -> Result<Self::Value, E> {
            self.visit_f64(whole as f64)
        }
        fn visit_i64<E: serde::de::Error>(self, whole: i64) -> Result<Self::Value, E> {
            self.visit_f64(whole as f64)
        }
    };
    (@word { $($word:literal => $value:expr),* $(,)? }) => {
        fn visit_str<E: serde::de::Error>(self, text: &str) -> Result<Self::Value, E> {
            match text {
                $($word => Ok($value),)*
                _ => Err(E::invalid_value(serde::de::Unexpected::Str(text), &self)),
            }
        }
    };
    (@text ($read:pat) => $value:expr) => {
        fn visit_str<E: serde::de::Error>(self, text: &str) -> Result<Self::Value, E> {
            let $read = Deserialize::deserialize(serde::de::value::StrDeserializer::new(text))?;
            Ok($value)
        }
    };
    (@list ($read:pat) => $value:expr) => {
        fn visit_seq<A: serde::de::SeqAccess<'de>>(self, list: A) -> Result<Self::Value, A::Error> {
            let list = serde::de::value::SeqAccessDeserializer::new(list);
            let $read = Deserialize::deserialize(list)?;
            Ok($value)
        }
    };
    (@object ($read:pat) => $value:expr) => {
        fn visit_map<A: serde::de::MapAccess<'de>>(self, map: A) -> Result<Self::Value, A::Error> {
            let map = serde::de::value::MapAccessDeserializer::new(map);
            let $read = Deserialize::deserialize(map)?;
            Ok($value)
        }
    };
}
pub(crate) use one_of;

/// Rewrites a message of serde in the words of a user of JSON.
fn plain_words(problem: &str) -> String {
    for (theirs, ours) in [
        ("unknown field ", "unknown key "),
        ("missing field ", "missing key "),
        ("unknown variant ", "unknown value "),
    ] {
        if let Some(rest) = problem.strip_prefix(theirs) {
            return format!("{ours}{}", rest.split(", expected").next().unwrap_or(rest));
        }
    }
    let found = ["invalid type: ", "invalid value: "];
    if let Some(rest) = found.iter().find_map(|start| problem.strip_prefix(start))
        && let Some((found, expected)) = rest.rsplit_once(", expected ")
    {
        let percent = percent(found.trim_start_matches("string ").trim_matches('"'));
        return format!("{}, must be {}{percent}", plain_value(found), plain_type(expected));
    }
    if let Some(rest) = problem.strip_prefix("invalid length ")
        && let Some((length, expected)) = rest.split_once(", expected ")
    {
        let digits = expected.matches(char::is_numeric).collect::<String>();
        return format!("{length} entries, must be {digits}");
    }
    problem.to_string()
}

fn plain_value(found: &str) -> String {
    let found = ["floating point ", "integer ", "boolean ", "string "]
        .iter()
        .find_map(|kind| found.strip_prefix(kind))
        .unwrap_or(found);
    match found {
        "map" => "an object".into(),
        "sequence" => "an array".into(),
        _ => found.trim_matches('`').into(),
    }
}

fn plain_type(expected: &str) -> &str {
    match expected {
        "f64" => "a number",
        "u64" => "a whole number, at least 0",
        "a boolean" => "true or false",
        "a sequence" => "an array",
        "a map" => "an object",
        _ if expected.starts_with("struct ") => "an object",
        _ if expected.starts_with("an array of length 3") => "an array of 3 numbers",
        _ => expected,
    }
}

/// Returns the remedy for an unknown key or value: the place where the key belongs or the most
/// similar known name, and all known names.
fn known_names(problem: &str, home: impl Fn(&str) -> Option<String>) -> Option<String> {
    let what = match problem {
        _ if problem.starts_with("unknown field") => "keys",
        _ if problem.starts_with("unknown variant") => "values",
        _ => return None,
    };
    // the unknown name may contain quotes itself, so the known names are those after the last
    // "expected"
    let (unknown, known) = problem.rsplit_once(", expected ")?;
    let name = unknown.split_once('`')?.1.strip_suffix('`')?;
    let known: Vec<&str> =
        known.split('`').skip(1).step_by(2).filter(|name| !name.starts_with('$')).collect();
    let all = format!("{what} here: {}", known.join(", "));
    // a short value is similar to every other short value
    let near = nearest(name, known.iter().copied()).filter(|_| what == "keys");
    let is_typo = near.is_some_and(|near| near.starts_with(name) || name.starts_with(near));
    let home = home(name).filter(|_| what == "keys" && !is_typo);
    Some(match (home, near) {
        (Some(home), _) => format!("{home} ({all})"),
        (None, Some(near)) => format!("did you mean `{near}`? ({all})"),
        (None, None) => all,
    })
}

fn missing_key(problem: &str) -> Option<String> {
    problem.starts_with("missing field").then(|| "add it".into())
}

/// A value that is read strictly: only an object becomes a struct (serde also accepts an array of
/// the fields in order), and only a string becomes a name. Errors say where in the value they
/// occurred. Each method tries only the kinds of value that it can use, which keeps the compiled
/// code small.
struct Json(Value);

impl Json {
    /// Reads a value that is neither an array nor an object.
    fn plain<'de, V: de::Visitor<'de>>(self, visitor: V) -> serde_json::Result<V::Value> {
        match self.0 {
            Value::Null => visitor.visit_unit(),
            Value::Bool(value) => visitor.visit_bool(value),
            Value::Number(number) => de::Deserializer::deserialize_any(number, visitor),
            Value::String(text) => visitor.visit_string(text),
            Value::Array(_) => Err(de::Error::invalid_type(de::Unexpected::Seq, &visitor)),
            Value::Object(_) => Err(de::Error::invalid_type(de::Unexpected::Map, &visitor)),
        }
    }
}

/// Defines methods that read types of these kinds with [`Json::plain`].
macro_rules! plain {
    ($($method:ident)*) => {
        $(fn $method<V: de::Visitor<'de>>(self, visitor: V) -> serde_json::Result<V::Value> {
            self.plain(visitor)
        })*
    };
}

impl<'de> de::Deserializer<'de> for Json {
    type Error = serde_json::Error;

    fn deserialize_any<V: de::Visitor<'de>>(self, visitor: V) -> serde_json::Result<V::Value> {
        match self.0 {
            Value::Array(_) => self.deserialize_seq(visitor),
            _ => self.deserialize_map(visitor),
        }
    }

    fn deserialize_seq<V: de::Visitor<'de>>(self, visitor: V) -> serde_json::Result<V::Value> {
        let Value::Array(values) = self.0 else { return self.plain(visitor) };
        let length = values.len();
        let mut items = Items { rest: values.into_iter(), read: 0 };
        let value = visitor.visit_seq(&mut items)?;
        match items.rest.len() {
            0 => Ok(value),
            _ => Err(de::Error::invalid_length(length, &items.read.to_string().as_str())),
        }
    }

    fn deserialize_map<V: de::Visitor<'de>>(self, visitor: V) -> serde_json::Result<V::Value> {
        let Value::Object(map) = self.0 else { return self.plain(visitor) };
        visitor.visit_map(Entries { rest: map.into_iter(), open: None })
    }

    fn deserialize_tuple<V: de::Visitor<'de>>(
        self,
        _: usize,
        visitor: V,
    ) -> serde_json::Result<V::Value> {
        self.deserialize_seq(visitor)
    }

    fn deserialize_struct<V: de::Visitor<'de>>(
        self,
        _: &'static str,
        _: &'static [&'static str],
        visitor: V,
    ) -> serde_json::Result<V::Value> {
        self.deserialize_map(visitor)
    }

    fn deserialize_option<V: de::Visitor<'de>>(self, visitor: V) -> serde_json::Result<V::Value> {
        if self.0.is_null() { visitor.visit_none() } else { visitor.visit_some(self) }
    }

    fn deserialize_enum<V: de::Visitor<'de>>(
        self,
        _: &'static str,
        names: &'static [&'static str],
        visitor: V,
    ) -> serde_json::Result<V::Value> {
        let found = match &self.0 {
            Value::String(name) => return visitor.visit_enum(name.as_str().into_deserializer()),
            Value::Null => de::Unexpected::Other("null"),
            Value::Bool(value) => de::Unexpected::Bool(*value),
            Value::Number(_) => de::Unexpected::Other("a number"),
            Value::Array(_) => de::Unexpected::Seq,
            Value::Object(_) => de::Unexpected::Map,
        };
        let expected = format!("one of {}", names.join(", "));
        Err(de::Error::invalid_type(found, &expected.as_str()))
    }

    plain! {
        deserialize_bool deserialize_i8 deserialize_i16 deserialize_i32 deserialize_i64
        deserialize_u8 deserialize_u16 deserialize_u32 deserialize_u64 deserialize_f32
        deserialize_f64 deserialize_char deserialize_str deserialize_string
    }

    serde::forward_to_deserialize_any! {
        i128 u128 bytes byte_buf unit unit_struct newtype_struct tuple_struct identifier ignored_any
    }
}

/// The entries of an array, for serde.
struct Items {
    rest: vec::IntoIter<Value>,
    read: usize,
}

impl<'de> de::SeqAccess<'de> for Items {
    type Error = serde_json::Error;

    fn next_element_seed<T: de::DeserializeSeed<'de>>(
        &mut self,
        seed: T,
    ) -> serde_json::Result<Option<T::Value>> {
        let Some(value) = self.rest.next() else { return Ok(None) };
        let value = seed.deserialize(Json(value)).map_err(|e| within(&self.read, &e))?;
        self.read += 1;
        Ok(Some(value))
    }

    fn size_hint(&self) -> Option<usize> {
        Some(self.rest.len())
    }
}

/// The entries of an object, for serde.
struct Entries {
    rest: serde_json::map::IntoIter,
    /// The key that was read last, with its value.
    open: Option<(String, Value)>,
}

impl<'de> de::MapAccess<'de> for Entries {
    type Error = serde_json::Error;

    fn next_key_seed<K: de::DeserializeSeed<'de>>(
        &mut self,
        seed: K,
    ) -> serde_json::Result<Option<K::Value>> {
        self.open = self.rest.next();
        let Some((key, _)) = &self.open else { return Ok(None) };
        seed.deserialize(key.as_str().into_deserializer()).map(Some).map_err(|e| within(key, &e))
    }

    fn next_value_seed<V: de::DeserializeSeed<'de>>(
        &mut self,
        seed: V,
    ) -> serde_json::Result<V::Value> {
        let (key, value) = self.open.take().expect("serde reads a key before its value");
        seed.deserialize(Json(value)).map_err(|e| within(&key, &e))
    }

    fn size_hint(&self) -> Option<usize> {
        Some(self.rest.len())
    }
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
                        return Err(de::Error::custom(format!("the key `{key}` {TWICE}")));
                    }
                    map.insert(key, value);
                }
                Ok(Value::Object(map))
            }
        }
        deserializer.deserialize_any(Visitor).map(Strict)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_text_holds_is_counted() {
        let counts = |arrays, objects, array_entries, object_entries| Counts {
            arrays,
            objects,
            array_entries,
            object_entries,
        };
        assert_eq!(Counts::of(b"1"), counts(0, 0, 0, 0));
        assert_eq!(Counts::of(br#"{"a": [1, 2, {"b": 3, "c": [], "d": 4}]}"#), counts(2, 2, 2, 2));
        let quoted = br#"["[{,\"[{,", "\\", "\u0022,"]"#;
        assert_eq!(Counts::of(quoted), counts(1, 0, 2, 0));
        assert_eq!(Counts::of(b"[\"open, [ {"), counts(1, 0, 0, 0));
        // the parser also stops at this depth
        assert_eq!(Counts::of("[".repeat(1000).as_bytes()), counts(DEEPEST, 0, 0, 0));
        assert!(
            parse("f", "[".repeat(1000).as_bytes()).unwrap_err().to_string().contains("nested")
        );
    }

    /// Returns the bytes that a value takes on the heap: for arrays with the unused room, for
    /// objects at least.
    fn heap(value: &Value) -> usize {
        match value {
            Value::Array(values) => {
                values.capacity() * size_of::<Value>() + values.iter().map(heap).sum::<usize>()
            }
            Value::Object(map) => {
                let entry = size_of::<(String, Value)>() + size_of::<usize>();
                map.len() * entry + map.values().map(heap).sum::<usize>()
            }
            _ => 0,
        }
    }

    #[test]
    fn counts_bound_what_values_take() {
        let list = |entry: &str, n: usize| format!("[{}]", vec![entry; n].join(","));
        let object = |n: usize| {
            let entries: Vec<String> = (0..n).map(|i| format!("\"{i}\":0")).collect();
            format!("{{{}}}", entries.join(","))
        };
        for text in [
            list("0", 1),
            list("0", 1000),
            list("[0]", 1000),
            list("{}", 1000),
            list("{\"a\":0}", 1000),
            list("[[],[0,0,0,0,0]]", 1000),
            object(1),
            object(1000),
            list(&object(5), 1000),
        ] {
            let value = parse("f", text.as_bytes()).unwrap();
            let (bound, taken) = (Counts::of(text.as_bytes()).value_bytes(), heap(&value));
            assert!(taken <= bound, "{taken} of {bound}: {text:.40}");
            assert!(bound < 200 * text.len(), "{bound}: {text:.40}");
        }
    }

    #[test]
    fn what_would_take_more_memory_is_not_read() {
        for entry in ["0", "[]", "[0]", "{\"a\":0}"] {
            let text = format!("[{}]", vec![entry; 40_000_000 / (entry.len() + 1)].join(","));
            let error = parse("f", text.as_bytes()).unwrap_err().to_string();
            assert!(
                error.contains("take") && error.contains("more than 1073741824; put"),
                "{error}"
            );
        }
        // a text of about the same length, but with long numbers
        let text = format!("[{}]", vec!["0.12345678901234567890"; 2_000_000].join(","));
        assert!(parse("f", text.as_bytes()).is_ok());
    }
}
