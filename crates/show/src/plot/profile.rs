//! The plot of light over height.

use indexmap::IndexMap;

use super::{
    chosen::{AXES, Chosen, FLAT, error_bar, nothing, set_of},
    colours::told_apart,
    drawing::{Drawn, Plot},
    lying::{ERRORS, Row, marks, with_error},
    organ::Organ,
};
use crate::{
    chart::{Chart, Series, Stroke},
    picture::label,
};
use phylux_core::{error::Result, math::units::printed, words};

/// Limit on the number of heights at which means are taken.
const SLICES: usize = 12;
/// Limit on the number of objects whose surfaces have lines of their own, and on that of lines with a
/// dot for each captor: those of more would hide the lines.
const MOST: usize = 3;
const WITH_DOTS: usize = 3;

/// A captor's height (m), value and standard error per area, and area (m2).
#[derive(Clone, Copy)]
struct Point {
    height: f64,
    value: f64,
    error: Option<f64>,
    area: f64,
    /// Whether it is a part with a rank, as a leaf is.
    ranked: bool,
}

/// The mean over captors at about the same height.
struct Slice {
    height: f64,
    value: f64,
    error: f64,
}

/// Captors of one kind, whose means one line joins.
struct Kind {
    name: String,
    /// What is plotted of them, where the axis may not say it.
    light: String,
    /// Index of its colour.
    colour: usize,
    is_sensors: bool,
    points: Vec<Point>,
    /// Whether light at different heights can be compared: not where sensors face different ways.
    is_alike: bool,
}

/// Draws a profile of captors at several heights. Error: they are at one alone.
pub(super) fn profile_of_many(chosen: &Chosen) -> Result<Plot> {
    let plot = profile(chosen)?;
    match plot.notes.is_empty() {
        true => Ok(plot),
        false => {
            Err(nothing("all captors are at one height", "run a scene with captors at others"))
        }
    }
}

pub(super) fn profile(chosen: &Chosen) -> Result<Plot> {
    let (sensors, surfaces) = (sensors(chosen), surfaces(chosen));
    let band = chosen.of_band();
    let (what, light, band) = match [&sensors, &surfaces].map(Vec::is_empty) {
        [false, true] => (chosen.light_name(), chosen.light_name(), String::new()),
        [true, _] => ("absorbed".into(), "absorbed per area".into(), band),
        [false, false] => ("light".into(), "light per area".into(), band),
    };
    let mut all: Vec<(Kind, Vec<Slice>)> = sensors
        .into_iter()
        .chain(surfaces)
        .map(|kind| {
            // also the dots, as a stem beside the means of leaves is taken for one of them
            let points = leaves(&kind.points);
            let means = slices(points.clone());
            (Kind { points, ..kind }, means)
        })
        .collect();
    if all.is_empty() {
        return Err(nothing("there are no captors", "run a scene with sensors or captors"));
    }
    let colours = told_apart(all.iter().map(|(kind, _)| kind.colour).collect());
    all.iter_mut().zip(colours).for_each(|((kind, _), colour)| kind.colour = colour);
    let (x, both) = (format!("{light}, {}", chosen.per_area()), what == "light");
    if all.iter().all(|(_, means)| means.len() < 2) {
        let chart = at_one_height(format!("{light}{band}"), &x, all, both);
        let note = words!["captors are at one height alone, so no line shows a course over height"];
        return Ok(Plot { drawn: Drawn::Charts(vec![chart]), notes: vec![note] });
    }
    let with_dots = all.iter().filter(|(_, means)| means.len() > 1).count() <= WITH_DOTS;
    let of_kind = |all| series(all, with_dots, both, chosen.per_area());
    let dots = if with_dots { "pale dots: single captors; " } else { "" };
    let chart = Chart {
        title: format!("{what} over height{band}"),
        note: format!("marks: means at a height; {dots}bars: standard errors (Monte Carlo)"),
        x,
        y: "height z, m".into(),
        linear_x: true,
        linear_y: true,
        amounts_across: true,
        series: all.into_iter().flat_map(of_kind).collect(),
        ..Chart::default()
    };
    Ok(Plot { drawn: Drawn::Charts(vec![chart]), notes: Vec::new() })
}

