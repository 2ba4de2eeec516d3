//! The importance of light: how much light at a place matters to the captors.

use std::{f32::consts::PI, sync::Arc};

use glam::Vec3;

use super::Cells;
use crate::{
    math::spectrum::with_lanes,
    scene::{
        material::{Interaction, Material, Scatterer},
        world::{Scene, SurfaceHit},
    },
};

/// The importance J of every face: the mean amount of light that a watt which arrives at the face
/// brings to the captors. The light of each captor is in units of the light that it expects, so
/// that all of them gain alike (FW-CADIS: Wagner, Peplow and Mosher, Nuclear Science and
/// Engineering 176, 2014).
pub struct Importance<'a> {
    cells: Arc<Cells<'a>>,
    values: Vec<f32>,
    /// For each material, the approximate fraction of the light that it sends on, in [0, 1].
    kept: Vec<f32>,
}

impl<'a> Importance<'a> {
    /// Computes J from the importance that arrives at each place of `cells` per area. J is kept /
    /// pi of what comes to the face or, if the material transmits diffusely, of the mean over both
    /// faces.
    pub fn new(scene: &'a Scene, cells: Arc<Cells<'a>>, arriving: &[f32]) -> Self {
        let kept = kept(scene);
        let mut values = vec![0.0; arriving.len()];
        for (place, material) in cells.materials() {
            let through = scene.materials()[material].material.transmits_diffusely();
            let both = [arriving[place], arriving[place ^ 1]];
            let comes = if through { 0.5 * (both[0] + both[1]) } else { both[0] };
            values[place] = kept[material] * comes / PI;
        }
        Self { cells, values, kept }
    }

    /// Returns J of a face at a point.
    #[inline]
    pub fn at(&self, hit: &SurfaceHit, front: bool) -> f32 {
        self.values[self.cells.at(hit, front)]
    }

    /// Returns whether J is zero everywhere.
    pub fn is_zero(&self) -> bool {
        self.values.iter().all(|value| *value == 0.0)
    }

    /// Returns the approximate fraction of the light that a material sends on, in [0, 1].
    #[inline]
    pub fn kept(&self, material: u32) -> f32 {
        self.kept[material as usize]
    }
}

/// Returns the approximate fraction of the light that each material sends on: that of a ray at 45
/// degrees, as the mean over the bands.
fn kept(scene: &Scene) -> Vec<f32> {
    let of = |material: &Material| -> f32 {
        let at = Interaction::new(Vec3::new(0.0, 0.5f32.sqrt(), -(0.5f32.sqrt())), Vec3::Z);
        with_lanes!(scene.lanes(), L => {
            let bands = scene.bands().len();
            let absorbed = material.absorptance::<L>(&at);
            absorbed.map_or(0.5, |lost| 1.0 - lost.values()[..bands].iter().sum::<f32>() / bands as f32)
        })
    };
    scene.materials().iter().map(|named| of(&named.material).clamp(0.0, 1.0)).collect()
}
