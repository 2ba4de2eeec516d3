//! Surfaces and captors cut into tiles that are small enough to show how light varies over them.

use std::{
    cmp::Reverse,
    collections::{BinaryHeap, HashMap},
    ops::Range,
};

use glam::Vec3;

use crate::{
    math::geometry::{Transform, Triangle},
    scene::{captor::CaptorKind, material::Scatterer, world::Scene},
};

/// Limit on the number of tiles that cutting adds.
const MORE: usize = 60_000;
/// Edges shorter than this are not cut, relative to the radius of the scene.
const SHORT: f32 = 1.0 / 200.0;
/// Copies of objects with at least this many triangles are not cut: they are displayed as copies.
const DETAILED: usize = 100;

/// The tiles of a scene: those of all surfaces, which are cut, then the triangles of all virtual
/// captors, which are not.
#[derive(Debug)]
pub struct Tiles {
    /// Corners, m from the centre of the scene.
    pub corners: Vec<Triangle>,
    /// For each tile the index of its triangle, among those of the surfaces or of the virtual
    /// captors.
    pub triangles: Vec<u32>,
    /// The surfaces and captors that the tiles belong to, in the order of the tiles.
    pub parts: Vec<TilePart>,
    /// The tiles that are copies of each other, in rising order.
    pub copies: Vec<TileCopies>,
}

/// Copies of an object, whose tiles follow one another.
#[derive(Clone, Debug)]
pub struct TileCopies {
    /// Index of the object, if it has a name.
    pub object: Option<usize>,
    /// Index of the first tile of the first copy.
    pub first: usize,
    /// Number of tiles of each copy.
    pub each: usize,
    /// The transforms that placed the copies, at least two, m from the user's origin.
    pub transforms: Vec<Transform>,
}

/// Tiles of one object, material and captor.
#[derive(Clone, Debug, PartialEq)]
pub struct TilePart {
    /// Index of the object, if it has a name.
    pub object: Option<usize>,
    /// Index of the material; `None` for a virtual captor.
    pub material: Option<usize>,
    /// Index of the captor, if the tiles belong to one.
    pub captor: Option<usize>,
    /// Range of the part's tiles.
    pub tiles: Range<usize>,
}

impl Tiles {
    /// Cuts the surfaces of a scene, except glass and the copies of detailed objects. The longest
    /// edges are halved, over and over, until there are 60,000 more tiles than triangles or all
    /// edges are short.
    pub fn new(scene: &Scene) -> Self {
        // glass is transparent in the display
        let clear = |triangle: usize| scene.material(&scene.surface(triangle)).is_clear();
        let mut copies = copies(scene);
        // looks in the last group of copies that begins at or before the triangle
        let is_copy = |triangle: usize| {
            let after = copies.partition_point(|copies| copies.first <= triangle);
            let last = copies[..after].last();
            last.is_some_and(|c| triangle - c.first < c.each * c.transforms.len())
        };
        let stays = |triangle: usize| clear(triangle) || is_copy(triangle);
        let (corners, triangles) =
            cut(scene.triangles().iter(), stays, MORE, SHORT * scene.radius());
        for copies in &mut copies {
            copies.first = triangles.partition_point(|t| (*t as usize) < copies.first);
        }
        let mut tiles = Self { corners, triangles, parts: Vec::new(), copies };
        for tile in 0..tiles.triangles.len() {
            let triangle = tiles.triangles[tile] as usize;
            let surface = &scene.surface(triangle);
            tiles.add_to_part(TilePart {
                object: scene.object(triangle),
                material: Some(surface.material as usize),
                captor: surface.captor(),
                tiles: tile..tile + 1,
            });
        }
        let virtual_captors = scene.captors().iter().enumerate();
        for (c, captor) in virtual_captors.filter(|(_, captor)| captor.kind != CaptorKind::Surface)
        {
            let first = tiles.corners.len();
            tiles.corners.extend_from_slice(&scene.triangles_of(captor));
            tiles.triangles.extend(captor.triangles.clone().map(|t| t as u32));
            tiles.add_to_part(TilePart {
                object: None,
                material: None,
                captor: Some(c),
                tiles: first..tiles.corners.len(),
            });
        }
        tiles
    }

    /// Returns the number of tiles.
    pub fn count(&self) -> usize {
        self.corners.len()
    }

