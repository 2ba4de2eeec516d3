//! Charts of few things with long names, one below the other.

use super::chosen::error_bar;
use crate::chart::{Chart, Series, Stroke};

/// Width of columns, of the distance between them.
const WIDTH: f64 = 0.62;

/// A row of a chart: its name, its value and standard error, and its colour.
pub(super) struct Row {
    pub name: String,
    pub value: f64,
    pub error: Option<f64>,
    pub colour: usize,
}

/// Draws rows as lying columns from 0, with bars of errors; `None` for no rows.
pub(super) fn columns(title: String, x: &str, rows: Vec<Row>) -> Option<Chart> {
    let at = |i: usize| place(i, rows.len());
    let mut series: Vec<Series> = Vec::new();
    let mut colours: Vec<usize> = rows.iter().map(|row| row.colour).collect();
    colours.sort_unstable();
    colours.dedup();
    for colour in colours {
        let own = rows.iter().enumerate().filter(|(_, row)| row.colour == colour);
        let points = own.flat_map(|(i, row)| [(0.0, at(i)), (row.value, at(i))]).collect();
        series.push(Series { name: None, colour, stroke: Stroke::Lying(WIDTH), points });
    }
    let bars = rows.iter().enumerate();
    let bars = bars.flat_map(|(i, row)| error_bar(at(i), row.value, row.error, true)).collect();
    series.push(Series { name: None, colour: 5, stroke: Stroke::Bars, points: bars });
    let names: Vec<String> = rows.into_iter().map(|row| row.name).collect();
    (!names.is_empty()).then(|| named(title, x, names, series))
}

/// Returns the height of a row of so many on the upright axis; the first is the highest.
pub(super) fn place(row: usize, count: usize) -> f64 {
    (count - row) as f64
}

/// Makes a chart of amounts with a name for each row, of what is drawn at the heights of the rows.
pub(super) fn named(title: String, x: &str, names: Vec<String>, mut series: Vec<Series>) -> Chart {
    let count = names.len();
    let zero = vec![(0.0, 0.45), (0.0, count as f64 + 0.55)];
    series.push(Series { name: None, colour: Series::GREY, stroke: Stroke::Plain, points: zero });
    let names = names.into_iter().enumerate().map(|(i, name)| (place(i, count), name));
    Chart {
        title,
        x: x.into(),
        linear_x: true,
        linear_y: true,
        amounts_across: true,
        y_names: names.collect(),
        series,
        ..Chart::default()
    }
}
