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
        geometry::{ROUNDING, Ray, Triangle},
        rng::Stream,
    },
};

/// Number of cells with surfaces, captors or lamps after which a ray is given up as lost.
pub const MAX_CELLS: u32 = 10_000;

/// Heights of the images of a lamp are taken for at least this share of a period when one is drawn:
/// otherwise nothing would be joined with the images beside the nearest.
const LEAST_HEIGHT: f64 = 0.25;

/// Beyond this many periods, or heights, the probability of an image is that of its middle.
const FAR: f64 = 50.0;

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
        Self { periods: [moved(0), moved(1)] }
    }

    /// Returns the period along x (0) or y (1).
    pub fn period(&self, axis: usize) -> Option<Period> {
        self.periods[axis]
    }

    /// Returns the ground area of a cell, m2; `None` if the scene repeats along one axis only.
    pub fn area(&self) -> Option<f64> {
        Some(self.periods[0]?.length * self.periods[1]?.length)
    }

    /// Returns whether the ground rises or falls from cell to cell.
    pub fn slopes(&self) -> bool {
        self.periods.iter().flatten().any(|period| period.rise != 0.0)
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
        (0..2).fold(point.z, |level, axis| match self.periods[axis] {
            Some(Period { length, rise, .. }) => level - rise / length * point[axis],
            None => level,
        })
    }

    /// Returns the whole periods between two points that are images of each other but for rounding.
    pub fn between(&self, from: DVec3, to: DVec3) -> Cell {
        [0, 1].map(|axis| {
            let along = |p: Period| ((to[axis] - from[axis]) / p.length).round() as i32;
            self.periods[axis].map_or(0, along)
        })
    }

    /// Returns the range of cells along an axis in which images of what reaches from `min` to `max`
    /// come into the cell (0, 0), to within `slack`.
    fn images_along(&self, axis: usize, min: f64, max: f64, slack: f64) -> [i32; 2] {
        let Some(Period { from, length, .. }) = self.periods[axis] else { return [0, 0] };
        let first = ((from - slack - max) / length).ceil();
        let last = ((from + length + slack - min) / length).floor();
        [first as i32, last as i32]
    }

    /// Returns the cells in which a shape has images that reach into the cell (0, 0), to within
    /// `slack`, as first and last along x and y.
    pub fn images_of(&self, corners: &[DVec3], slack: f64) -> [[i32; 2]; 2] {
        [0, 1].map(|axis| {
            let along = corners.iter().map(|corner| corner[axis]);
            let min = along.clone().fold(f64::INFINITY, f64::min);
            let max = along.fold(f64::NEG_INFINITY, f64::max);
            self.images_along(axis, min, max, slack)
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

/// The heights at which a scene that repeats holds anything, and its ends along an axis on which it
/// does not repeat.
#[derive(Clone, Debug, PartialEq)]
pub struct Layers {
    /// Disjoint ranges of heights above the slope, in rising order.
    heights: Vec<[f64; 2]>,
    /// Range along x and y; infinite where the scene repeats.
    ends: [[f64; 2]; 2],
    /// What rounding may put between a ray and the border of a cell that it meets, m.
    pub slack: f64,
}

impl Layers {
    /// Finds the layers of a scene that consists of `pieces`, each a list of corners.
    pub fn new(lattice: &Lattice, pieces: impl Iterator<Item = [DVec3; 3]>) -> Self {
        let mut ends = [[f64::INFINITY, f64::NEG_INFINITY]; 2];
        let mut reach = 0f64;
        for axis in 0..2 {
            if let Some(Period { from, length, .. }) = lattice.period(axis) {
                reach = reach.max(from.abs()).max((from + length).abs());
            }
        }
        let mut heights = Vec::new();
        for corners in pieces {
            let levels = corners.map(|corner| lattice.level(corner));
            let low = levels.into_iter().fold(f64::INFINITY, f64::min);
            let high = levels.into_iter().fold(f64::NEG_INFINITY, f64::max);
            heights.push([low, high]);
            reach =
                corners.iter().fold(reach, |reach, corner| reach.max(corner.abs().max_element()));
            for (axis, ends) in ends.iter_mut().enumerate() {
                for corner in corners {
                    *ends = [ends[0].min(corner[axis]), ends[1].max(corner[axis])];
                }
            }
        }
        let slack = 8.0 * f64::from(ROUNDING) * reach;
        heights.sort_by(|a, b| a[0].total_cmp(&b[0]));
        let mut layers: Vec<[f64; 2]> = Vec::new();
        for [low, high] in heights {
            let [low, high] = [low - slack, high + slack];
            match layers.last_mut() {
                Some(layer) if low <= layer[1] => layer[1] = layer[1].max(high),
                _ => layers.push([low, high]),
            }
        }
        let end = |axis: usize| match lattice.period(axis) {
            Some(_) => [f64::NEG_INFINITY, f64::INFINITY],
            None => [ends[axis][0] - slack, ends[axis][1] + slack],
        };
        Self { heights: layers, ends: [end(0), end(1)], slack }
    }

    /// Returns the lowest and the highest height; `None` for an empty scene.
    pub fn range(&self) -> Option<[f64; 2]> {
        Some([self.heights.first()?[0], self.heights.last()?[1]])
    }

    /// Returns how much farther a ray has to go from a height to come to a layer, if it rises by
    /// `slope` with each metre: 0 in a layer, `None` if it comes to none.
    fn way_to_layer(&self, height: f64, slope: f64) -> Option<f64> {
        // the first layer that does not end below
        let above = self.heights.partition_point(|layer| layer[1] < height);
        if self.heights.get(above).is_some_and(|layer| layer[0] <= height) {
            return Some(0.0);
        }
        let next = match slope {
            _ if slope > 0.0 => self.heights.get(above)?[0],
            _ if slope < 0.0 => self.heights[..above].last()?[1],
            _ => return None,
        };
        Some((next - height) / slope)
    }
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
    /// The cell.
    pub cell: Cell,
}

/// Follows a ray from cell to cell.
#[derive(Clone, Debug)]
pub struct Walk<'a> {
    lattice: &'a Lattice,
    layers: &'a Layers,
    origin: DVec3,
    direction: DVec3,
    /// Distance at which the ray has come into the next cell.
    t: f64,
    cell: Cell,
    cells: u32,
    /// Whether the ray was given up.
    pub is_lost: bool,
}

impl<'a> Walk<'a> {
    /// Starts at the origin of a ray, which may lie in any cell.
    pub fn new(lattice: &'a Lattice, layers: &'a Layers, ray: &Ray) -> Self {
        let (origin, direction) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
        let cell = lattice.cell_of(origin);
        Self { lattice, layers, origin, direction, t: 0.0, cell, cells: 0, is_lost: false }
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
        let slope = self.lattice.level(self.direction);
        match self.layers.way_to_layer(self.lattice.level(at), slope) {
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
        let stretch = Stretch {
            ray: Ray { origin: origin.as_vec3(), direction: self.direction.as_vec3() },
            start,
            inside: [self.t - start, exit - start].map(|t| t as f32),
            cell: self.cell,
        };
        self.t = exit;
        for (axis, border) in borders.into_iter().enumerate() {
            // a ray through a corner goes on in the cell beyond it
            if border <= exit {
                self.cell[axis] += if self.direction[axis] > 0.0 { 1 } else { -1 };
            }
        }
        Some(stretch)
    }
}

/// Images of triangles that reach into the cell (0, 0) from others. A search structure holds the
/// triangles of the scene first and then these.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Images {
    /// The images.
    pub shapes: Vec<Triangle>,
    /// For each of them, the index of the triangle and the cell into which it is moved.
    pub of: Vec<(u32, Cell)>,
}

impl Images {
    /// Finds the images of triangles, given by their corners, which `local` turns into the
    /// coordinates in which rays are traced.
    pub fn new<'t>(
        lattice: &Lattice,
        slack: f64,
        triangles: impl Iterator<Item = &'t [DVec3; 3]>,
        local: impl Fn(&[DVec3; 3]) -> Triangle,
    ) -> Self {
        let mut images = Self::default();
        for (index, corners) in triangles.enumerate() {
            let [[x0, x1], [y0, y1]] = lattice.images_of(corners, slack);
            let cells = (x0..=x1).flat_map(|x| (y0..=y1).map(move |y| [x, y]));
            for cell in cells.filter(|cell| *cell != [0, 0]) {
                let shift = lattice.shift(cell);
                images.shapes.push(local(&corners.map(|corner| corner + shift)));
                images.of.push((index as u32, cell));
            }
        }
        images
    }

    /// Returns the index and the cell of the triangle of which the search structure, with so many
    /// `own` triangles, knows this one.
    #[inline]
    pub fn origin(&self, triangle: u32, own: usize) -> (u32, Cell) {
        match (triangle as usize).checked_sub(own) {
            None => (triangle, [0, 0]),
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
}

impl Repeats {
    /// Follows a ray from cell to cell.
    pub fn walk(&self, ray: &Ray) -> Walk<'_> {
        Walk::new(&self.lattice, &self.layers, ray)
    }
}
