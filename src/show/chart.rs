//! Charts: draws rows of numbers as lines, dots and bars on logarithmic or linear axes (plotters),
//! as SVG or on any other backend of plotters.

use std::ops::Range;

use plotters::{
    chart::{ChartBuilder, ChartContext},
    coord::{
        Shift,
        combinators::IntoLogRange,
        ranged1d::{AsRangedCoord, Ranged, ValueFormatter},
    },
    element::{Circle, PathElement, Rectangle, Text},
    prelude::{
        Cartesian2d, Color, DrawingArea, DrawingBackend, IntoDrawingArea, RGBColor, SVGBackend,
        ShapeStyle,
    },
    series::{DashedLineSeries, LineSeries},
    style::{BLACK, IntoFont, WHITE},
};

use super::xml::allowed;

/// Width and height of a chart, pixels.
pub(super) const SIZE: (u32, u32) = (860, 480);
/// Width of the part to the left of the legend, pixels.
const PLOT: i32 = 640;
/// Height of the title above a chart, and width of the numbers to the left of it, pixels.
const TOP: i32 = 44;
const LEFT: u32 = 72;
/// Height of a line of the legend, pixels, and the limit on the number of lines that are inside.
const ROW: i32 = 20;
const MOST_INSIDE: usize = 8;
/// Colour of horizontal lines.
const LEVEL: RGBColor = RGBColor(130, 130, 130);
/// Colours that colour-blind readers can tell apart (Okabe and Ito 2008).
const COLOURS: [RGBColor; 7] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(230, 159, 0),
    RGBColor(86, 180, 233),
    RGBColor(90, 90, 90),
];

/// A chart.
#[derive(Clone, Debug, Default)]
pub struct Chart {
    /// The title above the chart.
    pub title: String,
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
    /// Names of places on the x axis, in place of numbers.
    pub x_names: Vec<(f64, String)>,
    /// The series, in the order in which they are drawn.
    pub series: Vec<Series>,
    /// Horizontal lines: their meaning and their y.
    pub levels: Vec<(String, f64)>,
}

/// Points that are drawn in one colour and style.
#[derive(Clone, Debug)]
pub struct Series {
    /// The name in the legend; a series without a name is not in it.
    pub name: Option<String>,
    /// Index of the colour.
    pub colour: usize,
    /// The style in which it is drawn.
    pub stroke: Stroke,
    /// Points (x, y). Points that an axis cannot show are left out.
    pub points: Vec<(f64, f64)>,
}

impl Series {
    /// The colour of series that only guide the eye.
    pub const GREY: usize = COLOURS.len() - 1;

    fn colour(&self) -> RGBColor {
        COLOURS[self.colour % COLOURS.len()]
    }
}

/// The style in which a series is drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Stroke {
    /// A line with a mark at each point.
    Line,
    /// A line alone.
    Plain,
    /// A mark at each point.
    Marks,
    /// A dashed line.
    Dashed,
    /// Small pale dots.
    Dots,
    /// A bar between the two points of each pair.
    Bars,
    /// A column from 0 to each point.
    Columns {
        /// The width in units of the x axis.
        width: f64,
        /// Whether the colour is pale.
        pale: bool,
    },
}

/// The reason why a backend could not draw.
pub(super) type Failure = Box<dyn std::error::Error>;
/// A part of a picture.
pub(super) type Area<D> = DrawingArea<D, Shift>;

/// A backend of plotters whose errors can be reported.
pub(super) trait Backend: DrawingBackend<ErrorType: 'static> {}
impl<D: DrawingBackend<ErrorType: 'static>> Backend for D {}

impl Chart {
    /// Returns the chart as SVG text; where there is nothing to draw, the chart says so. Errors:
    /// none that input can cause.
    pub fn svg(&self) -> Result<String, String> {
        let mut text = String::new();
        let area = SVGBackend::with_string(&mut text, SIZE).into_drawing_area();
        let drawn = area.fill(&WHITE).map_err(Failure::from).and_then(|()| self.draw(&area));
        let done = drawn.and_then(|()| Ok(area.present()?));
        drop(area);
        done.map(|()| allowed(&text).into_owned()).map_err(|e| e.to_string())
    }

