//! Pieces of meshes: which triangles are connected, and whether they close.

use rayon::prelude::*;

use phylux_core::{
    math::geometry::{Extent, Triangle, area},
    scene::world::Scene,
};

/// The triangles of a scene whose corners are joined. One copy of an object stands for all that share
/// its triangles.
pub(super) struct Welded {
    /// Indices of the triangles in the scene.
    pub triangles: Vec<usize>,
    /// The numbers of each triangle's three vertices.
    vertices: Vec<[u32; 3]>,
}

impl Welded {
    /// Returns the numbers of the vertices of a triangle of the scene.
    pub fn vertices_of(&self, triangle: usize) -> [u32; 3] {
        self.triangles.binary_search(&triangle).map_or([0; 3], |place| self.vertices[place])
    }
}

/// Joins corners with equal coordinates to one vertex.
pub(super) fn weld(scene: &Scene) -> Welded {
    let indices: Vec<usize> = scene.standing_for_all().collect();
    let triangles = indices.iter().map(|&index| scene.triangles().at(index));
    // adding 0.0 turns -0.0 into 0.0
    let bits = |p: glam::Vec3| (p + 0.0).to_array().map(f32::to_bits);
    let corners = triangles.flat_map(|t| [t.a, t.b, t.c]);
    let mut corners: Vec<([u32; 3], u32)> = corners.map(bits).zip(0..).collect();
    corners.par_sort_unstable();
    let mut vertices = vec![[0; 3]; indices.len()];
    for (same, vertex) in corners.chunk_by(|p, q| p.0 == q.0).zip(0..) {
        for &(_, corner) in same {
            vertices[corner as usize / 3][corner as usize % 3] = vertex;
        }
    }
    Welded { triangles: indices, vertices }
}

/// Triangles that are connected by their edges.
pub(super) struct Piece {
    /// Indices of the piece's triangles in the scene.
    pub triangles: Vec<usize>,
    /// Number of edges that do not join two triangles.
    pub open_edges: usize,
    /// Number of edges whose two triangles face opposite ways.
    pub turned_edges: usize,
    /// One-sided area, m2.
    pub area: f64,
    /// Volume of a closed piece, m3; negative if the normals point in.
    pub volume: f64,
    /// Box around the piece, m from the centre of the scene.
    pub extent: Extent,
}

impl Piece {
    const EMPTY: Self = Self {
        triangles: Vec::new(),
        open_edges: 0,
        turned_edges: 0,
        area: 0.0,
        volume: 0.0,
        extent: Extent::EMPTY,
    };

    pub fn is_closed(&self) -> bool {
        self.open_edges == 0 && self.turned_edges == 0
    }

    /// Returns the thickness of a closed piece that is flat or has thin walls, m.
    pub fn thickness(&self) -> f64 {
        2.0 * self.volume.abs() / self.area
    }

    fn add(&mut self, triangle: usize, shape: &Triangle, anchor: &Triangle) {
        let corners = [shape.a, shape.b, shape.c];
        let at_anchor = corners.map(|p| (p - anchor.a).as_dvec3());
        let [a, b, c] = at_anchor;
        self.triangles.push(triangle);
        self.area += area(&at_anchor);
        self.volume += a.dot(b.cross(c)) / 6.0;
        self.extent = self.extent.join(Extent::of(corners));
    }
}

#[derive(Default)]
pub(super) struct Pieces {
    pub list: Vec<Piece>,
    /// Pairs of pieces that have an edge in common. A piece in which four or more triangles meet in
    /// an edge is paired with itself.
    pub meeting: Vec<[usize; 2]>,
}

/// One side of a triangle. The order puts equal edges of the same kind next to each other.
#[derive(PartialEq, Eq, PartialOrd, Ord)]
struct Edge {
    kind: u32,
    ends: [u32; 2],
    triangle: u32,
    forward: bool,
}

