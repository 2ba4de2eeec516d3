//! Pictures: coloured pixels, text on them, and files (PNG; EXR for numbers).
//!
//! `spectral` and `scale` turn values into colours, `glow` spreads bright light, `bar` adds a
//! colour bar, and `canvas` lets charts be drawn on a picture.

mod bar;
mod canvas;
#[cfg(feature = "exr")]
mod exr_file;
mod glow;
mod scale;
mod spectral;

use std::io::{self, Write};

use glam::Vec3;
use noto_sans_mono_bitmap::{FontWeight, RasterHeight, get_raster, get_raster_width};

pub use bar::Legend;
pub(super) use canvas::Canvas;
#[cfg(feature = "exr")]
pub use exr_file::write_exr;
pub use glow::with_glow;
pub use scale::Scale;
pub(super) use scale::label;
pub use spectral::{BandColours, Exposure};

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
const INK: Vec3 = Vec3::splat(0.1);

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

    /// Returns the picture with background added to the right, `by` pixels wide, and below, up to a
    /// height of at least `least`.
    fn widened(&self, by: usize, least: usize) -> Self {
        let (width, height) = (self.width + by, self.height.max(least));
        let paper = std::iter::repeat_n(PAPER, width * height);
        let mut wide = Self::new(width, paper);
        for (y, row) in self.rgb.chunks(3 * self.width).enumerate() {
            wide.rgb[3 * y * width..][..row.len()].copy_from_slice(row);
        }
        wide
    }

    /// Writes a line of text with its upper left corner at `x`, `y`.
    fn text(&mut self, x: usize, y: usize, size: TextSize, text: &str) {
        for (i, c) in text.chars().enumerate() {
            let known = |c| get_raster(c, FontWeight::Regular, size.0);
            let Some(raster) = known(c).or_else(|| known('?')) else { continue };
            for (row, pixels) in raster.rows().enumerate() {
                for (column, &ink) in pixels.iter().enumerate() {
                    let colour = PAPER.lerp(INK, f32::from(ink) / 255.0);
                    if ink > 0 {
                        self.set(x + i * raster.width() + column, y + row, colour);
                    }
                }
            }
        }
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

/// A height of letters.
#[derive(Clone, Copy, Debug)]
struct TextSize(RasterHeight);

impl TextSize {
    /// Chooses the letters for a picture of this height in pixels.
    fn of(height: usize) -> Self {
        Self(if height > 1100 { RasterHeight::Size24 } else { RasterHeight::Size16 })
    }

    fn height(self) -> usize {
        self.0.val()
    }

    fn width(self) -> usize {
        get_raster_width(FontWeight::Regular, self.0)
    }
}

fn bytes(colour: Vec3) -> [u8; 3] {
    (255.0 * colour.clamp(Vec3::ZERO, Vec3::ONE) + 0.5).to_array().map(|c| c as u8)
}