    /// Draws the chart on an area.
    pub(super) fn draw<D: Backend>(&self, area: &Area<D>) -> Result<(), Failure> {
        let shown: Vec<Series> = self.series.iter().map(|series| self.visible(series)).collect();
        let points = || shown.iter().flat_map(|series| &series.points);
        let levels = self.levels.iter().map(|(_, y)| *y).filter(|y| *y > 0.0 && y.is_finite());
        let spans = (span(points().map(|p| p.0)), span(points().map(|p| p.1).chain(levels)));
        let (Some(x), Some(y)) = spans else {
            let note = Text::new(format!("{}: nothing to draw", self.title), (40, 40), font(16));
            return Ok(area.draw(&note)?);
        };
        let plot = |area: &Area<D>, inside: bool| {
            let (x, y) = (x.clone(), y.clone());
            let room = x.start..x.end * 1.02 + 1e-9;
            // amounts begin at 0, so that lengths compare as the amounts do
            let shares = if self.amounts_across { (1.0, 0.5) } else { (0.3, 1.0) };
            let linear = (spacious(x.clone(), shares.0), spacious(y.clone(), shares.1));
            match (self.linear_x, self.linear_y) {
                (_, true) => self.plot(area, &shown, linear.0, linear.1, inside),
                (true, _) => self.plot(area, &shown, room, roomy(y).log_scale(), inside),
                _ => self.plot(area, &shown, roomy(x).log_scale(), roomy(y).log_scale(), inside),
            }
        };
        if !plot(area, true)? {
            let (left, right) = area.split_horizontally(PLOT);
            plot(&left, false)?;
            self.draw_legend(&right, (0, TOP + 16))?;
        }
        Ok(())
    }

    /// Returns the series without the points that the axes cannot show.
    fn visible(&self, series: &Series) -> Series {
        let fits = |&&(x, y): &&(f64, f64)| {
            x.is_finite()
                && y.is_finite()
                && (self.linear_y || y > 0.0 && (self.linear_x || x > 0.0))
        };
        Series { points: series.points.iter().filter(fits).copied().collect(), ..series.clone() }
    }

    /// Draws the chart with its legend inside, if that is wanted; returns false, and draws nothing,
    /// if there is no room for the legend.
    fn plot<D: Backend, X, Y>(
        &self,
        area: &Area<D>,
        shown: &[Series],
        x: impl AsRangedCoord<CoordDescType = X, Value = f64>,
        y: impl AsRangedCoord<CoordDescType = Y, Value = f64>,
        inside: bool,
    ) -> Result<bool, Failure>
    where
        X: Ranged<ValueType = f64> + ValueFormatter<f64>,
        Y: Ranged<ValueType = f64> + ValueFormatter<f64>,
    {
        let mut builder = ChartBuilder::on(area);
        builder.margin(14).margin_top(TOP).x_label_area_size(48).y_label_area_size(LEFT);
        let mut chart = builder.build_cartesian_2d(x, y)?;
        let legend = match inside {
            true => self.room_for_legend(area, &chart, shown),
            false => None,
        };
        if inside && legend.is_none() && !self.entries().is_empty() {
            return Ok(false);
        }
        area.draw(&Text::new(self.title.as_str(), (LEFT as i32 + 14, 12), font(17)))?;
        let mut mesh = chart.configure_mesh();
        mesh.x_desc(&self.x).y_desc(&self.y).label_style(font(13)).axis_desc_style(font(14));
        let x_tick = |v: &f64| if self.x_names.is_empty() { tick(*v) } else { String::new() };
        mesh.x_label_formatter(&x_tick).y_label_formatter(&|v| tick(*v));
        if !self.x_names.is_empty() {
            mesh.disable_x_mesh();
        }
        // no lines between those that have numbers
        mesh.bold_line_style(BLACK.mix(0.12)).light_line_style(BLACK.mix(0.0)).draw()?;
        self.draw_x_names(area, &chart)?;
        self.draw_levels(&mut chart)?;
        for series in shown {
            draw_series(&mut chart, series)?;
        }
        if let Some((x, y)) = legend {
            let [width, height] = self.size_of_legend();
            let paper = [(x - 6, y - 12), (x - 6 + width, y - 12 + height)];
            area.draw(&Rectangle::new(paper, WHITE.mix(0.85).filled()))?;
            self.draw_legend(area, (x, y))?;
        }
        Ok(true)
    }

