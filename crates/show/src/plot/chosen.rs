//! The request for a plot, and the results that it selects.

use indexmap::IndexMap;

use super::colours::Names;
use phylux_core::{
    error::{Error, Result, ToWords, Words, setting},
    math::pattern::fits,
    words,
};
use phylux_results::result::{CaptorResult, FaceResult, RunResult, light_name};

/// The names of the axes.
pub(super) const AXES: [&str; 3] = ["x", "y", "z"];
/// Normals are one direction if the cosine between them is above 1 less this.
pub(super) const FLAT: f64 = 1e-3;

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
    /// What 10 % more of each input brings, and how uncertain results are because inputs are.
    Sensitivity,
}

/// A request for a plot.
#[derive(Clone, Copy, Debug)]
pub struct PlotRequest<'a> {
    /// The kind of plot; `None` stands for the first of a map, layers, plants with instances or
    /// ranks, and a profile that the results have.
    pub kind: Option<PlotKind>,
    /// Name of a band or sum, of what results depend on also of a ratio; `None` stands for the first
    /// sum, or the first band.
    pub band: Option<&'a str>,
    /// Only captors and groups whose ids fit one of these patterns, in which `*` stands for any
    /// characters; groups that fit stand for their captors. A pattern that no id fits may be several,
    /// with commas between them. None are all.
    pub captors: &'a [String],
    /// Ends of the colour bar of a map, in its unit.
    pub range: Option<(f64, f64)>,
    /// Whether maps are of daily light integrals, where the results know them, and not of means.
    pub daily: bool,
    /// What the results are of, such as a month, for titles.
    pub of: Option<&'a str>,
}

/// Results, and the selection of those that are plotted.
pub(super) struct Chosen<'a> {
    pub result: &'a RunResult,
    /// Index of the band or sum; of a ratio that of the default.
    pub band: usize,
    /// The same, or for a ratio its index behind those of bands and sums.
    pub column: usize,
    /// Patterns of the ids that the user asked for; none if all are.
    pub patterns: Vec<&'a str>,
    daily: bool,
    /// What the results are of, for titles.
    pub of: Option<&'a str>,
}

impl<'a> Chosen<'a> {
    pub fn new(result: &'a RunResult, request: PlotRequest<'a>) -> Result<Self> {
        let names = || result.bands.iter().map(|band| band.name.as_str());
        let usual = result.bands.iter().position(|band| band.sum_of.is_some()).unwrap_or(0);
        let ratios = result.ratios.iter().filter(|_| request.kind == Some(PlotKind::Sensitivity));
        let columns = || names().chain(ratios.clone().map(|ratio| ratio.name.as_str()));
        let column = match request.band {
            Some(name) => columns().position(|other| other == name).ok_or_else(|| {
                let problem = format!("the results have no band or sum `{name}`");
                let all: Vec<&str> = columns().collect();
                Error::input(setting("band"), problem)
                    .remedy(format!("there are {}", all.join(", ")))
            })?,
            None => usual,
        };
        let band = if column < result.bands.len() { column } else { usual };
        let PlotRequest { daily, of, .. } = request;
        let captors = || result.captors.iter().map(|captor| captor.id.as_str());
        let of_captors = || result.captors.iter().flat_map(|captor| captor.groups.iter().flatten());
        let groups = || result.groups.iter().map(|group| &group.id).chain(of_captors());
        let ids = || captors().chain(groups().map(String::as_str));
        let patterns = parted(request.captors, |pattern| ids().any(|id| fits(pattern, id)));
        let unknown = patterns.iter().find(|pattern| !ids().any(|id| fits(pattern, id)));
        if let Some(pattern) = unknown {
            let problem = format!("the results have no captor or group `{pattern}`");
            let example = ids().next().unwrap_or_default();
            return Err(Error::input(setting("captors"), problem).remedy(format!(
                "write an id as it stands in the results, say `{example}`, or a pattern with `*`"
            )));
        }
        Ok(Self { result, band, column, patterns, daily, of })
    }

    /// Returns whether the id of a captor or group is asked for.
    pub fn takes(&self, id: &str) -> bool {
        self.patterns.is_empty() || self.patterns.iter().any(|pattern| fits(pattern, id))
    }

