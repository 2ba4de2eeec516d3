//! Charts: draws rows of numbers as lines, dots and bars on logarithmic or linear axes, as SVG
//! (plotters) in the sizes of printed columns.
//!
//! `paper` has sizes and letters, `axes` the axes of all plots, `series` how rows look, `labels`
//! where their names stand.

pub(super) mod axes;
mod labels;
pub(super) mod paper;
mod series;

use std::ops::Range;

use plotters::{
    element::{Rectangle, Text},
    prelude::Color,
    style::{
        WHITE,
        text_anchor::{HPos, VPos},
    },
};

use axes::{Axis, BELOW, Frame};
use labels::{Label, labels, room_beyond};
pub use paper::Width;
use paper::{
    Area, Failure, LARGE, Place, SMALL, drawn, font, length, length_of, px, small, wrapped,
};
use series::NAME;
pub use series::{Series, Stroke};

/// Height of the title above a chart.
const TOP: i32 = px(34);
/// Height of a line of the legend, the limit on the number of lines that are inside, and the number
/// of lines above the axes for which a chart has room.
const ROW: i32 = px(15);
const MOST_INSIDE: usize = 8;
const ROWS: i32 = 2;
/// The least width and the height of a panel, and the room above panels.
const PANEL: (i32, i32) = (px(150), px(190));
const ABOVE_PANELS: i32 = px(50);
/// Distance of named rows, its least, and the least height of all rows.
const NAMED_ROW: i32 = px(24);
const LEAST_ROW: i32 = px(14);
const LEAST_ROWS: i32 = px(40);
/// Distance of the words to the right of axes.
const VALUE: i32 = px(12);
/// The part of an upright axis beyond the outermost of named rows, of the distance between them.
const BESIDE_ROWS: f64 = 0.55;
/// The least extent of an axis that does not begin at 0, as a part of the greatest value.
const LEAST_SPAN: f64 = 0.05;
/// The most names of lines that coincide.
const TOGETHER: usize = 3;
/// Names beside lines take at most such a part of a chart's width.
const BESIDE: f64 = 0.36;

/// A chart.
#[derive(Clone, Debug, Default)]
pub struct Chart {
    /// The title above the chart.
    pub title: String,
    /// Words below the title that say what marks, bars and the like stand for.
    pub note: String,
    /// Label of the x axis, with the unit.
    pub x: String,
    /// Label of the y axis, with the unit.
    pub y: String,
    /// Whether the x axis is linear; otherwise it is logarithmic.
    pub linear_x: bool,
    /// Whether both axes are linear; otherwise the y axis is logarithmic.
    pub linear_y: bool,
    /// Whether amounts of light are those of the x axis, which then begins at 0; otherwise they are
    /// those of the y axis.
    pub amounts_across: bool,
    /// Whether an axis of amounts of light that are all more than half of the greatest begins near
    /// the least of them, with a sign that this is not 0.
    pub amounts_near: bool,
    /// Names of places on the x axis, in place of numbers.
    pub x_names: Vec<(f64, String)>,
    /// Names of places on the y axis, in place of numbers, if both axes are linear.
    pub y_names: Vec<(f64, String)>,
    /// Words to the right of the axes, at these places on the y axis.
    pub y_values: Vec<(f64, String)>,
    /// Ends of the x axis where both axes are linear, if they are not those of what is drawn.
    pub x_ends: Option<[f64; 2]>,
    /// Whether numbers of the x axis are whole, also where places are not.
    pub x_counts: bool,
    /// The series, in the order in which they are drawn, but areas below all others.
    pub series: Vec<Series>,
    /// Panels side by side with the same axes, in place of one chart: their titles and series.
    pub panels: Vec<(String, Vec<Series>)>,
    /// The least room to the left of the upright axis, layout units, so that charts one below the other
    /// begin at the same place.
    pub left: i32,
    /// Horizontal lines: their meaning and their y. One that is more than a decade away from all
    /// else on a logarithmic axis is not drawn; the legend has its value.
    pub levels: Vec<(String, f64)>,
}

/// Where the parts of a chart are.
struct Layout {
    /// The series, with those of the levels; the first of lines that coincide has the names of all.
    series: Vec<Series>,
    /// The first series that each coincides with, which may be itself.
    firsts: Vec<usize>,
    frame: Frame,
    /// The names that stand beside their series.
    labels: Vec<Option<Label>>,
    /// Places of the entries of the legend, with the series.
    entries: Vec<(usize, Place)>,
    /// Corners of the ground of a legend that is inside the axes.
    ground: Option<[Place; 2]>,
}

impl Chart {
    /// Returns the chart as SVG text; where there is nothing to draw, the chart says so. Errors:
    /// none that input can cause.
    pub fn svg(&self, width: Width) -> Result<String, String> {
        drawn(self.size(width), |area| self.draw(area)).map_err(|e| e.to_string())
    }

    /// Returns the width and height of the chart in layout units. It is higher where its legend needs
    /// many rows above the axes, and as high as its rows need where these have names.
    pub(super) fn size(&self, width: Width) -> (i32, i32) {
        let across = width.units();
        let above = self.top(across);
        let down = match self.y_names.len() as i32 {
            0 => width.height() + above - TOP,
            rows => {
                let with = |row: i32| above + (row * rows).max(LEAST_ROWS) + BELOW;
                width.height().clamp(with(LEAST_ROW), with(NAMED_ROW))
            }
        };
        if !self.panels.is_empty() {
            let rows = self.panels.len().div_ceil(self.columns(across)) as i32;
            return (across, self.legend_of_panels(across).2 + rows * PANEL.1);
        }
        let axes = self.axes();
        let top = axes.map_or(0, |axes| self.layout(axes, across, down).frame.top);
        (across, down + (top - above - ROWS * ROW).max(0))
    }

    /// Returns the lines of the note in a chart of this width.
    fn note_lines(&self, width: i32) -> Vec<String> {
        let words: Vec<&str> = self.note.split_whitespace().collect();
        wrapped(&words, " ", SMALL, width - px(16))
    }

