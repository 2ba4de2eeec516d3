//! The plot of the power that plants absorbed: each plant, and each rank of their leaves.

use indexmap::IndexMap;

use super::{
    chosen::{Chosen, error_bar, nothing},
    colours::Names,
    drawing::{Drawn, Plot},
    lying::{Row, columns},
    organ::Organ,
};
use crate::chart::{Chart, Series, Stroke};
use phylux_core::{
    error::{Result, setting},
    words,
};
use phylux_results::result::{CaptorResult, FaceResult};

/// Limit on the number of objects with a colour of their own.
const MOST: usize = 12;
/// The most objects that have a row with their name each, and the most plants with bars of errors: more
/// of these hide the marks.
const NAMED: usize = 24;
const WITH_BARS: usize = 100;
/// Ground faces up or down: the least cosine between its mean normal and the vertical. Flat ground has
/// it within the second number of 1.
const LEVEL: f64 = 0.7;
const FLAT: f64 = 1e-4;
/// Ground lies no higher above the lowest object than this part of the extent of all captors.
const LAYER: f64 = 0.05;

/// A sum of absorbed powers, W or umol/s.
#[derive(Clone, Copy, Default)]
struct Power {
    value: f64,
    variance: f64,
    count: usize,
}

impl Power {
    fn add(&mut self, value: f64, error: Option<f64>) {
        self.value += value;
        self.variance += error.unwrap_or(0.0).powi(2);
        self.count += 1;
    }
}

#[derive(Default)]
struct Plant {
    all: Power,
    ranks: IndexMap<u32, Power>,
}

/// The plants of each object, by instance.
type Objects<'a> = IndexMap<&'a str, IndexMap<Option<&'a str>, Plant>>;

pub(super) fn plants(chosen: &Chosen) -> Result<Plot> {
    let mut objects: Objects = IndexMap::new();
    let ground = if chosen.patterns.is_empty() { ground(chosen) } else { Vec::new() };
    for captor in chosen.captors() {
        if ground.contains(&captor.id.split('/').next().unwrap_or_default()) {
            continue;
        }
        let Some((power, error)) = absorbed(captor, chosen.band) else { continue };
        let Organ { object, instance, rank } = Organ::of(&captor.id);
        let plant = objects.entry(object).or_default().entry(instance).or_default();
        plant.all.add(power, error);
        if let Some(rank) = rank {
            plant.ranks.entry(rank).or_default().add(power, error);
        }
    }
    if objects.is_empty() {
        return Err(nothing(
            "no surface is a captor, so nothing says what was absorbed",
            words![
                "give objects `\"captor\": true` in the scene, or plot something else (",
                setting("show"),
                ")"
            ],
        ));
    }
    // surfaces that are neither instances nor ranks have names in place of numbers
    let single = !has_many(&objects) && objects.len() <= NAMED;
    // leaves share photons, so their errors are correlated; the errors of groups take that into
    // account
    for (object, plants) in &mut objects {
        for (instance, plant) in plants {
            let id = instance.map_or(object.to_string(), |i| format!("{object}#{i}"));
            let group = chosen.result.groups.iter().find(|group| group.id == id);
            if let Some(group) = group.filter(|group| group.captors == plant.all.count)
                && let (Some(values), Some(errors)) = (&group.absorbed, &group.absorbed_se)
            {
                plant.all.value = values[chosen.band];
                plant.all.variance = errors[chosen.band].unwrap_or(0.0).powi(2);
            }
        }
    }
    let [unit, _] = chosen.result.units(chosen.band);
    let names = &chosen.names();
    let chart = |title: String, x: &str, y: String, series: Vec<Series>| Chart {
        title,
        x: x.into(),
        y,
        linear_x: true,
        linear_y: true,
        // the first and the last stand clear of the ends
        x_ends: ends_across(&series),
        x_counts: true,
        series,
        ..Chart::default()
    };
    let band = chosen.of_band();
    let amount = format!("absorbed, {unit}");
    let named = if single { by_object(&objects, names, &band, &amount) } else { None };
    let mut charts = vec![named.unwrap_or_else(|| {
        chart(format!("absorbed by each plant{band}"), "plant", amount, by_plant(&objects, names))
    })];
    let ranks = by_rank(&objects, names);
    if !ranks.is_empty() {
        charts.push(chart(
            format!("absorbed by rank, mean over plants{band}"),
            "rank of the leaf",
            format!("absorbed per plant, {unit}"),
            ranks,
        ));
    }
    Ok(Plot { drawn: Drawn::Charts(charts), notes: Vec::new() })
}

