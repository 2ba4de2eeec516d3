//! `phylux compare`: compares two results captor by captor.

use std::path::{Path, PathBuf};

use clap::Args;

use super::{interrupt, outputs::check_places, run::count, terminal};
use phylux_core::{error::Result, transport::settings::Checked};
use phylux_files::{
    csv_text,
    output::{FilesRead, OutputFile},
    result_file::read_json,
};
use phylux_results::compare::{Comparison, Difference};
use phylux_studies::text::comparison::{WORST, text};

#[derive(Args)]
pub(super) struct Arguments {
    /// Results file (JSON), called a
    a: PathBuf,
    /// Results file (JSON) of another run with the same captors, called b
    b: PathBuf,
    /// How many values to list, worst first
    #[arg(long, value_name = "N", default_value_t = WORST, value_parser = worst)]
    worst: usize,
    /// Also write all values as a table (CSV): captor, what, band, a, b, z
    #[arg(long, value_name = "FILE")]
    csv: Option<PathBuf>,
    /// End with exit code 1 if the results differ by more than chance, or do not have the same
    /// captors
    #[arg(long)]
    exit_code: bool,
}

/// Exit code with `--exit-code` if the results differ.
const DIFFERENT: u8 = 1;

fn worst(text: &str) -> Checked<usize> {
    count(text).map(|number| number as usize)
}

pub(super) fn run(arguments: &Arguments) -> Result<u8> {
    let desk = interrupt::desk()?;
    let csv = arguments.csv.as_deref().map(|csv| desk.file(csv)).transpose()?;
    let place = csv.as_ref().and_then(OutputFile::place).map(Path::to_path_buf);
    let read = FilesRead::new([&arguments.a, &arguments.b]);
    check_places(place.as_slice(), &read)?;
    let (a, b) = (read_json(&arguments.a)?, read_json(&arguments.b)?);
    let comparison = Comparison::new(&a, &b)?;
    if let Some(csv) = csv {
        csv.write(&read, |writer| {
            let mut table = csv::Writer::from_writer(writer);
            table.write_record(["captor", "what", "band", "a", "b", "z"])?;
            for Difference { captor, what, band, a, b, z } in &comparison.differences {
                let (captor, band) = (csv_text::cell(captor), csv_text::cell(band));
                table.serialize((captor, what, band, a, b, z))?;
            }
            table.flush()
        })?;
    }
    terminal::print(&text(&terminal::page(), &a, &b, &comparison, arguments.worst))?;
    Ok(if arguments.exit_code && !comparison.agrees() { DIFFERENT } else { 0 })
}
