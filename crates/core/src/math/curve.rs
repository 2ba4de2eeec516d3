//! Measured curves: points joined by straight lines.

use crate::error::{Problem, number};

/// A function of one variable, given by its values at rising places and linear in between.
#[derive(Clone, Debug, PartialEq)]
pub struct Curve {
    x: Vec<f64>,
    y: Vec<f64>,
}

impl Curve {
    /// Makes a curve of pairs of place and value. Errors: fewer than two points; places that do not
    /// rise.
    pub fn new(points: impl IntoIterator<Item = [f64; 2]>) -> Result<Self, Problem> {
        let (x, y): (Vec<f64>, Vec<f64>) = points.into_iter().map(|[x, y]| (x, y)).unzip();
        if x.len() < 2 {
            return Err(Problem::new(format!("{} points", x.len()), "a curve needs at least two"));
        }
        if let Some(pair) = x
            .windows(2)
            .find(|pair| pair[0].partial_cmp(&pair[1]) != Some(std::cmp::Ordering::Less))
        {
            let problem = format!("{} comes after {}", number(pair[1]), number(pair[0]));
            return Err(Problem::new(problem, "sort the points"));
        }
        Ok(Self { x, y })
    }

    /// Returns the value at a place; beyond the ends, the value at the end.
    pub fn at(&self, x: f64) -> f64 {
        let last = self.x.len() - 1;
        let i = self.x.partition_point(|&other| other <= x).clamp(1, last);
        let part = ((x - self.x[i - 1]) / (self.x[i] - self.x[i - 1])).clamp(0.0, 1.0);
        (1.0 - part) * self.y[i - 1] + part * self.y[i]
    }

    /// Returns the places of the points.
    pub fn places(&self) -> &[f64] {
        &self.x
    }

    /// Returns the first and the last place.
    pub fn range(&self) -> [f64; 2] {
        [self.x[0], self.x[self.x.len() - 1]]
    }

    /// Returns whether a spectrum reaches from one wavelength to another, nm. At either end, up to
    /// the length of its first or last step may be missing, if that is at most 10 nm or a quarter of
    /// the range; some of the range must be there.
    pub fn reaches(&self, from: f64, to: f64) -> bool {
        const LITTLE: f64 = 10.0;
        let [first, last] = self.range();
        let n = self.x.len();
        let may_miss =
            |missing: f64, step: f64| missing <= step && missing <= LITTLE.max(0.25 * (to - from));
        first < to
            && from < last
            && may_miss(first - from, self.x[1] - first)
            && may_miss(to - last, last - self.x[n - 2])
    }
}

/// Integrates over [`from`, `to`] a function that is smooth between `knots`, which may be in any
/// order. The result is exact for polynomials of degree 9 (Gauss's rule of five points).
pub fn integral(from: f64, to: f64, knots: &[f64], f: impl Fn(f64) -> f64) -> f64 {
    const POINTS: [[f64; 2]; 5] = [
        [0.0, 0.568_888_888_888_888_9],
        [0.538_469_310_105_683_1, 0.478_628_670_499_366_47],
        [-0.538_469_310_105_683_1, 0.478_628_670_499_366_47],
        [0.906_179_845_938_664, 0.236_926_885_056_189_08],
        [-0.906_179_845_938_664, 0.236_926_885_056_189_08],
    ];
    let inside = knots.iter().copied().filter(|&knot| from < knot && knot < to);
    let mut borders: Vec<f64> = [from, to].into_iter().chain(inside).collect();
    borders.sort_by(f64::total_cmp);
    let piece = |pair: &[f64]| {
        let (middle, half) = (0.5 * (pair[0] + pair[1]), 0.5 * (pair[1] - pair[0]));
        half * POINTS.iter().map(|[at, weight]| weight * f(middle + half * at)).sum::<f64>()
    };
    borders.windows(2).map(piece).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn is_linear_in_between_and_held_beyond() {
        let curve = Curve::new([[400.0, 1.0], [410.0, 3.0], [430.0, 2.0]]).unwrap();
        for (x, y) in
            [(0.0, 1.0), (400.0, 1.0), (405.0, 2.0), (420.0, 2.5), (430.0, 2.0), (1e9, 2.0)]
        {
            assert!((curve.at(x) - y).abs() < 1e-12, "{x}");
        }
        assert!(curve.reaches(390.0, 440.0));
        assert!(!curve.reaches(389.0, 440.0) && !curve.reaches(390.0, 451.0));
        // of long steps only a part may be missing, and no range lies outside
        let coarse = Curve::new([[500.0, 1.0], [600.0, 1.0], [700.0, 1.0]]).unwrap();
        assert!(coarse.reaches(490.0, 510.0) && coarse.reaches(470.0, 600.0));
        assert!(!coarse.reaches(470.0, 560.0) && !coarse.reaches(495.0, 500.0));
        assert!(!coarse.reaches(400.0, 500.0) && !coarse.reaches(650.0, 750.0));
        assert!(Curve::new([[400.0, 1.0]]).is_err());
        assert!(Curve::new([[400.0, 1.0], [400.0, 2.0]]).is_err());
        assert!(Curve::new([[400.0, 1.0], [f64::NAN, 2.0]]).is_err());
    }

    #[test]
    fn integrals_are_exact_between_knots() {
        let a = Curve::new([[0.0, 0.0], [1.0, 1.0], [3.0, 0.0]]).unwrap();
        let b = Curve::new([[0.0, 1.0], [2.0, 3.0], [3.0, 0.0]]).unwrap();
        // by hand: x (1 + x) to 1, (3 - x) / 2 (1 + x) to 2, (3 - x) / 2 3 (3 - x) to 3
        let exact = 5.0 / 6.0 + 11.0 / 6.0 + 0.5;
        let knots = [a.places(), b.places()].concat();
        assert!((integral(0.0, 3.0, &knots, |x| a.at(x) * b.at(x)) - exact).abs() < 1e-12);
    }
}
