//! Numbers as colours: a perceptual colour map and the range that it spans.

use crate::error::number;

/// The colour, sRGB, at `fraction` (drawn into 0..=1) of viridis, dark blue to yellow: even steps look
/// even, also in grey and to the colour-blind (S. van der Walt and N. Smith 2015, matplotlib; the
/// table is that of the crate colorous).
pub fn colour(fraction: f64) -> [u8; 3] {
    // a fraction that is no number counts as the least
    colorous::VIRIDIS.eval_continuous(fraction.max(0.0)).into_array()
}

/// The values that the ends of the colour map stand for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ColourRange {
    low: f64,
    high: f64,
    log: bool,
}

/// Decades that a logarithmic range spans, unless one is asked for.
const DECADES: i32 = 3;
/// Share of the values below the high end, unless one is asked for: a few bright spots would leave
/// all else dark.
const SHOWN: f64 = 0.99;

impl ColourRange {
    /// From `low` to `high`, evenly or by their logarithms. The error says what they must be.
    pub fn new(low: f64, high: f64, log: bool) -> Result<Self, String> {
        let problem = if !(low.is_finite() && high.is_finite() && low < high) {
            "two finite numbers, the lower first"
        } else if log && low <= 0.0 {
            "above 0 on a logarithmic scale"
        } else {
            return Ok(Self { low, high, log });
        };
        Err(format!("{} to {}, must be {problem}", number(low), number(high)))
    }

    /// From 0, or three decades, up to what all but 1 % of the values are below; those not above 0
    /// do not count. From 0 to 1 where there are none.
    pub fn of(values: impl Iterator<Item = f64>, log: bool) -> Self {
        let mut values: Vec<f64> = values.filter(|v| v.is_finite() && *v > 0.0).collect();
        let last = values.len().saturating_sub(1);
        let high = match values.is_empty() {
            true => 1.0,
            false => {
                let at = (SHOWN * last as f64) as usize;
                *values.select_nth_unstable_by(at, f64::total_cmp).1
            }
        };
        Self { low: if log { high * 10f64.powi(-DECADES) } else { 0.0 }, high, log }
    }

    /// The value of the first colour.
    pub fn low(&self) -> f64 {
        self.low
    }

    /// The value of the last colour.
    pub fn high(&self) -> f64 {
        self.high
    }

    /// Whether logarithms are spaced evenly.
    pub fn is_log(&self) -> bool {
        self.log
    }

    /// Where a value lies between the ends, in 0..=1.
    pub fn fraction(&self, value: f64) -> f64 {
        let fraction = match self.log {
            false => (value - self.low) / (self.high - self.low),
            true => (value / self.low).ln() / (self.high / self.low).ln(),
        };
        if fraction.is_nan() { 0.0 } else { fraction.clamp(0.0, 1.0) }
    }

    /// The colour of a value, sRGB.
    pub fn colour(&self, value: f64) -> [u8; 3] {
        colour(self.fraction(value))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_ends_are_those_of_viridis() {
        // matplotlib: #440154 and #fde725
        let ends = ([0x44, 0x01, 0x54], [0xfd, 0xe7, 0x25]);
        assert_eq!((colour(0.0), colour(1.0)), ends);
        assert_eq!((colour(-1.0), colour(2.0)), ends);
        assert_eq!(colour(f64::NAN), ends.0);
        let grey = |[r, g, b]: [u8; 3]| 2 * u32::from(r) + 5 * u32::from(g) + u32::from(b);
        let steps: Vec<u32> = (0..=32).map(|i| grey(colour(f64::from(i) / 32.0))).collect();
        assert!(steps.is_sorted(), "{steps:?}");
    }

    #[test]
    fn a_range_places_values() {
        let linear = ColourRange::new(10.0, 20.0, false).unwrap();
        assert_eq!([5.0, 10.0, 15.0, 30.0].map(|v| linear.fraction(v)), [0.0, 0.0, 0.5, 1.0]);
        let log = ColourRange::new(1.0, 100.0, true).unwrap();
        assert_eq!([-1.0, 0.0, 1.0, 10.0, 1e9].map(|v| log.fraction(v)), [0.0, 0.0, 0.0, 0.5, 1.0]);
        for (low, high, log) in
            [(1.0, 1.0, false), (2.0, 1.0, false), (0.0, 1.0, true), (f64::NAN, 1.0, false)]
        {
            assert!(ColourRange::new(low, high, log).is_err(), "{low} {high} {log}");
        }
    }

    #[test]
    fn a_chosen_range_leaves_out_the_brightest() {
        let values = (0..=200).map(|i| if i > 198 { 1e6 } else { f64::from(i) });
        assert_eq!(
            ColourRange::of(values, false),
            ColourRange { low: 0.0, high: 198.0, log: false }
        );
        let none = [0.0, -1.0, f64::NAN].into_iter();
        assert_eq!(ColourRange::of(none, false), ColourRange { low: 0.0, high: 1.0, log: false });
        let one = ColourRange::of([7.0].into_iter(), true);
        assert_eq!((one.low, one.high), (7.0 * 1e-3, 7.0));
    }
}
