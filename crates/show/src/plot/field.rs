//! A field of values between points of a plane: triangles between near points, and the outlines of
//! what lies above a level.
//!
//! Between the points of a grid values are smooth; between others they are linear over the triangles
//! of a Delaunay triangulation. Wide gaps stay empty, and nothing lies outside the points.

use std::collections::BTreeMap;

/// A gap between points is one that is wider than so many times their usual distance.
const GAP: f64 = 3.0;
/// A row of points that is far from others is a band that reaches so many of their distances to each
/// side: so little that bands which are a gap apart are not near.
const BAND: f64 = 1.0 / 3.0;
/// A smooth field has about so many triangles.
const SMOOTH: usize = 12_000;
/// The most parts into which the space between two points of a grid is cut for it.
const FINEST: usize = 24;

/// A place in a plane, m, and the value there.
pub(super) type Corner = (f64, f64, f64);
/// A point of an outline: a corner (twice the same number), or a place between two corners.
type Node = (usize, usize);
/// A line through places; an outline ends where it begins.
pub(super) type Path = Vec<(f64, f64)>;

/// Values between points.
#[derive(Clone, Debug, Default)]
pub(super) struct Field {
    corners: Vec<Corner>,
    /// Triangles between the corners, which stand counterclockwise.
    triangles: Vec<[usize; 3]>,
    /// Contours run through so many of the triangles, the first ones.
    lined: usize,
}

/// Returns the parts of a plane that its points fill, each by the numbers of its points: gaps wider
/// than three times the distance between neighbours lie between parts. `sets` are the numbers of the
/// sets of points that belong together, as a grid does; each has a distance of its own along both
/// axes. Points that are part of no triangle are in no part.
pub(super) fn parts(points: &[Corner], sets: &[usize]) -> Vec<Vec<usize>> {
    let triangles = near_triangles(points, sets);
    let mut first: Vec<usize> = (0..points.len()).collect();
    fn root(first: &mut [usize], mut i: usize) -> usize {
        while first[i] != i {
            first[i] = first[first[i]];
            i = first[i];
        }
        i
    }
    for [a, b, c] in &triangles {
        for other in [b, c] {
            let [one, other] = [*a, *other].map(|i| root(&mut first, i));
            first[one.max(other)] = one.min(other);
        }
    }
    let mut used = vec![false; points.len()];
    triangles.iter().flatten().for_each(|&i| used[i] = true);
    let mut parts: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    for i in (0..points.len()).filter(|&i| used[i]) {
        parts.entry(root(&mut first, i)).or_default().push(i);
    }
    parts.into_values().collect()
}

/// Returns the triangles of Delaunay's triangulation that span no gap.
fn near_triangles(points: &[Corner], sets: &[usize]) -> Vec<[usize; 3]> {
    let all = triangles(points);
    let steps = steps(points, sets, &all);
    let is_near = |side: [usize; 2]| {
        let [a, b] = side.map(|i| steps[&sets[i]]);
        let lengths = along(points, side);
        [0, 1].into_iter().all(|axis| lengths[axis] <= (GAP + 1e-6) * a[axis].max(b[axis]))
    };
    all.into_iter().filter(|t| sides(t).into_iter().all(is_near)).collect()
}

/// Returns all triangles of Delaunay's triangulation.
fn triangles(points: &[Corner]) -> Vec<[usize; 3]> {
    let places: Vec<delaunator::Point> =
        points.iter().map(|&(x, y, _)| delaunator::Point { x, y }).collect();
    delaunator::triangulate(&places).triangles.as_chunks::<3>().0.to_vec()
}

fn sides(t: &[usize; 3]) -> [[usize; 2]; 3] {
    [[t[0], t[1]], [t[1], t[2]], [t[2], t[0]]]
}

/// Returns the lengths of a side along both axes.
fn along(points: &[Corner], [a, b]: [usize; 2]) -> [f64; 2] {
    [(points[a].0 - points[b].0).abs(), (points[a].1 - points[b].1).abs()]
}

