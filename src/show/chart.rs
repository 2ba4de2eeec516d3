//! Charts: draws rows of numbers as lines, dots and bars on logarithmic or linear axes (plotters),
//! as SVG in the sizes of printed columns. All plots have the style of this file.

use std::ops::Range;

use plotters::{
    chart::{ChartBuilder, ChartContext},
    coord::{
        Shift,
        combinators::IntoLogRange,
        ranged1d::{AsRangedCoord, Ranged, ValueFormatter},
    },
    element::{Circle, PathElement, Polygon, Rectangle, Text},
    prelude::{
        Cartesian2d, Color, DrawingArea, IntoDrawingArea, RGBColor, SVGBackend, ShapeStyle,
        TextStyle,
    },
    series::{DashedLineSeries, LineSeries},
    style::{
        BLACK, FontDesc, FontFamily, FontStyle, WHITE,
        text_anchor::{HPos, Pos, VPos},
    },
};

use super::xml::allowed;

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
    pub(super) fn units(self) -> i32 {
        match self {
            Self::Column => px(336),
            Self::Page => px(672),
        }
    }

    /// Returns the height of a chart in layout units.
    fn height(self) -> i32 {
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
pub(super) const fn px(pixels: i32) -> i32 {
    UNITS * pixels
}

/// Height of the title above a chart, and width of the numbers to the left of it.
const TOP: i32 = px(34);
const LEFT: i32 = px(58);
/// Height of a line of the legend, and the limit on the number of lines that are inside.
const ROW: i32 = px(15);
const MOST_INSIDE: usize = 8;
/// Length of a stroke in the legend, and the distance from its start to the name.
const SWATCH: i32 = px(18);
const NAME: i32 = px(23);
/// Sizes of the letters of numbers and labels, and of titles: 8 and 9 points in print.
pub(super) const SMALL: i32 = px(11);
pub(super) const LARGE: i32 = px(12);
/// Width of the lines of series.
const LINE: u32 = px(1) as u32 * 3 / 2;
/// Radii of marks, and of pale dots.
const MARK: i32 = px(5) / 2;
const DOT: i32 = px(3) / 2;
/// The letters: those that journals ask for.
const LETTERS: &str = "Arial, Helvetica, sans-serif";
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
    /// Ends of the x axis where both axes are linear, if they are not those of what is drawn.
    pub x_ends: Option<[f64; 2]>,
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
    /// A pale area with these corners.
    Band,
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
pub(super) type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;

/// Returns what `draw` draws on white paper of this width and height in layout units, as SVG text
/// that says how large it is in print.
pub(super) fn drawn(
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

impl Chart {
    /// Returns the chart as SVG text; where there is nothing to draw, the chart says so. Errors:
    /// none that input can cause.
    pub fn svg(&self, width: Width) -> Result<String, String> {
        drawn(Self::size(width), |area| self.draw(area)).map_err(|e| e.to_string())
    }

    /// Returns the width and height of a chart in layout units.
    pub(super) fn size(width: Width) -> (i32, i32) {
        (width.units(), width.height())
    }

    /// Draws the chart on an area.
    pub(super) fn draw(&self, area: &Area) -> Result<(), Failure> {
        let shown: Vec<Series> = self.series.iter().map(|series| self.visible(series)).collect();
        let points = || shown.iter().flat_map(|series| &series.points);
        let levels = self.levels.iter().map(|(_, y)| *y).filter(|y| *y > 0.0 && y.is_finite());
        let spans = (span(points().map(|p| p.0)), span(points().map(|p| p.1).chain(levels)));
        let (Some(x), Some(y)) = spans else {
            let note = format!("{}: nothing to draw", self.title);
            return Ok(area.draw(&Text::new(note, (px(40), px(40)), font(LARGE)))?);
        };
        let plot = |inside: bool| {
            let (x, y) = (x.clone(), y.clone());
            let room = x.start..x.end * 1.02 + 1e-9;
            // amounts begin at 0, so that lengths compare as the amounts do
            let shares = if self.amounts_across { (1.0, 0.5) } else { (0.3, 1.0) };
            let across = self.x_ends.map_or(spacious(x.clone(), shares.0), |[a, b]| a..b);
            let linear = (across, spacious(y.clone(), shares.1));
            match (self.linear_x, self.linear_y) {
                (_, true) => self.plot(area, &shown, linear.0, linear.1, inside),
                (true, _) => self.plot(area, &shown, room, roomy(y).log_scale(), inside),
                _ => self.plot(area, &shown, roomy(x).log_scale(), roomy(y).log_scale(), inside),
            }
        };
        if !plot(true)? {
            plot(false)?;
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

    /// Draws the chart with its legend inside, or else between the title and the axes; returns
    /// false, and draws nothing, if there is no room for the legend inside.
    fn plot<X, Y>(
        &self,
        area: &Area,
        shown: &[Series],
        x: impl AsRangedCoord<CoordDescType = X, Value = f64>,
        y: impl AsRangedCoord<CoordDescType = Y, Value = f64>,
        inside: bool,
    ) -> Result<bool, Failure>
    where
        X: Ranged<ValueType = f64> + ValueFormatter<f64>,
        Y: Ranged<ValueType = f64> + ValueFormatter<f64>,
    {
        let (width, _) = area.dim_in_pixel();
        let above = if inside { Vec::new() } else { self.rows_above(width as i32 - LEFT - px(20)) };
        let top = TOP + above.last().map_or(0, |(_, (_, y))| y + ROW);
        let mut builder = ChartBuilder::on(area);
        builder.margin(px(10)).margin_top(top);
        builder.x_label_area_size(px(40)).y_label_area_size(LEFT - px(10));
        let mut chart = builder.build_cartesian_2d(x, y)?;
        let legend = match inside {
            true => self.room_for_legend(area, &chart, shown),
            false => None,
        };
        if inside && legend.is_none() && !self.entries().is_empty() {
            return Ok(false);
        }
        area.draw(&Text::new(self.title.as_str(), (LEFT, px(10)), font(LARGE)))?;
        let mut mesh = chart.configure_mesh();
        mesh.x_desc(&self.x).y_desc(&self.y).label_style(font(SMALL)).axis_desc_style(font(SMALL));
        mesh.x_label_formatter(&|v| tick(*v)).y_label_formatter(&|v| tick(*v)).y_labels(6);
        mesh.x_labels(match self.x_names.is_empty() {
            false => 0,
            true if width < px(500) as u32 => 5,
            true => 9,
        });
        mesh.axis_style(BLACK.stroke_width(px(1) as u32)).set_all_tick_mark_size(px(4));
        // pale lines at the numbers of the y axis alone
        mesh.disable_x_mesh().light_line_style(BLACK.mix(0.0));
        mesh.bold_line_style(BLACK.mix(0.1).stroke_width(px(1) as u32)).draw()?;
        self.draw_x_names(area, &chart)?;
        self.draw_levels(&mut chart)?;
        // areas lie below all lines
        let (bands, others): (Vec<_>, Vec<_>) =
            shown.iter().partition(|series| series.stroke == Stroke::Band);
        bands.into_iter().chain(others).try_for_each(|series| draw_series(&mut chart, series))?;
        if let Some((x, y)) = legend {
            let [width, height] = self.size_of_legend();
            let corner = (x - px(6), y - px(9));
            let paper = [corner, (corner.0 + width, corner.1 + height)];
            area.draw(&Rectangle::new(paper, WHITE.mix(0.85).filled()))?;
            let entries = self.entries();
            for (i, entry) in entries.iter().enumerate() {
                draw_entry(area, entry, (x, y + ROW * i as i32))?;
            }
        }
        let entries = self.entries();
        for (i, (x, y)) in above {
            draw_entry(area, &entries[i], (LEFT + x, TOP - px(2) + y))?;
        }
        Ok(true)
    }

    /// Arranges the entries of the legend in rows of this width: their indices, and how far right
    /// and down they are.
    fn rows_above(&self, width: i32) -> Vec<(usize, (i32, i32))> {
        let (mut x, mut y) = (0, 0);
        let mut rows = Vec::new();
        for (i, (name, ..)) in self.entries().into_iter().enumerate() {
            let own = NAME + length(name) + px(14);
            if x > 0 && x + own > width {
                (x, y) = (0, y + ROW);
            }
            rows.push((i, (x, y)));
            x += own;
        }
        rows
    }

    /// Draws the names of places on the x axis, each with its tick.
    fn draw_x_names<X, Y>(
        &self,
        area: &Area,
        chart: &ChartContext<SVGBackend, Cartesian2d<X, Y>>,
    ) -> Result<(), Failure>
    where
        X: Ranged<ValueType = f64>,
        Y: Ranged<ValueType = f64>,
    {
        let (left, top) = area.get_base_pixel();
        let style = font(SMALL).pos(Pos::new(HPos::Center, VPos::Top));
        for (x, name) in &self.x_names {
            let at = chart.backend_coord(&(*x, chart.y_range().start));
            let (x, y) = (at.0 - left, at.1 - top);
            let tick = BLACK.stroke_width(px(1) as u32);
            area.draw(&PathElement::new(vec![(x, y), (x, y + px(4))], tick))?;
            area.draw(&Text::new(name.as_str(), (x, y + px(7)), style.clone()))?;
        }
        Ok(())
    }

    /// Returns the place of the legend's first line in a corner where nothing is drawn, if there is
    /// one.
    fn room_for_legend<X, Y>(
        &self,
        area: &Area,
        chart: &ChartContext<SVGBackend, Cartesian2d<X, Y>>,
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
            let steps = (to.0 - from.0).abs().max((to.1 - from.1).abs()) / px(4) + 1;
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
        let (right, bottom) = (across.end - left - width - px(4), down.end - top - height - px(8));
        let (first, highest) = (across.start - left + px(12), down.start - top + px(4));
        let places = [(right, highest), (first, highest), (right, bottom), (first, bottom)];
        let is_free = |&(x, y): &(i32, i32)| {
            let inside = |p: &(i32, i32)| {
                (x - px(6)..x + width + px(4)).contains(&p.0)
                    && (y - px(4)..y + height + px(4)).contains(&p.1)
            };
            !drawn.iter().any(inside)
        };
        let fits = right > first && bottom > highest && self.entries().len() <= MOST_INSIDE;
        places.into_iter().find(is_free).filter(|_| fits).map(|(x, y)| (x + px(6), y + px(9)))
    }

    /// Returns the width and height of the legend.
    fn size_of_legend(&self) -> [i32; 2] {
        let entries = self.entries();
        let longest = entries.iter().map(|(name, ..)| length(name)).max().unwrap_or(0);
        [NAME + longest + px(12), ROW * entries.len() as i32 + px(3)]
    }

    fn draw_levels<X, Y>(
        &self,
        chart: &mut ChartContext<SVGBackend, Cartesian2d<X, Y>>,
    ) -> Result<(), Failure>
    where
        X: Ranged<ValueType = f64>,
        Y: Ranged<ValueType = f64>,
    {
        let Range { start, end } = chart.x_range();
        for (_, y) in self.levels.iter().filter(|(_, y)| *y > 0.0 && y.is_finite()) {
            let line = DashedLineSeries::new(
                [(start, *y), (end, *y)],
                px(2),
                px(3),
                LEVEL.stroke_width(px(1) as u32),
            );
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
}

/// Draws an entry of a legend: a name beside a stroke in its colour, which may be dashed.
fn draw_entry(
    area: &Area,
    (name, colour, dashed): &(&str, RGBColor, bool),
    (x, y): (i32, i32),
) -> Result<(), Failure> {
    let style = ShapeStyle::from(colour).stroke_width(LINE);
    let third = SWATCH / 5;
    let parts = if *dashed { vec![(0, 2 * third), (3 * third, SWATCH)] } else { vec![(0, SWATCH)] };
    for (from, to) in parts {
        area.draw(&PathElement::new(vec![(x + from, y), (x + to, y)], style))?;
    }
    let beside = font(SMALL).pos(Pos::new(HPos::Left, VPos::Center));
    Ok(area.draw(&Text::new(*name, (x + NAME, y), beside))?)
}

fn draw_series<X, Y>(
    chart: &mut ChartContext<SVGBackend, Cartesian2d<X, Y>>,
    series: &Series,
) -> Result<(), Failure>
where
    X: Ranged<ValueType = f64>,
    Y: Ranged<ValueType = f64>,
{
    let colour = series.colour();
    let points = || series.points.iter().copied();
    let stroke = ShapeStyle::from(&colour).stroke_width(LINE);
    match series.stroke {
        Stroke::Line | Stroke::Marks => {
            let marks = points().map(|p| Circle::new(p, MARK, colour.filled()));
            chart.draw_series(marks)?;
            if series.stroke == Stroke::Line {
                chart.draw_series(LineSeries::new(points(), stroke))?;
            }
        }
        Stroke::Plain => {
            chart.draw_series(LineSeries::new(points(), stroke))?;
        }
        Stroke::Dashed => {
            chart.draw_series(DashedLineSeries::new(points(), px(5), px(4), stroke))?;
        }
        Stroke::Bars => {
            let bars = series.points.chunks_exact(2);
            chart.draw_series(bars.map(|bar| PathElement::new(bar.to_vec(), stroke)))?;
        }
        Stroke::Band => {
            chart.draw_series([Polygon::new(series.points.clone(), colour.mix(0.15))])?;
        }
        Stroke::Columns { width, pale } => {
            // opaque: no line of the grid shows through
            let paint = on_paper(colour, if pale { 0.4 } else { 0.85 });
            let column = |(x, y): (f64, f64)| {
                Rectangle::new([(x - width / 2.0, 0.0), (x + width / 2.0, y)], paint.filled())
            };
            chart.draw_series(points().map(column))?;
        }
        Stroke::Dots => {
            let pale = colour.mix(0.35).filled();
            chart.draw_series(points().map(|p| Circle::new(p, DOT, pale)))?;
        }
    }
    Ok(())
}

/// Returns the colour of a part of some ink on white paper.
fn on_paper(RGBColor(r, g, b): RGBColor, part: f64) -> RGBColor {
    let mixed = |ink: u8| (part * f64::from(ink) + (1.0 - part) * 255.0).round() as u8;
    RGBColor(mixed(r), mixed(g), mixed(b))
}

/// Returns letters whose capitals and accents fit into `size` layout units.
pub(super) fn font(size: i32) -> TextStyle<'static> {
    // the backend writes font sizes as if they contained the space between lines
    let size = f64::from(size) * 1.24;
    FontDesc::new(FontFamily::Name(LETTERS), size, FontStyle::Normal).into()
}

/// Returns about how long a text of small letters is.
pub(super) fn length(text: &str) -> i32 {
    text.chars().count() as i32 * SMALL * 53 / 100
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
