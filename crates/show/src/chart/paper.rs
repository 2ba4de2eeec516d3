//! The paper of plots: widths in print, letters, and drawings as SVG.

use plotters::{
    coord::Shift,
    element::{PathElement, Text},
    prelude::{DrawingArea, IntoDrawingArea, RGBColor, SVGBackend, ShapeStyle, TextStyle},
    style::{
        BLACK, Color, FontDesc, FontFamily, FontStyle, WHITE,
        text_anchor::{HPos, Pos, VPos},
    },
};

use crate::xml::allowed;

/// The width of a plot on paper.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Width {
    /// That of a column of a journal, 3.5 inches.
    Column,
    /// That of a page, 7 inches.
    #[default]
    Page,
}

impl Width {
    /// Returns the width in layout units.
    pub(crate) fn units(self) -> i32 {
        match self {
            Self::Column => px(336),
            Self::Page => px(672),
        }
    }

    /// Returns the height of a chart in layout units.
    pub(super) fn height(self) -> i32 {
        match self {
            Self::Column => px(260),
            Self::Page => px(380),
        }
    }
}

/// The number of layout units in a pixel of 1/96 inch, in which CSS measures. Places are whole
/// numbers of units, so lines are smooth in print.
const UNITS: i32 = 4;

/// Returns a length in layout units, from pixels of 1/96 inch.
pub(crate) const fn px(pixels: i32) -> i32 {
    UNITS * pixels
}

/// Sizes of the letters of numbers and labels, and of titles: 8 and 9 points in print.
pub(crate) const SMALL: i32 = px(11);
pub(crate) const LARGE: i32 = px(12);
/// Size of the letters of powers.
const TINY: i32 = px(8);
/// The letters: those that journals ask for.
const LETTERS: &str = "Arial, Helvetica, sans-serif";

/// The reason why a backend could not draw.
pub(crate) type Failure = Box<dyn std::error::Error>;
/// A part of a picture.
pub(crate) type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;
/// A place in a part of a picture, layout units from its upper left corner.
pub(crate) type Place = (i32, i32);

/// Returns what `draw` draws on white paper of this width and height in layout units, as SVG text
/// that says how large it is in print.
pub(crate) fn drawn(
    (width, height): (i32, i32),
    draw: impl FnOnce(&Area) -> Result<(), Failure>,
) -> Result<String, Failure> {
    let mut text = String::new();
    let area =
        SVGBackend::with_string(&mut text, (width as u32, height as u32)).into_drawing_area();
    area.fill(&WHITE)?;
    draw(&area)?;
    area.present()?;
    drop(area);
    let [across, down] = [width, height].map(|side| f64::from(side) / f64::from(px(96)));
    let units = format!("width=\"{width}\" height=\"{height}\"");
    let inches = format!("width=\"{across:.3}in\" height=\"{down:.3}in\"");
    Ok(allowed(&text.replacen(&units, &inches, 1)).into_owned())
}

/// Returns letters whose capitals and accents fit into `size` layout units.
pub(crate) fn font(size: i32) -> TextStyle<'static> {
    // the backend writes font sizes as if they contained the space between lines
    let size = f64::from(size) * 1.24;
    FontDesc::new(FontFamily::Name(LETTERS), size, FontStyle::Normal).into()
}

/// Returns small letters that stand so beside their place.
pub(crate) fn small(across: HPos, down: VPos) -> TextStyle<'static> {
    font(SMALL).pos(Pos::new(across, down))
}

/// Widths of the characters from the space to `~` in Arial and Helvetica, hundredths of the size.
const WIDTHS: [u8; 95] = [
    28, 28, 36, 56, 56, 89, 67, 19, 33, 33, 39, 58, 28, 33, 28, 28, // to /
    56, 56, 56, 56, 56, 56, 56, 56, 56, 56, 28, 28, 58, 58, 58, 56, // to ?
    102, 67, 67, 72, 72, 67, 61, 78, 72, 28, 50, 67, 56, 83, 72, 78, // to O
    67, 78, 72, 67, 61, 72, 67, 94, 67, 67, 61, 28, 28, 28, 47, 56, // to _
    33, 56, 56, 50, 56, 56, 28, 56, 56, 22, 22, 50, 22, 83, 56, 56, // to o
    56, 56, 33, 50, 28, 56, 50, 72, 50, 50, 50, 33, 26, 33, 58, // to ~
];

/// Returns about how long a text of letters of this size is.
pub(crate) fn length_of(text: &str, size: i32) -> i32 {
    let width = |c: char| {
        let place = (c as usize).wrapping_sub(' ' as usize);
        WIDTHS.get(place).map_or(58, |width| i32::from(*width))
    };
    text.chars().map(width).sum::<i32>() * size / 100
}

/// Returns about how long a text of small letters is.
pub(crate) fn length(text: &str) -> i32 {
    length_of(text, SMALL)
}

/// Puts parts of a text, with these letters between them, into lines of letters of this size that are
/// no longer than the width, unless a part alone is.
pub(crate) fn wrapped(
    parts: &[impl AsRef<str>],
    between: &str,
    size: i32,
    width: i32,
) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for part in parts.iter().map(AsRef::as_ref) {
        let longer = lines.last().map(|line| format!("{line}{between}{part}"));
        match (lines.last_mut(), longer) {
            (Some(line), Some(longer)) if length_of(&longer, size) <= width => *line = longer,
            _ => lines.push(part.into()),
        }
    }
    lines
}

/// Returns the line of axes and their ticks.
pub(super) fn hairline() -> ShapeStyle {
    BLACK.stroke_width(px(1) as u32)
}

