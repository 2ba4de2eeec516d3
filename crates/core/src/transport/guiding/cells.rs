//! Surfaces cut into cells, each with a front and a back, and the density of arrivals on each cell.
//!
//! A cell is what a cube of space holds of the surfaces of one material that look about the same
//! way. Its number of triangles does not matter: a wall has the same cells as one rectangle, as a fan
//! of slivers and as a copy that shares its triangles.
//!
//! Where few photons or importons arrive at a cell, its density is the mean over a neighbourhood
//! that is just large enough to hold sufficient arrivals.

use std::collections::HashMap;

use glam::{Vec2, Vec3};
use indexmap::IndexMap;

use crate::{
    math::{
        rng::{Purpose, Streams},
        sampling::{Discrete, uniform_triangle},
    },
    scene::world::{Scene, SurfaceHit},
};

/// The side of a cube is that of a square of this many of all surfaces.
const SQUARES: f64 = 10_000.0;
/// The areas of cells are measured by this many random points on all surfaces, each of which stands for
/// the same area.
const POINTS: f64 = 32.0 * SQUARES;
/// A density rests on at least this many arrivals, if a neighbourhood holds them.
const ENOUGH: u32 = 32;
/// How many sizes of neighbourhoods there are; each has twice the side of the one before, the first
/// twice that of a cell.
const SIZES: u32 = 5;

/// The cells of a scene's surfaces.
pub struct Cells<'a> {
    scene: &'a Scene,
    cells: Vec<Cell>,
    /// The cell of each cube. Of larger cubes, by how often their side is that of a cell doubled, it is
    /// one of the cells in it.
    of: HashMap<(u32, Cube), usize>,
    /// The side of a cube, m.
    size: f32,
}

#[derive(Clone, Copy)]
struct Cell {
    cube: Cube,
    /// Area of one face, m2.
    area: f64,
}

/// A cube, and which of the surfaces in it are meant.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
struct Cube {
    material: u32,
    /// The axis closest to the normal, and whether the front looks along it.
    axis: usize,
    along: bool,
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
        let area_of = |triangle| f64::from(scene.triangles().at(triangle).area());
        let own: f64 = (0..scene.unshared()).map(area_of).sum();
        let objects: Vec<_> = scene
            .alike()
            .map(|alike| {
                let areas: Vec<f64> = alike.triangles.clone().map(area_of).collect();
                let first: f64 = areas.iter().sum();
                (alike, Discrete::new(areas), first)
            })
            .collect();
        let shared: f64 =
            objects.iter().map(|(alike, _, first)| first * alike.areas.iter().sum::<f64>()).sum();
        let area = own + shared;
        let size = ((area / SQUARES).sqrt() as f32).max(f32::MIN_POSITIVE);
        let mut cells = Self { scene, cells: Vec::new(), of: HashMap::new(), size };

        // each point stands for an equal share of the area, and lies where the sum of areas passes it
        let each = area / POINTS;
        let (mut passed, mut points) = (0.0, 0u32);
        // the same points whatever the seed of the run
        let mut rng = Streams::new(0, Purpose::Importons, u64::MAX).history(0);
        let mut add = |area: f64, triangle: &dyn Fn(f64) -> usize| {
            passed += area;
            while (f64::from(points) + 0.5) * each < passed {
                points += 1;
                let triangle = triangle(rng.uniform_fine());
                let Vec2 { x, y } = uniform_triangle(rng.square());
                let point = scene.triangles().at(triangle).point(x, y);
                cells.add(triangle, point, each);
            }
        };
        (0..scene.unshared()).for_each(|triangle| add(area_of(triangle), &|_| triangle));
        for (alike, areas, first) in &objects {
            for (copy, factor) in alike.areas.iter().enumerate() {
                let start = alike.triangles.start + copy * alike.triangles.len();
                add(factor * first, &|u| start + areas.choose(u).index);
            }
        }
        cells
    }

    /// Adds a point that stands for this area, m2.
    fn add(&mut self, triangle: usize, point: Vec3, area: f64) {
        let mut cube = self.cube(triangle, point);
        let next = self.cells.len();
        let cell = *self.of.entry((0, cube)).or_insert(next);
        if cell < next {
            self.cells[cell].area += area;
            return;
        }
        self.cells.push(Cell { cube, area });
        for size in 1..=SIZES {
            cube = cube.larger();
            self.of.entry((size, cube)).or_insert(next);
        }
    }

    /// Returns the smallest cube of a point of a triangle.
    fn cube(&self, triangle: usize, point: Vec3) -> Cube {
        let surface = self.scene.surface(triangle);
        let axis = surface.normal.abs().max_position();
        // planes of round numbers do not lie in the borders of cubes
        let place = point / self.size + Vec3::new(0.382, 0.236, 0.146);
        Cube {
            material: surface.material,
            axis,
            along: surface.normal[axis] > 0.0,
            place: place.floor().to_array().map(|x| x as i32),
        }
    }

    /// Returns the place of the cell of a face at a point of a triangle.
    #[inline]
    pub fn at(&self, hit: &SurfaceHit, front: bool) -> usize {
        let mut cube = self.cube(hit.triangle, hit.point);
        for size in 0..=SIZES {
            if let Some(cell) = self.of.get(&(size, cube)) {
                return 2 * cell + usize::from(front);
            }
            cube = cube.larger();
        }
        usize::from(front)
    }

    /// Returns the places of all cells, each with the index of its material. The other face of the
    /// cell at `place` is at `place ^ 1`.
    pub fn materials(&self) -> impl Iterator<Item = (usize, usize)> {
        let both = |(cell, Cell { cube, .. }): (usize, &Cell)| {
            [2 * cell, 2 * cell + 1].map(|place| (place, cube.material as usize))
        };
        self.cells.iter().enumerate().flat_map(both)
    }

    /// Returns the density of arrivals on each cell: the sum of their values per area. Each arrival
    /// is the place of a cell and a value. A cell with few arrivals gets the mean over nearby cells
    /// that are of the same material and look the same way; the density is 0 where there are no
    /// arrivals at all.
    pub fn densities(&self, arrivals: impl Iterator<Item = (u32, f64)>) -> Vec<f32> {
        // one place at least, which points of a scene without area have
        let mut heaps = vec![Heap::default(); (2 * self.cells.len()).max(2)];
        for (place, value) in arrivals {
            heaps[place as usize].add(Heap { sum: value, area: 0.0, arrivals: 1 });
        }
        let mut densities = vec![0.0; heaps.len()];
        let mut poor: Vec<(usize, (Cube, usize))> = Vec::new();
        // in the order of the cells, so that the sums are always the same
        let mut cubes: IndexMap<(Cube, usize), Heap> = IndexMap::new();
        for (place, heap) in heaps.iter_mut().enumerate().take(2 * self.cells.len()) {
            let Cell { cube, area } = self.cells[place / 2];
            heap.area = area;
            // the underside of a roof and the floor below it are not neighbours
            let around = (cube.larger(), place % 2);
            cubes.entry(around).or_default().add(*heap);
            match heap.arrivals >= ENOUGH {
                true => densities[place] = heap.density(),
                false => poor.push((place, around)),
            }
        }
        for last in (0..SIZES).rev() {
            poor.retain_mut(|(place, around)| {
                let heap = cubes[&*around];
                let enough = heap.arrivals >= ENOUGH || last == 0;
                if enough {
                    densities[*place] = heap.density();
                }
                around.0 = around.0.larger();
                !enough
            });
            for ((cube, face), heap) in std::mem::take(&mut cubes) {
                cubes.entry((cube.larger(), face)).or_default().add(heap);
            }
        }
        densities
    }
}

