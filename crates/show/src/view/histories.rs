//! How light reaches captors, for the page: shares by light and last surface, and histories as lines.

use std::io;

use serde_json::{Value, json};

use super::{
    arrays::{Arrays, shorts},
    shapes::quantised,
};
use crate::{following::Followed, rendered::RenderedScene};
use phylux_core::{
    math::{geometry::Extent, stats::Estimate},
    transport::histories::{Contribution, HistoryLine, LastSurface, Origin},
};

/// The most groups of a captor that are told apart; the rest are one.
const MOST_GROUPS: usize = 30;

/// Returns the facts of the page about what it follows.
pub(super) fn facts(rendered: &RenderedScene) -> Option<Value> {
    let Followed { column, captors } = rendered.followed.as_ref()?;
    let scene = rendered.scene;
    let index = |index: Option<usize>| index.map_or(-1, |i| i as i64);
    let group = |(origin, own): &(Origin, Contribution)| {
        let Origin { light, last } = *origin;
        let short = |value: f64| value as f32;
        let share = own.share.iter().map(|share| share.as_ref().map(|share| short(share.mean)));
        let error = |share: &Option<Estimate>| share.as_ref()?.standard_error.map(short);
        json!({
            "light": scene.lights()[light].name,
            "object": last.map(|last: LastSurface| index(last.object)),
            "material": last.map(|last| last.material),
            "histories": own.histories,
            "share": share.collect::<Vec<_>>(),
            "error": own.share.iter().map(error).collect::<Vec<_>>(),
        })
    };
    let own = captors.iter().map(|(captor, found)| {
        json!({
            "captor": captor,
            "photons": found.photons,
            "histories": found.whole.histories,
            "lines": found.lines.len(),
            "groups": found.groups.iter().take(MOST_GROUPS).map(group).collect::<Vec<_>>(),
            "more": found.groups.len().saturating_sub(MOST_GROUPS),
        })
    });
    let extent = extent(captors.iter().flat_map(|(_, found)| &found.lines));
    Some(json!({
        "band": column,
        "captors": own.collect::<Vec<_>>(),
        "min": extent.min.to_array(),
        "size": extent.size().to_array(),
    }))
}

/// Adds the lines: their places, how many places each has, and the number of its group; one beyond the
/// last group stands for all others.
pub(super) fn add(arrays: &mut Arrays, rendered: &RenderedScene) -> io::Result<()> {
    let Some(Followed { captors, .. }) = &rendered.followed else { return Ok(()) };
    let lines = || captors.iter().flat_map(|(_, found)| &found.lines);
    let extent = extent(lines());
    let places = lines().flat_map(|line| &line.points);
    arrays.add("historyPlaces", shorts(places.flat_map(|p| quantised(*p, &extent))))?;
    arrays.add("historySizes", shorts(lines().map(|line| line.points.len() as u16)))?;
    let groups = captors.iter().flat_map(|(_, found)| {
        let group = |line: &HistoryLine| {
            let place = found.groups.iter().position(|(origin, _)| *origin == line.origin);
            place.unwrap_or(MOST_GROUPS).min(MOST_GROUPS) as u8
        };
        found.lines.iter().map(group)
    });
    arrays.add("historyGroups", groups)
}

/// Returns a box around lines; a point where there are none.
fn extent<'l>(lines: impl Iterator<Item = &'l HistoryLine>) -> Extent {
    let mut points = lines.flat_map(|line| &line.points).copied().peekable();
    match points.peek() {
        Some(_) => Extent::of(points),
        None => Extent::of([glam::Vec3::ZERO]),
    }
}