/// Draws a straight line.
pub(super) fn line(area: &Area, ends: [Place; 2], style: ShapeStyle) -> Result<(), Failure> {
    Ok(area.draw(&PathElement::new(ends.to_vec(), style))?)
}

/// Returns the colour of a part of some ink on white paper.
pub(super) fn on_paper(RGBColor(r, g, b): RGBColor, part: f64) -> RGBColor {
    let mixed = |ink: u8| (part * f64::from(ink) + (1.0 - part) * 255.0).round() as u8;
    RGBColor(mixed(r), mixed(g), mixed(b))
}

/// A number as it stands at an axis: a text, and if the text ends with a power of ten its exponent.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Number {
    pub text: String,
    pub exponent: Option<i32>,
}

impl Number {
    fn raised(&self) -> String {
        self.exponent.map_or(String::new(), |exponent| exponent.to_string().replace('-', "−"))
    }

    /// Returns about how long the number is; digits are wider than letters are on average.
    pub fn length(&self) -> i32 {
        length(&self.text) + length_of(&self.raised(), TINY)
    }

    /// Draws the number with its middle at a place.
    pub fn draw_around(&self, area: &Area, (x, y): Place) -> Result<(), Failure> {
        match self.exponent {
            Some(_) => self.draw_before(area, (x + self.length() / 2, y)),
            None => Ok(area.draw(&Text::new(
                self.text.clone(),
                (x, y),
                small(HPos::Center, VPos::Center),
            ))?),
        }
    }

    /// Draws the number so that it ends at a place, its middle at the same height.
    pub fn draw_before(&self, area: &Area, (x, y): Place) -> Result<(), Failure> {
        let raised = self.raised();
        let end = x - (self.length() - Self { exponent: None, ..self.clone() }.length());
        area.draw(&Text::new(self.text.clone(), (end, y), small(HPos::Right, VPos::Center)))?;
        if !raised.is_empty() {
            let above = font(TINY).pos(Pos::new(HPos::Left, VPos::Center));
            area.draw(&Text::new(raised, (end, y - px(4)), above))?;
        }
        Ok(())
    }
}

/// Writes the numbers of an axis in one notation: with the same number of decimals or, on a
/// logarithmic axis, those that each needs; as products with powers of ten if one would have more
/// than five digits.
pub(super) fn numbers(values: &[f64], log: bool) -> Vec<Number> {
    let plain = |value: f64, decimals: usize| match value == 0.0 {
        true => "0".to_string(),
        false => format!("{value:.decimals$}"),
    };
    let needed = |value: f64| {
        (0..9).find(|d| {
            (plain(value, *d).parse::<f64>().unwrap_or(0.0) - value).abs() <= 1e-9 * value.abs()
        })
    };
    let most = |values: &[f64]| values.iter().filter_map(|v| needed(*v)).max().unwrap_or(0);
    let digits = |text: &str| text.chars().filter(char::is_ascii_digit).count();
    let decimals = most(values);
    let texts: Vec<String> = values
        .iter()
        .map(|v| plain(*v, if log { needed(*v).unwrap_or(9) } else { decimals }))
        .collect();
    if texts.iter().all(|text| digits(text) <= 5) {
        return texts.into_iter().map(|text| Number { text, exponent: None }).collect();
    }
    let power = |value: f64| (value.abs().log10() + 1e-9).floor() as i32;
    let largest = values.iter().fold(f64::MIN_POSITIVE, |most, v| v.abs().max(most));
    let parts: Vec<(f64, i32)> = values
        .iter()
        .map(|v| {
            let exponent = power(if log { *v } else { largest });
            ((1e6 * v / 10f64.powi(exponent)).round() / 1e6, exponent)
        })
        .collect();
    let decimals = most(&parts.iter().map(|(factor, _)| *factor).collect::<Vec<_>>());
    let number = |(factor, exponent): (f64, i32)| match factor {
        0.0 => Number { text: "0".into(), exponent: None },
        1.0 if log => Number { text: "10".into(), exponent: Some(exponent) },
        _ => {
            let factor = if log { format!("{factor}") } else { plain(factor, decimals) };
            Number { text: format!("{factor}×10"), exponent: Some(exponent) }
        }
    };
    parts.into_iter().map(number).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One axis has one notation.
    #[test]
    fn numbers_of_an_axis_have_one_notation() {
        let written = |values: &[f64], log: bool| -> Vec<String> {
            let all = numbers(values, log).into_iter();
            all.map(|n| n.exponent.map_or(n.text.clone(), |e| format!("{}^{e}", n.text))).collect()
        };
        assert_eq!(written(&[0.0, 0.5, 1.0, 1.5], false), ["0", "0.5", "1.0", "1.5"]);
        assert_eq!(written(&[-50.0, 0.0, 50.0], false), ["-50", "0", "50"]);
        assert_eq!(written(&[0.01, 0.1, 1.0, 10.0], true), ["0.01", "0.1", "1", "10"]);
        assert_eq!(written(&[1e-4, 1e-3, 1e-2, 0.1], true), ["0.0001", "0.001", "0.01", "0.1"]);
        assert_eq!(written(&[1e-5, 1e-3, 0.1, 1.0], true), ["10^-5", "10^-3", "10^-1", "10^0"]);
        assert_eq!(written(&[1e4, 1e5, 1e6], true), ["10^4", "10^5", "10^6"]);
        assert_eq!(written(&[2e-6, 5e-6, 1e-5], true), ["2×10^-6", "5×10^-6", "10^-5"]);
        assert_eq!(written(&[0.0, 5e5, 1e6], false), ["0", "0.5×10^6", "1.0×10^6"]);
        assert_eq!(written(&[0.0, 1e-7, 2e-7], false), ["0", "1×10^-7", "2×10^-7"]);
    }
}
