//! The axes of plots: where numbers are, and their ticks.

use std::ops::{Range, RangeInclusive};

use plotters::{
    element::{Polygon, Text},
    style::{
        BLACK, Color, FontTransform, WHITE,
        text_anchor::{HPos, VPos},
    },
};

use super::paper::{Area, Failure, Number, Place, hairline, line, numbers, px, small};
use phylux_core::math::units::printed;

/// Lengths of ticks, and of those between the numbers of a logarithmic axis.
const TICK: i32 = px(4);
const SHORT: i32 = px(2);
/// Distances of a number from its axis, and of the middle of a label from the numbers beside it or
/// from the axis below it.
const GAP: i32 = px(7);
const LABEL_BESIDE: i32 = px(12);
const LABEL_BELOW: i32 = px(32);
/// Least distances between numbers on lying and on upright axes.
const EACH_ACROSS: i32 = px(34);
const EACH_UP: i32 = px(17);
/// The least number of steps between the numbers of an axis, where there is room for them.
const STEPS: f64 = 4.0;
/// The room that an axis needs below, with its label.
pub(crate) const BELOW: i32 = px(46);
/// Distance of the sign of a broken axis from its beginning.
const BREAK: i32 = px(7);
/// Space beyond labels, and the least room to the left of an upright axis: axes of charts one below
/// the other begin at the same place.
const MARGIN: i32 = px(10);
const LEAST_LEFT: i32 = px(48);

/// An axis.
#[derive(Clone, Debug)]
pub(crate) struct Axis {
    label: String,
    ends: [f64; 2],
    log: bool,
    /// Names of places, in place of numbers.
    names: Option<Vec<(f64, String)>>,
    /// Where ticks are, if not at the names.
    between: Option<Vec<f64>>,
    /// Whether numbers are whole.
    whole: bool,
    /// Whether a sign says that it does not begin at 0.
    broken: bool,
}

impl Axis {
    /// Makes a linear axis between two numbers that differ.
    pub fn linear(label: &str, ends: Range<f64>) -> Self {
        let ends = [ends.start, ends.end];
        let label = printed(label);
        Self { label, ends, log: false, names: None, between: None, whole: false, broken: false }
    }

    /// Makes a logarithmic axis between two numbers above 0 that differ.
    pub fn logarithmic(label: &str, ends: Range<f64>) -> Self {
        Self { log: true, ..Self::linear(label, ends) }
    }

    /// Returns the axis without its label.
    pub fn unlabelled(self) -> Self {
        Self { label: String::new(), ..self }
    }

    /// Returns the axis with names of places in place of numbers.
    pub fn with_names(self, names: Vec<(f64, String)>) -> Self {
        Self { names: Some(names), ..self }
    }

    /// Returns the axis with names of the spans between these ticks, in place of numbers.
    pub fn with_names_between(self, ticks: Vec<f64>, names: Vec<(f64, String)>) -> Self {
        Self { names: Some(names), between: Some(ticks), ..self }
    }

    /// Returns the axis with its ticks alone, without their names or numbers.
    pub fn without_names(self) -> Self {
        let places = self.names.iter().flatten().map(|(at, _)| *at).collect();
        Self { between: self.between.or(Some(places)), names: Some(Vec::new()), ..self }
    }

    /// Returns the axis with whole numbers alone, for counts.
    pub fn of_counts(self) -> Self {
        Self { whole: true, ..self }
    }

    /// Returns the axis with a sign that it does not begin at 0, and these words after its label, if
    /// it begins above 0.
    pub fn broken(self) -> Self {
        match self.ends[0] > 0.0 {
            true => {
                Self { broken: true, label: self.label + " (axis does not begin at 0)", ..self }
            }
            false => self,
        }
    }

    /// Returns the axis from and to the next numbers beyond its ends.
    pub fn ended_at_numbers(self) -> Self {
        let [low, high] = self.ends;
        let step = self.step(STEPS);
        let ends = [(low / step + 1e-9).floor() * step, (high / step - 1e-9).ceil() * step];
        Self { ends, ..self }
    }

    /// Returns the longest step of 1, 2, 2.5 or 5 times a power of ten that an axis has at least so
    /// many times.
    fn step(&self, times: f64) -> f64 {
        let longest = (self.ends[1] - self.ends[0]) / times;
        let power = 10f64.powf(longest.log10().floor());
        let steps: &[f64] = if self.whole && power < 9.0 { &[5.0, 2.0] } else { &[5.0, 2.5, 2.0] };
        let fits = |factor: &&f64| **factor * power <= longest * (1.0 + 1e-9);
        let step = power * steps.iter().find(fits).copied().unwrap_or(1.0);
        if self.whole { step.max(1.0) } else { step }
    }

