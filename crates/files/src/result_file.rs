//! Result files: writes the results of a run as JSON, as one JSON file per captor, or as a tidy CSV
//! table, and reads the JSON again.

mod read;

use std::{
    collections::{HashMap, HashSet},
    fs,
    io::{self, BufReader, BufWriter, Write},
    path::{Path, PathBuf},
};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::ser::{Formatter, Serializer};

use crate::{
    csv_text,
    output::{FilesRead, NOT_OURS, Temporary, folder_of},
    unfinished::{keep_mode, remove_leftovers, unfinished_folder},
};
use phylux_core::{
    error::{Error, Result},
    math::units::UnitNames,
};
use phylux_results::{
    quantity::{Column, Per, QUANTITIES, Quantity},
    result::{BandResult, CanopyResult, CaptorResult, ElectricityRow, RatioResult, Row, RunResult},
};

pub use read::{parse_json, read_json};

fn buffered<W: Write>(
    file: W,
    content: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> io::Result<()> {
    let mut writer = BufWriter::new(file);
    content(&mut writer)?;
    writer.flush()
}

/// Writes a result as JSON, with one line for each captor, each group and each entry of the head.
pub fn write_json(result: &RunResult, writer: &mut dyn Write) -> io::Result<()> {
    write_lines(result, writer)
}

/// Writes any value as JSON with lines of the same kind.
pub fn write_lines(value: &impl Serialize, writer: &mut dyn Write) -> io::Result<()> {
    value.serialize(&mut Serializer::with_formatter(&mut *writer, Lines::default()))?;
    writer.write_all(b"\n")
}

/// The result of one captor, with the facts about the run that are needed to understand it alone.
#[derive(Serialize, JsonSchema)]
pub struct SingleCaptor<'a> {
    phylux: &'a str,
    scene: &'a str,
    seed: u64,
    photons: u64,
    unit: &'a UnitNames,
    bands: &'a [BandResult],
    #[serde(skip_serializing_if = "<[RatioResult]>::is_empty")]
    ratios: &'a [RatioResult],
    #[serde(flatten)]
    captor: &'a CaptorResult,
}

/// A folder for one result file per captor. Until all files are complete, they are kept in a
/// temporary folder: beside the folder, or inside it if it exists already.
#[derive(Debug)]
pub struct OutputFolder {
    path: PathBuf,
    /// The path that the folder will have, without links.
    place: PathBuf,
    staging: tempfile::TempDir,
    /// The lock on the temporary folder, where there is one.
    _lock: Option<fs::File>,
    /// Whether the folder did not exist before.
    new: bool,
}

impl OutputFolder {
    /// Prepares to write into the folder `path`, or to create it. Errors: it cannot be created or
    /// written.
    pub fn create(path: &Path) -> Result<Self> {
        let fail =
            |problem: String| Error::input(path.display(), problem).remedy("write elsewhere");
        if path.exists() && !path.is_dir() {
            return Err(fail("is a file, not a folder".into()));
        }
        let above = folder_of(path);
        if !above.is_dir() {
            return Err(fail(format!("there is no folder {}", above.display())));
        }
        let new = !path.exists();
        let unmade = |e: io::Error| fail(format!("cannot be created: {}", e.kind()));
        let (place, stands_in) = match path.file_name() {
            Some(name) if new => {
                let above = fs::canonicalize(above).map_err(unmade)?;
                (above.join(name), above)
            }
            _ => {
                let place = fs::canonicalize(path).map_err(unmade)?;
                (place.clone(), place)
            }
        };
        match fs::symlink_metadata(&place) {
            Ok(_) if new => return Err(fail("is a link to what is not there".into())),
            Err(e) if e.kind() != io::ErrorKind::NotFound => return Err(unmade(e)),
            _ => {}
        }
        remove_leftovers(&stands_in);
        let staging = unfinished_folder(&stands_in);
        let (staging, lock) =
            staging.map_err(|e| fail(format!("cannot be written: {}", e.kind())))?;
        Ok(Self { path: path.to_path_buf(), place, staging, _lock: lock, new })
    }

    /// Returns the path that the folder will have, without links.
    pub fn place(&self) -> &Path {
        &self.place
    }

    /// Returns the temporary folder that must be removed if the process ends before this value is
    /// dropped.
    pub fn temporary(&self) -> Temporary {
        Temporary::Folder(self.staging.path().to_path_buf())
    }

