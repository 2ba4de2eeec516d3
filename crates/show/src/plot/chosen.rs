//! The request for a plot, and the results that it selects.

use phylux_core::error::{Error, Result};
use phylux_results::result::{CaptorResult, RunResult, light_name};

/// The kinds of plot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PlotKind {
    /// Irradiance on sensors over the plane that they lie in, with contours.
    Map,
    /// Irradiance on sensors, and power that surfaces absorbed per area, over height.
    Profile,
    /// Power that every plant and every rank of its leaves absorbed.
    Plants,
    /// Power that leaves absorbed in each layer, per area of leaf, over height.
    Layers,
    /// Irradiance per nanometre on groups or captors.
    Spectrum,
}

/// A request for a plot.
#[derive(Clone, Copy, Debug)]
pub struct PlotRequest<'a> {
    /// The kind of plot.
    pub kind: PlotKind,
    /// Name of a band or sum; `None` stands for the first sum, or the first band.
    pub band: Option<&'a str>,
    /// Only captors and groups with this id; an id that ends with `*` stands for all ids that begin
    /// so.
    pub captors: Option<&'a str>,
    /// Ends of the colour bar of a map, W/m2 or umol/m2/s.
    pub range: Option<(f64, f64)>,
}

/// Results, and the selection of those that are plotted.
pub(super) struct Chosen<'a> {
    pub result: &'a RunResult,
    /// Index of the band or sum.
    pub band: usize,
    /// The id that the user asked for, without the star, and whether there was one.
    pub pattern: Option<(&'a str, bool)>,
}

impl<'a> Chosen<'a> {
    pub fn new(result: &'a RunResult, request: PlotRequest<'a>) -> Result<Self> {
        let names = || result.bands.iter().map(|band| band.name.as_str());
        let band = match request.band {
            Some(name) => names().position(|other| other == name).ok_or_else(|| {
                let problem = format!("the results have no band or sum `{name}`");
                let all: Vec<&str> = names().collect();
                Error::input("--band", problem).remedy(format!("there are {}", all.join(", ")))
            })?,
            None => result.bands.iter().position(|band| band.sum_of.is_some()).unwrap_or(0),
        };
        let pattern = request.captors.map(|pattern| {
            pattern.strip_suffix('*').map_or((pattern, false), |beginning| (beginning, true))
        });
        let chosen = Self { result, band, pattern };
        let mut ids = result.captors.iter().map(|captor| &captor.id);
        if let Some(pattern) = request.captors
            && !ids.any(|id| chosen.takes(id))
            && !result.groups.iter().any(|group| chosen.takes(&group.id))
        {
            let problem = format!("the results have no captor or group `{pattern}`");
            let example = result.captors.first().map_or("", |captor| captor.id.as_str());
            return Err(Error::input("--captors", problem).remedy(format!(
                "write an id as it stands in the results, say `{example}`, or its beginning with `*` behind it"
            )));
        }
        Ok(chosen)
    }

    /// Returns whether an id is asked for.
    pub fn takes(&self, id: &str) -> bool {
        match self.pattern {
            None => true,
            Some((beginning, true)) => id.starts_with(beginning),
            Some((whole, false)) => id == whole,
        }
    }

    pub fn captors(&self) -> impl Iterator<Item = &'a CaptorResult> {
        self.result.captors.iter().filter(|captor| self.takes(&captor.id))
    }

    pub fn band_name(&self) -> &'a str {
        &self.result.bands[self.band].name
    }

    /// Returns the name of the band after a comma, if there is another.
    pub fn of_band(&self) -> String {
        match self.result.bands.len() {
            1 => String::new(),
            _ => format!(", {}", self.band_name()),
        }
    }

    /// Returns the name of irradiance in this band, as it stands at axes.
    pub fn light_name(&self) -> String {
        light_name(&self.result.bands, Some(self.band), &self.result.unit.flux)
    }

    pub fn per_area(&self) -> &'a str {
        self.result.units(self.band)[1]
    }
}

/// Makes the error that the results do not have what a plot needs.
pub(super) fn nothing(problem: &str, remedy: &str) -> Error {
    Error::input("results", problem).remedy(remedy)
}

/// Returns the two ends of an error bar: from below to above, or, if `across`, from left to right.
pub(super) fn error_bar(at: f64, value: f64, error: Option<f64>, across: bool) -> [(f64, f64); 2] {
    let error = error.unwrap_or(0.0);
    [value - error, value + error].map(|end| if across { (end, at) } else { (at, end) })
}
