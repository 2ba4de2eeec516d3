//! Carpets: the light of every hour as a colour, hours of the day over days.

use plotters::{
    element::{Rectangle, Text},
    prelude::Color,
    style::{
        FontTransform, RGBColor,
        text_anchor::{HPos, VPos},
    },
};

use super::{
    heat_map::{colour, draw_bar},
    months::{day_names, month_name},
    panels::BAR,
};
use crate::{
    chart::{
        axes::{Axis, BELOW, Frame},
        paper::{Area, Failure, LARGE, SMALL, Width, drawn, font, length_of, px, small},
    },
    picture::{Scale, Steps},
};
use phylux_core::math::units::rounded;

/// Height of the colours of a carpet, layout units.
const HEIGHT: i32 = px(150);
/// Height of the title, and of the name above each of several carpets.
const TITLE: i32 = px(28);
const NAME: i32 = px(25);
/// The greatest height of the colour bar, layout units.
const HIGHEST: i32 = px(360);
/// Margins to the left and right of the colours, layout units.
const ROOM: [i32; 2] = [px(52), px(10)];
/// The most colours: finer than the eye can distinguish.
const STEPS: usize = 64;
/// The colour of hours without light.
const NIGHT: RGBColor = RGBColor(226, 226, 226);

/// The light of a captor or group by the hour.
#[derive(Clone, Debug)]
pub(super) struct Carpet {
    /// The captor or group.
    pub id: String,
    /// The median standard error of what has light, as a fraction of it.
    pub error: Option<f64>,
    /// The rows of the table, parted at midnight.
    pub cells: Vec<Cell>,
}

impl Carpet {
    /// Returns these words and how large the errors of its hours are, as single hours may be rough.
    fn with_error(&self, words: &str) -> String {
        match self.error.map(|error| 100.0 * error).filter(|percent| *percent > 0.0) {
            Some(percent) => format!("{words}, median error {} %", rounded(percent, percent)[1]),
            None => words.into(),
        }
    }
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

/// Carpets with one title, one pair of axes and one colour bar.
#[derive(Clone, Debug)]
pub(super) struct Carpets {
    pub title: String,
    pub carpets: Vec<Carpet>,
    /// Names of the days, such as `2005-06-21`.
    pub days: Vec<String>,
    pub scale: Scale,
    /// The label of the bar.
    pub label: String,
}

impl Carpets {
    /// Returns the carpets, one below the other, with their colour bar as SVG text. The name of a single
    /// one is in the title.
    pub fn svg(&self, width: Width) -> Result<String, Failure> {
        let single = self.carpets.len() == 1;
        let first = TITLE + if single { 0 } else { NAME };
        let each = HEIGHT + NAME;
        let end = first + each * self.carpets.len() as i32 - NAME;
        let steps = Steps::of(self.scale, STEPS, 0.0);
        drawn((width.units(), end + BELOW), |area| {
            let title = match &self.carpets[..] {
                [one] => one.with_error(&format!("{} at “{}”", self.title, one.id)),
                _ => self.title.clone(),
            };
            let from = ROOM[0].min(width.units() - px(6) - length_of(&title, LARGE)).max(px(8));
            area.draw(&Text::new(title, (from, px(8)), font(LARGE)))?;
            let (place, bar) = area.split_horizontally(width.units() - BAR);
            for (i, carpet) in self.carpets.iter().enumerate() {
                let top = first + each * i as i32;
                if !single {
                    let at = (ROOM[0], top - px(15));
                    place.draw(&Text::new(carpet.with_error(&carpet.id), at, font(SMALL)))?;
                }
                let frame = self.frame(width, top, i + 1 == self.carpets.len());
                self.draw(carpet, &steps, &place, &frame)?;
            }
            // the label of all upright axes stands once
            let beside = small(HPos::Center, VPos::Center).transform(FontTransform::Rotate270);
            let middle = (px(20), (first + end) / 2);
            place.draw(&Text::new("hour of the day", middle, beside))?;
            self.draw_bar(&bar, &steps, [first, end.min(first + HIGHEST)])
        })
    }

