//! Draws a plot as SVG or as pixels.

use plotters::{
    prelude::{IntoDrawingArea, SVGBackend},
    style::WHITE,
};

use super::heat_map::HeatMaps;
use crate::{
    error::{Error, Result},
    show::{
        chart::{self, Area, Backend, Chart, Failure},
        picture::{Canvas, Picture},
        xml::allowed,
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
}

impl Plot {
    /// Returns the plot as SVG text. Error: it cannot be drawn.
    pub fn svg(&self) -> Result<String> {
        let mut text = String::new();
        self.draw(SVGBackend::with_string(&mut text, self.size())).map_err(failed)?;
        Ok(allowed(&text).into_owned())
    }

    /// Returns the plot as pixels, two across and down for each pixel of the SVG. Error: it cannot
    /// be drawn.
    pub fn picture(&self) -> Result<Picture> {
        let mut picture = Canvas::paper(self.size());
        self.draw(Canvas::new(&mut picture)).map_err(failed)?;
        Ok(picture)
    }

    fn size(&self) -> (u32, u32) {
        match &self.drawn {
            Drawn::Charts(charts) => {
                let (width, height) = chart::SIZE;
                (width, height * charts.len().max(1) as u32)
            }
            Drawn::Maps(maps) => maps.size(),
        }
    }

    fn draw<D: Backend>(&self, backend: D) -> std::result::Result<(), Failure> {
        let area: Area<D> = backend.into_drawing_area();
        area.fill(&WHITE)?;
        match &self.drawn {
            Drawn::Charts(charts) => {
                let parts = area.split_evenly((charts.len().max(1), 1));
                charts.iter().zip(&parts).try_for_each(|(chart, part)| chart.draw(part))?;
            }
            Drawn::Maps(maps) => maps.draw(&area)?,
        }
        Ok(area.present()?)
    }
}

fn failed(failure: Failure) -> Error {
    Error::run("plot", failure)
}
