//! The planes that sensors in rows and columns sample: what the area of a grid is.
//!
//! A sensor of a grid is small, and stands for the cell of the grid about it. Cells are found from
//! the places of the sensors, so that it does not matter where these come from: a group of
//! equal sensors that stand in all crossings of evenly spaced rows and columns is a lattice, and its
//! cell is one spacing by the other.

use glam::DVec3;

use phylux_core::scene::{
    captor::{Captor, CaptorKind},
    world::Scene,
};

/// How far a sensor may be from its place in the lattice, in spacings.
const SLACK: f64 = 1e-3;

/// Sensors in rows and columns.
struct Lattice {
    /// Index of the group that they are.
    group: usize,
    /// Middle of the lattice, m.
    middle: DVec3,
    /// Unit normal of the plane, to which the fronts look.
    normal: DVec3,
    /// Half of the sides of the rectangle of all cells, m.
    half: [DVec3; 2],
    /// Area of a cell, m2.
    cell: f64,
}

/// Returns for each group of a scene the area of the plane that its sensors sample, m2; `None` where
/// they are not in one plane, in rows and columns.
pub(super) fn sampled_areas(scene: &Scene) -> Vec<Option<f64>> {
    let mut members: Vec<Vec<&Captor>> = vec![Vec::new(); scene.groups().len()];
    for captor in scene.captors() {
        captor.groups.iter().for_each(|&group| members[group].push(captor));
    }
    let lattices = members.iter().enumerate().filter_map(|(g, all)| Lattice::new(g, all));
    let mut lattices: Vec<Lattice> = lattices.collect();
    // a part of a grid may be a lattice of larger cells, so that the smallest count
    lattices.sort_by(|a, b| a.cell.total_cmp(&b.cell));
    let mut lattice_of = vec![None; members.len()];
    lattices.iter().enumerate().for_each(|(l, lattice)| lattice_of[lattice.group] = Some(l));
    let of = |captor: &Captor| captor.groups.iter().filter_map(|&g| lattice_of[g]).min();
    let area = |members: &Vec<&Captor>| {
        let first = members.first()?;
        let mut used: Vec<usize> = Vec::new();
        let mut sum = 0.0;
        for captor in members {
            let own = of(captor)?;
            let per_area = lattices[own].cell / captor.area;
            let expected = lattices[*used.first().unwrap_or(&own)].cell / first.area;
            // the mean of the group gives each sensor the weight of its area
            if (per_area / expected - 1.0).abs() > SLACK {
                return None;
            }
            if !used.contains(&own) {
                let beside = |&other: &usize| lattices[own].is_beside(&lattices[other]);
                used.iter().all(beside).then(|| used.push(own))?;
            }
            sum += lattices[own].cell;
        }
        Some(sum)
    };
    members.iter().map(area).collect()
}

impl Lattice {
    /// Finds the lattice of a group's sensors; `None` if they are none.
    fn new(group: usize, sensors: &[&Captor]) -> Option<Self> {
        let first = sensors.first()?;
        let normal = first.normal;
        let alike = |sensor: &&Captor| {
            matches!(sensor.kind, CaptorKind::Virtual { .. })
                && !sensor.sensor.is_sphere
                && (sensor.area / first.area - 1.0).abs() < SLACK
                && sensor.normal.distance(normal) < SLACK
        };
        if !sensors.iter().all(alike) {
            return None;
        }
        // the nearest neighbour of the first is beside it in its row or column
        let to = |sensor: &&Captor| sensor.center - first.center;
        let distances = sensors.iter().map(|sensor| (to(sensor).length(), to(sensor)));
        let (spacing, along) =
            distances.filter(|(length, _)| *length > 0.0).min_by(|a, b| a.0.total_cmp(&b.0))?;
        let slack = SLACK * spacing;
        let x = along / spacing;
        let y = normal.cross(x);
        let in_plane = |sensor: &&Captor| to(sensor).dot(normal).abs() <= slack;
        if normal.length() < 0.5 || x.dot(normal).abs() > SLACK || !sensors.iter().all(in_plane) {
            return None;
        }
        let [columns, rows] = [x, y].map(|axis| Steps::of(sensors.iter().map(|s| to(s).dot(axis))));
        let (columns, rows) = (columns?, rows?);
        let mut crossings: Vec<[i64; 2]> = sensors
            .iter()
            .map(|s| Some([columns.step(to(s).dot(x))?, rows.step(to(s).dot(y))?]))
            .collect::<Option<_>>()?;
        crossings.sort_unstable();
        crossings.dedup();
        let all = columns.count.checked_mul(rows.count)?;
        if crossings.len() != sensors.len() || all != sensors.len() as u64 {
            return None;
        }
        let [middle, half] =
            [Steps::middle, Steps::half].map(|of| [of(&columns) * x, of(&rows) * y]);
        Some(Self {
            group,
            middle: first.center + middle[0] + middle[1],
            normal,
            half,
            cell: columns.spacing * rows.spacing,
        })
    }

    /// Returns whether another lattice lies in the same plane and has no place in common.
    fn is_beside(&self, other: &Self) -> bool {
        let between = other.middle - self.middle;
        let size = self.half[0].length().max(self.half[1].length());
        if self.normal.distance(other.normal) > SLACK
            || between.dot(self.normal).abs() > SLACK * size
        {
            return false;
        }
        // two rectangles are apart if they are so along a side of one of them
        let axes = self.half.iter().chain(&other.half).map(|half| half.normalize());
        axes.into_iter().any(|axis| {
            let halves = self.half.iter().chain(&other.half);
            let reach: f64 = halves.map(|half| half.dot(axis).abs()).sum();
            between.dot(axis).abs() >= (1.0 - SLACK) * reach
        })
    }
}

/// Evenly spaced places on a line.
struct Steps {
    from: f64,
    spacing: f64,
    count: u64,
}

impl Steps {
    /// Finds the steps of some places; `None` for a single one, or if they are not evenly spaced.
    fn of(places: impl Iterator<Item = f64>) -> Option<Self> {
        let mut places: Vec<f64> = places.collect();
        places.sort_by(f64::total_cmp);
        let (from, to) = (*places.first()?, *places.last()?);
        let slack = SLACK * (to - from) / places.len() as f64;
        places.dedup_by(|b, a| *b - *a <= slack);
        let count = places.len() as u64;
        let spacing = (to - from) / count.checked_sub(1).filter(|gaps| *gaps > 0)? as f64;
        let steps = Self { from, spacing, count };
        places.iter().all(|&place| steps.step(place).is_some()).then_some(steps)
    }

    /// Returns the number of a place, from 0; `None` between steps.
    fn step(&self, place: f64) -> Option<i64> {
        let step = (place - self.from) / self.spacing;
        ((step - step.round()).abs() <= SLACK).then_some(step.round() as i64)
    }

    fn middle(&self) -> f64 {
        self.from + 0.5 * self.spacing * (self.count - 1) as f64
    }

    /// Returns half of the length that the cells of the steps take.
    fn half(&self) -> f64 {
        0.5 * self.spacing * self.count as f64
    }
}
