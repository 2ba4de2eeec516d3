//! Draws values between points of a plane as colours with contours, no finer than the errors of the
//! values.

use plotters::{
    element::{Circle, PathElement, Polygon, Rectangle, Text},
    prelude::{Color, RGBColor, ShapeStyle},
    style::{
        BLACK, FontTransform, WHITE,
        text_anchor::{HPos, VPos},
    },
};

use super::{
    field::{Corner, Field, Path},
    panels::{self, LINE, Panel, Panels},
};
use crate::{
    chart::{
        axes::{Axis, Frame},
        paper::{
            Area, Failure, LARGE, Place, SMALL, Width, drawn, font, length, length_of, px, small,
            wrapped,
        },
    },
    picture::{Scale, Steps, label},
};
use phylux_core::{error, math::units::printed};

/// Space between the outermost points and the axes, as a part of the longer side.
const MARGIN: f64 = 0.03;
/// Maps that are no more than so many times as wide and as high together as each of them are all of the
/// same part of a plane.
const SAME: f64 = 1.5;
/// The most colours between the ends of the bar: finer than the eye can distinguish.
pub(super) const COLOURS: usize = 32;
/// The most contours between the least and the greatest value, and the most numbers at the bar.
const CONTOURS: usize = 6;
const NUMBERED: usize = 10;
/// The most parts of a contour, the longest, on which its number may stand, and about the most places
/// on each.
const PARTS: usize = 20;
const PLACES: usize = 60;
/// The longest rest of a line beside a number that is left out, layout units.
const REST: i32 = px(5);
/// Sensors have dots where these are apart by this length at least, on average, layout units.
const DOTTED: i32 = px(5);

/// Values at points of one plane.
#[derive(Clone, Debug)]
pub(super) struct HeatMap {
    pub title: String,
    /// Labels of the two axes.
    pub axes: [String; 2],
    /// The points with their values; those that lie alone are drawn too.
    pub points: Vec<Corner>,
    /// What lies between the points.
    pub field: Field,
    /// What is known of the values as a whole, in words.
    pub facts: Vec<String>,
    /// The median standard error of the values, where it is known.
    pub error: Option<f64>,
    /// The mean of the values, where they differ by no more than their errors explain.
    pub even: Option<f64>,
}

/// Maps with one colour bar.
#[derive(Clone, Debug)]
pub(super) struct HeatMaps {
    maps: Vec<HeatMap>,
    /// The colours.
    steps: Steps,
    /// The ends of the axes of each map.
    ends: Vec<[(f64, f64); 2]>,
    /// Whether these are the same for all of several maps.
    same: bool,
    /// The label of the bar.
    label: String,
}

impl HeatMaps {
    /// Makes maps whose colours fit the values, or lie between two numbers. No step of colours is
    /// finer than twice the median error of a map, but for those of even ones. Error: the range is
    /// not valid.
    pub fn new(
        maps: Vec<HeatMap>,
        range: Option<(f64, f64)>,
        label: String,
    ) -> error::Result<Self> {
        let errors = maps.iter().filter(|map| map.even.is_none()).filter_map(|map| map.error);
        let finest = 2.0 * errors.fold(0.0, f64::max);
        let all_even = maps.iter().all(|map| map.even.is_some());
        let values = maps.iter().flat_map(HeatMap::values).chain(all_even.then_some(0.0));
        let values: Vec<f64> = values.collect();
        let steps = match range {
            Some((low, high)) => Steps::of(Scale::new(low, high, false)?, COLOURS, finest),
            None => Steps::around(values.into_iter(), COLOURS, finest),
        };
        let own: Vec<[(f64, f64); 2]> = maps.iter().map(HeatMap::ends).collect();
        let common = common(&own).filter(|_| maps.windows(2).all(|m| m[0].axes == m[1].axes));
        let (same, ends) = (common.is_some(), common.map_or(own, |all| vec![all; maps.len()]));
        Ok(Self { maps, steps, ends, same, label })
    }

