//! `phylux plot`: draws results as a map, a profile, by plants, as spectra or by what they depend on,
//! and the folder of a year by months, hours or for a day.

use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};

use super::{
    interrupt::{Interrupt, STANDARD_OUTPUT},
    outputs::{check_places, place_of},
    render,
    style::Style,
};
use phylux_core::error::{Error, Result};
use phylux_files::{
    output::FilesRead,
    result_file::read_json,
    year_table::{Face, YearTable},
};
use phylux_show::plot::{Plot, PlotKind, PlotRequest, YearPlotKind, YearPlotRequest};

#[derive(Args)]
pub(super) struct Arguments {
    /// Results file (JSON) of `phylux run` or `phylux mix`, or the folder of `phylux year`
    results: PathBuf,
    /// Picture: .svg (also `-`, the standard output), or .png with 300 pixels to the inch
    #[arg(short, long, value_name = "FILE", default_value = "plot.svg")]
    output: PathBuf,
    /// What to plot [default: the first of map, layers, plants and profile that the results have; of a
    /// year months, or day if there is but one]
    #[arg(long, value_enum)]
    show: Option<What>,
    /// Band or sum to plot [default: the first sum, or the first band; of a year the last sum or
    /// band]
    #[arg(long, value_name = "NAME")]
    band: Option<String>,
    /// Plot only captors and groups with these ids, in which `*` stands for any characters, as
    /// `bench-grid/*`; a group stands for its captors. Several have commas between them, or an option
    /// each
    #[arg(long, value_name = "ID,...")]
    captors: Vec<String>,
    /// Of a year's months, carpet or day: light on fronts (the default), on backs, or absorbed per
    /// area; of a map: the daily light integral (the default of a year that has it), or the mean
    #[arg(long, value_enum)]
    quantity: Option<Quantity>,
    /// With --show day: the day, such as 2005-06-21 [default: the one with the most light]
    #[arg(long, value_name = "DATE")]
    day: Option<String>,
    /// With --show map, profile or plants of a year: the month, such as 2005-06 [default: the whole
    /// period]; `phylux year --results` has written its light
    #[arg(long, value_name = "MONTH")]
    month: Option<String>,
    /// With --show map or carpet: values at the ends of the colour bar [default: chosen for the
    /// values]
    #[arg(long, value_name = "LOW:HIGH", value_parser = render::range, allow_hyphen_values = true)]
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
    /// What leaves absorbed in each layer, per area of leaf, over height, in scenes with `layers`
    Layers,
    /// Irradiance per nanometre of groups of captors, or of those that --captors names
    Spectrum,
    /// What 10 % more of each input brings to groups, and how uncertain these are because inputs are,
    /// in scenes with `sensitivity` or `uncertain`
    Sensitivity,
    /// Of a year: daily light integrals, the mean of each month with the range of its days
    Months,
    /// Of a year: the light of every hour as a colour, hours of the day over days
    Carpet,
    /// Of a year: the light of a day, hour by hour, with errors
    Day,
}

/// Light that a table of a year holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Quantity {
    /// Light on fronts
    Front,
    /// Light on backs
    Back,
    /// Light that surfaces absorb, per area
    Absorbed,
    /// Of a map: the daily light integral
    Dli,
    /// Of a map: the mean irradiance
    Mean,
}

impl Quantity {
    /// Whether it is one of maps, and not of the tables of a year.
    fn is_of_maps(self) -> bool {
        matches!(self, Self::Dli | Self::Mean)
    }
}

impl What {
    /// Returns the kind of a plot of results, or of a year.
    fn kinds(self) -> (Option<PlotKind>, Option<YearPlotKind>) {
        match self {
            Self::Map => (Some(PlotKind::Map), None),
            Self::Profile => (Some(PlotKind::Profile), None),
            Self::Plants => (Some(PlotKind::Plants), None),
            Self::Layers => (Some(PlotKind::Layers), None),
            Self::Spectrum => (Some(PlotKind::Spectrum), None),
            Self::Sensitivity => (Some(PlotKind::Sensitivity), None),
            Self::Months => (None, Some(YearPlotKind::Months)),
            Self::Carpet => (None, Some(YearPlotKind::Carpet)),
            Self::Day => (None, Some(YearPlotKind::Day)),
        }
    }
}

