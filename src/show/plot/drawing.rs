//! Draws a plot as SVG or as pixels.

use super::{carpet::Carpets, heat_map::HeatMaps};
use crate::{
    error::{Error, Result},
    show::{
        chart::{self, Chart, Width},
        picture::Picture,
    },
};

/// A plot of results.
#[derive(Clone, Debug)]
pub struct Plot {
    pub(super) drawn: Drawn,
    /// Sentences about what was left out.
    pub notes: Vec<String>,
}

#[derive(Clone, Debug)]
pub(super) enum Drawn {
    /// Charts, one below the other.
    Charts(Vec<Chart>),
    Maps(HeatMaps),
    Carpets(Carpets),
}

impl Plot {
    /// Returns the plot as SVG text. Error: it cannot be drawn.
    pub fn svg(&self, width: Width) -> Result<String> {
        let drawn = match &self.drawn {
            Drawn::Charts(charts) => {
                let ((across, down), count) = (Chart::size(width), charts.len().max(1));
                chart::drawn((across, down * count as i32), |area| {
                    let parts = area.split_evenly((count, 1));
                    charts.iter().zip(&parts).try_for_each(|(chart, part)| chart.draw(part))
                })
            }
            Drawn::Maps(maps) => maps.svg(width),
            Drawn::Carpets(carpets) => carpets.svg(width),
        };
        drawn.map_err(|failure| Error::run("plot", failure))
    }

    /// Returns the plot as pixels, 300 to the inch. Error: it cannot be drawn.
    pub fn picture(&self, width: Width) -> Result<Picture> {
        Picture::of_svg(&self.svg(width)?, Picture::PRINT)
    }
}
