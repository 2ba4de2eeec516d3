//! Results on disk: JSON, one JSON per captor, a tidy CSV; and what is read of them again.

mod read;

use std::{
    collections::HashSet,
    fs,
    io::{self, BufWriter, Write},
    path::{Path, PathBuf},
};

use schemars::JsonSchema;
use serde::Serialize;
use serde_json::ser::{Formatter, Serializer};

use crate::{
    error::{Error, Result},
    formats::output::{TEMPORARY, Temporary, folder_of},
    math::units::UnitNames,
    results::result::{BandResult, CaptorResult, FaceResult, RunResult},
};

pub use read::read_json;

fn buffered<W: Write>(
    file: W,
    content: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> io::Result<()> {
    let mut writer = BufWriter::new(file);
    content(&mut writer)?;
    writer.flush()
}

/// Writes a result as JSON: one line per captor, group and entry of the head.
pub fn write_json(result: &RunResult, writer: &mut dyn Write) -> io::Result<()> {
    write_lines(result, writer)
}

/// Writes anything as JSON with lines in the same way.
pub fn write_lines(value: &impl Serialize, writer: &mut dyn Write) -> io::Result<()> {
    value.serialize(&mut Serializer::with_formatter(&mut *writer, Lines::default()))?;
    writer.write_all(b"\n")
}

/// One captor's result, with what is needed to read it alone.
#[derive(Serialize, JsonSchema)]
pub struct SingleCaptor<'a> {
    phylux: &'a str,
    scene: &'a str,
    seed: u64,
    photons: u64,
    unit: &'a UnitNames,
    bands: &'a [BandResult],
    #[serde(flatten)]
    captor: &'a CaptorResult,
}

/// A folder for one file per captor.
#[derive(Debug)]
pub struct OutputFolder {
    path: PathBuf,
    staging: Option<tempfile::TempDir>,
    /// Whether it was not there before.
    new: bool,
}

impl Drop for OutputFolder {
    fn drop(&mut self) {
        self.staging = None;
        if self.new {
            // only if it is empty: nothing was written
            let _ = fs::remove_dir(&self.path);
        }
    }
}

impl OutputFolder {
    /// Prepares to write into `path`, and creates it. Errors: it cannot be created or written.
    pub fn create(path: &Path) -> Result<Self> {
        let fail =
            |problem: String| Error::input(path.display(), problem).remedy("write elsewhere");
        if path.exists() && !path.is_dir() {
            return Err(fail("is a file, not a folder".into()));
        }
        if !folder_of(path).is_dir() {
            return Err(fail(format!("there is no folder {}", folder_of(path).display())));
        }
        let new = !path.exists();
        let made = if new { fs::create_dir(path) } else { Ok(()) };
        let mut folder = made
            .map(|()| Self { path: path.to_path_buf(), staging: None, new })
            .map_err(|e| fail(format!("cannot be created: {}", e.kind())))?;
        let staging = tempfile::Builder::new().prefix(TEMPORARY).tempdir_in(path);
        let staging = staging.map_err(|e| fail(format!("cannot be written: {}", e.kind())))?;
        folder.staging = Some(staging);
        Ok(folder)
    }

    /// What to remove where the process ends before it is dropped, in this order.
    pub fn temporary(&self) -> Vec<Temporary> {
        let staging = self.staging.iter().map(|s| Temporary::Folder(s.path().to_path_buf()));
        staging.chain(self.new.then(|| Temporary::IfEmpty(self.path.clone()))).collect()
    }

