//! The file that is being built: nodes, meshes and their data.

use std::{
    collections::HashMap,
    f32::consts::FRAC_1_SQRT_2,
    io::{self, Write},
};

use glam::{DVec3, Vec3};
use serde_json::{Map, Value, json};

use crate::{
    picture::{Scale, linear},
    rendered::RenderedScene,
};
use phylux_core::{
    math::geometry::Triangle,
    scene::{captor::Channel, tiles::TilePart},
};

/// The quantity that the colours show.
#[derive(Clone, Debug)]
pub struct Shown {
    /// Index of a band or sum.
    pub band: usize,
    /// Whether the colours show the power that the surface absorbs per area; otherwise the
    /// irradiance on each face.
    pub absorbed: bool,
    /// Values at the ends of the colour map; `None` chooses them.
    pub range: Option<(f64, f64)>,
    /// Whether the colour scale is logarithmic.
    pub log: bool,
}

/// Limit on the number of captors with a node each. If there are more captors, those of one object
/// share a node, and so do the virtual ones.
pub(super) const NODES: usize = 5000;
/// Colour where no value is known, sRGB.
pub(super) const PALE: Vec3 = Vec3::splat(0.88);

/// The value of a face of a tile, if it is known.
pub(super) type FaceValue = Option<f64>;

/// A face of a part of an object: the object, the first triangle of the part, and whether it is the
/// back.
pub(super) type FaceKey = (usize, usize, bool);

/// A part of an object, and the colour of each face that is written.
pub(super) type MeshKey = (usize, usize, [Option<[u8; 3]>; 2]);

pub(super) fn node_name(rendered: &RenderedScene, part: &TilePart) -> String {
    let scene = rendered.scene;
    match (part.captor, part.object) {
        (Some(captor), _) if scene.captors().len() <= NODES => scene.captors()[captor].id.clone(),
        (_, Some(object)) => scene.objects()[object].clone(),
        (Some(_), None) => "captors".into(),
        (None, None) => "surfaces".into(),
    }
}

/// Returns the values of a node's captor in every band, with standard errors.
pub(super) fn extras(rendered: &RenderedScene, part: &TilePart) -> Option<Map<String, Value>> {
    let captor = part.captor.filter(|_| rendered.scene.captors().len() <= NODES)?;
    let mut extras = Map::new();
    for (channel, name) in [
        (Channel::Front, "irradiance_front"),
        (Channel::Back, "irradiance_back"),
        (Channel::Absorbed, "absorbed_per_area"),
    ] {
        for (b, band) in rendered.scene.band_names().enumerate() {
            if let Some(estimate) = rendered.captor(captor, channel, b) {
                extras.insert(format!("{name} {band}"), json!(estimate.mean));
                extras.insert(format!("{name} {band} se"), json!(estimate.standard_error));
            }
        }
    }
    Some(extras)
}

/// Returns whether the front and the back are written.
pub(super) fn shown_faces([front, back]: [FaceValue; 2]) -> [bool; 2] {
    let seen = |value: FaceValue| value.is_some_and(|v| v > 0.0);
    [seen(front) || !seen(back), seen(back)]
}

/// Returns the corners of a triangle as they go round its front or its back.
pub(super) fn corners(&Triangle { a, b, c }: &Triangle, back: bool) -> [[f32; 3]; 3] {
    if back { [a, c, b] } else { [a, b, c] }.map(|p| p.to_array())
}

/// Returns the colour of a value; the colours of glTF are linear.
pub(super) fn colour(value: FaceValue, range: &Scale) -> [u8; 3] {
    let colour = linear(value.map_or(PALE, |value| range.colour(value)));
    colour.to_array().map(|c| (255.0 * c).round() as u8)
}

/// The faces of one node, each with three corners of its own.
#[derive(Default)]
pub(super) struct Mesh {
    pub corners: Vec<[f32; 3]>,
    pub colours: Vec<[u8; 4]>,
    pub values: Vec<f32>,
}

impl Mesh {
    pub(super) fn add(&mut self, tile: &Triangle, faces: [FaceValue; 2], range: &Scale) {
        let shown = shown_faces(faces);
        for (face, value) in faces.into_iter().enumerate().filter(|(face, _)| shown[*face]) {
            self.face(corners(tile, face == 1), value, range);
        }
    }

    pub(super) fn face(&mut self, corners: [[f32; 3]; 3], value: FaceValue, range: &Scale) {
        let [r, g, b] = colour(value, range);
        self.corners.extend(corners);
        self.colours.extend([[r, g, b, 255]; 3]);
        // -1 where no value is known, as glTF has no NaN
        self.values.extend([value.map_or(-1.0, |value| value as f32); 3]);
    }
}

/// A file that is being built: its data, and the JSON that describes them. The constants are those
/// of the specification (2.0, section 5).
#[derive(Default)]
pub(super) struct GlbFile {
    pub nodes: Vec<Value>,
    pub meshes: Vec<Value>,
    pub accessors: Vec<Value>,
    pub views: Vec<Value>,
    pub data: Vec<u8>,
    /// The materials of one colour each, after that of the colours at corners.
    pub materials: HashMap<[u8; 3], usize>,
    /// For each face of a part of an object with copies the index of its accessor.
    pub faces: HashMap<FaceKey, usize>,
    /// For each part of an object with copies, in each pair of colours, the index of its mesh.
    pub coloured: HashMap<MeshKey, usize>,
}

/// The constants of the specification (section 5) for numbers and triangles.
pub(super) const FLOAT: u16 = 5126;
pub(super) const UNSIGNED_BYTE: u16 = 5121;
pub(super) const TRIANGLES: u8 = 4;

