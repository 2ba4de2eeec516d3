//! Spectra: one number per band. Few bands are stored in a fixed number of lanes, over which the
//! compiler can unroll loops; many bands are stored in memory that is used again and again.

use std::{array, cell::RefCell, fmt::Debug, mem, ops};

/// One number for each band of a scene, and 0 in the lanes beyond them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spectrum<L>(pub L);

/// The largest number of bands that one run can carry.
pub const MAX_BANDS: usize = 4096;

/// Storage for the numbers of a spectrum.
pub trait Lanes: Clone + Debug + PartialEq + 'static {
    /// Makes a spectrum with the value of `f` in each lane. There are `lanes` lanes, unless the
    /// type has a fixed number.
    fn from_fn(lanes: usize, f: impl FnMut(usize) -> f32) -> Self;

    /// Returns the numbers in order.
    fn values(&self) -> &[f32];

    /// Returns the numbers in order, to be changed.
    fn values_mut(&mut self) -> &mut [f32];
}

impl<const N: usize> Lanes for [f32; N] {
    #[inline]
    fn from_fn(_: usize, f: impl FnMut(usize) -> f32) -> Self {
        array::from_fn(f)
    }

    #[inline]
    fn values(&self) -> &[f32] {
        self
    }

    #[inline]
    fn values_mut(&mut self) -> &mut [f32] {
        self
    }
}

/// Any number of lanes. The memory of a dropped spectrum is kept for the next one of the same
/// thread, so that the loops of photons and paths allocate nothing.
#[derive(Debug, PartialEq)]
pub struct Wide(Vec<f32>);

thread_local! {
    static FREE: RefCell<Vec<Vec<f32>>> = const { RefCell::new(Vec::new()) };
}

impl Wide {
    /// Returns an empty vector, with the memory of a dropped spectrum if there is any.
    #[inline]
    fn empty() -> Vec<f32> {
        FREE.with_borrow_mut(Vec::pop).unwrap_or_default()
    }
}

impl Lanes for Wide {
    #[inline]
    fn from_fn(lanes: usize, f: impl FnMut(usize) -> f32) -> Self {
        let mut values = Self::empty();
        values.extend((0..lanes).map(f));
        Self(values)
    }

    #[inline]
    fn values(&self) -> &[f32] {
        &self.0
    }

    #[inline]
    fn values_mut(&mut self) -> &mut [f32] {
        &mut self.0
    }
}

impl Clone for Wide {
    #[inline]
    fn clone(&self) -> Self {
        let mut values = Self::empty();
        values.extend_from_slice(&self.0);
        Self(values)
    }
}

impl Drop for Wide {
    #[inline]
    fn drop(&mut self) {
        let mut values = mem::take(&mut self.0);
        values.clear();
        // a thread that ends no longer needs the memory
        let _ = FREE.try_with(|free| free.borrow_mut().push(values));
    }
}

/// Returns the number of lanes for `bands` bands: the smallest of 1, 4 and 16 that holds them; for
/// more bands, their number.
pub fn lanes(bands: usize) -> usize {
    [1, 4, 16].into_iter().find(|&n| n >= bands).unwrap_or(bands)
}

/// Runs `$body` with the type `$l` set to the lanes of a scene.
#[macro_export]
macro_rules! with_lanes {
    ($lanes:expr, $l:ident => $body:expr) => {
        match $lanes {
            1 => {
                type $l = [f32; 1];
                $body
            }
            4 => {
                type $l = [f32; 4];
                $body
            }
            16 => {
                type $l = [f32; 16];
                $body
            }
            _ => {
                type $l = $crate::math::spectrum::Wide;
                $body
            }
        }
    };
}
pub use crate::with_lanes;

/// Returns the largest number; 0 if none is above 0. The bits of numbers above 0, read as integers,
/// have the same order as the numbers, and those of numbers below 0 are below 0: integers, unlike
/// numbers, are compared lane by lane at once, because their order leaves nothing open.
#[inline]
fn largest(values: impl Iterator<Item = f32>) -> f32 {
    let bits = values.fold(0, |most, value| most.max(value.to_bits().cast_signed()));
    f32::from_bits(bits.cast_unsigned())
}

impl<L: Lanes> Spectrum<L> {
    /// Makes a spectrum with the value of `f` in each of `lanes` lanes.
    #[inline]
    pub fn from_fn(lanes: usize, f: impl FnMut(usize) -> f32) -> Self {
        Self(L::from_fn(lanes, f))
    }

    /// Makes a spectrum with the same value in each of `lanes` lanes.
    #[inline]
    pub fn splat(lanes: usize, value: f32) -> Self {
        Self::from_fn(lanes, |_| value)
    }

    /// Makes a spectrum from one value per lane.
    #[inline]
    pub fn load(values: &[f32]) -> Self {
        Self::from_fn(values.len(), |b| values[b])
    }

