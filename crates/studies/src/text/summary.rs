//! The summary of a result that fits on one screen, as `phylux run` prints it at its end.

use std::{collections::HashSet, fmt::Write, iter::once};

use super::{
    Page,
    dependence::{Dependence, dependences},
    in_digits, short,
    table::Table,
    with_error,
};
use phylux_core::{
    error::{ToWords, Words, setting},
    math::pattern::copied,
    transport::settings::{Estimator, Guiding},
    words,
};
use phylux_results::quantity::{Per, Quantity};
use phylux_results::result::{
    AbsorbedByFace, BandResult, CaptorResult, Electricity, FaceResult, GroupResult, NearestResult,
    PerKwh, RunResult, Share, SumUnit, ToleranceResult, Uniformity, WorstResult,
};

/// The most bands that are shown.
pub const SHOWN_BANDS: usize = 8;
/// The most groups that are shown.
const SHOWN_GROUPS: usize = 20;
/// The most rows of uniformities that are shown of all bands; if there are more, they are those of the
/// first sum, or of the first band.
const SHOWN_EVEN: usize = 24;
/// The most layers that are shown.
const SHOWN_LAYERS: usize = 20;
/// So many copies of a thing have one row together.
pub const MANY: usize = 3;
/// The head of relative errors.
const ERRORS: &str = "error: median (range)";
/// Share of a captor's area above which the disc of a k-nearest estimate is no longer local.
const WIDE_DISC: f64 = 0.5;

/// A summary and what is to be known before it is trusted.
pub struct Summary {
    /// The text.
    pub text: String,
    /// The warnings, sentences.
    pub warnings: Vec<Words>,
}

/// Makes the summary of a result; `reason` says why the run ended, after a comma.
pub fn summary(page: &Page, result: &RunResult, reason: &str) -> Summary {
    let mut text = String::new();
    let _ = writeln!(
        text,
        "{}: {} {} in {} batches, seed {}{reason}",
        result.scene, result.photons, result.estimator, result.batches, result.seed
    );
    if let Some(found) = &result.account.tolerance {
        tolerance(&mut text, result, found);
    }
    groups(page, &mut text, result);
    uniformity(page, &mut text, result);
    let mut kinds = vec![("sensor", "virtual"), ("surface", "surface")];
    kinds.retain(|(_, kind)| result.captors.iter().any(|captor| captor.kind == *kind));
    for (title, kind) in kinds {
        captors(page, &mut text, result, title, kind);
    }
    ratios(page, &mut text, result);
    electricity(page, &mut text, result);
    canopy(page, &mut text, result);
    layers(page, &mut text, result);
    for Dependence { table, below } in dependences(page, result, &shown_bands(page, result)) {
        table.below(&mut text, page);
        text.push_str(&below);
    }
    energy(page, &mut text, result);
    origin(page, &mut text, result);
    let warnings = result.warnings().into_iter().map(|warning| warning.text).collect();
    Summary { text, warnings }
}

/// Writes how the light was found, and why so.
fn origin(page: &Page, text: &mut String, result: &RunResult) {
    let mut lines: Vec<Words> = Vec::new();
    if !result.captors.is_empty() {
        lines.push("errors: standard errors (Monte Carlo), in % of the value".to_words());
    }
    let of = format!("{} {}", result.photons, result.estimator);
    if let Some(photons) = result.photons_beside {
        lines.push(words![format!(
            "light on captors: from {of}, and from {photons} photons beside them what such paths cannot find"
        )]);
        lines.push("energy: from the photons beside the paths".to_words());
        let faces = || result.captors.iter().flat_map(CaptorResult::faces);
        let alone = faces().filter(|face| face.by_photons).count();
        if alone > 0 {
            lines.push(words![format!(
                "at {alone} of {} faces of captors, where no paths start: from the photons alone",
                faces().count()
            )]);
        }
    }
    let guided = match result.guiding {
        Some(Guiding::Aim) => Some(("with flights aimed at the sensors beside them", "aim")),
        Some(Guiding::Full) => Some(("guided by their importance for the captors", "full")),
        _ => None,
    };
    if let Some((how, name)) = guided {
        lines.push(words![format!("{of} {how} ("), setting("guiding").is(name), ")"]);
    }
    if let Some(why) = &result.chosen {
        let asked = result.settings.as_ref().and_then(|settings| settings.work_of_photons);
        let estimator = result.estimator;
        lines.push(match (estimator, asked) {
            (Estimator::Complete, Some(photons)) => words![
                format!("{estimator} were chosen, for as much work as {photons} photons: {why} ("),
                setting("estimator").is("photons"),
                " traces photons alone)",
            ],
            _ => words![format!("{estimator} were chosen: {why}")],
        });
    }
    if !lines.is_empty() {
        text.push('\n');
    }
    for line in lines {
        text.push_str(&line.spelled(page.spelling));
        text.push('\n');
    }
}

