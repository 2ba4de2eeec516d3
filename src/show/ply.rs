//! Photons as a PLY file (G. Turk 1994): binary points, which MeshLab, CloudCompare, Blender and
//! Python open.

use std::io::{self, Write};

use glam::{DVec3, Vec3};
use ply_rs_bw::{
    ply::{
        Addable, ElementDef, Encoding, Header, PropertyAccess, PropertyDef, PropertyType,
        ScalarType,
    },
    writer::Writer,
};

use crate::{scene::world::Scene, transport::surface_light::SurfaceLight};

/// Writes every stored photon: where (m from the user's origin), the way it travelled, its power per
/// band (W or umol/s), the index of its light and how often it was scattered before.
pub fn write_ply(light: &SurfaceLight, mut writer: &mut dyn Write) -> io::Result<()> {
    let (scene, map) = (light.scene, &light.map);
    let ply = Writer::<Point>::new();
    let points = points(scene, map.photons.len());
    ply.write_header(&mut writer, &header(scene, points.clone()))?;
    let share = 1.0 / map.histories.max(1) as f64;
    for (i, (position, photon)) in map.positions().iter().zip(&*map.photons).enumerate() {
        let point = Point {
            position: position.as_dvec3() + scene.center,
            direction: photon.direction.unpack(),
            power: map.power(i).iter().map(|power| (f64::from(*power) * share) as f32).collect(),
            light: photon.light,
            bounce: map.ways().get(i).map_or(0, |way| way.bounces.into()),
        };
        ply.write_little_endian_element(&mut writer, &point, &points)?;
    }
    Ok(())
}

/// A photon as it is written.
#[derive(Default)]
struct Point {
    position: DVec3,
    direction: Vec3,
    power: Vec<f32>,
    light: u32,
    bounce: u32,
}

impl PropertyAccess for Point {
    fn new() -> Self {
        Self::default()
    }

    fn get_double(&self, name: &str) -> Option<f64> {
        match name {
            "x" => Some(self.position.x),
            "y" => Some(self.position.y),
            "z" => Some(self.position.z),
            _ => None,
        }
    }

    fn get_float(&self, name: &str) -> Option<f32> {
        match name {
            "dx" => Some(self.direction.x),
            "dy" => Some(self.direction.y),
            "dz" => Some(self.direction.z),
            _ => self.power.get(name.strip_prefix(POWER)?.parse::<usize>().ok()?).copied(),
        }
    }

    fn get_uint(&self, name: &str) -> Option<u32> {
        match name {
            "light" => Some(self.light),
            "bounce" => Some(self.bounce),
            _ => None,
        }
    }
}

fn points(scene: &Scene, count: usize) -> ElementDef {
    let mut points = ElementDef::new("vertex".into());
    points.count = count;
    let mut add = |name: &str, kind| {
        points.properties.add(PropertyDef::new(name.into(), PropertyType::Scalar(kind)));
    };
    ["x", "y", "z"].into_iter().for_each(|name| add(name, ScalarType::Double));
    ["dx", "dy", "dz"].into_iter().for_each(|name| add(name, ScalarType::Float));
    (0..scene.bands.len()).for_each(|b| add(&format!("{POWER}{b}"), ScalarType::Float));
    // of whole numbers, all readers know this one (meshio 5.3: no ushort)
    ["light", "bounce"].into_iter().for_each(|name| add(name, ScalarType::UInt));
    points
}

fn header(scene: &Scene, points: ElementDef) -> Header {
    let mut header = Header::new();
    header.encoding = Encoding::BinaryLittleEndian;
    header.elements.add(points);
    let unit = scene.quantity.unit_names().flux;
    // a line end in a name would end the comment
    let mut comment = |text: String| header.comments.push(text.replace(char::is_control, " "));
    comment(format!("photons of {}; powers in {unit}, lengths in m", scene.name));
    for (b, band) in scene.bands.iter().enumerate() {
        comment(format!("{POWER}{b}: {}", band.name));
    }
    for (l, light) in scene.lights.iter().enumerate().take(LISTED) {
        comment(format!("light {l}: {}", light.name));
    }
    header
}

/// How the names of powers begin; the index of the band follows.
const POWER: &str = "power_";
/// Lights that the header names.
const LISTED: usize = 1000;
