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
            Drawn::Charts(charts) => svg_of(charts, width),
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

/// Draws charts one below the other, whose axes begin at the same place.
fn svg_of(charts: &[Chart], width: Width) -> std::result::Result<String, paper::Failure> {
    let left = charts.iter().map(|chart| chart.room_beside(width)).max().unwrap_or(0);
    let charts: Vec<Chart> = charts.iter().map(|chart| Chart { left, ..chart.clone() }).collect();
    let heights: Vec<i32> = charts.iter().map(|chart| chart.size(width).1).collect();
    paper::drawn((width.units(), heights.iter().sum::<i32>().max(1)), |area| {
        let mut rest = area.clone();
        for (chart, height) in charts.iter().zip(heights) {
            let (own, below) = rest.split_vertically(height);
            chart.draw(&own)?;
            rest = below;
        }
        Ok(())
    })
}
