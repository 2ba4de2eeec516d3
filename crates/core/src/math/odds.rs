//! Statistics of the random tests. Each assertion fails by chance with odds of about 1e-6; as every
//! seed is fixed, it fails always or never.

use std::f64::consts::TAU;

use glam::{DVec3, Vec3};

/// The standard normal deviate that is exceeded with odds of 1e-6, on one side.
const ONE_SIDED: f64 = 4.7534;
/// The standard normal deviate that is exceeded with the same odds on both sides together.
const TWO_SIDED: f64 = 4.8916;

/// Returns whether chi-square is above its 1e-6 quantile (Wilson and Hilferty, 1931).
fn is_unlikely(chi2: f64, freedom: usize) -> bool {
    let spread = 2.0 / (9.0 * freedom as f64);
    (chi2 / freedom as f64).cbrt() > 1.0 - spread + ONE_SIDED * spread.sqrt()
}

/// Tests counts against their expectations, by Pearson's test. Bins that expect fewer than 10 are
/// merged with their neighbours. The expectations must add up to the counts.
#[track_caller]
pub fn assert_counts(what: &str, observed: &[u64], expected: &[f64]) {
    let (seen, due) = (observed.iter().sum::<u64>() as f64, expected.iter().sum::<f64>());
    assert!((seen - due).abs() <= 1e-3 * due.sqrt(), "{what}: {seen} counts, {due} expected");
    let mut merged: Vec<(f64, f64)> = vec![(0.0, 0.0)];
    for (&o, &e) in observed.iter().zip(expected) {
        assert!(e >= 0.0, "{what}: {e} expected");
        if merged[merged.len() - 1].1 >= 10.0 {
            merged.push((0.0, 0.0));
        }
        let last = merged.len() - 1;
        merged[last].0 += o as f64;
        merged[last].1 += e;
    }
    if merged.len() > 1 && merged[merged.len() - 1].1 < 10.0 {
        let (o, e) = merged.pop().unwrap();
        let last = merged.len() - 1;
        merged[last].0 += o;
        merged[last].1 += e;
    }
    let freedom = merged.len() - 1;
    assert!(freedom > 0, "{what}: a single bin tests nothing");
    let chi2: f64 = merged.iter().map(|(o, e)| (o - e).powi(2) / e).sum();
    assert!(!is_unlikely(chi2, freedom), "{what}: chi-square {chi2:.1} for {freedom} freedoms");
}

/// Tests independent standardised deviations by chi-square.
#[track_caller]
pub fn assert_deviations(what: &str, deviations: &[f64]) {
    let chi2: f64 = deviations.iter().map(|z| z * z).sum();
    let (n, worst) = (deviations.len(), deviations.iter().fold(0.0, |m: f64, z| m.max(z.abs())));
    assert!(!is_unlikely(chi2, n), "{what}: chi-square {chi2:.1} for {n}, worst {worst:.2} sigma");
}

/// Tests a count of `trials`, each of which succeeds with probability `chance`.
#[track_caller]
pub fn assert_shard(what: &str, count: u64, trials: u64, chance: f64) {
    let n = trials as f64;
    let (miss, sigma) = (count as f64 - n * chance, (n * chance * (1.0 - chance)).max(0.0).sqrt());
    // half a count because counts are discrete; for rare events Poisson's law
    let allowed = TWO_SIDED * sigma + if n * chance < 20.0 { 10.0 } else { 0.5 };
    assert!(miss.abs() <= allowed, "{what}: {count} of {trials}, chance {chance}");
}

/// A sample mean that is tested against its expectation.
#[derive(Clone, Copy, Debug, Default)]
pub struct Mean {
    n: f64,
    sum: f64,
    squares: f64,
}

impl Mean {
    pub fn add(&mut self, x: f64) {
        self.n += 1.0;
        self.sum += x;
        self.squares += x * x;
    }

    pub fn mean(&self) -> f64 {
        self.sum / self.n
    }

    pub fn standard_error(&self) -> f64 {
        let mean = self.mean();
        ((self.squares / self.n - mean * mean).max(0.0) / (self.n - 1.0)).sqrt()
    }

    /// Asserts that the mean is within so many standard errors, by odds of 1e-6, plus `rounding`.
    #[track_caller]
    pub fn assert(&self, what: &str, expected: f64, rounding: f64) {
        let (mean, error) = (self.mean(), self.standard_error());
        let allowed = TWO_SIDED * error + rounding;
        assert!((mean - expected).abs() <= allowed, "{what}: {mean} +- {error}, not {expected}");
    }
}

