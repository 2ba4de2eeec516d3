//! Reads glTF 2.0 (Khronos, ISO/IEC 12113:2022), as JSON (`.gltf`) or binary (`.glb`): the triangles
//! of the nodes of its scene, in metres, turned so that z points up.

mod accessor;
mod beside;
mod document;
mod nodes;

use std::{borrow::Cow, collections::HashSet, path::Path};

use base64::{
    Engine,
    alphabet::STANDARD,
    engine::{DecodePaddingMode, GeneralPurpose, GeneralPurposeConfig},
};
use glam::{DAffine3, DVec3};

use super::shared::of_groups;
use crate::{
    input::quoted,
    json::place,
    obj::{MeshGroup, ObjFile, merged},
};
use accessor::Buffers;
use document::{Document, Mesh, Primitive};
use phylux_core::{
    error::{Error, Result},
    scene::world::MAX_TRIANGLES,
};

pub fn parse(
    bytes: &[u8],
    path: &Path,
    mut fetch: impl FnMut(&Path) -> std::result::Result<Vec<u8>, String>,
) -> Result<ObjFile> {
    let name = &path.display().to_string();
    let (json, own) = split(bytes, name)?;
    let document: Document = serde_json::from_slice(json)
        .map_err(|e| Error::input(name, format!("is no glTF: {e}")).remedy("export it again"))?;
    beside::check(&document, name)?;
    let mut buffers = Vec::new();
    for (i, buffer) in document.buffers.iter().enumerate() {
        let place = || place(name, &format!("/buffers/{i}"));
        let bytes = match (&buffer.uri, own) {
            (None, Some(own)) if i == 0 => Ok(Cow::Borrowed(own)),
            (Some(uri), _) => content(uri, path, &mut fetch).map(Cow::Owned),
            _ => Err("has no `uri`".into()),
        };
        let error =
            |why: String| Error::input(place(), why).remedy("export it as one binary file (.glb)");
        let bytes = bytes.map_err(error)?;
        if (bytes.len() as u64) < buffer.byte_length {
            let problem = format!("{} bytes, must be {}", bytes.len(), buffer.byte_length);
            return Err(error(problem));
        }
        buffers.push(bytes);
    }
    let mut found = Found { notes: beside::notes(&document), ..Found::default() };
    let buffers = Buffers::new(&document, &buffers, name);
    for (group, place, mesh, transform) in nodes::placed(&document, name)? {
        found.mesh(&document, &buffers, mesh, &group, &transform)?;
        if !found.names.insert(group.clone()) {
            found.repeated.push((group, place));
        }
    }
    let Found { groups, repeated, mut notes, without_surface, .. } = found;
    if without_surface > 0 {
        notes.push(format!("{without_surface} sets of points or lines: they have no surface"));
    }
    let holds = format!("{} meshes in its scene", document.meshes.len());
    let mut file = of_groups(groups, name, &holds)?;
    file.notes = notes;
    file.merged = merged(repeated.iter().map(|(name, place)| (name, place.clone())));
    file.is_gltf = true;
    Ok(file)
}

/// Turns the y axis, which points up in a glTF, to the z axis.
fn z_up(p: DVec3) -> DVec3 {
    DVec3::new(p.x, -p.z, p.y)
}

/// Returns the JSON of a file and, from a binary file, the bytes after it.
fn split<'a>(bytes: &'a [u8], name: &str) -> Result<(&'a [u8], Option<&'a [u8]>)> {
    let Some(rest) = bytes.strip_prefix(b"glTF") else {
        return Ok((bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes), None));
    };
    let error = |problem: String| Error::input(name, problem).remedy("export it again");
    let number = |at: usize| {
        let four = rest.get(at..).and_then(<[u8]>::first_chunk::<4>);
        four.map(|four| u32::from_le_bytes(*four)).ok_or_else(|| error("ends in its head".into()))
    };
    match number(0)? {
        2 => {}
        version => return Err(error(format!("is of version {version} of glTF, must be 2"))),
    }
    let (mut at, mut json, mut own) = (8, None, None);
    while at < rest.len() && own.is_none() {
        let (length, kind) = (number(at)? as usize, number(at + 4)?);
        let Some(chunk) = (at + 8).checked_add(length).and_then(|end| rest.get(at + 8..end)) else {
            let held = rest.len() - at - 8;
            return Err(error(format!("ends after {held} of the {length} bytes of a chunk")));
        };
        match &kind.to_le_bytes() {
            b"JSON" if json.is_none() => json = Some(chunk),
            b"BIN\0" => own = Some(chunk),
            // the standard says that other chunks are to be skipped
            _ => {}
        }
        at += 8 + length;
    }
    Ok((json.ok_or_else(|| error("has no JSON".into()))?, own))
}

/// Returns the bytes that a URI stands for: base64 in itself, or a file beside this one.
fn content(
    uri: &str,
    path: &Path,
    fetch: &mut impl FnMut(&Path) -> std::result::Result<Vec<u8>, String>,
) -> std::result::Result<Vec<u8>, String> {
    if let Some(data) = uri.strip_prefix("data:") {
        let data = data.split_once(";base64,").ok_or("data that is not in base64")?.1;
        let either = GeneralPurposeConfig::new()
            .with_decode_padding_mode(DecodePaddingMode::Indifferent)
            .with_decode_allow_trailing_bits(true);
        return GeneralPurpose::new(&STANDARD, either)
            .decode(data)
            .map_err(|e| format!("data in base64 that cannot be read: {e}"));
    }
    if uri.contains("://") {
        return Err(format!("{} is not a file beside this one", quoted(uri)));
    }
    let file = path.with_file_name(unescaped(uri));
    fetch(&file).map_err(|why| format!("{}: {why}", file.display()))
}