/// Writes what is farthest from the tolerance, and how many faces are so dark that the run did not
/// wait for them.
fn tolerance(text: &mut String, result: &RunResult, found: &ToleranceResult) {
    // in percent, rounded so that the product of a decimal fraction has no stray last digits
    let asked = (1e12 * found.asked).round() / 1e10;
    if let Some(worst) = &found.worst {
        let _ = writeln!(text, "farthest from the tolerance of {asked} %: {}", far_off(worst));
    }
    let faces: HashSet<(&str, bool, &str)> =
        found.dark.iter().map(|dark| (dark.captor.as_str(), dark.group, &*dark.face)).collect();
    let below = found.dark.iter().map(|dark| dark.below).fold(0.0, f64::max);
    let (irradiance, s) = (&result.unit.irradiance, if faces.len() == 1 { " is" } else { "s are" });
    if !faces.is_empty() {
        let _ = writeln!(
            text,
            "{} face{s} dark: below {} {irradiance} with 95 % confidence, less than {} % of the median",
            faces.len(),
            short(below),
            asked,
        );
    }
}

/// Says what is farthest from a tolerance, and how far off it is.
pub fn far_off(worst: &WorstResult) -> String {
    let WorstResult { captor, group, face, band, relative_error, batches_with_light } = worst;
    let error = match relative_error {
        Some(error) => format!("{:.2} %", 100.0 * error),
        None => "no error is known".into(),
    };
    let few = match batches_with_light {
        0 => ", nothing arrived yet".into(),
        1..30 => format!(", from light in {batches_with_light} batches only"),
        _ => String::new(),
    };
    let kind = if *group { "group " } else { "" };
    format!("{error} at {kind}{captor}, {face}, {band}{few}")
}

/// Returns the bands and sums that are shown, by index: all, or the first bands and the sums.
fn shown_bands(page: &Page, result: &RunResult) -> Vec<usize> {
    let most = page.shown(SHOWN_BANDS);
    let (bands, sums): (Vec<usize>, Vec<usize>) =
        (0..result.bands.len()).partition(|&band| result.bands[band].sum_of.is_none());
    let sums = &sums[..sums.len().min(most)];
    bands.into_iter().take(most - sums.len()).chain(sums.iter().copied()).collect()
}

fn energy(page: &Page, text: &mut String, result: &RunResult) {
    let energy = &result.energy;
    if energy.emitted.is_empty() {
        return;
    }
    let unit = &result.unit.flux;
    let mut columns = vec![
        ("emitted", &energy.emitted),
        ("absorbed", &energy.absorbed),
        ("escaped", &energy.escaped),
        ("lost", &energy.lost),
    ];
    // only daylight can miss the scene
    if !energy.missed.is_empty() {
        columns.push(("missed", &energy.missed));
    }
    let heads = columns.iter().map(|(head, _)| *head);
    let mut table = Table::new(format!("energy, {unit}"), heads, "");
    let shown = shown_bands(page, result);
    for &b in &shown {
        let name = named(&result.bands[b], |own| &own.flux, unit);
        let cells = columns.iter().map(|(_, values)| short(values[b]));
        table.row(format!("  {name}"), cells, "");
    }
    table.below(text, page);
    if shown.len() < result.bands.len() {
        let more = result.bands.len() - shown.len();
        let words = words![
            format!("  and {more} more bands, here and above ("),
            setting("full"),
            " has all)\n"
        ];
        text.push_str(&words.spelled(page.spelling));
    }
}

