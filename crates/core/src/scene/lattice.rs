//! The lattice of a scene that repeats without end, such as a field of which one cell is described.
//!
//! Everything in such a scene has an image in each cell: the cell (i, j) holds all that the cell
//! (0, 0) holds, moved by i and j periods. A place keeps the coordinates that the scene gives it,
//! and a ray that leaves the cell goes on in the next one in the coordinates of the first: each
//! piece of it, a [`Stretch`], starts at a point computed afresh in double precision, so that
//! nothing drifts however far the ray goes.

use std::f64::consts::{PI, TAU};

use glam::{DVec2, DVec3, Vec3};

use crate::{
    error::{Problem, number},
    math::{
        geometry::{Extent, ROUNDING, Ray, Triangle},
        rng::Stream,
        round::Round,
    },
};

/// Number of cells with surfaces, captors or lamps after which a ray is given up as lost.
pub const MAX_CELLS: u32 = 10_000;

/// Heights of the images of a lamp are taken for at least this share of a period when one is drawn:
/// otherwise nothing would be joined with the images beside the nearest.
const LEAST_HEIGHT: f64 = 0.25;

/// Number of periods beyond which a shape reaches far: it is whole, and rounding is allowed for, as
/// far as that.
const FAR_REACHING: f64 = 1_000.0;

/// Beyond this many periods, or heights, the probability of an image is that of its middle.
const FAR: f64 = 50.0;

/// Layers nearer to each other than this share of the shortest period are taken together for rays that
/// rise or fall by at least [`STEEP`] with each metre: to cross a few more cells takes less time than
/// to find the next of many layers. Rays nearer to level would run on through thousands of cells.
const NEAR: f64 = 0.25;
const STEEP: f64 = 0.01;

/// Indices of a cell along x and y; (0, 0) is the one that the scene describes.
pub type Cell = [i32; 2];

/// The periods of a scene along x, y or both. Lengths are in m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lattice {
    /// For x and y: where the cell begins, and its length; `None` where nothing repeats.
    periods: [Option<Period>; 2],
}

/// The period along one axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Period {
    /// Where the cell begins.
    pub from: f64,
    /// Length of the cell, above 0.
    pub length: f64,
    /// By how much the ground rises from one cell to the next.
    pub rise: f64,
}

impl Lattice {
    /// Makes a lattice of the periods along x and y.
    pub fn new(periods: [Option<Period>; 2]) -> Self {
        Self { periods }
    }

    /// Refuses periods that are not from 1e-6 to 1e6 m long, and slopes steeper than 10.
    pub fn check(&self) -> Result<(), Problem> {
        if self.periods == [None, None] {
            return Err(Problem::new("it repeats along no axis", "give x, y or both"));
        }
        for (axis, period) in ["x", "y"].into_iter().zip(&self.periods) {
            let Some(Period { from, length, rise }) = *period else { continue };
            if !(from.is_finite() && (1e-6..=1e6).contains(&length)) {
                let problem = format!("a period of {} m along {axis}", number(length));
                return Err(Problem::new(
                    problem,
                    "give a lower and a higher end, 1e-6 to 1e6 m apart",
                ));
            }
            if !(rise / length).abs().is_finite() || (rise / length).abs() > 10.0 {
                let problem = format!("a slope of {} m in a period along {axis}", number(rise));
                return Err(Problem::new(problem, "give the rise of the ground over one period"));
            }
        }
        Ok(())
    }

    /// Returns the same lattice in coordinates relative to `center`.
    pub fn relative_to(&self, center: DVec3) -> Self {
        let moved = |axis: usize| {
            self.periods[axis].map(|period| Period { from: period.from - center[axis], ..period })
        };
        Self::new([moved(0), moved(1)])
    }

    /// Returns the period along x (0) or y (1).
    pub fn period(&self, axis: usize) -> Option<Period> {
        self.periods[axis]
    }

    /// Returns the ground area of a cell, m2; `None` if the scene repeats along one axis only.
    pub fn area(&self) -> Option<f64> {
        Some(self.periods[0]?.length * self.periods[1]?.length)
    }

    /// Returns the length of the shortest period, m.
    pub fn shortest(&self) -> f64 {
        let lengths = self.periods.iter().flatten().map(|period| period.length);
        lengths.fold(f64::INFINITY, f64::min)
    }

