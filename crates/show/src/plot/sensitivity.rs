//! The plots of what results depend on: what more of each input brings, and how uncertain results
//! are because inputs are.

use std::collections::HashSet;

use super::{
    chosen::{Chosen, error_bar, nothing},
    drawing::{Drawn, Plot},
};
use crate::chart::{Chart, Series, Stroke};
use phylux_core::{
    error::{Result, setting},
    math::pattern::without_copies,
    words,
};
use phylux_results::result::{Dependent, RunResult};

/// Limits on the number of groups, and on that of the inputs of each.
const GROUPS: usize = 2;
const INPUTS: usize = 8;
/// The change of each input, %.
const CHANGE: f64 = 10.0;
/// Width of columns, of the distance between them.
const WIDTH: f64 = 0.62;
/// Colours of inputs, of all inputs together, and of chance.
const INPUT: usize = 0;
const TOGETHER: usize = 4;
const CHANCE: usize = 6;

/// A row of a chart: its name, its value and standard error, and its colour.
struct Row {
    name: String,
    value: f64,
    error: Option<f64>,
    colour: usize,
}

/// Draws for each group what 10 % more of each input brings, with errors, and where inputs are
/// uncertain, what each of them makes of its uncertainty beside the standard error.
pub(super) fn sensitivity(chosen: &Chosen) -> Result<Plot> {
    let result = chosen.result;
    if result.sensitivity.is_none() && result.budget.is_none() {
        let remedy = "give the scene `\"sensitivity\": true`, or say in `uncertain` how well its \
                      inputs are known";
        return Err(nothing("do not say what they depend on", remedy));
    }
    let all = result.dependents().into_iter().filter(|place| chosen.takes(place.name)).collect();
    let places = without_copies(all, |place: &Dependent| place.name);
    let drawn: Vec<(Option<Chart>, Option<Chart>)> = places
        .iter()
        .map(|place| (changes(chosen, place), budget(chosen, place)))
        .filter(|(changes, budget)| changes.is_some() || budget.is_some())
        .collect();
    if drawn.is_empty() {
        let [band, captors] = ["band", "captors"].map(setting);
        let remedy = words!["take another ", band, " or other ", captors];
        return Err(nothing("have no light there that depends on any input", remedy));
    }
    let mut notes = Vec::new();
    if drawn.len() > GROUPS {
        notes.push(words![
            format!("the first {GROUPS} of {} groups are drawn: name others with ", drawn.len()),
            setting("captors")
        ]);
    }
    let charts = drawn.into_iter().take(GROUPS).flat_map(|(changes, budget)| [changes, budget]);
    Ok(Plot { drawn: Drawn::Charts(charts.flatten().collect()), notes })
}

/// Returns where the light of a place is, as it stands in titles.
fn light_of(chosen: &Chosen, place: &Dependent) -> String {
    let face = if place.face == "absorbed" { " (absorbed)" } else { "" };
    format!("{}{face}{}", place.name, chosen.of_band())
}

/// Returns the names of the lights of the scene, in its order, where results are kept by light and
/// depend on each of them; else none, and lights are called by their numbers.
fn lights(result: &RunResult) -> Vec<&str> {
    let numbers: HashSet<&str> = result
        .sensitivity
        .iter()
        .flatten()
        .filter_map(|of| of.parameter.strip_prefix("/lights/"))
        .filter_map(|rest| rest.split('/').next())
        .collect();
    let names = result.energy.by_light.iter().flatten().map(|(name, _)| name.as_str());
    let names: Vec<&str> = names.collect();
    let is_known = |i: usize| numbers.contains(i.to_string().as_str());
    match names.len() == numbers.len() && (0..names.len()).all(is_known) {
        true => names,
        false => Vec::new(),
    }
}

/// Returns an input as it is called at an axis: `/materials/leaf/back/reflectance` is `leaf, back,
/// reflectance`, and a lamp has its name, if `lights` has it. Inputs that vary together are one.
fn named(parameter: &str, lights: &[&str]) -> String {
    let light = |rest: &str| {
        let (number, of) = rest.split_once('/').unwrap_or((rest, ""));
        match number.parse().ok().and_then(|number: usize| lights.get(number)) {
            Some(name) => format!("{name}, {of}"),
            None => format!("light {number}, {of}"),
        }
    };
    let plain = |one: &str| {
        let one = one.trim();
        let text = match one.strip_prefix("/lights/") {
            Some(rest) => light(rest),
            None => one.trim_start_matches("/materials/").to_string(),
        };
        let text = text.replace(['/', '#'], ", ").replace("~1", "/").replace("~0", "~");
        text.trim_end_matches(", ").to_string()
    };
    let all: Vec<String> = parameter.split(", ").map(plain).collect();
    // inputs of one thing: its name once
    let split =
        |one: &String| one.rsplit_once(", ").map(|(of, own)| (of.to_string(), own.to_string()));
    let parts: Option<Vec<(String, String)>> = all.iter().map(split).collect();
    match parts {
        Some(parts) if parts.len() > 1 && parts.iter().all(|(of, _)| *of == parts[0].0) => {
            let own: Vec<&str> = parts.iter().map(|(_, own)| own.as_str()).collect();
            format!("{}, {}", parts[0].0, own.join(" and "))
        }
        _ => all.join(" with "),
    }
}

