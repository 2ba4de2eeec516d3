//! Pictures of which only yes or no is left.

/// The largest number of texels of a picture, that of 8192 x 8192.
pub const MAX_TEXELS: u64 = 1 << 26;

/// A yes or no for each texel of a picture.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Bitmap {
    /// Texels in a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Whether the surface is there, row by row from the top of the picture.
    pub texels: Vec<bool>,
}

impl Bitmap {
    /// Returns whether the texel in column `x`, and in row `y` from the bottom, is there. Outside
    /// the picture nothing is.
    pub fn at(&self, x: i64, y: i64) -> bool {
        let (w, h) = (self.width as i64, self.height as i64);
        let within = (0..w).contains(&x) && (0..h).contains(&y);
        within && self.texels[((h - 1 - y) * w + x) as usize]
    }

    /// Returns the share of the texels that are there.
    pub fn share(&self) -> f64 {
        self.texels.iter().filter(|there| **there).count() as f64 / self.texels.len() as f64
    }
}
