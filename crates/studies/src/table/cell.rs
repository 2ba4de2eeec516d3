//! The cells of a table.

use serde_json::Value;

use phylux_files::csv_text;

/// The kind of all cells of a column.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Whole numbers, at least 0.
    Whole,
    /// Numbers.
    Number,
    /// Numbers in single precision.
    Single,
    /// Text.
    Text,
}

impl Kind {
    /// Returns the kind of a parameter with these values: text, unless all are numbers.
    pub fn of(values: &[Value]) -> Self {
        if values.iter().all(Value::is_number) { Self::Number } else { Self::Text }
    }
}

/// A cell: the entry of a row in a column.
#[derive(Clone, Debug)]
pub enum Cell<'a> {
    /// A whole number.
    Whole(u64),
    /// A number.
    Number(f64),
    /// A number in single precision.
    Single(f32),
    /// Text.
    Text(&'a str),
    /// The value of a parameter.
    Value(&'a Value),
    /// An empty cell.
    Nothing,
}

impl Cell<'_> {
    /// Makes a cell with a number, or an empty one.
    pub fn number(value: Option<f64>) -> Self {
        value.map_or(Self::Nothing, Self::Number)
    }

    pub(super) fn text(&self) -> String {
        match self {
            Self::Whole(n) => n.to_string(),
            Self::Number(v) => v.to_string(),
            Self::Single(v) => v.to_string(),
            Self::Text(text) => text.to_string(),
            Self::Value(Value::String(text)) => text.clone(),
            Self::Value(value) => value.to_string(),
            Self::Nothing => String::new(),
        }
    }

    pub fn csv(&self) -> String {
        let text = self.text();
        match self {
            Self::Text(_) | Self::Value(Value::String(_)) => csv_text::cell(&text).into_owned(),
            _ => text,
        }
    }
}