fn captors(page: &Page, text: &mut String, result: &RunResult, noun: &str, kind: &str) {
    let count = result.captors.iter().filter(|captor| captor.kind == kind).count();
    let s = if count == 1 { "" } else { "s" };
    let title = format!("{count} {noun}{s}, {}", result.unit.irradiance);
    let mut table = Table::new(title, ["min", "median", "max"], ERRORS);
    type Face = fn(&CaptorResult) -> Option<&FaceResult>;
    let faces: [(&str, Face); 2] =
        [("front", |captor| Some(&captor.front)), ("back", |captor| captor.back.as_ref())];
    for (name, face) in faces {
        let faces: Vec<&FaceResult> =
            result.captors.iter().filter(|c| c.kind == kind).filter_map(face).collect();
        if faces.is_empty() {
            continue;
        }
        let bands = shown_bands(page, result);
        let is_dark = faces.iter().all(|face| face.flux.iter().all(|flux| *flux == 0.0));
        if is_dark && bands.len() > 1 && !page.full {
            table.row(format!("  {name}, all bands"), ["0", "0", "0"].map(String::from), "-");
            continue;
        }
        for b in bands {
            let irradiance = Spread::of(faces.iter().map(|face| face.irradiance[b]).collect());
            let relative = |face: &&FaceResult| Some(face.flux_se[b]? / face.flux[b]);
            let errors = percent_of(faces.iter().filter_map(relative).collect());
            let name = format!("  {name} {}", named_per_area(result, b));
            table.row(name, irradiance.cells(), errors);
            let unit = &result.unit.dli;
            let dli = faces.iter().map(|face| face.dli.as_ref()?[b]).collect::<Option<Vec<_>>>();
            if let (Some(dli), Some(unit)) = (dli.map(Spread::of), unit) {
                table.row(format!("    DLI, {unit}"), dli.cells(), "");
            }
        }
    }
    let faces = result.captors.iter().filter(|c| c.kind == kind).flat_map(CaptorResult::faces);
    let below =
        nearest(page, &mut table, faces.filter_map(|face| face.knn.as_ref()?.as_deref()).collect());
    table.below(text, page);
    text.push_str(&below);
}

/// Returns the name of a band or sum, with that of its own units that counts where it is not the
/// `usual` one.
fn named(band: &BandResult, counts: fn(&SumUnit) -> &str, usual: &str) -> String {
    let BandResult { name, unit, .. } = band;
    match unit.as_ref().map(counts) {
        Some(own) if own != usual => format!("{name}, {own}"),
        _ => name.clone(),
    }
}

/// Returns the same, with the unit of irradiance.
fn named_per_area(result: &RunResult, band: usize) -> String {
    named(&result.bands[band], |own| &own.irradiance, &result.unit.irradiance)
}