/// Replaces `%20` and the like in a URI by the bytes that they stand for.
fn unescaped(uri: &str) -> String {
    let mut bytes = Vec::new();
    let mut rest = uri.as_bytes();
    while let [first, tail @ ..] = rest {
        let digits = tail.get(..2).and_then(|two| std::str::from_utf8(two).ok());
        let byte = digits.and_then(|two| u8::from_str_radix(two, 16).ok());
        match byte.filter(|_| *first == b'%') {
            Some(byte) => {
                bytes.push(byte);
                rest = &tail[2..];
            }
            None => {
                bytes.push(*first);
                rest = tail;
            }
        }
    }
    String::from_utf8_lossy(&bytes).into_owned()
}

/// What was found so far.
#[derive(Default)]
struct Found {
    groups: Vec<MeshGroup>,
    names: HashSet<String>,
    /// Names of groups that come again, with the place.
    repeated: Vec<(String, String)>,
    notes: Vec<String>,
    triangles: usize,
    /// Number of primitives that are points or lines.
    without_surface: usize,
}

impl Found {
    /// Adds the triangles of a mesh, placed by `transform`, as the group `group`.
    fn mesh(
        &mut self,
        document: &Document,
        buffers: &Buffers,
        (m, mesh): (usize, &Mesh),
        group: &str,
        transform: &DAffine3,
    ) -> Result<()> {
        // a mirrored mesh keeps its fronts, so its corners run the other way
        let [x, y, z] =
            transform.matrix3.to_cols_array_2d().map(|c| DVec3::from(c).normalize_or_zero());
        let mirrored = x.cross(y).dot(z) < 0.0;
        for (p, primitive) in mesh.primitives.iter().enumerate() {
            let pointer = format!("/meshes/{m}/primitives/{p}");
            let Some(faces) = self.faces(primitive, buffers, &pointer)? else { continue };
            let positions = primitive.attributes.get("POSITION").copied();
            let Some(positions) = positions else {
                let error = Error::input(buffers.place(&pointer), "has no POSITION");
                return Err(error.remedy("export it again"));
            };
            let positions = buffers.accessor(positions, 3)?;
            let mut triangles = Vec::with_capacity(faces.len());
            for face in faces {
                let mut corners = [DVec3::ZERO; 3];
                for (corner, i) in corners.iter_mut().zip(face) {
                    let point = DVec3::from(positions.get(i)?);
                    *corner = z_up(transform.transform_point3(point));
                    if !corner.is_finite() {
                        return Err(positions.error(format!("vertex {i} is no finite point")));
                    }
                }
                if mirrored {
                    corners.swap(1, 2);
                }
                triangles.push(corners);
            }
            let material = primitive.material.and_then(|i| document.materials.get(i));
            let material = material.and_then(|material| material.name.clone());
            let name = Some(group.to_owned());
            self.groups.push(MeshGroup { name, material, triangles });
        }
        Ok(())
    }

    /// Returns the corners of the triangles of a primitive; `None` where it has no surface.
    fn faces(
        &mut self,
        primitive: &Primitive,
        buffers: &Buffers,
        pointer: &str,
    ) -> Result<Option<Vec<[usize; 3]>>> {
        let error = |problem: String| {
            Err(Error::input(buffers.place(pointer), problem).remedy("export it again"))
        };
        let mode = primitive.mode.unwrap_or(4);
        if mode < 4 {
            self.without_surface += 1;
            return Ok(None);
        }
        let indices = primitive.indices.map(|i| buffers.accessor(i, 1)).transpose()?;
        let count = match (&indices, primitive.attributes.get("POSITION")) {
            (Some(indices), _) => indices.count(),
            (None, Some(&positions)) => buffers.accessor(positions, 3)?.count(),
            (None, None) => 0,
        };
        let triangles = if mode == 4 { count / 3 } else { count.saturating_sub(2) };
        self.triangles = self.triangles.saturating_add(triangles);
        if self.triangles > MAX_TRIANGLES {
            return error(format!("more than {MAX_TRIANGLES} triangles with those before"));
        }
        if mode == 4 && count % 3 != 0 {
            return error(format!("{count} corners, which are not three for each triangle"));
        }
        let corner = |i: usize| match &indices {
            None => Ok(i),
            Some(indices) => indices.index(i),
        };
        let mut faces = Vec::with_capacity(triangles);
        for i in 0..triangles {
            let places = match mode {
                4 => [3 * i, 3 * i + 1, 3 * i + 2],
                5 => [i, i + 1 + i % 2, i + 2 - i % 2],
                6 => [i + 1, i + 2, 0],
                _ => return error(format!("mode {mode}, must be from 0 to 6")),
            };
            let [a, b, c] = places.map(corner);
            let face = [a?, b?, c?];
            // the turns of strips are triangles that come back to a corner
            if mode != 5 || (face[0] != face[1] && face[1] != face[2] && face[2] != face[0]) {
                faces.push(face);
            }
        }
        Ok(Some(faces))
    }
}