/// Draws what 10 % more of the inputs that matter most brings.
fn changes(chosen: &Chosen, place: &Dependent) -> Option<Chart> {
    let all = chosen.result.sensitivity.iter().flatten();
    let own = all.filter(|of| of.of() == place.name && of.face == place.face);
    let lights = lights(chosen.result);
    let mut rows: Vec<Row> = own
        .filter_map(|of| {
            Some(Row {
                name: named(&of.parameter, &lights),
                value: CHANGE * of.elasticity[chosen.band]?,
                error: of.elasticity_se[chosen.band].map(|error| CHANGE * error),
                colour: INPUT,
            })
        })
        .collect();
    rows.sort_by(|a, b| b.value.abs().total_cmp(&a.value.abs()));
    rows.truncate(INPUTS);
    let title = format!("{CHANGE} % more of each input: {}", light_of(chosen, place));
    chart(title, "change of the light, %", rows)
}

/// Draws the standard deviations by uncertain inputs beside the standard error.
fn budget(chosen: &Chosen, place: &Dependent) -> Option<Chart> {
    let value = place.values[chosen.band].abs();
    let of =
        chosen.result.budget.iter().flatten().find(|of| {
            of.of() == place.name && of.face == place.face && of.band == chosen.band_name()
        });
    let of = of.filter(|_| value > 0.0)?;
    let row = |name: String, se: f64, colour| Row {
        name,
        value: 100.0 * se / value,
        error: None,
        colour,
    };
    let lights = lights(chosen.result);
    let all = row("all inputs".into(), of.model_se, TOGETHER);
    let inputs =
        of.largest.iter().map(|input| row(named(&input.parameter, &lights), input.se, INPUT));
    let chance = place.errors[chosen.band];
    let chance = chance.map(|se| row("chance (standard error)".into(), se, CHANCE));
    let rows = std::iter::once(all).chain(inputs).chain(chance).collect();
    let title = format!("uncertain inputs: {}", light_of(chosen, place));
    chart(title, "standard deviation of the light, %", rows)
}

/// Draws rows as lying columns from 0, one below the other.
fn chart(title: String, x: &str, rows: Vec<Row>) -> Option<Chart> {
    let height = |i: usize| (rows.len() - i) as f64;
    let (first, last) = (0.45, rows.len() as f64 + 0.55);
    let mut series: Vec<Series> = Vec::new();
    for colour in [INPUT, TOGETHER, CHANCE] {
        let own = || rows.iter().enumerate().filter(move |(_, row)| row.colour == colour);
        let column = |(i, row): (usize, &Row)| [(0.0, height(i)), (row.value, height(i))];
        let points = own().flat_map(column).collect();
        series.push(Series { name: None, colour, stroke: Stroke::Lying(WIDTH), points });
    }
    let bars = rows.iter().enumerate();
    let bars = bars.flat_map(|(i, row)| error_bar(height(i), row.value, row.error, true)).collect();
    series.push(Series { name: None, colour: 5, stroke: Stroke::Bars, points: bars });
    let zero = vec![(0.0, first), (0.0, last)];
    series.push(Series { name: None, colour: Series::GREY, stroke: Stroke::Plain, points: zero });
    let names = rows.iter().enumerate().map(|(i, row)| (height(i), row.name.clone())).collect();
    (!rows.is_empty()).then(|| Chart {
        title,
        x: x.into(),
        linear_x: true,
        linear_y: true,
        amounts_across: true,
        y_names: names,
        series,
        ..Chart::default()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Inputs are called by their materials and lamps, and inputs of one thing by its name once.
    #[test]
    fn inputs_have_names() {
        let lights = ["left bar", "right bar"];
        for (parameter, name) in [
            ("/materials/leaf/back/reflectance", "leaf, back, reflectance"),
            ("/materials/reflector#reflected", "reflector, reflected"),
            ("/lights/1/power", "right bar, power"),
            ("/lights/2/power", "light 2, power"),
            (
                "/materials/leaf/reflectance, /materials/leaf/transmittance",
                "leaf, reflectance and transmittance",
            ),
            (
                "/materials/leaf/reflectance, /lights/0/power",
                "leaf, reflectance with left bar, power",
            ),
        ] {
            assert_eq!(named(parameter, &lights), name);
        }
    }
}
