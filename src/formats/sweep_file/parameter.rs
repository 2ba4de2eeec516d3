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
    /// Its name: in the tables, a column.
    pub name: String,
    /// Where its value goes: JSON pointers into the scene.
    pub at: Vec<String>,
    /// Its values.
    pub values: Vec<Value>,
}
