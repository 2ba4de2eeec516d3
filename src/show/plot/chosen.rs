//! What a plot is asked to show, and the results that it is to show it of.

use crate::{
    error::{Error, Result},
    results::result::{CaptorResult, RunResult},
};

/// What a plot shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PlotKind {
    /// Irradiance of sensors over the plane that they lie in, with contours.
    Map,
    /// Irradiance of sensors, and what surfaces absorbed per area, over height.
    Profile,
    /// What every plant and every rank of its leaves absorbed.
    Plants,
    /// Irradiance per nanometre of groups or captors.
    Spectrum,
}

/// What is asked for.
#[derive(Clone, Copy, Debug)]
pub struct PlotRequest<'a> {
    /// What is shown.
    pub kind: PlotKind,
    /// Name of a band or sum; without one the first sum, or the first band.
    pub band: Option<&'a str>,
    /// Only captors of this id; one that ends with `*` stands for all that begin so.
    pub captors: Option<&'a str>,
    /// Ends of the colour bar of a map, W/m2 or umol/m2/s.
    pub range: Option<(f64, f64)>,
}

/// Results, and which of them are plotted.
pub(super) struct Chosen<'a> {
    pub result: &'a RunResult,
    /// Index of the band or sum.
    pub band: usize,
    /// What the user asked for, without the star.
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

    /// Whether an id is asked for.
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

    /// What irradiance is called in this band: PPFD, where it counts photons of 400 to 700 nm.
    pub fn irradiance_name(&self) -> &'static str {
        let bands = &self.result.bands;
        let own = &bands[self.band];
        let is_part = |name: &str| own.sum_of.iter().flatten().any(|part| part == name);
        let parts = bands.iter().filter(|band| match own.sum_of {
            Some(_) => band.sum_of.is_none() && is_part(&band.name),
            None => std::ptr::eq(*band, own),
        });
        let mut ranges = parts.map(|band| (band.from_nm, band.to_nm));
        let inside = ranges
            .all(|range| matches!(range, (Some(from), Some(to)) if from >= 399.0 && to <= 701.0));
        let photons = self.result.unit.flux == "umol/s";
        if photons && inside { "PPFD" } else { "irradiance" }
    }

    pub fn per_area(&self) -> &'a str {
        &self.result.unit.irradiance
    }
}

/// Refuses to plot what is not there.
pub(super) fn nothing(problem: &str, remedy: &str) -> Error {
    Error::input("results", problem).remedy(remedy)
}

/// Two ends of an error bar from below to above, or from left to right.
pub(super) fn error_bar(at: f64, value: f64, error: Option<f64>, across: bool) -> [(f64, f64); 2] {
    let error = error.unwrap_or(0.0);
    [value - error, value + error].map(|end| if across { (end, at) } else { (at, end) })
}
