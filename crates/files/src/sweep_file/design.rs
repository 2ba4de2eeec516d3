//! Designs: which values of the parameters go together. Every point of a design holds one value of
//! each parameter.

use serde_json::Value;

use super::format::{SampleKind, Whole};
use phylux_core::math::rng::Stream;

/// The largest number of dimensions of a Sobol sequence.
pub const SOBOL_DIMENSIONS: usize = 256;
/// The largest number of points of a Sobol sequence.
pub const SOBOL_POINTS: usize = 1 << 16;

/// The values that a parameter may take.
#[derive(Clone, Debug, PartialEq)]
pub enum Choices {
    /// One of the listed values.
    Listed(Vec<Value>),
    /// Any number between two limits; only designs that draw samples allow it.
    Between(f64, f64),
}

/// For each point, the index of the value of each parameter.
pub type Points = Vec<Vec<u32>>;

/// Returns the points of a design that uses all listed values. `lengths` holds the number of values
/// of each parameter, at least 1, and must give fewer than 2^32 points. In a grid, the last
/// parameter changes first.
pub fn whole(combine: Whole, lengths: &[usize]) -> Points {
    match combine {
        Whole::Zip => (0..lengths[0]).map(|i| vec![i as u32; lengths.len()]).collect(),
        Whole::Grid => {
            let points: usize = lengths.iter().product();
            let point = |mut index: usize| {
                let mut digits: Vec<u32> = lengths
                    .iter()
                    .rev()
                    .map(|length| {
                        let digit = index % length;
                        index /= length;
                        digit as u32
                    })
                    .collect();
                digits.reverse();
                digits
            };
            (0..points).map(point).collect()
        }
    }
}

/// Returns, for each of `dimensions` parameters, `count` numbers in [0, 1).
pub fn sample(kind: SampleKind, count: usize, dimensions: usize, seed: u32) -> Vec<Vec<f64>> {
    let all = 0..dimensions as u32;
    match kind {
        SampleKind::Sobol => {
            let one = |d: u32, i: u32| f64::from(sobol_burley::sample(i, d, seed));
            all.map(|d| (0..count as u32).map(|i| one(d, i)).collect()).collect()
        }
        SampleKind::LatinHypercube => {
            all.map(|d| latin(count, &mut Stream::new(seed.into(), d.into(), 0))).collect()
        }
    }
}

/// Returns one number in each of `count` equal parts of [0, 1), in random order.
fn latin(count: usize, stream: &mut Stream) -> Vec<f64> {
    let mut parts: Vec<usize> = (0..count).collect();
    // the shuffle of Fisher and Yates
    for i in (1..count).rev() {
        parts.swap(i, (stream.uniform_fine() * (i + 1) as f64) as usize);
    }
    parts.iter().map(|part| (*part as f64 + stream.uniform_fine()) / count as f64).collect()
}

/// Returns the value at the fraction `u`, 0 to 1, of the way between two limits.
pub fn between(from: f64, to: f64, u: f64) -> Value {
    number(match u {
        0.0 => from,
        1.0 => to,
        // multiply each limit by itself, because their difference may be infinite
        _ => round(from * (1.0 - u) + to * u),
    })
}

/// Returns `steps` values at equal distances, including both limits.
pub fn steps(from: f64, to: f64, steps: usize) -> Vec<Value> {
    let last = steps.saturating_sub(1).max(1);
    (0..steps).map(|i| between(from, to, i as f64 / last as f64)).collect()
}

/// Rounds a value to 12 digits, so that it is 0.075 and not 0.07500000000000001.
pub fn round(value: f64) -> f64 {
    let rounded: f64 = format!("{value:.11e}").parse().unwrap_or(value);
    if rounded.is_finite() { rounded } else { value }
}

/// Returns a finite number in its shortest form, 40 and not 40.0, so that both count as the same
/// value.
pub fn number(value: f64) -> Value {
    match value.fract() == 0.0 && value.abs() < 9e15 {
        true => (value as i64).into(),
        false => value.into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_grid_has_every_pair_and_a_zip_only_equals() {
        let grid = [[0, 0], [0, 1], [0, 2], [1, 0], [1, 1], [1, 2]];
        assert_eq!(whole(Whole::Grid, &[2, 3]), grid);
        assert_eq!(whole(Whole::Zip, &[2, 2]), [[0, 0], [1, 1]]);
    }

    #[test]
    fn steps_are_short_numbers() {
        let words = |from, to, n| {
            steps(from, to, n).iter().map(Value::to_string).collect::<Vec<_>>().join(" ")
        };
        assert_eq!(words(0.05, 0.15, 5), "0.05 0.075 0.1 0.125 0.15");
        assert_eq!(words(0.0, 350.0, 36).split(' ').nth(35), Some("350"));
        assert_eq!(words(1.0, -1.0, 3), "1 0 -1");
        assert_eq!(
            words(-f64::MAX, f64::MAX, 3),
            "-1.7976931348623157e+308 0 1.7976931348623157e+308"
        );
    }

    /// Each of 64 equal parts of every parameter's range is used once, in a different order for
    /// each parameter. The seeds 1 and 2 are fixed, so the test does not depend on chance.
    #[test]
    fn samples_fill_every_part_once() {
        for kind in [SampleKind::Sobol, SampleKind::LatinHypercube] {
            let columns = sample(kind, 64, 5, 1);
            for column in &columns {
                let mut parts: Vec<usize> = column.iter().map(|u| (u * 64.0) as usize).collect();
                parts.sort();
                assert_eq!(parts, (0..64).collect::<Vec<_>>(), "{kind:?}");
            }
            assert_ne!(columns[0], columns[1]);
            assert_eq!(columns, sample(kind, 64, 5, 1));
            assert_ne!(columns, sample(kind, 64, 5, 2));
        }
    }

    /// In the plane of the first two parameters, a Sobol sequence of 64 points has 1 point in each
    /// of 8 x 8 boxes; a Latin hypercube need not.
    #[test]
    fn sobol_points_are_even_in_the_plane() {
        let columns = sample(SampleKind::Sobol, 64, 2, 7);
        let mut boxes: Vec<usize> = columns[0]
            .iter()
            .zip(&columns[1])
            .map(|(x, y)| (x * 8.0) as usize * 8 + (y * 8.0) as usize)
            .collect();
        boxes.sort();
        assert_eq!(boxes, (0..64).collect::<Vec<_>>());
    }
}
