//! Smooth pieces of surface: triangles joined by edges that hardly bend.
//!
//! Irradiance changes abruptly from one side of a sheet to the other, from wall to wall, and from
//! leaf to leaf. Over one face of a smooth piece it changes only as shadows and distances make it,
//! so photon estimates on a face use the photons of its own piece alone.

use glam::Vec3;

use crate::scene::world::Scene;

/// Cosine of the largest angle by which an edge may bend, and by which a triangle of a piece may
/// lean from the first triangle: 30 degrees.
const SMOOTH: f32 = 0.866;

/// The smooth pieces of all surfaces of a scene. An edge that more than two triangles share ends a
/// piece: something stands there.
#[derive(Clone, Debug)]
pub struct Patches {
    of_triangle: Vec<u32>,
    areas: Vec<f64>,
}

/// An edge of a triangle: the bits of its ends' coordinates, the lesser end first.
type Edge = [[u32; 3]; 2];

impl Patches {
    /// Finds the smooth pieces of the surfaces of `scene`.
    pub fn new(scene: &Scene) -> Self {
        const NONE: u32 = u32::MAX;
        let joined = joined(scene);
        let normal = |triangle: usize| scene.surface(triangle).normal;
        let mut patches =
            Self { of_triangle: vec![NONE; scene.triangles().len()], areas: Vec::new() };
        for first in 0..scene.triangles().len() {
            if patches.of_triangle[first] != NONE {
                continue;
            }
            let (patch, mut area) = (patches.areas.len() as u32, 0.0);
            let mut waiting = vec![first as u32];
            while let Some(triangle) = waiting.pop() {
                let at = triangle as usize;
                let leans = at != first && normal(at).dot(normal(first)) < SMOOTH;
                if patches.of_triangle[at] != NONE || leans {
                    continue;
                }
                patches.of_triangle[at] = patch;
                area += f64::from(scene.triangles()[at].area());
                let from = joined.partition_point(|pair| pair[0] < triangle);
                let to = joined.partition_point(|pair| pair[0] <= triangle);
                waiting.extend(joined[from..to].iter().map(|pair| pair[1]));
            }
            patches.areas.push(area);
        }
        patches
    }

    /// Returns the number of pieces.
    pub fn count(&self) -> usize {
        self.areas.len()
    }

    /// Returns the index of the piece that a triangle belongs to.
    #[inline]
    pub fn of(&self, triangle: usize) -> usize {
        self.of_triangle[triangle] as usize
    }

    /// Returns the area of one side of a piece, m2.
    pub fn area(&self, patch: usize) -> f64 {
        self.areas[patch]
    }

    /// Returns the number under which photons that arrive at this face of a triangle are stored:
    /// one for each face of each piece.
    #[inline]
    pub fn bin(&self, triangle: usize, front: bool) -> u32 {
        2 * self.of_triangle[triangle] + u32::from(!front)
    }
}

/// Returns the pairs of triangles that join smoothly, each pair both ways round, sorted.
fn joined(scene: &Scene) -> Vec<[u32; 2]> {
    let mut edges: Vec<(Edge, bool, u32)> = Vec::with_capacity(3 * scene.triangles().len());
    for (i, t) in scene.triangles().iter().enumerate() {
        for (p, q) in [(t.a, t.b), (t.b, t.c), (t.c, t.a)] {
            let (p, q) = (bits(p), bits(q));
            edges.push(([p.min(q), p.max(q)], p < q, i as u32));
        }
    }
    edges.sort_unstable();
    let mut joined = Vec::new();
    for edge in edges.chunk_by(|a, b| a.0 == b.0) {
        // if both triangles run along the edge the same way, the front of one joins the back of the
        // other
        let &[(_, one_way, one), (_, other_way, other)] = edge else { continue };
        let normals = [one, other].map(|i| scene.surface(i as usize).normal);
        if one_way != other_way && normals[0].dot(normals[1]) >= SMOOTH {
            joined.extend([[one, other], [other, one]]);
        }
    }
    joined.sort_unstable();
    joined
}

/// Returns the bits of a corner's coordinates, equal for equal places: -0 becomes 0.
fn bits(p: Vec3) -> [u32; 3] {
    (p + Vec3::ZERO).to_array().map(f32::to_bits)
}