impl Cube {
    /// Returns the cube with twice the side that holds this one.
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

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::scene::{
        light::{Cone, Lamp},
        material::{Lambert, Material},
        world::{Band, LightPart, NamedMaterial, SceneParts, SurfacePart},
    };

    /// A square of 2 m as a fan of so many triangles about its middle.
    fn fan(slivers: usize) -> Scene {
        let rim = |i: usize| {
            let along = 8.0 * i as f64 / slivers as f64;
            let (side, part) = ((along / 2.0) as usize % 4, along % 2.0 - 1.0);
            let [x, y] = [[part, -1.0], [1.0, part], [-part, 1.0], [-1.0, -part]][side];
            DVec3::new(x, y, 0.0)
        };
        let triangles = (0..slivers).map(|i| [DVec3::ZERO, rim(i), rim(i + 1)]).collect();
        let wall = Material::Lambert(Lambert::new(&[0.5]).unwrap());
        let scene = Scene::new(SceneParts {
            bands: vec![Band { name: "all".into(), from_nm: None, to_nm: None }],
            lights: vec![LightPart::new("lamp", Lamp::new([1.0], Cone::point(DVec3::Z)))],
            materials: vec![NamedMaterial { name: "wall".into(), material: wall }],
            surfaces: vec![SurfacePart { object: None, material: 0, captor: None, triangles }],
            ..SceneParts::default()
        });
        scene.unwrap_or_else(|e| panic!("{e}"))
    }

    /// A square has the same cells, of the same areas but for the noise of points, as 4 triangles and as 3,000 slivers,
    /// and every point of it has one. The points are the same each time.
    #[test]
    fn cells_do_not_depend_on_the_triangles() {
        let (few, many) = (fan(4), fan(3000));
        let [few, many] = [&few, &many].map(Cells::new);
        let all = |cells: &Cells| cells.cells.iter().map(|cell| cell.area).sum::<f64>();
        for cells in [&few, &many] {
            let number = cells.cells.len() as f64;
            assert!((SQUARES..1.05 * SQUARES).contains(&number), "{number}");
            assert!((all(cells) - 4.0).abs() < 1e-3, "{}", all(cells));
        }
        let mut rough = 0.0;
        for cell in &few.cells {
            let same = many.of.get(&(0, cell.cube)).map_or(0.0, |&of| many.cells[of].area);
            rough += (cell.area - same).abs();
        }
        assert!(rough < 0.3 * all(&few), "{rough}");
        for (i, j) in (0..40).flat_map(|i| (0..40).map(move |j| (i, j))) {
            let [x, y] = [i, j].map(|n| (n as f32 + 0.37) / 20.0 - 1.0);
            let hit = SurfaceHit { t: 1.0, triangle: 0, point: Vec3::new(x, y, 0.0) };
            let place = many.at(&hit, true);
            let middle = many.cells[place / 2].cube.place;
            let own = many.cube(0, hit.point).place;
            assert!(place % 2 == 1 && (0..3).all(|i| (middle[i] - own[i]).abs() <= 1));
        }
    }
}