    /// Draws the names of places on the x axis.
    fn draw_x_names<D: Backend, X, Y>(
        &self,
        area: &Area<D>,
        chart: &ChartContext<D, Cartesian2d<X, Y>>,
    ) -> Result<(), Failure>
    where
        X: Ranged<ValueType = f64>,
        Y: Ranged<ValueType = f64>,
    {
        let (left, top) = area.get_base_pixel();
        for (x, name) in &self.x_names {
            let at = chart.backend_coord(&(*x, chart.y_range().start));
            let start = at.0 - left - 7 * name.chars().count() as i32 / 2;
            area.draw(&Text::new(name.as_str(), (start, at.1 - top + 8), font(13)))?;
        }
        Ok(())
    }

    /// Returns the place of the legend's first line in a corner where nothing is drawn, if there is
    /// one.
    fn room_for_legend<D: Backend, X, Y>(
        &self,
        area: &Area<D>,
        chart: &ChartContext<D, Cartesian2d<X, Y>>,
        shown: &[Series],
    ) -> Option<(i32, i32)>
    where
        X: Ranged<ValueType = f64>,
        Y: Ranged<ValueType = f64>,
    {
        let (left, top) = area.get_base_pixel();
        let place = |p: (f64, f64)| {
            let (x, y) = chart.backend_coord(&p);
            (x - left, y - top)
        };
        let mut drawn: Vec<(i32, i32)> = Vec::new();
        let mut join = |from: (i32, i32), to: (i32, i32)| {
            let steps = (to.0 - from.0).abs().max((to.1 - from.1).abs()) / 4 + 1;
            let at = |from: i32, to: i32, i: i32| from + (to - from) * i / steps;
            drawn.extend((0..=steps).map(|i| (at(from.0, to.0, i), at(from.1, to.1, i))));
        };
        for series in shown {
            let points: Vec<(i32, i32)> = series.points.iter().map(|&p| place(p)).collect();
            match series.stroke {
                Stroke::Bars => points.chunks_exact(2).for_each(|ends| join(ends[0], ends[1])),
                Stroke::Columns { .. } => {
                    for (&(x, _), &at) in series.points.iter().zip(&points) {
                        join(at, place((x, 0.0)));
                    }
                }
                Stroke::Marks | Stroke::Dots => points.iter().for_each(|&at| join(at, at)),
                _ => points.windows(2).for_each(|ends| join(ends[0], ends[1])),
            }
        }
        let ends = chart.x_range();
        for (_, y) in self.levels.iter().filter(|(_, y)| *y > 0.0 && y.is_finite()) {
            join(place((ends.start, *y)), place((ends.end, *y)));
        }
        let (across, down) = chart.plotting_area().get_pixel_range();
        let [width, height] = self.size_of_legend();
        let (right, bottom) = (across.end - left - width - 4, down.end - top - height - 8);
        let (first, highest) = (across.start - left + 12, down.start - top + 8);
        let places = [(right, highest), (first, highest), (right, bottom), (first, bottom)];
        let is_free = |&(x, y): &(i32, i32)| {
            let inside = |p: &(i32, i32)| {
                (x - 8..x + width + 4).contains(&p.0) && (y - 4..y + height + 4).contains(&p.1)
            };
            !drawn.iter().any(inside)
        };
        let fits = right > first && bottom > highest && self.entries().len() <= MOST_INSIDE;
        places.into_iter().find(is_free).filter(|_| fits).map(|(x, y)| (x + 6, y + 12))
    }

    /// Returns the width and height of the legend, pixels.
    fn size_of_legend(&self) -> [i32; 2] {
        let entries = self.entries();
        let longest = entries.iter().map(|(name, ..)| name.chars().count()).max().unwrap_or(0);
        [40 + 8 * longest as i32, ROW * entries.len() as i32 + 4]
    }

