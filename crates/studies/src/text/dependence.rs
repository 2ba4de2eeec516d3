//! The tables of a summary that say on which inputs groups depend, and how uncertain that makes them.

use std::fmt::Write;

use super::{Page, table::Table};
use phylux_core::{error::setting, math::pattern::without_copies, words};
use phylux_results::result::{BudgetResult, Dependent, LightNames, RunResult, SensitivityResult};

/// The most groups of which inputs are shown, and the most inputs of each.
const SHOWN_DEPENDENT: usize = 6;
const SHOWN_INPUTS: usize = 5;
/// The most ratios that are shown.
const SHOWN_RATIOS: usize = 8;
/// Standard errors below this share of the uncertainty by inputs hardly add to it: 5 per cent.
const SMALL: f64 = 1.0 / 3.0;

/// A table, and the lines below it.
pub(super) struct Dependence {
    pub(super) table: Table,
    pub(super) below: String,
}

/// Returns the tables of a result, with these bands, and with the first ratios.
pub(super) fn dependences(page: &Page, result: &RunResult, bands: &[usize]) -> Vec<Dependence> {
    let ratios = result.bands.len()..result.bands.len() + result.ratios.len();
    let ratios = ratios.take(page.shown(SHOWN_RATIOS));
    let columns: Vec<usize> = bands.iter().copied().chain(ratios).collect();
    sensitivity(page, result, &columns).into_iter().chain(budget(page, result, &columns)).collect()
}

/// Returns the name of a column: of a band, a sum or a ratio.
fn name_of(result: &RunResult, column: usize) -> &str {
    match column.checked_sub(result.bands.len()) {
        None => &result.bands[column].name,
        Some(ratio) => &result.ratios[ratio].name,
    }
}

/// Returns the names of the lights of a result.
fn light_names(result: &RunResult) -> LightNames {
    LightNames::of(result.extras.sensitivity.as_deref().unwrap_or_default())
}

/// Returns what a place is, for the head of its rows.
fn title(place: &Dependent) -> String {
    let face = if place.face == "absorbed" { "absorbed" } else { "on the front" };
    format!("  {}, {face}", place.name)
}

/// Returns the groups of a result, or its captors where it has no groups.
fn shown<'a>(page: &Page, result: &'a RunResult) -> Vec<Dependent<'a>> {
    let all = result.dependents();
    if page.full { all } else { without_copies(all, |of: &Dependent| of.name) }
}

/// Writes a number of per cent, or that none is known.
fn cell(percent: Option<f64>) -> String {
    percent.map_or("-".into(), |percent| format!("{percent:.3}"))
}

/// Returns by how many per cent the light of each group changes for one per cent more of the inputs on
/// which it depends most.
fn sensitivity(page: &Page, result: &RunResult, columns: &[usize]) -> Option<Dependence> {
    let all = result.extras.sensitivity.as_ref()?;
    let lights = light_names(result);
    let heads = columns.iter().map(|&c| name_of(result, c));
    let mut table = Table::new("per cent for 1 % more of each", heads, "standard errors");
    let largest = |of: &SensitivityResult| {
        columns.iter().filter_map(|&c| of.of_column(c).0).map(f64::abs).fold(0.0, f64::max)
    };
    let mut left_out = 0;
    let shown = shown(page, result);
    // a captor by itself may be a group of the same name
    let by_group = !result.groups.is_empty();
    let all = || all.iter().filter(|of| of.group.is_some() == by_group);
    for place in shown.iter().take(page.shown(SHOWN_DEPENDENT)) {
        let mut found: Vec<&SensitivityResult> =
            all().filter(|of| of.of() == place.name && of.face == place.face).collect();
        found.sort_by(|a, b| largest(b).total_cmp(&largest(a)));
        let most = page.shown(SHOWN_INPUTS);
        left_out += found.len().saturating_sub(most);
        if !found.is_empty() {
            table.row(title(place), columns.iter().map(|_| String::new()), "");
        }
        for of in found.into_iter().take(most) {
            let errors = columns.iter().filter_map(|&c| of.of_column(c).1);
            let error =
                errors.fold(None, |most: Option<f64>, e| Some(most.map_or(e, |m| m.max(e))));
            let cells = columns.iter().map(|&c| cell(of.of_column(c).0));
            table.row(format!("    {}", lights.pointer(&of.parameter)), cells, cell(error));
        }
    }
    let mut below = String::new();
    if left_out > 0 {
        let words = words![format!("  and {left_out} smaller ones ("), setting("full"), ")\n"];
        below.push_str(&words.spelled(page.spelling));
    }
    below.push_str(&page.more(shown.len(), SHOWN_DEPENDENT));
    Some(Dependence { table, below })
}