    /// Returns the maps with their colour bar as SVG text. A map is as high as its plane is wide and
    /// high.
    pub fn svg(&self, width: Width) -> Result<String, Failure> {
        let ratios = self
            .ends
            .iter()
            .map(|[(x, to_x), (y, to_y)]| (to_y - y) / (to_x - x).max(f64::MIN_POSITIVE));
        let ratios: Vec<f64> = ratios.collect();
        let (across, _) = panels::across(&ratios, width);
        let titles = self.titles(across - px(30));
        let lines = titles.iter().map(Vec::len).max().unwrap_or(1) as i32;
        let longest = titles.iter().flatten().map(|(line, size)| length_of(line, *size)).max();
        let longest = longest.unwrap_or(0);
        let panels = Panels::new(&ratios, width, lines, longest, self.same);
        drawn(panels.size, |area| {
            for (i, (panel, title)) in panels.panels.iter().zip(&titles).enumerate() {
                self.draw((&self.maps[i], self.ends[i]), panel, title, area)?;
            }
            let (left, ends) = panels.bar;
            let (_, bar) = area.split_horizontally(left);
            let values = self.maps.iter().flat_map(HeatMap::values);
            draw_bar(&bar, &self.steps, &self.label, ends, values)
        })
    }

    /// Returns the lines above each map, with the sizes of their letters: one for all that is said,
    /// if it fits into this width for every map, or the title and lines for the rest.
    fn titles(&self, width: i32) -> Vec<Vec<(String, i32)>> {
        let whole = |map: &HeatMap| match map.facts.is_empty() {
            true => map.title.clone(),
            false => format!("{}: {}", map.title, map.facts.join(", ")),
        };
        let fits = self.maps.iter().all(|map| length_of(&whole(map), LARGE) <= width);
        let lines = |map: &HeatMap| match fits {
            true => vec![(whole(map), LARGE)],
            false => {
                let facts = wrapped(&map.facts, ", ", SMALL, width);
                let facts = facts.into_iter().map(|line| (line, SMALL));
                std::iter::once((map.title.clone(), LARGE)).chain(facts).collect()
            }
        };
        self.maps.iter().map(lines).collect()
    }

    fn draw(
        &self,
        (map, ends): (&HeatMap, [(f64, f64); 2]),
        panel: &Panel,
        title: &[(String, i32)],
        area: &Area,
    ) -> Result<(), Failure> {
        let longest = title.iter().map(|(line, size)| length_of(line, *size)).max();
        // a long title begins left of the axis
        let end = panel.left + panel.room - px(6) - longest.unwrap_or(0);
        let from = panel.left.min(end).max(px(8));
        for (line, (words, size)) in (0..).zip(title) {
            let at = (from, panel.title + px(10) + LINE * line);
            area.draw(&Text::new(words.as_str(), at, font(*size)))?;
        }
        let frame = map.frame(ends, panel);
        let place = |&(x, y): &(f64, f64)| frame.place((x, y));
        for (colour, outline) in self.regions(map) {
            let outline: Vec<Place> = outline.iter().map(place).collect();
            area.draw(&Polygon::new(outline, colour.filled()))?;
        }
        frame.draw(area, false)?;

        let levels = self.levels(map);
        let lines: Vec<Vec<Vec<Place>>> = levels
            .iter()
            .map(|level| {
                let paths = map.field.contours(*level);
                let mut paths: Vec<Vec<Place>> =
                    paths.iter().map(|path| path.iter().map(place).collect()).collect();
                paths.sort_by_key(|path| std::cmp::Reverse(path.len()));
                paths
            })
            .collect();
        let dots: Vec<Place> = map.points.iter().map(|point| place(&(point.0, point.1))).collect();
        let outlines = map.field.outlines(&[f64::NEG_INFINITY]).into_iter().flatten();
        let colours: Vec<Vec<Place>> =
            outlines.map(|(_, path)| path.iter().map(place).collect()).collect();
        let numbers = self.numbers(&levels, &lines, &colours, &dots);
        for (&level, paths) in levels.iter().zip(&lines) {
            let style = ShapeStyle::from(&self.ink(level).mix(0.7)).stroke_width(px(1) as u32);
            for path in paths.iter().flat_map(|path| broken(path, &numbers)) {
                area.draw(&PathElement::new(path, style))?;
            }
        }
        for Number { at, text, ink, .. } in numbers {
            let style = small(HPos::Center, VPos::Center).color(&ink);
            area.draw(&Text::new(text, at, style))?;
        }
        let sides = [frame.right - frame.left, frame.bottom - frame.top].map(f64::from);
        let each = sides[0] * sides[1] / dots.len().max(1) as f64;
        if each < f64::from(DOTTED * DOTTED) {
            return Ok(());
        }
        let dot = |at: Place| Circle::new(at, px(3) / 2, BLACK.mix(0.7).filled());
        Ok(dots.into_iter().map(dot).try_for_each(|dot| area.draw(&dot))?)
    }

