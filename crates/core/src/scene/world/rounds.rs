//! Discs and spheres as rays meet them, and what finds them: discs of one plane across an axis, as a grid
//! has them, by the cell of the plane in which a ray crosses it; all others by a tree.

use std::ops::RangeInclusive;

use glam::{DVec2, DVec3, UVec2, Vec3};

use crate::{
    math::{
        geometry::{ROUNDING, Ray},
        round::{Round, RoundHit},
    },
    scene::bvh::Bvh,
};

/// Discs and spheres as rays meet them, lifted and with their images, and what finds them.
#[derive(Debug, Default)]
pub struct Rounds {
    pub(super) shapes: Vec<Round>,
    levels: Vec<Level>,
    /// Finds those that are in no level.
    others: Bvh,
}

/// The least number of neighbouring discs of one plane that are found by its cells.
const LEAST_DISCS: usize = 64;
/// The largest number of such planes: each costs a ray as much as a few boxes of the tree.
const MOST_LEVELS: usize = 8;
/// The largest number of cells that a disc reaches into, in the mean, and of discs that share a cell,
/// over the discs: with more, a tree finds them faster.
const MOST_SHARED: u64 = 16;

impl Rounds {
    pub(super) fn new(shapes: Vec<Round>) -> Self {
        let mut next = 0;
        let mut runs: Vec<(usize, &[Round])> = Vec::new();
        for run in shapes.chunk_by(|a, b| plane(a).is_some() && plane(a) == plane(b)) {
            if run.len() >= LEAST_DISCS {
                runs.push((next, run));
            }
            next += run.len();
        }
        runs.sort_by_key(|(_, run)| std::cmp::Reverse(run.len()));
        runs.truncate(MOST_LEVELS);
        let levels: Vec<Level> =
            runs.into_iter().filter_map(|(first, run)| Level::new(first, run)).collect();
        let is_other = |i: &u32| !levels.iter().any(|level| level.discs.contains(i));
        let others = (0..shapes.len() as u32).filter(is_other).collect();
        Self { others: Bvh::build_of_rounds(&shapes, others), levels, shapes }
    }

    /// Returns whether there is none.
    #[inline]
    pub fn is_empty(&self) -> bool {
        self.shapes.is_empty()
    }

    /// Visits every crossing of a ray with 0 < t < `t_max`, each with the index of the disc or sphere.
    #[inline]
    pub fn crossings(&self, ray: &Ray, t_max: f32, mut visit: impl FnMut(usize, RoundHit)) {
        for level in &self.levels {
            for &index in level.crossed(ray, t_max) {
                let hits = self.shapes[index as usize].crossed(ray, t_max);
                hits.into_iter().flatten().for_each(|hit| visit(index as usize, hit));
            }
        }
        if !self.others.is_empty() {
            self.others.cross_rounds(&self.shapes, ray, t_max, visit);
        }
    }

    /// Visits, at least once, the index of each that may reach into the ball of `radius`, m, around
    /// `center`.
    pub fn near(&self, center: Vec3, radius: f32, mut visit: impl FnMut(usize)) {
        for level in &self.levels {
            level.near(center.as_dvec3(), f64::from(radius), &mut visit);
        }
        self.others.near_rounds(center, radius, visit);
    }
}

/// Returns the axis that a disc lies across, and where on it; `None` of a sphere or a slanting disc.
fn plane(round: &Round) -> Option<(usize, f64)> {
    let normal = round.normal?.abs();
    let axis = (0..3).find(|&axis| normal == DVec3::AXES[axis])?;
    Some((axis, round.center[axis]))
}

/// Discs of one plane across an axis, each known to the cells of the plane that it may reach into.
#[derive(Debug)]
struct Level {
    axis: usize,
    /// Where on the axis the plane is, m: the same for all, and so is the place where a ray crosses it.
    at: f64,
    /// The corner of the first cell, m.
    low: DVec2,
    cells_per_m: DVec2,
    cells: UVec2,
    /// The first and the last of its discs, which are neighbours.
    discs: RangeInclusive<u32>,
    /// Where the discs of each cell begin in `found`, row by row, and where the last end.
    starts: Vec<u32>,
    found: Vec<u32>,
}

