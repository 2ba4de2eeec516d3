//! `phylux view`: writes a page that shows a scene and its light in a browser.

use std::path::PathBuf;

use clap::Args;

use super::rendered::{self, Source};
use phylux_core::{error::Result, scene::world::Scene};
use phylux_files::year_table::{Face, YearTable};
use phylux_show::view::{check_view, write_view};

#[derive(Args)]
pub(super) struct Arguments {
    #[command(flatten)]
    source: Source,
    /// Folder that `phylux year` has written for this scene: sliders show the captors in the light
    /// of any hour
    #[arg(long, value_name = "DIR")]
    year: Option<PathBuf>,
    /// Page to write; it opens in a browser and needs no network
    #[arg(short, long, value_name = "FILE", default_value = "view.html")]
    output: PathBuf,
}

pub(super) fn run(arguments: &Arguments) -> Result<()> {
    let hours = arguments.year.as_deref();
    let hours = hours.map(|folder| YearTable::read(folder, "hours", Face::Front)).transpose()?;
    let hours = hours.as_ref();
    let check = |scene: &Scene| {
        let most = check_view(scene)?;
        hours.map_or(Ok(()), |hours| hours.check_scene(scene))?;
        Ok(most)
    };
    let files: Vec<PathBuf> = hours.iter().map(|hours| hours.path.clone()).collect();
    rendered::write(
        &arguments.source,
        &files,
        &arguments.output,
        false,
        &check,
        |rendered, writer| write_view(rendered, hours, writer),
    )
}
