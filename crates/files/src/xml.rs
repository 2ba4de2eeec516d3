//! Small files of XML, as a tree of elements with their lines.

use std::{fmt::Display, path::Path};

use quick_xml::{
    Reader, XmlVersion,
    escape::resolve_predefined_entity,
    events::{BytesRef, BytesStart, Event},
};

use crate::input::{from_utf16, quoted};
use phylux_core::error::{Error, Result};

/// The deepest nesting of elements.
const DEEPEST: usize = 64;
/// The most elements of a file.
const MOST: usize = 4_000_000;

/// An element.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Element {
    /// Its name without a prefix.
    pub name: String,
    /// Names, without prefixes, and values of its attributes.
    pub attributes: Vec<(String, String)>,
    /// Its own text, without blanks around it.
    pub text: String,
    /// The line where it begins, from 1.
    pub line: usize,
    /// The elements in it.
    pub children: Vec<Element>,
}

impl Element {
    /// Returns the elements of this name in it.
    pub fn all<'a>(&'a self, name: &'a str) -> impl Iterator<Item = &'a Self> + 'a {
        self.children.iter().filter(move |child| child.name == name)
    }

    /// Returns the first element of this name in it.
    pub fn first(&self, name: &str) -> Option<&Self> {
        self.children.iter().find(|child| child.name == name)
    }

    /// Returns the text of the first element of this name in it; empty if there is none.
    pub fn text_of(&self, name: &str) -> &str {
        self.first(name).map_or("", |child| &child.text)
    }

    /// Returns the value of an attribute; empty if there is none.
    pub fn attribute(&self, name: &str) -> &str {
        self.attributes.iter().find(|(key, _)| key == name).map_or("", |(_, value)| value)
    }

    /// Returns an error at the element in the file at `path`.
    pub fn error(&self, path: &Path, problem: impl Display) -> Error {
        Error::input(format!("{}:{}", path.display(), self.line), problem)
    }

    /// Reads a finite number from `text`, a text of the element. Error: it is none; `what` names it.
    pub fn number(&self, path: &Path, text: &str, what: &str) -> Result<f64> {
        text.parse().ok().filter(|x: &f64| x.is_finite()).ok_or_else(|| {
            self.error(path, format!("{what} is {}, not a finite number", quoted(text)))
                .remedy("the file is broken: fetch it again, or export it anew")
        })
    }
}

/// Whether the bytes of a file begin as XML does, in UTF-8 or UTF-16.
pub fn is_xml(bytes: &[u8]) -> bool {
    // marks of the byte order, and halves of characters in UTF-16
    let marks = [0xef, 0xbb, 0xbf, 0xfe, 0xff, 0];
    let skipped = |byte: &&u8| byte.is_ascii_whitespace() || marks.contains(*byte);
    bytes.iter().find(|byte| !skipped(byte)) == Some(&b'<')
}

/// Reads the outermost element of a file. Errors, at the line: it is no XML in UTF-8 or UTF-16, or is
/// larger or nested deeper than any file of data; it has an entity that XML itself does not define.
pub fn parse(bytes: &[u8], path: &Path) -> Result<Element> {
    let decoded = from_utf16(bytes);
    let text = match &decoded {
        Some(text) => text,
        None => std::str::from_utf8(bytes).map_err(|_| {
            Error::input(path.display(), "is no XML file in UTF-8 or UTF-16")
                .remedy("save it in UTF-8")
        })?,
    };
    let text = text.trim_start_matches('\u{feff}');
    let mut tree = Tree { path, line: 1, open: Vec::new(), root: None, count: 0 };
    tree.read(text)?;
    tree.root()
}

/// The elements of a file, as they are read.
struct Tree<'a> {
    path: &'a Path,
    /// The line that is read.
    line: usize,
    /// Elements that have not ended yet, the outermost first.
    open: Vec<Element>,
    /// The outermost element, once it has ended.
    root: Option<Element>,
    /// The number of elements.
    count: usize,
}