/// Returns for each set the usual distance between its neighbours along both axes.
fn steps(points: &[Corner], sets: &[usize], triangles: &[[usize; 3]]) -> BTreeMap<usize, [f64; 2]> {
    // the nearest neighbour of each point, of its set, on either side along each axis
    let mut nearest = vec![[f64::INFINITY; 2]; points.len()];
    for side in triangles.iter().flat_map(sides) {
        let [a, b] = side;
        let lengths = along(points, side);
        let axis = usize::from(lengths[1] > lengths[0]);
        if sets[a] == sets[b] {
            for i in [a, b] {
                nearest[i][axis] = nearest[i][axis].min(lengths[axis]);
            }
        }
    }
    let mut of_set: BTreeMap<usize, [Vec<f64>; 2]> = BTreeMap::new();
    for (set, own) in sets.iter().zip(&nearest) {
        let of_set = of_set.entry(*set).or_default();
        for axis in [0, 1] {
            of_set[axis].extend(Some(own[axis]).filter(|length| length.is_finite()));
        }
    }
    let usual = |(set, lengths): (usize, [Vec<f64>; 2])| {
        let [across, up] = lengths.map(median);
        // a single row of points has one distance
        (set, [across.or(up).unwrap_or(0.0), up.or(across).unwrap_or(0.0)])
    };
    of_set.into_iter().map(usual).collect()
}

/// Returns the axis along which the rows of a set are further apart than three distances in them, if
/// they are longer than that too, as those of benches with aisles between. Short rows, as those across
/// a bed, are a grid.
fn apart(step: [f64; 2], points: &[Corner]) -> Option<usize> {
    let length = |axis: usize| {
        let places = || points.iter().map(|p| [p.0, p.1][axis]);
        let ends = places().reduce(f64::min).zip(places().reduce(f64::max));
        ends.map_or(0.0, |(low, high)| high - low)
    };
    [0, 1]
        .into_iter()
        .find(|&axis| step[axis] > (GAP + 1e-6) * step[1 - axis] && length(1 - axis) > step[axis])
}

/// Returns the two edges of the band that stands for each row of points, with the number of the row.
fn bands(mut points: Vec<Corner>, axis: usize, step: f64) -> Vec<(Corner, usize)> {
    let place = |p: &Corner| [p.0, p.1][axis];
    points.sort_by(|a, b| place(a).total_cmp(&place(b)));
    let half = BAND * step;
    let rows = points.chunk_by(|a, b| place(b) - place(a) < half).enumerate();
    let edges = rows.flat_map(|(number, row)| {
        let edge = move |&(x, y, value): &Corner, by: f64| match axis {
            0 => ((x + by, y, value), number),
            _ => ((x, y + by, value), number),
        };
        row.iter().flat_map(move |p| [edge(p, -half), edge(p, half)])
    });
    edges.collect()
}

/// Returns the middle one of some numbers, if there are any.
pub(super) fn median(mut numbers: Vec<f64>) -> Option<f64> {
    numbers.sort_by(f64::total_cmp);
    numbers.get(numbers.len() / 2).copied()
}

impl Field {
    /// Returns the field between points. Rows of a set that are far apart are narrow bands, without
    /// contours.
    pub fn with_bands(points: &[Corner], sets: &[usize]) -> Self {
        let steps = steps(points, sets, &triangles(points));
        let own = |set: usize| {
            let own = points.iter().zip(sets).filter(move |(_, own)| **own == set);
            own.map(|(point, _)| *point).collect::<Vec<Corner>>()
        };
        let of_bands = steps.iter().filter_map(|(&set, &step)| {
            let axis = apart(step, &own(set))?;
            Some((set, bands(own(set), axis, step[1 - axis])))
        });
        let of_bands: BTreeMap<usize, Vec<(Corner, usize)>> = of_bands.collect();
        let rest = points.iter().zip(sets).filter(|(_, set)| !of_bands.contains_key(set));
        let (points, sets): (Vec<Corner>, Vec<usize>) = rest.unzip();
        let mut all = Self::between(&points, &sets, &parts(&points, &sets));
        for rows in of_bands.into_values() {
            let (points, rows): (Vec<Corner>, Vec<usize>) = rows.into_iter().unzip();
            let lined = all.lined;
            all.append(Self::between(&points, &rows, &parts(&points, &rows)));
            all.lined = lined;
        }
        all
    }

