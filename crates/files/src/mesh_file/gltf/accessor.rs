//! The numbers in the buffers of a glTF. They are read from the bytes when they are asked for, so
//! that no file can ask for more memory than it has itself.

use std::{borrow::Cow, cell::RefCell, collections::HashMap, rc::Rc};

use super::document::{self, Document, Place};
use crate::{input::quoted, json::place};
use phylux_core::{
    error::{Error, Result},
    scene::world::MAX_TRIANGLES,
};

/// The buffers of a file, with the views and accessors that give them meaning.
pub struct Buffers<'a> {
    document: &'a Document,
    buffers: &'a [Cow<'a, [u8]>],
    name: &'a str,
    /// Values that replace others (sparse accessors), by accessor, then by element.
    replaced: RefCell<HashMap<usize, Rc<Replaced>>>,
}

type Replaced = HashMap<usize, [f64; 3]>;

/// The numbers of one accessor: elements of one number (indices) or of three (points).
pub struct Accessor<'a> {
    /// `None` stands for zeros.
    numbers: Option<Numbers<'a>>,
    count: usize,
    replaced: Option<Rc<Replaced>>,
    place: String,
}

/// Elements of up to three numbers, at equal distances in some bytes.
struct Numbers<'a> {
    bytes: &'a [u8],
    stride: usize,
    width: usize,
    kind: Kind,
}

/// The type of a number.
#[derive(Clone, Copy)]
struct Kind {
    code: u32,
    normalized: bool,
}

impl Kind {
    fn size(self) -> Option<usize> {
        match self.code {
            5120 | 5121 => Some(1),
            5122 | 5123 => Some(2),
            5125 | 5126 => Some(4),
            _ => None,
        }
    }

    /// Returns the number in these bytes, as many as [`size`](Self::size) says.
    fn value(self, bytes: &[u8]) -> f64 {
        let two = || [bytes[0], bytes[1]];
        let four = || [bytes[0], bytes[1], bytes[2], bytes[3]];
        let (value, largest) = match self.code {
            5120 => (i8::from_le_bytes([bytes[0]]).into(), i8::MAX.into()),
            5121 => (bytes[0].into(), u8::MAX.into()),
            5122 => (i16::from_le_bytes(two()).into(), i16::MAX.into()),
            5123 => (u16::from_le_bytes(two()).into(), u16::MAX.into()),
            5125 => (u32::from_le_bytes(four()).into(), u32::MAX.into()),
            _ => (f32::from_le_bytes(four()).into(), 1.0),
        };
        if self.normalized { f64::max(value / largest, -1.0) } else { value }
    }
}

impl Numbers<'_> {
    fn get(&self, i: usize) -> [f64; 3] {
        let size = self.kind.size().unwrap_or(1);
        let element = &self.bytes[i * self.stride..];
        let mut found = [0.0; 3];
        for (value, bytes) in found[..self.width].iter_mut().zip(element.chunks_exact(size)) {
            *value = self.kind.value(bytes);
        }
        found
    }
}

