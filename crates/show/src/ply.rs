//! Writes photons as a PLY file (G. Turk 1994): binary points, which MeshLab, CloudCompare, Blender
//! and Python open.

use std::io::{self, Write};

use phylux_core::{scene::world::Scene, transport::surface_light::SurfaceLight};

/// Writes every stored photon: its position (m from the user's origin), its direction of travel,
/// its power per band (W or umol/s), the index of its light, and how often it was scattered before.
pub fn write_ply(light: &SurfaceLight, writer: &mut dyn Write) -> io::Result<()> {
    let (scene, map) = (light.scene, &light.map);
    header(scene, map.photons.len(), writer)?;
    let share = 1.0 / map.histories.max(1) as f64;
    let mut point = Vec::new();
    for (i, (position, photon)) in map.positions().iter().zip(&*map.photons).enumerate() {
        let position = (position.as_dvec3() + scene.center()).to_array();
        let direction = photon.direction.unpack().to_array();
        let power = map.power(i).iter().map(|power| (f64::from(*power) * share) as f32);
        let bounces: u32 = map.ways().get(i).map_or(0, |way| way.bounces.into());
        point.clear();
        point.extend(position.iter().flat_map(|x| x.to_le_bytes()));
        point.extend(direction.into_iter().chain(power).flat_map(f32::to_le_bytes));
        point.extend([photon.light, bounces].iter().flat_map(|n| n.to_le_bytes()));
        writer.write_all(&point)?;
    }
    Ok(())
}

/// Writes the header: the names and types of the data that follow.
fn header(scene: &Scene, photons: usize, writer: &mut dyn Write) -> io::Result<()> {
    // a line end in a name would end the line of the header
    let plain = |name: &str| name.replace(char::is_control, " ");
    let (name, unit) = (plain(scene.name()), scene.quantity().unit_names().flux);
    write!(writer, "ply\nformat binary_little_endian 1.0\n")?;
    writeln!(writer, "comment photons of {name}; powers in {unit}, lengths in m")?;
    for (b, band) in scene.bands().iter().enumerate() {
        writeln!(writer, "comment power_{b}: {}", plain(&band.name))?;
    }
    for (l, light) in scene.lights().iter().enumerate().take(LISTED) {
        writeln!(writer, "comment light {l}: {}", plain(&light.name))?;
    }
    write!(
        writer,
        "element vertex {photons}\nproperty double x\nproperty double y\nproperty double z\n"
    )?;
    write!(writer, "property float dx\nproperty float dy\nproperty float dz\n")?;
    for b in 0..scene.bands().len() {
        writeln!(writer, "property float power_{b}")?;
    }
    // all readers know this type of whole numbers (meshio 5.3 has no ushort)
    write!(writer, "property uint light\nproperty uint bounce\nend_header\n")
}

/// Limit on the number of lights that the header names.
const LISTED: usize = 1000;