    /// Adds another field.
    fn append(&mut self, other: Self) {
        let before = self.corners.len();
        self.corners.extend(other.corners);
        self.triangles.extend(other.triangles.into_iter().map(|t| t.map(|i| i + before)));
        self.lined = self.triangles.len();
    }

    /// Returns the places between which values are known.
    pub fn corners(&self) -> &[Corner] {
        &self.corners
    }

    /// Returns the field between points of one or more parts, as [`parts`] finds them.
    pub fn between(points: &[Corner], sets: &[usize], parts: &[Vec<usize>]) -> Self {
        let mut all = Self::default();
        for part in parts {
            let own: Vec<Corner> = part.iter().map(|&i| points[i]).collect();
            let sets: Vec<usize> = part.iter().map(|&i| sets[i]).collect();
            let field = Self::smooth(&own).unwrap_or_else(|| {
                let triangles = near_triangles(&own, &sets);
                Self { corners: own, triangles, lined: 0 }
            });
            all.append(field);
        }
        let Self { corners, triangles, .. } = &mut all;
        let twice_area = |[a, b, c]: [usize; 3]| {
            let [a, b, c] = [a, b, c].map(|i| corners[i]);
            (b.0 - a.0) * (c.1 - a.1) - (c.0 - a.0) * (b.1 - a.1)
        };
        for triangle in triangles.iter_mut().filter(|t| twice_area(**t) < 0.0) {
            triangle.reverse();
        }
        all
    }

    /// Returns the field on a finer grid, where values follow a smooth [`Surface`]; `None` if the points
    /// are no grid.
    fn smooth(points: &[Corner]) -> Option<Self> {
        let [across, up] =
            [|p: &Corner| p.0, |p: &Corner| p.1].map(|axis| lines(points.iter().map(axis)));
        let (columns, rows) = (across.len(), up.len());
        let cells = columns.checked_sub(1)? * rows.checked_sub(1)?;
        if columns * rows != points.len() || cells == 0 {
            return None;
        }
        let parts = ((SMOOTH as f64 / (2.0 * cells as f64)).sqrt() as usize).clamp(1, FINEST);
        let mut values = vec![f64::NAN; columns * rows];
        for &(x, y, value) in points {
            values[nearest(&up, y) * columns + nearest(&across, x)] = value;
        }
        if values.iter().any(|value| value.is_nan()) {
            return None;
        }
        let finer = |places: &[f64]| -> Vec<f64> {
            let part = |i: usize| i as f64 / parts as f64;
            let between = |pair: &[f64]| {
                let [from, to] = [pair[0], pair[1]];
                (0..parts).map(move |i| from + part(i) * (to - from))
            };
            places.windows(2).flat_map(between).chain(places.last().copied()).collect()
        };
        let (x, y) = (finer(&across), finer(&up));
        let (wide, high) = (x.len(), y.len());
        let surface = Surface::through(across, up, values);
        let corners = x
            .iter()
            .flat_map(|&x| y.iter().map(move |&y| (x, y)))
            .map(|at| surface.at(at))
            .collect();
        let at = |i: usize, j: usize| i * high + j;
        let all = (1..wide).flat_map(|i| (1..high).map(move |j| (i - 1, j - 1)));
        let triangles = all.flat_map(|(i, j)| {
            let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            [[a, b, c], [a, c, d]]
        });
        let triangles = triangles.collect();
        Some(Self { corners, triangles, lined: 0 })
    }

    /// Returns the sides of triangles that no other triangle shares.
    fn border(&self) -> Vec<[usize; 2]> {
        let all: std::collections::HashSet<[usize; 2]> =
            self.triangles.iter().flat_map(sides).collect();
        let is_border = |[a, b]: &[usize; 2]| !all.contains(&[*b, *a]);
        self.triangles.iter().flat_map(sides).filter(is_border).collect()
    }

