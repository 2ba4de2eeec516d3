//! `phylux compare`: compares two results captor by captor.

use phylux_files::result_file::read_results;
use std::{
    fmt::Write,
    path::{Path, PathBuf},
};

use clap::Args;

use super::{interrupt, outputs::check_places, summary::short, table::Table, terminal};
use phylux_core::error::Result;
use phylux_files::{
    csv_text,
    output::{FilesRead, OutputFile},
};
use phylux_results::{
    compare::{Comparison, Difference, ODDS},
    saved::ResultsFile,
};

#[derive(Args)]
pub(super) struct Arguments {
    /// Results file (JSON), called a
    a: PathBuf,
    /// Results file (JSON) of another run with the same captors, called b
    b: PathBuf,
    /// How many values to list, worst first
    #[arg(long, value_name = "N", default_value_t = WORST)]
    worst: usize,
    /// Also write all values as a table (CSV): captor, what, band, a, b, z
    #[arg(long, value_name = "FILE")]
    csv: Option<PathBuf>,
    /// End with exit code 1 if the results differ by more than chance, or do not have the same
    /// captors
    #[arg(long)]
    exit_code: bool,
}

/// How many values are listed if nobody says how many.
pub(super) const WORST: usize = 10;
/// Exit code with `--exit-code` if the results differ.
const DIFFERENT: u8 = 1;

pub(super) fn run(arguments: &Arguments) -> Result<u8> {
    let desk = interrupt::desk()?;
    let csv = arguments.csv.as_deref().map(|csv| desk.file(csv)).transpose()?;
    let place = csv.as_ref().and_then(OutputFile::place).map(Path::to_path_buf);
    let read = FilesRead::new([&arguments.a, &arguments.b]);
    check_places(place.as_slice(), &read)?;
    let (a, b) = (read_results(&arguments.a)?, read_results(&arguments.b)?);
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
    super::terminal::print(&text(&a, &b, &comparison, arguments.worst))?;
    Ok(if arguments.exit_code && !comparison.agrees() { DIFFERENT } else { 0 })
}

/// Returns the text that the command prints.
pub(super) fn text(
    a: &ResultsFile,
    b: &ResultsFile,
    comparison: &Comparison,
    worst: usize,
) -> String {
    let mut text = String::new();
    for (name, file) in [("a", a), ("b", b)] {
        let ResultsFile { scene, photons, estimator, seed, .. } = file;
        let what = if estimator == "complete" { "complete paths" } else { estimator };
        let _ = writeln!(text, "{name}: {scene}, {photons} {what}, seed {seed}");
    }
    describe(&mut text, comparison, worst);
    text
}

fn describe(text: &mut String, comparison: &Comparison, worst: usize) {
    let listed = &comparison.differences[..worst.min(comparison.differences.len())];
    let mut table = Table::new("captor", ["what", "band", "a", "b", "b/a - 1", "z"], "");
    for d in listed {
        let relative =
            if d.a == 0.0 { "-".into() } else { format!("{:+.2} %", 100.0 * (d.b / d.a - 1.0)) };
        let z = d.z.map_or("-".into(), |z| format!("{z:+.2}"));
        let cells = [d.what.to_string(), d.band.to_string(), short(d.a), short(d.b), relative, z];
        table.row(d.captor.to_string(), cells, "");
    }
    let n = comparison.differences.len();
    text.push('\n');
    if !listed.is_empty() && listed.len() < n {
        let _ = writeln!(
            text,
            "the {} of {n} values that differ most (--worst lists more)",
            listed.len()
        );
    }
    table.write(text, terminal::width(), terminal::is_full());
    let rms = comparison.rms().map_or(String::new(), |rms| format!(", rms z {rms:.2}"));
    let _ = writeln!(
        text,
        "\n{n} values{rms}; chance alone stays below |z| = {:.2} (odds {ODDS})",
        comparison.limit
    );
    if comparison.few_paths > 0 {
        let _ = writeln!(
            text,
            "{} more values are left out: their errors rest on few paths, or nothing arrived, and say little",
            comparison.few_paths
        );
    }
    if !comparison.unmatched.is_empty() {
        let _ = writeln!(
            text,
            "{} values are in one of them only, the first: {}",
            comparison.unmatched.len(),
            comparison.unmatched[0]
        );
    }
    if comparison.dependent {
        text.push_str("one estimator and seed: both share random numbers, so z is too small; compare two seeds\n");
    }
    text.push_str(&match comparison.beyond_chance() {
        0 if n == 0 => "nothing is left to compare; trace more\n".into(),
        0 => "they agree within their errors\n".into(),
        beyond => format!("{beyond} differ by more than chance\n"),
    });
}