    fn add_to_part(&mut self, part: TilePart) {
        match self.parts.last_mut() {
            Some(last) if TilePart { tiles: part.tiles.clone(), ..last.clone() } == part => {
                last.tiles.end = part.tiles.end;
            }
            _ => self.parts.push(part),
        }
    }
}

/// Returns the copies of detailed objects among the triangles of a scene, in the order of the
/// triangles.
fn copies(scene: &Scene) -> Vec<TileCopies> {
    let mut found: Vec<TileCopies> = Vec::new();
    for copy in scene.object_copies() {
        let (object, first, each) = (copy.object, copy.triangles.start, copy.triangles.len());
        match found.last_mut() {
            Some(c)
                if (c.object, c.each) == (object, each)
                    && c.first + c.each * c.transforms.len() == first =>
            {
                c.transforms.push(copy.transform);
            }
            _ => found.push(TileCopies { object, first, each, transforms: vec![copy.transform] }),
        }
    }
    found.retain(|copies| copies.each >= DETAILED && copies.transforms.len() > 1);
    found.sort_by_key(|copies| copies.first);
    found
}

/// Cuts triangles, except those that `stays` keeps whole, until there are `more` more tiles or no
/// edge is longer than `short`, m. Returns the tiles in the order of their triangles, and the
/// triangle of each.
fn cut(
    triangles: impl ExactSizeIterator<Item = Triangle>,
    stays: impl Fn(usize) -> bool,
    more: usize,
    short: f32,
) -> (Vec<Triangle>, Vec<u32>) {
    let mut cutter = Cutter { short, ..Cutter::default() };
    let most = triangles.len() + more;
    triangles.enumerate().for_each(|(i, triangle)| cutter.add(&triangle, stays(i)));
    while cutter.tiles.len() < most && cutter.halve_longest() {}
    let Cutter { points, mut tiles, .. } = cutter;
    tiles.sort_by_key(|tile| tile.triangle);
    let corners = |tile: &Tile| Triangle::from(tile.corners.map(|i| points[i as usize]));
    (tiles.iter().map(corners).collect(), tiles.iter().map(|tile| tile.triangle).collect())
}

/// Halves the longest edge, over and over, in all tiles that share it: so no crack opens between
/// them. As it is the longest edge of each tile, no angle becomes less than half of the least angle
/// at the beginning (I. G. Rosenberg and F. Stenger 1975, Mathematics of Computation 29:390-395).
#[derive(Default)]
struct Cutter {
    short: f32,
    points: Vec<Vec3>,
    known_points: HashMap<[u32; 3], u32>,
    tiles: Vec<Tile>,
    /// The tiles that share each edge that can still be cut.
    sharing: HashMap<Edge, Vec<u32>>,
    longest: BinaryHeap<(Length, Reverse<Edge>)>,
}

struct Tile {
    triangle: u32,
    /// Indices of points.
    corners: [u32; 3],
}

/// An edge: the indices of its ends, the lesser first.
type Edge = [u32; 2];

/// The bits of a positive float, which sort like the float itself.
type Length = u32;

impl Cutter {
    fn add(&mut self, triangle: &Triangle, stays: bool) {
        let corners = [triangle.a, triangle.b, triangle.c].map(|p| {
            let next = self.points.len() as u32;
            let index = *self.known_points.entry(p.to_array().map(f32::to_bits)).or_insert(next);
            if index == next {
                self.points.push(p);
            }
            index
        });
        let tile = self.tiles.len() as u32;
        self.tiles.push(Tile { triangle: tile, corners });
        let [a, b, c] = corners;
        // a tile without area is not cut
        if !stays && a != b && b != c && c != a {
            [[a, b], [b, c], [c, a]].into_iter().for_each(|edge| self.share(edge, tile));
        }
    }

    fn share(&mut self, [p, q]: Edge, tile: u32) {
        let length = self.points[p as usize].distance(self.points[q as usize]);
        if length <= self.short {
            return;
        }
        let edge = [p.min(q), p.max(q)];
        let tiles = self.sharing.entry(edge).or_default();
        if tiles.is_empty() {
            self.longest.push((length.to_bits(), Reverse(edge)));
        }
        tiles.push(tile);
    }