    /// Returns outlines with their colours, in the order in which they are painted: what is within an
    /// outline lies on it.
    fn regions(&self, map: &HeatMap) -> Vec<(RGBColor, Path)> {
        let Steps { scale, ends, .. } = &self.steps;
        let (levels, middles) = (&ends[..ends.len() - 1], self.steps.middles());
        let paint = |band: usize| colour(scale, middles[band]);
        let outlines = match map.even {
            Some(_) => map.field.outlines(&levels[..1]),
            None => map.field.outlines(levels),
        };
        let mut all: Vec<(f64, usize, Path)> = Vec::new();
        for (band, outlines) in outlines.into_iter().enumerate() {
            all.extend(outlines.into_iter().map(|(area, path)| (area, band, path)));
        }
        // of a hole with several edges the lowest lies in the others, of a hill the highest
        let rank = |(area, band, _): &(f64, usize, Path)| {
            let band = *band as i64;
            if *area < 0.0 { -band } else { band }
        };
        all.sort_by(|a, b| b.0.abs().total_cmp(&a.0.abs()).then_with(|| rank(a).cmp(&rank(b))));
        let painted = all.into_iter().map(|(area, band, path)| {
            let colour = match (map.even, area < 0.0, band) {
                (_, true, 0) => WHITE,
                // a colour of the bar
                (Some(mean), ..) => paint(self.steps.at(mean)),
                (None, true, band) => paint(band - 1),
                (None, false, band) => paint(band),
            };
            (colour, path)
        });
        painted.collect()
    }

    /// Returns the values at which a map has contours: ends of colours, the same for all maps.
    fn levels(&self, map: &HeatMap) -> Vec<f64> {
        if map.even.is_some() {
            return Vec::new();
        }
        let levels = levels(&self.steps, self.maps.iter().flat_map(HeatMap::values));
        let (low, high) = within(&self.steps, map.values());
        levels.into_iter().filter(|level| *level > low && *level < high).collect()
    }

    /// Returns the numbers of contours, each on the colours with all its letters: where no other line
    /// runs, rather beside points, and rather in the middle of its line. A line that has no such place
    /// has no number.
    fn numbers(
        &self,
        levels: &[f64],
        lines: &[Vec<Vec<Place>>],
        colours: &[Vec<Place>],
        dots: &[Place],
    ) -> Vec<Number> {
        let mut numbers: Vec<Number> = Vec::new();
        for (i, &level) in levels.iter().enumerate() {
            let text = label(level);
            let half = (length(&text) / 2 + px(2), px(6));
            let near = |a: &Place, b: &Place, aside: Place| {
                (a.0 - b.0).abs() < aside.0 && (a.1 - b.1).abs() < aside.1
            };
            let fits = |at: &Place| {
                let apart = |other: &Number| {
                    let aside = (half.0 + other.half.0 + px(4), half.1 + other.half.1 + px(2));
                    !near(at, &other.at, aside)
                };
                numbers.iter().all(apart) && is_within(*at, (half.0 + px(1), half.1), colours)
            };
            let alone = |at: &Place| {
                let others = lines.iter().enumerate().filter(|(other, _)| *other != i);
                let mut parts = others.flat_map(|(_, paths)| paths).flat_map(|p| p.windows(2));
                !parts.any(|ends| meets([ends[0], ends[1]], *at, half))
            };
            let on_dot = |at: &Place| dots.iter().any(|dot| near(at, dot, half));
            // from the middle of a line to its ends
            let order = |path: &Vec<Place>| {
                let (middle, every) = (path.len() / 2, path.len().div_ceil(PLACES));
                let mut places: Vec<(usize, Place)> = path
                    .iter()
                    .enumerate()
                    .map(|(i, at)| (i.abs_diff(middle), *at))
                    .filter(|(far, _)| far % every == 0)
                    .collect();
                places.sort_by_key(|(far, _)| *far);
                places.into_iter().map(|(_, at)| at).collect::<Vec<_>>()
            };
            let places = lines[i].iter().take(PARTS).flat_map(order);
            let places = places.filter(|at| fits(at) && alone(at));
            if let Some(at) = places.min_by_key(on_dot) {
                numbers.push(Number { at, half, text, ink: self.ink(level) });
            }
        }
        numbers
    }

