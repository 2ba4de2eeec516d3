//! The colour bar beside a picture.

use std::fmt::Write;

use super::{
    Ground, Picture, Scale,
    scale::{colour_at, label},
};
use crate::xml::allowed;
use phylux_core::{error::Result, math::units::printed};

/// The text and the scale of a colour bar.
#[derive(Clone, Debug)]
pub struct Legend {
    /// Lines above the bar: the quantity, the band, the unit.
    pub title: Vec<String>,
    /// The numbers along the bar.
    pub scale: Scale,
    /// Whether only whole numbers stand along the bar, as for counts.
    pub whole: bool,
    /// Whether there are numbers above the bar, which then has a pointed end.
    pub beyond: bool,
    /// What the bar stands on.
    pub ground: Ground,
}

/// Least height of a picture with a bar, pixels.
const LEAST_HEIGHT: usize = 200;
/// Width of a letter, at most, as a fraction of its height.
const WIDTH: f64 = 0.6;
/// Pixels to the inch at which a pixel of the drawing is one of the picture.
const SAME: f32 = 96.0;

impl Picture {
    /// Returns the picture with a colour bar to its right. Error: it would be too large.
    pub fn with_bar(&self, legend: &Legend) -> Result<Self> {
        let height = self.height.max(LEAST_HEIGHT) as f64;
        // letters are as large on a page whatever the shape of the picture, but leave room for a bar
        let em = (self.width as f64 / 52.0).clamp(13.0, 40.0).min(height / 15.0).round();
        let line = (1.3 * em).round();
        let ticks = legend.scale.ticks(((height / (3.0 * line)) as usize).clamp(2, 10));
        let shown = ticks.into_iter().filter(|tick| !legend.whole || tick.fract() == 0.0);
        let ticks: Vec<(f64, String)> = shown.map(|tick| (tick, label(tick))).collect();
        let title: Vec<String> = legend.title.iter().map(|line| printed(line)).collect();
        let longest = |texts: &mut dyn Iterator<Item = &String>| {
            texts.map(|text| text.chars().count()).max().unwrap_or(0) as f64 * WIDTH * em
        };
        let (bar, mark, margin) = (1.2 * em, 0.4 * em, em);
        let numbers = longest(&mut ticks.iter().map(|(_, text)| text));
        let inner = longest(&mut title.iter()).max(bar + 2.0 * mark + numbers);
        let width = (inner + 2.0 * margin).round();

        let mut svg = legend.ground.sheet(width, height, em);
        let text_colour = legend.ground.text();
        let mut text = |x: f64, y: f64, text: &str| {
            let text = allowed(text);
            let text = quick_xml::escape::escape(&*text);
            let _ = write!(svg, "<text x=\"{x}\" y=\"{y}\">{text}</text>");
        };
        for (i, title) in title.iter().enumerate() {
            text(margin, line * (i as f64 + 1.2), title);
        }
        let tip = if legend.beyond { 0.8 * em } else { 0.0 };
        let top = line * (title.len() as f64 + 1.2) + tip;
        let length = (height - line - top).max(2.0);
        for (value, number) in &ticks {
            let y = top + (1.0 - legend.scale.place(*value)) * length;
            text(margin + bar + 2.0 * mark, y + 0.36 * em, number);
        }
        for (value, _) in &ticks {
            let (x, y) = (margin + bar, top + (1.0 - legend.scale.place(*value)) * length);
            let _ = write!(svg, "<path d=\"M{x} {y}h{mark}\" stroke=\"{text_colour}\"/>");
        }
        if legend.beyond {
            let [r, g, b] = colour_at(1.0).to_array().map(|c| (255.0 * c).round() as u8);
            let (side, back) = (0.5 * bar, -tip);
            let _ = write!(
                svg,
                "<path d=\"M{margin} {}l{side} {back}l{side} {tip}z\" fill=\"rgb({r},{g},{b})\"/>",
                top.floor()
            );
        }
        svg.push_str("</svg>");
        let mut beside = Self::of_svg(&svg, SAME)?;
        let [left, right, top, rows] = [margin, margin + bar, top, length].map(|v| v as usize);
        for y in 0..rows {
            let colour = colour_at(1.0 - y as f64 / (rows - 1).max(1) as f64);
            (left..right).for_each(|x| beside.set(x, top + y, colour));
        }
        Ok(self.beside(&beside, legend.ground.paper()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::picture::PAPER;

    /// A band may have any name, also one that no file of XML can hold.
    #[test]
    fn any_name_stands_above_a_bar() {
        let plain = Picture::new(100, std::iter::repeat_n(PAPER, 100 * 300));
        let bar = |title: &str| {
            let scale = Scale::new(0.0, 2.0, false).expect("a scale");
            plain
                .with_bar(&Legend {
                    title: vec![title.into()],
                    scale,
                    whole: false,
                    beyond: false,
                    ground: Ground::Light,
                })
                .expect("a bar")
        };
        let (empty, named) = (bar("   "), bar("<&\u{1}"));
        assert_eq!((empty.width, empty.height), (named.width, 300));
        let dark = |picture: &Picture| picture.rgb().iter().filter(|c| **c < 128).count();
        assert!(dark(&named) > dark(&empty) + 30, "{} {}", dark(&named), dark(&empty));
    }

    /// A bar beyond which there are numbers ends in a point.
    #[test]
    fn a_bar_ends_in_a_point_where_there_is_more() {
        let plain = Picture::new(100, std::iter::repeat_n(PAPER, 100 * 300));
        let rows = |beyond: bool| {
            let scale = Scale::new(0.0, 2.0, false).expect("a scale");
            let legend =
                Legend { title: Vec::new(), scale, whole: false, beyond, ground: Ground::Light };
            let picture = plain.with_bar(&legend).expect("a bar");
            // the end of the bar is yellow
            let yellow = |row: &[u8]| row.chunks(3).filter(|c| c[0] > 220 && c[2] < 80).count();
            picture.rgb().chunks(3 * picture.width).map(yellow).find(|n| *n > 0).expect("a row")
        };
        assert!(rows(true) < 6 && rows(false) > 12, "{} {}", rows(true), rows(false));
    }

    /// Between 0 and 2 counts have three numbers along a bar, and amounts more.
    #[test]
    fn counts_have_whole_numbers_along_a_bar() {
        let plain = Picture::new(100, std::iter::repeat_n(PAPER, 100 * 600));
        let dark = |whole: bool| {
            let scale = Scale::new(0.0, 2.0, false).expect("a scale");
            let picture = plain.with_bar(&Legend {
                title: Vec::new(),
                scale,
                whole,
                beyond: false,
                ground: Ground::Light,
            });
            picture.expect("a bar").rgb().iter().filter(|c| **c < 100).count()
        };
        assert!(dark(true) < dark(false) && dark(true) > 0);
    }
}
