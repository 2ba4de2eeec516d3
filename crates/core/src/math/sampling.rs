//! Samplers: from the unit square to hemisphere, cone, circle, sphere and triangle, and from
//! numbers to weighted choices. In a local frame the normal, or the axis, is along z.

use std::f32::consts::PI;

use glam::{Vec2, Vec3};

/// Returns a direction around the z axis from its versine 1 - cos(theta), which is exact for the
/// narrowest cone, and from a uniform number for its azimuth.
#[inline]
fn around_z(versine: f32, u: f32) -> Vec3 {
    let sin = (versine * (2.0 - versine)).max(0.0).sqrt();
    let turn = uniform_circle(u);
    Vec3::new(sin * turn.x, sin * turn.y, 1.0 - versine)
}

/// Draws a direction of the hemisphere with density cos(theta) / pi (Malley's method). The cosine
/// is never zero.
#[inline]
pub fn cosine_hemisphere(u: Vec2) -> Vec3 {
    let turn = u.x.sqrt() * uniform_circle(u.y);
    Vec3::new(turn.x, turn.y, (1.0 - u.x).sqrt())
}

/// Returns the density of [`cosine_hemisphere`], 1/sr.
#[inline]
pub fn cosine_hemisphere_density(cos: f32) -> f32 {
    cos.max(0.0) / PI
}

/// Draws a direction uniform in the cone whose half angle has this versine, in (0, 2]; at 2 the
/// cone is the whole sphere.
#[inline]
pub fn uniform_cone(versine: f32, u: Vec2) -> Vec3 {
    around_z(u.x * versine, u.y)
}

/// Draws a direction with density (n+1) / (2 pi) cos^n(alpha) around z (Lafortune and Willems,
/// 1994).
#[inline]
pub fn cosine_power(exponent: f32, u: Vec2) -> Vec3 {
    around_z(-((-u.x).ln_1p() / (exponent + 1.0)).exp_m1(), u.y)
}

/// Returns the density of [`cosine_power`], 1/sr, from the versine 1 - cos(alpha), because a cosine
/// is too coarse for narrow lobes. From a right angle on it is zero for every exponent.
#[inline]
pub fn cosine_power_density(exponent: f32, versine: f32) -> f32 {
    if versine >= 1.0 {
        return 0.0;
    }
    (exponent + 1.0) / (2.0 * PI) * (exponent * (-versine).ln_1p()).exp()
}

/// Draws the barycentric weights of the second and third corner, uniform over the area of a
/// triangle.
#[inline]
pub fn uniform_triangle(u: Vec2) -> Vec2 {
    let root = (1.0 - u.x).sqrt();
    Vec2::new((1.0 - u.y) * root, u.y * root)
}

/// Returns the point (cos 2 pi `u`, sin 2 pi `u`) of the unit circle, `u` in [0, 1], with an error
/// of at most 1.5e-7. If `u` is uniform, so is the point.
///
/// Both are computed from their series about the nearest quarter turn: the functions of the system
/// take longer, and give different bits on different systems.
#[inline]
pub fn uniform_circle(u: f32) -> Vec2 {
    // the sum has no room for fractions: its last bits count the quarters
    let shift = (3 << 22) as f32;
    let shifted = 4.0 * u + shift;
    let quarter = shifted.to_bits();
    let rest = 4.0 * u - (shifted - shift);
    let square = rest * rest;
    let fourth = square * square;
    let series =
        |[a, b, c, d, e]: [f32; 5]| (a + b * square) + fourth * ((c + d * square) + e * fourth);
    let (cos, sin) = (series(COSINE), rest * series(SINE));
    let (x, y) = if quarter & 1 == 0 { (cos, sin) } else { (sin, cos) };
    let sign = |bit: u32| if bit & 2 == 0 { 1.0 } else { -1.0 };
    Vec2::new(sign(quarter + 1) * x, sign(quarter) * y)
}

/// Returns the coefficient of x^n in the series of the sine or cosine of x quarter turns.
const fn series_term(n: u32) -> f32 {
    let (mut term, mut i) = (1.0, 1);
    while i <= n {
        term *= std::f64::consts::FRAC_PI_2 / i as f64;
        i += 1;
    }
    if n & 2 == 0 { term as f32 } else { -term as f32 }
}

const SINE: [f32; 5] =
    [series_term(1), series_term(3), series_term(5), series_term(7), series_term(9)];
const COSINE: [f32; 5] =
    [series_term(0), series_term(2), series_term(4), series_term(6), series_term(8)];

/// A choice among several entries, and what is left of the random number that made it.
pub struct Chosen {
    /// Index of the chosen entry.
    pub index: usize,
    /// A number that is again uniform in [0, 1), independent of the choice.
    pub rest: f32,
}

impl Chosen {
    #[inline]
    fn new(running_sums: &[f64], index: usize, target: f64) -> Self {
        let first = if index == 0 { 0.0 } else { running_sums[index - 1] };
        let rest = (target - first) / (running_sums[index] - first);
        Self { index, rest: (rest as f32).min(1.0 - f32::EPSILON / 2.0) }
    }
}

