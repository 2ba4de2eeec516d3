//! How the histories of a task are shared among the lights.

use std::collections::BinaryHeap;

use super::{Light, Start};
use crate::math::{
    geometry::Ray,
    rng::{Stream, Streams},
    spectrum::{Lanes, Spectrum},
};

#[cfg(test)]
mod tests;

/// Returns the number of strata of all lights, at least 1. Each needs at least one history.
pub fn sources(lights: &[Light]) -> usize {
    lights.iter().map(Light::sources).sum::<usize>().max(1)
}

/// A photon as it leaves its light.
pub struct Emission<'a, L> {
    /// Index of the light.
    pub light: usize,
    /// Index of its stratum, over all lights.
    pub source: usize,
    /// Mean power of the photons of its stratum per lane, times the number of histories of the
    /// task, W or umol/s.
    pub weights: &'a [f64],
    /// Ray along which it starts.
    pub ray: Ray,
    /// Place of the light that it starts from, or `None` for a light at infinity.
    pub start: Option<Start>,
    /// Index of the face by which it enters, for a light at infinity.
    pub face: usize,
    /// Power at the start, as a fraction of `weights`: 1, or 0 in bands that the light does not
    /// emit. It has other values where the bands of a light at infinity come from different
    /// directions.
    pub power: Spectrum<L>,
}

/// Division of the histories of a task among the lights: which history belongs to which light, and
/// the power that it carries. A light at infinity has one stratum for each face by which it enters;
/// any other light is one stratum.
#[derive(Clone, Debug)]
pub struct Strata {
    /// Light of each stratum, and the index of the stratum within that light.
    sources: Vec<(usize, usize)>,
    /// First rank of each stratum, followed by the number of histories.
    first: Vec<u64>,
    stride: u64,
    /// Power of a photon times the number of histories of the task, for each stratum and lane.
    weights: Vec<f64>,
    lanes: usize,
}

impl Strata {
    /// Shares `histories` (at least one for each of its strata) in proportion to the largest
    /// band power of each stratum, but gives each at least 1 % / number of strata.
    pub fn new(lights: &[Light], histories: u64, lanes: usize) -> Self {
        Self::shared(lights, histories, lanes, None)
    }

    /// Shares the histories like [`new`](Self::new), but in proportion to `shares`, one for each
    /// stratum, if they are given.
    pub fn shared(lights: &[Light], histories: u64, lanes: usize, shares: Option<&[f64]>) -> Self {
        let mut sources: Vec<(usize, usize)> = Vec::with_capacity(lights.len());
        for (l, light) in lights.iter().enumerate() {
            sources.extend((0..light.sources()).map(|source| (l, source)));
        }
        Self::of(lights, sources, histories, lanes, shares)
    }

    /// Shares `histories` (at least one for each of its strata) among the strata of one light
    /// alone, like [`new`](Self::new).
    pub fn of_light(lights: &[Light], light: usize, histories: u64, lanes: usize) -> Self {
        let sources = (0..lights[light].sources()).map(|source| (light, source));
        let mut strata = Self::of(lights, sources.collect(), histories, lanes, None);
        // a light without any stratum is dark
        strata.sources[0].0 = light;
        strata
    }

    /// Shares `photons` among lights that are traced one by one: at least `least` for each of their
    /// strata, and the rest in proportion like [`new`](Self::new).
    pub fn photons_of_lights(lights: &[Light], photons: u64, least: u64) -> Vec<u64> {
        let strata = lights.iter().map(|light| light.sources().max(1) as u64);
        let least: Vec<u64> = strata.map(|strata| least * strata).collect();
        let largest = |light: &Light| {
            let of = |source| light.source_power(source).iter().copied().fold(0.0, f64::max);
            (0..light.sources()).map(of).sum()
        };
        let powers: Vec<f64> = lights.iter().map(largest).collect();
        let rest = photons.saturating_sub(least.iter().sum());
        // none is given less than its least for the sake of another
        let more = match rest >= lights.len() as u64 {
            true => apportion(&powers, rest),
            false => vec![0; lights.len()],
        };
        least.iter().zip(more).map(|(least, more)| least + more).collect()
    }

