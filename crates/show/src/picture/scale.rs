//! Maps numbers to places on a colour bar.

use glam::Vec3;

use phylux_core::{
    error::{Error, Result, ToWords, Words, number, setting},
    words,
};

/// The scale of a colour bar: the numbers at its ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scale {
    /// The number at the lower end.
    pub low: f64,
    /// The number at the upper end, above it.
    pub high: f64,
    /// Whether equal ratios, not equal differences, are equally far apart; then both ends are above
    /// 0.
    pub log: bool,
}

/// Limit on the numbers along a bar, whatever its ends.
const MOST_TICKS: usize = 1000;

impl Scale {
    /// Makes a scale from the user's range. Error: the range is not valid.
    pub fn new(low: f64, high: f64, log: bool) -> Result<Self> {
        let wrong =
            |problem: String, remedy: Words| Err(Error::input("range", problem).remedy(remedy));
        if !(low.is_finite() && high.is_finite() && low < high) {
            let problem = format!("{} to {} is no range", number(low), number(high));
            return wrong(problem, "write the lower number first, as 0:100".to_words());
        }
        if log && low <= 0.0 {
            let problem = format!("{} has no logarithm", number(low));
            return wrong(
                problem,
                words!["with ", setting("log").on(), " both numbers must be above 0"],
            );
        }
        Ok(Self { low, high, log })
    }

    /// Chooses a scale for numbers above 0. It begins at 0, or with `log` below the lowest
    /// hundredth of the numbers, and ends at a round number with the fraction `share` of the
    /// numbers below it. 0 to 1 if no number is above 0.
    pub fn of(mut values: Vec<f64>, share: f64, log: bool) -> Self {
        values.retain(|value| value.is_finite() && *value > 0.0);
        values.sort_by(f64::total_cmp);
        let at = |share: f64| values.get((share * (values.len().max(1) - 1) as f64) as usize);
        let high = at(share).map_or(1.0, |&high| round_up(high));
        if !log {
            return Self { low: 0.0, high, log };
        }
        let low = at(0.01).map_or(0.01 * high, |&low| low.max(1e-4 * high));
        let low = 10f64.powf(low.log10().floor());
        Self { low: if low < high { low } else { 0.1 * high }, high, log }
    }

    /// Chooses a scale that holds all numbers, between round numbers. It begins at 0, so that colours
    /// compare as amounts do, unless the least number is more than half of the greatest. 0 to 1 if no
    /// number is above 0.
    pub fn around(values: impl Iterator<Item = f64>) -> Self {
        let ends = (f64::INFINITY, 0.0f64);
        let known = values.filter(|value| value.is_finite());
        let (least, most) = known.fold(ends, |(least, most), v| (least.min(v), most.max(v)));
        if most <= 0.0 {
            return Self { low: 0.0, high: 1.0, log: false };
        }
        let from = if least > 0.5 * most && least < most { least } else { 0.0 };
        // about eight steps
        let step = round_up((most - from) / 8.0);
        let [low, high] = [(from / step + 1e-9).floor(), (most / step - 1e-9).ceil()];
        Self { low: low * step, high: high * step, log: false }
    }

    /// Returns the place of a number on the bar: 0 at the lower end and below, 1 at the upper end
    /// and above.
    pub fn place(&self, value: f64) -> f64 {
        let share = if self.log {
            (value.max(f64::MIN_POSITIVE) / self.low).ln() / (self.high / self.low).ln()
        } else {
            (value - self.low) / (self.high - self.low)
        };
        share.clamp(0.0, 1.0)
    }

    /// Returns the colour of a number (viridis; Smith and van der Walt 2015), sRGB.
    pub fn colour(&self, value: f64) -> Vec3 {
        colour_at(self.place(value))
    }

    /// Returns round numbers along the bar, at most `most` or a few more.
    pub fn ticks(&self, most: usize) -> Vec<f64> {
        let most = most.max(2) as f64;
        if self.log && self.high / self.low >= 10.0 {
            let (first, last) = (self.low.log10().floor() as i32, self.high.log10().ceil() as i32);
            let decades = f64::from(last - first).max(1.0);
            let steps: &[f64] = if 3.0 * decades <= most { &[1.0, 2.0, 5.0] } else { &[1.0] };
            let every = (decades / most).ceil().max(1.0) as usize;
            let decade = |exponent: i32| steps.iter().map(move |s| s * 10f64.powi(exponent));
            return (first..=last)
                .step_by(every)
                .flat_map(decade)
                .take(MOST_TICKS)
                .filter(|t| (self.low * (1.0 - 1e-9)..=self.high * (1.0 + 1e-9)).contains(t))
                .collect();
        }
        let step = round_up((self.high - self.low) / most);
        let first = (self.low / step - 1e-9).ceil() as i64;
        let last = (self.high / step + 1e-9).floor() as i64;
        // the steps of an extreme range may vanish in rounding
        (first..=last).take(MOST_TICKS).map(|i| i as f64 * step).collect()
    }
}

