//! Radiance of the whole sphere of directions, constant on each cell of a grid of latitudes and
//! longitudes: a sky, or an environment map.
//!
//! Integrals and samples are those of the same cells, so that photons, paths and quadrature agree
//! exactly. Directions point towards the light. Row 0 is at the zenith, and columns run clockwise
//! seen from above.

use std::{
    f64::consts::{FRAC_PI_2, PI, TAU},
    fmt,
};

use glam::{DVec2, DVec3, Vec2};
use rayon::prelude::*;
use sha2::{Digest, Sha256};

use crate::math::{rng::Stream, sampling::Discrete};

/// Approximate limit on the number of entries of a table for sampling. Where there are more cells,
/// runs of neighbouring cells in a row share an entry.
const MOST_RUNS: usize = 1 << 18;

/// Relative radiance of the sphere, by cells.
#[derive(Clone)]
pub struct RadianceMap {
    grid: Grid,
    /// Value of each cell in proportion to which directions are sampled, row by row: the radiance,
    /// where bands differ the sum of each band's radiance relative to the scale of the band.
    density: Vec<f32>,
    /// Relative radiance of each cell, per band, or `None` where all bands have that of `density`.
    spectral: Option<Spectral>,
    /// Chooses runs of cells by density x solid angle; `None` if the map is dark.
    runs: Option<Discrete>,
    /// Hash of the radiances.
    hash: [u8; 32],
}

/// Writes a hash in the place of the radiances, which may be millions: the hash of a scene is one
/// over the text of its lights, in which a map stands once for each face that it shines through.
impl fmt::Debug for RadianceMap {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Grid { start, rows, columns, .. } = &self.grid;
        let borders: Vec<f64> = match self.grid.even {
            true => Vec::new(),
            false => rows.iter().map(|row| row.from).collect(),
        };
        let size = (rows.len(), columns.len(), self.bands());
        write!(f, "RadianceMap({size:?}, {start:?}, {borders:?}, {:?})", self.hash)
    }
}

#[derive(Clone)]
struct Spectral {
    bands: usize,
    values: Vec<f32>,
    /// Largest ratio of the radiance of a cell to its density, per band.
    most: Vec<f32>,
}

/// Row and column of a cell.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Cell {
    row: usize,
    column: usize,
}

/// The map as a plane sees it, for sampling cells in proportion to density x cosine.
#[derive(Clone)]
pub struct MapEntry {
    view: View,
    runs: Discrete,
}

/// Writes only the view; the rest follows from the map.
impl fmt::Debug for MapEntry {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let View { normal, hillside } = self.view;
        match hillside {
            None => write!(f, "MapEntry({normal:?})"),
            Some(hillside) => write!(f, "MapEntry({normal:?} above {hillside:?})"),
        }
    }
}

/// What a plane sees: the directions in front of it, and above a slope.
#[derive(Clone, Copy)]
struct View {
    /// Unit normal of the plane.
    normal: DVec3,
    /// Unit normal of the slope.
    hillside: Option<DVec3>,
}

impl RadianceMap {
    /// Makes a map from relative radiances that are the same in all bands, row by row from the
    /// zenith, with `columns` values in each row. The first column begins at the azimuth `start`,
    /// rad, clockwise from +y. Values must be finite and at least 0.
    pub fn new(columns: usize, start: f64, values: Vec<f32>) -> Self {
        Self::build(columns, start, values, None)
    }

    /// Makes a map from relative radiances per band; the values of a cell stand side by side.
    /// Directions are sampled by the sum over bands of the radiance relative to the mean of the
    /// band.
    pub fn spectral(columns: usize, start: f64, bands: usize, values: Vec<f32>) -> Self {
        let grid = Grid::new(columns, values.len() / bands / columns, start);
        let mut totals = vec![0.0; bands];
        for (row, cells) in grid.rows.iter().zip(values.chunks(bands * columns)) {
            let solid_angle = row.solid_angle * grid.width;
            for radiance in cells.chunks(bands) {
                let each = totals.iter_mut().zip(radiance);
                each.for_each(|(t, &l)| *t += solid_angle * f64::from(l));
            }
        }
        let weight = |b: usize| if totals[b] > 0.0 { 1.0 / totals[b] } else { 0.0 };
        let weights: Vec<f64> = (0..bands).map(weight).collect();
        let mut most = vec![0.0f32; bands];
        let density = values.chunks(bands).map(|radiance| {
            let relative = radiance.iter().zip(&weights).map(|(&l, w)| f64::from(l) * w);
            let density = relative.sum::<f64>() as f32;
            if density > 0.0 {
                most.iter_mut().zip(radiance).for_each(|(most, l)| *most = most.max(l / density));
            }
            density
        });
        let density = density.collect();
        Self::build(columns, start, density, Some(Spectral { bands, values, most }))
    }