    /// Returns whether the ground rises or falls from cell to cell.
    pub fn slopes(&self) -> bool {
        self.periods.iter().flatten().any(|period| period.rise != 0.0)
    }

    /// Returns the normal of the slope on which the cells lie, a unit vector that points up. From
    /// below it, where the hill is, no light comes. `None` if the ground neither rises nor falls from
    /// cell to cell.
    pub fn hillside(&self) -> Option<DVec3> {
        let [x, y] = self.rises();
        self.slopes().then(|| DVec3::new(-x, -y, 1.0).normalize())
    }

    /// Returns the way from a place to its image in a cell.
    pub fn shift(&self, cell: Cell) -> DVec3 {
        (0..2).fold(DVec3::ZERO, |shift, axis| match self.periods[axis] {
            Some(Period { length, rise, .. }) => {
                let along = if axis == 0 { DVec3::X } else { DVec3::Y };
                shift + f64::from(cell[axis]) * (length * along + rise * DVec3::Z)
            }
            None => shift,
        })
    }

    /// Returns the cell in which a point lies.
    pub fn cell_of(&self, point: DVec3) -> Cell {
        [0, 1].map(|axis| {
            let along = |p: Period| ((point[axis] - p.from) / p.length).floor() as i32;
            self.periods[axis].map_or(0, along)
        })
    }

    /// Returns the height of a point above the slope on which the cells lie. It is the same for all
    /// images of a place.
    pub fn level(&self, point: DVec3) -> f64 {
        above(self.rises(), point)
    }

    /// Returns by how much the ground rises with each metre along x and y; 0 where nothing repeats.
    fn rises(&self) -> [f64; 2] {
        self.periods.map(|period| period.map_or(0.0, |p| p.rise / p.length))
    }

    /// Returns the whole periods between two points that are images of each other but for rounding.
    pub fn between(&self, from: DVec3, to: DVec3) -> Cell {
        [0, 1].map(|axis| {
            let along = |p: Period| ((to[axis] - from[axis]) / p.length).round() as i32;
            self.periods[axis].map_or(0, along)
        })
    }

    /// Returns the cells in which a shape has images that reach into the cell (0, 0), to within
    /// `slack`, as first and last along x and y.
    pub fn images_of(&self, corners: &[DVec3], slack: f64) -> [[i32; 2]; 2] {
        [0, 1].map(|axis| {
            let Some(Period { from, length, .. }) = self.periods[axis] else { return [0, 0] };
            let along = corners.iter().map(|corner| corner[axis]);
            let min = along.clone().fold(f64::INFINITY, f64::min);
            let max = along.fold(f64::NEG_INFINITY, f64::max);
            let first = ((from - slack - max) / length).ceil();
            let last = ((from + length + slack - min) / length).floor();
            [first as i32, last as i32]
        })
    }

    /// Returns the same cells without those that are far from where the middle one of the corners
    /// along x, and along y, comes into the cell (0, 0).
    fn images_kept(&self, corners: &[DVec3; 3], slack: f64) -> [[i32; 2]; 2] {
        let mut cells = self.images_of(corners, slack);
        let inside = corners.map(|corner| self.cell_of(corner));
        let half = FAR_REACHING as i32 / 2;
        for axis in 0..2 {
            let mut along = inside.map(|cell| cell[axis]);
            along.sort_unstable();
            let [first, last] = cells[axis];
            let near = along[1].saturating_neg();
            cells[axis] =
                [first.max(near.saturating_sub(half)), last.min(near.saturating_add(half))];
        }
        cells
    }

    /// Returns whether a shape reaches over more than a thousand periods. Of its images only those
    /// about its middle corner are there.
    pub fn reaches_far(&self, shape: &Triangle) -> bool {
        let size = Extent::of_triangles([shape]).size();
        f64::from(size.max_element()) > FAR_REACHING * self.shortest()
    }

    /// Returns the corners of the cell (0, 0), seen from above, wider by `slack` on all sides; `None`
    /// if the scene repeats along one axis only.
    fn corners(&self, slack: f64) -> Option<[DVec2; 4]> {
        let [x, y] = [self.periods[0]?, self.periods[1]?]
            .map(|period| [period.from - slack, period.from + period.length + slack]);
        Some([[0, 0], [1, 0], [1, 1], [0, 1]].map(|[i, j]| DVec2::new(x[i], y[j])))
    }