/// Makes the plot of plants, if there are instances or ranks of leaves. Error: there are none.
pub(super) fn plants_of_many(chosen: &Chosen) -> Result<Plot> {
    let is_part = |captor: &CaptorResult| {
        let Organ { instance, rank, .. } = Organ::of(&captor.id);
        captor.absorbed.is_some() && (instance.is_some() || rank.is_some())
    };
    match chosen.captors().any(is_part) {
        true => plants(chosen),
        false => Err(nothing(
            "there are no plants",
            words!["plot something else (", setting("show"), ")"],
        )),
    }
}

/// Returns whether there are instances or ranks of leaves.
fn has_many(objects: &Objects) -> bool {
    let mut plants = objects.values().flatten();
    plants.any(|(instance, plant)| instance.is_some() || !plant.ranks.is_empty())
}

/// Returns the objects that are ground and no plants: they are the lowest, and have neither instances
/// nor ranks of leaves. Their surfaces are flat, or face up or down and have light on one side alone;
/// ground may also rise and fall. What is left is one object at least.
fn ground<'a>(chosen: &Chosen<'a>) -> Vec<&'a str> {
    let mut objects: IndexMap<&str, Vec<&CaptorResult>> = IndexMap::new();
    for captor in chosen.captors().filter(|captor| captor.absorbed.is_some()) {
        objects.entry(Organ::of(&captor.id).object).or_default().push(captor);
    }
    let extent = (0..3).map(|axis| {
        let places = || chosen.result.captors.iter().map(move |captor| captor.center[axis]);
        let ends = places().reduce(f64::min).zip(places().reduce(f64::max));
        ends.map_or(0.0, |(low, high)| high - low)
    });
    let extent = extent.fold(0.0, f64::max);
    // the mean over the area
    let height = |captors: &[&CaptorResult], of: fn(&CaptorResult) -> f64| {
        let area: f64 = captors.iter().map(|captor| captor.area).sum();
        captors.iter().map(|captor| captor.area * of(captor)).sum::<f64>() / area
    };
    let mut heights: Vec<(&str, f64, bool)> = objects
        .iter()
        .map(|(name, captors)| {
            let steepness = height(captors, |captor| captor.normal[2]).abs();
            let middle = height(captors, |captor| captor.center[2]);
            let bare = captors.iter().all(|captor| {
                let Organ { instance, rank, .. } = Organ::of(&captor.id);
                instance.is_none() && rank.is_none()
            });
            let level = |captor: &&CaptorResult| (captor.center[2] - middle).abs() <= FLAT * extent;
            let flat = steepness > 1.0 - FLAT && captors.iter().all(level);
            let lit = |face: &FaceResult| face.flux.iter().any(|flux| *flux > 0.0);
            let one_sided = |captor: &&CaptorResult| {
                !lit(&captor.front) || !captor.back.as_ref().is_some_and(lit)
            };
            let below = flat || steepness > LEVEL && captors.iter().all(one_sided);
            (*name, middle, bare && below)
        })
        .collect();
    heights.sort_by(|a, b| a.1.total_cmp(&b.1));
    let Some(&(_, lowest, _)) = heights.first() else { return Vec::new() };
    let found: Vec<&str> = heights
        .iter()
        .take_while(|(_, height, is_ground)| *is_ground && height - lowest <= LAYER * extent)
        .map(|(name, ..)| *name)
        .collect();
    if found.len() < objects.len() { found } else { Vec::new() }
}

fn absorbed(captor: &CaptorResult, band: usize) -> Option<(f64, Option<f64>)> {
    Some((captor.absorbed.as_ref()?[band], captor.absorbed_se.as_ref()?[band]))
}

/// Returns the name and colour of the series of each object.
fn styles(objects: &Objects, names: &Names) -> Vec<(Option<String>, usize)> {
    let all: Vec<&str> = objects.keys().copied().collect();
    let short = |object: &&str| Some(object.chars().take(24).collect());
    match all.len() <= MOST {
        true => all.iter().map(short).zip(names.colours(&all)).collect(),
        false => {
            let name = |i: usize| (i == 0).then(|| format!("{} objects", all.len()));
            (0..all.len()).map(|i| (name(i), 0)).collect()
        }
    }
}

