//! Carpets: the light of every hour as a colour, hours of the day over days.

use plotters::{
    chart::ChartBuilder,
    element::{PathElement, Rectangle, Text},
    prelude::Color,
    style::{
        BLACK,
        text_anchor::{HPos, Pos, VPos},
    },
};

use super::{
    heat_map::{BAR, colour, draw_bar},
    months::month_name,
};
use crate::show::{
    chart::{Area, Failure, LARGE, SMALL, Width, drawn, font, px},
    picture::Scale,
};

/// Height of a carpet, and the least height, which the colour bar needs, layout units.
const HEIGHT: i32 = px(200);
const LEAST: i32 = px(240);
/// The greatest height of the colour bar, layout units.
const HIGHEST: i32 = px(400);
/// Margins around the colours: left, right, above, below, layout units.
const ROOM: (i32, i32, i32, i32) = (px(52), px(10), px(28), px(26));
/// Number of colours: finer than the eye can distinguish.
const STEPS: f64 = 64.0;

/// The light of a captor or group by the hour.
#[derive(Clone, Debug)]
pub(super) struct Carpet {
    pub title: String,
    /// Day, hour of the day and light of each hour.
    pub cells: Vec<(usize, f64, f64)>,
}

/// Carpets with one colour bar.
#[derive(Clone, Debug)]
pub(super) struct Carpets {
    pub carpets: Vec<Carpet>,
    /// Names of the days, such as `2005-06-21`.
    pub days: Vec<String>,
    /// Length of the hours, h.
    pub step: f64,
    pub scale: Scale,
    /// Lines above the bar.
    pub legend: Vec<String>,
}

impl Carpets {
    /// Returns the carpets, one below the other, with their colour bar as SVG text.
    pub fn svg(&self, width: Width) -> Result<String, Failure> {
        let down = (HEIGHT * self.carpets.len() as i32).max(LEAST);
        drawn((width.units(), down), |area| {
            let (carpets, bar) = area.split_horizontally(width.units() - BAR);
            let parts = carpets.split_evenly((self.carpets.len().max(1), 1));
            for (carpet, part) in self.carpets.iter().zip(&parts) {
                self.draw(carpet, part)?;
            }
            draw_bar(&bar, &self.scale, &self.legend, down.min(HIGHEST))
        })
    }

    fn draw(&self, carpet: &Carpet, area: &Area) -> Result<(), Failure> {
        let (left, right, above, below) = ROOM;
        area.draw(&Text::new(carpet.title.as_str(), (left, px(8)), font(LARGE)))?;
        let mut builder = ChartBuilder::on(area);
        builder.margin_top(above).margin_right(right);
        builder.x_label_area_size(below).y_label_area_size(left);
        let mut chart = builder.build_cartesian_2d(0.0..self.days.len() as f64, 0.0..24.0)?;
        let mut mesh = chart.configure_mesh();
        mesh.disable_mesh().y_desc("hour").label_style(font(SMALL)).axis_desc_style(font(SMALL));
        mesh.axis_style(BLACK.stroke_width(px(1) as u32)).set_all_tick_mark_size(px(4));
        mesh.x_labels(0).y_labels(0).draw()?;
        let paint = |level: f64| {
            let Scale { low, high, .. } = self.scale;
            colour(&self.scale, low + (level + 0.5) / STEPS * (high - low)).filled()
        };
        let level = |value: f64| (self.scale.place(value) * STEPS).floor().min(STEPS - 1.0);
        // hours of one colour that follow each other are one rectangle
        let mut cells = carpet.cells.iter().map(|&(day, hour, value)| (day, hour, level(value)));
        let mut open = cells.next().map(|(day, hour, level)| (day, hour, hour, level));
        let mut rectangles = Vec::new();
        // rectangles reach a little below those that are drawn after them, so that no pale lines are
        // left between them where edges are smoothed
        let (across, up) = chart.plotting_area().dim_in_pixel();
        let [across, up] = [across, up].map(|units| f64::from(px(1)) / f64::from(units.max(1)));
        let (days, more) = (self.days.len() as f64, [across * self.days.len() as f64, up * 24.0]);
        let mut close = |(day, from, last, level): (usize, f64, f64, f64)| {
            let end = (day as f64 + 1.0 + more[0], last + self.step + more[1]);
            let corners = [(day as f64, from), (end.0.min(days), end.1.min(24.0))];
            rectangles.push(Rectangle::new(corners, paint(level)));
        };
        for (day, hour, level) in cells {
            open = open.map(|(of, from, last, own)| {
                let follows = of == day && own == level && hour - last < 1.01 * self.step;
                if !follows {
                    close((of, from, last, own));
                    return (day, hour, hour, level);
                }
                (of, from, hour, own)
            });
        }
        open.into_iter().for_each(close);
        chart.draw_series(rectangles)?;
        let (left, top) = area.get_base_pixel();
        for (day, name) in self.names() {
            let at = chart.backend_coord(&(day as f64 + 0.5, 0.0));
            let below = font(SMALL).pos(Pos::new(HPos::Center, VPos::Top));
            area.draw(&Text::new(name, (at.0 - left, at.1 - top + px(6)), below))?;
        }
        for hour in [0, 6, 12, 18, 24] {
            let at = chart.backend_coord(&(0.0, f64::from(hour)));
            let (x, y) = (at.0 - left, at.1 - top);
            let stroke = BLACK.stroke_width(px(1) as u32);
            area.draw(&PathElement::new(vec![(x - px(4), y), (x, y)], stroke))?;
            let beside = font(SMALL).pos(Pos::new(HPos::Right, VPos::Center));
            area.draw(&Text::new(hour.to_string(), (x - px(7), y), beside))?;
        }
        Ok(())
    }

    /// Returns the days that have a name at the axis, and these names: middles of months, or up to
    /// seven days where there are fewer than two months.
    fn names(&self) -> Vec<(usize, String)> {
        let mut months: Vec<(&str, usize, usize)> = Vec::new();
        for (d, day) in self.days.iter().enumerate() {
            let month = day.get(..7).unwrap_or(day);
            match months.last_mut().filter(|(last, ..)| *last == month) {
                Some((.., end)) => *end = d,
                None => months.push((month, d, d)),
            }
        }
        if self.days.len() > 62 {
            months.retain(|(_, first, last)| last - first > 9);
            let middle =
                |(name, first, last): &(&str, usize, usize)| ((first + last) / 2, month_name(name));
            return months.iter().map(middle).collect();
        }
        let every = self.days.len().div_ceil(7).max(1);
        let days = self.days.iter().enumerate().step_by(every);
        days.map(|(d, day)| (d, day.get(5..).unwrap_or(day).to_string())).collect()
    }
}
