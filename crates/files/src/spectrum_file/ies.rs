//! Spectra in the files of the IES: TM-27 (ANSI/IES TM-27-14 and -20, `.spdx`), and the spectral
//! part of TM-33 (ANSI/IES TM-33-18, -22 and -23).

use std::path::Path;

use super::kinds::{Column, Counts, Measured, Share};
use crate::{
    input::quoted,
    xml::{self, Element},
};
use phylux_core::{
    error::{Error, Result, nearest},
    math::curve::Curve,
};

/// Quantities of TM-27 that count the energy of light.
const ENERGY: [&str; 6] = ["flux", "intensity", "irradiance", "radiance", "exitance", "relative"];
/// Quantities of TM-27 that say what a surface does with light.
const SHARES: [(&str, Share); 5] = [
    ("reflectance", Share::Reflectance),
    ("transmittance", Share::Transmittance),
    ("absorptance", Share::Absorptance),
    ("r-factor", Share::Reflectance),
    ("t-factor", Share::Transmittance),
];

/// A spectrum in a file: its name, its element, and the name of the elements of its values, with
/// that of the attribute that holds the wavelength.
struct Entry<'a> {
    name: &'a str,
    element: &'a Element,
    values: [&'static str; 2],
    counts: Counts,
}

/// Reads one spectrum of a file: the first, the one of the emitter of this name, or the one whose
/// number is that of the column (column 2 is the first spectrum).
pub(super) fn parse(bytes: &[u8], path: &Path, column: Column) -> Result<Measured> {
    let root = xml::parse(bytes, path)?;
    let entries = match root.name.as_str() {
        name if name.starts_with("IESTM27") => vec![tm27(&root, path)?],
        name if name.starts_with("IESTM33") => tm33(&root),
        name => {
            let problem =
                format!("its outermost element is {}, not that of TM-27 or TM-33", quoted(name));
            return Err(root
                .error(path, problem)
                .remedy("export it as TM-27 (.spdx), TM-33 or CSV"));
        }
    };
    let error = |problem: String| Error::input(path.display(), problem);
    if entries.is_empty() {
        return Err(error("no spectrum in it (no `EmitterSpectral`)".into())
            .remedy("give the lamp's spectrum as a table, or one of those at hand"));
    }
    let index = match column {
        Column::Number(number) => usize::try_from(number)
            .ok()
            .and_then(|n| n.checked_sub(2))
            .filter(|&i| i < entries.len()),
        Column::Name(name) => entries.iter().position(|entry| entry.name == name),
    };
    let Some(index) = index else {
        let names = || entries.iter().map(|entry| entry.name);
        let all: Vec<String> = names().take(20).map(quoted).collect();
        let all = all.join(", ");
        return Err(match column {
            Column::Number(number) => error(format!("column {number} of {}", entries.len() + 1))
                .remedy(format!("column 2 is the first spectrum, of {all}")),
            Column::Name(name) => {
                let error = error(format!("no spectrum of an emitter {}", quoted(name)));
                error.did_you_mean_of(nearest(name, names()), &all)
            }
        });
    };
    let entry = &entries[index];
    let curve = curve(entry, path)?;
    let names = entries.iter().map(|entry| entry.name.into()).collect();
    Ok(Measured { curve, counts: Some(entry.counts), names })
}

fn tm27<'a>(root: &'a Element, path: &Path) -> Result<Entry<'a>> {
    let element = root.first("SpectralDistribution").ok_or_else(|| {
        root.error(path, "no `SpectralDistribution` in it").remedy("export it anew as TM-27")
    })?;
    let quantity = element.text_of("SpectralQuantity");
    let is = |known: &str| known.eq_ignore_ascii_case(quantity);
    let share = SHARES.iter().find(|(name, _)| is(name));
    let counts = match share {
        Some((_, share)) => Counts::Share(*share),
        None if ENERGY.iter().any(|name| is(name)) => Counts::Energy,
        None => {
            let problem = format!("its `SpectralQuantity` is {}", quoted(quantity));
            return Err(element.error(path, problem).remedy(format!(
                "it must be {} for light, or {} for a surface",
                ENERGY.join(", "),
                SHARES.map(|(name, _)| name).join(", ")
            )));
        }
    };
    let name = root.first("Header").map_or("", |header| header.text_of("Description"));
    Ok(Entry { name, element, values: ["SpectralData", "wavelength"], counts })
}

/// Returns the spectra of all emitters, in W/nm.
fn tm33(root: &Element) -> Vec<Entry<'_>> {
    let emitters = root.all("Emitter").flat_map(|emitter| {
        let parts = emitter.all("SpectralData").flat_map(|data| data.all("EmitterSpectral"));
        parts.map(move |part| (emitter, part))
    });
    emitters
        .map(|(emitter, element)| {
            let own = element.text_of("EmitterName");
            let name = if own.is_empty() { emitter.text_of("Description") } else { own };
            Entry { name, element, values: ["PwrData", "w"], counts: Counts::Energy }
        })
        .collect()
}

/// Returns the values of a spectrum over the wavelengths, nm.
fn curve(entry: &Entry, path: &Path) -> Result<Curve> {
    let Entry { element, values: [value, wavelength], .. } = *entry;
    let factor = match element.first("Multiplier") {
        Some(multiplier) => multiplier.number(path, &multiplier.text, "the multiplier")?,
        None => 1.0,
    };
    let mut points: Vec<[f64; 2]> = Vec::new();
    for row in element.all(value) {
        let nm = row.number(path, row.attribute(wavelength), "the wavelength")?;
        if let Some([before, _]) = points.last().filter(|[before, _]| *before >= nm) {
            let problem = format!("the wavelength {nm} nm comes after {before} nm");
            return Err(row.error(path, problem).remedy("wavelengths must rise"));
        }
        if !(1.0..=1e6).contains(&nm) {
            let problem = format!("a wavelength of {nm} nm");
            return Err(row.error(path, problem).remedy("wavelengths are in nm, from 1 to 1e6"));
        }
        let number = factor * row.number(path, &row.text, "the value")?;
        if !number.is_finite() {
            let problem = format!("the multiplier times {} is no finite number", row.text);
            return Err(row.error(path, problem).remedy("export the file anew"));
        }
        points.push([nm, number]);
    }
    if let Some(count) = element.first("NumberWavelength") {
        let said = count.number(path, &count.text, "the number of wavelengths")?;
        if said != points.len() as f64 {
            let problem = format!("{} values, but {said} wavelengths", points.len());
            return Err(count.error(path, problem).remedy("the file is broken: fetch it again"));
        }
    }
    Curve::new(points).map_err(|problem| problem.at(format!("{}:{}", path.display(), element.line)))
}