    /// Makes a map with radiance 1 below the horizon and 0 above.
    pub fn below_horizon() -> Self {
        Self::new(1, 0.0, vec![0.0, 1.0])
    }

    /// Makes a map with radiance 1 between two elevations, rad, in one of so many equal columns,
    /// and 0 elsewhere.
    pub fn patch([from, to]: [f64; 2], columns: usize, start: f64, column: usize) -> Self {
        let grid = Grid::of_rows(columns, &[FRAC_PI_2, to, from, -FRAC_PI_2], None, start);
        let mut density = vec![0.0; grid.rows.len() * columns];
        let row = grid.rows.iter().position(|row| row.from == from).unwrap_or(0);
        density[row * columns + column] = 1.0;
        Self::of_grid(grid, density, None)
    }

    fn build(columns: usize, start: f64, density: Vec<f32>, spectral: Option<Spectral>) -> Self {
        Self::of_grid(Grid::new(columns, density.len() / columns, start), density, spectral)
    }

    fn of_grid(grid: Grid, density: Vec<f32>, spectral: Option<Spectral>) -> Self {
        let mut hash = Sha256::new();
        // the density follows from the radiances of the bands
        for numbers in spectral.as_ref().map_or(&density, |s| &s.values).chunks(256) {
            let bytes: Vec<u8> = numbers.iter().flat_map(|x| x.to_le_bytes()).collect();
            hash.update(bytes);
        }
        let hash = hash.finalize().into();
        let mut map = Self { grid, density, spectral, runs: None, hash };
        map.runs = map.runs_by(|cell| map.grid.solid_angle(cell));
        map
    }

    /// Returns whether the map is dark everywhere.
    pub fn is_dark(&self) -> bool {
        self.runs.is_none()
    }

    /// Returns the integral of the density over all directions.
    pub fn total(&self) -> f64 {
        self.runs.as_ref().map_or(0.0, Discrete::total)
    }

    /// Returns the cell in a direction.
    pub fn cell(&self, toward: DVec3) -> Cell {
        self.grid.cell(toward)
    }

    /// Returns the relative radiance of a cell in a band.
    #[inline]
    pub fn radiance(&self, cell: Cell, band: usize) -> f32 {
        let index = self.grid.index(cell);
        match &self.spectral {
            Some(spectral) => spectral.values[index * spectral.bands + band],
            None => self.density[index],
        }
    }

    /// Returns the value by which directions of a cell are sampled: a relative radiance, the same
    /// for all bands.
    #[inline]
    pub fn density(&self, cell: Cell) -> f32 {
        self.density[self.grid.index(cell)]
    }

    /// Returns the largest ratio of the [`radiance`](Self::radiance) of a cell in a band to its
    /// [`density`](Self::density).
    pub fn most(&self, band: usize) -> f32 {
        self.spectral.as_ref().map_or(1.0, |spectral| spectral.most[band])
    }

    /// Returns the number of bands, or `None` where all bands are alike.
    pub fn bands(&self) -> Option<usize> {
        self.spectral.as_ref().map(|spectral| spectral.bands)
    }

    /// Draws a direction with density [`density`](Self::density) / [`total`](Self::total), 1/sr,
    /// and returns it with its cell. The map must not be dark.
    pub fn sample(&self, rng: &mut Stream) -> (DVec3, Cell) {
        let chance = |cell| self.grid.solid_angle(cell);
        let runs = self.runs.as_ref().expect("a map that is not dark");
        let cell = self.choose(runs, chance, rng.uniform_fine());
        (self.grid.direction(cell, rng.square()), cell)
    }

    /// Returns the irradiance on a plane that faces `normal` (a unit vector), in each band. It is
    /// pi for a map of ones.
    pub fn irradiance(&self, normal: DVec3) -> Vec<f64> {
        self.seen(View { normal, hillside: None }).1
    }