/// Returns what is drawn of a kind of captors over height: a line through means with errors, and dots.
/// Beside surfaces, sensors have hollow marks.
fn series(
    (kind, means): (Kind, Vec<Slice>),
    with_dots: bool,
    with_both: bool,
    unit: &str,
) -> Vec<Series> {
    let colour = kind.colour;
    let add = |name, stroke, points| Series { name, colour, stroke, points };
    let dots = kind.points.iter().filter(|_| with_dots).map(|point| (point.value, point.height));
    let bars = means.iter().flat_map(|s| error_bar(s.height, s.value, Some(s.error), true));
    let joined: Vec<(f64, f64)> = means.iter().map(|slice| (slice.value, slice.height)).collect();
    let mut name = kind.name + &kind.light;
    // a single place has its value in words
    if let [one] = &means[..] {
        name += &format!(": {} {}", with_error(one.value, one.error), printed(unit));
    }
    let stroke = match kind.is_alike && joined.len() > 1 {
        true if kind.is_sensors && with_both => Stroke::Hollow,
        true => Stroke::Line,
        false => Stroke::Marks,
    };
    vec![
        add(None, Stroke::Dots, dots.collect()),
        add(None, Stroke::Bars, bars.collect()),
        add(Some(name), stroke, joined),
    ]
}

/// Draws captors that have no course over height: a row for each kind, with its mean, from above to
/// below and then from bright to dark. Rows say what is plotted if that is not the same for all, and
/// their height, if they have not one.
fn at_one_height(title: String, x: &str, all: Vec<(Kind, Vec<Slice>)>, with_light: bool) -> Chart {
    let mut all: Vec<(Kind, Slice)> =
        all.into_iter().flat_map(|(kind, means)| Some((kind, means.into_iter().next()?))).collect();
    all.sort_by(|(_, a), (_, b)| {
        b.height.total_cmp(&a.height).then_with(|| b.value.total_cmp(&a.value))
    });
    let height = |mean: &Slice| format!("z = {} m", label(1e-6 * (1e6 * mean.height).round()));
    let heights: Vec<String> = all.iter().map(|(_, mean)| height(mean)).collect();
    let one = heights.windows(2).all(|pair| pair[0] == pair[1]);
    let title = match heights.first() {
        Some(height) if one => format!("{title}, {height}"),
        _ => title,
    };
    let row = |((kind, mean), height): (&(Kind, Slice), &String)| Row {
        name: [
            &*kind.name,
            if with_light { &*kind.light } else { "" },
            if one { "" } else { ", " },
            if one { "" } else { height },
        ]
        .concat(),
        value: mean.value,
        error: Some(mean.error),
        colour: kind.colour,
    };
    let rows = all.iter().zip(&heights).map(row).collect();
    let dots = all.iter().map(|(kind, _)| kind.points.iter().map(|point| point.value).collect());
    let chart = marks(title, x, rows, dots.collect());
    Chart { note: format!("marks: means; pale dots: single captors; {ERRORS}"), ..chart }
}

/// Returns the sensors, by the way that they face.
fn sensors(chosen: &Chosen) -> Vec<Kind> {
    let mut ways: IndexMap<Option<String>, Vec<Point>> = IndexMap::new();
    let all = || chosen.captors().filter(|captor| captor.kind == "virtual");
    for sensor in all() {
        ways.entry(way(sensor.normal)).or_default().push(Point {
            height: sensor.center[2],
            value: sensor.front.irradiance[chosen.band],
            error: sensor.front.irradiance_se[chosen.band],
            area: sensor.area,
            ranked: false,
        });
    }
    let one = ways.len() == 1;
    // sensors of one list have its colour
    let set = all().next().map(|sensor| set_of(&sensor.id)).filter(|set| !set.is_empty());
    let set = set.filter(|set| one && all().all(|sensor| set_of(&sensor.id) == *set));
    let own = set.map(|set| chosen.names().colour(set));
    let kind = |(i, (way, points)): (usize, (Option<String>, _))| {
        let (name, light) = match &way {
            _ if one => ("sensors".into(), format!(", {}", chosen.light_name())),
            Some(way) => (format!("sensors facing {way}"), String::new()),
            None => ("sensors facing other ways".into(), String::new()),
        };
        let colour = own.unwrap_or(if i % 2 == 0 { Series::BLACK } else { Series::GREY });
        Kind { name, light, colour, is_sensors: true, points, is_alike: way.is_some() }
    };
    ways.into_iter().enumerate().map(kind).collect()
}

/// Names the direction of a normal that is an axis.
fn way(normal: [f64; 3]) -> Option<String> {
    let axis = normal.iter().position(|part| part.abs() > 1.0 - FLAT)?;
    Some(match (axis, normal[axis] > 0.0) {
        (2, true) => "up".into(),
        (2, false) => "down".into(),
        (_, ahead) => format!("{}{}", if ahead { "+" } else { "-" }, AXES[axis]),
    })
}

