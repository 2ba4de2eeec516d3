//! Normals that are smoothed over meshes, so that a curved thing looks round in a picture although
//! it is made of flat triangles (Phong, Illumination for Computer Generated Pictures, Communications
//! of the ACM 18 (6), 1975). Photons and captors know nothing of them.

use std::ops::Range;

use glam::Vec3;

use phylux_core::{
    math::geometry::Triangle,
    scene::{
        material::Scatterer,
        patches::{bits, smooth_edges},
        world::{Arrived, Scene},
    },
};

/// Cosine of the largest angle by which an edge may bend where its mesh is taken for round, and by
/// which a smoothed normal may lean from that of its triangle: 40 degrees. So a tube of nine sides is
/// round, and one of eight has edges.
const ROUND: f32 = 0.766;
/// The least cosine between a smoothed normal and the direction to the viewer.
const GRAZING: f32 = 0.02;

/// The smoothed normals at the corners of all triangles.
pub(super) struct Normals {
    /// Of the triangles that [stand for all](Scene::standing): unit vectors on their fronts.
    corners: Vec<[Vec3; 3]>,
    /// The first triangle of each of their ranges, and the number of those before it.
    ranges: Vec<(usize, usize)>,
}

impl Normals {
    /// Smooths the normals of the surfaces of a scene that scatter diffusely: at each corner, over
    /// the triangles of one material that join there by edges which bend by less than 40 degrees,
    /// weighted by their angles at the corner (Thürmer and Wüthrich, Journal of Graphics Tools 3
    /// (1), 1998).
    pub fn new(scene: &Scene) -> Self {
        let (mut corners, mut ranges) = (Vec::new(), Vec::new());
        for standing in scene.standing() {
            ranges.push((standing.triangles.start, corners.len()));
            corners.extend(smoothed(scene, standing.triangles));
        }
        Self { corners, ranges }
    }

    /// Gives the arrival of a ray at a surface the smoothed normal there, turned a little towards
    /// the viewer where the ray grazes the surface. What else it says of the surface stays.
    pub fn smooth<'s>(&self, scene: &Scene, mut at: Arrived<'s>) -> Arrived<'s> {
        let triangle = at.hit.triangle;
        let (first, turn) = scene.in_first_copy(triangle);
        let after = self.ranges.partition_point(|(start, _)| *start <= first);
        let (start, before) = self.ranges[after - 1];
        let own = turn.transpose() * at.surface.normal;
        let mut corners = self.corners[before + first - start];
        if corners.iter().all(|corner| corner.dot(own) > FLAT) {
            return at;
        }
        if turn.determinant() < 0.0 {
            // the corners of a mirrored copy run the other way round
            corners.swap(1, 2);
        }
        let weights = weights(&scene.triangles().at(triangle), at.hit.point);
        let mean =
            turn * (corners[0] * weights.x + corners[1] * weights.y + corners[2] * weights.z);
        let mut normal = mean.normalize_or(at.surface.normal);
        let interaction = &mut at.interaction;
        if !interaction.front {
            normal = -normal;
        }
        let cos = -interaction.direction.dot(normal);
        if cos < GRAZING {
            normal = (normal - (GRAZING - cos) * interaction.direction).normalize();
        }
        (interaction.normal, interaction.cos) = (normal, cos.clamp(GRAZING, 1.0));
        at
    }
}

/// A triangle of whose smoothed normals all have a greater cosine to its own is flat.
const FLAT: f32 = 1.0 - 1e-5;

/// Returns the smoothed normals at the corners of a range of the triangles of a scene.
fn smoothed(scene: &Scene, range: Range<usize>) -> Vec<[Vec3; 3]> {
    let surface = |index: usize| scene.surface(range.start + index);
    let own: Vec<Vec3> = (0..range.len()).map(|index| surface(index).normal).collect();
    // corners that join are one; each knows another of the same, or is the first of them
    let mut same: Vec<u32> = (0..3 * range.len() as u32).collect();
    smooth_edges(scene, range.clone(), ROUND, |pair, ends| {
        let [one, other] = pair.map(|index| surface(index as usize));
        if one.material != other.material || !scene.material(&one).is_diffuse() {
            return;
        }
        for end in ends {
            let [p, q] = pair.map(|index| {
                let Triangle { a, b, c } = scene.triangles().at(range.start + index as usize);
                let corner = [a, b, c].iter().position(|corner| bits(*corner) == end);
                first_of(&mut same, 3 * index as usize + corner.unwrap_or(0))
            });
            same[p.max(q)] = p.min(q) as u32;
        }
    });
    let mut sums = vec![Vec3::ZERO; same.len()];
    for (index, normal) in own.iter().enumerate() {
        let corners = scene.triangles().at(range.start + index);
        for (corner, angle) in angles(&corners).into_iter().enumerate() {
            sums[first_of(&mut same, 3 * index + corner)] += angle * *normal;
        }
    }
    let mut at = |index: usize, corner: usize| {
        let mean = sums[first_of(&mut same, 3 * index + corner)].normalize_or(own[index]);
        if mean.dot(own[index]) < ROUND { own[index] } else { mean }
    };
    (0..range.len()).map(|index| [0, 1, 2].map(|corner| at(index, corner))).collect()
}

/// Returns the first of the corners that are the same as this one.
fn first_of(same: &mut [u32], mut corner: usize) -> usize {
    while same[corner] as usize != corner {
        same[corner] = same[same[corner] as usize];
        corner = same[corner] as usize;
    }
    corner
}

/// Returns the angles of a triangle at its corners, radians.
fn angles(&Triangle { a, b, c }: &Triangle) -> [f32; 3] {
    let at = |p: Vec3, q: Vec3, r: Vec3| {
        let (to_q, to_r) = ((q - p).normalize_or_zero(), (r - p).normalize_or_zero());
        to_q.dot(to_r).clamp(-1.0, 1.0).acos()
    };
    [at(a, b, c), at(b, c, a), at(c, a, b)]
}

/// Returns the barycentric weights, in [0, 1], of a point of a triangle.
fn weights(triangle: &Triangle, point: Vec3) -> Vec3 {
    let Triangle { a, b, c } = *triangle;
    let cross = triangle.cross();
    let part = |p: Vec3, q: Vec3| (p - point).cross(q - point).dot(cross);
    let weights = Vec3::new(part(b, c), part(c, a), part(a, b)) / cross.length_squared();
    weights.clamp(Vec3::ZERO, Vec3::ONE)
}
