//! Reads PLY files (Greg Turk 1994), as text or binary in both byte orders.

mod body;
mod head;

use glam::DVec3;

use super::shared::of_groups;
use crate::{
    input::quoted,
    obj::{MAX_CORNERS, MeshGroup, ObjFile, cut},
};
use body::{Body, Place};
use head::{Element, Head};
use phylux_core::{
    error::{Error, LISTED, Result, some},
    math::geometry::{is_bent, is_tangled},
    scene::world::MAX_TRIANGLES,
};

/// The names of the list of a face's corners.
const CORNERS: [&str; 2] = ["vertex_indices", "vertex_index"];
/// Elements and properties of faces that mean nothing for light, or that the scene says.
#[rustfmt::skip]
const NOT_NEEDED: [&str; 24] = [
    "edge", "camera", "red", "green", "blue", "alpha", "diffuse_red", "diffuse_green", "diffuse_blue", "nx", "ny",
    "nz", "normal_x", "normal_y", "normal_z", "quality", "confidence", "flags", "texcoord", "texnumber", "s", "t", "u",
    "v",
];

pub fn parse(bytes: &[u8], name: &str) -> Result<ObjFile> {
    let head = Head::parse(bytes, name)?;
    if head.elements.iter().any(|element| element.name == "tristrips") {
        return Err(Error::input(name, "strips of triangles (`tristrips`) are not read")
            .remedy("export the faces as polygons"));
    }
    let mut body = Body::new(bytes, &head, name);
    let (mut vertices, mut faces, mut unread) = (Vec::new(), Vec::new(), Vec::new());
    for element in &head.elements {
        match element.name.as_str() {
            "vertex" => vertices = read_vertices(element, &mut body, name)?,
            "face" => {
                faces = read_faces(element, &mut body, name)?;
                let others = element.properties.iter().map(|property| &property.name);
                unread.extend(others.filter(|name| !CORNERS.contains(&name.as_str())));
            }
            other => {
                if element.count > 0 {
                    unread.push(&element.name);
                }
                let what = format!("element {}", quoted(other));
                for i in 0..element.count {
                    body.row(element, i, &what, |_, _| {})?;
                }
            }
        }
    }
    let beyond = body.beyond();
    let mut triangles = Vec::with_capacity(faces.len());
    let (mut tangled, mut bent) = (0, 0);
    let mut polygon = Vec::new();
    for Face { row, place, corners } in faces {
        polygon.clear();
        for corner in corners {
            let Some(&vertex) = usize::try_from(corner).ok().and_then(|i| vertices.get(i)) else {
                let problem = format!(
                    "corner {corner} of face {row}, but there are {} vertices",
                    vertices.len()
                );
                return Err(Error::input(place.of(name), problem)
                    .remedy("vertices and faces are counted from 0"));
            };
            polygon.push(vertex);
        }
        let cut = cut(&polygon);
        tangled += usize::from(polygon.len() > 3 && is_tangled(&polygon, &cut));
        bent += usize::from(polygon.len() > 3 && is_bent(&polygon));
        triangles.extend(cut.iter().map(|t| t.map(|i| polygon[i])));
    }
    let holds = format!("{} vertices", vertices.len());
    let mut file = of_groups(vec![MeshGroup { triangles, ..MeshGroup::default() }], name, &holds)?;
    unread.retain(|name| !NOT_NEEDED.contains(&name.as_str()));
    if !unread.is_empty() {
        let names = some(unread.iter().map(|name| quoted(name)), LISTED);
        file.notes.push(format!("{names} of its faces and elements: not read, all is one group"));
    }
    if tangled > 0 {
        file.notes.push(format!(
            "{tangled} of its faces have an outline that crosses itself; cut them into triangles in the \
             modelling program (docs/import.md#ply)"
        ));
    }
    if bent > 0 {
        file.notes.push(format!(
            "{bent} of its faces are not flat, and where they bend is chosen here; cut them into triangles \
             in the modelling program (docs/import.md#ply)"
        ));
    }
    if let Some(beyond) = beyond {
        file.notes.push(format!("{beyond} after its last element: not read"));
    }
    Ok(file)
}

/// The corners of a face, as they are written.
struct Face {
    row: usize,
    place: Place,
    corners: Vec<i64>,
}

fn read_vertices(element: &Element, body: &mut Body, name: &str) -> Result<Vec<DVec3>> {
    let column = |axis: &str| {
        let found = element.properties.iter().position(|property| property.name == axis);
        let found = found.filter(|&i| element.properties[i].counted_by.is_none());
        found.ok_or_else(|| {
            Error::input(name, format!("its vertices have no `{axis}`"))
                .remedy("a vertex has the properties x, y and z")
        })
    };
    let columns = [column("x")?, column("y")?, column("z")?];
    let mut vertices = Vec::new();
    for i in 0..element.count {
        let mut vertex = [0.0; 3];
        let place = body.row(element, i, "vertex", |property, values| {
            for (value, column) in vertex.iter_mut().zip(columns) {
                if property == column {
                    *value = values[0];
                }
            }
        })?;
        if !vertex.iter().all(|x| x.is_finite()) {
            let problem = format!("vertex {i} has a coordinate that is no finite number");
            return Err(Error::input(place.of(name), problem)
                .remedy("vertices are counted from 0; mend it or delete it with its faces"));
        }
        vertices.push(DVec3::from(vertex));
    }
    Ok(vertices)
}

fn read_faces(element: &Element, body: &mut Body, name: &str) -> Result<Vec<Face>> {
    let lists = |property: &head::Property| {
        CORNERS.contains(&property.name.as_str()) && property.counted_by.is_some()
    };
    let column = element.properties.iter().position(lists).ok_or_else(|| {
        Error::input(name, "its faces have no list of corners")
            .remedy("it is called `vertex_indices` or `vertex_index`")
    })?;
    if element.count > MAX_TRIANGLES {
        let problem = format!("{} faces, must be at most {MAX_TRIANGLES}", element.count);
        return Err(Error::input(name, problem).remedy("use a coarser mesh"));
    }
    let mut faces = Vec::new();
    for row in 0..element.count {
        let (mut corners, mut whole, mut count) = (Vec::new(), true, 0);
        let place = body.row(element, row, "face", |property, values| {
            if property == column {
                count = values.len();
                whole = values.iter().all(|x| x.fract() == 0.0);
                corners = values.iter().take(MAX_CORNERS).map(|&x| x as i64).collect();
            }
        })?;
        let error = |problem: &str| {
            let problem = format!("face {row} {problem}");
            Err(Error::input(place.of(name), problem).remedy("faces are counted from 0"))
        };
        match count {
            0..3 => return error(&format!("has {count} corners, must have at least 3")),
            _ if count > MAX_CORNERS => {
                return error(&format!("has more than {MAX_CORNERS} corners: cut it"));
            }
            _ if !whole => return error("has a corner that is no whole number"),
            _ => faces.push(Face { row, place, corners }),
        }
    }
    Ok(faces)
}