    /// Returns the map as a plane that faces `normal` sees it, with its irradiance on the plane in
    /// each band, or `None` where the plane sees no light. Of what lies below a slope that faces
    /// `hillside` it sees nothing.
    pub fn entry(&self, normal: DVec3, hillside: Option<DVec3>) -> Option<(MapEntry, Vec<f64>)> {
        let view = View { normal, hillside };
        let (sums, irradiance) = self.seen(view);
        Some((MapEntry { view, runs: choice(sums)? }, irradiance))
    }

    /// Returns sums of density x cosine over runs of cells, and the irradiance in each band.
    fn seen(&self, view: View) -> (Vec<f64>, Vec<f64>) {
        let (columns, run) = (self.grid.columns.len(), self.run());
        let bands = self.bands().unwrap_or(1);
        let of_row = |row: usize| {
            let mut sums = vec![0.0; columns.div_ceil(run)];
            let mut irradiance = vec![0.0; bands];
            for (column, density) in self.density[row * columns..][..columns].iter().enumerate() {
                if *density > 0.0 {
                    let cell = Cell { row, column };
                    let projected = self.grid.projected(cell, view);
                    sums[column / run] += f64::from(*density) * projected;
                    for (b, sum) in irradiance.iter_mut().enumerate() {
                        *sum += projected * f64::from(self.radiance(cell, b));
                    }
                }
            }
            (sums, irradiance)
        };
        let rows: Vec<(Vec<f64>, Vec<f64>)> =
            (0..self.grid.rows.len()).into_par_iter().map(of_row).collect();
        let irradiance = (0..bands).map(|b| rows.iter().map(|(_, sums)| sums[b]).sum()).collect();
        (rows.into_iter().flat_map(|(sums, _)| sums).collect(), irradiance)
    }

    /// Draws a direction whose density is in proportion to density x cosine to the plane of
    /// `entry`, and returns it with its cell.
    pub fn sample_entry(&self, entry: &MapEntry, rng: &mut Stream) -> (DVec3, Cell) {
        let View { normal, hillside } = entry.view;
        let chance = |cell| self.grid.projected(cell, entry.view);
        let cell = self.choose(&entry.runs, chance, rng.uniform_fine());
        let most = self.grid.largest_cosine(cell, normal);
        loop {
            let toward = self.grid.direction(cell, rng.square());
            let is_drawn = f64::from(rng.uniform()) * most < toward.dot(normal);
            if is_drawn && hillside.is_none_or(|hillside| toward.dot(hillside) > 0.0) {
                return (toward, cell);
            }
        }
    }

    /// Returns the number of cells that share an entry of a table.
    fn run(&self) -> usize {
        self.density.len().div_ceil(MOST_RUNS)
    }

    /// Returns the choice among runs of cells by density x `measure`; `None` if the map is dark.
    fn runs_by(&self, measure: impl Fn(Cell) -> f64 + Sync) -> Option<Discrete> {
        let (columns, run) = (self.grid.columns.len(), self.run());
        let weigh = |row: usize, first: usize| {
            let cells = (first..(first + run).min(columns)).map(|column| Cell { row, column });
            cells.map(|cell| self.weight(cell, &measure)).sum::<f64>()
        };
        let sums: Vec<f64> = (0..self.grid.rows.len())
            .into_par_iter()
            .flat_map_iter(|row| (0..columns).step_by(run).map(move |first| (row, first)))
            .map(|(row, first)| weigh(row, first))
            .collect();
        choice(sums)
    }

    fn weight(&self, cell: Cell, measure: impl Fn(Cell) -> f64) -> f64 {
        let density = f64::from(self.density(cell));
        if density > 0.0 { density * measure(cell) } else { 0.0 }
    }

    /// Returns the cell that the number `u` in [0, 1) chooses by the choice among runs of the same
    /// `measure`.
    fn choose(&self, among: &Discrete, measure: impl Fn(Cell) -> f64, u: f64) -> Cell {
        let chosen = among.choose(u);
        let (columns, run) = (self.grid.columns.len(), self.run());
        let runs = columns.div_ceil(run);
        let (row, first) = (chosen.index / runs, chosen.index % runs * run);
        if run == 1 {
            return Cell { row, column: first };
        }
        let cells = || (first..(first + run).min(columns)).map(|column| Cell { row, column });
        let total: f64 = cells().map(|cell| self.weight(cell, &measure)).sum();
        let mut rest = f64::from(chosen.rest) * total;
        let mut last = Cell { row, column: first };
        for cell in cells() {
            let weight = self.weight(cell, &measure);
            if weight > 0.0 {
                last = cell;
                if rest < weight {
                    break;
                }
                rest -= weight;
            }
        }
        last
    }
}