impl Tree<'_> {
    fn read(&mut self, text: &str) -> Result<()> {
        let mut reader = Reader::from_str(text);
        let mut until = 0;
        loop {
            let begin = (reader.buffer_position() as usize).min(text.len());
            let passed = &text.as_bytes()[until..begin];
            self.line += passed.iter().filter(|&&byte| byte == b'\n').count();
            until = begin;
            match reader.read_event().map_err(|e| self.no_xml(e))? {
                Event::Start(start) => self.begin(&start)?,
                Event::Empty(start) => {
                    self.begin(&start)?;
                    self.end();
                }
                Event::End(_) => self.end(),
                Event::Text(part) => self.add(&part),
                Event::CData(part) => self.add(&part),
                Event::GeneralRef(name) => {
                    let what = || quoted(&format!("&{};", &*name));
                    let text = replacement(&name).ok_or_else(|| self.unknown_entity(&what()))?;
                    self.add(&text);
                }
                Event::Eof => return Ok(()),
                _ => {}
            }
        }
    }

    /// Begins an element in the innermost open one.
    fn begin(&mut self, start: &BytesStart) -> Result<()> {
        self.count += 1;
        if self.open.len() == DEEPEST || self.count > MOST {
            return Err(self.no_xml(format!(
                "more than {DEEPEST} elements within elements, or {MOST} elements"
            )));
        }
        let mut element = Element { line: self.line, ..Element::default() };
        element.name = start.local_name().as_ref().to_string();
        for attribute in start.attributes() {
            let attribute = attribute.map_err(|e| self.no_xml(e))?;
            let name = attribute.key.local_name().as_ref().to_string();
            let value = attribute.normalized_value(XmlVersion::Implicit1_0).map_err(|_| {
                let what = format!("attribute {} ({})", quoted(&name), quoted(&attribute.value));
                self.unknown_entity(&what)
            })?;
            element.attributes.push((name, value.trim().to_string()));
        }
        self.open.push(element);
        Ok(())
    }

    /// Adds to the text of the innermost open element.
    fn add(&mut self, text: &str) {
        if let Some(element) = self.open.last_mut() {
            element.text += text;
        }
    }

    /// Ends the innermost open element: it belongs to the one around it, or is the outermost.
    fn end(&mut self) {
        let Some(mut element) = self.open.pop() else { return };
        element.text = element.text.trim().to_string();
        match self.open.last_mut() {
            Some(outer) => outer.children.push(element),
            None => self.root = self.root.take().or(Some(element)),
        }
    }

    /// Returns the outermost element. Error: the file has none, or one that does not end.
    fn root(self) -> Result<Element> {
        if let Some(element) = self.open.last() {
            let problem = format!("{} does not end", quoted(&format!("<{}>", element.name)));
            return Err(element
                .error(self.path, problem)
                .remedy("the file is cut off: fetch it again"));
        }
        self.root
            .ok_or_else(|| Error::input(self.path.display(), "has no element of XML").remedy(ANEW))
    }

    fn error(&self, problem: String) -> Error {
        Error::input(format!("{}:{}", self.path.display(), self.line), problem)
    }

    fn no_xml(&self, problem: impl Display) -> Error {
        self.error(format!("is no XML: {problem}")).remedy(ANEW)
    }

    fn unknown_entity(&self, what: &str) -> Error {
        let problem = format!(
            "{what} has an entity that is none of XML's own, and those of a file are not read"
        );
        self.error(problem).remedy("write its text in its place")
    }
}

/// What to do about a broken file.
const ANEW: &str = "fetch the file again, or export it anew";

/// Returns the text for which a reference to a character or to one of the entities of XML itself
/// stands, such as `&#48;` and `&lt;`; `None` for any other.
fn replacement(name: &BytesRef) -> Option<String> {
    match name.resolve_char_ref() {
        Ok(Some(character)) => Some(character.into()),
        Ok(None) => resolve_predefined_entity(name).map(str::to_owned),
        Err(_) => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn elements_have_their_lines_texts_and_attributes() {
        let text = "<?xml version=\"1.0\"?>\n<!-- a -->\n<x:a xmlns:x=\"u\">\n <b w=\" 4 \">1 &amp; 2</b>\n <b/><![CDATA[t]]></x:a>";
        let root = parse(text.as_bytes(), Path::new("a.xml")).unwrap();
        assert_eq!((root.name.as_str(), root.line, root.text.as_str()), ("a", 3, "t"));
        let b = root.first("b").unwrap();
        assert_eq!((b.text.as_str(), b.line, b.attribute("w")), ("1 & 2", 4, "4"));
        assert_eq!(root.all("b").count(), 2);
        assert_eq!(root.text_of("c"), "");
    }

    /// Characters by their numbers and the entities of XML are replaced. Others, which a file may
    /// define or not, are refused: left out, they would make another number of `4&y;2`.
    #[test]
    fn entities_are_replaced_or_refused() {
        let read = |text: &str| parse(text.as_bytes(), Path::new("a.xml"));
        let root = read("<a w='&#x31;&#50;&lt;'>4&#46;5&amp;</a>").unwrap();
        assert_eq!((root.text.as_str(), root.attribute("w")), ("4.5&", "12<"));
        let defined = "<!DOCTYPE a [<!ENTITY y \"7\">]>\n";
        for (text, line) in [
            ("<a>\n<b>4&y;2</b></a>", 2),
            (&*format!("{defined}<a>4&y;2</a>"), 2),
            (&*format!("{defined}<a><b w='4&y;2'/></a>"), 2),
            ("<a>4&#x110000;2</a>", 1),
        ] {
            let error = read(text).unwrap_err().to_string();
            assert!(error.starts_with(&format!("a.xml:{line}: ")), "{error}");
            assert!(error.contains("none of XML's own"), "{error}");
        }
    }

    #[test]
    fn what_is_no_xml_is_refused_at_its_line() {
        for (text, start) in [
            ("<a>\n<b>\n</a>", "a.xml:"),
            ("<a>\n<b>", "a.xml:2: `<b>` does not end"),
            ("<!-- a -->", "a.xml: has no element of XML"),
            (&*"<a>".repeat(100), "a.xml:1: is no XML: more than 64"),
        ] {
            let error = parse(text.as_bytes(), Path::new("a.xml")).unwrap_err().to_string();
            assert!(error.starts_with(start), "{error}");
        }
        assert!(parse(b"<a>\xff</a>", Path::new("a.xml")).is_err());
        assert!(is_xml(b"\xef\xbb\xbf \n<a/>") && !is_xml(b"nm,R") && !is_xml(b""));
        for mark in ["", "\u{feff}"] {
            let units: Vec<u16> = format!("{mark}<a>1</a>").encode_utf16().collect();
            for bytes in [u16::to_le_bytes, u16::to_be_bytes] {
                let bytes: Vec<u8> = units.iter().flat_map(|unit| bytes(*unit)).collect();
                assert!(is_xml(&bytes));
                assert_eq!(parse(&bytes, Path::new("a")).unwrap().text, "1");
            }
        }
    }
}
