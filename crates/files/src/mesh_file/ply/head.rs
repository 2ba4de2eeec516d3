//! The head of a PLY file: which elements follow, with which properties.

use crate::input::quoted;
use phylux_core::error::{Error, Result};

/// How the numbers of the body are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Encoding {
    Text,
    BigEndian,
    LittleEndian,
}

/// The type of a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Type {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Type {
    fn named(name: &str) -> Option<Self> {
        Some(match name {
            "char" | "int8" => Self::I8,
            "uchar" | "uint8" => Self::U8,
            "short" | "int16" => Self::I16,
            "ushort" | "uint16" => Self::U16,
            "int" | "int32" => Self::I32,
            "uint" | "uint32" => Self::U32,
            "float" | "float32" => Self::F32,
            "double" | "float64" => Self::F64,
            _ => return None,
        })
    }

    /// Number of bytes.
    pub fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }

    /// Returns the number in the first bytes, which are at least as many as it has, in the order of
    /// this machine's little endian.
    pub fn value(self, bytes: [u8; 8]) -> f64 {
        let [a, b, c, d, ..] = bytes;
        match self {
            Self::I8 => i8::from_le_bytes([a]).into(),
            Self::U8 => a.into(),
            Self::I16 => i16::from_le_bytes([a, b]).into(),
            Self::U16 => u16::from_le_bytes([a, b]).into(),
            Self::I32 => i32::from_le_bytes([a, b, c, d]).into(),
            Self::U32 => u32::from_le_bytes([a, b, c, d]).into(),
            Self::F32 => f32::from_le_bytes([a, b, c, d]).into(),
            Self::F64 => f64::from_le_bytes(bytes),
        }
    }
}

pub struct Property {
    pub name: String,
    pub kind: Type,
    /// Type of the number of values, if the property is a list.
    pub counted_by: Option<Type>,
}

pub struct Element {
    pub name: String,
    pub count: usize,
    pub properties: Vec<Property>,
}

pub struct Head {
    pub encoding: Encoding,
    pub elements: Vec<Element>,
    /// Where the body begins, bytes.
    pub bytes: usize,
    /// Number of lines before the body.
    pub lines: usize,
}

impl Head {
    pub fn parse(bytes: &[u8], name: &str) -> Result<Self> {
        let mut encoding = None;
        let mut elements: Vec<Element> = Vec::new();
        let (mut at, mut number) = (0, 0);
        loop {
            number += 1;
            let error = |problem: String, remedy: &str| {
                Error::input(format!("{name}:{number}"), problem).remedy(remedy)
            };
            let rest = &bytes[at..];
            // a line ends with \n, \r\n or, from old programs, \r
            let end = rest.iter().take(4096).position(|&b| b == b'\n' || b == b'\r');
            let Some(end) = end else {
                return match number {
                    1 => Err(not_ply(name)),
                    _ => Err(error("no `end_header` in the head".into(), "is it a PLY file?")),
                };
            };
            let line = String::from_utf8_lossy(&rest[..end]).into_owned();
            at += end + if rest[end..].starts_with(b"\r\n") { 2 } else { 1 };
            let words: Vec<&str> = line.split_whitespace().collect();
            match words[..] {
                ["ply"] if number == 1 => {}
                _ if number == 1 => return Err(not_ply(name)),
                [] | ["comment" | "obj_info", ..] => {}
                ["format", form, _] => {
                    encoding = Some(match form {
                        "ascii" => Encoding::Text,
                        "binary_big_endian" => Encoding::BigEndian,
                        "binary_little_endian" => Encoding::LittleEndian,
                        _ => {
                            let problem = format!("unknown format {}", quoted(form));
                            return Err(error(problem, "it is ascii or binary_..._endian"));
                        }
                    });
                }
                ["element", element, count] => {
                    let Ok(count) = count.parse() else {
                        let problem = format!("{} is no number of elements", quoted(count));
                        return Err(error(problem, "write `element NAME COUNT`"));
                    };
                    if elements.iter().any(|known| known.name == element) {
                        let problem = format!("a second element {}", quoted(element));
                        return Err(error(problem, "give each element one line"));
                    }
                    let (name, properties) = (element.to_owned(), Vec::new());
                    elements.push(Element { name, count, properties });
                }
                ["property", ref rest @ ..] => {
                    let Some(Element { properties, .. }) = elements.last_mut() else {
                        let problem = "a property before any element".into();
                        return Err(error(problem, "write `element vertex COUNT` before it"));
                    };
                    let Some(property) = property(rest) else {
                        let problem = format!("{} is no property", quoted(&line));
                        let remedy =
                            "write `property float x` or `property list uchar int vertex_indices`";
                        return Err(error(problem, remedy));
                    };
                    if properties.iter().any(|known| known.name == property.name) {
                        let problem = format!("a second property {}", quoted(&property.name));
                        return Err(error(problem, "give each property a name of its own"));
                    }
                    properties.push(property);
                }
                ["end_header"] => break,
                _ => {
                    let problem = format!("unknown line {}", quoted(&line));
                    return Err(error(problem, "is it a PLY file?"));
                }
            }
        }
        let Some(encoding) = encoding else {
            return Err(Error::input(name, "no `format` in the head")
                .remedy("write `format ascii 1.0` after `ply`"));
        };
        // elements of no bytes have no content, however many they are
        elements.retain(|element| !element.properties.is_empty());
        Ok(Self { encoding, elements, bytes: at, lines: number })
    }
}

fn not_ply(name: &str) -> Error {
    Error::input(name, "is no PLY file").remedy("its first line is `ply`")
}

/// Reads the words after `property`.
fn property(words: &[&str]) -> Option<Property> {
    let (counted_by, kind, name) = match words {
        ["list", count, kind, name] => (Some(Type::named(count)?), kind, name),
        [kind, name] => (None, kind, name),
        _ => return None,
    };
    Some(Property { name: (*name).to_owned(), kind: Type::named(kind)?, counted_by })
}