/// Writes the ratios of the light on captors, and those of groups of several with their errors.
fn ratios(page: &Page, text: &mut String, result: &RunResult) {
    let mut table = Table::new("ratios", ["min", "median", "max"], "standard error");
    for (r, ratio) in result.ratios.iter().enumerate().take(page.shown(SHOWN_BANDS)) {
        for (noun, kind) in [("sensors", "virtual"), ("surfaces", "surface")] {
            type Face = fn(&CaptorResult) -> Option<&FaceResult>;
            let faces: [(&str, Face); 2] =
                [("front", |captor| Some(&captor.front)), ("back", |captor| captor.back.as_ref())];
            for (name, face) in faces {
                let captors = result.captors.iter().filter(|captor| captor.kind == kind);
                let found = captors.filter_map(|c| face(c)?.ratios.as_ref()?.get(r));
                let found: Vec<(f64, Option<f64>)> = found.collect();
                if found.is_empty() {
                    continue;
                }
                let errors: Vec<f64> = found.iter().filter_map(|(_, error)| *error).collect();
                let errors = match errors.is_empty() {
                    true => "-".to_string(),
                    false => format!("median {}", short(Spread::of(errors).median)),
                };
                let values = Spread::of(found.iter().map(|(value, _)| *value).collect());
                let name = format!("  {}, {noun} {name}", ratio.name);
                table.row(name, values.cells(), errors);
            }
        }
        let several = result.groups.iter().filter(|group| group.captors > 1);
        for group in several.take(page.shown(SHOWN_GROUPS)) {
            let found = [("mean", &group.front.ratios), ("absorbed", &group.absorbed_ratios)];
            for (what, found) in found {
                let Some((value, error)) = found.as_ref().and_then(|found| found.get(r)) else {
                    continue;
                };
                let cells = [String::new(), short(value), String::new()];
                let error = error.map_or("-".into(), short);
                table.row(format!("    {}, {what}", group.id), cells, error);
            }
        }
    }
    if !table.is_empty() {
        table.below(text, page);
    }
}

/// A row of the table of groups: one of them, or all copies of one thing.
struct GroupRow<'a> {
    name: String,
    groups: Vec<&'a GroupResult>,
}

/// Returns the rows of the table of groups; the copies of a thing, if they are many, are one, and so are
/// groups of the same captors.
fn group_rows<'a>(page: &Page, groups: &[&'a GroupResult]) -> Vec<GroupRow<'a>> {
    let mut rows: Vec<GroupRow> = Vec::new();
    let many = |thing: &str| groups.iter().filter(|g| copied(&g.id) == Some(thing)).count() >= MANY;
    // only groups of the same captors have the same light to all digits, but for dark ones
    let same = |a: &GroupResult, b: &GroupResult| {
        let is_lit = a.front.flux.iter().any(|flux| *flux > 0.0);
        is_lit
            && (a.captors, a.area) == (b.captors, b.area)
            && a.front.flux == b.front.flux
            && (&a.absorbed, &a.own) == (&b.absorbed, &b.own)
    };
    for &group in groups {
        if let Some(row) =
            rows.iter_mut().find(|row| row.groups.len() == 1 && same(row.groups[0], group))
        {
            row.name = format!("{}, {}", row.name, group.id);
            continue;
        }
        let thing = copied(&group.id).filter(|thing| !page.full && many(thing));
        let name = thing.map_or(group.id.clone(), |thing| format!("each {thing}#"));
        match rows.iter_mut().find(|row| thing.is_some() && row.name == name) {
            Some(row) => row.groups.push(group),
            None => rows.push(GroupRow { name, groups: vec![group] }),
        }
    }
    rows
}

