//! The options of all commands that draw plots.

use clap::{Args, ValueEnum};

use phylux_core::error::{Error, Result};
use phylux_show::{chart::Width, plot::PlotStyle};

#[derive(Args)]
pub(super) struct Style {
    /// Width of plots in inches: of a column of a journal, or of a page
    #[arg(long, value_enum, value_name = "INCHES", default_value = "7")]
    width: Inches,
}

/// The options of commands that name the files of plots themselves.
#[derive(Args)]
pub(super) struct Plots {
    #[command(flatten)]
    style: Style,
    /// Write plots as PNG, 300 pixels to the inch, and not as SVG; of shards, say it when they are
    /// merged
    #[arg(long)]
    png: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Inches {
    #[value(name = "3.5")]
    Column,
    #[value(name = "7")]
    Page,
}

impl Style {
    /// Returns the style of plots in the one format or the other.
    pub fn plots(&self, png: bool) -> PlotStyle {
        let width = match self.width {
            Inches::Column => Width::Column,
            Inches::Page => Width::Page,
        };
        PlotStyle { width, png }
    }
}

impl Plots {
    /// Returns the style of the plots.
    pub fn style(&self) -> PlotStyle {
        self.style.plots(self.png)
    }

    /// Checks that no style is asked for where there are no plots. Error: one is, of `what`.
    pub fn refuse(&self, what: &str, remedy: &str) -> Result<()> {
        if self.style() == PlotStyle::default() {
            return Ok(());
        }
        Err(Error::input("--png, --width", format!("{what} come without plots")).remedy(remedy))
    }
}
