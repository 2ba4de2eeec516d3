//! From block sums to a mean and its standard error.

/// Running sum, sum of squares and largest of equally weighted block estimates that are not negative.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Running {
    sum: f64,
    squares: f64,
    largest: f64,
}

impl Running {
    /// Adds one block's estimate; blocks that are never added count as zero.
    #[inline]
    pub fn add(&mut self, x: f64) {
        self.sum += x;
        self.squares += x * x;
        self.largest = self.largest.max(x);
    }

    /// Mean over `blocks` blocks and, from two blocks on, its standard error (1 sigma).
    pub fn estimate(&self, blocks: u64) -> Estimate {
        let n = blocks as f64;
        let mean = self.sum / n;
        let spread = (self.squares / n - mean * mean).max(0.0);
        Estimate { mean, standard_error: (blocks > 1).then(|| (spread / (n - 1.0)).sqrt()) }
    }

    /// The part of the squared deviations from the mean that the largest of `blocks` blocks makes
    /// up, in [0, 1]: about 0.06 of 128 normal ones; where it is large, the standard error rests on
    /// what few blocks have found.
    pub fn concentration(&self, blocks: u64) -> f64 {
        let mean = self.sum / blocks as f64;
        let squares = self.squares - self.sum * mean;
        if squares > 0.0 { ((self.largest - mean).powi(2) / squares).min(1.0) } else { 0.0 }
    }
}

/// A mean with its standard error.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// The mean over blocks.
    pub mean: f64,
    /// Standard deviation of that mean; none where it cannot be known (one block).
    pub standard_error: Option<f64>,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mean_and_standard_error_of_known_numbers() {
        let mut running = Running::default();
        [1.0, 2.0, 3.0, 6.0].into_iter().for_each(|x| running.add(x));
        let estimate = running.estimate(4);
        // deviations -2, -1, 0, 3: variance of the mean 14 / (4 x 3)
        assert_eq!(estimate.mean, 3.0);
        assert!((estimate.standard_error.unwrap() - (14.0f64 / 12.0).sqrt()).abs() < 1e-12);
        assert!((running.concentration(4) - 9.0 / 14.0).abs() < 1e-12);
        assert_eq!(running.estimate(1).standard_error, None);
        assert_eq!((running.concentration(1), Running::default().concentration(4)), (0.0, 0.0));
    }
}