/// Returns the entry that `u` in [0, 1) chooses in proportion to weights. These are given by their
/// running sums (at least one, the last above 0).
#[inline]
pub fn weighted_choice(running_sums: &[f64], u: f64) -> Chosen {
    let last = running_sums.len() - 1;
    let target = u * running_sums[last];
    let index = running_sums.partition_point(|&sum| sum <= target).min(last);
    Chosen::new(running_sums, index, target)
}

/// Weights for random choices, with a table that says where to begin the search, so that a choice
/// among many entries takes about as long as one among few (Chen and Asau, AIIE Transactions 6,
/// 1974).
#[derive(Clone, Debug)]
pub struct Discrete {
    running_sums: Vec<f64>,
    /// The entries that the numbers i / n choose, or entries close to them.
    first: Vec<u32>,
}

impl Discrete {
    /// Prepares the table for at least one weight; the sum of the weights must be above 0.
    pub fn new(weights: impl IntoIterator<Item = f64>) -> Self {
        let mut sum = 0.0;
        let add = |weight| {
            sum += weight;
            sum
        };
        let running_sums: Vec<f64> = weights.into_iter().map(add).collect();
        let (last, mut index) = (running_sums.len() - 1, 0);
        let mut of = |i: usize| {
            let target = i as f64 / running_sums.len() as f64 * running_sums[last];
            while index < last && running_sums[index] <= target {
                index += 1;
            }
            index as u32
        };
        let first = (0..running_sums.len()).map(&mut of).collect();
        Self { running_sums, first }
    }

    /// Returns the sum of the weights.
    pub fn total(&self) -> f64 {
        self.running_sums[self.running_sums.len() - 1]
    }

    /// Chooses the same entry as [`weighted_choice`].
    #[inline]
    pub fn choose(&self, u: f64) -> Chosen {
        let sums = &self.running_sums;
        let last = sums.len() - 1;
        let target = u * sums[last];
        let mut index = self.first[((u * sums.len() as f64) as usize).min(last)] as usize;
        while index > 0 && sums[index - 1] > target {
            index -= 1;
        }
        while index < last && sums[index] <= target {
            index += 1;
        }
        Chosen::new(sums, index, target)
    }
}

