//! Surfaces cut into cells, each with a front and a back, and the density of arrivals on each cell.
//! A copy that shares its triangles is one cell, as a whole.
//!
//! Where few photons or importons arrive at a cell, its density is the mean over a neighbourhood
//! that is just large enough to hold sufficient arrivals.

use glam::Vec3;
use indexmap::IndexMap;

use crate::scene::world::{Scene, SurfaceHit};

/// The approximate number of cells of a scene. Every triangle has at least one cell on each face,
/// however many triangles there are.
const CELLS: f32 = 40_000.0;
/// The most pieces that a side of a triangle is cut into.
const MOST_PIECES: f32 = 200.0;
/// A density rests on at least this many arrivals, if a neighbourhood holds them.
const ENOUGH: u32 = 32;
/// The smallest neighbourhood is a cube of this many cell sizes; each further one is twice as
/// large.
const CUBE: f32 = 2.0;
/// How many sizes of cubes there are.
const CUBES: u32 = 5;

/// The faces of the triangles of a scene, cut into cells by barycentric coordinates.
pub struct Cells<'a> {
    scene: &'a Scene,
    /// For each triangle that is no shared copy, the place of its first cell and the number of pieces into which each of
    /// its sides is cut.
    cuts: Vec<(u32, u32)>,
    cells: Vec<Cell>,
    /// The place of the first cell of shared copies.
    copies: usize,
    /// The length of lists that hold a value for each cell. Some of their entries belong to no
    /// cell.
    places: usize,
    /// The approximate side of a cell, m.
    size: f32,
}

/// A piece of one face of a triangle.
struct Cell {
    /// Index of the cell's entry in lists that hold a value for each cell.
    place: usize,
    triangle: usize,
    middle: Vec3,
    /// Area, m2.
    area: f64,
}

/// A neighbourhood: the faces in a cube that are of one material and look the same way.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
struct Cube {
    material: u32,
    axis: usize,
    looks: [bool; 2],
    place: [i32; 3],
}

/// The sum of what has arrived at some cells, in any unit, their area, and the number of arrivals.
#[derive(Clone, Copy, Debug, Default)]
struct Heap {
    sum: f64,
    area: f64,
    arrivals: u32,
}

impl<'a> Cells<'a> {
    /// Cuts the surfaces of a scene.
    pub fn new(scene: &'a Scene) -> Self {
        let own = || (0..scene.unshared()).map(|index| scene.triangles().at(index));
        let area: f32 = own().map(|triangle| triangle.area()).sum();
        let size = (4.0 * area / CELLS).sqrt().max(f32::MIN_POSITIVE);
        let (mut places, mut cuts, mut cells) = (0, Vec::new(), Vec::new());
        for (index, t) in own().enumerate() {
            let edges = [t.a.distance(t.b), t.b.distance(t.c), t.c.distance(t.a)];
            let longest = edges.into_iter().fold(0.0, f32::max);
            let pieces = (longest / size).ceil().clamp(1.0, MOST_PIECES) as u32;
            let half = f64::from(t.area()) / f64::from(pieces * pieces);
            for (i, j) in (0..pieces).flat_map(|i| (0..pieces - i).map(move |j| (i, j))) {
                let whole = i + j + 1 < pieces;
                let middle = if whole { 0.5 } else { 1.0 / 3.0 };
                let [u, v] = [i, j].map(|n| (n as f32 + middle) / pieces as f32);
                let area = if whole { 2.0 * half } else { half };
                let place = places + 2 * (i * pieces + j) as usize;
                for place in [place, place + 1] {
                    cells.push(Cell { place, triangle: index, middle: t.point(u, v), area });
                }
            }
            cuts.push((places as u32, pieces));
            places += 2 * (pieces * pieces) as usize;
        }
        let copies = places;
        let areas = scene.alike().flat_map(|alike| {
            let area = |t| f64::from(scene.triangles().at(t).area());
            let first: f64 = alike.triangles.map(area).sum();
            alike.areas.into_iter().map(move |area| area * first)
        });
        for (copy, area) in scene.shared_copies().zip(areas) {
            let (triangle, middle) = (copy.first, copy.extent.center());
            cells.extend([places, places + 1].map(|place| Cell { place, triangle, middle, area }));
            places += 2;
        }
        Self { scene, cuts, cells, copies, places, size }
    }