    /// Returns the colour of lines and numbers on the colour of a value.
    fn ink(&self, value: f64) -> RGBColor {
        if self.steps.scale.place(value) < 0.5 { WHITE } else { BLACK }
    }
}

/// The number of a contour.
struct Number {
    /// Its middle, and half its width and height.
    at: Place,
    half: Place,
    text: String,
    ink: RGBColor,
}

/// Returns the parts of a line that no number stands on.
fn broken(path: &[Place], numbers: &[Number]) -> Vec<Vec<Place>> {
    let mut parts: Vec<Vec<Place>> = Vec::new();
    for ends in path.windows(2) {
        let mut pieces = vec![[ends[0], ends[1]]];
        for Number { at, half, .. } in numbers {
            pieces = pieces.into_iter().flat_map(|piece| outside(piece, *at, *half)).collect();
        }
        for [from, to] in pieces {
            match parts.last_mut().filter(|part| part.last() == Some(&from)) {
                Some(part) => part.push(to),
                None => parts.push(vec![from, to]),
            }
        }
    }
    // a rest between a number and the end of a line is no line
    let is_seen = |part: &Vec<Place>| {
        part.windows(2).map(|p| (p[0].0 - p[1].0).abs() + (p[0].1 - p[1].1).abs()).sum::<i32>()
            > REST
    };
    if parts.len() != 1 || parts[0].len() != path.len() {
        parts.retain(is_seen);
    }
    parts
}

/// Returns the ends of axes that hold all of several pairs, if these are hardly larger than each.
fn common(all: &[[(f64, f64); 2]]) -> Option<[(f64, f64); 2]> {
    let of = |axis: usize| {
        let ends = || all.iter().map(|ends| ends[axis]);
        let union = ends().reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)))?;
        let shortest = ends().map(|(from, to)| to - from).fold(f64::INFINITY, f64::min);
        (union.1 - union.0 <= SAME * shortest).then_some(union)
    };
    let [x, y] = [of(0)?, of(1)?];
    (all.len() > 1).then_some([x, y])
}

/// Returns the least and the greatest of values, as far as the scale of steps reaches.
fn within(steps: &Steps, values: impl Iterator<Item = f64>) -> (f64, f64) {
    let none = (f64::INFINITY, f64::NEG_INFINITY);
    let (low, high) = values.fold(none, |(low, high), v| (low.min(v), high.max(v)));
    (low.max(steps.scale.low), high.min(steps.scale.high))
}

/// Returns the ends of steps at which values have contours.
fn levels(steps: &Steps, values: impl Iterator<Item = f64>) -> Vec<f64> {
    let (low, high) = within(steps, values);
    steps.ends_apart((high - low) / CONTOURS as f64)
}

