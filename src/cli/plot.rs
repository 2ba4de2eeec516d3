//! `phylux plot`: draws results as a map, a profile, by plants or as spectra.

use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};

use super::{
    interrupt::{Interrupt, STANDARD_OUTPUT},
    outputs::{check_places, place_of},
    render,
    style::Style,
};
use crate::{
    error::{Error, Result},
    formats::{output::FilesRead, result_file::read_json},
    show::plot::{Plot, PlotKind, PlotRequest},
};

#[derive(Args)]
pub(super) struct Arguments {
    /// Results file (JSON) of `phylux run` or `phylux mix`
    results: PathBuf,
    /// Picture: .svg (also `-`, the standard output), or .png with 300 pixels to the inch
    #[arg(short, long, value_name = "FILE", default_value = "plot.svg")]
    output: PathBuf,
    /// What to plot
    #[arg(long, value_enum, default_value = "map")]
    show: What,
    /// Band or sum to plot [default: the first sum, or the first band]
    #[arg(long, value_name = "NAME")]
    band: Option<String>,
    /// Plot only the captors with this id; `ID*` stands for all ids that begin so, as
    /// `bench-grid/*`
    #[arg(long, value_name = "ID")]
    captors: Option<String>,
    /// With --show map: values at the ends of the colour bar [default: chosen for the sensors]
    #[arg(long, value_name = "LOW:HIGH", value_parser = render::range, allow_negative_numbers = true)]
    range: Option<(f64, f64)>,
    #[command(flatten)]
    style: Style,
}

/// Kind of plot.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum What {
    /// Sensors on the planes that they lie in: irradiance as colours with contours
    Map,
    /// Irradiance of sensors, and what surfaces absorbed per area, over height
    Profile,
    /// What each plant absorbed, and each rank of its leaves, with errors
    Plants,
    /// Irradiance per nanometre of groups of captors, or of those that --captors names
    Spectrum,
}

pub(super) fn run(arguments: &Arguments) -> Result<()> {
    let Arguments { results, output, show, .. } = arguments;
    let extension = output.extension().map(|e| e.to_string_lossy().to_lowercase());
    let png = match extension.as_deref() {
        Some("svg") => false,
        None if output == Path::new(STANDARD_OUTPUT) => false,
        Some("png") => true,
        _ => {
            return Err(Error::input(output.display(), "is neither .svg nor .png")
                .remedy("let its name end so"));
        }
    };
    if arguments.range.is_some() && *show != What::Map {
        return Err(Error::input("--range", "has no meaning here: it goes with --show map")
            .remedy("leave it out, or change --show"));
    }
    let interrupt = Interrupt::install()?;
    let file = interrupt.file(output)?;
    let place = file.place().map(Path::to_path_buf);
    let read = FilesRead::new([results]);
    check_places(place.as_slice(), &read)?;
    let result = read_json(results)?;
    let request = PlotRequest {
        kind: match show {
            What::Map => PlotKind::Map,
            What::Profile => PlotKind::Profile,
            What::Plants => PlotKind::Plants,
            What::Spectrum => PlotKind::Spectrum,
        },
        band: arguments.band.as_deref(),
        captors: arguments.captors.as_deref(),
        range: arguments.range,
    };
    let plot = Plot::new(&result, request).map_err(|error| match error.place() {
        "results" => error.at(results.display()),
        _ => error,
    })?;
    match png {
        true => {
            let picture = plot.picture(arguments.style.width())?;
            file.write(&read, |writer| picture.write_png(writer))?;
        }
        false => {
            let svg = plot.svg(arguments.style.width())?;
            file.write(&read, |writer| writer.write_all(svg.as_bytes()))?;
        }
    }
    let notes: String = plot.notes.iter().map(|note| format!("{note}\n")).collect();
    super::terminal::print(&format!("{notes}wrote {}\n", place_of(output)))
}
