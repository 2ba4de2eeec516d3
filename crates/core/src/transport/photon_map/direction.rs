//! Directions in four bytes, in the octahedral code (Meyer et al., Computer Graphics Forum 29 (4),
//! 2010; Cigolle et al., JCGT 3 (2), 2014).

use std::f32::consts::FRAC_1_SQRT_2;

use glam::{Vec2, Vec2Swizzles, Vec3};

/// A unit vector, with a rounding error of at most [`MAX_ERROR`](Self::MAX_ERROR).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PackedDirection([i16; 2]);

/// Number of steps from the middle of the square to its edge.
const STEPS: f32 = i16::MAX as f32;

impl PackedDirection {
    /// The largest angle between a direction and its packed form, rad. Rounding moves a point of
    /// the octahedron by at most sqrt(6) / 2 steps, the faces of the octahedron are at a distance
    /// of 1 / sqrt(3) from its centre, and single precision adds a little.
    pub const MAX_ERROR: f32 = 3.0 * FRAC_1_SQRT_2 / STEPS + 1e-6;

    /// Packs a unit vector: it is projected on the octahedron |x| + |y| + |z| = 1, whose lower half
    /// is unfolded around the upper one.
    #[inline]
    pub fn new(direction: Vec3) -> Self {
        let on_octahedron = direction / direction.abs().element_sum();
        let flat = on_octahedron.truncate();
        let square = if direction.z < 0.0 { fold(flat) } else { flat };
        Self((square * STEPS).round().to_array().map(|x| x as i16))
    }

    /// Returns the code of the direction.
    pub fn bits(self) -> u32 {
        let [x, y] = self.0.map(|x| u32::from(x as u16));
        x << 16 | y
    }

    /// Returns the direction with this code.
    pub fn from_bits(bits: u32) -> Self {
        Self([(bits >> 16) as u16 as i16, bits as u16 as i16])
    }

    /// Returns the unit vector.
    #[inline]
    pub fn unpack(self) -> Vec3 {
        let square = Vec2::from(self.0.map(f32::from)) / STEPS;
        let z = 1.0 - square.abs().element_sum();
        let flat = if z < 0.0 { fold(square) } else { square };
        flat.extend(z).normalize()
    }
}

/// Folds a point over the edge of the inner square; folding twice restores it.
fn fold(p: Vec2) -> Vec2 {
    (1.0 - p.yx().abs()) * Vec2::ONE.copysign(p)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{rng::Stream, sampling::uniform_cone};

    fn error(direction: Vec3) -> f64 {
        let packed = PackedDirection::new(direction);
        assert_eq!(PackedDirection::from_bits(packed.bits()), packed);
        let kept = packed.unpack();
        assert!((kept.length() - 1.0).abs() < 1e-6, "{kept}");
        let (kept, direction) = (kept.as_dvec3(), direction.as_dvec3());
        kept.cross(direction).length().atan2(kept.dot(direction))
    }

    /// Axes, edges and middles of faces, and a million directions of seed 1. The bound holds for
    /// all of them (chance plays no part in this), and is too loose by at most a tenth.
    #[test]
    fn error_is_bounded() {
        let side = |i: usize| [-1.0, -0.0, 0.0, 1.0][i % 4];
        let corners = (0..64).map(|i| Vec3::new(side(i), side(i / 4), side(i / 16)));
        let special = corners.filter_map(Vec3::try_normalize);
        let mut rng = Stream::new(1, 0, 0);
        let random = (0..1_000_000).map(|_| uniform_cone(2.0, rng.square()).normalize());
        let worst = special.chain(random).map(error).fold(0.0, f64::max);
        let bound = f64::from(PackedDirection::MAX_ERROR);
        println!("{worst:e} of {bound:e}");
        assert!(worst <= bound && worst > 0.9 * bound, "{worst:e} of {bound:e}");
    }

    /// Vectors that are not directions do not cause a panic.
    #[test]
    fn nothing_panics() {
        for v in [Vec3::ZERO, Vec3::NAN, Vec3::INFINITY, Vec3::splat(f32::MIN_POSITIVE)] {
            PackedDirection::new(v).unpack();
        }
    }
}
