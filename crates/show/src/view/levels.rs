//! Encodes values as levels of a logarithmic scale, in one byte or two.

use serde_json::{Value, json};

/// A logarithmic scale: level 0 is 0, level 1 the least value that is distinguished from 0, the
/// last level the greatest value.
pub struct Levels {
    most: f32,
    /// Natural logarithm of the ratio of the greatest value to the least.
    span: f32,
    last: u16,
}

impl Levels {
    /// Makes a scale of two bytes, accurate to 0.02 %, over nearly eight decades up to `most`.
    pub fn fine(most: f32) -> Self {
        Self { most, span: 18.0, last: u16::MAX }
    }

    /// Makes a scale of one byte, over four decades up to `most`, accurate to a relative `error`.
    /// The error is at least 2 %, and an `error` above 5 % counts as 5 %.
    pub fn coarse(most: f32, error: f32) -> Self {
        let span = 9.21;
        let steps = (0.5 * span / error.min(0.05)).ceil().min(f32::from(u8::MAX - 1));
        Self { most, span, last: 1 + steps as u16 }
    }

    /// Returns whether a level fits into one byte.
    pub fn is_byte(&self) -> bool {
        self.last <= u16::from(u8::MAX)
    }

    pub fn level(&self, value: f32) -> u16 {
        let fraction = 1.0 + (value / self.most).ln() / self.span;
        let steps = f32::from(self.last - 1);
        // NaN and values that are too small become 0
        if fraction > 0.0 { (1.0 + fraction.min(1.0) * steps).round() as u16 } else { 0 }
    }

    pub fn facts(&self) -> Value {
        json!({ "most": self.most, "span": self.span, "last": self.last })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn levels_are_as_near_as_they_say() {
        let coarse = |error| Levels::coarse(50.0, error);
        for (levels, near, least) in [
            (Levels::fine(50.0), 0.0002, 1e-6),
            (coarse(0.0), 0.0185, 0.006),
            (coarse(0.04), 0.0408, 0.006),
            (coarse(0.5), 0.0513, 0.006),
        ] {
            // as data.js reads them
            let value = |level: u16| {
                let share = f32::from(level - 1) / f32::from(levels.last - 1) - 1.0;
                50.0 * (levels.span * share).exp()
            };
            for value_in in (0..2000).map(|i| 50.0 * 0.99f32.powi(i)).take_while(|v| *v > least) {
                let out = value(levels.level(value_in));
                assert!((out / value_in - 1.0).abs() < near, "{value_in} {out}");
            }
            assert_eq!(levels.level(50.0), levels.last);
            assert_eq!(levels.level(60.0), levels.last);
            assert_eq!([0.0, f32::NAN, 1e-9].map(|v| levels.level(v)), [0; 3]);
        }
    }
}
