//! The random stream of one history, from (seed, block, index): no stream depends on threads.

use glam::Vec2;
use rand_core::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

/// The random numbers of one history.
#[derive(Clone, Debug)]
pub struct Stream(Xoshiro256PlusPlus);

impl Stream {
    /// The stream of history `index` (below 2^40) of `block`.
    #[inline]
    pub fn new(seed: u64, block: u64, index: u64) -> Self {
        Self(Xoshiro256PlusPlus::seed_from_u64(mix(mix(seed) ^ (block << 40 | index))))
    }

    /// Uniform in [0, 1), in steps of 2^-24.
    #[inline]
    pub fn uniform(&mut self) -> f32 {
        (self.0.next_u64() >> 40) as f32 * (1.0 / (1u64 << 24) as f32)
    }

    /// Uniform in [0, 1), in steps of 2^-53: for a choice among very many.
    #[inline]
    pub fn uniform_fine(&mut self) -> f64 {
        (self.0.next_u64() >> 11) as f64 * (1.0 / (1u64 << 53) as f64)
    }

    /// Uniform in [0, 1)^2, in steps of 2^-24.
    #[inline]
    pub fn square(&mut self) -> Vec2 {
        let bits = self.0.next_u64();
        let step = 1.0 / (1u64 << 24) as f32;
        Vec2::new((bits >> 40) as f32 * step, (bits >> 16 & 0xff_ffff) as f32 * step)
    }
}

/// A bijective mix of 64 bits (finaliser of SplitMix64; Steele et al., OOPSLA 2014).
fn mix(mut z: u64) -> u64 {
    z = z.wrapping_add(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A change of these numbers moves every result: it belongs in the CHANGELOG. They are those of
    /// a second implementation, in another language.
    #[test]
    fn stream_is_pinned() {
        let mut stream = Stream::new(1, 2, 3);
        let step = 2f32.powi(-24);
        assert_eq!(stream.uniform(), 8_360_138.0 * step);
        assert_eq!(stream.uniform(), 14_001_582.0 * step);
        assert_eq!(stream.square().to_array(), [10_490_726.0 * step, 4_107_280.0 * step]);
        assert_eq!(stream.uniform_fine(), 88_171_357_739_848.0 * 2f64.powi(-53));
    }

    /// Mean and neighbour correlation of the first number of 1e6 neighbouring histories, each
    /// within 5 standard errors (false alarm 1e-6).
    #[test]
    fn neighbouring_histories_are_independent() {
        let n = 1_000_000;
        let first: Vec<f64> =
            (0..n).map(|i| f64::from(Stream::new(1, i >> 10, i).uniform()) - 0.5).collect();
        let mean = first.iter().sum::<f64>() / n as f64;
        let lag = first.windows(2).map(|w| w[0] * w[1]).sum::<f64>() / n as f64;
        assert!(mean.abs() < 5.0 * (1.0 / 12.0 / n as f64).sqrt(), "mean {mean}");
        assert!(lag.abs() < 5.0 / 12.0 / (n as f64).sqrt(), "lag {lag}");
    }
}
