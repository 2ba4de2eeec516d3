//! Points of the first visible surfaces, joined with the lamps.

use glam::Vec3;

use super::{Path, Pilot, next_event_density, vertex::Vertex};
use crate::{
    math::{
        geometry::Ray,
        rng::Stream,
        spectrum::{Lanes, Spectrum},
    },
    scene::{
        light::LightHit,
        material::{Interaction, Transport},
        world::{Scene, Surface},
    },
};

/// For pictures to be compared with: one path's estimate of the radiance that comes along `ray` towards its origin, per band, W/m2/sr or
/// umol/m2/s/sr.
#[cfg(test)]
pub fn radiance<L: Lanes>(scene: &Scene, ray: Ray, rng: &mut Stream) -> Spectrum<L> {
    let camera = Vertex { point: ray.origin, step: None, one_sided: None, arrival: None };
    let leg = super::Leg { at: camera, ray, density: None, aimed: None, unbroken: true };
    Path { scene, pilot: &Pilot::NONE, rng, rays: 0, cut_off: false }.follow(leg)
}

/// A surface that scatters, joined with the lamps, also through thin panes: for whoever follows its
/// scattering further.
pub struct Joined<'a> {
    scene: &'a Scene,
    surface: &'a Surface,
    interaction: Interaction,
    at: Vertex,
}

impl<'a> Joined<'a> {
    /// A `point` of a `surface`, met by a camera ray.
    pub fn new(
        scene: &'a Scene,
        surface: &'a Surface,
        interaction: Interaction,
        point: Vec3,
    ) -> Self {
        let one_sided = !scene.material(surface).transmits_diffusely();
        let one_sided = one_sided.then_some(interaction.normal);
        Self {
            scene,
            surface,
            interaction,
            at: Vertex { point, step: Some(surface.normal), one_sided, arrival: None },
        }
    }

    /// One light point's estimate of the radiance sent back along the path, less what
    /// [`weight`](Self::weight) leaves to directions that are sampled.
    pub fn radiance<L: Lanes>(&self, rng: &mut Stream) -> Spectrum<L> {
        let material = self.scene.material(self.surface);
        let along = |d| material.pdf(&self.interaction, Transport::Importance, d);
        let mut path =
            Path { scene: self.scene, pilot: &Pilot::NONE, rng, rays: 0, cut_off: false };
        let Some((towards, irradiance)) = path.next_event::<L>(&self.at, along) else {
            return Spectrum::splat(self.scene.lanes(), 0.0);
        };
        let arriving = Interaction {
            triangle: self.interaction.triangle,
            ..Interaction::new(-towards, self.surface.normal)
        };
        let f = material.evaluate(&arriving, -self.interaction.direction);
        f.scaled(arriving.cos) * irradiance
    }

    /// What a light counts that a sampled direction meets straight or through panes.
    pub fn weight(&self, ray: &Ray, hit: &LightHit) -> f32 {
        let material = self.scene.material(self.surface);
        let density = material.pdf(&self.interaction, Transport::Importance, ray.direction);
        density / (density + next_event_density(self.scene, &self.at, ray, hit))
    }
}
