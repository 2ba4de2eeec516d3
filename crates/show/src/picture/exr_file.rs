//! Writes pictures as numbers: OpenEXR, 32-bit floats.

use std::io::{self, Cursor, Write};

use exr::prelude::{
    AnyChannel, AnyChannels, Encoding, FlatSamples, Image, Layer, LayerAttributes, SmallVec, Vec2,
    WritableImage,
};

use phylux_core::error::{Error, Result};

/// Encodes named channels of equal length, row by row from the upper left, and returns a function
/// that writes the file. Error: the channels do not make a valid file.
pub fn write_exr(
    width: usize,
    channels: Vec<(String, Vec<f32>)>,
) -> Result<impl FnOnce(&mut dyn Write) -> io::Result<()>> {
    let height = channels.first().map_or(0, |(_, values)| values.len() / width);
    let channel = |(name, values): (String, Vec<f32>)| {
        AnyChannel::new(name.as_str(), FlatSamples::F32(values))
    };
    let channels: SmallVec<[AnyChannel<FlatSamples>; 4]> =
        channels.into_iter().map(channel).collect();
    let layer = Layer::new(
        Vec2(width, height),
        LayerAttributes::default(),
        Encoding { line_order: exr::prelude::LineOrder::Increasing, ..Encoding::SMALL_LOSSLESS },
        AnyChannels::sort(channels),
    );
    let mut bytes = Cursor::new(Vec::new());
    Image::from_layer(layer)
        .write()
        .non_parallel()
        .to_buffered(&mut bytes)
        .map_err(|e| Error::run("EXR", e))?;
    Ok(move |writer: &mut dyn Write| writer.write_all(&bytes.into_inner()))
}