    /// Shares histories among these strata.
    fn of(
        lights: &[Light],
        mut sources: Vec<(usize, usize)>,
        histories: u64,
        lanes: usize,
        shares: Option<&[f64]>,
    ) -> Self {
        let powers = sources.iter().map(|&(l, source)| lights[l].source_power(source));
        let powers: Vec<&[f64]> = powers.collect();
        // one stratum without power where no light has any stratum
        if sources.is_empty() {
            sources.push((0, 0));
        }
        let counts = match powers.is_empty() {
            true => vec![histories],
            false => {
                let largest = powers.iter().map(|power| power.iter().copied().fold(0.0, f64::max));
                let largest: Vec<f64> = largest.collect();
                apportion(shares.unwrap_or(&largest), histories)
            }
        };
        let mut first = vec![0];
        let mut weights = vec![0.0; sources.len() * lanes];
        for s in 0..sources.len() {
            first.push(first[s] + counts[s]);
            for (b, power) in powers.get(s).copied().unwrap_or_default().iter().enumerate() {
                weights[s * lanes + b] = power * (histories as f64 / counts[s] as f64);
            }
        }
        Self { sources, first, stride: golden_stride(histories), weights, lanes }
    }

    /// Returns the same strata for a task whose sums are divided by `number`, and not by the number
    /// of its photons.
    pub fn divided_by(mut self, number: u64) -> Self {
        let factor = number as f64 / self.histories() as f64;
        self.weights.iter_mut().for_each(|weight| *weight *= factor);
        self
    }

    /// Returns the number of histories.
    pub fn histories(&self) -> u64 {
        self.first[self.first.len() - 1]
    }

    /// Returns the stratum of history `index`.
    #[inline]
    pub fn source(&self, index: u64) -> usize {
        self.place(index).0
    }

    /// Returns the stratum of history `index`, and its number among those of the stratum. The ranks
    /// follow a golden-ratio sequence, so that any run of neighbouring histories has nearly the share
    /// of each stratum.
    #[inline]
    fn place(&self, index: u64) -> (usize, u64) {
        // the product of two indices below 2^32 fits; beyond, 128 bits hold it
        let rank = match index.checked_mul(self.stride) {
            Some(product) => product % self.histories(),
            None => {
                let product = u128::from(index) * u128::from(self.stride);
                (product % u128::from(self.histories())) as u64
            }
        };
        let source = self.first.partition_point(|&first| first <= rank) - 1;
        (source, rank - self.first[source])
    }

    /// Makes the first numbers of history `index` those of a sequence that is spread
    /// [evenly](Stream::with_even) over the histories of a stratum in all tasks of a batch: where
    /// its photon enters, or where and whereto a lamp emits it. `before` is the number of histories
    /// of the batch before this task.
    #[inline]
    pub fn spread(
        &self,
        lights: &[Light],
        index: u64,
        before: u64,
        streams: Streams,
        rng: &mut Stream,
    ) {
        let (source, number) = self.place(index);
        let own = self.first[source + 1] - self.first[source];
        // tasks share the stratum as the histories, but for fractions of one
        let earlier = (before as f64 * own as f64 / self.histories() as f64) as u64;
        let (sequence, point) = (streams.sequence(source as u64), earlier + number);
        match lights[self.sources[source].0].entrance() {
            Some(_) => rng.with_even::<2>(sequence, point),
            None => rng.with_even::<4>(sequence, point),
        }
    }

