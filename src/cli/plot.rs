//! `phylux plot`: draws results as a map, a profile, by plants, as spectra or by what they depend on,
//! and the folder of a year by months, hours or for a day.

use std::path::{Path, PathBuf};

use clap::{Args, builder::TypedValueParser};

use super::{
    choices::explained,
    interrupt,
    outputs::{check_places, place_of},
    render,
    style::Style,
    terminal,
};
use phylux_core::error::Result;
use phylux_files::output::FilesRead;
use phylux_show::plot::{
    PlotStyle,
    job::{PlotJob, PlotLight, PlotWhat},
};
use phylux_studies::desk::STANDARD_OUTPUT;

#[derive(Args)]
pub(super) struct Arguments {
    /// Results file (JSON) of `phylux run` or `phylux mix`, or the folder of `phylux year`
    results: PathBuf,
    /// Picture: .svg (also `-`, the standard output), or .png with 300 pixels to the inch
    #[arg(short, long, value_name = "FILE", default_value = "plot.svg")]
    output: PathBuf,
    /// What to plot [default: the first of map, layers, plants and profile that the results have; of a
    /// year months, or day if there is but one]
    #[arg(long, value_name = "SHOW", value_parser = what())]
    show: Option<PlotWhat>,
    /// Band or sum to plot, with --show sensitivity also a ratio [default: the first sum, or the
    /// first band; of a year the last sum or band]
    #[arg(long, value_name = "NAME")]
    band: Option<String>,
    /// Plot only captors and groups with these ids, in which `*` stands for any characters, as
    /// `bench-grid/*`; a group stands for its captors. Several have commas between them, or an option
    /// each
    #[arg(long, value_name = "ID,...")]
    captors: Vec<String>,
    /// Of a year's months, carpet or day: light on fronts (the default), on backs, or absorbed per
    /// area; of a map: the daily light integral (the default of a year that has it), or the mean
    #[arg(long, value_name = "QUANTITY", value_parser = light())]
    quantity: Option<PlotLight>,
    /// With --show day: the day, such as 2005-06-21 [default: the one with the most light]
    #[arg(long, value_name = "DATE")]
    day: Option<String>,
    /// With --show map, profile or plants of a year: the month, such as 2005-06 [default: the whole
    /// period]; `phylux year --results` has written its light
    #[arg(long, value_name = "MONTH")]
    month: Option<String>,
    /// With --show map or carpet: values at the ends of the colour bar [default: chosen for the
    /// values]
    #[arg(long, value_name = "LOW:HIGH", value_parser = render::range)]
    range: Option<(f64, f64)>,
    #[command(flatten)]
    style: Style,
}

impl Arguments {
    fn job(&self) -> PlotJob {
        PlotJob {
            results: self.results.clone(),
            show: self.show,
            band: self.band.clone(),
            captors: self.captors.clone(),
            quantity: self.quantity,
            day: self.day.clone(),
            month: self.month.clone(),
            range: self.range,
        }
    }
}

/// Reads the kind of plot by its name.
fn what() -> impl TypedValueParser<Value = PlotWhat> {
    explained(
        PlotWhat::ALL,
        [
            "Sensors on the planes that they lie in: irradiance as colours with contours",
            "Irradiance of sensors, and what surfaces absorbed per area, over height",
            "What each plant absorbed, and each rank of its leaves, with errors",
            "What leaves absorbed in each layer, per area of leaf, over height, in scenes with `layers`",
            "Irradiance per nanometre of groups of captors, or of those that --captors names",
            "What 10 % more of each input brings to groups, and how uncertain these are because inputs \
             are, in scenes with `sensitivity` or `uncertain`",
            "Of a year: daily light integrals, the mean of each month with the range of its days",
            "Of a year: the light of every hour as a colour, hours of the day over days",
            "Of a year: the light of a day, hour by hour, with errors",
        ],
    )
}

/// Reads by its name the light that a plot shows.
fn light() -> impl TypedValueParser<Value = PlotLight> {
    explained(
        PlotLight::ALL,
        [
            "Light on fronts",
            "Light on backs",
            "Light that surfaces absorb, per area",
            "Of a map: the daily light integral",
            "Of a map: the mean irradiance",
        ],
    )
}

pub(super) fn run(arguments: &Arguments) -> Result<()> {
    let Arguments { output, .. } = arguments;
    let png = output != Path::new(STANDARD_OUTPUT) && PlotStyle::is_png(output)?;
    let desk = interrupt::desk()?;
    let file = desk.file(output)?;
    let place = file.place().map(Path::to_path_buf);
    let (plot, files) = arguments.job().plot()?;
    let read = FilesRead::new(&files);
    check_places(place.as_slice(), &read)?;
    let drawn = arguments.style.plots(png).plot(&plot)?;
    file.write(&read, |writer| writer.write_all(&drawn))?;
    let notes: String =
        terminal::spelled(&plot.notes).iter().map(|note| format!("{note}\n")).collect();
    terminal::print(&format!("{notes}wrote {}\n", place_of(output)))
}
