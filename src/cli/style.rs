//! The options of all commands that draw plots.

use clap::{Args, ValueEnum};

use crate::show::chart::Width;

#[derive(Args)]
pub(super) struct Style {
    /// Width of plots in inches: of a column of a journal, or of a page
    #[arg(long, value_enum, value_name = "INCHES", default_value = "7")]
    width: Inches,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Inches {
    #[value(name = "3.5")]
    Column,
    #[value(name = "7")]
    Page,
}

impl Style {
    pub fn width(&self) -> Width {
        match self.width {
            Inches::Column => Width::Column,
            Inches::Page => Width::Page,
        }
    }
}