    /// Returns the paths, without links, that the files for captors with these ids will have.
    /// Error: one of the files in `read`, or anything else than the file of a captor, stands at one
    /// of them, or it cannot be written.
    pub fn places<'a>(
        &self,
        ids: impl Iterator<Item = &'a str>,
        read: &FilesRead,
    ) -> Result<Vec<PathBuf>> {
        let places = file_names(ids, "json").into_iter().map(|name| self.place.join(name));
        places
            .map(|place| {
                read.check(&place)?;
                let problem = match fs::symlink_metadata(&place) {
                    Ok(found) if !found.is_file() => "is not a file".into(),
                    Ok(_) if !is_of_captor(&place) => NOT_OURS.into(),
                    Err(e) if e.kind() != io::ErrorKind::NotFound => {
                        format!("cannot be written: {}", e.kind())
                    }
                    _ => return Ok(place),
                };
                Err(Error::input(place.display(), problem).remedy("write elsewhere"))
            })
            .collect()
    }

    /// Writes one JSON file for each captor; none is moved to its place before all are written.
    /// Errors: a file would replace one of the files in `read`, or cannot be written.
    pub fn write(self, read: &FilesRead, result: &RunResult) -> Result<()> {
        self.complete(read, result)?.put()
    }

    /// Writes one JSON file for each captor, of which none has its place yet. Errors: a file would
    /// replace one of the files in `read`, or cannot be written.
    pub fn complete(self, read: &FilesRead, result: &RunResult) -> Result<CompleteFolder> {
        let ids = result.captors.iter().map(|captor| captor.id.as_str());
        self.places(ids, read)?;
        match self.stage(result) {
            Ok(names) => Ok(CompleteFolder { folder: self, names }),
            Err(e) => Err(self.unwritten(e)),
        }
    }

    fn unwritten(&self, e: io::Error) -> Error {
        Error::unwritable(self.path.display(), e)
    }

    fn stage(&self, result: &RunResult) -> io::Result<Vec<String>> {
        let Self { place, staging, .. } = self;
        let names = file_names(result.captors.iter().map(|captor| captor.id.as_str()), "json");
        for (captor, name) in result.captors.iter().zip(&names) {
            let single = SingleCaptor {
                phylux: &result.phylux,
                scene: &result.scene,
                seed: result.seed,
                photons: result.photons,
                unit: &result.unit,
                bands: &result.bands,
                ratios: &result.ratios,
                captor,
            };
            let file = fs::File::create(staging.path().join(name))?;
            if let Ok(old) = fs::metadata(place.join(name)) {
                keep_mode(&file, &old)?;
            }
            buffered(file, |writer| {
                single
                    .serialize(&mut Serializer::with_formatter(&mut *writer, Lines::default()))?;
                writer.write_all(b"\n")
            })?;
        }
        Ok(names)
    }
}

/// Returns whether the file at a path is one of those for single captors.
fn is_of_captor(path: &Path) -> bool {
    #[derive(Deserialize)]
    struct Head {
        #[serde(rename = "phylux")]
        _phylux: String,
        #[serde(rename = "id")]
        _id: String,
    }
    fs::File::open(path)
        .is_ok_and(|file| serde_json::from_reader::<_, Head>(BufReader::new(file)).is_ok())
}

/// The files of a folder, all of which are complete and wait to be moved to their places.
#[derive(Debug)]
pub struct CompleteFolder {
    folder: OutputFolder,
    names: Vec<String>,
}

impl CompleteFolder {
    /// Moves the files to their places.
    pub fn put(self) -> Result<()> {
        let OutputFolder { place, staging, new, .. } = &self.folder;
        let moved = match new {
            true => fs::rename(staging.path(), place),
            false => self
                .names
                .iter()
                .try_for_each(|name| fs::rename(staging.path().join(name), place.join(name))),
        };
        moved.map_err(|e| self.folder.unwritten(e))?;
        if *new {
            // the folder is now in its place and must not be removed
            let _ = self.folder.staging.keep();
        }
        Ok(())
    }
}

/// The greatest length of a file name on Linux, macOS and Windows, bytes.
const LONGEST_NAME: usize = 255;