    /// Returns whether a triangle reaches into the cell (0, 0), to within `slack`, if the box around
    /// it does: whether no line along one of its edges parts them, seen from above.
    fn holds_some_of(&self, corners: &[DVec3; 3], slack: f64) -> bool {
        let Some(cell) = self.corners(slack) else { return true };
        let triangle = corners.map(|corner| corner.truncate());
        (0..3).all(|i| {
            let (p, across) = (triangle[i], (triangle[(i + 1) % 3] - triangle[i]).perp());
            let range = |points: &[DVec2]| {
                let sides = points.iter().map(|point| (point - p).dot(across));
                sides.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), s| (a.min(s), b.max(s)))
            };
            let ((a, b), (c, d)) = (range(&triangle), range(&cell));
            a <= d && c <= b
        })
    }

    /// Returns a box around the part of a triangle that lies in the cell (0, 0), to within `slack`.
    /// Of a triangle that reaches over many cells it is a small part of the box around it all.
    pub fn box_within(&self, triangle: &Triangle, slack: f64) -> Extent {
        let mut polygon = [triangle.a, triangle.b, triangle.c].map(Vec3::as_dvec3).to_vec();
        for axis in 0..2 {
            let Some(Period { from, length, .. }) = self.periods[axis] else { continue };
            for (border, side) in [(from - slack, 1.0), (from + length + slack, -1.0)] {
                // the part beyond the border (Sutherland and Hodgman 1974)
                let inside = |p: DVec3| side * (p[axis] - border);
                let next = polygon.iter().cycle().skip(1);
                let cut = polygon.iter().zip(next).flat_map(|(&p, &q)| {
                    let (a, b) = (inside(p), inside(q));
                    let own = (a >= 0.0).then_some(p);
                    own.into_iter().chain(((a < 0.0) != (b < 0.0)).then(|| p.lerp(q, a / (a - b))))
                });
                polygon = cut.collect();
            }
        }
        let whole = Extent::of_triangles([triangle]);
        if polygon.is_empty() {
            return whole;
        }
        // a ray is taken to meet the triangle to within the rounding of its farthest corner
        let rounding = ROUNDING * triangle.reach().max_element();
        Extent::of(polygon.into_iter().map(|p| p.as_vec3())).wider(rounding)
    }

    /// Returns whether a triangle lies along the slope and covers the whole cell (0, 0), to within
    /// `slack`.
    fn is_ground(&self, corners: &[DVec3; 3], slack: f64) -> bool {
        let levels = corners.map(|corner| self.level(corner));
        let rounding = 1e-9 * corners.iter().map(|c| c.abs().max_element()).fold(0.0, f64::max);
        let is_level = levels.iter().all(|level| (level - levels[0]).abs() <= rounding);
        let triangle = corners.map(|corner| corner.truncate());
        let turn = (triangle[1] - triangle[0]).perp_dot(triangle[2] - triangle[0]).signum();
        is_level
            && self.corners(slack).is_some_and(|cell| {
                cell.iter().all(|point| {
                    (0..3).all(|i| {
                        let edge = triangle[(i + 1) % 3] - triangle[i];
                        edge.perp_dot(point - triangle[i]) * turn > 0.0
                    })
                })
            })
    }

    /// Returns the number of those cells.
    pub fn count_images(&self, corners: &[DVec3], slack: f64) -> u64 {
        let counts = self.images_of(corners, slack);
        let along = |[first, last]: Cell| i64::from(last) - i64::from(first) + 1;
        counts
            .map(|range| along(range).max(0) as u64)
            .iter()
            .fold(1, |all, one| all.saturating_mul(*one))
    }

    /// Returns the difference of heights by which images of a lamp are drawn, and the horizontal
    /// way from the middle of the lamp to the point.
    fn seen(&self, point: Vec3, middle: Vec3, radius: f32) -> (f64, DVec2) {
        let away = (point - middle).as_dvec3();
        let lengths = self.periods.iter().flatten().map(|period| period.length);
        let (product, count) = lengths.fold((1.0, 0), |(p, n), length| (p * length, n + 1));
        let least = LEAST_HEIGHT * f64::powf(product, 1.0 / f64::from(count.max(1)));
        let height = match self.periods {
            [Some(_), Some(_)] => self.level(away).abs(),
            [Some(_), None] => away.z.hypot(away.y),
            [None, _] => away.z.hypot(away.x),
        };
        (height.max(f64::from(radius)).max(least), away.truncate())
    }

    /// Draws the image of a lamp, a ball of `radius` around `middle`, with which a point is joined.
    /// Images without end may be drawn, near ones more often: their probability is that share of
    /// the half space above the point, or of the half plane where the scene repeats along one axis,
    /// that their cell takes at the height of the lamp. It falls as the light of a lamp does, with
    /// the third power of the distance (the second along one axis).
    pub fn choose_image(&self, point: Vec3, middle: Vec3, radius: f32, rng: &mut Stream) -> Cell {
        let (height, away) = self.seen(point, middle, radius);
        // the way to the chosen place at the height of the lamp
        let way = match self.periods {
            [Some(_), Some(_)] => {
                let cos = 1.0 - rng.uniform_fine();
                let way = height * (cos.powi(-2) - 1.0).max(0.0).sqrt();
                let (sin, cos) = (TAU * f64::from(rng.uniform())).sin_cos();
                way * DVec2::new(cos, sin)
            }
            _ => DVec2::splat(height * (PI * (rng.uniform_fine() - 0.5)).tan()),
        };
        [0, 1].map(|axis| {
            let image = |p: Period| ((away[axis] + way[axis]) / p.length).round() as i32;
            self.periods[axis].map_or(0, image)
        })
    }

    /// Returns the probability with which [`choose_image`](Self::choose_image) draws a cell.
    pub fn probability(&self, point: Vec3, middle: Vec3, radius: f32, cell: Cell) -> f32 {
        let (height, away) = self.seen(point, middle, radius);
        let side = |axis: usize| {
            self.periods[axis]
                .map(|Period { length, .. }| (f64::from(cell[axis]) * length - away[axis], length))
        };
        let probability = match [side(0), side(1)] {
            [Some((x, a)), Some((y, b))] => {
                let far = FAR * a.max(b).max(height);
                if x.abs() > far || y.abs() > far {
                    let d2 = x * x + y * y + height * height;
                    a * b * height / (TAU * d2 * d2.sqrt())
                } else {
                    // the solid angle of a rectangle (Van Oosterom and Strackee 1983)
                    let corner = |x: f64, y: f64| {
                        (x * y).atan2(height * (x * x + y * y + height * height).sqrt())
                    };
                    let [x0, x1, y0, y1] = [x - a / 2.0, x + a / 2.0, y - b / 2.0, y + b / 2.0];
                    (corner(x1, y1) - corner(x0, y1) - corner(x1, y0) + corner(x0, y0)) / TAU
                }
            }
            [Some((x, length)), None] | [None, Some((x, length))] => {
                if x.abs() > FAR * length.max(height) {
                    length * height / (PI * (x * x + height * height))
                } else {
                    let angle = |x: f64| (x / height).atan();
                    (angle(x + length / 2.0) - angle(x - length / 2.0)) / PI
                }
            }
            [None, None] => 1.0,
        };
        probability as f32
    }

    /// Returns the square of the distance of a point from the nearest image of another, m2.
    pub fn nearest_squared(&self, point: Vec3, other: Vec3) -> f32 {
        let away = (point - other).as_dvec3();
        let cell = self.between(DVec3::ZERO, away);
        (away - self.shift(cell)).length_squared() as f32
    }
}

