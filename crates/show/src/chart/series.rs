//! The series of charts: the styles that they are drawn in, on axes and in a legend.

use plotters::{
    element::{Circle, DashedPathElement, PathElement, Polygon, Rectangle, Text},
    prelude::{Color, RGBColor, ShapeStyle},
    style::{
        WHITE,
        text_anchor::{HPos, VPos},
    },
};

use super::{
    axes::Frame,
    paper::{Area, Failure, Place, hairline, line, on_paper, px, small},
};

/// Width of the lines of series.
const LINE: u32 = px(1) as u32 * 3 / 2;
/// Radii of marks, and of pale dots.
const MARK: i32 = px(5) / 2;
const DOT: i32 = px(3) / 2;
/// The number of kinds of marks, which has no factor in common with that of colours.
const MARKS: usize = 5;
/// Lengths of dashes and of the gaps between them, of series and of horizontal lines.
const DASHES: (i32, i32) = (px(5), px(4));
const DOTTED: (i32, i32) = (px(2), px(3));
/// Half the length of the ends of whiskers.
const WHISKER: i32 = px(2);
/// Length of a stroke in a legend, and the distance from its start to the name.
const SWATCH: i32 = px(18);
pub(super) const NAME: i32 = px(23);
/// Colour of horizontal lines.
const LEVEL: RGBColor = RGBColor(130, 130, 130);
/// Colours that colour-blind readers can tell apart (Okabe and Ito 2008).
const COLOURS: [RGBColor; 8] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(230, 159, 0),
    RGBColor(0, 0, 0),
    RGBColor(90, 90, 90),
    RGBColor(86, 180, 233),
];

/// Points that are drawn in one colour and style.
#[derive(Clone, Debug)]
pub struct Series {
    /// The name in the legend; a series without a name is not in it.
    pub name: Option<String>,
    /// Index of the colour and of the mark. Both begin anew after the last; as there are 8 colours
    /// and 5 marks, 40 series differ.
    pub colour: usize,
    /// The style in which it is drawn.
    pub stroke: Stroke,
    /// Points (x, y). Lines break at points that an axis cannot show. A series without points is in
    /// the legend alone.
    pub points: Vec<(f64, f64)>,
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
    /// A dashed line with a hollow mark at each point.
    Hollow,
    /// A dotted line, grey whatever the colour, that points are compared with.
    Level,
    /// Small pale dots.
    Dots,
    /// An arrow in the legend, for what is below or above the axes.
    Below,
    /// The same upwards.
    Above,
    /// A bar between the two points of each pair.
    Bars,
    /// A pale area with these corners, the lower ones and then the upper ones back.
    Band,
    /// A column at each pair of points, from the first to the second.
    Columns {
        /// The width in units of the x axis.
        width: f64,
        /// Whether the colour is pale.
        pale: bool,
    },
    /// A lying column between the two points of each pair, of this width in units of the y axis.
    Lying(f64),
    /// A bar of error on columns: a thin black line with short ends between the two points of each
    /// pair.
    Whiskers,
}

/// A part of what is drawn of a series.
enum Shape {
    Path(Vec<Place>),
    Mark(Place),
    Area(Vec<Place>),
}

impl Series {
    /// The number of colours.
    pub const COLOURS: usize = COLOURS.len();
    /// The colour of axes, and that of series that only guide the eye.
    pub const BLACK: usize = 5;
    pub const GREY: usize = 6;

    fn colour(&self) -> RGBColor {
        match self.stroke {
            Stroke::Level | Stroke::Below | Stroke::Above => LEVEL,
            _ => COLOURS[self.colour % COLOURS.len()],
        }
    }

    /// Returns the colour of the name: dark enough for letters.
    pub(super) fn ink(&self) -> RGBColor {
        let RGBColor(r, g, b) = self.colour();
        let dark = |part: u8| (0.78 * f64::from(part)) as u8;
        RGBColor(dark(r), dark(g), dark(b))
    }

    /// Whether it is bars of errors.
    pub(super) fn is_error(&self) -> bool {
        matches!(self.stroke, Stroke::Bars | Stroke::Whiskers)
    }

    /// Returns the points that can be shown: runs between those that cannot, or pairs.
    pub(super) fn runs(&self, shown: impl Fn(&(f64, f64)) -> bool) -> Vec<&[(f64, f64)]> {
        match self.stroke {
            Stroke::Bars | Stroke::Whiskers | Stroke::Columns { .. } | Stroke::Lying(_) => {
                self.points.chunks_exact(2).filter(|pair| pair.iter().all(&shown)).collect()
            }
            _ => {
                let runs = self.points.split(|point| !shown(point));
                runs.filter(|run| !run.is_empty()).collect()
            }
        }
    }

