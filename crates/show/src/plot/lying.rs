//! Charts of few things with long names, one below the other, with their values in words.

use super::chosen::error_bar;
use crate::{
    chart::{Chart, Series, Stroke},
    picture::label,
};
use phylux_core::math::units::rounded;

/// Width of columns, of the distance between them.
const WIDTH: f64 = 0.62;
/// What stands behind `±` in words, and what bars are.
pub(super) const ERRORS: &str = "± and bars: standard error of the Monte Carlo estimate";

/// A row of a chart: its name, its value and standard error, and its colour.
pub(super) struct Row {
    pub name: String,
    pub value: f64,
    pub error: Option<f64>,
    pub colour: usize,
}

/// Returns a value in words, with its standard error if that is known, or else in about three digits.
pub(super) fn with_error(value: f64, error: f64) -> String {
    let digits = |value: f64| rounded(value, 0.02 * value.abs())[0].parse().unwrap_or(value);
    match (error > 0.0, value == 0.0) {
        (true, _) => rounded(value, error).join(" ± "),
        (false, true) => "0".into(),
        (false, false) => label(digits(value)),
    }
}

/// Draws rows as lying columns from 0, with bars of errors; `None` for no rows.
pub(super) fn columns(title: String, x: &str, rows: Vec<Row>) -> Option<Chart> {
    let mut series: Vec<Series> = Vec::new();
    let mut colours: Vec<usize> = rows.iter().map(|row| row.colour).collect();
    colours.sort_unstable();
    colours.dedup();
    for colour in colours {
        let own = rows.iter().enumerate().filter(|(_, row)| row.colour == colour);
        let ends = |(i, row): (usize, &Row)| [0.0, row.value].map(|x| (x, place(i, rows.len())));
        let points = own.flat_map(ends).collect();
        series.push(Series { name: None, colour, stroke: Stroke::Lying(WIDTH), points });
    }
    let zero = vec![(0.0, 0.5), (0.0, rows.len() as f64 + 0.5)];
    series.push(Series {
        name: None,
        colour: Series::BLACK,
        stroke: Stroke::Bars,
        points: bars(&rows),
    });
    series.push(Series { name: None, colour: Series::GREY, stroke: Stroke::Plain, points: zero });
    (!rows.is_empty()).then(|| named(title, x, &rows, series))
}

/// Draws rows as marks with bars of errors, before the pale dots of what each is the mean of. The
/// axis begins at 0 only if values are near it.
pub(super) fn marks(title: String, x: &str, rows: Vec<Row>, dots: Vec<Vec<f64>>) -> Chart {
    let mut series: Vec<Series> = Vec::new();
    for (i, (row, dots)) in rows.iter().zip(dots).enumerate() {
        let (colour, at) = (row.colour, place(i, rows.len()));
        let add = |stroke, points| Series { name: None, colour, stroke, points };
        series.push(add(Stroke::Dots, dots.into_iter().map(|value| (value, at)).collect()));
        series.push(add(Stroke::Bars, error_bar(at, row.value, row.error, true).into()));
        series.push(add(Stroke::Marks, vec![(row.value, at)]));
    }
    Chart { amounts_near: true, ..named(title, x, &rows, series) }
}

fn bars(rows: &[Row]) -> Vec<(f64, f64)> {
    let bar = |(i, row): (usize, &Row)| error_bar(place(i, rows.len()), row.value, row.error, true);
    rows.iter().enumerate().flat_map(bar).collect()
}

/// Returns the height of a row of so many on the upright axis; the first is the highest.
fn place(row: usize, count: usize) -> f64 {
    count as f64 - row as f64
}

/// Makes a chart of amounts with the name and the value of each row, of what is drawn at their heights.
fn named(title: String, x: &str, rows: &[Row], series: Vec<Series>) -> Chart {
    let each = |words: fn(&Row) -> String| {
        rows.iter().enumerate().map(|(i, row)| (place(i, rows.len()), words(row))).collect()
    };
    let has_errors = rows.iter().any(|row| row.error.is_some_and(|error| error > 0.0));
    Chart {
        title,
        note: if has_errors { ERRORS.into() } else { String::new() },
        x: x.into(),
        linear_x: true,
        linear_y: true,
        amounts_across: true,
        y_names: each(|row| row.name.clone()),
        y_values: each(|row| with_error(row.value, row.error.unwrap_or(0.0))),
        series,
        ..Chart::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(value: f64, error: Option<f64>) -> Row {
        Row { name: "a".into(), value, error, colour: 0 }
    }

    /// A value has its error, where it has one.
    #[test]
    fn values_have_their_errors() {
        assert_eq!(with_error(67.46, 0.142), "67.46 ± 0.14");
        let alone = [67.46, -1.23456, 10.0, 0.0].map(|value| with_error(value, 0.0));
        assert_eq!(alone, ["67.5", "-1.23", "10", "0"]);
    }

    /// Marks that lie close together fill their axis, which says that it does not begin at 0; those
    /// near 0 do not, and columns never.
    #[test]
    fn axes_of_marks_begin_near_them() {
        let words = "(axis does not begin at 0)";
        let says = |values: [f64; 2]| {
            let rows = values.map(|value| row(value, Some(1.0))).into();
            let chart = marks("marks".into(), "light", rows, vec![Vec::new(); 2]);
            let svg = chart.svg(crate::chart::Width::Page).expect("a picture");
            assert!(svg.contains("Monte Carlo") && svg.contains("± 1"), "{svg}");
            svg.contains(words)
        };
        assert_eq!([says([180.0, 200.0]), says([50.0, 200.0])], [true, false]);
        let rows = [180.0, 200.0].map(|value| row(value, None)).into();
        let svg = columns("columns".into(), "light", rows).expect("rows");
        let svg = svg.svg(crate::chart::Width::Page).expect("a picture");
        assert!(!svg.contains(words) && !svg.contains("Monte Carlo") && svg.contains("180"));
    }
}
