//! Writes VTK files, which ParaView opens: XML with binary data in base64 (VTK File Formats,
//! Kitware 2003-).
//!
//! They are written with quick-xml, because vtkio (0.6.3, 0.7.0-rc2) has no field data in XML, so
//! that names and the unit would be lost, and because it holds the whole file in memory.

mod lines;

use std::{
    collections::HashMap,
    io::{self, Write},
};

use base64::{engine::general_purpose::STANDARD, write::EncoderWriter};
use quick_xml::events::{BytesDecl, Event};

use crate::{rendered::RenderedScene, xml::allowed};
pub use lines::write_vtk_lines;
use phylux_core::scene::{captor::CHANNELS, tiles::TilePart};

/// The kinds of VTK file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum VtkKind {
    /// Polygons, `.vtp`.
    PolyData,
    /// Cells of any kind, `.vtu`.
    UnstructuredGrid,
}

/// The cell type VTK_TRIANGLE.
const TRIANGLE: u8 = 5;
/// Type of an array of strings.
const STRING: &str = "String";
/// Names of the channels.
const QUANTITIES: [&str; 3] = ["irradiance_front", "irradiance_back", "absorbed"];

type Xml<'a> = quick_xml::Writer<&'a mut dyn Write>;
type Attributes<'a> = &'a [(&'a str, &'a str)];

/// Writes surfaces and captors. Points are in metres from the user's origin. Each cell has the
/// irradiance and the absorbed power per area, the values of its captor with standard errors (NaN
/// where they are not known), and the indices of its object, material and captor, whose names are
/// field data.
pub fn write_vtk(
    rendered: &RenderedScene,
    kind: VtkKind,
    writer: &mut dyn Write,
) -> io::Result<()> {
    let grid = match kind {
        VtkKind::PolyData => "PolyData",
        VtkKind::UnstructuredGrid => "UnstructuredGrid",
    };
    file(grid, writer, |xml| {
        element(xml, "FieldData", &[], |xml| field_data(rendered, kind, xml))?;
        piece(rendered, kind, xml)
    })
}

/// Writes a file that holds a data set of this type, with its content.
fn file(
    grid: &str,
    writer: &mut dyn Write,
    content: impl FnOnce(&mut Xml) -> io::Result<()>,
) -> io::Result<()> {
    let file = [
        ("type", grid),
        ("version", "1.0"),
        ("byte_order", "LittleEndian"),
        ("header_type", "UInt64"),
    ];
    let mut xml = Xml::new_with_indent(writer, b' ', 1);
    xml.write_event(Event::Decl(BytesDecl::new("1.0", None, None)))?;
    element(&mut xml, "VTKFile", &file, |xml| element(xml, grid, &[], content))
}

fn piece(rendered: &RenderedScene, kind: VtkKind, xml: &mut Xml) -> io::Result<()> {
    let (points, corners) = points(rendered);
    let parts = rendered.tiles.parts.iter();
    let cells: Vec<Cell> =
        parts.flat_map(|part| part.tiles.clone().map(move |tile| (part, tile))).collect();
    let (topology, count) = match kind {
        VtkKind::PolyData => ("Polys", "NumberOfPolys"),
        VtkKind::UnstructuredGrid => ("Cells", "NumberOfCells"),
    };
    let sizes = [points.len() / 3, cells.len()].map(|size| size.to_string());
    let sizes = [("NumberOfPoints", &*sizes[0]), (count, &*sizes[1])];
    element(xml, "Piece", &sizes, |xml| {
        element(xml, "Points", &[], |xml| {
            let coordinates = points.iter().map(|p| p.to_le_bytes());
            array(xml, "Float64", "points", &[("NumberOfComponents", "3")], coordinates)
        })?;
        element(xml, topology, &[], |xml| {
            array(xml, "Int64", "connectivity", &[], corners.iter().map(|c| c.to_le_bytes()))?;
            let ends = (0..cells.len()).map(|n| (3 * n as i64 + 3).to_le_bytes());
            array(xml, "Int64", "offsets", &[], ends)?;
            match kind {
                VtkKind::PolyData => Ok(()),
                VtkKind::UnstructuredGrid => {
                    array(xml, "UInt8", "types", &[], cells.iter().map(|_| [TRIANGLE]))
                }
            }
        })?;
        element(xml, "CellData", &[], |xml| cell_data(rendered, &cells, xml))
    })
}

/// A tile and the part that it belongs to.
type Cell<'a> = (&'a TilePart, usize);

