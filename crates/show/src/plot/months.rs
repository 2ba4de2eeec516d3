//! Charts of daily light integrals: the mean of each month with its error, before the range of its
//! days, or each day if there is one month alone.

use super::{chosen::error_bar, colours::Names};
use crate::chart::{Chart, Series, Stroke};

/// Daily light integrals of some captors and groups.
#[derive(Clone, Debug, Default)]
pub struct DailyLight {
    /// Name of the band or sum.
    pub band: String,
    /// Unit of the integrals.
    pub unit: String,
    /// Names of the months, such as `2005-06`.
    pub months: Vec<String>,
    /// Names of the days, such as `2005-06-21`, in order.
    pub days: Vec<String>,
    /// The captors and groups.
    pub of: Vec<OfId>,
}

/// Widths of the columns of means and of the range of days behind them, months.
const MEAN: f64 = 0.56;
const RANGE: f64 = 0.86;
/// Colours of daylight and of the light of lamps.
const DAYLIGHT: usize = 0;
const LAMPS: usize = 1;

/// Daily light integrals of a captor or group.
#[derive(Clone, Debug, Default)]
pub struct OfId {
    /// Its id or name.
    pub id: String,
    /// Index of its colour.
    pub colour: usize,
    /// The mean of each month, with its standard error.
    pub months: Vec<[f64; 2]>,
    /// Each day, with its standard error.
    pub days: Vec<[f64; 2]>,
    /// Of each day what is daylight; empty if that is not known, or is all of it.
    pub daylight: Vec<f64>,
}

impl OfId {
    /// Makes entries without any light yet, of some of the ids of captors and groups in the order of
    /// the scene.
    pub fn some(ids: &[String], some: &[usize]) -> Vec<Self> {
        let drawn: Vec<&str> = some.iter().map(|&id| ids[id].as_str()).collect();
        let colours = Names::of(ids.iter().map(String::as_str)).colours(&drawn);
        let of = |(id, colour): (&str, usize)| Self { id: id.into(), colour, ..Self::default() };
        drawn.into_iter().zip(colours).map(of).collect()
    }
}

impl DailyLight {
    /// Makes the chart.
    pub fn chart(&self) -> Chart {
        let mut chart = Chart { linear_x: true, linear_y: true, ..Chart::default() };
        // the band of a scene that names none is `all`
        chart.title = match self.band.as_str() {
            "all" => "daily light integral".into(),
            band => format!("daily light integral of {band}"),
        };
        chart.y = format!("DLI, {}", self.unit);
        let by_month = self.months.len() > 1;
        match (by_month, &self.of[..]) {
            (true, [of]) => self.columns(of, &mut chart.series),
            // small ones side by side, with the same axes
            (true, all) => {
                let panel = |of: &OfId| {
                    let mut series = Vec::new();
                    self.columns(of, &mut series);
                    (of.id.clone(), series)
                };
                chart.panels = all.iter().map(panel).collect();
            }
            (false, all) => {
                for of in all {
                    lines(of, all.len() > 1, &mut chart.series);
                }
            }
        }
        match by_month {
            true => {
                chart.x = "month".into();
                let names = self.months.iter().zip(1..);
                chart.x_names = names.map(|(m, i)| (f64::from(i), month_name(m))).collect();
                chart.x_ends = Some([0.4, self.months.len() as f64 + 0.6]);
            }
            false => {
                let year = self.days.first().and_then(|day| day.get(..4));
                chart.x = year.map_or("day".into(), |year| format!("day of {year}"));
                chart.x_names = day_names(&self.days, 1.0);
            }
        }
        if let [of] = &self.of[..] {
            chart.title += &format!(", {}", of.id);
        }
        if !by_month && self.of.iter().any(|of| !of.daylight.is_empty()) {
            let (name, colour) = (Some("daylight alone".into()), Series::GREY);
            let (stroke, points) = (Stroke::Dashed, Vec::new());
            chart.series.push(Series { name, colour, stroke, points });
        }
        chart
    }

