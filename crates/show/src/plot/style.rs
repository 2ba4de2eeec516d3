//! How plots are written into files.

use super::{Plot, drawing::Drawn};
use crate::chart::{Chart, Width};
use std::path::Path;

use phylux_core::error::{Error, Result};

/// How plots are written into files.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PlotStyle {
    /// The width on paper.
    pub width: Width,
    /// Whether they are PNG, 300 pixels to the inch, and not SVG.
    pub png: bool,
}

impl PlotStyle {
    /// Returns the ending of the names of files, without a dot.
    pub fn ending(self) -> &'static str {
        if self.png { "png" } else { "svg" }
    }

    /// Whether a file of this name is to be PNG, and not SVG. Error: its name says neither.
    pub fn is_png(path: &Path) -> Result<bool> {
        let ending = path.extension().map(|ending| ending.to_string_lossy().to_lowercase());
        match ending.as_deref() {
            Some("svg") => Ok(false),
            Some("png") => Ok(true),
            _ => Err(Error::input(path.display(), "is neither .svg nor .png")
                .remedy("let its name end so")),
        }
    }

    /// Returns the file of a chart. Error: it cannot be drawn.
    pub fn chart(self, chart: Chart) -> Result<Vec<u8>> {
        self.plot(&Plot { drawn: Drawn::Charts(vec![chart]), notes: Vec::new() })
    }

    /// Returns the file of a plot. Error: it cannot be drawn.
    pub fn plot(self, plot: &Plot) -> Result<Vec<u8>> {
        if !self.png {
            return Ok(plot.svg(self.width)?.into_bytes());
        }
        let mut file = Vec::new();
        let written = plot.picture(self.width)?.write_png(&mut file);
        written.map_err(|e| Error::run("plot", format!("cannot be drawn: {e}")))?;
        Ok(file)
    }
}
