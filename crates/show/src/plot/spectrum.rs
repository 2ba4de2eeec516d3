//! The plot of irradiance per nanometre.

use std::collections::HashMap;

use super::{
    chosen::{Chosen, error_bar, nothing},
    drawing::{Drawn, Plot},
};
use crate::chart::{Chart, Series, Stroke};
use phylux_core::{
    error::{Result, setting},
    math::pattern::apart,
    words,
};
use phylux_results::result::{BandResult, FaceResult, GroupResult, light_word};

/// Limit on the number of captors or groups in one picture, each with a colour of its own.
const MOST: usize = 7;

pub(super) fn spectrum(chosen: &Chosen) -> Result<Plot> {
    let result = chosen.result;
    let width = |band: &BandResult| match (band.from_nm, band.to_nm, &band.sum_of) {
        (Some(from), Some(to), None) if to > from => Some((from, to)),
        _ => None,
    };
    let mut bands: Vec<(usize, (f64, f64))> =
        result.bands.iter().enumerate().filter_map(|(b, band)| Some((b, width(band)?))).collect();
    if bands.is_empty() {
        return Err(nothing(
            "no band has wavelengths, so there is no spectrum to draw",
            "give the scene's bands `from_nm` and `to_nm`",
        ));
    }
    bands.sort_by(|a, b| a.1.0.total_cmp(&b.1.0));
    let groups: Vec<(&str, &FaceResult)> =
        groups(chosen).into_iter().map(|group| (group.id.as_str(), &group.front)).collect();
    let captors: Vec<(&str, &FaceResult)> =
        chosen.named_captors().map(|captor| (captor.id.as_str(), &captor.front)).collect();
    // many captors are better shown by their groups, unless some are asked for
    let by_group = captors.is_empty()
        || chosen.patterns.is_empty() && captors.len() > MOST && !groups.is_empty();
    let (what, all) = if by_group { ("groups", groups) } else { ("captors", captors) };
    if all.is_empty() {
        return Err(nothing("there are no captors", "run a scene with sensors or captors"));
    }
    let mut notes = Vec::new();
    if all.len() > MOST {
        notes.push(words![
            format!("{} {what}, of which the first {MOST} are drawn: choose with ", all.len()),
            setting("captors")
        ]);
    }
    let drawn: Vec<(&str, &FaceResult)> = all.into_iter().take(MOST).collect();
    let colours = chosen.names().colours(&drawn.iter().map(|(id, _)| *id).collect::<Vec<_>>());
    let mut series = Vec::new();
    for ((id, face), colour) in drawn.into_iter().zip(colours) {
        let (mut steps, mut bars) = (Vec::new(), Vec::new());
        for &(band, (from, to)) in &bands {
            let per_nm = |value: f64| value / (to - from);
            let value = per_nm(face.irradiance[band]);
            steps.extend([(from, value), (to, value)]);
            let error = face.irradiance_se[band].map(per_nm);
            bars.extend(error_bar((from + to) / 2.0, value, error, false));
        }
        let name = Some(id.chars().take(26).collect());
        series.push(Series { name: None, colour, stroke: Stroke::Bars, points: bars });
        series.push(Series { name, colour, stroke: Stroke::Plain, points: steps });
    }
    let light = light_word(&result.unit.flux);
    let chart = Chart {
        title: format!("{light} by wavelength"),
        x: "wavelength, nm".into(),
        y: format!("{light}, {}/nm", result.unit.irradiance),
        linear_x: true,
        linear_y: true,
        series,
        ..Chart::default()
    };
    Ok(Plot { drawn: Drawn::Charts(vec![chart]), notes })
}

/// Returns the groups that are drawn. Instances of an object are alike, groups of the same captors are the
/// same, and those of a larger group are shown by it: they are drawn only if they are asked for.
fn groups<'a>(chosen: &Chosen<'a>) -> Vec<&'a GroupResult> {
    let result = chosen.result;
    let mut groups: Vec<&GroupResult> = Vec::new();
    for group in result.groups.iter().filter(|group| chosen.takes(&group.id)) {
        let is_same =
            |other: &&GroupResult| other.area == group.area && other.front.flux == group.front.flux;
        if !chosen.patterns.is_empty() || !group.id.contains('#') && !groups.iter().any(is_same) {
            groups.push(group);
        }
    }
    if chosen.patterns.is_empty() {
        let mut members: HashMap<&str, Vec<usize>> = HashMap::new();
        for (i, captor) in result.captors.iter().enumerate() {
            for group in captor.groups.iter().flatten() {
                members.entry(group).or_default().push(i);
            }
        }
        let own =
            |group: &&GroupResult| members.get(group.id.as_str()).map_or(&[][..], Vec::as_slice);
        groups = apart(groups, |group| group.id.as_str(), own, result.captors.len());
    }
    groups
}
