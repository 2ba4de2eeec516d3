//! Reads matrices of WINDOW: f for all pairs of patches of Klems' division of the hemisphere, or of
//! another division that the file defines (Klems, "A new method for predicting the solar heat gain
//! of complex fenestration systems", ASHRAE Transactions 100, 1994).
//!
//! In these files, a patch of incidence has the azimuth towards which light travels that passes
//! straight through, which is half a turn from where the light comes from. Azimuths are measured
//! from the right, counter-clockwise as seen from the inside, which is the back of the sheet; 90
//! degrees is up (as Radiance reads and writes these files; G. Ward, bsdf_m.c).

use std::{f32::consts::PI, mem, path::Path};

use super::file::{MOST, ScatterTable, Side, Wanted};
use crate::{
    input::quoted,
    xml::{self, Element},
};
use phylux_core::{
    error::{Error, Result, some},
    scene::material::{Basis, BsdfFaces, FaceValues, PairValues},
};

/// Rings of patches: the angle where each ends, degrees, and its number of patches.
type Rings = Vec<(f64, usize)>;

/// The rings of the bases that a file may use without defining them (Radiance, bsdf_m.c).
const KNOWN: [(&str, &[(f64, usize)]); 3] = [
    (
        "Klems Full",
        &[
            (5.0, 1),
            (15.0, 8),
            (25.0, 16),
            (35.0, 20),
            (45.0, 24),
            (55.0, 24),
            (65.0, 24),
            (75.0, 16),
            (90.0, 12),
        ],
    ),
    (
        "Klems Half",
        &[(6.5, 1), (19.5, 8), (32.5, 12), (46.5, 16), (61.5, 20), (76.5, 12), (90.0, 4)],
    ),
    ("Klems Quarter", &[(9.0, 1), (27.0, 8), (46.0, 12), (66.0, 12), (90.0, 8)]),
];

/// What the values of a matrix may be: f, of transmission or reflection. Some files do not say.
const KINDS: [&str; 4] = ["", "BTDF", "BRDF", "BSDF"];

/// How much light may go on for the file to be taken for noisy, and scaled down, and not for wrong.
const TOLERATED: f64 = 1.05;

/// Wavelengths, nm, within which the integral `Visible` has its weight.
const VISIBLE: [f64; 2] = [380.0, 780.0];

/// The content of a file, as it is written.
#[derive(Default)]
struct Content {
    /// The side whose normal the azimuths of patches are to be counted about.
    front: Side,
    bases: Vec<(String, Rings)>,
    structure: String,
    blocks: Vec<Block>,
}

/// The matrix for one wavelength and one direction of light.
#[derive(Clone, Default)]
struct Block {
    wavelength: String,
    /// `System` for the whole sheet, or the number of one of its layers.
    layer: String,
    /// Transmission or Reflection, Front or Back.
    direction: String,
    incident: String,
    leaving: String,
    kind: String,
    values: String,
}

/// Reads a file of WINDOW for the `wanted` bands. A band takes the block of its own name, otherwise
/// the block `Visible`, otherwise the only block. Where matrices of one face are missing, reflection
/// is that of the other face, and transmission that of the other face the other way around.
pub(super) fn parse(bytes: &[u8], path: &Path, wanted: Wanted) -> Result<ScatterTable> {
    let mut reading = Reading::default();
    reading.element(xml::parse(bytes, path)?);
    let mut content = reading.content;
    let error = |problem: String| Error::input(path.display(), problem);
    if !["", "Columns"].contains(&content.structure.as_str()) {
        let problem = format!("its data are in {}, not in columns", quoted(&content.structure));
        return Err(error(problem).remedy("export it with Klems' patches"));
    }
    content.front = wanted.front;
    let mut warnings = content.keep_system();
    let of_band = content.wavelengths(path, wanted, &mut warnings)?;
    let matrices = Matrices { content: &content, of_band, path };
    let [front, back] = matrices.faces(&mut warnings)?;
    // a sheet without values for the back takes them from the front by itself
    let has_back = back.has != [false; 2];
    let values = matrices.values(front, back, &mut warnings)?;
    let back = if has_back { matrices.values(back, front, &mut warnings)? } else { None };
    let front = values.ok_or_else(|| {
        error("no matrix of light in it".into())
            .remedy("it needs `Transmission Front`, `Reflection Front` or those of `Back`")
    })?;
    let faces = BsdfFaces { front, back, bands: wanted.bands.len() };
    Ok(ScatterTable { faces, warnings, tolerated: TOLERATED })
}

