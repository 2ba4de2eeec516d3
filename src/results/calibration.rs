//! What a calibration found: plain data, in the form of its file.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::result::ByLight;

/// How the factors on the powers of lamps may differ; simplest first.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema,
)]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
#[serde(rename_all = "lowercase")]
pub enum Model {
    /// One factor for all.
    Common,
    /// One for each band.
    Bands,
    /// One for each lamp times one for each band.
    Product,
    /// One for each lamp in each band.
    Lamps,
}

impl Model {
    /// All of them, simplest first.
    pub const ALL: [Self; 4] = [Self::Common, Self::Bands, Self::Product, Self::Lamps];

    /// Its name in files and options.
    pub fn name(self) -> &'static str {
        match self {
            Self::Common => "common",
            Self::Bands => "bands",
            Self::Product => "product",
            Self::Lamps => "lamps",
        }
    }
}

/// Factors on the powers of lamps, found from measured readings, and how sure they are.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct Calibration {
    /// Version of phylux that wrote it.
    pub phylux: String,
    /// Name of the scene.
    pub scene: String,
    /// How the factors may differ.
    pub model: Model,
    /// Relative standard deviation of the factors of lamps about the common one; null where there was no prior.
    pub prior: Option<f64>,
    /// Numbers of the scene that were found beside the factors.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub varied: Vec<Varied>,
    /// -2 times the logarithm of the likelihood of the fitted readings, with what the prior adds, but for a constant:
    /// of scenes that are compared by the same readings the one with less explains them better.
    #[serde(default)]
    pub deviance: f64,
    /// Names of the bands of the scene: each list of factors has one number for each.
    pub bands: Vec<String>,
    /// Factors on the powers that the lights have in the scene, per band.
    pub factors: ByLight<Vec<f64>>,
    /// Standard errors of these; null of one that is held at 0, or of which the points say nothing.
    pub factors_se: ByLight<Vec<Option<f64>>>,
    /// Names of the bands, or sums, in which was measured: the lists below have one number for each.
    pub measured_bands: Vec<String>,
    /// Names of the lamps that have factors of their own: lights, or the patterns of groups of lights.
    pub lamps: Vec<String>,
    /// Covariances of the factors of all lamps in all measured bands: rows and columns are lamp by lamp, and in it
    /// band by band.
    pub covariance: Vec<Vec<f64>>,
    /// Relative standard deviation of what the model does not explain, per measured band.
    pub residual: Vec<f64>,
    /// The models that were compared.
    pub models: Vec<ModelErrors>,
    /// For comparison: measured = slope x simulated + intercept, per measured band.
    pub slope_intercept: SlopeIntercept,
    /// Of the readings that were fitted, per measured band: root of the mean squared error over the mean reading.
    pub fit_rmse: Vec<Option<f64>>,
    /// The same of the readings kept for a test; null where there are none.
    pub test_rmse: Vec<Option<f64>>,
    /// The share of the test readings that lie in their 95 % intervals; null where there are none.
    pub test_inside: Option<f64>,
    /// Every reading.
    pub readings: Vec<ReadingResult>,
    /// What a user should know before trusting the factors.
    pub warnings: Vec<String>,
}

/// A number of the scene that was found beside the factors on the powers of its lamps.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Varied {
    /// Where it stands in the scene file, as JSON pointer.
    pub place: String,
    /// The least value that was tried.
    pub from: f64,
    /// The greatest.
    pub to: f64,
    /// What the scene has; of a list its mean.
    pub given: f64,
    /// What explains the readings best.
    pub value: f64,
    /// Its standard error; null where it is held at a border of the range, or the readings do not tell it.
    pub standard_error: Option<f64>,
}

/// How well a model predicts readings that it was not fitted to: each block is left out in turn.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct ModelErrors {
    /// Which.
    pub model: Model,
    /// Numbers that it fits.
    pub numbers: usize,
    /// Mean over the blocks of the squared relative error; null where the model cannot be fitted without a block.
    pub blocked_loss: Option<f64>,
    /// Standard error of that mean.
    pub blocked_loss_se: Option<f64>,
    /// Root of the mean squared error over the mean reading, per measured band.
    pub blocked_rmse: Vec<Option<f64>>,
}

/// A straight line per measured band, by least squares.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct SlopeIntercept {
    /// Measured over simulated; null of fewer than two readings.
    pub slope: Vec<Option<f64>>,
    /// In the unit of the readings.
    pub intercept: Vec<Option<f64>>,
    /// Root of the mean squared error over the mean reading, each block left out in turn.
    pub blocked_rmse: Vec<Option<f64>>,
    /// The same of the test readings.
    pub test_rmse: Vec<Option<f64>>,
}

/// A reading, and what the calibrated simulation says of it.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct ReadingResult {
    /// Id of the captor.
    pub captor: String,
    /// `front` or `back`.
    pub face: String,
    /// Band, or sum.
    pub band: String,
    /// `fit` or `test`.
    #[serde(rename = "use")]
    pub purpose: String,
    /// What the instrument read.
    pub measured: f64,
    /// What the scene gives as it is.
    pub simulated: f64,
    /// What it gives with the factors.
    pub calibrated: f64,
    /// The 95 % interval of such a reading.
    pub interval: [f64; 2],
    /// Of a fitted reading: its weight in its own prediction, in [0, 1].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub leverage: Option<f64>,
}
