//! Plots of a sweep: the light that groups of captors receive, against each parameter.

use std::{cmp::Reverse, collections::BTreeMap};

use phylux_core::math::pattern::without_copies;
use phylux_files::sweep_file::{Parameter, Run, Sweep};
use phylux_results::result::{PerBand, RunResult, light_name};
use phylux_show::chart::{Chart, Series, Stroke};

/// The largest number of groups that are drawn: as many as there are colours.
const GROUPS: usize = 6;
/// The largest number of values of a parameter that are drawn; more could not be told apart.
const VALUES: usize = 2000;
/// The largest number of plots of a sweep.
const PICTURES: usize = 100;

/// The contents of the plots, gathered run by run.
#[derive(Default)]
pub struct Responses {
    /// Name of the light in each band and sum, and its unit.
    lights: Vec<[String; 2]>,
    /// For each parameter, whether it has an axis.
    drawn: Vec<bool>,
    /// Names of the groups that are drawn, and the number of all groups.
    groups: Vec<String>,
    all_groups: usize,
    bands: Vec<String>,
    /// For each parameter and band: for each group and value, the sums over the runs.
    sums: BTreeMap<(usize, usize), BTreeMap<(usize, usize), Sum>>,
}

/// Sums over runs for the fronts of one group at one value of a parameter.
#[derive(Clone, Copy, Default)]
struct Sum {
    runs: f64,
    mean: f64,
    variance: f64,
    /// Sums of the least and of the greatest captor, if there are several captors.
    range: Option<[f64; 2]>,
}

impl Responses {
    /// Adds a run. The first run decides which groups are drawn: those with the most captors, and
    /// copies only where there is no group of all of them.
    pub fn add(&mut self, sweep: &Sweep, run: &Run, results: &RunResult) {
        if self.lights.is_empty() {
            let all = results.groups.iter().collect();
            let mut largest = without_copies(all, |group| group.id.as_str());
            self.all_groups = largest.len();
            largest.sort_by_key(|group| Reverse(group.captors));
            largest.truncate(GROUPS);
            self.drawn = sweep.parameters().iter().map(is_drawn).collect();
            let light = |of: usize| {
                let unit = results.bands[of].unit.as_ref().map(|unit| unit.irradiance.to_string());
                let unit = unit.unwrap_or_else(|| results.unit.irradiance.to_string());
                [light_name(&results.bands, Some(of), &results.unit.flux), unit]
            };
            self.lights = (0..results.bands.len()).map(light).collect();
            self.groups = largest.iter().map(|group| group.id.clone()).collect();
            self.bands = results.bands.iter().map(|band| band.name.clone()).collect();
        }
        for (p, &index) in run.choices.iter().enumerate() {
            if index < VALUES && self.drawn[p] {
                self.add_value(p, index, results);
            }
        }
    }

    fn add_value(&mut self, parameter: usize, value: usize, results: &RunResult) {
        for (b, band) in results.bands.iter().enumerate() {
            let own = self.bands.iter().position(|name| *name == band.name);
            let Some(own) = own.filter(|own| parameter * self.bands.len() + own < PICTURES) else {
                continue;
            };
            let sums = self.sums.entry((parameter, own)).or_default();
            for group in &results.groups {
                let front = &group.front;
                let of = self.groups.iter().position(|name| *name == group.id);
                let (Some(g), Some(mean)) = (of, front.irradiance.get(b)) else { continue };
                let error = front.irradiance_se.get(b).copied().flatten();
                let end = |ends: &Option<Box<PerBand<f64>>>| ends.as_ref()?.get(b).copied();
                let sum = sums.entry((g, value)).or_default();
                sum.runs += 1.0;
                sum.mean += mean;
                sum.variance += error.unwrap_or(0.0).powi(2);
                if let (Some(min), Some(max)) = (end(&front.min), end(&front.max)) {
                    let [low, high] = sum.range.get_or_insert_default();
                    *low += min;
                    *high += max;
                }
            }
        }
    }