/// The two matrices of a face, reflection and transmission.
#[derive(Clone, Copy)]
struct Face {
    /// The directions of light that they are for, as the file names them.
    directions: [&'static str; 2],
    /// Whether the file has them.
    has: [bool; 2],
}

/// The index of transmission among the matrices of a face.
const TRANSMISSION: usize = 1;

/// A ring of which nothing is said, which no basis may have.
const NO_RING: (f64, usize) = (f64::NAN, 0);

/// Reads the elements of a file of WINDOW.
#[derive(Default)]
struct Reading {
    content: Content,
    basis: (String, Rings),
    ring: Option<(f64, usize)>,
    block: Block,
}

impl Reading {
    /// Reads the elements in an element, then the element itself.
    fn element(&mut self, element: Element) {
        let Element { name, text, children, .. } = element;
        children.into_iter().for_each(|child| self.element(child));
        let Self { content, basis, ring, block } = self;
        match name.as_str() {
            "IncidentDataStructure" => content.structure = text,
            "AngleBasisName" => basis.0 = text,
            "UpperTheta" => ring.get_or_insert(NO_RING).0 = text.parse().unwrap_or(f64::NAN),
            "nPhis" => ring.get_or_insert(NO_RING).1 = text.parse().unwrap_or(0),
            "AngleBasisBlock" => basis.1.push(ring.take().unwrap_or(NO_RING)),
            "AngleBasis" => content.bases.push(mem::take(basis)),
            "LayerNumber" => block.layer = text,
            "Wavelength" => block.wavelength = text,
            "WavelengthDataDirection" => block.direction = text,
            "ColumnAngleBasis" => block.incident = text,
            "RowAngleBasis" => block.leaving = text,
            "ScatteringDataType" => block.kind = text,
            "ScatteringData" => block.values = text,
            "WavelengthDataBlock" => {
                // a wavelength may have several blocks
                let (wavelength, layer) = (block.wavelength.clone(), block.layer.clone());
                let next = Block { wavelength, layer, ..Block::default() };
                content.blocks.push(mem::replace(block, next));
            }
            "WavelengthData" => *block = Block::default(),
            _ => {}
        }
    }
}

impl Block {
    fn is(&self, wavelength: &str, direction: &str) -> bool {
        let words = |text: &str| text.split_whitespace().map(str::to_lowercase).collect::<Vec<_>>();
        self.wavelength == wavelength && words(&self.direction) == words(direction)
    }
}

impl Content {
    /// Drops the blocks of single layers where there are some of the whole sheet; else those of all
    /// layers but the first; and of equal blocks all but the first. Returns what is not used.
    fn keep_system(&mut self) -> Vec<String> {
        let whole =
            |block: &Block| block.layer.is_empty() || block.layer.eq_ignore_ascii_case("System");
        let mut notes = Vec::new();
        if self.blocks.iter().any(whole) && !self.blocks.iter().all(whole) {
            notes
                .push("its blocks of single layers are not used: those of the `System` are".into());
            self.blocks.retain(whole);
        }
        if let Some(first) = self.blocks.first().filter(|block| !whole(block)) {
            let layer = first.layer.clone();
            let all = self.blocks.len();
            self.blocks.retain(|block| block.layer == layer);
            let others = if self.blocks.len() < all { ", and the others are not used" } else { "" };
            notes.push(format!(
                "it has no `System`: the sheet is taken to be its layer {} alone{others}",
                quoted(&layer)
            ));
        }
        let mut kept: Vec<Block> = Vec::new();
        for block in mem::take(&mut self.blocks) {
            match kept.iter().any(|known| known.is(&block.wavelength, &block.direction)) {
                true => notes.push(format!(
                    "a second block of {} for {} is not used",
                    quoted(&block.direction),
                    quoted(&block.wavelength)
                )),
                false => kept.push(block),
            }
        }
        notes.truncate(10);
        self.blocks = kept;
        notes
    }

