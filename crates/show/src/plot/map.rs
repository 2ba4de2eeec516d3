//! The plot of the light on sensors over the plane that they lie in.

use std::collections::{HashMap, HashSet};

use super::{
    chosen::{AXES, Chosen, FLAT, left_out, nothing, set_of},
    drawing::{Drawn, Plot},
    field::{Corner, Field, median, parts},
    heat_map::{HeatMap, HeatMaps},
    line::lines,
};
use crate::picture::label;
use phylux_core::{
    error::{Result, setting},
    math::units::{printed, rounded},
    words,
};
use phylux_results::result::{CaptorResult, Evenness};

/// Limit on the number of maps in one picture.
const MOST: usize = 12;
/// Parts of a plane have maps of their own if together they fill less than this part of it.
const FILLED: f64 = 0.5;

/// Sensors in one plane.
struct Plane<'a> {
    /// Index of the axis to which the plane is most nearly perpendicular.
    across: usize,
    normal: [f64; 3],
    /// Distance from the origin along the normal, m.
    offset: f64,
    sensors: Vec<&'a CaptorResult>,
}

/// A map, and the sensors in it.
type Mapped<'a> = (HeatMap, Vec<&'a CaptorResult>);

pub(super) fn map(chosen: &Chosen, range: Option<(f64, f64)>) -> Result<Plot> {
    let sensors: Vec<&CaptorResult> =
        chosen.captors().filter(|captor| captor.kind == "virtual").collect();
    let planes = planes(&sensors);
    let whole = || planes.iter().filter_map(|plane| plane.map(chosen, None));
    let mut maps: Vec<Mapped> = planes.iter().flat_map(|plane| plane.maps(chosen)).collect();
    if maps.len() > MOST {
        maps = whole().collect();
    }
    if maps.is_empty() {
        if let Some(plot) = lines(chosen) {
            return Ok(plot);
        }
        return Err(nothing(
            "no three sensors look the same way and stand side by side in a plane, or in a lying row of \
             one list, so there is no map to draw",
            words![
                "add a grid of sensors to the scene, or plot something else (",
                setting("show"),
                ")"
            ],
        ));
    }
    let mut notes = Vec::new();
    if maps.len() > MOST {
        // the planes with the most sensors are kept, in the order of the file
        let mut counts: Vec<usize> = maps.iter().map(|(_, sensors)| sensors.len()).collect();
        counts.sort_unstable_by(|a, b| b.cmp(a));
        let planes = maps.len();
        notes.push(words![
            format!(
                "{planes} planes of sensors, of which {MOST} with the most are drawn: choose with "
            ),
            setting("captors")
        ]);
        let least = counts[MOST - 1];
        maps.retain(|(_, sensors)| sensors.len() >= least);
        maps.truncate(MOST);
    }
    let drawn: HashSet<&str> =
        maps.iter().flat_map(|(_, sensors)| sensors).map(|sensor| &*sensor.id).collect();
    let ids = sensors.iter().map(|sensor| &*sensor.id);
    let why = "a map takes three that look the same way and do not stand in one row";
    notes.extend(left_out(ids.filter(|id| !drawn.contains(id)), "map", why));
    let maps = maps.into_iter().map(|(map, _)| map).collect();
    let (light, unit) = chosen.map_light();
    let maps = HeatMaps::new(maps, range, format!("{light}, {unit}"))?;
    Ok(Plot { drawn: Drawn::Maps(maps), notes })
}

/// Returns the planes in which sensors lie: their normals are one direction, and their distances from
/// the plane are at most `FLAT` of the extent of all sensors.
fn planes<'a>(sensors: &[&'a CaptorResult]) -> Vec<Plane<'a>> {
    let extent = (0..3).map(|axis| {
        let places = sensors.iter().map(|sensor| sensor.center[axis]);
        let (low, high) = places
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), p| (low.min(p), high.max(p)));
        high - low
    });
    let near = FLAT * extent.fold(0.0, f64::max).max(1e-9);
    let mut planes: Vec<Plane> = Vec::new();
    for sensor in sensors {
        let normal = sensor.normal;
        let dot = |a: [f64; 3], b: [f64; 3]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        if dot(normal, normal) < 0.5 {
            continue;
        }
        let offset = dot(normal, sensor.center);
        let own = planes.iter_mut().find(|plane| {
            dot(plane.normal, normal) > 1.0 - FLAT && (plane.offset - offset).abs() <= near
        });
        match own {
            Some(plane) => plane.sensors.push(sensor),
            None => {
                let across = (0..3).max_by(|a, b| normal[*a].abs().total_cmp(&normal[*b].abs()));
                let across = across.unwrap_or(2);
                planes.push(Plane { across, normal, offset, sensors: vec![sensor] });
            }
        }
    }
    planes
}