/// Writes the mean irradiance of the fronts of each group of several captors, and what its surfaces
/// absorbed.
fn groups(page: &Page, text: &mut String, result: &RunResult) {
    let several: Vec<&GroupResult> = result.groups.iter().filter(|g| g.captors > 1).collect();
    if several.is_empty() {
        return;
    }
    let rows = group_rows(page, &several);
    let bands = shown_bands(page, result);
    let heads = bands.iter().map(|&band| named_per_area(result, band));
    let heads = ["captors".to_string()].into_iter().chain(heads);
    let title = format!("groups, mean {}", result.unit.irradiance);
    let mut table = Table::new(title, heads, ERRORS);
    type Values<'a> = (&'a [f64], &'a [Option<f64>]);
    type Of = for<'a> fn(&'a GroupResult) -> Option<Values<'a>>;
    let kinds: [(String, Of); 4] = [
        (String::new(), |group| Some((&group.front.irradiance, &group.front.irradiance_se))),
        (format!("    absorbed in all, {}", result.unit.flux), |group| {
            Some((group.absorbed.as_ref()?, group.absorbed_se.as_ref()?))
        }),
        ("      of light on the front".into(), |group| {
            let AbsorbedByFace { front, front_se, .. } = group.absorbed_by_face.as_deref()?;
            Some((front, front_se))
        }),
        ("      of light on the back".into(), |group| {
            let AbsorbedByFace { back, back_se, .. } = group.absorbed_by_face.as_deref()?;
            Some((back, back_se))
        }),
    ];
    for GroupRow { name, groups } in rows.iter().take(page.shown(SHOWN_GROUPS)) {
        let count = groups.len();
        for (k, (kind, of)) in kinds.iter().enumerate() {
            let found: Option<Vec<Values>> = groups.iter().map(|group| of(group)).collect();
            let Some(found) = found else { continue };
            let cells = bands.iter().map(|&band| {
                Spread::of(found.iter().map(|(values, _)| values[band]).collect()).range()
            });
            let relative = found.iter().flat_map(|(values, errors)| {
                bands.iter().filter_map(|&band| Some(errors[band]? / values[band]))
            });
            let (name, captors) = match (k, count) {
                (0, 1) => (format!("  {name}"), groups[0].captors.to_string()),
                (0, _) => {
                    let all = || groups.iter().map(|group| group.captors);
                    let [least, most] = [all().min(), all().max()].map(Option::unwrap_or_default);
                    let captors =
                        if least == most { format!("{least}") } else { format!("{least}-{most}") };
                    (format!("  {name} ({count})"), captors)
                }
                _ => (kind.clone(), String::new()),
            };
            table.row(name, [captors].into_iter().chain(cells), percent_of(relative.collect()));
            if k == 0 {
                own_rows(&mut table, groups);
            }
        }
    }
    table.below(text, page);
    text.push_str(&page.more(rows.len(), SHOWN_GROUPS));
}

/// Adds a row for each quantity of groups as a whole that has one value, a share of their area.
fn own_rows(table: &mut Table, groups: &[&GroupResult]) {
    for quantity in Quantity::own().filter(|quantity| quantity.per == Per::Place) {
        let found: Option<Vec<(f64, Option<f64>)>> =
            groups.iter().map(|group| group.own.one(quantity.name)).collect();
        let Some(found) = found else { continue };
        let relative = found.iter().filter(|(share, _)| *share > 0.0);
        let relative = relative.filter_map(|(share, error)| Some((*error)? / share)).collect();
        let share = Spread::of(found.iter().map(|(share, _)| *share).collect()).range();
        let name = format!("    {}, of the area", quantity.name);
        table.row(name, [String::new(), share], percent_of(relative));
    }
}

/// Writes what the light of each lamp costs, where it goes, and what groups have of it.
fn electricity(page: &Page, text: &mut String, result: &RunResult) {
    let Some(found) = &result.account.electricity else { return };
    let shown = ShownBands { bands: shown_bands(page, result), result };
    per_electricity(page, text, found, &shown);
    let Some(groups) = &found.groups else {
        let words = words![
            "  where it goes is not known, as other lights shine too: run with ",
            setting("by_light").on(),
            "\n"
        ];
        text.push_str(&words.spelled(page.spelling));
        return;
    };
    if let Some(all) = &found.shares {
        let mut table = Table::new("share of the light", shown.names(), "standard error");
        for (name, Share { share, share_se }) in all.all() {
            shown.line(&mut table, name, share, share_se);
        }
        table.below(text, page);
    }
    let planes = groups.iter().filter_map(|(name, group)| Some((name, group.plane.as_ref()?)));
    let planes: Vec<_> = planes.collect();
    let mut table = Table::new("planes of sensors", shown.names(), "standard error");
    for (name, plane) in planes.iter().take(page.shown(SHOWN_GROUPS)) {
        let Share { share, share_se } = &plane.share;
        let title = format!("{name}, share of {} m2", short(plane.area));
        shown.line(&mut table, &title, share, share_se);
        shown.line(&mut table, "  mol/kWh", &plane.mol_per_kwh, &plane.mol_per_kwh_se);
        shown.line(&mut table, "  kWh/mol", &plane.kwh_per_mol, &plane.kwh_per_mol_se);
    }
    some_groups(page, text, &table, planes.len());
    // what arrives on the small area of a sensor itself says little
    let groups = groups.iter().filter(|(_, group)| page.full || group.of == "absorbed");
    let groups: Vec<_> = groups.collect();
    let mut table = Table::new("share of groups", shown.names(), "standard error");
    for (name, group) in groups.iter().take(page.shown(SHOWN_GROUPS)) {
        let title = format!("{name}, {}", group.of);
        shown.line(&mut table, &title, &group.share.share, &group.share.share_se);
        shown.line(&mut table, "  mol/kWh", &group.mol_per_kwh, &group.mol_per_kwh_se);
    }
    some_groups(page, text, &table, groups.len());
}