/// Draws the bar of steps of colours between these heights of an area, with its label to the right.
/// An end beyond which there are values is pointed.
pub(super) fn draw_bar(
    area: &Area,
    steps: &Steps,
    name: &str,
    [top, bottom]: [i32; 2],
    values: impl Iterator<Item = f64> + Clone,
) -> Result<(), Failure> {
    let (left, right) = (px(4), px(18));
    let Steps { scale, ends, .. } = steps;
    let down = |value: f64| bottom - (scale.place(value) * f64::from(bottom - top)).round() as i32;
    let middles = steps.middles();
    let paint = |band: usize| colour(scale, middles[band]);
    for (band, ends) in ends.windows(2).enumerate() {
        // colours reach below those that are drawn after them, so that no seam is seen
        let row = [(left, top), (right, down(ends[0]))];
        area.draw(&Rectangle::new(row, paint(band).filled()))?;
    }
    let beyond = 1e-6 * (scale.high - scale.low);
    let (below, above) = values.clone().fold((false, false), |(below, above), v| {
        (below || v < scale.low - beyond, above || v > scale.high + beyond)
    });
    let ends = [(above, top, -px(9), middles.len() - 1), (below, bottom, px(9), 0)];
    for (_, y, tip, band) in ends.into_iter().filter(|end| end.0) {
        let corners = vec![(left, y), (right, y), ((left + right) / 2, y + tip)];
        area.draw(&Polygon::new(corners, paint(band).filled()))?;
    }
    let beside = small(HPos::Left, VPos::Center);
    let mut longest = 0;
    let most = ((bottom - top) / px(17)).clamp(2, NUMBERED as i32) as usize;
    // where contours stand, if there is room
    let own = || steps.ends_apart((scale.high - scale.low) / most as f64);
    let numbers = Some(levels(steps, values)).filter(|levels| (2..=most).contains(&levels.len()));
    for value in numbers.unwrap_or_else(own) {
        let y = down(value);
        let line = BLACK.stroke_width(px(1) as u32);
        area.draw(&PathElement::new(vec![(right, y), (right + px(4), y)], line))?;
        area.draw(&Text::new(label(value), (px(25), y), beside.clone()))?;
        longest = longest.max(length(&label(value)));
    }
    let upright = small(HPos::Center, VPos::Center).transform(FontTransform::Rotate270);
    let at = (px(25) + longest + px(14), (top + bottom) / 2);
    Ok(area.draw(&Text::new(printed(name), at, upright))?)
}

impl HeatMap {
    /// Returns the values that are drawn.
    fn values(&self) -> impl Iterator<Item = f64> + Clone + use<'_> {
        let all = self.points.iter().map(|point| self.even.unwrap_or(point.2));
        all.take(if self.even.is_some() { 1 } else { usize::MAX })
    }

    /// Returns the ends of the two axes, a little beyond the points.
    fn ends(&self) -> [(f64, f64); 2] {
        let ends = [|p: &Corner| p.0, |p: &Corner| p.1].map(|axis| {
            let none = (f64::INFINITY, f64::NEG_INFINITY);
            self.points
                .iter()
                .chain(self.field.corners())
                .map(axis)
                .fold(none, |(low, high), v| (low.min(v), high.max(v)))
        });
        let longer = ends.iter().map(|(low, high)| high - low).fold(0.0, f64::max);
        ends.map(|(low, high)| (low - MARGIN * longer, high + MARGIN * longer))
    }

    /// Returns the axes with these ends in a panel. A metre is equally long on both.
    fn frame(&self, [x, y]: [(f64, f64); 2], panel: &Panel) -> Frame {
        let Panel { left, top, right, bottom, numbers, .. } = *panel;
        let room = [right - left, bottom - top].map(f64::from);
        let metre = (room[0] / (x.1 - x.0)).min(room[1] / (y.1 - y.0));
        let [wide, high] = [x, y].map(|(from, to)| ((to - from) * metre).round() as i32);
        let axis = |label: &str, (from, to): (f64, f64), has_numbers: bool| match has_numbers {
            true => Axis::linear(label, from..to),
            false => Axis::linear("", from..to).with_names(Vec::new()),
        };
        let [label_x, label_y] = &self.axes;
        let [x, y] = [axis(label_x, x, numbers[0]), axis(label_y, y, numbers[1])];
        Frame { left, top, right: left + wide, bottom: top + high, x, y }
    }
}

