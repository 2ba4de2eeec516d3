//! What a run found, on one screen.

use std::fmt::Write;

use crate::{
    result::{CaptorResult, FaceResult, NearestResult, RunResult},
    settings::Estimator,
};

/// More bands than this are not shown.
pub(super) const SHOWN_BANDS: usize = 8;
/// Share of the emitted power above which lost power is warned of.
const MUCH_LOST: f64 = 1e-3;
/// Blocks below which standard errors are off by more than a fifth: their own relative error is
/// 1 / sqrt(2 (blocks - 1)).
const FEW_BLOCKS: u64 = 16;
/// Photons below which a value and its error are not reliable.
const FEW_PHOTONS: u64 = 30;
/// Share of a captor above which a gather disc is no longer local.
const WIDE_DISC: f64 = 0.5;

pub(super) struct Summary {
    pub(super) text: String,
    pub(super) warnings: Vec<String>,
}

/// `reason`: why it ended, behind a comma.
pub(super) fn summary(result: &RunResult, reason: &str) -> Summary {
    let mut text = String::new();
    let _ = writeln!(
        text,
        "{}: {} {} in {} blocks, seed {}{reason}",
        result.scene, result.photons, result.estimator, result.blocks, result.seed
    );
    if let Some(why) = &result.chosen {
        let _ = writeln!(text, "{} were chosen: {why}", result.estimator);
    }
    energy(&mut text, result);
    let mut kinds = vec![("sensor", "virtual"), ("surface", "surface")];
    kinds.retain(|(_, kind)| result.captors.iter().any(|captor| captor.kind == *kind));
    for (title, kind) in kinds {
        captors(&mut text, result, title, kind);
    }
    Summary { text, warnings: warnings(result) }
}

fn energy(text: &mut String, result: &RunResult) {
    let energy = &result.energy;
    if energy.emitted.is_empty() {
        return;
    }
    let unit = &result.unit.flux;
    let _ = writeln!(
        text,
        "\n{:<24}{:>11}{:>11}{:>11}{:>11}",
        format!("energy, {unit}"),
        "emitted",
        "absorbed",
        "escaped",
        "lost"
    );
    for (b, band) in result.bands.iter().enumerate().take(SHOWN_BANDS) {
        let _ = writeln!(
            text,
            "  {:<22}{:>11}{:>11}{:>11}{:>11}",
            band.name,
            short(energy.emitted[b]),
            short(energy.absorbed[b]),
            short(energy.escaped[b]),
            short(energy.lost[b])
        );
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
        for (b, band) in result.bands.iter().enumerate().take(SHOWN_BANDS) {
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
                format!("{name} {}", band.name),
                short(irradiance.min),
                short(irradiance.median),
                short(irradiance.max),
            );
        }
    }
    let faces = result.captors.iter().filter(|c| c.kind == kind).flat_map(CaptorResult::faces);
    nearest(text, faces.filter_map(|face| face.knn.as_ref()?.as_ref()).collect());
}

/// How sure and how local the k-nearest estimates are.
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
    /// Of at least one value.
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

/// Four digits, however large or small.
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

fn warnings(result: &RunResult) -> Vec<String> {
    let mut warnings = Vec::new();
    let energy = &result.energy;
    let lost =
        energy.lost.iter().zip(&energy.emitted).map(|(l, e)| if *e > 0.0 { l / e } else { 0.0 });
    let lost = lost.fold(0.0, f64::max);
    if lost > MUCH_LOST {
        warnings.push(format!(
            "{:.2} % of the power was on paths cut off at the length limits (lost)",
            100.0 * lost
        ));
    }
    let cut_off = result.cut_off.unwrap_or(0.0);
    if cut_off > MUCH_LOST {
        warnings.push(format!(
            "{:.2} % of the paths were cut off at the length limits: light that they could still \
             have found is missing",
            100.0 * cut_off
        ));
    }
    match result.blocks {
        1 => warnings.push("one block: no standard error is known; trace more".into()),
        blocks if blocks < FEW_BLOCKS => warnings.push(format!(
            "the standard errors come from {blocks} blocks only and are rough themselves; trace more"
        )),
        _ => {}
    }
    let unseen = result.unseen.iter().flatten().copied().fold(0.0, f64::max);
    if unseen > 0.0 {
        warnings.push(format!(
            "paths cannot find light of a point, spot or line that comes by way of mirrors or \
             refraction: about {:.2} % of the flux on the captors is missing; \
             --estimator photons finds it",
            100.0 * unseen
        ));
    }
    let lit = |face: &FaceResult| face.flux.iter().any(|&flux| flux > 0.0);
    let reached =
        |captor: &CaptorResult| lit(&captor.front) || captor.back.as_ref().is_some_and(lit);
    let dark: Vec<&str> =
        result.captors.iter().filter(|c| !reached(c)).map(|c| c.id.as_str()).collect();
    if !dark.is_empty() {
        let nothing = match result.estimator {
            Estimator::Paths => "no path found light from",
            _ => "no photon reached",
        };
        warnings.push(format!("{nothing} {}", some(&dark)));
    }
    let faces = || result.captors.iter().flat_map(CaptorResult::faces);
    let few = faces().filter(|face| face.few_paths).count();
    if few > 0 {
        warnings.push(format!(
            "the errors at {few} of {} faces of captors rest on few paths that found much light, as \
             by way of a glossy reflector: values and errors may be far too small, and where no \
             path found any; trace more, or --estimator photons",
            faces().count()
        ));
    }
    let faint = |face: &FaceResult| lit(face) && face.photons < FEW_PHOTONS;
    let rough: Vec<&str> = match result.estimator {
        Estimator::Paths => Vec::new(),
        _ => {
            let rough = |c: &&CaptorResult| faint(&c.front) || c.back.as_ref().is_some_and(faint);
            result.captors.iter().filter(rough).map(|c| c.id.as_str()).collect()
        }
    };
    if !rough.is_empty() {
        warnings.push(format!(
            "fewer than {FEW_PHOTONS} photons on a face of {}: neither their values nor their \
             errors are reliable; trace more, or try --estimator paths",
            some(&rough)
        ));
    }
    warnings
}

/// The first few names, and how many more.
fn some(names: &[&str]) -> String {
    const LISTED: usize = 5;
    let more = match names.len().saturating_sub(LISTED) {
        0 => String::new(),
        more => format!(" and {more} more"),
    };
    names[..names.len().min(LISTED)].join(", ") + &more
}
