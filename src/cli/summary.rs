//! The summary of a result that fits on one screen, as `phylux run` prints it at its end.

use std::{collections::HashSet, fmt::Write};

use phylux_core::transport::settings::Guiding;
use phylux_results::result::{
    AbsorbedByFace, BandResult, CaptorResult, FaceResult, GroupResult, NearestResult, RunResult,
    Share, SumUnit, ToleranceResult, Uniformity, WorstResult,
};

/// The most bands that are shown.
pub(super) const SHOWN_BANDS: usize = 8;
/// The most groups that are shown.
const SHOWN_GROUPS: usize = 20;
/// The most layers that are shown.
const SHOWN_LAYERS: usize = 20;
/// Share of a captor's area above which the disc of a k-nearest estimate is no longer local.
const WIDE_DISC: f64 = 0.5;

pub(super) struct Summary {
    pub(super) text: String,
    pub(super) warnings: Vec<String>,
}

/// Makes the summary of a result; `reason` says why the run ended, after a comma.
pub(super) fn summary(result: &RunResult, reason: &str) -> Summary {
    let mut text = String::new();
    let _ = writeln!(
        text,
        "{}: {} {} in {} batches, seed {}{reason}",
        result.scene, result.photons, result.estimator, result.batches, result.seed
    );
    if let Some(photons) = result.photons_beside {
        let _ = writeln!(
            text,
            "with {photons} photons beside them, which count where they bring light that paths leave to them, and \
             whose energy this is"
        );
        let faces = || result.captors.iter().flat_map(CaptorResult::faces);
        let alone = faces().filter(|face| face.by_photons).count();
        if alone > 0 {
            let _ = writeln!(
                text,
                "all of them count at {alone} of {} faces of captors, from which no paths start",
                faces().count()
            );
        }
    }
    let guided = match result.guiding {
        Some(Guiding::Aim) => "with flights aimed at the sensors beside them (--guiding aim)",
        Some(Guiding::Full) => "guided by their importance for the captors (--guiding full)",
        _ => "",
    };
    if !guided.is_empty() {
        let _ = writeln!(text, "{guided}");
    }
    if let Some(why) = &result.chosen {
        let _ = writeln!(text, "{} were chosen: {why}", result.estimator);
    }
    if let Some(found) = &result.tolerance {
        tolerance(&mut text, result, found);
    }
    energy(&mut text, result);
    let mut kinds = vec![("sensor", "virtual"), ("surface", "surface")];
    kinds.retain(|(_, kind)| result.captors.iter().any(|captor| captor.kind == *kind));
    for (title, kind) in kinds {
        captors(&mut text, result, title, kind);
    }
    groups(&mut text, result);
    ratios(&mut text, result);
    electricity(&mut text, result);
    uniformity(&mut text, result);
    canopy(&mut text, result);
    layers(&mut text, result);
    let warnings = result.warnings().into_iter().map(|warning| warning.text).collect();
    Summary { text, warnings }
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
pub(super) fn far_off(worst: &WorstResult) -> String {
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
fn shown_bands(result: &RunResult) -> Vec<usize> {
    let (bands, sums): (Vec<usize>, Vec<usize>) =
        (0..result.bands.len()).partition(|&band| result.bands[band].sum_of.is_none());
    let sums = &sums[..sums.len().min(SHOWN_BANDS)];
    bands.into_iter().take(SHOWN_BANDS - sums.len()).chain(sums.iter().copied()).collect()
}

fn energy(text: &mut String, result: &RunResult) {
    let energy = &result.energy;
    if energy.emitted.is_empty() {
        return;
    }
    let unit = &result.unit.flux;
    // only daylight can miss the scene
    let daylight = !energy.missed.is_empty();
    let missed = if daylight { format!("{:>11}", "missed") } else { String::new() };
    let _ = writeln!(
        text,
        "\n{:<24}{:>11}{:>11}{:>11}{:>11}{missed}",
        format!("energy, {unit}"),
        "emitted",
        "absorbed",
        "escaped",
        "lost"
    );
    let shown = shown_bands(result);
    for &b in &shown {
        let name = named(&result.bands[b], |own| &own.flux, unit);
        let missed =
            if daylight { format!("{:>11}", short(energy.missed[b])) } else { String::new() };
        let _ = writeln!(
            text,
            "  {name:<22}{:>11}{:>11}{:>11}{:>11}{missed}",
            short(energy.emitted[b]),
            short(energy.absorbed[b]),
            short(energy.escaped[b]),
            short(energy.lost[b])
        );
    }
    if shown.len() < result.bands.len() {
        let more = result.bands.len() - shown.len();
        let _ = writeln!(text, "  and {more} more bands, here and below: the files have all");
    }
}

fn captors(text: &mut String, result: &RunResult, noun: &str, kind: &str) {
    let count = result.captors.iter().filter(|captor| captor.kind == kind).count();
    let s = if count == 1 { "" } else { "s" };
    let _ = writeln!(
        text,
        "\n{:<24}{:>11}{:>11}{:>11}   relative error",
        format!("{count} {noun}{s}, {}", result.unit.irradiance),
        "min",
        "median",
        "max"
    );
    type Face = fn(&CaptorResult) -> Option<&FaceResult>;
    let faces: [(&str, Face); 2] =
        [("front", |captor| Some(&captor.front)), ("back", |captor| captor.back.as_ref())];
    for (name, face) in faces {
        let faces: Vec<&FaceResult> =
            result.captors.iter().filter(|c| c.kind == kind).filter_map(face).collect();
        if faces.is_empty() {
            continue;
        }
        for b in shown_bands(result) {
            let irradiance = Spread::of(faces.iter().map(|face| face.irradiance[b]).collect());
            let relative = |face: &&FaceResult| Some(face.flux_se[b]? / face.flux[b]);
            let errors: Vec<f64> = faces.iter().filter_map(relative).collect();
            let errors = match errors.is_empty() {
                true => "-".to_string(),
                false => Spread::of(errors).percent(),
            };
            let _ = writeln!(
                text,
                "  {:<22}{:>11}{:>11}{:>11}   {errors}",
                format!("{name} {}", named_per_area(result, b)),
                short(irradiance.min),
                short(irradiance.median),
                short(irradiance.max),
            );
            let unit = &result.unit.dli;
            let dli = faces.iter().map(|face| face.dli.as_ref()?[b]).collect::<Option<Vec<_>>>();
            if let (Some(dli), Some(unit)) = (dli.map(Spread::of), unit) {
                let _ = writeln!(
                    text,
                    "  {:<22}{:>11}{:>11}{:>11}",
                    format!("  DLI, {unit}"),
                    short(dli.min),
                    short(dli.median),
                    short(dli.max),
                );
            }
        }
    }
    let faces = result.captors.iter().filter(|c| c.kind == kind).flat_map(CaptorResult::faces);
    nearest(text, faces.filter_map(|face| face.knn.as_ref()?.as_ref()).collect());
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
fn ratios(text: &mut String, result: &RunResult) {
    let mut title = "ratios";
    for (r, ratio) in result.ratios.iter().enumerate().take(SHOWN_BANDS) {
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
                if !std::mem::take(&mut title).is_empty() {
                    let _ = writeln!(
                        text,
                        "\n{:<24}{:>11}{:>11}{:>11}   standard error",
                        "ratios", "min", "median", "max"
                    );
                }
                let errors: Vec<f64> = found.iter().filter_map(|(_, error)| *error).collect();
                let errors = match errors.is_empty() {
                    true => "-".to_string(),
                    false => format!("median {}", short(Spread::of(errors).median)),
                };
                let values = Spread::of(found.iter().map(|(value, _)| *value).collect());
                let _ = writeln!(
                    text,
                    "  {:<22}{:>11}{:>11}{:>11}   {errors}",
                    format!("{}, {noun} {name}", ratio.name),
                    short(values.min),
                    short(values.median),
                    short(values.max),
                );
            }
        }
        let several = result.groups.iter().filter(|group| group.captors > 1);
        for group in several.take(SHOWN_GROUPS) {
            let found = [("mean", &group.front.ratios), ("absorbed", &group.absorbed_ratios)];
            for (what, found) in found {
                let Some((value, error)) = found.as_ref().and_then(|found| found.get(r)) else {
                    continue;
                };
                let error = error.map_or("-".into(), short);
                let name = format!("    {}, {what}", group.id);
                let _ = writeln!(text, "{name:<35}{:>11}{:>11}   {error}", short(value), "");
            }
        }
    }
}

/// Writes the mean irradiance of the fronts of each group of several captors, and what its surfaces
/// absorbed.
fn groups(text: &mut String, result: &RunResult) {
    let several: Vec<&GroupResult> = result.groups.iter().filter(|g| g.captors > 1).collect();
    if several.is_empty() {
        return;
    }
    let bands = shown_bands(result);
    let title = format!("groups, mean {}", result.unit.irradiance);
    let _ = write!(text, "\n{title:<24}{:>9}", "captors");
    for &band in &bands {
        let _ = write!(text, "{:>11}", named_per_area(result, band));
    }
    text.push_str("   relative error\n");
    let row = |text: &mut String, name: &str, values: &[f64], errors: &[Option<f64>]| {
        let values: Vec<f64> = bands.iter().map(|&band| values[band]).collect();
        let errors: Vec<Option<f64>> = bands.iter().map(|&band| errors[band]).collect();
        line(text, name, &values, &errors);
    };
    for group in several.iter().take(SHOWN_GROUPS) {
        let GroupResult { id, captors, front, absorbed, absorbed_se, .. } = group;
        let name = format!("  {id:<22}{captors:>9}");
        row(text, &name, &front.irradiance, &front.irradiance_se);
        if let (Some(absorbed), Some(errors)) = (absorbed, absorbed_se) {
            let name = format!("{:<33}", format!("    absorbed in all, {}", result.unit.flux));
            row(text, &name, absorbed, errors);
        }
        if let (Some(share), Some(error)) = (group.sunlit, group.sunlit_se) {
            line(text, &format!("{:<33}", "    sunlit, of the area"), &[share], &[Some(error)]);
        }
        if let Some(faces) = &group.absorbed_by_face {
            let AbsorbedByFace { front, front_se, back, back_se } = faces;
            for (face, values, errors) in [("front", front, front_se), ("back", back, back_se)] {
                let name = format!("{:<33}", format!("      of light on the {face}"));
                row(text, &name, values, errors);
            }
        }
    }
    if several.len() > SHOWN_GROUPS {
        let _ = writeln!(text, "  and {} more", several.len() - SHOWN_GROUPS);
    }
}

/// Writes what the light of each lamp costs, where it goes, and what groups have of it.
fn electricity(text: &mut String, result: &RunResult) {
    let Some(found) = &result.electricity else { return };
    let bands = shown_bands(result);
    let head = |text: &mut String, title: &str, column: &str| {
        let _ = write!(text, "\n{title:<24}{column:>9}");
        bands.iter().for_each(|&b| {
            let _ = write!(text, "{:>11}", result.bands[b].name);
        });
    };
    let cells = |value: &dyn Fn(usize) -> Option<f64>| -> String {
        let cell = |value: Option<f64>| value.map_or("-".into(), short);
        bands.iter().map(|&b| format!("{:>11}", cell(value(b)))).collect()
    };
    let known = |values: &[f64]| cells(&|b| Some(values[b]));
    head(text, "light per electricity", "W");
    let _ = write!(text, "\n{:<33}", "");
    bands.iter().for_each(|&b| {
        let _ = write!(text, "{:>11}", found.unit[b]);
    });
    text.push('\n');
    for (name, lamp) in found.lights.iter().take(SHOWN_GROUPS) {
        let _ = writeln!(text, "  {name:<22}{:>9}{}", short(lamp.watts), known(&lamp.per_watt));
    }
    if found.lights.len() > SHOWN_GROUPS {
        let _ = writeln!(text, "  and {} more", found.lights.len() - SHOWN_GROUPS);
    }
    let _ = writeln!(text, "  {:<22}{:>9}{}", "all", short(found.watts), known(&found.per_watt));
    let Some(groups) = &found.groups else {
        text.push_str(
            "  where it goes is not known, as other lights shine too: run with --by-light\n",
        );
        return;
    };
    let line = |text: &mut String, name: &str, of: &[Option<f64>], errors: &[Option<f64>]| {
        if bands.iter().any(|&b| of[b].is_some()) {
            let most = bands.iter().filter_map(|&b| errors[b]).fold(0.0, f64::max);
            let cells = cells(&|b| of[b]);
            let _ = writeln!(text, "  {name:<31}{cells}   at most {}", short(most));
        }
    };
    if let Some(all) = &found.shares {
        head(text, "share of the light", "");
        text.push_str("   standard error\n");
        for (name, Share { share, share_se }) in all.all() {
            line(text, name, share, share_se);
        }
    }
    head(text, "share of groups", "");
    text.push_str("   standard error\n");
    for (name, group) in groups.iter().take(SHOWN_GROUPS) {
        let title = format!("{name}, {}", group.of);
        line(text, &title, &group.share.share, &group.share.share_se);
        line(text, "  mol/kWh", &group.mol_per_kwh, &group.mol_per_kwh_se);
    }
    if groups.len() > SHOWN_GROUPS {
        let _ = writeln!(text, "  and {} more", groups.len() - SHOWN_GROUPS);
    }
}

/// Writes a line of values, with the range of their relative errors.
fn line(text: &mut String, name: &str, values: &[f64], errors: &[Option<f64>]) {
    let relative = values.iter().zip(errors).filter_map(|(value, error)| Some((*error)? / value));
    let relative: Vec<f64> = relative.collect();
    let spread = if relative.is_empty() { "-".into() } else { Spread::of(relative).percent() };
    let values: String = values.iter().map(|value| format!("{:>11}", short(*value))).collect();
    let _ = writeln!(text, "{name}{values}   {spread}");
}

/// Writes how even the irradiance on the fronts of each group of several sensors is; surfaces are
/// left out, since leaves are not meant to be lit evenly.
fn uniformity(text: &mut String, result: &RunResult) {
    let sensors = result.groups.iter().filter(|group| group.absorbed.is_none());
    let even = sensors.filter_map(|group| Some((&group.id, group.front.uniformity.as_ref()?)));
    let even: Vec<(&String, &Uniformity)> = even.collect();
    if even.is_empty() {
        return;
    }
    let cell = |value: Option<f64>, error: Option<f64>| match (value, error) {
        (Some(value), Some(error)) => format!("{value:.4} ± {error:.4}"),
        (Some(value), None) => format!("{value:.4}"),
        (None, _) => "-".into(),
    };
    let _ = writeln!(text, "\n{:<33}{:>20}{:>20}", "uniformity of groups", "min / mean", "CV");
    for (name, even) in even.iter().take(SHOWN_GROUPS) {
        for b in shown_bands(result) {
            let band = &result.bands[b];
            let least = cell(even.min_over_mean[b], even.min_over_mean_se[b]);
            let cv = cell(even.cv[b], even.cv_se[b]);
            let name = format!("  {name} {}", band.name);
            let _ = writeln!(text, "{name:<33}{least:>20}{cv:>20}");
        }
    }
    if even.len() > SHOWN_GROUPS {
        let _ = writeln!(text, "  and {} more", even.len() - SHOWN_GROUPS);
    }
}

/// Writes which shares of the light of sun and sky plants and ground take, per band.
fn canopy(text: &mut String, result: &RunResult) {
    let Some(canopy) = &result.canopy else { return };
    let bands = shown_bands(result);
    let names: String = bands.iter().map(|&b| format!("{:>20}", result.bands[b].name)).collect();
    let _ = writeln!(text, "\n{:<27}{names}", "share of sun and sky");
    for (name, shares, errors) in canopy.shares() {
        let cell = |&b: &usize| match (shares[b], errors[b]) {
            (share, Some(error)) => format!("{:>20}", format!("{share:.4} ± {error:.4}")),
            (share, None) => format!("{share:>20.4}"),
        };
        let cells: String = bands.iter().map(cell).collect();
        let what = match name {
            "absorbed" => "absorbed by all but ground",
            "reflected" => "reflected upwards",
            "transmitted" => "arrived on the ground",
            _ => "absorbed by the ground",
        };
        let _ = writeln!(text, "  {what:<27}{}", cells.trim_end().get(2..).unwrap_or_default());
    }
}

/// Writes what the surface captors of each layer absorb per area, from the highest layer down.
fn layers(text: &mut String, result: &RunResult) {
    let Some(layers) = &result.layers else { return };
    let bands = shown_bands(result);
    let names: String = bands.iter().map(|&b| format!("{:>14}", result.bands[b].name)).collect();
    let unit = &result.unit.irradiance;
    let sunlit = if layers.iter().any(|layer| layer.sunlit.is_some()) { "   sunlit" } else { "" };
    let _ = writeln!(
        text,
        "\n{:<24}{:>10}{sunlit}{names}   {unit}",
        "absorbed by layer, m", "area, m2"
    );
    for layer in layers.iter().rev().take(SHOWN_LAYERS) {
        let name = format!("  {} to {}", short(layer.from), short(layer.to));
        let per_area = |&b: &usize| match layer.area > 0.0 {
            true => format!("{:>14}", short(layer.absorbed[b] / layer.area)),
            false => format!("{:>14}", "-"),
        };
        let cells: String = bands.iter().map(per_area).collect();
        let share = match (layer.sunlit, sunlit) {
            (_, "") => String::new(),
            (Some(share), _) => format!("{:>7.1} %", 100.0 * share),
            (None, _) => format!("{:>9}", "-"),
        };
        let _ = writeln!(text, "{name:<24}{:>10}{share}{cells}", short(layer.area));
    }
    if layers.len() > SHOWN_LAYERS {
        let _ = writeln!(text, "  and {} more", layers.len() - SHOWN_LAYERS);
    }
}

/// Writes how large the errors of the k-nearest estimates are, and how much of its captor each
/// covers.
fn nearest(text: &mut String, found: Vec<&NearestResult>) {
    let bands = |knn: &&NearestResult| knn.irradiance.len().min(SHOWN_BANDS);
    let errors: Vec<f64> = found
        .iter()
        .flat_map(|knn| {
            (0..bands(knn)).filter_map(|b| Some(knn.irradiance_se[b]? / knn.irradiance[b]))
        })
        .collect();
    if errors.is_empty() {
        return;
    }
    let shares = found.iter().map(|knn| knn.coverage).collect();
    for (what, spread) in [
        ("  error of the k nearest, at the middle", errors),
        ("    share of the captor that they cover", shares),
    ] {
        let _ = writeln!(text, "{what:<57}   {}", Spread::of(spread).percent());
    }
    let wide = found.iter().filter(|knn| knn.coverage > WIDE_DISC).count();
    if wide > 0 {
        let faces = found.len();
        let _ = writeln!(
            text,
            "    (more than half on {wide} of {faces} faces: there irradiance says more than knn)"
        );
    }
}

struct Spread {
    min: f64,
    median: f64,
    max: f64,
}

impl Spread {
    /// Finds the least, the middle and the largest of `values`, of which there is at least one.
    fn of(mut values: Vec<f64>) -> Self {
        values.sort_by(f64::total_cmp);
        let (min, max) = (values[0], values[values.len() - 1]);
        Self { min, median: values[values.len() / 2], max }
    }

    fn percent(&self) -> String {
        if self.min == self.max {
            return format!("{:.2} %", 100.0 * self.min);
        }
        format!(
            "{:.2} to {:.2} %, median {:.2} %",
            100.0 * self.min,
            100.0 * self.max,
            100.0 * self.median
        )
    }
}

/// Formats a number with four significant digits, however large or small it is.
pub(super) fn short(value: f64) -> String {
    match value.abs() {
        0.0 => "0".into(),
        v if (1e-3..1e6).contains(&v) => {
            let decimals = (3 - v.log10().floor() as i32).clamp(0, 6) as usize;
            format!("{value:.decimals$}")
        }
        _ => format!("{value:.3e}"),
    }
}
