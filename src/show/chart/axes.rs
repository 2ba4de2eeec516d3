//! The axes of plots: where numbers are, and their ticks.

use std::ops::Range;

use plotters::{
    element::Text,
    style::{
        BLACK, Color, FontTransform,
        text_anchor::{HPos, VPos},
    },
};

use super::paper::{Area, Failure, Number, Place, hairline, line, numbers, px, small};
use crate::{math::units::printed, show::picture::Scale};

/// Lengths of ticks, and of those between the numbers of a logarithmic axis.
const TICK: i32 = px(4);
const SHORT: i32 = px(2);
/// Distances of a number from its axis, and of the middle of a label from the numbers beside it or
/// from the axis below it.
const GAP: i32 = px(7);
const LABEL_BESIDE: i32 = px(12);
const LABEL_BELOW: i32 = px(32);
/// Least distances between numbers on lying and on upright axes.
const EACH_ACROSS: i32 = px(40);
const EACH_UP: i32 = px(46);
/// The room that an axis needs below, with its label.
pub(in crate::show) const BELOW: i32 = px(46);
/// Space beyond labels, and the least room to the left of an upright axis: axes of charts one below
/// the other begin at the same place.
const MARGIN: i32 = px(10);
const LEAST_LEFT: i32 = px(48);

/// An axis.
#[derive(Clone, Debug)]
pub(in crate::show) struct Axis {
    label: String,
    ends: [f64; 2],
    log: bool,
    /// Names of places, in place of numbers.
    names: Option<Vec<(f64, String)>>,
    /// Whether numbers are whole.
    whole: bool,
}

impl Axis {
    /// Makes a linear axis between two numbers that differ.
    pub fn linear(label: &str, ends: Range<f64>) -> Self {
        let ends = [ends.start, ends.end];
        Self { label: printed(label), ends, log: false, names: None, whole: false }
    }

    /// Makes a logarithmic axis between two numbers above 0 that differ.
    pub fn logarithmic(label: &str, ends: Range<f64>) -> Self {
        Self { log: true, ..Self::linear(label, ends) }
    }

    /// Returns the axis with names of places in place of numbers.
    pub fn with_names(self, names: Vec<(f64, String)>) -> Self {
        Self { names: Some(names), ..self }
    }

    /// Returns the axis with whole numbers alone, for counts.
    pub fn of_counts(self) -> Self {
        Self { whole: true, ..self }
    }

    /// Returns where a number is along the axis, 0 and 1 at the ends.
    fn share(&self, value: f64) -> f64 {
        let [from, to, value] =
            [self.ends[0], self.ends[1], value].map(|v| if self.log { v.ln() } else { v });
        (value - from) / (to - from)
    }

    /// Returns where numbers or names stand, about one in `each` layout units of a length.
    fn ticks(&self, length: i32, each: i32) -> Vec<(f64, Number)> {
        if let Some(names) = &self.names {
            let name =
                |(at, name): &(f64, String)| (*at, Number { text: name.clone(), exponent: None });
            return names.iter().map(name).collect();
        }
        let [low, high] = self.ends;
        let most = (length / each).clamp(3, 10) as usize;
        let mut places = match self.log && high / low >= 10.0 {
            true => self.powers(most),
            false => Scale { low, high, log: false }.ticks(most),
        };
        places.retain(|place| !self.whole || (place - place.round()).abs() < 1e-9);
        let texts = numbers(&places, self.log && high / low >= 10.0);
        places.into_iter().zip(texts).collect()
    }

    /// Returns the whole powers of ten on a logarithmic axis, or every second of them and so on if
    /// there are many; with 2 and 5 times them if they are few.
    fn powers(&self, most: usize) -> Vec<f64> {
        let [low, high] = self.ends;
        let first = (low.log10() - 1e-9).ceil() as i32;
        let last = (high.log10() + 1e-9).floor() as i32;
        let count = usize::try_from(last - first + 1).unwrap_or(0);
        if count < 2 {
            return Scale { low, high, log: true }.ticks(3 * most);
        }
        let every = count.div_ceil(most + 2).max(1);
        (first..=last).step_by(every).map(|decade| 10f64.powi(decade)).collect()
    }