impl Level {
    /// Sorts discs of one plane, of which `first` is the index of the first, into cells, about as many as
    /// there are discs; `None` where they are so large or so uneven that many lie in one cell.
    fn new(first: usize, discs: &[Round]) -> Option<Self> {
        let (axis, at) = plane(&discs[0])?;
        // wider by what rounding may do to where a ray crosses the plane
        let reach = |disc: &Round| disc.radius + f64::from(ROUNDING * disc.reach().element_sum());
        let corners = |disc: &Round| {
            let (middle, reach) = (across(axis, disc.center), reach(disc));
            [middle - reach, middle + reach]
        };
        let all = discs.iter().map(corners);
        let [low, high] = all.reduce(|[a, b], [c, d]| [a.min(c), b.max(d)])?;
        let (size, count) = (high - low, discs.len() as f64);
        let side = (size.x * size.y / count).sqrt();
        let cells = (size / side).ceil().clamp(DVec2::ONE, DVec2::splat(count)).as_uvec2();
        let mut level = Self {
            axis,
            at,
            low,
            cells_per_m: cells.as_dvec2() / size,
            cells,
            discs: first as u32..=(first + discs.len() - 1) as u32,
            starts: Vec::new(),
            found: Vec::new(),
        };
        let known = |disc: &Round| level.cells_between(corners(disc));
        // before cells are counted one by one: discs may all reach into all of them
        let reached = |disc: &Round| {
            let [from, to] = level.cells_at(corners(disc));
            let [columns, rows] = (to - from + 1).to_array();
            u64::from(columns) * u64::from(rows)
        };
        let total: u64 = discs.iter().map(reached).sum();
        if total > MOST_SHARED * discs.len() as u64 {
            return None;
        }
        let mut counts = vec![0u32; cells.element_product() as usize];
        discs.iter().flat_map(known).for_each(|cell| counts[cell] += 1);
        let square: u64 = counts.iter().map(|&count| u64::from(count).pow(2)).sum();
        if square > MOST_SHARED * total {
            return None;
        }
        let mut starts = Vec::with_capacity(counts.len() + 1);
        let mut end = 0;
        for count in &counts {
            starts.push(end);
            end += count;
        }
        let mut found = vec![0; end as usize];
        let mut next = starts.clone();
        starts.push(end);
        for (index, disc) in (first as u32..).zip(discs) {
            for cell in known(disc) {
                found[next[cell] as usize] = index;
                next[cell] += 1;
            }
        }
        (level.starts, level.found) = (starts, found);
        Some(level)
    }

    /// Returns the columns and rows of the cells nearest to two corners.
    fn cells_at(&self, corners: [DVec2; 2]) -> [UVec2; 2] {
        // numbers below zero become zero
        corners
            .map(|corner| ((corner - self.low) * self.cells_per_m).as_uvec2().min(self.cells - 1))
    }

    /// Returns the cells between two corners.
    fn cells_between(&self, corners: [DVec2; 2]) -> impl Iterator<Item = usize> + use<> {
        let ([from, to], width) = (self.cells_at(corners), self.cells.x);
        (from.y..=to.y).flat_map(move |y| (from.x..=to.x).map(move |x| (y * width + x) as usize))
    }

    fn of_cell(&self, cell: usize) -> &[u32] {
        &self.found[self.starts[cell] as usize..self.starts[cell + 1] as usize]
    }

    /// Returns the discs that may lie where a ray crosses the plane with 0 < t < `t_max`.
    #[inline]
    fn crossed(&self, ray: &Ray, t_max: f32) -> &[u32] {
        let (origin, direction) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
        let t = (self.at - origin[self.axis]) / direction[self.axis];
        if !(t > 0.0 && t < f64::from(t_max)) {
            return &[];
        }
        let point = across(self.axis, origin + t * direction);
        let place = (point - self.low) * self.cells_per_m;
        if !(place.cmpge(DVec2::ZERO).all() && place.cmplt(self.cells.as_dvec2()).all()) {
            return &[];
        }
        let cell = place.as_uvec2();
        self.of_cell((cell.y * self.cells.x + cell.x) as usize)
    }

    /// Visits, at least once, those that may reach into a ball.
    fn near(&self, center: DVec3, radius: f64, visit: &mut impl FnMut(usize)) {
        if (center[self.axis] - self.at).abs() <= radius {
            let middle = across(self.axis, center);
            let cells = self.cells_between([middle - radius, middle + radius]);
            let found = cells.flat_map(|cell| self.of_cell(cell));
            found.for_each(|&index| visit(index as usize));
        }
    }
}

