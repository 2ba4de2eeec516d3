//! Reads matrices of WINDOW: f for all pairs of patches of Klems' division of the hemisphere, or of
//! another division that the file defines (Klems, "A new method for predicting the solar heat gain
//! of complex fenestration systems", ASHRAE Transactions 100, 1994).
//!
//! In these files, a patch of incidence has the azimuth towards which light travels that passes
//! straight through, which is half a turn from where the light comes from. Azimuths are measured
//! from the right, counter-clockwise as seen from the inside, which is the back of the sheet; 90
//! degrees is up (as Radiance reads and writes these files; G. Ward, bsdf_m.c).

use std::{f32::consts::PI, path::Path};

use quick_xml::{Reader, escape::resolve_predefined_entity, events::Event};

use super::file::{MOST, ScatterTable, Wanted};
use crate::{
    error::{Error, Result, some},
    formats::input::quoted,
    scene::material::{Basis, BsdfFaces, FaceValues, PairValues},
};

/// The deepest nesting of elements.
const DEEPEST: usize = 64;

/// Rings of patches: the angle where each ends, degrees, and its number of patches.
type Rings = Vec<(f64, usize)>;

/// The rings of "LBNL/Klems Full", which a file may use without defining them.
const FULL: [(f64, usize); 9] = [
    (5.0, 1),
    (15.0, 8),
    (25.0, 16),
    (35.0, 20),
    (45.0, 24),
    (55.0, 24),
    (65.0, 24),
    (75.0, 16),
    (90.0, 12),
];

/// The content of a file, as it is written.
#[derive(Default)]
struct Content {
    bases: Vec<(String, Rings)>,
    structure: String,
    blocks: Vec<Block>,
}

/// The matrix for one wavelength and one direction of light.
#[derive(Clone, Default)]
struct Block {
    wavelength: String,
    /// Transmission or Reflection, Front or Back.
    direction: String,
    incident: String,
    leaving: String,
    values: String,
}

/// Reads a file of WINDOW for the `wanted` bands. A band takes the block of its own name, otherwise
/// the block `Visible`, otherwise the only block.
pub(super) fn parse(bytes: &[u8], path: &Path, wanted: Wanted) -> Result<ScatterTable> {
    let content = read(bytes, path)?;
    let error = |problem: String| Error::input(path.display(), problem);
    match content.structure.trim() {
        "" | "Columns" => {}
        other => {
            return Err(error(format!("its data are in {}, not in columns", quoted(other)))
                .remedy("export it with Klems' patches"));
        }
    }
    let mut wavelengths: Vec<&str> = Vec::new();
    for block in &content.blocks {
        if !wavelengths.contains(&block.wavelength.as_str()) {
            wavelengths.push(&block.wavelength);
        }
    }
    let of_band = wanted.bands.iter().map(|&band| {
        let named = |name: &str| wavelengths.iter().find(|known| known.eq_ignore_ascii_case(name));
        match (named(band).or(named("Visible")), wavelengths.as_slice()) {
            (Some(found), _) | (None, [found]) => Ok(*found),
            (None, []) => Err(error("no matrix in it".into())
                .remedy("a file of WINDOW has WavelengthDataBlock with ScatteringData")),
            (None, known) => {
                let known = some(known.iter().map(|name| quoted(name)), 20);
                Err(error(format!("neither {} nor `Visible` among its wavelengths", quoted(band)))
                    .remedy(format!("there are {known}: give the band one of these names")))
            }
        }
    });
    let of_band: Vec<&str> = of_band.collect::<Result<_>>()?;
    let matrix = |direction: &str| content.matrix(direction, &of_band, path);
    let front = [matrix("Reflection Front")?, matrix("Transmission Front")?];
    let back = [matrix("Reflection Back")?, matrix("Transmission Back")?];
    let face = |[reflected, transmitted]: [Option<PairValues>; 2]| {
        let like = |values: &PairValues| PairValues {
            values: vec![0.0; values.values.len()],
            ..values.clone()
        };
        match (reflected, transmitted) {
            (None, None) => None,
            (Some(reflected), None) => {
                Some(FaceValues { transmitted: like(&reflected), reflected })
            }
            (None, Some(transmitted)) => {
                Some(FaceValues { reflected: like(&transmitted), transmitted })
            }
            (Some(reflected), Some(transmitted)) => Some(FaceValues { reflected, transmitted }),
        }
    };
    let Some(front) = face(front) else {
        return Err(error("no matrix of light on the front".into())
            .remedy("it needs `Transmission Front` or `Reflection Front`"));
    };
    // some programs write zeros for the back if they did not trace light from there
    let is_black = |values: &PairValues| values.values.iter().all(|&f| f == 0.0);
    let dummy = |back: &FaceValues| is_black(&back.transmitted) && !is_black(&front.transmitted);
    let back = face(back).filter(|back| !dummy(back));
    for face in [Some(&front), back.as_ref()].into_iter().flatten() {
        if face.reflected.rows.len() != face.transmitted.rows.len() {
            return Err(error(
                "reflection and transmission have other patches of incidence".into(),
            )
            .remedy("export both with the same patches"));
        }
    }
    let faces = BsdfFaces { front, back, bands: wanted.bands.len() };
    Ok(ScatterTable { faces, warnings: Vec::new() })
}

