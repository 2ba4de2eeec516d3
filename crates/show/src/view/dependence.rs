//! What the light of captors and groups depends on, for the page: the inputs that matter most, and
//! how uncertain inputs make it.

use serde_json::{Value, json};

use crate::{inputs, rendered::RenderedScene};
use phylux_results::result::{LightNames, SensitivityResult};

/// The most inputs of a face.
const MOST_INPUTS: usize = 8;
/// The most faces of a page: of more captors only groups are told.
const MOST_FACES: usize = 20_000;

/// Returns the facts of the page about what results depend on; `None` where they do not say it.
pub(super) fn facts(rendered: &RenderedScene) -> Option<Value> {
    let (sensitivity, budget) = (&rendered.sensitivity, &rendered.budget);
    if sensitivity.is_empty() && budget.is_empty() {
        return None;
    }
    let lights = LightNames::of(sensitivity);
    let place = |captor: &Option<String>, group: &Option<String>| json!({ "captor": captor, "group": group });
    let same = |a: &SensitivityResult, b: &SensitivityResult| {
        (a.of(), &a.captor, &a.face) == (b.of(), &b.captor, &b.face)
    };
    // the rows of a face stand together
    let mut faces: Vec<&[SensitivityResult]> = sensitivity.chunk_by(same).collect();
    if faces.len() > MOST_FACES {
        faces.retain(|rows| rows[0].group.is_some());
    }
    let face = |rows: &&[SensitivityResult]| {
        let mut rows: Vec<&SensitivityResult> = rows.iter().collect();
        let largest = |row: &SensitivityResult| {
            row.elasticity.iter().flatten().fold(0.0, |most: f64, of| most.max(of.abs()))
        };
        rows.sort_by(|a, b| largest(b).total_cmp(&largest(a)));
        let mut facts = place(&rows[0].captor, &rows[0].group);
        facts["face"] = json!(rows[0].face);
        let short =
            |all: &[Option<f64>]| all.iter().map(|of| of.map(|of| of as f32)).collect::<Vec<_>>();
        let input = |row: &&SensitivityResult| {
            json!({
                "name": inputs::plain(&lights.pointer(&row.parameter)),
                "value": short(&row.elasticity),
                "error": short(&row.elasticity_se),
            })
        };
        facts["inputs"] = rows.iter().take(MOST_INPUTS).map(input).collect();
        facts
    };
    let of_budget = budget.iter().take(MOST_FACES).map(|row| {
        let mut facts = place(&row.captor, &row.group);
        facts["face"] = json!(row.face);
        facts["band"] = json!(row.band);
        facts["all"] = json!(row.model_se as f32);
        let input = row.largest.iter().map(
            |of| json!({ "name": inputs::named(&of.parameter, &lights), "value": of.se as f32 }),
        );
        facts["inputs"] = input.collect();
        facts
    });
    let scene = rendered.scene;
    let groups = |captor: usize| scene.captors()[captor].groups.iter();
    let names = |captor: usize| groups(captor).map(|&g| &scene.groups()[g]).collect::<Vec<_>>();
    Some(json!({
        "faces": faces.iter().map(face).collect::<Vec<_>>(),
        "budget": of_budget.collect::<Vec<_>>(),
        "groups": (0..scene.captors().len()).map(names).collect::<Vec<_>>(),
    }))
}