impl GlbFile {
    pub(super) fn node(&mut self, mesh: Mesh, name: String, extras: Option<Map<String, Value>>) {
        let count = mesh.values.len();
        let value = json!({ "componentType": FLOAT, "type": "SCALAR", "count": count });
        let attributes = json!({
            "POSITION": self.positions(&mesh.corners),
            "COLOR_0": self.corner_colours(mesh.colours),
            "_VALUE": self.add(flat(&mesh.values), value),
        });
        let primitive = json!({ "attributes": attributes, "material": 0, "mode": TRIANGLES });
        let mut node = json!({ "name": name, "mesh": self.meshes.len() });
        if let Some(extras) = extras {
            node["extras"] = extras.into();
        }
        self.meshes.push(json!({ "name": name, "primitives": [primitive] }));
        self.nodes.push(node);
    }

    /// Adds the positions of corners, and returns the index of their accessor.
    pub(super) fn positions(&mut self, corners: &[[f32; 3]]) -> usize {
        let (mut low, mut high) = (corners[0], corners[0]);
        for corner in corners {
            for axis in 0..3 {
                low[axis] = low[axis].min(corner[axis]);
                high[axis] = high[axis].max(corner[axis]);
            }
        }
        let position = json!({ "componentType": FLOAT, "type": "VEC3", "count": corners.len(),
                               "min": low, "max": high });
        self.add(flat(corners.as_flattened()), position)
    }

    /// Adds data with its accessor, and returns the index of the accessor.
    pub(super) fn add(&mut self, bytes: Vec<u8>, mut accessor: Value) -> usize {
        const ARRAY_BUFFER: u16 = 34962;
        accessor["bufferView"] = self.views.len().into();
        self.views.push(json!({ "buffer": 0, "byteOffset": self.data.len(),
                                "byteLength": bytes.len(), "target": ARRAY_BUFFER }));
        self.data.extend(bytes);
        self.accessors.push(accessor);
        self.accessors.len() - 1
    }

    /// Adds the colours of corners, and returns the index of their accessor.
    pub(super) fn corner_colours(&mut self, colours: Vec<[u8; 4]>) -> usize {
        let colour = json!({ "componentType": UNSIGNED_BYTE, "type": "VEC4",
                             "count": colours.len(), "normalized": true });
        self.add(colours.into_flattened(), colour)
    }

    /// Writes the file: its nodes in the scene of this name about its centre, with the `extras` of
    /// the scene; `material` is the name of the material of meshes with colours at corners.
    pub(super) fn write(
        mut self,
        (name, center): (&str, DVec3),
        extras: Value,
        material: &str,
        writer: &mut dyn Write,
    ) -> io::Result<()> {
        let colours = self.colours();
        let children: Vec<usize> = (1..=self.nodes.len()).collect();
        // the y axis of glTF is up, in a scene the z axis
        let mut upright = json!({
            "name": name,
            "rotation": [-FRAC_1_SQRT_2, 0.0, 0.0, FRAC_1_SQRT_2],
            "translation": [center.x, center.z, -center.y],
        });
        if !children.is_empty() {
            upright["children"] = children.into();
        }
        self.nodes.insert(0, upright);
        let mut root = json!({
            "asset": { "version": "2.0", "generator": concat!("phylux ", env!("CARGO_PKG_VERSION")) },
            "scene": 0,
            "scenes": [{ "name": name, "nodes": [0], "extras": extras }],
            "nodes": self.nodes,
        });
        // glTF does not allow empty lists
        if !self.data.is_empty() {
            root["meshes"] = self.meshes.into();
            root["accessors"] = self.accessors.into();
            root["bufferViews"] = self.views.into();
            root["buffers"] = json!([{ "byteLength": self.data.len() }]);
            root["extensionsUsed"] = json!(["KHR_materials_unlit"]);
            let mut materials = vec![json!({
                "name": material,
                "pbrMetallicRoughness": { "metallicFactor": 0 },
                "extensions": { "KHR_materials_unlit": {} },
            })];
            materials.extend(colours);
            root["materials"] = materials.into();
        }
        write_chunks(serde_json::to_vec(&root)?, self.data, writer)
    }
}

pub(super) fn flat(values: &[f32]) -> Vec<u8> {
    values.iter().flat_map(|v| v.to_le_bytes()).collect()
}

/// Writes the container of a `.glb` (section 4): a header, then chunks, each padded to a multiple
/// of 4 bytes. Errors: it would exceed 4 GiB; writing fails.
pub(super) fn write_chunks(
    mut json: Vec<u8>,
    mut data: Vec<u8>,
    writer: &mut dyn Write,
) -> io::Result<()> {
    json.resize(json.len().next_multiple_of(4), b' ');
    data.resize(data.len().next_multiple_of(4), 0);
    let chunks = [(b"JSON", json), (b"BIN\0", data)];
    let chunks = chunks.iter().filter(|(_, bytes)| !bytes.is_empty());
    let length: usize = 12 + chunks.clone().map(|(_, bytes)| 8 + bytes.len()).sum::<usize>();
    let Ok(length) = u32::try_from(length) else {
        return Err(io::Error::other("a .glb holds at most 4 GiB"));
    };
    writer.write_all(b"glTF")?;
    writer.write_all(&2u32.to_le_bytes())?;
    writer.write_all(&length.to_le_bytes())?;
    for (kind, bytes) in chunks {
        writer.write_all(&(bytes.len() as u32).to_le_bytes())?;
        writer.write_all(*kind)?;
        writer.write_all(bytes)?;
    }
    Ok(())
}
