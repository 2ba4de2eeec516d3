//! One number per band, in a fixed number of lanes that the compiler can unroll.

use std::array;

/// One number for each of `N` bands.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spectrum<const N: usize>(pub [f32; N]);

/// The largest number of bands that one run can carry.
pub const MAX_BANDS: usize = 4096;

/// Lanes that hold `bands` bands: the least of 1, 2, 4, 8, 16, 64, 512, 4096.
pub fn lanes(bands: usize) -> usize {
    [1, 2, 4, 8, 16, 64, 512].into_iter().find(|&n| n >= bands).unwrap_or(MAX_BANDS)
}

/// Runs `$body` with the constant `$n` set to the lanes of a scene.
macro_rules! with_lanes {
    ($lanes:expr, $n:ident => $body:expr) => {
        match $lanes {
            1 => {
                const $n: usize = 1;
                $body
            }
            2 => {
                const $n: usize = 2;
                $body
            }
            4 => {
                const $n: usize = 4;
                $body
            }
            8 => {
                const $n: usize = 8;
                $body
            }
            16 => {
                const $n: usize = 16;
                $body
            }
            64 => {
                const $n: usize = 64;
                $body
            }
            512 => {
                const $n: usize = 512;
                $body
            }
            _ => {
                const $n: usize = $crate::math::spectrum::MAX_BANDS;
                $body
            }
        }
    };
}
pub(crate) use with_lanes;

impl<const N: usize> Spectrum<N> {
    /// Zero in every band.
    pub const ZERO: Self = Self([0.0; N]);
    /// One in every band.
    pub const ONE: Self = Self([1.0; N]);

    /// Reads per-band values that are padded to the scene's lanes.
    #[inline]
    pub fn load(values: &[f32]) -> Self {
        Self(array::from_fn(|b| values[b]))
    }

    /// Whether every band is zero.
    #[inline]
    pub fn is_zero(&self) -> bool {
        self.0.iter().all(|&v| v == 0.0)
    }

    /// The largest value; 0 where none is above.
    #[inline]
    pub fn largest(&self) -> f32 {
        self.0.iter().copied().fold(0.0, f32::max)
    }

    /// The largest value among the bands in which `other` is above 0; 0 where none is.
    #[inline]
    pub fn largest_within(&self, other: &Self) -> f32 {
        self.zip(*other, |value, other| if other > 0.0 { value } else { 0.0 }).largest()
    }

    /// Each band times `factor`.
    #[inline]
    pub fn scaled(self, factor: f32) -> Self {
        Self(array::from_fn(|b| self.0[b] * factor))
    }

    /// Band by band.
    #[inline]
    pub fn zip(self, other: Self, f: impl Fn(f32, f32) -> f32) -> Self {
        Self(array::from_fn(|b| f(self.0[b], other.0[b])))
    }
}

impl<const N: usize> std::ops::Mul for Spectrum<N> {
    type Output = Self;
    #[inline]
    fn mul(self, other: Self) -> Self {
        self.zip(other, |a, b| a * b)
    }
}

impl<const N: usize> std::ops::Add for Spectrum<N> {
    type Output = Self;
    #[inline]
    fn add(self, other: Self) -> Self {
        self.zip(other, |a, b| a + b)
    }
}