    /// Returns the height of the title and the note.
    fn top(&self, width: i32) -> i32 {
        TOP + ROW * self.note_lines(width).len() as i32
    }

    /// Returns the room that the words to the right of the axes need.
    fn room_for_values(&self) -> i32 {
        let longest = self.y_values.iter().map(|(_, words)| length(words)).max();
        longest.map_or(0, |longest| VALUE + longest + px(8))
    }

    /// Returns the room that the upright axis needs to its left, layout units.
    pub(super) fn room_beside(&self, width: Width) -> i32 {
        let height = self.size(width).1 - BELOW - TOP;
        self.axes().map_or(0, |[_, y]| y.room_beside(height))
    }

    /// Draws the chart on an area.
    pub(super) fn draw(&self, area: &Area) -> Result<(), Failure> {
        match (self.axes(), self.panels.is_empty()) {
            (None, _) => {
                let note = format!("{}: nothing to draw", self.title);
                Ok(area.draw(&Text::new(note, (px(40), px(40)), font(LARGE)))?)
            }
            (Some(axes), true) => self.draw_on(area, axes, LARGE),
            (Some(axes), false) => self.draw_panels(area, axes),
        }
    }

    /// Returns how many panels are side by side in a chart of this width.
    fn columns(&self, width: i32) -> usize {
        self.panels.len().min((width / PANEL.0).clamp(1, 3) as usize)
    }

    /// Returns what is told of in the legend of panels, where it stands above them, and the height of
    /// all that is above them.
    fn legend_of_panels(&self, width: i32) -> (Vec<Series>, Vec<Place>, i32) {
        let mut meanings: Vec<Series> = Vec::new();
        for series in self.panels.iter().flat_map(|(_, series)| series) {
            match meanings.iter_mut().find(|other| other.name == series.name) {
                _ if series.name.is_none() => {}
                None => meanings.push(Series { points: Vec::new(), ..series.clone() }),
                // what has another colour in each panel
                Some(other) if other.colour != series.colour => other.colour = Series::GREY,
                Some(_) => {}
            }
        }
        let levels = self.levels.iter().map(|(name, _)| Series {
            name: Some(name.clone()),
            colour: Series::GREY,
            stroke: Stroke::Level,
            points: Vec::new(),
        });
        meanings.extend(levels);
        let places = rows_above((px(8), width), TOP, &meanings.iter().collect::<Vec<_>>());
        let more = places.last().map_or(0, |(_, y)| y - TOP);
        (meanings, places, ABOVE_PANELS + more)
    }

    /// Draws the panels in rows, with their legend above them. Numbers stand at each, and labels
    /// where no panel is between them and the edge.
    fn draw_panels(&self, area: &Area, axes: [Axis; 2]) -> Result<(), Failure> {
        let across = area.dim_in_pixel().0 as i32;
        let (meanings, places, height) = self.legend_of_panels(across);
        let (above, below) = area.split_vertically(height);
        above.draw(&Text::new(self.title.as_str(), (px(8), px(10)), font(LARGE)))?;
        for (series, place) in meanings.iter().zip(places) {
            series.draw_entry(&above, place, 0)?;
        }
        let columns = self.columns(across);
        let parts = below.split_evenly((self.panels.len().div_ceil(columns), columns));
        for (i, ((title, series), part)) in self.panels.iter().zip(&parts).enumerate() {
            let bare = |series: &Series| Series { name: None, ..series.clone() };
            let mut panel = Self {
                title: title.clone(),
                series: series.iter().map(bare).collect(),
                panels: Vec::new(),
                levels: self.levels.iter().map(|(_, y)| (String::new(), *y)).collect(),
                ..self.clone()
            };
            let [mut x, mut y] = axes.clone();
            if i + columns < self.panels.len() {
                x = x.unlabelled();
            }
            if i % columns > 0 {
                y = y.unlabelled();
            }
            panel.levels.retain(|(_, level)| axes[1].ends().contains(level));
            panel.draw_on(part, [x, y], SMALL)?;
        }
        Ok(())
    }

    /// Draws the chart with a title of letters of this size.
    fn draw_on(&self, area: &Area, axes: [Axis; 2], size: i32) -> Result<(), Failure> {
        let (width, height) = area.dim_in_pixel();
        let Layout { series: all, firsts, frame, labels, entries, ground } =
            self.layout(axes, width as i32, height as i32);
        let below = self.lines_below(&all, &frame);
        let mut order: Vec<(&Series, i32)> = all.iter().zip(below.iter().copied()).collect();
        order.sort_by_key(|(series, _)| series.stroke != Stroke::Band);

        let notes = self.note_lines(width as i32);
        let longest = notes.iter().map(|line| length(line)).max().unwrap_or(0);
        // a long title begins left of the axis
        let end = width as i32 - px(6) - length_of(&self.title, size).max(longest);
        let from = frame.left.min(end).max(px(8));
        area.draw(&Text::new(self.title.as_str(), (from, px(10)), font(size)))?;
        for (line, words) in (1..).zip(notes) {
            area.draw(&Text::new(words, (from, px(10) + ROW * line), font(SMALL)))?;
        }
        frame.draw(area, true)?;
        for (place, words) in &self.y_values {
            let (_, y) = frame.place((frame.ends_across()[0], *place));
            let beside = small(HPos::Left, VPos::Center);
            area.draw(&Text::new(words.as_str(), (frame.right + VALUE, y), beside))?;
        }
        if let Some(corners) = ground {
            area.draw(&Rectangle::new(corners, WHITE.filled()))?;
        }
        for ((x, y), half) in labels.iter().flatten() {
            // no line of the grid runs through a name
            let ground = [(x - half, y - px(5)), (x + half, y + px(5))];
            area.draw(&Rectangle::new(ground, WHITE.filled()))?;
        }
        let draw =
            |(series, below): &(&Series, i32)| series.draw(area, &frame, *below, |p| self.shows(p));
        order.iter().try_for_each(draw)?;
        for (series, label) in all.iter().zip(labels) {
            let Some((at, _)) = label else { continue };
            let name = series.name.clone().unwrap_or_default();
            let ink = series.ink();
            let style = small(HPos::Center, VPos::Center).color(&ink);
            area.draw(&Text::new(name, at, style))?;
        }
        let entries = entries.into_iter().flat_map(|(first, place)| {
            let own = (0..all.len()).filter(|&i| firsts[i] == first).collect::<Vec<_>>();
            own.into_iter().map(move |i| (i, place))
        });
        let entries: Vec<(usize, Place)> = entries.collect();
        entries.into_iter().try_for_each(|(i, place)| all[i].draw_entry(area, place, below[i]))
    }