impl MapEntry {
    /// Returns the integral of density x cosine over the directions in front of the plane.
    pub fn total(&self) -> f64 {
        self.runs.total()
    }
}

/// Returns the choice by these weights, without those of nothing at the end; `None` if there are no
/// others.
fn choice(mut weights: Vec<f64>) -> Option<Discrete> {
    let bright = weights.iter().rposition(|&weight| weight > 0.0)?;
    weights.truncate(bright + 1);
    Some(Discrete::new(weights))
}

/// Borders of the cells, and integrals over them.
#[derive(Clone, Debug)]
struct Grid {
    /// Azimuth of the first border, rad.
    start: f64,
    /// Width of a column, rad.
    width: f64,
    rows: Vec<Row>,
    /// Whether all rows have the same height.
    even: bool,
    columns: Vec<Column>,
}

#[derive(Clone, Copy, Debug)]
struct Row {
    /// Elevations of the lower (`from`) and the upper border (`to`), rad.
    from: f64,
    to: f64,
    sine_from: f64,
    /// Integral of cos h over the elevation h: the solid angle per rad of azimuth.
    solid_angle: f64,
    /// Integrals over the elevation h of cos^2 h (`across`) and of sin h cos h (`up`).
    across: f64,
    up: f64,
    /// Sine and cosine of the elevation of the middle.
    middle: DVec2,
    /// Largest angle between a direction of a cell and its middle, rad: that of the farthest
    /// corner, or pi for very wide or high cells.
    reach: f64,
    /// Sine of `reach`.
    sine_reach: f64,
}

#[derive(Clone, Copy, Debug)]
struct Column {
    from: f64,
    /// Integrals of the sine and the cosine of the azimuth over the column.
    across: DVec2,
    /// Sine and cosine of the azimuth of the middle.
    middle: DVec2,
}

impl Grid {
    fn new(columns: usize, rows: usize, start: f64) -> Self {
        let height = PI / rows as f64;
        let borders: Vec<f64> = (0..=rows).map(|i| FRAC_PI_2 - height * i as f64).collect();
        Self { even: true, ..Self::of_rows(columns, &borders, Some(height), start) }
    }

    /// Makes a grid whose rows have their borders at these elevations, rad, from the zenith down.
    /// `height` is the height of all rows, if it is the same for all.
    fn of_rows(columns: usize, borders: &[f64], height: Option<f64>, start: f64) -> Self {
        let width = TAU / columns as f64;
        let row = |border: &[f64]| {
            let (from, to) = (border[1], border[0]);
            let height = height.unwrap_or(to - from);
            let [across, up] = [0, 1].map(|k| moments(to)[k] - moments(from)[k]);
            let (sin, cos) = (0.5 * (from + to)).sin_cos();
            let middle = DVec3::new(0.0, cos, sin);
            let (east, north) = (0.5 * width).sin_cos();
            let corner = |h: f64| DVec3::new(east * h.cos(), north * h.cos(), h.sin());
            let far = [from, to].map(|h| corner(h).dot(middle).clamp(-1.0, 1.0).acos());
            // the farthest point of a very wide cell is not one of its corners
            let reach = match columns < 8 || height > 0.8 {
                true => PI,
                false => far[0].max(far[1]) + 1e-9,
            };
            Row {
                from,
                to,
                sine_from: from.sin(),
                solid_angle: 2.0 * cos * (0.5 * height).sin(),
                across,
                up,
                middle: DVec2::new(sin, cos),
                reach,
                sine_reach: reach.sin(),
            }
        };
        let column = |i: usize| {
            let from = start + width * i as f64;
            let middle = DVec2::from((from + 0.5 * width).sin_cos());
            Column { from, across: 2.0 * (0.5 * width).sin() * middle, middle }
        };
        Self {
            start,
            width,
            rows: borders.windows(2).filter(|border| border[0] > border[1]).map(row).collect(),
            even: false,
            columns: (0..columns).map(column).collect(),
        }
    }

    fn index(&self, cell: Cell) -> usize {
        cell.row * self.columns.len() + cell.column
    }

