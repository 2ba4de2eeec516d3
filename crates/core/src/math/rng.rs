//! Random streams: one for each history, from (seed, purpose, batch, history). No stream depends on
//! threads, and none is used twice, however many histories there are.

use glam::Vec2;
use rand_core::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

/// The random numbers of one history.
#[derive(Clone, Debug)]
pub struct Stream {
    rng: Xoshiro256PlusPlus,
    sobol: SobolPoint,
}

/// The purpose of random numbers. Histories of different purposes are independent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u64)]
pub enum Purpose {
    /// Histories of a run, the results of which are reported.
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
    /// Photons that measure how often light is scattered on its way.
    Bounces,
    /// Random numbers of no other purpose, such as those for the design of a sweep.
    Other,
    /// Shadow rays to the sun through the day.
    DirectSun,
    /// Photons that find the places which lamps light from close by.
    Spots,
    /// The trial that decides whether photons are guided.
    Guiding,
    /// Importons, which find where light matters to captors.
    Importons,
    /// The pilot run: photons from which it is learned how photons are to be guided.
    Pilot,
    /// Photons that find which light of the lamps matters.
    Lamps,
    /// Photons that find the light which comes by mirrors, refraction or gloss alone, for pictures.
    Focused,
    /// Photons beside the paths of a run, which find the light that these leave to them.
    Beside,
    /// Photons whose ways to chosen captors are kept.
    Histories,
    /// The choice among these ways.
    Choice,
}

/// The streams of all histories of a batch.
#[derive(Clone, Copy, Debug)]
pub struct Streams(u64);

impl Streams {
    /// Returns the streams of `batch`; there may be any number of batches. No two batches of one
    /// seed and purpose share a stream.
    #[inline]
    pub fn new(seed: u64, purpose: Purpose, batch: u64) -> Self {
        // one after the other, each time one to one, so that no bit of any of them is lost
        Self(mix(mix(mix(seed) ^ purpose as u64) ^ batch))
    }

    /// Returns the stream of a history. No other history of this batch has the same stream: the
    /// state of 256 bits holds the batch in one word, mixed one to one, and the history in another.
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

    /// Returns the Sobol sequence of a `set` of histories, such as those of one face. No other set
    /// of this batch is scrambled alike.
    #[inline]
    pub fn sequence(self, set: u64) -> Sequence {
        // not the numbers of a history
        Sequence(mix(mix(!self.0) ^ set))
    }
}

/// A Sobol sequence with a scrambling of its own.
#[derive(Clone, Copy, Debug)]
pub struct Sequence(u64);

/// How many of the first numbers of a history can be [given](Stream::with_first).
pub const FIRST: usize = 4;

/// The state of the first numbers of a history, if these are the coordinates of a point.
#[derive(Clone, Debug, Default)]
struct SobolPoint {
    point: u32,
    /// Determines how the coordinates are scrambled.
    key: u64,
    next: u32,
    end: u32,
    /// Four coordinates: they are computed four at a time, unless they are given.
    four: [f32; FIRST],
    /// Whether the coordinates were given, by [`Stream::with_first`] or [`Stream::with_even`].
    is_given: bool,
}