    /// Returns for each series the first named one whose line it lies on, from end to end.
    fn firsts(&self, all: &[Series], frame: &Frame) -> Vec<usize> {
        let places = |series: &Series| -> Vec<Place> {
            let joined = matches!(series.stroke, Stroke::Line | Stroke::Hollow | Stroke::Plain);
            let runs = series.runs(|p| self.shows(p)).into_iter();
            let named = runs.filter(|_| joined && series.name.is_some()).flatten();
            named.map(|&point| frame.place(point)).collect()
        };
        let lines: Vec<Vec<Place>> = all.iter().map(places).collect();
        let near =
            |(a, b): (&Place, &Place)| (a.0 - b.0).abs() < px(2) && (a.1 - b.1).abs() < px(2);
        let same = |i: usize, j: usize| {
            let (one, other) = (&lines[i], &lines[j]);
            let alike = all[i].stroke == all[j].stroke && one.len() == other.len();
            alike && one.len() > 1 && one.iter().zip(other).all(near)
        };
        let mut firsts = Vec::new();
        for j in 0..all.len() {
            let first = (0..j).find(|&i| firsts[i] == i && same(i, j));
            firsts.push(first.unwrap_or(j));
        }
        firsts
    }

    /// Returns for each series how many of those that are drawn after it lie on a part of its line,
    /// so that it is wider and remains in view.
    fn lines_below(&self, all: &[Series], frame: &Frame) -> Vec<i32> {
        let places = |series: &Series| -> Vec<Vec<Place>> {
            let joined = matches!(series.stroke, Stroke::Line | Stroke::Hollow | Stroke::Plain);
            let runs = series.runs(|p| self.shows(p)).into_iter().filter(|_| joined);
            runs.map(|run| run.iter().map(|&point| frame.place(point)).collect()).collect()
        };
        let lines: Vec<Vec<Vec<Place>>> = all.iter().map(places).collect();
        let near = |a: &Place, b: &Place| (a.0 - b.0).abs() < px(2) && (a.1 - b.1).abs() < px(2);
        let same = |one: &[Vec<Place>], other: &[Vec<Place>]| {
            let parts = one.iter().flat_map(|run| run.windows(2));
            let has = |part: &&[Place]| {
                let mut parts = other.iter().flat_map(|run| run.windows(2));
                parts.any(|own| near(&own[0], &part[0]) && near(&own[1], &part[1]))
            };
            // lines that only meet are told apart beside the part that they share
            parts.clone().count().min(2) == parts.filter(has).take(2).count()
        };
        let count = |i: usize| {
            let after =
                (i + 1..all.len()).filter(|&j| !lines[i].is_empty() && !lines[j].is_empty());
            after.filter(|&j| all[j].colour != all[i].colour && same(&lines[i], &lines[j])).count()
        };
        (0..all.len()).map(|i| count(i).min(4) as i32).collect()
    }

    /// Lays the chart out on an area of this size.
    fn layout(&self, [x, y]: [Axis; 2], width: i32, height: i32) -> Layout {
        let (bottom, above) = (height - BELOW, self.top(width));
        let values = self.room_for_values();
        let frame = |top: i32, beyond: i32| {
            let left = y.room_beside(bottom - top).max(self.left);
            let right = width - x.room_beyond(width - left).max(beyond).max(values);
            Frame { left, top, right, bottom, x: x.clone(), y: y.clone() }
        };
        let shows = |p: &(f64, f64)| self.shows(p);
        let y_ends = y.ends();
        let mut series = self.series.clone();
        series.extend(self.levels.iter().map(|(name, y)| match y_ends.contains(y) {
            true => Series {
                name: (!name.is_empty()).then(|| name.clone()),
                colour: Series::GREY,
                stroke: Stroke::Level,
                points: frame(above, 0).ends_across().map(|x| (x, *y)).to_vec(),
            },
            false => Series {
                name: Some(format!("{name}: {}", two_digits(*y))),
                colour: Series::GREY,
                stroke: if y < y_ends.start() { Stroke::Below } else { Stroke::Above },
                points: Vec::new(),
            },
        }));

        let firsts = self.firsts(&series, &frame(above, 0));
        name_together(&mut series, &firsts);
        // names stand beside their series, with room for those at the ends of lines
        let beyond = room_beyond(&frame(above, 0), &series, shows);
        let beyond = if f64::from(beyond) < BESIDE * f64::from(width) { beyond + px(8) } else { 0 };
        let direct = labels(&frame(above, beyond), width, &series, shows);
        let direct = direct.map(|labels| (frame(above, beyond), labels));
        let none = || (frame(above, 0), vec![None; series.len()]);

        // the other names are in a legend, which stands where nothing is drawn, or else with all names
        // between the title and the axes
        let listed = |labels: &[Option<Label>]| -> Vec<usize> {
            let is_listed = |i: &usize| series[*i].name.is_some() && labels[*i].is_none();
            (0..series.len()).filter(is_listed).collect()
        };
        let named = |listed: &[usize]| listed.iter().map(|i| &series[*i]).collect::<Vec<_>>();
        for (inside, labels) in direct.into_iter().chain([none()]) {
            let listed = listed(&labels);
            let named = named(&listed);
            let mut taken: Vec<Place> =
                series.iter().flat_map(|series| series.covered(&inside, shows)).collect();
            for ((x, y), half) in labels.iter().flatten() {
                taken.extend((x - half..x + half).step_by(px(4) as usize).map(|x| (x, *y)));
            }
            let Some((x, y)) = room_inside(&inside, &named, &taken) else { continue };
            let end = |i: i32| y - ROW / 2 + ROW * i;
            let right = (x + legend_width(&named)).min(inside.right);
            let ground = [(x - px(4), end(0)), (right, end(named.len() as i32))];
            let ground = (!named.is_empty()).then_some(ground);
            let entries = listed.into_iter().enumerate().map(|(i, s)| (s, (x, y + ROW * i as i32)));
            let entries = entries.collect();
            return Layout { series, firsts, frame: inside, labels, entries, ground };
        }
        let (inside, labels) = none();
        let listed = listed(&labels);
        let places = rows_above((inside.left, inside.right), above, &named(&listed));
        let frame = frame(places.last().map_or(above, |(_, y)| y + px(12)), 0);
        let entries = listed.into_iter().zip(places).collect();
        Layout { series, firsts, frame, labels, entries, ground: None }
    }