/// Reads the XML of a file of WINDOW.
fn read(bytes: &[u8], path: &Path) -> Result<Content> {
    let not_xml = |problem: String| {
        Error::input(path.display(), format!("is no XML file: {problem}"))
            .remedy("a table of WINDOW is a file of XML; a CSV file has another ending")
    };
    let text = std::str::from_utf8(bytes).map_err(|_| not_xml("it is not UTF-8 text".into()))?;
    let mut reader = Reader::from_str(text.trim_start_matches('\u{feff}'));
    let mut content = Content::default();
    let mut open: Vec<String> = Vec::new();
    let mut words = String::new();
    let (mut basis, mut ring) = ((String::new(), Rings::new()), (f64::NAN, 0));
    let mut block = Block::default();
    loop {
        let event = reader.read_event().map_err(|e| not_xml(e.to_string()))?;
        match event {
            Event::Start(start) => {
                if open.len() == DEEPEST {
                    return Err(not_xml(format!("more than {DEEPEST} elements within elements")));
                }
                open.push(start.local_name().as_ref().to_string());
                words.clear();
            }
            Event::Text(part) => words += &*part,
            Event::GeneralRef(name) => {
                words += resolve_predefined_entity(&name).unwrap_or_default();
            }
            Event::End(_) => {
                let name = open.pop().unwrap_or_default();
                let trimmed = words.trim();
                match name.as_str() {
                    "IncidentDataStructure" => content.structure = trimmed.into(),
                    "AngleBasisName" => basis.0 = trimmed.into(),
                    "UpperTheta" => ring.0 = trimmed.parse().unwrap_or(f64::NAN),
                    "nPhis" => ring.1 = trimmed.parse().unwrap_or(0),
                    "AngleBasisBlock" => basis.1.push(std::mem::replace(&mut ring, (f64::NAN, 0))),
                    "AngleBasis" => content.bases.push(std::mem::take(&mut basis)),
                    "Wavelength" => block.wavelength = trimmed.into(),
                    "WavelengthDataDirection" => block.direction = trimmed.into(),
                    "ColumnAngleBasis" => block.incident = trimmed.into(),
                    "RowAngleBasis" => block.leaving = trimmed.into(),
                    "ScatteringData" => block.values = trimmed.into(),
                    "WavelengthDataBlock" => {
                        // a wavelength may have several blocks
                        let wavelength = block.wavelength.clone();
                        let next = Block { wavelength, ..Block::default() };
                        content.blocks.push(std::mem::replace(&mut block, next));
                    }
                    _ => {}
                }
                words.clear();
            }
            Event::Eof => break,
            _ => {}
        }
    }
    match open.last() {
        Some(name) => Err(not_xml(format!("<{name}> does not end"))),
        None => Ok(content),
    }
}