    /// Returns the plots with their names.
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
                let [mut ends, greatest] = [0, 1].map(|end| line(&|sum| Some(sum.range?[end])));
                ends.extend(greatest.into_iter().rev());
                add(None, Stroke::Band, ends);
            }
        }
        let [light, unit] = &self.lights[band];
        let mut title = format!("{light}: mean of each group");
        if series.iter().any(|series| series.stroke == Stroke::Band) {
            title += ", with the range of its captors";
        }
        if self.all_groups > self.groups.len() {
            title += &format!(" (the largest {} of {})", self.groups.len(), self.all_groups);
        }
        Chart {
            title,
            x: label(parameter),
            y: format!("{light}, {unit}"),
            linear_x: true,
            linear_y: true,
            series,
            ..Chart::default()
        }
    }
}

/// Returns the label of a parameter's axis: its name or, if that is only the name of what has the
/// number in the scene, the number's name too, such as `reflectance of sides`.
fn label(Parameter { name, at, .. }: &Parameter) -> String {
    let place = at.first().and_then(|at| at.rsplit_once('/'));
    match place.filter(|(of, _)| of.split('/').any(|part| part == name)) {
        Some((_, number)) => format!("{number} of {name}"),
        None => name.clone(),
    }
}

/// Returns whether a parameter has an axis: it has several values, all of them numbers.
fn is_drawn(parameter: &Parameter) -> bool {
    parameter.values.len() > 1 && parameter.values.iter().all(|value| value.is_number())
}

#[cfg(test)]
mod tests {
    use std::path::PathBuf;

    use serde_json::json;

    use phylux_core::math::units::Quantity;

    use super::*;

    /// Two seeds at each of two values; the expected means and errors are computed by hand.
    #[test]
    fn runs_of_one_value_are_averaged() {
        let file = json!({ "scene": "s.json", "vary": { "/power": [8, 5] }, "seeds": 2 });
        let sweep = Sweep::new("s", file, json!({ "power": 1 }), PathBuf::new()).expect("a sweep");
        let mut responses = Responses::default();
        for (run, mean) in sweep.runs().zip([1.0, 3.0, 4.0, 6.0]) {
            let none: [f64; 0] = [];
            let face = json!({ "photons": 1, "flux": [mean], "flux_se": [null],
                "irradiance": [mean], "irradiance_se": [0.3 + 0.1 * (mean - 1.0) / 2.0],
                "min": [mean - 1.0], "max": [mean + 2.0] });
            let results = json!({ "phylux": "0.1.0", "scene": "s", "seed": run.seed, "photons": 1,
                "blocks": 1, "estimator": "photons", "unit": Quantity::Watt.unit_names(),
                "bands": [{ "name": "all" }],
                "energy": { "power": [1], "emitted": null, "absorbed": null, "escaped": null, "lost": null },
                "captors": none, "groups": [{ "id": "g", "captors": 2, "area": 1, "front": face }] });
            let results = serde_json::from_value(results).expect("results");
            responses.add(&sweep, &run, &results);
        }
        let charts = responses.charts(&sweep);
        let [(name, chart)] = &charts[..] else { panic!("{charts:?}") };
        assert_eq!(name, "power");
        let [mean, bars, ends] = &chart.series[..] else { panic!("{chart:?}") };
        assert_eq!(mean.points, [(5.0, 5.0), (8.0, 2.0)]);
        assert_eq!((mean.stroke, bars.stroke), (Stroke::Line, Stroke::Bars));
        // errors of 0.3 and 0.4 give the mean an error of sqrt(0.09 + 0.16) / 2
        for (bar, expected) in bars.points[2..].iter().zip([1.75, 2.25]) {
            assert!((bar.1 - expected).abs() < 1e-12, "{:?}", bars.points);
        }
        // from the least of each and back along the greatest
        assert_eq!(ends.stroke, Stroke::Band);
        assert_eq!(chart.title, "irradiance: mean of each group, with the range of its captors");
        assert_eq!(ends.points, [(5.0, 4.0), (8.0, 1.0), (8.0, 4.0), (5.0, 7.0)]);
    }
}
