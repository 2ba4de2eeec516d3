//! The shapes that are drawn: runs of tiles. Those of a plant are stored once for all of its copies.

use std::ops::Range;

use glam::{DVec3, Vec3};

use phylux_core::{
    math::geometry::{Extent, Transform, Triangle},
    scene::{
        tiles::{Merged, TileCopies, Tiles},
        world::Scene,
    },
};

/// Tiles that are drawn once for each of their copies.
pub struct Shape<'a> {
    /// Range of the tiles of the first copy; those of the other copies follow.
    pub tiles: Range<usize>,
    /// A box around the first copy.
    pub extent: Extent,
    /// For each copy the transform from the unit cube, as which the box is stored, to metres from
    /// the centre of the scene: the rows of a 3 x 4 matrix.
    pub placements: Vec<[f32; 12]>,
    /// The triangles of its tiles, where a tile has several.
    pub merged: Option<&'a Merged>,
}

impl Shape<'_> {
    /// Returns the triangles of the first copy, m from the centre of the scene.
    pub fn triangles<'s>(
        &self,
        scene: &'s Scene,
        tiles: &'s Tiles,
    ) -> Box<dyn Iterator<Item = Triangle> + 's> {
        match self.merged {
            Some(merged) => Box::new(merged.triangles.clone().map(|i| scene.triangles().at(i))),
            None => Box::new(tiles.corners[self.tiles.clone()].iter().copied()),
        }
    }
}

/// Returns for each copy the transform that takes the first copy there, m from the user's origin.
pub fn moves(copies: &TileCopies) -> impl Iterator<Item = Transform> {
    let back = copies.transforms[0].inverse();
    copies.transforms.iter().map(move |transform| transform.after(&back))
}

/// Returns the shapes of all tiles of a scene, in order.
pub fn shapes<'a>(scene: &Scene, tiles: &'a Tiles) -> Vec<Shape<'a>> {
    let center = scene.center();
    let mut shapes = Vec::new();
    let mut next = 0;
    for copies in &tiles.copies {
        let range = copies.first..copies.first + copies.each;
        let merged = copies.merged.as_ref();
        let (extent, placements) = (Extent::EMPTY, Vec::new());
        let mut shape = Shape { tiles: range.clone(), extent, placements, merged };
        shape.extent = Extent::of_triangles(shape.triangles(scene, tiles));
        let place = |to: Transform| placement(&shape.extent, &to, center);
        shape.placements = moves(copies).map(place).collect();
        // a scale may be too small to be inverted
        if shape.placements.as_flattened().iter().all(|number| number.is_finite()) {
            shapes.extend(alone(tiles, next..range.start));
            next = range.start + copies.each * shape.placements.len();
            shapes.push(shape);
        }
    }
    shapes.extend(alone(tiles, next..tiles.count()));
    shapes
}

/// Returns the shape of tiles without copies, if there are any.
fn alone(tiles: &Tiles, range: Range<usize>) -> Option<Shape<'static>> {
    let extent = Extent::of_triangles(tiles.corners.get(range.clone())?);
    let stays = Transform::new(1.0, DVec3::ZERO, DVec3::ZERO);
    let placements = vec![placement(&extent, &stays, DVec3::ZERO)];
    (!range.is_empty()).then_some(Shape { tiles: range, extent, placements, merged: None })
}

/// Returns the transform from the unit cube to the box, to the user's origin, to where `to` takes
/// it, and back to the centre.
fn placement(extent: &Extent, to: &Transform, center: DVec3) -> [f32; 12] {
    let origin = to.point(extent.min.as_dvec3() + center) - center;
    let size = extent.size().as_dvec3();
    let columns = [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| to.turned(axis * size));
    let row = |i: usize| [columns[0][i], columns[1][i], columns[2][i], origin[i]];
    let mut rows = [0.0; 12];
    rows.iter_mut()
        .zip([row(0), row(1), row(2)].as_flattened())
        .for_each(|(to, x)| *to = *x as f32);
    rows
}

/// Returns a point in 16-bit steps along the sides of a box.
pub fn quantised(p: Vec3, extent: &Extent) -> [u16; 3] {
    // a side without length would give 0/0
    let fraction = (p - extent.min) / extent.size().max(Vec3::splat(f32::MIN_POSITIVE));
    (fraction * 65535.0).to_array().map(|step| step.round() as u16)
}
