//! What a user should know before trusting the light of a year.

use super::{
    hours::Lamp,
    interpolated::MANY,
    part::{Part, too_few_photons},
    product::{Found, Wanted},
};
use phylux_core::transport::paths::Unseen;
use phylux_results::result::FEW_HISTORIES;

/// Fraction of the daylight above which sunlight that is not found hour by hour is worth a warning.
const UNSEEN: f64 = 1e-3;

/// Returns the warnings about what was `found` of the light of `parts` and of the `lamps` that are
/// switched.
pub(super) fn of_light(
    parts: &[Part],
    lamps: &[(usize, Lamp)],
    wanted: &Wanted,
    found: &Found,
    seed: u64,
) -> Vec<String> {
    let (all, by_hour) = (wanted.hours.len(), wanted.hours.iter().flatten().count());
    let unseen = Unseen::of_suns(parts[0].scene, seed);
    let others = [
        unseen.and_then(|unseen| unseen_sun(&unseen)),
        interpolated(found.interpolated, all),
        hours_by_few(found.by_few, by_hour),
        other_areas(parts),
        no_faces(parts),
    ];
    few_photons(parts, lamps).into_iter().chain(others.into_iter().flatten()).collect()
}

/// Returns warnings of captors on whose fronts too few photons of daylight, or of the lamps that are
/// lit, arrived to estimate an error.
fn few_photons(parts: &[Part], lamps: &[(usize, Lamp)]) -> Vec<String> {
    let is_lit = |(_, lamp): &&(usize, Lamp)| lamp.on.iter().any(|on| *on > 0.0);
    let lit: Vec<usize> = lamps.iter().filter(is_lit).map(|(lamp, _)| *lamp).collect();
    let daylight = parts
        .iter()
        .any(Part::has_light_by_photons)
        .then(|| too_few_photons(parts, "daylight", None));
    let of_lamps = (!lit.is_empty()).then(|| too_few_photons(parts, "the lamps", Some(&lit)));
    [daylight, of_lamps].into_iter().flatten().flatten().collect()
}

/// Returns a warning if at more than a few captors and groups the light of hours is less sure
/// because it is interpolated than because of chance.
fn interpolated(many: usize, all: usize) -> Option<String> {
    (many as f64 > MANY * all as f64).then(|| {
        format!(
            "hours are interpolated: at {many} of {all} captors and groups this makes up most of their errors; \
             sums are right; run an hour that matters by itself (docs/year.md#warnings-of-a-year)"
        )
    })
}

/// Returns a warning if at more than a few captors and groups most hours are found by few photons:
/// an hour has the photons of four bundles of suns alone, where sums have those of all.
fn hours_by_few(few: usize, all: usize) -> Option<String> {
    (few as f64 > MANY * all as f64).then(|| {
        format!(
            "hours have few photons: at {few} of {all} captors and groups fewer than some {FEW_HISTORIES} make up \
             most hours; sums have more; trace more, or use groups (docs/year.md#warnings-of-a-year)"
        )
    })
}

/// Returns a warning of sunlight that is mirrored or refracted but not found hour by hour; `None` if
/// there is hardly any.
fn unseen_sun(unseen: &Unseen) -> Option<String> {
    let share = unseen.share();
    (share > UNSEEN).then(|| {
        format!(
            "about {:.2} % of the daylight is sunlight by way of several or curved mirrors (unseen): single hours may \
             be wrong by more than their errors, sums are right (docs/year.md#warnings-of-a-year)",
            100.0 * share
        )
    })
}

/// Returns a warning if captors are larger or smaller in some states than in the first scene.
fn other_areas(parts: &[Part]) -> Option<String> {
    let captors = parts[0].scene.captors();
    let differs = |captor: &usize| {
        let area = |part: &Part| part.scene.captors()[*captor].area;
        parts.iter().any(|part| (area(part) / area(&parts[0]) - 1.0).abs() > 1e-9)
    };
    let mut others = (0..captors.len()).filter(differs);
    let first = others.next()?;
    Some(format!(
        "states change the areas of {} of {} captors (`{}` is the first): light is per m2 of the area at the \
         time (docs/year.md#warnings-of-a-year)",
        1 + others.count(),
        captors.len(),
        captors[first].id
    ))
}

/// Returns a warning if the scene asks for what surfaces absorb on each face: a year has their sum.
fn no_faces(parts: &[Part]) -> Option<String> {
    parts[0].scene.asked().absorbed_by_face.then(|| {
        "`absorbed_by_face`: a year tells what surfaces absorb on both faces together; run an hour for each face \
         (docs/year.md#warnings-of-a-year)"
            .into()
    })
}
