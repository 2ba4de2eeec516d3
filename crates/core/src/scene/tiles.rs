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
    /// Corners, m from the centre of the scene; of a [merged](Merged) tile those of its middle
    /// triangle, which stands for the others.
    pub corners: Vec<Triangle>,
    /// For each tile the index of its triangle, or of its middle one, among those of the surfaces
    /// or of the virtual captors.
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
    /// The transforms that placed the copies, m from the user's origin.
    pub transforms: Vec<Transform>,
    /// The triangles of the tiles, where a tile has several.
    pub merged: Option<Merged>,
}

/// Triangles of a copy that are merged into tiles: each tile has some that follow one another in the
/// mesh, as the triangles of a leaf mostly do.
#[derive(Clone, Debug)]
pub struct Merged {
    /// The triangles of the first copy.
    pub triangles: Range<usize>,
    /// For each tile of a copy its first triangle, counted within the copy; at last the number of
    /// triangles.
    pub starts: Vec<u32>,
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
    /// edges are short. Where there are more than `most` triangles, those of copies that share them
    /// are merged into fewer tiles, so that there are about `most` at the end; a tile never has
    /// triangles of several materials or captors.
    pub fn new(scene: &Scene, most: usize) -> Self {
        let run = run_of(scene, most);
        // glass is transparent in the display
        let clear = |triangle: usize| scene.material(&scene.surface(triangle)).is_clear();
        let mut copies = copies(scene, run > 1);
        // looks in the last group of copies that begins at or before the triangle
        let is_copy = |triangle: usize| {
            let after = copies.partition_point(|copies| copies.first <= triangle);
            let last = copies[..after].last();
            last.is_some_and(|c| triangle - c.first < c.each * c.transforms.len())
        };
        let stays = |triangle: usize| clear(triangle) || is_copy(triangle);
        let whole = if run > 1 { scene.unshared() } else { scene.triangles().len() };
        let (corners, triangles) =
            cut((0..whole).map(|i| scene.triangles().at(i)), stays, MORE, SHORT * scene.radius());
        for copies in &mut copies {
            copies.first = triangles.partition_point(|t| (*t as usize) < copies.first);
        }
        let mut tiles = Self { corners, triangles, parts: Vec::new(), copies };
        if run > 1 {
            tiles.merge_shared(scene, run);
        }
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
            match scene.round(captor) {
                Some(_) => {
                    tiles.triangles.resize(tiles.corners.len(), captor.triangles.start as u32)
                }
                None => tiles.triangles.extend(captor.triangles.clone().map(|t| t as u32)),
            }
            tiles.add_to_part(TilePart {
                object: None,
                material: None,
                captor: Some(c),
                tiles: first..tiles.corners.len(),
            });
        }
        tiles
    }

    /// Returns the least number of tiles that a scene can be shown in: of shared copies one for each
    /// part of each copy.
    pub fn least(scene: &Scene) -> usize {
        let own = scene.unshared() + scene.captor_tiles();
        own + merged(&parts_of_copies(scene), usize::MAX)
    }

    /// Returns the number of tiles.
    pub fn count(&self) -> usize {
        self.corners.len()
    }

    /// Adds the copies that share their triangles, up to `run` of which make a tile.
    fn merge_shared(&mut self, scene: &Scene, run: usize) {
        let is_shared = |first: usize| first >= scene.unshared();
        let mut placed = scene.object_copies().filter(|copy| is_shared(copy.triangles.start));
        for alike in scene.alike() {
            let Range { start, end } = alike.triangles;
            let all: Vec<u32> = (0..(end - start) as u32).collect();
            let key = |triangle: &u32| part_key(scene, start + *triangle as usize);
            let together = all.chunk_by(|a, b| key(a) == key(b)).flat_map(|part| part.chunks(run));
            let mut starts: Vec<u32> = together.map(|tile| tile[0]).collect();
            let (first, each) = (self.corners.len(), starts.len());
            starts.push(all.len() as u32);
            let copies: Vec<_> = placed.by_ref().take(alike.areas.len()).collect();
            for copy in &copies {
                for ends in starts.windows(2) {
                    let middle = copy.triangles.start + (ends[0] + ends[1]) as usize / 2;
                    self.corners.push(scene.triangles().at(middle));
                    self.triangles.push(middle as u32);
                }
            }
            self.copies.push(TileCopies {
                object: copies.first().and_then(|copy| copy.object),
                first,
                each,
                transforms: copies.into_iter().map(|copy| copy.transform).collect(),
                merged: Some(Merged { triangles: start..end, starts }),
            });
        }
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

/// Returns what all triangles of a part have in common.
fn part_key(scene: &Scene, triangle: usize) -> (u32, Option<usize>) {
    let surface = scene.surface(triangle);
    (surface.material, surface.captor())
}

/// Returns the number of triangles of each part of a copy that shares them, object by object, with
/// the number of its copies.
fn parts_of_copies(scene: &Scene) -> Vec<(Vec<usize>, usize)> {
    let parts = |range: Range<usize>| {
        let all: Vec<usize> = range.collect();
        let same = |a: &usize, b: &usize| part_key(scene, *a) == part_key(scene, *b);
        all.chunk_by(same).map(<[usize]>::len).collect()
    };
    scene.alike().map(|alike| (parts(alike.triangles), alike.areas.len())).collect()
}

/// Returns how many triangles of shared copies make a tile, so that there are at most about `most`
/// tiles or each part of a copy is one; 1 where the triangles themselves are no more.
fn run_of(scene: &Scene, most: usize) -> usize {
    let shared = scene.triangles().len() - scene.unshared();
    let others = scene.unshared() + scene.captor_tiles();
    if shared == 0 || shared + others <= most {
        return 1;
    }
    let parts = parts_of_copies(scene);
    let longest = parts.iter().flat_map(|(parts, _)| parts).copied().max().unwrap_or(1);
    let room = most.saturating_sub(others + MORE).max(1);
    let mut run = shared.div_ceil(room).max(2);
    while run < longest && merged(&parts, run) > room {
        run += run.div_ceil(8);
    }
    run
}

/// Returns the number of tiles of shared copies of which up to `run` triangles make one.
fn merged(parts: &[(Vec<usize>, usize)], run: usize) -> usize {
    let tiles = |parts: &[usize]| parts.iter().map(|part| part.div_ceil(run)).sum::<usize>();
    parts.iter().map(|(parts, copies)| tiles(parts) * copies).sum()
}

/// Returns the copies of detailed objects among the triangles of a scene, in the order of the
/// triangles; if they are `merged`, without those that share their triangles.
fn copies(scene: &Scene, merged: bool) -> Vec<TileCopies> {
    let mut found: Vec<TileCopies> = Vec::new();
    let is_wanted = |first: usize| !merged || first < scene.unshared();
    for copy in scene.object_copies().filter(|copy| is_wanted(copy.triangles.start)) {
        let (object, first, each) = (copy.object, copy.triangles.start, copy.triangles.len());
        match found.last_mut() {
            Some(c)
                if (c.object, c.each) == (object, each)
                    && c.first + c.each * c.transforms.len() == first =>
            {
                c.transforms.push(copy.transform);
            }
            _ => {
                let transforms = vec![copy.transform];
                found.push(TileCopies { object, first, each, transforms, merged: None });
            }
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
