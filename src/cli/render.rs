//! `phylux render`: makes a picture of a scene, as a camera sees it or in false colour.

mod arguments;

use std::path::{Path, PathBuf};

use super::{
    interrupt,
    outputs::{check_places, place_of},
};
pub(super) use arguments::{Arguments, range};
use phylux_core::error::{CommandLine, Error, Result};
use phylux_files::{
    output::{FilesRead, OutputFile},
    scene_file,
};
#[cfg(feature = "exr")]
use phylux_show::picture::write_exr;
#[cfg(feature = "exr")]
use phylux_studies::picture::channels;
use phylux_studies::{desk::STANDARD_OUTPUT, picture::job::PictureJob};

pub(super) fn run(arguments: &Arguments) -> Result<()> {
    let desk = interrupt::desk()?;
    let job = arguments.job();
    check(&job, &arguments.output)?;
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

    let made = job.picture(&loaded, &desk)?;
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
    let words = made.words.spelled(&CommandLine);
    super::terminal::print(&format!("{words}wrote {}\n", list(&arguments.output)))
}

fn list(paths: &[PathBuf]) -> String {
    let names: Vec<String> = paths.iter().map(|path| place_of(path)).collect();
    names.join(", ")
}

/// Refuses a picture without numbers where a file is to hold them.
fn check(job: &PictureJob, outputs: &[PathBuf]) -> Result<()> {
    job.check()?;
    for path in outputs {
        if !job.show.is_of_light() && Kind::of(path)? != Kind::Png {
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
