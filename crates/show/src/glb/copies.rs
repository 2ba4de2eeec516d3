//! Copies whose triangles are merged, as nodes that share meshes.

use std::ops::Range;

use glam::DVec3;
use serde_json::{Value, json};

use super::file::{
    FaceValue, GlbFile, Shown, TRIANGLES, colour, corners, extras, node_name, shown_faces,
};
use crate::{picture::Scale, rendered::RenderedScene, view::shapes::moves};
use phylux_core::{
    math::geometry::{Extent, Transform},
    scene::{
        captor::Channel,
        tiles::{Merged, TileCopies, TilePart},
    },
};

/// A part of a copy: tiles of one material and captor, with the value of each face.
pub(super) struct CopyPart<'a> {
    part: &'a TilePart,
    /// Index of the object among those that have copies.
    object: usize,
    /// The triangles, among those of the first copy.
    triangles: Range<usize>,
    /// A box around the whole first copy.
    extent: Extent,
    /// The transform that takes the first copy to this one.
    to: Transform,
    pub faces: [FaceValue; 2],
}

/// Returns the range of the tiles of all such copies.
pub(super) fn merged(rendered: &RenderedScene) -> Range<usize> {
    let merged = rendered.tiles.copies.iter().filter(|copies| copies.merged.is_some());
    let ends = merged.map(|c| c.first..c.first + c.each * c.transforms.len());
    ends.reduce(|all, range| all.start..range.end).unwrap_or(0..0)
}

/// Returns all parts of these copies. The value of a part is that of its captor or, where it has
/// none, the mean over its tiles.
pub(super) fn parts<'a>(rendered: &'a RenderedScene, shown: &Shown) -> Vec<CopyPart<'a>> {
    let (tiles, scene) = (&rendered.tiles, rendered.scene);
    let mut all = Vec::new();
    let of_object =
        |(object, copies): (usize, &'a TileCopies)| Some((object, copies, copies.merged.as_ref()?));
    for (object, copies, Merged { triangles, starts }) in
        tiles.copies.iter().enumerate().filter_map(of_object)
    {
        let corners = triangles.clone().map(|triangle| scene.triangles().at(triangle));
        let extent = Extent::of_triangles(corners);
        for (copy, to) in moves(copies).enumerate() {
            let (first, end) =
                (copies.first + copy * copies.each, copies.first + (copy + 1) * copies.each);
            let mut tile = first;
            while tile < end {
                let after = tiles.parts.partition_point(|part| part.tiles.end <= tile);
                let part = &tiles.parts[after];
                let range = tile..part.tiles.end.min(end);
                let at = |tile: usize| triangles.start + starts[tile - first] as usize;
                all.push(CopyPart {
                    part,
                    object,
                    triangles: at(range.start)..at(range.end),
                    extent,
                    to,
                    faces: faces(rendered, shown, part, &range),
                });
                tile = range.end;
            }
        }
    }
    all
}

/// Returns the values of the front and the back of a part of a copy.
fn faces(
    rendered: &RenderedScene,
    shown: &Shown,
    part: &TilePart,
    tiles: &Range<usize>,
) -> [FaceValue; 2] {
    let value = |channel| -> FaceValue {
        if let Some(estimate) = part.captor.and_then(|c| rendered.captor(c, channel, shown.band)) {
            return Some(estimate.mean);
        }
        let values = tiles.clone().map(|tile| rendered.value(part, tile, channel, shown.band));
        Some(values.sum::<Option<f64>>()? / tiles.len() as f64)
    };
    match shown.absorbed {
        true => [value(Channel::Absorbed); 2],
        false => [value(Channel::Front), value(Channel::Back)],
    }
}

impl GlbFile {
    /// Adds a part of a copy as a node.
    pub(super) fn copy(&mut self, rendered: &RenderedScene, copy: &CopyPart, range: &Scale) {
        let shown = shown_faces(copy.faces);
        let colours = [0, 1].map(|face| shown[face].then(|| colour(copy.faces[face], range)));
        let key = (copy.object, copy.triangles.start, colours);
        let mesh = match self.coloured.get(&key) {
            Some(mesh) => *mesh,
            None => {
                let primitives: Vec<Value> = [false, true]
                    .into_iter()
                    .zip(colours)
                    .filter_map(|(back, colour)| {
                        Some(self.primitive(rendered, copy, back, colour?))
                    })
                    .collect();
                let name = rendered.tiles.copies[copy.object].object;
                let name = name.map_or("surfaces", |object| &rendered.scene.objects()[object]);
                self.meshes.push(json!({ "name": name, "primitives": primitives }));
                self.coloured.insert(key, self.meshes.len() - 1);
                self.meshes.len() - 1
            }
        };
        let mut extras = extras(rendered, copy.part).unwrap_or_default();
        extras.insert("value".into(), json!(copy.faces));
        let center = rendered.scene.center();
        let at = copy.to.point(copy.extent.min.as_dvec3() + center) - center;
        let [x, y, z] = [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| copy.to.turned(axis));
        let columns = [x.extend(0.0), y.extend(0.0), z.extend(0.0), at.extend(1.0)];
        let matrix: Vec<f32> = columns.iter().flat_map(|c| c.as_vec4().to_array()).collect();
        let name = node_name(rendered, copy.part);
        self.nodes.push(json!({ "name": name, "mesh": mesh, "matrix": matrix, "extras": extras }));
    }

    /// Returns a face of a part of an object in a colour.
    fn primitive(
        &mut self,
        rendered: &RenderedScene,
        copy: &CopyPart,
        back: bool,
        colour: [u8; 3],
    ) -> Value {
        let key = (copy.object, copy.triangles.start, back);
        let position = match self.faces.get(&key) {
            Some(position) => *position,
            None => {
                let low = copy.extent.min;
                let triangles = copy.triangles.clone();
                let triangles = triangles.map(|i| rendered.scene.triangles().at(i));
                let moved = triangles.map(|t| [t.a - low, t.b - low, t.c - low].into());
                let all: Vec<[f32; 3]> = moved.flat_map(|t| corners(&t, back)).collect();
                let position = self.positions(&all);
                self.faces.insert(key, position);
                position
            }
        };
        let next = self.materials.len() + 1;
        let material = *self.materials.entry(colour).or_insert(next);
        let attributes = json!({ "POSITION": position });
        json!({ "attributes": attributes, "material": material, "mode": TRIANGLES })
    }

    /// Returns the materials of one colour each, in order.
    pub(super) fn colours(&self) -> Vec<Value> {
        let mut colours: Vec<_> = self.materials.iter().collect();
        colours.sort_unstable_by_key(|(_, index)| **index);
        let material = |(colour, _): (&[u8; 3], &usize)| {
            let [r, g, b] = colour.map(|c| f32::from(c) / 255.0);
            json!({
                "name": "value",
                "pbrMetallicRoughness": { "baseColorFactor": [r, g, b, 1.0], "metallicFactor": 0 },
                "extensions": { "KHR_materials_unlit": {} },
            })
        };
        colours.into_iter().map(material).collect()
    }
}
