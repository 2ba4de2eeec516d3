//! VTK files, which ParaView opens: XML with raw appended data (VTK File Formats, kitware 2003-).

use std::{
    collections::HashMap,
    fmt::Write as _,
    io::{self, Write},
};

use crate::{
    captor::{CHANNELS, Channel},
    exhibit::Exhibit,
    tiles::TilePart,
};

/// Kinds of VTK file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum VtkKind {
    /// Polygons, `.vtp`.
    PolyData,
    /// Cells of any kind, `.vtu`.
    UnstructuredGrid,
}

/// VTK_TRIANGLE
const TRIANGLE: u8 = 5;
/// Names of the channels.
const QUANTITIES: [&str; 3] = ["irradiance_front", "irradiance_back", "absorbed"];

/// Writes surfaces and captors: points in metres from the user's origin; for each cell what arrives
/// and is absorbed per area, what its captor received with standard errors (NaN where it is not
/// known), and the indices of its object, material and captor, whose names are field data.
pub fn write_vtk(exhibit: &Exhibit, kind: VtkKind, writer: &mut dyn Write) -> io::Result<()> {
    let (points, corners) = points(exhibit);
    let cells = corners.len() / 3;
    let (name, cell, count) = match kind {
        VtkKind::PolyData => ("PolyData", "Polys", "Polys"),
        VtkKind::UnstructuredGrid => ("UnstructuredGrid", "Cells", "Cells"),
    };
    let mut file = VtkFile::default();
    file.line("<?xml version=\"1.0\"?>");
    file.line(&format!(
        "<VTKFile type=\"{name}\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt64\">"
    ));
    file.line(&format!("<{name}>\n<FieldData>"));
    let scene = exhibit.scene;
    file.names("scene", [scene.name.as_str()].into_iter());
    file.names("unit", [&*scene.quantity.unit_names().irradiance].into_iter());
    file.names("objects", scene.objects.iter().map(String::as_str));
    file.names("materials", scene.materials.iter().map(|m| m.name.as_str()));
    file.names("captors", scene.captors.iter().map(|captor| captor.id.as_str()));
    let sizes = format!("NumberOfPoints=\"{}\" NumberOf{count}=\"{cells}\"", points.len() / 3);
    file.line(&format!("</FieldData>\n<Piece {sizes}>\n<Points>"));
    let coordinates = points.iter().map(|p| p.to_le_bytes());
    file.array("Float64\" NumberOfComponents=\"3", "points", points.len(), coordinates);
    file.line(&format!("</Points>\n<{cell}>"));
    let indices = corners.iter().map(|c| c.to_le_bytes());
    file.array("Int64", "connectivity", corners.len(), indices);
    file.array("Int64", "offsets", cells, (1..=cells as i64).map(|n| (3 * n).to_le_bytes()));
    if kind == VtkKind::UnstructuredGrid {
        file.array("UInt8", "types", cells, (0..cells).map(|_| [TRIANGLE]));
    }
    file.line(&format!("</{cell}>\n<CellData>"));
    cell_data(exhibit, cells, &mut file);
    file.line(&format!("</CellData>\n</Piece>\n</{name}>"));
    file.write(writer)
}

fn cell_data<'a>(exhibit: &'a Exhibit, cells: usize, file: &mut VtkFile<'a>) {
    let parts = || {
        let parts = exhibit.tiles.parts.iter();
        parts.flat_map(|part| part.tiles.clone().map(move |tile| (part, tile)))
    };
    for (channel, what) in CHANNELS.into_iter().zip(QUANTITIES) {
        for (b, band) in exhibit.scene.band_names().enumerate() {
            type Value<'a> = fn(&'a Exhibit, Channel, usize, &TilePart, usize) -> Option<f64>;
            let columns: [(String, Value<'a>); 3] = [
                (format!("{what}_{band}"), |exhibit, channel, b, part, tile| {
                    exhibit.value(part, tile, channel, b)
                }),
                (format!("captor_{what}_{band}"), |exhibit, channel, b, part, _| {
                    Some(exhibit.captor(part.captor?, channel, b)?.mean)
                }),
                (format!("captor_{what}_{band}_se"), |exhibit, channel, b, part, _| {
                    exhibit.captor(part.captor?, channel, b)?.standard_error
                }),
            ];
            for (name, value) in columns {
                let values = parts().map(move |(part, tile)| {
                    let value = value(exhibit, channel, b, part, tile);
                    (value.unwrap_or(f64::NAN) as f32).to_le_bytes()
                });
                file.array("Float32", &name, cells, values);
            }
        }
    }
    type Index = fn(&TilePart) -> Option<usize>;
    let indices: [(&str, Index); 3] = [
        ("object", |part| part.object),
        ("material", |part| part.material),
        ("captor", |part| part.captor),
    ];
    for (name, index) in indices {
        let values =
            parts().map(move |(part, _)| index(part).map_or(-1, |i| i as i32).to_le_bytes());
        file.array("Int32", name, cells, values);
    }
}

