//! A key of colours beside a picture.

use std::fmt::Write;

use glam::Vec3;

use super::{Ground, Picture};
use crate::xml::allowed;
use phylux_core::error::Result;

/// What colours mean.
#[derive(Clone, Debug)]
pub struct Key {
    /// The line above them.
    pub title: String,
    /// A name and a colour (sRGB) for each.
    pub entries: Vec<(String, Vec3)>,
    /// What the key stands on.
    pub ground: Ground,
}

/// Letters of a name that are shown.
const LONGEST: usize = 18;
/// Width of a letter, at most, as a fraction of its height.
const WIDTH: f64 = 0.56;
/// Pixels to the inch at which a pixel of the drawing is one of the picture.
const SAME: f32 = 96.0;

impl Picture {
    /// Returns the picture with a key to its right. Error: it would be too large.
    pub fn with_key(&self, key: &Key) -> Result<Self> {
        let em = (self.width as f64 / 60.0).clamp(12.0, 32.0).round();
        let line = 1.7 * em;
        let height = (self.height as f64).max(line * (key.entries.len() as f64 + 2.0)).ceil();
        let short = |text: &str| text.chars().take(LONGEST).collect::<String>();
        let names = key.entries.iter().map(|(name, _)| name.chars().count().min(LONGEST) + 3);
        let longest = names.chain([key.title.chars().count().min(LONGEST)]).max().unwrap_or(0);
        let width = ((longest as f64 * WIDTH + 2.0) * em).round();
        let mut svg = key.ground.sheet(width, height, em);
        let mut text = |x: f64, y: f64, text: &str| {
            let text = allowed(&short(text)).into_owned();
            let text = quick_xml::escape::escape(&*text);
            let _ = write!(svg, "<text x=\"{x}\" y=\"{y}\">{text}</text>");
        };
        text(em, line, &key.title);
        for (i, (name, _)) in key.entries.iter().enumerate() {
            text(2.6 * em, line * (i as f64 + 2.1), name);
        }
        for (i, (_, colour)) in key.entries.iter().enumerate() {
            let [r, g, b] = colour.to_array().map(|c| (255.0 * c).round() as u8);
            let (x, y) = (1.5 * em, line * (i as f64 + 2.1) - 0.34 * em);
            let disc = 0.38 * em;
            let _ = write!(
                svg,
                "<circle cx=\"{x}\" cy=\"{y}\" r=\"{disc}\" fill=\"rgb({r},{g},{b})\"/>"
            );
        }
        svg.push_str("</svg>");
        Ok(self.beside(&Self::of_svg(&svg, SAME)?, key.ground.paper()))
    }
}