    /// Returns the two axes; `None` if there is nothing that they can show.
    fn axes(&self) -> Option<[Axis; 2]> {
        let all = || self.panels.iter().flat_map(|(_, series)| series).chain(&self.series);
        let runs = || all().flat_map(|series| series.runs(|p| self.shows(p)));
        // bars of errors never squeeze what they stand at
        let data = || {
            let all = all().filter(|series| !series.is_error());
            all.flat_map(|series| series.runs(|p| self.shows(p))).flatten()
        };
        let x = unsqueezed(span(runs().flatten().map(|p| p.0))?, span(data().map(|p| p.0)));
        let y = unsqueezed(span(runs().flatten().map(|p| p.1))?, span(data().map(|p| p.1)));
        // a level that is far away would leave much of the chart empty
        let near = if self.linear_y { 0.0..f64::INFINITY } else { 0.1 * y.start..10.0 * y.end };
        let levels = self.levels.iter().map(|(_, y)| *y).filter(|y| *y > 0.0 && near.contains(y));
        let y = span(levels.chain([y.start, y.end]))?;
        // places that are all whole are counts of plants, leaves, days or bounces
        let counts = self.x_counts
            || self.linear_x
                && runs().flatten().all(|p| p.0.fract() == 0.0)
                && self.x_names.is_empty();
        let counted = |axis: Axis| if counts { axis.of_counts() } else { axis };
        let named = |axis: Axis| match self.x_names.is_empty() {
            true => counted(axis),
            false => axis.with_names(self.x_names.clone()),
        };
        // amounts begin at 0, so that lengths compare as the amounts do, and end at a number
        let x = match (self.linear_x, self.linear_y, self.x_ends) {
            (_, true, Some([a, b])) => named(Axis::linear(&self.x, a..b)),
            (_, true, None) if self.amounts_near => {
                named(Axis::linear(&self.x, from_least(x))).ended_at_numbers().broken()
            }
            (_, true, None) if self.amounts_across => {
                named(Axis::linear(&self.x, from_zero(x, 1.0))).ended_at_numbers()
            }
            (_, true, None) => named(Axis::linear(&self.x, spacious(x, 0.15))),
            (true, false, _) => named(Axis::linear(&self.x, x.start..x.end * 1.02 + 1e-9)),
            (false, false, _) => named(Axis::logarithmic(&self.x, roomy(x))),
        };
        let y = match self.linear_y {
            _ if !self.y_names.is_empty() => {
                let rows = span(self.y_names.iter().map(|(place, _)| *place)).unwrap_or(y);
                let ends = rows.start - BESIDE_ROWS..rows.end + BESIDE_ROWS;
                Axis::linear(&self.y, ends).with_names(self.y_names.clone())
            }
            true => {
                let share = if self.amounts_across { 0.5 } else { 1.0 };
                Axis::linear(&self.y, from_zero(y, share)).ended_at_numbers()
            }
            false => Axis::logarithmic(&self.y, roomy(y)),
        };
        Some([x, y])
    }

    /// Returns whether the axes can show a point.
    fn shows(&self, &(x, y): &(f64, f64)) -> bool {
        let fits = self.linear_y || y > 0.0 && (self.linear_x || x > 0.0);
        x.is_finite() && y.is_finite() && fits
    }
}

/// Gives the names of lines that coincide to the first of them.
fn name_together(series: &mut [Series], firsts: &[usize]) {
    for first in 0..series.len() {
        let own: Vec<usize> = (0..series.len()).filter(|&i| firsts[i] == first).collect();
        if own.len() < 2 {
            continue;
        }
        let names: Vec<String> = own.iter().filter_map(|&i| series[i].name.take()).collect();
        let more = names.len().saturating_sub(TOGETHER);
        let between = if names.iter().any(|name| name.contains(", ")) { "; " } else { ", " };
        let mut name = names[..names.len() - more].join(between);
        if more > 0 {
            name += &format!(" and {more} more");
        }
        series[first].name = Some(name);
    }
}

/// Returns the place of the first entry of a legend in a corner of a frame, or in the middle of a
/// side of it, that is free of what is drawn, if there is one.
fn room_inside(frame: &Frame, named: &[&Series], drawn: &[Place]) -> Option<Place> {
    let (width, height) = (legend_width(named), ROW * named.len() as i32);
    let ([left, right], [top, bottom]) = (
        [frame.left + px(14), frame.right - width - px(4)],
        [frame.top + px(4), frame.bottom - height - px(8)],
    );
    let (middle, centre) = ((left + right) / 2, (top + bottom) / 2);
    let places = [
        (right, top),
        (left, top),
        (right, bottom),
        (left, bottom),
        (right, centre),
        (left, centre),
        (middle, top),
        (middle, bottom),
    ];
    let is_free = |&(x, y): &Place| {
        let inside = |p: &Place| {
            (x - px(8)..x + width + px(4)).contains(&p.0)
                && (y - px(5)..y + height + px(5)).contains(&p.1)
        };
        !drawn.iter().any(inside)
    };
    let fits = right >= left && bottom >= top && named.len() <= MOST_INSIDE;
    places.into_iter().find(is_free).filter(|_| fits).map(|(x, y)| (x, y + ROW / 2))
}

