//! How much light at a place matters to the captors.

use std::{f32::consts::PI, sync::Arc};

use glam::Vec3;

use super::Cells;
use crate::{
    math::spectrum::with_lanes,
    scene::{
        material::{Interaction, Material},
        world::{Scene, SurfaceHit},
    },
};

/// J: the mean that a watt which arrives at a face brings to the captors, each captor's in units of its own expected
/// light, so that all of them gain alike (FW-CADIS: Wagner, Peplow and Mosher, Nuclear Science and Engineering 176,
/// 2014).
pub struct Importance<'a> {
    cells: Arc<Cells<'a>>,
    values: Vec<f32>,
    /// For each material.
    kept: Vec<f32>,
}

impl<'a> Importance<'a> {
    /// From the importance that arrives at each place of `cells` per area: J = kept / pi of what comes to the face, or to
    /// both where light passes the surface.
    pub fn new(scene: &'a Scene, cells: Arc<Cells<'a>>, arriving: &[f32]) -> Self {
        let kept = kept(scene);
        let mut values = vec![0.0; arriving.len()];
        for (place, material) in cells.materials() {
            let through = scene.materials[material].material.transmits_diffusely();
            let both = [arriving[place], arriving[place ^ 1]];
            let comes = if through { 0.5 * (both[0] + both[1]) } else { both[0] };
            values[place] = kept[material] * comes / PI;
        }
        Self { cells, values, kept }
    }

    /// J of a face at a point.
    #[inline]
    pub fn at(&self, hit: &SurfaceHit, front: bool) -> f32 {
        self.values[self.cells.at(hit, front)]
    }

    /// Whether light matters nowhere.
    pub fn is_zero(&self) -> bool {
        self.values.iter().all(|value| *value == 0.0)
    }

    /// About the share of light that a material sends on, in [0, 1].
    #[inline]
    pub fn kept(&self, material: u32) -> f32 {
        self.kept[material as usize]
    }
}

/// About the share of light that each material sends on: of a ray at 45 degrees, the mean over the bands.
fn kept(scene: &Scene) -> Vec<f32> {
    let of = |material: &Material| -> f32 {
        let at = Interaction::new(Vec3::new(0.0, 0.5f32.sqrt(), -(0.5f32.sqrt())), Vec3::Z);
        with_lanes!(scene.lanes(), L => {
            let bands = scene.bands.len();
            let absorbed = material.absorptance::<L>(&at);
            absorbed.map_or(0.5, |lost| 1.0 - lost.values()[..bands].iter().sum::<f32>() / bands as f32)
        })
    };
    scene.materials.iter().map(|named| of(&named.material).clamp(0.0, 1.0)).collect()
}