    /// Returns the places between whole powers of ten on a logarithmic axis that has a number at
    /// each of them.
    fn short_ticks(&self, ticks: &[(f64, Number)]) -> Vec<f64> {
        let [low, high] = self.ends;
        let decades = ticks.windows(2).all(|pair| (9.0..11.0).contains(&(pair[1].0 / pair[0].0)));
        if !self.log || !decades || high / low < 10.0 {
            return Vec::new();
        }
        let decades = low.log10().floor() as i32..=high.log10().ceil() as i32;
        let of = |decade: i32| (2..10).map(move |step| f64::from(step) * 10f64.powi(decade));
        decades.flat_map(of).filter(|at| (low..=high).contains(at)).collect()
    }

    /// Returns the length of the longest number of an upright axis.
    fn longest(&self, height: i32) -> i32 {
        let ticks = self.ticks(height, EACH_UP);
        ticks.iter().map(|(_, number)| number.length()).max().unwrap_or(0)
    }

    /// Returns the room that an upright axis of this height needs to its left, with its label.
    pub fn room_beside(&self, height: i32) -> i32 {
        (GAP + self.longest(height) + LABEL_BESIDE + MARGIN + px(4)).max(LEAST_LEFT)
    }

    /// Returns the room that a lying axis of this length needs beyond its end.
    pub fn room_beyond(&self, length: i32) -> i32 {
        let end = |(at, number): &(f64, Number)| {
            let beyond = (1.0 - self.share(*at)) * f64::from(length);
            number.length() / 2 + px(2) - beyond as i32
        };
        self.ticks(length, EACH_ACROSS).iter().map(end).fold(MARGIN, i32::max)
    }
}

/// A rectangle of a picture with its two axes.
#[derive(Clone, Debug)]
pub(in crate::show) struct Frame {
    /// Places of its sides, layout units.
    pub left: i32,
    pub top: i32,
    pub right: i32,
    pub bottom: i32,
    pub x: Axis,
    pub y: Axis,
}

impl Frame {
    /// Returns the place of a point.
    pub fn place(&self, (x, y): (f64, f64)) -> Place {
        let at = |share: f64, from: i32, to: i32| {
            (f64::from(from) + share * f64::from(to - from)).round() as i32
        };
        (at(self.x.share(x), self.left, self.right), at(self.y.share(y), self.bottom, self.top))
    }

    /// Returns the numbers at the ends of the lying axis.
    pub fn ends_across(&self) -> [f64; 2] {
        self.x.ends
    }

    /// Draws the axes with their numbers and labels and, if wanted, pale lines across the frame at
    /// the numbers of the upright one.
    pub fn draw(&self, area: &Area, grid: bool) -> Result<(), Failure> {
        let Self { left, top, right, bottom, x, y } = self;
        let (left, top, right, bottom) = (*left, *top, *right, *bottom);
        let [ticks_y, ticks_x] =
            [y.ticks(bottom - top, EACH_UP), x.ticks(right - left, EACH_ACROSS)];
        let up = |value: f64| self.place((x.ends[0], value)).1;
        let across = |value: f64| self.place((value, y.ends[0])).0;
        for (value, number) in &ticks_y {
            let at = up(*value);
            if grid && at < bottom {
                let pale = BLACK.mix(0.1).stroke_width(px(1) as u32);
                line(area, [(left, at), (right, at)], pale)?;
            }
            line(area, [(left - TICK, at), (left, at)], hairline())?;
            number.draw_before(area, (left - GAP, at))?;
        }
        for value in y.short_ticks(&ticks_y) {
            line(area, [(left - SHORT, up(value)), (left, up(value))], hairline())?;
        }
        // names that would lie on the one before are left out
        let mut free = i32::MIN;
        for (value, number) in &ticks_x {
            let (at, half) = (across(*value), number.length() / 2);
            line(area, [(at, bottom), (at, bottom + TICK)], hairline())?;
            if at - half >= free {
                number.draw_around(area, (at, bottom + GAP + px(6)))?;
                free = at + half + px(3);
            }
        }
        for value in x.short_ticks(&ticks_x) {
            let at = across(value);
            line(area, [(at, bottom), (at, bottom + SHORT)], hairline())?;
        }
        line(area, [(left, top), (left, bottom)], hairline())?;
        line(area, [(left, bottom), (right, bottom)], hairline())?;
        let middle = small(HPos::Center, VPos::Center);
        let below = ((left + right) / 2, bottom + LABEL_BELOW);
        area.draw(&Text::new(x.label.clone(), below, middle.clone()))?;
        let beside = (left - GAP - y.longest(bottom - top) - LABEL_BESIDE, (top + bottom) / 2);
        let upright = middle.transform(FontTransform::Rotate270);
        Ok(area.draw(&Text::new(y.label.clone(), beside, upright))?)
    }
}
