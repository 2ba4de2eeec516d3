//! Pictures: coloured pixels, text on them, and files (PNG; EXR for numbers).
//!
//! `spectral` and `scale` turn values into colours, `steps` cuts a scale, `glow` spreads bright light,
//! `raster` makes pixels of drawings, `bar` adds a colour bar and `key` a key of colours, and `splats`
//! draws soft discs of light or ink, with `relief` around what stands in front of them.

mod bar;
#[cfg(feature = "exr")]
mod exr_file;
mod glow;
mod key;
mod raster;
mod relief;
mod scale;
mod spectral;
mod splats;
mod steps;

use std::io::{self, Write};

use glam::Vec3;

pub use bar::Legend;
#[cfg(feature = "exr")]
pub use exr_file::write_exr;
pub use glow::with_glow;
pub use key::Key;
pub use relief::relief;
pub use scale::Scale;
pub(super) use scale::label;
pub use spectral::{BandColours, Exposure, Metered, WhiteBalance, encoded, linear};
pub use splats::{Crowd, Ground, Splats};
pub use steps::Steps;

/// Pixels in 8-bit sRGB, row by row from the upper left.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Picture {
    /// Pixels across.
    pub width: usize,
    /// Pixels down.
    pub height: usize,
    rgb: Vec<u8>,
}

/// The colour of the background, sRGB.
pub const PAPER: Vec3 = Vec3::ONE;

impl Picture {
    /// Makes a picture of sRGB colours in [0, 1], row by row from the upper left.
    pub fn new(width: usize, colours: impl Iterator<Item = Vec3>) -> Self {
        let rgb: Vec<u8> = colours.flat_map(bytes).collect();
        Self { width, height: rgb.len() / (3 * width), rgb }
    }

    /// Returns the three bytes of every pixel, row by row from the upper left.
    pub fn rgb(&self) -> &[u8] {
        &self.rgb
    }

    /// Gives a pixel a colour; outside the picture nothing happens.
    pub fn set(&mut self, x: usize, y: usize, colour: Vec3) {
        if x < self.width && y < self.height {
            let at = 3 * (y * self.width + x);
            self.rgb[at..at + 3].copy_from_slice(&bytes(colour));
        }
    }

    /// Returns the picture with another to its right; what is below the lower of both is `paper`,
    /// sRGB.
    fn beside(&self, other: &Self, paper: Vec3) -> Self {
        let (width, height) = (self.width + other.width, self.height.max(other.height));
        let mut both = Self::new(width, std::iter::repeat_n(paper, width * height));
        for (picture, left) in [(self, 0), (other, self.width)] {
            for (y, row) in picture.rgb.chunks(3 * picture.width).enumerate() {
                both.rgb[3 * (y * width + left)..][..row.len()].copy_from_slice(row);
            }
        }
        both
    }

    /// Writes the picture as PNG.
    pub fn write_png(&self, writer: &mut dyn Write) -> io::Result<()> {
        let side = |pixels: usize| u32::try_from(pixels).map_err(io::Error::other);
        let mut encoder = png::Encoder::new(writer, side(self.width)?, side(self.height)?);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
        encoder.set_compression(png::Compression::High);
        let mut writer = encoder.write_header()?;
        writer.write_image_data(&self.rgb)?;
        writer.finish()?;
        Ok(())
    }
}

fn bytes(colour: Vec3) -> [u8; 3] {
    (255.0 * colour.clamp(Vec3::ZERO, Vec3::ONE) + 0.5).to_array().map(|c| c as u8)
}