    fn solid_angle(&self, cell: Cell) -> f64 {
        self.rows[cell.row].solid_angle * self.width
    }

    fn cell(&self, toward: DVec3) -> Cell {
        let turn = (toward.x.atan2(toward.y) - self.start).rem_euclid(TAU) / TAU;
        let elevation = toward.z.atan2(toward.x.hypot(toward.y));
        let place = |part: f64, of: usize| ((part * of as f64) as usize).min(of - 1);
        let row = match self.even {
            true => place(0.5 - elevation / PI, self.rows.len()),
            false => self.rows.partition_point(|row| row.from > elevation).min(self.rows.len() - 1),
        };
        Cell { row, column: place(turn, self.columns.len()) }
    }

    /// Returns the direction that two uniform numbers choose; it is uniform over the solid angle of
    /// a cell.
    fn direction(&self, cell: Cell, u: Vec2) -> DVec3 {
        let (row, column) = (&self.rows[cell.row], &self.columns[cell.column]);
        let z = (row.sine_from + f64::from(u.x) * row.solid_angle).clamp(-1.0, 1.0);
        let across = ((1.0 - z) * (1.0 + z)).sqrt();
        let (sin, cos) = (column.from + f64::from(u.y) * self.width).sin_cos();
        DVec3::new(across * sin, across * cos, z)
    }

    fn middle(&self, cell: Cell) -> DVec3 {
        let (row, column) = (&self.rows[cell.row].middle, &self.columns[cell.column].middle);
        DVec3::new(column.x * row.y, column.y * row.y, row.x)
    }

    /// Returns an upper bound of the cosine to `normal` over the directions of a cell.
    fn largest_cosine(&self, cell: Cell, normal: DVec3) -> f64 {
        let (cos, reach) = (self.middle(cell).dot(normal), self.rows[cell.row].reach);
        let sin = (1.0 - cos * cos).max(0.0).sqrt();
        if reach >= PI || cos >= reach.cos() { 1.0 } else { cos * reach.cos() + sin * reach.sin() }
    }

    /// Returns the integral, sr, of the cosine to the normal of a view over the part of a cell that
    /// is seen.
    fn projected(&self, cell: Cell, view: View) -> f64 {
        let View { normal, hillside } = view;
        let (row, column) = (&self.rows[cell.row], &self.columns[cell.column]);
        if row.reach < FRAC_PI_2 {
            let (middle, border) = (self.middle(cell), row.sine_reach);
            let cos = middle.dot(normal);
            let height = hillside.map_or(1.0, |hillside| middle.dot(hillside));
            if cos.min(height) < -border {
                return 0.0;
            }
            if cos.min(height) > border {
                let across = normal.x * column.across.x + normal.y * column.across.y;
                return row.across * across + row.up * self.width * normal.z;
            }
        }
        self.projected_at_border(row, column, view)
    }

    /// Returns the same integral where the horizon of the plane or of the slope may cross the cell.
    /// It is exact along elevations, and follows the midpoint rule along azimuths.
    #[cold]
    fn projected_at_border(&self, row: &Row, column: &Column, view: View) -> f64 {
        let View { normal, hillside } = view;
        let steps = (16_384 / self.columns.len()).max(16);
        let step = self.width / steps as f64;
        let sum: f64 = (0..steps)
            .map(|i| {
                let (sin, cos) = (column.from + (i as f64 + 0.5) * step).sin_cos();
                let across = |plane: DVec3| plane.x * sin + plane.y * cos;
                let (mut from, mut to) = (row.from, row.to);
                for plane in std::iter::once(normal).chain(hillside) {
                    // across cos h + plane.z sin h is positive within a quarter turn of its maximum
                    let top = plane.z.atan2(across(plane));
                    (from, to) = (from.max(top - FRAC_PI_2), to.min(top + FRAC_PI_2));
                }
                let across = across(normal);
                if from >= to {
                    return 0.0;
                }
                let [low, high] = [moments(from), moments(to)];
                across * (high[0] - low[0]) + normal.z * (high[1] - low[1])
            })
            .sum();
        (sum * step).max(0.0)
    }
}

/// Returns the integrals of cos^2 and of sin cos from the horizon to the elevation `h`, rad.
fn moments(h: f64) -> [f64; 2] {
    let (sin, cos) = h.sin_cos();
    [0.5 * (h + sin * cos), 0.5 * sin * sin]
}
