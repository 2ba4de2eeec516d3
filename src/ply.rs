//! Photons as a PLY file (G. Turk 1994): binary points, which MeshLab, CloudCompare, Blender and
//! Python open.

use std::io::{self, Write};

use crate::{estimate::surface::SurfaceLight, scene::Scene};

/// Writes every stored photon: where (m from the user's origin), the way it travelled, its power per
/// band (W or umol/s), the index of its light and how often it was scattered before.
pub fn write_ply(light: &SurfaceLight, writer: &mut dyn Write) -> io::Result<()> {
    let (scene, map) = (light.scene, &light.map);
    write!(writer, "{}", header(scene, map.photons.len()))?;
    let share = 1.0 / map.histories.max(1) as f64;
    for (i, (position, photon)) in map.positions().iter().zip(&*map.photons).enumerate() {
        let position = position.as_dvec3() + scene.center;
        for coordinate in position.to_array() {
            writer.write_all(&coordinate.to_le_bytes())?;
        }
        for coordinate in photon.direction.unpack().to_array() {
            writer.write_all(&coordinate.to_le_bytes())?;
        }
        for power in map.power(i) {
            writer.write_all(&((f64::from(*power) * share) as f32).to_le_bytes())?;
        }
        writer.write_all(&photon.light.to_le_bytes())?;
        let bounce = map.ways().get(i).map_or(0, |way| way.bounces);
        writer.write_all(&bounce.to_le_bytes())?;
    }
    Ok(())
}

fn header(scene: &Scene, photons: usize) -> String {
    let mut header = String::from("ply\nformat binary_little_endian 1.0\n");
    let unit = scene.quantity.unit_names().flux;
    let mut comment = |text: String| {
        // a line end in a name would end the comment
        let text: String = text.chars().map(|c| if c.is_control() { ' ' } else { c }).collect();
        header.push_str(&format!("comment {text}\n"));
    };
    comment(format!("photons of {}; powers in {unit}, lengths in m", scene.name));
    for (b, band) in scene.bands.iter().enumerate() {
        comment(format!("power_{b}: {}", band.name));
    }
    for (l, light) in scene.lights.iter().enumerate().take(LISTED) {
        comment(format!("light {l}: {}", light.name));
    }
    header.push_str(&format!("element vertex {photons}\n"));
    let mut property = |kind: &str, name: &str| {
        header.push_str(&format!("property {kind} {name}\n"));
    };
    ["x", "y", "z"].into_iter().for_each(|name| property("double", name));
    ["dx", "dy", "dz"].into_iter().for_each(|name| property("float", name));
    (0..scene.bands.len()).for_each(|b| property("float", &format!("power_{b}")));
    property("uint", "light");
    property("ushort", "bounce");
    header.push_str("end_header\n");
    header
}

/// Lights that the header names.
const LISTED: usize = 1000;
