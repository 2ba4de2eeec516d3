//! Reads PNG and TGA pictures for masks.

use std::io::Cursor;

use tinytga::{Bpp, Compression, DataType, RawTga};

use super::bitmap::{Bitmap, MAX_TEXELS};

/// The channel of a picture that is the mask, as `-imfchan` of an MTL file names it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Channel {
    /// Red.
    Red,
    /// Green.
    Green,
    /// Blue.
    Blue,
    /// Opacity.
    Alpha,
    /// Luminance.
    Luminance,
}

/// A picture of 8 bits a channel.
#[derive(Clone, Debug)]
pub struct Picture {
    width: usize,
    height: usize,
    /// Red, green, blue and opacity, row by row from the top.
    texels: Vec<[u8; 4]>,
}

impl Picture {
    /// Reads a PNG or TGA file. Error, in words that fit after the file's name: it is neither, or
    /// it is damaged or too large.
    pub fn read(bytes: &[u8]) -> Result<Self, String> {
        if bytes.starts_with(b"\x89PNG") {
            return png(bytes);
        }
        if let Some((_, kind)) = KNOWN.iter().find(|(start, _)| bytes.starts_with(start)) {
            return Err(format!("is a {kind} file, and masks are read from PNG and TGA alone"));
        }
        tga(bytes)
    }

    /// Returns whether the picture has texels that are not wholly opaque.
    pub fn has_alpha(&self) -> bool {
        self.texels.iter().any(|[.., alpha]| *alpha < 255)
    }

    /// Returns whether no texel has a colour.
    pub fn is_grey(&self) -> bool {
        self.texels.iter().all(|[r, g, b, _]| r == g && g == b)
    }

    /// Returns which texels are there: those whose `channel`, as `base + gain x value` with values
    /// from 0 to 1, is at least 0.5.
    pub fn bitmap(&self, channel: Channel, [base, gain]: [f64; 2]) -> Bitmap {
        let value = |[r, g, b, a]: &[u8; 4]| match channel {
            Channel::Red => f64::from(*r),
            Channel::Green => f64::from(*g),
            Channel::Blue => f64::from(*b),
            Channel::Alpha => f64::from(*a),
            // the sum in whole numbers, so that white is exactly 1
            Channel::Luminance => {
                f64::from(2126 * u32::from(*r) + 7152 * u32::from(*g) + 722 * u32::from(*b))
                    / 10_000.0
            }
        };
        let there = |texel| base + gain * value(texel) / 255.0 >= 0.5;
        let texels = self.texels.iter().map(there).collect();
        Bitmap { width: self.width, height: self.height, texels }
    }
}

/// How pictures of other formats begin.
const KNOWN: [(&[u8], &str); 6] = [
    (b"\xff\xd8\xff", "JPEG"),
    (b"GIF8", "GIF"),
    (b"BM", "BMP"),
    (b"RIFF", "WebP"),
    (b"DDS ", "DDS"),
    (b"II*\0", "TIFF"),
];

/// Error: a picture of this size has no texels, or too many.
fn checked(width: u32, height: u32) -> Result<usize, String> {
    match u64::from(width) * u64::from(height) {
        0 => Err("has no texels".into()),
        n if n > MAX_TEXELS => Err(format!(
            "has {width} x {height} texels, more than {MAX_TEXELS}; shrink the picture"
        )),
        n => Ok(n as usize),
    }
}

fn png(bytes: &[u8]) -> Result<Picture, String> {
    let damaged = |e: png::DecodingError| format!("is a damaged PNG file ({e})");
    let limits = png::Limits { bytes: 8 * MAX_TEXELS as usize };
    let mut decoder = png::Decoder::new_with_limits(Cursor::new(bytes), limits);
    decoder.set_transformations(png::Transformations::normalize_to_color8());
    decoder.set_ignore_text_chunk(true);
    decoder.set_ignore_iccp_chunk(true);
    let mut reader = decoder.read_info().map_err(damaged)?;
    let (width, height) = (reader.info().width, reader.info().height);
    checked(width, height)?;
    let length = reader.output_buffer_size().ok_or("is too large")?;
    let mut buffer = vec![0; length];
    let frame = reader.next_frame(&mut buffer).map_err(damaged)?;
    let samples = &buffer[..frame.buffer_size()];
    let texels = match frame.color_type {
        png::ColorType::Grayscale => samples.iter().map(|&g| [g, g, g, 255]).collect(),
        png::ColorType::GrayscaleAlpha => {
            samples.as_chunks().0.iter().map(|&[g, a]| [g, g, g, a]).collect()
        }
        png::ColorType::Rgb => {
            samples.as_chunks().0.iter().map(|&[r, g, b]| [r, g, b, 255]).collect()
        }
        png::ColorType::Rgba => samples.as_chunks().0.to_vec(),
        png::ColorType::Indexed => return Err("is a PNG file without its palette".into()),
    };
    Ok(Picture { width: width as usize, height: height as usize, texels })
}

fn tga(bytes: &[u8]) -> Result<Picture, String> {
    let neither = || "is neither a PNG nor a TGA file that can be read".to_string();
    let raw = RawTga::from_slice(bytes).map_err(|_| neither())?;
    let header = raw.header();
    let (width, height) = (header.width, header.height);
    let count = checked(width.into(), height.into())?;
    let short = || format!("is a TGA file with fewer than its {width} x {height} texels");
    let depth = usize::from(raw.image_data_bpp().bytes());
    if header.data_type == DataType::NoData
        || (header.compression == Compression::Uncompressed
            && raw.image_data().len() < count * depth)
    {
        return Err(short());
    }
    if header.color_map_start != 0 {
        return Err("is a TGA file whose palette does not begin at 0".into());
    }
    let grey = header.data_type == DataType::BlackAndWhite;
    let texel = |value: u32| {
        let [b, g, r, a] = value.to_le_bytes();
        let five = |shift: u32| ((value >> shift & 31) * 255 / 31) as u8;
        match raw.color_bpp() {
            Bpp::Bits8 => [b, b, b, 255],
            Bpp::Bits16 if grey => [b, b, b, g],
            Bpp::Bits16 if header.alpha_channel_depth == 0 => [five(10), five(5), five(0), 255],
            Bpp::Bits16 => [five(10), five(5), five(0), (value >> 15 & 1) as u8 * 255],
            Bpp::Bits24 => [r, g, b, 255],
            _ => [r, g, b, a],
        }
    };
    let mut texels = vec![[0; 4]; count];
    let mut seen = 0;
    for pixel in raw.pixels().take(count) {
        let value = match raw.color_map() {
            Some(map) => map.get_raw(pixel.color as usize).ok_or_else(neither)?,
            None => pixel.color,
        };
        let at = pixel.position.y as usize * usize::from(width) + pixel.position.x as usize;
        *texels.get_mut(at).ok_or_else(short)? = texel(value);
        seen += 1;
    }
    if seen < count {
        return Err(short());
    }
    // a bit of the descriptor says that rows are stored from right to left
    if bytes.get(17).is_some_and(|descriptor| descriptor & 0x10 != 0) {
        texels.chunks_mut(width.into()).for_each(<[_]>::reverse);
    }
    // programs that do not use the fourth byte leave it 0
    if header.alpha_channel_depth == 0 && texels.iter().all(|[.., alpha]| *alpha == 0) {
        texels.iter_mut().for_each(|texel| texel[3] = 255);
    }
    Ok(Picture { width: width.into(), height: height.into(), texels })
}
