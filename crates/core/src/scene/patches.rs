//! Smooth pieces of surface: triangles joined by edges that hardly bend.
//!
//! Irradiance changes abruptly from one side of a sheet to the other, from wall to wall, and from
//! leaf to leaf. Over one face of a smooth piece it changes only as shadows and distances make it,
//! so photon estimates on a face use the photons of its own piece alone.

use std::ops::Range;

use glam::Vec3;

use crate::scene::world::Scene;

/// Cosine of the largest angle by which an edge may bend, and by which a triangle of a piece may
/// lean from the first triangle: 30 degrees.
const SMOOTH: f32 = 0.866;

/// The smooth pieces of all surfaces of a scene. An edge that more than two triangles share ends a
/// piece: something stands there.
#[derive(Clone, Debug)]
pub struct Patches {
    own: Pieces,
    /// The pieces of copies that share their triangles.
    shared: Vec<SharedPieces>,
}

/// The smooth pieces of a mesh.
#[derive(Clone, Debug)]
struct Pieces {
    of_triangle: Vec<u32>,
    areas: Vec<f64>,
    /// The triangles of the first piece, then those of the second, and so on.
    members: Vec<u32>,
    /// Where in `members` each piece ends.
    ends: Vec<u32>,
}

/// The smooth pieces of copies of a mesh.
#[derive(Clone, Debug)]
struct SharedPieces {
    /// Those of each copy, with the areas of the first.
    pieces: Pieces,
    /// Index of the first triangle of the first copy.
    first: usize,
    /// Number of the first piece of the first copy.
    first_piece: usize,
    /// The area of each copy over that of the first.
    areas: Vec<f64>,
}

/// An edge of a triangle: the bits of its ends' coordinates, the lesser end first.
pub type Edge = [[u32; 3]; 2];

impl Patches {
    /// Finds the smooth pieces of the surfaces of `scene`.
    pub fn new(scene: &Scene) -> Self {
        let own = Pieces::new(scene, 0..scene.unshared());
        let mut next = own.areas.len();
        let mut shared: Vec<SharedPieces> = Vec::new();
        for copies in scene.alike() {
            let first = copies.triangles.start;
            let pieces = Pieces::new(scene, copies.triangles);
            let (first_piece, count) = (next, pieces.areas.len() * copies.areas.len());
            next += count;
            shared.push(SharedPieces { pieces, first, first_piece, areas: copies.areas });
        }
        Self { own, shared }
    }

    /// Returns the number of pieces.
    pub fn count(&self) -> usize {
        let own = self.own.areas.len();
        let end =
            |last: &SharedPieces| last.first_piece + last.pieces.areas.len() * last.areas.len();
        self.shared.last().map_or(own, end)
    }

    /// Returns the number of pieces of surfaces that are no shared copies; they come first.
    pub fn unshared(&self) -> usize {
        self.own.areas.len()
    }

    /// Returns the index of the piece that a triangle belongs to.
    #[inline]
    pub fn of(&self, triangle: usize) -> usize {
        match self.own.of_triangle.get(triangle) {
            Some(piece) => *piece as usize,
            None => self.of_copy(triangle),
        }
    }

    fn of_copy(&self, triangle: usize) -> usize {
        let after = self.shared.partition_point(|shared| shared.first <= triangle);
        let SharedPieces { pieces, first, first_piece, .. } = &self.shared[after - 1];
        let (index, each) = (triangle - first, pieces.of_triangle.len());
        let piece = pieces.of_triangle[index % each] as usize;
        first_piece + index / each * pieces.areas.len() + piece
    }

    /// Returns the area of one side of a piece, m2.
    pub fn area(&self, patch: usize) -> f64 {
        if let Some(area) = self.own.areas.get(patch) {
            return *area;
        }
        let (shared, copy, piece) = self.in_copy(patch);
        shared.pieces.areas[piece] * shared.areas[copy]
    }

