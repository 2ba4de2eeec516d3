//! Charts of a convergence study, and its findings in words.

use std::fmt::Write;

use super::{ConvergenceStudy, Rung, bounces::Within};
use crate::show::chart::{Chart, Series, Stroke};

/// The relative error for which the words give the cost.
const GOAL: f64 = 0.01;
/// Runs of less CPU time, s, have a figure of merit that is that of starting.
const STARTED: f64 = 0.2;
/// The greatest error of light beyond a number of bounces, relative to it, that is drawn.
const KNOWN: f64 = 0.5;
/// The share of light for which the words give the number of bounces.
const NEARLY_ALL: f64 = 0.999;

impl ConvergenceStudy {
    /// Names of all charts that [`charts`](Self::charts) may return.
    pub const CHARTS: [&str; 5] = ["error", "bias", "merit", "bounces", "map"];

    /// Returns the charts with the names of their files.
    pub fn charts(&self) -> Vec<(&'static str, Chart)> {
        let mut charts = vec![
            ("error", self.error_chart()),
            ("bias", self.bias_chart()),
            ("merit", self.merit_chart()),
            ("bounces", self.bounce_chart()),
        ];
        if self.rungs.iter().any(|rung| rung.arrivals.is_some()) {
            charts.push(("map", self.map_chart()));
        }
        charts
    }

    fn estimators(&self) -> Vec<&str> {
        let mut names: Vec<&str> = Vec::new();
        for rung in &self.rungs {
            if !names.contains(&rung.estimator.as_str()) {
                names.push(&rung.estimator);
            }
        }
        names
    }

    fn rungs_of(&self, estimator: &str) -> impl Iterator<Item = &Rung> {
        self.rungs.iter().filter(move |rung| rung.estimator == estimator)
    }

    /// Returns the lines of a chart, one series for each estimator.
    fn series(
        &self,
        stroke: Stroke,
        name: impl Fn(&str) -> Option<String>,
        point: impl Fn(&Rung) -> (f64, f64),
    ) -> Vec<Series> {
        let estimators = self.estimators().into_iter().enumerate();
        let one = |(colour, estimator): (usize, &str)| Series {
            name: name(estimator),
            colour,
            stroke,
            points: self.rungs_of(estimator).map(&point).collect(),
        };
        estimators.map(one).collect()
    }

    fn error_chart(&self) -> Chart {
        let named = |name: &str| Some(name.to_string());
        let mut series = self.series(Stroke::Line, named, |rung| (rung.cpu_seconds, rung.error));
        for (colour, estimator) in self.estimators().into_iter().enumerate() {
            let rows = self.rows.iter().filter(|row| row.estimator == estimator);
            let points = rows.map(|row| (row.cpu_seconds, row.error)).collect();
            series.push(Series { name: None, colour, stroke: Stroke::Dots, points });
        }
        series.extend(self.guide());
        Chart {
            title: format!("{}: error against cost", self.scene),
            x: "CPU time, s".into(),
            y: "relative RMS error of irradiance".into(),
            series,
            levels: vec![("error of the reference".into(), self.floor)],
            ..Chart::default()
        }
    }

    /// Returns a line that falls as noise does, below the first estimator.
    fn guide(&self) -> Option<Series> {
        let first = self.rungs.first()?;
        let last = self.rungs_of(&first.estimator).last()?;
        let (x, y) = (first.cpu_seconds, 0.5 * first.error);
        let end = last.cpu_seconds;
        let points = vec![(x, y), (end, y * (x / end).sqrt())];
        let name = Some("slope −1/2".into());
        Some(Series { name, colour: Series::GREY, stroke: Stroke::Dashed, points })
    }

    fn bias_chart(&self) -> Chart {
        let named = |name: &str| Some(name.to_string());
        let mut series = self.series(Stroke::Line, named, |r| (r.photons as f64, r.spread));
        // summed flux has no bias, except what noise makes look like one
        let biased = |r: &Rung| (r.photons as f64, r.arrivals.map_or(f64::NAN, |_| r.bias));
        let biases = self.series(Stroke::Hollow, |_| None, biased);
        let known = |s: &Series| s.points.iter().any(|(_, y)| y.is_finite() && *y > 0.0);
        let biases: Vec<Series> = biases.into_iter().filter(known).collect();
        if !biases.is_empty() {
            let meaning = |name: &str, stroke| Series {
                name: Some(name.into()),
                colour: Series::GREY,
                stroke,
                points: Vec::new(),
            };
            series.push(meaning("spread", Stroke::Line));
            series.push(meaning("bias, where noise is not all of it", Stroke::Hollow));
        }
        series.extend(biases);
        Chart {
            title: format!("{}: bias and spread", self.scene),
            x: "photons or paths".into(),
            y: "relative RMS over captors".into(),
            series,
            levels: vec![("error of the reference".into(), self.floor)],
            ..Chart::default()
        }
    }