fn field_data(rendered: &RenderedScene, kind: VtkKind, xml: &mut Xml) -> io::Result<()> {
    let scene = rendered.scene;
    names(xml, kind, "scene", [scene.name()].into_iter())?;
    names(xml, kind, "unit", [&*scene.quantity().unit_names().irradiance].into_iter())?;
    names(xml, kind, "objects", scene.objects().iter().map(String::as_str))?;
    names(xml, kind, "materials", scene.materials().iter().map(|m| m.name.as_str()))?;
    names(xml, kind, "captors", scene.captors().iter().map(|captor| captor.id.as_str()))
}

fn cell_data(rendered: &RenderedScene, cells: &[Cell], xml: &mut Xml) -> io::Result<()> {
    for (channel, what) in CHANNELS.into_iter().zip(QUANTITIES) {
        for (b, band) in rendered.scene.band_names().enumerate() {
            let captor = |part: &TilePart| rendered.captor(part.captor?, channel, b);
            let mut column = |name: String, value: &dyn Fn(&TilePart, usize) -> Option<f64>| {
                let values = cells.iter().map(|&(part, tile)| value(part, tile));
                let values = values.map(|value| (value.unwrap_or(f64::NAN) as f32).to_le_bytes());
                array(xml, "Float32", &name, &[], values)
            };
            column(format!("{what}_{band}"), &|part, tile| rendered.value(part, tile, channel, b))?;
            column(format!("captor_{what}_{band}"), &|part, _| Some(captor(part)?.mean))?;
            column(format!("captor_{what}_{band}_se"), &|part, _| captor(part)?.standard_error)?;
        }
    }
    let mut column = |name, index: fn(&TilePart) -> Option<usize>| {
        let values = cells.iter().map(|(part, _)| index(part).map_or(-1, |i| i as i32));
        array(xml, "Int32", name, &[], values.map(i32::to_le_bytes))
    };
    column("object", |part| part.object)?;
    column("material", |part| part.material)?;
    column("captor", |part| part.captor)
}

/// Returns the coordinates of the points, each once, and the indices of the points of each tile.
fn points(rendered: &RenderedScene) -> (Vec<f64>, Vec<i64>) {
    let (mut points, mut corners) = (Vec::new(), Vec::with_capacity(3 * rendered.tiles.count()));
    let mut known = HashMap::new();
    for tile in &rendered.tiles.corners {
        for p in [tile.a, tile.b, tile.c] {
            let next = known.len() as i64;
            let index = *known.entry(p.to_array().map(f32::to_bits)).or_insert(next);
            if index == next {
                points.extend((p.as_dvec3() + rendered.scene.center()).to_array());
            }
            corners.push(index);
        }
    }
    (points, corners)
}

/// Writes an element with its attributes and its content.
fn element(
    xml: &mut Xml,
    name: &str,
    attributes: Attributes,
    inside: impl FnOnce(&mut Xml) -> io::Result<()>,
) -> io::Result<()> {
    let element = xml.create_element(name).with_attributes(attributes.iter().copied());
    element.write_inner_content(inside).map(drop)
}

/// Writes an array of numbers, or of the bytes of strings.
fn array<const N: usize>(
    xml: &mut Xml,
    kind: &str,
    name: &str,
    more: Attributes,
    values: impl ExactSizeIterator<Item = [u8; N]>,
) -> io::Result<()> {
    // not even a line end, which parsers would make a space
    let name = allowed(name).replace(char::is_control, "\u{fffd}");
    let attributes = [("type", kind), ("Name", &name), ("format", "binary")];
    let element_name = if kind == STRING { "Array" } else { "DataArray" };
    element(xml, element_name, &[&attributes[..], more].concat(), |xml| {
        let mut data = EncoderWriter::new(xml.get_mut(), &STANDARD);
        data.write_all(&((N * values.len()) as u64).to_le_bytes())?;
        for value in values {
            data.write_all(&value)?;
        }
        data.finish().map(drop)
    })
}

/// Writes names as VTK strings, each with a 0 at its end. Some readers of grids accept only numbers
/// (meshio 5.3): in grids the names are the bytes of a text with one name per line.
fn names<'n>(
    xml: &mut Xml,
    kind: VtkKind,
    name: &str,
    names: impl ExactSizeIterator<Item = &'n str>,
) -> io::Result<()> {
    let (of, end) = match kind {
        VtkKind::PolyData => (STRING, '\0'),
        VtkKind::UnstructuredGrid => ("UInt8", '\n'),
    };
    let strings = names.len();
    let mut text = String::new();
    for name in names {
        text.push_str(&name.replace(char::is_control, " "));
        text.push(end);
    }
    let tuples = if of == STRING { strings } else { text.len() }.to_string();
    array(xml, of, name, &[("NumberOfTuples", &tuples)], text.bytes().map(|b| [b]))
}