/// Writes a table that has the first of so many groups, if it has rows.
fn some_groups(page: &Page, text: &mut String, table: &Table, count: usize) {
    if !table.is_empty() {
        table.below(text, page);
        text.push_str(&page.more(count, SHOWN_GROUPS));
    }
}

/// Writes the light of each lamp, and of all, over what it takes.
fn per_electricity(page: &Page, text: &mut String, found: &Electricity, shown: &ShownBands) {
    let with_watts = |watts: f64, values: &[f64]| {
        let values = shown.bands.iter().map(|&b| short(values[b]));
        once(short(watts)).chain(values).collect::<Vec<_>>()
    };
    let heads = once("W".to_string()).chain(shown.names());
    let mut table = Table::new("light per electricity", heads, "");
    let units = shown.bands.iter().map(|&b| found.unit[b].to_string());
    table.row("", once(String::new()).chain(units), "");
    for (name, lamp) in found.lights.iter().take(page.shown(SHOWN_GROUPS)) {
        table.row(format!("  {name}"), with_watts(lamp.watts, &lamp.per_watt), "");
    }
    let more = page.more(found.lights.len(), SHOWN_GROUPS);
    if !more.is_empty() {
        table.row(more.trim_end(), [], "");
    }
    table.row("  all", with_watts(found.watts, &found.per_watt), "");
    let PerKwh { mol_per_kwh, kwh_per_mol } = &found.grown;
    for (name, of) in [("  mol/kWh", mol_per_kwh), ("  kWh/mol", kwh_per_mol)] {
        // results of before do not have them
        if of.iter().any(Option::is_some) {
            table.row(name, once(String::new()).chain(shown.cells(of)), "");
        }
    }
    table.below(text, page);
}

/// The bands and sums that are shown of a result.
struct ShownBands<'a> {
    bands: Vec<usize>,
    result: &'a RunResult,
}

impl ShownBands<'_> {
    fn names(&self) -> impl Iterator<Item = String> {
        self.bands.iter().map(|&b| self.result.bands[b].name.clone())
    }

    fn cells(&self, of: &[Option<f64>]) -> Vec<String> {
        self.bands.iter().map(|&b| of[b].map_or("-".into(), short)).collect()
    }

    /// Adds a row of values with the largest of their standard errors, if any of them is known.
    fn line(&self, table: &mut Table, name: &str, of: &[Option<f64>], errors: &[Option<f64>]) {
        if self.bands.iter().any(|&b| of[b].is_some()) {
            let most = self.bands.iter().filter_map(|&b| errors[b]).fold(0.0, f64::max);
            table.row(format!("  {name}"), self.cells(of), format!("at most {}", short(most)));
        }
    }
}