/// Returns how uncertain the light of each group is because inputs are, by which of them, and whether
/// more photons would help.
fn budget(page: &Page, result: &RunResult, columns: &[usize]) -> Option<Dependence> {
    let all = result.extras.budget.as_ref()?;
    let lights = light_names(result);
    let heads = columns.iter().map(|&c| name_of(result, c));
    let mut table = Table::new("per cent by uncertain inputs", heads, "standard errors");
    let shown = shown(page, result);
    for place in shown.iter().take(page.shown(SHOWN_DEPENDENT)) {
        let of_column = |column: usize| {
            let name = name_of(result, column);
            let is_it = |of: &&BudgetResult| {
                of.of() == place.name && of.face == place.face && of.band == name
            };
            all.iter().find(is_it)
        };
        let found: Vec<Option<&BudgetResult>> = columns.iter().map(|&c| of_column(c)).collect();
        if found.iter().all(Option::is_none) {
            continue;
        }
        let percent = |of: f64, column: usize| {
            let (value, _) = place.of_column(column)?;
            (value != 0.0).then(|| 100.0 * of / value.abs())
        };
        let errors = columns.iter().filter_map(|&c| percent(place.of_column(c)?.1?, c));
        let error = errors.fold(None, |most: Option<f64>, e| Some(most.map_or(e, |m| m.max(e))));
        let cells = columns
            .iter()
            .zip(&found)
            .map(|(&c, of)| cell(of.and_then(|of| percent(of.model_se, c))));
        let cells: Vec<String> = cells.collect();
        table.row(title(place), cells, cell(error));
        let mut inputs: Vec<&str> = Vec::new();
        for input in found.iter().flatten().flat_map(|of| &of.largest) {
            if !inputs.contains(&&*input.parameter) {
                inputs.push(&input.parameter);
            }
        }
        for name in inputs.iter().take(page.shown(SHOWN_INPUTS)) {
            let cells = columns.iter().zip(&found).map(|(&c, of)| {
                let input = of.as_ref()?.largest.iter().find(|input| input.parameter == **name)?;
                percent(input.se, c)
            });
            let inputs = lights.pointers(name).collect::<Vec<_>>().join(", ");
            table.row(
                format!("    {inputs}"),
                cells.map(|of| of.map_or(String::new(), |of| cell(Some(of)))),
                "",
            );
        }
    }
    let mut below = page.more(shown.len(), SHOWN_DEPENDENT);
    let (known, settled) = settled(result);
    let all = if known == 1 { "the captor".into() } else { format!("all {known} captors") };
    let limit = "a third of what the inputs leave open";
    let _ = match (known, settled) {
        (0, _) => Ok(()),
        (_, 0) => writeln!(below, "  more photons help: standard errors exceed {limit} at {all}"),
        _ if known == settled => writeln!(
            below,
            "  more photons do not help: standard errors are below {limit} at {all}"
        ),
        _ => writeln!(
            below,
            "  standard errors are below {limit} at {settled} of {known} captors, so more photons do not \
             help there"
        ),
    };
    Some(Dependence { table, below })
}

/// Returns at how many captors it is known how uncertain they are because inputs are, and at how many
/// of them standard errors hardly add to that, in all bands with light.
fn settled(result: &RunResult) -> (usize, usize) {
    let (mut known, mut settled) = (0, 0);
    for captor in &result.captors {
        let place = Dependent::of_captor(captor);
        let Some(model) = place.model_errors else { continue };
        let lit: Vec<usize> = (0..model.len()).filter(|b| place.values[*b] != 0.0).collect();
        if lit.is_empty() {
            continue;
        }
        known += 1;
        let is_small = |b: &usize| place.errors[*b].is_some_and(|error| error < SMALL * model[*b]);
        settled += usize::from(lit.iter().all(is_small));
    }
    (known, settled)
}
