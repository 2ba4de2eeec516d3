//! The body of a PLY file: the rows of its elements, one after the other.

use super::head::{Element, Encoding, Head, Property, Type};
use crate::{input::quoted, mesh_file::shared::number};
use phylux_core::error::{Error, Result};

/// Where a row of the body stands: at a line of a text, or somewhere in a binary file.
#[derive(Clone, Copy)]
pub struct Place(Option<usize>);

impl Place {
    pub fn of(self, name: &str) -> String {
        self.0.map_or(name.to_owned(), |line| format!("{name}:{line}"))
    }
}

/// What is left of the body.
pub struct Body<'a> {
    rest: &'a [u8],
    encoding: Encoding,
    /// Number of lines read so far, in a text.
    lines: usize,
    name: &'a str,
    /// The values of the property that is being read.
    values: Vec<f64>,
}

impl<'a> Body<'a> {
    pub fn new(bytes: &'a [u8], head: &Head, name: &'a str) -> Self {
        let Head { encoding, bytes: start, lines, .. } = *head;
        Self { rest: &bytes[start..], encoding, lines, name, values: Vec::new() }
    }

    /// Reads row `row` of an element, and hands over the values of each of its properties by the
    /// index of the property. Error: the body ends before, or holds something else.
    pub fn row(
        &mut self,
        element: &Element,
        row: usize,
        what: &str,
        mut take: impl FnMut(usize, &[f64]),
    ) -> Result<Place> {
        let is_text = self.encoding == Encoding::Text;
        if !is_text && self.binary_row(&element.properties, &mut take).is_some() {
            return Ok(Place(None));
        }
        let line = if is_text { self.line() } else { None };
        let Some(line) = line else {
            let problem = format!("ends before the end of {what} {row} of {}", element.count);
            return Err(Error::input(self.name, problem).remedy("export it again"));
        };
        let place = Place(Some(self.lines));
        self.text_row(&element.properties, &line, take).map_err(|problem| {
            Error::input(place.of(self.name), format!("{what} {row}: {problem}"))
                .remedy("a line has the numbers of the properties in the head, and no others")
        })?;
        Ok(place)
    }

    /// Says what stands after the last element, if there is anything.
    pub fn beyond(&mut self) -> Option<String> {
        match self.encoding {
            Encoding::Text => self.line().map(|_| format!("text from line {} on", self.lines)),
            _ => (!self.rest.is_empty()).then(|| format!("{} bytes", self.rest.len())),
        }
    }

    /// Returns the next line that is not empty.
    fn line(&mut self) -> Option<String> {
        loop {
            if self.rest.is_empty() {
                return None;
            }
            self.lines += 1;
            let end = self.rest.iter().position(|&b| b == b'\n' || b == b'\r');
            let (line, rest) = self.rest.split_at(end.unwrap_or(self.rest.len()));
            let break_ = if rest.starts_with(b"\r\n") { 2 } else { rest.len().min(1) };
            self.rest = &rest[break_..];
            if !line.trim_ascii().is_empty() {
                return Some(String::from_utf8_lossy(line).into_owned());
            }
        }
    }

    fn text_row(
        &mut self,
        properties: &[Property],
        line: &str,
        mut take: impl FnMut(usize, &[f64]),
    ) -> std::result::Result<(), String> {
        let mut words = line.split_ascii_whitespace();
        for (i, property) in properties.iter().enumerate() {
            let mut next = || words.next().ok_or("fewer numbers than the head says");
            self.values.clear();
            if property.counted_by.is_none() {
                let word = next()?;
                // what is not used may be no number; what is used is checked by who takes it
                let value = number(word).ok().or_else(|| word.parse().ok());
                let value = value.ok_or_else(|| format!("{} is no number", quoted(word)))?;
                self.values.push(value);
            } else {
                let word = next()?;
                let count: usize =
                    word.parse().map_err(|_| format!("{} is no number of values", quoted(word)))?;
                for _ in 0..count {
                    self.values.push(number(next()?)?);
                }
            }
            take(i, &self.values);
        }
        match words.next() {
            None => Ok(()),
            Some(word) => Err(format!("{} is more than the head says", quoted(word))),
        }
    }

    fn binary_row(
        &mut self,
        properties: &[Property],
        take: &mut impl FnMut(usize, &[f64]),
    ) -> Option<()> {
        for (i, property) in properties.iter().enumerate() {
            let count = match property.counted_by {
                None => 1.0,
                Some(kind) => self.value(kind)?,
            };
            // a negative number of values is none that a list can have
            let count = (count >= 0.0 && count.fract() == 0.0).then_some(count as usize)?;
            if count > self.rest.len() / property.kind.size() {
                return None;
            }
            self.values.clear();
            for _ in 0..count {
                let value = self.value(property.kind)?;
                self.values.push(value);
            }
            take(i, &self.values);
        }
        Some(())
    }

    fn value(&mut self, kind: Type) -> Option<f64> {
        let (own, rest) = self.rest.split_at_checked(kind.size())?;
        self.rest = rest;
        let mut bytes = [0; 8];
        bytes[..own.len()].copy_from_slice(own);
        if self.encoding == Encoding::BigEndian {
            bytes[..own.len()].reverse();
        }
        Some(kind.value(bytes))
    }
}