impl<'a> Plane<'a> {
    /// Describes the direction in which the sensors look, if that is not up.
    fn facing(&self) -> String {
        match (self.across, self.normal[self.across] > 0.0) {
            (2, true) => String::new(),
            (2, false) => ", looking down".into(),
            (axis, up) => format!(", looking to {}{}", if up { "+" } else { "-" }, AXES[axis]),
        }
    }

    /// Returns the axes of a map of the plane: to the right and upwards.
    fn axes(&self) -> [usize; 2] {
        match self.across {
            0 => [1, 2],
            1 => [0, 2],
            _ => [0, 1],
        }
    }

    /// Returns the place of a sensor in the map with its value, and the standard error of this.
    fn point(&self, chosen: &Chosen, sensor: &CaptorResult) -> (Corner, Option<f64>) {
        let [right, up] = self.axes();
        let (value, error) = chosen.map_value(&sensor.front);
        ((sensor.center[right], sensor.center[up], value), error)
    }

    /// Returns the map of the whole plane or, where its parts are far apart, one of each of them.
    fn maps(&self, chosen: &Chosen) -> Vec<Mapped<'a>> {
        let (points, parts) = self.parts(chosen);
        let filled = |numbers: &[usize]| {
            let side = |axis: fn(&Corner) -> f64| {
                let places = || numbers.iter().map(|&i| axis(&points[i]));
                let ends = places().reduce(f64::min).zip(places().reduce(f64::max));
                ends.map_or(0.0, |(low, high)| high - low)
            };
            side(|p| p.0) * side(|p| p.1)
        };
        let all: Vec<usize> = parts.concat();
        let of_parts: f64 = parts.iter().map(|part| filled(part)).sum();
        match parts.len() > 1 && of_parts < FILLED * filled(&all) {
            true => parts.iter().filter_map(|part| self.map(chosen, Some(part))).collect(),
            false => self.map(chosen, None).into_iter().collect(),
        }
    }

    /// Returns the places and values of the sensors, and the parts of the plane that they fill.
    fn parts(&self, chosen: &Chosen) -> (Vec<Corner>, Vec<Vec<usize>>) {
        let points = self.sensors.iter().map(|sensor| self.point(chosen, sensor).0);
        let points: Vec<Corner> = points.collect();
        let parts = parts(&points, &self.sets());
        (points, parts)
    }

    /// Returns the number of the grid or list to which each sensor belongs.
    fn sets(&self) -> Vec<usize> {
        let mut numbers: HashMap<&str, usize> = HashMap::new();
        let sets = self.sensors.iter().map(|sensor| {
            let next = numbers.len();
            *numbers.entry(set_of(&sensor.id)).or_insert(next)
        });
        sets.collect()
    }

    /// Returns the map of some of the sensors, or of all; `None` if they fill no part of the plane.
    fn map(&self, chosen: &Chosen, part: Option<&[usize]>) -> Option<Mapped<'a>> {
        let sensors = match part {
            Some(part) => part.iter().map(|&i| self.sensors[i]).collect(),
            None => self.sensors.clone(),
        };
        let plane = Plane { sensors, ..*self };
        let (points, parts) = plane.parts(chosen);
        if parts.is_empty() {
            return None;
        }
        let field = Field::with_bands(&points, &plane.sets());
        let errors = plane.sensors.iter().map(|sensor| plane.point(chosen, sensor).1);
        let errors: Vec<Option<f64>> = errors.collect();
        let error = median(errors.iter().copied().flatten().collect());
        let even = even(points.iter().map(|point| point.2).zip(errors.iter().copied()));
        let map = HeatMap {
            title: plane.title(chosen),
            axes: plane.axes().map(|axis| format!("{}, m", AXES[axis])),
            points,
            field,
            facts: plane.facts(chosen, error, even),
            error,
            even,
        };
        Some((map, plane.sensors))
    }

    /// Returns what a grower wants to know of the sensors: their mean, how even they are, weighted by
    /// their areas, and the median of their errors.
    fn facts(&self, chosen: &Chosen, error: Option<f64>, even: Option<f64>) -> Vec<String> {
        let unit = printed(chosen.map_light().1);
        let error = error.filter(|error| *error > 0.0);
        if let Some((mean, error)) = even.zip(error) {
            let value = rounded(mean, error).join(" ± ");
            return vec![format!("{value} {unit}"), "even within its error".into()];
        }
        let values = self.sensors.iter().map(|sensor| {
            let (value, error) = chosen.map_value(&sensor.front);
            (value, error, sensor.area)
        });
        let Some(Evenness { mean: (mean, _), min: (min, _), cv }) = Evenness::of(values) else {
            return Vec::new();
        };
        let digits = error.unwrap_or(1e-3 * mean.abs().max(f64::MIN_POSITIVE));
        let mut facts = vec![format!("mean {} {unit}", rounded(mean, digits)[0])];
        if let Some((cv, _)) = cv {
            facts.push(format!("min/mean {:.2}", min / mean));
            facts.push(format!("CV {:.1} %", 100.0 * cv));
        }
        facts.extend(error.map(|e| format!("median error {} {unit}", rounded(e, e)[1])));
        facts
    }

    /// Names the grids of the sensors, if they are few, and says where the plane is.
    fn title(&self, chosen: &Chosen) -> String {
        let upright = self.normal[self.across].abs() > 1.0 - FLAT;
        let middle: f64 = self.sensors.iter().map(|sensor| sensor.center[self.across]).sum();
        let at = 1e-6 * (1e6 * middle / self.sensors.len() as f64).round();
        let name = AXES[self.across];
        let plane = match upright {
            true => format!("{name} = {} m{}", label(at), self.facing()),
            false => format!("a plane across {name}, oblique"),
        };
        let mut sets: Vec<&str> = self.sensors.iter().map(|sensor| set_of(&sensor.id)).collect();
        sets.dedup();
        let names = match sets[..] {
            [one] if !one.is_empty() => format!("{one}, "),
            [one, other] if !one.is_empty() && !other.is_empty() => format!("{one} and {other}, "),
            _ => String::new(),
        };
        let of = chosen.of.map_or(String::new(), |of| format!(", {of}"));
        format!("{names}{plane}{of}")
    }
}

