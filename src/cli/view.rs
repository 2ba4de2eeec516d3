//! `phylux view`: writes a page that shows a scene and its light in a browser.

use std::path::PathBuf;

use clap::Args;

use super::rendered::{self, Source};
use phylux_core::{error::Result, scene::world::Scene};
use phylux_show::{
    following::Following,
    view::{YearLight, check_view, write_view},
};
use phylux_studies::histories::following;

#[derive(Args)]
pub(super) struct Arguments {
    #[command(flatten)]
    source: Source,
    /// Folder that `phylux year` has written for this scene: the page shows the captors in the light
    /// of any hour, day or month, and plays it
    #[arg(long, value_name = "DIR")]
    year: Option<PathBuf>,
    /// Captor, or group of captors, whose light the page follows: on which ways it comes there. Without
    /// this option the page follows the light of all captors of a scene that has at most 64
    #[arg(long, value_name = "NAME", conflicts_with = "no_trace")]
    to: Option<String>,
    /// Page to write; it opens in a browser and needs no network
    #[arg(short, long, value_name = "FILE", default_value = "view.html")]
    output: PathBuf,
}

pub(super) fn run(arguments: &Arguments) -> Result<()> {
    let year = arguments.year.as_deref().map(YearLight::read).transpose()?;
    let year = year.as_ref();
    let check = |scene: &Scene| {
        let most = check_view(scene)?;
        year.map_or(Ok(()), |year| year.check_scene(scene))?;
        Ok(most)
    };
    let follow = |scene: &Scene| match arguments.source.traces() {
        true => following(scene, arguments.to.as_deref()),
        false => Ok(Following::default()),
    };
    let files: Vec<PathBuf> = year.into_iter().flat_map(YearLight::paths).cloned().collect();
    rendered::write(
        &arguments.source,
        &files,
        &arguments.output,
        false,
        &check,
        &follow,
        |rendered, writer| write_view(rendered, year, writer),
    )
}