impl<'a> Buffers<'a> {
    pub fn new(document: &'a Document, buffers: &'a [Cow<'a, [u8]>], name: &'a str) -> Self {
        Self { document, buffers, name, replaced: RefCell::default() }
    }

    /// Names the place of a JSON pointer in the file, for errors.
    pub fn place(&self, pointer: &str) -> String {
        place(self.name, pointer)
    }

    /// Returns accessor `i`, whose elements must have `width` numbers, 1 or 3.
    pub fn accessor(&self, i: usize, width: usize) -> Result<Accessor<'a>> {
        let place = self.place(&format!("/accessors/{i}"));
        let error = |problem: String| Error::input(&place, problem).remedy("export it again");
        let Some(accessor) = self.document.accessors.get(i) else {
            return Err(error("there is none of this number".into()));
        };
        let shape = if width == 3 { "VEC3" } else { "SCALAR" };
        if accessor.shape != shape {
            return Err(error(format!("type {}, must be {shape}", quoted(&accessor.shape))));
        }
        let document::Accessor { component_type, normalized, count, .. } = *accessor;
        let kind = Kind { code: component_type, normalized };
        let view = |view, offset, count, kind, width| {
            self.numbers(view, offset, count, kind, width).map_err(&error)
        };
        let numbers = match accessor.buffer_view {
            Some(own) => Some(view(own, accessor.byte_offset, count, kind, width)?),
            None if accessor.sparse.is_some() && count <= MAX_TRIANGLES => None,
            None => return Err(error("has no `bufferView`, so it has no numbers".into())),
        };
        let replaced = match &accessor.sparse {
            None => None,
            Some(_) if self.replaced.borrow().contains_key(&i) => {
                self.replaced.borrow().get(&i).cloned()
            }
            Some(sparse) => {
                let known: usize = self.replaced.borrow().values().map(|known| known.len()).sum();
                if known.saturating_add(sparse.count) > MAX_TRIANGLES {
                    return Err(error("more sparse values than memory holds".into()));
                }
                let Place { buffer_view, byte_offset, component_type } = sparse.indices;
                let whole = Kind { code: component_type.unwrap_or(0), normalized: false };
                let indices = view(buffer_view, byte_offset, sparse.count, whole, 1)?;
                let Place { buffer_view, byte_offset, .. } = sparse.values;
                let values = view(buffer_view, byte_offset, sparse.count, kind, width)?;
                let pairs = (0..sparse.count).map(|k| (indices.get(k)[0] as usize, values.get(k)));
                let found = Rc::new(pairs.collect::<Replaced>());
                self.replaced.borrow_mut().insert(i, found.clone());
                Some(found)
            }
        };
        Ok(Accessor { numbers, count, replaced, place })
    }

    /// Returns the numbers in a view of a buffer; the error is the problem alone, in words.
    fn numbers(
        &self,
        view: usize,
        offset: usize,
        count: usize,
        kind: Kind,
        width: usize,
    ) -> std::result::Result<Numbers<'a>, String> {
        let size = kind.size().ok_or_else(|| format!("componentType {}", kind.code))?;
        let found = self.document.buffer_views.get(view);
        let found = found.ok_or_else(|| format!("there is no bufferView {view}"))?;
        let buffer = self.buffers.get(found.buffer);
        let buffer = buffer.ok_or_else(|| format!("there is no buffer {}", found.buffer))?;
        let end = found.byte_offset.checked_add(found.byte_length);
        let bytes = end.and_then(|end| buffer.get(found.byte_offset..end));
        let bytes = bytes.ok_or_else(|| format!("bufferView {view} is beyond its buffer"))?;
        let stride = found.byte_stride.unwrap_or(size * width);
        if stride < size * width {
            return Err(format!("byteStride {stride} of bufferView {view} is too small"));
        }
        let bytes = bytes.get(offset..).unwrap_or_default();
        let needed = count.saturating_sub(1).checked_mul(stride);
        let needed = needed.and_then(|before| before.checked_add(size * width));
        match needed.is_some_and(|needed| count == 0 || needed <= bytes.len()) {
            true => Ok(Numbers { bytes, stride, width, kind }),
            false => Err(format!("{count} elements, but bufferView {view} ends before")),
        }
    }
}

impl Accessor<'_> {
    pub fn count(&self) -> usize {
        self.count
    }

    /// Makes an error at the accessor.
    pub fn error(&self, problem: String) -> Error {
        Error::input(&self.place, problem).remedy("mend it in the modelling program")
    }

    /// Returns element `i`. Error: there is none.
    pub fn get(&self, i: usize) -> Result<[f64; 3]> {
        if i >= self.count {
            return Err(self.error(format!("vertex {i} of a face, but there are {}", self.count)));
        }
        let replaced = self.replaced.as_ref().and_then(|replaced| replaced.get(&i)).copied();
        let own = || self.numbers.as_ref().map_or([0.0; 3], |numbers| numbers.get(i));
        Ok(replaced.unwrap_or_else(own))
    }

    /// Returns element `i` as an index. Error: there is none, or it is no whole number.
    pub fn index(&self, i: usize) -> Result<usize> {
        let [index, ..] = self.get(i)?;
        match index >= 0.0 && index.fract() == 0.0 {
            true => Ok(index as usize),
            false => Err(self.error(format!("the index {index} is no whole number"))),
        }
    }
}