/// Returns the width of a legend whose entries are one below the other.
fn legend_width(named: &[&Series]) -> i32 {
    let names = named.iter().filter_map(|series| series.name.as_deref());
    let longest = names.map(length).max().unwrap_or(0);
    // letters of other fonts are a little wider
    NAME + longest * 27 / 25 + px(4)
}

/// Returns the places of the entries of a legend above axes between these ends, in rows from `top`.
fn rows_above((left, right): (i32, i32), top: i32, named: &[&Series]) -> Vec<Place> {
    let (mut x, mut y) = (left, top);
    let place = |series: &&Series| {
        let own = NAME + length(series.name.as_deref().unwrap_or_default()) * 27 / 25;
        if x > left && x + own > right {
            (x, y) = (left, y + ROW);
        }
        let place = (x, y);
        x += own + px(14);
        place
    };
    named.iter().map(place).collect()
}

/// Returns the range from the least to the greatest value; `None` without values. Values that differ
/// by rounding are one.
fn span(values: impl Iterator<Item = f64>) -> Option<Range<f64>> {
    let all = values.fold(None, |span, v| {
        let (low, high) = span.map_or((v, v), |Range { start, end }| (v.min(start), v.max(end)));
        Some(low..high)
    });
    all.map(|Range { start, end }| match end - start <= 1e-9 * start.abs().max(end.abs()) {
        true => end..end,
        false => start..end,
    })
}

/// Returns the part of the range of all that is drawn that lies at most half the extent of the data,
/// from 0, beyond these, and not below 0 where these are not.
fn unsqueezed(all: Range<f64>, data: Option<Range<f64>>) -> Range<f64> {
    let Some(data) = data else { return all };
    let room = 0.5 * (data.end.max(0.0) - data.start.min(0.0));
    match room > 0.0 {
        true => {
            let least = if data.start >= 0.0 { 0.0 } else { data.start - room };
            all.start.max(least)..all.end.min(data.end + room)
        }
        false => all,
    }
}

/// Widens a range on a logarithmic axis to leave some room around it.
fn roomy(range: Range<f64>) -> Range<f64> {
    range.start / 1.4..range.end * 1.6
}

/// Widens a range on a linear axis whose ends will be numbers, if it has no width; it begins at 0
/// if its start is at least 0 and below `share` times its end.
fn from_zero(range: Range<f64>, share: f64) -> Range<f64> {
    let Range { start, end } = range;
    match (start >= 0.0 && start < share * end, end > start) {
        (true, _) => 0.0..end,
        (false, true) => start..end,
        (false, false) if end > 0.0 => 0.0..1.2 * end,
        (false, false) => spacious(range, share),
    }
}

/// Widens a range of amounts on a linear axis that may begin near the least of them: values that
/// hardly differ fill only a part of it. It begins at 0 if the least is at most half of the greatest.
fn from_least(range: Range<f64>) -> Range<f64> {
    let Range { start, end } = range;
    let room = 0.5 * (LEAST_SPAN * start.abs().max(end.abs()) - (end - start)).max(0.0);
    let room = if end > start || room > 0.0 { room } else { 0.5 };
    match (0.0..=0.5 * end).contains(&start) {
        true => 0.0..end,
        false => start - room..end + room,
    }
}

/// Writes a number above 0 with two digits.
fn two_digits(value: f64) -> String {
    let decimals = 1.0 - value.log10().floor();
    match (0.0..7.0).contains(&decimals) {
        true => format!("{value:.*}", decimals as usize),
        false => format!("{value:.1e}"),
    }
}

/// Widens a range on a linear axis to leave some room around it; it begins at 0 if its start is at
/// least 0 and below `share` times its end.
fn spacious(range: Range<f64>, share: f64) -> Range<f64> {
    let Range { start, end } = range;
    let room = match 0.04 * (end - start) {
        0.0 => 0.1 * start.abs().max(1.0),
        room => room,
    };
    let near_zero = start >= 0.0 && start < share * end;
    (if near_zero { 0.0 } else { start - room })..end + room
}

#[cfg(test)]
mod tests {
    use super::*;

    fn chart(series: Vec<Series>) -> Chart {
        let (x, y) = ("time, s".into(), "light, umol/m2/s".into());
        Chart { title: "a chart".into(), x, y, series, ..Chart::default() }
    }

    fn series(name: &str, colour: usize, stroke: Stroke, points: &[(f64, f64)]) -> Series {
        Series { name: Some(name.into()), colour, stroke, points: points.to_vec() }
    }

    /// Returns the texts of a picture with their places.
    fn texts(svg: &str) -> Vec<(String, [f64; 2])> {
        let number = |tag: &str, name: &str| -> f64 {
            let (_, rest) = tag.split_once(&format!(" {name}=\"")).expect(name);
            rest.split('"').next().and_then(|n| n.parse().ok()).expect(name)
        };
        let all = svg.split("<text").skip(1).map(|text| {
            let (tag, rest) = text.split_once('>').expect("its start");
            let text = rest.split('<').next().expect("its end").trim().to_string();
            (text, [number(tag, "x"), number(tag, "y")])
        });
        all.collect()
    }

