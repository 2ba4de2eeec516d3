//! Plots of results: sensors as a map, light over height, the power that plants and layers absorbed,
//! spectra.
//! They read a results file, or the folder of a year, and no scene.
//!
//! `chosen` picks the band and the captors, `map`, `profile`, `plants`, `layers` and `spectrum` each make one
//! kind of plot, `year`, `months` and `carpet` those of a year, `drawing` makes it SVG or pixels, and `style` a file.

mod carpet;
mod chosen;
mod drawing;
mod field;
mod heat_map;
mod layers;
mod map;
mod months;
mod plants;
mod profile;
mod rows;
mod spectrum;
mod style;
mod year;

use chosen::Chosen;
pub use chosen::{PlotKind, PlotRequest};
pub use drawing::Plot;
pub use months::{DailyLight, OfId};
use phylux_core::error::Result;
use phylux_results::result::RunResult;
pub use style::PlotStyle;
pub use year::{YearPlotKind, YearPlotRequest};

impl Plot {
    /// Makes a plot of results. Errors: there is no such band or captor; the results have nothing
    /// that the plot shows; the range is not valid.
    pub fn new(result: &RunResult, request: PlotRequest) -> Result<Self> {
        let chosen = Chosen::new(result, request)?;
        match request.kind {
            PlotKind::Map => map::map(&chosen, request.range),
            PlotKind::Profile => profile::profile(&chosen),
            PlotKind::Plants => plants::plants(&chosen),
            PlotKind::Layers => layers::layers(&chosen),
            PlotKind::Spectrum => spectrum::spectrum(&chosen),
        }
    }
}