/// Returns the height of a point above a slope that rises by so much with each metre along x and y.
#[inline]
fn above([x, y]: [f64; 2], point: DVec3) -> f64 {
    point.z - x * point.x - y * point.y
}

/// The heights at which a scene that repeats holds anything, and its ends along an axis on which it
/// does not repeat.
#[derive(Clone, Debug, PartialEq)]
pub struct Layers {
    /// Disjoint ranges of heights above the slope, in rising order.
    heights: Vec<[f64; 2]>,
    /// The same, of which those are taken together that are near to each other.
    together: Vec<[f64; 2]>,
    /// Range along x and y; infinite where the scene repeats.
    ends: [[f64; 2]; 2],
    /// What rounding may put between a ray and the border of a cell that it meets, m.
    pub slack: f64,
}

impl Layers {
    /// Finds the layers of a scene of which `each_piece` visits the corners of each piece. A piece
    /// fills the whole range of heights of its corners.
    pub fn new(lattice: &Lattice, each_piece: impl FnOnce(&mut dyn FnMut(&[DVec3]))) -> Self {
        let mut ends = [[f64::INFINITY, f64::NEG_INFINITY]; 2];
        let mut reach = 0f64;
        for axis in 0..2 {
            if let Some(Period { from, length, .. }) = lattice.period(axis) {
                reach = reach.max(from.abs()).max((from + length).abs());
            }
        }
        let mut heights = Vec::new();
        each_piece(&mut |corners| {
            let [mut low, mut high] = [f64::INFINITY, f64::NEG_INFINITY];
            for corner in corners {
                let level = lattice.level(*corner);
                (low, high) = (low.min(level), high.max(level));
                reach = reach.max(corner.abs().max_element());
                for (axis, ends) in ends.iter_mut().enumerate() {
                    *ends = [ends[0].min(corner[axis]), ends[1].max(corner[axis])];
                }
            }
            heights.push([low, high]);
        });
        // one corner very far away must not make every cell reach into all others
        let reach = reach.min(FAR_REACHING * lattice.shortest());
        let slack = 8.0 * f64::from(ROUNDING) * reach;
        heights.sort_by(|a, b| a[0].total_cmp(&b[0]));
        heights.iter_mut().for_each(|[low, high]| (*low, *high) = (*low - slack, *high + slack));
        let heights = joined(&heights, 0.0);
        let together = joined(&heights, NEAR * lattice.shortest());
        let end = |axis: usize| match lattice.period(axis) {
            Some(_) => [f64::NEG_INFINITY, f64::INFINITY],
            None => [ends[axis][0] - slack, ends[axis][1] + slack],
        };
        Self { heights, together, ends: [end(0), end(1)], slack }
    }