    /// The label of the y axis stands clear of the longest number, and one axis has one notation.
    #[test]
    fn labels_stand_beside_long_numbers() {
        let drawn = |points: &[(f64, f64)]| {
            let lines = vec![series("a", 0, Stroke::Line, points)];
            texts(&chart(lines).svg(Width::Column).expect("a picture"))
        };
        let place = |texts: &[(String, [f64; 2])], wanted: &str| {
            let found = texts.iter().find(|(text, _)| text == wanted);
            found.unwrap_or_else(|| panic!("no `{wanted}` in {texts:?}")).1
        };
        let long = drawn(&[(1.0, 1e-4), (2.0, 0.01)]);
        // numbers end at their place, and the label is centred on its own
        let (number, label) = (place(&long, "0.0001"), place(&long, "light, µmol/m²/s"));
        let room = number[0] - f64::from(length("0.0001")) - label[0];
        assert!((30.0..60.0).contains(&room), "{room} of {long:?}");
        assert!(!long.iter().any(|(text, _)| text.contains('e') && text.starts_with('1')));
        let wide = drawn(&[(10.0, 1e-6), (1e7, 1.0)]);
        assert!(!wide.iter().any(|(text, _)| ["0.1", "100", "1e-6"].contains(&text.as_str())));
        assert!(wide.iter().filter(|(text, _)| text == "10").count() > 6, "{wide:?}");
        for raised in ["−6", "0", "3"] {
            place(&wide, raised);
        }
    }

    /// In a narrow plot names of months do not lie on each other.
    #[test]
    fn names_leave_room_for_each_other() {
        let points: Vec<(f64, f64)> = (1..=24).map(|m| (f64::from(m), 1.0)).collect();
        let mut months = chart(vec![series("a", 0, Stroke::Line, &points)]);
        (months.linear_x, months.linear_y) = (true, true);
        months.x_names = points.iter().map(|(x, _)| (*x, "Jan".into())).collect();
        let found = texts(&months.svg(Width::Column).expect("a picture"));
        let names: Vec<f64> = found.iter().filter(|t| t.0 == "Jan").map(|t| t.1[0]).collect();
        assert!((8..24).contains(&names.len()), "{names:?}");
        assert!(names.windows(2).all(|pair| pair[1] - pair[0] > f64::from(length("Jan"))));
    }

    /// A line breaks where a point cannot be shown, and does not go on to the next.
    #[test]
    fn lines_break_where_there_is_no_point() {
        let points = [
            (1.0, 1.0),
            (2.0, 2.0),
            (3.0, 0.0),
            (4.0, 2.0),
            (5.0, 1.0),
            (6.0, f64::NAN),
            (7.0, 3.0),
        ];
        for (stroke, marks) in [(Stroke::Line, 5), (Stroke::Plain, 1), (Stroke::Hollow, 10)] {
            let mut line = series("a", 0, stroke, &points);
            line.name = None;
            let svg = chart(vec![line]).svg(Width::Page).expect("a picture");
            let lines = svg.matches("stroke-width=\"6\"").count();
            let dashes = stroke == Stroke::Hollow;
            assert!(if dashes { lines > 4 } else { lines == 2 }, "{stroke:?}: {lines}");
            assert_eq!(svg.matches("<circle").count(), marks, "{stroke:?}");
        }
    }

    /// The legend shows lines and marks as they are drawn; each of the first series has a mark of
    /// its own, and the first that has the colour of another has another mark.
    #[test]
    fn legends_have_marks() {
        let two = |stroke, colour| {
            let points = [(1.0, 1.0), (2.0, 1.0)];
            let pair = [series("a", 0, stroke, &points), series("b", colour, stroke, &points)];
            // a name beside a line would lie on this
            let around = [(0.8, 0.4), (2.6, 0.4), (2.6, 2.5), (0.8, 2.5)];
            let ground = Series { name: None, ..series("", 2, Stroke::Band, &around) };
            chart([&pair[..], &[ground]].concat()).svg(Width::Page).expect("a picture")
        };
        let circles = |svg: &str| svg.matches("<circle").count();
        assert_eq!(circles(&two(Stroke::Marks, 0)), 6);
        let others = [1, 2, 3, 4, 7].map(|colour| {
            let svg = two(Stroke::Line, colour);
            assert_eq!(circles(&svg), 3, "{colour}");
            ["<rect", "<polygon"].map(|mark| svg.matches(mark).count())
        });
        let [squares, triangles, ..] = others;
        assert_eq!((squares[0] - triangles[0], triangles[1] - squares[1]), (3, 3));
        assert!(others[1..].iter().all(|other| *other == triangles), "{others:?}");
        let line = "stroke-width=\"6\"";
        assert!(!two(Stroke::Marks, 1).contains(line) && two(Stroke::Line, 1).contains(line));
    }

    /// Names stand beside lines, at ends that are apart; where two lines end together, one at least has
    /// its name at its middle. There is no legend.
    #[test]
    fn names_stand_beside_lines() {
        let drawn = |ends: [f64; 2], peaks: [f64; 2]| {
            let line = |i: usize| {
                let points = [(0.0, 0.0), (5.0, peaks[i]), (10.0, ends[i])];
                series(["one", "two"][i], i, Stroke::Line, &points)
            };
            let (linear_x, linear_y) = (true, true);
            let lines = Chart { linear_x, linear_y, ..chart(vec![line(0), line(1)]) };
            let svg = lines.svg(Width::Page).expect("a picture");
            assert_eq!(
                (svg.matches("<circle").count(), svg.matches("stroke-width=\"6\"").count()),
                (3, 2)
            );
            let found = texts(&svg);
            ["one", "two"].map(|name| found.iter().find(|t| t.0 == name).expect(name).1)
        };
        let apart = drawn([8.0, 3.0], [5.0, 4.0]);
        assert!(apart.iter().all(|at| at[0] > f64::from(px(600))), "{apart:?}");
        assert!(apart[1][1] > apart[0][1] + f64::from(px(100)), "{apart:?}");
        let together = drawn([0.0, 0.0], [9.0, 4.0]);
        assert!(together[1][0] < f64::from(px(500)), "{together:?}");
    }