/// Returns the pieces of the triangles that have a `kind`. All triangles of a piece are of one
/// kind.
pub(super) fn pieces(
    scene: &Scene,
    welded: &Welded,
    kind: impl Fn(usize) -> Option<u32>,
) -> Pieces {
    let Welded { triangles, vertices } = welded;
    let (members, mut edges) = edges(welded, kind);
    if edges.is_empty() {
        return Pieces::default();
    }
    edges.par_sort_unstable();
    let Seams { mut joined, open, turned, crowded } = Seams::of(&edges, vertices.len());
    let mut list: Vec<Piece> = Vec::new();
    let mut piece_of_root = vec![usize::MAX; vertices.len()];
    for triangle in members {
        let root = joined.root(triangle) as usize;
        if piece_of_root[root] == usize::MAX {
            piece_of_root[root] = list.len();
            list.push(Piece::EMPTY);
        }
        let piece = &mut list[piece_of_root[root]];
        let triangle = triangles[triangle as usize];
        let first = piece.triangles.first().copied().unwrap_or(triangle);
        piece.add(triangle, &scene.triangles().at(triangle), &scene.triangles().at(first));
    }
    let mut piece_of = |triangle: u32| piece_of_root[joined.root(triangle) as usize];
    open.iter().for_each(|&t| list[piece_of(t)].open_edges += 1);
    turned.iter().for_each(|&t| list[piece_of(t)].turned_edges += 1);
    let owners = crowded.iter().map(|edge| edge.iter().map(|&t| piece_of(t)).collect());
    Pieces { meeting: meeting(&list, owners), list }
}

/// Returns the triangles that have a `kind` and corners apart from each other, by their places
/// among those that are welded, and their edges.
fn edges(welded: &Welded, kind: impl Fn(usize) -> Option<u32>) -> (Vec<u32>, Vec<Edge>) {
    let (mut members, mut edges) = (Vec::new(), Vec::new());
    for ((triangle, &[a, b, c]), &index) in (0..).zip(&welded.vertices).zip(&welded.triangles) {
        let Some(kind) = kind(index) else { continue };
        if a == b || b == c || c == a {
            continue;
        }
        members.push(triangle);
        for (p, q) in [(a, b), (b, c), (c, a)] {
            let ends = [p.min(q), p.max(q)];
            edges.push(Edge { kind, ends, triangle, forward: p < q });
        }
    }
    (members, edges)
}

/// Triangles that are joined by their edges, and the edges that join them badly.
struct Seams {
    joined: Joined,
    /// A triangle for each edge of it that has no other one.
    open: Vec<u32>,
    /// One of the two triangles of each edge that face opposite ways.
    turned: Vec<u32>,
    /// The triangles of each edge that has more than two.
    crowded: Vec<Vec<u32>>,
}

impl Seams {
    /// Joins so many triangles by their edges, which are sorted.
    fn of(edges: &[Edge], triangles: usize) -> Self {
        let joined = Joined::new(triangles);
        let (open, turned, crowded) = (Vec::new(), Vec::new(), Vec::new());
        let mut seams = Self { joined, open, turned, crowded };
        for edge in edges.chunk_by(|e, f| (e.kind, e.ends) == (f.kind, f.ends)) {
            match edge {
                [e, f] => {
                    seams.joined.join(e.triangle, f.triangle);
                    if e.forward == f.forward {
                        seams.turned.push(e.triangle);
                    }
                }
                _ => seams.add_odd(edge),
            }
        }
        seams
    }

    /// Joins the triangles of an edge of one, or of more than two. Solids listed one after the
    /// other may share an edge: each gets its own two triangles.
    fn add_odd(&mut self, edge: &[Edge]) {
        let mut waiting: Vec<&Edge> = Vec::new();
        for e in edge {
            match waiting.pop_if(|f| f.forward != e.forward) {
                Some(f) => self.joined.join(e.triangle, f.triangle),
                None => waiting.push(e),
            }
        }
        self.open.extend(waiting.iter().map(|e| e.triangle));
        if edge.len() > 2 {
            self.crowded.push(edge.iter().map(|e| e.triangle).collect());
        }
    }
}

/// Returns the pairs of pieces that meet in edges, of which each is given by the pieces of its
/// triangles.
fn meeting(list: &[Piece], edges: impl Iterator<Item = Vec<usize>>) -> Vec<[usize; 2]> {
    let mut meeting = Vec::new();
    for mut owners in edges {
        owners.sort_unstable();
        owners.dedup();
        match owners[..] {
            [only] if list[only].is_closed() => meeting.push([only, only]),
            _ => meeting.extend(owners.windows(2).map(|pair| [pair[0], pair[1]])),
        }
    }
    meeting.sort_unstable();
    meeting.dedup();
    meeting
}

/// Sets of triangles that are merged one by one (union-find).
struct Joined(Vec<u32>);

impl Joined {
    fn new(count: usize) -> Self {
        Self((0..count as u32).collect())
    }

    fn root(&mut self, mut i: u32) -> u32 {
        while self.0[i as usize] != i {
            self.0[i as usize] = self.0[self.0[i as usize] as usize];
            i = self.0[i as usize];
        }
        i
    }

    fn join(&mut self, i: u32, j: u32) {
        let (i, j) = (self.root(i), self.root(j));
        self.0[i.max(j) as usize] = i.min(j);
    }
}