    /// Returns the numbers of a linear axis of this length: some four steps or more, where as many
    /// are apart by `each`.
    fn linear_ticks(&self, length: i32, each: i32) -> Vec<f64> {
        let [low, high] = self.ends;
        // long axes have more numbers
        let room = f64::from(length) / f64::from(each);
        let mut times = (room / 4.5).max(STEPS);
        let mut step = self.step(times);
        while (high - low) / step > room.max(1.0) && times > 0.5 {
            times *= 0.8;
            step = self.step(times);
        }
        let first = (low / step - 1e-9).ceil() as i64;
        let last = (high / step + 1e-9).floor() as i64;
        (first..=last).take(50).map(|i| i as f64 * step).collect()
    }

    /// Returns the range of numbers that the axis has.
    pub fn ends(&self) -> RangeInclusive<f64> {
        self.ends[0]..=self.ends[1]
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
        let decades = self.log && high / low >= 10.0;
        let mut places = match decades {
            true => self.powers((length / each).clamp(4, 10) as usize),
            false => self.linear_ticks(length, each),
        };
        let longest = numbers(&places, decades).iter().map(Number::length).max().unwrap_or(0);
        if !decades && each == EACH_ACROSS && longest + px(8) > each {
            places = self.linear_ticks(length, longest + px(8));
        }
        let texts = numbers(&places, decades);
        places.into_iter().zip(texts).collect()
    }

    /// Returns the whole powers of ten on a logarithmic axis, or every second of them and so on if
    /// there are more than `most`; with 2 and 5 times them if they are few.
    fn powers(&self, most: usize) -> Vec<f64> {
        let [low, high] = self.ends;
        let first = (low.log10() - 1e-9).ceil() as i32;
        let last = (high.log10() + 1e-9).floor() as i32;
        let count = usize::try_from(last - first + 1).unwrap_or(0);
        // numbers that are products with powers of ten are hard to read, and shorter ticks do
        let of_powers = numbers(&[10f64.powi(first), 10f64.powi(last)], true)
            .iter()
            .any(|n| n.exponent.is_some());
        if count >= 4 || count >= 2 && of_powers {
            let every = count.div_ceil(most).max(1);
            return (first..=last).step_by(every).map(|decade| 10f64.powi(decade)).collect();
        }
        let shown = |at: &f64| (low * (1.0 - 1e-9)..=high * (1.0 + 1e-9)).contains(at);
        let of = |factors: &[f64]| -> Vec<f64> {
            let decades = (first - 1..=last)
                .flat_map(|decade| factors.iter().map(move |factor| factor * 10f64.powi(decade)));
            decades.filter(shown).collect()
        };
        let all = of(&[1.0, 2.0, 5.0]);
        if all.len() <= most + 2 { all } else { of(&[1.0, 3.0]) }
    }

    /// Returns the places between the numbers on a logarithmic axis that has one at each whole
    /// power of ten.
    fn short_ticks(&self, ticks: &[(f64, Number)]) -> Vec<f64> {
        let [low, high] = self.ends;
        let decades = ticks.windows(2).all(|pair| pair[1].0 / pair[0].0 < 11.0);
        if !self.log || !decades || high / low < 10.0 {
            return Vec::new();
        }
        let decades = low.log10().floor() as i32..=high.log10().ceil() as i32;
        let of = |decade: i32| (2..10).map(move |step| f64::from(step) * 10f64.powi(decade));
        let has = |at: f64| ticks.iter().any(|(tick, _)| (tick / at - 1.0).abs() < 1e-6);
        decades.flat_map(of).filter(|at| (low..=high).contains(at) && !has(*at)).collect()
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

/// Draws two slanting strokes with a gap in a lying axis between them.
fn draw_break(area: &Area, (x, y): Place) -> Result<(), Failure> {
    let ends = |x: i32| [(x - px(2), y + px(5)), (x + px(2), y - px(5))];
    let [near, far] = [ends(x), ends(x + px(5))];
    area.draw(&Polygon::new(vec![near[0], near[1], far[1], far[0]], WHITE.filled()))?;
    [near, far].into_iter().try_for_each(|stroke| line(area, stroke, hairline()))
}

/// A rectangle of a picture with its two axes.
#[derive(Clone, Debug)]
pub(crate) struct Frame {
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
        let places = x.between.clone();
        let places = places.unwrap_or_else(|| ticks_x.iter().map(|(at, _)| *at).collect());
        for at in places.into_iter().map(across) {
            line(area, [(at, bottom), (at, bottom + TICK)], hairline())?;
        }
        // names that would lie on the one before are left out
        let mut free = i32::MIN;
        for (value, number) in &ticks_x {
            let (at, half) = (across(*value), number.length() / 2);
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
        if x.broken {
            draw_break(area, (left + BREAK, bottom))?;
        }
        let middle = small(HPos::Center, VPos::Center);
        let below = ((left + right) / 2, bottom + LABEL_BELOW);
        area.draw(&Text::new(x.label.clone(), below, middle.clone()))?;
        let beside = (left - GAP - y.longest(bottom - top) - LABEL_BESIDE, (top + bottom) / 2);
        let upright = middle.transform(FontTransform::Rotate270);
        Ok(area.draw(&Text::new(y.label.clone(), beside, upright))?)
    }
}