/// Writes how even the irradiance on the fronts of each group of several sensors is; surfaces are
/// left out, since leaves are not meant to be lit evenly.
fn uniformity(page: &Page, text: &mut String, result: &RunResult) {
    let sensors = result.groups.iter().filter(|group| group.absorbed.is_none());
    let even = sensors.filter_map(|group| Some((&group.id, group.front.uniformity.as_deref()?)));
    let even: Vec<(&String, &Uniformity)> = even.collect();
    if even.is_empty() {
        return;
    }
    let cell = |value: Option<f64>, error: Option<f64>| match (value, error) {
        (Some(value), Some(error)) => with_error(value, error),
        (Some(value), None) => format!("{value:.4}"),
        (None, _) => "-".into(),
    };
    let mut table = Table::new("uniformity of groups", ["min / mean", "CV = SD / mean"], "");
    let mut bands = shown_bands(page, result);
    let shown = even.len().min(page.shown(SHOWN_GROUPS));
    let is_long = bands.len() > 1 && shown * bands.len() > page.shown(SHOWN_EVEN);
    if is_long {
        let sum = bands.iter().copied().find(|&b| result.bands[b].sum_of.is_some());
        bands = sum.or(bands.first().copied()).into_iter().collect();
    }
    for (name, even) in even.iter().take(shown) {
        for &b in &bands {
            let least = cell(even.min_over_mean[b], even.min_over_mean_se[b]);
            let cv = cell(even.cv[b], even.cv_se[b]);
            table.row(format!("  {name} {}", result.bands[b].name), [least, cv], "");
        }
    }
    table.below(text, page);
    if is_long {
        let words = words!["  and the other bands (", setting("full"), " has all)\n"];
        text.push_str(&words.spelled(page.spelling));
    }
    text.push_str(&page.more(even.len(), SHOWN_GROUPS));
}

/// Writes which shares of the light of sun and sky plants and ground take, per band.
fn canopy(page: &Page, text: &mut String, result: &RunResult) {
    let Some(canopy) = &result.extras.canopy else { return };
    let bands = shown_bands(page, result);
    let heads = bands.iter().map(|&b| result.bands[b].name.clone());
    let mut table = Table::new("share of sun and sky", heads, "");
    for (name, shares, errors) in canopy.shares() {
        let cell = |&b: &usize| match (shares[b], errors[b]) {
            (share, Some(error)) => with_error(share, error),
            (share, None) => format!("{share:.4}"),
        };
        let what = match name {
            "absorbed" => "absorbed by all but ground",
            "reflected" => "reflected upwards",
            "transmitted" => "arrived on the ground",
            _ => "absorbed by the ground",
        };
        table.row(format!("  {what}"), bands.iter().map(cell), "");
    }
    table.below(text, page);
}

/// Writes what the surface captors of each layer absorb per area, from the highest layer down.
fn layers(page: &Page, text: &mut String, result: &RunResult) {
    let Some(layers) = &result.extras.layers else { return };
    let bands = shown_bands(page, result);
    let own = Quantity::own().filter(|quantity| quantity.per == Per::Place);
    let has = |quantity: &&Quantity| layers.iter().any(|l| l.own.one(quantity.name).is_some());
    let own: Vec<&Quantity> = own.filter(has).collect();
    let own_heads = own.iter().map(|quantity| quantity.name.to_string());
    let heads = ["area, m2".to_string()].into_iter().chain(own_heads);
    let heads = heads.chain(bands.iter().map(|&b| result.bands[b].name.clone()));
    let title = format!("absorbed by layer, m: {}", result.unit.irradiance);
    let mut table = Table::new(title, heads, "");
    for layer in layers.iter().rev().take(page.shown(SHOWN_LAYERS)) {
        let per_area = |&b: &usize| match layer.area > 0.0 {
            true => short(layer.absorbed[b] / layer.area),
            false => "-".into(),
        };
        let share = |quantity: &&Quantity| {
            let found = layer.own.one(quantity.name);
            found.map_or("-".into(), |(share, _)| format!("{:.1} %", 100.0 * share))
        };
        let cells = [short(layer.area)].into_iter().chain(own.iter().map(share));
        let name = format!("  {} to {}", short(layer.from), short(layer.to));
        table.row(name, cells.chain(bands.iter().map(per_area)), "");
    }
    table.below(text, page);
    text.push_str(&page.more(layers.len(), SHOWN_LAYERS));
}