    /// Adds a column for each month: its light or, where it is known, daylight with that of lamps
    /// on it, and its standard error; and behind it a pale one from its least day to its greatest.
    fn columns(&self, of: &OfId, series: &mut Vec<Series>) {
        let (mut lower, mut upper) = (Vec::new(), Vec::new());
        let (mut ranges, mut errors) = (Vec::new(), Vec::new());
        let mut first = 0;
        for (m, (month, &[mean, error])) in self.months.iter().zip(&of.months).enumerate() {
            let x = (m + 1) as f64;
            let own = self.days.iter().skip(first).take_while(|day| day.starts_with(month));
            let last = (first + own.count()).min(of.days.len());
            let days = of.days[first..last].iter().map(|[light, _]| *light);
            let sum: f64 = days.clone().sum();
            let middle = match of.daylight.get(first..last).filter(|_| sum > 0.0) {
                Some(daylight) => mean * (daylight.iter().sum::<f64>() / sum).clamp(0.0, 1.0),
                None => mean,
            };
            lower.extend([(x, 0.0), (x, middle)]);
            upper.extend([(x, middle), (x, mean)]);
            let end = |best: fn(f64, f64) -> f64| days.clone().reduce(best);
            ranges.extend([end(f64::min), end(f64::max)].into_iter().flatten().map(|y| (x, y)));
            if error > 0.0 {
                errors.extend([(x, mean - error), (x, mean + error)]);
            }
            first = last;
        }
        let column = |pale| Stroke::Columns { width: if pale { RANGE } else { MEAN }, pale };
        let days = "least to greatest day";
        match of.daylight.is_empty() {
            true => {
                add(series, Some(days), of.colour, column(true), ranges);
                add(series, Some("mean of the days"), of.colour, column(false), lower);
            }
            // colours tell daylight from lamps; the range is that of both, and has neither
            false => {
                add(series, Some(days), Series::GREY, column(true), ranges);
                add(series, Some("daylight, mean"), DAYLIGHT, column(false), lower);
                add(series, Some("lamps, mean"), LAMPS, column(false), upper);
            }
        }
        add(series, Some("± standard error (Monte Carlo)"), 0, Stroke::Whiskers, errors);
    }
}

/// Adds a line through the days with their errors, and one through what of them is daylight.
fn lines(of: &OfId, named: bool, series: &mut Vec<Series>) {
    let colour = of.colour;
    let places = || (1..).map(f64::from);
    let days = || places().zip(&of.days);
    let bars = days().flat_map(|(x, &[light, error])| error_bar(x, light, Some(error), false));
    add(series, None, colour, Stroke::Bars, bars.collect());
    let line = days().map(|(x, [light, _])| (x, *light)).collect();
    add(series, named.then_some(&of.id), colour, Stroke::Line, line);
    add(series, None, colour, Stroke::Dashed, places().zip(of.daylight.iter().copied()).collect());
}

fn add(
    series: &mut Vec<Series>,
    name: Option<&str>,
    colour: usize,
    stroke: Stroke,
    points: Vec<(f64, f64)>,
) {
    if !points.is_empty() {
        series.push(Series { name: name.map(String::from), colour, stroke, points });
    }
}

/// Returns the name of a month at the axis, such as `Jun` for `2005-06`.
pub(super) fn month_name(month: &str) -> String {
    let names =
        ["Jan", "Feb", "Mar", "Apr", "May", "Jun", "Jul", "Aug", "Sep", "Oct", "Nov", "Dec"];
    let number: Option<usize> = month.rsplit('-').next().and_then(|number| number.parse().ok());
    number.and_then(|n| names.get(n.wrapping_sub(1))).map_or(month.into(), |name| name.to_string())
}

/// Returns names of days, such as `21 Jun` for `2005-06-21`, with their places: of at most eight that
/// are evenly apart.
pub(super) fn day_names(days: &[String], first: f64) -> Vec<(f64, String)> {
    let every = days.len().div_ceil(8).max(1);
    let name = |(i, day): (usize, &String)| {
        let date = day.rsplit_once('-').and_then(|(month, of)| {
            let of: u8 = of.parse().ok()?;
            Some(format!("{of} {}", month_name(month)))
        });
        (first + i as f64, date.unwrap_or_else(|| day.clone()))
    };
    days.iter().enumerate().step_by(every).map(name).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The days of a month alone have dates at the axis.
    #[test]
    fn days_have_dates() {
        let days: Vec<String> = (1..=30).map(|day| format!("2005-06-{day:02}")).collect();
        let values = vec![[1.0, 0.1]; days.len()];
        let of = OfId { id: "bench".into(), days: values, ..OfId::default() };
        let months = vec!["2005-06".to_string()];
        let chart = DailyLight { months, days, of: vec![of], ..DailyLight::default() }.chart();
        let names: Vec<&str> = chart.x_names.iter().map(|(_, name)| name.as_str()).collect();
        assert_eq!(names[..3], ["1 Jun", "5 Jun", "9 Jun"]);
        assert_eq!((names.len(), chart.x_names[1].0, &*chart.x), (8, 5.0, "day of 2005"));
    }
}