    /// Returns the lines along which the values are this one, with greater values to their left.
    pub fn contours(&self, level: f64) -> Vec<Path> {
        self.joined(self.crossings(&self.triangles[..self.lined], level), level)
    }

    /// Returns the outlines of what lies at or above each level, with their areas: those of the
    /// outside are counterclockwise and have areas above 0, those of holes below 0. The first level
    /// stands for all values.
    pub fn outlines(&self, levels: &[f64]) -> Vec<Vec<(f64, Path)>> {
        let border = self.border();
        let of_level = |(number, &level): (usize, &f64)| {
            let level = if number == 0 { f64::NEG_INFINITY } else { level };
            let mut segments = self.crossings(&self.triangles, level);
            for &[a, b] in &border {
                let ends = [a, b].map(|i| self.corners[i].2 >= level);
                match ends {
                    [true, true] => segments.push(((a, a), (b, b))),
                    [true, false] => segments.push(((a, a), crossing(a, b))),
                    [false, true] => segments.push((crossing(a, b), (b, b))),
                    [false, false] => {}
                }
            }
            self.joined(segments, level).into_iter().map(|path| (area(&path), path)).collect()
        };
        levels.iter().enumerate().map(of_level).collect()
    }

    /// Returns where triangles are crossed by a level, with greater values to the left.
    fn crossings(&self, triangles: &[[usize; 3]], level: f64) -> Vec<(Node, Node)> {
        let of_triangle = |triangle: &[usize; 3]| {
            let above = triangle.map(|i| self.corners[i].2 >= level);
            let side = |i: usize| (triangle[i], triangle[(i + 1) % 3]);
            // along the border of a triangle values fall below the level once, and rise above it once
            let falls = (0..3).find(|&i| above[i] && !above[(i + 1) % 3])?;
            let rises = (0..3).find(|&i| !above[i] && above[(i + 1) % 3])?;
            let [falls, rises] = [side(falls), side(rises)].map(|(a, b)| crossing(a, b));
            Some((falls, rises))
        };
        triangles.iter().filter_map(of_triangle).collect()
    }

    /// Joins segments to lines and outlines.
    fn joined(&self, segments: Vec<(Node, Node)>, level: f64) -> Vec<Path> {
        let mut next: BTreeMap<Node, Vec<Node>> = BTreeMap::new();
        let mut begins: BTreeMap<Node, i32> = BTreeMap::new();
        for (from, to) in segments {
            next.entry(from).or_default().push(to);
            *begins.entry(from).or_default() += 1;
            *begins.entry(to).or_default() -= 1;
        }
        // lines with ends are followed from their beginnings, and then those that are closed
        let open = begins.into_iter().filter(|(_, count)| *count > 0).map(|(node, _)| node);
        let mut starts: Vec<Node> = open.collect();
        starts.extend(next.keys().copied());
        let mut lines = Vec::new();
        for start in starts {
            let mut line = vec![self.place(start, level)];
            let mut at = start;
            while let Some(to) = next.get_mut(&at).and_then(Vec::pop) {
                line.push(self.place(to, level));
                at = to;
                if at == start {
                    break;
                }
            }
            if line.len() > 1 {
                lines.push(line);
            }
        }
        lines
    }

    fn place(&self, (a, b): Node, level: f64) -> (f64, f64) {
        let [a, b] = [a, b].map(|i| self.corners[i]);
        let share = if a.2 == b.2 { 0.0 } else { (level - a.2) / (b.2 - a.2) };
        let at = |a: f64, b: f64| a + share * (b - a);
        match share == 0.0 {
            true => (a.0, a.1),
            false => (at(a.0, b.0), at(a.1, b.1)),
        }
    }
}

/// Returns the place where a level crosses a side, whichever triangle asks.
fn crossing(a: usize, b: usize) -> Node {
    (a.min(b), a.max(b))
}

