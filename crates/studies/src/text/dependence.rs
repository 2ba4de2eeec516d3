//! The tables of a summary that say on which inputs groups depend, and how uncertain that makes them.

use std::fmt::Write;

use super::{Page, table::Table};
use phylux_core::{error::setting, math::pattern::without_copies, words};
use phylux_results::result::{BudgetResult, Dependent, RunResult, SensitivityResult};

/// The most groups of which inputs are shown, and the most inputs of each.
const SHOWN_DEPENDENT: usize = 6;
const SHOWN_INPUTS: usize = 5;
/// Standard errors below this share of the uncertainty by inputs hardly add to it: 5 per cent.
const SMALL: f64 = 1.0 / 3.0;

/// A table, and the lines below it.
pub(super) struct Dependence {
    pub(super) table: Table,
    pub(super) below: String,
}

/// Returns the tables of a result, with these bands.
pub(super) fn dependences(page: &Page, result: &RunResult, bands: &[usize]) -> Vec<Dependence> {
    sensitivity(page, result, bands).into_iter().chain(budget(page, result, bands)).collect()
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
fn sensitivity(page: &Page, result: &RunResult, bands: &[usize]) -> Option<Dependence> {
    let all = result.sensitivity.as_ref()?;
    let heads = bands.iter().map(|&b| result.bands[b].name.clone());
    let mut table = Table::new("per cent for 1 % more of each", heads, "standard errors");
    let largest = |of: &SensitivityResult| {
        bands.iter().filter_map(|&b| of.elasticity[b]).map(f64::abs).fold(0.0, f64::max)
    };
    let mut left_out = 0;
    let shown = shown(page, result);
    for place in shown.iter().take(page.shown(SHOWN_DEPENDENT)) {
        let mut found: Vec<&SensitivityResult> =
            all.iter().filter(|of| of.of() == place.name && of.face == place.face).collect();
        found.sort_by(|a, b| largest(b).total_cmp(&largest(a)));
        let most = page.shown(SHOWN_INPUTS);
        left_out += found.len().saturating_sub(most);
        if !found.is_empty() {
            table.row(title(place), bands.iter().map(|_| String::new()), "");
        }
        for of in found.into_iter().take(most) {
            let errors = bands.iter().filter_map(|&b| of.elasticity_se[b]);
            let error =
                errors.fold(None, |most: Option<f64>, e| Some(most.map_or(e, |m| m.max(e))));
            let cells = bands.iter().map(|&b| cell(of.elasticity[b]));
            table.row(format!("    {}", of.parameter), cells, cell(error));
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
fn budget(page: &Page, result: &RunResult, bands: &[usize]) -> Option<Dependence> {
    let all = result.budget.as_ref()?;
    let heads = bands.iter().map(|&b| result.bands[b].name.clone());
    let mut table = Table::new("per cent by uncertain inputs", heads, "standard errors");
    let shown = shown(page, result);
    for place in shown.iter().take(page.shown(SHOWN_DEPENDENT)) {
        let of_band = |band: usize| {
            let name = &result.bands[band].name;
            let is_it = |of: &&BudgetResult| {
                of.of() == place.name && of.face == place.face && of.band == *name
            };
            all.iter().find(is_it)
        };
        let found: Vec<Option<&BudgetResult>> = bands.iter().map(|&b| of_band(b)).collect();
        if found.iter().all(Option::is_none) {
            continue;
        }
        let percent = |of: f64, band: usize| {
            let value = place.values[band];
            (value != 0.0).then(|| 100.0 * of / value.abs())
        };
        let errors = bands.iter().filter_map(|&b| percent(place.errors[b]?, b));
        let error = errors.fold(None, |most: Option<f64>, e| Some(most.map_or(e, |m| m.max(e))));
        let cells = bands
            .iter()
            .zip(&found)
            .map(|(&b, of)| cell(of.and_then(|of| percent(of.model_se, b))));
        let cells: Vec<String> = cells.collect();
        table.row(title(place), cells, cell(error));
        let mut inputs: Vec<&str> = Vec::new();
        for input in found.iter().flatten().flat_map(|of| &of.largest) {
            if !inputs.contains(&&*input.parameter) {
                inputs.push(&input.parameter);
            }
        }
        for name in inputs.iter().take(page.shown(SHOWN_INPUTS)) {
            let cells = bands.iter().zip(&found).map(|(&b, of)| {
                let input = of.as_ref()?.largest.iter().find(|input| input.parameter == **name)?;
                percent(input.se, b)
            });
            table.row(
                format!("    {name}"),
                cells.map(|of| of.map_or(String::new(), |of| cell(Some(of)))),
                "",
            );
        }
    }
    let mut below = page.more(shown.len(), SHOWN_DEPENDENT);
    let (known, settled) = settled(result);
    let _ = match (known, settled) {
        (0, _) => Ok(()),
        _ if known == settled => writeln!(
            below,
            "  more photons do not help: standard errors are below a third of what the inputs leave open at all \
             {known} captors"
        ),
        _ => writeln!(
            below,
            "  standard errors are below a third of what the inputs leave open at {settled} of {known} captors, so \
             more photons do not help there"
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