/// Every chi-square test: 4e5 samples, seed 1, odds of a false alarm 1e-6.
#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{
        odds::{SphereBins, assert_counts},
        rng::Stream,
    };

    const SAMPLES: u64 = 400_000;

    fn assert_density(
        what: &str,
        bins: &SphereBins,
        sample: impl Fn(Vec2) -> Vec3,
        density: impl Fn(Vec3) -> f64,
    ) {
        let mut rng = Stream::new(1, 0, 0);
        let mut counts = vec![0; bins.len()];
        for _ in 0..SAMPLES {
            let direction = sample(rng.square());
            assert!((direction.length() - 1.0).abs() < 1e-6, "{what}: {direction}");
            counts[bins.index(direction)] += 1;
        }
        let chances = bins.integrals(|d| [density(d)]);
        let total: f64 = chances.iter().map(|[p]| p).sum();
        assert!((total - 1.0).abs() < 2e-3, "{what}: the density integrates to {total}");
        let expected: Vec<f64> = chances.iter().map(|[p]| p / total * SAMPLES as f64).collect();
        assert_counts(what, &counts, &expected);
    }

    /// Equal weights, unequal weights and weights of 0, at random numbers and next to each border.
    #[test]
    fn a_table_chooses_what_a_search_does() {
        let uneven = (0..300).map(|i| f64::from(i % 7) * f64::from(i).powi(4));
        let tiny = std::iter::once(1.0).chain([1e-30; 40]).chain([0.0, 3.0]);
        for weights in [vec![2.0], vec![0.1; 1000], uneven.collect(), tiny.collect()] {
            let table = Discrete::new(weights);
            let total = table.total();
            let borders = table.running_sums.iter().map(|sum| sum / total);
            let beside = borders.flat_map(|u| [u.next_down(), u, u.next_up()]);
            let mut rng = Stream::new(1, 0, 0);
            let random = std::iter::repeat_with(|| rng.uniform_fine()).take(10_000);
            for u in beside.filter(|u| (0.0..1.0).contains(u)).chain(random) {
                let [a, b] = [table.choose(u), weighted_choice(&table.running_sums, u)];
                assert_eq!((a.index, a.rest.to_bits()), (b.index, b.rest.to_bits()), "{u}");
            }
        }
    }

    /// 240 bins, of which the 120 below the horizon must be empty.
    #[test]
    fn cosine_hemisphere_has_its_density() {
        let density = |d: Vec3| cosine_hemisphere_density(d.z).into();
        assert_density("cosine", &SphereBins::even(Vec3::Z), cosine_hemisphere, density);
        let grazing = cosine_hemisphere(Vec2::new(1.0 - 2f32.powi(-24), 0.3));
        assert!(grazing.z > 0.0 && grazing.z < 3e-4);
    }

    /// 240 bins each; the borders of the cones are borders of bins, so that the density is exact.
    #[test]
    fn cones_are_uniform() {
        for versine in [2.0, 1.5, 1.0, 0.1] {
            let inside = 1.0 / (2.0 * std::f64::consts::PI * f64::from(versine));
            let density = |d: Vec3| if 1.0 - d.z < versine { inside } else { 0.0 };
            let bins = SphereBins::even(Vec3::Z);
            assert_density("cone", &bins, |u| uniform_cone(versine, u), density);
        }
    }

    /// Versines of narrow cones in 20 bins each. No direction is outside by more than rounding.
    #[test]
    fn narrow_cones_are_uniform() {
        for half_angle in [1e-3f64, 1e-2, 1.0].map(f64::to_radians) {
            let versine = 2.0 * (half_angle / 2.0).sin().powi(2);
            let mut rng = Stream::new(1, 0, 1);
            let mut counts = [0; 20];
            for _ in 0..SAMPLES {
                let d = uniform_cone(versine as f32, rng.square()).as_dvec3();
                let fraction = 0.5 * (d - glam::DVec3::Z).length_squared() / versine;
                assert!(fraction < 1.0 + 1e-6, "{fraction} of the versine of {half_angle}");
                counts[((20.0 * fraction) as usize).min(19)] += 1;
            }
            assert_counts("narrow cone", &counts, &[SAMPLES as f64 / 20.0; 20]);
        }
    }

    /// Up to 396 bins, which resolve the lobe.
    #[test]
    fn cosine_powers_have_their_density() {
        for exponent in [0.0, 0.3, 1.0, 10.0, 1e3, 1e6] {
            let bins = SphereBins::lobe(Vec3::Z, f64::from(exponent));
            let versine = |d: Vec3| 0.5 * d.distance_squared(Vec3::Z);
            let density = |d: Vec3| cosine_power_density(exponent, versine(d)).into();
            let what = format!("cosine to the power {exponent}");
            assert_density(&what, &bins, |u| cosine_power(exponent, u), density);
        }
    }

    /// The density in single precision equals that in double precision.
    #[test]
    fn cosine_power_density_is_exact() {
        for exponent in [0.0, 0.3, 1.0, 10.0, 1e3, 1e6, 1e9] {
            for versine in [0.0, 1e-9, 1e-7, 1e-4, 0.01, 0.5, 0.99, 1.0, 2.0f32] {
                let density = f64::from(cosine_power_density(exponent, versine));
                let (n, v) = (f64::from(exponent), f64::from(versine));
                let power = if v < 1.0 { (n * (-v).ln_1p()).exp() } else { 0.0 };
                let exact = (n + 1.0) / (2.0 * std::f64::consts::PI) * power;
                let tolerance = 1e-5 * exact + 1e-30;
                assert!((density - exact).abs() <= tolerance, "{exponent} {versine}");
            }
        }
    }

    /// 100 cells of equal area of the triangle's unit square (the complement of the first weight,
    /// squared).
    #[test]
    fn triangle_is_uniform() {
        let mut rng = Stream::new(1, 0, 2);
        let mut counts = [0; 100];
        for _ in 0..SAMPLES {
            let weights = uniform_triangle(rng.square());
            let rest = 1.0 - weights.x - weights.y;
            assert!(weights.min_element() >= 0.0 && rest >= -1e-6, "{weights}");
            // lines through the first corner, and parallel to the opposite edge, cut cells of equal
            // area
            let across = weights.x + weights.y;
            let along = if across > 0.0 { weights.y / across } else { 0.0 };
            let [row, column] = [across * across, along].map(|u| ((10.0 * u) as usize).min(9));
            counts[10 * row + column] += 1;
        }
        assert_counts("triangle", &counts, &[SAMPLES as f64 / 100.0; 100]);
    }

    /// Holds for every number that a stream can give, and for 1.
    #[test]
    fn circle_is_round() {
        for i in 0..=1 << 24 {
            let u = i as f32 / (1 << 24) as f32;
            let (sin, cos) = (2.0 * std::f64::consts::PI * f64::from(u)).sin_cos();
            let error = uniform_circle(u).as_dvec2() - glam::DVec2::new(cos, sin);
            assert!(error.abs().max_element() < 1.5e-7, "{u}: {error}");
        }
    }

    /// 36 bins.
    #[test]
    fn circle_is_uniform() {
        let mut rng = Stream::new(1, 0, 3);
        let mut counts = [0; 36];
        for _ in 0..SAMPLES {
            let p = uniform_circle(rng.uniform());
            assert!((p.length() - 1.0).abs() < 1e-6);
            let turn = p.y.atan2(p.x).rem_euclid(2.0 * PI) / (2.0 * PI);
            counts[((36.0 * turn) as usize).min(35)] += 1;
        }
        assert_counts("circle", &counts, &[SAMPLES as f64 / 36.0; 36]);
    }
}
