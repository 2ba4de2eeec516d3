//! The plot of the light on sensors that stand in lines, over their places along these.

use indexmap::IndexMap;

use super::{
    chosen::{AXES, Chosen, error_bar, left_out, set_of},
    drawing::{Drawn, Plot},
};
use crate::{
    chart::{Chart, Series, Stroke},
    picture::label,
};
use phylux_core::{error::setting, words};
use phylux_results::result::CaptorResult;

/// Limit on the number of lines, each with a colour of its own.
const MOST: usize = 7;
/// Sensors stand in a line if their distances from it are at most this fraction of its length.
const STRAIGHT: f64 = 1e-3;

/// Sensors in a line.
struct Line<'a> {
    /// The name that they share.
    set: &'a str,
    /// Index of the axis along which the line is longest.
    axis: usize,
    /// The sensors, in the order of their places along the axis.
    sensors: Vec<&'a CaptorResult>,
}

impl<'a> Line<'a> {
    /// Returns the line on which sensors stand, each at a place of its own; `None` if they are fewer
    /// than three, or if they do not stand so.
    fn of(set: &'a str, mut sensors: Vec<&'a CaptorResult>) -> Option<Self> {
        let ends = |axis: usize| {
            let places = || sensors.iter().map(move |sensor| sensor.center[axis]);
            Some([places().reduce(f64::min)?, places().reduce(f64::max)?])
        };
        let extent = |axis: usize| ends(axis).map_or(0.0, |[low, high]| high - low);
        let axis = (0..3).max_by(|a, b| extent(*a).total_cmp(&extent(*b)))?;
        sensors.sort_by(|a, b| a.center[axis].total_cmp(&b.center[axis]));
        let [.., last] = sensors[..] else { return None };
        let first = sensors[0];
        let length = last.center[axis] - first.center[axis];
        let is_near = |sensor: &&CaptorResult| {
            let share = (sensor.center[axis] - first.center[axis]) / length;
            (0..3).all(|i| {
                let straight = first.center[i] + share * (last.center[i] - first.center[i]);
                (sensor.center[i] - straight).abs() <= STRAIGHT * length
            })
        };
        let apart = |pair: &[&CaptorResult]| {
            pair[1].center[axis] - pair[0].center[axis] > STRAIGHT * length
        };
        let is_line = sensors.len() > 2
            && length > 0.0
            && sensors.iter().all(is_near)
            && sensors.windows(2).all(apart);
        is_line.then_some(Self { set, axis, sensors })
    }

    /// Says where the line is, as `y = 3 m, z = 0.3 m`; along the other axes if it is oblique.
    fn place(&self) -> String {
        let of = |axis: usize| {
            let places = self.sensors.iter().map(|sensor| sensor.center[axis]);
            let (low, high) = places
                .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), p| (f64::min(l, p), h.max(p)));
            let [low, high] = [low, high].map(|end| 1e-6 * (1e6 * end).round());
            let name = AXES[axis];
            match high - low < 1e-6 {
                true => format!("{name} = {} m", label(low)),
                false => format!("{name} = {} to {} m", label(low), label(high)),
            }
        };
        let others: Vec<String> = (0..3).filter(|&axis| axis != self.axis).map(of).collect();
        others.join(", ")
    }
}

/// Draws lines of sensors over their places along the axis that most of them follow, with errors.
/// `None` if there is no line, or none that lies.
pub(super) fn lines(chosen: &Chosen) -> Option<Plot> {
    let mut sets: IndexMap<&str, Vec<&CaptorResult>> = IndexMap::new();
    for sensor in chosen.captors().filter(|captor| captor.kind == "virtual") {
        sets.entry(set_of(&sensor.id)).or_default().push(sensor);
    }
    let all: Vec<Line> =
        sets.into_iter().filter_map(|(set, sensors)| Line::of(set, sensors)).collect();
    let along = |axis: usize| all.iter().filter(move |line| line.axis == axis);
    // those of one length may be of either axis: the first is taken. Upright ones are profiles
    let axis = if along(0).count() >= along(1).count() { 0 } else { 1 };
    let lines: Vec<&Line> = along(axis).collect();
    let (light, unit) = chosen.map_light();
    let first: Vec<&str> = lines.iter().take(MOST).map(|line| &*line.sensors[0].id).collect();
    let colours = chosen.names().colours(&first);
    let mut series = Vec::new();
    for (line, colour) in lines.iter().zip(colours) {
        let (mut points, mut bars) = (Vec::new(), Vec::new());
        for sensor in &line.sensors {
            let (value, error) = chosen.map_value(&sensor.front);
            points.push((sensor.center[axis], value));
            bars.extend(error_bar(sensor.center[axis], value, error, false));
        }
        let name = (lines.len() > 1).then(|| line.set.to_string());
        series.push(Series { name: None, colour, stroke: Stroke::Bars, points: bars });
        series.push(Series { name, colour, stroke: Stroke::Line, points });
    }
    let of = chosen.of.map_or(String::new(), |of| format!(", {of}"));
    let title = match lines[..] {
        [] => return None,
        [line] if line.set.is_empty() => format!("{light} along {}{of}", line.place()),
        [line] => format!("{light} along {}, {}{of}", line.set, line.place()),
        _ => format!("{light} along lines of sensors{of}"),
    };
    let chart = Chart {
        title,
        x: format!("{}, m", AXES[axis]),
        y: format!("{light}, {unit}"),
        linear_x: true,
        linear_y: true,
        series,
        ..Chart::default()
    };
    let mut notes = Vec::new();
    if lines.len() > MOST {
        let count = lines.len();
        notes.push(words![
            format!("{count} lines of sensors, of which the first {MOST} are drawn: choose with "),
            setting("captors")
        ]);
    }
    if lines.len() <= MOST {
        let drawn: Vec<&str> =
            lines.iter().flat_map(|line| &line.sensors).map(|sensor| &*sensor.id).collect();
        let sensors = chosen.captors().filter(|captor| captor.kind == "virtual");
        let ids = sensors.map(|sensor| &*sensor.id).filter(|id| !drawn.contains(id));
        let why = "a line takes three of one list in a lying row";
        notes.extend(left_out(ids, "line", why));
    }
    Some(Plot { drawn: Drawn::Charts(vec![chart]), notes })
}
