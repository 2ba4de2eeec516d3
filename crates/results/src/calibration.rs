//! The result of a calibration: plain data, in the form of its file.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::result::ByLight;

/// How the factors on the powers of lamps may differ; the simplest model comes first.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema,
)]
#[serde(rename_all = "lowercase")]
pub enum Model {
    /// One factor for all lamps and bands.
    Common,
    /// One factor for each band.
    Bands,
    /// One factor for each lamp times one for each band.
    Product,
    /// One factor for each lamp in each band.
    Lamps,
}

impl Model {
    /// All models, simplest first.
    pub const ALL: [Self; 4] = [Self::Common, Self::Bands, Self::Product, Self::Lamps];

    /// Returns the name of the model in files and options.
    pub fn name(self) -> &'static str {
        match self {
            Self::Common => "common",
            Self::Bands => "bands",
            Self::Product => "product",
            Self::Lamps => "lamps",
        }
    }
}

/// Factors on the powers of lamps, found from measured readings, and their standard errors.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct Calibration {
    /// Version of phylux that wrote the file.
    pub phylux: String,
    /// Name of the scene.
    pub scene: String,
    /// How the factors may differ.
    pub model: Model,
    /// Relative standard deviation of the factors of lamps about the common one; null where there
    /// was no prior.
    pub prior: Option<f64>,
    /// Numbers of the scene that were found besides the factors.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub varied: Vec<Varied>,
    /// Number of runs in which they were found.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub runs: Option<usize>,
    /// -2 times the logarithm of the likelihood of the fitted readings, plus the term of the prior,
    /// up to a constant. Of scenes that are compared by the same readings, the one with the smaller
    /// deviance explains them better.
    #[serde(default)]
    pub deviance: f64,
    /// Names of the bands of the scene: each list of factors has one number for each.
    pub bands: Vec<String>,
    /// Factors on the powers that the lights have in the scene, per band.
    pub factors: ByLight<Vec<f64>>,
    /// Standard errors of the factors; null for a factor that is held at 0, or that the readings do
    /// not determine.
    pub factors_se: ByLight<Vec<Option<f64>>>,
    /// Names of the bands, or sums, in which readings were taken: the lists below have one number
    /// for each.
    pub measured_bands: Vec<String>,
    /// Names of the lamps that have factors of their own: lights, or the patterns of groups of lights.
    pub lamps: Vec<String>,
    /// Covariances of the factors of all lamps in all measured bands. Rows and columns are ordered
    /// by lamp, and for each lamp by band.
    pub covariance: Vec<Vec<f64>>,
    /// Relative standard deviation of the part of the readings that the model does not explain, per
    /// measured band.
    pub residual: Vec<f64>,
    /// The models that were compared.
    pub models: Vec<ModelErrors>,
    /// For comparison: measured = slope x simulated + intercept, per measured band.
    pub slope_intercept: SlopeIntercept,
    /// For the readings that were fitted, per measured band: root of the mean squared error,
    /// divided by the mean reading.
    pub fit_rmse: Vec<Option<f64>>,
    /// The same for the readings kept for a test; null where there are none.
    pub test_rmse: Vec<Option<f64>>,
    /// Fraction of the test readings that lie in their 95 % intervals; null where there are none.
    pub test_inside: Option<f64>,
    /// Every reading.
    pub readings: Vec<ReadingResult>,
    /// What a user should know before trusting the factors.
    pub warnings: Vec<String>,
}

/// A number of the scene that was found besides the factors on the powers of its lamps.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Varied {
    /// Position of the number in the scene file, as a JSON pointer.
    pub place: String,
    /// The smallest value that was tried.
    pub from: f64,
    /// The largest value that was tried.
    pub to: f64,
    /// The value in the scene; the mean of a list.
    pub given: f64,
    /// The value that explains the readings best.
    pub value: f64,
    /// Standard error of this value; null where it is held at an end of the range, or where the
    /// readings do not determine it.
    pub standard_error: Option<f64>,
}

/// How well a model predicts readings to which it was not fitted: each block is left out in turn.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct ModelErrors {
    /// The model.
    pub model: Model,
    /// Number of parameters that are fitted.
    pub numbers: usize,
    /// Mean over the blocks of the squared relative error; null where the model cannot be fitted
    /// without a block.
    pub blocked_loss: Option<f64>,
    /// Standard error of that mean.
    pub blocked_loss_se: Option<f64>,
    /// Root of the mean squared error, divided by the mean reading, per measured band.
    pub blocked_rmse: Vec<Option<f64>>,
}

/// A straight line per measured band, by least squares.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct SlopeIntercept {
    /// Measured over simulated; null for fewer than two readings.
    pub slope: Vec<Option<f64>>,
    /// Intercept, in the unit of the readings.
    pub intercept: Vec<Option<f64>>,
    /// Root of the mean squared error, divided by the mean reading, with each block left out in
    /// turn.
    pub blocked_rmse: Vec<Option<f64>>,
    /// The same for the test readings.
    pub test_rmse: Vec<Option<f64>>,
}

/// A reading, and the calibrated simulation of it.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct ReadingResult {
    /// Id of the captor.
    pub captor: String,
    /// `front` or `back`.
    pub face: String,
    /// Name of the band or sum.
    pub band: String,
    /// `fit`, `test`, or `predict` where nothing was read.
    #[serde(rename = "use")]
    pub purpose: String,
    /// Value that the instrument read; null where the reading is only predicted.
    pub measured: Option<f64>,
    /// Value that the scene gives as it is.
    pub simulated: f64,
    /// Value that the scene gives with the factors.
    pub calibrated: f64,
    /// The 95 % interval of such a reading.
    pub interval: [f64; 2],
    /// For a fitted reading: its weight in its own prediction, in [0, 1].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub leverage: Option<f64>,
}

/// Powers of lamps that light captors evenly, or that bring each of them a least irradiance.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct EvenPowers {
    /// Version of phylux that wrote the file.
    pub phylux: String,
    /// Name of the scene.
    pub scene: String,
    /// Pattern of the captors or groups.
    pub captors: String,
    /// Number of captors that fit it.
    pub count: usize,
    /// Name of the band or sum.
    pub band: String,
    /// The mean irradiance that was asked for; null where a least one was.
    pub mean: Option<f64>,
    /// The least irradiance that was asked for; null where a mean was.
    pub minimum: Option<f64>,
    /// Names of the bands of the scene: each list of factors has one number for each.
    pub bands: Vec<String>,
    /// Factors on the powers that the lights have in the scene; the same in all bands.
    pub factors: ByLight<Vec<f64>>,
    /// How the captors were lit before.
    pub before: Lit,
    /// How the captors are lit with these factors.
    pub after: Lit,
    /// What a user should know before trusting the powers.
    pub warnings: Vec<String>,
}

/// How evenly captors are lit in one band.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct Lit {
    /// Mean irradiance, weighted by areas.
    pub mean: f64,
    /// Standard error of the value above, with errors of captors that are taken to be independent.
    pub mean_se: Option<f64>,
    /// The smallest irradiance of a captor.
    pub min: f64,
    /// Standard error of the value above: that of this captor.
    pub min_se: Option<f64>,
    /// Coefficient of variation; null where nothing arrived.
    pub cv: Option<f64>,
    /// Standard error of the value above, which includes what noise alone adds.
    pub cv_se: Option<f64>,
    /// Power of all lights, over all bands, W or umol/s.
    pub power: f64,
    /// Electric power of all lights, W, if it goes with the light; null where a light has no
    /// `watts`.
    pub watts: Option<f64>,
}
