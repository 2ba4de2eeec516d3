//! Writes surfaces and captors as binary glTF 2.0 (Khronos 2017-2021), coloured by a value: for
//! Blender and browsers.
//!
//! Each face has a colour of its own, unless there are so many copies that their triangles are
//! merged (`Merged`): then the copies are nodes that share a mesh, and each part of each copy has one
//! colour.

mod copies;
mod file;
mod lines;

use std::io::{self, Write};

use serde_json::json;

use crate::{picture::Scale, rendered::RenderedScene};
use phylux_core::scene::{captor::Channel, tiles::TilePart};

pub use file::Shown;
use file::{FaceValue, GlbFile, Mesh, NODES, extras, node_name};
pub use lines::write_glb_lines;

/// Fraction of the values that lie below the upper end of a chosen range: a few bright spots would
/// leave everything else dark.
const SHOWN_SHARE: f64 = 0.99;

/// Writes the rendered scene. A face is written where its value is above 0, so that the dark
/// outside of a room does not hide its inside; where neither face has such a value, the front is
/// written. Faces without a known value are pale. Errors: the file would exceed 4 GiB; the range is
/// not valid; writing fails.
pub fn write_glb(
    rendered: &RenderedScene,
    shown: &Shown,
    writer: &mut dyn Write,
) -> io::Result<()> {
    let faces = |part: &TilePart, tile: usize| -> [FaceValue; 2] {
        let value = |channel| rendered.value(part, tile, channel, shown.band);
        match shown.absorbed {
            true => [value(Channel::Absorbed); 2],
            false => [value(Channel::Front), value(Channel::Back)],
        }
    };
    let is_merged = copies::merged(rendered);
    let own = |part: &TilePart| part.tiles.clone().filter(|tile| !is_merged.contains(tile));
    let tiles = || {
        let parts = rendered.tiles.parts.iter();
        parts.flat_map(|part| own(part).map(move |tile| (part, tile)))
    };
    let copies = copies::parts(rendered, shown);
    let range = match shown.range {
        Some((low, high)) => Scale::new(low, high, shown.log).map_err(io::Error::other)?,
        None => {
            let all = tiles().flat_map(|(part, tile)| faces(part, tile));
            let all = all.chain(copies.iter().flat_map(|copy| copy.faces)).flatten();
            Scale::of(all.collect(), SHOWN_SHARE, shown.log)
        }
    };
    let mut file = GlbFile::default();
    let mut rest = &rendered.tiles.parts[..];
    while !rest.is_empty() {
        let together = rest.iter().take_while(|part| one_node(rendered, part, &rest[0])).count();
        let (parts, after) = rest.split_at(together);
        rest = after;
        let mut mesh = Mesh::default();
        for part in parts {
            for tile in own(part) {
                mesh.add(&rendered.tiles.corners[tile], faces(part, tile), &range);
            }
        }
        if !mesh.values.is_empty() {
            file.node(mesh, node_name(rendered, &parts[0]), extras(rendered, &parts[0]));
        }
    }
    for copy in &copies {
        file.copy(rendered, copy, &range);
    }
    let scene = rendered.scene;
    let extras = json!({
        "quantity": if shown.absorbed { "absorbed" } else { "irradiance" },
        "band": scene.band_names().nth(shown.band),
        "unit": scene.units(shown.band)[1],
        "range": [range.low, range.high],
        "logarithmic": range.log,
        "colours": "viridis",
    });
    // centres have the single precision of the triangles
    let center = scene.center().as_vec3().as_dvec3();
    file.write((scene.name(), center), extras, "value", writer)
}

/// Returns whether two parts belong to one node.
fn one_node(rendered: &RenderedScene, part: &TilePart, other: &TilePart) -> bool {
    let captor = |part: &TilePart| match rendered.scene.captors().len() > NODES {
        true => part.captor.map(|_| 0),
        false => part.captor,
    };
    let key = |part: &TilePart| (captor(part), part.object);
    key(part) == key(other)
}