/// Bins of the sphere around an axis: rings between versines 1 - cos, cut into sectors of equal
/// azimuth.
pub struct SphereBins {
    axis: DVec3,
    across: [DVec3; 2],
    versines: Vec<f64>,
    turns: usize,
}

impl SphereBins {
    fn new(axis: Vec3, versines: Vec<f64>) -> Self {
        let axis = axis.as_dvec3().normalize();
        let (x, y) = axis.any_orthonormal_pair();
        Self { axis, across: [x, y], versines, turns: 12 }
    }

    /// Returns 20 rings of equal solid angle; the horizon is a border.
    pub fn even(axis: Vec3) -> Self {
        Self::new(axis, (0..=20).map(|i| f64::from(i) / 10.0).collect())
    }

    /// Returns rings that resolve a lobe cos^exponent around the axis, then even ones.
    pub fn lobe(axis: Vec3, exponent: f64) -> Self {
        let quantile = |missing: f64| -(missing.ln() / (exponent + 1.0)).exp_m1();
        let mut versines: Vec<f64> = (0..10).map(|i| quantile(1.0 - f64::from(i) / 10.0)).collect();
        versines.extend([1e-2, 1e-4, 1e-8].map(quantile));
        let last = versines[versines.len() - 1];
        versines.extend((1..=20).map(|i| f64::from(i) / 10.0).filter(|&v| v > last));
        Self::new(axis, versines)
    }

    pub(crate) fn len(&self) -> usize {
        (self.versines.len() - 1) * self.turns
    }

    /// Returns the index of the bin that contains a unit vector.
    pub fn index(&self, direction: Vec3) -> usize {
        let d = direction.as_dvec3();
        let versine = 0.5 * (d - self.axis).length_squared();
        let ring = self.versines.partition_point(|&v| v <= versine).clamp(1, self.rings()) - 1;
        let turn = d.dot(self.across[1]).atan2(d.dot(self.across[0])).rem_euclid(TAU) / TAU;
        ring * self.turns + ((turn * self.turns as f64) as usize).min(self.turns - 1)
    }

    fn rings(&self) -> usize {
        self.versines.len() - 1
    }

    /// Returns the integral over each bin, by the midpoint rule on 24 x 24 points.
    pub fn integrals<const K: usize>(&self, f: impl Fn(Vec3) -> [f64; K]) -> Vec<[f64; K]> {
        const STEPS: usize = 24;
        let middle = |from: f64, to: f64, i: usize| from + (to - from) * (i as f64 + 0.5) / 24.0;
        let mut integrals = Vec::with_capacity(self.len());
        for ring in self.versines.windows(2) {
            for turn in 0..self.turns {
                let turn = turn as f64;
                let mut sum = [0.0; K];
                for i in 0..STEPS {
                    let v = middle(ring[0], ring[1], i);
                    let sine = (v * (2.0 - v)).sqrt();
                    for j in 0..STEPS {
                        let phi = TAU / self.turns as f64 * middle(turn, turn + 1.0, j);
                        let (sin, cos) = phi.sin_cos();
                        let across = cos * self.across[0] + sin * self.across[1];
                        let d = (1.0 - v) * self.axis + sine * across;
                        let value = f(d.as_vec3());
                        sum.iter_mut().zip(value).for_each(|(s, x)| *s += x);
                    }
                }
                let cell = (ring[1] - ring[0]) * TAU / (self.turns * STEPS * STEPS) as f64;
                integrals.push(sum.map(|s| s * cell));
            }
        }
        integrals
    }
}

/// The tests themselves: a fair sample passes, and a sample that is wrong by a few per cent fails.
#[test]
fn tests_can_fail() {
    let expected = [10_000.0, 20_000.0, 30_000.0, 5.0, 5.0];
    assert_counts("fair", &[10_100, 19_900, 30_000, 3, 7], &expected);
    let fails = |f: &dyn Fn()| std::panic::catch_unwind(std::panic::AssertUnwindSafe(f)).is_err();
    assert!(fails(&|| assert_counts("unfair", &[10_600, 19_400, 30_000, 3, 7], &expected)));
    assert!(fails(&|| assert_shard("unfair", 10_600, 20_000, 0.5)));
    // 1e-6 quantiles of chi-square with 10, 100 and 300 degrees of freedom
    for (freedom, quantile) in [(10, 46.86), (100, 182.13), (300, 431.14)] {
        assert!(is_unlikely(1.04 * quantile, freedom) && !is_unlikely(0.96 * quantile, freedom));
    }
}
