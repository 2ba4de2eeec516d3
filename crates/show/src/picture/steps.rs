//! The steps of a colour bar, at whose ends numbers and contours stand.

use super::scale::{Scale, round_up_among};

/// Steps are round numbers: where the number of colours limits them, and where errors do, which are
/// to cost no more colours than they must.
const ROUND: [f64; 3] = [1.0, 2.0, 5.0];
const ROUGH: [f64; 9] = [1.0, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0];
/// Numbers and contours are apart by one of these, if that is at most so many times what is asked for,
/// or else by so many steps, or ten times as many and so on.
const ROUNDEST: [f64; 4] = [1.0, 2.0, 2.5, 5.0];
const FARTHER: f64 = 2.0;
const TOGETHER: [f64; 4] = [1.0, 2.0, 4.0, 5.0];

/// A linear scale in steps, each of one colour.
#[derive(Clone, Debug, PartialEq)]
pub struct Steps {
    /// The first and the last end.
    pub scale: Scale,
    /// The ends of all steps, one more than there are.
    pub ends: Vec<f64>,
    /// The length of each but the outermost, which may be up to twice as long.
    step: f64,
}

impl Steps {
    /// Chooses a scale that holds all numbers as [`Scale::around`] does, in steps that are round
    /// numbers: at most `most`, and none finer than `finest`.
    pub fn around(values: impl Iterator<Item = f64>, most: usize, finest: f64) -> Self {
        let values: Vec<f64> = values.filter(|value| value.is_finite()).collect();
        let scale = Scale::around(values.iter().copied());
        let least = values.iter().copied().fold(f64::INFINITY, f64::min);
        let greatest = values.into_iter().fold(0.0, f64::max);
        if greatest <= 0.0 {
            return Self::of(scale, most, 0.0);
        }
        let from = if scale.low > 0.0 { least } else { 0.0 };
        // the ends of the steps may lie beyond the values by nearly a step on either side
        let step = step((greatest - from) / (most as f64 - 1.5), finest);
        let low = (from / step + 1e-9).floor();
        let high = (greatest / step - 1e-9).ceil().max(low + 1.0);
        Self::cut(Scale { low: low * step, high: high * step, log: false }, step)
    }

    /// Cuts a scale into at most `most` steps, none finer than `finest`, but into one at least. They
    /// end at multiples of their length, or where the scale ends.
    pub fn of(scale: Scale, most: usize, finest: f64) -> Self {
        Self::cut(scale, step((scale.high - scale.low) / most as f64, finest))
    }

    fn cut(scale: Scale, step: f64) -> Self {
        let Scale { low, high, .. } = scale;
        let first = (low / step + 1.0 - 1e-9).ceil();
        let inner = (0..).map(|i| (first + f64::from(i)) * step);
        let mut ends = vec![low];
        ends.extend(inner.take_while(|end| *end <= high - step * (1.0 - 1e-9)));
        ends.push(high);
        Self { scale, ends, step }
    }

    /// Returns the middle of each step.
    pub fn middles(&self) -> Vec<f64> {
        self.ends.windows(2).map(|ends| 0.5 * (ends[0] + ends[1])).collect()
    }

    /// Returns the number of the step in which a value lies, of an outermost one beyond the ends.
    pub fn at(&self, value: f64) -> usize {
        self.ends.partition_point(|end| *end <= value).clamp(1, self.ends.len() - 1) - 1
    }

    /// Returns ends of steps at multiples of a length that is `least` or more.
    pub fn ends_apart(&self, least: f64) -> Vec<f64> {
        let least = least.max(self.step);
        let is_round = |every: &i64| {
            let length = self.step * *every as f64;
            (round_up_among(&ROUNDEST, length) / length - 1.0).abs() < 1e-9
        };
        let [from, to] = [least, FARTHER * least].map(|length| length / self.step - 1e-9);
        let mut round = (from.ceil() as i64..=to as i64).filter(is_round);
        let steps = || round_up_among(&TOGETHER, least / self.step).round() as i64;
        let length = self.step * round.next().unwrap_or_else(steps) as f64;
        let is_multiple = |end: &&f64| (**end / length - (**end / length).round()).abs() < 1e-6;
        self.ends.iter().filter(is_multiple).copied().collect()
    }
}

/// Returns the length of steps that are no finer than two numbers: the one that leaves few enough of
/// them, and the other that errors allow.
fn step(fewest: f64, finest: f64) -> f64 {
    match finest > fewest && finest.is_finite() {
        true => round_up_among(&ROUGH, finest),
        false => round_up_among(&ROUND, fewest),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Steps are round numbers not below the finest, hold all values, and are one at least.
    #[test]
    fn steps_are_round_and_not_too_fine() {
        let of = |values: &[f64], finest: f64| {
            let Steps { scale, ends, .. } = Steps::around(values.iter().copied(), 32, finest);
            (scale.low, scale.high, ends.len() - 1)
        };
        assert_eq!(of(&[412.0, 1004.0], 0.0), (0.0, 1050.0, 21));
        assert_eq!(of(&[412.0, 1004.0], 45.0), (0.0, 1050.0, 21));
        assert_eq!(of(&[152.0, 203.0], 0.24), (152.0, 204.0, 26));
        assert_eq!(of(&[4.0, 61.0], 10.6), (0.0, 75.0, 5));
        assert_eq!(of(&[418.0, 436.0], 14.0), (405.0, 450.0, 3));
        assert_eq!(of(&[418.0, 436.0], 3000.0), (0.0, 3000.0, 1));
        for none in [&[][..], &[0.0], &[f64::NAN]] {
            assert_eq!(of(none, 1.0), (0.0, 1.0, 20), "{none:?}");
        }
        let cut = |low: f64, high: f64, finest: f64| {
            let scale = Scale::new(low, high, false).expect("a range");
            Steps::of(scale, 32, finest).ends
        };
        assert_eq!(cut(0.0, 100.0, 0.0).len(), 21);
        assert_eq!(cut(0.0, 1.0, 9.0), [0.0, 1.0]);
        assert_eq!(cut(0.0, 31.7, 6.0), [0.0, 6.0, 12.0, 18.0, 24.0, 31.7]);
        assert_eq!(cut(3.5, 20.0, 2.9), [3.5, 9.0, 12.0, 15.0, 20.0]);
        for (low, high) in [(-1e308, 1e308), (1e300, 2e300), (1.0, 1.0 + 1e-15), (0.0, 5e-324)] {
            let scale = Scale { low, high, log: false };
            assert!(Steps::of(scale, 32, 0.0).ends.len() < 100, "{low} {high}");
        }
    }

    /// Numbers and contours stand where colours change, at round numbers.
    #[test]
    fn numbers_stand_at_ends_of_steps() {
        let steps = Steps::around([152.0, 203.0].into_iter(), 32, 0.0);
        assert_eq!(steps.ends_apart(8.0), [160.0, 170.0, 180.0, 190.0, 200.0]);
        assert_eq!(steps.ends_apart(0.0).len(), 27);
        assert_eq!(steps.ends_apart(3.0)[..2], [152.0, 156.0]);
        let odd = Steps::of(Scale::new(0.3, 10.1, false).expect("a range"), 5, 0.0);
        assert_eq!(odd.ends_apart(4.0), [4.0, 8.0]);
        assert_eq!([steps.at(152.5), steps.at(154.0), steps.at(1e9), steps.at(0.0)], [0, 1, 25, 0]);
    }
}
