//! Carpets: the light of every hour as a colour, hours of the day over days.

use plotters::{
    element::{Rectangle, Text},
    prelude::Color,
    style::{
        RGBColor,
        text_anchor::{HPos, VPos},
    },
};

use super::{
    heat_map::{colour, draw_bar},
    months::month_name,
    panels::BAR,
};
use crate::{
    chart::{
        axes::{Axis, BELOW, Frame},
        paper::{Area, Failure, LARGE, Width, drawn, font, px, small},
    },
    picture::{Scale, Steps},
};

/// Height of a carpet, and the least height, which the colour bar needs, layout units.
const HEIGHT: i32 = px(220);
const LEAST: i32 = px(240);
/// The greatest height of the colour bar, layout units.
const HIGHEST: i32 = px(400);
/// Margins around the colours: left, right, above, below, layout units.
const ROOM: (i32, i32, i32, i32) = (px(52), px(10), px(28), BELOW);
/// The most colours: finer than the eye can distinguish.
const STEPS: usize = 64;
/// The colour of hours without light.
const NIGHT: RGBColor = RGBColor(226, 226, 226);

/// The light of a captor or group by the hour.
#[derive(Clone, Debug)]
pub(super) struct Carpet {
    pub title: String,
    /// The rows of the table, parted at midnight.
    pub cells: Vec<Cell>,
}

/// The light of a part of a day.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cell {
    /// The number of the day, from 0.
    pub day: usize,
    /// When it begins and ends, h of the day.
    pub from: f64,
    pub to: f64,
    /// The light; 0 or not a number where there is none.
    pub value: f64,
}

/// Carpets with one colour bar.
#[derive(Clone, Debug)]
pub(super) struct Carpets {
    pub carpets: Vec<Carpet>,
    /// Names of the days, such as `2005-06-21`.
    pub days: Vec<String>,
    pub scale: Scale,
    /// The label of the bar.
    pub label: String,
}

impl Carpets {
    /// Returns the carpets, one below the other, with their colour bar as SVG text.
    pub fn svg(&self, width: Width) -> Result<String, Failure> {
        let down = (HEIGHT * self.carpets.len() as i32).max(LEAST);
        let steps = Steps::of(self.scale, STEPS, 0.0);
        drawn((width.units(), down), |area| {
            let (carpets, bar) = area.split_horizontally(width.units() - BAR);
            let parts = carpets.split_evenly((self.carpets.len().max(1), 1));
            for (carpet, part) in self.carpets.iter().zip(&parts) {
                self.draw(carpet, &steps, part)?;
            }
            let high = down.min(HIGHEST);
            let values =
                self.carpets.iter().flat_map(|carpet| carpet.cells.iter().map(|cell| cell.value));
            // hours without light are not below the bar
            let lit = values.filter(|value| *value > 0.0);
            draw_bar(&bar, &steps, &self.label, [ROOM.2, high - BELOW], lit)?;
            let dark = |carpet: &Carpet| {
                carpet.cells.iter().any(|cell| cell.value.is_nan() || cell.value <= 0.0)
            };
            if self.carpets.iter().any(dark) {
                let (x, y) = (px(4), high - px(28));
                bar.draw(&Rectangle::new([(x, y), (px(18), y + px(11))], NIGHT.filled()))?;
                let beside = small(HPos::Left, VPos::Center);
                bar.draw(&Text::new("no light", (px(25), y + px(6)), beside))?;
            }
            Ok(())
        })
    }

    fn draw(&self, carpet: &Carpet, steps: &Steps, area: &Area) -> Result<(), Failure> {
        let (left, right, above, below) = ROOM;
        area.draw(&Text::new(carpet.title.as_str(), (left, px(8)), font(LARGE)))?;
        let (width, height) = area.dim_in_pixel();
        let days = self.days.len() as f64;
        let hours = [0, 6, 12, 18, 24].map(|hour| (f64::from(hour), hour.to_string()));
        let frame = Frame {
            left,
            top: above,
            right: width as i32 - right,
            bottom: height as i32 - below,
            x: self.named(Axis::linear("day", 0.0..days)),
            y: Axis::linear("hour of the day", 0.0..24.0).with_names(hours.to_vec()),
        };
        // hours without light have a colour of their own, which leaves those with light in view
        let level = |value: f64| (value > 0.0).then(|| steps.at(value));
        let middles = steps.middles();
        let paint = |value: f64| match level(value) {
            None => NIGHT.filled(),
            Some(level) => colour(&self.scale, middles[level]).filled(),
        };
        let mut rectangles = Vec::new();
        // rectangles reach a little below those that are drawn after them, so that no pale lines are
        // left between them where edges are smoothed
        let [across, up] = [frame.right - frame.left, frame.bottom - frame.top]
            .map(|units| f64::from(px(1)) / f64::from(units.max(1)));
        let more = [across * days, up * 24.0];
        // cells of one colour that follow each other are one rectangle
        let joins = |a: &Cell, b: &Cell| {
            a.day == b.day && level(a.value) == level(b.value) && (b.from - a.to).abs() < 1e-3
        };
        for run in carpet.cells.chunk_by(joins) {
            let (Cell { day, from, value, .. }, to) = (run[0], run[run.len() - 1].to);
            let end = (day as f64 + 1.0 + more[0], to + more[1]);
            let corners = [(day as f64, from), (end.0.min(days), end.1.min(24.0))];
            rectangles.push(Rectangle::new(corners.map(|at| frame.place(at)), paint(value)));
        }
        rectangles.iter().try_for_each(|rectangle| area.draw(rectangle))?;
        frame.draw(area, false)
    }

    /// Returns the axis of days with ticks where months begin and their names between these, or
    /// with up to seven days where there are fewer than two months.
    fn named(&self, axis: Axis) -> Axis {
        let mut months: Vec<(&str, usize, usize)> = Vec::new();
        for (d, day) in self.days.iter().enumerate() {
            let month = day.get(..7).unwrap_or(day);
            match months.last_mut().filter(|(last, ..)| *last == month) {
                Some((.., end)) => *end = d + 1,
                None => months.push((month, d, d + 1)),
            }
        }
        if self.days.len() > 62 {
            let starts = months
                .iter()
                .filter(|(_, first, _)| self.days[*first].get(8..).is_none_or(|day| day == "01"));
            let ticks = starts.map(|(_, first, _)| *first as f64).collect();
            months.retain(|(_, first, end)| end - first > 10);
            let middle = |(name, first, end): &(&str, usize, usize)| {
                (0.5 * (first + end) as f64, month_name(name))
            };
            return axis.with_names_between(ticks, months.iter().map(middle).collect());
        }
        let every = self.days.len().div_ceil(7).max(1);
        let days = self.days.iter().enumerate().step_by(every);
        let name =
            |(d, day): (usize, &String)| (d as f64 + 0.5, day.get(5..).unwrap_or(day).to_string());
        axis.with_names(days.map(name).collect())
    }
}