/// Returns the surfaces, by object if these are few.
fn surfaces(chosen: &Chosen) -> Vec<Kind> {
    let mut objects: IndexMap<&str, Vec<Point>> = IndexMap::new();
    for captor in chosen.captors() {
        let (Some(absorbed), Some(error)) = (&captor.absorbed, &captor.absorbed_se) else {
            continue;
        };
        let per_area = |power: f64| power / captor.area;
        let Organ { object, rank, .. } = Organ::of(&captor.id);
        objects.entry(object).or_default().push(Point {
            height: captor.center[2],
            value: per_area(absorbed[chosen.band]),
            error: error[chosen.band].map(per_area),
            area: captor.area,
            ranked: rank.is_some(),
        });
    }
    let kind = |name: &str, colour: usize, points: Vec<Point>| {
        let by = if has_stems(&points) { " by leaves" } else { "" };
        let light = format!(", absorbed{by}");
        Kind { name: name.into(), light, colour, is_sensors: false, points, is_alike: true }
    };
    let names = chosen.names();
    match objects.len() {
        0 => Vec::new(),
        1..=MOST => objects
            .into_iter()
            .map(|(object, points)| kind(object, names.colour(object), points))
            .collect(),
        _ => vec![kind("surfaces", 0, objects.into_values().flatten().collect())],
    }
}

/// Whether some parts have ranks, as leaves do, and others do not, as stems.
fn has_stems(points: &[Point]) -> bool {
    points.iter().any(|point| point.ranked) && points.iter().any(|point| !point.ranked)
}

/// Returns the points that are drawn: where some have ranks, these alone, since a stem reaches over many
/// heights, and its middle says little.
fn leaves(points: &[Point]) -> Vec<Point> {
    let all = !has_stems(points);
    points.iter().filter(|point| all || point.ranked).copied().collect()
}

/// Returns area-weighted means at each height or, if there are many heights, in slices of equal
/// thickness.
fn slices(mut points: Vec<Point>) -> Vec<Slice> {
    points.sort_by(|a, b| a.height.total_cmp(&b.height));
    let Some((low, high)) = points.first().zip(points.last()).map(|(a, b)| (a.height, b.height))
    else {
        return Vec::new();
    };
    let thin = 1e-3 * (high - low).max(1e-9);
    let levels = points.chunk_by(|a, b| b.height - a.height <= thin).count();
    let slice = |point: &Point| {
        let place = (point.height - low) / (high - low).max(1e-9);
        ((place * SLICES as f64) as usize).min(SLICES - 1)
    };
    let together = |a: &Point, b: &Point| match levels <= SLICES {
        true => b.height - a.height <= thin,
        false => slice(a) == slice(b),
    };
    let mean = |points: &[Point]| {
        let area: f64 = points.iter().map(|point| point.area).sum();
        let over = |of: &dyn Fn(&Point) -> f64| {
            points.iter().map(|point| point.area * of(point)).sum::<f64>() / area
        };
        let variance = |point: &Point| point.area * point.error.unwrap_or(0.0).powi(2);
        Slice {
            height: over(&|point| point.height),
            value: over(&|point| point.value),
            error: (over(&variance) / area).sqrt(),
        }
    };
    points.chunk_by(together).map(mean).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two sensors of 1 and 3 m2 at one height: the mean is weighted by area, errors add in
    /// quadrature.
    #[test]
    fn slices_weigh_by_area() {
        let point = |height, value, error, area| Point {
            height,
            value,
            error: Some(error),
            area,
            ranked: false,
        };
        let points =
            vec![point(2.0, 5.0, 0.1, 1.0), point(0.5, 10.0, 0.4, 1.0), point(0.5, 2.0, 0.1, 3.0)];
        let found = slices(points);
        assert_eq!(found.len(), 2);
        assert_eq!((found[0].height, found[0].value), (0.5, 4.0));
        // sqrt(0.4^2 + 0.3^2) / 4
        assert!((found[0].error - 0.125).abs() < 1e-12, "{}", found[0].error);
        assert_eq!((found[1].height, found[1].value), (2.0, 5.0));
        // many heights make twelve slices, whatever the rounding
        let many = (0..100).map(|i| point(f64::from(i), 1.0, 0.0, 1.0)).collect();
        assert_eq!(slices(many).len(), SLICES);
    }

    /// A line joins leaves where there are some, and not the stem among them.
    #[test]
    fn stems_are_not_joined_with_leaves() {
        let point = |value, ranked| Point { height: 1.0, value, error: None, area: 1.0, ranked };
        let of = |ranked: [bool; 2]| {
            leaves(&[point(1.0, ranked[0]), point(2.0, ranked[1])]).iter().map(|p| p.value).sum()
        };
        let sums: [f64; 3] = [of([true, true]), of([true, false]), of([false, false])];
        assert_eq!(sums, [3.0, 1.0, 3.0]);
    }
}
