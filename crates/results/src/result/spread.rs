//! How evenly the captors of a group are lit: smallest and largest irradiance, and uniformity.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::FaceResult;
use phylux_core::math::stats::least_of_normals;

/// How evenly a group is lit, per band. Values are null where nothing arrived, standard errors
/// where one is not known.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct Uniformity {
    /// The smallest irradiance of a captor divided by the mean of the group, in [0, 1].
    pub min_over_mean: Vec<Option<f64>>,
    /// Standard error of the value above. It includes the amount by which noise alone makes the
    /// value smaller.
    pub min_over_mean_se: Vec<Option<f64>>,
    /// Coefficient of variation: the standard deviation of the captors' irradiances, weighted by
    /// their areas, divided by the mean.
    pub cv: Vec<Option<f64>>,
    /// Standard error of the value above. It includes the amount by which noise alone makes the
    /// value larger.
    pub cv_se: Vec<Option<f64>>,
}

/// A value with its standard error, if that is known; `None` where nothing arrived.
pub type Found = Option<(f64, Option<f64>)>;

/// The faces of a group's captors with the captors' areas, m2.
#[derive(Clone, Debug, Default)]
pub struct Spread<'a>(Vec<(&'a FaceResult, f64)>);

impl<'a> Spread<'a> {
    /// Adds the face of a captor with this area, m2.
    pub fn add(&mut self, face: &'a FaceResult, area: f64) {
        self.0.push((face, area));
    }

    /// Returns the face of the group, to which the values that only several captors have are added.
    pub fn on(&self, face: FaceResult) -> FaceResult {
        if self.0.len() < 2 {
            return face;
        }
        let bands = 0..face.irradiance.len();
        let members: Vec<Members> = bands
            .clone()
            .map(|band| {
                let member = |(face, area): &(&FaceResult, f64)| Member {
                    value: face.irradiance[band],
                    error: face.irradiance_se[band],
                    area: *area,
                };
                Members::of(self.0.iter().map(member).collect())
            })
            .collect();
        let columns = |of: &dyn Fn(usize) -> Found| {
            bands.clone().map(of).map(|found| (found.map(|f| f.0), found.and_then(|f| f.1))).unzip()
        };
        let (min_over_mean, min_over_mean_se) =
            columns(&|b| members[b].min_over_mean(face.irradiance_se[b]));
        let (cv, cv_se) = columns(&|b| members[b].cv());
        let end = |of: fn(f64, f64) -> f64| {
            let values = |m: &Members| m.all.iter().map(|member| member.value).reduce(of);
            Some(Box::new(members.iter().filter_map(values).collect()))
        };
        FaceResult {
            min: end(f64::min),
            max: end(f64::max),
            uniformity: Some(Uniformity { min_over_mean, min_over_mean_se, cv, cv_se }.into()),
            ..face
        }
    }
}

/// How evenly captors are lit in a band: mean, smallest value and coefficient of variation, each
/// with its standard error.
pub struct Evenness {
    /// Mean irradiance, weighted by areas.
    pub mean: (f64, Option<f64>),
    /// The smallest irradiance of a captor.
    pub min: (f64, Option<f64>),
    /// Coefficient of variation; `None` where nothing arrived.
    pub cv: Found,
}

impl Evenness {
    /// Finds it from the irradiance of each captor, its standard error and its area; `None` for no
    /// captor. The errors are taken to be independent.
    pub fn of(captors: impl Iterator<Item = (f64, Option<f64>, f64)>) -> Option<Self> {
        let member = |(value, error, area)| Member { value, error, area };
        let members = Members::of(captors.map(member).collect());
        let least = members.all.iter().min_by(|a, b| a.value.total_cmp(&b.value))?;
        let variances = members.all.iter().map(|m| {
            let error = m.error.or((m.value == 0.0).then_some(0.0))?;
            Some((m.area / members.area * error).powi(2))
        });
        let error = variances.sum::<Option<f64>>().map(f64::sqrt);
        Some(Self {
            mean: (members.mean, error),
            min: (least.value, least.error),
            cv: members.cv(),
        })
    }
}

/// A captor of a group, in a band.
#[derive(Clone, Copy)]
struct Member {
    /// Irradiance, W/m2 or umol/m2/s.
    value: f64,
    error: Option<f64>,
    area: f64,
}

/// The captors of a group, in a band. Their errors are assumed to be independent.
struct Members {
    all: Vec<Member>,
    area: f64,
    mean: f64,
    /// Variance of the irradiances as they were found, weighted by areas.
    variance: f64,
    /// The part of this variance that is noise, according to the standard errors.
    noise: f64,
}

impl Members {
    fn of(all: Vec<Member>) -> Self {
        let area: f64 = all.iter().map(|m| m.area).sum();
        let mean_of =
            |of: &dyn Fn(&Member) -> f64| all.iter().map(|m| m.area / area * of(m)).sum::<f64>();
        let mean = mean_of(&|m| m.value);
        let variance = mean_of(&|m| (m.value - mean).powi(2));
        // the mean takes up a part of its captors' noise
        let noise = mean_of(&|m| (1.0 - m.area / area) * m.error.unwrap_or(0.0).powi(2));
        Self { all, area, mean, variance, noise }
    }

