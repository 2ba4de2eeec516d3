//! Draws values at points of a plane as colours with contours. Between the points of a grid they
//! are smooth, and never beyond the values of the points; between others they are linear over the
//! triangles of a Delaunay triangulation.

use plotters::{
    element::{Circle, PathElement, Polygon, Rectangle, Text},
    prelude::{Color, RGBColor, ShapeStyle},
    style::{
        BLACK, FontTransform, WHITE,
        text_anchor::{HPos, VPos},
    },
};

use crate::{
    chart::{
        axes::{Axis, BELOW, Frame},
        paper::{Area, Failure, LARGE, Place, Width, drawn, font, length, px, small},
    },
    picture::{Scale, label},
};
use phylux_core::math::units::printed;

/// The greatest height of the colours of a map, layout units.
const HIGHEST: i32 = px(420);
/// Margins around the colours of a map: left, right, above, below, layout units.
const ROOM: (i32, i32, i32, i32) = (px(52), px(12), px(30), BELOW);
/// Width of the colour bar with its numbers, layout units.
pub(super) const BAR: i32 = px(92);
/// Number of colours between the ends of the bar: finer than the eye can distinguish.
const STEPS: usize = 32;

/// A smooth map has about so many triangles.
const SMOOTH: usize = 1500;
/// The most parts into which the space between two points of a grid is cut for it.
const FINEST: usize = 6;

/// Values at points of one plane.
#[derive(Clone, Debug)]
pub(super) struct HeatMap {
    pub title: String,
    /// Labels of the two axes.
    pub axes: [String; 2],
    /// Coordinates of the points, m.
    pub points: Vec<(f64, f64)>,
    pub values: Vec<f64>,
}

/// Maps with one colour bar.
#[derive(Clone, Debug)]
pub(super) struct HeatMaps {
    pub maps: Vec<HeatMap>,
    pub scale: Scale,
    /// The label of the bar.
    pub label: String,
}

/// A place in a map, and its value.
type Corner = (f64, f64, f64);

impl HeatMaps {
    /// Returns how many maps are side by side in a picture of this width.
    fn columns(&self, width: Width) -> usize {
        let most = match width {
            Width::Column => 1,
            Width::Page if self.maps.len() == 4 => 2,
            Width::Page => 3,
        };
        self.maps.len().clamp(1, most)
    }

    /// Returns the maps with their colour bar as SVG text. A map is as high as its plane is wide and
    /// high.
    pub fn svg(&self, width: Width) -> Result<String, Failure> {
        let columns = self.columns(width);
        let (left, right, above, below) = ROOM;
        let across = (width.units() - BAR) / columns as i32;
        let steepest = |most: f64, map: &HeatMap| {
            let [(x, to_x), (y, to_y)] = ends_of(&map.spread());
            most.max((to_y - y) / (to_x - x).max(f64::MIN_POSITIVE))
        };
        let ratio = self.maps.iter().fold(0.0, steepest);
        let room = f64::from(across - left - right);
        let colours = (room * ratio).clamp(room / 4.0, f64::from(HIGHEST)) as i32;
        let down = colours.max(px(100)) + above + below;
        // the colour bar stands beside a map that is narrower than its place
        let wide = (f64::from(colours) / ratio.max(f64::MIN_POSITIVE)).min(room) as i32;
        let across = if columns == 1 { left + wide + right } else { across };
        let rows = self.maps.len().div_ceil(columns).max(1);
        drawn((width.units(), down * rows as i32), |area| {
            let (maps, bar) = area.split_horizontally(across * columns as i32);
            let parts = maps.split_evenly((rows, columns));
            for (map, part) in self.maps.iter().zip(&parts) {
                map.draw(part, &self.scale)?;
            }
            let high = above + colours.max(px(100));
            let values = self.maps.iter().flat_map(HeatMap::drawn_values);
            draw_bar(&bar, &self.scale, &self.label, [above, high], values)
        })
    }
}