/// Returns the mean of values that differ by no more than their standard errors explain: the sum of
/// their squared deviations in errors is less than two standard deviations above what chance makes
/// it. `None` if they differ by more, or an error is not known.
fn even(values: impl Iterator<Item = (f64, Option<f64>)>) -> Option<f64> {
    let known: Option<Vec<(f64, f64)>> =
        values.map(|(value, error)| Some((value, error.filter(|e| *e > 0.0)?))).collect();
    let known = known.filter(|known| known.len() > 1)?;
    let mean = known.iter().map(|(value, _)| value).sum::<f64>() / known.len() as f64;
    let squares = known.iter().map(|(value, error)| ((value - mean) / error).powi(2));
    let free = known.len() as f64 - 1.0;
    (squares.sum::<f64>() <= free + 2.0 * (2.0 * free).sqrt()).then_some(mean)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 24 values whose noise is their error are even, also a little more of it is; a slope of ten
    /// errors is not, nor are values without errors.
    #[test]
    fn noise_is_even() {
        let of = |noise: f64, slope: f64, error: Option<f64>| {
            // of these numbers the mean is 0 and the mean square 1
            let value =
                |i: i32| 400.0 + noise * f64::from(1 - 2 * (i % 2)) + slope * f64::from(i) / 24.0;
            even((0..24).map(|i| (value(i), error)))
        };
        assert_eq!(of(7.0, 0.0, Some(7.0)), Some(400.0));
        assert!(of(8.0, 0.0, Some(7.0)).is_some() && of(10.0, 0.0, Some(7.0)).is_none());
        assert!(of(7.0, 70.0, Some(7.0)).is_none());
        assert!(of(0.0, 0.0, None).is_none() && of(0.0, 0.0, Some(0.0)).is_none());
    }
}