/// Coordinates of the points, each once, and the points of each tile.
fn points(exhibit: &Exhibit) -> (Vec<f64>, Vec<i64>) {
    let (mut points, mut corners) = (Vec::new(), Vec::with_capacity(3 * exhibit.tiles.count()));
    let mut known = HashMap::new();
    for tile in &exhibit.tiles.corners {
        for p in [tile.a, tile.b, tile.c] {
            let next = known.len() as i64;
            let index = *known.entry(p.to_array().map(f32::to_bits)).or_insert(next);
            if index == next {
                points.extend((p.as_dvec3() + exhibit.scene.center).to_array());
            }
            corners.push(index);
        }
    }
    (points, corners)
}

/// A file in the making: its XML, and what makes the arrays that follow it, one after the other.
#[derive(Default)]
struct VtkFile<'a> {
    xml: String,
    arrays: Vec<(u64, Bytes<'a>)>,
    /// Bytes of all arrays with their headers.
    size: u64,
}

type Bytes<'a> = Box<dyn Iterator<Item = Vec<u8>> + 'a>;

/// Values that are written at a time.
const CHUNK: usize = 4096;

impl<'a> VtkFile<'a> {
    fn line(&mut self, text: &str) {
        self.xml.push_str(text);
        self.xml.push('\n');
    }

    /// An array of so many values.
    fn array<const N: usize>(
        &mut self,
        kind: &str,
        name: &str,
        count: usize,
        mut values: impl Iterator<Item = [u8; N]> + 'a,
    ) {
        let (name, offset) = (escaped(name), self.size);
        self.line(&format!(
            "<DataArray type=\"{kind}\" Name=\"{name}\" format=\"appended\" offset=\"{offset}\"/>"
        ));
        let bytes = (N * count) as u64;
        self.size += size_of::<u64>() as u64 + bytes;
        let chunks = std::iter::from_fn(move || {
            let chunk: Vec<u8> = values.by_ref().take(CHUNK).flatten().collect();
            (!chunk.is_empty()).then_some(chunk)
        });
        self.arrays.push((bytes, Box::new(chunks)));
    }

    /// Strings: their bytes as numbers, each with a 0 at the end.
    fn names<'n>(&mut self, name: &str, names: impl ExactSizeIterator<Item = &'n str>) {
        let count = names.len();
        self.line(&format!(
            "<Array type=\"String\" Name=\"{name}\" NumberOfTuples=\"{count}\" format=\"ascii\">"
        ));
        for name in names {
            name.bytes().filter(|b| *b != 0).chain([0]).for_each(|byte| {
                let _ = write!(self.xml, "{byte} ");
            });
            self.xml.push('\n');
        }
        self.line("</Array>");
    }

    fn write(self, writer: &mut dyn Write) -> io::Result<()> {
        writer.write_all(self.xml.as_bytes())?;
        writer.write_all(b"<AppendedData encoding=\"raw\">\n_")?;
        for (bytes, chunks) in self.arrays {
            writer.write_all(&bytes.to_le_bytes())?;
            for chunk in chunks {
                writer.write_all(&chunk)?;
            }
        }
        writer.write_all(b"\n</AppendedData>\n</VTKFile>\n")
    }
}

/// Text for an attribute.
fn escaped(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => escaped.push_str("&amp;"),
            '<' => escaped.push_str("&lt;"),
            '>' => escaped.push_str("&gt;"),
            '"' => escaped.push_str("&quot;"),
            c if c.is_control() => escaped.push(' '),
            c => escaped.push(c),
        }
    }
    escaped
}
