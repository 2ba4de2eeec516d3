//! Where the maps of a plot stand: in rows and columns, as high as each row needs.

use crate::chart::{
    axes::BELOW,
    paper::{Width, px},
};

/// The greatest and least height of the colours of a map, layout units.
const HIGHEST: i32 = px(420);
const LEAST: i32 = px(26);
/// Margins to the left and right of the colours of a map; a smaller one on the left and below where no
/// numbers stand; and that above for a title of one line, and for one more.
const LEFT: i32 = px(52);
const RIGHT: i32 = px(12);
const INNER: [i32; 2] = [px(12), px(8)];
const ABOVE: i32 = px(30);
pub(super) const LINE: i32 = px(15);
/// Width of the colour bar with its numbers, and its least and greatest height.
pub(super) const BAR: i32 = px(92);
const BARS: [i32; 2] = [px(100), px(560)];
/// A map whose height is less than this part of its width needs the whole width of a page, and so
/// many of these stand one below the other.
const LONG: f64 = 0.3;
const LONG_IN_A_COLUMN: usize = 4;

/// The places of maps and of their colour bar, layout units.
#[derive(Clone, Debug)]
pub(super) struct Panels {
    pub panels: Vec<Panel>,
    /// Width and height of all.
    pub size: (i32, i32),
    /// Where the bar begins on the left, and its upper and lower end.
    pub bar: (i32, [i32; 2]),
}

/// The place of a map.
#[derive(Clone, Copy, Debug)]
pub(super) struct Panel {
    /// Sides of the place for its colours.
    pub left: i32,
    pub top: i32,
    pub right: i32,
    pub bottom: i32,
    /// Where the title begins at the top, and the room for it from the left of the colours.
    pub title: i32,
    pub room: i32,
    /// Whether the lying and the upright axis have their numbers here, and not on the map below or to
    /// the left.
    pub numbers: [bool; 2],
}

/// Returns how many maps of such heights over widths are side by side; those of long beds stand one
/// below the other.
fn columns(ratios: &[f64], width: Width) -> usize {
    let count = ratios.len();
    let most = match width {
        Width::Column => 1,
        Width::Page if ratios.iter().all(|ratio| *ratio < LONG) => match count {
            0..=LONG_IN_A_COLUMN => 1,
            _ => 2,
        },
        Width::Page if count == 4 => 2,
        Width::Page => 3,
    };
    count.clamp(1, most)
}

/// Returns the width that each map has, with its margins, and the number of maps side by side.
pub(super) fn across(ratios: &[f64], width: Width) -> (i32, usize) {
    let columns = columns(ratios, width);
    ((width.units() - BAR) / columns as i32, columns)
}

impl Panels {
    /// Places maps of these heights over widths, with titles of so many lines, the longest of which is so
    /// long. Where all show the `same` part of a plane, numbers stand only on the left
    /// and below.
    pub fn new(ratios: &[f64], width: Width, lines: i32, titles: i32, same: bool) -> Self {
        let (across, columns) = across(ratios, width);
        let above = ABOVE + LINE * (lines - 1);
        let left = |column: usize| if same && column > 0 { INNER[0] } else { LEFT };
        // where inner maps have no numbers, all are as wide as the room allows
        let margins: i32 = (0..columns).map(|column| left(column) + RIGHT).sum();
        let wide = (across * columns as i32 - margins) / columns as i32;
        let high =
            |ratio: &f64| (f64::from(wide) * ratio).clamp(f64::from(LEAST), HIGHEST.into()) as i32;
        let count = ratios.len();
        let mut panels: Vec<Panel> = Vec::new();
        let mut top = 0;
        for (row, ratios) in ratios.chunks(columns).enumerate() {
            let tallest = ratios.iter().map(high).max().unwrap_or(LEAST);
            let mut at = 0;
            let mut below = INNER[1];
            for (column, ratio) in ratios.iter().enumerate() {
                let is_lowest = (row + 1) * columns + column >= count;
                let numbers = [!same || is_lowest, !same || column == 0];
                below = if numbers[0] { BELOW } else { below };
                at += left(column);
                let (top, bottom) = (top + above, top + above + high(ratio));
                // the colours of a map that is as high as may be are narrower than its place
                let own = (f64::from(bottom - top) / ratio.max(f64::MIN_POSITIVE)) as i32;
                let right = at + wide.min(own);
                let (title, room) = (top - above, wide + RIGHT);
                panels.push(Panel { left: at, top, right, bottom, title, room, numbers });
                at += wide + RIGHT;
            }
            top += above + tallest + below;
        }
        let height = top.max(BARS[0] + above + BELOW);
        // the bar stands beside a map that is narrower than its place
        let right = match (columns, panels.first()) {
            (1, Some(panel)) => (panel.right + RIGHT).max(titles + px(16)).min(across),
            _ => across * columns as i32,
        };
        let lowest = panels.iter().map(|panel| panel.bottom).max().unwrap_or(above);
        let end = lowest.clamp(above + BARS[0], above + BARS[1]);
        Self { panels, size: (width.units(), height), bar: (right, [above, end]) }
    }
}