/// Returns the area of an outline, below 0 if it is clockwise.
fn area(path: &Path) -> f64 {
    let Some(&(x, y)) = path.first() else { return 0.0 };
    let part =
        |ends: &[(f64, f64)]| (ends[0].0 - x) * (ends[1].1 - y) - (ends[1].0 - x) * (ends[0].1 - y);
    0.5 * path.windows(2).map(part).sum::<f64>()
}

/// Returns the distinct places among these, in rising order.
fn lines(places: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut places: Vec<f64> = places.collect();
    places.sort_by(f64::total_cmp);
    if let [first, .., last] = places[..] {
        let least = 1e-6 * (last - first);
        places.dedup_by(|next, place| *next - *place <= least);
    }
    places
}

/// Returns the index of the place that is nearest to this one.
fn nearest(places: &[f64], at: f64) -> usize {
    let next = places.partition_point(|place| *place < at).min(places.len() - 1);
    let before = next.saturating_sub(1);
    if at - places[before] < places[next] - at { before } else { next }
}

/// A smooth surface through values at the crossings of a grid: cubics along both axes, with slopes at
/// the crossings that [`slopes`] finds, and none that turns between them.
struct Surface {
    /// The places of columns and rows, rising.
    across: Vec<f64>,
    up: Vec<f64>,
    /// At each crossing, row by row: the value, its slopes along both axes, and how the one changes
    /// along the other.
    knots: Vec<[f64; 4]>,
    /// Amounts stay above 0.
    least: f64,
}

impl Surface {
    fn through(across: Vec<f64>, up: Vec<f64>, values: Vec<f64>) -> Self {
        let columns = across.len();
        let along_rows = |of: &[f64]| {
            of.chunks(columns).flat_map(|row| slopes(&across, row)).collect::<Vec<_>>()
        };
        let along_columns = |of: &[f64]| {
            let mut all = vec![0.0; of.len()];
            for i in 0..columns {
                let column: Vec<f64> = of.iter().skip(i).step_by(columns).copied().collect();
                for (j, slope) in slopes(&up, &column).into_iter().enumerate() {
                    all[j * columns + i] = slope;
                }
            }
            all
        };
        let (rising, steep) = (along_rows(&values), along_columns(&values));
        let twists = along_columns(&rising).into_iter().zip(along_rows(&steep));
        let twists = twists.map(|(a, b)| 0.5 * (a + b));
        let slopes = rising.iter().zip(&steep).zip(twists);
        let knots =
            values.iter().zip(slopes).map(|(v, ((x, y), twist))| [*v, *x, *y, twist]).collect();
        let least = if values.iter().all(|v| *v >= 0.0) { 0.0 } else { f64::NEG_INFINITY };
        Self { across, up, knots, least }
    }

    /// Returns a place with the value there.
    fn at(&self, (x, y): (f64, f64)) -> Corner {
        let (column, wide, of_x) = cubic(&self.across, x);
        let (row, high, of_y) = cubic(&self.up, y);
        let mut value = 0.0;
        for (j, [height, slope]) in of_y.into_iter().enumerate() {
            for (i, [own, along]) in of_x.into_iter().enumerate() {
                let [v, x, y, twist] = self.knots[(row + j) * self.across.len() + column + i];
                value += height * (own * v + along * wide * x);
                value += slope * high * (own * y + along * wide * twist);
            }
        }
        (x, y, value.max(self.least))
    }
}

/// Returns the number of the step between rising places in which a place lies, the length of the step,
/// and what the values and slopes at its two ends weigh there (Hermite's cubics of length 1).
fn cubic(places: &[f64], at: f64) -> (usize, f64, [[f64; 2]; 2]) {
    let i = places.partition_point(|place| *place <= at).clamp(1, places.len() - 1) - 1;
    let length = places[i + 1] - places[i];
    let t = (at - places[i]) / length;
    let rest = 1.0 - t;
    let from = [(1.0 + 2.0 * t) * rest * rest, t * rest * rest];
    let to = [(3.0 - 2.0 * t) * t * t, -rest * t * t];
    (i, length, [from, to])
}

