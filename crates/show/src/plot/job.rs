//! A plot from its beginning: reads a results file, or the folder of a year, and plots what is asked
//! for.

use std::path::PathBuf;

use super::{Plot, PlotKind, PlotRequest, YearPlotKind, YearPlotRequest};
use phylux_core::{
    error::{Error, Result, call, setting},
    words,
};
use phylux_files::{
    result_file::read_json,
    year_table::{Face, YearTable},
};

/// Which plot is to be made.
#[derive(Clone, Debug)]
pub struct PlotJob {
    /// A results file, or the folder of a year.
    pub results: PathBuf,
    /// What to plot; `None` chooses by what the results have.
    pub show: Option<PlotWhat>,
    /// Name of a band or sum; `None` chooses one.
    pub band: Option<String>,
    /// Patterns of ids of captors and groups; none stand for all.
    pub captors: Vec<String>,
    /// The light that is plotted; `None` chooses it.
    pub quantity: Option<PlotLight>,
    /// The day of a year, such as 2005-06-21; `None` stands for the one with the most light.
    pub day: Option<String>,
    /// The month of a year, such as 2005-06; `None` stands for the whole period.
    pub month: Option<String>,
    /// The values at the ends of the colour bar.
    pub range: Option<(f64, f64)>,
}

/// Kind of plot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PlotWhat {
    /// One of results.
    Results(PlotKind),
    /// One of the tables of a year.
    Year(YearPlotKind),
}

/// Light that a plot shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PlotLight {
    /// Of the tables of a year: light on fronts.
    Front,
    /// Of the tables of a year: light on backs.
    Back,
    /// Of the tables of a year: light that surfaces absorb, per area.
    Absorbed,
    /// Of a map: the daily light integral.
    Dli,
    /// Of a map: the mean irradiance.
    Mean,
}

impl PlotWhat {
    /// The kinds with their names.
    pub const ALL: [(&'static str, Self); 9] = [
        ("map", Self::Results(PlotKind::Map)),
        ("profile", Self::Results(PlotKind::Profile)),
        ("plants", Self::Results(PlotKind::Plants)),
        ("layers", Self::Results(PlotKind::Layers)),
        ("spectrum", Self::Results(PlotKind::Spectrum)),
        ("sensitivity", Self::Results(PlotKind::Sensitivity)),
        ("months", Self::Year(YearPlotKind::Months)),
        ("carpet", Self::Year(YearPlotKind::Carpet)),
        ("day", Self::Year(YearPlotKind::Day)),
    ];
}

impl PlotLight {
    /// The kinds of light with their names.
    pub const ALL: [(&'static str, Self); 5] = [
        ("front", Self::Front),
        ("back", Self::Back),
        ("absorbed", Self::Absorbed),
        ("dli", Self::Dli),
        ("mean", Self::Mean),
    ];

    /// Whether it is light of maps, and not of the tables of a year.
    fn is_of_maps(self) -> bool {
        matches!(self, Self::Dli | Self::Mean)
    }
}

impl PlotJob {
    /// Makes the plot, and returns it with the files that were read. Errors: options that mean
    /// nothing for what is shown; those of [`Plot::new`] and [`Plot::of_year`].
    pub fn plot(&self) -> Result<(Plot, Vec<PathBuf>)> {
        let is_year = self.results.is_dir();
        let usual = match is_year {
            true => PlotWhat::Year(YearPlotKind::Months),
            false => PlotWhat::Results(PlotKind::Map),
        };
        match self.show.unwrap_or(usual) {
            PlotWhat::Year(kind) => {
                if !is_year {
                    return Err(Error::input(self.results.display(), "is no folder of a year")
                        .remedy(words![
                            "name the folder that ",
                            call("year"),
                            " has written, or change ",
                            setting("show")
                        ]));
                }
                self.check(PlotWhat::Year(kind), is_year)?;
                let plot = Plot::of_year(&self.results, &self.of_year())?;
                Ok((plot, YearTable::files(&self.results)))
            }
            show => {
                self.check(show, is_year)?;
                self.of_results(is_year)
            }
        }
    }

    /// Refuses options that mean nothing for what is shown.
    fn check(&self, show: PlotWhat, is_year: bool) -> Result<()> {
        let of_tables = matches!(show, PlotWhat::Year(_));
        let is_map = show == PlotWhat::Results(PlotKind::Map);
        let is = |kind| show == PlotWhat::Year(kind);
        let goes = [
            (
                setting("range"),
                self.range.is_some(),
                is_map || is(YearPlotKind::Carpet),
                "map or carpet",
            ),
            (setting("day"), self.day.is_some(), is(YearPlotKind::Day), "day"),
            (
                setting("month"),
                self.month.is_some(),
                is_year && !of_tables,
                "map, profile or plants of a year",
            ),
            (
                setting("quantity").is("dli, mean"),
                self.quantity.is_some_and(PlotLight::is_of_maps),
                is_map,
                "map",
            ),
            (
                setting("quantity"),
                self.quantity.is_some_and(|quantity| !quantity.is_of_maps()),
                of_tables,
                "months, carpet or day",
            ),
        ];
        match goes.into_iter().find(|(_, given, goes, _)| *given && !goes) {
            None => Ok(()),
            Some((option, .., with)) => {
                let problem =
                    words!["has no meaning here: it goes with ", setting("show"), " ", with];
                Err(Error::input(option, problem)
                    .remedy(words!["leave it out, or change ", setting("show")]))
            }
        }
    }

    fn of_year(&self) -> YearPlotRequest<'_> {
        YearPlotRequest {
            kind: match self.show {
                Some(PlotWhat::Year(kind)) => Some(kind),
                _ => None,
            },
            face: match self.quantity.unwrap_or(PlotLight::Front) {
                PlotLight::Front | PlotLight::Dli | PlotLight::Mean => Face::Front,
                PlotLight::Back => Face::Back,
                PlotLight::Absorbed => Face::Absorbed,
            },
            band: self.band.as_deref(),
            captors: &self.captors,
            day: self.day.as_deref(),
            range: self.range,
        }
    }

    fn of_results(&self, is_year: bool) -> Result<(Plot, Vec<PathBuf>)> {
        let file = match is_year {
            true => self.of_month()?,
            false => self.results.clone(),
        };
        let result = read_json(&file)?;
        let request = PlotRequest {
            kind: match self.show {
                Some(PlotWhat::Results(kind)) => Some(kind),
                // a quantity is one of maps
                _ => self.quantity.map(|_| PlotKind::Map),
            },
            band: self.band.as_deref(),
            captors: &self.captors,
            range: self.range,
            daily: match self.quantity {
                None => is_year,
                quantity => quantity == Some(PlotLight::Dli),
            },
            of: self.month.as_deref(),
        };
        let plot = Plot::new(&result, request).map_err(|error| match &*error.place() {
            "results" => error.at(file.display()),
            _ => error,
        })?;
        Ok((plot, vec![file]))
    }

    /// Returns the file with the light of a month. Error: the folder has none.
    fn of_month(&self) -> Result<PathBuf> {
        let month = self.month.as_deref().unwrap_or("all");
        let file = self.results.join(format!("results-{month}.json"));
        match file.is_file() {
            true => Ok(file),
            false => {
                Err(Error::input(self.results.display(), format!("holds no results-{month}.json"))
                    .remedy(words!["write it with ", call("year").with(setting("results").on())]))
            }
        }
    }
}
