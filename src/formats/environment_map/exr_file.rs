//! Reads OpenEXR pictures: the first layer with all of its channels.

use std::io::Cursor;

use exr::prelude::{FlatSamples, ReadChannels, ReadLayers, read as reader};

use super::panorama::{Panorama, check_size};

/// Reads the bytes of an OpenEXR picture; the error is the problem, in words.
pub(super) fn read(bytes: &[u8]) -> std::result::Result<Panorama, String> {
    let broken = |e: exr::error::Error| format!("is not read as OpenEXR: {e}");
    // check the size in the header before memory of that size is allocated
    let meta =
        exr::meta::MetaData::read_from_buffered(Cursor::new(bytes), false).map_err(broken)?;
    let header = meta.headers.first().ok_or("has no layer")?;
    let (width, height) = (header.layer_size.width(), header.layer_size.height());
    check_size(width, height, header.channels.list.len())?;
    let reader = reader().no_deep_data().largest_resolution_level().all_channels();
    let image = reader
        .first_valid_layer()
        .all_attributes()
        .non_parallel()
        .from_buffered(Cursor::new(bytes))
        .map_err(broken)?;
    let layer = image.layer_data;
    let (width, height) = (layer.size.width(), layer.size.height());
    let channels: Vec<(String, Vec<f32>)> = layer
        .channel_data
        .list
        .into_iter()
        .map(|channel| {
            let values = match channel.sample_data {
                FlatSamples::F16(values) => values.iter().map(|v| v.to_f32()).collect(),
                FlatSamples::F32(values) => values,
                FlatSamples::U32(values) => values.iter().map(|&v| v as f32).collect(),
            };
            (channel.name.to_string(), values)
        })
        .collect();
    match channels.iter().all(|(_, values)| values.len() == width * height) {
        true => Ok(Panorama { width, height, channels }),
        false => Err("has channels of different sizes".into()),
    }
}
