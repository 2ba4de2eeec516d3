//! Plots of results: sensors as a map, light over height, what plants absorbed, spectra. They read a results
//! file and no scene.

mod chosen;
mod drawing;
mod heat_map;
mod map;
mod plants;
mod profile;
mod spectrum;

use crate::{error::Result, results::result::RunResult};
use chosen::Chosen;
pub use chosen::{PlotKind, PlotRequest};
pub use drawing::Plot;

impl Plot {
    /// Of results. Errors: no such band or captor, nothing of what the plot shows, a wrong range.
    pub fn new(result: &RunResult, request: PlotRequest) -> Result<Self> {
        let chosen = Chosen::new(result, request)?;
        match request.kind {
            PlotKind::Map => map::map(&chosen, request.range),
            PlotKind::Profile => profile::profile(&chosen),
            PlotKind::Plants => plants::plants(&chosen),
            PlotKind::Spectrum => spectrum::spectrum(&chosen),
        }
    }
}