    /// A name is nearer to its own series than to another: that of a line that ends below another with
    /// its end in the way of the name does not move beside the other.
    #[test]
    fn names_are_nearest_to_their_own() {
        let line = |name, colour, end: f64| {
            let points: Vec<(f64, f64)> =
                (0..6).map(|x| (f64::from(x), 10.0 + (end - 10.0) * f64::from(x) / 5.0)).collect();
            series(name, colour, Stroke::Line, &points)
        };
        let mut long = line("long", 1, 4.0);
        long.points.push((6.0, 1.0));
        let lines = vec![line("first", 0, 0.4), long, line("third", 2, 0.0)];
        let (linear_x, linear_y) = (true, true);
        let all = Chart { linear_x, linear_y, ..chart(lines) };
        let svg = all.svg(Width::Column).expect("a picture");
        let found = texts(&svg);
        let marks: Vec<(Vec<Place>, &Series)> = all
            .series
            .iter()
            .map(|series| {
                let [x, y] = all.axes().expect("axes");
                let (width, height) = all.size(Width::Column);
                let Layout { frame, .. } = all.layout([x, y], width, height);
                (series.covered(&frame, |p| all.shows(p)), series)
            })
            .collect();
        let mut named = 0;
        for (own, series) in &marks {
            let name = series.name.as_deref().expect("a name");
            let at = found.iter().find(|(text, _)| text == name).expect("its name").1;
            let half = f64::from(length(name)) / 2.0;
            let far = |places: &[Place]| {
                let of = |p: &Place| {
                    let x = ((f64::from(p.0) - at[0]).abs() - half).max(0.0);
                    x.hypot(((f64::from(p.1) - at[1]).abs() - f64::from(px(5))).max(0.0))
                };
                places.iter().map(of).fold(f64::INFINITY, f64::min)
            };
            // in a legend it is far from all
            if far(own) < f64::from(px(60)) {
                named += 1;
                for (other, _) in marks.iter().filter(|(_, other)| other.colour != series.colour) {
                    assert!(far(own) <= far(other) + f64::from(px(2)), "{name} {found:?}");
                }
            }
        }
        assert!(named > 0);
    }

    /// A legend never lies on an area or a column, and where it is inside the axes no line of the
    /// grid runs through its words.
    #[test]
    fn legends_lie_on_nothing() {
        let full = [(0.0, 0.0), (10.0, 0.0), (10.0, 10.0), (0.0, 10.0)];
        let mut all = chart(vec![series("all", 0, Stroke::Band, &full)]);
        (all.linear_x, all.linear_y) = (true, true);
        let svg = all.svg(Width::Page).expect("a picture");
        let found = texts(&svg);
        let y = |wanted: &str| found.iter().find(|(text, _)| text == wanted).expect(wanted).1[1];
        assert!(y("all") < f64::from(TOP + px(2)), "above the axes: {found:?}");
        let rectangles = |svg: &str| svg.matches("<rect").count();
        all.series[0].name = None;
        let bare = rectangles(&all.svg(Width::Page).expect("a picture"));
        assert_eq!(rectangles(&svg), bare);
        // half of it is free
        all.series =
            vec![series("low", 0, Stroke::Band, &full.map(|(x, y)| (x, y * (10.0 - x) / 10.0)))];
        let svg = all.svg(Width::Page).expect("a picture");
        let found = texts(&svg);
        let y = |wanted: &str| found.iter().find(|(text, _)| text == wanted).expect(wanted).1[1];
        assert!(y("low") > f64::from(TOP + px(2)), "in a corner: {found:?}");
        assert_eq!(rectangles(&svg), bare + 1, "the legend has a ground");
    }

    /// An axis of amounts has numbers up to its end, at least five of them, and no point beyond the
    /// last.
    #[test]
    fn axes_end_at_numbers() {
        for most in [0.83, 1.0, 5.1, 9.9, 26.0, 73.0, 1012.0] {
            let mut line = chart(vec![series("a", 0, Stroke::Line, &[(0.5, 0.0), (2.5, most)])]);
            (line.linear_x, line.linear_y) = (true, true);
            for width in [Width::Column, Width::Page] {
                let svg = line.svg(width).expect("a picture");
                let numbers = texts(&svg)
                    .into_iter()
                    .filter_map(|(text, [x, y])| Some((x, text.parse::<f64>().ok()?, y)));
                let numbers: Vec<(f64, f64, f64)> = numbers.collect();
                let beside = numbers.iter().map(|n| n.0).fold(f64::MAX, f64::min);
                let upright: Vec<f64> =
                    numbers.iter().filter(|n| n.0 == beside).map(|n| n.1).collect();
                let last = upright.iter().copied().fold(0.0, f64::max);
                assert!((5..=12).contains(&upright.len()), "{most}: {upright:?}");
                assert!(last >= most && last < 1.25 * most + 1e-9, "{most}: {upright:?}");
            }
        }
    }

    /// A level far below all points does not stretch the axis; the legend has its value. Lines that
    /// coincide differ in width.
    #[test]
    fn far_levels_and_lines_that_coincide() {
        let points = [(1.0, 0.2), (10.0, 0.1)];
        let lines =
            vec![series("a", 0, Stroke::Line, &points), series("b", 1, Stroke::Line, &points)];
        let mut two = chart(lines);
        two.levels = vec![("noise".into(), 0.05)];
        let near = two.svg(Width::Page).expect("a picture");
        assert!(near.contains("\nnoise\n"), "{near}");
        two.levels[0].1 = 1.234e-3;
        let far = two.svg(Width::Page).expect("a picture");
        assert!(far.contains("noise: 0.0012") && !far.contains("\n0.01\n"), "{far}");
        let wide = |svg: &str| svg.matches("stroke-width=\"10\"").count();
        assert_eq!(wide(&far), 1, "the first line");
        two.series[1].points[1].1 = 0.15;
        assert_eq!(wide(&two.svg(Width::Page).expect("a picture")), 0);
    }