    fn merit_chart(&self) -> Chart {
        let named = |name: &str| Some(name.to_string());
        let mut series = self.series(Stroke::Line, named, |rung| (rung.cpu_seconds, rung.merit));
        let started = |(seconds, _): &(f64, f64)| *seconds >= STARTED;
        if series.iter().any(|series| series.points.iter().filter(|p| started(p)).count() > 1) {
            for series in &mut series {
                // a run that took less time than one of fewer photons was not alone on its processor
                let mut longest = 0.0;
                series.points.retain(|point| {
                    let goes_on = started(point) && point.0 > longest;
                    longest = point.0.max(longest);
                    goes_on
                });
            }
            series.retain(|series| !series.points.is_empty());
        }
        Chart {
            title: format!("{}: figure of merit", self.scene),
            x: "CPU time, s".into(),
            y: "1 / (relative variance × time), 1/s".into(),
            series,
            ..Chart::default()
        }
    }

    fn bounce_chart(&self) -> Chart {
        let rows = &self.bounces.rows;
        // studies of before do not have errors: of so many photons at most so many arrived, and a
        // root mean square that is far above the mean comes from few values
        let arrived = |row: &Within| self.bounces.photons as f64 * (1.0 - row.share);
        let share = |row: &Within| {
            let missing = 1.0 - row.share;
            let error = row.share_se.unwrap_or(missing / arrived(row).sqrt());
            (missing, error)
        };
        let values = (self.compared as f64).sqrt();
        let spread = |row: &Within| {
            let few = row.error / ((1.0 - row.share) * values);
            (row.error, row.noise.unwrap_or(row.error * few))
        };
        let series = |name: &str, colour: usize, y: &dyn Fn(&Within) -> (f64, f64)| {
            let known = rows.iter().map(|row| (row, y(row)));
            // what comes after it is known less
            let known = known.take_while(|(_, (value, error))| *error <= KNOWN * value);
            let points = known.map(|(row, (value, _))| (f64::from(row.bounces), value)).collect();
            Series { name: Some(name.into()), colour, stroke: Stroke::Line, points }
        };
        Chart {
            title: format!("{}: light beyond a number of bounces", self.scene),
            x: "bounces kept".into(),
            y: "what is missing, relative".into(),
            linear_x: true,
            series: vec![
                series("RMS over captors", 0, &spread),
                series("share of all light", 1, &share),
            ],
            ..Chart::default()
        }
    }

    fn map_chart(&self) -> Chart {
        let named = |name: &str| Some(name.to_string());
        let stored = |rung: &Rung| (rung.arrivals.unwrap_or(f64::NAN), rung.error);
        let mut series = self.series(Stroke::Line, named, stored);
        series.retain(|series| series.points.iter().any(|(x, _)| x.is_finite()));
        Chart {
            title: format!("{}: error against map size", self.scene),
            x: "arrivals in the photon map".into(),
            y: "relative RMS error of irradiance".into(),
            series,
            levels: vec![("error of the reference".into(), self.floor)],
            ..Chart::default()
        }
    }

    /// Returns the findings in words, one sentence on each line.
    pub fn words(&self) -> String {
        let mut text = String::new();
        let mut unbiased = Vec::new();
        for estimator in self.estimators() {
            let Some(last) = self.rungs_of(estimator).last() else { continue };
            match last.arrivals {
                None => unbiased.push(cost(last)),
                Some(_) => {
                    let _ = writeln!(text, "{}", self.nearest_words(last));
                }
            }
        }
        let percent = 100.0 * GOAL;
        text.insert_str(
            0,
            &format!("{percent} % at the median captor: {}.\n", unbiased.join("; ")),
        );
        let share = 100.0 * NEARLY_ALL;
        if let Some(bounces) = self.bounces.within(NEARLY_ALL) {
            let _ = writeln!(text, "{share} % of the light arrives within {bounces} bounces.");
        }
        let left_out = match self.left_out {
            0 => String::new(),
            n => format!("; {n} that it does not know to 5 % are left out"),
        };
        let _ = writeln!(
            text,
            "Errors are against {} ({:.2} % standard error), over {} values above 0{left_out}.",
            self.reference,
            100.0 * self.floor,
            self.compared
        );
        text
    }

    /// Says whether a k-nearest estimate still improves, and what limits it.
    fn nearest_words(&self, last: &Rung) -> String {
        let rungs: Vec<&Rung> = self.rungs_of(&last.estimator).collect();
        // rung of a tenth of the budget; noise alone would have fallen by sqrt(10) since
        let before = rungs[rungs.len().saturating_sub(3)];
        let percent = |value: f64| format!("{:.2} %", 100.0 * value);
        let limits = format!("spread {}, bias {}", percent(last.spread), percent(last.bias));
        let (error, photons) = (percent(last.error), last.photons as f64);
        match last.error > 0.8 * before.error {
            true => format!("{} stop improving at {error} ({limits}).", last.estimator),
            false => format!("{}: {error} at {photons:.1e} photons ({limits}).", last.estimator),
        }
    }
}

/// Says what time and how many photons the goal takes at the median captor.
fn cost(rung: &Rung) -> String {
    let factor = (rung.median_spread / GOAL).powi(2);
    let (seconds, photons) = (factor * rung.cpu_seconds, factor * rung.photons as f64);
    format!("{}, {} s ({photons:.1e})", rung.estimator, two_digits(seconds))
}

fn two_digits(value: f64) -> String {
    let decimals = (1.0 - value.log10().floor()).clamp(0.0, 6.0) as usize;
    format!("{value:.decimals$}")
}
