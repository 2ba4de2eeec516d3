//! Surfaces and captors as binary glTF 2.0 (Khronos 2017-2021), coloured by a value: Blender and
//! browsers open it.

use std::{
    f32::consts::FRAC_1_SQRT_2,
    io::{self, Write},
};

use glam::Vec3;
use gltf::{
    Glb,
    binary::Header,
    json::{
        Accessor, Buffer, Extras, Index, Material, Node, Root,
        accessor::{ComponentType, GenericComponentType, Type},
        buffer::{Target, View},
        extensions::{self, material::Unlit},
        material::{PbrMetallicRoughness, StrengthFactor},
        mesh::{Mode, Primitive, Semantic},
        scene::UnitQuaternion,
        validation::Checked::Valid,
    },
};
use serde_json::{json, value::to_raw_value};

use crate::{
    math::geometry::Triangle,
    scene::{captor::Channel, tiles::TilePart},
    show::{exhibit::Exhibit, picture::Scale},
};

/// What the colours stand for.
#[derive(Clone, Debug)]
pub struct Shown {
    /// Index of a band or sum.
    pub band: usize,
    /// Power that the surface keeps per area; otherwise what arrives at each face.
    pub absorbed: bool,
    /// The values at the ends of the colour map; none chooses them.
    pub range: Option<(f64, f64)>,
    /// Whether colours go by the logarithm.
    pub log: bool,
}

/// Nodes for single captors; where there are more captors, those of one object, or the virtual
/// ones, share one.
const NODES: usize = 5000;
/// Bytes of a file besides its JSON and data, at most: headers and padding.
const FRAME: usize = 12 + 2 * (8 + 3);
/// Shown where no value is known, sRGB.
const PALE: Vec3 = Vec3::splat(0.88);
/// Share of the values below the end of a chosen range: a few bright spots would leave all else dark.
const SHOWN_SHARE: f64 = 0.99;

/// The value of each face of a tile, front then back.
type FaceValue = Option<f64>;

/// Writes the exhibit. Each face is there where it has a value, so that the dark outside of a room
/// does not hide it; faces of which none is known are pale. Errors: beyond the 4 GiB of such a file;
/// a range that is none.
pub fn write_glb(exhibit: &Exhibit, shown: &Shown, writer: &mut dyn Write) -> io::Result<()> {
    let faces = |part: &TilePart, tile: usize| -> [FaceValue; 2] {
        let value = |channel| exhibit.value(part, tile, channel, shown.band);
        match shown.absorbed {
            true => [value(Channel::Absorbed); 2],
            false => [value(Channel::Front), value(Channel::Back)],
        }
    };
    let tiles = || {
        let parts = exhibit.tiles.parts.iter();
        parts.flat_map(|part| part.tiles.clone().map(move |tile| (part, tile)))
    };
    let range = match shown.range {
        Some((low, high)) => Scale::new(low, high, shown.log).map_err(io::Error::other)?,
        None => {
            let all = tiles().flat_map(|(part, tile)| faces(part, tile)).flatten();
            Scale::of(all.collect(), SHOWN_SHARE, shown.log)
        }
    };
    let mut file = GlbFile::default();
    let mut rest = &exhibit.tiles.parts[..];
    while !rest.is_empty() {
        let together = rest.iter().take_while(|part| one_node(exhibit, part, &rest[0])).count();
        let (parts, after) = rest.split_at(together);
        rest = after;
        let mut mesh = Mesh::default();
        for part in parts {
            for tile in part.tiles.clone() {
                mesh.add(&exhibit.tiles.corners[tile], faces(part, tile), &range);
            }
        }
        if !mesh.values.is_empty() {
            file.node(mesh, node_name(exhibit, &parts[0]), extras(exhibit, &parts[0])?);
        }
    }
    file.write(exhibit, shown, &range, writer)
}

/// Whether two parts belong into one node.
fn one_node(exhibit: &Exhibit, part: &TilePart, other: &TilePart) -> bool {
    let captor = |part: &TilePart| match exhibit.scene.captors.len() > NODES {
        true => part.captor.map(|_| 0),
        false => part.captor,
    };
    let key = |part: &TilePart| (captor(part), part.object);
    key(part) == key(other)
}