/// Returns the colour of a value.
pub(super) fn colour(scale: &Scale, value: f64) -> RGBColor {
    let [r, g, b] = scale.colour(value).to_array().map(|c| (255.0 * c).round() as u8);
    RGBColor(r, g, b)
}

/// Returns whether a rectangle about a place lies within outlines, of which those of holes are some.
fn is_within(at: Place, half: Place, outlines: &[Vec<Place>]) -> bool {
    let sides = || outlines.iter().flat_map(|outline| outline.windows(2));
    // the place is within if a line from it to the right crosses an odd number of sides
    let crosses = |ends: &&[Place]| {
        let [(x, y), (to_x, to_y)] = [ends[0], ends[1]].map(|(x, y)| (f64::from(x), f64::from(y)));
        let (left, up) = (f64::from(at.0), f64::from(at.1));
        (y > up) != (to_y > up) && x + (up - y) / (to_y - y) * (to_x - x) > left
    };
    let meets = |ends: &[Place]| meets([ends[0], ends[1]], at, half);
    sides().filter(crosses).count() % 2 == 1 && !sides().any(meets)
}

/// Returns whether a part of a line is within a rectangle about a place.
fn meets([from, to]: [Place; 2], at: Place, half: Place) -> bool {
    let aside = |a: i32, b: i32, at: i32, half: i32| a.max(b) <= at - half || a.min(b) >= at + half;
    let far = aside(from.0, to.0, at.0, half.0) || aside(from.1, to.1, at.1, half.1);
    !far && outside([from, to], at, half) != [[from, to]]
}

