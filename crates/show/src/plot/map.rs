//! The plot of the irradiance on sensors over the plane that they lie in.

use super::{
    chosen::{Chosen, nothing},
    drawing::{Drawn, Plot},
    heat_map::{HeatMap, HeatMaps},
};
use crate::picture::{Scale, label};
use phylux_core::error::Result;
use phylux_results::result::CaptorResult;

/// Limit on the number of planes in one picture.
const MOST: usize = 6;
/// Tolerance for sensors of one plane: the cosine between their normals is above 1 less this, and
/// their distances from the plane are at most this fraction of the extent of all sensors.
const FLAT: f64 = 1e-3;
const AXES: [&str; 3] = ["x", "y", "z"];

/// Sensors in one plane.
struct Plane<'a> {
    /// Index of the axis to which the plane is most nearly perpendicular.
    across: usize,
    normal: [f64; 3],
    /// Distance from the origin along the normal, m.
    offset: f64,
    sensors: Vec<&'a CaptorResult>,
}

pub(super) fn map(chosen: &Chosen, range: Option<(f64, f64)>) -> Result<Plot> {
    let sensors: Vec<&CaptorResult> =
        chosen.captors().filter(|captor| captor.kind == "virtual").collect();
    let mut planes = planes(&sensors);
    planes.retain(|plane| plane.map(chosen).is_some_and(|map| !map.triangles().is_empty()));
    if planes.is_empty() {
        return Err(nothing(
            "have no three sensors in a plane and not in a line, so there is no map to draw",
            "add a grid of sensors to the scene, or plot something else (--show)",
        ));
    }
    let mut notes = Vec::new();
    if planes.len() > MOST {
        // the planes with the most sensors are kept, in the order of the file
        let mut counts: Vec<usize> = planes.iter().map(|plane| plane.sensors.len()).collect();
        counts.sort_unstable_by(|a, b| b.cmp(a));
        notes.push(format!(
            "{} planes of sensors, of which {MOST} with the most are drawn: choose with --captors",
            planes.len()
        ));
        let least = counts[MOST - 1];
        planes.retain(|plane| plane.sensors.len() >= least);
        planes.truncate(MOST);
    }
    let drawn: usize = planes.iter().map(|plane| plane.sensors.len()).sum();
    if drawn < sensors.len() {
        notes.push(format!("{} sensors are in none of the planes drawn", sensors.len() - drawn));
    }
    let maps: Vec<HeatMap> = planes.iter().filter_map(|plane| plane.map(chosen)).collect();
    let scale = match range {
        Some((low, high)) => Scale::new(low, high, false)?,
        None => Scale::around(maps.iter().flat_map(HeatMap::drawn_values)),
    };
    let label = format!("{}, {}", chosen.light_name(), chosen.per_area());
    let maps = HeatMaps { maps, scale, label };
    Ok(Plot { drawn: Drawn::Maps(maps), notes })
}

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

impl Plane<'_> {
    /// Describes the direction in which the sensors look, if that is not up.
    fn facing(&self) -> String {
        match (self.across, self.normal[self.across] > 0.0) {
            (2, true) => String::new(),
            (2, false) => ", looking down".into(),
            (axis, up) => format!(", looking to {}{}", if up { "+" } else { "-" }, AXES[axis]),
        }
    }

    /// Returns the map of the sensors over their two other coordinates; `None` with fewer than
    /// three sensors.
    fn map(&self, chosen: &Chosen) -> Option<HeatMap> {
        let [right, up] = match self.across {
            0 => [1, 2],
            1 => [0, 2],
            _ => [0, 1],
        };
        let place = |sensor: &&CaptorResult| (sensor.center[right], sensor.center[up]);
        let value = |sensor: &&CaptorResult| sensor.front.irradiance[chosen.band];
        let upright = self.normal[self.across].abs() > 1.0 - FLAT;
        let middle: f64 = self.sensors.iter().map(|sensor| sensor.center[self.across]).sum();
        let at = 1e-6 * (1e6 * middle / self.sensors.len() as f64).round();
        let name = AXES[self.across];
        (self.sensors.len() >= 3).then(|| HeatMap {
            title: match upright {
                true => format!("{name} = {} m{}", label(at), self.facing()),
                false => format!("a plane across {name}, oblique"),
            },
            axes: [right, up].map(|axis| format!("{}, m", AXES[axis])),
            points: self.sensors.iter().map(place).collect(),
            values: self.sensors.iter().map(value).collect(),
        })
    }
}
