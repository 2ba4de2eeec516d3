//! Pictures: what groups of captors receive against each parameter.

use std::{cmp::Reverse, collections::BTreeMap};

use crate::{
    chart::{Chart, Series, Stroke},
    result_file::ResultsFile,
    sweep_file::{Parameter, Run, Sweep},
};

/// Groups that are drawn: as many as there are colours.
const GROUPS: usize = 6;
/// Values of a parameter that are drawn; more would be a blot.
const VALUES: usize = 2000;
/// Pictures of a sweep.
const PICTURES: usize = 100;

/// What the pictures show, gathered run by run.
#[derive(Default)]
pub struct Responses {
    unit: String,
    /// Names of the drawn groups, and how many there are.
    groups: Vec<String>,
    all_groups: usize,
    bands: Vec<String>,
    /// By parameter and band: by group and value, sums over the runs.
    sums: BTreeMap<(usize, usize), BTreeMap<(usize, usize), Sum>>,
}

/// Fronts of one group at one value: sums over runs.
#[derive(Clone, Copy, Default)]
struct Sum {
    runs: f64,
    mean: f64,
    variance: f64,
    /// Of the least and the greatest captor, where there are several.
    range: Option<[f64; 2]>,
}

impl Responses {
    /// Takes in one run; the first one decides which groups are drawn: those with the most captors.
    pub fn add(&mut self, sweep: &Sweep, run: &Run, results: &ResultsFile) {
        if self.unit.is_empty() {
            let mut largest: Vec<_> = results.groups.iter().collect();
            largest.sort_by_key(|group| Reverse(group.captors));
            largest.truncate(GROUPS);
            self.unit = results.unit.irradiance.clone();
            self.groups = largest.iter().map(|group| group.values.id.clone()).collect();
            self.all_groups = results.groups.len();
            self.bands = results.bands.iter().map(|band| band.name.clone()).collect();
        }
        let drawn = sweep.parameters().iter().enumerate().filter(|(_, p)| is_drawn(p));
        for ((p, _), index) in drawn.map(|(p, parameter)| ((p, parameter), run.choices[p])) {
            if index >= VALUES {
                continue;
            }
            for (b, band) in results.bands.iter().enumerate() {
                let Some(own) = self.bands.iter().position(|name| *name == band.name) else {
                    continue;
                };
                if p * self.bands.len() + own >= PICTURES {
                    continue;
                }
                let sums = self.sums.entry((p, own)).or_default();
                for group in &results.groups {
                    let front = &group.values.front;
                    let of = self.groups.iter().position(|name| *name == group.values.id);
                    let (Some(g), Some(mean)) = (of, front.irradiance.get(b)) else { continue };
                    let sum = sums.entry((g, index)).or_default();
                    sum.runs += 1.0;
                    sum.mean += mean;
                    sum.variance += front.irradiance_se[b].unwrap_or(0.0).powi(2);
                    if let (Some(min), Some(max)) = (&front.min, &front.max) {
                        let [low, high] = sum.range.get_or_insert_default();
                        *low += min[b];
                        *high += max[b];
                    }
                }
            }
        }
    }

    /// The pictures, with what each is of.
    pub fn charts(&self, sweep: &Sweep) -> Vec<(String, Chart)> {
        let charts = self.sums.iter().map(|((p, b), sums)| {
            let parameter = &sweep.parameters()[*p];
            let name = match self.bands.len() {
                1 => parameter.name.clone(),
                _ => format!("{} {}", parameter.name, self.bands[*b]),
            };
            (
                name.trim_start_matches('/').to_string(),
                self.chart(parameter, *b, sums, sweep.is_scattered()),
            )
        });
        charts.collect()
    }

    fn chart(
        &self,
        parameter: &Parameter,
        band: usize,
        sums: &BTreeMap<(usize, usize), Sum>,
        scattered: bool,
    ) -> Chart {
        let value = |index: usize| parameter.values[index].as_f64().unwrap_or_default();
        let mut series = Vec::new();
        for (colour, group) in self.groups.iter().enumerate() {
            let mut found: Vec<(f64, Sum)> = sums
                .iter()
                .filter(|((g, _), _)| *g == colour)
                .map(|((_, index), sum)| (value(*index), *sum))
                .collect();
            found.sort_by(|a, b| a.0.total_cmp(&b.0));
            let line = |y: &dyn Fn(&Sum) -> Option<f64>| -> Vec<(f64, f64)> {
                found.iter().filter_map(|(x, sum)| Some((*x, y(sum)? / sum.runs))).collect()
            };
            let mut add = |name: Option<&String>, stroke, points: Vec<(f64, f64)>| {
                if !points.is_empty() {
                    series.push(Series { name: name.cloned(), colour, stroke, points });
                }
            };
            add(
                Some(group),
                if scattered { Stroke::Dots } else { Stroke::Line },
                line(&|sum| Some(sum.mean)),
            );
            let bars = found.iter().flat_map(|(x, sum)| {
                let (mean, error) = (sum.mean / sum.runs, sum.variance.sqrt() / sum.runs);
                [(*x, mean - error), (*x, mean + error)]
            });
            add(None, Stroke::Bars, bars.collect());
            if !scattered {
                for end in 0..2 {
                    add(None, Stroke::Dashed, line(&|sum| Some(sum.range?[end])));
                }
            }
        }
        let mut title = format!("{}, mean of each group", self.bands[band]);
        if self.all_groups > self.groups.len() {
            title += &format!(" (the largest {} of {})", self.groups.len(), self.all_groups);
        }
        Chart {
            title,
            x: parameter.name.clone(),
            y: match sums.values().any(|sum| sum.range.is_some()) && !scattered {
                true => format!("irradiance, {} (dashed: least and greatest captor)", self.unit),
                false => format!("irradiance, {}", self.unit),
            },
            linear_x: true,
            linear_y: true,
            series,
            levels: Vec::new(),
        }
    }
}

/// Whether a parameter has an axis.
fn is_drawn(parameter: &Parameter) -> bool {
    parameter.values.len() > 1 && parameter.values.iter().all(|value| value.is_number())
}