/// Returns a file name with this ending for each id. Letters, digits and `-_.#` stay, any other
/// character becomes `_`, and a name that would occur again gets a number.
pub fn file_names<'a>(ids: impl Iterator<Item = &'a str>, ending: &str) -> Vec<String> {
    let mut taken = HashSet::new();
    // for each name, the number to continue with when it occurs again
    let mut next: HashMap<String, usize> = HashMap::new();
    ids.map(|id| {
        let safe = |c: char| if c.is_alphanumeric() || "-_.#".contains(c) { c } else { '_' };
        let plain: String = id.chars().take(200).map(safe).collect();
        let numbered = |n: usize| {
            let rest = if n == 1 { format!(".{ending}") } else { format!("~{n}.{ending}") };
            let most = plain.len().min(LONGEST_NAME - rest.len());
            let cut = (0..=most).rev().find(|end| plain.is_char_boundary(*end)).unwrap_or(0);
            format!("{}{rest}", &plain[..cut])
        };
        // a file system that ignores case would take names that differ only in case for one file
        let n = next.entry(plain.to_lowercase()).or_insert(1);
        while !taken.insert(numbered(*n).to_lowercase()) {
            *n += 1;
        }
        numbered(*n)
    })
    .collect()
}

/// Writes a tidy table: one row per captor, face, band and quantity, with the captor's position,
/// area and groups; then, for each group of several captors, rows about its uniformity; then rows of
/// the layers, at their middle heights, and of the shares of sun and sky.
pub fn write_csv(result: &RunResult, writer: &mut dyn Write) -> io::Result<()> {
    let mut table = csv::Writer::from_writer(writer);
    let place = ["x", "y", "z", "area", "group"];
    let columns = ["captor", "face", "band", "quantity", "value", "standard_error"];
    // where inputs are uncertain, the table has a column more
    let model = result.extras.budget.is_some();
    table.write_record(columns.iter().chain(&place).chain(model.then_some(&"model_se")))?;
    let mut table = Rows { table, model, result };
    let parts = |rows: fn(&Quantity) -> Option<u8>| {
        0..=QUANTITIES.iter().filter_map(rows).max().unwrap_or_default()
    };
    for part in parts(|quantity| quantity.captor_rows) {
        for captor in &result.captors {
            let is_in = |quantity: &Quantity| quantity.captor_rows == Some(part);
            table.of(&captor.id, &captor.row(), is_in, || place_of(captor))?;
        }
    }
    for group in result.groups.iter().filter(|group| group.captors > 1) {
        let place = || ["", "", "", &group.area.to_string(), ""].map(String::from);
        for part in parts(|quantity| quantity.group_rows) {
            let is_in = |quantity: &Quantity| quantity.group_rows == Some(part);
            table.of(&group.id, &group.row(), is_in, place)?;
        }
    }
    if let Some(found) = &result.account.electricity {
        for ElectricityRow { of, quantity, band, value, error } in found.rows() {
            let key = [of, "", &result.bands[band].name, quantity];
            table.write(key, value, [error, None], &Default::default())?;
        }
    }
    stand_rows(&mut table, result)?;
    table.table.flush()
}

/// Writes the rows of the layers of a stand, and its shares of sun and sky.
fn stand_rows<W: Write>(table: &mut Rows<W>, result: &RunResult) -> io::Result<()> {
    for layer in result.extras.layers.iter().flatten() {
        let (middle, area) = (0.5 * (layer.from + layer.to), layer.area);
        let place = || ["", "", &middle.to_string(), &area.to_string(), ""].map(String::from);
        let name = format!("layer {} to {}", layer.from as f32, layer.to as f32);
        table.of(&name, &layer.row(), |quantity| quantity.per == Per::Band, place)?;
        table.of(&name, &layer.row(), |quantity| quantity.per == Per::Place, place)?;
    }
    for (share, values, errors) in result.extras.canopy.iter().flat_map(CanopyResult::shares) {
        let quantity = format!("share_{share}");
        for (b, band) in result.bands.iter().enumerate() {
            let key = ["canopy", "", &band.name, &quantity];
            table.write(key, values[b], [errors[b], None], &Default::default())?;
        }
    }
    Ok(())
}

/// A table that is being written.
struct Rows<'r, W: Write> {
    result: &'r RunResult,
    table: csv::Writer<W>,
    /// Whether it has a column for standard deviations by uncertain inputs.
    model: bool,
}

