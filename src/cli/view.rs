//! `phylux view`

use std::path::PathBuf;

use clap::Args;

use super::rendered::{self, Source};
use crate::{
    error::Result,
    show::view::{check_view, write_view},
};

#[derive(Args)]
pub(super) struct Arguments {
    #[command(flatten)]
    source: Source,
    /// The page, which opens in a browser and needs no network
    #[arg(short, long, value_name = "FILE", default_value = "view.html")]
    output: PathBuf,
}

pub(super) fn run(arguments: &Arguments) -> Result<()> {
    rendered::write(&arguments.source, &arguments.output, false, &check_view, |rendered, writer| {
        write_view(rendered, writer)
    })
}
