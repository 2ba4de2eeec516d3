//! Next-event estimation at the first visible surfaces, for pictures.

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

/// Returns one path's estimate of the radiance that comes along `ray` towards its origin, per band,
/// W/m2/sr or umol/m2/s/sr. Tests compare pictures with it.
#[cfg(test)]
pub fn radiance<L: Lanes>(scene: &Scene, ray: Ray, rng: &mut Stream) -> Spectrum<L> {
    let camera = Vertex::new(scene, ray.origin);
    let leg = super::Leg { at: camera, ray, density: None, aimed: None, unbroken: true };
    Path { scene, pilot: &Pilot::NONE, rng, rays: 0, cut_off: false }.follow(leg)
}

/// A point of a scattering surface, to be joined with the lamps, also through thin panes. It serves
/// callers that sample directions at the point and follow them themselves.
pub struct Joined<'a> {
    scene: &'a Scene,
    material: &'a Material,
    normal: Vec3,
    interaction: Interaction,
    at: Vertex,
}

impl<'a> Joined<'a> {
    /// Takes a `point` of the interaction's triangle that a camera ray meets, as if it were of
    /// `material`. `normal` is the normal of the surface's front.
    pub fn new(
        scene: &'a Scene,
        normal: Vec3,
        material: &'a Material,
        interaction: Interaction,
        point: Vec3,
    ) -> Self {
        let one_sided = (!material.transmits_diffusely()).then_some(interaction.normal);
        let choice = LightChoice::new(scene, point, one_sided);
        let offset = scene.surface(interaction.triangle as usize).offset;
        let at = Vertex { point, step: Some((normal, offset)), one_sided, arrival: None, choice };
        Self { scene, material, normal, interaction, at }
    }

    /// Estimates, with one light point, the radiance that the surface sends back along the camera
    /// ray, without the part that [`weight`](Self::weight) leaves to sampled directions.
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

    /// Returns the weight, in [0, 1], of a light that a sampled direction meets, straight or
    /// through panes.
    pub fn weight(&self, ray: &Ray, hit: &LightHit) -> f32 {
        let density = self.material.pdf(&self.interaction, Transport::Importance, ray.direction);
        density / (density + next_event_density(self.scene, &self.at, ray, hit))
    }
}