impl<W: Write> Rows<'_, W> {
    /// Writes the known values of some quantities of a captor, group or layer, face by face; those of
    /// one face have values for the same.
    fn of(
        &mut self,
        name: &str,
        row: &Row,
        is_in: impl Fn(&Quantity) -> bool,
        place: impl Fn() -> [String; 5],
    ) -> io::Result<()> {
        let result = self.result;
        let (bands, ratios) = (result.bands.len(), result.ratios.len());
        let mut known = None;
        for (face, word) in ["front", "back", ""].into_iter().enumerate() {
            let quantities = QUANTITIES.iter().filter(|quantity| is_in(quantity));
            let columns =
                quantities.filter_map(|quantity| Some((quantity, quantity.at(row, face)?)));
            let columns: Vec<(&Quantity, Column)> = columns.collect();
            let Some((first, _)) = columns.first() else { continue };
            let place = known.get_or_insert_with(&place);
            for entry in 0..first.width(bands, ratios) {
                for (quantity, column) in &columns {
                    let Some(value) = column.value(entry) else { continue };
                    let key = [name, word, quantity.entry(result, entry), quantity.name];
                    self.write(key, value, column.errors(entry), place)?;
                }
            }
        }
        Ok(())
    }

    /// Writes a row: captor, face, band and quantity, the value, its standard error and its standard
    /// deviation by uncertain inputs, and position, area and groups.
    fn write(
        &mut self,
        key: [&str; 4],
        value: f64,
        errors: [Option<f64>; 2],
        place: &[String; 5],
    ) -> io::Result<()> {
        let [captor, face, band, quantity] = key;
        let (captor, band) = (csv_text::cell(captor), csv_text::cell(band));
        let [error, model] =
            errors.map(|error| error.map_or(String::new(), |error| error.to_string()));
        let value = value.to_string();
        let row = [&*captor, face, &*band, quantity, &value, &error];
        let row = row.into_iter().chain(place.iter().map(String::as_str));
        Ok(self.table.write_record(row.chain(self.model.then_some(&*model)))?)
    }
}

/// Returns a captor's position, m, its area, m2, and its groups, separated by semicolons.
fn place_of(captor: &CaptorResult) -> [String; 5] {
    let [x, y, z] = captor.center.map(|at| at.to_string());
    let groups = captor.groups.as_ref().map_or(String::new(), |groups| groups.join(";"));
    [x, y, z, captor.area.to_string(), csv_text::cell(&groups).into_owned()]
}

/// Formats JSON with a line for each entry down to the entries of lists in the top-level object;
/// deeper levels are compact.
#[derive(Default)]
struct Lines {
    depth: usize,
    entries: bool,
}

impl Lines {
    const DEPTH: usize = 2;

    fn open<W: ?Sized + Write>(&mut self, writer: &mut W, bracket: &[u8]) -> io::Result<()> {
        self.depth += 1;
        self.entries = false;
        writer.write_all(bracket)
    }

    fn close<W: ?Sized + Write>(&mut self, writer: &mut W, bracket: &[u8]) -> io::Result<()> {
        self.depth -= 1;
        if self.depth < Self::DEPTH && self.entries {
            self.new_line(writer)?;
        }
        self.entries = true;
        writer.write_all(bracket)
    }

    fn entry<W: ?Sized + Write>(&mut self, writer: &mut W, first: bool) -> io::Result<()> {
        if !first {
            writer.write_all(b",")?;
        }
        match self.depth {
            1..=Self::DEPTH => self.new_line(writer),
            _ if !first => writer.write_all(b" "),
            _ => Ok(()),
        }
    }

    fn new_line<W: ?Sized + Write>(&self, writer: &mut W) -> io::Result<()> {
        writer.write_all(b"\n")?;
        (0..self.depth).try_for_each(|_| writer.write_all(b"  "))
    }
}

impl Formatter for Lines {
    fn begin_array<W: ?Sized + Write>(&mut self, writer: &mut W) -> io::Result<()> {
        self.open(writer, b"[")
    }
    fn end_array<W: ?Sized + Write>(&mut self, writer: &mut W) -> io::Result<()> {
        self.close(writer, b"]")
    }
    fn begin_array_value<W: ?Sized + Write>(&mut self, w: &mut W, first: bool) -> io::Result<()> {
        self.entry(w, first)
    }
    fn end_array_value<W: ?Sized + Write>(&mut self, _: &mut W) -> io::Result<()> {
        self.entries = true;
        Ok(())
    }
    fn begin_object<W: ?Sized + Write>(&mut self, writer: &mut W) -> io::Result<()> {
        self.open(writer, b"{")
    }
    fn end_object<W: ?Sized + Write>(&mut self, writer: &mut W) -> io::Result<()> {
        self.close(writer, b"}")
    }
    fn begin_object_key<W: ?Sized + Write>(&mut self, w: &mut W, first: bool) -> io::Result<()> {
        self.entry(w, first)
    }
    fn begin_object_value<W: ?Sized + Write>(&mut self, writer: &mut W) -> io::Result<()> {
        writer.write_all(b": ")
    }
    fn end_object_value<W: ?Sized + Write>(&mut self, _: &mut W) -> io::Result<()> {
        self.entries = true;
        Ok(())
    }
}