fn node_name(exhibit: &Exhibit, part: &TilePart) -> String {
    let scene = exhibit.scene;
    match (part.captor, part.object) {
        (Some(captor), _) if scene.captors.len() <= NODES => scene.captors[captor].id.clone(),
        (_, Some(object)) => scene.objects[object].clone(),
        (Some(_), None) => "captors".into(),
        (None, None) => "surfaces".into(),
    }
}

/// What a node's captor received, in every band.
fn extras(exhibit: &Exhibit, part: &TilePart) -> io::Result<Extras> {
    let (Some(captor), true) = (part.captor, exhibit.scene.captors.len() <= NODES) else {
        return Ok(None);
    };
    let mut extras = serde_json::Map::new();
    for (channel, name) in [
        (Channel::Front, "irradiance_front"),
        (Channel::Back, "irradiance_back"),
        (Channel::Absorbed, "absorbed_per_area"),
    ] {
        for (b, band) in exhibit.scene.band_names().enumerate() {
            if let Some(estimate) = exhibit.captor(captor, channel, b) {
                extras.insert(format!("{name} {band}"), json!(estimate.mean));
                extras.insert(format!("{name} {band} se"), json!(estimate.standard_error));
            }
        }
    }
    Ok(Some(to_raw_value(&extras)?))
}

/// Faces of one node, with three corners of their own.
#[derive(Default)]
struct Mesh {
    corners: Vec<[f32; 3]>,
    colours: Vec<[u8; 4]>,
    values: Vec<f32>,
}

impl Mesh {
    fn add(&mut self, tile: &Triangle, [front, back]: [FaceValue; 2], range: &Scale) {
        let seen = |value: &FaceValue| value.is_some_and(|v| v > 0.0);
        let Triangle { a, b, c } = *tile;
        if seen(&front) || !seen(&back) {
            self.face([a, b, c].map(|p| p.to_array()), front, range);
        }
        if seen(&back) {
            self.face([a, c, b].map(|p| p.to_array()), back, range);
        }
    }

    fn face(&mut self, corners: [[f32; 3]; 3], value: FaceValue, range: &Scale) {
        let [r, g, b] = value.map_or(PALE, |value| range.colour(value)).to_array().map(linear);
        self.corners.extend(corners);
        self.colours.extend([[r, g, b, 255]; 3]);
        // none is known: glTF has no NaN
        self.values.extend([value.map_or(-1.0, |value| value as f32); 3]);
    }
}

/// glTF's vertex colours are linear (IEC 61966-2-1).
fn linear(s: f32) -> u8 {
    let linear = if s <= 0.040_45 { s / 12.92 } else { ((s + 0.055) / 1.055).powf(2.4) };
    (255.0 * linear).round() as u8
}

/// A file in the making.
#[derive(Default)]
struct GlbFile {
    root: Root,
    data: Vec<u8>,
}

impl GlbFile {
    fn node(&mut self, mesh: Mesh, name: String, extras: Extras) {
        let (mut low, mut high) = (mesh.corners[0], mesh.corners[0]);
        for corner in &mesh.corners {
            for axis in 0..3 {
                low[axis] = low[axis].min(corner[axis]);
                high[axis] = high[axis].max(corner[axis]);
            }
        }
        let flat =
            |values: &[f32]| -> Vec<u8> { values.iter().flat_map(|v| v.to_le_bytes()).collect() };
        let accessor = |of, each, normalized| Accessor {
            buffer_view: None,
            byte_offset: None,
            count: mesh.values.len().into(),
            component_type: Valid(GenericComponentType(of)),
            extensions: None,
            extras: None,
            type_: Valid(each),
            min: None,
            max: None,
            name: None,
            normalized,
            sparse: None,
        };
        let position = Accessor {
            min: Some(json!(low)),
            max: Some(json!(high)),
            ..accessor(ComponentType::F32, Type::Vec3, false)
        };
        let colour = accessor(ComponentType::U8, Type::Vec4, true);
        let value = accessor(ComponentType::F32, Type::Scalar, false);
        let attributes = [
            (Semantic::Positions, self.add(flat(mesh.corners.as_flattened()), position)),
            (Semantic::Colors(0), self.add(mesh.colours.into_flattened(), colour)),
            (Semantic::Extras("VALUE".into()), self.add(flat(&mesh.values), value)),
        ];
        let mesh = self.root.push(gltf::json::Mesh {
            extensions: None,
            extras: None,
            name: Some(name.clone()),
            primitives: vec![Primitive {
                attributes: attributes.into_iter().map(|(of, index)| (Valid(of), index)).collect(),
                extensions: None,
                extras: None,
                indices: None,
                material: Some(Index::new(0)),
                mode: Valid(Mode::Triangles),
                targets: None,
            }],
            weights: None,
        });
        self.root.push(Node { mesh: Some(mesh), name: Some(name), extras, ..Node::default() });
    }