    /// Returns the lowest and the highest height; `None` for an empty scene.
    pub fn range(&self) -> Option<[f64; 2]> {
        Some([self.heights.first()?[0], self.heights.last()?[1]])
    }

    /// Returns how much farther a ray has to go from a height to come to a layer, if it rises by
    /// `slope` with each metre: 0 in a layer, `None` if it comes to none.
    fn way_to_layer(&self, height: f64, slope: f64) -> Option<f64> {
        let layers = if slope.abs() < STEEP { &self.heights } else { &self.together };
        // the first layer that does not end below
        let above = layers.partition_point(|layer| layer[1] < height);
        if layers.get(above).is_some_and(|layer| layer[0] <= height) {
            return Some(0.0);
        }
        let next = match slope {
            _ if slope > 0.0 => layers.get(above)?[0],
            _ if slope < 0.0 => layers[..above].last()?[1],
            _ => return None,
        };
        Some((next - height) / slope)
    }
}

/// Joins ranges, in the order of their lower ends, that overlap or have at most a `gap` between them.
fn joined(ranges: &[[f64; 2]], gap: f64) -> Vec<[f64; 2]> {
    let mut joined: Vec<[f64; 2]> = Vec::new();
    for &[low, high] in ranges {
        match joined.last_mut() {
            Some(last) if low <= last[1] + gap => last[1] = last[1].max(high),
            _ => joined.push([low, high]),
        }
    }
    joined
}

/// The piece of a ray within one cell, in the coordinates of the cell (0, 0).
#[derive(Clone, Copy, Debug)]
pub struct Stretch {
    /// The ray, which starts where it comes into the cell or a little before.
    pub ray: Ray,
    /// Distance along the whole ray at which this ray starts, m.
    pub start: f64,
    /// Distances along this ray at which it comes into the cell and leaves it, m.
    pub inside: [f32; 2],
    /// What rounding may put between these two borders and where the ray meets what lies in them, m.
    pub slack: [f32; 2],
    /// The cell.
    pub cell: Cell,
}

impl Stretch {
    /// Returns the distance up to which the ray may meet what lies in the cell or in its borders, m.
    pub fn end(&self) -> f32 {
        self.inside[1] + self.slack[1]
    }
}

/// A ray that comes to a border at a flatter angle than this sine is taken to come at this one.
const FLATTEST: f64 = 1e-3;

/// Follows a ray from cell to cell.
#[derive(Clone, Debug)]
pub struct Walk<'a> {
    lattice: &'a Lattice,
    layers: &'a Layers,
    origin: DVec3,
    direction: DVec3,
    /// By how much the slope rises with each metre along x and y, and the ray above the slope.
    rises: [f64; 2],
    rise: f64,
    /// Distance at which the ray has come into the next cell.
    t: f64,
    /// What rounding may put between the border that it has come by and what lies in it, m.
    slack: f64,
    cell: Cell,
    cells: u32,
    /// Whether the ray was given up.
    pub is_lost: bool,
}