    /// Returns the place of the cell of a face at a point of a triangle.
    #[inline]
    pub fn at(&self, hit: &SurfaceHit, front: bool) -> usize {
        let Some(&(first, pieces)) = self.cuts.get(hit.triangle) else {
            let copy = self.scene.shared_copy_of(hit.triangle).unwrap_or_default();
            return self.copies + 2 * copy + usize::from(front);
        };
        let place = if pieces == 1 { 0 } else { self.place(hit, pieces) };
        first as usize + 2 * place + usize::from(front)
    }

    /// Returns the places of all cells, each with the index of its material.
    pub fn materials(&self) -> impl Iterator<Item = (usize, usize)> {
        let material = |cell: &Cell| self.scene.surface(cell.triangle).material as usize;
        self.cells.iter().map(move |cell| (cell.place, material(cell)))
    }

    fn place(&self, hit: &SurfaceHit, pieces: u32) -> usize {
        let t = &self.scene.triangles().at(hit.triangle);
        let (u, v, p) = (t.b - t.a, t.c - t.a, hit.point - t.a);
        let normal = u.cross(v);
        let square = normal.length_squared();
        let piece = |share: f32| ((share / square * pieces as f32).max(0.0) as u32).min(pieces - 1);
        let i = piece(p.cross(v).dot(normal));
        let j = piece(u.cross(p).dot(normal)).min(pieces - 1 - i);
        (i * pieces + j) as usize
    }

    /// Returns the density of arrivals on each cell: the sum of their values per area. Each arrival
    /// is the place of a cell and a value. A cell with few arrivals gets the mean over nearby cells
    /// that are of the same material and look the same way; the density is 0 where there are no
    /// arrivals at all.
    pub fn densities(&self, arrivals: impl Iterator<Item = (u32, f64)>) -> Vec<f32> {
        let mut heaps = vec![Heap::default(); self.places];
        for (place, value) in arrivals {
            heaps[place as usize].add(Heap { sum: value, area: 0.0, arrivals: 1 });
        }
        self.cells.iter().for_each(|cell| heaps[cell.place].area = cell.area);
        let mut densities = vec![0.0; self.places];
        let mut poor: Vec<&Cell> = Vec::new();
        for cell in &self.cells {
            match heaps[cell.place] {
                heap if heap.arrivals >= ENOUGH => densities[cell.place] = heap.density(),
                _ => poor.push(cell),
            }
        }
        // in the order of the cells, so that the sums are always the same
        let mut cubes: IndexMap<Cube, Heap> = IndexMap::new();
        for cell in &self.cells {
            cubes.entry(self.cube_of(cell)).or_default().add(heaps[cell.place]);
        }
        let mut poor: Vec<(&Cell, Cube)> =
            poor.into_iter().map(|cell| (cell, self.cube_of(cell))).collect();
        for last in (0..CUBES).rev() {
            poor.retain_mut(|(cell, cube)| {
                let heap = cubes[&*cube];
                let enough = heap.arrivals >= ENOUGH || last == 0;
                if enough {
                    densities[cell.place] = heap.density();
                }
                *cube = cube.larger();
                !enough
            });
            for (cube, heap) in std::mem::take(&mut cubes) {
                cubes.entry(cube.larger()).or_default().add(heap);
            }
        }
        densities
    }

    /// Returns the smallest cube that holds a cell.
    fn cube_of(&self, cell: &Cell) -> Cube {
        let surface = &self.scene.surface(cell.triangle);
        let is_front = cell.place % 2 == 1;
        let axis = surface.normal.abs().max_position();
        let up = (surface.normal[axis] > 0.0) == is_front;
        let place = (cell.middle / (CUBE * self.size)).floor().to_array().map(|x| x as i32);
        // the underside of a roof and the floor below it are not neighbours
        Cube { material: surface.material, axis, looks: [is_front, up], place }
    }
}

impl Cube {
    /// Returns the neighbourhood twice as large that holds this one.
    fn larger(self) -> Self {
        Self { place: self.place.map(|x| x >> 1), ..self }
    }
}

impl Heap {
    fn add(&mut self, other: Self) {
        self.sum += other.sum;
        self.area += other.area;
        self.arrivals += other.arrivals;
    }

    fn density(self) -> f32 {
        (self.sum / self.area.max(f64::MIN_POSITIVE)) as f32
    }
}
