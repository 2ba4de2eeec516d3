//! The random stream of one history, from (seed, purpose, batch, history): no stream depends on threads, and
//! none is used twice, however many histories there are.

use glam::Vec2;
use rand_core::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

/// The random numbers of one history.
#[derive(Clone, Debug)]
pub struct Stream {
    rng: Xoshiro256PlusPlus,
    sobol: SobolPoint,
}

/// What random numbers are for. Histories of two purposes have nothing to do with each other.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u64)]
pub enum Purpose {
    /// The histories whose results are told.
    Run,
    /// The trial that chooses an estimator or a number of photons.
    Trial,
    /// Photons that measure the light which paths cannot find.
    Unseen,
    /// Photons that find the reflectors which lamps light.
    Reflectors,
    /// The light that surfaces absorb, for pictures.
    Surfaces,
    /// The rays of a picture.
    Picture,
    /// The photons that a picture shows.
    Dots,
    /// How often light is scattered on its way.
    Bounces,
    /// Numbers that stand for themselves, as for the design of a sweep.
    Other,
    /// Shadow rays to the sun, by the hour.
    DirectSun,
    /// Photons that find what lamps light from close by.
    Spots,
    /// The trial that says whether photons are guided.
    Guiding,
    /// Importons, which find where light matters to captors.
    Importons,
    /// Photons that find what guided ones are to be guided by.
    Pilot,
    /// Photons that find which light of the lamps matters.
    Lamps,
    /// Photons that find the light which mirrors, refraction or gloss alone bring, for pictures.
    Focused,
}

/// The streams of all histories of a batch.
#[derive(Clone, Copy, Debug)]
pub struct Streams(u64);

impl Streams {
    /// Those of `batch`, any number of which there may be. Of one seed and purpose no two batches share a stream.
    #[inline]
    pub fn new(seed: u64, purpose: Purpose, batch: u64) -> Self {
        // one after the other, each time one to one: no bit of any of them is lost
        Self(mix(mix(mix(seed) ^ purpose as u64) ^ batch))
    }

    /// The stream of a history. No other history of this batch has it: its state of 256 bits holds the batch in one
    /// word, mixed one to one, and the history in another.
    #[inline]
    pub fn history(self, history: u64) -> Stream {
        let own = mix(self.0 ^ history);
        let words = [own, self.0, mix(own), mix(own.wrapping_add(GAMMA))];
        let mut state = [0; 32];
        for (bytes, word) in state.chunks_exact_mut(8).zip(words) {
            bytes.copy_from_slice(&word.to_le_bytes());
        }
        Stream { rng: Xoshiro256PlusPlus::from_seed(state), sobol: SobolPoint::default() }
    }

    /// The Sobol sequence of `set`, as a face; no other set of this batch is scrambled like it.
    #[inline]
    pub fn sequence(self, set: u64) -> Sequence {
        // not the numbers of a history
        Sequence(mix(mix(!self.0) ^ set))
    }
}

/// A Sobol sequence; each has a scrambling of its own.
#[derive(Clone, Copy, Debug)]
pub struct Sequence(u64);

/// First numbers of a history that can be [given](Stream::with_first).
pub const FIRST: usize = 4;

/// What is left of the first numbers of a history, where these are the coordinates of a point.
#[derive(Clone, Debug, Default)]
struct SobolPoint {
    point: u32,
    /// How its coordinates are scrambled.
    key: u64,
    next: u32,
    end: u32,
    /// Coordinates are made four at a time ...
    four: [f32; FIRST],
    /// ... unless they are given.
    is_given: bool,
}

