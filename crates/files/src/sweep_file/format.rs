//! The sweep file as it is written: the types that its JSON is read into and that its schema is
//! made of.

use indexmap::IndexMap;
use schemars::JsonSchema;
use serde::Deserialize;
use serde_json::Value;

use crate::{json::one_of, scene_file::Count};

/// A phylux sweep: one scene, run with several values of some of its numbers.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SweepFile {
    /// Place of the schema, for editors; phylux does not read it.
    #[serde(rename = "$schema")]
    pub _schema: Option<String>,
    /// The scene file, relative to this one.
    pub scene: String,
    /// The values that vary: each key is a JSON pointer into the scene (`/lights/0/power`), or a
    /// name with `at`; each value lists the values to run.
    #[schemars(extend("minProperties" = 1))]
    pub vary: IndexMap<String, VaryFile>,
    /// How the values of several parameters are combined (default grid).
    #[serde(default)]
    pub combine: CombineFile,
    /// Number of runs of each combination, with the scene's seed and the numbers after it (default
    /// 1).
    #[schemars(range(min = 1))]
    pub seeds: Option<Count>,
}

/// The values of one parameter.
#[derive(Debug, JsonSchema)]
#[schemars(untagged)]
pub enum VaryFile {
    /// The values in order: numbers, texts, arrays, ...
    List(Vec<Value>),
    /// An object with every key that a parameter may have.
    Full(FullFile),
}

/// The values of one parameter: `values`, or `from` and `to`.
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FullFile {
    /// JSON pointers to all the places in the scene that take the value.
    pub at: Option<Vec<String>>,
    /// The values.
    pub values: Option<Vec<Value>>,
    /// The first value.
    pub from: Option<f64>,
    /// The last value.
    pub to: Option<f64>,
    /// How many values, at equal distances from `from` to `to`; a sample needs no steps and takes
    /// any values between them.
    #[schemars(range(min = 2))]
    pub steps: Option<Count>,
}

one_of! {
    VaryFile: "an array of values, or an object with `values` or `from` and `to`",
    list(values) => VaryFile::List(values),
    object(full) => VaryFile::Full(full),
}

/// How the values of several parameters are combined.
#[derive(Clone, Copy, Debug, JsonSchema)]
#[schemars(untagged)]
pub enum CombineFile {
    /// `grid` or `zip`.
    Whole(Whole),
    /// Points spread over all parameters at once.
    Sample(SampleFile),
}

impl Default for CombineFile {
    fn default() -> Self {
        Self::Whole(Whole::Grid)
    }
}

/// Designs that use all values.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Whole {
    /// Each value is combined with each value of the other parameters.
    Grid,
    /// The first values of all parameters go together, then the second values, ...
    Zip,
}

/// Points spread over all parameters at once.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SampleFile {
    /// How the points are spread.
    pub sample: SampleKind,
    /// Number of points.
    #[schemars(range(min = 1))]
    pub count: Count,
    /// Seed of the random numbers of the sample (default 1).
    pub seed: Option<u32>,
}

/// How the points of a sample are spread.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum SampleKind {
    /// A scrambled Sobol sequence; best with a power of 2.
    Sobol,
    /// A Latin hypercube: each parameter's range is cut into `count` parts, and each part is used
    /// once.
    LatinHypercube,
}

one_of! {
    CombineFile: "grid, zip, or an object with `sample` and `count`",
    text(whole) => CombineFile::Whole(whole),
    object(sample) => CombineFile::Sample(sample),
}