    /// Returns the smallest value over the mean, and its standard error to first order. Where
    /// several captors may be the smallest, noise chooses among them and makes the smallest value
    /// too small. The amount is estimated from above: as if all captors that are within two
    /// standard errors of the difference were truly equal.
    fn min_over_mean(&self, mean_se: Option<f64>) -> Found {
        let least = self.all.iter().min_by(|a, b| a.value.total_cmp(&b.value))?;
        let ratio = (self.mean > 0.0).then(|| least.value / self.mean)?;
        let error = least.error.zip(mean_se).map(|(least_se, mean_se)| {
            let errors = self.all.iter().filter_map(|m| Some((m.value, m.error?)));
            let rivals =
                errors.filter(|(value, se)| value - least.value <= 2.0 * se.hypot(least_se));
            let [bias, variance] = least_of_normals(rivals.map(|(_, error)| [0.0, error]));
            // the smallest value is a part of the mean
            let common = 2.0 * (least.area / self.area) * variance * ratio;
            let variance = variance + (ratio * mean_se).powi(2) - common + bias * bias;
            variance.max(0.0).sqrt() / self.mean
        });
        Some((ratio, error))
    }

    /// Returns the standard deviation s over the mean m, and its standard error. To first order a
    /// captor with irradiance E and the fraction w of the area moves the quotient by w ((E - m) /
    /// (s m) - s / m²) per unit of E. Noise alone adds its own variance to s².
    fn cv(&self) -> Found {
        let deviation = self.variance.sqrt();
        let cv = (self.mean > 0.0).then(|| deviation / self.mean)?;
        let errors: Option<Vec<f64>> = self
            .all
            .iter()
            .map(|m| {
                let error = m.error.or((m.value == 0.0).then_some(0.0))?;
                let by_spread = if deviation > 0.0 {
                    (m.value - self.mean) / deviation / self.mean
                } else {
                    0.0
                };
                let by_mean = cv / self.mean;
                Some(m.area / self.area * error * (by_spread - by_mean))
            })
            .collect();
        let error = errors.map(|errors| {
            let moved = errors.iter().map(|error| error * error).sum::<f64>().sqrt();
            // the variance of a number of noises varies itself
            let freedom = (self.all.len() as f64 - 1.0).max(1.0);
            let noise = self.noise * (1.0 + (2.0 / freedom).sqrt());
            let without_noise = (self.variance - noise).max(0.0).sqrt() / self.mean;
            moved.hypot(cv - without_noise)
        });
        Some((cv, error))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use phylux_core::math::rng::Stream;

    fn members(values: &[[f64; 3]]) -> Members {
        let member = |[value, error, area]: &[f64; 3]| Member {
            value: *value,
            error: Some(*error),
            area: *area,
        };
        Members::of(values.iter().map(member).collect())
    }

    /// Known numbers: 1, 2, 3 with areas 1, 1, 2, without noise.
    #[test]
    fn spread_of_known_numbers() {
        let known = members(&[[1.0, 0.0, 1.0], [2.0, 0.0, 1.0], [3.0, 0.0, 2.0]]);
        assert_eq!(known.mean, 2.25);
        assert_eq!(known.min_over_mean(Some(0.0)), Some((1.0 / 2.25, Some(0.0))));
        let (cv, error) = known.cv().unwrap();
        // (1.25² + 0.25² + 2 x 0.75²) / 4 = 0.6875
        assert!((cv - 0.6875f64.sqrt() / 2.25).abs() < 1e-14);
        assert!(error.unwrap() < 1e-7);
        assert_eq!(members(&[[0.0, 0.0, 1.0]; 2]).cv(), None);
    }

    /// Deviations from the truth over the standard errors that are reported for them: the root mean
    /// square over 4000 repetitions with normal noise (seed 6), for groups from uneven to perfectly
    /// even ones. For a normal deviation it is 1, with a standard deviation of 0.011; as deviations
    /// may be mostly bias, and errors are to first order, 0.5 to 1.3 is allowed.
    #[test]
    fn errors_are_those_of_repetitions() {
        let uneven = vec![8.0, 9.5, 10.0, 11.0, 12.0];
        let slightly: Vec<f64> = (0..36).map(|i| 10.0 + 0.03 * f64::from(i % 6)).collect();
        let mut rng = Stream::new(6, 0, 0);
        for (truth, noise) in [
            (uneven.clone(), 0.01),
            (uneven, 0.1),
            (slightly.clone(), 0.002),
            (slightly, 0.05),
            (vec![10.0; 36], 0.05),
            (vec![10.0; 400], 0.02),
        ] {
            let exact: Vec<[f64; 3]> = truth.iter().map(|value| [*value, 0.0, 1.0]).collect();
            let exact = members(&exact);
            let exact = [exact.min_over_mean(Some(0.0)), exact.cv()].map(|found| found.unwrap().0);
            let mut squares = [0.0; 2];
            for _ in 0..4000 {
                let values: Vec<[f64; 3]> = truth
                    .iter()
                    .map(|value| {
                        // the sum of 12 uniform numbers minus 6 has variance 1
                        let normal = (0..12).map(|_| f64::from(rng.uniform())).sum::<f64>() - 6.0;
                        [value * (1.0 + noise * normal), noise * value, 1.0]
                    })
                    .collect();
                let n = truth.len() as f64;
                let mean_se = truth.iter().map(|v| (noise * v).powi(2)).sum::<f64>().sqrt() / n;
                let found = members(&values);
                let found = [found.min_over_mean(Some(mean_se)), found.cv()];
                for ((found, exact), squares) in found.iter().zip(exact).zip(&mut squares) {
                    let (value, error) = found.unwrap();
                    *squares += ((value - exact) / error.unwrap()).powi(2) / 4000.0;
                }
            }
            for deviation in squares.map(f64::sqrt) {
                assert!((0.5..1.3).contains(&deviation), "{noise}: {squares:?}");
            }
        }
    }
}
