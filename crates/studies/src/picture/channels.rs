//! The channels of an EXR file of a picture.

use super::job::PictureOf;
use phylux_core::scene::world::Scene;
use phylux_show::{picture::BandColours, render::Pixels};

/// Returns the channels of an EXR file: each band, named by the quantity and the band; and for
/// display R, G and B with radiance, or else the covered fraction of each pixel as A. Pictures of
/// the error have one channel, `error`, and A.
pub fn channels(pixels: &Pixels, scene: &Scene, show: PictureOf) -> Vec<(String, Vec<f32>)> {
    let count = pixels.covered.len();
    let what = match show {
        PictureOf::Radiance => "radiance",
        PictureOf::Absorbed => "absorbed",
        _ => "irradiance",
    };
    if show == PictureOf::Error {
        return [("error", &pixels.values), ("A", &pixels.covered)]
            .map(|(name, values)| (name.into(), values.clone()))
            .into();
    }
    let band = |b: usize| (0..count).map(|i| pixels.pixel(i)[b]).collect::<Vec<f32>>();
    let mut channels: Vec<(String, Vec<f32>)> = scene
        .bands()
        .iter()
        .enumerate()
        .map(|(b, named)| (format!("{what}.{}", named.name), band(b)))
        .collect();
    if show == PictureOf::Radiance {
        let colours = BandColours::new(scene.bands(), scene.quantity());
        for (c, name) in ["R", "G", "B"].into_iter().enumerate() {
            let value = |i: usize| colours.linear(pixels.pixel(i))[c];
            channels.push((name.into(), (0..count).map(value).collect()));
        }
    } else {
        channels.push(("A".into(), pixels.covered.clone()));
    }
    channels
}
