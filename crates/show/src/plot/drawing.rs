//! Draws a plot as SVG or as pixels.

use super::{carpet::Carpets, heat_map::HeatMaps};
use crate::{
    chart::{Chart, Width, paper},
    picture::Picture,
};
use phylux_core::error::{Error, Result, Words};

/// A plot of results.
#[derive(Clone, Debug)]
pub struct Plot {
    pub(super) drawn: Drawn,
    /// Sentences about what was left out.
    pub notes: Vec<Words>,
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
                let down = charts.iter().map(|chart| chart.size(width).1).max().unwrap_or(1);
                let all = (width.units(), down * charts.len().max(1) as i32);
                paper::drawn(all, |area| {
                    let parts = area.split_evenly((charts.len().max(1), 1));
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