/// Returns the slopes of a smooth curve through `values` at the rising places `x`, two at least. The
/// curve rises and falls only where the values do (Fritsch and Butland 1984), but for hills and hollows
/// that are smooth, where the values of neighbours curve the same way: there it follows the parabola
/// through three places, so that the top between two equal values is round, and above these by at most
/// an eighth of what the slope changes.
fn slopes(x: &[f64], values: &[f64]) -> Vec<f64> {
    let width: Vec<f64> = x.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let slope: Vec<f64> =
        values.windows(2).zip(&width).map(|(pair, width)| (pair[1] - pair[0]) / width).collect();
    let last = width.len() - 1;
    // as the parabola through three places, but not against the slope there, nor steeper than three
    // times it
    let end = |own: usize, other: usize| {
        let (h, g) = (width[own], width[other]);
        let end = ((2.0 * h + g) * slope[own] - h * slope[other]) / (h + g);
        let steepest = 3.0 * slope[own];
        if end * slope[own] <= 0.0 {
            0.0
        } else if end.abs() > steepest.abs() {
            steepest
        } else {
            end
        }
    };
    // whether the values at a place and at its neighbours, one of these at least, curve the same way
    let is_smooth = |i: usize| {
        let inner = i.max(2) - 1..=(i + 1).min(last);
        let curves: Vec<f64> = inner.map(|i| slope[i] - slope[i - 1]).collect();
        let same = |sign: f64| curves.iter().all(|curve| sign * curve > 0.0);
        curves.len() > 1 && (same(1.0) || same(-1.0))
    };
    // a weighted harmonic mean of the slopes beside a place; 0 at a hill or in a hollow
    let tangent = |i: usize| match i {
        _ if last == 0 => slope[0],
        0 => end(0, 1),
        _ if i > last => end(last, last - 1),
        _ if is_smooth(i) => {
            (width[i] * slope[i - 1] + width[i - 1] * slope[i]) / (width[i - 1] + width[i])
        }
        _ if slope[i - 1] * slope[i] <= 0.0 => 0.0,
        _ => {
            let [before, after] = [2.0 * width[i] + width[i - 1], width[i] + 2.0 * width[i - 1]];
            (before + after) / (before / slope[i - 1] + after / slope[i])
        }
    };
    (0..=last + 1).map(tangent).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grid(columns: u32, rows: u32, step: (f64, f64), from: (f64, f64)) -> Vec<Corner> {
        let places = (0..columns * rows).map(|i| (f64::from(i % columns), f64::from(i / columns)));
        places.map(|(x, y)| (from.0 + step.0 * x, from.1 + step.1 * y, x)).collect()
    }

    fn field(points: &[Corner]) -> Field {
        let sets = vec![0; points.len()];
        Field::between(points, &sets, &parts(points, &sets))
    }

    /// Returns the area at or above a level.
    fn above(field: &Field, level: f64) -> f64 {
        let outlines = field.outlines(&[f64::NEG_INFINITY, level]);
        outlines[1].iter().map(|(area, _)| area).sum()
    }

    /// Two grids of different steps are parts of their own, whatever lies between them, and what is
    /// filled is the rectangles around their points and nothing else. A point far away is in none.
    #[test]
    fn gaps_stay_empty() {
        let mut points = grid(8, 3, (0.6, 0.2), (0.0, 0.0));
        points.extend(grid(8, 3, (0.6, 0.2), (0.1, 1.6)));
        points.push((20.0, 0.0, 7.0));
        let sets: Vec<usize> = (0..49).map(|i| i / 24).collect();
        let found = parts(&points, &sets);
        assert_eq!(found, [(0..24).collect::<Vec<_>>(), (24..48).collect()]);
        let field = Field::between(&points, &sets, &found);
        let areas: Vec<f64> =
            field.outlines(&[f64::NEG_INFINITY])[0].iter().map(|(area, _)| *area).collect();
        assert_eq!(areas.len(), 2);
        assert!(areas.iter().all(|area| (area - 4.2 * 0.4).abs() < 1e-9), "{areas:?}");
        // three steps are no gap, a little more is one
        for (gap, count) in [(0.59, 1), (0.61, 2)] {
            let mut points = grid(4, 3, (0.6, 0.2), (0.0, 0.0));
            points.extend(grid(4, 3, (0.6, 0.2), (0.0, 0.4 + gap)));
            assert_eq!(parts(&points, &[0; 24]).len(), count, "{gap}");
        }
    }

    /// A hole in a grid that is five steps wide stays empty, but for its corners, across which points
    /// are near.
    #[test]
    fn holes_stay_empty() {
        let mut points = grid(10, 10, (1.0, 1.0), (0.0, 0.0));
        points.retain(|p| !(3.0..=6.0).contains(&p.0) || !(3.0..=6.0).contains(&p.1));
        let field = field(&points);
        let outlines = &field.outlines(&[f64::NEG_INFINITY])[0];
        let holes: Vec<f64> = outlines.iter().map(|o| o.0).filter(|area| *area < 0.0).collect();
        assert_eq!(holes.len(), 1, "{outlines:?}");
        assert!((7.0..25.0).contains(&-holes[0]), "{holes:?}");
    }

    /// x + 2 y between five points of the unit square: what lies above a level, and the line along it,
    /// are those of the plane, and no line is finer than a triangle.
    #[test]
    fn fields_are_linear_between_points() {
        let places = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0), (0.4, 0.3)];
        let field = field(&places.map(|(x, y)| (x, y, x + 2.0 * y)));
        assert!((above(&field, -1.0) - 1.0).abs() < 1e-12);
        // x + 2 y is above 1.2 in a trapezoid whose parallel sides are 0.4 and 0.9 long
        assert!((above(&field, 1.2) - 0.65).abs() < 1e-12, "{}", above(&field, 1.2));
        let lines = field.contours(1.2);
        assert_eq!(lines.len(), 1, "{lines:?}");
        assert!(lines[0].iter().all(|(x, y)| (x + 2.0 * y - 1.2).abs() < 1e-12), "{lines:?}");
        assert!(above(&field, 3.5) == 0.0 && field.contours(3.5).is_empty());
    }

    /// Outlines of a hill and a hollow: the one is counterclockwise, the other a hole; a line around a
    /// hill is closed.
    #[test]
    fn hills_and_hollows_have_outlines() {
        let of = |sign: f64| {
            let mut points = grid(9, 9, (1.0, 1.0), (-4.0, -4.0));
            points.iter_mut().for_each(|p| p.2 = sign * (-0.2 * (p.0 * p.0 + p.1 * p.1)).exp());
            field(&points)
        };
        let (hill, hollow) = (of(1.0), of(-1.0));
        let [up, down] = [&hill.outlines(&[-9.0, 0.5])[1], &hollow.outlines(&[-9.0, -0.5])[1]];
        // half the height is 1.86 from the middle; cubics between points are not quite the hill
        let circle = std::f64::consts::PI * (0.5f64.ln() / -0.2);
        assert!(up.len() == 1 && (up[0].0 / circle - 1.0).abs() < 0.1, "{up:?}");
        let mut areas: Vec<f64> = down.iter().map(|o| o.0).collect();
        areas.sort_by(f64::total_cmp);
        assert!(areas.len() == 2 && (areas[1] - 64.0).abs() < 1e-9, "{areas:?}");
        assert!((areas[0] / -circle - 1.0).abs() < 0.1, "{areas:?}");
        let line = &hill.contours(0.5)[0];
        assert_eq!(line.first(), line.last());
    }

    /// Between the points of a grid values are smooth: they go through those of the points and follow
    /// a plane; two rows will do. Where the values turn at once they go no further than these, and on a
    /// hill of lamps, where neighbours curve the same way, the top is round: it is that of the parabola.
    #[test]
    fn a_grid_is_smooth() {
        for rows in [2, 4] {
            let of = |value: fn(f64) -> f64, slope: f64| {
                let mut points = grid(6, rows, (1.0, 0.5), (0.0, 0.0));
                points.iter_mut().for_each(|p| p.2 = value(p.0) + slope * p.1);
                (Field::smooth(&points).expect("a grid"), points)
            };
            let (plane, _) = of(|x| 3.0 * x, -2.0);
            assert!(plane.corners.len() > 500);
            assert!(plane.corners.iter().all(|c| (c.2 - 3.0 * c.0 + 2.0 * c.1).abs() < 1e-12));
            let at = |field: &Field, x: f64, y: f64| {
                let near = |c: &&Corner| (c.0 - x).abs() < 1e-9 && (c.1 - y).abs() < 1e-9;
                field.corners.iter().find(near).expect("its corner").2
            };
            // a spot of light: its edges are those of the sensors, and nothing is below 0
            let (spot, points) = of(|x| if x == 2.0 || x == 3.0 { 7.0 } else { 0.0 }, 0.0);
            for &(x, y, value) in &points {
                assert!((at(&spot, x, y) - value).abs() < 1e-12);
            }
            assert!(spot.corners.iter().all(|c| (0.0..=7.0 + 1e-12).contains(&c.2)));
            assert!((at(&spot, 1.5, 0.0) - 3.5).abs() < 1e-12, "{}", at(&spot, 1.5, 0.0));
            let (hill, _) = of(|x| 10.0 - (x - 2.5).powi(2), 0.0);
            for c in hill.corners.iter().filter(|c| (1.0..=4.0).contains(&c.0)) {
                assert!((c.2 - 10.0 + (c.0 - 2.5).powi(2)).abs() < 1e-12, "{c:?}");
            }
            // a corner between slopes is no hollow that could reach below 0
            let (dark, _) = of(|x| (x - 2.5).powi(2).max(1.0) - 1.0, 0.0);
            assert!(dark.corners.iter().all(|c| c.2 >= 0.0));
        }
        let star = [(0.0, 1.0), (1.0, 0.0), (2.0, 1.0), (1.0, 2.0), (1.0, 1.0)];
        assert!(Field::smooth(&star.map(|(x, y)| (x, y, 0.0))).is_none());
    }

    /// Rows that are more than three of their own steps apart, along either axis, are bands with
    /// nothing between them and no contours, whose values are those of their points; of three steps,
    /// or shorter than they are apart, they are not.
    #[test]
    fn rows_far_apart_are_bands() {
        for turned in [false, true] {
            let of = |columns: u32, apart: f64| {
                let mut points = grid(columns, 3, (0.3, apart), (1.0, 2.0));
                if turned {
                    points.iter_mut().for_each(|p| (p.0, p.1) = (p.1, p.0));
                }
                let field = Field::with_bands(&points, &vec![0; points.len()]);
                let outlines = field.outlines(&[f64::NEG_INFINITY]).remove(0);
                let areas: Vec<f64> = outlines.into_iter().map(|(area, _)| area).collect();
                (areas, field)
            };
            let (areas, field) = of(6, 0.91);
            assert_eq!(areas.len(), 3, "{areas:?}");
            assert!(areas.iter().all(|area| (area - 1.5 * 0.2).abs() < 1e-9));
            assert!(field.contours(2.5).is_empty());
            for &(x, y, value) in field.corners() {
                let along = if turned { y } else { x };
                assert!((value - (along - 1.0) / 0.3).abs() < 1e-9, "{value} at {along}");
            }
            for (columns, apart) in [(6, 0.9), (3, 0.91)] {
                let (areas, field) = of(columns, apart);
                let whole = 0.3 * f64::from(columns - 1) * 2.0 * apart;
                assert!(areas.len() == 1 && (areas[0] - whole).abs() < 1e-9, "{areas:?}");
                assert_eq!(field.contours(1.5).len(), 1);
            }
        }
    }

    /// Points on a line are no part of a plane.
    #[test]
    fn a_line_is_no_part() {
        assert!(parts(&[(0.0, 0.0, 1.0), (1.0, 1.0, 1.0), (2.0, 2.0, 1.0)], &[0; 3]).is_empty());
        assert!(parts(&[], &[]).is_empty());
    }
}