    /// Adds data and says what it is.
    fn add(&mut self, bytes: Vec<u8>, accessor: Accessor) -> Index<Accessor> {
        let view = self.root.push(View {
            buffer: Index::new(0),
            byte_length: bytes.len().into(),
            byte_offset: Some(self.data.len().into()),
            byte_stride: None,
            name: None,
            target: Some(Valid(Target::ArrayBuffer)),
            extensions: None,
            extras: None,
        });
        self.data.extend(bytes);
        self.root.push(Accessor { buffer_view: Some(view), ..accessor })
    }

    fn write(
        self,
        exhibit: &Exhibit,
        shown: &Shown,
        range: &Scale,
        writer: &mut dyn Write,
    ) -> io::Result<()> {
        let Self { mut root, data } = self;
        let scene = exhibit.scene;
        let children: Vec<_> = (1..=root.nodes.len() as u32).map(Index::new).collect();
        let center = scene.center.as_vec3();
        // glTF's y is up, a scene's z
        let upright = Node {
            name: Some(scene.name.clone()),
            rotation: Some(UnitQuaternion([-FRAC_1_SQRT_2, 0.0, 0.0, FRAC_1_SQRT_2])),
            translation: Some([center.x, center.z, -center.y]),
            children: (!children.is_empty()).then_some(children),
            ..Node::default()
        };
        root.nodes.insert(0, upright);
        let whole = root.push(gltf::json::Scene {
            name: Some(scene.name.clone()),
            nodes: vec![Index::new(0)],
            extensions: None,
            extras: Some(to_raw_value(&json!({
                "quantity": if shown.absorbed { "absorbed" } else { "irradiance" },
                "band": scene.band_names().nth(shown.band),
                "unit": scene.quantity.unit_names().irradiance,
                "range": [range.low, range.high],
                "logarithmic": range.log,
                "colours": "viridis",
            }))?),
        });
        root.scene = Some(whole);
        root.asset.generator = Some(concat!("phylux ", env!("CARGO_PKG_VERSION")).into());
        if !data.is_empty() {
            root.push(Buffer {
                byte_length: data.len().into(),
                name: None,
                uri: None,
                extensions: None,
                extras: None,
            });
            root.extensions_used.push("KHR_materials_unlit".into());
            root.push(Material {
                name: Some("value".into()),
                pbr_metallic_roughness: PbrMetallicRoughness {
                    metallic_factor: StrengthFactor(0.0),
                    ..PbrMetallicRoughness::default()
                },
                extensions: Some(extensions::material::Material { unlit: Some(Unlit {}) }),
                ..Material::default()
            });
        }
        let json = root.to_vec()?;
        if u32::try_from(json.len() + data.len() + FRAME).is_err() {
            return Err(io::Error::other("a .glb holds at most 4 GiB"));
        }
        let glb = Glb {
            header: Header { magic: *b"glTF", version: 2, length: 0 },
            json: json.into(),
            bin: (!data.is_empty()).then(|| data.into()),
        };
        glb.to_writer(writer).map_err(io::Error::other)
    }
}
