//! Histories of light as lines in a glTF file.

use std::io::{self, Write};

use glam::DVec3;
use serde_json::json;

use super::file::GlbFile;
use phylux_results::histories::{HistoriesLine, HistoriesPart, HistoriesResult};

/// The constant of the specification (section 5) for pieces of lines.
const LINES: u8 = 1;
/// Colours that tell groups apart, also for most of those who see few colours (Okabe and Ito 2008),
/// linear, and that of all further groups.
const COLOURS: [[u8; 3]; 7] = [
    [0, 43, 114],
    [201, 87, 0],
    [0, 87, 44],
    [155, 48, 99],
    [170, 28, 0],
    [24, 116, 206],
    [241, 196, 14],
];
const OTHERS: [u8; 3] = [50, 52, 56];

/// Writes the lines of histories as binary glTF, a node for each group of light and last surface, in a
/// colour of its own. Its extras have the share and its error, and the captor. Errors: the file would
/// exceed 4 GiB; writing fails.
pub fn write_glb_lines(result: &HistoriesResult, writer: &mut dyn Write) -> io::Result<()> {
    let mut file = GlbFile::default();
    // near the lines, for the sake of their single precision
    let first = result.lines.first().and_then(|line| line.points.last());
    let center = DVec3::from_array(first.copied().unwrap_or_default());
    for (i, group) in result.groups.iter().enumerate() {
        let own = result.lines.iter().filter(|line| group.has(line));
        let pieces = own.flat_map(|line: &HistoriesLine| line.points.windows(2));
        let near = |point: &[f64; 3]| (DVec3::from_array(*point) - center).as_vec3().to_array();
        let ends: Vec<[f32; 3]> = pieces.flatten().map(near).collect();
        if ends.is_empty() {
            continue;
        }
        let [r, g, b] = COLOURS.get(i).copied().unwrap_or(OTHERS);
        let attributes = json!({
            "POSITION": file.positions(&ends),
            "COLOR_0": file.corner_colours(vec![[r, g, b, 255]; ends.len()]),
        });
        let name = name(group);
        let primitive = json!({ "attributes": attributes, "material": 0, "mode": LINES });
        let column = result.column;
        file.nodes.push(json!({
            "name": name,
            "mesh": file.meshes.len(),
            "extras": { "share": group.share[column], "share_se": group.share_se[column],
                        "histories": group.histories },
        }));
        file.meshes.push(json!({ "name": name, "primitives": [primitive] }));
    }
    let extras = json!({ "to": result.to, "band": result.band, "photons": result.photons });
    file.write((&result.scene, center), extras, "lines", writer)
}

/// Returns the name of a group, such as `lamp, by wall (white)`.
fn name(group: &HistoriesPart) -> String {
    let light = group.light.as_deref().unwrap_or_default();
    match (&group.last_surface, &group.material) {
        (Some(surface), Some(material)) => format!("{light}, by {surface} ({material})"),
        _ => format!("{light}, direct"),
    }
}