    /// Returns the wavelength that each band takes. A band that takes one which is not its own is
    /// told.
    fn wavelengths(
        &self,
        path: &Path,
        wanted: Wanted,
        notes: &mut Vec<String>,
    ) -> Result<Vec<&str>> {
        let error = |problem: String| Error::input(path.display(), problem);
        let mut known: Vec<&str> = Vec::new();
        for block in &self.blocks {
            if !known.contains(&block.wavelength.as_str()) {
                known.push(&block.wavelength);
            }
        }
        let mut of_bands = Vec::new();
        for (i, &band) in wanted.bands.iter().enumerate() {
            let named = |name: &str| known.iter().find(|known| known.eq_ignore_ascii_case(name));
            let found = match (named(band).or(named("Visible")), known.as_slice()) {
                (Some(found), _) | (None, [found]) => *found,
                (None, []) => {
                    return Err(error("no matrix in it".into())
                        .remedy("a file of WINDOW has WavelengthDataBlock with ScatteringData"));
                }
                (None, known) => {
                    let known = some(known.iter().map(|name| quoted(name)), 20);
                    let problem =
                        format!("neither {} nor `Visible` among its wavelengths", quoted(band));
                    return Err(error(problem)
                        .remedy(format!("there are {known}: give the band one of these names")));
                }
            };
            let visible = found.eq_ignore_ascii_case("Visible");
            let other = match wanted.limits.get(i).copied().flatten() {
                Some([from, to]) => !visible || from < VISIBLE[0] || to > VISIBLE[1],
                None => wanted.named && (!visible || band.to_lowercase().contains("nir")),
            };
            if other && !found.eq_ignore_ascii_case(band) {
                let others = known.iter().filter(|&&name| name != found).map(|name| quoted(name));
                let others = some(others, 5);
                let have = match others.is_empty() {
                    true => "and the file has no other".into(),
                    false => format!("the file also has {others}: name the band so to use it"),
                };
                notes.push(format!(
                    "band {} takes the wavelengths {}, which are not its own; {have}",
                    quoted(band),
                    quoted(found)
                ));
            }
            of_bands.push(found);
        }
        Ok(of_bands)
    }

