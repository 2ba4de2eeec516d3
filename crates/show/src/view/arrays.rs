//! The long lists of numbers of a page.

use std::io::{self, Write};

use base64::{engine::general_purpose::STANDARD, write::EncoderWriter};
use flate2::{Compression, write::ZlibEncoder};

/// Bytes of an array that are deflated at a time.
const PIECE: usize = 1 << 16;

/// Long lists of numbers, deflated (zlib) in base64, with their names.
#[derive(Default)]
pub(super) struct Arrays(pub(super) Vec<(&'static str, Vec<u8>)>);

impl Arrays {
    /// Adds an array, piece by piece, because it can be as large as all the light.
    pub(super) fn add(
        &mut self,
        name: &'static str,
        mut bytes: impl Iterator<Item = u8>,
    ) -> io::Result<()> {
        let mut text = Vec::new();
        let encoder = EncoderWriter::new(&mut text, &STANDARD);
        let mut deflated = ZlibEncoder::new(encoder, Compression::default());
        let mut piece = Vec::with_capacity(PIECE);
        loop {
            piece.extend(bytes.by_ref().take(PIECE));
            if piece.is_empty() {
                break;
            }
            deflated.write_all(&piece)?;
            piece.clear();
        }
        deflated.finish()?.finish()?;
        self.0.push((name, text));
        Ok(())
    }
}

/// Returns the bytes of numbers, the lower one first.
pub(super) fn shorts(values: impl Iterator<Item = u16>) -> impl Iterator<Item = u8> {
    values.flat_map(u16::to_le_bytes)
}
