//! Where light is gathered.

use glam::Vec3;

use super::choice::LightChoice;
use crate::scene::{
    light::Light,
    material::{Interaction, Material},
    world::Surface,
};

/// How a path came to a point.
#[derive(Clone, Copy)]
pub(super) struct Arrival {
    /// Where it came from or, at its start, the middle of the captor.
    pub from: Vec3,
    /// Density of the points that it might have come to, 1/m2.
    pub density: f32,
}

/// A point that light is gathered at.
#[derive(Clone, Copy)]
pub(super) struct Vertex {
    pub point: Vec3,
    /// Normal of the surface that a shadow ray must step off, on either side.
    pub step: Option<Vec3>,
    /// Normal of the only side that light counts from.
    pub one_sided: Option<Vec3>,
    /// How a path came here, where light may be sent here as well.
    pub arrival: Option<Arrival>,
    /// Which light it is joined with.
    pub choice: LightChoice,
}

impl Vertex {
    /// A point that lights shine on from all around.
    pub fn new(lights: &[Light], point: Vec3) -> Self {
        let choice = LightChoice::new(lights, point, None);
        Self { point, step: None, one_sided: None, arrival: None, choice }
    }

    /// A point of a surface that a path comes to.
    pub fn on(
        lights: &[Light],
        surface: &Surface,
        material: &Material,
        interaction: &Interaction,
        point: Vec3,
    ) -> Self {
        let one_sided = matches!(material, Material::Lambert(_)).then_some(interaction.normal);
        // what only mirrors or lets through is joined with no light
        let choice = match material.is_diffuse() {
            true => LightChoice::new(lights, point, one_sided),
            false => LightChoice::default(),
        };
        Self { point, step: Some(surface.normal), one_sided, arrival: None, choice }
    }

    /// The cosine between a direction and the normal of its surface.
    pub fn cos(&self, direction: Vec3) -> f32 {
        self.step.or(self.one_sided).map_or(0.0, |normal| normal.dot(direction).abs())
    }
}