impl SobolPoint {
    /// Out of the way of photons, which have none.
    #[cold]
    #[inline(never)]
    fn next(&mut self) -> f32 {
        if self.next.is_multiple_of(4) && !self.is_given {
            let group = self.next / 4;
            // the crate takes 32 bits of the key: the shift of the leading digits depends on all
            let four = sobol_burley::sample_4d(self.point, group, self.key as u32);
            let shift = mix(self.key ^ u64::from(group));
            self.four = std::array::from_fn(|i| {
                let leading = (shift >> (16 * i) & 0xffff) as u32;
                ((four[i] / STEP) as u32 ^ (leading << 8)) as f32 * STEP
            });
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
    /// A stream for whoever needs random numbers of no run's purpose.
    pub fn new(seed: u64, batch: u64, history: u64) -> Self {
        Streams::new(seed, Purpose::Other, batch).history(history)
    }

    /// The same, but its first `numbers` (at most 256) are the coordinates of a point of a Sobol
    /// sequence with Owen scrambling (Burley, JCGT 9 (4), 2020) and a random shift of the leading digits. Each is
    /// uniform by itself; those of neighbouring points are spread evenly.
    #[inline]
    pub fn with_sobol(self, sequence: Sequence, point: u64, numbers: u32) -> Self {
        // a sequence of the crate has 2^16 points
        let key = mix(sequence.0 ^ point >> 16);
        let point = point as u32 & 0xffff;
        let sobol = SobolPoint { point, key, end: numbers, ..SobolPoint::default() };
        Self { sobol, ..self }
    }

    /// The next numbers are these, in [0, 1), until [`without_first`](Self::without_first).
    pub fn with_first(&mut self, four: [f32; FIRST]) {
        self.sobol =
            SobolPoint { four, end: FIRST as u32, is_given: true, ..SobolPoint::default() };
    }

    /// Drops those that are left of them.
    pub fn without_first(&mut self) {
        self.sobol = SobolPoint::default();
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

/// The golden section of 2^64, odd.
const GAMMA: u64 = 0x9e37_79b9_7f4a_7c15;

/// A one-to-one mix of 64 bits (SplitMix64; Steele et al., OOPSLA 2014).
#[inline]
fn mix(mut z: u64) -> u64 {
    z = z.wrapping_add(GAMMA);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

#[cfg(test)]
mod tests {
    use std::collections::HashSet;

    use super::*;

    const STREAMS: Streams = Streams(0x0123_4567_89ab_cdef);

    /// Batches and histories that a shift of one beside the other would mistake for each other, up to 1e15: no two
    /// have the same first numbers of a stream, or of a Sobol sequence, nor has any another purpose or seed. 6e5
    /// of each, compared by 128 and 64 bits: odds of a false alarm 1e-8.
    #[test]
    fn no_stream_is_used_twice() {
        let powers = (0..=50).flat_map(|bits| [(1 << bits) - 1, 1 << bits, (1 << bits) + 1]);
        let edges: Vec<u64> = powers.chain([u64::MAX, 999_999_999_999_999]).collect();
        let numbers: HashSet<u64> =
            edges.into_iter().chain(1_000_000_000_000_000 - 200..).take(400).collect();
        let of = |seed, purpose| {
            let streams = numbers.iter().map(move |&batch| Streams::new(seed, purpose, batch));
            streams.flat_map(|streams| numbers.iter().map(move |&number| (streams, number)))
        };
        let runs =
            [(1, Purpose::Run), (1, Purpose::Trial), (1, Purpose::Unseen), (2, Purpose::Run)];
        let all = || runs.into_iter().flat_map(|(seed, purpose)| of(seed, purpose));
        let expected = runs.len() * numbers.len() * numbers.len();
        let first = |(streams, history): (Streams, u64)| {
            let mut rng = streams.history(history).rng;
            (rng.next_u64(), rng.next_u64())
        };
        assert_eq!(all().map(first).collect::<HashSet<_>>().len(), expected);
        let sequence = |(streams, set): (Streams, u64)| {
            let Sequence(key) = streams.sequence(set);
            key
        };
        assert_eq!(all().map(sequence).collect::<HashSet<_>>().len(), expected);
        // the 65,536 points of a sequence are scrambled anew each time, in their leading digits too
        let point = |point: u64| {
            let mut stream = STREAMS.history(0).with_sobol(STREAMS.sequence(0), point << 16, 8);
            std::array::from_fn::<u32, 8, _>(|_| stream.uniform().to_bits())
        };
        let points: HashSet<_> =
            numbers.iter().filter(|n| **n < 1 << 48).map(|n| point(*n)).collect();
        assert_eq!(points.len(), numbers.iter().filter(|n| **n < 1 << 48).count());
    }

    /// A change of these numbers moves every result: it belongs in the CHANGELOG. They are those of
    /// a second implementation, in another language.
    #[test]
    fn stream_is_pinned() {
        let mut stream = Streams::new(1, Purpose::Run, 2).history(3);
        let step = 2f32.powi(-24);
        assert_eq!(stream.uniform(), 7_146_254.0 * step);
        assert_eq!(stream.uniform(), 15_961_196.0 * step);
        assert_eq!(stream.square().to_array(), [16_215_652.0 * step, 1_354_271.0 * step]);
        assert_eq!(stream.uniform_fine(), 4_943_204_803_373_718.0 * 2f64.powi(-53));
    }

    /// The first numbers of 256 neighbouring points: one in each 256th of every coordinate, one in each
    /// cell of 16 x 16 of the first two; after them come those of the stream. Another sequence has
    /// other points, and so have the 65,536 that come next.
    #[test]
    fn points_are_spread_evenly() {
        let sequence = STREAMS.sequence(3);
        let coordinates = |sequence, point| {
            let mut stream = STREAMS.history(3).with_sobol(sequence, point, 6);
            let six: [f32; 6] = std::array::from_fn(|_| stream.uniform());
            assert_eq!(stream.uniform(), STREAMS.history(3).uniform());
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
        assert_ne!(coordinates(sequence, 0), coordinates(STREAMS.sequence(4), 0));
        assert_ne!(coordinates(sequence, 0), coordinates(sequence, 1 << 16));
        // a square is two of them, a fine number starts with one
        let mut stream = STREAMS.history(3).with_sobol(sequence, 0, 3);
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
