//! The parameters that vary, and the names that they may not have.

use serde_json::Value;

/// Columns that the tables of a sweep have in addition to the parameters.
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

/// The beginnings of the names of the columns of the energy balance.
pub const BALANCE: [&str; 5] = ["power_", "emitted_", "absorbed_", "escaped_", "lost_"];

/// A parameter: a value that varies, at one place of the scene or at several at once.
#[derive(Clone, Debug, PartialEq)]
pub struct Parameter {
    /// Name of the parameter: a column of the tables.
    pub name: String,
    /// The places in the scene file that take the value, as JSON pointers.
    pub at: Vec<String>,
    /// The values that the parameter takes. Where the scene has numbers, a text that begins with
    /// `=` is an expression.
    pub values: Vec<Value>,
    /// Whether expressions of other parameters use this parameter.
    pub is_read: bool,
}

/// The name, in an expression, of the number that the scene has at the place.
pub const X: &str = "x";

/// Returns the expression in a text that begins with `=`.
pub fn expression(value: &Value) -> Option<&str> {
    value.as_str()?.strip_prefix('=')
}

/// Returns whether a value is a number or a list of numbers.
pub fn is_numbers(value: &Value) -> bool {
    match value {
        Value::Array(values) => !values.is_empty() && values.iter().all(is_numbers),
        other => other.is_number(),
    }
}