    /// Returns the triangles of a piece.
    pub fn members(&self, patch: usize) -> impl ExactSizeIterator<Item = usize> + '_ {
        let (members, first) = match self.own.areas.get(patch) {
            Some(_) => (self.own.members(patch), 0),
            None => {
                let (shared, copy, piece) = self.in_copy(patch);
                let each = shared.pieces.of_triangle.len();
                (shared.pieces.members(piece), shared.first + copy * each)
            }
        };
        members.iter().map(move |member| first + *member as usize)
    }

    /// Returns the object of which a piece is that of a copy, the number of the copy, and the number
    /// of the piece in it.
    fn in_copy(&self, patch: usize) -> (&SharedPieces, usize, usize) {
        let after = self.shared.partition_point(|shared| shared.first_piece <= patch);
        let shared = &self.shared[after - 1];
        let (index, each) = (patch - shared.first_piece, shared.pieces.areas.len());
        (shared, index / each, index % each)
    }

    /// Returns the number under which photons that arrive at this face of a triangle are stored:
    /// one for each face of each piece.
    #[inline]
    pub fn bin(&self, triangle: usize, front: bool) -> u32 {
        2 * self.of(triangle) as u32 + u32::from(!front)
    }
}

impl Pieces {
    /// Finds the smooth pieces of a range of the triangles of a scene.
    fn new(scene: &Scene, range: Range<usize>) -> Self {
        const NONE: u32 = u32::MAX;
        let joined = joined(scene, range.clone());
        let normal = |index: usize| scene.surface(range.start + index).normal;
        let mut pieces = Self {
            of_triangle: vec![NONE; range.len()],
            areas: Vec::new(),
            members: Vec::with_capacity(range.len()),
            ends: Vec::new(),
        };
        for first in 0..range.len() {
            if pieces.of_triangle[first] != NONE {
                continue;
            }
            let (piece, mut area) = (pieces.areas.len() as u32, 0.0);
            let mut waiting = vec![first as u32];
            while let Some(index) = waiting.pop() {
                let at = index as usize;
                let leans = at != first && normal(at).dot(normal(first)) < SMOOTH;
                if pieces.of_triangle[at] != NONE || leans {
                    continue;
                }
                pieces.of_triangle[at] = piece;
                pieces.members.push(index);
                area += f64::from(scene.triangles().at(range.start + at).area());
                let from = joined.partition_point(|pair| pair[0] < index);
                let to = joined.partition_point(|pair| pair[0] <= index);
                waiting.extend(joined[from..to].iter().map(|pair| pair[1]));
            }
            pieces.areas.push(area);
            pieces.ends.push(pieces.members.len() as u32);
        }
        pieces
    }

    /// Returns the triangles of a piece.
    fn members(&self, piece: usize) -> &[u32] {
        let start = piece.checked_sub(1).map_or(0, |before| self.ends[before]);
        &self.members[start as usize..self.ends[piece] as usize]
    }
}

/// Returns the pairs of triangles of a range that join smoothly, by their places in it, each pair
/// both ways round, sorted.
fn joined(scene: &Scene, range: Range<usize>) -> Vec<[u32; 2]> {
    let mut joined = Vec::new();
    smooth_edges(scene, range, SMOOTH, |[one, other], _| {
        joined.extend([[one, other], [other, one]]);
    });
    joined.sort_unstable();
    joined
}

/// Visits the edges at which two triangles of a range join smoothly, and no third: the places of
/// the triangles in the range, and the ends of the edge. The cosine of the angle by which it bends
/// is at least `least`.
pub fn smooth_edges(
    scene: &Scene,
    range: Range<usize>,
    least: f32,
    mut visit: impl FnMut([u32; 2], Edge),
) {
    let mut edges: Vec<(Edge, bool, u32)> = Vec::with_capacity(3 * range.len());
    for (i, t) in range.clone().map(|index| scene.triangles().at(index)).enumerate() {
        for (p, q) in [(t.a, t.b), (t.b, t.c), (t.c, t.a)] {
            let (p, q) = (bits(p), bits(q));
            edges.push(([p.min(q), p.max(q)], p < q, i as u32));
        }
    }
    edges.sort_unstable();
    for edge in edges.chunk_by(|a, b| a.0 == b.0) {
        // if both triangles run along the edge the same way, the front of one joins the back of the
        // other
        let &[(_, one_way, one), (_, other_way, other)] = edge else { continue };
        let normals = [one, other].map(|i| scene.surface(range.start + i as usize).normal);
        if one_way != other_way && normals[0].dot(normals[1]) >= least {
            visit([one, other], edge[0].0);
        }
    }
}

/// Returns the bits of a corner's coordinates, equal for equal places: -0 becomes 0.
pub fn bits(p: Vec3) -> [u32; 3] {
    (p + Vec3::ZERO).to_array().map(f32::to_bits)
}
