//! Names of series beside what is drawn of them, so that no legend is needed.

use super::{
    axes::Frame,
    paper::{Place, length, px},
    series::{Series, Stroke},
};

/// Half the height of a name with the space around it, layout units.
const HALF: i32 = px(6);
/// Distances of a name from the point beside it: to the next letter, and to the middle of letters
/// above or below.
const ASIDE: i32 = px(7);
const ABOVE: i32 = px(11);
const FAR_ABOVE: i32 = px(18);
/// What it costs a name to stand above or below a point and not at an end, level with it, or farther
/// away, and to be as near to another series; one that is moved up or down from an end costs twice as
/// far as it is moved. It never stands nearer to another series than to its own.
const ON_LINE: i32 = px(20);
const LEVEL: i32 = px(25);
const FAR: i32 = px(35);
const NEAR_OTHER: i32 = px(40);
/// The most points of a series at which its name may stand.
const POINTS: usize = 40;

/// The middle of a name, and half its width.
pub(super) type Label = (Place, i32);

/// Returns whether a series has its name beside it, if there is room.
pub(super) fn is_labelled(series: &Series) -> bool {
    use Stroke::{Dashed, Hollow, Level, Line, Marks, Plain};
    let fits = matches!(series.stroke, Line | Plain | Dashed | Hollow | Marks | Level);
    fits && series.name.is_some() && !series.points.is_empty()
}

/// Returns the room that names at the ends of lines need beyond a frame.
pub(super) fn room_beyond(
    frame: &Frame,
    all: &[Series],
    shown: impl Fn(&(f64, f64)) -> bool + Copy,
) -> i32 {
    let lines = all.iter().filter(|series| {
        is_labelled(series) && !matches!(series.stroke, Stroke::Marks | Stroke::Level)
    });
    let beyond = lines.filter_map(|series| {
        let end = frame.place(*series.runs(shown).last()?.last()?);
        // where the end is within the frame, it moves less than the side of the frame does
        let width = f64::from(frame.right - frame.left);
        let share = f64::from(end.0 - frame.left) / width;
        let left = width - f64::from(ASIDE + 2 * half_of(series));
        Some((width - left / share.max(0.1)).ceil() as i32)
    });
    beyond.max().unwrap_or(0).max(0)
}

/// Returns where names stand, in the order of the series, left of `end`; `None` if one finds no room.
pub(super) fn labels(
    frame: &Frame,
    end: i32,
    all: &[Series],
    shown: impl Fn(&(f64, f64)) -> bool + Copy,
) -> Option<Vec<Option<Label>>> {
    let drawn: Vec<Vec<Place>> = all.iter().map(|series| series.covered(frame, shown)).collect();
    let mut placed: Vec<Option<Label>> = Vec::new();
    for (series, own) in all.iter().zip(&drawn) {
        if !is_labelled(series) {
            placed.push(None);
            continue;
        }
        let half = half_of(series);
        let within = |at: Place, p: &Place, more: i32| {
            (p.0 - at.0).abs() < half + more && (p.1 - at.1).abs() < HALF + more
        };
        let is_free = |at: Place| {
            let inside = at.0 - half > frame.left
                && at.0 + half <= end
                && at.1 - HALF >= frame.top - px(4)
                && at.1 + HALF <= frame.bottom;
            let apart = |&((x, y), other): &Label| {
                (x - at.0).abs() >= half + other + px(6) || (y - at.1).abs() >= 2 * HALF
            };
            inside
                && placed.iter().flatten().all(apart)
                && !drawn.iter().flatten().any(|p| within(at, p, 0))
        };
        let near_other = |at: Place| {
            let others = all.iter().zip(&drawn).filter(|(other, _)| other.colour != series.colour);
            others.flat_map(|(_, places)| places).any(|p| within(at, p, px(5)))
        };
        // how far a name is from what is drawn, in squares
        let far = |at: Place, places: &[Place]| {
            let beyond = |a: i32, b: i32, half: i32| i64::from(((a - b).abs() - half).max(0));
            let of = |p: &Place| beyond(p.0, at.0, half).pow(2) + beyond(p.1, at.1, HALF).pow(2);
            places.iter().map(of).min().unwrap_or(i64::MAX)
        };
        let nearer_other = |at: Place| {
            let is_other = |other: &Series| {
                other.colour != series.colour
                    && !matches!(other.stroke, Stroke::Dots | Stroke::Level)
            };
            let mut others = all.iter().zip(&drawn).filter(|(other, _)| is_other(other));
            let own = far(at, own);
            series.stroke != Stroke::Level && others.any(|(_, places)| far(at, places) < own)
        };
        let free = places(series, frame, half, shown).into_iter();
        let free = free.filter(|(at, _)| is_free(*at) && !nearer_other(*at));
        let best =
            free.min_by_key(|&(at, cost)| cost + if near_other(at) { NEAR_OTHER } else { 0 });
        placed.push(Some((best?.0, half)));
    }
    Some(placed)
}

fn half_of(series: &Series) -> i32 {
    // letters of other fonts are a little wider
    length(series.name.as_deref().unwrap_or_default()) * 29 / 50 + px(1)
}

/// Returns places for the middle of a series' name, with their costs.
fn places(
    series: &Series,
    frame: &Frame,
    half: i32,
    shown: impl Fn(&(f64, f64)) -> bool,
) -> Vec<(Place, i32)> {
    let points: Vec<Place> =
        series.runs(shown).into_iter().flatten().map(|&point| frame.place(point)).collect();
    let Some(&(x, y)) = points.last() else { return Vec::new() };
    match series.stroke {
        Stroke::Marks => {
            let middle = points.iter().map(|p| p.0).sum::<i32>() / points.len() as i32;
            let ends = points.iter().fold((y, y), |(top, low), p| (top.min(p.1), low.max(p.1)));
            vec![((middle, ends.0 - ABOVE), 0), ((middle, ends.1 + ABOVE), ON_LINE)]
        }
        Stroke::Level => {
            let ends = [frame.right - half, frame.left + half + ASIDE];
            let beside = |x: i32| [((x, y - px(8)), 0), ((x, y + px(8)), 1)];
            ends.into_iter().flat_map(beside).collect()
        }
        _ => {
            let moved = |step: i32| ((x + ASIDE + half, y + step * px(5)), 2 * step.abs() * px(5));
            let beside = |&(x, y): &Place| {
                [
                    ((x, y - ABOVE), ON_LINE),
                    ((x, y + ABOVE), ON_LINE),
                    ((x, y - FAR_ABOVE), FAR),
                    ((x, y + FAR_ABOVE), FAR),
                    ((x + ASIDE + half, y), LEVEL),
                    ((x - ASIDE - half, y), LEVEL),
                ]
            };
            let every = points.len().div_ceil(POINTS);
            let on_line = points.iter().rev().step_by(every).flat_map(beside);
            (-8..=8).map(moved).chain(on_line).collect()
        }
    }
}
