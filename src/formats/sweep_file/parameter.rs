//! What varies, and the columns that tables have besides.

use serde_json::Value;

/// Columns that the tables have besides the parameters.
pub const COLUMNS: [&str; 19] = [
    "min",
    "max",
    "run",
    "file",
    "seed",
    "photons",
    "error",
    "captor",
    "group",
    "captors",
    "face",
    "band",
    "seconds",
    "irradiance",
    "irradiance_se",
    "absorbed",
    "absorbed_se",
    "few_paths",
    "threads",
];

/// How columns of the energy balance begin.
pub const BALANCE: [&str; 5] = ["power_", "emitted_", "absorbed_", "escaped_", "lost_"];

/// One number of the scene that varies, or several at once.
#[derive(Clone, Debug, PartialEq)]
pub struct Parameter {
    /// Name of the parameter: a column of the tables.
    pub name: String,
    /// The places in the scene file that take its value, as JSON pointers.
    pub at: Vec<String>,
    /// The values that it takes.
    pub values: Vec<Value>,
}
