//! Points of the first visible surfaces, joined with the lamps.

use glam::Vec3;

use super::{Path, Pilot, choice::LightChoice, next_event_density, vertex::Vertex};
use crate::{
    math::{
        geometry::Ray,
        rng::Stream,
        spectrum::{Lanes, Spectrum},
    },
    scene::{
        light::LightHit,
        material::{Interaction, Material, Transport},
        world::Scene,
    },
};

/// For pictures to be compared with: one path's estimate of the radiance that comes along `ray` towards its origin, per band, W/m2/sr or
/// umol/m2/s/sr.
#[cfg(test)]
pub fn radiance<L: Lanes>(scene: &Scene, ray: Ray, rng: &mut Stream) -> Spectrum<L> {
    let camera = Vertex::new(&scene.lights, ray.origin);
    let leg = super::Leg { at: camera, ray, density: None, aimed: None, unbroken: true };
    Path { scene, pilot: &Pilot::NONE, rng, rays: 0, cut_off: false }.follow(leg)
}

/// A surface that scatters, joined with the lamps, also through thin panes: for whoever follows its
/// scattering further.
pub struct Joined<'a> {
    scene: &'a Scene,
    material: &'a Material,
    normal: Vec3,
    interaction: Interaction,
    at: Vertex,
}

impl<'a> Joined<'a> {
    /// A `point` of a surface with this `normal` on its front, met by a camera ray, as if it were of `material`.
    pub fn new(
        scene: &'a Scene,
        normal: Vec3,
        material: &'a Material,
        interaction: Interaction,
        point: Vec3,
    ) -> Self {
        let one_sided = (!material.transmits_diffusely()).then_some(interaction.normal);
        let choice = LightChoice::new(&scene.lights, point, one_sided);
        let at = Vertex { point, step: Some(normal), one_sided, arrival: None, choice };
        Self { scene, material, normal, interaction, at }
    }

    /// One light point's estimate of the radiance sent back along the path, less what
    /// [`weight`](Self::weight) leaves to directions that are sampled.
    pub fn radiance<L: Lanes>(&self, rng: &mut Stream) -> Spectrum<L> {
        let along = |d| self.material.pdf(&self.interaction, Transport::Importance, d);
        let mut path =
            Path { scene: self.scene, pilot: &Pilot::NONE, rng, rays: 0, cut_off: false };
        let Some((towards, irradiance)) = path.next_event::<L>(&self.at, along) else {
            return Spectrum::splat(self.scene.lanes(), 0.0);
        };
        let arriving = Interaction {
            triangle: self.interaction.triangle,
            ..Interaction::new(-towards, self.normal)
        };
        let f = self.material.evaluate(&arriving, -self.interaction.direction);
        f.scaled(arriving.cos) * irradiance
    }

    /// What a light counts that a sampled direction meets straight or through panes.
    pub fn weight(&self, ray: &Ray, hit: &LightHit) -> f32 {
        let density = self.material.pdf(&self.interaction, Transport::Importance, ray.direction);
        density / (density + next_event_density(self.scene, &self.at, ray, hit))
    }
}
