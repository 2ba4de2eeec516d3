//! Charts of a convergence study, and its findings in words.

use std::fmt::Write;

use super::{ConvergenceStudy, Rung, bounces::Within};
use phylux_show::chart::{Chart, Series, Stroke};

/// The relative error for which the words give the cost.
const GOAL: f64 = 0.01;
/// Budgets of which starting takes a greater share of the CPU time are not drawn against time.
const STARTING: f64 = 0.5;
/// Estimates from the photon map are drawn where the largest map leaves one of them less than so much
/// of the error of the smallest.
const IMPROVED: f64 = 0.7;
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
        // a map says nothing where no estimate becomes better with more of it
        let maps = self.map_chart();
        let improves = |series: &Series| {
            let ends = series.points.first().zip(series.points.last());
            ends.is_some_and(|((_, first), (_, last))| *last < IMPROVED * first)
        };
        if maps.series.iter().any(improves) {
            charts.push(("map", maps));
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

    /// Returns the CPU seconds that an estimator takes to start: what a line through its two smallest
    /// budgets has at no photons.
    fn starting(&self, estimator: &str) -> f64 {
        let rungs: Vec<&Rung> = self.rungs_of(estimator).take(2).collect();
        let [one, two] = rungs[..] else { return 0.0 };
        let each = (two.cpu_seconds - one.cpu_seconds)
            / two.photons.saturating_sub(one.photons).max(1) as f64;
        (one.cpu_seconds - each * one.photons as f64).clamp(0.0, one.cpu_seconds)
    }

    /// Returns a value of each budget over the CPU time that it takes beside starting, one series for
    /// each estimator. Budgets that mostly start are left out, but for the last two.
    fn over_time(&self, value: impl Fn(&Rung, f64) -> f64) -> Vec<Series> {
        let of = |(colour, estimator): (usize, &str)| {
            let starting = self.starting(estimator);
            let rungs: Vec<&Rung> = self.rungs_of(estimator).collect();
            let known = |rung: &&&Rung| starting <= STARTING * rung.cpu_seconds;
            let first = rungs.len() - rungs.iter().filter(known).count();
            let first = first.min(rungs.len().saturating_sub(2));
            let points = rungs[first..].iter().map(|rung| {
                let seconds = rung.cpu_seconds - starting;
                (seconds, value(rung, seconds))
            });
            let (name, points) = (Some(estimator.to_string()), points.collect());
            Series { name, colour, stroke: Stroke::Line, points }
        };
        self.estimators().into_iter().enumerate().map(of).collect()
    }

    fn error_chart(&self) -> Chart {
        let mut series = self.over_time(|rung, _| rung.error);
        series.extend(guide(&series));
        Chart {
            title: format!("{}: error against cost", self.scene),
            x: "CPU time without starting, s".into(),
            y: "relative RMS error of irradiance".into(),
            series,
            levels: vec![("error of the reference".into(), self.floor)],
            ..Chart::default()
        }
    }

    fn bias_chart(&self) -> Chart {
        let panel = |estimator: &str| {
            let series = |name: &str, colour, stroke, value: &dyn Fn(&Rung) -> f64| {
                let points =
                    self.rungs_of(estimator).map(|rung| (rung.photons as f64, value(rung)));
                Series { name: Some(name.into()), colour, stroke, points: points.collect() }
            };
            let spread = series("spread", 0, Stroke::Line, &|rung| rung.spread);
            // summed flux has no bias, except what noise makes look like one
            let bias = |rung: &Rung| rung.arrivals.map_or(f64::NAN, |_| rung.bias);
            let bias = series("bias, where noise is not all of it", 1, Stroke::Hollow, &bias);
            (estimator.to_string(), vec![spread, bias])
        };
        Chart {
            title: format!("{}: bias and spread", self.scene),
            x: "photons or paths".into(),
            y: "relative RMS".into(),
            panels: self.estimators().into_iter().map(panel).collect(),
            levels: vec![("error of the reference".into(), self.floor)],
            ..Chart::default()
        }
    }

    fn merit_chart(&self) -> Chart {
        Chart {
            title: format!("{}: figure of merit", self.scene),
            x: "CPU time without starting, s".into(),
            y: "1 / (relative variance × time), 1/s".into(),
            series: self.over_time(|rung, seconds| 1.0 / (rung.spread.powi(2) * seconds)),
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
            y: "missing share of light".into(),
            linear_x: true,
            series: vec![
                series("at the captors (RMS)", 0, &spread),
                series("of all light", 1, &share),
            ],
            ..Chart::default()
        }
    }

    fn map_chart(&self) -> Chart {
        let stored = |(colour, estimator): (usize, &str)| {
            let points = self.rungs_of(estimator).filter_map(|r| Some((r.arrivals?, r.error)));
            let (name, points) = (Some(estimator.to_string()), points.collect());
            Series { name, colour, stroke: Stroke::Line, points }
        };
        let estimators = self.estimators().into_iter().enumerate();
        let mut series: Vec<Series> = estimators.map(stored).collect();
        series.retain(|series| !series.points.is_empty());
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

/// Returns a line that falls as noise does, below the first estimator.
fn guide(series: &[Series]) -> Option<Series> {
    let points = &series.first()?.points;
    let (&(x, y), &(end, _)) = (points.first()?, points.last()?);
    let points = vec![(x, 0.5 * y), (end, 0.5 * y * (x / end).sqrt())];
    let name = Some("slope −1/2".into());
    Some(Series { name, colour: Series::GREY, stroke: Stroke::Dashed, points })
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
