//! Plots of results: sensors as a map, light over height, the power that plants and layers absorbed,
//! spectra.
//! They read a results file, or the folder of a year, and no scene.
//!
//! `chosen` picks the band and the captors, `colours` their colours; `map`, `line`, `profile`, `plants`,
//! `layers`, `spectrum` and `sensitivity` each make one kind of plot, `lying` named rows for some, `year`,
//! `months` and `carpet` those of a year, `drawing` makes it SVG or pixels, and `style` a file. `job`
//! reads the files and chooses.

mod carpet;
mod chosen;
mod colours;
mod drawing;
mod field;
mod heat_map;
pub mod job;
mod layers;
mod line;
mod lying;
mod map;
mod months;
mod organ;
mod panels;
mod plants;
mod profile;
mod rows;
mod sensitivity;
mod spectrum;
mod style;
mod year;

use chosen::Chosen;
pub use chosen::{PlotKind, PlotRequest};
pub use drawing::Plot;
pub use months::{DailyLight, OfId};
use phylux_core::{
    error::{Result, setting},
    words,
};
use phylux_results::result::RunResult;
pub use style::PlotStyle;
pub use year::{YearPlotKind, YearPlotRequest};

impl Plot {
    /// Makes a plot of results. Errors: there is no such band or captor; the results have nothing
    /// that the plot shows; the range is not valid.
    pub fn new(result: &RunResult, request: PlotRequest) -> Result<Self> {
        let chosen = Chosen::new(result, request)?;
        match request.kind {
            Some(PlotKind::Map) => map::map(&chosen, request.range),
            Some(PlotKind::Profile) => profile::profile(&chosen),
            Some(PlotKind::Plants) => plants::plants(&chosen),
            Some(PlotKind::Layers) => layers::layers(&chosen),
            Some(PlotKind::Spectrum) => spectrum::spectrum(&chosen),
            Some(PlotKind::Sensitivity) => sensitivity::sensitivity(&chosen),
            None => Self::first(&chosen, request.range),
        }
    }

    /// Makes the first plot that the results have values for, and says which it is if it is no map.
    fn first(chosen: &Chosen, range: Option<(f64, f64)>) -> Result<Self> {
        let no_map = match map::map(chosen, range) {
            Err(error) if error.place() == "results" && range.is_none() => error,
            found => return found,
        };
        let others = [
            ("layers", layers::layers(chosen)),
            ("plants", plants::plants_of_many(chosen)),
            ("profile", profile::profile_of_many(chosen)),
            ("spectrum", spectrum::spectrum(chosen)),
            ("profile", profile::profile(chosen)),
        ];
        let found = others.into_iter().find_map(|(name, plot)| Some((name, plot.ok()?)));
        let (name, mut plot) = found.ok_or(no_map)?;
        plot.notes.push(words![
            "no sensors that a map could show: drawn as with ",
            setting("show").is(name)
        ]);
        Ok(plot)
    }
}
