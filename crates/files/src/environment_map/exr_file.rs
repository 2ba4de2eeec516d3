//! Reads OpenEXR pictures: the first layer with all of its channels, placed in the display window.

use std::io::Cursor;

use exr::{
    meta::{
        attribute::{EnvironmentMap, IntegerBounds},
        header::Header,
    },
    prelude::{FlatSamples, ReadChannels, ReadLayers, read as reader},
};

use super::panorama::{Panorama, check_shape, check_size};
use crate::input::quoted;
use phylux_core::error::some;

/// Reads the bytes of an OpenEXR picture; the error is the problem, in words.
pub(super) fn read(bytes: &[u8]) -> std::result::Result<Panorama, String> {
    let broken = |e: exr::error::Error| format!("is not read as OpenEXR: {e}");
    // check the size in the header before memory of that size is allocated
    let meta =
        exr::meta::MetaData::read_from_buffered(Cursor::new(bytes), false).map_err(broken)?;
    let header = meta.headers.first().ok_or("has no layer")?;
    let channels = header.channels.list.len();
    check_size(header.layer_size.width(), header.layer_size.height(), channels)?;
    let window = header.shared_attributes.display_window;
    let (width, height) = (window.size.width(), window.size.height());
    check_size(width, height, channels)?;
    let place = Placement::new(header, &window);
    match header.own_attributes.environment_map {
        Some(EnvironmentMap::Cube) => {
            return Err("is a cube map (its attribute `envmap` says so), not a picture by \
                latitude and longitude, which alone is read"
                .into());
        }
        // such a map covers its data window, says OpenEXR, and any other its display window
        Some(EnvironmentMap::LatitudeLongitude) if !place.fills(width, height) => {
            return Err("has an attribute `envmap`, and a data window other than its display \
                window, which leaves open which of the two is the whole sphere"
                .into());
        }
        _ => {}
    }
    check_shape(width, height, f64::from(header.shared_attributes.pixel_aspect))?;
    let reader = reader().no_deep_data().largest_resolution_level().all_channels();
    let image = reader
        .first_valid_layer()
        .all_attributes()
        .non_parallel()
        .from_buffered(Cursor::new(bytes))
        .map_err(broken)?;
    let layer = image.layer_data;
    if (layer.size.width(), layer.size.height()) != (place.width, place.height) {
        return Err("has a first layer that is not read".into());
    }
    let mut channels: Vec<(String, Vec<f32>)> = layer
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
    if channels.iter().any(|(_, values)| values.len() != place.width * place.height) {
        return Err("has channels of different sizes".into());
    }
    let mut notes = notes(&meta.headers);
    if !place.fills(width, height) {
        for (_, values) in &mut channels {
            *values = place.within(values, width, height);
        }
        let rest = match place.covers(width, height) {
            true => "what lies outside of that is cut off",
            false => "the rest of that is black",
        };
        notes.push(format!(
            "its data window, {} x {} texels, is not its display window, {width} x {height}: {rest}",
            place.width, place.height
        ));
    }
    Ok(Panorama { width, height, channels, notes })
}

/// Where the data window lies in the display window.
struct Placement {
    left: i64,
    top: i64,
    width: usize,
    height: usize,
}

impl Placement {
    fn new(header: &Header, display: &IntegerBounds) -> Self {
        let data = header.own_attributes.layer_position;
        let offset = |data: i32, display: i32| i64::from(data) - i64::from(display);
        Self {
            left: offset(data.x(), display.position.x()),
            top: offset(data.y(), display.position.y()),
            width: header.layer_size.width(),
            height: header.layer_size.height(),
        }
    }

    fn fills(&self, width: usize, height: usize) -> bool {
        (self.left, self.top, self.width, self.height) == (0, 0, width, height)
    }

    fn covers(&self, width: usize, height: usize) -> bool {
        let all = |from: i64, data: usize, display: usize| {
            from <= 0 && from + data as i64 >= display as i64
        };
        all(self.left, self.width, width) && all(self.top, self.height, height)
    }

    /// Places the values of a channel in a display window of this size; what lies outside the data
    /// window is 0.
    fn within(&self, values: &[f32], width: usize, height: usize) -> Vec<f32> {
        // the part of both windows along one axis, as seen from the display window
        let common = |from: i64, data: usize, display: usize| {
            let end = (from + data as i64).clamp(0, display as i64) as usize;
            (from.clamp(0, display as i64) as usize).min(end)..end
        };
        let columns = common(self.left, self.width, width);
        let mut placed = vec![0.0; width * height];
        for row in common(self.top, self.height, height) {
            let line = (row as i64 - self.top) as usize * self.width;
            let first = (columns.start as i64 - self.left).max(0) as usize;
            let from = &values[line + first.min(self.width)..][..columns.len()];
            placed[row * width..][columns.clone()].copy_from_slice(from);
        }
        placed
    }
}

/// Says what the headers of a file hold that means something for light and is not used.
fn notes(headers: &[Header]) -> Vec<String> {
    let mut notes = Vec::new();
    let name = |(i, header): (usize, &Header)| match &header.own_attributes.layer_name {
        Some(name) => quoted(&name.to_string()),
        None => format!("number {}", i + 1),
    };
    let mut layers = headers.iter().enumerate().map(name);
    let first = layers.next().unwrap_or_default();
    if headers.len() > 1 {
        notes.push(format!(
            "of its layers only the first, {first}, is read, not {}",
            some(layers, 5)
        ));
    }
    let Some(own) = headers.first().map(|header| &header.own_attributes) else { return notes };
    if let Some(white) = own.white_luminance {
        notes.push(format!(
            "its `whiteLuminance` of {white} is not used: `scale` or `irradiance` says how bright \
             the map is"
        ));
    }
    if own.world_to_camera.is_some_and(|turn| turn != IDENTITY) {
        notes.push(
            "its `worldToCamera` is not used: `heading_deg` says where the middle of the map lies"
                .into(),
        );
    }
    notes
}

const IDENTITY: [f32; 16] =
    [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0];
