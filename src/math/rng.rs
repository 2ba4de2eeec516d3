//! The random stream of one history, from (seed, block, index): no stream depends on threads.

use glam::Vec2;
use rand_core::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

/// The random numbers of one history.
#[derive(Clone, Debug)]
pub struct Stream {
    rng: Xoshiro256PlusPlus,
    sobol: SobolPoint,
}

/// Which Sobol sequence: each is scrambled by itself.
#[derive(Clone, Copy, Debug)]
pub struct Sequence(u64);

impl Sequence {
    /// The one that belongs to `set` (below 2^40, as a face) in `block`.
    #[inline]
    pub fn new(seed: u64, block: u64, set: u64) -> Self {
        Self(mix(mix(!seed) ^ (block << 40 | set)))
    }
}

/// What is left of the first numbers of a history, where these are the coordinates of a point.
#[derive(Clone, Debug, Default)]
struct SobolPoint {
    point: u32,
    scramble: u32,
    next: u32,
    end: u32,
    /// Coordinates are made four at a time.
    four: [f32; 4],
}

impl SobolPoint {
    /// Out of the way of photons, which have none.
    #[cold]
    #[inline(never)]
    fn next(&mut self) -> f32 {
        if self.next.is_multiple_of(4) {
            self.four = sobol_burley::sample_4d(self.point, self.next / 4, self.scramble);
        }
        let x = self.four[self.next as usize % 4];
        self.next += 1;
        x
    }

    #[inline]
    fn is_left(&self) -> bool {
        self.next < self.end
    }
}

impl Stream {
    /// The stream of history `index` (below 2^40) of `block`.
    #[inline]
    pub fn new(seed: u64, block: u64, index: u64) -> Self {
        let rng = Xoshiro256PlusPlus::seed_from_u64(mix(mix(seed) ^ (block << 40 | index)));
        Self { rng, sobol: SobolPoint::default() }
    }

    /// The same, but its first `numbers` (at most 256) are the coordinates of a point of a Sobol
    /// sequence with Owen scrambling (Burley, JCGT 9 (4), 2020). Each is uniform by itself; those of
    /// neighbouring points are spread evenly.
    #[inline]
    pub fn with_sobol(self, sequence: Sequence, point: u64, numbers: u32) -> Self {
        // a sequence of the crate has 2^16 points
        let scramble = mix(sequence.0 ^ point >> 16) as u32;
        let point = point as u32 & 0xffff;
        let sobol = SobolPoint { point, scramble, next: 0, end: numbers, four: [0.0; 4] };
        Self { sobol, ..self }
    }

    /// Uniform in [0, 1), in steps of 2^-24.
    #[inline]
    pub fn uniform(&mut self) -> f32 {
        if self.sobol.is_left() {
            return self.sobol.next();
        }
        (self.rng.next_u64() >> 40) as f32 * STEP
    }

    /// Uniform in [0, 1), in steps of 2^-53: for a choice among very many.
    #[inline]
    pub fn uniform_fine(&mut self) -> f64 {
        let step = 1.0 / (1u64 << 53) as f64;
        let bits = self.rng.next_u64();
        if self.sobol.is_left() {
            // below its 24 bits 29 of the stream
            return f64::from(self.sobol.next()) + (bits >> 35) as f64 * step;
        }
        (bits >> 11) as f64 * step
    }

    /// Uniform in [0, 1)^2, in steps of 2^-24.
    #[inline]
    pub fn square(&mut self) -> Vec2 {
        if self.sobol.is_left() {
            return Vec2::new(self.uniform(), self.uniform());
        }
        let bits = self.rng.next_u64();
        Vec2::new((bits >> 40) as f32 * STEP, (bits >> 16 & 0xff_ffff) as f32 * STEP)
    }
}

const STEP: f32 = 1.0 / (1u64 << 24) as f32;

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

    /// The first numbers of 256 neighbouring points: one in each 256th of every coordinate, one in each
    /// cell of 16 x 16 of the first two; after them come those of the stream. Another sequence has
    /// other points, and so have the 65,536 that come next.
    #[test]
    fn points_are_spread_evenly() {
        let sequence = Sequence::new(1, 2, 3);
        let coordinates = |sequence, point| {
            let mut stream = Stream::new(1, 2, 3).with_sobol(sequence, point, 6);
            let six: [f32; 6] = std::array::from_fn(|_| stream.uniform());
            assert_eq!(stream.uniform(), Stream::new(1, 2, 3).uniform());
            six
        };
        let points: Vec<[f32; 6]> = (512..768).map(|point| coordinates(sequence, point)).collect();
        let cell = |x: f32, cells: usize| (x * cells as f32) as usize;
        for axis in 0..6 {
            let mut seen = [0; 256];
            points.iter().for_each(|p| seen[cell(p[axis], 256)] += 1);
            assert_eq!(seen, [1; 256], "coordinate {axis}");
        }
        let mut seen = [0; 256];
        points.iter().for_each(|p| seen[16 * cell(p[0], 16) + cell(p[1], 16)] += 1);
        assert_eq!(seen, [1; 256]);
        assert_ne!(coordinates(sequence, 0), coordinates(Sequence::new(1, 2, 4), 0));
        assert_ne!(coordinates(sequence, 0), coordinates(sequence, 1 << 16));
        // a square is two of them, a fine number starts with one
        let mut stream = Stream::new(1, 2, 3).with_sobol(sequence, 0, 3);
        let [x, y, z, ..] = coordinates(sequence, 0);
        assert_eq!(stream.square().to_array(), [x, y]);
        assert!((0.0..f64::from(STEP)).contains(&(stream.uniform_fine() - f64::from(z))));
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
