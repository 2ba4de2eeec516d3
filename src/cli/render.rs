//! `phylux render`: makes a picture of a scene, as a camera sees it or in false colour.

mod arguments;
mod captors;
#[cfg(feature = "exr")]
mod channels;
mod light;
mod photons;
mod task;
mod view;

use std::path::{Path, PathBuf};

use super::{
    interrupt,
    outputs::{check_places, place_of},
};
use arguments::What;
pub(super) use arguments::{Arguments, range};
use phylux_core::error::{Error, Result};
use phylux_files::{
    output::{FilesRead, OutputFile},
    scene_file,
};
use phylux_studies::desk::STANDARD_OUTPUT;
pub(super) use task::{Made, make};
#[cfg(feature = "exr")]
use {channels::channels, phylux_show::picture::write_exr};

pub(super) fn run(arguments: &Arguments) -> Result<()> {
    let desk = interrupt::desk()?;
    check(arguments)?;
    let mut outputs = Vec::new();
    for path in &arguments.output {
        outputs.push((Kind::of(path)?, desk.file(path)?));
    }
    let places: Vec<PathBuf> = outputs
        .iter()
        .filter_map(|(_, o): &(_, OutputFile)| o.place())
        .map(Path::to_path_buf)
        .collect();
    check_places(&places, &FilesRead::default())?;

    let loaded = desk.during("reading the scene", |_| scene_file::load(&arguments.scene))?;
    let read = FilesRead::new(loaded.files.iter().chain(&arguments.results));
    check_places(&places, &read)?;
    super::terminal::warn(&loaded.warnings);

    let made = make(arguments, &loaded, desk.stop())?;
    desk.writing();
    for (kind, output) in outputs {
        match kind {
            Kind::Png => output.write(&read, |writer| made.picture.write_png(writer))?,
            #[cfg(feature = "exr")]
            Kind::Exr => {
                let pixels = made.pixels.as_ref();
                let channels = pixels.map(|pixels| channels(pixels, &loaded.scene, arguments.show));
                let width = pixels.map_or(1, |pixels| pixels.width);
                output.write(&read, write_exr(width, channels.unwrap_or_default())?)?;
            }
        }
    }
    super::terminal::print(&format!("{}wrote {}\n", made.words, list(&arguments.output)))
}

fn list(paths: &[PathBuf]) -> String {
    let names: Vec<String> = paths.iter().map(|path| place_of(path)).collect();
    names.join(", ")
}

/// Refuses options that do not go together.
pub(super) fn check(arguments: &Arguments) -> Result<()> {
    let show = arguments.show;
    let misplaced = |option: &str, with: &str| {
        Err(Error::input(option, format!("has no meaning here: it goes with --show {with}"))
            .remedy("leave it out, or change --show"))
    };
    let of_light = [
        ("--gather", arguments.gather.is_some()),
        ("--max-time", arguments.max_time.is_some()),
        ("--denoise", arguments.denoise.is_some()),
    ];
    let misplaced_option = of_light.into_iter().find(|(_, given)| *given);
    if let (What::Captors | What::Photons, Some((option, _))) = (show, misplaced_option) {
        return misplaced(option, "radiance, irradiance, absorbed or error");
    }
    if show != What::Radiance && arguments.exposure.is_some() {
        return misplaced("--exposure", "radiance");
    }
    if show != What::Radiance && arguments.white_balance.is_some() {
        return misplaced("--white-balance", "radiance");
    }
    if show == What::Radiance && arguments.range.is_some() {
        return misplaced(
            "--range",
            "irradiance, absorbed, error, captors or photons (here: --exposure)",
        );
    }
    if show == What::Radiance && arguments.log {
        return misplaced("--log", "irradiance, absorbed, error, captors or photons");
    }
    if show != What::Captors && arguments.results.is_some() {
        return misplaced("--results", "captors");
    }
    let of_photons = [("--paths", arguments.paths > 0), ("--ground", arguments.ground.is_some())];
    if let (true, Some((option, _))) =
        (show != What::Photons, of_photons.into_iter().find(|(_, given)| *given))
    {
        return misplaced(option, "photons");
    }
    let numbers = !matches!(show, What::Captors | What::Photons);
    for path in &arguments.output {
        if !numbers && Kind::of(path)? != Kind::Png {
            return Err(Error::input(
                path.display(),
                "EXR holds the light on surfaces, no captors or photons",
            )
            .remedy("write .png"));
        }
    }
    Ok(())
}

/// File format of a picture.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Kind {
    Png,
    #[cfg(feature = "exr")]
    Exr,
}

impl Kind {
    fn of(path: &Path) -> Result<Self> {
        if path == Path::new(STANDARD_OUTPUT) {
            return Ok(Self::Png);
        }
        let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase());
        match extension.as_deref() {
            Some("png") => Ok(Self::Png),
            #[cfg(feature = "exr")]
            Some("exr") => Ok(Self::Exr),
            #[cfg(not(feature = "exr"))]
            Some("exr") => {
                Err(Error::input(path.display(), "this program was built without OpenEXR")
                    .remedy("write .png, or build it with `cargo build --release --features exr`"))
            }
            _ => Err(Error::input(path.display(), "is neither .png nor .exr")
                .remedy("let its name end so")),
        }
    }
}