    /// Halves the longest edge, and returns whether there was one to halve.
    fn halve_longest(&mut self) -> bool {
        let Some((_, Reverse([p, q]))) = self.longest.pop() else { return false };
        let middle = self.points.len() as u32;
        self.points.push(self.points[p as usize].midpoint(self.points[q as usize]));
        for tile in self.sharing.remove(&[p, q]).unwrap_or_default() {
            let Tile { triangle, corners: [a, b, c] } = self.tiles[tile as usize];
            let turns = [[a, b, c], [b, c, a], [c, a, b]];
            let opposite = turns.into_iter().find(|[a, ..]| *a != p && *a != q);
            let [a, b, c] = opposite.unwrap_or([a, b, c]);
            let half = self.tiles.len() as u32;
            self.tiles[tile as usize].corners = [a, b, middle];
            self.tiles.push(Tile { triangle, corners: [a, middle, c] });
            if let Some(tiles) = self.sharing.get_mut(&[a.min(c), a.max(c)]) {
                tiles.iter_mut().filter(|t| **t == tile).for_each(|t| *t = half);
            }
            self.share([b, middle], tile);
            self.share([middle, c], half);
            self.share([a, middle], tile);
            self.share([a, middle], half);
        }
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn longest(t: &Triangle) -> f32 {
        [t.a.distance(t.b), t.b.distance(t.c), t.c.distance(t.a)].into_iter().fold(0.0, f32::max)
    }

    #[test]
    fn tiles_cover_their_triangles_just_once() {
        let square =
            [[Vec3::ZERO, Vec3::X, Vec3::X + Vec3::Y], [Vec3::ZERO, Vec3::X + Vec3::Y, Vec3::Y]];
        let sliver = [Vec3::Z, Vec3::X + Vec3::Z, Vec3::new(1.0, 0.01, 1.0)];
        let small = [Vec3::ZERO, 0.01 * Vec3::X, 0.01 * Vec3::Y];
        let triangles: Vec<Triangle> =
            square.into_iter().chain([sliver, small]).map(Triangle::from).collect();
        let (tiles, of) = cut(triangles.iter().copied(), |_| false, 1000, 0.02);
        // the last edge may be shared by two tiles
        assert!((1004..=1005).contains(&tiles.len()), "{}", tiles.len());
        assert_eq!(tiles.len(), of.len());
        assert!(of.is_sorted());
        for (i, triangle) in triangles.iter().enumerate() {
            let own: Vec<&Triangle> = tiles
                .iter()
                .zip(&of)
                .filter(|(_, t)| **t == i as u32)
                .map(|(tile, _)| tile)
                .collect();
            let area: f32 = own.iter().map(|tile| tile.area()).sum();
            assert!((area / triangle.area() - 1.0).abs() < 1e-4, "{i}: {area}");
            let facing = own.iter().all(|tile| tile.cross().dot(triangle.cross()) > 0.0);
            assert!(facing, "{i}: a tile shows its back");
        }
        // the small triangle is whole; no long edge is left
        assert_eq!(of.iter().filter(|t| **t == 3).count(), 1);
        let longest = tiles.iter().map(longest).fold(0.0, f32::max);
        assert!(longest < 0.1, "{longest}");
        // no crack: an edge inside the square has a tile on either side
        let mut edges = HashMap::new();
        for tile in tiles.iter().zip(&of).filter(|(_, t)| **t < 2).map(|(tile, _)| tile) {
            for (p, q) in [(tile.a, tile.b), (tile.b, tile.c), (tile.c, tile.a)] {
                let rim = |x: f32, y: f32| x == y && (x == 0.0 || x == 1.0);
                if !rim(p.x, q.x) && !rim(p.y, q.y) {
                    let ends = [p, q].map(|p| p.to_array().map(f32::to_bits));
                    *edges.entry([ends[0].min(ends[1]), ends[0].max(ends[1])]).or_insert(0) += 1;
                }
            }
        }
        assert!(edges.len() > 100 && edges.values().all(|tiles| *tiles == 2));
    }

    #[test]
    fn cutting_ends_at_short_edges() {
        let triangle = Triangle::from([Vec3::ZERO, Vec3::X, Vec3::Y]);
        let (tiles, _) = cut([triangle].into_iter(), |_| false, 1_000_000, 0.1);
        assert!(tiles.len() < 1000, "{}", tiles.len());
        assert!(tiles.iter().all(|t| longest(t) <= 0.1));
        // nothing to cut
        assert_eq!(cut([triangle].into_iter(), |_| true, 1_000_000, 0.1).0, [triangle]);
        assert_eq!(
            cut([Triangle::from([Vec3::ZERO; 3])].into_iter(), |_| false, 10, 0.1).0.len(),
            1
        );
        assert_eq!(cut(std::iter::empty(), |_| false, 10, 0.1).0.len(), 0);
    }
}