/// Returns half a step more to both sides than whole places have.
fn ends_across(series: &[Series]) -> Option<[f64; 2]> {
    let places = series.iter().flat_map(|series| series.points.iter().map(|p| p.0.round()));
    let ends = places.fold(None, |ends: Option<[f64; 2]>, x| {
        let [low, high] = ends.unwrap_or([x, x]);
        Some([low.min(x), high.max(x)])
    });
    ends.map(|[low, high]| [low - 0.5, high + 0.5])
}

/// Draws the objects one below the other, in the order of the file.
fn by_object(objects: &Objects, names: &Names, band: &str, amount: &str) -> Option<Chart> {
    let styles = styles(objects, names);
    let all = objects.iter().zip(styles).flat_map(|((name, plants), (_, colour))| {
        plants.values().map(move |plant| (name, plant.all, colour))
    });
    let row = |(name, power, colour): (&&str, Power, usize)| Row {
        name: name.to_string(),
        value: power.value,
        error: Some(power.variance.sqrt()),
        colour,
    };
    columns(format!("absorbed by each object{band}"), amount, all.map(row).collect())
}

/// Makes the series of plants side by side, in the order of the file.
fn by_plant(objects: &Objects, names: &Names) -> Vec<Series> {
    let mut series = Vec::new();
    let mut number = 0.0;
    let with_bars = objects.values().map(IndexMap::len).sum::<usize>() <= WITH_BARS;
    for (plants, (name, colour)) in objects.values().zip(styles(objects, names)) {
        let (mut points, mut bars) = (Vec::new(), Vec::new());
        for plant in plants.values() {
            number += 1.0;
            points.push((number, plant.all.value));
            let error = plant.all.variance.sqrt();
            bars.extend(error_bar(number, plant.all.value, with_bars.then_some(error), false));
        }
        series.push(Series { name: None, colour, stroke: Stroke::Bars, points: bars });
        series.push(Series { name, colour, stroke: Stroke::Marks, points });
    }
    series
}

/// Makes the series of means over the plants of an object for each rank; single plants are dots.
fn by_rank(objects: &Objects, names: &Names) -> Vec<Series> {
    let mut series = Vec::new();
    let has_ranks = |plants: &&IndexMap<_, Plant>| plants.values().any(|p| !p.ranks.is_empty());
    let count = objects.values().filter(has_ranks).count();
    let mut before = 0;
    for (plants, (name, colour)) in objects.values().zip(styles(objects, names)) {
        let mut ranks: IndexMap<u32, Vec<Power>> = IndexMap::new();
        for (rank, power) in plants.values().flat_map(|plant| &plant.ranks) {
            ranks.entry(*rank).or_default().push(*power);
        }
        if ranks.is_empty() {
            continue;
        }
        ranks.sort_unstable_keys();
        // objects stand beside each other where their values may be the same
        let aside = match count {
            1 => 0.0,
            _ => 0.1 * (2.0 * f64::from(before) / (count as f64 - 1.0) - 1.0),
        };
        before += 1;
        let place = |rank: &u32| f64::from(*rank) + aside;
        let dots = ranks
            .iter()
            .flat_map(|(rank, all)| all.iter().map(move |power| (place(rank), power.value)));
        let means: Vec<(f64, f64, f64)> = ranks
            .iter()
            .map(|(rank, all)| {
                let count = all.len() as f64;
                let sum = |of: fn(&Power) -> f64| all.iter().map(of).sum::<f64>();
                let error = sum(|power| power.variance).sqrt() / count;
                (place(rank), sum(|power| power.value) / count, error)
            })
            .collect();
        let bars = means.iter().flat_map(|m| error_bar(m.0, m.1, Some(m.2), false));
        let add = |name, stroke, points| Series { name, colour, stroke, points };
        let several = plants.len() > 1;
        let dots = if several { dots.collect() } else { Vec::new() };
        series.push(add(None, Stroke::Dots, dots));
        series.push(add(None, Stroke::Bars, bars.collect()));
        series.push(add(name, Stroke::Line, means.iter().map(|m| (m.0, m.1)).collect()));
    }
    series
}
