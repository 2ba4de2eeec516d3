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

/// Writes surfaces and captors: points in metres from the user's origin; for each cell what arrives
/// and is absorbed per area, what its captor received with standard errors (NaN where it is not
/// known), and the indices of its object, material and captor, whose names are field data.
pub fn write_vtk(exhibit: &Exhibit, kind: VtkKind, writer: &mut dyn Write) -> io::Result<()> {
    let (points, corners) = points(exhibit);
    let cells = corners.len() / 3;
    let mut file = VtkFile::default();
    let (name, prefix) = match kind {
        VtkKind::PolyData => ("PolyData", "Poly"),
        VtkKind::UnstructuredGrid => ("UnstructuredGrid", "Cell"),
    };
    let _ = writeln!(file.xml, "<?xml version=\"1.0\"?>");
    let _ = writeln!(
        file.xml,
        "<VTKFile type=\"{name}\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt64\">"
    );
    let _ = writeln!(file.xml, "<{name}>\n<FieldData>");
    let scene = exhibit.scene;
    file.names("scene", [scene.name.as_str()].into_iter());
    file.names("unit", [scene.quantity.unit_names().irradiance].into_iter());
    file.names("objects", scene.objects.iter().map(String::as_str));
    file.names("materials", scene.materials.iter().map(|m| m.name.as_str()));
    file.names("captors", scene.captors.iter().map(|captor| captor.id.as_str()));
    let count = match kind {
        VtkKind::PolyData => "Polys",
        VtkKind::UnstructuredGrid => "Cells",
    };
    let _ = writeln!(
        file.xml,
        "</FieldData>\n<Piece NumberOfPoints=\"{}\" NumberOf{count}=\"{cells}\">\n<Points>",
        points.len() / 3
    );
    file.array("Float64", "points", 3, points.iter().map(|p| p.to_le_bytes()));
    let _ = writeln!(file.xml, "</Points>\n<{prefix}s>");
    file.array("Int64", "connectivity", 1, corners.iter().map(|c| c.to_le_bytes()));
    file.array("Int64", "offsets", 1, (1..=cells as i64).map(|n| (3 * n).to_le_bytes()));
    if kind == VtkKind::UnstructuredGrid {
        file.array("UInt8", "types", 1, (0..cells).map(|_| [TRIANGLE]));
    }
    let _ = writeln!(file.xml, "</{prefix}s>\n<CellData>");
    cell_data(exhibit, &mut file);
    let _ = writeln!(file.xml, "</CellData>\n</Piece>\n</{name}>");
    file.write(writer)
}

fn cell_data(exhibit: &Exhibit, file: &mut VtkFile) {
    let parts = || {
        let parts = exhibit.tiles.parts.iter();
        parts.flat_map(|part| part.tiles.clone().map(move |tile| (part, tile)))
    };
    let bands: Vec<&str> = exhibit.scene.band_names().collect();
    for channel in CHANNELS {
        let what = match channel {
            Channel::Front => "irradiance_front",
            Channel::Back => "irradiance_back",
            Channel::Absorbed => "absorbed",
        };
        for (b, band) in bands.iter().enumerate() {
            let mut floats = |name: String, value: &dyn Fn(&TilePart, usize) -> Option<f64>| {
                let value = |(part, tile)| value(part, tile).unwrap_or(f64::NAN) as f32;
                file.array("Float32", &name, 1, parts().map(|at| value(at).to_le_bytes()));
            };
            let captor = |part: &TilePart| exhibit.captor(part.captor?, channel, b);
            floats(format!("{what}_{band}"), &|part, tile| exhibit.value(part, tile, channel, b));
            floats(format!("captor_{what}_{band}"), &|part, _| Some(captor(part)?.mean));
            floats(format!("captor_{what}_{band}_se"), &|part, _| captor(part)?.standard_error);
        }
    }
    let mut indices = |name, index: &dyn Fn(&TilePart) -> Option<usize>| {
        let index = |part| index(part).map_or(-1, |i| i as i32);
        file.array("Int32", name, 1, parts().map(|(part, _)| index(part).to_le_bytes()));
    };
    indices("object", &|part| part.object);
    indices("material", &|part| part.material);
    indices("captor", &|part| part.captor);
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

/// A file in the making: what XML says of the arrays, and their bytes.
#[derive(Default)]
struct VtkFile {
    xml: String,
    data: Vec<u8>,
}

impl VtkFile {
    fn array<const N: usize>(
        &mut self,
        kind: &str,
        name: &str,
        components: usize,
        values: impl Iterator<Item = [u8; N]>,
    ) {
        let _ = write!(self.xml, "<DataArray type=\"{kind}\" Name=\"{}\"", escaped(name));
        if components > 1 {
            let _ = write!(self.xml, " NumberOfComponents=\"{components}\"");
        }
        let _ = writeln!(self.xml, " format=\"appended\" offset=\"{}\"/>", self.data.len());
        let header = self.data.len();
        self.data.extend([0; size_of::<u64>()]);
        values.for_each(|value| self.data.extend(value));
        let bytes = (self.data.len() - header - size_of::<u64>()) as u64;
        self.data[header..][..size_of::<u64>()].copy_from_slice(&bytes.to_le_bytes());
    }

    /// Strings: their bytes as numbers, each with a 0 at the end.
    fn names<'a>(&mut self, name: &str, names: impl ExactSizeIterator<Item = &'a str>) {
        let count = names.len();
        let _ = write!(self.xml, "<Array type=\"String\" Name=\"{name}\" ");
        let _ = writeln!(self.xml, "NumberOfTuples=\"{count}\" format=\"ascii\">");
        for name in names {
            name.bytes().filter(|b| *b != 0).chain([0]).for_each(|byte| {
                let _ = write!(self.xml, "{byte} ");
            });
            self.xml.push('\n');
        }
        self.xml.push_str("</Array>\n");
    }

    fn write(self, writer: &mut dyn Write) -> io::Result<()> {
        writer.write_all(self.xml.as_bytes())?;
        writer.write_all(b"<AppendedData encoding=\"raw\">\n_")?;
        writer.write_all(&self.data)?;
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