/// Returns the parts of a line outside of a rectangle about a place.
fn outside([from, to]: [Place; 2], at: Place, half: Place) -> Vec<[Place; 2]> {
    // where the line enters and leaves the rectangle, as shares of its length
    let (mut enter, mut leave) = (0.0f64, 1.0f64);
    for [a, b, at, half] in [[from.0, to.0, at.0, half.0], [from.1, to.1, at.1, half.1]] {
        let [start, along, half] = [a - at, b - a, half].map(f64::from);
        let (a, b) = match (along == 0.0, start.abs() < half) {
            (true, true) => continue,
            (true, false) => return vec![[from, to]],
            (false, _) => ((-half - start) / along, (half - start) / along),
        };
        (enter, leave) = (enter.max(a.min(b)), leave.min(a.max(b)));
    }
    if enter >= leave {
        return vec![[from, to]];
    }
    let along = |share: f64| {
        let at = |from: i32, to: i32| from + (share * f64::from(to - from)).round() as i32;
        (at(from.0, to.0), at(from.1, to.1))
    };
    let parts = [[from, along(enter)], [along(leave), to]];
    parts.into_iter().filter(|[a, b]| a != b).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A line breaks where the number of a contour stands on it, and goes on beyond.
    #[test]
    fn lines_break_at_numbers() {
        let (at, half) = ((0, 0), (10, 5));
        let of = |from, to| outside([from, to], at, half);
        assert_eq!(of((-30, 0), (30, 0)), [[(-30, 0), (-10, 0)], [(10, 0), (30, 0)]]);
        assert_eq!(of((0, 0), (0, 30)), [[(0, 5), (0, 30)]]);
        assert_eq!(of((-30, 6), (30, 6)), [[(-30, 6), (30, 6)]]);
        assert_eq!(of((-30, 20), (-9, -40)), [[(-30, 20), (-9, -40)]]);
        assert_eq!(of((-4, 1), (4, 1)), Vec::<[Place; 2]>::new());
        // a rest that is too short to be a line is left out
        let number = || vec![Number { at, half, text: String::new(), ink: BLACK }];
        assert_eq!(broken(&[(-60, 0), (13, 0)], &number()), [[(-60, 0), (-10, 0)]]);
        assert_eq!(broken(&[(20, 0), (23, 0)], &number()), [[(20, 0), (23, 0)]]);
    }

    /// Returns a map of a grid of 6 x 4 points whose values have such an error.
    fn map(value: fn(f64, f64) -> f64, error: f64) -> HeatMap {
        let places = (0..24).map(|i| (f64::from(i % 6), f64::from(i / 6)));
        let points: Vec<Corner> = places.map(|(x, y)| (x, y, value(x, y))).collect();
        let field = Field::between(&points, &[0; 24], &[(0..24).collect()]);
        let (title, axes) = ("a map".into(), ["x".into(), "y".into()]);
        HeatMap { title, axes, points, field, facts: Vec::new(), error: Some(error), even: None }
    }

    /// No step between colours or contours is finer than two errors, whatever the range; at least
    /// one colour is left.
    #[test]
    fn steps_are_no_finer_than_two_errors() {
        for error in [0.0, 0.1, 1.0, 3.0, 20.0, 1000.0] {
            for range in [None, Some((0.0, 100.0)), Some((3.0, 7.0))] {
                let own = map(|x, y| 50.0 + 10.0 * x - 3.0 * y, error);
                let maps = HeatMaps::new(vec![own], range, "light".into()).unwrap();
                let ends = &maps.steps.ends;
                let apart = |pair: &[f64]| pair[1] - pair[0] >= 2.0 * error * (1.0 - 1e-9);
                assert!(ends.windows(2).all(apart) || ends.len() == 2, "{error} {range:?}");
                // contours stand where colours change
                let levels = maps.levels(&maps.maps[0]);
                let is_end = |level: &f64| ends.iter().any(|end| (end - level).abs() < 1e-9);
                assert!(levels.iter().all(is_end), "{error} {range:?}: {levels:?} {ends:?}");
                if error == 0.0 && range.is_none() {
                    assert!(ends.len() > COLOURS / 3 && levels.len() > 3, "{levels:?}");
                }
            }
        }
    }

    /// Numbers of contours stand on the colours with all their letters: that of a line in a corner that
    /// has no room for it is left out, and each that is there lies within the outermost sensors.
    #[test]
    fn numbers_of_contours_are_whole() {
        for steep in [3.0, 30.0, 90.0, 180.0] {
            let own = map(|_, _| 50.0, 0.1);
            let mut points = own.points.clone();
            for point in &mut points {
                let far = |x: f64, y: f64| (point.0 - x).hypot(point.1 - y);
                point.2 += steep * ((-2.0 * far(0.0, 0.0)).exp() + (-2.0 * far(5.0, 3.0)).exp());
            }
            let field = Field::between(&points, &[0; 24], &[(0..24).collect()]);
            let maps = vec![HeatMap { points, field, ..own }];
            let maps = HeatMaps::new(maps, None, "light".into()).unwrap();
            let levels = maps.levels(&maps.maps[0]);
            assert!(!levels.is_empty());
            for width in [Width::Column, Width::Page] {
                let svg = maps.svg(width).unwrap();
                let number = |tag: &str, name: &str| -> i32 {
                    let (_, rest) = tag.split_once(&format!(" {name}=\"")).expect(name);
                    rest.split('"').next().and_then(|n| n.parse().ok()).expect(name)
                };
                let dots: Vec<Place> = svg
                    .split("<circle")
                    .skip(1)
                    .map(|tag| (number(tag, "cx"), number(tag, "cy")))
                    .collect();
                let ends = |of: fn(&Place) -> i32| {
                    (dots.iter().map(of).min().unwrap(), dots.iter().map(of).max().unwrap())
                };
                let (across, down) = (ends(|dot| dot.0), ends(|dot| dot.1));
                let inside = |(x, y): &Place| {
                    (across.0..=across.1).contains(x) && (down.0..=down.1).contains(y)
                };
                for text in svg.split("<text").skip(1) {
                    let (tag, rest) = text.split_once('>').expect("its start");
                    let words = rest.split('<').next().expect("its end").trim();
                    let at = (number(tag, "x"), number(tag, "y"));
                    if inside(&at) {
                        assert!(levels.iter().any(|level| label(*level) == words), "{words}");
                        let half = length(words) / 2;
                        let corners =
                            [(-half, -px(5)), (half, -px(5)), (-half, px(5)), (half, px(5))];
                        let whole = corners.iter().all(|c| inside(&(at.0 + c.0, at.1 + c.1)));
                        assert!(
                            whole,
                            "{steep} {width:?}: {words} at {at:?} in {across:?} {down:?}"
                        );
                    }
                }
            }
        }
    }

    /// Long beds stand in one column, or in two if they are many, and take no more height than they
    /// need; a map of very many sensors has no dots.
    #[test]
    fn long_beds_and_dense_grids() {
        let bed = |nx: u32, ny: u32| {
            let places = (0..nx * ny).map(|i| (f64::from(i % nx), f64::from(i / nx)));
            let points: Vec<Corner> = places.map(|(x, y)| (x, y, x)).collect();
            let all = vec![0; points.len()];
            let field = Field::between(&points, &all, &[(0..points.len()).collect()]);
            HeatMap { points, field, ..map(|x, _| x, 0.0) }
        };
        let height = |count: usize| {
            let beds = HeatMaps::new(vec![bed(20, 2); count], None, "light".into()).unwrap();
            let svg = beds.svg(Width::Page).unwrap();
            let (_, rest) = svg.split_once(" height=\"").unwrap();
            rest.split_once("in\"").unwrap().0.parse::<f64>().unwrap()
        };
        assert!(height(2) < 3.0 && height(4) < 6.0, "{} {}", height(2), height(4));
        assert!(height(8) < 1.1 * height(4), "{} {}", height(8), height(4));
        let dots = |map: HeatMap| {
            let maps = HeatMaps::new(vec![map], None, "light".into()).unwrap();
            maps.svg(Width::Column).unwrap().matches("<circle").count()
        };
        assert_eq!((dots(bed(20, 20)), dots(bed(120, 120))), (400, 0));
    }

    /// What is said of a map stands in one line with its title, where there is room, or below it in lines
    /// that are no longer than the map is wide; the map is lower then.
    #[test]
    fn titles_fit_the_width() {
        let facts = ["mean 180 W/m²", "min/mean 0.88", "CV 6.5 %", "median error 0.05 W/m²"];
        let own = HeatMap { facts: facts.map(String::from).into(), ..map(|x, _| x, 0.05) };
        let of = |count: usize, width: Width| {
            let maps = HeatMaps::new(vec![own.clone(); count], None, "light".into()).unwrap();
            let across = panels::across(&vec![0.6; count], width).0;
            let titles = maps.titles(across);
            assert_eq!(titles.len(), count);
            for (line, size) in titles.iter().flatten() {
                assert!(length_of(line, *size) <= across, "{line}");
            }
            let words: Vec<&str> = titles[0].iter().map(|(line, _)| line.as_str()).collect();
            for fact in facts {
                assert!(words.concat().contains(fact), "{words:?}");
            }
            words.len()
        };
        assert_eq!((of(1, Width::Page), of(1, Width::Column)), (1, 3));
        assert!(of(6, Width::Page) > 2);
    }

    /// An even map is one colour and has no contour. Beside one whose colours are
    /// few, its colour is one of these.
    #[test]
    fn even_maps_have_one_colour() {
        let own = HeatMap { even: Some(429.08), ..map(|x, _| 425.0 + x, 7.2) };
        let maps = HeatMaps::new(vec![own], None, "light".into()).unwrap();
        assert_eq!(maps.regions(&maps.maps[0]).len(), 1);
        assert!(maps.levels(&maps.maps[0]).is_empty());
        let own = HeatMap { even: Some(429.08), ..map(|x, _| 425.0 + x, 7.2) };
        let rough = map(|x, _| 400.0 + 100.0 * x, 40.0);
        let maps = HeatMaps::new(vec![own, rough], None, "light".into()).unwrap();
        let steps = &maps.steps;
        assert!(steps.ends.len() < COLOURS);
        let own = steps.ends.windows(2).position(|ends| (ends[0]..ends[1]).contains(&429.08));
        let known = colour(&steps.scale, steps.middles()[own.expect("its colour")]);
        assert_eq!(maps.regions(&maps.maps[0])[0].0, known);
    }
}
