//! The comparison of two results, worst values first.

use std::fmt::Write;

use super::{Page, short, table::Table};
use phylux_core::{error::setting, words};
use phylux_results::{
    compare::{Comparison, ODDS},
    result::{Provenance, RunResult},
};

/// How many values are listed if nobody says how many.
pub const WORST: usize = 10;

/// Returns a text that lists the worst values, so many of them.
pub fn text(
    page: &Page,
    a: &RunResult,
    b: &RunResult,
    comparison: &Comparison,
    worst: usize,
) -> String {
    let mut text = String::new();
    for (name, file) in [("a", a), ("b", b)] {
        let Provenance { scene, photons, estimator, seed, .. } = &file.provenance;
        let _ = writeln!(text, "{name}: {scene}, {photons} {estimator}, seed {seed}");
    }
    describe(page, &mut text, comparison, worst);
    text
}

fn describe(page: &Page, text: &mut String, comparison: &Comparison, worst: usize) {
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
        let words = words![
            format!("the {} of {n} values that differ most (", listed.len()),
            setting("worst"),
            " lists more)\n"
        ];
        text.push_str(&words.spelled(page.spelling));
    }
    table.write(text, page);
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