    /// Returns the numbers, lane by lane.
    #[inline]
    pub fn values(&self) -> &[f32] {
        self.0.values()
    }

    /// Returns zero in each lane.
    #[inline]
    pub fn zero(&self) -> Self {
        Self::splat(self.values().len(), 0.0)
    }

    /// Returns whether every number is zero.
    #[inline]
    pub fn is_zero(&self) -> bool {
        self.values().iter().all(|&v| v == 0.0)
    }

    /// Returns the largest number; 0 if none is above 0.
    #[inline]
    pub fn largest(&self) -> f32 {
        largest(self.values().iter().copied())
    }

    /// Returns the largest number among the bands in which `other` is above 0; 0 if there is none.
    #[inline]
    pub fn largest_within(&self, other: &Self) -> f32 {
        let both = self.values().iter().zip(other.values());
        largest(both.map(|(&v, &o)| if o > 0.0 { v } else { 0.0 }))
    }

    /// Applies `f` to each number.
    #[inline]
    pub fn map(mut self, f: impl Fn(f32) -> f32) -> Self {
        self.0.values_mut().iter_mut().for_each(|v| *v = f(*v));
        self
    }

    /// Multiplies each number by `factor`.
    #[inline]
    pub fn scaled(self, factor: f32) -> Self {
        self.map(|v| v * factor)
    }

    /// Combines the two spectra by `f`, band by band.
    #[inline]
    pub fn zip(mut self, other: &Self, f: impl Fn(f32, f32) -> f32) -> Self {
        let values = self.0.values_mut().iter_mut().zip(other.values());
        values.for_each(|(v, o)| *v = f(*v, *o));
        self
    }
}

impl<L: Lanes> ops::Mul<&Self> for Spectrum<L> {
    type Output = Self;
    #[inline]
    fn mul(self, other: &Self) -> Self {
        self.zip(other, |a, b| a * b)
    }
}

impl<L: Lanes> ops::Add<&Self> for Spectrum<L> {
    type Output = Self;
    #[inline]
    fn add(self, other: &Self) -> Self {
        self.zip(other, |a, b| a + b)
    }
}

impl<L: Lanes> ops::Mul for Spectrum<L> {
    type Output = Self;
    #[inline]
    fn mul(self, other: Self) -> Self {
        self * &other
    }
}

impl<L: Lanes> ops::Add for Spectrum<L> {
    type Output = Self;
    #[inline]
    fn add(self, other: Self) -> Self {
        self + &other
    }
}

impl<L: Lanes> ops::MulAssign<&Self> for Spectrum<L> {
    #[inline]
    fn mul_assign(&mut self, other: &Self) {
        for (value, other) in self.0.values_mut().iter_mut().zip(other.0.values()) {
            *value *= other;
        }
    }
}

impl<L: Lanes> ops::MulAssign<f32> for Spectrum<L> {
    #[inline]
    fn mul_assign(&mut self, factor: f32) {
        for value in self.0.values_mut() {
            *value *= factor;
        }
    }
}

impl<L: Lanes> ops::AddAssign for Spectrum<L> {
    #[inline]
    fn add_assign(&mut self, other: Self) {
        let values = self.0.values_mut().iter_mut().zip(other.values());
        values.for_each(|(v, o)| *v += o);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every number of bands up to 4096 has lanes; above 16 bands no lane is idle.
    #[test]
    fn every_number_of_bands_has_lanes() {
        let of: Vec<usize> = (1..=MAX_BANDS).map(lanes).collect();
        assert_eq!(of[..6], [1, 4, 4, 4, 16, 16]);
        assert!((17..=MAX_BANDS).all(|bands| of[bands - 1] == bands));
    }

    /// Wide spectra give the same numbers as those in fixed lanes, and reuse the memory of a
    /// dropped one.
    #[test]
    fn wide_spectra_are_like_others() {
        fn both<L: Lanes>() -> Vec<f32> {
            let a = Spectrum::<L>::from_fn(4, |b| b as f32);
            let b = Spectrum::<L>::load(&[2.0, 0.0, 0.5, 1.0]);
            let sum = a.clone() * &b + a.zero().map(|v| v + 1.0).scaled(0.5);
            let mut values = sum.values().to_vec();
            values.extend([a.largest(), a.largest_within(&b), b.largest_within(&a)]);
            values
        }
        assert_eq!(both::<[f32; 4]>(), both::<Wide>());
        let first = Wide::from_fn(100, |_| 1.0);
        let place = first.0.as_ptr();
        drop(first);
        let second = Wide::from_fn(100, |_| 2.0);
        assert_eq!((second.0.as_ptr(), second.values()), (place, &[2.0; 100][..]));
    }
}