impl SobolPoint {
    /// Returns the next coordinate. Kept out of line, because most numbers of a photon are no
    /// coordinates.
    #[cold]
    #[inline(never)]
    fn next(&mut self) -> f32 {
        if self.next.is_multiple_of(4) && !self.is_given {
            let group = self.next / 4;
            // the crate takes 32 bits of the key; the shift of the leading digits depends on all 64
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
    /// Returns a stream for random numbers of no other purpose.
    pub fn new(seed: u64, batch: u64, history: u64) -> Self {
        Streams::new(seed, Purpose::Other, batch).history(history)
    }

    /// Returns the same stream, except that its first `numbers` numbers (at most 256) are the
    /// coordinates of a point of a Sobol sequence with Owen scrambling (Burley, JCGT 9 (4), 2020)
    /// and a random shift of the leading digits. Each coordinate is uniform by itself; those of
    /// neighbouring points are spread evenly.
    #[inline]
    pub fn with_sobol(self, sequence: Sequence, point: u64, numbers: u32) -> Self {
        // a sequence of the crate has 2^16 points
        let key = mix(sequence.0 ^ point >> 16);
        let point = point as u32 & 0xffff;
        let sobol = SobolPoint { point, key, end: numbers, ..SobolPoint::default() };
        Self { sobol, ..self }
    }

    /// Makes the next numbers these four, in [0, 1), until [`without_first`](Self::without_first).
    pub fn with_first(&mut self, four: [f32; FIRST]) {
        self.sobol =
            SobolPoint { four, end: FIRST as u32, is_given: true, ..SobolPoint::default() };
    }

    /// Makes the next `D` numbers (2 or 4) the coordinates of a point of a sequence that fills the
    /// square or the hypercube evenly, wherever it begins (Roberts, "The unreasonable effectiveness
    /// of quasirandom sequences", 2018: an additive recurrence). Each sequence begins at a random
    /// place of it, so that each coordinate is uniform by itself.
    #[inline]
    pub fn with_even<const D: usize>(&mut self, sequence: Sequence, point: u64) {
        // the powers 1 to D of the inverse of the root of x^(D + 1) = x + 1, times 2^64
        const TWO: [u64; FIRST] = [0xc13f_a9a9_02a6_328f, 0x91e1_0da5_c79e_7b1d, 0, 0];
        const FOUR: [u64; FIRST] = [
            0xdb4f_0b91_75ae_2165,
            0xbbe0_5633_03a4_615f,
            0xa0f2_ec75_a1fe_1575,
            0x89e1_8285_7d9e_d689,
        ];
        const { assert!(D == 2 || D == 4) };
        let steps = if D == 2 { TWO } else { FOUR };
        let place = sequence.0.wrapping_add(point);
        self.with_first(steps.map(|step| (place.wrapping_mul(step) >> 40) as f32 * STEP));
        self.sobol.end = D as u32;
    }

    /// Drops those of the given numbers that have not been drawn.
    pub fn without_first(&mut self) {
        self.sobol = SobolPoint::default();
    }

    /// Draws a number uniform in [0, 1), in steps of 2^-24.
    #[inline]
    pub fn uniform(&mut self) -> f32 {
        if self.sobol.is_left() {
            return self.sobol.next();
        }
        (self.rng.next_u64() >> 40) as f32 * STEP
    }

    /// Draws a number uniform in [0, 1), in steps of 2^-53, for a choice among very many.
    #[inline]
    pub fn uniform_fine(&mut self) -> f64 {
        let step = 1.0 / (1u64 << 53) as f64;
        let bits = self.rng.next_u64();
        if self.sobol.is_left() {
            // the 24 bits of the coordinate are followed by 29 bits of the stream
            return f64::from(self.sobol.next()) + (bits >> 35) as f64 * step;
        }
        (bits >> 11) as f64 * step
    }

    /// Draws a point uniform in [0, 1)^2, in steps of 2^-24.
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

/// The golden section of 2^64, rounded to an odd number.
const GAMMA: u64 = 0x9e37_79b9_7f4a_7c15;

/// Mixes 64 bits one to one (SplitMix64; Steele et al., OOPSLA 2014).
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

    /// Batches and histories up to 1e15 that could be confused if one were shifted against the
    /// other: no two of them have the same first numbers of a stream, or the same Sobol sequence,
    /// and neither has another purpose or seed. There are 6e5 of each, compared by 128 and 64 bits:
    /// odds of a false alarm 1e-8.
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

    /// A change of these numbers changes every result: it belongs in the CHANGELOG. The numbers
    /// come from a second implementation, in another language.
    #[test]
    fn stream_is_pinned() {
        let mut stream = Streams::new(1, Purpose::Run, 2).history(3);
        let step = 2f32.powi(-24);
        assert_eq!(stream.uniform(), 7_146_254.0 * step);
        assert_eq!(stream.uniform(), 15_961_196.0 * step);
        assert_eq!(stream.square().to_array(), [16_215_652.0 * step, 1_354_271.0 * step]);
        assert_eq!(stream.uniform_fine(), 4_943_204_803_373_718.0 * 2f64.powi(-53));
    }

    /// Of the first numbers of 256 neighbouring points, one lies in each 256th of every coordinate,
    /// and one in each cell of 16 x 16 of the first two coordinates. After them come the numbers of
    /// the stream. Another sequence has other points, and so have the next 65,536 points.
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
        // a square takes two coordinates, and a fine number starts with one
        let mut stream = STREAMS.history(3).with_sobol(sequence, 0, 3);
        let [x, y, z, ..] = coordinates(sequence, 0);
        assert_eq!(stream.square().to_array(), [x, y]);
        assert!((0.0..f64::from(STEP)).contains(&(stream.uniform_fine() - f64::from(z))));
    }

    /// Of 1,000 points, wherever they begin in a sequence, each of 400 rectangles of two
    /// neighbouring coordinates has as many as its area says, give or take 8 of two coordinates and
    /// 16 of four; of independent ones some would be 40 off. Every point is as likely as any other,
    /// as sequences begin anywhere. After them come the numbers of the stream.
    #[test]
    fn given_points_are_spread_evenly() {
        fn given<const D: usize>(set: u64, point: u64) -> Vec<Vec2> {
            let mut stream = STREAMS.history(3);
            stream.with_even::<D>(STREAMS.sequence(set), point);
            let point = (0..D / 2).map(|_| stream.square()).collect();
            assert_eq!(stream.uniform(), STREAMS.history(3).uniform());
            point
        }
        for (given, most) in [(given::<2> as fn(u64, u64) -> Vec<Vec2>, 8.0), (given::<4>, 16.0)] {
            for (set, first) in [(0, 0), (1, 12_345), (2, u64::MAX - 500)] {
                let points: Vec<_> = (0..1000).map(|i| given(set, first.wrapping_add(i))).collect();
                let mut corners = STREAMS.history(set);
                for i in 0..400 {
                    let [a, b] = [corners.square(), corners.square()];
                    let (low, high) = (a.min(b), a.max(b));
                    let inside = |p: &&Vec2| p.cmpge(low).all() && p.cmplt(high).all();
                    let found = points.iter().map(|point| &point[i % point.len()]).filter(inside);
                    let found = found.count() as f32;
                    let expected = 1000.0 * (high - low).element_product();
                    assert!((found - expected).abs() < most, "{set}: {found}, not {expected}");
                }
            }
            for pair in 0..given(0, 0).len() {
                let mean = (0..10_000).map(|set| given(set, 7)[pair]).sum::<Vec2>() / 10_000.0;
                assert!((mean - 0.5).abs().max_element() < 0.015, "{mean}");
            }
        }
    }

    /// The mean of the first numbers of 1e6 neighbouring histories, and the correlation of
    /// neighbours, are each within 5 standard errors (false alarm 1e-6).
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