/// Returns the colour at a fraction of the way along the bar.
pub(super) fn colour_at(place: f64) -> Vec3 {
    let c = colorous::VIRIDIS.eval_continuous(place);
    Vec3::new(f32::from(c.r), f32::from(c.g), f32::from(c.b)) / 255.0
}

/// Returns the least of 1, 2, 2.5, 5 or 10 times a power of ten that is not below `value`.
fn round_up(value: f64) -> f64 {
    round_up_among(&[1.0, 2.0, 2.5, 5.0], value)
}

/// Returns the least of these rising factors, the first of which is 1, times a power of ten that is
/// not below `value`.
pub(super) fn round_up_among(factors: &[f64], value: f64) -> f64 {
    let power = 10f64.powf(value.log10().floor());
    let fits = |factor: &&f64| **factor * power >= value * (1.0 - 1e-9);
    factors.iter().find(fits).copied().unwrap_or(10.0) * power
}

/// Formats a number of a bar, short.
pub(crate) fn label(value: f64) -> String {
    let magnitude = value.abs();
    if magnitude != 0.0 && !(1e-3..1e5).contains(&magnitude) {
        return format!("{:e}", (value * 1e6 / power_of(value)).round() / 1e6 * power_of(value));
    }
    let digits = format!("{value:.5}");
    digits.trim_end_matches('0').trim_end_matches('.').into()
}

fn power_of(value: f64) -> f64 {
    10f64.powf(value.abs().log10().floor())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round() {
        let labels = |low, high, log, most| -> Vec<String> {
            let scale = Scale::new(low, high, log).expect("a range");
            scale.ticks(most).into_iter().map(label).collect()
        };
        assert_eq!(labels(0.0, 100.0, false, 5), ["0", "20", "40", "60", "80", "100"]);
        assert_eq!(
            labels(0.0, 0.012, false, 6),
            ["0", "0.002", "0.004", "0.006", "0.008", "0.01", "0.012"]
        );
        assert_eq!(labels(0.1, 100.0, true, 4), ["0.1", "1", "10", "100"]);
        assert_eq!(labels(1.0, 10.0, true, 9), ["1", "2", "5", "10"]);
        assert_eq!(labels(2.0, 3.0, true, 5), ["2", "2.2", "2.4", "2.6", "2.8", "3"]);
        assert_eq!(labels(0.0, 2e7, false, 2), ["0", "1e7", "2e7"]);
    }

    #[test]
    fn a_chosen_scale_holds_nearly_all() {
        let scale = Scale::of((0..=1000).map(f64::from).chain([1e9]).collect(), 0.99, false);
        assert_eq!(scale, Scale { low: 0.0, high: 1000.0, log: false });
        assert_eq!(
            Scale::of(vec![0.0, f64::NAN], 1.0, false),
            Scale { low: 0.0, high: 1.0, log: false }
        );
        let scale = Scale::of(vec![3.0, 40.0, 700.0], 1.0, true);
        assert!(
            scale.log && scale.low <= 3.0 && scale.high >= 40.0 && scale.low > 0.0,
            "{scale:?}"
        );
        assert_eq!(scale.place(scale.low), 0.0);
        assert_eq!(scale.place(0.0), 0.0);
        assert_eq!(scale.place(1e9), 1.0);
    }

    #[test]
    fn a_scale_is_round_and_holds_all() {
        let of = |values: &[f64]| {
            let Scale { low, high, .. } = Scale::around(values.iter().copied());
            (low, high)
        };
        assert_eq!(of(&[12.0, 41.0]), (0.0, 50.0));
        assert_eq!(of(&[412.0, 1004.0]), (0.0, 1200.0));
        assert_eq!(of(&[152.0, 203.0]), (150.0, 210.0));
        assert_eq!(of(&[5.0, 5.0]), (0.0, 5.0));
        for none in [&[][..], &[0.0], &[-1.0], &[f64::NAN, f64::INFINITY]] {
            assert_eq!(of(none), (0.0, 1.0), "{none:?}");
        }
    }

    #[test]
    fn no_range_is_no_panic() {
        for (low, high, log) in [
            (1.0, 1.0, false),
            (2.0, 1.0, false),
            (f64::NAN, 1.0, false),
            (0.0, 1.0, true),
            (-1.0, 1.0, true),
        ] {
            assert!(Scale::new(low, high, log).is_err(), "{low} {high} {log}");
        }
        for (low, high) in [(1e-300, 1e300), (-1e308, 1e-308), (0.0, 5e-324)] {
            for log in [false, true] {
                if let Ok(scale) = Scale::new(low, high, log) {
                    assert!(scale.ticks(8).len() <= MOST_TICKS, "{scale:?}");
                    scale.ticks(8).into_iter().for_each(|tick| drop(label(tick)));
                }
            }
        }
    }
}