    /// Returns the rings of patches of an angle basis. Error: the basis is not defined, or does not
    /// divide the hemisphere into patches.
    fn rings(&self, name: &str) -> std::result::Result<Rings, String> {
        let defined = self.bases.iter().find(|(known, _)| known == name);
        let rings = match defined {
            Some((_, rings)) => rings.clone(),
            None => match KNOWN.iter().find(|(known, _)| name.contains(known)) {
                Some((_, rings)) => rings.to_vec(),
                None => return Err(format!("no angle basis {}", quoted(name))),
            },
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

/// The matrices of a file at the wavelengths that the bands take.
struct Matrices<'a> {
    content: &'a Content,
    of_band: Vec<&'a str>,
    path: &'a Path,
}

impl Matrices<'_> {
    /// Returns the front and the back of the sheet. Some programs write zeros for the face that
    /// they did not trace light from, which then has no matrices.
    fn faces(&self, warnings: &mut Vec<String>) -> Result<[Face; 2]> {
        let mut faces =
            [["Reflection Front", "Transmission Front"], ["Reflection Back", "Transmission Back"]]
                .map(|directions| Face { directions, has: directions.map(|way| self.has(way)) });
        if self.content.front == Side::Inside {
            faces.reverse();
        }
        for (face, other) in [(1, 0), (0, 1)] {
            let [name, lit] = [face, other].map(|i| faces[i].directions[TRANSMISSION]);
            let both = faces.iter().all(|face| face.has[TRANSMISSION]);
            if both && self.is_black(name)? && !self.is_black(lit)? {
                faces[face].has = [false; 2];
                warnings.push(format!(
                    "`{name}` is all zeros: light from there is taken from the other face"
                ));
            }
        }
        Ok(faces)
    }

    fn is_black(&self, direction: &str) -> Result<bool> {
        let matrix = self.matrix(direction, false)?;
        Ok(matrix.is_some_and(|matrix| matrix.values.iter().all(|&f| f == 0.0)))
    }

    /// Returns the values of a face, where it has no matrix those of the `other` one; `None` if
    /// neither has any. Error: reflection and transmission do not suit each other.
    fn values(
        &self,
        own: Face,
        other: Face,
        warnings: &mut Vec<String>,
    ) -> Result<Option<FaceValues>> {
        // all rows of a face have to be the same patches: those of the file, or, where one matrix
        // is turned around, those in which light leaves
        let turned = !own.has[TRANSMISSION] && other.has[TRANSMISSION];
        let mut part = |kind: usize| {
            let [own_name, other_name] = [own, other].map(|face| face.directions[kind]);
            match (own.has[kind], other.has[kind]) {
                (true, _) => self.matrix(own_name, turned),
                (false, true) => {
                    let way = if kind == TRANSMISSION { ", the other way around" } else { "" };
                    warnings.push(format!(
                        "it has no `{own_name}`: that is taken from `{other_name}`{way}"
                    ));
                    self.matrix(other_name, turned)
                }
                (false, false) => Ok(None),
            }
        };
        let (reflected, transmitted) = (part(0)?, part(TRANSMISSION)?);
        let black =
            |like: &PairValues| PairValues { values: vec![0.0; like.values.len()], ..like.clone() };
        let values = match (reflected, transmitted) {
            (None, None) => return Ok(None),
            (None, Some(transmitted)) => FaceValues { reflected: black(&transmitted), transmitted },
            (Some(reflected), transmitted) => FaceValues {
                transmitted: transmitted.unwrap_or_else(|| black(&reflected)),
                reflected,
            },
        };
        match values.reflected.rows.len() == values.transmitted.rows.len() {
            true => Ok(Some(values)),
            false => {
                let problem = "reflection and transmission have other patches of incidence";
                Err(Error::input(self.path.display(), problem)
                    .remedy("export both with the same patches"))
            }
        }
    }

    /// Returns whether there is a block for a direction of light, at the wavelengths of the bands.
    fn has(&self, direction: &str) -> bool {
        self.blocks(direction).next().is_some()
    }

    /// Returns the block for a direction of light at the wavelength of each band that has one.
    fn blocks(&self, direction: &str) -> impl Iterator<Item = &Block> {
        let blocks = &self.content.blocks;
        let find = move |at: &&str| blocks.iter().find(|block| block.is(at, direction));
        self.of_band.iter().filter_map(find)
    }

    /// Returns the matrix for a direction of light, with the blocks of the wavelengths that the
    /// bands use; `None` where the file has no such matrix. If it is `turned`, light comes from
    /// where it leaves in the file.
    fn matrix(&self, direction: &str, turned: bool) -> Result<Option<PairValues>> {
        let error =
            |problem: String| Error::input(self.path.display(), format!("{direction}: {problem}"));
        let fetch = "the file is broken: export it anew";
        let blocks: Vec<&Block> = self.blocks(direction).collect();
        if blocks.is_empty() {
            return Ok(None);
        }
        if let Some(block) = blocks.iter().find(|block| !KINDS.contains(&block.kind.as_str())) {
            let problem = format!("its values are {}, not BTDF or BRDF", quoted(&block.kind));
            return Err(error(problem).remedy("export f in 1/sr"));
        }
        if blocks.len() < self.of_band.len() {
            return Err(error("for some wavelengths only".into()).remedy(fetch));
        }
        let rings =
            |name: &str| self.content.rings(name).map_err(|problem| error(problem).remedy(fetch));
        let (incident, leaving) = (rings(&blocks[0].incident)?, rings(&blocks[0].leaving)?);
        let cells = |rings: &Rings| rings.iter().map(|(_, cells)| cells).sum::<usize>();
        let (columns, rows) = (cells(&incident), cells(&leaving));
        let bands = blocks.len();
        if columns * rows * bands > MOST {
            return Err(error(format!("more than {MOST} values")).remedy("use fewer bands"));
        }
        let mut values = vec![0.0; columns * rows * bands];
        let order = |rings: &Rings| match self.content.front {
            Side::Outside => from_front(rings),
            Side::Inside => (0..cells(rings)).collect(),
        };
        let (seen_in, seen_out) = (order(&incident), order(&leaving));
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
                    let (from, to) = (seen_in[column], seen_out[row]);
                    let pair = if turned { to * columns + from } else { from * rows + to };
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
        let turns = if self.content.front == Side::Outside { [0.0, PI] } else { [PI, 0.0] };
        let mut ends = [patches(&incident, turns[0]), patches(&leaving, turns[1])];
        if turned {
            ends.reverse();
        }
        let [rows, columns] = ends;
        Ok(Some(PairValues { rows, columns, turns: None, values }))
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