    /// Emits history `index`.
    #[inline(always)]
    pub fn emit<L: Lanes>(
        &self,
        lights: &[Light],
        index: u64,
        rng: &mut Stream,
    ) -> Emission<'_, L> {
        self.emit_of(lights, self.source(index), rng)
    }

    /// Emits a history of the stratum `source`.
    #[inline(always)]
    fn emit_of<L: Lanes>(
        &self,
        lights: &[Light],
        source: usize,
        rng: &mut Stream,
    ) -> Emission<'_, L> {
        let (light, face) = self.sources[source];
        let weights = self.weights(source);
        let mut power = Spectrum::<L>::splat(self.lanes, 0.0);
        for (power, weight) in power.0.values_mut().iter_mut().zip(weights) {
            *power = f32::from(*weight > 0.0);
        }
        let (start, ray, power) = match lights[light].entrance() {
            Some(entrance) if entrance.faces() > 0 => {
                let (ray, factor) = entrance.enter(face, rng);
                (None, ray, power * factor)
            }
            Some(_) => (None, lights[light].emit(rng), power),
            None => {
                let (start, ray) = lights[light].emit_from(rng);
                (Some(start), ray, power)
            }
        };
        Emission { light, source, weights, ray, start, face, power }
    }

    /// Returns the power of a photon of the stratum `source` per lane, times the number of
    /// histories of the task, W or umol/s.
    #[inline]
    pub fn weights(&self, source: usize) -> &[f64] {
        &self.weights[source * self.lanes..][..self.lanes]
    }

    /// Returns the largest power of a photon of the stratum `source` in a band, times the number of
    /// histories of the task, W or umol/s.
    pub fn most(&self, lights: &[Light], source: usize, band: usize) -> f64 {
        let (light, face) = self.sources[source];
        let entrance = lights.get(light).and_then(Light::entrance).filter(|e| e.faces() > 0);
        let factor = entrance.map_or(1.0, |entrance| entrance.largest_factor(face, band));
        self.weights(source)[band] * factor
    }

    /// Returns the number of strata.
    pub fn sources(&self) -> usize {
        self.sources.len()
    }

    /// Returns whether the light of the stratum `source` is that of a point, a line or the sun,
    /// which no path meets by chance.
    pub fn is_delta(&self, lights: &[Light], source: usize) -> bool {
        let (light, face) = self.sources[source];
        match lights[light].entrance() {
            Some(entrance) => entrance.faces() > 0 && entrance.is_sun(face),
            None => lights[light].is_delta(),
        }
    }

    /// Returns whether the light of the stratum `source` is that of a sun at infinity.
    pub fn is_sun(&self, lights: &[Light], source: usize) -> bool {
        let (light, face) = self.sources[source];
        let entrance = lights.get(light).and_then(Light::entrance);
        entrance.is_some_and(|entrance| entrance.faces() > 0 && entrance.is_sun(face))
    }
}

/// Divides the histories into whole numbers in proportion to the powers, by largest remainders.
/// Each number is at least one, and each share at least 1 % / number of powers.
fn apportion(powers: &[f64], histories: u64) -> Vec<u64> {
    let total: f64 = powers.iter().sum();
    let least = 0.01 / powers.len() as f64;
    let shares: Vec<f64> = powers
        .iter()
        .map(|power| if total > 0.0 { (power / total).max(least) } else { 1.0 })
        .collect();
    let scale = histories as f64 / shares.iter().sum::<f64>();
    let mut counts: Vec<u64> =
        shares.iter().map(|share| ((share * scale).floor() as u64).max(1)).collect();
    let remainder = |counts: &[u64], l: usize| shares[l] * scale - counts[l] as f64;
    let mut rest = histories as i64 - counts.iter().sum::<u64>() as i64;
    let mut order: Vec<usize> = (0..powers.len()).collect();
    order.sort_by(|&a, &b| remainder(&counts, b).total_cmp(&remainder(&counts, a)));
    for &l in order.iter().cycle() {
        if rest <= 0 {
            break;
        }
        counts[l] += 1;
        rest -= 1;
    }
    // the minimum of one may have given out too many: the largest numbers give back
    let mut largest: BinaryHeap<(u64, usize)> =
        counts.iter().enumerate().map(|(l, &count)| (count, l)).collect();
    for _ in rest..0 {
        let mut top = largest.peek_mut().expect("there is a light");
        top.0 -= 1;
        counts[top.1] -= 1;
    }
    counts
}

/// Returns the first number, from the golden section of `n` upwards, that has no common divisor
/// with `n`.
fn golden_stride(n: u64) -> u64 {
    let golden = (n as f64 * 0.618_033_988_749_895) as u64;
    let coprime = |&k: &u64| gcd(k, n) == 1;
    (golden.max(1)..=n.max(1)).find(coprime).unwrap_or(1)
}

fn gcd(a: u64, b: u64) -> u64 {
    if b == 0 { a } else { gcd(b, a % b) }
}
