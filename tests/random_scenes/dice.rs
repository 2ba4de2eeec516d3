//! Random choices with which the rooms are built.

use std::f64::consts::TAU;

use glam::DVec3;

/// A generator of random numbers, SplitMix64 (Steele et al. 2014). The scenes must not depend on
/// phylux's own random streams, which are under test.
pub struct Dice(pub u64);

impl Dice {
    pub fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }

    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.uniform()
    }

    /// Returns a number whose logarithm is uniform.
    pub fn magnitude(&mut self, low: f64, high: f64) -> f64 {
        self.between(low.ln(), high.ln()).exp()
    }

    pub fn below(&mut self, n: usize) -> usize {
        (self.uniform() * n as f64) as usize
    }

    pub fn chance(&mut self, p: f64) -> bool {
        self.uniform() < p
    }

    pub fn one_of<T: Copy>(&mut self, of: &[T]) -> T {
        of[self.below(of.len())]
    }

    pub fn direction(&mut self) -> DVec3 {
        let (z, turn) = (self.between(-1.0, 1.0), TAU * self.uniform());
        let across = (1.0 - z * z).sqrt();
        DVec3::new(across * turn.cos(), across * turn.sin(), z)
    }

    /// Returns a random direction within this number of degrees of `axis`.
    pub fn near(&mut self, axis: DVec3, degrees: f64) -> DVec3 {
        (axis + degrees.to_radians().tan() * self.uniform() * self.direction()).normalize()
    }
}
