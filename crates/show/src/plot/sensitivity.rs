//! The plots of what results depend on: what more of each input brings, and how uncertain results
//! are because inputs are.

use super::{
    chosen::{Chosen, nothing},
    drawing::{Drawn, Plot},
    lying::{Row, columns},
};
use crate::{chart::Chart, inputs};
use phylux_core::{
    error::{Result, setting},
    math::pattern::without_copies,
    words,
};
use phylux_results::result::{Dependent, LightNames};

/// Limits on the number of groups, and on that of the inputs of each.
const GROUPS: usize = 2;
const INPUTS: usize = 8;
/// The change of each input, %.
const CHANGE: f64 = 10.0;
/// Colours of inputs, of all inputs together, and of chance.
const INPUT: usize = 0;
const TOGETHER: usize = 4;
const CHANCE: usize = 6;

/// Draws for each group what 10 % more of each input brings, with errors, and where inputs are
/// uncertain, what each of them makes of its uncertainty beside the standard error.
pub(super) fn sensitivity(chosen: &Chosen) -> Result<Plot> {
    let result = chosen.result;
    if result.extras.sensitivity.is_none() && result.extras.budget.is_none() {
        let remedy = "give the scene `\"sensitivity\": true`, or say in `uncertain` how well its \
                      inputs are known";
        return Err(nothing("nothing says what the results depend on", remedy));
    }
    let all = result.dependents().into_iter().filter(|place| chosen.takes(place.name)).collect();
    let places = without_copies(all, |place: &Dependent| place.name);
    let lights = &LightNames::of(result.extras.sensitivity.as_deref().unwrap_or_default());
    let drawn: Vec<(Option<Chart>, Option<Chart>)> = places
        .iter()
        .map(|place| (changes(chosen, place, lights), budget(chosen, place, lights)))
        .filter(|(changes, budget)| changes.is_some() || budget.is_some())
        .collect();
    if drawn.is_empty() {
        let [band, captors] = ["band", "captors"].map(setting);
        let remedy = words!["take another ", band, " or other ", captors];
        return Err(nothing("no light there depends on any input", remedy));
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
    format!("{}{face}{}", place.name, chosen.of_column())
}

/// Draws what 10 % more of the inputs that matter most brings.
fn changes(chosen: &Chosen, place: &Dependent, lights: &LightNames) -> Option<Chart> {
    // a captor by itself may be a group of the same name
    let by_group = !chosen.result.groups.is_empty();
    let all = chosen.result.extras.sensitivity.iter().flatten();
    let all = all.filter(|of| of.group.is_some() == by_group);
    let own = all.filter(|of| of.of() == place.name && of.face == place.face);
    let mut rows: Vec<Row> = own
        .filter_map(|of| {
            let (elasticity, error) = of.of_column(chosen.column);
            Some(Row {
                name: inputs::plain(&lights.pointer(&of.parameter)),
                value: CHANGE * elasticity?,
                error: error.map(|error| CHANGE * error),
                colour: INPUT,
            })
        })
        .collect();
    rows.sort_by(|a, b| b.value.abs().total_cmp(&a.value.abs()));
    rows.truncate(INPUTS);
    let title = format!("{CHANGE} % more of each input: {}", light_of(chosen, place));
    columns(title, &format!("change of the {}, %", chosen.kind_of_column()), rows)
}

/// Draws the standard deviations by uncertain inputs beside the standard error.
fn budget(chosen: &Chosen, place: &Dependent, lights: &LightNames) -> Option<Chart> {
    let (value, chance) = place.of_column(chosen.column)?;
    let value = value.abs();
    let of = chosen.result.extras.budget.iter().flatten().find(|of| {
        of.of() == place.name && of.face == place.face && of.band == chosen.column_name()
    });
    let of = of.filter(|_| value > 0.0)?;
    let row = |name: String, se: f64, colour| Row {
        name,
        value: 100.0 * se / value,
        error: None,
        colour,
    };
    let all = row("all inputs".into(), of.model_se, TOGETHER);
    let inputs = of
        .largest
        .iter()
        .map(|input| row(inputs::named(&input.parameter, lights), input.se, INPUT));
    let chance = chance.map(|se| row("chance (standard error)".into(), se, CHANCE));
    let rows = std::iter::once(all).chain(inputs).chain(chance).collect();
    let title = format!("uncertain inputs: {}", light_of(chosen, place));
    columns(title, &format!("standard deviation of the {}, %", chosen.kind_of_column()), rows)
}