    /// Where the files for captors of these ids will be, paths without links.
    pub fn places<'a>(&self, ids: impl Iterator<Item = &'a str>) -> Vec<PathBuf> {
        let folder = fs::canonicalize(&self.path).unwrap_or_else(|_| self.path.clone());
        file_names(ids, "json").iter().map(|name| folder.join(name)).collect()
    }

    /// Writes one JSON file for each captor, all of them before any is put in its place.
    pub fn write(self, result: &RunResult) -> Result<()> {
        self.stage(result)
            .map_err(|e| Error::run(self.path.display(), format!("cannot be written: {e}")))
    }

    fn stage(&self, result: &RunResult) -> io::Result<()> {
        let staging = self.staging.as_ref().map_or(&*self.path, |staging| staging.path());
        let names = file_names(result.captors.iter().map(|captor| captor.id.as_str()), "json");
        for (captor, name) in result.captors.iter().zip(&names) {
            let single = SingleCaptor {
                phylux: &result.phylux,
                scene: &result.scene,
                seed: result.seed,
                photons: result.photons,
                unit: &result.unit,
                bands: &result.bands,
                captor,
            };
            let file = fs::File::create(staging.join(name))?;
            buffered(file, |writer| {
                single
                    .serialize(&mut Serializer::with_formatter(&mut *writer, Lines::default()))?;
                writer.write_all(b"\n")
            })?;
        }
        names.iter().try_for_each(|name| fs::rename(staging.join(name), self.path.join(name)))
    }
}

/// A file name with this ending for each id: letters, digits and `-_.#` stay, all else becomes `_`; the same name
/// again gets a number.
pub fn file_names<'a>(ids: impl Iterator<Item = &'a str>, ending: &str) -> Vec<String> {
    let mut taken = HashSet::new();
    ids.map(|id| {
        let safe = |c: char| if c.is_alphanumeric() || "-_.#".contains(c) { c } else { '_' };
        let plain: String = id.chars().take(200).map(safe).collect();
        let numbered = |n: usize| match n {
            1 => format!("{plain}.{ending}"),
            _ => format!("{plain}~{n}.{ending}"),
        };
        // file systems that fold case would make one file of two
        let free = (1..).map(numbered).find(|name| taken.insert(name.to_lowercase()));
        free.unwrap_or_default()
    })
    .collect()
}

/// Writes a tidy table: one row per captor, face, band and quantity.
pub fn write_csv(result: &RunResult, writer: &mut dyn Write) -> io::Result<()> {
    let mut table = csv::Writer::from_writer(writer);
    table.write_record(["captor", "face", "band", "quantity", "value", "standard_error"])?;
    for captor in &result.captors {
        let back = captor.back.as_ref().map(|back| ("back", back));
        for (face, values) in std::iter::once(("front", &captor.front)).chain(back) {
            for (b, band) in result.bands.iter().enumerate() {
                for (quantity, value, error) in face_rows(values, b) {
                    write_row(&mut table, [&captor.id, face, &band.name, quantity], value, error)?;
                }
            }
        }
        let (Some(absorbed), Some(errors)) = (&captor.absorbed, &captor.absorbed_se) else {
            continue;
        };
        for ((band, value), error) in result.bands.iter().zip(absorbed).zip(errors) {
            write_row(&mut table, [&captor.id, "", &band.name, "absorbed"], *value, *error)?;
        }
    }
    table.flush()
}

type Row = (&'static str, f64, Option<f64>);

fn face_rows(face: &FaceResult, band: usize) -> Vec<Row> {
    let mut rows = vec![
        ("flux", face.flux[band], face.flux_se[band]),
        ("irradiance", face.irradiance[band], face.irradiance_se[band]),
    ];
    if let Some(Some(knn)) = &face.knn {
        rows.push(("knn_irradiance", knn.irradiance[band], knn.irradiance_se[band]));
        let radiance = knn.radiance.iter().zip(&knn.radiance_se);
        rows.extend(radiance.map(|(value, error)| ("knn_radiance", value[band], error[band])));
    }
    rows
}

fn write_row<W: Write>(
    table: &mut csv::Writer<W>,
    key: [&str; 4],
    value: f64,
    error: Option<f64>,
) -> io::Result<()> {
    let [captor, face, band, quantity] = key;
    let error = error.map_or(String::new(), |error| error.to_string());
    Ok(table.write_record([captor, face, band, quantity, &value.to_string(), &error])?)
}

/// JSON with a line for each entry down to the lists in the top-level object, compact below.
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