impl Arguments {
    /// Refuses options that mean nothing for what is shown.
    fn check(&self, is_year: bool, show: What) -> Result<()> {
        let of_tables = show.kinds().1.is_some();
        if of_tables && !is_year {
            return Err(Error::input(self.results.display(), "is no folder of a year")
                .remedy("name the folder that `phylux year` has written, or change --show"));
        }
        let goes = [
            (
                "--range",
                self.range.is_some(),
                [What::Map, What::Carpet].contains(&show),
                "map or carpet",
            ),
            ("--day", self.day.is_some(), show == What::Day, "day"),
            (
                "--month",
                self.month.is_some(),
                is_year && !of_tables,
                "map, profile or plants of a year",
            ),
            (
                "--quantity dli, mean",
                self.quantity.is_some_and(Quantity::is_of_maps),
                show == What::Map,
                "map",
            ),
            (
                "--quantity",
                self.quantity.is_some_and(|quantity| !quantity.is_of_maps()),
                of_tables,
                "months, carpet or day",
            ),
        ];
        match goes.into_iter().find(|(_, given, goes, _)| *given && !goes) {
            None => Ok(()),
            Some((option, .., with)) => {
                let problem = format!("has no meaning here: it goes with --show {with}");
                Err(Error::input(option, problem).remedy("leave it out, or change --show"))
            }
        }
    }

    fn of_year(&self, kind: Option<YearPlotKind>) -> YearPlotRequest<'_> {
        YearPlotRequest {
            kind,
            face: match self.quantity.unwrap_or(Quantity::Front) {
                Quantity::Front | Quantity::Dli | Quantity::Mean => Face::Front,
                Quantity::Back => Face::Back,
                Quantity::Absorbed => Face::Absorbed,
            },
            band: self.band.as_deref(),
            captors: &self.captors,
            day: self.day.as_deref(),
            range: self.range,
        }
    }

    /// Returns the file with the light of a month. Error: the folder has none.
    fn of_month(&self) -> Result<PathBuf> {
        let month = self.month.as_deref().unwrap_or("all");
        let file = self.results.join(format!("results-{month}.json"));
        match file.is_file() {
            true => Ok(file),
            false => {
                Err(Error::input(self.results.display(), format!("holds no results-{month}.json"))
                    .remedy("write it with `phylux year --results`"))
            }
        }
    }
}

pub(super) fn run(arguments: &Arguments) -> Result<()> {
    let Arguments { results, output, .. } = arguments;
    let is_year = results.is_dir();
    let show = arguments.show.unwrap_or(if is_year { What::Months } else { What::Map });
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
    arguments.check(is_year, show)?;
    let interrupt = Interrupt::install()?;
    let file = interrupt.file(output)?;
    let place = file.place().map(Path::to_path_buf);
    let (kind, of_year) = arguments.show.map_or((None, None), What::kinds);
    let (plot, files) = match show.kinds().1 {
        Some(_) => {
            let plot = Plot::of_year(results, &arguments.of_year(of_year))?;
            (plot, YearTable::files(results))
        }
        None => {
            let file = match is_year {
                true => arguments.of_month()?,
                false => results.clone(),
            };
            let result = read_json(&file)?;
            let request = PlotRequest {
                // a quantity is one of maps
                kind: kind.or(arguments.quantity.map(|_| PlotKind::Map)),
                band: arguments.band.as_deref(),
                captors: &arguments.captors,
                range: arguments.range,
                daily: match arguments.quantity {
                    None => is_year,
                    quantity => quantity == Some(Quantity::Dli),
                },
                of: arguments.month.as_deref(),
            };
            let plot = Plot::new(&result, request).map_err(|error| match error.place() {
                "results" => error.at(file.display()),
                _ => error,
            })?;
            (plot, vec![file])
        }
    };
    let read = FilesRead::new(&files);
    check_places(place.as_slice(), &read)?;
    let drawn = arguments.style.plots(png).plot(&plot)?;
    file.write(&read, |writer| writer.write_all(&drawn))?;
    let notes: String = plot.notes.iter().map(|note| format!("{note}\n")).collect();
    super::terminal::print(&format!("{notes}wrote {}\n", place_of(output)))
}
