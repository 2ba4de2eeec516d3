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
    element::{Circle, PathElement, Text},
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
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
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
        let (plot, legend) = area.split_horizontally(PLOT);
        let shown: Vec<Series> = self.series.iter().map(|series| self.visible(series)).collect();
        let points = || shown.iter().flat_map(|series| &series.points);
        let levels = self.levels.iter().map(|(_, y)| *y).filter(|y| *y > 0.0 && y.is_finite());
        match (span(points().map(|p| p.0)), span(points().map(|p| p.1).chain(levels))) {
            (Some(x), Some(y)) => {
                let room = || x.start..x.end * 1.02 + 1e-9;
                match (self.linear_x, self.linear_y) {
                    (_, true) => self.plot(&plot, &shown, spacious(x, 0.3), spacious(y, 0.5))?,
                    (true, _) => self.plot(&plot, &shown, room(), roomy(y).log_scale())?,
                    _ => self.plot(&plot, &shown, roomy(x).log_scale(), roomy(y).log_scale())?,
                }
                self.draw_legend(&legend)?;
            }
            _ => {
                let note =
                    Text::new(format!("{}: nothing to draw", self.title), (40, 40), font(16));
                area.draw(&note)?;
            }
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

    fn plot<D: Backend, X, Y>(
        &self,
        area: &Area<D>,
        shown: &[Series],
        x: impl AsRangedCoord<CoordDescType = X, Value = f64>,
        y: impl AsRangedCoord<CoordDescType = Y, Value = f64>,
    ) -> Result<(), Failure>
    where
        X: Ranged<ValueType = f64> + ValueFormatter<f64>,
        Y: Ranged<ValueType = f64> + ValueFormatter<f64>,
    {
        let mut builder = ChartBuilder::on(area);
        builder.caption(&self.title, font(18)).margin(14);
        builder.x_label_area_size(48).y_label_area_size(72);
        let mut chart = builder.build_cartesian_2d(x, y)?;
        let mut mesh = chart.configure_mesh();
        mesh.x_desc(&self.x).y_desc(&self.y).label_style(font(13)).axis_desc_style(font(14));
        mesh.x_label_formatter(&|v| tick(*v)).y_label_formatter(&|v| tick(*v));
        mesh.bold_line_style(BLACK.mix(0.15)).light_line_style(BLACK.mix(0.04)).draw()?;

        self.draw_levels(&mut chart)?;
        for series in shown {
            draw_series(&mut chart, series)?;
        }
        Ok(())
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

    /// Draws the legend: names beside strokes, in an area of their own, so that they hide nothing.
    fn draw_legend<D: Backend>(&self, area: &Area<D>) -> Result<(), Failure> {
        let series = self.series.iter().filter_map(|series| {
            Some((series.name.as_ref()?, series.colour(), series.stroke == Stroke::Dashed))
        });
        let levels = self.levels.iter().map(|(name, _)| (name, LEVEL, true));
        for (i, (name, colour, dashed)) in series.chain(levels).enumerate() {
            let y = 60 + 22 * i as i32;
            let style = ShapeStyle::from(&colour).stroke_width(2);
            for (from, to) in if dashed { vec![(0, 7), (12, 19)] } else { vec![(0, 19)] } {
                area.draw(&PathElement::new(vec![(from, y), (to, y)], style))?;
            }
            area.draw(&Text::new(name.as_str(), (26, y - 6), font(13)))?;
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