impl<'a> Walk<'a> {
    /// Starts at the origin of a ray, which may lie in any cell.
    pub fn new(lattice: &'a Lattice, layers: &'a Layers, ray: &Ray) -> Self {
        let (origin, direction) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
        let (cell, rises) = (lattice.cell_of(origin), lattice.rises());
        let rise = above(rises, direction);
        let (t, slack, cells, is_lost) = (0.0, layers.slack, 0, false);
        Self { lattice, layers, origin, direction, rises, rise, t, slack, cell, cells, is_lost }
    }

    /// Goes on to the next layer. Returns whether there is one.
    #[inline]
    fn reach_layer(&mut self) -> bool {
        let at = self.origin + self.t * self.direction;
        for axis in 0..2 {
            let ([from, to], d) = (self.layers.ends[axis], self.direction[axis]);
            if (at[axis] > to && d >= 0.0) || (at[axis] < from && d <= 0.0) {
                return false;
            }
        }
        match self.layers.way_to_layer(above(self.rises, at), self.rise) {
            Some(0.0) => true,
            Some(way) => {
                self.t += way;
                self.cell = self.lattice.cell_of(self.origin + self.t * self.direction);
                self.t.is_finite()
            }
            // a level ray that runs between layers for ever meets nothing
            None => false,
        }
    }
}

impl Iterator for Walk<'_> {
    type Item = Stretch;

    fn next(&mut self) -> Option<Stretch> {
        if !self.t.is_finite() || !self.reach_layer() {
            return None;
        }
        if self.cells == MAX_CELLS {
            self.is_lost = true;
            return None;
        }
        self.cells += 1;
        let borders = [0, 1].map(|axis| {
            let d = self.direction[axis];
            match self.lattice.periods[axis] {
                Some(Period { from, length, .. }) if d != 0.0 => {
                    let border = f64::from(self.cell[axis]) + f64::from(u8::from(d > 0.0));
                    (from + border * length - self.origin[axis]) / d
                }
                _ => f64::INFINITY,
            }
        });
        let exit = borders[0].min(borders[1]).max(self.t);
        let start = (self.t - self.layers.slack).max(0.0);
        let origin = self.origin + start * self.direction - self.lattice.shift(self.cell);
        let (cell, before) = (self.cell, self.slack);
        let inside = [self.t - start, exit - start].map(|t| t as f32);
        self.t = exit;
        self.slack = self.layers.slack;
        for (axis, border) in borders.into_iter().enumerate() {
            // a ray through a corner goes on in the cell beyond it
            if border <= exit {
                self.cell[axis] += if self.direction[axis] > 0.0 { 1 } else { -1 };
                let sine = self.direction[axis].abs().max(FLATTEST);
                let along = f64::from(ROUNDING) * (exit - start);
                self.slack = self.slack.max(self.layers.slack / sine + along);
            }
        }
        let ray = Ray { origin: origin.as_vec3(), direction: self.direction.as_vec3() };
        let slack = [before, self.slack].map(|slack| slack as f32);
        Some(Stretch { ray, start, inside, slack, cell })
    }
}

/// Images of triangles, or of other shapes, that reach into the cell (0, 0) from others. A search
/// structure holds the shapes of the scene first and then these.
#[derive(Clone, Debug, PartialEq)]
pub struct Images<S = Triangle> {
    /// The images.
    pub shapes: Vec<S>,
    /// For each of them, the index of the shape and the cell into which it is moved.
    pub of: Vec<(u32, Cell)>,
}

impl<S> Default for Images<S> {
    fn default() -> Self {
        Self { shapes: Vec::new(), of: Vec::new() }
    }
}

impl Images<Round> {
    /// Finds the images of discs and spheres, which are given relative to the centre of the scene, as
    /// the lattice is.
    pub fn of_rounds(lattice: &Lattice, slack: f64, rounds: &[Round]) -> Self {
        let mut images = Self::default();
        for (index, round) in rounds.iter().enumerate() {
            let [[x0, x1], [y0, y1]] = lattice.images_of(&round.corners(), slack);
            let cells = (x0..=x1).flat_map(|x| (y0..=y1).map(move |y| [x, y]));
            for cell in cells.filter(|cell| *cell != [0, 0]) {
                images.shapes.push(round.moved(lattice.shift(cell)));
                images.of.push((index as u32, cell));
            }
        }
        images
    }
}