    fn shapes(&self, frame: &Frame, shown: impl Fn(&(f64, f64)) -> bool) -> Vec<Shape> {
        let mut shapes = Vec::new();
        for run in self.runs(shown) {
            let mut places: Vec<Place> = run.iter().map(|&point| frame.place(point)).collect();
            if self.is_error() {
                // a bar that is longer than the axis ends with it
                for (x, y) in &mut places {
                    *x = (*x).clamp(frame.left, frame.right);
                    *y = (*y).clamp(frame.top, frame.bottom);
                }
            }
            let (lines, marks, area) = match self.stroke {
                Stroke::Line | Stroke::Hollow => (true, true, false),
                Stroke::Plain
                | Stroke::Dashed
                | Stroke::Level
                | Stroke::Bars
                | Stroke::Whiskers => (true, false, false),
                Stroke::Marks | Stroke::Dots => (false, true, false),
                Stroke::Below | Stroke::Above => (false, false, false),
                Stroke::Band | Stroke::Columns { .. } | Stroke::Lying(_) => (false, false, true),
            };
            if lines && places.len() > 1 {
                shapes.push(Shape::Path(places.clone()));
            }
            // a line that has but one point is seen too
            if marks || lines && places.len() == 1 {
                shapes.extend(places.iter().copied().map(Shape::Mark));
            }
            match self.stroke {
                Stroke::Columns { width, .. } => {
                    let at = |i: usize, aside: f64| {
                        frame.place((run[i].0 + aside * 0.5 * width, run[i].1))
                    };
                    let corners = vec![at(0, -1.0), at(0, 1.0), at(1, 1.0), at(1, -1.0)];
                    shapes.push(Shape::Area(corners));
                }
                Stroke::Lying(width) => {
                    let at =
                        |i: usize, up: f64| frame.place((run[i].0, run[i].1 + up * 0.5 * width));
                    let corners = vec![at(0, -1.0), at(1, -1.0), at(1, 1.0), at(0, 1.0)];
                    shapes.push(Shape::Area(corners));
                }
                _ if area => shapes.push(Shape::Area(places)),
                _ => {}
            }
        }
        shapes
    }

    /// Draws the points that can be shown, wider if so many lines are drawn on this one.
    pub(super) fn draw(
        &self,
        area: &Area,
        frame: &Frame,
        below: i32,
        shown: impl Fn(&(f64, f64)) -> bool,
    ) -> Result<(), Failure> {
        self.shapes(frame, shown).iter().try_for_each(|shape| self.draw_shape(area, shape, below))
    }

    fn draw_shape(&self, area: &Area, shape: &Shape, below: i32) -> Result<(), Failure> {
        let colour = self.colour();
        let stroke = ShapeStyle::from(&colour).stroke_width(LINE + LINE * below as u32 * 2 / 3);
        let size = MARK + MARK * below / 3;
        let dashed = |points: &[Place], (dash, gap): (i32, i32), stroke: ShapeStyle| {
            area.draw(&DashedPathElement::new(points.to_vec(), dash, gap, stroke))
        };
        match (shape, self.stroke) {
            (Shape::Path(points), Stroke::Dashed | Stroke::Hollow) => {
                dashed(points, DASHES, stroke)?;
            }
            (Shape::Path(points), Stroke::Level) => {
                dashed(points, DOTTED, stroke.stroke_width(px(1) as u32))?;
            }
            (Shape::Path(points), Stroke::Whiskers) => {
                line(area, [points[0], points[1]], hairline())?;
                for &(x, y) in points {
                    line(area, [(x - WHISKER, y), (x + WHISKER, y)], hairline())?;
                }
            }
            (Shape::Path(points), _) => area.draw(&PathElement::new(points.clone(), stroke))?,
            (Shape::Mark(at), Stroke::Dots) => {
                area.draw(&Circle::new(*at, DOT, colour.mix(0.35).filled()))?;
            }
            (Shape::Mark(at), Stroke::Hollow) => {
                self.draw_mark(area, *at, size, colour.filled())?;
                self.draw_mark(area, *at, size - LINE as i32 * 3 / 5, WHITE.filled())?;
            }
            (Shape::Mark(at), _) => self.draw_mark(area, *at, size, colour.filled())?,
            (Shape::Area(corners), Stroke::Columns { .. } | Stroke::Lying(_)) => {
                let pale = matches!(self.stroke, Stroke::Columns { pale: true, .. });
                // opaque: no line of the grid shows through
                let paint = on_paper(colour, if pale { 0.3 } else { 0.85 });
                area.draw(&Rectangle::new([corners[0], corners[2]], paint.filled()))?;
            }
            (Shape::Area(corners), _) => {
                area.draw(&Polygon::new(corners.clone(), colour.mix(0.15)))?;
            }
        }
        Ok(())
    }

