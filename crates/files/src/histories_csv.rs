//! Writes how light reaches a captor as a tidy CSV table.

use std::io::{self, Write};

use crate::csv_text;
use phylux_results::histories::{HistoriesPart, HistoriesResult};

/// The columns of the table.
const COLUMNS: [&str; 11] = [
    "captor",
    "face",
    "light",
    "last_surface",
    "material",
    "band",
    "share",
    "share_se",
    "flux",
    "flux_se",
    "histories",
];

/// Writes a row for each group and band. Errors: writing fails.
pub fn write_histories_csv(result: &HistoriesResult, writer: &mut dyn Write) -> io::Result<()> {
    let mut table = csv::Writer::from_writer(writer);
    table.write_record(COLUMNS)?;
    let number = |value: Option<f64>| value.map_or(String::new(), |value| value.to_string());
    for part in &result.groups {
        let HistoriesPart { light, last_surface, material, histories, .. } = part;
        for (b, band) in result.bands.iter().enumerate() {
            let texts = [
                result.to.as_str(),
                result.face,
                light.as_deref().unwrap_or_default(),
                last_surface.as_deref().unwrap_or_default(),
                material.as_deref().unwrap_or_default(),
                band.name.as_str(),
            ];
            let texts = texts.into_iter().map(|text| csv_text::cell(text).into_owned());
            let numbers = [part.share[b], part.share_se[b], Some(part.flux[b]), part.flux_se[b]];
            let numbers = numbers.into_iter().map(number).chain([histories.to_string()]);
            table.write_record(texts.chain(numbers))?;
        }
    }
    table.flush()
}