    /// Returns the place of a carpet that begins at `top`; days have names below the lowest alone.
    fn frame(&self, width: Width, top: i32, lowest: bool) -> Frame {
        let days = Axis::linear(if lowest { "day" } else { "" }, 0.0..self.days.len() as f64);
        let x = self.named(days);
        let hours = [0, 6, 12, 18, 24].map(|hour| (f64::from(hour), hour.to_string()));
        Frame {
            left: ROOM[0],
            top,
            right: width.units() - BAR - ROOM[1],
            bottom: top + HEIGHT,
            x: if lowest { x } else { x.without_names() },
            y: Axis::linear("", 0.0..24.0).with_names(hours.to_vec()),
        }
    }

    /// Draws the colour bar between two heights, and below it the colour of hours without light.
    fn draw_bar(&self, bar: &Area, steps: &Steps, ends: [i32; 2]) -> Result<(), Failure> {
        let cells = || self.carpets.iter().flat_map(|carpet| &carpet.cells);
        // hours without light are not below the bar
        let lit = cells().map(|cell| cell.value).filter(|value| *value > 0.0);
        draw_bar(bar, steps, &self.label, ends, lit)?;
        if cells().any(|cell| cell.value.is_nan() || cell.value <= 0.0) {
            let (x, y) = (px(4), ends[1] + px(18));
            bar.draw(&Rectangle::new([(x, y), (px(18), y + px(11))], NIGHT.filled()))?;
            let beside = small(HPos::Left, VPos::Center);
            bar.draw(&Text::new("no light", (px(25), y + px(6)), beside))?;
        }
        Ok(())
    }

    fn draw(
        &self,
        carpet: &Carpet,
        steps: &Steps,
        area: &Area,
        frame: &Frame,
    ) -> Result<(), Failure> {
        let days = self.days.len() as f64;
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
    /// with up to eight days where there are fewer than two months.
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
        axis.with_names(day_names(&self.days, 0.5))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Carpets share their title, the labels of their axes and the names of months; each has its own
    /// name, which for one alone is in the title.
    #[test]
    fn carpets_share_what_is_the_same() {
        let days =
            (1..=90).map(|i| format!("2005-{:02}-{:02}", 1 + (i - 1) / 30, 1 + (i - 1) % 30));
        let days: Vec<String> = days.collect();
        let texts = |ids: &[&str]| -> Vec<String> {
            let cell = |day| Cell { day, from: 0.0, to: 24.0, value: day as f64 };
            let carpet = |id: &&str| Carpet {
                id: id.to_string(),
                error: (*id != "top").then_some(0.123),
                cells: (0..days.len()).map(cell).collect(),
            };
            let carpets = Carpets {
                title: "PPFD of every hour".into(),
                carpets: ids.iter().map(carpet).collect(),
                days: days.clone(),
                scale: Scale { low: 0.0, high: 90.0, log: false },
                label: "PPFD, umol/m2/s".into(),
            };
            let svg = carpets.svg(Width::Page).expect("a picture");
            let texts = svg.split("<text").skip(1).filter_map(|text| text.split_once('>'));
            texts.map(|(_, text)| text.split('<').next().unwrap().trim().to_string()).collect()
        };
        let count = |texts: &[String], wanted: &str| texts.iter().filter(|t| *t == wanted).count();
        let three = texts(&["bench", "floor", "top"]);
        let names = ["bench, median error 12 %", "floor, median error 12 %", "top"];
        for once in ["PPFD of every hour", "day", "hour of the day", "Feb"].iter().chain(&names) {
            assert_eq!(count(&three, once), 1, "{once}: {three:?}");
        }
        assert_eq!(count(&three, "12"), 3, "{three:?}");
        let one = texts(&["bench"]);
        assert_eq!(count(&one, "PPFD of every hour at “bench”, median error 12 %"), 1, "{one:?}");
        assert_eq!(count(&one, "bench"), 0);
    }
}