    /// Draws a mark: circle, square, triangle, diamond, triangle on its tip, in turn.
    fn draw_mark(
        &self,
        area: &Area,
        (x, y): Place,
        size: i32,
        style: ShapeStyle,
    ) -> Result<(), Failure> {
        let at = |corners: &[(i32, i32)]| -> Vec<Place> {
            let place =
                |(across, down): &(i32, i32)| (x + across * size / 10, y + down * size / 10);
            corners.iter().map(place).collect()
        };
        let corners = match self.colour % MARKS {
            0 => return Ok(area.draw(&Circle::new((x, y), size, style))?),
            1 => {
                let ends = at(&[(-9, -9), (9, 9)]);
                return Ok(area.draw(&Rectangle::new([ends[0], ends[1]], style))?);
            }
            2 => at(&[(-12, 8), (12, 8), (0, -13)]),
            3 => at(&[(-13, 0), (0, 13), (13, 0), (0, -13)]),
            _ => at(&[(-12, -8), (12, -8), (0, 13)]),
        };
        Ok(area.draw(&Polygon::new(corners, style))?)
    }

    /// Draws the entry of a legend at the middle of its left end: what the series looks like, and
    /// its name.
    pub(super) fn draw_entry(&self, area: &Area, (x, y): Place, below: i32) -> Result<(), Failure> {
        let (end, middle) = (x + SWATCH, x + SWATCH / 2);
        let flat = Shape::Path(vec![(x, y), (end, y)]);
        let mark = Shape::Mark((middle, y));
        let high = px(4);
        let shapes = match self.stroke {
            Stroke::Line | Stroke::Hollow => vec![flat, mark],
            Stroke::Plain | Stroke::Level | Stroke::Dashed => vec![flat],
            Stroke::Marks | Stroke::Dots => vec![mark],
            Stroke::Bars | Stroke::Whiskers => {
                vec![Shape::Path(vec![(middle, y - high), (middle, y + high)])]
            }
            Stroke::Below | Stroke::Above => {
                let down = if self.stroke == Stroke::Below { high } else { -high };
                vec![
                    Shape::Path(vec![(middle, y - down), (middle, y + down)]),
                    Shape::Path(vec![
                        (middle - px(3), y + down / 4),
                        (middle, y + down),
                        (middle + px(3), y + down / 4),
                    ]),
                ]
            }
            Stroke::Band | Stroke::Columns { .. } | Stroke::Lying(_) => {
                vec![Shape::Area(vec![
                    (x, y - high),
                    (end, y - high),
                    (end, y + high),
                    (x, y + high),
                ])]
            }
        };
        shapes.iter().try_for_each(|shape| self.draw_shape(area, shape, below))?;
        let Some(name) = &self.name else { return Ok(()) };
        let beside = small(HPos::Left, VPos::Center);
        Ok(area.draw(&Text::new(name.as_str(), (x + NAME, y), beside))?)
    }

    /// Returns places no farther apart than a small letter that cover what is drawn.
    pub(super) fn covered(&self, frame: &Frame, shown: impl Fn(&(f64, f64)) -> bool) -> Vec<Place> {
        let mut covered = Vec::new();
        for shape in self.shapes(frame, shown) {
            match shape {
                Shape::Path(points) => {
                    points.windows(2).for_each(|ends| covered.extend(between(ends[0], ends[1])));
                }
                Shape::Mark((x, y)) => {
                    covered.extend(
                        [-MARK, 0, MARK]
                            .iter()
                            .flat_map(|aside| [-MARK, 0, MARK].map(|down| (x + aside, y + down))),
                    );
                }
                Shape::Area(corners) => {
                    // upright lines between its lower and its upper corners
                    let (low, high) = corners.split_at(corners.len() / 2);
                    let high: Vec<Place> = high.iter().rev().copied().collect();
                    for (low, high) in low.windows(2).zip(high.windows(2)) {
                        let steps = steps(low[0], low[1]).max(steps(high[0], high[1]));
                        let from = along(low[0], low[1], steps);
                        let to = along(high[0], high[1], steps);
                        from.zip(to).for_each(|(a, b)| covered.extend(between(a, b)));
                    }
                }
            }
        }
        covered
    }
}

/// Returns places along a straight line, its ends included.
fn between(from: Place, to: Place) -> impl Iterator<Item = Place> {
    along(from, to, steps(from, to))
}

fn steps(from: Place, to: Place) -> i32 {
    (to.0 - from.0).abs().max((to.1 - from.1).abs()) / px(4) + 1
}

fn along(from: Place, to: Place, steps: i32) -> impl Iterator<Item = Place> {
    let at = move |from: i32, to: i32, i: i32| from + (to - from) * i / steps;
    (0..=steps).map(move |i| (at(from.0, to.0, i), at(from.1, to.1, i)))
}