/// Draws the colour bar between these heights of an area, with its label to the right. An end beyond
/// which there are values is pointed.
pub(super) fn draw_bar(
    area: &Area,
    scale: &Scale,
    name: &str,
    [top, bottom]: [i32; 2],
    values: impl Iterator<Item = f64>,
) -> Result<(), Failure> {
    let (left, right) = (px(4), px(18));
    for y in (top..bottom).step_by(px(1) as usize) {
        let place = 1.0 - f64::from(y - top) / f64::from(bottom - top - 1);
        let value = scale.low + place * (scale.high - scale.low);
        // rows overlap, so that no seam is seen between them
        let row = [(left, y), (right, (y + px(2)).min(bottom))];
        area.draw(&Rectangle::new(row, colour(scale, value).filled()))?;
    }
    let beyond = 1e-6 * (scale.high - scale.low);
    let (below, above) = values.fold((false, false), |(below, above), v| {
        (below || v < scale.low - beyond, above || v > scale.high + beyond)
    });
    let ends = [(above, top, -px(9), scale.high), (below, bottom, px(9), scale.low)];
    for (_, y, tip, value) in ends.into_iter().filter(|end| end.0) {
        let corners = vec![(left, y), (right, y), ((left + right) / 2, y + tip)];
        area.draw(&Polygon::new(corners, colour(scale, value).filled()))?;
    }
    let beside = small(HPos::Left, VPos::Center);
    let mut longest = 0;
    let most = ((bottom - top) / px(17)).clamp(2, 10) as usize;
    for value in scale.ticks(most) {
        let y = bottom - (scale.place(value) * f64::from(bottom - top)).round() as i32;
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
    /// Returns the values at the corners of what is drawn.
    pub fn drawn_values(&self) -> impl Iterator<Item = f64> + use<> {
        self.spread().into_iter().flatten().map(|corner| corner.2)
    }

    /// Returns the triangles between the points; none if all points lie on a line.
    pub fn triangles(&self) -> Vec<[Corner; 3]> {
        let points: Vec<delaunator::Point> =
            self.points.iter().map(|&(x, y)| delaunator::Point { x, y }).collect();
        let found = delaunator::triangulate(&points).triangles;
        let corner = |i: usize| (self.points[i].0, self.points[i].1, self.values[i]);
        found.as_chunks::<3>().0.iter().map(|t| t.map(corner)).collect()
    }

    fn draw(&self, area: &Area, scale: &Scale) -> Result<(), Failure> {
        let triangles = self.spread();
        let (left, right, above, below) = ROOM;
        let (width, height) = area.dim_in_pixel();
        let room = [width as i32 - left - right, height as i32 - above - below];
        // a metre is equally long on both axes, and colours reach to the ends of both
        let [x, y] = ends_of(&triangles);
        let metre = (f64::from(room[0]) / (x.1 - x.0)).min(f64::from(room[1]) / (y.1 - y.0));
        let sides = [x, y].map(|(from, to)| ((to - from) * metre).round() as i32);
        area.draw(&Text::new(self.title.as_str(), (left, px(10)), font(LARGE)))?;
        let [label_x, label_y] = &self.axes;
        let frame = Frame {
            left,
            top: above,
            right: left + sides[0],
            bottom: above + sides[1],
            x: Axis::linear(label_x, x.0..x.1),
            y: Axis::linear(label_y, y.0..y.1),
        };
        let place = |&(x, y): &(f64, f64)| frame.place((x, y));
        frame.draw(area, false)?;

        let step = (scale.high - scale.low) / STEPS as f64;
        for triangle in &triangles {
            let [least, most] = span(triangle);
            for i in 0..STEPS {
                // values beyond the bar have the colour of its end
                let from = if i == 0 { f64::NEG_INFINITY } else { scale.low + i as f64 * step };
                let to =
                    if i + 1 == STEPS { f64::INFINITY } else { scale.low + (i + 1) as f64 * step };
                if least > to || most < from {
                    continue;
                }
                let part = clipped(&clipped(triangle, from, 1.0), -to, -1.0);
                if part.len() < 3 {
                    continue;
                }
                let colour = colour(scale, scale.low + (i as f64 + 0.5) * step);
                let mut outline: Vec<Place> = part.iter().map(|c| place(&(c.0, c.1))).collect();
                area.draw(&Polygon::new(outline.clone(), colour.filled()))?;
                outline.push(outline[0]);
                // an outline of the same colour leaves no gap to the neighbouring part
                area.draw(&PathElement::new(outline, colour.stroke_width(2)))?;
            }
        }
        let levels = self.levels(scale);
        let lines: Vec<Vec<[(f64, f64); 2]>> = levels
            .iter()
            .map(|level| triangles.iter().filter_map(|t| contour(t, *level)).collect())
            .collect();
        // numbers stand in the middles of lines, apart from each other, and rather beside points
        let mut numbers: Vec<(Place, Place, String, RGBColor)> = Vec::new();
        for (&level, segments) in levels.iter().zip(&lines) {
            let text = label(level);
            let half = (length(&text) / 2 + px(2), px(6));
            let near = |a: &Place, b: &Place, aside: Place| {
                (a.0 - b.0).abs() < aside.0 && (a.1 - b.1).abs() < aside.1
            };
            let fits = |at: &Place| {
                let inside = at.0 - half.0 > left
                    && at.0 + half.0 < left + sides[0]
                    && at.1 - half.1 > above
                    && at.1 + half.1 < above + sides[1];
                let apart = |(other, size, ..): &(Place, Place, String, RGBColor)| {
                    !near(at, other, (half.0 + size.0 + px(4), half.1 + size.1 + px(2)))
                };
                inside && numbers.iter().all(apart)
            };
            let bare = |at: &&Place| !self.points.iter().any(|p| near(at, &place(p), half));
            let middle = |[from, to]: &[(f64, f64); 2]| {
                place(&(0.5 * (from.0 + to.0), 0.5 * (from.1 + to.1)))
            };
            // from the middle of the line to its ends
            let order = (segments.len() / 2..segments.len()).chain(0..segments.len() / 2);
            let places: Vec<Place> = order.map(|i| middle(&segments[i])).filter(fits).collect();
            if let Some(&at) = places.iter().find(bare).or(places.first()) {
                numbers.push((at, half, text, ink(scale, level)));
            }
        }
        for (&level, segments) in levels.iter().zip(&lines) {
            let style = ShapeStyle::from(&ink(scale, level).mix(0.7)).stroke_width(px(1) as u32);
            // lines break at numbers
            let mut parts: Vec<[Place; 2]> =
                segments.iter().map(|ends| ends.map(|p| place(&p))).collect();
            for (at, half, ..) in &numbers {
                parts = parts.into_iter().flat_map(|part| outside(part, *at, *half)).collect();
            }
            for part in parts {
                area.draw(&PathElement::new(part.to_vec(), style))?;
            }
        }
        for (at, _, text, ink) in numbers {
            let style = small(HPos::Center, VPos::Center).color(&ink);
            area.draw(&Text::new(text, at, style))?;
        }
        let dot = |point| Circle::new(place(point), px(3) / 2, BLACK.mix(0.7).filled());
        Ok(self.points.iter().map(dot).try_for_each(|dot| area.draw(&dot))?)
    }

    /// Returns the values at which there are contours: round numbers between those of the points.
    fn levels(&self, scale: &Scale) -> Vec<f64> {
        let ends = self.values.iter().filter(|value| value.is_finite());
        let none = (f64::INFINITY, f64::NEG_INFINITY);
        let (low, high) = ends.fold(none, |(low, high), v| (low.min(*v), high.max(*v)));
        let (low, high) = (low.max(scale.low), high.min(scale.high));
        let levels = if low < high { Scale { low, high, log: false }.ticks(6) } else { Vec::new() };
        levels.into_iter().filter(|level| *level > low && *level < high).collect()
    }

    /// Returns the triangles that are drawn. Around a grid they go on to the ends of the cells whose
    /// middles the points are: values go on as they do between the last two points, but not below
    /// 0. Between the points of a grid values are smooth.
    fn spread(&self) -> Vec<[Corner; 3]> {
        let ends = ends(&self.points);
        let half = [step(self.points.iter().map(|p| p.0)), step(self.points.iter().map(|p| p.1))]
            .map(|step| step / 2.0);
        // how far a point moves out along an axis, if it is at an end of it
        let out = |axis: usize, at: f64| match (at - ends[axis].0, ends[axis].1 - at) {
            (from, _) if from < half[axis] => Some(-half[axis]),
            (_, to) if to < half[axis] => Some(half[axis]),
            _ => None,
        };
        let floor = if self.values.iter().any(|value| *value < 0.0) { f64::MIN } else { 0.0 };
        // what is added over half a cell, by the nearest point on the other side along this axis
        let rise = |axis: usize, (x, y): (f64, f64), value: f64, out: f64| {
            let [own, other] = if axis == 0 { [x, y] } else { [y, x] };
            let along = |p: &(f64, f64)| if axis == 0 { [p.0, p.1] } else { [p.1, p.0] };
            let before = self.points.iter().zip(&self.values).filter_map(|(p, before)| {
                let [at, beside] = along(p);
                let inward = (own - at) * out.signum();
                let same = (beside - other).abs() < 1e-3 * half[1 - axis];
                (same && inward > 1e-3 * half[axis]).then_some((inward, *before))
            });
            let nearest = before.min_by(|a, b| a.0.total_cmp(&b.0));
            nearest.map_or(0.0, |(inward, before)| (value - before) * out.abs() / inward)
        };
        let mut all = self.clone();
        let mut corners = 0;
        for (&(x, y), &value) in self.points.iter().zip(&self.values) {
            let (across, up) = (out(0, x), out(1, y));
            corners += usize::from(across.is_some() && up.is_some());
            let [more_across, more_up] = [(0, across), (1, up)]
                .map(|(axis, out)| out.map_or(0.0, |out| rise(axis, (x, y), value, out)));
            let beside = across.map(|across| (x + across, y, more_across));
            let above = up.map(|up| (x, y + up, more_up));
            let both = across.zip(up);
            let both = both.map(|(across, up)| (x + across, y + up, more_across + more_up));
            for (x, y, more) in [beside, above, both].into_iter().flatten() {
                all.points.push((x, y));
                all.values.push((value + more).max(floor));
            }
        }
        // points that are no grid have no cells
        let whole = if corners == 4 { &all } else { self };
        whole.smooth().unwrap_or_else(|| whole.triangles())
    }

    /// Returns the triangles of a finer grid, on which values follow monotone cubics along both
    /// axes. `None` if the points are no grid of three lines or more both ways, or if there are so
    /// many of them that no finer grid is needed.
    fn smooth(&self) -> Option<Vec<[Corner; 3]>> {
        let [across, up] = [|p: &(f64, f64)| p.0, |p: &(f64, f64)| p.1]
            .map(|axis| lines(self.points.iter().map(axis)));
        let (columns, rows) = (across.len(), up.len());
        let cells = columns.checked_sub(1)? * rows.checked_sub(1)?;
        let parts = ((SMOOTH as f64 / (2.0 * cells as f64)).sqrt() as usize).min(FINEST);
        if columns * rows != self.points.len() || columns.min(rows) < 3 || parts < 2 {
            return None;
        }
        let mut values = vec![f64::NAN; columns * rows];
        for (&(x, y), &value) in self.points.iter().zip(&self.values) {
            values[nearest(&up, y) * columns + nearest(&across, x)] = value;
        }
        if values.iter().any(|value| value.is_nan()) {
            return None;
        }
        let finer = |places: &[f64]| -> Vec<f64> {
            let part = |i: usize| i as f64 / parts as f64;
            let between = |pair: &[f64]| {
                let [from, to] = [pair[0], pair[1]];
                (0..parts).map(move |i| from + part(i) * (to - from))
            };
            places.windows(2).flat_map(between).chain(places.last().copied()).collect()
        };
        let (x, y) = (finer(&across), finer(&up));
        let along: Vec<Vec<f64>> =
            values.chunks(columns).map(|row| monotone(&across, row, &x)).collect();
        let column = |i: usize| {
            let values: Vec<f64> = along.iter().map(|row| row[i]).collect();
            monotone(&up, &values, &y)
        };
        let fine: Vec<Vec<f64>> = (0..x.len()).map(column).collect();
        let corner = |i: usize, j: usize| (x[i], y[j], fine[i][j]);
        let cell = |(i, j): (usize, usize)| {
            let [a, b, c, d] =
                [corner(i, j), corner(i + 1, j), corner(i + 1, j + 1), corner(i, j + 1)];
            [[a, b, c], [a, c, d]]
        };
        let all = (1..x.len()).flat_map(|i| (1..y.len()).map(move |j| (i - 1, j - 1)));
        Some(all.flat_map(cell).collect())
    }
}

/// Returns the colour of lines and numbers on the colour of a value.
fn ink(scale: &Scale, value: f64) -> RGBColor {
    if scale.place(value) < 0.5 { WHITE } else { BLACK }
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

/// Returns the median distance between neighbours along an axis; 0 if all have the same place.
fn step(places: impl Iterator<Item = f64>) -> f64 {
    let mut places: Vec<f64> = places.collect();
    places.sort_by(f64::total_cmp);
    let least = match (places.first(), places.last()) {
        (Some(first), Some(last)) => 1e-6 * (last - first),
        _ => return 0.0,
    };
    let mut steps: Vec<f64> =
        places.windows(2).map(|pair| pair[1] - pair[0]).filter(|step| *step > least).collect();
    steps.sort_by(f64::total_cmp);
    steps.get(steps.len() / 2).copied().unwrap_or(0.0)
}

/// Returns the distinct places among these, in rising order.
fn lines(places: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut places: Vec<f64> = places.collect();
    places.sort_by(f64::total_cmp);
    if let [first, .., last] = places[..] {
        let least = 1e-6 * (last - first);
        places.dedup_by(|next, place| *next - *place <= least);
    }
    places
}

/// Returns the index of the place that is nearest to this one.
fn nearest(places: &[f64], at: f64) -> usize {
    let next = places.partition_point(|place| *place < at).min(places.len() - 1);
    let before = next.saturating_sub(1);
    if at - places[before] < places[next] - at { before } else { next }
}

/// Interpolates `values` at the rising places `x`, three at least, by cubics that rise and fall only
/// where the values do (Fritsch and Butland 1984); `at` are rising places between the ends of `x`.
fn monotone(x: &[f64], values: &[f64], at: &[f64]) -> Vec<f64> {
    let width: Vec<f64> = x.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let slope: Vec<f64> =
        values.windows(2).zip(&width).map(|(pair, width)| (pair[1] - pair[0]) / width).collect();
    let last = width.len() - 1;
    // as the parabola through three places, but not against the slope there, nor steeper than three
    // times it
    let end = |own: usize, other: usize| {
        let (h, g) = (width[own], width[other]);
        let end = ((2.0 * h + g) * slope[own] - h * slope[other]) / (h + g);
        let steepest = 3.0 * slope[own];
        if end * slope[own] <= 0.0 {
            0.0
        } else if end.abs() > steepest.abs() {
            steepest
        } else {
            end
        }
    };
    // a weighted harmonic mean of the slopes beside a place; 0 at a hill or in a hollow
    let tangent = |i: usize| match i {
        0 => end(0, 1),
        _ if i > last => end(last, last - 1),
        _ if slope[i - 1] * slope[i] <= 0.0 => 0.0,
        _ => {
            let [before, after] = [2.0 * width[i] + width[i - 1], width[i] + 2.0 * width[i - 1]];
            (before + after) / (before / slope[i - 1] + after / slope[i])
        }
    };
    let value = |&at: &f64| {
        let i = x.partition_point(|x| *x <= at).clamp(1, last + 1) - 1;
        let (h, t) = (width[i], (at - x[i]) / width[i]);
        let from = (1.0 + 2.0 * t) * values[i] + h * t * tangent(i);
        let to = (3.0 - 2.0 * t) * values[i + 1] - h * (1.0 - t) * tangent(i + 1);
        from * (1.0 - t).powi(2) + to * t.powi(2)
    };
    at.iter().map(value).collect()
}

/// Returns the least and the greatest coordinates on both axes.
fn ends(points: &[(f64, f64)]) -> [(f64, f64); 2] {
    [|p: &(f64, f64)| p.0, |p: &(f64, f64)| p.1].map(|axis| {
        let none = (f64::INFINITY, f64::NEG_INFINITY);
        points.iter().map(axis).fold(none, |(low, high), v| (low.min(v), high.max(v)))
    })
}

/// Returns the same for the corners of triangles; a span of 0 is widened.
fn ends_of(triangles: &[[Corner; 3]]) -> [(f64, f64); 2] {
    let points: Vec<(f64, f64)> = triangles.as_flattened().iter().map(|c| (c.0, c.1)).collect();
    ends(&points).map(|(low, high)| if high > low { (low, high) } else { (low - 0.5, low + 0.5) })
}

pub(super) fn colour(scale: &Scale, value: f64) -> RGBColor {
    let [r, g, b] = scale.colour(value).to_array().map(|c| (255.0 * c).round() as u8);
    RGBColor(r, g, b)
}

fn span(triangle: &[Corner; 3]) -> [f64; 2] {
    let values = triangle.map(|corner| corner.2);
    [
        values.into_iter().fold(f64::INFINITY, f64::min),
        values.into_iter().fold(f64::NEG_INFINITY, f64::max),
    ]
}

/// Returns the part of an outline where `sign` x value is at least `limit`.
fn clipped(outline: &[Corner], limit: f64, sign: f64) -> Vec<Corner> {
    let above = |corner: &Corner| sign * corner.2 - limit;
    let mut part = Vec::new();
    for (i, a) in outline.iter().enumerate() {
        let b = &outline[(i + 1) % outline.len()];
        let (from, to) = (above(a), above(b));
        if from >= 0.0 {
            part.push(*a);
        }
        if from.is_finite() && to.is_finite() && (from < 0.0) != (to < 0.0) {
            part.push(between(a, b, from / (from - to)));
        }
    }
    part
}

/// Returns the ends of the line on which a level crosses a triangle, if it does.
fn contour(triangle: &[Corner; 3], level: f64) -> Option<[(f64, f64); 2]> {
    let mut ends = (0..3).filter_map(|i| {
        let (a, b) = (&triangle[i], &triangle[(i + 1) % 3]);
        let (from, to) = (a.2 - level, b.2 - level);
        ((from < 0.0) != (to < 0.0)).then(|| between(a, b, from / (from - to)))
    });
    let (a, b) = (ends.next()?, ends.next()?);
    Some([(a.0, a.1), (b.0, b.1)])
}

fn between(a: &Corner, b: &Corner, share: f64) -> Corner {
    let at = |a: f64, b: f64| a + share * (b - a);
    (at(a.0, b.0), at(a.1, b.1), at(a.2, b.2))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Values x + 2 y at five points of the unit square: the triangles cover it once, the parts
    /// below and above a level add up to it, and a contour lies where the value is its level.
    #[test]
    fn maps_are_linear_between_points() {
        let points = vec![(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0), (0.4, 0.3)];
        let values = points.iter().map(|(x, y)| x + 2.0 * y).collect();
        let map = HeatMap { title: String::new(), axes: Default::default(), points, values };
        let area = |outline: &[Corner]| {
            let edge = |i: usize| {
                let (a, b) = (outline[i], outline[(i + 1) % outline.len()]);
                a.0 * b.1 - a.1 * b.0
            };
            ((0..outline.len()).map(edge).sum::<f64>() / 2.0).abs()
        };
        let triangles = map.triangles();
        let whole: f64 = triangles.iter().map(|t| area(t)).sum();
        assert!((whole - 1.0).abs() < 1e-12, "{whole}");
        // x + 2 y is below 1.2 in a trapezoid whose parallel sides are 0.6 and 0.1 long
        let below: f64 = triangles.iter().map(|t| area(&clipped(t, -1.2, -1.0))).sum();
        assert!((below - 0.35).abs() < 1e-12, "{below}");
        let above: f64 = triangles.iter().map(|t| area(&clipped(t, 1.2, 1.0))).sum();
        assert!((above - 0.65).abs() < 1e-12, "{above}");
        let ends: Vec<(f64, f64)> =
            triangles.iter().filter_map(|t| contour(t, 1.2)).flatten().collect();
        assert!(ends.len() >= 4, "{ends:?}");
        assert!(ends.iter().all(|(x, y)| (x + 2.0 * y - 1.2).abs() < 1e-12), "{ends:?}");
    }

    /// Around a grid of cells of 1 m the map reaches to the ends of the cells, where values go on as
    /// they do between the points, but not below 0; around points that are no grid it ends at these.
    #[test]
    fn a_grid_is_filled_to_the_ends_of_its_cells() {
        let map = |points: Vec<(f64, f64)>| {
            let values = points.iter().map(|(x, _)| 100.0 * x).collect();
            HeatMap { title: String::new(), axes: Default::default(), points, values }
        };
        let grid: Vec<(f64, f64)> = (0..12).map(|i| (f64::from(i % 4), f64::from(i / 4))).collect();
        let found = map(grid).spread();
        let corners: Vec<(f64, f64)> = found.as_flattened().iter().map(|c| (c.0, c.1)).collect();
        assert_eq!(ends(&corners), [(-0.5, 3.5), (-0.5, 2.5)]);
        // between 0 and 1 the line bends from level to rising
        let rises = |c: &Corner| match (0.0..1.0).contains(&c.0) {
            true => (0.0..=100.0 * c.0 + 1e-9).contains(&c.2),
            false => (c.2 - (100.0 * c.0).max(0.0)).abs() < 1e-9,
        };
        assert!(found.as_flattened().iter().all(rises), "{found:?}");
        let star = vec![(0.0, 1.0), (1.0, 0.0), (2.0, 1.0), (1.0, 2.0), (1.0, 1.0)];
        let corners: Vec<(f64, f64)> =
            map(star).spread().as_flattened().iter().map(|c| (c.0, c.1)).collect();
        assert_eq!(ends(&corners), [(0.0, 2.0), (0.0, 2.0)]);
    }

    /// Between the points of a grid values are smooth: they go through those of the points, follow
    /// a plane, and the hill between two equal points is no higher than these.
    #[test]
    fn a_grid_is_smooth() {
        let grid = |value: fn(f64, f64) -> f64| {
            let points: Vec<(f64, f64)> =
                (0..20).map(|i| (f64::from(i % 5), 0.5 * f64::from(i / 5))).collect();
            let values = points.iter().map(|&(x, y)| value(x, y)).collect();
            HeatMap { title: String::new(), axes: Default::default(), points, values }
        };
        let plane = grid(|x, y| 3.0 * x - 2.0 * y).smooth().expect("a grid");
        assert_eq!(plane.len(), 2 * 12 * FINEST * FINEST);
        let off = |c: &Corner| (c.2 - 3.0 * c.0 + 2.0 * c.1).abs();
        assert!(plane.as_flattened().iter().all(|c| off(c) < 1e-12));
        let bumps = grid(|x, _| if x == 1.0 || x == 2.0 { 7.0 } else { x });
        let found = bumps.smooth().expect("a grid");
        let found = found.as_flattened();
        for (&(x, y), &value) in bumps.points.iter().zip(&bumps.values) {
            let there = |c: &&Corner| (c.0 - x).abs() < 1e-9 && (c.1 - y).abs() < 1e-9;
            assert!((found.iter().find(there).expect("its corner").2 - value).abs() < 1e-12);
        }
        // to rounding
        assert!(found.iter().all(|c| (-1e-12..=7.0 + 1e-12).contains(&c.2)));
        let at = |x: f64| {
            let near = |c: &&Corner| (c.0 - x).abs() < 1e-9 && c.1 == 0.0;
            found.iter().find(near).expect("its corner").2
        };
        // between 0 and 7 with slopes of 10.5 (of the parabola through 0, 7, 7) and 0:
        // 10.5 t (1 - t)^2 + 7 (3 t^2 - 2 t^3)
        assert!((at(0.5) - (10.5 / 8.0 + 3.5)).abs() < 1e-12, "{}", at(0.5));
        let star = vec![(0.0, 1.0), (1.0, 0.0), (2.0, 1.0), (1.0, 2.0), (1.0, 1.0)];
        let values = vec![0.0; 5];
        let map = HeatMap { title: String::new(), axes: Default::default(), points: star, values };
        assert!(map.smooth().is_none());
    }

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
    }

    /// Points on a line have no triangles.
    #[test]
    fn a_line_is_no_map() {
        let points = vec![(0.0, 0.0), (1.0, 1.0), (2.0, 2.0)];
        let map = HeatMap {
            title: String::new(),
            axes: Default::default(),
            points,
            values: vec![1.0; 3],
        };
        assert!(map.triangles().is_empty());
    }
}