impl Content {
    /// Returns the matrix for a direction of light, with the blocks of the wavelengths that the
    /// bands use; `None` where the file has no such matrix.
    fn matrix(&self, direction: &str, of_band: &[&str], path: &Path) -> Result<Option<PairValues>> {
        let error =
            |problem: String| Error::input(path.display(), format!("{direction}: {problem}"));
        let fetch = "the file is broken: export it anew";
        let words = |text: &str| text.split_whitespace().map(str::to_lowercase).collect::<Vec<_>>();
        let mut blocks: Vec<&Block> = Vec::new();
        for wavelength in of_band {
            let found = self.blocks.iter().find(|block| {
                block.wavelength == *wavelength && words(&block.direction) == words(direction)
            });
            blocks.extend(found);
        }
        if blocks.is_empty() {
            return Ok(None);
        }
        if blocks.len() < of_band.len() {
            return Err(error("for some wavelengths only".into()).remedy(fetch));
        }
        let rings = |name: &str| self.rings(name).map_err(|problem| error(problem).remedy(fetch));
        let (incident, leaving) = (rings(&blocks[0].incident)?, rings(&blocks[0].leaving)?);
        let cells = |rings: &Rings| rings.iter().map(|(_, cells)| cells).sum::<usize>();
        let (columns, rows) = (cells(&incident), cells(&leaving));
        let bands = blocks.len();
        if columns * rows * bands > MOST {
            return Err(error(format!("more than {MOST} values")).remedy("use fewer bands"));
        }
        let mut values = vec![0.0; columns * rows * bands];
        let (seen_in, seen_out) = (from_front(&incident), from_front(&leaving));
        for (band, block) in blocks.iter().enumerate() {
            let same = block.incident == blocks[0].incident && block.leaving == blocks[0].leaving;
            let numbers = block.values.split(|c: char| c == ',' || c.is_whitespace());
            let mut count = 0;
            for word in numbers.filter(|word| !word.is_empty()) {
                let value = word.parse().ok().filter(|f: &f64| (0.0..1e30).contains(f));
                let Some(value) = value else {
                    let problem = format!("{} is no finite number of at least 0", quoted(word));
                    return Err(error(problem).remedy("noise below 0 counts as 0"));
                };
                // the values come row by row, with one row for each patch in which light leaves
                let (row, column) = (count / columns, count % columns);
                if row < rows {
                    let pair = seen_in[column] * rows + seen_out[row];
                    values[pair * bands + band] = value as f32;
                }
                count += 1;
            }
            if count != columns * rows || !same {
                let problem = format!("{count} values for {columns} x {rows} patches");
                return Err(error(problem).remedy(fetch));
            }
        }
        let patches = |rings: &Rings, turn: f32| {
            let rings: Vec<(f32, usize)> =
                rings.iter().map(|&(end, cells)| (end.to_radians() as f32, cells)).collect();
            Basis::patches(&rings, turn)
        };
        // azimuth 0 of the file points right as seen from the inside, so it points left as seen
        // from the front, which is half a turn from u
        let (rows, columns) = (patches(&incident, 0.0), patches(&leaving, PI));
        Ok(Some(PairValues { rows, columns, turns: None, values }))
    }

    /// Returns the rings of patches of an angle basis. Error: the basis is not defined, or does not
    /// divide the hemisphere into patches.
    fn rings(&self, name: &str) -> std::result::Result<Rings, String> {
        let defined = self.bases.iter().find(|(known, _)| known == name);
        let rings = match defined {
            Some((_, rings)) => rings.clone(),
            None if name.contains("Klems Full") => FULL.to_vec(),
            None => return Err(format!("no angle basis {}", quoted(name))),
        };
        let mut last = 0.0;
        for &(end, cells) in &rings {
            if !(end > last && end <= 90.0 + 1e-6 && (1..=10_000).contains(&cells)) {
                return Err(format!(
                    "the angle basis {} is no division into patches",
                    quoted(name)
                ));
            }
            last = end;
        }
        match last >= 90.0 - 1e-6 && rings.len() <= 1000 {
            true => Ok(rings),
            false => Err(format!("the angle basis {} does not end at 90 degrees", quoted(name))),
        }
    }
}

/// Returns, for each patch of the file, its index when patches are counted the other way around, as
/// seen from the front.
fn from_front(rings: &Rings) -> Vec<usize> {
    let mut order = Vec::new();
    for &(_, cells) in rings {
        let first = order.len();
        order.extend((0..cells).map(|cell| first + (cells - cell) % cells));
    }
    order
}
