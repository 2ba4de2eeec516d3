//! What `view` and `export` have in common: they read a scene and perhaps the results of a run,
//! trace what these results do not tell, and write a file.

use phylux_files::result_file::read_json;
use std::{
    io::{self, Write},
    path::{Path, PathBuf},
    sync::{Mutex, atomic::Ordering},
};

use clap::Args;

use super::{
    interrupt,
    outputs::{check_places, place_of},
    progress::{show, terminal_bar},
    run::map_photons,
    tracing::TracingArguments,
};
use phylux_core::{
    error::{Error, NOTHING_WRITTEN, Result},
    scene::world::Scene,
    transport::{
        settings::{MapLimit, Settings},
        simulate::{Control, Progress},
    },
};
use phylux_files::{
    output::FilesRead,
    scene_file::{self, LoadedScene},
};
use phylux_show::{
    following::Following,
    rendered::{RenderPlan, RenderStage, RenderedScene},
};

/// Arguments that name the scene and the source of its light.
#[derive(Args)]
pub(super) struct Source {
    /// Scene file (JSON)
    scene: PathBuf,
    /// Results of a run of this scene, for its captors; without this option the scene is run first
    #[arg(long, value_name = "FILE")]
    results: Option<PathBuf>,
    /// With --results: trace nothing; surfaces that are not captors then have no values
    #[arg(long, requires = "results")]
    no_trace: bool,
    #[command(flatten)]
    tracing: TracingArguments,
    /// Arrivals of photons to store, from which the light of surfaces is read [default: the scene's]
    #[arg(long, value_name = "N", value_parser = map_photons, allow_hyphen_values = true, conflicts_with = "no_trace")]
    map_photons: Option<MapLimit>,
}

impl Source {
    /// Whether photons may be traced.
    pub fn traces(&self) -> bool {
        !self.no_trace
    }
}

/// Reads and checks the scene, finds its light (with `photons`, only photons to show), and writes
/// it to `output`. `others` are files that were read besides; `check` also returns the most tiles of
/// the file, and `follow` the captors whose light is followed.
pub(super) fn write(
    source: &Source,
    others: &[PathBuf],
    output: &Path,
    photons: bool,
    check: &dyn Fn(&Scene) -> Result<usize>,
    follow: &dyn Fn(&Scene) -> Result<Following>,
    write: impl Fn(&RenderedScene, &mut dyn Write) -> io::Result<()>,
) -> Result<()> {
    let desk = interrupt::desk()?;
    let file = desk.file(output)?;
    let place = file.place().map(Path::to_path_buf);
    let (results, loaded) = desk.during("reading the scene", |_| -> Result<_> {
        let results = source.results.as_deref().map(read_json).transpose()?;
        Ok((results, scene_file::load(&source.scene)?))
    })?;
    let LoadedScene { scene, settings, warnings, files, .. } = loaded;
    let read = FilesRead::new(files.iter().chain(&source.results).chain(others));
    check_places(place.as_slice(), &read)?;
    let most = check(&scene)?;
    let following = follow(&scene)?;
    super::terminal::warn(&warnings);

    let mut asked = source.tracing.settings(&settings);
    asked.map_photons = source.map_photons.unwrap_or(asked.map_photons);
    // the number of photons in the scene's settings is meant for a run for its captors, not for
    // photons to show
    let settings =
        if photons { Settings { photons: source.tracing.photons, ..asked } } else { asked };
    let plan = match results {
        _ if photons => RenderPlan::Photons,
        Some(results) => RenderPlan::Results { results: Box::new(results), trace: source.traces() },
        None => RenderPlan::Run,
    };
    let bars = Mutex::new(None);
    let progress = |stage: RenderStage, progress: Progress| {
        // a progress bar that cannot be drawn is not worth a failure
        let Ok(mut bars) = bars.lock() else { return };
        if !matches!(&*bars, Some((shown, _)) if *shown == stage) {
            let what = match stage {
                RenderStage::Captors => "photons for captors",
                RenderStage::Surfaces => "photons for surfaces",
                RenderStage::Tiles => "places read",
                RenderStage::Histories => "photons for histories",
            };
            let template = format!("{{bar:30}} {{percent}}% {{human_pos}} {what}{{left}}");
            *bars = Some((stage, terminal_bar(&template)));
        }
        if let Some((_, bar)) = &*bars {
            show(bar, progress);
        }
    };
    let control = Control { stop: desk.stop(), progress: &|_| {} };
    let rendered = RenderedScene::new(&scene, most, &settings, plan, &control, &progress);
    let rendered = rendered.and_then(|mut rendered| {
        let progress = |p: Progress| progress(RenderStage::Histories, p);
        let control = Control { progress: &progress, ..control };
        rendered.followed = following.follow(&scene, &settings, &control)?;
        Ok(rendered)
    });
    if let Ok(Some((_, bar))) = bars.into_inner() {
        bar.finish_and_clear();
    }
    let rendered = rendered?;
    if desk.stop().load(Ordering::Relaxed) {
        return Err(Error::interrupted("run", NOTHING_WRITTEN));
    }
    desk.writing();
    desk.during("writing", |_| file.write(&read, |writer| write(&rendered, writer)))?;
    super::terminal::print(&format!("wrote {}\n", place_of(output)))
}