    /// Lines that coincide from end to end have one label together, beside them or in a legend with the
    /// strokes of all; those that part have one each.
    #[test]
    fn lines_that_coincide_have_one_label() {
        let line = |name: &str, colour, end| {
            series(name, colour, Stroke::Line, &[(0.0, 1.0), (1.0, 3.0), (2.0, end)])
        };
        let names = |all: Vec<Series>| {
            let (linear_x, linear_y) = (true, true);
            let svg = Chart { linear_x, linear_y, ..chart(all) }.svg(Width::Page);
            let svg = svg.expect("a picture");
            let found = texts(&svg).into_iter().map(|(text, _)| text);
            let found: Vec<String> = found.filter(|text| text.contains("lamp")).collect();
            (found, svg)
        };
        let two = || vec![line("lamp 1", 0, 2.0), line("lamp 2", 1, 2.001)];
        assert_eq!(names(two()).0, ["lamp 1, lamp 2"]);
        assert_eq!(names(vec![line("lamp 1", 0, 2.0), line("lamp 2", 1, 2.5)]).0.len(), 2);
        let five = (0..5).map(|i| line(&format!("lamp {i}"), i, 2.0)).collect();
        assert_eq!(names(five).0, ["lamp 0, lamp 1, lamp 2 and 2 more"]);
        // no room beside the lines
        let full = [(0.0, 0.0), (2.0, 0.0), (2.0, 4.0), (0.0, 4.0)];
        let ground = Series { name: None, ..series("", 2, Stroke::Band, &full) };
        let (found, svg) = names([two(), vec![ground]].concat());
        assert_eq!(found, ["lamp 1, lamp 2"]);
        assert_eq!(svg.matches("<circle").count(), 4, "three points and the legend");
    }

    /// Light is never below 0, and so no axis goes there for a bar of its error.
    #[test]
    fn bars_take_no_axis_below_0() {
        let bars = [(1.0, -90.0), (1.0, 290.0)];
        let lowest = |values: &[(f64, f64)]| {
            let all = vec![
                Series { name: None, ..series("", 0, Stroke::Bars, &bars) },
                series("a", 0, Stroke::Marks, values),
            ];
            let all = Chart { linear_x: true, linear_y: true, ..chart(all) };
            *all.axes().expect("axes")[1].ends().start()
        };
        assert_eq!(lowest(&[(1.0, 100.0), (2.0, 200.0)]), 0.0);
        // what may be negative has bars on both sides of 0
        assert!(lowest(&[(1.0, 100.0), (2.0, -10.0)]) < -40.0);
    }

    /// A bar of error that is a hundred times as long as its value does not squeeze the others, and ends
    /// with the axis.
    #[test]
    fn long_bars_squeeze_nothing() {
        let bars = [(1.0, -990.0), (1.0, 1010.0), (2.0, 19.0), (2.0, 21.0)];
        let mut all = chart(vec![
            Series { name: None, ..series("", 0, Stroke::Bars, &bars) },
            series("a", 0, Stroke::Marks, &[(1.0, 10.0), (2.0, 20.0)]),
        ]);
        (all.linear_x, all.linear_y) = (true, true);
        let [_, y] = all.axes().expect("axes");
        assert!(*y.ends().start() >= -10.0 && *y.ends().end() <= 30.0, "{:?}", y.ends());
        let svg = all.svg(Width::Page).expect("a picture");
        let height = f64::from(Width::Page.height());
        let lines =
            svg.split("<polyline").skip(1).filter_map(|line| line.split("points=\"").nth(1));
        let ends = lines.flat_map(|line| line.split('"').next().unwrap_or_default().split(' '));
        let ys: Vec<f64> = ends.filter_map(|at| at.split(',').nth(1)?.parse().ok()).collect();
        assert!(!ys.is_empty() && ys.iter().all(|y| (0.0..=height).contains(y)), "{ys:?}");
    }

    /// Heights that are one, but for rounding, are no range: the axis begins at 0 and its numbers differ.
    /// The name of a mark is clear of the pale dots in line with it.
    #[test]
    fn one_height_is_no_range_and_names_are_clear_of_dots() {
        let dots: Vec<(f64, f64)> =
            (0..40).map(|i| (f64::from(i), 0.05 + 1e-17 * f64::from(i % 2))).collect();
        let mut all = chart(vec![
            Series { name: None, ..series("", 0, Stroke::Dots, &dots) },
            series("sensors", 0, Stroke::Line, &[(20.0, 0.05)]),
        ]);
        (all.linear_x, all.linear_y, all.amounts_across) = (true, true, true);
        let [_, y] = all.axes().expect("axes");
        assert!(*y.ends().start() == 0.0 && *y.ends().end() > 0.05, "{:?}", y.ends());
        let svg = all.svg(Width::Page).expect("a picture");
        let found = texts(&svg);
        assert!(found.iter().filter(|(text, _)| text == "0.05").count() <= 1, "{found:?}");
        let at = found.iter().find(|(text, _)| text == "sensors").expect("its name").1;
        let half = f64::from(length("sensors")) / 2.0;
        let marks = svg.split("<circle").skip(1).map(|tag| {
            ["cx", "cy"].map(|name| -> f64 {
                let (_, rest) = tag.split_once(&format!(" {name}=\"")).expect(name);
                rest.split('"').next().and_then(|n| n.parse().ok()).expect(name)
            })
        });
        let on = |mark: &[f64; 2]| {
            (mark[0] - at[0]).abs() < half && (mark[1] - at[1]).abs() < f64::from(px(5))
        };
        assert_eq!(marks.filter(on).count(), 0, "{at:?}");
    }

    /// A legend that needs more rows than there is room for makes a chart higher, so that its axes
    /// stay as high as they were.
    #[test]
    fn a_long_legend_makes_a_chart_higher() {
        let height = |count: usize| {
            let name = |i: usize| format!("a method with a rather long name {i}");
            let ends = |i: usize| [(1.0, 1.0 + i as f64), (2.0, 2.0 + i as f64)];
            let line = |i: usize| series(&name(i), i, Stroke::Plain, &ends(i));
            chart((0..count).map(line).collect()).size(Width::Column).1
        };
        assert_eq!(height(1), Width::Column.height());
        assert!(height(12) > Width::Column.height() + 8 * ROW, "{}", height(12));
    }
}