    /// Returns the captors whose ids are asked for, and those of the groups that are.
    pub fn captors(&self) -> impl Iterator<Item = &'a CaptorResult> {
        let of_group =
            |captor: &CaptorResult| captor.groups.iter().flatten().any(|group| self.takes(group));
        let all = self.result.captors.iter();
        all.filter(move |captor| self.takes(&captor.id) || of_group(captor))
    }

    /// Returns the captors whose own ids are asked for.
    pub fn named_captors(&self) -> impl Iterator<Item = &'a CaptorResult> {
        self.result.captors.iter().filter(|captor| self.takes(&captor.id))
    }

    /// Returns the names that have colours.
    pub fn names(&self) -> Names<'a> {
        let captors = self.result.captors.iter().map(|captor| captor.id.as_str());
        let groups = self.result.groups.iter().map(|group| group.id.as_str());
        Names::of(captors.chain(groups))
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

    /// Returns the ratio that is plotted, if it is none of the bands and sums.
    fn ratio(&self) -> Option<&'a str> {
        let ratio = self.column.checked_sub(self.result.bands.len())?;
        Some(&self.result.ratios[ratio].name)
    }

    /// Returns the name of the band, sum or ratio.
    pub fn column_name(&self) -> &'a str {
        self.ratio().unwrap_or_else(|| self.band_name())
    }

    /// Returns the same after a comma, if there is another.
    pub fn of_column(&self) -> String {
        self.ratio().map_or_else(|| self.of_band(), |name| format!(", {name}"))
    }

    /// Returns what the column is: light, or a ratio.
    pub fn kind_of_column(&self) -> &'static str {
        if self.ratio().is_some() { "ratio" } else { "light" }
    }

    /// Returns the name of irradiance in this band, as it stands at axes.
    pub fn light_name(&self) -> String {
        light_name(&self.result.bands, Some(self.band), &self.result.unit.flux)
    }

    pub fn per_area(&self) -> &'a str {
        self.result.units(self.band)[1]
    }

    /// Returns the unit of the daily light integrals of the band, if maps are of them.
    fn dli_unit(&self) -> Option<&'a str> {
        let known = |captor: &CaptorResult| self.dli(&captor.front).is_some();
        let unit = self.result.unit.dli.as_deref().filter(|_| self.daily)?;
        self.result.captors.iter().any(known).then_some(unit)
    }

    fn dli(&self, face: &FaceResult) -> Option<(f64, Option<f64>)> {
        let error = face.dli_se.as_ref().and_then(|errors| errors[self.band]);
        Some((face.dli.as_ref()?[self.band]?, error))
    }

    /// Returns the name of the light of maps and its unit.
    pub fn map_light(&self) -> (String, &'a str) {
        match self.dli_unit() {
            Some(unit) => (format!("daily light integral{}", self.of_band()), unit),
            None => (self.light_name(), self.per_area()),
        }
    }

    /// Returns the light of a face in maps, with its standard error.
    pub fn map_value(&self, face: &FaceResult) -> (f64, Option<f64>) {
        let daily = self.dli(face).filter(|_| self.daily);
        daily.unwrap_or((face.irradiance[self.band], face.irradiance_se[self.band]))
    }
}

/// Returns patterns, of which those that nothing fits are parted at their commas.
pub(super) fn parted(patterns: &[String], is_known: impl Fn(&str) -> bool) -> Vec<&str> {
    let mut all = Vec::new();
    for text in patterns {
        match is_known(text) {
            true => all.push(text.as_str()),
            false => all.extend(text.split(',').map(str::trim)),
        }
    }
    all
}

/// Returns the name that sensors of a grid or list share, such as `bench` of `bench/3-0`; nothing
/// for a sensor by itself.
pub(super) fn set_of(id: &str) -> &str {
    id.rsplit_once('/').map_or("", |(set, _)| set)
}

/// Says how many sensors are on none of the `parts` that are drawn, and why, with the first of their
/// sets.
pub(super) fn left_out<'a>(
    ids: impl Iterator<Item = &'a str>,
    parts: &str,
    why: &str,
) -> Option<Words> {
    let mut sets: IndexMap<&str, usize> = IndexMap::new();
    for id in ids {
        let name = if set_of(id).is_empty() { id } else { set_of(id) };
        *sets.entry(name).or_default() += 1;
    }
    let named = |(name, count): (&&str, &usize)| match count {
        1 => format!("`{name}`"),
        _ => format!("{count} of `{name}`"),
    };
    let more = if sets.len() > 3 { ", ..." } else { "" };
    let names = sets.iter().take(3).map(named).collect::<Vec<_>>().join(", ");
    let what = match sets.values().sum::<usize>() {
        0 => return None,
        1 => format!("one sensor is on no {parts}: {names}"),
        n => format!("{n} sensors are on no {parts}: {names}{more}"),
    };
    let profile = setting("show").is("profile");
    Some(words![format!("{what} ({why}; "), profile, " has all heights)"])
}

/// Makes the error that the results do not have what a plot needs.
pub(super) fn nothing(problem: &str, remedy: impl ToWords) -> Error {
    Error::input("results", problem).remedy(remedy)
}

/// Returns the two ends of an error bar: from below to above, or, if `across`, from left to right.
pub(super) fn error_bar(at: f64, value: f64, error: Option<f64>, across: bool) -> [(f64, f64); 2] {
    let error = error.unwrap_or(0.0);
    [value - error, value + error].map(|end| if across { (end, at) } else { (at, end) })
}
