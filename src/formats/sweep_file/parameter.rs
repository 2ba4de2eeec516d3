//! What varies, and the columns that tables have besides.

use serde_json::Value;

/// Columns that the tables have besides the parameters.
pub const COLUMNS: [&str; 23] = [
    "min",
    "max",
    "min_over_mean",
    "min_over_mean_se",
    "cv",
    "cv_se",
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
    /// The values that it takes; where numbers stand, a text that begins with `=` is an expression.
    pub values: Vec<Value>,
    /// Whether expressions of others read it.
    pub is_read: bool,
}

/// The number that stands at the place, in an expression.
pub const X: &str = "x";

/// What a text that begins with `=` says.
pub fn expression(value: &Value) -> Option<&str> {
    value.as_str()?.strip_prefix('=')
}

/// Whether it is a number, or a list of such.
pub fn is_numbers(value: &Value) -> bool {
    match value {
        Value::Array(values) => !values.is_empty() && values.iter().all(is_numbers),
        other => other.is_number(),
    }
}
