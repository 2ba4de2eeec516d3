//! The page that texts are written for, and how numbers look on it.

use phylux_core::{
    error::{Spelling, setting},
    math::units::rounded,
    words,
};

/// Where texts are shown.
#[derive(Clone, Copy)]
pub struct Page {
    /// How many characters a line has room for.
    pub width: usize,
    /// Whether tables have all their rows and bands, and names however long.
    pub full: bool,
    /// How names of settings are spelled.
    pub spelling: &'static dyn Spelling,
}

impl Page {
    /// The least width of a page, and the usual one.
    pub const WIDTH: usize = 80;

    /// Returns how many of the rows of a table are shown: so many, or all if these are asked for.
    pub fn shown(&self, most: usize) -> usize {
        if self.full { usize::MAX } else { most }
    }

    /// Returns the line that stands below a table if it has more rows than are shown; nothing
    /// otherwise.
    pub fn more(&self, count: usize, most: usize) -> String {
        match count.saturating_sub(self.shown(most)) {
            0 => String::new(),
            more => {
                let words = words![format!("  and {more} more ("), setting("full"), " has all)\n"];
                words.spelled(self.spelling)
            }
        }
    }
}

/// Formats a value with its standard error, both with the digits that the error leaves.
pub fn with_error(value: f64, error: f64) -> String {
    match error > 0.0 && error.is_finite() {
        true => rounded(value, error).join(" ± "),
        false => short(value),
    }
}

/// Formats a number with four significant digits, however large or small it is.
pub fn short(value: f64) -> String {
    in_digits(value, 4)
}

/// Formats a number with so many significant digits, however large or small it is.
pub fn in_digits(value: f64, digits: usize) -> String {
    let behind = digits - 1;
    match value.abs() {
        0.0 => "0".into(),
        v if (1e-3..1e6).contains(&v) => {
            let decimals = (behind as i32 - v.log10().floor() as i32).clamp(0, 6) as usize;
            format!("{value:.decimals$}")
        }
        _ => format!("{value:.behind$e}"),
    }
}