impl Images {
    /// Finds the images of triangles, given by their corners, which `local` turns into the
    /// coordinates in which rays are traced. Of level ground that covers the cell many times over,
    /// one image is enough where each stops light; `all` are needed where each counts it.
    pub fn new<'t>(
        lattice: &Lattice,
        slack: f64,
        all: bool,
        triangles: impl Iterator<Item = &'t [DVec3; 3]>,
        local: impl Fn(&[DVec3; 3]) -> Triangle,
    ) -> Self {
        let mut images = Self::default();
        for (index, corners) in triangles.enumerate() {
            let [[x0, x1], [y0, y1]] = lattice.images_kept(corners, slack);
            let cells = (x0..=x1).flat_map(|x| (y0..=y1).map(move |y| [x, y]));
            let moved = |cell: Cell| corners.map(|corner| corner + lattice.shift(cell));
            let ground = match all {
                true => None,
                false => cells.clone().find(|&cell| lattice.is_ground(&moved(cell), slack)),
            };
            let chosen = |cell: Cell| match ground {
                Some(ground) => cell == ground,
                None => lattice.holds_some_of(&moved(cell), slack),
            };
            for cell in cells.filter(|cell| *cell != [0, 0] && chosen(*cell)) {
                images.shapes.push(local(&moved(cell)));
                images.of.push((index as u32, cell));
            }
        }
        images
    }
}

impl<S> Images<S> {
    /// Returns the index and the cell of the shape of which the search structure, with so many `own`
    /// shapes, knows this one.
    #[inline]
    pub fn origin(&self, shape: u32, own: usize) -> (u32, Cell) {
        match (shape as usize).checked_sub(own) {
            None => (shape, [0, 0]),
            Some(image) => self.of[image],
        }
    }
}

/// What a scene that repeats knows beside its triangles.
#[derive(Clone, Debug, PartialEq)]
pub struct Repeats {
    /// The periods, relative to the centre of the scene.
    pub lattice: Lattice,
    /// Where there is anything.
    pub layers: Layers,
    /// Images of the triangles of surfaces.
    pub surfaces: Images,
    /// Images of the triangles of virtual captors, where the user put them.
    pub captors: Images,
    /// Images of the discs and spheres among virtual captors, where the user put them.
    pub rounds: Images<Round>,
}

impl Repeats {
    /// Follows a ray from cell to cell.
    pub fn walk(&self, ray: &Ray) -> Walk<'_> {
        Walk::new(&self.lattice, &self.layers, ray)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two level sheets a tenth of a period apart are one layer for a ray that rises through the gap
    /// between them, and two for rays that are nearly level: the first piece of one that rises by a
    /// tenth of what is steep begins at the upper sheet, and a level one meets nothing and is not
    /// given up. Sheets half a period apart are two layers for all rays.
    #[test]
    fn layers_are_taken_together_unless_rays_are_level() {
        let along = Some(Period { from: 0.0, length: 1.0, rise: 0.0 });
        let lattice = Lattice::new([along, along]);
        let first_piece = |gap: f64, rise: f64| {
            let layers = Layers::new(&lattice, |visit| {
                [0.0, gap].into_iter().for_each(|z| visit(&[DVec3::new(0.5, 0.5, z)]));
            });
            let direction = DVec3::new((1.0 - rise * rise).sqrt(), 0.0, rise).as_vec3();
            let origin = Vec3::new(0.2, 0.2, 0.5 * gap as f32);
            let mut walk = Walk::new(&lattice, &layers, &Ray { origin, direction });
            let piece = walk.next();
            assert!(!walk.is_lost);
            piece.map(|piece| piece.start)
        };
        assert_eq!(first_piece(0.1, 0.5), Some(0.0));
        let far = first_piece(0.1, 0.001).expect("a piece");
        assert!((far - 50.0).abs() < 0.02, "{far}");
        assert_eq!(first_piece(0.1, 0.0), None);
        let apart = first_piece(0.5, 0.5).expect("a piece");
        assert!((apart - 0.5).abs() < 1e-3, "{apart}");
    }
}