    fn draw_levels<D: Backend, X, Y>(
        &self,
        chart: &mut ChartContext<D, Cartesian2d<X, Y>>,
    ) -> Result<(), Failure>
    where
        X: Ranged<ValueType = f64>,
        Y: Ranged<ValueType = f64>,
    {
        let Range { start, end } = chart.x_range();
        for (_, y) in self.levels.iter().filter(|(_, y)| *y > 0.0 && y.is_finite()) {
            let line = DashedLineSeries::new([(start, *y), (end, *y)], 2, 4, LEVEL.into());
            chart.draw_series(line)?;
        }
        Ok(())
    }

    /// Returns what the legend has: names, and the colour of their strokes and whether they are
    /// dashed.
    fn entries(&self) -> Vec<(&str, RGBColor, bool)> {
        let series = self.series.iter().filter_map(|series| {
            Some((series.name.as_deref()?, series.colour(), series.stroke == Stroke::Dashed))
        });
        let levels = self.levels.iter().map(|(name, _)| (name.as_str(), LEVEL, true));
        series.chain(levels).collect()
    }

    /// Draws the legend: names beside strokes.
    fn draw_legend<D: Backend>(&self, area: &Area<D>, at: (i32, i32)) -> Result<(), Failure> {
        for (i, (name, colour, dashed)) in self.entries().into_iter().enumerate() {
            let (x, y) = (at.0, at.1 + ROW * i as i32);
            let style = ShapeStyle::from(&colour).stroke_width(2);
            for (from, to) in if dashed { vec![(0, 7), (12, 19)] } else { vec![(0, 19)] } {
                area.draw(&PathElement::new(vec![(x + from, y), (x + to, y)], style))?;
            }
            area.draw(&Text::new(name, (x + 26, y - 6), font(13)))?;
        }
        Ok(())
    }
}

fn draw_series<D: Backend, X, Y>(
    chart: &mut ChartContext<D, Cartesian2d<X, Y>>,
    series: &Series,
) -> Result<(), Failure>
where
    X: Ranged<ValueType = f64>,
    Y: Ranged<ValueType = f64>,
{
    let colour = series.colour();
    let points = || series.points.iter().copied();
    let stroke = ShapeStyle::from(&colour).stroke_width(2);
    match series.stroke {
        Stroke::Line | Stroke::Marks => {
            let marks = points().map(|p| Circle::new(p, 3, colour.filled()));
            chart.draw_series(marks)?;
            if series.stroke == Stroke::Line {
                chart.draw_series(LineSeries::new(points(), stroke))?;
            }
        }
        Stroke::Plain => {
            chart.draw_series(LineSeries::new(points(), stroke))?;
        }
        Stroke::Dashed => {
            chart.draw_series(DashedLineSeries::new(points(), 6, 5, stroke))?;
        }
        Stroke::Bars => {
            let bars = series.points.chunks_exact(2);
            chart.draw_series(bars.map(|bar| PathElement::new(bar.to_vec(), stroke)))?;
        }
        Stroke::Columns { width, pale } => {
            let paint = if pale { colour.mix(0.4) } else { colour.mix(0.85) };
            let column = |(x, y): (f64, f64)| {
                Rectangle::new([(x - width / 2.0, 0.0), (x + width / 2.0, y)], paint.filled())
            };
            chart.draw_series(points().map(column))?;
        }
        Stroke::Dots => {
            let pale = colour.mix(0.35).filled();
            chart.draw_series(points().map(|p| Circle::new(p, 2, pale)))?;
        }
    }
    Ok(())
}

pub(super) fn font(size: u32) -> plotters::style::FontDesc<'static> {
    ("sans-serif", size).into_font()
}

/// Returns the range from the least to the greatest value; `None` without values.
fn span(values: impl Iterator<Item = f64>) -> Option<Range<f64>> {
    values.fold(None, |span, v| {
        let (low, high) = span.map_or((v, v), |Range { start, end }| (v.min(start), v.max(end)));
        Some(low..high)
    })
}

/// Widens a range on a logarithmic axis to leave some room around it.
fn roomy(range: Range<f64>) -> Range<f64> {
    range.start / 1.4..range.end * 1.6
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

/// Formats a number at an axis.
pub(super) fn tick(value: f64) -> String {
    match value.abs() {
        0.0 => "0".into(),
        v if (1e-3..1e5).contains(&v) => format!("{}", (value * 1e6).round() / 1e6),
        _ => format!("{value:e}"),
    }
}