/// Adds how large the errors of the k-nearest estimates are, and how much of its captor each covers;
/// returns a line about those that cover much.
fn nearest(page: &Page, table: &mut Table, found: Vec<&NearestResult>) -> String {
    let bands = |knn: &&NearestResult| knn.irradiance.len().min(page.shown(SHOWN_BANDS));
    let errors: Vec<f64> = found
        .iter()
        .flat_map(|knn| {
            (0..bands(knn)).filter_map(|b| Some(knn.irradiance_se[b]? / knn.irradiance[b]))
        })
        .collect();
    if errors.is_empty() {
        return String::new();
    }
    let shares = found.iter().map(|knn| knn.coverage).collect();
    let rows = [("  knn, value at the middle", errors), ("    part of the area used", shares)];
    for (what, values) in rows {
        table.row(what, [String::new(), String::new(), String::new()], percent_of(values));
    }
    match found.iter().filter(|knn| knn.coverage > WIDE_DISC).count() {
        0 => String::new(),
        wide => format!(
            "    (on {wide} of {} faces more than half of it: use the irradiance, not knn)\n",
            found.len()
        ),
    }
}

/// Returns the least and the greatest of some numbers, of which there is at least one.
pub fn range(values: Vec<f64>) -> String {
    Spread::of(values).range()
}

struct Spread {
    min: f64,
    median: f64,
    max: f64,
}

impl Spread {
    /// Finds the least, the median and the largest of `values`, of which there is at least one.
    fn of(mut values: Vec<f64>) -> Self {
        values.sort_by(f64::total_cmp);
        let (min, max) = (values[0], values[values.len() - 1]);
        // the mean of the two in the middle, which may be one
        let [below, above] = [(values.len() - 1) / 2, values.len() / 2].map(|i| values[i]);
        Self { min, median: below + 0.5 * (above - below), max }
    }

    /// Returns the three numbers as cells.
    fn cells(&self) -> [String; 3] {
        [self.min, self.median, self.max].map(short)
    }

    /// Returns the least and the greatest number, in three digits where these tell them apart, which
    /// leaves room for other columns; once if they look the same in four.
    fn range(&self) -> String {
        let in_digits = |digits: usize| [self.min, self.max].map(|value| in_digits(value, digits));
        match [in_digits(3), in_digits(4)] {
            [_, [low, high]] if low == high => low,
            [[low, high], own] if low == high => own.join("-"),
            [three, _] => three.join("-"),
        }
    }
}

/// Returns the median of shares in percent, with the least and the greatest; `-` without any.
fn percent_of(shares: Vec<f64>) -> String {
    if shares.is_empty() {
        return "-".into();
    }
    let Spread { min, median, max } = Spread::of(shares);
    let [min, median, max] = [min, median, max].map(|share| two_digits(100.0 * share));
    match min == max {
        true => format!("{median} %"),
        false => format!("{median} ({min} to {max}) %"),
    }
}

/// Formats a number with two significant digits, and at most four decimals.
fn two_digits(value: f64) -> String {
    match value.abs() {
        v if v < 5e-5 => "0".into(),
        v if v < 1e6 => {
            // 0.996 is rounded to 1.0, not to 1.00
            let power = (v * (1.0 + 5e-3)).log10().floor() as i32;
            let decimals = (1 - power).clamp(0, 4) as usize;
            format!("{value:.decimals$}")
        }
        _ => format!("{value:.0e}"),
    }
}
#[cfg(test)]
mod tests {
    use super::*;

    /// Numbers that look the same in two digits look the same.
    #[test]
    fn shares_have_two_digits() {
        let cases = [(0.00994, "0.99 %"), (0.00996, "1.0 %"), (0.0101, "1.0 %"), (0.0996, "10 %")];
        for (share, text) in cases {
            assert_eq!(percent_of(vec![share]), text);
        }
        assert_eq!(percent_of(vec![0.00996, 0.0101, 0.0103]), "1.0 %");
        assert_eq!(percent_of(vec![0.5, 1.0]), "75 (50 to 100) %");
    }

    #[test]
    fn the_median_of_an_even_number_is_between_the_middle_ones() {
        for (values, median) in
            [(vec![3.0], 3.0), (vec![5.0, 1.0], 3.0), (vec![9.0, 1.0, 2.0], 2.0)]
        {
            assert_eq!(Spread::of(values).median, median);
        }
        assert_eq!(Spread::of(vec![4.0, 8.0, 1.0, 9.0]).median, 6.0);
    }
}