/// Returns the two coordinates of a point along the other axes.
#[inline]
fn across(axis: usize, point: DVec3) -> DVec2 {
    match axis {
        0 => DVec2::new(point.y, point.z),
        1 => DVec2::new(point.x, point.z),
        _ => DVec2::new(point.x, point.y),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::rng::Stream;

    /// Grids of discs that touch, overlap or lie apart, level and upright, a line of discs, and scattered
    /// discs, spheres and slanting discs between them: a ray crosses those that it crosses when each is
    /// tested by itself, at the same points, and a ball finds all that reach into it.
    #[test]
    fn discs_are_found_as_one_by_one() {
        let mut rng = Stream::new(1, 0, 0);
        let mut rounds = Vec::new();
        for (axis, radius, columns, rows) in
            [(2, 0.05, 20, 15), (1, 0.08, 16, 16), (0, 0.001, 9, 11), (2, 0.01, 100, 1)]
        {
            let at = rng.uniform() - 0.5;
            let place = |column, row, at| {
                let [x, y] = [column, row].map(|i| 0.1 * f64::from(i) - 0.7);
                DVec3::from_array([[at, x, y], [x, at, y], [x, y, at]][axis])
            };
            let disc = |row, column| {
                Round::disc(place(column, row, f64::from(at)), DVec3::AXES[axis], radius)
            };
            rounds.extend((0..rows).flat_map(|row| (0..columns).map(move |c| disc(row, c))));
            rounds.push(Round::sphere(DVec3::new(0.3, -0.2, f64::from(at)), 0.2));
            rounds.push(Round::disc(DVec3::ZERO, DVec3::new(0.48, -0.6, 0.64), 0.5));
        }
        let scattered = std::iter::repeat_with(|| {
            let at = rng.square() - 0.5;
            Round::disc(at.extend(0.4).as_dvec3(), DVec3::NEG_Z, 0.02)
        });
        rounds.extend(scattered.take(300));
        let all = Rounds::new(rounds.clone());
        assert_eq!(all.levels.len(), 5);
        assert!(!all.others.is_empty());
        let mut crossed = 0;
        for _ in 0..20_000 {
            let origin = (rng.square() - 0.5).extend(2.0 * rng.uniform() - 1.0);
            let to = &rounds[(rng.uniform() * rounds.len() as f32) as usize];
            let target = Round::sphere(to.center, to.radius).point(rng.square()).as_vec3();
            let ray = Ray { origin, direction: (target - origin).normalize_or(Vec3::Z) };
            let t_max = if rng.uniform() < 0.5 { f32::INFINITY } else { 2.0 * rng.uniform() };
            let hits = |(i, round): (usize, &Round)| {
                round.crossed(&ray, t_max).into_iter().flatten().map(move |hit| (i, hit))
            };
            let expected: Vec<_> = rounds.iter().enumerate().flat_map(hits).collect();
            let mut found = Vec::new();
            all.crossings(&ray, t_max, |i, hit| found.push((i, hit)));
            found.sort_by(|(i, a), (j, b)| i.cmp(j).then(b.front.cmp(&a.front)));
            assert_eq!(found, expected);
            crossed += found.len();
            let mut near = vec![false; rounds.len()];
            all.near(origin, 0.1, |i| near[i] = true);
            for (round, near) in rounds.iter().zip(near) {
                let reaches = round.normal.is_some_and(|normal| {
                    let to = origin.as_dvec3() - round.center;
                    let height = to.dot(normal);
                    let out = ((to - height * normal).length() - round.radius).max(0.0);
                    height.hypot(out) < 0.1
                });
                assert!(near || !reaches, "{round:?} from {origin}");
            }
        }
        assert!(crossed > 20_000, "{crossed}");
    }

    /// Discs of which most lie in a few cells are left to the tree, and so are those that all lie over
    /// each other, which would be 1e10 places in cells.
    #[test]
    fn uneven_and_large_discs_are_found_by_the_tree() {
        let disc = |i: i32| {
            let far = if i == 0 { 1e3 } else { 1e-3 * f64::from(i) };
            Round::disc(DVec3::new(far, far, 0.0), DVec3::Z, 1e-4)
        };
        let large = |i: i32| {
            let [x, y] = [i % 300, i / 300].map(|i| 1e-3 * f64::from(i));
            Round::disc(DVec3::new(x, y, 0.0), DVec3::Z, 9.0)
        };
        for discs in [(0..500).map(disc).collect(), (0..90_000).map(large).collect()] {
            let all = Rounds::new(discs);
            assert!(all.levels.is_empty() && !all.others.is_empty());
        }
    }
}
